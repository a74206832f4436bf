"""Verdict on a scene, with a row for each limit."""

from __future__ import annotations

import math

import numpy as np
from msgspec import UNSET
from msgspec.structs import asdict, replace

from kinelast.figures.entry import bounded_items, measures_of
from kinelast.figures.full_answer import judged_measure
from kinelast.figures.limits import BROKEN, PASSED, VERDICTS, Judgement, if_reliable, judgement, verdict_on
from kinelast.figures.reader import Reader, error_entries
from kinelast.figures.registry import ALONG_BEAMS, figures_of
from kinelast.figures.report import JudgedLimit, Verdict
from kinelast.figures.results import Results
from kinelast.scene.figure import LARGEST, items_of
from kinelast.scene.limits import Limit
from kinelast.scene.reading import Reading, known, reading

PLACES = {figure.key: figure.fields[0] for figure in ALONG_BEAMS if figure.fields}
"""Field with the place of each figure of beams."""


def acceptance(results: Results) -> Verdict:
    """Return the verdict on a scene, with a row for each limit."""
    judgements = if_reliable(results, [_of_own(results, limit) for limit in results.limits])
    verdict = verdict_on(judgements)
    if results.buckles:
        verdict = Verdict(verdict=VERDICTS[BROKEN], passed=False, problem=results.buckles)
    return replace(verdict, limits=[_judged_row(Reader(results), each) for each in judgements])


def _of_own(results: Results, limit: Limit) -> Judgement:
    """Judge a limit of the scene."""
    scene = results.scene
    asked = next((each for each in figures_of(results.figures.output) if each.key == limit.figure and each.asked), None)
    if asked is not None:
        return judged_measure(results, limit, measures_of(scene, [asked]).get(limit.figure))
    items = bounded_items(scene, limit) if limit.figure in results.figures.peaks else []
    return judgement(results, limit, limit.figure if items else "", items)


def _judged_row(reader: Reader, judged: Judgement) -> JudgedLimit:
    limit, figure = judged.limit, _found(reader, judged)
    of = next((each for each in figures_of(reader.results.figures.output) if each.key == limit.figure), None)
    if figure.value is not None and (of is None or of.over == LARGEST):
        figure = replace(figure, value=abs(figure.value))
    bound = reading(limit.bound, figure.unit if limit.kind == "output" else limit.unit)
    words = limit.kind, limit.kind if of is None else of.name, limit.least, limit.item
    used, kept = known(limit.used(judged.value)), bool(limit.kept(judged.value))
    return JudgedLimit(*words, bound, figure, used, judged.outcome, kept, PASSED.get(judged.outcome), judged.problem)


def _found(reader: Reader, judged: Judgement) -> Reading:
    """Return the figure of a limit with its place, without a value if it is unknown."""
    limit, results, kind = judged.limit, reader.results, judged.limit.kind
    peaks = results.figures.peaks
    if np.isnan(judged.value):
        return reading(np.nan, limit.unit or "m")
    if limit.figure not in peaks:
        return reading(judged.value, limit.unit, **error_entries(judged.value, judged.error), label="")
    peak = peaks[limit.figure][judged.item]
    if kind == "output":
        output = results.figures.output
        assert output is not None
        return reader.largest(peak, output.unit, label=output.point or output.link)
    if kind not in PLACES:
        endless = {"endless": True} if math.isinf(peak.value) else {}
        return reader.largest(peak, limit.unit, **endless, label=items_of(results.scene, limit.of)[judged.item])
    place = reader.on_beam(PLACES[kind], results.figures.of_field(PLACES[kind])[judged.item], judged.item)
    if kind == "safety":
        place |= {key: value for key, value in asdict(reader.largest(peak, "1")).items() if value is not UNSET}
    return Reading(**place, label=results.scene.labels[judged.item])
