"""A mechanism as bodies and ties: every beam a body clamped to its own axes, welds and joints between their ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rigid import Link, MechanismError, Motion, PinDrive, Slider, position_of

Row = tuple[Any, float]
"""A condition on a tie, by what keeps it: a force of unit length on the child, complex, and whether a moment."""

WELD: tuple[Row, ...] = ((1.0, 0.0), (1j, 0.0), (0.0, 1.0))
PIN = WELD[:2]
NO_TURN = WELD[2:]


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
    """A point of a body: an end of it (`tip`: the far one) and the arm from that end, in the ground's axes [m]."""

    body: int
    tip: bool = False
    arm: Any = 0.0


@dataclass(frozen=True, eq=False)
class Tie:
    """What keeps the displacement of `child` equal to that of `parent` (None: the ground), row by row."""

    name: str
    parent: Place | None
    child: Place | None
    rows: tuple[Row, ...]
    drive: int | None = None


class Frame:
    """Bodies of a mechanism and the places of its points; the beams come first, in the order of `Mechanism.beams`.

    Raises
    ------
    MechanismError
        The beams of a link do not hang together; asked for the place of a point that none of them reaches.
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
            self.ends.setdefault((at, beam.end), []).append(Place(number, tip=True))
        for at, link in enumerate(links):
            if at and not link.beams:
                self.root[at] = len(self.bodies)
                self.bodies.append(Body(at, 0.0))
            _refuse_pieces(link)

    def place(self, at: int, point: str) -> Place | None:
        """A link's point that carries something: an end of a beam, or any point of a link without beams."""
        if (at, point) in self.ends:
            return self.ends[at, point][0]
        link = self.motion.mechanism.links[at]
        if at and link.beams:
            raise MechanismError(
                f'link "{link.name}": no beam reaches the point "{point}", which carries a joint or a load'
            )
        return self.carried(at, self.motion.direction[at] * link.points[point])

    def carried(self, at: int, arm: Any) -> Place | None:
        """What moves with a link without beams; `arm` from the origin of the link's axes, in the ground's."""
        return Place(self.root[at], arm=arm) if at else None

    def ties(self) -> Iterator[Tie]:
        """Welds of the beams, pins, sliders and locked drives."""
        mechanism = self.motion.mechanism
        for (_, point), (hub, *others) in self.ends.items():
            yield from (Tie(point, hub, other, WELD) for other in others)
        shared: dict[str, list[int]] = {}
        for at, link in enumerate(mechanism.links):
            for point in link.points:
                shared.setdefault(point, []).append(at)
        for point, (first, *links) in shared.items():
            yield from (Tie(point, self.place(first, point), self.place(at, point), PIN) for at in links)
        sliders = {slider.name: slider for slider in mechanism.sliders}
        for slider in mechanism.sliders:
            along = self._along(slider)
            yield Tie(slider.name, *self._sides(slider), ((1j * along, 0.0), *NO_TURN))
        for number, drive in enumerate(mechanism.drives):
            if isinstance(drive, PinDrive):
                parent, child = (self.place(mechanism.index[name], drive.at) for name in (drive.on, drive.link))
                yield Tie(drive.at, parent, child, NO_TURN, number)
            else:
                slider = sliders[drive.slider]
                yield Tie(slider.name, *self._sides(slider), ((self._along(slider), 0.0),), number)

    def _along(self, slider: Slider) -> Any:
        """Unit vector of a slider's line, in the ground's axes."""
        return self.motion.direction[self.motion.mechanism.index[slider.on]] * slider.direction

    def _sides(self, slider: Slider) -> tuple[Place | None, Place | None]:
        """Where the point is now: on the owner of the line, and on the link that slides."""
        owner, link = (self.motion.mechanism.index[name] for name in (slider.on, slider.link))
        arm = position_of(self.motion, link, slider.point) - self.motion.origin[owner]
        return self.carried(owner, arm), self.place(link, slider.point)


def _refuse_pieces(link: Link) -> None:
    """Raise where the beams of a link are not all reached from the first."""
    waiting = [{beam.start, beam.end} for beam in link.beams]
    reached = set(waiting[0]) if waiting else set()
    for _ in link.beams:
        reached.update(*(ends for ends in waiting if ends & reached))
    if any(not ends & reached for ends in waiting):
        raise MechanismError(f'link "{link.name}": its beams do not hang together')
