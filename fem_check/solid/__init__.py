"""Links as plane-stress bodies in scikit-fem, to measure the error of beam theory."""

from fem_check.solid.comparison import SolidComparison, compare_solid

__all__ = [
    "SolidComparison",
    "compare_solid",
]


def __dir__() -> list[str]:
    return __all__
