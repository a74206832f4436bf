"""The mechanism of a scene without its loads: links, sliders and slots, drives, gears."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kinelast.scene.drives import DriveEffort, DriveLaw, build_drives
from kinelast.scene.format import SceneTable
from kinelast.scene.gears import build_gears
from kinelast.scene.links import Body, build_links, guiding
from kinelast.scene.many import vector
from kinelast.scene.points import drawn_places
from kinelast.scene.sliders import build_sliders
from rigid import Link, Mechanism


@dataclass(frozen=True, eq=False)
class SceneMechanism:
    """A mechanism without its loads, its links as bodies in the same order, and one law or effort per drive."""

    mechanism: Mechanism
    bodies: tuple[Body, ...]
    laws: tuple[DriveLaw | DriveEffort, ...]

    @property
    def links(self) -> Mapping[str, Link]:
        """Links that the scene names."""
        return {body.link.name: body.link for body in self.bodies if not body.hidden}


def build_mechanism(table: SceneTable) -> SceneMechanism:
    """The parts of a scene."""
    places = drawn_places(table)
    bodies = build_links(table, places)
    sliders = build_sliders(table, bodies, places)
    bodies = guiding(bodies, sliders)
    links = {name: body.link for name, body in bodies.items()}
    named = {name: body.link for name, body in bodies.items() if not body.hidden}
    drives, laws = build_drives(table, named, sliders, places)
    gears = build_gears(table, named, sliders)
    gravity = vector(table.run.gravity or (0.0, 0.0))
    mechanism = Mechanism(tuple(links.values()), drives, places, tuple(sliders.values()), gravity, gears=gears)
    return SceneMechanism(mechanism, tuple(bodies[link.name] for link in mechanism.links), laws)
