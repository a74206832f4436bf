"""The way of the drives from the drawing through all positions, in steps along which a branch can be followed."""

from __future__ import annotations

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
    before = np.empty((len(drive), 0)) if lead is None else lead
    first = before[:, 0] if before.shape[1] else drive[:, 0]
    drawn, slides = drawn_drives(mechanism)
    drawn = first - np.where(slides, first - drawn, np.angle(np.exp(1j * (first - drawn))))
    start = drawn[:, None] if np.abs(first - drawn).max(initial=0.0) > STILL else np.empty((len(drive), 0))
    given = np.concatenate([start, before, drive], axis=1) if start.size or before.size else drive
    leading = given.shape[1] - drive.shape[1]
    step = np.abs(np.diff(given, axis=1))
    if not leading and not step[~slides].max(initial=0.0) > BETWEEN:
        return Way(drive)
    return _divided(given, step, slides, leading, start.shape[1])


def _divided(given: Any, step: Any, slides: Any, leading: int, drawn: int) -> Way:
    """The way with the places that are missing on it."""
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
def drawn_drives(mechanism: Mechanism) -> tuple[Any, Any]:
    """Coordinates of the drives as drawn, and whether they are slides, two arrays of shape (drives,)."""
    drawing = Drawing(mechanism)
    drawn = np.zeros(len(mechanism.drives))
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in mechanism.structure.joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), joint.slider is not None
    return drawn, slides
