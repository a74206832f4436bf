"""Reserves of the items of a machine, such as links and motors, against limits and failure.

A reserve is the factor by which the load may grow.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from kinelast.answers.refusals import STRENGTH
from kinelast.answers.results import Results
from kinelast.figures.leading_drive import nominal_speed
from kinelast.figures.measures import bounded_items
from kinelast.figures.registry import OF_OUTPUTS, figures_of
from kinelast.reports.doubted import LIMIT_NAMES
from kinelast.reports.limits import judged_limit, judged_row
from kinelast.reports.report import Reserve
from kinelast.scene.data import Scene
from kinelast.scene.parts.fatigue import FATIGUED
from kinelast.values.figure import BEAM, MACHINE, Limit, items_of
from kinelast.values.reading import Reader, Reading, reading

LIMIT, LIMIT_SPEED, ENDURANCE = "limit", "limit speed", "endurance"
FAILURES = {  # for each failure mode, its limit and its name in words
    "yield": (STRENGTH, "yield (safety factor)"),
    ENDURANCE: (Limit(ENDURANCE, 1.0, least=True, unit="1", of=FATIGUED), "fatigue (safety factor)"),
    "buckling": (Limit("buckling", 1.0, unit="1"), "buckling (load / critical load)"),
}


def breaks_first(results: Results) -> list[Reserve]:
    """Return the reserves of all items against the limits of the scene and, for links, against failure.

    The reserves are sorted, the smallest first. A reserve is the limit divided by the figure (the limited result). For
    a lower bound, it is the figure divided by the limit. If the figure is proportional to a power of the load, as a
    life is, the reserve is the corresponding root, so that it is a load factor too. Reserves against yield, fatigue and
    buckling are included even if the scene has no limits on them. If the scene limits the life of a link and this life
    is finite, the reserve against fatigue is left out. `kinelast.runs` adds the reserve of the limit speed on request.
    """
    reader = Reader(results)
    rows = [row for limit in results.limits for row in _reserves(reader, limit, LIMIT)]
    lives = {row.item for row in rows if row.figure == "life" and row.found.value is not None}
    for mode, (limit, name) in FAILURES.items():
        if results.figures.peaks.get(limit.figure):
            failures = [row for row in _reserves(reader, limit, mode, name) if row.reserve.value is not None]
            rows += [row for row in failures if mode != ENDURANCE or row.item not in lives]
    return sorted(rows, key=_size)


def _size(row: Reserve) -> float:
    return math.inf if row.reserve.value is None else row.reserve.value


def _reserves(reader: Reader, limit: Limit, mode: str, name: str = "") -> Iterator[Reserve]:
    """Yield the reserve of each item to which a limit applies.

    The reserve of a link is the smallest of those of its beams. Nothing is yielded if the figure does not exist, e.g.
    for a limit on the output if there is no output.
    """
    results, scene = reader.results, reader.scene
    figure = next((each for each in figures_of(results.figures.output) if each.key == limit.figure), None)
    if figure is None:
        return
    names = items_of(scene, limit.of)
    if limit.of in (BEAM, FATIGUED):
        names = [scene.mechanism.links[at].name for at, _ in scene.mechanism.beams]
    items: dict[str, list[int]] = {}
    for number in bounded_items(scene, limit):
        items.setdefault(names[number], []).append(number)
    output = results.figures.output
    for item, numbers in items.items():
        judged = judged_limit(results, limit, numbers)
        row = judged_row(reader, judged)
        words = name or LIMIT_NAMES.get(row.kind, row.name)
        exponent = figure.load_exponent(scene, judged.item)
        reserve = _reserve(limit, judged.value, row.found, exponent)
        of = limit.of.noun or limit.of.name, item
        if output and limit.figure in OF_OUTPUTS:
            of = "output", output.point or output.link
        yield Reserve(*of, mode, limit.figure, words, limit.least, row.limit, row.found, reserve)


def _reserve(limit: Limit, value: float, figure: Reading, exponent: float) -> Reading:
    """Return the reserve of a value. The error in the reserve follows from the error in the value.

    No ratio can be formed with a limit of zero or less. The reserve is then 0 if the limit is violated, otherwise
    infinite.
    """
    if limit.bound > 0.0:
        used = float(limit.used(0.0 if figure.value == 0.0 else value))
        ratio = math.inf if used == 0.0 else 1.0 / used
    else:
        ratio = math.inf if limit.kept(value) else 0.0
    reserve = ratio ** (1.0 / exponent)
    more: dict[str, Any] = {}
    if figure.error and figure.value and math.isfinite(reserve):
        more = {"error": reserve * figure.error / abs(figure.value) / exponent, "unreliable": figure.unreliable}
    return reading(reserve, "1", **more)


def with_limit_speed(rows: Sequence[Reserve], speeds: Mapping[str, Any], scene: Scene) -> list[Reserve]:
    """Return the rows of `breaks_first` and, if there is a limit speed, a row with its ratio to the speed of the scene.

    Parameters
    ----------
    speeds
        Plain data of the speeds, as returned by `kinelast.outputs.speeds.speed_figures`.
    """
    highest, nominal, unit = speeds["highest_within_limits"], nominal_speed(scene), speeds["unit"]
    if not speeds["limit"] or not highest:
        return [*rows]
    values = (reading(value, each) for value, each in ((highest, unit), (nominal, unit), (highest / nominal, "1")))
    row = Reserve(MACHINE, "", LIMIT_SPEED, "", LIMIT_SPEED, False, *values)
    return sorted([*rows, row], key=_size)
