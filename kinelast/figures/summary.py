"""summary.json: every figure of the report, each with its unit."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import FIELDS, PRIMARY
from elastic.assessment import LIMITS
from kinelast.figures.acceptance import acceptance
from kinelast.figures.comparisons import nonlinear_figures, solid_figures
from kinelast.figures.figure import at_position, coordinates, figure, largest
from kinelast.figures.friction import friction_figures
from kinelast.figures.inputs import input_figures
from kinelast.figures.output_error import angle_figures, output_figure, point_figures
from kinelast.figures.peaks import Peak
from kinelast.figures.results import Results, joint_words
from kinelast.figures.shares import output_shares
from kinelast.figures.strength import strength_figures, vibration_figures
from kinelast.figures.trust import exceedance_figures, findings, left_out, verdict
from kinelast.numbers import quantity
from kinelast.scene.data import QUASI_STATIC
from rigid import Beam

if TYPE_CHECKING:
    from elastic.elastodynamics import Elastodynamic


def summary(results: Results, found: dict[str, list[Peak]]) -> dict[str, Any]:
    """The figures of a scene as plain data that JSON can hold.

    Parameters
    ----------
    found
        The peaks per field, see `kinelast.figures.results.peaks`.
    """
    points, angles = point_figures(results), angle_figures(results)
    scene, motion, forces = results.scene, results.motion, results.deflection.forces
    output = output_figure(results, points, angles)
    if output is not None:
        output["shares"] = output_shares(results, output)
    trust = [asdict(finding) for finding in findings(results)]
    level, reasons = verdict(trust)
    figures = {
        "scene": {"name": scene.name, "title": scene.title, "source": scene.source},
        "run": {
            **dict(zip(("positions", "singular", "ill_conditioned"), results.counts, strict=True)),
            "locked": results.locked_count,
            "left_out": results.left_out,
            "interrupted": None if scene.course.interrupted is None else figure(scene.course.interrupted, "s"),
            "start": figure(motion.time[0], "s"),
            "end": figure(motion.time[-1], "s"),
            "largest_condition": _worst_condition(results),
        },
        "inputs": input_figures(results),
        "links": _links(results),
        "rigid_links": [link.name for link in scene.mechanism.links[1:] if not link.beams],
        "peaks": _peaks(results, found),
        "largest_deflection": _greatest(results, found, "w"),
        "largest_chord": _greatest(results, found, "chord"),
        "largest_stress": _greatest(results, found, "mises"),
        "strength": strength_figures(results, found),
        "points": points,
        "angle_errors": angles,
        "output": output,
        "joints": [
            {"joint": joint, "on": link, "force": largest(results, np.abs(force), "N")}
            for (joint, link), force in zip(joint_words(results), forces.force, strict=True)
        ],
        "drives": {
            name: {"coordinate": coordinate, "effort": largest(results, effort, unit)}
            for (name, coordinate, _, unit), effort in zip(results.drive_words, results.efforts, strict=True)
        },
        "friction": friction_figures(results),
        "shaking": {
            "force": largest(results, np.abs(forces.ground_force), "N"),
            "moment": largest(results, forces.ground_moment, "N m"),
        },
        "vibration": vibration_figures(results),
        "check": check_summary(results),
        "nonlinear_check": nonlinear_figures(results.nonlinear),
        "solid_check": solid_figures(results.solid),
        "theory": theory_figures(results),
        "cautions": exceedance_figures(results),
        "limits": {kind: {"watch": limit.watch, "beyond": limit.beyond} for kind, limit in LIMITS.items()},
        "trust": trust,
        "verdict": {"level": level, "reasons": reasons},
        "stressed": any(math.isfinite(peak.value) for peak in found["mises"]),
        "not_computed": left_out(results),
    }
    return {**figures, "acceptance": acceptance(results, figures)}


def theory_figures(results: Results) -> dict[str, Any]:
    """The theory that was taken, and what its answer may be off by, as shares; what is not known is null."""
    answer = results.answer
    if answer is None:
        return {"name": QUASI_STATIC, "error": None, "errors": {}, "without_vibration": None, "accuracy": None}

    def known(share: float) -> float | None:
        return share if math.isfinite(share) else None

    return {
        "name": answer.theory,
        "error": known(answer.error),
        "errors": {name: known(share) for name, share in answer.errors.items()},
        "without_vibration": known(answer.missed),
        "accuracy": answer.accuracy,
        **({} if answer.vibrating is None else _vibrating(answer.vibrating)),
    }


def _vibrating(found: Elastodynamic) -> dict[str, Any]:
    return {
        "damping": [figure(beta, "s") for beta in np.ravel(found.damping.beams)],
        "growth": found.growth,
        "stable": found.stable,
    }


def _worst_condition(results: Results) -> dict[str, Any]:
    """Of all positions that could be computed, also those that do not count."""
    condition = np.where(results.singular, -1.0, results.motion.condition)
    at = int(condition.argmax())
    if condition[at] < 0:
        return figure(math.nan, "1")
    return figure(condition[at], "1", **at_position(results, at))


def _links(results: Results) -> list[dict[str, Any]]:
    rows = []
    mechanism, sections = results.mechanism, results.deflection.sections
    for number, label in enumerate(results.scene.labels):
        at, beam = mechanism.beams[number]
        rows.append(
            {
                "label": label,
                "link": mechanism.links[at].name,
                "from": beam.start,
                "to": beam.end,
                **_making(results, number),
                "length": figure(results.deflection.length[number].item(), "m"),
                "mass": figure(_beam_mass(beam, results.deflection.length[number].item()), "kg"),
                "mass_per_length": figure(beam.mass_per_length, "kg/m"),
                "EA": figure(sections[number].EA, "N"),
                "EI": figure(sections[number].EI, "N m^2"),
                "tapered": sections[number].taper is not None or len(beam.mass_taper) > 1,
                "rigid": not math.isfinite(float(sections[number].EI)),
            }
        )
    return rows


def _making(results: Results, number: int) -> dict[str, str | None]:
    """Section with its sizes, and material of a beam, in words."""
    if number >= len(results.scene.made_of):
        return {"section": None, "material": None}
    made = results.scene.made_of[number]
    sizes = ", ".join(
        f"{name} {' to '.join(quantity(size, 'm') for size in ends)}" for name, ends in made.sizes.items()
    )
    return {
        "section": ", ".join(filter(None, (f"{made.section}: {made.shape}", sizes))),
        "material": made.material or None,
    }


def _beam_mass(beam: Beam, length: float) -> float:
    """Mass of a beam [kg]."""
    return float(beam.mass_per_length) * length * sum(part / (k + 1) for k, part in enumerate(beam.mass_taper))


def _peaks(results: Results, found: dict[str, list[Peak]]) -> dict[str, dict[str, Any]]:
    return {
        label: {field: _peak(results, field, rows[beam], beam) for field, rows in found.items()}
        for beam, label in enumerate(results.scene.labels)
    }


def _peak(results: Results, field: str, peak: Peak, beam: int) -> dict[str, Any]:
    length = results.deflection.length[beam].item()
    return figure(
        results.rounded(peak.value, FIELDS[field].unit),
        FIELDS[field].unit,
        along=figure(peak.xi * length, "m"),
        xi=figure(peak.xi, "1")["value"],
        time=figure(peak.time, "s"),
        drive=coordinates(results, peak.drive),
        between_positions=peak.refined,
    )


def _greatest(results: Results, found: dict[str, list[Peak]], field: str) -> dict[str, Any] | None:
    """The greatest magnitude of a field on all beams; none where no link has beams or nothing is known."""
    beam = greatest_beam(found, field)
    if beam is None:
        return None
    return {"label": results.scene.labels[beam], **_peak(results, field, found[field][beam], beam)}


def greatest_beam(found: dict[str, list[Peak]], field: str) -> int | None:
    """Number of the beam on which a field is greatest."""
    sizes = [abs(peak.value) if math.isfinite(peak.value) else -1.0 for peak in found[field]]
    if not sizes or max(sizes) < 0:
        return None
    return sizes.index(max(sizes))


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
        "passed": None if comparison.passed and not (labels and comparison.compared) else comparison.passed,
        "tolerance": comparison.tolerance,
        "elements": comparison.elements,
        "compared": comparison.compared,
        "largest": _share(worst.relative) if worst else None,
        "differences": {label: dict(zip(PRIMARY, row, strict=True)) for label, row in zip(labels, shares, strict=True)},
        "worst": [
            {
                "field": item.field,
                "label": labels[item.beam],
                "xi": item.xi,
                "position": item.position,
                "difference": figure(item.difference, FIELDS[item.field].unit),
                "share": _share(item.relative),
            }
            for item in comparison.worst
        ],
    }


def _share(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None
