"""The tables and keys of a scene file: which numbers of it are to be swept."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from kinelast.scene.format_motion import Table

Entry = float | str


class RangeTable(Table, frozen=True, kw_only=True):
    """A number from one value to another, both included; `count` values of a grid."""

    start: Entry = field(name="from")
    end: Entry = field(name="to")
    count: Annotated[int, Meta(ge=2)] | None = None


class SweepTable(Table, frozen=True, kw_only=True):
    """Designs that differ in some numbers of the file by their paths, what is asked of them, and which is best."""

    vary: dict[str, RangeTable | Annotated[list[Entry], Meta(min_length=1)]] = field(default_factory=dict)
    method: Literal["grid", "latin-hypercube", "sobol"] = "grid"
    samples: Annotated[int, Meta(ge=1)] | None = None
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    table: str | None = None
    figures: list[str] = field(default_factory=list)
    smallest: str | None = None
    largest: str | None = None
