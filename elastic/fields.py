"""Registry of fields along a beam: key, symbol, name, unit and definition.

The registry is used for sampling, extremes, tables, diagrams, maps and meshes. To add a field, add one entry here. This
is enough if the field is the largest of existing fields, or the root of a sum of squares of existing fields. For all
other fields, also add a function to `elastic.derived`.
"""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType

from msgspec import Struct


class FieldKind(Enum):
    """Kind of quantity that a field represents."""

    LOAD = "load"
    FORCE = "section force"
    DISPLACEMENT = "displacement"
    STRESS = "stress"


class Field(Struct, frozen=True):
    """Quantity that varies along every beam.

    Attributes
    ----------
    key
        Name in code, tables and files.
    symbol, name, unit
        Texts shown with the values.
    kind
        Kind of quantity.
    integral_of
        Key of the field that is integrated along the beam to obtain this field (except for a factor and a constant):
        q_x for N, V for M, phi for w.
    greatest_of
        Keys of several fields. At each station, this field equals the field among these that has the largest magnitude.
    root_of
        Weights and keys of several fields. This field is the square root of the weighted sum of the squares of these
        fields.
    signed
        True if values may be negative. Diagrams and colour scales then extend to both sides of zero.
    main
        True if tables and files include the field by default.
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
        """Name with an initial capital, except for "von Mises"."""
        return self.name if self.name.startswith("von ") else self.name.capitalize()

    @property
    def slug(self) -> str:
        """Name of the field on the command line, for example "bending-moment"."""
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
        If the field does not exist. The message lists all fields.
    """
    if name in FIELDS:
        return FIELDS[name]
    if name in _WORDS:
        return _WORDS[name]
    raise ValueError(f'there is no field "{name}": choose from {", ".join([*FIELDS, *_WORDS])}')
