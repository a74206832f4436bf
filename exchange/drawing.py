"""Mechanism as stored by drawing programs: points, links, joints, drives, masses and forces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import copysign

GROUND = "ground"


class ExchangeError(ValueError):
    """Raised if a file has another format, is damaged, or contains no mechanism."""


@dataclass(frozen=True)
class ForeignLink:
    """Link of a drawing.

    Attributes
    ----------
    points
        Names of its points.
    mass
        Mass [kg], or None if unknown.
    center
        Centre of mass in drawing coordinates; None for that of a uniform bar.
    inertia
        Moment of inertia about the centre of mass [kg m^2]; None for that of a uniform bar.
    rigid
        True if the link is rigid.
    braces
        Beams in addition to those from each point to the next.
    """

    points: tuple[str, ...]
    mass: float | None = None
    center: complex | None = None
    inertia: float | None = None
    rigid: bool = False
    braces: tuple[tuple[str, str], ...] = ()

    def with_beam(self, start: str, end: str) -> ForeignLink:
        """Return the link with a beam between two points, which a slot between them needs."""
        neighbours = abs(self.points.index(start) - self.points.index(end)) == 1
        known = neighbours or {(start, end), (end, start)} & {*self.braces}
        return self if known else replace(self, braces=(*self.braces, (start, end)))


@dataclass(frozen=True)
class Slot:
    """Straight slot of the link `on`, in which the pin `point` of `link` moves.

    `direction` is that of the slot in the drawing. `travel` is the range of the pin along the slot, relative to its
    drawn position, or (0, 0) if unknown.
    """

    point: str
    link: str
    on: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class ForeignSlider:
    """Slider: `link` slides on `on` without rotation, along the line through the point `through` in `direction`.

    For `travel` see `Slot`.
    """

    link: str
    on: str
    through: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Drive:
    """Motion of a joint, with constant speed or by a repeated law.

    Attributes
    ----------
    joint
        Keys of the drive in a scene, which are `link`, `on` and `at` for a pin, or `slider`.
    speed
        Speed with its unit, such as "30 rpm", or None if there is a law.
    law
        Segments of the law as in a scene, with the keys curve, duration and by.
    start
        Initial angle, such as "0 deg", needed for a wheel that is drawn as a single point.
    """

    joint: Mapping[str, str]
    speed: str | None = None
    law: tuple[Mapping[str, str], ...] = ()
    start: str = ""

    @property
    def strokes(self) -> list[float]:
        """Strokes of the law."""
        return [float(segment["by"].split()[0]) for segment in self.law]

    @property
    def mean_speed(self) -> float:
        """Constant speed, or mean speed of the law with the sign of its first stroke."""
        if self.speed is not None:
            return float(self.speed.split()[0])
        duration = sum(float(segment["duration"].split()[0]) for segment in self.law)
        unit = 6.0 if self.law[0]["by"].endswith("deg") else 1.0  # degrees per second for 1 rpm
        return copysign(sum(map(abs, self.strokes)) / duration / unit, self.strokes[0])


@dataclass(frozen=True)
class ForeignGear:
    """Gear: joints of two wheels, ratio of the second angle to the first, and whether the teeth mesh."""

    driver: Mapping[str, str]
    follower: Mapping[str, str]
    ratio: float
    teeth: bool


@dataclass(frozen=True)
class ForeignLoad:
    """Force at a point of a link [N]. If `turning` is True, it rotates with the link."""

    link: str
    point: str
    force: complex
    turning: bool = False


@dataclass(frozen=True)
class ForeignMechanism:
    """Mechanism that is defined by its drawing.

    Attributes
    ----------
    title, source
        Title of the scene, and name of the program.
    unit
        Unit of all lengths: "m", "cm", "mm" or "in".
    points
        Drawn positions by name; the names are those of the scene.
    ground, links
        Points of the fixed link, and moving links by name.
    slots, slides
        Slots and sliders by name.
    drives, gears, loads
        Drives, gears and loads in the order of the file.
    traced
        Point with a traced path, or "".
    masses
        Point masses at joints [kg].
    gravity
        True if gravity acts along -y.
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


MIN_HEIGHT = 1e-3  # points closer to a line than this are on it; relative to the length of the line


def with_closed_frames(drawing: ForeignMechanism) -> ForeignMechanism:
    """Return the drawing with a beam from the last to the first point of each link that is not straight.

    Other programs draw such a link as a plate. A note lists the links.
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
    """Unique scene names (letters, digits, - and _) for names or numbers in a file."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._names: dict[str, str] = {}
        self._taken = set(taken)

    def __call__(self, key: object, wanted: str = "") -> str:
        """Return the scene name of `key`, which the first call derives from `wanted`."""
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
    """Return the first link that contains all the points, or None."""
    return next((name for name, body in links.items() if {*points} <= {*body.points}), None)


def to_and_fro(ways: Iterable[float], speed: float, unit: str) -> tuple[dict[str, str], ...]:
    """Return the segments of a law with the strokes `ways`, each from rest to rest.

    `speed` is the mean speed in `unit` per second.
    """
    return tuple(
        {"curve": "harmonic", "duration": f"{abs(way) / speed:.12g} s", "by": f"{way:.12g} {unit}"}
        for way in ways
        if way
    )
