"""Stated errors of courses compared with exudyn, for random mechanisms with a requested accuracy of 5, 2 and 0.5 %.

    python benchmarks/exudyn_errors.py SEED [COUNT]    (replaces the seed's rows in results/exudyn_errors.csv)
    python benchmarks/exudyn_errors.py show            (counts, and rows with a wrong error)

`exudyn_drawn` provides the mechanisms and runs exudyn. The program states an error for each field and for the joint
forces, relative to the maximum of the beam or joint. An error counts if it exceeds 0.1 %, stated or true, and if the
reference is known to a quarter of it.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import exudyn
import exudyn_drawn as drawn
import measuring
import numpy as np
from exudyn_model import FIELDS, Course, integrated
from msgspec.structs import replace

from kinelast.answers.answer import JOINT_FORCES
from kinelast.runs import computed
from kinelast.scene.data import Scene
from kinelast.tasks.request import Request

ACCURACIES = 0.005, 0.02, 0.05
STEPS = 3600, 7200  # steps of the reference models for a turn; more if the reference is not known well enough
MAX_OWN = 0.05  # largest error of a reference that is not computed again
LEAST = 0.001  # smallest error that counts
KNOWN = 0.25  # largest error of the reference, relative to the error
TARGET = measuring.RESULTS / "exudyn_errors.csv"


def reference(scene: Scene, results: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the courses of exudyn by name, extrapolated in elements and time steps, and of its finest models."""
    beta, times = results.answer.vibrating.damping.beams, results.motion.time
    span, turns, from_rest = drawn.integration(scene, results)
    first = (turns - 1) * drawn.POSITIONS
    for steps in STEPS:
        courses = []
        for elements, each in ((16, steps), (32, steps), (16, 2 * steps)):  # extrapolated in both numbers
            sizes = beta, elements, span, turns, each, drawn.POSITIONS
            model = integrated(scene, results.motion, *sizes, from_rest=from_rest)
            courses.append(model.course(first, first + len(times)))
        coarse, more_elements, more_steps = courses
        fine = more_elements + more_steps + coarse.times(-1.0)
        best, fine = by_name(fine.times(4 / 3) + coarse.times(-1 / 3)), by_name(fine)
        if max(drawn.apart(fine[name], best[name]) for name in best) <= 100 * MAX_OWN:
            break
    return best, fine


def by_name(course: Course) -> dict[str, Any]:
    """Return the courses by the names that the program uses."""
    return {**{name: course.fields[name] for name in FIELDS}, JOINT_FORCES: course.joints}


def rows_of(scene: Scene, folder: Path) -> Iterator[dict[str, Any]]:
    """Yield a row for each accuracy and course. The reference is kept in a folder."""
    known, kept = None, folder / f"{scene.name}.npz"
    for accuracy in ACCURACIES:
        asked = replace(scene, theory=replace(scene.theory, accuracy=accuracy))
        start = time.process_time()
        results = computed(asked, Request())
        seconds = time.process_time() - start
        answer = results.answer
        head = {"scene": scene.name, "kind": scene.title, "accuracy": accuracy, "s": seconds}
        if answer is None or not answer.courses or (answer.vibrating is None and not kept.exists()):
            yield {**head, "unanswered": (answer and answer.unknown) or "no steady state, or none was needed"}
            continue
        head |= {"theory": answer.theory}
        if known is None:
            if not kept.exists():
                try:
                    best, fine = reference(scene, results)
                except exudyn.SolverError as problem:
                    yield {**head, "unanswered": f"exudyn: {problem}"}
                    return
                np.savez(kept, **{f"best {k}": v for k, v in best.items()}, **{f"fine {k}": v for k, v in fine.items()})
            known = dict(np.load(kept))
        mine = by_name(drawn.of_answer(results))
        for name, stated in answer.courses.items():
            true = drawn.apart(mine[name], known[f"best {name}"]) / 100
            own = drawn.apart(known[f"fine {name}"], known[f"best {name}"]) / 100
            yield {**head, "course": name, "stated": stated, "true": true, "of reference": own,
                   "reached": answer.accurate}  # fmt: skip


def show() -> None:
    """Print the counts, and every row that is off by more than a factor of two."""
    counts = {"errors": 0, "within a factor of two": 0, "three times too low": 0, "three times too high": 0,
              "false met": 0, "false not reached": 0}  # fmt: skip
    rows = measuring.read_rows(TARGET)
    missed = {
        (row["scene"], row["accuracy"])
        for row in rows
        if not row.get("unanswered") and float(row["true"]) + float(row["of reference"]) >= float(row["accuracy"])
    }  # answers with at least one course that does not reach the accuracy
    for row in rows:
        if row.get("unanswered"):
            print(row["scene"], row["kind"], row["accuracy"], row["unanswered"])
            continue
        stated, true, own = float(row["stated"]), float(row["true"]), float(row["of reference"])
        accuracy, notes = float(row["accuracy"]), []
        if row["reached"] == "True" and true - own > accuracy:
            notes.append("false met")
        if row["reached"] == "False" and stated > accuracy and (row["scene"], row["accuracy"]) not in missed:
            notes.append("false not reached")
        if max(stated, true) > LEAST and own < KNOWN * max(stated, true):
            counts["errors"] += 1
            counts["within a factor of two"] += 0.5 <= stated / true <= 2
            notes += ["within"] if 0.5 <= stated / true <= 2 else ["off"]
            notes += ["three times too low"] if true > 3 * stated else []
            notes += ["three times too high"] if stated > 3 * true else []
        for note in notes:
            if note in counts:
                counts[note] += 1
        if notes not in ([], ["within"]):
            print(row["scene"], row["kind"], row["accuracy"], row["theory"], row["course"],
                  f"stated {stated:.3%} true {true:.3%} reference {own:.3%}", notes)  # fmt: skip
    print(counts)


def main() -> None:
    """Compare mechanisms of a seed, or show the counts."""
    if sys.argv[1] == "show":
        show()
        return
    seed, count = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 20
    folder = Path("build/exudyn")
    folder.mkdir(parents=True, exist_ok=True)
    others = [row for row in measuring.read_rows(TARGET) if not row["scene"].startswith(f"{seed}-")]
    rows: list[dict[str, Any]] = []
    for scene in drawn.chosen(seed):
        if len({row["scene"] for row in rows if not row.get("unanswered")}) == count:
            return
        rows += rows_of(scene, folder)
        print(scene.name, scene.title, rows[-1]["s"], flush=True)
        measuring.write_rows(TARGET, others + rows)


if __name__ == "__main__":
    main()
