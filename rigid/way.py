"""The way of the drives from the drawing through all positions, in steps along which a branch can be followed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigid.drawing import Drawing
from rigid.mechanism import Mechanism

STRIDE = 0.1  # of a pin's drive from the drawing to the first position [rad]
BETWEEN = 0.35  # from one position to the next [rad]
SLIDES = 20  # steps of a slider's drive from the drawing to the first position
STILL = 1e-9  # the drawing is the first position [rad or m]
MOST = 4  # times the positions asked, and at least FEW, that the way may have between them
FEW = 2000


@dataclass(frozen=True, eq=False)
class Way:
    """Coordinates of the drives along the way, and which of them are asked.

    Attributes
    ----------
    drive
        Shape (drives, n).
    asked
        Places on the way of the positions asked, shape (positions,); None where the way is just these.
    approach
        How many places lead to the first of them.
    """

    drive: Any
    asked: Any = None
    approach: int = 0


def way_through(mechanism: Mechanism, drive: Any, lead: Any = None) -> Way:
    """The way from the drawing, by `lead` where it is given, through the positions asked.

    Where positions are farther apart than a branch is followed, others are put between them.
    """
    drawn, slides, wraps = drawn_drives(mechanism)
    first = (drive if lead is None or not lead.shape[1] else lead)[:, 0].tolist()
    ways = [
        math.remainder(to - at, 2 * math.pi) if wraps and not slide else to - at
        for at, to, slide in zip(drawn, first, slides, strict=True)
    ]
    led = lead is not None or any(abs(way) > STILL for way in ways)
    if not led and not any(_coarse(row) for row, slide in zip(drive, slides, strict=True) if not slide):
        return Way(drive)
    parts = [np.array(first)[:, None] - np.array(ways)[:, None]] if any(abs(way) > STILL for way in ways) else []
    given = np.concatenate([*parts, *([] if lead is None else [lead]), drive], axis=1)
    return _divided(given, slides, given.shape[1] - drive.shape[1], bool(parts))


def _coarse(angle: Any) -> bool:
    """Whether positions are farther apart than a branch is followed."""
    return bool(np.abs(angle[1:] - angle[:-1]).max(initial=0.0) > BETWEEN)


def _divided(given: Any, slides: Any, leading: int, drawn: bool) -> Way:
    """The way with the places that are missing on it."""
    step = np.abs(np.diff(given, axis=1))
    turned = step[~slides].max(axis=0, initial=0.0)
    pieces = np.maximum(np.ceil(turned / BETWEEN), 1).astype(int)
    if drawn:
        slid = step[slides, 0].max(initial=0.0) > 0.0
        pieces[0] = max(int(np.ceil(turned[0] / STRIDE)), SLIDES if slid else 3)
    asked = given.shape[1] - leading
    if pieces[leading:].sum() > max(MOST * asked, FEW):
        pieces[leading:] = 1
    at = np.concatenate([[0], np.cumsum(pieces)])
    places = np.interp(np.arange(at[-1] + 1), at, np.arange(len(at)))
    drive = np.array([np.interp(places, np.arange(len(at)), row) for row in given])
    drive[:, at] = given
    return Way(drive, at[leading:], int(at[leading]))


@lru_cache(maxsize=64)
def drawn_drives(mechanism: Mechanism) -> tuple[list[float], Any, bool]:
    """Coordinates of the drives as drawn, whether they are slides, and whether whole turns of them do not matter.

    They do where a gear is driven by a joint that is not itself moved: its angle is counted from the drawing on.
    """
    drawing = Drawing(mechanism)
    joints = mechanism.structure.joints
    drawn = [0.0] * len(mechanism.drives)
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), joint.slider is not None
    return drawn, slides, all(joint.gear is None or joint.gear.driver.moved for joint in joints)
