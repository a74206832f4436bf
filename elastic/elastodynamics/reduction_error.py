"""How far the answer is from one in which all elastic coordinates vibrate.

There are two routes to it: the reduced coordinates, and the exact quasi-static answer under the loads that they give,
which is taken. Where the two differ, the inertia of the difference is felt by neither. Solved for in the reduced
coordinates, it is what the answer misses: more than the difference itself where that resonates.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elastic.elastodynamics.equations_of_motion import masses
from elastic.elastodynamics.point_effects import lumps_of
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.samples import along_beams
from elastic.sampling import displacement_of
from rigid.loads import beam_directions


def reduction_error(found: Vibration) -> float:
    """What the coordinates leave out, or what its inertia makes vibrate if that is more, of the largest displacement.

    Without beams nothing is left out.
    """
    terms, size = found.problem.terms, found.problem.terms.kinematics.structure.weights.size
    greatest = np.abs(found.displacements).max() if size else 0.0
    if not greatest:
        return 0.0
    missed = _left_out(found)
    rows = terms.kinematics.rows[1:]
    inertia = (found.problem.speed**2 * masses(terms.kinematics.structure)) * terms.grid.rates(missed)[1]
    load = -(np.conj(rows).swapaxes(-1, -2) @ inertia[..., None])[..., 0].real
    vibrating = found.places(found.under(load))
    return float(max(np.abs(missed[:, :size]).max(), np.abs(vibrating).max()) / greatest)


def _left_out(found: Vibration) -> Any:
    """Displacements of all masses that the reduced coordinates do not follow, shape (nodes, masses), complex.

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
