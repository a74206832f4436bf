"""How far the closed forms and the finite elements differ, and where most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic import FIELDS, Deflection, sample
from fem_check.solution import Solution
from rigid import Reals

TOLERANCE = 1e-8
FLOOR = 1e-6
"""A field that stays below this part of its companions counts as zero, and is measured against that part of them."""


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


@dataclass(frozen=True, eq=False)
class Comparison:
    """Differences of N, V, M, u, w, phi at the nodes.

    Attributes
    ----------
    worst
        Per field, in the order of `elastic.FIELDS`.
    relative
        Greatest difference of every field and beam over the cycle, against the field's greatest magnitude over the
        cycle on any beam, shape (6, beams): what passes or fails.
    own
        The same against the field's greatest magnitude on that beam alone, which asks more of a beam that bends little.
    compared
        Number of positions at which both sides have an answer (all, where no beam asks for one). Where one side has an
        answer and the other has none, the difference is infinite.
    tolerance
        On `relative`.
    """

    worst: tuple[Worst, ...]
    relative: Reals
    own: Reals
    compared: int
    elements: int
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether something was compared and no field differs by more than the tolerance."""
        return self.compared > 0 and bool((self.relative <= self.tolerance).all())


def compare(deflection: Deflection, solution: Solution, tolerance: float = TOLERANCE) -> Comparison:
    """Difference of closed forms and finite elements at the nodes, field by field and beam by beam.

    Raises
    ------
    ValueError
        The two are not of as many beams and positions.
    """
    if deflection.w.shape[1:] != solution.w.shape[:-1]:
        raise ValueError(
            f"a deflection of {deflection.w.shape[1:]} beams and positions, a solution of {solution.w.shape[:-1]}"
        )
    values = np.array([sample(deflection, field, solution.xi) for field in FIELDS])
    found = np.array([getattr(solution, field) for field in FIELDS])
    one, other = np.isfinite(values), np.isfinite(found)
    magnitude = np.where(one, np.abs(values), 0.0)
    difference = np.where(
        one & other, np.abs(np.where(one & other, values - found, 0.0)), np.where(one | other, np.inf, 0.0)
    )
    beams = values.shape[1]
    flat = difference.reshape(len(FIELDS), beams, int(np.prod(values.shape[2:])))
    length = np.array([np.max(value) for value in deflection.length])
    by_beam = _scales(magnitude.reshape(flat.shape).max(axis=2, initial=0.0), length)
    scale = _scales(magnitude.reshape(len(FIELDS), flat[0].size).max(axis=1, initial=0.0), length.max(initial=0.0))
    greatest = flat.max(axis=2, initial=0.0)
    worst = tuple(_worst(field, difference[k], float(scale[k]), solution.xi) for k, field in enumerate(FIELDS) if beams)
    compared = int((one & other).all(axis=(0, 1, -1)).sum())
    return Comparison(
        worst, _ratio(greatest, scale[:, None]), _ratio(greatest, by_beam), compared, solution.elements, tolerance
    )


def _scales(greatest: Reals, length: Reals) -> Reals:
    """Greatest magnitudes, lifted to `FLOOR` of what the greater of N and V, or of u and w, would make of them."""
    force, size = FLOOR * greatest[:2].max(axis=0), FLOOR * greatest[3:5].max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        lifts = np.array([force, force, force * length, size, size, np.nan_to_num(size / length)])
    lifted: Reals = np.maximum(greatest, lifts)
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
