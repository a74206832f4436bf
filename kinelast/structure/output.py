"""The structure of a scene: text for the terminal, and a folder with the same text and the skeleton diagram."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from io import StringIO
from typing import TYPE_CHECKING

import numpy as np

from kinelast.outputs.outbox import add_to
from kinelast.outputs.sheet import PAPER, MechanismAxes
from kinelast.process.progress import SILENT, Progress
from kinelast.scene.structure_scene import StructureScene, read_structure
from kinelast.tasks.outcome import DONE, FINE, Outcome, Task, guarded
from kinelast.version import VERSION
from rigid import Mechanism, MechanismError
from rigid.topology import assembled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kinelast.scene.data import Scene


def try_structure(task: Task, _: Progress = SILENT) -> Outcome:
    """How a scene's structure went, with its text; the files are put into the scene's folder."""
    return guarded(task.name, partial(_structure, task))


def _structure(task: Task) -> Outcome:
    scene = read_structure(task.path)
    text = scene_text(scene)
    files, drawn = _files(scene, text)
    add_to(task.folder, files, {"kinelast": VERSION})
    return Outcome(FINE, f"{text}\n{task.name}: structure{drawn} -> {task.folder}", DONE)


def _files(scene: StructureScene, text: str) -> tuple[dict[str, str], str]:
    """The files of a structure, and the words on its diagram."""
    files = {"structure.txt": text}
    if scene.mechanism is None:
        return files, ""
    from kinelast.structure.output import skeleton_svg

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


def skeleton_svg(subject: Mechanism | Scene) -> str:
    """The skeleton diagram as SVG text.

    Raises
    ------
    MechanismError
        The mechanism does not close near its drawing.
    """
    from matplotlib import rc_context

    figure = skeleton(subject)
    text = StringIO()
    with rc_context({"svg.hashsalt": "skeleton", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def skeleton(subject: Mechanism | Scene) -> Figure:
    """The skeleton diagram as a matplotlib figure, to be saved in any format."""
    from matplotlib.figure import Figure

    mechanism = subject if isinstance(subject, Mechanism) else subject.mechanism
    here = assembled(mechanism)
    drawing = MechanismAxes(here)
    width, height = drawing.extent
    tall = float(np.clip(8.0 * height / width, 3.0, 9.0))
    figure = Figure(figsize=(8.0, tall), layout="constrained", facecolor=PAPER)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_axis_off()
    drawing.axes = axes
    drawing.draw()
    axes.margins(0.04)
    axes.autoscale_view()
    return figure
