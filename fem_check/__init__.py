"""The deflection of moving mechanisms asked again of scikit-fem, the difference, and meshes for ParaView.

It takes the motion, the masses, the loads and the sections; loads, statics and displacements it finds for itself.
"""

from fem_check.linear.comparison import TOLERANCE, Comparison, Worst, compare
from fem_check.linear.solution import Solution, TieForce, solve
from fem_check.vibration.frequencies import natural_frequencies
from fem_check.vtu import write_vtu_series

__all__ = [
    "TOLERANCE",
    "Comparison",
    "Solution",
    "TieForce",
    "Worst",
    "compare",
    "natural_frequencies",
    "solve",
    "write_vtu_series",
]
