"""Report, chunked run, notebook, design, optimum and speed give the same figures and verdicts.

Each is compared with the report of the scene, to 1e-12 of the figure or to the round-off of the scene's own scale. A
report also searches rigid figures between positions, designs do not, so designs are compared with the figures at the
positions. The ratio of a design's load to the critical load is a bound.
"""

import copy
import re
from collections import Counter
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from tiers import in_tiers

from kinelast import report, scene_from_dict, shipped_scenes
from kinelast.answers.refusals import STRENGTH, needed_by_limits
from kinelast.designs import evaluate
from kinelast.designs.base import design_measures
from kinelast.designs.optimum_study import problem_of
from kinelast.figures.cycle import Cycle
from kinelast.figures.measures import magnitudes
from kinelast.figures.output import output_of
from kinelast.figures.peaks import joined, run_figures
from kinelast.figures.registry import figures_of, limits_of
from kinelast.outputs.speeds import speed_figures
from kinelast.reports.full_answer import full_answer
from kinelast.reports.limits import KEPT, SEVERITY, limits_of_items, outcome_indices, verdict_on
from kinelast.reports.summary import summary
from kinelast.runs import by_theory, computed, long_results
from kinelast.scene.document import document_from_text
from kinelast.scene.parsing import parse_toml
from kinelast.scene.parts import PARTS
from kinelast.scene.tables import LimitsTable
from kinelast.scene.text import file_text
from kinelast.speed_study.speeds import speeds
from kinelast.tasks.progress import SILENT
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from kinelast.values.figure import AVERAGE, LARGEST, LEAST, NOISE, Limit
from live.answer import quick_answer
from rigid import posture
from rigid.kinematics import repeated
from tests.scene_texts import FOUR_BAR, QUICK_RETURN, SLIDER_CRANK

NAMES = ("steel_four_bar", "offset_slider_crank", "quick_return", "drs_push_up", "five_points", "lightest_arm")
FACTORS = (0.4, 1 - 1e-9, 1 + 1e-9, 3.0)


def tables_of(text, positions):
    tables = parse_toml(text)
    run = {key: value for key, value in tables.get("run", {}).items() if key not in ("output", "accuracy")}
    tables["run"] = {**run, "positions": positions, "theory": "quasi-static"}
    return {key: value for key, value in tables.items() if key not in ("limits", "optimize", "sweep", "tolerances")}


SHIPPED = [tables_of(file_text(shipped_scenes()[name]), 12) for name in NAMES]
DRAWN = [tables_of(text, 12) for text in (FOUR_BAR, SLIDER_CRANK, QUICK_RETURN)]


def summary_of(tables):
    return summary(computed(scene_from_dict(tables), Request()))


def test_every_key_under_limits_is_that_of_a_figure_bounded_from_its_side():
    limits = {"deflection": 1.0, "chord": 1.0, "safety": 2.0, "output": 1.0, "buckling": 0.5}
    limits |= {"endurance": 1.5, "life": "1000 h"}
    tables = copy.deepcopy({**DRAWN[0], "limits": limits, "fatigue": {}})
    for material in tables["materials"].values():
        material |= {"ultimate": "500 MPa", "endurance": "200 MPa"}
    scene = scene_from_dict(tables)
    keys, known = {*LimitsTable.__struct_fields__}, figures_of(output_of(scene))
    figures = {figure.limit: figure for figure in known if figure.limit in keys}
    assert figures.keys() | {"links", "figures"} == keys
    of_parts = {figure.key for part in PARTS for figure in part.figures}
    assert all(figure.limit in keys or figure.key in of_parts for figure in known if figure.limit)
    for limit in scene.limits:
        figure = figures[limit.kind]
        assert (limit.figure, limit.least) == (figure.key, figure.over == LEAST)
        assert limit.unit in (figure.unit, "" if limit.kind == "output" else None)


@st.composite
def scenes(draw):
    """Draw a scene with random sizes and limits near or far from its figures; the output is named or guessed."""
    tables = copy.deepcopy(draw(st.sampled_from(SHIPPED + DRAWN)))
    for material in tables.get("materials", {}).values():
        material["density"] = 7850 * draw(st.floats(0.3, 3.0))
        if draw(st.booleans()):
            material["yield"] = "200 MPa"
    if draw(st.booleans()):
        scene = scene_from_dict(tables)
        names = [name for link in scene.mechanism.links[1:] for name in link.points
                 if name not in scene.mechanism.links[0].points]  # fmt: skip
        links = [f"{link.name}.angle" for link in scene.mechanism.links[1:]]
        tables["run"]["output"] = draw(st.sampled_from(names + links))
    figures = summary_of(tables)["figures"]
    limits = {}
    for key in draw(st.lists(st.sampled_from(("deflection", "chord", "safety", "output")), unique=True)):
        figure = figures.get({"output": "output_error"}.get(key, key), {"value": None})
        value = abs(figure["value"] or 1e-3) * draw(st.sampled_from(FACTORS))
        limits[key] = value if key == "safety" else f"{value!r} {figure.get('unit', 'm')}"
    labels = scene_from_dict(tables).labels
    if labels and draw(st.booleans()):
        link = labels[draw(st.integers(0, len(labels) - 1))].split(".")[0]
        limits["links"] = {
            link: {"chord": f"{draw(st.sampled_from(FACTORS)) * abs(figures['chord']['value'] or 1.0)!r} m"}
        }
    return {**tables, "limits": limits}


@contextmanager
def chunks(columns):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rigid.chunks.MIN_COLUMNS", columns)
        patch.setattr("rigid.chunks.CACHE_CELLS", columns)
        yield


def near(value, other, scale):
    """Return whether magnitudes agree to 1e-12, or both are below the round-off of the scene."""
    size, different = (np.nan if each is None else abs(each) for each in (value, other))
    return (np.isnan(size) and np.isnan(different)) or abs(size - different) <= 1e-12 * max(size, different) + scale


def check_doors(tables):
    """Compare all figures and verdicts of a scene by every fast interface."""
    scene = scene_from_dict(tables)
    results = computed(scene, Request())
    reported = summary(results)
    figures, verdicts = reported["figures"], [row["kept"] for row in reported["acceptance"]["limits"]]
    kept = [each and not reported["yields"] for each in verdicts]
    noise = {unit: 2 * NOISE * scale for unit, scale in results.figures.scales.items()}

    with chunks(5):
        given = scene.course.times(), lambda *_: None, lambda *_: None
        long = summary(long_results(scene, *given, lambda plain: by_theory(plain, Request(), SILENT)))
    assert [row["kept"] for row in long["acceptance"]["limits"]] == verdicts
    assert words(long["acceptance"]) == words(reported["acceptance"]), "long"
    for key, figure in figures.items():
        assert near(figure["value"], long["figures"][key]["value"], noise.get(figure["unit"], 0.0)), ("long", key)
        errors = [row.get("error") or 0.0 for row in (figure, long["figures"][key])]
        assert errors[0] == pytest.approx(errors[1], rel=1e-6, abs=1e-15), ("long", key)

    names = [name for name in design_measures(scene, output_of(scene)) if name in figures]
    limited = ["limits_kept"] if scene.limits else []
    row = evaluate(tables, [], np.zeros((1, 0)), [*names, *limited])
    assert row.reason[0] == ""
    at_positions = summary(replace(results, answer=None))["figures"]
    of_motion = {figure.key: figure.over for figure in results.figures.figures if figure.of_motion(scene)}
    for key in names:
        scale, found, value = noise.get(row.units[key], 0.0), finite(row.columns[key][0]), at_positions[key]["value"]
        if key == "buckling":
            assert found >= (1 - 1e-9) * value
            continue
        assert near(value, found, scale), ("design", key)
        if key not in of_motion:
            assert figures[key]["value"] == value, ("report", key)
        elif of_motion[key] in (LARGEST, LEAST) and value:
            further = abs(figures[key]["value"]) - abs(value)
            assert further * (-1 if of_motion[key] == LEAST else 1) >= -scale, ("report", key)
    if scene.limits:
        assert bool(row.columns["limits_kept"][0]) == all(kept)
        # the best of a sweep, and of an optimum
        judged = verdict_on(full_answer(scene, limits_of_items(scene)).judgements)
        assert (judged.verdict, judged.passed) == tuple(reported["acceptance"][key] for key in ("verdict", "passed"))

    found = figures_of(output_of(scene))
    named = {limit.figure for limit in limits_of(scene)} | needed_by_limits(scene)
    found = [figure for figure in found if not figure.asked or figure.key in named]
    moved = scene.course.at(scene.course.times())
    cycle = Cycle(scene, repeated(moved, (2, len(moved.time))))
    sizes = magnitudes(cycle, found)
    both = [np.broadcast_to(each == SEVERITY.index(KEPT), 2).tolist() for each in outcome_indices(scene, sizes)]
    assert both == [[passed] * 2 for passed in kept], "columns"
    return reported


def words(acceptance):
    """Return the verdict and the outcome of each limit."""
    return acceptance["verdict"], acceptance["passed"], [row["outcome"] for row in acceptance["limits"]]


def finite(value):
    return value if np.isfinite(value) else None


def allowed(figure, factor):
    """Return a multiple of a figure, with its unit."""
    return f"{factor * abs(figure['value'])!r} {figure['unit']}"


@settings(max_examples=4, deadline=None)
@given(scenes())
def test_a_scene_has_the_same_figures_and_verdicts_at_every_door(tables):
    check_doors(tables)


@pytest.mark.exhaustive
@settings(max_examples=300, deadline=None)
@given(scenes())
def test_many_scenes_have_the_same_figures_and_verdicts_at_every_door(tables):
    check_doors(tables)


@cache
def figures_before_limits(named):
    """Return the figures of the steel four-bar without limits, for a named or guessed output."""
    tables = copy.deepcopy(SHIPPED[0])
    if named:
        tables["run"]["output"] = "B"
    return summary_of(tables)["figures"]


@pytest.mark.parametrize(
    ("factor", "named"),
    [
        pytest.param(factor, named, marks=[] if named and factor == FACTORS[1] else pytest.mark.slow)
        for factor in FACTORS
        for named in (True, False)
    ],
)
def test_an_optimum_and_a_notebook_keep_the_limits_of_the_report(factor, named):
    tables = copy.deepcopy(SHIPPED[0])
    if named:
        tables["run"]["output"] = "B"
    figures = figures_before_limits(named)
    limits = {key: factor * abs(figures[key]["value"]) for key in ("deflection", "chord", "safety")}
    tables["limits"] = {
        **limits,
        "output": f"{factor * abs(figures['output_error']['value'])!r} {figures['output_error']['unit']}",
    }
    reported = summary_of(tables)
    rows = reported["acceptance"]["limits"]
    assert {row["kind"]: row["kept"] for row in rows} == {
        key: (factor > 1) != (key == "safety") for key in ("deflection", "chord", "safety", "output")
    }
    written = report(scene_from_dict(tables)).figures
    assert written["acceptance"]["limits"] == rows
    assert written["figures"] == reported["figures"]
    tables["optimize"] = {"minimize": "mass", "variables": {"sections.bar.depth": ["3 mm", "9 mm"]}}
    posed = problem_of(tables)
    at = np.array([variable.base for variable in posed.task.variables])
    columns = posed.problem.figures_of(at[None]).columns
    judged = verdict_on(full_answer(scene_from_dict(tables), posed.task.limits).judgements)
    assert judged.verdict == written["acceptance"]["verdict"] != ""
    for row in rows:
        key = {"output": "output_error"}.get(row["kind"], row["kind"])
        own = [limit for limit in posed.task.limits if limit.figure.split(".")[0] == key]
        assert all(bool(limit.kept(columns[limit.figure][0])) for limit in own) == row["kept"], key


def test_a_limit_of_an_unnamed_output_is_judged_alone():
    """The sweep does not crash, the optimum keeps the limit, and the unit shows that the output is an angle."""
    tables = {**copy.deepcopy(SHIPPED[0]), "limits": {"output": "5 deg"}}
    reported = summary_of(tables)
    assert (reported["output"]["kind"], reported["output"]["name"], reported["acceptance"]["passed"]) == (
        "angle",
        "rocker",
        True,
    )
    assert evaluate(tables, [], np.zeros((1, 0))).columns["limits_kept"][0] == 1.0
    tables["limits"] = {"output": "0.01 mm"}
    reported = summary_of(tables)
    assert (reported["output"], reported["acceptance"]["verdict"]) == (None, "cannot be judged")
    assert evaluate(tables, [], np.zeros((1, 0)), ["limits_kept"]).columns["limits_kept"][0] == 0.0
    tables["optimize"] = {"minimize": "mass", "variables": {"sections.bar.depth": ["3 mm", "9 mm"]}}
    with pytest.raises(SceneError, match='the limit cannot be judged: the figure "output_error" is not known'):
        problem_of(tables)


@pytest.mark.parametrize("named", in_tiers([True, False], 0, 1))
def test_a_speed_of_a_map_is_judged_as_its_report(named):
    """The speed of the scene causes little vibration. Maps search between positions and converge to 0.2 %."""
    tables = copy.deepcopy(SHIPPED[0])
    tables["drives"][0]["speed"] = 20.0
    tables["run"] |= {"positions": 720, "theory": "elastodynamic"}
    if named:
        tables["run"]["output"] = "B"
    figures = summary_of(tables)["figures"]
    for factor in (0.9, 1.1):
        output = allowed(figures["output_error"], factor)
        tables["limits"] = {"output": output, "deflection": 2 * abs(figures["deflection"]["value"])}
        found = speeds(scene_from_dict(tables), (10.0, 20.0, 2))
        assert (found.highest == 20.0) == (factor > 1)
        assert found.verdicts[-1] == summary_of(tables)["acceptance"]["verdict"] != "too close to decide"
    for name, (measure, values, _) in found.figures.items():
        if measure.items is None and name in figures and figures[name]["value"] is not None:
            assert values[1] == pytest.approx(abs(figures[name]["value"]), rel=0.02, abs=1e-9), name


@pytest.mark.parametrize("share", in_tiers([0.0, 0.4, 1.0], 1, 2))
def test_positions_count_by_one_rule_in_chunks_too(share, monkeypatch):
    """If some positions are well conditioned, only those count; otherwise all count."""
    scene = scene_from_dict(SHIPPED[0])
    moved = scene.course.at(scene.course.times())
    well = np.quantile(moved.condition, share) if share else 0.5
    monkeypatch.setattr("kinelast.figures.cycle.MAX_CONDITION", well)
    monkeypatch.setattr("kinelast.figures.peaks.MAX_CONDITION", well)
    whole = run_figures(Cycle(scene, moved, tabled=True), None)
    joint = None
    for position, time in enumerate(moved.time):
        there = scene.course.near(np.array([time]), posture(moved, [position]))
        joint = joined(joint, run_figures(Cycle(scene, there, tabled=True), None))
    assert (whole.ill == len(moved.time), whole.ill == 0) == (share == 0.0, share == 1.0)
    for name in ("positions", "singular", "locked", "ill", "well", "span"):
        assert getattr(joint, name) == getattr(whole, name)
    for figure in whole.figures:
        if figure.whole or figure.over == AVERAGE:  # chunks cannot give these figures
            continue
        noise = 1e3 * NOISE * whole.scales.get(str(figure.unit), 0.0)
        for peak, other in zip(whole.peaks[figure.key], joint.peaks[figure.key], strict=True):
            assert other.value == pytest.approx(peak.value, rel=1e-9, abs=noise, nan_ok=True), figure.key
    np.testing.assert_allclose(joint.swings, whole.swings, rtol=1e-9, atol=1e-3)


GENERAL = "joint_force.B", "drive_rms.crank", "shaking_force", "transmission_angle", "frequency", "energy_taken.crank"


SLOW = (  # the steel four-bar at a low speed, so that its quasi-static answer has a small error
    file_text(shipped_scenes()["steel_four_bar"])
    .replace('"100 rad/s"', '"20 rad/s"')
    .replace("positions = 360", "positions = 24")
    .replace('accuracy = "5 %"', 'output = "B"\ntheory = "quasi-static"')
)


def slow_four_bar():
    """Return the tables of the slow four-bar."""
    return dict(parse_toml(SLOW))


def outcome_of(value, error, bound, least):
    """Return the outcome of a limit, computed independently."""
    room = value - bound if least else bound - value
    return "too close to decide" if abs(room) < error else "kept" if room >= 0 else "not kept"


@pytest.mark.parametrize("share", in_tiers([1 - 1e-9, 0.3, 3.0], 0, 2))
def test_a_limit_by_the_name_of_any_figure_is_judged_alike_at_every_door(share):
    """In report, chunks, notebook, design, sweep, optimum and editor; with the error of the figure."""
    tables = slow_four_bar()
    scene = scene_from_dict(tables)
    plain = full_answer(scene, [Limit(name, 0.0) for name in GENERAL]).judgements
    limits = {}
    for number, (name, each) in enumerate(zip(GENERAL, plain, strict=True)):
        unit = design_measures(scene, output_of(scene))[name].unit
        limits[name] = {("most", "least")[number % 2]: f"{share * each.value!r} {unit}"}
    tables["limits"] = {"figures": limits}
    reported = check_doors(tables)
    rows = reported["acceptance"]["limits"]
    expected = [
        outcome_of(each.value, each.error, share * each.value, number % 2 == 1) for number, each in enumerate(plain)
    ]
    assert [row["outcome"] for row in rows] == expected
    assert ("too close to decide" in expected) == (share == 1 - 1e-9)
    assert [f"{row['kind']}.{row['on']}".rstrip(".") for row in rows] == [*GENERAL]
    assert report(scene_from_dict(tables)).figures["acceptance"]["limits"] == rows
    keys = "\n".join(
        f"{name!r} = {{ {key} = {value!r} }}" for name, row in limits.items() for key, value in row.items()
    )
    quick, _ = quick_answer(f"{SLOW}\n[limits.figures]\n{keys}")
    assert Counter(row["kept"] for row in quick["picture"]["limits"]) == Counter(row["kept"] for row in rows)
    tables["optimize"] = {"minimize": "mass", "variables": {"sections.bar.depth": ["3 mm", "9 mm"]}}
    judged = full_answer(scene_from_dict(tables), problem_of(tables).task.limits).judgements
    assert [each.outcome for each in judged[: len(expected)]] == expected
    assert all(each.limit.figure.startswith("safety.") for each in judged[len(expected) :])


@pytest.mark.parametrize("share", in_tiers([0.3, 3.0], 0, 1))
def test_a_limit_by_the_name_of_a_figure_is_judged_at_a_speed_as_by_its_report(share):
    tables = slow_four_bar()
    tables["run"] |= {"positions": 720, "theory": "elastodynamic"}
    figures = summary_of(tables)["figures"]
    for name in ("drive_power", "shaking_force"):
        tables["limits"] = {"figures": {name: allowed(figures[name], share)}}
        found = speeds(scene_from_dict(tables), (10.0, 20.0, 2))
        assert found.verdicts[-1] == summary_of(tables)["acceptance"]["verdict"]
        assert (found.highest == 20.0) == (share > 1) == (found.limit is None)


def test_a_speed_at_which_a_link_yields_is_not_acceptable_though_its_limits_hold():
    """The limit speed is that at which a link yields, and sentences say so."""
    tables = slow_four_bar()
    tables["run"] |= {"positions": 360, "theory": "elastodynamic"}
    tables["materials"]["steel"]["yield"] = allowed(summary_of(tables)["figures"]["stress"], 0.8)
    tables["limits"] = {"deflection": "1 m"}
    found, reported = speeds(scene_from_dict(tables), (10.0, 20.0, 2)), summary_of(tables)
    assert found.verdicts[-1] == reported["acceptance"]["verdict"] == "cannot be judged"
    assert reported["yields"] in reported["acceptance"]["problem"]
    assert found.verdicts[0] == "acceptable"
    assert found.limit.limit is STRENGTH
    assert 10.0 < found.highest < found.limit.above == found.yielding[0] < 20.0
    limits, yields = speed_figures(found, scene_from_dict(tables))["words"][:2]
    assert limits.endswith(" yields)")
    assert yields.startswith("a link yields at")
    assert yields.endswith(" cannot be judged")


@pytest.mark.parametrize("paths", [[], ["sections.bar.depth"]])
def test_designs_are_computed_beside_breaks_of_the_laws_too(paths):
    """No position is at a jump in the acceleration, and the report's largest figures are beside one."""
    path = Path(__file__).parent / "data" / "cases" / "acceleration_jump.toml"
    tables = parse_toml(path.read_text(encoding="utf-8"))
    tables["run"]["positions"] = 61
    reported = summary(computed(scene_from_dict(tables), Request(theory="quasi-static")))["figures"]
    names = ["deflection", "stress", "joint_force", "drive_effort"]
    row = evaluate(tables, paths, [[0.007][: len(paths)]], names)
    for name in names:
        assert row.columns[name][0] == pytest.approx(abs(reported[name]["value"]), rel=1e-9), name


def test_all_limits_of_unknown_figures_are_reported_at_once():
    tables = {**slow_four_bar(), "limits": {"figures": {"joint_forc.B": "2 N", "mass": "2 N", "bearing_life": "2 h"}}}
    with pytest.raises(SceneError) as error:
        evaluate(tables, [], np.zeros((1, 0)))
    words = str(error.value).splitlines()
    assert 'did you mean "joint_force.B"' in words[0]
    assert "in kg" in words[1]
    assert "rolling bearing" in words[2]


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ('deflection = {most = "1 mm", least = "2 mm"}', "no value meets both limits: least is above most"),
        ('"joint_force.B" = "-1 kN"', "the limit is negative, but the figure is the largest magnitude"),
        ('drive_effort = {least = "-5 N m"}', "the limit is negative, but the figure is the largest magnitude"),
        ("safety = 2", "write { least = 2 } for a lower limit, or { most = 2 } for an upper limit"),
        ('frequency = "9 rpm"', 'write { least = "9 rpm" }'),
    ],
)
@pytest.mark.parametrize("table", ["limits.figures", "optimize.limits"])
def test_limits_that_nobody_means_are_refused(table, limit, words):
    goal = '[optimize]\nminimize = "mass"\n[optimize.variables]\n"sections.bar.depth" = ["3 mm", "9 mm"]\n'
    text = f"{SLOW}\n{goal}[{table}]\n{limit}"
    document = document_from_text(text)
    with pytest.raises(SceneError, match=re.escape(words)) as error:
        limits_of(document.scene) if table == "limits.figures" else problem_of(document)
    assert (error.value.table, error.value.key) == (table, '"' + limit.split(" =")[0].strip('"') + '"')


def test_registered_figures_are_of_every_item():
    scene = scene_from_dict(SHIPPED[0])
    names = design_measures(scene, output_of(scene))
    assert {"deflection.crank", "joint_force.A", "displacement.B", "angle_error.rocker", "buckling"} <= set(names)


def test_limits_of_a_guessed_output_are_those_of_designs_too():
    """For each figure of the output."""
    limits = 'residual = "1 mm"\nsettling = "1 s"'
    arm = Path(__file__).parents[1] / "docs" / "gallery" / "pick_and_place_arm.toml"
    text = re.sub(r'output = "T"|\[limits\][^\[]*', "", arm.read_text(encoding="utf-8"))
    document = document_from_text(f"{text}\n[limits]\n{limits}", "arm")
    results = computed(document.scene, Request(theory="quasi-static"))
    reported = summary(results)["acceptance"]["limits"]
    designs = evaluate(document, [], np.zeros((1, 0)), ["limits_kept", *(limit["kind"] for limit in reported)])
    for limit in reported:
        assert designs.columns[limit["kind"]][0] == pytest.approx(limit["found"]["value"], rel=1e-12)
    assert designs.columns["limits_kept"][0] == 1.0
