"""Members: straight runs of collinear beams of a link, each assessed as a single beam.

A beam ends at each load, mass, joint, change of section or corner. A member continues beyond such points, provided that
the corner is so small that it is within drawing accuracy. A member can buckle between its joints.
"""

from collections.abc import Iterator
from functools import cached_property, lru_cache
from itertools import accumulate

import numpy as np
from msgspec import Struct

from elastic.arrays import AtStations, PerBeam
from elastic.links.beam_trees import in_line
from rigid import Beam, Mechanism, structure
from rigid.arrays import Columns, Integers, Reals

# [rad] largest angle between adjacent beams of a member; it allows for the rounding of dimensions in drawings
MAX_MEMBER_ANGLE = 1e-3


class BeamRun(Struct, frozen=True, eq=False):
    """Run: collinear beams that follow one another.

    Attributes
    ----------
    beams
        Indices of the beams.
    turned
        For each beam, True if it points against the direction of the run.
    start, width
        Start and length of each beam, relative to the length of the run, as floats or with shape (designs, 1). The
        length is negative if the beam is `turned`.
    """

    beams: tuple[int, ...]
    turned: tuple[bool, ...]
    start: tuple[Columns, ...]
    width: tuple[Columns, ...]

    def line(self, at: int, first: Columns, last: Columns) -> tuple[Columns, Columns]:
        """Return the line through the displaced ends of the run, in the axes of a beam.

        The line is given by its value at the start of the beam, and its rise along the beam.

        Parameters
        ----------
        first, last
            Transverse deflections at the two ends of the run, each in the axes of the beam at that end.
        """
        begin, end = (-w if turned else w for w, turned in ((first, self.turned[0]), (last, self.turned[-1])))
        sign = -1.0 if self.turned[at] else 1.0
        return sign * (begin + (end - begin) * self.start[at]), sign * (end - begin) * self.width[at]


class BeamRuns(Struct, frozen=True, eq=False, dict=True):
    """Beams of a mechanism, grouped into runs."""

    runs: tuple[BeamRun, ...]

    @cached_property
    def whole(self) -> bool:
        """True if every run is a single beam."""
        return all(len(run.beams) == 1 for run in self.runs)

    @cached_property
    def number(self) -> Integers:
        """Index of the run to which each beam belongs, shape (beams,)."""
        numbers = np.zeros(sum(len(run.beams) for run in self.runs), int)
        for number, run in enumerate(self.runs):
            numbers[[*run.beams]] = number
        return numbers

    def greatest(self, values: PerBeam) -> PerBeam:
        """Return for each beam the largest value in its run, shape (beams, ...)."""
        if self.whole:
            return values
        result = np.array(values)
        for run in self.runs:
            rows = [*run.beams]
            result[rows] = values[rows].max(axis=0)
        return result

    def from_chord(self, w: AtStations, stations: Reals) -> AtStations:
        """Return the deflection from the line through the displaced ends of each run.

        Parameters
        ----------
        w
            Transverse deflection of each beam relative to the rigid link, shape (beams, ..., stations).
        stations
            Values of xi from 0 to 1, shape (stations,).
        """
        chord = w.copy()
        for run in self.runs:
            first, last = (w[run.beams[end], ..., end if not run.turned[end] else -1 - end] for end in (0, -1))
            for at, beam in enumerate(run.beams):
                begin, rise = run.line(at, first, last)
                chord[beam] -= begin[..., None] + rise[..., None] * stations
        return chord


@lru_cache(maxsize=64)
def members_of(mechanism: Mechanism) -> BeamRuns:
    """Group the beams of a mechanism into members."""
    return BeamRuns(tuple(_beam_run(mechanism, chain) for chain in _chains(mechanism)))


@lru_cache(maxsize=64)
def spans_of(mechanism: Mechanism) -> BeamRuns:
    """Divide the members at their joints into spans, which can buckle."""
    joined = {(at, joint.point(at)) for joint in structure(mechanism).joints for at in (joint.parent, joint.child)}
    spans: list[list[tuple[int, bool]]] = []
    for member in members_of(mechanism).runs:
        for place, (number, turned) in enumerate(zip(member.beams, member.turned, strict=True)):
            at, beam = mechanism.beams[number]
            if not place or (at, beam.end if turned else beam.start) in joined:
                spans.append([])
            spans[-1].append((number, turned))
    return BeamRuns(tuple(_beam_run(mechanism, span) for span in spans))


def _beam_run(mechanism: Mechanism, chain: list[tuple[int, bool]]) -> BeamRun:
    lengths = [_length(mechanism, number) for number, _ in chain]
    ends = [*accumulate(lengths, initial=0.0 * lengths[0])]
    turned = tuple(way for _, way in chain)
    start = tuple(ends[at + way] / ends[-1] for at, way in enumerate(turned))
    width = tuple((-length if way else length) / ends[-1] for length, way in zip(lengths, turned, strict=True))
    return BeamRun(tuple(number for number, _ in chain), turned, start, width)


def _length(mechanism: Mechanism, number: int) -> Columns:
    at, beam = mechanism.beams[number]
    return np.abs(mechanism.links[at].points[beam.end] - mechanism.links[at].points[beam.start])


def _chains(mechanism: Mechanism) -> Iterator[list[tuple[int, bool]]]:
    """Yield for each member its beams in order. Each beam has a flag that is True if the beam is reversed.

    The members are in the order of their first beams.
    """
    left = dict(enumerate(mechanism.beams))
    for first in range(len(mechanism.beams)):
        if first not in left:
            continue
        del left[first]
        chain = [(first, False)]
        while follower := _collinear_neighbour(mechanism, chain[-1], left):
            chain.append(follower)
        while follower := _collinear_neighbour(mechanism, (chain[0][0], not chain[0][1]), left):
            chain.insert(0, (follower[0], not follower[1]))
        yield chain


def _collinear_neighbour(
    mechanism: Mechanism, last: tuple[int, bool], left: dict[int, tuple[int, Beam]]
) -> tuple[int, bool] | None:
    """Return the collinear beam that continues another beam, and remove it from `left`."""
    at, beam = mechanism.beams[last[0]]
    points = mechanism.links[at].points
    begin, end = (beam.end, beam.start) if last[1] else (beam.start, beam.end)
    for number in left:
        owner, other = mechanism.beams[number]
        if owner == at and end in (other.start, other.end):
            turned = other.end == end
            far = other.start if turned else other.end
            # only the first design is checked, so that the members do not depend on the other designs
            here, there = (np.ravel(way)[0] for way in (points[end] - points[begin], points[far] - points[end]))
            if in_line(here, there, MAX_MEMBER_ANGLE):
                del left[number]
                return number, turned
    return None
