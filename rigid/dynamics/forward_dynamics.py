"""Forward dynamics: some drives are given as efforts, and their motion is found by integrating it.

The unknowns are the coordinates of the drives, so that the loops of the mechanism close to round-off at every instant.
Derivation: docs/dynamics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.analysis.turning_points import aligned_joint
from rigid.decomposition.order import structure
from rigid.dynamics.effort import equation_of_motion, unit_motions
from rigid.dynamics.leading import Lead, Stretch, led_otherwise, unwound
from rigid.dynamics.tracking import Tracker
from rigid.joint_places import joint_place
from rigid.joints import Joint
from rigid.kinematics import Motion, motion, with_rates
from rigid.loads import given_loads
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import Law, MechanismError, PinDrive, Reals
from rigid.plane import dot
from rigid.postures import Posture

EVALUATIONS = 200_000  # of the equation of motion, at which an integration is given up
LEAST_TOLERANCE = 3e-14  # below it the integrator's error estimate is round-off
INTERRUPTED = "interrupted"  # kind of the error where a user ended the integration
FADING = 50.0  # of that rate, from which another joint is looked for that leads them better
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
    stretches
        One after the other, each led by the same joints.
    evaluations
        Of the equation of motion.
    """

    mechanism: Mechanism
    drives: tuple[Effort | MotionLaw, ...]
    time: Reals
    stretches: tuple[Stretch, ...]
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
        drive given as effort that moves no mass; or it was interrupted from the keyboard, of kind "interrupted".
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
    if mechanism.friction:
        why = "friction follows from joint forces, which an integrated motion does not know: give dampers, or laws"
        raise ForwardError(f"friction of joints under efforts: {why}", joints=mechanism.friction)
    free = [number for number, drive in enumerate(drives) if isinstance(drive, Effort)]
    start, rate = (np.broadcast_to(np.asarray(value, float), (count,)).copy() for value in (start, rate))
    for number, drive in enumerate(drives):
        if not isinstance(drive, Effort):
            start[number], rate[number], _ = (float(np.ravel(value)[0]) for value in drive(np.zeros(1)))
    own = {number: float(start[number]) for number in free}
    system = _System(Lead(mechanism, mechanism), Tracker(mechanism, start), drives, free, evaluations, own)
    begin = np.concatenate([start[free], rate[free]])
    if not np.isfinite(system(0.0, begin)).all():
        raise _stuck(mechanism, 0.0, start, "a drive given as effort moves no mass there")
    most = np.inf if most_steps is None else most_steps
    run = _Run(duration, max(tolerance, LEAST_TOLERANCE), tolerance, most, on_step)
    return _integrated(system, begin, run)


@dataclass
class _Run:
    """What is asked of an integration, and what was done so far."""

    duration: float
    relative: float
    absolute: float
    most_steps: float
    on_step: Callable[[float], None] | None
    time: float = 0.0
    steps: int = 0


_Step = tuple[float, Any, Any, Any, Any]
"""Time, the interpolation that ends there, and there the origins and directions of the links and their angles."""


def _integrated(system: _System, begin: Reals, run: _Run) -> IntegratedMotion:
    """Stretches from time 0 to the duration."""
    stretches: list[Stretch] = []
    while True:
        tracker = system.tracker
        tracker.restart()
        steps: list[_Step] = [(run.time, None, tracker.origin, tracker.direction, tracker.angle)]
        try:
            ended = _stepped(system, begin, run, steps)
        except KeyboardInterrupt:
            if not stretches and len(steps) == 1:
                raise
            ended = _stuck(system.lead.mechanism, run.time, system.own_drive, "it was interrupted", INTERRUPTED)
        if len(steps) > 1:
            stretches.append(_stretch(system, steps))
        if isinstance(ended, tuple):
            system, begin = ended
            continue
        course = None
        if stretches:
            times = np.concatenate([stretches[0].time[:1], *(stretch.time[1:] for stretch in stretches)])
            course = IntegratedMotion(system.lead.mechanism, system.drives, times, tuple(stretches), system.evaluations)
        if ended is None and course is not None:
            return course
        assert ended is not None
        ended.course = course
        raise ended


def _stepped(
    system: _System, begin: Reals, run: _Run, steps: list[_Step]
) -> ForwardError | tuple[_System, Reals] | None:
    """Take steps to the end, and append them; what stops it before, or the system and state with which to go on."""
    from scipy.integrate import DOP853

    tracker = system.tracker
    scale = run.absolute * np.concatenate([system.unit, system.unit / run.duration])
    solver = DOP853(system, run.time, begin, run.duration, rtol=run.relative, atol=scale)
    if not np.isfinite(solver.f).all():
        return _stuck(system.lead.mechanism, run.time, system.own_drive, _aligned(tracker))
    tracker.restart()
    while solver.status == "running":
        try:
            solver.step()
        except _EnoughError:
            why = f"it has taken {system.most} evaluations: allow more, a greater tolerance or a shorter duration"
            return _stuck(system.lead.mechanism, run.time, system.own_drive, why, "steps")
        reached = tracker.go(system.laws(solver.t, solver.y)[0])
        if not reached or str(solver.status) == "failed" or tracker.steepness > STEEP:
            other = _led_otherwise(system, steps, solver)
            return other or _stuck(system.lead.mechanism, solver.t, system.own_drive, _aligned(tracker))
        if run.steps >= run.most_steps:
            more = f"{run.duration:g} s would take about {run.duration / run.time:.3g} times as many"
            why = f"it has taken {run.most_steps} steps, {more}"
            return _stuck(system.lead.mechanism, run.time, system.own_drive, why, "steps")
        tracker.mark()
        steps.append((solver.t, solver.dense_output(), tracker.origin, tracker.direction, tracker.angle))
        run.time, run.steps = solver.t, run.steps + 1
        if run.on_step:
            run.on_step(run.time)
        if tracker.steepness > FADING and solver.status == "running":
            other = _led_otherwise(system, steps, solver)
            if other is not None:
                return other
    return None


def _led_otherwise(system: _System, steps: list[_Step], solver: Any) -> tuple[_System, Reals] | None:
    """The same motion from the last step on, led by another joint; None where there is none that leads it better."""
    time, piece, origin, direction, angle = steps[-1]
    if piece is None:
        return None
    tracker, lead = system.tracker, system.lead
    drive, rate, _ = system.laws(time, piece(time))
    if not tracker.go(drive):
        return None
    twists = tracker.unit_twists
    other = led_otherwise(lead, tracker, twists, system.free, tracker.size)
    if other is None:
        return None
    velocity, omega = (part @ rate[:, None] for part in twists)
    joints = {joint.drive: joint for joint in structure(other.variant).joints if joint.drive is not None}
    for number in system.free:
        drive[number] = unwound(tracker, joints[number], drive[number])[0]
        rate[number] = joints[number].sense * joint_place(tracker, joints[number]).rate(velocity, omega)[0]
    try:
        next_one = Tracker(other.variant, drive, Posture(other.variant, origin, direction))
    except MechanismError:
        return None
    if next_one.steepness > FADING:
        return None
    own = system.own_coordinates(angle)
    found = _System(other, next_one, system.drives, system.free, system.most, own, system.evaluations)
    return found, np.concatenate([drive[system.free], rate[system.free]])


def _stretch(system: _System, steps: Sequence[_Step]) -> Stretch:
    """What steps from a start make."""
    from scipy.integrate import OdeSolution

    times, pieces, origins, directions, angles = zip(*steps, strict=True)
    courses = [system.own_coordinates(angle) for angle in angles]
    return Stretch(
        system.lead,
        np.array(times),
        np.concatenate(origins, axis=-1),
        np.concatenate(directions, axis=-1),
        OdeSolution(times, pieces[1:]),
        {number: np.array([course[number] for course in courses]) for number in system.lead.own},
    )


def motion_during(course: IntegratedMotion, time: Any) -> Motion:
    """An integrated motion at given times [s] within its duration, shape (positions,), as any other motion."""
    time = np.atleast_1d(np.asarray(time, float))
    if time.min() < 0 or time.max() > course.time[-1]:
        raise ForwardError(f"asked at {time.min():g} to {time.max():g} s, integrated from 0 to {course.time[-1]:g} s")
    if len(course.stretches) == 1:
        return _moving(course.stretches[0], course.drives, time)
    which = np.searchsorted([stretch.time[-1] for stretch in course.stretches[:-1]], time)
    drive, rate, rate2 = (np.zeros((len(course.drives), len(time))) for _ in range(3))
    places = np.zeros((2, len(course.mechanism.links), len(time)), complex)
    for number, stretch in enumerate(course.stretches):
        own = which == number
        if own.any():
            part = _moving(stretch, course.drives, time[own])
            seen = stretch.lead.seen(part, _near(stretch, time[own]))
            drive[:, own], rate[:, own], rate2[:, own] = seen.drive, seen.drive_rate, part.drive_acceleration
            for led, value in stretch.lead.accelerations(part).items():
                rate2[led, own] = value
            places[:, :, own] = part.origin, part.direction
    return motion(course.mechanism, drive, rate, rate2, time, Posture(course.mechanism, *places))


def _nearest(stretch: Stretch, time: Reals) -> Any:
    """Numbers of the steps next to some times."""
    step = np.clip(np.searchsorted(stretch.time, time), 1, len(stretch.time) - 1)
    step -= time - stretch.time[step - 1] < stretch.time[step] - time
    return step


def _near(stretch: Stretch, time: Reals) -> dict[int, Any]:
    """Coordinates of the drives that others lead at the steps next to some times."""
    return {number: values[_nearest(stretch, time)] for number, values in stretch.own.items()}


def _moving(stretch: Stretch, drives: Sequence[Effort | MotionLaw], time: Reals) -> Motion:
    """The motion of what is led in a stretch, at times in it."""
    free = [number for number, drive in enumerate(drives) if isinstance(drive, Effort)]
    state, variant = stretch.state(time), stretch.lead.variant
    drive, rate, rate2 = (np.zeros((len(drives), len(time))) for _ in range(3))
    for number, law in enumerate(drives):
        if isinstance(law, Effort):
            drive[number], rate[number] = state[free.index(number)], state[len(free) + free.index(number)]
        else:
            drive[number], rate[number], rate2[number] = law(time)
    step = _nearest(stretch, time)
    near = Posture(variant, stretch.origin[:, step], stretch.direction[:, step])
    coasting = motion(variant, drive, rate, 0.0, time, near)
    equation = equation_of_motion(coasting)
    balance = equation.force - equation.bias - np.einsum("jk...,k...->j...", equation.inertia, rate2)
    seen = stretch.lead.seen(coasting, _near(stretch, time))
    units = unit_motions(coasting) if stretch.lead.own else []
    if units:  # the variant has no loads of its own
        for at, pull, couple in given_loads(seen):
            balance += [dot(unit.velocity[at], pull) + unit.angular_velocity[at] * couple for unit in units]
    unit_rates = [stretch.lead.rates(unit, unit.velocity, unit.angular_velocity) for unit in units]
    for number in free:
        effort = _effort_of(drives[number], seen)
        if number in stretch.lead.own:
            balance += [effort * rates[number] for rates in unit_rates]
        else:
            balance[number] += effort
    inertia = np.moveaxis(equation.inertia[np.ix_(free, free)], -1, 0)
    rate2[free] = np.linalg.solve(inertia, balance[free].T[..., None])[..., 0].T
    return with_rates(coasting, rate, rate2)


def _effort_of(drive: Effort | MotionLaw, motion: Motion) -> Any:
    assert isinstance(drive, Effort)
    return drive(motion)


class _System:
    """Right-hand side of the equation of motion; its only memory is where the links were last."""

    def __init__(
        self,
        lead: Lead,
        tracker: Tracker,
        drives: tuple[Effort | MotionLaw, ...],
        free: list[int],
        most: float,
        own: Mapping[int, float],
        done: int = 0,
    ) -> None:
        self.lead, self.tracker, self.drives, self.free = lead, tracker, drives, free
        self.evaluations, self.most = done, most
        self.unit = np.array([1.0 if tracker.turns(number) else tracker.size for number in free])
        turned = self.own_coordinates(tracker.angle, offset=False)
        self._offset = {number: own[number] - value for number, value in turned.items()}
        tracker.seen = lambda coasting: lead.seen(coasting, self.own_coordinates(tracker.angle))

    def own_coordinates(self, angle: Any, offset: bool = True) -> dict[int, float]:
        """Coordinates of the mechanism's own drives given as efforts, of angles over any number of turns; else 0.0."""
        found = {}
        for number in self.free:
            joint = self._own_joint(number)
            value = float(joint.sense * (angle[joint.child] - angle[joint.parent])[0]) if joint.turns else 0.0
            found[number] = value + (self._offset[number] if offset and joint.turns else 0.0)
        return found

    def _own_joint(self, number: int) -> Joint:
        return next(joint for joint in structure(self.lead.mechanism).joints if joint.drive == number)

    @property
    def own_drive(self) -> Reals:
        """Coordinates of the mechanism's own drives where it is now."""
        drive = self.tracker.drive.copy()
        near = self.own_coordinates(self.tracker.angle)
        for number, joint in self.lead.own.items():
            drive[number] = unwound(self.tracker, joint, near[number])[0]
        return drive

    def effort(self, seen: Motion) -> Reals:
        """What the efforts do along the joints that lead; 0 where a drive follows a law."""
        found = np.zeros(len(self.drives))
        rates = self.lead.rates(self.tracker, *self.tracker.unit_twists) if self.lead.own else {}
        for number in self.free:
            effort = float(np.ravel(_effort_of(self.drives[number], seen))[0])
            if number in rates:
                found += effort * rates[number]
            else:
                found[number] += effort
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
