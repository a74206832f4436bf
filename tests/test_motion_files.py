"""A motion from a CSV file equals the same motion in the scene, and a run depends on the file."""

import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from browser import Page
from scene_texts import FOUR_BAR, edited

from exchange import columns_of
from kinelast import SceneError, answer, read_document, read_structure, scene_from_text
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.scene.data import scene_motion
from kinelast.scene.document import document_from_text
from kinelast.scene.drives import motion_table
from kinelast.scene.text import reader_in
from live.answer import quick_answer
from live.edit import edited as changed
from live.edit import start_of
from live.file import SceneFile
from live.full import whole_answer
from live.notebook import LiveView

OSCILLATING = edited(
    FOUR_BAR, ('speed = "100 rad/s"', 'motion = "lift.csv"\nrepeat = true'), ("positions = 36", "positions = 12")
)
LIFT = "time [ms];angle [deg]\n0;0\n250;10,5\n500;0\n750;-10,5\n1000;0\n"
WRITTEN = edited(OSCILLATING, ('"lift.csv"', '[[0, 0], ["0.25 s", "10.5 deg"], [0.5, 0], [0.75, "-10.5 deg"], [1, 0]]'))


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "lift.csv").write_text(LIFT)
    path = tmp_path / "arm.toml"
    path.write_text(OSCILLATING)
    return path


@pytest.mark.parametrize(
    "text",
    [
        LIFT,
        "time [ms],angle [deg]\n0,0\n250,10.5\n500,0\n750,-10.5\n1000,0",
        "t / s\tangle / deg\n0\t0\n0,25\t10,5\n0,5\t0\n0,75\t-10,5\n1\t0\n",
        "# measured\n# time (ms), angle (deg)\n0,0\n250,10.5\n500,0\n\n750,-10.5\n1000,0\n",
        "time,angle\nms,deg\n0,0\n250,10.5\n500,0,,\n750,-10.5\n1000,0\n,\n",
        "0,0\n0.25 s,10.5 deg\n0.5,0\n0.75,-10.5 deg\n1,0\n",
        "time [ms];angle [deg];comment\n0;0;\n250;10,5;top\n500;0\n750;-10,5;\n1000;0;\n",
        "Arm [test 3];;\ntime [ms], angle [deg]\n0;0;\n250;10,5;\n500;0;\n750;-10,5;\n1000;0;\n",
        "time;angle;note\n[ms];[deg];\n0;0;\n250;10,5\n500;0\n750;-10,5\n1000;0\n",
        '"Rocker, as drawn by hand"\n"time [min]","angle [turn]"\n0,0\n' + "".join(
            f"{t / 60!r},{v / 360!r}\n" for t, v in ((0.25, 10.5), (0.5, 0), (0.75, -10.5), (1, 0))),
    ],
)  # fmt: skip
def test_a_motion_file_equals_the_motion_in_the_scene(text):
    message = motion_table(text, "rad")
    assert message.times == pytest.approx([0, 0.25, 0.5, 0.75, 1], abs=1e-15)
    assert message.places == pytest.approx(np.radians([0, 10.5, 0, -10.5, 0]), abs=1e-15)


def test_lengths_without_unit_are_in_the_unit_of_the_scene():
    assert motion_table("0,0\n1,10\n2,5\n3,0\n", "m", 0.001).places == (0.0, 0.01, 0.005, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time [ms],angle [deg]\n0,0\n10,5\n20,x\n30,5", 'line 4: expected an angle, as in "30 deg" or 0.5, got "x"'),
        ("0,0\n1,1\n2,2", "expected at least 4 lines of numbers, got 3"),
        (
            "0 0\n1 1\n2 1\n3 3\n",
            "line 1: expected 2 columns, time and angle, got 1: put a comma, a semicolon or a tab",
        ),
        ("t,a,v\n0,0,0\n2,1,1\n3,2,1\n4,3,1", "line 2: expected 2 columns, time and angle, got 3: delete the others"),
        ("time [ms],angle [grad]\n0,0\n1,1\n2,2\n3,3", 'line 1: expected an angle.*there is no unit "grad"'),
        ("time [ms],way [mm]\n0,0\n1,1\n2,2\n3,3", 'line 1: expected an angle.*, got "1 mm"'),
        ("t,a\n1,0\n2,1\n3,2\n4,3", "line 2: expected times from 0, got 1.0: subtract it from all times"),
        ("t,a\n0,0\n2,1\n2,2\n4,3", "line 4: expected increasing times: remove the line"),
        ("t,a\n0,0\n1,nan\n2,2\n4,3", "line 3: expected an angle.*got nan: remove the line"),
        ("t;a\n0;0\n1;\n2;2\n4;3", "line 3: the angle is missing: write it, or leave the line out"),
        ("t;a\n0;0\n1;1\n;2\n4;3", "line 4: the time is missing"),
        ("t;a\n;5\n0;0\n1;1", "line 2: the time is missing"),
        (
            "No,time [s],angle [deg]\n0,0,0\n1,1,1",
            "line 2: expected 2 columns.*put them last with headings of their own and give units for the first",
        ),
        ("a, b, c, d\ntime [ms],angle [deg]\n0,0,0,5\n1,0,1,0", "line 3: expected 2 columns, time and angle, got 4"),
        ("angle [deg];time [ms];note\n0;0;", 'line 1: expected a time.*, got "1 deg"'),
        *(
            (f"{head}\n0;0\n1;1\n2;2\n3;3", f"line 1: .* seems to contain a unit.* for the {which}: .*as in .{which} ")
            for head, which in (
                ("time ms;angle deg", "time"),
                ("t_ms;phi_deg", "time"),
                ("time [s];angle in degrees", "angle"),
                ("time [s];angle deg;note", "angle"),
                ("time (ms) message;angle", "time"),
                ("ms;deg", "time"),
                ("time <ticks>;angle", "time"),
                ("# time ms, angle deg", "time"),
                ("time ms, angle deg", "time"),
            )
        ),
        ("t,a\n0,0\n1,1 deg\n2,2\n4,3 mm", 'line 5: expected an angle.*, got "3 mm"'),
        ('t,a\n0,"0\n', "line 2: expected 2 columns|expected at least 4 lines"),
        ("", "expected at least 4 lines of numbers, got 0"),
    ],
)
def test_the_message_names_the_line_of_the_file(tmp_path, text, message):
    (tmp_path / "lift.csv").write_text(text)
    with pytest.raises(SceneError, match=rf"arm.toml: \[\[drives\]\] no. 1 motion: lift.csv: ({message})"):
        document_from_text(OSCILLATING, "arm", str(tmp_path / "arm.toml")).scene  # noqa: B018 - builds the scene


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("lifd.csv", 'there is no file "lifd.csv" in the folder of the scene; did you mean "lift.csv"'),
        ("../lift.csv", "is not in the folder of the scene"),
        ("/etc/lift.csv", "is not in the folder of the scene"),
        ("C:/lift.csv", "is not in the folder of the scene"),
        ("in/../../lift.csv", "is not in the folder of the scene"),
        ("lift", "with the suffix .csv or .tsv or .txt"),
    ],
)
def test_a_motion_file_elsewhere_is_not_read(scene, name, message):
    with pytest.raises(SceneError, match=message) as caught:
        document_from_text(OSCILLATING.replace("lift.csv", name), "arm", str(scene))
    assert isinstance(caught.value, FileNotFoundError) == ("no file" in message)
    assert caught.value.table, caught.value.key == ("drives[1]", "motion")


def test_unreadable_motion_files_are_errors(scene):
    (scene.parent / "lift.csv").write_bytes("time [ms],angle [°]\n".encode("latin1"))
    with pytest.raises(SceneError, match=r'"lift.csv": not a text in UTF-8 at line 1'):
        read_document(scene)
    with pytest.raises(SceneError, match="the scene has no folder"):
        document_from_text(OSCILLATING, read=reader_in(None))
    with pytest.raises(ValueError, match="line 1: "):
        columns_of('0,"' + "1" * 200_000, ("a", "b"))


def test_every_interface_reads_the_motion_file(scene, tmp_path, monkeypatch):
    document, plain = read_document(scene), document_from_text(WRITTEN)
    angles = scene_motion(plain.scene).drive
    np.testing.assert_array_equal(scene_motion(document.scene).drive, angles)
    np.testing.assert_array_equal(scene_motion(pickle.loads(pickle.dumps(document)).scene).drive, angles)
    monkeypatch.chdir(tmp_path)
    np.testing.assert_array_equal(scene_motion(scene_from_text(OSCILLATING)).drive, angles)
    assert read_structure(scene).mechanism.drives == plain.scene.mechanism.drives
    depth = "sections.bar.depth"
    rows = [evaluate(each, [depth], [[0.005], [0.006]], ["deflection"]) for each in (document, plain)]
    np.testing.assert_array_equal(rows[0].columns["deflection"], rows[1].columns["deflection"])
    with pytest.raises(SceneError, match="there is no such number"):
        document.variable("drives.crank.motion[2][2]")


def test_the_text_of_a_scene_contains_the_motion(scene):
    """The text is self-contained: as a design, an optimum, in a page or in an editor."""
    document = read_document(scene)
    for message in (
        document.text(),
        document.scene.text,
        document.with_values({"sections.bar.depth": 0.005}).text("head"),
    ):
        assert '["250 ms", "10.5 deg"],' in message
        assert "lift.csv" not in message
        again = document_from_text(message, read=reader_in(None))
        np.testing.assert_array_equal(scene_motion(again.scene).drive, scene_motion(document.scene).drive)


def test_the_live_editor_reads_only_files_beside_the_scene(scene):
    folder = SceneFile(scene).folder
    answer, _ = quick_answer(OSCILLATING, folder=folder)
    assert not answer["mistakes"]
    assert answer["picture"]["drives"][0]["peaks"]
    (mistake,) = quick_answer(OSCILLATING, folder=SceneFile(None).folder)[0]["mistakes"]
    assert "save the scene first" in mistake["message"]
    assert OSCILLATING.splitlines()[mistake["line"] - 1] == 'motion = "lift.csv"'
    (mistake,) = quick_answer(OSCILLATING.replace("lift", "../lift"), folder=folder)[0]["mistakes"]
    assert "is not in the folder of the scene" in mistake["message"]
    assert start_of(OSCILLATING, folder)[0]["B"]
    moved = changed(OSCILLATING, {"do": "move", "point": "B", "to": [0.29, 0.24]}, folder)
    assert 'motion = "lift.csv"' in moved
    assert moved != OSCILLATING


@pytest.mark.slow
def test_the_full_live_answer_and_a_notebook_read_the_file(scene):
    message, _, report = whole_answer(OSCILLATING, "arm", scene.parent)
    assert not message["mistakes"]
    assert b"250 ms" in report
    view = LiveView(str(scene))
    try:
        assert view.scene.course.laws[0]([0.25])[0] == pytest.approx([np.radians(10.5)])
    finally:
        view.close()


def test_a_run_depends_on_the_file(scene, tmp_path, capsys):
    def run(*more):
        status = main([str(scene), "-o", str(tmp_path / "out"), "--theory", "quasi-static", *more])
        return status, capsys.readouterr().out

    assert "->" in run()[1]
    assert "already finished" in run("--resume")[1]
    made = json.loads((tmp_path / "out" / "arm" / "summary.json").read_text())["made_from"]
    assert [*made["beside"]] == ["lift.csv"]
    (scene.parent / "lift.csv").write_text(LIFT.replace("10,5", "12"))
    assert "already finished" not in run("--resume")[1]
    (scene.parent / "lift.csv").unlink()
    assert main([str(scene), "-o", str(tmp_path / "out"), "--resume"]) == 2
    assert 'arm.toml: [[drives]] no. 1 motion: there is no file "lift.csv"' in capsys.readouterr().err


@pytest.mark.slow
def test_a_sweep_depends_on_the_file(scene, tmp_path, capsys):
    scene.write_text(f'{OSCILLATING}\n[sweep.vary]\n"sections.bar.depth" = ["5 mm", "6 mm"]\n')
    sweep = [str(scene), "-o", str(tmp_path / "out"), "--sweep", "--jobs", "1"]
    assert main(sweep) == 0
    assert main([*sweep, "--resume"]) == 0
    assert main([str(scene), "-o", str(tmp_path / "out"), "--design", "1"]) == 0
    assert "250 ms" in (tmp_path / "out" / "arm_design_1.toml").read_text()
    (scene.parent / "lift.csv").write_text(LIFT.replace("10,5", "12"))
    capsys.readouterr()
    assert main([*sweep, "--resume"]) == 2
    assert "beside.lift.csv" in capsys.readouterr().err


@pytest.mark.slow
def test_the_page_shows_the_peaks_of_a_law(driver, scene, tmp_path):
    law = 'law = [{curve = "harmonic", duration = "0.5 s", by = "30 deg"}, {curve = "dwell", duration = "0.5 s"}]'
    scene.write_text(OSCILLATING.replace('motion = "lift.csv"\nrepeat = true', law))
    assert main([str(scene), "-o", str(tmp_path / "out"), "--theory", "quasi-static"]) == 0
    page = Page(driver, tmp_path / "out" / "arm" / "report.html")
    assert "could not be drawn" not in page.run("return document.body.innerText")
    cells = page.run("return [...document.querySelectorAll('td')].map((each) => each.textContent)")
    assert "infinite: the acceleration jumps at 0 s, 500 ms" in cells


@pytest.mark.slow
def test_a_cam_by_a_table_equals_the_cam_by_its_law(tmp_path, monkeypatch):
    """201 entries with six decimals of a millimetre give the cam within 0.2 %."""
    text = (Path(__file__).parents[1] / "docs" / "gallery" / "valve_train.toml").read_text()
    scene = scene_from_text(text)
    time = np.linspace(0, 20e-3, 201)
    rows = zip(1e3 * time, 1e3 * scene.course.laws[0](time)[0], strict=True)
    (tmp_path / "lift.csv").write_text("time [ms],lift [mm]\n" + "".join(f"{t:.6g},{lift:.6f}\n" for t, lift in rows))
    monkeypatch.chdir(tmp_path)
    tabled = scene_from_text(re.sub(r"law = \[.*?\n\]", 'motion = "lift.csv"', text, flags=re.DOTALL))
    for figure in ("cam_pressure_angle", "cam_pressure"):
        sizes = [answer(each, theory="quasi-static").figures["figures"][figure]["value"] for each in (scene, tabled)]
        assert sizes[1] == pytest.approx(sizes[0], rel=2e-3), figure
