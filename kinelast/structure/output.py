"""Structure of a scene as a text and a diagram. The mechanism may be immobile."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from kinelast import __version__
from kinelast.outputs.outbox import add_to
from kinelast.outputs.sheet import PAPER, MechanismAxes
from kinelast.scene import build, document, parsing, sections
from kinelast.scene.data import Scene
from kinelast.scene.format import ChainTable
from kinelast.scene.text import file_text, of_file, reader_in, scene_name
from kinelast.structure import spatial_text, structure_text
from kinelast.tasks.progress import SILENT, Progress
from kinelast.tasks.task import DONE, FINE, Outcome, Task, guarded
from kinelast.values.error import fault, known_name
from kinelast.values.units import shown
from rigid import Mechanism, MechanismError
from rigid.topology import Contact, SpatialJoint, assembled, spatial_chain

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class StructureScene(Struct, frozen=True, eq=False):
    """A scene for the analysis of its structure: a planar mechanism, or a spatial chain of joints.

    Attributes
    ----------
    name, title, source, path
        As in the class `Scene`.
    mechanism, contacts
        Planar mechanism (None for a spatial chain), and its contacts (cams and slipping gears).
    joints, fixed
        Joints of a spatial chain, and the name of the fixed link (None if not given).
    """

    name: str
    title: str
    source: str
    path: str
    mechanism: Mechanism | None
    contacts: tuple[Contact, ...] = ()
    joints: tuple[SpatialJoint, ...] = ()
    fixed: str | None = None


def read_structure(path: str | Path) -> StructureScene:
    """Read the structure of a scene from a TOML file.

    Raises
    ------
    SceneError
        The file is invalid. An immobile mechanism does not raise this error.
    """
    if not isinstance(path, str | Path):
        raise TypeError(f"expected the path of a scene file, got {shown(path)}")
    path = Path(path)
    return structure_from_text(file_text(path), scene_name(path), str(path))


def structure_from_text(text: str, name: str = "scene", path: str = "") -> StructureScene:
    """Read the structure of a scene from a TOML text. Error messages show `path`."""
    with of_file(path):
        raw = parsing.parse_toml(text)
    return structure_from_dict(raw, name, path)


def structure_from_dict(raw: Mapping[str, Any], name: str = "scene", path: str = "") -> StructureScene:
    """Read the structure of a scene from the tables of a TOML file. Error messages show `path`."""
    with of_file(path):
        if parsing.is_chain(raw):
            return _chain(parsing.parsed(raw, ChainTable), name, path)
        return _planar(raw, name, path)


def _planar(raw: Mapping[str, Any], name: str, path: str) -> StructureScene:
    read = reader_in(Path(path).parent)
    table = parsing.parse_scene(sections.with_files(raw, read)[0])
    parts = build.build_mechanism(table, document.files_of(table, read))
    contacts = []
    for key, contact in table.contacts.items():
        where = f"contacts.{key}"
        for number, link in enumerate(contact.links, 1):
            known_name(where, f"links[{number}]", link, parts.links)
        if contact.links[0] == contact.links[1]:
            raise fault(where, "links", f'"{contact.links[0]}" cannot touch itself')
        contacts.append(Contact(key, *contact.links, complex(*contact.at), contact.normal))
    return StructureScene(
        name, table.title or name.replace("_", " "), table.source, path, parts.mechanism, tuple(contacts)
    )


def _chain(table: ChainTable, name: str, path: str) -> StructureScene:
    joints = []
    for key, joint in table.joints.items():
        where = f"joints.{key}"
        for link in joint.links:
            parsing.check_name(where, link)
        made = SpatialJoint(
            key,
            joint.links,
            joint.type,
            (0.0, 0.0, 0.0) if joint.at is None else (float(joint.at[0]), float(joint.at[1]), float(joint.at[2])),
            joint.axis or (0.0, 0.0, 1.0),
            float(joint.pitch or 0.0),
            joint.normal,
        )
        try:
            spatial_chain([made])
        except MechanismError as error:
            raise fault(where, error.kind, str(error).removeprefix(f'joint "{key}": ')) from None
        if (made.kind.name == "helical") != (joint.pitch is not None):
            problem = "the key is missing: advance per radian" if joint.pitch is None else "belongs to a helical joint"
            raise fault(where, "pitch", problem)
        joints.append(made)
    try:
        spatial_chain(joints, table.fixed)
    except MechanismError as error:
        raise fault("", "fixed", str(error)) from None
    return StructureScene(
        name, table.title or name.replace("_", " "), table.source, path, None, (), tuple(joints), table.fixed
    )


def try_structure(task: Task, _: Progress = SILENT) -> Outcome:
    """Write a text and a diagram of the structure to the folder of a scene; return an outcome with the text."""
    return guarded(task.name, partial(_structure, task))


def _structure(task: Task) -> Outcome:
    scene = read_structure(task.path)
    text = scene_text(scene)
    files, drawn = _files(scene, text)
    add_to(task.folder, files, {"kinelast": __version__})
    return Outcome(FINE, f"{text}\n{task.name}: structure{drawn} -> {task.folder}", DONE)


def _files(scene: StructureScene, text: str) -> tuple[dict[str, str], str]:
    """Return the files to write, by name, and a text that reports whether there is a diagram."""
    files = {"structure.txt": text}
    if scene.mechanism is None:
        return files, ""

    try:
        files["skeleton.svg"] = skeleton_svg(scene.mechanism)
    except MechanismError as error:
        return files, f", no skeleton diagram ({error})"
    return files, " and skeleton diagram"


def scene_text(scene: StructureScene) -> str:
    """Return a text that describes the structure of a scene."""
    if scene.mechanism is None:
        return spatial_text(scene.joints, scene.title, scene.fixed)
    return structure_text(scene.mechanism, scene.contacts, scene.title)


def skeleton_svg(subject: Mechanism | Scene) -> str:
    """Return the skeleton diagram as SVG text.

    Raises
    ------
    MechanismError
        The mechanism cannot be assembled near the drawn position.
    """
    from matplotlib import rc_context

    figure = skeleton(subject)
    text = StringIO()
    with rc_context({"svg.hashsalt": "skeleton", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def skeleton(subject: Mechanism | Scene) -> Figure:
    """Return the skeleton diagram as a matplotlib figure."""
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
    figure.draw_without_rendering()
    drawing.place_names()
    return figure
