"""What a wheel takes from elsewhere when it is built: uPlot's script and style, so that who installs it needs no more.

They come from the package uplot-python, which would bring IPython along. A folder that is installed as it stands
(--editable) has none of it: there the page finds them in that package, which the extra "test" brings.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FILES = ("uPlot.iife.js", "uPlot.min.css")


class ChartLibrary(BuildHookInterface):
    """Puts uPlot's files beside the page's own."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the files to be taken into a wheel."""
        found = find_spec("uplot")
        if version == "editable" or found is None or not found.submodule_search_locations:
            return
        static = Path(found.submodule_search_locations[0]) / "static"
        build_data["force_include"].update({str(static / name): f"kinelast/outputs/page/web/{name}" for name in FILES})
