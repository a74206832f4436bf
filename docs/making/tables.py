"""Reference of summary.json and of each table of the command: keys and columns of real runs, described.

A key or column without description, unless it is a figure of the registry or a field, stops the build.
"""

import csv
import json
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from figures import all_figures
from runs import run

from elastic import FIELDS
from kinelast.outputs.batch import HEAD as BATCH
from kinelast.outputs.sensitivities import HEAD as SENSITIVITIES
from kinelast.outputs.sensitivities import SAMPLED
from kinelast.outputs.studies import HEAD as OPTIMUM

SCENE, SPEEDS = "press_sweep", "20 rad/s : 40 rad/s : 3"
WORDS = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
MARKS = {
    "FIELD": "|".join(FIELDS), "FIGURE": rf"(?:{'|'.join(map(re.escape, all_figures()))})(?:\..*)?", "PATH": r".+\..+",
    "DRIVE": "crank", "LINK": "crank|rod|piston", "POINT": "A|B", "JOINT": "O|A|B|guide",
}  # fmt: skip
"""Names that the patterns of columns match in the examined run."""
HEAD = """# Keys and columns

This page lists the keys and columns of example runs. [Figures](figures.md) has the figures. All values are in SI units
and radians, except in `positions.csv` and `motion.csv` (the scene's `report_units`) and in `designs.csv` (the units of
the scene's file).
"""
ROWS = "| column | unit | meaning |\n| --- | --- | --- |\n"


def page() -> str:
    """Return the page of all tables."""
    folder = run([SCENE], "--motion", "--speeds", SPEEDS, "--theory", "quasi-static") / SCENE
    designs = run([SCENE], "--sweep", "--pages", "0") / SCENE / "designs.csv"
    tolerances = ["figure", "unit", "value", "in full", "error", "theory", "first order deviation", "first order worst",
                  *SAMPLED, "share of PATH", "share of PATH with others"]  # fmt: skip
    parts = [
        HEAD,
        _part("summary.json", "a *figure* has a value, a unit and, if known, its place", _summary(folder)),
        _part("positions.csv", "one row per position", _columns(folder / "positions.csv", "position")),
        _part("motion.csv", "one row per position, with `--motion`", _columns(folder / "motion.csv", "position")),
        _part("speeds.csv", "one row per speed, with `--speeds`", _columns(folder / "speeds.csv", "speed")),
        _part("designs.csv", "one row per design, with `--sweep`", _columns(designs, "design")),
        _part(
            "sensitivities.csv",
            "one row per figure and number, with `--sensitivities`",
            _described(SENSITIVITIES, "sensitivities"),
        ),
        _part("tolerances.csv", "one row per figure, with `--tolerances`", _described(tolerances, "tolerances")),
        _part(
            "optimum.csv",
            "one row for the goal, each variable and each limit, with `--optimize`",
            _described(OPTIMUM, "optimum"),
        ),
        _part("summary.csv", "one row per scene of a batch", _described([name for name, _ in BATCH], "scenes")),
    ]
    return "\n".join(parts)


def _part(file: str, words: str, table: str) -> str:
    return f"## `{file}`\n\n{words[0].upper()}{words[1:]}.\n\n{table}"


def _described(names: Sequence[str], table: str) -> str:
    words = WORDS[table]
    if missing := {*names} - words.keys():
        raise ValueError(f"columns without description: {', '.join(sorted(missing))}")
    rows = "".join(f"| `{name}` | {words[name]} |\n" for name in dict.fromkeys(names))
    return f"| column | meaning |\n| --- | --- |\n{rows}"


def _columns(path: Path, table: str) -> str:
    """Rows of the columns of a file, in its order, grouped by kind.

    Raises
    ------
    ValueError
        Unknown column.
    """
    with path.open(encoding="utf-8", newline="") as file:
        heads = [re.fullmatch(r"(.*?)(?: \[(.*)\])?", head) for head in next(csv.reader(file))]
    met: dict[tuple[str, str], dict[str, None]] = {}
    for head in heads:
        assert head is not None
        for pattern, shown, meaning in WORDS[table]:
            if _is(head[1], pattern):
                met.setdefault((shown, meaning), {})[head[2] or ""] = None
                break
        else:
            raise ValueError(f"{path.name}: the column {head[1]} has no description")
    return ROWS + "".join(
        f"| {', '.join(f'`{name}`' for name in shown.split(', '))} | {', '.join(filter(None, units))} | {meaning} |\n"
        for (shown, meaning), units in met.items()
    )


def _is(name: str, pattern: str) -> bool:
    """Return True if a column matches a pattern."""
    for mark, those in MARKS.items():
        pattern = pattern.replace(mark, f"(?:{those})")
    return re.fullmatch(pattern, name) is not None


def _summary(folder: Path) -> str:
    data = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    if missing := data.keys() - WORDS["summary"].keys():
        raise ValueError(f"summary.json: keys without description: {', '.join(sorted(missing))}")
    order = [*data, *(key for key in WORDS["summary"] if key not in data)]
    rows = "".join(
        f"| `{key}` | {WORDS['summary'][key]} | {_shape(data[key]) if key in data else 'on request'} |\n"
        for key in order
    )
    return f"| key | meaning | content |\n| --- | --- | --- |\n{rows}"


def _shape(value: Any) -> str:  # noqa: PLR0911 - a line a kind
    """Structure of a value of summary.json, in words."""
    match value:
        case None:
            return "`null` in the example"
        case {"value": _, "unit": _, **more}:
            return f"figure{f' with {_names(more)}' if more else ''}"
        case dict() if isinstance(first := next(iter(value.values()), None), dict) and _alike(value):
            return f"by name: {_shape(first)}".replace("by name: by name: ", "by two names: ")
        case dict():
            return _names(value) if value else "by name"
        case [dict() as first, *_]:
            return f"list of {_shape(first)}"
        case list():
            return "list"
    return {bool: "true or false", str: "text"}.get(type(value), "number")


def _alike(value: dict[str, Any]) -> bool:
    """Return True if all entries of a table have the same keys."""
    return len({tuple(each) if isinstance(each, dict) else None for each in value.values()}) == 1


def _names(value: dict[str, Any]) -> str:
    return ", ".join(f"`{key}`" for key in value)
