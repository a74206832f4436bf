"""Sensitivities: derivatives of results with respect to input values of a design, by Richardson extrapolation.

Results are called figures, e.g. the largest stress. Varied input values are called variables.
"""

from collections.abc import Callable

import numpy as np
from msgspec import Struct

from kinelast.designs.evaluate import Designs
from rigid.arrays import Flags, Reals

RATIO = 2.0  # ratio of successive steps
FIRST_EXPONENT, LEVELS = 4, 18  # (step) / (scale of the variable) goes from 2^-4 to 2^-21
DEPTH = 6  # maximum number of successive extrapolations
NOISE_DEPTH = 3  # after NOISE_DEPTH extrapolations, values from small steps are assumed to differ only by round-off
NOISE_FACTOR = 4.0  # safety factor on the round-off error, which is estimated from few differences


class Extrapolation(Struct, frozen=True):
    """A derivative as the limit of difference quotients.

    Attributes
    ----------
    value
        Derivative, shape (...); nan if no step is usable.
    error
        Estimated truncation and round-off error, shape (...).
    """

    value: Reals
    error: Reals


def steps(scale: np.ndarray) -> np.ndarray:
    """Return the steps of the variables, shape (levels, variables), largest first.

    Parameters
    ----------
    scale
        Magnitude of each variable, shape (variables,).
    """
    return np.asarray(
        np.multiply.outer(RATIO ** -np.arange(FIRST_EXPONENT, FIRST_EXPONENT + LEVELS, dtype=float), scale)
    )


def limit(quotients: np.ndarray, noise: np.ndarray, order: int) -> Extrapolation:
    """Extrapolate difference quotients to a step of zero (Richardson).

    Each step is the previous step divided by `RATIO`.

    The extrapolation with the smallest estimated error is selected. Each extrapolated value is computed from two other
    values. The estimated truncation error is the larger difference between the extrapolated value and the two other
    values (Ridders). The round-off error is computed from `noise`. The round-off error is increased if values from
    neighbouring small steps differ by more than `noise` explains.

    Parameters
    ----------
    quotients
        Difference quotients, shape (levels, ...), largest step first; nan for unusable steps.
    noise
        Error of each quotient due to round-off, shape (levels, ...).
    order
        Exponent such that the truncation error is a power series in step^order. The exponent is 2 for central
        differences, and 1 for one-sided differences.

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
    noise_ratio = _noise_ratio(*tables[NOISE_DEPTH][:2])
    for value, rounded, truncated in tables[1:]:
        error = truncated + rounded * noise_ratio
        error = np.where(np.isfinite(error), error, np.inf)
        at = error.argmin(axis=0)[None]
        found, least = (np.take_along_axis(each, at, axis=0)[0] for each in (value, error))
        better = least < best.error
        best = Extrapolation(np.where(better, found, best.value), np.where(better, least, best.error))
    return Extrapolation(best.value, np.where(np.isnan(best.value), np.nan, best.error))


def _noise_ratio(value: np.ndarray, rounded: np.ndarray) -> np.ndarray:
    """Return (estimated round-off) / (assumed round-off), at least 1, shape (...).

    The round-off is estimated from the differences between values from neighbouring steps. Only small steps are used,
    because their truncation errors are negligible.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        jumps = abs(np.diff(value, axis=0)) / (rounded[1:] + rounded[:-1])
    known = np.isfinite(jumps)
    last = known & (known[::-1].cumsum(axis=0)[::-1] <= 5)  # use only the five smallest usable steps
    return np.asarray(np.maximum(1.0, NOISE_FACTOR * np.where(last, jumps, 0.0).max(axis=0, initial=0.0)))


ROUND_OFF = 4 * np.finfo(float).eps  # assumed relative round-off error of a figure
KINK_ERRORS = 3.0  # no kink if the one-sided slopes differ by at most KINK_ERRORS * (sum of the errors of both slopes)
MIN_KINK = 1e-6  # no kink if the one-sided slopes differ by at most MIN_KINK * (steeper slope)


FiguresOf = Callable[[np.ndarray], Designs]


class Sensitivities(Struct, frozen=True):
    """Derivatives of figures (results) with respect to variables (input values).

    Arrays have the shape (figures, variables) unless stated otherwise.

    Attributes
    ----------
    figures
        Names of the figures.
    at
        Values of the variables, shape (variables,).
    figure
        Values of the figures, shape (figures,).
    slope, error
        Derivative and estimated error of the derivative; nan if unknown. At a kink, `slope` is the mean of both
        one-sided derivatives. If a figure is known on one side only, `slope` is the derivative on this side.
    below, above
        One-sided derivatives.
    kink
        True if the one-sided derivatives differ. Examples: the largest value occurs at two locations, or the figure is
        the magnitude of a quantity that is zero.
    valid_range
        Largest change of the variable for which the largest value stays at its location, divided by the scale of the
        variable. An increase and a decrease by this change must both keep the location. A larger change may move the
        largest value to another link or position. The range is 0 at a kink, and nan if a figure has no location.
    """

    figures: tuple[str, ...]
    at: Reals
    figure: Reals
    slope: Reals
    error: Reals
    below: Reals
    above: Reals
    kink: Flags
    valid_range: Reals

    @property
    def logarithmic(self) -> np.ndarray:
        """Change in each figure in per cent if a variable changes by one per cent, shape (figures, variables)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.slope * self.at / self.figure[:, None])


def sensitivities(figures_of: FiguresOf, at: np.ndarray, scale: np.ndarray | None = None) -> Sensitivities:
    """Compute derivatives of all figures with respect to all variables.

    Parameters
    ----------
    figures_of
        Function that returns the figures of designs. The argument contains the values of the variables, shape
        (designs, variables). The function is called once.
    at
        Values of the variables, shape (variables,).
    scale
        Magnitude of each variable, shape (variables,). The default is the absolute value of the variable, or 1 if the
        variable is 0. The largest step is scale / 16.

    Raises
    ------
    ValueError
        A scale is not positive.
    """
    at = np.asarray(at, float)
    scale = np.where(at == 0, 1.0, abs(at)) if scale is None else np.asarray(scale, float)
    if not (scale > 0).all():
        raise ValueError(f"scales must be greater than zero, got {scale.min()}")
    moved = _moved(at, steps(scale))
    computed = figures_of(np.concatenate([at[None], moved.reshape(-1, len(at))]))
    names = tuple(computed.columns)
    shape = (len(names), *moved.shape[:3])
    values = np.stack([np.asarray(computed.columns[name], float) for name in names])
    places = np.stack([np.asarray(computed.place.get(name, np.zeros(values.shape[1])), float) for name in names])
    move = np.diagonal(moved - at, axis1=2, axis2=3)  # signed steps, including round-off
    found_at = _DisplacedDesigns(
        values[:, 0], values[:, 1:].reshape(shape), places[:, 0], places[:, 1:].reshape(shape), move
    )
    located = np.array([name in computed.place for name in names])
    return _sensitivities_from(names, at, found_at, np.where(located[:, None], _unmoved_range(found_at, scale), np.nan))


def _moved(at: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return designs that differ from `at` in one variable, shape (sides, levels, displaced variables, variables)."""
    levels, count = step.shape
    moved = np.broadcast_to(at, (2, levels, count, count)).copy()
    own = np.arange(count)
    moved[0][:, own, own] -= step
    moved[1][:, own, own] += step
    return moved


class _DisplacedDesigns(Struct, frozen=True):
    """Figures of an original design, and of displaced designs in which one variable is changed.

    Attributes
    ----------
    own, own_place
        Figures of the original design, and locations of the largest values, shape (figures,).
    value, place
        Figures of the displaced designs, and locations of the largest values, shape (figures, sides, levels,
        variables).
    move
        Signed changes of the variables, shape (sides, levels, variables).
    """

    own: Reals
    value: Reals
    own_place: Reals
    place: Reals
    move: Reals

    @property
    def smooth(self) -> np.ndarray:
        """True for each displacement up to which a figure is smooth, shape (figures, sides, levels, variables).

        A figure is smooth up to a displacement if this displacement and all smaller displacements on the same side meet
        two conditions: the figure is finite, and the largest value stays at one location.
        """
        same = (self.place == self.place[:, :, -1:]) & np.isfinite(self.value)
        return np.asarray(np.logical_and.accumulate(same[:, :, ::-1], axis=2)[:, :, ::-1])

    @property
    def unmoved(self) -> np.ndarray:
        """True if the smallest displacement keeps the place of the largest value, shape (figures, sides, variables)."""
        return np.asarray(self.place[:, :, -1] == self.own_place[:, None, None])


def _unmoved_range(tried: _DisplacedDesigns, scale: np.ndarray) -> np.ndarray:
    """Return the largest (change / `scale`) that keeps the location of the largest value, shape (figures, variables).

    An increase and a decrease by this change must both keep the location.
    """
    way = np.where(tried.smooth & tried.unmoved[:, :, None], abs(tried.move) / scale, 0.0)
    return np.asarray(way.max(axis=2).min(axis=1))


class _Slopes(Struct, frozen=True):
    """Derivatives from central, backward and forward differences, each of shape (figures, variables)."""

    middle: Extrapolation
    below: Extrapolation
    above: Extrapolation


def _sensitivities_from(
    names: tuple[str, ...], at: np.ndarray, tried: _DisplacedDesigns, unmoved: np.ndarray
) -> Sensitivities:
    """Compute derivatives from the figures of displaced designs.

    The largest value may occur at two locations in every design, e.g. if a mechanism moves back and forth. Round-off
    then selects one of the two locations at random. Therefore, each derivative is computed twice: from displaced
    designs that keep the location, and from all displaced designs. The derivative with the smaller estimated error is
    selected.
    """
    both = np.asarray(tried.unmoved.all(axis=1))
    tracked = _slopes(tried, np.where(tried.smooth, tried.value, np.nan), both)
    every = _slopes(tried, tried.value, np.ones(both.shape, bool))
    below, above = _better(tracked.below, every.below), _better(tracked.above, every.above)
    gap, doubt = abs(above.value - below.value), KINK_ERRORS * (above.error + below.error)
    kink = (gap > doubt) & (gap > MIN_KINK * np.maximum(abs(above.value), abs(below.value)))
    middle = _better(tracked.middle, every.middle)
    one_side = np.isnan(below.value) | np.isnan(above.value)
    slope = np.where(kink | one_side, (below.value + above.value) / 2, middle.value)
    error = np.where(kink | one_side, (below.error + above.error) / 2, middle.error)
    for side in (below, above):  # use a one-sided derivative if the figure is known on one side only
        error = np.where(np.isnan(slope), side.error, error)
        slope = np.where(np.isnan(slope), side.value, slope)
    return Sensitivities(
        names, at, tried.own, slope, error, below.value, above.value, kink, np.where(kink, 0.0, unmoved)
    )


def _slopes(tried: _DisplacedDesigns, values: np.ndarray, both: np.ndarray) -> _Slopes:
    """Return derivatives from the values of displaced designs.

    Parameters
    ----------
    values
        Values of the displaced designs, shape (figures, sides, levels, variables); nan if a value must not be used.
    both
        True if central differences are valid, shape (figures, variables).
    """
    served = np.where(np.isinf(values), np.nan, values).transpose(1, 2, 0, 3)  # (sides, levels, figures, variables)
    figures = np.where(np.isinf(tried.own), np.nan, tried.own)[:, None]  # inf has no derivative
    left, right = tried.move[:, :, None, :]
    rough = ROUND_OFF * np.maximum(abs(figures), np.where(np.isfinite(served), abs(served), 0.0).max(axis=(0, 1)))
    across = np.where(both, served[1] - served[0], np.nan)
    below, above = (
        limit((served[k] - figures) / by, 2 * rough / abs(by), order=1) for k, by in enumerate((left, right))
    )
    return _Slopes(limit(across / (right - left), 2 * rough / (right - left), order=2), below, above)


def _better(one: Extrapolation, other: Extrapolation) -> Extrapolation:
    """Return, for each element, the extrapolation with the smaller error."""
    first = ~(other.error < np.where(np.isnan(one.error), np.inf, one.error))
    return Extrapolation(np.where(first, one.value, other.value), np.where(first, one.error, other.error))
