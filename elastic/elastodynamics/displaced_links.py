"""Large displacement: additional loads and strains that make the linear quasi-static solution exact.

Reissner's beam has the displacement d = u + i w in the axes of the rigid position, the rotation phi, and the section
force N + i Q in the axes of the rotated section (Q = -V):

    1 + d' = exp(i phi) (1 + eps + i gamma),    P = exp(i phi) (N + i Q),    M' = -Im(conj(1 + d') P) + J (phi + psi)''.

The linear beam has d' = eps + i (phi + gamma) and M' = -Im P. It becomes exact if a distributed moment and a free
strain, which are computed from the previous solution, are added. The derivation is in docs/theory.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastic.elastodynamics.displaced_joints import displaced_joints
from elastic.elastodynamics.displaced_points import Turned, point_loads
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.equations_of_motion import mass_rows, masses
from elastic.elastodynamics.foreshortening import Foreshortening
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities
from elastic.elastodynamics.vibration_loads import (
    GatheredLoads,
    ResidualResponse,
    of_strain_rates,
    openings,
    sliding_rates,
    strain_rates,
    to_powers,
)
from elastic.links.added_loads import AddedLoads
from rigid.arrays import Complexes, Reals
from rigid.kinetostatics import beam_directions

OF_MOTION = "moved", "accelerations", "viscous", "damped"  # cached values that `Displaced.under` copies
FASTEST = 2.0  # limit of (frequency of changes by rotation in damping forces) * (largest damping time beta)
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Displaced:
    """Vibrating links with large displacement, at the nodes of a grid.

    Attributes
    ----------
    vibration
        Linear vibration, with the equations of motion in reduced coordinates about the rigid motion.
    history
        Amplitudes of these coordinates and their rates and accelerations, shape (points, r).
    residual
        Residual response: displacements that these coordinates do not represent.
    force
        Section force P in the axes of the rigid beams [N], complex, shape (nodes, beams, Gauss points).
    joints, moments
        Joint forces in ground axes [N], complex, and moments [N m], shape (nodes, joints).
    shortened, amplitudes
        Foreshortening of the beams and its amplitudes, shape (nodes, k), or None if `residual` includes it.
    """

    vibration: Vibration
    history: tuple[Reals, Reals, Reals]
    residual: ResidualResponse
    force: Complexes
    joints: Complexes
    moments: Reals
    shortened: Foreshortening | None = None
    amplitudes: Reals | None = None

    @cached_property
    def moved(self) -> Displacements:
        """Total displacements, as a single kind."""
        terms = self.vibration.problem.terms
        followed: Displacements = terms.kinematics.unit @ terms.grid.at_nodes(self.history[0])[..., None]
        moved = followed + self.residual.moved
        if self.shortened is None or self.amplitudes is None:
            return moved
        return moved + self.shortened.unit @ self.amplitudes[..., None]

    def under(self, force: Complexes, joints: Complexes, moments: Reals) -> Displaced:
        """Return the same displaced links with other section and joint forces, without computing their motion again."""
        same = replace(self, force=force, joints=joints, moments=moments)
        same.__dict__.update({name: vars(self)[name] for name in OF_MOTION if name in vars(self)})
        return same

    @cached_property
    def accelerations(self) -> Complexes:
        """Accelerations of all masses and moments of inertia at the points, complex, shape (points, masses)."""
        terms = self.vibration.problem.terms
        kinds = terms.kinematics
        rows = mass_rows(kinds.structure, self.vibration.motion, kinds.chosen, self.residual.moved)
        total = terms.accelerations(self.history) + terms.grid.derivative(rows[1:, :, 0], 2)
        if self.shortened is None or self.amplitudes is None:
            return total
        return total + self.shortened.accelerations(self.history, self.residual.moved, self.amplitudes)

    @cached_property
    def viscous(self) -> Reals:
        """Damping parts of the forces of all strains, times the weights of the points, shape (points, rows).

        The rotation of sections is neglected, see `damped`.
        """
        problem = self.vibration.problem
        return strain_rates(problem, *self.history[:2]) + self.residual.viscous(problem)

    @cached_property
    def damped(self) -> Reals:
        """Damping parts as in `viscous`, but in rotated sections, in which the axial force is N instead of Re P."""
        terms = self.vibration.problem.terms
        structure, grid = terms.kinematics.structure, terms.grid
        turned = ((np.exp(-1j * self.moved.phi[..., 0]) - 1.0) * self.force).real * structure.weights
        size = structure.weights.size
        beta = self.vibration.problem.speed * terms.damping.per_row(structure)[:size]
        slow = grid.smoothed(turned[1:].reshape(len(turned) - 1, -1), FASTEST / max(float(beta.max(initial=0.0)), TINY))
        parts = self.viscous.copy()
        parts[:, :size] += beta * grid.derivative(slow, 1)
        return parts


@dataclass(frozen=True, eq=False)
class ExactLoads:
    """Loads under which the linear quasi-static solution is the exact solution with large displacement.

    Attributes
    ----------
    added
        Additional loads.
    residual
        P minus N - i V of the quasi-static solution [N], complex, shape (points, beams, Gauss points).
    """

    added: AddedLoads
    residual: Complexes


def exact_loads(now: Displaced) -> ExactLoads:
    """Compute the loads of displaced links at the points of their grid, including the effects of rotated sections."""
    problem, motion = now.vibration.problem, now.vibration.motion
    kinds = problem.terms.kinematics
    structure, grid = kinds.structure, problem.terms.grid
    shape, size = structure.weights.shape, structure.weights.size
    directions, series = beam_directions(motion).T[1:], to_powers(shape[-1]).T
    accelerations, viscous = now.accelerations, now.damped
    inertia = -masses(structure) * accelerations
    damped_N, damped_M, damped_Q = (
        viscous[:, k * size : (k + 1) * size].reshape(-1, *shape) / structure.weights for k in range(3)
    )
    phi, P = now.moved.phi[1:, ..., 0], now.force[1:]
    turn = np.exp(1j * phi)
    section = np.conj(turn) * P
    strain = strain_of(structure, section - damped_N - 1j * damped_Q)
    across = (np.conj(1 + strain) * section - P).imag
    if structure.rotary.any():
        across += inertia[:, size : 2 * size].real.reshape(-1, *shape) / structure.weights
    gathered = GatheredLoads(structure, len(phi))
    force = inertia[:, :size].reshape(-1, *shape)
    if problem.felt.turning is not None:
        force = force + problem.felt.turning[1:] * (turn - 1)
    gathered.along_beams(np.conj(directions)[..., None] * force / structure.weights)
    of_strain_rates(gathered, directions, viscous, across)
    gaps, turns = openings(gathered, motion, viscous)
    turned = Turned(motion, grid, kinds.chosen, now.moved)
    lumps = point_loads(turned, accelerations[:, len(accelerations[0]) - _lump_rows(structure, size) :])
    joints = displaced_joints(turned, structure, lumps, now.joints, now.moments)
    residual = damped_N - 1j * (across + _derivative(structure, damped_M))
    linear = P - residual
    free = turn * (1 + strain) - 1 - strain_of(structure, linear) - 1j * phi
    more = np.conj(section - linear)
    q = gathered.positions_last(gathered.q)
    return ExactLoads(
        AddedLoads(
            q,
            (*gathered.points, *joints.points),
            joints.blocks,
            tuple(gap + more for gap, more in zip(gaps, joints.gaps, strict=True)),
            tuple(turn + more for turn, more in zip(turns, joints.turns, strict=True)),
            np.stack([gathered.positions_last(free @ series), np.zeros_like(q)]),
            np.stack([gathered.positions_last(part @ series) for part in (more, damped_M)]),
            sliding_rates(problem, motion, *now.history[:2]),
            joints.slides,
        ),
        residual,
    )


def _lump_rows(structure: ElasticStructure, size: int) -> int:
    """Return the number of rows of `masses` that belong to lumps."""
    return len(masses(structure)) - size * (2 if structure.rotary.any() else 1)


def _derivative(structure: ElasticStructure, values: Reals) -> Reals:
    """Differentiate values at Gauss points along the beams, shape (..., beams, points)."""
    order = np.arange(1, values.shape[-1])
    slopes = (values @ to_powers(values.shape[-1]).T)[..., 1:] * (order / structure.length[:, None])
    return slopes @ np.power.outer(structure.xi, order - 1).T


def strain_of(structure: ElasticStructure, section: Complexes) -> Complexes:
    """Return eps + i gamma due to a section force N + i Q, plus the free strain, shape (..., beams, points)."""
    size = structure.weights.size
    EA, kGA = (
        rigidities(structure)[k * size : (k + 1) * size].reshape(structure.weights.shape) / structure.weights
        for k in (0, 2)
    )
    along, across = (np.divide(1.0, part, out=np.zeros_like(part), where=part > 0) for part in (EA, kGA))
    free = np.array([np.ravel(part.strain)[0] for part in structure.sections], float)
    return section.real * along + free[:, None] + 1j * section.imag * across
