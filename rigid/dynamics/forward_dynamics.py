"""Forward dynamics: integrate the motion of a mechanism under given drive efforts.

The unknowns of the integration are the drive coordinates. The positions of the links are computed from these at every
instant, so that all joints close to round-off. Derivation: docs/dynamics.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.analysis.turning_points import aligned_joint
from rigid.arrays import ArrayLike, Reals
from rigid.decomposition.order import structure
from rigid.dynamics.integrated_motion import Effort, ForwardError, IntegratedMotion, MotionLaw
from rigid.dynamics.leading import Lead, Stretch, better_leading_joints, unwound
from rigid.dynamics.system import BudgetExceededError, RightHandSide
from rigid.dynamics.tracking import Tracker
from rigid.kinematics import motion
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import MechanismError
from rigid.postures import Posture, joint_place

MAX_EVALUATIONS = 200_000  # maximum number of evaluations of the equation of motion
MIN_CHART_TOLERANCE = 1e-11  # for smaller tolerances, postures are not interpolated by a `PostureChart`
MIN_TOLERANCE = 3e-14  # lower bound of the relative tolerance: below it, the integrator's error estimate is round-off
INTERRUPTED = "interrupted"
"""Error kind if the user interrupts the integration."""
# Leading joints are the joints whose coordinates are integrated, see `rigid.dynamics.leading`.
SEARCH_STEEPNESS = 50.0  # search for better leading joints if `Tracker.steepness` exceeds this
MAX_STEEPNESS = 1e4  # stop the integration with the same leading joints if `Tracker.steepness` exceeds this
ESTIMATE_STEPS = 20  # the number of remaining steps is estimated from this number of latest steps
TINY = np.finfo(float).tiny
# stop the integration if the estimated number of remaining steps exceeds the maximum number of steps by this factor
MAX_STEP_RATIO = 1000.0


def forward(
    mechanism: Mechanism,
    drives: Sequence[Effort | MotionLaw],
    start: ArrayLike,
    rate: ArrayLike,
    duration: float,
    tolerance: float = 1e-10,
    max_steps: int | None = None,
    on_step: Callable[[float], None] | None = None,
    evaluations: int = MAX_EVALUATIONS,
) -> IntegratedMotion:
    """Integrate the motion of a mechanism under given drive efforts, from time 0.

    Parameters
    ----------
    mechanism
        Mechanism of one design (scalar lengths).
    drives
        An `Effort` or a motion law for each drive. The coordinates of drives with efforts are integrated. The other
        drives follow their motion laws.
    start, rate
        Drive coordinates [rad or m] and their rates at time 0, shape () or (drives,). The values of drives with motion
        laws are ignored.
    duration
        Duration [s].
    tolerance
        Tolerance of the estimated error in each step. The estimated error of a coordinate q is at most `tolerance *
        (|q| + u)`, where u is 1 rad for an angle and the mechanism size for a slide. The estimated error of a rate r is
        at most `tolerance * (|r| + u / duration)`. The error at the end of the motion may be larger, because errors can
        grow.
    max_steps
        Maximum number of steps. The integration stops early if the estimated number of remaining steps is more than
        1000 times this maximum.
    on_step
        Function that is called with the time [s] after each step.
    evaluations
        Maximum number of evaluations of the equation of motion, which limits the run time if the steps become tiny.

    Raises
    ------
    ForwardError
        If the length of `drives` is wrong, joints have friction, or a drive with an effort moves no mass. If the motion
        cannot continue (kind "singular"): the speed becomes infinite, the drives do not determine the motion at a
        position, or the links reach different positions with long and with short steps. If there are too many steps or
        evaluations (kind "steps"). If the user interrupts after the first step (kind "interrupted").
    KeyboardInterrupt
        If the user interrupts before the first step.
    MechanismError
        If the mechanism cannot be assembled at the start, is in a singular position there, or has several designs.

    References
    ----------
    Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., 1993, II.5: method of order 8.
    """
    drives = tuple(drives)
    count = len(mechanism.drives)
    if len(drives) != count:
        raise ForwardError(f"{len(drives)} efforts or motion laws were given for {counted(count, 'drive')}")
    if mechanism.friction:
        why = "it depends on joint forces, which the integration does not compute: use dampers or motion laws instead"
        raise ForwardError(f"friction of joints under efforts: {why}", joints=mechanism.friction)
    free = [number for number, drive in enumerate(drives) if isinstance(drive, Effort)]
    start, rate = (np.broadcast_to(np.asarray(value, float), (count,)).copy() for value in (start, rate))
    for number, drive in enumerate(drives):
        if not isinstance(drive, Effort):
            start[number], rate[number], _ = (float(np.ravel(value)[0]) for value in drive(np.zeros(1)))
    begin_coordinates = {number: float(start[number]) for number in free}
    lead, tracker, charted = Lead(mechanism, mechanism), Tracker(mechanism, start), tolerance >= MIN_CHART_TOLERANCE
    system = RightHandSide(lead, tracker, drives, free, evaluations, begin_coordinates, charted=charted)
    begin = np.concatenate([start[free], rate[free]])
    if not np.isfinite(system(0.0, begin)).all():
        raise _stuck(mechanism, 0.0, start, "a drive with a given effort moves no mass")
    limit = np.inf if max_steps is None else max_steps
    run = _Run(duration, max(tolerance, MIN_TOLERANCE), tolerance, limit, on_step)
    return _integrated(system, begin, run)


@dataclass
class _Run:
    """Options and progress of an integration."""

    duration: float
    relative: float
    absolute: float
    max_steps: float
    on_step: Callable[[float], None] | None
    time: float = 0.0
    steps: int = 0


_Step = tuple[float, Any, Any, Any, Any]
"""Time at the end of a step, interpolant of the step, and origins, directions and angles of the links at its end."""


def _integrated(system: RightHandSide, begin: Reals, run: _Run) -> IntegratedMotion:
    """Integrate the motion in stretches, i.e. time intervals with the same leading (integrated) joints."""
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
            ended = _stuck(system.lead.mechanism, run.time, system.original_drive, "it was interrupted", INTERRUPTED)
        if len(steps) > 1:
            stretches.append(_stretch(system, steps))
        if isinstance(ended, tuple):
            system, begin = ended
            continue
        result = None
        if stretches:
            times = np.concatenate([stretches[0].time[:1], *(stretch.time[1:] for stretch in stretches)])
            result = IntegratedMotion(system.lead.mechanism, system.drives, times, tuple(stretches), system.evaluations)
        if ended is None and result is not None:
            return result
        assert ended is not None
        ended.motion = result
        raise ended


def _stepped(
    system: RightHandSide, begin: Reals, run: _Run, steps: list[_Step]
) -> ForwardError | tuple[RightHandSide, Reals] | None:
    """Integrate with the same leading (integrated) joints, and append each step to `steps`.

    Returns
    -------
    None if the end of the run is reached. If other leading joints are better, the equation of motion and the state in
    terms of these joints. If the motion cannot continue, the error.
    """
    from scipy.integrate import DOP853

    tracker = system.tracker
    scale = run.absolute * np.concatenate([system.unit, system.unit / run.duration])
    solver = DOP853(system, run.time, begin, run.duration, rtol=run.relative, atol=scale)
    if not np.isfinite(solver.f).all():
        return _stuck(system.lead.mechanism, run.time, system.original_drive, _aligned(tracker))
    tracker.restart()
    while solver.status == "running":
        try:
            solver.step()
        except BudgetExceededError:
            why = f"it has taken {system.most} evaluations: allow more, a larger tolerance or a shorter duration"
            return _stuck(system.lead.mechanism, run.time, system.original_drive, why, "steps")
        reached = tracker.step_to(system.laws(solver.t, solver.y)[0])
        if not reached or str(solver.status) == "failed" or tracker.steepness > MAX_STEEPNESS:
            other = _with_better_lead(system, steps, solver)
            return other or _stuck(system.lead.mechanism, solver.t, system.original_drive, _aligned(tracker))
        inconsistent = system.chart is not None and not system.chart.is_consistent(float(tracker.drive[0]))
        if inconsistent or run.steps >= run.max_steps or _too_slow(run, steps):
            more = f"{run.duration:g} s would take about {run.duration / max(run.time, TINY):.3g} times as many"
            why = f"it has taken {run.steps} steps, {more}"
            if inconsistent:
                why = "the links reach different positions with long and with short steps: give a smaller tolerance"
            kind = "singular" if inconsistent else "steps"
            return _stuck(system.lead.mechanism, run.time, system.original_drive, why, kind)
        tracker.mark()
        # read the posture first, because `dense_output` moves the tracker
        here = tracker.origin, tracker.direction, tracker.angle
        steps.append((solver.t, solver.dense_output(), *here))
        run.time, run.steps = solver.t, run.steps + 1
        if run.on_step:
            run.on_step(run.time)
        if tracker.steepness > SEARCH_STEEPNESS and solver.status == "running":
            other = _with_better_lead(system, steps, solver)
            if other is not None:
                return other
    return None


def _too_slow(run: _Run, steps: Sequence[_Step]) -> bool:
    """Return whether the remaining time would take too many steps, see `MAX_STEP_RATIO`."""
    if not np.isfinite(run.max_steps):
        return False
    times = [step[0] for step in steps[-ESTIMATE_STEPS - 1 :]]
    return remaining_steps(times, run.duration) > MAX_STEP_RATIO * run.max_steps


def remaining_steps(times: Sequence[float], duration: float) -> float:
    """Estimate the number of remaining steps from the latest step sizes.

    Return 0 if the step sizes grow or there are too few steps.

    Parameters
    ----------
    times
        Times of all steps so far, including the start [s].
    duration
        Duration of the run [s].
    """
    if len(times) <= ESTIMATE_STEPS:
        return 0.0
    sizes = np.diff(times[-ESTIMATE_STEPS - 1 :])
    before, after = float(sizes[: ESTIMATE_STEPS // 2].max()), float(sizes[ESTIMATE_STEPS // 2 :].max())
    return (duration - times[-1]) / max(before, TINY) if after <= before else 0.0


def _with_better_lead(system: RightHandSide, steps: list[_Step], solver: Any) -> tuple[RightHandSide, Reals] | None:
    """Replace one of the leading (integrated) joints by a better joint.

    Return the equation of motion and the state in terms of the new leading joints, or None if no joint is better.
    """
    time, piece, origin, direction, angle = steps[-1]
    if piece is None:
        return None
    tracker, lead = system.tracker, system.lead
    drive, rate, _ = system.laws(time, piece(time))
    if not tracker.step_to(drive):
        return None
    twists = tracker.unit_twists
    other = better_leading_joints(lead, tracker, twists, system.free, tracker.size)
    if other is None:
        return None
    velocity, omega = (part @ rate[:, None] for part in twists)
    joints = {joint.drive: joint for joint in structure(other.variant).joints if joint.drive is not None}
    for number in system.free:
        drive[number] = unwound(tracker, joints[number], drive[number])[0]
        rate[number] = joints[number].sense * joint_place(tracker, joints[number]).rate(velocity, omega)[0]
    try:
        next_tracker = Tracker(other.variant, drive, Posture(other.variant, origin, direction))
    except MechanismError:
        return None
    if next_tracker.steepness > SEARCH_STEEPNESS:
        return None
    original, charted = system.original_coordinates(angle), system.chart is not None
    next_system = RightHandSide(
        other, next_tracker, system.drives, system.free, system.most, original, system.evaluations, charted
    )
    return next_system, np.concatenate([drive[system.free], rate[system.free]])


def _stretch(system: RightHandSide, steps: Sequence[_Step]) -> Stretch:
    """Combine integration steps with the same leading joints into a `Stretch`."""
    from scipy.integrate import OdeSolution

    times, pieces, origins, directions, angles = zip(*steps, strict=True)
    coordinates = [system.original_coordinates(angle) for angle in angles]
    return Stretch(
        system.lead,
        np.array(times),
        np.concatenate(origins, axis=-1),
        np.concatenate(directions, axis=-1),
        OdeSolution(times, pieces[1:]),
        {number: np.array([each[number] for each in coordinates]) for number in system.lead.replaced},
    )


def _aligned(tracker: Tracker) -> str:
    """Return a text that says why the motion stops at the current posture."""
    near = Posture(tracker.mechanism, tracker.origin, tracker.direction)
    joint = aligned_joint(motion(tracker.mechanism, tracker.drive[:, None], near=near))
    if not joint:
        return "the speed becomes infinite"
    return f'the links at the joint "{joint}" align, and no drive moves them through this position'


def _stuck(mechanism: Mechanism, time: float, drive: Reals, why: str, kind: str = "singular") -> ForwardError:
    names = [each.name for each in mechanism.drives]
    places = ", ".join(f'"{name}" at {value:.6g}' for name, value in zip(names, drive, strict=True))
    return ForwardError(
        f"the motion cannot continue after {time:.6g} s, with {places}: {why}",
        time,
        kind=kind,
        links=[link for each in mechanism.drives for link in each.links[:1]],
        drives=range(len(names)),
    )
