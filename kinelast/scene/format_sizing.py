"""The tables and keys of a scene file: what its numbers may scatter by, and what is to be made best."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from kinelast.scene.format_motion import Place, Table

Amount = float | str  # in the unit of the number or figure that it is for


class SensitivitiesTable(Table, frozen=True, kw_only=True):
    """Which figures' derivatives to which numbers are asked for; all that there are where none are named."""

    figures: list[str] = field(default_factory=list)
    numbers: list[str] = field(default_factory=list)


class ToleranceTable(Table, frozen=True, kw_only=True):
    """How a number scatters about its value."""

    plus_minus: Amount
    distribution: Literal["uniform", "normal"] = "uniform"


class BoundTable(Table, frozen=True, kw_only=True):
    """What a figure has to keep."""

    most: Amount | None = None
    least: Amount | None = None


class PathTable(Table, frozen=True, kw_only=True):
    """Where a point is to be, position by position of the run."""

    point: str
    places: Annotated[list[Place], Meta(min_length=1)]


class OptimizeTable(Table, frozen=True, kw_only=True):
    """Which figure is to be made small or large, with which numbers, within which limits."""

    variables: dict[str, tuple[Amount, Amount]] = field(default_factory=dict)
    minimize: str | None = None
    maximize: str | None = None
    limits: dict[str, Amount | BoundTable] = field(default_factory=dict)
    path: PathTable | None = None
    method: Literal["search", "evolution"] = "search"
    seed: Annotated[int, Meta(ge=0)] = 0
