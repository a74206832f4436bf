"""Bound of the change by vibration, against the full vibration of drawn mechanisms."""

import importlib
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from kinelast.answers.bounds import bound_of_vibration
from kinelast.figures.measures import magnitudes
from kinelast.runs import computed
from kinelast.scene.data import ELASTODYNAMIC
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from kinelast.values.figure import LARGEST


@pytest.mark.parametrize("number", [20, 26, 31, 33, 34, 42, 48])
def test_the_bound_of_vibration_covers_all_figures(number, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")
    scene = next(islice(importlib.import_module("random_scenes").scenes(5511), number, None))
    results = computed(scene, Request(theory=ELASTODYNAMIC))
    still = results.answer.cycle.quasi_static
    bound = bound_of_vibration(still, results.period)
    assert 0.0 < bound < 0.1
    figures = [each for each in results.answer.figures if each.power and each.follows is None and each.over == LARGEST]
    figures = [each for each in figures if not each.rigid and not each.of_motion(scene)]
    before, after = (magnitudes(each, figures) for each in (still, results.answer.cycle))
    changes = [np.abs(after[key] - sizes).max() / after[key].max() for key, sizes in before.items() if np.any(sizes)]
    assert len(changes) > 10
    assert 0.0 < max(changes) <= bound


FIRST = Path(__file__).parents[1] / "kinelast" / "scene" / "first.toml"


@pytest.mark.parametrize(("speed", "damping"), [("60 rpm", "50 ms"), ("100 rpm", "20 ms")])
def test_the_bound_covers_the_lag_of_strong_damping(speed, damping):
    text = FIRST.read_text(encoding="utf-8").replace('"300 rpm"', f'"{speed}"').replace('"-2 kN"', '"-5 N"')
    scene = scene_from_text(text.replace('"7850 kg/m^3"', f'"7850 kg/m^3"\ndamping = "{damping}"'))
    answers = [computed(scene, Request(theory=theory)) for theory in (None, ELASTODYNAMIC)]
    (here, there), errors = ([abs(each.figures.peaks["deflection"][1].value) for each in answers], answers[0].errors)
    assert abs(here - there) <= 2 * errors["deflection"][1].size
