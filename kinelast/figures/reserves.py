"""Reserves of the links: load factors until they fail."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from kinelast.figures.entry import bounded_items
from kinelast.figures.reader import Reader, error_entries
from kinelast.figures.report import LinkReserves
from kinelast.figures.results import Results
from kinelast.scene.figure import BEAM
from kinelast.scene.limits import Limit
from kinelast.scene.reading import Reading, reading

RESERVES = {  # figure of each mode of failure, and its exponent in the reserve
    "yield": ("safety", 1.0),
    "endurance": ("endurance", 1.0),
    "buckling": ("buckling", -1.0),
}


def breaks_first(results: Results) -> list[LinkReserves]:
    """Return the reserves of each link: load factors until it fails, the link with the smallest reserve first.

    Modes are yield, endurance and buckling, if known, and the limits of beam figures. A limit of a finite life replaces
    endurance by the stress factor from the slope of the S-N line. `kinelast.runs` adds the limit speed on request.
    """
    reader, limits = Reader(results), [(limit, bounded_items(results.scene, limit)) for limit in results.limits]
    rows = []
    for number, link in enumerate(results.mechanism.links):
        beams = [beam for beam, (owner, _) in enumerate(results.mechanism.beams) if owner == number]
        if reserves := dict(_reserves(reader, limits, beams)) if beams else {}:
            rows.append(reserves_of(link.name, reserves))
    return sorted(rows, key=reserve_of)


def reserves_of(link: str, reserves: Mapping[str, Reading]) -> LinkReserves:
    """Return the reserves of a link, with the smallest one."""
    mode = min(reserves, key=lambda each: _size(reserves[each]))
    return LinkReserves(link=link, governs=mode, reserve=reserves[mode], reserves=reserves)


def reserve_of(row: LinkReserves) -> float:
    """Return the smallest reserve of a link."""
    return _size(row.reserve)


def _size(found: Reading) -> float:
    return math.inf if found.value is None else found.value


def _reserves(
    reader: Reader, limits: Sequence[tuple[Limit, list[int]]], beams: Sequence[int]
) -> Iterator[tuple[str, Reading]]:
    """Yield the known modes of failure of a link, with the smallest reserve of its beams."""
    scene, peaks = reader.scene, reader.results.figures.peaks
    asked = max((float(limit.bound) for limit, items in limits if limit.figure == "life" and {*items} & {*beams}),
                default=None)  # fmt: skip
    finite = asked is not None and any(0 < peaks["life"][beam].value < math.inf for beam in beams)
    for mode, (key, power) in RESERVES.items():
        if mode == "endurance" and finite and scene.fatigue and asked is not None:
            slope = float(scene.fatigue.strengths[beams[0]].slope)
            yield from _reserve(reader, "life", "life", 1.0 / slope, beams, asked)
        else:
            yield from _reserve(reader, mode, key, power, beams, 1.0)
    of_modes = {key for key, _ in RESERVES.values()}
    for limit, items in limits:
        if limit.of == BEAM and limit.figure not in of_modes and not limit.least and limit.bound > 0:
            own = [beam for beam in beams if beam in items]
            yield from _reserve(reader, limit.figure, limit.figure, -1.0, own, float(limit.bound))


def _reserve(
    reader: Reader, mode: str, key: str, power: float, beams: Sequence[int], bound: float
) -> Iterator[tuple[str, Reading]]:
    peaks = reader.results.figures.peaks.get(key) or []
    finite = [(beam, peaks[beam]) for beam in beams if peaks and math.isfinite(peaks[beam].value) and peaks[beam].value]
    if finite:
        beam, peak = min(finite, key=lambda each: abs(each[1].value) ** power)
        value = (abs(peak.value) / bound) ** power
        error = error_entries(value, peak.error_size * abs(power) * value / abs(peak.value))
        yield mode, reading(value, "1", **error, label=reader.scene.labels[beam], **reader.at_peak(peak))
