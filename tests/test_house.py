"""The list of rooms in docs/house.md is made of the files' own first lines; `python tests/test_house.py` renews it."""

import ast
import sys
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "house.md"
MARK = "<!-- rooms -->\n"


def first_line(path):
    """What a file says of itself."""
    return " ".join((ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0].split())


def rooms():
    """Every file of every package with its first line, room by room."""
    lines = []
    for package in ("rigid", "elastic", "fem_check", "animations", "kinelast"):
        files = [path for path in (ROOT / package).rglob("*.py") if path.name != "__main__.py"]
        for room, found in groupby(sorted(files, key=lambda path: (path.parent, path.stem)), lambda path: path.parent):
            lines += ["", f"### `{room.relative_to(ROOT).as_posix()}`", ""]
            own = {path.stem: first_line(path) for path in found}
            lines += [own.pop("__init__"), "", *(f"- `{name}`: {words}" for name, words in own.items())]
    return "\n".join(lines) + "\n"


def test_every_file_stands_in_its_room():
    assert PAGE.read_text(encoding="utf-8").partition(MARK)[2] == rooms(), "run python tests/test_house.py"


def test_every_file_says_what_it_is_for():
    assert "`: \n" not in rooms()


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8").partition(MARK)
    sys.exit(PAGE.write_text(text[0] + MARK + rooms(), encoding="utf-8") == 0)
