"""Display list of a scene (a mechanism with its motion): the symbols that the report and the pictures show."""

from kinelast.answers.results import Results
from kinelast.figures.cycle import Cycle
from kinelast.scene.parts import symbols_of
from symbols import Mark, extent_of, marks_of


def display_list(cycle: Cycle) -> list[Mark]:
    """Return the symbols of the mechanism and its machine parts, for example the symbols of pins and cams."""
    return marks_of(cycle.motion, symbols_of(cycle.scene))


def extent(results: Results) -> tuple[complex, complex]:
    """Return two opposite corners of a box [m] that contains the mechanism at all positions, as complex numbers."""
    low, high = extent_of(results.motion, results.cycle.once(display_list)) or (0j, 1 + 1j)
    return (low, high) if high != low else (low - 0.5 - 0.5j, low + 0.5 + 0.5j)
