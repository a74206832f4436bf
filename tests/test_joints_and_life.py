"""Bearings, pins, eyes, clearance and fatigue have figures, limits, errors and sweeps."""

import json

import numpy as np
import pytest
from msgspec.structs import replace

from kinelast.answers.refusals import CHECKS, outside_ranges
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.designs.optimum_study import optimum_study
from kinelast.figures.errors import Estimate, figure_errors
from kinelast.reports.reserves import breaks_first
from kinelast.reports.summary import summary
from kinelast.runs import computed, long_results, require_chunk
from kinelast.scene.document import document_of, scene_from_text
from kinelast.scene.parts import PARTS as PARTS_OF_MACHINES
from kinelast.scene.parts.bearings import BEARINGS
from kinelast.scene.parts.fatigue import FATIGUE as LIFE
from kinelast.scene.parts.fatigue import beam_fatigue
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from kinelast.values.numbers import quantity
from machine.joints import SLIP_RANGE
from tests.scene_texts import PARALLELOGRAM, SLIDER_CRANK, edited

ARM = """
sections.round = {shape = "circle", diameter = "20 mm"}
points = {O = [0, 0], A = [0.5, 0]}
links.ground = {points = ["O"]}
links.arm = {points = ["O", "A"], section = "round", material = "steel"}
[materials.steel]
E = "210 GPa"
density = "7850 kg/m^3"
yield = "250 MPa"
ultimate = "400 MPa"
endurance = "200 MPa"
[[drives]]
link = "arm"
speed = "40 rad/s"
[run]
positions = 120
gravity = [0, -9.81]
theory = "quasi-static"
"""

FATIGUE = """
[fatigue]
size = 1.0
[limits]
endurance = 1.5
life = "1000 h"
"""

PARTS = """
[bearings.O]
clearance = "20 um"
[bearings.O.rolling]
C = "19.5 kN"
C0 = "11.2 kN"
life = "10000 h"
safety = 2
least_load = "1 %"
[bearings.O.plain]
diameter = "20 mm"
width = "15 mm"
pressure = "5 MPa"
speed = "1 m/s"
pressure_speed = "1 MPa m/s"
[bearings.O.pin]
diameter = "10 mm"
eye = "12 mm"
cheek = "8 mm"
yield = "600 MPa"
safety = 2
shear = "100 MPa"
bending = "300 MPa"
[bearings.O.eye]
diameter = "10 mm"
width = "30 mm"
thickness = "12 mm"
edge = "15 mm"
yield = "235 MPa"
tear_out = "50 MPa"
safety = 2
"""


def summary_of(text, **more):
    """Return the summary of a scene."""
    return summary(computed(replace(scene_from_text(text), **more), Request()))


def reserves_in(found):
    """Return the reserves by kind, item, mode and figure. They are sorted by size."""
    reserves = {
        (row["kind"], row["item"], row["mode"], row["figure"]): row["reserve"]["value"] for row in found["breaks_first"]
    }
    known = [reserve for reserve in reserves.values() if reserve is not None]
    assert [*reserves.values()][: len(known)] == sorted(known)
    return reserves


def test_the_endurance_of_a_rotating_arm_follows_goodman():
    """Root of the arm: rho omega^2 L^2/2 is constant; the weight alternates in bending and along the arm."""
    found = summary_of(ARM + FATIGUE)
    pull = 7850 * 40**2 * 0.5**2 / 2
    bending = 7850 * 9.81 * 0.5**2 / 2 * 0.01 / (0.02**2 / 16)
    alternating = np.hypot(bending, 7850 * 9.81 * 0.5)
    row = found["life"]["links"]["arm"]
    assert row["endurance"]["value"] == pytest.approx(1 / (alternating / 200e6 + pull / 400e6), rel=1e-3)
    assert row["amplitude"]["value"] == pytest.approx(alternating, rel=1e-3)
    assert row["mean"]["value"] == pytest.approx(pull, rel=1e-3)
    assert row["along"]["value"] == 0.0
    assert row["endless"]
    limits = {each["kind"]: each for each in found["acceptance"]["limits"]}
    assert {kind: each["outcome"] for kind, each in limits.items()} == {"endurance": "kept", "life": "kept"}
    assert limits["endurance"]["found"]["value"] == row["endurance"]["value"]
    reserves = reserves_in(found)
    assert reserves["link", "arm", "limit", "life"] is None
    assert reserves["link", "arm", "limit", "endurance"] == pytest.approx(row["endurance"]["value"] / 1.5)
    assert reserves["link", "arm", "endurance", "endurance"] == pytest.approx(row["endurance"]["value"])
    assert reserves["link", "arm", "yield", "safety"] == pytest.approx(
        found["strength"]["arm"]["safety_factor"]["value"]
    )


def test_factors_and_notches_follow_the_textbook():
    plain = summary_of(ARM + FATIGUE)["life"]["links"]["arm"]
    factors = '[fatigue]\nsurface = "machined"\nreliability = 0.99\n[fatigue.links.arm]\nnotches = {O = 2}\n'
    found = summary_of(ARM + factors)["life"]["links"]["arm"]
    whole = 4.51 * 400**-0.265 * (0.37 * 20 / 7.62) ** -0.107 * 0.814
    assert found["factors"]["size"] == 1.0  # 7.4 mm by area, below 7.62
    assert found["endurance_limit"]["value"] == pytest.approx(200e6 * whole / (0.37 * 20 / 7.62) ** -0.107, rel=1e-3)
    a, m = (2 * plain[key]["value"] for key in ("amplitude", "mean"))
    expected = 1 / (a / found["endurance_limit"]["value"] + m / 400e6)
    assert found["endurance"]["value"] == pytest.approx(expected, rel=1e-9)


def test_a_finite_life_is_given_in_runs_and_hours():
    """The S-N line by hand, at 40 rad/s."""
    found = summary_of(ARM.replace('"200 MPa"', '"3 MPa"') + FATIGUE)
    row = found["life"]["links"]["arm"]
    equivalent = row["amplitude"]["value"] / (1 - row["mean"]["value"] / 400e6)
    cycles = 1e6 * (3e6 / equivalent) ** 5
    assert row["cycles"]["value"] == pytest.approx(cycles, rel=1e-9)
    assert row["life"]["value"] == pytest.approx(cycles * 2 * np.pi / 40, rel=1e-9)
    reserves = reserves_in(found)
    assert reserves["link", "arm", "limit", "life"] == pytest.approx((row["life"]["value"] / 3.6e6) ** 0.2)
    assert ("link", "arm", "endurance", "endurance") not in reserves, "a finite life is required instead"
    assert quantity(7.2e7, "s") == "20000 h"


def test_parts_of_a_joint_are_sized_from_its_force():
    text = ARM.replace("-9.81", "0.0") + PARTS
    found = summary_of(text)
    force = 7850 * np.pi * 0.01**2 * 40**2 * 0.5**2 / 2
    (joint,) = [each for each in found["joints"] if each["joint"] == "O"]
    values = {key: each["value"] for key, each in joint["figures"].items()}
    expected = {
        "joint_mean_force": force,
        "joint_swing": 2 * np.pi,
        "bearing_life": (19.5e3 / force) ** 3 * 1e6 * 2 * np.pi / 40,
        "bearing_static_safety": 11.2e3 / force,
        "bearing_pressure": force / (0.02 * 0.015),
        "bearing_speed": 0.4,
        "bearing_pv": force / (0.02 * 0.015) * 0.4,
        "pin_bending": 32 * force * 0.028 / 8 / (np.pi * 0.01**3),
        "eye_tear_out": force / (2 * 0.012 * 0.010),
        "contact_losses": 0.0,
    }
    assert {key: values[key] for key in expected} == pytest.approx(expected, rel=1e-6)
    assert joint["sense"] == "turns counter-clockwise"
    assert joint["force_turns"]["child"]["value"] == pytest.approx(0, abs=1e-9)
    assert abs(joint["force_turns"]["parent"]["value"]) == pytest.approx(1)
    limits = {each["kind"]: each["outcome"] for each in found["acceptance"]["limits"]}
    assert len(limits) == 11
    assert limits["bearing_life"] == "kept"


@pytest.mark.parametrize(("kind", "exponent"), [("ball", 3), ("roller", 10 / 3)])
def test_the_first_reserve_is_that_of_the_whole_machine(kind, exponent):
    """Without weight, the force in the pin is constant, so all reserves of its parts are closed forms."""
    parts = (
        PARTS.replace('C = "19.5 kN"', f'C = "19.5 kN"\ntype = "{kind}"') + "[limits.figures]\nshaking_force = 3000\n"
    )
    found = summary_of(ARM.replace("-9.81", "0.0") + parts)
    force = 7850 * np.pi * 0.01**2 * 40**2 * 0.5**2 / 2
    pressure = force / (0.02 * 0.015)
    life = 10_000 * 3600 * 40 / (2 * np.pi) / 1e6  # millions of turns
    expected = {
        ("rolling bearing", "bearing_life"): 19.5e3 / life ** (1 / exponent) / force,
        ("rolling bearing", "bearing_static_safety"): 11.2e3 / force / 2,
        ("rolling bearing", "bearing_load_share"): force / 19.5e3 / 0.01,
        ("plain bearing", "bearing_pressure"): 5e6 / pressure,
        ("plain bearing", "bearing_speed"): 1 / 0.4,
        ("plain bearing", "bearing_pv"): 1e6 / (pressure * 0.4),
        ("pin", "pin_bending"): 300e6 / (32 * force * 0.028 / 8 / (np.pi * 0.01**3)),
        ("eye", "eye_tear_out"): 50e6 / (force / (2 * 0.012 * 0.010)),
        ("machine", "shaking_force"): 3000 / force,
    }
    reserves = reserves_in(found)
    of_limits = {(of, figure): reserve for (of, _, mode, figure), reserve in reserves.items() if mode == "limit"}
    assert {key: of_limits[key] for key in expected} == pytest.approx(expected, rel=1e-6)
    assert len(of_limits) == len(found["acceptance"]["limits"])
    assert next(iter(of_limits)) == next(iter(reserves))[::3] == min(expected, key=expected.get)


@pytest.mark.parametrize(("kind", "outside"), [("ball", False), ("roller", True)])
def test_rollers_need_twice_the_minimum_load_of_balls(kind, outside):
    """The load is 0.015 C, the minimum 0.01 C for balls and 0.02 C for rollers."""
    scene = scene_from_text(f'{ARM}\n[bearings.O.rolling]\nC = "20 kN"\ntype = "{kind}"\n')
    found = dict(outside_ranges(scene, {"bearing_load_share": [0.015]}))
    assert found == ({SLIP_RANGE: {"O": pytest.approx(0.75)}} if outside else {})


def test_every_range_of_a_formula_refuses_limits_on_the_figures_of_the_formula():
    by_key = {figure.key: figure for part in PARTS_OF_MACHINES for figure in part.figures}
    for check in CHECKS:
        assert check.refuses, check.range.condition
        assert all(by_key[key].of == check.of for key in check.refuses)


def test_a_scene_without_these_parts_has_no_such_figures():
    found = summary_of(ARM)
    keys = {each.key for each in (*BEARINGS.figures, *LIFE.figures)}
    assert not keys & found["figures"].keys()
    assert found["life"] is None
    assert all("figures" not in joint for joint in found["joints"])
    assert {row["mode"] for row in found["breaks_first"]} <= {"yield", "buckling"}


def test_designs_equal_single_runs():
    text = (ARM + FATIGUE + PARTS).replace('"200 MPa"', '"3 MPa"')
    document = document_of_text(text)
    paths = ["sections.round.diameter", "bearings.O.rolling.C", "materials.steel.endurance"]
    values = [[0.02, 19.5e3, 4e6], [0.03, 12e3, 3e6], [0.015, 30e3, 200e6]]
    figures = ["endurance", "life", "bearing_life", "eye_safety.O", "bearing_pv"]
    found = evaluate(document, paths, values, figures)
    assert not any(found.reason)
    for k, row in enumerate(values):
        scene = document.with_values(dict(zip(paths, row, strict=True))).scene
        alone = summary(computed(scene, Request()))["figures"]
        for key in ("endurance", "bearing_life", "bearing_pv"):
            assert found.columns[key][k] == pytest.approx(alone[key]["value"], rel=1e-9), key
        life = alone["life"]["value"]
        assert found.columns["life"][k] == (np.inf if life is None else pytest.approx(life, rel=1e-9))
    assert np.isinf(found.columns["life"][2])


@pytest.mark.slow
def test_the_lightest_design_meets_a_limit_exactly():
    """The thinnest arm that keeps endurance and static safety meets one of them exactly."""
    study = """
[optimize]
minimize = "mass"
[optimize.variables]
"sections.round.diameter" = ["5 mm", "40 mm"]
"""
    text = ARM.replace('"200 MPa"', '"20 MPa"') + FATIGUE + PARTS + study
    best = optimum_study(document_of_text(text))
    assert best.optimum.feasible
    after = {limit.figure: (best.after[limit.figure] / limit.bound) ** (1 if limit.least else -1)
             for limit in best.task.limits}  # fmt: skip
    assert "endurance.arm" in after
    assert 1.0 <= min(after.values()) < 1.001  # the limit leaves room for the error


def document_of_text(text):
    import tomllib

    return document_of(tomllib.loads(text))


def test_a_chunked_run_has_the_fatigue_of_the_whole_cycle(monkeypatch):
    """A chunk contains only part of the cycle, but the amplitude needs the whole."""
    monkeypatch.setattr("rigid.chunks.MIN_COLUMNS", 900)
    monkeypatch.setattr("rigid.chunks.CACHE_CELLS", 900)
    scene = scene_from_text(ARM + FATIGUE + PARTS)
    times = scene.course.times(3600)
    long = long_results(scene, times, lambda *_: None, require_chunk)
    short = computed(scene, Request())
    for key in ("endurance", "bearing_life", "bearing_pv"):
        one, other = (each.figures.peaks[key][0].value for each in (long, short))
        assert one == pytest.approx(other, rel=1e-3)


def test_relative_errors_scale_with_the_power_of_the_load():
    results = computed(scene_from_text(ARM + PARTS + FATIGUE), Request())
    figures = [each for each in (*BEARINGS.figures, *LIFE.figures)
               if each.key in ("bearing_load", "bearing_life", "contact_losses")]  # fmt: skip
    found = figure_errors(results.cycle, figures, Estimate({}, results.cycle, {"time and coordinates": 0.01}))
    share = {
        key: rows[0].size / abs(results.figures.peaks[key][0].value)
        for key, rows in found.items()
        if key != "contact_losses"
    }
    assert share == pytest.approx({"bearing_load": 0.01, "bearing_life": 0.1 / 3}, rel=1e-6)
    assert found["contact_losses"][0].size == pytest.approx(0.0, abs=1e-9)


def test_the_error_of_a_life_is_three_times_that_of_the_load():
    """The life of a ball bearing varies with the cube of the load, and so its relative error is tripled."""
    text = (ARM + PARTS + FATIGUE).replace('theory = "quasi-static"', "")
    results = computed(scene_from_text(text), Request())
    peaks = results.figures.peaks
    load, life = peaks["bearing_load"][0], peaks["bearing_life"][0]
    assert life.error is not None
    assert 2 < life.error.size / life.value / (load.error.size / load.value) < 4
    assert breaks_first(results)[0].reserve.error is not None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('endurance = "200 MPa"\n', "", "endurance: the key is missing"),
        ("size = 1.0", 'criterion = "soderberg"', None),
        ("size = 1.0", "[fatigue.notches]\nQ = 2.0", "no point of a link with beams"),
        ("size = 1.0", "[fatigue.links.rod]\nsize = 1.0", "no link with beams"),
        ("[fatigue]\nsize = 1.0\n", "", "needs the fatigue of the links"),
        ("[bearings.O]\n", '[bearings.A]\nclearance = "1 um"\n[bearings.O]\n', "no pin"),
        ('C0 = "11.2 kN"\n', "", "C0: the key is missing"),
        ('cheek = "8 mm"\n', "", "cheek: the key is missing"),
        ('width = "30 mm"', 'width = "9 mm"', "more than the diameter"),
        ('edge = "15 mm"', 'edge = "5 mm"', "more than half the diameter"),
        ('yield = "600 MPa"\n', "", "yield: the key is missing"),
        ("safety = 2\nleast_load", "least_overlap = 1\nleast_load", "elements: the key is missing"),
    ],
)
def test_mistakes_of_joints_and_fatigue_are_named(old, new, words):
    text = ARM + FATIGUE + PARTS
    assert old in text
    if words is None:
        scene_from_text(text.replace(old, new))
        return
    with pytest.raises(SceneError, match=words):
        scene_from_text(text.replace(old, new, 1))


CRANKED = SLIDER_CRANK.replace("density = 7850", "density = 7850\nyield = 250e6\nultimate = 400e6\nendurance = 100e6")
EYE = """
[fatigue]
size = 1.0
[bearings.B.eye]
diameter = "4 mm"
width = "10 mm"
thickness = "0.5 mm"
edge = "10 mm"
link = "rod"
"""


@pytest.mark.parametrize(("more", "factor"), [("", 2.851632), ("notch = 3.5\n", 3.5)])
def test_the_notch_of_an_eye_reduces_the_life_of_its_link(more, factor):
    """Goodman's by hand: of the force along the rod at its pin, over the net section, times the factor."""
    results = computed(scene_from_text(CRANKED.replace("positions = 36", "positions = 360") + EYE + more), Request())
    fatigue = beam_fatigue(results.cycle)
    rod = 0
    assert float(fatigue.safety.xi[rod]) == 1.0
    names = [name for name, _ in results.joint_words]
    course = results.cycle.joint(names.index("B"))
    way = results.motion.direction[results.mechanism.index["rod"]]
    of_child = results.motion.structure.joints[names.index("B")].child == results.mechanism.index["rod"]
    pull = (1 if of_child else -1) * np.real(np.conj(way) * course.force)
    stress = factor * pull / (6e-3 * 0.5e-3)
    amplitude, mean = np.ptp(stress) / 2, (stress.max() + stress.min()) / 2
    safety = 1 / (amplitude / 100e6 + max(mean, 0) / 400e6)
    assert float(fatigue.safety.value[rod]) == pytest.approx(safety, rel=1e-4)
    plain = beam_fatigue(computed(scene_from_text(CRANKED + EYE.replace('link = "rod"\n', "")), Request()).cycle)
    assert float(plain.safety.value[rod]) > safety


def test_designs_have_their_own_notch_factor():
    text = CRANKED + EYE
    depths = np.array([[0.006], [0.008], [0.012]])
    found = evaluate(document_of_text(text), ["sections.bar.diameter"], depths, ["endurance", "life"])
    for (depth,), *values in zip(depths, found.columns["endurance"], found.columns["life"], strict=True):
        own = document_of_text(text.replace('"8 mm"', f'"{depth} m"'))
        alone = evaluate(own, [], np.zeros((1, 0)), ["endurance", "life"]).columns
        assert values == pytest.approx([alone["endurance"][0], alone["life"][0]], rel=1e-9)


def test_the_pressure_of_a_slider_includes_the_eccentric_load():
    """The crank tilts the block in its guide: force and moment of the rail follow from the balance of the block."""
    text = SLIDER_CRANK.replace('points = ["B"]\nmass = "200 g"', BLOCK)
    guided = '[bearings.guide.plain]\nlength = "50 mm"\nwidth = "20 mm"\npressure = "1 MPa"\npressure_speed = 1e6\n'
    results = computed(scene_from_text(text + guided), Request())
    cycle, names = results.cycle, [name for name, _ in results.joint_words]
    rod = cycle.joint(names.index("B"))
    child = results.motion.structure.joints[names.index("B")].child
    pushed = (1 if results.mechanism.links[child].name == "block" else -1) * np.imag(rod.force)
    across, moment = -pushed, 0.03 * 100.0  # the load of 100 N acts 30 mm above the line
    pressure = np.abs(across) / 1e-3 + 6 * moment / (20e-3 * 50e-3**2)
    peaks = results.figures.peaks
    assert abs(peaks["bearing_pressure"][0].value) == pytest.approx(pressure.max(), rel=1e-9)
    speed = np.abs(cycle.joint(names.index("guide")).rate)
    assert speed.max() <= peaks["bearing_speed"][0].value <= 1.01 * speed.max()  # searched between positions
    summary_of = summary(results)
    assert [row["kind"] for row in summary_of["acceptance"]["limits"]] == ["bearing_pressure", "bearing_pv"]
    assert [row["on"] for row in summary_of["acceptance"]["limits"]] == ["guide", "guide"]
    joint = next(row for row in summary_of["joints"] if row["joint"] == "guide")
    assert joint["sense"] == "slides"
    assert {*joint["figures"]} == {"bearing_pressure", "bearing_speed", "bearing_pv"}


BLOCK = """points = {B = [0, 0], P = [0, 0.03]}
rigid = true
mass = "200 g"
center = "B"
inertia = "1e-4 kg m^2"

[[loads]]
link = "block"
point = "P"
force = [-100, 0]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("length =", "diameter =", "a plain bearing of a slider has no diameter: give length"),
        ('length = "50 mm"\n', "", "length: the key is missing"),
        ("[bearings.guide.plain]", '[bearings.guide.rolling]\nC = "2 kN"\n[bearings.guide.plain]', "belongs to a pin"),
        ("[bearings.guide.plain]", "[bearings.guid.plain]", "no pin or slider"),
        ("[bearings.guide.plain]", "[bearings.A.plain]", "a plain bearing of a pin"),
        ('edge = "10 mm"', 'edge = "6 mm"', "notch: the key is missing"),
        ('link = "rod"', 'link = "block2"', "no link at the pin"),
    ],
)
def test_mistakes_of_guides_and_eyes(old, new, words):
    text = CRANKED + EYE + '[bearings.guide.plain]\nlength = "50 mm"\nwidth = "20 mm"\n'
    assert old in text
    with pytest.raises(SceneError, match=words):
        scene_from_text(text.replace(old, new, 1))


def test_the_command_reports_the_broken_limit(tmp_path, capsys):
    scene = tmp_path / "arm.toml"
    scene.write_text(ARM.replace('"200 MPa"', '"3 MPa"') + FATIGUE + PARTS, encoding="utf-8")
    assert main([str(scene), "-o", str(tmp_path / "out")]) == 1
    assert "safety factor against the endurance limit (arm) 0." in capsys.readouterr().out
    page = (tmp_path / "out" / "arm" / "report.html").read_text(encoding="utf-8")
    assert "function polar(" in page
    written = json.loads((tmp_path / "out" / "arm" / "summary.json").read_text(encoding="utf-8"))
    assert written["breaks_first"][0]["item"] == "arm"


def test_a_life_counts_the_time_of_singular_positions():
    steel = 'yield = "355 MPa"\nultimate = "470 MPa"\nendurance = "10 MPa"\n'
    changes = ("density = 7850\n", f"density = 7850\n{steel}"), ("speed = 10.0", "speed = 60.0")
    text = edited(PARALLELOGRAM, *changes) + "[fatigue]\n"
    results = computed(scene_from_text(text), Request(theory="quasi-static"))
    assert results.figures.singular == 2
    coupler = 1
    life, cycles = (results.figures.peaks[key][coupler].value for key in ("life", "life_cycles"))
    assert np.isfinite(life)
    assert life == pytest.approx(cycles * results.scene.run.duration, rel=1e-12)
