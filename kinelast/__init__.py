"""Deflection of the links of moving planar mechanisms."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinelast.notebook import deflection, load, motion, with_loads
    from kinelast.notebook.inline import answer, live, report
    from kinelast.notebook.modes import natural_frequencies
    from kinelast.notebook.pictures import film, picture
    from kinelast.notebook.tables import to_pandas, to_xarray
    from kinelast.scene.course import Run
    from kinelast.scene.data import Scene, scene_motion
    from kinelast.scene.document import Document, read_document, read_scene, scene_from_dict, scene_from_text
    from kinelast.structure.output import StructureScene, read_structure, structure_from_text
    from kinelast.tasks.task import shipped_scenes, shipped_structures
    from kinelast.values.error import SceneError

__all__ = [
    "Document", "Run", "Scene", "SceneError", "StructureScene", "__version__", "answer", "deflection", "film", "live",
    "load", "motion", "natural_frequencies", "picture", "read_document", "read_scene", "read_structure", "report",
    "scene_from_dict", "scene_from_text", "scene_motion", "shipped_scenes", "shipped_structures", "structure_from_text",
    "to_pandas", "to_xarray", "with_loads",
]  # fmt: skip

__version__ = "0.1.0"
"""Version of the package."""

_HOME = {
    "notebook.inline": ("answer", "live", "report"),
    "notebook.modes": ("natural_frequencies",),
    "notebook.pictures": ("film", "picture"),
    "notebook.tables": ("to_pandas", "to_xarray"),
    "notebook": ("deflection", "load", "motion", "with_loads"),
    "scene.course": ("Run",),
    "scene.data": ("Scene", "scene_motion"),
    "scene.document": ("Document", "read_document", "read_scene", "scene_from_dict", "scene_from_text"),
    "values.error": ("SceneError",),
    "tasks.task": ("shipped_scenes", "shipped_structures"),
    "structure.output": ("StructureScene", "read_structure", "structure_from_text"),
}


def __getattr__(name: str) -> Any:
    """Import a public name on first access, so that the help of the command is fast."""
    from importlib import import_module

    for place, names in _HOME.items():
        if name in names:
            return getattr(import_module(f"kinelast.{place}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
