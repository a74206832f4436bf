"""The program selects the cheapest theory that meets the accuracy, and states the error of its answer."""

import csv
import json
import math
import re
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from answers_table import SLOTTED
from msgspec.structs import replace
from scene_texts import FOUR_BAR, RISE_AND_RETURN, edited
from tiers import in_tiers

from elastic import deflection, sample
from elastic.assessment import buckling
from elastic.elastodynamics import including, transient
from elastic.elastodynamics.vibration_settings import VIBRATION as VIBRATION_SETTINGS
from kinelast import read_scene, scene_from_text, scene_motion, shipped_scenes
from kinelast.answers import exact_errors
from kinelast.answers.answer import Answer
from kinelast.answers.bounds import damping_of
from kinelast.answers.checks import NonlinearCheck, nonlinear_check, solid_check
from kinelast.answers.results import Results
from kinelast.answers.theory import _Theories
from kinelast.answers.theory import answer as answer_of
from kinelast.answers.theory_settings import THEORY
from kinelast.cli.command import main
from kinelast.figures.errors import Estimate
from kinelast.figures.figure_error import (
    BEAM_THEORY,
    BETWEEN,
    LARGE,
    MEASURED,
    NOT_OF_MOTION,
    TIME,
    VIBRATION,
    FigureError,
)
from kinelast.figures.main_figures import MainFigure
from kinelast.outputs.words import further_checks, reached_words
from kinelast.reports.advice import exceedance_advice, nearer
from kinelast.reports.report import FurtherCheck
from kinelast.reports.sections import nonlinear_report
from kinelast.reports.summary import exceedance_rows, theory_report
from kinelast.reports.trust import findings
from kinelast.runs import computed
from kinelast.scene.data import ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC, Theory, scene_deflection
from kinelast.speed_study.speeds import speeds
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from kinelast.values.reading import Reader
from rigid import with_rates

DATA = Path(__file__).parent / "data"

SLOW, FAST = "20 rad/s", "60 rad/s"
RIGIDITIES = 'shape = "rigidities"\nEA = "12.6 MN"\nEI = "37.8 N m^2"\nmass_per_length = "0.471 kg/m"'
RAISED = """
materials.steel = {E = "210 GPa", density = 7850}
sections.bar = {shape = "rectangle", depth = "10 mm", width = "10 mm"}
points = {O = [0.0, 0.0], A = [0.5, 0.0]}
links.ground.points = ["O"]
links.arm = {points = ["O", "A"], section = "bar", material = "steel", masses = {A = "0.3 kg"}}
[[drives]]
link = "arm"
law = [{curve = "polynomial-345", duration = "12 ms", by = "1 deg"}]
[run]
positions = 97
"""
PARALLELOGRAM_BARS = edited(
    FOUR_BAR,
    ("A = [0.1, 0.0]", "A = [0.0, 0.1]"),
    ("B = [0.28, 0.24]", "B = [0.35, 0.1]"),
    ("positions = 36", "positions = 8"),
)


def scene_at(speed, run=""):
    return scene_from_text(
        edited(FOUR_BAR, ('"100 rad/s"', f'"{speed}"'), ("positions = 36", f"positions = 96\n{run}"))
    )


def results_at(speed, run=""):
    return computed(scene_at(speed, run), Request())


def test_where_nothing_is_asked_the_answer_is_within_five_percent():
    """At high speed the links vibrate, at low speed they need not; the first finding states the error."""
    slow, fast = results_at(SLOW), results_at(FAST)
    assert (slow.answer.theory, fast.answer.theory) == (QUASI_STATIC, ELASTODYNAMIC)
    assert all(0 < results.answer.error < 0.05 for results in (slow, fast))
    assert fast.answer.missed > 0.05
    np.testing.assert_array_equal(sample(slow.deflection, "w", [0.5]), sample(slow.quasi_static, "w", [0.5]))
    assert [one.requested.accuracy for one in (slow.answer, fast.answer)] == [None, None]


def test_the_plain_answer_is_asked_for_by_name():
    results = computed(scene_at(FAST), Request(theory=QUASI_STATIC))
    plain = deflection(results.motion, results.scene.sections)
    assert results.answer is None
    np.testing.assert_array_equal(sample(results.deflection, "w", [0.5]), sample(plain, "w", [0.5]))
    assert any("vibration" in finding.text for finding in findings(results) if finding.heading == "Not judged")


def test_a_law_that_moves_the_drive_is_answered_from_its_start():
    """An arm of 0.5 m with 0.3 kg at its tip is raised by 1 degree in 12 ms: not a cycle, and it rings."""
    results = computed(scene_from_text(RAISED), Request())
    assert results.vibrates
    assert results.answer.missed > 0.1


@pytest.mark.parametrize("theory", [ELASTODYNAMIC, GEOMETRICALLY_EXACT])
def test_a_quick_course_from_rest_is_that_of_the_whole_nonlinear_mechanism(theory):
    """A cycloid starts with a jerk; quasi-static links would move at once and deflect twenty times as far."""
    results = computed(scene_from_text(edited(RAISED, ("polynomial-345", "cycloidal"))), Request(theory=theory))
    check = nonlinear_check(results)
    assert check.passed
    assert check.largest < 1e-3 < min(check.without_vibration.values())


def test_a_rate_that_is_round_off_is_rest():
    """A start at 1e-9 of the largest rate equals a start at zero rate."""
    scene = scene_from_text(edited(RAISED, ("polynomial-345", "cycloidal")))
    at_rest = computed(scene, Request(theory=ELASTODYNAMIC)).deflection

    def creeping(time):
        rigid = scene.course.at(time)
        return with_rates(rigid, rigid.drive_rate + 1e-9, rigid.drive_acceleration)

    moving = transient(creeping(at_rest.motion.time), creeping, scene.sections, scene.joints, damping_of(scene))
    here, there = (sample(bent, "w", [1.0]) for bent in (at_rest, moving.deflection))
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-3 * np.abs(here).max())


@pytest.mark.parametrize("theory", in_tiers([ELASTODYNAMIC, GEOMETRICALLY_EXACT], 1, 1))
def test_a_law_that_begins_with_a_jump_of_the_acceleration_finds_links_at_rest(theory):
    """The result equals that after a dwell of a millisecond, which starts at rest without a jump."""
    gravity = ("positions = 97", "positions = 61\ngravity = [0, -9.81]")
    curve = '{curve = "harmonic", duration = "12 ms", by = "1 deg"}, {curve = "dwell", duration = "18 ms"}]'
    law = '{curve = "polynomial-345", duration = "12 ms", by = "1 deg"}]'
    jump = edited(RAISED, (law, curve), gravity)
    later = edited(
        jump, ("law = [", 'law = [{curve = "dwell", duration = "1 ms"}, '), ("positions = 61", "positions = 63")
    )
    found = [computed(scene_from_text(text), Request(theory=theory)).deflection for text in (jump, later)]
    here, there = (sample(bent, "w", [0.5, 1.0])[0] for bent in found)
    between = np.delete(np.arange(61), [0, 24])  # loads jump at these two instants
    np.testing.assert_allclose(here[between], there[2:][between], rtol=0, atol=2e-3 * np.abs(there).max())
    static = sample(deflection(with_rates(found[0].motion, 0.0), found[0].sections), "w", [0.5, 1.0])[0]
    np.testing.assert_allclose(there[:2], static[[0, 0]], rtol=0, atol=2e-4 * np.abs(static).max())


@pytest.mark.slow
def test_a_parametric_resonance_is_told():
    """Free vibrations with little damping grow by half-turn excitation, below the buckling load."""
    results = results_at("660 rad/s", "damping_ratio = 0.001")
    assert not results.buckles
    assert not results.answer.vibrating.stable
    assert results.answer.missed == math.inf
    assert any("parametric resonance" in finding.text and finding.level == "poor" for finding in findings(results))


def test_the_cheapest_theory_that_is_near_enough():
    """The same mechanism: at low speed vibration is below one per cent, at high speed it is large."""
    slow, fast = (results_at(speed, 'accuracy = "5 %"').answer for speed in (SLOW, FAST))
    rough = results_at(FAST, 'accuracy = "60 %"').answer
    assert (slow.theory, fast.theory, rough.theory) == (QUASI_STATIC, ELASTODYNAMIC, QUASI_STATIC)
    assert slow.accurate
    assert rough.accurate
    assert fast.missed > 0.05


@pytest.mark.slow
def test_a_finer_accuracy_never_takes_a_cheaper_theory_or_a_worse_answer():
    """Vibration 9 %, large displacement 0.1 %, shear and end moments 0.08 %: each accuracy requires the next."""
    scene = scene_at(FAST)
    found = [computed(scene, Request(accuracy=share, positions=360)).answer for share in (0.6, 0.05, 0.0015, 0.0005)]
    rungs = (QUASI_STATIC, ELASTODYNAMIC, GEOMETRICALLY_EXACT)
    taken = [rungs.index(answer.theory) for answer in found]
    assert taken == [0, 1, 2, 2]
    errors = [answer.error for answer in found]
    assert all(finer < 1.03 * coarser for coarser, finer in pairwise(errors))
    assert [answer.accurate for answer in found] == [True, True, True, False]  # beam theory is not right to 0.05 %
    assert found[-1].by_motion < 0.0005


@pytest.mark.slow
def test_a_requested_accuracy_measures_the_errors_of_an_exact_answer():
    """Errors below 0.1 % may be bounds."""
    scene = read_scene(shipped_scenes()["steel_four_bar"])
    found, fine = (
        computed(scene, Request(**how)).answer for how in ({"accuracy": 0.02}, {"theory": GEOMETRICALLY_EXACT})
    )
    assert found.theory == GEOMETRICALLY_EXACT
    for name in ("w", "M"):
        assert found.courses[name] < max(0.001, 2 * _apart(fine, found, name))


def _apart(one, other, name):
    """Return the largest difference of a field of the worst beam, relative to its maximum."""
    here, there = (sample(each.deflection, name, np.linspace(0, 1, 5)) for each in (one, other))
    return float((np.abs(here - there).max(axis=(1, 2)) / np.abs(here).max(axis=(1, 2))).max())


@pytest.mark.slow
def test_the_start_of_a_cycle_is_as_accurate_as_the_rest():
    """The jerk jumps where the arm starts; a polynomial of the elements after it would be extrapolated to the start."""
    coarse, fine = (
        computed(scene_from_text(f"{RISE_AND_RETURN}accuracy = {accuracy}"), Request()) for accuracy in (0.005, 3e-4)
    )
    moments = [sample(results.deflection, "M", np.zeros(1))[0, :, 0] for results in (coarse, fine)]
    off = abs(moments[0][0] - moments[1][0]) / np.abs(moments[1]).max()
    assert off < coarse.answer.courses["M"] < 2e-4


def test_more_steps_measure_the_error_of_the_first_steps_to_the_exact_answer():
    """Six times the last change, the bound, would be more than a tenth of the requested accuracy."""
    found, fine = (results_at(SLOW, run).answer for run in ('accuracy = "0.2 %"', f'theory = "{GEOMETRICALLY_EXACT}"'))
    assert found.theory == GEOMETRICALLY_EXACT
    for name in ("u", "w", "M"):
        assert _apart(fine, found, name) < found.courses[name] < 1.5e-4


def test_a_negligible_discretization_error_of_an_exact_answer_is_not_measured(monkeypatch):
    """At 5 %, two more steps measure the error, because the first of them changes deflections by half of the last."""
    scene = read_scene(shipped_scenes()["steel_four_bar"])
    fine = computed(scene, Request(theory=GEOMETRICALLY_EXACT)).answer
    monkeypatch.setattr(exact_errors, "finer_solution", None)
    found = computed(scene, Request(accuracy=0.05)).answer
    assert found.theory == GEOMETRICALLY_EXACT
    for name in ("w", "N", "M"):
        assert 0.8 * _apart(fine, found, name) < found.courses[name] < 2 * _apart(fine, found, name)


@pytest.mark.parametrize(("last_change", "expected"), [(1e-2, {LARGE: 5e-3}), (5e-3, {})])
def test_an_exact_answer_whose_iteration_stalled_also_has_the_last_change_of_its_finer_answer(
    monkeypatch, last_change, expected
):
    """The last change in the iteration of the answer is four times or twice its tolerance."""
    iterate = SimpleNamespace(worst=1.4e-2, convergence_error=last_change, finer_tolerance=lambda tolerance: tolerance)
    exact = SimpleNamespace(discretization_error=0.0, exact=iterate)
    monkeypatch.setattr(exact_errors, "large_displacement_error", lambda _: last_change)
    monkeypatch.setattr(exact_errors, "finer_solution", lambda *_: ("finer answer", 5e-3))
    measured, shares = exact_errors.errors_of_exact(exact, 2.5e-3, "finer vibration")
    assert measured == {TIME: "finer answer"}
    assert shares == expected


def test_an_exact_answer_that_did_not_converge_needs_no_finer_answer(monkeypatch):
    monkeypatch.setattr("kinelast.answers.theory.errors_of_exact", None)
    iterate = SimpleNamespace(worst=0.11)
    exact = SimpleNamespace(discretization_error=0.04, exact=iterate, coarser=None, elements=4, coordinates=2)
    monkeypatch.setattr(exact_errors, "large_displacement_error", lambda _: 0.11)
    theories = SimpleNamespace(_worth_measuring=lambda *_: True)
    assert _Theories._errors_of_exact(theories, exact, 0.001, 0.05, None) == ({}, {TIME: 0.01, LARGE: 0.22})


RESONANCE = """
materials.steel = {E = "210 GPa", density = 7850}
sections.bar = {shape = "rectangle", depth = "5 mm", width = "8 mm"}
points = {O = [0.0, 0.0], T = [0.3, 0.0]}
links.ground.points = ["O"]
links.bar = {points = ["O", "T"], section = "bar", material = "steel"}
drives = [{link = "bar", repeat = true, law = [
    {curve = "harmonic", duration = 0.01115, by = 0.5}, {curve = "harmonic", duration = 0.01115, by = -0.5}]}]
run = {damping_ratio = 0.002, positions = 24}
"""


@pytest.mark.slow
def test_a_resonance_is_solved_exactly_although_linear_vibration_is_far_off():
    """The bar swings almost at its natural frequency, with hardly any damping."""
    scene = scene_from_text(RESONANCE)
    linear, answer, fine = (
        computed(scene, request).answer
        for request in (Request(theory=ELASTODYNAMIC), Request(), Request(theory=GEOMETRICALLY_EXACT, accuracy=0.005))
    )
    linear_tip, tip, fine_tip = (np.abs(sample(each.deflection, "w", [1.0])).max() for each in (linear, answer, fine))
    assert linear.error > 100
    assert linear_tip > 4 * fine_tip
    assert answer.error < 0.05
    assert tip == pytest.approx(fine_tip, rel=answer.error)


def test_a_known_vibration_is_not_solved_again_at_other_positions(monkeypatch):
    scene = scene_at(SLOW, 'theory = "elastodynamic"')
    motion = scene_motion(scene)
    first, other = (
        Results(scene, scene_deflection(scene, scene.course.at(times)))
        for times in (motion.time, np.sort(np.append(motion.time, motion.time[5] + 1e-4)))
    )
    known = answer_of(first.cycle, scene.theory, first.period).vibrating
    alone = answer_of(other.cycle, scene.theory, other.period)
    monkeypatch.setattr("kinelast.answers.theory._vibrating", None)
    again = answer_of(other.cycle, scene.theory, other.period, known=known)
    assert (again.theory, again.error) == (alone.theory, alone.error)
    np.testing.assert_array_equal(sample(again.deflection, "w", [0.5]), sample(alone.deflection, "w", [0.5]))


@pytest.mark.slow
def test_an_accuracy_is_that_of_all_courses():
    """The ends of Simeon's rod approach each other by bending: twice its stretch, which is not in any graded figure."""
    scene = read_scene(shipped_scenes()["simeon_slider_crank"])
    found = computed(scene, Request(accuracy=0.05)).answer
    fine = computed(scene, Request(theory=GEOMETRICALLY_EXACT)).answer
    assert found.theory == GEOMETRICALLY_EXACT
    assert found.vibrating.exact.steps <= fine.vibrating.exact.steps
    for name in ("u", "w", "chord", "N", "M"):
        here, there = (sample(each.deflection, name, np.linspace(0, 1, 5)) for each in (found, fine))
        assert np.abs(here - there).max() < 2 * found.courses[name] * np.abs(there).max()
        assert found.courses[name] < 0.05
    assert found.accurate
    named = computed(scene, Request(accuracy=0.05, theory=ELASTODYNAMIC)).answer
    assert named.worst_course[0] == "u"
    assert named.worst_course[1] == pytest.approx(_apart(named, fine, "u"), rel=0.05)
    assert named.error < 0.05
    assert not named.accurate
    reported = theory_report(replace(computed(scene, Request()), answer=named))
    assert reported.reached is False
    assert re.fullmatch(r"1[12]\d % reached in the curve of u", reached_words(reported))


def test_the_viscous_part_of_moments_counts_where_it_is_not_small():
    """Kelvin-Voigt: M includes beta times the strain rate. The linear answer omits it and states the error."""
    scene = scene_from_text(edited(FOUR_BAR, ('"100 rad/s"', '"30 rad/s"'), ("positions = 36", "positions = 120")))
    scene = replace(scene, theory=replace(scene.theory, damping_ratio=0.1))
    linear = computed(scene, Request(accuracy=0.005, theory=ELASTODYNAMIC)).answer
    found = computed(scene, Request(accuracy=0.005)).answer
    elastic, whole = (sample(each.deflection, "M", np.linspace(0, 1, 5)) for each in (linear, found))
    orders = np.fft.fftfreq(120, 1 / 120) * 2j * math.pi / scene.run.duration
    rate = np.fft.ifft(orders[:, None] * np.fft.fft(elastic, axis=1), axis=1).real
    viscous = linear.vibrating.damping.beams[:, None, None] * rate
    share = np.abs(viscous).max(axis=(1, 2)) / np.abs(whole).max(axis=(1, 2))
    assert share.max() > 0.02
    np.testing.assert_allclose(whole, elastic + viscous, atol=0.02 * np.abs(viscous).max())
    assert linear.courses["M"] == pytest.approx(share.max(), rel=0.02)
    assert not linear.accurate
    assert found.accurate


@pytest.mark.parametrize(
    "name",
    in_tiers(
        [
            "steel_four_bar",
            "utenov_four_bar",
            "offset_slider_crank",
            "simeon_slider_crank",
            "quick_return",
            "flapping_wing",
            "drs_push_up",
        ],
        0,
        2,
    ),
)
def test_on_shipped_scenes_a_finer_accuracy_never_takes_a_lower_rung_or_a_worse_answer(name):
    scene, rungs = read_scene(shipped_scenes()[name]), (QUASI_STATIC, ELASTODYNAMIC, GEOMETRICALLY_EXACT)
    answers = [computed(scene, Request(accuracy=share)).answer for share in (0.05, 0.02, 0.005, 5e-4, 5e-5)]
    taken = [rungs.index(answer.theory) for answer in answers]
    assert taken == sorted(taken)
    off = [max(answer.courses.values()) for answer in answers]
    assert off[-1] <= 1.02 * off[0]  # intermediate errors vary with the time elements
    assert answers[0].accurate
    for answer in answers:
        share = answer.requested.accuracy
        assert answer.accurate == (answer.error <= share and max(answer.courses.values()) <= share)


class Listener(Progress):
    """Keeps the numbers of the stages by name, and the sentences."""

    def __init__(self):
        self.stages, self.sentences = {}, []

    def __call__(self, stage, done, total):
        self.stages[stage.partition(": ")[2]] = done, total

    def tell(self, sentence):
        self.sentences.append(sentence)


def test_an_accuracy_that_cannot_be_reached_costs_no_more_than_one_that_nearly_can_and_stages_are_told():
    scene, heard = read_scene(shipped_scenes()["utenov_four_bar"]), Listener()
    near, far = (computed(scene, Request(accuracy=share, positions=12), heard).answer for share in (5e-5, 1e-12))
    assert near.error > 5e-5
    assert (far.vibrating.elements, far.vibrating.coordinates) == (near.vibrating.elements, near.vibrating.coordinates)
    assert far.error == pytest.approx(near.error, rel=1e-6)
    assert (heard.stages["large displacement"], heard.stages["geometrically exact"]) == ((2, 5), (3, 5))


def test_a_long_exact_answer_is_announced_with_an_option_that_answers_sooner(monkeypatch):
    monkeypatch.setattr("kinelast.answers.theory.THEORY", replace(THEORY, long=0.0))
    heard = Listener()
    computed(read_scene(shipped_scenes()["utenov_four_bar"]), Request(theory=GEOMETRICALLY_EXACT, positions=12), heard)
    (sentence,) = heard.sentences
    assert re.fullmatch(
        r"utenov_four_bar: large displacement may take up to [\d.]+ s; .*elastodynamic.* faster", sentence
    )


@pytest.mark.slow
def test_an_accuracy_that_is_not_reached_is_told_and_ends_in_status_1(tmp_path, capsys):
    (tmp_path / "bars.toml").write_text(edited(FOUR_BAR, ("positions = 36", 'positions = 1440\naccuracy = "0.01 %"')))
    assert main([str(tmp_path / "bars.toml"), "-o", str(tmp_path / "out")]) == 1
    words = capsys.readouterr().out
    assert "geometrically-exact, 0.01 % asked, 0.12 % reached in the deflection: mostly beam theory" in words
    summary = json.loads((tmp_path / "out" / "bars" / "summary.json").read_text())
    assert summary["theory"]["reached"] is False
    assert "large displacements" not in summary["not_computed"]
    assert main([str(tmp_path / "bars.toml"), "-o", str(tmp_path / "out"), "--accuracy", "1 %"]) == 0


def test_the_theory_by_name():
    """At 100 rad/s the peaks of the steel four-bar differ by 4 % from those of small displacements."""
    found = computed(scene_at("100 rad/s"), Request(theory=GEOMETRICALLY_EXACT))
    assert found.answer.theory == GEOMETRICALLY_EXACT
    assert found.answer.vibrating.exact.steps > 1
    assert any("Large displacements are included" in finding.text for finding in findings(found))


@pytest.mark.slow
def test_large_displacement_of_gears_and_slots_by_name():
    geared = read_scene(shipped_scenes()["flapping_wing"])
    assert computed(geared, Request(theory=GEOMETRICALLY_EXACT, positions=12)).answer.by_motion < 0.01
    slotted = scene_from_text(SLOTTED)
    assert computed(slotted, Request(theory=GEOMETRICALLY_EXACT, positions=12)).answer.theory == GEOMETRICALLY_EXACT


def test_round_off_where_nothing_bends_is_no_error():
    """Simeon's rod is straight at the start, so zero fields have no digits; all figures are known to one per cent."""
    scene = read_scene(shipped_scenes()["simeon_slider_crank"])
    found = computed(scene, Request(accuracy=0.05)).answer
    assert found.quasi_static.condition.max() > 1e15
    assert found.error < 0.01
    assert max(each.error.parts["round-off"] / each.base for each in found.main_figures) < 1e-9


def test_links_that_turn_by_radians_are_not_let_vibrate():
    """A pulled bar of a thousandth of the stiffness: the linear theory would rotate sections by more than a turn."""
    soft = edited(RAISED, ("210 GPa", "210 MPa"))
    found = computed(scene_from_text(soft), Request()).answer
    assert found.theory == QUASI_STATIC
    assert "not computed for such large rotations" in found.unknown
    assert math.isnan(found.error)


def test_modes_that_cannot_be_found_leave_the_error_unknown(monkeypatch):
    def none(*_, **__):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr("elastic.elastodynamics.discretization.cycle_of", none)
    results = computed(scene_at(FAST), Request())
    assert "cannot be solved: Eigenvalues" in results.answer.unknown
    assert math.isnan(results.answer.error)
    with pytest.raises(SceneError, match="cannot be solved"):
        computed(scene_at(FAST), Request(theory=ELASTODYNAMIC))


@pytest.mark.parametrize(
    ("edits", "reported"),
    [
        ((), "strength: the yield stress of the materials is not given"),
        (
            (('shape = "rectangle"\ndepth = "6 mm"\nwidth = "10 mm"', RIGIDITIES), *[('material = "steel"', "")] * 3),
            "strength: the yield stress of the materials and the dimensions of the sections are not given",
        ),
    ],
)
def test_what_strength_lacks_is_named(edits, reported):
    results = computed(scene_from_text(edited(FOUR_BAR, *edits)), Request(theory=QUASI_STATIC))
    (text,) = (finding.text for finding in findings(results) if finding.heading == "Not judged")
    assert text.startswith(reported[0].upper() + reported[1:] + ";")


def test_vibration_is_asked_for_by_name():
    results = results_at(SLOW, 'theory = "elastodynamic"')
    assert results.vibrates
    plain, found = (sample(bent, "chord", [0.5]) for bent in (results.quasi_static, results.deflection))
    apart = np.abs(found - plain).max() / np.abs(plain).max()
    assert 0 < apart <= 1.5 * results.answer.missed


def test_where_vibration_cannot_be_answered_that_is_said():
    """A parallelogram passes its flat position: the error is unknown, and a theory by name fails."""
    flat = edited(PARALLELOGRAM_BARS, ("positions = 8", 'positions = 8\naccuracy = "5 %"'))
    found = computed(scene_from_text(flat), Request())
    assert (found.answer.theory, found.answer.accurate) == (QUASI_STATIC, False)
    assert any("vibration cannot be solved" in finding.text for finding in findings(found))
    with pytest.raises(SceneError, match="vibration cannot be solved"):
        computed(scene_from_text(flat), Request(theory=ELASTODYNAMIC))


def test_the_command_goes_before_the_scene():
    scene = scene_at(FAST, 'theory = "elastodynamic"')
    assert computed(scene, Request(theory=QUASI_STATIC)).answer is None
    assert computed(scene, Request(accuracy=0.9)).answer.theory == QUASI_STATIC


def test_damping_of_a_material_is_taken():
    text = edited(FOUR_BAR, ("density = 7850", 'density = 7850\ndamping = "55 us"'),
                  ("positions = 36", 'positions = 36\ntheory = "elastodynamic"'))  # fmt: skip
    found = computed(scene_from_text(text), Request()).answer.vibrating
    np.testing.assert_allclose(found.damping.beams, 55e-6)


def test_a_damping_ratio_is_that_of_the_lowest_frequency():
    given = [results_at(FAST, f'theory = "elastodynamic"\ndamping_ratio = {ratio}').answer for ratio in (0.01, 0.03)]
    betas = [found.vibrating.damping.beams for found in given]
    np.testing.assert_allclose(betas[0], 2 * 0.01 / given[0].vibrating.lowest)
    np.testing.assert_allclose(betas[1], 3 * betas[0])


@pytest.mark.parametrize(
    ("run", "key", "words"),
    [
        ('theory = "elastodynamic"\naccuracy = 0.1', "accuracy", "chooses the theory"),
        ('accuracy = "two"', "accuracy", '"2 %"'),
        ('accuracy = "200 %"', "accuracy", '"2 %"'),
        ("damping_ratio = 1.5", "damping_ratio", "< 1"),
        ('theory = "dynamic"', "theory", "elastodynamic"),
    ],
)
def test_mistakes_are_told(run, key, words):
    with pytest.raises(SceneError) as caught:
        scene_at(FAST, run)
    assert (caught.value.table, caught.value.key) == ("run", key)
    assert words in str(caught.value)


class TestFurtherChecks:
    @pytest.mark.slow
    def test_the_nonlinear_check_tells_a_wrong_answer_from_a_right_one(self):
        """An answer without vibration that claims to include it fails the check."""
        right = results_at(FAST, 'theory = "elastodynamic"')
        wrong = replace(right, deflection=right.quasi_static)
        assert nonlinear_check(right).passed is True
        found = nonlinear_check(wrong)
        assert found.passed is False
        assert found.largest == max(found.without_vibration.values()) > 3 * found.estimate

    @pytest.mark.slow
    def test_an_answer_that_is_not_as_near_as_it_says_is_told_by_less_than_beam_theory(self):
        """The check uses the same beams, so their neglected effects cannot explain a difference."""
        stubby = edited(FOUR_BAR, ('"100 rad/s"', f'"{FAST}"'), ('depth = "6 mm"', 'depth = "40 mm"'))
        right = computed(scene_from_text(stubby), Request(theory=ELASTODYNAMIC))
        assert right.answer.error > 0.02 > 10 * right.answer.by_motion
        stiff = [replace(own, EI=1.05 * own.EI) for own in right.scene.sections]
        found = nonlinear_check(replace(right, deflection=deflection(right.motion, stiff)))
        assert found.passed is False

    @pytest.mark.slow
    def test_it_puts_the_error_that_it_measures_in_place_of_the_estimate(self):
        """A quasi-static answer: the difference from the exact answer, which the check does not know."""
        limited = edited(FOUR_BAR, ('"100 rad/s"', f'"{FAST}"')) + '[limits]\nchord = "5 mm"\n'
        results = computed(scene_from_text(limited), Request(theory=QUASI_STATIC, positions=48))
        measured = replace(results, nonlinear=nonlinear_check(results))
        exact = computed(results.scene, Request(theory=GEOMETRICALLY_EXACT)).figures.peaks
        compared = 0
        for key in ("deflection", "chord", "displacement"):
            for item, peak in enumerate(measured.figures.peaks[key]):
                off = abs(abs(peak.value) - abs(exact[key][item].value))
                if off > 0.02 * abs(peak.value):
                    assert {MEASURED} <= set(peak.error.parts) <= {MEASURED, *NOT_OF_MOTION}
                    own = measured.nonlinear.measured.own[key][item]
                    assert 0.9 * off < peak.error.parts[MEASURED] < 1.1 * off + 2 * own, (key, item)
                    compared += 1
        assert compared > 4
        assert measured.figures.peaks["stress"] == results.figures.peaks["stress"]
        assert measured.worst in measured.main_figures

    @pytest.mark.slow
    def test_it_takes_a_course_that_is_no_cycle(self):
        """Vibration starts from the quasi-static deflection, and both programs march in time."""
        found = nonlinear_check(results_at("30 rad/s", 'duration = "50 ms"\ntheory = "elastodynamic"'))
        assert found.passed is True
        assert found.largest < 0.01 < min(found.without_vibration.values())

    @pytest.mark.parametrize(("largest", "passed"), [(0.055, True), (0.0605, None), (0.07, False)])
    def test_its_own_error_is_in_its_verdict(self, largest, passed):
        """Twice 3 % are allowed, and the check knows its own error to 0.1 %."""
        found = NonlinearCheck(4, 48, 360, {"bar": largest}, {"bar": largest}, {"bar": 1e-3}, 0.03, 8e-4, 2e-4)
        assert (found.passed, found.near) == (passed, passed is None)
        reported = nonlinear_report(found)
        assert reported.too_close_to_decide is (passed is None)
        (line,) = further_checks(reported, None)
        assert line.endswith(("6 % apart, error of the check up to 0.1 %)") if passed is None else " % apart)")

    def test_a_solid_check_far_apart_says_in_what_and_that_the_errors_count_it(self):
        (near,) = further_checks(None, FurtherCheck(largest=0.02, links={"rod": 0.02, "crank": 0.01}))
        assert near == "solid check (deflection from chord of rod 2 % apart)"
        (far,) = further_checks(None, FurtherCheck(largest=0.71, links={"rod": 0.02, "crank": 0.71}))
        assert far.startswith("solid check (deflection from chord of crank 71 % apart: beam theory does not fit, and")

    @pytest.mark.parametrize(("estimate", "reported"), [(0.9, "agrees"), (3.9, "cannot tell")])
    def test_a_stated_error_larger_than_the_answer_agrees_with_nothing(self, estimate, reported):
        found = NonlinearCheck(4, 48, 360, {"bar": 0.8}, {"bar": 0.8}, {"bar": 1e-3}, estimate, 8e-4, 2e-4)
        assert found.passed is (True if reported == "agrees" else None)
        (line,) = further_checks(nonlinear_report(found), None)
        assert line.startswith(f"nonlinear check {reported}")

    def test_a_check_that_cannot_be_made_is_a_line_in_a_report(self, tmp_path, capsys):
        """The report exists, gives the reason, and the exit status is not that of a passed check."""
        rubbing = edited(FOUR_BAR, ('"100 rad/s"', '"30 rad/s"')) + '[joints.A]\nfriction = 0.1\nradius = "5 mm"\n'
        (tmp_path / "bars.toml").write_text(rubbing)
        assert main([str(tmp_path / "bars.toml"), "-o", str(tmp_path), "--check", "nonlinear"]) == 1
        assert 'nonlinear check CANNOT BE MADE: Coulomb friction at "A"' in capsys.readouterr().out
        by_vibration = FigureError({VIBRATION: 1.0})
        advice = [nearer(computed(scene_from_text(text), Request(positions=12)), by_vibration, 1.0, 3.0)
                  for text in (rubbing, FOUR_BAR)]  # fmt: skip
        assert ["--check nonlinear" in each for each in advice] == [False, True]
        reported = json.loads((tmp_path / "bars" / "summary.json").read_text())["nonlinear_check"]
        assert (reported["passed"], reported["largest"]) == (None, None)
        assert "friction" in reported["problem"]
        assert "Coulomb friction" in (tmp_path / "bars" / "report.html").read_text()

    def test_plane_bodies_tell_what_beam_theory_leaves_out(self):
        found = solid_check(results_at(FAST))
        assert 1e-4 < found.relative < 0.01

    def test_plane_bodies_of_tubes_cannot_be_made_and_are_not_advised(self, tmp_path, capsys):
        tubes = edited(
            FOUR_BAR,
            ('shape = "rectangle"', 'shape = "tube"'),
            ('depth = "6 mm"', 'outer = "40 mm"'),
            ('width = "10 mm"', 'wall = "2 mm"'),
        )
        by_beams = FigureError({BEAM_THEORY: 1.0})
        hollow, full = (computed(scene_from_text(text), Request(positions=12)) for text in (tubes, FOUR_BAR))
        assert (nearer(hollow, by_beams, 1.0, 0.1), nearer(full, by_beams, 1.0, 0.1)) == (
            "",
            "mostly beam theory: --check solid would measure it",
        )
        measure = "Run with --check solid to measure the error of beam theory"
        assert [exceedance_advice(each, "slenderness", 0) for each in (hollow, full)] == ["", measure]
        (tmp_path / "bars.toml").write_text(tubes)
        assert main([str(tmp_path / "bars.toml"), "-o", str(tmp_path), "--check", "solid"]) == 1
        assert "solid check CANNOT BE MADE: crank: a beam is hollow" in capsys.readouterr().out

    @pytest.mark.slow
    def test_plane_bodies_are_of_the_material_that_the_scene_tells(self):
        """Poisson's ratio 0.45 instead of 0.3 makes shear softer by 1.45/1.3; no other part uses it."""
        given, other = (
            solid_check(computed(scene_from_text(edited(FOUR_BAR, ("poisson = 0.3", f"poisson = {ratio}"))), Request()))
            for ratio in (0.3, 0.45)
        )
        assert other.relative > 1.02 * given.relative

    @pytest.mark.slow
    def test_the_command_writes_them(self, tmp_path, capsys):
        (tmp_path / "bars.toml").write_text(edited(FOUR_BAR, ('"100 rad/s"', '"30 rad/s"')))
        call = [str(tmp_path / "bars.toml"), "-o", str(tmp_path), "--accuracy", "10 %", "--check", "8,nonlinear,solid"]
        assert main(call) == 0
        said = capsys.readouterr().out
        words = "± ", "quasi-static", "nonlinear check agrees (", "solid check (", "check agrees"
        assert all(word in said for word in words)
        found = json.loads((tmp_path / "bars" / "check.json").read_text())
        assert found["passed"]
        assert found["nonlinear_check"]["passed"]
        assert set(found["solid_check"]["links"]) == {"crank", "coupler", "rocker"}
        assert "without" not in said
        assert " measured (" in said
        reported = json.loads((tmp_path / "bars" / "summary.json").read_text())
        assert reported["largest_deflection"]["error_measured"]
        assert "error_measured" not in reported["largest_stress"]  # no check measures it
        stiff = edited(FOUR_BAR, ('points = ["O", "A"]', 'points = ["O", "A"]\nrigid = true'))
        (tmp_path / "bars.toml").write_text(stiff)
        assert main([str(tmp_path / "bars.toml"), "-o", str(tmp_path), "--check", "solid"]) == 0
        assert " apart, without crank)" in capsys.readouterr().out


class TestSpeeds:
    @pytest.mark.slow
    def test_limits_hold_up_to_a_speed(self):
        """Between the speeds at which single runs keep and break the limit."""
        scene = scene_from_text(FOUR_BAR + '[limits]\nchord = "0.3 mm"\n')
        found = speeds(scene, (20.0, 90.0, 8))
        assert found.highest is not None
        values = found.map.values[:, 1].max(axis=1)
        below = int(np.flatnonzero(found.speed == found.highest)[0])
        assert values[below] <= 0.3e-3 < 1.005 * values[below + 1]  # by its error the next speed is too close to decide

    @pytest.mark.slow
    def test_a_speed_is_that_of_a_run_of_its_own(self):
        found = speeds(scene_at(FAST), (30.0, 60.0, 2))
        for k, speed in enumerate(("30 rad/s", FAST)):
            own = results_at(speed, 'theory = "elastodynamic"')
            largest = np.abs(own.cycle.extremes["chord"].value).max(axis=-1)
            np.testing.assert_allclose(found.map.values[k, 1], largest, rtol=0.01)

    @pytest.mark.slow
    def test_the_command_writes_them(self, tmp_path):
        (tmp_path / "bars.toml").write_text(FOUR_BAR)
        assert main([str(tmp_path / "bars.toml"), "-o", str(tmp_path), "--speeds", "20:40:3", "--quiet"]) == 0
        with (tmp_path / "bars" / "speeds.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert [float(row["speed [rad/s]"]) for row in rows] == [20.0, 30.0, 40.0]
        assert all(math.isfinite(float(row["rocker.chord [m]"])) for row in rows)
        assert all(0 < float(row["error [1]"]) < 4e-3 for row in rows)
        assert "<svg" in (tmp_path / "bars" / "speeds.svg").read_text()

    def test_it_takes_steady_drives(self):
        scene = read_scene(shipped_scenes()["drs_push_up"])
        with pytest.raises(SceneError, match="--speeds scales drives at constant speed"):
            speeds(scene, (1.0, 2.0, 2))

    @pytest.mark.parametrize("words", ["20:40", "40:20:3", "20 mm:40 mm:3", "20:40:1", "0:40:3"])
    def test_what_is_no_range_is_told(self, words, capsys):
        assert main(["steel_four_bar", "--speeds", words]) == 2
        assert "20 rad/s : 200 rad/s : 100" in capsys.readouterr().err


PRESSED = """
sections.thin = {shape = "rigidities", EA = "1 MN", EI = "2 N m^2", mass_per_length = "0.1 kg/m"}
points = {O = [0.0, 0.0], A = [0.05, 0.0], B = [0.15, 0.0], C = [0.25, 0.0], D = [0.35, 0.0], E = [0.45, 0.0]}
links.ground.points = ["O"]
links.crank = {points = ["O", "A"], rigid = true, mass = "0.1 kg", center = "O"}
links.piston = {points = ["E"], rigid = true, mass = "0.1 kg"}
sliders.cylinder = {link = "piston", on = "ground", through = "E", direction = [1.0, 0.0]}
[links.rod]
points = {points}
section = "thin"
{beams}
[[drives]]
link = "crank"
speed = "1 rad/s"
[[loads]]
link = "piston"
point = "E"
force = ["-{force} N", "0 N"]
[run]
positions = 24
"""
WHOLE = ('["A", "E"]', "")
DIVIDED = ('["A", "B", "C", "D", "E"]', 'beams = [["A", "B"], ["B", "C"], ["C", "D"], ["D", "E"]]')
BENT = PRESSED.replace("C = [0.25, 0.0]", "C = [0.25, 0.003]")  # not a straight link


@pytest.mark.parametrize(("points", "beams"), [WHOLE, DIVIDED], ids=["one beam", "four beams"])
@pytest.mark.parametrize(("force", "level"), in_tiers([(5, None), (30, False), (100, True)], 2, 4))
def test_a_rod_buckles_however_it_is_divided(points, beams, force, level):
    """Euler: pi^2 EI/l^2 = 123 N; the loads are below a tenth of it, a quarter, and more than half."""
    text = PRESSED.replace("{points}", points).replace("{beams}", beams).replace("{force}", str(force))
    found = [one for one, _ in computed(scene_from_text(text), Request()).exceedances if one.kind == "buckling"]
    assert {one.severe for one in found} == (set() if level is None else {level})
    if found:
        assert found[0].figure == pytest.approx(force / (np.pi**2 * 2 / 0.4**2), rel=0.03)


def test_a_buckling_load_that_cannot_be_found_is_told(monkeypatch):
    """The finding is neither good nor bad."""

    def none(*_):
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr(buckling.BucklingModes, "of_links", none)
    text = BENT.replace("{points}", DIVIDED[0]).replace("{beams}", DIVIDED[1]).replace("{force}", "5")
    results = computed(scene_from_text(text), Request())
    (reported,) = (finding for finding in findings(results) if finding.heading == "Not judged")
    assert reported.level == "open"
    assert "the load at which the mechanism buckles cannot be found" in reported.text
    assert "Euler's load" not in " ".join(finding.text for finding in findings(results) if finding.level == "good")
    assert [one["figure"] for one in exceedance_rows(Reader(results))] == [None]


def test_a_divided_rod_buckles_in_a_long_run_too(tmp_path, monkeypatch):
    """A chunked run checks the whole mechanism at the positions of largest compression."""
    monkeypatch.setattr("kinelast.runs.LONG", 1)
    text = BENT.replace("{points}", DIVIDED[0]).replace("{beams}", DIVIDED[1]).replace("{force}", "100")
    (tmp_path / "rod.toml").write_text(text)
    main([str(tmp_path / "rod.toml"), "--quiet", "-o", str(tmp_path / "out")])
    summary = json.loads((tmp_path / "out" / "rod" / "summary.json").read_text())
    found = [one for one in summary["cautions"] if one["kind"] == "buckling"]
    assert {one["level"] for one in found} == {"caution"}
    assert found[0]["figure"] == pytest.approx(100 / (np.pi**2 * 2 / 0.4**2), rel=0.03)
    assert summary["theory"]["name"] == "elastodynamic"
    assert summary["theory"]["without_vibration"] is not None


@pytest.mark.parametrize(("force", "level"), in_tiers([(30, "good"), (100, "caution")], 1, 1))
def test_what_the_told_error_has_is_no_doubt_of_its_own(force, level):
    """The error covers a quarter of Euler's load; four fifths of it cause a caution with advice."""
    text = PRESSED.replace("{points}", WHOLE[0]).replace("{beams}", WHOLE[1]).replace("{force}", str(force))
    results = computed(scene_from_text(text), Request())
    (reported,) = (finding for finding in findings(results) if finding.heading == "Buckling")
    assert reported.level == level
    assert ("Make it thicker or shorter." in reported.text) == (level == "caution")


@pytest.mark.parametrize(
    ("parts", "accuracy", "enough"),
    [
        ({TIME: 0.04, BEAM_THEORY: 0.005}, None, True),
        ({TIME: 0.04, BEAM_THEORY: 0.02}, None, False),
        ({TIME: 0.04, BEAM_THEORY: 0.5}, None, True),
        ({TIME: 0.06, BEAM_THEORY: 0.5}, None, False),
        ({TIME: 0.04, BEAM_THEORY: 0.5}, 0.05, False),
        ({TIME: 0.004, BEAM_THEORY: 0.5}, 0.05, True),  # negligible
        ({TIME: 0.04, BETWEEN: 0.02}, None, False),
        ({TIME: 0.04, BETWEEN: 0.5}, None, True),  # becomes small at the instants of `missed_peaks`
        ({TIME: 0.04, BETWEEN: 0.5}, 0.05, True),
    ],
)
def test_a_theory_is_accurate_enough_if_no_other_reduces_the_error(parts, accuracy, enough):
    assert answer_with(parts, accuracy).enough == enough


@pytest.mark.parametrize(("large", "helps"), [(0.001, True), (0.2, False)])
def test_a_finer_vibration_helps_only_if_other_errors_are_small(large, helps):
    answer = answer_with({TIME: 0.2, LARGE: large})
    assert not answer.enough
    assert answer.enough_if_resolved == helps


def test_large_displacement_of_a_well_resolved_vibration_needs_no_finer_vibration(monkeypatch):
    """The main figures reach 5 % without it, the time histories do not. Both theories share the same vibration."""
    monkeypatch.setattr("kinelast.answers.theory.finer_vibration", None)
    monkeypatch.setattr("kinelast.answers.theory._Theories._resolved", None)
    shared = []
    monkeypatch.setattr("kinelast.answers.builder.including", lambda *given: shared.append(given) or including(*given))
    answer = computed(read_scene(shipped_scenes()["steel_four_bar"]), Request()).answer
    assert answer.theory == GEOMETRICALLY_EXACT
    assert len(shared) == 1


def answer_with(parts, accuracy=None):
    """Return an answer with one main figure, which has a value of 1 and errors `parts` by cause."""
    figures = [MainFigure("deflection", 0, 1.0, 1.0, FigureError(parts))]
    answer = Answer("", Theory(accuracy=accuracy), None, None, None, {}, [], Estimate({}, None, {}), figures, 0.0, True)
    vars(answer)["courses"] = {}
    return answer


@pytest.mark.slow
def test_peaks_between_the_positions_do_not_lead_to_large_displacement(monkeypatch):
    """The press rings between its positions. Large displacement changes its deflection by less than 0.1 %."""
    monkeypatch.setattr("kinelast.answers.theory.geometrically_exact", None)
    answer = computed(read_scene(DATA / "vibrating_press.toml"), Request()).answer
    assert answer.theory == ELASTODYNAMIC
    assert answer.error < 0.05


ROCKER = """
materials.steel = {E = "210 GPa", density = 7850}
sections.bar = {shape = "rectangle", depth = "5.8 mm", width = "8 mm"}
points = {O = [0.0, 0.0], R = [0.073, 0.0], T = [-0.07, 0.007]}
links.ground.points = ["O"]
links.rocker = {points = ["R", "O", "T"], section = "bar", material = "steel", beams = [["O", "R"], ["O", "T"]]}
drives = [{link = "rocker", repeat = true, law = [
    {curve = "constant-acceleration", duration = 0.22, by = 0.36}, {curve = "dwell", duration = 0.052},
    {curve = "constant-acceleration", duration = 0.22, by = -0.36}, {curve = "dwell", duration = 0.052}]}]
run = {damping_ratio = 0.019, positions = 22}
"""


def assert_within_errors(fine, answer):
    figures = {each.key: each for each in answer.main_figures}
    for each in fine.main_figures:
        assert each.value == pytest.approx(figures[each.key].value, abs=figures[each.key].error.size)


@pytest.mark.slow
def test_errors_of_many_short_time_elements_are_measured_if_that_is_quick(monkeypatch):
    """The estimate from the series of the time elements is ten times too high, because the acceleration jumps."""
    monkeypatch.setattr("kinelast.answers.theory.geometrically_exact", None)
    scene = scene_from_text(ROCKER)
    answer, fine = (computed(scene, Request(theory=name)).answer for name in (None, ELASTODYNAMIC))
    assert answer.theory == ELASTODYNAMIC
    assert answer.vibrating.elements > VIBRATION_SETTINGS.max_halved
    figures = {each.key: each for each in answer.main_figures}
    estimated = answer.vibrating.force_error * figures["stress"].value
    assert abs(figures["stress"].error.parts[TIME]) < 0.1 * estimated
    assert_within_errors(fine, answer)


@pytest.mark.slow
def test_a_too_coarse_vibration_is_solved_finer_and_not_with_large_displacement(monkeypatch):
    monkeypatch.setattr("kinelast.answers.theory.geometrically_exact", None)
    scene = read_scene(DATA / "slow_six_bar.toml")
    answer, fine = (computed(scene, Request(theory=name)).answer for name in (None, ELASTODYNAMIC))
    assert (answer.theory, answer.vibrating.elements) == (ELASTODYNAMIC, 642)  # twice the 321 of the first vibration
    assert answer.enough
    assert_within_errors(fine, answer)
