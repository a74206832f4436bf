"""Errors of a vibration due to the finite length of the time elements."""

from __future__ import annotations

import math

import numpy as np

from elastic.elastodynamics.exact_residual import deflection_state
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_settings import VIBRATION
from rigid.arrays import Complexes, Flags, Integers, Reals


def time_error(solved: Vibration, tolerance: float, inertia_load: Reals | None = None) -> tuple[float, Grid | None]:
    """Return the error due to time elements, relative to the largest displacement, and a finer grid.

    The finer grid is None if the error meets the tolerance, or if there are already more than `VIBRATION.max_elements`
    elements. Errors in very short elements are ignored. They come from a jump in the loads within the element, and
    dividing the element further would not reduce them.

    Parameters
    ----------
    inertia_load
        Inertia forces on the coordinates due to all accelerations, shape (points, r). By default, only the
        accelerations of the coordinates are considered.
    """
    grid = solved.problem.terms.grid
    unresolved = solved.unresolved(solved.inertia_load if inertia_load is None else inertia_load)
    error = np.where(_divisible(grid), VIBRATION.time_error_ratio * unresolved, 0.0)
    if error.max() <= tolerance or len(error) > VIBRATION.max_elements:
        return float(error.max()), None
    aim = VIBRATION.refined_error * tolerance
    parts = np.clip(np.ceil((error / aim) ** (1 / VIBRATION.order)), 1, VIBRATION.max_parts).astype(int)
    return float(error.max()), grid.divided(_graded(grid.steps, parts))


def force_error(vibration: Vibration, forces: tuple[Complexes, Complexes] | None = None) -> float:
    """Return the error in section and joint forces due to time elements, relative to the largest of the same kind.

    `forces` contains the section forces and the joint forces at the nodes, each of shape (nodes, ...). By default, the
    forces of the vibration are used.
    """
    grid = vibration.problem.terms.grid
    if forces is None:
        known = deflection_state(vibration, vibration.deflection)
        forces = known.force, known.joints
    flattened = [values[1:].reshape(len(values) - 1, -1) for values in forces]
    tails = [grid.tail(each, np.abs(each).max(initial=0.0)) for each in flattened if each.size]
    largest = [float(tail[_divisible(grid)].max(initial=0.0)) for tail in tails]
    return VIBRATION.time_error_ratio * max(largest, default=0.0)


def _divisible(grid: Grid) -> Flags:
    """Return for each element whether it is long enough to be divided."""
    return grid.steps > VIBRATION.min_step * np.ptp(grid.edges)


def _graded(steps: Reals, parts: Integers) -> Integers:
    """Divide long elements into more parts if they follow a short element that is divided.

    Otherwise, a long element would numerically damp vibration that is excited in the short element before it.
    """
    graded, longest = parts.copy(), math.inf
    for number, step in enumerate(steps):
        graded[number] = max(parts[number], min(math.ceil(step / longest), VIBRATION.max_parts**2))
        longest = VIBRATION.max_step_ratio * (step / graded[number] if parts[number] > 1 else longest)
    return graded
