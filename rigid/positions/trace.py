"""Tracking of a group without closed-form solution through the knots of a branch."""

from typing import Any

import numpy as np

from rigid.arrays import Integers, Reals
from rigid.positions.branch import TrackedBranch
from rigid.positions.knots import Table, merged, select, steps
from rigid.positions.tracking_settings import TRACKING

# Terms in this file: A step leads from one knot to the next. It is certain if it has been proved (certified) that
# exactly one branch runs through it, and otherwise uncertain. The grid consists of the regular knots (`coarse` in
# `Table`). A walk computes the group at the knots of the grid, one after another. A march takes short steps from a knot
# across a difficult part of the path. A leap is a step of a march that is accepted at first without a certificate, and
# certified later. Lengths "in strides" are relative to `Path.stride`, the distance between adjacent knots of the grid.


class Trace:
    """Tracking of one group through the knots of a branch."""

    def __init__(self, branch: TrackedBranch, number: int) -> None:
        self.branch, self.number = branch, number
        self.group = branch.structure.groups[number]

    def run(self) -> None:
        """Walk from the drawing in both directions of the path, certify the steps, and handle uncertain steps."""
        branch = self.branch
        coarse = np.flatnonzero(branch.table["coarse"]).reshape(branch.rows, -1)
        begin = int(np.abs(branch.table["place"][coarse[0]] - branch.path.begin).argmin())
        start = np.repeat(self._drawn()[:, None], branch.rows, axis=1)
        for sense in (1, -1):
            self._walk(coarse[:, begin::sense], start)
        self._fill(np.flatnonzero(~branch.table["coarse"]), np.ravel(coarse))
        branch.refine(self.number, steps(branch.table), TRACKING.first_resolution)
        for row in range(branch.rows):
            for sense in (1, -1):
                self._handle_uncertain_steps(row, sense)

    def _drawn(self) -> Reals:
        """Return the drawn coordinates of the group, shape (free,)."""
        return np.array([self.branch.drawing.coordinate(self.group.tree[at]) for at in self.group.free])

    def _place(self, which: Integers | list[np.intp], guess: Reals) -> Reals:
        """Compute the group at knots by Newton's method from `guess`, and return its coordinates, shape (free, knots).

        The steps before and after these knots are marked as uncertain, because they are not yet certified.
        """
        part = select(self.branch.table, which)
        self.branch.set(part, self.number, guess)
        for name, value in part.items():
            self.branch.table[name][which] = value
        for adjacent in (np.asarray(which), np.asarray(which) - 1):
            self.branch.table[f"certain{self.number}"][adjacent] = False
        return part[f"free{self.number}"].T

    def _walk(self, order: Integers, start: Reals, known: int = 0) -> None:
        """Compute the group at knots one after another, with a guess extrapolated linearly from the previous two knots.

        `order` contains the indices of the knots, shape (designs, n). `start` is the guess at the first knot, shape
        (free, designs). At the first `known` knots, the group is already computed.
        """
        last, guess, walked = start, start, False
        place = self.branch.table["place"]
        for k in range(order.shape[1]):
            if k < known:
                here = self.branch.table[f"free{self.number}"][order[:, k]].T
            else:
                here = self._place(order[:, k], guess)
            reached = np.isfinite(here).all(axis=0)
            if not reached.any():
                break
            here = np.where(reached, self._near_angles(here, last), last)
            ahead = 0.0
            if walked and k + 1 < order.shape[1]:
                before, now, after = (place[order[0, at]] for at in (k - 1, k, k + 1))
                ahead = (after - now) / (now - before)
            guess = here + ahead * (here - last)
            last, walked = here, True

    def _near_angles(self, here: Reals, near: Reals) -> Reals:
        """Shift the angles in `here` by full turns to the values closest to `near`."""
        turns = np.array(self.group.angles)[:, None]
        return np.where(turns, here - 2 * np.pi * np.round((here - near) / (2 * np.pi)), here)

    def _fill(self, which: Integers, coarse: Integers) -> None:
        """Compute the group at knots that are not on the grid, with a guess interpolated between grid knots."""
        table = self.branch.table
        after = np.searchsorted(coarse, which)
        which, after = which[after < len(coarse)], after[after < len(coarse)]
        if not len(which):
            return
        low, high = select(table, coarse[after - 1]), select(table, coarse[after])
        part = (table["place"][which] - low["place"]) / (high["place"] - low["place"])
        self._place(which, (low[f"free{self.number}"] + part[:, None] * self.branch.changes(self.number, low, high)).T)

    def _handle_uncertain_steps(self, row: int, sense: int) -> None:
        """Continue the branch across each sequence of uncertain (not certified) steps, or end it there.

        The sequences in one direction of the path (`sense` 1 or -1) are handled, beginning with the one next to the
        drawing.
        """
        branch = self.branch
        passed = refined = marched = branch.path.begin - sense
        leaps, carried = True, False
        while (run := self._next(row, sense, passed)) is not None:
            table = branch.table
            start, stop = (float(table["place"][at]) for at in run)
            if carried:
                passed = stop
                continue
            if abs(stop - start) > branch.width(self.number):
                if start != refined and np.isfinite(table["sine"][list(run), self.number]).all():
                    refined = start
                    near = np.arange(min(run), max(run))
                    near = near[np.abs(table["place"][near + (sense < 0)] - start) <= branch.path.stride]
                    branch.refine(self.number, near)
                    continue
            elif table["sine"][run[0], self.number] <= TRACKING.max_hidden_sine and self._passes_smoothly(
                row, sense, start, stop
            ):
                passed = stop
                continue
            if (start - marched) * sense <= 0:  # the last march did not get beyond this point
                if carried := self._turns_with_drive(row, sense, start):
                    continue
                branch.end(self.number, row, sense, start)
                return
            knots, stuck = self._march(row, sense, run[0], leaps)
            self._insert(row, start, knots)
            here = float(knots[-1]["place"][0]) if knots else start
            certain = self._certain(row, sense, start, here)
            if leaps and not (certain == here or (stuck and abs(here - certain) <= branch.width(self.number))):
                leaps = False
                continue
            marched, leaps, here = start, True, certain
            if stuck:
                knot = self._knot_beyond(row, sense, here) if len(knots) < TRACKING.max_march_steps else None
                if knot is None:
                    if carried := self._turns_with_drive(row, sense, here):
                        continue
                    branch.end(self.number, row, sense, here)
                    return
                self._insert(row, here, [knot])
                here = float(knot["place"][0])
            self._continue_walk(row, sense, here)

    def _next(self, row: int, sense: int, passed: float) -> tuple[int, int] | None:
        """Return the next sequence of uncertain (not certified) steps beyond a point on the path, or None.

        The result contains the indices of two knots of the sequence: the closest to the drawing, and the farthest from
        it.
        """
        table, start = self.branch.table, self.branch.path.begin
        place = table["place"]
        for first, last in self.branch.uncertain_steps(self.number)[::sense]:
            inner, outer = (first, last) if sense > 0 else (last, first)
            if (
                table["row"][first] != row
                or (place[outer] - max(passed * sense, start * sense) * sense) * sense <= TRACKING.min_difference
            ):
                continue
            if (place[inner] - start) * sense < 0.0:
                run = np.arange(first, last + 1)
                inner = int(run[np.abs(place[run] - start).argmin()])
            return inner, outer
        return None

    def _knot_at(self, row: int, place: float, guess: Reals | None) -> Table:
        """Create a knot of one design at a point of the path.

        The group is computed by Newton's method from `guess`, or by default from an interpolation between adjacent
        knots.
        """
        branch = self.branch
        at = branch.before(row, place)
        low, high = select(branch.table, [at]), select(branch.table, [at + 1])
        part = (place - low["place"]) / (high["place"] - low["place"])
        knot = select(low, [0])
        knot["place"], knot["coarse"] = np.array([place]), np.zeros(1, bool)
        knot["driver_angles"] = low["driver_angles"] + part[:, None] * (high["driver_angles"] - low["driver_angles"])
        for k in range(self.number):
            if branch.structure.groups[k].free and not branch.forms[k]:
                branch.set(knot, k, (low[f"free{k}"] + part[:, None] * branch.changes(k, low, high)).T)
            else:
                branch.set(knot, k)
        if guess is None:
            guess = (low[f"free{self.number}"] + part[:, None] * branch.changes(self.number, low, high)).T
        branch.set(knot, self.number, guess, TRACKING.max_corrections)
        knot[f"certain{self.number}"] = np.zeros(1, bool)
        return knot

    def _extrapolated(self, row: int, place: float, step: float) -> tuple[Any, Any, float]:
        """Extrapolate the coordinates of the group linearly by a short step.

        The step must be so short that the motion is linear except for round-off, unless the branch ends at a limit of
        motion.

        Returns
        -------
        Path parameter after the step, extrapolated coordinates there, and tolerance of these coordinates.
        """
        farther, nearer = (self._knot_at(row, place - k * step, None) for k in (2, 1))
        slope = self.branch.changes(self.number, farther, nearer)
        return (
            place + step,
            nearer[f"free{self.number}"] + 2 * slope,
            np.abs(slope).max() * TRACKING.max_smooth_deviation + TRACKING.change_point_noise,
        )

    def _knot_beyond(self, row: int, sense: int, place: float) -> Table | None:
        """Return a knot of the branch that continues smoothly beyond a change point, or None if there is none."""
        with np.errstate(all="ignore"):
            step = sense * TRACKING.branch_distance * self.branch.path.stride
            to, guess, known = self._extrapolated(row, place, step)
            if (to - self._last(row, sense)) * sense > 0:
                return None
            knot = self._knot_at(row, to, guess.T)
            return knot if self._distance(knot, guess) <= known else None

    def _turns_with_drive(self, row: int, sense: int, place: float) -> bool:
        """Check whether the links turn with the drive from a point onward. If so, compute them there and return True.

        Links on parallel cranks have a branch on which each link turns as fast as the drive or not at all. Near change
        points, round-off may hide this branch. If the group closes on this branch at all checked knots, it is used up
        to the end of the path.
        """
        branch, table, begin = self.branch, self.branch.table, self.branch.path.begin
        outward = (table["row"] == row) & ((table["place"] - begin) * sense >= 0.0)
        beyond = outward & ((table["place"] - place) * sense > 0.0)
        passed = np.flatnonzero(outward & ~beyond & np.isfinite(table["sine"][:, self.number]))
        away = (table["sine"][:, : self.number] > TRACKING.min_clear_sine).all(axis=1)
        clear = np.flatnonzero(outward & table["coarse"] & away)
        enough = len(passed) >= 2 and len(clear) >= TRACKING.min_knots
        if branch.path.vertices is not None or not branch.path.turn or not enough:
            return False
        one, other, checked = (select(table, which) for which in (passed[:-1], passed[1:], clear))
        with np.errstate(all="ignore"):
            rates = branch.changes(self.number, one, other) / (other["place"] - one["place"])[:, None]
        rate = np.round(np.median(rates, axis=0))[:, None]
        best = passed[int(table["sine"][passed, self.number].argmax())]
        for known, at in ((self._drawn(), begin), (table[f"free{self.number}"][best], table["place"][best])):
            start = known[:, None] - rate * at
            if np.abs(rate).max() <= 1.0 and branch.closes(checked, self.number, start + rate * checked["place"]).all():
                self._place(np.flatnonzero(beyond), start + rate * table["place"][beyond])
                at_steps = steps(table)
                nearer = np.minimum(table["place"][at_steps] * sense, table["place"][at_steps + 1] * sense)
                branch.refine(self.number, at_steps[(table["row"][at_steps] == row) & (nearer >= place * sense)])
                return True
        return False

    def _distance(self, knot: Table, guess: Any) -> float:
        """Return the largest difference between the coordinates of the group at a knot and guessed coordinates."""
        return float(np.abs(self._near_angles(knot[f"free{self.number}"].T, guess.T).T - guess).max())

    def _last(self, row: int, sense: int) -> float:
        """Return the path parameter of the last knot of a design in one direction (`sense` 1 or -1)."""
        table = self.branch.table
        return float(table["place"][table["row"] == row][::sense][-1])

    def _passes_smoothly(self, row: int, sense: int, start: float, stop: float) -> bool:
        """Return whether the tracked branch is smooth across very short uncertain steps, from `start` to `stop`."""
        if not self.branch.path.keeps_direction(*sorted((start, stop))):
            return True
        with np.errstate(all="ignore"):
            step = max(abs(stop - start), TRACKING.min_branch_distance * self.branch.path.stride)
            to, guess, known = self._extrapolated(row, 0.5 * (start + stop), sense * step)
            return (to - self._last(row, sense)) * sense > 0 or self._distance(
                self._knot_at(row, to, None), guess
            ) <= known

    def _certain(self, row: int, sense: int, inner: float, outer: float) -> float:
        """Return the point of the path up to which all steps are certain (certified).

        The search begins at `inner` and ends at `outer`.
        """
        table = self.branch.table
        at = steps(table)
        at = at[(table["row"][at] == row) & ~table[f"certain{self.number}"][at]]
        near, far = (table["place"][at + (sense < 0)] * sense, table["place"][at + (sense > 0)] * sense)
        open_ = near[(near >= inner * sense) & (far <= outer * sense)]
        return float(open_.min() * sense) if len(open_) else outer

    def _march(self, row: int, sense: int, inner: int, leaps: bool) -> tuple[list[Table], bool]:
        """Take short steps from a knot, in the direction away from the drawing, over a distance of one stride.

        Each step is certified before the next step is taken. With `leaps`, a step is also accepted if the motion in it
        is nearly linear; it must be certified later.

        Returns
        -------
        New knots, and whether the march stopped before it covered one stride or reached the last knot.
        """
        branch, name = self.branch, f"free{self.number}"
        table, stride = branch.table, branch.path.stride
        here = select(table, [inner])
        end = float(table["place"][table["row"] == row][::sense][-1])
        before = inner - sense
        slope = np.zeros_like(here[name])
        known = table[f"certain{self.number}"][min(before, inner)]
        if 0 <= before < len(table["row"]) and table["row"][before] == row and known:
            back = select(table, [before])
            slope = branch.changes(self.number, back, here) / (here["place"] - back["place"])[:, None]
        knots: list[Table] = []
        step, travelled, successes = stride / 8, 0.0, 0
        leapt = step if leaps and slope.any() else np.inf
        with np.errstate(all="ignore"):
            while travelled < stride and here["place"][0] != end and len(knots) < TRACKING.max_march_steps:
                if step < min(branch.edge, TRACKING.min_march_step) * stride:
                    break
                to = float(here["place"][0]) + sense * step
                to = end if (to - end) * sense > 0 else to
                guess = here[name] + slope * (to - here["place"])
                knot = self._knot_at(row, to, guess.T)
                good = (
                    leapt < np.inf
                    and self._distance(knot, guess) <= TRACKING.max_leap_deviation * np.abs(guess - here[name]).max()
                )
                if not good and step * TRACKING.max_shortening <= leapt:
                    pair = (here, knot) if sense > 0 else (knot, here)
                    good = np.isfinite(branch.certify(*pair, self.number)[0]).all()
                if not good:
                    step, successes = step / 2, 0
                    continue
                slope = branch.changes(self.number, here, knot) / (knot["place"] - here["place"])
                knots.append(knot)
                here, travelled, successes = knot, travelled + step, successes + 1
                leapt = step if leaps else leapt
                step = 2 * step if successes > TRACKING.steps_to_double else step
        return knots, travelled < stride and here["place"][0] != end

    def _insert(self, row: int, inner: float, knots: list[Table]) -> None:
        """Insert new knots of a march that began at the point `inner` into the table, and certify the steps.

        Old knots in the range of the new knots are deleted. Those of the grid are kept but computed again.
        """
        branch, name = self.branch, f"free{self.number}"
        if not knots:
            return
        table = branch.table
        ends = sorted((inner, float(knots[-1]["place"][0])))
        mine = (table["row"] == row) & (table["place"] >= ends[0]) & (table["place"] <= ends[1])
        grid = mine & table["coarse"]
        for knot in knots:
            knot["coarse"] = np.array([bool((grid & (table["place"] == knot["place"])).any())])
        places = {float(knot["place"][0]) for knot in knots}
        kept = ~mine | (grid & ~np.isin(table["place"], list(places))) | (table["place"] == inner)
        places.add(inner)
        branch.table = table = merged([select(table, kept), *knots])
        known = np.isin(table["place"], list(places))
        inside = (table["row"] == row) & (table["place"] > ends[0]) & (table["place"] < ends[1]) & ~known
        after = np.flatnonzero(known & (table["row"] == row))
        for at in np.flatnonzero(inside):
            k = int(np.searchsorted(after, at))
            low, high = select(table, after[k - 1 : k]), select(table, after[k : k + 1])
            part = (table["place"][at] - low["place"]) / (high["place"] - low["place"])
            self._place([at], (low[name] + part[:, None] * branch.changes(self.number, low, high)).T)
        begins = steps(table)
        mine = (table["row"][begins] == row) & (table["place"][begins] >= ends[0])
        mine &= table["place"][begins + 1] <= ends[1]
        branch.refine(self.number, begins[mine])

    def _continue_walk(self, row: int, sense: int, last: float) -> None:
        """Walk on from the knot at `last` and certify the steps, unless the next grid knot is already on its branch."""
        branch, name = self.branch, f"free{self.number}"
        if self._rejoins(row, sense, last):
            return
        table = branch.table
        mine = table["row"] == row
        at = int(np.flatnonzero(mine & (table["place"] == last))[0])
        outer = np.flatnonzero(mine & ((table["place"] - last) * sense > 0))[::sense]
        distance = 0.5 * TRACKING.branch_distance * branch.path.stride
        inner = np.flatnonzero(mine & ((last - table["place"]) * sense > distance))[::sense]
        first = int(inner[-1]) if len(inner) else at
        grid = outer[table["coarse"][outer]]
        self._walk(np.array([[first, at, *grid]]), table[name][first][:, None], 2)
        self._fill(outer[~table["coarse"][outer]], np.sort([at, *grid]))
        begins = steps(table)
        nearer = np.minimum(table["place"][begins] * sense, table["place"][begins + 1] * sense)
        branch.refine(self.number, begins[mine[begins] & (nearer >= last * sense)], TRACKING.first_resolution)

    def _rejoins(self, row: int, sense: int, last: float) -> bool:
        """Return whether all steps from a knot to the next grid knot are certain."""
        branch, table = self.branch, self.branch.table
        outer = table["place"][(table["row"] == row) & table["coarse"] & ((table["place"] - last) * sense > 0)][::sense]
        if not len(outer):
            return True
        low, high = sorted((last, float(outer[0])))
        at = steps(table)
        mine = (table["row"][at] == row) & (table["place"][at] >= low) & (table["place"][at + 1] <= high)
        branch.refine(self.number, at[mine], TRACKING.first_resolution)
        return self._certain(row, sense, last, float(outer[0])) == float(outer[0])
