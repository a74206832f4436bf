"""A group that no closed form covers, followed along the knots of a branch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rigid.positions.drive_path import FINEST
from rigid.positions.knots import Table, merged, some, steps

if TYPE_CHECKING:
    from rigid.positions.branch import Branch

BESIDE = 0.02  # of a stride: how far beside a change point the branches are told apart
SMOOTH = 0.1  # of the way to there: how far from smooth the branch may go on
TRIES = 24  # to go on from where a walk went astray
MOST = 400  # steps of a march


class Trace:
    """The knots of a branch with one group followed through them."""

    def __init__(self, branch: Branch, number: int) -> None:
        self.branch, self.number = branch, number
        self.group = branch.structure.groups[number]

    def run(self) -> None:
        """Walk from the drawing, make it certain, and go on from where that went astray or came to an end."""
        branch = self.branch
        coarse = np.flatnonzero(branch.table["coarse"]).reshape(branch.rows, -1)
        begin = int(np.abs(branch.table["place"][coarse[0]] - branch.path.begin).argmin())
        drawn = np.array([branch.drawing.coordinate(self.group.tree[at]) for at in self.group.free])
        start = np.repeat(drawn[:, None], branch.rows, axis=1)
        for way in (1, -1):
            self._walk(coarse[:, begin::way], start)
        self._fill(np.flatnonzero(~branch.table["coarse"]))
        branch._refine(self.number)
        for row in range(branch.rows):
            for way in (1, -1):
                self._mend(row, way)

    def _place(self, which: Any, guess: Any) -> Any:
        """Place the group at knots of the table; its coordinates, shape (free, knots)."""
        part = some(self.branch.table, which)
        self.branch._set(part, self.number, guess)
        for name, value in part.items():
            self.branch.table[name][which] = value
        return part[f"free{self.number}"].T

    def _walk(self, order: Any, start: Any) -> None:
        """Place the group at knots, shape (designs, n), one after the other, each begun on the line through two."""
        last = guess = start
        seen = 0
        place = self.branch.table["place"]
        for k in range(order.shape[1]):
            here = self._place(order[:, k], guess)
            reached = np.isfinite(here).all(axis=0)
            if not reached.any():
                break
            here = np.where(reached, self._whole(here, last), last)
            ahead = 0.0
            if seen and k + 1 < order.shape[1]:
                before, now, after = (place[order[0, at]] for at in (k - 1, k, k + 1))
                ahead = (after - now) / (now - before)
            guess = here + ahead * (here - last)
            last = here
            seen += 1

    def _whole(self, here: Any, near: Any) -> Any:
        """The same angles, near others."""
        turns = np.array([self.group.tree[at].slider is None for at in self.group.free])[:, None]
        return np.where(turns, here - 2 * np.pi * np.round((here - near) / (2 * np.pi)), here)

    def _fill(self, which: Any) -> None:
        """Place the group at knots between coarse ones."""
        if not len(which):
            return
        table = self.branch.table
        coarse = np.flatnonzero(table["coarse"])
        after = np.searchsorted(coarse, which)
        low, high = some(table, coarse[after - 1]), some(table, coarse[after])
        part = (table["place"][which] - low["place"]) / (high["place"] - low["place"])
        self._place(which, (low[f"free{self.number}"] + part[:, None] * self.branch.ways(self.number, low, high)).T)

    def _mend(self, row: int, way: int) -> None:
        """Go outward from the drawing and see to every run of steps that are not certain."""
        branch, number = self.branch, self.number
        passed = branch.path.begin
        for _ in range(TRIES):
            table = branch.table
            first = self._next(row, way, passed)
            if first is None:
                return
            inner, outer = first
            stop = table["place"][outer]
            if abs(stop - table["place"][inner]) <= branch.reach_of_change and self._smooth(row, way, inner, outer):
                passed = stop
                continue
            found = self._march(row, way, inner)
            if found is None:
                break
            passed = table["place"][inner]
        else:
            inner = self._next(row, way, passed)[0] if self._next(row, way, passed) else None
            if inner is None:
                return
        self._end(row, way, inner)

    def _next(self, row: int, way: int, passed: float) -> tuple[int, int] | None:
        """Inner and outer knot of the next run of steps that are not certain, outward of a place."""
        table = self.branch.table
        place = table["place"]
        for first, last in self.branch.doubtful(self.number)[::way]:
            inner, outer = (first, last) if way > 0 else (last, first)
            if table["row"][first] == row and (place[outer] - passed) * way > 1e-15:
                if (place[inner] - self.branch.path.begin) * way >= -1e-15:
                    return inner, outer
        return None

    def _single(self, row: int, place: float, like: int, guess: Any) -> Table:
        """A knot of one design anywhere, with the group placed from a guess and those before it from the knots."""
        branch = self.branch
        at = branch.before(row, place)
        low, high = some(branch.table, [at]), some(branch.table, [at + 1])
        part = (place - low["place"]) / (high["place"] - low["place"])
        knot = some(low, slice(None))
        knot["place"], knot["coarse"] = np.array([place]), np.zeros(1, bool)
        knot["led"] = low["led"] + part[:, None] * (high["led"] - low["led"])
        for k in range(self.number):
            if branch.structure.groups[k].free and not branch.forms[k]:
                branch._set(knot, k, (low[f"free{k}"] + part[:, None] * branch.ways(k, low, high)).T)
            else:
                branch._set(knot, k)
        if guess is None:
            guess = (low[f"free{self.number}"] + part[:, None] * branch.ways(self.number, low, high)).T
        branch._set(knot, self.number, guess)
        knot[f"sure{self.number}"] = np.zeros(1, bool)
        return knot

    def _beyond(self, row: int, way: int, inner: int) -> Table | None:
        """The smooth branch a little beyond a change point, continued from before it."""
        branch, name = self.branch, f"free{self.number}"
        from_, step = branch.table["place"][inner], way * BESIDE * branch.path.stride
        with np.errstate(all="ignore"):
            two, one = (self._single(row, from_ - k * step, inner, None) for k in (2, 1))
            here = some(branch.table, [inner])
            slope = branch.ways(self.number, two, one)
            guess = one[name] + 2 * slope
            knot = self._single(row, from_ + step, inner, guess.T)
            off = np.abs(self._whole(knot[name].T, guess.T).T - guess).max()
        known = np.abs(slope).max() * SMOOTH + 1e-9
        return knot if np.isfinite(here[name]).all() and off <= known else None

    def _smooth(self, row: int, way: int, inner: int, outer: int) -> bool:
        """Whether the table goes on smoothly behind a change point; made to, where the walk took the other branch."""
        branch, name = self.branch, f"free{self.number}"
        if not branch.path.onward(*sorted(branch.table["place"][[inner, outer]])):
            return True
        knot = self._beyond(row, way, inner)
        if knot is None:
            return False
        at = branch.before(row, float(knot["place"][0]))
        if not 0 <= at < len(branch.table["place"]) - 1:
            return True
        low, high = some(branch.table, [at]), some(branch.table, [at + 1])
        part = (knot["place"] - low["place"]) / (high["place"] - low["place"])
        seen = (low[name] + part[:, None] * branch.ways(self.number, low, high)).T
        away = np.abs(self._whole(seen, knot[name].T) - knot[name].T).max()
        if away <= 10 * SMOOTH * BESIDE * branch.path.stride:
            return True
        self._onward(row, way, [knot])
        return True

    def _march(self, row: int, way: int, inner: int) -> float | None:
        """Certain steps outward from a knot, and the walk again from their end; None where there are none."""
        branch, name = self.branch, f"free{self.number}"
        table, stride = branch.table, branch.path.stride
        here = some(table, [inner])
        end = table["place"][table["row"] == row][:: way][-1]
        before = inner - way
        known = 0 <= before < len(table["row"]) and table["row"][before] == row
        slope = np.zeros_like(here[name])
        step = stride / 8
        if known and np.isfinite(table[name][before]).all():
            back = some(table, [before])
            slope = branch.ways(self.number, back, here) / (here["place"] - back["place"])
        found: list[Table] = []
        gone = 0.0
        with np.errstate(all="ignore"):
            for _ in range(MOST):
                if step < FINEST * stride or gone >= stride:
                    break
                to = float(here["place"][0]) + way * step
                if (to - end) * way > 0:
                    to = float(end)
                knot = self._single(row, to, inner, (here[name] + slope * (to - here["place"])).T)
                pair = (here, knot) if way > 0 else (knot, here)
                box, _ = branch.certify(*pair, self.number)
                if not np.isfinite(box).all():
                    step /= 2
                    continue
                pair[0][f"box{self.number}"], pair[0][f"sure{self.number}"] = box, np.ones(1, bool)
                slope = branch.ways(self.number, here, knot) / (knot["place"] - here["place"])
                found.append(knot)
                here, gone = knot, gone + abs(step)
                step *= 2
                if to == end:
                    break
        if not found or gone < 64 * FINEST * stride:
            knot = self._beyond(row, way, inner)
            if knot is None:
                return None
            found = [knot]
        elif step < FINEST * stride:
            self._onward(row, way, found)
            return None if self._stuck(row, way, found) else gone
        self._onward(row, way, found)
        return gone

    def _stuck(self, row: int, way: int, found: list[Table]) -> bool:
        """Whether a march ended for good."""
        at = self.branch.before(row, float(found[-1]["place"][0]))
        place = self.branch.table["place"]
        at = at if abs(place[at] - found[-1]["place"][0]) <= abs(place[at + 1] - found[-1]["place"][0]) else at + 1
        knot = self._beyond(row, way, at)
        if knot is None:
            return True
        self._onward(row, way, [knot])
        return False

    def _onward(self, row: int, way: int, found: list[Table]) -> None:
        """Enter knots, walk on from the last of them, and make the steps beyond the first certain again."""
        branch = self.branch
        table = branch.table
        first, last = float(found[0]["place"][0]), float(found[-1]["place"][0])
        mine = table["row"] == row
        start = branch.path.begin
        dropped = mine & ((table["place"] - min(first, last)) * 1.0 >= 0) & (table["place"] <= max(first, last))
        dropped &= ~table["coarse"]
        for knot in found:
            same = mine & (table["place"] == knot["place"])
            knot["coarse"] = np.array([bool((table["coarse"] & same).any())])
            dropped |= same
        inside = mine & table["coarse"] & ~dropped & ((table["place"] - first) * way > 0) & ((last - table["place"]) * way > 0)
        branch.table = merged([some(table, ~dropped), *found])
        table = branch.table
        mine = table["row"] == row
        between = mine & table["coarse"] & ((table["place"] - first) * way > 0) & ((last - table["place"]) * way > 0)
        for at in np.flatnonzero(between):
            low, high = some(table, [at - 1]), some(table, [at + 1])
            part = (table["place"][at] - low["place"]) / (high["place"] - low["place"])
            self._place([at], (low[f"free{self.number}"] + part[:, None] * branch.ways(self.number, low, high)).T)
        del inside, start
        outer = np.flatnonzero(mine & ((table["place"] - last) * way > 0))[::way]
        at_last = int(np.flatnonzero(mine & (table["place"] == last))[0])
        at_before = at_last - way
        order = np.concatenate([[at_before, at_last], outer[table["coarse"][outer]]]).astype(int)
        self._walk(order[None], table[f"free{self.number}"][at_before][:, None])
        coarse = table["coarse"].copy()
        table["coarse"][[at_last]] = True
        if len(outer):
            self._fill(outer[~table["coarse"][outer]])
        table["coarse"] = coarse
        at = steps(table)
        beyond = (table["row"][at] == row) & ((np.minimum(table["place"][at] * way, table["place"][at + 1] * way)) >= (min(first * way, last * way)) - 2 * branch.path.stride)
        branch._refine(self.number, at[beyond])

    def _end(self, row: int, way: int, inner: int) -> None:
        """Nothing is known outward of a knot."""
        table = self.branch.table
        lost = (table["row"] == row) & ((table["place"] - table["place"][inner]) * way > 0)
        for link in self.group.links:
            table["origin"][lost, link] = np.nan
            table["direction"][lost, link] = np.nan
        table["sine"][lost, self.number] = np.nan
        for name in ("free", "columns", "duals"):
            table[f"{name}{self.number}"][lost] = np.nan
        at = steps(table)
        lost_steps = at[lost[at] | lost[at + 1]]
        table[f"sure{self.number}"][lost_steps] = False
