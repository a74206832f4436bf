"""Sections of the summary: inputs, strength, vibration, drives, joints, life, friction, checks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic.assessment import harmonics
from kinelast.figures.cycle import NOISE
from kinelast.figures.peaks import STATIONS
from kinelast.figures.results import NonlinearCheck, NotMade, Results, at_position, figure, largest
from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.scene.figure import DRIVE, items_of
from kinelast.scene.part import Part
from kinelast.scene.parts import PARTS
from kinelast.scene.parts.bearings import BEARINGS, joints_with, lost_contact
from kinelast.scene.parts.cam_courses import HELD, cam_flanks, cam_force
from kinelast.scene.parts.cams import CAMS
from kinelast.scene.parts.fatigue import beam_fatigue
from machine.cams import CamPush, cut_depth
from rigid import ConstantSpeed, LineLoad, Link, Lump, PointLoad, Resistance, TorsionSpring, law_peaks
from rigid.arrays import Flags
from rigid.kinetostatics import rubbing_joints, sliding_directions

if TYPE_CHECKING:
    from fem_check.solid import SolidComparison

SAME = 1e-9  # distance of coincident places, relative to the size of the link
STEADY = 1e-9  # relative change of a steady speed by round-off
MARKS = 24  # largest number of listed positions without contact
FEW = 16  # too few positions for harmonics of the cycle


def input_figures(results: Results) -> dict[str, Any]:
    """Return the inputs of a scene other than its links."""
    mechanism, sections = results.mechanism, results.deflection.sections
    gravity = complex(mechanism.gravity)
    return {
        "theory": "Timoshenko" if any(np.isfinite(section.kGA) for section in sections) else "Euler-Bernoulli",
        "materials": {
            name: {
                "E": figure(stuff.E, "Pa"),
                "density": figure(stuff.density, "kg/m^3"),
                "yield": figure(np.nan if stuff.yield_stress is None else stuff.yield_stress, "Pa"),
            }
            for name, stuff in results.scene.materials.items()
        },
        "sections": {
            made.section: {
                "area": figure(_first(section.area), "m^2"),
                "inertia": figure(_first(section.inertia), "m^4"),
                "fibre": figure(_first(section.fibre), "m"),
            }
            for made, section in zip(results.scene.made_of, sections, strict=True)
            if np.isfinite(_first(section.area))
        },
        "gravity": {"x": figure(gravity.real, "m/s^2"), "y": figure(gravity.imag, "m/s^2")},
        "drives": {
            name: _speed(least, most, unit)
            for (name, _, unit, _), least, most in zip(results.drive_words, *results.figures.rates, strict=True)
        },
        "point_masses": [
            {"link": link.name, **_centre(link, lump), "mass": figure(lump.mass, "kg")}
            for link in mechanism.links[1:]
            for lump in link.lumps
        ],
        "loads": [dict(_load(load)) for load in mechanism.loads if not isinstance(load, CamPush)],
    }


def _first(value: Any) -> float:
    """Return a number of a section for its first design."""
    return float(np.ravel(value)[0])


def _centre(link: Link, lump: Lump) -> dict[str, Any]:
    """Return the point at the centre of a mass, or a point of the link and the `offset` from it in link axes."""
    origin, offset = complex(link.points[lump.point]), complex(lump.offset)
    near = SAME * max(map(abs, (offset, *(complex(place) - origin for place in link.points.values()))))
    names = [lump.point, *link.points]
    there = next((name for name in names if abs(complex(link.points[name]) - origin - offset) <= near), None)
    if there is None:
        return {"point": lump.point, "offset": [figure(offset.real, "m"), figure(offset.imag, "m")]}
    return {"point": there}


def _speed(least: float, most: float, unit: str) -> dict[str, Any]:
    """Return the largest speed of a drive with its sign, and True if it is constant."""
    fastest = least if abs(least) > abs(most) else most
    return {"speed": figure(fastest, f"{unit}/s"), "steady": bool(most - least <= STEADY * abs(fastest))}


def _load(load: Any) -> Iterator[tuple[str, Any]]:
    """Yield kind, link, place, size (without its table) and direction of a load."""
    resists = isinstance(load, Resistance)
    yield "resists", ("one way" if load.one_way else "both ways") if resists else None
    load = load.load if resists else load
    yield "kind", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(load).__name__).lower()
    yield "link", getattr(load, "link", "")
    yield "place", getattr(load, "point", getattr(load, "at", ""))
    yield "varies", getattr(load, "law", None) is not None  # with time, an angle or a slide
    force: Any = 0.0
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
    given = [figure(size, unit) for size, unit in sizes if size or isinstance(load, LineLoad)]
    yield "sizes", given
    yield "towards", figure(np.angle(force), "rad") if force else None


def strength_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Return stress range, safety, load / critical load and slenderness of every beam."""
    run = results.figures
    return {
        label: {
            "stress_range": _swing(run.swings[:, beam], float(results.deflection.length[beam, 0])),
            "yield_stress": figure(float(results.deflection.sections[beam].yield_stress), "Pa"),
            "safety_factor": largest(results, run.peaks["safety"][beam], "1"),
            "buckling": largest(results, run.peaks["buckling"][beam], "1"),
            "slenderness": figure(results.slenderness[beam], "1"),
        }
        for beam, label in enumerate(results.scene.labels)
    }


def _swing(swings: Any, length: float) -> dict[str, Any]:
    """Return the larger stress range of both fibres, shape (2, stations), and its place."""
    if np.isnan(swings).all():
        return figure(math.nan, "Pa")
    side, at = np.unravel_index(np.nanargmax(swings), swings.shape)
    return figure(
        swings[side, at], "Pa", along=figure(STATIONS[at] * length, "m"), fibre="left" if side == 0 else "right"
    )


def vibration_figures(results: Results) -> dict[str, Any] | None:
    """Return natural frequencies over the cycle and their excitation; None without beams."""
    frequencies = results.frequencies
    if frequencies is None:
        return None
    speed, lowest = fastest_drive(results), frequencies.lowest
    return {
        "positions": len(frequencies.position),
        "natural": [_over_cycle(results, omega) for omega in frequencies.omega if np.isfinite(omega).any()],
        "drive_speed": figure(speed, "rad/s"),
        "drive_to_lowest": figure(speed / lowest, "1"),
        "load": _exciting_load(results, lowest),
    }


def _over_cycle(results: Results, omega: Any) -> dict[str, Any]:
    assert results.frequencies is not None
    position = results.frequencies.position
    low, high = int(np.nanargmin(omega)), int(np.nanargmax(np.where(np.isfinite(omega), omega, -1.0)))
    return {
        "lowest": figure(omega[low], "rad/s", **at_position(results, int(position[low]))),
        "highest": figure(omega[high], "rad/s", **at_position(results, int(position[high]))),
    }


def _exciting_load(results: Results, lowest: float) -> dict[str, Any] | None:
    """Return the fastest strong harmonic of the load; None if there is no cycle."""
    few = len(results.motion.time) <= FEW
    if few or math.isnan(results.period) or not math.isfinite(lowest) or not results.counted.all():
        return None
    spectrum = harmonics(results.deflection, results.period)
    strong = spectrum.strong()
    number = int(strong[-1]) if len(strong) else 0
    return {
        "harmonic": number,
        "frequency": figure(spectrum.omega[number], "rad/s"),
        "to_lowest": figure(spectrum.omega[number] / lowest, "1"),
    }


def fastest_drive(results: Results) -> float:
    """Return the largest speed of a rotating drive [rad/s]; 0 if there is none."""
    rates = np.abs(results.figures.rates).max(axis=0)
    turning = (rate for drive, rate in zip(results.mechanism.drives, rates.tolist(), strict=True) if drive.turns)
    return float(max((rate for rate in turning if math.isfinite(rate)), default=0.0))


DRIVE_KEYS = {  # keys of the summary and their figures
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


def law_figures(scene: Scene, number: int) -> dict[str, Any] | None:
    """Return the peaks of the law of a drive, by its number from 0; None for constant speed or an effort.

    A jerk that is infinite is null, with the times at which the acceleration jumps.
    """
    law = scene.laws[number]
    peaks = None if isinstance(law, DriveEffort | ConstantSpeed) else law_peaks(law)
    if peaks is None:
        return None
    unit = "rad" if scene.mechanism.drives[number].turns else "m"
    sizes = {name: getattr(peaks, name) for name in ("speed", "acceleration", "jerk")}
    told = {name: figure(size, f"{unit}/s{power}") for (name, size), power in zip(sizes.items(), POWERS, strict=True)}
    return {**told, "jumps": [figure(time, "s") for time in peaks.jumps]}


POWERS = "", "^2", "^3"  # powers of the second in units of derivatives


def drive_figures(results: Results) -> list[dict[str, Any]]:
    """Return the figures of every drive, the peaks of its law, and data and figures of its parts."""
    scene = results.scene
    names = items_of(scene, DRIVE)
    rows = []
    for number, name in enumerate(names):
        row: dict[str, Any] = {key: each for key, of in DRIVE_KEYS.items() if (each := _figure_of(results, of, name))}
        row["law"] = law_figures(scene, number)
        for part in PARTS:
            if part.drive_row and name in part.of(scene):
                data = {key: float(np.ravel(value)[0]) for key, value in vars(part.of(scene)[name]).items()}
                given = {key: value if math.isfinite(value) else None for key, value in data.items()}
                found = {each.key: _figure_of(results, each.key, name) for each in part.figures}
                row[part.drive_row] = {"given": given, **found}
        rows.append(row)
    return rows


def _figure_of(results: Results, key: str, name: str) -> dict[str, Any] | None:
    """Return the largest value of an item over the cycle; None if the figure has no such item."""
    known = next(each for each in results.figures.figures if each.key == key)
    items = items_of(results.scene, known.of)
    if name not in items:
        return None
    at = items.index(name)
    return largest(results, results.figures.peaks[key][at], known.units(results.scene)[at])


def cam_rows(results: Results) -> dict[str, dict[str, Any]]:
    """Return the figures of every cam, with undercut and lost contact.

    `counts`: at how many positions that is; `cut`: how deep the follower at another place cuts into the profile, as it
    does where the cam cannot be made.
    """
    scene, cycle, rows = results.scene, results.cycle, {}
    for name, cam in scene.cams.items():
        flanks = cam_flanks(cycle, name)
        figures = {each.key: _figure_of(results, each.key, name) for each in CAMS.figures}
        undercut = np.any([flank.undercut for flank in flanks], axis=0)
        force = cam_force(cycle, name) if name in items_of(scene, HELD) else np.ones(1)
        noise = NOISE * float(np.nanmax(np.abs(force), initial=0.0))
        lost = np.broadcast_to(force < -noise, results.motion.columns)
        rows[name] = {
            "follower": results.mechanism.links[cam.link].name,
            "drive": items_of(scene, DRIVE)[cam.drive],
            "flank": cam.flank,
            "speed": figure(np.ravel(cam.speed)[0], "rad/s"),
            "cut": figure(max(float(cut_depth(flank).max(initial=0.0)) for flank in flanks), "m"),
            "undercut": _marks(results, undercut),
            "contact_lost": _marks(results, lost),
            "counts": {
                "undercut": int(np.sum(undercut & results.counted)),
                "contact_lost": int(np.sum(lost & results.counted)),
            },
            "figures": {key: each for key, each in figures.items() if each is not None},
        }
    return rows


def _marks(results: Results, there: Flags) -> list[dict[str, Any]]:
    """Return positions with a property; of many the first, the last and some between."""
    at = np.flatnonzero(there & results.counted)
    some = at if len(at) <= MARKS else at[np.linspace(0, len(at) - 1, MARKS).astype(int)]
    return [at_position(results, int(position)) for position in some]


def part_rows(results: Results) -> dict[str, dict[str, dict[str, Any]]]:
    """Return data and figures of parts with a separate section, by kind and name."""
    return {
        part.key: {
            name: _part_row(results, part, name, part.facts(own)) for name, own in part.of(results.scene).items()
        }
        for part in PARTS
        if part.facts is not None
    }


def _part_row(results: Results, part: Part[Any], name: str, facts: Mapping[str, Any]) -> dict[str, Any]:
    figures = {each.key: _figure_of(results, each.key, name) for each in part.figures}
    return {
        **{key: figure(*fact) if isinstance(fact, tuple) else fact for key, fact in facts.items()},
        "figures": {key: found for key, found in figures.items() if found is not None},
    }


SENSES = {1: "turns counter-clockwise", -1: "turns clockwise", 0: "swings"}


def joint_rows(results: Results) -> list[dict[str, Any]]:
    """Return the force of every joint, and the figures of its parts under [bearings]."""
    scene, rows = results.scene, []
    for number, ((joint, link), peak) in enumerate(
        zip(results.joint_words, results.figures.peaks["joint_force"], strict=True)
    ):
        row = {"joint": joint, "on": link, "force": largest(results, peak, "N")}
        rows.append({**row, **_joint_parts(results, number)} if joint in scene.bearings else row)
    return rows


def _joint_parts(results: Results, number: int) -> dict[str, Any]:
    scene, course = results.scene, results.cycle.joint(number)
    figures = {}
    for each in BEARINGS.figures:
        numbers = [*joints_with(scene, each.of)]
        if number in numbers:
            item = numbers.index(number)
            figures[each.key] = largest(results, results.figures.peaks[each.key][item], each.units(scene)[item])
    lost: list[dict[str, Any]] = []
    if "contact_losses" in figures:
        lost = [at_position(results, at) for at in np.flatnonzero(lost_contact(results.cycle, number)).tolist()[:MARKS]]
    turns = {key: figure(course.force_turns(child), "1") for key, child in (("child", True), ("parent", False))}
    return {
        "parent": results.mechanism.links[results.motion.structure.joints[number].parent].name,
        "sense": SENSES[int(course.sense)] if course.turns else "slides",
        "force_turns": turns,
        "contact_lost": lost,
        "figures": figures,
    }


def life_figures(results: Results) -> dict[str, Any] | None:
    """Return endurance and life of every beam with the place; None without [fatigue]."""
    scene, run = results.scene, results.figures
    if scene.fatigue is None:
        return None
    fatigue, rows = beam_fatigue(results.cycle), {}
    for beam, label in enumerate(scene.labels):
        peak, strength = run.peaks["endurance"][beam], scene.fatigue.strengths[beam]
        rows[label] = {
            "endurance": largest(results, peak, "1"),
            "cycles": largest(results, run.peaks["life_cycles"][beam], "1"),
            "life": largest(results, run.peaks["life"][beam], "s"),
            "endless": bool(np.isposinf(run.peaks["life"][beam].value)),
            "amplitude": figure(fatigue.amplitude[beam], "Pa"),
            "mean": figure(fatigue.mean[beam], "Pa"),
            "along": figure(peak.xi * float(results.deflection.length[beam, 0]), "m"),
            "fibre": "left" if peak.row == 0 else "right",
            "endurance_limit": figure(np.ravel(strength.limit)[0], "Pa"),
            "factors": {key: float(np.ravel(value)[0]) for key, value in scene.fatigue.factors[beam].items()},
        }
    return {"criterion": scene.fatigue.criterion, "links": rows}


def friction_figures(results: Results) -> dict[str, Any] | None:
    """Return friction efforts and friction power of the joints; None without friction."""
    rubbing = rubbing_joints(results.mechanism)
    if not rubbing:
        return None
    peaks, words = results.figures.peaks, results.joint_words
    places = results.motion.places
    units = ["N m" if places[number].turns else "N" for number, _ in rubbing]
    return {
        "joints": [
            {"joint": words[number][0], "on": words[number][1], "effort": largest(results, peak, unit)}
            for (number, _), peak, unit in zip(rubbing, peaks["friction_effort"], units, strict=True)
        ],
        "power": largest(results, peaks["friction_power"][0], "W"),
        "feedback": figure(peaks["friction_feedback"][0].value, "1"),
        "locked": results.figures.locked,
        "resting": int(np.count_nonzero(resting(results))),
    }


def resting(results: Results) -> Flags:
    """Return True if no joint with friction slides, even if a drive holds it, shape (positions,)."""
    signs = sliding_directions(results.motion, results.deflection.forces.sliding)
    still: Flags = np.all([sign == 0.0 for sign in signs.values()], axis=0)
    return still & ~results.singular


def nonlinear_figures(check: NonlinearCheck | NotMade | None) -> dict[str, Any] | None:
    """Return the nonlinear check as plain data, relative to the largest deflection from the chord."""
    if check is None:
        return None
    if isinstance(check, NotMade):
        return {"passed": None, "largest": None, "problem": check.problem}
    return {
        "passed": check.passed,
        "largest": check.largest,
        "too_close_to_decide": check.near,
        "cannot_tell": check.cannot_tell,
        "elements": check.elements,
        "steps": check.steps,
        "positions": check.positions,
        "estimate": None if math.isnan(check.estimate) else check.estimate,
        "own_errors": {"mesh": check.mesh, "step": check.step},
        "links": {
            label: {
                "difference": check.difference[label],
                "without_vibration": check.without_vibration[label],
                "peak": {"value": check.peak[label], "unit": "m"},
            }
            for label in check.difference
        },
    }


def solid_figures(check: SolidComparison | NotMade | None) -> dict[str, Any] | None:
    """Return the solid check as plain data, relative to the largest deflection from the chord."""
    if check is None:
        return None
    if isinstance(check, NotMade):
        return {"largest": None, "problem": check.problem}
    return {
        "largest": None if math.isnan(check.relative) else check.relative,
        "links": dict(check.by_link),
        "left_out": dict(check.left_out),
        "refinement": check.refinement,
        "positions": check.compared,
    }
