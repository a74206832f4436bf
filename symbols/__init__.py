"""The symbols of a mechanism as a display list for all renderers: films, paper, report page and editor."""

from symbols.joints import (
    BLOCK,
    BLOCK_CORNERS,
    JOINTS,
    PEDESTAL,
    PIN_RADIUS,
    POINTS,
    dot,
    pin,
    rails,
    support,
    travel,
    weld,
)
from symbols.marks import INK, LEVELS, LINK, NONE, SHADE, SOFT, UNDER, Anchor, Line, Mark, anchor_position, hull
from symbols.mechanism import extent_of, marks_of, plain_marks
from symbols.parts import DRIVE, MASS, ROLLER, arrow, cylinder, mass, spring, torsion_spring, turn_arrow, wheels_of_pair

__all__ = [
    "BLOCK", "BLOCK_CORNERS", "DRIVE", "INK", "JOINTS", "LEVELS", "LINK", "MASS", "NONE", "PEDESTAL", "PIN_RADIUS",
    "POINTS", "ROLLER", "SHADE", "SOFT", "UNDER", "Anchor", "Line", "Mark", "anchor_position", "arrow", "cylinder",
    "dot", "extent_of", "hull", "marks_of", "mass", "pin", "plain_marks", "rails", "spring", "support",
    "torsion_spring", "travel", "turn_arrow", "weld", "wheels_of_pair",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
