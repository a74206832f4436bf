"""Greatest magnitudes of the fields along every beam over all positions, exact: few positions are looked at closely.

Between stations h apart a polynomial p is no further than h^2/8 max |p''| from the chord through its values there, and
|p''| no greater than its greatest Bernstein coefficient. Where that bound stays below what is reached at a station of
another position, the greatest value is not; the others are searched as `extremes` does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from math import comb
from typing import Any

import numpy as np

from elastic.beams.polynomials import at_marks, derivative, evaluate, greatest_at, turning_points
from elastic.derived import coefficients, sum_of_squares
from elastic.fields import field_named
from elastic.solution import Deflection
from rigid import Reals

STATIONS = (0.0, 0.25, 0.5, 0.75, 1.0)
SLACK = 1.0 + 1e-9  # of the bound, for its own round-off


@dataclass(frozen=True, eq=False)
class Maximum:
    """Greatest magnitude of a field on every beam, and the number of its position, shape (beams, ...)."""

    value: Reals
    position: Any


def cycle_maxima(deflection: Deflection, fields: Sequence[str], counted: Any = None) -> dict[str, Maximum]:
    """Greatest magnitudes over beams and positions; nan, and position -1, where none is known.

    The same as the greatest of `extremes` over the positions, to round-off, at a fraction of its cost.

    Parameters
    ----------
    fields
        Keys of `FIELDS`.
    counted
        Which positions count, shape (..., positions); all where left out. Those that are nan never do.

    Raises
    ------
    ValueError
        There is no such field.

    Examples
    --------
    >>> from elastic import Section, deflection
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> rod = Link("rod", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), rod), (PinDrive("rod", "O"),), {"O": 0, "A": 1})
    >>> bent = deflection(motion(turning, [0.0, 0.1], [[1.0, 2.0]]), [Section(1.0, 1.0)])
    >>> cycle_maxima(bent, ["N"])["N"]
    Maximum(value=array([2.]), position=array([1]))
    """
    return {key: _maximum(deflection, key, counted) for key in fields}


def _maximum(deflection: Deflection, key: str, counted: Any) -> Maximum:
    parts = [_bounds(values, square, counted) for values, square in _polynomials(deflection, key)]
    beams, columns, owner = len(deflection.sections), deflection.motion.columns, deflection.division.beam
    floor = reduce(np.maximum, (_of_beams(np.fmax.reduce(part.low, axis=-1), owner, beams) for part in parts))
    best = np.full((beams, *columns[:-1]), -1.0)
    place = np.full(best.shape, -1)
    for part in parts:
        where = np.nonzero(part.high >= floor[owner][..., None])
        if not len(where[0]):
            continue
        chosen = part.values[(slice(None), *where)]
        size = np.abs(greatest_at(*at_marks(chosen, turning_points(chosen)))[0])
        size = np.sqrt(size) if part.square else size
        row = owner[where[0]], *where[1:-1]
        _keep(best, place, np.ravel_multi_index(row, best.shape), size, where[-1])
    return Maximum(np.where(best < 0.0, np.nan, best), place)


def _keep(best: Any, place: Any, row: Any, size: Any, position: Any) -> None:
    """Enter values into the rows that they belong to, the greatest of each; of equal ones the first."""
    size = np.where(np.isnan(size), -1.0, size)
    order = np.lexsort((-position, size, row))
    last = np.flatnonzero(np.append(np.diff(row[order]) != 0, True))
    at = order[last]
    flat, places = best.reshape(-1), place.reshape(-1)
    better = size[at] > flat[row[at]]
    flat[row[at][better]], places[row[at][better]] = size[at][better], position[at][better]


@dataclass(frozen=True, eq=False)
class _Part:
    """Polynomials, or squares of what is asked for, and what their magnitudes are at least and at most."""

    values: Any
    square: bool
    low: Any
    high: Any


def _polynomials(deflection: Deflection, key: str) -> list[tuple[Any, bool]]:
    """Polynomials of which a field is the one of greatest magnitude, and whether they are its square."""
    field = field_named(key)
    if field.greatest_of:
        return [one for part in field.greatest_of for one in _polynomials(deflection, part)]
    if field.root_of:
        return [(sum_of_squares(deflection, field.root_of), True)]
    return [(coefficients(deflection, key), False)]


def _bounds(values: Any, square: bool, counted: Any) -> _Part:
    """Bounds of the magnitude of polynomials on [0, 1], nan where they do not count."""
    low = reduce(np.maximum, (np.abs(evaluate(values, xi)) for xi in STATIONS))
    high = low.copy()
    if len(values) > 2:
        bend = derivative(derivative(values))
        step = STATIONS[1] - STATIONS[0]
        high += step**2 / 8 * reduce(np.maximum, (np.abs(one) for one in _bernstein(bend)))
    high *= SLACK
    if counted is not None:
        low, high = (np.where(counted, one, np.nan) for one in (low, high))
    return _Part(values, square, *(np.sqrt(one) for one in (low, high))) if square else _Part(values, square, low, high)


def _bernstein(values: Any) -> Any:
    """Coefficients in Bernstein's basis of polynomials in powers, one by one."""
    for row in _to_bernstein(len(values)):
        yield reduce(np.add, (factor * value for factor, value in zip(row, values, strict=False)))


@lru_cache(maxsize=32)
def _to_bernstein(count: int) -> tuple[tuple[float, ...], ...]:
    top = count - 1
    return tuple(tuple(comb(j, i) / comb(top, i) for i in range(j + 1)) for j in range(count))


def _of_beams(values: Any, owner: Any, beams: int) -> Any:
    """Greatest of every beam's pieces; -1 where none is known."""
    result = np.full((beams, *values.shape[1:]), -1.0)
    known = np.where(np.isnan(values), -1.0, values)
    if len(owner) == beams:
        return known
    np.maximum.at(result, owner, known)
    return result
