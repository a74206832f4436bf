"""Problems that a scene's tables pose of its designs: sensitivities, tolerances, and an optimum within limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kinelast.designs.sensitivities import FiguresOf
from kinelast.designs.tolerances import Tolerance
from kinelast.figures.limits import limits_of_items
from kinelast.scene.document import Document
from kinelast.scene.error import fault, known_name
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import Limit, bounds, figure_bounds, tolerance
from kinelast.scene.tables import PER_LENGTH
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


@dataclass(frozen=True)
class Step:
    """Change of a number by which its sensitivities are told.

    Attributes
    ----------
    size
        In the SI unit of the number; 0 where there is none.
    kind
        `TOLERANCE`, `ABSOLUTE` or `PER_CENT`.
    """

    size: float
    kind: str


TOLERANCE, ABSOLUTE, PER_CENT = "tolerance", "absolute", "per cent"
LENGTHS = {"in": 0.01 * PER_LENGTH["in"]}  # by the file's unit of lengths, the largest step [m]; else a millimetre
PARTS = 10  # of a length, at least, that a step is one of


def steps_of(document: Document, variables: Sequence[Variable]) -> list[Step]:
    """Changes of numbers as a workshop would think of them: by tolerance, or by millimetre or degree, or by 1 %.

    A length that is less than ten of these changes by a tenth, a hundredth ... of a millimetre; of a coordinate the
    extent of the drawing counts.
    """
    table = document.table
    extent = max((abs(float(each)) for place in table.points.values() for each in place), default=0.0)
    return [_step(table, one, extent) for one in variables]


def _step(table: SceneTable, number: Variable, extent: float) -> Step:
    if number.path in table.tolerances:
        return Step(tolerance(table, number.path, table.tolerances[number.path])[1], TOLERANCE)
    if number.unit == "rad":
        return Step(math.radians(1.0), ABSOLUTE)
    size = max(abs(number.base), extent) if number.path.endswith((".x", ".y")) else abs(number.base)
    if number.unit == "m" and size:
        most = LENGTHS.get(table.units, 1e-3)
        tenths = math.ceil(max(0.0, math.log10(PARTS * most / size)) - 1e-9)
        return Step(most * 10.0**-tenths, ABSOLUTE)
    return Step(abs(number.base) / 100, PER_CENT)


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
    limits = (*_own(limits_of_items(document.scene), units), *_limits(document.table, units))
    return OptimizationTask(
        variables, np.array(low), np.array(high),
        figure, asked.maximize is not None, limits, asked.method == "evolution", asked.seed,
    )  # fmt: skip


def _own(limits: Sequence[Limit], units: Mapping[str, str]) -> list[Limit]:
    """The limits of a scene, with the units of their figures.

    Raises
    ------
    SceneError
        There is no figure for one of them.
    """
    for limit in limits:
        if limit.figure not in units:
            table = "limits.figures" if limit.named else f"limits.links.{limit.item}" if limit.item else "limits"
            kind = Limit(limit.figure.partition(".")[0], 0.0).kind
            raise fault(table, kind, f'it cannot be judged: the figure "{limit.figure}" is not known')
    return [replace(limit, unit=units[limit.figure]) for limit in limits]


def _each(kind: str, units: Mapping[str, str]) -> list[str]:
    """The figure of every beam, where there are such figures; else the one of all."""
    return [name for name in units if name.startswith(f"{kind}.")] or [kind]


def _limits(table: SceneTable, units: Mapping[str, str]) -> Sequence[Limit]:
    """The limits under [optimize.limits]."""
    limits = []
    for bound in figure_bounds(table, table.optimize.limits, "optimize.limits"):
        known_name(bound.table, f'"{bound.name}"', bound.name, units, "figure")
        within = bound.within(units[bound.name])
        limits += [Limit(each, within, bound.least) for each in _each(bound.name, units)]
    return limits


STEP = 2.0**-14  # of a variable's range, the largest of a gradient's differences
FAR = 10.0  # ratio of bounds
KEPT = 1e-7  # share of a limit that is left to it, so that whoever computes anew finds it kept


@dataclass(frozen=True, eq=False)
class Problem:
    """A figure to be made small, over variables that are counted from 0 to 1 between their bounds.

    Where both bounds are greater than zero and far apart, equal steps of that count are equal ratios.

    Attributes
    ----------
    figures_of
        From values of the variables, shape (designs, variables), to figures.
    low, high
        Bounds of the variables, shape (variables,).
    figure
        Which figure is to be least, or, where `largest` is true, largest.
    limits
        What other figures are held to.
    parts
        Names of figures of whose squares the one to be least is the sum, where it is such.
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
        """Figures that have to be known."""
        return tuple(dict.fromkeys([self.figure, *(limit.figure for limit in self.limits), *self.parts]))

    def values(self, shares: np.ndarray) -> np.ndarray:
        """Values of the variables from their shares of the way between the bounds."""
        shares = np.asarray(shares)
        ratio = np.where(self.by_ratio, self.high, 1.0) / np.where(self.by_ratio, self.low, 1.0)
        by_ratio = np.where(self.by_ratio, self.low, 1.0) * ratio**shares
        found = np.where(self.by_ratio, by_ratio, self.low + (self.high - self.low) * shares)
        return np.asarray(np.clip(found, self.low, self.high))

    def shares(self, values: np.ndarray) -> np.ndarray:
        """Shares of the way between the bounds, of values within them."""
        low, high, own = (np.where(self.by_ratio, each, 1.0) for each in (self.low, self.high, values))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.where(self.by_ratio, np.log(own / low) / np.log(high / low), (values - self.low) / self.span)
        return np.asarray(np.clip(found, 0.0, 1.0))

    def rate(self, values: np.ndarray) -> np.ndarray:
        """Change of the variables' values to that of their shares, shape (variables,)."""
        log = np.log(np.where(self.by_ratio, self.high, 1.0) / np.where(self.by_ratio, self.low, 1.0))
        return np.asarray(np.where(self.by_ratio, values * log, self.span))

    @property
    def span(self) -> np.ndarray:
        """How far the bounds are apart, shape (variables,)."""
        return np.asarray(self.high - self.low)

    @property
    def by_ratio(self) -> np.ndarray:
        """Which variables count by their ratio to the bounds, as these are far apart; shape (variables,)."""
        return np.asarray((self.low > 0) & (self.high >= FAR * self.low))

    def held_to(self, bounds: Sequence[float]) -> Problem:
        """The same with other bounds of its limits."""
        moved = zip(self.limits, bounds, strict=True)
        return replace(self, limits=tuple(replace(limit, bound=bound) for limit, bound in moved))

    def judged(self, shares: np.ndarray) -> Judged:
        """How good designs are, of shares of shape (designs, variables)."""
        self.counted.append(len(shares))
        return self.judged_by(self.figures_of(self.values(shares)).columns)

    def judged_by(self, columns: Mapping[str, np.ndarray]) -> Judged:
        """How good designs are that have some figures."""
        sign = -1.0 if self.largest else 1.0
        margins = [limit.margin(np.asarray(columns[limit.figure], float)) - KEPT for limit in self.limits]
        cost = sign * np.asarray(columns[self.figure], float)
        none = np.zeros((0, len(cost)))
        parts = [np.asarray(columns[name], float) for name in self.parts]
        return Judged(cost, np.stack(margins) if margins else none, np.stack(parts) if parts else none)


@dataclass(frozen=True)
class Judged:
    """How good designs are.

    Attributes
    ----------
    cost
        What is to be least, shape (designs,).
    margin
        What is left to each limit, as a share of it, shape (limits, designs).
    parts
        Of whose squares the cost is the sum, where it is one, shape (parts, designs).
    """

    cost: Reals
    margin: Reals
    parts: Reals

    @property
    def violation(self) -> np.ndarray:
        """Sum of the shares by which limits are not kept, shape (designs,); infinite where a figure is not known."""
        return violation(self.cost, self.margin)

    def order(self) -> np.ndarray:
        """Numbers of the designs from the best on: those that keep all limits by cost, then others by violation."""
        broken = self.violation
        return np.lexsort((np.where(broken > 0, 0.0, self.cost), broken))


@dataclass(frozen=True)
class Linear:
    """A design, and how cost, margins and parts change with the shares of its variables: slopes (..., variables)."""

    shares: Reals
    cost: float
    cost_slope: Reals
    margin: Reals
    margin_slope: Reals
    parts: Reals
    parts_slope: Reals

    @property
    def violation(self) -> float:
        """As of `Judged`."""
        return float(violation(np.array(self.cost), self.margin))


def violation(cost: np.ndarray, margin: np.ndarray) -> np.ndarray:
    """Sum of the shares by which limits are violated; less than half of the reserve `KEPT` is no violation."""
    whole = np.where(margin < -KEPT / 2, -margin, 0.0).sum(axis=0)
    return np.where(np.isfinite(margin).all(axis=0) & np.isfinite(cost), whole, np.inf)


def linearized(problem: Problem, several: Sequence[np.ndarray]) -> list[Linear]:
    """Designs with their gradients, from one call for all moved designs: four to a variable, of fourth order."""
    asked = [_moved(np.clip(shares, 0.0, 1.0)) for shares in several]
    found = problem.judged(np.concatenate([designs for _, designs in asked]))
    values = np.concatenate([found.cost[None], found.margin, found.parts])
    ends = np.cumsum([len(designs) for _, designs in asked])
    parts = zip(asked, np.split(values, ends[:-1], axis=1), strict=True)
    return [_linear(designs[0], offsets, each, len(problem.limits)) for (offsets, designs), each in parts]


def _moved(shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By how much variables are moved, (4, variables), and the designs: the one, and those that are moved."""
    offsets = _offsets(shares)
    moved = np.tile(shares, (*offsets.shape, 1))
    own = np.arange(len(shares))
    moved[:, own, own] += offsets
    return offsets, np.concatenate([shares[None], moved.reshape(-1, len(shares))])


def _linear(shares: np.ndarray, offsets: np.ndarray, values: np.ndarray, limits: int) -> Linear:
    """A design with its gradients, from cost, margins and parts of it and of moved ones, (1 + ..., designs)."""
    change = (values[:, 1:] - values[:, :1]).reshape(-1, *offsets.shape)
    own, slope = values[:, 0], (_weights(offsets) * change).sum(axis=1)
    end = 1 + limits
    return Linear(shares, float(own[0]), slope[0], own[1:end], slope[1:end], own[end:], slope[end:])


def _offsets(shares: np.ndarray) -> np.ndarray:
    """By how much variables are moved, to both sides or inwards; shape (4, variables)."""
    middle = np.array([-1.0, -0.5, 0.5, 1.0])[:, None] * STEP
    inward = np.array([0.5, 1.0, 1.5, 2.0])[:, None] * STEP
    free = (shares >= STEP) & (shares <= 1 - STEP)
    return np.where(free, middle, np.where(shares < 0.5, inward, -inward))


def _weights(offsets: np.ndarray) -> np.ndarray:
    """Weights of differences that make a slope exact for polynomials of degree four; shape (4, variables)."""
    powers = offsets.T[:, None, :] ** np.arange(1, len(offsets) + 1)[:, None]  # (variables, powers, offsets)
    one = np.eye(len(offsets))[:, :1]
    return np.asarray(np.linalg.solve(powers, np.broadcast_to(one, (len(powers), *one.shape)))[..., 0].T)
