"""Whether the machine is good enough: the scene's limits beside what was found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kinelast.figures.figure import figure
from kinelast.figures.results import Results

Figures = Mapping[str, Any]


def acceptance(results: Results, figures: Figures) -> dict[str, Any]:
    """Every limit of the scene with the figure that it bounds, and whether all are kept.

    Parameters
    ----------
    figures
        The rest of the summary, see `kinelast.figures.summary.summary`.

    Returns
    -------
    `passed`: None where no limit is set; a limit that there is no figure for is not kept. `limits`: a row each.
    """
    rows = [
        {
            "kind": limit.kind,
            "on": limit.link,
            "limit": figure(limit.value, found["unit"] if limit.kind == "output" else limit.unit),
            "found": found,
            "passed": _kept(limit.kind, limit.value, found["value"]),
        }
        for limit in results.scene.limits
        for found in [_found(results, figures, limit.kind, limit.link)]
    ]
    return {"passed": all(row["passed"] for row in rows) if rows else None, "limits": rows}


def _kept(kind: str, limit: float, found: float | None) -> bool:
    if found is None:
        return False
    return found >= limit if kind == "safety" else abs(found) <= limit


def _found(results: Results, figures: Figures, kind: str, link: str) -> dict[str, Any]:
    """The figure that a limit bounds, with its place; without a value where it is not known."""
    if kind == "output":
        output = figures["output"]
        return figure(float("nan"), "m") if output is None else {**output, "label": output["name"], "shares": None}
    known = [row for row in _of_beams(results, figures, kind, link) if row["value"] is not None]
    if kind == "safety":
        unknown = [label for label in _labels(results, link) if _safety(figures, label)["value"] is None]
        if not known or unknown:
            return figure(float("nan"), "1")
        return min(known, key=lambda row: row["value"])
    return max(known, key=lambda row: abs(row["value"])) if known else figure(float("nan"), "m")


def _of_beams(results: Results, figures: Figures, kind: str, link: str) -> Iterator[dict[str, Any]]:
    for label in _labels(results, link):
        row = (
            _safety(figures, label)
            if kind == "safety"
            else figures["peaks"][label]["w" if kind == "deflection" else kind]
        )
        yield {**row, "label": label}


def _safety(figures: Figures, label: str) -> dict[str, Any]:
    """The safety factor of a beam, where and when it is least."""
    row: dict[str, Any] = figures["strength"][label]["safety_factor"]
    place = {key: value for key, value in figures["peaks"][label]["mises"].items() if key not in ("value", "unit")}
    return {**place, **row}


def _labels(results: Results, link: str) -> list[str]:
    """Beams of a link, or of all."""
    beams, links = results.mechanism.beams, results.mechanism.links
    return [label for label, (at, _) in zip(results.scene.labels, beams, strict=True) if link in ("", links[at].name)]
