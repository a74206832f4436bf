"""Work and precision: closed forms against finite elements of 1 to 256 a link, and against single precision.

Errors are the greatest of 12 positions against 50 digits, by the greatest value of the field: at 9 stations; of the
elements at those that are nodes, or between them, at a third and two thirds of the link, from the shape functions (w,
its slope, and E I times its curvature). Run times are those of all six fields at 360 positions, the stations' included;
of the plain systems those of one position, all else the same.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from exact_fields import DATA
from jobs import SHEARED, STEEL, Job, steel_four_bar

from elastic import PRIMARY, coefficients, deflection, sample
from fem_check import solve

ELEMENTS = [2**k for k in range(9)]
PLAIN = [2**k for k in range(8)]  # one dense system each: 256 would take seconds a position
CLOSED, SINGLE = "closed forms", "closed forms, sampled in float32"
NODES, BETWEEN, SYSTEM = (
    "finite elements, at nodes",
    "finite elements, between nodes",
    "one system a position, at nodes",
)
Fields = dict[str, Any]


def closed_forms(job: Job, stations: Any) -> Fields:
    """Shape (beams, positions, stations) each, as of all that follow."""
    solved = deflection(job.motion(), job.sections)
    return {field: sample(solved, field, stations) for field in PRIMARY}


def in_single_precision(job: Job, stations: Any) -> Fields:
    """The polynomials taken to single precision, and sampled there."""
    solved = deflection(job.motion(), job.sections)
    xi = np.asarray(stations, np.float32)
    values = {}
    for field in PRIMARY:
        single = coefficients(solved, field).astype(np.float32)
        flat = np.power.outer(xi, np.arange(len(single), dtype=np.float32)) @ single.reshape(len(single), -1)
        values[field] = np.moveaxis(flat.reshape(len(xi), *single.shape[1:]), 0, -1)
    return values


def elements(job: Job, count: int) -> Fields:
    """Fields at the nodes."""
    solved = solve(job.motion(), job.sections, count)
    return {field: getattr(solved, field) for field in PRIMARY}


def between(at_nodes: Fields, lengths: Any, EI: float, stations: Any) -> Fields:
    """w, phi and M inside the elements, from Hermite's shape functions of w and phi at their ends."""
    count = at_nodes["w"].shape[-1] - 1
    place = np.minimum((np.asarray(stations) * count).astype(int), count - 1)
    t, h = np.asarray(stations) * count - place, lengths[:, None, None] / count
    ends = [at_nodes["w"][..., place], at_nodes["w"][..., place + 1]]
    slopes = [h * at_nodes["phi"][..., place], h * at_nodes["phi"][..., place + 1]]

    def mixed(a: Any, b: Any, c: Any, d: Any) -> Any:
        return a * ends[0] + b * slopes[0] + c * ends[1] + d * slopes[1]

    w = mixed(1 - 3 * t**2 + 2 * t**3, t - 2 * t**2 + t**3, 3 * t**2 - 2 * t**3, t**3 - t**2)
    phi = mixed(6 * t**2 - 6 * t, 1 - 4 * t + 3 * t**2, 6 * t - 6 * t**2, 3 * t**2 - 2 * t) / h
    return {"w": w, "phi": phi, "M": EI * mixed(12 * t - 6, 6 * t - 4, 6 - 12 * t, 6 * t - 2) / h**2}


def plain_systems(job: Job, count: int, positions: Any) -> Fields:
    """Every position as one constrained system of all elements: the tests' second finite element solution."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from fem_direct import Direct

    course = job.motion()
    solved = [Direct(course, job.sections, position, count) for position in positions]
    nodes = np.array([[one.nodes(beam) for one in solved] for beam in range(len(job.sections))])
    return {field: nodes[:, :, k] for k, field in enumerate(("u", "w", "phi"))}


def errors(found: Fields, exact: Fields, stations: Any) -> dict[str, float | None]:
    """Greatest error of every field over its greatest value, and the greatest of all; positions first in `exact`."""
    worst: dict[str, float | None] = dict.fromkeys(PRIMARY)
    for field, values in found.items():
        expected = np.moveaxis(np.array(exact[field]), 0, 1)
        worst[field] = float(np.abs(values - expected[..., stations]).max() / np.abs(expected).max())
    return worst | {"worst": max(value for value in worst.values() if value is not None)}


def at_common_nodes(found: Fields, count: int) -> tuple[Fields, Any]:
    """Values at the nodes that are among the nine stations, and those stations' numbers."""
    step = max(count // 8, 1)
    return {field: values[..., ::step] for field, values in found.items()}, np.arange(0, 9, 8 // min(count, 8))


def of_theory(theory: str, section: Any, data: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of the table."""
    job = replace(steel_four_bar(data["of"]), sections=(section,) * 3)
    exact, positions, stations = data[theory], data["positions"], np.array(data["stations"])
    inside, nine = np.arange(9, len(stations)), np.arange(9)
    rows: list[dict[str, Any]] = []
    calls: dict[int, Callable[[], Any]] = {}

    def add(way: str, count: int | None, found: Fields, at: Any, call: Callable[[], Any] | None) -> None:
        if call is not None:
            calls[len(rows)] = call
        rows.append(
            {"theory": theory, "way": way, "elements": count} | errors(found, exact, at) | {"us a position": None}
        )

    def picked(found: Fields) -> Fields:
        return {field: values[:, positions] for field, values in found.items()}

    for way, ours in ((CLOSED, closed_forms), (SINGLE, in_single_precision)):
        add(way, None, picked(ours(job, stations[:9])), nine, lambda ours=ours: ours(job, stations[:9]))
    for count in ELEMENTS:
        found = picked(elements(job, count))
        add(NODES, count, *at_common_nodes(found, count), lambda count=count: elements(job, count))
        if theory == "Euler-Bernoulli":
            lengths = np.array([0.1, 0.3, 0.25])
            add(BETWEEN, count, between(found, lengths, section.EI, stations[inside]), inside, None)
            rows[-1]["us a position"] = len(rows) - 2  # as long as that row takes
    for count in PLAIN if theory == "Euler-Bernoulli" else ():
        some = positions[::4]
        found, at = at_common_nodes(plain_systems(job, count, some), count)
        chosen = {field: values[::4] for field, values in exact.items()}
        time = measuring.seconds(lambda count=count: plain_systems(job, count, [0]), 0.05, 3)
        row = {"theory": theory, "way": SYSTEM, "elements": count} | errors(found, chosen, at)
        rows.append(row | {"us a position": time * 1e6})
    for number, time in measuring.in_turn(calls, measuring.LEAST / 2).items():
        rows[number]["us a position"] = time / data["of"] * 1e6
    for row in rows:
        if row["way"] == BETWEEN:
            row["us a position"] = rows[row["us a position"]]["us a position"]
    return rows


def main() -> None:
    data = json.loads(DATA.read_text())
    rows = of_theory("Euler-Bernoulli", STEEL, data) + of_theory("Timoshenko", SHEARED, data)
    measuring.report("error_against_run_time", "Error against run time: steel four-bar, 360 positions", {"all": rows})
    drawn = [row for row in rows if row["theory"] == "Euler-Bernoulli"]

    def curve(axis: Any, way: str, field: str, across: str, mark: str) -> None:
        these = [row for row in drawn if row["way"] == way]
        label = f"{way}, {field}" if across == "elements" else way
        axis.loglog([row[across] for row in these], [row[field] for row in these], mark, ms=5, label=label)

    with measuring.figure("error_against_run_time", 2, (10, 4.5)) as axes:
        for way, mark in ((CLOSED, "*"), (SINGLE, "P"), (NODES, "o-"), (BETWEEN, "s-"), (SYSTEM, "^-")):
            curve(axes[0], way, "w", "us a position", mark)
        for field, mark in (("w", "s-"), ("phi", "d-"), ("M", "v-")):
            curve(axes[1], BETWEEN, field, "elements", mark)
        for way, mark in ((SYSTEM, "^-"), (NODES, "o-")):
            curve(axes[1], way, "w", "elements", mark)
        closed = next(row for row in drawn if row["way"] == CLOSED)
        axes[1].axhline(closed["worst"], color="k", lw=1, label="closed forms, worst field")
        axes[0].set(title="w", xlabel="microseconds a position", ylabel="error over the field's greatest value")
        axes[1].set(title="finite elements", xlabel="elements a link")
        for axis in axes:
            axis.legend(fontsize=7)


if __name__ == "__main__":
    main()
