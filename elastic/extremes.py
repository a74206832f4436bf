"""Greatest values of the fields along every beam, exact.

Every field is a polynomial whose derivative is another field: q_y, V, M, phi, w and q_x, N, u. The zeros of one are the
turning points of the next and bracket its zeros, so all are found by walking up the chain from the straight line, each
zero alone between two neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.deflection import FIELDS, Deflection
from elastic.pieces import Pieces, in_pieces, pieces
from rigid import Reals

STEPS = 60


@dataclass(frozen=True, eq=False)
class Extreme:
    """The value of largest magnitude of a field along every beam, and where it is, shape (beams, ..., positions)."""

    value: Reals
    xi: Reals


def extremes(deflection: Deflection, fields: Sequence[str] = FIELDS) -> dict[str, Extreme]:
    """Values of largest magnitude along every beam at every position, to round-off; nan at singular positions.

    Parameters
    ----------
    fields
        Any of "N", "V", "M", "u", "w", "phi" and "chord"; only what these take is computed.

    Examples
    --------
    A rod of 1 m and 1 kg/m turning at 1 rad/s pulls most at its root, with 1/2 N.

    >>> from elastic import Section, deflection
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> rod = Link("rod", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), rod), (PinDrive("rod", "O"),), {"O": 0, "A": 1})
    >>> extremes(deflection(motion(turning, [0.0], 1.0), [Section(1.0, 1.0)]), ["N"])["N"].value
    array([[0.5]])
    """
    cut = pieces(deflection)
    bare = not deflection.soft.strain.any(), not deflection.soft.shear.any()
    found: dict[str, Extreme] = {}
    for chain in (("qx", "N", "u"), ("qy", "V", "M", "phi", "w")):
        wanted = [field for field in chain if field in fields or (field == "phi" and "chord" in fields)]
        if not wanted:
            continue
        turning = _zeros(in_pieces(deflection, chain[0], cut))
        for field in chain[1:]:
            values = in_pieces(deflection, field, cut)
            if field in fields:
                shared = bare[0] if field == "u" else bare[1] or field != "w"
                found[field] = _merged(_greatest(values, turning if shared else _turning(values)), cut, deflection)
            if field == "phi" and "chord" in fields:
                chord = in_pieces(deflection, "chord", cut)
                turns = _zeros(_derivative(chord), turning) if bare[1] else _turning(chord)
                found["chord"] = _merged(_greatest(chord, turns), cut, deflection)
            if field == wanted[-1]:
                break
            turning = _zeros(values, turning)
    return {field: found[field] for field in fields}


def _merged(rows: Extreme, cut: Pieces, deflection: Deflection) -> Extreme:
    """The greatest of every beam's pieces."""
    if cut.start is None:
        return rows
    where = cut.start + cut.width * rows.xi
    value = np.zeros((len(deflection.sections), *rows.value.shape[1:]))
    xi = np.zeros_like(value)
    for row, beam in enumerate(cut.beam):
        better = ~(np.abs(rows.value[row]) <= np.abs(value[beam]))
        value[beam], xi[beam] = np.where(better, rows.value[row], value[beam]), np.where(better, where[row], xi[beam])
    return Extreme(value, xi)


def _derivative(values: Any) -> Any:
    return values[1:] * np.arange(1.0, len(values)).reshape(-1, *[1] * (values.ndim - 1))


def _turning(values: Any) -> Any:
    """Turning points of any polynomials, from those of their derivatives."""
    slope = _derivative(values)
    return _zeros(slope, _turning(slope) if len(slope) > 2 else ())


def _evaluate(values: Any, xi: Any) -> Any:
    """Horner's scheme."""
    result = values[-1]
    for value in values[-2::-1]:
        result = result * xi + value
    return result


def _greatest(values: Any, turning: Any) -> Extreme:
    """The greatest magnitude among the ends and the turning points; nan where a coefficient is."""
    best, where = values[0] + 0.0 * values.sum(0), np.zeros(values.shape[1:])
    for xi in (np.ones(values.shape[1:]), *turning):
        value = _evaluate(values, xi)
        better = np.abs(value) > np.abs(best)
        best, where = np.where(better, value, best), np.where(better, xi, where)
    return Extreme(best, where)


def _zeros(values: Any, turning: Any = ()) -> Any:
    """Zeros in [0, 1] of polynomials whose turning points are known, in order; 1 where there is none.

    Parameters
    ----------
    values
        Coefficients, shape (n, ...).
    turning
        Turning points in order, shape (m, ...); a straight line has none.

    Returns
    -------
    Shape (m + 1, ...).
    """
    shape = values.shape[1:]
    flat = values.reshape(len(values), -1)
    marks = np.concatenate(
        [np.zeros((1, flat.shape[1])), np.reshape(turning, (-1, flat.shape[1])), np.ones((1, flat.shape[1]))]
    )
    heights = _evaluate(flat, marks)
    zeros = np.ones((len(marks) - 1, flat.shape[1]))
    with np.errstate(invalid="ignore"):
        crossing, column = np.nonzero((heights[:-1] < 0) != (heights[1:] < 0))
    if len(column):
        ends = [(marks[crossing + k, column], heights[crossing + k, column]) for k in (0, 1)]
        zeros[crossing, column] = _between(flat[:, column], *ends)
        zeros.sort(axis=0)
    return zeros.reshape(-1, *shape)


def _between(values: Any, low: Any, high: Any) -> Any:
    """The one zero of each polynomial between two marks: Newton's method, held in the bracket by bisection.

    A monotone piece has one zero; where a Newton step leaves the bracket the middle is taken instead.
    """
    (left, at_left), (right, at_right) = low, high
    slopes = values[1:] * np.arange(1.0, len(values))[:, None]
    rising = at_right > at_left
    with np.errstate(all="ignore"):
        xi = left - at_left * (right - left) / (at_right - at_left)
        xi = np.where((xi >= left) & (xi <= right), xi, (left + right) / 2)
        for _ in range(STEPS):
            height = _evaluate(values, xi)
            below = (height < 0) == rising
            left, right = np.where(below, xi, left), np.where(below, right, xi)
            step = xi - height / _evaluate(slopes, xi)
            inside = (step >= left) & (step <= right)
            new = np.where(inside, step, (left + right) / 2)
            moved = np.abs(new - xi)
            xi = new
            if not (moved > 4e-16).any():
                break
    return xi
