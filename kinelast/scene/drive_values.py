"""Values of drives at each position, such as effort, speed and power, and results per cycle, such as energy.

Also functions for machine parts that belong to drives, such as motors and cylinders.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from kinelast.scene.part import Assembly
from kinelast.values.figure import AVERAGE, DRIVE, Figure, averaged, drive_names, drive_words, each
from machine.drives import mean, mean_positive, root_mean_square
from rigid.arrays import Reals
from rigid.kinetostatics import kinetic_energy

if TYPE_CHECKING:
    from elastic import Largest
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import SceneTable

Built = TypeVar("Built")
DriveValues = Callable[..., Reals]
"""Function of a cycle, a drive number and, if any, a part. Returns a value per position or one for the whole cycle."""
ALL = ""
"""Kind of part that selects all drives."""


def effort(cycle: Cycle, number: int) -> Reals:
    """Effort of a drive, including that of its rotor inertia [N m or N], shape (..., positions)."""
    return np.broadcast_to(cycle.efforts[number], cycle.columns)


def rate(cycle: Cycle, number: int) -> Reals:
    """First derivative of a drive's coordinate [rad/s or m/s], shape (..., positions)."""
    return np.broadcast_to(cycle.motion.drive_rate[number], cycle.columns)


def acceleration(cycle: Cycle, number: int) -> Reals:
    """Second derivative of a drive's coordinate [rad/s^2 or m/s^2], shape (..., positions)."""
    return np.broadcast_to(cycle.motion.drive_acceleration[number], cycle.columns)


def power(cycle: Cycle, number: int) -> Reals:
    """Power of a drive, including that of its rotor inertia [W], shape (..., positions)."""
    return effort(cycle, number) * rate(cycle, number)


def load_inertia(cycle: Cycle, number: int) -> Reals:
    """Inertia of all links, reduced to one drive while the others rest [kg m^2 or kg], shape (..., positions)."""
    alone = cycle.motion.units[number]
    whole: Reals = 2.0 * kinetic_energy(alone) - cycle.scene.mechanism.drives[number].inertia
    return np.broadcast_to(whole, cycle.columns)


def over_time(cycle: Cycle, measure: Callable[..., Reals], values: Reals) -> Reals:
    """Return the average of values over the included positions. `measure` computes it from values and weights."""
    known = np.where(cycle.weights > 0.0, values, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return measure(known, cycle.weights)


def by_drive(build: Callable[[SceneTable, int], Built | None]) -> Callable[[Assembly], dict[str, Built]]:
    """Return a function that builds the machine parts of all drives, by drive name.

    `build` gets each drive number from 1.
    """

    def built(assembly: Assembly) -> dict[str, Built]:
        parts = {name: build(assembly.table, n) for n, name in enumerate(drive_names(assembly.mechanism), 1)}
        return {name: part for name, part in parts.items() if part is not None}

    return built


def named_tables(part: str, key: str) -> Callable[[SceneTable, Scene], Mapping[str, Any]]:
    """Return a function that finds the tables of machine parts, such as motors, by the name of their drive.

    `part` is the key of these tables in the scene, such as "motors". `key` is the key in the table of a drive that
    contains the name of its part, such as "motor".
    """

    def found(table: SceneTable, scene: Scene) -> dict[str, Any]:
        named = {
            name: getattr(drive, key) for name, drive in zip(drive_names(scene.mechanism), table.drives, strict=True)
        }
        return {name: getattr(table, part)[own] for name, own in named.items() if own is not None}

    return found


def numbered(scene: Scene, part: str) -> list[tuple[Any, ...]]:
    """Return the number of each drive with a machine part of the kind `part`, and this machine part.

    For `ALL`, return the numbers of all drives.
    """
    names = drive_names(scene.mechanism)
    if part == ALL:
        return [(number,) for number in range(len(names))]
    built = scene.parts[part]
    return [(number, built[name]) for number, name in enumerate(names) if name in built]


def of_drives(part: str, values: DriveValues) -> Callable[[Cycle], list[Reals]]:
    """Return a function that computes values, over a cycle, of each drive with a machine part of the kind `part`."""
    return lambda cycle: [values(cycle, *each) for each in numbered(cycle.scene, part)]


def averages(part: str, measure: Callable[..., Reals], values: DriveValues) -> Callable[[Cycle], Largest]:
    """Return a function that computes a cycle average for each drive with a machine part of the kind `part`."""
    return averaged(of_drives(part, lambda cycle, *each: over_time(cycle, measure, values(cycle, *each))))


def drive_units(part: str, turns: str, slides: str) -> Callable[[Scene], list[str]]:
    """Return a function that lists units: `turns` or `slides` for each rotating or sliding drive with such a part."""
    return lambda scene: [turns if scene.mechanism.drives[n].turns else slides for n, *_ in numbered(scene, part)]


def energy_taken(values: Any, weight: Any) -> Reals:
    """Return the integral of the positive part of a power [J]."""
    return mean_positive(values, weight) * np.sum(weight, axis=-1)


def energy_given(values: Any, weight: Any) -> Reals:
    """Return the magnitude of the integral of the negative part of a power [J]."""
    return energy_taken(-np.asarray(values), weight)


def _effort_units(scene: Scene) -> list[str]:
    return [unit for *_, unit in drive_words(scene.mechanism)]


DRIVE_FIGURES: tuple[Figure, ...] = (
    Figure("drive_effort", "effort of a drive", _effort_units, DRIVE, each(lambda cycle: cycle.efforts), listed=True),
    Figure("drive_rms", "effort of a drive, root mean square", _effort_units, DRIVE,
           averages(ALL, root_mean_square, effort), AVERAGE),
    Figure("drive_mean", "effort of a drive, mean", _effort_units, DRIVE, averages(ALL, mean, effort), AVERAGE),
    Figure("drive_speed", "speed of a drive", drive_units(ALL, "rad/s", "m/s"), DRIVE,
           each(of_drives(ALL, rate)), rigid=True),
    Figure("drive_power", "power of a drive", "W", DRIVE, each(of_drives(ALL, power))),
    Figure("drive_mean_power", "mean power of a drive", "W", DRIVE, averages(ALL, mean, power), AVERAGE),
    Figure("energy_taken", "energy of a drive, taken in a cycle", "J", DRIVE, averages(ALL, energy_taken, power),
           AVERAGE),
    Figure("energy_given", "energy of a drive, given back in a cycle", "J", DRIVE, averages(ALL, energy_given, power),
           AVERAGE),
    Figure("load_inertia", "inertia of the links, reduced to a drive", drive_units(ALL, "kg m^2", "kg"), DRIVE,
           each(of_drives(ALL, lambda cycle, number: cycle.once(load_inertia, number))), rigid=True),
)  # fmt: skip
