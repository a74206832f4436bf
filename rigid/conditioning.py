"""How much a position multiplies round-off, and the marking of those where nothing else is left.

Derivation: docs/theory.md, "Accuracy".
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rigid.closure import Closure, Columns
from rigid.plane import imaginary, is_zero, minus, plus, times

if TYPE_CHECKING:
    from rigid.motion import Motion

SINGULAR = 1e12  # condition beyond which a position is marked and its velocities and forces are nan
REGULAR = 1e-2  # sine at which a group of pins may still come to that
TINY = np.finfo(float).tiny


def condition(course: Motion, closed: Closure) -> Columns:
    """By how much a moving group multiplies round-off: errors are of this many eps, shape (..., positions).

    1/s^2 where the links come to a stop. Where they pass smoothly what is singular: how much faster they would turn if
    the opening of their gaps were not nearly the one that needs no turning; squared, and the same of accelerations.
    """
    stopped = 1.0 / np.square(closed.sine)
    links = sorted({link for place in closed.joints for link in (place.joint.parent, place.joint.child) if link})
    spin, turning = (np.abs(values[links]).max(axis=0) for values in (course.angular_velocity, course.turning))
    pins = [k for k, number in enumerate(closed.group.free) if closed.tree[number].along is None]
    if not pins:  # no angle comes from lengths
        return stopped
    speed, growth = 0.0, 0.0
    for c, closing in enumerate(closed.cut):
        (moved, spun), (hurried, spurred) = _opening(course, closed, c)
        duals, twist = closed.duals[pins, c], 0.0
        if closing.along is not None:
            duals, twist = duals.real, np.abs(duals.imag).max(axis=0)
        lever = np.abs(duals).max(axis=0)
        speed = plus(speed, plus(times(lever, moved), times(twist, spun)))
        growth = plus(growth, plus(times(lever, hurried), times(twist, spurred)))
    passed = np.square(speed / np.maximum(spin, TINY)) * (growth / np.maximum(turning, TINY))
    return np.maximum(stopped, passed)


def _opening(course: Motion, closed: Closure, c: int) -> tuple[tuple[Columns, Columns], ...]:
    """Size of the velocity and of the acceleration at which a cut joint would open were the links but carried.

    Each as displacement [m] and rotation [rad], per second and per second squared. What hangs on a pin is not turned.
    """
    carrier = dict(zip(closed.group.links, closed.tree, strict=True))
    closing = closed.cut[c]
    joint, turns = closing.joint, closing.along is not None
    ends: list[tuple[Columns, ...]] = []
    for link, point in ((joint.child, closing.arm_child), (joint.parent, closing.arm_parent)):
        root, arm = link, point
        while root in carrier:
            hinge = carrier[root]
            arm = hinge.arm_parent if hinge.along is None else arm - hinge.arm_child + hinge.arm_parent
            root = hinge.joint.parent
        if not root:
            ends.append((0.0, 0.0, 0.0, 0.0))
            continue
        spin, turning = course.angular_velocity[root], course.turning[root]
        moved, hurried = course.velocity[root] + imaginary(spin) * arm, course.acceleration[root] + turning * arm
        ends.append((moved, spin, hurried, turning.imag) if turns else (moved, 0.0, hurried, 0.0))
    opened = [minus(one, other) for one, other in zip(*ends, strict=True)]
    moved, spin, hurried, eps = (0.0 if is_zero(value) else np.abs(value) for value in opened)
    return (moved, spin), (hurried, eps)


def without_singular(course: Motion) -> tuple[Closure, ...]:
    """The groups of a motion, without their figures where the condition is beyond SINGULAR; as they are where none."""
    if not any(_suspect(closed) for closed in course.closures):
        return course.closures
    return tuple(_marked(course, closed) if _suspect(closed) else closed for closed in course.closures)


def _suspect(closed: Closure) -> bool:
    """Whether a group may be singular: at a small angle, or where the pins of links that slide on each other meet."""
    if not closed.group.free:
        return False
    return not np.abs(closed.sine).min() >= REGULAR or any(joint.slider is not None for joint in closed.group.cut)


def _marked(course: Motion, closed: Closure) -> Closure:
    with np.errstate(all="ignore"):
        singular = ~(condition(course, closed) <= SINGULAR)
    return replace(closed, duals=np.where(singular, np.nan, closed.duals)) if singular.any() else closed
