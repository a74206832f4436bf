"""Scatter of results due to the tolerances of input values, and figures of the output error.

Results are called figures, e.g. the largest stress. The input values of a manufactured machine differ from the nominal
values within the tolerances. A full answer contains the figures of one machine, computed by the theory that the scene
names, with errors.
"""

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from msgspec import Struct
from scipy.special import ndtri
from scipy.stats import binomtest, norm, qmc, sobol_indices, uniform

from elastic import displacement_of
from elastic.assessment import angle_error
from kinelast.answers.refusals import STRENGTH
from kinelast.designs.full_sample import FullColumn, within_limits
from kinelast.designs.sensitivities import FiguresOf, Sensitivities
from kinelast.figures.cycle import Cycle
from kinelast.reports.full_answer import FullAnswer
from kinelast.reports.limits import UNKNOWN, Judgement
from kinelast.scene.limits import Output
from kinelast.scene.variables import Variable
from kinelast.values.figure import FIXED, OUTPUT_ERROR, SCENE, Figure, fixed, largest_of, whole
from rigid import Motion, position_of
from rigid.arrays import Complexes, Numbers, Reals

REPEATS = 8  # number of independent sample sets; each set is a Sobol sequence with its own random scrambling
DESIGNS = 2048  # default number of samples, summed over all sets
QUANTILES = (0.025, 0.5, 0.975)
NORMAL_DEVIATIONS = 3.0  # (tolerance) / (standard deviation), if an input value has a normal distribution
INDEX_SAMPLE = 256  # Sobol indices are computed from INDEX_SAMPLE * (number of variables + 2) designs


class Tolerance(Struct, frozen=True):
    """Tolerance of an input value.

    Attributes
    ----------
    half
        Half the width of the tolerance range, in the SI unit of the input value.
    normal
        True for a normal distribution with standard deviation `half` / 3, False for a uniform distribution.
    """

    half: float
    normal: bool = False

    @property
    def deviation(self) -> float:
        """Standard deviation of the input value."""
        return self.half / (NORMAL_DEVIATIONS if self.normal else np.sqrt(3.0))

    def scattered(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles of the deviation from the nominal value.

        `shares` contains cumulative probabilities (0 to 1). The result has the shape of `shares`.
        """
        return self.deviation * ndtri(shares) if self.normal else self.half * (2 * shares - 1)


class FirstOrder(Struct, frozen=True):
    """Scatter of figures (results) to first order in the tolerances.

    Attributes
    ----------
    deviation
        Standard deviation of each figure, shape (figures,).
    worst
        Largest deviation of each figure, shape (figures,): every input value is at the end of the tolerance range that
        increases the deviation.
    share
        Fraction of the variance of a figure that an input value causes, shape (figures, variables); nan if the figure
        does not scatter.
    """

    deviation: Reals
    worst: Reals
    share: Reals


def first_order(sensitivities: Sensitivities, tolerances: Sequence[Tolerance]) -> FirstOrder:
    """Return the first-order scatter of figures for independent input values.

    At a kink, the steeper one-sided derivative is used.
    """
    one_sided = np.maximum(abs(sensitivities.below), abs(sensitivities.above))
    slope = np.where(sensitivities.kink, one_sided, abs(sensitivities.slope))
    deviation = slope * np.array([each.deviation for each in tolerances])
    variance = (deviation**2).sum(axis=1)
    worst = (slope * np.array([each.half for each in tolerances])).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return FirstOrder(np.sqrt(variance), worst, deviation**2 / variance[:, None])


class Scatter(Struct, frozen=True):
    """Distribution of a figure (result) over sampled designs.

    Attributes
    ----------
    mean, deviation
        Mean and standard deviation.
    low, median, high
        Quantiles at 2.5 %, 50 % and 97.5 %.
    least, largest
        Smallest and largest value in the sample.
    error
        Standard errors of mean, deviation, low, median and high, shape (5,). These errors are estimated from the
        differences between the sample sets, see `REPEATS`.
    known
        Fraction of the designs in which the figure is known. The statistics use only these designs.
    """

    mean: float
    deviation: float
    low: float
    median: float
    high: float
    least: float
    largest: float
    error: Reals
    known: float


def sample(tolerances: Sequence[Tolerance], at: np.ndarray, designs: int = DESIGNS, seed: int = 0) -> np.ndarray:
    """Sample designs within tolerances by scrambled Sobol points, shape (repeats, points, variables).

    The total number of points is at least `designs`, see `points_for`.
    """
    seeds = np.random.SeedSequence(seed).spawn(REPEATS)
    shares = [_points(len(at), points_for(designs), np.random.default_rng(each)) for each in seeds]
    return np.asarray(np.asarray(at) + scattered(tolerances, np.stack(shares)))


def points_for(designs: int) -> int:
    """Return the number of points in each sample set.

    The number is the smallest power of two for which all sample sets together contain at least `designs` points.
    """
    return int(2 ** max(math.ceil(math.log2(designs / REPEATS)), 0))


def _points(variables: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return scrambled Sobol points in the interior of the unit cube, shape (count, variables)."""
    points = np.asarray(qmc.Sobol(variables, rng=rng).random(count))
    return np.asarray(np.clip(points, 2.0**-33, 1 - 2.0**-33))


def scattered(tolerances: Sequence[Tolerance], shares: np.ndarray) -> np.ndarray:
    """Return quantiles of the deviations of all input values from the nominal values, shape (..., variables).

    `shares` contains cumulative probabilities (0 to 1), shape (..., variables).
    """
    return np.stack([each.scattered(shares[..., k]) for k, each in enumerate(tolerances)], axis=-1)


def scatter(
    figures_of: FiguresOf, tolerances: Sequence[Tolerance], at: np.ndarray, designs: int = DESIGNS, seed: int = 0
) -> dict[str, Scatter]:
    """Return the distribution of each figure over designs sampled within tolerances, by name of the figure.

    A single call of `figures_of` evaluates all sampled designs.
    """
    tried = sample(tolerances, at, designs, seed)
    found = figures_of(tried.reshape(-1, tried.shape[-1]))
    return {name: _scatter(np.asarray(each, float).reshape(tried.shape[:2])) for name, each in found.columns.items()}


def _scatter(values: np.ndarray) -> Scatter:
    """Return the distribution of a figure for sampled values, shape (repeats, points)."""
    known = np.isfinite(values)
    if not known.any():
        nan = math.nan
        return Scatter(nan, nan, nan, nan, nan, nan, nan, np.full(5, nan), 0.0)
    every = values[known]
    sets = [_moments(own[good]) for own, good in zip(values, known, strict=True) if good.any()]
    error = np.std(sets, axis=0, ddof=1) / np.sqrt(len(sets)) if len(sets) > 1 else np.full(5, math.nan)
    mean, deviation, low, median, high = _moments(every)
    return Scatter(mean, deviation, low, median, high, float(every.min()), float(every.max()), error, known.mean())


def _moments(values: np.ndarray) -> tuple[float, ...]:
    """Return the mean, the standard deviation, and the quantiles at `QUANTILES`."""
    return float(values.mean()), float(values.std()), *map(float, np.quantile(values, QUANTILES))


class KeptShare(Struct, frozen=True):
    """Fraction of machines that meet all limits.

    Attributes
    ----------
    plain
        Fraction if quasi-static figures are compared with the limits, without errors.
    in_full
        Fraction if figures of full answers are compared with the limits, with errors; nan if a limit cannot be judged.
    low, high
        95 % confidence interval of `in_full` (Clopper and Pearson 1934), including the error of the response surfaces.
    beyond
        Fraction of machines with a total output error above the limit on the output error; nan if there is no such
        limit. The total output error is due to geometry and deflection.
    """

    plain: float
    in_full: float
    low: float
    high: float
    beyond: float = math.nan


def kept_share(
    columns: Mapping[str, Reals], judgements: Sequence[Judgement], full: Mapping[str, FullColumn], output: str = ""
) -> KeptShare:
    """Estimate the fraction of machines that meet all limits.

    A machine in which a link yields is treated like a machine that violates a limit.

    Parameters
    ----------
    columns
        Quasi-static values of the limited figures by name, shape (machines,).
    judgements
        For each limit, the outcome of comparing the full answer of the nominal machine with the limit.
    full
        Limited figures of all machines by name, extended from full answers of some machines.
    output
        Name of the column with the total output error.
    """
    limits = [each.limit for each in judgements]
    if STRENGTH.figure in columns and STRENGTH.figure in full:
        limits.append(STRENGTH)
    plain = np.logical_and.reduce([limit.kept(columns[limit.figure]) for limit in limits])
    bound = next((each.limit for each in judgements if each.limit.figure == OUTPUT_ERROR), None)
    beyond = math.nan if bound is None or output not in columns else float(np.mean(~bound.kept(columns[output])))
    known = all(np.isfinite(full[limit.figure].value).all() for limit in limits)
    if not known or any(each.outcome == UNKNOWN for each in judgements):
        return KeptShare(float(plain.mean()), math.nan, math.nan, math.nan, beyond)
    rows = [(limit.kept, limit.least, full[limit.figure]) for limit in limits]
    few, kept, many = (within_limits(rows, side) for side in (1.0, 0.0, -1.0))
    low, high = (binomtest(int(np.count_nonzero(each)), len(each)).proportion_ci(0.95, "exact") for each in (few, many))
    return KeptShare(float(plain.mean()), float(kept.mean()), float(low.low), float(high.high), beyond)


def variance_shares(
    figures_of: FiguresOf, tolerances: Sequence[Tolerance], at: np.ndarray, seed: int = 0
) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
    """Return two arrays of Sobol indices for each figure, by name.

    A Sobol index is the fraction of the variance of a figure that an input value causes. The first array is without
    interactions between input values, and the second array includes interactions. Both have the shape (variables,).
    The indices are nan if a figure does not scatter, or is unknown for a design.

    Unlike `FirstOrder.share`, Sobol indices also apply to large tolerances.
    """
    names: list[str] = []

    def values(designs: np.ndarray) -> np.ndarray:
        columns = figures_of(np.asarray(at) + designs.T).columns
        names[:] = columns
        return np.stack([np.asarray(columns[name], float) for name in names])

    dists = [norm(0, each.deviation) if each.normal else uniform(-each.half, 2 * each.half) for each in tolerances]
    with np.errstate(invalid="ignore", divide="ignore"):
        columns = sobol_indices(func=values, n=INDEX_SAMPLE, dists=dists, rng=np.random.default_rng(seed))
    alone, together = (np.reshape(each, (len(names), -1)) for each in (columns.first_order, columns.total_order))
    return {name: (alone[k], together[k]) for k, name in enumerate(names)}


class ToleranceResult(Struct, frozen=True, eq=False):
    """Results of a tolerance study.

    Attributes
    ----------
    variables, tolerances
        Varied input values and their tolerances.
    nominal
        Sensitivities of the nominal design.
    first
        First-order scatter of the figures that `nominal.figures` names.
    sampled
        Sampled distributions by name of the figure.
    shares
        Sobol indices by name of the figure, see `variance_shares`.
    units
        Units by name of the figure.
    designs
        Number of sampled designs.
    answer
        Full answer of the nominal scene.
    kept
        Fraction of machines that meet all limits; None if there are no limits.
    """

    variables: tuple[Variable, ...]
    tolerances: tuple[Tolerance, ...]
    nominal: Sensitivities
    first: FirstOrder
    sampled: Mapping[str, Scatter]
    shares: Mapping[str, tuple[np.ndarray, np.ndarray]]
    units: Mapping[str, str]
    designs: int
    answer: FullAnswer
    kept: KeptShare | None = None


GEOMETRIC, WHOLE = "geometric_error", "whole_error"  # keys of the two figures that `accuracy_figures` returns
FARTHEST, SQUARES = "path_error", "path_squares"  # keys of two figures that `path_figures` returns
# Prefix of the keys of the x and y distances, e.g. "path[1].x"; the figure SQUARES is the sum of their squares.
PART = "path["


def accuracy_figures(nominal: Motion, output: Output) -> list[Figure]:
    """Return two figures (results) for the largest output error over the cycle.

    The output error is the difference from the output of the nominal mechanism with rigid links. The first figure is
    the error due to geometry alone. The second figure is the error due to geometry and deflection together. (The error
    due to deflection alone is the figure `output_error`, which is not returned.)

    Parameters
    ----------
    nominal
        Motion of the nominal mechanism, at the positions at which the designs are computed.
    output
        Point or link that is the output.
    """
    if output.point:
        place = position_of(nominal, output.link, output.point)

        def off(cycle: Cycle) -> Numbers:
            return position_of(cycle.motion, output.link, output.point) - place

        def bent(cycle: Cycle) -> list[Numbers]:
            return [off(cycle) + displacement_of(cycle.deflection, output.link, output.point)]
    else:
        axis = nominal.direction[nominal.mechanism.index[output.link]]

        def off(cycle: Cycle) -> Numbers:
            mechanism = cycle.motion.mechanism
            return np.asarray(np.angle(cycle.motion.direction[mechanism.index[output.link]] * np.conj(axis)))

        def bent(cycle: Cycle) -> list[Numbers]:
            mechanism = cycle.scene.mechanism
            points = mechanism.links[mechanism.index[output.link]].points
            return [off(cycle) + angle_error(cycle.deflection, output.link, point) for point in points]

    geometric = Figure(GEOMETRIC, "output error due to geometry", output.unit, SCENE, whole(off))
    return [geometric, Figure(WHOLE, "total output error", output.unit, SCENE, largest_of(bent))]


def path_figures(output: Output, places: Sequence[complex]) -> list[Figure]:
    """Return figures (results) that compare the path of a point with target points.

    The path is computed with rigid links. The figures are the largest distance from the target points, the sum of the
    squared distances, and the x and y components of all distances.

    Parameters
    ----------
    output
        Moving point, and the link with this point.
    places
        Target point for each position as a complex number x + i y [m].
    """
    targets = np.array(places)

    def off(cycle: Cycle) -> Complexes:
        return np.broadcast_to(position_of(cycle.motion, output.link, output.point) - targets, cycle.columns)

    def part(cycle: Cycle, number: int, axis: str) -> Reals:
        way = off(cycle)[..., number]
        return way.real if axis == "x" else way.imag

    def squares(cycle: Cycle) -> Reals:
        return np.asarray((np.abs(off(cycle)) ** 2).sum(axis=-1))

    words = "distance from a point of the path"
    parts = [Figure(f"{PART}{number + 1}].{axis}", words, "m", SCENE, fixed(partial(part, number=number, axis=axis)),
                    FIXED) for number in range(len(places)) for axis in "xy"]  # fmt: skip
    return [
        Figure(FARTHEST, "largest distance from the path", "m", SCENE, whole(off)),
        Figure(SQUARES, "sum of squared distances from the path", "m^2", SCENE, fixed(squares), FIXED),
        *parts,
    ]
