"""Iterative correction of reduced vibration, which adds the inertia of the elastic coordinates that were omitted.

The loads of a vibration follow from the reduced coordinates. Its deflection is the exact quasi-static solution under
these loads. The part of this deflection that the reduced coordinates do not represent (the residual response) also has
inertia, damping and geometric stiffness. They are added as loads to the reduced equations, where they may resonate, and
to the exact quasi-static solution. The reduced equations thus precondition the iteration. The error is the change by
the next iteration. Dashpots and compliant joints do not damp the residual response.
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
    """Add the forces of the residual response to a vibration, and return the result with its remaining error.

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
    """Return the load of the residual response on the reduced coordinates, shape (points, r)."""
    terms, felt, speed = vibration.problem.terms, vibration.problem.felt, vibration.problem.speed
    kinds = terms.kinematics
    moved = mass_rows(kinds.structure, vibration.motion, kinds.chosen, residual.moved)[1:]
    inertia = (speed**2 * masses(kinds.structure))[:, None] * terms.grid.derivative(moved, 2)
    load = (kinds.rows[1:].swapaxes(-1, -2) @ np.conj(inertia)).real + felt.stiffness(kinds.unit, residual.moved)[1:]
    return -(load + terms.strains.swapaxes(-1, -2) @ residual.viscous(vibration.problem)[..., None])[..., 0]


def _left_out(vibration: Vibration) -> ResidualResponse:
    """Return the residual response: the exact deflection minus that of the reduced coordinates."""
    terms = vibration.problem.terms
    structure, x = terms.kinematics.structure, terms.grid.at_nodes(vibration.history[0])[..., None]
    strains = strain_rows(structure, terms.kinematics.basis)
    forces = given_forces(structure, vibration.deflection) - rigidities(structure) * (strains @ x)[..., 0]
    forces[:, forces.shape[1] - len(structure.soft) :] = 0.0
    return ResidualResponse(displacements_of(vibration, vibration.deflection) - terms.kinematics.unit @ x, forces)


def displacements_of(vibration: Vibration, bent: Deflection) -> Displacements:
    """Return the displacements of a deflection at the nodes, as a single kind."""
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
