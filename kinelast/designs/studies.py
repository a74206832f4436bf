"""Studies of a scene (a mechanism with its motion): sensitivities, tolerances and optimization.

A study varies input values of the scene and computes results, called figures, e.g. the largest stress. Most figures are
computed by quasi-statics, i.e. without vibration. A full answer contains the figures of one design, computed by the
theory that the scene names, with errors.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from scipy.stats import qmc

from kinelast.designs import tolerances
from kinelast.designs.base import base_of, design_measures
from kinelast.designs.evaluate import Designs, evaluate, evaluated
from kinelast.designs.full_sample import FullColumn, full_columns
from kinelast.designs.optimum import ACTIVE, Optimum, OptimumResult, optimum, optimum_from
from kinelast.designs.problem import DesignProblem, OptimizationTask, optimization_task, tolerance_task
from kinelast.designs.sensitivities import Sensitivities, sensitivities
from kinelast.designs.tolerances import DESIGNS, ToleranceResult
from kinelast.figures import limits as judge
from kinelast.figures.limits import FullAnswer, Judgement, full_answer
from kinelast.figures.output import output_of
from kinelast.figures.registry import limits_of
from kinelast.scene.data import Scene, scene_motion
from kinelast.scene.document import Document, Tables, document_of
from kinelast.scene.error import fault, known_name
from kinelast.scene.figure import Figure
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import Output, sets_limit
from kinelast.scene.numbers import with_limit
from kinelast.scene.variables import Variable, numbers
from kinelast.tasks.progress import SILENT, Progress
from rigid.arrays import Integers

# These tables of a scene do not describe the machine. By default, a sensitivity study does not vary their input values.
NOT_NUMBERS = ("run", "limits", "sensitivities", "tolerances", "optimize", "sweep")
NOT_FIGURES = ("reach", judge.LIMITS_KEPT, judge.LIMITS_MARGIN, "condition")  # no meaningful derivatives
MAX_ROUNDS = 6  # maximum number of rounds of an optimization; each round computes a full answer and adjusts the bounds
GROWTH = 16.0  # from the fourth round on, each round multiplies `SPARE`, the extra margin to the limits, by this factor
# A further round follows if the full answer keeps a relative margin above MAX_SPARE to an active limit.
MAX_SPARE = 0.01
SCREENED_DESIGNS = 16  # number of sampled designs, computed to find limited figures that do not depend on the variables
# A figure does not depend on the variables if (largest - smallest value) / (largest magnitude) is at most this value.
MAX_CONSTANT_CHANGE = 1e-9
# Number of designs per batch: BATCH if all input values can be arrays, SMALL_BATCH if some can be arrays, otherwise 1.
# Progress is reported before each batch.
BATCH, SMALL_BATCH = 512, 64


def _figures_of(
    document: Document,
    paths: Sequence[str],
    figures: Sequence[str | Figure],
    progress: Progress = SILENT,
    stage: str = "",
) -> Callable[[np.ndarray], Designs]:
    """Return a function that computes the figures of designs in batches.

    The returned function takes the input values at `paths`, shape (designs, paths).
    """
    base = base_of(document, paths, figures)
    part = BATCH if all(base.on_axis) else SMALL_BATCH if any(base.on_axis) else 1

    def found(values: np.ndarray) -> Designs:
        parts = []
        for first in range(0, len(values), part):
            if stage:
                progress(stage, first, len(values))
            parts.append(evaluated(base, values[first : first + part]))
        if len(parts) == 1:
            return parts[0]
        places = {name: None for part in parts for name in part.place}
        return Designs(
            {name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns},
            parts[0].units,
            np.concatenate([part.reason for part in parts]),
            {name: np.concatenate([_place(part, name) for part in parts]) for name in places},
        )

    return found


def _place(part: Designs, name: str) -> Integers:
    return part.place.get(name, np.full(len(part.reason), -1))


def _nominal_figures(document: Document, figures: Sequence[str | Figure] | None) -> Designs:
    """Return the figures of the nominal scene, i.e. of the scene as written in the document.

    Raises
    ------
    SceneError
        The figures of the nominal scene cannot be computed.
    """
    found = evaluate(document, [], np.zeros((1, 0)), figures)
    if found.reason[0]:
        raise fault("", "", f"the scene as written: {found.reason[0]}")
    return found


def sensitivity_study(
    scene: Document | Tables, requested: Sequence[str] = (), progress: Progress = SILENT
) -> tuple[Sensitivities, tuple[Variable, ...], Mapping[str, str]]:
    """Return sensitivities of results (figures) to input values, the varied input values, and the units of the figures.

    Parameters
    ----------
    requested
        Paths of the input values to vary. If `requested` is empty, the paths in the table [sensitivities] are used. If
        the table has no paths, all input values that describe the machine are varied.

    Raises
    ------
    SceneError
        The tables are invalid, or the figures of the nominal scene cannot be computed.
    """
    document = document_of(scene)
    table = document.table
    paths = [*requested] or table.sensitivities.numbers or _machine_paths(table)
    names = table.sensitivities.figures or None
    base = _nominal_figures(document, names)
    chosen = names or [name for name in base.columns if name not in NOT_FIGURES and np.isfinite(base.columns[name][0])]
    variables = tuple(document.variable(path) for path in paths)
    figures_of = _figures_of(document, paths, chosen, progress, "sensitivities")
    at = np.array([one.base for one in variables])
    with np.errstate(all="ignore"):
        return sensitivities(figures_of, at, _scale(table, variables)), variables, base.units


def _machine_paths(table: SceneTable) -> list[str]:
    """Return the paths of all input values that describe the machine. Input values that set a limit are left out."""
    paths = [path for path in numbers(table) if path.partition(".")[0].partition("[")[0] not in NOT_NUMBERS]
    return [path for path in paths if not sets_limit(path)]


def _scale(table: SceneTable, variables: Sequence[Variable]) -> np.ndarray:
    """Return the scale of each variable, shape (variables,): the magnitude of its value, or 1 if the value is 0.

    The scale of a coordinate is at least the largest magnitude of all coordinates in [points].
    """
    extent = max((abs(float(each)) for place in table.points.values() for each in place), default=0.0) or 1.0
    return np.array(
        [
            max(abs(one.base), extent) if one.unit == "m" and one.path.endswith((".x", ".y")) else abs(one.base) or 1.0
            for one in variables
        ]
    )


def tolerance_study(scene: Document | Tables, designs: int = DESIGNS, progress: Progress = SILENT) -> ToleranceResult:
    """Compute the scatter of results (figures) if the input values of a scene vary within [tolerances].

    If the scene defines an output, the figures include two output errors: the error due to geometry alone, and the
    error due to geometry and deflection together.

    Parameters
    ----------
    designs
        Minimum number of sampled designs.

    Raises
    ------
    SceneError
        The tables are invalid, there are no tolerances, or the figures of the nominal scene cannot be computed.
    """
    document = document_of(scene)
    table, built, task = document.table, document.scene, tolerance_task(document)
    accuracy: list[str | Figure] = []
    if built.output is not None:
        accuracy += tolerances.accuracy_figures(scene_motion(built), built.output)
    base = _nominal_figures(document, None)
    known = [name for name in base.columns if name not in NOT_FIGURES and np.isfinite(base.columns[name][0])]
    figures = [*known, *accuracy]
    paths = [one.path for one in task.variables]
    at = np.array([one.base for one in task.variables])
    progress("full answer of the scene", 0, 1)
    limits = judge.limits_of_items(built)
    full, bounded = full_answer(built, limits, known), list(dict.fromkeys(limit.figure for limit in limits))
    seen: list[Mapping[str, Any]] = []
    complete: dict[str, FullColumn] = {}
    with np.errstate(all="ignore"):
        nominal = sensitivities(_figures_of(document, paths, figures), at, _scale(table, task.variables))
        more = [name for name in bounded if name not in known]
        figures_of = _figures_of(document, paths, [*figures, *more], progress, "designs within tolerances")

        def in_full(values: np.ndarray) -> FullAnswer:
            progress("full answers of the sample", 0, 1)
            chosen = document.with_values(dict(zip(paths, values.tolist(), strict=True)))
            return full_answer(chosen.scene, limits, [*known, *more])

        def noted(values: np.ndarray) -> Designs:
            sample = figures_of(values)
            seen.append(sample.columns)
            plain = {name: sample.columns[name] for name in dict.fromkeys([*known, *more])}
            complete.update(full_columns(in_full, values, plain, np.array([each.half for each in task.tolerances])))
            better = {name: each.value for name, each in complete.items() if np.isfinite(each.value).any()}
            return replace(sample, columns={**sample.columns, **better})

        sampled = tolerances.scatter(noted, task.tolerances, at, designs)
        shares = tolerances.variance_shares(
            _figures_of(document, paths, figures, progress, "shares"), task.tolerances, at
        )
    units = {**base.units, **{figure.key: str(figure.unit) for figure in accuracy if isinstance(figure, Figure)}}
    linear, count = (
        tolerances.first_order(nominal, task.tolerances),
        tolerances.REPEATS * tolerances.points_for(designs),
    )
    share = tolerances.kept_share(seen[0], full.judgements, complete, tolerances.WHOLE) if limits else None
    return ToleranceResult(task.variables, task.tolerances, nominal, linear, sampled, shares, units, count, full, share)


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
    figures_of = _figures_of(document, paths, [by_name.get(name, name) for name in names])
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
        if any(each.outcome in (judge.TOO_NEAR, judge.BROKEN) for each in self.judgements):
            return False
        holds = np.abs(self.best.certificate.margin) < ACTIVE
        left = [float(each.limit.margin(each.worst)) for each in self.judgements]
        return not any(hold and share > MAX_SPARE for hold, share in zip(holds, left, strict=True))


def _with_reserve(document: Document, task: OptimizationTask, first: _FullyJudged, progress: Progress) -> _FullyJudged:
    """Search for the best design that meets all limits with its full answer and errors.

    The quasi-static search leaves no reserve for vibration and errors. Therefore, each round computes the full answer
    of the best design, adjusts the bounds on quasi-static figures, and continues the search. The result is the last
    design with a full answer that meets all limits. If there is no such design, the result is the design of the last
    round.

    If there are no limits, there are no bounds to adjust. A single full answer is then computed if the figure to be
    optimized depends on the deflection. Otherwise no full answer is computed.
    """
    goal = design_measures(document.scene, output_of(document.scene)).get(task.figure)
    worth = bool(task.limits) or (goal is not None and not goal.figure.rigid)
    kept, now = None, first
    before: list[tuple[float, float]] | None = None
    for left in reversed(range(MAX_ROUNDS)):
        if not now.best.feasible or not worth:
            break
        progress("full answer of the best design", MAX_ROUNDS - 1 - left, MAX_ROUNDS)
        chosen = zip((number.path for number in task.variables), now.best.values.tolist(), strict=True)
        scene = document.with_values(dict(chosen)).scene
        now = replace(now, answer=full_answer(scene, task.limits, [task.figure]))
        if all(each.outcome == judge.KEPT for each in now.judgements):
            kept = now
        if now.settled or not left:
            break
        columns = now.problem.figures_of(now.best.values[None]).columns
        known = [(float(columns[each.limit.figure][0]), each.worst) for each in now.judgements]
        each_before = before or (None,) * len(known)
        rows = zip(now.judgements, known, each_before, strict=True)
        # Keep an extra margin, because the error in the next design differs from the error in this design.
        spare = judge.SPARE * GROWTH ** max(0, MAX_ROUNDS - 3 - left)
        problem = now.problem.held_to(
            [judge.adjusted_bound(judged, value, other, spare) for judged, (value, _), other in rows]
        )
        before = known
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
