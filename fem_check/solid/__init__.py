"""Links modelled as plane-stress bodies in scikit-fem, to measure the error of beam theory."""

from fem_check.solid.comparison import SolidComparison, compare_solid
