"""The symbols of a mechanism as a display list for all renderers: films, paper, report page and editor."""

from symbols.hulls import hull
from symbols.joints import (
    BLOCK,
    BLOCK_CORNERS,
    JOINTS,
    PEDESTAL,
    PIN_RADIUS,
    POINTS,
    pin,
    rails,
    spot,
    support,
    travel,
    weld,
)
from symbols.marks import INK, LEVELS, LINK, NONE, SHADE, SOFT, UNDER, Line, Mark, Spot, anchor
from symbols.mechanism import extent_of, marks_of, plain_marks
from symbols.parts import DRIVE, MASS, arrow, cylinder, mass, spring, torsion_spring, turn_arrow, wheels_of_pair

__all__ = [
    "BLOCK", "BLOCK_CORNERS", "DRIVE", "INK", "JOINTS", "LEVELS", "LINK", "MASS", "NONE", "PEDESTAL", "PIN_RADIUS",
    "POINTS", "SHADE", "SOFT", "UNDER", "Line", "Mark", "Spot", "anchor", "arrow", "cylinder", "extent_of", "hull",
    "marks_of", "mass", "pin", "plain_marks", "rails", "spot", "spring", "support", "torsion_spring", "travel",
    "turn_arrow", "weld", "wheels_of_pair",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
