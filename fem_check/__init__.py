"""The deflection of moving mechanisms asked again of scikit-fem, the difference, and meshes for ParaView.

It takes the motion, the masses, the loads and the sections; loads, statics and displacements it finds for itself.
The nonlinear check takes not even the motion.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fem_check.comparison import TOLERANCE, Comparison, Worst, compare
from fem_check.solution import Solution, TieForce, solve
from fem_check.vibration import natural_frequencies
from fem_check.vtu import write_vtu_series

if TYPE_CHECKING:
    from fem_check.nonlinear import (
        DoesNotCloseError,
        ErrorEstimate,
        JointForce,
        NonlinearSolution,
        NotCheckedError,
        estimated_errors,
        nonlinear_equilibrium,
        nonlinear_steady_state,
        nonlinear_transient,
    )

__all__ = [
    "TOLERANCE",
    "Comparison",
    "DoesNotCloseError",
    "ErrorEstimate",
    "JointForce",
    "NonlinearSolution",
    "NotCheckedError",
    "Solution",
    "TieForce",
    "Worst",
    "compare",
    "estimated_errors",
    "natural_frequencies",
    "nonlinear_equilibrium",
    "nonlinear_steady_state",
    "nonlinear_transient",
    "solve",
    "write_vtu_series",
]

_NONLINEAR = (
    "DoesNotCloseError",
    "ErrorEstimate",
    "JointForce",
    "NonlinearSolution",
    "NotCheckedError",
    "estimated_errors",
    "nonlinear_equilibrium",
    "nonlinear_steady_state",
    "nonlinear_transient",
)


def __getattr__(name: str) -> Any:
    """The nonlinear check is imported when it is asked for."""
    if name not in _NONLINEAR:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found = getattr(import_module("fem_check.nonlinear"), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
