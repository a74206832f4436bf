"""Loads of a scene: at points and along beams, constant or against time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kinelast.scene_drives import known_link
from kinelast.scene_error import fault
from kinelast.scene_format import LoadTable
from kinelast.scene_links import known_point
from rigid import GROUND, LineLoad, Link, Motion, PointLoad, Reals


@dataclass(frozen=True, eq=False)
class TimeTable:
    """A factor against time, held beyond the ends of the table.

    `time` [s] and `factor` have shape (entries,). Called with a motion, it returns an array of shape (positions,).
    """

    time: Reals
    factor: Reals
    interpolation: Literal["linear", "cubic"]

    def __call__(self, motion: Motion) -> Reals:
        """The factor at the times of a motion."""
        time = np.clip(motion.time, self.time[0], self.time[-1])
        if self.interpolation == "linear":
            return np.interp(time, self.time, self.factor)
        from scipy.interpolate import CubicSpline

        values: Reals = CubicSpline(self.time, self.factor)(time)
        return values


def build_load(number: int, table: LoadTable, links: Mapping[str, Link], duration: float) -> PointLoad | LineLoad:
    """A load; a table against time must cover the run of given duration [s]."""
    where = f"loads[{number}]"
    known_link(where, "link", table.link, links)
    if table.link == GROUND:
        raise fault(where, "link", "the ground takes any load without moving: load a moving link")
    if (table.point is None) == (table.beam is None):
        raise fault(where, "point", "expected either point or beam, where the load acts")
    law = _law(where, table, duration)
    turning = table.axes == "turning"
    link = links[table.link]
    if table.point is None:
        return _line_load(where, table, link, turning, law)
    for key in ("start", "end"):
        if getattr(table, key) is not None:
            raise fault(where, key, "belongs to a load along a beam; at a point give force or moment")
    if table.force is None and table.moment is None:
        raise fault(where, "force", "the key is missing: a load at a point needs force or moment")
    known_point(where, "point", table.point, link.points, link.name)
    if link.beams and not any(table.point in (beam.start, beam.end) for beam in link.beams):
        raise fault(where, "point", f'no beam of "{link.name}" reaches the point "{table.point}": let one end there')
    force = 0j if table.force is None else complex(*table.force)
    return PointLoad(link.name, table.point, force, float(table.moment or 0.0), turning, law)


def _line_load(where: str, table: LoadTable, link: Link, turning: bool, law: TimeTable | None) -> LineLoad:
    for key in ("force", "moment"):
        if getattr(table, key) is not None:
            raise fault(where, key, "belongs to a load at a point; along a beam give start and end, forces per length")
    if table.start is None:
        raise fault(where, "start", 'the key is missing: expected forces per length, as in ["0 N/m", "-40 N/m"]')
    start = complex(*table.start)
    end = start if table.end is None else complex(*table.end)
    assert table.beam is not None
    for beam_number, beam in enumerate(link.beams):
        if (beam.start, beam.end) == table.beam:
            return LineLoad(link.name, beam_number, start, end, turning, law)
        if (beam.end, beam.start) == table.beam:
            # Read from the beam's other end, its own axes point the other way.
            sense = -1 if turning else 1
            return LineLoad(link.name, beam_number, sense * end, sense * start, turning, law)
    known = (
        ", ".join(f'["{beam.start}", "{beam.end}"]' for beam in link.beams) or "none, as it has no section of its own"
    )
    raise fault(
        where, "beam", f'the link "{link.name}" has no beam ["{table.beam[0]}", "{table.beam[1]}"]; there is {known}'
    )


def _law(where: str, table: LoadTable, duration: float) -> TimeTable | None:
    if table.table is None:
        return None
    time, factor = (np.array(column, float) for column in zip(*table.table, strict=True))
    if not (np.diff(time) > 0).all():
        raise fault(where, "table", "expected times that grow from entry to entry")
    if table.extend is None and (time[0] > 0 or time[-1] < duration * (1 - 1e-12)):
        problem = f"covers {time[0]:g} to {time[-1]:g} s, but the run lasts from 0 to {duration:g} s: "
        raise fault(where, "table", problem + 'add entries, or extend = "hold"')
    return TimeTable(time, factor, table.interpolation)
