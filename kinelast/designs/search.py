"""Searches for the best design: local ones from many starts, side by side, or a population that evolves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from queue import SimpleQueue
from typing import Any, TypeVar

import numpy as np
from scipy.optimize import differential_evolution, least_squares, minimize
from scipy.stats import qmc

from kinelast.designs.problem import Linear, Problem, linearized
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Reals

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Result = TypeVar("Result")


def batched(
    jobs: Sequence[Callable[[Callable[[Question], Answer]], Result]],
    answers: Callable[[list[Question]], list[Answer]],
) -> list[Result]:
    """Results of jobs that run side by side.

    A job is a function of what it asks its questions by. When each job that has not ended has asked one, all are
    answered by one call of `answers`, in the caller's thread and in the jobs' order: who is quick and who is slow makes
    no difference. What a job or `answers` raises ends all.
    """
    if not jobs:
        return []
    asked: SimpleQueue[tuple[int, Any]] = SimpleQueue()
    replies: list[SimpleQueue[Any]] = [SimpleQueue() for _ in jobs]

    def run(number: int) -> Result:
        def ask(question: Question) -> Answer:
            asked.put((number, question))
            reply = replies[number].get()
            if isinstance(reply, _Stop):
                raise _StoppedError
            answer: Answer = reply
            return answer

        try:
            return jobs[number](ask)
        finally:
            asked.put((number, _DONE))

    with ThreadPoolExecutor(len(jobs)) as pool:
        running = [pool.submit(run, number) for number in range(len(jobs))]
        try:
            _serve(asked, replies, answers)
        except BaseException:
            for reply in replies:  # one that waits, or will ask once more
                reply.put(_Stop())
            raise
        return [each.result() for each in running]


class _Stop:
    """Instead of an answer: there are no more."""


class _StoppedError(Exception):
    """Ends a job that waits for an answer that will not come."""


_DONE = object()


def _serve(
    asked: SimpleQueue[tuple[int, Any]], replies: Sequence[SimpleQueue[Any]], answers: Callable[[list[Any]], list[Any]]
) -> None:
    """Answer questions until all jobs have ended."""
    waiting: dict[int, Any] = {}
    running = len(replies)
    while running:
        number, question = asked.get()
        if question is _DONE:
            running -= 1
        else:
            waiting[number] = question
        if waiting and len(waiting) == running:
            numbers = sorted(waiting)
            for each, answer in zip(numbers, answers([waiting[each] for each in numbers]), strict=True):
                replies[each].put(answer)
            waiting.clear()


SAMPLED = 64  # designs to a variable, of which the best are starts
MOST_SAMPLED = 1024
STARTS = 8
ASUNDER = 0.1  # how far starts are apart, of the diagonal
ITERATIONS, FURTHER = 40, 200  # of every local search, and of the best one if it has not ended then
PRECISION = 1e-13  # of the cost, at which a local search ends
POPULATION, GENERATIONS = 15, 400  # to a variable; at most
OUT_OF_STEPS = 9  # as scipy says it
LOST = 1e3  # cost, in units of the start's, of a design that has no figures
WORSE = 1e50  # than any cost: designs that break a limit come after all others


@dataclass(frozen=True)
class LocalOptimum:
    """Where a local search has ended.

    Attributes
    ----------
    start, end
        Shares of the variables, shape (variables,).
    cost
        What is to be least, there.
    violation
        Sum of the shares by which limits are not kept.
    ended
        Whether the search ended by itself.
    """

    start: Reals
    end: Reals
    cost: float
    violation: float
    ended: bool

    @property
    def rank(self) -> tuple[float, float]:
        """By which the better comes first."""
        return self.violation, self.cost


def from_many_starts(
    problem: Problem, seed: int = 0, first: np.ndarray | None = None, progress: Progress = SILENT
) -> list[LocalOptimum]:
    """Local searches from the best designs of a Latin hypercube, that lie apart; the best first.

    Parameters
    ----------
    first
        One more start, shape (variables,).
    """
    return local_searches(problem, _starts(problem, seed, first), progress)


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


def evolved(
    problem: Problem, seed: int = 0, first: np.ndarray | None = None, progress: Progress = SILENT
) -> list[LocalOptimum]:
    """The end of a local search from the best of a population that has evolved (differential evolution)."""
    variables, generation = len(problem.low), [0]

    def cost(shares: np.ndarray) -> np.ndarray:  # (variables, designs)
        judged = problem.judged(shares.T)
        broken = np.minimum(judged.violation, LOST)
        return np.where(broken > 0, WORSE * (1 + broken), judged.cost)

    def on_generation(*_: object) -> None:
        generation[0] += 1
        progress("generations", generation[0], GENERATIONS)

    result = differential_evolution(
        cost, [(0.0, 1.0)] * variables, vectorized=True, updating="deferred", polish=False, popsize=POPULATION,
        maxiter=GENERATIONS, rng=np.random.default_rng(seed), x0=first, callback=on_generation, tol=1e-8,
    )  # fmt: skip
    return local_searches(problem, [np.asarray(result.x)], progress)


def local_searches(problem: Problem, starts: Sequence[np.ndarray], progress: Progress = SILENT) -> list[LocalOptimum]:
    """Where local searches end from several starts at once, the best first; that one goes on until it ends."""
    optima = _side_by_side(problem, starts, ITERATIONS, progress)
    if optima and not optima[0].ended and np.isfinite(optima[0].violation):
        further = _side_by_side(problem, [optima[0].end], FURTHER, progress)[0]
        if further.rank < optima[0].rank:
            optima[0] = replace(further, start=optima[0].start)
    return optima


def _side_by_side(problem: Problem, starts: Sequence[np.ndarray], most: int, progress: Progress) -> list[LocalOptimum]:
    """Local searches of so many iterations at most; the best first."""
    calls = [0]

    def answers(asked: list[np.ndarray]) -> list[Linear]:
        calls[0] += 1
        progress("steps of local searches", min(calls[0], most), most)
        return linearized(problem, asked)

    found = batched([partial(_local_search, np.asarray(start, float), problem, most) for start in starts], answers)
    return sorted(found, key=lambda each: each.rank)


def _local_search(start: np.ndarray, problem: Problem, most: int, ask: Callable[[np.ndarray], Linear]) -> LocalOptimum:
    """The best design that a local search comes by from a start.

    Least squares first where that is what is sought, then sequential quadratic programming where there are limits.
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
    """Whether a search for the least sum of squares ends."""
    unit = float(np.linalg.norm(at(start).parts)) or 1.0
    result = least_squares(
        lambda shares: _known(at(shares).parts / unit, LOST), np.clip(start, 1e-6, 1 - 1e-6), bounds=(0.0, 1.0),
        jac=lambda shares: _known(at(shares).parts_slope / unit, 0.0), max_nfev=most,
        x_scale="jac", xtol=1e-12, ftol=1e-14, gtol=1e-15,
    )  # fmt: skip
    return bool(result.status > 0)


def _quadratic_programming(at: Callable[[np.ndarray], Linear], start: np.ndarray, limited: bool, most: int) -> bool:
    """Whether a search for the least cost within limits ends."""
    unit = abs(at(start).cost) or 1.0
    constraints = {
        "type": "ineq",
        "fun": lambda shares: _known(at(shares).margin, -LOST),
        "jac": lambda shares: _known(at(shares).margin_slope, 0.0),
    }
    result = minimize(
        lambda shares: float(_known(np.array(at(shares).cost / unit), LOST)), start, bounds=[(0.0, 1.0)] * len(start),
        jac=lambda shares: _known(at(shares).cost_slope / unit, 0.0), constraints=[constraints] if limited else [],
        method="SLSQP", options={"maxiter": most, "ftol": PRECISION},
    )  # fmt: skip
    return bool(result.status != OUT_OF_STEPS)


def _known(values: np.ndarray, instead: float) -> np.ndarray:
    return np.where(np.isfinite(values), values, instead)
