"""report.html, a scene as one file that needs nothing else, and index.html, the table of a folder of scenes."""

from __future__ import annotations

import re
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kinelast.figures.results import Results
from kinelast.outputs.page.data import kept_positions, model_of, numbers_of
from kinelast.outputs.sealed import json_bytes

WEB = Path(__file__).parent / "web"
SCRIPTS = ("numbers", "dom", "theme", "arrays", "scene", "motion", "tables", "instants", "mechanism", "controls",
           "charts", "curves", "speeds", "sizing", "maps", "answer", "figures", "main")  # fmt: skip


def report_page(results: Results, figures: dict[str, Any], gist: str = "") -> bytes:
    """The page of a scene, UTF-8: it needs nothing but itself and asks for nothing.

    Parameters
    ----------
    figures
        The summary, see `kinelast.figures.summary.summary`: the page prints no other figures than these.
    gist
        The answer in one line, for readers without a script.
    """
    kept = kept_positions(results)
    store = numbers_of(results, kept)
    numbers, packed = store.bytes()
    model = {**model_of(results, kept, store), "packed": packed}
    scene = {"summary": figures, "model": model, "text": results.scene.text}
    words = figures["scene"]
    return filled(
        "report.html",
        {
            "title": text_of(words["title"]),
            "source": text_of(words["source"].strip()),
            "gist": text_of(gist),
            "scene": as_data(scene),
            "numbers": b64encode(numbers),
            "uplot": _chart_library(),
            **shared_parts(SCRIPTS),
        },
    )


def filled(shell: str, parts: dict[str, bytes]) -> bytes:
    """A page from its shell: names in double braces are replaced, once, by parts that are markup already."""
    return b"".join(parts[piece.decode()] if number % 2 else piece for number, piece in enumerate(_shell(shell)))


def as_data(value: Any) -> bytes:
    """JSON that may stand in a page: no text of it can end the element that holds it."""
    return json_bytes(value).replace(b"<", b"\\u003c")


def text_of(words: str) -> bytes:
    """Words as text of a page, never as markup."""
    return escape(words).encode("utf-8", "replace")


@cache
def _shell(name: str) -> list[bytes]:
    return re.split(rb"\{\{(\w+)\}\}", (WEB / name).read_bytes())


@cache
def _script(names: tuple[str, ...]) -> bytes:
    """The files one behind the other, without their comments and indents: a tenth of them."""
    whole = b"\n".join((WEB / f"{name}.js").read_bytes() for name in names)
    return re.sub(rb"(?m)^[ \t]*(//.*\n)?", b"", whole)


def shared_parts(scripts: tuple[str, ...]) -> dict[str, bytes]:
    """Style and script of a page made of these files."""
    return {"style": _style("charts" in scripts), "script": _script(scripts)}


@cache
def _style(charts: bool) -> bytes:
    return (WEB / "style.css").read_bytes() + ((_library() / "uPlot.min.css").read_bytes() if charts else b"")


@cache
def _chart_library() -> bytes:
    """uPlot's script, compressed; the browser inflates it."""
    return b64encode(zlib.compress((_library() / "uPlot.iife.js").read_bytes(), 9))


def _library() -> Path:
    """Where uPlot's files are: here in a wheel; else in the package that carries them, which imports IPython itself."""
    if (WEB / "uPlot.iife.js").is_file():
        return WEB
    found = find_spec("uplot")
    if found is None or not found.submodule_search_locations:
        raise ModuleNotFoundError('the page needs uPlot: install "uplot-python"', name="uplot")
    return Path(found.submodule_search_locations[0]) / "static"


MARK = b'<script type="application/json" id="rows">'  # by which a page of this program is known
INDEX_SCRIPTS = ("numbers", "dom", "theme", "index")
INDEX_TITLE = b"All scenes"  # whatever the folder is called: a batch made anew is the same byte for byte


def index_page(
    out: Path, head: Sequence[str], rows: Sequence[Sequence[str]], seconds: Mapping[str, float] | None = None
) -> bytes:
    """The page of a folder of results, UTF-8: the rows of its summary.csv, linked to the scenes' own pages.

    Parameters
    ----------
    out
        The folder; a row is linked where its report is there.
    head, rows
        Of summary.csv: the first column names the scene's folder in `out`.
    seconds
        That scenes took, by their folders, where they were computed just now.
    """
    taken = {name: round(time, 4) for name, time in (seconds or {}).items()}
    reports = [row[0] for row in rows if (out / row[0] / "report.html").is_file()]
    return filled(
        "index.html",
        {
            "title": INDEX_TITLE,
            "rows": as_data(
                {"head": list(head), "rows": [list(row) for row in rows], "reports": reports, "seconds": taken}
            ),
            **shared_parts(INDEX_SCRIPTS),
        },
    )
