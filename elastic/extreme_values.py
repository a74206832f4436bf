"""Exact extreme values of fields along every beam, from the turning points of polynomials."""

from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.beams.polynomials import greatest_on
from elastic.derived import coefficients, sum_of_squares
from elastic.fields import PRIMARY, field_named
from elastic.solution import Deflection
from rigid import Reals


class Extreme(Struct, frozen=True, eq=False):
    """Value with the largest magnitude along each beam, and its station xi, each of shape (beams, ..., positions)."""

    value: Reals
    xi: Reals

    def __repr__(self) -> str:
        return f"Extreme(of {len(self.value)} beams, columns {self.value.shape[1:]})"


def extremes(deflection: Deflection, fields: Sequence[str] = PRIMARY) -> dict[str, Extreme]:
    """Find the value with the largest magnitude along each beam.

    The values are exact except for round-off. They are nan at singular positions.

    Parameters
    ----------
    fields
        Keys or slugs of `FIELDS`.

    Raises
    ------
    ValueError
        If a field does not exist.

    Examples
    --------
    A rod of 1 m with 1 kg/m rotates at 1 rad/s. Its largest axial force is 1/2 N, at the pivot.

    >>> from elastic import Section, deflection
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> rod = Link("rod", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), rod), (PinDrive("rod", "O"),), {"O": 0, "A": 1})
    >>> extremes(deflection(motion(turning, [0.0], 1.0), [Section(1.0, 1.0)]), ["N"])["N"].value
    array([[0.5]])
    """
    requested = {name: field_named(name).key for name in fields}
    wanted = _with_parts(requested.values())
    others = [key for key in wanted if not field_named(key).greatest_of]
    values = _extremes_of_polynomials(deflection, [key for key in others if not field_named(key).root_of])
    values |= {
        key: _root_extreme(deflection, key) for key in others if field_named(key).root_of and key in requested.values()
    }
    for key in wanted:
        field = field_named(key)
        if field.greatest_of:
            best = reduce(_larger_magnitude, (values[part] for part in field.greatest_of if part in values))
            for part in field.greatest_of:
                best = best if part in values else _larger_magnitude(best, _root_extreme(deflection, part, best))
            values[key] = best if field.signed else Extreme(np.abs(best.value), best.xi)
    return {name: values[key] for name, key in requested.items()}


def _with_parts(fields: Iterable[str]) -> tuple[str, ...]:
    """Return fields together with the fields in their `greatest_of`, recursively."""
    wanted: dict[str, None] = {}
    for key in fields:
        wanted |= dict.fromkeys((*_with_parts(field_named(key).greatest_of), key))
    return tuple(wanted)


def _extremes_of_polynomials(deflection: Deflection, keys: Iterable[str]) -> dict[str, Extreme]:
    """Find the extremes of fields that are polynomials. Fields of the same degree are processed together."""
    alike: dict[int, dict[str, Any]] = {}
    for key in keys:
        values = coefficients(deflection, key)
        alike.setdefault(len(values), {})[key] = values
    greatest: dict[str, Extreme] = {}
    for fields in alike.values():
        values = np.stack(list(fields.values()), axis=1)
        both = zip(*greatest_on(values), strict=True)
        greatest |= {
            key: _largest_of_pieces(Extreme(*each), deflection) for key, each in zip(fields, both, strict=True)
        }
    return greatest


def _root_extreme(deflection: Deflection, key: str, lower_bound: Extreme | None = None) -> Extreme:
    """Find the extreme of a root of a sum of squares.

    If the field certainly does not exceed `lower_bound`, 0 is returned instead. To check this, the sum of the
    magnitudes of the coefficients is used: it is a bound on a polynomial on [0, 1].
    """
    squares = sum_of_squares(deflection, field_named(key).root_of)
    near = np.ones(squares.shape[1:], bool)
    if lower_bound is not None:
        near = ~(np.abs(squares).sum(0) <= lower_bound.value[deflection.division.beam] ** 2)
    value, xi = np.zeros(near.shape), np.zeros(near.shape)
    if near.any():
        some = np.ascontiguousarray(squares[:, near])
        value[near], xi[near] = greatest_on(some)
    return _largest_of_pieces(Extreme(np.sqrt(np.maximum(value, 0.0)), xi), deflection)


def _largest_of_pieces(pieces: Extreme, deflection: Deflection) -> Extreme:
    """Return the extreme with the largest magnitude over the pieces of each beam."""
    division = deflection.division
    if division.whole:
        return pieces
    where = division.start + division.width * pieces.xi
    value = np.zeros((len(deflection.sections), *pieces.value.shape[1:]))
    xi = np.zeros_like(value)
    for row, beam in enumerate(division.beam):
        better = ~(np.abs(pieces.value[row]) <= np.abs(value[beam]))
        value[beam] = np.where(better, pieces.value[row], value[beam])
        xi[beam] = np.where(better, where[row], xi[beam])
    return Extreme(value, xi)


def _larger_magnitude(first: Extreme, second: Extreme) -> Extreme:
    better = np.abs(second.value) > np.abs(first.value)
    return Extreme(np.where(better, second.value, first.value), np.where(better, second.xi, first.xi))
