"""Pictures of a mechanism: deflected links, charts, films, and DXF drawings for CAD programs."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elastic import sample
from kinelast.answers.results import Results
from kinelast.outputs.charts import INK, SOFT, axis, cycle_charts, cycle_maps, line_charts, new_axes, svg_of
from kinelast.outputs.display import display_list, extent
from kinelast.outputs.positions import PROFILE
from kinelast.outputs.sheet import MechanismAxes
from kinelast.scene.data import Scene
from kinelast.scene.parts import symbols_of
from kinelast.scene.parts.cam_courses import cam_outline
from kinelast.tasks.request import Request, RequestError
from kinelast.values.figure import points_of
from kinelast.values.numbers import number as written
from kinelast.values.numbers import quantity, round_down
from rigid import Posture, position_of
from rigid.kinetostatics import beam_directions
from symbols import ROLLER

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from animations import Style


WIDEST, TALLEST = 8.4, 5.2  # [in] largest width and height of a picture of the mechanism
GHOSTS = 12  # the undeformed links are drawn faintly at about this number of positions
FOOT = 0.3  # [in] height of the space for the length scale
EDGE = 0.06  # [in] margin that is added on a side of the picture if a part would extend beyond that side
SHARE = 0.08  # (drawn length of the largest displacement) / (size of the mechanism)
MIN_NAMED = 6  # the name of a link is drawn if (longest line of the link / size of the symbols) exceeds this limit
STATIONS = np.linspace(0.0, 1.0, 25)  # (distance of a drawn point from the start of a beam) / length of the beam


def mechanism_drawing(results: Results, position: int) -> tuple[str, float]:
    """Draw the deflected mechanism at a position, with the paths of its points.

    Returns
    -------
    An `<svg>` element, and the factor by which displacements are enlarged in the picture.
    """
    low, high = extent(results)
    factor = exaggeration(results, abs(high - low))
    sheet = _sheet(results, position, factor, (low, high))
    room = 5.0 * sheet.unit
    wide, tall = (high - low).real + 2 * room, (high - low).imag + 2 * room
    scale = min(WIDEST / wide, TALLEST / tall)
    width = max(wide * scale, 3.0)
    with new_axes(width, tall * scale + FOOT, (0.0, 0.0, 1.0, 1.0)) as axes:
        axes.set_axis_off()
        left = (low + high).real / 2 - width / scale / 2
        foot = low.imag - room - FOOT / scale
        axes.set(xlim=(left, left + width / scale), ylim=(foot, high.imag + room))
        sheet.axes = axes
        _draw_all(results, sheet, position, factor, complex(left, foot) + (0.2 + 0.1j) / scale)
        _extend_limits(axes, scale)
        return svg_of(axes.figure, "drawing"), factor


def draw_mechanism(results: Results, axes: Axes, size: complex) -> None:
    """Draw the mechanism at the position with the largest deflection.

    `size` is the width and height of the axes [in], as a complex number.
    """
    low, high = extent(results)
    factor, position = exaggeration(results, abs(high - low)), position_of_largest(results)
    sheet = _sheet(results, position, factor, (low, high))
    wide, tall = (high - low).real + 10 * sheet.unit, (high - low).imag + 10 * sheet.unit
    scale = min(size.real / wide, (size.imag - FOOT) / tall)
    corner = (low + high - size / scale) / 2 - 0.5j * FOOT / scale
    axes.set_axis_off()
    axes.set(xlim=(corner.real, corner.real + size.real / scale), ylim=(corner.imag, corner.imag + size.imag / scale))
    sheet.axes = axes
    _draw_all(results, sheet, position, factor, corner + (0.1 + 0.1j) / scale)


def _draw_all(results: Results, sheet: MechanismAxes, position: int, factor: float, corner: complex) -> None:
    """Draw paths, links, symbols, names and the length scale. The length scale starts at the point `corner` [m]."""
    _draw_course(results, sheet.axes, position)
    _draw_bent(results, sheet.axes, sheet, position, factor)
    sheet.draw_symbols()
    left, right = sheet.axes.get_xlim()
    _draw_scale(sheet.axes, corner, right - left, factor if results.scene.labels and factor else None)
    sheet.place_names()


def position_of_largest(results: Results) -> int:
    """Return the index of the position with the largest deflection, or 0 if no link bends."""
    largest = results.cycle.along("w")
    known = len(results.scene.labels) and np.isfinite(largest.value).any()
    return int(largest.position[np.nanargmax(np.abs(largest.value))]) if known else 0


def _extend_limits(axes: Axes, scale: float) -> None:
    """Enlarge the picture until it contains all deflected links, symbols and texts.

    `scale` is the scale of the picture in inches per metre.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure: Any = axes.figure
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    to_metres = axes.transData.inverted()
    (left, right), (foot, top) = axes.get_xlim(), axes.get_ylim()
    boxes = [to_metres.transform(text.get_window_extent(renderer).get_points()) for text in axes.texts]
    every = np.concatenate([[(left, foot), (right, top)], axes.dataLim.get_points(), *boxes])
    every = every[np.isfinite(every).all(axis=1)]  # at a singular position, coordinates are nan
    edge = EDGE / scale * (every.min(axis=0) < (left, foot)), EDGE / scale * (every.max(axis=0) > (right, top))
    low, high = every.min(axis=0) - edge[0], every.max(axis=0) + edge[1]
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    figure.set_size_inches(*((high - low) * scale))


def exaggeration(results: Results, size: float) -> float:
    """Return a factor that makes the largest displacement clearly visible in a picture. The factor is a round number.

    Return 0 if a link buckles, because displacements are unknown after buckling. `size` is the size of the mechanism.
    """
    if results.buckles:
        return 0.0
    cycle = results.cycle
    moved = [cycle.extremes[field].value for field in ("u", "w")] + [*results.displacements.values()]
    largest = max(float(np.nanmax(np.where(cycle.counted, np.abs(values), 0.0), initial=0.0)) for values in moved)
    return round_down(SHARE * size / largest) if largest > 1e-12 * size else 1.0


def _enlarged(values: Any, factor: float) -> Any:
    """Return displacements multiplied by a factor. If the factor is 0, return zeros, even if displacements are nan."""
    return factor * values if factor else np.zeros_like(values)


def _sheet(results: Results, position: int, factor: float, extent: tuple[complex, complex]) -> MechanismAxes:
    """Prepare a picture of the mechanism at a position, with displacements multiplied by `factor`."""
    posture, places = _posture(results, position, factor), _displaced(results, position, factor)
    marks, motion = results.cycle.once(display_list), results.motion
    thin = list(_links(results, position)) if factor else []
    return MechanismAxes(posture, places, extent, marks, lambda mark: mark.direction(motion)[position], thin)


def _posture(results: Results, position: int, factor: float) -> Posture:
    """Return the posture of the displaced links at a position, with displacements multiplied by `factor`."""
    motion, bent = results.motion, results.deflection
    turned: Any = np.exp(1j * _enlarged(bent.angle[:, position], factor))
    carried = motion.origin[:, position] + _enlarged(bent.shift[:, position], factor)
    return Posture(results.mechanism, carried, motion.direction[:, position] * turned)


def _displaced(results: Results, position: int, factor: float) -> dict[tuple[str, str], complex]:
    """Return the displaced points of moving links, by link and point. Displacements are multiplied by `factor`."""
    return {
        (link.name, point): complex(position_of(results.motion, number, point)[position])
        + complex(_enlarged(results.displacements.get(point, np.zeros(position + 1))[position], factor))
        for number, link in enumerate(results.mechanism.links)
        for point in link.points
        if number
    }


def _draw_course(results: Results, axes: Axes, position: int) -> None:
    """Draw paths of points and the undeformed links at `position`. Draw links at some other positions faintly."""
    from matplotlib.collections import LineCollection

    count = results.motion.columns[0]
    ghosts = [line for ghost in range(0, count, max(1, count // GHOSTS)) for line in _links(results, ghost)]
    paths = [position_of(results.motion, number, point) for point, number in points_of(results.mechanism)]
    few = max(1, count // 180)
    for lines, style in (
        (ghosts, {"colors": "#e3e8ed", "linewidths": 0.9}),
        ([path[::few] for path in paths if np.ptp(path)], {"colors": "#b9c6d3", "linewidths": 0.6, "linestyles": ":"}),
        ([*_links(results, position), *_rollers(results, position)], {"colors": "#7c8894", "linewidths": 0.9}),
    ):
        spots = [np.stack([line.real, line.imag], axis=-1) for line in lines if np.isfinite(line).all()]
        axes.add_collection(LineCollection(spots, **style, zorder=1), autolim=False)


def _links(results: Results, position: int) -> Iterator[Any]:
    """Yield a line for each undeformed beam at a position. For a link without beams, yield the outline of the link."""
    for at, link in enumerate(results.mechanism.links[1:], 1):
        spots = {point: position_of(results.motion, at, point)[position] for point in link.points}
        yield from (np.array([spots[beam.start], spots[beam.end]]) for beam in link.beams)
        if not link.beams and len(spots) > 1:
            yield np.array([*spots.values(), next(iter(spots.values()))])


def _rollers(results: Results, position: int) -> Iterator[Any]:
    """Yield the circles of cam rollers at a position. Displacements are ignored."""
    for mark in results.cycle.once(display_list):
        if mark.kind == ROLLER:
            circle = mark.placed(position_of(results.motion, mark.at.link, mark.at.point)[position], 1.0, 0.0)
            yield np.append(circle, circle[0])


def _draw_bent(results: Results, axes: Axes, sheet: MechanismAxes, position: int, factor: float) -> None:
    """Draw the displaced links, with the deflected shape of beams, and add the names of the links."""
    along, across = (sample(results.deflection, field, STATIONS)[:, position] for field in ("u", "w"))
    directions, number = beam_directions(results.motion)[..., position], 0
    drawn: dict[str, list[Any]] = {}
    for at, link in enumerate(results.mechanism.links[1:], 1):
        lines = []
        for beam in link.beams:
            start = complex(position_of(results.motion, at, beam.start)[position])
            bent = results.deflection.length[number] * STATIONS + _enlarged(along[number] + 1j * across[number], factor)
            lines.append(start + directions[number] * bent)
            number += 1
        width = 2.4 if lines else 1.6
        if not lines:
            corners = [sheet.places[link.name, point] for point in link.points]
            lines = [np.array(corners)]
        for line in lines:
            style: dict[str, Any] = {"color": sheet.colors[link.name], "solid_capstyle": "round", "zorder": 3}
            closed = line if link.beams else np.append(line, line[0])
            axes.plot(closed.real, closed.imag, linewidth=width, **style)
        drawn[link.name] = lines
    for name, lines in drawn.items():
        longest = max(lines, key=_span)
        if _span(longest) > MIN_NAMED * sheet.unit:
            bare = not results.mechanism.links[results.mechanism.index[name]].beams
            sheet.name(name, [np.mean(longest)] if bare else longest, color=sheet.colors[name], fontsize=8)


def _span(line: Any) -> float:
    """Return the distance between the first and the last point of a line."""
    return float(abs(line[-1] - line[0]))


def _draw_scale(axes: Axes, corner: complex, width: float, factor: float | None) -> None:
    """Draw the length scale. Next to it, write the factor by which displacements are enlarged, if known."""
    length = round_down(0.22 * width)
    tick = 0.006 * width
    x, y = corner.real, corner.imag
    axes.plot([x, x, x + length, x + length], [y + tick, y, y, y + tick], color=INK, linewidth=0.9)
    enlarged = "" if factor is None else f"; displacements drawn \N{MULTIPLICATION SIGN} {written(factor)}"
    axes.text(x + length + tick, y, quantity(length, "m") + enlarged, color=SOFT)


HEAD = '<?xml version="1.0" encoding="utf-8"?>\n'


def write_stills(folder: Path, results: Results) -> None:
    """Create a folder with SVG files of the deflected mechanism, the charts over the cycle, and the maps of fields."""
    folder.mkdir()
    pictures = {"mechanism": mechanism_drawing(results, position_of_largest(results))[0]}
    over, charts = axis(results), cycle_charts(results)
    for chart, svg in zip(charts, line_charts(over, charts), strict=True):
        pictures[re.sub(r"[^a-z0-9]+", "_", chart.heading.lower()).strip("_")] = svg
    if results.scene.labels:
        pictures |= {f"maps_{number}": svg for number, svg in enumerate(cycle_maps(results, over), 1)}
    for name, svg in pictures.items():
        (folder / f"{name}.svg").write_text(HEAD + svg + "\n", encoding="utf-8")


MIN_FREE = 1_000_000  # [bytes] if a film fails with less free space, the error message reports a full disk


def write_dxf(path: Path, results: Results) -> None:
    """Write a true-size drawing of the links in the first position as a DXF file and an SVG file.

    The drawing contains outlines and holes of the links, and paths of points. The unit of length is the millimetre, or
    the inch if the report uses inches.
    """
    from exchange import DrawnLink, dxf_text, svg_text

    scene, motion = results.scene, results.motion
    unit, scale = ("in", 1 / 0.0254) if scene.report_units == "in" else ("mm", 1e3)
    links, holes = motion.mechanism.links, {name: scale * each for name, each in _holes(scene).items()}
    paths: dict[str, list[complex]] = {}
    drawn: list[dict[str, complex]] = []
    for at, link in enumerate(links):
        course = {point: np.ravel(scale * position_of(motion, at, point)) for point in link.points}
        drawn.append({point: complex(places[0]) for point, places in course.items()})
        paths |= {point: places.tolist() for point, places in course.items() if at and np.ptp(places) != 0}
    beams: list[list[tuple[complex, complex, float, float]]] = [[] for _ in links]
    for (at, beam), section in zip(motion.mechanism.beams, scene.sections, strict=True):
        first = float(scale * section.fibre)
        last = first if section.taper is None else first * sum(section.taper.fibre)
        beams[at].append((drawn[at][beam.start], drawn[at][beam.end], first, last))
    parts = [
        DrawnLink(link.name, places, own, {point: holes[point] for point in places if point in holes})
        for link, places, own in zip(links[1:], drawn[1:], beams[1:], strict=True)
        if " " not in link.name  # skip the blocks of slots, which are the only links with a space in their name
    ]
    path.write_text(dxf_text(parts, drawn[0], paths, unit), encoding="utf-8")
    path.with_suffix(".svg").write_text(svg_text(parts, drawn[0], paths, unit), encoding="utf-8")


def write_cam(path: Path, scene: Scene, name: str) -> None:
    """Write a true-size drawing of a cam as a DXF file and an SVG file.

    The drawing contains profile, shaft and pitch curve. Coordinates are in the axes of the cam.
    """
    from exchange import dxf_text, svg_text

    unit, scale = ("in", 1 / 0.0254) if scene.report_units == "in" else ("mm", 1e3)
    flanks = cam_outline(scene, name, PROFILE)
    words = ("", " outer") if len(flanks) > 1 else ("",)
    curves = {
        f"cam {name}{word}": (scale * np.ravel(flank.profile)).tolist()
        for word, flank in zip(words, flanks, strict=True)
    }
    if scene.cams[name].roller is not None:
        curves[f"pitch {name}"] = (scale * np.ravel(flanks[0].pitch)).tolist()
    shaft = {"shaft": 0j}
    path.write_text(dxf_text((), shaft, {}, unit, curves), encoding="utf-8")
    path.with_suffix(".svg").write_text(svg_text((), shaft, {}, unit, curves), encoding="utf-8")


def _holes(scene: Scene) -> dict[str, float]:
    """Return the diameter of the hole at each joint [m], by joint. Joints with unknown diameters are left out.

    The diameter is that of the eye. Without an eye, it is that of the pin or else of the plain bearing.
    """
    parts = {name: each.eye or each.pin or each.plain for name, each in scene.bearings.items()}
    return {
        name: float(each.diameter) for name, each in parts.items() if each is not None and hasattr(each, "diameter")
    }


def require_rendering() -> None:
    """Raise RequestError if this computer cannot render films, or ModuleNotFoundError if a package is missing."""
    from animations import RenderingUnavailable, probe

    # Check the packages first, because `probe` would report a missing package as a missing graphics driver.
    for name in ("pyvista", "vtkmodules"):
        if not find_spec(name):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    try:
        probe()
    except RenderingUnavailable as error:
        raise RequestError(f"--animate: {error}") from None


def draw_film(
    part: Path, results: Results, diagram: str, request: Request, on_frame: Callable[[int, int], None]
) -> None:
    """Write a film that shows a diagram on the moving mechanism, or write the frames as numbered pictures.

    Raises
    ------
    RequestError
        `diagram` is unknown or has no values, or there are fewer positions than requested frames.
    OSError
        The film cannot be written.
    """
    from animations import RATE, movie

    target, rate = part / f"{diagram}.{request.picture}", request.fps or RATE
    try:
        movie(results.deflection, diagram, target, request.frames, style_of(results.scene, request), on_frame, rate)
    except ValueError as error:
        raise RequestError(f"--animate {diagram}: {error}") from None
    except OSError as error:
        raise _without_encoder(error, target) from None


def _without_encoder(error: OSError, target: Path) -> OSError:
    """Return the error of a failed film. If the encoder (ffmpeg) failed, replace the message by a readable one.

    The original message of a failed encoder contains only a command line.
    """
    if error.errno not in (None, errno.EPIPE):
        return error
    if shutil.disk_usage(target.parent).free < MIN_FREE:
        return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))
    return OSError(errno.EPIPE, "the encoder of films (ffmpeg) ended early", str(target))


def style_of(scene: Scene, request: Request) -> Style:
    """Return the drawing style of a film, from the options of the run and the outlines in the scene."""
    from animations import Style

    asked = {name: getattr(request, name) for name in ("size", "exaggeration", "background", "show")}
    given = {name: value for name, value in asked.items() if value is not None}
    # repeat corners if there are only one or two, because a polygon needs three
    outlines = {name: (corners * 2)[: max(len(corners), 3)] for name, corners in scene.outlines.items()}
    return Style(title=scene.title, outlines=outlines, marks=symbols_of(scene), look=request.style, **given)
