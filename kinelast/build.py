"""A mechanism from Python: parts as typed values, which write the tables of a scene's file.

Below the line every class is a table of the format and its fields are the table's keys; `python tests/test_build.py`
writes them anew. Where a file has the name of a point, a link or a section, a part has the point, link or section.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, fields
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from kinelast.scene.document import Document, document_from_text
from kinelast.scene.format import SceneTable

Quantity = float | str  # in SI units, or with its unit, as in "6 mm"
Place = Sequence[Quantity]  # x and y
Direction = Sequence[float] | str
Rows = Sequence[Sequence[Quantity]] | NDArray[Any]  # of two columns


@dataclass(frozen=True, eq=False, repr=False)
class Part:
    """A part of a mechanism: its fields that are not None are keys of a table.

    `under`: the table of the top level where it stands; empty inside others. `spelled`: keys that are no names in
    Python, by their fields.
    """

    under: ClassVar[str] = ""
    spelled: ClassVar[Mapping[str, str]] = {}

    def keys(self) -> dict[str, Any]:
        """The keys of its table that are given, with values that still are parts."""
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "name"}
        return {self.spelled.get(key, key): value for key, value in given.items() if value is not None}

    def __repr__(self) -> str:
        told = (f"{key}={_written(value)!r}" for key, value in self.keys().items())
        return f"{type(self).__name__}({', '.join(told)})"


@dataclass(frozen=True, eq=False, repr=False)
class Named(Part):
    """A part that others name; a joint, a weld and a bearing are named by their point, or slider."""

    name: Part | str

    def __repr__(self) -> str:
        return f'{type(self).__name__}("{_name(self)}")'


@dataclass(frozen=True, eq=False, repr=False)
class Section(Named):
    """A cross-section of beams."""

    under: ClassVar[str] = "sections"
    shape: ClassVar[str]

    def keys(self) -> dict[str, Any]:
        """The shape and its dimensions."""
        return {"shape": self.shape, **super().keys()}


class Listed(Part):
    """A part that has no name, of which there may be several."""


@dataclass(frozen=True, eq=False, repr=False)
class Point(Named):
    """A point where the drawing has it, near where the mechanism starts."""

    under: ClassVar[str] = "points"
    x: Quantity
    y: Quantity


@dataclass(frozen=True, eq=False, repr=False)
class PointMass(Named):
    """A mass at a point, of the first moving link that has it."""

    under: ClassVar[str] = "masses"
    mass: Quantity


def mechanism(
    *parts: Part,
    name: str = "scene",
    title: str | None = None,
    source: str | None = None,
    units: Literal["m", "cm", "mm", "in"] | None = None,
    structure_only: bool | None = None,
) -> Document:
    """The document of a mechanism: the file that its parts write, read like any other.

    Parameters
    ----------
    parts
        In their order; those that they name, points, sections and so on, come with them.
    title, source, units, structure_only
        As in a file.

    Raises
    ------
    SceneError
        A part holds a mistake.
    TypeError, ValueError
        What is given is no part; two parts of a kind have one name.

    Examples
    --------
    >>> O, A = Point("O", 0, 0), Point("A", 0.2, 0)
    >>> bar = Rectangle("bar", depth="6 mm", width="10 mm")
    >>> arm = Link("arm", [O, A], section=bar, material=Material("steel", E="210 GPa", density=7850))
    >>> mechanism(Link("ground", [O]), arm, Drive(link=arm, speed="600 rpm"), name="arm").scene
    Scene("arm": 2 links, 1 beam, 1 drive, 360 positions)
    """
    import tomlkit

    head = {"title": title, "source": source, "units": units, "structure_only": structure_only}
    tables: dict[str, Any] = {key: value for key, value in head.items() if value is not None}
    for part in {id(part): part for each in parts for part in _with_those_it_names(each)}.values():
        if part.under:
            _put(tables, part)
    order = SceneTable.__struct_fields__
    text = tomlkit.dumps({key: tables[key] for key in sorted(tables, key=order.index)})
    return document_from_text(text, name)


def _with_those_it_names(value: Any) -> Iterator[Part]:
    """A part behind the parts that it names."""
    if not isinstance(value, Part):
        raise TypeError(f"a mechanism is made of parts, as Link(...) or Drive(...), not of {value!r}")
    for each in (getattr(value, "name", None), *value.keys().values()):
        for part in _parts_in(each):
            yield from _with_those_it_names(part)
    yield value


def _parts_in(value: Any) -> Iterator[Part]:
    if isinstance(value, Part):
        yield value
    elif isinstance(value, Mapping):
        yield from (part for each in (*value, *value.values()) for part in _parts_in(each))
    elif isinstance(value, list | tuple):
        yield from (part for each in value for part in _parts_in(each))


def _put(tables: dict[str, Any], part: Part) -> None:
    """Put a part's table where it stands."""
    content = _written(part.keys())
    if isinstance(part, Listed):
        tables.setdefault(part.under, []).append(content)
        return
    if isinstance(part, Point | PointMass):
        content = [_written(each) for each in (part.x, part.y)] if isinstance(part, Point) else _written(part.mass)
        if content is None or (isinstance(content, list) and None in content):
            raise ValueError(f'the {type(part).__name__} "{_name(part)}" has no number for {_lacks(part)}')
    there, name = (tables.setdefault(part.under, {}), _name(part)) if isinstance(part, Named) else (tables, part.under)
    if there.setdefault(name, content) != content:
        raise ValueError(f'there are two "{name}" under [{part.under}], with different keys')


def _lacks(part: Part) -> str:
    """The first key of a part that is None."""
    return next(each.name for each in fields(part) if getattr(part, each.name) is None)


def _name(part: Part | str) -> str:
    """The name of a part as it stands in a file."""
    return _name(part.name) if isinstance(part, Named) else str(part)


def _written(value: Any) -> Any:
    """A value as it stands in the tables of a file: names of parts, lists, plain numbers."""
    if isinstance(value, Named):
        return _name(value)
    if isinstance(value, Part):
        return _written(value.keys())
    if isinstance(value, Mapping):
        return {_name(key): _written(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_written(each) for each in value]
    if isinstance(value, complex):
        return [float(value.real), float(value.imag)]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def __dir__() -> list[str]:
    return sorted(__all__)


# The tables of kinelast.scene.format, written by python tests/test_build.py.


@dataclass(frozen=True, eq=False, repr=False)
class Material(Named):
    """The material of links."""

    under: ClassVar[str] = "materials"
    spelled: ClassVar[Mapping[str, str]] = {"yield_stress": "yield"}
    E: Quantity
    density: Quantity
    _: KW_ONLY
    poisson: float | None = None
    G: Quantity | None = None
    yield_stress: Quantity | None = None
    expansion: Quantity | None = None
    damping: Quantity | None = None
    ultimate: Quantity | None = None
    endurance: Quantity | None = None
    slope: float | None = None
    knee: float | None = None
    second_knee: float | None = None
    second_slope: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Rectangle(Section):
    """A solid rectangle, `depth` in the plane of motion."""

    shape: ClassVar[str] = "rectangle"
    depth: Quantity | Sequence[Quantity]
    width: Quantity | Sequence[Quantity]


@dataclass(frozen=True, eq=False, repr=False)
class Circle(Section):
    """A solid circle."""

    shape: ClassVar[str] = "circle"
    diameter: Quantity | Sequence[Quantity]


@dataclass(frozen=True, eq=False, repr=False)
class Tube(Section):
    """A circular tube by its outer diameter, and its inner one or its wall."""

    shape: ClassVar[str] = "tube"
    outer: Quantity | Sequence[Quantity]
    _: KW_ONLY
    inner: Quantity | Sequence[Quantity] | None = None
    wall: Quantity | Sequence[Quantity] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Box(Section):
    """A hollow rectangle, `depth` in the plane of motion; `corner` is its outer radius."""

    shape: ClassVar[str] = "box"
    depth: Quantity | Sequence[Quantity]
    width: Quantity | Sequence[Quantity]
    wall: Quantity | Sequence[Quantity]
    _: KW_ONLY
    corner: Quantity | Sequence[Quantity] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class ISection(Section):
    """An I with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    shape: ClassVar[str] = "I"
    depth: Quantity | Sequence[Quantity]
    width: Quantity | Sequence[Quantity]
    web: Quantity | Sequence[Quantity]
    flange: Quantity | Sequence[Quantity]
    _: KW_ONLY
    fillet: Quantity | Sequence[Quantity] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class TSection(Section):
    """A T with its `web` in the plane of motion; `fillet` is the radius between web and flange."""

    shape: ClassVar[str] = "T"
    depth: Quantity | Sequence[Quantity]
    width: Quantity | Sequence[Quantity]
    web: Quantity | Sequence[Quantity]
    flange: Quantity | Sequence[Quantity]
    _: KW_ONLY
    fillet: Quantity | Sequence[Quantity] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Channel(Section):
    """A channel with its `web` in the plane of motion and its flanges to one side, held from twisting."""

    shape: ClassVar[str] = "channel"
    depth: Quantity | Sequence[Quantity]
    width: Quantity | Sequence[Quantity]
    web: Quantity | Sequence[Quantity]
    flange: Quantity | Sequence[Quantity]
    _: KW_ONLY
    fillet: Quantity | Sequence[Quantity] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Angle(Section):
    """An angle with a leg of `depth` in the plane of motion, free to bend sideways too; held from twisting."""

    shape: ClassVar[str] = "angle"
    depth: Quantity | Sequence[Quantity]
    width: Quantity | Sequence[Quantity]
    wall: Quantity | Sequence[Quantity]
    _: KW_ONLY
    fillet: Quantity | Sequence[Quantity] | None = None
    toe: Quantity | Sequence[Quantity] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Outline(Section):
    """Any outline, by its corners: in the plane of motion, then across it. Held from twisting."""

    shape: ClassVar[str] = "outline"
    _: KW_ONLY
    points: Sequence[Place] | None = None
    holes: Sequence[Sequence[Place]] | None = None
    drawing: str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Properties(Section):
    """Any shape: area, second moment of area, distance of the outermost fibre, area that resists shear."""

    shape: ClassVar[str] = "properties"
    A: Quantity
    I: Quantity  # noqa: E741
    _: KW_ONLY
    c: Quantity | None = None
    shear_area: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Rigidities(Section):
    """A beam without a material."""

    shape: ClassVar[str] = "rigidities"
    EA: Quantity
    EI: Quantity
    mass_per_length: Quantity
    _: KW_ONLY
    kGA: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Link(Named):
    """A link: its points, beams, masses and outline."""

    under: ClassVar[str] = "links"
    points: Sequence[Point | str] | Mapping[Any, Place]
    _: KW_ONLY
    length: Quantity | None = None
    section: Section | str | None = None
    material: Material | str | None = None
    beams: Sequence[Sequence[Point | str] | Beam] | None = None
    strain: float | None = None
    temperature: Quantity | None = None
    rigid: bool | None = None
    mass: Quantity | None = None
    center: Point | str | Place | None = None
    inertia: Quantity | None = None
    masses: Mapping[Any, Quantity] | None = None
    outline: Sequence[Point | str | Place] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Slider(Named):
    """A link that slides on another without turning."""

    under: ClassVar[str] = "sliders"
    link: Link | str
    through: Point | str
    direction: Direction
    _: KW_ONLY
    on: Link | str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Slot(Named):
    """A pin of one link in a straight slot of another."""

    under: ClassVar[str] = "slots"
    point: Point | str
    link: Link | str
    direction: Direction
    _: KW_ONLY
    on: Link | str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Weld(Named):
    """Links that are welded at a point, all that share it unless named."""

    under: ClassVar[str] = "welds"
    _: KW_ONLY
    links: Sequence[Link | str] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Contact(Named):
    """Two links that touch: they roll on each other, or slip along the tangent where a normal is given."""

    under: ClassVar[str] = "contacts"
    links: Sequence[Link | str]
    at: Place
    _: KW_ONLY
    normal: Direction | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Joint(Named):
    """Friction, compliance and misfit of a pin, slider or weld."""

    under: ClassVar[str] = "joints"
    _: KW_ONLY
    compliance: Quantity | None = None
    rotation: Quantity | None = None
    gap: Place | None = None
    turn: Quantity | None = None
    friction: float | None = None
    viscosity: Quantity | None = None
    radius: Quantity | None = None
    length: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Drive(Listed):
    """A drive: a pin or a slider, at constant speed, by a law or table, or by an effort."""

    under: ClassVar[str] = "drives"
    _: KW_ONLY
    link: Link | str | None = None
    on: Link | str | None = None
    slider: Slider | Slot | str | None = None
    at: Point | str | None = None
    start: Quantity | None = None
    speed: Quantity | None = None
    law: Sequence[Segment] | None = None
    motion: Rows | str | None = None
    repeat: bool | None = None
    effort: Quantity | None = None
    table: Rows | None = None
    against: Against | None = None
    interpolation: Literal["linear", "cubic"] | None = None
    extend: Literal["hold"] | None = None
    motor: Motor | str | None = None
    cylinder: Cylinder | str | None = None
    unevenness: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Motor(Named):
    """A motor with its gear, for the drives that name it; torques and inertias at the motor's shaft."""

    under: ClassVar[str] = "motors"
    _: KW_ONLY
    rated_torque: Quantity | None = None
    peak_torque: Quantity | None = None
    stall_torque: Quantity | None = None
    rated_speed: Quantity | None = None
    top_speed: Quantity | None = None
    rotor_inertia: Quantity | None = None
    gear_inertia: Quantity | None = None
    gear_ratio: Quantity | None = None
    efficiency: Quantity | None = None
    inertia_ratio: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(Named):
    """A hydraulic or pneumatic cylinder, for the sliding drives that name it."""

    under: ClassVar[str] = "cylinders"
    bore: Quantity
    _: KW_ONLY
    rod: Quantity | None = None
    length: Quantity | None = None
    E: Quantity | None = None
    pressure: Quantity | None = None
    flow: Quantity | None = None
    buckling_safety: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Cam(Named):
    """A cam that gives a drive its motion: found from the follower's, with its contact and the limits of that."""

    under: ClassVar[str] = "cams"
    follower: str
    centre: str | Place
    _: KW_ONLY
    roller: str | None = None
    roller_radius: Quantity | None = None
    face: Sequence[str] | None = None
    drive: str | None = None
    speed: Quantity | None = None
    flank: Literal["inner", "outer", "both"] | None = None
    push: bool | None = None
    width: Quantity | None = None
    material: Material | str | None = None
    follower_material: str | None = None
    pressure: Quantity | None = None
    pressure_angle: Quantity | None = None
    radius: Quantity | None = None
    hollow_radius: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Load(Listed):
    """A force or moment at a point, or a force along a beam."""

    under: ClassVar[str] = "loads"
    link: Link | str
    _: KW_ONLY
    point: Point | str | None = None
    force: Sequence[Quantity] | None = None
    moment: Quantity | None = None
    beam: Sequence[Point | str] | None = None
    start: Sequence[Quantity] | None = None
    end: Sequence[Quantity] | None = None
    axes: Literal["fixed", "turning"] | None = None
    resists: Literal["both ways", "one way"] | None = None
    table: Rows | None = None
    against: Against | None = None
    interpolation: Literal["linear", "cubic"] | None = None
    extend: Literal["hold"] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Gear(Listed):
    """Wheels, a rack, or without teeth a belt, that tie the coordinates of two joints."""

    under: ClassVar[str] = "gears"
    driver: JointName
    follower: JointName
    ratio: Quantity
    _: KW_ONLY
    pressure_angle: Quantity | None = None
    teeth: bool | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Spring(Listed):
    """A spring and damper between points of two links, or about the pin of two links."""

    under: ClassVar[str] = "springs"
    link: Link | str
    _: KW_ONLY
    on: Link | str | None = None
    point: Point | str | None = None
    anchor: Point | str | None = None
    length: Quantity | None = None
    at: Point | str | None = None
    angle: Quantity | None = None
    stiffness: Quantity | None = None
    damping: Quantity | None = None
    preload: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Bearing(Named):
    """The parts of a joint, at the pin or slider of that name; an empty one of a pin: force, swing and speed."""

    under: ClassVar[str] = "bearings"
    _: KW_ONLY
    rolling: Rolling | None = None
    plain: Plain | None = None
    pin: Pin | None = None
    eye: Eye | None = None
    clearance: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Fatigue(Part):
    """Fatigue of the links: criterion, reliability, and factors of all links and of single ones."""

    under: ClassVar[str] = "fatigue"
    _: KW_ONLY
    surface: Literal["polished", "ground", "machined", "hot-rolled", "as-forged"] | float | None = None
    size: float | None = None
    notches: Mapping[Any, float] | None = None
    criterion: Literal["goodman", "gerber", "soderberg"] | None = None
    reliability: float | None = None
    links: Mapping[Any, LinkFatigue] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Limits(Part):
    """Limits of the mechanism: of every link, of single links, and of its output."""

    under: ClassVar[str] = "limits"
    _: KW_ONLY
    deflection: Quantity | None = None
    chord: Quantity | None = None
    safety: float | None = None
    buckling: float | None = None
    endurance: float | None = None
    life: Quantity | None = None
    output: Quantity | None = None
    residual: Quantity | None = None
    settling: Quantity | None = None
    links: Mapping[Any, LinkLimits] | None = None
    figures: Mapping[Any, float | str | Bound] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Run(Part):
    """Which positions are computed, gravity, the theories of beams and of motion, and the output."""

    under: ClassVar[str] = "run"
    _: KW_ONLY
    positions: int | None = None
    duration: Quantity | None = None
    gravity: Sequence[Quantity] | None = None
    beams: Literal["euler-bernoulli", "timoshenko"] | None = None
    theory: Literal["quasi-static", "elastodynamic", "geometrically-exact"] | None = None
    accuracy: Quantity | None = None
    damping_ratio: float | None = None
    tolerance: float | None = None
    steps: int | None = None
    output: str | None = None
    settled: Quantity | None = None
    report_units: Literal["SI", "mm", "in"] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Part):
    """Designs that differ in some numbers of the file by their paths, their figures, and the choice of the best."""

    under: ClassVar[str] = "sweep"
    _: KW_ONLY
    vary: Mapping[Any, Range | Sequence[float | str]] | None = None
    method: Literal["grid", "latin-hypercube", "sobol"] | None = None
    samples: int | None = None
    seed: int | None = None
    table: str | None = None
    figures: Sequence[str] | None = None
    smallest: str | None = None
    largest: str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivities(Part):
    """Which figures' derivatives to which numbers are asked for; all that there are where none are named."""

    under: ClassVar[str] = "sensitivities"
    _: KW_ONLY
    figures: Sequence[str] | None = None
    numbers: Sequence[str] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Tolerance(Named):
    """How a number scatters about its value."""

    under: ClassVar[str] = "tolerances"
    plus_minus: float | str
    _: KW_ONLY
    distribution: Literal["uniform", "normal"] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Optimize(Part):
    """Which figure is to be made small or large, with which numbers, within which limits."""

    under: ClassVar[str] = "optimize"
    _: KW_ONLY
    variables: Mapping[Any, Sequence[float | str]] | None = None
    minimize: str | None = None
    maximize: str | None = None
    limits: Mapping[Any, float | str | Bound] | None = None
    path: Path | None = None
    method: Literal["search", "evolution"] | None = None
    seed: int | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Beam(Part):
    """A straight piece of a link."""

    spelled: ClassVar[Mapping[str, str]] = {"start": "from", "end": "to"}
    start: Point | str
    end: Point | str
    _: KW_ONLY
    section: Section | str | None = None
    material: Material | str | None = None
    strain: float | None = None
    temperature: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Segment(Part):
    """A piece of a drive's motion law."""

    curve: Literal[
        "dwell",
        "constant-speed",
        "harmonic",
        "cycloidal",
        "polynomial-345",
        "polynomial-4567",
        "trapezoidal-velocity",
        "constant-acceleration",
        "modified-trapezoid",
        "modified-sine",
    ]
    duration: Quantity
    _: KW_ONLY
    to: Quantity | None = None
    by: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Against(Part):
    """The coordinate that a table is against, if not time: the angle of a link, or a slide."""

    _: KW_ONLY
    link: Link | str | None = None
    on: Link | str | None = None
    slider: Slider | Slot | str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class JointName(Part):
    """A joint with a coordinate that a gear ties, named as a drive names its own."""

    _: KW_ONLY
    link: Link | str | None = None
    on: Link | str | None = None
    slider: Slider | Slot | str | None = None
    at: Point | str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Rolling(Part):
    """A rolling bearing, and the least that is asked of it."""

    C: Quantity
    _: KW_ONLY
    C0: Quantity | None = None
    type: Literal["ball", "roller"] | None = None
    reliability: Literal["90 %", "95 %", "96 %", "97 %", "98 %", "99 %"] | None = None
    condition: float | None = None
    elements: int | None = None
    life: Quantity | None = None
    safety: float | None = None
    least_load: Quantity | None = None
    least_overlap: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Plain(Part):
    """A plain bearing, and the most that its material allows."""

    width: Quantity
    _: KW_ONLY
    diameter: Quantity | None = None
    length: Quantity | None = None
    pressure: Quantity | None = None
    speed: Quantity | None = None
    pressure_speed: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Pin(Part):
    """A pin through an eye and two cheeks, or overhung from one, and its limits."""

    spelled: ClassVar[Mapping[str, str]] = {"yield_stress": "yield"}
    diameter: Quantity
    eye: Quantity
    _: KW_ONLY
    cheek: Quantity | None = None
    gap: Quantity | None = None
    overhung: bool | None = None
    yield_stress: Quantity | None = None
    shear: Quantity | None = None
    bending: Quantity | None = None
    safety: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Eye(Part):
    """The eye of a link, and its limits."""

    spelled: ClassVar[Mapping[str, str]] = {"yield_stress": "yield"}
    diameter: Quantity
    width: Quantity
    thickness: Quantity
    edge: Quantity
    _: KW_ONLY
    link: Link | str | None = None
    notch: float | None = None
    yield_stress: Quantity | None = None
    bearing: Quantity | None = None
    net: Quantity | None = None
    tear_out: Quantity | None = None
    safety: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class LinkFatigue(Part):
    """Factors of the endurance limit of a link, and the notch factors at its points."""

    _: KW_ONLY
    surface: Literal["polished", "ground", "machined", "hot-rolled", "as-forged"] | float | None = None
    size: float | None = None
    notches: Mapping[Any, float] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class LinkLimits(Part):
    """Limits of one link, by the figures that they bound: a quantity is the most allowed, a factor the least."""

    _: KW_ONLY
    deflection: Quantity | None = None
    chord: Quantity | None = None
    safety: float | None = None
    buckling: float | None = None
    endurance: float | None = None
    life: Quantity | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Bound(Part):
    """Bounds of a figure."""

    _: KW_ONLY
    most: float | str | None = None
    least: float | str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Range(Part):
    """A number from one value to another, both included; `count` values of a grid."""

    spelled: ClassVar[Mapping[str, str]] = {"start": "from", "end": "to"}
    start: float | str
    end: float | str
    _: KW_ONLY
    count: int | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Path(Part):
    """Where a point is to be, position by position of the run."""

    point: Point | str
    places: Sequence[Place]


__all__ = [
    "Against",
    "Angle",
    "Beam",
    "Bearing",
    "Bound",
    "Box",
    "Cam",
    "Channel",
    "Circle",
    "Contact",
    "Cylinder",
    "Drive",
    "Eye",
    "Fatigue",
    "Gear",
    "ISection",
    "Joint",
    "JointName",
    "Limits",
    "Link",
    "LinkFatigue",
    "LinkLimits",
    "Load",
    "Material",
    "Motor",
    "Optimize",
    "Outline",
    "Part",
    "Path",
    "Pin",
    "Plain",
    "Point",
    "PointMass",
    "Properties",
    "Range",
    "Rectangle",
    "Rigidities",
    "Rolling",
    "Run",
    "Segment",
    "Sensitivities",
    "Slider",
    "Slot",
    "Spring",
    "Sweep",
    "TSection",
    "Tolerance",
    "Tube",
    "Weld",
    "mechanism",
]
