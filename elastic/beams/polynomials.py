"""Zeros and greatest values of many polynomials at once on [0, 1], exact.

The zeros of a polynomial lie between its turning points, one at most between two neighbours; its turning points are the
zeros of its derivative. So all are found by walking up from the straight line.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from elastic.arrays import Coefficients
from rigid.arrays import Numbers, Reals

STEPS = 60  # of Newton's method at most: as many bisections leave nothing of a double's bracket
TOGETHER = 4  # steps that all zeros take, before those that are there are left out
CLOSE = 1e-8  # change of xi from which one more step of quadratic convergence is the last


def evaluate(values: Coefficients, xi: Reals | float) -> Reals:
    """Horner's scheme: polynomials of coefficients (n, ...) at xi of shape (..., ) or (m, ...)."""
    if len(values) == 1:
        constant: Reals = values[0] + np.zeros(np.shape(xi))
        return constant
    result: Reals = values[-1] * xi
    result += values[-2]
    for value in values[-3::-1]:
        result *= xi
        result += value
    return result


def derivative(values: Coefficients) -> Coefficients:
    """Coefficients of the derivatives of polynomials."""
    return values[1:] * np.arange(1.0, len(values)).reshape(-1, *[1] * (values.ndim - 1))


def multiplied(first: Coefficients, second: Coefficients) -> Coefficients:
    """Coefficients of products of polynomials, shapes (n, ...) and (m, ...)."""
    result = np.zeros((len(first) + len(second) - 1, *np.broadcast_shapes(first.shape[1:], second.shape[1:])))
    for k, value in enumerate(second):
        result[k : k + len(first)] += first * value
    return result


def added(one: Numbers, other: Numbers) -> Numbers:
    """Coefficients of sums of polynomials, of the same or another degree."""
    long, short = (one, other) if len(one) >= len(other) else (other, one)
    result: Numbers = long.copy()
    result[: len(short)] += short
    return result


def shifted(values: Coefficients, start: Reals | float, width: Reals) -> Coefficients:
    """Coefficients in powers of t of p(start + width t), by Horner's scheme."""
    shape = np.broadcast_shapes(values.shape[1:], np.shape(start))
    result = np.zeros((len(values), *shape))
    for done, value in enumerate(values[::-1]):
        result[1 : done + 1] = result[1 : done + 1] * start + result[:done] * width
        result[0] = result[0] * start + value
    return result


def turning_points(values: Coefficients) -> Reals | tuple[()]:
    """Turning points of any polynomials, from those of their derivatives, shape (n - 2, ...); a line has none."""
    if len(values) < 3:
        return ()
    slope = derivative(values)
    return zeros_of(slope, turning_points(slope))


def at_marks(values: Coefficients, turning: Reals | tuple[()] = ()) -> tuple[Reals, Reals]:
    """Both ends of [0, 1] with the turning points between them, and the polynomials there, shape (m + 2, ...)."""
    marks = np.empty((len(turning) + 2, *values.shape[1:]))
    heights = np.empty_like(marks)
    marks[0], marks[-1] = 0.0, 1.0
    heights[0], heights[-1] = values[0], values[::-1].sum(0)
    if len(turning):
        marks[1:-1] = turning
        heights[1:-1] = evaluate(values, marks[1:-1])
    return marks, heights


def greatest_at(marks: Reals, heights: Reals) -> tuple[Reals, Reals]:
    """The value of largest magnitude and its mark; nan where a value is."""
    best = np.abs(heights).argmax(axis=0)
    best *= best.size  # numbers in the flat arrays, faster than take_along_axis
    best += np.arange(best.size).reshape(best.shape)
    return heights.take(best), marks.take(best)


def zeros_of(values: Coefficients, turning: Reals | tuple[()] = ()) -> Reals:
    """Zeros in [0, 1] of polynomials with known turning points, in order.

    Parameters
    ----------
    values
        Coefficients, shape (n, ...).
    turning
        Turning points in order, shape (m, ...); a straight line has none.

    Returns
    -------
    Shape (m + 1, ...): between two neighbouring turning points the zero, or the first of them where there is none.
    """
    return zeros_between(values, *at_marks(values, turning))


def zeros_between(values: Coefficients, marks: Reals, heights: Reals) -> Reals:
    """The same from the values at the ends and the turning points."""
    shape = marks.shape[1:]
    flat, marks, heights = (array.reshape(len(array), -1) for array in (values, marks, heights))
    zeros = marks[:-1].copy()
    with np.errstate(invalid="ignore"):
        crossing, column = np.nonzero((heights[:-1] < 0) != (heights[1:] < 0))
    if len(column):
        ends = [(marks[crossing + k, column], heights[crossing + k, column]) for k in (0, 1)]
        zeros[crossing, column] = _between(flat[:, column], *ends)
    return zeros.reshape(-1, *shape)


def _between(values: Coefficients, low: Sequence[Reals], high: Sequence[Reals]) -> Reals:
    """The one zero of each polynomial between two marks: Newton's method, held in the bracket by bisection.

    A monotone piece has one zero; where a Newton step leaves the bracket the middle is taken instead. Some steps are
    taken together, then only those go on that are not there yet, each with one step after it is close.
    """
    left: Reals
    right: Reals
    (left, at_left), (right, at_right) = low, high
    rising = at_right > at_left
    with np.errstate(all="ignore"):
        xi = left - at_left * (right - left) / (at_right - at_left)
        xi = np.where((xi >= left) & (xi <= right), xi, (left + right) / 2)
        if len(values) == 2:
            return xi
        if len(values) == 3:
            return _of_parabola(values, left, right, xi)
        going: Any = slice(None)
        zeros = xi
        for step in range(STEPS):
            height, slope = _with_slope(values, xi)
            below = (height < 0) == rising
            left, right = np.where(below, xi, left), np.where(below, right, xi)
            new = xi - height / slope
            new = np.where((new >= left) & (new <= right), new, (left + right) / 2)
            far = np.abs(new - xi) > CLOSE
            zeros[going] = new
            xi = new
            if step >= TOGETHER:
                if not far.any():
                    break
                going = np.flatnonzero(far) if step == TOGETHER else going[far]
                values, left, right, rising, xi = values[:, far], left[far], right[far], rising[far], xi[far]
    return zeros


def _of_parabola(values: Coefficients, left: Reals, right: Reals, guess: Reals) -> Reals:
    """Of the two zeros of each parabola the one between two marks; the guess where round-off leaves none there.

    The larger by the formula without cancellation, the smaller from the product of both.
    """
    low, middle, high = values
    half = -(middle + np.copysign(np.sqrt(np.maximum(middle * middle - 4 * low * high, 0.0)), middle)) / 2
    one, other = half / high, low / half
    one = np.where((one >= left) & (one <= right), one, guess)
    return np.where((other >= left) & (other <= right), other, one)


def _with_slope(values: Coefficients, xi: Reals) -> tuple[Reals, Reals]:
    """Polynomials and their derivatives by one Horner scheme."""
    height = values[-1] * xi
    height += values[-2]
    slope = values[-1].copy()
    for value in values[-3::-1]:
        slope *= xi
        slope += height
        height *= xi
        height += value
    return height, slope
