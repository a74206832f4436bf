"""Natural frequencies of a mechanism with held drives."""

from elastic.vibration.frequencies import Frequencies, natural_frequencies
from elastic.vibration.link_matrices import elastic_coordinates

__all__ = [
    "Frequencies",
    "elastic_coordinates",
    "natural_frequencies",
]


def __dir__() -> list[str]:
    return __all__
