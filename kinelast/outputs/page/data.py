"""Data in the HTML report on a mechanism: motion, forces, fields (quantities along beams), links, beams and joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from elastic import FIELDS, coefficients
from elastic.links import BeamRuns, members_of
from kinelast.answers.results import Results
from kinelast.figures.cycle import EXTREME_FIELDS, Cycle
from kinelast.outputs.display import display_list, extent
from kinelast.scene.drive_values import of_drives
from kinelast.scene.parts.cam_courses import cam_flanks, cam_force, cam_outline, cam_pressure, cam_torque
from kinelast.scene.parts.motors import motor_speed, motor_torque
from kinelast.values.figure import drive_words
from rigid.arrays import Integers, Reals
from symbols import plain_marks

BUDGET = 2_400_000  # [bytes] if the arrays are larger than this, the page contains only some positions
STORED = ("N", "M", "u", "w")  # keys of the fields (quantities along beams) that are always stored in the page
# field: (field to integrate, number of integrations, stiffness); for example, w is the double integral of M / EI
INTEGRALS = {"w": ("M", 2, "EI"), "u": ("N", 1, "EA")}
# fields that the page usually computes as derivatives of stored fields, see `field_coefficients`
FOLLOWING = ("V", "phi", "q_x", "q_y")
# fields that scene.js always computes from stored fields
EVALUATED = ("chord", "axial", "left", "right", "shear")
OUTLINE = 360  # number of points of the outline of a cam
# for each array about cams: function that computes a row of the array from the cycle and the name of a cam
CAM_ROWS: dict[str, Callable[[Cycle, str], Any]] = {
    "cam_pressure_angle": lambda cycle, name: cam_flanks(cycle, name)[0].pressure_angle,
    "cam_force": cam_force,
    "cam_torque": cam_torque,
    "cam_pressure": cam_pressure,
}
EPS = float(np.finfo(float).eps)
REGISTERED = ("key", "symbol", "name", "unit", "greatest_of", "root_of", "signed")  # attributes of a field in the page


def add_fields(store: Numbers, results: Results, taken: Any) -> None:
    """Add the polynomial coefficients of the fields to `store`.

    If the page can compute a field by integrating another field, only the integration constants are added. `taken` is a
    function that returns the part of an array that belongs to the positions on the page.
    """
    bent, fields = results.deflection, field_coefficients(results)
    for field, values in fields.items():
        name, kept = f"field.{field}", len(values)
        if field in INTEGRALS and bent.division.whole:
            of, count, rigidity = INTEGRALS[field]
            rows = zip(bent.length, (getattr(section, rigidity) for section in bent.sections), strict=True)
            factors = np.array([np.ravel(length)[0] ** count / np.ravel(size)[0] for length, size in rows])
            if _integrates(values, fields[of], count, factors):
                kept = count
                store.integrals[name] = (f"field.{of}", count, factors.tolist())
        store.add(name, taken(values[:kept]))


def _integrates(values: Any, source: Any, count: int, factors: Any) -> bool:
    """Return True if integrating `source` `count` times gives `values`.

    Integration constants and differences by round-off are ignored. Both arrays contain polynomial coefficients.
    """
    if len(values) != len(source) + count or not np.isfinite(factors).all():
        return False
    products = [math.prod(range(k + 1, k + count + 1)) for k in range(len(source))]
    found = source * factors[:, None] / np.array(products, float)[:, None, None]
    off, greatest = np.abs(found - values[count:]), np.abs(values[count:]).max(axis=(0, 2), initial=0.0)
    return bool((np.isnan(found) == np.isnan(values[count:])).all() and not (off > 4 * EPS * greatest[:, None]).any())


def field_coefficients(results: Results) -> dict[str, Any]:
    """Return the polynomial coefficients of each field, shape (coefficients, pieces, positions), by key of the field.

    The variable of a polynomial is the coordinate along a piece of a beam (0 to 1). A field in `FOLLOWING` is left out
    if it is the derivative of a stored field. With shear deformation, for example, phi is not the derivative of w.
    Other fields that the page computes from stored fields are left out too.
    """
    bent = results.deflection
    sheared = any(np.isfinite(section.kGA) for section in bent.sections)
    # If the axes rotate with the sections of a beam, no field is the integral of another field.
    none_follows = bent.amplitudes.free is not None or not bent.division.whole
    apart = {"phi": sheared, "V": bent.couple is not None}  # whether phi differs from w', and whether V differs from M'
    others = [field for field in FOLLOWING if none_follows or apart.get(field)]
    made = [key for key, field in FIELDS.items() if not field.greatest_of and not field.root_of]
    others += [key for key in made if key not in (*STORED, *FOLLOWING, *EVALUATED)]
    return {field: coefficients(bent, field) for field in (*STORED, *others)}


def kept_positions(results: Results) -> Integers:
    """Return the indices of the positions on the page.

    If the arrays for all positions would be larger than `BUDGET`, return every n-th position, and the positions at
    which the fields have their largest values.
    """
    count, beams, links = len(results.motion.time), len(results.scene.labels), len(results.mechanism.links)
    joints = len(results.deflection.forces.force)
    doubles = 23 * beams + 12 * links + 3 * joints + 3 * len(results.mechanism.drives)
    each = 8 * doubles + 4 * ((len(results.cycle.extremes) + 1) * beams + links)
    step = -(-count * each // BUDGET)
    if step <= 1:
        return np.arange(count)
    peaks = (peak for key in EXTREME_FIELDS for peak in results.figures.of_field(key))
    times = [peak.time for peak in peaks if peak.time == peak.time]
    at = np.searchsorted(results.motion.time, times)
    return np.array(sorted({*range(0, count, step), *np.clip(at, 0, count - 1).tolist()}))


def numbers_of(results: Results, kept: Any) -> Numbers:
    """Return all arrays for the page. The arrays contain only the positions with the indices `kept`."""
    motion, bent, store = results.motion, results.deflection, Numbers()
    count = len(motion.time)
    every = len(kept) == count

    def taken(values: Any) -> Reals:
        if np.shape(values)[-1:] != (count,):
            values = np.broadcast_to(values, (*np.shape(values)[:-1], count))
        return np.asarray(values if every else values[..., kept])

    store.add("time", taken(motion.time))
    for name in ("drive", "drive_rate"):
        store.add(name, taken(getattr(motion, name)))
    store.add("effort", taken(results.cycle.efforts))
    for name, of in (("motor_speed", motor_speed), ("motor_torque", motor_torque)):
        rows = of_drives("motors", of)(results.cycle)
        store.add(name, np.array([taken(values) for values in rows]).reshape(-1, len(kept)))
    for name, of_cam in CAM_ROWS.items():
        rows = [taken(of_cam(results.cycle, cam)) for cam in results.scene.cams]
        store.add(name, np.array(rows).reshape(-1, len(kept)))
    x_axes = [taken(mark.direction(motion)) for mark in results.cycle.once(display_list) if mark.x_axis_of]
    store.add("x_axis", np.array(x_axes, complex).reshape(-1, len(kept)))
    for name in ("origin", "direction", "velocity", "acceleration", "angular_velocity", "angular_acceleration"):
        store.add(name, taken(getattr(motion, name)[1:]))
    store.add("shift", taken(bent.shift[1:]))
    store.add("angle", taken(bent.angle[1:]))
    forces = bent.forces
    for name, values in (("force", [force for force, _ in forces.in_joints]), ("ground_force", [forces.ground_force])):
        store.add(name, np.array([taken(np.asarray(value, complex)) for value in values]).reshape(-1, len(kept)))
    store.add("ground_moment", taken(np.asarray(forces.ground_moment, float))[None])
    store.add("counted", taken(results.cycle.counted.astype(float)), "f")
    if results.scene.labels:
        add_fields(store, results, taken)
        if not bent.division.whole:
            store.add("piece.start", taken(bent.division.start))
            store.add("piece.width", taken(bent.division.width))
        for field, extreme in results.cycle.extremes.items():
            store.add(f"extreme.{field}", taken(extreme.value), "f")
    return store


def model_of(results: Results, kept: Any, store: Numbers) -> dict[str, Any]:
    """Return the links, beams, symbols, cams, joints and drives as plain data for JSON."""
    mechanism, bent, marks = results.mechanism, results.deflection, results.cycle.once(display_list)
    return {
        "fields": [{name: getattr(field, name) for name in REGISTERED} for field in FIELDS.values()],
        "units": results.scene.shown_in,
        "arrays": store.places,
        "integrals": store.integrals,
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
        "marks": plain_marks(marks, mechanism),
        "extent": [_pair(corner) for corner in extent(results)],
        "cams": list(_cams(results)),
        "drives": [
            {"name": name, "coordinate": coordinate, "unit": unit, "effort": effort}
            for name, coordinate, unit, effort in drive_words(mechanism)
        ],
        "joints": [
            {"name": name, "on": link, "link": owner, "point": point}
            for (name, link), (owner, point) in zip(results.joint_words, _joint_points(results), strict=True)
        ],
    }


def _cams(results: Results) -> Iterator[dict[str, Any]]:
    """Yield plain data of each cam: shaft, follower, pitch curve and flanks. Coordinates are in the axes of the cam."""
    for name, cam in results.scene.cams.items():
        flanks = cam_outline(results.scene, name, OUTLINE)
        yield {
            "name": name,
            "link": cam.link,
            "centre": _pair(np.ravel(cam.centre)[0]),
            "roller": None if cam.roller is None else _pair(np.ravel(cam.roller)[0]),
            "radius": float(np.ravel(cam.radius)[0]),
            "face": None if cam.face is None else [_pair(np.ravel(end)[0]) for end in cam.face],
            "outer": [*cam.flanks],
            "pitch": [] if cam.roller is None else [_pair(place) for place in np.ravel(flanks[0].pitch)],
            "flanks": [[_pair(place) for place in np.ravel(flank.profile)] for flank in flanks],
        }


def _joint_points(results: Results) -> Iterator[tuple[int, str]]:
    """Yield the point of application of each joint force: the number of a link, and the name of a point of the link.

    The force of a slider acts at a point of the block.
    """
    for joint in results.motion.structure.joints:
        link = joint.child if joint.child_point else joint.parent
        yield link, joint.point(link) or ""


def _beams(results: Results) -> list[dict[str, Any]]:
    """Return plain data of each beam: label, link, ends, length, section and member."""
    rows, members = [], members_of(results.mechanism)
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
                "member": _member(members, number),
                "area": _first(section.area),
                "inertia": _first(section.inertia),
                "fibre": _first(section.fibre),
                "peak_shear": _first(section.peak_shear),
                "taper": None
                if taper is None
                else {name: list(map(float, getattr(taper, name))) for name in ("EA", "EI", "fibre", "peak_shear")},
            }
        )
    return rows


def _member(members: BeamRuns, number: int) -> dict[str, Any]:
    """Return plain data of the member (straight row of connected beams) that contains the beam `number`.

    The entries `first` and `last` describe the two ends of the member: number of the outermost beam, coordinate xi of
    the end on the outermost beam (0 or 1), and a sign. The sign is -1 if the outermost beam and the beam `number` have
    opposite directions. The entries `begin` and `rise` are the start and the width of the beam `number` on the member.
    """
    run = members.runs[members.number[number]]
    at = run.beams.index(number)
    ends = (
        (run.beams[end], float((end == 0) == run.turned[end]), 1 if run.turned[end] == run.turned[at] else -1)
        for end in (0, -1)
    )
    return {
        **dict(zip(("first", "last"), ends, strict=True)),
        "begin": _first(run.start[at]),
        "rise": _first(run.width[at]),
    }


def _first(value: Any) -> float:
    """Return the first value of an array, or the value itself if it is a number."""
    return float(np.ravel(value)[0])


def _pair(place: Any) -> tuple[float, float]:
    size = complex(np.ravel(place)[0])
    return size.real, size.imag


class Numbers:
    """Arrays in binary form, stored row by row. A row has one value for each position or design.

    Attributes
    ----------
    places
        Description of each array, by name of the array. The description has four items: number type "d" (float64) or
        "f" (float32); shape without the last axis; whether the array is complex; list with an entry for each row.
        A complex array has separate rows for real and imaginary parts. If all values of a row are equal, the entry of
        the row is this value, and the row is not stored. For a stored row, the entry is None.
    integrals
        Description of each array of coefficients that the page computes by integration, by name of the array: name of
        the array to integrate, number of integrations, and a factor for each piece of a beam.
    """

    def __init__(self) -> None:
        self.places: dict[str, tuple[str, tuple[int, ...], bool, list[float | None]]] = {}
        self.integrals: dict[str, tuple[str, int, list[float]]] = {}
        self._parts: dict[str, list[Any]] = {"d": [], "f": []}

    def add(self, name: str, values: Any, kind: str = "d") -> None:
        """Add an array. Store the numbers as float64 if `kind` is "d", or as float32 if `kind` is "f"."""
        values = np.asarray(values)
        shape, vectors = values.shape[:-1], np.iscomplexobj(values)
        rows = np.stack([values.real, values.imag], axis=-2) if vectors else values
        rows = rows.reshape(-1, values.shape[-1])
        alike = (rows == rows[:, :1]).all(axis=1) & np.isfinite(rows[:, 0])
        first = rows[:, 0].tolist()
        same = [value if one else None for value, one in zip(first, alike.tolist(), strict=True)]
        self.places[name] = (kind, shape, vectors, same)
        self._parts[kind].append(np.ascontiguousarray(rows[~alike], "<f8" if kind == "d" else "<f4"))

    def bytes(self) -> bytes:
        """Return all stored numbers, little-endian: first the float64 numbers, then the float32 numbers.

        They are not compressed, because this would save only a fifth.
        """
        return b"".join(part.tobytes() for parts in self._parts.values() for part in parts)
