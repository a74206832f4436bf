"""Convergence of the elastodynamic answer and of the nonlinear check, on the steel four-bar at 60 rad/s.

The elastodynamic answer has stages, time elements and inner polynomials. Its error is the largest difference of the
end displacements from the finest solution, at twelve ends of elements, relative to the largest displacement. The
nonlinear check starts at rest and uses the generalised-alpha method; its reference has a quarter of the smallest step.

    python benchmarks/convergence.py
"""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from jobs import DEPTH, WIDTH, E, rectangle_section, steel_four_bar

from elastic import deflection, with_rotary_inertia
from elastic.elastodynamics import Damping
from elastic.elastodynamics.elastic_structure import elastic_structure
from elastic.elastodynamics.equations_of_motion import kinematics, motion_terms
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import vibration
from elastic.elastodynamics.time_grid import Grid
from rigid import ConstantSpeed, motion

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))  # its independent integrators
from nonlinear import nonlinear_transient

SPEED, BETA = 60.0, 42e-6  # [rad/s], damping [s]
SECTIONS = [rectangle_section(DEPTH, WIDTH, E)] * 3
FOUR_BAR = with_rotary_inertia(steel_four_bar(1).mechanism, SECTIONS)
PERIOD = 2 * math.pi / SPEED
TIMES = np.arange(1, 13) * (PERIOD / 12)


def vibrating(elements: int, stages: int, inner: int) -> Any:
    """Displacements of all beam ends from their rigid places, shape (times, places)."""
    grid = Grid(np.linspace(0.0, PERIOD, elements + 1), stages)
    course = motion(FOUR_BAR, SPEED * grid.nodes, SPEED, 0.0, grid.nodes)
    structure = elastic_structure(FOUR_BAR, SECTIONS, {}, inner)
    values, vectors = np.linalg.eigh(structure.stiffness)
    basis = vectors / np.sqrt(values)
    kinds = kinematics(structure, course, basis, chosen_points(FOUR_BAR))
    terms = motion_terms(kinds, grid, Damping(np.full(3, BETA), BETA))
    found = vibration(terms, deflection(course, SECTIONS))
    x = grid.sampler(TIMES - 1e-12 * PERIOD)(found.history[0])
    amounts = basis @ x[..., None]
    ends = [np.real(move) for move, _ in structure.point_shapes.values()]
    return (np.array(ends) @ amounts)[..., 0]


def marched(steps: int) -> Any:
    """Deflections of the nonlinear check through a turn, shape (beams, times, stations)."""
    law = ConstantSpeed(0.0, SPEED)
    return nonlinear_transient(FOUR_BAR, SECTIONS, [law], np.append(0.0, TIMES), PERIOD / steps, 4, None, BETA).w


def errors(answer: Callable[[int], Any], sizes: Any, best: int) -> Any:
    """Largest difference from the answer of the best size, relative to its largest value."""
    exact = answer(best)
    return [float(np.abs(answer(size) - exact).max() / np.abs(exact).max()) for size in sizes]


def main() -> None:
    stages, inner = range(2, 13), range(0, 9, 2)
    elements, steps = (36, 60, 84, 120, 180, 240), (480, 960, 1920, 3840)
    found = {
        "stages, 36 elements": (stages, errors(lambda size: vibrating(36, size, 2), stages, 16)),
        "elements of 4 stages": (elements, errors(lambda size: vibrating(size, 4, 2), elements, 960)),
        "inner polynomials": (inner, errors(lambda size: vibrating(36, 8, size), inner, 12)),
        "steps of the nonlinear check": (steps, errors(marched, steps, 15360)),
    }
    for name, (sizes, values) in found.items():
        print(name, dict(zip(sizes, (float(f"{value:.2g}") for value in values), strict=True)))
    with measuring.figure("convergence", 4, (13.0, 3.4)) as axes:
        for axis, (name, (sizes, values)) in zip(axes, found.items(), strict=True):
            axis.plot(list(sizes), values, "o-", ms=4)
            straight = name.startswith(("elements", "steps"))
            axis.set(yscale="log", xscale="log" if straight else "linear", xlabel=name)
            if straight:
                order = 7 if name.startswith("elements") else 2
                line = values[0] * (sizes[0] / np.array(list(sizes), float)) ** order
                axis.plot(list(sizes), line, "--", color="0.5", label=f"order {order}")
                axis.legend()
        axes[0].set_ylabel("error relative to the largest value")


if __name__ == "__main__":
    main()
