"""Sizing of a machine's parts from its motion and its forces: array formulas for drives, joints and fatigue life."""

from machine.ranges import Range

__all__ = ["Range"]


def __dir__() -> list[str]:
    return __all__
