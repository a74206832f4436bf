"""Proof that exactly one branch of a group of links runs through a step on the path of the drives.

A step leads from one knot of the path to the next. The proof gives a box: bounds on the deviation of the free
coordinates from linear motion between the ends of the step. Derivation: docs/theory.md, "The branch".
"""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Columns, Complexes, Integers, Real, Reals
from rigid.decomposition.groups import Group
from rigid.joints import Joint
from rigid.plane import ROUND_OFF

MAX_ATTEMPTS = 6  # maximum number of attempts to find a box that Newton's method maps into itself
INFLATION = 1.05  # factor by which a box is enlarged before each attempt
GAP_ROUND_OFF = 4 * ROUND_OFF  # round-off of a gap, relative to the sum of the lengths of the vectors in its loop
MIN_BOX = 1e-13  # [rad or m] smallest half width of a box, so that the box contains errors due to round-off


class KnotStep(Struct, frozen=True, eq=False):
    """Motion of the links in steps on the path of the drives, each from one knot to the next.

    The last axis of each array runs over the steps.

    Attributes
    ----------
    row
        Index of the design.
    origin, shift
        Origin of each link at the first knot of the step, and its displacement in the step (complex) [m], shape (links,
        steps).
    turned
        Rotation of each link in the step [rad], shape (links, steps).
    bend
        Bound on the deviation of each link's angle from linear motion in the step [rad], shape (links, steps).
    stray
        Bound on the deviation of each link's origin from linear motion in the step [m], shape (links, steps). `bend`
        and `stray` are 0 for the links of groups that are not yet processed.
    """

    row: Integers
    origin: Complexes
    shift: Complexes
    turned: Reals
    bend: Reals
    stray: Reals


class Ends(Struct, frozen=True, eq=False):
    """Data of a group at the start and at the end of each step (index 0 and 1 of the first axis of each array).

    Attributes
    ----------
    free
        Coordinates of the free joints, shape (2, free, steps).
    columns, duals
        Derivatives of the gaps with respect to the free coordinates, and dual vectors (see `Closure`), complex, shape
        (2, free, cuts, steps) each.
    """

    free: Reals
    columns: Complexes
    duals: Complexes


class Loop(Struct, frozen=True, eq=False):
    """Terms that add up to the gap of a cut joint, i.e. a joint that closes a loop.

    The terms are vectors that rotate with links, and origins of links of earlier groups.

    Attributes
    ----------
    arms
        For each link, by index, the sum of the vectors that rotate with this link, in link axes [m].
    slides
        For each sliding tree joint, by index, the sign with which its slide vector is in the sum. This vector rotates
        with the child of the joint.
    roots
        For each link of earlier groups, by link index, the factor with which its origin is in the sum.
    owner
        If the cut joint is a slider, the link in whose axes its gap is expressed; None for a pin.
    """

    arms: Mapping[int, Columns]
    slides: Mapping[int, int]
    roots: Mapping[int, int]
    owner: int | None


def loop(group: Group, cut: Joint) -> Loop:
    """Return the loop that a cut joint closes."""
    arms: dict[int, Any] = {}
    slides: dict[int, int] = {}
    roots: dict[int, int] = {}
    hinges = dict(zip(group.links, enumerate(group.tree), strict=True))
    for end, at, sign in ((cut.child, cut.at_child, 1), (cut.parent, cut.at_parent, -1)):
        link, point = end, at
        while link in hinges:
            number, hinge = hinges[link]
            arms[link] = arms.get(link, 0.0) + sign * (point - hinge.at_child)
            if not hinge.turns:
                slides[number] = slides.get(number, 0) + sign
            link, point = hinge.parent, hinge.at_parent
        arms[link] = arms.get(link, 0.0) + sign * point
        roots[link] = roots.get(link, 0) + sign
    slides, roots = ({key: value for key, value in each.items() if value} for each in (slides, roots))
    return Loop(arms, slides, roots, None if cut.turns else cut.owner)


class StepCertificate:
    """Proof that exactly one branch of a group runs through a step, close to linear motion, for many steps at once."""

    def __init__(self, group: Group, loops: tuple[Loop, ...], step: KnotStep, ends: Ends) -> None:
        self.group, self.loops, self.step, self.ends = group, loops, step, ends
        self.carried = [{link for link, _ in carried} for carried in group.carried]
        self.base = self._base()

    def _base(self) -> dict[int, Reals]:
        """Return for each link the part of its bound `KnotStep.bend` that is due to earlier groups."""
        base = {link: self.step.bend[link] for link in range(len(self.step.bend))}
        for hinge in self.group.tree:
            base[hinge.child] = base[hinge.parent]
            if hinge.gear is not None and hinge.turns:
                base[hinge.child] = base[hinge.child] + self._follower_deviation(hinge)
        return base

    def _follower_deviation(self, hinge: Joint) -> Reals:
        """Return a bound on the deviation of the follower of a gear from linear motion [rad or m]."""
        assert hinge.gear is not None
        total: Reals = np.zeros(())
        for ratio, driver in hinge.gear.sources:
            if not driver.moved:
                deviation = self.step.bend if driver.turns else self.step.stray
                total = total + abs(ratio) * sum(deviation[link] for link in (driver.parent, driver.child))
        return total

    def _size(self, arm: Columns) -> Real:
        size = np.abs(arm)
        return np.ravel(size)[self.step.row] if np.ndim(size) else size

    @cached_property
    def _slide(self) -> dict[int, tuple[Reals, Reals]]:
        """Bounds on the coordinate of each slider of the tree, and on its change in the step [m], by joint index."""
        travels = {}
        for number, hinge in enumerate(self.group.tree):
            if hinge.turns:
                continue
            if number in self.group.free:
                low, high = self.ends.free[:, self.group.free.index(number)]
                travels[number] = np.maximum(np.abs(low), np.abs(high)), np.abs(high - low)
                continue
            moved = np.abs(self.step.shift[hinge.block] - self.step.shift[hinge.owner])
            away = np.abs(self.step.origin[hinge.block] - self.step.origin[hinge.owner])
            travels[number] = away + moved + self._size(hinge.at_child) + self._size(hinge.at_parent), moved
        return travels

    def _relative(self, link: int | None, owner: int | None) -> tuple[Columns, Columns]:
        """Return the rotation of a link relative to another link in the step, and the sum of their bounds `bend`."""
        if link == owner:
            return 0.0, 0.0
        turned = (0.0 if link is None else self.step.turned[link]) - (0.0 if owner is None else self.step.turned[owner])
        return turned, sum(self.base[each] for each in (link, owner) if each is not None)

    def _deviation(self, loop: Loop, links: set[int] | None) -> Columns:
        """Return a bound on the deviation of a part of a loop from linear motion [m].

        The part is the sum of those vectors of the loop that rotate with `links`. If `links` is None, it is the whole
        loop including the origins.
        """
        total: Any = 0.0
        for link, arm in loop.arms.items():
            if links is None or link in links:
                turned, bend = self._relative(link, loop.owner)
                total = total + self._size(arm) * (turned**2 / 8 + bend)
        for number in loop.slides:
            child = self.group.tree[number].child
            if links is None or child in links:
                most, change = self._slide[number]
                turned, bend = self._relative(child, loop.owner)
                total = total + most * (turned**2 / 8 + bend) + change * np.abs(turned) / 4
        if links is None and loop.roots:
            here = sum(weight * self.step.origin[link] for link, weight in loop.roots.items())
            change = np.abs(sum(weight * self.step.shift[link] for link, weight in loop.roots.items()))
            turned, bend = self._relative(None, loop.owner)
            total = total + (np.abs(here) + change) * (turned**2 / 8 + bend) + change * np.abs(turned) / 4
            total = total + sum(abs(weight) * self.step.stray[link] for link, weight in loop.roots.items())
        return total

    def _extent(self, loop: Loop) -> Columns:
        """Return the sum of the lengths of a loop's vectors [m], to which round-off is proportional."""
        total = sum(self._size(arm) for arm in loop.arms.values())
        total = total + sum(self._slide[number][0] for number in loop.slides)
        return total + sum(np.abs(self.step.origin[link]) for link in loop.roots)

    def _slope(self, loop: Loop, k: int, links: set[int] | None) -> Columns:
        """Return a bound on the derivative of a part of a loop with respect to free coordinate k.

        The part is the sum of those vectors of the loop that rotate with `links`, or of all vectors if `links` is None.
        """
        turns = self.group.angles[k]
        owned = turns and loop.owner is not None and loop.owner in self.carried[k]
        total: Any = 0.0
        for link, arm in loop.arms.items():
            if links is None or link in links:
                times = (turns and link in self.carried[k]) + owned if link != loop.owner else 0
                total = total + times * self._size(arm)
        for number in loop.slides:
            child = self.group.tree[number].child
            if links is None or child in links:
                times = (turns and child in self.carried[k]) + owned if child != loop.owner else 0
                total = total + times * self._slide[number][0] + (number == self.group.free[k])
        return total

    @cached_property
    def box(self) -> Reals:
        """Bounds on the deviation of the free coordinates from linear motion, shape (free, steps).

        They are nan for steps in which the proof fails.
        """
        free, cuts, count = len(self.group.free), len(self.loops), len(self.step.row)
        if not free:
            return np.zeros((0, count))
        gap, twist = np.zeros((2, cuts, count))
        bent = np.zeros((free, cuts, count))
        slope = np.zeros((free, free, cuts, count))
        for c, (each, cut) in enumerate(zip(self.loops, self.group.cut, strict=True)):
            gap[c] = self._deviation(each, None) + GAP_ROUND_OFF * self._extent(each)
            twist[c] = 0.0 if cut.turns else self.base[cut.parent] + self.base[cut.child]
            for j, number in enumerate(self.group.free):
                hinge = self.group.tree[number]
                if hinge.turns:
                    bent[j, c] = self._deviation(each, self.carried[j])
                    for k in range(free):
                        slope[j, k, c] = self._slope(each, k, self.carried[j])
                elif number in each.slides:
                    turned, bend = self._relative(hinge.child, each.owner)
                    bent[j, c] = turned**2 / 8 + bend
                    for k in range(free):
                        turns = self.group.angles[k]
                        rotations = (hinge.child in self.carried[k]) + (
                            each.owner is not None and each.owner in self.carried[k]
                        )
                        slope[j, k, c] = turns * rotations * (hinge.child != each.owner)
        with np.errstate(all="ignore"):
            return self._invariant_boxes(gap, twist, bent, slope)

    def _invariant_boxes(self, gap: Reals, twist: Reals, bent: Reals, slope: Reals) -> Reals:
        """Return boxes of free coordinates that Newton's method with a constant matrix maps into themselves.

        This must hold for the matrix at the start of the step and for the matrix at its end. A box is nan if this
        cannot be shown.

        If the free coordinates move linearly in the step, the joints do not close exactly. `gap` bounds the gaps in
        this motion, and `twist` the errors in the angles at sliders, each of shape (cuts, steps). The derivatives of
        the gaps with respect to the free coordinates deviate from linear interpolation by at most `bent`, shape (free,
        cuts, steps). `slope` bounds the second derivatives of the gaps, shape (free, free, cuts, steps).
        """
        lines = np.array(self.group.guides)[:, None]
        box: Any = MIN_BOX
        maps = []
        for duals, sign in zip(self.ends.duals, (0.5, -0.5), strict=True):
            weight = np.where(lines, np.abs(duals.real), np.abs(duals))
            change = sign * (self.ends.columns[1] - self.ends.columns[0])
            start = (weight * gap).sum(axis=1) + (np.abs(duals.imag) * lines * twist).sum(axis=1)
            first = np.abs((duals[:, None] * change).sum(axis=2).imag) + (weight[:, None] * bent).sum(axis=2)
            maps.append((start + MIN_BOX, first, (weight[:, None, None] * slope).sum(axis=3)))
            box = np.maximum(box, start)
        certain = np.zeros(box.shape[1:], bool)
        for _ in range(MAX_ATTEMPTS):
            # do not enlarge proven boxes, because a larger box may be unproven
            box = np.where(certain, box, box * INFLATION)
            again = np.max([self._mapped(each, box) for each in maps], axis=0)
            certain = (again < box).all(axis=0)
            if certain.all():
                break
            box = np.where(certain, box, np.maximum(again, box))
        return np.where(certain, box, np.nan)

    @staticmethod
    def _mapped(each: tuple[Reals, Reals, Reals], box: Reals) -> Reals:
        start, first, second = each
        return start + ((first + (second * box).sum(axis=2)) * box).sum(axis=1)

    def fill(self, box: Reals) -> None:
        """Set the bounds `bend` and `stray` in `KnotStep` for the links of the group, given that `box` holds."""
        step = self.step
        for number, hinge in enumerate(self.group.tree):
            parent, child = hinge.parent, hinge.child
            free = self.group.free.index(number) if number in self.group.free else None
            bend = step.bend[parent] + (box[free] if free is not None and hinge.turns else 0.0)
            follower = self._follower_deviation(hinge) if hinge.gear is not None else 0.0
            step.bend[child] = bend + (follower if hinge.turns else 0.0)
            stray = step.stray[parent]
            for link, arm in ((parent, hinge.at_parent), (child, hinge.at_child)):
                stray = stray + self._size(arm) * (step.turned[link] ** 2 / 8 + step.bend[link])
            if not hinge.turns:
                most, change = self._slide[number]
                stray = stray + most * (step.turned[child] ** 2 / 8 + bend) + change * np.abs(step.turned[child]) / 4
                stray = stray + (box[free] if free is not None else follower)
            step.stray[child] = stray
