"""Display list of a mechanism."""

from collections.abc import Iterable, Iterator
from itertools import count
from typing import Any

import numpy as np

from rigid import GROUND, Mechanism, PinDrive, PointLoad, SliderDrive, Spring, TorsionSpring
from rigid.joints import Placed
from symbols.joints import pin, slider_marks, spot, support, travel, weld
from symbols.marks import LEVELS, Mark, Spot, anchor
from symbols.parts import arrow, belt, mass, slide_arrow, spring, torsion_spring, turn_arrow, wheel, wheels_of_pair

SYMBOLS_PER_DRAWING = 45  # size of a drawing / usual size of a symbol
MAX_VARIATION = 1e-6  # relative variation up to which the centre distance of two wheels counts as constant
Drive = PinDrive | SliderDrive


def marks_of(placed: Placed, parts: Iterable[Mark] = ()) -> list[Mark]:
    """Return all marks of a mechanism and its parts, from back to front.

    Parameters
    ----------
    placed
        A posture or a motion. With a motion, the rails show the whole travel of the sliders.
    parts
        Marks of parts that are not in the mechanism, such as cylinders.
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
            marks.append(turn_arrow(Spot(drive.links[0], drive.joint), number))
        elif drive.joint not in replaced:
            slider = mechanism.slider(drive.joint)
            at, direction = Spot(slider.link, slider.point), complex(slider.direction)
            marks.append(slide_arrow(at, slider.on, direction, number))
    return sorted([*marks, *_points(mechanism)], key=lambda mark: LEVELS.index(mark.level))


def _points(mechanism: Mechanism) -> Iterator[Mark]:
    """Yield the pins, welds and supports of joints, and dots at other points."""
    owners: dict[str, list[str]] = {}
    for link in mechanism.links:
        for point in link.points:
            owners.setdefault(point, []).append(link.name)
    blocks = set(mechanism.slider_points.values())
    for point, links in owners.items():
        at = Spot(next((name for name in links if name != GROUND), GROUND), point)
        if len(links) == 1:
            yield from [] if point in blocks else [spot(at)]
            continue
        if GROUND in links:
            yield from support(Spot(GROUND, point))
        yield weld(at) if point in mechanism.welded_points else pin(at)


def _masses(mechanism: Mechanism) -> Iterator[Mark]:
    """Yield discs at point masses. The last lump of a link without beams is the link's own mass, not a point mass."""
    for link in mechanism.links:
        for lump in link.lumps if link.beams else link.lumps[:-1]:
            if np.any(lump.mass) and not np.any(lump.inertia) and not np.any(lump.offset):
                yield mass(Spot(link.name, lump.point))


def _loads(mechanism: Mechanism) -> Iterator[Mark]:
    for load in mechanism.loads:
        if isinstance(load, Spring):
            yield spring(Spot(load.link, load.point), Spot(load.on, load.anchor))
        elif isinstance(load, TorsionSpring):
            yield torsion_spring(Spot(load.link, load.at))
        elif isinstance(load, PointLoad) and (force := complex(np.ravel(load.force)[0])):
            direction = force / abs(force)
            yield arrow(Spot(load.link, load.point), (load.link if load.turning else GROUND, direction))


def _gears(placed: Placed) -> Iterator[Mark]:
    """Yield the pitch circles of toothed wheels, or a line if there are no teeth or the centre distance varies."""
    for gear in placed.mechanism.gears:
        driver, driving, sense = _end(placed.mechanism, gear.driver, gear.follower)
        follower, driven, other_sense = _end(placed.mechanism, gear.follower, gear.driver)
        ratio = float(np.ravel(gear.ratio)[0]) * sense * other_sense
        apart = np.ravel(anchor(placed, follower) - anchor(placed, driver))
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


def _end(mechanism: Mechanism, drive: Drive, other: Any) -> tuple[Spot, str, int]:
    """Return the centre of a wheel (or point of a rack), its link, and -1 if the drive turns the carrier, else 1."""
    if not drive.turns:
        slider = mechanism.slider(drive.joint)
        return Spot(slider.link, slider.point), slider.link, 1
    link, on = drive.links
    carrier = link in other.links and on not in other.links
    wheel_link = on if carrier else link
    return Spot(wheel_link, drive.joint), wheel_link, -1 if carrier else 1


def plain_marks(marks: Iterable[Mark], mechanism: Mechanism) -> list[dict[str, Any]]:
    """Return marks as JSON data. Marks with a `spin` function are numbered under this key."""
    counter = count()
    return [{**mark.plain(mechanism.index), "spin": next(counter) if mark.spin else None} for mark in marks]


def extent_of(placed: Placed, marks: Iterable[Mark]) -> tuple[complex, complex] | None:
    """Return two opposite corners of the bounding box of all links and marks [m], or None if no position is known."""
    links = placed.mechanism.links
    places = [np.ravel(anchor(placed, Spot(link.name, point))) for link in links for point in link.points]
    for mark in marks:
        far = mark.vertices[1]
        if mark.to is None and far.any():
            place = anchor(placed, mark.at)
            x_axis = np.broadcast_to(mark.direction(placed), place.shape)
            places.append(np.ravel(place[..., None] + x_axis[..., None] * far))
    every = np.concatenate(places)
    every = every[np.isfinite(every)]
    if not every.size:
        return None
    return complex(every.real.min(), every.imag.min()), complex(every.real.max(), every.imag.max())
