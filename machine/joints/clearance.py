"""Clearance of joints: loss of contact, and displacement of a point or an angle of the mechanism."""

from collections.abc import Mapping

import numpy as np

from machine.joints.courses import JointCourse
from rigid import Motion
from rigid.arrays import Complexes, Flags, Integers, Reals
from rigid.closures import displacements
from rigid.plane import ZERO

MIN_FORCE = 0.01  # contact is lost below this force, relative to the largest
DIRECTIONS = 180  # number of directions searched for the worst displacement of a point


def contact_losses(course: JointCourse, closed: bool) -> Flags:
    """Flag the loss of contact between each position and the next, bool, shape (..., positions).

    Contact is lost if the force, linear between positions, falls below `MIN_FORCE` of its maximum, or if its direction
    turns by more than a right angle. The pin then moves to the other side of its hole and knocks. The direction is in
    ground axes, so a link that rotates under a constant force keeps its contact.
    """
    now = course.force
    after = np.roll(now, -1, axis=-1)
    step = after - now
    share = np.divide(-np.real(np.conj(step) * now), np.abs(step) ** 2, out=np.zeros(now.shape), where=np.abs(step) > 0)
    nearest = np.abs(now + np.clip(share, 0.0, 1.0) * step)
    greatest = course.size.max(axis=-1, keepdims=True)
    lost = (nearest < MIN_FORCE * greatest) | (np.real(np.conj(now) * after) < 0.0)
    if not closed:
        lost[..., -1] = False
    return np.asarray(lost & np.isfinite(now) & np.isfinite(after))


def knocks(lost: Flags, closed: bool) -> Integers:
    """Number of contact losses, shape (...); adjacent flags count once."""
    before = np.roll(lost, 1, axis=-1)
    if not closed:
        before[..., 0] = False
    return np.asarray((lost & ~before).sum(axis=-1))


def clearance_effects(
    motion: Motion, clearances: Mapping[int, Reals], forces: Mapping[int, Complexes], link: int, point: complex | None
) -> tuple[Reals, Reals]:
    """Return displacements of a point [m] or angle [rad] due to joint clearance, shape (..., positions) each.

    The result is of first order in the clearances and holds for rigid links: each pin displaces the output by its
    influence. Range: clearances and displacements that are small relative to the links, away from dead points.

    Parameters
    ----------
    clearances
        Hole diameter minus pin diameter by joint number [m]; the pin moves by half of it.
    forces
        Force on the child of each of these joints in ground axes [N].
    link, point
        Link of the output, and the point in its axes; None for its angle.

    Returns
    -------
    The worst displacement, which is the sum of the influences' magnitudes; and the displacement with every pin pressed
    by its force.
    """
    rows, pressed = [], np.zeros(motion.columns, complex)
    for number, clearance in clearances.items():
        across, up = (_influence(motion, number, gap, link, point) for gap in (1.0, 1j))
        half = np.asarray(clearance) / 2.0
        rows.append((half * across, half * up))
        force = forces[number]
        with np.errstate(invalid="ignore", divide="ignore"):
            way = np.where(np.abs(force) > 0.0, force / np.abs(force), 0.0)
        pressed = pressed - half * (np.real(way) * across + np.imag(way) * up)  # the force displaces the child
    worst = np.zeros(motion.columns)
    for toward in np.exp(1j * np.pi * np.arange(DIRECTIONS if point is not None else 1) / DIRECTIONS):
        parts = (np.hypot(np.real(np.conj(toward) * x), np.real(np.conj(toward) * y)) for x, y in rows)
        worst = np.maximum(worst, sum(parts, start=np.zeros(motion.columns)))
    return worst, np.abs(pressed)


def _influence(motion: Motion, number: int, gap: complex, link: int, point: complex | None) -> Complexes:
    """Return the displacement of an output due to a joint gap given in ground axes."""
    none = [ZERO] * len(motion.places)
    gaps = [*none[:number], np.asarray(gap), *none[number + 1 :]]
    shift, turning, _ = displacements(motion.closures, gaps, none, [ZERO] * len(motion.mechanism.links))
    moved = turning[link].imag if point is None else shift[link] + turning[link] * motion.direction[link] * point
    return np.broadcast_to(np.asarray(moved, complex), motion.columns)
