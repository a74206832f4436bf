"""The files and tables named by the recipes of CONTRIBUTING.md exist."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
PATHS = sorted({path for path in re.findall(r"`([\w./-]+)`", TEXT) if "/" in path})
TABLES = {
    "elastic/beams/cross_sections.py": "SHAPES",
    "rigid/laws.py": "CURVES",
    "kinelast/outputs/table.py": "FORMATS",
    "exchange/reading.py": "FORMATS",
    "kinelast/scene/format.py": "SectionTable",
    "kinelast/scene/part.py": "Part",
    "kinelast/scene/parts/__init__.py": "PARTS",
}
FUNCTIONS = {
    "kinelast/reports/sections.py": "_load",
    "kinelast/runs/run.py": "_drawings",
    "kinelast/designs/base.py": "_on_axis",
}


def names(path):
    """Return the module-level names of a file."""
    for node in ast.parse((ROOT / path).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
            yield from (inner.name for inner in node.body if isinstance(inner, ast.FunctionDef))
        for target in getattr(node, "targets", [getattr(node, "target", None)]):
            if isinstance(target, ast.Name):
                yield target.id


def test_every_path_exists():
    assert len(PATHS) > 25
    assert not [path for path in PATHS if not (ROOT / path).exists()]


@pytest.mark.parametrize(("path", "name"), [*TABLES.items(), *FUNCTIONS.items()])
def test_a_file_has_what_its_recipe_names(path, name):
    assert f"`{path}`" in TEXT
    assert f"`{name}`" in TEXT or f"{name}()" in TEXT
    assert name in names(path)
