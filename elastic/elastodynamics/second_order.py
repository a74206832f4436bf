"""Second-order effect of large displacement, which the linear equations neglect.

In ground axes, masses are constant and pins transmit displacements linearly. The only quadratic term is the axial
strain du/dx + s^2/2 of a piece that rotates by s. The linear equations include the work of the force of the rigid
motion on s^2/2. Two loads remain: the force of the vibration normal to rotated pieces, and the inertia due to the
shortening of rotated pieces. The derivation is in docs/elastodynamics.md.
"""

import numpy as np

from elastic.elastodynamics.displacements import own_basis, unit_displacements
from elastic.elastodynamics.equations_of_motion import geometric_stiffness, mass_rows, masses
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_grid import interpolation
from elastic.links import members_of
from elastic.solution import Deflection
from rigid.arrays import Complexes, Reals
from rigid.kinetostatics import beam_directions


def second_order(vibration: Vibration, stations: Reals) -> tuple[Reals, Reals]:
    """Return the chord deflection of linear vibration at the points of the grid, and its second-order increment.

    The rotation of rigid links is neglected, except for the forces on them.

    Parameters
    ----------
    stations
        Values of xi along the beams, shape (stations,).

    Returns
    -------
    Two arrays of shape (beams, points, stations) [m].
    """
    x = vibration.history[0]
    at_nodes = vibration.problem.terms.grid.at_nodes(x)
    load = _across(vibration, vibration.deflection, at_nodes) + _nearer(vibration, at_nodes)
    unit = vibration.problem.terms.kinematics.unit.beams[1:]
    both = (x, vibration.under(load)[0])
    linear, more = (chord_of(vibration, (unit @ each[:, None, :, None])[..., 0], stations) for each in both)
    return linear, more


def _across(vibration: Vibration, bent: Deflection, x: Reals) -> Reals:
    """Return the load due to the forces that vibration adds to those of the rigid motion, shape (points, r)."""
    kinds, problem = vibration.problem.terms.kinematics, vibration.problem
    moved = kinds.unit @ x[..., None]
    whole = geometric_stiffness(kinds.structure, bent, kinds.chosen).stiffness(kinds.unit, moved)
    return (problem.felt.stiffness(kinds.unit, moved) - whole)[1:, :, 0]


def _nearer(vibration: Vibration, x: Reals) -> Reals:
    """Return the load due to the inertia of rotated pieces, which are shortened, shape (points, r)."""
    terms, motion = vibration.problem.terms, vibration.motion
    kinds = terms.kinematics
    structure = kinds.structure
    slope = (kinds.unit @ x[..., None]).slope
    stretch = -np.square(slope).reshape(len(x), -1) / 2
    size = structure.weights.size
    rows = strain_rows(structure, np.eye(len(structure.stiffness)))[:size]
    scale = 1.0 / np.sqrt(np.diagonal(structure.stiffness))
    given = (stretch * rigidities(structure)[:size]) @ rows * scale
    shorter = np.linalg.solve(structure.stiffness * scale[:, None] * scale, given.T).T * scale
    own = own_basis(structure, kinds.carried, shorter[..., None])
    moved = unit_displacements(structure, motion, kinds.carried, own, kinds.chosen)
    acceleration = terms.grid.rates(mass_rows(structure, motion, kinds.chosen, moved))[1]
    inertia = np.conj(acceleration) * masses(structure)[:, None]
    return -(vibration.problem.speed**2) * (kinds.rows[1:].swapaxes(-1, -2) @ inertia)[..., 0].real


def chord_of(vibration: Vibration, along: Complexes, stations: Reals) -> Reals:
    """Return the chord deflection at the points of a grid, shape (beams, points, stations).

    Parameters
    ----------
    along
        Displacements of the beams in ground axes [m], complex, shape (points, beams, Gauss points).
    """
    w = (np.conj(beam_directions(vibration.motion)).T[1:, :, None] * along).imag
    nodes = vibration.problem.terms.kinematics.structure.xi
    across = np.moveaxis(w @ interpolation(nodes, stations).T, 1, 0)
    return members_of(vibration.motion.mechanism).from_chord(across, stations)
