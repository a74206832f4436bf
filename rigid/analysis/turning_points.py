"""Extreme positions and dead points of a motion, time and velocity ratios, and drive coordinates for a given value."""

from typing import Literal

import numpy as np
from msgspec import Struct

from rigid.analysis.coordinates import Coordinate, LinkAngle, Rated
from rigid.analysis.crossings import Intervals, intervals, positions, turn_closes, zeros
from rigid.arrays import Reals
from rigid.kinematics import Motion
from rigid.names import counted
from rigid.parts import MechanismError
from rigid.reach import stops
from rigid.transmission import transmission_angles

GOLDEN = (np.sqrt(5) - 1) / 2  # inverse golden ratio
MAX_ITERATIONS = 80  # number of golden-section steps, enough for full precision
TOUCH_TOLERANCE = 64 * np.finfo(float).eps  # largest distance at which a value is reached / size of coordinate


class LimitPosition(Struct, frozen=True, eq=False):
    """Extreme value of a coordinate. If a drive prescribed the coordinate, this position would be a dead point.

    Attributes
    ----------
    kind
        "maximum" or "minimum".
    value
        Extreme value of the coordinate.
    drive
        Drive coordinates at the limit [rad or m], shape (drives,).
    """

    kind: Literal["maximum", "minimum"]
    value: float
    drive: Reals


class DeadPoint(Struct, frozen=True, eq=False):
    """A position at which the drives do not determine the motion.

    Attributes
    ----------
    kind
        "stop" at the end of the reachable range; "singular" if the mechanism can continue on two branches.
    drive
        Drive coordinates at the position [rad or m], shape (drives,).
    joint
        At a singular position, name of the joint between the links that become aligned. At a stop, name of the joint
        that opens.
    """

    kind: Literal["stop", "singular"]
    drive: Reals
    joint: str


def limits(motion: Motion, coordinate: Coordinate) -> list[LimitPosition]:
    """Return the extreme values of a coordinate over a motion, as zeros of its rate.

    The motion must have a single design. Two extremes between neighbouring positions are not detected. The ends of the
    motion do not count as extremes.
    """
    between = intervals(motion)
    turns = turning_points(between, coordinate)
    if not turns:
        return []
    numbers, parts, rising = (np.array(column) for column in zip(*turns, strict=True))
    here = between.at(numbers, parts)
    begin = coordinate.value(motion)[between.left[numbers]]
    values = begin + coordinate.difference(here, begin)
    return [
        LimitPosition("maximum" if rises else "minimum", float(value), drive)
        for rises, value, drive in zip(rising, values, here.drive.T, strict=True)
    ]


def turning_points(between: Intervals, coordinate: Rated) -> list[tuple[int, float, bool]]:
    """Return the reversals of a coordinate: interval index, fraction of the interval, and True for a maximum."""
    low, high = between.rates(coordinate)
    after = np.sign(np.roll(high, -1))
    if not turn_closes(between.motion):
        after[-1] = np.sign(low[-1])
    right = np.where(high == 0, after, np.sign(high))
    left = np.where(low == 0, right, np.sign(low))
    turns = np.flatnonzero(left * right < 0)
    parts = zeros(lambda part: coordinate.rate(between.at(turns, part)), low[turns], high[turns])
    return [(int(k), float(part), bool(left[k] > 0)) for k, part in zip(turns, parts, strict=True)]


def swing(motion: Motion, coordinate: Coordinate) -> tuple[LimitPosition, LimitPosition]:
    """Return the lowest minimum and the highest maximum of a coordinate.

    Raises
    ------
    MechanismError
        If the coordinate has no minimum or no maximum in this motion.
    """
    turned_back = limits(motion, coordinate)
    low = min((each for each in turned_back if each.kind == "minimum"), key=lambda limit: limit.value, default=None)
    high = max((each for each in turned_back if each.kind == "maximum"), key=lambda limit: limit.value, default=None)
    if low is None or high is None:
        raise MechanismError(
            f"{coordinate} does not swing in this motion: it reverses {counted(len(turned_back), 'time')}"
        )
    return low, high


def time_ratio(motion: Motion, coordinate: Coordinate) -> float:
    """Return the time ratio of a quick-return motion: longer / shorter drive angle between the limits.

    Raises
    ------
    MechanismError
        If the motion is not a full turn of one pin drive, or if the coordinate does not swing.
    """
    if len(motion.drive) != 1 or not motion.mechanism.drives[0].turns or not turn_closes(motion):
        raise MechanismError("a time ratio needs one drive that turns fully, without repeating the first position")
    low, high = swing(motion, coordinate)
    part = float(abs(high.drive[0] - low.drive[0])) % (2 * np.pi)
    return max(part, 2 * np.pi - part) / min(part, 2 * np.pi - part)


def velocity_ratio(motion: Motion, output: Rated, source: Rated) -> Reals:
    """Return the rate of `output` / rate of `source`, shape (..., positions).

    With a single drive, the ratio does not depend on the drive rate, which may be zero. With several drives, the rates
    of the motion are used.
    """
    if len(motion.drive) == 1:
        (motion,) = motion.units
    with np.errstate(divide="ignore", invalid="ignore"):
        return output.rate(motion) / source.rate(motion)


def dead_points(motion: Motion) -> list[DeadPoint]:
    """Return the stops of a mechanism, and the singular positions that it passes.

    The motion must have a single design. Singular positions are found as minima of `Motion.sine`. They are detected
    only if the positions of the motion are close enough together.
    """
    points = [DeadPoint("stop", np.asarray(drive), joint) for drive, joint in stops(motion)]
    between = intervals(motion)
    sine = motion.sine
    here = np.arange(len(between.left))
    if not turn_closes(motion):
        here = here[1:]
    before, after = sine[here - 1], sine[between.right[here]]
    low = here[(sine[here] <= before) & (sine[here] < after)]
    for number in low:
        place = _lowest(between, int(number))
        if place.singular[0]:
            points.append(DeadPoint("singular", place.drive[:, 0], aligned_joint(place)))
    return points


def _lowest(between: Intervals, number: int) -> Motion:
    """Return the position with the smallest sine near the start of an interval, by golden-section search.

    The search covers this interval and the previous one.
    """

    def at(place: float) -> Motion:
        return between.at(np.array([number if place >= 0 else number - 1]), np.array([place % 1.0]))

    def sine(place: float) -> float:
        return float(np.nan_to_num(at(place).sine[0]))

    low, high = -1.0, 1.0
    places = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    sines = [sine(place) for place in places]
    for _ in range(MAX_ITERATIONS):
        if sines[0] < sines[1]:
            high, places[1], sines[1] = places[1], places[0], sines[0]
            places[0] = high - GOLDEN * (high - low)
            sines[0] = sine(places[0])
        else:
            low, places[0], sines[0] = places[0], places[1], sines[1]
            places[1] = low + GOLDEN * (high - low)
            sines[1] = sine(places[1])
    return at(min(zip(sines, places, strict=True))[1])


def aligned_joint(place: Motion) -> str:
    """Return the name of the joint at which a mechanism is closest to singular; `place` has one position."""
    worst, name = np.inf, ""
    for transmission in transmission_angles(place):
        if transmission.angle[0] < worst:
            worst, name = float(transmission.angle[0]), transmission.joint
    larger = [closed for closed in place.closures if len(closed.group.free) > 2]
    if larger and not np.sin(worst) ** 2 <= 2.0 * place.sine[0] ** 2:
        name = larger[0].cut[0].joint.name
    return name


def drive_values(motion: Motion, coordinate: Coordinate, value: float) -> Reals:
    """Return all drive coordinates of a motion at which a coordinate has a given value.

    Parameters
    ----------
    motion
        Motion of a single design, which is the range of the search. For a closed cycle, the range includes the step
        from the last position to the first.
    coordinate
        A `PointCoordinate` (x or y of a point), `LinkAngle`, `Slide`, `Distance` or `Offset` (height difference of two
        points). Angles are compared modulo full turns.
    value
        Value of the coordinate [rad or m].

    Returns
    -------
    Drive coordinates of shape (drives, solutions), in the order of the motion; empty if the value is not reached. A
    value that is only touched at a limit of the coordinate gives one solution. Two reversals of the coordinate between
    neighbouring positions are not detected.
    """
    between = intervals(motion)
    turns = turning_points(between, coordinate)
    number = np.concatenate([np.arange(len(between.left)), [k for k, _, _ in turns]]).astype(int)
    part = np.concatenate([np.zeros(len(between.left)), [part for _, part, _ in turns]])
    order = np.lexsort((part, number))
    number, part = number[order], part[order]
    rest = coordinate.difference(between.at(number, part), value)
    beyond = coordinate.difference(positions(motion, between.right[-1:]), value)
    rest = np.where(np.abs(rest) <= TOUCH_TOLERANCE * _scale(motion, coordinate, value), 0.0, rest)
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
    if len(between.left) < motion.columns[0] and abs(beyond[0]) <= TOUCH_TOLERANCE * _scale(motion, coordinate, value):
        step_number, part_of_step = np.append(step_number, len(between.left) - 1), np.append(part_of_step, 1.0)
    order = np.lexsort((part_of_step, step_number))
    return np.asarray(between.low[:, step_number[order]] + part_of_step[order] * between.change[:, step_number[order]])


def _turns(coordinate: Coordinate) -> bool:
    """Return whether the coordinate is an angle, with differences modulo full turns."""
    return isinstance(coordinate, LinkAngle)


def _scale(motion: Motion, coordinate: Coordinate, value: float) -> float:
    """Return the reference size for round-off of a coordinate."""
    if _turns(coordinate):
        return 1.0
    sizes = np.abs(coordinate.value(motion))
    return max(abs(value), float(np.nanmax(sizes, initial=0.0)))
