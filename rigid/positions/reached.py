"""The range a mechanism is followed over from its drawing: that asked for, or the turns after which it repeats."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.decomposition.groups import Structure
from rigid.mechanism import Mechanism
from rigid.positions.branch import Branch
from rigid.positions.drive_path import BLOCK, STILL, Path, drawn_drives, size_of
from rigid.positions.knots import located
from rigid.positions.trace import Trace

TURNS = (1, 2, 4, 8)  # of the drive, after which a mechanism may be where it was
SAME = 1e-7  # of the size, and of a unit vector


def _followed(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float
) -> Branch:
    """All groups followed along the way between two places."""
    branch = Branch(mechanism, structure, path, low, high, forms, edge)
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
) -> tuple[Branch, Any]:
    """The branch of a mechanism, as far as the positions asked go, and these on it."""
    if path.vertices is not None:
        return _followed(mechanism, structure, path, 0.0, 0.0, forms, edge), path.asked
    kept = mechanism.__dict__.setdefault("_branches", {})
    low, high = map(float, path.span)
    begin, block = path.begin, BLOCK * path.stride
    if path.turn:
        # The drawing's own coordinate: what is known of it serves whatever turn is asked.
        shift = path.turn * np.round((begin - drawn_drives(mechanism)[0][0]) / path.turn)
        path = Path(begin - shift, path.asked - shift, path.stride, path.turn)
        begin, low, high = path.begin, low - shift, high - shift
    for turns in TURNS if path.turn and high - low > path.turn - block else ():
        whole = _known(mechanism, structure, path, begin, begin + turns * path.turn, forms, edge, kept)
        if not _returns(whole, begin, begin + turns * path.turn):
            if _ends(whole):
                return _from_both_sides(mechanism, structure, path, forms, edge, kept)
            continue
        return whole, begin + np.mod(path.asked - begin, turns * path.turn)
    low, high = min(low, begin), max(high, begin)
    below, above = (np.ceil(way / block) * block for way in (begin - low, high - begin))
    above = above or block
    found = _known(mechanism, structure, path, begin - below, begin + above, forms, edge, kept)
    lost = np.isnan(found.table["sine"]).any(axis=1)
    at = located(found.table, path.asked, found.rows)
    if path.turn and (lost[at] | lost[at + 1]).any():
        return _from_both_sides(mechanism, structure, path, forms, edge, kept)
    return found, path.asked


def _returns(branch: Branch, first: float, last: float) -> bool:
    """Whether all designs are at one place as they are at another, all places between being reached."""
    if _ends(branch):
        return False
    place, to = branch.table["place"], np.array([first, last])
    at = located(branch.table, to + STILL, branch.rows)
    ends = np.where(np.abs(place[at + 1] - to) < np.abs(place[at] - to), at + 1, at)
    one, other = ({name: branch.table[name][ends[:, k]] for name in ("origin", "direction", "sign")} for k in (0, 1))
    size = size_of(branch.mechanism)
    away = [np.abs(one["origin"] - other["origin"]).max() / size, np.abs(one["direction"] - other["direction"]).max()]
    return bool(max(away) < SAME and (one["sign"] == other["sign"]).all())


def _ends(branch: Branch) -> bool:
    """Whether a branch ends somewhere on the way."""
    return bool(np.isnan(branch.table["sine"]).any())


def _from_both_sides(
    mechanism: Mechanism, structure: Structure, path: Path, forms: Any, edge: float, kept: Any
) -> tuple[Branch, Any]:
    """A branch that ends before a whole turn, and the positions asked on it, as they are reached from the drawing."""
    begin, turn = path.begin, path.turn
    branch = _known(mechanism, structure, path, begin - turn, begin + turn, forms, edge, kept)
    above = begin + np.mod(path.asked - begin, turn)
    lost = np.isnan(branch.table["sine"]).any(axis=1)
    gone, there = (
        lost[at] | lost[at + 1] for at in (located(branch.table, x, branch.rows) for x in (above, above - turn))
    )
    return branch, np.where(gone & ~there, above - turn, above)


def _known(
    mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float, kept: Any
) -> Branch:
    """The branch from one place to another, made once."""
    branch: Branch | None = kept.get((forms, edge))
    if branch is None or not (branch.low <= low + STILL and high - STILL <= branch.high):
        if branch is not None:
            low, high = min(low, branch.low), max(high, branch.high)
        branch = kept[forms, edge] = _followed(mechanism, structure, path, low, high, forms, edge)
    return branch
