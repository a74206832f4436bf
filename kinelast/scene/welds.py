"""Welds of a scene: links joined rigidly at a point that they share, at the angle at which they are drawn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from kinelast.scene.error import fault, known_name
from kinelast.scene.format import SceneTable
from kinelast.scene.format_motion import WeldTable
from kinelast.scene.points import Points, drawn_direction, known_point
from rigid import Link, Weld
from rigid.parts import Complex


def build_welds(scene: SceneTable, links: Mapping[str, Link], places: Points) -> tuple[Weld, ...]:
    """All welds, in the order of the file."""
    return tuple(weld for point, table in scene.welds.items() for weld in _welds(point, table, links, places))


def _welds(point: str, table: WeldTable, links: Mapping[str, Link], places: Points) -> Iterator[Weld]:
    """The links at a point, each welded to the first of them."""
    where = f"welds.{point}"
    known_name("welds", point, point, {name for link in links.values() for name in link.points}, "point")
    names = table.links or [name for name, link in links.items() if point in link.points]
    for name in names:
        known_name(where, "links", name, links)
        known_point(where, "links", point, links[name].points, name)
    if len(names) < 2:
        raise fault(where, "", f'the link "{names[0]}" alone has the point: a weld needs two links that share it')
    for name in names:
        if names.count(name) > 1:
            raise fault(where, "links", f'the link "{name}" is listed {names.count(name)} times')
    on, *others = names
    for name in others:
        turn = _turn(where, links[name], places) * _turn(where, links[on], places).conjugate()
        yield Weld(point, name, on, turn)


def _turn(where: str, link: Link, places: Points) -> Complex:
    """Unit vector of a link's axes as drawn; of a link of one point any will do."""
    turn: Complex | None = 1 + 0j if len(link.points) == 1 else drawn_direction(link, places)
    if turn is None:
        raise fault(where, "links", f'draw two points of the link "{link.name}", so that its angle is told')
    return turn
