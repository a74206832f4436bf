"""Full answers for some machines of a sample, extended to the whole sample by response surfaces.

The sample consists of machines with random input values within the tolerances. Quasi-static results (figures, e.g. the
largest stress) are known for all machines. A full answer contains the figures of one machine, computed by the theory
that the scene names, with errors.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from scipy.interpolate import RBFInterpolator

from kinelast.reports.full_answer import FullAnswer
from rigid.arrays import Flags, Reals

# Numbers of machines with a full answer. If a number gives inaccurate response surfaces, the next number is used.
SAMPLE_SIZES = 8, 16, 32
MAX_SURFACE_ERROR = 0.002  # a response surface is accurate if its relative error is at most this value


class FullColumn(Struct, frozen=True):
    """A figure (result) of all sampled machines, derived from full answers of some machines.

    Attributes
    ----------
    value
        Values from the response surface, shape (machines,); nan if a full answer does not contain the figure.
    error
        Largest (error in the figure) / (figure) among the full answers.
    surface
        Relative error of the response surface: twice the rms error if each full answer is predicted from the other full
        answers.
    """

    value: Reals
    error: float
    surface: float


def full_columns(
    answer: Callable[[Reals], FullAnswer], machines: Reals, columns: Mapping[str, Reals], scale: Reals
) -> dict[str, FullColumn]:
    """Extend full answers of some machines to all sampled machines.

    A response surface interpolates the ratio (figure of the full answer) / (quasi-static figure).

    Parameters
    ----------
    answer
        Function that returns the full answer of a machine for given input values, shape (variables,).
    machines, scale
        Input values of all machines, shape (machines, variables), and tolerances of the input values, shape
        (variables,).
    columns
        Quasi-static figures of all machines, by name.
    """
    shares = machines / np.where(scale > 0.0, scale, 1.0)
    answers: list[FullAnswer] = []
    known: dict[str, FullColumn] = {}
    for count in SAMPLE_SIZES:
        answers += [answer(row) for row in machines[len(answers) : count]]
        known = {name: _column(shares, answers, name, np.asarray(values, float)) for name, values in columns.items()}
        if all(not each.surface > MAX_SURFACE_ERROR for each in known.values()):
            break
    return known


def _column(shares: Reals, answers: list[FullAnswer], name: str, plain: Reals) -> FullColumn:
    pairs = np.array([each.figures.get(name, (np.nan, np.nan)) for each in answers], float)
    count = len(answers)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(pairs[:, 0] == plain[:count], 1.0, pairs[:, 0] / plain[:count])
        error = float(np.max(np.where(pairs[:, 1] == 0.0, 0.0, pairs[:, 1] / np.abs(pairs[:, 0]))))
    if not np.isfinite(ratio).all():
        return FullColumn(np.full(len(plain), np.nan), error, np.nan)
    if np.ptp(ratio) == 0.0:
        return FullColumn(ratio[0] * plain, error, 0.0)
    rows, tried = np.arange(count), shares[:count]
    missed = [float(_surface(tried[rows != k], ratio[rows != k])(tried[k : k + 1])[0] - ratio[k]) for k in rows]
    off = 2.0 * float(np.sqrt(np.mean(np.square(missed))) / np.abs(ratio).mean())
    return FullColumn(_surface(tried, ratio)(shares) * plain, error, off)


def _surface(places: Reals, values: Reals) -> Callable[[Reals], Reals]:
    """Return a function that interpolates `values` by cubic radial basis functions plus a linear polynomial.

    If there are too few points for a linear polynomial, the function uses linear radial basis functions plus a
    constant.
    """
    linear = len(places) > places.shape[1] + 1
    return RBFInterpolator(places, values, kernel="cubic" if linear else "linear", degree=1 if linear else 0)


def within_limits(limits: Sequence[tuple[Callable[[Any], Flags], bool, FullColumn]], side: float) -> Flags:
    """Return True for each machine that meets all limits, shape (machines,).

    Parameters
    ----------
    limits
        For each limit: a function that returns True for each value within the limit, a flag that is True for a lower
        bound, and the limited figure of all machines.
    side
        Weight of the error of the response surface. Before a value is tested, it is moved towards the bound by the
        relative change (error of the full answers) + `side` * (error of the response surface).
    """
    kept = [
        test(each.value * (1.0 + (-1.0 if least else 1.0) * (each.error + side * each.surface)))
        for test, least, each in limits
    ]
    return np.asarray(np.logical_and.reduce(kept))
