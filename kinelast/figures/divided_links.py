"""Buckling where a link is several beams: Euler's load of each alone says nothing of the whole."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elastic import Deflection, deflection
from elastic.assessment import LIMITS, Exceedance, least_axial_force
from kinelast.scene.data import Scene

KIND = "axial force"


def divided_links(scene: Scene, plain: Deflection, counted: Any) -> list[Exceedance]:
    """What the mechanism as a whole is pressed with, past its limit; nothing where all links are one beam.

    Looked at where the beams of each of its links are pressed most. Where the load at which it buckles cannot be found,
    that is told by a figure of nan.

    Parameters
    ----------
    plain
        The quasi-static deflection.
    counted
        Which positions count, bool, shape (positions,).
    """
    owners = np.array([at for at, _ in scene.mechanism.beams], int)
    divided = np.flatnonzero(np.bincount(owners) > 1)
    if not divided.size or not counted.any():
        return []
    from elastic.elastodynamics import buckling_factor

    pressed = np.where(counted, -least_axial_force(plain), -np.inf)
    positions = np.array(sorted({int(pressed[owners == at].max(axis=0).argmax()) for at in divided}))
    moved = scene.course.at(plain.motion.time[positions])
    factor = buckling_factor(deflection(moved, plain.sections, plain.joints))
    unknown = [_unknown(int(positions[number])) for number in np.flatnonzero(np.isnan(factor))[:1]]
    known = np.where(np.isnan(factor), np.inf, factor)
    worst = int(known.argmin())
    share, limit = 1.0 / float(known[worst]), LIMITS[KIND]
    if not limit.passed(share):
        return unknown
    words = f"the mechanism is pressed with {share:.2g} times the load at which it buckles, its links taken whole"
    beyond = limit.far_passed(share)
    bound = limit.beyond if beyond else limit.watch
    return [Exceedance(KIND, None, int(positions[worst]), share, bound, beyond, words), *unknown]


def _unknown(position: int) -> Exceedance:
    words = "buckling: the load at which the mechanism buckles, its links taken whole, cannot be found"
    return Exceedance(KIND, None, position, math.nan, LIMITS[KIND].watch, False, words)
