"""Optimization methods: parallel local searches from many starts, or differential evolution."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from queue import SimpleQueue
from typing import TypeVar

import numpy as np
from scipy.optimize import differential_evolution, least_squares, minimize
from scipy.stats import qmc

from kinelast.designs.problem import DesignProblem, Linear, linearized
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Reals

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Result = TypeVar("Result")


def batched(
    jobs: Sequence[Callable[[Callable[[Question], Answer]], Result]], answers: Callable[[list[Question]], list[Answer]]
) -> list[Result]:
    """Run jobs in parallel and answer their questions in batches.

    A job calls its argument to ask a question. Once every running job has asked a question, one call of `answers`
    answers them all, in the caller's thread and in the order of the jobs. Timing therefore does not affect the result.
    An exception in a job or in `answers` ends all jobs.
    """
    if not jobs:
        return []
    events: SimpleQueue[tuple[int, Question, Future[Answer]] | None] = SimpleQueue()  # questions; None: a job has ended

    def run(number: int) -> Result:
        def ask(question: Question) -> Answer:
            reply: Future[Answer] = Future()
            events.put((number, question, reply))
            return reply.result()

        try:
            return jobs[number](ask)
        finally:
            events.put(None)

    running, waiting = len(jobs), list[tuple[int, Question, Future[Answer]]]()
    with ThreadPoolExecutor(running) as pool:
        results = [pool.submit(run, number) for number in range(running)]
        try:
            while running:
                if waiting and len(waiting) == running:
                    waiting.sort(key=lambda each: each[0])
                    found = answers([question for _, question, _ in waiting])
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
            while running:  # jobs that will ask again
                if event := events.get():
                    event[2].cancel()
                else:
                    running -= 1
            raise
    return [each.result() for each in results]


SAMPLES_PER_VARIABLE = 64  # number of designs from which starts are selected
MAX_SAMPLES = 1024
STARTS = 8
MIN_START_DISTANCE = 0.1  # smallest distance between starts, relative to the diagonal of the unit cube
MAX_ITERATIONS, MAX_FURTHER_ITERATIONS = 40, 200  # iterations of a local search; of the best, unconverged one
PRECISION = 1e-13  # relative change of the cost at which a local search ends
POPULATION, GENERATIONS = 15, 400  # population size per variable; maximum number of generations
ITERATION_LIMIT_STATUS = 9  # scipy's status of a search that ran out of iterations
PENALTY = 1e3  # cost of a design without figures, relative to the start
INFEASIBLE = 1e50  # offset that ranks infeasible designs after all others


@dataclass(frozen=True)
class LocalOptimum:
    """End of a local search.

    Attributes
    ----------
    start, end
        Shares of the variables, shape (variables,).
    cost
        Value to be minimised.
    violation
        Sum of relative limit violations.
    ended
        True if the search converged.
    """

    start: Reals
    end: Reals
    cost: float
    violation: float
    ended: bool

    @property
    def rank(self) -> tuple[float, float]:
        """Sort key, best first."""
        return self.violation, self.cost


def from_many_starts(
    problem: DesignProblem, seed: int = 0, first: np.ndarray | None = None, progress: Progress = SILENT
) -> list[LocalOptimum]:
    """Local searches from distinct good designs of a Latin hypercube; best first.

    Parameters
    ----------
    first
        Additional start, shape (variables,).
    """
    return local_searches(problem, _starts(problem, seed, first), progress)


def _starts(problem: DesignProblem, seed: int, first: np.ndarray | None) -> list[np.ndarray]:
    """Good designs that are not too close to one another."""
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
    """Local search from the best design of a differential evolution."""
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
    """Run local searches from several starts at once, best first; continue the best until it converges."""
    optima = _side_by_side(problem, starts, MAX_ITERATIONS, progress)
    if optima and not optima[0].ended and np.isfinite(optima[0].violation):
        further = _side_by_side(problem, [optima[0].end], MAX_FURTHER_ITERATIONS, progress)[0]
        if further.rank < optima[0].rank:
            optima[0] = replace(further, start=optima[0].start)
    return optima


def _side_by_side(
    problem: DesignProblem, starts: Sequence[np.ndarray], most: int, progress: Progress
) -> list[LocalOptimum]:
    """Run local searches with at most `most` iterations; best first."""
    calls = [0]

    def answers(questions: list[np.ndarray]) -> list[Linear]:
        calls[0] += 1
        progress("steps of local searches", min(calls[0], most), most)
        return linearized(problem, questions)

    found = batched([partial(_local_search, np.asarray(start, float), problem, most) for start in starts], answers)
    return sorted(found, key=lambda each: each.rank)


def _local_search(
    start: np.ndarray, problem: DesignProblem, most: int, ask: Callable[[np.ndarray], Linear]
) -> LocalOptimum:
    """Local search from one start.

    Least squares first if the goal is a sum of squares, then sequential quadratic programming if there are limits.
    """
    known: dict[bytes, Linear] = {}

    def at(shares: np.ndarray) -> Linear:
        shares = np.clip(shares, 0.0, 1.0)
        key = shares.tobytes()
        if key not in known:
            known[key] = ask(shares)
        return known[key]

    def best() -> Linear:
        return min(known.values(), key=lambda each: (each.violation, each.cost))

    first = at(start)
    if not np.isfinite(first.cost):
        return LocalOptimum(start, start, np.nan, np.inf, True)
    ended = True
    with np.errstate(all="ignore"):
        if problem.parts:
            ended = _least_squares(at, start, most)
        if problem.limits or not problem.parts:
            ended = _quadratic_programming(at, best().shares, bool(problem.limits), most)
    return LocalOptimum(start, best().shares, best().cost, best().violation, ended)


def _least_squares(at: Callable[[np.ndarray], Linear], start: np.ndarray, most: int) -> bool:
    """Minimise a sum of squares; return True if converged."""
    unit = float(np.linalg.norm(at(start).parts)) or 1.0
    result = least_squares(
        lambda shares: _finite(at(shares).parts / unit, PENALTY), np.clip(start, 1e-6, 1 - 1e-6), bounds=(0.0, 1.0),
        jac=lambda shares: _finite(at(shares).parts_slope / unit, 0.0), max_nfev=most,
        x_scale="jac", xtol=1e-12, ftol=1e-14, gtol=1e-15,
    )  # fmt: skip
    return bool(result.status > 0)


def _quadratic_programming(at: Callable[[np.ndarray], Linear], start: np.ndarray, limited: bool, most: int) -> bool:
    """Minimise the cost within limits; return True if converged."""
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
