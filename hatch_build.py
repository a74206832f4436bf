"""What a wheel takes from elsewhere when it is built: uPlot's script and style, so that who installs it needs no more.

They come from the package uplot-python, which would bring IPython along. Of a folder that is installed as it stands
(--editable) they are copied beside the page's own files, where git ignores them.
"""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FILES = ("uPlot.iife.js", "uPlot.min.css")


class ChartLibrary(BuildHookInterface):
    """Puts uPlot's files beside the page's own."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the files to be taken into a wheel, or copy them into the folder."""
        found = find_spec("uplot")
        if found is None or not found.submodule_search_locations:
            return
        static, page = Path(found.submodule_search_locations[0]) / "static", "kinelast/outputs/page/web"
        if version == "editable":
            for name in FILES:
                shutil.copyfile(static / name, Path(self.root) / page / name)
            return
        build_data["force_include"].update({str(static / name): f"{page}/{name}" for name in FILES})
