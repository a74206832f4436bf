"""Vibration of a mechanism during a motion that is not periodic."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.discretization import MotionAt, first_grid, vibrating_model
from elastic.elastodynamics.equations_of_motion import Problem
from elastic.elastodynamics.reduced_vibration import static_start
from elastic.elastodynamics.solution import TOLERANCE, Elastodynamic, refined_solution
from elastic.elastodynamics.strains import Damping, rigidities, strain_forces, strain_rows
from elastic.elastodynamics.time_elements import Propagation
from elastic.solution import Deflection, deflection
from rigid import Motion, with_rates
from rigid.arrays import Reals

MAX_REST_RATE = 1e-6  # a drive starts at rest if its initial rate is at most this, relative to its largest rate


def transient(
    motion: Motion,
    motion_at: MotionAt,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
    tolerance: float = TOLERANCE,
    undeformed: bool = False,
    breaks: Reals | None = None,
) -> Elastodynamic:
    """Compute the vibration of the links from the first to the last position of a motion.

    If the drives start at rest, the links start at rest with the static deflection under loads and weight. If the
    drives start with an acceleration, the inertia forces of this acceleration are not part of the static deflection,
    and excite vibration. If the drives are already moving at the start, the links start with the quasi-static
    deflection and its rate.

    Parameters
    ----------
    motion
        Motion of one design at the requested positions, in order of time.
    motion_at, sections, joints, damping, tolerance, breaks
        See `elastodynamic`.
    undeformed
        If True, the links are undeformed at the start and move like rigid links.

    Raises
    ------
    MechanismError
        If there is a singular position, a block leaves its beam, or friction may lock the mechanism.
    ValueError
        If there are several designs, or the times do not increase.
    """
    if not (np.diff(motion.time) > 0).all() or len(motion.time) < 2:
        raise ValueError(f"times of {len(motion.time)} positions: expected at least 2 times in ascending order")
    start, duration = float(motion.time[0]), float(np.ptp(motion.time))
    model = vibrating_model(motion_at, start, duration, sections, joints or {}, damping)
    grid = first_grid(model, start, duration, breaks)
    at_start = motion_at(np.array([start]))
    begin = _undeformed if undeformed else _quasi_static
    if not undeformed and _begins_at_rest(at_start, motion):
        begin = partial(_at_rest, static=deflection(with_rates(at_start, 0.0), sections, joints))
    return refined_solution(model, motion, grid, tolerance, begin)


def _begins_at_rest(start: Motion, motion: Motion) -> bool:
    """Return whether all drives start at rest (except for round-off)."""
    greatest = np.abs(motion.drive_rate).max(axis=-1, initial=0.0)
    return bool((np.abs(start.drive_rate).max(axis=-1, initial=0.0) <= MAX_REST_RATE * greatest).all())


def _undeformed(_: Propagation, found: Problem, __: Deflection) -> Reals:
    return np.zeros(2 * found.equations.load.shape[-1])


def _quasi_static(_: Propagation, posed: Problem, bent: Deflection) -> Reals:
    """Return the amplitudes of the quasi-static deflection at the start, followed by their rates, shape (2 r,)."""
    grid, structure = posed.terms.grid, posed.terms.kinematics.structure
    forces = strain_forces(structure, bent)
    rate = grid.with_start(grid.rates(forces)[0])[0]
    return np.concatenate([_amplitudes(posed, part) for part in (forces[0], rate)])


def _at_rest(_: Propagation, posed: Problem, __: Deflection, static: Deflection) -> Reals:
    """Return the amplitudes of the static deflection at the start, followed by zero rates, shape (2 r,).

    The static deflection includes the effect of geometric stiffness.
    """
    strains = _strains_at_start(posed)
    load = strains.T @ strain_forces(posed.terms.kinematics.structure, static)[0]
    found = static_start(posed, np.broadcast_to(load, posed.equations.load.shape))
    return np.concatenate([found, np.zeros_like(found)])


def _amplitudes(posed: Problem, forces: Reals) -> Reals:
    """Return the amplitudes at the start that are the best fit to the strains due to given forces, shape (r,)."""
    strains = _strains_at_start(posed)
    stiffness: Any = (strains.T * rigidities(posed.terms.kinematics.structure)) @ strains
    return np.linalg.solve(stiffness, strains.T @ forces)


def _strains_at_start(posed: Problem) -> Reals:
    structure, basis = posed.terms.kinematics.structure, posed.terms.kinematics.basis
    return strain_rows(structure, basis[0] if basis.ndim == 3 else basis)
