"""Division of beams into pieces on which every field is a single polynomial.

Most beams are a single piece. A beam with sliding blocks is divided at the blocks. A tapered beam is divided until its
flexibility on each piece is a polynomial to round-off.
"""

from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.arrays import AtStations, Coefficients, PerBeam
from elastic.beams.blocks import Block
from elastic.beams.compliance import BeamCompliance
from elastic.beams.elastic_line import Amplitudes
from elastic.beams.polynomials import added, evaluate, shifted
from elastic.beams.section import Section
from elastic.beams.taper import piece_ends, piece_functions
from rigid.arrays import Columns, Integers, Reals

DISPLACEMENTS = ("u", "w", "phi")


class Division(Struct, frozen=True, eq=False, dict=True):
    """Pieces of all beams, sorted by beam, and by position along each beam.

    Attributes
    ----------
    beam
        Index of the beam to which each piece belongs, shape (pieces,).
    start, width
        Start and length of each piece in xi, shape (pieces, ..., positions), or (pieces, ..., 1) if every beam is a
        single piece.
    sections, blocks
        Section of each beam, and all sliding blocks.
    """

    beam: Integers
    start: PerBeam
    width: PerBeam
    sections: tuple[Section, ...]
    blocks: tuple[Block, ...]

    @cached_property
    def whole(self) -> bool:
        """True if every beam is a single piece."""
        return not self.blocks and not any(section.taper for section in self.sections)

    def of_beam(self, number: int) -> Integers:
        """Return the indices of the pieces of a beam."""
        return np.flatnonzero(self.beam == number)


def division_of(sections: tuple[Section, ...], blocks: tuple[Block, ...], columns: tuple[int, ...]) -> Division:
    """Divide tapered beams into pieces, and divide all beams at their sliding blocks."""
    if not blocks and (whole := _undivided(sections, len(columns))):
        return whole
    pieces: list[tuple[int, Any, Any]] = []
    for number, section in enumerate(sections):
        marks = [np.full(columns, mark) for mark in (piece_ends(section) if section.taper else (0.0, 1.0))]
        marks += [np.broadcast_to(block.xi, columns) for block in blocks if block.beam == number]
        marks = list(np.sort(np.array(marks), axis=0))
        pieces += [(number, low, high - low) for low, high in pairwise(marks)]
    beam, start, width = (np.array(part) for part in zip(*pieces, strict=True))
    return Division(beam, start, width, sections, blocks)


@lru_cache(maxsize=64)
def _undivided(sections: tuple[Section, ...], ndim: int) -> Division | None:
    """Return a division with one piece per beam, or None if a beam is tapered."""
    if any(section.taper for section in sections):
        return None
    rows = (len(sections),) + (1,) * ndim
    return Division(np.arange(len(sections)), np.zeros(rows), np.ones(rows), sections, ())


def on_pieces(field: str, amplitudes: Amplitudes, division: Division, compliance: BeamCompliance) -> Coefficients:
    """Return N, V, M, u, w or phi in powers of t, which runs from 0 to 1 on each piece.

    The result has the shape (n, pieces, ..., positions).
    """
    values: Coefficients = getattr(amplitudes, field)
    free: Coefficients | None = None
    if amplitudes.free is not None and field in DISPLACEMENTS:
        free = amplitudes.free[DISPLACEMENTS.index(field)]
    if division.whole:
        return values if free is None else added(values, free)
    result = shifted(values[:, division.beam], division.start, division.width)
    for number, section in enumerate(division.sections):
        if section.taper and field in DISPLACEMENTS:
            rows = division.of_beam(number)
            carried, bent = _tapered_field(field, amplitudes, number, section, compliance.length[number])
            moved = shifted(carried[:, None], division.start[rows], division.width[rows])
            result = _with_rows(result, rows, added(bent, moved))
    for block in division.blocks:
        _add_beyond(result, block, division, block.beyond(compliance)[field])
    return result if free is None else added(result, shifted(free[:, division.beam], division.start, division.width))


def _with_rows(values: Coefficients, rows: Integers, others: Coefficients) -> Coefficients:
    """Replace the coefficients of some rows; the degree of the result is the higher of the two degrees."""
    result = np.zeros((max(len(values), len(others)), *values.shape[1:]))
    result[: len(values)] = values
    result[:, rows] = 0.0
    result[: len(others), rows] = others
    return result


def _tapered_field(
    field: str, amplitudes: Amplitudes, number: int, section: Section, length: Reals
) -> tuple[Coefficients, Coefficients]:
    """Split a field of a tapered beam into a straight line in powers of xi and a remainder on the pieces.

    The remainder has the shape (n, pieces, ...).
    """
    values = getattr(amplitudes, field)[:, number]
    stretch, turn, bend, slide = piece_functions(section, len(amplitudes.M))

    def along(functions: Reals, parts: Coefficients) -> Coefficients:
        return np.tensordot(functions[..., : len(parts)], parts, 1)

    if field == "u":
        strained = np.broadcast_to(section.strain * length, values.shape[1:])
        return np.array([values[0], strained]), along(stretch, values[1:])
    if field == "phi":
        return values[:1], along(turn, values[1:])
    bent = along(bend, values[2:])
    return values[:2], bent if amplitudes.slide is None else bent + along(slide, amplitudes.slide[:, number])


def _add_beyond(values: Coefficients, block: Block, division: Division, powers: tuple[Columns, ...]) -> None:
    """Add the effect of a block to the pieces between the block and the end of the beam; nan if `block.xi` is nan."""
    more = np.array([np.broadcast_to(power, values.shape[2:]) for power in powers])
    for row in division.of_beam(block.beam):
        start = division.start[row] - block.xi
        changed = shifted(more, start, division.width[row])
        values[: len(more), row] += np.where(start >= 0.0, changed, 0.0 * block.xi)


def evaluated(values: Coefficients, division: Division, stations: Reals) -> AtStations:
    """Evaluate a field at stations. At a block, the result is the value just before the block.

    Parameters
    ----------
    values
        Coefficients of the field on the pieces, shape (n, pieces, ..., positions).
    stations
        Values of xi, shape (stations,).

    Returns
    -------
    Array of shape (beams, ..., positions, stations).
    """
    if division.whole:
        powers = np.power.outer(stations, np.arange(len(values)))
        flat = powers @ values.reshape(len(values), -1)
        return flat.reshape(len(stations), *values.shape[1:]).transpose(*range(1, values.ndim), 0)
    result = np.empty((len(division.sections), *values.shape[2:], len(stations)))
    for number, along in enumerate(result):
        first, *others = division.of_beam(number)
        for row, following in zip((first, *others), (*others, None), strict=True):
            start, width = division.start[row][..., None], division.width[row][..., None]
            begun = (stations > start) | (row == first)
            ended = False if following is None else stations > division.start[following][..., None]
            chosen = np.flatnonzero((begun & ~np.asarray(ended)).any(axis=tuple(range(begun.ndim - 1))))
            way = (stations[chosen] - start) / np.where(width > 0.0, width, 1.0)
            along[..., chosen] = np.where(
                begun[..., chosen], evaluate(values[:, row, ..., None], way), along[..., chosen]
            )
    return result


def at_station(values: Coefficients, division: Division, number: int, xi: Reals | float) -> Columns:
    """Evaluate a field of one beam at one station, shape (..., positions).

    At a block, the result is the value just before the block.

    Parameters
    ----------
    xi
        Station: a number, or an array with one value per design, shape (designs, 1).
    """
    first, *others = division.of_beam(number)
    there: Columns = evaluate(values[:, first], _on_piece(division, first, xi))
    for row in others:
        there = np.where(division.start[row] < xi, evaluate(values[:, row], _on_piece(division, row, xi)), there)
    return there


def _on_piece(division: Division, row: int, xi: Reals | float) -> Columns:
    """Convert xi of a beam to the local coordinate t, which runs from 0 to 1 along a piece."""
    width = division.width[row]
    return (xi - division.start[row]) / np.where(width > 0.0, width, 1.0)
