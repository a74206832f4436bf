"""Mechanisms of other programs: read, and written as a scene with its assumptions marked."""

from exchange.drawing import Drawing, ExchangeError, scene_text
from exchange.dxf import DrawnLink, dxf_text
from exchange.reading import FORMATS, read
from exchange.svg import svg_text

__all__ = ["FORMATS", "Drawing", "DrawnLink", "ExchangeError", "dxf_text", "read", "scene_text", "svg_text"]


def __dir__() -> list[str]:
    return __all__
