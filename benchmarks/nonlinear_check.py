"""The nonlinear check on random scenes: how many it answers, how many verdicts are right, and its time.

    python benchmarks/nonlinear_check.py [SEED] [SCENES] [FIRST]

A second solution with a far finer tolerance is the reference for each check. A false alarm is a check that differs
although the reference agrees; a false pass agrees although the reference differs. The CSV file keeps the rows of other
seeds, and those of this seed before scene FIRST. docs/validity.md lists the results.
"""

import math
import statistics
import sys
import time
from collections.abc import Sequence
from itertools import islice
from typing import Any

import measuring
from random_scenes import scenes

from kinelast.answers import checks
from kinelast.answers.checks import NotMade
from kinelast.runs import computed
from kinelast.tasks.request import Request

SEED, SCENES = 0, 55
MAX_SECONDS = 20.0  # processor time of a check
FINE = 12.0  # allowed difference / tolerance of the reference
MARGIN = 0.05  # closest distance to the allowed difference at which a verdict counts as wrong, relative to it
TARGET = measuring.RESULTS / "nonlinear_check.csv"


def checked(results: Any) -> tuple[Any, float]:
    """Return the check, or the reason why it failed, and its processor time [s]."""
    start = time.process_time()
    try:
        with measuring.processor_limit(MAX_SECONDS):
            found: Any = checks.nonlinear_check(results)
    except measuring.TooLongError as error:
        found = NotMade(str(error))
    return found, time.process_time() - start


def reference(results: Any) -> Any:
    """Return the check with the tolerance of the reference."""
    usual = checks.DIVISORS
    checks.DIVISORS = (FINE,)
    try:
        return checked(results)[0]
    finally:
        checks.DIVISORS = usual


def row(scene: Any) -> dict[str, Any]:
    """Return the check of a scene and its reference."""
    results = computed(scene, Request())
    assert results.answer is not None
    check, seconds = checked(results)
    head: dict[str, Any] = {"scene": scene.name, "kind": scene.title, "theory": results.answer.theory}
    head |= {"stated error": results.answer.by_motion, "seconds": seconds}
    if isinstance(check, NotMade):
        return {**head, "outcome": check.problem.split(":")[0]}
    head |= {"apart": check.largest, "estimate": check.estimate, "own error": check.error, "steps": check.steps}
    head |= {"elements": check.elements, "outcome": {True: "agrees", False: "differs", None: "open"}[check.passed]}
    best = reference(results)
    if isinstance(best, NotMade):
        return {**head, "truth": best.problem.split(":")[0]}
    return {**head, "truth": best.largest, "truth's error": best.error, "verdict": verdict(check, best)}


def verdict(check: Any, best: Any) -> str:
    """Compare a check with its reference: right, false alarm or false pass."""
    allowed = checks.allowed_difference(best.estimate)
    if check.passed is None or math.isnan(allowed) or abs(best.largest / allowed - 1) < MARGIN:
        return "right"
    if check.passed == (best.largest <= allowed):
        return "right"
    return "false pass" if check.passed else "false alarm"


def totals(rows: Sequence[dict[str, Any]]) -> str:
    """Return the counts of outcomes and verdicts, and the times, as text."""
    answered = [each for each in rows if each["outcome"] in ("agrees", "differs", "open")]
    seconds = sorted(float(each["seconds"]) for each in rows)
    count = {name: sum(each.get("verdict") == name for each in rows) for name in ("right", "false alarm", "false pass")}
    outcomes = {name: sum(each["outcome"] == name for each in rows) for name in ("agrees", "differs", "open")}
    times = f"median {statistics.median(seconds):.2f} s, 95th percentile {seconds[int(0.95 * len(seconds))]:.2f} s"
    return f"{len(answered)} of {len(rows)} answered {outcomes}, {count}; {times}"


def of_seed(row: dict[str, Any], seed: int) -> bool:
    """Return whether a row belongs to a seed."""
    return row["scene"].startswith(f"{seed}-")


def main() -> None:
    seed, count, first = map(int, [*sys.argv[1:], *(SEED, SCENES, 0)[len(sys.argv) - 1 :]])
    rows = measuring.read_rows(TARGET)
    kept = [each for each in rows if of_seed(each, seed)][:first]
    rows = [each for each in rows if not of_seed(each, seed)] + kept
    for scene in islice(scenes(seed), first, count):
        rows.append(row(scene))
        print(rows[-1], flush=True)
        measuring.write_rows(TARGET, rows)
    print(totals([each for each in rows if of_seed(each, seed)]))


if __name__ == "__main__":
    main()
