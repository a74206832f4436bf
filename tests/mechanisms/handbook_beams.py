"""Beams of the handbooks as mechanisms that do not move: cantilevers, beams on two supports."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rigid import Beam, Link, Mechanism, PinDrive, Slider, motion


def still(mechanism, positions=1):
    """A mechanism at rest, its drives held."""
    return motion(mechanism, np.zeros((len(mechanism.drives), positions)))


def line(points, mass=0.0, reverse=(), **more):
    """A link "beam" along x through points (names to places), one beam between neighbours."""
    names = list(points)
    ends = list(pairwise(names))
    ends = [end[::-1] if number in reverse else end for number, end in enumerate(ends)]
    return Link("beam", {name: complex(place) for name, place in points.items()},
                tuple(Beam(*end, mass) for end in ends), **more)  # fmt: skip


def cantilever(points, mass=0.0, loads=(), gravity=0.0, lumps=(), reverse=()):
    """Clamped where it begins: a link on a drive that holds."""
    link = line(points, mass, reverse, lumps=lumps)
    root = next(iter(points))
    ground = Link("ground", {root: complex(points[root])})
    return Mechanism((ground, link), (PinDrive("beam", root),), {n: complex(p) for n, p in points.items()},
                     gravity=gravity, loads=tuple(loads))  # fmt: skip


def supported(points, mass=0.0, loads=(), gravity=0.0, rollers=None, pinned=None, reverse=()):
    """Pinned where it begins, or at another point; on rollers along x elsewhere, at its end unless told."""
    names = list(points)
    pinned = pinned or names[0]
    rollers = rollers or [names[-1]]
    ground = Link("ground", {pinned: complex(points[pinned])})
    return _held(ground, points, line(points, mass, reverse), rollers, (), loads, gravity)


def propped(points, mass=0.0, loads=(), gravity=0.0, rollers=(), reverse=()):
    """In a guide along x where it begins, which lets it neither turn nor sink; pinned at its end."""
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
