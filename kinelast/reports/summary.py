"""Make the report on the results of a scene, and convert it to plain data for summary.json."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from msgspec import structs

from elastic import FIELDS, PRIMARY
from elastic.assessment import VALIDITY_RANGES
from elastic.links import members_of
from kinelast import __version__
from kinelast.answers.checks import check_passed
from kinelast.answers.results import Results
from kinelast.figures.cycle import EXTREME_FIELDS
from kinelast.figures.output import slid, turns_of
from kinelast.figures.peaks import Peak, error_of_extreme, greatest
from kinelast.figures.registry import output_figures
from kinelast.reports import report
from kinelast.reports.accuracy import small_figures, worst_figure
from kinelast.reports.doubted import large_errors, unjudged_limits
from kinelast.reports.limits import acceptance
from kinelast.reports.report import Report, data_of
from kinelast.reports.reserves import breaks_first
from kinelast.reports.sections import (
    drives_of,
    friction_of,
    inputs_of,
    joints_of,
    nonlinear_report,
    solid_report,
    strength_of,
    vibration_of,
)
from kinelast.reports.shares import output_shares
from kinelast.reports.trust import exceedance_level, findings, left_out, reliability
from kinelast.scene.data import ACCURACY, QUASI_STATIC, Scene
from kinelast.scene.limits import Output
from kinelast.scene.parts import PARTS
from kinelast.values.figure import OUTPUT_ERROR, POINT, items_of
from kinelast.values.numbers import UNRELIABLE, capitalized, has_large_error, percent, quantity
from kinelast.values.reading import CAUTION, ORDER, Finding, Reader, Reading, known, reading

OUTPUT_MOTION = {
    "output_stroke": "stroke",
    "output_travel": "swing",
    "output_time_ratio": "time_ratio",
    "output_advantage": "advantage",
}


def summary(results: Results) -> dict[str, Any]:
    """Return the report on the results of a scene as plain data for JSON."""
    return data_of(report_of(results))


def report_of(results: Results) -> Report:
    """Return the report on the results of a scene."""
    scene, run, reader = results.scene, results.figures, Reader(results)
    trust, judged = findings(results), acceptance(results)
    unreliable, near_zero = figures_with_large_errors(reader)
    interrupted = scene.course.interrupted
    return Report(
        kinelast=__version__,
        shown_in=scene.shown_in,
        scene=report.SceneWords(scene.name, scene.title, scene.source),
        run=report.RunReport(
            *results.counts,
            run.locked,
            results.left_out,
            results.one_position,
            results.several_turns,
            None if interrupted is None else reading(interrupted, "s"),
            reading(run.span[0], "s"),
            reading(run.span[1], "s"),
            reader.largest(run.peaks["condition"][0], "1"),
        ),
        inputs=inputs_of(results),
        links=_links(results),
        rigid_links=[link.name for link in scene.mechanism.links[1:] if not link.beams],
        peaks=_peaks(reader),
        largest_deflection=_greatest(reader, "w"),
        largest_chord=_greatest(reader, "chord"),
        largest_stress=_greatest(reader, "mises"),
        strength=strength_of(reader),
        figures=registered_figures(reader),
        points=point_figures(reader),
        angle_errors=angle_figures(reader),
        output=output_reading(reader),
        joints=joints_of(reader),
        breaks_first=breaks_first(results),
        buckles=results.buckles or None,
        yields=results.yields or None,
        drives=drives_of(reader),
        friction=friction_of(reader),
        shaking={
            "force": reader.largest(run.peaks["shaking_force"][0], "N"),
            "moment": reader.largest(run.peaks["shaking_moment"][0], "N m"),
        },
        vibration=None if results.buckles else vibration_of(reader),
        check=check_report(results),
        nonlinear_check=nonlinear_report(results.nonlinear),
        solid_check=solid_report(results.solid),
        theory=theory_report(results),
        cautions=exceedance_rows(reader),
        limits={kind: {"watch": limit.watch, "beyond": limit.beyond} for kind, limit in VALIDITY_RANGES.items()},
        trust=sorted(
            [*trust, *_limit_and_error_findings(scene, judged.limits or (), unreliable)],
            key=lambda finding: ORDER.index(finding.level),
        ),
        reliability=report.Reliability(*reliability(trust), unreliable, near_zero),
        stressed=any(math.isfinite(peak.value) for peak in run.peaks["stress"]),
        not_computed=left_out(results),
        acceptance=judged,
        more={key: section for part in PARTS for key, section in part.rows(reader).items()},
    )


def figures_with_large_errors(reader: Reader) -> tuple[list[report.UnreliableFigure], int]:
    """Return the unreliable figures (results with large errors), and the number of those with a value near zero.

    The figures are sorted, the one with the largest relative error first. A value near zero has a large relative error
    too, but is not listed, because its error is small relative to other values.
    """
    run, marked, near_zero = reader.results.figures, [], 0
    for figure in run.figures:
        rows = zip(run.peaks[figure.key], reader.scene.shown_items(figure.of), figure.units(reader.scene), strict=True)
        for peak, name, unit in rows:
            row = reader.largest(peak, unit)
            if row.unreliable:
                share = abs(row.error / row.value) if row.error and row.value else None
                marked.append(report.UnreliableFigure(figure.name, name or None, share))
            elif row.value and row.error and has_large_error(row.value, row.error):  # zero has no mark
                near_zero += 1
    return sorted(marked, key=lambda each: -math.inf if each.share is None else -each.share), near_zero


def _limit_and_error_findings(
    scene: Scene, limits: Sequence[report.JudgedLimit], unreliable: Sequence[report.UnreliableFigure]
) -> Iterator[Finding]:
    """Yield a finding for each reason why limits cannot be judged, and one on the figures with large errors."""
    members = dict(zip(scene.labels, scene.member_names, strict=True))
    for problem, names in unjudged_limits(limits, lambda label: members.get(label, label)).items():
        yield Finding(CAUTION, "Limits", f"Cannot be judged: {', '.join(names)}. {capitalized(problem)}.")
    if unreliable:
        words = "; ".join(large_errors(unreliable))
        yield Finding(CAUTION, "Unreliable figures", f"Errors above {percent(UNRELIABLE)} of the value: {words}.")


def registered_figures(reader: Reader) -> dict[str, Reading]:
    """Return all registered figures (results) by key.

    Each entry contains the most extreme value of all items. If the items have different units, there is an entry for
    every item, with a key such as `drive_effort.crank`.
    """
    scene, run, by_key = reader.scene, reader.results.figures, {}
    for figure in run.figures:
        peaks, names = run.peaks[figure.key], items_of(scene, figure.of)
        units = figure.units(scene)
        alike = [range(len(names))] if len(set(units)) == 1 else [[item] for item in range(len(names))]
        for items in alike:
            best = greatest([peaks[item] for item in items], figure.over)
            item, among = items[0 if best is None else best], [peaks[item] for item in items]
            least = 0.0 if best is None else error_of_extreme(among, best, figure.over)
            key = figure.key if len(items) == len(names) else f"{figure.key}.{names[item]}"
            on: dict[str, Any] = {"on": names[item]} if names[item] else {}
            by_key[key] = reader.largest(peaks[item], units[item], least, name=figure.name, **on)
    return by_key


def theory_report(results: Results) -> report.TheoryReport:
    """Return the section on the theory of the results and on the largest relative error in the main figures."""
    answer = results.answer
    if answer is None:
        return report.TheoryReport(name=QUASI_STATIC, problem=results.error_unknown)
    vibrating = answer.vibrating
    more: dict[str, Any] = {}
    if vibrating is not None:
        damping = [reading(beta, "s") for beta in np.ravel(vibrating.damping.beams)]
        more = {"damping": damping, "growth": known(vibrating.growth), "stable": vibrating.stable}
    return report.TheoryReport(
        name=answer.theory,
        error=known(results.error),
        **worst_figure(results),
        near_zero=small_figures(results),
        without_vibration=known(answer.missed),
        accuracy=answer.requested.accuracy,
        expected=ACCURACY,
        reached=results.accurate,
        courses={name: known(share) for name, share in answer.courses.items()},
        problem=results.error_unknown,
        **more,
    )


def _links(results: Results) -> list[dict[str, Any]]:
    rows = []
    mechanism, sections = results.mechanism, results.deflection.sections
    for number, label in enumerate(results.scene.labels):
        at, beam = mechanism.beams[number]
        length = results.deflection.length[number].item()
        mean_share = sum(part / (k + 1) for k, part in enumerate(beam.mass_taper))
        rows.append(
            {
                "label": label,
                "member": results.scene.member_names[number],
                "name": results.scene.beam_names[number],
                "link": mechanism.links[at].name,
                "from": beam.start,
                "to": beam.end,
                **_making(results, number),
                "length": reading(length, "m"),
                "mass": reading(float(beam.mass_per_length) * length * mean_share, "kg"),
                "mass_per_length": reading(beam.mass_per_length, "kg/m"),
                "EA": reading(sections[number].EA, "N"),
                "EI": reading(sections[number].EI, "N m^2"),
                "tapered": sections[number].taper is not None or len(beam.mass_taper) > 1,
                "rigid": not math.isfinite(float(sections[number].EI)),
            }
        )
    return rows


def _making(results: Results, number: int) -> dict[str, str | None]:
    """Return words on the section of a beam with its dimensions, and the name of its material."""
    if number >= len(results.scene.made_of):
        return {"section": None, "material": None}
    made, shown_in = results.scene.made_of[number], results.scene.shown_in
    sizes = ", ".join(
        f"{name} {' to '.join(quantity(size, 'm', shown_in=shown_in) for size in ends)}"
        for name, ends in made.sizes.items()
    )
    return {
        "section": ", ".join(filter(None, (f"{made.section}: {made.shape}", sizes))),
        "material": made.material or None,
    }


def _peaks(reader: Reader) -> dict[str, dict[str, Reading]]:
    rows = {field: reader.results.figures.of_field(field) for field in EXTREME_FIELDS}
    return {
        label: {field: Reading(**reader.on_beam(field, peaks[beam], beam)) for field, peaks in rows.items()}
        for beam, label in enumerate(reader.scene.labels)
    }


def _greatest(reader: Reader, field: str) -> report.BeamReading | None:
    """Return the greatest magnitude of a field on any beam. Return None if it is unknown, or if there are no beams."""
    results = reader.results
    peaks = results.figures.of_field(field)
    beam = greatest(peaks)
    if beam is None:
        return None
    run = members_of(results.mechanism).runs[members_of(results.mechanism).number[beam]]
    at = run.beams.index(beam)
    length = results.deflection.length[beam].item()
    along = (float(run.start[at]) / abs(float(run.width[at])) + (-1 if run.turned[at] else 1) * peaks[beam].xi) * length
    return report.BeamReading(
        **reader.on_beam(field, peaks[beam], beam, error_of_extreme(peaks, beam), label=reader.scene.labels[beam]),
        member=reader.scene.member_names[beam],
        along_member=reading(along, "m"),
    )


def point_figures(reader: Reader) -> dict[str, dict[str, Reading]]:
    """Return the largest displacement of each moving point, and its largest components along and normal to the path."""
    keys = "displacement", "along_path", "off_path"
    rows = zip(*(reader.results.figures.peaks[key] for key in keys), strict=True)
    return {
        point: {key: reader.largest(peak, "m") for key, peak in zip(keys, peaks, strict=True)}
        for point, peaks in zip(items_of(reader.scene, POINT), rows, strict=True)
    }


def angle_figures(reader: Reader) -> dict[str, Reading]:
    """Return the largest angle error of each moving link, with the point of the link at which it occurs."""
    pairs = zip(reader.results.mechanism.links[1:], reader.results.figures.peaks["angle_error"], strict=True)
    return {link.name: reader.largest(peak, "rad", **_point(reader, link.name, peak)) for link, peak in pairs}


def _point(reader: Reader, link: str, peak: Peak) -> dict[str, Any]:
    """Return the point of a link at which an angle error occurs, if known."""
    mechanism = reader.results.mechanism
    return {} if math.isnan(peak.value) else {"point": [*mechanism.links[mechanism.index[link]].points][peak.row]}


def output_motion(reader: Reader, output: Output) -> dict[str, Any]:
    """Return the stroke or swing, time ratio, smallest mechanical advantage and turning points of the output.

    `advantage` is drive speed divided by output speed. It exists only if there is a single drive. `turns` are the
    positions at which the output reverses. These positions would be dead points if the output were driven.
    """
    cycle, rows = reader.cycle, {}
    for each in output_figures(output):
        if each.key in OUTPUT_MOTION and (each.key != "output_advantage" or len(cycle.scene.mechanism.drives) == 1):
            found = cycle.of(each)
            place, (unit,) = int(np.ravel(found.position)[0]), each.units(cycle.scene)
            more = {} if place < 0 else reader.at_position(place)
            rows[OUTPUT_MOTION[each.key]] = reading(np.ravel(found.value)[0], unit, **more)
    return {
        **rows,
        "turns": [{"kind": turn.kind, "drive": reader.coordinates(turn.drive)} for turn in turns_of(cycle, output)],
    }


def output_reading(reader: Reader) -> report.OutputReading | None:
    """Return the section on the output, with its error and the contributions of links.

    Return None without an output.
    """
    output = reader.results.figures.output
    if output is None:
        return None
    peak = reader.results.figures.peaks[OUTPUT_ERROR][0]
    slides = output.guessed and output.point in slid(reader.scene)
    kind = ("slide" if slides else "point") if output.point else "angle"
    place: dict[str, Any] = {} if output.point else _point(reader, output.link, peak)
    error = reader.largest(peak, output.unit, name=output.point or output.link, **place)
    return report.OutputReading(
        **structs.asdict(error),
        kind=kind,
        guessed=output.guessed,
        motion=output_motion(reader, output),
        shares=output_shares(reader.results, output, error),
        lags=[lag for cam in reader.scene.cams if (lag := reader.of_item("cam_lag", cam)) and lag.value],
    )


def exceedance_rows(reader: Reader) -> list[dict[str, Any]]:
    """Return the exceeded limits of beam theory as plain data, each with the actual value and the severity."""
    return [
        {
            "kind": each.kind,
            "label": None if each.beam is None else reader.scene.labels[each.beam],
            "figure": known(each.figure),
            "limit": each.limit,
            "level": exceedance_level(reader.results, each),
            **({} if peak is None else reader.at_peak(peak)),
        }
        for each, peak in reader.results.exceedances
    ]


def check_report(results: Results) -> report.CheckReport | None:
    """Return the section on the finite element check, or None if the check was not requested."""
    comparison = results.comparison
    if comparison is None:
        return None
    labels = results.scene.labels
    shares = [[known(value) for value in row] for row in comparison.relative.T]
    worst = max(comparison.worst, key=lambda worst: worst.relative, default=None)
    return report.CheckReport(
        passed=check_passed(results),
        tolerance=comparison.tolerance,
        elements=comparison.elements,
        compared=comparison.compared,
        largest=known(worst.relative) if worst else None,
        momentum={
            theory: report.MomentumReport(
                **structs.asdict(balance), largest=balance.largest, passed=balance.passed if balance.compared else None
            )
            for theory, balance in results.balances.items()
        },
        differences={label: dict(zip(PRIMARY, row, strict=True)) for label, row in zip(labels, shares, strict=True)},
        worst=[
            {
                "field": item.field,
                "label": labels[item.beam],
                "xi": item.xi,
                "position": item.position,
                "difference": reading(item.difference, FIELDS[item.field].unit),
                "share": known(item.relative),
            }
            for item in comparison.worst
        ],
    )
