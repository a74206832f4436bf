"""How far a solution is from that of infinitely many elements and positions, by halving both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fem_check.nonlinear.solution import NonlinearSolution

ORDER = 3


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated errors as shares of each field's greatest magnitude, by the field's name.

    `mesh`: of the elements; `step`: of the positions of a cycle, or of the steps in time.
    """

    mesh: Mapping[str, float]
    step: Mapping[str, float]


def estimated_errors(
    solve: Callable[[int, int], NonlinearSolution], elements: int, steps: int, step_order: int | None = None
) -> tuple[NonlinearSolution, ErrorEstimate]:
    """The solution of `elements` and `steps`, and how far it is off by Richardson's extrapolation.

    The elements are taken to be of the third order, their lowest (they are of the fourth but for the ends of beams).

    Parameters
    ----------
    solve
        From elements and positions, or steps, to the solution; both even. Fewer positions are every other one.
    step_order
        2 for steps in time; None for a cycle, which converges geometrically: twice the positions square the error.
    """
    fine, coarse, rough = solve(elements, steps), solve(elements // 2, steps), solve(elements, steps // 2)
    stride = max(1, round((fine.w.shape[1] - 1) / max(rough.w.shape[1] - 1, 1))) if fine.w.size else 1
    mesh, step = {}, {}
    for name in ("u", "w", "phi", "N", "V", "M"):
        best = getattr(fine, name)
        size = np.nanmax(np.abs(best), initial=0.0) or 1.0
        change = np.nanmax(np.abs(best[..., ::2] - getattr(coarse, name)), initial=0.0)
        mesh[name] = float(change / size / (2**ORDER - 1))
        change = np.nanmax(np.abs(best[:, ::stride] - getattr(rough, name)), initial=0.0)
        step[name] = float((change / size) ** 2 if step_order is None else change / size / (2**step_order - 1))
    return fine, ErrorEstimate(mesh, step)
