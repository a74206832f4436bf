"""Iterative correction of the reduced coordinates, until the answer includes the inertia of all elastic coordinates.

The reduced coordinates give loads; the exact quasi-static answer under these loads is the result. Its displacements
beyond the reduced coordinates (residual response) have inertia, damping and geometric stiffness of their own. These are
added as loads to the reduced equations, where they may resonate, and to the exact answer. The reduced equations
precondition this iteration. The change by the next iteration is the error. Dashpots and soft joints do not damp the
residual response.
"""

from dataclasses import replace

import numpy as np

from elastic.elastodynamics.displacements import UNDER, Displacements, below
from elastic.elastodynamics.equations_of_motion import mass_rows, masses
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.samples import along_beams
from elastic.elastodynamics.strains import given_forces, rigidities, strain_rows
from elastic.elastodynamics.vibration_loads import ResidualResponse
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.sampling import displacement_of, rotation_of
from elastic.solution import Deflection
from elastic.vibration.beam_matrices import rigidity
from rigid.arrays import Reals
from rigid.kinetostatics import beam_directions


def corrected(answer: Vibration, tolerance: float) -> tuple[Vibration, float]:
    """Add the forces of the residual response to a vibration; also return the remaining error.

    The error is the change by the next correction, relative to the largest displacement. It exceeds the tolerance if
    the corrections do not converge, and is 0 if there are no beams.
    """
    kinds = answer.problem.terms.kinematics
    best, least = answer, np.inf
    greatest = np.abs(answer.displacements).max() if kinds.structure.weights.size else 0.0
    if not greatest:
        return answer, 0.0
    for _ in range(VIBRATION.max_corrections):
        missed = _left_out(answer)
        change = missed if answer.residual is None else missed - answer.residual
        more = answer.under(inertia_load(answer, change))
        error = float(max(np.abs(change.moved.beams[1:]).max(), np.abs(answer.places(more[0])).max()) / greatest)
        before = least
        if error < least:
            best, least = answer, error
        if error <= tolerance or not error <= VIBRATION.max_correction_ratio * before:
            break
        x, x1, x2 = (part + added for part, added in zip(answer.history, more, strict=True))
        answer = replace(answer, history=(x, x1, x2), residual=missed)
    return best, least


def inertia_load(vibration: Vibration, residual: ResidualResponse) -> Reals:
    """Load of the residual response on the coordinates, shape (points, r)."""
    terms, felt, speed = vibration.problem.terms, vibration.problem.felt, vibration.problem.speed
    kinds = terms.kinematics
    moved = mass_rows(kinds.structure, vibration.motion, kinds.chosen, residual.moved)[1:]
    inertia = (speed**2 * masses(kinds.structure))[:, None] * terms.grid.derivative(moved, 2)
    load = (kinds.rows[1:].swapaxes(-1, -2) @ np.conj(inertia)).real + felt.stiffness(kinds.unit, residual.moved)[1:]
    return -(load + terms.strains.swapaxes(-1, -2) @ residual.viscous(vibration.problem)[..., None])[..., 0]


def _left_out(vibration: Vibration) -> ResidualResponse:
    """Residual response: exact answer minus the displacements of the coordinates."""
    terms = vibration.problem.terms
    structure, x = terms.kinematics.structure, terms.grid.at_nodes(vibration.history[0])[..., None]
    strains = strain_rows(structure, terms.kinematics.basis)
    forces = given_forces(structure, vibration.deflection) - rigidities(structure) * (strains @ x)[..., 0]
    forces[:, forces.shape[1] - len(structure.soft) :] = 0.0
    return ResidualResponse(displacements_of(vibration, vibration.deflection) - terms.kinematics.unit @ x, forces)


def displacements_of(vibration: Vibration, bent: Deflection) -> Displacements:
    """Displacements of a deflection at the nodes, as a single kind."""
    structure, motion = vibration.problem.terms.kinematics.structure, vibration.motion
    u, w, phi, V = (along_beams(bent, name, structure.xi)[..., None] for name in ("u", "w", "phi", "V"))
    beams = beam_directions(motion).T[..., None, None] * (u + 1j * w)
    shear = np.array([rigidity(section, "kGA", structure.xi) for section in structure.sections])[..., None]
    slope = phi - V / shear
    moves, turns = [], []
    for at, name in vibration.problem.terms.kinematics.chosen:
        if name.startswith(UNDER):
            move, turn = (part[..., 0] for part in below(structure, motion, name, beams, slope))
        else:
            move, turn = displacement_of(bent, at, name), rotation_of(bent, at, name)
        moves.append(move)
        turns.append(turn)
    shape = (len(moves), len(u), 1)
    return Displacements(
        beams,
        slope,
        phi,
        bent.angle.T[..., None],
        np.moveaxis(np.reshape(np.array(moves, complex), shape), 0, 1),
        np.moveaxis(np.reshape(np.array(turns, float), shape), 0, 1),
    )
