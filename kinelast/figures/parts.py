"""Sections of the report on inputs, strength, vibration, drives, joints, friction and reserves."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from elastic.assessment import harmonics
from kinelast.figures import report
from kinelast.figures.entry import bounded_items
from kinelast.figures.errors import RECIPROCAL
from kinelast.figures.leading_drive import nominal_speed
from kinelast.figures.peaks import STATIONS
from kinelast.figures.results import Results
from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.scene.figure import BEAM, DRIVE, OUTPUT_ERROR, SCENE, Limit, items_of
from kinelast.scene.parts import PARTS
from kinelast.scene.parts.fatigue import FATIGUED
from kinelast.scene.reading import Reader, Reading, known, reading
from machine.cams import CamPush
from rigid import ConstantSpeed, LineLoad, Link, Lump, PointLoad, Resistance, TorsionSpring, law_peaks
from rigid.arrays import Flags
from rigid.kinetostatics import friction_joints, sliding_directions

SAME = 1e-9  # distance of coincident points, relative to the size of the link
STEADY = 1e-9  # largest relative change of a speed that is considered constant
EXCITED = ("M", "N", "V")  # section forces that measure the excitation by their strain energy
MIN_POSITIONS = 16  # harmonics of the cycle are computed only with more positions than this


def inputs_of(results: Results) -> report.Inputs:
    """Return the inputs of a scene, except for its links."""
    mechanism, sections = results.mechanism, results.deflection.sections
    gravity = complex(mechanism.gravity)
    return report.Inputs(
        theory="Timoshenko" if any(np.isfinite(section.kGA) for section in sections) else "Euler-Bernoulli",
        materials={
            name: report.MaterialReading(
                reading(stuff.E, "Pa"),
                reading(stuff.density, "kg/m^3"),
                reading(np.nan if stuff.yield_stress is None else stuff.yield_stress, "Pa"),
            )
            for name, stuff in results.scene.materials.items()
        },
        sections={
            made.section: {
                "area": reading(_first(section.area), "m^2"),
                "inertia": reading(_first(section.inertia), "m^4"),
                "fibre": reading(_first(section.fibre), "m"),
            }
            for made, section in zip(results.scene.made_of, sections, strict=True)
            if np.isfinite(_first(section.area))
        },
        gravity={"x": reading(gravity.real, "m/s^2"), "y": reading(gravity.imag, "m/s^2")},
        drives={
            name: _speed(least, most, unit)
            for (name, _, unit, _), least, most in zip(results.drive_words, *results.figures.rates, strict=True)
        },
        point_masses=[
            {"link": link.name, **_centre(link, lump), "mass": reading(lump.mass, "kg")}
            for link in mechanism.links[1:]
            for lump in link.lumps
        ],
        loads=[_load(load) for load in mechanism.loads if not isinstance(load, CamPush)],
    )


def _first(value: Any) -> float:
    """Return the value for the first design."""
    return float(np.ravel(value)[0])


def _centre(link: Link, lump: Lump) -> dict[str, Any]:
    """Return the link's point at the centre of a mass, or any point with the `offset` of the centre in link axes."""
    origin, offset = complex(link.points[lump.point]), complex(lump.offset)
    near = SAME * max(map(abs, (offset, *(complex(place) - origin for place in link.points.values()))))
    names = [lump.point, *link.points]
    there = next((name for name in names if abs(complex(link.points[name]) - origin - offset) <= near), None)
    if there is None:
        return {"point": lump.point, "offset": [reading(offset.real, "m"), reading(offset.imag, "m")]}
    return {"point": there}


def _speed(least: float, most: float, unit: str) -> report.DriveSpeed:
    """Return the speed of largest magnitude of a drive, and whether the speed is constant."""
    fastest = least if abs(least) > abs(most) else most
    return report.DriveSpeed(speed=reading(fastest, f"{unit}/s"), steady=bool(most - least <= STEADY * abs(fastest)))


def _load(given: Any) -> report.LoadReading:
    """Return the description of a load, without the table of its law."""
    resists = None
    load: Any = given
    force: Any = 0.0
    if isinstance(given, Resistance):
        load, resists = given.load, "one way" if given.one_way else "both ways"
    sizes: list[tuple[Any, str]]
    if isinstance(load, PointLoad):
        force = load.force
        sizes = [(abs(force), "N"), (load.moment, "N m")]
    elif isinstance(load, LineLoad):
        force = load.start or load.end
        sizes = [(abs(load.start), "N/m"), (abs(load.end), "N/m")]
    else:
        turned = isinstance(load, TorsionSpring)
        per = ("N m/rad", "N m s/rad", "N m") if turned else ("N/m", "N s/m", "N")
        sizes = list(zip((load.stiffness, load.damping, load.preload), per, strict=True))
    kind = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(load).__name__).lower()
    place = getattr(load, "link", ""), getattr(load, "point", getattr(load, "at", ""))
    varies = getattr(load, "law", None) is not None  # true if the load depends on time, an angle or a slide coordinate
    rows = [reading(size, unit) for size, unit in sizes if size or isinstance(load, LineLoad)]
    return report.LoadReading(resists, kind, *place, varies, rows, reading(np.angle(force), "rad") if force else None)


def strength_of(reader: Reader) -> dict[str, report.BeamStrength]:
    """Return the stress range, safety factor, load / critical load and slenderness of every beam."""
    results, run = reader.results, reader.results.figures
    return {
        label: report.BeamStrength(
            _swing(run.swings[:, beam], float(results.deflection.length[beam, 0])),
            reading(float(results.deflection.sections[beam].yield_stress), "Pa"),
            reader.largest(run.peaks["safety"][beam], "1"),
            reader.largest(run.peaks["buckling"][beam], "1"),
            reading(results.slenderness[beam], "1"),
        )
        for beam, label in enumerate(results.scene.labels)
    }


def _swing(swings: Any, length: float) -> Reading:
    """Return the largest stress range in the fibres and its location; `swings` has the shape (2, stations)."""
    if np.isnan(swings).all():
        return reading(math.nan, "Pa")
    side, at = np.unravel_index(np.nanargmax(swings), swings.shape)
    return reading(
        swings[side, at], "Pa", along=reading(STATIONS[at] * length, "m"), fibre="left" if side == 0 else "right"
    )


def vibration_of(reader: Reader) -> dict[str, Any] | None:
    """Return the natural frequencies over the cycle and their excitation, or None if there are no beams."""
    results, frequencies = reader.results, reader.results.frequencies
    if frequencies is None:
        return None
    speed, lowest = fastest_drive(results), frequencies.lowest
    error = {"error": known(results.figures.frequency_error * lowest)}
    return {
        "positions": len(frequencies.position),
        "natural": [
            _over_cycle(reader, omega, lowest=error if mode == 0 else {})
            for mode, omega in enumerate(frequencies.omega)
            if np.isfinite(omega).any()
        ],
        "drive_speed": reading(speed, "rad/s"),
        "drive_to_lowest": reading(speed / lowest, "1"),
        "load": _exciting_load(results, lowest),
    }


def _over_cycle(reader: Reader, omega: Any, **lowest: dict[str, Any]) -> dict[str, Reading]:
    """Return the lowest and highest value of a natural frequency over the cycle, each with its own more entries."""
    assert reader.results.frequencies is not None
    position = reader.results.frequencies.position
    low, high = int(np.nanargmin(omega)), int(np.nanargmax(np.where(np.isfinite(omega), omega, -1.0)))
    return {
        key: reading(omega[at], "rad/s", **lowest.get(key, {}), **reader.at_position(int(position[at])))
        for key, at in (("lowest", low), ("highest", high))
    }


def _exciting_load(results: Results, lowest: float) -> dict[str, Any] | None:
    """Return the highest strong harmonic of the load, or None if there is no cycle or it has few positions."""
    few = len(results.motion.time) <= MIN_POSITIONS
    if few or math.isnan(results.period) or not math.isfinite(lowest) or not results.cycle.counted.all():
        return None
    spectrum = harmonics(results.deflection, results.period, EXCITED)
    strong = spectrum.strong()
    number = int(strong[-1]) if len(strong) else 0
    return {
        "harmonic": number,
        "frequency": reading(spectrum.omega[number], "rad/s"),
        "to_lowest": reading(spectrum.omega[number] / lowest, "1"),
    }


def fastest_drive(results: Results) -> float:
    """Return the largest speed of a rotating drive [rad/s]; 0 if there is none."""
    rates = np.abs(results.figures.rates).max(axis=0)
    turning = (rate for drive, rate in zip(results.mechanism.drives, rates.tolist(), strict=True) if drive.turns)
    return float(max((rate for rate in turning if math.isfinite(rate)), default=0.0))


DRIVE_KEYS = {  # keys of figures by their keys in the report
    "effort": "drive_effort",
    "rms": "drive_rms",
    "mean": "drive_mean",
    "speed": "drive_speed",
    "power": "drive_power",
    "mean_power": "drive_mean_power",
    "energy_taken": "energy_taken",
    "energy_given": "energy_given",
    "load_inertia": "load_inertia",
    "energy_fluctuation": "energy_fluctuation",
    "flywheel": "flywheel",
    "flywheel_added": "flywheel_added",
}
POWERS = "", "^2", "^3"  # powers of the second in units of derivatives


def law_figures(scene: Scene, number: int) -> dict[str, Any] | None:
    """Return the peaks of a drive's law, or None for a constant speed or an effort.

    `number` counts drives from 0. An infinite jerk becomes null; `jumps` are the times at which the acceleration jumps.
    """
    law = scene.laws[number]
    peaks = None if isinstance(law, DriveEffort | ConstantSpeed) else law_peaks(law)
    if peaks is None:
        return None
    unit = "rad" if scene.mechanism.drives[number].turns else "m"
    pairs = zip(("speed", "acceleration", "jerk"), POWERS, strict=True)
    sizes = {name: reading(getattr(peaks, name), f"{unit}/s{power}") for name, power in pairs}
    return {**sizes, "jumps": [reading(time, "s") for time in peaks.jumps]}


def drives_of(reader: Reader) -> dict[str, dict[str, Any]]:
    """Return the figures of each drive by name, the peaks of its law, and the data and figures of its parts."""
    scene, rows = reader.scene, {}
    for number, name in enumerate(items_of(scene, DRIVE)):
        row: dict[str, Any] = {"coordinate": reader.results.drive_words[number][1]}
        row |= {key: figure for key, of in DRIVE_KEYS.items() if (figure := reader.of_item(of, name))}
        row["law"] = law_figures(scene, number)
        for part in PARTS:
            if part.drive_row and name in part.of(scene):
                data = vars(part.of(scene)[name])
                given = {key: known(_first(value)) for key, value in data.items()}
                row[part.drive_row] = {
                    "given": given,
                    **{each.key: reader.of_item(each.key, name) for each in part.figures},
                }
        rows[name] = row
    return rows


def joints_of(reader: Reader) -> list[dict[str, Any]]:
    """Return the force in each joint, together with the entries of its parts."""
    rows = []
    pairs = zip(reader.results.joint_words, reader.results.figures.peaks["joint_force"], strict=True)
    for number, ((joint, link), peak) in enumerate(pairs):
        row = {"joint": joint, "on": link, "force": reader.largest(peak, "N")}
        for part in PARTS:
            if joint in part.of(reader.scene):
                row |= part.joint_row(reader, number)
        rows.append(row)
    return rows


def friction_of(reader: Reader) -> report.FrictionReport | None:
    """Return the friction efforts and the friction power of the joints, or None if there is no friction."""
    results = reader.results
    rubbing = friction_joints(results.mechanism)
    if not rubbing:
        return None
    peaks, words, places = results.figures.peaks, results.joint_words, results.motion.places
    return report.FrictionReport(
        joints=[
            report.RubbingJoint(*words[number], reader.largest(peak, "N m" if places[number].turns else "N"))
            for (number, _), peak in zip(rubbing, peaks["friction_effort"], strict=True)
        ],
        power=reader.largest(peaks["friction_power"][0], "W"),
        feedback=reading(peaks["friction_feedback"][0].value, "1"),
        locked=results.figures.locked,
        resting=int(np.count_nonzero(resting(results))),
    )


def resting(results: Results) -> Flags:
    """Return whether all joints with friction are at rest, even if a drive holds them there, shape (positions,)."""
    signs = sliding_directions(results.motion, results.deflection.forces.sliding)
    still: Flags = np.all([sign == 0.0 for sign in signs.values()], axis=0)
    return still & ~results.cycle.singular


RESERVES = {  # figure of each failure mode, and its exponent in the reserve
    "yield": ("safety", 1.0),
    "endurance": ("endurance", 1.0),
    "buckling": ("buckling", -1.0),
}
LIMIT_MODES = {"safety": "safety limit", "endurance": "endurance limit", "buckling": "buckling limit"}
"""Names of limits on the figures of failure modes. A limit on another figure is named by the key of the figure."""
OUTPUT_LIMIT = "output"  # name of the limit on the error of the output


def breaks_first(results: Results) -> list[report.LinkReserves]:
    """Return the reserves of each link and of the output, sorted by increasing reserve.

    A reserve is the factor by which loads can increase until a link fails or exceeds a limit. The modes are yield,
    endurance and buckling, if known, and the limits on figures of beams and on the output. If a finite life is
    required, endurance is replaced by the stress factor from the slope of the S-N line. `kinelast.runs` adds the limit
    speed on request.
    """
    reader, limits = Reader(results), [(limit, bounded_items(results.scene, limit)) for limit in results.limits]
    rows = []
    for number, link in enumerate(results.mechanism.links):
        beams = [beam for beam, (owner, _) in enumerate(results.mechanism.beams) if owner == number]
        if reserves := _smallest(_reserves(reader, limits, beams)) if beams else {}:
            rows.append(reserves_of(link.name, reserves))
    output = results.figures.output
    if output and (reserves := _smallest(_output_reserves(reader))):
        rows.append(reserves_of(f"output {output.point or output.link}", reserves))
    return sorted(rows, key=reserve_of)


def reserves_of(link: str, reserves: Mapping[str, Reading]) -> report.LinkReserves:
    """Return the entry of a link, with all its reserves and the smallest one."""
    mode = min(reserves, key=lambda each: _size(reserves[each]))
    return report.LinkReserves(link=link, governs=mode, reserve=reserves[mode], reserves=reserves)


def reserve_of(row: report.LinkReserves) -> float:
    """Return the smallest reserve of a link."""
    return _size(row.reserve)


def _size(found: Reading) -> float:
    return math.inf if found.value is None else found.value


def _smallest(reserves: Iterable[tuple[str, Reading]]) -> dict[str, Reading]:
    """Return the smallest reserve of each mode."""
    smallest: dict[str, Reading] = {}
    for mode, reserve in reserves:
        if mode not in smallest or _size(reserve) < _size(smallest[mode]):
            smallest[mode] = reserve
    return smallest


def _reserves(
    reader: Reader, limits: Sequence[tuple[Limit, list[int]]], beams: Sequence[int]
) -> Iterator[tuple[str, Reading]]:
    """Yield the smallest reserve among the beams of a link, for each known failure mode and each limit."""
    scene, peaks = reader.scene, reader.results.figures.peaks
    asked = max((float(limit.bound) for limit, items in limits if limit.figure == "life" and {*items} & {*beams}),
                default=None)  # fmt: skip
    finite = asked is not None and any(0 < peaks["life"][beam].value < math.inf for beam in beams)
    for mode, (key, power) in RESERVES.items():
        if mode == "endurance" and finite and scene.fatigue and asked is not None:
            slope = float(scene.fatigue.strengths[beams[0]].slope)
            yield from _reserve(reader, "life", "life", 1.0 / slope, beams, asked)
        else:
            yield from _reserve(reader, mode, key, power, beams, 1.0)
    for limit, items in limits:
        if limit.of in (BEAM, FATIGUED) and limit.figure != "life":
            own = [beam for beam in beams if beam in items]
            yield from _limit_reserve(reader, LIMIT_MODES.get(limit.figure, limit.figure), limit, own)


def _output_reserves(reader: Reader) -> Iterator[tuple[str, Reading]]:
    """Yield the reserves of the output against the limits on its error."""
    for limit in reader.results.limits:
        if limit.figure == OUTPUT_ERROR:
            yield from _limit_reserve(reader, OUTPUT_LIMIT, limit, [0])


def _limit_reserve(reader: Reader, mode: str, limit: Limit, items: Sequence[int]) -> Iterator[tuple[str, Reading]]:
    """Yield the smallest reserve of the given items against a limit, unless larger loads move away from the limit."""
    if limit.bound > 0 and limit.least == (limit.figure in RECIPROCAL):
        yield from _reserve(reader, mode, limit.figure, 1.0 if limit.least else -1.0, items, float(limit.bound))


def _reserve(
    reader: Reader, mode: str, key: str, power: float, items: Sequence[int], bound: float
) -> Iterator[tuple[str, Reading]]:
    figures, scene = reader.results.figures, reader.scene
    peaks = figures.peaks.get(key) or []
    finite = [(item, peaks[item]) for item in items if peaks and math.isfinite(peaks[item].value) and peaks[item].value]
    if finite:
        item, peak = min(finite, key=lambda each: abs(each[1].value) ** power)
        value = (abs(peak.value) / bound) ** power
        figure = figures.by_key[key]
        error = reader.error_of(peak, figure.units(scene)[item])  # a reserve is as reliable as its figure
        if error["error"] is not None:
            error["error"] *= abs(power) * value / abs(peak.value)
        label = {} if figure.of == SCENE else {"label": scene.labels[item]}
        yield mode, reading(value, "1", **error, **label, **reader.at_peak(peak))


def with_limit_speed(
    rows: Sequence[report.LinkReserves], speeds: Mapping[str, Any], scene: Scene
) -> list[report.LinkReserves]:
    """Return the rows of `breaks_first`, adding the reserve to the limit speed to the link that determines it.

    Parameters
    ----------
    speeds
        Plain data of the speeds, as returned by `kinelast.outputs.speeds.speed_figures`.
    """
    limit, highest = speeds["limit"], speeds["highest_within_limits"]
    if not limit or not limit["of"] or not highest:
        return [*rows]
    reserve = Reading(value=highest / nominal_speed(scene), unit="1", error=None, label=limit["of"])
    owner = scene.mechanism.beams[scene.labels.index(limit["of"])][0] if limit["of"] in scene.labels else -1
    its = "" if owner < 0 else scene.mechanism.links[owner].name
    more = [reserves_of(row.link, {**row.reserves, "limit speed": reserve}) if row.link == its else row for row in rows]
    return sorted(more, key=reserve_of)
