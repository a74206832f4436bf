"""Drives and sliders of a scene, and the laws that the drives follow."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping
from typing import Any

from kinelast.scene_error import fault, likely
from kinelast.scene_format import DriveTable, SceneTable, SliderTable
from kinelast.scene_links import Points, known_point
from kinelast.scene_quantities import Coordinate
from rigid import GROUND, ConstantSpeed, LawError, Link, PinDrive, Reals, Segment, SegmentedLaw, Slider, SliderDrive

DriveLaw = Callable[[Any], tuple[Reals, Reals, Reals]]
DIMENSIONS = {"rad": 'an angle, as in "30 deg"', "m": 'a length, as in "20 mm"'}
SPEEDS = {"rad/s": 'a speed of rotation, as in "100 rad/s" or "3000 rpm"', "m/s": 'a speed, as in "0.2 m/s"'}


def known_link(table: str, key: str, link: str, links: Mapping[str, Any]) -> None:
    """Raise where there is no such link."""
    if link not in links:
        raise fault(table, key, f'there is no link "{link}"{likely(link, links)}')


def drawn_direction(link: Link, places: Points) -> complex | None:
    """Unit vector of a link's axes as drawn; None where fewer than two of its points are drawn apart."""
    if link.name == GROUND:
        return 1 + 0j
    drawn = [point for point in link.points if point in places]
    if len(drawn) < 2:
        return None
    seen = places[drawn[1]] - places[drawn[0]]
    own = complex(link.points[drawn[1]]) - complex(link.points[drawn[0]])
    if not seen or not own:
        return None
    turned = seen / own
    return turned / abs(turned)


def build_slider(name: str, table: SliderTable, links: Mapping[str, Link], places: Points) -> Slider:
    """A slider; its line passes the drawn place of a point and is fixed in its owner."""
    where = f"sliders.{name}"
    known_link(where, "link", table.link, links)
    known_link(where, "on", table.on, links)
    if table.link == GROUND:
        raise fault(where, "link", "the ground cannot slide: name the moving link here, and ground under on")
    if table.link == table.on:
        raise fault(where, "on", f'the link "{table.link}" cannot slide on itself')
    known_point(where, "through", table.through, links[table.link].points, table.link)
    if table.through not in places:
        raise fault(
            where, "through", f'the point "{table.through}" has no place under [points]{likely(table.through, places)}'
        )
    owner = links[table.on]
    axes = drawn_direction(owner, places)
    if axes is None:
        raise fault(where, "on", f'draw two points of the link "{table.on}", so that the line can be fixed in it')
    own = drawn_direction(links[table.link], places)
    origin = places[table.through]
    if owner.name != GROUND:
        anchor = next(point for point in owner.points if point in places)
        origin = (origin - places[anchor]) * axes.conjugate() + complex(owner.points[anchor])
    turn = 1 + 0j if own is None else own * axes.conjugate()
    return Slider(name, table.link, table.on, table.through, origin, table.direction * axes.conjugate(), turn)


def build_drive(
    number: int, table: DriveTable, links: Mapping[str, Link], sliders: Mapping[str, Slider], places: Points
) -> tuple[PinDrive | SliderDrive, DriveLaw]:
    """A drive and its law."""
    where = f"drives[{number}]"
    if (table.link is None) == (table.slider is None):
        raise fault(where, "link", "expected either link or slider, what the drive moves")
    if (table.speed is None) == (table.law is None):
        raise fault(where, "speed", "expected either speed or law, how the drive moves")
    if table.slider is not None:
        for key in ("at", "on"):
            if getattr(table, key) not in (None, GROUND):
                raise fault(where, key, "belongs to a drive of a link: a slider tells itself what it slides on")
        if table.slider not in sliders:
            raise fault(where, "slider", f'there is no slider "{table.slider}"{likely(table.slider, sliders)}')
        return SliderDrive(table.slider), _law(where, table, "m", 0.0)
    drive = _pin_drive(where, table, links)
    return drive, _law(where, table, "rad", _drawn_angle(where, table, links, places))


def _pin_drive(where: str, table: DriveTable, links: Mapping[str, Link]) -> PinDrive:
    """The pin a drive turns about: as said, or the only one that both links share."""
    assert table.link is not None
    known_link(where, "link", table.link, links)
    known_link(where, "on", table.on, links)
    if table.link == GROUND:
        raise fault(where, "link", "the ground cannot be driven: name the moving link here, and ground under on")
    if table.link == table.on:
        raise fault(where, "on", f'the link "{table.link}" cannot turn on itself')
    shared = [point for point in links[table.link].points if point in links[table.on].points]
    if not shared:
        raise fault(where, "on", f'the links "{table.link}" and "{table.on}" share no point: no pin to drive')
    if table.at is None and len(shared) > 1:
        pins = ", ".join(f'"{point}"' for point in shared)
        raise fault(where, "at", f'the links "{table.link}" and "{table.on}" share {pins}: say which one is driven')
    if table.at is not None and table.at not in shared:
        problem = f'the links "{table.link}" and "{table.on}" share no point "{table.at}"'
        raise fault(where, "at", problem + likely(table.at, shared))
    return PinDrive(table.link, table.at or shared[0], table.on)


def _drawn_angle(where: str, table: DriveTable, links: Mapping[str, Link], places: Points) -> float:
    """Angle of the driven link's axes from those of the other, as drawn [rad]; 0 where `start` is given instead."""
    if table.start is not None:
        return 0.0
    assert table.link is not None
    one, other = (drawn_direction(links[name], places) for name in (table.on, table.link))
    if one is None or other is None:
        raise fault(where, "start", "the key is missing: the drawing does not show at which angle the link starts")
    return cmath.phase(other * one.conjugate())


def _law(where: str, table: DriveTable, unit: str, drawn: float) -> DriveLaw:
    start = drawn if table.start is None else _coordinate(where, "start", table.start, unit)
    if table.speed is not None:
        if table.speed.unit not in ("", f"{unit}/s"):
            raise fault(
                where, "speed", f"expected {SPEEDS[f'{unit}/s']}, got {float(table.speed):g} {table.speed.unit}"
            )
        return ConstantSpeed(start, float(table.speed))
    assert table.law is not None
    level, segments = start, []
    for number, piece in enumerate(table.law, 1):
        key = f"law[{number}]"
        if piece.curve == "dwell":
            if piece.to is not None or piece.by is not None:
                raise fault(where, key, "a dwell stays where it is: leave to and by out")
            segments.append(Segment("dwell", float(piece.duration)))
            continue
        if (piece.to is None) == (piece.by is None):
            raise fault(where, key, "expected either to, where the segment ends, or by, how far it goes")
        if piece.by is not None:
            rise = _coordinate(where, f"{key}.by", piece.by, unit)
        else:
            assert piece.to is not None
            rise = _coordinate(where, f"{key}.to", piece.to, unit) - level
        segments.append(Segment(piece.curve, float(piece.duration), rise))
        level += rise
    try:
        return SegmentedLaw(start, tuple(segments))
    except LawError as error:
        raise fault(where, f"law[{error.segment}]", error.problem) from None


def _coordinate(where: str, key: str, value: Coordinate, unit: str) -> float:
    if value.unit not in ("", unit):
        raise fault(where, key, f"expected {DIMENSIONS[unit]}, got {float(value):g} {value.unit}")
    return float(value)


def build_drives(
    scene: SceneTable, links: Mapping[str, Link], sliders: Mapping[str, Slider], places: Points
) -> tuple[tuple[PinDrive | SliderDrive, ...], tuple[DriveLaw, ...]]:
    """All drives and their laws, in the order of the file."""
    built = [build_drive(number, table, links, sliders, places) for number, table in enumerate(scene.drives, 1)]
    return tuple(drive for drive, _ in built), tuple(law for _, law in built)
