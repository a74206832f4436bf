"""Figures of drives: effort, speed, power, and energy of a cycle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kinelast.figures.cycle import Cycle, drive_words
from kinelast.scene.data import Scene
from kinelast.scene.drive_values import effort, load_inertia, over_time, power, rate
from kinelast.scene.figure import AVERAGE, DRIVE, Figure, averaged, each
from machine.drives import mean, mean_positive, root_mean_square
from rigid.arrays import Reals

PerDrive = Callable[[Cycle, int], Reals]


def _each(values: PerDrive) -> Callable[[Cycle], list[Reals]]:
    """Return the values of all drives, from a function of the number of a drive."""
    return lambda cycle: [values(cycle, number) for number in range(len(cycle.scene.mechanism.drives))]


def _over_time(measure: Callable[..., Reals], values: PerDrive) -> Callable[[Cycle], Any]:
    """Return figures that average values of the drives over the positions that count."""
    return averaged(_each(lambda cycle, number: over_time(cycle, measure, values(cycle, number))))


def energy_taken(values: Any, weight: Any) -> Reals:
    """Return the energy input of a power [J]."""
    whole: Reals = mean_positive(values, weight) * np.sum(weight, axis=-1)
    return whole


def energy_given(values: Any, weight: Any) -> Reals:
    """Return the energy returned by a power [J]."""
    return energy_taken(-np.asarray(values), weight)


def _units(turns: str, slides: str) -> Callable[[Scene], list[str]]:
    return lambda scene: [turns if drive.turns else slides for drive in scene.mechanism.drives]


def _effort_units(scene: Scene) -> list[str]:
    return [unit for *_, unit in drive_words(scene.mechanism)]


DRIVE_FIGURES: tuple[Figure, ...] = (
    Figure("drive_rms", "effort of a drive, root mean square", _effort_units, DRIVE,
           _over_time(root_mean_square, effort), AVERAGE),
    Figure("drive_mean", "effort of a drive, mean", _effort_units, DRIVE, _over_time(mean, effort), AVERAGE),
    Figure("drive_speed", "speed of a drive", _units("rad/s", "m/s"), DRIVE, each(_each(rate)), rigid=True),
    Figure("drive_power", "power of a drive", "W", DRIVE, each(_each(power))),
    Figure("drive_mean_power", "mean power of a drive", "W", DRIVE, _over_time(mean, power), AVERAGE),
    Figure("energy_taken", "energy of a drive, taken in a cycle", "J", DRIVE, _over_time(energy_taken, power), AVERAGE),
    Figure("energy_given", "energy of a drive, given back in a cycle", "J", DRIVE, _over_time(energy_given, power),
           AVERAGE),
    Figure("load_inertia", "inertia of the links, reduced to a drive", _units("kg m^2", "kg"), DRIVE,
           each(_each(lambda cycle, number: cycle.once(load_inertia, number))), rigid=True),
)  # fmt: skip
