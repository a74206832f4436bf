"""The first words of an answer, on the terminal and on the page, agree with its figures."""

import json
import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest
from browser import Page
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from msgspec.structs import replace
from tiers import in_tiers

import kinelast.scene
from kinelast.answers.refusals import yield_words
from kinelast.cli.command import main
from kinelast.figures.figure_error import BEAM_THEORY, FREQUENCIES, LARGE, TIME, FigureError
from kinelast.figures.main_figures import MainFigure
from kinelast.outputs.assumptions import assumptions
from kinelast.outputs.print_page import MARGIN, Paragraph
from kinelast.outputs.words import MAX_NAMED, error_words, verdict_words
from kinelast.reports.advice import nearer
from kinelast.reports.limits import KEPT, SEVERITY, TOO_NEAR, UNKNOWN, outcome_index
from kinelast.reports.report import Verdict, report_from
from kinelast.reports.summary import report_of
from kinelast.runs import computed
from kinelast.scene.data import GEOMETRICALLY_EXACT, Theory
from kinelast.tasks.request import Request
from kinelast.values.figure import Limit
from kinelast.values.reading import reading

CASES = Path(__file__).parent / "data" / "cases"
YIELDS = "drs_push_up"  # 8 times its yield strength, without limits
YIELDS_IN_LIMITS = "yields_in_limits"
BUCKLES, DOUBTFUL, ZERO_MEAN = "buckled_rod", "crash_coulomb_elastodynamic", "clearance_order_a"
VIBRATES, MANY_LIMITS = "quick_return", "pusher"
UNJUDGED = "unjudged"  # a limit is not kept, and another cannot be judged
GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
PARTS, PRESS, LIFT, SLOW = "jansen_leg", "vibrating_press", "scissor_lift", "five_points"


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """Return a function that writes the report on a scene at the first call, and returns its folder."""
    folder = tmp_path_factory.mktemp("words")
    text = (CASES / "strong_spring.toml").read_text()
    (folder / f"{YIELDS_IN_LIMITS}.toml").write_text(f'{text}\n[limits]\ndeflection = "10 mm"\n')
    text = (CASES / "crash_coulomb.toml").read_text().replace("[run]", '[run]\ntheory = "elastodynamic"')
    (folder / f"{DOUBTFUL}.toml").write_text(text)
    text = (GALLERY / f"{LIFT}.toml").read_text().replace("rod = 30\n", "rod = 45\n")
    (folder / f"{LIFT}.toml").write_text(text)
    text = (CASES / "bearing_overloaded.toml").read_text()
    (folder / f"{UNJUDGED}.toml").write_text(f'{text}\n[limits.figures]\nshaking_force = "1 N"\n')

    @cache
    def report(name):
        places = (place / f"{name}.toml" for place in (folder, GALLERY, CASES, CASES.parent))
        main([str(next((path for path in places if path.exists()), name)), "--quiet", "-o", str(folder)])
        return folder / name

    return report


@pytest.fixture
def shown(driver, out):
    """Open the report of a scene."""
    return lambda name: Page(driver, out(name) / "report.html")


def read(out, name):
    return json.loads((out(name) / "summary.json").read_text())


def test_a_yielding_link_comes_first(out, shown, capsys):
    assert main([YIELDS, "-o", str(out(YIELDS).parent)]) == 0
    words = "tress is 8.24 times the yield strength of rod"
    assert capsys.readouterr().out.startswith(f"{YIELDS}: s{words}; ")
    assert shown(YIELDS).run("return document.getElementById('acceptance').innerText").startswith(f"S{words}.")


@pytest.mark.slow
def test_the_first_line_has_the_torque_of_a_drive_with_a_motor(out):
    (drive,) = read(out, MANY_LIMITS)["drives"].values()
    torques = [each["value"] for each in (drive["effort"], drive["motor"]["motor_torque"])]
    line = r"; drive of crank ([\d.]+) N·m ± .{2,6} % \(([\d.]+) N·m at its motor\); "
    found = re.search(line, (out(MANY_LIMITS) / "report.html").read_text())
    assert [float(each) for each in found.groups()] == pytest.approx(torques, rel=1e-3)
    assert "at its motor" not in (out(VIBRATES) / "report.html").read_text()


def test_a_caution_names_the_figure_and_the_remedy(tmp_path, capsys):
    main(["steel_four_bar", "--positions", "36", "--accuracy", "0.05 %", "-o", str(tmp_path)])
    caution = r"use with caution: accuracy \(deflection of crank ± 0\.\d+ %: --check solid would measure it\)"
    assert re.search(caution, capsys.readouterr().out)


def test_limits_cannot_be_judged_beyond_yield(out, shown):
    accepted = read(out, YIELDS_IN_LIMITS)["acceptance"]
    assert accepted["verdict"] == "cannot be judged"
    assert accepted["limits"][0]["kept"], "the elastic deflection is below its limit"
    words = shown(YIELDS_IN_LIMITS).run("return document.getElementById('acceptance').innerText")
    assert "times the yield strength of rocker" in words
    assert "% used; cannot be judged; limit" in page_words(shown, YIELDS_IN_LIMITS, ".deciding .tile")


def test_vibration_is_not_called_an_error(out, shown):
    text = shown(VIBRATES).run("return document.body.innerText")
    share = read(out, VIBRATES)["theory"]["without_vibration"]
    change = f"the main deflections, stresses and forces would differ by up to {100 * share:.0f} %"
    assert f"without vibration and large displacement, {change}" in text
    assert f"{100 * share:.0f} % off" not in text


@pytest.mark.parametrize(("name", "drive"), [(VIBRATES, "crank"), (YIELDS, "cylinder")])
def test_peak_power_has_its_sign_and_its_own_instant(name, drive, out, shown):
    power, effort = (read(out, name)["drives"][drive][key] for key in ("power", "effort"))
    tiles = shown(name).run("return Array.from(document.querySelectorAll('.tile'), (each) => each.innerText)")
    tile = next(each for each in tiles if each.startswith("Drive of"))
    assert power["value"] < 0
    assert "peak power (braking) −" in tile
    if name == YIELDS:
        assert power["time"] != effort["time"]
        assert f"at t = {1e3 * power['time']['value']:.4g} ms" in tile


@pytest.mark.parametrize("name", [VIBRATES, ZERO_MEAN])
def test_the_error_of_a_zero_mean_is_not_unreliable(name, out, shown):
    summary = read(out, name)
    mean, largest = (summary["figures"][key] for key in ("drive_mean", "drive_effort"))
    assert abs(mean["value"]) < 1e-3 * abs(largest["value"])
    large = [each["name"] for each in summary["reliability"]["unreliable"]]
    assert not [each for each in large if each == summary["figures"]["drive_mean"]["name"]]
    line = shown(name).run("return document.getElementById('trusted').innerText")
    near_zero = summary["reliability"]["near_zero"]
    more = " except" if large else "; errors above 25 % in " if near_zero else "."
    assert line.startswith(f"All figures are reliable{more}")
    assert all(each in line for each in [*dict.fromkeys(large)][:2])


def test_an_error_beyond_its_figure_is_absolute():
    row = reading(1e-3, "W", error=0.25, unreliable=True)
    assert error_words(row, {}) == " ± 250 mW (unreliable)"
    assert error_words(replace(row, error=3.2e-4), {}) == " ± 32 % (unreliable)"
    assert error_words(reading(0.0, "W", error=0.25, unreliable=True), {}) == " ± 250 mW"
    assert error_words(reading(0.137, "N", error=1.5), {}) == " ± 1.5 N (near zero)"


@pytest.mark.slow
def test_a_press_is_judged_by_the_peak_of_its_ringing(tmp_path, capsys):
    """The load of the press breaks off where its ram reverses, and the links ring faster than the positions show."""
    for positions in ("90", "360"):
        assert main([str(CASES.parent / f"{PRESS}.toml"), "--positions", positions, "-o", str(tmp_path)]) == 0
        words, summary = capsys.readouterr().out, read(tmp_path.joinpath, PRESS)
        largest = summary["largest_deflection"]
        assert abs(largest["value"]) == pytest.approx(27.295e-6, abs=largest["error"])  # at an accuracy of 0.5 %
        assert largest["error"] < 1e-2 * 27.295e-6
        assert summary["theory"]["error"] < 1.5e-2  # of bending, which is smaller and rings more
        assert "(unreliable)" not in words


@pytest.mark.parametrize(
    ("parts", "aim", "advice"),
    [
        ({LARGE: 0.04}, 0.01, 'accuracy = "0.5 %" would suffice'),
        ({LARGE: 0.04}, 0.9, "finer computation cannot"),
        ({LARGE: 2.0}, 0.01, "finer computation cannot"),
        ({LARGE: 0.04, BEAM_THEORY: 0.02}, 0.01, "finer computation cannot"),
        ({LARGE: 0.04, TIME: 0.25}, 0.01, 'accuracy = "0.1 %" would suffice'),
        ({FREQUENCIES: 0.04, LARGE: 0.02}, 0.01, "which no option reduces"),
    ],
)
def test_an_accuracy_is_advised_only_if_it_is_finer_and_can_be_reached(parts, aim, advice):
    """Asked for 5 %: 45 % is coarser, and 0.5 % is no help where not even 5 % were reached.

    It is no help for the errors of beam theory either. Errors of time elements are proportional to the accuracy.
    """
    error = FigureError(parts)
    main_figures = [MainFigure("deflection", 0, 1.0, 1.0, error.without([TIME]))]
    answer = SimpleNamespace(theory=GEOMETRICALLY_EXACT, requested=Theory(), finer=False)
    scene = SimpleNamespace(theory=SimpleNamespace(plain=False, name=None), course=None)
    results = SimpleNamespace(answer=answer, main_figures=main_figures, scene=scene, nonlinear=None)
    assert advice in nearer(results, error, 1.0, aim)


def test_buckling_links_have_only_figures_of_the_rigid_motion(out, shown):
    summary, page = read(out, BUCKLES), shown(BUCKLES)
    assert summary["vibration"] is None
    assert {finding["heading"] for finding in summary["trust"]} == {"Buckling", "Shear", "Dead points", "Cycle"}
    for part in ("limits", "vibration", "extremes", "strength", "errors", "maps", "link"):
        assert page.run("return document.getElementById(arguments[0])", part) is None, part
    assert "drive of crank" in page.run("return document.body.innerText").lower()
    assert page.logs() == []


@pytest.mark.slow
def test_every_unreliable_figure_is_marked(out, shown):
    page, peaks = shown(DOUBTFUL), read(out, DOUBTFUL)["peaks"]
    cells = "return Array.from(document.querySelectorAll('#extremes tbody td.figure'), (each) => each.innerText)"
    marked = [each.endswith("(unreliable)") for each in page.run(cells)]
    tables = ("w", "chord", "u", "phi"), ("M", "N", "V"), ("mises", "normal", "shear")
    known = [peaks[label][field] for fields in tables for label in peaks for field in fields]
    assert marked == [figure["error"] > 0.25 * abs(figure["value"]) for figure in known]
    assert all(marked)
    tiles = page.run("return Array.from(document.querySelectorAll('.tile'), (each) => each.innerText)")
    assert sum("(unreliable)" in tile for tile in tiles) >= 7


def test_every_tile_has_content(out, shown):
    for name in (ZERO_MEAN, VIBRATES, BUCKLES):
        page = shown(name)
        for words in page.run(
            "return Array.from(document.querySelectorAll('.tile .go'), (e) => e.parentNode.innerText)"
        ):
            assert len(words.removesuffix("show").strip(" ,;")) > 2, (name, words)


@pytest.mark.parametrize("verdict", ["not acceptable", "cannot be judged", "too close to decide"])
def test_a_verdict_names_few_limits(verdict, out):
    report = report_from(read(out, UNJUDGED))
    outcome = {"not acceptable": "not kept"}.get(verdict, verdict)
    (row,) = (each for each in report.acceptance.limits if each.kind == "shaking_force")
    limits = [replace(row, outcome=outcome, name=f"{row.name} {number}") for number in range(6)]
    accepted = Verdict(verdict=verdict, passed=None, problem="", limits=limits)
    words = verdict_words(replace(report, acceptance=accepted))
    assert words.endswith(f"and {len(limits) - MAX_NAMED} more of {len(limits)} limits")
    assert len(words) < 400


@pytest.mark.parametrize(
    ("figure", "value", "error", "outcome"),
    [
        ("safety", 17.33, 10.6, KEPT),  # stress error 61 %: at twice the error the safety is 7.8
        ("safety", 3.2, 2.0, TOO_NEAR),  # at twice the error it is 1.4
        ("safety", 2.0, 1.2, TOO_NEAR),
        ("transmission_angle", 17.33, 10.6, TOO_NEAR),
        ("transmission_angle", 17.33, 4.5, KEPT),
        ("transmission_angle", 17.33, 4.3, KEPT),
        ("safety", 17.33, float("nan"), UNKNOWN),
    ],
)
def test_the_error_of_a_safety_is_that_of_its_stress(figure, value, error, outcome):
    limit = Limit(figure, 1.5, True, unit="1")
    assert SEVERITY[int(outcome_index(limit, value, error))] == outcome


@pytest.mark.slow
def test_the_least_safety_is_stated_with_its_own_place(tmp_path, capsys):
    """The crank of the Jansen leg has the largest stress, and its foot of weaker material the least safety."""
    from pypdf import PdfReader

    leg = Path(__file__).parents[1] / "docs" / "gallery" / "jansen_leg.toml"
    text = re.sub("positions = .*", "positions = 36", leg.read_text()).replace("safety = ", "safety = 1000 # ")
    (tmp_path / "leg.toml").write_text(text)
    main([str(tmp_path / "leg.toml"), "-o", str(tmp_path / "out"), "--theory", "quasi-static", "--print"])
    said = capsys.readouterr().out
    assert re.search(r"stress 1\.1\d* MPa[^;]* \(crank\); safety 10\d \(foot from G to D\)", said)
    assert "safety of foot from G to D 10" in said
    printed = PdfReader(tmp_path / "out" / "leg" / "report.pdf").pages[0].extract_text()
    assert re.search(r"in crank; least safety against yield 10\d in foot from G to D\.", printed)


def test_the_print_states_loads_sections_and_motor_ratings():
    motor = '[motors.servo]\ngear_ratio = 10\nrated_torque = "2.4 N m"\n[run]'
    text = (Path(kinelast.scene.__file__).parent / "first.toml").read_text().replace("[run]", motor)
    scene = kinelast.scene_from_text(text.replace('speed = "300 rpm"', 'speed = "300 rpm"\nmotor = "servo"'))
    said = " ".join(assumptions(report_of(computed(scene, Request()))))
    assert "point load 2 kN on ram" in said
    assert "Masses in addition to beams: 1.2 kg on ram at B." in said
    assert "Sections: bar A 96 mm², I 1152 mm⁴." in said
    assert "Motors: crank: rated torque 2.4 N·m." in said


def page_words(shown, name, part="body"):
    return shown(name).run("return document.querySelector(arguments[0]).innerText", part)


def test_a_limit_that_cannot_be_judged_has_its_reason_beside_it(out, shown):
    """The reason is in the headline, in the line on reliability, in the table of limits and in the list of trust."""
    why = "the life of a rolling bearing holds if the equivalent load over C is at most 0.5"
    summary = read(out, UNJUDGED)
    assert summary["acceptance"]["verdict"] == "not acceptable"
    (finding,) = (each for each in summary["trust"] if each["heading"] == "Limits")
    assert finding["text"].startswith("Cannot be judged: life of a rolling bearing of O. The life")
    headline = page_words(shown, UNJUDGED, "#acceptance")
    assert re.search(rf"life of a rolling bearing \(O\) 56\.\d+ h .* cannot be judged: {why}", headline)
    assert "life of a rolling bearing of O (cannot be judged" in page_words(shown, UNJUDGED, "#trusted")
    assert f"cannot be judged: {why}" in page_words(shown, UNJUDGED, "#limits")


def test_sizing_names_the_figure_and_its_item(out, shown):
    for name, words in ((LIFT, "buckling safety of a rod of rail"), (UNJUDGED, "life of a rolling bearing of O")):
        assert f"sizing ({words}" in page_words(shown, name, "#trusted")


@pytest.mark.slow
def test_a_heading_says_whether_values_lie_between_the_positions(out, shown):
    assert read(out, PRESS)["shaking"]["force"]["between_positions"]
    assert "At the positions of the run, and between them if" in page_words(shown, PRESS, "#forces")
    assert "at the positions of the run" not in page_words(shown, PRESS, "#extremes")
    assert "At the positions of the run." in page_words(shown, YIELDS_IN_LIMITS, "#forces")


@pytest.mark.parametrize(
    ("name", "label", "beam"),
    in_tiers([(LIFT, "lower_out.1", "lower_out, A to C"), (PARTS, "foot.2", "foot from F to G")], 1, 1),
)
def test_a_beam_has_one_name_on_the_page(name, label, beam, out, shown):
    labels = {each["label"]: each["name"] for each in read(out, name)["links"]}
    assert labels[label] == beam
    words = page_words(shown, name)
    assert beam in words
    assert label not in words


@pytest.mark.slow
def test_the_page_lists_what_it_marks_as_unreliable(out, shown):
    listed = read(out, MANY_LIMITS)["reliability"]["unreliable"]
    assert {each["on"] for each in listed if "contact losses" in each["name"]} == {"B", "D", "E"}
    assert "contact losses in a joint with clearance of " in page_words(shown, MANY_LIMITS, "#trusted")
    trust = page_words(shown, MANY_LIMITS, "#trust")
    assert all(f"{each['on']} (" in trust for each in listed)
    for name in (PARTS, PRESS, LIFT):
        marked = page_words(shown, name).count("(unreliable)")
        assert bool(marked) == bool(read(out, name)["reliability"]["unreliable"]), name
        assert "\t0 (unreliable)" not in page_words(shown, name)


@pytest.fixture
def opened(driver, tmp_path):
    """Open the quasi-static report of a scene of the gallery; return the page and the summary."""

    def report(name):
        scene = str(GALLERY / f"{name}.toml")
        assert main([scene, "--quiet", "--theory", "quasi-static", "-o", str(tmp_path)]) == 0
        return Page(driver, tmp_path / name / "report.html"), read(tmp_path.joinpath, name)

    return report


def test_no_tile_is_zero_within_its_error(opened):
    """The cam carries the force along its drive, and the output only lags with the drive."""
    page, summary = opened("valve_train")
    effort, lag = summary["drives"]["guide"]["effort"], summary["output"]["lags"][0]
    assert effort["error"] > abs(effort["value"])
    tiles = page.run("return Array.from(document.querySelectorAll('.tile'), (each) => each.innerText)")
    assert not [tile for tile in tiles if tile.startswith(("Drive of guide", "Error of the output"))]
    (words,) = (tile for tile in tiles if tile.startswith("Lag of the drive behind its cam"))
    assert f"{1e3 * abs(lag['value']):.4g} mm" in words
    assert "error of the output apart from this lag: 0 mm" in words


def test_a_frequency_is_compared_with_constant_speeds_only(opened):
    """The drives of the arm move once and stop."""
    page, summary = opened("pick_and_place_arm")
    assert summary["vibration"]["drive_speed"]["value"] == 0.0
    words = page.run("return document.body.innerText")
    assert "Lowest natural frequency" in words
    assert "the drive's speed" not in words


def test_a_large_reserve_fits_its_tile(driver, out):
    page = Page(driver, out(SLOW) / "report.html", 1366, folded=True, height=768)
    assert page.run("return document.querySelector('.tile .value').textContent") == "reserve > 1000"
    wide = "return Array.from(document.querySelectorAll('.tile'), (each) => each.scrollWidth - each.clientWidth)"
    assert max(page.run(wide)) <= 0


@pytest.mark.parametrize(("size", "weight"), [(8.5, "normal"), (11, "bold")])
def test_lines_of_the_print_fill_its_width(size, weight):
    words = "Acceptable: motor speed (crank) 3000 rpm ± < 0.01 % (limit 5000 rpm), tightest of 6 limits. " * 4
    *full, _ = (Paragraph(words, size, weight=weight)).lines
    font = FontProperties(size=size, weight=weight)
    widths = [text_to_path.get_text_width_height_descent(line, font, False)[0] / 72 for line in full]
    paper = 8.27 - 2 * MARGIN
    assert len(widths) > 2
    assert all(0.85 * paper < width <= paper for width in widths)


@pytest.mark.parametrize(
    ("safeties", "others"),
    [
        ([0.5, 2.0, 2.0], ""),
        ([0.5, 0.9, 2.0], "; coupler yields too"),
        ([0.5, 0.9, 0.8], "; rocker and coupler yield too"),
    ],
)
def test_all_links_that_yield_are_named(safeties, others):
    scene = kinelast.load("steel_four_bar")
    assert scene.member_names == ("crank", "coupler", "rocker")
    assert yield_words(scene, safeties) == f"stress is 2 times the yield strength of crank{others}"
