"""Cross-sections of beams, from a shape and a material."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from math import inf, nan
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from elastic import SHAPES, Section, Shape, section_of, tapered
from elastic.beams import POISSON, CrossSectionError, outline
from kinelast.scene import format as forms
from kinelast.scene.format import MaterialTable, SceneTable
from kinelast.scene.library import materials_of, named_section, unknown
from kinelast.scene.parsing import leaves, read_toml
from kinelast.scene.tables import PER_LENGTH
from kinelast.values.error import SceneError, fault
from kinelast.values.numbers import any_nonzero, real, require
from rigid import Beam
from rigid.arrays import Real

Read = Callable[[str], str]
"""Function that reads a file in the folder of a scene: from its name to its text. Raises SceneError."""


class Material(Struct, frozen=True):
    """A material: Young's modulus [Pa], density [kg/m^3], yield stress [Pa] and Poisson's ratio.

    The yield stress and Poisson's ratio are None if unknown.
    """

    E: float
    density: float
    yield_stress: float | None
    poisson: float | None = None


class SectionSource(Struct, frozen=True):
    """A section as the file gives it: name, shape, dimensions [m], and name of the material, which may be empty."""

    section: str
    shape: str
    sizes: Mapping[str, tuple[float, ...]]
    material: str


class CrossSection(Struct, frozen=True, eq=False):
    """Section and mass of a beam. `mass_per_length` [kg/m] applies at the start of the beam.

    `mass_taper` is defined in `rigid.Beam`. `rotary` is the density for the rotary inertia [kg/m^3], or 0 if rotary
    inertia is neglected or the density is unknown. `source` identifies the section, the material and the free strain
    (strain without stress) in the file.
    """

    section: Section
    mass_per_length: Real
    mass_taper: tuple[float, ...] = (1.0,)
    source: tuple[Any, ...] = ()
    rotary: Real = 0.0

    def beam(self, start: str, end: str) -> Beam:
        """Return the beam with this section between two points."""
        taper = self.section.taper
        inertia = self.rotary * self.section.inertia if any_nonzero(self.rotary) else 0.0
        return Beam(start, end, self.mass_per_length, self.mass_taper, inertia, taper.EI if taper else (1.0,))

    def continues_as(self, other: CrossSection) -> bool:
        """Return True if a beam of this section and a collinear one of the section `other` can be merged."""
        return self.source == other.source and self.section.taper is None

    @property
    def rigid(self) -> Section:
        """Section with the same dimensions and infinite stiffness, used for stresses.

        Not available for a tapered beam.
        """
        if self.section.taper is not None:
            return Section(yield_stress=self.section.yield_stress)
        return replace(self.section, EA=inf, EI=inf, kGA=inf, strain=0.0)


def cross_section(
    scene: SceneTable, table: str, link: forms.LinkTable, beam: forms.BeamTable, section: str
) -> CrossSection:
    """Return the cross-section of a beam.

    Parameters
    ----------
    scene
        Scene with the materials, the sections and the beam theory.
    table
        Name of the table of the link, for messages.
    link, beam
        Tables of the link and the beam. The keys of the beam override those of the link.
    section
        Name of the section.
    """
    shape = scene.sections.get(section) or named_section(section) or unknown(scene.sections, table, "section", section)
    material = beam.material or link.material
    strained = tuple(None if own is None else id(own) for own in (beam.strain, beam.temperature))
    source = section, material, *strained
    demanded = scene.run.beams == "timoshenko" and not link.rigid
    shear = scene.run.beams != "euler-bernoulli" and not link.rigid
    if isinstance(shape, forms.Rigidities):
        if material is not None:
            raise fault(table, "material", f'the section "{section}" has stiffnesses and mass: remove the material')
        if demanded and shape.kGA is None:
            raise fault(f"sections.{section}", "kGA", 'the key is missing: beams = "timoshenko" needs it')
        kGA = real(shape.kGA) if shape.kGA else nan
        sheared = shear and shape.kGA is not None
        plain = Section(real(shape.EA), real(shape.EI), kGA if sheared else inf, shear_rigidity=kGA)
        return CrossSection(_strained(plain, table, link, beam, None), real(shape.mass_per_length), source=source)
    if material is None:
        known = ", ".join(f'"{name}"' for name in scene.materials)
        known = known or "none: name one of --list materials, or add [materials.NAME] with E and density"
        raise fault(table, "material", f'the section "{section}" needs a material; there is {known}')
    stuff = materials_of(scene, [material]).get(material) or unknown(scene.materials, table, "material", material)
    if demanded and isinstance(shape, forms.Properties) and shape.shear_area is None:
        raise fault(f"sections.{section}", "shear_area", 'the key is missing: beams = "timoshenko" needs it')
    poisson = poisson_of(stuff, material)
    made, mass_taper = _made(shape, section, stuff, POISSON if poisson is None else poisson, shear)
    return CrossSection(
        _strained(made, table, link, beam, stuff.expansion, material),
        real(stuff.density) * made.area,
        mass_taper,
        source,
        0.0 if scene.run.beams == "euler-bernoulli" else real(stuff.density),
    )


def _made(
    shape: forms.SectionTable, name: str, stuff: MaterialTable, poisson: Any, shear: bool
) -> tuple[Section, tuple[float, ...]]:
    """Return the section, and the mass taper (see `rigid.Beam`), for a shape and a material.

    `shear` is true if shear deformation is included.
    """
    limit = nan if stuff.yield_stress is None else real(stuff.yield_stress)
    if isinstance(shape, forms.Properties):
        found = Shape(real(shape.A), real(shape.I), nan if shape.c is None else real(shape.c))
        made = section_of(found, real(stuff.E), None, limit)
        if shape.shear_area is not None:
            known = real(stuff.E) / (2 * (1 + poisson)) * real(shape.shear_area)
            made = replace(made, kGA=known if shear else inf, shear_rigidity=known)
        return made, (1.0,)
    if isinstance(shape, forms.Outline):
        return section_of(_outlined(shape, name), real(stuff.E), poisson, limit, shear=shear), (1.0,)
    assert isinstance(shape, forms.Dimensioned)
    function = SHAPES[str(shape.__struct_config__.tag)]
    ends = zip(*shape.dimensions(f"sections.{name}"), strict=True)
    start, end = (tuple(real(size) for size in sizes) for sizes in ends)
    if start == end:
        return section_of(function(*start), real(stuff.E), poisson, limit, shear=shear), (1.0,)
    taper, mass_taper = tapered(function, start, end, poisson)
    return section_of(function(*start), real(stuff.E), poisson, limit, taper, shear), mass_taper


def _outlined(shape: forms.Outline, name: str) -> Shape:
    """Return the properties of an outline."""
    if shape.points is None:
        raise fault(f"sections.{name}", "points", "the key is missing: give an outline its points or a drawing")
    places = [shape.points, *(shape.holes or ())]
    first, *holes = (tuple((float(real(y)), float(real(z))) for y, z in ring) for ring in places)
    try:
        return outline(first, tuple(holes))
    except CrossSectionError as error:
        raise fault(f"sections.{name}", "points", f"not a valid section: {error}") from error


def poisson_of(stuff: MaterialTable, name: str) -> Any:
    """Return Poisson's ratio as given or, by default, computed from the shear modulus.

    Return None if neither is given.
    """
    if stuff.G is None:
        return None if stuff.poisson is None else real(stuff.poisson)
    if stuff.poisson is not None:
        raise fault(f"materials.{name}", "poisson", "give poisson or G, not both")
    poisson = real(stuff.E) / (2 * real(stuff.G)) - 1

    def problem(of: Any) -> str:
        return f"with E it gives a Poisson's ratio of {of(poisson):.3g}, expected -1 to 0.5"

    require((poisson > -1) & (poisson <= 0.5), f"materials.{name}", "G", problem)
    return poisson


def _strained(
    section: Section,
    table: str,
    link: forms.LinkTable,
    beam: forms.BeamTable,
    expansion: float | None,
    material: str = "",
) -> Section:
    """Return a section with the free strain of a beam: the given strain plus the thermal strain."""
    strain = link.strain if beam.strain is None else beam.strain
    warming = link.temperature if beam.temperature is None else beam.temperature
    total = 0.0 if strain is None else real(strain)
    if warming is not None:
        if expansion is None:
            if not material:
                raise fault(table, "temperature", "needs a material with expansion: give strain instead")
            raise fault(f"materials.{material}", "expansion", "the key is missing: the temperature of a beam needs it")
        total = total + real(expansion) * real(warming)
    return replace(section, strain=total) if any_nonzero(total) else section


def with_files(raw: Mapping[str, Any], read: Read) -> tuple[Mapping[str, Any], dict[str, str]]:
    """Return the tables of a scene, with sections and materials from other files included.

    Parameters
    ----------
    raw
        Tables of the scene file.
    read
        Function that reads the files to which the scene refers.

    Returns
    -------
    The first value contains the tables. Entries of the library file replace the key `library`, and corners replace
    drawings. If there are no files, they are the given tables. The second value contains the texts of the files by
    name.

    Raises
    ------
    SceneError
        A file cannot be read or has invalid contents.
    """
    texts: dict[str, str] = {}
    parts: dict[str, dict[str, Any]] = {"materials": {}, "sections": {}}
    if not isinstance(raw, Mapping):
        return raw, {}  # reported by the parser
    name = raw.get("library")
    if isinstance(name, str):
        texts[name] = read_as(name, (".toml",), read, "", "library")
        parts = _named_in(raw, _library_of(texts[name], name))
    known = {**parts["sections"], **_mapping(raw, "sections")}
    for section, table in known.items():
        if isinstance(table, dict) and table.get("shape") == "outline" and isinstance(table.get("drawing"), str):
            where, drawing = f"sections.{section}", table["drawing"]
            if "points" in table:
                raise fault(where, "drawing", "give points or a drawing, not both")
            texts[drawing] = read_as(drawing, (".dxf",), read, where, "drawing")
            parts["sections"][section] = _drawn(table, texts[drawing], where, str(raw.get("units", "mm")))
    if not texts:
        return raw, {}
    merged = {kind: {**_mapping(raw, kind), **more} for kind, more in parts.items()}
    return {**{key: value for key, value in raw.items() if key != "library"}, **merged}, texts


def _mapping(raw: Mapping[str, Any], kind: str) -> dict[str, Any]:
    """Return the tables under the key `kind`, or an empty mapping if there are none."""
    tables = raw.get(kind)
    return dict(tables) if isinstance(tables, Mapping) else {}


def read_as(
    name: str, suffixes: tuple[str, ...], read: Read, table: str, key: str, expected: str = "expected a file"
) -> str:
    """Return the text of a file in the folder of the scene.

    The file name is the value of `key` in `table`, and must have one of the suffixes.
    """
    if not name.lower().endswith(suffixes):
        ends = " or ".join(suffixes)
        raise fault(table, key, f'{expected} in the folder of the scene with the suffix {ends}, got "{name}"')
    try:
        return read(name)
    except SceneError as error:
        raise type(error)("", table, key, error.problem) from None


def _library_of(text: str, name: str) -> dict[str, dict[str, Any]]:
    """Return the tables of materials and sections in the text of a library."""
    try:
        tables = read_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise fault("", "library", f"{name}: not readable as TOML: {error}") from None
    other = next((key for key in tables if key not in ("materials", "sections")), None)
    if other is not None:
        raise fault("", "library", f"{name}: a library has only [materials.NAME] and [sections.NAME], got {other}")
    for section, table in _mapping(tables, "sections").items():
        bare = next((key for key, size in table.items() if isinstance(size, int | float)), None)
        if bare is not None:  # without a unit, the meaning of the number would depend on the scene
            raise fault("", "library", f'{name}: {bare} of "{section}" needs a unit, as in "{table[bare]} mm"')
    return {kind: _mapping(tables, kind) for kind in ("materials", "sections")}


def _named_in(raw: Mapping[str, Any], library: Mapping[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the tables of a library that a scene refers to and does not define itself."""
    words = set(leaves(raw, str))
    return {
        kind: {name: table for name, table in tables.items() if name in words and name not in _mapping(raw, kind)}
        for kind, tables in library.items()
    }


def _drawn(table: Mapping[str, Any], text: str, where: str, unit: str) -> dict[str, Any]:
    """Return the table of an outline, with corners from the text of a drawing in place of the key `drawing`."""
    from exchange import ExchangeError, section_of_dxf

    try:
        rings = section_of_dxf(text, unit if unit in PER_LENGTH else "mm")
    except ExchangeError as error:
        raise fault(where, "drawing", f"{table['drawing']}: {error}") from None
    points, *holes = [[[f"{y!r} m", f"{x!r} m"] for x, y in ring] for ring in rings]
    kept = {key: value for key, value in table.items() if key != "drawing"}
    return {**kept, "points": points, **({"holes": holes} if holes else {})}


def section_source(scene: SceneTable, link: str, number: int) -> SectionSource:
    """Return the section and material of beam `number` of a link."""
    table = scene.links[link]
    entry = None if table.beams is None else table.beams[number]
    beam = entry if isinstance(entry, forms.BeamTable) else forms.BeamTable(start="", end="")
    name, material = beam.section or table.section or "", beam.material or table.material or ""
    section = scene.sections.get(name) or named_section(name)
    assert section is not None  # a link with beams has a section, otherwise it cannot be built
    keys = section.__struct_fields__ if isinstance(section, forms.Dimensioned) else ()
    sizes = {key: tuple(dict.fromkeys(size)) for key in keys if (size := getattr(section, key)) is not None}
    shape = str(section.__struct_config__.tag)
    return SectionSource(name, shape, sizes, material if not isinstance(section, forms.Rigidities) else "")
