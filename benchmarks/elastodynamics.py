"""Run time and error of the vibrating steel four-bar: steady states, and a map of speeds."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import measuring
import numpy as np
from jobs import steel_four_bar

from elastic import sample
from elastic.cycle_maxima import cycle_maxima
from elastic.elastodynamics import Elastodynamic, elastodynamic, speed_map
from rigid import Motion, motion

BETA = 42e-6
JOB = steel_four_bar(360)


def motion_of(speed: float) -> Callable[[Any], Motion]:
    return lambda t: motion(JOB.mechanism, speed * np.asarray(t), speed, 0.0, t)


def steady(speed: float, tolerance: float = 1e-4) -> Elastodynamic:
    period, motion_at = 2 * math.pi / speed, motion_of(speed)
    times = np.arange(360) * period / 360
    return elastodynamic(motion_at(times), motion_at, period, JOB.sections, damping=BETA, tolerance=tolerance)


def process_seconds(run: Callable[[], Any], rounds: int = 5) -> float:
    """Least of some rounds, which others on the machine do not lengthen."""
    run()
    least = math.inf
    for _ in range(rounds):
        start = time.process_time()
        run()
        least = min(least, time.process_time() - start)
    return least


def row(speed: float) -> dict[str, Any]:
    found, fine = steady(speed), steady(speed, 1e-6)
    stations = np.linspace(0, 1, 11)
    chord, reference = (sample(each.deflection, "chord", stations) for each in (found, fine))
    error = np.abs(chord - reference).max(axis=(1, 2)) / np.abs(reference).max(axis=(1, 2))
    return {
        "rad/s": speed,
        "ms": process_seconds(lambda: steady(speed)) * 1e3,
        "coordinates": found.coordinates,
        "elements": found.elements,
        "error": error.max(),
    }


def largest(bent: Any) -> Any:
    return cycle_maxima(bent, ["chord"], period=bent.motion.time[..., -1])["chord"].value


def main() -> None:
    steady_states = [row(speed) for speed in (10.0, 30.0, 50.0, 60.0, 100.0, 130.0)]
    speeds = np.linspace(20, 200, 100)
    whole = process_seconds(
        lambda: speed_map(motion_of(1.0), 2 * math.pi, speeds, JOB.sections, largest, damping=BETA), 1
    )
    print(measuring.as_text(steady_states))
    print(f"100 speeds: {whole:.2f} s")


if __name__ == "__main__":
    main()
