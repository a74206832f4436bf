"""Joint friction: forces and moments (efforts) that oppose the motion and depend on the joint forces.

The joint forces are linear functions of the friction efforts. The efforts are the only unknowns, and are computed at
all positions at once. Derivation: docs/theory.md, "Friction".
"""

from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.arrays import Columns, Flags, Reals
from rigid.closures.conditioning import extents
from rigid.closures.forces import JointForces
from rigid.decomposition.order import structure
from rigid.joints import JointPlace
from rigid.kinematics import Motion
from rigid.mechanism import Mechanism
from rigid.parts import Friction

# a joint is at rest if its rate is at most this, relative to the mechanism's speed or angular velocity
REST_RATE = 1e-9
CREEP_SHARE = 1e-3  # creep rate / largest rate of the joint
MAX_STEPS = 40  # maximum number of Newton steps
TOLERANCE = 1e-15  # the iteration stops when the relative residual of the efforts is below this
MAX_RESIDUAL = 1e-12  # a solution is valid if its relative residual is at most this
MAX_FLANK_ROUNDS = 4
"""Maximum number of iterations for the loaded flanks of gear teeth."""

Balance = Callable[[Mapping[int, Columns] | None, Mapping[int, Columns] | None], JointForces]
"""Function from friction efforts and gear flanks (both optional) to joint forces in equilibrium."""


def friction_joints(mechanism: Mechanism) -> tuple[tuple[int, Friction], ...]:
    """Return the index and the friction of each joint with friction, in the order of `Structure.joints`."""
    return _joints_with_friction(mechanism) if mechanism.friction else ()


@lru_cache(maxsize=64)
def _joints_with_friction(mechanism: Mechanism) -> tuple[tuple[int, Friction], ...]:
    known = mechanism.friction
    joints = enumerate(structure(mechanism).joints)
    return tuple((number, known[joint.name]) for number, joint in joints if joint.name in known)


def forces_with_friction(
    motion: Motion, balance: Balance, vibrating: Mapping[int, tuple[Columns, Columns]] | None = None
) -> JointForces:
    """Return the joint forces including friction, which is itself caused by the joint forces.

    Parameters
    ----------
    balance
        Function that returns the joint forces for given friction efforts and gear flanks. For given gear flanks, it
        must be a linear function of the efforts.
    vibrating
        By joint index, the rate that vibrating links add to the rate of the joint, and the creep rate [rad/s or m/s].
        If the rate of a joint is small compared with its creep rate, Coulomb friction is reduced, so that it changes
        its sign gradually.

    Returns
    -------
    Joint forces, which are nan at positions at which friction may lock the mechanism.
    """
    rubbing = friction_joints(motion.mechanism)
    forces = balance(None, None)
    if not rubbing:
        return forces
    sliding = {number: sliding_rate(motion, number) for number, _ in rubbing}
    if vibrating:
        sliding = {number: rate + np.real(vibrating[number][0]) for number, rate in sliding.items()}
        directions = {number: rate / np.hypot(rate, vibrating[number][1]) for number, rate in sliding.items()}
    else:
        directions = sliding_directions(motion, sliding)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for _ in range(MAX_FLANK_ROUNDS):
            efforts, feedback = _efforts(motion, balance, forces, sliding, directions)
            rubbed = balance(efforts, None)
            turned = [rubbed.flank[number] != flank for number, flank in forces.flank.items()]
            if not np.any(turned):
                break
            forces = balance(None, rubbed.flank)
        for differs in turned:  # with neither flank are the joint forces consistent with the friction that they cause
            feedback = np.where(differs, np.maximum(feedback, 1.0), feedback)
    rubbed = replace(rubbed, feedback=feedback, sliding=sliding)
    if np.any(rubbed.locked):
        rubbed.mark(rubbed.locked)
    return rubbed


def sliding_directions(motion: Motion, sliding: Mapping[int, Columns]) -> dict[int, Reals]:
    """Return by joint index the sign of the joint's rate (child relative to parent), shape (..., positions).

    The sign is 0.0 if the joint is at rest, i.e. if its rate is at most `REST_RATE` times the speed of the mechanism
    (for a pin, times its angular velocity), see `speeds`.
    """
    fastest, spin = speeds(motion)
    return {
        number: direction_of(np.asarray(rate), spin if motion.places[number].turns else fastest)
        for number, rate in sliding.items()
    }


def direction_of(rate: Reals, scale: Reals) -> Reals:
    """Return the sign of a rate, or 0.0 if the rate is at most `REST_RATE` times `scale`."""
    return np.where(np.abs(rate) > REST_RATE * scale, np.sign(rate), 0.0)


def creep_rate(motion: Motion, number: int) -> float:
    """Return the creep rate of a joint: `CREEP_SHARE` times its largest rate [rad/s or m/s].

    If the joint does not move, the speed of the mechanism (for a pin, its angular velocity) is used instead of the
    rate.
    """
    fastest, spin = speeds(motion)
    scale = float(np.max(spin if motion.places[number].turns else fastest))
    greatest = float(np.abs(sliding_rate(motion, number)).max())
    return CREEP_SHARE * (greatest if greatest > REST_RATE * scale else scale or 1.0)


def friction_per_rate(motion: Motion, forces: JointForces, creep: Mapping[int, Columns]) -> dict[int, Reals]:
    """Return by joint index the ratio (Coulomb effort / rate of the joint) [N m s or N s/m], shape (..., positions).

    `creep` contains the creep rates (see `forces_with_friction`).
    """
    per_rate = {}
    for number, friction in friction_joints(motion.mechanism):
        place = motion.places[number]
        press = _pressing(place, friction, *forces.without_friction(number), motion.columns)
        size = friction.radius * np.hypot(*press) if place.turns else np.abs(press).max(axis=0)
        per_rate[number] = friction.coefficient * size / np.hypot(forces.sliding[number], creep[number])
    return per_rate


def sliding_rate(motion: Motion, number: int) -> Reals:
    """Return the rate of a joint (child relative to parent) [rad/s or m/s], shape (..., positions)."""
    return np.broadcast_to(motion.places[number].rate(motion.velocity, motion.angular_velocity), motion.columns)


def speeds(motion: Motion) -> tuple[Reals, Reals]:
    """Return the speed of the fastest point [m/s] and the largest angular velocity [rad/s], (..., positions) each.

    If (speed of the fastest point / size of the largest link) is larger than this angular velocity, it is used instead.
    """
    sizes, omega = extents(motion.mechanism), np.abs(motion.angular_velocity)
    fastest = np.max([np.abs(motion.velocity[at]) + omega[at] * size for at, size in enumerate(sizes)], axis=0)
    spin, largest = omega.max(axis=0), np.max(np.broadcast_arrays(*sizes), axis=0)
    return fastest, np.maximum(spin, fastest / np.where(largest > 0, largest, np.inf))


def friction_power(motion: Motion, forces: JointForces) -> Reals:
    """Return the power that joint friction dissipates [W], shape (..., positions)."""
    parts = (-effort * forces.sliding[number] for number, effort in forces.friction.items())
    return np.zeros(motion.columns) + sum(parts, start=0.0)


class _Contacts(Struct, frozen=True, eq=False):
    """Contact forces at the joints with friction, as linear functions of the friction efforts.

    Attributes
    ----------
    strength
        Coulomb effort per unit of contact force, with the sign of the motion, shape (joints, ..., positions).
    given
        Viscous efforts, same shape.
    pins
        Whether each joint is a pin, shape (joints,).
    base, influence
        Two components of the contact force of each joint without friction, shape (joints, 2, ..., positions), and their
        change per unit of each effort, shape (joints, joints, 2, ..., positions). For a pin, the components are those
        of the force in x and y. For a slider, they are the normal force N and 2 M / length.
    """

    strength: Reals
    given: Reals
    pins: list[bool]
    base: Reals
    influence: Reals

    def pressing(self, efforts: Reals) -> Reals:
        """Return the components of the contact forces for given efforts, shape (joints, ..., positions)."""
        return self.base + np.einsum("ijk...,j...->ik...", self.influence, efforts)

    def size(self, pressing: Reals) -> Reals:
        """Return the magnitudes of the contact forces. `pressing` has the components on its second axis."""
        return np.array([np.hypot(*each) if pin else np.abs(each).max(axis=0)
                         for pin, each in zip(self.pins, pressing, strict=True)])  # fmt: skip

    def slopes(self, pressing: Reals) -> Reals:
        """Return the derivatives of `size` with respect to the components; 0 for a pin without force."""
        slopes = np.zeros_like(pressing)
        for pin, each, slope in zip(self.pins, pressing, slopes, strict=True):
            if pin:
                length = np.hypot(*each)
                slope[...] = each / np.where(length > 0, length, 1.0)
            else:
                first = np.abs(each[0]) >= np.abs(each[1])
                slope[...] = np.where([first, ~first], np.sign(each), 0.0)
        return slopes

    def caused(self, efforts: Reals) -> Reals:
        """Return the friction efforts due to the contact forces that result from given efforts."""
        return self.given - self.strength * self.size(self.pressing(efforts))

    @property
    def feedback(self) -> Reals:
        """Loop gain of friction (see `JointForces.feedback`), shape (..., positions).

        It is the spectral radius of a matrix of influences. If it is below 1, the solution is unique.
        """
        sizes = np.array([self.size(row) for row in np.swapaxes(self.influence, 0, 1)])
        rows = np.moveaxis(np.abs(self.strength) * sizes, (1, 0), (-2, -1))  # [i, j]: effort i due to effort j
        good = np.isfinite(rows).all(axis=(-2, -1))
        radius = np.zeros(good.shape)
        radius[good] = np.abs(np.linalg.eigvals(rows[good])).max(axis=-1)
        return radius


def _efforts(
    motion: Motion,
    balance: Balance,
    forces: JointForces,
    sliding: Mapping[int, Columns],
    directions: Mapping[int, Reals],
) -> tuple[dict[int, Reals], Reals]:
    """Return the friction efforts by joint index, and the loop gain, with the gear flanks that `forces` contains."""
    contacts = _contacts(motion, balance, forces, sliding, directions)
    feedback = contacts.feedback
    efforts, off = _solved_efforts(contacts, feedback < 1.0)
    feedback = np.where(off > MAX_RESIDUAL, np.maximum(feedback, 1.0), feedback)
    return dict(zip(directions, efforts, strict=True)), feedback


def _contacts(
    motion: Motion,
    balance: Balance,
    forces: JointForces,
    sliding: Mapping[int, Columns],
    directions: Mapping[int, Reals],
) -> _Contacts:
    rubbing, columns = friction_joints(motion.mechanism), motion.columns
    places = [motion.places[number] for number, _ in rubbing]
    pins = [place.turns for place in places]
    strength = np.array([
        np.broadcast_to(friction.coefficient * (friction.radius if pin else 1.0) * directions[number], columns)
        for (number, friction), pin in zip(rubbing, pins, strict=True)
    ])  # fmt: skip
    given = np.array([np.broadcast_to(-friction.viscosity * sliding[number], columns)
                      for number, friction in rubbing])  # fmt: skip

    def pressing(joint_forces: JointForces) -> Reals:
        return np.array([_pressing(place, friction, *joint_forces.without_friction(number), columns)
                         for place, (number, friction) in zip(places, rubbing, strict=True)])  # fmt: skip

    base = pressing(forces)
    first = _Contacts(strength, given, pins, base, np.zeros((len(rubbing), *base.shape)))
    influence = np.empty((len(rubbing), *base.shape))
    for k, ((number, _), effort) in enumerate(zip(rubbing, first.caused(0.0 * given), strict=True)):
        unit = float(np.abs(effort[np.isfinite(effort)]).max(initial=0.0)) or 1.0  # expected magnitude
        influence[:, k] = (pressing(balance({number: unit}, forces.flank)) - base) / unit
    return replace(first, influence=influence)


def _pressing(
    place: JointPlace, friction: Friction, force: Columns, moment: Columns, columns: tuple[int, ...]
) -> Reals:
    """Return the two components of the contact force of a joint, shape (2, ..., positions), see `_Contacts`."""
    parts = place.pressing(force, moment, friction.length)
    return np.array([np.broadcast_to(part, columns) for part in parts])


def _solved_efforts(contacts: _Contacts, solvable: Flags) -> tuple[Reals, Reals]:
    """Return efforts that equal the friction they cause, shape (joints, ..., positions), and the relative residual.

    If a Newton step does not reduce the residual, it is replaced by a fixed-point step. Fixed-point steps converge if
    the loop gain is below 1. `solvable` is True at positions with such a gain.
    """
    efforts = contacts.caused(np.zeros_like(contacts.given))
    size = _residual_reference(contacts, efforts)
    caused = contacts.caused(efforts)
    off = np.max(np.abs(caused - efforts) / size, axis=0)
    for _ in range(MAX_STEPS):
        if not np.any(solvable & (off > TOLERANCE)):
            break
        newton = efforts + _newton_step(contacts, efforts, caused - efforts)
        next_caused = contacts.caused(newton)
        better = np.max(np.abs(next_caused - newton) / size, axis=0) < off
        efforts = np.where(better, newton, caused)
        caused = np.where(better, next_caused, contacts.caused(caused))
        off = np.max(np.abs(caused - efforts) / size, axis=0)
    return efforts, off


def _residual_reference(contacts: _Contacts, efforts: Reals) -> Reals:
    """Return the reference for the residual of each effort: the sum of the magnitudes of its terms."""
    influences = np.einsum("ijk...,j...->ik...", np.abs(contacts.influence), np.abs(efforts))
    parts = contacts.size(np.abs(contacts.base) + influences)
    return np.abs(contacts.given) + np.abs(contacts.strength) * parts + np.finfo(float).tiny


def _newton_step(contacts: _Contacts, efforts: Reals, off: Reals) -> Reals:
    slopes = contacts.slopes(contacts.pressing(efforts))
    matrix = np.einsum("i...,ik...,ijk...->...ij", contacts.strength, slopes, contacts.influence)
    matrix += np.eye(len(efforts))
    right = np.moveaxis(off, 0, -1)
    good = np.isfinite(matrix).all(axis=(-2, -1)) & np.isfinite(right).all(axis=-1)
    good[good] = np.linalg.slogdet(matrix[good])[0] != 0
    step = np.full_like(right, np.nan)
    step[good] = np.linalg.solve(matrix[good], right[good][..., None])[..., 0]
    return np.moveaxis(step, -1, 0)
