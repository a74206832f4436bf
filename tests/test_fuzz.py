"""For any contents of a file and any options, the command gives a status, short messages and whole files.

These are some cases of benchmarks/fuzz_scenes.py. Most are run without pages, which take most of the time.
"""

import sys
from collections import Counter
from pathlib import Path

import pytest
from tiers import in_tiers

sys.path.insert(0, str(Path(__file__).parent.parent / "benchmarks"))
from drawn_scenes import HOW, KEYS, WORDS, drawn_case
from fuzz_scenes import drawn_fault, fault_of

from kinelast.tasks.request import Batch, Request, options_of


@pytest.fixture(autouse=True)
def progress_lines(no_lines_in_between, monkeypatch):
    """Allow progress lines after 10 s: the watch takes them for an answer, and a slow machine is not an error."""
    monkeypatch.setattr("kinelast.cli.terminal.LINE_INTERVAL", 10.0)
    monkeypatch.setattr("fuzz_scenes.SECONDS", 200)


@pytest.mark.parametrize("tens", in_tiers(range(14), 1, 2))
def test_damaged_scenes_are_answered(tens, tmp_path, monkeypatch):
    monkeypatch.setattr("kinelast.outputs.page.report_page", lambda *_, **__: b"<html></html>")
    statuses = []
    for number in range(10 * tens, 10 * tens + 10):
        status, fault = fault_of(2, number, tmp_path / str(number))
        assert not fault, f"case {number}: {fault}"
        statuses.append(status)
    assert 2 in statuses


@pytest.mark.parametrize("tens", in_tiers([0, 2, 1, *range(3, 20)], 0, 2))
def test_drawn_scenes_and_options_are_answered(tens, tmp_path):
    for number in range(10 * tens, 10 * tens + 10):
        _, fault = drawn_fault(4, number, tmp_path / str(number))
        assert not fault, f"case {number}: {fault}"


def test_every_key_and_every_option_is_drawn():
    """Keys are read from the format, so keys of future tables and options are included."""
    count = Counter()
    for number in range(3 * len(KEYS)):
        count.update(drawn_case(5, number).drawn)
    missing = [str(key) for key in KEYS if not any(count[str(key), how] for how in HOW)]
    missing += [
        f"--{name}" for name in WORDS if name not in UNDRAWN and not any(count[f"--{name}", how] for how in HOW)
    ]
    assert not missing
    assert {*WORDS, "live"} == set(options_of(Request, Batch))  # `live` serves until it is ended


UNDRAWN = {"version", "scheduler", "jobs"}  # these end a run, wait long or start processes


def test_the_watch_detects_each_fault(tmp_path, monkeypatch):
    import fuzz_scenes

    def stray(call):
        (Path(call[2]).parent / "stray").write_text("")
        return 0

    def hang(call):
        while True:
            pass

    def bug(call):
        print("Traceback")
        return 3

    def warning(call):
        import warnings

        warnings.warn("divided", RuntimeWarning, stacklevel=1)
        return 0

    def unknown(call):
        print("safety nan")
        return 0

    monkeypatch.setattr(fuzz_scenes, "SECONDS", 0.2)
    wrong = (stray, "elsewhere"), (hang, "no answer"), (bug, "status 3"), (warning, "a warning"), (unknown, "no number")
    for number, (call, what) in enumerate(wrong):
        monkeypatch.setattr(fuzz_scenes, "main", call)
        assert what in fault_of(2, 0, tmp_path / str(number))[1]


@pytest.mark.parametrize(
    ("cell", "fault"),
    [("3.0,inf", ""), ("inf,3.0", "positions.csv: A.w_max [m]: inf"), ("3.0,nan", "positions.csv: safety [1]: nan")],
)
def test_the_watch_accepts_only_an_infinite_safety(cell, fault, tmp_path, monkeypatch):
    import fuzz_scenes

    def answer(call):
        out = Path(call[2])
        out.mkdir(parents=True)
        (out / "positions.csv").write_text(f"A.w_max [m],safety [1]\n{cell}\n")
        return 0

    monkeypatch.setattr(fuzz_scenes, "main", answer)
    assert fault_of(2, 0, tmp_path)[1] == fault
