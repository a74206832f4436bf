"""Motions of any number of positions and designs, in chunks that stay in the cache."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rigid.arrays import ArrayLike, Reals
from rigid.drive_arrays import drive_arrays
from rigid.kinematics import Motion, motion
from rigid.mechanism import Mechanism
from rigid.parts import Link
from rigid.positions.drive_path import drawn_drives, outline
from rigid.positions.rows import select_designs

CELLS = 24576  # links times columns that stay in the cache
COLUMNS = 1024  # below which what calls cost alone counts for more than that
SEAM = 3  # positions of the chunk before that are passed again, so that a change point at the seam is seen
FIRM = 1e-2  # sine below which a position does not tell the branch well


def motion_in_chunks(
    mechanism: Mechanism,
    drive: ArrayLike,
    drive_rate: ArrayLike = 0.0,
    drive_acceleration: ArrayLike = 0.0,
    time: ArrayLike | None = None,
    columns: int | None = None,
) -> Iterator[Motion]:
    """The same as `motion`, a chunk at a time: memory does not grow with the positions or designs.

    Every chunk of positions goes on, on the branch on which the one before it ended. Loads that count the turns of a
    link count them from the start of every chunk.

    Parameters
    ----------
    mechanism, drive, drive_rate, drive_acceleration, time
        As for `motion`.
    columns
        Positions, or designs times positions, in a chunk: about so many, and at least one design. Left out, as many as
        stay in the cache, and 1024 at least.

    Yields
    ------
    Motions, design by design as many at a time as fit, and of every design its positions in order.

    Examples
    --------
    >>> from rigid import Link, Mechanism, PinDrive, motion_in_chunks
    >>> links = (Link("ground", {"O": 0}), Link("crank", {"O": 0, "A": 1.0}))
    >>> turning = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": 1})
    >>> [len(chunk.time) for chunk in motion_in_chunks(turning, [0.1 * k for k in range(20)], columns=8)]
    [8, 8, 4]
    """
    given = drive_arrays(mechanism, drive, drive_rate, drive_acceleration, time)
    columns = columns_of(mechanism, len(given[-1])) if columns is None else columns
    if columns <= SEAM:
        raise ValueError(f"chunks of {columns} columns, expected more than {SEAM}")
    for rows in design_chunks(mechanism.designs, len(given[-1]), columns):
        yield from _along(select_designs(mechanism, rows, mechanism.designs), given, columns)


def columns_of(mechanism: Mechanism, positions: int) -> int:
    """Columns of a chunk: some 8,000 of a four-bar, 2,000 of thirteen bars; a few more rather than a small rest."""
    columns = max(CELLS // max(len(mechanism.links) - 1, 1), COLUMNS)
    chunks = max(round(positions / columns), 1)
    return max(columns, -(-positions // chunks))


def design_chunks(designs: tuple[int, ...], positions: int, columns: int) -> Iterator[slice]:
    """Rows of the designs that go together; once everything where there is but one design."""
    count = designs[0] if designs else 1
    step = max(columns // max(positions, 1), 1)
    for first in range(0, count, step):
        yield slice(first, min(first + step, count))


def _along(mechanism: Mechanism, given: tuple[Reals, ...], columns: int) -> Iterator[Motion]:
    """The positions in order.

    Of a single drive every place on its way is known from the drawing; of several the chunk before tells the way, and
    every chunk is drawn anew where the last one ended.
    """
    if len(given[0]) == 1:
        whole = outline(given[0])
        for first in range(0, given[0].shape[-1], columns):
            drive, rate, rate2, time = (value[..., first : first + columns] for value in given)
            yield motion(mechanism, drive, rate, rate2, time, lead=whole)
        return
    drawn = mechanism
    lead: Any = None
    for first in range(0, given[0].shape[-1], columns):
        drive, rate, rate2, time = (value[..., first : first + columns] for value in given)
        turns = 0.0 if drawn is mechanism else _whole_turns(drawn, lead[:, 0])
        way = None if lead is None else lead - turns
        chunk = [replace(motion(drawn, drive - turns, rate, rate2, time, lead=way), mechanism=mechanism, drive=drive)]
        if first + columns < given[0].shape[-1]:
            drawn, lead = _drawn_anew(drawn, lead, chunk[0])
        yield chunk.pop()  # kept, it would crowd the next one out of the cache


def _drawn_anew(drawn: Mechanism, lead: Reals | None, passed: Motion) -> tuple[Mechanism, Reals]:
    """The mechanism drawn at the last firm position before the seam, and the drive's way from there to the seam."""
    sine = passed.sine
    firm: Any = (np.reshape(sine, (-1, sine.shape[-1])) > FIRM).all(axis=0)
    places = np.flatnonzero(firm[:-SEAM])
    if not len(places):
        return drawn, passed.drive if lead is None else np.concatenate([lead, passed.drive], axis=1)
    last = places[-1]
    drawing = {}
    for at, link in reversed(list(enumerate(drawn.links))):
        for point in _telling(link, drawn):
            place = passed.origin[at, ..., last] + passed.direction[at, ..., last] * link.points[point]
            drawing[point] = complex(np.ravel(place)[0])
    return replace(drawn, drawing=drawing), passed.drive[:, last:]


def _telling(link: Link, drawn: Mechanism) -> list[str]:
    """Points of a link that are drawn, and one more where a single one does not tell how the link stands."""
    points = [point for point in link.points if point in drawn.drawing]
    if len(points) == 1:
        points += [point for point, local in link.points.items() if np.all(local != link.points[points[0]])][:1]
    return points


def _whole_turns(drawn: Mechanism, start: Reals) -> Reals:
    """Whole turns of the drives beyond the drawing, shape (drives, 1): gears would count them once more."""
    if not drawn.gears:
        return np.zeros((len(start), 1))
    at, slides, _ = drawn_drives(drawn)
    return np.where(slides, 0.0, 2 * np.pi * np.round((start - at) / (2 * np.pi)))[:, None]
