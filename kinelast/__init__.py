"""Deflection of the links of moving planar mechanisms: scene files in, reports out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinelast.notebook.frames import to_pandas, to_xarray
    from kinelast.notebook.inline import film, picture, report
    from kinelast.notebook.named import deflection, load, motion
    from kinelast.scene.reading import (
        Run,
        Scene,
        SceneError,
        StructureScene,
        read_scene,
        read_structure,
        scene_from_dict,
        scene_from_text,
        scene_motion,
        scene_motion_at,
        scene_times,
        shipped_scenes,
        shipped_structures,
        structure_from_text,
    )

__all__ = [
    "Run",
    "Scene",
    "SceneError",
    "StructureScene",
    "deflection",
    "film",
    "load",
    "motion",
    "picture",
    "read_scene",
    "read_structure",
    "report",
    "scene_from_dict",
    "scene_from_text",
    "scene_motion",
    "scene_motion_at",
    "scene_times",
    "shipped_scenes",
    "shipped_structures",
    "structure_from_text",
    "to_pandas",
    "to_xarray",
]

_NOTEBOOK = {
    "deflection": "named",
    "film": "inline",
    "load": "named",
    "motion": "named",
    "picture": "inline",
    "report": "inline",
    "to_pandas": "frames",
    "to_xarray": "frames",
}


def __getattr__(name: str) -> Any:
    """Import the exports when they are asked for: the command's help needs none of them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    place = f"kinelast.notebook.{_NOTEBOOK[name]}" if name in _NOTEBOOK else "kinelast.scene.reading"
    return getattr(import_module(place), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
