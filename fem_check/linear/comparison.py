"""How far the closed forms and the finite elements differ, and where most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastic import PRIMARY, Deflection, Taper, sample
from fem_check.linear.solution import Solution
from rigid import Reals
from rigid.arrays import Columns

TOLERANCE = 1e-8
"""Granted to beams without taper, whose nodal values are exact: room for round-off in ill-conditioned positions."""
COARSEST = 1e-3
"""What is granted at most to elements of tapered beams, whose nodal values are exact to the fourth order only."""
STEEPNESS = 250.0
"""Divides the fourth power of how much rigidities change over an element; of that errors were a seventh to a half."""
FLOOR = 1e-6
"""A field that stays below this part of its companions counts as zero, and is measured against that part of them."""
AT_NODE = 1e-9
"""How near to a node, in lengths of the beam, a block may be for the section forces that jump there to be compared."""


@dataclass(frozen=True)
class Worst:
    """Where a field differs most.

    `beam`, `xi` and `position` (or (design, position)) say where; `difference` [units of the field] is absolute,
    `relative` against `scale`, the field's greatest magnitude over all beams, nodes and positions.
    """

    field: str
    beam: int
    xi: float
    position: int | tuple[int, ...]
    difference: float
    scale: float
    relative: float


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Differences of N, V, M, u, w, phi at the nodes.

    Attributes
    ----------
    worst
        Per field, in the order of `elastic.PRIMARY`.
    relative
        Greatest difference of every field and beam over the cycle, against the field's greatest magnitude over the
        cycle on any beam, shape (6, beams): what passes or fails.
    own
        The same against the field's greatest magnitude on that beam alone, which asks more of a beam that bends little.
    compared
        Number of positions at which both sides have an answer (all, where no beam asks for one). Where one side has an
        answer and the other has none, the difference is infinite. Positions where a slider's block is beyond its beam
        are left out, and so are N, V, M at a node that a block is at.
    tolerance
        On `relative`.
    """

    worst: tuple[Worst, ...]
    relative: Reals
    own: Reals
    compared: int
    elements: int
    tolerance: float

    def __repr__(self) -> str:
        largest = float(self.relative.max(initial=0.0))
        return f"Comparison(passed={self.passed}, {self.compared} positions, {largest:.2g} of {self.tolerance:.2g})"

    @property
    def passed(self) -> bool:
        """Whether something was compared and no field differs by more than the tolerance."""
        return self.compared > 0 and bool((self.relative <= self.tolerance).all())


def compare(deflection: Deflection, solution: Solution, tolerance: float | None = None) -> Comparison:
    """Difference of closed forms and finite elements at the nodes, field by field and beam by beam.

    Parameters
    ----------
    tolerance
        `TOLERANCE` unless said, and where beams taper what so many elements may leave: 1/elements^4, more where they
        taper steeply.

    Raises
    ------
    ValueError
        The two are not of as many beams and positions.
    """
    asked = (len(deflection.sections), *deflection.motion.columns)
    if asked != solution.w.shape[:-1]:
        raise ValueError(f"a deflection of {asked} beams and positions, a solution of {solution.w.shape[:-1]}")
    if tolerance is None:
        tolerance = _granted([section.taper for section in solution.sections if section.taper], solution.elements)
    values = np.array([sample(deflection, field, solution.xi) for field in PRIMARY])
    checked = np.array([getattr(solution, field) for field in PRIMARY])
    _leave_out(deflection, solution.xi, values, checked)
    known, checked_known = np.isfinite(values), np.isfinite(checked)
    magnitude = np.where(known, np.abs(values), 0.0)
    difference = np.where(
        known & checked_known,
        np.abs(np.where(known & checked_known, values - checked, 0.0)),
        np.where(known | checked_known, np.inf, 0.0),
    )
    beams = values.shape[1]
    flat = difference.reshape(len(PRIMARY), beams, int(np.prod(values.shape[2:])))
    floor = _Floor(deflection)
    by_beam = floor.lifted(magnitude.reshape(flat.shape).max(axis=2, initial=0.0))
    scale = floor.lifted_over_all(magnitude.reshape(len(PRIMARY), flat[0].size).max(axis=1, initial=0.0))
    greatest = flat.max(axis=2, initial=0.0)
    worst = tuple(
        _worst(field, difference[k], float(scale[k]), solution.xi) for k, field in enumerate(PRIMARY) if beams
    )
    compared = int((known & checked_known)[3:].all(axis=(0, 1, -1)).sum())
    return Comparison(
        worst, _ratio(greatest, scale[:, None]), _ratio(greatest, by_beam), compared, solution.elements, tolerance
    )


def _granted(tapers: Sequence[Taper], elements: int) -> float:
    """Tolerance for beams that taper so, cut into so many elements."""
    if not tapers:
        return TOLERANCE
    xi = np.linspace(0.0, 1.0, 65)
    steepest = 0.0
    for taper in tapers:
        for along in (np.polynomial.Polynomial(taper.EA), np.polynomial.Polynomial(taper.EI)):
            steepest = max(steepest, float(np.abs(along.deriv()(xi) / along(xi)).max()))
    left = max(1.0, steepest**4 / STEEPNESS) * elements**-4.0
    return float(max(TOLERANCE, min(COARSEST, left)))


def _leave_out(deflection: Deflection, xi: Reals, values: Reals, checked: Reals) -> None:
    """Mark values left out: at positions lost to round-off or with blocks beyond beams, forces that jump at a node."""
    for array in (values, checked):
        array[:, :, deflection.lost] = np.nan
    for block in deflection.blocks:
        lost = np.isnan(block.xi)
        jump = (np.abs(xi - np.asarray(block.xi)[..., None]) <= AT_NODE) & np.asarray(block.here)[..., None]
        for array in (values, checked):
            array[:, :, lost] = np.nan
            array[:3, block.beam][:, jump] = np.nan


class _Floor:
    """Least base of relative differences: `FLOOR` of the fields that forces and displacements would make."""

    def __init__(self, deflection: Deflection) -> None:
        self.length = np.array([np.max(value) for value in deflection.length])
        self.stretch, self.bend = (
            np.array([np.max(1.0 / np.asarray(getattr(section, name), float)) for section in deflection.sections])
            for name in ("EA", "EI")
        )

    def lifted(self, greatest: Reals) -> Reals:
        """Greatest magnitudes of the six fields on every beam, shape (6, beams), lifted to the floor."""
        return _lifted(greatest, self.length, self.stretch * self.length, self.bend * self.length**3)

    def lifted_over_all(self, greatest: Reals) -> Reals:
        """The same over all beams, shape (6,): the longest and the softest set the floor."""
        soft = ((row * self.length**power).max(initial=0.0) for row, power in ((self.stretch, 1), (self.bend, 3)))
        return _lifted(greatest, self.length.max(initial=0.0), *soft)


def _lifted(greatest: Reals, length: Columns, stretched: Columns, bent: Columns) -> Reals:
    """Greatest magnitudes, lifted to `FLOOR` of those that the others would make on a beam of such a size."""
    force, moved = greatest[:2].max(axis=0), greatest[3:5].max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.maximum(force, np.nan_to_num(greatest[2] / length))
        size_u, size_w = np.maximum(moved, force * stretched), np.maximum(moved, force * bent)
        turned = np.nan_to_num(size_w / length)
    lifted: Reals = np.maximum(greatest, FLOOR * np.array([force, force, force * length, size_u, size_w, turned]))
    return lifted


def _ratio(difference: Reals, scale: Reals) -> Reals:
    """Difference over scale; zero where both are."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: Reals = np.where(difference == 0.0, 0.0, difference / scale)
    return ratio


def _worst(field: str, difference: Reals, scale: float, xi: Reals) -> Worst:
    """Place of the greatest difference, from an array of shape (beams, ..., positions, nodes)."""
    beam, *position, node = (int(number) for number in np.unravel_index(np.argmax(difference), difference.shape))
    value = float(difference[beam, *position, node])
    where = position[0] if len(position) == 1 else tuple(position)
    relative = float(_ratio(np.array(value), np.array(scale)))
    return Worst(field, beam, float(xi[node]), where, value, scale, relative)
