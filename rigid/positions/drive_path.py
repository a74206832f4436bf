"""The way of the drives from the drawing through all positions asked, as a function of one coordinate."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from rigid.arrays import Flags, Reals
from rigid.decomposition.order import structure
from rigid.drawing import Drawing
from rigid.mechanism import Mechanism

TURN = 64  # knots
STRIDE = 2 * math.pi / TURN  # of a pin's drive from one knot to the next [rad]
SLIDES = 50  # strides of a slider's drive in the size of the drawing
BLOCK = 16  # knots by which a branch is known further
ASIDE = 0.0618  # of a stride
STILL = 1e-9  # the drawing is the first position [rad or m]
FINEST = 2.0**-18  # of a stride: how near a change point is closed in on


@dataclass(frozen=True, eq=False)
class Path:
    """Coordinates of the drives along the way, by the place s on it.

    For a single drive s is its coordinate, and the way a line both ways from the drawing; for several s counts the
    positions passed.

    Attributes
    ----------
    begin
        s of the drawing.
    asked
        s of the positions asked, shape (positions,), or (designs, positions) where designs pass others.
    stride
        Greatest step of s.
    turn
        s of a whole turn after which the drive is where it was; 0 where there is none.
    outline
        s of the first, least and greatest position of the whole motion, of which those asked may be a part.
    vertices
        Coordinates of the drives at s = 0, 1, 2, ..., shape (drives, n); None for a single drive.
    whole
        The positions asked are the whole motion.
    """

    begin: float
    asked: Reals
    stride: float
    turn: float
    outline: tuple[float, ...] = ()
    vertices: Reals | None = None
    whole: bool = False

    @cached_property
    def span(self) -> tuple[float, float]:
        """Least and greatest s of the positions asked; the drawing's where there are none."""
        if self.whole:
            return self.outline[1], self.outline[2]
        if not len(self.asked):
            return self.begin, self.begin
        return self.asked.min(), self.asked.max()

    def shifted(self, shift: float) -> Path:
        """The same with all places less by a shift."""
        return replace(
            self, begin=self.begin - shift, asked=self.asked - shift, outline=tuple(s - shift for s in self.outline)
        )

    def drives(self, places: Any) -> Reals:
        """Coordinates of the drives, shape (drives, ...)."""
        if self.vertices is None:
            return np.asarray(places)[None]
        flat = np.ravel(places)
        grid = np.arange(self.vertices.shape[1])
        return np.array([np.interp(flat, grid, row) for row in self.vertices]).reshape(-1, *np.shape(places))

    def grid(self, low: float, high: float) -> Reals:
        """Knots from `low` to `high` at least, the drawing among them."""
        if self.vertices is None:
            below, above = (int(np.ceil(way / self.stride - 1e-9)) for way in (self.begin - low, high - self.begin))
            number = np.arange(-max(below, 0), max(above, 0) + 1)
            # Off the even places, at which mechanisms are often singular.
            return np.asarray(self.begin + self.stride * (number + np.where(number % TURN, ASIDE, 0.0)), float)
        return np.arange(self.vertices.shape[1], dtype=float)

    def onward(self, low: float, high: float) -> bool:
        """Whether the drives go on from one place to the other, rather than turn back between them."""
        if self.vertices is None:
            return True
        first, last = int(np.floor(low)), int(np.ceil(high))
        steps = np.diff(self.vertices[:, max(first, 0) : last + 1], axis=1)
        return bool(((steps[:, :-1] * steps[:, 1:]).sum(axis=0) >= 0).all())


def path_through(mechanism: Mechanism, drive: Reals, lead: Reals | None = None) -> Path:
    """The way from the drawing, by `lead` where it is given, through the positions asked."""
    _, slides, wraps = drawn_drives(mechanism)
    given = drive if lead is None or not lead.shape[1] else np.concatenate([lead, drive], axis=1)
    ways = first_ways(mechanism, given)
    strides = drive_strides(mechanism)
    if len(drive) == 1:
        turn = 2 * np.pi if wraps and not slides[0] else 0.0
        whole = float(given[0].flat[0]), float(given[0].min()), float(given[0].max())
        return Path(whole[0] - ways[0], drive[0], strides[0], turn, whole, whole=given is drive)
    if not len(drive):
        return Path(0.0, np.zeros(drive.shape[1]), 1.0, 0.0)
    given = np.concatenate([given[:, :1] - np.array(ways)[:, None], given], axis=1)
    steps = np.abs(np.diff(given, axis=1)) / strides[:, None]
    pieces = np.maximum(np.ceil(steps.max(axis=0)), 1).astype(int)
    at = np.concatenate([[0], np.cumsum(pieces)])
    places = np.interp(np.arange(at[-1] + 1), at, np.arange(len(at)))
    vertices = np.array([np.interp(places, np.arange(len(at)), row) for row in given])
    vertices[:, at] = given
    return Path(0.0, at[len(at) - drive.shape[1] :].astype(float), 1.0, 0.0, (), vertices)


def outline(drive: Any) -> Any:
    """The positions that tell from where the drives set out, which serve as the `lead` of a part of a motion.

    Of a single drive the first, least and greatest, of several all.
    """
    if len(drive) != 1:
        return drive
    row = drive[0] if drive.ndim == 2 else drive[0].reshape(-1)
    return row[[0, row.argmin(), row.argmax()]][None]


def first_ways(mechanism: Mechanism, drive: Any) -> list[float]:
    """Ways of the drives from the drawing to the first position [rad or m]: the shorter where turns do not matter."""
    drawn, slides, wraps = drawn_drives(mechanism)
    first = drive[:, 0] if drive.ndim == 2 else drive[:, 0, 0]
    return [
        math.remainder(to - at, 2 * math.pi) if wraps and not slide else to - at
        for at, to, slide in zip(drawn, first.tolist(), slides, strict=True)
    ]


@lru_cache(maxsize=64)
def drive_strides(mechanism: Mechanism) -> Reals:
    """How far apart knots are along every drive [rad or m]."""
    _, slides, _ = drawn_drives(mechanism)
    return np.where(slides, mechanism.size / SLIDES, STRIDE)


@lru_cache(maxsize=64)
def drawn_drives(mechanism: Mechanism) -> tuple[list[float], Flags, bool]:
    """Coordinates of the drives as drawn, whether they are slides, and whether whole turns of them do not matter.

    They do where a gear is driven by a joint that is not itself moved: its angle is counted from the drawing on.
    """
    drawing = Drawing(mechanism)
    joints = structure(mechanism).joints
    drawn = [0.0] * len(mechanism.drives)
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), not joint.turns
    return drawn, slides, not structure(mechanism).measured_drivers
