"""Mechanism as a frame of bodies.

Each beam is a body. The deflection of a beam is measured in axes that are clamped to the start of the beam.
"""

from typing import Any

import numpy as np
from msgspec import Struct

from rigid import Link, MechanismError, Motion, Slider, position_of
from rigid.arrays import Columns, Complexes

# largest misalignment of a beam with the line of a slider: (sine of the angle between them) + (distance of the beam's
# start from the line) / (length of the beam)
MAX_MISALIGNMENT = 1e-9
MAX_OVERSHOOT = 1e-12  # [beam lengths] a block that is beyond the end of a beam by at most this is on the beam


class FrameBody(Struct, frozen=True, eq=False):
    """Beam, or moving link without beams.

    Attributes
    ----------
    link
        Index of the link.
    start
        Reference point in link axes [m]: start of the beam, or 0 for a link without beams.
    way
        Vector from the start to the end of the beam in link axes [m]; None for a link without beams.
    """

    link: int
    start: Any
    way: Any = None


class FramePlace(Struct, frozen=True, eq=False):
    """Point of a body: its start, or one of `Frame.spots` if `spot` is given, plus the vector `arm` in ground axes [m].

    `body` and `spot` are indices.
    """

    body: int
    spot: int | None = None
    arm: Columns = 0.0


Side = FramePlace | None | tuple[tuple[FramePlace, Any], ...]
"""Location of a joint on a link.

None is the ground. A block that slides over several beams has a place on each of them, with the weight 1 at positions
at which the block is on this beam, and 0 at the others.
"""


class Frame:
    """Bodies of a mechanism, and the locations of its points.

    Attributes
    ----------
    bodies
        Beams in the order of `Mechanism.beams`, followed by links without beams.
    spots
        Points of beams at which deflections are computed. Each is given by the index of the beam, and xi of shape () or
        (..., positions). These are the end of each beam, followed by the blocks on beams. xi is nan at positions at
        which a block is beyond its beam.
    root
        Index of the first body of each link, by link index.
    ends
        Place on each beam that starts or ends at a point, by link index and point.
    sides
        Locations of the point of a slider on the guiding link and on the sliding link, by name of the slider.

    Raises
    ------
    MechanismError
        If the beams of a link are not connected, no beam carries a slider, or no beam reaches a requested point.
    """

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        links = motion.mechanism.links
        self.bodies: list[FrameBody] = []
        self.root: dict[int, int] = {}
        self.ends: dict[tuple[int, str], list[FramePlace]] = {}
        for number, (at, beam) in enumerate(motion.mechanism.beams):
            start, end = links[at].points[beam.start], links[at].points[beam.end]
            self.bodies.append(FrameBody(at, start, end - start))
            self.root.setdefault(at, number)
            self.ends.setdefault((at, beam.start), []).append(FramePlace(number))
            self.ends.setdefault((at, beam.end), []).append(FramePlace(number, number))
        self.spots: list[tuple[int, Any]] = [(number, 1.0) for number in range(len(self.bodies))]
        for at, link in enumerate(links):
            if at and not link.beams:
                self.root[at] = len(self.bodies)
                self.bodies.append(FrameBody(at, 0.0))
            _require_connected(link)
        self.sides = {slider.name: self._sides(slider) for slider in motion.mechanism.sliders}

    def place(self, at: int, point: str) -> FramePlace | None:
        """Return the place of a loaded point of a link: a beam end, or any point of a rigid link."""
        if (at, point) in self.ends:
            return self.ends[at, point][0]
        link = self.motion.mechanism.links[at]
        if at and link.beams:
            raise MechanismError(
                f'link "{link.name}": no beam reaches the point "{point}", which carries a joint or a load'
            )
        return self._carried(at, self.motion.direction[at] * link.points[point])

    def along(self, slider: Slider) -> Complexes:
        """Return the unit vector of the line of a slider in ground axes."""
        return self.motion.direction[self.motion.mechanism.index[slider.on]] * slider.direction

    def _carried(self, at: int, arm: Complexes) -> FramePlace | None:
        """Return a place on a link without beams; `arm` is the vector from the origin of the link in ground axes."""
        return FramePlace(self.root[at], arm=arm) if at else None

    def _sides(self, slider: Slider) -> tuple[Side, FramePlace | None]:
        """Return the locations of the point of a slider on the guiding link and on the sliding link."""
        motion = self.motion
        owner, link = (motion.mechanism.index[name] for name in (slider.on, slider.link))
        arm = position_of(motion, link, slider.point) - motion.origin[owner]
        if not motion.mechanism.links[owner].beams:
            return self._carried(owner, arm), self.place(link, slider.point)
        candidates: list[tuple[int, Any, Any]] = []
        carried: Any = False
        for number in self._rails(slider, owner):
            body = self.bodies[number]
            xi = ((arm / motion.direction[owner] - body.start) / body.way).real
            on_beam = (xi >= -MAX_OVERSHOOT) & (xi <= 1 + MAX_OVERSHOOT) & np.logical_not(carried)
            carried = carried | on_beam
            if np.any(on_beam) or not candidates:
                candidates.append((number, np.clip(xi, 0.0, 1.0), on_beam))
        if len(candidates) > 1 and not np.any(candidates[0][2]):
            del candidates[0]
        first = len(self.spots)
        self.spots += [(number, np.where(carried, xi, np.nan)) for number, xi, _ in candidates]
        places = [FramePlace(number, spot) for spot, (number, *_) in enumerate(candidates, first)]
        if len(places) == 1:
            return places[0], self.place(link, slider.point)
        shares = [on_beam.astype(float) for *_, on_beam in candidates]
        return tuple(zip(places, shares, strict=True)), self.place(link, slider.point)

    def _rails(self, slider: Slider, owner: int) -> list[int]:
        """Return the beams of a link along the line of a slider."""
        line, rails = slider.direction, []
        for number, body in enumerate(self.bodies):
            if body.link == owner:
                size = np.abs(body.way)
                aside = np.abs((np.conj(line) * body.way).imag) / size
                off = np.abs((np.conj(line) * (slider.origin - body.start)).imag) / size
                if np.max(aside + off) <= MAX_MISALIGNMENT:
                    rails.append(number)
        if not rails:
            raise MechanismError(f'slider "{slider.name}": no beam of "{slider.on}" lies along its line to carry it')
        return rails


def parts_on(side: Side, force: Columns, moment: Any) -> tuple[tuple[FramePlace | None, Columns, Columns], ...]:
    """Return the places of one side of a joint, each with its share of a force and a moment."""
    if isinstance(side, tuple):
        return tuple((place, share * force, share * moment) for place, share in side)
    return ((side, force, moment),)


def _require_connected(link: Link) -> None:
    """Raise MechanismError if the beams of a link are not connected."""
    waiting = [{beam.start, beam.end} for beam in link.beams]
    reached = set(waiting[0]) if waiting else set()
    for _ in link.beams:
        reached.update(*(ends for ends in waiting if ends & reached))
    if any(not ends & reached for ends in waiting):
        raise MechanismError(f'link "{link.name}": its beams are not connected')
