"""The tables and keys of a scene file: joints, drives and loads of the links."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

from kinelast.scene.quantities import (
    Abscissa,
    Angle,
    Compliance,
    Coordinate,
    Damping,
    Direction,
    Duration,
    Effort,
    Force,
    ForcePerLength,
    Length,
    Moment,
    Ratio,
    Size,
    Speed,
    Stiffness,
    Time,
    TurnCompliance,
)

Place = tuple[Length, Length]
Name = Annotated[str, Meta(pattern="^[A-Za-z0-9_-]+$")]
Curve = Literal["dwell", "constant-speed", "harmonic", "cycloidal", "polynomial-345", "polynomial-4567"]
LengthUnit = Literal["m", "cm", "mm", "in"]
PER_LENGTH = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
Interpolation = Literal["linear", "cubic"]


class StrictTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Any table of a scene."""


class SliderTable(StrictTable, frozen=True, kw_only=True):
    """A link that slides on another without turning."""

    link: str
    on: str = "ground"
    through: str
    direction: Direction


class SlotTable(StrictTable, frozen=True, kw_only=True):
    """A pin of one link in a straight slot of another."""

    point: str
    link: str
    on: str = "ground"
    direction: Direction


class WeldTable(StrictTable, frozen=True, kw_only=True):
    """Links that are welded at a point, all that share it unless named."""

    links: Annotated[list[str], Meta(min_length=2)] | None = None


class JointTable(StrictTable, frozen=True, kw_only=True):
    """Friction, compliance and misfit of a pin, slider or weld."""

    compliance: Compliance | None = None
    rotation: TurnCompliance | None = None
    gap: Place | None = None
    turn: Angle | None = None
    friction: Annotated[float, Meta(ge=0, le=10)] | None = None
    viscosity: Damping | None = None
    radius: Size | None = None
    length: Size | None = None


class SegmentTable(StrictTable, frozen=True, kw_only=True):
    """A piece of a drive's motion law."""

    curve: Curve
    duration: Duration
    to: Coordinate | None = None
    by: Coordinate | None = None


class AgainstTable(StrictTable, frozen=True, kw_only=True):
    """The coordinate that a table is against, if not time: the angle of a link, or a slide."""

    link: str | None = None
    on: str = "ground"
    slider: str | None = None


class DriveTable(StrictTable, frozen=True, kw_only=True):
    """A drive: a pin or a slider, at constant speed, by a law or table, or by an effort."""

    link: str | None = None
    on: str = "ground"
    at: str | None = None
    slider: str | None = None
    start: Coordinate | None = None
    speed: Speed | None = None
    law: Annotated[list[SegmentTable], Meta(min_length=1)] | None = None
    motion: Annotated[list[tuple[Time, Coordinate]], Meta(min_length=4)] | None = None
    repeat: bool = False
    effort: Effort | None = None
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None
    interpolation: Interpolation = "linear"
    extend: Literal["hold"] | None = None

    @property
    def turns(self) -> bool:
        """Whether the coordinate is an angle."""
        return self.slider is None


class JointNameTable(StrictTable, frozen=True, kw_only=True):
    """A joint with a coordinate that a gear ties, named as a drive names its own."""

    link: str | None = None
    on: str = "ground"
    at: str | None = None
    slider: str | None = None

    @property
    def turns(self) -> bool:
        """Whether the coordinate is an angle."""
        return self.slider is None


class GearTable(StrictTable, frozen=True, kw_only=True):
    """Wheels, a rack, or without teeth a belt, that tie the coordinates of two joints."""

    driver: JointNameTable
    follower: JointNameTable
    ratio: Ratio
    pressure_angle: Angle | None = None
    teeth: bool = True


class LoadTable(StrictTable, frozen=True, kw_only=True):
    """A force or moment at a point, or a force along a beam."""

    link: str
    point: str | None = None
    force: tuple[Force, Force] | None = None
    moment: Moment | None = None
    beam: tuple[str, str] | None = None
    start: tuple[ForcePerLength, ForcePerLength] | None = None
    end: tuple[ForcePerLength, ForcePerLength] | None = None
    axes: Literal["fixed", "turning"] = "fixed"
    resists: Literal["both ways", "one way"] | None = None
    table: Annotated[list[tuple[Abscissa, float]], Meta(min_length=2)] | None = None
    against: AgainstTable | None = None
    interpolation: Interpolation = "linear"
    extend: Literal["hold"] | None = None


class SpringTable(StrictTable, frozen=True, kw_only=True):
    """A spring and damper between points of two links, or about the pin of two links."""

    link: str
    on: str = "ground"
    point: str | None = None
    anchor: str | None = None
    length: Length | None = None
    at: str | None = None
    angle: Angle | None = None
    stiffness: Stiffness | None = None
    damping: Damping | None = None
    preload: Effort | None = None
