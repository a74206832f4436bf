"""Sections of the report on inputs, strength, vibration, drives, joints, friction and checks."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import UNSET
from msgspec.structs import asdict, replace

from elastic.assessment import harmonics
from kinelast.answers.checks import NonlinearCheck, NotMade
from kinelast.answers.results import Results
from kinelast.figures.peaks import STATIONS
from kinelast.reports import report
from kinelast.reports.frequencies import frequency_error
from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.scene.parts import PARTS
from kinelast.values.figure import DRIVE, items_of
from kinelast.values.numbers import has_large_error
from kinelast.values.reading import Reader, Reading, known, reading
from machine.cams import CamPush
from rigid import ConstantSpeed, LineLoad, Link, Lump, PointLoad, Resistance, TorsionSpring, law_peaks
from rigid.arrays import Flags
from rigid.kinetostatics import friction_joints, sliding_directions

if TYPE_CHECKING:
    from fem_check.solid import SolidComparison

SAME = 1e-9  # points with a smaller distance, relative to the size of the link, count as equal
STEADY = 1e-9  # a speed whose relative change is smaller is considered constant
EXCITED = ("M", "N", "V")  # section forces; their strain energy measures how strongly a harmonic excites vibration
MIN_POSITIONS = 16  # harmonics of the load are computed only for runs with more positions than this


def inputs_of(results: Results) -> report.Inputs:
    """Return the inputs of a scene for the report, except for the links."""
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
    """Return the value of the first design as a number."""
    return float(np.ravel(value)[0])


def _centre(link: Link, lump: Lump) -> dict[str, Any]:
    """Return the point of a link at which a point mass sits.

    If there is no such point, return another point, with the `offset` of the mass from it in link axes.
    """
    origin, offset = complex(link.points[lump.point]), complex(lump.offset)
    near = SAME * max(map(abs, (offset, *(complex(place) - origin for place in link.points.values()))))
    names = [lump.point, *link.points]
    there = next((name for name in names if abs(complex(link.points[name]) - origin - offset) <= near), None)
    if there is None:
        return {"point": lump.point, "offset": [reading(offset.real, "m"), reading(offset.imag, "m")]}
    return {"point": there}


def _speed(least: float, most: float, unit: str) -> report.DriveSpeed:
    """Return the speed of a drive for the report, and whether it is constant.

    If the speed varies, return its value of largest magnitude.
    """
    fastest = least if abs(least) > abs(most) else most
    return report.DriveSpeed(speed=reading(fastest, f"{unit}/s"), steady=bool(most - least <= STEADY * abs(fastest)))


def _load(given: Any) -> report.LoadReading:
    """Return a load for the report, without the table of values if the load varies."""
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
    if isinstance(load, PointLoad) and not force:
        kind = "moment"
    place = getattr(load, "link", ""), getattr(load, "point", getattr(load, "at", ""))
    varies = getattr(load, "law", None) is not None  # true if the load depends on time, an angle or a slide coordinate
    rows = [reading(size, unit) for size, unit in sizes if size or isinstance(load, LineLoad)]
    return report.LoadReading(resists, kind, *place, varies, rows, reading(np.angle(force), "rad") if force else None)


def strength_of(reader: Reader) -> dict[str, report.BeamStrength]:
    """Return stress range, safety factor, load / critical load and slenderness of every beam, by its label."""
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
    """Return the largest stress range in a beam and its location.

    `swings` contains the stress range in the left and the right fibre, shape (2, stations).
    """
    if np.isnan(swings).all():
        return reading(math.nan, "Pa")
    side, at = np.unravel_index(np.nanargmax(swings), swings.shape)
    return reading(
        swings[side, at], "Pa", along=reading(STATIONS[at] * length, "m"), fibre="left" if side == 0 else "right"
    )


def vibration_of(reader: Reader) -> dict[str, Any] | None:
    """Return the natural frequencies over the cycle, and their excitation by drives and loads.

    Return None without beams.
    """
    results, frequencies = reader.results, reader.results.frequencies
    if frequencies is None:
        return None
    speed, lowest = _steady_speed(results), frequencies.lowest
    size = frequency_error(results) * lowest
    error = {"error": known(size), **({"unreliable": True} if has_large_error(lowest, size) else {})}
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


def _over_cycle(reader: Reader, omega: Any, **entries: dict[str, Any]) -> dict[str, Reading]:
    """Return the lowest and the highest value of a natural frequency over the cycle.

    `entries` contains additional entries for the lowest or the highest value, by the key "lowest" or "highest".
    """
    assert reader.results.frequencies is not None
    position = reader.results.frequencies.position
    low, high = int(np.nanargmin(omega)), int(np.nanargmax(np.where(np.isfinite(omega), omega, -1.0)))
    return {
        key: reading(omega[at], "rad/s", **entries.get(key, {}), **reader.at_position(int(position[at])))
        for key, at in (("lowest", low), ("highest", high))
    }


def _exciting_load(results: Results, lowest: float) -> dict[str, Any] | None:
    """Return the highest harmonic of the load with a large amplitude, and its ratio to the lowest natural frequency.

    Return None if there is no cycle, or if the run has too few positions.
    """
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


def _steady_speed(results: Results) -> float:
    """Return the largest speed of all drives that rotate at constant speed [rad/s]; 0 if there is no such drive."""
    least, most = results.figures.rates
    steady = np.flatnonzero(most - least <= STEADY * np.maximum(np.abs(least), np.abs(most)))
    speeds = (abs(float(most[number])) for number in steady if results.mechanism.drives[number].turns)
    return max(speeds, default=0.0)


def fastest_drive(results: Results) -> float:
    """Return the largest speed of all rotating drives [rad/s]; 0 if no drive rotates."""
    rates = np.abs(results.figures.rates).max(axis=0)
    turning = (rate for drive, rate in zip(results.mechanism.drives, rates.tolist(), strict=True) if drive.turns)
    return float(max((rate for rate in turning if math.isfinite(rate)), default=0.0))


DRIVE_KEYS = {  # key of each figure (result) of a drive, by its key in the report
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
POWERS = "", "^2", "^3"  # powers of s in the units of speed, acceleration and jerk


def law_figures(scene: Scene, number: int) -> dict[str, Any] | None:
    """Return the peaks of speed, acceleration and jerk of a drive. Return None for a constant speed or a given effort.

    `number` counts drives from 0. An infinite jerk becomes null. `jumps` are the times at which the acceleration jumps.
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
    """Return a section for each drive, by name: results, peaks of the law, and machine parts with their results."""
    scene, rows = reader.scene, {}
    for number, name in enumerate(items_of(scene, DRIVE)):
        row: dict[str, Any] = {"coordinate": reader.results.drive_words[number][1]}
        row |= {key: figure for key, of in DRIVE_KEYS.items() if (figure := reader.of_item(of, name))}
        if "effort" in row:
            row["effort"] = _without_place(row["effort"], row.get("rms"))
        row["law"] = law_figures(scene, number)
        for part in PARTS:
            if part.drive_row and name in part.of(scene):
                data = asdict(part.of(scene)[name])
                given = {key: known(_first(value)) for key, value in data.items()}
                row[part.drive_row] = {
                    "given": given,
                    **{each.key: reader.of_item(each.key, name) for each in part.figures},
                }
        rows[name] = row
    return rows


def _without_place(effort: Reading, rms: Reading | None) -> Reading:
    """Return the peak of the effort of a drive.

    The time and drive coordinates are removed if the effort is constant, i.e. if the peak equals the root mean square.
    """
    if effort.value is None or rms is None or rms.value is None:
        return effort
    constant = abs(abs(effort.value) - rms.value) <= STEADY * rms.value
    return replace(effort, time=UNSET, drive=UNSET, between_positions=UNSET) if constant else effort


def joints_of(reader: Reader) -> list[dict[str, Any]]:
    """Return the largest force in each joint, with entries for machine parts such as bearings."""
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
    """Return the section on the friction in the joints, or None if there is no friction."""
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
    """Return whether all joints with friction are at rest, shape (positions,).

    A joint that is held at rest by a drive counts too.
    """
    signs = sliding_directions(results.motion, results.deflection.forces.sliding)
    still: Flags = np.all([sign == 0.0 for sign in signs.values()], axis=0)
    return still & ~results.cycle.lost


def nonlinear_report(check: NonlinearCheck | NotMade | None) -> report.FurtherCheck | None:
    """Return the nonlinear check for the report.

    Differences are relative to the largest chord deflection of the beam.
    """
    if check is None:
        return None
    if isinstance(check, NotMade):
        return report.FurtherCheck(None, None, check.problem)
    return report.FurtherCheck(
        passed=check.passed,
        largest=check.largest,
        too_close_to_decide=check.near,
        cannot_tell=check.cannot_tell,
        elements=check.elements,
        steps=check.steps,
        positions=check.positions,
        estimate=known(check.estimate),
        own_errors={"mesh": check.mesh, "step": check.step},
        links={
            label: {
                "difference": check.difference[label],
                "without_vibration": check.without_vibration[label],
                "peak": reading(check.peak[label], "m"),
            }
            for label in check.difference
        },
    )


def solid_report(check: SolidComparison | NotMade | None) -> report.FurtherCheck | None:
    """Return the check with plane bodies for the report.

    The largest difference is relative to the largest chord deflection.
    """
    if check is None:
        return None
    if isinstance(check, NotMade):
        return report.FurtherCheck(problem=check.problem)
    return report.FurtherCheck(
        largest=known(check.relative),
        links=dict(check.by_link),
        left_out=dict(check.left_out),
        refinement=check.refinement,
        positions=check.compared,
    )
