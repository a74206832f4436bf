"""Mechanisms that the benchmarks move: a steel four-bar, many four-bars at once, a chain of dyads."""

from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import Section
from rigid import Beam, Link, Mechanism, Motion, PinDrive, motion

SPEED = 100.0  # of the steel four-bar's crank [rad/s]
DENSITY, E, POISSON = 7850.0, 210e9, 0.3
WIDTH, DEPTH = 0.01, 0.006
AREA, INERTIA = WIDTH * DEPTH, WIDTH * DEPTH**3 / 12
STEEL = Section(EA=E * AREA, EI=E * INERTIA)
# Cowper's coefficient of a rectangle, 10 (1 + nu)/(12 + 11 nu)
SHEARED = replace(STEEL, kGA=10 * (1 + POISSON) / (12 + 11 * POISSON) * E / (2 * (1 + POISSON)) * AREA)


class Job(Struct, frozen=True):
    """A mechanism with beam sections, drive positions and drive rate."""

    mechanism: Mechanism
    sections: tuple[Section, ...]
    drive: Any
    rate: Any = SPEED

    def motion(self) -> Motion:
        """Motion at all positions."""
        return motion(self.mechanism, self.drive, self.rate)


def turn(positions: int) -> Any:
    """Evenly spaced angles of a full turn, the end not repeated."""
    return np.arange(positions) * (2 * np.pi / positions)


def bar(name: str, start: str, end: str, length: Any, mass_per_length: float = DENSITY * AREA) -> Link:
    """A steel bar of the common section."""
    return Link(name, {start: 0.0, end: length}, (Beam(start, end, mass_per_length),))


def rectangle_section(depth: float, width: float, young: float) -> Section:
    """Rectangular section with shear (factor 5/6) and rotary inertia."""
    area, inertia = depth * width, width * depth**3 / 12
    return Section(young * area, young * inertia, 5 / 6 * young / (2 + 2 * POISSON) * area, area=area, inertia=inertia)


def steel_four_bar(positions: int = 360, crank: Any = 0.1) -> Job:
    """The common job: crank 0.1, coupler 0.3, rocker 0.25, base 0.35 m, 10 x 6 mm of steel, 100 rad/s."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.35}),
        bar("crank", "O", "A", crank),
        bar("coupler", "A", "B", 0.3),
        bar("rocker", "D", "B", 0.25),
    )
    drawing = {"O": 0.0, "A": 0.1, "B": 0.28 + 0.24j, "D": 0.35}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing)
    return Job(mechanism, (STEEL,) * 3, turn(positions))


def four_bars(designs: int, positions: int = 72) -> Job:
    """Steel four-bars with evenly spaced crank lengths."""
    return steel_four_bar(positions, np.linspace(0.05, 0.12, designs)[:, None])


def chain(dyads: int, positions: int) -> Job:
    """Rockers in a row, each pulled by the previous one: 2 dyads + 1 moving links, as many beams."""
    tips = [0.3 * k + 0.1 * np.exp(1.2j) for k in range(dyads + 1)]
    drawing = {f"D{k}": 0.3 * k + 0j for k in range(dyads + 1)} | {f"B{k}": tip for k, tip in enumerate(tips)}
    links = [Link("ground", {name: place for name, place in drawing.items() if name.startswith("D")})]
    links.append(bar("rocker0", "D0", "B0", 0.1))
    for k in range(1, dyads + 1):
        links.append(bar(f"coupler{k}", f"B{k - 1}", f"B{k}", 0.3))
        links.append(bar(f"rocker{k}", f"D{k}", f"B{k}", 0.1))
    mechanism = Mechanism(tuple(links), (PinDrive("rocker0", "D0"),), drawing)
    return Job(mechanism, (STEEL,) * (2 * dyads + 1), np.linspace(1.0, 2.0, positions), 10.0)
