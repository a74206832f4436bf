"""Findings on the accuracy of results: theory of motion, largest error in the main figures, errors in time histories.

A figure is a result such as the largest deflection.
"""

import math
from collections.abc import Iterator
from typing import Any

from kinelast.answers.answer import Answer
from kinelast.answers.results import Results
from kinelast.figures.figure_error import LARGE
from kinelast.figures.main_figures import HEADLINE, MainFigure
from kinelast.figures.peaks import greatest
from kinelast.reports.advice import nearer
from kinelast.scene.data import GEOMETRICALLY_EXACT
from kinelast.values.figure import OUTPUT_ERROR
from kinelast.values.numbers import MINUS, capitalized, error_percent, percent
from kinelast.values.reading import CAUTION, GOOD, POOR, Finding, known

HEADING = "Accuracy"
CHANGED = "the main deflections, stresses and forces"  # words for the figures of which `Answer.missed` is the change
MIN_SHARE = 0.01  # parts of an error that are smaller than this fraction of the error are not listed


def accuracy_findings(results: Results) -> Iterator[Finding]:
    """Yield a finding on the theory and the accuracy of the results."""
    answer = results.answer
    if answer is None:
        return
    if answer.vibrating and not answer.vibrating.stable:
        why = capitalized(results.instability)
        text = f"{why}. This is parametric resonance: no steady state exists, and the figures do not include vibration."
        yield Finding(POOR, HEADING, f"{text} Reduce the speed, or make the links stiffer or more damped.")
        return
    text, worst, brief = _theory_words(results, answer), results.worst, ""
    if results.error_unknown:
        text += " The error of the figures is not known."
    elif worst is not None:
        errors, brief = _error_words(results, answer, worst)
        text += f" {errors}"
    elif results.scene.labels:
        text += " Nothing bends."
    reached = results.error <= answer.requested.wanted and results.accurate is not False
    yield Finding(GOOD if reached else CAUTION, HEADING, text, brief)


def _theory_words(results: Results, answer: Answer) -> str:
    """Describe the theory of motion, and the relative change in the main figures due to vibration."""
    if not results.scene.labels:
        return "No link bends; the figures are those of the rigid motion."
    damping = _damping(results)
    if not results.vibrates and math.isnan(answer.missed):
        return f"Quasi-static: {answer.unknown}."
    if not results.vibrates:
        cause = "vibration and large displacement together" if LARGE in answer.off.stages else "vibration"
        return f"Quasi-static: {cause} would change {CHANGED} by up to {percent(answer.missed)}{damping}."
    motion = "Axial forces of the motion act on bending."
    if answer.theory == GEOMETRICALLY_EXACT:
        motion = "Large displacements are included. N, V, M and stresses include damping."
    differ = f"{CHANGED} would differ by up to {percent(answer.missed)} of the values shown"
    text = f"{answer.theory.capitalize()}: the links vibrate{damping}. {motion}"
    return f"{text} Without vibration and large displacement, {differ}."


def _error_words(results: Results, answer: Answer, worst: MainFigure) -> tuple[str, str]:
    """Return sentences on the largest errors.

    Also return the cause and the remedy in brief, if the requested accuracy is not reached.
    """
    name, item = _named(results, worst)
    of = f" of {item}" if item else ""
    wanted, requested = answer.requested.wanted, answer.requested.accuracy is not None
    parts = {part: size / worst.base for part, size in worst.error.terms.items()}
    shares = [
        f"{part} {MINUS if share < 0.0 else ''}{error_percent(abs(share))}"
        for part, share in parts.items()
        if abs(share) > MIN_SHARE * worst.share
    ]
    text = f"Largest error among the main figures: {error_percent(worst.share)}, {name}{of} ({', '.join(shares)})."
    if small := small_figures(results):
        text += f" Larger relative errors of small figures: {', '.join(small)}."
    brief, (curve, of_curve) = "", answer.worst_course
    if of_curve > wanted:
        text += f" Largest error of the curves over the cycle: {percent(of_curve)}, {curve}."
        text += "" if requested else " The aim does not include curves, but a requested accuracy does."
        brief = f"curves of {curve} ± {percent(of_curve)}" if requested else ""
    if worst.share > wanted:
        advice = nearer(results, worst.error, worst.base, wanted)
        text += f" The {'requested accuracy' if requested else 'aim'} is {percent(wanted)}"
        text += f": {advice}." if advice else "."
        remedy = advice.partition(": ")[2]
        brief = f"{name}{of} ± {error_percent(worst.share)}" + (f": {remedy}" if remedy else "")
    return text, brief


def _named(results: Results, worst: MainFigure) -> tuple[str, str]:
    """Return the names of a main figure and of its item, such as a link."""
    figure = results.figures.by_key[worst.key]
    return figure.name, results.scene.shown_items(figure.of)[worst.item]


def small_figures(results: Results) -> list[str]:
    """Return the names of headline figures that are near zero and have larger relative errors than all main figures."""
    figures, names = results.figures, []
    graded = {each.key for each in results.main_figures if not each.near_zero}
    for key in (*HEADLINE, OUTPUT_ERROR) if results.scene.labels else ():
        best = greatest(figures.peaks.get(key, ()))
        if key in graded or best is None:
            continue
        figure, peak = figures.by_key[key], figures.peaks[key][best]
        value = figures.rounded(peak.value, figure.units(results.scene)[best])
        if peak.error_size > results.error * abs(value) > 0.0:
            names.append(figure.name)
    return names


def worst_figure(results: Results) -> dict[str, Any]:
    """Return, for the report, the main figure with the largest relative error, its item, and the parts of the error."""
    worst = results.worst
    if worst is None:
        return {}
    name, item = _named(results, worst)
    errors = {part: known(size / worst.base) for part, size in worst.error.terms.items()}
    return {"figure": name, "on": item or None, "errors": errors}


def _damping(results: Results) -> str:
    """Return words on the damping that is assumed for materials without damping data, or "" if there are none."""
    theory = results.scene.theory
    assumed = not theory.damping or any(math.isnan(beta) for beta in theory.damping)
    return f" at {percent(theory.damping_ratio)} of critical damping" if assumed else ""
