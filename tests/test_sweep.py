"""Sweeps: designs of a plan by number, the command, and the page on designs."""

import csv
import json
import re
import tomllib
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tiers import in_tiers

from kinelast import SceneError, scene_from_dict, shipped_scenes
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.designs.evaluate import Evaluation
from kinelast.designs.plan import plan_of
from kinelast.reports.full_answer import FullAnswer
from kinelast.reports.limits import KEPT, SEVERITY, Judgement, outcome_index
from kinelast.reports.summary import summary as summary_of
from kinelast.runs import computed
from kinelast.scene.document import document_from_dict, document_of
from kinelast.scene.parsing import parse_toml
from kinelast.scene.text import file_text
from kinelast.sweep.tally import Aim, FullAnswers, Rows, tallied
from kinelast.tasks.progress import SILENT
from kinelast.tasks.request import Request

STEEL = parse_toml(file_text(shipped_scenes()["steel_four_bar"]))
DEPTH, SPEED, ACROSS = "sections.bar.depth", "drives.crank.speed", "points.D.x"
PAGE = (Path(__file__).parents[1] / "docs" / "designs.md").read_text(encoding="utf-8")


def plan(folder=Path(), **sweep):
    return plan_of({**STEEL, "sweep": sweep}, folder)


def test_a_grid_has_all_combinations_and_the_last_number_varies_fastest():
    found = plan(vary={DEPTH: {"from": "3 mm", "to": "6 mm", "count": 4}, SPEED: [50, "1000 rpm"]})
    assert (found.count, found.paths, found.units) == (8, (DEPTH, SPEED), ("m", "rad/s"))
    expected = list(product([0.003, 0.004, 0.005, 0.006], [50, 100 * np.pi / 3]))
    np.testing.assert_allclose(found.values(0, 8), expected, rtol=1e-15)
    assert (found.values(3, 7) == found.values(0, 8)[3:7]).all()


@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_a_sample_covers_its_ranges_and_is_reproducible_by_number(method):
    ranges = {DEPTH: {"from": "3 mm", "to": "6 mm"}, ACROSS: {"from": 0.3, "to": 0.4}, SPEED: [50, 100]}
    found = plan(vary=ranges, method=method, samples=64, seed=5)
    values = found.values(0, 128)
    assert found.count == 128
    assert (found.values(70, 75) == values[70:75]).all()
    assert (values[:64, 1:] == values[64:, 1:]).all()
    assert set(values[:64, 0]) == {50.0}
    for column, low, high in ((1, 3e-3, 6e-3), (2, 0.3, 0.4)):  # one value in each 64th of the range
        cells = np.floor((values[:64, column] - low) / (high - low) * 64).astype(int)
        assert sorted(cells) == list(range(64))
    other = plan(vary=ranges, method=method, samples=64, seed=6).values(0, 64)
    assert not (other == values[:64]).all()


def test_a_table_is_read_with_units(tmp_path):
    (tmp_path / "designs.csv").write_text(f"{DEPTH} [mm],drives[1].speed,{ACROSS}\n3,100,0.35\n4,1000 rpm,36 cm\n")
    found = plan(tmp_path, table="designs.csv", vary={"points.A.x": [0.1, 0.11]})
    assert found.paths == (DEPTH, "drives[1].speed", ACROSS, "points.A.x")
    expected = [[0.003, 100, 0.35, 0.1], [0.003, 100, 0.35, 0.11], [0.004, 100 * np.pi / 3, 0.36, 0.1]]
    np.testing.assert_allclose(found.values(0, 3), expected, rtol=1e-15)


RANGE, OPEN = {"from": "3 mm", "to": "6 mm", "count": 4}, {"from": 1, "to": 2}


@pytest.mark.parametrize(
    ("sweep", "words"),
    [
        ({}, "[sweep] vary: no number is varied: expected as in"),
        ({"vary": {"sections.bar.dept": RANGE}}, 'no such number in the scene; did you mean "sections.bar.depth"?'),
        ({"vary": {DEPTH: {**RANGE, "from": "9 mm"}}}, "reversed: from 0.009 to 0.006 m, expected"),
        ({"vary": {DEPTH: {**RANGE, "to": "6 kg"}}}, 'expected a length, as in "100 mm" or 0.1, got "6 kg"'),
        ({"vary": {DEPTH: {**RANGE, "from": "-3 mm"}}}, f"[sweep] vary {DEPTH}: expected a length"),
        ({"vary": {DEPTH: OPEN}}, "the key is missing: give count"),
        ({"vary": {DEPTH: {**RANGE, "cout": 3}}}, 'there is no such key; did you mean "count"?'),
        ({"vary": {DEPTH: RANGE}, "samples": 4}, "[sweep] samples: belongs to the methods"),
        (
            {"vary": {DEPTH: RANGE}, "method": "sobol", "samples": 4},
            "sobol samples ranges without a count, but all ranges have one",
        ),
        (
            {"vary": {DEPTH: {"from": 1, "to": 2}}, "method": "sobol"},
            "the key is missing: give the number of designs for sobol",
        ),
        (
            {"vary": {DEPTH: {"from": 1, "to": 2}}, "method": "sobol", "samples": 2**31},
            "sobol allows at most 1073741824",
        ),
        ({"vary": {DEPTH: RANGE}, "method": "latin"}, "expected one of grid, latin-hypercube, sobol"),
        ({"vary": {SPEED: [1.0], "drives[1].speed": [2.0]}}, "the number is varied twice"),
        ({"vary": {DEPTH: {**RANGE, "count": 10**10}, ACROSS: {**RANGE, "count": 10**10}}}, "designs are too many"),
        ({"table": "none.csv"}, 'there is no file "none.csv" in the folder of the scene'),
        ({"table": "empty.csv"}, "empty.csv contains no design"),
        ({"table": "short.csv"}, "short.csv: row 2 has 1 cells, expected 2"),
    ],
)
def test_an_impossible_sweep_is_an_error(tmp_path, sweep, words):
    (tmp_path / "empty.csv").write_text("sections.bar.depth\n")
    (tmp_path / "short.csv").write_text("sections.bar.depth,points.D.x\n0.003\n")
    with pytest.raises(SceneError, match=re.escape(words)):
        plan(tmp_path, **sweep)


def swept(folder, text, *options):
    path = folder / "bars.toml"
    steel = shipped_scenes()["steel_four_bar"].read_text(encoding="utf-8").replace("positions = 360", "positions = 12")
    path.write_text(steel + text, encoding="utf-8")
    return main([str(path), "-o", str(folder / "out"), *options])


SWEEP = """
[limits]
safety = 1.5
[sweep]
figures = ["mass", "deflection.rocker"]
smallest = "deflection.rocker"
[sweep.vary]
"sections.bar.depth" = {from = "4 mm", to = "9 mm", count = 6}
"links.crank.length" = ["100 mm", "260 mm"]
"""


@pytest.mark.slow
def test_the_command_writes_a_row_per_design_and_reports_the_best(tmp_path, capsys):
    assert swept(tmp_path, SWEEP, "--sweep", "--pages", "0") == 0
    line, message = capsys.readouterr()
    assert message == "bars: the designs are computed without vibration, regardless of theory and accuracy\n"
    with (tmp_path / "out" / "bars" / "designs.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head == [
        "design", "sections.bar.depth [m]", "links.crank.length [m]", "mass [kg]", "deflection.rocker [m]",
        "limits_kept [1]", "limits_margin [1]", "deflection.rocker in full [m]", "deflection.rocker error [m]",
        "theory", "verdict", "reason",
    ]  # fmt: skip
    assert len(rows) == 12
    best = min((row for row in rows if row[5] == "1.0"), key=lambda row: float(row[4]))
    summary = json.loads((tmp_path / "out" / "bars" / "sweep.json").read_text())
    assert summary["best_design"] == int(best[0])
    assert summary["acceptance"]["verdict"] == "acceptable"
    assert {each["design"]: each["passed"] for each in summary["answered"]}[int(best[0])] is True
    kept = sum(row[5] == "1.0" for row in rows)
    assert f"bars: 12 designs; {kept} meet all limits, ignoring vibration and error; smallest deflection.rocker" in line
    assert f"no. {best[0]} (sections.bar.depth" in line
    assert "6 without figures: ...% of the positions are out of reach" in line
    assert [bool(row[-1]) for row in rows] == [False, True] * 6
    assert summary["without_figures"] == 6

    assert swept(tmp_path, SWEEP, "--design", best[0]) == 0
    one = parse_toml(file_text(tmp_path / "out" / "bars_design_10.toml"))
    in_full = summary_of(computed(scene_from_dict(one), Request()))
    expected = in_full["figures"]["deflection"]["value"], in_full["peaks"]["rocker"]["w"]
    assert in_full["theory"]["name"] != "quasi-static"
    assert [float(cell) for cell in rows[10][7:9]] == pytest.approx(
        [abs(expected[1]["value"]), expected[1]["error"]], rel=1e-6
    )
    assert rows[10][9:11] == [in_full["theory"]["name"], "acceptable"]
    others = [row for row in rows if row[9] == "quasi-static"]
    assert [row[7:11] for row in others] == [["", "", "quasi-static", ""]] * (6 - len(summary["answered"]))
    assert [row[9] for row in rows[1::2]] == [""] * 6
    assert document_of(one).value(DEPTH, one["sections"]["bar"]["depth"]) == float(best[1])
    results = computed(scene_from_dict(one), Request(theory="quasi-static"))
    assert abs(results.figures.of_field("w")[2].value) == pytest.approx(float(best[4]), rel=1e-11)
    assert swept(tmp_path, SWEEP, "--design", "12") == 2
    assert "there is no design 12, the last design of the sweep is 11" in capsys.readouterr().err


def answered_by(monkeypatch, limits, aim, change):
    """Return the tally of 40 designs whose full answers scale their figures and have errors of 1 %."""
    depths = np.linspace(4e-3, 12e-3, 40)
    vary = {DEPTH: [*map(float, depths)]}
    tables = {**STEEL, "run": {**STEEL["run"], "positions": 12}, "limits": limits, "sweep": {"vary": vary}}
    document = document_from_dict(tables)
    rigidities = np.array([document.with_values({DEPTH: depth}).scene.sections[0].EA for depth in depths])

    def full(scene, limits, names):
        number = int(np.abs(rigidities - scene.sections[0].EA).argmin())
        names = dict.fromkeys([*(limit.figure for limit in limits), *names])
        columns = evaluate(document, [DEPTH], depths[[number], None], [*names]).columns
        reported = {name: (factor := change(number) * float(columns[name][0]), 0.01 * factor) for name in names}
        outcomes = [SEVERITY[int(outcome_index(limit, *reported[limit.figure]))] for limit in limits]
        judged = (
            Judgement(limit, each, 0, *reported[limit.figure], "") for limit, each in zip(limits, outcomes, strict=True)
        )
        return FullAnswer("elastodynamic", tuple(judged), reported)

    monkeypatch.setattr("kinelast.sweep.tally.full_answer", full)
    kept = ["limits_kept", "limits_margin"] if limits else []
    rows = Rows(Evaluation(document, plan_of(tables), ("mass", "deflection", *kept)))
    columns, reasons = rows(0, 40)
    tally = tallied(rows.stored([({"design": np.arange(40.0), **columns}, reasons)]), aim, keep=False)
    FullAnswers(rows, tally, SILENT)()
    return tally, evaluate(document, [DEPTH], depths[:, None], ["deflection"]).columns["deflection"]


@pytest.mark.parametrize("factor", in_tiers([0.7, 1.0, 1.5], 1, 2))
def test_full_answers_decide_on_the_best_design(factor, monkeypatch):
    """This includes limits that only the full answer keeps."""
    bound = 0.5e-3
    tally, deflection = answered_by(monkeypatch, {"deflection": bound}, Aim("mass", False), lambda _: factor)
    assert deflection.min() < bound / 1.515 < bound / 0.707 < deflection.max()
    best = int(np.flatnonzero(1.01 * factor * deflection <= bound)[0])  # the lightest
    assert tally.best["design"] == best
    assert tally.answered[best].judgements[0].outcome == KEPT
    assert tally.accepted.verdict == "acceptable"
    changed = (deflection <= bound) != (1.01 * factor * deflection <= bound)
    assert tally.near == np.count_nonzero(changed) - sum(changed[number] for number in tally.answered)
    assert len(tally.answered) <= 8 + 4


def test_full_answers_decide_on_the_best_design_without_limits(monkeypatch):
    """The design with the smallest quasi-static deflection vibrates most, so the next designs get full answers."""
    aim = Aim("deflection", False)
    tally, deflection = answered_by(monkeypatch, {}, aim, lambda number: 1.3 if number == 39 else 1.05)
    assert deflection.argmin() == 39
    assert [*tally.answered] == [39, 38]
    assert tally.best["design"] == 38
    tally, _ = answered_by(monkeypatch, {}, aim, lambda _: 1.0)
    assert tally.best["design"] == 39
    tally, _ = answered_by(monkeypatch, {}, Aim("mass", False), lambda _: 1.3)
    assert [*tally.answered] == [0]


@pytest.mark.slow
def test_only_the_same_sweep_is_resumed(tmp_path, capsys):
    assert swept(tmp_path, SWEEP, "--sweep", "--quiet") == 0
    before = (tmp_path / "out" / "bars" / "designs.csv").read_bytes()
    assert swept(tmp_path, SWEEP, "--sweep", "--resume") == 0
    assert (tmp_path / "out" / "bars" / "designs.csv").read_bytes() == before
    assert swept(tmp_path, SWEEP.replace("260 mm", "261 mm"), "--sweep", "--resume") == 2
    assert "another sweep" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    in_tiers(
        [
            ("count = 6", "count = 1_000_000_000_000", "2e+12 designs would take about"),
            ('"mass", ', '"mas", ', '[sweep] figures: there is no figure "mas"; did you mean "mass"?'),
            ('smallest = "def', 'largest = "mass"\nsmallest = "def', "give either smallest or largest"),
            (
                "sections.bar.depth",
                "sections.bar.dept",
                "bars.toml: sections.bar.dept: there is no such number in the scene; did",
            ),
            ("[sweep", "[sweeep", "bars.toml: sweeep: there is no such table or key"),
        ],
        1,
        4,
    ),
)
def test_invalid_sweeps_are_rejected_before_they_start(tmp_path, capsys, old, new, words):
    assert swept(tmp_path, SWEEP.replace(old, new), "--sweep") == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out" / "bars" / "designs.csv").exists()


@pytest.mark.slow
def test_the_three_steps_on_the_page_of_designs(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    steps = re.findall(r"^\$ deflection-report (.*)\n(.*)$", PAGE, re.MULTILINE)
    assert len(steps) == 3
    for command, line in steps:
        assert main(command.split()) == 0
        assert capsys.readouterr().out.splitlines()[-1].startswith(line)
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    assert tomllib.loads(example)["sweep"] == parse_toml(file_text(shipped_scenes()["press_sweep"]))["sweep"]


def test_the_page_of_designs_lists_all_figures():
    listed = re.search(r"These \*\*figures\*\* exist: (.*?)\n\n", PAGE, re.DOTALL)[1]
    names = re.findall(r"`([\w.]+)`", listed)
    tables = parse_toml(file_text(shipped_scenes()["press_sweep"]))
    tables["run"]["output"] = "B"
    tables["joints"] = {"A": {"friction": 0.1, "radius": "5 mm"}}
    found = evaluate(tables, ["sections.web.depth"], [[0.01]], names)
    assert len(names) == 32
    assert np.isfinite([float(column[0]) for column in found.columns.values()]).all()
