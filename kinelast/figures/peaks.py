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


def peak_positions(results: Results, extreme: Extreme) -> Any:
    """Number of the counted position at which every beam's extreme is largest, -1 where none is known, per beam."""
    size = np.where(np.isfinite(extreme.value) & results.counted, np.abs(extreme.value), -1.0)
    at = size.argmax(axis=-1)
    return np.where(np.take_along_axis(size, at[:, None], -1)[:, 0] >= 0.0, at, -1)


def peaks(results: Results) -> dict[str, list[Peak]]:
    """Per field, the peak of every beam at the positions of the run; nan where no position could be computed."""
    found = {}
    motion = results.motion
    for field, extreme in results.extremes.items():
        rows = []
        for beam, at in enumerate(peak_positions(results, extreme)):
            if at < 0:
                rows.append(Peak(math.nan, math.nan, math.nan, (math.nan,) * len(motion.drive)))
                continue
            value, xi = float(extreme.value[beam, at]), float(extreme.xi[beam, at])
            rows.append(Peak(value, xi, float(motion.time[at]), tuple(motion.drive[:, at].tolist())))
        found[field] = rows
    return found
