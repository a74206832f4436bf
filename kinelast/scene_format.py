"""The tables and keys of a scene file, and their published JSON Schema."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct, field

from kinelast.scene_quantities import (
    Acceleration,
    Area,
    AxialRigidity,
    BendingRigidity,
    Coordinate,
    Density,
    Direction,
    Duration,
    Force,
    ForcePerLength,
    Inertia,
    Length,
    Mass,
    MassPerLength,
    Moment,
    SecondMoment,
    Size,
    Speed,
    Stress,
    Time,
)
from kinelast.units import Quantity

Place = tuple[Length, Length]
Name = Annotated[str, Meta(pattern="^[A-Za-z0-9_-]+$")]
Curve = Literal["dwell", "constant-speed", "harmonic", "cycloidal", "polynomial-345", "polynomial-4567"]


class Table(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Any table of a scene."""


class MaterialTable(Table, frozen=True, kw_only=True):
    """What a link is made of."""

    E: Stress
    density: Density
    poisson: Annotated[float, Meta(gt=-1, le=0.5)] | None = None
    G: Stress | None = None
    yield_stress: Stress | None = field(default=None, name="yield")


class Rectangle(Table, frozen=True, kw_only=True, tag_field="shape", tag="rectangle"):
    """A solid rectangle, `depth` in the plane of motion."""

    depth: Size
    width: Size


class Circle(Table, frozen=True, kw_only=True, tag_field="shape", tag="circle"):
    """A solid circle."""

    diameter: Size


class Tube(Table, frozen=True, kw_only=True, tag_field="shape", tag="tube"):
    """A circular tube by its diameters."""

    outer: Size
    inner: Size


class Properties(Table, frozen=True, kw_only=True, tag_field="shape", tag="properties"):
    """Any shape: area, second moment of area, distance of the outermost fibre."""

    A: Area
    I: SecondMoment  # noqa: E741
    c: Size | None = None


class Rigidities(Table, frozen=True, kw_only=True, tag_field="shape", tag="rigidities"):
    """A beam without a material."""

    EA: AxialRigidity
    EI: BendingRigidity
    mass_per_length: MassPerLength


SectionTable = Rectangle | Circle | Tube | Properties | Rigidities


class BeamTable(Table, frozen=True, kw_only=True):
    """A straight piece of a link."""

    start: str = field(name="from")
    end: str = field(name="to")
    section: str | None = None
    material: str | None = None


class LinkTable(Table, frozen=True, kw_only=True):
    """A link: its points, and what it is made of."""

    points: list[str] | dict[str, Place]
    length: Size | None = None
    section: str | None = None
    material: str | None = None
    beams: list[tuple[str, str] | BeamTable] | None = None
    rigid: bool = False
    mass: Mass | None = None
    center: str | Place | None = None
    inertia: Inertia | None = None
    masses: dict[str, Mass] = field(default_factory=dict)
    outline: list[str | Place] = field(default_factory=list)


class SliderTable(Table, frozen=True, kw_only=True):
    """A link that slides on another without turning."""

    link: str
    on: str = "ground"
    through: str
    direction: Direction


class SegmentTable(Table, frozen=True, kw_only=True):
    """A piece of a drive's motion law."""

    curve: Curve
    duration: Duration
    to: Coordinate | None = None
    by: Coordinate | None = None


class DriveTable(Table, frozen=True, kw_only=True):
    """What moves the mechanism: a pin or a slider, at constant speed or by a law."""

    link: str | None = None
    on: str = "ground"
    at: str | None = None
    slider: str | None = None
    start: Coordinate | None = None
    speed: Speed | None = None
    law: Annotated[list[SegmentTable], Meta(min_length=1)] | None = None


class LoadTable(Table, frozen=True, kw_only=True):
    """A force or moment at a point, or a force along a beam."""

    link: str
    point: str | None = None
    force: tuple[Force, Force] | None = None
    moment: Moment | None = None
    beam: tuple[str, str] | None = None
    start: tuple[ForcePerLength, ForcePerLength] | None = None
    end: tuple[ForcePerLength, ForcePerLength] | None = None
    axes: Literal["fixed", "turning"] = "fixed"
    table: Annotated[list[tuple[Time, float]], Meta(min_length=2)] | None = None
    interpolation: Literal["linear", "cubic"] = "linear"
    extend: Literal["hold"] | None = None


class RunTable(Table, frozen=True, kw_only=True):
    """Which positions are computed, and gravity."""

    positions: Annotated[int, Meta(ge=1, le=10_000_000)] = 360
    duration: Duration | None = None
    gravity: tuple[Acceleration, Acceleration] | None = None


class SceneTable(Table, frozen=True, kw_only=True):
    """A planar mechanism of rigid and elastic links, its drives and loads."""

    title: str = ""
    source: str = ""
    materials: dict[Name, MaterialTable] = field(default_factory=dict)
    sections: dict[Name, SectionTable] = field(default_factory=dict)
    points: dict[Name, Place]
    links: dict[Name, LinkTable]
    sliders: dict[Name, SliderTable] = field(default_factory=dict)
    masses: dict[Name, Mass] = field(default_factory=dict)
    drives: Annotated[list[DriveTable], Meta(min_length=1)]
    loads: list[LoadTable] = field(default_factory=list)
    run: RunTable = field(default_factory=RunTable)


def read_quantity(kind: type, value: Any) -> Any:
    """A quantity from what stands in a file; msgspec's `dec_hook`."""
    if issubclass(kind, Quantity | Direction):
        return kind.read(value)
    raise NotImplementedError(kind)


def scene_schema() -> dict[str, Any]:
    """JSON Schema of a scene, for editors that complete TOML."""
    schema = msgspec.json.schema(SceneTable, schema_hook=_quantity_schema)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinelast scene",
        **_without_null(schema),
    }


def _quantity_schema(kind: type) -> dict[str, Any]:
    if issubclass(kind, Direction):
        number = {"type": "number"}
        pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
        return {"anyOf": [pair, {"type": "string"}], "description": kind.expected}
    if issubclass(kind, Quantity):
        number = {"type": "number"}
        if kind.above == 0:
            number["exclusiveMinimum"] = 0  # type: ignore[assignment]
        if kind.least == 0:
            number["minimum"] = 0  # type: ignore[assignment]
        text = f"{kind.expected}; a bare number is in {' or '.join(kind.units)}"
        return {"anyOf": [number, {"type": "string"}], "description": text}
    raise NotImplementedError(kind)


def _without_null(schema: Any) -> Any:
    """TOML has no null: what may be left out is left out."""
    if isinstance(schema, list):
        return [_without_null(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: _without_null(value) for key, value in schema.items() if not (key == "default" and value is None)}
    choices = [choice for choice in kept.get("anyOf", ()) if choice != {"type": "null"}]
    if "anyOf" in kept and len(choices) == 1:
        del kept["anyOf"]
        return {**choices[0], **kept}
    return {**kept, "anyOf": choices} if choices else kept


def schema_text() -> str:
    """The schema as it is published in scene.schema.json."""
    import json

    return json.dumps(scene_schema(), indent=2) + "\n"
