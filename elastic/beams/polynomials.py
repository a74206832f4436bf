"""Zeros and extreme values on [0, 1] of many polynomials at once, to round-off.

A polynomial has at most one zero between two neighbouring turning points, and its turning points are the zeros of its
derivative. All zeros can therefore be found recursively, starting from a parabola. Bernstein coefficients avoid most of
this recursion: the number of zeros in (0, 1) equals the number of sign changes of the coefficients, or is less by an
even number.
"""

from collections.abc import Sequence
from functools import cache
from math import comb
from typing import Any

import numpy as np

from elastic.arrays import Coefficients
from rigid.arrays import Numbers, Reals

MAX_STEPS = 60  # maximum number of steps of Halley's method; as many bisections would reach double precision
COMMON_STEPS = 2  # number of steps for all zeros before the converged ones are dropped
MAX_DIRECT = 3  # polynomials with at most this many coefficients have closed-form zeros
LAST_CHANGE = 1e-8  # the iteration has converged to round-off after a step of xi smaller than this


@cache
def gauss_points(count: int) -> tuple[Reals, Reals]:
    """Return the Gauss-Legendre points on [0, 1] and their weights, as read-only arrays."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    xi, weights = (nodes + 1.0) / 2.0, weights / 2.0
    xi.flags.writeable = weights.flags.writeable = False
    return xi, weights


def evaluate(values: Coefficients, xi: Reals | float) -> Reals:
    """Evaluate polynomials with coefficients of shape (n, ...) at xi of shape (...) or (m, ...), by Horner's scheme."""
    if len(values) == 1:
        return values[0] + np.zeros(np.shape(xi))
    result: Reals = values[-1] * xi
    result += values[-2]
    for value in values[-3::-1]:
        result *= xi
        result += value
    return result


def derivative(values: Coefficients) -> Coefficients:
    """Return the coefficients of the derivatives."""
    return values[1:] * np.arange(1.0, len(values)).reshape(-1, *[1] * (values.ndim - 1))


def multiplied(first: Coefficients, second: Coefficients) -> Coefficients:
    """Return the coefficients of the products of polynomials with coefficients of shapes (n, ...) and (m, ...)."""
    result = np.zeros((len(first) + len(second) - 1, *np.broadcast_shapes(first.shape[1:], second.shape[1:])))
    for k, value in enumerate(second):
        result[k : k + len(first)] += first * value
    return result


def added(one: Numbers, other: Numbers) -> Numbers:
    """Return the coefficients of the sums of polynomials, which may have different degrees."""
    long, short = (one, other) if len(one) >= len(other) else (other, one)
    result: Numbers = long.copy()
    result[: len(short)] += short
    return result


def shifted(values: Coefficients, start: Reals | float, width: Reals) -> Coefficients:
    """Return the coefficients of p(start + width t) in powers of t, by Horner's scheme."""
    shape = np.broadcast_shapes(values.shape[1:], np.shape(start))
    result = np.zeros((len(values), *shape))
    for done, value in enumerate(values[::-1]):
        result[1 : done + 1] = result[1 : done + 1] * start + result[:done] * width
        result[0] = result[0] * start + value
    return result


def turning_points(values: Coefficients) -> Reals | tuple[()]:
    """Return the turning points of polynomials, shape (n - 2, ...), or () for straight lines."""
    if len(values) < 3:
        return ()
    slope = derivative(values)
    if len(slope) <= MAX_DIRECT:
        return _direct_zeros(slope)
    flat = slope.reshape(len(slope), -1)
    rising = (hull := in_bernstein(len(flat)) @ flat) > 0.0
    changes = np.count_nonzero(rising[1:] != rising[:-1], axis=0)
    certain = (hull != 0.0).all(axis=0)
    single, several = np.flatnonzero(certain & (changes == 1)), np.flatnonzero(~certain | (changes > 1))
    turning = np.zeros((len(values) - 2, flat.shape[1]))
    if len(single):
        first, last = hull[0, single], hull[-1, single]  # slopes at 0 and 1
        turning[:, single] = _zeros_in_brackets(
            flat[:, single], (np.zeros(len(single)), first), (np.ones(len(single)), last)
        )
    if len(several):
        part = flat[:, several]
        turning[:, several] = zeros_of(part, turning_points(part))
    return turning.reshape(-1, *slope.shape[1:])


@cache
def in_bernstein(count: int) -> Reals:
    """Return the matrix that converts power to Bernstein coefficients on [0, 1], shape (count, count)."""
    order = count - 1
    return np.array([[comb(row, power) / comb(order, power) for power in range(count)] for row in range(count)])


def at_marks(values: Coefficients, turning: Reals | tuple[()] = ()) -> tuple[Reals, Reals]:
    """Return the marks 0, turning points and 1, and the values of the polynomials there, shape (m + 2, ...)."""
    marks = np.empty((len(turning) + 2, *values.shape[1:]))
    heights = np.empty_like(marks)
    marks[0], marks[-1] = 0.0, 1.0
    heights[0], heights[-1] = values[0], values[::-1].sum(0)
    if len(turning):
        marks[1:-1] = turning
        heights[1:-1] = evaluate(values, marks[1:-1])
    return marks, heights


def greatest_on(values: Coefficients) -> tuple[Reals, Reals]:
    """Return the value with the largest magnitude on [0, 1] and its place xi; nan if a coefficient is nan.

    The magnitude is largest at an end if no inner Bernstein coefficient exceeds the end values in magnitude.
    """
    flat = values.reshape(len(values), -1)
    size = np.abs(in_bernstein(len(flat)) @ flat)
    curved = ~(size[1:-1].max(axis=0, initial=0.0) <= np.maximum(size[0], size[-1]))
    value, place = greatest_at(*at_marks(flat))
    if curved.any():
        some = flat[:, curved]
        value[curved], place[curved] = greatest_at(*at_marks(some, turning_points(some)))
    return value.reshape(values.shape[1:]), place.reshape(values.shape[1:])


def least_on(values: Coefficients) -> Reals:
    """Return the smallest value of each polynomial on [0, 1]; nan if a coefficient is nan.

    The value is smallest at an end if no inner Bernstein coefficient is smaller than both end values.
    """
    flat = values.reshape(len(values), -1)
    hull = in_bernstein(len(flat)) @ flat
    least: Reals = np.minimum(hull[0], hull[-1])
    curved = ~(hull[1:-1].min(axis=0, initial=np.inf) >= least)
    if curved.any():
        some = flat[:, curved]
        least[curved] = at_marks(some, turning_points(some))[1].min(axis=0)
    return least.reshape(values.shape[1:])


def greatest_at(marks: Reals, heights: Reals) -> tuple[Reals, Reals]:
    """Return the value with the largest magnitude, and its mark; nan if any value is nan."""
    best = np.abs(heights).argmax(axis=0)
    best *= best.size  # index into the flat arrays, which is faster than take_along_axis
    best += np.arange(best.size).reshape(best.shape)
    return heights.take(best), marks.take(best)


def zeros_of(values: Coefficients, turning: Reals | tuple[()] = ()) -> Reals:
    """Find the zeros of polynomials in [0, 1], in ascending order, from the turning points of the polynomials.

    Parameters
    ----------
    values
        Coefficients of the polynomials, shape (n, ...).
    turning
        Turning points in ascending order, shape (m, ...), or () for straight lines.

    Returns
    -------
    Array of shape (m + 1, ...) with the zero between each pair of neighbouring marks (0, turning points, 1). If there
    is no zero between two marks, the lower mark is returned.
    """
    marks, heights = at_marks(values, turning)
    shape = marks.shape[1:]
    flat, marks, heights = (array.reshape(len(array), -1) for array in (values, marks, heights))
    zeros = marks[:-1].copy()
    with np.errstate(invalid="ignore"):
        crossing, column = np.nonzero((heights[:-1] < 0) != (heights[1:] < 0))
    if len(column):
        ends = [(marks[crossing + k, column], heights[crossing + k, column]) for k in (0, 1)]
        zeros[crossing, column] = _zeros_in_brackets(flat[:, column], *ends)
    return zeros.reshape(-1, *shape)


def _zeros_in_brackets(values: Coefficients, low: Sequence[Reals], high: Sequence[Reals]) -> Reals:
    """Find the single zero of each polynomial between two marks by a bracketed Halley's method.

    A step that leaves the bracket is replaced by a bisection. After `COMMON_STEPS` steps, the iteration continues only
    for the zeros that have not converged.
    """
    left: Reals
    right: Reals
    (left, at_left), (right, at_right) = low, high
    rising = at_right > at_left
    with np.errstate(all="ignore"):
        xi = left - at_left * (right - left) / (at_right - at_left)
        xi = np.where((xi >= left) & (xi <= right), xi, (left + right) / 2)
        going: Any = slice(None)
        zeros = xi
        for step in range(MAX_STEPS):
            height, slope, bend = _with_derivatives(values, xi)
            below = (height < 0) == rising
            left, right = np.where(below, xi, left), np.where(below, right, xi)
            new = xi - height * slope / (slope * slope - height * bend)
            new = np.where((new >= left) & (new <= right), new, (left + right) / 2)
            far = np.abs(new - xi) > LAST_CHANGE
            zeros[going] = new
            xi = new
            if step >= COMMON_STEPS:
                if not far.any():
                    break
                going = np.flatnonzero(far) if step == COMMON_STEPS else going[far]
                values, left, right, rising, xi = values[:, far], left[far], right[far], rising[far], xi[far]
    return zeros


def _direct_zeros(values: Coefficients) -> Reals:
    """Return the zeros of straight lines or parabolas, clipped to [0, 1], in ascending order.

    The zero of a parabola with the larger magnitude is computed by the formula without cancellation, and the other zero
    from the product of both. If a parabola has no real zeros, one result is the place of its extreme, and the other has
    no meaning. An undefined zero is replaced by 0.
    """
    low, middle = values[:2]
    with np.errstate(all="ignore"):
        if len(values) == 2:
            zeros = -(low / middle)[None]
        else:
            half = -(middle + np.copysign(np.sqrt(np.maximum(middle**2 - 4 * low * values[2], 0.0)), middle)) / 2
            zeros = np.array([half / values[2], low / half])
    zeros = np.clip(np.where(np.isnan(zeros), 0.0, zeros), 0.0, 1.0)
    zeros.sort(axis=0)
    return zeros


def _with_derivatives(values: Coefficients, xi: Reals) -> tuple[Reals, Reals, Reals]:
    """Evaluate polynomials, their first derivatives and half their second derivatives in one Horner scheme."""
    height = values[-1] * xi
    height += values[-2]
    slope, bend = values[-1].copy(), np.zeros(height.shape)
    for value in values[-3::-1]:
        bend *= xi
        bend += slope
        slope *= xi
        slope += height
        height *= xi
        height += value
    return height, slope, bend
