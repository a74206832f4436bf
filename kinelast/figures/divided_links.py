"""Buckling where a link is several beams: Euler's load of each alone says nothing of the whole."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from elastic.assessment import LIMITS, Exceedance
from kinelast.figures.many_beams import too_many_beams
from kinelast.figures.peaks import Peak
from kinelast.scene.data import Scene
from kinelast.scene.motion import scene_deflection

KIND = "axial force"


def divided_links(scene: Scene, pressed: Mapping[int, Peak]) -> list[tuple[Exceedance, Peak]]:
    """Share of the whole mechanism's buckling load, past its limit, and where; nothing where all links are one beam.

    Where the load at which it buckles cannot be found, that is told by a figure of nan.

    Parameters
    ----------
    pressed
        Where the beams of each of its divided links are pressed most without vibration.
    """
    if not pressed:
        return []
    from elastic.elastodynamics import buckling_factor

    peaks = list({peak.time: peak for peak in sorted(pressed.values(), key=lambda peak: peak.time)}.values())
    if too_many_beams(scene.mechanism):
        return [(_unknown(), peaks[0])]
    moved = scene.course.at(np.array([peak.time for peak in peaks]))
    factor = buckling_factor(scene_deflection(scene, moved))
    unknown = [(_unknown(), peaks[number]) for number in np.flatnonzero(np.isnan(factor))[:1]]
    known = np.where(np.isnan(factor), np.inf, factor)
    worst = int(known.argmin())
    share, limit = 1.0 / float(known[worst]), LIMITS[KIND]
    if not limit.passed(share):
        return unknown
    words = f"the mechanism is pressed with {share:.2g} times the load at which it buckles, its links taken whole"
    beyond = limit.far_passed(share)
    bound = limit.beyond if beyond else limit.watch
    return [(Exceedance(KIND, None, None, share, bound, beyond, words), peaks[worst]), *unknown]


def _unknown() -> Exceedance:
    words = "buckling: the load at which the mechanism buckles, its links taken whole, cannot be found"
    return Exceedance(KIND, None, None, math.nan, LIMITS[KIND].watch, False, words)
