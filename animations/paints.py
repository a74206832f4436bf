"""Named colours for light and dark backgrounds."""

from collections.abc import Mapping

Colour = tuple[float, float, float]  # red, green, blue from 0 to 1

LIGHT = {"ink": "#22262e", "soft": "#4a515c", "fine": "#5d6675", "quiet": "#9aa1ab", "body": "#eceef1",
         "metal": "#b8bec8", "iron": "#959daa", "bent": "#0f6b4f", "accent": "#b3261e", "positive": "#5096d5",
         "negative": "#eb5b2a"}  # fmt: skip
DARK = {"ink": "#e9ebef", "soft": "#bcc3cc", "fine": "#98a1ad", "quiet": "#79828e", "body": "#333a44",
        "metal": "#8b93a0", "iron": "#6b7380", "bent": "#4fd1a1", "accent": "#ff8a80", "positive": "#5aa9ee",
        "negative": "#f27a4d"}  # fmt: skip
SYMBOL_PAINTS = {"load": "accent", "link": "ink", "shade": "quiet", "none": "paper"}  # colours of marks
MAX_DARK_LUMINANCE = 0.45  # largest luminance of a dark background


def paints(background: str) -> Mapping[str, Colour]:
    """Colours for a background; "paper" is the background itself.

    Parameters
    ----------
    background
        A colour name, such as "white", or "#rrggbb".

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
    """Convert a colour name or "#rrggbb" to red, green, blue.

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
        raise ValueError(f'there is no colour "{name}": give a name, as "white", or "#rrggbb"') from None
    return red / 255, green / 255, blue / 255
