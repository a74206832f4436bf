"""Studies of a scene (a mechanism with its motion): sensitivities and tolerances.

A study varies input values of the scene and computes results, called figures, e.g. the largest stress. Most figures are
computed by quasi-statics, i.e. without vibration. A full answer contains the figures of one design, computed by the
theory that the scene names, with errors.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from kinelast.designs import tolerances
from kinelast.designs.evaluate import Designs, batched_figures, evaluate
from kinelast.designs.full_sample import FullColumn, full_columns
from kinelast.designs.problem import tolerance_task
from kinelast.designs.sensitivities import Sensitivities, sensitivities
from kinelast.designs.tolerances import DESIGNS, ToleranceResult
from kinelast.reports.full_answer import FullAnswer, full_answer
from kinelast.reports.limits import LIMITS_KEPT, LIMITS_MARGIN, limits_of_items
from kinelast.scene.data import scene_motion
from kinelast.scene.document import Document, Tables, document_of
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import sets_limit
from kinelast.scene.variables import Variable, numbers
from kinelast.tasks.progress import SILENT, Progress
from kinelast.values.error import fault
from kinelast.values.figure import Figure

# These tables of a scene do not describe the machine. By default, a sensitivity study does not vary their input values.
NOT_NUMBERS = ("run", "limits", "sensitivities", "tolerances", "optimize", "sweep")
NOT_FIGURES = ("reach", LIMITS_KEPT, LIMITS_MARGIN, "condition")  # no meaningful derivatives


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
    figures_of = batched_figures(document, paths, chosen, progress, "sensitivities")
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
    limits = limits_of_items(built)
    full, bounded = full_answer(built, limits, known), list(dict.fromkeys(limit.figure for limit in limits))
    seen: list[Mapping[str, Any]] = []
    complete: dict[str, FullColumn] = {}
    with np.errstate(all="ignore"):
        nominal = sensitivities(batched_figures(document, paths, figures), at, _scale(table, task.variables))
        more = [name for name in bounded if name not in known]
        figures_of = batched_figures(document, paths, [*figures, *more], progress, "designs within tolerances")

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
            batched_figures(document, paths, figures, progress, "shares"), task.tolerances, at
        )
    units = {**base.units, **{figure.key: str(figure.unit) for figure in accuracy if isinstance(figure, Figure)}}
    linear, count = (
        tolerances.first_order(nominal, task.tolerances),
        tolerances.REPEATS * tolerances.points_for(designs),
    )
    share = tolerances.kept_share(seen[0], full.judgements, complete, tolerances.WHOLE) if limits else None
    return ToleranceResult(task.variables, task.tolerances, nominal, linear, sampled, shares, units, count, full, share)
