"""Tasks for studies, read from the tables of a scene: sensitivities, tolerances, and optimization within limits.

Studies vary input values, called variables, and compute results, called figures, e.g. the largest stress.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.designs.sensitivities import FiguresOf
from kinelast.designs.tolerances import Tolerance
from kinelast.figures.registry import figures_of
from kinelast.reports.limits import Judgement, elastic_limits, limits_of_items
from kinelast.scene.document import Document
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import bounds, figure_bounds, tolerance
from kinelast.scene.tables import PER_LENGTH
from kinelast.scene.variables import Variable
from kinelast.values.error import fault, known_name
from kinelast.values.figure import Limit
from rigid.arrays import Reals

SPARE = 1e-4  # extra margin relative to the limit, because the error changes with the design


class ToleranceTask(Struct, frozen=True, eq=False):
    """Input values of a scene that have tolerances, and these tolerances."""

    variables: tuple[Variable, ...]
    tolerances: tuple[Tolerance, ...]


def tolerance_task(document: Document) -> ToleranceTask:
    """Read the tolerances of a scene.

    Raises
    ------
    SceneError
        There are no tolerances, or a tolerance is not a positive number with a suitable unit.
    """
    entries = document.table.tolerances
    if not entries:
        raise fault("tolerances", "", 'the table is missing: give tolerances, as in "links.crank.length" = "0.1 mm"')
    rows = [tolerance(document.table, path, given) for path, given in entries.items()]
    return ToleranceTask(
        tuple(number for number, *_ in rows), tuple(Tolerance(half, normal) for _, half, normal in rows)
    )


class SensitivityStep(Struct, frozen=True):
    """Assumed change in an input value, for which a sensitivity study reports the change in the results.

    Attributes
    ----------
    size
        Size of the change in the SI unit of the input value; 0 if the change is 1 % of an input value that is 0.
    kind
        `TOLERANCE` for a tolerance, `ABSOLUTE` for a length or an angle, `PER_CENT` for 1 % of the input value.
    """

    size: float
    kind: str


TOLERANCE, ABSOLUTE, PER_CENT = "tolerance", "absolute", "per cent"
# [m] Maps the length unit of a file to the largest change of a length. For other units, the largest change is 1 mm.
MAX_STEP_LENGTHS = {"in": 0.01 * PER_LENGTH["in"]}
MIN_STEPS = 10  # minimum of (length) / (change of this length)


def steps_of(document: Document, variables: Sequence[Variable]) -> list[SensitivityStep]:
    """Return the change in each input value that a sensitivity study assumes, see `SensitivityStep`.

    If an input value has a tolerance, the change is the tolerance. Otherwise the change is 1 degree for an angle, 1 mm
    for a length (0.01 in if the file uses inches), and 1 % for other input values.

    The change of a length is at most a tenth of the length. For short lengths, the change is therefore 0.1 mm, 0.01 mm,
    and so on, instead of 1 mm. For a coordinate of a point, the length is the coordinate or the largest coordinate in
    [points], whichever is larger.
    """
    table = document.table
    extent = max((abs(float(each)) for place in table.points.values() for each in place), default=0.0)
    return [_step(table, one, extent) for one in variables]


def _step(table: SceneTable, number: Variable, extent: float) -> SensitivityStep:
    if number.path in table.tolerances:
        return SensitivityStep(tolerance(table, number.path, table.tolerances[number.path])[1], TOLERANCE)
    if number.unit == "rad":
        return SensitivityStep(math.radians(1.0), ABSOLUTE)
    size = max(abs(number.base), extent) if number.path.endswith((".x", ".y")) else abs(number.base)
    if number.unit == "m" and size:
        most = MAX_STEP_LENGTHS.get(table.units, 1e-3)
        tenths = math.ceil(max(0.0, math.log10(MIN_STEPS * most / size)) - 1e-9)
        return SensitivityStep(most * 10.0**-tenths, ABSOLUTE)
    return SensitivityStep(abs(number.base) / 100, PER_CENT)


class OptimizationTask(Struct, frozen=True, eq=False):
    """An optimization task, read from [optimize] and [limits].

    Attributes
    ----------
    variables, low, high
        Input values to be varied, and their bounds in SI units, shape (variables,).
    figure, largest
        Name of the figure (result) to be minimised, or maximised if `largest`.
    limits
        Limits on figures.
    evolve
        True if the search uses differential evolution.
    seed
        Seed of the random generator.
    """

    variables: tuple[Variable, ...]
    low: Reals
    high: Reals
    figure: str
    largest: bool
    limits: tuple[Limit, ...]
    evolve: bool
    seed: int


def optimization_task(document: Document, units: Mapping[str, str]) -> OptimizationTask:
    """Read the optimization task of a scene, which includes [limits].

    Parameters
    ----------
    document
        Document of the scene.
    units
        Units of all known figures, by name.

    Raises
    ------
    SceneError
        The table [optimize] is missing, an input value or figure does not exist, or a lower bound is not below the
        upper bound.
    """
    goal = document.table.optimize
    if not goal.variables and goal.minimize is None and goal.maximize is None:
        raise fault("optimize", "", 'the table is missing: give a goal, as in minimize = "mass"')
    if (goal.minimize is None) == (goal.maximize is None):
        raise fault("optimize", "minimize", "expected exactly one of minimize and maximize")
    figure = goal.minimize if goal.minimize is not None else goal.maximize
    assert figure is not None
    known_name("optimize", "minimize" if goal.maximize is None else "maximize", figure, units, "figure")
    if not goal.variables:
        raise fault(
            "optimize.variables", "", 'expected numbers with bounds, as in "sections.bar.depth" = ["3 mm", "9 mm"]'
        )
    rows = [bounds(document.table, path, *ends) for path, ends in goal.variables.items()]
    variables, low, high = zip(*rows, strict=True)
    within = [*limits_of_items(document.scene), *elastic_limits(document.scene)]
    limits = (*_scene_limits(within, units), *_limits(document, units))
    return OptimizationTask(
        variables, np.array(low), np.array(high),
        figure, goal.maximize is not None, limits, goal.method == "evolution", goal.seed,
    )  # fmt: skip


def _scene_limits(limits: Sequence[Limit], units: Mapping[str, str]) -> list[Limit]:
    """Return copies of limits, in which each limit has the unit of the limited figure.

    Raises
    ------
    SceneError
        A limited figure is unknown.
    """
    for limit in limits:
        if limit.figure not in units:
            table = "limits.figures" if limit.named else f"limits.links.{limit.item}" if limit.item else "limits"
            kind = Limit(limit.figure.partition(".")[0], 0.0).kind
            raise fault(table, kind, f'the limit cannot be judged: the figure "{limit.figure}" is not known')
    return [replace(limit, unit=units[limit.figure]) for limit in limits]


def _limits(document: Document, units: Mapping[str, str]) -> Sequence[Limit]:
    """Return the limits in the table [optimize.limits]."""
    over = {figure.key: figure.over for figure in figures_of(document.scene.output)}
    limits = []
    for bound in figure_bounds(document.table, document.table.optimize.limits, "optimize.limits"):
        known_name(bound.table, f'"{bound.name}"', bound.name, units, "figure")
        of_items = [name for name in units if name.startswith(f"{bound.name}.")] or [bound.name]
        for value, least in bound.within(units[bound.name], over.get(bound.name.partition(".")[0], "")):
            limits += [Limit(each, value, least) for each in of_items]
    return limits


MIN_RATIO = 10.0  # the scale of a variable is logarithmic if 0 < MIN_RATIO * (lower bound) <= (upper bound)
RESERVE = 1e-7  # designs keep this relative margin to each limit, so that round-off does not cause a violation


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """Minimisation of a figure (result) by choosing the values of variables (input values) between bounds.

    Searches use scaled variables ("shares"), which go from 0 at the lower bound to 1 at the upper bound. The scale is
    logarithmic if the lower bound is positive and (upper bound) / (lower bound) is at least `MIN_RATIO`.

    Attributes
    ----------
    figures_of
        Function that returns the figures of designs. The argument contains the values of the variables, shape
        (designs, variables).
    low, high
        Bounds of the variables, shape (variables,).
    figure
        Name of the figure to be minimised, or maximised if `largest`.
    limits
        Limits on figures.
    parts
        If `figure` is a sum of squares: names of the figures that are squared; otherwise empty.
    counted
        Number of designs in each batch evaluated so far.
    """

    figures_of: FiguresOf
    low: Reals
    high: Reals
    figure: str
    largest: bool = False
    limits: tuple[Limit, ...] = ()
    parts: tuple[str, ...] = ()
    counted: list[int] = field(default_factory=list, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the figures that must be computed."""
        return tuple(dict.fromkeys([self.figure, *(limit.figure for limit in self.limits), *self.parts]))

    def values(self, shares: np.ndarray) -> np.ndarray:
        """Convert scaled variables to values of the variables."""
        shares = np.asarray(shares)
        ratio = np.where(self.by_ratio, self.high, 1.0) / np.where(self.by_ratio, self.low, 1.0)
        by_ratio = np.where(self.by_ratio, self.low, 1.0) * ratio**shares
        found = np.where(self.by_ratio, by_ratio, self.low + (self.high - self.low) * shares)
        return np.asarray(np.clip(found, self.low, self.high))

    def shares(self, values: np.ndarray) -> np.ndarray:
        """Convert values of the variables to scaled variables."""
        low, high, own = (np.where(self.by_ratio, each, 1.0) for each in (self.low, self.high, values))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.where(self.by_ratio, np.log(own / low) / np.log(high / low), (values - self.low) / self.span)
        return np.asarray(np.clip(found, 0.0, 1.0))

    def rate(self, values: np.ndarray) -> np.ndarray:
        """Return the derivatives of the values with respect to the scaled variables, shape (variables,)."""
        log = np.log(np.where(self.by_ratio, self.high, 1.0) / np.where(self.by_ratio, self.low, 1.0))
        return np.asarray(np.where(self.by_ratio, values * log, self.span))

    @property
    def span(self) -> np.ndarray:
        """Differences between the upper and lower bounds of the variables, shape (variables,)."""
        return np.asarray(self.high - self.low)

    @property
    def by_ratio(self) -> np.ndarray:
        """True for each variable with a logarithmic scale, shape (variables,)."""
        return np.asarray((self.low > 0) & (self.high >= MIN_RATIO * self.low))

    def held_to(self, bounds: Sequence[float]) -> DesignProblem:
        """Return a copy of the problem, in which `bounds` replace the bounds of the limits."""
        moved = zip(self.limits, bounds, strict=True)
        return dataclasses.replace(self, limits=tuple(replace(limit, bound=bound) for limit, bound in moved))

    def judged(self, shares: np.ndarray) -> Judged:
        """Return the cost and margins of designs with the scaled variables `shares`, shape (designs, variables)."""
        self.counted.append(len(shares))
        return self.judged_by(self.figures_of(self.values(shares)).columns)

    def judged_by(self, columns: Mapping[str, np.ndarray]) -> Judged:
        """Return the cost and margins of designs. `columns` contains the figures of these designs."""
        sign = -1.0 if self.largest else 1.0
        margins = [limit.margin(np.asarray(columns[limit.figure], float)) - RESERVE for limit in self.limits]
        cost = sign * np.asarray(columns[self.figure], float)
        none = np.zeros((0, len(cost)))
        parts = [np.asarray(columns[name], float) for name in self.parts]
        return Judged(cost, np.stack(margins) if margins else none, np.stack(parts) if parts else none)


class Judged(Struct, frozen=True):
    """Cost and margins of designs.

    Attributes
    ----------
    cost
        Value to be minimised, shape (designs,).
    margin
        Relative margin to each limit minus `RESERVE`, shape (limits, designs).
    parts
        Figures, shape (parts, designs). The cost is the sum of the squares of these figures. If the cost is not a sum
        of squares, the shape is (0, designs).
    """

    cost: Reals
    margin: Reals
    parts: Reals

    @property
    def violation(self) -> np.ndarray:
        """Sum of the relative violations of all limits, shape (designs,); inf if the cost or a margin is unknown."""
        return violation(self.cost, self.margin)

    def order(self) -> np.ndarray:
        """Return the indices of the designs, best first.

        Feasible designs, sorted by cost, are followed by infeasible designs, sorted by violation.
        """
        broken = self.violation
        return np.lexsort((np.where(broken > 0, 0.0, self.cost), broken))


def violation(cost: np.ndarray, margin: np.ndarray) -> np.ndarray:
    """Return the sum of relative limit violations. Violations below half of `RESERVE` are ignored."""
    whole = np.where(margin < -RESERVE / 2, -margin, 0.0).sum(axis=0)
    return np.where(np.isfinite(margin).all(axis=0) & np.isfinite(cost), whole, np.inf)


def adjusted_bound(judged: Judgement, known: Sequence[tuple[float, float]], spare: float = SPARE) -> float:
    """Return a bound on the quasi-static figure that replaces the limit on the figure by the chosen theory.

    If the quasi-static figure of a design equals this bound, the figure by the chosen theory, with its error, should
    just meet the limit. Near the critical load, for example, it grows much faster than the quasi-static figure.
    Therefore, it is assumed to be a power of the quasi-static figure, through the judged design and the last earlier
    design on the other side of the limit. Without such a design, the power is through the last two designs. If the
    figure by the chosen theory did not grow with the quasi-static figure, both are assumed to be proportional.

    Parameters
    ----------
    known
        Quasi-static figure and `Judgement.worst` of the designs so far. The last one is the judged design.
    spare
        Extra margin to the limit, relative to the limit.
    """
    bound = float(judged.limit.bound)
    target = bound + (1 if judged.limit.least else -1) * spare * abs(bound)
    (value, worst), *earlier = reversed(known)
    if not math.isfinite(worst) or not math.isfinite(value):
        return bound
    if not value * worst > 0.0 or not worst * target > 0.0:
        return value + target - worst
    rising = [one for one in earlier if (worst - one[1]) * (value - one[0]) > 0.0 and one[0] * value > 0.0]
    across = [one for one in rising if (worst - target) * (one[1] - target) < 0.0 and one[1] * worst > 0.0]
    power = 1.0
    for other_value, other_worst in (across or [one for one in rising if one[1] * worst > 0.0])[:1]:
        power = math.log(value / other_value) / math.log(worst / other_worst)
    return float(value * (target / worst) ** power)
