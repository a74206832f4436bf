"""The course of a scene: its mechanism moved, by laws of its drives or integrated where a drive is an effort."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic.assessment import rest_from
from kinelast.scene.breaks import APART, Breaks, breaks_of, knots_of
from kinelast.scene.drives import DriveEffort, DriveLaw
from kinelast.scene.error import SceneError
from rigid import Mechanism, MechanismError, Motion, Posture, Reals, TableError, motion, motion_in_chunks, reachable
from rigid.chunks import columns_of
from rigid.kinematics import by_laws

if TYPE_CHECKING:
    from rigid.dynamics import ForwardError, IntegratedMotion

OnStep = Callable[[float], None]
CLOSER = 1440  # instants that are looked at, at least
FINE, SHARES = 20001, 64  # instants at which accelerations of laws are looked for, and of each law's that are taken
LOOKED_AT = 257  # instants of a run, to see whether it ends at rest


@dataclass(frozen=True)
class Run:
    """Which instants of the motion are looked at.

    Attributes
    ----------
    positions
        How many, from the start on.
    duration
        [s].
    turn
        The duration is one cycle of the mechanism, and its end, which is its start, is not repeated.
    tolerance
        Relative, of a step where a motion is integrated.
    steps
        After so many an integration is given up.
    cycle
        After which the mechanism repeats its motion, however long the run [s]; nan where it never does.
    no_cycle
        Why it never does; empty where it does, or where nobody would expect it to.
    told
        The scene tells the duration.
    """

    positions: int
    duration: float
    turn: bool
    tolerance: float = 1e-10
    steps: int = 1000
    cycle: Any = nan
    no_cycle: str = ""
    told: bool = False


@dataclass(frozen=True, eq=False)
class Course(ABC):
    """A mechanism with all that tells its motion; the motion itself at any instants.

    Attributes
    ----------
    mechanism
        Geometry, mass, drives, loads and springs.
    laws
        One per drive: time [s] to coordinate, rate and acceleration; or an effort, and the motion follows.
    run
        Instants to look at.
    path
        Of the scene's file, for messages.
    """

    mechanism: Mechanism
    laws: tuple[DriveLaw | DriveEffort, ...]
    run: Run
    path: str = ""

    def times(self, positions: int | None = None) -> Reals:
        """Instants of the run [s], shape (positions,); `positions` overrides how many.

        Of many designs whose runs last differently long, shape (designs, positions).
        """
        count = self.run.positions if positions is None else positions
        if count < 1:
            raise ValueError(f"expected at least 1 position, got {count}")
        times = np.linspace(0.0, self.run.duration, count, endpoint=not self.run.turn, axis=-1)
        return times.reshape(-1, count) if times.ndim > 1 else times

    @cached_property
    def breaks(self) -> Breaks:
        """Instants at which the laws of drives and loads break off; for one design."""
        return breaks_of(self.laws, self.mechanism.loads, float(self.run.duration), self.run.turn, self.at)

    def with_breaks(self, times: Reals) -> Reals:
        """Instants as given [s], and both sides of the breaks between the first and the last, shape (instants,)."""
        sides = self.breaks.sides
        last = times[0] + self.period if self.run.turn else times[-1]
        return np.unique(np.concatenate([times, sides[(sides >= times[0]) & (sides <= last)]]))

    def closer(self, times: Reals) -> Reals:
        """Instants as given [s], those between them, and some where the laws accelerate most, shape (instants,)."""
        ends = np.append(times, times[0] + self.period) if self.run.turn else times
        parts = max(2, -(-CLOSER // len(times)))
        wide = np.diff(ends) > APART * self.breaks.aside
        between = ends[:-1][wide, None] + np.diff(ends)[wide, None] * np.arange(1, parts) / parts
        fine = np.linspace(ends[0], ends[-1], FINE)
        pushed = [np.broadcast_to(np.abs(law(fine)[2]), FINE) for law in self.laws if not isinstance(law, DriveEffort)]
        gone = [np.cumsum(each) for each in pushed if each.any()]
        shares = (np.arange(SHARES) + 0.5) / SHARES
        steep = [np.interp(shares * each[-1], each, fine) for each in gone]
        knots = knots_of(self.laws, float(ends[-1]))
        more = np.concatenate([between.ravel(), *steep, knots[knots >= ends[0]]])
        return self.with_breaks(np.unique(np.append(times, more[self.breaks.far(more)])))

    @property
    def period(self) -> float:
        """After which the mechanism repeats its motion [s]: the run where it is that cycle; else nan."""
        return self.run.duration if self.run.turn else nan

    @property
    def span(self) -> tuple[float, float]:
        """Times between which there is a motion [s]: laws tell it at any."""
        return -inf, inf

    @property
    def stops(self) -> bool:
        """Whether the drives move, and rest at the end of the run: nobody knows of a motion that is integrated."""
        return False

    @property
    def interrupted(self) -> float | None:
        """Up to which time the motion was found when a user interrupted it [s]; None where none did."""
        return None

    def telling(self, on_step: OnStep) -> Course:
        """The same course, which calls `on_step` with the time [s] that it has reached where it takes steps."""
        return self

    @abstractmethod
    def at(self, times: Any) -> Motion:
        """The motion at any instants [s], shape (positions,), as far as it reaches them.

        Raises
        ------
        SceneError
            The motion does not begin, or ends before; a table ends too soon.
        """

    def near(self, times: Any, postures: Posture) -> Motion:
        """The motion at instants apart from one another: on the branch of postures near by. Raises as `at`."""
        return self.at(times)

    @abstractmethod
    def chunks(self, times: Reals) -> Iterator[Motion]:
        """The motion, so many instants at a time as stay in the cache. Raises as `at`."""

    @abstractmethod
    def reached(self, times: Reals) -> Reals:
        """Those of some instants [s] that the mechanism reaches."""


@dataclass(frozen=True, eq=False)
class CourseByLaws(Course):
    """A course with laws for all drives."""

    laws: tuple[DriveLaw, ...]

    @cached_property
    def stops(self) -> bool:
        """Whether the drives move, and rest at the end of the run."""
        times = np.linspace(0.0, float(np.max(self.run.duration)), LOOKED_AT)
        rates = np.array([np.abs(law(times)[1]).reshape(-1, LOOKED_AT).max(axis=0) for law in self.laws])
        resting = rest_from(rates.reshape(len(self.laws), LOOKED_AT))
        return bool(resting[-2] and not resting[0])

    def at(self, times: Any) -> Motion:
        """The motion at any instants."""
        times = np.asarray(times, float)
        with of_scene(self.path, self.mechanism):
            return motion(self.mechanism, *by_laws(self.laws, times), times)

    def near(self, times: Any, postures: Posture) -> Motion:
        """The motion at instants apart from one another."""
        with of_scene(self.path, self.mechanism):
            return motion(self.mechanism, *by_laws(self.laws, times), times, postures)

    def chunks(self, times: Reals) -> Iterator[Motion]:
        """The motion, chunk by chunk."""
        with of_scene(self.path, self.mechanism):
            yield from motion_in_chunks(self.mechanism, *by_laws(self.laws, times), times)

    def reached(self, times: Reals) -> Reals:
        """Instants at which all joints close."""
        return np.asarray(times[np.concatenate([reachable(part) for part in self.chunks(times)])])


@contextmanager
def of_scene(path: str, mechanism: Mechanism) -> Iterator[None]:
    """Turn the mechanism's errors into mistakes of its scene."""
    try:
        yield
    except MechanismError as error:
        raise SceneError(path, table_of(mechanism, error), "", f"{error}{_advice(error)}") from None
    except TableError as error:
        raise SceneError(path, "drives", "", str(error)) from None


def _advice(error: MechanismError) -> str:
    """Advice on an integration that stops."""
    if getattr(error, "course", None) is None:
        return ""
    more = "; steps under [run] allows more" if error.kind == "steps" else ""
    return f"{more}; --reachable keeps what was reached"


def table_of(mechanism: Mechanism, error: MechanismError) -> str:
    """The table of a scene that an error of the mechanism is about."""
    if error.kind in ("drawing", "drives"):
        return "points" if error.kind == "drawing" else "drives"
    if len(error.joints) == 1 and error.joints[0] in mechanism.slider_points:
        (name,) = error.joints
        return f"{'slots' if mechanism.slider(name).link == f'{name} block' else 'sliders'}.{name}"
    links = [name for name in error.links if " " not in name]
    return f"links.{links[0]}" if len(links) == 1 else "links"


@dataclass(frozen=True, eq=False)
class IntegratedCourse(Course):
    """A course with a drive that is an effort: its motion is integrated over the run, once, when it is asked for.

    Attributes
    ----------
    on_step
        Called with the time [s] that is reached after every step.
    """

    on_step: OnStep | None = None

    def telling(self, on_step: OnStep) -> Course:
        """The same course, not yet integrated."""
        return replace(self, on_step=on_step)

    @cached_property
    def integrated(self) -> tuple[IntegratedMotion, ForwardError | None]:
        """The motion, and the error that stops it where it cannot go on to the end of the run.

        Raises
        ------
        SceneError
            It cannot begin.
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
                if error.course is None:
                    raise
                return error.course, error

    @property
    def span(self) -> tuple[float, float]:
        """Times between which the motion is integrated [s]."""
        return 0.0, float(self.integrated[0].time[-1])

    @property
    def interrupted(self) -> float | None:
        """Up to which time a user let the motion be integrated [s]."""
        from rigid.dynamics import INTERRUPTED

        stop = self.integrated[1]
        return float(stop.time) if stop is not None and stop.kind == INTERRUPTED else None

    def at(self, times: Any) -> Motion:
        """The motion at any instants."""
        from rigid.dynamics import motion_during

        times = np.asarray(times, float)
        with of_scene(self.path, self.mechanism):
            return motion_during(self._until(times), times)

    def chunks(self, times: Reals) -> Iterator[Motion]:
        """The motion, chunk by chunk."""
        from rigid.dynamics import motion_during

        with of_scene(self.path, self.mechanism):
            step, whole = columns_of(self.mechanism, len(times)), self._until(times)
            yield from (motion_during(whole, times[k : k + step]) for k in range(0, len(times), step))

    def reached(self, times: Reals) -> Reals:
        """Instants that the integration reaches."""
        return np.asarray(times[times <= self.integrated[0].time[-1]])

    def _until(self, times: Reals) -> IntegratedMotion:
        """The integrated motion; raises the error that stops it before the last of some instants."""
        whole, stop = self.integrated
        if stop is not None and times.max(initial=0.0) > whole.time[-1]:
            raise stop
        return whole
