"""Figures at few positions and at sixteen times as many differ by less than their stated errors."""

import math
from pathlib import Path

import numpy as np
import pytest
from tiers import in_tiers

from kinelast import shipped_scenes
from kinelast.answers import theory
from kinelast.answers.results import answered
from kinelast.figures.figure_error import BETWEEN
from kinelast.runs import computed
from kinelast.scene.data import ACCURACY, Theory
from kinelast.scene.document import read_document, scene_from_text
from kinelast.tasks.request import Request

FEW, TIMES = 24, 16
GALLERY = Path(__file__).parents[1] / "docs" / "gallery" / "pick_and_place_arm.toml"
ROUND_OFF = 1e-6  # smallest difference that counts, relative to the largest figure of a key: error of swings
NOTHING = 1e-12  # in any unit: means that are zero
MAX_RATIO = 1.1  # stated errors are searched at 21 stations per beam, figures everywhere
EXCLUDED = {"condition", "contact_losses"}  # condition belongs to single positions; losses of contact are a count

DRAWN = """
title = "drawn"
sections.bar = {{shape = "rectangle", depth = "{depth} mm", width = "12 mm"}}
points = {{O = [0.0, 0.0], A = [{crank}, 0.0], B = [{x}, {y}], D = [0.35, 0.0]}}
links.ground = {{points = ["O", "D"]}}
links.crank = {{points = ["O", "A"], {made}}}
links.coupler = {{points = ["A", "B"], {made}}}
links.rocker = {{points = ["D", "B"], {made}}}
motors.m = {{gear_ratio = 5, efficiency = "80 %", rotor_inertia = "1e-4 kg m^2"}}
[[drives]]
link = "crank"
speed = 20.0
motor = "m"
unevenness = "2 %"
[bearings.D]
clearance = "20 um"
rolling = {{C = "10 kN", C0 = "5 kN", elements = 9}}
plain = {{diameter = "20 mm", width = "15 mm"}}
pin = {{diameter = "10 mm", eye = "12 mm", cheek = "6 mm", gap = "0.5 mm", yield = "300 MPa"}}
[run]
output = "rocker.angle"
gravity = [0.0, -9.81]
"""
CASES = [
    ("steel_four_bar", None),
    (0, False),
    (0, True),
    ("quick_return", None),
    ("pusher", None),
    ("offset_slider_crank", None),
    ("drs_push_up", None),
    *((seed, rigid) for seed in (1, 2) for rigid in (False, True)),
]
"""A shipped scene, or the seed of a random scene and whether its links are rigid."""


def drawn(seed: int, rigid: bool) -> str:
    """Return a random crank-rocker of three bars, or of three rigid links with mass."""
    random = np.random.default_rng(seed)
    while True:
        crank, coupler, rocker = random.uniform([0.04, 0.2, 0.15], [0.1, 0.4, 0.35])
        short, *others, long = sorted([0.35, crank, coupler, rocker])
        if short == crank and short + long < 0.9 * sum(others):
            break
    base = 0.35 - crank
    x = (coupler**2 - rocker**2 + base**2) / (2 * base)
    made = 'rigid = true, mass = "1 kg", center = [0.05, 0.01]' if rigid else 'section = "bar", material = "S235"'
    y = math.sqrt(coupler**2 - x**2)
    return DRAWN.format(crank=crank, x=crank + x, y=y, depth=random.integers(8, 20), made=made)


def figures(text_or_name: str, positions: int):
    """Return value and error of each item of each figure of a quasi-static answer."""
    if "\n" in text_or_name:
        scene = scene_from_text(text_or_name.replace("[run]", f"[run]\npositions = {positions}"))
    else:
        scene = read_document(shipped_scenes()[text_or_name]).with_positions(positions).scene
    results = answered(computed(scene, Request(theory="quasi-static")), Theory("quasi-static"), judged=True)
    peaks = results.figures.peaks
    return {key: [(abs(each.value), each.error) for each in rows] for key, rows in peaks.items()}


@pytest.mark.parametrize(("scene", "rigid"), in_tiers(CASES, 3, 4))
def test_figures_at_few_positions_are_within_their_errors(scene, rigid):
    text = scene if rigid is None else drawn(scene, rigid)
    few, many = (figures(text, count) for count in (FEW, TIMES * FEW))
    compared = 0
    for key in few.keys() - EXCLUDED:
        scale = max((value for value, _ in many[key] if math.isfinite(value)), default=0.0)
        for (value, error), (other, own) in zip(few[key], many[key], strict=True):
            if math.isfinite(value) and math.isfinite(other):
                stated = sum(abs(part) for each in (error, own) for part in each.parts.values())
                assert abs(value - other) <= MAX_RATIO * stated + ROUND_OFF * scale + NOTHING, key
                compared += 1
    assert compared > 40


@pytest.mark.parametrize("name", in_tiers(["pick_and_place_arm", "steel_four_bar"], 1, 1))
def test_peaks_that_the_positions_miss_are_evaluated_without_solving_again(name, monkeypatch):
    """They agree with a solution at the additional positions, and with one at sixteen times as many positions."""
    paths = shipped_scenes() | {GALLERY.stem: GALLERY}
    document, solved, solve = read_document(paths[name]), [], theory._vibrating
    monkeypatch.setattr(theory, "_vibrating", lambda *given: solved.append(given) or solve(*given))
    few, many = (computed(document.with_positions(count).scene, Request()) for count in (FEW, TIMES * FEW))
    assert len(solved) == 2
    assert len(few.answer.cycle.motion.time) > FEW
    again = theory.answer(few.answer.cycle.quasi_static, few.scene.theory, few.period)
    for here, same, there in zip(few.answer.main_figures, again.main_figures, many.answer.main_figures, strict=True):
        assert (here.key, here.item) == (same.key, same.item) == (there.key, there.item)
        assert here.error.parts[BETWEEN] < ACCURACY * here.base
        assert here.value == pytest.approx(same.value)
        assert here.error.parts == pytest.approx(same.error.parts)
        assert abs(here.value - there.value) <= here.error.size + there.error.size
