"""Interrupt a sweep of 200,000 four-bars and damage its files; after `--resume` the bytes must be the same.

    python benchmarks/sweep_faults.py [COUNT]

The sweep is killed, runs on a full disk, loses workers, and gets damaged files. The full disk is a small memory file
system; the script skips it without permission to mount one.
"""

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
from run_faults import disk, remounted, workers
from sweep import CHUNK, four_bars, identity, tree

from kinelast.sweep.running import run_plan
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import RequestError

COUNT, KILLS, JOBS, FLIPS = 200_000, 10, 2, 17
FIGURES = ("deflection", "mass")
SMALL_DISK = 0.4  # size of the disk, relative to the store


@dataclass(frozen=True)
class Case:
    """Folder and number of designs of a sweep."""

    folder: Path
    count: int

    def run(self, **options: Any) -> None:
        """Run or resume the sweep in this process."""
        evaluation = four_bars(self.count, FIGURES)
        given = {"jobs": JOBS, "resume": True, **options}
        run_plan(self.count, evaluation, self.folder, identity(evaluation), CHUNK, **given)

    def started(self, **limits: Any) -> subprocess.Popen[str]:
        """Start the sweep in its own process."""
        command = [sys.executable, __file__, "--go-on", str(self.folder), str(self.count)]
        return subprocess.Popen(command, text=True, stderr=subprocess.PIPE, stdout=subprocess.PIPE, **limits)

    @property
    def kept(self) -> int:
        """Number of completed chunks."""
        return sum(1 for _ in self.folder.glob("designs.*/[0-9]*"))


def killed(case: Case) -> str:
    """Kill the sweep repeatedly at random moments, also during its start."""
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
    """Run on a disk that is too small, then enlarge it and resume."""
    inner = Case(case.folder / "sweep", case.count)
    with disk(case.folder, size) as mounted:
        if not mounted:
            return "left out: no permission to mount a disk"
        try:
            inner.run()
            message = "the disk was not full"
        except RequestError as error:
            message = str(error).replace(str(case.folder), "...")
        remounted(case.folder, "size=1g")
        inner.run()
        found = tree(inner.folder)
    for name, content in found.items():
        path = case.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    return message


def worker_killed(case: Case) -> str:
    """Kill a worker process twice during the sweep."""
    run, deaths = case.started(), []
    for goal in (3, 10):
        while case.kept < goal:
            time.sleep(0.01)
        worker = max(workers(run.pid))
        os.kill(worker, signal.SIGKILL)
        deaths.append(f"{goal} chunks kept")
    assert run.wait() == 0, run.communicate()
    return f"killed with {' and '.join(deaths)}"


def edited(case: Case, whole: Path, fault: Callable[[Path, bytes], None]) -> str:
    """Damage a file of a finished store and resume; the program must report and repair it."""
    shutil.copytree(whole, case.folder)
    files = sorted(case.folder.glob("designs.*/[0-9]*")) or [case.folder / "designs.csv"]
    path = random.Random(repr(fault)).choice(files[:-1] or files)
    fault(path, path.read_bytes())
    heard = Listener()
    try:
        case.run(progress=heard)
    except RequestError as error:
        heard.tell(str(error))
        for stray in case.folder.glob("designs.*/[0-9]*77.*"):
            stray.unlink()
    assert heard.sentences, "no message"
    return heard.sentences[0].replace(str(case.folder), "...")


class Listener(Progress):
    """Progress that keeps all messages."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def tell(self, sentence: str) -> None:
        """Keep a message."""
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


def on_dask(case: Case) -> str:
    """Run on a dask cluster and kill one of its workers."""
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
        rows.append({"fault": "undisturbed", "equal": True, "wall [s]": time.perf_counter() - start, "message": ""})
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
        for name, fault in faults.items():
            cases[name] = lambda case, fault=fault: edited(case, whole.folder, fault)
        for number, (name, run) in enumerate(cases.items()):
            print(name, flush=True)
            case, start = Case(Path(top) / str(number), count), time.perf_counter()
            message = run(case)
            equal = tree(case.folder) == expected
            rows.append({"fault": name, "equal": equal, "wall [s]": time.perf_counter() - start, "message": message})
    notes = [f"{count} four-bars, {JOBS} processes, load of the machine {os.getloadavg()[0]:.1f}"]
    claim = "An interrupted or damaged sweep gives the same bytes after it is resumed"
    measuring.report("sweep_faults", claim, {"faults": rows}, notes)
    assert all(row["equal"] for row in rows), "not equal to the undisturbed sweep"


if __name__ == "__main__":
    main()
