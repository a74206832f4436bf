"""Picture of a moving and bending mechanism for the editor: its parts as plain data, and arrays over the positions."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

import rigid
from elastic import Deflection, displacement_of, sample
from kinelast.outputs.table import Column
from kinelast.scene.data import Scene
from kinelast.scene.drives import DriveEffort
from kinelast.values.figure import drive_words
from live.marks import scene_marks

STATIONS = np.linspace(0.0, 1.0, 9)


def picture(
    scene: Scene, bent: Deflection, efforts: Any, columns: Sequence[Column], most: int
) -> tuple[dict[str, Any], bytes]:
    """Return the moving and bending mechanism at up to `most` positions.

    The parts are plain data. The arrays are a block of float32 numbers. `arrays` gives the start and shape of each one.
    """
    taken = slice(None, None, -(-len(bent.motion.time) // most))
    arrays: dict[str, Any] = {"time": bent.motion.time[taken], "drive": bent.motion.drive[..., taken]}
    arrays["effort"] = np.asarray(efforts)[..., taken]
    arrays["columns"] = np.array([column.values[taken] for column in columns]).reshape(
        len(columns), len(arrays["time"])
    )
    points = _points(bent)
    arrays["points"], arrays["moved"] = (_pairs([each[at][taken] for each in points.values()]) for at in (0, 1))
    marks, more = scene_marks(scene, bent.motion)
    arrays |= {name: _pairs(values)[:, taken] for name, values in more.items()}
    arrays |= {"shift": _pairs(bent.shift)[:, taken], "angle": bent.angle[:, taken]}
    arrays["rate"] = bent.motion.drive_rate[:, taken]
    if scene.labels:
        arrays |= _beams(bent, taken)
    store, data, at = {}, [], 0
    for name, values in arrays.items():
        flat = np.ascontiguousarray(values, "<f4")
        store[name] = [at, list(flat.shape)]
        at += flat.size
        data.append(flat.tobytes())
    return {
        "positions": len(arrays["time"]),
        "of": len(bent.motion.time),
        "turn": scene.run.turn,
        "units": scene.shown_in,
        "points": list(points),
        **marks,
        "columns": [{"name": column.name, "unit": column.unit} for column in columns],
        "beams": [
            {"label": label, "link": scene.mechanism.links[at].name, "from": beam.start, "to": beam.end}
            for label, (at, beam) in zip(scene.labels, scene.mechanism.beams, strict=True)
        ],
        "drives": [
            {"name": name, "unit": unit, "effort": effort, "peaks": _peaks(law)}
            for (name, _, unit, effort), law in zip(drive_words(scene.mechanism), scene.course.laws, strict=True)
        ],
        "arrays": store,
    }, b"".join(data)


def _peaks(law: Any) -> list[float | None] | None:
    """Return the peak speed, acceleration and jerk of a law. The jerk is None if it is infinite.

    Return None if the drive has an effort instead of a law, or if the peaks are unknown.
    """
    peaks = None if isinstance(law, DriveEffort) else rigid.law_peaks(law)
    if peaks is None:
        return None
    return [peaks.speed, peaks.acceleration, None if math.isinf(peaks.jerk) else peaks.jerk]


def _points(bent: Deflection) -> dict[str, Any]:
    """Return the rigid positions and the displacements of all points [m], as complex arrays over the positions."""
    points: dict[str, Any] = {}
    moved = bent.motion
    for number, link in enumerate(moved.mechanism.links):
        for point in link.points:
            if point not in points and (number == 0 or not link.name.endswith(" block")):
                both = rigid.position_of(moved, number, point), displacement_of(bent, number, point)
                points[point] = [np.broadcast_to(each, moved.columns) for each in both]
    return points


def _beams(bent: Deflection, taken: slice) -> dict[str, Any]:
    """Return the rigid ends and displacements [m] and the stresses [Pa] of beams.

    The shapes are (beams, 2 ends, positions, 2), (beams, positions, stations, 2) and (beams, positions, stations).
    """
    moved, mechanism = bent.motion, bent.motion.mechanism
    ends, ways = [], []
    for at, beam in mechanism.beams:
        own = [np.ravel(mechanism.links[at].points[point])[0] for point in (beam.start, beam.end)]
        ends.append([moved.origin[at, taken] + moved.direction[at, taken] * each for each in own])
        ways.append(moved.direction[at, taken] * (own[1] - own[0]) / abs(own[1] - own[0]))
    local = sample(bent, "u", STATIONS)[:, taken] + 1j * sample(bent, "w", STATIONS)[:, taken]
    return {
        "ends": _pairs(ends),
        "bent": _pairs(local * np.array(ways)[..., None]),
        "stress": sample(bent, "mises", STATIONS)[:, taken],
    }


def _pairs(values: Any) -> Any:
    """Return complex numbers as (real, imaginary) pairs along a new last axis."""
    values = np.array(values, complex)
    return np.stack([values.real, values.imag], axis=-1)
