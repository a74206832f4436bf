"""The structure of a scene: text for the terminal, and a folder with the same text and the skeleton diagram."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from kinelast.outcome import DONE, FINE, Outcome, Task, attempted
from kinelast.outputs.outbox import add_to
from kinelast.progress import SILENT, Progress
from kinelast.scene.structure_scene import StructureScene, read_structure
from kinelast.version import VERSION
from rigid import MechanismError


def try_structure(task: Task, _: Progress = SILENT) -> Outcome:
    """How a scene's structure went, with its text; the files are put into the scene's folder."""
    return attempted(task.name, partial(_structure, task))


def _structure(task: Task) -> Outcome:
    scene = read_structure(task.path)
    text = scene_text(scene)
    files, drawn = _files(scene, text)
    add_to(task.folder, files, {"kinelast": VERSION})
    return Outcome(FINE, f"{text}\n{task.name}: structure{drawn} -> {task.folder}", DONE)


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
