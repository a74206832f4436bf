"""Lines of the terminal on a scene: a headline of its figures, and questions about them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinelast.figures.cycle import WELL
from kinelast.figures.limits import VERDICTS
from kinelast.figures.trust import GOOD, INPUTS, verdict
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.numbers import coordinate, number, percent, quantity

OUTCOMES = {words: outcome for outcome, words in VERDICTS.items()}


def headline(figures: Mapping[str, Any]) -> str:
    """Headline of a scene: its figures in one line."""
    words = ["nothing bends: no link has beams" if not figures["links"] else "no position could be computed"]
    largest, accepted = figures["largest_deflection"], figures["acceptance"]
    if largest:
        place = quantity(largest["along_member"]["value"], "m", 3)
        drives = (f"{name} at {coordinate(item['value'], item['unit'])}" for name, item in largest["drive"].items())
        size = quantity(abs(largest["value"]), largest["unit"])
        where = ", ".join((largest["member"], f"{place} along it", *drives))
        words = [f"largest deflection {size}{_error(largest)} ({where})"]
    stress = figures["largest_stress"]
    if stress:
        safety = figures["strength"][stress["label"]]["safety_factor"]["value"]
        words.append(f"stress {quantity(stress['value'], 'Pa', 3)}{_error(stress)} ({stress['member']}{_safe(safety)})")
    condition = figures["run"]["largest_condition"]["value"]
    if condition is not None and condition > WELL:
        words.append(f"ill-conditioned at some positions: up to {number(condition, 2)}")
    if figures["run"]["singular"]:
        words.append(f"{figures['run']['singular']} singular positions")
    if figures["run"]["locked"]:
        words.append(f"{figures['run']['locked']} positions that friction may lock")
    if figures["run"]["interrupted"]:
        words.append(f"PARTIAL: interrupted at {quantity(figures['run']['interrupted']['value'], 's')}")
    elif figures["run"]["left_out"]:
        words.append(f"{figures['run']['left_out']} positions out of reach")
    if figures["check"]:
        words.append(_check(figures["check"]))
    words += _theory(figures)
    if figures["made_from"]["options"]["animate"] and not figures["links"]:
        words.append("filmed is the motion: nothing is drawn along links without beams")
    if accepted["verdict"]:
        words.insert(0, _verdict(accepted))
    level, reasons = verdict(figures["trust"])
    if level != GOOD:
        words.append(f"{level}: {', '.join(reasons)}")
    return "; ".join(words)


def _error(row: Mapping[str, Any]) -> str:
    """The error of a figure as a share of it, behind it; nothing where it is not known."""
    if row["error"] is None or not row["value"]:
        return ""
    return f" ± {percent(abs(row['error'] / row['value']))}"


def _verdict(accepted: Mapping[str, Any]) -> str:
    """The verdict on the limits, with those that decide it."""
    verdict = accepted["verdict"]
    if accepted["passed"]:
        return str(verdict)
    decides = [row for row in accepted["limits"] if row["outcome"] == OUTCOMES[verdict]]
    words = f"{verdict.upper()}: {', '.join(_beside_limit(row) for row in decides)}"
    return f"{words}: {accepted['problem']}" if accepted["problem"] else words


def _beside_limit(row: Mapping[str, Any]) -> str:
    """A figure beside its limit, in a few words."""
    found, limit = row["found"], row["limit"]
    if found["value"] is None:
        return _called(row)
    size, allowed = quantity(abs(found["value"]), found["unit"]), quantity(limit["value"], limit["unit"])
    return f"{_called(row)} {size}{_error(found)}, allowed {allowed}"


def _called(row: Mapping[str, Any]) -> str:
    """A limit by its key, where it has one of its own; else by its figure and item."""
    return (
        row["kind"] if row["kind"] in ("deflection", "chord", "safety", "output") else f"{row['name']} of {row['on']}"
    )


def questions(figures: Mapping[str, Any]) -> list[str]:
    """Questions about the scene's inputs: most likely slips of a unit."""
    return [finding["text"] for finding in figures["trust"] if finding["heading"] == INPUTS]


def _theory(figures: Mapping[str, Any]) -> list[str]:
    """The theory and how far it is off, and results of further checks."""
    theory, words = figures["theory"], []
    if theory["error"] is not None and theory["reached"] is False:
        largest = max(theory["errors"], key=lambda part: theory["errors"][part] or 0.0)
        off = f"{percent(theory['accuracy'])} asked, {percent(theory['error'])} reached"
        words.append(f"{theory['name']}, {off} in the {theory['figure']}: mostly {largest}")
    elif theory["problem"] and figures["links"]:
        unknown = (
            "" if theory["problem"] in figures["acceptance"]["problem"] else f", error unknown: {theory['problem']}"
        )
        words.append(f"{theory['name']}{unknown}")
    elif theory["error"] is not None:
        words.append(theory["name"])
    for key, name in (("nonlinear_check", "nonlinear check"), ("solid_check", "solid check")):
        if figures[key] and "problem" in figures[key]:
            words.append(f"{name} CANNOT BE MADE: {figures[key]['problem']}")
        elif figures[key] and figures[key]["largest"] is not None:
            failed = " FAILED" if figures[key].get("passed") is False else ""
            failed += " TOO NEAR TO CALL" if figures[key].get("too_near_to_call") else ""
            without = figures[key].get("left_out")
            more = f", without {', '.join(without)}" if without else ""
            words.append(f"{name}{failed} ({percent(figures[key]['largest'])} apart{more})")
    return words


def _check(check: Mapping[str, Any]) -> str:
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
