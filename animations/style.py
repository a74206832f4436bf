"""Style of a picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from animations.paints import colour
from symbols import Mark

LOOKS = ("plain", "solid")
"""Looks of the links: lines, or shaded bodies."""
MAX_ASPECT = 0.62  # largest ratio of height to width used for the size of letters
SHOWN = ("names", "links", "peak", "drives", "paths", "deformed")
"""Optional parts of a picture."""


@dataclass(frozen=True)
class Style:
    """Choices for a picture.

    Attributes
    ----------
    title
        Heading of the picture.
    size
        Width and height in pixels; both even, as films require.
    look
        "plain": diagrams across links drawn as lines; "solid": links as shaded bodies, deformed and coloured by the
        field.
    show
        Additions from `SHOWN`: point names, link names, the peak value at each position, drive arrows, point paths,
        the deformed shape over a diagram.
    background
        A colour name or "#rrggbb"; lines are light on a dark background.
    pace
        Speed relative to the machine, in words; set by `movie`.
    scale
        Drawn length of one unit of the field [m]; None: the largest ordinate is 17 % of the mechanism's size.
    exaggeration
        Scale factor of displacements; None: a round number, so that the largest is about a tenth of the mechanism.
    outlines
        Corners of the links' bodies in the links' axes [m], complex, by link name.
    marks
        Symbols of further parts, in addition to joints, springs, gears, loads and drives.
    """

    title: str = ""
    pace: str = ""
    size: tuple[int, int] = (1280, 720)
    look: str = "plain"
    show: tuple[str, ...] = ("names", "peak", "drives")
    background: str = "white"
    scale: float | None = None
    exaggeration: float | None = None
    outlines: Mapping[str, Sequence[complex]] = field(default_factory=dict)
    marks: Sequence[Mark] = ()

    def __post_init__(self) -> None:
        """Raise ValueError for an invalid choice."""
        if min(self.size) < 160 or self.size[0] % 2 or self.size[1] % 2:
            raise ValueError(f"picture size {self.size[0]} x {self.size[1]}: both must be even, 160 at least")
        if self.exaggeration is not None and not self.exaggeration > 0:
            raise ValueError(f"exaggeration {self.exaggeration:g}: it must be positive")
        if self.scale is not None and not self.scale > 0:
            raise ValueError(f"scale {self.scale:g}: it must be positive")
        if self.look not in LOOKS:
            raise ValueError(f'there is no look "{self.look}": choose from {", ".join(LOOKS)}')
        for word in self.show:
            if word not in SHOWN:
                raise ValueError(f'"{word}" cannot be shown: choose from {", ".join(SHOWN)}')
        colour(self.background)

    @property
    def unit(self) -> float:
        """Unit of letters, margins and lines [pixels]: the height, limited for tall pictures."""
        return min(float(self.size[1]), MAX_ASPECT * self.size[0])
