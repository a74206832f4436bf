"""Second-order effect of large displacement, which the linear equations neglect.

In ground axes, masses are constant and pins transmit displacements linearly. A beam element dx that rotates by s has
the axial strain du/dx + s^2/2, in which s^2/2 is the only quadratic term. The linear equations include the work of the
axial force of the rigid motion on s^2/2. They neglect two loads. One is the transverse component of the additional
axial force that vibration causes, because this force rotates with the beam. The other is the inertia of the
displacements due to the shortening s^2/2. The derivation is in docs/elastodynamics.md.
"""

import numpy as np

from elastic.elastodynamics.displacements import compatible_basis, unit_displacements
from elastic.elastodynamics.equations_of_motion import geometric_stiffness, mass_displacements, masses
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_grid import interpolation
from elastic.links import members_of
from elastic.solution import Deflection
from rigid.arrays import Complexes, Reals
from rigid.kinetostatics import beam_directions


def second_order(vibration: Vibration, stations: Reals) -> tuple[Reals, Reals]:
    """Return the chord deflection of a linear vibration, and the second-order effect on it, at the points of the grid.

    For links without beams, second-order displacements of points are neglected, but second-order moments of forces are
    included.

    Parameters
    ----------
    stations
        Values of xi along the beams, shape (stations,).

    Returns
    -------
    Two arrays of shape (beams, points, stations) [m].
    """
    x = vibration.history[0]
    amplitudes = vibration.problem.terms.grid.with_start(x)
    load = _vibration_force_load(vibration, vibration.deflection, amplitudes) + _shortening_inertia_load(
        vibration, amplitudes
    )
    unit = vibration.problem.terms.kinematics.unit.beams[1:]
    both = (x, vibration.response_to(load)[0])
    linear, increment = (chord_of(vibration, (unit @ each[:, None, :, None])[..., 0], stations) for each in both)
    return linear, increment


def _vibration_force_load(vibration: Vibration, bent: Deflection, x: Reals) -> Reals:
    """Return the load due to the geometric stiffness of the forces that vibration causes, shape (points, r).

    The linear equations include only the geometric stiffness of the forces of the rigid motion.
    """
    kinematics, problem = vibration.problem.terms.kinematics, vibration.problem
    moved = kinematics.unit @ x[..., None]
    by_deflection = geometric_stiffness(kinematics.structure, bent, kinematics.chosen).stiffness(kinematics.unit, moved)
    return (problem.geometric.stiffness(kinematics.unit, moved) - by_deflection)[1:, :, 0]


def _shortening_inertia_load(vibration: Vibration, x: Reals) -> Reals:
    """Return the load due to the inertia of the motion that shortening of beam elements causes, shape (points, r)."""
    terms, motion = vibration.problem.terms, vibration.motion
    kinematics = terms.kinematics
    structure = kinematics.structure
    slope = (kinematics.unit @ x[..., None]).slope
    stretch = -np.square(slope).reshape(len(x), -1) / 2
    size = structure.weights.size
    rows = strain_rows(structure, np.eye(len(structure.stiffness)))[:size]
    scale = 1.0 / np.sqrt(np.diagonal(structure.stiffness))
    forces = (stretch * rigidities(structure)[:size]) @ rows * scale
    shortening = np.linalg.solve(structure.stiffness * scale[:, None] * scale, forces.T).T * scale
    basis = compatible_basis(structure, kinematics.rigid_modes, shortening[..., None])
    moved = unit_displacements(structure, motion, kinematics.rigid_modes, basis, kinematics.chosen)
    acceleration = terms.grid.rates(mass_displacements(structure, motion, kinematics.chosen, moved))[1]
    inertia = np.conj(acceleration) * masses(structure)[:, None]
    return -(vibration.problem.speed**2) * (kinematics.mass_displacements[1:].swapaxes(-1, -2) @ inertia)[..., 0].real


def chord_of(vibration: Vibration, along: Complexes, stations: Reals) -> Reals:
    """Return the chord deflection at the points of a grid [m], shape (beams, points, stations).

    Parameters
    ----------
    along
        Displacements of the beams at Gauss points in ground axes [m], complex, shape (points, beams, Gauss points).
    stations
        See `second_order`.
    """
    w = (np.conj(beam_directions(vibration.motion)).T[1:, :, None] * along).imag
    nodes = vibration.problem.terms.kinematics.structure.xi
    across = np.moveaxis(w @ interpolation(nodes, stations).T, 1, 0)
    return members_of(vibration.motion.mechanism).from_chord(across, stations)
