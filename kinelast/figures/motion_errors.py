"""Errors that do not depend on the theory of motion: by the distance between the positions, and by round-off."""

from typing import Any

import numpy as np

from kinelast.figures.cycle import Cycle
from kinelast.figures.figure_error import BETWEEN, ROUND_OFF, FigureError
from kinelast.values.figure import LARGEST, LEAST, MOST, Figure
from rigid.arrays import Reals

SEARCHED = LARGEST, LEAST, MOST  # reductions whose result is the value at one position, unlike averages
STEP_RATIO = 4.0  # factor by which the error in an average grows if time steps are doubled
ONE_POSITION = "there is no neighbouring instant to compare with"
EPS = float(np.finfo(float).eps)


def motion_errors(answer: Cycle, figure: Figure, closer: Cycle | None, unknown: str = "") -> list[FigureError]:
    """Return the errors in all items of a figure that follows from the rigid motion alone.

    Their causes are the distance between positions, and round-off. For a largest or smallest value, the error is the
    distance between this value and the vertex of the parabola through it and its neighbours. For averages and totals,
    the error is the change from all instants to every second one, plus a quarter of the change from every second
    instant to every fourth. The second term is included because the first may be small by chance. `unknown` is the
    reason why the errors are unknown; empty if they are known.
    """
    cycle = closer or answer
    peak = cycle.of(figure)
    if figure.exact:
        return [FigureError() for _ in peak.value]
    if unknown or closer is None:
        return [FigureError({}, unknown or ONE_POSITION) for _ in peak.value]
    searched = figure.over in SEARCHED and not figure.whole
    off = peak.gain
    if not searched:
        coarser, coarsest = (each.of(figure).value for each in (cycle.coarser, cycle.coarser.coarser))
        before = np.abs(difference(coarser, coarsest)) / STEP_RATIO
        off = np.abs(difference(peak.value, coarser)) + before
    off = np.broadcast_to(np.nan_to_num(off, nan=np.inf), np.shape(peak.value))
    at = np.broadcast_to(peak.position, np.shape(peak.value))
    size = np.where(np.isfinite(peak.value), np.abs(peak.value), 0.0)
    rounded = round_off(cycle, at, figure.of_motion(cycle.scene)) * size
    pairs = zip(off.tolist(), np.broadcast_to(rounded, np.shape(off)).tolist(), strict=True)
    return [FigureError({BETWEEN: between, ROUND_OFF: lost}) for between, lost in pairs]


def round_off(answer: Cycle, positions: Any, rigid: bool) -> Reals:
    """Return the relative round-off error at positions given by number. It is EPS for an unknown position (-1).

    See `_relative_round_off` for the argument `rigid`.
    """
    return np.where(positions >= 0, answer.once(_relative_round_off, rigid)[np.maximum(positions, 0)], EPS)


def _relative_round_off(answer: Cycle, rigid: bool) -> Reals:
    """Return the relative round-off error at every position: EPS times the condition number of the motion.

    For deflections (`rigid` is false), it is also at least EPS times the condition number of the deflection, times
    `Cycle.bending` at the position.
    """
    if rigid:
        return np.where(np.isfinite(answer.condition), EPS * answer.condition, EPS)
    with np.errstate(invalid="ignore"):
        lost = np.minimum(EPS * answer.deflection.condition, 1.0) * answer.bending
        share = np.maximum(EPS * answer.condition, lost)
    return np.where(np.isfinite(share), share, EPS)


def difference(after: Any, before: Any) -> Reals:
    """Return `after - before`, and 0 if both values are equal, even if both are infinite."""
    with np.errstate(invalid="ignore"):
        found: Reals = np.where(after == before, 0.0, after - before)
    return found
