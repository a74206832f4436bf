"""Kinds of machine parts, each with its tables, builder, figures, limits, symbols and descriptions."""

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
ALONE = ""  # name of a part with a single, unnamed table


@dataclass(frozen=True)
class Assembly:
    """Input of the part builders: mechanism and tables.

    `beams` lists every beam by its link and its number in that link. `made_of` gives its section and material. `laws`
    contains a law or an effort for each drive. Only laws are callable. `materials_of` finds materials by name, and
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
        Key of the tables in a scene, such as `stops`.
    words
        Description of that key.
    table
        Type of the table; None if the data are in the table of the drive.
    build
        Function of the assembly that builds the parts, by name. It raises SceneError.
    figures
        Figures of the part. `Figure.limit` is the key of their limit in the table, such as `rolling.life`.
    row
        Function of the readings of a run and the name of a part that returns the part's row of the summary, without the
        figures. None if the summary has no such rows.
    section
        Key of the rows in the summary, if different from `key`.
    of_output
        Function that returns the figures for an output of the machine.
    joint_row
        Function of the readings of a run and the number of a joint that returns entries for the row of the joint in the
        summary.
    findings
        Function that yields the findings on the parts in a run.
    faults
        Function of a scene and the values of the figures `needs` that yields reasons why parts do not work, each with
        flags of shape (...). If a flag is set, no limit can be judged.
    formulas
        Description of the formulas. Stated errors do not include their uncertainty.
    columns
        Function that returns the columns of positions.csv with their units, by name.
    symbols
        Function that returns the marks of the parts in the drawing of a scene.
    begin
        Function that returns the keys of a new part for a selection in the editor, given by table and name. It returns
        None if the part needs another selection.
    menu
        Menu entry of the editor, with the required selection; empty if the part is not added by the menu.
    checks
        Validity ranges of the formulas.
    loads
        Function that returns the loads of the built parts on the mechanism.
    owned
        Function that returns the tables by the names of the built parts, if these differ from the names of the tables.
    drive_row
        Key of the part in the row of its drive in the summary; empty if it is not there.
    alone
        True if a scene has a single, unnamed table of this kind.
    on_axis
        True if the numbers in the tables can be arrays of designs.
    more_than_limits
        Keys that limit one figure and also affect another.
    usual
        Description, usual lower and upper bound, unit, and example of each attribute of a built part.
    stand_in
        Replacement for an invalid table; None if no table refers to such a part.
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
        """Return the tables of this kind in a scene by name."""
        tables: Any = {} if self.table is None else getattr(scene, self.key)
        if self.alone:
            tables = {} if tables is None else {ALONE: tables}
        return dict(tables)

    def of(self, scene: Scene) -> Mapping[str, Built]:
        """Return the built parts of a scene by name."""
        return scene.parts[self.key]

    def rows(self, reader: Reader) -> dict[str, Any]:
        """Return the section of the summary with the parts of this kind; empty if there are no rows."""
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
        """Figures that can be limited by a key of the table, in the order of the keys."""
        keys = () if self.table is None else self.table.__struct_fields__
        figures = (each for each in self.figures if each.limit and hasattr(self.table, each.limit.partition(".")[0]))
        return tuple(sorted(figures, key=lambda each: keys.index(each.limit) if each.limit in keys else len(keys)))

    def limits(self, table: SceneTable, scene: Scene) -> Iterator[Limit]:
        """Yield the limits in the tables of this kind."""
        tables = self.tables(table) if self.owned is None else self.owned(table, scene)
        for name, own in tables.items():
            for each in self.bounded:
                value, unit = _value(own, each.limit), _unit(each, scene, name)
                if value is not None and unit is not None:
                    bound = value.within(unit) if isinstance(value, Quantity) else real(value)
                    yield Limit(each.key, bound, each.over == LEAST, name, unit, each.of)

    def sets_limit(self, key: str) -> bool:
        """Return True if a key of the table only limits a figure. `required_KEY` stands for a limit with a default."""
        limits = key, f"required_{key}"
        return key not in self.more_than_limits and any(each.limit in limits for each in self.figures)


def _unit(figure: Figure, scene: Scene, item: str) -> str | None:
    """Return the unit of a figure of an item; None if the item does not have the figure."""
    if isinstance(figure.unit, str):  # do not list the items, because the mechanism may be invalid
        return figure.unit
    return dict(zip(items_of(scene, figure.of), figure.units(scene), strict=True)).get(item)


def _value(table: Any, path: str) -> Any:
    """Return the value at a dotted key; None if it is missing."""
    for key in path.split("."):
        table = None if table is None else getattr(table, key)
    return table


def with_parts(table: type[StrictTable], name: str, parts: Iterable[Part[Any]]) -> type[StrictTable]:
    """Return a table type that is extended by the tables of parts."""
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
