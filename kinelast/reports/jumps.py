"""Findings on jumps in loads, friction and accelerations, which make the links vibrate."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from elastic import Deflection
from kinelast.answers.results import Results
from kinelast.scene.data import scene_deflection
from kinelast.scene.drives import DriveEffort
from kinelast.values.numbers import coordinate, few, quantity
from kinelast.values.reading import CAUTION, OPEN, Finding
from rigid import LineLoad, PointLoad, Resistance, TorsionSpring
from rigid.arrays import Flags, Numbers, Reals

HEADING = "Jumps"
MIN_SHARE = 0.05  # smallest jump in joint forces that is reported, relative to the largest joint force
CONTINUOUS = 1e-3  # a quantity jumps if it changes by more at a break in a law or load, relative to its maximum
MAX_PLACES = 3  # maximum number of positions that a sentence of a finding names
ROUNDING = 6  # decimals to which positions [rad or m] are rounded, to hide round-off


def jump_findings(results: Results) -> Iterator[Finding]:
    """Yield findings on torsion springs and, with vibration, on jumps in loads, friction and accelerations."""
    yield from _torsion_springs(results)
    if not results.vibrates:
        return
    course, scene = results.scene.course, results.scene
    sides = np.hstack([(breaks.before, breaks.after) for breaks in (course.breaks, course.reversals)])
    if not sides.size:
        return
    order = np.argsort(sides, axis=None)
    bent = scene_deflection(scene, course.at(sides.ravel()[order]))
    before, after = np.argsort(order).reshape(sides.shape)
    large = _jumps_of_forces(results.quasi_static, bent, before, after) > MIN_SHARE
    said, count = [], 0
    for name, values in _quantities(results, bent):
        changes = {unit: np.abs(each[after] - each[before]) for unit, each in values}
        passed = [changes[unit] > CONTINUOUS * np.nan_to_num(np.abs(each)).max() for unit, each in values]
        there = large & np.any(passed, axis=0)
        if there.any():
            sizes = [quantity(float(each[there].max()), unit, 3, scene.shown_in) for unit, each in changes.items()]
            shown = " and ".join(size for size, own in zip(sizes, passed, strict=True) if (there & own).any())
            up_to = "up to " if there.sum() > 1 else ""
            said.append(f"{name} jumps by {up_to}{shown} ({_places(results, bent, after[there])})")
            count += int(there.sum())
    if said:
        text = f"{'; '.join(said)}, and the vibration after {'the' if count == 1 else 'each'} jump depends on it: a"
        yield Finding(OPEN, HEADING, f"{text[0].upper()}{text[1:]} gradual change causes less vibration.")


def _torsion_springs(results: Results) -> Iterator[Finding]:
    """Yield a finding for each torsion spring that turns past half a turn from its rest angle."""
    motion = results.motion
    for spring in results.mechanism.loads:
        if not isinstance(spring, TorsionSpring) or not np.any(spring.stiffness):
            continue
        winding = np.broadcast_to(spring.winding(motion), motion.columns)
        steps = np.diff(winding, append=winding[:1] if results.scene.run.turn else winding[-1:])
        wound = np.nan_to_num(np.abs(winding)).max(initial=0.0)
        if np.nan_to_num(np.abs(steps)).max(initial=0.0) > np.pi:
            jump = quantity(2.0 * np.pi * float(np.ravel(spring.stiffness)[0]), "N m", 3)
            text = f"The torsion spring at {spring.at} turns fully: its moment jumps by {jump} once a turn."
            yield Finding(CAUTION, HEADING, f"{text} Use a torsion spring only at a pin that swings.")
        elif wound > np.pi and not any(drive.joint == spring.at for drive in results.mechanism.drives):
            text = f"The torsion spring at {spring.at} is wound by up to {math.degrees(wound):.0f}°."
            yield Finding(OPEN, "Springs", f"{text} If another turn is meant, add or subtract 360° at its angle.")


def _jumps_of_forces(run: Deflection, bent: Deflection, before: Numbers, after: Numbers) -> Reals:
    """Return the largest jump in a joint force or moment at each break in a law or load, shape (breaks,).

    A jump in a force is relative to the largest joint force, and a jump in a moment to the largest joint moment.

    `before` and `after` are the numbers of the positions of `bent` just before and just after each break.
    """
    jumps = np.zeros(len(before))
    for here, whole in zip(_joint_loads(bent), _joint_loads(run), strict=True):
        most = max(np.nan_to_num(np.abs(each)).max(initial=0.0) for each in (here, whole))
        change = np.nan_to_num(np.abs(here[:, after] - here[:, before])).max(axis=0)
        jumps = np.maximum(jumps, change / (most or 1.0))
    return jumps


def _joint_loads(bent: Deflection) -> tuple[Numbers, Numbers]:
    """Return the forces (complex) [N] and moments [N m] of all joints, each of shape (joints, positions)."""
    force, moment = (
        np.array([np.broadcast_to(each, bent.motion.columns) for each in rows])
        for rows in (bent.forces.force, bent.forces.moment)
    )
    return force, moment


def _quantities(results: Results, bent: Deflection) -> Iterator[tuple[str, Sequence[tuple[str, Numbers]]]]:
    """Yield the name of each quantity that may jump, and pairs of a unit and the values at the positions of `bent`."""
    motion, columns = bent.motion, bent.motion.columns
    for load in results.mechanism.loads:
        if isinstance(load, LineLoad) and load.law:
            size = max(abs(complex(load.start)), abs(complex(load.end)))
            yield f"the load on {load.link}", [("N/m", np.broadcast_to(load.law(motion), columns) * size)]
        elif isinstance(load, PointLoad | Resistance):
            for _, _, force, moment in load.forces(motion):
                pair = ("N", np.broadcast_to(force, columns)), ("N m", np.broadcast_to(moment, columns))
                yield f"the load on {load.link}", pair
    for number, effort in bent.forces.friction.items():
        unit = "N m" if motion.places[number].turns else "N"
        name = motion.structure.joints[number].name
        yield f"friction in {name}", [(unit, np.broadcast_to(effort, columns))]
    for words, law, rate in zip(results.drive_words, results.scene.laws, motion.drive_acceleration, strict=True):
        name, _, unit, of_effort = words
        if isinstance(law, DriveEffort):
            yield f"the effort of the drive {name}", [(of_effort, law.effort(motion))]
        else:
            yield f"the acceleration of the drive {name}", [(f"{unit}/s^2", np.broadcast_to(rate, columns))]


def _places(results: Results, bent: Deflection, at: Flags) -> str:
    """Return positions in words: as drive coordinates if there is only one drive, otherwise as times.

    `at` contains the numbers of the positions of `bent`.
    """
    lead, places = "at", [quantity(float(time), "s") for time in bent.motion.time[at]]
    if len(results.drive_words) == 1 and not results.several_turns:
        [(name, _, unit, _)] = results.drive_words
        lead, values = f"{name} at", bent.motion.drive[0, at].tolist()
        places = [coordinate(round(value, ROUNDING), unit, results.scene.shown_in) for value in values]
    return f"{lead} {', '.join(few(list(dict.fromkeys(places)), MAX_PLACES))}"
