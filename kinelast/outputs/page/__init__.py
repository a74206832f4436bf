"""HTML pages: report on a scene (report.html), comparison of designs (designs.html), list of scenes (index.html).

A scene is a mechanism with its motion. report.html and designs.html contain all scripts and data that they need.
"""

import re
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from kinelast.answers.results import Results
from kinelast.figures.registry import figures_of
from kinelast.outputs.assumptions import assumptions
from kinelast.outputs.page.data import Numbers, kept_positions, model_of, numbers_of
from kinelast.outputs.sealed import json_bytes
from kinelast.outputs.words import checked, headline, to_read, trust_words, verdict_words
from kinelast.reports.report import Report, data_of
from kinelast.scene.parts import PARTS
from kinelast.values.figure import LEAST
from kinelast.values.numbers import SI, DisplayUnits
from rigid.arrays import Integers, Reals

WEB = Path(__file__).parent / "web"
SCRIPTS = ("numbers", "errors", "dom", "fold", "theme", "arrays", "scene", "motion", "tables", "instants", "placing",
           "names", "symbols", "view", "mechanism", "pointing", "controls", "charts", "saved_curves", "curves",
           "speeds", "what_if", "sizing", "maps", "tiles", "answer", "figures", "drives", "breaks_first",
           *(part.key for part in PARTS if (WEB / f"{part.key}.js").is_file()), "main")  # fmt: skip
"""Names of the scripts of report.html, without extension.

The script of a machine part has the name of the tables of the part in a scene file, and adds a section to
`partSections`.
"""


def report_page(results: Results, report: Report) -> bytes:
    """Return report.html, the self-contained report on a scene, in UTF-8."""
    kept = kept_positions(results)
    store = numbers_of(results, kept)
    model = model_of(results, kept, store)
    read = to_read(report)
    said = {
        "verdict": verdict_words(read),
        "trusted": trust_words(read),
        "handout": {"assumptions": assumptions(read), "checked": checked(read)},
    }
    scene = {"summary": data_of(report), "model": model, **said, "text": results.scene.text}
    parts = {
        "title": text_of(report.scene.title),
        "source": text_of(report.scene.source.strip()),
        "gist": text_of(headline(report)),
        "scene": as_data(scene),
        "numbers": b64encode(store.bytes()),
        "uplot": _chart_library(),
    }
    return filled("report.html", SCRIPTS, parts)


@cache
def report_policy() -> str:
    """Return the content security policy of report.html.

    The policy allows the two scripts in report.html, and forbids network access.
    """
    shell = filled("report.html", SCRIPTS, dict.fromkeys(("title", "source", "gist", "scene", "numbers", "uplot"), b""))
    scripts = *re.findall(rb"<script>(.*?)</script>", shell, re.DOTALL), (_library() / "uPlot.iife.js").read_bytes()
    hashes = " ".join(f"'sha256-{b64encode(sha256(script).digest()).decode()}'" for script in scripts)
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:;"
        " base-uri 'none'; form-action 'none'"
    )


def filled(body: str, scripts: tuple[str, ...], parts: Mapping[str, bytes]) -> bytes:
    """Fill the template of a page, and return the page in UTF-8.

    `body` is the file name of the template in `WEB`. `scripts` are the names of JavaScript files without extension. In
    the template, each name in double braces is replaced by the entry of `parts` with this name.
    """
    parts = {**parts, "style": _style("charts" in scripts), "script": _script(scripts)}
    return b"".join(parts[piece.decode()] if number % 2 else piece for number, piece in enumerate(_pieces(body)))


def as_data(value: Any) -> bytes:
    """Return a value as JSON without the character "<", so that the JSON can be part of a script element."""
    return json_bytes(value).replace(b"<", b"\\u003c")


# as in html.escape; the module html also imports a large table of characters, which is slow
ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#x27;"})


def text_of(words: str) -> bytes:
    """Return a text in UTF-8, with the special characters of HTML escaped."""
    return words.translate(ESCAPES).encode("utf-8", "replace")


@cache
def _pieces(body: str) -> list[bytes]:
    """Return the template of a page, split at the names in double braces. Entries with odd indices are the names."""
    shell, _, end = (WEB / "shell.html").read_bytes().partition(b"{{body}}")
    return re.split(rb"\{\{(\w+)\}\}", shell + (WEB / body).read_bytes() + end)


@cache
def _script(names: tuple[str, ...]) -> bytes:
    """Return one script that contains several scripts, without comments and indentation."""
    whole = "\n".join(map(script, names)).encode()
    return re.sub(rb"(?m)^[ \t]*(//.*\n|/\*\*.*\*/\n)?", b"", whole)


def script(name: str) -> str:
    """Return a script without `export` keywords. Browsers would reject them in the joined script of a page."""
    text = (WEB / f"{name}.js").read_text(encoding="utf-8")
    return text.removeprefix("export ").replace("\nexport ", "\n")


@cache
def _style(charts: bool) -> bytes:
    return (WEB / "style.css").read_bytes() + ((_library() / "uPlot.min.css").read_bytes() if charts else b"")


@cache
def _chart_library() -> bytes:
    """Return the script of the chart library uPlot, compressed and in Base64."""
    return b64encode(zlib.compress((_library() / "uPlot.iife.js").read_bytes()))


def _packaged() -> Path | None:
    """Return the folder that contains uPlot in the Python package "uplot", or None if the package is not installed."""
    found = find_spec("uplot")
    places = found.submodule_search_locations if found else None
    return Path(places[0]) / "static" if places else None


def _installed() -> Path | None:
    """Return the folder `web` of the installed kinelast, or None if kinelast is not installed.

    The installed kinelast contains uPlot. If Python imports kinelast from a source tree, `WEB` is another folder, which
    may not contain uPlot.
    """
    from importlib.metadata import PackageNotFoundError, distribution  # a slow import

    try:
        return Path(str(distribution("kinelast").locate_file(WEB.relative_to(WEB.parents[3]))))
    except PackageNotFoundError:
        return None


def _library() -> Path:
    """Return the first folder that contains uPlot: `WEB`, the package "uplot", or `web` of the installed kinelast."""
    for find in (lambda: WEB, _packaged, _installed):
        if (folder := find()) and (folder / "uPlot.iife.js").is_file():
            return folder
    raise ModuleNotFoundError('the page needs uPlot: install "uplot-python"', name="uplot")


MARK = b'<script type="application/json" id="rows">'  # index.html was written by this program if it contains this text
INDEX_SCRIPTS = ("numbers", "dom", "theme", "index")
INDEX_TITLE = b"All scenes"  # without the name of the folder, so that equal results give equal files


def index_page(
    out: Path, head: Sequence[str], rows: Sequence[Sequence[str]], seconds: Mapping[str, float] | None = None
) -> bytes:
    """Return index.html, the list of all scenes with results in a folder, in UTF-8.

    index.html shows the rows of summary.csv, with links to the reports on the scenes.

    Parameters
    ----------
    out
        Folder with the result folders of the scenes.
    head, rows
        Headings and rows of summary.csv. The first column contains the names of the result folders.
    seconds
        Computing times [s] of the scenes that this run has computed. The keys are the names of the result folders.
    """
    taken = {name: round(time, 4) for name, time in (seconds or {}).items()}
    reports = [row[0] for row in rows if (out / row[0] / "report.html").is_file()]
    data = {"head": list(head), "rows": [list(row) for row in rows], "reports": reports, "seconds": taken}
    return filled("index.html", INDEX_SCRIPTS, {"title": INDEX_TITLE, "rows": as_data(data)})


DESIGN_SCRIPTS = (
    "numbers",
    "errors",
    "dom",
    "theme",
    "arrays",
    "design_data",
    "scatter",
    "parallel",
    "design_table",
    "designs",
)
SHOWN = 10_000  # maximum number of designs in designs.html, see `kept_designs`
FRONTS = 6  # designs.html contains the Pareto front of each pair of the first `FRONTS` results
# names of the results for which larger values are better
GREATER = frozenset(("reach", "limits_kept", "limits_margin", "output_travel")).union(
    each.key for each in figures_of(None) if each.over == LEAST
)


def designs_page(
    title: str,
    columns: Mapping[str, Any],
    units: Mapping[str, str],
    reasons: Sequence[str],
    numbers: Sequence[str],
    figures: Sequence[str],
    best: int | None = None,
    pages: Mapping[int, str] | None = None,
    scene: str | None = None,
    options: str = "",
    shown_in: DisplayUnits = SI,
    answered: Mapping[int, Mapping[str, Any]] | None = None,
) -> bytes:
    """Return designs.html, the self-contained comparison of many designs of a scene, in UTF-8.

    Parameters
    ----------
    title
        Title of the scene.
    columns
        Input values and results (such as the largest stress) of all designs, shape (designs,), by name of the column.
        Unknown values are nan.
    units
        Units of the columns, by name of the column.
    reasons
        One text for each design. If a design has no results, the text is the reason. Otherwise the text is empty.
    numbers, figures
        Names of the columns with varied input values (paths in the scene file), and of the columns with results.
    best
        Index of the best design, if known.
    pages
        Addresses of the reports on single designs, by index of the design.
    scene, options
        Name of the scene, and command line options. For a design without a report, the page shows commands that compute
        the report. The commands contain the name of the scene and the options.
    shown_in
        Display units of the scene.
    answered
        Results of the full deflection analysis (e.g. with vibration), by index of the design. An entry contains the
        `theory`, the `verdict`, and the results `figures`, each with `value` and `error`.

    Raises
    ------
    ValueError
        Two columns have different lengths, or a name in `numbers` or `figures` has no column.
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
    data = {
        "arrays": store.places,
        "count": len(kept),
        "of": count,
        "units": {name: units.get(name, "1") for name in values},
        "shown_in": shown_in,
        "numbers": list(numbers),
        "figures": list(figures),
        "axes": first_axes(numbers, figures),
        "greater": [name for name in figures if is_greater(name)],
        "reasons": list(words),
        "failed": sum(map(bool, reasons)),
        "best": best,
        "pages": {str(design): address for design, address in (pages or {}).items()},
        "answered": {str(design): dict(figures) for design, figures in (answered or {}).items()},
        "scene": scene,
        "options": options,
    }
    heading = text_of(title)
    parts = {"title": b"Designs: " + heading, "heading": heading, "designs": as_data(data)}
    return filled("designs.html", DESIGN_SCRIPTS, {**parts, "numbers": b64encode(store.bytes())})


def first_axes(numbers: Sequence[str], figures: Sequence[str]) -> list[str]:
    """Return the names of the columns on the horizontal and vertical axis of the first plot in designs.html.

    The vertical axis shows a result. The horizontal axis shows an input value or another result.

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
    """Return True if larger values of the result with the name `figure` are better."""
    return figure.partition(".")[0] in GREATER


def kept_designs(count: int, figures: Sequence[Any], best: int | None) -> Integers:
    """Return the indices of the designs that designs.html contains.

    If there are more than `SHOWN` designs, return the best design, the designs on the Pareto fronts of two results, and
    a random selection of the other designs.

    Parameters
    ----------
    figures
        An array for each result, shape (designs,). Smaller values are better. Pareto fronts are computed for all pairs
        of the first `FRONTS` results.
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
    """Return the indices of the designs on the Pareto front of two results, sorted by the first result.

    `first` and `second` are the two results, shape (designs,). Smaller values are better. Designs with an unknown
    result are left out.

    Examples
    --------
    >>> front(np.array([1.0, 2.0, 3.0, 2.5]), np.array([3.0, 1.0, 0.5, 2.0])).tolist()
    [0, 1, 2]
    """
    known = np.flatnonzero(np.isfinite(first) & np.isfinite(second))
    order: Integers = known[np.lexsort((second[known], first[known]))]
    least = np.minimum.accumulate(np.concatenate([[np.inf], second[order]]))
    return order[second[order] < least[:-1]]
