"""Points of a scene: where they are drawn, and where they are in the axes of their links."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from kinelast.scene.error import fault, likely
from kinelast.scene.format import LinkTable, SceneTable
from kinelast.scene.many import any_nonzero, real, require, vector
from kinelast.scene.parsing import check_name
from rigid import GROUND, Link
from rigid.arrays import Complex

Points = Mapping[str, Any]


def drawn_places(scene: SceneTable) -> dict[str, Complex]:
    """The drawing: every place under [points], and the ground's points given in coordinates [m]."""
    places = {name: vector(place) for name, place in scene.points.items()}
    ground = scene.links.get(GROUND)
    if ground is not None and isinstance(ground.points, dict):
        places |= {name: vector(place) for name, place in ground.points.items()}
    return places


def own_points(name: str, table: LinkTable, places: Points) -> dict[str, Complex]:
    """A link's points in its own axes [m]: the first at 0, the second on x', unless coordinates are given."""
    where = f"links.{name}"
    if not table.points:
        raise fault(where, "points", "a link needs at least one point")
    if isinstance(table.points, dict):
        if table.length is not None:
            raise fault(where, "length", "the coordinates of the points tell the length already: leave it out")
        for point in table.points:
            check_name(f"{where}.points", point)
        return {point: vector(place) for point, place in table.points.items()}
    for point, count in Counter(table.points).items():
        if point not in places:
            raise fault(where, "points", f'the point "{point}" has no place under [points]{likely(point, places)}')
        if count > 1:
            raise fault(where, "points", f'the point "{point}" is listed {count} times')
    if name == GROUND:
        return {point: places[point] for point in table.points}
    return _drawn_shape(where, table, [places[point] for point in table.points])


def _drawn_shape(where: str, table: LinkTable, places: Sequence[Complex]) -> dict[str, Complex]:
    """Own coordinates read from the drawing."""
    names = list(table.points)
    if table.length is not None and len(names) != 2:
        problem = f"tells the size of a link of two points, this one has {len(names)}: give their coordinates, "
        raise fault(where, "length", problem + "as in points = {A = [0, 0], B = [0.1, 0]}")
    if len(names) == 1:
        return {names[0]: 0j}
    same = f'"{names[0]}" and "{names[1]}" are drawn at the same place: the link has no length'
    require(places[0] != places[1], where, "points", same)
    length: Any = abs(places[1] - places[0])
    toward = (places[1] - places[0]) / length
    own = [0j, (length if table.length is None else real(table.length)) + 0j]
    own += [(place - places[0]) * toward.conjugate() for place in places[2:]]
    return dict(zip(names, own, strict=True))


def known_point(table: str, key: str, point: str, points: Mapping[str, object], link: str) -> None:
    """Raise where a link has no such point."""
    if point not in points:
        raise fault(table, key, f'the link "{link}" has no point "{point}"{likely(point, points)}')


def drawn_direction(link: Link, places: Points) -> Any:
    """Unit vector of a link's axes as drawn; None where fewer than two of its points are drawn apart."""
    if link.name == GROUND:
        return 1 + 0j
    drawn = [point for point in link.points if point in places]
    if len(drawn) < 2:
        return None
    seen: Any = places[drawn[1]] - places[drawn[0]]
    own: Any = link.points[drawn[1]] - link.points[drawn[0]]
    if not any_nonzero(seen) or not any_nonzero(own):
        return None
    turned = seen / own
    return turned / abs(turned)
