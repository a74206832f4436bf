"""Why a design is taken for the best: which limits hold it, what they cost, and what its neighbours are like."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from kinelast.designs.problem import KEPT, Problem, linearized
from kinelast.designs.sensitivities import sensitivities

ACTIVE = 1e-4  # margin of a limit, or share of a range, within which it holds the design
RADII = (1e-1, 1e-2, 1e-3, 1e-4)  # of neighbours, in shares of the ranges
NEIGHBOURS = 256  # a radius
GAIN = 1e-6  # of the cost: what is better by less is not


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
        Per cent that the cost falls by for each per cent of a variable's range that its bound gives way, shape
        (variables,); 0 where that does not hold the design.
    residual
        Of the stationarity: what no multiplier of 0 or more balances, as a share of the cost's gradient.
    kinked
        Whether cost or a limit that holds has a kink there, so that there is more than one gradient and the residual
        says less.
    neighbours, feasible, better
        How many designs close by were tried, of each of `RADII`, keep all limits, and are better besides.
    best
        The best of those, as shares of the variables; None where none is better.
    """

    margin: np.ndarray
    multiplier: np.ndarray
    low: np.ndarray
    high: np.ndarray
    residual: float
    kinked: bool
    neighbours: tuple[int, ...]
    feasible: tuple[int, ...]
    better: tuple[int, ...]
    best: np.ndarray | None


def certificate(problem: Problem, shares: np.ndarray, seed: int = 0) -> Certificate:
    """What speaks for a design, of shares of shape (variables,), as the best."""
    cost, slope, margin, margin_slope, kinked = _gradients(problem, shares)
    unit = abs(cost) or 1.0
    holds = abs(margin) < ACTIVE
    at_low, at_high = shares < ACTIVE, shares > 1 - ACTIVE
    one = np.eye(len(shares))
    columns = np.concatenate([margin_slope[holds], one[at_low], -one[at_high]]) * unit
    found = np.zeros(len(columns))
    if len(columns):
        found = lsq_linear(columns.T, slope, (0.0, np.inf), tol=1e-14).x
    left = slope - columns.T @ found
    length = float(np.linalg.norm(slope))
    multiplier, low, high = np.zeros(len(margin)), np.zeros(len(shares)), np.zeros(len(shares))
    first, second = int(holds.sum()), int(holds.sum() + at_low.sum())
    multiplier[holds], low[at_low], high[at_high] = found[:first], found[first:second], found[second:]
    residual = float(np.linalg.norm(left)) / length if length else 0.0
    kinked_there = bool(kinked[0].any() or kinked[1:][holds].any())
    return Certificate(margin, multiplier, low, high, residual, kinked_there, *_neighbours(problem, shares, seed))


def _gradients(problem: Problem, shares: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cost, its slopes, margins, their slopes, and which of all have a kink: as exact as differences are."""
    at, span = problem.values(shares), problem.high - problem.low
    found = sensitivities(problem.figures_of, at, np.where(at == 0, span, np.minimum(abs(at), span)))
    row = {name: k for k, name in enumerate(found.figures)}
    rows = [row[problem.figure], *(row[limit.figure] for limit in problem.limits)]
    slope, kinked = found.slope[rows] * span, found.kink[rows]
    if not np.isfinite(slope).all():  # a bound beyond which there is nothing
        rough = linearized(problem, shares)
        return rough.cost, rough.cost_slope, rough.margin + KEPT, rough.margin_slope, kinked
    judged = problem.judged_by({name: found.figure[k : k + 1] for name, k in row.items()})
    signs = np.array([(1.0 if limit.least else -1.0) / (abs(limit.bound) or 1.0) for limit in problem.limits])
    sign = -1.0 if problem.largest else 1.0
    margin_slope = slope[1:] * signs[:, None]
    return float(judged.cost[0]), sign * slope[0], judged.margin[:, 0] + KEPT, margin_slope, kinked


def _neighbours(
    problem: Problem, shares: np.ndarray, seed: int
) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...], np.ndarray | None]:
    """How many designs close by are tried, feasible and better, and the best of the last."""
    cube = qmc.Sobol(len(shares), rng=np.random.default_rng(seed)).random(NEIGHBOURS)
    around = np.multiply.outer(RADII, 2 * cube - 1).reshape(-1, len(shares))
    tried = np.clip(shares + around, 0.0, 1.0)
    judged = problem.judged(np.concatenate([shares[None], tried]))
    feasible = judged.violation[1:] == 0
    gain = judged.cost[0] - judged.cost[1:]
    better = feasible & (gain > GAIN * abs(judged.cost[0]))
    if judged.violation[0] > 0:
        better = judged.violation[1:] < (1 - GAIN) * judged.violation[0]
    best = tried[judged.order()[judged.order() > 0][0] - 1] if better.any() else None
    counts = [tuple(int(n) for n in each.reshape(len(RADII), -1).sum(axis=1)) for each in (feasible, better)]
    return (NEIGHBOURS,) * len(RADII), counts[0], counts[1], best
