"""Sliders of a scene, and pins in slots: a block without mass on the pin that slides in the slot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinelast.scene.error import fault, known_name, likely
from kinelast.scene.format import SceneTable
from kinelast.scene.format_motion import SliderTable, SlotTable
from kinelast.scene.links import Body
from kinelast.scene.many import way
from kinelast.scene.points import Points, drawn_direction, known_point
from rigid import GROUND, Link, Slider
from rigid.parts import Complex


def build_sliders(scene: SceneTable, bodies: dict[str, Body], places: Points) -> dict[str, Slider]:
    """All sliders by name, those of the slots too; adds the slots' blocks to the bodies."""
    links = {name: body.link for name, body in bodies.items()}
    sliders = {name: _slider(name, table, links, places) for name, table in scene.sliders.items()}
    for name, slot in scene.slots.items():
        if name in sliders:
            raise fault(f"slots.{name}", "", "a slider has this name: choose another")
        # A space, which no name in a file may hold, keeps it apart from the links of the file.
        block = Link(f"{name} block", {slot.point: 0j})
        sliders[name] = _slot(name, slot, block, links, places)
        bodies[block.name] = Body(block, (), True, hidden=True)
    return sliders


def _slider(name: str, table: SliderTable, links: Mapping[str, Link], places: Points) -> Slider:
    """A slider; its line passes the drawn place of a point and is fixed in its owner."""
    where = f"sliders.{name}"
    known_name(where, "link", table.link, links)
    known_name(where, "on", table.on, links)
    if table.link == GROUND:
        raise fault(where, "link", "the ground cannot slide: name the moving link here, and ground under on")
    if table.link == table.on:
        raise fault(where, "on", f'the link "{table.link}" cannot slide on itself')
    known_point(where, "through", table.through, links[table.link].points, table.link)
    own = drawn_direction(links[table.link], places)
    return _line(where, "through", name, table.link, links[table.on], table.through, way(table.direction), own, places)


def _slot(name: str, table: SlotTable, block: Link, links: Mapping[str, Link], places: Points) -> Slider:
    """The slider of a slot's block."""
    where = f"slots.{name}"
    known_name(where, "link", table.link, links)
    known_name(where, "on", table.on, links)
    if table.link == table.on:
        raise fault(where, "on", f'the link "{table.link}" cannot slide on itself')
    known_point(where, "point", table.point, links[table.link].points, table.link)
    return _line(where, "point", name, block.name, links[table.on], table.point, way(table.direction), None, places)


def _line(
    where: str,
    key: str,
    name: str,
    link: str,
    owner: Link,
    point: str,
    direction: Complex,
    own: Any,
    places: Points,
) -> Slider:
    """A line through the drawn place of a point, in the axes of its owner; `own` are the link's axes as drawn."""
    if point not in places:
        raise fault(where, key, f'the point "{point}" has no place under [points]{likely(point, places)}')
    axes = drawn_direction(owner, places)
    if axes is None:
        raise fault(where, "on", f'draw two points of the link "{owner.name}", so that the line can be fixed in it')
    origin: Any = places[point]
    if owner.name != GROUND:
        anchor = next(point for point in owner.points if point in places)
        origin = (origin - places[anchor]) * axes.conjugate() + owner.points[anchor]
    turn: Any = 1 + 0j if own is None else own * axes.conjugate()
    return Slider(name, link, owner.name, point, origin, direction * axes.conjugate(), turn)
