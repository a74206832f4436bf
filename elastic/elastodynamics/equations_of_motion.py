"""Equations of motion of the elastic coordinates about the rigid motion, at the points of a time grid.

The equations M x'' + C x' + K x = g determine the amplitudes x of a basis of the elastic coordinates. They follow from
d'Alembert's principle in ground axes, in which masses are constant and there are no Coriolis terms. The load g is the
work of the quasi-static section forces on the strains of the basis. The derivation is in docs/elastodynamics.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.elastodynamics.displacements import (
    Displacements,
    Points,
    RigidBodyModes,
    own_basis,
    rigid_body_modes,
    unit_displacements,
)
from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.point_effects import PointEffect, lumps_of, point_effects
from elastic.elastodynamics.samples import along_beams
from elastic.elastodynamics.strains import Damping, given_forces, rigidities, strain_rows
from elastic.elastodynamics.time_elements import Equations
from elastic.elastodynamics.time_grid import Grid
from elastic.solution import Deflection
from rigid import LineLoad, Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.kinetostatics import beam_directions


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Displacements per unit of a basis at the nodes of a grid, which depend only on the positions.

    Attributes
    ----------
    basis
        Basis of the elastic coordinates, shape (n, r), or (nodes, n, r).
    unit
        Displacements of the basis at all nodes.
    rows
        Displacements of all masses, complex, shape (nodes, masses, r).
    """

    structure: ElasticStructure
    carried: RigidBodyModes
    chosen: Points
    basis: Reals
    unit: Displacements
    rows: Complexes


def kinematics(structure: ElasticStructure, motion: Motion, basis: Reals, chosen: Points) -> Kinematics:
    """Compute the displacements per unit of a basis at all positions of a motion."""
    carried = rigid_body_modes(structure, motion)
    independent = own_basis(structure, carried, basis)
    unit = unit_displacements(structure, motion, carried, independent, chosen)
    rows = mass_rows(structure, motion, chosen, unit)
    beams = rows[:, : structure.mass.size].reshape(unit.beams.shape)  # the same memory
    return Kinematics(structure, carried, chosen, independent, replace(unit, beams=beams), rows)


def masses(structure: ElasticStructure) -> Reals:
    """Return the masses [kg] and moments of inertia [kg m^2] for the rows of `mass_rows`, shape (masses,)."""
    lumps = lumps_of(structure.mechanism)
    parts = [structure.mass.ravel()]
    if structure.rotary.any():
        parts.append(structure.rotary.ravel())
    parts += [np.array([np.ravel(value)[0] for _, lump in lumps for value in (lump.mass, lump.inertia)])]
    return np.concatenate(parts)


def mass_rows(structure: ElasticStructure, motion: Motion, chosen: Points, moved: Displacements) -> Complexes:
    """Return the displacements of all masses and rotations of all moments of inertia, (positions, masses, c)."""
    count, kinds = len(moved.angle), moved.angle.shape[-1]
    fields = (moved.beams, moved.phi) if structure.rotary.any() else (moved.beams,)
    lumps = lumps_of(structure.mechanism)
    rows = np.empty((count, len(fields) * structure.mass.size + 2 * len(lumps), kinds), complex)
    along = rows[:, : len(rows[0]) - 2 * len(lumps)].reshape(count, len(fields), *structure.mass.shape, kinds)
    for at, field in enumerate(fields):
        along[:, at] = field
    for row, (at, lump) in enumerate(lumps, -len(lumps)):
        number = chosen.index((at, lump.point))
        arm = motion.direction[at] * np.ravel(lump.offset)[0]
        turned = moved.turns[:, number]
        rows[:, 2 * row] = moved.moves[:, number] + 1j * arm[:, None] * turned
        rows[:, 2 * row + 1] = turned
    return rows


@dataclass(frozen=True, eq=False)
class GeometricStiffness:
    """Geometric stiffness at some positions: forces of the rigid motion on displaced links.

    Attributes
    ----------
    pull
        Axial force along the beams times the weights of the points [N m], shape (positions, beams, points).
    turning
        Line loads that rotate with their beams, times the weights, in ground axes [N], complex, same shape; or None.
    effects
        Forces on displaced points.
    """

    pull: Reals
    turning: Complexes | None
    effects: list[PointEffect]

    def __getitem__(self, positions: Any) -> GeometricStiffness:
        """Select positions."""
        turning = None if self.turning is None else self.turning[positions]
        return GeometricStiffness(self.pull[positions], turning, [effect[positions] for effect in self.effects])

    def stiffness(self, felt: Displacements, cause: Displacements) -> Reals:
        """Return the forces along displacements per unit of others, shape (positions, c responding, c causing)."""
        count = len(felt.angle)
        slopes, turned = (part.slope.reshape(count, -1, part.slope.shape[-1]) for part in (felt, cause))
        pull = self.pull.reshape(count, -1, 1)
        total = slopes.swapaxes(-1, -2) @ (pull * turned)
        if self.turning is not None:
            across = np.conj(1j * self.turning)[..., None] * felt.beams
            total = total - across.real.reshape(count, slopes.shape[1], -1).swapaxes(-1, -2) @ turned
        for effect in self.effects:
            total = total + effect.form(felt, cause)
        return total


def geometric_stiffness(structure: ElasticStructure, bent: Deflection, chosen: Points) -> GeometricStiffness:
    """Return the geometric stiffness due to the forces of a quasi-static deflection."""
    motion = bent.motion
    pull = along_beams(bent, "N", structure.xi) * structure.weights
    turning = None
    for load in motion.mechanism.loads:
        if isinstance(load, LineLoad) and load.turning:
            turning = np.zeros(pull.shape, complex) if turning is None else turning
            k = motion.mechanism.beam_number(load.link, load.beam)
            factor = np.broadcast_to(1.0 if load.law is None else load.law(motion), motion.columns)
            along = np.ravel(load.start)[0] + (np.ravel(load.end)[0] - np.ravel(load.start)[0]) * structure.xi
            turning[:, k] += (beam_directions(motion)[k] * factor)[:, None] * along * structure.weights[k]
    return GeometricStiffness(pull, turning, point_effects(bent, chosen))


@dataclass(frozen=True, eq=False)
class MotionTerms:
    """Terms of the equations of motion at the points of a grid that depend only on the positions.

    Attributes
    ----------
    mass, carried_rate, carried
        Inertia due to accelerations, rates and values of the amplitudes, shape (points, r, r).
    strains, strain_rate
        Strains per amplitude, shape (rows, r) or (points, rows, r), and their rates of change (0.0 if constant).
    elastic, viscous, viscous_rate
        Forces due to strains, due to their rates, and due to the change of the shapes, shape (points, r, r) or (r, r).
    """

    kinematics: Kinematics
    grid: Grid
    damping: Damping
    mass: Reals
    carried_rate: Reals
    carried: Reals
    strains: Reals
    strain_rate: Columns
    elastic: Reals
    viscous: Reals
    viscous_rate: Columns

    def accelerations(self, history: tuple[Reals, Reals, Reals]) -> Complexes:
        """Return the accelerations of the masses in the time of the grid, complex, shape (points, masses)."""
        rows, grid = self.kinematics.rows, self.grid
        steady = (rows[1:] @ history[2][..., None])[..., 0]
        return steady + grid.rates_times(rows, (2 * history[1], history[0]))


def motion_terms(kinds: Kinematics, grid: Grid, damping: Damping) -> MotionTerms:
    """Compute the terms of the equations of motion that depend only on the positions."""
    structure, basis = kinds.structure, kinds.basis
    inertia = np.empty((3, len(kinds.rows) - 1, basis.shape[-1], basis.shape[-1]))
    weights = masses(structure)[:, None]
    for part, (nodes, points) in grid.parts(kinds.rows[0].size):
        rows = kinds.rows[nodes]
        heavy = (np.conj(rows[1:]) * weights).swapaxes(-1, -2)
        for order, moving in enumerate((rows[1:], *part.rates(rows))):
            inertia[order, points] = (heavy @ moving).real
    strains = strain_rows(structure, basis)
    strain_rate: Columns = 0.0
    if basis.ndim == 3:
        strains, strain_rate = strains[1:], strain_rows(structure, grid.rates(basis)[0])
    strong = strains.swapaxes(-1, -2) * rigidities(structure)
    weak = strong * damping.per_row(structure)
    shape_rate = weak @ strain_rate if basis.ndim == 3 else 0.0
    return MotionTerms(
        kinds,
        grid,
        damping,
        inertia[0],
        2 * inertia[1],
        inertia[2],
        strains,
        strain_rate,
        strong @ strains,
        weak @ strains,
        shape_rate,
    )


@dataclass(frozen=True, eq=False)
class Problem:
    """Equations of motion on a grid, with the terms that convert their solution to loads.

    Attributes
    ----------
    equations
        Equations of the amplitudes at the points, in the time of the grid.
    felt
        Geometric stiffness at all nodes.
    speed
        Speed relative to the time of the grid. Inertia is proportional to its square, and damping to the speed.
    """

    terms: MotionTerms
    equations: Equations
    felt: GeometricStiffness
    speed: float


def problem(terms: MotionTerms, bent: Deflection, speed: float = 1.0) -> Problem:
    """Assemble the equations about the motion of a deflection, which runs at `speed` times the speed of the grid."""
    kinds, faster = terms.kinematics, speed**2
    felt = geometric_stiffness(kinds.structure, bent, kinds.chosen)
    viscous = faster * terms.carried_rate + speed * terms.viscous
    stiffness = faster * terms.carried + felt.stiffness(kinds.unit, kinds.unit)[1:] + terms.elastic
    stiffness = stiffness + speed * terms.viscous_rate
    for effect in felt.effects:
        if np.any(effect.damping):
            row, cause = effect.felt(kinds.unit)[1:, :, None] * (speed * effect.damping), effect.cause(kinds.unit)
            viscous = viscous + row * cause[1:, None]
            stiffness = stiffness + row * terms.grid.rates(cause)[0][:, None]
    load = (terms.strains.swapaxes(-1, -2) @ given_forces(kinds.structure, bent)[1:, :, None])[..., 0]
    return Problem(terms, Equations(faster * terms.mass, viscous, stiffness, load), felt, speed)
