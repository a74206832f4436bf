"""A part of a machine: its table, its builder, its figures and their limits, its symbol and its words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from msgspec import defstruct
from msgspec import field as entry

from kinelast.scene.figure import LEAST, Figure, Limit, RangeCheck, items_of
from kinelast.scene.finding import Finding
from kinelast.scene.numbers import real
from kinelast.scene.tables import Name, StrictTable
from kinelast.scene.units import Quantity
from rigid import Link, Load, Mechanism, Slider

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.figures.reader import Reader
    from kinelast.scene.data import Scene
    from kinelast.scene.format import MaterialTable, SceneTable
    from kinelast.scene.limits import Output
    from kinelast.scene.links import LinkModel
    from kinelast.scene.sections import SectionSource

Built = TypeVar("Built")
ALONE = ""  # name of a part of which a scene has a single table


@dataclass(frozen=True)
class Assembly:
    """The mechanism and the tables for which parts are built.

    `beams`: every beam by its link and its number there; `made_of`: its section and material. `laws`: of the drives;
    efforts cannot be called. `materials_of`, `poisson_of`: materials by name, and Poisson's ratio of one.
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
        """Links that the scene names."""
        return {link.name: link for link in self.mechanism.links if link.name in self.table.links}

    @property
    def sliders(self) -> dict[str, Slider]:
        """Sliders and slots by name."""
        return {slider.name: slider for slider in self.mechanism.sliders}


class Stroke(NamedTuple):
    """A line of a symbol through `points` in the axes of a link [m]."""

    link: str
    points: Sequence[complex]


@dataclass(frozen=True)
class Part(Generic[Built]):
    """A kind of part.

    Attributes
    ----------
    key
        Name of its tables in a scene, as in `stops`.
    words
        Description of that entry of the scene.
    table
        Table of one such part; None if a drive holds its data.
    build
        From the mechanism and the tables to the built parts by name; raises SceneError.
    figures
        Its figures. `Figure.limit` names the key of the table that bounds one, as `life` or `rolling.life`.
    row
        From the readings of a run and the name of a part to its row in the summary, besides its figures. None without
        such rows.
    section
        Key of its rows in the summary, if it is not `key`.
    of_output
        Figures that depend on the output of the machine.
    joint_row
        From the readings of a run and the number of a joint to entries of the joint's row in the summary.
    findings
        Findings on its parts in a run.
    faults
        From a scene and values of all items of the figures `needs` to reasons why its parts do not work, each with a
        flag of shape (...): then no limit can be judged.
    formulas
        Inputs of its formulas, in words, that the stated errors do not cover.
    columns
        Columns of positions.csv with units, by name.
    strokes
        Its symbol in a scene.
    begin
        From the table and the name of what is chosen in the editor to the keys of a new part; None if it needs another
        choice.
    menu
        Name of a new part and of what has to be chosen for it; empty if the editor adds it otherwise.
    checks
        Ranges of its formulas.
    loads
        Loads of the built parts on the mechanism.
    owned
        From the tables and the scene to its tables by the names of the built parts, if these are not the tables' names.
    drive_row
        Key of its row in the summary of its drive; empty if it has none.
    alone
        Whether a scene has a single table of it, without a name.
    on_axis
        Whether its numbers can be arrays of designs.
    more_than_limits
        Keys that bound one figure and change another.
    usual
        By attribute of a built part: its name in words, usual least and most, their unit, and an example.
    stand_in
        Table in place of one with mistakes; None if nothing names such a part.
    """

    key: str
    words: str
    table: type[StrictTable] | None
    build: Callable[[Assembly], Mapping[str, Built]]
    figures: tuple[Figure, ...] = ()
    row: Callable[[Reader, str], Mapping[str, Any]] | None = None
    strokes: Callable[[Scene], Iterable[Stroke]] = lambda _: ()
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
        """Its tables by name."""
        tables: Any = {} if self.table is None else getattr(scene, self.key)
        if self.alone:
            tables = {} if tables is None else {ALONE: tables}
        return dict(tables)

    def of(self, scene: Scene) -> Mapping[str, Built]:
        """The built parts of a scene by name."""
        return scene.parts[self.key]

    def rows(self, reader: Reader) -> dict[str, Any]:
        """Its section of the summary, by key; empty if it has none."""
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
        """Figures that its table bounds, in the order of the table's keys."""
        keys = () if self.table is None else self.table.__struct_fields__
        figures = (each for each in self.figures if each.limit and hasattr(self.table, each.limit.partition(".")[0]))
        return tuple(sorted(figures, key=lambda each: keys.index(each.limit) if each.limit in keys else len(keys)))

    def limits(self, table: SceneTable, scene: Scene) -> Iterator[Limit]:
        """Limits that its tables set."""
        tables = self.tables(table) if self.owned is None else self.owned(table, scene)
        for name, own in tables.items():
            for each in self.bounded:
                value, unit = _value(own, each.limit), _unit(each, scene, name)
                if value is not None and unit is not None:
                    bound = value.within(unit) if isinstance(value, Quantity) else real(value)
                    yield Limit(each.key, bound, each.over == LEAST, name, unit, each.of)

    def sets_limit(self, key: str) -> bool:
        """Whether a key of its table bounds a figure, and changes nothing else."""
        return key not in self.more_than_limits and any(each.limit == key for each in self.figures)


def _unit(figure: Figure, scene: Scene, item: str) -> str | None:
    """Unit of an item's figure; None if the figure is not of this item."""
    if isinstance(figure.unit, str):  # without the items, which the joints of a wrong mechanism do not have
        return figure.unit
    return dict(zip(items_of(scene, figure.of), figure.units(scene), strict=True)).get(item)


def _value(table: Any, path: str) -> Any:
    """Value under a key, or under the key of a table in it; None if there is none."""
    for key in path.split("."):
        table = None if table is None else getattr(table, key)
    return table


def with_parts(table: type[StrictTable], name: str, parts: Iterable[Part[Any]]) -> type[StrictTable]:
    """A table that also has the tables of parts, by their keys."""
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
