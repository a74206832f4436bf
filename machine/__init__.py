"""Formulas for sizing drives and joints and for fatigue life, from the computed motion and forces."""

from machine.ranges import Range

__all__ = ["Range"]


def __dir__() -> list[str]:
    return __all__
