"""The vibrating mechanism in its steady state over a cycle, from a linear problem on elements of time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.beams.section import JointCompliance, Section
from elastic.deflection import Deflection, deflection
from elastic.elastodynamics.displacements import carriage, own_basis, unit_displacements
from elastic.elastodynamics.elastic_structure import ElasticStructure, elastic_structure
from elastic.elastodynamics.equations_of_motion import Problem, kinematics, mass_rows, masses, problem
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.time_elements import Grid, propagation
from elastic.elastodynamics.vibration_loads import vibration_loads
from elastic.links.added_loads import AddedLoads
from rigid import Motion

MotionAt = Callable[[Any], Motion]


def mean_modes(structure: ElasticStructure, motion: Motion, count: int) -> tuple[Any, Any]:
    carried = carriage(structure, motion)
    chosen = chosen_points(structure.mechanism)
    basis = own_basis(structure, carried, np.eye(len(structure.stiffness)))
    rows = mass_rows(structure, motion, chosen, unit_displacements(structure, motion, carried, basis, chosen))
    heavy = np.sqrt(masses(structure))[:, None] * rows
    flat = heavy.reshape(-1, heavy.shape[-1])
    mass = (np.conj(flat).T @ flat).real / len(rows)
    scale = 1 / np.sqrt(np.diag(structure.stiffness))
    inverse = np.linalg.inv(np.linalg.cholesky(structure.stiffness * scale[:, None] * scale)) * scale
    values, vectors = np.linalg.eigh(inverse @ mass @ inverse.T)
    values = values[::-1]
    basis = inverse.T @ vectors[:, ::-1][:, :count] / np.sqrt(values[:count])
    return basis, 1 / np.sqrt(values[:count])
