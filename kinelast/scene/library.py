"""Library of materials and standard sections."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

import msgspec

from elastic import SHAPES
from kinelast.scene import format as forms
from kinelast.scene.format import MaterialTable, SceneTable
from kinelast.values.error import fault, likely
from kinelast.values.numbers import number, real


def unknown(tables: Mapping[str, Any], table: str, key: str, name: str) -> NoReturn:
    """Raise SceneError because a section or material is neither in the scene nor in the library."""
    choices = _same_size(name) if key == "section" else []
    entries = [entry for entry, _ in library_entries(f"{key}s")]
    begun = [entry for entry in entries if _key(entry).startswith(_key(name))]
    problem = f'there is no {key} "{name}"'
    near = likely(begun[0] if len(name) > 1 and begun else name, [*choices, *tables, *entries])
    if "did you mean" in near:
        raise fault(table, key, problem + near)
    raise fault(table, key, f"{problem}{likely(name, tables)}; add [{key}s.{name}], or name one of --list {key}s")


def _same_size(name: str) -> list[str]:
    """Return the section of this size and of the shape with the most similar name: "flat 25x8" for "flatt 25x8"."""
    from difflib import get_close_matches

    family = re.split(r"[\d\s]", name.strip(), maxsplit=1)[0]
    size = name.strip()[len(family) :].strip()
    families = dict.fromkeys([*(words.split()[0] for words, _ in EXAMPLES), "CHS", *_library()["sections"]])
    near = {each.upper(): each for each in families}
    found = [near[each] for each in get_close_matches(family.upper(), near, n=1)]
    return [f"{each} {size}" for each in found if named_section(f"{each} {size}") is not None]


def materials_of(scene: SceneTable, names: Iterable[str]) -> dict[str, MaterialTable]:
    """Return the materials of a scene and, from the library, the materials in `names`."""
    more = {name: named_material(name) for name in names if name not in scene.materials}
    return {**scene.materials, **{name: stuff for name, stuff in more.items() if stuff is not None}}


@cache
def _library() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name("library.toml").read_text(encoding="utf-8"))


@cache
def named_material(name: str) -> MaterialTable | None:
    """Return the material with this name from the library, such as "S235", or None if there is none."""
    table = {_key(entry): table for entry, table in _library()["materials"].items()}.get(_key(name))
    if table is None:
        return None
    return _read({key: value for key, value in table.items() if key != "source"}, MaterialTable)


@cache
def named_section(name: str) -> forms.SectionTable | None:
    """Return a standard section, such as "IPE 80", "RHS 60x40x3", "pipe 33.7x2.6"; None if not found.

    The first dimension is in the plane of motion. Hollow sections are cold formed, with corner radii from EN 10219-2.
    """
    match = re.fullmatch(r"([A-Z]+)([0-9.]+(?:X[0-9.]+)*)", _key(name))
    if match is None:
        return None
    family, numbers = match[1], match[2].split("X")
    table = _library()["sections"].get(family, {})
    for size, rolled in _rolled(table):
        if _key(size) == match[2]:
            return _sized(table["shape"], dict(zip(table["sizes"], rolled, strict=True)), table.get("unit", "mm"))
    shape, keys = FAMILIES.get(family, ("", ()))
    if family == "SHS" and len(numbers) == 2:
        numbers = [numbers[0], *numbers]
    if not shape or len(numbers) != len(keys) or not all(re.fullmatch(r"\d+(?:\.\d+)?", each) for each in numbers):
        return None
    sizes = dict(zip(keys, map(float, numbers), strict=True))
    if shape == "box":
        wall = sizes["wall"]
        sizes["corner"] = wall * next((ratio for above, ratio in CORNERS if wall > above), 0.0)
    return _sized(shape, sizes)


FAMILIES = {  # by first word of a name: shape, and keys of the dimensions in the order of the numbers
    "RHS": ("box", ("depth", "width", "wall")),
    "SHS": ("box", ("depth", "width", "wall")),
    "PIPE": ("tube", ("outer", "wall")),
    "CHS": ("tube", ("outer", "wall")),
    "FLAT": ("rectangle", ("depth", "width")),
    "ROUND": ("circle", ("diameter",)),
}
# EN 10219-2: wall thickness [mm] above which a row applies, and outer corner radius / wall thickness
CORNERS = (10.0, 3.0), (6.0, 2.5), (0.0, 2.0)


def _rolled(table: Mapping[str, Any]) -> Iterable[tuple[str, list[float]]]:
    """Return the sizes in a table of rolled sections of the library: name of each size, and its dimensions."""
    return ((size, numbers) for size, numbers in table.items() if size[0].isdigit())


def _sized(shape: str, sizes: Mapping[str, float], unit: str = "mm") -> forms.SectionTable | None:
    """Return a section with the given dimensions, or None if a dimension is not positive."""
    if not all(size > 0.0 for size in sizes.values()):
        return None
    dimensions = {key: f"{size} {unit}" for key, size in sizes.items()}
    return _read({"shape": shape, **dimensions}, forms.SectionTable)


def _read(table: dict[str, Any], kind: Any) -> Any:
    return msgspec.convert(table, kind, dec_hook=forms.read_quantity)


def _key(name: str) -> str:
    return name.replace(" ", "").upper().replace("\u00d7", "X")


def library_entries(kind: str) -> list[tuple[str, str]]:
    """Return the entries of the library that a scene can use by name, each with a text on its properties and source.

    Parameters
    ----------
    kind
        "sections" or "materials".
    """
    if kind == "materials":
        return [(name, _material_words(words)) for name, words in _library()["materials"].items()]
    rolled = [
        (f"{family} {size}", _section_words(f"{family} {size}", table["source"]))
        for family, table in _library()["sections"].items()
        for size, _ in _rolled(table)
    ]
    return [*rolled, *((name, _section_words(name, source)) for name, source in EXAMPLES)]


EXAMPLES = (  # examples of shapes that can have any dimensions
    ("RHS 60x40x3", "EN 10219-2; any depth x width x wall, mm"),
    ("SHS 40x3", "EN 10219-2; any side x wall, mm"),
    ("pipe 33.7x2.6", "any outer diameter x wall, mm; CHS likewise"),
    ("flat 40x8", "any depth x width, mm"),
    ("round 12", "any diameter, mm"),
)


def _section_words(name: str, source: str) -> str:
    table = named_section(name)
    assert isinstance(table, forms.Dimensioned)
    made = SHAPES[str(table.__struct_config__.tag)](*(float(real(ends[0])) for ends in table.dimensions("")))
    return f"A {number(made.area * 1e4)} cm², I {number(made.inertia * 1e8)} cm⁴ ({source})"


def _material_words(words: Mapping[str, Any]) -> str:
    sizes = {key: value if isinstance(value, str) else f"{value:g}" for key, value in words.items() if key != "source"}
    sized = ", ".join(f"{key} {value.replace('e+0', 'e')}" for key, value in sizes.items())
    return f"{sized} ({words['source']})"
