"""The way of the drives from the drawing through all positions, in steps along which a branch can be followed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigid.decomposition.order import structure
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
        Places on the way of the positions asked, shape (positions,), or a slice; None where the way is just these.
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
    coarse = any(_coarse(row) for row, slide in zip(drive, slides, strict=True) if not slide)
    parts = [np.array(first)[:, None] - np.array(ways)[:, None]] if any(abs(way) > STILL for way in ways) else []
    if lead is None and not parts and not coarse:
        return Way(drive)
    given = np.concatenate([*parts, *([] if lead is None else [lead]), drive[:, :1]], axis=1)
    pieces = _pieces(given, slides)
    if parts:
        step = np.abs(given[:, 1] - given[:, 0])
        slid = step[slides].max(initial=0.0) > 0.0
        pieces[0] = max(int(np.ceil(step[~slides].max(initial=0.0) / STRIDE)), SLIDES if slid else 3)
    approach = _divided(given, pieces)[:, :-1]
    begin = approach.shape[1]
    pieces = _pieces(drive, slides) if coarse else np.ones(0, int)
    if not coarse or pieces.sum() > max(MOST * drive.shape[1], FEW):
        return Way(np.concatenate([approach, drive], axis=1), slice(begin, None), begin)
    asked = begin + np.concatenate([[0], np.cumsum(pieces)])
    return Way(np.concatenate([approach, _divided(drive, pieces)], axis=1), asked, begin)


def _coarse(angle: Any) -> bool:
    """Whether positions are farther apart than a branch is followed."""
    return bool(np.abs(angle[1:] - angle[:-1]).max(initial=0.0) > BETWEEN)


def _pieces(given: Any, slides: Any) -> Any:
    """Into how many pieces every step is to be divided."""
    turned = np.abs(np.diff(given, axis=1))[~slides].max(axis=0, initial=0.0)
    return np.maximum(np.ceil(turned / BETWEEN), 1).astype(int)


def _divided(given: Any, pieces: Any) -> Any:
    """The way with the places that are missing on it."""
    at = np.concatenate([[0], np.cumsum(pieces)])
    places = np.interp(np.arange(at[-1] + 1), at, np.arange(len(at)))
    drive = np.array([np.interp(places, np.arange(len(at)), row) for row in given])
    drive[:, at] = given
    return drive


@lru_cache(maxsize=64)
def drawn_drives(mechanism: Mechanism) -> tuple[list[float], Any, bool]:
    """Coordinates of the drives as drawn, whether they are slides, and whether whole turns of them do not matter.

    They do where a gear is driven by a joint that is not itself moved: its angle is counted from the drawing on.
    """
    drawing = Drawing(mechanism)
    joints = structure(mechanism).joints
    drawn = [0.0] * len(mechanism.drives)
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), joint.slider is not None
    return drawn, slides, all(joint.gear is None or joint.gear.driver.moved for joint in joints)
