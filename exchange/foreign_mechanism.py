"""Mechanism for import or export: points, links, joints, drives, masses and forces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import copysign

from msgspec import Struct, field
from msgspec.structs import replace

GROUND = "ground"


class ExchangeError(ValueError):
    """Error of an import or export, such as a damaged file or a part that a program does not support."""


class ForeignLink(Struct, frozen=True):
    """Link of an imported or exported mechanism.

    Attributes
    ----------
    points
        Names of the points of the link.
    mass
        Mass [kg], or None if unknown.
    center
        Centre of mass in the coordinates of the drawing; None if the link consists of uniform bars.
    inertia
        Moment of inertia about the centre of mass [kg m^2]; None if the link consists of uniform bars.
    rigid
        True if the link is rigid.
    braces
        Pairs of point names, each for a beam. Further beams go from each point of `points` to the next point.
    """

    points: tuple[str, ...]
    mass: float | None = None
    center: complex | None = None
    inertia: float | None = None
    rigid: bool = False
    braces: tuple[tuple[str, str], ...] = ()

    def with_beam(self, start: str, end: str) -> ForeignLink:
        """Return the link with a beam between two of its points, for example along a slot."""
        neighbours = abs(self.points.index(start) - self.points.index(end)) == 1
        known = neighbours or {(start, end), (end, start)} & {*self.braces}
        return self if known else replace(self, braces=(*self.braces, (start, end)))


class Slot(Struct, frozen=True):
    """Straight slot in the link `on`. The pin at `point` of `link` moves in the slot.

    `direction` is the direction of the slot in the coordinates of the drawing. `travel` contains the smallest and
    largest displacement of the pin along the slot, measured from the drawn position of the pin. An unknown `travel` is
    (0, 0).
    """

    point: str
    link: str
    on: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


class ForeignSlider(Struct, frozen=True):
    """Slider: `link` slides on the link `on` along a straight line, without relative rotation.

    The line passes through the point `through` in the direction `direction`. `travel` contains the smallest and largest
    displacement of `link` along the line, measured from its drawn position. An unknown `travel` is (0, 0).
    """

    link: str
    on: str
    through: str
    direction: complex
    travel: tuple[float, float] = (0.0, 0.0)


class Drive(Struct, frozen=True):
    """Motion of a driven joint: a constant speed, or a motion law that is repeated.

    Attributes
    ----------
    joint
        The driven joint as in a scene file: a pin has the keys `link`, `on` and `at`, a slider has the key `slider`.
    speed
        Speed with its unit, such as "30 rpm", or None if there is a law.
    law
        Segments of the motion law as in a scene file, with the keys `curve`, `duration` and `by` (the stroke). A dwell
        has no key `by`.
    start
        Initial angle, such as "0 deg". It must be given for a wheel with a single point, because a single point does
        not show an angle.
    """

    joint: Mapping[str, str]
    speed: str | None = None
    law: tuple[Mapping[str, str], ...] = ()
    start: str = ""

    @property
    def strokes(self) -> list[float]:
        """Strokes of the motion law without its dwells, in the unit of the key `by`."""
        return [float(segment["by"].split()[0]) for segment in self._moving]

    @property
    def _moving(self) -> list[Mapping[str, str]]:
        """Segments of the law that are not dwells."""
        return [segment for segment in self.law if "by" in segment]

    @property
    def mean_speed(self) -> float:
        """Constant speed, or (sum of |stroke|) / (duration of all strokes) with the sign of the first stroke.

        A constant speed is in the unit of `speed`. The mean speed of a law is in rpm if the strokes are in degrees, and
        otherwise in (unit of the strokes) per second. The mean speed of a law without strokes is 0.
        """
        if self.speed is not None:
            return float(self.speed.split()[0])
        if not self._moving:
            return 0.0
        duration = sum(float(segment["duration"].split()[0]) for segment in self._moving)
        unit = 6.0 if self._moving[0]["by"].endswith("deg") else 1.0  # 1 rpm is 6 degrees per second
        return copysign(sum(map(abs, self.strokes)) / duration / unit, self.strokes[0])


class ForeignGear(Struct, frozen=True):
    """Gear between two wheels, which turn about the joints `driver` and `follower`.

    `ratio` is (angle of the follower) / (angle of the driver). `teeth` is True if the wheels mesh with teeth, and False
    for a chain or an ideal gear.
    """

    driver: Mapping[str, str]
    follower: Mapping[str, str]
    ratio: float
    teeth: bool


class ForeignLoad(Struct, frozen=True):
    """Force at a point of a link [N]. If `turning` is True, the force rotates with the link."""

    link: str
    point: str
    force: complex
    turning: bool = False


class ForeignMechanism(Struct, frozen=True):
    """Mechanism for import or export. It is also called the drawing, because the geometry is given by drawn points.

    Attributes
    ----------
    title, source
        Title of the scene, and name of the program.
    unit
        Unit of all lengths: "m", "cm", "mm" or "in".
    points
        Drawn position of each point, by the name of the point in the scene file.
    ground, links
        Points of the fixed link, and moving links by name.
    slots, slides
        Slots and sliders by name.
    drives, gears, loads
        Drives, gears and loads in the order of the file.
    traced
        Name of the point with a drawn path; "" if there is none.
    masses
        Point masses [kg] at joints, by point name.
    gravity
        True if gravity acts along -y.
    notes
        Messages about assumptions of the import, and about parts of the file that are not imported.
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


# A link is straight if all points are near the line from the first point to the farthest point. The allowed distance
# from this line is MIN_HEIGHT * (length of the line).
MIN_HEIGHT = 1e-3


def with_closed_frames(drawing: ForeignMechanism) -> ForeignMechanism:
    """Return the mechanism with closed frames: add a beam from the last to the first point of each non-straight link.

    Other programs draw a link with several points as a plate. A note of the mechanism names the links with an added
    beam.
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
    """Unique names for a scene file (letters, digits, - and _), derived from names or numbers in an imported file."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._names: dict[str, str] = {}
        self._taken = set(taken)

    def __call__(self, key: object, wanted: str = "") -> str:
        """Return the unique name for `key`.

        The first call with a key derives the name from `wanted`, or from the key if `wanted` is empty. All later calls
        with this key return the same name.
        """
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
    """Return the name of the first link that contains all the points, or None."""
    return next((name for name, body in links.items() if {*points} <= {*body.points}), None)


def to_and_fro(strokes: Iterable[float], speed: float, unit: str) -> tuple[dict[str, str], ...]:
    """Return the segments of a motion law with the given strokes.

    Each stroke starts and ends at rest. Zero strokes are left out.

    `speed` is the mean speed of each stroke, in `unit` per second.
    """
    return tuple(
        {"curve": "harmonic", "duration": f"{abs(stroke) / speed:.12g} s", "by": f"{stroke:.12g} {unit}"}
        for stroke in strokes
        if stroke
    )
