"""Path of the drive coordinates from the drawing through all requested positions, with one parameter."""

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
STRIDE = 2 * math.pi / KNOTS_PER_TURN  # [rad] distance between knots of a pin drive
STRIDES_PER_SIZE = 50  # number of strides of a slider drive per mechanism size
KNOTS_PER_EXTENSION = 16  # number of knots by which a branch is extended at a time
KNOT_OFFSET = 0.0618  # offset of knots from round angles, in strides
PLACE_TOLERANCE = 1e-9  # [rad or m] distance up to which two points on the path count as equal
FINEST_STEP = 2.0**-18  # resolution of a dyad's change point, in strides


@dataclass(frozen=True, eq=False)
class Path:
    """Drive coordinates as functions of a path parameter s.

    With a single drive, s is the drive coordinate, and the path extends in both directions from the drawing. With
    several drives, s is the index of a vertex of the path.

    Attributes
    ----------
    begin
        s at the drawing.
    requested
        s at the requested positions, shape (positions,), or (designs, positions) if designs differ.
    stride
        Largest step of s between knots.
    turn
        Change of s in a full turn of the drive, if turns do not count; otherwise 0.
    outline
        s at the first, the smallest and the largest position of the whole motion. `requested` may be a part of it.
    vertices
        Drive coordinates at s = 0, 1, 2, ..., shape (drives, n); None for a single drive.
    whole
        Whether `requested` is the whole motion.
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
        """Smallest and largest s of the requested positions; `begin` if there are none."""
        if self.whole:
            return self.outline[1], self.outline[2]
        if not len(self.requested):
            return self.begin, self.begin
        return self.requested.min(), self.requested.max()

    def shifted(self, shift: float) -> Path:
        """Return the path with all s reduced by `shift`."""
        return replace(
            self,
            begin=self.begin - shift,
            requested=self.requested - shift,
            outline=tuple(s - shift for s in self.outline),
        )

    def drives(self, places: Any) -> Reals:
        """Return the drive coordinates at points s, shape (drives, ...)."""
        if self.vertices is None:
            return np.asarray(places)[None]
        flat = np.ravel(places)
        grid = np.arange(self.vertices.shape[1])
        return np.array([np.interp(flat, grid, row) for row in self.vertices]).reshape(-1, *np.shape(places))

    def grid(self, low: float, high: float) -> Reals:
        """Return knots that cover the range from `low` to `high`, and the drawing."""
        if self.vertices is None:
            below, above = (
                int(np.ceil(distance / self.stride - 1e-9)) for distance in (self.begin - low, high - self.begin)
            )
            number = np.arange(-max(below, 0), max(above, 0) + 1)
            # avoid round angles, at which many mechanisms are singular
            return np.asarray(
                self.begin + self.stride * (number + np.where(number % KNOTS_PER_TURN, KNOT_OFFSET, 0.0)), float
            )
        return np.arange(self.vertices.shape[1], dtype=float)

    def keeps_direction(self, low: float, high: float) -> bool:
        """Return whether the drives move on without reversing between two points."""
        if self.vertices is None:
            return True
        first, last = int(np.floor(low)), int(np.ceil(high))
        steps = np.diff(self.vertices[:, max(first, 0) : last + 1], axis=1)
        return bool(((steps[:, :-1] * steps[:, 1:]).sum(axis=0) >= 0).all())


def path_through(mechanism: Mechanism, drive: Reals, lead: Reals | None = None) -> Path:
    """Return the path from the drawing, through `lead` if given, to the requested positions."""
    _, slides, wraps = drawn_drives(mechanism)
    given = drive if lead is None or not lead.shape[1] else np.concatenate([lead, drive], axis=1)
    travel = initial_travel(mechanism, given)
    strides = drive_strides(mechanism)
    if len(drive) == 1:
        turn = 2 * np.pi if wraps and not slides[0] else 0.0
        whole = float(given[0].flat[0]), float(given[0].min()), float(given[0].max())
        return Path(whole[0] - travel[0], drive[0], strides[0], turn, whole, whole=given is drive)
    if not len(drive):
        return Path(0.0, np.zeros(drive.shape[1]), 1.0, 0.0)
    given = np.concatenate([given[:, :1] - np.array(travel)[:, None], given], axis=1)
    steps = np.abs(np.diff(given, axis=1)) / strides[:, None]
    pieces = np.maximum(np.ceil(steps.max(axis=0)), 1).astype(int)
    at = np.concatenate([[0], np.cumsum(pieces)])
    places = np.interp(np.arange(at[-1] + 1), at, np.arange(len(at)))
    vertices = np.array([np.interp(places, np.arange(len(at)), row) for row in given])
    vertices[:, at] = given
    return Path(0.0, at[len(at) - drive.shape[1] :].astype(float), 1.0, 0.0, (), vertices)


def outline(drive: Any) -> Any:
    """Return the drive positions that determine the path of a whole motion, for use as `lead` of a part of it.

    These are the first, smallest and largest position of a single drive, or all positions of several drives.
    """
    if len(drive) != 1:
        return drive
    row = drive[0] if drive.ndim == 2 else drive[0].reshape(-1)
    return row[[0, row.argmin(), row.argmax()]][None]


def initial_travel(mechanism: Mechanism, drive: Any) -> list[float]:
    """Return the travel of each drive from the drawing to the first position [rad or m].

    It is the shorter way round if full turns do not count.
    """
    drawn, slides, wraps = drawn_drives(mechanism)
    first = drive[:, 0] if drive.ndim == 2 else drive[:, 0, 0]
    return [
        math.remainder(to - at, 2 * math.pi) if wraps and not slide else to - at
        for at, to, slide in zip(drawn, first.tolist(), slides, strict=True)
    ]


@lru_cache(maxsize=64)
def drive_strides(mechanism: Mechanism) -> Reals:
    """Return the distance between knots of each drive [rad or m]."""
    _, slides, _ = drawn_drives(mechanism)
    return np.where(slides, mechanism.size / STRIDES_PER_SIZE, STRIDE)


@lru_cache(maxsize=64)
def drawn_drives(mechanism: Mechanism) -> tuple[list[float], Flags, bool]:
    """Return the drawn drive coordinates, whether each is a slide, and whether positions repeat every full turn.

    They do not repeat if an undriven joint drives a gear, because the angle of this joint is counted from the drawing.
    """
    drawing = Drawing(mechanism)
    joints = structure(mechanism).joints
    drawn = [0.0] * len(mechanism.drives)
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), not joint.turns
    return drawn, slides, not structure(mechanism).measured_drivers
