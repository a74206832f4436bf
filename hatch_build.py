"""Generate the files of an installation that are not in git: uPlot, JSON Schemas, a stub of `kinelast.build`.

uPlot's script and style come from the package uplot-python; depending on that package would install IPython too. For an
editable installation the files go into the repository, and git ignores them. There is no stub then: mypy checks the
module itself.
"""

import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

CHARTS = ("uPlot.iife.js", "uPlot.min.css")
PAGE = "kinelast/outputs/page/web"


class GeneratedFiles(BuildHookInterface):
    """Build hook that adds uPlot, the schemas and the stub to a wheel or an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Write the files to a temporary folder for a wheel, or into the repository."""
        self.temporary = Path(mkdtemp())
        editable = version == "editable"
        for name, text in self.texts(stub=not editable).items():
            target = (Path(self.root) if editable else self.temporary) / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
            if not editable:
                build_data["force_include"][str(target)] = name
        found = find_spec("uplot")
        if found is None or not found.submodule_search_locations:
            return
        static = Path(found.submodule_search_locations[0]) / "static"
        for name in CHARTS:
            if editable:
                shutil.copyfile(static / name, Path(self.root) / PAGE / name)
            else:
                build_data["force_include"][str(static / name)] = f"{PAGE}/{name}"

    def texts(self, stub: bool) -> dict[str, str]:
        """Return the generated texts by file path."""
        sys.path.insert(0, self.root)
        from kinelast.build import stub_text
        from kinelast.scene.schema import SCHEMAS, schema_text

        texts = {f"kinelast/{name}": schema_text(name) for name in SCHEMAS}
        return {**texts, **({"kinelast/build.pyi": stub_text()} if stub else {})}

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary folder."""
        shutil.rmtree(self.temporary)
