"""Claim: whatever stands in a file, the command answers it: a documented status, short messages, nothing left behind.

Two hundred of the cases of benchmarks/fuzz_scenes.py; nothing is drawn, which takes most of the time.
"""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent.parent / "benchmarks"))
from fuzz_scenes import fault_of


@pytest.mark.parametrize("tens", range(20))
def test_spoilt_scenes_are_answered(tens, tmp_path, monkeypatch):
    monkeypatch.setattr("kinelast.outputs.page.report_page", lambda *_, **__: b"<html></html>")
    statuses = []
    for number in range(10 * tens, 10 * tens + 10):
        status, fault = fault_of(2, number, tmp_path / str(number))
        assert not fault, f"case {number}: {fault}"
        statuses.append(status)
    assert 2 in statuses


def test_the_watch_sees_a_traceback_a_hang_and_what_is_written_elsewhere(tmp_path, monkeypatch):
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

    monkeypatch.setattr(fuzz_scenes, "SECONDS", 0.2)
    for number, (wrong, what) in enumerate(((stray, "elsewhere"), (hang, "no answer"), (bug, "status 3"))):
        monkeypatch.setattr(fuzz_scenes, "main", wrong)
        assert what in fault_of(2, 0, tmp_path / str(number))[1]
