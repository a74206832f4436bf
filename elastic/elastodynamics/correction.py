"""Iterative correction of a vibration by the inertia of displacements that its reduced coordinates omit.

The inertia and damping loads of a vibration are computed from the reduced coordinates. The deflection is the exact
quasi-static solution under these loads. The residual response is the part of this deflection that the reduced
coordinates do not represent. It also has inertia, damping and geometric stiffness, and the resulting forces are loads
on the mechanism. Each iteration adds these loads to the quasi-static solution and to the reduced equations of motion,
in which they may excite resonance. The error of the result is the change that one more iteration would make. Damping of
the residual response by dashpots and compliant joints is neglected.
"""

import numpy as np
from msgspec.structs import replace

from elastic.elastodynamics.displacements import UNDER_BLOCK, Displacements, motion_under_block
from elastic.elastodynamics.equations_of_motion import mass_displacements, masses
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_forces, strain_rows
from elastic.elastodynamics.vibration_loads import ResidualResponse
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.sampling import along_beams, displacement_of, rotation_of
from elastic.solution import Deflection
from elastic.vibration.beam_matrices import rigidity
from rigid.arrays import Reals
from rigid.kinetostatics import beam_directions


def corrected(answer: Vibration, tolerance: float) -> tuple[Vibration, float]:
    """Add the forces of the residual response to a vibration, and return the result and its error.

    The error is the change that the next correction would make, relative to the largest displacement. It exceeds
    `tolerance` if the corrections do not converge. It is 0 if there are no beams or no vibration.
    """
    best, least = answer, np.inf
    has_beams = answer.problem.terms.kinematics.structure.weights.size > 0
    greatest = np.abs(answer.displacements).max() if has_beams else 0.0
    if not greatest:
        return answer, 0.0
    for _ in range(VIBRATION.max_corrections):
        residual = _residual_response(answer)
        change = residual if answer.residual is None else residual - answer.residual
        response = answer.response_to(inertia_load(answer, change))
        error = float(
            max(np.abs(change.moved.beams[1:]).max(), np.abs(answer.beam_displacements(response[0])).max()) / greatest
        )
        before = least
        if error < least:
            best, least = answer, error
        if error <= tolerance or not error <= VIBRATION.max_correction_ratio * before:
            break
        x, x1, x2 = (part + added for part, added in zip(answer.history, response, strict=True))
        answer = replace(answer, history=(x, x1, x2), residual=residual)
    return best, least


def with_inertia_of(bent: Deflection, answer: Vibration, cutoff: float) -> Vibration:
    """Add to a vibration the response to the inertia of displacements that its model neglects.

    This is a first-order correction: the effect of the added response on the neglected displacements is not included.

    Parameters
    ----------
    bent
        Deflection at the nodes, including both the vibration and the neglected displacements.
    cutoff
        Cutoff frequency of the low-pass filter for the neglected displacements [rad/s].
    """
    neglected = displacements_of(answer, bent) - displacements_of(answer, answer.deflection)
    undamped = np.zeros((len(neglected.angle), len(rigidities(answer.problem.terms.kinematics.structure))))
    residual = ResidualResponse(neglected, undamped).filtered(answer.problem, answer.cyclic, cutoff)
    response = answer.response_to(inertia_load(answer, residual))
    x, x1, x2 = (part + change for part, change in zip(answer.history, response, strict=True))
    return replace(
        answer, history=(x, x1, x2), residual=residual if answer.residual is None else answer.residual + residual
    )


def inertia_load(vibration: Vibration, residual: ResidualResponse) -> Reals:
    """Return the load on the reduced coordinates due to the residual response, shape (points, r).

    It includes inertia, damping and geometric stiffness.
    """
    terms, geometric, speed = vibration.problem.terms, vibration.problem.geometric, vibration.problem.speed
    kinematics = terms.kinematics
    moved = mass_displacements(kinematics.structure, vibration.motion, kinematics.chosen, residual.moved)[1:]
    inertia = (speed**2 * masses(kinematics.structure))[:, None] * terms.grid.derivative(moved, 2)
    load = (kinematics.mass_displacements[1:].swapaxes(-1, -2) @ np.conj(inertia)).real + geometric.stiffness(
        kinematics.unit, residual.moved
    )[1:]
    return -(load + terms.strains.swapaxes(-1, -2) @ residual.viscous(vibration.problem)[..., None])[..., 0]


def _residual_response(vibration: Vibration) -> ResidualResponse:
    """Return the residual response: the quasi-static deflection minus the deflection of the reduced coordinates."""
    terms = vibration.problem.terms
    structure, x = terms.kinematics.structure, terms.grid.with_start(vibration.history[0])[..., None]
    strains = strain_rows(structure, terms.kinematics.basis)
    forces = strain_forces(structure, vibration.deflection) - rigidities(structure) * (strains @ x)[..., 0]
    forces[:, forces.shape[1] - len(structure.joint_openings) :] = 0.0
    return ResidualResponse(displacements_of(vibration, vibration.deflection) - terms.kinematics.unit @ x, forces)


def displacements_of(vibration: Vibration, bent: Deflection) -> Displacements:
    """Convert a deflection at the nodes to `Displacements` with a single displacement field (c = 1)."""
    structure, motion = vibration.problem.terms.kinematics.structure, vibration.motion
    u, w, phi, V = (along_beams(bent, name, structure.xi)[..., None] for name in ("u", "w", "phi", "V"))
    beams = beam_directions(motion).T[..., None, None] * (u + 1j * w)
    shear = V / np.array([rigidity(section, "kGA", structure.xi) for section in bent.sections])[..., None]
    slope = phi - shear
    moves, turns = [], []
    for at, name in vibration.problem.terms.kinematics.chosen:
        if name.startswith(UNDER_BLOCK):
            move, turn = (part[..., 0] for part in motion_under_block(structure, motion, name, beams, slope))
        else:
            move, turn = displacement_of(bent, at, name), rotation_of(bent, at, name)
        moves.append(move)
        turns.append(turn)
    shape = (len(moves), len(u), 1)
    return Displacements(
        beams,
        slope,
        shear,
        bent.angle.T[..., None],
        np.moveaxis(np.reshape(np.array(moves, complex), shape), 0, 1),
        np.moveaxis(np.reshape(np.array(turns, float), shape), 0, 1),
    )
