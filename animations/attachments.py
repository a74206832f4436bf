"""Springs and the pitch circles of gears."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from animations.shapes import QUIET, Complexes, FlatShape
from animations.symbols import moved_place
from elastic import Deflection
from rigid import Gear, PinDrive, SliderDrive, Spring, position_of
from rigid.teeth import pitch_reach

COILS = 8
CIRCLE = np.exp(2j * np.pi * np.arange(61) / 60)


def attachment_shapes(deflection: Deflection, size: float, exaggeration: float = 0.0) -> list[FlatShape]:
    """Draw springs as zigzags and gear wheels as circles with a spoke.

    Parameters
    ----------
    size
        Diameter of a pin [m].
    exaggeration
        Scale factor of the displacements of their ends.
    """
    mechanism = deflection.motion.mechanism
    shapes = [_spring(deflection, load, size, exaggeration) for load in mechanism.loads if isinstance(load, Spring)]
    for gear in mechanism.gears:
        for wheel, radius in _wheels(deflection, gear):
            at = mechanism.index[wheel.links[0]]
            middle = moved_place(deflection, at, wheel.joint, exaggeration)
            shapes.append(_wheel(middle, radius * deflection.motion.direction[at]))
    return shapes


def _spring(deflection: Deflection, spring: Spring, size: float, exaggeration: float) -> FlatShape:
    ends = [
        moved_place(deflection, *end, exaggeration) for end in ((spring.link, spring.point), (spring.on, spring.anchor))
    ]
    share = np.concatenate([[0.0, 0.15], 0.15 + 0.7 * (np.arange(2 * COILS) + 0.5) / (2 * COILS), [0.85, 1.0]])
    aside = 0.8j * size * np.concatenate([[0, 0], np.tile([1, -1], COILS), [0, 0]])

    def place(position: int) -> Complexes:
        start, way = ends[0][position], ends[1][position] - ends[0][position]
        points: Complexes = start + way * share + aside * way / max(abs(way), 1e-300)
        return points

    return FlatShape("ground", place, lines=(np.arange(len(share)),), ink="soft", width=1.3)


def _wheels(deflection: Deflection, gear: Gear) -> Iterator[tuple[PinDrive | SliderDrive, float]]:
    """Yield both wheels of a toothed gear with their pitch radii [m]."""
    driver, follower, ratio = gear.driver, gear.follower, gear.ratio
    if gear.pressure_angle is None or not (driver.turns and follower.turns) or ratio == 1:
        return
    places = [position_of(deflection.motion, drive.links[0], drive.joint) for drive in (driver, follower)]
    apart = np.abs(places[1] - places[0])
    if not np.ptp(apart[np.isfinite(apart)]) <= 1e-6 * np.nanmax(apart):
        return  # no single link carries both wheels, so they are not drawn
    radius = abs(float(pitch_reach(np.nanmax(apart), ratio)))
    yield driver, abs(ratio) * radius
    yield follower, radius


def _wheel(middle: Complexes, spoke: Complexes) -> FlatShape:
    circle = np.concatenate([CIRCLE, [0.0]])
    lines = (np.arange(len(CIRCLE)), np.array([0, len(CIRCLE)]))
    return FlatShape("guide", lambda p: middle[p] + spoke[p] * circle, lines=lines, ink=QUIET, width=1.5)
