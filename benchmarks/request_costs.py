"""Time of each request on its own: motion, reactions, fields, extremes, stresses, check."""

from collections.abc import Callable
from typing import Any

import measuring
import numpy as np
from jobs import Job, steel_four_bar

from elastic import PRIMARY, deflection, extremes, rectangle, sample, section_of
from fem_check import compare, solve
from rigid import drive_efforts, reactions

POSITIONS = (360, 4096)
CHECKED = 360  # positions of the finite-element check
XI = np.linspace(0, 1, 101)


def requests(job: Job) -> dict[str, Callable[[], Any]]:
    """Calls by name; the input of each is computed beforehand."""
    course = job.motion()
    forces = reactions(course)
    solved = deflection(course, job.sections)
    solid = section_of(rectangle(0.006, 0.01), 210e9, yield_stress=235e6)
    with_stress = deflection(course, [solid] * len(job.sections))
    return {
        "motion": job.motion,
        "+ reactions": lambda: reactions(course),
        "+ drive effort": lambda: drive_efforts(course, forces),
        "+ polynomials of all fields (reactions included)": lambda: deflection(course, job.sections),
        "+ chord-relative deflection": lambda: sample(solved, "chord", [0.0, 0.5, 1.0]),
        "+ exact extremes of all fields": lambda: extremes(solved),
        "+ exact extremes of M alone": lambda: extremes(solved, ["M"]),
        "+ all fields at 101 stations": lambda: [sample(solved, field, XI) for field in PRIMARY],
        "+ w at 101 stations": lambda: sample(solved, "w", XI),
        "+ greatest stresses": lambda: extremes(with_stress, ["normal", "shear", "mises"]),
    }


def checks() -> dict[str, Callable[[], Any]]:
    """Finite-element checks of the four-bar, by mesh."""
    job = steel_four_bar(CHECKED)
    course = job.motion()
    solved = deflection(course, job.sections)
    return {
        f"+ check, {n} elements a link": lambda n=n: compare(solved, solve(course, job.sections, n)) for n in (16, 64)
    }


def main() -> None:
    rows: dict[str, dict[str, Any]] = {}
    for positions in POSITIONS:
        calls = requests(steel_four_bar(positions)) | (checks() if positions == CHECKED else {})
        for name, call in calls.items():
            row = rows.setdefault(name, {"request": name} | {f"us a position, {n}": None for n in POSITIONS})
            row[f"us a position, {positions}"] = measuring.seconds(call) / positions * 1e6
    measuring.report("request_costs", "Time of each request on its own", {"requests": [*rows.values()]})


if __name__ == "__main__":
    main()
