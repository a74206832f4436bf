"""Every file has a docstring, first lines are plain, and the tables of docs/house.md are right."""

import ast
import importlib
import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "house.md"
PLAIN = ("rigid", "elastic", "symbols", "machine", "fem_check", "animations", "exchange", "kinelast", "live")
"""Packages, none with riddles in first lines."""
RIDDLE = re.compile(r"\b(what|whose|whatever)\b", re.IGNORECASE)


@cache
def tree_of(path):
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes_of(path):
    """Return all nodes of the syntax tree of a file."""
    return [*ast.walk(tree_of(path))]


@cache
def files():
    """Return the files of all packages."""
    return [path for package in PLAIN for path in sorted((ROOT / package).rglob("*.py"))]


def test_every_file_has_a_docstring():
    assert all(ast.get_docstring(tree_of(path)) for path in files())


def test_the_site_lists_every_file(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs" / "making")
    listed = importlib.import_module("rooms").with_rooms(PAGE.read_text(encoding="utf-8"))
    assert listed.count("\n- `") >= sum(path.stem not in {"__init__", "__main__"} for path in files())


def test_class_names_are_unique():
    classes = [(node.name, path) for path in files() for node in nodes_of(path) if isinstance(node, ast.ClassDef)]
    count = Counter(name for name, _ in classes)
    assert not [f"{name}: {path.relative_to(ROOT)}" for name, path in classes if count[name] > 1]


KINDS = {"PinDrive", "SliderDrive", "Slider", "Weld", "PinJoint", "SliderJoint", "WeldJoint"}
PARTS = {"sliders", "welds"}
JOINTS = "<!-- files that decide on the kind of a joint -->\n"


def decides(node):
    """Return whether code distinguishes kinds of joints itself, instead of asking the joint.

    Such code compares a slider or a line with None, tests the class of a joint, part or drive, or iterates over the
    parts of one kind.
    """
    if isinstance(node, ast.Compare) and any(
        isinstance(other, ast.Constant) and other.value is None for other in node.comparators
    ):
        return getattr(node.left, "attr", getattr(node.left, "id", "")) in {"slider", "along"}
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
        return any(isinstance(part, ast.Name) and part.id in KINDS for part in ast.walk(node.args[1]))
    return isinstance(node, ast.Attribute) and node.attr in PARTS


def deciding_files():
    """Yield the files that distinguish kinds of joints, without the joints' own room."""
    for path in files():
        if "rigid/joints" not in path.as_posix() and any(decides(node) for node in nodes_of(path)):
            yield path.relative_to(ROOT).with_suffix("").as_posix()


def test_the_list_of_files_that_distinguish_joints_is_right():
    table = PAGE.read_text(encoding="utf-8").split(JOINTS)[1].split("\n\n")[0]
    documented = set(re.findall(r"`([a-z_/]+)`", table.replace(" ", "")))
    assert documented == set(deciding_files())


def first_lines(path):
    """Yield the first docstring lines of a file, its classes and its functions, with line numbers."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for node in nodes_of(path):
        words = ast.get_docstring(node) if isinstance(node, documented) else None
        if words:
            yield getattr(node, "lineno", 1), words.splitlines()[0]


@pytest.mark.parametrize("package", PLAIN)
def test_first_lines_are_plain(package):
    riddles = [
        f"{path.relative_to(ROOT)}:{line}: {words}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for line, words in first_lines(path)
        if RIDDLE.search(words)
    ]
    assert not riddles, "\n".join(riddles)


SECTION = re.compile(r"^Parameters\n-+\n(.*?)(?=^\w+\n-+\n|\Z)", re.DOTALL | re.MULTILINE)


def unknown_parameters(path):
    """Yield functions whose docstring documents an unknown or unnamed parameter."""
    for node in nodes_of(path):
        section = SECTION.search(ast.get_docstring(node) or "") if isinstance(node, ast.FunctionDef) else None
        if section:
            lines = [line for line in section[1].splitlines() if line]
            named = {name.strip(" *") for line in lines if line[0] != " " for name in line.split(",")}
            if lines[0][0] == " " or named - {each.arg for each in ast.walk(node.args) if isinstance(each, ast.arg)}:
                yield f"{path.relative_to(ROOT)}: {node.name}"


def test_documented_parameters_exist():
    """The site cannot be built with an unknown parameter."""
    assert not [each for path in files() for each in unknown_parameters(path)]


VAGUE = {"found", "one", "own", "way"}
"""Names that say nothing of what they name."""


def long_lived(path):
    """Yield vague names that are used more than three lines after their assignment."""
    for function in nodes_of(path):
        if isinstance(function, ast.FunctionDef):
            seen = {}
            for node in ast.walk(function):
                name = getattr(node, "id", getattr(node, "arg", None))
                if name in VAGUE and isinstance(node, ast.Name | ast.arg):
                    seen.setdefault(name, []).append(node)
            for name, nodes in seen.items():
                bound = [node.lineno for node in nodes if isinstance(getattr(node, "ctx", None), ast.Store | None)]
                if bound and max(node.lineno for node in nodes) - min(bound) > 3:
                    yield f"{path.relative_to(ROOT)}:{min(bound)}: {name} in {function.name}"


def test_vague_names_live_three_lines_at_most():
    assert not [name for path in files() for name in long_lived(path)]


ONE_FILE = {f"rigid.{name}" for name in ("arrays", "chunks", "constants", "kinematics", "laws", "plane", "teeth")} | {
    "elastic.arrays"
}
"""Rooms of a single file."""


def deep_imports():
    """Yield imports that reach below the root of another package or room: file, line and module."""
    for path in files():
        for node in nodes_of(path):
            if not isinstance(node, ast.ImportFrom) or not node.module or node.module in ONE_FILE:
                continue
            first, *inner = node.module.split(".")
            if first in PLAIN and first != path.relative_to(ROOT).parts[0] and inner:
                room = ROOT / first / inner[0]
                if first != "kinelast" and (len(inner) > 1 or not room.is_dir()):  # `kinelast` rooms export their files
                    yield f"{path.relative_to(ROOT)}:{node.lineno}: {node.module}"


def test_imports_stop_at_the_root_of_a_package_or_room():
    assert not [*deep_imports()]
