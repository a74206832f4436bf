"""Rainflow counting of a repeating stress, and Miner's sum of the damage."""

from typing import Any

import numpy as np

from machine.life.endurance import FatigueStrength, equivalent_amplitude
from rigid.arrays import Integers, Reals


def cycles_of(stress: Any) -> Reals:
    """Count the rainflow cycles of a repeating stress.

    The count starts and ends at the largest value. The largest cycle then goes from the highest peak to the lowest
    valley, and all cycles are complete.

    Parameters
    ----------
    stress
        Stress over one repetition [Pa], shape (positions,).

    Returns
    -------
    Range [Pa], mean [Pa] and count of each cycle, shape (3, cycles).

    References
    ----------
    ASTM E1049-85 (2017), section 5.4.5: simplified rainflow counting for repeating histories, as implemented by the
    package rainflow.
    """
    from rainflow import extract_cycles

    values = np.asarray(stress, float)
    closed = np.roll(values, -int(values.argmax()))
    closed = np.append(closed, closed[0])
    rows = [(size, mean, count) for size, mean, count, *_ in extract_cycles(closed.tolist())]
    return np.array(rows, float).T if rows else np.zeros((3, 0))


def reversals(stresses: Any) -> Integers:
    """Return the number of turning points of repeating stresses along the last axis, shape (...)."""
    signs = np.sign(np.diff(stresses, axis=-1, append=stresses[..., :1]))
    for _ in range(2):  # an interval of constant stress takes the sign of the interval before it
        at = np.where(signs != 0.0, np.arange(signs.shape[-1]), 0)
        last = np.maximum.accumulate(at, axis=-1)
        signs = np.take_along_axis(signs, last, -1)
        signs = np.where(signs == 0.0, signs[..., -1:], signs)
    return np.asarray(np.count_nonzero(signs != np.roll(signs, 1, axis=-1), axis=-1))


def damage(stress: Any, strength: FatigueStrength, criterion: str = "goodman") -> float:
    """Return Miner's sum for one repetition of a stress: the consumed fraction of the life.

    The sum is zero if no cycle exceeds the endurance limit. If a cycle exceeds this limit, the smaller cycles also
    count (see `FatigueStrength.cycles`).

    Parameters
    ----------
    stress
        Stress [Pa], shape (positions,).
    strength
        Strength of a single design.

    References
    ----------
    Miner, Cumulative damage in fatigue, Journal of Applied Mechanics 12 (1945) A159-A164. Ranges: see
    `FatigueStrength`.
    """
    values = np.asarray(stress, float)
    most, least = float(values.max()), float(values.min())
    whole = float(equivalent_amplitude((most - least) / 2, (most + least) / 2, strength, criterion))
    if not whole > strength.limit:
        return 0.0
    if reversals(values) <= 2:
        return float(1.0 / strength.cycles(whole))
    size, mean, count = cycles_of(values)
    each = equivalent_amplitude(size / 2, mean, strength, criterion)
    return float((count / strength.cycles(each, below=True)).sum())
