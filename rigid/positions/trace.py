"""A group that no closed form covers, followed along the knots of a branch."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.positions.branch import Branch
from rigid.positions.knots import Table, merged, some, steps

BESIDE = 0.02  # of a stride: how far beside a change point the branches are told apart
SMOOTH = 0.1  # of the way to there: how far from smooth the branch may go on
TRIES = 24  # to go on from where a walk went astray
MOST = 400  # steps of a march
EASY = 2  # certain steps after which a march goes in longer ones
ROUGH = 2.0**-6  # of a stride: how fine a walk is made certain at first
STILL = 1e-15  # [rad or m]: no way
CLOSE = 1e-6  # [rad or m]: what is the same


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
        self._fill(np.flatnonzero(~branch.table["coarse"]), np.ravel(coarse))
        branch.refine(self.number, steps(branch.table), ROUGH)
        for row in range(branch.rows):
            for way in (1, -1):
                self._mend(row, way)

    def _place(self, which: Any, guess: Any) -> Any:
        """Place the group at knots of the table; its coordinates, shape (free, knots)."""
        part = some(self.branch.table, which)
        self.branch.set(part, self.number, guess)
        for name, value in part.items():
            self.branch.table[name][which] = value
        return part[f"free{self.number}"].T

    def _walk(self, order: Any, start: Any) -> None:
        """Place the group at knots, shape (designs, n), one after the other, each begun on the line through two."""
        last, guess, walked = start, start, False
        place = self.branch.table["place"]
        for k in range(order.shape[1]):
            here = self._place(order[:, k], guess)
            reached = np.isfinite(here).all(axis=0)
            if not reached.any():
                break
            here = np.where(reached, self._whole(here, last), last)
            ahead = 0.0
            if walked and k + 1 < order.shape[1]:
                before, now, after = (place[order[0, at]] for at in (k - 1, k, k + 1))
                ahead = (after - now) / (now - before)
            guess = here + ahead * (here - last)
            last, walked = here, True

    def _whole(self, here: Any, near: Any) -> Any:
        """The same angles, near others."""
        turns = np.array(self.group.angles)[:, None]
        return np.where(turns, here - 2 * np.pi * np.round((here - near) / (2 * np.pi)), here)

    def _fill(self, which: Any, coarse: Any) -> None:
        """Place the group at knots between coarse ones."""
        table = self.branch.table
        after = np.searchsorted(coarse, which)
        which, after = which[after < len(coarse)], after[after < len(coarse)]
        if not len(which):
            return
        low, high = some(table, coarse[after - 1]), some(table, coarse[after])
        part = (table["place"][which] - low["place"]) / (high["place"] - low["place"])
        self._place(which, (low[f"free{self.number}"] + part[:, None] * self.branch.ways(self.number, low, high)).T)

    def _mend(self, row: int, way: int) -> None:
        """Go outward from the drawing and see to every run of steps that are not certain."""
        branch = self.branch
        passed, closed_in = branch.path.begin, False
        for _ in range(TRIES):
            run = self._next(row, way, passed)
            if run is None:
                return
            place = branch.table["place"]
            inner, outer = run
            stop = float(place[outer])
            if abs(stop - place[inner]) <= branch.reach_of_change:
                if self._smooth(row, way, inner, outer):
                    passed = stop
                    closed_in = False
                    continue
            elif not closed_in and np.isfinite(branch.table["sine"][[inner, outer], self.number]).all():
                closed_in = True
                near = np.arange(min(run), max(run))
                branch.refine(self.number, near[np.abs(place[near + (way < 0)] - place[inner]) <= branch.path.stride])
                continue
            closed_in = False
            found, ended = self._march(row, way, inner)
            if ended:
                self._enter(row, float(place[inner]), found)
                self._end(row, way, float(found[-1]["place"][0]) if found else float(place[inner]))
                return
            self._onward(row, way, float(place[inner]), found)
        run = self._next(row, way, passed)
        if run is not None:
            self._end(row, way, float(branch.table["place"][run[0]]))

    def _next(self, row: int, way: int, passed: float) -> tuple[int, int] | None:
        """Inner and outer knot of the next run of steps that are not certain, outward of a place."""
        table, start = self.branch.table, self.branch.path.begin
        place = table["place"]
        for first, last in self.branch.uncertain_steps(self.number)[::way]:
            inner, outer = (first, last) if way > 0 else (last, first)
            if table["row"][first] != row or (place[outer] - max(passed * way, start * way) * way) * way <= STILL:
                continue
            if (place[inner] - start) * way < 0.0:
                run = np.arange(first, last + 1)
                inner = int(run[np.abs(place[run] - start).argmin()])
            return inner, outer
        return None

    def _single(self, row: int, place: float, guess: Any) -> Table:
        """A knot of one design anywhere, with the group placed from a guess and those before it from the knots."""
        branch = self.branch
        at = branch.before(row, place)
        low, high = some(branch.table, [at]), some(branch.table, [at + 1])
        part = (place - low["place"]) / (high["place"] - low["place"])
        knot = some(low, [0])
        knot["place"], knot["coarse"] = np.array([place]), np.zeros(1, bool)
        knot["led"] = low["led"] + part[:, None] * (high["led"] - low["led"])
        for k in range(self.number):
            if branch.structure.groups[k].free and not branch.forms[k]:
                branch.set(knot, k, (low[f"free{k}"] + part[:, None] * branch.ways(k, low, high)).T)
            else:
                branch.set(knot, k)
        if guess is None:
            guess = (low[f"free{self.number}"] + part[:, None] * branch.ways(self.number, low, high)).T
        branch.set(knot, self.number, guess)
        knot[f"sure{self.number}"] = np.zeros(1, bool)
        return knot

    def _beyond(self, row: int, way: int, place: float, here: Table) -> Table | None:
        """The smooth branch a little beyond a change point, continued from before it; None where there is none."""
        branch, name = self.branch, f"free{self.number}"
        step = way * BESIDE * branch.path.stride
        table = branch.table
        if (place + step - table["place"][table["row"] == row][::way][-1]) * way > 0:
            return None
        with np.errstate(all="ignore"):
            two, one = (self._single(row, place - k * step, None) for k in (2, 1))
            slope = branch.ways(self.number, two, one)
            guess = one[name] + 2 * slope
            knot = self._single(row, place + step, guess.T)
            off = np.abs(self._whole(knot[name].T, guess.T).T - guess).max()
        known = np.abs(slope).max() * SMOOTH + 1e-9
        return knot if np.isfinite(here[name]).all() and off <= known else None

    def _smooth(self, row: int, way: int, inner: int, outer: int) -> bool:
        """Whether the table goes on smoothly behind a change point; made to, where the walk took the other branch."""
        branch, name = self.branch, f"free{self.number}"
        place = float(branch.table["place"][inner])
        if not branch.path.onward(*sorted(branch.table["place"][[inner, outer]])):
            return True
        ahead = place + way * BESIDE * branch.path.stride
        if (ahead - branch.table["place"][branch.table["row"] == row][::way][-1]) * way > 0:
            return True
        knot = self._beyond(row, way, place, some(branch.table, [inner]))
        if knot is None:
            return False
        seen = self._single(row, ahead, None)
        away = np.abs(self._whole(seen[name].T, knot[name].T) - knot[name].T).max()
        if not away <= CLOSE:
            self._onward(row, way, place, [knot])
            back = self._next(row, way, float(np.nextafter(place, -way * np.inf)))
            if back is not None and np.isfinite(branch.table["sine"][list(back), self.number]).all():
                branch.refine(self.number, np.arange(min(back), max(back)))
        return True

    def _march(self, row: int, way: int, inner: int) -> tuple[list[Table], bool]:
        """Certain steps outward from a knot, and whether there are no more."""
        branch, name = self.branch, f"free{self.number}"
        table, stride = branch.table, branch.path.stride
        here = some(table, [inner])
        end = float(table["place"][table["row"] == row][::way][-1])
        before = inner - way
        slope = np.zeros_like(here[name])
        if 0 <= before < len(table["row"]) and table["row"][before] == row:
            back = some(table, [before])
            slope = branch.ways(self.number, back, here) / (here["place"] - back["place"])[:, None]
        found: list[Table] = []
        step, gone, easy = stride / 8, 0.0, 0
        with np.errstate(all="ignore"):
            for _ in range(MOST):
                if step < branch.edge * stride or gone >= stride or here["place"][0] == end:
                    break
                to = float(here["place"][0]) + way * step
                to = end if (to - end) * way > 0 else to
                knot = self._single(row, to, (here[name] + slope * (to - here["place"])).T)
                pair = (here, knot) if way > 0 else (knot, here)
                box, _ = branch.certify(*pair, self.number)
                if not np.isfinite(box).all():
                    step, easy = step / 2, 0
                    continue
                slope = branch.ways(self.number, here, knot) / (knot["place"] - here["place"])
                found.append(knot)
                here, gone, easy = knot, gone + step, easy + 1
                step = 2 * step if easy > EASY else step
        if gone >= stride or here["place"][0] == end:
            return found, False
        beyond = self._beyond(row, way, float(here["place"][0]), here)
        return ([*found, beyond], False) if beyond is not None else (found, True)

    def _enter(self, row: int, inner: float, found: list[Table]) -> None:
        """Enter knots in place of those from a place on, but for the grid, and make their steps certain."""
        branch, name = self.branch, f"free{self.number}"
        if not found:
            return
        table = branch.table
        ends = sorted((inner, float(found[-1]["place"][0])))
        mine = (table["row"] == row) & (table["place"] >= ends[0]) & (table["place"] <= ends[1])
        grid = mine & table["coarse"]
        for knot in found:
            knot["coarse"] = np.array([bool((grid & (table["place"] == knot["place"])).any())])
        places = {float(knot["place"][0]) for knot in found}
        kept = ~mine | (grid & ~np.isin(table["place"], list(places))) | (table["place"] == inner)
        places.add(inner)
        branch.table = table = merged([some(table, kept), *found])
        known = np.isin(table["place"], list(places))
        inside = (table["row"] == row) & (table["place"] > ends[0]) & (table["place"] < ends[1]) & ~known
        after = np.flatnonzero(known & (table["row"] == row))
        for at in np.flatnonzero(inside):
            k = int(np.searchsorted(after, at))
            low, high = some(table, after[k - 1 : k]), some(table, after[k : k + 1])
            part = (table["place"][at] - low["place"]) / (high["place"] - low["place"])
            self._place([at], (low[name] + part[:, None] * branch.ways(self.number, low, high)).T)
        at = steps(table)
        mine = (table["row"][at] == row) & (table["place"][at + 1] >= ends[0]) & (table["place"][at] <= ends[1])
        branch.refine(self.number, at[mine])

    def _onward(self, row: int, way: int, inner: float, found: list[Table]) -> None:
        """Enter knots, walk on from the last of them, and make the steps beyond certain again."""
        branch, name = self.branch, f"free{self.number}"
        last = float(found[-1]["place"][0])
        self._enter(row, inner, found)
        table = branch.table
        mine = table["row"] == row
        outer = np.flatnonzero(mine & ((table["place"] - last) * way > 0))[::way]
        if not len(outer):
            return
        at = int(np.flatnonzero(mine & (table["place"] == last))[0])
        grid = outer[table["coarse"][outer]]
        self._walk(np.array([[at - way, at, *grid]]), table[name][at - way][:, None])
        self._fill(outer[~table["coarse"][outer]], np.sort([at, *grid]))
        at = steps(table)
        beyond = mine[at] & (np.minimum(table["place"][at] * way, table["place"][at + 1] * way) >= last * way)
        branch.refine(self.number, at[beyond], ROUGH)

    def _end(self, row: int, way: int, place: float) -> None:
        """Nothing is known outward of a place."""
        table, number = self.branch.table, self.number
        lost = (table["row"] == row) & ((table["place"] - place) * way > 0)
        self.branch.table = table = some(table, ~lost | table["coarse"])
        lost = (table["row"] == row) & ((table["place"] - place) * way > 0)
        for name in ("origin", "direction"):
            for link in self.group.links:
                table[name][lost, link] = np.nan
        table["sine"][lost, number] = np.nan
        for name in ("free", "columns", "duals"):
            table[f"{name}{number}"][lost] = np.nan
        at = steps(table)
        at = at[lost[at] | lost[at + 1]]
        table[f"sure{number}"][at] = False
        table[f"box{number}"][at] = np.nan
