"""Derivatives by differences at many steps, extrapolated to none, each with an estimate of its own error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid.arrays import Reals

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
