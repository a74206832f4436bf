"""Cams in the report: rows of the summary, findings, and columns of positions.csv."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from kinelast.scene.figure import DRIVE, NOISE, items_of
from kinelast.scene.finding import CAUTION, POOR, Finding
from kinelast.scene.numbers import quantity
from kinelast.scene.parts.cam_courses import (
    ACROSS,
    HELD,
    KEY,
    ROLLED,
    cam_flanks,
    cam_force,
    cam_pressure,
    cam_torque,
)
from kinelast.scene.reading import Reading, reading
from machine.cams import cut_depth
from rigid.arrays import Flags

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.figures.reader import Reader

HEADING = "Cams"


def cam_row(reader: Reader, name: str) -> dict[str, Any]:
    """Return data of a cam, positions with undercut and without contact, and their numbers under `counts`.

    `cut` is the depth to which the follower cuts into the profile from another position: the cam cannot be made.
    """
    scene, counted = reader.scene, reader.results.counted
    cam, faults = scene.cams[name], {"undercut": _undercut(reader.cycle, name), "contact_lost": _lost(reader, name)}
    return {
        "follower": scene.mechanism.links[cam.link].name,
        "drive": items_of(scene, DRIVE)[cam.drive],
        "flank": cam.flank,
        "speed": reading(np.ravel(cam.speed)[0], "rad/s"),
        "cut": reading(max(float(cut_depth(flank).max(initial=0.0)) for flank in cam_flanks(reader.cycle, name)), "m"),
        **{fault: reader.marks(there) for fault, there in faults.items()},
        "counts": {fault: int(np.sum(there & counted)) for fault, there in faults.items()},
    }


def _undercut(cycle: Cycle, name: str) -> Flags:
    """Return whether a cam is undercut, shape (positions,)."""
    undercut: Flags = np.any([flank.undercut for flank in cam_flanks(cycle, name)], axis=0)
    return undercut


def _lost(reader: Reader, name: str) -> Flags:
    """Return whether an open cam would have to pull its follower, shape (positions,)."""
    force = cam_force(reader.cycle, name) if name in items_of(reader.scene, HELD) else np.ones(1)
    noise = NOISE * float(np.nanmax(np.abs(force), initial=0.0))
    return np.broadcast_to(force < -noise, reader.results.motion.columns)


def cam_findings(reader: Reader) -> Iterator[Finding]:
    """Yield findings on cams that cannot be made or lose their followers."""
    counted = reader.results.counted

    def size(found: Reading | None, sign: float = 1.0) -> str:
        if found is None or found.value is None:
            return "none"
        return quantity(sign * found.value, found.unit, told_in=reader.scene.told_in)

    for name in reader.scene.cams:
        angle, margin = (reader.of_item(key, name) for key in ("cam_pressure_angle", "cam_face_margin"))
        if angle and angle.value is not None and abs(angle.value) >= ACROSS:
            text = f"The cam {name} cannot push its follower: the pressure angle is 90°."
            yield Finding(POOR, HEADING, f"{text} Let the drive move the follower away from the cam.")
            continue
        if margin and margin.value is not None and margin.value < 0.0:
            text = f"The contact on the cam {name} runs off the face by {size(margin, -1.0)}"
            yield Finding(POOR, HEADING, f"{text}: make the face longer by that at least, or shift it.")
        if (_undercut(reader.cycle, name) & counted).any():
            radius = size(reader.of_item("cam_radius", name))
            text = f"The cam {name} cannot be made: its profile is undercut (smallest radius {radius})."
            roller = "a smaller roller or " if name in ROLLED.names(reader.scene) else ""
            yield Finding(POOR, HEADING, f"{text} Use {roller}a larger cam, or a law with less acceleration.")
        lost = _lost(reader, name) & counted
        if lost.any():
            part = "throughout" if lost.sum() == counted.sum() else "in part of"
            spring = f"a spring with {size(reader.of_item('cam_preload', name))} along the drive holds it."
            text = f"The follower leaves the cam {name} {part} the run: {spring}"
            yield Finding(CAUTION, HEADING, f"{text} Pulling forces are those of a grooved cam.")


def cam_columns(cycle: Cycle) -> dict[str, tuple[Any, str]]:
    """Return the columns of the cams in positions.csv with units, by name."""
    columns: dict[str, tuple[Any, str]] = {}
    for name in cycle.scene.parts[KEY]:
        columns[f"{name}.pressure_angle"] = cam_flanks(cycle, name)[0].pressure_angle, "rad"
        columns[f"{name}.force"] = cam_force(cycle, name), "N"
        columns[f"{name}.pressure"] = cam_pressure(cycle, name), "Pa"
        columns[f"{name}.torque"] = cam_torque(cycle, name), "N m"
    return columns
