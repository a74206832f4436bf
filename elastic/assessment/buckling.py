"""Buckling of the whole mechanism: the ratio of the load to the critical load, called load ratio.

If all forces are multiplied by f and the drives are locked, the tangent stiffness is K + f K_G. K contains the
stiffness of links, compliant joints and springs. K_G contains the effect of axial forces on displaced links, and the
effect of forces that rotate or move with the links. At the critical load, K + f K_G is singular. The load ratio is the
reciprocal of the smallest positive f for which this happens. A force that rotates with its link makes K_G unsymmetric.
The roots can then be complex, which means flutter. A static analysis cannot assess flutter. The equations are in
docs/theory.md.

References
----------
Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., section 2.
"""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.assessment.buckling_bound import buckling_bound
from elastic.elastodynamics.displacements import (
    Displacements,
    can_open_joint,
    compatible_basis,
    rigid_body_modes,
    unit_displacements,
)
from elastic.elastodynamics.elastic_structure import ElasticStructure, elastic_structure
from elastic.elastodynamics.equations_of_motion import (
    GeometricStiffness,
    geometric_stiffness,
    mass_displacements,
    masses,
)
from elastic.elastodynamics.point_effects import chosen_points
from elastic.links.beam_trees import trees_of
from elastic.solution import Deflection
from rigid import Motion, PointLoad, Reals
from rigid.arrays import Complexes, Flags, Integers, distinct

INNER_POLYNOMIALS = 4  # number of inner polynomials per beam for each of u, w and phi
MAX_IMAGINARY = 1e-9  # roots with a smaller imaginary part count as real; relative to the largest root
ROUND_OFF = 1e-12  # roots smaller than this count as zero; relative to the largest root
RESOLVED = 0.2  # the search over positions may miss the largest load ratio if it is below this value
EVEN_POSITIONS = 13  # number of evenly spaced positions that are always computed
VIBRATING_POSITIONS = 61  # the same if the loads include vibration, because these loads vary faster
BATCH_POSITIONS = 8  # number of positions that are computed at once
UNKNOWN = -1.0  # marks a position at which the ratio has not been computed
# time step of numerical differentiation, relative to the time in which a link turns by 1 rad, or does so from rest
TIME_STEP = 0.002
MotionAt = Callable[[Any], Motion]


class Buckling(Struct, frozen=True, eq=False):
    """Load ratios of one design.

    Attributes
    ----------
    ratio
        Largest load ratio of each link over modes and positions, shape (links,). In each mode, the load ratio of a link
        is the load ratio of the mode, multiplied by a factor. The factor is the work of the forces of this link,
        relative to the largest work of the forces of any link. The load ratio is 0 if there is no buckling mode, and
        nan if unknown.
    position
        Index of the position with the largest ratio, shape (links,).
    neighbour_drop
        Difference between `ratio` and the smaller of the load ratios at both neighbouring positions, shape (links,).
        Between positions, the load ratio is assumed to exceed `ratio` by at most this difference. This margin also
        covers the case that a different link does the most work there.
    """

    ratio: Reals
    position: Integers
    neighbour_drop: Reals

    @property
    def link(self) -> int:
        """Index of the link with the largest load ratio, which buckles first."""
        return int(np.nan_to_num(self.ratio).argmax())

    @property
    def largest(self) -> float:
        """Largest load ratio of all links; nan if unknown."""
        return float(self.ratio.max())


def buckling_ratio(deflection: Deflection, counted: Flags | bool = True, resolved: float = RESOLVED) -> Buckling:
    """Compute the largest load ratio of each link over the positions, for one design.

    The eigenvalue problem is solved at evenly spaced positions, and at those with the largest upper bounds (see
    `buckling_bound`). It is then solved at more positions, until all positions that remain have an upper bound below
    `resolved` or below the largest known ratio. Finally, a local search refines the maximum of each link.

    Parameters
    ----------
    counted
        True at the positions to include, shape (positions,).
    resolved
        The search over the positions may miss the largest ratio if it is below this value.
    """
    bounds = np.where(counted, np.nan_to_num(buckling_bound(deflection)), 0.0)
    loaded = np.flatnonzero(bounds.max(axis=0))  # positions at which a link may be compressed
    bounds = bounds[:, loaded]
    bound, links = bounds.max(axis=0), len(deflection.motion.mechanism.links)
    ratios = np.full((links, len(loaded)), UNKNOWN)
    if not len(loaded):
        return Buckling(np.zeros(links), np.zeros(links, int), np.zeros(links))
    count = EVEN_POSITIONS if deflection.added is None else VIBRATING_POSITIONS
    even = np.linspace(0, len(loaded) - 1, count).round().astype(int)
    some = distinct([*even, bound.argmax(), *bounds.argmax(axis=-1)])
    try:
        roots = BucklingModes(deflection)
        while len(some):
            ratios[:, some] = np.nan_to_num(roots.of_links(loaded[some])).T
            some = _next_positions(ratios, bound, resolved)
    except np.linalg.LinAlgError:  # redundant rigid joints, or unrealistic dimensions
        return Buckling(np.full(links, np.nan), np.zeros(links, int), np.zeros(links))
    best, largest = ratios.argmax(axis=1), ratios.max(axis=1)
    nearby = np.array([ratios[range(links), np.clip(best + step, 0, len(loaded) - 1)] for step in (-1, 1)])
    lower = np.where(nearby == UNKNOWN, largest, nearby).min(axis=0)
    return Buckling(largest, loaded[best], largest - lower)


def _next_positions(ratios: Reals, bound: Reals, resolved: float) -> Integers:
    """Select the next positions at which to compute the ratios.

    They are positions whose upper bound exceeds both `resolved` and the largest known ratio. If there are no such
    positions, a parabola is fitted for each link through three known ratios: the largest one and those at the two
    neighbouring known positions. The next positions are then the vertex of this parabola, and one position on each side
    of the vertex.
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
    """Return shapes with unit stiffness on which the forces in K_G do work, shape (n, r).

    All remaining shapes stretch a beam between its ends, or rotate sections of a beam with shear. They neither rotate
    the beam axis nor move a point. Static condensation eliminates these remaining shapes. This is exact, because the
    forces in K_G do no work on them.
    """
    stiffness = structure.stiffness
    pressed = can_open_joint(structure) | structure.fields["slope"].any(axis=(0, 1))
    shapes = np.eye(len(pressed))[:, pressed]
    shapes[~pressed] = -np.linalg.solve(stiffness[np.ix_(~pressed, ~pressed)], stiffness[np.ix_(~pressed, pressed)])
    factor = np.linalg.cholesky(shapes.T @ stiffness @ shapes)
    return np.asarray(shapes @ np.linalg.inv(factor).T)


class BucklingModes:
    """Buckling modes of a mechanism at any position."""

    def __init__(self, deflection: Deflection) -> None:
        motion = deflection.motion
        if len(motion.columns) != 1:
            raise ValueError(f"the deflection has several designs (shape {motion.columns}): expected one")
        self.motion, mechanism = motion, motion.mechanism
        self.structure = elastic_structure(mechanism, deflection.sections, deflection.joints, INNER_POLYNOMIALS)
        self.chosen = chosen_points(mechanism)
        self.basis = _pressed_shapes(self.structure)
        if not self.basis.size:
            return
        self.rigid_modes = rigid_body_modes(self.structure, motion)
        self.geometric = geometric_stiffness(self.structure, deflection, self.chosen)
        turning = (isinstance(load, PointLoad) and load.turning for load in mechanism.loads)
        self.symmetric = self.geometric.follower_loads is None and not any(turning)

    def of_links(self, some: Integers) -> Reals:
        """Compute the largest load ratio of each link at given positions, shape (positions, links).

        See `Buckling.ratio`.
        """
        ratio = np.zeros((len(some), len(self.motion.mechanism.links)))
        if not self.basis.size:
            return ratio
        geometric, moved = self.geometric[some], self._moved(some)
        pressing = -geometric.stiffness(moved, moved)
        known = np.isfinite(pressing).all(axis=(-2, -1))
        ratio[~known] = np.nan
        geometric, moved = geometric[known], moved[known]
        values, modes = self._solved(geometric, moved, pressing[known])
        values = np.where(values > ROUND_OFF * np.abs(values).max(axis=-1, keepdims=True), values, 0.0)
        # the largest ratio of each link is among the highest modes
        values, modes = (part[..., -2 * ratio.shape[1] :] for part in (values, modes))
        positive = np.where(values > 0.0, values, 0.0)
        ratio[known] = (self._shares(geometric, moved, modes) * positive).max(axis=-1, initial=0.0).T
        return ratio

    def frequencies(self, some: Integers, motion_at: MotionAt | None = None) -> tuple[Reals, Reals]:
        """Compute the lowest natural frequency at given positions [rad/s], without and with loads and motion.

        Each has the shape (positions,). The second includes springs, K_G and, if `motion_at` is given, the stiffness
        due to the motion. It is 0 if the mechanism is unstable. The symmetric parts of the matrices are used.

        Parameters
        ----------
        motion_at
            Function that returns the motion at given times [s].
        """
        geometric, moved = self.geometric[some], self._moved(some)
        at_masses = self._at_masses(replace(self.motion, direction=self.motion.direction[:, some]), moved)
        mass: Reals = (np.conj(at_masses).swapaxes(-1, -2) @ at_masses).real
        more = geometric.stiffness(moved, moved)
        if motion_at is not None:
            more = more + self._stiffness_by_motion(some, motion_at)
        stiffness: Reals = np.eye(len(mass[0])) + (more + more.swapaxes(-1, -2)) / 2.0
        free: Reals = 1.0 / np.sqrt(np.linalg.eigvalsh(mass)[:, -1])
        loaded, stable = np.zeros_like(free), np.linalg.eigvalsh(stiffness)[:, 0] > ROUND_OFF
        back = np.linalg.inv(np.linalg.cholesky(stiffness[stable]))
        loaded[stable] = 1.0 / np.sqrt(np.linalg.eigvalsh(back @ mass[stable] @ back.swapaxes(-1, -2))[:, -1])
        return free, loaded

    def _stiffness_by_motion(self, some: Integers, motion_at: MotionAt) -> Reals:
        """Return the stiffness Re X^H W X'' at given positions, shape (positions, n, n).

        X are the displacements per unit of each shape, which change with the posture. W are the masses. For a single
        link that rotates at a rate, this is minus the square of the rate times the mass matrix.
        """
        times, motion = self.motion.time, self.motion
        rates = np.maximum(motion.angular_velocity**2, np.abs(motion.angular_acceleration))
        fastest = math.sqrt(float(np.nanmax(rates, initial=0.0)))
        if not fastest:
            return np.zeros(1)
        step = TIME_STEP / fastest
        middle = np.where(times[some] + 2.0 * step > times[-1], times[some] - step, times[some] + step)
        near = np.add.outer((-step, 0.0, step), middle)
        order = np.argsort(near, axis=None)
        moved = motion_at(near.ravel()[order])
        before, now, after = np.split(self._at_masses(moved, self._moved_in(moved))[np.argsort(order)], 3)
        found: Reals = (np.conj(now).swapaxes(-1, -2) @ (before - 2.0 * now + after)).real / step**2
        return found

    def _at_masses(self, motion: Motion, moved: Displacements) -> Complexes:
        """Return displacements of masses, multiplied by the root of the mass, shape (positions, masses, n)."""
        roots = np.sqrt(masses(self.structure))[:, None]
        return roots * mass_displacements(self.structure, motion, self.chosen, moved)

    def _moved_in(self, motion: Motion) -> Displacements:
        """Return the displacements per unit of each shape in `basis` at the positions of another motion."""
        modes = rigid_body_modes(self.structure, motion)
        basis = compatible_basis(self.structure, modes, self.basis)
        return unit_displacements(self.structure, motion, modes, basis, self.chosen)

    def _moved(self, some: Integers) -> Displacements:
        """Return the displacements per unit of each shape in `basis` at given positions."""
        if trees_of(self.motion.mechanism).rails:  # positions of the blocks are computed for the whole motion
            return self._everywhere[some]
        modes = self.rigid_modes
        modes = replace(modes, shift=modes.shift[..., some], angle=modes.angle[..., some], work=modes.work[some])
        basis = compatible_basis(self.structure, modes, self.basis)
        motion = replace(self.motion, direction=self.motion.direction[:, some])
        return unit_displacements(self.structure, motion, modes, basis, self.chosen)

    @cached_property
    def _everywhere(self) -> Displacements:
        """Displacements per unit of each shape in `basis`, at all positions."""
        return self._moved_in(self.motion)

    def _solved(self, geometric: GeometricStiffness, moved: Displacements, pressing: Reals) -> tuple[Reals, Reals]:
        """Return load ratios in ascending order, shape (positions, n), and modes, shape (positions, n, n).

        A complex root gets the load ratio 0. Each mode is one column, i.e. one index of the last axis.
        """
        springs = [effect.form(moved, moved) for effect in geometric.effects if effect.elastic]
        # transformation to shapes with unit stiffness of links and springs together
        back: Reals = np.eye(pressing.shape[-1])
        if springs:
            of_springs = sum(springs)
            back = np.linalg.inv(np.linalg.cholesky(np.eye(len(back)) + of_springs)).swapaxes(-1, -2)
            pressing = back.swapaxes(-1, -2) @ (pressing + of_springs) @ back
        if self.symmetric:
            values, modes = np.linalg.eigh(pressing)
            return values, back @ modes
        roots, vectors = np.linalg.eig(pressing)
        real = np.abs(roots.imag) <= MAX_IMAGINARY * np.abs(roots).max(axis=-1, keepdims=True)
        values = np.where(real, roots.real, 0.0)
        order = values.argsort(axis=-1)
        modes = np.take_along_axis(vectors.real, order[:, None], -1)
        return np.take_along_axis(values, order, -1), back @ modes

    def _shares(self, geometric: GeometricStiffness, moved: Displacements, modes: Reals) -> Reals:
        """Return the work of each link's forces in each mode, relative to the largest work of the forces of any link.

        The shape is (links, positions, modes). The ratios stay continuous over the positions when the link with the
        largest work changes.
        """
        mechanism = self.motion.mechanism
        work = np.zeros((len(mechanism.links), len(modes), modes.shape[-1]))
        for beam, (at, _) in enumerate(mechanism.beams):
            work[at] -= (geometric.axial[:, beam, :, None] * (moved.slope[:, beam] @ modes) ** 2).sum(axis=1)
        for effect in geometric.effects:
            if not effect.elastic:
                at = self.chosen[next(iter((*effect.cause.rotation_factors, *effect.cause.directions)))][0]
                along, cause = ((row(moved)[:, None] @ modes)[:, 0] for row in (effect.response, effect.cause))
                work[at] -= effect.stiffness[:, None] * along * cause
        most = work.max(axis=0)
        return np.divide(np.maximum(work, 0.0), most, out=np.zeros_like(work), where=most > 0.0)
