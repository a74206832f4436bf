"""Laws of loads and efforts: constant, or as a function of time, angle or slide, by formula or table.

A law takes a motion and returns an array of shape (..., positions), a load factor or the effort of a drive.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rigid.analysis.coordinates import Coordinate
from rigid.arrays import ArrayLike, Reals
from rigid.kinematics import Motion
from rigid.laws import TableError

Curve = Callable[[ArrayLike], Reals]
RANGE_TOLERANCE = 1e-12  # tolerance beyond the ends of a table, relative to its range
MIN_CORNER = 0.02  # smallest distance of a corner from the line through its neighbours, relative to the table's range


@dataclass(frozen=True, eq=False)
class CurveLaw:
    """Law along a curve.

    Attributes
    ----------
    place
        Time or coordinate at each position of a motion, shape (..., positions).
    curve
        Factor at a time or coordinate.
    breaks
        Abscissas at which the curve jumps or has a corner.
    middle
        Centre of the angle range, which extends by less than half a turn to each side [rad]; None for other
        coordinates.
    """

    place: Callable[[Motion], Reals]
    curve: Curve
    breaks: tuple[float, ...] = ()
    middle: float | None = None

    def __call__(self, motion: Motion) -> Reals:
        """Factor at each position."""
        return np.broadcast_to(self.curve(self.place(motion)), motion.columns)


def law_of_time(curve: Curve, breaks: tuple[float, ...] = ()) -> CurveLaw:
    """Law of time [s] given by a curve; for `breaks` see `CurveLaw`."""
    return CurveLaw(_time, curve, breaks)


def _time(motion: Motion) -> Reals:
    return motion.time


def law_of(coordinate: Coordinate, curve: Curve, breaks: tuple[float, ...] = ()) -> CurveLaw:
    """Law of an angle [rad], slide [m] or other coordinate; for `breaks` see `CurveLaw`."""
    return CurveLaw(coordinate.value, curve, breaks)


def corners(at: Reals, value: Reals) -> tuple[float, ...]:
    """Abscissas of jumps, and of corners of at least `MIN_CORNER`, in a table that is held beyond its ends.

    Parameters
    ----------
    at, value
        Entries, shape (entries,); `at` increases.

    Examples
    --------
    >>> corners(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0, 2.01]))
    (1.0, 3.0)
    """
    aside = at[-1] - at[0]
    places = np.concatenate([[at[0] - aside], at, [at[-1] + aside]])
    held = np.concatenate([value[:1], value, value[-1:]])
    share = np.diff(places)[:-1] / (places[2:] - places[:-2])
    off = np.abs(value - held[:-2] - share * (held[2:] - held[:-2]))
    return tuple(at[off > MIN_CORNER * np.ptp(value)].tolist())


def table_curve(
    at: ArrayLike,
    value: ArrayLike,
    interpolation: Literal["linear", "cubic"] = "linear",
    extend: Literal["error", "hold"] = "error",
    angles: bool = False,
) -> Curve:
    """Curve through the entries of a table.

    Parameters
    ----------
    at, value
        Entries, shape (entries,); `at` increases.
    interpolation
        "linear", or a cubic spline with continuous curvature ("not-a-knot" at its ends).
    extend
        Beyond the ends: "error", or "hold" the end value.
    angles
        Whether the locations are angles [rad], which messages give in degrees.

    Raises
    ------
    TableError
        There are too few entries, or they do not increase; when called, if an abscissa is outside the table.

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
        raise TableError(f"{at.size} places and {value.size} values, expected as many of both and at least {fewest}")
    if not (np.diff(at) > 0).all():
        raise TableError("the places of a table must grow from entry to entry")
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
            f'asked at {requested}, but the table goes from {first} to {last}: add entries, or extend = "hold"',
            float(outside.flat[0]),
            (float(at[0]), float(at[-1])),
        )


def _cubic(at: Reals, value: Reals) -> Curve:
    from scipy.interpolate import CubicSpline

    return CubicSpline(at, value)
