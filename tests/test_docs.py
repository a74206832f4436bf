"""Every block of the documentation runs; the blocks of a page run in order, in one folder.

Python is executed. A command is called with its arguments and must print the lines below it. A scene is read, and
each key of a part of a scene must exist. Hidden comments before a block control this: `<!-- not run: REASON -->`;
`<!-- into FILE -->` merges a part of a scene into a file; `<!-- step: COMMAND -->` does a manual step.
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
OF_A_SWEEP = "sweeps.md"  # reads the folder of an earlier sweep
RUN = ("python", "toml", "sh", "console", "")


class Block(NamedTuple):
    """Block of a page: language, text, number of its first line, file, and steps before it."""

    kind: str
    text: str
    line: int
    file: str
    steps: list[str]


def pages():
    """Return README, CONTRIBUTING and all pages of docs."""
    outside = [ROOT / name for name in ("README.md", "CONTRIBUTING.md") if (ROOT / name).is_file()]
    return [*outside, *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page):
    """Yield the blocks of a page that are run."""
    text = page.read_text(encoding="utf-8")
    end = 0
    for block in BLOCK.finditer(text):
        notes, kind, code = block.groups()
        remarks = NOTE.findall(text[end : block.start()] + notes)
        saved = SAVED.findall(text[end : block.start()])
        end = block.end()
        into = [words for note, words in remarks if note == "into"]
        if kind in RUN and not any(note == "not run" for note, _ in remarks):
            steps = [words for note, words in remarks if note == "step"]
            yield Block(kind, code, text[: block.start(3)].count("\n"), [*saved, *into, ""][0], steps)


def commands(text):
    """Yield the commands of a block, each with its expected lines."""
    calls = []
    for line in text.splitlines():
        if call := COMMAND.match(line):
            calls.append((call[1], []))
        elif calls and line:
            calls[-1][1].append(line)
    return calls


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
            # tracebacks show the line of the page
            exec(compile("\n" * block.line + block.text, str(page), "exec"), names)
        elif block.kind == "toml":
            is_a_scene(block)
        else:
            for line, printed in commands(block.text):
                prints(line, printed, capsys)


def is_a_scene(block):
    """Check that a block is a scene, or a part of a scene with known keys."""
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
    """Merge the values of tables into the tables of a file."""
    for name, value in tables.items():
        if isinstance(value, dict) and name in whole:
            put(whole[name], value)
        else:
            whole[name] = value


def prints(line, printed, capsys):
    """Check the printed lines and the exit status of a command."""
    words = shlex.split(line, comments=True)
    if words[0] != "deflection-report":
        return  # a command of the shell itself
    capsys.readouterr()
    status = main(words[1:])
    out, err = capsys.readouterr()
    for each in printed:
        assert each in out + err, f"{line} does not print {each}\nbut\n{out}{err}"
    refused = any(each in err for each in printed)
    assert status == (2 if refused else 1 if any("NOT ACCEPTABLE" in each for each in printed) else 0), line


def test_pages_with_blocks_are_found():
    assert {"README", "python", "strength", "validity", "dynamics", "scenes", "sweeps"} <= {page.stem for page in PAGES}


def test_every_block_is_run_or_has_a_reason():
    left = []
    for page in pages():
        for block in blocks(page):
            runs = block.kind in {"python", "toml"} or commands(block.text)
            left += [] if runs else [f"{page.relative_to(ROOT)}:{block.line}"]
    assert not left, "run it, give its reason (<!-- not run: ... -->), or call it text"


def test_named_tests_and_scripts_exist():
    code = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "tests").glob("test_*.py")))
    for page in pages():
        text = page.read_text(encoding="utf-8")
        missing = [name for name in re.findall(r"`(test_\w+)`", text) if f"def {name}(" not in code]
        scripts = re.findall(r"`((?:tests|benchmarks)/[\w/.*]+)(?: [^`]*)?`", text)
        assert not missing + [name for name in scripts if not any(ROOT.glob(name))], page.name


def test_the_page_of_the_format_has_all_keys(monkeypatch):
    """`python docs/making/scene_format.py` writes the tables from the structs."""
    where = ROOT / "docs" / "making" / "scene_format.py"
    spec = importlib.util.spec_from_file_location("scene_format", where)
    making = importlib.util.module_from_spec(spec)
    monkeypatch.syspath_prepend(where.parent)
    spec.loader.exec_module(making)
    page = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    assert making.with_tables(page) == page
    assert not making.left_out(page)


def test_tables_show_the_results(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    tables = importlib.import_module("tables")
    for page in tables.PAGES:
        text = page.read_text(encoding="utf-8")
        assert tables.filled(text) == text, f"{page.name}: python benchmarks/tables.py"
