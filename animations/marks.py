"""Marks beside the links: the directions of the drives, and the paths of the points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from animations.shapes import Complexes, FlatShape
from animations.symbols import moved_place
from elastic import Deflection
from rigid.arrays import Integers

ARC = np.linspace(0.45, 2.0, 25)  # [rad] from the driven link on
WAY = np.linspace(-1.7, 1.7, 25)  # [pins] along a slide
HEAD = np.array([1.0, -0.45 + 0.6j, -0.45 - 0.6j])  # of an arrow that points to the right
CLOSED = 1.5  # strides between the ends of a path up to which they are joined


def drive_shapes(deflection: Deflection, size: float, exaggeration: float = 0.0) -> list[FlatShape]:
    """An arrow at every drive, the way that it goes at the moment; none while it stands.

    Parameters
    ----------
    size
        Diameter of a pin [m].
    exaggeration
        The arrows move with the displacements, so many times as much.
    """
    motion = deflection.motion
    shapes = []
    for number, drive in enumerate(motion.mechanism.drives):
        line = (_turning if drive.turns else _sliding)(deflection, drive, size, exaggeration)
        shapes.append(_arrow(line, np.sign(np.nan_to_num(motion.drive_rate[number])), size))
    return shapes


def _turning(deflection: Deflection, drive: Any, size: float, exaggeration: float) -> Callable[..., Complexes]:
    at = deflection.motion.mechanism.index[drive.link]
    place, start = moved_place(deflection, at, drive.at, exaggeration), deflection.motion.direction[at]
    return lambda position, sense: place[position] + 2.0 * size * start[position] * np.exp(1j * sense * ARC)


def _sliding(deflection: Deflection, drive: Any, size: float, exaggeration: float) -> Callable[..., Complexes]:
    motion = deflection.motion
    joint = next(each for each in motion.structure.joints if each.name == drive.joint and not each.turns)
    place = moved_place(deflection, joint.block, joint.point(joint.block) or "", exaggeration)
    along = joint.along(motion)
    upwards = np.where(along.real >= 0, 1j, -1j)  # the ground is hatched below
    return lambda position, sense: place[position] + size * along[position] * (1.5 * upwards[position] + sense * WAY)


def _arrow(line: Callable[[int, float], Complexes], sense: Sequence[float], size: float) -> FlatShape:
    """A line with a head at its end, all points one where it goes neither way."""

    def place(position: int) -> Complexes:
        shaft = line(position, sense[position])
        tip = shaft[-1] - shaft[-2]
        head = shaft[-1] + 0.6 * size * HEAD * (tip / abs(tip) if abs(tip) > 0 else 0.0)
        points: Complexes = np.concatenate([shaft, head])
        return points if sense[position] else np.full_like(points, shaft[0])

    return FlatShape("mark", place, (len(ARC) + np.arange(3),), (np.arange(len(ARC) + 1),), "accent", "accent", 2.4)


def path_shapes(deflection: Deflection, positions: Integers, exaggeration: float = 0.0) -> list[FlatShape]:
    """The paths of all points that move, over some positions, displaced so many times as much."""
    motion = deflection.motion
    seen, shapes = set(motion.mechanism.links[0].points), []
    for link in motion.mechanism.links[1:]:
        for name in [name for name in link.points if name not in seen]:
            seen.add(name)
            shapes += _path(moved_place(deflection, link.name, name, exaggeration)[positions])
    return shapes


def _path(places: Complexes) -> list[FlatShape]:
    strides = np.abs(np.diff(places))
    if not strides.any():
        return []
    round_trip = abs(places[-1] - places[0]) <= CLOSED * strides.max()
    points = np.append(places, places[0]) if round_trip else places
    return [FlatShape("guide", lambda position: points, lines=(np.arange(len(points)),), ink="accent", width=1.0)]
