"""Vibration of a mechanism during a motion that is not periodic."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.discretization import MotionAt, first_grid, vibrating_model
from elastic.elastodynamics.equations_of_motion import Problem
from elastic.elastodynamics.reduced_vibration import static_start
from elastic.elastodynamics.solution import TOLERANCE, Elastodynamic, settled
from elastic.elastodynamics.strains import Damping, given_forces, rigidities, strain_rows
from elastic.elastodynamics.time_elements import Propagation
from elastic.solution import Deflection, deflection
from rigid import Motion, with_rates
from rigid.arrays import Reals

REST = 1e-6  # drive rates smaller than this are round-off of a law that starts at rest; relative to the largest


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

    If the drives start at rest, the links start at rest with the static deflection under loads and weight. An initial
    acceleration thus acts on links that it has not yet deflected. If the drives are already moving, the links start
    with the deflection of the quasi-static solution and its rate.

    Parameters
    ----------
    motion
        Motion of one design at the requested positions, in order of time.
    motion_at, sections, joints, damping, tolerance, breaks
        See `elastodynamic`.
    undeformed
        True to start with undeformed links that move like rigid links.

    Raises
    ------
    MechanismError
        If there is a singular position, or a block leaves its beam.
    ValueError
        If there are several designs, or times that do not increase.
    """
    if not (np.diff(motion.time) > 0).all() or len(motion.time) < 2:
        raise ValueError(f"{len(motion.time)} instants that do not all grow, expected at least 2 that do")
    start, duration = float(motion.time[0]), float(np.ptp(motion.time))
    model = vibrating_model(motion_at, start, duration, sections, joints or {}, damping)
    grid = first_grid(model, start, duration, breaks)
    at_start = motion_at(np.array([start]))
    begin = _undeformed if undeformed else _quasi_static
    if not undeformed and _begins_at_rest(at_start, motion):
        begin = partial(_at_rest, static=deflection(with_rates(at_start, 0.0), sections, joints))
    return settled(model, motion, grid, tolerance, begin)


def _begins_at_rest(start: Motion, motion: Motion) -> bool:
    """Return whether all drives start at rest, up to round-off."""
    greatest = np.abs(motion.drive_rate).max(axis=-1, initial=0.0)
    return bool((np.abs(start.drive_rate).max(axis=-1, initial=0.0) <= REST * greatest).all())


def _undeformed(_: Propagation, found: Problem, __: Deflection) -> Reals:
    return np.zeros(2 * found.equations.load.shape[-1])


def _quasi_static(_: Propagation, posed: Problem, bent: Deflection) -> Reals:
    """Return the amplitudes of the quasi-static solution at the start, and their rates."""
    grid, structure = posed.terms.grid, posed.terms.kinematics.structure
    forces = given_forces(structure, bent)
    rate = grid.at_nodes(grid.rates(forces)[0])[0]
    return np.concatenate([_amplitudes(posed, part) for part in (forces[0], rate)])


def _at_rest(_: Propagation, posed: Problem, __: Deflection, static: Deflection) -> Reals:
    """Return the amplitudes of the static deflection at the start with the geometric stiffness, and zero rates."""
    strains = _strains_at_start(posed)
    load = strains.T @ given_forces(posed.terms.kinematics.structure, static)[0]
    found = static_start(posed, np.broadcast_to(load, posed.equations.load.shape))
    return np.concatenate([found, np.zeros_like(found)])


def _amplitudes(posed: Problem, forces: Reals) -> Reals:
    """Return the initial amplitudes for the strains due to given forces, shape (r,)."""
    strains = _strains_at_start(posed)
    stiffness: Any = (strains.T * rigidities(posed.terms.kinematics.structure)) @ strains
    return np.linalg.solve(stiffness, strains.T @ forces)


def _strains_at_start(posed: Problem) -> Reals:
    structure, basis = posed.terms.kinematics.structure, posed.terms.kinematics.basis
    return strain_rows(structure, basis[0] if basis.ndim == 3 else basis)
