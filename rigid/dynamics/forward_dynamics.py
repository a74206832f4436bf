"""Forward dynamics: some drives are given as efforts, and their motion is found by integrating it.

The unknowns are the coordinates of the drives, so that the loops of the mechanism close to round-off at every instant.
Derivation: docs/dynamics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.analysis.turning_points import aligned_joint
from rigid.dynamics.effort import equation_of_motion
from rigid.dynamics.tracking import Tracker
from rigid.kinematics import Motion, motion, with_rates
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import Law, MechanismError, PinDrive, Reals
from rigid.postures import Posture

EVALUATIONS = 200_000  # of the equation of motion, at which an integration is given up
LEAST_TOLERANCE = 3e-14  # below it the integrator's error estimate is round-off
STEEP = 1e4  # of a link's rate per rate of a drive, which then no longer leads it

MotionLaw = Callable[[Any], tuple[Any, Any, Any]]
"""Times [s] to coordinate, rate and acceleration of a drive, as the laws of motion in `rigid`."""


class ForwardError(MechanismError):
    """A motion that cannot be continued; `time` [s] is the last at which it could.

    `course` is the motion up to there, None where it cannot even begin. The rest as of `MechanismError`.
    """

    course: IntegratedMotion | None = None

    def __init__(self, message: str, time: float = 0.0, **culprits: Any) -> None:
        super().__init__(message, **culprits)
        self.time = time


class _EnoughError(Exception):
    """The bound on evaluations is reached."""


@dataclass(frozen=True)
class Effort:
    """A drive given as effort: a moment [N m] or force [N] along its coordinate, or a law that returns it; 0 is free.

    A law may look at the motion's time, drives, rates, places and velocities, not at accelerations.
    """

    law: Law | float = 0.0

    def __call__(self, motion: Motion) -> Any:
        """The effort, shape (..., positions)."""
        return self.law(motion) if callable(self.law) else np.full(motion.columns, float(self.law))


@dataclass(frozen=True, eq=False)
class IntegratedMotion:
    """An integrated motion; `motion_during` gives it at any times.

    Attributes
    ----------
    drives
        Per drive its `Effort` or motion law.
    time
        The integrator's steps [s], shape (steps,).
    postures
        Where the links are at the steps, arrays of shape (links, steps).
    state
        Times of shape (n,) to coordinates and then rates of the drives given as efforts, shape (2 efforts, n).
    evaluations
        Of the equation of motion.
    """

    mechanism: Mechanism
    drives: tuple[Effort | MotionLaw, ...]
    time: Reals
    postures: Posture
    state: Callable[[Any], Any]
    evaluations: int


def forward(
    mechanism: Mechanism,
    drives: Sequence[Effort | MotionLaw],
    start: Any,
    rate: Any,
    duration: float,
    tolerance: float = 1e-10,
    most_steps: int | None = None,
    on_step: Callable[[float], None] | None = None,
    evaluations: int = EVALUATIONS,
) -> IntegratedMotion:
    """Motion of a mechanism under given efforts from time 0.

    Parameters
    ----------
    mechanism
        Scalar lengths. Its drives are the coordinates: those given as efforts are integrated, the others follow their
        motion laws.
    drives
        Per drive an `Effort` or a motion law.
    start, rate
        Coordinates [rad or m] and rates at time 0, shape (drives,) or a scalar; not used where a law is given.
    duration
        [s].
    tolerance
        Of a step, relative; absolute for coordinates measured in radians and in sizes of the mechanism. Not the error
        at the end, which a mechanism may magnify.
    most_steps
        After which it is given up, as a motion that cannot be continued.
    on_step
        Called with the time [s] that is reached after every step.
    evaluations
        Of the equation of motion, at most: the step size may fall without bound.

    Raises
    ------
    ForwardError
        The mechanism comes to a position where its drives no longer say how it moves on, or to an infinite speed; a
        drive given as effort that moves no mass.
    MechanismError
        It cannot be assembled at the start.

    References
    ----------
    Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., 1993, II.5: the method of order 8.
    """
    drives = tuple(drives)
    count = len(mechanism.drives)
    if len(drives) != count:
        raise ForwardError(f"{len(drives)} efforts or motion laws were given for {counted(count, 'drive')}")
    free = [number for number, drive in enumerate(drives) if isinstance(drive, Effort)]
    start, rate = (np.broadcast_to(np.asarray(value, float), (count,)).copy() for value in (start, rate))
    for number, drive in enumerate(drives):
        if not isinstance(drive, Effort):
            start[number], rate[number], _ = (float(np.ravel(value)[0]) for value in drive(np.zeros(1)))
    tracker = Tracker(mechanism, start)
    system = _System(tracker, drives, free, evaluations)
    unit = np.array([1.0 if tracker.turns(number) else tracker.size for number in free])
    begin = np.concatenate([start[free], rate[free]])
    if not np.isfinite(system(0.0, begin)).all():
        raise _stuck(mechanism, 0.0, start, "a drive given as effort moves no mass there")
    scale = tolerance * np.concatenate([unit, unit / duration])
    most = np.inf if most_steps is None else most_steps
    return _integrated(system, begin, duration, max(tolerance, LEAST_TOLERANCE), scale, most, on_step)


def _integrated(
    system: _System,
    begin: Reals,
    duration: float,
    tolerance: float,
    scale: Any,
    most_steps: float,
    on_step: Callable[[float], None] | None,
) -> IntegratedMotion:
    """Steps from time 0 to the duration, and where the links are at each."""
    from scipy.integrate import DOP853

    tracker = system.tracker
    solver = DOP853(system, 0.0, begin, duration, rtol=tolerance, atol=scale)
    tracker.restart()
    times, origins, directions = [0.0], [tracker.origin], [tracker.direction]
    pieces: list[Any] = []
    while solver.status == "running":
        try:
            solver.step()
        except _EnoughError:
            why = f"it has taken {system.most} evaluations: allow more, a greater tolerance or a shorter duration"
            stuck = _stuck(tracker.mechanism, times[-1], tracker.drive, why, "steps")
            break
        reached = tracker.go(system.laws(solver.t, solver.y)[0])
        if not reached or str(solver.status) == "failed" or tracker.steepness > STEEP:
            stuck = _stuck(tracker.mechanism, solver.t, tracker.drive, _aligned(tracker))
            break
        if len(pieces) >= most_steps:
            more = f"{duration:g} s would take about {duration / times[-1]:.3g} times as many"
            why = f"it has taken {most_steps} steps, {more}"
            stuck = _stuck(tracker.mechanism, times[-1], tracker.drive, why, "steps")
            break
        tracker.mark()
        times.append(solver.t)
        pieces.append(solver.dense_output())
        origins.append(tracker.origin)
        directions.append(tracker.direction)
        if on_step:
            on_step(solver.t)
    else:
        return _course(system, times, pieces, origins, directions, int(solver.nfev))
    stuck.course = _course(system, times, pieces, origins, directions, int(solver.nfev)) if pieces else None
    raise stuck


def _course(
    system: _System, times: list[float], pieces: list[Any], origins: list[Any], directions: list[Any], evaluations: int
) -> IntegratedMotion:
    from scipy.integrate import OdeSolution

    tracker = system.tracker
    postures = Posture(tracker.mechanism, np.concatenate(origins, axis=-1), np.concatenate(directions, axis=-1))
    return IntegratedMotion(
        tracker.mechanism, system.drives, np.array(times), postures, OdeSolution(times, pieces), evaluations
    )


def motion_during(course: IntegratedMotion, time: Any) -> Motion:
    """An integrated motion at given times [s] within its duration, shape (positions,), as any other motion."""
    time = np.atleast_1d(np.asarray(time, float))
    if time.min() < 0 or time.max() > course.time[-1]:
        raise ForwardError(f"asked at {time.min():g} to {time.max():g} s, integrated from 0 to {course.time[-1]:g} s")
    free = [number for number, drive in enumerate(course.drives) if isinstance(drive, Effort)]
    state = course.state(time)
    drive, rate, rate2 = (np.zeros((len(course.drives), len(time))) for _ in range(3))
    for number, law in enumerate(course.drives):
        if isinstance(law, Effort):
            drive[number], rate[number] = state[free.index(number)], state[len(free) + free.index(number)]
        else:
            drive[number], rate[number], rate2[number] = law(time)
    step = np.clip(np.searchsorted(course.time, time), 1, len(course.time) - 1)
    step -= time - course.time[step - 1] < course.time[step] - time
    near = Posture(course.mechanism, course.postures.origin[:, step], course.postures.direction[:, step])
    coasting = motion(course.mechanism, drive, rate, 0.0, time, near)
    equation = equation_of_motion(coasting)
    balance = equation.force - equation.bias - np.einsum("jk...,k...->j...", equation.inertia, rate2)
    for number in free:
        balance[number] += course.drives[number](coasting)
    inertia = np.moveaxis(equation.inertia[np.ix_(free, free)], -1, 0)
    rate2[free] = np.linalg.solve(inertia, balance[free].T[..., None])[..., 0].T
    return with_rates(coasting, rate, rate2)


class _System:
    """Right-hand side of the equation of motion; its only memory is where the links were last."""

    def __init__(self, tracker: Tracker, drives: tuple[Effort | MotionLaw, ...], free: list[int], most: float) -> None:
        self.tracker, self.drives, self.free = tracker, drives, free
        self.evaluations, self.most = 0, most

    def effort(self, coasting: Motion) -> Reals:
        """Efforts of all drives; 0 where a drive follows a law."""
        found = np.zeros(len(self.drives))
        for number in self.free:
            found[number] = np.ravel(self.drives[number](coasting))[0]
        return found

    def __call__(self, time: float, state: Any) -> Any:
        """Rates and accelerations of the efforts' coordinates; nan where the mechanism does not close."""
        half = len(self.free)
        drive, rate, rate2 = self.laws(time, state)
        self.evaluations += 1
        if self.evaluations > self.most:
            raise _EnoughError
        reached = self.tracker.go(drive)
        if reached and not self.tracker.narrow:
            inertia, balance, coasting = self.tracker.equation(time, rate)
            balance += self.effort(coasting)
        else:
            beside = self.tracker.equation_beside(time, rate, drive, self.effort)
            if beside is not None:
                inertia, balance = beside
            elif reached:
                inertia, balance, coasting = self.tracker.equation(time, rate)
                balance += self.effort(coasting)
            else:
                return np.full(2 * half, np.nan)
        balance = balance - inertia @ rate2
        try:
            found = np.linalg.solve(inertia[np.ix_(self.free, self.free)], balance[self.free])
        except np.linalg.LinAlgError:
            found = np.full(half, np.nan)
        return np.concatenate([rate[self.free], found])

    def laws(self, time: float, state: Any) -> tuple[Reals, Reals, Reals]:
        """Coordinates and rates of all drives, and the accelerations of those that follow a law."""
        drive, rate, rate2 = np.zeros((3, len(self.drives)))
        half = len(self.free)
        drive[self.free], rate[self.free] = state[:half], state[half:]
        for number, law in enumerate(self.drives):
            if not isinstance(law, Effort):
                drive[number], rate[number], rate2[number] = (float(np.ravel(value)[0]) for value in law([time]))
        return drive, rate, rate2


def _aligned(tracker: Tracker) -> str:
    """What keeps a mechanism from going on where it is now."""
    near = Posture(tracker.mechanism, tracker.origin, tracker.direction)
    joint = aligned_joint(motion(tracker.mechanism, tracker.drive[:, None], near=near))
    return f'the joint "{joint}" aligns, which no drive leads it through' if joint else "its speed has no bound"


def _stuck(mechanism: Mechanism, time: float, drive: Reals, why: str, kind: str = "singular") -> ForwardError:
    names = [each.name for each in mechanism.drives]
    places = ", ".join(f'"{name}" at {value:.6g}' for name, value in zip(names, drive, strict=True))
    return ForwardError(
        f"the motion cannot go on after {time:.6g} s with {places}: {why}",
        time,
        kind=kind,
        links=[each.link for each in mechanism.drives if isinstance(each, PinDrive)],
        drives=range(len(names)),
    )
