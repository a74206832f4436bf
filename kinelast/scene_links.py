"""Links of a scene: points in their own axes, beams, masses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kinelast.scene_error import fault, likely
from kinelast.scene_format import BeamTable, LinkTable, SceneTable
from kinelast.scene_parse import check_name
from kinelast.scene_sections import CrossSection, cross_section
from rigid import GROUND, Beam, Link, Lump

Points = Mapping[str, complex]


@dataclass(frozen=True, eq=False)
class Body:
    """A link of a scene: its mechanical model, the cross-section of every beam, whether it is rigid, its outline."""

    link: Link
    sections: tuple[CrossSection, ...]
    rigid: bool
    outline: tuple[complex, ...]


def drawn_places(scene: SceneTable) -> dict[str, complex]:
    """The drawing: every place under [points], and what the ground says in coordinates [m]."""
    places = {name: complex(*place) for name, place in scene.points.items()}
    ground = scene.links.get(GROUND)
    if ground is not None and isinstance(ground.points, dict):
        places |= {name: complex(*place) for name, place in ground.points.items()}
    return places


def build_links(scene: SceneTable, places: Points) -> dict[str, Body]:
    """All links by name."""
    if GROUND not in scene.links:
        raise fault("links", GROUND, f"no link is named ground: name the fixed link so{likely_ground(scene)}")
    points = {name: own_points(name, table, places) for name, table in scene.links.items()}
    shared = Counter(point for own in points.values() for point in own)
    held = _point_masses(scene, points)
    guides = {slider.on for slider in scene.sliders.values()}
    bodies = {}
    for name, table in scene.links.items():
        if name == GROUND:
            bodies[name] = _ground(table, points[name])
            continue
        joints = {point for point in points[name] if shared[point] > 1}
        joints |= {slider.through for slider in scene.sliders.values() if slider.link == name}
        bodies[name] = _moving(scene, name, points[name], held.get(name, {}), joints, name in guides)
    return bodies


def likely_ground(scene: SceneTable) -> str:
    """A hint where another name looks like the ground's."""
    hint = likely(GROUND, scene.links)
    return f'; is it "{hint.split(chr(34))[1]}"?' if "did you mean" in hint else ""


def own_points(name: str, table: LinkTable, places: Points) -> dict[str, complex]:
    """A link's points in its own axes [m]: the first at 0, the second on x', unless coordinates are given."""
    where = f"links.{name}"
    if not table.points:
        raise fault(where, "points", "a link needs at least one point")
    if isinstance(table.points, dict):
        if table.length is not None:
            raise fault(where, "length", "the coordinates of the points tell the length already: leave it out")
        for point in table.points:
            check_name(f"{where}.points", point)
        return {point: complex(*place) for point, place in table.points.items()}
    for point, count in Counter(table.points).items():
        if point not in places:
            raise fault(where, "points", f'the point "{point}" has no place under [points]{likely(point, places)}')
        if count > 1:
            raise fault(where, "points", f'the point "{point}" is listed {count} times')
    if name == GROUND:
        return {point: places[point] for point in table.points}
    return _drawn_shape(where, table, [places[point] for point in table.points])


def _drawn_shape(where: str, table: LinkTable, places: Sequence[complex]) -> dict[str, complex]:
    """Own coordinates read from the drawing."""
    names = list(table.points)
    if table.length is not None and len(names) != 2:
        problem = f"tells the size of a link of two points, this one has {len(names)}: give their coordinates, "
        raise fault(where, "length", problem + "as in points = {A = [0, 0], B = [0.1, 0]}")
    if len(names) == 1:
        return {names[0]: 0j}
    if places[0] == places[1]:
        raise fault(
            where, "points", f'"{names[0]}" and "{names[1]}" are drawn at the same place: the link has no length'
        )
    length = abs(places[1] - places[0])
    toward = (places[1] - places[0]) / length
    own = [(place - places[0]) * toward.conjugate() for place in places]
    own[1] = complex(length if table.length is None else table.length)
    return dict(zip(names, own, strict=True))


def _ground(table: LinkTable, points: Points) -> Body:
    for key in ("length", "section", "material", "beams", "mass", "center", "inertia", "masses"):
        if getattr(table, key):
            raise fault(f"links.{GROUND}", key, "the ground neither moves nor bends: it has points only")
    return Body(Link(GROUND, points), (), True, _outline(GROUND, table, points))


def _point_masses(scene: SceneTable, points: Mapping[str, Points]) -> dict[str, dict[str, float]]:
    """Mass at every point, per link: its own, and those of [masses] with the first moving link that has the point."""
    held: dict[str, dict[str, float]] = {}
    for name, table in scene.links.items():
        for point, mass in table.masses.items():
            known_point(f"links.{name}", "masses", point, points[name], name)
            held.setdefault(name, {})[point] = float(mass)
    for point, mass in scene.masses.items():
        owner = next((name for name, own in points.items() if name != GROUND and point in own), None)
        if owner is None:
            choices = {point for name, own in points.items() if name != GROUND for point in own}
            raise fault("masses", point, f"no moving link has this point{likely(point, sorted(choices))}")
        masses = held.setdefault(owner, {})
        masses[point] = masses.get(point, 0.0) + mass
    return held


def known_point(table: str, key: str, point: str, points: Mapping[str, object], link: str) -> None:
    """Raise where a link has no such point."""
    if point not in points:
        raise fault(table, key, f'the link "{link}" has no point "{point}"{likely(point, points)}')


def _moving(
    scene: SceneTable, name: str, points: Points, held: Mapping[str, float], joints: set[str], guide: bool
) -> Body:
    """A moving link: elastic with beams, or rigid."""
    table, where = scene.links[name], f"links.{name}"
    outline = _outline(name, table, points)
    stiff = table.rigid or len(points) == 1
    if not stiff:
        for key in ("mass", "center", "inertia"):
            if getattr(table, key) is not None:
                raise fault(where, key, "only rigid links take it: add rigid = true, or use masses")
        if guide:
            raise fault(where, "rigid", "a link that guides a slider has to be rigid: add rigid = true")
    pieces, sections = _beams(scene, name, points)
    lumps = [Lump(point, mass) for point, mass in held.items()]
    if not pieces:
        if not stiff:
            problem = "the key is missing: an elastic link needs a section (or add rigid = true and mass)"
            raise fault(where, "section", problem)
        if table.mass is None and not held:
            raise fault(where, "mass", "the key is missing: a rigid link needs mass, or a section and a material")
    given = table.mass is not None or table.center is not None or table.inertia is not None
    if stiff and (given or (guide and pieces)):
        lumps.append(_lump(where, table, points, pieces))
        pieces, sections = (), ()
    if pieces:
        nodes = _tree(where, pieces)
        for point in [*joints, *held]:
            if point not in nodes:
                raise fault(where, "beams", f'no beam reaches the point "{point}", which carries a joint or a mass')
    return Body(Link(name, points, pieces, tuple(lumps)), sections, stiff, outline)


def _beams(scene: SceneTable, name: str, points: Points) -> tuple[tuple[Beam, ...], tuple[CrossSection, ...]]:
    """Beams and their cross-sections; none where the link has no section."""
    table, where = scene.links[name], f"links.{name}"
    if table.beams is None:
        if table.section is None and table.material is not None:
            raise fault(where, "section", "the key is missing: a material alone makes no beam")
        if table.section is None:
            return (), ()
        if len(points) < 2:
            raise fault(
                where, "section", f"a link with a section needs at least two points, this one has {len(points)}"
            )
        ends = list(zip(list(points), list(points)[1:], strict=False))
        table_beams = [BeamTable(start=start, end=end) for start, end in ends]
    else:
        table_beams = [
            beam if isinstance(beam, BeamTable) else BeamTable(start=beam[0], end=beam[1]) for beam in table.beams
        ]
    beams, sections = [], []
    for number, beam in enumerate(table_beams, 1):
        key = f"beams[{number}]" if table.beams is not None else "points"
        for point in (beam.start, beam.end):
            known_point(where, key, point, points, name)
        if points[beam.start] == points[beam.end]:
            raise fault(where, key, f'from "{beam.start}" to "{beam.end}" there is no length')
        section = beam.section or table.section
        if section is None:
            raise fault(where, key, "has no section: give one here or for the whole link")
        sections.append(cross_section(scene, where, section, beam.material or table.material))
        beams.append(Beam(beam.start, beam.end, sections[-1].mass_per_length))
    return tuple(beams), tuple(sections)


def _tree(where: str, beams: Sequence[Beam]) -> set[str]:
    """Ends of the beams; raises where they close a ring or do not hang together."""
    parts: list[set[str]] = []
    for beam in beams:
        touched = [part for part in parts if {beam.start, beam.end} & part]
        if any({beam.start, beam.end} <= part for part in touched):
            raise fault(where, "beams", f'the beams close a ring at "{beam.start}"-"{beam.end}": leave one out')
        parts = [part for part in parts if part not in touched] + [set().union({beam.start, beam.end}, *touched)]
    if len(parts) > 1:
        problem = f'the beams at "{beams[0].start}" and at "{beams[-1].end}" do not hang together'
        raise fault(where, "beams", problem)
    return parts[0]


def _lump(where: str, table: LinkTable, points: Points, beams: Sequence[Beam]) -> Lump:
    """Mass, centre and inertia as given; what is left out from the beams, or from the only point."""
    mass, first, second = _moments(points, beams)
    origin = next(iter(points))
    if table.mass is not None:
        mass = float(table.mass)
    if isinstance(table.center, str):
        known_point(where, "center", table.center, points, where.removeprefix("links."))
        center = points[table.center]
    elif table.center is not None:
        center = complex(*table.center)
    elif beams:
        center = first
    elif len(points) > 1 and mass:
        raise fault(
            where, "center", "the key is missing: expected a point's name or [x, y] in the link's axes, as in \"C\""
        )
    else:
        center = points[origin]
    inertia = second if table.inertia is None else float(table.inertia)
    return Lump(origin, mass, inertia, center - points[origin])


def _moments(points: Points, beams: Sequence[Beam]) -> tuple[float, complex, float]:
    """Mass [kg], centre [m] and moment of inertia about it [kg m^2] of some beams; zeros where there are none."""
    parts = []
    for beam in beams:
        start, way = points[beam.start], points[beam.end] - points[beam.start]
        parts.append((float(beam.mass_per_length) * abs(way), start + way / 2, abs(way)))
    mass = sum(part for part, _, _ in parts)
    if not mass:
        return 0.0, 0j, 0.0
    center = sum(part * middle for part, middle, _ in parts) / mass
    return mass, center, sum(part * (abs(middle - center) ** 2 + length**2 / 12) for part, middle, length in parts)


def _outline(name: str, table: LinkTable, points: Points) -> tuple[complex, ...]:
    """Corners of the link's drawing in its own axes [m]."""
    for corner in table.outline:
        if isinstance(corner, str):
            known_point(f"links.{name}", "outline", corner, points, name)
    return tuple(points[corner] if isinstance(corner, str) else complex(*corner) for corner in table.outline)
