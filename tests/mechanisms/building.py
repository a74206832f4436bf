"""Building blocks of the mechanisms, and the cases that move them."""

import math

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import RIGID, Section
from rigid import Beam, LineLoad, Link, Lump, Mechanism, PointLoad, motion, position_of

GRAVITY = -9.81j


class Case(Struct, frozen=True, eq=False):
    """A mechanism, the sections of its beams, and reachable drive coordinates with their rates."""

    mechanism: Mechanism
    sections: tuple[Section, ...]
    drive: np.ndarray
    rate: np.ndarray
    rate2: np.ndarray

    def with_(self, **changes):
        return replace(self, mechanism=replaced(self.mechanism, **changes))


def motion_of(case):
    """Return the motion of a case at its own coordinates and rates."""
    return motion(case.mechanism, case.drive, case.rate, case.rate2)


def at_speed(mechanism, speed, start=0.0):
    """Return the motion at constant speed of the drive as a function of time."""
    return lambda time: motion(mechanism, start + speed * np.asarray(time), speed, 0.0, time)


def require_closed_loops(course, tolerance=1e-13):
    """Require that links with a common point agree on its position."""
    for one in course.mechanism.links:
        for other in course.mechanism.links:
            for point in set(one.points) & set(other.points):
                gap = position_of(course, one.name, point) - position_of(course, other.name, point)
                assert np.abs(gap).max() < tolerance


def replaced(mechanism, **changes):
    """Return a copy with changed fields; the constructor sets `index`."""
    names = ("links", "drives", "drawing", "sliders", "gravity", "loads", "gears")
    return Mechanism(**{name: changes.get(name, getattr(mechanism, name)) for name in names})


def with_link(mechanism, *links):
    """Return the mechanism with each given link in place of the link of the same name."""
    new = {link.name: link for link in links}
    return replaced(mechanism, links=tuple(new.get(link.name, link) for link in mechanism.links))


def with_lump(mechanism, link, *lumps):
    """Return the mechanism with further lumps on a link."""
    old = mechanism.links[mechanism.index[link]]
    return with_link(mechanism, replace(old, lumps=(*old.lumps, *lumps)))


def scaled(mechanism, size):
    """Return the mechanism enlarged `size` times, without mass and loads."""
    links = tuple(
        replace(link, points={name: place * size for name, place in link.points.items()}, beams=(), lumps=())
        for link in mechanism.links
    )
    sliders = tuple(replace(slider, origin=slider.origin * size) for slider in mechanism.sliders)
    drawing = {name: place * size for name, place in mechanism.drawing.items()}
    return replaced(mechanism, links=links, sliders=sliders, drawing=drawing, loads=())


def apex(first, second, long, short, side=1.0):
    """Return the intersection of circles about `first` and `second`, left of the line between them if side is +1."""
    line = second - first
    x = (abs(line) ** 2 + long**2 - short**2) / (2 * abs(line))
    return first + line / abs(line) * (x + 1j * side * math.sqrt(long**2 - x**2))


def bar(name, start, end, length, mass_per_length=0.5, **more):
    """Return a link with one beam."""
    return Link(name, {start: 0.0, end: length}, (Beam(start, end, mass_per_length),), **more)


def steel_bar(name, start, end, length):
    """Return a steel bar, 10 mm wide and 6 mm deep."""
    return bar(name, start, end, length, 7850 * 0.01 * 0.006)


def turn(count, start=0.0):
    """Return evenly spaced angles of one turn, without the end."""
    return start + np.arange(count) * (2 * math.pi / count)


def moved(mechanism, sections, drive, rate=7.0, rate2=-3.0):
    drive = np.atleast_2d(drive)
    return Case(mechanism, tuple(sections), drive, np.full(drive.shape, rate), np.full(drive.shape, rate2))


def sections_of(mechanism, EA=3e5, EI=40.0):
    """Return a different section for each beam."""
    return [Section(EA * (1 + 0.3 * k), EI * (1 + 0.2 * k)) for k in range(len(mechanism.beams))]


def rigid_sections(case):
    """Return the case with rigid beams."""
    return replace(case, sections=(RIGID,) * len(case.sections))


def lumps(point, size=1.0):
    """Return an eccentric mass at a point, with its own inertia."""
    return (Lump(point, 0.3 * size, 2e-3 * size, (0.02 + 0.03j) * size),)


def loads(link, point):
    """Return one load of each kind, on a point of a link and on the link's first beam."""
    return (
        PointLoad(link, point, force=30 - 20j, moment=1.5),
        PointLoad(link, point, force=-12 + 8j, moment=-0.5, turning=True),
        LineLoad(link, 0, 40 - 30j, -15 + 60j),
        LineLoad(link, 0, -25 + 10j, 35 + 20j, turning=True),
    )
