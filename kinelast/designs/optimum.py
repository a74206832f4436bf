"""The best design of a problem, with its certificate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kinelast.designs.asked import OptimizationTask
from kinelast.designs.certificate import Certificate, certificate
from kinelast.designs.problem import Problem
from kinelast.designs.search import LocalOptimum, evolved, from_many_starts, local_searches
from kinelast.process.progress import SILENT, Progress
from rigid.arrays import Reals

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
    searches = (evolved if evolve else from_many_starts)(problem, seed, first, progress)
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
    quasi_static
        Whether the scene asks for no other theory, as all figures here are without vibration.
    """

    task: OptimizationTask
    optimum: Optimum
    units: Mapping[str, str]
    before: Mapping[str, float]
    after: Mapping[str, float]
    quasi_static: bool = True
