"""Limits and outputs: verdicts, answers of the command, and the links that cause the output error."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from msgspec.structs import replace
from tiers import in_tiers

import kinelast.scene
from elastic import RIGID, deflection, displacement_of
from elastic.assessment import angle_error
from kinelast.answers.results import Results
from kinelast.cli.command import main
from kinelast.figures.cycle import EXTREME_FIELDS
from kinelast.outputs.page.data import BUDGET, kept_positions, numbers_of
from kinelast.outputs.table import Column, Table, csv_bytes
from kinelast.reports.summary import angle_figures, output_reading, point_figures, report_of
from kinelast.runs import computed
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes
from kinelast.values.error import SceneError
from kinelast.values.reading import Reader

STEEL = shipped_scenes()["steel_four_bar"].read_text().replace("accuracy", "# accuracy")
SLOW = STEEL.replace('speed = "100 rad/s"', 'speed = "10 rad/s"')  # vibration is a fraction of a per cent
EASY = STEEL.replace('speed = "100 rad/s"', 'speed = "30 rad/s"')  # vibration is about one per cent


def answer(tmp_path, capsys, more, text=SLOW):
    """Return exit status, output and summary of the slow steel four-bar with further tables, without vibration."""
    (tmp_path / "one.toml").write_text(text + more)
    plain = ["--theory", "quasi-static"]
    status = main([str(tmp_path / "one.toml"), "--positions", "36", *plain, "-o", str(tmp_path / "out")])
    output = capsys.readouterr()
    summary = tmp_path / "out" / "one" / "summary.json"
    return status, output.out + output.err, json.loads(summary.read_text()) if summary.exists() else None


@pytest.mark.parametrize(
    ("limits", "kept"),
    in_tiers(
        [
            ('deflection = "12 um"', True),  # the crank has 11.58 um
            ('deflection = "11 um"', False),
            ('chord = "10 um"', True),  # the coupler has 9.22 um
            ('chord = "9 um"', False),
            ("safety = 150", True),  # the crank has 160
            ("safety = 170", False),
            ('output = "0.006 deg"', True),  # the rocker has 0.0051 deg
            ('output = "0.0045 deg"', False),
            ('deflection = "12 um"\nchord = "9 um"', False),
            ('[limits.links.crank]\nchord = "2.5 um"', True),  # it has 2.23 um
            ('[limits.links.coupler]\nchord = "2.5 um"', False),
            ("[limits.links.coupler]\nsafety = 500", True),  # it has 570
            ("[limits.links.crank]\nsafety = 500", False),
        ],
        5,
        8,
    ),
)
def test_exit_status_and_verdict_follow_the_limits(limits, kept, tmp_path, capsys):
    status, output, summary = answer(tmp_path, capsys, f"\n[limits]\n{limits}\n")
    assert status == (0 if kept else 1)
    assert ("NOT ACCEPTABLE" in output) == (not kept)
    assert (": acceptable" in output) == kept
    assert summary["acceptance"]["passed"] is kept


RUBBING = """
[joints.B]
friction = 0.0001
radius = "5 mm"
"""
UNSTABLE = STEEL.replace('speed = "100 rad/s"', 'speed = "460 rad/s"').replace(
    "positions = 360", "positions = 360\ndamping_ratio = 0.005"
)


STICKING = STEEL + RUBBING.replace("0.0001", "0.9").replace("5 mm", "150 mm")


@pytest.mark.slow
def test_a_little_friction_does_not_change_the_verdict(tmp_path, capsys):
    """The quasi-static deflection alone would keep the limit."""
    deflections = []
    for number, friction in enumerate(("", RUBBING)):
        path = tmp_path / f"{number}.toml"
        path.write_text(f'{STEEL}{friction}\n[limits]\ndeflection = "1.3 mm"\n')
        assert main([str(path), "-o", str(tmp_path / "out")]) == 1
        assert "NOT ACCEPTABLE" in capsys.readouterr().out
        figures = json.loads((tmp_path / "out" / str(number) / "summary.json").read_text())
        deflections.append(figures["acceptance"]["limits"][0]["found"]["value"])
    assert deflections[1] == pytest.approx(deflections[0], rel=1e-3)


@pytest.mark.parametrize(
    ("text", "reason"),
    in_tiers(
        [(UNSTABLE, "unstable at 460 rad/s"), (STICKING, "the iteration for sticking friction does not converge")], 1, 1
    ),
)
def test_figures_of_unknown_error_cannot_be_judged(text, reason, tmp_path, capsys):
    (tmp_path / "one.toml").write_text(text + '\n[limits]\ndeflection = "1 m"\n')
    assert main([str(tmp_path / "one.toml"), "-o", str(tmp_path / "out")]) == 1
    output = capsys.readouterr().out
    assert "CANNOT BE JUDGED: " in output
    assert reason in output
    acceptance = json.loads((tmp_path / "out" / "one" / "summary.json").read_text())["acceptance"]
    assert acceptance["passed"] is None
    assert reason in acceptance["problem"]
    assert (acceptance["limits"][0]["passed"], acceptance["limits"][0]["kept"]) == (None, True)


@pytest.mark.parametrize(
    ("bound", "verdict", "status"),
    in_tiers(
        [
            ("0.1 mm", "not acceptable", 1),
            ("0.104 mm", "too close to decide", 1),
            ("0.1055 mm", "too close to decide", 1),
            ("0.11 mm", "acceptable", 0),
        ],
        2,
        2,
    ),
)
def test_a_limit_within_the_error_is_too_close_to_decide(bound, verdict, status, tmp_path, capsys):
    """At 30 rad/s the deflection of the crank is 104.5 um without vibration and 105.8 um with vibration."""
    (tmp_path / "one.toml").write_text(EASY + f'\n[limits]\ndeflection = "{bound}"\n')
    assert main([str(tmp_path / "one.toml"), "-o", str(tmp_path / "out")]) == status
    output = capsys.readouterr().out
    acceptance = json.loads((tmp_path / "out" / "one" / "summary.json").read_text())["acceptance"]
    assert (acceptance["verdict"], acceptance["passed"]) == (
        verdict,
        {0: True}.get(status, None if "close" in verdict else False),
    )
    assert (f": {verdict.upper()}: deflection of crank 104.5 µm ± 1.3 % (limit " in output) == bool(status)
    assert ("mostly vibration: accuracy =" in output) == ("close" in verdict)


@pytest.mark.parametrize(("errors", "verdict"), [(0.5, "cannot be judged"), (2.0, "acceptable")])
def test_limits_cannot_be_judged_if_a_link_may_yield_within_the_error_of_its_stress(errors, verdict):
    few = EASY.replace("positions = 360", "positions = 9") + '[limits]\ndeflection = "1 m"\n'
    stress = max(computed(scene_from_text(few), Request()).figures.peaks["stress"], key=lambda peak: peak.value)
    assert stress.error_size > 1e-4 * stress.value
    strength = stress.value + errors * stress.error_size
    report = report_of(computed(scene_from_text(re.sub("yield = .*", f"yield = {strength}", few)), Request()))
    assert report.acceptance.verdict == verdict
    assert report.acceptance.problem == (
        "" if verdict == "acceptable" else "crank may yield: the stress with its error exceeds the yield strength"
    )


def test_the_headline_names_the_most_exceeded_limits(tmp_path, capsys):
    scene = tmp_path / "one.toml"
    scene.write_text(f'{EASY}\n[limits]\ndeflection = "1 um"\nsafety = 1e6\nchord = "1 um"\noutput = "0.001 deg"\n')
    assert main([str(scene), "-o", str(tmp_path / "out")]) == 1
    (line,) = capsys.readouterr().out.splitlines()
    named = "NOT ACCEPTABLE: safety of .*minimum 1000000.*, .* of .*limit 1 µm.*, .* and 1 more of 4 limits;"
    assert re.search(named, line)


def test_the_advised_accuracy_decides(tmp_path, capsys):
    (tmp_path / "one.toml").write_text(EASY + '\n[limits]\ndeflection = "0.1055 mm"\n')
    assert main([str(tmp_path / "one.toml"), "-o", str(tmp_path / "out")]) == 1
    accuracy = re.search(r'accuracy = "([^"]+)" would suffice', capsys.readouterr().out).group(1)
    assert main([str(tmp_path / "one.toml"), "-o", str(tmp_path / "out"), "--accuracy", accuracy]) == 1
    assert ": NOT ACCEPTABLE: deflection of crank 105.8 µm" in capsys.readouterr().out


def test_every_figure_of_the_summary_has_an_error_in_its_unit(tmp_path, capsys):
    _, _, summary = answer(tmp_path, capsys, '\n[limits]\ndeflection = "1 m"\n')
    for key, figure in summary["figures"].items():
        assert figure["error"] is not None, key
        base = {"drive_mean": "drive_effort", "drive_mean_power": "drive_power"}.get(key, key)  # the mean is zero
        # the discretization error of a small displacement is relative to the largest displacement
        least = 2e-5 * summary["figures"]["displacement"]["value"] if figure["unit"] == "m" else 1e-12
        assert 0.0 <= figure["error"] < 0.05 * abs(summary["figures"][base]["value"]) + least, key


@pytest.mark.slow
def test_the_reported_stability_limit_is_right():
    """Separate runs at the requested speed and on both sides of the reported limit."""
    output = computed(scene_from_text(UNSTABLE), Request()).instability
    grows, border = (float(part.split()[0]) for part in re.findall(r"(?:by|below) ([\d.]+ (?:%|rad/s))", output))
    growth = {}
    for speed in (460.0, 0.985 * border, 1.0005 * border):
        text = UNSTABLE.replace("460 rad/s", f"{speed} rad/s").replace("[run]", '[run]\ntheory = "elastodynamic"')
        answer = computed(scene_from_text(text), Request()).answer
        growth[speed] = answer.vibrating.growth
    accuracy, below, above = growth.values()
    assert below < 1 < above
    assert 100 * (accuracy - 1) == pytest.approx(grows, rel=0.2)  # a coarser discretization by default


@pytest.mark.slow
def test_an_unknown_error_is_reported_without_limits(tmp_path, capsys):
    (tmp_path / "one.toml").write_text(STICKING)
    assert main([str(tmp_path / "one.toml"), "-o", str(tmp_path / "out")]) == 0
    assert (
        "quasi-static, error unknown: vibration cannot be solved: the iteration for sticking friction does not converge"
        in capsys.readouterr().out
    )


def test_without_limits_there_is_no_verdict(tmp_path, capsys):
    status, output, summary = answer(tmp_path, capsys, "")
    assert status == 0
    assert "cceptable" not in output
    assert summary["acceptance"] == {"verdict": "", "passed": None, "problem": "", "limits": []}


def test_a_limit_that_cannot_be_judged_is_not_kept(tmp_path, capsys):
    text = "\n".join(line for line in SLOW.splitlines() if not line.startswith("yield"))
    status, output, _ = answer(tmp_path, capsys, "\n[limits]\nsafety = 1.5\n", text)
    assert status == 1
    assert "CANNOT BE JUDGED: safety: the figure is unknown" in output


def test_a_resumed_run_reports_a_failed_limit_again(tmp_path, capsys):
    answer(tmp_path, capsys, '\n[limits]\nchord = "9 um"\n')
    assert main([str(tmp_path / "one.toml"), "--positions", "36", "--resume", "-o", str(tmp_path / "out")]) == 1


def with_output(words, limits=""):
    return (
        STEEL.replace("[run]\n", f'[run]\noutput = "{words}"\n') + limits
        if "[run]" in STEEL
        else (f'{STEEL}\n[run]\noutput = "{words}"\n{limits}')
    )


@pytest.mark.parametrize(("words", "kind", "name"), [("A", "point", "A"), ("coupler.angle", "angle", "coupler")])
def test_the_output_is_that_of_the_scene(words, kind, name):
    scene = scene_from_text(with_output(words))
    results = Results(scene, deflection(scene_motion(scene, 36), scene.sections))
    points, angles = point_figures(Reader(results)), angle_figures(Reader(results))
    found = output_reading(Reader(results))
    assert (found.kind, found.name, found.guessed) == (kind, name, False)
    expected = points["A"]["displacement"] if kind == "point" else angles["coupler"]
    assert found.value == expected.value


@pytest.mark.parametrize(
    ("words", "limits", "output"),
    [
        ("C", "", '[run] output: there is no point "C" that moves'),
        ("O", "", 'there is no point "O" that moves'),
        ("roker.angle", "", 'there is no moving link "roker"; did you mean "rocker"?'),
        ("ground.angle", "", 'there is no moving link "ground"'),
        ("rocker.angle", '[limits]\noutput = "1 mm"\n', "[limits] output: expected an angle"),
        ("A", '[limits]\noutput = "1 deg"\n', "[limits] output: expected a length"),
        ("A", "[limits]\noutput = -1\n", "greater than zero"),
        ("A", "[limits]\nsafety = 0\n", "[limits] safety"),
        ("A", '[limits]\ndeflexion = "1 mm"\n', 'there is no such key; did you mean "deflection"?'),
        ("A", '[limits.links.krank]\nchord = "1 mm"\n', 'there is no link with beams "krank"; did you mean "crank"?'),
    ],
)
def test_mistakes_in_limits_and_outputs(words, limits, output):
    with pytest.raises(SceneError) as error:
        scene_from_text(with_output(words, limits))
    assert output in str(error.value)


def without_strain(added):
    """Return added loads without their strain, which no link causes. The ends of rotated beams come closer."""
    return added and replace(added, strain=None)


def check_shares(results, course):
    """Compare each share with the error if all other links are rigid. Statics alone gives the forces."""
    scene, bent = results.scene, results.deflection
    output = output_reading(Reader(results))
    shares = {row.link: row.value for row in output.shares}
    assert sum(shares.values()) == pytest.approx(output.value, rel=1e-9)
    shares.pop("others", None)
    at = int(np.argmin(np.abs(course.time - output.time.value)))

    def error(solved):
        if output.kind == "angle":
            return angle_error(solved, output.name, output.point)[at]
        owner = next(link.name for link in scene.mechanism.links[1:] if output.name in link.points)
        return displacement_of(solved, owner, output.name)[at]

    whole = error(bent)
    for link, share in shares.items():
        own = [
            section if scene.mechanism.links[number].name == link else replace(RIGID, area=section.area)
            for (number, _), section in zip(scene.mechanism.beams, scene.sections, strict=True)
        ]
        alone = error(deflection(course, own, added=without_strain(bent.added)))
        along = alone if output.kind == "angle" else (alone * np.conj(whole) / abs(whole)).real
        assert share == pytest.approx(along, rel=1e-8, abs=1e-10 * abs(output.value))


MECHANISMS = "steel_four_bar", "quick_return", "flapping_wing", "offset_slider_crank"


@pytest.mark.parametrize("name", in_tiers(MECHANISMS, 2, 2))
def test_shares_equal_the_error_of_each_link_alone(name):
    scene = scene_from_text(shipped_scenes()[name].read_text())
    course = scene_motion(scene, 36)
    check_shares(Results(scene, deflection(course, scene.sections)), course)


@pytest.mark.parametrize("name", ["steel_four_bar", "offset_slider_crank"])
def test_shares_of_vibrating_links(name):
    """The forces at that instant include those of the vibration."""
    scene = scene_from_text(shipped_scenes()[name].read_text())
    results = computed(scene, Request(theory="elastodynamic"))
    check_shares(results, results.motion)


def test_shares_of_a_frame_with_rings_add_up():
    scene = scene_from_text(shipped_scenes()["flap_plates"].read_text())
    results = Results(scene, deflection(scene_motion(scene, 24), scene.sections))
    output = output_reading(Reader(results))
    assert "others" not in {row.link for row in output.shares}
    assert sum(row.value for row in output.shares) == pytest.approx(output.value, rel=1e-9)


def test_thermal_strain_counts_as_others():
    """Shares belong to flexibility, so a warm coupler adds to "others"."""
    text = STEEL.replace("density = ", "expansion = 12e-6\ndensity = ", 1).replace(
        "[links.coupler]\n", "[links.coupler]\ntemperature = 40\n"
    )
    assert text.count("temperature") == 1
    scene = scene_from_text(text)
    results = Results(scene, deflection(scene_motion(scene, 36), scene.sections))
    output = output_reading(Reader(results))
    shares = {row.link: row.value for row in output.shares}
    cold = Results(scene, deflection(results.motion, [replace(section, strain=0.0) for section in scene.sections]))
    at = int(np.argmin(np.abs(results.motion.time - output.time.value)))
    warmth = output.value - angle_error(cold.deflection, output.name, output.point)[at]
    assert shares["others"] == pytest.approx(warmth, rel=1e-6)


def test_page_data_of_a_long_run_are_thinned_but_keep_peaks():
    scene = scene_from_text(STEEL)
    results = Results(scene, deflection(scene_motion(scene, 9000), scene.sections))
    kept = kept_positions(results)
    assert len(kept) < 9000
    assert len(numbers_of(results, kept).bytes()) < 1.05 * BUDGET
    times = set(results.motion.time[kept].tolist())
    assert all(peak.time in times for key in EXTREME_FIELDS for peak in results.figures.of_field(key))


def test_csv_numbers_are_read_back_exactly():
    numbers = np.array([[0.1, -1e-17, 3e300], [np.nan, 12345678.125, 5e-324]])
    for table in (numbers, np.where(np.isnan(numbers), np.inf, numbers)):
        rows = [
            line.split(",")
            for line in csv_bytes(Table(tuple(Column("", column) for column in table.T)), head=False)
            .decode()
            .splitlines()
        ]
        back = np.array([[float(cell or "nan") for cell in row] for row in rows])
        np.testing.assert_array_equal(back, table)


@pytest.mark.slow
def test_stills_are_drawn_on_request(tmp_path):
    accuracy = ["--stills", "--positions", "24", "--theory", "quasi-static", "--quiet"]
    assert main(["steel_four_bar", *accuracy, "-o", str(tmp_path)]) == 0
    stills = sorted((tmp_path / "steel_four_bar" / "stills").iterdir())
    assert {"mechanism.svg", "maps_1.svg", "joint_forces.svg"} <= {path.name for path in stills}
    for path in stills:
        assert ElementTree.parse(path).getroot().tag == "{http://www.w3.org/2000/svg}svg"


NEW_SCENE = (Path(kinelast.scene.__file__).parent / "first.toml").read_text()


def test_a_limit_equal_to_the_figure_up_to_round_off_is_kept(tmp_path, capsys):
    """300 rpm and a gear ratio of 10 give 3000 rpm, with an error of round-off alone."""
    motor = '[motors.servo]\ngear_ratio = 10\nrated_speed = "3000 rpm"\n'
    text = NEW_SCENE.replace('speed = "300 rpm"', 'speed = "300 rpm"\nmotor = "servo"').replace(
        "[run]", f"{motor}\n[run]"
    )
    (tmp_path / "press.toml").write_text(text)
    assert main([str(tmp_path / "press.toml"), "-o", str(tmp_path / "out")]) == 0
    assert "acceptable: mean motor speed" in capsys.readouterr().out
    [limit] = json.loads((tmp_path / "out" / "press" / "summary.json").read_text())["acceptance"]["limits"]
    assert limit["used"] == pytest.approx(1.0, abs=1e-9)


def test_a_limit_on_the_rest_needs_drives_that_stop():
    verdict = report_of(computed(scene_from_text(f'{SLOW}\n[limits]\nsettling = "1 s"'), Request())).acceptance
    assert (verdict.verdict, verdict.problem) == (
        "cannot be judged",
        "the figure needs a scene in which the drives stop",
    )


def test_a_web_that_yields_is_not_accepted():
    """The fibres have a safety of 1.15, and the end of the web 0.91, by EN 1993-1-1."""
    text = """
[sections.beam]
shape = "I"
depth = 0.1
width = 0.15
web = 0.002
flange = 0.01
[points]
A = [0, 0]
B = [1.2, 0]
[links.ground]
points = ["A"]
[links.beam]
points = ["A", "B"]
section = "beam"
material = "S235"
[[drives]]
link = "beam"
speed = 1e-6
[[loads]]
link = "beam"
point = "B"
force = [0, -21100]
axes = "turning"
[run]
positions = 4
[limits]
safety = 1
"""
    verdict = report_of(computed(scene_from_text(text), Request(theory="quasi-static"))).acceptance
    assert verdict.verdict == "cannot be judged"
    assert "may yield" in verdict.problem
