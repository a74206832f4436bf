"""summary.json: all figures of the report with their units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import FIELDS, PRIMARY
from elastic.assessment import LIMITS
from elastic.links import members_of
from kinelast.figures.checks import check_passed
from kinelast.figures.cycle import EXTREME_FIELDS
from kinelast.figures.limits import acceptance, breaks_first
from kinelast.figures.output import slid, turns_of
from kinelast.figures.parts import (
    cam_rows,
    drive_figures,
    friction_figures,
    input_figures,
    joint_rows,
    life_figures,
    nonlinear_figures,
    part_rows,
    solid_figures,
    strength_figures,
    vibration_figures,
)
from kinelast.figures.peaks import Peak, greatest
from kinelast.figures.registry import output_figures
from kinelast.figures.results import Results, at_position, coordinates, error_of, figure, largest, worst_figure
from kinelast.figures.shares import output_shares
from kinelast.figures.trust import exceedance_figures, findings, left_out, reliability, unreliable_figures
from kinelast.scene.data import ACCURACY, QUASI_STATIC
from kinelast.scene.figure import POINT, items_of
from kinelast.scene.limits import OUTPUT_ERROR, Output
from kinelast.scene.numbers import quantity
from rigid import Beam
from rigid.analysis import LimitPosition

if TYPE_CHECKING:
    from elastic.elastodynamics import Elastodynamic


OUTPUT_MOTION = {
    "output_stroke": "stroke",
    "output_travel": "swing",
    "output_time_ratio": "time_ratio",
    "output_advantage": "advantage",
}


def summary(results: Results) -> dict[str, Any]:
    """Return the figures of a scene as plain data for JSON."""
    points, angles, output = point_figures(results), angle_figures(results), output_figure(results)
    scene, peaks = results.scene, results.figures.peaks
    if output is not None:
        output["shares"] = output_shares(results, output)
    trust = [asdict(finding) for finding in findings(results)]
    level, reasons = reliability(trust)
    registered = registered_figures(results)
    figures = {
        "told_in": scene.told_in,
        "scene": {"name": scene.name, "title": scene.title, "source": scene.source},
        "run": {
            **dict(zip(("positions", "singular", "ill_conditioned"), results.counts, strict=True)),
            "locked": results.figures.locked,
            "left_out": results.left_out,
            "one_position": results.one_position,
            "interrupted": None if scene.course.interrupted is None else figure(scene.course.interrupted, "s"),
            "start": figure(results.figures.span[0], "s"),
            "end": figure(results.figures.span[1], "s"),
            "largest_condition": largest(results, peaks["condition"][0], "1"),
        },
        "inputs": input_figures(results),
        "links": _links(results),
        "rigid_links": [link.name for link in scene.mechanism.links[1:] if not link.beams],
        "peaks": _peaks(results),
        "largest_deflection": _greatest(results, "w"),
        "largest_chord": _greatest(results, "chord"),
        "largest_stress": _greatest(results, "mises"),
        "strength": strength_figures(results),
        "figures": registered,
        "points": points,
        "angle_errors": angles,
        "output": output,
        "joints": joint_rows(results),
        "life": life_figures(results),
        "breaks_first": breaks_first(results),
        "buckles": results.buckles or None,
        "yields": results.yields or None,
        "drives": {
            name: {"coordinate": coordinate, **figures}
            for (name, coordinate, *_), figures in zip(results.drive_words, drive_figures(results), strict=True)
        },
        "cams": cam_rows(results),
        **part_rows(results),
        "friction": friction_figures(results),
        "shaking": {
            "force": largest(results, peaks["shaking_force"][0], "N"),
            "moment": largest(results, peaks["shaking_moment"][0], "N m"),
        },
        "vibration": None if results.buckles else vibration_figures(results),
        "check": check_summary(results),
        "nonlinear_check": nonlinear_figures(results.nonlinear),
        "solid_check": solid_figures(results.solid),
        "theory": theory_figures(results),
        "cautions": exceedance_figures(results),
        "limits": {kind: {"watch": limit.watch, "beyond": limit.beyond} for kind, limit in LIMITS.items()},
        "trust": trust,
        "reliability": {"level": level, "reasons": reasons, "unreliable": unreliable_figures(registered)},
        "stressed": any(math.isfinite(peak.value) for peak in peaks["stress"]),
        "not_computed": left_out(results),
    }
    return {**figures, "acceptance": acceptance(results, figures)}


def registered_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Return each registered figure by key, for the item with the extreme value; for each item if units differ."""
    scene, by_key = results.scene, {}
    for figure_ in results.figures.figures:
        peaks, names = results.figures.peaks[figure_.key], items_of(scene, figure_.of)
        units = figure_.units(scene)
        alike = [range(len(names))] if len(set(units)) == 1 else [[item] for item in range(len(names))]
        for items in alike:
            best = greatest([peaks[item] for item in items], figure_.over)
            item = items[0 if best is None else best]
            key = figure_.key if len(items) == len(names) else f"{figure_.key}.{names[item]}"
            on = {"on": names[item]} if names[item] else {}
            by_key[key] = largest(results, peaks[item], units[item], name=figure_.name, **on)
    return by_key


def theory_figures(results: Results) -> dict[str, Any]:
    """Return the theory and the largest relative error of the main figures; null if unknown."""
    answer = results.answer
    if answer is None:
        return {
            "name": QUASI_STATIC,
            "error": None,
            "figure": None,
            "on": None,
            "errors": {},
            "courses": {},
            "without_vibration": None,
            "accuracy": None,
            "reached": None,
            "problem": results.error_unknown,
        }

    def known(share: float) -> float | None:
        return share if math.isfinite(share) else None

    return {
        "name": answer.theory,
        "error": known(results.error),
        **worst_figure(results),
        "without_vibration": known(answer.missed),
        "accuracy": answer.accuracy,
        "expected": ACCURACY,
        "reached": results.accurate,
        "courses": {name: known(share) for name, share in answer.courses.items()},
        "problem": results.error_unknown,
        **({} if answer.vibrating is None else _vibrating(answer.vibrating)),
    }


def _vibrating(vibrating: Elastodynamic) -> dict[str, Any]:
    return {
        "damping": [figure(beta, "s") for beta in np.ravel(vibrating.damping.beams)],
        "growth": _share(vibrating.growth),
        "stable": vibrating.stable,
    }


def _links(results: Results) -> list[dict[str, Any]]:
    rows = []
    mechanism, sections = results.mechanism, results.deflection.sections
    for number, label in enumerate(results.scene.labels):
        at, beam = mechanism.beams[number]
        rows.append(
            {
                "label": label,
                "member": results.scene.member_names[number],
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
    """Return section with sizes and material of a beam in words."""
    if number >= len(results.scene.made_of):
        return {"section": None, "material": None}
    made, told_in = results.scene.made_of[number], results.scene.told_in
    sizes = ", ".join(
        f"{name} {' to '.join(quantity(size, 'm', told_in=told_in) for size in ends)}"
        for name, ends in made.sizes.items()
    )
    return {
        "section": ", ".join(filter(None, (f"{made.section}: {made.shape}", sizes))),
        "material": made.material or None,
    }


def _beam_mass(beam: Beam, length: float) -> float:
    """Return the mass of a beam [kg]."""
    return float(beam.mass_per_length) * length * sum(part / (k + 1) for k, part in enumerate(beam.mass_taper))


def _peaks(results: Results) -> dict[str, dict[str, Any]]:
    rows = {field: results.figures.of_field(field) for field in EXTREME_FIELDS}
    return {
        label: {field: _peak(results, field, peaks[beam], beam) for field, peaks in rows.items()}
        for beam, label in enumerate(results.scene.labels)
    }


def _peak(results: Results, field: str, peak: Peak, beam: int) -> dict[str, Any]:
    length = results.deflection.length[beam].item()
    return figure(
        results.figures.rounded(peak.value, FIELDS[field].unit),
        FIELDS[field].unit,
        **error_of(results, peak, FIELDS[field].unit),
        along=figure(peak.xi * length, "m"),
        xi=figure(peak.xi, "1")["value"],
        time=figure(peak.time, "s"),
        drive=coordinates(results, peak.drive),
        between_positions=peak.refined,
    )


def _greatest(results: Results, field: str) -> dict[str, Any] | None:
    """Return the greatest magnitude of a field on all beams, or None if it is unknown or no link has beams."""
    peaks = results.figures.of_field(field)
    beam = greatest(peaks)
    if beam is None:
        return None
    run = members_of(results.mechanism).runs[members_of(results.mechanism).number[beam]]
    at = run.beams.index(beam)
    length = results.deflection.length[beam].item()
    along = (float(run.start[at]) / abs(float(run.width[at])) + (-1 if run.turned[at] else 1) * peaks[beam].xi) * length
    return {
        "label": results.scene.labels[beam],
        "member": results.scene.member_names[beam],
        "along_member": figure(along, "m"),
        **_peak(results, field, peaks[beam], beam),
    }


def point_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Return the largest displacement of each moving point, with its parts along and off the path."""
    keys = "displacement", "along_path", "off_path"
    rows = zip(*(results.figures.peaks[key] for key in keys), strict=True)
    return {
        point: {key: largest(results, peak, "m") for key, peak in zip(keys, peaks, strict=True)}
        for point, peaks in zip(items_of(results.scene, POINT), rows, strict=True)
    }


def angle_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Return the largest angle error of each moving link, with its point."""
    pairs = zip(results.mechanism.links[1:], results.figures.peaks["angle_error"], strict=True)
    return {link.name: _angle(results, link.name, peak) for link, peak in pairs}


def _angle(results: Results, link: str, peak: Peak) -> dict[str, Any]:
    points = [*results.mechanism.links[results.mechanism.index[link]].points]
    return largest(results, peak, "rad", **({} if math.isnan(peak.value) else {"point": points[peak.row]}))


def output_motion(results: Results, output: Output) -> dict[str, Any]:
    """Return stroke or swing, time ratio, smallest mechanical advantage and turning points of the output.

    `advantage` is the rate of the only drive over the speed of the output. `turns` are the positions at which the
    output stands still: dead points for a drive at the output.
    """
    rows: dict[str, Any] = {}
    for each in output_figures(output):
        if each.key in OUTPUT_MOTION and (each.key != "output_advantage" or len(results.mechanism.drives) == 1):
            found = results.cycle.of(each)
            place, (unit,) = int(np.ravel(found.position)[0]), each.units(results.scene)
            more = {} if place < 0 else at_position(results, place)
            rows[OUTPUT_MOTION[each.key]] = figure(np.ravel(found.value)[0], unit, **more)
    return {**rows, "turns": [dict(_turn(results, turn)) for turn in turns_of(results.cycle, output)]}


def _turn(results: Results, turn: LimitPosition) -> Iterator[tuple[str, Any]]:
    """Yield kind and drive coordinates of a turning point."""
    yield "kind", turn.kind
    yield "drive", coordinates(results, turn.drive)


def output_figure(results: Results) -> dict[str, Any] | None:
    """Return the error of the output with its place, or None without an output."""
    output = results.figures.output
    if output is None:
        return None
    peak = results.figures.peaks[OUTPUT_ERROR][0]
    moves = {"motion": output_motion(results, output)}
    if not output.point:
        head = {"kind": "angle", "name": output.link, "guessed": output.guessed}
        return {**head, **_angle(results, output.link, peak), **moves}
    slides = output.guessed and output.point in slid(results.scene)
    head = {"kind": "slide" if slides else "point", "name": output.point, "guessed": output.guessed}
    return {**head, **largest(results, peak, "m"), **moves}


def check_summary(results: Results) -> dict[str, Any] | None:
    """Return the finite element check as plain data, or None without a check.

    Differences are relative to the greatest magnitude of the field on any link, null if one side has no answer.
    """
    comparison = results.comparison
    if comparison is None:
        return None
    labels = results.scene.labels
    shares = [[_share(value) for value in row] for row in comparison.relative.T]
    worst = max(comparison.worst, key=lambda worst: worst.relative, default=None)
    return {
        "passed": check_passed(results),
        "tolerance": comparison.tolerance,
        "elements": comparison.elements,
        "compared": comparison.compared,
        "largest": _share(worst.relative) if worst else None,
        "momentum": {
            theory: {
                **asdict(balance),
                "largest": balance.largest,
                "passed": balance.passed if balance.compared else None,
            }
            for theory, balance in results.balances.items()
        },
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
