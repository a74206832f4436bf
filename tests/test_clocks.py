"""Jumping clocks and a suspended machine do not change results, lose data or block a run.

A `sitecustomize` replaces the clocks in every process. The time of day jumps by years at each call, or is an hour off
for a while. All clocks sometimes advance by eight hours, as after a suspension.
"""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from scene_texts import FOUR_BAR, edited
from tiers import in_tiers

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
    """Return the contents of result files of a run under a clock; "" is the real clock."""
    here, out = Path(__file__).parent.parent, folder / "out" / (clock or "expected")
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


@pytest.mark.parametrize("kind", in_tiers(["reports", "sweep"], 0, 1))
def test_results_and_resuming_do_not_depend_on_clocks(kind, tmp_path):
    scene = edited(FOUR_BAR, ("positions = 36", "positions = 12")) + SWEEP
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(scene)
    options = ["one.toml", "--sweep"] if kind == "sweep" else ["one.toml", "two.toml"]
    expected = results(tmp_path, "", *options)
    assert len(expected) >= 2
    for clock in ("leaps", "hours", "sleeps"):
        assert results(tmp_path, clock, *options) == expected, clock


def test_a_run_waits_for_another_despite_a_suspension(tmp_path, monkeypatch):
    """The patience of one minute counts attempts, not the time of a clock that advanced by hours."""
    expected, looks = time.monotonic, iter(range(10**9))
    held, let_go = threading.Event(), threading.Event()

    def another():
        with locked(tmp_path / "arm"):
            held.set()
            let_go.wait(10)

    thread = threading.Thread(target=another)
    thread.start()
    assert held.wait(10)
    monkeypatch.setattr("kinelast.outputs.outbox.time.monotonic", lambda: expected() + 28800.0 * next(looks))
    monkeypatch.setattr("kinelast.outputs.outbox.time.sleep", lambda _: (let_go.set(), thread.join(10)))
    with locked(tmp_path / "arm") as hidden:
        assert hidden
