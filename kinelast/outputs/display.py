"""Display list of a scene, used by the page and the printed drawings."""

from kinelast.figures.cycle import Cycle
from kinelast.figures.results import Results
from kinelast.scene.parts import symbols_of
from symbols import Mark, extent_of, marks_of


def display_list(cycle: Cycle) -> list[Mark]:
    """Return the marks that represent the mechanism and its parts."""
    return marks_of(cycle.motion, symbols_of(cycle.scene))


def extent(results: Results) -> tuple[complex, complex]:
    """Return the corners of the bounding box of the moving mechanism [m]."""
    low, high = extent_of(results.motion, results.cycle.once(display_list)) or (0j, 1 + 1j)
    return (low, high) if high != low else (low - 0.5 - 0.5j, low + 0.5 + 0.5j)
