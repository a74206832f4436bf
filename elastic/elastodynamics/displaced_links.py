"""Large displacement: additional loads and strains with which the linear quasi-static solution is exact.

Reissner's beam has the displacement d = u + i w in the axes of the rigid position, the rotation phi of the section, and
the section force N + i Q in the axes of the rotated section (Q = -V):

    1 + d' = exp(i phi) (1 + eps + i gamma),    P = exp(i phi) (N + i Q),    M' = -Im(conj(1 + d') P) + J a.

Primes are derivatives along the beam. eps and gamma are the stretch and shear, P is the section force in the axes of
the rigid position, J is the rotary inertia per unit length, and a is the angular acceleration of the section in ground
axes. The linear beam has d' = eps + i (phi + gamma) and M' = -Im P. It becomes exact if a suitable distributed moment
and a suitable free strain are added. Both are computed from the previous solution of an iteration. The derivation is in
docs/theory.md.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.elastodynamics.displaced_joints import displaced_joints
from elastic.elastodynamics.displaced_points import DisplacedPoints, point_loads
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.equations_of_motion import mass_displacements, masses
from elastic.elastodynamics.foreshortening import Foreshortening
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities
from elastic.elastodynamics.vibration_loads import (
    GatheredLoads,
    ResidualResponse,
    add_strain_rate_loads,
    openings,
    sliding_rates,
    strain_rates,
    to_powers,
)
from elastic.links.added_loads import AddedLoads
from rigid.arrays import Complexes, Reals
from rigid.kinetostatics import beam_directions

# names of cached values that `Displaced.with_forces` keeps
MOTION_CACHE = "moved", "accelerations", "viscous", "damped"
# The effect of rotation on damping forces is low-pass filtered. This is the product of the cutoff frequency and the
# largest damping constant beta of a beam.
FILTER_FREQUENCY = 2.0
TINY = float(np.finfo(float).tiny)


class Displaced(Struct, frozen=True, eq=False, dict=True):
    """Vibrating links with large displacement, at the nodes of a grid.

    Attributes
    ----------
    vibration
        Vibration according to linear theory, with its equations of motion in reduced coordinates.
    history
        Values, rates and accelerations of the reduced coordinates, each of shape (points, r).
    residual
        Residual response: displacements that the reduced coordinates do not represent.
    force
        Section force P in the axes of the rigid beams [N], complex, shape (nodes, beams, Gauss points).
    joints
        Joint forces in ground axes [N], complex, shape (nodes, joints).
    moments
        Joint moments [N m], shape (nodes, joints).
    foreshortening
        Foreshortening of the beams. None if the foreshortening is a part of `residual`.
    amplitudes
        Amplitudes of the foreshortening, shape (nodes, k), or None.
    """

    vibration: Vibration
    history: tuple[Reals, Reals, Reals]
    residual: ResidualResponse
    force: Complexes
    joints: Complexes
    moments: Reals
    foreshortening: Foreshortening | None = None
    amplitudes: Reals | None = None

    @cached_property
    def moved(self) -> Displacements:
        """Total displacements at the nodes, as a single displacement field (c = 1)."""
        terms = self.vibration.problem.terms
        by_coordinates: Displacements = terms.kinematics.unit @ terms.grid.with_start(self.history[0])[..., None]
        moved = by_coordinates + self.residual.moved
        if self.foreshortening is None or self.amplitudes is None:
            return moved
        return moved + self.foreshortening.unit @ self.amplitudes[..., None]

    def with_forces(self, force: Complexes, joints: Complexes, moments: Reals) -> Displaced:
        """Replace section and joint forces, but keep displacements, accelerations and damping forces."""
        displaced = replace(self, force=force, joints=joints, moments=moments)
        displaced.__dict__.update({name: vars(self)[name] for name in MOTION_CACHE if name in vars(self)})
        return displaced

    @cached_property
    def accelerations(self) -> Complexes:
        """Accelerations of masses and moments of inertia relative to the rigid motion, shape (points, masses)."""
        terms = self.vibration.problem.terms
        kinematics = terms.kinematics
        residual_displacements = mass_displacements(
            kinematics.structure, self.vibration.motion, kinematics.chosen, self.residual.moved
        )
        total = terms.accelerations(self.history) + terms.grid.derivative(residual_displacements[1:, :, 0], 2)
        if self.foreshortening is None or self.amplitudes is None:
            return total
        return total + self.foreshortening.accelerations(self.history, self.residual.moved, self.amplitudes)

    @property
    def inertia_load(self) -> Reals:
        """Inertia forces on the coordinates due to all accelerations, with opposite sign, shape (points, r)."""
        kinematics = self.vibration.problem.terms.kinematics
        inertia = masses(kinematics.structure) * np.conj(self.accelerations)
        return np.asarray((kinematics.mass_displacements[1:].swapaxes(-1, -2) @ inertia[..., None])[..., 0].real, float)

    @cached_property
    def viscous(self) -> Reals:
        """Damping forces conjugate to the strains, times the integration weights, shape (points, rows).

        They neglect that sections rotate, see `damped`.
        """
        problem = self.vibration.problem
        return strain_rates(problem, *self.history[:2]) + self.residual.viscous(problem)

    @cached_property
    def damped(self) -> Reals:
        """Damping forces as in `viscous`, but including the effect of rotated sections.

        With the damping constant beta of the beam, the axial damping force is beta dN/dt, where N is normal to the
        rotated section. In `viscous`, it is beta d(Re P)/dt, where Re P is parallel to the beam axis in the rigid
        position.
        """
        terms = self.vibration.problem.terms
        structure, grid = terms.kinematics.structure, terms.grid
        rotation_effect = ((np.exp(-1j * self.moved.phi[..., 0]) - 1.0) * self.force).real * structure.weights
        size = structure.weights.size
        beta = self.vibration.problem.speed * terms.damping.per_row(structure)[:size]
        filtered = grid.smoothed(
            rotation_effect[1:].reshape(len(rotation_effect) - 1, -1),
            FILTER_FREQUENCY / max(float(beta.max(initial=0.0)), TINY),
        )
        parts = self.viscous.copy()
        parts[:, :size] += beta * grid.derivative(filtered, 1)
        return parts


class ExactLoads(Struct, frozen=True, eq=False):
    """Loads under which the linear quasi-static solution equals the exact solution with large displacement.

    Attributes
    ----------
    added
        Loads in addition to those of the rigid motion.
    section_correction
        Exact section force P minus the section force N - i V of the quasi-static solution [N], complex, shape (points,
        beams, Gauss points).
    """

    added: AddedLoads
    section_correction: Complexes


def exact_loads(now: Displaced) -> ExactLoads:
    """Compute the loads on links with large displacement, including the effect of rotated sections.

    The loads are those at the points of the time grid.
    """
    problem, motion = now.vibration.problem, now.vibration.motion
    kinematics = problem.terms.kinematics
    structure, grid = kinematics.structure, problem.terms.grid
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
    if problem.geometric.follower_loads is not None:
        force = force + problem.geometric.follower_loads[1:] * (turn - 1)
    gathered.along_beams(np.conj(directions)[..., None] * force / structure.weights)
    add_strain_rate_loads(gathered, directions, viscous, across)
    gaps, turns = openings(gathered, motion, viscous)
    displaced = DisplacedPoints(motion, grid, kinematics.chosen, now.moved)
    along_beams = size * (2 if structure.rotary.any() else 1)  # the rows after these belong to lumps
    lumps = point_loads(displaced, accelerations[:, len(accelerations[0]) - len(masses(structure)) + along_beams :])
    joints = displaced_joints(displaced, structure, lumps, now.joints, now.moments)
    section_correction = damped_N - 1j * (across + _derivative(structure, damped_M))
    linear = P - section_correction
    free = turn * (1 + strain) - 1 - strain_of(structure, linear) - 1j * phi
    force_change = np.conj(section - linear)
    q = gathered.positions_last(gathered.q)
    return ExactLoads(
        AddedLoads(
            q,
            (*gathered.points, *joints.points),
            joints.blocks,
            tuple(gap + force_change for gap, force_change in zip(gaps, joints.gaps, strict=True)),
            tuple(turn + force_change for turn, force_change in zip(turns, joints.turns, strict=True)),
            np.stack([gathered.positions_last(free @ series), np.zeros_like(q)]),
            np.stack([gathered.positions_last(part @ series) for part in (force_change, damped_M)]),
            sliding_rates(problem, motion, *now.history[:2]),
            joints.slides,
        ),
        section_correction,
    )


def _derivative(structure: ElasticStructure, values: Reals) -> Reals:
    """Return the derivatives along the beams of values at Gauss points, shape (..., beams, points)."""
    order = np.arange(1, values.shape[-1])
    slopes = (values @ to_powers(values.shape[-1]).T)[..., 1:] * (order / structure.length[:, None])
    return slopes @ np.power.outer(structure.xi, order - 1).T


def strain_of(structure: ElasticStructure, section: Complexes) -> Complexes:
    """Return the strains due to a section force N + i Q and the free strain, shape (..., beams, points).

    The result is eps + i gamma, with the stretch eps and the shear gamma.
    """
    size = structure.weights.size
    EA, kGA = (
        rigidities(structure)[k * size : (k + 1) * size].reshape(structure.weights.shape) / structure.weights
        for k in (0, 2)
    )
    along, across = (np.divide(1.0, part, out=np.zeros_like(part), where=part > 0) for part in (EA, kGA))
    free = np.array([np.ravel(part.strain)[0] for part in structure.sections], float)
    return section.real * along + free[:, None] + 1j * section.imag * across
