"""Laws of loads and efforts as functions of time, angle or slide, by formula or table.

A law is a function of a motion. It returns an array of shape (..., positions): the factor by which a load is
multiplied, or the effort (moment or force) of a drive.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from msgspec import Struct

from rigid.analysis.coordinates import Coordinate
from rigid.arrays import ArrayLike, Reals
from rigid.kinematics import Motion
from rigid.laws import TableError

Curve = Callable[[ArrayLike], Reals]
RANGE_TOLERANCE = 1e-12  # an abscissa may be outside a table by this, relative to the range of the table
# An entry of a table is a corner if its value differs by more than this from the linear interpolation between the
# neighbouring entries; relative to the range of all values.
MIN_CORNER = 0.02


class CurveLaw(Struct, frozen=True, eq=False):
    """Law that evaluates a curve at each position's time or coordinate (such as the angle of a link).

    Attributes
    ----------
    place
        Function that returns the time or coordinate at each position of a motion, shape (..., positions).
    curve
        Function that returns the load factor or effort at a time or coordinate.
    breaks
        Times or coordinates at which the curve has a jump or a corner.
    middle
        Only for an angle: centre of the range of the angle [rad]. The range extends by less than half a turn to each
        side of the centre. None for other coordinates and for time.
    """

    place: Callable[[Motion], Reals]
    curve: Curve
    breaks: tuple[float, ...] = ()
    middle: float | None = None

    def __call__(self, motion: Motion) -> Reals:
        """Return the load factor or effort at each position."""
        return np.broadcast_to(self.curve(self.place(motion)), motion.columns)


def law_of_time(curve: Curve, breaks: tuple[float, ...] = ()) -> CurveLaw:
    """Return a law of time [s] given by a curve (for `breaks` see `CurveLaw`)."""
    return CurveLaw(_time, curve, breaks)


def _time(motion: Motion) -> Reals:
    return motion.time


def law_of(coordinate: Coordinate, curve: Curve, breaks: tuple[float, ...] = ()) -> CurveLaw:
    """Return a law of an angle [rad], slide [m] or other coordinate (for `breaks` see `CurveLaw`)."""
    return CurveLaw(coordinate.value, curve, breaks)


def corners(at: Reals, value: Reals) -> tuple[float, ...]:
    """Return the abscissas at which a table has a jump or a corner.

    These are the entries that differ from the linear interpolation between their neighbours by more than `MIN_CORNER`.
    Beyond its ends, the table is continued with its first and its last value.

    Parameters
    ----------
    at, value
        Entries of the table, shape (entries,); `at` increases.

    Examples
    --------
    >>> corners(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0, 2.01]))
    (1.0, 3.0)
    """
    aside = at[-1] - at[0]
    places = np.concatenate([[at[0] - aside], at, [at[-1] + aside]])
    values = np.concatenate([value[:1], value, value[-1:]])
    share = np.diff(places)[:-1] / (places[2:] - places[:-2])
    off = np.abs(value - values[:-2] - share * (values[2:] - values[:-2]))
    return tuple(at[off > MIN_CORNER * np.ptp(value)].tolist())


def table_curve(
    at: ArrayLike,
    value: ArrayLike,
    interpolation: Literal["linear", "cubic"] = "linear",
    extend: Literal["error", "hold"] = "error",
    angles: bool = False,
) -> Curve:
    """Return a curve through the entries of a table.

    Parameters
    ----------
    at, value
        Entries of the table, shape (entries,); `at` increases.
    interpolation
        "linear", or "cubic" for a cubic spline with not-a-knot ends.
    extend
        "error" to raise an error beyond the ends, or "hold" to continue with the end value.
    angles
        Whether the abscissas are angles [rad]. Error messages give them in degrees.

    Raises
    ------
    TableError
        If there are too few entries, an entry is not finite, the abscissas do not increase, or the interpolation is
        unknown. If `extend` is "error", the returned curve raises this error for an abscissa outside the table.

    Examples
    --------
    >>> float(table_curve([0.0, 2.0], [10.0, 30.0])(0.5))
    15.0
    """
    at, value = np.asarray(at, float), np.asarray(value, float)
    fewest = 2 if interpolation == "linear" else 4
    if interpolation not in {"linear", "cubic"}:
        raise TableError(f'interpolation "{interpolation}", expected "linear" or "cubic"')
    if at.ndim != 1 or at.shape != value.shape or len(at) < fewest:
        raise TableError(f"{at.size} abscissas and {value.size} values, expected equal numbers of at least {fewest}")
    if not (np.diff(at) > 0).all():
        raise TableError("the abscissas of a table must increase from entry to entry")
    if not (np.isfinite(at).all() and np.isfinite(value).all()):
        raise TableError("the entries of a table must be finite")
    inside: Callable[[Reals], Reals] = (
        _cubic(at, value) if interpolation == "cubic" else lambda place: np.interp(place, at, value)
    )

    def curve(place: ArrayLike) -> Reals:
        place = np.asarray(place, float)
        if extend == "error":
            _require_inside(place, at, angles)
        return inside(np.clip(place, at[0], at[-1]))

    return curve


def _require_inside(place: Reals, at: Reals, angles: bool) -> None:
    slack = RANGE_TOLERANCE * (at[-1] - at[0])
    outside = place[(place < at[0] - slack) | (place > at[-1] + slack)]
    if outside.size:
        requested, first, last = (
            f"{np.degrees(each):.6g}\u00b0" if angles else f"{each:.6g}" for each in (outside.flat[0], at[0], at[-1])
        )
        raise TableError(
            f'evaluated at {requested}, but the table covers {first} to {last}: add entries, or set extend = "hold"',
            float(outside.flat[0]),
            (float(at[0]), float(at[-1])),
        )


def _cubic(at: Reals, value: Reals) -> Curve:
    from scipy.interpolate import CubicSpline

    return CubicSpline(at, value)
