"""The nonlinear check as users ask for it, on scenes of all kinds drawn at random: answered, right, and how fast.

    python benchmarks/nonlinear_check.py SEED [scenes] [first]

For every scene the check is made, and then the same beams are solved once more to a far finer tolerance: whether the
answer is as near as it says follows from that without the check's own error. A false alarm is a check that differs
where the fine one agrees, a false pass one that agrees where the fine one differs. Rows of other seeds stay, those of
this one up to scene `first`. docs/validity.md says what came out.
"""

from __future__ import annotations

import csv
import math
import signal
import statistics
import sys
import time
from collections.abc import Sequence
from itertools import islice
from typing import Any

import measuring
from random_scenes import scenes

from kinelast.figures import checks
from kinelast.figures.results import NotMade
from kinelast.runs import computed
from kinelast.tasks.request import Request

SCENES = 55
LONGEST, LONGEST_FINE = 20.0, 20.0  # seconds of the processor
FINE = 12.0  # parts of what is allowed that the fine check may be off by
MARGIN = 0.05  # of what is allowed, within which neither is false
TARGET = measuring.RESULTS / "nonlinear_check.csv"


class TooLongError(BaseException):
    """The check takes too long."""


def late(*_: Any) -> None:
    """End it."""
    raise TooLongError


def made(results: Any, seconds: float) -> tuple[Any, float]:
    """The check, or why there is none, and the seconds it took."""
    start = time.process_time()
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        found: Any = checks.nonlinear_check(results)
    except TooLongError:
        found = NotMade(f"more than {seconds:g} s")
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    return found, time.process_time() - start


def fine(results: Any) -> Any:
    """The check to a tolerance that decides."""
    usual = checks.DIVISORS
    checks.DIVISORS = (FINE,)
    try:
        return made(results, LONGEST_FINE)[0]
    finally:
        checks.DIVISORS = usual


def row(scene: Any) -> dict[str, Any]:
    """What the check says of a scene, and what is so."""
    results = computed(scene, Request())
    assert results.answer is not None
    check, seconds = made(results, LONGEST)
    told: dict[str, Any] = {"scene": scene.name, "kind": scene.title, "theory": results.answer.theory}
    told |= {"told": results.answer.by_motion, "seconds": seconds}
    if isinstance(check, NotMade):
        return {**told, "outcome": check.problem.split(":")[0]}
    told |= {"apart": check.largest, "estimate": check.estimate, "own error": check.error, "steps": check.steps}
    told |= {"elements": check.elements, "outcome": {True: "agrees", False: "differs", None: "open"}[check.passed]}
    best = fine(results)
    if isinstance(best, NotMade):
        return {**told, "truth": best.problem.split(":")[0]}
    return {**told, "truth": best.largest, "truth's error": best.error, "verdict": verdict(check, best)}


def verdict(check: Any, best: Any) -> str:
    """Whether the check says what is so."""
    allowed = checks.allowed_difference(best.estimate)
    if check.passed is None or math.isnan(allowed) or abs(best.largest / allowed - 1) < MARGIN:
        return "right"
    if check.passed == (best.largest <= allowed):
        return "right"
    return "false pass" if check.passed else "false alarm"


def write(rows: Sequence[dict[str, Any]]) -> None:
    """All rows."""
    head = list(dict.fromkeys(key for each in rows for key in each))
    with TARGET.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, head)
        writer.writeheader()
        writer.writerows([{k: f"{v:.4g}" if isinstance(v, float) else v for k, v in each.items()} for each in rows])


def told(rows: Sequence[dict[str, Any]]) -> str:
    """What it comes to."""
    answered = [each for each in rows if each["outcome"] in ("agrees", "differs", "open")]
    seconds = sorted(float(each["seconds"]) for each in rows)
    count = {name: sum(each.get("verdict") == name for each in rows) for name in ("right", "false alarm", "false pass")}
    outcomes = {name: sum(each["outcome"] == name for each in rows) for name in ("agrees", "differs", "open")}
    times = f"median {statistics.median(seconds):.2f} s, 95th percentile {seconds[int(0.95 * len(seconds))]:.2f} s"
    return f"{len(answered)} of {len(rows)} answered {outcomes}, {count}; {times}"


def of_seed(row: dict[str, Any], seed: int) -> bool:
    """Whether a row is of scenes of a seed."""
    return row["scene"].startswith(f"{seed}-")


def main() -> None:
    signal.signal(signal.SIGVTALRM, late)
    seed, count, first = (int(given) for given in [*sys.argv[1:], *("0", "55", "0")[len(sys.argv) - 1 :]])
    with TARGET.open(encoding="utf-8") as stream:
        rows: list[dict[str, Any]] = list(csv.DictReader(stream))
    kept = [each for each in rows if of_seed(each, seed)][:first]
    rows = [each for each in rows if not of_seed(each, seed)] + kept
    for scene in islice(scenes(seed), first, count):
        rows.append(row(scene))
        print(rows[-1], flush=True)
        write(rows)
    print(told([each for each in rows if of_seed(each, seed)]))


if __name__ == "__main__":
    main()
