"""Strains of beams and openings of compliant joints, their rigidities, and Kelvin-Voigt damping.

Arrays have one row for each strain at each Gauss point, followed by one for each opening of a compliant joint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from elastic.elastodynamics.elastic_structure import ElasticStructure, way_of
from elastic.elastodynamics.samples import along_beams
from elastic.solution import Deflection
from elastic.vibration.beam_matrices import rigidity
from rigid.arrays import Reals
from rigid.plane import dot

RATIO = 0.01  # typical damping ratio of steel links with joints


@dataclass(frozen=True, eq=False)
class Damping:
    """Kelvin-Voigt damping, which adds `beta` [s] times its rate to the force of each strain.

    Attributes
    ----------
    beams
        beta of each beam, shape (beams,).
    joints
        beta of all compliant joints.
    ratio
        Damping ratio at the lowest natural frequency over the cycle, used if beta is nan.
    """

    beams: Reals
    joints: float = math.nan
    ratio: float = RATIO

    def settled(self, lowest: float) -> Damping:
        """Replace nan by the beta that corresponds to the damping ratio at a lowest natural frequency [rad/s]."""
        if not np.isnan(self.beams).any() and not math.isnan(self.joints):
            return self
        own = 2 * self.ratio / lowest
        beams = np.where(np.isnan(self.beams), own, self.beams)
        return replace(self, beams=beams, joints=own if math.isnan(self.joints) else self.joints)

    def per_row(self, structure: ElasticStructure) -> Reals:
        """Return beta of every row, shape (rows,)."""
        own = np.broadcast_to(np.asarray(self.beams, float)[:, None], structure.weights.shape).ravel()
        return np.concatenate((own, own, own, np.full(len(structure.soft), self.joints)))


def strain_rows(structure: ElasticStructure, basis: Reals) -> Reals:
    """Return stretch, curvature, shear and openings per vector of a basis, shape (rows, r) or (positions, rows, r)."""
    fields = structure.fields
    own = (fields["stretch"], fields["curvature"], fields["slope"] - fields["phi"])
    size = len(structure.stiffness)
    rows = np.concatenate([part.reshape(-1, size) for part in own])
    soft = np.eye(size)[size - len(structure.soft) :]
    return np.concatenate((rows, soft)) @ basis


@lru_cache(maxsize=8)
def rigidities(structure: ElasticStructure) -> Reals:
    """Return the rigidity of every row times its weight, shape (rows,); 0 if infinite."""
    parts = []
    for name in ("EA", "EI", "kGA"):
        for weights, section in zip(structure.weights, structure.sections, strict=True):
            values = rigidity(section, name, structure.xi)
            parts.append(np.where(np.isfinite(values), values, 0.0) * weights)
    size = len(structure.stiffness)
    soft = np.diagonal(structure.stiffness)[size - len(structure.soft) :]
    return np.concatenate((*parts, soft))


def given_forces(structure: ElasticStructure, bent: Deflection) -> Reals:
    """Return the forces of the rows in a deflection, plus forces that compensate free strains, (positions, rows)."""
    N, V, M = (along_beams(bent, name, structure.xi) * structure.weights for name in ("N", "V", "M"))
    free = [np.ravel(section.strain)[0] for section in structure.sections]
    stiff = rigidities(structure)[: structure.weights.size].reshape(structure.weights.shape)
    N = N + stiff * np.reshape(free, (-1, 1))
    sheared = np.array([np.isfinite(np.ravel(section.kGA)[0]) for section in structure.sections])
    count = len(N)
    rows = [part.reshape(count, -1) for part in (N, M, -V * sheared.reshape(-1, 1))]
    for freedom in structure.soft:
        force, moment = bent.forces.without_friction(freedom.joint)
        pushed = moment if freedom.kind == "turn" else dot(way_of(freedom, bent.motion), force)
        rows.append(-np.broadcast_to(pushed, count)[:, None])
    return np.concatenate(rows, axis=1)
