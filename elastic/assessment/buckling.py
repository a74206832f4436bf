"""Buckling of the whole mechanism: load / critical load, at which the tangent stiffness is singular.

With locked drives, K + f K_G is the stiffness under f times all forces. K is due to links, compliant joints and
springs. K_G is due to the axial forces of displaced links and to forces that rotate or move with the links. The load
ratio is the reciprocal of the smallest positive f for which the sum is singular. A force that rotates with its link
makes K_G unsymmetric. Complex roots then mean flutter, which statics cannot judge. The equations are in docs/theory.md.

References
----------
Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., section 2.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastic.assessment.buckling_bound import buckling_bound
from elastic.elastodynamics.displacements import (
    Displacements,
    at_joints,
    own_basis,
    rigid_body_modes,
    unit_displacements,
)
from elastic.elastodynamics.elastic_structure import ElasticStructure, elastic_structure
from elastic.elastodynamics.equations_of_motion import GeometricStiffness, geometric_stiffness
from elastic.elastodynamics.point_effects import chosen_points
from elastic.links.beam_trees import trees_of
from elastic.solution import Deflection
from rigid import PointLoad, Reals
from rigid.arrays import Flags, Integers, distinct

INNER_POLYNOMIALS = 4  # number of inner polynomials per beam and direction
MAX_IMAGINARY = 1e-9  # roots with a smaller imaginary part count as real; relative to the largest root
ROUND_OFF = 1e-12  # roots smaller than this count as zero; relative to the largest root
RESOLVED = 0.2  # ratios above this are found at whichever position they occur
EVEN_POSITIONS = 13  # number of evenly spaced positions that are always computed
VIBRATING_POSITIONS = 61  # same, for loads from vibration, which vary faster
BATCH_POSITIONS = 8  # number of positions computed at once
UNKNOWN = -1.0  # marks a position at which the ratio has not been computed


@dataclass(frozen=True, eq=False)
class Buckling:
    """Load / critical load of one design.

    Attributes
    ----------
    ratio
        Largest ratio over the positions for each link, shape (links,): the ratio of a mode * (work of the forces of the
        link / largest work of any link). It is 0 if there is no such mode, and nan if unknown.
    position
        Position of the largest ratio, shape (links,).
        neighbour_drop
        Largest drop of the ratio from this position to its neighbours, shape (links,). It bounds how much more the
        ratio may rise between the positions, even if another link begins to do the most work there.
    """

    ratio: Reals
    position: Integers
    neighbour_drop: Reals

    @property
    def link(self) -> int:
        """Index of the link that buckles first."""
        return int(np.nan_to_num(self.ratio).argmax())

    @property
    def largest(self) -> float:
        """Largest ratio of all links; nan if unknown."""
        return float(self.ratio.max())


def buckling_ratio(deflection: Deflection, counted: Flags | bool = True, resolved: float = RESOLVED) -> Buckling:
    """Compute the largest load / critical load of one design over the positions.

    The eigenvalue problem is solved at evenly spaced positions and at those with the largest upper bounds. It is then
    solved at further positions, until no other position can have a ratio above `resolved` and above those found. If all
    ratios are smaller, the maximum of each link is found by a local search.

    Parameters
    ----------
    counted
        Mask of the positions to include, shape (positions,).
    resolved
        Ratio above which the maximum is guaranteed to be the largest over all positions.
    """
    of_links = np.where(counted, np.nan_to_num(buckling_bound(deflection)), 0.0)
    bound = of_links.max(axis=0)
    pressed = np.flatnonzero(bound)
    bound, of_links = bound[pressed], of_links[:, pressed]
    links = len(deflection.motion.mechanism.links)
    ratios = np.full((links, len(pressed)), UNKNOWN)
    if not len(pressed):
        return Buckling(np.zeros(links), np.zeros(links, int), np.zeros(links))
    count = EVEN_POSITIONS if deflection.added is None else VIBRATING_POSITIONS
    even = np.linspace(0, len(pressed) - 1, count).round().astype(int)
    some = distinct([*even, bound.argmax(), *of_links.argmax(axis=-1)])
    try:
        roots = BucklingModes(deflection)
        while len(some):
            ratios[:, some] = np.nan_to_num(roots.of_links(pressed[some])).T
            some = _unseen(ratios, bound, resolved)
    except np.linalg.LinAlgError:  # redundant rigid joints, or unrealistic dimensions
        return Buckling(np.full(links, np.nan), np.zeros(links, int), np.zeros(links))
    best, largest = ratios.argmax(axis=1), ratios.max(axis=1)
    nearby = np.array([ratios[range(links), np.clip(best + step, 0, len(pressed) - 1)] for step in (-1, 1)])
    lower = np.where(nearby == UNKNOWN, largest, nearby).min(axis=0)
    return Buckling(largest, pressed[best], largest - lower)


def _unseen(ratios: Reals, bound: Reals, resolved: float) -> Integers:
    """Select the next positions at which to compute the ratio.

    These are the positions with bounds above the resolved ratio. If there are none, they are the vertices of the
    parabolas through the largest ratio of each link and its neighbours, with one position on each side.
    """
    seen = ratios[0] != UNKNOWN
    above = np.flatnonzero(~seen & (bound > max(ratios.max(), resolved)))
    if len(above):
        return above[np.argsort(-bound[above])[:BATCH_POSITIONS]]
    known, rows = np.flatnonzero(seen), np.flatnonzero(ratios.max(axis=1) > 0.0)
    if not len(rows):
        return rows
    here = ratios[rows].argmax(axis=1)
    at = np.searchsorted(known, here)
    left, right = known[np.maximum(at - 1, 0)], known[np.minimum(at + 1, len(known) - 1)]
    with np.errstate(invalid="ignore"):
        rise = (ratios[rows, here] - ratios[rows, left]) / (here - left)
        fall = (ratios[rows, here] - ratios[rows, right]) / (right - here)
        top = (left + here + rise * (right - left) / (rise + fall)) / 2.0
    top = np.where(np.isfinite(top), top, here).round().astype(int)
    top = np.where(seen[top], here, top)
    some = distinct(np.clip([top - 1, top, top + 1], 0, len(seen) - 1))
    return some[~seen[some]]


def _pressed_shapes(structure: ElasticStructure) -> Reals:
    """Return shapes with unit strain energy on which axial forces do work, shape (n, r).

    Inner shapes that stretch the beam, or rotate the section of a beam with shear, neither rotate the axis nor move a
    point, so axial forces do no work on them. They are eliminated by static condensation, which is exact here.
    """
    stiffness = structure.stiffness
    felt = at_joints(structure) | structure.fields["slope"].any(axis=(0, 1))
    shapes = np.eye(len(felt))[:, felt]
    shapes[~felt] = -np.linalg.solve(stiffness[np.ix_(~felt, ~felt)], stiffness[np.ix_(~felt, felt)])
    factor = np.linalg.cholesky(shapes.T @ stiffness @ shapes)
    return np.asarray(shapes @ np.linalg.inv(factor).T)


class BucklingModes:
    """Buckling modes of a mechanism at any position."""

    def __init__(self, deflection: Deflection) -> None:
        motion = deflection.motion
        if len(motion.columns) != 1:
            raise ValueError(f"columns of shape {motion.columns}: expected one design")
        self.motion, mechanism = motion, motion.mechanism
        self.structure = elastic_structure(mechanism, deflection.sections, deflection.joints, INNER_POLYNOMIALS)
        self.chosen = chosen_points(mechanism)
        self.basis = _pressed_shapes(self.structure)
        if not self.basis.size:
            return
        self.carried = rigid_body_modes(self.structure, motion)
        self.felt = geometric_stiffness(self.structure, deflection, self.chosen)
        turning = (isinstance(load, PointLoad) and load.turning for load in mechanism.loads)
        self.symmetric = self.felt.turning is None and not any(turning)

    def of_links(self, some: Integers) -> Reals:
        """Compute the largest load ratio of each link, see `Buckling.ratio`, shape (positions, links)."""
        ratio = np.zeros((len(some), len(self.motion.mechanism.links)))
        if not self.basis.size:
            return ratio
        felt, moved = self.felt[some], self._moved(some)
        pressing = -felt.stiffness(moved, moved)
        known = np.isfinite(pressing).all(axis=(-2, -1))
        ratio[~known] = np.nan
        felt, moved = felt[known], moved[known]
        values, modes = self._solved(felt, moved, pressing[known])
        values = np.where(values > ROUND_OFF * np.abs(values).max(axis=-1, keepdims=True), values, 0.0)
        values, modes = (part[..., -2 * ratio.shape[1] :] for part in (values, modes))
        pressed = np.where(values > 0.0, values, 0.0)
        ratio[known] = (self._shares(felt, moved, modes) * pressed).max(axis=-1, initial=0.0).T
        return ratio

    def _moved(self, some: Integers) -> Displacements:
        """Return the displacements per unit of each shape in `basis` at some positions."""
        if trees_of(self.motion.mechanism).rails:  # positions of the blocks are computed for the whole motion
            return self._everywhere[some]
        carried = replace(self.carried, shift=self.carried.shift[..., some], angle=self.carried.angle[..., some],
                          work=self.carried.work[some])  # fmt: skip
        basis = own_basis(self.structure, carried, self.basis)
        motion = replace(self.motion, direction=self.motion.direction[:, some])
        return unit_displacements(self.structure, motion, carried, basis, self.chosen)

    @cached_property
    def _everywhere(self) -> Displacements:
        """Displacements per unit of each shape in `basis`, at all positions."""
        basis = own_basis(self.structure, self.carried, self.basis)
        return unit_displacements(self.structure, self.motion, self.carried, basis, self.chosen)

    def _solved(self, felt: GeometricStiffness, moved: Displacements, pressing: Reals) -> tuple[Reals, Reals]:
        """Return load ratios in ascending order (0 for complex roots), (positions, n), and modes, (positions, n, n)."""
        springs = [effect.form(moved, moved) for effect in felt.effects if effect.elastic]
        back: Reals = np.eye(pressing.shape[-1])
        if springs:
            own = sum(springs)
            back = np.linalg.inv(np.linalg.cholesky(np.eye(len(back)) + own)).swapaxes(-1, -2)
            pressing = back.swapaxes(-1, -2) @ (pressing + own) @ back
        if self.symmetric:
            values, modes = np.linalg.eigh(pressing)
            return values, back @ modes
        roots, vectors = np.linalg.eig(pressing)
        real = np.abs(roots.imag) <= MAX_IMAGINARY * np.abs(roots).max(axis=-1, keepdims=True)
        values = np.where(real, roots.real, 0.0)
        order = values.argsort(axis=-1)
        modes = np.take_along_axis(vectors.real, order[:, None], -1)
        return np.take_along_axis(values, order, -1), back @ modes

    def _shares(self, felt: GeometricStiffness, moved: Displacements, modes: Reals) -> Reals:
        """Return the work of the forces of each link / largest work of any link, shape (links, positions, modes).

        These shares are continuous over the positions even if the link with the most work changes.
        """
        mechanism = self.motion.mechanism
        work = np.zeros((len(mechanism.links), len(modes), modes.shape[-1]))
        for beam, (at, _) in enumerate(mechanism.beams):
            work[at] -= (felt.pull[:, beam, :, None] * (moved.slope[:, beam] @ modes) ** 2).sum(axis=1)
        for effect in felt.effects:
            if not effect.elastic:
                at = self.chosen[next(iter((*effect.cause.shares, *effect.cause.ways)))][0]
                along, cause = ((row(moved)[:, None] @ modes)[:, 0] for row in (effect.felt, effect.cause))
                work[at] -= effect.stiffness[:, None] * along * cause
        most = work.max(axis=0)
        return np.divide(np.maximum(work, 0.0), most, out=np.zeros_like(work), where=most > 0.0)
