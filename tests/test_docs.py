"""Claim: every block of Python in the documentation runs as it stands, those of a page one after the other."""

import re
from pathlib import Path

import pytest

from kinelast import shipped_scenes
from kinelast.cli.command import main

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PAGES = [page for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))) if BLOCK.search(page.read_text())]
OF_A_SWEEP = "sweeps.md"  # reads the folder of a sweep that was run before


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    if page.name == OF_A_SWEEP:
        Path("mine.toml").write_bytes(shipped_scenes()["press_sweep"].read_bytes())
        assert main(["mine.toml", "--sweep", "--quiet", "--pages", "0"]) == 0
    names = {"__name__": "page"}
    for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
        line = page.read_text(encoding="utf-8")[: block.start()].count("\n")
        exec(compile("\n" * (line + 1) + block[1], str(page), "exec"), names)  # so that a fault names its line


def test_pages_with_python_are_found():
    assert {"README", "python", "strength", "check", "dynamics"} <= {page.stem for page in PAGES}
