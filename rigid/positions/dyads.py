"""Positions of the five kinds of dyads in closed form.

Each function returns the position of both links and the sine s of the angle between them. s is zero at a singular
position, and nan if the links cannot meet. `side` selects the branch, +1 or -1. Values of s^2 from -`slack` to 0 count
as zero.
"""

from typing import Any

import numpy as np

from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.plane import ROUND_OFF, cross, dot


def _root(square: Any, slack: Columns) -> Columns:
    """Return the square root: 0 for negative values above -`slack`, and nan below."""
    if not np.asarray(square).min() >= 0.0:
        square = np.where((square < 0.0) & (square > -slack), 0.0, square)
    return np.sqrt(square)


def circle_circle(
    first: Columns, second: Numbers, arm_first: Columns, arm_second: Columns, side: Columns, slack: Columns = ROUND_OFF
) -> tuple[Complexes, Complexes, Reals]:
    """Solve an RRR dyad: two links with outer pins at `first` and `second`, and a common inner pin.

    Parameters
    ----------
    first, second
        Outer pins (complex) [m], shape (..., positions).
    arm_first, arm_second
        Vectors from each outer pin to the inner pin in link axes (complex) [m].
    side
        +1 if the inner pin is to the left of the line from `first` to `second`.

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
    """Solve an RRP dyad: a link with an outer pin at `center` and an inner pin that slides on a line.

    Parameters
    ----------
    center
        Outer pin (complex) [m].
    arm
        Vector from the outer pin to the inner pin in link axes (complex) [m].
    point, along
        Inner pin at slide 0 [m], and unit vector of the line (complex).
    side
        +1 if the inner pin is ahead of the foot of `center` on the line.

    Returns
    -------
    Unit vector of the link's axes, slide [m], and s = sine of the angle between the arm and the normal to the line.
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
    """Solve an RPR dyad: a link with outer pin `owner`, on which a link with outer pin `block` slides.

    Parameters
    ----------
    owner, block
        Outer pins of the owner of the line and of the sliding link (complex) [m].
    foot
        Vector from the owner's pin to the block's pin at slide 0, in owner axes (complex) [m].
    along
        Unit vector of the line in owner axes.
    side
        +1 if the block's pin is ahead of the owner's pin along the line.

    Returns
    -------
    Unit vector of the owner's axes, slide [m], and s = distance of the pins along the line / distance of the pins.
    """
    base = block - owner
    distance = abs(base)
    offset = cross(along, foot) / distance
    s = side * _root((1.0 - offset) * (1.0 + offset), slack)
    seen = np.empty(np.shape(s), complex)
    seen.real, seen.imag = s, offset
    return base / (distance * along * seen), distance * s - dot(along, foot), s


def line_line(gap: Complexes, along: Columns, other: Columns) -> tuple[Reals, Reals, Columns]:
    """Solve a PRP or RPP dyad: return slides x and y with `x along - y other = gap`, and the sine between the lines."""
    s = cross(other, along)
    return cross(other, gap) / s, cross(along, gap) / s, s
