"""Every field as polynomials of one piece of a beam each, whatever sliders and tapers make of the beams."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import comb
from typing import Any

import numpy as np

from elastic.deflection import Deflection
from elastic.sampling import coefficients, sample

DEGREE = 10
PARTS = 16


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of all beams: rows that may belong to the same beam.

    Attributes
    ----------
    beam
        Number of every row's beam, shape (rows,).
    start, width
        Where the row begins on its beam and how long it is, in xi; None where every row is a whole beam.
    """

    beam: Any
    start: Any
    width: Any


def pieces(deflection: Deflection) -> Pieces:
    """How the beams are cut: at sliders' blocks, and into equal parts where they are tapered."""
    columns = deflection.N.shape[2:]
    if not deflection.contacts and not any(section.taper for section in deflection.sections):
        return Pieces(np.arange(len(deflection.sections)), None, None)
    rows: list[tuple[int, Any, Any]] = []
    for number, section in enumerate(deflection.sections):
        marks: list[Any] = [np.zeros(columns), np.ones(columns)]
        if section.taper:
            marks = [np.full(columns, mark) for mark in np.linspace(0.0, 1.0, PARTS + 1)]
        marks += [contact.xi for contact in deflection.contacts if contact.beam == number]
        marks = list(np.sort(np.array(marks), axis=0))
        rows += [(number, low, high - low) for low, high in pairwise(marks)]
    beam = np.array([row[0] for row in rows], int)
    return Pieces(beam, np.array([row[1] for row in rows]), np.array([row[2] for row in rows]))


def in_pieces(deflection: Deflection, field: str, cut: Pieces) -> Any:
    """Coefficients of a field in powers of the way along every piece, from 0 to 1, shape (n, rows, ..., positions)."""
    if field == "chord":
        return _from_chord(in_pieces(deflection, "w", cut), cut)
    if cut.start is None:
        return coefficients(deflection, field)
    values = coefficients(deflection, field)[:, cut.beam]
    tapered = [section.taper is not None for section in deflection.sections]
    fitted = any(tapered) and field in ("u", "w", "phi")
    result = np.zeros((max(len(values), DEGREE + 1 if fitted else 4), *values.shape[1:]))
    _shift(values, cut.start, cut.width, result)
    for contact in deflection.contacts if field not in ("qx", "qy") else ():
        _add_beyond(deflection, contact, field, cut, result)
    for row in np.flatnonzero(np.array(tapered)[cut.beam]) if fitted else ():
        result[:, row] = 0.0
        result[: DEGREE + 1, row] = _fitted(deflection, field, cut, row)
    return result


def _from_chord(w: Any, cut: Pieces) -> Any:
    """Deflection from the line through the displaced ends of every beam, from w in pieces."""
    chord: Any = w.copy()
    first = np.searchsorted(cut.beam, cut.beam)
    last = np.searchsorted(cut.beam, cut.beam, side="right") - 1
    begin, end = w[0, first], w[:, last].sum(0)
    start, width = (0.0, 1.0) if cut.start is None else (cut.start, cut.width)
    chord[0] -= begin + (end - begin) * start
    chord[1] -= (end - begin) * width
    return chord


def _add_beyond(deflection: Deflection, contact: Any, field: str, cut: Pieces, result: Any) -> None:
    """Add to the rows beyond a contact what it changes there."""
    for row in np.flatnonzero(cut.beam == contact.beam):
        parts = deflection.beyond(contact, field)
        columns = result.shape[2:]
        values = np.array([np.broadcast_to(part, columns) for part in parts])[:, None]
        moved = np.zeros((len(parts), 1, *columns))
        _shift(values, (cut.start[row] - contact.xi)[None], cut.width[row][None], moved)
        result[: len(parts), row] += np.where(cut.start[row] >= contact.xi, moved[:, 0], 0.0)


def _shift(values: Any, start: Any, width: Any, result: Any) -> None:
    """Coefficients of p(start + width t) in powers of t, added to `result`."""
    for power in range(len(values)):
        for k in range(power + 1):
            result[k] += comb(power, k) * values[power] * start ** (power - k) * width**k


def _fitted(deflection: Deflection, field: str, cut: Pieces, row: Any) -> Any:
    """A field of a tapered beam on one of its short pieces, interpolated to round-off."""
    return interpolated(sample(deflection, field, nodes_of(cut, row))[cut.beam[row]])


def nodes_of(cut: Pieces, row: Any) -> Any:
    """Stations on a tapered beam's piece where `interpolated` takes its values, shape (DEGREE + 1,)."""
    start, width = (float(np.ravel(value[row])[0]) for value in (cut.start, cut.width))
    return start + width * (0.5 - 0.5 * np.cos(_angles()))


def interpolated(values: Any) -> Any:
    """Coefficients along a piece, from 0 to 1, of what takes values of shape (..., DEGREE + 1) at the `nodes_of` it."""
    return np.tensordot(_interpolation(), np.moveaxis(values, -1, 0), 1)


@cache
def _interpolation() -> Any:
    """From values at the nodes to coefficients, shape (DEGREE + 1, DEGREE + 1)."""
    orders = np.arange(DEGREE + 1)
    spectrum = np.cos(np.multiply.outer(orders, np.pi - _angles())) * (2.0 / (DEGREE + 1))
    spectrum[0] /= 2
    return np.array([_power_coefficients(order) for order in orders]).T @ spectrum


def _angles() -> Any:
    return np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1)


def _power_coefficients(order: Any) -> Any:
    """Chebyshev's polynomial of 2 t - 1 in powers of t."""
    series = np.polynomial.Chebyshev.basis(order, domain=[0.0, 1.0])
    values = np.zeros(DEGREE + 1)
    values[: order + 1] = series.convert(kind=np.polynomial.Polynomial, domain=[-1.0, 1.0]).coef
    return values
