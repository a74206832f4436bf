"""Inverse kinematics: drive coordinates for a given point position, angle or distance."""

import numpy as np

from rigid.analysis.coordinates import Coordinate
from rigid.analysis.crossings import intervals, positions, zeros
from rigid.analysis.turning_points import turning_points
from rigid.arrays import Reals
from rigid.kinematics import Motion

TOUCH_TOLERANCE = (
    64 * np.finfo(float).eps
)  # largest distance from a value that counts as touching it, relative to the coordinate's size


def drive_values(course: Motion, coordinate: Coordinate, value: float) -> Reals:
    """All drive coordinates of a motion at which a coordinate has a value, to round-off.

    Parameters
    ----------
    course
        Motion of one design, which is the search range; a closed motion includes the step from the last position to the
        first.
    coordinate
        A `PointCoordinate` (a point's x or y), `LinkAngle`, `Slide`, `Distance` or `Offset` (height difference of two
        points). Angles that differ by full turns are equal.
    value
        [rad or m].

    Returns
    -------
    Shape (drives, solutions), in the order of the motion; empty if the value is not reached. A value touched at a
    limit of the coordinate gives one solution. Two reversals of the coordinate between neighbouring positions are not
    detected.
    """
    between = intervals(course)
    turns = turning_points(between, coordinate)
    number = np.concatenate([np.arange(len(between.left)), [k for k, _, _ in turns]]).astype(int)
    part = np.concatenate([np.zeros(len(between.left)), [part for _, part, _ in turns]])
    order = np.lexsort((part, number))
    number, part = number[order], part[order]
    rest = coordinate.difference(between.at(number, part), value)
    beyond = coordinate.difference(positions(course, between.right[-1:]), value)
    rest = np.where(np.abs(rest) <= TOUCH_TOLERANCE * _scale(course, coordinate, value), 0.0, rest)
    after = np.append(rest[1:], beyond)
    end = np.append(np.where(number[1:] == number[:-1], part[1:], 1.0), 1.0)
    with np.errstate(invalid="ignore"):
        passes = (rest * after < 0) & (np.abs(rest - after) < np.pi if _turns(coordinate) else True)
    at, begin, width = number[passes], part[passes], (end - part)[passes]
    inside = zeros(
        lambda x: coordinate.difference(between.at(at, begin + x * width), value), rest[passes], after[passes]
    )
    hit = rest == 0
    step_number, part_of_step = np.concatenate([number[hit], at]), np.concatenate([part[hit], begin + inside * width])
    if len(between.left) < course.columns[0] and abs(beyond[0]) <= TOUCH_TOLERANCE * _scale(course, coordinate, value):
        step_number, part_of_step = np.append(step_number, len(between.left) - 1), np.append(part_of_step, 1.0)
    order = np.lexsort((part_of_step, step_number))
    return np.asarray(between.low[:, step_number[order]] + part_of_step[order] * between.change[:, step_number[order]])


def _turns(coordinate: Coordinate) -> bool:
    """Whether the coordinate is an angle, with differences modulo full turns."""
    from rigid.analysis.coordinates import LinkAngle

    return isinstance(coordinate, LinkAngle)


def _scale(course: Motion, coordinate: Coordinate, value: float) -> float:
    """Reference size for round-off of a coordinate."""
    if _turns(coordinate):
        return 1.0
    sizes = np.abs(coordinate.value(course))
    return max(abs(value), float(np.nanmax(sizes, initial=0.0)))
