"""Drive coordinates and rates as arrays over the positions."""

import numpy as np

from rigid.arrays import ArrayLike, Columns, Reals
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import MechanismError
from rigid.plane import ZERO


def drive_arrays(
    mechanism: Mechanism, drive: ArrayLike, rate: ArrayLike, rate2: ArrayLike, time: ArrayLike | None
) -> tuple[Reals, Reals, Reals, Reals]:
    """Convert the arguments of `motion` to arrays (drives, ..., positions), and time to (..., positions)."""
    count = len(mechanism.drives)
    coordinates = np.atleast_1d(np.asarray(drive, float))
    if coordinates.ndim == 1:
        coordinates = coordinates[None] if count == 1 else coordinates[:, None]
    if len(coordinates) != count:
        raise MechanismError(f"{len(coordinates)} drive coordinates were given for {counted(count, 'drive')}")
    if coordinates.ndim == 2 and max(np.ndim(rate), np.ndim(rate2)) > 2:
        coordinates = coordinates[:, None]  # rates that differ by design
    instants = np.arange(coordinates.shape[-1], dtype=float) if time is None else np.asarray(time, float)
    if instants.shape[-1:] != coordinates.shape[-1:] or instants.ndim >= max(coordinates.ndim, 2):
        raise MechanismError(f"{instants.size} instants were given for {counted(coordinates.shape[-1], 'position')}")
    return coordinates, per_position(rate, coordinates), per_position(rate2, coordinates), instants


def per_position(value: ArrayLike, coordinates: Reals) -> Reals:
    """Broadcast a rate given per drive, position or design to the coordinates' shape."""
    if isinstance(value, float | int) or np.ndim(value) == 0:  # equals np.broadcast_to, but is five times as fast
        return np.ndarray(coordinates.shape, float, np.array(value, float), 0, (0,) * coordinates.ndim)
    if np.ndim(value) == 1:
        value = np.reshape(value, (len(coordinates), -1))
    if coordinates.ndim > np.ndim(value):
        value = np.expand_dims(value, 1)
    return np.broadcast_to(value, np.broadcast_shapes(np.shape(value), coordinates.shape))


def rate_of(rate: Reals, drive: int | None) -> Columns:
    """Return the rate of a drive: a scalar if it is constant, or ZERO if it is zero or there is no drive."""
    if drive is None:
        return ZERO
    row = rate[drive]
    if row.strides[-1] or not row.size:
        return row
    if row.ndim > 1:
        return row[:, :1]
    return float(row.flat[0]) or ZERO
