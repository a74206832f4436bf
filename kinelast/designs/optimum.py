"""Best design of a problem, with an optimality certificate.

The cost is the value that the search minimises. The certificate contains the active limits, the effect of each limit on
the cost, and the result of a search among similar designs. A figure is a result such as the largest stress. A full
answer contains the figures of one design, computed by the theory that the scene names, with errors.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from kinelast.designs.linearization import linearized
from kinelast.designs.problem import RESERVE, DesignProblem, OptimizationTask
from kinelast.designs.search import LocalOptimum, evolved, from_many_starts, local_searches
from kinelast.designs.sensitivities import sensitivities
from kinelast.reports.full_answer import FullAnswer
from kinelast.reports.limits import Judgement
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Reals

# A limit is active if abs(relative margin) < ACTIVE. A bound of a variable is active if the distance from the scaled
# variable (0 to 1) to the bound is below ACTIVE.
ACTIVE = 1e-4
RADII = (1e-1, 1e-2, 1e-3, 1e-4)  # largest differences of scaled variables (0 to 1) between a design and its neighbours
NEIGHBOURS_PER_RADIUS = 64
# A neighbour is better than a design if its cost is lower by more than MIN_GAIN * abs(cost of the design).
MIN_GAIN = 1e-6


class Neighbours(Struct, frozen=True):
    """Result of a search among neighbouring designs.

    Scaled variables of neighbouring designs differ from the original design by at most `RADII`.

    Attributes
    ----------
    tried, feasible, better
        Numbers of computed, feasible and better designs for each radius. A better design is feasible and has a lower
        cost than the original design. If the original design violates limits, a better design has a smaller violation.
    best
        Scaled variables of the best neighbouring design; None if no neighbouring design is better.
    """

    tried: tuple[int, ...]
    feasible: tuple[int, ...]
    better: tuple[int, ...]
    best: np.ndarray | None


class Certificate(Struct, frozen=True):
    """First-order optimality conditions (Karush, Kuhn, Tucker), and a search among neighbouring designs.

    Attributes
    ----------
    margin
        Distance to each limit, divided by the magnitude of the limit, shape (limits,).
    multiplier
        Reduction of the cost in per cent if a limit is relaxed by one per cent, shape (limits,); 0 for inactive limits.
    low, high
        Reduction of the cost in per cent if the lower or upper bound of a variable is relaxed by one per cent of the
        scaled range, shape (variables,); 0 for inactive bounds.
    residual
        Stationarity residual: the part of the gradient of the cost that non-negative multipliers do not balance. The
        residual is divided by the norm of the gradient. If the mean slope of the cost towards the farthest neighbours
        is larger than this norm, the residual is divided by the mean slope.
    kinked
        True if the cost or an active limit has a kink. At a kink, a small residual does not prove that the design is
        optimal.
    neighbours
        Result of the search among neighbouring designs.
    """

    margin: Reals
    multiplier: Reals
    low: Reals
    high: Reals
    residual: float
    kinked: bool
    neighbours: Neighbours


def certificate(problem: DesignProblem, shares: np.ndarray, seed: int = 0) -> Certificate:
    """Compute the certificate of the design with the scaled variables `shares`, shape (variables,)."""
    cost, slope, margin, margin_slope, kinked = _gradients(problem, shares)
    unit = abs(cost) or 1.0
    holds = abs(margin) < ACTIVE
    at_low, at_high = shares < ACTIVE, shares > 1 - ACTIVE
    one = np.eye(len(shares))
    columns = np.concatenate([margin_slope[holds], one[at_low], -one[at_high]]) * unit
    multipliers = np.zeros(len(columns))
    if len(columns):
        multipliers = lsq_linear(columns.T, slope, (0.0, np.inf), tol=1e-14).x
    multiplier, low, high = np.zeros(len(margin)), np.zeros(len(shares)), np.zeros(len(shares))
    first, second = int(holds.sum()), int(holds.sum() + at_low.sum())
    multiplier[holds], low[at_low], high[at_high] = multipliers[:first], multipliers[first:second], multipliers[second:]
    around, steepness = _neighbours(problem, shares, seed)
    size = max(float(np.linalg.norm(slope)), steepness)
    residual = float(np.linalg.norm(slope - columns.T @ multipliers)) / size if size else 0.0
    kinked_there = bool(kinked[0].any() or kinked[1:][holds].any())
    return Certificate(margin, multiplier, low, high, residual, kinked_there, around)


def _gradients(
    problem: DesignProblem, shares: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return cost, gradient of the cost, margins, gradients of the margins, and kinks (cost first, then limits).

    The gradients contain derivatives with respect to the scaled variables, from extrapolated difference quotients. A
    kink is True if the one-sided derivatives with respect to a variable differ.
    """
    at, span = problem.values(shares), problem.span
    sensitivity = sensitivities(problem.figures_of, at, np.where(at == 0, span, np.minimum(abs(at), span)))
    row = {name: k for k, name in enumerate(sensitivity.figures)}
    rows = [row[problem.figure], *(row[limit.figure] for limit in problem.limits)]
    slope, kinked = sensitivity.slope[rows] * problem.rate(at), sensitivity.kink[rows]
    if not np.isfinite(slope).all():  # figures may be unknown beyond a bound: use designs within bounds
        rough = linearized(problem, [shares])[0]
        return rough.cost, rough.cost_slope, rough.margin + RESERVE, rough.margin_slope, kinked
    judged = problem.judged_by({name: sensitivity.figure[k : k + 1] for name, k in row.items()})
    signs = np.array([(1.0 if limit.least else -1.0) / (abs(limit.bound) or 1.0) for limit in problem.limits])
    sign = -1.0 if problem.largest else 1.0
    margin_slope = slope[1:] * signs[:, None]
    return float(judged.cost[0]), sign * slope[0], judged.margin[:, 0] + RESERVE, margin_slope, kinked


def _neighbours(problem: DesignProblem, shares: np.ndarray, seed: int) -> tuple[Neighbours, float]:
    """Evaluate neighbouring designs; return the result, and the mean slope of the cost to the farthest neighbours."""
    cube = qmc.Sobol(len(shares), rng=np.random.default_rng(seed)).random(NEIGHBOURS_PER_RADIUS)
    around = np.multiply.outer(RADII, 2 * cube - 1).reshape(-1, len(shares))
    tried = np.clip(shares + around, 0.0, 1.0)
    judged = problem.judged(np.concatenate([shares[None], tried]))
    feasible = judged.violation[1:] == 0
    gain = judged.cost[0] - judged.cost[1:]
    better = feasible & (gain > MIN_GAIN * abs(judged.cost[0]))
    if judged.violation[0] > 0:
        better = judged.violation[1:] < (1 - MIN_GAIN) * judged.violation[0]
    order = judged.order()
    best = tried[order[order > 0][0] - 1] if better.any() else None
    well, gaining = (tuple(int(n) for n in each.reshape(len(RADII), -1).sum(axis=1)) for each in (feasible, better))
    far = gain[:NEIGHBOURS_PER_RADIUS] / np.linalg.norm(tried[:NEIGHBOURS_PER_RADIUS] - shares, axis=1)
    far = abs(far[np.isfinite(far)])
    return Neighbours((NEIGHBOURS_PER_RADIUS,) * len(RADII), well, gaining, best), float(far.mean()) if len(
        far
    ) else 0.0


MAX_RESTARTS = 4  # maximum number of further local searches; each starts from a better neighbour of the best design


class Optimum(Struct, frozen=True):
    """Best design found.

    Attributes
    ----------
    shares, values
        Variables of the best design, shape (variables,): scaled to 0...1 (`shares`), and in SI units (`values`).
    feasible
        True if all limits are met.
    searches
        Results of the local searches, best first.
    certificate
        Optimality certificate of the best design.
    designs, calls
        Number of designs that the search evaluated, and number of batches in which these designs were evaluated.
    """

    shares: Reals
    values: Reals
    feasible: bool
    searches: tuple[LocalOptimum, ...]
    certificate: Certificate
    designs: int
    calls: int


def optimum(
    problem: DesignProblem,
    evolve: bool = False,
    seed: int = 0,
    first: np.ndarray | None = None,
    progress: Progress = SILENT,
) -> Optimum:
    """Find the best design by local searches.

    Parameters
    ----------
    evolve
        If False, local searches start from many designs. If True, one local search starts from the best design of a
        differential evolution.
    seed
        Seed of the random generator.
    first
        Scaled variables of an additional start, shape (variables,). If `evolve` is True, this design is a member of the
        first population.
    progress
        Progress callback.

    Raises
    ------
    ValueError
        The search finds no design with all figures that the problem needs.
    """
    return _certified(
        problem, (evolved if evolve else from_many_starts)(problem, seed, first, progress), seed, progress
    )


def optimum_from(problem: DesignProblem, shares: np.ndarray, seed: int = 0, progress: Progress = SILENT) -> Optimum:
    """Find the best design by a local search that starts at the scaled variables `shares`, shape (variables,).

    Raises
    ------
    ValueError
        See `optimum`.
    """
    return _certified(problem, local_searches(problem, [shares], progress), seed, progress)


def _certified(problem: DesignProblem, searches: Sequence[LocalOptimum], seed: int, progress: Progress) -> Optimum:
    if not searches or not np.isfinite(searches[0].violation):
        raise ValueError("no design tried has all requested figures")
    best = searches[0]
    certified = certificate(problem, best.end, seed)
    for _ in range(MAX_RESTARTS):
        if certified.neighbours.best is None:
            break
        closer = local_searches(problem, [certified.neighbours.best], progress)[0]
        if closer.rank >= best.rank:
            break
        best = closer
        certified = certificate(problem, best.end, seed)
    counted = problem.counted
    return Optimum(
        best.end, problem.values(best.end), best.violation == 0, tuple(searches), certified, sum(counted), len(counted)
    )


class OptimumResult(Struct, frozen=True, eq=False):
    """An optimization task, and the best design found.

    Attributes
    ----------
    before, after
        Quasi-static figures of the nominal scene and of the best design, by name; nan if unknown.
    held_to
        Bounds that the quasi-static search used in place of the limits. The bounds differ from the limits by a reserve
        for vibration and errors.
    judgements
        For each limit, the outcome of comparing the full answer with the limit; empty if no design is feasible.
    units
        Units of the figures by name.
    quasi_static
        True if the scene requests the quasi-static theory. The search uses the quasi-static theory in any case.
    answer
        Full answer for the best design, including the figure to be optimized. The full answer is None if no design is
        feasible. Without limits, the full answer is also None if the figure to be optimized does not depend on the
        deflection.
    """

    task: OptimizationTask
    optimum: Optimum
    held_to: tuple[float, ...]
    judgements: tuple[Judgement, ...]
    units: Mapping[str, str]
    before: Mapping[str, float]
    after: Mapping[str, float]
    quasi_static: bool = True
    answer: FullAnswer | None = None
