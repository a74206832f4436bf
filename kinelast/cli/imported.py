"""Convert an imported mechanism to a scene, and check in a first run whether the mechanism moves.

If a drive moves a slider or cannot make a full turn, the drive is changed to oscillate between two limits.
"""

from math import pi

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from exchange import Drive, ExchangeError, ForeignMechanism, of_text, scene_text, to_and_fro
from kinelast.outputs.exported import exchanged
from kinelast.scene.data import Scene, scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.scene.tables import PER_LENGTH
from kinelast.values.error import SceneError, plain
from rigid import Mechanism, MechanismError, motion, reachable

# (distance of each limit of an oscillating drive from the nearest stop of the mechanism) / (range between the stops)
MARGIN = 0.01
MIN_RANGE = 1e-6  # a drive counts as stuck if its range < MIN_RANGE * (full turn; for a slider: size of the mechanism)
MAX_LIMIT_DIFFERENCE = 0.05  # (largest allowed change of a drive's limit by the export to PMKS+) / (range of the drive)
MAX_DIFFERENCE_IN_STEP = 2e-3  # replaces `MAX_LIMIT_DIFFERENCE` if there are several drives, which must keep in step
# number of positions in each search for the limit of a drive, and number of searches with successively finer positions
STEPS, ROUNDS = 360, 2
DEGREES = {"rpm": 6.0, "rad/s": 180 / pi}  # maps each unit of angular speed to its value in deg/s
MAX_REASON = 300  # maximum number of characters of `Imported.reason`
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
    """Imported scene, and result of a first run.

    Attributes
    ----------
    text, notes
        Text of the scene file, and assumptions and omissions of the import.
    cycle
        Duration of the run [s].
    reason
        Reason why the mechanism does not move; empty if it moves.
    rigid
        Names of rigid links with a moment of inertia from the file. The option --elastic can make these links elastic.
    no_cycle
        Reason why the motion never repeats, otherwise empty.
    """

    text: str
    notes: tuple[str, ...]
    cycle: float = 0.0
    reason: str = ""
    rigid: tuple[str, ...] = ()
    no_cycle: str = ""

    @property
    def result(self) -> str:
        """Message that states whether the mechanism moved in the first run, and whether the motion repeats."""
        if self.reason:
            return f"it does not move yet: {self.reason}"
        return (
            f"it moves, but never repeats: {self.no_cycle}"
            if self.no_cycle
            else f"it moves, {self.cycle:.4g} s a cycle"
        )

    def advice(self, path: str, source: str) -> str:
        """Return instructions for the user: how to add limits to the scene file `path`, and how to run the scene.

        Return an empty text if the mechanism does not move. `source` is the name of the imported file.
        """
        bend = TO_BEND.format(links=", ".join(self.rigid), source=source) if self.rigid else ""
        return "" if self.reason else bend + VERDICT.format(path=path)


def imported(drawing: ForeignMechanism) -> Imported:
    """Return the scene of an imported mechanism, and the result of a first run.

    Raises
    ------
    ExchangeError
        If the drawing has no moving link, or a point without a finite position.
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
    """Raise ExchangeError if an oscillating drive would have other limits in PMKS+ than in the scene.

    Parameters
    ----------
    drawing, text
        Exported mechanism, and text of the exported file.
    """
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
    """Return both limits of each oscillating drive, sorted by the lower limit, shape (drives, 2).

    The limits are the lowest and the highest coordinate of the drive, measured from its coordinate at the start.
    """
    levels = [np.cumsum([0.0, *drive.strokes]) for drive in drives if drive.law]
    return np.array(sorted((level.min(), level.max()) for level in levels))


def _resting(drive: Drive) -> Drive:
    """Return a copy of a drive with almost no motion.

    A mechanism is first built with these copies, because the limits of its drives are not known yet.
    """
    unit = "m" if "slider" in drive.joint else "rad"
    return replace(drive, speed=None, law=to_and_fro((1e-9, -1e-9), 1e-9, unit))


def _within_limits(drawing: ForeignMechanism, mechanism: Mechanism, starts: np.ndarray) -> ForeignMechanism:
    """Return the mechanism with oscillating drives, in place of drives that move a slider or cannot make a full turn.

    An oscillating motion law replaces the constant speed of such a drive. Drives that already have a motion law, and
    drives that cannot move at all, stay unchanged.

    `starts` contains the drive coordinates [rad or m] of the drawn mechanism, shape (drives,).
    """
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
        # round the limits instead of the strokes, so that the strokes in the scene file add up to zero
        low, high = float(f"{low:.9g}"), float(f"{high:.9g}")
        strokes = (high, low - high, -low) if speed > 0 else (low, high - low, -high)
        law = to_and_fro(strokes, abs(speed) * DEGREES.get(drive.speed.split()[1], 1.0), unit)
        drives[number] = replace(drive, speed=None, law=law)
        notes.append(
            f"the drive of {name} cannot make a full {'turn: it swings' if turns else 'stroke: it slides'} from"
            f" {low:.4g} to {high:.4g} {unit}, {MARGIN:.0%} inside the stops (0: as drawn)"
        )
    return replace(drawing, drives=tuple(drives), notes=tuple(notes))


def _limit(mechanism: Mechanism, starts: np.ndarray, number: int, target: float) -> float | None:
    """Return the travel [rad or m] of a drive from its start towards `target`, up to a stop of the mechanism.

    All other drives rest. Return None if the drive reaches `target` before any stop.
    """
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
