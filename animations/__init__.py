"""Pictures and films of moving mechanisms, with diagrams of the deflection along the links.

Pictures are rendered off screen by pyvista, which is imported when the first picture is made.
"""

from animations.diagrams import DIAGRAMS, Diagram, diagram_named
from animations.files import RATE, RenderingUnavailable, movie, off_screen, probe, spread, stills
from animations.layout import Scales, View, drawable
from animations.picture import Picture
from animations.style import LOOKS, SHOWN, Style, colour

__all__ = [
    "DIAGRAMS", "LOOKS", "RATE", "SHOWN", "Diagram", "Picture", "RenderingUnavailable", "Scales", "Style", "View",
    "colour", "diagram_named", "drawable", "movie", "off_screen", "probe", "spread", "stills",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
