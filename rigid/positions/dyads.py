"""Positions of the five kinds of dyads in closed form.

In the names of dyads, R is a pin and P is a slider. For example, the joints of an RRP dyad are an outer pin, an inner
pin and an outer slider. Each function returns the unknown directions and slides (slider coordinates) of the links, and
a sine s. The docstring of the function defines s, which is zero at a singular position, and nan if the links cannot
meet. `side` (+1 or -1) selects the branch. If round-off makes s^2 negative, but not below -`slack`, it counts as zero.
"""

from typing import Any

import numpy as np

from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.plane import ROUND_OFF, cross, dot


def _slack_root(square: Any, slack: Columns) -> Columns:
    """Return the square root: 0 for values between -`slack` and 0, and nan for lower values."""
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
        Positions of the outer pins (complex) [m], shape (..., positions).
    arm_first, arm_second
        Vectors from each outer pin to the inner pin in link axes (complex) [m].
    side
        +1 if the inner pin is to the left of the line from `first` to `second`, else -1.

    Returns
    -------
    Unit vectors of the axes of both links, and s = sine of the angle between the arms.
    """
    base = second - first
    square = base.real**2 + base.imag**2
    long, short = abs(arm_first), abs(arm_second)
    inverse = 1.0 / square
    x = 0.5 + (0.5 * (long - short) * (long + short)) * inverse
    y = (0.5 * side) * _slack_root(((long + short) ** 2 * inverse - 1.0) * (1.0 - (long - short) ** 2 * inverse), slack)
    apex = np.empty(np.shape(y), complex)
    apex.real, apex.imag = x, y
    direction = base * apex * (1.0 / arm_first)
    apex -= 1.0
    return direction, base * apex * (1.0 / arm_second), square * y * (1.0 / (long * short))


def circle_line(
    center: Columns, arm: Columns, point: Columns, along: Columns, side: Columns, slack: Columns = ROUND_OFF
) -> tuple[Columns, Columns, Columns]:
    """Solve an RRP dyad: a link with an outer pin at `center`, and an inner pin that moves along a line.

    Parameters
    ----------
    center
        Position of the outer pin (complex) [m].
    arm
        Vector from the outer pin to the inner pin in link axes (complex) [m].
    point
        Position of the inner pin at slide 0 (complex) [m].
    along
        Unit vector of the line (complex).
    side
        +1 if the inner pin lies in the direction `along` from the foot of the perpendicular from `center` to the line,
        else -1.

    Returns
    -------
    Unit vector of the axes of the link, slide [m], and s = sine of the angle between the arm and the normal to the
    line.
    """
    length = abs(arm)
    behind = point - center
    offset = cross(along, behind) / length
    s = side * _slack_root((1.0 - offset) * (1.0 + offset), slack)
    turned = np.empty(np.shape(s), complex)
    turned.real, turned.imag = s, offset
    return along * turned * (length / arm), length * s - dot(along, behind), s


def slotted(
    owner: Columns, block: Complexes, foot: Any, along: Any, side: Columns, slack: Any = ROUND_OFF
) -> tuple[Complexes, Reals, Reals]:
    """Solve an RPR dyad: two links with outer pins, of which one (the block) slides along a line of the other (owner).

    Parameters
    ----------
    owner, block
        Positions of the outer pins of the owner and of the block (complex) [m].
    foot
        Vector from the pin of the owner to the pin of the block when the slide is 0, in owner axes (complex) [m].
    along
        Unit vector of the line in owner axes.
    side
        +1 if the vector from the pin of the owner to the pin of the block has a positive component along the line, else
        -1.

    Returns
    -------
    Unit vector of the axes of the owner, slide [m], and s. To obtain s, divide the distance between both pins along the
    line (positive if the pin of the block is ahead) by the distance between both pins.
    """
    base = block - owner
    distance = abs(base)
    offset = cross(along, foot) / distance
    s = side * _slack_root((1.0 - offset) * (1.0 + offset), slack)
    seen = np.empty(np.shape(s), complex)
    seen.real, seen.imag = s, offset
    return base / (distance * along * seen), distance * s - dot(along, foot), s


def line_line(gap: Complexes, along: Columns, other: Columns) -> tuple[Reals, Reals, Columns]:
    """Solve a PRP or RPP dyad: return slides x and y, and the sine s of the angle between the lines.

    The slides satisfy `x along - y other = gap`, where `along` and `other` are the unit vectors of the lines.
    """
    s = cross(other, along)
    return cross(other, gap) / s, cross(along, gap) / s, s
