"""Flywheels: the inertia with which the speed fluctuation of a drive stays within the limit `unevenness`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from kinelast.scene.drive_values import ALL, by_drive, effort, load_inertia, of_drives, rate
from kinelast.scene.part import Part
from kinelast.values.error import fault
from kinelast.values.figure import AVERAGE, DRIVE, Figure, Kind, RangeCheck, averaged
from kinelast.values.numbers import real
from machine.drives import UNEVENNESS_RANGE, added_inertia, energy_fluctuation, flywheel_inertia
from rigid import ConstantSpeed
from rigid.arrays import Real, Reals, of_designs

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import SceneTable


KEY = "flywheels"


def _unevenness(scene: SceneTable, number: int) -> Real | None:
    table = scene.drives[number - 1]
    if table.unevenness is not None and (table.speed is None or table.effort is not None or not table.turns):
        raise fault(f"drives[{number}]", "unevenness", "belongs to a drive that turns at constant speed")
    return None if table.unevenness is None else real(table.unevenness)


def _fluctuation(cycle: Cycle, number: int) -> Reals:
    """Energy fluctuation of a drive that rotates at constant speed over a cycle [J]; nan for other drives."""
    scene, coordinate = cycle.scene, np.broadcast_to(cycle.motion.drive[number], cycle.columns)
    steady = isinstance(scene.laws[number], ConstantSpeed) and scene.mechanism.drives[number].turns
    if not steady or not scene.run.turn or cycle.columns[-1] < 3:
        return np.full(cycle.columns[:-1], np.nan)
    span = cycle.weights.sum(axis=-1)
    travel = rate(cycle, number)[..., 0] * span
    repeated = cycle.period is not None  # with a period, the last position repeats the first
    last = -1 if repeated else None
    with np.errstate(invalid="ignore", divide="ignore"):
        found = energy_fluctuation(effort(cycle, number)[..., :last], coordinate[..., :last], travel[..., None])
    return np.where(cycle.counted.all(axis=-1), found, np.nan)


def _flywheel(cycle: Cycle, number: int, unevenness: Any) -> Reals:
    return flywheel_inertia(_fluctuation(cycle, number), of_designs(unevenness), rate(cycle, number)[..., 0])


def _added(cycle: Cycle, number: int, unevenness: Any) -> Reals:
    own = cycle.once(load_inertia, number) + cycle.scene.mechanism.drives[number].inertia
    return added_inertia(_flywheel(cycle, number, unevenness), own)


def _uneven(scene: Scene, _: Any) -> Reals:
    return np.array([np.ravel(unevenness)[0] for unevenness in scene.parts[KEY].values()])


UNEVEN = Kind("uneven drive", lambda scene: scene.parts[KEY], "drive")
FLYWHEELS: Part[Real] = Part(
    KEY, "", None, by_drive(_unevenness),
    (
        Figure("energy_fluctuation", "energy fluctuation that a flywheel on a drive would absorb", "J", DRIVE,
               averaged(of_drives(ALL, _fluctuation)), AVERAGE),
        Figure("flywheel", "total inertia for the allowed speed fluctuation of a drive", "kg m^2", UNEVEN,
               averaged(of_drives(KEY, _flywheel)), AVERAGE),
        Figure("flywheel_added", "flywheel inertia for the allowed speed fluctuation of a drive", "kg m^2", UNEVEN,
               averaged(of_drives(KEY, _added)), AVERAGE),
    ),
    checks=(RangeCheck(UNEVENNESS_RANGE, UNEVEN, "flywheel", ("flywheel", "flywheel_added"), _uneven),),
)  # fmt: skip
