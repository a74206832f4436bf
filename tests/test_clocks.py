"""Claim: a clock that jumps and a machine that sleeps change no result, lose nothing and refuse nothing.

Clocks are replaced in every process by a `sitecustomize`: the time of day jumps by years at every look, or is an hour
ahead or behind for a while; all clocks go on by eight hours now and then, as those of some systems do after a sleep.
"""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from scene_texts import FOUR_BAR, edited

from kinelast.outputs.outbox import locked

CLOCKS = """
import os, random, time

begin, moment = time.monotonic(), time.monotonic
chance, periods = random.Random(os.getpid()), lambda: int((moment() - begin) / 0.4)
ahead = {
    "leaps": lambda: chance.choice((-1e9, -3600.0, 0.0, 3600.0, 1e9)),
    "hours": lambda: (0.0, 3600.0, -3600.0)[periods() % 3],
    "sleeps": lambda: 28800.0 * periods(),
}[os.environ["CLOCK"]]


def wrong(clock, unit):
    return lambda: clock() + type(clock())(unit * ahead())


for name in ("time", "monotonic", "perf_counter") if os.environ["CLOCK"] == "sleeps" else ("time",):
    for ending, unit in (("", 1.0), ("_ns", 1e9)):
        setattr(time, name + ending, wrong(getattr(time, name + ending), unit))
"""

SWEEP = """
[sweep]
figures = ["mass", "deflection"]
[sweep.vary]
"sections.bar.depth" = {from = "5 mm", to = "9 mm", count = 30}
"sections.bar.width" = {from = "8 mm", to = "14 mm", count = 10}
"""


def results(folder, clock, *options):
    """Contents of the files that hold results, by their places, of a run under a clock; "" is the honest one."""
    here, out = Path(__file__).parent.parent, folder / "out" / (clock or "honest")
    (folder / "clocks").mkdir(exist_ok=True)
    (folder / "clocks" / "sitecustomize.py").write_text(CLOCKS)
    path = [*([str(folder / "clocks")] if clock else []), str(here)]
    env = {**os.environ, "CLOCK": clock, "PYTHONPATH": os.pathsep.join(path)}
    call = [sys.executable, "-m", "kinelast", *map(str, options), "-o", str(out), "--jobs", "2"]
    given = {"cwd": folder, "env": env, "capture_output": True, "text": True, "timeout": 300}
    done = subprocess.run(call, check=False, **given)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    again = subprocess.run([*call, "--resume"], check=False, **given)
    assert again.returncode == 0, again.stderr
    names = [path for path in sorted(out.rglob("*")) if path.suffix == ".csv" or path.name == "summary.json"]
    assert not list(out.rglob(".*"))
    return {path.relative_to(out): path.read_bytes() for path in names}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["reports", "sweep"])
def test_results_and_resuming_do_not_depend_on_clocks(kind, tmp_path):
    scene = edited(FOUR_BAR, ("positions = 36", "positions = 12")) + SWEEP
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(scene)
    options = ["one.toml", "--sweep"] if kind == "sweep" else ["one.toml", "two.toml"]
    honest = results(tmp_path, "", *options)
    assert len(honest) >= 2
    for clock in ("leaps", "hours", "sleeps"):
        assert results(tmp_path, clock, *options) == honest, clock


def test_another_run_is_waited_for_though_the_machine_sleeps(tmp_path, monkeypatch):
    """Its minute of patience is one of trying, not of a clock that went on by hours."""
    honest, looks = time.monotonic, iter(range(10**9))
    held, let_go = threading.Event(), threading.Event()

    def another():
        with locked(tmp_path / "arm"):
            held.set()
            let_go.wait(10)

    thread = threading.Thread(target=another)
    thread.start()
    assert held.wait(10)
    monkeypatch.setattr("kinelast.outputs.outbox.time.monotonic", lambda: honest() + 28800.0 * next(looks))
    monkeypatch.setattr("kinelast.outputs.outbox.time.sleep", lambda _: (let_go.set(), thread.join(10)))
    with locked(tmp_path / "arm") as hidden:
        assert hidden
