"""Style and colours of a picture."""

from collections.abc import Mapping, Sequence

from msgspec import Struct, field

from symbols import Mark

Colour = tuple[float, float, float]  # red, green, blue from 0 to 1

LIGHT = {"ink": "#22262e", "soft": "#4a515c", "fine": "#5d6675", "quiet": "#9aa1ab", "body": "#eceef1",
         "metal": "#b8bec8", "iron": "#959daa", "bent": "#0f6b4f", "accent": "#b3261e", "positive": "#5096d5",
         "negative": "#eb5b2a"}  # fmt: skip
DARK = {"ink": "#e9ebef", "soft": "#bcc3cc", "fine": "#98a1ad", "quiet": "#79828e", "body": "#333a44",
        "metal": "#8b93a0", "iron": "#6b7380", "bent": "#4fd1a1", "accent": "#ff8a80", "positive": "#5aa9ee",
        "negative": "#f27a4d"}  # fmt: skip
# key of the colour in `paints` for each colour name of a mark
SYMBOL_PAINTS = {"load": "accent", "link": "ink", "shade": "quiet", "none": "paper"}
MAX_DARK_LUMINANCE = 0.45  # a background with a smaller luminance is dark


def paints(background: str) -> Mapping[str, Colour]:
    """Return the colours for a background, by name; "paper" is the background itself.

    Parameters
    ----------
    background
        Name of a colour, such as "white", or "#rrggbb".

    Raises
    ------
    ValueError
        The colour is unknown.
    """
    paper = colour(background)
    dark = 0.2126 * paper[0] + 0.7152 * paper[1] + 0.0722 * paper[2] < MAX_DARK_LUMINANCE
    known = {"paper": paper, **{name: colour(value) for name, value in (DARK if dark else LIGHT).items()}}
    return known | {name: known[same] for name, same in SYMBOL_PAINTS.items()}


def colour(name: str) -> Colour:
    """Convert the name of a colour or "#rrggbb" to red, green, blue.

    >>> colour("#ff0000"), colour("white")
    ((1.0, 0.0, 0.0), (1.0, 1.0, 1.0))

    Raises
    ------
    ValueError
        The colour is unknown.
    """
    from PIL import ImageColor

    try:
        red, green, blue = ImageColor.getrgb(name)[:3]
    except ValueError:
        raise ValueError(f'there is no colour "{name}": give a name, such as "white", or "#rrggbb"') from None
    return red / 255, green / 255, blue / 255


LOOKS = ("plain", "solid")
"""Looks of the links: lines or shaded bodies."""
MAX_ASPECT = 0.62  # letters do not grow further with the height if height / width is larger
SHOWN = ("names", "links", "peak", "drives", "paths", "deformed")
"""Optional parts of a picture."""


class Style(Struct, frozen=True):
    """Choices for a picture.

    Attributes
    ----------
    title
        Heading of the picture.
    size
        Width and height in pixels. Both must be even, because films require it.
    look
        "plain" draws links as lines with diagrams across them. "solid" draws links as shaded bodies that are deformed
        and coloured by the field.
    show
        Optional parts from `SHOWN`: names of points, names of links, peak value at each position, arrows of drives,
        paths of points, and the deformed shape in a diagram.
    background
        Name of a colour or "#rrggbb". Lines are light on a dark background.
    pace
        Text that describes the playback speed relative to the machine, set by `movie`.
    scale
        Length of an ordinate per unit of the field [m]. By default, the largest ordinate is 17 % of the size of the
        mechanism.
    exaggeration
        Exaggeration factor of the displacements. By default, it is a round number for which the largest displacement is
        drawn as about a tenth of the size of the mechanism.
    outlines
        Corners of the outlines of links in link axes [m], complex, by link name.
    marks
        Additional symbols, for parts that are not joints, springs, gears, loads or drives.
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
            raise ValueError(f"picture size {self.size[0]} x {self.size[1]}: both must be even and at least 160")
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
        """Reference length for letters, margins and lines [pixels]: height, or `MAX_ASPECT` times width if smaller."""
        return min(float(self.size[1]), MAX_ASPECT * self.size[0])
