"""Positions of the five dyads in closed form.

Each function finds where two links meet from what carries them and returns what places the links, and the sine s at
which they meet: zero at a singular position, nan where they cannot meet. `side` is the branch, +1 or -1; s^2 that is
below zero by no more than `slack` counts as zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.plane import ROUND_OFF, cross, dot


def _root(square: Any, slack: Columns) -> Columns:
    """Square root; 0 just below zero, nan further below."""
    if not np.asarray(square).min() >= 0.0:
        square = np.where((square < 0.0) & (square > -slack), 0.0, square)
    return np.sqrt(square)


def circle_circle(
    first: Columns, second: Numbers, arm_first: Columns, arm_second: Columns, side: Columns, slack: Columns = ROUND_OFF
) -> tuple[Complexes, Complexes, Reals]:
    """RRR: directions of two links with outer pins at `first` and `second` that share a pin.

    Parameters
    ----------
    first, second
        Outer pins [m], complex, shape (..., positions).
    arm_first, arm_second
        From either link's outer pin to the inner one, in the link's own axes [m], complex.
    side
        +1 where the inner pin is left of the way from `first` to `second`.

    Returns
    -------
    Unit vectors of both links' axes, and s = sine of the angle between the arms.
    """
    base = second - first
    square = base.real**2 + base.imag**2
    long, short = abs(arm_first), abs(arm_second)
    inverse = 1.0 / square
    x = 0.5 + (0.5 * (long - short) * (long + short)) * inverse
    y = (0.5 * side) * _root(((long + short) ** 2 * inverse - 1.0) * (1.0 - (long - short) ** 2 * inverse), slack)
    apex = np.empty(np.shape(y), complex)
    apex.real, apex.imag = x, y
    direction = base * apex * (1.0 / arm_first)
    apex -= 1.0
    return direction, base * apex * (1.0 / arm_second), square * y * (1.0 / (long * short))


def circle_line(
    center: Columns, arm: Columns, point: Columns, along: Columns, side: Columns, slack: Columns = ROUND_OFF
) -> tuple[Columns, Columns, Columns]:
    """RRP: a link pinned at `center` and at a point that is carried along a line.

    Parameters
    ----------
    center
        Outer pin [m], complex.
    arm
        From the outer pin to the inner one in the link's own axes [m], complex.
    point, along
        Where the inner pin is at slide 0 [m], and the unit vector of the slide, complex.
    side
        +1 where the inner pin is ahead of the foot of `center` on the line.

    Returns
    -------
    Unit vector of the link's axes, the slide [m], and s = sine of the angle between the arm and the line's normal.
    """
    length = abs(arm)
    behind = point - center
    offset = cross(along, behind) / length
    s = side * _root((1.0 - offset) * (1.0 + offset), slack)
    turned = np.empty(np.shape(s), complex)
    turned.real, turned.imag = s, offset
    return along * turned * (length / arm), length * s - dot(along, behind), s


def slotted(
    owner: Columns, block: Complexes, foot: Any, along: Any, side: Columns, slack: Any = ROUND_OFF
) -> tuple[Complexes, Reals, Reals]:
    """RPR: two links pinned at `owner` and `block`, one sliding on the other.

    Parameters
    ----------
    owner, block
        Outer pins of the line's owner and of the link that slides [m], complex.
    foot
        From the owner's pin to the block's pin at slide 0, in the owner's axes [m], complex.
    along
        Unit vector of the line in the owner's axes.
    side
        +1 where the block's pin is ahead of the owner's along the line.

    Returns
    -------
    Unit vector of the owner's axes, the slide [m], and s = (distance of the pins along the line)/(distance).
    """
    base = block - owner
    distance = abs(base)
    offset = cross(along, foot) / distance
    s = side * _root((1.0 - offset) * (1.0 + offset), slack)
    seen = np.empty(np.shape(s), complex)
    seen.real, seen.imag = s, offset
    return base / (distance * along * seen), distance * s - dot(along, foot), s


def line_line(gap: Complexes, along: Columns, other: Columns) -> tuple[Reals, Reals, Columns]:
    """PRP, RPP: slides x and y with `x along - y other = gap`, and s = sine of the angle between the lines."""
    s = cross(other, along)
    return cross(other, gap) / s, cross(along, gap) / s, s
