"""The structure of a scene: text for the terminal, and a folder with the same text and the skeleton diagram."""

from __future__ import annotations

import traceback
from dataclasses import replace
from importlib import metadata

from kinelast.outcome import BAD_INPUT, BUG, DONE, FINE, MESSAGE, Outcome, Task
from kinelast.outputs.outbox import add_to
from kinelast.request import RequestError
from kinelast.scene.error import SceneError, plain
from kinelast.scene.structure_scene import StructureScene, read_structure
from rigid import MechanismError


def structure_outcome(task: Task) -> tuple[Outcome, str]:
    """How a scene's structure went, and its text; the files are put into the scene's folder."""
    name = task.name
    try:
        scene = read_structure(task.path)
        text = scene_text(scene)
        files, drawn = _files(scene, text)
        add_to(task.folder, files, {"kinelast": metadata.version("kinelast")})
    except (SceneError, MechanismError, RequestError) as error:
        return Outcome(BAD_INPUT, f"{name}: {plain(str(error), MESSAGE)}"), ""
    except OSError as error:
        return Outcome(BAD_INPUT, f"{name}: not written: {plain((error.strerror or str(error)).lower(), MESSAGE)}"), ""
    except Exception:  # one scene that the program fails on must not take the others with it
        return Outcome(BUG, f"{name}: the program failed, please report this:\n{traceback.format_exc()}"), ""
    return Outcome(FINE, f"{name}: structure{drawn} -> {task.folder}", DONE), text


def _files(scene: StructureScene, text: str) -> tuple[dict[str, str], str]:
    """The files of a structure, and what to say of its diagram."""
    files = {"structure.txt": text}
    if scene.mechanism is None:
        return files, ""
    from kinelast.structure.skeleton import skeleton_svg

    try:
        files["skeleton.svg"] = skeleton_svg(scene.mechanism)
    except MechanismError as error:
        return files, f", no skeleton diagram ({error})"
    return files, " and skeleton diagram"


def scene_text(scene: StructureScene) -> str:
    """The structure of a scene in lines for a terminal."""
    if scene.mechanism is None:
        from kinelast.structure.spatial_report import spatial_text

        return spatial_text(scene.joints, scene.title, scene.fixed)
    from kinelast.structure.planar_report import structure_report, structure_text

    return structure_text(replace(structure_report(scene.mechanism, scene.contacts), title=scene.title))
