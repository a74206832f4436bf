"""Scenes read for their structure alone: planar mechanisms, whether they move or not, and chains of joints in space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kinelast.scene.build import build_mechanism
from kinelast.scene.error import fault, known_name
from kinelast.scene.format import ChainTable, SceneTable
from kinelast.scene.parsing import check_name, is_chain, parse_chain, parse_scene
from kinelast.scene.text import file_text, of_file, scene_name, toml_tables
from rigid import Mechanism, MechanismError
from rigid.topology import Contact, SpatialJoint, spatial_chain


@dataclass(frozen=True, eq=False)
class StructureScene:
    """A scene without motion: its mechanism, or its joints in space.

    Attributes
    ----------
    name, title, source, path
        As of a `Scene`.
    mechanism, contacts
        A planar mechanism with its gears and cams; None for a chain in space.
    joints, fixed
        Joints of a chain in space, and its fixed link where the scene tells it.
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
    """The structure in a TOML file, of any scene.

    Raises
    ------
    SceneError
        The file cannot be read or holds a mistake. A mechanism that cannot move is none.
    """
    path = Path(path)
    return structure_from_text(file_text(path), scene_name(path), str(path))


def structure_from_text(text: str, name: str = "scene", path: str = "") -> StructureScene:
    """The structure in a TOML text; `path` stands for the file in messages."""
    return structure_from_dict(toml_tables(text, path), name, path)


def structure_from_dict(raw: Mapping[str, Any], name: str = "scene", path: str = "") -> StructureScene:
    """The structure in the tables of a TOML file; `path` stands for the file in messages."""
    with of_file(path):
        return _chain(parse_chain(raw), name, path) if is_chain(raw) else _planar(parse_scene(raw), name, path)


def _planar(table: SceneTable, name: str, path: str) -> StructureScene:
    parts = build_mechanism(table)
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
            check_name(where, link)
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
