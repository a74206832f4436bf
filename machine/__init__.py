"""Sizing of a machine's parts from its motion and its forces: drives, joints and life, as formulas on arrays."""

from machine.ranges import Range

__all__ = ["Range"]


def __dir__() -> list[str]:
    return __all__
