"""The registry of fields along a beam: key, symbol, name and unit of each, and the fields that it is made of.

Sampling, extremes, tables, diagrams, maps and meshes follow from it: a new field that is the greatest, or the root of a
sum of squares, of known ones is one entry here; one with a formula of its own takes a function in `elastic.derived`
besides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType


class Kind(Enum):
    """Kind of quantity that a field is."""

    LOAD = "load"
    FORCE = "section force"
    DISPLACEMENT = "displacement"
    STRESS = "stress"


@dataclass(frozen=True)
class Field:
    """A quantity along every beam.

    Attributes
    ----------
    key
        Its name in code, tables and files.
    symbol, name, unit
        As they are written beside its values.
    kind
        Quantity that it is.
    integral_of
        The field whose integral along the beam it is, but for a factor and a constant: N of q_x, M of V, w of phi.
    greatest_of
        Keys of the fields of which it is the one of greatest magnitude.
    root_of
        Weights and keys of the fields of whose squares' sum it is the root.
    signed
        Whether it may be negative: drawn to both sides of the beam, coloured on both sides of zero.
    main
        Whether it stands in tables and files unasked; the others are there for who names them.
    """

    key: str
    symbol: str
    name: str
    unit: str
    kind: Kind
    integral_of: str | None = None
    greatest_of: tuple[str, ...] = ()
    root_of: tuple[tuple[float, str], ...] = ()
    signed: bool = True
    main: bool = True

    @property
    def title(self) -> str:
        """The name as a heading; names of persons keep their own small letters."""
        return self.name if self.name.startswith("von ") else self.name.capitalize()

    @property
    def slug(self) -> str:
        """The name as a word of a command."""
        return self.name.lower().replace(" ", "-")


_ALL = (
    Field("q_x", "q_x", "longitudinal load", "N/m", Kind.LOAD),
    Field("q_y", "q_y", "transverse load", "N/m", Kind.LOAD),
    Field("N", "N", "axial force", "N", Kind.FORCE, integral_of="q_x"),
    Field("V", "V", "shear force", "N", Kind.FORCE, integral_of="q_y"),
    Field("M", "M", "bending moment", "N m", Kind.FORCE, integral_of="V"),
    Field("u", "u", "longitudinal displacement", "m", Kind.DISPLACEMENT, integral_of="N"),
    Field("w", "w", "deflection", "m", Kind.DISPLACEMENT, integral_of="phi"),
    Field("phi", "φ", "slope", "rad", Kind.DISPLACEMENT, integral_of="M"),
    Field("chord", "w", "chord deflection", "m", Kind.DISPLACEMENT),
    Field("axial", "σ", "axial stress", "Pa", Kind.STRESS, main=False),
    Field("left", "σ", "left fibre stress", "Pa", Kind.STRESS, main=False),
    Field("right", "σ", "right fibre stress", "Pa", Kind.STRESS, main=False),
    Field("normal", "σ", "normal stress", "Pa", Kind.STRESS, greatest_of=("left", "right")),
    Field("shear", "τ", "shear stress", "Pa", Kind.STRESS),
    Field(
        "axis",
        "σ_v",
        "von Mises stress at the axis",
        "Pa",
        Kind.STRESS,
        root_of=((1.0, "axial"), (3.0, "shear")),
        signed=False,
        main=False,
    ),
    Field("mises", "σ_v", "von Mises stress", "Pa", Kind.STRESS, greatest_of=("left", "right", "axis"), signed=False),
)

FIELDS: Mapping[str, Field] = MappingProxyType({field.key: field for field in _ALL})
"""Fields along a beam, by their keys."""
_WORDS = {field.slug: field for field in _ALL}

PRIMARY = tuple(field.key for field in _ALL if field.integral_of)
"""The section forces and displacements N, V, M, u, w, phi, which all others follow from."""


def field_named(name: str) -> Field:
    """The field of a key, as "w", or of its name as a word, as "deflection".

    Raises
    ------
    ValueError
        There is none; the message lists those there are.
    """
    if name in FIELDS:
        return FIELDS[name]
    if name in _WORDS:
        return _WORDS[name]
    raise ValueError(f'there is no field "{name}": choose from {", ".join([*FIELDS, *_WORDS])}')


def chains() -> tuple[tuple[str, ...], ...]:
    """Every load with the fields integrated from it, one from the other: q_x, N, u and q_y, V, M, phi, w."""
    after = {field.integral_of: field.key for field in _ALL if field.integral_of}

    def chain(key: str) -> tuple[str, ...]:
        return (key, *chain(after[key])) if key in after else (key,)

    return tuple(chain(field.key) for field in _ALL if field.kind is Kind.LOAD)
