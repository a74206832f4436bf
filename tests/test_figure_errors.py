"""The stated error of a figure bounds its true error."""

import importlib
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace
from scene_texts import FOUR_BAR, edited
from tiers import in_tiers

from elastic.elastodynamics import (
    elastodynamic,
    finer_solution,
    finer_vibration,
    geometrically_exact,
    with_large_displacement,
)
from elastic.elastodynamics.solution import deflection_at, vibration_in
from kinelast import scene_from_text, shipped_scenes
from kinelast.answers.bounds import damping_of
from kinelast.answers.results import results_in_full
from kinelast.figures import errors
from kinelast.figures.cycle import Cycle
from kinelast.figures.figure_error import (
    BEAM_THEORY,
    BETWEEN,
    BODIES,
    FREQUENCIES,
    LARGE,
    MEASURED,
    ROUND_OFF,
    TIME,
    VIBRATION,
    FigureError,
)
from kinelast.figures.main_figures import MainFigure, worst_of
from kinelast.figures.measured import Measured, with_bodies
from kinelast.figures.measures import magnitudes
from kinelast.figures.peaks import error_of_extreme
from kinelast.figures.registry import figures_of
from kinelast.reports.advice import nearer
from kinelast.runs.__init__ import computed
from kinelast.scene.data import ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC
from kinelast.scene.document import read_scene
from kinelast.scene.text import file_text
from kinelast.tasks.request import Request
from kinelast.values.figure import LARGEST, LEAST

ARM = """
[sections.bar]
shape = "rigidities"
EA = "{EA}"
EI = "{EI}"
mass_per_length = "{mass}"
[points]
O = [0.0, 0.0]
A = [1.0, 0.0]
[links.ground]
points = ["O"]
[links.arm]
points = ["O", "A"]
section = "bar"
"""

HELD = (
    ARM.format(EA="1e9 N", EI="1 N m^2", mass="1e-6 kg/m")
    + """
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
)
MATTIASSON = {1: (0.30172, 0.05643), 2: (0.49346, 0.16064)}
"""Displacement of a cantilever's end across and along by a force, as in `test_geometrically_exact`."""


@pytest.mark.parametrize("positions", [1, 4])
@pytest.mark.parametrize("force", MATTIASSON)
def test_the_error_of_a_machine_at_rest_includes_large_displacement(force, positions):
    """Cantilever tip by the elastica: each figure alone, across, along, and the clamping moment."""
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


def test_every_figure_has_an_error_by_large_displacement():
    """Each error is right to an eighth of the change by the geometrically exact answer, if this is at least 1 %."""
    results = fast(ELASTODYNAMIC)
    reported, left = with_large_displacement(results.answer.vibrating)
    here, there = (largest(results, bent) for bent in (results.deflection, reported.deflection))
    exact = largest(results, geometrically_exact(results.answer.vibrating, 1e-5).deflection)
    changed = 0
    for key, values in exact.items():
        change, found = np.abs(values - here[key]), np.abs(there[key] - here[key])
        large = change > 0.01 * np.abs(here[key])
        np.testing.assert_allclose(found[large], change[large], rtol=1 / 8, err_msg=key)
        changed += int(large.sum())
    assert changed > 10
    assert left == 0.0


@pytest.mark.parametrize("name", in_tiers(["77311-14", "77311-15"], 0, 1))
def test_forces_of_exact_answers_on_coarse_elements_have_their_error(name, monkeypatch):
    """Large displacement changes peaks of joint forces by 2 %, and the exact answer is equally wrong there."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")
    drawn = importlib.import_module("random_scenes").scenes(77311)
    scene = next(each for each in drawn if each.name == name)
    rows = importlib.import_module("figure_errors").rows_of(scene, 1)
    reported = next(row for row in rows if row["answer"] == ELASTODYNAMIC)
    assert reported["figures"] > 40
    assert reported["more than two times too low"] == 0


@pytest.mark.slow
def test_every_figure_has_an_error_by_time_elements():
    """Time elements are too long; the stated errors are within a factor of 2.5 of the change by refinement."""
    results = fast(ELASTODYNAMIC)
    scene = results.scene
    given = results.motion, scene.course.at, results.period, scene.sections, scene.joints, damping_of(scene)
    rough, fine = (elastodynamic(*given, tolerance) for tolerance in (1e-2, 1e-5))
    coarse = geometrically_exact(rough, 1e-2)
    finer = finer_solution(coarse, finer_vibration(coarse), 1e-4)[0].deflection
    bent = coarse.deflection, finer, geometrically_exact(fine, 1e-5).deflection
    here, reported, best = (largest(results, each) for each in bent)
    ratios = []
    for key, values in best.items():
        off = np.abs(values - here[key])
        known = off > 1e-3 * np.abs(values)
        ratios += [*(np.abs(reported[key] - here[key])[known] / off[known])]
    assert len(ratios) > 10
    assert min(ratios) > 0.4
    assert max(ratios) < 2.5


SWUNG = (
    ARM.format(EA="2.1e7 N", EI="175 N m^2", mass="0.785 kg/m")
    + """
[[drives]]
link = "arm"
law = [{curve = "polynomial-345", duration = "0.1 s", by = "60 deg"}]
[run]
positions = 361
gravity = [0.0, 0.0]
"""
)


def test_axial_ringing_of_a_slender_arm_is_an_error():
    """Compared with the answer in all coordinates: stretching takes less than 1e-5 of the bending energy."""
    results = computed(scene_from_text(SWUNG), Request(theory=ELASTODYNAMIC))
    answer = results.answer.vibrating
    discretization, grid = answer.discretization, answer.vibration.problem.terms.grid
    whole = replace(discretization, modes=len(discretization.model.structure.stiffness))
    best = vibration_in(whole, grid.divided(np.full(len(grid.steps), 4)))
    finest = deflection_at(replace(answer, vibration=best), results.motion)
    for key in ("N", "u"):
        off = abs(largest(results, finest)[key][0] - largest(results, results.deflection)[key][0])
        assert abs(results.answer.errors[key][0].parts[TIME]) == pytest.approx(off, rel=0.5)


PUSHED = """
sections.bar = {shape = "rigidities", EA = "4e6 N", EI = "50 N m^2", mass_per_length = "0.16 kg/m"}
points = {O = [0.0, 1.0], A = [0.0, 0.0], B = [1.0, 0.0]}
links.ground.points = ["O"]
links.rod = {points = ["A", "B"], section = "bar"}
sliders.block = {link = "rod", through = "A", direction = "60 deg"}
[[drives]]
slider = "block"
law = [{curve = "cycloidal", duration = "50 ms", by = "2 mm"}]
[run]
positions = 1201
gravity = [0.0, 0.0]
damping_ratio = 1e-9
"""


def test_axial_ringing_of_a_rod_is_resolved_despite_its_small_displacement():
    """Waves in a rod with one free end, pushed from rest by a sine: superposed undamped modes.

    The stretch is a thousandth of the deflection; the first mode has sixty periods in the run.
    """
    results = computed(scene_from_text(PUSHED), Request(theory=ELASTODYNAMIC))
    odd, drive, time = np.pi / 2 * np.arange(1, 200, 2)[:, None], 2 * math.pi / 0.05, results.motion.time
    own = odd * math.sqrt(4e6 / 0.16)
    ringing = (np.sin(drive * time) - drive / own * np.sin(own * time)) / (1 - (drive / own) ** 2)
    pushed = 0.16 * math.cos(math.pi / 3) * 0.002 * 2 * math.pi / 0.05**2
    known = pushed * np.abs((2 / odd**2 * ringing).sum(axis=0)).max()
    assert abs(results.figures.peaks["N"][0].value) == pytest.approx(known, rel=0.005)


def test_a_check_takes_the_place_of_estimates_it_is_finer_than():
    reported = FigureError({VIBRATION: 5.0, LARGE: -1.0, BEAM_THEORY: 0.5, ROUND_OFF: 0.1})
    off, own = {"w": [3.0, 0.2, math.nan]}, {"w": [0.5, 4.5, 0.5]}
    fine, coarse, nothing = (Measured(off, own).in_place("w", item, reported) for item in range(3))
    assert fine.parts == {MEASURED: 3.5, BEAM_THEORY: 0.5, ROUND_OFF: 0.1}
    assert fine.size == 4.1
    assert coarse is nothing is reported
    assert Measured(off, own).in_place("M", 0, reported) is reported
    unknown = Measured(off, own).in_place("w", 1, FigureError({BEAM_THEORY: 0.5}, "friction"))
    assert unknown.size == 5.2


def test_plane_bodies_replace_the_estimated_error_of_beam_theory():
    """The chord of a body gets its own value; others get the estimate, scaled up like that of the worst beam."""
    parts = [1.0, 2.0, 0.01]
    errors = {"chord": [FigureError({BEAM_THEORY: part, TIME: 0.1}) for part in parts]}
    errors["M"] = [FigureError({BEAM_THEORY: 7.0, TIME: 0.1})]
    reported = with_bodies(errors, [0.5, 1.0, 0.2], [0.6, 1.0, 0.2], 0.0)
    assert [each.parts[BODIES] for each in reported["chord"]] == [0.5, 1.0, 0.2]
    assert reported["M"][0].parts == {TIME: 0.1, BODIES: pytest.approx(0.6 * 7.0)}
    left_out = with_bodies(errors, [0.5, math.nan, 0.2], [0.6, math.nan, 0.2], 0.0)
    assert left_out["chord"][0].parts == {TIME: 0.1, BODIES: 0.5}
    assert left_out["chord"][1] is errors["chord"][1]
    assert left_out["M"][0] is errors["M"][0]


@pytest.mark.slow
def test_residual_vibration_is_known_to_a_share_of_the_largest_displacement():
    """In a dwell with long time elements, numerical damping exceeds that of the material."""
    stop = '[{curve = "cycloidal", duration = "80 ms", by = "30 deg"}, {curve = "dwell", duration = "0.2 s"}]'
    text = edited(FOUR_BAR, ('speed = "100 rad/s"', f"law = {stop}"), ("positions = 36", "positions = 73"))
    results = computed(scene_from_text(text), Request(theory=ELASTODYNAMIC))
    found, moved = results.figures.peaks["residual"][0], results.figures.peaks["displacement"]
    vibrating = results.answer.vibrating
    settled = vibrating.discretization_error
    assert found.error.parts[TIME] >= settled * max(abs(peak.value) for peak in moved) > 0


@pytest.mark.slow
def test_residual_vibration_has_the_error_of_the_natural_frequencies():
    """The stated part agrees with the change in a mechanism that is softer by twice the error of its frequency."""
    arm = Path("docs/gallery/pick_and_place_arm.toml").read_text(encoding="utf-8")
    stiff = computed(scene_from_text(arm), Request())
    E = 70 * (1 - 2 * stiff.figures.frequency_error)
    soft = computed(scene_from_text(edited(arm, ('E = "70 GPa"', f'E = "{E} GPa"'))), Request())
    (residual,), (softer,) = (each.figures.peaks["residual"] for each in (stiff, soft))
    change = abs(softer.value - residual.value)
    assert change > 0.02 * residual.value
    assert change / 2 < residual.error.parts[FREQUENCIES] < 2 * change
    assert residual.error.size < 3 * change


def test_an_unknown_error_is_the_worst():
    known, unknown = FigureError({"vibration": 5.0}), FigureError({"vibration": 0.0}, "friction")
    main_figures = [MainFigure("w", 0, 1.0, 1.0, known), MainFigure("w", 1, 1.0, 1.0, unknown)]
    assert worst_of(main_figures) is main_figures[1]
    assert math.isnan(worst_of(main_figures).share)
    assert worst_of(main_figures[:1]).share == 5.0
    assert worst_of([]) is None


SWUNG_LONG = (
    ARM.format(EA="1e9 N", EI="1e6 N m^2", mass="1 kg/m")
    + """
[[drives]]
link = "arm"
law = [{ curve = "cycloidal", duration = "2 s", by = "1 rad" }, { curve = "dwell", duration = "1 s" }]
[run]
duration = "3 s"
positions = 4
"""
)


@pytest.mark.parametrize("run", [("3 s", 6), ("3 s", 8), ("2000 s", 9)])
def test_peaks_between_the_positions_are_an_error(run):
    """Cantilever under an angular acceleration: 11 q L^4 / (120 EI), with 2 pi h / T^2 for a cycloid."""
    duration, positions = run
    edits = ('duration = "3 s"', f'duration = "{duration}"'), ("positions = 4", f"positions = {positions}")
    results = computed(scene_from_text(edited(SWUNG_LONG, *edits)), Request(accuracy=0.99))
    (error,), value = results.errors["deflection"], abs(results.figures.peaks["deflection"][0].value)
    most = 11 / 120e6 * 2 * math.pi / 2**2
    assert results.answer.theory == QUASI_STATIC
    assert value < 0.99 * most
    assert value + error.parts[BETWEEN] == pytest.approx(most, rel=5e-3)
    assert nearer(results, error, value, 0.01) == "mostly between the positions: --positions 360 would reduce it"


def test_the_relative_error_of_a_safety_is_that_of_its_stress():
    """However large: a judgement divides the safety by 1 plus this share."""
    text = file_text(shipped_scenes()["steel_four_bar"]).replace("positions = 360", "positions = 7")
    text = text.replace('accuracy = "5 %"', 'theory = "quasi-static"')
    peaks = results_in_full(scene_from_text(text)).figures.peaks
    shares = {key: [abs(each.error.parts[BETWEEN] / each.value) for each in peaks[key]] for key in ("safety", "stress")}
    assert shares["safety"] == pytest.approx(shares["stress"], rel=0.01)
    assert max(shares["stress"]) > 0.05


@pytest.mark.slow
def test_the_size_of_a_cam_is_no_base_for_errors_of_displacement():
    """The cam of a valve train is 1,400 times as large as its largest deflection, which a finer answer confirms."""
    scene = read_scene(Path(__file__).parents[1] / "docs" / "gallery" / "valve_train.toml")
    (stated,), (fine,) = (
        [max(computed(scene, Request(accuracy=accuracy)).figures.peaks["deflection"], key=lambda peak: abs(peak.value))]
        for accuracy in (0.05, 0.005)
    )
    assert abs(stated.value - fine.value) <= stated.error.size < 0.05 * abs(stated.value)


def test_the_power_of_a_drive_at_constant_speed_has_the_error_of_its_torque():
    """Power is torque times speed, and the speed is exact."""
    results = computed(read_scene(Path("docs/gallery/needle_drive.toml")), Request())
    (torque,), (power,) = (results.figures.peaks[key] for key in ("drive_effort", "drive_power"))
    assert power.value / torque.value == pytest.approx(results.motion.drive_rate[0, 0], rel=1e-9)
    assert power.error.size / power.value == pytest.approx(torque.error.size / torque.value, rel=1e-9)
    assert torque.error.parts[TIME] > 0.1 * torque.error.size


def test_a_stress_is_not_known_better_than_the_force_that_causes_it():
    """The moment at the root of the driven crank is the drive torque."""
    figures = computed(read_scene(shipped_scenes()["quick_return"]), Request()).figures
    torque, stress = (max(figures.peaks[key], key=lambda each: abs(each.value)) for key in ("drive_effort", "stress"))
    shares = [each.error.parts[TIME] / abs(each.value) for each in (torque, stress)]
    assert shares[0] > 0.001
    assert shares[1] == pytest.approx(shares[0], rel=0.05)


def test_a_safety_factor_has_the_relative_error_of_the_stress_of_links_of_different_strength():
    """The crank has the largest stress, and the weaker second link the smallest safety factor."""
    strength = np.array([400.0, 40.0, 40.0])
    values = {"stress": np.array([4.0, 1.0, 2.0])}
    values["safety"] = strength / values["stress"]
    figures = [figure for figure in figures_of(None) if figure.key in values]
    here = np.concatenate([values[figure.key] for figure in figures])
    _, wide = errors._references(figures, values, [3, 3], here, np.zeros(6))
    relative = dict(zip((figure.key for figure in figures), np.split(wide / here, 2), strict=True))
    np.testing.assert_allclose(relative["stress"], [1.0, 4.0, 2.0])
    np.testing.assert_allclose(relative["safety"], [1.0, 4.0, 2.0])


@pytest.mark.parametrize(
    ("over", "values", "best", "expected"),
    [
        (LARGEST, [(3.0, 0.1), (-2.9, 0.5), (1.0, 1.0)], 0, 0.4),
        (LARGEST, [(3.0, 0.1), (-2.9, 0.1), (1.0, math.nan)], 0, 0.1),
        (LEAST, [(3.0, 0.1), (3.1, 0.6), (9.0, 1.0)], 0, 0.5),
    ],
)
def test_the_error_of_a_largest_value_covers_items_that_may_be_larger(over, values, best, expected):
    peaks = [SimpleNamespace(value=value, error_size=error) for value, error in values]
    assert error_of_extreme(peaks, best, over) == pytest.approx(expected)


COLUMN = """
[points]
A = [0, 0]
B = [0.5, 0]
Z = [9, 0]
Y = [9.1, 0]
[links.ground]
points = ["A", "Z"]
[links.column]
points = ["A", "B"]
section = "round 12"
material = "S235"
[links.block]
points = ["B"]
mass = 0.001
[sliders.guide]
link = "block"
through = "B"
direction = [1, 0]
[[loads]]
link = "block"
point = "B"
force = [-2000, {across}]
[links.dummy]
points = ["Z", "Y"]
rigid = true
mass = 0
[[drives]]
link = "dummy"
speed = "1 rpm"
[run]
positions = 4
"""


@pytest.mark.parametrize("across", [0, 500])
def test_round_off_of_a_bending_that_is_zero_is_no_error(across):
    """A column under its axial load has no rotation, so relative errors in rotations are meaningless."""
    results = computed(scene_from_text(COLUMN.format(across=across)), Request())
    (stress,) = results.figures.peaks["stress"]
    assert abs(stress.value) == pytest.approx(2000 / (np.pi * 0.012**2 / 4), rel=1e-9)
    assert stress.error_size < 1e-4 * abs(stress.value)
