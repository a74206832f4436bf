"""Claim: every block of the documentation runs as it stands, those of a page one after the other in one folder.

Python is executed; a command is given its arguments, and prints the lines that follow it; a scene is read, a part of
one is held against the format. Comments before a block, which readers do not see, say what they do between:
`<!-- not run: REASON -->`; `<!-- into FILE -->`, a part of a scene that is put into a file; `<!-- step: COMMAND -->`,
what a reader does by hand.
"""

import importlib.util
import re
import shlex
import subprocess
import tomllib
from pathlib import Path
from typing import NamedTuple

import msgspec
import pytest
import tomlkit

from kinelast import scene_from_text, shipped_scenes
from kinelast.cli.command import main
from kinelast.scene.format import SceneTable, read_quantity

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"((?:^<!-- [^\n]* -->\n+)*)^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NOTE = re.compile(r"^<!-- (not run|into|step):? ([^\n]+?) -->$", re.MULTILINE)
COMMAND = re.compile(r"^(?:\$ )?(deflection-report\b.*|\. \.venv/bin/activate\b.*)$")
SAVED = re.compile(r"[Ss]ave (?:this|the one below) as `(\w+\.toml)`")
OF_A_SWEEP = "sweeps.md"  # reads the folder of a sweep that was run before
RUN = ("python", "toml", "sh", "console", "")


class Block(NamedTuple):
    """A block of a page: its language, its text, number of its first line, its file, steps before it."""

    kind: str
    text: str
    line: int
    file: str
    steps: list[str]


def pages():
    """README, CONTRIBUTING and all pages of docs."""
    outside = [ROOT / name for name in ("README.md", "CONTRIBUTING.md") if (ROOT / name).is_file()]
    return [*outside, *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page):
    """The blocks of a page that are run."""
    text = page.read_text(encoding="utf-8")
    end = 0
    for block in BLOCK.finditer(text):
        notes, kind, code = block.groups()
        told = NOTE.findall(text[end : block.start()] + notes)
        saved = SAVED.findall(text[end : block.start()])
        end = block.end()
        into = [words for note, words in told if note == "into"]
        if kind in RUN and not any(note == "not run" for note, _ in told):
            steps = [words for note, words in told if note == "step"]
            yield Block(kind, code, text[: block.start(3)].count("\n"), [*saved, *into, ""][0], steps)


def commands(text):
    """The command lines of a block, each with the lines that it is to print."""
    told = []
    for line in text.splitlines():
        if call := COMMAND.match(line):
            told.append((call[1], []))
        elif told and line:
            told[-1][1].append(line)
    return told


PAGES = [page for page in pages() if any(blocks(page))]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run(page, tmp_path, monkeypatch, capsys):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    (tmp_path / "designs").mkdir()
    for place in ("mine.toml", "designs/mine.toml"):
        Path(place).write_bytes(shipped_scenes()["press_sweep"].read_bytes())
    if page.name == OF_A_SWEEP:
        assert main(["mine.toml", "--sweep", "--quiet", "--pages", "0"]) == 0
    names = {"__name__": "page"}
    for block in blocks(page):
        for step in block.steps:
            main(shlex.split(step)[1:]) if step.startswith("deflection-report") else subprocess.run(
                step, shell=True, check=True
            )
        if block.kind == "python":
            exec(compile("\n" * block.line + block.text, str(page), "exec"), names)  # so that a fault names its line
        elif block.kind == "toml":
            is_a_scene(block)
        else:
            for line, printed in commands(block.text):
                prints(line, printed, capsys)


def is_a_scene(block):
    """A block is a scene, or a part of one of which every key is known."""
    tables = tomllib.loads(block.text)
    if "points" in tables and "links" in tables:
        assert scene_from_text(block.text).title == tables.get("title", "scene")
        if block.file:
            Path(block.file).write_text(block.text, encoding="utf-8")
        return
    kinds = {field.encode_name: field.type for field in msgspec.structs.fields(SceneTable)}
    assert tables.keys() <= kinds.keys()
    for name, value in tables.items():
        msgspec.convert(value, kinds[name], dec_hook=read_quantity)
    if block.file:
        file = Path(block.file)
        whole = tomlkit.parse(file.read_text(encoding="utf-8"))
        put(whole, tables)
        file.write_text(tomlkit.dumps(whole), encoding="utf-8")


def put(whole, tables):
    """Put the values of some tables into those of a file."""
    for name, value in tables.items():
        if isinstance(value, dict) and name in whole:
            put(whole[name], value)
        else:
            whole[name] = value


def prints(line, printed, capsys):
    """A command prints some lines; its status is 0, or that which they tell."""
    words = shlex.split(line, comments=True)
    if words[0] != "deflection-report":
        return  # a step of the shell, which finds the command by itself
    capsys.readouterr()
    status = main(words[1:])
    out, err = capsys.readouterr()
    for each in printed:
        assert each in out + err, f"{line} does not print {each}\nbut\n{out}{err}"
    refused = any(each in err for each in printed)
    assert status == (2 if refused else 1 if any("NOT ACCEPTABLE" in each for each in printed) else 0), line


def test_pages_with_blocks_are_found():
    assert {"README", "python", "strength", "validity", "dynamics", "scenes", "sweeps"} <= {page.stem for page in PAGES}


def test_every_block_is_run_or_has_its_reason():
    left = []
    for page in pages():
        for block in blocks(page):
            runs = block.kind in {"python", "toml"} or commands(block.text)
            left += [] if runs else [f"{page.relative_to(ROOT)}:{block.line}"]
    assert not left, "run it, give its reason (<!-- not run: ... -->), or call it text"


def test_the_keys_of_the_format_stand_in_its_page(monkeypatch):
    """As the structs that read them tell them; `python docs/making/scene_format.py` writes them."""
    where = ROOT / "docs" / "making" / "scene_format.py"
    spec = importlib.util.spec_from_file_location("scene_format", where)
    making = importlib.util.module_from_spec(spec)
    monkeypatch.syspath_prepend(where.parent)
    spec.loader.exec_module(making)
    page = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    assert making.with_tables(page) == page
    assert not making.left_out(page)


def test_tables_are_those_of_the_results(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    tables = importlib.import_module("tables")
    for page in tables.PAGES:
        text = page.read_text(encoding="utf-8")
        assert tables.filled(text) == text, f"{page.name}: python benchmarks/tables.py"
