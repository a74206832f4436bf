"""Reduced basis of the elastic coordinates for vibration.

The basis consists of the lowest modes with the mass averaged over the cycle, and of the quasi-static bending due to
their inertia at single positions (Ritz vectors, see Wilson, Yuan and Dickens, Dynamic analysis by direct superposition
of Ritz vectors, Earthquake Engineering and Structural Dynamics 10 (1982) 813-821).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.equations_of_motion import Kinematics, kinematics, masses
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.strains import given_forces, strain_rows
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.solution import Deflection
from rigid import Motion
from rigid.arrays import Reals


@dataclass(frozen=True, eq=False)
class CycleModes:
    """Modes of all elastic coordinates over a cycle.

    Attributes
    ----------
    unstrained
        Transformation from coordinates with unit stiffness to the elastic coordinates, shape (n, n).
    masses
        Mass matrix in coordinates with unit stiffness, shape (positions, n, n).
    omega
        Lowest natural frequency at every position with locked drives [rad/s]; inf if no link vibrates.
    values, modes
        Eigenvalues 1/omega^2 of the mean mass matrix in descending order, and eigenvectors, shape (n, n).
    bent
        Quasi-static bending under the loads, shape (n, columns). The squared length of a column is twice its energy.
    """

    unstrained: Reals
    masses: Reals
    omega: Reals
    values: Reals
    modes: Reals
    bent: Reals


def unstrained_basis(structure: ElasticStructure) -> Reals:
    """Return a basis of the elastic coordinates with unit stiffness, shape (n, n)."""
    stiffness = structure.stiffness
    scale = 1.0 / np.sqrt(np.diagonal(stiffness))
    return (np.linalg.inv(np.linalg.cholesky(stiffness * scale[:, None] * scale)) * scale).T


def mass_of(kinds: Kinematics) -> Reals:
    """Return the mass matrix of a basis at every position, shape (positions, r, r)."""
    rows = np.sqrt(masses(kinds.structure))[:, None] * kinds.rows
    return (np.conj(rows).swapaxes(-1, -2) @ rows).real


def cycle_of(structure: ElasticStructure, motion: Motion, loaded: Sequence[Deflection]) -> CycleModes:
    """Compute the modes of a structure over positions of its cycle, and its bending under the loads of deflections."""
    unstrained = unstrained_basis(structure)
    kinds = kinematics(structure, motion, unstrained, chosen_points(structure.mechanism))
    reduced_mass = mass_of(kinds)
    values, modes = np.linalg.eigh(reduced_mass.mean(axis=0))
    values = values[::-1]
    near, _ = np.linalg.qr(reduced_mass @ modes[:, -VIBRATION.nearest_modes :])
    greatest = np.linalg.eigvalsh(near.swapaxes(-1, -2) @ reduced_mass @ near)[:, -1]
    with np.errstate(divide="ignore"):
        omega = np.where(greatest > VIBRATION.massless * values[0], 1.0 / np.sqrt(np.maximum(greatest, 0.0)), np.inf)
    strains = strain_rows(structure, kinds.basis).swapaxes(-1, -2)
    bent = [(strains @ given_forces(structure, one)[..., None])[..., 0].T for one in loaded]
    return CycleModes(unstrained, reduced_mass, omega, values, modes[:, ::-1], np.concatenate(bent, axis=1))


def reduced_basis(cycle: CycleModes, modes: int, besides: float, closer: float = VIBRATION.load_accuracy) -> Reals:
    """Return a basis of modes and of the bending due to their inertia, shape (n, r), with unit mean mass.

    Parameters
    ----------
    besides
        Smallest bending that is added to the basis / bending of a mode, as roots of energies.
    closer
        Accuracy of the shapes due to the loads, relative to `besides`.
    """
    values, chosen = cycle.values[:modes], cycle.modes[:, :modes]
    bent = cycle.masses @ (chosen / values)
    wide = np.concatenate(list(bent), axis=1) / np.sqrt(len(bent))
    basis = _with_more(chosen, wide, besides)
    loaded = np.linalg.norm(cycle.bent, axis=0)
    if loaded.any():
        basis = _with_more(basis, cycle.bent / loaded.max(), besides / closer)
    scale, turned = np.linalg.eigh(basis.T @ cycle.masses.mean(axis=0) @ basis)
    size = np.sqrt(np.maximum(scale, VIBRATION.massless * scale[-1]))
    return cycle.unstrained @ (basis @ (turned / size)[:, ::-1])


def _with_more(basis: Reals, others: Reals, least: float) -> Reals:
    """Extend orthonormal columns by directions in which `others` have a component greater than `least`."""
    beyond = others - basis @ (basis.T @ others)
    squares, ways = np.linalg.eigh(beyond @ beyond.T)
    more = ways[:, squares > least**2][:, ::-1]
    return np.concatenate((basis, more - basis @ (basis.T @ more)), axis=1)


def near_modes(cycle: CycleModes) -> int:
    """Return the number of modes with frequencies near the lowest one."""
    moving = cycle.values > VIBRATION.massless * cycle.values[0]
    near = int((cycle.values > cycle.values[0] / VIBRATION.near_frequencies**2).sum())
    return min(max(near, VIBRATION.min_modes), int(moving.sum()))
