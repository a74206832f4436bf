"""Kinds of machine parts, such as bearings and motors.

`Part` describes a kind: tables, builder, results, limits, symbols.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from msgspec import Struct, defstruct, field
from msgspec import field as entry

from kinelast.scene.tables import Name, StrictTable
from kinelast.values.figure import LEAST, Figure, Limit, RangeCheck, items_of
from kinelast.values.numbers import real
from kinelast.values.reading import Finding, Reader
from kinelast.values.units import Quantity
from rigid import Link, Load, Mechanism, Slider

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import MaterialTable, SceneTable
    from kinelast.scene.limits import Output
    from kinelast.scene.links import LinkModel
    from kinelast.scene.sections import SectionSource
    from symbols import Mark

Built = TypeVar("Built")
ALONE = ""  # name of a part such as `[fatigue]`, which has a single, unnamed table in a scene


class Assembly(Struct, frozen=True):
    """Input of the functions that build machine parts: the mechanism and the tables of the scene.

    For every beam, `beams` contains the link and the number of the beam in this link. `made_of` contains the section
    and the material of every beam. `laws` contains a law or an effort for each drive. A law is callable, an effort is
    not. `materials_of` finds materials by name, and `poisson_of` returns the Poisson's ratio of a material.
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


class Part(Generic[Built], Struct, frozen=True, dict=True):
    """A kind of machine part, such as bearings or motors.

    Attributes
    ----------
    key
        Key of the tables of this kind in a scene, such as `stops`.
    words
        Description of this key in the reference.
    table
        Type of a table of this kind; None if the data are in the table of the drive.
    build
        Function of an `Assembly` that returns the built parts by name. It raises SceneError.
    figures
        Figures of the part, i.e. results such as the life of a bearing. If the table of the part can limit a figure,
        `Figure.limit` is the key of this limit, such as `rolling.life`.
    row
        Function that returns the row of a part in the summary, without its figures. Its arguments are a `Reader` and
        the name of the part. None if the summary has no rows for such parts.
    section
        Key of the rows in the summary; empty if it is `key`.
    of_output
        Function that returns figures of the output of the machine.
    joint_row
        Function that returns entries for the row of a joint in the summary. Its arguments are a `Reader` and the number
        of the joint.
    findings
        Function of a `Reader` that yields findings on the parts.
    faults
        Function that yields possible reasons why parts do not work, each with flags that are true if the reason
        applies. If a flag is true, no limit can be judged. Its arguments are the scene and the values of the figures
        `needs`.
    formulas
        Description of the formulas that the part uses, because stated errors do not include the uncertainty of these
        formulas.
    columns
        Function that returns columns for positions.csv: values and unit, by name.
    symbols
        Function that returns the marks of the parts in the drawing of a scene.
    begin
        Function that returns the keys of a new part in the editor. Its arguments are the table and the name of the
        selected object. It returns None if the part cannot be added to this object.
    menu
        Menu entry of the editor, which also says what has to be selected. Empty if the menu does not add such parts.
    checks
        Checks whether formulas are used within their range of validity.
    loads
        Function that returns the loads of the built parts on the mechanism.
    owned
        Function that returns the tables by the names of the built parts. None if these are the names of the tables.
    drive_row
        Key of the part in the row of the drive in the summary; empty if the part does not appear there.
    alone
        True if a scene has a single, unnamed table of this kind.
    on_axis
        True if the numbers in the tables can be arrays of designs.
    more_than_limits
        Keys of the table that limit a figure but also affect another figure.
    usual
        For each attribute of a built part: description, smallest and largest usual value, unit, and example.
    stand_in
        Valid table that replaces an invalid one; None if no table refers to such a part.
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
        """Return the section of the summary on the parts of this kind, or an empty section if there are no rows."""
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
        """Figures that a key of the table can limit, in the order of the keys."""
        keys = () if self.table is None else self.table.__struct_fields__
        figures = (each for each in self.figures if each.limit and hasattr(self.table, each.limit.partition(".")[0]))
        return tuple(sorted(figures, key=lambda each: keys.index(each.limit) if each.limit in keys else len(keys)))

    def limits(self, table: SceneTable, scene: Scene) -> Iterator[Limit]:
        """Yield the limits that the tables of this kind contain."""
        tables = self.tables(table) if self.owned is None else self.owned(table, scene)
        for name, own in tables.items():
            for each in self.bounded:
                value, unit = _value(own, each.limit), _unit(each, scene, name)
                if value is not None and unit is not None:
                    bound = value.within(unit) if isinstance(value, Quantity) else real(value)
                    yield Limit(each.key, bound, each.over == LEAST, name, unit, each.of)

    def sets_limit(self, key: str) -> bool:
        """Return True if the only effect of a key of the table is to limit a figure.

        If the limit on the figure has a default value, `Figure.limit` is "required_" followed by the key.
        """
        limits = key, f"required_{key}"
        return key not in self.more_than_limits and any(each.limit in limits for each in self.figures)


def _unit(figure: Figure, scene: Scene, item: str) -> str | None:
    """Return the unit of a figure for the item named `item`, or None if the figure has no such item."""
    if isinstance(figure.unit, str):  # do not call `items_of`, because the mechanism may be invalid
        return figure.unit
    return dict(zip(items_of(scene, figure.of), figure.units(scene), strict=True)).get(item)


def _value(table: Any, path: str) -> Any:
    """Return the value in a table at a dotted key, such as "rolling.life", or None if there is no value."""
    for key in path.split("."):
        table = None if table is None else getattr(table, key)
    return table


def with_parts(table: type[StrictTable], parts: Iterable[Part[Any]]) -> type[StrictTable]:
    """Return the type `SceneTable`: the type `table` with the keys of the given kinds of machine parts added."""
    known: list[tuple[Part[Any], Any]] = [(part, part.table) for part in parts if part.table is not None]
    by_name: Any = dict
    fields: list[Any] = [
        (part.key, own | None, None) if part.alone else (part.key, by_name[Name, own], entry(default_factory=dict))
        for part, own in known
    ]
    words = {part.key: part.words for part, _ in known}
    namespace = {"__doc__": table.__doc__, "key_words": words}
    made = defstruct("SceneTable", fields, bases=(table,), namespace=namespace, module=table.__module__, frozen=True,
                     forbid_unknown_fields=True, kw_only=True)  # fmt: skip
    return made  # type: ignore[return-value]
