"""Registry of fields along a beam: key, symbol, name, unit and definition.

It is used for sampling, extremes, tables, diagrams, maps and meshes. A new field that is the largest of known fields,
or the root of a sum of their squares, is one entry here. A field with its own formula also needs a function in
`elastic.derived`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType


class FieldKind(Enum):
    """Kind of a field's quantity."""

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
        Name in code, tables and files.
    symbol, name, unit
        Text that is shown with the values.
    kind
        Kind of quantity.
    integral_of
        This field is the integral of that field along the beam, up to a factor and a constant: N of q_x, M of V, w of
        phi.
    greatest_of
        Keys of fields; this field is the one with the largest magnitude.
    root_of
        Weights and keys of fields; this field is the root of their weighted sum of squares.
    signed
        True if values may be negative; diagrams and colours then use both sides of zero.
    main
        True if tables and files include it by default.
    """

    key: str
    symbol: str
    name: str
    unit: str
    kind: FieldKind
    integral_of: str | None = None
    greatest_of: tuple[str, ...] = ()
    root_of: tuple[tuple[float, str], ...] = ()
    signed: bool = True
    main: bool = True

    @property
    def title(self) -> str:
        """Name with a capital letter, except for personal names that begin with "von"."""
        return self.name if self.name.startswith("von ") else self.name.capitalize()

    @property
    def slug(self) -> str:
        """Name as a word of a command."""
        return self.name.lower().replace(" ", "-")


_ALL = (
    Field("q_x", "q_x", "longitudinal load", "N/m", FieldKind.LOAD),
    Field("q_y", "q_y", "transverse load", "N/m", FieldKind.LOAD),
    Field("N", "N", "axial force", "N", FieldKind.FORCE, integral_of="q_x"),
    Field("V", "V", "shear force", "N", FieldKind.FORCE, integral_of="q_y"),
    Field("M", "M", "bending moment", "N m", FieldKind.FORCE, integral_of="V"),
    Field("u", "u", "longitudinal displacement", "m", FieldKind.DISPLACEMENT, integral_of="N"),
    Field("w", "w", "deflection", "m", FieldKind.DISPLACEMENT, integral_of="phi"),
    Field("phi", "φ", "slope", "rad", FieldKind.DISPLACEMENT, integral_of="M"),
    Field("chord", "w", "chord deflection", "m", FieldKind.DISPLACEMENT),
    Field("axial", "σ", "axial stress", "Pa", FieldKind.STRESS, main=False),
    Field("left", "σ", "left fibre stress", "Pa", FieldKind.STRESS, main=False),
    Field("right", "σ", "right fibre stress", "Pa", FieldKind.STRESS, main=False),
    Field("normal", "σ", "normal stress", "Pa", FieldKind.STRESS, greatest_of=("left", "right")),
    Field("shear", "τ", "shear stress", "Pa", FieldKind.STRESS),
    Field(
        "axis",
        "σ_v",
        "von Mises stress at the axis",
        "Pa",
        FieldKind.STRESS,
        root_of=((1.0, "axial"), (3.0, "shear")),
        signed=False,
        main=False,
    ),
    Field("mises", "σ_v", "von Mises stress", "Pa", FieldKind.STRESS, greatest_of=("normal", "axis"), signed=False),
)

FIELDS: Mapping[str, Field] = MappingProxyType({field.key: field for field in _ALL})
"""Fields along a beam, by key."""
_WORDS = {field.slug: field for field in _ALL}

PRIMARY = tuple(field.key for field in _ALL if field.integral_of)
"""Section forces and displacements N, V, M, u, w, phi; all other fields derive from them."""


def field_named(name: str) -> Field:
    """Look up a field by key ("w") or slug ("deflection").

    Raises
    ------
    ValueError
        If there is no such field; the message lists all fields.
    """
    if name in FIELDS:
        return FIELDS[name]
    if name in _WORDS:
        return _WORDS[name]
    raise ValueError(f'there is no field "{name}": choose from {", ".join([*FIELDS, *_WORDS])}')


def chains() -> tuple[tuple[str, ...], ...]:
    """Chains of integrals from each load: q_x, N, u and q_y, V, M, phi, w."""
    after = {field.integral_of: field.key for field in _ALL if field.integral_of}

    def chain(key: str) -> tuple[str, ...]:
        return (key, *chain(after[key])) if key in after else (key,)

    return tuple(chain(field.key) for field in _ALL if field.kind is FieldKind.LOAD)
