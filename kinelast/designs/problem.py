"""What is to be found: the design whose one figure is least, within bounds of its numbers and limits of its figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from kinelast.designs.sensitivities import FiguresOf

STEP = 2.0**-9  # of a variable's range, the largest of a gradient's differences
KEPT = 1e-7  # share of a limit that is left to it, so that whoever computes anew finds it kept


@dataclass(frozen=True)
class Limit:
    """A bound of a figure: `most` that it may be, or, where `least` is true, the least."""

    figure: str
    bound: float
    least: bool = False

    def margin(self, value: np.ndarray) -> np.ndarray:
        """What is left to the limit, as a share of it; negative where it is not kept."""
        left = (value - self.bound if self.least else self.bound - value) / (abs(self.bound) or 1.0)
        return np.asarray(left)


@dataclass(frozen=True, eq=False)
class Problem:
    """A figure to be made small, over variables that are counted from 0 to 1 between their bounds.

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
    """

    figures_of: FiguresOf
    low: np.ndarray
    high: np.ndarray
    figure: str
    largest: bool = False
    limits: tuple[Limit, ...] = ()
    counted: list[int] = field(default_factory=list, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Figures that have to be known."""
        return tuple(dict.fromkeys([self.figure, *(limit.figure for limit in self.limits)]))

    def values(self, shares: np.ndarray) -> np.ndarray:
        """Values of the variables from their shares of the way between the bounds."""
        return np.clip(self.low + (self.high - self.low) * np.asarray(shares), self.low, self.high)

    def judged(self, shares: np.ndarray) -> Judged:
        """How good designs are, of shares of shape (designs, variables)."""
        self.counted.append(len(shares))
        return self.judged_by(self.figures_of(self.values(shares)).columns)

    def judged_by(self, columns: Mapping[str, np.ndarray]) -> Judged:
        """How good designs are that have some figures."""
        sign = -1.0 if self.largest else 1.0
        margins = [limit.margin(np.asarray(columns[limit.figure], float)) - KEPT for limit in self.limits]
        cost = sign * np.asarray(columns[self.figure], float)
        return Judged(cost, np.stack(margins) if margins else np.zeros((0, len(cost))))


@dataclass(frozen=True)
class Judged:
    """How good designs are.

    Attributes
    ----------
    cost
        What is to be least, shape (designs,).
    margin
        What is left to each limit, as a share of it, shape (limits, designs).
    """

    cost: np.ndarray
    margin: np.ndarray

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
    """A design, and how cost and margins change with the shares of its variables."""

    shares: np.ndarray
    cost: float
    cost_slope: np.ndarray
    margin: np.ndarray
    margin_slope: np.ndarray

    @property
    def violation(self) -> float:
        """As of `Judged`."""
        return float(violation(np.array(self.cost), self.margin))


def violation(cost: np.ndarray, margin: np.ndarray) -> np.ndarray:
    """Sum of the shares by which limits are not kept; half of what is held back does not count, nor does round-off."""
    whole = np.where(margin < -KEPT / 2, -margin, 0.0).sum(axis=0)
    return np.where(np.isfinite(margin).all(axis=0) & np.isfinite(cost), whole, np.inf)


def linearized(problem: Problem, shares: np.ndarray) -> Linear:
    """A design with its gradients, from one call for all moved designs: four to a variable, of fourth order."""
    shares = np.clip(shares, 0.0, 1.0)
    offsets = _offsets(shares)
    moved = np.repeat(shares[None], offsets.size, axis=0).reshape(*offsets.shape, -1)
    own = np.arange(len(shares))
    moved[:, own, own] += offsets
    found = problem.judged(np.concatenate([shares[None], moved.reshape(-1, len(shares))]))
    weights = _weights(offsets)
    cost = (weights * (found.cost[1:] - found.cost[0]).reshape(offsets.shape)).sum(axis=0)
    change = (found.margin[:, 1:] - found.margin[:, :1]).reshape(-1, *offsets.shape)
    return Linear(shares, float(found.cost[0]), cost, found.margin[:, 0], (weights * change).sum(axis=1))


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
