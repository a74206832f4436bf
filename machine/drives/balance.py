"""Counterweights and springs that balance a machine, computed by linear least squares over a cycle.

A counterweight on a link that is pinned to the ground changes the first moment of mass of this link. The shaking force
and the effort due to gravity are linear in the first moment. The effort due to a torsion spring at the pin is linear in
the stiffness and in the preload moment. Derivation: docs/machine.md.
"""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from machine.drives.motors import root_mean_square
from rigid import Motion, structure
from rigid.arrays import Numbers, Reals
from rigid.constants import mass_constants
from rigid.plane import cross, dot

ROUND_OFF = 1e-10  # singular values below ROUND_OFF * (largest singular value) count as zero


class Balance(Struct, frozen=True, eq=False):
    """Counterweights or springs that minimize the mean square of a quantity.

    Attributes
    ----------
    amounts
        Amount of each counterweight or spring, shape (influences,): the least-squares solution with the smallest norm.
        The unit of an amount is (unit of the balanced quantity) / (unit of the influence).
    before, after
        The quantity before and after balancing (real or complex), shape (..., positions).
    """

    amounts: Numbers
    before: Numbers
    after: Numbers

    @property
    def share(self) -> float:
        """(Root mean square after balancing) / (root mean square before balancing); 0 if the quantity is zero."""
        before = float(np.sqrt(np.mean(root_mean_square(self.before) ** 2)))
        return float(np.sqrt(np.mean(root_mean_square(self.after) ** 2))) / before if before else 0.0


def balanced(quantity: Numbers, influences: Sequence[Numbers], weight: Reals | float = 1.0) -> Balance:
    """Return the amounts of counterweights or springs that minimize the mean square of a quantity.

    Parameters
    ----------
    quantity, influences
        Real or complex arrays of shape (..., positions). An influence is the change of the quantity due to a
        counterweight or spring of amount 1. The balanced quantity is `quantity` + sum of (amount * influence). The
        amounts are real numbers.
    weight
        Weight of each position in the mean, shape (positions,).
    """
    root = np.sqrt(np.broadcast_to(weight, np.shape(quantity)))

    def column(values: Numbers) -> Reals:
        scaled = np.ravel(root * values)
        return np.concatenate([scaled.real, scaled.imag])

    matrix = np.array([column(each) for each in influences]).T.reshape(-1, len(influences))
    amounts = np.linalg.lstsq(matrix, -column(quantity), rcond=ROUND_OFF)[0]
    after = quantity + sum((amount * each for amount, each in zip(amounts, influences, strict=True)), start=0.0)
    return Balance(amounts, np.asarray(quantity), np.asarray(after))


def pivoted_links(motion: Motion) -> dict[int, str]:
    """Return the name of the pin between each pivoted link and the ground, by link index."""
    joints = structure(motion.mechanism).joints
    return {joint.child: joint.name for joint in joints if joint.parent == 0 and joint.turns and joint.freedoms}


def inertia_force(motion: Motion) -> Numbers:
    """Return the shaking force: the inertia force of all links on the ground (complex) [N], shape (..., positions)."""
    mass, first, _ = mass_constants(motion.mechanism, len(motion.columns))
    return -(mass * motion.acceleration + motion.turning * motion.direction * first)[1:].sum(axis=0)


def inertia_moment(motion: Motion) -> Reals:
    """Return the shaking moment: the inertia moment of all links on the ground, about the origin [N m]."""
    mass, first, second = mass_constants(motion.mechanism, len(motion.columns))
    arm = motion.direction * first
    force = mass * motion.acceleration + motion.turning * arm
    couple = cross(motion.origin, force) + cross(arm, motion.acceleration) + second * motion.angular_acceleration
    return -couple[1:].sum(axis=0)


def shaking_influences(motion: Motion, link: int) -> tuple[Numbers, Numbers]:
    """Return the shaking forces due to a unit first moment of a link along x', and along y' (complex) [N/(kg m)]."""
    along = -motion.turning[link] * motion.direction[link]
    return along, 1j * along


def weight_effort(motion: Motion) -> Reals:
    """Return the drive efforts that hold the mechanism at rest under gravity [N m or N], (drives, ..., positions)."""
    mass, first, _ = mass_constants(motion.mechanism, len(motion.columns))
    weight = mass * motion.mechanism.gravity
    tilt = cross(motion.direction * first, motion.mechanism.gravity + 0j)
    units = motion.units
    return -np.array([(dot(unit.velocity, weight) + unit.angular_velocity * tilt)[1:].sum(axis=0) for unit in units])


def weight_influences(motion: Motion, link: int) -> tuple[Reals, Reals]:
    """Return the drive efforts per kg m of a link's first moment along x', and along y', (drives, ..., positions)."""
    arm, gravity, units = motion.direction[link], motion.mechanism.gravity + 0j, motion.units
    along, across = (
        -np.array([unit.angular_velocity[link] * cross(part * arm, gravity) for unit in units]) for part in (1.0, 1j)
    )
    return along, across


def spring_influences(motion: Motion, link: int) -> tuple[Reals, Reals]:
    """Return the drive efforts due to a torsion spring between a link and the ground, (drives, ..., positions) each.

    The first array is for a stiffness of 1 N m/rad, with the spring relaxed at the first position. The second array is
    for a constant preload, which is a clockwise moment of 1 N m on the link.
    """
    angle = np.unwrap(np.angle(motion.direction[link]), axis=-1)
    turned = np.array([unit.angular_velocity[link] for unit in motion.units])
    return turned * (angle - angle[..., :1]), turned
