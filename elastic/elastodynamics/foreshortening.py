"""Foreshortening: displacements due to the rotation of beam elements without strain, and their time derivatives.

A beam element dx that rotates by phi displaces its end by (exp(i phi) - 1) dx. Linear theory gives i phi dx. The
difference per unit length is (cos phi - 1) along the beam and (sin phi - phi) normal to it, and acts as a free strain.
The foreshortening is the static response of the elastic coordinates to this strain at every instant, together with
rigid-body displacements that close the joints. Its time derivatives are computed from the time derivatives of phi by
the chain rule. Direct differentiation of the foreshortening would amplify errors of the time discretization.
"""

from functools import cached_property, partial
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.displacements import Displacements, compatible_basis, unit_displacements
from elastic.elastodynamics.equations_of_motion import mass_displacements
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_grid import Grid
from rigid.arrays import Complexes, Reals

Series = tuple[Reals, ...]  # values with their first and second time derivatives

MIN_SINGULAR_VALUE = 1e-9  # singular values below this are round-off, relative to the largest singular value
MAX_ROUNDS = 12  # maximum number of steps of Newton's method, with which the amplitudes are computed
ROUND_OFF = 1e-12  # Newton's method ends when the residual is below this, relative to the largest rotation
ALL_NODES, POINTS = slice(None), slice(1, None)  # all nodes, and all without the first, which is no collocation point


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
        """Compute the amplitudes at all nodes, shape (nodes, k), by Newton's method for the rotations phi.

        Parameters
        ----------
        history
            Values of the reduced coordinates at the points, shape (points, r).
        residual_displacements
            Displacements that the reduced coordinates do not represent, as a single displacement field (c = 1).
        guess
            Initial amplitudes, by default 0.
        """
        known = (
            _times(self.coordinate_rotations, self.grid.with_start(history))
            + _section_rotations(residual_displacements)[..., 0]
        )
        phi = known if guess is None else known + _times(self.amplitude_rotations, guess)
        for _ in range(MAX_ROUNDS):
            values = self._by_free_strains(np.cos(phi) - 1, np.sin(phi) - phi)
            defect = known + _times(self.amplitude_rotations, values) - phi
            if not np.abs(defect).max(initial=0.0) > ROUND_OFF * np.abs(phi).max(initial=0.0):
                break
            phi = phi + _solved(self._jacobian(phi, ALL_NODES), defect)
        return values

    def accelerations(
        self, history: tuple[Reals, Reals, Reals], residual_displacements: Displacements, amplitudes: Reals
    ) -> Complexes:
        """Return the accelerations of all masses due to foreshortening at the points, complex, shape (points, masses).

        `history` contains the values, rates and accelerations of the reduced coordinates. `amplitudes` is the result of
        the method `amplitudes`. `residual_displacements` is described there.
        """
        _, (first_rate, second_rate) = self._rates(history, residual_displacements, amplitudes)
        at_fixed_shape = _times(self.mass_displacements[1:], second_rate)
        return at_fixed_shape + self.grid.rates_times(self.mass_displacements, (2 * first_rate, amplitudes[1:]))

    def _rates(
        self, history: tuple[Reals, Reals, Reals], residual_displacements: Displacements, amplitudes: Reals
    ) -> tuple[Series, tuple[Reals, Reals]]:
        """Return phi at the points with its first and second time derivative, and those of the amplitudes."""
        x, x1, x2 = history
        grid, per_coordinate, per_amplitude = self.grid, self.coordinate_rotations, self.amplitude_rotations
        residual_rotation = _section_rotations(residual_displacements)[1:, :, 0]
        values = amplitudes[1:]
        phi = _times(per_coordinate[1:], x) + residual_rotation + _times(per_amplitude[1:], values)
        sine, cosine, jacobian = np.sin(phi), np.cos(phi), self._jacobian(phi, POINTS)

        known = _times(per_coordinate[1:], x1) + grid.derivative(residual_rotation, 1)
        known += grid.rates_times(per_coordinate, (x, None)) + grid.rates_times(per_amplitude, (values, None))
        rate = _solved(jacobian, known)
        first_rate = self._by_free_strains(-sine * rate, (cosine - 1) * rate)

        known = _times(per_coordinate[1:], x2) + grid.derivative(residual_rotation, 2)
        known += grid.rates_times(per_coordinate, (2 * x1, x))
        known += grid.rates_times(per_amplitude, (2 * first_rate, values))
        at_fixed_rate = self._by_free_strains(-cosine * rate**2, -sine * rate**2)
        second = _solved(jacobian, known + _times(per_amplitude[1:], at_fixed_rate))
        second_rate = self._by_free_strains(-sine * second, (cosine - 1) * second) + at_fixed_rate
        return (phi, rate, second), (first_rate, second_rate)

    def per_coordinate(self, phi: Reals) -> Reals:
        """Return the derivatives of the amplitudes with respect to the reduced coordinates, shape (nodes, k, r).

        `phi` are the rotations at the Gauss points, shape (nodes, Gauss points).
        """
        rotations: Any = np.linalg.solve(self._jacobian(phi, ALL_NODES), self.coordinate_rotations)
        return self._by_changes(-np.sin(phi), np.cos(phi) - 1, rotations)

    def mass_displacements_by(self, per: Reals) -> Complexes:
        """Return the displacements of all masses due to amplitudes of the shape (nodes, k, r)."""
        return _complex_columns(per.swapaxes(1, 2) @ _real_rows(self.mass_displacements))

    def mass_displacement_rates(
        self, history: tuple[Reals, Reals, Reals], residual_displacements: Displacements, amplitudes: Reals
    ) -> tuple[Complexes, Complexes]:
        """Return time derivatives of the displacements of masses due to foreshortening, per unit of each coordinate.

        The parameters are described in `accelerations`. The first and the second derivative are complex and have the
        shape (points, masses, r). They follow from those of phi by the chain rule.
        """
        phi, _ = self._rates(history, residual_displacements, amplitudes)
        shape = len(phi[0]), self.mass_displacements.shape[1], self.coordinate_rotations.shape[-1]
        first, second = np.empty(shape, complex), np.empty(shape, complex)
        for part, (nodes, points) in self.grid.parts(self.mass_displacements[0].size):
            factors = self._per_coordinate_rates(part, nodes, tuple(each[points] for each in phi))
            per, first_per, second_per = (each.swapaxes(1, 2) for each in factors)
            rows = _real_rows(self.mass_displacements[nodes])
            moved, (moved_rate, moved_second) = rows[1:], part.rates(rows)
            first[points] = _complex_columns(per @ moved_rate + first_per @ moved)
            second[points] = _complex_columns(per @ moved_second + 2 * first_per @ moved_rate + second_per @ moved)
        return first, second

    def _per_coordinate_rates(self, part: Grid, nodes: slice, phi: Series) -> Series:
        """Return the derivatives of the amplitudes with respect to the reduced coordinates, and their time derivatives.

        `part` is a part of the grid, and `nodes` are its nodes. `phi` are the rotations at its points with their time
        derivatives. The results have the shape (points, k, r).
        """
        angle, rate, second = phi
        sine, cosine = np.sin(angle), np.cos(angle)
        per_coordinate, per_amplitude = self.coordinate_rotations[nodes], self.amplitude_rotations[nodes]
        coordinate_rates, amplitude_rates = part.rates(per_coordinate), part.rates(per_amplitude)
        inverse: Any = np.linalg.inv(self._jacobian(angle, slice(nodes.start + 1, nodes.stop)))

        by_turn = partial(self._by_changes, -sine, cosine - 1)
        by_turn_rate = partial(self._by_changes, -cosine * rate, -sine * rate)  # its time derivative
        by_turn_second = partial(
            self._by_changes, sine * rate**2 - cosine * second, -cosine * rate**2 - sine * second
        )  # its second time derivative

        turn = inverse @ per_coordinate[1:]
        value = by_turn(turn)
        at_fixed_turn = by_turn_rate(turn)
        known = coordinate_rates[0] + amplitude_rates[0] @ value + per_amplitude[1:] @ at_fixed_turn
        turn_rate = inverse @ known
        value_rate = by_turn(turn_rate) + at_fixed_turn
        at_fixed_turn = by_turn_second(turn) + 2 * by_turn_rate(turn_rate)
        known = coordinate_rates[1] + amplitude_rates[1] @ value + 2 * amplitude_rates[0] @ value_rate
        known += per_amplitude[1:] @ at_fixed_turn
        return value, value_rate, by_turn(inverse @ known) + at_fixed_turn

    def _by_free_strains(self, along: Reals, across: Reals) -> Reals:
        """Return the amplitudes due to free strains along and across the beams, each (nodes, Gauss points)."""
        return along @ self.along.T + across @ self.across.T

    def _by_changes(self, along: Reals, across: Reals, rotations: Reals) -> Reals:
        """Return the amplitudes due to changes of phi, with the free strains that a unit change causes.

        `along` and `across` are these free strains, shape (nodes, Gauss points). `rotations` are the changes, shape
        (nodes, Gauss points, c).
        """
        return self.along @ (along[..., None] * rotations) + self.across @ (across[..., None] * rotations)

    def _jacobian(self, phi: Reals, nodes: slice) -> Reals:
        """Return the Jacobian matrix of Newton's method for phi, shape (nodes, Gauss points, Gauss points).

        The amplitudes depend on the rotations phi, to which they contribute themselves. The matrix is 1 minus the
        derivative of this contribution with respect to phi.
        """
        along, across = (each[nodes] for each in self._rotations_by_strain)
        return np.eye(phi.shape[-1]) + along * np.sin(phi)[:, None] - across * (np.cos(phi) - 1)[:, None]

    @cached_property
    def _rotations_by_strain(self) -> tuple[Reals, Reals]:
        """Rotations phi per unit of each free strain along and across, each (nodes, Gauss points, Gauss points)."""
        return self.amplitude_rotations @ self.along, self.amplitude_rotations @ self.across


def _times(per_unit: Any, amounts: Reals) -> Any:
    """Return the products of matrices and vectors, shapes (nodes, m, n) and (nodes, n)."""
    return (per_unit @ amounts[..., None])[..., 0]


def _real_rows(values: Complexes) -> Reals:
    """Return the transposed matrices as real numbers, from the shape (nodes, m, n) to the shape (nodes, n, 2 m).

    In a product of complex and real matrices, numpy would convert the real ones, and multiply by their zeros.
    """
    return np.ascontiguousarray(values.swapaxes(1, 2)).view(float)


def _complex_columns(rows: Reals) -> Complexes:
    """Undo `_real_rows`."""
    return rows.view(complex).swapaxes(1, 2)


def _solved(matrices: Reals, right: Reals) -> Reals:
    """Solve linear equations with one right-hand side each, shapes (nodes, n, n) and (nodes, n)."""
    found: Any = np.linalg.solve(matrices, right[..., None])
    return np.asarray(found[..., 0], float)


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
    moved = mass_displacements(structure, vibration.motion, kinematics.chosen, unit)
    return Foreshortening(
        terms.grid,
        unit,
        _complex_columns(_real_rows(moved)),  # in the memory layout of `_real_rows`, which then makes no copy
        per_strain[:, :size],
        per_strain[:, size:],
        _section_rotations(kinematics.unit),
        _section_rotations(unit),
    )


def _section_rotations(moved: Displacements) -> Reals:
    """Return the rotations phi at all Gauss points, shape (nodes, Gauss points, c)."""
    return moved.phi.reshape(len(moved.angle), -1, moved.phi.shape[-1])
