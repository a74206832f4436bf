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

from elastic.beams.pieces import Pieces, in_pieces, pieces
from elastic.beams.polynomials import at_marks, derivative, greatest_at, turning_points, zeros_between, zeros_of
from elastic.deflection import FIELDS, Deflection
from rigid import Reals


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

    Raises
    ------
    ValueError
        There is no such field.

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
    for field in fields:
        if field not in (*FIELDS, "chord"):
            raise ValueError(f'there is no field "{field}" to be extreme: choose from {", ".join((*FIELDS, "chord"))}')
    cut = pieces(deflection)
    bare = not deflection.soft.strained and not deflection.soft.sheared
    found: dict[str, Extreme] = {}
    for chain in (("qx", "N", "u"), ("qy", "V", "M", "phi", "w")):
        wanted = [field for field in chain if field in fields or (field == "phi" and "chord" in fields)]
        if not wanted:
            continue
        turning = zeros_of(in_pieces(deflection, chain[0], cut))
        for field in chain[1:]:
            values = in_pieces(deflection, field, cut)
            if not bare and field in ("u", "w"):
                turning = turning_points(values)
            marks, heights = at_marks(values, turning)
            if field in fields:
                found[field] = merged(Extreme(*greatest_at(marks, heights)), cut, deflection)
            if field == "phi" and "chord" in fields:
                chord = in_pieces(deflection, "chord", cut)
                turns = zeros_of(derivative(chord), turning) if bare else turning_points(chord)
                found["chord"] = merged(greatest(chord, turns), cut, deflection)
            if field == wanted[-1]:
                break
            turning = zeros_between(values, marks, heights)
    return {field: found[field] for field in fields}


def merged(rows: Extreme, cut: Pieces, deflection: Deflection) -> Extreme:
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


def greatest(values: Any, turning: Any) -> Extreme:
    """The greatest magnitude among the ends and the turning points; nan where a coefficient is."""
    return Extreme(*greatest_at(*at_marks(values, turning)))
