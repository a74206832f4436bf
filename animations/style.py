"""Style of a picture: the choices of its maker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from animations.paints import colour

LOOKS = ("plain", "solid")
"""Looks of the links: lines, or shaded bodies."""
NARROW = 0.62  # of a picture's width: what its letters go with where it is higher
SHOWN = ("names", "links", "peak", "drives", "paths", "deformed")
"""Parts of a picture that may be shown or left out."""


@dataclass(frozen=True)
class Style:
    """How a picture is made.

    Attributes
    ----------
    title
        Over the picture.
    size
        Width and height in pixels, even, as films need.
    look
        "plain": diagrams across links drawn as lines; "solid": links as shaded bodies, deformed and coloured by the
        field.
    show
        Additions, of `SHOWN`: names of the points, names of the links, the value at the peak of every position,
        arrows of the drives, the paths of the points, the deformed shape over a diagram.
    background
        A colour's name or "#rrggbb"; on a dark one lines are light.
    pace
        How fast it runs beside the machine, in words; `movie` says it.
    scale
        Length that one unit of the field is drawn with [m]; None: the largest ordinate is 17 % of the mechanism's size.
    exaggeration
        Of the deformed shape; None: a round number that makes the largest displacement about a tenth of the mechanism.
    outlines
        Corners of links' bodies in the links' own axes [m], complex, by the links' names.
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

    def __post_init__(self) -> None:
        """Refuse choices that no picture can be made with."""
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
        """Unit of letters, margins and lines [pixels]: the height, or less of a picture that is narrow."""
        return min(float(self.size[1]), NARROW * self.size[0])
