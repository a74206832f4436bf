"""Range in which the branch is tracked from the drawing: the requested range, or the turns of a closed cycle."""

from dataclasses import replace
from typing import Any

import numpy as np

from rigid.arrays import Reals
from rigid.decomposition.groups import Structure
from rigid.mechanism import Mechanism
from rigid.positions.branch import TrackedBranch
from rigid.positions.drive_path import KNOTS_PER_EXTENSION, PLACE_TOLERANCE, Path, drawn_drives
from rigid.positions.knots import knots_before
from rigid.positions.trace import Trace

RETURN_TURNS = (1, 2, 4, 8)  # numbers of drive turns to try for a return to the first posture
POSTURE_TOLERANCE = 1e-7  # difference between equal postures: of origins / size, or of unit vectors


def _tracked(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float
) -> TrackedBranch:
    """Track all groups on the path between two points."""
    branch = TrackedBranch(mechanism, structure, path, low, high, forms, edge)
    for number, group in enumerate(structure.groups):
        branch.add_group(number)
        branch.measure(group)
        if not group.free:
            branch.set(branch.table, number)
            branch.table[f"certain{number}"][:] = True
        elif forms[number]:
            branch.follow_dyad(number)
        else:
            Trace(branch, number).run()
    return branch


def branch_through(
    mechanism: Mechanism, structure: Structure, path: Path, forms: Any, edge: float
) -> tuple[TrackedBranch, Reals]:
    """Track the branch through the requested positions, and return it with the path parameters of the positions.

    The drive moves directly from the drawing to each position. Positions beyond a limit of motion are unknown. The
    drive reaches the first position the shorter way round, or if this way is blocked, the longer way round. If both are
    blocked, it starts within the requested range, at the drawn angle plus whole turns that is closest to the first
    position.
    """
    if path.vertices is not None:
        return _tracked(mechanism, structure, path, 0.0, 0.0, forms, edge), path.requested
    cache = _branches_of(mechanism)
    begin, block = path.begin, KNOTS_PER_EXTENSION * path.stride
    if path.turn and (turns := np.round((begin - drawn_drives(mechanism)[0][0]) / path.turn)):
        # start from the drawn coordinate, so that the cached branch can be used for any turn
        path = path.shifted(path.turn * turns)
        begin = path.begin
    low, high = map(float, path.span)
    sense = 1.0 if high - begin >= begin - low else -1.0
    for turns in RETURN_TURNS if path.turn and high - low > path.turn - block else ():
        period = sense * turns * path.turn
        ends = min(begin, begin + period), max(begin, begin + period)
        whole = _cached_branch(mechanism, structure, path, *ends, forms, edge, cache)
        if whole.closed(int(sense)):
            break
        if _is_closed_cycle(whole, begin, begin + period):  # the branch has no end in between, where it would be nan
            return whole, begin + np.mod(path.requested - begin, period)
    branch = _branch_over_request(mechanism, structure, path, forms, edge, cache)
    if path.turn and _ends(branch) and not _is_known_at(branch, path.outline[0]):
        for other in _other_starts(path):
            other_branch = _branch_over_request(mechanism, structure, other, forms, edge, cache)
            if _is_known_at(other_branch, other.outline[0]) or other.outline[1] <= begin <= other.outline[2]:
                return other_branch, other.requested
    return branch, path.requested


def _other_starts(path: Path) -> list[Path]:
    """Return alternative paths that start whole turns away, if the shorter way to the first position is blocked.

    The first path starts on the other side of the first position. The second path, if any, starts within the requested
    range, as close as possible to the first position.
    """
    begin, turn = path.begin, path.turn
    first, least, most = path.outline
    passed = turn * np.arange(np.ceil((least - begin) / turn), np.floor((most - begin) / turn) + 1)
    passed = passed[np.argsort(np.abs(begin + passed - first), kind="stable")][:1]
    return [replace(path.shifted(shift), begin=begin) for shift in (turn * np.sign(first - begin), *passed)]


def _branch_over_request(
    mechanism: Mechanism, structure: Structure, path: Path, forms: Any, edge: float, cache: Any
) -> TrackedBranch:
    """Track the branch from the drawing through the requested positions, in whole blocks of knots."""
    begin, block = path.begin, KNOTS_PER_EXTENSION * path.stride
    low, high = path.span
    below, above = (np.ceil(max(distance, 0.0) / block) * block for distance in (begin - low, high - begin))
    return _cached_branch(
        mechanism, structure, path, begin - below, begin + (above if below else above or block), forms, edge, cache
    )


def _is_known_at(branch: TrackedBranch, place: float) -> bool:
    """Return whether the branch of any design is known at a knot next to a point."""
    at = knots_before(branch.table, np.array([place]), branch.rows)[:, 0]
    closes = np.isfinite(branch.table["sine"]).all(axis=1)
    inside = (branch.table["place"][at] <= place + PLACE_TOLERANCE) & (
        place - PLACE_TOLERANCE <= branch.table["place"][at + 1]
    )
    return bool((inside & (closes[at] | closes[at + 1])).any())


def _is_closed_cycle(branch: TrackedBranch, first: float, last: float) -> bool:
    """Return whether the postures at two points are equal for all designs."""
    place, to = branch.table["place"], np.array([first, last])
    at = knots_before(branch.table, to + PLACE_TOLERANCE, branch.rows)
    ends = np.where(np.abs(place[at + 1] - to) < np.abs(place[at] - to), at + 1, at)
    at_begin, at_end = (
        {name: branch.table[name][ends[:, k]] for name in ("origin", "direction", "sign")} for k in (0, 1)
    )
    size = branch.mechanism.size
    away = [
        np.abs(at_begin["origin"] - at_end["origin"]).max() / size,
        np.abs(at_begin["direction"] - at_end["direction"]).max(),
    ]
    return bool(max(away) < POSTURE_TOLERANCE and (at_begin["sign"] == at_end["sign"]).all())


def _ends(branch: TrackedBranch) -> bool:
    """Return whether a branch ends on the path."""
    return bool(np.isnan(branch.table["sine"]).any())


_latest: list[dict[Any, TrackedBranch]] = [{}]
"""Branches of the latest mechanism with many designs. Others are discarded, because they would fill the memory."""


def _branches_of(mechanism: Mechanism) -> dict[Any, TrackedBranch]:
    """Return the branch cache of a mechanism."""
    cache: dict[Any, TrackedBranch] = mechanism.__dict__.setdefault("_branches", {})
    if mechanism.designs and cache is not _latest[0]:
        _latest[0].clear()
        _latest[0] = cache
    return cache


def _cached_branch(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float, cache: Any
) -> TrackedBranch:
    """Return the branch between two points, from the cache if possible."""
    branch: TrackedBranch | None = cache.get((forms, edge))
    if branch is not None:
        if branch.low <= low + PLACE_TOLERANCE or branch.closed(-1):
            low = branch.low
        if high - PLACE_TOLERANCE <= branch.high or branch.closed(1):
            high = branch.high
        if (low, high) == (branch.low, branch.high):
            return branch
        low, high = min(low, branch.low), max(high, branch.high)
    branch = cache[forms, edge] = _tracked(mechanism, structure, path, low, high, forms, edge)
    return branch
