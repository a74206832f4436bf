"""A mechanism as bodies: every beam is one, clamped to its own axes at its start; and where their points are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid import Link, MechanismError, Motion, Slider, position_of

LINED_UP = 1e-9  # sine of the angle, and distance over length, to which a beam lies along a slider's line
REACHED = 1e-12  # how far beyond a beam's end, in its lengths, a block counts as on it


@dataclass(frozen=True, eq=False)
class Body:
    """A beam, or a moving link without beams.

    `start` is its reference point and `way` leads from there to its other end, in the link's axes [m]; a link without
    beams has its own origin for the one and nothing for the other.
    """

    link: int
    start: Any
    way: Any = None


@dataclass(frozen=True, eq=False)
class Place:
    """A point of a body: its start, or one of the frame's `spots`, and the arm from there in the ground's axes [m]."""

    body: int
    spot: int | None = None
    arm: Any = 0.0


class Frame:
    """Bodies of a mechanism and the places of its points; the beams come first, in the order of `Mechanism.beams`.

    Attributes
    ----------
    bodies
        Beams, then links without.
    spots
        Where beams are moved by more than their axes: beam and xi, shape () or (..., positions). First the end of every
        beam, then the blocks of sliders on beams; nan where one is beyond its beam.

    Raises
    ------
    MechanismError
        The beams of a link do not hang together, or none carries a slider; asked for the place of a point that none of
        them reaches.
    """

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        links = motion.mechanism.links
        self.bodies: list[Body] = []
        self.root: dict[int, int] = {}
        self.ends: dict[tuple[int, str], list[Place]] = {}
        for number, (at, beam) in enumerate(motion.mechanism.beams):
            start, end = links[at].points[beam.start], links[at].points[beam.end]
            self.bodies.append(Body(at, start, end - start))
            self.root.setdefault(at, number)
            self.ends.setdefault((at, beam.start), []).append(Place(number))
            self.ends.setdefault((at, beam.end), []).append(Place(number, number))
        self.spots: list[tuple[int, Any]] = [(number, 1.0) for number in range(len(self.bodies))]
        for at, link in enumerate(links):
            if at and not link.beams:
                self.root[at] = len(self.bodies)
                self.bodies.append(Body(at, 0.0))
            _refuse_pieces(link)
        self.sides = {slider.name: self._sides(slider) for slider in motion.mechanism.sliders}

    def place(self, at: int, point: str) -> Place | None:
        """A link's point that carries something: an end of a beam, or any point of a link without beams."""
        if (at, point) in self.ends:
            return self.ends[at, point][0]
        link = self.motion.mechanism.links[at]
        if at and link.beams:
            raise MechanismError(
                f'link "{link.name}": no beam reaches the point "{point}", which carries a joint or a load'
            )
        return self._carried(at, self.motion.direction[at] * link.points[point])

    def along(self, slider: Slider) -> Any:
        """Unit vector of a slider's line, in the ground's axes."""
        return self.motion.direction[self.motion.mechanism.index[slider.on]] * slider.direction

    def _carried(self, at: int, arm: Any) -> Place | None:
        """What moves with a link without beams; `arm` from the origin of the link's axes, in the ground's."""
        return Place(self.root[at], arm=arm) if at else None

    def _sides(self, slider: Slider) -> tuple[Place | None, Place | None]:
        """Where the point is now: on the owner of the line, and on the link that slides."""
        motion = self.motion
        owner, link = (motion.mechanism.index[name] for name in (slider.on, slider.link))
        arm = position_of(motion, link, slider.point) - motion.origin[owner]
        if not motion.mechanism.links[owner].beams:
            return self._carried(owner, arm), self.place(link, slider.point)
        number = self._rail(slider, owner)
        body = self.bodies[number]
        xi = ((arm / motion.direction[owner] - body.start) / body.way).real
        on_beam = (xi >= -REACHED) & (xi <= 1 + REACHED)
        self.spots.append((number, np.where(on_beam, np.clip(xi, 0.0, 1.0), np.nan)))
        return Place(number, len(self.spots) - 1), self.place(link, slider.point)

    def _rail(self, slider: Slider, owner: int) -> int:
        """The first beam of a link that lies along a slider's line."""
        line = slider.direction
        for number, body in enumerate(self.bodies):
            if body.link == owner:
                size = np.abs(body.way)
                aside = np.abs((np.conj(line) * body.way).imag) / size
                off = np.abs((np.conj(line) * (slider.origin - body.start)).imag) / size
                if np.max(aside + off) <= LINED_UP:
                    return number
        raise MechanismError(f'slider "{slider.name}": no beam of "{slider.on}" lies along its line to carry it')


def _refuse_pieces(link: Link) -> None:
    """Raise where the beams of a link are not all reached from the first."""
    waiting = [{beam.start, beam.end} for beam in link.beams]
    reached = set(waiting[0]) if waiting else set()
    for _ in link.beams:
        reached.update(*(ends for ends in waiting if ends & reached))
    if any(not ends & reached for ends in waiting):
        raise MechanismError(f'link "{link.name}": its beams do not hang together')
