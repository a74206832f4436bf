"""Links of a scene: points in drawing coordinates and in link axes, beams and masses."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from functools import reduce
from itertools import pairwise
from operator import or_
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.links import MAX_OFFSET, acting_points, in_line, lined_up
from kinelast.scene.format import BeamTable, LinkTable, SceneTable
from kinelast.scene.parsing import check_name
from kinelast.scene.sections import CrossSection, cross_section
from kinelast.values.error import fault, known_point, likely, require_absent
from kinelast.values.numbers import any_nonzero, quotient, real, require, vector
from rigid import GROUND, Beam, LineLoad, Link, Lump, Mechanism, Slider
from rigid.arrays import Complex, Real
from rigid.constants import mass_moments

Points = Mapping[str, Any]


def drawn_places(scene: SceneTable) -> dict[str, Complex]:
    """Return the drawn positions [m] of the points under [points] and of ground points with coordinates."""
    places = {name: vector(place) for name, place in scene.points.items()}
    ground = scene.links.get(GROUND)
    if ground is not None and isinstance(ground.points, dict):
        places |= {name: vector(place) for name, place in ground.points.items()}
    return places


def own_points(name: str, table: LinkTable, places: Points) -> dict[str, Complex]:
    """Return the points of a link in link axes [m].

    If the table of the link contains no coordinates, the first point is at 0 and the second is on the x axis.
    """
    where = f"links.{name}"
    if not table.points:
        raise fault(where, "points", "a link needs at least one point")
    if isinstance(table.points, dict):
        if table.length is not None:
            raise fault(where, "length", "the coordinates of the points already give the length: remove it")
        for point in table.points:
            check_name(f"{where}.points", point)
        return {point: vector(place) for point, place in table.points.items()}
    for point, count in Counter(table.points).items():
        if point not in places:
            raise fault(
                where, "points", f'the point "{point}" has no coordinates under [points]{likely(point, places)}'
            )
        if count > 1:
            raise fault(where, "points", f'the point "{point}" is listed {count} times')
    if name == GROUND:
        return {point: places[point] for point in table.points}
    return _drawn_shape(where, table, [places[point] for point in table.points])


def _drawn_shape(where: str, table: LinkTable, places: Sequence[Complex]) -> dict[str, Complex]:
    """Return the points in link axes, computed from the drawing."""
    names = list(table.points)
    if table.length is not None and len(names) != 2:
        problem = f"is the size of a link with two points, this link has {len(names)}: give their coordinates, "
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


def drawn_direction(link: Link, places: Points) -> Complex | None:
    """Return the x axis of a link, in the drawing, as a unit vector.

    Return None if the drawing does not contain two points of the link at different places.
    """
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


BODY_KEYS = ("section", "material", "beams", "strain", "temperature", "mass", "center", "inertia", "masses")


class LinkModel(Struct, frozen=True, eq=False):
    """A link of a scene: mechanical model, cross-section of every beam, and drawn outline [m].

    A `hidden` link has no table in the scene, such as the block of a slot. `numbers` contains, for every beam, the
    index of its entry in the table of the link.
    """

    link: Link
    sections: tuple[CrossSection, ...]
    rigid: bool
    outline: tuple[Complex, ...] = ()
    hidden: bool = False
    numbers: tuple[int, ...] = ()


def build_links(scene: SceneTable, places: Points) -> dict[str, LinkModel]:
    """Return all links by name."""
    if GROUND not in scene.links:
        raise fault("links", GROUND, f"no link is named ground: give this name to the fixed link{likely_ground(scene)}")
    points = {name: own_points(name, table, places) for name, table in scene.links.items()}
    shared = Counter(point for own in points.values() for point in own)
    point_masses = _point_masses(scene, points)
    bodies = {}
    for name, table in scene.links.items():
        if name == GROUND:
            bodies[name] = _ground(table, points[name])
            continue
        joints = {point for point in points[name] if shared[point] > 1}
        joints |= {slider.through for slider in scene.sliders.values() if slider.link == name}
        joints |= {slot.point for slot in scene.slots.values() if slot.link == name}
        bodies[name] = _moving_body(scene, name, points[name], point_masses.get(name, {}), joints)
    return bodies


def guiding(bodies: dict[str, LinkModel], sliders: Mapping[str, Slider]) -> dict[str, LinkModel]:
    """Prepare the links that guide sliders. A rigid link that guides a slider becomes a body without beams.

    Raises
    ------
    SceneError
        An elastic link that guides a slider has no beam along the line of the slider.
    """
    for slider in sliders.values():
        body = bodies[slider.on]
        if not body.link.beams:
            continue
        if body.rigid:
            whole = _lump(f"links.{slider.on}", LinkTable(points=[]), body.link)
            link = replace(body.link, beams=(), lumps=(*body.link.lumps, whole))
            bodies[slider.on] = replace(body, link=link, sections=())
        else:
            problem = f'no beam of "{slider.on}" lies along the line through the drawn position of "{slider.point}": '
            table = "slots" if bodies[slider.link].hidden else "sliders"
            problem += "draw it on a beam, or add rigid = true to the link"
            line = slider.origin, slider.direction
            on_beam = reduce(or_, (lined_up(body.link, beam, *line) for beam in body.link.beams))
            require(on_beam, f"{table}.{slider.name}", "on", problem)
    return bodies


def undivided(mechanism: Mechanism, bodies: Sequence[LinkModel], kept: Collection[str]) -> list[LinkModel]:
    """Return the links, with collinear beams merged if the point between them has no joint, mass or load.

    Parameters
    ----------
    mechanism
        Mechanism with its loads.
    bodies
        Links in the order of the mechanism.
    kept
        Names of the links whose beams are not merged.
    """
    if all(len(body.sections) < 2 or body.link.name in kept for body in bodies):
        return [*bodies]
    fixed = acting_points(mechanism)
    for load in mechanism.loads:
        if isinstance(load, LineLoad):
            at = mechanism.index[load.link]
            beam = mechanism.links[at].beams[load.beam]
            fixed |= {(at, beam.start), (at, beam.end)}
    return [
        body if body.link.name in kept else _merged(body, {point for owner, point in fixed if owner == at})
        for at, body in enumerate(bodies)
    ]


def _merged(body: LinkModel, fixed: Collection[str | None]) -> LinkModel:
    """Merge collinear beams with the same section. Beams are not merged at the points `fixed`."""
    beams, numbers, sections = [*body.link.beams], [*body.numbers], [*body.sections]
    while (point := _merge_point(body.link, beams, sections, fixed)) is not None:
        first, second = (k for k, beam in enumerate(beams) if point in (beam.start, beam.end))
        far = _far_end(beams[second], point)
        ends_there = beams[first].end == point
        beams[first] = replace(beams[first], end=far) if ends_there else replace(beams[first], start=far)
        for each in (beams, numbers, sections):
            del each[second]
    link = replace(body.link, beams=tuple(beams))
    return replace(body, link=link, sections=tuple(sections), numbers=tuple(numbers))


def _merge_point(
    link: Link, beams: Sequence[Beam], sections: Sequence[CrossSection], fixed: Collection[str | None]
) -> str | None:
    """Return a point at which two beams of a link can be merged, or None if there is no such point."""
    meeting: dict[str, list[int]] = {}
    for number, beam in enumerate(beams):
        for point in (beam.start, beam.end):
            meeting.setdefault(point, []).append(number)
    for point, both in meeting.items():
        if len(both) == 2 and point not in fixed and sections[both[0]].continues_as(sections[both[1]]):
            one, other = (link.points[_far_end(beams[number], point)] - link.points[point] for number in both)
            if in_line(one, -other):
                return point
    return None


def _far_end(beam: Beam, point: str) -> str:
    return beam.end if beam.start == point else beam.start


def likely_ground(scene: SceneTable) -> str:
    """Return a hint for a message if a link with another name seems to be the ground."""
    hint = likely(GROUND, scene.links)
    bare = [name for name, link in scene.links.items() if not any(getattr(link, key) for key in BODY_KEYS)]
    name = hint.split(chr(34))[1] if "did you mean" in hint else bare[0] if len(bare) == 1 else ""
    return f'; is it "{name}"?' if name else ""


def _ground(table: LinkTable, points: Points) -> LinkModel:
    for key in ("length", *BODY_KEYS):
        if getattr(table, key):
            raise fault(f"links.{GROUND}", key, "the ground does not move or bend: it has only points")
    return LinkModel(Link(GROUND, points), (), True, _outline(GROUND, table, points))


def _point_masses(scene: SceneTable, points: Mapping[str, Points]) -> dict[str, dict[str, Real]]:
    """Return the point masses of each link.

    A point mass under `[masses]` is given for a point. It belongs to the first moving link with this point.
    """
    by_link: dict[str, dict[str, Real]] = {}
    for name, table in scene.links.items():
        for point, mass in table.masses.items():
            known_point(f"links.{name}", "masses", point, points[name], name)
            by_link.setdefault(name, {})[point] = real(mass)
    for point, mass in scene.masses.items():
        owner = next((name for name, own in points.items() if name != GROUND and point in own), None)
        if owner is None:
            choices = {point for name, own in points.items() if name != GROUND for point in own}
            raise fault("masses", point, f"no moving link has this point{likely(point, sorted(choices))}")
        masses = by_link.setdefault(owner, {})
        masses[point] = masses.get(point, 0.0) + real(mass)
    return by_link


def _moving_body(
    scene: SceneTable, name: str, points: Points, masses: Mapping[str, Real], joints: set[str]
) -> LinkModel:
    """Return a moving link, which is rigid or consists of elastic beams."""
    table, where = scene.links[name], f"links.{name}"
    outline = _outline(name, table, points)
    stiff = table.rigid or len(points) == 1 or scene.structure_only
    if stiff:
        require_absent(where, table, ("strain", "temperature"), "only elastic links have this key")
    else:
        advice = "an elastic link has the mass of its section: remove mass, center and inertia. Add mass at its points"
        advice += " under [masses], or as a rigid link that is welded to it by [welds.POINT]"
        if table.section is None and not table.beams:
            advice = "a link with a mass and without a section is rigid: add rigid = true"
        require_absent(where, table, ("mass", "center", "inertia"), advice)
    pieces, sections = _beams(scene, name, points)
    numbers = tuple(range(len(pieces)))
    lumps = [Lump(point, mass) for point, mass in masses.items()]
    if not pieces and not scene.structure_only:
        if not stiff:
            problem = "the key is missing: an elastic link needs a section (or add rigid = true and mass)"
            raise fault(where, "section", problem)
        if table.mass is None and not masses:
            raise fault(where, "mass", "the key is missing: a rigid link needs mass, or a section and a material")
    given = table.mass is not None or table.center is not None or table.inertia is not None
    if stiff and given:
        lumps.append(_lump(where, table, Link(name, points, pieces)))
        pieces, sections = (), ()
    if pieces:
        nodes = _connected_ends(where, pieces)
        for point in [*joints, *masses]:
            if point not in nodes:
                raise fault(where, "beams", f'no beam reaches the point "{point}", which carries a joint or a mass')
    return LinkModel(Link(name, points, pieces, tuple(lumps)), sections, stiff, outline, numbers=numbers)


def _beams(scene: SceneTable, name: str, points: Points) -> tuple[tuple[Beam, ...], tuple[CrossSection, ...]]:
    """Return the beams of a link and their cross-sections. Both are empty if the link has no section."""
    table, where = scene.links[name], f"links.{name}"
    if table.beams is None:
        if table.section is None and table.material is not None:
            raise fault(where, "section", "the key is missing: a material needs a section")
        if table.section is None:
            return (), ()
        if len(points) < 2:
            raise fault(
                where, "section", f"a link with a section needs at least two points, this one has {len(points)}"
            )
        table_beams = [BeamTable(start=start, end=end) for start, end in pairwise(in_order(points))]
    else:
        table_beams = [
            beam if isinstance(beam, BeamTable) else BeamTable(start=beam[0], end=beam[1]) for beam in table.beams
        ]
    beams, sections = [], []
    for number, beam in enumerate(table_beams, 1):
        key = f"beams[{number}]" if table.beams is not None else "points"
        for point in (beam.start, beam.end):
            known_point(where, key, point, points, name)
        no_length = f'the beam from "{beam.start}" to "{beam.end}" has no length'
        require(points[beam.start] != points[beam.end], where, key, no_length)
        section = beam.section or table.section
        if section is None:
            raise fault(where, key, "has no section: give one here or for the whole link")
        made = cross_section(scene, where, table, beam, section)
        sections.append(made)
        beams.append(made.beam(beam.start, beam.end))
    return tuple(beams), tuple(sections)


def in_order(points: Points, off: float = MAX_OFFSET) -> list[str]:
    """Return the names of the points of a link in the order in which beams connect them.

    A point on the beam between two earlier points divides this beam.

    `off` is the largest angle [rad] between the two parts of a beam that a point divides.
    """
    drawn = {name: complex(np.ravel(place)[0]) for name, place in points.items()}
    order: list[str] = []
    for name, place in drawn.items():
        segments = enumerate(pairwise(order), 1)
        on_it = (at for at, (one, other) in segments if in_line(place - drawn[one], drawn[other] - place, off))
        order.insert(next(on_it, len(order)), name)
    return order


def _connected_ends(where: str, beams: Sequence[Beam]) -> set[str]:
    """Return the names of all end points of beams. Raise SceneError if the beams are not connected."""
    parts: list[set[str]] = []
    for beam in beams:
        touched = [part for part in parts if {beam.start, beam.end} & part]
        parts = [part for part in parts if part not in touched] + [set().union({beam.start, beam.end}, *touched)]
    if len(parts) > 1:
        problem = f'the beams at "{beams[0].start}" and at "{beams[-1].end}" are not connected'
        raise fault(where, "beams", problem)
    return parts[0]


def _lump(where: str, table: LinkTable, link: Link) -> Lump:
    """Return the mass, centre and inertia of a rigid link.

    Values that the table does not give are computed from the beams. For a link without beams, the default centre is its
    only point.
    """
    points = link.points
    mass: Any
    center: Any
    second: Any
    mass, center, second = mass_moments(Link(link.name, points, link.beams))
    origin = next(iter(points))
    if any_nonzero(mass):
        center = quotient(center, mass)
        second = second - mass * abs(center) ** 2
    if table.mass is not None:
        mass = real(table.mass)
    if isinstance(table.center, str):
        known_point(where, "center", table.center, points, where.removeprefix("links."))
        center = points[table.center]
    elif table.center is not None:
        center = vector(table.center)
    elif not link.beams and len(points) > 1 and any_nonzero(mass):
        raise fault(
            where, "center", "the key is missing: expected a point's name or [x, y] in the link's axes, as in \"C\""
        )
    elif not link.beams:
        center = points[origin]
    inertia = second if table.inertia is None else real(table.inertia)
    return Lump(origin, mass, inertia, center - points[origin])


def _outline(name: str, table: LinkTable, points: Points) -> tuple[Complex, ...]:
    """Return the corners of the outline of a link, in link axes [m]."""
    for corner in table.outline:
        if isinstance(corner, str):
            known_point(f"links.{name}", "outline", corner, points, name)
    return tuple(points[corner] if isinstance(corner, str) else vector(corner) for corner in table.outline)
