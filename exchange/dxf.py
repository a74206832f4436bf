"""DXF drawings: import of lines as links, and export of links with holes at their joints."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

from msgspec import Struct, field

from exchange.foreign_mechanism import GROUND, Drive, ExchangeError, ForeignLink, ForeignMechanism, Names

SOURCE = "DXF"
UNITS = {1: "in", 4: "mm", 5: "cm", 6: "m"}  # unit of length, by the code $INSUNITS in a DXF file
METRES = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "m": 1.0}  # length of each unit [m]
# a line whose layer or line type contains one of these words does not belong to a drawn section
AUXILIARY = re.compile("cent(er|re)|axis|axes|hidden|dashdot|phantom|dim|hatch|text|defpoints", re.IGNORECASE)
CHORD = 1e-4  # largest distance between an arc and the chords that replace it, divided by the size of the section
SAME = 1e-4  # ends of lines count as one point if their distance is at most SAME * (size of the drawing)
TURN = "60 rpm"  # speed of driven links, assumed because a drawing contains no speed
FIXED = 1.0  # radius of the circle that marks a fixed point in an exported drawing, in the unit of the drawing
CRANKS = "CRANKS"  # layer on which the program pylinkage draws driven joints
AXIS = "axis "  # prefix of the layers on which kinelast draws the axes of links


class DrawnLink(Struct, frozen=True):
    """Link as it is drawn in an exported drawing.

    Attributes
    ----------
    points
        Position of each point, by name.
    beams
        Tuple for each beam: position of the start, position of the end, half of the depth at the start, half of the
        depth at the end. An unknown half depth is nan.
    holes
        Diameter of the hole at each point, by point name. Points with an unknown diameter are missing.
    """

    name: str
    points: Mapping[str, complex]
    beams: Sequence[tuple[complex, complex, float, float]] = ()
    holes: Mapping[str, float] = field(default_factory=dict)

    def outlines(self) -> Iterator[tuple[complex, complex, complex, complex]]:
        """Yield the corners of every beam with a known depth, clockwise from the left corner at the beam's start."""
        for start, end, first, last in self.beams:
            if first > 0 and last > 0 and start != end:
                across = 1j * (end - start) / abs(end - start)
                yield start + across * first, end + across * last, end - across * last, start - across * first


@contextmanager
def _fixed_dates() -> Iterator[None]:
    """Make ezdxf write fixed dates and identifiers, so that equal drawings give identical files."""
    from ezdxf._options import options

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


@_fixed_dates()
def dxf_text(
    links: Iterable[DrawnLink],
    fixed: Mapping[str, complex],
    paths: Mapping[str, Sequence[complex]],
    unit: str,
    curves: Mapping[str, Sequence[complex]] = MappingProxyType({}),
) -> str:
    """Return a DXF drawing with a layer for the outline and holes of each link.

    Axes of links, fixed points, paths and curves have layers of their own. The outline of a beam ends in a semicircle
    about each end point. `of_dxf` reads only the axes and the fixed points of a drawing that this function wrote.

    Parameters
    ----------
    fixed
        Position of each point of the ground, by point name.
    paths
        Successive positions of moving points, by name.
    unit
        Unit of all lengths: "mm", "cm", "m" or "in".
    curves
        Corners of closed curves, by layer name.

    Raises
    ------
    ModuleNotFoundError
        If ezdxf is not installed.
    """
    from ezdxf.filemanagement import new

    drawing = new(units=next(code for code, name in UNITS.items() if name == unit))
    space = drawing.modelspace()
    for link in links:
        on, holes = {"layer": link.name}, link.holes
        for corners in link.outlines():
            ends = [(*_xy(place), bulge) for place, bulge in zip(corners, (0, -1, 0, -1), strict=True)]
            space.add_lwpolyline(ends, "xyb", close=True, dxfattribs=on)
        for name, place in link.points.items():
            if name in holes:
                space.add_circle(_xy(place), holes[name] / 2, dxfattribs=on)
            else:
                space.add_point(_xy(place), dxfattribs=on)
        if len(link.points) > 1:
            axis = [_xy(place) for place in link.points.values()]
            space.add_lwpolyline(axis, dxfattribs={"layer": AXIS + link.name})
    for place in fixed.values():
        space.add_circle(_xy(place), FIXED, dxfattribs={"layer": "ground"})
    for name, places in paths.items():
        space.add_lwpolyline([_xy(place) for place in places], dxfattribs={"layer": f"path {name}"})
    for name, places in curves.items():
        space.add_lwpolyline([_xy(place) for place in places], close=True, dxfattribs={"layer": name})
    text = StringIO()
    drawing.write(text)
    return text.getvalue()


def _xy(place: complex) -> tuple[float, float]:
    return place.real, place.imag


def of_dxf(path: Path, title: str) -> ForeignMechanism:
    """Return the mechanism in a DXF drawing. Each line is a link, and each polyline is a link with several points.

    Blocks are exploded. Coincident ends are pinned together. Ends of lines and centres of circles are fixed points if
    the name of their layer contains "ground", "fixed" or "base".

    A circle on the layer "CRANKS" marks the end of a driven link. Each link that connects a circle on "CRANKS" to a
    fixed point is driven. If there is no such link, the first link at a fixed point is driven.

    If no point is fixed, or if there are circles on "CRANKS", each end that belongs to only one link is also fixed.
    Ends at circles on "CRANKS" are not fixed by this rule. The notes of the mechanism list the numbers of unused
    entities.

    Raises
    ------
    ExchangeError
        If the file is damaged or contains no line.
    ModuleNotFoundError
        If ezdxf is not installed.
    """
    from ezdxf.disassemble import recursive_decompose
    from ezdxf.filemanagement import readfile
    from ezdxf.lldxf.const import DXFError

    try:
        drawing = readfile(path)
        entities = [*recursive_decompose(drawing.modelspace())]
    except (OSError, DXFError) as error:
        raise ExchangeError(f"not a DXF drawing, or a damaged one: {error}") from None
    axes = [entity for entity in entities if entity.dxf.layer.startswith(AXIS)]
    sorted_out = _SortedOut()
    for entity in [*axes, *(each for each in entities if each.dxf.layer == "ground")] if axes else entities:
        sorted_out.add(entity)
    unit = UNITS.get(drawing.header.get("$INSUNITS", 4), "mm")
    names = [entity.dxf.layer.removeprefix(AXIS) for entity in axes]
    return _linked(sorted_out, names, unit, title)


class _SortedOut:
    """Entities of a drawing, grouped by their role in the mechanism.

    Attributes
    ----------
    chains
        Corners of each line or polyline that is a link.
    marks
        Positions of fixed joints: corners and circle centres on layers with "ground", "fixed" or "base" in their names.
    cranks
        Centres of circles on the layer `CRANKS`.
    circles
        Centres of the circles on all other layers.
    left
        Number of unused entities of each kind.
    """

    def __init__(self) -> None:
        self.chains: list[list[complex]] = []
        self.marks: list[complex] = []
        self.cranks: list[complex] = []
        self.circles: list[complex] = []
        self.left: Counter[str] = Counter()

    def add(self, entity: Any) -> None:
        corners, kind, layer = _corners(entity), entity.dxftype(), entity.dxf.layer
        if re.search("ground|fixed|base", layer, re.IGNORECASE):
            self.marks += corners or ([_place(entity.dxf.center)] if kind == "CIRCLE" else [])
        elif layer == CRANKS:  # pylinkage draws a circle and other symbols at each driven joint
            self.cranks += [_place(entity.dxf.center)] if kind == "CIRCLE" else []
        elif kind == "CIRCLE":
            self.circles.append(_place(entity.dxf.center))
        elif kind == "LWPOLYLINE" and entity.closed and any(bulge for *_, bulge in entity.get_points("xyb")):
            self.left["round-ended outline"] += 1
        elif len(corners) > 1:
            self.chains.append(corners)
        elif kind != "POINT":
            self.left[kind.lower()] += 1


def _linked(entities: _SortedOut, axes: Sequence[str], unit: str, title: str) -> ForeignMechanism:
    """Convert sorted entities to a mechanism, in which each chain of corners is a link.

    `axes` are the names of the links if kinelast wrote the drawing; otherwise, `axes` is empty.
    """
    if not entities.chains:
        raise ExchangeError(f"the drawing contains no line{_listed(entities.left, ', only ')}")
    spread = [place for chain in entities.chains for place in chain]
    near = SAME * max(abs(a - spread[0]) for a in spread)
    points: list[complex] = []
    ends = [tuple(dict.fromkeys(_index(place, points, near) for place in chain)) for chain in entities.chains]

    def marked(marks: Iterable[complex]) -> set[int]:
        return {n for n, place in enumerate(points) if any(abs(place - mark) <= near for mark in marks)}

    notes = ["every line of the drawing is a link; coincident ends are pinned together"]
    fixed, tips = marked(entities.marks), marked(entities.cranks)
    lone = {n for n in range(len(points)) if sum(n in chain for chain in ends) == 1}
    if not fixed:
        notes.append("no layer named ground, fixed or base: ends that belong to only one line are taken as fixed")
    if not fixed or tips:  # drawings of pylinkage mark all driven joints, but only some fixed points
        fixed |= lone - tips
    entities.left["circle"] += sum(all(abs(place - each) > near for place in points) for each in entities.circles)
    if left := _listed(+entities.left, ""):
        notes.append(f"left out of the drawing: {left}")
    names, called = Names(), Names([GROUND])
    point = {n: names(n, _letter(n)) for n in range(len(points))}
    links = {
        called(n, axes[n] if axes else f"link_{n + 1}"): ForeignLink(tuple(point[c] for c in chain))
        for n, chain in enumerate(ends)
        if set(chain) - fixed
    }
    grounded = [(name, point[n]) for name, body in links.items() for n in sorted(fixed) if point[n] in body.points]
    cranks = [(name, at) for name, at in grounded if any(point[n] in links[name].points for n in tips)]
    drives = tuple(Drive({"link": name, "at": at}, TURN) for name, at in cranks or grounded[:1])
    notes += [f"{drive.joint['link']} turns at {TURN}: assumed" for drive in drives]
    places = {point[n]: place for n, place in enumerate(points)}
    return ForeignMechanism(
        title, SOURCE, unit, places, tuple(point[n] for n in sorted(fixed)), links, drives=drives, notes=tuple(notes)
    )


def _listed(left: Counter[str], before: str) -> str:
    """Return `before` and a list of unused entities, such as "2 arcs, 1 text"; "" if there are none."""
    words = [f"{number} {kind}{'s' * (number > 1)}" for kind, number in left.items() if number]
    return before + ", ".join(words) if words else ""


def section_of_dxf(text: str, unit: str = "mm") -> list[list[tuple[float, float]]]:
    """Return the corners (x, y) [m] of a drawn section: one list for the outline, then one list for each hole.

    Arcs are replaced by chords, and blocks are exploded. Layers and line types for centre lines, hidden edges and
    dimensions are ignored.

    Parameters
    ----------
    unit
        Unit of length, used if the drawing does not state its unit.

    Raises
    ------
    ExchangeError
        If the file is damaged, or if its lines do not form a single outline with holes.
    ModuleNotFoundError
        If ezdxf or shapely is not installed.
    """
    from ezdxf.disassemble import recursive_decompose
    from ezdxf.filemanagement import read
    from ezdxf.lldxf.const import DXFError
    from ezdxf.path import bbox, make_path
    from shapely import LineString, Polygon, polygonize_full, set_precision, union_all

    try:
        drawing = read(StringIO(text))
    except (OSError, ValueError, DXFError) as error:
        raise ExchangeError(f"not a DXF drawing, or a damaged one: {error}") from None
    paths = []
    for entity in recursive_decompose(drawing.modelspace()):
        if not AUXILIARY.search(f"{entity.dxf.layer} {entity.dxf.get('linetype', '')}"):
            with suppress(TypeError):  # make_path rejects texts, points and other entities without a path
                paths.append(make_path(entity))
    box = bbox(paths)
    if not box.has_data:
        raise ExchangeError("the drawing contains no line")
    size = max(box.size.x, box.size.y)
    lines = [LineString([(at.x, at.y) for at in path.flattening(CHORD * size)]) for path in paths if len(path)]
    faces, cuts, open_ended, _ = polygonize_full([set_precision(union_all(lines), SAME * size)])
    for loose in (*open_ended.geoms, *cuts.geoms):
        x, y = loose.coords[0]
        raise ExchangeError(f"a line from ({x:g}, {y:g}) is on no closed outline: move centre lines to a layer CENTER")
    found = list(faces.geoms)
    section = max(found, key=lambda face: Polygon(face.exterior).area)
    holes = [Polygon(ring) for ring in section.interiors]
    others = [face for face in found if face is not section]
    if len(others) != len(holes) or not all(any(face.equals(hole) for hole in holes) for face in others):
        raise ExchangeError(
            f"its lines enclose {len(others) + 1} areas, expected one outline with its holes: remove crossing lines and"
            " further outlines"
        )
    scale = METRES[UNITS.get(drawing.header.get("$INSUNITS", 0), unit)]
    return [[(scale * x, scale * y) for x, y in ring.coords[:-1]] for ring in (section.exterior, *section.interiors)]


def _corners(entity: Any) -> list[complex]:
    if entity.dxftype() == "LINE":
        return [_place(entity.dxf.start), _place(entity.dxf.end)]
    if entity.dxftype() == "LWPOLYLINE":
        return [complex(x, y) for x, y in entity.get_points("xy")]
    if entity.dxftype() == "POLYLINE":
        return [_place(vertex.dxf.location) for vertex in entity.vertices]
    return []


def _place(vector: Any) -> complex:
    return complex(vector.x, vector.y)


def _index(place: complex, points: list[complex], near: float) -> int:
    for number, known in enumerate(points):
        if abs(known - place) <= near:
            return number
    points.append(place)
    return len(points) - 1


def _letter(number: int) -> str:
    return chr(ord("A") + number % 26) + ("" if number < 26 else str(number // 26))
