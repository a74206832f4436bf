"""Motion of the mechanism of a scene over time.

The motion follows from the laws of the drives, or is integrated if the scene gives the effort of a drive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.assessment import rest_from
from kinelast.scene.breaks import MIN_BREAK_DISTANCE, Breaks, breaks_of, knots_of, reversals_of
from kinelast.scene.drives import DriveEffort, DriveLaw
from kinelast.values.error import SceneError
from rigid import Mechanism, MechanismError, Motion, Posture, Reals, TableError, motion, motion_in_chunks, reachable
from rigid.arrays import distinct
from rigid.chunks import columns_of
from rigid.kinematics import by_laws
from rigid.kinetostatics import friction_joints

if TYPE_CHECKING:
    from rigid.dynamics import ForwardError, IntegratedMotion

OnStep = Callable[[float], None]
MIN_SEARCH_INSTANTS = 1440  # smallest number of times at which extreme values of the rigid motion are searched
LAW_INSTANTS = 20001  # number of times at which the acceleration of a law is sampled
EXTRA_INSTANTS = 64  # number of times that are added where the acceleration of a law is large
REST_INSTANTS = 257  # number of times at which a run is tested for rest
MIN_REUSABLE = 90  # smallest number of positions of a computed motion from which later iterations start
MAX_TURN = 0.1  # [rad] largest rotation of a link between neighbouring positions of such a motion


class Run(Struct, frozen=True):
    """Times of a run.

    Attributes
    ----------
    positions
        Number of positions.
    duration
        Duration [s].
    turn
        True if the duration is one cycle of the mechanism. The end equals the start and is not repeated.
    tolerance
        Relative tolerance of an integration step.
    steps
        Maximum number of steps of an integration.
    cycle
        Period of the motion [s], independent of the duration; nan if the motion never repeats.
    no_cycle
        Reason why the motion never repeats although a cycle was expected, otherwise empty.
    duration_given
        True if the scene gives the duration.
    """

    positions: int
    duration: float
    turn: bool
    tolerance: float = 1e-10
    steps: int = 1000
    cycle: Any = nan
    no_cycle: str = ""
    duration_given: bool = False


class Course(Struct, frozen=True, eq=False, dict=True):
    """A mechanism and the laws of its drives. Returns the motion at given times.

    Attributes
    ----------
    mechanism
        Geometry, mass, drives, loads and springs.
    laws
        For each drive, a function from time [s] to coordinate, rate and acceleration, or an effort.
    run
        Times of the run.
    path
        Path of the scene file, for messages.
    """

    mechanism: Mechanism
    laws: tuple[DriveLaw | DriveEffort, ...]
    run: Run
    path: str = ""

    def times(self, positions: int | None = None) -> Reals:
        """Return the times of the run [s], shape (positions,), or (designs, positions) if durations differ.

        `positions` overrides the number of positions of the run.
        """
        count = self.run.positions if positions is None else positions
        if count < 1:
            raise ValueError(f"expected at least 1 position, got {count}")
        times = np.linspace(0.0, self.run.duration, count, endpoint=not self.run.turn, axis=-1)
        return times.reshape(-1, count) if times.ndim > 1 else times

    @cached_property
    def breaks(self) -> Breaks:
        """Breaks in the laws of the drives and loads. The scene must be a single design."""
        end = float(self.run.duration)
        return breaks_of(self.laws, self.mechanism.loads, end, self.run.turn, self.at, float(self.span[1]))

    @cached_property
    def reversals(self) -> Breaks:
        """Times at which Coulomb friction starts, stops or reverses. The scene must be a single design."""
        joints = (number for number, own in friction_joints(self.mechanism) if own.coefficient)
        return reversals_of(joints, float(self.run.duration), self.run.turn, self.at, float(self.span[1]))

    def with_breaks(self, times: Reals) -> Reals:
        """Return the given times [s] and, in addition, the times just before and after each break, shape (times,)."""
        sides = self.breaks.sides
        last = times[0] + self.period if self.run.turn else times[-1]
        return distinct(np.concatenate([times, sides[(sides >= times[0]) & (sides <= last)]]))

    def closer(self, times: Reals) -> Reals:
        """Return the given times [s] and times between them, closer at large accelerations, shape (times,)."""
        ends = np.append(times, times[0] + self.period) if self.run.turn else times
        parts = max(2, -(-MIN_SEARCH_INSTANTS // len(times)))
        wide = np.diff(ends) > MIN_BREAK_DISTANCE * self.breaks.aside
        between = ends[:-1][wide, None] + np.diff(ends)[wide, None] * np.arange(1, parts) / parts
        fine = np.linspace(ends[0], ends[-1], LAW_INSTANTS)
        pushed = [
            np.broadcast_to(np.abs(law(fine)[2]), LAW_INSTANTS) for law in self.laws if not isinstance(law, DriveEffort)
        ]
        sums = [np.cumsum(each) for each in pushed if each.any()]
        shares = (np.arange(EXTRA_INSTANTS) + 0.5) / EXTRA_INSTANTS
        steep = [np.interp(shares * each[-1], each, fine) for each in sums]
        knots = knots_of(self.laws, float(ends[-1]))
        more = np.concatenate([between.ravel(), *steep, knots[knots >= ends[0]]])
        return self.with_breaks(distinct(np.append(times, more[self.breaks.far(more)])))

    @property
    def period(self) -> float:
        """Period of the motion [s] if the run is one cycle, otherwise nan."""
        return self.run.duration if self.run.turn else nan

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the motion [s]. A motion given by laws is unlimited."""
        return -inf, inf

    @property
    def stops(self) -> bool:
        """True if the drives move and are at rest at the end of the run. False if the motion is integrated."""
        return False

    @property
    def interrupted(self) -> float | None:
        """Time at which the user interrupted the integration [s], or None."""
        return None

    def reporting(self, on_step: OnStep) -> Course:
        """Return the same object. It calls `on_step` with the time reached [s] after each step of an integration."""
        return self

    def at(self, times: Any) -> Motion:
        """Return the motion at given times [s], shape (positions,).

        Raises
        ------
        SceneError
            The motion cannot start or ends too early, or a table does not cover the times.
        """
        raise NotImplementedError

    def near(self, times: Any, postures: Posture) -> Motion:
        """Return the motion at times in any order.

        A mechanism can be assembled in several ways. At each time, it is assembled as in the given nearby posture.
        Raises the same errors as `at`.
        """
        return self.at(times)

    def chunks(self, times: Reals) -> Iterator[Motion]:
        """Yield the motion in chunks that fit into the processor's cache. Raises the same errors as `at`."""
        raise NotImplementedError

    def reached(self, times: Reals) -> Reals:
        """Return the times [s] at which the mechanism can be assembled."""
        raise NotImplementedError


class CourseByLaws(Course, frozen=True):
    """Motion of a mechanism in which every drive follows a law."""

    laws: tuple[DriveLaw, ...]

    @cached_property
    def stops(self) -> bool:
        """True if the drives move and are at rest at the end of the run."""
        times = np.linspace(0.0, float(np.max(self.run.duration)), REST_INSTANTS)
        rates = np.array([np.abs(law(times)[1]).reshape(-1, REST_INSTANTS).max(axis=0) for law in self.laws])
        resting = rest_from(rates.reshape(len(self.laws), REST_INSTANTS))
        return bool(resting[-2] and not resting[0])

    def at(self, times: Any) -> Motion:
        """Return the motion at any times."""
        times = np.asarray(times, float)
        with of_scene(self.path, self.mechanism):
            drives = by_laws(self.laws, times)
            moved = self._from_known(times, drives)
            if moved is None:
                moved = motion(self.mechanism, *drives, times)
                if not self._followed and _is_reusable(moved):
                    self._followed.append(moved)
        return moved

    @cached_property
    def _followed(self) -> list[Motion]:
        """List with the first long motion that was computed by iterations; empty before there is one."""
        return []

    def _from_known(self, times: Reals, drives: tuple[Reals, Reals, Reals]) -> Motion | None:
        """Return the motion, computed by iterations that start from the nearest known postures.

        Return None if a link ends too far from its posture at the start of the iterations.
        """
        if not self._followed or times.ndim != 1:
            return None
        known = self._followed[0]
        right = np.clip(np.searchsorted(known.time, times), 1, len(known.time) - 1)
        at = right - (times - known.time[right - 1] < known.time[right] - times)
        near = Posture(self.mechanism, known.origin[:, at], known.direction[:, at])
        try:
            moved = motion(self.mechanism, *drives, times, near)
        except MechanismError:
            return None
        step = np.abs(np.diff(known.direction)).max(axis=-1, keepdims=True)
        return moved if (np.abs(moved.direction - near.direction) <= step).all() else None

    def near(self, times: Any, postures: Posture) -> Motion:
        """Return the motion at times in any order, see `Course.near`."""
        with of_scene(self.path, self.mechanism):
            return motion(self.mechanism, *by_laws(self.laws, times), times, postures)

    def chunks(self, times: Reals) -> Iterator[Motion]:
        """Yield the motion in chunks."""
        with of_scene(self.path, self.mechanism):
            yield from motion_in_chunks(self.mechanism, *by_laws(self.laws, times), times)

    def reached(self, times: Reals) -> Reals:
        """Return the times [s] at which the mechanism can be assembled."""
        return np.asarray(times[np.concatenate([reachable(part) for part in self.chunks(times)])])


def _is_reusable(moved: Motion) -> bool:
    """Return True if later iterations can start from a motion: it was computed by iterations and has small steps."""
    iterated = any(group.free and not group.closed_form for group in moved.structure.groups)
    if not iterated or len(moved.columns) != 1 or moved.columns[0] < MIN_REUSABLE:
        return False
    return bool((np.abs(np.diff(moved.direction)) <= MAX_TURN).all())  # nan at unreachable positions


@contextmanager
def of_scene(path: str, mechanism: Mechanism) -> Iterator[None]:
    """Convert errors of the mechanism to errors of the scene."""
    try:
        yield
    except MechanismError as error:
        raise SceneError(path, table_of(mechanism, error), "", f"{error}{_advice(error)}") from None
    except TableError as error:
        raise SceneError(path, "drives", "", str(error)) from None


def _advice(error: MechanismError) -> str:
    """Return advice on an integration that stopped early."""
    if getattr(error, "motion", None) is None:
        return ""
    more = "; steps under [run] allows more" if error.kind == "steps" else ""
    return f"{more}; --reachable keeps what was reached"


def table_of(mechanism: Mechanism, error: MechanismError) -> str:
    """Return the scene table to which an error of the mechanism refers."""
    if error.kind in ("drawing", "drives"):
        return "points" if error.kind == "drawing" else "drives"
    if len(error.joints) == 1 and error.joints[0] in mechanism.slider_points:
        (name,) = error.joints
        return f"{'slots' if mechanism.slider(name).link == f'{name} block' else 'sliders'}.{name}"
    links = [name for name in error.links if " " not in name]
    return f"links.{links[0]}" if len(links) == 1 else "links"


class IntegratedCourse(Course, frozen=True):
    """Motion of a mechanism in which the effort of a drive is given. The motion is integrated once, on first use.

    Attributes
    ----------
    on_step
        Function that is called after each step of the integration with the time reached [s].
    """

    on_step: OnStep | None = None

    def reporting(self, on_step: OnStep) -> Course:
        """Return the same object with a progress callback.

        The motion of the returned object is integrated on first use.
        """
        return replace(self, on_step=on_step)

    @cached_property
    def integrated(self) -> tuple[IntegratedMotion, ForwardError | None]:
        """The motion, and the error that stopped the integration early, or None if it reached the end of the run.

        Raises
        ------
        SceneError
            The integration cannot start.
        """
        from rigid.dynamics import ForwardError, forward

        drives = [law.effort if isinstance(law, DriveEffort) else law for law in self.laws]
        begin = [(law.start, law.speed) if isinstance(law, DriveEffort) else (0.0, 0.0) for law in self.laws]
        start, rate = zip(*begin, strict=True)
        run = self.run
        with of_scene(self.path, self.mechanism):
            try:
                way = run.duration, run.tolerance, run.steps, self.on_step
                return forward(self.mechanism, drives, start, rate, *way), None
            except ForwardError as error:
                if error.motion is None:
                    raise
                return error.motion, error

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the integrated motion [s]."""
        return 0.0, float(self.integrated[0].time[-1])

    @property
    def interrupted(self) -> float | None:
        """Time at which the user interrupted the integration [s], or None."""
        from rigid.dynamics import INTERRUPTED

        stop = self.integrated[1]
        return float(stop.time) if stop is not None and stop.kind == INTERRUPTED else None

    def at(self, times: Any) -> Motion:
        """Return the motion at any times."""
        from rigid.dynamics import motion_during

        times = np.asarray(times, float)
        with of_scene(self.path, self.mechanism):
            return motion_during(self._until(times), times)

    def chunks(self, times: Reals) -> Iterator[Motion]:
        """Yield the motion in chunks."""
        from rigid.dynamics import motion_during

        with of_scene(self.path, self.mechanism):
            step, whole = columns_of(self.mechanism, len(times)), self._until(times)
            yield from (motion_during(whole, times[k : k + step]) for k in range(0, len(times), step))

    def reached(self, times: Reals) -> Reals:
        """Return the times [s] that the integration reaches."""
        return np.asarray(times[times <= self.integrated[0].time[-1]])

    def _until(self, times: Reals) -> IntegratedMotion:
        """Return the integrated motion.

        If a time is beyond the end of this motion, raise the error that stopped the integration.
        """
        whole, stop = self.integrated
        if stop is not None and times.max(initial=0.0) > whole.time[-1]:
            raise stop
        return whole
