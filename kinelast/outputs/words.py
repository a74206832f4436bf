"""Sentences of a report, for the terminal, the page and the print: headline, verdict, limits, errors, checks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from kinelast.figures.cycle import WELL
from kinelast.figures.inputs import CAUTION, GOOD, INPUTS, OPEN, POOR
from kinelast.figures.limits import VERDICTS
from kinelast.figures.trust import digits_left
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.numbers import ToldIn, beside, coordinate, error_percent, number, percent, quantity
from rigid import counted

OUTCOMES = {words: outcome for outcome, words in VERDICTS.items()}
MAX_NAMED = 3  # limits that a verdict names; it counts the others
LEVELS = {CAUTION: "use with caution", POOR: "not reliable", OPEN: "not known"}
LIMIT_NAMES = {
    "deflection": "deflection",
    "chord": "deflection from chord",
    "safety": "safety",
    "output": "output error",
}


def headline(figures: Mapping[str, Any]) -> str:
    """Return the answer in one line: verdict, largest deflection, stress, checks, doubts."""
    accepted, told_in, links = figures["acceptance"], figures["told_in"], figures["links"]
    verdict = verdict_words(figures)
    if accepted["passed"] is not True:
        verdict = accepted["verdict"].upper() + verdict.removeprefix(accepted["verdict"])
    filmed = figures["made_from"]["options"]["animate"] and "the film shows the motion of rigid links"
    if figures["buckles"]:
        return "; ".join(filter(None, (verdict, "there is no deflection, stress or safety factor", filmed)))
    words = [verdict] if accepted["verdict"] else []
    if figures["yields"] and figures["yields"] not in verdict:
        words.append(figures["yields"])
    if largest := figures["largest_deflection"]:
        place = quantity(largest["along_member"]["value"], "m", 3, told_in)
        drives = (
            f"{name} at {coordinate(item['value'], item['unit'], told_in)}" for name, item in largest["drive"].items()
        )
        size = quantity(abs(largest["value"]), largest["unit"], told_in=told_in) + error_words(largest, told_in)
        words.append(f"largest deflection {size} ({', '.join((largest['member'], f'{place} along it', *drives))})")
    else:
        words.append("no position could be computed" if links else "nothing bends: no link has beams")
    if stress := figures["largest_stress"]:
        factor = figures["strength"][stress["label"]]["safety_factor"]["value"]
        safety = "" if factor is None else f", safety {factor:.3g}"
        size = quantity(stress["value"], "Pa", 3, told_in) + error_words(stress, told_in)
        words.append(f"stress {size} ({stress['member']}{safety})")
    words += _run(figures["run"])
    if figures["check"]:
        words.append(check_words(figures["check"]))
    words += _theory(figures)
    if filmed and not links:
        words.append(filmed)
    level, reasons = figures["reliability"]["level"], figures["reliability"]["reasons"]
    if level != GOOD:
        words.append(f"{LEVELS[level]}: {', '.join(reasons)}")
    return "; ".join(words)


def _run(run: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences on missing and ill-conditioned positions."""
    condition = run["largest_condition"]["value"]
    if condition is not None and condition > WELL:
        yield f"near a dead point: {digits_left(condition)} digits are certain there"
    if run["singular"]:
        yield f"{counted(run['singular'], 'position')} without figures, at dead points"
    if run["one_position"]:
        yield "at one position"
    if run["locked"]:
        yield f"friction may lock {counted(run['locked'], 'position')}"
    if run["interrupted"]:
        yield f"PARTIAL: interrupted at {quantity(run['interrupted']['value'], 's')}"
    elif run["left_out"]:
        yield f"{counted(run['left_out'], 'position')} out of reach"


def error_words(row: Mapping[str, Any], told_in: ToldIn) -> str:
    """Return the error of a figure as a suffix, empty if it is unknown or zero.

    The error is relative. It is absolute if it exceeds the figure itself.
    """
    error, value = row.get("error"), row["value"]
    if value is None:
        return ""
    size = ""
    if error:
        size = error_percent(error / abs(value)) if error <= abs(value) else quantity(error, row["unit"], 2, told_in)
        size = f" ± {size}{' measured' if row.get('error_measured') else ''}"
    return size + (" (unreliable)" if row.get("unreliable") else "")


def verdict_words(figures: Mapping[str, Any]) -> str:
    """Return the verdict with the limits that decide it, or with the link that buckles."""
    accepted, rows = figures["acceptance"], limit_rows(figures)
    if figures["buckles"]:
        return f"{accepted['verdict']}: {figures['buckles']}"
    if not rows:
        return "no limits are set"
    if accepted["passed"]:
        return f"acceptable: {rows[0][0]}" + (f", closest of {len(rows)} limits" if len(rows) > 1 else "")
    decides = [words for words, _, outcome in rows if outcome == OUTCOMES[accepted["verdict"]]]
    more = len(decides) - MAX_NAMED
    named = ", ".join(decides[:MAX_NAMED]) + (f" and {more} more of {len(rows)} limits" if more > 0 else "")
    return ": ".join(filter(None, (accepted["verdict"], named, accepted["problem"])))


def limit_rows(figures: Mapping[str, Any]) -> list[tuple[str, float | None, str]]:
    """Return figure and limit in words, used share and outcome of each limit, the most used limit first."""
    run, told_in = figures["run"], figures["told_in"]
    lasts = run["end"]["value"] - run["start"]["value"]
    rows = sorted(figures["acceptance"]["limits"], key=lambda row: -math.inf if row["used"] is None else -row["used"])
    return [(_limit_words(row, told_in, lasts), row["used"], row["outcome"]) for row in rows]


def _limit_words(row: Mapping[str, Any], told_in: ToldIn, lasts: float) -> str:
    """Return a figure with its limit, for a run of duration `lasts` [s]."""
    value, limit = row["found"], row["limit"]
    item = value.get("label") or row["on"]
    name = LIMIT_NAMES.get(row["kind"])
    if name and item and row["kind"] != "output":
        name = f"{name} of {item}"
    elif not name:
        name = f"{row['name']} ({item})" if item else row["name"]
    endless = value["value"] is None and "endless" in value
    if value["value"] is None and not endless:
        return str(name)
    bound = math.inf if limit["value"] is None else limit["value"]  # JSON has no infinity
    size, allowed = beside(math.inf if endless else value["value"], bound, limit["unit"], told_in)
    if endless:
        size = f"not settled within the {quantity(lasts, 's')} computed" if row["kind"] == "settling" else "endless"
    return f"{name} {size}{error_words(value, told_in)} ({'minimum' if row['least'] else 'limit'} {allowed})"


def questions(figures: Mapping[str, Any]) -> list[str]:
    """Return questions about unusual inputs, which are most likely in a wrong unit."""
    return [finding["text"] for finding in figures["trust"] if finding["heading"] == INPUTS]


def _theory(figures: Mapping[str, Any]) -> list[str]:
    """Return the theory, its accuracy if that is not reached, and the results of further checks."""
    theory, words = figures["theory"], []
    if theory["error"] is not None and theory["reached"] is False:
        words.append(f"{theory['name']}, {percent(theory['accuracy'])} asked, {reached_words(theory)}")
    elif figures["links"] and theory["problem"]:
        known = theory["problem"] in figures["acceptance"]["problem"]
        words.append(theory["name"] + ("" if known else f", error unknown: {theory['problem']}"))
    elif figures["links"] and theory["error"] is not None:
        words.append(theory["name"])
    return [*words, *further_checks(figures)]


def further_checks(figures: Mapping[str, Any]) -> list[str]:
    """Return the results of the nonlinear check and of the check with plane bodies."""
    words = []
    for key, name in (("nonlinear_check", "nonlinear check"), ("solid_check", "solid check")):
        check = figures[key] or {}
        if "problem" in check:
            words.append(f"{name} CANNOT BE MADE: {check['problem']}")
        elif check.get("cannot_tell"):
            words.append(f"{name} cannot tell: the stated error is larger than the answer")
        elif check.get("largest") is not None:
            passed = check.get("passed")
            outcome = "" if passed is None else " agrees" if passed else " FAILED"
            more = f", without {', '.join(check['left_out'])}" if check.get("left_out") else ""
            if check.get("too_close_to_decide"):
                outcome = " TOO CLOSE TO DECIDE"
                more += f", error of the check up to {percent(sum(check['own_errors'].values()))}"
            words.append(f"{name}{outcome} ({percent(check['largest'])} apart{more})")
    return words


def reached_words(theory: Mapping[str, Any]) -> str:
    """Return the accuracy reached instead of the requested one, and its main cause."""
    if theory["error"] > theory["accuracy"]:
        largest = max(theory["errors"], key=lambda part: theory["errors"][part] or 0.0)
        return f"{percent(theory['error'])} reached in the {theory['figure']}: mostly {largest}"
    name, share = max(theory["courses"].items(), key=lambda item: item[1] or 0.0)
    return f"{percent(share)} reached in the course of {name}"


def check_words(check: Mapping[str, Any]) -> str:
    """Return the result of the finite element check with its largest differences."""
    if check["passed"] is None:
        return "check has nothing to compare"
    sizes = [] if check["largest"] is None else [number(check["largest"], 2)]
    for theory, balance in check["momentum"].items():
        if balance["compared"]:
            of = "" if theory == QUASI_STATIC else f" of {theory} links"
            sizes.append(f"momentum{of} {'' if balance['passed'] else 'OFF BY '}{number(balance['largest'], 2)}")
    return f"check {'agrees' if check['passed'] else 'FAILED'} ({', '.join(sizes)})"
