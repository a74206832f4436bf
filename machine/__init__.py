"""Sizing of a machine's parts from its motion and its forces: drives, joints and life, as formulas on arrays."""

__all__: list[str] = []


def __dir__() -> list[str]:
    return __all__
