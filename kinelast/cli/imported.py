"""First run of an imported mechanism. Drives that cannot make a full turn oscillate between their limits."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from exchange import Drive, ExchangeError, ForeignMechanism, of_text, scene_text, to_and_fro
from kinelast.outputs.exported import exchanged
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.scene.error import SceneError, plain
from kinelast.scene.tables import PER_LENGTH
from rigid import MechanismError, motion, reachable

if TYPE_CHECKING:
    from kinelast.scene.data import Scene
    from rigid import Mechanism

MARGIN = 0.01  # distance from a limit of the mechanism, relative to the range between the limits
MIN_RANGE = 1e-6  # a drive with a smaller range cannot move; relative to a turn, or to the size of the drawing
MAX_LIMIT_DIFFERENCE = 0.05  # largest change in a limit of a drive due to the export, relative to its range
MAX_DIFFERENCE_IN_STEP = 2e-3  # same for several drives; smaller, because their periods must agree
STEPS, ROUNDS = 360, 2  # number of positions in a search for a limit, and number of searches
DEGREES = {"rpm": 6.0, "rad/s": 180 / pi}  # [deg/s] by unit of speed
MAX_REASON = 300  # characters
VERDICT = """For a verdict:
  1. replace the values marked "assumed" by your own
  2. add your limits, such as
     [limits]
     safety = 1.5
  3. run: deflection-report {path}"""
TO_BEND = """{links}: rigid, with mass, centre and inertia from the file. For a scene with elastic links, run:
  deflection-report --import {source} --elastic
"""


class Imported(Struct, frozen=True):
    """Text of an imported scene, and result of a first run.

    `reason` states why the mechanism does not move, and is empty if it moves. `no_cycle` states why the motion does not
    repeat, and is empty if it repeats. `rigid` contains the names of links without beams.
    """

    text: str
    notes: tuple[str, ...]
    cycle: float = 0.0
    reason: str = ""
    rigid: tuple[str, ...] = ()
    no_cycle: str = ""

    @property
    def result(self) -> str:
        """Result of the first run as a sentence."""
        if self.reason:
            return f"it does not move yet: {self.reason}"
        return (
            f"it moves, but never repeats: {self.no_cycle}"
            if self.no_cycle
            else f"it moves, {self.cycle:.4g} s a cycle"
        )

    def advice(self, path: str, source: str) -> str:
        """Return the steps to a verdict on the scene at `path`; empty if the mechanism does not move."""
        bend = TO_BEND.format(links=", ".join(self.rigid), source=source) if self.rigid else ""
        return "" if self.reason else bend + VERDICT.format(path=path)


def imported(drawing: ForeignMechanism) -> Imported:
    """Return the scene of an imported mechanism, after a first run.

    Raises
    ------
    ExchangeError
        The drawing is not a mechanism.
    """
    resting = replace(drawing, drives=tuple(map(_resting, drawing.drives)))
    try:
        scene = scene_from_text(scene_text(resting))
        starts = scene_motion(scene, 1).drive[:, 0]
        drawing = _within_limits(drawing, scene.mechanism, starts)
        text = scene_text(drawing)
        scene = scene_from_text(text)
        scene_motion(scene)
    except (SceneError, MechanismError) as error:
        reason = plain(str(error).splitlines()[0], MAX_REASON)
        return Imported(scene_text(drawing), drawing.notes, reason=reason)
    bodies = ((link, drawing.links.get(link.name)) for link in scene.mechanism.links[1:])
    rigid = tuple(
        link.name for link, body in bodies if body and not link.beams and len(body.points) > 1 and body.inertia
    )
    return Imported(text, drawing.notes, float(scene.run.duration or 0.0), rigid=rigid, no_cycle=scene.run.no_cycle)


def require_same_swing(scene: Scene, drawing: ForeignMechanism, text: str) -> None:
    """Raise ExchangeError if the limits of an oscillating drive would be different in PMKS+."""
    if not any(drive.law for drive in drawing.drives):
        return
    back = imported(of_text(text, scene.title))
    if back.reason:
        raise ExchangeError(f"PMKS+ cannot move the exported mechanism: {back.reason}")
    here, there = _swings(drawing.drives), _swings(exchanged(scene_from_text(back.text)).drives)
    limit = MAX_LIMIT_DIFFERENCE if len(drawing.drives) == 1 else MAX_DIFFERENCE_IN_STEP
    if here.shape != there.shape or np.any(np.abs(there - here) > limit * np.ptp(here, axis=1, keepdims=True)):
        problem = "in PMKS+ a drive oscillates between the limits of the mechanism, which differ from those of its law"
        raise ExchangeError(problem)


def _swings(drives: tuple[Drive, ...]) -> np.ndarray:
    """Return the lowest and highest coordinate of each oscillating drive, relative to its start, shape (drives, 2)."""
    levels = [np.cumsum([0.0, *drive.strokes]) for drive in drives if drive.law]
    return np.array(sorted((level.min(), level.max()) for level in levels))


def _resting(drive: Drive) -> Drive:
    """Return the drive with almost no motion, with which the mechanism is built first."""
    unit = "m" if "slider" in drive.joint else "rad"
    return replace(drive, speed=None, law=to_and_fro((1e-9, -1e-9), 1e-9, unit))


def _within_limits(drawing: ForeignMechanism, mechanism: Mechanism, starts: np.ndarray) -> ForeignMechanism:
    """Replace the constant speed of each drive that cannot make a full turn by an oscillating law."""
    drives, notes = list(drawing.drives), list(drawing.notes)
    metre = PER_LENGTH[drawing.unit]
    places = np.array(list(drawing.points.values())) * metre
    size = float(np.abs(places[:, None] - places).max())
    for number, drive in enumerate(drives):
        name = drive.joint.get("slider") or drive.joint["link"]
        if drive.speed is None:
            continue
        turns = "slider" not in drive.joint
        speed = float(drive.speed.split()[0])
        per_unit, unit = (pi / 180, "deg") if turns else (metre, drawing.unit)
        low, high = -2 * pi if turns else -size, 2 * pi if turns else size
        if not turns:
            travel = drawing.slots[name].travel if name in drawing.slots else drawing.slides[name].travel
            low, high = (metre * end for end in travel) if travel != (0.0, 0.0) else (low, high)
        ahead, behind = (high, low) if speed > 0 else (low, high)
        first = _limit(mechanism, starts, number, ahead)
        if turns and first is None:
            continue
        second = _limit(mechanism, starts, number, behind)
        low, high = sorted((ahead if first is None else first, behind if second is None else second))
        whole = high - low
        if whole < MIN_RANGE * (2 * pi if turns else size):
            continue
        low, high = min(low + MARGIN * whole, 0.0) / per_unit, max(high - MARGIN * whole, 0.0) / per_unit
        low, high = float(f"{low:.9g}"), float(f"{high:.9g}")  # so that the rounded strokes in the text add up to zero
        strokes = (high, low - high, -low) if speed > 0 else (low, high - low, -high)
        law = to_and_fro(strokes, abs(speed) * DEGREES.get(drive.speed.split()[1], 1.0), unit)
        drives[number] = replace(drive, speed=None, law=law)
        notes.append(
            f"the drive of {name} cannot make a full {'turn: it swings' if turns else 'stroke: it slides'} from"
            f" {low:.4g} to {high:.4g} {unit}, {MARGIN:.0%} inside the stops (0: as drawn)"
        )
    return replace(drawing, drives=tuple(drives), notes=tuple(notes))


def _limit(mechanism: Mechanism, starts: np.ndarray, number: int, target: float) -> float | None:
    """Return how far a drive can move towards `target` while all other drives rest; None if it reaches `target`."""
    passed, missed, start_shifts = 0.0, target, np.zeros(1)
    for _ in range(ROUNDS):
        shifts = np.append(start_shifts, np.linspace(passed, missed, STEPS)[1:])
        coordinates = np.repeat(starts[:, None], len(shifts), axis=1)
        coordinates[number] += shifts
        closes = reachable(motion(mechanism, coordinates))
        if closes.all():
            return None if missed == target else passed
        first = max(int(np.argmin(closes)), 1)
        start_shifts, passed, missed = shifts[:first], float(shifts[first - 1]), float(shifts[first])
    return passed
