"""The best design of a problem, with its certificate: the limits that hold it, their cost, its neighbours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from kinelast.designs.problem import KEPT, OptimizationTask, Problem, linearized
from kinelast.designs.search import LocalOptimum, evolved, from_many_starts, local_searches
from kinelast.designs.sensitivities import sensitivities
from kinelast.figures.limits import FullAnswer, Judgement
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Reals

ACTIVE = 1e-4  # margin of a limit, or share of a range, within which it holds the design
RADII = (1e-1, 1e-2, 1e-3, 1e-4)  # of neighbours, in shares of the ranges
NEIGHBOURS = 64  # a radius
GAIN = 1e-6  # of the cost: what is better by less is not


@dataclass(frozen=True)
class Neighbours:
    """Designs close by, at distances of `RADII`.

    Attributes
    ----------
    tried, feasible, better
        How many of each distance were tried, keep all limits, and are better besides.
    best
        The best of those, as shares of the variables; None where none is better.
    """

    tried: tuple[int, ...]
    feasible: tuple[int, ...]
    better: tuple[int, ...]
    best: np.ndarray | None


@dataclass(frozen=True)
class Certificate:
    """First-order conditions of an optimum (Karush, Kuhn, Tucker), and neighbours.

    Attributes
    ----------
    margin
        What is left to every limit, as a share of it, shape (limits,).
    multiplier
        Per cent that the cost falls by for one per cent more of each limit, shape (limits,); 0 where it does not hold
        the design.
    low, high
        Per cent that the cost falls by for each per cent of a variable's range (as the problem counts it) that its
        bound gives way, shape (variables,); 0 where that does not hold the design.
    residual
        Of the stationarity: what no multiplier of 0 or more balances of the cost's gradient, as a share of that
        gradient or of the mean one towards neighbours, whichever is greater.
    kinked
        Whether cost or a limit that holds has a kink there, so that there is more than one gradient and the residual
        says less.
    neighbours
        Designs close by.
    """

    margin: Reals
    multiplier: Reals
    low: Reals
    high: Reals
    residual: float
    kinked: bool
    neighbours: Neighbours


def certificate(problem: Problem, shares: np.ndarray, seed: int = 0) -> Certificate:
    """First-order conditions and neighbours of a design, at shares of shape (variables,)."""
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


def _gradients(problem: Problem, shares: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cost, its slopes, margins, their slopes, and which of all have a kink: as exact as differences are."""
    at, span = problem.values(shares), problem.span
    sensitivity = sensitivities(problem.figures_of, at, np.where(at == 0, span, np.minimum(abs(at), span)))
    row = {name: k for k, name in enumerate(sensitivity.figures)}
    rows = [row[problem.figure], *(row[limit.figure] for limit in problem.limits)]
    slope, kinked = sensitivity.slope[rows] * problem.rate(at), sensitivity.kink[rows]
    if not np.isfinite(slope).all():  # a bound beyond which there is nothing
        rough = linearized(problem, [shares])[0]
        return rough.cost, rough.cost_slope, rough.margin + KEPT, rough.margin_slope, kinked
    judged = problem.judged_by({name: sensitivity.figure[k : k + 1] for name, k in row.items()})
    signs = np.array([(1.0 if limit.least else -1.0) / (abs(limit.bound) or 1.0) for limit in problem.limits])
    sign = -1.0 if problem.largest else 1.0
    margin_slope = slope[1:] * signs[:, None]
    return float(judged.cost[0]), sign * slope[0], judged.margin[:, 0] + KEPT, margin_slope, kinked


def _neighbours(problem: Problem, shares: np.ndarray, seed: int) -> tuple[Neighbours, float]:
    """Designs close by, and the mean slope of the cost towards the farthest of them."""
    cube = qmc.Sobol(len(shares), rng=np.random.default_rng(seed)).random(NEIGHBOURS)
    around = np.multiply.outer(RADII, 2 * cube - 1).reshape(-1, len(shares))
    tried = np.clip(shares + around, 0.0, 1.0)
    judged = problem.judged(np.concatenate([shares[None], tried]))
    feasible = judged.violation[1:] == 0
    gain = judged.cost[0] - judged.cost[1:]
    better = feasible & (gain > GAIN * abs(judged.cost[0]))
    if judged.violation[0] > 0:
        better = judged.violation[1:] < (1 - GAIN) * judged.violation[0]
    order = judged.order()
    best = tried[order[order > 0][0] - 1] if better.any() else None
    well, gaining = (tuple(int(n) for n in each.reshape(len(RADII), -1).sum(axis=1)) for each in (feasible, better))
    far = gain[:NEIGHBOURS] / np.linalg.norm(tried[:NEIGHBOURS] - shares, axis=1)
    far = abs(far[np.isfinite(far)])
    return Neighbours((NEIGHBOURS,) * len(RADII), well, gaining, best), float(far.mean()) if len(far) else 0.0


ROUNDS = 4  # local searches from a better neighbour, at most


@dataclass(frozen=True)
class Optimum:
    """The best design that was found.

    Attributes
    ----------
    shares, values
        Of the variables: of the way between their bounds, and in their units, shape (variables,).
    feasible
        Whether all limits are kept.
    searches
        Where the local searches have ended, the best first.
    certificate
        What speaks for it.
    designs, calls
        How many designs were computed, and in how many calls.
    """

    shares: Reals
    values: Reals
    feasible: bool
    searches: tuple[LocalOptimum, ...]
    certificate: Certificate
    designs: int
    calls: int


def optimum(
    problem: Problem, evolve: bool = False, seed: int = 0, first: np.ndarray | None = None, progress: Progress = SILENT
) -> Optimum:
    """The best design: as local searches from many starts find it, or else one from a population that has evolved.

    Parameters
    ----------
    first
        A start besides others, as shares of the variables, shape (variables,).
    progress
        Hears how far it is.

    Raises
    ------
    ValueError
        No design that was tried has all figures.
    """
    return _certified(
        problem, (evolved if evolve else from_many_starts)(problem, seed, first, progress), seed, progress
    )


def optimum_beside(problem: Problem, shares: np.ndarray, seed: int = 0, progress: Progress = SILENT) -> Optimum:
    """The best design that a local search comes by from another one, at shares of shape (variables,).

    Raises
    ------
    ValueError
        As of `optimum`.
    """
    return _certified(problem, local_searches(problem, [shares], progress), seed, progress)


def _certified(problem: Problem, searches: Sequence[LocalOptimum], seed: int, progress: Progress) -> Optimum:
    if not searches or not np.isfinite(searches[0].violation):
        raise ValueError("no design that was tried has all the figures that are asked for")
    best = searches[0]
    certified = certificate(problem, best.end, seed)
    for _ in range(ROUNDS):
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


@dataclass(frozen=True, eq=False)
class OptimumResult:
    """A problem and the best design that was found.

    Attributes
    ----------
    before, after
        Figures of the scene as it stands and of the best design, by name; nan where they are not known.
    held_to
        Bounds of the quasi-static figures that are searched with: those of the limits less room for what the full
        answer changes of the figures and for its errors.
    judgements
        The limits beside the figures of the full answer; empty where there are none, or the search kept none.
    quasi_static
        Whether the scene asks for no other theory, as the search is without vibration.
    answer
        The full answer to the best design, with the figure of the goal; None where no design keeps the limits.
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
