"""Drive arrows and the paths of the points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from animations.shapes import Complexes, FlatShape
from animations.symbols import moved_place
from elastic import Deflection
from rigid.arrays import Integers

ARC = np.linspace(0.45, 2.0, 25)  # [rad] from the driven link
WAY = np.linspace(-1.7, 1.7, 25)  # along a slide, in pin diameters
HEAD = np.array([1.0, -0.45 + 0.6j, -0.45 - 0.6j])  # arrow head that points to the right
MAX_CLOSING_GAP = 1.5  # largest gap between the ends of a closed path, relative to the longest step


def drive_shapes(deflection: Deflection, size: float, exaggeration: float = 0.0) -> list[FlatShape]:
    """Draw an arrow at each drive in its current sense; no arrow at rest.

    Parameters
    ----------
    size
        Diameter of a pin [m].
    exaggeration
        Scale factor of the displacements of the arrows.
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
    upwards = np.where(along.real >= 0, 1j, -1j)  # above the line: the ground's hatching is below
    return lambda position, sense: place[position] + size * along[position] * (1.5 * upwards[position] + sense * WAY)


def _arrow(line: Callable[[int, float], Complexes], sense: Sequence[float], size: float) -> FlatShape:
    """Line with a head at its end; collapsed to a point if the drive rests."""

    def place(position: int) -> Complexes:
        shaft = line(position, sense[position])
        tip = shaft[-1] - shaft[-2]
        head = shaft[-1] + 0.6 * size * HEAD * (tip / abs(tip) if abs(tip) > 0 else 0.0)
        points: Complexes = np.concatenate([shaft, head])
        return points if sense[position] else np.full_like(points, shaft[0])

    return FlatShape("mark", place, (len(ARC) + np.arange(3),), (np.arange(len(ARC) + 1),), "accent", "accent", 2.4)


def path_shapes(deflection: Deflection, positions: Integers, exaggeration: float = 0.0) -> list[FlatShape]:
    """Draw the paths of all moving points, with exaggerated displacements."""
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
    round_trip = abs(places[-1] - places[0]) <= MAX_CLOSING_GAP * strides.max()
    points = np.append(places, places[0]) if round_trip else places
    return [FlatShape("guide", lambda position: points, lines=(np.arange(len(points)),), ink="accent", width=1.0)]
