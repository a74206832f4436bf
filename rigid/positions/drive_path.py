"""Drive path: drive coordinates from the drawing through all requested positions, as functions of one parameter."""

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

KNOTS_PER_TURN = 64
STRIDE = 2 * math.pi / KNOTS_PER_TURN  # distance between knots for a drive at a pin [rad]
STRIDES_PER_SIZE = 50  # number of strides of a slider's drive over the size of the drawing
KNOTS_PER_EXTENSION = 16  # number of knots by which a branch is extended
KNOT_OFFSET = 0.0618  # offset of knots from round angles, in strides
PLACE_TOLERANCE = 1e-9  # largest distance of points that count as equal [rad or m]
FINEST_STEP = 2.0**-18  # resolution of a change point, in strides


@dataclass(frozen=True, eq=False)
class Path:
    """Drive coordinates along the path, by the path parameter s.

    For a single drive s is its coordinate, and the path extends both ways from the drawing. For several drives s counts
    the positions.

    Attributes
    ----------
    begin
        s of the drawing.
    requested
        s of the requested positions, shape (positions,), or (designs, positions) if designs differ.
    stride
        Largest step of s.
    turn
        Change of s in a full turn after which the drive is back at its start; 0 if there is none.
    outline
        s of the first, smallest and largest position of the whole motion, of which `requested` may be a part.
    vertices
        Drive coordinates at s = 0, 1, 2, ..., shape (drives, n); None for a single drive.
    whole
        True if `requested` is the whole motion.
    """

    begin: float
    requested: Reals
    stride: float
    turn: float
    outline: tuple[float, ...] = ()
    vertices: Reals | None = None
    whole: bool = False

    @cached_property
    def span(self) -> tuple[float, float]:
        """Smallest and largest s of the requested positions; the drawing's s if there are none."""
        if self.whole:
            return self.outline[1], self.outline[2]
        if not len(self.requested):
            return self.begin, self.begin
        return self.requested.min(), self.requested.max()

    def shifted(self, shift: float) -> Path:
        """Shift the path by -`shift`."""
        return replace(
            self,
            begin=self.begin - shift,
            requested=self.requested - shift,
            outline=tuple(s - shift for s in self.outline),
        )

    def drives(self, places: Any) -> Reals:
        """Drive coordinates at points, shape (drives, ...)."""
        if self.vertices is None:
            return np.asarray(places)[None]
        flat = np.ravel(places)
        grid = np.arange(self.vertices.shape[1])
        return np.array([np.interp(flat, grid, row) for row in self.vertices]).reshape(-1, *np.shape(places))

    def grid(self, low: float, high: float) -> Reals:
        """Knots that cover `low` to `high`, including the drawing."""
        if self.vertices is None:
            below, above = (int(np.ceil(way / self.stride - 1e-9)) for way in (self.begin - low, high - self.begin))
            number = np.arange(-max(below, 0), max(above, 0) + 1)
            # offset from round angles, at which many mechanisms are singular
            return np.asarray(
                self.begin + self.stride * (number + np.where(number % KNOTS_PER_TURN, KNOT_OFFSET, 0.0)), float
            )
        return np.arange(self.vertices.shape[1], dtype=float)

    def onward(self, low: float, high: float) -> bool:
        """True if the drives do not reverse between two points."""
        if self.vertices is None:
            return True
        first, last = int(np.floor(low)), int(np.ceil(high))
        steps = np.diff(self.vertices[:, max(first, 0) : last + 1], axis=1)
        return bool(((steps[:, :-1] * steps[:, 1:]).sum(axis=0) >= 0).all())


def path_through(mechanism: Mechanism, drive: Reals, lead: Reals | None = None) -> Path:
    """Build the path from the drawing, through `lead` if given, to the requested positions."""
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
    """Positions that determine how the drives leave the drawing, to be used as `lead` for a part of a motion.

    First, smallest and largest position of a single drive; all positions of several drives.
    """
    if len(drive) != 1:
        return drive
    row = drive[0] if drive.ndim == 2 else drive[0].reshape(-1)
    return row[[0, row.argmin(), row.argmax()]][None]


def first_ways(mechanism: Mechanism, drive: Any) -> list[float]:
    """Travel of each drive from the drawing to the first position [rad or m], the shorter one if turns do not count."""
    drawn, slides, wraps = drawn_drives(mechanism)
    first = drive[:, 0] if drive.ndim == 2 else drive[:, 0, 0]
    return [
        math.remainder(to - at, 2 * math.pi) if wraps and not slide else to - at
        for at, to, slide in zip(drawn, first.tolist(), slides, strict=True)
    ]


@lru_cache(maxsize=64)
def drive_strides(mechanism: Mechanism) -> Reals:
    """Distance between knots of each drive [rad or m]."""
    _, slides, _ = drawn_drives(mechanism)
    return np.where(slides, mechanism.size / STRIDES_PER_SIZE, STRIDE)


@lru_cache(maxsize=64)
def drawn_drives(mechanism: Mechanism) -> tuple[list[float], Flags, bool]:
    """Drive coordinates as drawn; whether each is a slide; whether full turns of the drives do not count.

    Turns count if an undriven joint drives a gear, because its angle is counted from the drawing.
    """
    drawing = Drawing(mechanism)
    joints = structure(mechanism).joints
    drawn = [0.0] * len(mechanism.drives)
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), not joint.turns
    return drawn, slides, not structure(mechanism).measured_drivers
