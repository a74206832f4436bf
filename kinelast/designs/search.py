"""The best design: local searches from many starts, or a population that evolves, each step one call for all designs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.stats import qmc

from kinelast.designs.problem import Linear, Problem, linearized

SAMPLED = 64  # designs to a variable, of which the best are starts
MOST_SAMPLED = 1024
STARTS = 8
ASUNDER = 0.1  # how far starts are apart, of the diagonal
ITERATIONS = 200
PRECISION = 1e-13  # of the cost, at which a local search ends
POPULATION, GENERATIONS = 15, 400  # to a variable; at most
LOST = 1e3  # cost, in units of the start's, of a design that has no figures
WORSE = 1e50  # than any cost: designs that break a limit come after all others

Tell = Callable[[str, int, int], None]


def _unheard(stage: str, done: int, total: int) -> None:
    pass


@dataclass(frozen=True)
class Found:
    """Where a local search has ended.

    Attributes
    ----------
    start, end
        Shares of the variables, shape (variables,).
    cost
        What is to be least, there.
    violation
        Sum of the shares by which limits are not kept.
    """

    start: np.ndarray
    end: np.ndarray
    cost: float
    violation: float

    @property
    def rank(self) -> tuple[float, float]:
        """By which the better comes first."""
        return self.violation, self.cost


def from_many_starts(
    problem: Problem, seed: int = 0, first: np.ndarray | None = None, tell: Tell = _unheard
) -> list[Found]:
    """Local searches from the best designs of a Latin hypercube, that lie apart; the best first.

    Parameters
    ----------
    first
        One more start, shape (variables,).
    """
    starts = _starts(problem, seed, first)
    found = []
    for number, start in enumerate(starts):
        tell("local searches", number, len(starts))
        found.append(local_search(problem, start))
    return sorted(found, key=lambda each: each.rank)


def _starts(problem: Problem, seed: int, first: np.ndarray | None) -> list[np.ndarray]:
    """Good designs that lie apart."""
    variables = len(problem.low)
    cube = qmc.LatinHypercube(variables, rng=np.random.default_rng(seed))
    shares = cube.random(min(SAMPLED * variables, MOST_SAMPLED))
    judged = problem.judged(shares)
    starts = [] if first is None else [np.asarray(first, float)]
    for number in judged.order()[: int(np.isfinite(judged.violation).sum())]:
        apart = (np.linalg.norm(shares[number] - start) > ASUNDER * np.sqrt(variables) for start in starts)
        if len(starts) < STARTS and all(apart):
            starts.append(shares[number])
    return starts


def evolved(problem: Problem, seed: int = 0, first: np.ndarray | None = None, tell: Tell = _unheard) -> list[Found]:
    """The end of a local search from the best of a population that has evolved (differential evolution)."""
    variables, generation = len(problem.low), [0]

    def cost(shares: np.ndarray) -> np.ndarray:  # (variables, designs)
        judged = problem.judged(shares.T)
        broken = np.minimum(judged.violation, LOST)
        return np.where(broken > 0, WORSE * (1 + broken), judged.cost)

    def on_generation(*_: object) -> None:
        generation[0] += 1
        tell("generations", generation[0], GENERATIONS)

    result = differential_evolution(
        cost, [(0.0, 1.0)] * variables, vectorized=True, updating="deferred", polish=False, popsize=POPULATION,
        maxiter=GENERATIONS, rng=np.random.default_rng(seed), x0=first, callback=on_generation, tol=1e-8,
    )  # fmt: skip
    return [local_search(problem, np.asarray(result.x))]


def local_search(problem: Problem, start: np.ndarray) -> Found:
    """Sequential quadratic programming from a start; the best design that it has come by."""
    known: dict[bytes, Linear] = {}

    def at(shares: np.ndarray) -> Linear:
        shares = np.clip(shares, 0.0, 1.0)
        key = shares.tobytes()
        if key not in known:
            known[key] = linearized(problem, shares)
        return known[key]

    unit = abs(at(start).cost) or 1.0
    if not np.isfinite(unit):
        return Found(start, start, np.nan, np.inf)

    def cost(shares: np.ndarray) -> float:
        value = at(shares).cost / unit
        return value if np.isfinite(value) else LOST

    constraints = {
        "type": "ineq",
        "fun": lambda shares: _known(at(shares).margin, -LOST),
        "jac": lambda shares: _known(at(shares).margin_slope, 0.0),
    }
    with np.errstate(all="ignore"):
        minimize(
            cost, start, jac=lambda shares: _known(at(shares).cost_slope / unit, 0.0), bounds=[(0.0, 1.0)] * len(start),
            constraints=[constraints] if problem.limits else [], method="SLSQP",
            options={"maxiter": ITERATIONS, "ftol": PRECISION},
        )  # fmt: skip
    best = min(known.values(), key=lambda each: (each.violation, each.cost))
    return Found(start, best.shares, best.cost, best.violation)


def _known(values: np.ndarray, instead: float) -> np.ndarray:
    return np.where(np.isfinite(values), values, instead)
