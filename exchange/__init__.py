"""Import and export of mechanisms as files of other programs or DXF drawings, SVG output, and import of CSV files."""

from exchange.columns import Columns, columns_of
from exchange.dxf import DrawnLink, dxf_text, section_of_dxf
from exchange.foreign_mechanism import (
    Drive,
    ExchangeError,
    ForeignGear,
    ForeignLink,
    ForeignLoad,
    ForeignMechanism,
    ForeignSlider,
    Slot,
    to_and_fro,
)
from exchange.reading import FORMATS, of_text, read, written
from exchange.scene import elastic, scene_text
from exchange.svg import svg_text

__all__ = [
    "FORMATS", "Columns", "DrawnLink", "Drive", "ExchangeError", "ForeignGear", "ForeignLink", "ForeignLoad",
    "ForeignMechanism", "ForeignSlider", "Slot", "columns_of", "dxf_text", "elastic", "of_text", "read", "scene_text",
    "section_of_dxf", "svg_text", "to_and_fro", "written",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
