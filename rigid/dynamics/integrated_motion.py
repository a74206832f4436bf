"""Efforts of drives, integrated motions with interpolation in time, and the equation of motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Integers, Reals
from rigid.constants import mass_constants
from rigid.dynamics.leading import Stretch
from rigid.kinematics import Motion, motion, with_rates
from rigid.kinetostatics.loads import given_loads
from rigid.kinetostatics.resistance import Resistance
from rigid.mechanism import Mechanism
from rigid.parts import Law, MechanismError
from rigid.plane import cross, dot
from rigid.postures import Posture

MotionLaw = Callable[[Any], tuple[Any, Any, Any]]
"""Function from times [s] to the coordinate, rate and acceleration of a drive."""


class ForwardError(MechanismError):
    """Error in forward dynamics.

    `time` [s] is the end of the last successful step. `motion` is the motion up to the end of this step, or None if no
    step succeeded. For the other attributes see `MechanismError`.
    """

    motion: IntegratedMotion | None = None

    def __init__(self, message: str, time: float = 0.0, **culprits: Any) -> None:
        super().__init__(message, **culprits)
        self.time = time


class Effort(Struct, frozen=True):
    """Effort of a drive: a moment [N m] or force [N] along the drive coordinate, constant or given by a law.

    A drive with the effort 0 moves freely. A law is a function that returns the effort for a motion. It may use the
    time, the drive coordinates and their rates, and positions and velocities of the links, but no accelerations.
    """

    law: Law | float = 0.0

    def __call__(self, motion: Motion) -> Reals:
        """Return the effort, shape (..., positions)."""
        return self.law(motion) if callable(self.law) else np.full(motion.columns, float(self.law))


class IntegratedMotion(Struct, frozen=True, eq=False):
    """Result of an integration. `motion_during` evaluates it at any time.

    Attributes
    ----------
    drives
        `Effort` or motion law of each drive.
    time
        Times of the integration steps [s], shape (steps,).
    stretches
        Consecutive time intervals of the motion. In each of them, the coordinates of the same joints are integrated.
        These joints are called leading joints.
    evaluations
        Number of evaluations of the equation of motion.
    """

    mechanism: Mechanism
    drives: tuple[Effort | MotionLaw, ...]
    time: Reals
    stretches: tuple[Stretch, ...]
    evaluations: int


def motion_during(integrated: IntegratedMotion, time: Any) -> Motion:
    """Evaluate an integrated motion at given times [s] within its duration, shape (positions,).

    Raises
    ------
    ForwardError
        If a time is outside the duration.
    """
    time = np.atleast_1d(np.asarray(time, float))
    if time.min() < 0 or time.max() > integrated.time[-1]:
        requested, covered = f"{time.min():g} to {time.max():g} s", f"0 to {integrated.time[-1]:g} s"
        raise ForwardError(f"the motion is requested from {requested}, but it is integrated from {covered} only")
    if len(integrated.stretches) == 1:
        return _moving(integrated.stretches[0], integrated.drives, time)
    which = np.searchsorted([stretch.time[-1] for stretch in integrated.stretches[:-1]], time)
    drive, rate, rate2 = (np.zeros((len(integrated.drives), len(time))) for _ in range(3))
    places = np.zeros((2, len(integrated.mechanism.links), len(time)), complex)
    for number, stretch in enumerate(integrated.stretches):
        within = which == number
        if within.any():
            part = _moving(stretch, integrated.drives, time[within])
            original = stretch.lead.original_motion(part, _near(stretch, time[within]))
            drive[:, within], rate[:, within], rate2[:, within] = (
                original.drive,
                original.drive_rate,
                part.drive_acceleration,
            )
            for led, value in stretch.lead.accelerations(part).items():
                rate2[led, within] = value
            places[:, :, within] = part.origin, part.direction
    return motion(integrated.mechanism, drive, rate, rate2, time, Posture(integrated.mechanism, *places))


def _nearest(stretch: Stretch, time: Reals) -> Integers:
    """Return the indices of the steps closest to given times."""
    step = np.clip(np.searchsorted(stretch.time, time), 1, len(stretch.time) - 1)
    step -= time - stretch.time[step - 1] < stretch.time[step] - time
    return step


def _near(stretch: Stretch, time: Reals) -> dict[int, Reals]:
    """Return approximate coordinates of the replaced drives at given times: the values at the closest steps.

    A drive is replaced if the coordinate of another joint is integrated in its place.
    """
    return {number: values[_nearest(stretch, time)] for number, values in stretch.replaced.items()}


def _drive_columns(stretch: Stretch, drives: Sequence[Effort | MotionLaw], time: Reals) -> tuple[Reals, Reals, Reals]:
    """Return coordinates, rates and accelerations of the leading joints, each of shape (drives, positions).

    A leading joint is a joint that a motion law drives, or whose coordinate is integrated. The accelerations are those
    of the motion law for the former, and 0 for the latter.
    """
    free = [number for number, drive in enumerate(drives) if isinstance(drive, Effort)]
    state = stretch.state(time)
    drive, rate, rate2 = (np.zeros((len(drives), len(time))) for _ in range(3))
    for number, law in enumerate(drives):
        if isinstance(law, Effort):
            drive[number], rate[number] = state[free.index(number)], state[len(free) + free.index(number)]
        else:
            drive[number], rate[number], rate2[number] = law(time)
    return drive, rate, rate2


def _postures(stretch: Stretch, drives: Sequence[Effort | MotionLaw], time: Reals) -> Posture:
    """Interpolate the postures between the steps of the integration by cubic Hermite polynomials.

    The exact positions are computed later. The interpolated postures only select the branch (assembly) for this. The
    posture at the nearest step would not be sufficient. If two branches meet within a step, that posture may be closer
    to the wrong one.
    """
    variant = stretch.lead.variant
    before = np.clip(np.searchsorted(stretch.time, time, side="right") - 1, 0, len(stretch.time) - 2)
    steps = np.union1d(before, before + 1)
    here = Posture(variant, stretch.origin[:, steps], stretch.direction[:, steps])
    at = motion(variant, *_drive_columns(stretch, drives, stretch.time[steps])[:2], 0.0, stretch.time[steps], here)
    low = np.searchsorted(steps, before)
    length = at.time[low + 1] - at.time[low]
    part = (time - at.time[low]) / length
    turned = np.angle(here.direction[:, low + 1] * np.conj(here.direction[:, low]))
    mean = length * 0.5 * (at.angular_velocity[:, low] + at.angular_velocity[:, low + 1])
    turned = turned + 2 * np.pi * np.round(np.nan_to_num(mean - turned) / (2 * np.pi))
    moved = here.origin[:, low + 1] - here.origin[:, low]

    def cubic(change: Any, rates: Any) -> Any:
        first, last = (np.where(np.isfinite(end), end * length, change) for end in (rates[:, low], rates[:, low + 1]))
        return part * (first + part * (3 * change - 2 * first - last + part * (first + last - 2 * change)))

    direction = here.direction[:, low] * np.exp(1j * cubic(turned, at.angular_velocity))
    return Posture(variant, here.origin[:, low] + cubic(moved, at.velocity), direction)


def _moving(stretch: Stretch, drives: Sequence[Effort | MotionLaw], time: Reals) -> Motion:
    """Return the motion at given times within a stretch, in the coordinates of its leading joints.

    A stretch is a time interval with the same leading joints, i.e. the joints whose coordinates are integrated.
    """
    free = [number for number, drive in enumerate(drives) if isinstance(drive, Effort)]
    drive, rate, rate2 = _drive_columns(stretch, drives, time)
    coasting = motion(stretch.lead.variant, drive, rate, 0.0, time, _postures(stretch, drives, time))
    equation = equation_of_motion(coasting)
    units = coasting.units if stretch.lead.replaced else []
    unit_rates = [stretch.lead.rates(unit, unit.velocity, unit.angular_velocity) for unit in units]
    whole, balance = equation.inertia, equation.force - equation.bias
    for number, second in stretch.lead.accelerations(coasting).items():
        rates, rotor = np.array([each[number] for each in unit_rates]), stretch.lead.mechanism.drives[number].inertia
        whole, balance = whole + rotor * rates * rates[:, None], balance - rotor * rates * second
    balance = balance - np.einsum("jk...,k...->j...", whole, rate2)
    inertia, near = np.moveaxis(whole[np.ix_(free, free)], -1, 0), _near(stretch, time)

    def accelerated(loaded: Motion) -> Motion:
        """Evaluate the loads and efforts for the motion `loaded`, and return the motion that they cause.

        `loaded` has the positions and velocities of the returned motion, but may have other accelerations.
        """
        original, total = stretch.lead.original_motion(loaded, near), balance.copy()
        if units:  # the mechanism of `coasting` has no loads, so that `equation` does not contain them
            for at, pull, couple in given_loads(original):
                total += [dot(unit.velocity[at], pull) + unit.angular_velocity[at] * couple for unit in units]
        elif loaded is not coasting:
            total += _reduced_loads(loaded, loaded.units) - equation.force
        for number in free:
            effort = effort_of(drives[number], original)
            if number in stretch.lead.replaced:
                total += [effort * rates[number] for rates in unit_rates]
            else:
                total[number] += effort
        rate2[free] = np.linalg.solve(inertia, total[free].T[..., None])[..., 0].T
        return with_rates(coasting, rate, rate2)

    found = accelerated(coasting)
    resisted = any(isinstance(load, Resistance) for load in stretch.lead.mechanism.loads)
    # a resisting force opposes the velocity, or at rest the acceleration, which is known only from `found`
    return accelerated(found) if resisted else found


def effort_of(drive: Effort | MotionLaw, motion: Motion) -> Reals:
    """Evaluate the effort of a drive, shape (..., positions)."""
    assert isinstance(drive, Effort)
    return drive(motion)


class EquationOfMotion(Struct, frozen=True, eq=False):
    """Equation of motion, `inertia @ drive_acceleration + bias = force + effort`, with one row per drive.

    Attributes
    ----------
    inertia
        Inertia reduced to the drives (symmetric) [kg m^2, kg m or kg], shape (drives, drives, ..., positions).
    bias
        Drive efforts that centripetal and Coriolis accelerations require at zero drive acceleration [N m or N], shape
        (drives, ..., positions).
    force
        Weight and loads reduced to the drives, without joint friction [N m or N], shape (drives, ..., positions).
    """

    inertia: Reals
    bias: Reals
    force: Reals


def equation_of_motion(motion: Motion) -> EquationOfMotion:
    """Return the equation of motion in the drive coordinates, at the positions and rates of a motion.

    References
    ----------
    Scutaru, Vlase, Marin, equations (41) to (43). For a single drive, they write alpha for `inertia` and beta omega^2
    for `bias`, with the drive rate omega.
    """
    units = motion.units
    inertia = np.stack([[_inertia_power(unit, other) for other in units] for unit in units])
    for number, drive in enumerate(motion.mechanism.drives):
        inertia[number, number] += drive.inertia
    coasting = with_rates(motion, motion.drive_rate)
    bias = np.stack([_acceleration_power(unit, coasting) for unit in units])
    return EquationOfMotion(inertia, bias, _reduced_loads(motion, units))


def reduced_inertia(motion: Motion) -> tuple[Reals, Reals]:
    """Return the inertia reduced to a single drive, and half its derivative with respect to the drive coordinate.

    Each has the shape (..., positions). They are alpha and beta in the equation of motion `alpha eps + beta omega^2 =
    Q`, with the drive rate omega, the drive acceleration eps and the total effort Q.

    Raises
    ------
    MechanismError
        If the mechanism does not have exactly one drive.
    """
    if len(motion.mechanism.drives) != 1:
        raise MechanismError(f"{len(motion.mechanism.drives)} drives: a reduced inertia needs exactly one drive")
    (unit,) = motion.units
    return _inertia_power(unit, unit) + motion.mechanism.drives[0].inertia, _acceleration_power(unit, unit)


def _inertia_power(motion: Motion, other: Motion) -> Reals:
    """Return the mass-weighted scalar product of the velocities of two motions, summed over all links.

    If both motions are the same, this is twice the kinetic energy.
    """
    mass, first, second = mass_constants(motion.mechanism, len(motion.columns))
    arm = motion.direction * first
    omega, turned = 1j * motion.angular_velocity, 1j * other.angular_velocity
    return (
        mass.real * dot(motion.velocity, other.velocity)
        + dot(motion.velocity, turned * arm)
        + dot(other.velocity, omega * arm)
        + second * motion.angular_velocity * other.angular_velocity
    )[1:].sum(axis=0)


def _acceleration_power(unit: Motion, motion: Motion) -> Reals:
    """Return the sum of mass * acceleration * velocity over all links, including rotation.

    The accelerations are those of `motion`, and the velocities are those of `unit`.
    """
    mass, first, second = mass_constants(unit.mechanism, len(unit.columns))
    arm = unit.direction * first
    force = mass * motion.acceleration + motion.turning * arm
    moment = cross(arm, motion.acceleration) + second * motion.angular_acceleration
    return (dot(unit.velocity, force) + unit.angular_velocity * moment)[1:].sum(axis=0)


def _reduced_loads(motion: Motion, units: Sequence[Motion]) -> Reals:
    """Return the power of weight and loads if one drive moves at unit rate, shape (drives, ..., positions).

    `units` are the motions at unit rate of each drive.
    """
    mechanism = motion.mechanism
    mass, first, _ = mass_constants(mechanism, len(motion.columns))
    weight, tilt = mass * mechanism.gravity, cross(motion.direction * first, mechanism.gravity)
    power = np.stack([(dot(u.velocity, weight) + u.angular_velocity * tilt)[1:].sum(axis=0) for u in units])
    for at, pull, couple in given_loads(motion):
        power += [dot(unit.velocity[at], pull) + unit.angular_velocity[at] * couple for unit in units]
    return power
