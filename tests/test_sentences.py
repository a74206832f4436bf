"""Tables and sentences of a report agree with the figures of the report."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from tiers import in_tiers

import kinelast
from elastic import displacement_of, sample
from elastic.assessment import harmonics
from elastic.vibration import natural_frequencies
from kinelast.answers.builder import AnswerBuilder
from kinelast.figures.cycle import Cycle
from kinelast.figures.figure_error import BEAM_THEORY, BODIES, VIBRATION, FigureError
from kinelast.figures.measured import with_bodies
from kinelast.figures.peaks import run_figures
from kinelast.outputs.words import checked, headline, least_safety, trust_words
from kinelast.reports.doubted import large_errors
from kinelast.reports.report import UnreliableFigure
from kinelast.reports.summary import report_of
from kinelast.reports.trust import HEADINGS
from kinelast.runs import computed
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes
from rigid import position_of
from tests.scene_texts import RISE_AND_RETURN, SLIDER_CRANK

DATA = Path(__file__).parent / "data"
GALLERY = Path(__file__).parents[1] / "docs" / "gallery"


@pytest.fixture(scope="module")
def press():
    """Return the results of a press that vibrates, with limits on safety, buckling and output."""
    return computed(kinelast.load(DATA / "vibrating_press.toml"), Request())


@pytest.fixture(scope="module")
def excavator():
    """Return the report on the excavator arm."""
    return report_of(computed(kinelast.load(GALLERY / "excavator_arm.toml"), Request()))


def report_on(text):
    """Return the report on a scene."""
    return report_of(computed(scene_from_text(text), Request()))


@pytest.mark.parametrize(
    ("limits", "kind", "item"),
    [
        ("safety = 1e4", "safety", "link rod"),
        ("buckling = 1e-4", "buckling", "link rod"),
        ('output = "1 nm"', "output", "output B"),
        ('output = "1 nm"\nsafety = 1e2', "output", "output B"),
        ('deflection = "1 nm"\nlinks.rod.deflection = "0.1 nm"', "deflection", "link rod"),
        ('figures."joint_force.A" = "1 mN"', "joint_force", "joint A"),
        ('figures."drive_power.crank" = "1 nW"', "drive_power", "drive crank"),
        ('figures.shaking_force = "1 mN"', "shaking_force", "machine "),
        ('figures.frequency = { least = "1e9 rad/s" }', "frequency", "machine "),
    ],
)
def test_a_limit_that_is_not_kept_breaks_first(limits, kind, item):
    steel = SLIDER_CRANK.replace("density = 7850", "density = 7850\nyield = 250e6")
    report = report_on(f"{steel}\n[limits]\n{limits}\n")
    broken = max((row for row in report.acceptance.limits if row.kind == kind), key=lambda row: row.used)
    assert broken.outcome == "not kept"
    first = report.breaks_first[0]
    assert (first.mode, f"{first.kind} {first.item}") == ("limit", item)
    assert first.reserve.value == pytest.approx(1.0 / broken.used)
    assert first.reserve.error / first.reserve.value == pytest.approx(broken.found.error / broken.found.value)


def test_a_reserve_is_as_reliable_as_its_figure():
    """Load ratios of wings are far below 1 % and have large relative errors, which nobody needs to know better."""
    results = computed(kinelast.load("flapping_wing"), Request())
    report = report_of(results)
    assert not report.reliability.unreliable
    peaks = [peak for peaks in results.figures.peaks.values() for peak in peaks if math.isfinite(peak.error_size)]
    peaks = [peak for peak in peaks if abs(peak.value) > 1e-15]  # zero is not near zero
    large = sum(peak.error_size > max(0.25 * abs(peak.value), 1e-12) for peak in peaks)  # 1e-12 is round-off
    words = f"; errors above 25 % in {large} figures near zero"
    assert trust_words(report)[0] == f"all figures are reliable{words}"
    cautious = replace(report, reliability=replace(report.reliability, level="caution", reasons=["cycle"]))
    assert trust_words(cautious)[0] == f"use with caution: cycle{words}"
    reserves = [row.reserve for row in report.breaks_first]
    assert any(reserve.error > 0.25 * reserve.value for reserve in reserves)
    assert not any(reserve.unreliable for reserve in reserves)


def test_a_curve_with_a_large_error_is_not_called_reliable():
    """The rod of Simeon's slider-crank bends, which brings its ends closer together than its stretch separates them."""
    report = report_of(computed(kinelast.load("simeon_slider_crank"), Request()))
    assert report.theory.courses["u"] == pytest.approx(1.19, abs=0.05)
    assert not report.reliability.unreliable
    assert trust_words(report) == (
        "all figures are reliable except curve of longitudinal displacement u (± 119 %)",
        "caution",
    )


def test_the_time_ratio_leaves_out_rests():
    slow = RISE_AND_RETURN.replace("duration = 0.12, by = -1.0", "duration = 0.24, by = -1.0")
    report = report_on(f'{slow}output = "arm.angle"\n')
    assert report.output.motion["time_ratio"].value == pytest.approx(2.0, rel=1e-3)


def test_a_link_close_to_its_yield_stress_is_in_the_headline():
    """The crank is stressed to 87 % of its yield stress."""
    report = report_of(computed(kinelast.load("steel_four_bar"), Request()))
    assert 2 / 3 < 1 / least_safety(report)[1].value < 1
    assert trust_words(report)[0].startswith("use with caution: strength (crank: ")
    assert "use with caution: strength (crank: " in headline(report)


def test_the_change_by_vibration_is_that_of_the_largest_deflection_stress_and_output_error(press):
    """Without vibration the safety factor of the press is nearly twice as large, and the stress half as large."""
    still = Cycle(press.scene, press.quasi_static.motion, press.quasi_static, tabled=True)
    without, change = run_figures(still, press.figures.output).peaks, {}
    for key in ("deflection", "chord", "stress", "safety", "output_error"):
        sizes, before = ([abs(peak.value) for peak in peaks[key]] for peaks in (press.figures.peaks, without))
        item = np.argmin(sizes) if key == "safety" else np.argmax(sizes)
        change[key] = abs(1.0 - before[item] / sizes[item])
    assert change.pop("safety") > 0.8
    assert press.answer.missed == pytest.approx(max(change.values()), rel=0.01)
    strength = [each for each in press.main_figures if each.key in ("stress", "safety")]
    assert len(strength) > 1
    missed = AnswerBuilder(still, press.scene.theory).change_by_vibration(press.answer.cycle, strength)
    assert missed == pytest.approx(change["stress"], rel=0.01)
    assert missed < 0.5


def test_an_exceeded_limit_of_the_theory_has_one_grade(excavator):
    """A stubby part of the stick has a known error of beam theory, larger than its deflection from the chord."""
    report = excavator
    (trusted,) = (finding for finding in report.trust if finding.heading == HEADINGS["slenderness"])
    levels = {row["level"] for row in report.cautions if row["kind"] == "slenderness"}
    assert max(row["figure"] for row in report.cautions if row["kind"] == "slenderness") > 1.0
    assert levels == {trusted.level} == {"good"}
    worst = max(report.cautions, key=lambda row: row["figure"])
    chord = report.peaks[worst["label"]]["chord"]
    assert 0.0 < chord.error < 0.7 * worst["figure"] * abs(chord.value)
    assert "include its effect at the largest deflection, which may be smaller;" in trusted.text


@pytest.mark.parametrize("name", in_tiers(["toggle_press", "pick_and_place_arm", "peaucellier", "wiper"], 3, 1))
def test_the_accuracy_covers_the_errors_of_the_first_screen(name):
    """Bending near zero is named instead."""
    report = report_of(computed(kinelast.load(GALLERY / f"{name}.toml"), Request()))
    theory, shown = report.theory, {"deflection": report.largest_deflection, "chord deflection": report.largest_chord}
    shown |= {"von Mises stress": report.largest_stress, "error of the output": report.output}
    shares = {key: each.error / abs(each.value) for key, each in shown.items()}
    larger = [key for key, share in shares.items() if share > 1.02 * theory.error]  # a peak between positions is larger
    expected = ["chord deflection"] if name in ("toggle_press", "pick_and_place_arm") else []
    assert larger == [*theory.near_zero] == expected
    assert all(abs(shown[key].value) < 0.05 * abs(report.largest_deflection.value) for key in larger)
    (finding,) = (each for each in report.trust if each.heading == "Accuracy")
    assert finding.level == ("caution" if theory.error > theory.expected else "good")
    assert all(key in finding.text and key in checked(report) for key in larger)


@pytest.mark.parametrize(("accuracy", "level"), in_tiers([(0.05, "caution"), (0.08, "good"), (None, "good")], 1, 2))
def test_the_error_of_curves_is_compared_with_a_requested_accuracy(accuracy, level):
    scene = kinelast.load(GALLERY / "klann_leg.toml")
    report = report_of(computed(scene, Request(theory="quasi-static", accuracy=accuracy)))
    (finding,) = (each for each in report.trust if each.heading == "Accuracy")
    largest = max(report.theory.courses.values())
    assert report.theory.error < 0.05 < largest < 0.08
    assert sum(report.theory.errors.values()) == pytest.approx(report.theory.error)
    printed = finding.text.partition("(vibration ")[2].partition(")")[0].replace("\N{MINUS SIGN}", "-")
    parts = [float(each) for each in re.findall(r"(-?[\d.]+) %", printed)]
    assert min(parts) < -0.1
    assert sum(parts) == pytest.approx(100 * report.theory.error, abs=0.02)
    assert "vibration and large displacement together would change the main deflections" in finding.text
    assert finding.level == level
    words = f"{100 * largest:.2g} %"
    assert (f"Largest error of the curves over the cycle: {words}" in finding.text) is (accuracy != 0.08)
    assert (f"use with caution: accuracy (curves of M ± {words})" in headline(report)) is (level == "caution")


@pytest.mark.parametrize("most", [None, 2])
def test_unreliable_figures_have_the_same_words_in_full_and_in_brief(most):
    rows = [UnreliableFigure("shear force", name, share) for name, share in (("a", None), ("b", 0.4), ("c", 0.3))]
    rows.append(UnreliableFigure("force on the ground", None, 0.5))
    full = ["shear force of a (error larger than the value), b (± 40 %), c (± 30 %)", "force on the ground (± 50 %)"]
    brief = ["shear force of a, b, 1 more (some errors larger than the value)", "force on the ground (± 50 %)"]
    assert large_errors(rows, most) == (full if most is None else brief)


def test_what_beam_theory_neglects_is_relative_to_the_deflection_from_the_chord(press):
    (finding,) = (each for each in report_of(press).trust if each.heading == "Stubby links")
    assert finding.text.startswith("crank is short and deep: beam theory neglects about 2.")
    assert "times its own largest deflection from the chord, due to" in finding.text


def test_contributions_add_up_if_the_output_error_is_largest_between_the_positions(press):
    """The press vibrates fast compared with its positions."""
    output = report_of(press).output
    assert output.between_positions
    shares = {each.link: each.value for each in output.shares}
    assert sum(shares.values()) == pytest.approx(output.value, rel=1e-9)
    assert abs(shares.pop("others", 0.0)) < 1e-3 * output.value


def test_a_soft_joint_has_its_own_contribution():
    """The gear at the elbow of an arm gives by 40e-6 rad/(N m): the tip turns about the elbow."""
    scene = kinelast.load(GALLERY / "pick_and_place_arm.toml")
    results = computed(scene, Request(theory="quasi-static"))
    output, motion = report_of(results).output, results.motion
    shares = {each.link: each.value for each in output.shares}
    assert shares.keys() == {"upper", "fore", "joint A"}
    at, fore = int(np.argmin(np.abs(motion.time - output.time.value))), scene.mechanism.index["fore"]
    elbow, tip = (position_of(motion, fore, point)[at] for point in ("A", "T"))
    joints = [joint.name for joint in motion.structure.joints]
    turned = 40e-6 * results.deflection.forces.moment[joints.index("A")][at]
    moved = displacement_of(results.deflection, "fore", "T")[at]
    along = (np.conj(moved) * 1j * turned * (tip - elbow)).real / abs(moved)
    assert shares["joint A"] == pytest.approx(abs(along), rel=1e-9)
    assert sum(shares.values()) == pytest.approx(output.value, rel=1e-9)


@pytest.mark.parametrize("name", ["quick_return", "offset_slider_crank"])
def test_the_lowest_natural_frequency_is_that_of_the_worst_position(name):
    scene = kinelast.load(name)
    results = computed(scene, Request(theory="quasi-static"))
    lowest = report_of(results).vibration["natural"][0]["lowest"]
    every = natural_frequencies(results.motion, scene.sections, 1, len(results.motion.time), scene.joints).omega[0]
    assert lowest.value == pytest.approx(every.min(), rel=1e-3)
    assert lowest.drive["crank"].value == results.motion.drive[0, every.argmin()]


def test_a_limit_on_the_lowest_natural_frequency_is_judged_at_the_worst_position():
    """The frequency of a quick return is 32.5 Hz at worst, and 33.0 Hz at the worst of 24 even positions."""
    text = shipped_scenes()["quick_return"].read_text()
    report = report_on(f'{text}\n[limits.figures]\nfrequency = {{least = "{2 * np.pi * 33.1} rad/s"}}\n')
    (limit,) = (row for row in report.acceptance.limits if row.kind == "frequency")
    assert limit.outcome == "not kept"
    assert limit.found.value == pytest.approx(2 * np.pi * 32.5, rel=3e-3)


def test_a_limit_on_the_lowest_natural_frequency_judges_the_frequency_of_the_report():
    text = shipped_scenes()["steel_four_bar"].read_text()
    report = report_on(f'{text}\n[limits.figures]\nfrequency = {{least = "500 rad/s"}}\n')
    (limit,) = (row for row in report.acceptance.limits if row.kind == "frequency")
    assert limit.found.value == report.vibration["natural"][0]["lowest"].value


@pytest.mark.slow
def test_harmonics_of_axial_forces_are_among_those_that_strain_the_links():
    """The work of a press comes at the end of its stroke as a thrust along the toggles, whose harmonics are many."""
    text = (DATA / "vibrating_press.toml").read_text().replace("[run]", '[run]\ntheory = "quasi-static"')
    results = computed(scene_from_text(text), Request())
    bending = harmonics(results.deflection, results.period).strong()[-1]
    strained = report_of(results).vibration["load"]["harmonic"]
    axial = sample(results.deflection, "N", [0.5])[results.scene.labels.index("upper"), :, 0]
    sizes = np.abs(np.fft.rfft(axial)) * np.where(np.arange(len(axial) // 2 + 1), np.sqrt(2), 1)
    own = np.flatnonzero(sizes > 0.05 * np.sqrt((sizes**2).sum()))[-1]
    assert bending < own
    assert abs(strained - own) <= 2


def test_the_parts_of_a_straight_bar_have_the_name_of_the_bar_in_sentences_and_tables(excavator):
    """The stick of an excavator is straight from T to X; a pin at V divides it."""
    bar = excavator.largest_deflection.member
    names = [row["name"] for row in excavator.links if row["member"] == bar]
    assert bar == "stick from T to X"
    assert names == [f"{bar}, T to V", f"{bar}, V to X"]


def test_the_lag_behind_a_cam_is_stated_with_the_output_error():
    """The drive of a valve follows its law exactly, so only the lag shows that the rocker bends."""
    report = report_of(computed(kinelast.load(GALLERY / "valve_train.toml"), Request(theory="quasi-static")))
    (lag,) = report.output.lags
    assert report.output.value == 0.0
    assert abs(lag.value) == pytest.approx(0.0272e-3, rel=0.01)


def test_a_check_does_not_scale_errors_by_beams_that_it_cannot_resolve():
    """The check is off by 2 um. It measures 40 um of 50 um, and cannot tell anything about 1 um."""
    stated = {"chord": [FigureError({BEAM_THEORY: size}) for size in (50e-6, 1e-6)]}
    errors = {**stated, "deflection": [FigureError({BEAM_THEORY: size}) for size in (10e-6, 30e-6)]}
    found = with_bodies(errors, [40e-6, 5e-6], [40e-6, 5e-6], 2e-6)
    assert [each.parts[BODIES] for each in found["deflection"]] == pytest.approx([8e-6, 24e-6])
    coarse = with_bodies(errors, [40e-6, 5e-6], [40e-6, 5e-6], 60e-6)
    assert coarse["deflection"] == errors["deflection"]


def test_the_change_by_vibration_includes_the_smallest_force_of_a_cam():
    """The force of a valve's cam at its least changes by more than the largest deflection."""
    results = computed(kinelast.load(GALLERY / "valve_train.toml"), Request())
    (least,) = results.figures.peaks["cam_least_force"]
    assert results.answer.missed >= 0.99 * abs(least.error.parts[VIBRATION]) / least.value
