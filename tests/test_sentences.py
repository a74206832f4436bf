"""Tables and sentences of a report agree with the figures of the report."""

from pathlib import Path

import numpy as np
import pytest

import kinelast
from elastic import displacement_of, sample
from elastic.assessment import harmonics
from elastic.vibration import natural_frequencies
from kinelast.figures.cycle import Cycle
from kinelast.figures.doubted import large_errors
from kinelast.figures.errors import BEAM_THEORY, BODIES, VIBRATION, FigureError
from kinelast.figures.measured import with_bodies
from kinelast.figures.peaks import run_figures
from kinelast.figures.report import UnreliableFigure
from kinelast.figures.summary import report_of
from kinelast.outputs.words import headline, least_safety, trust_words
from kinelast.runs import computed
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes
from rigid import position_of
from tests.scene_texts import SLIDER_CRANK

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"


@pytest.fixture(scope="module")
def press():
    """Return the results of a press that vibrates, with limits on safety, buckling and output."""
    return computed(kinelast.load(GALLERY / "toggle_press.toml"), Request())


def report_on(text):
    """Return the report on a scene."""
    return report_of(computed(scene_from_text(text), Request()))


@pytest.mark.parametrize(
    ("limits", "kind", "mode"),
    [
        ("safety = 1e4", "safety", "safety limit"),
        ("buckling = 1e-4", "buckling", "buckling limit"),
        ('output = "1 nm"', "output", "output"),
        ('output = "1 nm"\nsafety = 1e2', "output", "output"),
        ('deflection = "1 nm"\nlinks.rod.deflection = "0.1 nm"', "deflection", "deflection"),
    ],
)
def test_a_limit_that_is_not_kept_breaks_first(limits, kind, mode):
    steel = SLIDER_CRANK.replace("density = 7850", "density = 7850\nyield = 250e6")
    report = report_on(f"{steel}\n[limits]\n{limits}\n")
    broken = max((row for row in report.acceptance.limits if row.kind == kind), key=lambda row: row.used)
    assert broken.outcome == "not kept"
    first = report.breaks_first[0]
    assert first.governs == mode
    assert first.reserve.value == pytest.approx(1.0 / broken.used)
    assert first.reserve.error / first.reserve.value == pytest.approx(broken.found.error / broken.found.value)


def test_a_reserve_is_as_reliable_as_its_figure():
    """Load ratios of wings are far below 1 % and have large relative errors, which nobody needs to know better."""
    report = report_of(computed(kinelast.load("flapping_wing"), Request()))
    assert not report.reliability.unreliable
    reserves = [reserve for row in report.breaks_first for reserve in row.reserves.values()]
    assert any(reserve.error > 0.25 * reserve.value for reserve in reserves)
    assert not any(reserve.unreliable for reserve in reserves)


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
    for key in ("deflection", "stress", "safety", "output_error"):
        sizes, before = ([abs(peak.value) for peak in peaks[key]] for peaks in (press.figures.peaks, without))
        item = np.argmin(sizes) if key == "safety" else np.argmax(sizes)
        change[key] = abs(1.0 - before[item] / sizes[item])
    assert change.pop("safety") > 0.8
    assert press.answer.missed == pytest.approx(max(change.values()), rel=0.01)
    assert press.answer.missed < 0.5


@pytest.mark.parametrize("most", [None, 2])
def test_unreliable_figures_have_the_same_words_in_full_and_in_brief(most):
    rows = [UnreliableFigure("shear force", name, share) for name, share in (("a", None), ("b", 0.4), ("c", 0.3))]
    rows.append(UnreliableFigure("force on the ground", None, 0.5))
    full = ["shear force of a (error larger than the value), b (± 40 %), c (± 30 %)", "force on the ground (± 50 %)"]
    brief = ["shear force of a, b, 1 more (error larger than the value)", "force on the ground (± 50 %)"]
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
    report = report_on(f'{text}\n[limits.figures]\nfrequency = {{least = "{2 * np.pi * 32.8} rad/s"}}\n')
    (limit,) = (row for row in report.acceptance.limits if row.kind == "frequency")
    assert limit.outcome == "not kept"


def test_harmonics_of_axial_forces_are_among_those_that_strain_the_links():
    """The work of a press comes at the end of its stroke as a thrust along the toggles, whose harmonics are many."""
    text = (GALLERY / "toggle_press.toml").read_text().replace("[run]", '[run]\ntheory = "quasi-static"')
    results = computed(scene_from_text(text), Request())
    bending = harmonics(results.deflection, results.period).strong()[-1]
    strained = report_of(results).vibration["load"]["harmonic"]
    axial = sample(results.deflection, "N", [0.5])[results.scene.labels.index("upper"), :, 0]
    sizes = np.abs(np.fft.rfft(axial)) * np.where(np.arange(len(axial) // 2 + 1), np.sqrt(2), 1)
    own = np.flatnonzero(sizes > 0.05 * np.sqrt((sizes**2).sum()))[-1]
    assert bending < own
    assert abs(strained - own) <= 2


def test_the_parts_of_a_straight_bar_have_the_name_of_the_bar_in_sentences_and_tables():
    """The stick of an excavator is straight from T to X; a pin at V divides it."""
    report = report_of(computed(kinelast.load(GALLERY / "excavator_arm.toml"), Request(theory="quasi-static")))
    bar = report.largest_deflection.member
    names = [row["name"] for row in report.links if row["member"] == bar]
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
