"""summary.json: every figure of the report, each with its unit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elastic import FIELDS
from kinelast.output_results import UNITS, Peak, Results, drive_words, joint_words
from kinelast.report_trust import findings, left_out, lowest_frequency, slendernesses


def figure(value: Any, unit: str, **more: Any) -> dict[str, Any]:
    """A value and its unit; null where there is no number."""
    size = float(value)
    return {"value": size if math.isfinite(size) else None, "unit": unit, **more}


def summary(results: Results, found: dict[str, list[Peak]]) -> dict[str, Any]:
    """The figures of a scene as plain data that JSON can hold.

    Parameters
    ----------
    found
        The peaks per field, see `output_results.peaks`.
    """
    lowest = lowest_frequency(results)
    scene, motion, forces = results.scene, results.motion, results.deflection.forces
    return {
        "scene": {"name": scene.name, "title": scene.title, "source": scene.source},
        "run": {
            "positions": len(motion.time),
            "singular": int(np.count_nonzero(results.singular)),
            "left_out": results.left_out,
            "start": figure(motion.time[0], "s"),
            "end": figure(motion.time[-1], "s"),
            "largest_condition": _largest(results, np.where(results.singular, np.nan, motion.condition), "1"),
        },
        "links": _links(results),
        "rigid_links": [link.name for link in scene.mechanism.links[1:] if not link.beams],
        "peaks": _peaks(results, found),
        "largest_deflection": _largest_deflection(results, found),
        "points": {
            point: {"displacement": _largest(results, np.abs(moved), "m")}
            for point, moved in results.displacements.items()
        },
        "joints": [
            {"joint": joint, "on": link, "force": _largest(results, np.abs(force), "N")}
            for (joint, link), force in zip(joint_words(results), forces.force, strict=True)
        ],
        "drives": {
            name: {"coordinate": coordinate, "effort": _largest(results, effort, unit)}
            for (name, coordinate, _, unit), effort in zip(drive_words(scene.mechanism), results.efforts, strict=True)
        },
        "shaking": {
            "force": _largest(results, np.abs(forces.ground_force), "N"),
            "moment": _largest(results, forces.ground_moment, "N m"),
        },
        "lowest_frequency_at_most": figure(lowest, "rad/s"),
        "check": check_summary(results),
        "trust": [
            {"level": finding.level, "heading": finding.heading, "text": finding.text}
            for finding in findings(results, found, lowest)
        ],
        "not_computed": left_out(results),
    }


def _links(results: Results) -> list[dict[str, Any]]:
    rows = []
    mechanism, sections = results.mechanism, results.deflection.sections
    for number, (label, slender) in enumerate(zip(results.scene.labels, slendernesses(results), strict=True)):
        at, beam = mechanism.beams[number]
        rows.append(
            {
                "label": label,
                "link": mechanism.links[at].name,
                "from": beam.start,
                "to": beam.end,
                "length": figure(results.deflection.length[number].item(), "m"),
                "mass_per_length": figure(beam.mass_per_length, "kg/m"),
                "EA": figure(sections[number].EA, "N"),
                "EI": figure(sections[number].EI, "N m^2"),
                "rigid": not math.isfinite(float(sections[number].EI)),
                "slenderness": figure(slender, "1"),
            }
        )
    return rows


def _peaks(results: Results, found: dict[str, list[Peak]]) -> dict[str, dict[str, Any]]:
    return {
        label: {field: _peak(results, field, rows[beam], beam) for field, rows in found.items()}
        for beam, label in enumerate(results.scene.labels)
    }


def _peak(results: Results, field: str, peak: Peak, beam: int) -> dict[str, Any]:
    length = results.deflection.length[beam].item()
    return figure(
        peak.value,
        UNITS[field],
        along=figure(peak.xi * length, "m"),
        xi=figure(peak.xi, "1")["value"],
        time=figure(peak.time, "s"),
        drive=_coordinates(results, peak.drive),
        between_positions=peak.refined,
    )


def _coordinates(results: Results, values: Any) -> dict[str, Any]:
    return {
        name: figure(value, unit)
        for (name, _, unit, _), value in zip(drive_words(results.mechanism), values, strict=True)
    }


def _largest_deflection(results: Results, found: dict[str, list[Peak]]) -> dict[str, Any] | None:
    """The greatest |w| of all beams; none where no link has beams or no position could be computed."""
    beam = greatest_beam(found)
    if beam is None:
        return None
    label = results.scene.labels[beam]
    return {"label": label, **_peak(results, "w", found["w"][beam], beam)}


def greatest_beam(found: dict[str, list[Peak]]) -> int | None:
    """Number of the beam that deflects most."""
    sizes = [abs(peak.value) if math.isfinite(peak.value) else -1.0 for peak in found["w"]]
    if not sizes or max(sizes) < 0:
        return None
    return sizes.index(max(sizes))


def _largest(results: Results, values: Any, unit: str) -> dict[str, Any]:
    """The value of largest magnitude over the positions, with time and drive."""
    motion = results.motion
    values = np.broadcast_to(values, motion.columns)
    size = np.where(np.isfinite(values), np.abs(values), -1.0)
    at = int(size.argmax())
    if size[at] < 0:
        return figure(math.nan, unit)
    return figure(values[at], unit, time=figure(motion.time[at], "s"), drive=_coordinates(results, motion.drive[:, at]))


def check_summary(results: Results) -> dict[str, Any] | None:
    """The finite element check as plain data; none where it was not asked for.

    Shares are of the field's greatest magnitude over the cycle on any link, null where one side has no answer.
    """
    comparison = results.comparison
    if comparison is None:
        return None
    labels = results.scene.labels
    shares = [[_share(value) for value in row] for row in comparison.relative.T]
    worst = max(comparison.worst, key=lambda worst: worst.relative, default=None)
    return {
        "passed": comparison.passed,
        "tolerance": comparison.tolerance,
        "elements": comparison.elements,
        "compared": comparison.compared,
        "largest": _share(worst.relative) if worst else None,
        "differences": {label: dict(zip(FIELDS, row, strict=True)) for label, row in zip(labels, shares, strict=True)},
        "worst": [
            {
                "field": item.field,
                "label": labels[item.beam],
                "xi": item.xi,
                "position": item.position,
                "difference": figure(item.difference, UNITS[item.field]),
                "share": _share(item.relative),
            }
            for item in comparison.worst
        ],
    }


def _share(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None
