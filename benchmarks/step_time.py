"""Processor time of a step of an integrated motion: mechanisms run up by a constant moment, and scipy on a closed form.

python benchmarks/step_time.py
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from rigid import Link, Lump, Mechanism, PinDrive, Slider
from rigid.dynamics import Effort, forward

RESULTS = Path(__file__).parent / "results" / "step_time.csv"
CRANK, ROD, MASS, INERTIA, MOMENT = 0.05, 0.2, 0.4, 2e-3, 1.6  # m, m, kg, kg m^2, N m


def slider_crank() -> Mechanism:
    """A crank with a flywheel, a rod without mass, a heavy piston."""
    links = (
        Link("ground", {"O": 0.0}),
        Link("crank", {"O": 0.0, "A": CRANK}, lumps=(Lump("O", 1.0, INERTIA),)),
        Link("rod", {"A": 0.0, "B": ROD}),
        Link("piston", {"B": 0.0}, lumps=(Lump("B", MASS),)),
    )
    start = {"O": 0j, "A": CRANK + 0j, "B": CRANK + ROD + 0j}
    guide = Slider("guide", "piston", "ground", "B", 0.0, 1.0)
    return Mechanism(links, (PinDrive("crank", "O"),), start, (guide,))


def four_bar() -> Mechanism:
    """A crank and rocker."""
    place = {"O": 0j, "A": 0.05 + 0j, "B": 0.1671875 + 0.1621474j, "C": 0.25 + 0j}
    links = [Link("ground", {"O": 0.0, "C": 0.25})]
    for name, ends, mass in (("crank", "OA", 0.1), ("coupler", "AB", 0.3), ("rocker", "CB", 0.3)):
        length = abs(place[ends[1]] - place[ends[0]])
        lumps = (Lump(ends[1], mass), Lump(ends[0], 0.0, INERTIA if name == "crank" else 0.0))
        links.append(Link(name, {ends[0]: 0.0, ends[1]: length}, lumps=lumps))
    return Mechanism(tuple(links), (PinDrive("crank", "O"),), place)


def two_arms() -> Mechanism:
    """Two arms one after the other, both driven by efforts: the places are a function of no single coordinate."""
    links = (
        Link("ground", {"O": 0.0}),
        Link("upper", {"O": 0.0, "A": 0.3}, lumps=(Lump("A", 1.0),)),
        Link("lower", {"A": 0.0, "B": 0.2}, lumps=(Lump("B", 0.5),)),
    )
    drives = (PinDrive("upper", "O"), PinDrive("lower", "A", "upper"))
    return Mechanism(links, drives, {"O": 0j, "A": 0.3 + 0j, "B": 0.5 + 0j}, gravity=-9.81j)


def by_scipy(duration: float) -> tuple[int, float]:
    """Steps and time of the slider-crank by its closed equation of motion."""

    def rates(_: float, state: Any) -> Any:
        angle, speed = state
        rod = np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
        first = -CRANK * np.sin(angle) - CRANK**2 * np.sin(angle) * np.cos(angle) / rod
        second = -CRANK * np.cos(angle) - CRANK**2 * (
            np.cos(2 * angle) / rod + (CRANK * np.sin(angle) * np.cos(angle)) ** 2 / rod**3
        )
        return [speed, (MOMENT - MASS * first * second * speed**2) / (INERTIA + MASS * first**2)]

    began = time.process_time()
    found = solve_ivp(rates, (0.0, duration), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-10)
    return len(found.t) - 1, time.process_time() - began


CASES: dict[str, tuple[Callable[[], Mechanism], list[Effort], float]] = {
    "slider-crank, 0.5 s": (slider_crank, [Effort(MOMENT)], 0.5),
    "slider-crank, 1.5 s": (slider_crank, [Effort(MOMENT)], 1.5),
    "four-bar, 0.5 s": (four_bar, [Effort(MOMENT)], 0.5),
    "two arms, 2 s": (two_arms, [Effort(), Effort()], 2.0),
}


def main() -> None:
    rows: list[list[Any]] = []
    for name, (made, efforts, duration) in CASES.items():
        mechanism, spent = made(), []
        for _ in range(3):
            began = time.process_time()
            run = forward(mechanism, efforts, 0.0, 0.0, duration, 1e-10)
            spent.append(time.process_time() - began)
        steps, speed = len(run.time) - 1, float(run.stretches[-1].state(run.time[-1:])[len(efforts), 0])
        rows.append([name, "kinelast", steps, f"{speed:.4g}", f"{min(spent):.3g}", f"{1e3 * min(spent) / steps:.3g}"])
        if made is slider_crank:
            number, least = by_scipy(duration)
            print(*rows[-1])
            rows.append([name, "scipy, closed form", number, "", f"{least:.3g}", f"{1e3 * least / number:.3g}"])
        print(*rows[-1], flush=True)
    with RESULTS.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["run", "by", "steps", "rate at the end", "seconds", "milliseconds a step"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
