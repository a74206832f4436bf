"""Tracking of a mechanism's assembly branch along the path of the drives, with a proof for each step.

The branch starts at the posture in the drawing. The path is divided into steps by knots, which do not depend on the
requested positions. A step leads from one knot to the next. It is certain if `rigid.positions.enclosure` proves that
exactly one branch runs through it. Uncertain steps are halved. If a very short step is still uncertain, it contains a
change point or a limit of motion. At a change point, two branches meet; the tracked branch continues smoothly through
it. Beyond a limit of motion, positions are nan.

The file is long because all methods of its class read and write one table of knots.
"""

from typing import Any

import numpy as np
from msgspec.structs import replace

from rigid.arrays import Columns, Flags, Integers, Numbers, Reals
from rigid.closures.closure import closure, columns
from rigid.decomposition.groups import Group, Structure
from rigid.drawing import Drawing
from rigid.mechanism import Mechanism
from rigid.plane import number as as_number
from rigid.positions import knots as table_of
from rigid.positions.drive_path import FINEST_STEP, Path
from rigid.positions.dyad_places import place_dyad_with_slack
from rigid.positions.enclosure import Ends, KnotStep, StepCertificate, loop
from rigid.positions.knots import Table, knots_before, merged, select, steps, touches
from rigid.positions.newton import MAX_NEWTON_STEPS, closes, newton, sine_of, tree_closure
from rigid.positions.partial_posture import PartialPosture
from rigid.positions.rows import designs_of_lengths, select_designs
from rigid.positions.tracking_settings import TRACKING
from rigid.postures import joint_place


class TrackedBranch:
    """The branch of a mechanism, as a table of knots.

    Knots are points on the path of the drives at which the positions of the links are computed.

    Parameters
    ----------
    low, high
        Smallest and largest path parameter of the knots.
    forms
        For each group, whether its positions are computed in closed form.
    edge
        Accuracy to which limits of motion are located, in strides (see `Path.stride`).
    """

    def __init__(
        self, mechanism: Mechanism, structure: Structure, path: Path, low: float, high: float, forms: Any, edge: float
    ) -> None:
        self.mechanism, self.structure, self.path, self.forms, self.edge = mechanism, structure, path, forms, edge
        self.low, self.high = low, high
        self.drawing = Drawing(mechanism)
        self.designs = designs_of_lengths(mechanism)
        self.rows = self.designs[0] if self.designs else 1
        self.loops = [tuple(loop(group, cut) for cut in group.cut) for group in structure.groups]
        self.drivers = structure.measured_drivers
        grid = path.grid(low, high)
        counts = len(mechanism.links), len(structure.groups), len(self.drivers)
        self.table: Table = table_of.knots(grid, self.rows, *counts)

    def add_group(self, number: int) -> None:
        """Add the arrays for a group to the table of knots, see `Table` in knots.py."""
        group, count = self.structure.groups[number], len(self.table["place"])
        free, cuts = len(group.free), len(group.cut)
        self.table[f"free{number}"] = np.full((count, free), np.nan)
        for name in ("columns", "duals"):
            self.table[f"{name}{number}"] = np.full((count, free, cuts), np.nan, complex)
        self.table[f"box{number}"] = np.full((count, free), np.nan)
        self.table[f"certain{number}"] = np.zeros(count, bool)

    def measure(self, group: Group) -> None:
        """Add the angles of a group's joints that drive gears but have no drive themselves to the table of knots.

        The angles include full turns.
        """
        place = self.table["place"]
        sources = [driver for joint in group.tree if joint.gear for _, driver in joint.gear.sources]
        for driver in sources:
            if driver.moved or not driver.turns:
                continue
            k = self.drivers.index((driver.name, driver.parent, driver.child))
            angle = np.angle(self.table["direction"][:, [driver.child, driver.parent]])
            change = np.diff(angle, axis=0)
            change -= 2 * np.pi * np.round(change / (2 * np.pi))
            path = np.concatenate([[0.0], np.nancumsum(change[:, 0] - change[:, 1])])
            path *= driver.sense
            measured = driver.sense * (angle[:, 0] - angle[:, 1])
            drawn = self.drawing.coordinate(driver)
            for row in range(self.rows):
                mine = np.flatnonzero(self.table["row"] == row)
                begin = mine[np.abs(place[mine] - self.path.begin).argmin()]
                start = measured[begin] + 2 * np.pi * np.round((drawn - measured[begin]) / (2 * np.pi))
                self.table["driver_angles"][mine, k] = start + path[mine] - path[begin]

    # Placing

    def set(self, table: Table, number: int, guess: Reals | None = None, corrections: int = MAX_NEWTON_STEPS) -> None:
        """Compute the positions of a group at knots, and write them to the table.

        Groups without a closed-form solution are solved by Newton's method in at most `corrections` steps. It starts
        from the coordinates `guess`, shape (free, knots).
        """
        placed, group = self._placed_before(table, number)
        shape = placed.shape
        if not group.free:
            for joint in group.tree:
                placed.place_child(joint, placed.coordinate(joint))
            sine_there: Any = None
        elif self.forms[number]:
            drawing = replace(self.drawing, rows=table["row"]) if self.designs else self.drawing
            sine_there = place_dyad_with_slack(placed, group, drawing, table["sign"][:, number].reshape(shape))
        else:
            assert guess is not None
            start = guess.reshape(len(group.free), *shape)
            sine_there = sine_of(tree_closure(placed, group, newton(placed, group, start, corrections)))
        self._write(table, number, placed, group, sine_there)

    def closes(self, table: Table, number: int, coordinates: Reals) -> Flags:
        """Return for each knot whether the given coordinates close the group to within round-off.

        `coordinates` has the shape (free, knots).
        """
        placed, group = self._placed_before(table, number)
        # the round-off of angles grows with the number of turns
        factor = 1.0 + np.abs(table["place"] - self.path.begin)
        coordinates, factor = coordinates.reshape(len(group.free), *placed.shape), factor.reshape(placed.shape)
        return closes(placed, group, coordinates, factor).reshape(len(table["place"]))

    def _placed_before(self, table: Table, number: int) -> tuple[PartialPosture, Group]:
        """Return the posture of all earlier groups at knots, and the group with the dimensions of each design."""
        count = len(table["place"])
        shape = (count, 1) if self.designs else (count,)
        group = select_designs(self.structure.groups[number], table["row"], self.designs)
        drive = self.path.drives(table["place"]).reshape(-1, *shape)
        origin, direction = ([column.reshape(shape) for column in table[name].T] for name in ("origin", "direction"))
        sine = [table["sine"][:, k].reshape(shape) for k in range(number)]
        driver_angles = {key: table["driver_angles"][:, k].reshape(shape) for k, key in enumerate(self.drivers)}
        placed = PartialPosture(
            self.mechanism, drive, origin, direction, sine, shape=shape, driver_angles=driver_angles
        )
        return placed, group

    def _write(self, table: Table, number: int, placed: PartialPosture, group: Group, sine: Reals | None) -> None:
        """Write the positions of a group to the table."""
        count = len(table["place"])

        def flat(value: Columns) -> Numbers:
            return np.broadcast_to(as_number(value), placed.shape).reshape(count)

        for link in group.links:
            table["origin"][:, link] = flat(placed.origin[link])
            table["direction"][:, link] = flat(placed.direction[link])
        for k, key in enumerate(self.drivers):
            if key in placed.exact_driver_angles:
                table["driver_angles"][:, k] = flat(placed.exact_driver_angles[key])
        if not group.free:
            table["sine"][:, number] = np.where(
                np.isfinite(table["origin"][:, list(group.links)]).all(axis=1), 1.0, np.nan
            )
            return
        tree, cut = (tuple(joint_place(placed, joint) for joint in joints) for joints in (group.tree, group.cut))
        table["sine"][:, number] = flat(sine)
        for k, at in enumerate(group.free):
            table[f"free{number}"][:, k] = flat(group.tree[at].coordinate(placed))
        with np.errstate(all="ignore"):
            duals = closure(group, tree, cut).duals
        for k, column in enumerate(columns(group, tree, cut)):
            for c, entry in enumerate(column):
                table[f"columns{number}"][:, k, c] = flat(as_number(entry))
                table[f"duals{number}"][:, k, c] = flat(duals[k, c])

    def _between(self, low: Table, high: Table, number: int) -> Table:
        """Create knots halfway between pairs of knots, and compute all groups up to `number` there."""
        middle = select(low, np.arange(len(low["place"])))
        middle["place"] = 0.5 * (low["place"] + high["place"])
        middle["coarse"] = np.zeros(len(middle["place"]), bool)
        middle["driver_angles"] = 0.5 * (low["driver_angles"] + high["driver_angles"])
        for k in range(number + 1):
            guess = None
            if self.structure.groups[k].free and not self.forms[k]:
                guess = (low[f"free{k}"] + 0.5 * self.changes(k, low, high)).T
            self.set(middle, k, guess)
            # If exactly one branch runs through a step, this also holds for each half of the step, so that halves need
            # no new proof. But the box (bounds on the deviation from linear motion) must be doubled: linear motion is
            # now measured between the ends of the half, which themselves deviate by up to one box from linear motion in
            # the whole step.
            low[f"box{k}"] = 2 * low[f"box{k}"]
            middle[f"box{k}"], middle[f"certain{k}"] = low[f"box{k}"].copy(), low[f"certain{k}"].copy()
        return middle

    def changes(self, number: int, low: Table, high: Table) -> Reals:
        """Return the change in each free coordinate of a group from knots `low` to knots `high`, shape (knots, free).

        Changes in angles are reduced to the range from -pi to pi.
        """
        group = self.structure.groups[number]
        change = high[f"free{number}"] - low[f"free{number}"]
        turns = np.array(group.angles)
        return np.where(turns, change - 2 * np.pi * np.round(change / (2 * np.pi)), change)

    # Certainty

    def certify(self, low: Table, high: Table, number: int, at: Any = None) -> tuple[Reals, Flags]:
        """Try to prove for each step between knots that exactly one branch of a group runs through it.

        Step k leads from knot k of `low` to knot k of `high`. If `at` is given, both are the same table, and step k
        leads from knot at[k] to the next knot.

        Returns
        -------
        Two arrays. The first is the box of each step, i.e. bounds on the deviation of the free coordinates from linear
        motion, shape (steps, free); nan for uncertain steps. The second is True for steps in which all earlier groups
        are certain, shape (steps,).
        """
        count = len(low["place"] if at is None else at)
        parts = []
        for first in range(0, max(count, 1), TRACKING.steps_per_block):
            block = slice(first, first + TRACKING.steps_per_block)
            begin, end = (block, block) if at is None else (at[block], at[block] + 1)
            parts.append(self._certified(select(low, begin), select(high, end), number))
        boxes, before = zip(*parts, strict=True)
        return np.concatenate(boxes), np.concatenate(before)

    def _certified(self, low: Table, high: Table, number: int) -> tuple[Reals, Flags]:
        count = len(low["place"])
        links = len(self.mechanism.links)
        before = np.ones(count, bool)
        finest = high["place"] - low["place"] <= 2 * FINEST_STEP * self.path.stride
        with np.errstate(all="ignore"):
            turned = np.angle(high["direction"] * np.conj(low["direction"])).T
            shift = (high["origin"] - low["origin"]).T
            step = KnotStep(
                low["row"],
                np.ascontiguousarray(low["origin"].T),
                np.ascontiguousarray(shift),
                turned,
                np.zeros((links, count)),
                np.zeros((links, count)),
            )
            for k, group in enumerate(self.structure.groups[: number + 1]):
                changes = self.changes(k, low, high)
                free = np.array([low[f"free{k}"].T, (low[f"free{k}"] + changes).T])
                sides = (
                    np.array([np.moveaxis(end[name], 0, -1) for end in (low, high)], order="C")
                    for name in (f"columns{k}", f"duals{k}")
                )
                certificate = StepCertificate(group, self.loops[k], step, Ends(free, *sides))
                box = certificate.box
                if k == number:
                    return box.T, before
                passed = finest & np.isfinite(low["sine"][:, k] + high["sine"][:, k])
                width = TRACKING.dyad_change_width * FINEST_STEP
                box = np.where(np.isnan(box) & passed, np.abs(changes.T) + width, box)
                before &= np.isfinite(box).all(axis=0)
                certificate.fill(box)
        raise AssertionError

    def refine(self, number: int, which: Integers, finest: float | None = None) -> None:
        """Halve the steps `which` of a group repeatedly until they are certified or as short as `finest`.

        The unit of `finest` is the stride, i.e. the initial distance between adjacent knots.
        """
        finest = (self.finest(number) if finest is None else finest) * self.path.stride
        most, table = max(TRACKING.max_halved, len(which)), self.table
        box, before = self.certify(table, table, number, which)
        split = self._split(table, table, number, (box, before), finest, most, which)
        table[f"box{number}"][which], table[f"certain{number}"][which] = box, np.isfinite(box).all(axis=1)
        if not split.any():
            return
        at = which[split]
        others = np.ones(len(table["place"]), bool)
        others[at] = False
        low, high, kept = select(table, at), select(table, at + 1), [select(table, others)]
        while len(low["place"]):
            middle = self._between(low, high, number)
            low, high = (
                {name: np.concatenate([a[name], b[name]]) for name in a} for a, b in ((low, middle), (middle, high))
            )
            box, before = self.certify(low, high, number)
            split = self._split(low, high, number, (box, before), finest, most)
            low[f"box{number}"] = box
            low[f"certain{number}"] = np.asarray(np.isfinite(box).all(axis=1))
            kept.append(select(low, np.logical_not(split)))
            low, high = select(low, split), select(high, split)
        self.table = merged(kept)

    def _split(
        self, low: Table, high: Table, number: int, known: tuple[Reals, Flags], finest: float, most: int, at: Any = None
    ) -> Flags:
        """Return which of the uncertain steps to halve. A step is uncertain if the proof by `certify` failed.

        `known` is the result of `certify` for the same steps.
        """
        box, before = known
        begin, end = (slice(None), slice(None)) if at is None else (at, at + 1)
        edge = finest
        if self.forms[number]:
            edge = self.path.stride * (TRACKING.limit_resolution if all(self.forms) else self.edge)
        length = high["place"][end] - low["place"][begin]
        closes = np.isfinite(np.array([low["sine"][begin, number], high["sine"][end, number]]))
        # if an earlier group is certain in a step, it is also certain in the halves of the step, even if their boxes
        # are nan
        certain: Any = np.all([low[f"certain{k}"][begin] for k in range(number)], axis=0) if number else True
        split: Flags = ~np.isfinite(box).all(axis=1) & (length > finest) & (before | certain) & closes.any(axis=0)
        split &= closes.all(axis=0) | (length > edge)
        # too many uncertain steps: halving does not help, for example with unrealistic dimensions
        if np.count_nonzero(split) > most:
            split[:] = False
        return split

    def uncertain_steps(self, number: int) -> list[tuple[int, int]]:
        """Return the first and the last knot of each sequence of adjacent uncertain steps, as indices."""
        at = steps(self.table)
        open_ = at[~self.table[f"certain{number}"][at]]
        runs = np.split(open_, np.flatnonzero(np.diff(open_) > 1) + 1) if len(open_) else []
        return [(int(run[0]), int(run[-1]) + 1) for run in runs]

    def finest(self, number: int) -> float:
        """Return the length of the finest steps of a group, in strides (initial distances between knots)."""
        return FINEST_STEP if self.forms[number] else TRACKING.finest_general

    def width(self, number: int) -> float:
        """Return the largest total length of the uncertain steps around a change point.

        The length is a difference in the path parameter.
        """
        finest_steps = TRACKING.dyad_change_width if self.forms[number] else TRACKING.general_change_width
        return finest_steps * self.finest(number) * self.path.stride

    def before(self, row: int, place: float) -> int:
        """Return the index of the knot at which the step of a design that contains a point on the path begins.

        For a point outside the tracked range, use the first or last step.
        """
        return int(knots_before(self.table, np.array([place]), self.rows)[row, 0])

    def end(self, number: int, row: int, sense: int, place: float) -> None:
        """End the branch of a group at a point on the path: set the group to nan beyond this point.

        `sense` is 1 for points after the drawing, and -1 for points before it.
        """
        ends = {sense: np.full(self.rows, sense * np.inf) for sense in (1, -1)}
        ends[sense][row] = place
        self._end_beyond(number, ends[-1], ends[1])

    def _end_beyond(self, number: int, low: Reals, high: Reals) -> None:
        """Set a group to nan outside the range from `low` to `high` on the path, each of shape (designs,)."""

        def outside(table: Table) -> Flags:
            row, place = table["row"], table["place"]
            return (place < low[row]) | (place > high[row])

        self.table = table = select(self.table, ~outside(self.table) | self.table["coarse"])
        unknown = outside(table)
        self._clear(number, unknown)
        at = steps(table)
        at = at[unknown[at] | unknown[at + 1]]
        table[f"certain{number}"][at] = False
        table[f"box{number}"][at] = np.nan

    def _clear(self, number: int, unknown: Flags | Integers) -> None:
        """Set a group to nan at selected knots."""
        table = self.table
        for name in ("origin", "direction"):
            for link in self.structure.groups[number].links:
                table[name][unknown, link] = np.nan
        table["sine"][unknown, number] = np.nan
        for name in ("free", "columns", "duals"):
            table[f"{name}{number}"][unknown] = np.nan

    def closed(self, sense: int) -> bool:
        """Return whether the branch of every design ends within the tracked range.

        `sense` is 1 for an end after the drawing on the path, and -1 for an end before it.
        """
        row = self.table["row"]
        outermost = np.flatnonzero(np.diff(row, append=-1) if sense > 0 else np.diff(row, prepend=-1))
        return bool(np.isnan(self.table["sine"][outermost]).any(axis=1).all())

    # Dyads

    def follow_dyad(self, number: int) -> None:
        """Track a dyad in both directions, and change its sign at each change point.

        The branch ends at a point at which the dyad cannot close or the coordinate of a slider goes to infinity.
        """
        self.set(self.table, number)
        self.refine(number, steps(self.table))
        self._end_at_open_knots(number)
        if len(behind := self._knots_beyond_infinity(number)):
            self._clear(number, behind)
            self._end_at_open_knots(number)
        place, row = self.table["place"], self.table["row"]
        sign = np.ones(len(place))
        for at in self._change_points(number):
            if self.path.keeps_direction(place[at - 1], place[at + 1]):
                beyond = place > place[at] if place[at] >= self.path.begin else place < place[at]
                sign[beyond & (row == row[at])] *= -1.0
        if (sign < 0).any():
            ended = np.isnan(self.table["sine"][:, number])
            self.table["sign"][:, number] = sign
            self.set(self.table, number)
            self._clear(number, ended)

    def _end_at_open_knots(self, number: int) -> None:
        """End the branch at the first knot at which a dyad does not close, before and after the drawing."""
        open_ = np.isnan(self.table["sine"][:, number])
        if not open_.any():
            return
        row, place = self.table["row"][open_], self.table["place"][open_]
        low, high = np.full(self.rows, -np.inf), np.full(self.rows, np.inf)
        above, below = place >= self.path.begin, place <= self.path.begin
        np.minimum.at(high, row[above], place[above])
        np.maximum.at(low, row[below], place[below])
        self._end_beyond(number, low, high)

    def _knots_beyond_infinity(self, number: int) -> Integers:
        """Return the index of the first knot beyond each point at which the slider coordinate of a dyad is infinite.

        At such a point two sliding lines are parallel, and the sine of the angle between them changes sign. Points at
        which the lines coincide are not included, because there the slider coordinate is finite and smooth.
        """
        table, at = self.table, steps(self.table)
        place, sine = table["place"], table["sine"][:, number]
        at = at[~table[f"certain{number}"][at] & (sine[at] * sine[at + 1] <= 0)]
        at = at[place[at + 1] - place[at] <= 2 * FINEST_STEP * self.path.stride]
        slides = table[f"free{number}"][:, ~np.array(self.structure.groups[number].angles)]
        jump = np.abs(slides[at + 1] - slides[at]).max(axis=1, initial=0.0)
        at = at[~(jump <= TRACKING.max_jump * self.mechanism.size)]
        return np.where(place[at + 1] > self.path.begin, at + 1, at)

    def _change_points(self, number: int) -> list[int]:
        """Return the indices of the knots closest to change points.

        At a change point, two branches meet, and the sine of the dyad (see `dyads`) touches zero.
        """
        table = self.table
        uncertain = ~table[f"certain{number}"] & (
            np.diff(table["place"], append=np.inf) <= 2 * FINEST_STEP * self.path.stride
        )
        return touches(table["place"], table["row"], table["sine"][:, number], uncertain, self.width(number))
