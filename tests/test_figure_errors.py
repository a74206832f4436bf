"""Claim: the error of a figure is what the figure is off by."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scene_texts import FOUR_BAR, edited

from elastic.elastodynamics import elastodynamic, geometrically_exact, in_finer_elements, with_large_displacement
from kinelast import scene_from_text
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import magnitudes
from kinelast.figures.errors import FigureError, GradedFigure, worst_of
from kinelast.figures.theory import damping_of
from kinelast.runs.__init__ import computed
from kinelast.scene.data import ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC
from kinelast.tasks.request import Request

HELD = """
[sections.bar]
shape = "rigidities"
EA = "1e9 N"
EI = "1 N m^2"
mass_per_length = "1e-6 kg/m"
[points]
O = [0.0, 0.0]
A = [1.0, 0.0]
[links.ground]
points = ["O"]
[links.arm]
points = ["O", "A"]
section = "bar"
[[loads]]
link = "arm"
point = "A"
force = [0.0, "{force} N"]
[[drives]]
link = "arm"
law = [{{curve = "dwell", duration = "1 s"}}]
[run]
positions = {positions}
"""
MATTIASSON = {1: (0.30172, 0.05643), 2: (0.49346, 0.16064)}
"""Displacement of a cantilever's end across and along by a force, as in `test_geometrically_exact`."""


@pytest.mark.parametrize("positions", [1, 4])
@pytest.mark.parametrize("force", MATTIASSON)
def test_a_machine_at_rest_is_told_what_large_displacement_changes(force, positions):
    """Of a cantilever's end by the elastica: each figure by itself, across, along, and the moment at the clamp."""
    across, along = MATTIASSON[force]
    results = computed(scene_from_text(HELD.format(force=force, positions=positions)), Request(accuracy=0.99))
    assert results.answer.theory == QUASI_STATIC
    off = {
        "deflection": force / 3 - across,
        "displacement": force / 3 - abs(across + 1j * along),
        "u": along,
        "M": force * along,
    }
    for key, known in off.items():
        assert results.answer.errors[key][0].size == pytest.approx(known, rel=2e-3)


def test_a_machine_at_rest_that_bends_far_is_answered_exactly():
    results = computed(scene_from_text(HELD.format(force=2, positions=3)), Request())
    assert results.answer.theory == GEOMETRICALLY_EXACT
    assert results.figures.peaks["deflection"][0].value == pytest.approx(MATTIASSON[2][0], abs=1e-5)
    assert results.answer.error < 1e-3


def fast(theory):
    text = edited(FOUR_BAR, ("positions = 36", "positions = 72"))
    return computed(scene_from_text(text), Request(theory=theory))


def largest(results, bent):
    figures = [figure for figure in results.answer.figures if not figure.rigid]
    return magnitudes(Cycle(results.scene, results.motion, bent, sampled=True), figures)


def test_large_displacement_is_told_of_every_figure():
    """To a tenth of what the settled geometrically exact answer changes, where that is a hundredth at least."""
    results = fast(ELASTODYNAMIC)
    told, left = with_large_displacement(results.answer.vibrating)
    here, there = (largest(results, bent) for bent in (results.deflection, told.deflection))
    exact = largest(results, geometrically_exact(results.answer.vibrating, 1e-5).deflection)
    changed = 0
    for key, values in exact.items():
        change, found = np.abs(values - here[key]), np.abs(there[key] - here[key])
        large = change > 0.01 * np.abs(here[key])
        np.testing.assert_allclose(found[large], change[large], rtol=0.1, err_msg=key)
        changed += int(large.sum())
    assert changed > 10
    assert left == 0.0


def test_elements_of_time_are_told_of_every_figure():
    """Of an exact answer in elements too long, within 2.5 times of what finer ones and more coordinates change."""
    results = fast(ELASTODYNAMIC)
    scene = results.scene
    given = results.motion, scene.course.at, results.period, scene.sections, scene.joints, damping_of(scene)
    rough, fine = (elastodynamic(*given, tolerance) for tolerance in (1e-2, 1e-5))
    coarse = geometrically_exact(rough, 1e-2)
    bent = coarse.deflection, in_finer_elements(coarse, 1e-4)[0], geometrically_exact(fine, 1e-5).deflection
    here, told, best = (largest(results, each) for each in bent)
    ratios = []
    for key, values in best.items():
        off = np.abs(values - here[key])
        known = off > 1e-3 * np.abs(values)
        ratios += [*(np.abs(told[key] - here[key])[known] / off[known])]
    assert len(ratios) > 10
    assert min(ratios) > 0.4
    assert max(ratios) < 2.5


def test_an_unknown_error_is_the_worst():
    known, unknown = FigureError({"vibration": 5.0}), FigureError({"vibration": 0.0}, "friction")
    graded = [GradedFigure("w", 0, 1.0, 1.0, known), GradedFigure("w", 1, 1.0, 1.0, unknown)]
    assert worst_of(graded) is graded[1]
    assert math.isnan(worst_of(graded).share)
    assert worst_of(graded[:1]).share == 5.0
    assert worst_of([]) is None
