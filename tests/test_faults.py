"""After any disturbance folders are whole, no file of a user is lost, and the next run continues."""

import errno
import json
import math
import multiprocessing
import os
import platform
import re
import signal
import subprocess
import sys
import threading
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import processes as disturbed
import pytest
from msgspec import to_builtins
from processes import full_disk, wait_for
from scene_texts import FOUR_BAR, SLIDER_CRANK, edited
from tiers import in_tiers

import kinelast.outputs.outbox as folders
from kinelast.cli.command import SceneWork, main, side_by_side
from kinelast.outputs.outbox import complete, locked
from kinelast.outputs.sealed import finished, json_bytes, made_from
from kinelast.tasks import processes
from kinelast.tasks.progress import SILENT
from kinelast.tasks.request import Batch, Request, RequestError
from kinelast.tasks.task import BUG, FINE, Task

ARM = edited(FOUR_BAR, ("positions = 36", 'positions = 8\ntheory = "quasi-static"'))
COMMAND = [sys.executable, "-m", "kinelast"]
FILES = ("report.html", "positions.csv")


def scenes(folder, count, long=()):
    """Write scenes to a folder; those numbered in `long` have a million positions."""
    folder.mkdir(exist_ok=True)
    for number in range(count):
        text = edited(ARM, ("positions = 8", "positions = 1000000")) if number in long else ARM
        (folder / f"s{number}.toml").write_text(text.replace("100 rad/s", f"{100 + number} rad/s"))
    return folder


def started(*arguments, **options):
    here = Path(__file__).parent.parent
    return disturbed.started([*COMMAND, *map(str, arguments)], cwd=here, **options)


def require_whole(folder):
    summary = json.loads((folder / "summary.json").read_text())
    rows = (folder / "positions.csv").read_text().splitlines()
    assert len(rows) == summary["run"]["positions"] + 1
    assert (folder / "report.html").read_text().rstrip().endswith("</html>")
    names = {entry.name for entry in folder.iterdir() if ".edited" not in entry.name}  # damaged files were moved aside
    assert names == {*summary["files"], "summary.json"}
    assert all((folder / name).stat().st_size == size for name, size in summary["files"].items())


def hidden(out):
    return [entry.name for entry in out.iterdir() if entry.name.startswith(".")]


def whole_folders(out):
    found = [entry for entry in out.iterdir() if entry.is_dir() and not entry.name.startswith(".")]
    for folder in found:
        require_whole(folder)
    return {folder.name for folder in found}


@pytest.mark.slow
def test_concurrent_runs_leave_whole_folders(tmp_path):
    cases, out = scenes(tmp_path / "in", 4), tmp_path / "out"
    runs = [started(cases, "-o", out, "--positions", count, stderr=subprocess.PIPE) for count in (5, 6, 7)]
    assert [run.wait(120) for run in runs] == [0, 0, 0], [run.stderr.read() for run in runs]
    assert whole_folders(out) == {"s0", "s1", "s2", "s3"}
    assert hidden(out) == []
    for run in runs:
        run.stderr.close()


def test_a_locked_folder_is_an_error_after_a_wait(tmp_path, monkeypatch):
    monkeypatch.setattr(folders, "PATIENCE", 0.2)
    another = complete(tmp_path / "arm")
    with locked(tmp_path / "arm"), pytest.raises(RequestError, match="is being written by another run"), another:
        pass
    with complete(tmp_path / "arm") as part:
        (part / "file").write_text("new")
    assert hidden(tmp_path) == []


@pytest.fixture
def without_locks(monkeypatch):
    """Imitate a file system without locks, as on some network drives."""
    fcntl = pytest.importorskip("fcntl")

    def flock(*_):
        raise OSError(errno.ENOTSUP, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", flock)


@pytest.mark.parametrize("step", ["open", "unlink"])
def test_a_signal_between_two_steps_leaves_no_lock(step, tmp_path, monkeypatch):
    """The signal comes right after a lock file is made, or right before it is removed."""
    code = f"""
import os, signal
from pathlib import Path
from kinelast.outputs import outbox
from kinelast.tasks.progress import StoppedError, stoppable
owner, name = (os, "open") if {step!r} == "open" else (Path, "unlink")
plain = getattr(owner, name)
def struck(*given, **more):
    if name == "unlink":
        os.kill(os.getpid(), signal.SIGTERM)
    found = plain(*given, **more)
    if name == "open":
        os.kill(os.getpid(), signal.SIGTERM)
    return found
setattr(owner, name, struck)
try:
    with stoppable(), outbox.locked(Path("arm")):
        pass
except StoppedError:
    raise SystemExit(7)
"""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent.parent)}
    assert subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=False).returncode == 7
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_during_parsing_is_reported_as_an_interrupt(tmp_path, monkeypatch, capsys):
    def interrupted(_):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise TypeError("as argparse, which fails where it is interrupted") from None
        raise SystemExit(0)

    monkeypatch.setattr("kinelast.cli.command.parsed", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert main(["steel_four_bar"]) == 130
    finally:
        signal.signal(signal.SIGINT, before)


SIGNALLED = """
import os, signal
try:
    os.kill(os.getpid(), signal.NAME)
except BaseException:
    INSTEAD
"""


@pytest.mark.parametrize(("name", "status"), [("SIGHUP", 129), ("SIGTERM", 143), ("SIGINT", 130)])
@pytest.mark.parametrize(
    "where", in_tiers(["kinelast.runs.run.write_tables", "kinelast.outputs.page.report_page"], 1, 0)
)
@pytest.mark.parametrize("instead", ['raise ImportError("initialization failed") from None', "pass"])
def test_a_signal_during_the_import_of_a_library_ends_the_run(
    name, status, where, instead, tmp_path, monkeypatch, capsys
):
    """Libraries in C replace the exception by their own, or clear it and continue."""
    (tmp_path / "written_in_c.py").write_text(SIGNALLED.replace("NAME", name).replace("INSTEAD", instead))
    tidied = []

    def load(*_):
        sys.modules.pop("written_in_c", None)
        try:
            import_module("written_in_c")
            if name == "SIGINT":  # the user presses Ctrl+C again
                signal.raise_signal(signal.SIGINT)
            end = time.monotonic() + 5.0
            while time.monotonic() < end:
                time.sleep(0.01)
        finally:
            time.sleep(0.1)  # longer than the time to the repeated signal
            tidied.append(name)

    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("kinelast.tasks.progress.AGAIN", 0.02)
    monkeypatch.setattr(where, load)
    before = {each: signal.getsignal(each) for each in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT, signal.SIGALRM)}
    call = [str(scenes(tmp_path / "in", 1) / "s0.toml"), "-o", str(tmp_path / "out")]
    assert main(call) == status
    said = capsys.readouterr().err
    assert tidied == [name]
    assert "after 0 of 1 scenes; finished scenes are kept" in said
    assert "please report" not in said
    assert not (tmp_path / "out").exists()
    assert before == {each: signal.getsignal(each) for each in before}


def test_a_lock_that_cannot_be_written_is_removed(tmp_path, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        patch.setattr(folders.os, "ftruncate", full_disk)
        assert main(["quick_return", "--structure", "-o", str(tmp_path / "out")]) == 2
    assert "cannot be made: No space left on device" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_two_runs_are_kept_apart_without_locks(without_locks, tmp_path):
    with locked(tmp_path / "arm") as hidden:
        (tmp_path / f"{hidden}.part").mkdir()
        with pytest.raises(RequestError, match=r'being written by another run.*remove ".*\.owner"'):
            locked(tmp_path / "arm", patience=0.1).__enter__()
        assert (tmp_path / f"{hidden}.part").exists()
        (tmp_path / f"{hidden}.part").rmdir()
    with complete(tmp_path / "arm") as part:
        (part / "file").write_text("new")
    assert [entry.name for entry in tmp_path.iterdir()] == ["arm"]


def test_all_waiting_runs_get_their_turn_without_locks(without_locks, tmp_path):
    turns = []

    def take(number):
        for _ in range(3):
            with locked(tmp_path / "arm", patience=20.0):
                turns.append(number)

    waiting = [threading.Thread(target=take, args=(number,)) for number in range(4)]
    for thread in waiting:
        thread.start()
    for thread in waiting:
        thread.join()
    assert sorted(turns) == sorted([*range(4)] * 3)
    assert list(tmp_path.iterdir()) == []


def test_the_folder_of_a_killed_run_is_taken_over_without_locks(without_locks, tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    with locked(tmp_path / "arm"):
        owner = next(tmp_path.glob("*.owner"))
    owner.write_text(f"{dead.pid} {platform.node()}")
    with locked(tmp_path / "arm", patience=5.0):
        assert owner.read_text() == f"{os.getpid()} {platform.node()}"
    owner.write_text(f"{dead.pid} of-another-machine")
    with pytest.raises(RequestError, match="being written by another run"), locked(tmp_path / "arm", patience=0.1):
        pass


@pytest.mark.parametrize("number", [errno.EXDEV, errno.ENOTSUP, errno.EPERM])
def test_a_failed_rename_is_reported_and_keeps_the_old_folder(number, tmp_path, monkeypatch, capsys):
    call = [str(scenes(tmp_path / "in", 1) / "s0.toml"), "-o", str(tmp_path / "out")]
    assert main([*call, "--quiet"]) == 0
    before = {entry.name: entry.read_bytes() for entry in (tmp_path / "out" / "s0").iterdir()}

    def rename(*_):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        for name in ("rename", "replace"):
            patch.setattr(Path, name, rename)
            patch.setattr(os, name, rename)
        assert main([*call, "--positions", "9"]) == 2
        assert main([*call[:-1], str(tmp_path / "new"), "--positions", "9"]) == 2
    said = capsys.readouterr().err
    assert said.count("s0: not written: ") == 2
    assert os.strerror(number).lower() in said
    assert {entry.name: entry.read_bytes() for entry in (tmp_path / "out" / "s0").iterdir()} == before
    assert hidden(tmp_path / "out") == []
    assert not (tmp_path / "new").exists() or hidden(tmp_path / "new") == []


@pytest.mark.slow
def test_a_dead_worker_fails_only_its_scene(tmp_path):
    """The first scene takes far longer than the others; the test kills its process, which was started first."""
    cases, out = scenes(tmp_path / "in", 5, long=[0]), tmp_path / "out"
    tasks = [Task(cases / f"s{k}.toml", out / f"s{k}", f"s{k}") for k in range(5)]

    def kill():
        wait_for((out / "s3").exists)
        first = min(child.pid for child in multiprocessing.active_children())
        os.kill(first, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    outcomes = list(side_by_side(tasks, SceneWork(Request(), Batch()), 2, SILENT))
    killer.join()
    assert [outcome.status for outcome in outcomes] == [BUG, FINE, FINE, FINE, FINE]
    assert "s0: its process died (signal 9)" in outcomes[0].line
    assert whole_folders(out) == {"s1", "s2", "s3", "s4"}
    assert hidden(out) == []


@pytest.mark.parametrize(
    ("name", "jobs"),
    in_tiers([("SIGINT", 2), ("SIGKILL", 2), ("SIGTERM", 1), ("SIGTERM", 2), ("SIGHUP", 2), ("SIGINT", 1)], 0, 3),
)
def test_a_signal_ends_all_processes_and_the_next_run_continues(name, jobs, tmp_path):
    cases, out = scenes(tmp_path / "in", 4, long=[2, 3]), tmp_path / "out"
    number = getattr(signal, name)
    run = started(cases, "-o", out, "--jobs", jobs, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    wait_for(lambda: (out / "s0").exists() and (out / "s1").exists() and hidden(out))
    time.sleep(1.0)  # wait until the first two scenes are counted and a long one runs
    if name == "SIGINT":
        os.killpg(run.pid, number)  # like Ctrl+C
    else:
        run.send_signal(number)
    said = run.communicate(timeout=120)[1].decode()
    assert run.returncode == {"SIGINT": 130, "SIGKILL": -9}.get(name, 128 + number)
    with pytest.raises(ProcessLookupError):
        wait_for(lambda: os.killpg(run.pid, 0), 10)  # wait until the process group is gone
    if name != "SIGKILL":
        assert "after 2 of 4 scenes; finished scenes are kept, continue with --resume" in said
        assert "2 done, 0 failed, 0 skipped" in said
        assert "Traceback" not in said
        assert hidden(out) == []
    assert whole_folders(out) == {"s0", "s1"}
    scenes(tmp_path / "in", 4)
    assert main([str(cases), "-o", str(out), "--resume", "--quiet"]) == 0
    assert whole_folders(out) == {"s0", "s1", "s2", "s3"}
    assert hidden(out) == []


@pytest.mark.slow
def test_a_closed_pipe_does_not_end_the_run(tmp_path):
    cases, out = scenes(tmp_path / "in", 3), tmp_path / "out"
    run = started(cases, "-o", out, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    run.stdout.close()
    assert run.communicate(timeout=60)[1].decode().startswith("3 done, 0 failed, 0 skipped")
    assert run.returncode == 0
    assert whole_folders(out) == {"s0", "s1", "s2"}


@pytest.mark.exhaustive
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device")
def test_a_full_or_closed_output_does_not_end_the_run(tmp_path):
    cases = scenes(tmp_path / "in", 2)
    with Path("/dev/full").open("w") as full:
        run = started(cases, "-o", tmp_path / "full", stdout=full, stderr=subprocess.PIPE)
        said = run.communicate(timeout=60)[1].decode()
    assert (run.returncode, whole_folders(tmp_path / "full")) == (0, {"s0", "s1"})
    assert "printing failed" in said
    call = " ".join([*COMMAND, str(cases), "-o", str(tmp_path / "closed"), ">&-", "2>&-", "<&-"])
    assert subprocess.run(["sh", "-c", call], cwd=Path(__file__).parent.parent, check=False).returncode == 0
    assert whole_folders(tmp_path / "closed") == {"s0", "s1"}


@pytest.mark.parametrize("function", ["write_table", "write_fields", "seal"])
def test_a_full_disk_keeps_the_old_folder(function, tmp_path, monkeypatch, capsys):
    import kinelast.outputs.positions
    import kinelast.runs.run

    scene = scenes(tmp_path / "in", 1) / "s0.toml"
    call = [str(scene), "--fields", "--stations", "3", "-o", str(tmp_path / "out")]
    assert main([*call, "--quiet"]) == 0
    before = {entry.name: entry.read_bytes() for entry in (tmp_path / "out" / "s0").iterdir()}

    with monkeypatch.context() as patch:
        place = kinelast.outputs.positions if hasattr(kinelast.outputs.positions, function) else kinelast.runs.run
        patch.setattr(place, function, full_disk)
        assert main([*call, "--positions", "9"]) == 2
    assert "s0: not written: no space left on device" in capsys.readouterr().err
    assert {entry.name: entry.read_bytes() for entry in (tmp_path / "out" / "s0").iterdir()} == before
    assert hidden(tmp_path / "out") == []
    assert main([*call, "--positions", "9", "--resume"]) == 0
    require_whole(tmp_path / "out" / "s0")


def test_interrupts_are_blocked_in_worker_processes():
    """multiprocessing starts a tracker with the first worker; it would let interrupts through."""
    code = (
        "import signal; from functools import partial; from kinelast.tasks.processes import map_surviving\n"
        "masks = map_surviving(partial(signal.pthread_sigmask, signal.SIG_BLOCK), [(), ()], 2)\n"
        "assert all(signal.SIGINT in mask for _, mask in masks)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_full_disk_leaves_no_part_of_a_structure_report(tmp_path, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        patch.setattr("kinelast.outputs.outbox.write_json", full_disk)
        assert main(["quick_return", "--structure", "-o", str(tmp_path / "out")]) == 2
    assert "quick_return: not written: no space left on device" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert hidden(tmp_path) == []


@pytest.mark.parametrize("name", ["positions.csv", "summary.json", "report.html"])
def test_changed_results_are_reported_and_computed_again(name, tmp_path, capsys):
    call = ["steel_four_bar", "--positions", "9", "--theory", "quasi-static", "-o", str(tmp_path)]
    assert main([*call, "--quiet"]) == 0
    path = tmp_path / "steel_four_bar" / name
    before = path.read_bytes()
    at = before.index(b"9")
    path.write_bytes(before[:at] + b"8" + before[at + 1 :])
    assert main([*call, "--resume"]) == 0
    said = capsys.readouterr()
    assert f"steel_four_bar: computed again: {'its ' * (name == 'summary.json')}{name} changed" in said.err
    assert path.read_bytes() == before
    assert main([*call, "--resume"]) == 0
    assert "already finished" in capsys.readouterr().out


@pytest.mark.parametrize("files", in_tiers(["[[1]]", "3", '{"a": {}}', '["summary.json", null]'], 2, 0))
def test_an_edited_summary_is_not_a_program_failure(files, tmp_path, capsys):
    call = ["steel_four_bar", "--positions", "9", "--theory", "quasi-static", "--quiet", "-o", str(tmp_path)]
    assert main(call) == 0
    path = tmp_path / "steel_four_bar" / "summary.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "files": json.loads(files)}))
    assert main([*call, "--resume"]) in (0, 2)
    path.write_text(json.dumps({**json.loads(path.read_text()), "files": json.loads(files)}))
    assert main(call) in (0, 2)
    assert "Traceback" not in capsys.readouterr().err


def test_a_summary_table_that_cannot_be_written_keeps_the_old_one(tmp_path, monkeypatch, capsys):
    cases, out = scenes(tmp_path / "in", 2), tmp_path / "out"
    assert main([str(cases), "-o", str(out), "--quiet"]) == 0
    before = (out / "summary.csv").read_bytes()

    monkeypatch.setattr("kinelast.outputs.outbox.sync", full_disk)
    assert main([str(cases), "-o", str(out), "--quiet", "--resume"]) == 0
    assert "no space left on device" in capsys.readouterr().err.lower()
    assert (out / "summary.csv").read_bytes() == before
    assert hidden(out) == []


DAMAGES = {
    "report gone": lambda folder: (folder / "report.html").unlink(),
    "table empty": lambda folder: (folder / "positions.csv").write_text(""),
    "table cut": lambda folder: os.truncate(folder / "positions.csv", 200),
    "summary cut": lambda folder: os.truncate(folder / "summary.json", 200),
    "summary empty": lambda folder: (folder / "summary.json").write_text(""),
    "summary of zeros": lambda folder: (folder / "summary.json").write_bytes(b"\0" * 99),
    "summary gone": lambda folder: (folder / "summary.json").unlink() or [file.unlink() for file in folder.iterdir()],
    "summary nested": lambda folder: (folder / "summary.json").write_text("[" * 10**5),
}


@pytest.mark.parametrize("how", in_tiers(DAMAGES, 3, 0))
def test_a_damaged_folder_is_computed_again(how, tmp_path, capsys):
    call = [str(scenes(tmp_path / "in", 1) / "s0.toml"), "-o", str(tmp_path / "out"), "--resume"]
    assert main(call) == 0
    DAMAGES[how](tmp_path / "out" / "s0")
    capsys.readouterr()
    for again in (False, True):
        assert main(call) == 0
        assert ("already finished" in capsys.readouterr().out) == again
        require_whole(tmp_path / "out" / "s0")


def test_the_digest_is_of_the_computed_text(tmp_path, monkeypatch):
    """The scene file changes during the run; the recorded digest is of the text that was read."""
    import hashlib

    import kinelast.runs.run

    scene = scenes(tmp_path / "in", 1) / "s0.toml"
    first = hashlib.sha256(scene.read_bytes()).hexdigest()
    real = kinelast.runs.run.document_from_bytes

    def changing(content, path):
        scene.write_text(ARM + "# later\n")
        return real(content, path)

    monkeypatch.setattr(kinelast.runs.run, "document_from_bytes", changing)
    assert main([str(scene), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    assert json.loads((tmp_path / "out" / "s0" / "summary.json").read_text())["made_from"]["sha256"] == first


def test_the_next_run_restores_the_folder_moved_by_a_killed_run(tmp_path, capsys):
    """A run killed between two renames leaves the old folder, with a user's notes, under a hidden name."""
    out = tmp_path / "out"
    call = [str(scenes(tmp_path / "in", 1) / "s0.toml"), "-o", str(out)]
    assert main(call) == 0
    (out / "s0" / "notes.txt").write_text("mine")
    token = folders.HIDDEN + "0123456789abcdef"
    (out / "s0").rename(out / f"{token}.old")
    (out / f"{token}.part").mkdir()
    folders._lock_of(out / "s0").write_text(token)
    assert main(call) == 0
    assert (out / "s0" / "notes.txt").read_text() == "mine"
    assert hidden(out) == []


def test_foreign_files_are_kept(tmp_path, capsys):
    cases, out = scenes(tmp_path / "in", 1), tmp_path / "out"
    mine = {"s0/summary.json": '{"mine": 1}', ".s0.part/a": "a", ".s0.old/b": "b", ".kinelast-x.part/c": "c"}
    for name, text in mine.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text)
    for options in ([], ["--structure"]):
        assert main([str(cases), "-o", str(out), *options]) == 2
        assert "has files of other origin (summary.json): move them" in capsys.readouterr().err
    assert {name: (out / name).read_text() for name in mine} == mine
    assert sorted(entry.name for entry in (out / "s0").iterdir()) == ["summary.json"]


def test_a_symbolic_link_in_place_of_a_folder_is_an_error(tmp_path, capsys):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "s0").symlink_to(elsewhere)
    for options in ([], ["--structure"]):
        assert main([str(scenes(tmp_path / "in", 1)), "-o", str(tmp_path / "out"), *options]) == 2
        assert "is a file or a link, not a folder: move it" in capsys.readouterr().err
    assert list(elsewhere.iterdir()) == []


@pytest.mark.parametrize("name", ["..toml", "...toml", "....toml"])
def test_a_scene_without_a_name_writes_nothing(name, tmp_path, capsys):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / name).write_text(ARM)
    before = sorted(tmp_path.rglob("*"))
    assert main([str(tmp_path / "in" / name), "-o", str(tmp_path / "out")]) == 2
    assert "has no name before .toml" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_an_undecodable_name_beside_an_unknown_number_is_written():
    name = os.fsdecode(b"caf\xe9")
    assert json.loads(json_bytes({"scene": name, "safety": math.nan})) == {"scene": name, "safety": None}


def test_undecodable_and_long_names_are_written(tmp_path, capsys):
    for name in (b"caf\xe9", b"\x1b[31mred", b"n" * 250, "stra\u00dfe \u202e".encode()):
        path = os.fsencode(tmp_path) + b"/" + name + b".toml"
        with open(path, "w") as file:  # noqa: PTH123 - the name is bytes
            file.write(ARM)
        assert main([os.fsdecode(path), "-o", str(tmp_path / "out"), "--quiet", "--positions", "2"]) == 0
        require_whole(Path(os.fsdecode(os.fsencode(tmp_path) + b"/out/" + name)))
    assert main([str(tmp_path), "-o", str(tmp_path / "out"), "--positions", "2", "--resume"]) == 0
    said = capsys.readouterr()
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f\u202e]", said.out + said.err)


@pytest.mark.parametrize(
    "argument", ["n" * 300, "n" * 300 + ".toml", "a\0b.toml", "/dev/zero", "[", "*.none", "\x1b[2J", "", " "]
)
def test_arguments_that_name_no_scene_are_errors(argument, tmp_path, capsys):
    assert main([argument, "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert len(said) < 600
    assert not re.search(r"[\x00-\x09\x0b-\x1f]", said)


def test_endless_files_pipes_and_empty_folders_are_errors(tmp_path, capsys):
    (tmp_path / "endless.toml").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "large.toml").write_text("#" * 5_000_000)
    (tmp_path / "empty").mkdir()
    for name, message in (
        ("endless", "a device is not a scene"),
        ("pipe", "a device is not a scene"),
        ("large", "larger than 4 MB"),
    ):
        assert main([str(tmp_path / f"{name}.toml"), "-o", str(tmp_path / "out")]) == 2
        assert message in capsys.readouterr().err
    assert main([str(tmp_path / "empty"), "-o", str(tmp_path / "out")]) == 2
    assert "contains no .toml file" in capsys.readouterr().err


def test_a_deleted_working_folder_is_an_error(tmp_path):
    place = tmp_path / "gone"
    place.mkdir()
    scenes(tmp_path / "in", 1)
    code = f"import os; os.rmdir({str(place)!r}); from kinelast.cli.command import main; raise SystemExit(main("
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent.parent)}
    for call, status in (([str(tmp_path / "in" / "s0.toml"), "-o", "out"], 2), (["s0.toml"], 2)):
        command = [sys.executable, "-c", f"{code}{call!r}))"]
        done = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True, check=False)
        place.mkdir()
        assert (done.returncode, "Traceback" in done.stderr) == (status, False), done.stderr


NINE = '[[drives]]\nlink = "b0"\nspeed = 1\n' + "".join(
    f'[[drives]]\nlink = "b{k}"\non = "b{k - 1}"\nspeed = {k}\n' for k in range(1, 9)
)
CHAIN = (
    '[materials.steel]\nE = 210e9\ndensity = 7850\n[sections.bar]\nshape = "circle"\ndiameter = 0.02\n[points]\n'
    + "".join(f"P{k} = [{0.1 * k}, {0.03 * (k % 2)}]\n" for k in range(10))
    + '[links.ground]\npoints = ["P0"]\n'
    + "".join(f'[links.b{k}]\npoints = ["P{k}", "P{k + 1}"]\nsection = "bar"\nmaterial = "steel"\n' for k in range(9))
    + NINE
    + "[run]\npositions = 6\nduration = 1\n"
)


def test_a_failed_page_keeps_the_figures(tmp_path, monkeypatch, capsys):
    import kinelast.outputs.page

    call = [str(scenes(tmp_path / "in", 1) / "s0.toml"), "-o", str(tmp_path / "out"), "--resume"]
    with monkeypatch.context() as patch:
        patch.setattr(kinelast.outputs.page, "report_page", lambda *_, **__: 1 / 0)
        assert main(call) == 3
    said = capsys.readouterr().err
    assert "s0: largest deflection" in said
    assert "the program failed on report.html" in said
    found = json.loads((tmp_path / "out" / "s0" / "summary.json").read_text())
    assert list(found["failed"]) == ["report.html"]
    assert set(found["files"]) == {"positions.csv"}
    assert main(call) == 0  # computed again, since a file failed
    require_whole(tmp_path / "out" / "s0")


def test_failed_frequencies_keep_the_deflection(tmp_path, monkeypatch):
    def none(*_, **__):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr("elastic.vibration.natural_frequencies", none)
    assert main([str(scenes(tmp_path / "in", 1) / "s0.toml"), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    found = json.loads((tmp_path / "out" / "s0" / "summary.json").read_text())
    assert found["largest_deflection"]["value"]
    assert found["vibration"]["natural"] == []
    assert found["vibration"]["drive_to_lowest"]["value"] is None


def test_a_rigid_scene_has_a_report_for_all_options(tmp_path, capsys):
    rigid = edited(SLIDER_CRANK, *(("section", "#section") for _ in ()))
    text = re.sub(r'section = "\w+"\nmaterial = "\w+"', "rigid = true\nmass = 1\ncenter = [0, 0]", rigid)
    (tmp_path / "rigid.toml").write_text(text)
    call = [str(tmp_path / "rigid.toml"), "-o", str(tmp_path / "out"), "--animate", "deflection", "--check"]
    assert main([*call, "--positions", "4"]) == 0
    said = capsys.readouterr().out
    assert "the film shows the motion of rigid links" in said
    assert (tmp_path / "out" / "rigid" / "motion.mp4").stat().st_size > 1000
    assert "check agrees (momentum " in said
    require_whole(tmp_path / "out" / "rigid")
    check = json.loads((tmp_path / "out" / "rigid" / "check.json").read_text())
    assert (check["passed"], check["largest"]) == (True, None)


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_jobs_bit_for_bit(tmp_path):
    cases = scenes(tmp_path / "in", 1)
    (cases / "chain.toml").write_text(CHAIN)
    for jobs in ("1", "2"):
        assert started(cases, "-o", tmp_path / jobs / "out", "--jobs", jobs, "--fields", "--quiet").wait(120) == 0
    files = [path.relative_to(tmp_path / "1" / "out") for path in (tmp_path / "1").rglob("*") if path.is_file()]
    assert len(files) == 2 * 4 + 2
    for file in files:
        contents = [(tmp_path / jobs / "out" / file).read_bytes() for jobs in ("1", "2")]
        if file.name == "index.html":  # contains the computing time
            contents = [re.sub(rb'"seconds":\{[^}]*\}', b"", content) for content in contents]
        assert contents[0] == contents[1], file


def test_the_package_runs_as_a_module():
    call = [sys.executable, "-m", "kinelast", "--list"]
    done = subprocess.run(call, cwd=Path(__file__).parent.parent, capture_output=True, text=True, check=True)
    assert "steel_four_bar" in done.stdout


@pytest.mark.exhaustive
def test_an_interrupted_integration_keeps_its_results(tmp_path):
    text = (Path(__file__).parent.parent / "kinelast/mechanisms/andrews_squeezer.toml").read_text()
    scene, out = tmp_path / "squeezer.toml", tmp_path / "out"
    scene.write_text(re.sub(r"(?m)^duration = .*", "duration = 10\\nsteps = 1000000", text))  # minutes of computing
    run = started(scene, "-o", out, "--positions", 3000, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(4.0)
    start = time.monotonic()
    os.killpg(run.pid, signal.SIGINT)
    said, _ = run.communicate(timeout=60)
    assert run.returncode == 130
    assert time.monotonic() - start < 20.0  # a step of the integration, and the report
    require_whole(out / "squeezer")
    figures = json.loads((out / "squeezer" / "summary.json").read_text())
    reached = figures["run"]["interrupted"]["value"]
    assert 0 < figures["run"]["end"]["value"] <= reached < 10
    assert b"PARTIAL: interrupted at" in said
    assert finished(out / "squeezer", figures["made_from"])[0] is not None
    other = to_builtins(made_from(scene.read_bytes(), Request(positions=3000), {}))
    assert finished(out / "squeezer", other)[0] is None


@pytest.mark.slow
def test_a_worker_ends_silently_if_its_pipe_closes_with_unread_data(capfd):
    """This happens if the worker is interrupted between an answer and the next task."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    worker = context.Process(target=processes._serve, args=(there, abs))
    worker.start()
    there.close()
    here.send(-3)
    assert here.recv() == 3
    here.send(-4)
    assert here.poll(20)
    here.close()
    worker.join(20)
    assert worker.exitcode == 0
    assert capfd.readouterr().err == ""
