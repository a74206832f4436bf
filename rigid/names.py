"""Checks of the names and values in a mechanism."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol

import numpy as np
from msgspec.structs import asdict

from rigid.arrays import Complex
from rigid.parts import GROUND, Friction, Gear, LineLoad, Link, Load, PinDrive, Slider, SliderDrive, Weld

UNIT_TOLERANCE = 1e-9  # largest deviation of the length of a unit vector from 1


class Named(Protocol):
    """The parts of a mechanism that `definition_error` checks."""

    @property
    def links(self) -> tuple[Link, ...]: ...  # noqa: D102

    @property
    def drives(self) -> tuple[PinDrive | SliderDrive, ...]: ...  # noqa: D102

    @property
    def sliders(self) -> tuple[Slider, ...]: ...  # noqa: D102

    @property
    def loads(self) -> tuple[Load | LineLoad, ...]: ...  # noqa: D102

    @property
    def gears(self) -> tuple[Gear, ...]: ...  # noqa: D102

    @property
    def welds(self) -> tuple[Weld, ...]: ...  # noqa: D102

    @property
    def friction(self) -> Mapping[str, Friction]: ...  # noqa: D102


def definition_error(mechanism: Named) -> str | None:
    """Return a message about the first unknown name or invalid value, or None."""
    return next((message for message in _errors(mechanism) if message), None)


def _errors(mechanism: Named) -> Iterator[str | None]:
    for link in mechanism.links:
        for beam in link.beams:
            what = f'beam "{beam.start}"-"{beam.end}" of "{link.name}"'
            yield _no_point(what, link, (beam.start, beam.end)) or _no_length(what, link, beam.start, beam.end)
        for lump in link.lumps:
            yield _no_point("a lump", link, (lump.point,))
    links = {link.name: link for link in mechanism.links}
    ends = [end for gear in mechanism.gears for end in (gear.driver, gear.follower)]
    for mover in (*mechanism.drives, *ends):
        yield _no_link("a drive or gear", links, mover.links)
    for gear in mechanism.gears:
        angle = gear.pressure_angle
        if angle is not None and not 0 <= angle < np.pi / 2:
            yield f"a gear: its pressure angle is {angle:.6g} rad, expected at least 0 and less than pi/2"
    for called, count in Counter(slider.name for slider in mechanism.sliders).items():
        yield f'{count} sliders have the name "{called}"' if count > 1 else None
    for slider in mechanism.sliders:
        what = f'slider "{slider.name}"'
        yield _no_unit(f"{what}: its direction", slider.direction) or _no_unit(f"{what}: its turn", slider.turn)
        yield _no_link(what, links, (slider.on, slider.link)) or _no_point(what, links[slider.link], (slider.point,))
    for weld in mechanism.welds:
        yield from _weld(weld, links)
    welded = Counter((weld.point, frozenset((weld.link, weld.on))) for weld in mechanism.welds)
    for (point, _), count in welded.items():
        yield f'two links are welded {count} times at "{point}"' if count > 1 else None
    for load in mechanism.loads:
        yield from _load(load, links)
    shared = Counter(point for link in mechanism.links for point in link.points)
    welds = Counter(weld.point for weld in mechanism.welds)
    pins = Counter({point: count - 1 - welds[point] for point, count in shared.items()})
    sliders = Counter(slider.name for slider in mechanism.sliders)
    for called, friction in mechanism.friction.items():
        count = pins[called] + sliders[called]
        yield None if count == 1 else f'friction of "{called}": expected one joint of this name, got {count}'
        yield from _friction(f'friction of "{called}"', friction, bool(sliders[called]))


def _weld(weld: Weld, links: Mapping[str, Link]) -> Iterator[str | None]:
    """Yield the errors of a weld."""
    called = f'the weld "{weld.point}"'
    yield _no_link(called, links, (weld.on, weld.link))
    yield f'{called}: "{weld.link}" cannot be welded to itself' if weld.link == weld.on else None
    for name in (weld.on, weld.link):
        yield _no_point(called, links[name], (weld.point,))
    yield _no_unit(f"{called}: its turn", weld.turn)


def _friction(what: str, friction: Friction, slides: bool) -> Iterator[str | None]:
    """Yield the errors of the friction of a pin or slider."""
    for name, value in asdict(friction).items():
        yield f"{what}: {name} is {np.min(value):.6g}, expected at least 0" if np.any(np.less(value, 0)) else None
    if slides:
        yield f"{what}: a radius belongs to a pin" if np.any(friction.radius) else None
        yield f"{what}: its length is 0" if not np.all(friction.length) else None
    else:
        yield f"{what}: a length belongs to a slider" if np.any(np.isfinite(friction.length)) else None
        if np.any(friction.coefficient) and not np.any(friction.radius):
            yield f"{what}: a pin needs its radius"


def _load(load: Load | LineLoad, links: Mapping[str, Link]) -> Iterator[str | None]:
    """Yield the errors of the links and points of a load."""
    if isinstance(load, LineLoad):
        yield _no_link("a load", links, (load.link,))
        yield _no_beam(links[load.link], load.beam, moving=load.link != GROUND)
        return
    if not hasattr(load, "points"):
        yield f"the load {load!r} does not say where it acts: give it an attribute points of (link, point)"
        return
    for name, point in load.points:
        yield _no_link("a load", links, (name,))
        yield _no_point("a load", links[name], (point,))


def _no_link(what: str, links: Iterable[str], names: Iterable[str]) -> str | None:
    unknown = [name for name in names if name not in links]
    return f'{what}: there is no link "{unknown[0]}"' if unknown else None


def _no_point(what: str, link: Link, points: Iterable[str]) -> str | None:
    unknown = [point for point in points if point not in link.points]
    return f'{what}: link "{link.name}" has no point "{unknown[0]}"' if unknown else None


def _no_length(what: str, link: Link, start: str, end: str) -> str | None:
    return f"{what} has no length" if np.any(link.points[start] == link.points[end]) else None


def _no_unit(what: str, vector: Complex) -> str | None:
    size = np.abs(vector)
    return (
        f"{what} is not a unit vector, its length is {np.max(size):.6g}"
        if np.any(np.abs(size - 1) > UNIT_TOLERANCE)
        else None
    )


def _no_beam(link: Link, number: int, moving: bool) -> str | None:
    if not moving:
        return f'a line load on "{link.name}", which does not move: the load has no effect on its beams'
    if not 0 <= number < len(link.beams):
        known = f"which has {counted(len(link.beams), 'beam')} (counted from 0)"
        return f'a line load on beam {number} of "{link.name}", {known}'
    return None


def counted(count: int, noun: str) -> str:
    """Return a number with a noun in singular or plural, for a message."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
