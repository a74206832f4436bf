"""Reach of a mechanism: which positions it can reach, and where it stops."""

from typing import Any

import numpy as np

from rigid.arrays import Complex, Flags, Reals
from rigid.decomposition.groups import Group
from rigid.kinematics import Motion
from rigid.kinematics import motion as compute_motion
from rigid.parts import MechanismError
from rigid.plane import cross
from rigid.positions.drive_path import initial_travel, outline

MAX_HALVINGS = 60  # maximum number of bisections of a drive step, enough for full precision
INFINITE_DISTANCE = 1e6  # distance beyond which a link counts as infinitely far away, relative to the mechanism's size
METRES = 1.0, "m"


class ReachError(MechanismError):
    """The mechanism cannot reach the requested drive coordinates."""


def reachable(motion: Motion) -> Flags:
    """Return whether the mechanism closes, shape (..., positions)."""
    return np.asarray(np.isfinite(motion.origin).all(axis=0) & np.isfinite(motion.direction).all(axis=0))


def stops(motion: Motion) -> list[tuple[Reals, str]]:
    """Return the stops of a mechanism: drive coordinates, and the joint that opens.

    The motion must have a single design. Each stop is found by bisection between a reachable position and an
    unreachable neighbour.
    """
    closes = reachable(motion).reshape(-1, motion.columns[-1])[0]
    ends = []
    for position in np.flatnonzero(closes[:-1] != closes[1:]).tolist():
        good, bad = (position, position + 1) if closes[position] else (position + 1, position)
        place = _stop(motion, motion.drive[:, good], motion.drive[:, bad], good)
        ends.append((place, opening_joint(motion, slice(bad, bad + 1))))
    return ends


def _runs_to_infinity(motion: Motion, place: Reals) -> bool:
    """Return whether a link is infinitely far away at a stop."""
    there = compute_motion(motion.mechanism, place[:, None], lead=outline(motion.drive))
    return bool(
        np.abs(there.origin).max(initial=0.0, where=np.isfinite(there.origin))
        > INFINITE_DISTANCE * motion.mechanism.size
    )


def _stop(motion: Motion, inside: Reals, outside: Reals, position: int) -> Reals:
    """Return the drive coordinates of the stop between reachable coordinates `inside` and unreachable `outside`."""
    lead = outline(motion.drive[:, : position + 1] if len(motion.drive) > 1 else motion.drive)
    for _ in range(MAX_HALVINGS):
        middle = (inside + outside) / 2
        if (middle == inside).all() or (middle == outside).all():
            break
        if reachable(compute_motion(motion.mechanism, middle[:, None], lead=lead)).all():
            inside = middle
        else:
            outside = middle
    return inside


def require_reach(motion: Motion, lengths: tuple[float, str] = METRES) -> None:
    """Raise ReachError if a position is out of reach.

    Parameters
    ----------
    lengths
        Unit of lengths in the message: number of units per metre, and name of the unit.

    Raises
    ------
    ReachError
        If a position is out of reach. The message states the drive coordinates at the stops and the joints that open.
    """
    closes = reachable(motion)
    if closes.all():
        return
    if not closes.any():
        _require_start(motion, lengths)
    ends = stops(motion)
    raise ReachError(
        reach_message(motion, ends, lengths),
        kind="reach",
        joints=[joint for _, joint in ends],
        drives=range(len(motion.drive)),
        positions=np.flatnonzero(~closes.reshape(-1, motion.columns[-1]).all(axis=0)).tolist(),
    )


def reach_message(motion: Motion, ends: list[tuple[Reals, str]], lengths: tuple[float, str] = METRES) -> str:
    """Return a message about the share of positions that are out of reach, and about the stops.

    Parameters
    ----------
    ends
        Stops, as returned by `stops`.
    """
    places = [
        f'{_coordinates(motion, place, lengths)}, where the joint "{joint}" '
        f"{'runs to infinity' if _runs_to_infinity(motion, place) else 'opens'}"
        for place, joint in ends
    ]
    limits = "; ".join(dict.fromkeys(places))  # a drive that goes to and fro meets the same stop twice
    closes = reachable(motion)
    share = np.count_nonzero(~closes) / closes.size
    return f"the drive cannot go all the way, {share:.0%} of the positions are out of reach: it stops at {limits}"


def _require_start(motion: Motion, lengths: tuple[float, str]) -> None:
    """Raise ReachError for a motion without a reachable position."""
    joint, kind = opening_joint(motion), "unreachable"
    problem = "the mechanism cannot be assembled"
    if len(motion.columns) == 1 and len(motion.drive):
        first = motion.drive[:, 0]
        drawn = first - np.array(initial_travel(motion.mechanism, motion.drive))
        start = compute_motion(motion.mechanism, drawn[:, None])
        if reachable(start).all():
            kind, place = "reach", _coordinates(motion, _stop(start, drawn, first, 0), lengths)
            problem = f"the drive cannot go from the drawing to any position, it stops at {place}"
    raise ReachError(
        f'{problem}: the joint "{joint}" is out of reach at every position{_shortfall(motion, lengths)}',
        kind=kind,
        joints=(joint,),
        positions=range(motion.columns[-1]),
    )


def opening_joint(motion: Motion, positions: slice = slice(None)) -> str:
    """Return the name of the inner joint of the first group that does not close, or ""."""
    group = _open_group(motion, positions)
    return group.cut[0].name if group else ""


def _open_group(motion: Motion, positions: slice = slice(None)) -> Group | None:
    """Return the first group that does not close, or None."""
    for closed in motion.closures:
        links = list(closed.group.links)
        places = motion.origin[links] + motion.direction[links]
        if closed.cut and not np.isfinite(places[..., positions]).all():
            return closed.group
    return None


def _shortfall(motion: Motion, lengths: tuple[float, str]) -> str:
    """Return a note on the lengths of two links that do not meet at the first position, for a single design."""
    group = _open_group(motion)
    if group is None or len(group.tree) != 2 or not group.cut[0].turns or len(motion.columns) != 1:
        return ""
    inner = group.cut[0]
    per, unit = lengths
    arms: list[Any] = [inner.at(hinge.child) - hinge.at_child for hinge in group.tree]
    places = [_place(motion, hinge.parent, hinge.at_parent) for hinge in group.tree]
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
    carrier = motion.direction[slide.parent, 0]
    foot = _place(motion, slide.parent, slide.at_parent) + carrier * slide.turn * arms[slides[0]]
    away = abs(cross(carrier * slide.line, places[k] - foot))
    if away <= abs(arms[k]):
        return ""
    far = f'"{group.tree[k].name}" is {per * away:.4g} {unit} from the line of "{slide.name}"'
    return f": {far}, the link between them is {per * abs(arms[k]):.4g} {unit} long"


def _place(motion: Motion, link: int, local: Complex) -> complex:
    """Return the location of a link's point at the first position."""
    return complex(np.ravel(motion.origin[link, 0] + motion.direction[link, 0] * local)[0])


def _coordinates(motion: Motion, place: Reals, lengths: tuple[float, str]) -> str:
    """Format drive coordinates for a message."""
    words = []
    for drive, value in zip(motion.mechanism.drives, place, strict=True):
        if drive.turns:
            words.append(f'"{drive.name}" at {np.round(np.degrees(value), 9) + 0.0:.6g} deg')
        else:
            words.append(f'slider "{drive.name}" at {lengths[0] * value:.6g} {lengths[1]}')
    return ", ".join(words)
