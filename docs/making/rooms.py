"""List all files of the packages by folder, with the first paragraph of each docstring."""

import ast
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("rigid", "elastic", "symbols", "machine", "fem_check", "animations", "exchange", "kinelast", "live")
MARK = "<!-- rooms -->"


def with_rooms(markdown: str) -> str:
    """Replace the mark of a page by the list."""
    return markdown.replace(MARK, rooms()) if MARK in markdown else markdown


def rooms() -> str:
    """Return the list in Markdown."""
    lines = []
    for package in PACKAGES:
        files = [path for path in (ROOT / package).rglob("*.py") if path.name != "__main__.py"]
        for room, found in groupby(sorted(files, key=lambda path: (path.parent, path.stem)), lambda path: path.parent):
            own = {path.stem: first_line(path) for path in found}
            lines += ["", f"### `{room.relative_to(ROOT).as_posix()}`", "", own.pop("__init__"), ""]
            lines += [f"- `{name}`: {words}" for name, words in own.items()]
    return "\n".join(lines) + "\n"


def first_line(path: Path) -> str:
    """First paragraph of a file's docstring, on one line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return " ".join((ast.get_docstring(tree) or "").split("\n\n")[0].split())
