"""Mechanisms in Python: typed parts that correspond to the tables of a scene file.

A class such as `Link` corresponds to a table of a scene file, and the fields of the class to the keys of the table. A
field accepts an object (such as a point, link or section) instead of the name of the object. The classes are created
from the tables of `kinelast.scene` at import. A wheel also contains a stub with all classes, for type checkers and
editors.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields, make_dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from kinelast.scene.document import Document, document_from_text
from kinelast.scene.format import SceneTable
from kinelast.scene.schema import TableClass, table_classes

Quantity = float | str  # in SI units, or with a unit, such as "6 mm"
Place = Sequence[Quantity]  # x and y
Direction = Sequence[float] | str
Rows = Sequence[Sequence[Quantity]] | NDArray[Any]  # rows of a table with two columns


@dataclass(frozen=True, eq=False, repr=False)
class TypedPart:
    """A part of a mechanism. Each field with a value becomes a key in the scene file.

    `under` is the top-level table that contains the part, or "" if the part belongs to another part. `spelled` contains
    the keys that are not valid Python names, by field name.
    """

    under: ClassVar[str] = ""
    spelled: ClassVar[Mapping[str, str]] = {}

    def keys(self) -> dict[str, Any]:
        """Return the keys with their values, without keys that have no value. A value may be another part."""
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "name"}
        return {self.spelled.get(key, key): value for key, value in given.items() if value is not None}

    def __repr__(self) -> str:
        keys = (f"{key}={_written(value)!r}" for key, value in self.keys().items())
        return f"{type(self).__name__}({', '.join(keys)})"


@dataclass(frozen=True, eq=False, repr=False)
class NamedPart(TypedPart):
    """A part with a name. A joint, weld or bearing has the name of its point or slider."""

    name: TypedPart | str

    def __repr__(self) -> str:
        return f'{type(self).__name__}("{_name(self)}")'


@dataclass(frozen=True, eq=False, repr=False)
class SectionPart(NamedPart):
    """A cross-section of beams."""

    under: ClassVar[str] = "sections"
    shape: ClassVar[str]

    def keys(self) -> dict[str, Any]:
        """Return the shape and its dimensions."""
        return {"shape": self.shape, **super().keys()}


class ListedPart(TypedPart):
    """An unnamed part in a list."""


@dataclass(frozen=True, eq=False, repr=False)
class Point(NamedPart):
    """A point of the drawing. The drawing shows the mechanism near the start of the motion."""

    under: ClassVar[str] = "points"
    x: Quantity
    y: Quantity


@dataclass(frozen=True, eq=False, repr=False)
class PointMass(NamedPart):
    """A point mass on the first moving link that contains the point."""

    under: ClassVar[str] = "masses"
    mass: Quantity


def mechanism(
    *parts: TypedPart,
    name: str = "scene",
    title: str | None = None,
    source: str | None = None,
    units: Literal["m", "cm", "mm", "in"] | None = None,
    structure_only: bool | None = None,
) -> Document:
    """Return the document of a mechanism, as if the document were read from a file.

    Parameters
    ----------
    parts
        Parts in the order of the file. Points, sections and other parts to which they refer are included automatically.
    name
        Name of the scene.
    title, source, units, structure_only
        Top-level keys of a scene file.

    Raises
    ------
    SceneError
        A part is invalid.
    TypeError, ValueError
        An argument is not a part, or two different parts of the same kind have the same name.

    Examples
    --------
    >>> O, A = Point("O", 0, 0), Point("A", 0.2, 0)
    >>> bar = Rectangle("bar", depth="6 mm", width="10 mm")
    >>> arm = Link("arm", [O, A], section=bar, material=Material("steel", E="210 GPa", density=7850))
    >>> mechanism(Link("ground", [O]), arm, Drive(link=arm, speed="600 rpm"), name="arm").scene
    Scene("arm": 2 links, 1 beam, 1 drive, 360 positions)
    """
    import tomlkit

    head = {"title": title, "source": source, "units": units, "structure_only": structure_only}
    tables: dict[str, Any] = {key: value for key, value in head.items() if value is not None}
    for part in {id(part): part for each in parts for part in _with_references(each)}.values():
        if part.under:
            _put(tables, part)
    order = SceneTable.__struct_fields__
    text = tomlkit.dumps({key: tables[key] for key in sorted(tables, key=order.index)})
    return document_from_text(text, name)


def _with_references(value: Any) -> Iterator[TypedPart]:
    """Yield all parts to which a part refers directly or indirectly, and then the part itself."""
    if not isinstance(value, TypedPart):
        raise TypeError(f"expected a part, such as Link(...) or Drive(...), got {value!r}")
    for each in (getattr(value, "name", None), *value.keys().values()):
        for part in _parts_in(each):
            yield from _with_references(part)
    yield value


def _parts_in(value: Any) -> Iterator[TypedPart]:
    if isinstance(value, TypedPart):
        yield value
    elif isinstance(value, Mapping):
        yield from (part for each in (*value, *value.values()) for part in _parts_in(each))
    elif isinstance(value, list | tuple):
        yield from (part for each in value for part in _parts_in(each))


def _put(tables: dict[str, Any], part: TypedPart) -> None:
    """Add a part to the tables of a scene file."""
    content = _written(part.keys())
    if isinstance(part, ListedPart):
        tables.setdefault(part.under, []).append(content)
        return
    if isinstance(part, Point | PointMass):
        content = [_written(each) for each in (part.x, part.y)] if isinstance(part, Point) else _written(part.mass)
        if content is None or (isinstance(content, list) and None in content):
            raise ValueError(f'the {type(part).__name__} "{_name(part)}" has no number for {_missing(part)}')
    there, name = (
        (tables.setdefault(part.under, {}), _name(part)) if isinstance(part, NamedPart) else (tables, part.under)
    )
    if there.setdefault(name, content) != content:
        raise ValueError(f'there are two "{name}" under [{part.under}], with different keys')


def _missing(part: TypedPart) -> str:
    """Return the name of the first field of a part that has no value."""
    return next(each.name for each in fields(part) if getattr(part, each.name) is None)


def _name(part: TypedPart | str) -> str:
    """Return the name of a part in a scene file."""
    return _name(part.name) if isinstance(part, NamedPart) else str(part)


def _written(value: Any) -> Any:
    """Convert a value to the form used in scene files. Named parts become names, and arrays become lists."""
    if isinstance(value, NamedPart):
        return _name(value)
    if isinstance(value, TypedPart):
        return _written(value.keys())
    if isinstance(value, Mapping):
        return {_name(key): _written(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_written(each) for each in value]
    if isinstance(value, complex):
        return [float(value.real), float(value.imag)]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


# The code below creates the classes from the tables.


def _made(table: TableClass) -> type:
    """Return the dataclass of a table."""
    optional: list[tuple[str, Any, Any]] = [
        (key, f"{kind} | None", field(default=None)) for key, kind in table.optional.items()
    ]
    return make_dataclass(
        table.name,
        [*table.required.items(), *([("_", KW_ONLY)] if optional else []), *optional],
        bases=(globals()[table.base],),
        namespace={"__doc__": table.doc, "__module__": __name__, **table.constants},
        frozen=True,
        eq=False,
        repr=False,
    )


def stub_text() -> str:
    """Return the stub of this module: its hand-written classes and functions, followed by all table classes."""
    from inspect import getsource

    written_by_hand = getsource(sys.modules[__name__]).partition("\n\n\n# The code below creates")[0]
    classes = "\n\n\n".join(table.source() for table in table_classes())
    return f"{written_by_hand}\n\n\n{classes}\n\n\n__all__ = {__all__!r}\n"


_TABLES = {table.name: _made(table) for table in table_classes()}
globals().update(_TABLES)
__all__ = ["Point", "PointMass", "TypedPart", "mechanism"]
__all__.extend(_TABLES)


def __getattr__(name: str) -> Any:
    """Raise AttributeError. If there is no stub, type checkers accept any name because this function exists."""
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
