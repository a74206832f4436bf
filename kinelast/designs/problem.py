"""An optimization problem: the least of a figure, within bounds of numbers and limits of other figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from kinelast.designs.sensitivities import FiguresOf
from kinelast.scene.limits import Limit
from rigid.arrays import Reals

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
