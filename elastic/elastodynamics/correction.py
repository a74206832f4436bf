"""What reduced coordinates leave out, put right: the answer becomes that in which all elastic coordinates vibrate.

There are two routes to an answer: the reduced coordinates, and the exact quasi-static answer under the loads that they
give, which is taken. What the second has and the first has not is felt by neither: its inertia. That goes as a load into
the equations of the reduced coordinates, where it may resonate, and into the exact answer; and so on, the reduced
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
from elastic.sampling import displacement_of
from rigid.loads import beam_directions

CORRECTIONS = 8
FALL = 0.5  # of the error by a correction, below which more coordinates are the shorter way


def corrected(found: Vibration, tolerance: float) -> tuple[Vibration, float]:
    """The vibration with the inertia of what the coordinates leave out, and how far its answer is still off.

    As a share of the largest displacement; not below the tolerance where corrections do not get there. Without beams
    nothing is left out.
    """
    terms, size = found.problem.terms, found.problem.terms.kinematics.structure.weights.size
    heavy = found.problem.speed**2 * masses(terms.kinematics.structure)
    rows = np.conj(terms.kinematics.rows[1:]).swapaxes(-1, -2)
    best, least = found, np.inf
    for _ in range(CORRECTIONS):
        greatest = np.abs(found.displacements).max() if size else 0.0
        if not greatest:
            return found, 0.0
        missed = _left_out(found)
        change = missed - found.beside
        load = -(rows @ (heavy * terms.grid.rates(change)[1])[..., None])[..., 0].real
        more = found.under(load)
        error = float(max(np.abs(change[:, :size]).max(), np.abs(found.places(more[0])).max()) / greatest)
        before = least
        if error < least:
            best, least = found, error
        if error <= tolerance or error > FALL * before:
            break
        history = tuple(part + added for part, added in zip(found.history, more, strict=True))
        found = replace(found, history=history, beside=missed)
    return best, least


def _left_out(found: Vibration) -> Any:
    """Displacements of all masses that the coordinates do not follow, shape (nodes, masses), complex.

    Rotations of sections and lumps count as followed.
    """
    kinds, bent = found.problem.terms.kinematics, found.deflection
    structure, x = kinds.structure, found.problem.terms.grid.at_nodes(found.history[0])[..., None]
    missed = np.zeros(kinds.rows.shape[:-1], complex)
    size, lumps = structure.weights.size, lumps_of(structure.mechanism)
    u, w = (along_beams(bent, name, structure.xi) for name in ("u", "w"))
    along = beam_directions(found.motion).T[..., None] * (u + 1j * w)
    missed[:, :size] = along.reshape(len(u), -1) - (kinds.rows[:, :size] @ x)[..., 0]
    for number, (at, lump) in enumerate(lumps):
        followed = (kinds.unit.moves[:, None, kinds.chosen.index((at, lump.point))] @ x)[:, 0, 0]
        missed[:, 2 * (number - len(lumps))] = displacement_of(bent, at, lump.point) - followed
    return missed
