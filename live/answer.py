"""Answers of the editor to the text of a scene: errors with line numbers, drawn parts, motion and deflection.

A quick answer is a quasi-static analysis at a few positions. A full answer uses the theory and accuracy that the scene
requests. Both contain a picture: the parts, motion, deflection and stress of the mechanism as plain data and arrays.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

import rigid
from elastic import without_positions
from kinelast.answers.refusals import needed_by_limits, refusals
from kinelast.answers.results import Results
from kinelast.figures.cycle import Cycle
from kinelast.figures.measures import bounded_items, magnitudes
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of, limits_of
from kinelast.outputs.positions import motion_table, position_table
from kinelast.outputs.table import Column
from kinelast.reports.doubted import LIMIT_NAMES
from kinelast.reports.limits import decisive
from kinelast.scene.data import Scene, require_reached, require_tables, scene_deflection
from kinelast.scene.document import Document, document_from_dict
from kinelast.scene.limits import tolerance
from kinelast.scene.parsing import read_toml
from kinelast.scene.text import reader_in
from kinelast.scene.variables import numbers, place_of
from kinelast.values.error import SceneError
from kinelast.values.figure import LEAST, Figure, Limit, items_of
from live.edit import BARE
from live.marks import drawn_marks, sheet
from live.picture import picture
from live.text import line_of, mistakes_of, places
from rigid import MechanismError, Motion, Reals, reachable

POSITIONS, FRAMES = 72, 120  # maximum number of positions in the picture of a quick answer, and of a full answer
MAX_BEND, SAME = 0.5, 1e-7  # see `_near_motion`: tolerances of the third and the first condition
SHOWN = ("deflection", "chord", "stress", "safety", "drive_effort", "joint_force", "shaking_force",
        "transmission_angle", "output_error", "mass")  # fmt: skip
MAX_NUMBERS = 400  # maximum number of input values that the page offers for changes
Answer = dict[str, Any]


@dataclass
class Memory:
    """Motion of the last picture. During a drag, it is the first approximation of the next motion."""

    motion: Motion | None = None


def quick_answer(
    text: str,
    name: str = "scene",
    with_numbers: bool = False,
    dragged: bool = False,
    memory: Memory | None = None,
    folder: Path | None = None,
    graph: str = "",
) -> tuple[Answer, bytes]:
    """Solve a scene quasi-statically at a few positions; return plain data and the arrays of the picture.

    Errors are part of the plain data and are not raised. A scene without points, moving links and sliders has no
    picture and no errors.

    Parameters
    ----------
    with_numbers
        Whether the data contain the tables of the scene and its adjustable numbers.
    dragged
        Whether the user is dragging a part. The computation is then faster, and the picture has less data.
    memory
        Motion of the last picture. It is replaced by the new motion.
    folder
        Folder of the files to which the text refers.
    graph
        Name of the only column for the graph. By default, the picture contains all columns (none during a drag).
    """
    answer: Answer = {"mistakes": [], "sheet": None, "numbers": None, "picture": None}
    data = b""
    try:
        tables = read_toml(text)
        answer["sheet"] = sheet(tables)
        if with_numbers:
            answer["sheet"]["tables"] = tables
        if answer["sheet"]["empty"]:
            return {**answer, "numbers": [] if with_numbers else None}, data
        document = replace(document_from_dict(tables, name, read=reader_in(folder)), source=text)
        if with_numbers:
            answer["numbers"] = adjustable_numbers(document, text)
        with np.errstate(all="ignore"):
            scene = document.with_positions(min(POSITIONS, document.table.run.positions)).scene
            answer["picture"], data = _picture_until_stop(scene, dragged, memory or Memory(), graph)
    except (SceneError, MechanismError, ValueError) as error:
        answer["mistakes"] = mistakes_of(error, text, reader_in(folder))
    except Exception as error:  # the page continues with the next text
        answer["mistakes"] = [{"line": None, "message": f"the program failed, please report this: {error!r}"}]
    if answer["sheet"] and not answer["picture"]:
        answer["sheet"]["marks"] = drawn_marks(tables, answer["sheet"])
    return answer, data


def adjustable_numbers(document: Document, text: str) -> list[Answer]:
    """Return the numbers in a scene, each with its value, SI unit, line, and the range of its slider on the page."""
    known, table = places(text), document.table
    offers: list[Answer] = []
    written = {key[:2] for key in (*known.values, *known.tables)}
    for path in numbers(table):
        if len(offers) == MAX_NUMBERS:
            break
        try:
            place = place_of(table, path)
            low, high = _range(document, path, place.variable.base)
        except SceneError:
            continue
        if place.names[0] in ("materials", "sections") and tuple(place.names[:2]) not in written:
            continue  # the number is in a library file
        first = known.nearest(tuple(place.names))
        offers.append(
            {
                "path": path,
                "unit": "1" if place.variable.unit in BARE else place.variable.unit,
                "value": place.variable.base,
                "line": None if first is None else line_of(text, first),
                "low": low,
                "high": high,
                "whole": isinstance(place.leaf, int),
            }
        )
    return offers


def _range(document: Document, path: str, base: float) -> tuple[float, float]:
    """Return the range of a slider: the range of the number in a sweep, or its tolerance.

    By default, the range is from half the value to twice the value.
    """
    table = document.table
    swept = table.sweep.vary.get(path)
    if swept is not None and not isinstance(swept, list):
        return document.value(path, swept.start), document.value(path, swept.end)
    if isinstance(swept, list):
        values = [document.value(path, each) for each in swept]
        return min(values), max(values)
    if path in table.tolerances:
        _, half, _ = tolerance(table, path, table.tolerances[path])
        return base - half, base + half
    if base == 0:
        return -0.1, 0.1
    return min(base / 2, base * 2), max(base / 2, base * 2)


def _picture_until_stop(scene: Scene, dragged: bool, memory: Memory, graph: str) -> tuple[Answer, bytes]:
    """Return the picture of a scene. If the motion stops, the picture ends at the last position that closes.

    A message states where the motion stops. During a drag, it states the last position that closes. Otherwise, it
    states the exact stop, which takes longer to compute than the rest of the picture.

    Raises
    ------
    SceneError
        The mechanism does not close at the first position.
    """
    times = scene.course.times()
    near = _near_motion(scene, times, memory.motion) if dragged else None
    moved = near or scene.course.at(times)
    memory.motion = moved
    ok = reachable(moved)
    closes: Answer = {"all": bool(ok.all()), "share": 1.0, "words": ""}
    if not ok.all():
        count = _reached(moved)
        if count == 0:
            require_reached(scene, moved)
        closes["share"] = count / len(times)
        closes["words"] = _stop_message(scene, moved, count) if dragged else _reach_message(scene, moved)
        cut = rigid.posture(moved, slice(0, count))
        moved = scene.course.at(times[:count]) if near is None else scene.course.near(times[:count], cut)
    require_tables(scene, moved)
    bent = scene_deflection(scene, moved)
    buckles, output = Results(scene, bent).buckles, output_of(scene, bent, any_instants=dragged)
    bent = without_positions(bent) if buckles else bent
    cycle = Cycle(scene, moved, bent, sampled=True)
    chosen = [each for each in figures_of(output) if each.key in _wanted(scene)]
    columns = columns_of(Results(scene, cycle.deflection), graph) if graph or not dragged else ()
    drawing, data = picture(scene, cycle.deflection, cycle.efforts, columns, POSITIONS)
    values = magnitudes(cycle, chosen)
    return {
        **drawing,
        "figures": figure_rows(scene, chosen, values),
        "limits": limit_rows(scene, values),
        "closes": closes,
        "buckles": buckles,
        "theory": "quasi-static",
        "quick": True,
    }, data


def _near_motion(scene: Scene, times: Reals, before: Motion | None) -> Motion | None:
    """Compute the motion quickly, from an earlier motion of the mechanism as first approximation.

    Return None if the motion may be on another branch than the drawn mechanism. Otherwise, three conditions are met:

    - The motion starts in the same posture as the motion from the drawing.
    - No group changes its assembly mode.
    - The difference between successive steps is less than `MAX_BEND` * sine. The sine of a group measures the distance
      between its assembly modes.

    If the motion stops, the sine decreases to almost zero before the stop. The third condition is not checked there.
    These conditions are reliable enough for a picture during a drag.
    """
    if before is None or before.columns != times.shape or _parts(before) != _parts(scene):
        return None
    free = [closed.group for closed in before.closures if closed.group.free]
    if not (all(group.closed_form for group in free) or reachable(before).all()):
        return None
    known = np.arange(len(times)) < _reached(before)  # at the positions after a stop, use the drawn assembly mode
    here = rigid.posture(before)
    here = replace(here, origin=np.where(known, here.origin, np.nan), direction=np.where(known, here.direction, np.nan))
    moved = scene.course.near(times, here)
    count = _reached(moved)
    sine, size = moved.sine[:count], scene.mechanism.size
    folds = [
        np.sign(closed.sine[..., : count + 1])
        for closed in moved.closures
        if closed.group.free and np.ndim(closed.sine)
    ]
    while len(times) > count > 2 and len(sine) > 1 and sine[-1] < sine[-2]:
        sine = sine[:-1]
    course = np.concatenate([moved.direction[:, : len(sine)], moved.origin[:, : len(sine)] / size])
    bend = np.abs(np.diff(course, 2, axis=-1)).max(axis=0, initial=0.0)
    least = np.minimum(np.minimum(sine[2:], sine[:-2]), sine[1:-1])
    if count < 3 or not ((bend < MAX_BEND * least).all() and (sine > 0.0).all()):
        return None
    if any((np.isfinite(fold) & (fold != fold[..., :1])).any() for fold in folds):
        return None
    first = scene.course.at(times[:1])
    away = np.abs(moved.direction[:, :1] - first.direction).max(), np.abs(moved.origin[:, :1] - first.origin).max()
    return moved if max(away) < SAME * max(1.0, size) else None


def _reached(moved: Motion) -> int:
    """Return the number of positions before the first one that does not close."""
    ok = reachable(moved)
    return len(ok) if ok.all() else int(ok.argmin())


def _parts(of: Motion | Scene) -> list[list[str]]:
    return [[link.name, *link.points] for link in of.mechanism.links]


def _reach_message(scene: Scene, moved: Motion) -> str:
    """Return a message about the exact position at which a motion stops, and the joint that opens there."""
    try:
        require_reached(scene, moved)
    except SceneError as error:
        return error.problem
    return ""


def _stop_message(scene: Scene, moved: Motion, count: int) -> str:
    """Return a message about the last of `count` positions that close, and the joint that opens after it."""
    ends = [(moved.drive[:, count - 1], rigid.opening_joint(moved, slice(count, count + 1)))]
    return rigid.reach_message(moved, ends, scene.shown_in.get("m", (1.0, "m")))


def whole_picture(results: Results) -> tuple[Answer, bytes]:
    """Return the picture of a full answer. It contains the main figures (e.g. the largest stress) and their errors."""
    scene, peaks = results.scene, results.figures.peaks
    chosen = [each for each in results.figures.figures if each.key in _wanted(scene)]
    values = {each.key: np.array([abs(peak.value) for peak in peaks[each.key]]) for each in chosen}
    drawing, data = picture(scene, results.deflection, results.cycle.efforts, columns_of(results), FRAMES)
    rows = figure_rows(scene, chosen, values)
    for row in rows:
        error = peaks[row["key"]][row.pop("item")].error
        row["error"] = None if error is None else float(error.size)
    return {**drawing, "figures": rows, "limits": limit_rows(scene, values)}, data


def _wanted(scene: Scene) -> set[str]:
    return {*SHOWN, *(limit.figure for limit in limits_of(scene)), *needed_by_limits(scene)}


def columns_of(results: Results, graph: str = "") -> list[Column]:
    """Return the columns of positions.csv and motion.csv without the time, or only the column `graph`."""
    tables = position_table(results), motion_table(results)
    known = {column.name: column for table in tables for column in table.columns}
    return [column for name, column in known.items() if (name == graph if graph else name != "time")]


def figure_rows(scene: Scene, chosen: Sequence[Figure], values: Mapping[str, Any]) -> list[Answer]:
    """Return the main figures (e.g. the largest stress) in display order, each with its worst item and value."""
    rows, known = [], {figure.key: figure for figure in chosen}
    for key in SHOWN:
        sizes = values.get(key, np.zeros(0))
        if not np.isfinite(sizes).any():
            continue
        figure = known[key]
        item = int(np.nanargmin(sizes) if figure.over == LEAST else np.nanargmax(sizes))
        names = items_of(scene, figure.of)
        row = {"key": key, "name": figure.name, "value": float(sizes[item]), "unit": figure.units(scene)[item]}
        rows.append({**row, "item": item, "on": names[item], "error": None})
    return rows


def limit_rows(scene: Scene, values: Mapping[str, Any]) -> list[Answer]:
    """Return the limits of a scene, each with the value that is closest to the bound or violates it most.

    Errors of the values are not considered.
    """
    names = {figure.key: figure.name for figure in figures_of(None)}

    def judged(limit: Limit) -> bool:
        items = bounded_items(scene, limit)
        return not any(np.any(refused) for _, refused in refusals(scene, limit.figure, items, values))

    rows = [
        {
            "name": LIMIT_NAMES.get(limit.kind) or names.get(limit.figure, limit.kind.replace("_", " ")),
            "on": limit.item,
            "bound": float(np.ravel(limit.bound)[0]),
            "value": float(value),
            "unit": limit.unit or "m",
            "used": float(np.ravel(limit.used(value))[0]),
            "kept": judged(limit) and bool(limit.kept(value)),
        }
        for limit in limits_of(scene)
        for value in [decisive(scene, limit, values)]
    ]
    return most_used_first(rows)


def most_used_first(limits: Iterable[Answer]) -> list[Answer]:
    """Sort limits by decreasing utilisation. Violated limits come first."""
    return sorted(limits, key=lambda row: (row["kept"], -float(np.nan_to_num(row["used"] or 0.0))))
