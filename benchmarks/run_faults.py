"""Disturb runs of the command at random moments: signals, lost workers, full and read-only disks.

    python benchmarks/run_faults.py [RUNS] [SEED]    (continues the seed in results/run_faults.csv)

A report, a batch, a sweep and a structure run once undisturbed. Then the script disturbs each, checks its status and
messages, and runs it again with `--resume`. The bytes must be the same, without stray files. Runs are forks of this
process, which has loaded all modules; every tenth starts a new interpreter. The CSV file gets the counts every fifty
runs.
"""

import contextlib
import csv
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import measuring
from sweep import tree

import kinelast.sweep.output as sweeps
from kinelast.cli.command import main
from kinelast.tasks.task import shipped_scenes, shipped_structures

NEW_INTERPRETER_EVERY = 10  # runs
WRITE_EVERY = 50  # runs
RESULTS = measuring.RESULTS / "run_faults.csv"
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL", "SIGSTOP")
FAULTS = (*SIGNALS, "SIGINT twice", "worker killed", "worker stopped", "files too large", "disk full", "read only")
MAX_DISK = 0.7  # size of the full disk, relative to the results
CHUNK = 0.02  # [s] computing time of a chunk, so that small sweeps have many chunks
VARIES = {
    "index.html",
    "summary.parquet",
    "summary.csv",
    "summary.html",
    "summary.json",
}  # files of a batch that contain times
DIVISION = ("chunk", "kept", "sha256")  # keys of a manifest that depend on the chunk size, and so on the clock
MAX_RUN, MAX_EXIT = 1200.0, 120.0  # [s] until a run ends, and until its processes have gone, on a busy machine


@dataclass(frozen=True)
class Job:
    """A call of the command: its arguments without the output folder."""

    name: str
    words: tuple[str, ...]

    @property
    def works_apart(self) -> bool:
        """Whether the command starts worker processes."""
        return "--jobs" in self.words


@dataclass
class Undisturbed:
    """Results and duration of a job without a fault."""

    files: dict[str, bytes]
    seconds: float

    @property
    def size(self) -> int:
        """Total size of the results [bytes]."""
        return sum(map(len, self.files.values()))


@dataclass
class Count:
    """Outcomes of the runs of a job with a fault."""

    runs: int = 0
    early: int = 0  # ended by the fault
    same: int = 0
    statuses: Counter[int] = field(default_factory=Counter)


def jobs_in(place: Path) -> list[Job]:
    """Write small scenes into a folder; return the calls."""
    few = place / "few"
    few.mkdir()
    for name in ("steel_four_bar", "quick_return", "offset_slider_crank"):
        text = shipped_scenes()[name].read_text(encoding="utf-8").replace("positions = 360", "positions = 8")
        (few / f"{name}.toml").write_text(text, encoding="utf-8")
    sweep = shipped_scenes()["press_sweep"].read_text(encoding="utf-8")
    for old, new in (("count = 21", "count = 9"), ("count = 13", "count = 5"), ("positions = 90", "positions = 12")):
        assert old in sweep, old
        sweep = sweep.replace(old, new)
    (place / "swept.toml").write_text(sweep, encoding="utf-8")
    report = (str(few / "steel_four_bar.toml"), "--positions", "8", "--fields", "--stations", "5")
    batch = (str(few), "--positions", "6", "--tables", "html")
    swept = (str(place / "swept.toml"), "--sweep", "--pages", "2")
    structure = (str(shipped_structures()["car_hood"]), str(shipped_structures()["vise_grips"]), "--structure")
    return [
        Job("a report", report),
        Job("a batch", batch),
        Job("a batch, 2 processes", (*batch, "--jobs", "2")),
        Job("a sweep", swept),
        Job("a sweep, 2 processes", (*swept, "--jobs", "2")),
        Job("structures", structure),
    ]


def started(words: list[str], said: Path, new: bool, largest: int = 0) -> int:
    """Start the command with its output in a file; return the process id."""
    if new:
        limit = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))) if largest else None
        with said.open("wb") as file:
            command = [sys.executable, "-m", "kinelast", *words]
            return subprocess.Popen(command, stdout=file, stderr=file, preexec_fn=limit, start_new_session=True).pid  # noqa: PLW1509 - no threads
    if number := os.fork():
        return number
    status = 3
    try:
        os.setsid()
        file = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, 1)
        os.dup2(file, 2)
        if largest:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
        sys.stdout, sys.stderr = (os.fdopen(each, "w", closefd=False) for each in (1, 2))
        status = main(words)
    except KeyboardInterrupt:
        status = 130  # see `kinelast.cli.main`
    except BaseException as error:
        os.write(2, f"Traceback: {error!r}\n".encode())
    finally:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        os._exit(status)


def waited(number: int, seconds: float = MAX_RUN) -> int:
    """Wait for a process; return its status, -N if signal N ended it, or -99 if it had to be killed."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        process, state = os.waitpid(number, os.WNOHANG)
        if process:
            return os.waitstatus_to_exitcode(state)
        time.sleep(0.005)
    os.killpg(number, signal.SIGKILL)
    os.waitpid(number, 0)
    return -99


def gone(group: int, seconds: float = MAX_EXIT) -> bool:
    """Wait until all processes of a group have ended; return whether they did in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    os.killpg(group, signal.SIGKILL)
    return False


def workers(parent: int) -> list[int]:
    """Return the worker processes of a process."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            owner = int(entry.read_text().rpartition(")")[2].split()[1])
            if owner == parent and b"spawn_main" in (entry.parent / "cmdline").read_bytes():
                found.append(int(entry.parent.name))
    return found


@contextlib.contextmanager
def disk(folder: Path, size: int) -> Iterator[bool]:
    """Mount a memory file system of `size` bytes at a folder; yield whether that succeeded."""
    folder.mkdir()
    call = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    mounted = subprocess.run(call, check=False, capture_output=True).returncode == 0
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", "-l", str(folder)], check=True)


def remounted(folder: Path, options: str) -> None:
    """Remount a file system with other options."""
    subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True, capture_output=True)


class Runs:
    """Runs of the command in a folder."""

    def __init__(self, place: Path) -> None:
        self.place, self.number, self.chance = place, 0, random.Random()
        self.said = place / "said"

    def undisturbed(self, job: Job) -> Undisturbed:
        """Run a job without a fault; return its results and duration."""
        out = self.place / "whole"
        start = time.monotonic()
        status = waited(started([*job.words, "-o", str(out)], self.said, new=False))
        assert status in (0, 1), self.said.read_text()
        seconds = time.monotonic() - start
        files = results(out)
        shutil.rmtree(out)
        return Undisturbed(files, seconds)

    def disturbed(self, job: Job, fault: str, whole: Undisturbed) -> tuple[int, list[str]]:
        """Run a job with a fault, then resume it; return the first status and all problems found."""
        self.number += 1
        top = self.place / f"run{self.number}"
        new = self.number % NEW_INTERPRETER_EVERY == 0
        wrong: list[str] = []
        size = max(16384, int(self.chance.uniform(0.0, MAX_DISK) * whole.size))
        needs_disk = fault in ("disk full", "read only")
        with disk(top, size if fault == "disk full" else 1 << 28) if needs_disk else folder_at(top):
            out = top / "out"
            words = [*job.words, "-o", str(out)]
            largest = (
                int(self.chance.uniform(0.02, 0.9) * max(map(len, whole.files.values())))
                if fault == "files too large"
                else 0
            )
            number = started(words, self.said, new, largest)
            if fault not in ("files too large", "disk full"):
                time.sleep(self.chance.uniform(0.0, 1.1) * whole.seconds + (0.3 if new else 0.0))
                self._strike(number, fault, top)
            status = waited(number)
            said = self.said.read_text("utf-8", "replace")
            wrong += self._looked_at(number, status, said, fault, top)
            if fault == "disk full":
                remounted(top, "size=256m")
            elif fault == "read only":
                remounted(top, "rw")
            first = results(out)
            again = waited(started([*words, "--resume"], self.said, new=False))
            if again not in (0, 1):
                wrong.append(f"--resume ends with {again}: {self.said.read_text('utf-8', 'replace')[-300:]}")
            wrong += differences(results(out), whole.files)
            wrong += [f"not in {name}: {each}" for name, each in scenes_without_row(out)]
            wrong += [f"left over: {path.name}" for path in top.rglob("*") if path.name.startswith(".")]
            wrong += [f"lost: {name}" for name in first if name not in results(out) and name in whole.files]
        shutil.rmtree(top, ignore_errors=True)
        return status, wrong

    def _strike(self, number: int, fault: str, top: Path) -> None:
        with contextlib.suppress(ProcessLookupError):
            match fault:
                case "SIGINT twice":
                    for _ in range(2):
                        os.kill(number, signal.SIGINT)
                        time.sleep(self.chance.uniform(0, 0.05))
                case "SIGSTOP":
                    os.killpg(number, signal.SIGSTOP)
                    time.sleep(self.chance.uniform(0, 0.5))
                    os.killpg(number, signal.SIGCONT)
                case "worker killed" | "worker stopped":
                    for worker in workers(number)[:1]:
                        os.kill(worker, signal.SIGKILL if fault == "worker killed" else signal.SIGSTOP)
                        if fault == "worker stopped":
                            time.sleep(self.chance.uniform(0, 0.5))
                            os.kill(worker, signal.SIGCONT)
                case "read only":
                    with contextlib.suppress(subprocess.CalledProcessError):  # busy: a file is open for writing
                        for _ in range(50):
                            remounted(top, "ro")
                            break
                case _:
                    os.kill(number, getattr(signal, fault))

    def _looked_at(self, process: int, status: int, said: str, fault: str, top: Path) -> list[str]:
        """Problems of a disturbed run: status, messages, stray files, processes."""
        number = getattr(signal, fault, 0)
        expected = {0, 1, 2, 128 + number, -number} if number not in (0, signal.SIGSTOP) else {0, 1, 2}
        expected |= {130, -signal.SIGINT} if "SIGINT" in fault else set()
        expected |= {3} if fault == "worker killed" else set()  # the scene of the worker has failed
        wrong = [] if status in expected else [f"status {status}: {said[-300:]}"]
        if "Traceback" in said or "please report" in said:
            wrong.append(f"says {said[-600:]}")
        if number != signal.SIGKILL and fault != "read only":
            wrong += [f"half done: {path.name}" for path in top.rglob(".kinelast-*")]
        return wrong if gone(process) else [*wrong, "a process is still running"]


@contextlib.contextmanager
def folder_at(path: Path) -> Iterator[bool]:
    """Make a folder; yield True as `disk` does."""
    path.mkdir()
    yield True


def results(out: Path) -> dict[str, bytes]:
    """Return all result files by name, without files and keys that depend on the clock."""
    if not out.exists():
        return {}
    kept = {name: content for name, content in tree(out).items() if name not in VARIES}
    return {name: undivided(content) if name.endswith("manifest.json") else content for name, content in kept.items()}


def undivided(manifest: bytes) -> bytes:
    """Return a sweep's manifest without its division into chunks, which depends on the interruption."""
    try:
        content = json.loads(manifest)
    except ValueError:
        return manifest
    return json.dumps({key: value for key, value in content.items() if key not in DIVISION}).encode()


def scenes_without_row(out: Path) -> list[tuple[str, str]]:
    """Return scenes missing in a table of all scenes, as (table, scene)."""
    scenes = [each.name for each in out.iterdir() if each.is_dir()]
    tables = [out / name for name in ("index.html", "summary.csv") if len(scenes) > 2]
    texts = {path.name: path.read_text(encoding="utf-8") if path.exists() else "" for path in tables}
    return [(name, scene) for name, text in texts.items() for scene in scenes if scene not in text]


def differences(found: dict[str, bytes], expected: dict[str, bytes]) -> list[str]:
    """Return the names of files that differ."""
    return [
        f"{'missing' if name not in found else 'stray' if name not in expected else 'other bytes'}: {name}"
        for name in sorted(found.keys() | expected.keys())
        if found.get(name) != expected.get(name)
    ]


def run(count: int, seed: int) -> int:
    """Disturb `count` further runs of a seed; return the number of failed ones."""
    sweeps.CHUNK_TIME = CHUNK  # in this process and its forks
    signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs of a shell ignore it
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    counts = noted()
    done = sum(entry.runs for (of, *_), entry in counts.items() if of == seed)
    wrongs = 0
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        with disk(place / "try", 1 << 20) as mounts:
            faults = [fault for fault in FAULTS if mounts or fault not in ("disk full", "read only")]
        runs = Runs(place)
        wholes = [(job, runs.undisturbed(job)) for job in jobs_in(place)]
        wholes = [(job, runs.undisturbed(job)) for job, _ in wholes]  # all modules are loaded now
        for number in range(done, done + count):
            job, whole = wholes[number % len(wholes)]
            having = [each for each in faults if job.works_apart or not each.startswith("worker")]
            fault = having[number // len(wholes) % len(having)]
            runs.chance = random.Random(f"{seed} {number}")
            status, wrong = runs.disturbed(job, fault, whole)
            entry = counts.setdefault((seed, job.name, fault), Count())
            entry.runs += 1
            entry.early += status not in (0, 1)
            entry.same += not wrong
            entry.statuses[status] += 1
            if wrong:
                wrongs += 1
                print(f"run {number} of seed {seed}, {job.name}, {fault}: {wrong[:4]}", flush=True)
            if number % WRITE_EVERY == WRITE_EVERY - 1 or number == done + count - 1:
                write(counts)
    return wrongs


def noted() -> dict[tuple[int, str, str], Count]:
    """Read the counts of earlier runs, by seed, job and fault."""
    if not RESULTS.exists():
        return {}
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return {
            (int(row["seed"]), row["of"], row["fault"]): Count(
                int(row["runs"]),
                int(row["ended early"]),
                int(row["same bytes at last"]),
                Counter({int(part.split(":")[0]): int(part.split(":")[1]) for part in row["statuses"].split()}),
            )
            for row in csv.DictReader(file)
        }


def write(counts: dict[tuple[int, str, str], Count]) -> None:
    """Write the counts."""
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("of", "fault", "runs", "ended early", "same bytes at last", "statuses", "seed"))
        for (seed, job, fault), entry in sorted(counts.items()):
            statuses = " ".join(f"{status}:{often}" for status, often in sorted(entry.statuses.items()))
            writer.writerow((job, fault, entry.runs, entry.early, entry.same, statuses, seed))


if __name__ == "__main__":
    words = [*map(int, sys.argv[1:])]
    sys.exit(min(run(*(words or [1000]), *([1] if len(words) < 2 else [])), 1))
