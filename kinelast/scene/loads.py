"""Loads and springs of a scene: loads at points and along beams, with their tables."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from kinelast.scene.tables import DriveTable, LoadTable, SpringTable
from kinelast.values.error import fault, known_name, known_point, require_absent
from kinelast.values.numbers import EXPECTED, any_nonzero, real, require_unit, vector
from kinelast.values.quantities import DampingConstant, ForceOrMoment, Stiffness
from rigid import GROUND, Law, LineLoad, Link, Motion, PointLoad, Resistance, Spring, TableError, TorsionSpring
from rigid.arrays import Real, Reals

if TYPE_CHECKING:
    from rigid.analysis import LinkAngle, Slide
    from rigid.dynamics import CurveLaw

COVER_TOLERANCE = 1e-12  # part of the run that a table may leave out, relative to the duration of the run
MIN_SPACING = 1e-12  # smallest distance between two entries of a table, relative to the range of the table


def build_load(
    number: int, table: LoadTable, links: Mapping[str, Link], sliders: Collection[str], duration: float
) -> PointLoad | LineLoad | Resistance:
    """Return a load. A table over time must cover the duration of the run [s]."""
    where = f"loads[{number}]"
    known_name(where, "link", table.link, links)
    if table.link == GROUND:
        raise fault(where, "link", "a load on the ground has no effect: name a moving link")
    if (table.point is None) == (table.beam is None):
        raise fault(where, "point", "expected either point or beam, where the load acts")
    law = factor_law(where, table, duration, links, sliders)
    turning = table.axes == "turning"
    link = links[table.link]
    if table.point is not None:
        load = _point_load(where, table, link, turning, law)
        return load if table.resists is None else Resistance(load, table.resists == "one way")
    if table.resists is not None:
        raise fault(where, "resists", "belongs to a load at a point: the direction follows from its motion")
    return _line_load(where, table, link, turning, law)


def _point_load(where: str, table: LoadTable, link: Link, turning: bool, law: Law | None) -> PointLoad:
    assert table.point is not None
    along = "belongs to a load along a beam; at a point give force or moment"
    require_absent(where, table, ("start", "end"), along)
    if table.force is None and table.moment is None:
        raise fault(where, "force", "the key is missing: a load at a point needs force or moment")
    _reached(where, "point", table.point, link)
    force = 0j if table.force is None else vector(table.force)
    return PointLoad(link.name, table.point, force, real(table.moment or 0.0), turning, law)


def _reached(where: str, key: str, point: str, link: Link) -> None:
    """Raise SceneError if a link does not have the point, or if it has beams but none that ends at the point."""
    known_point(where, key, point, link.points, link.name)
    if link.beams and not any(point in (beam.start, beam.end) for beam in link.beams):
        raise fault(where, key, f'no beam of "{link.name}" ends at the point "{point}": add one')


def _line_load(where: str, table: LoadTable, link: Link, turning: bool, law: Law | None) -> LineLoad:
    at_point = "belongs to a load at a point; along a beam give start and end, forces per length"
    require_absent(where, table, ("force", "moment"), at_point)
    if table.start is None:
        raise fault(where, "start", 'the key is missing: expected forces per length, as in ["0 N/m", "-40 N/m"]')
    start = vector(table.start)
    end = start if table.end is None else vector(table.end)
    assert table.beam is not None
    for beam_number, beam in enumerate(link.beams):
        if (beam.start, beam.end) == table.beam:
            return LineLoad(link.name, beam_number, start, end, turning, law)
        if (beam.end, beam.start) == table.beam:
            # the file may name the ends of the beam in reverse order; the axes of the beam are then reversed
            sense = -1 if turning else 1
            return LineLoad(link.name, beam_number, sense * end, sense * start, turning, law)
    known = ", ".join(f'["{beam.start}", "{beam.end}"]' for beam in link.beams) or "none: the link has no section"
    raise fault(
        where, "beam", f'the link "{link.name}" has no beam ["{table.beam[0]}", "{table.beam[1]}"]; there is {known}'
    )


def build_spring(number: int, table: SpringTable, links: Mapping[str, Link]) -> Spring | TorsionSpring:
    """Return a spring between two points or about a pin."""
    where = f"springs[{number}]"
    for key in ("link", "on"):
        known_name(where, key, getattr(table, key), links)
    if table.link == table.on:
        raise fault(where, "on", f'a spring from "{table.link}" to itself has no effect')
    if (table.point is None) == (table.at is None):
        raise fault(where, "point", "expected either point, an end of the spring, or at, the pin about which it turns")
    if table.at is None:
        require_absent(where, table, ("angle",), "belongs to a spring about a pin")
    else:
        require_absent(where, table, ("anchor", "length"), "belongs to a spring between points")
    link, on = links[table.link], links[table.on]
    if table.at is not None:
        for owner in (link, on):
            _reached(where, "at", table.at, owner)
        stiffness, damping, preload = _sizes(where, table, 1)
        return TorsionSpring(table.link, table.at, table.on, stiffness, real(table.angle or 0.0), damping, preload)
    if table.anchor is None:
        raise fault(where, "anchor", f'the key is missing: the point of "{table.on}" at the other end of the spring')
    _reached(where, "point", str(table.point), link)
    _reached(where, "anchor", table.anchor, on)
    stiffness, damping, preload = _sizes(where, table, 0)
    return Spring(
        table.link, str(table.point), table.on, table.anchor, stiffness, real(table.length or 0.0), damping, preload
    )


SIZES = {  # units for a linear spring and for a torsion spring
    "stiffness": Stiffness.units,
    "damping": DampingConstant.units,
    "preload": ForceOrMoment.units[::-1],
}


def _sizes(where: str, table: SpringTable, turning: int) -> list[Real]:
    """Return stiffness, damping and preload of a linear spring (`turning` = 0) or torsion spring (`turning` = 1)."""
    sizes: list[Real] = []
    for key, units in SIZES.items():
        value = getattr(table, key)
        if value is not None:
            require_unit(where, key, value, units[turning])
        sizes.append(real(value or 0.0))
    if not any(any_nonzero(size) for size in sizes):
        raise fault(where, "stiffness", "the key is missing: a spring needs stiffness, damping or preload")
    return sizes


def factor_law(
    where: str, table: LoadTable | DriveTable, duration: float, links: Collection[str], sliders: Collection[str]
) -> CurveLaw | None:
    """Return the function by which a load, or the effort of a drive, is multiplied.

    It is given by the key `table` in the table of the load or drive. Return None if this key is missing. A table over
    time must cover the duration of the run [s]. `links` and `sliders` contain the names of all links and sliders of the
    scene.
    """
    if table.table is None:
        require_absent(where, table, ("against", "extend"), "needs a table: add the key table")
        return None
    from rigid.analysis import Slide
    from rigid.dynamics import CurveLaw, corners, law_of, law_of_time, table_curve

    unit, coordinate = _against(where, table, links, sliders)
    for number, (place, _) in enumerate(table.table, 1):
        if place.unit not in ("", unit):
            raise fault(
                where, f"table[{number}]", f"the abscissa must be {EXPECTED[unit]}, got {float(place):g} {place.unit}"
            )
    at, factor = np.array([(place.within(unit), factor) for place, factor in table.table], float).T
    rises = np.diff(at)
    steps = np.flatnonzero(rises == 0)
    if (
        (rises[rises != 0] <= MIN_SPACING * (at[-1] - at[0])).any()
        or (np.diff(steps) == 1).any()
        or (len(steps) and table.interpolation != "linear")
    ):
        allowed = "a step is two entries with the same abscissa, in a linear table"
        raise fault(where, "table", f"expected increasing {GROWING[unit]}; {allowed}")
    at[steps] = np.nextafter(at[steps], -np.inf)  # at the abscissa of a step, the second entry applies
    try:
        # root searches may evaluate a table over time slightly beyond the run, so its first and last values hold there;
        # whether the table covers the run is checked below
        extend = "hold" if coordinate is None else table.extend or "error"
        curve = table_curve(at, factor, table.interpolation, extend, unit == "rad")
    except TableError as error:
        raise fault(where, "table", str(error)) from None
    if coordinate is None:
        if table.extend is None and (at[0] > 0 or at[-1] < duration * (1 - COVER_TOLERANCE)):
            problem = f"covers {at[0]:g} to {at[-1]:g} s, but the run lasts from 0 to {duration:g} s: "
            raise fault(where, "table", problem + 'add entries, or extend = "hold"')
        return law_of_time(curve, corners(at, factor))
    if isinstance(coordinate, Slide):
        return law_of(coordinate, curve, corners(at, factor))
    if at[-1] - at[0] > 2 * pi * (1 + COVER_TOLERANCE):
        raise fault(where, "table", "covers more than a turn: expected angles within one turn")
    middle = float(at[0] + at[-1]) / 2
    return CurveLaw(partial(_turned, coordinate, middle), curve, corners(at, factor), middle)


GROWING = {"s": "times", "rad": "angles", "m": "lengths"}


def _turned(angle: LinkAngle, middle: float, motion: Motion) -> Reals:
    """Return the angles of a link [rad], shape (..., positions).

    Whole turns are added or subtracted, so that each angle differs from `middle` by at most half a turn.
    """
    return middle + angle.difference(motion, middle)


def _against(
    where: str, table: LoadTable | DriveTable, links: Collection[str], sliders: Collection[str]
) -> tuple[str, LinkAngle | Slide | None]:
    """Return the unit of the abscissa of a table, and the angle or travel that is the abscissa (None if it is time)."""
    from rigid.analysis import LinkAngle, Slide

    against = table.against
    if against is None:
        return "s", None
    if not against.unique:
        raise fault(where, "against", 'expected either link or slider, as in {link = "crank"}')
    if not against.turns:
        known_name(where, "against.slider", against.name, sliders, "slider")
        return "m", Slide(against.name)
    for key, link in (("link", against.name), ("on", against.on)):
        known_name(where, f"against.{key}", link, links)
    return "rad", LinkAngle(against.name, against.on)
