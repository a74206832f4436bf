"""Tables by which loads and efforts are multiplied: against time, the angle of a link, or a slide."""

from __future__ import annotations

from collections.abc import Callable, Collection
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from kinelast.scene.error import fault, known_name
from kinelast.scene.format_motion import DriveTable, LoadTable
from kinelast.scene.laws import APART, OVER
from rigid import Law, TableError

if TYPE_CHECKING:
    from rigid.analysis import LinkAngle, Slide


def factor_law(
    where: str, table: LoadTable | DriveTable, duration: float, links: Collection[str], sliders: Collection[str]
) -> Law | None:
    """What a load or effort is multiplied by; None without a table. A table against time must cover the duration [s].

    `links`, `sliders` are the names that there are.
    """
    if table.table is None:
        for key in ("against", "extend"):
            if getattr(table, key) is not None:
                raise fault(where, key, "belongs to a table: give that too")
        return None
    from rigid.analysis import Slide
    from rigid.dynamics import law_of, law_of_time, table_curve

    unit, coordinate = _against(where, table, links, sliders)
    for number, (place, _) in enumerate(table.table, 1):
        if place.unit not in ("", unit):
            raise fault(where, f"table[{number}]", f"is against {WORDS[unit]}, got {float(place):g} {place.unit}")
    at, factor = np.array([(place.within(unit), factor) for place, factor in table.table], float).T
    rises = np.diff(at)
    steps = np.flatnonzero(rises == 0)
    if (
        (rises[rises != 0] <= APART * (at[-1] - at[0])).any()
        or (np.diff(steps) == 1).any()
        or (len(steps) and table.interpolation != "linear")
    ):
        allowed = "two entries at one place are a step, in a linear table"
        raise fault(where, "table", f"expected {GROWING[unit]} that grow from entry to entry; {allowed}")
    at[steps] = np.nextafter(at[steps], -np.inf)  # at the step itself the second entry holds
    try:
        # Times are looked at here, once for all: a search between the positions may look a little beyond the run.
        extend = "hold" if coordinate is None else table.extend or "error"
        curve = table_curve(at, factor, table.interpolation, extend)
    except TableError as error:
        raise fault(where, "table", str(error)) from None
    if coordinate is None:
        if table.extend is None and (at[0] > 0 or at[-1] < duration * (1 - OVER)):
            problem = f"covers {at[0]:g} to {at[-1]:g} s, but the run lasts from 0 to {duration:g} s: "
            raise fault(where, "table", problem + 'add entries, or extend = "hold"')
        return law_of_time(curve)
    if isinstance(coordinate, Slide):
        return law_of(coordinate, curve)
    if at[-1] - at[0] > 2 * pi * (1 + OVER):
        raise fault(where, "table", "covers more than a turn, expected angles within one")
    return _turning(coordinate, curve, float(at[0] + at[-1]) / 2)


GROWING = {"s": "times", "rad": "angles", "m": "lengths"}
WORDS = {"s": 'a time, as in "50 ms"', "rad": 'an angle, as in "30 deg"', "m": 'a length, as in "20 mm"'}


def _turning(angle: LinkAngle, curve: Callable[[Any], Any], middle: float) -> Law:
    """A curve against an angle, which is taken within half a turn of the middle of its entries."""
    return lambda motion: curve(middle + angle.difference(motion, middle))


def _against(
    where: str, table: LoadTable | DriveTable, links: Collection[str], sliders: Collection[str]
) -> tuple[str, LinkAngle | Slide | None]:
    """Unit of what a table is against, and the coordinate; None for time."""
    from rigid.analysis import LinkAngle, Slide

    against = table.against
    if against is None:
        return "s", None
    if (against.link is None) == (against.slider is None):
        raise fault(where, "against", 'expected either link or slider, as in {link = "crank"}')
    if against.slider is not None:
        known_name(where, "against.slider", against.slider, sliders, "slider")
        return "m", Slide(against.slider)
    assert against.link is not None
    for key, link in (("link", against.link), ("on", against.on)):
        known_name(where, f"against.{key}", link, links)
    return "rad", LinkAngle(against.link, against.on)
