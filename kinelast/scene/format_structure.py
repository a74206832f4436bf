"""The tables and keys of a scene file that describes structure alone: contacts, and joints in space."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, field

from kinelast.scene.format_motion import LengthUnit, Name, Place, Table
from kinelast.scene.quantities import Direction, Length

Part = Annotated[float, Meta(ge=-1e9, le=1e9)]


class ContactTable(Table, frozen=True, kw_only=True):
    """Two links that touch: they roll on each other, or slip along the tangent where a normal is given."""

    links: tuple[str, str]
    at: Place
    normal: Direction | None = None


class SpatialJointTable(Table, frozen=True, kw_only=True):
    """A joint between two links in space."""

    links: tuple[str, str]
    type: str
    at: tuple[Length, Length, Length] | None = None
    axis: tuple[Part, Part, Part] | None = None
    normal: tuple[Part, Part, Part] | None = None
    pitch: Length | None = None


class ChainTable(Table, frozen=True, kw_only=True):
    """A chain of joints in space, of which the structure is asked."""

    title: str = ""
    source: str = ""
    units: LengthUnit = "m"
    fixed: str | None = None
    joints: dict[Name, SpatialJointTable] = field(default_factory=dict)
