"""The mechanism drawn with its deformed shape, as SVG text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import sample
from kinelast.output_results import Results, points_of
from kinelast.report_numbers import quantity, round_down
from rigid import beam_direction, position_of

WIDTH, HEIGHT, MARGIN = 640.0, 430.0, 34.0
GHOSTS = 12
SHARE = 0.08  # of the mechanism's size that the largest displacement is drawn as
STATIONS = np.linspace(0.0, 1.0, 25)


@dataclass(frozen=True)
class View:
    """From the plane [m] to the picture: y up becomes y down."""

    corner: complex
    scale: float
    height: float

    def spots(self, places: Any) -> list[tuple[float, float]]:
        """Picture coordinates of places."""
        seen = np.atleast_1d((np.asarray(places) - self.corner) * self.scale)
        return [(MARGIN + z.real, self.height - MARGIN - z.imag) for z in seen.tolist()]

    def line(self, places: Any, kind: str, tag: str = "polyline") -> str:
        """A line through places, drawn as the style sheet says for its kind."""
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in self.spots(places))
        return f'<{tag} class="{kind}" points="{points}"/>'


def view_of(results: Results) -> tuple[View, float]:
    """A view that holds the mechanism at all positions, and the mechanism's size [m]."""
    motion, mechanism = results.motion, results.mechanism
    places = [position_of(motion, number, point) for point, number in points_of(mechanism)]
    places += [np.array([complex(place)]) for place in mechanism.links[0].points.values()]
    every = np.concatenate([np.ravel(place) for place in places])
    every = every[np.isfinite(every)]
    if not every.size:
        return View(0.0, 1.0, HEIGHT), 1.0
    low = complex(every.real.min(), every.imag.min())
    way = complex(every.real.max(), every.imag.max()) - low
    across, up = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    size = abs(way) or 1.0
    scale = min(across / max(way.real, 1e-9 * size), up / max(way.imag, 1e-9 * size))
    height = max(way.imag * scale, 40.0) + 2 * MARGIN
    spare = complex((across / scale - way.real) / 2, (max(way.imag, 40.0 / scale) - way.imag) / 2)
    return View(low - spare, scale, height), size


def exaggeration(results: Results, size: float) -> float:
    """Round factor that makes the largest displacement of the cycle well visible."""
    largest = 0.0
    for field in ("u", "w"):
        values = np.abs(results.extremes[field].value)
        largest = max(largest, float(np.nanmax(values, initial=0.0)) if np.isfinite(values).any() else 0.0)
    return round_down(SHARE * size / largest) if largest > 1e-12 * size else 1.0


def mechanism_drawing(results: Results, position: int) -> tuple[str, float]:
    """The mechanism at one position, deformed, over its course.

    Returns
    -------
    An `<svg>` and the factor by which displacements are exaggerated.
    """
    view, size = view_of(results)
    factor = exaggeration(results, size)
    motion = results.motion
    parts = [f'<svg class="drawing" viewBox="0 0 {WIDTH:.0f} {view.height + 22:.0f}" role="img">']
    parts += _courses(results, view)
    step = max(1, motion.columns[0] // GHOSTS)
    for ghost in range(0, motion.columns[0], step):
        parts += [view.line(line, "ghost", tag) for line, tag in _skeleton(results, ghost, 0.0)]
    parts += [view.line(line, "rigid", tag) for line, tag in _skeleton(results, position, 0.0)]
    parts += list(_guides(results, position, view))
    parts += [view.line(line, "bent", tag) for line, tag in _skeleton(results, position, factor)]
    parts += list(_blocks(results, position, factor, view))
    parts += list(_pins(results, position, factor, view))
    parts.append(_scale_bar(view))
    return "".join([*parts, "</svg>"]), factor


def _courses(results: Results, view: View) -> Iterator[str]:
    """Paths of the points over the cycle."""
    for point, number in points_of(results.mechanism):
        path = position_of(results.motion, number, point)
        if np.isfinite(path).all():
            yield view.line(path[:: max(1, len(path) // 360)], "course")


def _skeleton(results: Results, position: int, factor: float) -> Iterator[tuple[Any, str]]:
    """Lines of all links at a position, displaced by a factor: beams as they bend, other links as they are carried."""
    motion, deflection = results.motion, results.deflection
    along, across = (sample(deflection, field, STATIONS)[:, position] for field in ("u", "w")) if factor else (0, 0)
    bent = factor * (np.asarray(along) + 1j * np.asarray(across)) + np.zeros((len(deflection.length), 1))
    beam_number = 0
    for number, link in enumerate(results.mechanism.links[1:], 1):
        if not np.isfinite(motion.origin[number, position]):
            beam_number += len(link.beams)
            continue
        for own, beam in enumerate(link.beams):
            start = complex(position_of(motion, number, beam.start)[position])
            way = complex(beam_direction(motion, number, own)[position])
            length = deflection.length[beam_number].item()
            yield start + way * (length * STATIONS + bent[beam_number]), "polyline"
            beam_number += 1
        if not link.beams and len(link.points) > 1:
            corners = [_place(results, number, point, position, factor) for point in link.points]
            yield np.array(corners), "polygon"


def _place(results: Results, link: int, point: str, position: int, factor: float) -> complex:
    """Where a point is drawn."""
    place = complex(position_of(results.motion, link, point)[position])
    if factor and point in results.displacements:
        place += factor * complex(results.displacements[point][position])
    return place


def _guides(results: Results, position: int, view: View) -> Iterator[str]:
    """The line of every slider, as far as it is used over the cycle, at its owner's place."""
    motion, mechanism = results.motion, results.mechanism
    for slider in mechanism.sliders:
        owner, link = mechanism.index[slider.on], mechanism.index[slider.link]
        path = (position_of(motion, link, slider.point) - motion.origin[owner]) * np.conj(motion.direction[owner])
        slide = np.real((path - slider.origin) * np.conj(slider.direction))
        reach = 26.0 / view.scale
        if not np.isfinite(slide).any():
            continue
        ends = np.array([np.nanmin(slide) - reach, np.nanmax(slide) + reach])
        line = motion.origin[owner, position] + motion.direction[owner, position] * (
            slider.origin + ends * slider.direction
        )
        if not np.isfinite(line).all():
            continue
        yield view.line(line, "guide")
        if not owner:
            yield from _hatching(view.spots(line))


def _hatching(ends: list[tuple[float, float]]) -> Iterator[str]:
    """Short strokes below a fixed line."""
    (x0, y0), (x1, y1) = ends
    start, way = complex(x0, y0), complex(x1 - x0, y1 - y0)
    along = way / (abs(way) or 1.0)
    side = along * 1j if (along * 1j).imag > 0 or abs((along * 1j).imag) < 1e-9 else along * -1j
    offset = 9.0 * side
    yield _stroke(start + offset, start + way + offset)
    for k in range(1, int(abs(way) // 7) + 1):
        foot = start + offset + along * 7 * k
        yield _stroke(foot, foot + 5 * side - 4 * along)


def _stroke(one: complex, other: complex) -> str:
    return f'<line class="earth" x1="{one.real:.1f}" y1="{one.imag:.1f}" x2="{other.real:.1f}" y2="{other.imag:.1f}"/>'


def _blocks(results: Results, position: int, factor: float, view: View) -> Iterator[str]:
    """The block of every slider."""
    motion, mechanism = results.motion, results.mechanism
    for slider in mechanism.sliders:
        place = _place(results, mechanism.index[slider.link], slider.point, position, factor)
        along = complex(motion.direction[mechanism.index[slider.on], position] * slider.direction)
        if np.isfinite(place) and np.isfinite(along):
            corners = np.array([13 + 8j, -13 + 8j, -13 - 8j, 13 - 8j]) / view.scale
            yield view.line(place + along * corners, "block", "polygon")


def _pins(results: Results, position: int, factor: float, view: View) -> Iterator[str]:
    """Supports, pins and the names of the points."""
    mechanism = results.mechanism
    links: dict[str, list[int]] = {}
    for number, link in enumerate(mechanism.links):
        for point in link.points:
            links.setdefault(point, []).append(number)
    for point, owners in links.items():
        place = _place(results, owners[-1], point, position, factor if owners[0] else 0.0)
        if not np.isfinite(place):
            continue
        ((x, y),) = view.spots(place)
        if not owners[0] and len(owners) > 1:
            yield f'<path class="support" d="M{x:.1f} {y:.1f}l-9 15h18z"/>'
            yield from _ticks(x, y + 15)
        if len(owners) > 1 or any(slider.point == point for slider in mechanism.sliders):
            yield f'<circle class="pin" cx="{x:.1f}" cy="{y:.1f}" r="4"/>'
        else:
            yield f'<circle class="point" cx="{x:.1f}" cy="{y:.1f}" r="2.5"/>'
        dx, dy = _aside(results, point, owners, position, factor)
        off = 21 if any(slider.point == point for slider in mechanism.sliders) else 14
        at = f'x="{x + off * dx:.1f}" y="{y + 4 - off * dy:.1f}"'
        yield f'<text class="name" text-anchor="middle" {at}>{point}</text>'


def _aside(results: Results, point: str, owners: list[int], position: int, factor: float) -> tuple[float, float]:
    """Direction from a point to where its name is in nobody's way: the middle of the widest gap between the lines."""
    here = _place(results, owners[-1], point, position, factor)
    ways = [
        _place(results, owner, other, position, factor) - here
        for owner in owners
        for other in results.mechanism.links[owner].points
        if owner and other != point
    ]
    angles = np.sort(np.angle([way for way in ways if way] + [-1j] * (not owners[0])))
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi)) if len(angles) else np.array([])
    widest = int(gaps.argmax()) if len(gaps) else 0
    angle = angles[widest] + gaps[widest] / 2 if len(gaps) else np.pi / 4
    return float(np.cos(angle)), float(np.sin(angle))


def _ticks(x: float, y: float) -> Iterable[str]:
    yield _stroke(complex(x - 14, y), complex(x + 14, y))
    for k in range(5):
        foot = complex(x - 10 + 6 * k, y)
        yield _stroke(foot, foot + (-4 + 5j))


def _scale_bar(view: View) -> str:
    length = round_down(0.22 * WIDTH / view.scale)
    x, y = MARGIN, view.height + 8
    return (
        f'<path class="bar" d="M{x} {y - 4}v4h{length * view.scale:.1f}v-4"/>'
        f'<text class="tick" x="{x + length * view.scale + 6:.1f}" y="{y + 1}">{quantity(length, "m")}</text>'
    )
