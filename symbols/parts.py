"""Symbols of drives, springs, wheels, loads, masses and cylinders."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigid import GROUND
from rigid.teeth import pitch_reach
from symbols.marks import ACCENT, GROUND_LEVEL, LINK, LOAD, NONE, OVER, PAPER, SOFT, UNDER, Anchor, Line, Mark

DRIVE = "drive"
"""Mark kind of the arrows at drives."""
MASS = "mass"
"""Mark kind of the discs at point masses."""
ROLLER = "roller"
"""Mark kind of the circles of rollers on cams."""
TURN = np.linspace(-0.4, 3.7, 33)  # [rad] angles of the points of the arrow around a driven pin
TURN_RADIUS = 2.2
HEAD = np.array([0.0, -1.1 + 0.45j, -1.1 - 0.45j])  # corners of an arrow head that points to the right
COILS = 8
LOAD_LENGTH, TURN_COILS = 6.0, 2.2  # length of a force arrow [symbol sizes], and number of turns of a torsion spring
BARREL = np.array([-0.7j, -0.7j, 0.7j, 0.7j])  # corners of a barrel: offsets perpendicular to the cylinder axis


def turn_arrow(at: Anchor, drive: int | None) -> Mark:
    """Return an arrow around a driven pin."""
    arc = TURN_RADIUS * np.exp(1j * TURN)
    return _arrow(DRIVE, at, arc, 1j * np.exp(3.55j), ACCENT, drive=drive)


def slide_arrow(at: Anchor, on: str, direction: complex, drive: int | None) -> Mark:
    """Return an arrow in front of a driven block."""
    return _arrow(DRIVE, at, np.array([2.0, 5.4], complex), 1.0, ACCENT, drive=drive, axis=(on, direction))


def arrow(at: Anchor, axis: tuple[str, complex], x_axis_of: Callable[[Any], Any] | None = None) -> Mark:
    """Return the arrow of a force along the x axis. For `axis` and `x_axis_of`, see `Mark`."""
    shaft = np.array([0.0, LOAD_LENGTH], complex)
    return _arrow("load", at, shaft, 1.0, LOAD, axis=axis, x_axis_of=x_axis_of)


def _arrow(kind: str, at: Anchor, shaft: Any, direction: complex, colour: str, **more: Any) -> Mark:
    """Return a line with a filled arrow head. The line runs to its end and back, so it encloses no area."""
    lines = Line(np.concatenate([shaft, shaft[::-1]])), Line(shaft[-1] + direction * HEAD, closed=True)
    return Mark(kind, at, lines, stroke=colour, fill=colour, width=1.8, level=OVER, **more)


def spring(at: Anchor, to: Anchor) -> Mark:
    """Return a zigzag between two points."""
    inner = (np.arange(2 * COILS) + 0.5) / (2 * COILS)
    share = np.concatenate([[0.0, 0.15], 0.15 + 0.7 * inner, [0.85, 1.0]])
    aside = 0.75j * np.concatenate([[0, 0], np.tile([1, -1], COILS), [0, 0]])
    return Mark("spring", at, (Line(aside, share=share),), to=to)


def torsion_spring(at: Anchor) -> Mark:
    """Return a spiral about a pin."""
    turn = np.linspace(0.0, 2 * np.pi * TURN_COILS, 41)
    return Mark("spring", at, (Line((0.8 + 0.155 * turn) * np.exp(1j * turn)),))


def wheels_of_pair(pins: tuple[Anchor, Anchor], links: tuple[str, str], apart: complex, ratio: float) -> list[Mark]:
    """Return the pitch circles of two wheels, each with a spoke.

    Parameters
    ----------
    pins
        Centres of the driving and the driven wheel.
    links
        Links of the wheels.
    apart
        Vector from the centre of the driving wheel to the centre of the driven wheel [m].
    ratio
        (Rate of the driven wheel) / (rate of the driving wheel). Both rates are relative to the carrier, i.e. the link
        that contains both centres.
    """
    radius = abs(complex(pitch_reach(np.asarray(apart), np.asarray(ratio))))
    return [wheel(*each) for each in zip(pins, links, (abs(ratio) * radius, radius), strict=True)]


def wheel(at: Anchor, link: str, radius: float) -> Mark:
    """Return a pitch circle with a spoke that rotates with a link."""
    spoke = () if link == GROUND else (Line(offset=np.array([0.0, radius])),)
    return Mark("wheel", at, spoke, (0.0, radius), axis=(link, 1.0), stroke=LINK, dashed=True, level=UNDER)


def belt(at: Anchor, to: Anchor) -> Mark:
    """Return a line between the two bodies of a gear. It is used for gears without pitch circles."""
    return Mark("belt", at, (Line(share=np.array([0.0, 1.0])),), to=to, stroke=SOFT, width=1.6, dashed=True)


def mass(at: Anchor) -> Mark:
    """Return the symbol of a point mass: a disc behind the pin."""
    return Mark(MASS, at, radius=(1.35, 0.0), stroke=NONE, fill=SOFT, level=GROUND_LEVEL)


def cylinder(at: Anchor, to: Anchor, length: float, slider: str) -> list[Mark]:
    """Return the symbol of a cylinder: a barrel at the point `at`, and a rod at the point `to`.

    Parameters
    ----------
    length
        Distance between the two points as drawn [m].
    slider
        Name of the slider that these marks replace.
    """
    barrel = Line(BARREL + 0.8 * np.array([1, 0, 0, 1]), offset=0.62 * length * np.array([0, 1, 1, 0]), closed=True)
    neck = Line(np.array([0.0, 0.8]))
    piston = Line(np.array([-0.7j, 0.7j]), offset=-0.6 * length, share=1.0)
    rod = Line(offset=length * np.array([-0.6, 0.0]), share=1.0)
    return [
        Mark("barrel", at, (barrel, neck), to=to, fill=PAPER, width=2.0, replaces=slider),
        Mark("rod", at, (piston, rod), to=to, width=3.5),
    ]
