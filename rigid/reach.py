"""Where a mechanism can go: the positions that close, and where it stops."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid.mechanism import MechanismError, PinDrive
from rigid.motion import Motion, motion
from rigid.postures import Posture

HALVINGS = 60


class ReachError(MechanismError):
    """The drives ask for positions that the mechanism does not reach."""


def reachable(motion: Motion) -> Any:
    """Whether the mechanism closes, bool, shape (..., positions)."""
    return np.isfinite(motion.origin).all(axis=0) & np.isfinite(motion.direction).all(axis=0)


def stops(course: Motion) -> list[tuple[Any, str]]:
    """Where the mechanism stops: the drives' coordinates there and the joint that opens.

    For one design; by bisection to round-off between a position that closes and a neighbour that does not.
    """
    closes = reachable(course).reshape(-1, course.columns[-1])[0]
    found = []
    for position in np.flatnonzero(closes[:-1] != closes[1:]).tolist():
        good, bad = (position, position + 1) if closes[position] else (position + 1, position)
        inside, outside = course.drive[:, good], course.drive[:, bad]
        for _ in range(HALVINGS):
            middle = (inside + outside) / 2
            if reachable(_at(course, middle, good)).all():
                inside = middle
            else:
                outside = middle
        found.append((inside, opening_joint(_at(course, outside, good))))
    return found


def require_reach(course: Motion) -> None:
    """Raise where a position does not close.

    Raises
    ------
    ReachError
        Names the drive's coordinate where it stops and the joint that cannot be reached.
    """
    closes = reachable(course)
    if closes.all():
        return
    if not closes.any():
        joint = opening_joint(course)
        raise ReachError(f'the mechanism cannot be assembled: the joint "{joint}" is out of reach at every position')
    limits = "; ".join(
        f'{_coordinates(course, place)}, where the joint "{joint}" opens' for place, joint in stops(course)
    )
    share = np.count_nonzero(~closes) / closes.size
    raise ReachError(
        f"the drive cannot go all the way, {share:.0%} of the positions are out of reach: it stops at {limits}"
    )


def opening_joint(course: Motion) -> str:
    """Name of the inner joint of the first group that does not close."""
    for closed in course.closures:
        links = list(closed.group.links)
        if closed.cut and not np.isfinite(course.origin[links] + course.direction[links]).all():
            return closed.cut[0].joint.name
    return ""


def _at(course: Motion, coordinates: Any, near: int) -> Motion:
    """The same mechanism at other coordinates of its drives, near one of its positions."""
    at = (..., slice(near, near + 1))
    here = Posture(course.mechanism, course.origin[at], course.direction[at])
    return motion(course.mechanism, coordinates[:, None], near=here)


def _coordinates(course: Motion, place: Any) -> str:
    """Coordinates of the drives for a message."""
    words = []
    for drive, value in zip(course.mechanism.drives, place, strict=True):
        if isinstance(drive, PinDrive):
            words.append(f'"{drive.link}" at {np.degrees(value):.6g} deg')
        else:
            words.append(f'slider "{drive.slider}" at {value:.6g} m')
    return ", ".join(words)
