"""A kind of machine part: table, builder, figures, limits, symbol and description."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from msgspec import defstruct
from msgspec import field as entry

from kinelast.scene.figure import LEAST, Figure, Limit, RangeCheck, items_of
from kinelast.scene.numbers import real
from kinelast.scene.reading import Finding
from kinelast.scene.tables import Name, StrictTable
from kinelast.scene.units import Quantity
from rigid import Link, Load, Mechanism, Slider

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import MaterialTable, SceneTable
    from kinelast.scene.limits import Output
    from kinelast.scene.links import LinkModel
    from kinelast.scene.reading import Reader
    from kinelast.scene.sections import SectionSource
    from symbols import Mark

Built = TypeVar("Built")
ALONE = ""  # name of a part that has a single table in a scene


@dataclass(frozen=True)
class Assembly:
    """Input for the part builders: mechanism and tables.

    `beams` lists every beam by its link and its number in that link; `made_of` gives its section and material. `laws`
    contains a law or an effort for each drive; only laws are callable. `materials_of` finds materials by name, and
    `poisson_of` returns the Poisson's ratio of a material.
    """

    table: SceneTable
    mechanism: Mechanism
    beams: Sequence[tuple[LinkModel, int]]
    made_of: Sequence[SectionSource]
    materials: Mapping[str, MaterialTable]
    laws: Sequence[Any]
    duration: Any
    materials_of: Callable[[Iterable[str]], Mapping[str, MaterialTable]]
    poisson_of: Callable[[MaterialTable, str], Any]

    @property
    def links(self) -> dict[str, Link]:
        """Links of the scene file by name."""
        return {link.name: link for link in self.mechanism.links if link.name in self.table.links}

    @property
    def sliders(self) -> dict[str, Slider]:
        """Sliders and slots by name."""
        return {slider.name: slider for slider in self.mechanism.sliders}


@dataclass(frozen=True)
class Part(Generic[Built]):
    """A kind of machine part.

    Attributes
    ----------
    key
        Key of the part's tables in a scene, such as `stops`.
    words
        Description of that key.
    table
        Type of the table; None if the drive table contains the data.
    build
        Function from the mechanism and tables to the built parts by name; raises SceneError.
    figures
        Figures of the part. `Figure.limit` is the key of the table with its limit, such as `rolling.life`.
    row
        Function from the readings of a run and the name of a part to a row of the summary without the figures. None if
        there are no such rows.
    section
        Key of the part's rows in the summary, if different from `key`.
    of_output
        Figures that depend on the output of the machine.
    joint_row
        Function from the readings of a run and the number of a joint to entries of the joint's row in the summary.
    findings
        Function that yields the findings on its parts in a run.
    faults
        Function from a scene and the values of all items of the figures `needs` to reasons why its parts do not work,
        each with a flag of shape (...). If there are any, no limit can be judged.
    formulas
        Inputs of the formulas, in words; the stated errors do not include their uncertainty.
    columns
        Columns of positions.csv with units, by name.
    symbols
        Function from a scene to the marks of the part in the drawing.
    begin
        Function from the selection in the editor (its table and name) to the keys of a new part; None if the part needs
        another selection.
    menu
        Menu entry of the editor, with the required selection; empty if the editor adds the part otherwise.
    checks
        Validity ranges of the formulas.
    loads
        Function from the built parts to their loads on the mechanism.
    owned
        Function from tables and scene to its tables, by the names of the built parts, if the names differ.
    drive_row
        Key of the part's row in the summary of a drive; empty if it has no row.
    alone
        True if a scene has a single, unnamed table of it.
    on_axis
        True if its numbers can be arrays of designs.
    more_than_limits
        Keys that limit one figure and affect another.
    usual
        For each attribute of a built part: description, usual lower and upper bound, unit, and example.
    stand_in
        Replacement for an invalid table; None if no other table refers to such a part.
    """

    key: str
    words: str
    table: type[StrictTable] | None
    build: Callable[[Assembly], Mapping[str, Built]]
    figures: tuple[Figure, ...] = ()
    row: Callable[[Reader, str], Mapping[str, Any]] | None = None
    symbols: Callable[[Scene], Iterable[Mark]] = lambda _: ()
    begin: Callable[[str, str], Mapping[str, Any] | None] = lambda *_: {}
    menu: str = ""
    checks: tuple[RangeCheck, ...] = ()
    loads: Callable[[Assembly, Any], Iterable[Load]] = lambda *_: ()
    owned: Callable[[SceneTable, Scene], Mapping[str, Any]] | None = None
    drive_row: str = ""
    on_axis: bool = False
    alone: bool = False
    more_than_limits: tuple[str, ...] = ()
    usual: Mapping[str, tuple[str, float, float, str, str]] = field(default_factory=dict)
    stand_in: Mapping[str, Any] | None = None
    section: str = ""
    of_output: Callable[[Output | None], tuple[Figure, ...]] = lambda _: ()
    joint_row: Callable[[Reader, int], Mapping[str, Any]] = lambda *_: {}
    findings: Callable[[Reader], Iterable[Finding]] = lambda _: ()
    faults: Callable[[Scene, Mapping[str, Any]], Iterable[tuple[str, Any]]] = lambda *_: ()
    needs: Iterable[str] = ()
    formulas: str = ""
    columns: Callable[[Cycle], Mapping[str, tuple[Any, str]]] = lambda _: {}

    def tables(self, scene: SceneTable) -> Mapping[str, Any]:
        """Return its tables by name."""
        tables: Any = {} if self.table is None else getattr(scene, self.key)
        if self.alone:
            tables = {} if tables is None else {ALONE: tables}
        return dict(tables)

    def of(self, scene: Scene) -> Mapping[str, Built]:
        """Return the built parts of a scene by name."""
        return scene.parts[self.key]

    def rows(self, reader: Reader) -> dict[str, Any]:
        """Return the part's section of the summary, by key; empty if it has no rows."""
        if self.row is None:
            return {}
        keys = [figure.key for figure in self.figures]
        rows: dict[str, Any] = {}
        for name in self.of(reader.scene):
            figures = {} if self.alone else {"figures": reader.of_items(keys, name)}
            rows[name] = {**self.row(reader, name), **figures}
        return {self.section or self.key: rows.get(ALONE) if self.alone else rows}

    @cached_property
    def bounded(self) -> tuple[Figure, ...]:
        """Figures with a limit in its table, in the order of the table's keys."""
        keys = () if self.table is None else self.table.__struct_fields__
        figures = (each for each in self.figures if each.limit and hasattr(self.table, each.limit.partition(".")[0]))
        return tuple(sorted(figures, key=lambda each: keys.index(each.limit) if each.limit in keys else len(keys)))

    def limits(self, table: SceneTable, scene: Scene) -> Iterator[Limit]:
        """Yield the limits in its tables."""
        tables = self.tables(table) if self.owned is None else self.owned(table, scene)
        for name, own in tables.items():
            for each in self.bounded:
                value, unit = _value(own, each.limit), _unit(each, scene, name)
                if value is not None and unit is not None:
                    bound = value.within(unit) if isinstance(value, Quantity) else real(value)
                    yield Limit(each.key, bound, each.over == LEAST, name, unit, each.of)

    def sets_limit(self, key: str) -> bool:
        """Return True if a table key only limits a figure; `required_KEY` is a limit with a default."""
        limits = key, f"required_{key}"
        return key not in self.more_than_limits and any(each.limit in limits for each in self.figures)


def _unit(figure: Figure, scene: Scene, item: str) -> str | None:
    """Return the unit of an item's figure; None if the item does not have the figure."""
    if isinstance(figure.unit, str):  # do not list the items, because the mechanism may be invalid
        return figure.unit
    return dict(zip(items_of(scene, figure.of), figure.units(scene), strict=True)).get(item)


def _value(table: Any, path: str) -> Any:
    """Return the value at a dotted key; None if it is missing."""
    for key in path.split("."):
        table = None if table is None else getattr(table, key)
    return table


def with_parts(table: type[StrictTable], name: str, parts: Iterable[Part[Any]]) -> type[StrictTable]:
    """Return a table type extended by the tables of parts."""
    known: list[tuple[Part[Any], Any]] = [(part, part.table) for part in parts if part.table is not None]
    by_name: Any = dict
    fields: list[Any] = [
        (part.key, own | None, None) if part.alone else (part.key, by_name[Name, own], entry(default_factory=dict))
        for part, own in known
    ]
    words = {part.key: part.words for part, _ in known}
    namespace = {"__doc__": table.__doc__, "key_words": words}
    made = defstruct(name, fields, bases=(table,), namespace=namespace, module=table.__module__, frozen=True,
                     forbid_unknown_fields=True, kw_only=True)  # fmt: skip
    return made  # type: ignore[return-value]
