"""Lowest natural frequencies of designs, and how far the harmonics of their drives are from them."""

from __future__ import annotations

from typing import Any

import numpy as np

from elastic.vibration import natural_frequencies
from kinelast.designs.figures import Figure, Found, Values
from kinelast.scene.data import Scene
from kinelast.threads import one_thread

HARMONICS = 6  # of the fastest drive, that are looked at
SETTLED = 1e-5  # so that derivatives are those of the frequency, not of its refinement


def frequency_figures(scene: Scene) -> list[Figure]:
    """The lowest natural frequency over the cycle; that to the speed of the fastest drive that turns; and its distance.

    The distance is that of the lowest frequency, at any position, from any of the first six multiples of that speed, as
    a share of the frequency.
    """
    if not scene.labels:
        return []
    return [
        Figure("frequency", "rad/s", lambda found: _least(found, _lowest(found))),
        Figure("frequency_ratio", "1", lambda found: _least(found, _lowest(found) / _fastest(found))),
        Figure("resonance_distance", "1", lambda found: _least(found, _distance(found))),
    ]


@one_thread()
def _lowest(found: Found) -> Any:
    """Lowest natural frequency at some positions [rad/s], shape (..., positions)."""
    key = "_lowest_frequency"
    if key not in found.__dict__:
        solved = natural_frequencies(
            found.motion, found.scene.sections, 1, joints=found.scene.joints, settled=SETTLED, designs=found.used
        ).omega[0]
        lowest = np.full((*found.columns[:-1], solved.shape[-1]), np.nan)
        lowest[: len(solved)] = solved
        found.__dict__[key] = lowest
    return found.__dict__[key]


def _fastest(found: Found) -> Any:
    """Greatest speed of any drive that turns [rad/s], shape (..., 1); 0 where none does."""
    motion = found.motion
    rates = [rate for drive, rate in zip(motion.mechanism.drives, motion.drive_rate, strict=True) if drive.turns]
    most = [np.nanmax(np.abs(np.broadcast_to(rate, found.columns)), axis=-1, keepdims=True) for rate in rates]
    return np.max(most, axis=0) if most else np.zeros((*found.columns[:-1], 1))


def _distance(found: Found) -> Any:
    lowest, fastest = _lowest(found), _fastest(found)
    return np.min([abs(1 - number * fastest / lowest) for number in range(1, HARMONICS + 1)], axis=0)


def _least(found: Found, values: Any) -> Values:
    known = np.where(np.isnan(values), np.inf, values)
    least, at = known.min(axis=-1), known.argmin(axis=-1)
    return np.where(np.isnan(values).all(axis=-1), np.nan, least), at
