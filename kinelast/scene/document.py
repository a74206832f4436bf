"""From a scene file, a text or tables to a `Scene`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from kinelast.scene.build import built
from kinelast.scene.data import Scene
from kinelast.scene.motion import require_determined
from kinelast.scene.parsing import parse_scene
from kinelast.scene.text import decoded, file_bytes, of_file, scene_name, toml_tables


def read_scene(path: str | Path) -> Scene:
    """The scene in a TOML file.

    Raises
    ------
    SceneError
        The file cannot be read or holds a mistake.
    """
    return scene_from_bytes(file_bytes(Path(path)), path)


def scene_from_bytes(content: bytes, path: str | Path) -> Scene:
    """The scene in the bytes of a TOML file; raises as `read_scene`."""
    return scene_from_text(decoded(content, str(path)), scene_name(Path(path)), str(path))


def scene_from_text(text: str, name: str = "scene", path: str = "") -> Scene:
    """The scene in a TOML text; `path` stands for the file in messages.

    Raises
    ------
    SceneError
        The text holds a mistake.
    """
    return replace(scene_from_dict(toml_tables(text, path), name, path), text=text)


def scene_from_dict(raw: Mapping[str, Any], name: str = "scene", path: str = "") -> Scene:
    """The scene in the tables of a TOML file; `path` stands for the file in messages.

    Raises
    ------
    SceneError
        A table or a key is wrong.
    """
    with of_file(path):
        scene = built(parse_scene(raw), name, path)
        require_determined(scene)
        return scene
