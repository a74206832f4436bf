"""What is not asked for costs nothing: every request by itself, and what a scene can do without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import measuring
import numpy as np
from jobs import Job, flap, four_bars, steel_four_bar

from elastic import PRIMARY, RIGID, deflection, deflection_in_chunks, extremes, rectangle, sample, section_of
from fem_check import compare, solve
from rigid import drive_efforts, motion, reactions

POSITIONS = (360, 4096)
XI = np.linspace(0, 1, 101)


def requests(job: Job) -> dict[str, Callable[[], Any]]:
    """Each on top of what it needs, which is made beforehand."""
    course = job.motion()
    forces = reactions(course)
    solved = deflection(course, job.sections)
    solid = section_of(rectangle(0.006, 0.01), 210e9, yield_stress=235e6)
    known = deflection(course, [solid] * len(job.sections))
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
        "+ greatest stresses": lambda: extremes(known, ["normal", "shear", "mises"]),
    }


def of_a_scene(positions: int) -> dict[str, Callable[[], Any]]:
    """Motion and polynomials of the four-bar with more or less to it."""
    plain, heavy = steel_four_bar(positions), steel_four_bar(positions, gravity=-9.81j)
    rate = np.full(positions, 100.0)
    rigid = replace(plain, sections=(RIGID,) * 3)

    def polynomials(job: Job) -> Callable[[], Any]:
        return lambda: deflection(job.motion(), job.sections)

    return {
        "as it is: constant speed, no gravity": polynomials(plain),
        "with gravity": polynomials(heavy),
        "with rigid links": polynomials(rigid),
        "with a speed for every position": polynomials(replace(plain, rate=rate)),
        "with an acceleration, too": lambda: deflection(
            motion(plain.mechanism, plain.drive, rate, 3.0 * rate), plain.sections
        ),
    }


def targets() -> list[dict[str, Any]]:
    """The figures that the program is held to."""
    small, large, designs = steel_four_bar(360), steel_four_bar(100_000), four_bars(10_000)
    medium, wing = steel_four_bar(8000), flap(2000)
    solved = deflection(medium.motion(), medium.sections)

    def chunks(job: Job) -> None:
        for chunk in deflection_in_chunks(job.mechanism, job.sections, job.drive, job.rate):
            del chunk

    def sampled() -> None:
        for chunk in deflection_in_chunks(large.mechanism, large.sections, large.drive, large.rate):
            for field in PRIMARY:
                sample(chunk, field, XI)
            del chunk

    course = small.motion()
    taken = {
        "360 positions, all fields as polynomials [ms]": (
            measuring.seconds(lambda: deflection(small.motion(), small.sections)) * 1e3,
            0.4,
        ),
        "100,000 positions, the same [us a position]": (measuring.seconds(lambda: chunks(large)) * 10, 0.35),
        "the same sampled at 101 stations [us a position]": (measuring.seconds(sampled) * 10, 1.5),
        "exact extremes of all fields [us a position]": (
            measuring.seconds(lambda: extremes(solved)) / 8000 * 1e6,
            2.5,
        ),
        "13-bar flap, polynomials [us a position]": (measuring.seconds(lambda: chunks(wing)) / 2000 * 1e6, 2.5),
        "10,000 four-bars, 72 positions each [s]": (measuring.seconds(lambda: chunks(designs)), 0.3),
        "finite elements, 64 a link, 360 positions [s]": (
            measuring.seconds(lambda: solve(course, small.sections, 64)),
            0.3,
        ),
    }
    return [{"what": name, "measured": value, "aim": aim} for name, (value, aim) in taken.items()]


def main() -> None:
    table: list[dict[str, Any]] = []
    scenes: list[dict[str, Any]] = []
    for positions in POSITIONS:
        for rows, calls in ((table, requests(steel_four_bar(positions))), (scenes, of_a_scene(positions))):
            # Requests one by one: what the larger ones free would slow the smaller ones.
            taken = (
                measuring.in_turn(calls)
                if rows is scenes
                else {name: measuring.seconds(call) for name, call in calls.items()}
            )
            if not rows:
                rows += [{"request": name} for name in calls]
            for row, time in zip(rows, taken.values(), strict=True):
                row[f"us a position, {positions}"] = time / positions * 1e6
    small = steel_four_bar(360)
    course = small.motion()
    solved = deflection(course, small.sections)
    for elements in (16, 64):
        time = measuring.seconds(lambda n=elements: compare(solved, solve(course, small.sections, n)))
        table.append(
            {
                "request": f"+ check, {elements} elements a link",
                "us a position, 360": time / 360 * 1e6,
                "us a position, 4096": None,
            }
        )
    tables = {"targets": targets(), "requests": table, "scenes": scenes}
    measuring.report("what_is_skipped", "What each request costs, and what is not asked for does not", tables)
    with measuring.figure("what_is_skipped", size=(8, 4.5)) as axis:
        names = [row["request"] for row in table if row["us a position, 4096"]][::-1]
        times = [row["us a position, 4096"] for row in table if row["us a position, 4096"]][::-1]
        axis.barh(names, times)
        axis.set(xlabel="microseconds a position, 4,096 positions", xscale="log")


if __name__ == "__main__":
    main()
