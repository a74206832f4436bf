"""Findings on unusual numbers in the inputs, and on runs and loads that do not form a cycle."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from elastic.beams import POISSON
from kinelast.answers.results import Results
from kinelast.reports.sections import fastest_drive
from kinelast.scene.data import Scene
from kinelast.scene.parts import PARTS
from kinelast.values.numbers import number, percent, quantity
from kinelast.values.reading import CAUTION, GOOD, OPEN, POOR, Finding
from rigid import LineLoad, Motion, PointLoad, Resistance

INPUTS = "Inputs"
LONG, SHORT = 90.0, 1e-5  # [m] largest and smallest usual length of the longest link
THICK = 5.0  # usual largest depth or width of a section, relative to the length of its link
FAST = 1e5  # [rad/s] twice the speed of a dental drill
USUAL = {  # by kind of object and by key: name in words, smallest and largest usual value, unit, example
    "solid": {  # E: from soft rubber to diamond; density: from foam to osmium
        "E": ("E", 1e6, 2e12, "Pa", "210 GPa"),
        "density": ("density", 10.0, 3e4, "kg/m^3", "7.85 g/cm^3"),
        "yield_stress": ("yield stress", 1e3, 1e11, "Pa", "250 MPa"),
    }
}
GRAVITY = 3e3  # [m/s^2] ten times the gravity of the Sun, but less than the number 9810 of the Earth in mm/s^2
RATIO_TOLERANCE = 1e-6  # relative tolerance within which two loads count as equal, or a ratio counts as an integer
LOAD_INSTANTS = 9  # number of instants at which a load is evaluated to find its largest value
MAX_CYCLES = 1000  # if a run is longer than this many cycles, it is not checked whether their number is an integer
CYCLE_TOLERANCE = 1e-3  # a duration that differs by less from a cycle was probably meant to be the cycle


def input_findings(results: Results) -> Iterator[Finding]:
    """Yield findings on the numbers and materials of a scene."""
    yield from _numbers(results)
    yield from _poisson(results)
    yield from _idle_loads(results)


def _numbers(results: Results) -> Iterator[Finding]:
    """Yield findings on unrealistic numbers, which were probably given in a wrong unit."""
    yield from _sizes(results)
    usual = {**USUAL, **{part.key: part.usual for part in PARTS}}
    for kind, whose, owner in _owners(results.scene):
        for name, (what, least, most, unit, example) in usual[kind].items():
            value = getattr(owner, name, None)
            if value is not None and math.isfinite(value) and value and not least <= value <= most:
                shown = (
                    f"{what} of {whose} is {float(value):.4g} {unit}, which is unusual for a {kind.removesuffix('s')}"
                )
                hint = f'a bare number is in {unit}, write other units as in "{example}"'
                yield Finding(POOR, INPUTS, f"The {shown}: {hint}.")
    if (gravity := abs(complex(results.mechanism.gravity))) > GRAVITY:
        hint = 'a bare number is in m/s^2, write other units as in "9810 mm/s^2"'
        yield Finding(POOR, INPUTS, f"Gravity is {gravity:.4g} m/s^2, is that meant? {hint}.")


def _owners(scene: Scene) -> Iterator[tuple[str, str, Any]]:
    """Yield each object for which there are usual ranges: its kind, its name in words, and the object itself."""
    yield from (("solid", name, each) for name, each in scene.materials.items())
    for part in PARTS:
        if part.drive_row:
            owned = part.of(scene).items()
            yield from ((part.key, f'the {part.drive_row} of "{drive}"', each) for drive, each in owned)
    for joint, parts in scene.bearings.items():
        for own in (parts, parts.rolling, parts.plain, parts.pin, parts.eye):
            yield "bearings", f'the joint "{joint}"', own


def _sizes(results: Results) -> Iterator[Finding]:
    """Yield findings on links of unusual length and on unusual drive speeds."""
    sizes = {
        link.name: max(
            abs(complex(one) - complex(other)) for one in link.points.values() for other in link.points.values()
        )
        for link in results.mechanism.links
    }
    name = max(sizes, key=lambda each: sizes[each])
    shown = quantity(sizes[name], "m", shown_in=results.scene.shown_in)
    if sizes[name] > LONG:
        hint = 'a bare number is in m; units = "mm" at the head of the scene reads bare lengths as millimetres'
        yield Finding(POOR, INPUTS, f"The link {name} is {shown} long, is that meant? {hint}.")
    elif 0 < sizes[name] < SHORT:
        yield Finding(POOR, INPUTS, f"No link is longer than {shown}, is that meant?")
    for section, (at, _) in zip(results.scene.sections, results.mechanism.beams, strict=True):
        owner = results.mechanism.links[at].name
        thick = float(np.fmax(2.0 * np.ravel(section.fibre)[0], np.ravel(section.width)[0]))
        if thick > THICK * sizes[owner] > 0.0:
            deep, long = (quantity(each, "m", shown_in=results.scene.shown_in) for each in (thick, sizes[owner]))
            hint = 'a bare number is in the unit of lengths; otherwise write, e.g., "12 mm"'
            yield Finding(POOR, INPUTS, f"The link {owner} is {long} long and {deep} thick, is that meant? {hint}.")
            break
    speed = fastest_drive(results)
    if speed > FAST:
        text = f"A drive turns at {number(speed * 30 / math.pi)} rpm, is that meant? A bare speed is in rad/s"
        yield Finding(POOR, INPUTS, f"{text}.")


def _poisson(results: Results) -> Iterator[Finding]:
    """Yield a finding if shear deformation is computed with an assumed Poisson's ratio."""
    scene = results.scene
    sheared = {
        made.material for made, own in zip(scene.made_of, scene.sections, strict=False) if np.isfinite(own.kGA).all()
    }
    assumed = [name for name, stuff in scene.materials.items() if name in sheared and stuff.poisson is None]
    if assumed:
        text = f"Poisson's ratio of {' and '.join(assumed)} is not given: {POISSON}, as for metals, is used for shear."
        yield Finding(GOOD, "Shear", text)


def _idle_loads(results: Results) -> Iterator[Finding]:
    """Yield a finding on each load that is zero at all positions, although its given force or moment is not.

    A short load may act between two positions only. Positions at breaks are added to find it.
    """
    course = results.scene.course
    for load in results.mechanism.loads:
        if not isinstance(load, PointLoad | Resistance):
            continue
        given, motion = load.load if isinstance(load, Resistance) else load, results.motion
        acts = _acts(load, motion) or not (np.any(given.force) or np.any(given.moment))
        if not acts and len(course.breaks.sides):
            motion = course.at(course.with_breaks(motion.time))
            acts = _acts(load, motion)
        if not acts:
            law = given.law is not None and not np.any(given.law(motion))
            why = "its table gives 0 there" if law else "its point never moves against or along its force"
            text = f'The load on "{given.link}" at "{given.point}" is zero at all positions, because {why}.'
            yield Finding(CAUTION, "Load", text, f"the load on {given.link} never acts")


def _acts(load: PointLoad | Resistance, motion: Motion) -> bool:
    """Return whether a load is not zero at one or more positions of a motion."""
    return any(np.any(force) or np.any(moment) for _, _, force, moment in load.forces(motion))


def cycle_findings(results: Results) -> Iterator[Finding]:
    """Yield findings on the cycle of the run."""
    run, heading = results.scene.run, "Cycle"
    lasts = quantity(run.duration, "s")
    if run.no_cycle:
        text = f"There is no cycle: {run.no_cycle}. The figures are those of the first {lasts}, in which vibration"
        text += " begins at the start; how large they become later is not known."
        yield Finding(OPEN if run.duration_given else CAUTION, heading, text)
    elif run.turn and run.duration_given:
        text = f"The duration is one cycle of the mechanism, {lasts}: the figures are those of a periodic steady state,"
        yield Finding(GOOD, heading, f"{text} and the end of the cycle, which equals its start, is not a position.")
    elif run.turn:
        yield Finding(
            GOOD, heading, f"After {lasts} the mechanism is in its initial position: the figures are of this cycle."
        )
    elif abs(run.duration - run.cycle) <= CYCLE_TOLERANCE * run.cycle:
        text = f"The duration misses a cycle, {run.cycle:.9g} s, by {percent(abs(run.duration / run.cycle - 1))}: it is"
        text += " computed as a run from the start. For the cycle, omit the duration."
        yield Finding(OPEN, heading, text)
    elif turns := _whole(run.cycle / run.duration):
        text = f"The duration is 1/{turns} of a cycle of {quantity(run.cycle, 's')}: it is computed as a run from the"
        text += " start, in which vibration begins. For the cycle, omit the duration."
        yield Finding(CAUTION, heading, text)
    elif turns := _whole(run.duration / run.cycle):
        text = f"The duration is {turns} cycles of {quantity(run.cycle, 's')}: it is computed as a run from the start,"
        text += " in which vibration begins. For the cycle, omit the duration."
        yield Finding(OPEN, heading, text)
    if run.turn:
        yield from _jumping_loads(results.scene)


def _whole(ratio: float) -> int:
    """Return a ratio as an integer if it is (nearly) an integer of at least 2, otherwise return 0."""
    number = round(ratio) if ratio < MAX_CYCLES else 0
    return number if number > 1 and abs(ratio - number) <= RATIO_TOLERANCE * number else 0


def _jumping_loads(scene: Scene) -> Iterator[Finding]:
    """Yield a finding on each load with different values at the start and at the end of a cycle."""
    given = (load.load if isinstance(load, Resistance) else load for load in scene.mechanism.loads)
    by_law = [(load.link, law) for load in given if isinstance(load, PointLoad | LineLoad) and (law := load.law)]
    if not by_law:
        return
    times = np.linspace(0.0, scene.run.duration, LOAD_INSTANTS)
    seen = scene.course.at(times)
    for link, law in by_law:
        factor = np.broadcast_to(law(seen), times.shape)
        first, last, most = float(factor[0]), float(factor[-1]), float(np.abs(factor).max())
        if abs(last - first) > RATIO_TOLERANCE * most:
            text = f'The load on "{link}" is not periodic: it ends the cycle at {number(last, 3)} times its size'
            text += f" and begins the next at {number(first, 3)}. This is treated as a jump in every cycle. For a load"
            text += " that acts once, give the run a duration; otherwise let the table end with its first value."
            yield Finding(CAUTION, "Load over the cycle", text)
