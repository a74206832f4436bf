"""Natural frequencies of the mechanism as a structure."""

from elastic.vibration.frequencies import Frequencies, natural_frequencies

__all__ = [
    "Frequencies",
    "natural_frequencies",
]


def __dir__() -> list[str]:
    return __all__
