"""Equations of motion of the elastic coordinates, relative to the rigid motion, at the points of a time grid.

The equations M x'' + C x' + K x = g determine the amplitudes x of a basis of the elastic coordinates. They follow from
d'Alembert's principle in ground axes, in which masses are constant and there are no Coriolis terms. Each element of the
load g is the work that the quasi-static section forces do on the strains of one basis vector. The derivation is in
docs/elastodynamics.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.elastodynamics.displacements import (
    Displacements,
    Points,
    RigidBodyModes,
    compatible_basis,
    rigid_body_modes,
    unit_displacements,
)
from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.point_effects import PointEffect, lumps_of, point_effects
from elastic.elastodynamics.strains import Damping, rigidities, strain_forces, strain_rows
from elastic.elastodynamics.time_elements import Equations
from elastic.elastodynamics.time_grid import Grid
from elastic.sampling import along_beams
from elastic.solution import Deflection
from rigid import LineLoad, Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.kinetostatics import beam_directions


class Kinematics(Struct, frozen=True, eq=False):
    """Displacements per unit of each basis vector at the nodes of a grid. They do not depend on the speed.

    Attributes
    ----------
    chosen
        Selected points, see `chosen_points`.
    basis
        Basis of the elastic coordinates, shape (n, r), or (nodes, n, r) with redundant joints.
    unit
        Displacements of beams, links and selected points, with one field for each of the r basis vectors.
    mass_displacements
        Displacements of masses and rotations of moments of inertia, complex, shape (nodes, masses, r).
    """

    structure: ElasticStructure
    rigid_modes: RigidBodyModes
    chosen: Points
    basis: Reals
    unit: Displacements
    mass_displacements: Complexes


def kinematics(structure: ElasticStructure, motion: Motion, basis: Reals, chosen: Points) -> Kinematics:
    """Compute the displacements per unit of each vector of a basis at all positions of a motion."""
    rigid_modes = rigid_body_modes(structure, motion)
    compatible = compatible_basis(structure, rigid_modes, basis)
    unit = unit_displacements(structure, motion, rigid_modes, compatible, chosen)
    at_masses = mass_displacements(structure, motion, chosen, unit)
    beams = at_masses[:, : structure.mass.size].reshape(unit.beams.shape)  # share the memory of `at_masses`
    return Kinematics(structure, rigid_modes, chosen, compatible, replace(unit, beams=beams), at_masses)


def masses(structure: ElasticStructure) -> Reals:
    """Return the mass [kg] or moment of inertia [kg m^2] of each row of `mass_displacements`, shape (masses,)."""
    lumps = lumps_of(structure.mechanism)
    parts = [structure.mass.ravel()]
    if structure.rotary.any():
        parts.append(structure.rotary.ravel())
    parts += [np.array([np.ravel(value)[0] for _, lump in lumps for value in (lump.mass, lump.inertia)])]
    return np.concatenate(parts)


def mass_displacements(structure: ElasticStructure, motion: Motion, chosen: Points, moved: Displacements) -> Complexes:
    """Return the displacements of masses and rotations of moments of inertia, shape (positions, masses, c).

    The rows are the displacements of the Gauss points, then the rotations of the Gauss points if beams have rotary
    inertia, and then the displacement and the rotation of each lump.
    """
    count, columns = len(moved.angle), moved.angle.shape[-1]
    fields = (moved.beams, moved.phi) if structure.rotary.any() else (moved.beams,)
    lumps = lumps_of(structure.mechanism)
    rows = np.empty((count, len(fields) * structure.mass.size + 2 * len(lumps), columns), complex)
    along = rows[:, : len(rows[0]) - 2 * len(lumps)].reshape(count, len(fields), *structure.mass.shape, columns)
    for at, field in enumerate(fields):
        along[:, at] = field
    for row, (at, lump) in enumerate(lumps, -len(lumps)):
        number = chosen.index((at, lump.point))
        arm = motion.direction[at] * np.ravel(lump.offset)[0]
        rotation = moved.turns[:, number]
        rows[:, 2 * row] = moved.moves[:, number] + 1j * arm[:, None] * rotation
        rows[:, 2 * row + 1] = rotation
    return rows


class GeometricStiffness(Struct, frozen=True, eq=False):
    """Changes in forces due to displacements at given positions (geometric stiffness), including springs.

    Attributes
    ----------
    axial
        Axial force at Gauss points, multiplied by the integration weights [N m], shape (positions, beams, points).
    follower_loads
        Line loads that rotate with their beams, multiplied by the integration weights, in ground axes [N], complex,
        same shape. None if the mechanism has no such loads.
    effects
        Effects of displacements on point forces, including springs and dampers.
    """

    axial: Reals
    follower_loads: Complexes | None
    effects: list[PointEffect]

    def __getitem__(self, positions: Any) -> GeometricStiffness:
        """Select positions."""
        follower_loads = None if self.follower_loads is None else self.follower_loads[positions]
        return GeometricStiffness(self.axial[positions], follower_loads, [effect[positions] for effect in self.effects])

    def stiffness(self, response: Displacements, cause: Displacements) -> Reals:
        """Return the stiffness matrix between two sets of displacement fields.

        The shape is (positions, c of response, c of cause). Each element is the restoring force along one field of
        `response` due to a unit of one field of `cause`.
        """
        count = len(response.angle)
        slopes, rotations = (part.slope.reshape(count, -1, part.slope.shape[-1]) for part in (response, cause))
        axial = self.axial.reshape(count, -1, 1)
        total = slopes.swapaxes(-1, -2) @ (axial * rotations)
        if self.follower_loads is not None:
            across = np.conj(1j * self.follower_loads)[..., None] * response.beams
            total = total - across.real.reshape(count, slopes.shape[1], -1).swapaxes(-1, -2) @ rotations
        for effect in self.effects:
            total = total + effect.form(response, cause)
        return total


def geometric_stiffness(structure: ElasticStructure, bent: Deflection, chosen: Points) -> GeometricStiffness:
    """Return the geometric stiffness due to the forces of a quasi-static deflection."""
    motion = bent.motion
    axial = along_beams(bent, "N", structure.xi) * structure.weights
    follower_loads = None
    for load in motion.mechanism.loads:
        if isinstance(load, LineLoad) and load.turning:
            follower_loads = np.zeros(axial.shape, complex) if follower_loads is None else follower_loads
            k = motion.mechanism.beam_number(load.link, load.beam)
            factor = np.broadcast_to(1.0 if load.law is None else load.law(motion), motion.columns)
            along = np.ravel(load.start)[0] + (np.ravel(load.end)[0] - np.ravel(load.start)[0]) * structure.xi
            follower_loads[:, k] += (beam_directions(motion)[k] * factor)[:, None] * along * structure.weights[k]
    return GeometricStiffness(axial, follower_loads, point_effects(bent, chosen))


class MotionTerms(Struct, frozen=True, eq=False):
    """Terms of the equations of motion, at the points of a grid, that do not depend on the speed.

    Attributes
    ----------
    mass, inertial_damping, inertial_stiffness
        Matrices of the inertia force, each of shape (points, r, r). They multiply x'', x' and x, in this order, where x
        are the amplitudes of the basis vectors.
    strains
        Strains per unit of each amplitude, shape (rows, r) or (points, rows, r).
    strain_rate
        Time derivative of `strains`, shape (points, rows, r), or 0.0 if `strains` is constant.
    elastic
        Elastic stiffness matrix (without geometric stiffness), shape (r, r) or (points, r, r).
    viscous
        Damping matrix due to Kelvin-Voigt damping, same shape as `elastic`.
    viscous_rate
        Damping force due to `strain_rate` per unit of each amplitude, shape (points, r, r), or 0.0 if `strains` is
        constant.
    """

    kinematics: Kinematics
    grid: Grid
    damping: Damping
    mass: Reals
    inertial_damping: Reals
    inertial_stiffness: Reals
    strains: Reals
    strain_rate: Columns
    elastic: Reals
    viscous: Reals
    viscous_rate: Columns

    def accelerations(self, history: tuple[Reals, Reals, Reals]) -> Complexes:
        """Return the accelerations of the masses relative to the rigid motion, complex, shape (points, masses).

        The accelerations are second derivatives with respect to the time of the grid, see `Problem.speed`.
        """
        displacements, grid = self.kinematics.mass_displacements, self.grid
        steady = (displacements[1:] @ history[2][..., None])[..., 0]
        return steady + grid.rates_times(displacements, (2 * history[1], history[0]))


def motion_terms(
    kinematics_: Kinematics, grid: Grid, damping: Damping, rates: tuple[Complexes, Complexes] | None = None
) -> MotionTerms:
    """Compute the terms of the equations of motion that do not depend on the speed.

    `rates` are the first and second time derivatives of `kinematics_.mass_displacements` at the points. If they are
    unknown, they are computed from the values at the nodes.
    """
    structure, basis = kinematics_.structure, kinematics_.basis
    inertia = np.empty((3, len(kinematics_.mass_displacements) - 1, basis.shape[-1], basis.shape[-1]))
    weights = masses(structure)[:, None]
    for part, (nodes, points) in grid.parts(kinematics_.mass_displacements[0].size):
        displacements = kinematics_.mass_displacements[nodes]
        weighted = (np.conj(displacements[1:]) * weights).swapaxes(-1, -2)
        moving_rates = part.rates(displacements) if rates is None else (each[points] for each in rates)
        for order, moving in enumerate((displacements[1:], *moving_rates)):
            inertia[order, points] = (weighted @ moving).real
    inertia[1] *= 2
    strains = strain_rows(structure, basis)
    strain_rate: Columns = 0.0
    if basis.ndim == 3:
        strains, strain_rate = strains[1:], strain_rows(structure, grid.rates(basis)[0])
    elastic_forces = strains.swapaxes(-1, -2) * rigidities(structure)
    viscous_forces = elastic_forces * damping.per_row(structure)
    shape_rate = viscous_forces @ strain_rate if basis.ndim == 3 else 0.0
    return MotionTerms(
        kinematics_,
        grid,
        damping,
        inertia[0],
        inertia[1],
        inertia[2],
        strains,
        strain_rate,
        elastic_forces @ strains,
        viscous_forces @ strains,
        shape_rate,
    )


class Problem(Struct, frozen=True, eq=False):
    """Equations of motion on a grid, with the terms from which loads are computed after the solution.

    Attributes
    ----------
    equations
        Equations for the amplitudes at the points. Derivatives are with respect to the time of the grid.
    geometric
        Geometric stiffness at all nodes.
    speed
        Speed of the mechanism, relative to the speed of the motion for which the grid was set up. Damping forces are
        proportional to `speed`, and inertia forces to its square.
    """

    terms: MotionTerms
    equations: Equations
    geometric: GeometricStiffness
    speed: float


def problem(terms: MotionTerms, bent: Deflection, speed: float = 1.0) -> Problem:
    """Assemble the equations of motion of the vibration.

    `bent` is the quasi-static deflection at the nodes. For `speed` see `Problem`.
    """
    kinematics_, inertia_factor = terms.kinematics, speed**2
    geometric = geometric_stiffness(kinematics_.structure, bent, kinematics_.chosen)
    viscous = inertia_factor * terms.inertial_damping + speed * terms.viscous
    stiffness = (
        inertia_factor * terms.inertial_stiffness
        + geometric.stiffness(kinematics_.unit, kinematics_.unit)[1:]
        + terms.elastic
    )
    stiffness = stiffness + speed * terms.viscous_rate
    for effect in geometric.effects:
        if np.any(effect.damping):
            force, cause = (
                effect.response(kinematics_.unit)[1:, :, None] * (speed * effect.damping),
                effect.cause(kinematics_.unit),
            )
            viscous = viscous + force * cause[1:, None]
            stiffness = stiffness + force * terms.grid.rates(cause)[0][:, None]
    load = (terms.strains.swapaxes(-1, -2) @ strain_forces(kinematics_.structure, bent)[1:, :, None])[..., 0]
    return Problem(terms, Equations(inertia_factor * terms.mass, viscous, stiffness, load), geometric, speed)
