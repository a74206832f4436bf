"""Path of the drive coordinates from the drawing through all requested positions, described by one parameter."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.arrays import Flags, Reals
from rigid.decomposition.order import structure
from rigid.drawing import Drawing
from rigid.mechanism import Mechanism

KNOTS_PER_TURN = 64  # number of knots (points of the path at which positions are computed) per turn of a pin drive
STRIDE = 2 * math.pi / KNOTS_PER_TURN  # [rad] distance between adjacent knots of a pin drive
STRIDES_PER_SIZE = 50  # number of strides (distances between adjacent knots) of a slider drive per mechanism size
KNOTS_PER_EXTENSION = 16  # a branch is extended by a multiple of this number of knots
# Knots are offset by this from multiples of the stride, in strides. Multiples of the stride include right angles, at
# which many mechanisms are singular.
KNOT_OFFSET = 0.0618
PLACE_TOLERANCE = 1e-9  # [rad or m] two points of the path that are closer than this count as equal
FINEST_STEP = 2.0**-18  # finest step of dyads, with which change points are located, in strides


class Path(Struct, frozen=True, eq=False, dict=True):
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
        Difference in s between adjacent knots.
    turn
        Change in s in a full turn of the drive, if all positions repeat after a full turn; otherwise 0.
    outline
        s at three positions of the whole motion: the first, the one with the smallest s, and the one with the largest
        s. `requested` may be a part of the whole motion.
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
        """Return the path with `shift` subtracted from all values of its parameter s."""
        return replace(
            self,
            begin=self.begin - shift,
            requested=self.requested - shift,
            outline=tuple(s - shift for s in self.outline),
        )

    def drives(self, places: Any) -> Reals:
        """Return the drive coordinates at values `places` of the path parameter, shape (drives, ...)."""
        if self.vertices is None:
            return np.asarray(places)[None]
        flat = np.ravel(places)
        grid = np.arange(self.vertices.shape[1])
        return np.array([np.interp(flat, grid, row) for row in self.vertices]).reshape(-1, *np.shape(places))

    def grid(self, low: float, high: float) -> Reals:
        """Return the path parameters of knots that cover the range from `low` to `high` and include the drawing."""
        if self.vertices is None:
            below, above = (
                int(np.ceil(distance / self.stride - 1e-9)) for distance in (self.begin - low, high - self.begin)
            )
            number = np.arange(-max(below, 0), max(above, 0) + 1)
            # the offset avoids round angles, see `KNOT_OFFSET`
            return np.asarray(
                self.begin + self.stride * (number + np.where(number % KNOTS_PER_TURN, KNOT_OFFSET, 0.0)), float
            )
        return np.arange(self.vertices.shape[1], dtype=float)

    def keeps_direction(self, low: float, high: float) -> bool:
        """Return whether the drives do not reverse their direction between two points."""
        if self.vertices is None:
            return True
        first, last = int(np.floor(low)), int(np.ceil(high))
        steps = np.diff(self.vertices[:, max(first, 0) : last + 1], axis=1)
        return bool(((steps[:, :-1] * steps[:, 1:]).sum(axis=0) >= 0).all())


def path_through(mechanism: Mechanism, drive: Reals, lead: Reals | None = None) -> Path:
    """Return the path from the drawing to the requested positions.

    Parameters
    ----------
    drive
        Requested drive coordinates [rad or m], shape (drives, positions) or (drives, designs, positions).
    lead
        Drive coordinates between the drawing and the first requested position, shape (drives, n).
    """
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
    """Return the drive coordinates that determine the path of a whole motion.

    If only a part of the motion is computed, they are its `lead` (see `path_through`), so that the part lies on the
    same branch. For a single drive, they are its first, smallest and largest coordinate. For several drives, they are
    all coordinates.
    """
    if len(drive) != 1:
        return drive
    row = drive[0] if drive.ndim == 2 else drive[0].reshape(-1)
    return row[[0, row.argmin(), row.argmax()]][None]


def initial_travel(mechanism: Mechanism, drive: Any) -> list[float]:
    """Return the travel of each drive from the drawing to the first position [rad or m].

    If all positions repeat after a full turn, it is at most half a turn.
    """
    drawn, slides, wraps = drawn_drives(mechanism)
    first = drive[:, 0] if drive.ndim == 2 else drive[:, 0, 0]
    return [
        math.remainder(to - at, 2 * math.pi) if wraps and not slide else to - at
        for at, to, slide in zip(drawn, first.tolist(), slides, strict=True)
    ]


@lru_cache(maxsize=64)
def drive_strides(mechanism: Mechanism) -> Reals:
    """Return for each drive the distance between adjacent knots [rad or m]."""
    _, slides, _ = drawn_drives(mechanism)
    return np.where(slides, mechanism.size / STRIDES_PER_SIZE, STRIDE)


@lru_cache(maxsize=64)
def drawn_drives(mechanism: Mechanism) -> tuple[list[float], Flags, bool]:
    """Return the drawn drive coordinates, whether each drive is a slider, and whether positions repeat every full turn.

    Positions do not repeat if a joint without drive drives a gear, because a full turn of this joint moves the
    follower.
    """
    drawing = Drawing(mechanism)
    joints = structure(mechanism).joints
    drawn = [0.0] * len(mechanism.drives)
    slides = np.zeros(len(mechanism.drives), bool)
    for joint in joints:
        if joint.drive is not None:
            drawn[joint.drive], slides[joint.drive] = drawing.coordinate(joint), not joint.turns
    return drawn, slides, not structure(mechanism).measured_drivers
