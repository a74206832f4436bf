"""Values of drives in a cycle, and figures of the parts that drives have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from kinelast.scene.figure import averaged
from kinelast.scene.names import drive_names
from kinelast.scene.part import Assembly
from rigid.arrays import Reals
from rigid.kinematics import unit_motion
from rigid.kinetostatics import kinetic_energy

if TYPE_CHECKING:
    from elastic import Largest
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import SceneTable

Built = TypeVar("Built")
PartValues = Callable[["Cycle", int, Any], Reals]
"""From a cycle, the number of a drive and its part to values at every position, or of the whole cycle."""


def effort(cycle: Cycle, number: int) -> Reals:
    """Effort of a drive [N m or N], with that of its rotor, shape (..., positions)."""
    return np.broadcast_to(cycle.efforts[number], cycle.columns)


def rate(cycle: Cycle, number: int) -> Reals:
    """Rate of a drive's coordinate [rad/s or m/s], shape (..., positions)."""
    return np.broadcast_to(cycle.motion.drive_rate[number], cycle.columns)


def acceleration(cycle: Cycle, number: int) -> Reals:
    """Second derivative of a drive's coordinate, shape (..., positions)."""
    return np.broadcast_to(cycle.motion.drive_acceleration[number], cycle.columns)


def power(cycle: Cycle, number: int) -> Reals:
    """Power of a drive [W], with that of its rotor, shape (..., positions)."""
    return effort(cycle, number) * rate(cycle, number)


def load_inertia(cycle: Cycle, number: int) -> Reals:
    """Inertia of all links, reduced to a drive while the others stand [kg m^2 or kg], shape (..., positions)."""
    alone = unit_motion(cycle.motion, number)
    whole: Reals = 2.0 * kinetic_energy(alone) - cycle.scene.mechanism.drives[number].inertia
    return np.broadcast_to(whole, cycle.columns)


def over_time(cycle: Cycle, measure: Callable[..., Reals], values: Reals) -> Reals:
    """An average of values over the positions that count."""
    known = np.where(cycle.weights > 0.0, values, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return measure(known, cycle.weights)


def by_drive(build: Callable[[SceneTable, int], Built | None]) -> Callable[[Assembly], dict[str, Built]]:
    """Builder of parts by the names of their drives, from one for a drive by its number from 1."""

    def built(assembly: Assembly) -> dict[str, Built]:
        parts = {name: build(assembly.table, n) for n, name in enumerate(drive_names(assembly.mechanism), 1)}
        return {name: part for name, part in parts.items() if part is not None}

    return built


def named_tables(part: str, key: str) -> Callable[[SceneTable, Scene], Mapping[str, Any]]:
    """Tables under `part` by the name of the drive that names one under `key`."""

    def found(table: SceneTable, scene: Scene) -> dict[str, Any]:
        named = {
            name: getattr(drive, key) for name, drive in zip(drive_names(scene.mechanism), table.drives, strict=True)
        }
        return {name: getattr(table, part)[own] for name, own in named.items() if own is not None}

    return found


def numbered(scene: Scene, part: str) -> dict[int, Any]:
    """Parts of a kind by the number of their drive."""
    built = scene.parts[part]
    return {number: built[name] for number, name in enumerate(drive_names(scene.mechanism)) if name in built}


def of_drives(part: str, values: PartValues) -> Callable[[Cycle], list[Reals]]:
    """Values of the drives that have a part of a kind."""
    return lambda cycle: [values(cycle, *each) for each in numbered(cycle.scene, part).items()]


def averages(part: str, measure: Callable[..., Reals], values: PartValues) -> Callable[[Cycle], Largest]:
    """Figures that average values of the drives that have a part over the positions that count."""
    return averaged(of_drives(part, lambda cycle, *each: over_time(cycle, measure, values(cycle, *each))))


def drive_units(part: str, turns: str, slides: str) -> Callable[[Scene], list[str]]:
    """Units of the drives that have a part, by the kind of their coordinates."""
    return lambda scene: [turns if scene.mechanism.drives[n].turns else slides for n in numbered(scene, part)]
