"""Reach of a mechanism: positions that close, and stops."""

from typing import Any

import numpy as np

from rigid.arrays import Complex, Flags, Reals
from rigid.decomposition.groups import Group
from rigid.kinematics import Motion, motion
from rigid.parts import MechanismError
from rigid.plane import cross
from rigid.positions.drive_path import first_ways, outline

MAX_HALVINGS = 60  # number of bisections of a drive step, down to round-off
INFINITE_DISTANCE = 1e6  # distance of a link that counts as infinite at a stop, relative to the mechanism's size
METRES = 1.0, "m"


class ReachError(MechanismError):
    """The mechanism cannot reach the requested drive coordinates."""


def reachable(motion: Motion) -> Flags:
    """Whether the mechanism closes, bool, shape (..., positions)."""
    return np.asarray(np.isfinite(motion.origin).all(axis=0) & np.isfinite(motion.direction).all(axis=0))


def stops(course: Motion) -> list[tuple[Reals, str]]:
    """Stops of the mechanism: drive coordinates and the joint that opens.

    This works for one design, by bisection to round-off between a reachable position and an unreachable neighbour.
    """
    closes = reachable(course).reshape(-1, course.columns[-1])[0]
    ends = []
    for position in np.flatnonzero(closes[:-1] != closes[1:]).tolist():
        good, bad = (position, position + 1) if closes[position] else (position + 1, position)
        place = _stop(course, course.drive[:, good], course.drive[:, bad], good)
        ends.append((place, opening_joint(course, slice(bad, bad + 1))))
    return ends


def _runs_to_infinity(course: Motion, place: Reals) -> bool:
    """Whether a link is infinitely far away at the stop."""
    there = motion(course.mechanism, place[:, None], lead=outline(course.drive))
    return bool(
        np.abs(there.origin).max(initial=0.0, where=np.isfinite(there.origin))
        > INFINITE_DISTANCE * course.mechanism.size
    )


def _stop(course: Motion, inside: Reals, outside: Reals, position: int) -> Reals:
    """Drive coordinates at the stop between reachable and unreachable ones."""
    lead = outline(course.drive[:, : position + 1] if len(course.drive) > 1 else course.drive)
    for _ in range(MAX_HALVINGS):
        middle = (inside + outside) / 2
        if (middle == inside).all() or (middle == outside).all():
            break
        if reachable(motion(course.mechanism, middle[:, None], lead=lead)).all():
            inside = middle
        else:
            outside = middle
    return inside


def require_reach(course: Motion, lengths: tuple[float, str] = METRES) -> None:
    """Raise ReachError unless every position closes.

    Parameters
    ----------
    lengths
        Factor from metres to the length unit of the message, and the name of the unit.

    Raises
    ------
    ReachError
        The error names the drive's coordinate at the stop and the joint that opens.
    """
    closes = reachable(course)
    if closes.all():
        return
    if not closes.any():
        _require_start(course, lengths)
    ends = stops(course)
    raise ReachError(
        reach_words(course, ends, lengths),
        kind="reach",
        joints=[joint for _, joint in ends],
        drives=range(len(course.drive)),
        positions=np.flatnonzero(~closes.reshape(-1, course.columns[-1]).all(axis=0)).tolist(),
    )


def reach_words(course: Motion, ends: list[tuple[Reals, str]], lengths: tuple[float, str] = METRES) -> str:
    """How much of a motion is out of reach, and where it stops.

    Parameters
    ----------
    ends
        See `stops`.
    """
    limits = "; ".join(
        f'{_coordinates(course, place, lengths)}, where the joint "{joint}" '
        f"{'runs to infinity' if _runs_to_infinity(course, place) else 'opens'}"
        for place, joint in ends
    )
    closes = reachable(course)
    share = np.count_nonzero(~closes) / closes.size
    return f"the drive cannot go all the way, {share:.0%} of the positions are out of reach: it stops at {limits}"


def _require_start(course: Motion, lengths: tuple[float, str]) -> None:
    """Raise ReachError if no position is reached, because assembly fails or the mechanism stops before."""
    joint, kind = opening_joint(course), "unreachable"
    problem = "the mechanism cannot be assembled"
    if len(course.columns) == 1 and len(course.drive):
        first = course.drive[:, 0]
        drawn = first - np.array(first_ways(course.mechanism, course.drive))
        start = motion(course.mechanism, drawn[:, None])
        if reachable(start).all():
            kind, place = "reach", _coordinates(course, _stop(start, drawn, first, 0), lengths)
            problem = f"the drive cannot go from the drawing to any position, it stops at {place}"
    raise ReachError(
        f'{problem}: the joint "{joint}" is out of reach at every position{_shortfall(course, lengths)}',
        kind=kind,
        joints=(joint,),
        positions=range(course.columns[-1]),
    )


def opening_joint(course: Motion, positions: slice = slice(None)) -> str:
    """Name of the inner joint of the first group that does not close."""
    group = _open_group(course, positions)
    return group.cut[0].name if group else ""


def _open_group(course: Motion, positions: slice = slice(None)) -> Group | None:
    """First group that does not close, or None."""
    for closed in course.closures:
        links = list(closed.group.links)
        places = course.origin[links] + course.direction[links]
        if closed.cut and not np.isfinite(places[..., positions]).all():
            return closed.group
    return None


def _shortfall(course: Motion, lengths: tuple[float, str]) -> str:
    """Message about the distance that two links miss at the first position; one design."""
    group = _open_group(course)
    if group is None or len(group.tree) != 2 or not group.cut[0].turns or len(course.columns) != 1:
        return ""
    inner = group.cut[0]
    per, unit = lengths
    arms: list[Any] = [inner.at(hinge.child) - hinge.at_child for hinge in group.tree]
    places = [_place(course, hinge.parent, hinge.at_parent) for hinge in group.tree]
    slides = [k for k, hinge in enumerate(group.tree) if not hinge.turns]
    if not slides:
        first, second = sorted(hinge.name for hinge in group.tree)
        long, short = sorted((float(abs(arm)) for arm in arms), reverse=True)
        away = float(abs(places[1] - places[0]))
        if long - short <= away <= long + short:  # within reach, but the drive cannot get there
            return ""
        apart = f'"{first}" and "{second}" are {per * away:.4g} {unit} apart'
        reach = f"from {per * (long - short):.4g} to {per * (long + short):.4g} {unit}"
        return f": {apart}, the links between them reach {reach}"
    slide = group.tree[slides[0]]
    if len(slides) == 2 or not slide.ordered:
        return ""
    k = 1 - slides[0]
    carrier = course.direction[slide.parent, 0]
    foot = _place(course, slide.parent, slide.at_parent) + carrier * slide.turn * arms[slides[0]]
    away = abs(cross(carrier * slide.line, places[k] - foot))
    if away <= abs(arms[k]):
        return ""
    far = f'"{group.tree[k].name}" is {per * away:.4g} {unit} from the line of "{slide.name}"'
    return f": {far}, the link between them is {per * abs(arms[k]):.4g} {unit} long"


def _place(course: Motion, link: int, local: Complex) -> complex:
    """Position of a link's point at the first position."""
    return complex(np.ravel(course.origin[link, 0] + course.direction[link, 0] * local)[0])


def _coordinates(course: Motion, place: Reals, lengths: tuple[float, str]) -> str:
    """Format drive coordinates for a message."""
    words = []
    for drive, value in zip(course.mechanism.drives, place, strict=True):
        if drive.turns:
            words.append(f'"{drive.name}" at {np.round(np.degrees(value), 9) + 0.0:.6g} deg')
        else:
            words.append(f'slider "{drive.name}" at {lengths[0] * value:.6g} {lengths[1]}')
    return ", ".join(words)
