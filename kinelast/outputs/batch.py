"""A scene in one line: its headline on the terminal, and its row in the tables of all scenes of a batch.

The tables are summary.csv, index.html, and summary.parquet where that is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kinelast.figures.cycle import WELL
from kinelast.figures.inputs import CAUTION, GOOD, INPUTS, OPEN, POOR
from kinelast.figures.limits import VERDICTS
from kinelast.figures.trust import digits_left
from kinelast.outputs.outbox import rewritten
from kinelast.outputs.page import MARK, index_page
from kinelast.outputs.table import Column, Table, csv_bytes, csv_rows, parquet_bytes
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.error import plain
from kinelast.scene.numbers import UNRELIABLE, ToldIn, beside, coordinate, error_percent, number, percent, quantity
from kinelast.tasks.task import Outcome

OUTCOMES = {words: outcome for outcome, words in VERDICTS.items()}
HEAD = (("scene", ""), ("state", ""), ("status", ""), ("verdict", ""), ("decides", ""), ("used", "1"),
        ("largest_deflection", "m"), ("beam", ""),
        ("largest_chord", "m"), ("bent_beam", ""), ("largest_stress", "Pa"), ("stressed_beam", ""), ("safety", "1"),
        ("output_error", "m"), ("output_error", "rad"), ("output", ""), ("condition", "1"), ("grade", ""),
        ("check", ""), ("message", ""))  # fmt: skip
FEW = 2  # limits that a headline tells one by one
LEVELS = {CAUTION: "use with caution", POOR: "not reliable", OPEN: "not known"}
"""How far to trust the figures, as the page says it too."""


def summary_row(outcome: Outcome, name: str) -> list[Any]:
    """A scene's row of summary.csv; None where there is no figure."""
    figures: Mapping[str, Any] = outcome.figures
    deflection, stress = figures.get("largest_deflection") or {}, figures.get("largest_stress") or {}
    safety = figures["strength"][stress["label"]]["safety_factor"]["value"] if stress else None
    condition = figures["run"]["largest_condition"]["value"] if figures else None
    check = (figures.get("check") or {"passed": None})["passed"]
    grade = figures["reliability"]["level"] if figures else ""
    passed = "" if check is None else "agrees" if check else "differs"
    chord, output = figures.get("largest_chord") or {}, figures.get("output") or {}
    judged = figures["acceptance"]["verdict"] if figures else ""
    decides, used = _decides(figures) if judged else ("", None)
    errors = [output.get("value") if output.get("unit") == unit else None for unit in ("m", "rad")]
    cells = [name, outcome.state, outcome.status, judged, decides, used,
             deflection.get("value"), deflection.get("label"), chord.get("value"), chord.get("label"),
             stress.get("value"), stress.get("label"), safety, *errors, output.get("name"), condition, grade, passed,
             "" if figures else outcome.line]  # fmt: skip
    return [plain(cell, 300) if isinstance(cell, str) else cell for cell in cells]


def _decides(figures: Mapping[str, Any]) -> tuple[str, float | None]:
    """The most used limit of the worst outcome beside its figure, and its used share; or that a link buckles."""
    if figures["buckles"]:
        return figures["buckles"], None
    worst = OUTCOMES[figures["acceptance"]["verdict"]]
    return next((words, used) for words, used, outcome in limit_rows(figures) if outcome == worst)


def write_batch(
    out: Path, rows: Mapping[str, Sequence[Any]], seconds: Mapping[str, float], others: Sequence[str] = ()
) -> None:
    """Write a row a scene, instead of older rows of these, beside the rows of others that still have their folders.

    Parameters
    ----------
    rows, seconds
        By the names of the scenes' folders in `out`: see `summary_row`, and how long each took.
    others
        Other formats of tables, of which Parquet is written. An older Parquet table follows the new rows unasked.

    Raises
    ------
    RequestError
        A file of somebody else has the name of one of these.
    OSError
        It cannot be written.
    """
    path, head = out / "summary.csv", _table([]).headings

    def merged() -> bytes:
        before = csv_rows(path)[1:] if path.exists() else []
        kept = {row[0]: _read(row) for row in before if len(row) == len(HEAD) and (out / row[0]).is_dir()}
        return csv_bytes(_table([*{**kept, **rows}.values()]))

    rewritten(path, lambda: (csv_rows(path) or [[]])[0] == head, merged)
    whole = csv_rows(path)[1:]
    index = out / "index.html"
    rewritten(index, lambda: MARK in index.read_bytes(), lambda: index_page(out, head, whole, seconds))
    parquet = out / "summary.parquet"
    if "parquet" in others or (parquet.exists() and find_spec("pyarrow")):
        about = {"kinelast": "summary"}
        rewritten(parquet, lambda: _marked(parquet), lambda: parquet_bytes(_table(list(map(_read, whole))), about))


def _table(rows: Sequence[Sequence[Any]]) -> Table:
    cells = list(zip(*rows, strict=True)) or [()] * len(HEAD)
    return Table(tuple(Column(name, values, unit) for (name, unit), values in zip(HEAD, cells, strict=True)))


def _read(row: Sequence[str]) -> list[Any]:
    """A row of summary.csv as it was before it was written."""
    return [
        (float(cell) if cell else None) if unit else int(cell) if name == "status" else cell or None
        for (name, unit), cell in zip(HEAD, row, strict=True)
    ]


def _marked(path: Path) -> bool:
    from pyarrow import parquet

    return b"kinelast" in (parquet.read_schema(path).metadata or {})


def headline(figures: Mapping[str, Any]) -> str:
    """Headline of a scene: its figures in one line."""
    if figures["buckles"]:
        filmed = "; filmed is the motion" if figures["made_from"]["options"]["animate"] else ""
        return f"{_verdict(figures)}; there is no deflection, stress or safety factor{filmed}"
    words = ["nothing bends: no link has beams" if not figures["links"] else "no position could be computed"]
    largest, accepted, told_in = figures["largest_deflection"], figures["acceptance"], figures["told_in"]
    if largest:
        place = quantity(largest["along_member"]["value"], "m", 3, told_in)
        drives = (
            f"{name} at {coordinate(item['value'], item['unit'], told_in)}" for name, item in largest["drive"].items()
        )
        size = quantity(abs(largest["value"]), largest["unit"], told_in=told_in)
        where = ", ".join((largest["member"], f"{place} along it", *drives))
        words = [f"largest deflection {size}{error_words(largest)} ({where})"]
    stress = figures["largest_stress"]
    if stress:
        safety = figures["strength"][stress["label"]]["safety_factor"]["value"]
        size = quantity(stress["value"], "Pa", 3, told_in)
        words.append(f"stress {size}{error_words(stress)} ({stress['member']}{_safe(safety)})")
    words += _run(figures["run"])
    if figures["check"]:
        words.append(check_words(figures["check"]))
    words += _theory(figures)
    if figures["made_from"]["options"]["animate"] and not figures["links"]:
        words.append("filmed is the motion: nothing is drawn along links without beams")
    if accepted["verdict"]:
        words.insert(0, _verdict(figures))
    level, reasons = figures["reliability"]["level"], figures["reliability"]["reasons"]
    if level != GOOD:
        words.append(f"{LEVELS[level]}: {', '.join(reasons)}")
    return "; ".join(words)


def _run(run: Mapping[str, Any]) -> Iterator[str]:
    """Positions of a run that are missing or in doubt."""
    condition = run["largest_condition"]["value"]
    if condition is not None and condition > WELL:
        yield f"near a dead point: {digits_left(condition)} digits left there"
    if run["singular"]:
        yield f"{run['singular']} positions without figures, at dead points"
    if run["one_position"]:
        yield "at one position"
    if run["locked"]:
        yield f"{run['locked']} positions that friction may lock"
    if run["interrupted"]:
        yield f"PARTIAL: interrupted at {quantity(run['interrupted']['value'], 's')}"
    elif run["left_out"]:
        yield f"{run['left_out']} positions out of reach"


def error_words(row: Mapping[str, Any]) -> str:
    """Return the relative error of a figure as a suffix of its value, empty if it is unknown or zero."""
    if not row.get("error") or not row["value"]:
        return ""
    share = abs(row["error"] / row["value"])
    marks = [" measured" if row.get("error_measured") else "", " (unreliable)" if share > UNRELIABLE else ""]
    return f" ± {error_percent(share)}{''.join(marks)}"


def _verdict(figures: Mapping[str, Any]) -> str:
    """The verdict on the limits, with those that decide it, or that a link buckles."""
    accepted, told_in = figures["acceptance"], figures["told_in"]
    if figures["buckles"]:
        return f"{accepted['verdict'].upper()}: {figures['buckles']}"
    lasts, verdict = figures["run"]["end"]["value"] - figures["run"]["start"]["value"], accepted["verdict"]
    if accepted["passed"]:
        nearest, among = max(accepted["limits"], key=lambda row: row["used"] or 0.0), len(accepted["limits"])
        words = f"{verdict}: {_beside_limit(nearest, told_in, lasts)}"
        return f"{words}, the nearest of {among} limits" if among > 1 else words
    decides = _deciding(figures)
    many = f"{len(decides)} of {len(accepted['limits'])} limits"
    words = f"{verdict.upper()}: {many if len(decides) > FEW else ', '.join(decides)}"
    return f"{words}: {accepted['problem']}" if accepted["problem"] else words


def limit_lines(figures: Mapping[str, Any]) -> list[str]:
    """The limits that decide the verdict beside their figures, where they are too many for the headline."""
    if figures["buckles"]:
        return []
    passed = figures["acceptance"]["passed"] or not figures["acceptance"]["verdict"]
    decides = [] if passed else _deciding(figures)
    return decides if len(decides) > FEW else []


def verdict_words(figures: Mapping[str, Any]) -> str:
    """The verdict on the limits, with those that decide it."""
    return _verdict(figures) if figures["acceptance"]["verdict"] else "no limits are set"


def limit_rows(figures: Mapping[str, Any]) -> list[tuple[str, float | None, str]]:
    """Limits beside their figures, the share of each that is used, and its outcome; the most used first."""
    run, told_in = figures["run"], figures["told_in"]
    lasts = run["end"]["value"] - run["start"]["value"]
    rows = sorted(figures["acceptance"]["limits"], key=lambda row: -math.inf if row["used"] is None else -row["used"])
    return [(_beside_limit(row, told_in, lasts), row["used"], row["outcome"]) for row in rows]


def _deciding(figures: Mapping[str, Any]) -> list[str]:
    """The limits of the worst outcome beside their figures, in a few words each."""
    accepted, run = figures["acceptance"], figures["run"]
    lasts, worst = run["end"]["value"] - run["start"]["value"], OUTCOMES[accepted["verdict"]]
    return [_beside_limit(row, figures["told_in"], lasts) for row in accepted["limits"] if row["outcome"] == worst]


def _beside_limit(row: Mapping[str, Any], told_in: ToldIn, lasts: float) -> str:
    """A figure beside its limit, in a few words; of a run that lasts so long [s]."""
    value, limit = row["found"], row["limit"]
    endless = value["value"] is None and "endless" in value
    if value["value"] is None and not endless:
        return _called(row)
    bound = math.inf if limit["value"] is None else limit["value"]  # which JSON has not
    size, allowed = beside(math.inf if endless else value["value"], bound, limit["unit"], told_in)
    if endless:
        size = f"not settled within the {quantity(lasts, 's')} computed" if row["kind"] == "settling" else "endless"
    known = error_words(value).removesuffix(" (unreliable)")  # the verdict counts it
    return f"{_called(row)} {size}{known}, {'at least' if row['least'] else 'allowed'} {allowed}"


def _called(row: Mapping[str, Any]) -> str:
    """A limit by its key, where it has one of its own; else by its figure and item."""
    if row["kind"] in ("deflection", "chord", "safety", "output"):
        return str(row["kind"])
    return f"{row['name']} ({row['on']})" if row["on"] else str(row["name"])


def questions(figures: Mapping[str, Any]) -> list[str]:
    """Questions about the scene's inputs: most likely slips of a unit."""
    return [finding["text"] for finding in figures["trust"] if finding["heading"] == INPUTS]


def _theory(figures: Mapping[str, Any]) -> list[str]:
    """The theory and how far it is off, and results of further checks."""
    theory, words = figures["theory"], []
    if theory["error"] is not None and theory["reached"] is False:
        words.append(f"{theory['name']}, {percent(theory['accuracy'])} asked, {reached_words(theory)}")
    elif theory["problem"] and figures["links"]:
        unknown = (
            "" if theory["problem"] in figures["acceptance"]["problem"] else f", error unknown: {theory['problem']}"
        )
        words.append(f"{theory['name']}{unknown}")
    elif theory["error"] is not None and figures["links"]:
        words.append(theory["name"])
    return [*words, *further_checks(figures)]


def further_checks(figures: Mapping[str, Any]) -> list[str]:
    """The outcomes of the checks of the whole mechanism, and of links as plane bodies."""
    words = []
    for key, name in (("nonlinear_check", "nonlinear check"), ("solid_check", "solid check")):
        if figures[key] and "problem" in figures[key]:
            words.append(f"{name} CANNOT BE MADE: {figures[key]['problem']}")
        elif figures[key] and figures[key]["largest"] is not None:
            passed = figures[key].get("passed")
            outcome = "" if passed is None else " agrees" if passed else " FAILED"
            without = figures[key].get("left_out")
            more = f", without {', '.join(without)}" if without else ""
            if figures[key].get("too_close_to_decide"):
                outcome = " TOO CLOSE TO DECIDE"
                more += f", itself up to {percent(sum(figures[key]['own_errors'].values()))} off"
            if figures[key].get("cannot_tell"):
                words.append(f"{name} cannot tell: the stated error is larger than the answer")
                continue
            words.append(f"{name}{outcome} ({percent(figures[key]['largest'])} apart{more})")
    return words


def reached_words(theory: Mapping[str, Any]) -> str:
    """The accuracy that was reached, where it is not that which was asked for."""
    if theory["error"] > theory["accuracy"]:
        largest = max(theory["errors"], key=lambda part: theory["errors"][part] or 0.0)
        return f"{percent(theory['error'])} reached in the {theory['figure']}: mostly {largest}"
    name, share = max(theory["courses"].items(), key=lambda item: item[1] or 0.0)
    return f"{percent(share)} reached in the course of {name}"


def check_words(check: Mapping[str, Any]) -> str:
    """The outcome of the check by finite elements, with the largest differences."""
    if check["passed"] is None:
        return "check has nothing to compare"
    sizes = [] if check["largest"] is None else [number(check["largest"], 2)]
    for theory, balance in check["momentum"].items():
        if balance["compared"]:
            of = "" if theory == QUASI_STATIC else f" of {theory} links"
            sizes.append(f"momentum{of} {'' if balance['passed'] else 'OFF BY '}{number(balance['largest'], 2)}")
    return f"check {'agrees' if check['passed'] else 'FAILED'} ({', '.join(sizes)})"


def _safe(factor: float | None) -> str:
    return "" if factor is None else f", safety {factor:.3g}"
