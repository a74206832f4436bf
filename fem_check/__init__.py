"""Independent check of the deflection of a mechanism by finite elements, and meshes for ParaView.

`solve` uses scikit-fem. It takes the motion, masses, loads and sections of a mechanism from `rigid` and `elastic`, but
computes inertia loads, joint forces and displacements independently. `fem_check.nonlinear` also computes the motion
independently, with its own elements.
"""

from fem_check.balance import MomentumBalance, balance
from fem_check.linear.comparison import TOLERANCE, Comparison, Worst, compare
from fem_check.linear.solution import Solution, TieForce, solve
from fem_check.solid.comparison import SolidComparison, compare_solid
from fem_check.solid.solution import SolidSolution, solve_solid
from fem_check.vtu import write_vtu_series

__all__ = [
    "TOLERANCE", "Comparison", "MomentumBalance", "SolidComparison", "SolidSolution", "Solution", "TieForce", "Worst",
    "balance", "compare", "compare_solid", "solve", "solve_solid", "write_vtu_series",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
