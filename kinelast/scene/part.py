"""A part of a machine: its table, its builder, its figures and their limits, its symbol and its words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from msgspec import defstruct, field

from kinelast.scene.figure import LEAST, Figure, Limit, items_of
from kinelast.scene.numbers import real
from kinelast.scene.tables import Name, StrictTable
from kinelast.scene.units import Quantity
from rigid import Link, Mechanism, Slider

if TYPE_CHECKING:
    from kinelast.scene.data import Scene
    from kinelast.scene.format import SceneTable

Built = TypeVar("Built")


@dataclass(frozen=True)
class Assembly:
    """The mechanism and the tables for which parts are built."""

    table: SceneTable
    mechanism: Mechanism

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
        Table of one such part.
    build
        From the tables by name and the mechanism to the built parts by name; raises SceneError.
    figures
        Its figures. `Figure.limit` names the key of the table that bounds one.
    facts
        Data of a part that the summary states besides its figures: texts, or values with their SI units.
    strokes
        Its symbol in a scene.
    begin
        From the table and the name of what is chosen in the editor to the keys of a new part; None if it needs another
        choice.
    menu
        Name of a new part and of what has to be chosen for it.
    """

    key: str
    words: str
    table: type[StrictTable]
    build: Callable[[Mapping[str, Any], Assembly], Mapping[str, Built]]
    figures: tuple[Figure, ...] = ()
    facts: Callable[[Built], Mapping[str, str | tuple[Any, str]]] = lambda _: {}
    strokes: Callable[[Scene], Iterable[Stroke]] = lambda _: ()
    begin: Callable[[str, str], Mapping[str, Any] | None] = lambda *_: {}
    menu: str = ""

    def tables(self, scene: SceneTable) -> Mapping[str, Any]:
        """Its tables by name."""
        tables: Mapping[str, Any] = getattr(scene, self.key)
        return tables

    def of(self, scene: Scene) -> Mapping[str, Built]:
        """The built parts of a scene by name."""
        return scene.parts[self.key]

    def limits(self, table: SceneTable, scene: Scene) -> Iterator[Limit]:
        """Limits that its tables set."""
        bounded = [each for each in self.figures if each.limit]
        units = {each.key: dict(zip(items_of(scene, each.of), each.units(scene), strict=True)) for each in bounded}
        for name, own in self.tables(table).items():
            for each in bounded:
                value = getattr(own, each.limit)
                if value is not None and name in units[each.key]:
                    unit = units[each.key][name]
                    bound = value.within(unit) if isinstance(value, Quantity) else real(value)
                    yield Limit(each.key, bound, each.over == LEAST, name, unit, each.of)


def with_parts(table: type[StrictTable], name: str, parts: Iterable[Part[Any]]) -> type[StrictTable]:
    """A table that also has the tables of parts, by their keys."""
    fields: list[Any] = [(part.key, dict[Name, part.table], field(default_factory=dict)) for part in parts]  # type: ignore[name-defined]
    words = {part.key: part.words for part in parts}
    namespace = {"__doc__": table.__doc__, "key_words": words}
    made = defstruct(name, fields, bases=(table,), namespace=namespace, module=table.__module__, frozen=True,
                     forbid_unknown_fields=True, kw_only=True)  # fmt: skip
    return made  # type: ignore[return-value]
