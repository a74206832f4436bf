"""Sizing of machine parts from the computed motion and forces: array formulas for drives, joints and fatigue life."""

from machine.ranges import Range

__all__ = ["Range"]


def __dir__() -> list[str]:
    return __all__
