"""Positions, velocities and accelerations of points of moving links."""

from rigid.arrays import Complex, Complexes
from rigid.kinematics import Motion


def _at(motion: Motion, link: str | int, point: str | Complex) -> tuple[int, Complexes]:
    """Link number, and the arm from its origin to a point, in ground axes."""
    at = motion.mechanism.index[link] if isinstance(link, str) else link
    local = motion.mechanism.links[at].points[point] if isinstance(point, str) else point
    return at, motion.direction[at] * local


def position_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Position of a link's point, by name or in link axes [m], complex, (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.origin[at] + arm


def velocity_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Velocity of a link's point [m/s], complex, shape (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.velocity[at] + 1j * motion.angular_velocity[at] * arm


def acceleration_of(motion: Motion, link: str | int, point: str | Complex) -> Complexes:
    """Acceleration of a link's point [m/s^2], complex, shape (..., positions)."""
    at, arm = _at(motion, link, point)
    return motion.acceleration[at] + motion.turning[at] * arm
