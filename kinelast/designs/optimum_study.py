"""Optimization of a scene: the problem that [optimize] defines, and the search for the best design.

The search uses quasi-static figures (results such as the largest stress). A full answer of the best design, computed by
the theory that the scene requests, shows whether it meets the limits.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from scipy.stats import qmc

from kinelast.designs import tolerances
from kinelast.designs.base import design_measures
from kinelast.designs.evaluate import batched_figures, evaluate
from kinelast.designs.optimum import ACTIVE, Optimum, OptimumResult, optimum, optimum_from
from kinelast.designs.problem import SPARE, DesignProblem, OptimizationTask, adjusted_bound, optimization_task
from kinelast.figures.output import output_of
from kinelast.figures.registry import limits_of
from kinelast.reports.full_answer import FullAnswer, full_answer
from kinelast.reports.limits import BROKEN, KEPT, TOO_NEAR, Judgement
from kinelast.scene.data import Scene
from kinelast.scene.document import Document, Tables, document_of
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import Output
from kinelast.tasks.progress import SILENT, Progress
from kinelast.values.error import fault, known_name
from kinelast.values.figure import Figure
from kinelast.values.numbers import with_limit

MAX_ROUNDS = 6  # maximum number of rounds of an optimization; each round computes a full answer and adjusts the bounds
# From the fourth round on, each round multiplies `SPARE`, the extra margin to the limits, by this factor, if no design
# has met all limits.
GROWTH = 16.0
# A further round follows if the full answer keeps a relative margin above MAX_SPARE to an active limit.
MAX_SPARE = 0.01
SCREENED_DESIGNS = 16  # number of sampled designs, computed to find limited figures that do not depend on the variables
# A figure does not depend on the variables if (largest - smallest value) / (largest magnitude) is at most this value.
MAX_CONSTANT_CHANGE = 1e-9


class PosedProblem(Struct, frozen=True, eq=False):
    """The optimization problem that [optimize] defines.

    Attributes
    ----------
    task, problem
        The optimization task as read from the tables, and the problem for the search, with variables scaled to 0...1.
    before, units
        Figures of the nominal scene, and units of the figures, by name.
    quasi_static
        True if the scene requests the quasi-static theory.
    """

    task: OptimizationTask
    problem: DesignProblem
    before: Mapping[str, float]
    units: Mapping[str, str]
    quasi_static: bool


def problem_of(given: Document | Tables) -> PosedProblem:
    """Build the optimization problem that [optimize] defines.

    Raises
    ------
    SceneError
        The tables are invalid, or [optimize] names no figure to be minimised or maximised.
    """
    document = document_of(given)
    table, scene = document.table, document.scene
    path = _path_figures(table, scene)
    base = evaluate(document, [], np.zeros((1, 0)), _known_figures(table, scene, path))
    known = {name: unit for name, unit in base.units.items() if base.reason[0] or not np.isnan(base.columns[name][0])}
    task = optimization_task(document, known)
    by_name = {figure.key: figure for figure in path}
    squares = task.figure == tolerances.SQUARES
    parts = tuple(each.key for each in path if squares and each.key.startswith(tolerances.PART))
    names = list(dict.fromkeys([task.figure, *(limit.figure for limit in task.limits), *parts]))
    paths = [one.path for one in task.variables]
    figures_of = batched_figures(document, paths, [by_name.get(name, name) for name in names])
    problem = DesignProblem(figures_of, task.low, task.high, task.figure, task.largest, task.limits, parts)
    return PosedProblem(task, problem, _first_values(base.columns), base.units, scene.theory.plain)


def optimum_study(scene: Document | Tables, progress: Progress = SILENT) -> OptimumResult:
    """Find the best design according to [optimize].

    Raises
    ------
    SceneError
        The tables are invalid, or [optimize] names no figure to be minimised or maximised. No design can meet the
        limits, or the search finds no design with the required figures.
    """
    document = document_of(scene)
    posed = problem_of(document)
    task, problem = posed.task, posed.problem
    first = problem.shares(np.array([one.base for one in task.variables]))
    _require_feasible(document.scene, posed, first)
    try:
        best = optimum(problem, task.evolve, task.seed, first, progress)
    except ValueError as error:
        raise fault("optimize", "", str(error)) from None
    last = _with_reserve(document, task, _FullyJudged(problem, best), progress)
    after = _first_values(last.problem.figures_of(last.best.values[None]).columns)
    held_to = tuple(limit.bound for limit in last.problem.limits)
    return OptimumResult(
        task, last.best, held_to, last.judgements, posed.units, posed.before, after, posed.quasi_static, last.answer
    )


def _require_feasible(scene: Scene, posed: PosedProblem, first: np.ndarray) -> None:
    """Raise SceneError if a figure violates a limit and does not depend on the variables.

    No values of the variables can then meet the limit. A figure counts as independent of the variables if all sampled
    designs have equal values of the figure.
    """
    task, problem = posed.task, posed.problem
    cube = qmc.Sobol(len(first), rng=np.random.default_rng(task.seed)).random(SCREENED_DESIGNS)
    with np.errstate(all="ignore"):
        columns = problem.figures_of(problem.values(np.concatenate([first[None], cube]))).columns
    problems = []
    for limit in problem.limits:
        values = np.asarray(columns[limit.figure], float)
        constant = np.isfinite(values).all() and np.ptp(values) <= MAX_CONSTANT_CHANGE * np.abs(values).max()
        if constant and limit.margin(values).max() < 0:
            value, bound = with_limit(float(values[0]), float(limit.bound), posed.units[limit.figure], scene.shown_in)
            problems.append(f"{limit.figure} is {value}, required {'at least' if limit.least else 'at most'} {bound}")
    if problems:
        why = "no design meets a limit that does not depend on the variables"
        advice = "add variables or change the limit"
        raise fault("optimize.variables", "", f"{why}: {'; '.join(problems)}: {advice}")


class _FullyJudged(Struct, frozen=True, eq=False):
    """A problem, the best design found, and the full answer for this design (None if not computed)."""

    problem: DesignProblem
    best: Optimum
    answer: FullAnswer | None = None

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """For each limit, the outcome of comparing the full answer with the limit; empty if there is no full answer."""
        return self.answer.judgements if self.answer else ()

    @property
    def settled(self) -> bool:
        """True if no further search with adjusted bounds is needed.

        The full answer must clearly meet every limit. In addition, the relative margin of the full answer to every
        active limit must be at most `MAX_SPARE`.
        """
        if any(each.outcome in (TOO_NEAR, BROKEN) for each in self.judgements):
            return False
        holds = np.abs(self.best.certificate.margin) < ACTIVE
        left = [float(each.limit.margin(each.worst)) for each in self.judgements]
        return not any(hold and share > MAX_SPARE for hold, share in zip(holds, left, strict=True))


def _with_reserve(document: Document, task: OptimizationTask, first: _FullyJudged, progress: Progress) -> _FullyJudged:
    """Search for the best design that meets all limits with its full answer and errors.

    The quasi-static search leaves no reserve for vibration and errors. Therefore, each round computes the full answer
    of the best design, adjusts the bounds on quasi-static figures, and continues the search. The result is the best
    design with a full answer that meets all limits. If there is no such design, the result is the design of the last
    round.

    If there are no limits, there are no bounds to adjust. A single full answer is then computed if the figure to be
    optimized depends on the deflection. Otherwise no full answer is computed.
    """
    goal = design_measures(document.scene, output_of(document.scene)).get(task.figure)
    worth = bool(task.limits) or (goal is not None and not goal.figure.rigid)
    kept: _FullyJudged | None = None
    now, least = first, np.inf
    known: list[list[tuple[float, float]]] = [[] for _ in task.limits]
    for left in reversed(range(MAX_ROUNDS)):
        if not now.best.feasible or not worth:
            break
        progress("full answer of the best design", MAX_ROUNDS - 1 - left, MAX_ROUNDS)
        chosen = zip((number.path for number in task.variables), now.best.values.tolist(), strict=True)
        scene = document.with_values(dict(chosen)).scene
        now = replace(now, answer=full_answer(scene, task.limits, [task.figure]))
        columns = now.problem.figures_of(now.best.values[None]).columns
        cost = (-1.0 if task.largest else 1.0) * float(columns[task.figure][0])
        if all(each.outcome == KEPT for each in now.judgements) and not cost >= least:
            kept, least = now, cost
        if now.settled or not left:
            break
        for so_far, each in zip(known, now.judgements, strict=True):
            so_far.append((float(columns[each.limit.figure][0]), each.worst))
        # Keep an extra margin, because the error in the next design differs from the error in this design.
        spare = SPARE * (1.0 if kept else GROWTH ** max(0, MAX_ROUNDS - 3 - left))
        bounds = [adjusted_bound(each, so_far, spare) for each, so_far in zip(now.judgements, known, strict=True)]
        problem = now.problem.held_to(bounds)
        now = _FullyJudged(problem, optimum_from(problem, now.best.shares, task.seed, progress))
    return kept or now


def _known_figures(table: SceneTable, scene: Scene, path: Sequence[Figure]) -> list[str | Figure]:
    """Return all figures that a limit or goal may use.

    A figure that is computed only on request is included if a limit or the goal names this figure.
    """
    limits = (limit.figure for limit in limits_of(scene))
    named = {table.optimize.minimize, table.optimize.maximize, *table.optimize.limits, *limits}
    measures = design_measures(scene, output_of(scene)).values()
    return [*(measure.name for measure in measures if measure.name in named or not measure.figure.asked), *path]


def _path_figures(table: SceneTable, scene: Scene) -> list[Figure]:
    """Return the figures that compare the motion of a point with the path in [optimize.path]."""
    path_table = table.optimize.path
    if path_table is None:
        return []
    places = [complex(*place) for place in path_table.places]
    if len(places) != scene.run.positions:
        problem = f"expected a point for each of the {scene.run.positions} positions of the run, got {len(places)}"
        raise fault("optimize.path", "places", problem)
    moving = {point: link.name for link in reversed(scene.mechanism.links[1:]) for point in link.points}
    known_name("optimize.path", "point", path_table.point, moving, "point that moves")
    return tolerances.path_figures(Output(moving[path_table.point], path_table.point), places)


def _first_values(columns: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(values[0]) for name, values in columns.items()}
