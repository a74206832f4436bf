"""Reference of the API: one page per package, with the public names of the package and its subpackages.

The `__init__.py` files define the public names; for `kinelast`, only the file of the package itself does.
"""

from collections.abc import Iterator
from pathlib import Path

import griffe
from made import Made

PACKAGES = {
    "kinelast": "Scenes, deflections, pictures and reports from Python",
    "rigid": "Mechanism to motion: positions, velocities, accelerations, inertia loads, joint forces",
    "elastic": "Motion to deflection: section forces, elastic lines, extremes, strength, vibration",
    "symbols": "Symbols of a mechanism as one display list",
    "machine": "Sizing of drives and joints, fatigue life: formulas on arrays",
    "fem_check": "Independent check by finite elements",
    "animations": "Pictures and films of moving links",
    "exchange": "Mechanisms of other programs",
    "live": "Scene editor in the browser",
}
ROOT_ONLY = ("kinelast",)
"""Packages with public names only in their own `__init__.py`."""


def pages(root: Path) -> Iterator[Made]:
    """Return one page per package.

    Raises
    ------
    ValueError
        A public name has no docstring.
    """
    loader = griffe.GriffeLoader(search_paths=[root])
    for package in PACKAGES:
        loader.load(package)
    loader.resolve_aliases(external=False)
    bare: list[str] = []
    for package, words in PACKAGES.items():
        module = loader.modules_collection[package]
        text, seen = [f"# {package}\n\n{words}.\n"], set[str]()
        for room in _rooms(module):
            part = [*_names(room, seen, bare)]
            if part:
                text += [f"## `{room.path}`\n", f"{_first_line(room)}\n", *part]
        yield Made(f"reference/api/{package}.md", "\n".join(text))
    if bare:
        raise ValueError(f"public names without a docstring: {', '.join(sorted(bare))}")


def _rooms(module: griffe.Module) -> Iterator[griffe.Module]:
    yield module
    if module.name not in ROOT_ONLY:
        yield from (
            room for name, room in sorted(module.modules.items()) if not name.startswith("_") and room.is_init_module
        )


def _names(room: griffe.Module, seen: set[str], bare: list[str]) -> Iterator[str]:
    """Yield directives for the public names of a subpackage that are not on the page yet."""
    names = [str(name) for name in room.exports] if room.exports else _given(room)
    for name in names:
        member = room.members[name]
        try:
            target = member.final_target if isinstance(member, griffe.Alias) else member
        except griffe.AliasResolutionError:
            continue  # a type of another project
        if target.path in seen or isinstance(target, griffe.Module):
            continue
        seen.add(target.path)
        if target.docstring is None:
            bare.append(target.path)
        yield f"::: {target.path}\n    options:\n      heading_level: 3\n"


def _given(room: griffe.Module) -> list[str]:
    """Return the names that an `__init__.py` defines or imports from its files."""
    return sorted(
        name
        for name, member in room.members.items()
        if not name.startswith("_")
        and not isinstance(member, griffe.Module)
        and (member.target_path.startswith(f"{room.path}.") if isinstance(member, griffe.Alias) else True)
        and not (isinstance(member, griffe.Attribute) and member.docstring is None and member.is_private)
    )


def _first_line(room: griffe.Module) -> str:
    return room.docstring.value.split("\n\n")[0] if room.docstring else ""
