"""What the page holds of a scene: its polynomials, motion and forces as numbers, and what they belong to as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from elastic import FIELDS, coefficients
from kinelast.figures.peaks import Peak
from kinelast.figures.results import Results, drive_words, joint_words
from rigid import PinDrive

BUDGET = 2_400_000  # bytes of numbers: more positions than these hold are thinned out
STORED = ("N", "M", "u", "w")
FOLLOWING = ("V", "phi", "q_x", "q_y")  # derivatives of the stored fields, unless a beam is cut or gives way in shear
EVALUATED = ("chord", "axial", "left", "right", "shear")  # of these by formulas of scene.js
REGISTERED = ("key", "symbol", "name", "unit", "greatest_of", "root_of", "signed")  # what the page knows of a field


class Numbers:
    """Arrays one behind the other, and where each begins.

    Attributes
    ----------
    places
        By name: "d" (float64) or "f" (float32), number of the first entry among those of its kind, shape.
    """

    def __init__(self) -> None:
        self.places: dict[str, tuple[str, int, tuple[int, ...]]] = {}
        self._parts: dict[str, list[Any]] = {"d": [], "f": []}
        self._ends = {"d": 0, "f": 0}

    def add(self, name: str, values: Any, kind: str = "d") -> None:
        """Put an array behind the others of its kind; complex ones get a last axis of two."""
        values = np.asarray(values)
        if np.iscomplexobj(values):
            values = np.ascontiguousarray(values).view(float).reshape(*values.shape, 2)
        self.places[name] = (kind, self._ends[kind], values.shape)
        self._parts[kind].append(np.ascontiguousarray(values, "<f8" if kind == "d" else "<f4"))
        self._ends[kind] += values.size

    def bytes(self) -> bytes:
        """All float64, then all float32, little-endian."""
        return b"".join(part.tobytes() for kind in "df" for part in self._parts[kind])


def field_coefficients(results: Results) -> dict[str, Any]:
    """Fields in powers of the way along a piece of a beam, from 0 to 1: shape (coefficients, pieces, positions).

    Of `FOLLOWING` only those that do not follow by derivation. A field that the script has no formula for is stored.
    """
    bent = results.deflection
    sheared = any(np.isfinite(section.kGA) for section in bent.sections)
    others = [field for field in FOLLOWING if not bent.division.whole or (field == "phi" and sheared)]
    made = [key for key, field in FIELDS.items() if not field.greatest_of and not field.root_of]
    others += [key for key in made if key not in (*STORED, *FOLLOWING, *EVALUATED)]
    return {field: coefficients(bent, field) for field in (*STORED, *others)}


def kept_positions(results: Results, found: dict[str, list[Peak]]) -> Any:
    """Numbers of the positions that the page holds: all, or every so many and those of the peaks."""
    count, beams, links = len(results.motion.time), len(results.scene.labels), len(results.mechanism.links)
    joints = len(results.deflection.forces.force)
    doubles = 23 * beams + 12 * links + 3 * joints + 3 * len(results.mechanism.drives)
    each = 8 * doubles + 4 * ((len(results.extremes) + 1) * beams + links)
    step = -(-count * each // BUDGET)
    if step <= 1:
        return np.arange(count)
    times = [peak.time for peaks in found.values() for peak in peaks if peak.time == peak.time and not peak.refined]
    at = np.searchsorted(results.motion.time, times)
    return np.unique(np.concatenate([np.arange(0, count, step), np.clip(at, 0, count - 1)]))


def numbers_of(results: Results, kept: Any) -> Numbers:
    """All arrays of the page at the positions `kept`; positions are the last axis (but for the parts of vectors)."""
    motion, bent, store = results.motion, results.deflection, Numbers()
    count = len(motion.time)
    every = len(kept) == count

    def taken(values: Any) -> Any:
        values = np.broadcast_to(values, (*np.shape(values)[:-1], count))
        return values if every else values[..., kept]

    store.add("time", taken(motion.time))
    for name in ("drive", "drive_rate"):
        store.add(name, taken(getattr(motion, name)))
    store.add("effort", taken(results.efforts))
    for name in ("origin", "direction", "velocity", "acceleration", "angular_velocity", "angular_acceleration"):
        store.add(name, taken(getattr(motion, name)[1:]))
    store.add("shift", taken(bent.shift[1:]))
    store.add("angle", taken(bent.angle[1:]))
    forces = bent.forces
    for name, values in (("force", forces.force), ("ground_force", [forces.ground_force])):
        store.add(name, np.array([taken(np.asarray(value, complex)) for value in values]).reshape(-1, len(kept)))
    for name, values in (("moment", forces.moment), ("ground_moment", [forces.ground_moment])):
        store.add(name, np.array([taken(np.asarray(value, float)) for value in values]).reshape(-1, len(kept)))
    store.add("counted", taken(results.counted.astype(float)), "f")
    if results.scene.labels:
        for field, values in field_coefficients(results).items():
            store.add(f"field.{field}", taken(values))
        if not bent.division.whole:
            store.add("piece.start", taken(bent.division.start))
            store.add("piece.width", taken(bent.division.width))
        for field, extreme in results.extremes.items():
            store.add(f"extreme.{field}", taken(extreme.value), "f")
    return store


def model_of(results: Results, kept: Any, store: Numbers) -> dict[str, Any]:
    """What the arrays belong to: links, beams, joints, drives, as plain data."""
    mechanism, bent = results.mechanism, results.deflection
    return {
        "fields": [{name: getattr(field, name) for name in REGISTERED} for field in FIELDS.values()],
        "arrays": store.places,
        "positions": len(kept),
        "of": len(results.motion.time),
        "left_out": results.left_out,
        "links": [
            {"name": link.name, "points": {name: _pair(place) for name, place in link.points.items()}}
            for link in mechanism.links
        ],
        "outlines": {name: [_pair(corner) for corner in corners] for name, corners in results.scene.outlines.items()},
        "beams": _beams(results),
        "pieces": bent.division.beam.tolist() if results.scene.labels else [],
        "sliders": [
            {
                "name": slider.name,
                "link": mechanism.index[slider.link],
                "on": mechanism.index[slider.on],
                "point": slider.point,
                "origin": _pair(slider.origin),
                "direction": _pair(slider.direction),
            }
            for slider in mechanism.sliders
        ],
        "drives": [
            {
                "name": name,
                "coordinate": coordinate,
                "unit": unit,
                "effort": effort,
                "link": mechanism.index[drive.link] if isinstance(drive, PinDrive) else None,
                "at": drive.at if isinstance(drive, PinDrive) else None,
                "slider": None if isinstance(drive, PinDrive) else drive.slider,
            }
            for drive, (name, coordinate, unit, effort) in zip(mechanism.drives, drive_words(mechanism), strict=True)
        ],
        "joints": [
            {"name": name, "on": link, "link": owner, "point": point}
            for (name, link), (owner, point) in zip(joint_words(results), _joint_points(results), strict=True)
        ],
    }


def _joint_points(results: Results) -> Iterator[tuple[int, str]]:
    """Per joint the number of a link and its point where the force acts: of a slider, the block."""
    for joint in results.motion.structure.joints:
        link = joint.child if joint.child_point else joint.parent
        yield link, joint.point(link) or ""


def _beams(results: Results) -> list[dict[str, Any]]:
    """Per beam: label, link, ends, length, and what turns N, V and M into stresses along it."""
    rows = []
    for number, label in enumerate(results.scene.labels):
        at, beam = results.mechanism.beams[number]
        section = results.deflection.sections[number]
        taper = section.taper
        rows.append(
            {
                "label": label,
                "link": at,
                "start": beam.start,
                "end": beam.end,
                "length": float(np.ravel(results.deflection.length[number])[0]),
                "area": _known(section.area),
                "inertia": _known(section.inertia),
                "fibre": _known(section.fibre),
                "peak_shear": _known(section.peak_shear),
                "taper": None
                if taper is None
                else {name: list(map(float, getattr(taper, name))) for name in ("EA", "EI", "fibre", "peak_shear")},
            }
        )
    return rows


def _known(value: Any) -> float | None:
    size = float(np.ravel(value)[0])
    return size if np.isfinite(size) else None


def _pair(place: Any) -> tuple[float, float]:
    size = complex(np.ravel(place)[0])
    return size.real, size.imag
