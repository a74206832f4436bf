"""Sensitivities: how every figure changes with every number of a design, by differences extrapolated to no step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rigid.arrays import Flags, Reals

RATIO = 2.0  # of one step to the next
FIRST, LEVELS = 4, 18  # steps from 2^-4 of a number's scale down to 2^-21
DEPTH = 6  # extrapolations: what is left of the truncation goes with the product of so many squares of steps
QUIET = 3  # extrapolations after which neighbouring steps differ by round-off alone, where they are small
CERTAIN = 4.0  # times the noise that is seen: few differences show it


@dataclass(frozen=True)
class Extrapolation:
    """A derivative as the limit of differences.

    Attributes
    ----------
    value
        Shape (...); nan where no step serves.
    error
        Estimate of its error, truncation and round-off together; shape (...).
    """

    value: Reals
    error: Reals


def steps(scale: np.ndarray) -> np.ndarray:
    """Steps of variables, from large to small.

    Parameters
    ----------
    scale
        How large each variable is, shape (variables,).

    Returns
    -------
    Shape (levels, variables).
    """
    return np.asarray(np.multiply.outer(RATIO ** -np.arange(FIRST, FIRST + LEVELS, dtype=float), scale))


def limit(quotients: np.ndarray, noise: np.ndarray, order: int) -> Extrapolation:
    """The limit of difference quotients with steps that shrink by `RATIO`, by Richardson's extrapolation.

    Of all extrapolations the one is taken whose estimated error is least: truncation, by how far it is from those that
    it is made of (Ridders), and round-off, by the noise of the values or by how far neighbours differ at small steps,
    whichever is more.

    Parameters
    ----------
    quotients
        Shape (levels, ...), large steps first; nan where a step does not serve.
    noise
        What round-off of the values makes of the error of every quotient, shape (levels, ...).
    order
        Of the powers of the step in the quotients' error: 2 for central differences, 1 for one-sided.

    References
    ----------
    Ridders, Advances in Engineering Software 4 (1982), p. 75; Press et al., Numerical Recipes, section 5.7.
    """
    best = Extrapolation(np.full(quotients.shape[1:], np.nan), np.full(quotients.shape[1:], np.inf))
    tables = [(quotients, noise, np.full_like(quotients, np.inf))]
    for depth in range(1, DEPTH + 1):
        weight = RATIO ** (order * depth) - 1
        value, rough, _ = tables[-1]
        finer = value[1:] + np.diff(value, axis=0) / weight
        rounded = rough[1:] + (rough[1:] + rough[:-1]) / weight
        truncated = np.maximum(abs(finer - value[1:]), abs(finer - value[:-1]))
        tables.append((finer, rounded, truncated))
    seen = _seen_noise(*tables[QUIET][:2])
    for value, rounded, truncated in tables[1:]:
        error = truncated + rounded * seen
        error = np.where(np.isfinite(error), error, np.inf)
        at = error.argmin(axis=0)[None]
        found, least = (np.take_along_axis(each, at, axis=0)[0] for each in (value, error))
        better = least < best.error
        best = Extrapolation(np.where(better, found, best.value), np.where(better, least, best.error))
    return Extrapolation(best.value, np.where(np.isnan(best.value), np.nan, best.error))


def _seen_noise(value: np.ndarray, rounded: np.ndarray) -> np.ndarray:
    """How many times more than assumed the values are off by round-off, at least 1; shape (...).

    Seen in the differences of neighbours at small steps, where truncation is nothing beside it.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        jumps = abs(np.diff(value, axis=0)) / (rounded[1:] + rounded[:-1])
    known = np.isfinite(jumps)
    last = known & (known[::-1].cumsum(axis=0)[::-1] <= 5)  # of the five smallest steps
    return np.asarray(np.maximum(1.0, CERTAIN * np.where(last, jumps, 0.0).max(axis=0, initial=0.0)))


ROUND_OFF = 4 * np.finfo(float).eps  # relative, of a figure that is computed as well as can be
APART = 3.0  # times their errors that the slopes to both sides differ by at a kink
BEND = 1e-6  # of a slope: what differs by less is no kink to speak of


class Figures(Protocol):
    """Figures of many designs."""

    @property
    def columns(self) -> Mapping[str, np.ndarray]:
        """Of every figure by name, shape (designs,); nan where a design has none."""

    @property
    def place(self) -> Mapping[str, np.ndarray]:
        """Where the largest value of a figure is, as a whole number, shape (designs,); of some figures only."""


FiguresOf = Callable[[np.ndarray], Figures]


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of figures to variables.

    All arrays but `at` and `scale` have the shape (figures, variables) unless said otherwise.

    Attributes
    ----------
    figures
        Names of the figures.
    at
        The variables' values, shape (variables,).
    figure
        The figures' values, shape (figures,).
    slope, error
        Derivative, and the estimate of its error. At a kink the mean of both sides; at the end of a range that of the
        one side there is; nan where there is none.
    below, above
        Derivatives to either side.
    kink
        The slopes to both sides differ: what is largest is so in two places at once, or a magnitude is zero.
    still
        Largest relative change of the variable, to both sides, that was tried and leaves what is largest where it is;
        0 at a kink. Beyond it the figure may follow another link or position.
    """

    figures: tuple[str, ...]
    at: Reals
    figure: Reals
    slope: Reals
    error: Reals
    below: Reals
    above: Reals
    kink: Flags
    still: Reals

    @property
    def logarithmic(self) -> np.ndarray:
        """Per cent of the figure to one per cent of the variable, shape (figures, variables)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.slope * self.at / self.figure[:, None])


def sensitivities(figures_of: FiguresOf, at: np.ndarray, scale: np.ndarray | None = None) -> Sensitivities:
    """Derivatives of all figures to all variables.

    Parameters
    ----------
    figures_of
        From values of the variables, shape (designs, variables), to figures; called once.
    at
        Where, shape (variables,).
    scale
        How large each variable is, shape (variables,): the largest step is a 16th of it. By default its value, or 1
        where that is 0.

    Raises
    ------
    ValueError
        A scale is not greater than zero.
    """
    at = np.asarray(at, float)
    scale = np.where(at == 0, 1.0, abs(at)) if scale is None else np.asarray(scale, float)
    if not (scale > 0).all():
        raise ValueError(f"scales have to be greater than zero, got {scale.min()}")
    moved = _moved(at, steps(scale))
    computed = figures_of(np.concatenate([at[None], moved.reshape(-1, len(at))]))
    names = tuple(computed.columns)
    shape = (len(names), *moved.shape[:3])
    values = np.stack([np.asarray(computed.columns[name], float) for name in names])
    places = np.stack([np.asarray(computed.place.get(name, np.zeros(values.shape[1])), float) for name in names])
    move = np.diagonal(moved - at, axis1=2, axis2=3)  # as rounded, so that round-off of the step does no harm
    found_at = _Tried(values[:, 0], values[:, 1:].reshape(shape), places[:, 0], places[:, 1:].reshape(shape), move)
    watched = np.array([name in computed.place for name in names])
    return _gathered(names, at, found_at, np.where(watched[:, None], _still(found_at, scale), np.nan))


def _moved(at: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Designs with one variable moved, shape (sides, levels, variables moved, variables)."""
    levels, count = step.shape
    moved = np.broadcast_to(at, (2, levels, count, count)).copy()
    own = np.arange(count)
    moved[0][:, own, own] -= step
    moved[1][:, own, own] += step
    return moved


@dataclass(frozen=True)
class _Tried:
    """Figures and their places of one design, (figures,), and of moved ones, (figures, sides, levels, variables)."""

    own: Reals
    value: Reals
    own_place: Reals
    place: Reals
    move: Reals  # (sides, levels, variables)

    @property
    def smooth(self) -> np.ndarray:
        """Whether a figure's place is the same at a moved design and at all that are moved less to that side."""
        same = (self.place == self.place[:, :, -1:]) & np.isfinite(self.value)
        return np.asarray(np.logical_and.accumulate(same[:, :, ::-1], axis=2)[:, :, ::-1])

    @property
    def unmoved(self) -> np.ndarray:
        """Whether a figure's place is the same at the least moved design and unmoved; (figures, sides, variables)."""
        return np.asarray(self.place[:, :, -1] == self.own_place[:, None, None])


def _still(tried: _Tried, scale: np.ndarray) -> np.ndarray:
    """Largest relative change tried, to both sides, that leaves a figure in its place; (figures, variables)."""
    way = np.where(tried.smooth & tried.unmoved[:, :, None], abs(tried.move) / scale, 0.0)
    return np.asarray(way.max(axis=2).min(axis=1))


@dataclass(frozen=True)
class _Slopes:
    """Derivatives by central, backward and forward differences; (figures, variables)."""

    middle: Extrapolation
    below: Extrapolation
    above: Extrapolation


def _gathered(names: tuple[str, ...], at: np.ndarray, tried: _Tried, still: np.ndarray) -> Sensitivities:
    """Derivatives from the figures of moved designs.

    Where two places are largest alike whatever the variable is, as in a cycle that runs there and back, round-off picks
    one of them anew for every design: differences over all designs count where they are the better ones.
    """
    both = np.asarray(tried.unmoved.all(axis=1))
    tracked = _slopes(tried, np.where(tried.smooth, tried.value, np.nan), both)
    every = _slopes(tried, tried.value, np.ones(both.shape, bool))
    below, above = _better(tracked.below, every.below), _better(tracked.above, every.above)
    gap, doubt = abs(above.value - below.value), APART * (above.error + below.error)
    kink = (gap > doubt) & (gap > BEND * np.maximum(abs(above.value), abs(below.value)))
    middle = _better(tracked.middle, every.middle)
    one_side = np.isnan(below.value) | np.isnan(above.value)
    slope = np.where(kink | one_side, (below.value + above.value) / 2, middle.value)
    error = np.where(kink | one_side, (below.error + above.error) / 2, middle.error)
    for side in (below, above):  # the only one there is
        error = np.where(np.isnan(slope), side.error, error)
        slope = np.where(np.isnan(slope), side.value, slope)
    return Sensitivities(names, at, tried.own, slope, error, below.value, above.value, kink, np.where(kink, 0.0, still))


def _slopes(tried: _Tried, values: np.ndarray, both: np.ndarray) -> _Slopes:
    """Derivatives by values of moved designs, nan where they do not serve; `both`: where both sides together do."""
    served = np.where(np.isinf(values), np.nan, values).transpose(1, 2, 0, 3)  # (sides, levels, figures, variables)
    figures = np.where(np.isinf(tried.own), np.nan, tried.own)[:, None]  # what is endless has no derivative
    left, right = tried.move[:, :, None, :]
    rough = ROUND_OFF * np.maximum(abs(figures), np.where(np.isfinite(served), abs(served), 0.0).max(axis=(0, 1)))
    across = np.where(both, served[1] - served[0], np.nan)
    below, above = (
        limit((served[k] - figures) / by, 2 * rough / abs(by), order=1) for k, by in enumerate((left, right))
    )
    return _Slopes(limit(across / (right - left), 2 * rough / (right - left), order=2), below, above)


def _better(one: Extrapolation, other: Extrapolation) -> Extrapolation:
    """The limit with the smaller error of two."""
    first = ~(other.error < np.where(np.isnan(one.error), np.inf, one.error))
    return Extrapolation(np.where(first, one.value, other.value), np.where(first, one.error, other.error))
