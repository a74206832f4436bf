"""Pages that need nothing else: of a scene (report.html), its designs (designs.html), a folder (index.html)."""

from __future__ import annotations

import re
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from html import escape
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from kinelast.figures.drives import CAM_FIGURES
from kinelast.figures.entry import LEAST
from kinelast.figures.results import Results
from kinelast.outputs.page.data import Numbers, kept_positions, model_of, numbers_of
from kinelast.outputs.sealed import json_bytes
from kinelast.outputs.words import verdict_words
from kinelast.scene.numbers import SI, ToldIn
from kinelast.scene.parts.bearings import BEARINGS
from kinelast.scene.parts.fatigue import FATIGUE
from rigid.arrays import Integers, Reals

WEB = Path(__file__).parent / "web"
SCRIPTS = ("numbers", "dom", "fold", "theme", "arrays", "scene", "motion", "tables", "instants", "names", "mechanism",
           "controls", "charts", "curves", "speeds", "what_if", "sizing", "maps", "answer", "figures", "drives",
           "cams", "joints", "main")  # fmt: skip


def report_page(
    results: Results, figures: dict[str, Any], gist: str = "", handout: Mapping[str, Any] | None = None
) -> bytes:
    """The page of a scene, UTF-8: it needs nothing but itself and asks for nothing.

    Parameters
    ----------
    figures
        The summary, see `kinelast.figures.summary.summary`: the page prints no other figures than these.
    gist
        The answer in one line, for readers without a script.
    handout
        Words of the one-page print, see `kinelast.outputs.handout.handout`.
    """
    kept = kept_positions(results)
    store = numbers_of(results, kept)
    numbers, packed = store.bytes()
    model = {**model_of(results, kept, store), "packed": packed}
    said = {"verdict": verdict_words(figures), "handout": handout}
    scene = {"summary": figures, "model": model, **said, "text": results.scene.text}
    words = figures["scene"]
    parts = {
        "title": text_of(words["title"]),
        "source": text_of(words["source"].strip()),
        "gist": text_of(gist),
        "scene": as_data(scene),
        "numbers": b64encode(numbers),
        "uplot": _chart_library(),
    }
    return filled("report.html", SCRIPTS, parts)


@cache
def report_policy() -> str:
    """Return the content security policy of a report: only its own two scripts run, and nothing is fetched."""
    shell = filled("report.html", SCRIPTS, dict.fromkeys(("title", "source", "gist", "scene", "numbers", "uplot"), b""))
    scripts = *re.findall(rb"<script>(.*?)</script>", shell, re.DOTALL), (_library() / "uPlot.iife.js").read_bytes()
    hashes = " ".join(f"'sha256-{b64encode(sha256(script).digest()).decode()}'" for script in scripts)
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:;"
        " base-uri 'none'; form-action 'none'"
    )


def filled(body: str, scripts: tuple[str, ...], parts: Mapping[str, bytes]) -> bytes:
    """A page from its body and scripts: names in double braces are replaced, once, by parts that are markup already."""
    parts = {**parts, "style": _style("charts" in scripts), "script": _script(scripts)}
    return b"".join(parts[piece.decode()] if number % 2 else piece for number, piece in enumerate(_pieces(body)))


def as_data(value: Any) -> bytes:
    """JSON that may stand in a page: no text of it can end the element that holds it."""
    return json_bytes(value).replace(b"<", b"\\u003c")


def text_of(words: str) -> bytes:
    """Words as text of a page, never as markup."""
    return escape(words).encode("utf-8", "replace")


@cache
def _pieces(body: str) -> list[bytes]:
    """The shell of all pages with a body, cut at the names of its parts."""
    shell, _, end = (WEB / "shell.html").read_bytes().partition(b"{{body}}")
    return re.split(rb"\{\{(\w+)\}\}", shell + (WEB / body).read_bytes() + end)


@cache
def _script(names: tuple[str, ...]) -> bytes:
    """Return scripts joined into one, without comments and indents."""
    whole = b"\n".join((WEB / f"{name}.js").read_bytes() for name in names)
    return re.sub(rb"(?m)^[ \t]*(//.*\n|/\*\*.*\*/\n)?", b"", whole)


@cache
def _style(charts: bool) -> bytes:
    return (WEB / "style.css").read_bytes() + ((_library() / "uPlot.min.css").read_bytes() if charts else b"")


@cache
def _chart_library() -> bytes:
    """uPlot's script, compressed; the browser inflates it."""
    return b64encode(zlib.compress((_library() / "uPlot.iife.js").read_bytes()))


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
    data = {"head": list(head), "rows": [list(row) for row in rows], "reports": reports, "seconds": taken}
    return filled("index.html", INDEX_SCRIPTS, {"title": INDEX_TITLE, "rows": as_data(data)})


DESIGN_SCRIPTS = ("numbers", "dom", "theme", "arrays", "design_data", "scatter", "parallel", "design_table", "designs")
SHOWN = 10_000  # designs that a page holds: of more, the fronts and a random part
FRONTS = 6  # figures of which every pair has its front among those
GREATER = frozenset(  # figures that are better large
    ("safety", "transmission_angle", "reach", "limits_kept", "limits_margin", "output_travel")
).union(each.key for each in (*BEARINGS.figures, *FATIGUE.figures, *CAM_FIGURES) if each.over == LEAST)


def designs_page(
    title: str,
    columns: Mapping[str, Any],
    units: Mapping[str, str],
    reasons: Sequence[str],
    numbers: Sequence[str],
    figures: Sequence[str],
    best: int | None = None,
    sensitivities: Mapping[str, Mapping[str, float]] | None = None,
    pages: Mapping[int, str] | None = None,
    scene: str | None = None,
    options: str = "",
    told_in: ToldIn = SI,
    answered: Mapping[int, Mapping[str, Any]] | None = None,
) -> bytes:
    """The page of many designs, UTF-8: it needs nothing but itself and asks for nothing.

    Parameters
    ----------
    title
        Of the scene.
    columns
        By name the values of all designs, shape (designs,), nan where unknown.
    units
        By the same names.
    reasons
        Per design why it has no figures; empty where all is well.
    numbers, figures
        Names of the columns that were changed, as paths in the scene, and of those that came out of it.
    best
        Number of the design that was found best, counted from 0.
    sensitivities
        Per figure, by how many per cent it grows where a number grows by 1 %.
    pages
        Addresses of the pages of single designs, beside this one, by their numbers.
    scene, options
        What the command calls the scene, and the options by which a design's single run has the figures of this page:
        designs without a page are told the commands that make it.
    told_in
        Units that the scene's quantities are told in.
    answered
        Full answers by the numbers of their designs: `theory`, `verdict`, and `figures` with `value` and `error`.

    Raises
    ------
    ValueError
        Columns of unlike lengths, or a name without its column.
    """
    count = len(reasons)
    for name in (*numbers, *figures):
        if name not in columns or np.shape(columns[name]) != (count,):
            found = np.shape(columns[name]) if name in columns else "none"
            raise ValueError(f"column {name!r}: expected shape ({count},), got {found}")
    values = {name: np.asarray(columns[name], float) for name in (*numbers, *figures)}
    kept = kept_designs(count, [values[name] * (-1 if is_greater(name) else 1) for name in figures], best)
    store = Numbers()
    store.add("#design", kept.astype(float))
    for name, column in values.items():
        store.add(name, column[kept])
    words = dict.fromkeys(reasons[at] for at in kept)
    store.add("#reason", np.array([list(words).index(reasons[at]) for at in kept], float), "f")
    packed, is_packed = store.bytes()
    data = {
        "arrays": store.places,
        "packed": is_packed,
        "count": len(kept),
        "of": count,
        "units": {name: units.get(name, "1") for name in values},
        "told_in": told_in,
        "numbers": list(numbers),
        "figures": list(figures),
        "axes": first_axes(numbers, figures),
        "greater": [name for name in figures if is_greater(name)],
        "reasons": list(words),
        "failed": sum(map(bool, reasons)),
        "best": best,
        "sensitivities": {figure: dict(row) for figure, row in (sensitivities or {}).items()},
        "pages": {str(design): address for design, address in (pages or {}).items()},
        "answered": {str(design): dict(told) for design, told in (answered or {}).items()},
        "scene": scene,
        "options": options,
    }
    heading = text_of(title)
    parts = {"title": b"Designs: " + heading, "heading": heading, "designs": as_data(data)}
    return filled("designs.html", DESIGN_SCRIPTS, {**parts, "numbers": b64encode(packed)})


def first_axes(numbers: Sequence[str], figures: Sequence[str]) -> list[str]:
    """Columns that a page shows at first, across and up: one number against a figure, or two figures.

    Examples
    --------
    >>> first_axes(["depth", "width"], ["deflection", "stress", "mass"])
    ['mass', 'deflection']
    >>> first_axes(["depth"], ["deflection"])
    ['depth', 'deflection']
    """
    lead, *others = (*figures, *numbers)
    if not figures or len(numbers) == 1:
        return [numbers[0], lead]
    return ["mass" if "mass" in figures and lead != "mass" else [*others, lead][0], lead]


def is_greater(figure: str) -> bool:
    """Whether a figure is better the larger it is."""
    return figure.split(".", maxsplit=1)[0] in GREATER


def kept_designs(count: int, figures: Sequence[Any], best: int | None) -> Integers:
    """Numbers of the designs that a page holds: all, or the fronts of pairs of figures, the best, and a random part.

    Parameters
    ----------
    figures
        Per figure its values, shape (designs,), less being better; the first ones have fronts.
    """
    if count <= SHOWN:
        return np.arange(count)
    pairs = combinations(figures[:FRONTS], 2) if len(figures) > 1 else [(figures[0], figures[0])]
    fronts = [front(*pair) for pair in pairs]
    random, chosen = np.random.default_rng(0), np.array([] if best is None else [best], int)
    first = np.setdiff1d(np.concatenate(fronts), chosen)
    first = random.choice(first, min(len(first), SHOWN - len(chosen)), replace=False)
    others = np.setdiff1d(np.arange(count), [*chosen, *first])
    return np.sort(
        np.concatenate([chosen, first, random.choice(others, SHOWN - len(chosen) - len(first), replace=False)])
    )


def front(first: Reals, second: Reals) -> Integers:
    """Pareto front of two figures, shape (designs,), less being better: numbers of its designs, by the first figure.

    Examples
    --------
    >>> front(np.array([1.0, 2.0, 3.0, 2.5]), np.array([3.0, 1.0, 0.5, 2.0])).tolist()
    [0, 1, 2]
    """
    known = np.flatnonzero(np.isfinite(first) & np.isfinite(second))
    order: Integers = known[np.lexsort((second[known], first[known]))]
    least = np.minimum.accumulate(np.concatenate([[np.inf], second[order]]))
    ahead: Integers = order[second[order] < least[:-1]]
    return ahead
