"""Error against run time of the three theories of motion, on the steel four-bar at three speeds.

The error is the largest difference of the chord deflection from the geometrically exact answer at tolerance `FINEST`,
relative to the largest chord deflection of the beam. It covers 360 positions and 9 stations; the worst beam counts.
docs/elastodynamics.md compares this reference with a nonlinear mechanism and with exudyn. The time is processor time,
best of three, from the motion to the deflection. The elastodynamic time includes the choice of coordinates and time
elements; the geometrically exact time includes the linear answer that starts the iteration.

    python benchmarks/rungs.py
"""

import math
from collections.abc import Iterator
from typing import Any

import measuring
import numpy as np
from jobs import AREA, INERTIA, SHEARED, steel_four_bar
from msgspec.structs import replace

from elastic import Deflection, deflection, reference_deflection, sample, with_rotary_inertia
from elastic.elastodynamics import elastodynamic, geometrically_exact
from rigid import motion

SPEEDS = 10.0, 30.0, 100.0
POSITIONS = 360
TOLERANCES = tuple(10.0**-k for k in range(1, 7))
FINEST = 1e-8  # tolerance of the reference
STATIONS = np.linspace(0.0, 1.0, 9)
THEORIES = "quasi-static", "elastodynamic", "geometrically exact"


def rows(speed: float) -> Iterator[dict[str, Any]]:
    """Rows of all theories at one speed [rad/s]."""
    sections = (replace(SHEARED, area=AREA, inertia=INERTIA),) * 3
    mechanism, period = with_rotary_inertia(steel_four_bar(1).mechanism, sections), 2 * math.pi / speed

    def motion_at(t: Any) -> Any:
        return motion(mechanism, speed * np.asarray(t), speed, 0.0, t)

    at = motion_at(np.arange(POSITIONS) * period / POSITIONS)

    def linear(tolerance: float) -> Any:
        return elastodynamic(at, motion_at, period, sections, tolerance=tolerance)

    true = sample(geometrically_exact(linear(FINEST), FINEST).deflection, "chord", STATIONS)
    greatest = reference_deflection(np.abs(true).max(axis=(1, 2)))

    def error_of(bent: Deflection) -> float:
        return float((np.abs(sample(bent, "chord", STATIONS) - true).max(axis=(1, 2)) / greatest).max())

    plain, vibrating, exact = THEORIES
    took, bent = measuring.processor_seconds(lambda: deflection(at, sections))
    yield {"rad/s": speed, "theory": plain, "tolerance": None, "error": error_of(bent), "ms": 1e3 * took}
    calls = {vibrating: linear, exact: lambda tolerance: geometrically_exact(linear(tolerance), tolerance)}
    for theory, call in calls.items():
        for tolerance in TOLERANCES:
            took, found = measuring.processor_seconds(lambda call=call, tolerance=tolerance: call(tolerance))
            error = error_of(found.deflection)
            yield {"rad/s": speed, "theory": theory, "tolerance": tolerance, "error": error, "ms": 1e3 * took}


def main() -> None:
    """Measure and draw."""
    table = [row for speed in SPEEDS for row in rows(speed)]
    measuring.report("rungs", "Error against run time: three theories of motion, steel four-bar", {"all": table})
    with measuring.figure("rungs", 1, (7.5, 5.0)) as axis:
        for number, speed in enumerate(SPEEDS):
            for theory, mark in zip(THEORIES, ("*", "s--", "o-"), strict=True):
                these = [row for row in table if row["rad/s"] == speed and row["theory"] == theory]
                label = f"{theory}, {speed:g} rad/s"
                x, y = [row["ms"] for row in these], [row["error"] for row in these]
                axis.loglog(x, y, mark, color=f"C{number}", ms=9 if mark == "*" else 4, label=label)
        axis.set(xlabel="processor time of 360 positions [ms]", ylabel="error of the chord deflection")
        axis.legend(fontsize=7, loc="lower left")


if __name__ == "__main__":
    main()
