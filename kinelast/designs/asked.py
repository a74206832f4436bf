"""Tables of a scene on its designs: sensitivities, tolerances, optimum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kinelast.designs.tolerances import Tolerance
from kinelast.scene.data import Scene
from kinelast.scene.document import Document
from kinelast.scene.error import fault, known_name
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import OUTPUT_ERROR, Limit, bounds, tolerance
from kinelast.scene.tables import PER_LENGTH, Amount, BoundTable
from kinelast.scene.units import Quantity
from kinelast.scene.variables import Variable
from rigid.arrays import Reals


@dataclass(frozen=True, eq=False)
class ToleranceTask:
    """Numbers of a scene with their tolerances."""

    variables: tuple[Variable, ...]
    tolerances: tuple[Tolerance, ...]


def tolerance_task(document: Document) -> ToleranceTask:
    """The tolerances of a scene.

    Raises
    ------
    SceneError
        There are none, or one is no number with a unit that fits, or not greater than zero.
    """
    asked = document.table.tolerances
    if not asked:
        raise fault("tolerances", "", 'the table is missing: name numbers, as in "links.crank.length" = "0.1 mm"')
    rows = [tolerance(document.table, path, given) for path, given in asked.items()]
    return ToleranceTask(
        tuple(number for number, *_ in rows), tuple(Tolerance(half, normal) for _, half, normal in rows)
    )


@dataclass(frozen=True, eq=False)
class OptimizationTask:
    """An optimization: variables with bounds, the figure to optimize, and limits of others."""

    variables: tuple[Variable, ...]
    low: Reals
    high: Reals
    figure: str
    largest: bool
    limits: tuple[Limit, ...]
    evolve: bool
    seed: int


def optimization_task(document: Document, units: Mapping[str, str]) -> OptimizationTask:
    """The optimization of a scene's [optimize]; its [limits] count too.

    Parameters
    ----------
    document
        The scene as it is written.
    units
        Of the figures that there are, by name.

    Raises
    ------
    SceneError
        The table is missing, or names what there is not, or bounds are the wrong way round.
    """
    asked = document.table.optimize
    if not asked.variables and asked.minimize is None and asked.maximize is None:
        raise fault("optimize", "", 'the table is missing: say what to minimize, as in minimize = "mass"')
    if (asked.minimize is None) == (asked.maximize is None):
        raise fault("optimize", "minimize", "expected one figure, to minimize or to maximize")
    figure = asked.minimize if asked.minimize is not None else asked.maximize
    assert figure is not None
    known_name("optimize", "minimize" if asked.maximize is None else "maximize", figure, units, "figure")
    if not asked.variables:
        raise fault(
            "optimize.variables", "", 'expected numbers with bounds, as in "sections.bar.depth" = ["3 mm", "9 mm"]'
        )
    rows = [bounds(document.table, path, *ends) for path, ends in asked.variables.items()]
    variables, low, high = zip(*rows, strict=True)
    limits = (*_own_limits(document.scene, units), *_limits(document.table, units))
    return OptimizationTask(
        variables, np.array(low), np.array(high),
        figure, asked.maximize is not None, limits, asked.method == "evolution", asked.seed,
    )  # fmt: skip


def _own_limits(scene: Scene, units: Mapping[str, str]) -> list[Limit]:
    """The limits of a scene, for every beam apart: a limit of the largest of several would have more kinks.

    Raises
    ------
    SceneError
        There is no figure for one of them.
    """
    limits = []
    for limit in scene.limits:
        labels = [scene.labels[beam] for beam in limit.beams(scene.mechanism)]
        names = [OUTPUT_ERROR] if limit.figure == OUTPUT_ERROR else [f"{limit.figure}.{label}" for label in labels]
        for name in names or [limit.figure]:
            if name not in units:
                table = f"limits.links.{limit.link}" if limit.link else "limits"
                raise fault(table, limit.kind, f'it cannot be judged: the figure "{name}" is not known')
            limits.append(replace(limit, figure=name, unit=units[name]))
    return limits


def _each(kind: str, units: Mapping[str, str]) -> list[str]:
    """The figure of every beam, where there are such figures; else the one of all."""
    return [name for name in units if name.startswith(f"{kind}.")] or [kind]


def _limits(table: SceneTable, units: Mapping[str, str]) -> Sequence[Limit]:
    """The limits under [optimize.limits]."""
    limits = []
    for name, given in table.optimize.limits.items():
        known_name("optimize.limits", f'"{name}"', name, units, "figure")
        bound = given if isinstance(given, BoundTable) else BoundTable(most=given)
        if bound.most is None and bound.least is None:
            raise fault("optimize.limits", f'"{name}"', 'expected a bound, as in { most = "1 mm" } or { least = 2 }')
        for value, least in ((bound.most, False), (bound.least, True)):
            if value is not None:
                bound_ = _bound(value, units[name], name, PER_LENGTH[table.units])
                limits += [Limit(each, bound_, least) for each in _each(name, units)]
    return limits


def _bound(given: Amount, unit: str, name: str, per_length: float) -> float:
    """A bound of a figure in its SI unit; a bare length is in the file's."""
    try:
        return Quantity.of_unit(unit, given, per_length)
    except ValueError as error:
        raise fault("optimize.limits", f'"{name}"', str(error)) from None
