"""A run in chunks gives the results of a single run, with bounded memory.

The reference is the single run, which the other tests compare with independent references.
"""

import csv
import json
import os
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from scene_texts import FALLING, FOUR_BAR, SWING, edited

from kinelast import runs as compute
from kinelast.cli.command import main
from kinelast.scene.document import scene_from_text


def both(text, tmp_path, monkeypatch, *options, status=0, theory=("--theory", "quasi-static")):
    """Return the folders of a single run and of a run in chunks of 64 positions."""
    scene = tmp_path / "scene.toml"
    scene.write_text(text)
    folders = []
    for name, long in (("one", 1e18), ("many", 1)):
        monkeypatch.setattr(compute, "LONG", long)
        call = [str(scene), "--quiet", *theory, "-o", str(tmp_path / name), *options]
        assert main(call) == status
        folders.append(tmp_path / name / "scene")
    return folders


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch):
    monkeypatch.setattr("rigid.chunks.MIN_COLUMNS", 64)
    monkeypatch.setattr("rigid.chunks.CACHE_CELLS", 64)


def numbers(tree, path=""):
    """Return all figures of a summary by path, except those of vibration, which use fewer positions."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            if key not in ("vibration", "made_from", "files", "sha256", "cautions", "trust", "verdict"):
                yield from numbers(value, f"{path}/{key}")
    elif isinstance(tree, list):
        for number, value in enumerate(tree):
            yield from numbers(value, f"{path}/{number}")
    else:
        yield path, tree


def table_of(folder):
    with (folder / "positions.csv").open(newline="") as file:
        return list(csv.reader(file))


def require_alike(one, many, turns=False):
    """Require the same table and summary; with several turns, critical loads may differ by 0.2 %.

    Each turn has nearly the same maximum, so chunks may select that of another turn.
    """
    rows, others = table_of(one), table_of(many)
    assert rows[0] == others[0]
    values, found = (
        np.array([[float(cell or "nan") for cell in row] for row in table[1:]]) for table in (rows, others)
    )
    assert found.shape == values.shape
    np.testing.assert_array_equal(np.isnan(found), np.isnan(values))
    largest = np.nanmax(np.abs(values), axis=0, initial=0.0)
    assert (np.nan_to_num(np.abs(found - values)) <= 1e-9 * largest + 1e-12).all()
    summaries = [dict(numbers(json.loads((folder / "summary.json").read_text()))) for folder in (one, many)]
    assert summaries[0].keys() == summaries[1].keys()
    for path, value in summaries[0].items():
        if turns and ("/buckling/" in path or "/breaks_first/" in path):
            at_peak = not path.endswith(("/buckling/value", "/reserve/value"))
            assert at_peak or summaries[1][path] == pytest.approx(value, rel=2e-3), path
        elif isinstance(value, float):
            assert summaries[1][path] == pytest.approx(value, rel=1e-9, abs=1e-12), path
        else:
            assert summaries[1][path] == value, path


def test_every_figure_equals_that_of_a_single_run(tmp_path, monkeypatch):
    text = edited(FOUR_BAR, ("positions = 36", "positions = 500"))
    one, many = both(text, tmp_path, monkeypatch, "--fields", "--stations", "5")
    require_alike(one, many)
    fields, others = np.load(one / "fields.npz"), np.load(many / "fields.npz")
    assert set(fields) == set(others)
    for name in fields:
        np.testing.assert_allclose(others[name], fields[name], rtol=1e-9, atol=1e-12 * np.abs(fields[name]).max())


@pytest.mark.slow
@pytest.mark.parametrize("options", [("--accuracy", "1 %"), ("--theory", "elastodynamic")])
def test_vibration_of_a_long_run_equals_that_of_a_single_run(options, tmp_path, monkeypatch):
    text = edited(FOUR_BAR, ("positions = 36", "positions = 200"))
    one, many = both(text, tmp_path, monkeypatch, theory=options)
    require_alike(one, many)
    theory = json.loads((many / "summary.json").read_text())["theory"]
    assert theory["without_vibration"] > 0.05
    assert theory["name"] == (options[1] if options[0] == "--theory" else "geometrically-exact")
    assert theory["error"] < 0.02


def test_positions_out_of_reach_are_handled_alike(tmp_path, monkeypatch, capsys):
    text = edited(
        FOUR_BAR,
        ('["A", "B"]', '["A", "B"]\nlength = "200 mm"'),
        ('["D", "B"]', '["D", "B"]\nlength = "100 mm"'),
        ("positions = 36", "positions = 500"),
    )
    both(text, tmp_path, monkeypatch, status=2)
    said = [re.sub(r"\d+% of the positions", "some", line) for line in capsys.readouterr().err.splitlines()]
    assert said[0] == said[1]
    assert "--reachable leaves out" in said[0]
    require_alike(*both(text, tmp_path, monkeypatch, "--reachable"))


@pytest.mark.slow
def test_an_integrated_motion_can_be_split_into_chunks(tmp_path, monkeypatch):
    require_alike(*both(SWING, tmp_path, monkeypatch, "--positions", "200"))


@pytest.mark.slow
def test_check_and_films_use_the_shown_positions(tmp_path, monkeypatch):
    monkeypatch.setattr(compute, "SHOWN", 40)
    text = edited(FOUR_BAR, ("positions = 36", "positions = 500"))
    _, many = both(text, tmp_path, monkeypatch, "--check", "2")
    summary = json.loads((many / "summary.json").read_text())
    assert summary["run"]["positions"] == 500
    assert (summary["check"]["passed"], summary["check"]["compared"]) == (True, 40)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_positions(monkeypatch):
    scene = scene_from_text(FOUR_BAR)
    monkeypatch.setattr(compute, "SHOWN", 32)
    sizes = []
    for count in (800, 3200):
        time = np.linspace(0, scene.run.duration, count, endpoint=False)
        tracemalloc.start()
        compute.long_results(scene, time, lambda results, first: None, lambda scene, bent: None)
        sizes.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert sizes[1] < 1.5 * sizes[0]


@pytest.mark.slow
def test_torsion_springs_and_friction_equal_those_of_a_single_run(tmp_path, monkeypatch):
    """One spring counts the turns of its drive, the other has an angle within half a turn."""
    springs = '[[springs]]\nlink = "crank"\nat = "O"\nstiffness = 1\n'
    springs += '[[springs]]\nlink = "coupler"\non = "crank"\nat = "A"\nstiffness = 2\n'
    friction = '[joints.B]\nfriction = 0.1\nradius = "5 mm"\n'
    text = edited(
        FOUR_BAR, ("[run]", f"{springs}{friction}[run]\nduration = 0.2"), ("positions = 36", "positions = 500")
    )
    require_alike(*both(text, tmp_path, monkeypatch), turns=True)


def test_many_links_without_beams_make_a_long_run():
    made = 'section = "bar"\nmaterial = "steel"'
    bare = edited(FOUR_BAR, *((made, f'rigid = true\nmass = 0.1\ncenter = "{point}"') for point in "ABD"))
    assert [compute.is_long(scene_from_text(bare), count) for count in (40_000, 60_000)] == [False, True]


def test_a_large_request_is_announced_and_rejected_without_space(tmp_path, monkeypatch, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(FOUR_BAR)
    monkeypatch.setattr(compute, "HEAVY", 1e3)
    assert main([str(scene), "--fields", "-o", str(tmp_path / "out")]) == 0
    # 12 fields of 3 beams at 101 stations and 36 positions, doubled during writing: 2.09 MB, and a table.
    assert "scene: 36 positions need about 2.1" in capsys.readouterr().err
    for what, options in (("_free_disk", ["--fields"]), ("_free_memory", ["--check"])):
        with monkeypatch.context() as patch:
            patch.setattr(compute, what, lambda *_: 1e3)
            assert main([str(scene), *options, "-o", str(tmp_path / "none")]) == 2
        assert "but only 0.001 MB are free: use fewer --positions" in capsys.readouterr().err
    assert main([str(scene), "--mesh", "--positions", "20001", "-o", str(tmp_path / "none")]) == 2
    assert "a file for every position" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_out_of_memory_is_reported(tmp_path, monkeypatch, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(FOUR_BAR)

    def full(*_, **__):
        raise MemoryError

    monkeypatch.setattr("kinelast.runs.scene_deflection", full)
    assert main([str(scene), "-o", str(tmp_path / "out")]) == 2
    assert "scene: out of memory: ask for fewer positions" in capsys.readouterr().err


@pytest.mark.slow
def test_results_of_a_long_run_have_the_counts_of_the_whole_run():
    scene = scene_from_text(FOUR_BAR)
    time = np.linspace(0, scene.run.duration, 5000, endpoint=False)
    results = compute.long_results(scene, time, lambda results, first: None, lambda scene, bent: None)
    assert results.counts == (5000, 0, 0)
    assert results.figures.positions == 5000
    assert len(results.motion.time) == 3600


@pytest.mark.slow
def test_long_computations_show_progress(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("kinelast.cli.terminal.LINE_INTERVAL", 0.0)
    monkeypatch.setattr(compute, "LONG", 1)
    texts = {
        "scene": edited(FOUR_BAR, ("positions = 36", "positions = 300")),
        "fall": edited(FALLING, ("duration = 2", "duration = 0.5")),
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
    assert main([str(tmp_path / "scene.toml"), str(tmp_path / "fall.toml"), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert re.search(r"scene: solving positions, \d+ %, \d+ s\n", said)
    assert re.search(r"fall: integrating 0.5 s of motion, \d+ %, \d+ s\n", said)
    assert "fall, 1 of 2, " in said
    assert main([str(tmp_path / "scene.toml"), "--quiet", "-o", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_a_terminal_shows_a_progress_bar_after_a_second(tmp_path):
    (tmp_path / "scene.toml").write_text(edited(FOUR_BAR, ("positions = 36", "positions = 200000")))
    ours, theirs = os.openpty()
    call = [sys.executable, "-m", "kinelast", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out")]
    run = subprocess.Popen(call, cwd=Path(__file__).parent.parent, stderr=theirs, stdout=subprocess.DEVNULL)
    os.close(theirs)
    seen = b""
    while b"scene: solving positions" not in seen:
        seen += os.read(ours, 4096)  # raises an error if the command ends without a bar
    run.terminate()
    assert run.wait(120) == 143
    os.close(ours)
