"""The tables and keys of a scene file: limits of its answer, and studies of its designs."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from kinelast.scene.format_motion import Place, StrictTable
from kinelast.scene.quantities import Allowance, Size

Factor = Annotated[float, Meta(gt=0)]


class LinkLimitsTable(StrictTable, frozen=True, kw_only=True):
    """Limits of one link."""

    deflection: Size | None = None
    chord: Size | None = None
    safety: Factor | None = None


class LimitsTable(StrictTable, frozen=True, kw_only=True):
    """Limits of the mechanism: of every link, of single links, and of its output."""

    deflection: Size | None = None
    chord: Size | None = None
    safety: Factor | None = None
    output: Allowance | None = None
    links: dict[str, LinkLimitsTable] = field(default_factory=dict)


Entry = float | str


class RangeTable(StrictTable, frozen=True, kw_only=True):
    """A number from one value to another, both included; `count` values of a grid."""

    start: Entry = field(name="from")
    end: Entry = field(name="to")
    count: Annotated[int, Meta(ge=2)] | None = None


class SweepTable(StrictTable, frozen=True, kw_only=True):
    """Designs that differ in some numbers of the file by their paths, their figures, and the choice of the best."""

    vary: dict[str, RangeTable | Annotated[list[Entry], Meta(min_length=1)]] = field(default_factory=dict)
    method: Literal["grid", "latin-hypercube", "sobol"] = "grid"
    samples: Annotated[int, Meta(ge=1)] | None = None
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    table: str | None = None
    figures: list[str] = field(default_factory=list)
    smallest: str | None = None
    largest: str | None = None


Amount = float | str  # in the unit of the number or figure that it is for


class SensitivitiesTable(StrictTable, frozen=True, kw_only=True):
    """Which figures' derivatives to which numbers are asked for; all that there are where none are named."""

    figures: list[str] = field(default_factory=list)
    numbers: list[str] = field(default_factory=list)


class ToleranceTable(StrictTable, frozen=True, kw_only=True):
    """How a number scatters about its value."""

    plus_minus: Amount
    distribution: Literal["uniform", "normal"] = "uniform"


class BoundTable(StrictTable, frozen=True, kw_only=True):
    """Bounds of a figure."""

    most: Amount | None = None
    least: Amount | None = None


class PathTable(StrictTable, frozen=True, kw_only=True):
    """Where a point is to be, position by position of the run."""

    point: str
    places: Annotated[list[Place], Meta(min_length=1)]


class OptimizeTable(StrictTable, frozen=True, kw_only=True):
    """Which figure is to be made small or large, with which numbers, within which limits."""

    variables: dict[str, tuple[Amount, Amount]] = field(default_factory=dict)
    minimize: str | None = None
    maximize: str | None = None
    limits: dict[str, Amount | BoundTable] = field(default_factory=dict)
    path: PathTable | None = None
    method: Literal["search", "evolution"] = "search"
    seed: Annotated[int, Meta(ge=0)] = 0
