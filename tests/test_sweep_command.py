"""A scene's sweep by the command: the same bytes however it is computed, and each of its ends told."""

import errno
import os

import numpy as np
import pytest
from sweeps import swept_scene, tree

from kinelast.cli.command import main
from kinelast.designs.evaluate import Evaluation
from kinelast.designs.plan import plan_of
from kinelast.outputs.sealed import seal
from kinelast.scene.document import document_from_dict
from kinelast.scene.text import file_text, toml_tables
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
def test_a_sweep_of_a_scene_is_the_same_for_any_number_of_processes_and_when_gone_on_with(scene, tmp_path):
    assert swept(scene, tmp_path / "one") == 0
    assert swept(scene, tmp_path / "two", "--jobs", "2") == 0
    whole, side_by_side = tree(tmp_path / "one"), tree(tmp_path / "two")
    assert {"arm/designs.csv", "arm/manifest.json"} <= set(whole)
    assert swept(scene, tmp_path / "two", "--resume") == 0
    assert tree(tmp_path / "two") == side_by_side
    for files in (whole, side_by_side):
        del files["arm/manifest.json"]  # how many designs there are to a chunk goes by the time that the first take
    assert side_by_side == whole


@pytest.mark.slow
def test_pages_that_the_disk_did_not_take_are_made_by_the_next_run(tmp_path, monkeypatch, capsys):
    """All of them or none: those that came before the disk was full would pass for all that there are."""
    scene = swept_scene(tmp_path / "arm.toml", SWEEP.replace("samples = 90", "samples = 4"))
    seals = []

    def full(*given):
        seals.append(given)
        if len(seals) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
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
def test_another_sweep_is_not_gone_on_with(scene, tmp_path, capsys):
    assert swept(scene, tmp_path / "out") == 0
    before = tree(tmp_path / "out")
    scene.write_text(scene.read_text().replace("3 mm", "4 mm"))
    assert swept(scene, tmp_path / "out", "--resume") == 2
    assert "and two are not mixed" in capsys.readouterr().err
    assert tree(tmp_path / "out") == before


@pytest.mark.slow
def test_rows_do_not_depend_on_the_chunks_that_they_are_computed_in(scene, tmp_path):
    tables = toml_tables(file_text(scene), "")
    evaluation = Evaluation(document_from_dict(tables), plan_of(tables), ("deflection", "mass"))
    found = []
    for chunk in (90, 31):
        run_plan(90, evaluation, tmp_path / str(chunk), {}, chunk)
        found.append((tmp_path / str(chunk) / "designs.csv").read_bytes())
    assert found[0] == found[1]
    [(columns, reasons)] = stored_chunks(tmp_path / "31", read_manifest(tmp_path / "31"))
    closes = columns["links.crank.length"] < 0.2  # Grashof: 0.1 + 0.3 < 0.25 + 0.35, with a crank of 0.2 equal
    assert closes.any()
    assert not closes.all()
    buckles = np.array(["buckles" in reason for reason in reasons])  # thin links near the dead point of a long crank
    assert buckles.sum() < 5
    assert np.array_equal(np.isfinite(columns["deflection"]), closes & ~buckles)
    assert [reason == "" for reason in reasons] == (closes & ~buckles).tolist()


@pytest.mark.slow
def test_a_full_disk_is_told_by_the_command(scene, tmp_path, monkeypatch, capsys):
    def full(descriptor):
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as patch:
        patch.setattr("kinelast.outputs.outbox.sync", full)
        assert swept(scene, tmp_path / "out") == 2
    told = capsys.readouterr().err
    assert "no space left on device; 0 of 90 designs are kept; --resume goes on from there" in told
    assert swept(scene, tmp_path / "out", "--resume") == 0


def test_a_scheduler_belongs_to_a_sweep(scene, capsys):
    assert main([str(scene), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "--scheduler needs --sweep" in capsys.readouterr().err
