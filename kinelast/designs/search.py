"""Optimization methods: parallel local searches from many starts, or differential evolution.

The arrays `shares` contain the variables of designs, each scaled to 0...1 between its bounds.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from queue import SimpleQueue
from typing import TypeVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from scipy.optimize import differential_evolution, least_squares, minimize
from scipy.stats import qmc

from kinelast.designs.linearization import Linear, linearized
from kinelast.designs.problem import DesignProblem
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Reals

Request = TypeVar("Request")
Reply = TypeVar("Reply")
Result = TypeVar("Result")


def batched(
    jobs: Sequence[Callable[[Callable[[Request], Reply]], Result]], answers: Callable[[list[Request]], list[Reply]]
) -> list[Result]:
    """Run jobs in parallel, and evaluate the requests of all jobs in batches.

    Each job receives a function as argument. The job passes a request to this function, which returns the reply. When
    every running job waits for a reply, a single call of `answers` evaluates all waiting requests, sorted by job.
    `answers` runs in the thread that called `batched`. Results therefore do not depend on the order in which requests
    arrive.

    An exception in a job or in `answers` ends all jobs.
    """
    if not jobs:
        return []
    events: SimpleQueue[tuple[int, Request, Future[Reply]] | None] = SimpleQueue()  # None means that a job has ended

    def run(number: int) -> Result:
        def request(point: Request) -> Reply:
            reply: Future[Reply] = Future()
            events.put((number, point, reply))
            return reply.result()

        try:
            return jobs[number](request)
        finally:
            events.put(None)

    running, waiting = len(jobs), list[tuple[int, Request, Future[Reply]]]()
    with ThreadPoolExecutor(running) as pool:
        results = [pool.submit(run, number) for number in range(running)]
        try:
            while running:
                if waiting and len(waiting) == running:
                    waiting.sort(key=lambda each: each[0])
                    found = answers([point for _, point, _ in waiting])
                    for (_, _, reply), answer in zip(waiting, found, strict=True):
                        reply.set_result(answer)
                    waiting = []
                if event := events.get():
                    waiting.append(event)
                else:
                    running -= 1
        except BaseException:
            for _, _, reply in waiting:
                reply.cancel()
            while running:  # wait for the running jobs, and cancel their further requests
                if event := events.get():
                    event[2].cancel()
                else:
                    running -= 1
            raise
    return [each.result() for each in results]


SAMPLES_PER_VARIABLE = 64  # number of sampled designs per variable; the best samples are the starts of local searches
MAX_SAMPLES = 1024
STARTS = 8
MIN_START_DISTANCE = 0.1  # (smallest distance between two starts) / (diagonal of the unit cube of scaled variables)
# Maximum number of iterations of a local search. If the best local search has not converged, this search continues with
# at most MAX_FURTHER_ITERATIONS iterations.
MAX_ITERATIONS, MAX_FURTHER_ITERATIONS = 40, 200
PRECISION = 1e-13  # sequential quadratic programming ends when (change in cost) / (cost at the start) < PRECISION
# Differential evolution: (population size) / (number of variables), maximum number of generations.
POPULATION, GENERATIONS = 15, 400
ITERATION_LIMIT_STATUS = 9  # status that scipy returns if a search reaches the maximum number of iterations
# Local searches replace an unknown (cost) / (cost at the start) by PENALTY, and an unknown relative margin by -PENALTY.
# Differential evolution limits each violation to PENALTY.
PENALTY = 1e3
# A differential evolution uses the cost INFEASIBLE * (1 + violation) for infeasible designs, to exceed all feasible
# costs.
INFEASIBLE = 1e50


class LocalOptimum(Struct, frozen=True):
    """Result of a local search.

    Attributes
    ----------
    start, end
        Scaled variables of the design at the start and of the best design, shape (variables,).
    cost
        Cost of the best design, i.e. the value that the search minimises.
    violation
        Sum of the relative limit violations of the best design.
    converged
        True if the search converged.
    """

    start: Reals
    end: Reals
    cost: float
    violation: float
    converged: bool

    @property
    def rank(self) -> tuple[float, float]:
        """Sort key of a local search. The best local search has the smallest key."""
        return self.violation, self.cost


def from_many_starts(
    problem: DesignProblem, seed: int = 0, first: np.ndarray | None = None, progress: Progress = SILENT
) -> list[LocalOptimum]:
    """Run local searches from the best designs of a Latin hypercube; return the results, best first.

    Parameters
    ----------
    seed
        Seed of the random generator.
    first
        Scaled variables of an additional start, shape (variables,).
    """
    return local_searches(problem, _starts(problem, seed, first), progress)


def _starts(problem: DesignProblem, seed: int, first: np.ndarray | None) -> list[np.ndarray]:
    """Return the starts of local searches: `first`, and the best designs of a Latin hypercube.

    Two starts are at least `MIN_START_DISTANCE` * (diagonal of the unit cube) apart.
    """
    variables = len(problem.low)
    cube = qmc.LatinHypercube(variables, rng=np.random.default_rng(seed))
    shares = cube.random(min(SAMPLES_PER_VARIABLE * variables, MAX_SAMPLES))
    judged = problem.judged(shares)
    starts = [] if first is None else [np.asarray(first, float)]
    for number in judged.order()[: int(np.isfinite(judged.violation).sum())]:
        apart = (np.linalg.norm(shares[number] - start) > MIN_START_DISTANCE * np.sqrt(variables) for start in starts)
        if len(starts) < STARTS and all(apart):
            starts.append(shares[number])
    return starts


def evolved(
    problem: DesignProblem, seed: int = 0, first: np.ndarray | None = None, progress: Progress = SILENT
) -> list[LocalOptimum]:
    """Run a differential evolution, then a local search from the best design of the evolution."""
    variables, generation = len(problem.low), [0]

    def cost(shares: np.ndarray) -> np.ndarray:  # (variables, designs)
        judged = problem.judged(shares.T)
        broken = np.minimum(judged.violation, PENALTY)
        return np.where(broken > 0, INFEASIBLE * (1 + broken), judged.cost)

    def on_generation(*_: object) -> None:
        generation[0] += 1
        progress("generations", generation[0], GENERATIONS)

    result = differential_evolution(
        cost, [(0.0, 1.0)] * variables, vectorized=True, updating="deferred", polish=False, popsize=POPULATION,
        maxiter=GENERATIONS, rng=np.random.default_rng(seed), x0=first, callback=on_generation, tol=1e-8,
    )  # fmt: skip
    return local_searches(problem, [np.asarray(result.x)], progress)


def local_searches(
    problem: DesignProblem, starts: Sequence[np.ndarray], progress: Progress = SILENT
) -> list[LocalOptimum]:
    """Run local searches from several starts in parallel; return the results, best first.

    If the best local search has not converged, this search continues with at most `MAX_FURTHER_ITERATIONS` iterations.
    """
    optima = _run_together(problem, starts, MAX_ITERATIONS, progress)
    if optima and not optima[0].converged and np.isfinite(optima[0].violation):
        further = _run_together(problem, [optima[0].end], MAX_FURTHER_ITERATIONS, progress)[0]
        if further.rank < optima[0].rank:
            optima[0] = replace(further, start=optima[0].start)
    return optima


def _run_together(
    problem: DesignProblem, starts: Sequence[np.ndarray], most: int, progress: Progress
) -> list[LocalOptimum]:
    """Run local searches with at most `most` iterations each; return the results, best first."""
    calls = [0]

    def answers(points: list[np.ndarray]) -> list[Linear]:
        calls[0] += 1
        progress("steps of local searches", min(calls[0], most), most)
        return linearized(problem, points)

    found = batched([partial(_local_search, np.asarray(start, float), problem, most) for start in starts], answers)
    return sorted(found, key=lambda each: each.rank)


def _local_search(
    start: np.ndarray, problem: DesignProblem, most: int, request: Callable[[np.ndarray], Linear]
) -> LocalOptimum:
    """Run a local search from one start.

    If the cost is a sum of squares, a least-squares method minimises the cost without limits. If there are limits,
    sequential quadratic programming then continues from the best design. Any other cost is minimised by sequential
    quadratic programming only.
    """
    known: dict[bytes, Linear] = {}

    def at(shares: np.ndarray) -> Linear:
        shares = np.clip(shares, 0.0, 1.0)
        key = shares.tobytes()
        if key not in known:
            known[key] = request(shares)
        return known[key]

    def best() -> Linear:
        return min(known.values(), key=lambda each: (each.violation, each.cost))

    first = at(start)
    if not np.isfinite(first.cost):
        return LocalOptimum(start, start, np.nan, np.inf, True)
    converged = True
    with np.errstate(all="ignore"):
        if problem.parts:
            converged = _least_squares(at, start, most)
        if problem.limits or not problem.parts:
            converged = _quadratic_programming(at, best().shares, bool(problem.limits), most)
    return LocalOptimum(start, best().shares, best().cost, best().violation, converged)


def _least_squares(at: Callable[[np.ndarray], Linear], start: np.ndarray, most: int) -> bool:
    """Minimise a sum of squares without limits. Return True if the search converges."""
    unit = float(np.linalg.norm(at(start).parts)) or 1.0
    result = least_squares(
        lambda shares: _finite(at(shares).parts / unit, PENALTY), np.clip(start, 1e-6, 1 - 1e-6), bounds=(0.0, 1.0),
        jac=lambda shares: _finite(at(shares).parts_slope / unit, 0.0), max_nfev=most,
        x_scale="jac", xtol=1e-12, ftol=1e-14, gtol=1e-15,
    )  # fmt: skip
    return bool(result.status > 0)


def _quadratic_programming(at: Callable[[np.ndarray], Linear], start: np.ndarray, limited: bool, most: int) -> bool:
    """Minimise the cost within limits. Return True if the search converges."""
    unit = abs(at(start).cost) or 1.0
    constraints = {
        "type": "ineq",
        "fun": lambda shares: _finite(at(shares).margin, -PENALTY),
        "jac": lambda shares: _finite(at(shares).margin_slope, 0.0),
    }
    result = minimize(
        lambda shares: float(_finite(np.array(at(shares).cost / unit), PENALTY)),
        start, bounds=[(0.0, 1.0)] * len(start),
        jac=lambda shares: _finite(at(shares).cost_slope / unit, 0.0), constraints=[constraints] if limited else [],
        method="SLSQP", options={"maxiter": most, "ftol": PRECISION},
    )  # fmt: skip
    return bool(result.status != ITERATION_LIMIT_STATUS)


def _finite(values: np.ndarray, instead: float) -> np.ndarray:
    return np.where(np.isfinite(values), values, instead)
