"""Comparison of the closed forms with finite elements."""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from elastic import PRIMARY, Deflection, Taper, sample
from fem_check.linear.solution import Solution
from rigid import Reals
from rigid.arrays import Columns

TOLERANCE = 1e-8
"""Tolerance for prismatic beams, for which nodal values are exact except for round-off."""
MAX_TOLERANCE = 1e-3
"""Largest tolerance for tapered beams, for which nodal values converge with order four."""
TAPER_DIVISOR = 250.0
"""The tolerance for tapered beams is the fourth power of the relative change of rigidity in an element, over this.

Measured errors were 1/7 to 1/2 of this tolerance.
"""
MIN_REFERENCE = 1e-6
"""Smallest reference for the relative difference of a field, relative to the value expected from other fields."""
MIN_NODE_DISTANCE = 1e-9
"""Section forces jump at a block. They are not compared at nodes closer than this to a block [beam lengths]."""


class Worst(Struct, frozen=True):
    """Largest difference in a field between closed forms and finite elements.

    Attributes
    ----------
    field
        Name of the field.
    beam, xi
        Index of the beam and x'/l at which the difference occurs.
    position
        Index of the position, or (design, position) if there are several designs.
    difference
        Absolute difference [unit of the field].
    scale
        Largest magnitude of the field over all beams, nodes and positions, or `MIN_REFERENCE` times the value expected
        from other fields if this is larger.
    relative
        `difference` divided by `scale`.
    """

    field: str
    beam: int
    xi: float
    position: int | tuple[int, ...]
    difference: float
    scale: float
    relative: float


class Comparison(Struct, frozen=True, eq=False):
    """Differences of N, V, M, u, w, phi at the nodes.

    Attributes
    ----------
    worst
        Largest difference in each field, in the order of `elastic.PRIMARY`.
    relative
        Largest difference in each field on each beam over the cycle, relative to the largest magnitude of the field on
        any beam, shape (6, beams). `passed` compares this value with `tolerance`.
    own
        Largest difference in each field on each beam over the cycle, relative to the largest magnitude of the field on
        the same beam, shape (6, beams). This measure is stricter for stiff beams.
    compared
        Number of positions for which both solutions exist (all positions if there are no beams). At a position for
        which only one of the two solutions exists, the difference is infinite. Positions with a block beyond its beam
        are excluded. N, V and M at a node under a block are also excluded.
    elements
        Number of elements per beam.
    tolerance
        Largest accepted value of `relative`.
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
        """Whether positions were compared and no field exceeds the tolerance."""
        return self.compared > 0 and bool((self.relative <= self.tolerance).all())


def compare(deflection: Deflection, solution: Solution, tolerance: float | None = None) -> Comparison:
    """Compare the closed forms with finite elements at the nodes, by field and beam.

    Parameters
    ----------
    tolerance
        Largest accepted relative difference. The default is `TOLERANCE` for prismatic beams. For tapered beams, the
        default is an estimate of the discretization error, 1/elements^4, and larger for steep tapers (see
        `TAPER_DIVISOR`).

    Raises
    ------
    ValueError
        If the numbers of beams or positions differ.
    """
    expected = (len(deflection.sections), *deflection.motion.columns)
    if expected != solution.w.shape[:-1]:
        raise ValueError(f"a deflection of {expected} beams and positions, a solution of {solution.w.shape[:-1]}")
    if tolerance is None:
        tolerance = _tolerance_for([section.taper for section in solution.sections if section.taper], solution.elements)
    values = np.array([sample(deflection, field, solution.xi) for field in PRIMARY])
    checked = np.array([getattr(solution, field) for field in PRIMARY])
    _exclude(deflection, solution.xi, values, checked)
    known, checked_known = np.isfinite(values), np.isfinite(checked)
    magnitude = np.where(known, np.abs(values), 0.0)
    difference = np.where(
        known & checked_known,
        np.abs(np.where(known & checked_known, values - checked, 0.0)),
        np.where(known | checked_known, np.inf, 0.0),
    )
    beams = values.shape[1]
    flat = difference.reshape(len(PRIMARY), beams, int(np.prod(values.shape[2:])))
    length = np.array([np.max(value) for value in deflection.length])
    stretched, bent = (
        np.array([np.max(1.0 / np.asarray(getattr(section, name), float)) for section in deflection.sections])
        * length**power
        for name, power in (("EA", 1), ("EI", 3))
    )
    by_beam = _with_minimum(magnitude.reshape(flat.shape).max(axis=2, initial=0.0), length, stretched, bent)
    longest, *softest = (values.max(initial=0.0) for values in (length, stretched, bent))
    scale = _with_minimum(magnitude.reshape(len(PRIMARY), flat[0].size).max(axis=1, initial=0.0), longest, *softest)
    greatest = flat.max(axis=2, initial=0.0)
    worst = tuple(
        _worst(field, difference[k], float(scale[k]), solution.xi) for k, field in enumerate(PRIMARY) if beams
    )
    compared = int((known & checked_known)[3:].all(axis=(0, 1, -1)).sum())
    return Comparison(
        worst, _ratio(greatest, scale[:, None]), _ratio(greatest, by_beam), compared, solution.elements, tolerance
    )


def _tolerance_for(tapers: Sequence[Taper], elements: int) -> float:
    """Return the default tolerance for tapered beams with a number of elements."""
    if not tapers:
        return TOLERANCE
    xi = np.linspace(0.0, 1.0, 65)
    steepest = 0.0
    for taper in tapers:
        for along in (np.polynomial.Polynomial(taper.EA), np.polynomial.Polynomial(taper.EI)):
            steepest = max(steepest, float(np.abs(along.deriv()(xi) / along(xi)).max()))
    left = max(1.0, steepest**4 / TAPER_DIVISOR) * elements**-4.0
    return float(max(TOLERANCE, min(MAX_TOLERANCE, left)))


def _exclude(deflection: Deflection, xi: Reals, values: Reals, checked: Reals) -> None:
    """Replace values that cannot be compared by nan.

    These are values at ill-conditioned positions, at positions with a block beyond its beam, and at jumps in section
    forces.
    """
    for array in (values, checked):
        array[:, :, deflection.lost] = np.nan
    for block in deflection.blocks:
        lost = np.isnan(block.xi)
        jump = (np.abs(xi - np.asarray(block.xi)[..., None]) <= MIN_NODE_DISTANCE) & np.asarray(block.here)[..., None]
        for array in (values, checked):
            array[:, :, lost] = np.nan
            array[:3, block.beam][:, jump] = np.nan


def _with_minimum(greatest: Reals, length: Columns, stretched: Columns, bent: Columns) -> Reals:
    """Increase the magnitudes of fields to at least `MIN_REFERENCE` times the values expected from other fields.

    `greatest` are the largest magnitudes of N, V, M, u, w, phi. `length`, `stretched` (l/EA) and `bent` (l^3/EI) relate
    the fields to each other.
    """
    force, moved = greatest[:2].max(axis=0), greatest[3:5].max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.maximum(force, np.nan_to_num(greatest[2] / length))
        size_u, size_w = np.maximum(moved, force * stretched), np.maximum(moved, force * bent)
        turned = np.nan_to_num(size_w / length)
    return np.maximum(greatest, MIN_REFERENCE * np.array([force, force, force * length, size_u, size_w, turned]))


def _ratio(difference: Reals, scale: Reals) -> Reals:
    """Return the difference divided by the scale, or zero if there is no difference."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: Reals = np.where(difference == 0.0, 0.0, difference / scale)
    return ratio


def _worst(field: str, difference: Reals, scale: float, xi: Reals) -> Worst:
    """Locate the largest difference in an array of shape (beams, ..., positions, nodes)."""
    beam, *position, node = (int(number) for number in np.unravel_index(np.argmax(difference), difference.shape))
    value = float(difference[beam, *position, node])
    where = position[0] if len(position) == 1 else tuple(position)
    relative = float(_ratio(np.array(value), np.array(scale)))
    return Worst(field, beam, float(xi[node]), where, value, scale, relative)
