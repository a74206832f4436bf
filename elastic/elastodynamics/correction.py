"""What reduced coordinates leave out, put right: the answer becomes that in which all elastic coordinates vibrate.

There are two routes to an answer: the reduced coordinates, and the exact quasi-static answer under the loads that they
give, which is taken. The inertia of what the second has and the first has not is felt by neither. It goes as a load
into the equations of the reduced coordinates, where it may resonate, and into the exact answer; and so on, the reduced
equations being what iterations of the whole ones are preconditioned with. What an iteration is about to change is how
far the answer is off.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from elastic.elastodynamics.equations_of_motion import masses
from elastic.elastodynamics.point_effects import lumps_of
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.samples import along_beams
from elastic.sampling import displacement_of, rotation_of
from rigid.loads import beam_directions

CORRECTIONS = 8
FALL = 0.5  # of the error by a correction, below which more coordinates are the shorter way


def corrected(found: Vibration, tolerance: float) -> tuple[Vibration, float]:
    """The vibration with the inertia of what the coordinates leave out, and how far its answer is still off.

    That is what another correction would change, of the largest displacement: more than the tolerance where corrections
    do not get there; 0 without beams, where nothing is left out.
    """
    terms, size = found.problem.terms, found.problem.terms.kinematics.structure.weights.size
    best, least, greatest = found, np.inf, np.abs(found.displacements).max() if size else 0.0
    if not greatest:
        return found, 0.0
    heavy = found.problem.speed**2 * masses(terms.kinematics.structure)
    rows = terms.kinematics.rows[1:]
    for _ in range(CORRECTIONS):
        missed = _displacements(found) - (rows @ found.history[0][..., None])[..., 0]
        change = missed - found.beside
        inertia = heavy * terms.grid.acceleration(change)
        more = found.under(-(np.conj(rows).swapaxes(-1, -2) @ inertia[..., None])[..., 0].real)
        error = float(max(np.abs(change[:, :size]).max(), np.abs(found.places(more[0])).max()) / greatest)
        before = least
        if error < least:
            best, least = found, error
        if error <= tolerance or not error <= FALL * before:
            break
        history = tuple(part + added for part, added in zip(found.history, more, strict=True))
        found = replace(found, history=history, beside=missed)
    return best, least


def _displacements(found: Vibration) -> Any:
    """Displacements of all masses in the exact answer, rotations too, as `mass_rows` has them, (points, masses)."""
    structure, bent, motion = found.problem.terms.kinematics.structure, found.deflection, found.motion
    u, w = (along_beams(bent, name, structure.xi) for name in ("u", "w"))
    moved = beam_directions(motion).T[..., None] * (u + 1j * w)
    rows = [moved.reshape(len(u), -1)]
    if structure.rotary.any():
        rows.append(along_beams(bent, "phi", structure.xi).reshape(len(u), -1))
    for at, lump in lumps_of(structure.mechanism):
        turned = rotation_of(bent, at, lump.point)
        arm = motion.direction[at] * np.ravel(lump.offset)[0]
        rows += [(displacement_of(bent, at, lump.point) + 1j * arm * turned)[:, None], turned[:, None]]
    return np.concatenate(rows, axis=1)[1:]
