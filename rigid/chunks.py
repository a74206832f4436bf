"""Computation of motions in chunks that fit into the cache, for any number of positions and designs."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from msgspec.structs import replace

from rigid.arrays import ArrayLike, Reals
from rigid.kinematics import Motion, drive_arrays, motion
from rigid.mechanism import Mechanism
from rigid.parts import Link
from rigid.positions.drive_path import drawn_drives, outline
from rigid.positions.rows import select_designs

CACHE_CELLS = 24576  # number of moving links times columns that fits into the cache
MIN_COLUMNS = 1024  # size of a chunk below which call overhead dominates
SEAM_POSITIONS = 3  # positions at the end of a chunk that the path of the next chunk repeats, to detect a change point
MIN_SINE = 1e-2  # smallest sine at which a position identifies the branch reliably


def motion_in_chunks(
    mechanism: Mechanism,
    drive: ArrayLike,
    drive_rate: ArrayLike = 0.0,
    drive_acceleration: ArrayLike = 0.0,
    time: ArrayLike | None = None,
    columns: int | None = None,
) -> Iterator[Motion]:
    """Compute a motion in chunks, with memory that does not depend on the number of positions and designs.

    Each chunk continues on the branch of the previous one. Loads that depend on the number of turns of a link start at
    zero turns in each chunk.

    Parameters
    ----------
    mechanism, drive, drive_rate, drive_acceleration, time
        See `motion`.
    columns
        Approximate number of columns per chunk (positions, or designs times positions). A chunk has at least one
        design. By default a chunk fits into the cache, but has at least 1024 columns.

    Yields
    ------
    Motions of as many designs as fit, with the positions of each design in order.

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
    if columns <= SEAM_POSITIONS:
        raise ValueError(f"chunks of {columns} columns, expected more than {SEAM_POSITIONS}")
    for rows in design_chunks(mechanism.designs, len(given[-1]), columns):
        yield from _position_chunks(select_designs(mechanism, rows, mechanism.designs), given, columns)


def columns_of(mechanism: Mechanism, positions: int) -> int:
    """Return the number of columns per chunk (about 8,000 for a four-bar, 2,000 for thirteen bars)."""
    columns = max(CACHE_CELLS // max(len(mechanism.links) - 1, 1), MIN_COLUMNS)
    chunks = max(round(positions / columns), 1)
    return max(columns, -(-positions // chunks))


def design_chunks(designs: tuple[int, ...], positions: int, columns: int) -> Iterator[slice]:
    """Yield slices of the designs to compute together. A single design yields one slice."""
    count = designs[0] if designs else 1
    step = max(columns // max(positions, 1), 1)
    for first in range(0, count, step):
        yield slice(first, min(first + step, count))


def _position_chunks(mechanism: Mechanism, given: tuple[Reals, ...], columns: int) -> Iterator[Motion]:
    """Yield the motion in chunks of positions, in order.

    With a single drive, the drawing and the drive coordinate determine each position. With several drives, the path
    matters. The drawing is then replaced by the end of the previous chunk.
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
        path = None if lead is None else lead - turns
        chunk = [replace(motion(drawn, drive - turns, rate, rate2, time, lead=path), mechanism=mechanism, drive=drive)]
        if first + columns < given[0].shape[-1]:
            drawn, lead = _redrawn(drawn, lead, chunk[0])
        yield chunk.pop()  # drop the reference, so that the chunk does not displace the next one from the cache


def _redrawn(drawn: Mechanism, lead: Reals | None, passed: Motion) -> tuple[Mechanism, Reals]:
    """Return the mechanism redrawn at the last reliable position of a chunk, and the drive path from there."""
    sine = passed.sine
    reliable: Any = (np.reshape(sine, (-1, sine.shape[-1])) > MIN_SINE).all(axis=0)
    places = np.flatnonzero(reliable[:-SEAM_POSITIONS])
    if not len(places):
        return drawn, passed.drive if lead is None else np.concatenate([lead, passed.drive], axis=1)
    last = places[-1]
    drawing = {}
    for at, link in reversed(list(enumerate(drawn.links))):
        for point in _identifying_points(link, drawn):
            place = passed.origin[at, ..., last] + passed.direction[at, ..., last] * link.points[point]
            drawing[point] = complex(np.ravel(place)[0])
    return replace(drawn, drawing=drawing), passed.drive[:, last:]


def _identifying_points(link: Link, drawn: Mechanism) -> list[str]:
    """Return the drawn points of a link, plus another point if there is only one, so that the angle is defined."""
    points = [point for point in link.points if point in drawn.drawing]
    if len(points) == 1:
        points += [point for point, local in link.points.items() if np.all(local != link.points[points[0]])][:1]
    return points


def _whole_turns(drawn: Mechanism, start: Reals) -> Reals:
    """Return the full turns of the drives since the drawing, (drives, 1), so that gears do not count them twice."""
    if not drawn.gears:
        return np.zeros((len(start), 1))
    at, slides, _ = drawn_drives(drawn)
    return np.where(slides, 0.0, 2 * np.pi * np.round((start - at) / (2 * np.pi)))[:, None]
