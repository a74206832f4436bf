"""Display list (list of marks) of a mechanism."""

from collections.abc import Iterable, Iterator
from functools import partial
from itertools import count
from typing import Any

import numpy as np

from rigid import GROUND, Mechanism, Motion, PinDrive, PointLoad, Resistance, SliderDrive, Spring, TorsionSpring
from rigid.arrays import Complexes
from rigid.joints import Placed
from symbols.joints import dot, pin, slider_marks, support, travel, weld
from symbols.marks import LEVELS, Anchor, Mark, anchor_position
from symbols.parts import arrow, belt, mass, slide_arrow, spring, torsion_spring, turn_arrow, wheel, wheels_of_pair

SYMBOLS_PER_DRAWING = 45  # (size of the mechanism) / (symbol size)
MAX_VARIATION = 1e-6  # a centre distance is constant if (largest - smallest) <= MAX_VARIATION * (first value)
MIN_FORCE = 1e-9  # a force has an arrow if it exceeds MIN_FORCE * (largest force of the load in the motion)
Drive = PinDrive | SliderDrive


def marks_of(placed: Placed, parts: Iterable[Mark] = ()) -> list[Mark]:
    """Return all marks of a mechanism and its parts, from back to front.

    Parameters
    ----------
    placed
        A posture or a motion. In a motion, the rails show the whole travel of the sliders.
    parts
        Additional marks of parts that `placed.mechanism` does not contain, such as cylinders.
    """
    mechanism, parts = placed.mechanism, [*parts]
    size = mechanism.size / SYMBOLS_PER_DRAWING
    replaced = {mark.replaces for mark in parts}
    marks = [*_gears(placed), *parts, *_masses(mechanism), *_loads(mechanism)]
    for slider in mechanism.sliders:
        if slider.name not in replaced:
            marks += slider_marks(placed, slider, travel(placed, slider), size)
    for number, drive in enumerate(mechanism.drives):
        if drive.turns:
            marks.append(turn_arrow(Anchor(drive.links[0], drive.joint), number))
        elif drive.joint not in replaced:
            slider = mechanism.slider(drive.joint)
            at, direction = Anchor(slider.link, slider.point), complex(slider.direction)
            marks.append(slide_arrow(at, slider.on, direction, number))
    return sorted([*marks, *_points(mechanism)], key=lambda mark: LEVELS.index(mark.level))


def _points(mechanism: Mechanism) -> Iterator[Mark]:
    """Yield the pins, welds and supports of joints, and dots at points without a joint."""
    owners: dict[str, list[str]] = {}
    for link in mechanism.links:
        for point in link.points:
            owners.setdefault(point, []).append(link.name)
    blocks = set(mechanism.slider_points.values())
    for point, links in owners.items():
        at = Anchor(next((name for name in links if name != GROUND), GROUND), point)
        if len(links) == 1:
            yield from [] if point in blocks else [dot(at)]
            continue
        if GROUND in links:
            yield from support(Anchor(GROUND, point))
        yield weld(at) if point in mechanism.welded_points else pin(at)


def _masses(mechanism: Mechanism) -> Iterator[Mark]:
    """Yield discs at point masses. In a link without beams, skip the last lump: it is the mass of the link itself."""
    for link in mechanism.links:
        for lump in link.lumps if link.beams else link.lumps[:-1]:
            if np.any(lump.mass) and not np.any(lump.inertia) and not np.any(lump.offset):
                yield mass(Anchor(link.name, lump.point))


def _loads(mechanism: Mechanism) -> Iterator[Mark]:
    for load in mechanism.loads:
        if isinstance(load, Spring):
            yield spring(Anchor(load.link, load.point), Anchor(load.on, load.anchor))
        elif isinstance(load, TorsionSpring):
            yield torsion_spring(Anchor(load.link, load.at))
        elif isinstance(load, PointLoad | Resistance):
            given = load.load if isinstance(load, Resistance) else load
            if force := complex(np.ravel(given.force)[0]):
                axis = given.link if given.turning else GROUND, force / abs(force)
                varies = load is not given or load.law is not None
                yield arrow(Anchor(load.link, load.point), axis, partial(_force_direction, load) if varies else None)


def _force_direction(load: PointLoad | Resistance, motion: Motion) -> Complexes:
    """Return the direction of the force of a load at each position as a unit vector, shape (..., positions).

    It is a zero vector at positions without a force.
    """
    [(_, _, force, _)] = load.forces(motion)
    force = np.broadcast_to(force, motion.columns)
    size = np.abs(force)
    acts = size > MIN_FORCE * np.max(size, initial=0.0, where=np.isfinite(size))
    return np.divide(force, size, out=np.zeros(force.shape, complex), where=acts)


def _gears(placed: Placed) -> Iterator[Mark]:
    """Yield the marks of gears: pitch circles, or a line between the two bodies.

    There are no pitch circles in three cases: the gear has no teeth, the centre distance varies, or both wheels rotate
    by the same angle.
    """
    for gear in placed.mechanism.gears:
        driver, driving, sense = _end(placed.mechanism, gear.driver, gear.follower)
        follower, driven, other_sense = _end(placed.mechanism, gear.follower, gear.driver)
        ratio = float(np.ravel(gear.ratio)[0]) * sense * other_sense
        apart = np.ravel(anchor_position(placed, follower) - anchor_position(placed, driver))
        apart = apart[np.isfinite(apart)]
        turning = gear.driver.turns and gear.follower.turns
        if gear.pressure_angle is None or (turning and ratio == 1):
            yield belt(driver, follower)
        elif not turning:
            if gear.driver.turns:
                yield wheel(driver, driving, abs(ratio))
            if gear.follower.turns:
                yield wheel(follower, driven, abs(1 / ratio))
        elif apart.size and np.ptp(np.abs(apart)) <= MAX_VARIATION * abs(apart[0]):
            yield from wheels_of_pair((driver, follower), (driving, driven), apart[0], ratio)
        else:
            yield belt(driver, follower)


def _end(mechanism: Mechanism, drive: Drive, other: Any) -> tuple[Anchor, str, int]:
    """Return the centre of a wheel of a gear (for a rack: its point), the link of the wheel, and a sign.

    `drive` is the coordinate of this wheel, and `other` is the coordinate of the other body of the gear. The sign is -1
    if `drive` is the angle of the carrier relative to the wheel, and otherwise 1.
    """
    if not drive.turns:
        slider = mechanism.slider(drive.joint)
        return Anchor(slider.link, slider.point), slider.link, 1
    link, on = drive.links
    carrier = link in other.links and on not in other.links
    wheel_link = on if carrier else link
    return Anchor(wheel_link, drive.joint), wheel_link, -1 if carrier else 1


def plain_marks(marks: Iterable[Mark], mechanism: Mechanism) -> list[dict[str, Any]]:
    """Return marks as JSON data. The key `x_axis` numbers the marks that have a function `x_axis_of`, from 0."""
    counter = count()
    return [{**mark.plain(mechanism.index), "x_axis": next(counter) if mark.x_axis_of else None} for mark in marks]


def extent_of(placed: Placed, marks: Iterable[Mark]) -> tuple[complex, complex] | None:
    """Return the lower left and upper right corner of the box around all links and marks [m].

    Lengths in symbol sizes are ignored. If no position is known, return None.
    """
    links = placed.mechanism.links
    places = [np.ravel(anchor_position(placed, Anchor(link.name, point))) for link in links for point in link.points]
    for mark in marks:
        offset = mark.vertices[1]
        if mark.to is None and offset.any():
            place = anchor_position(placed, mark.at)
            x_axis = np.broadcast_to(mark.direction(placed), place.shape)
            places.append(np.ravel(place[..., None] + x_axis[..., None] * offset))
    every = np.concatenate(places)
    every = every[np.isfinite(every)]
    if not every.size:
        return None
    return complex(every.real.min(), every.imag.min()), complex(every.real.max(), every.imag.max())
