"""Selection of the range of the drive path in which the branch (assembly of the drawing) is tracked.

The range is the requested one, with one exception. If the mechanism returns to its first posture after a few turns of
the drive, tracking these turns is sufficient.
"""

from typing import Any

import numpy as np
from msgspec.structs import replace

from rigid.arrays import Reals
from rigid.decomposition.groups import Structure
from rigid.mechanism import Mechanism
from rigid.positions.branch import TrackedBranch
from rigid.positions.drive_path import KNOTS_PER_EXTENSION, PLACE_TOLERANCE, Path, drawn_drives
from rigid.positions.knots import knots_before
from rigid.positions.trace import Trace

RETURN_TURNS = (1, 2, 4, 8)  # numbers of drive turns after which the posture is compared with the first posture
# two postures are equal if the unit vectors of all links, and their origins in units of the mechanism size, differ by
# less than this
POSTURE_TOLERANCE = 1e-7


def _tracked(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float
) -> TrackedBranch:
    """Track the branch of all groups on the path between the parameters `low` and `high`."""
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
    """Track the branch through the requested positions, and return it with the path parameter of each position.

    The drive moves directly from the drawing to each position. Positions beyond a limit of motion are nan. A turning
    drive moves to the first position by at most half a turn. If a limit of motion prevents this, it turns the other
    way. If this is also impossible, the path starts within the requested range instead: at the drawn angle plus a
    number of full turns, as close as possible to the first position.
    """
    if path.vertices is not None:
        return _tracked(mechanism, structure, path, 0.0, 0.0, forms, edge), path.requested
    cache = _branches_of(mechanism)
    begin, block = path.begin, KNOTS_PER_EXTENSION * path.stride
    if path.turn and (turns := np.round((begin - drawn_drives(mechanism)[0][0]) / path.turn)):
        # start from the drawn coordinate without full turns, so that the cached branch can be used whatever turn is
        # requested
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
        # equal postures are finite, so the branch has no end in between
        if _is_closed_cycle(whole, begin, begin + period):
            return whole, begin + np.mod(path.requested - begin, period)
    branch = _branch_over_request(mechanism, structure, path, forms, edge, cache)
    if path.turn and _ends_within(branch) and not _is_known_at(branch, path.outline[0]):
        for other in _other_starts(path):
            other_branch = _branch_over_request(mechanism, structure, other, forms, edge, cache)
            if _is_known_at(other_branch, other.outline[0]) or other.outline[1] <= begin <= other.outline[2]:
                return other_branch, other.requested
    return branch, path.requested


def _other_starts(path: Path) -> list[Path]:
    """Return alternative paths, which start at the drawn angle plus a positive or negative number of full turns.

    On the first path, the drive approaches the first position from the other side. The second path starts within the
    requested range, as close as possible to the first position. It exists only if the range contains such a start.
    """
    begin, turn = path.begin, path.turn
    first, least, most = path.outline
    passed = turn * np.arange(np.ceil((least - begin) / turn), np.floor((most - begin) / turn) + 1)
    passed = passed[np.argsort(np.abs(begin + passed - first), kind="stable")][:1]
    return [replace(path.shifted(shift), begin=begin) for shift in (turn * np.sign(first - begin), *passed)]


def _branch_over_request(
    mechanism: Mechanism, structure: Structure, path: Path, forms: Any, edge: float, cache: Any
) -> TrackedBranch:
    """Track the branch from the drawing through the requested positions.

    The tracked range extends from the drawing by multiples of `KNOTS_PER_EXTENSION` knots.
    """
    begin, block = path.begin, KNOTS_PER_EXTENSION * path.stride
    low, high = path.span
    below, above = (np.ceil(max(distance, 0.0) / block) * block for distance in (begin - low, high - begin))
    return _cached_branch(
        mechanism, structure, path, begin - below, begin + (above if below else above or block), forms, edge, cache
    )


def _is_known_at(branch: TrackedBranch, place: float) -> bool:
    """Return whether, for at least one design, the mechanism closes at one of the two knots next to a point."""
    at = knots_before(branch.table, np.array([place]), branch.rows)[:, 0]
    closes = np.isfinite(branch.table["sine"]).all(axis=1)
    inside = (branch.table["place"][at] <= place + PLACE_TOLERANCE) & (
        place - PLACE_TOLERANCE <= branch.table["place"][at + 1]
    )
    return bool((inside & (closes[at] | closes[at + 1])).any())


def _is_closed_cycle(branch: TrackedBranch, first: float, last: float) -> bool:
    """Return whether, for every design, the postures at two points on the path are equal."""
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


def _ends_within(branch: TrackedBranch) -> bool:
    """Return whether a branch ends at a limit of motion within the tracked range."""
    return bool(np.isnan(branch.table["sine"]).any())


_latest: list[dict[Any, TrackedBranch]] = [{}]
"""Branch cache of the last mechanism with several designs.

It is cleared when the next mechanism with several designs is computed, to save memory.
"""


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
