"""Where over the cycle, and where along its beam, a field is largest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Extreme
from kinelast.figures.results import Results


@dataclass(frozen=True)
class Peak:
    """The largest magnitude of a field of one beam over the cycle: value in the field's unit, and where it is.

    `xi` along the beam; `time` [s]; `drive` coordinates [rad or m]; `refined`: found between the positions.
    """

    value: float
    xi: float
    time: float
    drive: tuple[float, ...]
    refined: bool = False


def peak_positions(results: Results, values: Any) -> Any:
    """Number of the counted position at which values of shape (..., positions) are largest, -1 where none is known."""
    size = np.where(np.isfinite(values) & results.counted, np.abs(values), -1.0)
    return np.where(size.max(axis=-1) >= 0.0, size.argmax(axis=-1), -1)


def peaks(results: Results) -> dict[str, list[Peak]]:
    """Per field, the peak of every beam at the positions of the run; nan where no position could be computed."""
    extremes, motion = results.extremes, results.motion
    positions = peak_positions(results, np.array([extreme.value for extreme in extremes.values()]))

    def peak(extreme: Extreme, beam: int, at: int) -> Peak:
        if at < 0:
            return Peak(math.nan, math.nan, math.nan, (math.nan,) * len(motion.drive))
        value, xi = float(extreme.value[beam, at]), float(extreme.xi[beam, at])
        return Peak(value, xi, float(motion.time[at]), tuple(motion.drive[:, at].tolist()))

    return {
        field: [peak(extreme, beam, at) for beam, at in enumerate(row)]
        for (field, extreme), row in zip(extremes.items(), positions.tolist(), strict=True)
    }
