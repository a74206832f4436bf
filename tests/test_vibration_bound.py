"""Bound of the change by vibration, against the full vibration of drawn mechanisms."""

import importlib
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from kinelast.figures.bounds import bound_of_vibration
from kinelast.figures.entry import magnitudes
from kinelast.runs.__init__ import computed
from kinelast.scene.data import ELASTODYNAMIC
from kinelast.scene.figure import LARGEST
from kinelast.tasks.request import Request


@pytest.mark.parametrize("number", [20, 26, 31, 33, 34, 42, 48])
def test_the_bound_of_vibration_covers_all_figures(number, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")
    scene = next(islice(importlib.import_module("random_scenes").scenes(5511), number, None))
    results = computed(scene, Request(theory=ELASTODYNAMIC))
    still = results.answer.cycle.still
    bound = bound_of_vibration(still, results.period)
    assert 0.0 < bound < 0.1
    figures = [each for each in results.answer.figures if each.power and each.follows is None and each.over == LARGEST]
    figures = [each for each in figures if not each.rigid and not each.of_motion(scene)]
    before, after = (magnitudes(each, figures) for each in (still, results.answer.cycle))
    changes = [np.abs(after[key] - sizes).max() / after[key].max() for key, sizes in before.items() if np.any(sizes)]
    assert len(changes) > 10
    assert 0.0 < max(changes) <= bound
