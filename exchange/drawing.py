"""A mechanism as drawing programs store it: points, links, joints, drives, masses and forces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import copysign

GROUND = "ground"


class ExchangeError(ValueError):
    """The file has another format, is damaged, or contains no mechanism."""


@dataclass(frozen=True)
class ForeignLink:
    """A link.

    Attributes
    ----------
    points
        Their names.
    mass
        [kg]; None if unknown.
    center
        Centre of mass in the drawing; that of a uniform bar if not given.
    inertia
        Moment of inertia about the centre of mass [kg m^2]; that of a uniform bar if not given.
    rigid
        True if the link is rigid.
    braces
        Additional beams; there is already a beam from each point to the next.
    """

    points: tuple[str, ...]
    mass: float | None = None
    center: complex | None = None
    inertia: float | None = None
    rigid: bool = False
    braces: tuple[tuple[str, str], ...] = ()

    def with_beam(self, start: str, end: str) -> ForeignLink:
        """Return the link with an additional beam between two points, so that a slot can load it."""
        neighbours = abs(self.points.index(start) - self.points.index(end)) == 1
        known = neighbours or {(start, end), (end, start)} & {*self.braces}
        return self if known else replace(self, braces=(*self.braces, (start, end)))


@dataclass(frozen=True)
class Slot:
    """The pin `point` of `link` in a straight slot of `on`, along `direction` as drawn.

    `travel` is the range of the pin along the slot, measured from its position as drawn; (0, 0) if unknown.
    """

    point: str
    link: str
    on: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class ForeignSlider:
    """`link` slides on `on` along a line through `through` in `direction`, without turning; for `travel` see `Slot`."""

    link: str
    on: str
    through: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Drive:
    """Motion of a joint: constant speed, or a law that repeats.

    Attributes
    ----------
    joint
        Keys of the drive in a scene: `link`, `on` and `at` of a pin, or `slider`.
    speed
        Speed with its unit, such as "30 rpm"; None if there is a law.
    law
        Segments as in a scene, with the keys curve, duration and by.
    start
        Initial angle, such as "0 deg", of a wheel that is drawn as a single point.
    """

    joint: Mapping[str, str]
    speed: str | None = None
    law: tuple[Mapping[str, str], ...] = ()
    start: str = ""

    @property
    def strokes(self) -> list[float]:
        """Strokes of a law."""
        return [float(segment["by"].split()[0]) for segment in self.law]

    @property
    def mean_speed(self) -> float:
        """Constant speed, or mean speed of a law with the sign of its first stroke."""
        if self.speed is not None:
            return float(self.speed.split()[0])
        duration = sum(float(segment["duration"].split()[0]) for segment in self.law)
        unit = 6.0 if self.law[0]["by"].endswith("deg") else 1.0  # degrees a second in rpm
        return copysign(sum(map(abs, self.strokes)) / duration / unit, self.strokes[0])


@dataclass(frozen=True)
class ForeignGear:
    """Joints of two wheels, the ratio of the second wheel's angle to the first's, and whether teeth mesh."""

    driver: Mapping[str, str]
    follower: Mapping[str, str]
    ratio: float
    teeth: bool


@dataclass(frozen=True)
class ForeignLoad:
    """A force [N] at a point of a link; a turning one rotates with the link."""

    link: str
    point: str
    force: complex
    turning: bool = False


@dataclass(frozen=True)
class ForeignMechanism:
    """A mechanism, defined by its drawing.

    Attributes
    ----------
    title, source
        Title of the scene, and name of the program.
    unit
        Unit of all lengths: "m", "cm", "mm" or "in".
    points
        Positions as drawn, by the names that the scene uses.
    ground, links
        Points of the fixed link, and the moving links by name.
    slots, slides
        By name.
    drives, gears, loads
        In the order of the file.
    traced
        Point that the user traces, or "".
    masses
        Point masses at joints [kg].
    gravity
        Whether gravity acts, along -y.
    notes
        Sentences that state assumptions and omissions.
    """

    title: str
    source: str
    unit: str
    points: Mapping[str, complex]
    ground: tuple[str, ...]
    links: Mapping[str, ForeignLink]
    slots: Mapping[str, Slot] = field(default_factory=dict)
    slides: Mapping[str, ForeignSlider] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    gears: tuple[ForeignGear, ...] = ()
    traced: str = ""
    masses: Mapping[str, float] = field(default_factory=dict)
    loads: tuple[ForeignLoad, ...] = ()
    gravity: bool = False
    notes: tuple[str, ...] = ()


MIN_HEIGHT = 1e-3  # points that are closer to a line, relative to its length, are in line


def with_closed_frames(drawing: ForeignMechanism) -> ForeignMechanism:
    """Return the drawing with a beam from the last to the first point of each link, except straight ones.

    Other programs draw such a link as a plate. A note names the links.
    """
    links = dict(drawing.links)
    for name, body in drawing.links.items():
        places = [drawing.points[point] - drawing.points[body.points[0]] for point in body.points]
        longest = max(places, key=abs)
        heights = [abs((place * longest.conjugate()).imag) for place in places]
        if max(heights) > MIN_HEIGHT * abs(longest) ** 2:
            links[name] = body.with_beam(body.points[-1], body.points[0])
    closed = ", ".join(name for name, body in links.items() if body is not drawing.links[name])
    note = (f"assumed: beams along the outline of {closed}",) if closed else ()
    return replace(drawing, links=links, notes=(*drawing.notes, *note))


class Names:
    """Unique scene names (letters, digits, - and _) for the names or numbers in a file."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._names: dict[str, str] = {}
        self._taken = set(taken)

    def __call__(self, key: object, wanted: str = "") -> str:
        """Return the scene name of `key`; the first call derives it from `wanted`."""
        known = str(key)
        if known not in self._names:
            plain = re.sub(r"[^A-Za-z0-9_-]+", "_", wanted or known).strip("_") or "x"
            name, number = plain, 2
            while name in self._taken:
                name, number = f"{plain}_{number}", number + 1
            self._taken.add(name)
            self._names[known] = name
        return self._names[known]


def link_with(links: Mapping[str, ForeignLink], *points: str) -> str | None:
    """Return the first link that has all the points, or None."""
    return next((name for name, body in links.items() if {*points} <= {*body.points}), None)


def to_and_fro(ways: Iterable[float], speed: float, unit: str) -> tuple[dict[str, str], ...]:
    """Segments of a law that makes the strokes `ways`, each from rest to rest.

    `speed` is the mean speed in `unit` per second.
    """
    return tuple(
        {"curve": "harmonic", "duration": f"{abs(way) / speed:.12g} s", "by": f"{way:.12g} {unit}"}
        for way in ways
        if way
    )
