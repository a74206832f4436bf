"""Foreshortening: displacements due to rotation of beam pieces without strain, and their rates.

A piece that rotates by phi displaces its end by exp(i phi) - 1 per length, which is i phi in linear theory. The
difference, (cos phi - 1) along the beam and (sin phi - phi) normal to it, acts as a free strain. It determines
amplitudes of the elastic coordinates at every instant, and rigid-body motion closes the joints. Time derivatives are
computed from those of phi by the chain rule, because direct differentiation would amplify the unresolved part of every
element.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.displacements import Displacements, own_basis, unit_displacements
from elastic.elastodynamics.equations_of_motion import mass_rows
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_grid import Grid
from rigid.arrays import Complexes, Reals

MIN_SINGULAR_VALUE = 1e-9  # smaller singular values are round-off; relative to the largest
MAX_ROUNDS = 12  # maximum number of steps of Newton's method for the amplitudes
ROUND_OFF = 1e-12  # convergence limit of the change of amplitudes, relative to the largest one


@dataclass(frozen=True, eq=False)
class Foreshortening:
    """Foreshortening of all beams, represented by k amplitudes at every node of a grid.

    Attributes
    ----------
    grid
        Time grid.
    unit
        Displacements per amplitude, as k kinds.
    rows
        Displacements of all masses per amplitude, complex, shape (nodes, masses, k).
    along, across
        Amplitudes per unit of cos phi - 1 and per unit of sin phi - phi at every Gauss point, shape (k, points).
    turned, own
        Rotations of the sections at all Gauss points per elastic coordinate and per amplitude, shape (nodes, points,
        ...).
    """

    grid: Grid
    unit: Displacements
    rows: Complexes
    along: Reals
    across: Reals
    turned: Reals
    own: Reals

    def amplitudes(self, history: Reals, besides: Displacements, begun: Reals | None = None) -> Reals:
        """Compute the amplitudes at all nodes, shape (nodes, k), by Newton's method.

        Parameters
        ----------
        history
            Amplitudes of the elastic coordinates at the points, shape (points, r).
        besides
            Displacements that these coordinates do not represent, as a single kind.
        begun
            Initial amplitudes.
        """
        given = self._rotation(self.turned, self.grid.at_nodes(history)) + _sections(besides)[..., 0]
        values = np.zeros((len(given), len(self.along))) if begun is None else begun
        for _ in range(MAX_ROUNDS):
            phi = given + self._rotation(self.own, values)
            lacking = (np.cos(phi) - 1) @ self.along.T + (np.sin(phi) - phi) @ self.across.T - values
            if not np.abs(lacking).max(initial=0.0) > ROUND_OFF * np.abs(values).max(initial=0.0):
                break
            change: Any = np.linalg.solve(self._feedback(phi, self.own), lacking[..., None])
            values = values + change[..., 0]
        return values

    def accelerations(
        self, history: tuple[Reals, Reals, Reals], besides: Displacements, amplitudes: Reals
    ) -> Complexes:
        """Return the accelerations of all masses due to foreshortening at the points, complex, shape (points, masses).

        For the parameters see `amplitudes`. `history` also contains rates and accelerations of the elastic coordinates.
        """
        x, x1, x2 = history
        grid, turned, parts = self.grid, self.turned[1:], self.own[1:]
        beside = _sections(besides)[1:, :, 0]
        here = amplitudes[1:]
        phi = self._rotation(turned, x) + beside + self._rotation(parts, here)
        rate = self._rotation(turned, x1) + self._rotation(self._turned_rate, x) + grid.derivative(beside, 1)
        rate += self._rotation(self._own_rate, here)
        second = self._rotation(turned, x2) + grid.rates_times(self.turned, (2 * x1, x)) + grid.derivative(beside, 2)
        per_rotation, feedback = self._per_rotation(phi), self._feedback(phi, parts)
        first: Any = np.linalg.solve(feedback, per_rotation @ rate[..., None])[..., 0]
        rate = rate + self._rotation(parts, first)
        second += grid.rates_times(self.own, (2 * first, here))
        curved = -np.cos(phi) * rate**2 @ self.along.T - np.sin(phi) * rate**2 @ self.across.T
        right = (per_rotation @ second[..., None])[..., 0] + curved
        twice: Any = np.linalg.solve(feedback, right[..., None])[..., 0]
        steady: Complexes = (self.rows[1:] @ twice[..., None])[..., 0]
        return steady + grid.rates_times(self.rows, (2 * first, here))

    def per_coordinate(self, phi: Reals) -> Reals:
        """Return the amplitudes per unit of the elastic coordinates at given rotations, shape (nodes, k, r)."""
        found: Any = np.linalg.solve(self._feedback(phi, self.own), self._per_rotation(phi) @ self.turned)
        return np.asarray(found, float)

    @staticmethod
    def _rotation(per_unit: Reals, amounts: Reals) -> Reals:
        return (per_unit @ amounts[..., None])[..., 0]

    def _per_rotation(self, phi: Reals) -> Reals:
        """Return the amplitudes per unit rotation, shape (nodes, k, points)."""
        return -np.sin(phi)[:, None] * self.along + (np.cos(phi) - 1)[:, None] * self.across

    def _feedback(self, phi: Reals, own: Reals) -> Reals:
        """Return the unit matrix minus the effect of the rotation that the amplitudes cause, shape (nodes, k, k)."""
        return np.eye(len(self.along)) - self._per_rotation(phi) @ own

    @cached_property
    def _turned_rate(self) -> Reals:
        return self.grid.rates(self.turned)[0]

    @cached_property
    def _own_rate(self) -> Reals:
        return self.grid.rates(self.own)[0]


def foreshortening(vibration: Vibration) -> Foreshortening:
    """Set up the foreshortening of all beams of a vibrating mechanism."""
    terms = vibration.problem.terms
    kinds, structure = terms.kinematics, terms.kinematics.structure
    size = structure.weights.size
    strains = strain_rows(structure, np.eye(len(structure.stiffness)))
    scale = 1.0 / np.sqrt(np.diagonal(structure.stiffness))
    soft = np.linalg.inv(structure.stiffness * scale[:, None] * scale)
    pushed = (strains * rigidities(structure)[:, None])[[*range(size), *range(2 * size, 3 * size)]]
    shapes, values, mixed = np.linalg.svd(soft @ (pushed * scale).T, full_matrices=False)
    count = int((values > MIN_SINGULAR_VALUE * values[0]).sum())
    per_strain = values[:count, None] * mixed[:count]
    basis = own_basis(structure, kinds.carried, shapes[:, :count] * scale[:, None])
    unit = unit_displacements(structure, vibration.motion, kinds.carried, basis, kinds.chosen)
    return Foreshortening(
        terms.grid,
        unit,
        mass_rows(structure, vibration.motion, kinds.chosen, unit),
        per_strain[:, :size],
        per_strain[:, size:],
        _sections(kinds.unit),
        _sections(unit),
    )


def _sections(moved: Displacements) -> Reals:
    """Return the rotations at all Gauss points, shape (nodes, points, kinds)."""
    return moved.phi.reshape(len(moved.angle), -1, moved.phi.shape[-1])
