"""An interrupted sweep keeps its results, resumes, and ends with the same bytes."""

import csv
import errno
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import processes
import pytest
from processes import wait_for
from sweeps import IDENTITY, Parabolas, tree
from tiers import in_tiers

from kinelast.outputs.outbox import locked
from kinelast.sweep import cluster, running, store
from kinelast.sweep.manifest import read_manifest
from kinelast.sweep.running import run_plan
from kinelast.sweep.store import stored_chunks
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import RequestError

COUNT, CHUNK = 1050, 100
KILLS = 3  # benchmarks/sweep_faults.py runs it at full size
SLOW = pytest.mark.slow


def sweep(folder, compute=None, count=COUNT, chunk=CHUNK, identity=None, **options):
    return run_plan(count, compute or Parabolas(), folder, identity or IDENTITY, chunk, **options)


@pytest.fixture(params=["csv", "parquet"])
def kind(request, monkeypatch):
    """Each kind of store, for any number of designs."""
    if request.param == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    monkeypatch.setattr(store, "MAX_CSV", 10**9 if request.param == "csv" else 0)
    return request.param


@pytest.fixture
def whole(tmp_path, kind):
    """Return the files of an undisturbed sweep."""
    sweep(tmp_path / "whole")
    return tree(tmp_path / "whole")


def rows(folder):
    """Return all stored columns and reasons of a sweep."""
    parts = list(stored_chunks(folder, read_manifest(folder)))
    columns = {name: np.concatenate([columns[name] for columns, _ in parts]) for name in parts[0][0]}
    return columns, [reason for _, reasons in parts for reason in reasons]


def test_every_design_is_stored_once_with_all_digits(tmp_path, kind):
    sweep(tmp_path)
    columns, reasons = rows(tmp_path)
    number = np.arange(COUNT)
    length = 0.1 + 1e-3 * number
    assert np.array_equal(columns["design"], number)
    assert np.array_equal(columns["length"], length)
    lost = number % 7 == 3
    assert np.array_equal(np.isnan(columns["tip"]), lost)
    assert np.array_equal(columns["tip"][~lost], (20.0 * length**3 / (3 * 37.8))[~lost])
    assert [reason != "" for reason in reasons] == lost.tolist()
    assert set(reasons) == {"", 'does not reach, at "B"'}


def test_filling_cells_changes_only_those_cells(tmp_path, kind):
    state = sweep(tmp_path)
    before, (columns, reasons) = tree(tmp_path), rows(tmp_path)
    cells = {3: {"tip": 0.5}, 10: {"length": 7.0, "tip": 1 / 3}, 1049: {"tip": 2.0}}
    filled = running.filled(state, cells)
    after, whys = rows(tmp_path)
    for number, own in cells.items():
        for name, value in own.items():
            assert after[name][number] == value
            after[name][number] = columns[name][number]
    assert all(np.array_equal(after[name], columns[name], equal_nan=True) for name in columns)
    assert whys == reasons
    changed = {name for name, content in tree(tmp_path).items() if content != before[name]}
    chunks = {"designs.parquet/0000000000.parquet", "designs.parquet/0000000010.parquet"}
    assert changed == {"manifest.json"} | ({"designs.csv"} if kind == "csv" else chunks)
    whole = tree(tmp_path)
    assert running.filled(filled, cells) == filled
    sweep(tmp_path, Parabolas(fails=frozenset(range(COUNT))), resume=True)  # all chunks are kept, so none is computed
    assert tree(tmp_path) == whole


def test_a_small_store_is_one_csv_table_with_units(tmp_path):
    sweep(tmp_path)
    with (tmp_path / "designs.csv").open(newline="") as file:
        head, *table = csv.reader(file)
    assert head == ["design", "length [m]", "tip [m]", "class", "reason"]
    assert len(table) == COUNT
    assert {path.name for path in tmp_path.iterdir()} == {"designs.csv", "manifest.json"}


def test_a_large_store_is_one_parquet_table(tmp_path, monkeypatch):
    dataset = pytest.importorskip("pyarrow.dataset", reason="pyarrow is not installed")
    monkeypatch.setattr(store, "MAX_CSV", 0)
    sweep(tmp_path)
    table = dataset.dataset(tmp_path / "designs.parquet").to_table()
    assert table.column_names == ["design", "length [m]", "tip [m]", "class", "reason"]
    assert table["design"].to_pylist() == list(range(COUNT))


def test_the_bytes_do_not_depend_on_the_number_of_processes(tmp_path):
    sweep(tmp_path / "whole")
    sweep(tmp_path / "two", jobs=2)
    assert tree(tmp_path / "two") == tree(tmp_path / "whole")


@pytest.mark.exhaustive
def test_the_chunk_of_a_killed_process_is_repeated(tmp_path):
    sweep(tmp_path / "whole")
    bomb = tmp_path / "bomb"
    bomb.touch()
    sweep(tmp_path / "lost", Parabolas(kills=bomb), jobs=2)
    assert not bomb.exists()
    assert tree(tmp_path / "lost") == tree(tmp_path / "whole")


@SLOW
def test_a_chunk_that_always_kills_its_process_is_named_and_the_others_are_kept(tmp_path):
    outcome = sweep(tmp_path / "out", Deadly(), jobs=2)
    assert outcome.kept == COUNT - CHUNK
    assert list(outcome.manifest.failed) == [3]
    assert "signal 9" in outcome.manifest.failed[3]
    assert sweep(tmp_path / "out", resume=True).manifest.complete


class Deadly(Parabolas):
    """Parabolas; one chunk kills its process."""

    def __call__(self, first, last):
        if first == 300:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().__call__(first, last)


def test_a_failed_chunk_is_recorded_and_repeated_on_resume(tmp_path, whole):
    outcome = sweep(tmp_path / "out", Parabolas(fails=frozenset({200, 1000})))
    assert outcome.kept == COUNT - 150
    assert not outcome.manifest.complete
    noted = json.loads((tmp_path / "out" / "manifest.json").read_text())["failed"]
    assert list(noted) == ["2", "10"]
    assert "ValueError: no design 1000" in noted["10"]
    with pytest.raises(RequestError, match="900 of 1050 designs of an incomplete sweep: continue with --resume"):
        sweep(tmp_path / "out")
    assert sweep(tmp_path / "out", resume=True).kept == COUNT
    assert tree(tmp_path / "out") == whole


def test_a_sweep_stops_after_too_many_failed_chunks(tmp_path):
    fails = frozenset(range(0, COUNT, 10))
    assert len(sweep(tmp_path, Parabolas(fails=fails), chunk=10).manifest.failed) == running.MAX_FAILED


def test_a_chunk_with_other_columns_fails(tmp_path):
    class Changing(Parabolas):
        def __call__(self, first, last):
            columns, reasons = super().__call__(first, last)
            return (columns if first != 400 else {**columns, "more": columns["tip"]}), reasons

    assert "its columns are length, tip, class, more" in sweep(tmp_path, Changing()).manifest.failed[4]


@pytest.mark.parametrize("writes", in_tiers([0, 1, 2, 5, 13], 3, 0))
def test_a_full_disk_loses_nothing(writes, tmp_path, whole, kind, monkeypatch):
    left, fsync = [writes], os.fsync

    def full(descriptor):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        fsync(descriptor)

    place = tmp_path / "full"
    if kind == "parquet" and writes == 13:
        writes = left[0] = 12  # this store does not join files
    with monkeypatch.context() as patch:
        patch.setattr("kinelast.outputs.outbox.sync", full)
        with pytest.raises(
            RequestError, match=r"no space left on device; \d+ of 1050 designs are stored; continue with"
        ):
            sweep(place)
    assert not list(place.rglob(".*"))
    sweep(place, resume=True)
    assert tree(place) == whole


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"identity": {**IDENTITY, "scene": "another"}}, "scene: a word for its text there, another here"),
        ({"identity": {**IDENTITY, "options": {"positions": 36}}}, "options.positions: 72 there, 36 here"),
        ({"count": 1060}, "designs: 1050 there, 1060 here"),
        ({"chunk": 50}, "chunk: 100 there, 50 here"),
    ],
)
def test_resuming_a_different_sweep_is_an_error(change, message, tmp_path, whole):
    with pytest.raises(RequestError) as caught:
        sweep(tmp_path / "whole", resume=True, **change)
    assert message in str(caught.value)
    assert "contains another sweep" in str(caught.value)
    assert tree(tmp_path / "whole") == whole


def test_resuming_with_other_versions_is_an_error(tmp_path, monkeypatch):
    sweep(tmp_path)
    monkeypatch.setattr(running, "versions", lambda: {"kinelast": "9.9"})
    with pytest.raises(RequestError, match=r"versions.kinelast: .* there, 9.9 here"):
        sweep(tmp_path, resume=True)


def test_a_new_sweep_replaces_a_finished_one(tmp_path, whole):
    sweep(tmp_path / "out", identity={"scene": "before"}, count=20)
    sweep(tmp_path / "out")
    assert tree(tmp_path / "out") == whole


def test_foreign_files_are_not_overwritten(tmp_path):
    (tmp_path / "designs.csv").write_text("mine")
    with pytest.raises(RequestError, match="does not belong to a sweep"):
        sweep(tmp_path)
    (tmp_path / "manifest.json").write_text("{}")
    with pytest.raises(RequestError, match="is not the manifest of a sweep"):
        sweep(tmp_path)
    assert (tmp_path / "designs.csv").read_text() == "mine"


def test_one_run_at_a_time(tmp_path):
    with locked(tmp_path / "out"), pytest.raises(RequestError, match="is being written by another run"):
        sweep(tmp_path / "out")


def test_a_finished_sweep_is_not_computed_again(tmp_path, whole):
    assert sweep(tmp_path / "whole", Parabolas(fails=frozenset(range(COUNT))), resume=True).kept == COUNT
    assert tree(tmp_path / "whole") == whole


def test_a_lost_file_is_restored(tmp_path, whole, kind):
    name = "designs.csv" if kind == "csv" else "designs.parquet/0000000004.parquet"
    (tmp_path / "whole" / name).unlink()
    (tmp_path / "whole" / ".designs.csv.part").write_text("torn")
    sweep(tmp_path / "whole", resume=True)
    assert tree(tmp_path / "whole") == whole


def cut(path, content):
    path.write_bytes(content[: len(content) // 2])


def emptied(path, _):
    path.write_bytes(b"")


def one_more(path, content):
    path.write_bytes(content + content[-40:])


def one_digit(path, content):
    at = next(at for at in range(len(content) // 2, len(content)) if content[at : at + 1].isdigit())
    path.write_bytes(content[:at] + (b"1" if content[at : at + 1] != b"1" else b"2") + content[at + 1 :])


def flipped(path, content):
    at = random.Random(len(content)).randrange(len(content))
    path.write_bytes(content[:at] + bytes([content[at] ^ 16]) + content[at + 1 :])


def swapped(path, content):
    """Exchange two chunks, or the halves of a single file."""
    other = path.with_name(path.name.replace("4", "5")) if path.parent.name != "whole" else path
    path.write_bytes(
        other.read_bytes() if other != path else content[len(content) // 2 :] + content[: len(content) // 2]
    )
    if other != path:
        other.write_bytes(content)


FAULTS = [cut, emptied, one_more, one_digit, flipped, swapped]


@pytest.mark.parametrize("fault", in_tiers(FAULTS, 4, 0))
def test_a_damaged_finished_store_is_reported_and_repaired(fault, tmp_path, whole, kind):
    path = tmp_path / "whole" / ("designs.csv" if kind == "csv" else "designs.parquet/0000000004.parquet")
    fault(path, path.read_bytes())
    message = Recorder()
    assert sweep(tmp_path / "whole", resume=True, progress=message).kept == COUNT
    assert tree(tmp_path / "whole") == whole
    assert "has changed since it was written" in message.sentences[0]


@pytest.mark.parametrize("fault", in_tiers(FAULTS, 4, 0))
def test_a_damaged_chunk_is_reported_and_computed_first(fault, tmp_path, whole, kind):
    begun = sweep(tmp_path / "begun", Parabolas(fails=frozenset({1000})))
    assert begun.kept == COUNT - 50
    (path,) = (tmp_path / "begun").glob("designs.*/0000000004.*")
    fault(path, path.read_bytes())
    message, compute = Recorder(), Listed()
    assert sweep(tmp_path / "begun", compute, resume=True, progress=message).kept == COUNT
    again = [400, 500] if fault is swapped else [400]
    assert compute.asked == [*again, 1000]
    assert "damaged, computed again: chunk" in message.sentences[0]
    assert tree(tmp_path / "begun") == whole


def test_an_incomplete_journal_entry_is_ignored(tmp_path, whole):
    """A machine may fail while it writes an entry."""
    sweep(tmp_path / "begun", Parabolas(fails=frozenset({1000})))
    journal, compute = tmp_path / "begun" / store.JOURNAL, Listed()
    *others, last = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(others) + last[:3])
    assert sweep(tmp_path / "begun", compute, resume=True).kept == COUNT
    assert compute.asked == [900, 1000]
    assert tree(tmp_path / "begun") == whole


def test_the_first_half_of_a_truncated_store_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "MAX_CSV", 10**9)
    sweep(tmp_path)
    path, compute = tmp_path / "designs.csv", Listed()
    cut(path, path.read_bytes())
    sweep(tmp_path, compute, resume=True)
    assert compute.asked[0] == 500
    assert len(compute.asked) == 6


def test_a_foreign_file_among_chunks_is_an_error(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    monkeypatch.setattr(store, "MAX_CSV", 0)
    sweep(tmp_path)
    chunk = tmp_path / "designs.parquet" / "0000000004.parquet"
    chunk.with_name("0000000077.parquet").write_bytes(chunk.read_bytes())
    with pytest.raises(RequestError, match=r"0000000077.parquet does not belong to this sweep: move it"):
        sweep(tmp_path, resume=True)


def test_an_edited_manifest_is_an_error(tmp_path):
    sweep(tmp_path)
    path = tmp_path / "manifest.json"
    path.write_text(path.read_text().replace('"tip": "m"', '"tip": "mm"'))
    with pytest.raises(RequestError, match="it has changed since it was written"):
        sweep(tmp_path, resume=True)


class Recorder(Progress):
    """Record the sentences of the progress."""

    def __init__(self):
        self.sentences = []

    def tell(self, sentence):
        self.sentences.append(sentence)


class Listed(Parabolas):
    """Parabolas that record the first designs of the requested chunks."""

    asked = ()

    def __call__(self, first, last):
        object.__setattr__(self, "asked", [*self.asked, first])
        return super().__call__(first, last)


def started(folder, kind, seconds, jobs=2):
    here = Path(__file__)
    command = [sys.executable, here.with_name("sweeps.py"), folder, COUNT, 10, jobs, seconds, kind]
    place = os.pathsep.join((str(here.parent.parent), str(here.parent)))
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return processes.started(list(map(str, command)), env={**os.environ, "PYTHONPATH": place}, **pipes)


def alive(group):
    """Return whether a process group has any process."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def kept(folder):
    return len(list(folder.glob("designs.*/*[0-9].*")))


@pytest.mark.exhaustive
def test_repeated_kill_9_changes_no_byte(tmp_path, kind):
    sweep(tmp_path / "whole", chunk=10)
    place, chance = tmp_path / "out", random.Random(1)
    for _ in range(KILLS):
        before = kept(place)
        run = started(place, kind, 0.02)
        goal = before + chance.randrange(1, 80 // KILLS)
        wait_for(lambda at=goal: kept(place) >= at)
        time.sleep(chance.random() * 0.02)  # at any point of a chunk
        run.kill()
        run.communicate()
    assert 0 < kept(place) < 105
    sweep(place, chunk=10, resume=True)
    assert tree(place) == tree(tmp_path / "whole")


@SLOW
@pytest.mark.parametrize("jobs", [1, 2])
def test_an_interrupt_reports_the_kept_designs_and_ends_all_processes(jobs, tmp_path):
    run = started(tmp_path / "out", "csv", 0.02, jobs)
    wait_for(lambda: kept(tmp_path / "out") >= 3)
    os.killpg(run.pid, signal.SIGINT)  # like Ctrl+C
    message, _ = run.communicate()
    there = kept(tmp_path / "out")  # the interrupt may come after the last chunk was kept and before it was counted
    assert any(
        f"{10 * count} of 1050 designs are stored; continue with --resume" in message for count in (there, there - 1)
    )
    wait_for(lambda: not alive(run.pid))
    assert sweep(tmp_path / "out", chunk=10, resume=True).kept == COUNT


@SLOW
def test_dask_workers_give_the_same_bytes_even_if_one_dies(tmp_path):
    sweep(tmp_path / "whole")
    whole = tree(tmp_path / "whole")
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    bomb = tmp_path / "bomb"
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
        sweep(tmp_path / "dask", scheduler=cluster.scheduler_address)
        bomb.touch()
        sweep(tmp_path / "lost", Parabolas(kills=bomb), scheduler=cluster.scheduler_address)
    assert not bomb.exists()
    assert tree(tmp_path / "dask") == whole
    assert tree(tmp_path / "lost") == whole


@pytest.mark.exhaustive
def test_a_sweep_waits_for_workers_and_says_so(tmp_path):
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    message = Recorder()
    with distributed.LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address=":0") as cluster:
        timer = threading.Timer(1.0, cluster.scale, [1])
        timer.start()
        assert sweep(tmp_path, scheduler=cluster.scheduler_address, progress=message).kept == COUNT
        timer.join()
    assert "has no workers yet, start one: dask worker tcp://" in message.sentences[0]


def test_a_missing_scheduler_is_an_error(tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    monkeypatch.setattr(cluster, "TIMEOUT", "0.2s")
    with pytest.raises(RequestError, match=r'--scheduler: there is no answer from "tcp://127.0.0.1:9"'):
        sweep(tmp_path, scheduler="tcp://127.0.0.1:9")
