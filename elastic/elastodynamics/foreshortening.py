"""Foreshortening: displacements due to the rotation of beam elements without strain, and their time derivatives.

A beam element dx that rotates by phi displaces its end by (exp(i phi) - 1) dx. Linear theory gives i phi dx. The
difference per unit length is (cos phi - 1) along the beam and (sin phi - phi) normal to it, and acts as a free strain.
The foreshortening is the static response of the elastic coordinates to this strain at every instant, together with
rigid-body displacements that close the joints. Its time derivatives are computed from the time derivatives of phi by
the chain rule. Direct differentiation of the foreshortening would amplify errors of the time discretization.
"""

from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.displacements import Displacements, compatible_basis, unit_displacements
from elastic.elastodynamics.equations_of_motion import mass_displacements
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_grid import Grid
from rigid.arrays import Complexes, Numbers, Reals

Series = tuple[Numbers, Numbers, Numbers]  # values with their first and second time derivatives

MIN_SINGULAR_VALUE = 1e-9  # singular values below this are round-off, relative to the largest singular value
MAX_ROUNDS = 12  # maximum number of steps of Newton's method, with which the amplitudes are computed
ROUND_OFF = 1e-12  # Newton's method ends when the residual is below this, relative to the largest amplitude


class Foreshortening(Struct, frozen=True, eq=False, dict=True):
    """Foreshortening of all beams, represented by k amplitudes at every node of a grid.

    Attributes
    ----------
    grid
        Time grid.
    unit
        Displacements per unit of each amplitude, with k fields.
    mass_displacements
        Displacements of all masses per unit of each amplitude, complex, shape (nodes, masses, k).
    along
        Matrix that maps cos phi - 1 at the Gauss points to amplitudes, shape (k, Gauss points).
    across
        Matrix that maps sin phi - phi at the Gauss points to amplitudes, shape (k, Gauss points).
    coordinate_rotations
        Rotations phi at all Gauss points per unit of each reduced coordinate, shape (nodes, Gauss points, r).
    amplitude_rotations
        Rotations phi at all Gauss points per unit of each amplitude, shape (nodes, Gauss points, k).
    """

    grid: Grid
    unit: Displacements
    mass_displacements: Complexes
    along: Reals
    across: Reals
    coordinate_rotations: Reals
    amplitude_rotations: Reals

    def amplitudes(self, history: Reals, residual_displacements: Displacements, guess: Reals | None = None) -> Reals:
        """Compute the amplitudes at all nodes, shape (nodes, k), by Newton's method.

        Parameters
        ----------
        history
            Values of the reduced coordinates at the points, shape (points, r).
        residual_displacements
            Displacements that the reduced coordinates do not represent, as a single displacement field (c = 1).
        guess
            Initial amplitudes, by default 0.
        """
        known_rotation = (
            self._rotation(self.coordinate_rotations, self.grid.with_start(history))
            + _section_rotations(residual_displacements)[..., 0]
        )
        values = np.zeros((len(known_rotation), len(self.along))) if guess is None else guess
        for _ in range(MAX_ROUNDS):
            phi = known_rotation + self._rotation(self.amplitude_rotations, values)
            defect = (np.cos(phi) - 1) @ self.along.T + (np.sin(phi) - phi) @ self.across.T - values
            if not np.abs(defect).max(initial=0.0) > ROUND_OFF * np.abs(values).max(initial=0.0):
                break
            change: Any = np.linalg.solve(self._feedback(phi, self.amplitude_rotations), defect[..., None])
            values = values + change[..., 0]
        return values

    def accelerations(
        self, history: tuple[Reals, Reals, Reals], residual_displacements: Displacements, amplitudes: Reals
    ) -> Complexes:
        """Return the accelerations of all masses due to foreshortening at the points, complex, shape (points, masses).

        `history` contains the values, rates and accelerations of the reduced coordinates. `amplitudes` is the result of
        the method `amplitudes`. `residual_displacements` is described there.
        """
        _, (_, first_rate, second_rate) = self._rates(history, residual_displacements, amplitudes)
        at_fixed_shape: Complexes = (self.mass_displacements[1:] @ second_rate[..., None])[..., 0]
        return at_fixed_shape + self.grid.rates_times(self.mass_displacements, (2 * first_rate, amplitudes[1:]))

    def _rates(
        self, history: tuple[Reals, Reals, Reals], residual_displacements: Displacements, amplitudes: Reals
    ) -> tuple[Series, Series]:
        """Return phi and the amplitudes at the points, each with its first and second time derivative."""
        x, x1, x2 = history
        grid, rotations, feedback_rotations = self.grid, self.coordinate_rotations[1:], self.amplitude_rotations[1:]
        residual_rotation = _section_rotations(residual_displacements)[1:, :, 0]
        values = amplitudes[1:]
        phi = self._rotation(rotations, x) + residual_rotation + self._rotation(feedback_rotations, values)
        rate = (
            self._rotation(rotations, x1)
            + self._rotation(self._coordinate_rotation_rates[0], x)
            + grid.derivative(residual_rotation, 1)
        )
        rate += self._rotation(self._amplitude_rotation_rates[0], values)
        second = (
            self._rotation(rotations, x2)
            + grid.rates_times(self.coordinate_rotations, (2 * x1, x))
            + grid.derivative(residual_rotation, 2)
        )
        per_rotation, feedback = self._per_rotation(phi), self._feedback(phi, feedback_rotations)
        first_rate: Any = np.linalg.solve(feedback, per_rotation @ rate[..., None])[..., 0]
        rate = rate + self._rotation(feedback_rotations, first_rate)
        second += grid.rates_times(self.amplitude_rotations, (2 * first_rate, values))
        curved = -np.cos(phi) * rate**2 @ self.along.T - np.sin(phi) * rate**2 @ self.across.T
        right = (per_rotation @ second[..., None])[..., 0] + curved
        second_rate: Any = np.linalg.solve(feedback, right[..., None])[..., 0]
        second += self._rotation(feedback_rotations, second_rate)
        return (phi, rate, second), (values, first_rate, second_rate)

    def per_coordinate(self, phi: Reals) -> Reals:
        """Return the derivatives of the amplitudes with respect to the reduced coordinates, shape (nodes, k, r).

        `phi` are the rotations at the Gauss points, shape (nodes, Gauss points).
        """
        found: Any = np.linalg.solve(
            self._feedback(phi, self.amplitude_rotations), self._per_rotation(phi) @ self.coordinate_rotations
        )
        return np.asarray(found, float)

    def mass_displacement_rates(
        self, history: tuple[Reals, Reals, Reals], residual_displacements: Displacements, amplitudes: Reals
    ) -> tuple[Complexes, Complexes]:
        """Return time derivatives of the displacements of masses due to foreshortening, per unit of each coordinate.

        The parameters are described in `accelerations`. The first and the second derivative are complex and have the
        shape (points, masses, r). They follow from those of phi by the chain rule.
        """
        (phi, rate, second), _ = self._rates(history, residual_displacements, amplitudes)
        rotations = self.coordinate_rotations[1:], *self._coordinate_rotation_rates
        feedback_rotations = self.amplitude_rotations[1:], *self._amplitude_rotation_rates
        sine, cosine = np.sin(phi)[:, None], np.cos(phi)[:, None]
        second_order = -cosine * self.along - sine * self.across
        third_order = sine * self.along - cosine * self.across
        per_rotation = (
            self._per_rotation(phi),
            second_order * rate[:, None],
            third_order * np.square(rate)[:, None] + second_order * second[:, None],
        )
        direct, feedback = (_product_rates(per_rotation, each) for each in (rotations, feedback_rotations))
        inverse = np.linalg.inv(self._feedback(phi, feedback_rotations[0]))
        per = inverse @ direct[0]
        first_per = inverse @ (direct[1] + feedback[1] @ per)
        second_per = inverse @ (direct[2] + feedback[2] @ per + 2 * feedback[1] @ first_per)
        shapes = self.mass_displacements[1:], *self.grid.rates(self.mass_displacements)
        _, one, two = _product_rates(shapes, (per, first_per, second_per))
        return one, two

    @staticmethod
    def _rotation(per_unit: Reals, amounts: Reals) -> Reals:
        return (per_unit @ amounts[..., None])[..., 0]

    def _per_rotation(self, phi: Reals) -> Reals:
        """Return the partial derivatives of the amplitudes with respect to phi, shape (nodes, k, Gauss points)."""
        return -np.sin(phi)[:, None] * self.along + (np.cos(phi) - 1)[:, None] * self.across

    def _feedback(self, phi: Reals, rotations: Reals) -> Reals:
        """Return the Jacobian matrix of Newton's method for the amplitudes, shape (nodes, k, k).

        The amplitudes depend on the rotations phi, to which they contribute themselves. The matrix includes this
        feedback.
        """
        return np.eye(len(self.along)) - self._per_rotation(phi) @ rotations

    @cached_property
    def _coordinate_rotation_rates(self) -> tuple[Numbers, Numbers]:
        return self.grid.rates(self.coordinate_rotations)

    @cached_property
    def _amplitude_rotation_rates(self) -> tuple[Numbers, Numbers]:
        return self.grid.rates(self.amplitude_rotations)


def _product_rates(left: Series, right: Series) -> Series:
    """Return a matrix product with its first and second time derivative.

    Each factor is given with its first and second time derivative.
    """
    return (
        left[0] @ right[0],
        left[1] @ right[0] + left[0] @ right[1],
        left[2] @ right[0] + 2 * left[1] @ right[1] + left[0] @ right[2],
    )


def foreshortening(vibration: Vibration) -> Foreshortening:
    """Set up the foreshortening of all beams of a vibrating mechanism."""
    terms = vibration.problem.terms
    kinematics, structure = terms.kinematics, terms.kinematics.structure
    size = structure.weights.size
    strains = strain_rows(structure, np.eye(len(structure.stiffness)))
    scale = 1.0 / np.sqrt(np.diagonal(structure.stiffness))
    flexibility = np.linalg.inv(structure.stiffness * scale[:, None] * scale)
    forces = (strains * rigidities(structure)[:, None])[[*range(size), *range(2 * size, 3 * size)]]
    shapes, values, mixed = np.linalg.svd(flexibility @ (forces * scale).T, full_matrices=False)
    count = int((values > MIN_SINGULAR_VALUE * values[0]).sum())
    per_strain = values[:count, None] * mixed[:count]
    basis = compatible_basis(structure, kinematics.rigid_modes, shapes[:, :count] * scale[:, None])
    unit = unit_displacements(structure, vibration.motion, kinematics.rigid_modes, basis, kinematics.chosen)
    return Foreshortening(
        terms.grid,
        unit,
        mass_displacements(structure, vibration.motion, kinematics.chosen, unit),
        per_strain[:, :size],
        per_strain[:, size:],
        _section_rotations(kinematics.unit),
        _section_rotations(unit),
    )


def _section_rotations(moved: Displacements) -> Reals:
    """Return the rotations phi at all Gauss points, shape (nodes, Gauss points, c)."""
    return moved.phi.reshape(len(moved.angle), -1, moved.phi.shape[-1])
