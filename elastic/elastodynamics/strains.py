"""Strains of beams and openings of compliant joints, with rigidities and Kelvin-Voigt damping.

The rows of arrays are the stretches at all Gauss points, then the curvatures, then the shears, and then the openings of
compliant joints.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.elastodynamics.elastic_structure import ElasticStructure, opening_direction
from elastic.sampling import along_beams
from elastic.solution import Deflection
from elastic.vibration.beam_matrices import rigidity
from rigid.arrays import Reals
from rigid.plane import dot

DEFAULT_DAMPING_RATIO = 0.01  # typical damping ratio of steel links with joints


class Damping(Struct, frozen=True, eq=False):
    """Kelvin-Voigt damping: each elastic force F becomes F + beta dF/dt.

    Attributes
    ----------
    beams
        beta of each beam [s], shape (beams,). nan means the default value, see `with_default_beta`.
    joints
        beta of all compliant joints [s]; nan means the default value.
    ratio
        Damping ratio at the lowest natural frequency over the cycle, from which the default value of beta is computed.
    """

    beams: Reals
    joints: float = math.nan
    ratio: float = DEFAULT_DAMPING_RATIO

    def with_default_beta(self, lowest: float) -> Damping:
        """Replace each nan by the beta with which the damping ratio at the frequency `lowest` [rad/s] is `ratio`."""
        if not np.isnan(self.beams).any() and not math.isnan(self.joints):
            return self
        default = 2 * self.ratio / lowest
        beams = np.where(np.isnan(self.beams), default, self.beams)
        return replace(self, beams=beams, joints=default if math.isnan(self.joints) else self.joints)

    def per_row(self, structure: ElasticStructure) -> Reals:
        """Return beta of every row, shape (rows,)."""
        beams = np.broadcast_to(np.asarray(self.beams, float)[:, None], structure.weights.shape).ravel()
        return np.concatenate((beams, beams, beams, np.full(len(structure.joint_openings), self.joints)))


def strain_rows(structure: ElasticStructure, basis: Reals) -> Reals:
    """Return all rows (stretches, curvatures, shears and openings) for each vector of a basis.

    The shape is (rows, r), or (positions, rows, r) if the basis depends on the position.
    """
    fields = structure.fields
    strains = (fields["stretch"], fields["curvature"], fields["slope"] - fields["phi"])
    size = len(structure.stiffness)
    per_coordinate = np.concatenate([part.reshape(-1, size) for part in strains])
    openings = np.eye(size)[size - len(structure.joint_openings) :]
    return np.concatenate((per_coordinate, openings)) @ basis


@lru_cache(maxsize=8)
def rigidities(structure: ElasticStructure) -> Reals:
    """Return the rigidity EA, EI or kGA of each row, multiplied by the integration weight, shape (rows,).

    An infinite rigidity is replaced by 0. The row of an opening contains the stiffness of the compliant joint.
    """
    parts = []
    for name in ("EA", "EI", "kGA"):
        for weights, section in zip(structure.weights, structure.sections, strict=True):
            values = rigidity(section, name, structure.xi)
            parts.append(np.where(np.isfinite(values), values, 0.0) * weights)
    size = len(structure.stiffness)
    joints = np.diagonal(structure.stiffness)[size - len(structure.joint_openings) :]
    return np.concatenate((*parts, joints))


def strain_forces(structure: ElasticStructure, bent: Deflection) -> Reals:
    """Return the forces of a deflection that are conjugate to the strains, shape (positions, rows).

    Forces of beams are multiplied by the integration weights. EA times the free strain is added to the axial force, so
    that (force / EA) is the total strain.
    """
    N, V, M = (along_beams(bent, name, structure.xi) * structure.weights for name in ("N", "V", "M"))
    free = [np.ravel(section.strain)[0] for section in structure.sections]
    stiff = rigidities(structure)[: structure.weights.size].reshape(structure.weights.shape)
    N = N + stiff * np.reshape(free, (-1, 1))
    sheared = np.array([np.isfinite(np.ravel(section.kGA)[0]) for section in structure.sections])
    count = len(N)
    rows = [part.reshape(count, -1) for part in (N, M, -V * sheared.reshape(-1, 1))]
    for opening in structure.joint_openings:
        force, moment = bent.forces.without_friction(opening.joint)
        conjugate = moment if opening.kind == "turn" else dot(opening_direction(opening, bent.motion), force)
        rows.append(-np.broadcast_to(conjugate, count)[:, None])
    return np.concatenate(rows, axis=1)
