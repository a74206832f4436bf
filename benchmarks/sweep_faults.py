"""Ends of a sweep and faults of its files: 200,000 four-bars, killed, on a full disk, with lost workers, edited.

`python benchmarks/sweep_faults.py [COUNT]`. Every one goes on in the end and must come to the bytes of the undisturbed
one. The small disk is a memory file system of some MB, where this process may mount one.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import measuring
from sweeping import CHUNK, four_bars, identity, tree

from kinelast.sweep.running import run_plan
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import RequestError

COUNT, KILLS, JOBS, FLIPS = 200_000, 10, 2, 17
FIGURES = ("deflection", "mass")
SMALL_DISK = 0.4  # of what the store takes


@dataclass(frozen=True)
class Case:
    """Where the sweep of a case is kept, and how many designs it has."""

    folder: Path
    count: int

    def run(self, **options: Any) -> None:
        """The sweep in this process, or as far as it comes; it goes on with what is kept."""
        evaluation = four_bars(self.count, FIGURES)
        given = {"jobs": JOBS, "resume": True, **options}
        run_plan(self.count, evaluation, self.folder, identity(evaluation), CHUNK, **given)

    def started(self, **limits: Any) -> subprocess.Popen[str]:
        """The sweep in a process of its own."""
        command = [sys.executable, __file__, "--go-on", str(self.folder), str(self.count)]
        return subprocess.Popen(command, text=True, stderr=subprocess.PIPE, stdout=subprocess.PIPE, **limits)

    @property
    def kept(self) -> int:
        """Chunks that are kept."""
        return sum(1 for _ in self.folder.glob("designs.*/[0-9]*"))


def killed(case: Case) -> str:
    """Killed again and again, at any moment, also while it starts."""
    chance, left, chunks = random.Random(9), [], CHUNK
    for number in range(KILLS):
        run, goal = case.started(), case.kept + chance.randrange(0, 1 + 2 * (-(-case.count // chunks)) // (3 * KILLS))
        while case.kept < goal:
            time.sleep(0.01)
        time.sleep(chance.random() * 1.5)
        assert run.poll() is None, run.communicate()
        run.kill()
        run.communicate()
        left.append(case.kept)
        print(f"  kill {number + 1}: {case.kept} chunks kept", flush=True)
    case.run()
    return f"chunks kept after each kill: {', '.join(map(str, left))}"


def disk_full(case: Case, size: int) -> str:
    """On a disk that is too small; then that is made larger."""
    case.folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", case.folder], check=False, capture_output=True
    )
    if mounted.returncode:
        return "left out: no disk can be mounted here"
    inner = Case(case.folder / "sweep", case.count)
    try:
        try:
            inner.run()
            told = "the disk was not full"
        except RequestError as error:
            told = str(error).replace(str(case.folder), "...")
        subprocess.run(["mount", "-o", "remount,size=1g", case.folder], check=True)
        inner.run()
        found = tree(inner.folder)
    finally:
        subprocess.run(["umount", case.folder], check=True)
    for name, content in found.items():
        path = case.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    return told


def worker_killed(case: Case) -> str:
    """One of the processes is killed twice on the way."""
    run, deaths = case.started(), []
    for goal in (3, 10):
        while case.kept < goal:
            time.sleep(0.01)
        worker = max(_workers(run.pid))
        os.kill(worker, signal.SIGKILL)
        deaths.append(f"{goal} chunks kept")
    assert run.wait() == 0, run.communicate()
    return f"killed with {' and '.join(deaths)}"


def edited(case: Case, whole: Path, fault: Callable[[Path, bytes], None]) -> str:
    """A finished store with a fault in one of its files, gone on with: it must be noticed and mended."""
    shutil.copytree(whole, case.folder)
    files = sorted(case.folder.glob("designs.*/[0-9]*")) or [case.folder / "designs.csv"]
    path = random.Random(repr(fault)).choice(files[:-1] or files)
    fault(path, path.read_bytes())
    heard = Heard()
    try:
        case.run(progress=heard)
    except RequestError as error:
        heard.tell(str(error))
        for stray in case.folder.glob("designs.*/[0-9]*77.*"):
            stray.unlink()
    assert heard.sentences, "nothing was said"
    return heard.sentences[0].replace(str(case.folder), "...")


class Heard(Progress):
    """Sentences that were said."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def tell(self, sentence: str) -> None:
        """Note a sentence."""
        self.sentences.append(sentence)


def _cut(path: Path, content: bytes) -> None:
    path.write_bytes(content[: len(content) // 2])


def _empty(path: Path, _: bytes) -> None:
    path.write_bytes(b"")


def _gone(path: Path, _: bytes) -> None:
    path.unlink()


def _longer(path: Path, content: bytes) -> None:
    path.write_bytes(content + content[-40:])


def _swapped(path: Path, content: bytes) -> None:
    other = path.with_name(f"{int(path.stem) + 1:010}{path.suffix}")
    path.write_bytes(other.read_bytes())
    other.write_bytes(content)


def _foreign(path: Path, content: bytes) -> None:
    path.with_name(f"0000009977{path.suffix}").write_bytes(content)


def _flip(at: float) -> Callable[[Path, bytes], None]:
    def fault(path: Path, content: bytes) -> None:
        place = int(at * (len(content) - 1))
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])

    return fault


def _workers(parent: int) -> list[int]:
    """Processes that a process has started to compute."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            owner = int(entry.read_text().rpartition(")")[2].split()[1])
            line = (entry.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if owner == parent and b"spawn_main" in line:
            found.append(int(entry.parent.name))
    return found


def on_dask(case: Case) -> str:
    """Workers of dask, of which one is killed on the way."""
    from threading import Thread

    from distributed import LocalCluster

    with LocalCluster(JOBS, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:

        def lose() -> None:
            while case.kept < 5:
                time.sleep(0.01)
            os.kill(cluster.workers[0].pid, signal.SIGKILL)

        thread = Thread(target=lose, daemon=True)
        thread.start()
        case.run(scheduler=cluster.scheduler_address)
        thread.join()
    return "killed with 5 chunks kept"


def main() -> None:
    if sys.argv[1:2] == ["--go-on"]:
        Case(Path(sys.argv[2]), int(sys.argv[3])).run()
        return
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    rows = []
    with tempfile.TemporaryDirectory() as top:
        whole = Case(Path(top) / "whole", count)
        start = time.perf_counter()
        whole.run()
        rows.append({"what": "undisturbed", "equal": True, "wall [s]": time.perf_counter() - start, "told": ""})
        expected = tree(whole.folder)
        size = int(SMALL_DISK * sum(map(len, expected.values())))
        cases: dict[str, Callable[[Case], str]] = {
            f"killed {KILLS} times (SIGKILL)": killed,
            "disk full": lambda case: disk_full(case, size),
            "a process killed, twice": worker_killed,
            "dask, a worker killed": on_dask,
        }
        faults: dict[str, Callable[[Path, bytes], None]] = {
            "cut in half": _cut,
            "emptied": _empty,
            "gone": _gone,
            "longer": _longer,
            "two chunks swapped": _swapped,
            "a foreign chunk": _foreign,
        }
        faults |= {f"a bit flipped at {at / (FLIPS - 1):.0%}": _flip(at / (FLIPS - 1)) for at in range(FLIPS)}
        for what, fault in faults.items():
            cases[what] = lambda case, fault=fault: edited(case, whole.folder, fault)
        for number, (what, run) in enumerate(cases.items()):
            print(what, flush=True)
            case, start = Case(Path(top) / str(number), count), time.perf_counter()
            told = run(case)
            equal = tree(case.folder) == expected
            rows.append({"what": what, "equal": equal, "wall [s]": time.perf_counter() - start, "told": told})
    notes = [f"{count} four-bars, {JOBS} processes, load of the machine {os.getloadavg()[0]:.1f}"]
    measuring.report("sweep_faults", "What ends a sweep changes no byte of it", {"faults": rows}, notes)
    assert all(row["equal"] for row in rows), "not equal to the undisturbed sweep"


if __name__ == "__main__":
    main()
