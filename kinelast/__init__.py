"""Deflection of the links of moving planar mechanisms: scene files in, reports out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    "read_scene",
    "read_structure",
    "scene_from_dict",
    "scene_from_text",
    "scene_motion",
    "scene_motion_at",
    "scene_times",
    "shipped_scenes",
    "shipped_structures",
    "structure_from_text",
]


def __getattr__(name: str) -> Any:
    """Import the exports when they are asked for: the command's help needs none of them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("kinelast.scene.reading"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
