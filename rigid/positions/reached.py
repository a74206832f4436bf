"""Range over which a mechanism is tracked from its drawing: as requested, or the turns of a closed cycle."""

from dataclasses import replace
from typing import Any

import numpy as np

from rigid.arrays import Reals
from rigid.decomposition.groups import Structure
from rigid.mechanism import Mechanism
from rigid.positions.branch import TrackedBranch
from rigid.positions.drive_path import KNOTS_PER_EXTENSION, PLACE_TOLERANCE, Path, drawn_drives
from rigid.positions.knots import located
from rigid.positions.trace import Trace

RETURN_TURNS = (1, 2, 4, 8)  # turns of the drive after which a mechanism may return to its first posture
POSTURE_TOLERANCE = 1e-7  # tolerance of an equal posture, relative to the size and in unit vectors


def _followed(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float
) -> TrackedBranch:
    """Track all groups along the path between two points."""
    branch = TrackedBranch(mechanism, structure, path, low, high, forms, edge)
    for number, group in enumerate(structure.groups):
        branch.enter(number)
        branch.measure(group)
        if not group.free:
            branch.set(branch.table, number)
            branch.table[f"sure{number}"][:] = True
        elif forms[number]:
            branch.follow_dyad(number)
        else:
            Trace(branch, number).run()
    return branch


def branch_through(
    mechanism: Mechanism, structure: Structure, path: Path, forms: Any, edge: float
) -> tuple[TrackedBranch, Reals]:
    """Track the branch as far as the requested positions; return it and their locations on it.

    The drive goes straight from the drawing to a position; positions beyond a limit of motion are unknown. The first
    position is reached the shorter way round, or else the longer way. If both are blocked, the drive starts within the
    requested range, at the drawn angle (plus whole turns) nearest to the first position.
    """
    if path.vertices is not None:
        return _followed(mechanism, structure, path, 0.0, 0.0, forms, edge), path.requested
    kept = _branches_of(mechanism)
    begin, block = path.begin, KNOTS_PER_EXTENSION * path.stride
    if path.turn and (turns := np.round((begin - drawn_drives(mechanism)[0][0]) / path.turn)):
        # the drawing's own coordinate, so that the result can be reused for any turn
        path = path.shifted(path.turn * turns)
        begin = path.begin
    low, high = map(float, path.span)
    sense = 1.0 if high - begin >= begin - low else -1.0
    for turns in RETURN_TURNS if path.turn and high - low > path.turn - block else ():
        period = sense * turns * path.turn
        ends = min(begin, begin + period), max(begin, begin + period)
        whole = _cached_branch(mechanism, structure, path, *ends, forms, edge, kept)
        if whole.closed(int(sense)):
            break
        if _is_closed_cycle(
            whole, begin, begin + period
        ):  # positions beyond an end are nan, so there is no end in between
            return whole, begin + np.mod(path.requested - begin, period)
    branch = _branch_over_request(mechanism, structure, path, forms, edge, kept)
    if path.turn and _ends(branch) and not _is_known_at(branch, path.outline[0]):
        for other in _other_starts(path):
            found = _branch_over_request(mechanism, structure, other, forms, edge, kept)
            if _is_known_at(found, other.outline[0]) or other.outline[1] <= begin <= other.outline[2]:
                return found, other.requested
    return branch, path.requested


def _other_starts(path: Path) -> list[Path]:
    """Paths that start whole turns away from the drawing, if the shorter way to the first position is blocked.

    One starts on the other side of the first position, one within the requested range and nearest to this position.
    """
    begin, turn = path.begin, path.turn
    first, least, most = path.outline
    passed = turn * np.arange(np.ceil((least - begin) / turn), np.floor((most - begin) / turn) + 1)
    passed = passed[np.argsort(np.abs(begin + passed - first), kind="stable")][:1]
    return [replace(path.shifted(shift), begin=begin) for shift in (turn * np.sign(first - begin), *passed)]


def _branch_over_request(
    mechanism: Mechanism, structure: Structure, path: Path, forms: Any, edge: float, kept: Any
) -> TrackedBranch:
    """Track the branch from the drawing as far as the requested positions, in blocks of knots."""
    begin, block = path.begin, KNOTS_PER_EXTENSION * path.stride
    low, high = path.span
    below, above = (np.ceil(max(way, 0.0) / block) * block for way in (begin - low, high - begin))
    return _cached_branch(
        mechanism, structure, path, begin - below, begin + (above if below else above or block), forms, edge, kept
    )


def _is_known_at(branch: TrackedBranch, place: float) -> bool:
    """True if the branch of some design is known at a knot next to a point."""
    at = located(branch.table, np.array([place]), branch.rows)[:, 0]
    closes = np.isfinite(branch.table["sine"]).all(axis=1)
    inside = (branch.table["place"][at] <= place + PLACE_TOLERANCE) & (
        place - PLACE_TOLERANCE <= branch.table["place"][at + 1]
    )
    return bool((inside & (closes[at] | closes[at + 1])).any())


def _is_closed_cycle(branch: TrackedBranch, first: float, last: float) -> bool:
    """True if all designs have equal postures at two points."""
    place, to = branch.table["place"], np.array([first, last])
    at = located(branch.table, to + PLACE_TOLERANCE, branch.rows)
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
    """True if a branch ends on the path."""
    return bool(np.isnan(branch.table["sine"]).any())


_latest: list[dict[Any, TrackedBranch]] = [{}]
"""Branches of the latest mechanism with many designs; earlier ones would fill the memory of a sweep."""


def _branches_of(mechanism: Mechanism) -> dict[Any, TrackedBranch]:
    """Return the cache of branches of a mechanism."""
    kept: dict[Any, TrackedBranch] = mechanism.__dict__.setdefault("_branches", {})
    if mechanism.designs and kept is not _latest[0]:
        _latest[0].clear()
        _latest[0] = kept
    return kept


def _cached_branch(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float, kept: Any
) -> TrackedBranch:
    """Return the branch between two places, from the cache if possible."""
    branch: TrackedBranch | None = kept.get((forms, edge))
    if branch is not None:
        if branch.low <= low + PLACE_TOLERANCE or branch.closed(-1):
            low = branch.low
        if high - PLACE_TOLERANCE <= branch.high or branch.closed(1):
            high = branch.high
        if (low, high) == (branch.low, branch.high):
            return branch
        low, high = min(low, branch.low), max(high, branch.high)
    branch = kept[forms, edge] = _followed(mechanism, structure, path, low, high, forms, edge)
    return branch
