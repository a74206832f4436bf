"""A sweep by the command gives the same bytes however it is computed, and reports how it ended."""

import numpy as np
import pytest
from processes import full_disk
from sweeps import swept_scene, tree

from kinelast.cli.command import main
from kinelast.designs.evaluate import Evaluation
from kinelast.designs.plan import plan_of
from kinelast.outputs.sealed import seal
from kinelast.scene.document import document_from_dict
from kinelast.scene.parsing import parse_toml
from kinelast.scene.text import file_text
from kinelast.sweep.manifest import read_manifest
from kinelast.sweep.running import run_plan
from kinelast.sweep.store import stored_chunks

SWEEP = """
[sweep]
method = "sobol"
samples = 90
figures = ["deflection", "mass", "stress"]

[sweep.vary]
"sections.bar.depth" = {from = "3 mm", to = "15 mm"}
"links.crank.length" = {from = "80 mm", to = "210 mm"}
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "arm.toml"
    return swept_scene(path, SWEEP)


def swept(scene, folder, *options):
    return main([str(scene), "--sweep", "-o", str(folder), "--pages", "2", *options])


@pytest.mark.slow
def test_a_sweep_does_not_depend_on_processes_and_resuming(scene, tmp_path):
    assert swept(scene, tmp_path / "one") == 0
    assert swept(scene, tmp_path / "two", "--jobs", "2") == 0
    whole, side_by_side = tree(tmp_path / "one"), tree(tmp_path / "two")
    assert {"arm/designs.csv", "arm/manifest.json"} <= set(whole)
    assert swept(scene, tmp_path / "two", "--resume") == 0
    assert tree(tmp_path / "two") == side_by_side
    for files in (whole, side_by_side):
        del files["arm/manifest.json"]  # the chunk size depends on the time of the first designs
    assert side_by_side == whole


@pytest.mark.slow
def test_pages_lost_on_a_full_disk_are_written_by_the_next_run(tmp_path, monkeypatch, capsys):
    """All pages are dropped: a partial set would look complete."""
    scene = swept_scene(tmp_path / "arm.toml", SWEEP.replace("samples = 90", "samples = 4"))
    seals = []

    def full(*given):
        seals.append(given)
        if len(seals) == 2:
            full_disk()
        return seal(*given)

    with monkeypatch.context() as patch:
        patch.setattr("kinelast.runs.run.seal", full)
        assert swept(scene, tmp_path / "out", "--positions", "4") == 2
    said = capsys.readouterr()
    assert "no pages of single designs: page of design" in said.out + said.err
    assert "no space left on device" in said.out + said.err
    assert not (tmp_path / "out" / "arm" / "designs").exists()
    assert swept(scene, tmp_path / "out", "--positions", "4", "--resume") == 0
    assert len(list((tmp_path / "out" / "arm" / "designs").glob("*/report.html"))) == 2


@pytest.mark.slow
def test_another_sweep_is_not_resumed(scene, tmp_path, capsys):
    assert swept(scene, tmp_path / "out") == 0
    before = tree(tmp_path / "out")
    scene.write_text(scene.read_text().replace("3 mm", "4 mm"))
    assert swept(scene, tmp_path / "out", "--resume") == 2
    assert "contains another sweep" in capsys.readouterr().err
    assert tree(tmp_path / "out") == before


@pytest.mark.slow
def test_rows_do_not_depend_on_the_chunk_size(scene, tmp_path):
    tables = parse_toml(file_text(scene))
    evaluation = Evaluation(document_from_dict(tables), plan_of(tables), ("deflection", "mass"))
    found = []
    for chunk in (90, 31):
        run_plan(90, evaluation, tmp_path / str(chunk), {}, chunk)
        found.append((tmp_path / str(chunk) / "designs.csv").read_bytes())
    assert found[0] == found[1]
    parts = list(stored_chunks(tmp_path / "31", read_manifest(tmp_path / "31")))
    columns = {name: np.concatenate([part[name] for part, _ in parts]) for name in parts[0][0]}
    reasons = [reason for _, own in parts for reason in own]
    closes = columns["links.crank.length"] < 0.2  # Grashof: 0.1 + 0.3 < 0.25 + 0.35, equal for a crank of 0.2
    assert closes.any()
    assert not closes.all()
    buckles = np.array(["buckles" in reason for reason in reasons])  # thin links near the dead point of a long crank
    assert buckles.sum() < 5
    assert np.array_equal(np.isfinite(columns["deflection"]), closes & ~buckles)
    assert [reason == "" for reason in reasons] == (closes & ~buckles).tolist()


@pytest.mark.slow
def test_the_command_reports_a_full_disk(scene, tmp_path, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        patch.setattr("kinelast.outputs.outbox.sync", full_disk)
        assert swept(scene, tmp_path / "out") == 2
    errors = capsys.readouterr().err
    assert "no space left on device; 0 of 90 designs are stored; continue with --resume" in errors
    assert swept(scene, tmp_path / "out", "--resume") == 0


def test_a_scheduler_needs_a_sweep(scene, capsys):
    assert main([str(scene), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "--scheduler needs --sweep" in capsys.readouterr().err
