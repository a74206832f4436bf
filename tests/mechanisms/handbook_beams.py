"""Handbook beams as mechanisms at rest: cantilevers and beams on two supports."""

from itertools import pairwise

import numpy as np

from rigid import Beam, Link, Mechanism, PinDrive, Slider, motion


def still(mechanism, positions=1):
    """Return the motion of a mechanism at rest, with its drives held."""
    return motion(mechanism, np.zeros((len(mechanism.drives), positions)))


def line(points, mass=0.0, reverse=(), **more):
    """Return a link "beam" along x through named points, with a beam between neighbours."""
    names = list(points)
    ends = list(pairwise(names))
    ends = [end[::-1] if number in reverse else end for number, end in enumerate(ends)]
    return Link("beam", {name: complex(place) for name, place in points.items()},
                tuple(Beam(*end, mass) for end in ends), **more)  # fmt: skip


def cantilever(points, mass=0.0, loads=(), gravity=0.0, lumps=(), reverse=()):
    """Return a link that is clamped at its start by a drive."""
    link = line(points, mass, reverse, lumps=lumps)
    root = next(iter(points))
    ground = Link("ground", {root: complex(points[root])})
    return Mechanism((ground, link), (PinDrive("beam", root),), {n: complex(p) for n, p in points.items()},
                     gravity=gravity, loads=tuple(loads))  # fmt: skip


def supported(points, mass=0.0, loads=(), gravity=0.0, rollers=None, pinned=None, reverse=()):
    """Return a beam with one pin, by default at its start, and rollers along x, by default at its end."""
    names = list(points)
    pinned = pinned or names[0]
    rollers = rollers or [names[-1]]
    ground = Link("ground", {pinned: complex(points[pinned])})
    return _held(ground, points, line(points, mass, reverse), rollers, (), loads, gravity)


def propped(points, mass=0.0, loads=(), gravity=0.0, rollers=(), reverse=()):
    """Return a beam that is guided along x at its start, without rotation, and pinned at its end."""
    start, end = next(iter(points)), list(points)[-1]
    ground = Link("ground", {end: complex(points[end])})
    guide = Slider("guide", "beam", "ground", start, origin=complex(points[start]), direction=1.0)
    return _held(ground, points, line(points, mass, reverse), rollers, (guide,), loads, gravity)


def _held(ground, points, link, rollers, guides, loads, gravity):
    blocks = [Link(f"block {name}", {name: 0.0}) for name in rollers]
    sliders = [
        Slider(f"roller {name}", f"block {name}", "ground", name, origin=complex(points[name]), direction=1.0)
        for name in rollers
    ]
    return Mechanism(
        (ground, link, *blocks), (), {name: complex(place) for name, place in points.items()},
        (*guides, *sliders), gravity=gravity, loads=tuple(loads),
    )  # fmt: skip
