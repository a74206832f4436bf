"""Linearization of an optimization problem: cost, margins and their derivatives at a design."""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from kinelast.designs.problem import DesignProblem, violation
from rigid.arrays import Reals

# Largest offset of a scaled variable (0 to 1) in difference quotients; near a bound, the largest offset is twice this.
GRADIENT_STEP = 2.0**-14


class Linear(Struct, frozen=True):
    """Linearisation of a problem at one design.

    Attributes
    ----------
    shares
        Scaled variables of the design, shape (variables,).
    cost, margin, parts
        Values for one design, see `Judged`. The axis of designs is left out.
    cost_slope, margin_slope, parts_slope
        Derivatives with respect to the scaled variables, shape (..., variables).
    """

    shares: Reals
    cost: float
    cost_slope: Reals
    margin: Reals
    margin_slope: Reals
    parts: Reals
    parts_slope: Reals

    @property
    def violation(self) -> float:
        """Sum of the relative violations of all limits; inf if the cost or a margin is unknown."""
        return float(violation(np.array(self.cost), self.margin))


def linearized(problem: DesignProblem, several: Sequence[np.ndarray]) -> list[Linear]:
    """Linearise a problem at several designs with a single evaluation.

    Each derivative is a difference quotient of fourth order, computed from four displaced designs.
    """
    pairs = [_displaced(np.clip(shares, 0.0, 1.0)) for shares in several]
    found = problem.judged(np.concatenate([designs for _, designs in pairs]))
    values = np.concatenate([found.cost[None], found.margin, found.parts])
    ends = np.cumsum([len(designs) for _, designs in pairs])
    parts = zip(pairs, np.split(values, ends[:-1], axis=1), strict=True)
    return [_linear(designs[0], offsets, each, len(problem.limits)) for (offsets, designs), each in parts]


def _displaced(shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets of the variables, shape (4, variables), and the original design with all displaced designs.

    The designs have the shape (1 + 4 * variables, variables). The original design comes first.
    """
    offsets = _offsets(shares)
    moved = np.tile(shares, (*offsets.shape, 1))
    own = np.arange(len(shares))
    moved[:, own, own] += offsets
    return offsets, np.concatenate([shares[None], moved.reshape(-1, len(shares))])


def _linear(shares: np.ndarray, offsets: np.ndarray, values: np.ndarray, limits: int) -> Linear:
    """Linearise a problem at one design from the values of this design and of displaced designs.

    Parameters
    ----------
    offsets
        Offsets of the variables in the displaced designs, shape (4, variables).
    values
        Cost, margins and parts (first axis) of the original design and of the displaced designs (second axis).
    limits
        Number of limits.
    """
    change = (values[:, 1:] - values[:, :1]).reshape(-1, *offsets.shape)
    own, slope = values[:, 0], (_weights(offsets) * change).sum(axis=1)
    end = 1 + limits
    return Linear(shares, float(own[0]), slope[0], own[1:end], slope[1:end], own[end:], slope[end:])


def _offsets(shares: np.ndarray) -> np.ndarray:
    """Return four offsets for each variable, shape (4, variables).

    Two offsets are negative, and two offsets are positive. Near a bound of the variable, all four offsets point away
    from the bound.
    """
    middle = np.array([-1.0, -0.5, 0.5, 1.0])[:, None] * GRADIENT_STEP
    inward = np.array([0.5, 1.0, 1.5, 2.0])[:, None] * GRADIENT_STEP
    free = (shares >= GRADIENT_STEP) & (shares <= 1 - GRADIENT_STEP)
    return np.where(free, middle, np.where(shares < 0.5, inward, -inward))


def _weights(offsets: np.ndarray) -> np.ndarray:
    """Return the weights of difference quotients, shape (4, variables).

    The difference quotients are exact for polynomials of degree four.
    """
    powers = offsets.T[:, None, :] ** np.arange(1, len(offsets) + 1)[:, None]  # (variables, powers, offsets)
    one = np.eye(len(offsets))[:, :1]
    return np.asarray(np.linalg.solve(powers, np.broadcast_to(one, (len(powers), *one.shape)))[..., 0].T)
