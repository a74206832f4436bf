"""Inverse kinematics: coordinates of the drive that bring a point, an angle or a distance to a value."""

from __future__ import annotations

import numpy as np

from rigid.analysis.coordinates import Coordinate
from rigid.analysis.crossings import intervals, positions, zeros
from rigid.analysis.turning_points import turning_points
from rigid.arrays import Reals
from rigid.kinematics import Motion

TOUCH = 64 * np.finfo(float).eps  # of the coordinate's size, by which it may miss a value that it touches


def drive_values(course: Motion, coordinate: Coordinate, value: float) -> Reals:
    """All coordinates of the drives, on the course of a motion, at which a coordinate has a value, to round-off.

    Parameters
    ----------
    course
        A motion of one design, the course to search; where it closes, the step from the last position to the first too.
    coordinate
        A `PointCoordinate` (a point's x or y), `LinkAngle`, `Slide`, `Distance` or `Offset` (height of one point over
        another). Angles are equal where they differ by whole turns.
    value
        [rad or m].

    Returns
    -------
    Shape (drives, solutions), in the order of the course; none where it does not reach the value. A value that is
    touched at a limit of the coordinate is one solution. Two turns of the coordinate between the same two positions are
    not seen.
    """
    between = intervals(course)
    turns = turning_points(between, coordinate)
    number = np.concatenate([np.arange(len(between.left)), [k for k, _, _ in turns]]).astype(int)
    part = np.concatenate([np.zeros(len(between.left)), [part for _, part, _ in turns]])
    order = np.lexsort((part, number))
    number, part = number[order], part[order]
    rest = coordinate.difference(between.at(number, part), value)
    beyond = coordinate.difference(positions(course, between.right[-1:]), value)
    rest = np.where(np.abs(rest) <= TOUCH * _scale(course, coordinate, value), 0.0, rest)
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
    if len(between.left) < course.columns[0] and abs(beyond[0]) <= TOUCH * _scale(course, coordinate, value):
        step_number, part_of_step = np.append(step_number, len(between.left) - 1), np.append(part_of_step, 1.0)
    order = np.lexsort((part_of_step, step_number))
    return np.asarray(between.low[:, step_number[order]] + part_of_step[order] * between.change[:, step_number[order]])


def _turns(coordinate: Coordinate) -> bool:
    """Whether a difference jumps by a whole turn."""
    from rigid.analysis.coordinates import LinkAngle

    return isinstance(coordinate, LinkAngle)


def _scale(course: Motion, coordinate: Coordinate, value: float) -> float:
    """Size that round-off of a coordinate is measured by."""
    if _turns(coordinate):
        return 1.0
    sizes = np.abs(coordinate.value(course))
    return max(abs(value), float(np.nanmax(sizes, initial=0.0)))
