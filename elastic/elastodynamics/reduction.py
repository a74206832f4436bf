"""Reduced basis of the elastic coordinates for vibration.

The basis has three parts. The first contains the lowest vibration modes, computed with the mass matrix averaged over
the cycle. The second contains the quasi-static bending due to the inertia of these modes at single positions. The third
contains the quasi-static bending under the loads, i.e. Ritz vectors, see Wilson, Yuan and Dickens, Dynamic analysis by
direct superposition of Ritz vectors, Earthquake Engineering and Structural Dynamics 10 (1982) 813-821.
"""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.equations_of_motion import Kinematics, kinematics, masses
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.strains import strain_forces, strain_rows
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.solution import Deflection
from rigid import Motion
from rigid.arrays import Reals


class CycleModes(Struct, frozen=True, eq=False):
    """Vibration modes, computed with all elastic coordinates, and data for a reduced basis.

    Attributes
    ----------
    unit_stiffness
        Basis of the elastic coordinates in which the stiffness matrix is the unit matrix, shape (n, n).
    masses
        Mass matrix in the basis `unit_stiffness`, shape (positions, n, n).
    omega
        Lowest natural frequency at every position with locked drives [rad/s]; inf if no link vibrates.
    values
        Eigenvalues of the mass matrix averaged over the cycle, in descending order, shape (n,). Each is 1/omega^2 for a
        natural frequency omega.
    modes
        Eigenvectors of the averaged mass matrix in the same order, one per column, shape (n, n).
    bent
        Quasi-static bending under the loads, in the basis `unit_stiffness`, shape (n, cases). Each position of each
        deflection is a case.
    """

    unit_stiffness: Reals
    masses: Reals
    omega: Reals
    values: Reals
    modes: Reals
    bent: Reals


def unit_stiffness_basis(structure: ElasticStructure) -> Reals:
    """Return a basis of the elastic coordinates in which the stiffness matrix is the unit matrix, shape (n, n)."""
    stiffness = structure.stiffness
    scale = 1.0 / np.sqrt(np.diagonal(stiffness))
    return (np.linalg.inv(np.linalg.cholesky(stiffness * scale[:, None] * scale)) * scale).T


def mass_of(kinematics_: Kinematics) -> Reals:
    """Return the mass matrix of a basis at every position, shape (positions, r, r)."""
    weighted = np.sqrt(masses(kinematics_.structure))[:, None] * kinematics_.mass_displacements
    return (np.conj(weighted).swapaxes(-1, -2) @ weighted).real


def cycle_of(structure: ElasticStructure, motion: Motion, loaded: Sequence[Deflection]) -> CycleModes:
    """Compute the modes of a structure for a cycle, and its bending under given loads.

    Parameters
    ----------
    loaded
        Quasi-static deflections under the given loads.
    """
    unit_stiffness = unit_stiffness_basis(structure)
    kinematics_ = kinematics(structure, motion, unit_stiffness, chosen_points(structure.mechanism))
    reduced_mass = mass_of(kinematics_)
    values, modes = np.linalg.eigh(reduced_mass.mean(axis=0))
    values = values[::-1]
    subspace, _ = np.linalg.qr(reduced_mass @ modes[:, -VIBRATION.mean_modes :])
    greatest = np.linalg.eigvalsh(subspace.swapaxes(-1, -2) @ reduced_mass @ subspace)[:, -1]
    with np.errstate(divide="ignore"):
        omega = np.where(greatest > VIBRATION.massless * values[0], 1.0 / np.sqrt(np.maximum(greatest, 0.0)), np.inf)
    strains = strain_rows(structure, kinematics_.basis).swapaxes(-1, -2)
    bent = [(strains @ strain_forces(structure, one)[..., None])[..., 0].T for one in loaded]
    return CycleModes(unit_stiffness, reduced_mass, omega, values, modes[:, ::-1], np.concatenate(bent, axis=1))


def reduced_basis(
    cycle: CycleModes, modes: int, min_shape_size: float, load_accuracy: float = VIBRATION.load_accuracy
) -> Reals:
    """Return a reduced basis of modes, bending due to the inertia of these modes, and bending under the loads.

    In this basis, the mass matrix averaged over the cycle is the unit matrix.

    Parameters
    ----------
    min_shape_size
        A shape of bending is added if the part of it that the basis does not represent is larger than this. The size of
        a shape is the square root of its strain energy, relative to a mode.
    load_accuracy
        For bending under the loads, the limit is instead `min_shape_size` / `load_accuracy`, relative to the largest
        bending.

    Returns
    -------
    Array of shape (n, r).
    """
    values, chosen = cycle.values[:modes], cycle.modes[:, :modes]
    bending = cycle.masses @ (chosen / values)
    shapes = np.concatenate(list(bending), axis=1) / np.sqrt(len(bending))
    basis = _extended_basis(chosen, shapes, min_shape_size)
    load_sizes = np.linalg.norm(cycle.bent, axis=0)
    if load_sizes.any():
        basis = _extended_basis(basis, cycle.bent / load_sizes.max(), min_shape_size / load_accuracy)
    scale, rotation = np.linalg.eigh(basis.T @ cycle.masses.mean(axis=0) @ basis)
    size = np.sqrt(np.maximum(scale, VIBRATION.massless * scale[-1]))
    return cycle.unit_stiffness @ (basis @ (rotation / size)[:, ::-1])


def _extended_basis(basis: Reals, others: Reals, min_size: float) -> Reals:
    """Extend an orthonormal basis so that it represents the vectors `others`.

    The part of `others` that the basis does not represent is decomposed into principal directions. The directions in
    which it is larger than `min_size` are added.
    """
    remainder = others - basis @ (basis.T @ others)
    squares, directions = np.linalg.eigh(remainder @ remainder.T)
    added = directions[:, squares > min_size**2][:, ::-1]
    return np.concatenate((basis, added - basis @ (basis.T @ added)), axis=1)


def initial_mode_count(cycle: CycleModes) -> int:
    """Return the number of modes with frequencies up to `VIBRATION.initial_frequency_ratio` times the lowest one.

    The number is at least `VIBRATION.min_modes`, but at most the number of modes with mass.
    """
    moving = cycle.values > VIBRATION.massless * cycle.values[0]
    count = int((cycle.values > cycle.values[0] / VIBRATION.initial_frequency_ratio**2).sum())
    return min(max(count, VIBRATION.min_modes), int(moving.sum()))
