"""Discretisation error of a solution, by halving elements and steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fem_check.nonlinear.solution import NonlinearSolution

MESH_ORDER = 3


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated relative errors, by field, relative to each field's largest magnitude.

    `mesh`: error of the elements; `step`: of the positions of a cycle, or of the time steps.
    """

    mesh: Mapping[str, float]
    step: Mapping[str, float]


def estimated_errors(
    solve: Callable[[int, int], NonlinearSolution], elements: int, steps: int, step_order: int | None = None
) -> tuple[NonlinearSolution, ErrorEstimate]:
    """Solve with `elements` and `steps`, and estimate errors by Richardson extrapolation.

    The elements are assumed to have order three, their lowest (four except at beam ends).

    Parameters
    ----------
    solve
        Solver with arguments elements and positions or steps, both even. Fewer positions must be every other one.
    step_order
        2 for time steps; None for a cycle, which converges geometrically: doubling the positions squares the error.
    """
    fine, coarse, rough = solve(elements, steps), solve(elements // 2, steps), solve(elements, steps // 2)
    stride = max(1, round((fine.w.shape[1] - 1) / max(rough.w.shape[1] - 1, 1))) if fine.w.size else 1
    mesh, step = {}, {}
    for name in ("u", "w", "phi", "N", "V", "M"):
        best = getattr(fine, name)
        size = np.nanmax(np.abs(best), initial=0.0) or 1.0
        change = np.nanmax(np.abs(best[..., ::2] - getattr(coarse, name)), initial=0.0)
        mesh[name] = float(change / size / (2**MESH_ORDER - 1))
        change = np.nanmax(np.abs(best[:, ::stride] - getattr(rough, name)), initial=0.0)
        step[name] = float((change / size) ** 2 if step_order is None else change / size / (2**step_order - 1))
    return fine, ErrorEstimate(mesh, step)
