"""Motors with gearboxes: torque, speed and inertia at the motor shaft, and suitable gear ratios."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from elastic import Largest
from kinelast.scene.drive_values import (
    acceleration,
    averages,
    by_drive,
    drive_units,
    effort,
    load_inertia,
    named_tables,
    of_drives,
    rate,
)
from kinelast.scene.part import Part
from kinelast.scene.tables import DriveTable, Factor, StrictTable
from kinelast.values.error import fault, known_name
from kinelast.values.figure import AVERAGE, Figure, Kind, averaged, each
from kinelast.values.numbers import real
from kinelast.values.quantities import Efficiency, GearRatio, Inertia, Torque, TurningSpeed
from machine.drives import Motor, available_torque, inertia_matched_ratio, least_torque_ratio, mean, root_mean_square
from machine.drives import motor_torque as shaft_torque
from rigid.arrays import Real, Reals, of_designs

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.format import SceneTable

KEY = "motors"
MAX_SPEED = 1e5  # [rad/s] largest usual motor speed


class MotorTable(StrictTable, frozen=True, kw_only=True):
    """A motor with its gearbox. Torques and inertias apply at the motor shaft."""

    #: maximum rms torque [no limit]
    rated_torque: Torque | None = None
    peak_torque: Torque | None = None  #: maximum torque [no limit]
    #: torque at rest, if the torque falls linearly to zero at `top_speed` [unknown]
    stall_torque: Torque | None = None
    rated_speed: TurningSpeed | None = None  #: maximum mean speed [no limit]
    top_speed: TurningSpeed | None = None  #: maximum speed [no limit]
    rotor_inertia: Inertia | None = None  #: inertia of the rotor [0]
    gear_inertia: Inertia | None = None  #: inertia of the gearbox at the motor shaft [0]
    #: motor angle / drive angle; for a slider, motor angle / travel, or a lead such as `"10 mm/rad"` [1]
    gear_ratio: GearRatio | None = None
    efficiency: Efficiency | None = None  #: efficiency of the gearbox, in both directions [1]
    inertia_ratio: Factor | None = None  #: maximum load inertia / (motor + gearbox inertia) [no limit]

    @property
    def full_use(self) -> float | None:
        """Limit on the ratio of torque to available torque: 1 if stall torque and top speed are known, else None."""
        return None if self.stall_torque is None or self.top_speed is None else 1.0


def motor_of(scene: SceneTable, number: int) -> Motor | None:
    """Return the motor of drive `number` (from 1), or None.

    Raises
    ------
    SceneError
        The motor is unknown, or the gear ratio has the wrong dimension.
    """
    table, known = scene.drives[number - 1], MOTORS.tables(scene)
    if table.motor is None:
        return None
    known_name(f"drives[{number}]", "motor", table.motor, known, "motor")
    given = known[table.motor]
    keys = {
        key: real(value)
        for key in given.__struct_fields__
        if (value := getattr(given, key)) is not None and key != "gear_ratio"
    }
    return Motor(**keys, gear_ratio=_gear_ratio(f"motors.{table.motor}", given, table))


def _gear_ratio(where: str, motor: MotorTable, drive: DriveTable) -> Real:
    """Return the ratio of motor angle to drive coordinate."""
    ratio = motor.gear_ratio
    if ratio is None and drive.turns:
        return 1.0
    if ratio is None or (ratio.unit in ("", "rad/rad")) != drive.turns:
        moves = "turns" if drive.turns else "slides"
        expected = "a number" if drive.turns else 'an angle to a length, as in "628 rad/m" or "10 mm/rad"'
        raise fault(where, "gear_ratio", f'expected {expected}, because "{drive.name}" {moves}')
    value: Real = real(ratio)
    return 1.0 / value if ratio.unit == "m/rad" else value


def _load_effort(cycle: Cycle, number: int) -> Reals:
    """Effort of a drive, without the part that accelerates the rotor of its motor, shape (..., positions)."""
    return effort(cycle, number) - cycle.scene.mechanism.drives[number].inertia * acceleration(cycle, number)


def motor_torque(cycle: Cycle, number: int, motor: Motor) -> Reals:
    """Torque at the motor shaft [N m], shape (..., positions)."""
    return shaft_torque(motor, _load_effort(cycle, number), rate(cycle, number), acceleration(cycle, number))


def motor_speed(cycle: Cycle, number: int, motor: Motor) -> Reals:
    """Speed of the motor shaft [rad/s], shape (..., positions)."""
    return np.asarray(motor.gear_ratio * rate(cycle, number))


def _use(cycle: Cycle, number: int, motor: Motor) -> Reals:
    there = available_torque(motor, motor_speed(cycle, number, motor))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.abs(motor_torque(cycle, number, motor)) / there


def _largest_use(cycle: Cycle) -> Largest:
    """Return the largest ratio of torque to available torque; infinite if no torque is available at some position."""
    rows = cycle.rows(of_drives(KEY, _use)(cycle))
    found, endless = cycle.largest(rows), np.isinf(rows) & cycle.counted
    value = np.where(endless.any(axis=-1), np.inf, found.value)
    return replace(found, value=value, position=np.where(np.isinf(value), endless.argmax(axis=-1), found.position))


def _inertia_ratio(cycle: Cycle, number: int, motor: Motor) -> Reals:
    own = np.where(np.equal(motor.reduced_inertia, 0), np.nan, motor.reduced_inertia)
    return cycle.once(load_inertia, number) / own


def _least_ratio(cycle: Cycle, number: int, motor: Motor) -> Reals:
    counts = cycle.weights > 0.0
    load, moved, changed = (
        np.where(counts, values(cycle, number), 0.0) for values in (_load_effort, rate, acceleration)
    )
    return least_torque_ratio(motor, load, moved, changed, cycle.weights)


def _matched_ratio(cycle: Cycle, number: int, motor: Motor) -> Reals:
    own = np.asarray(of_designs(motor.inertia), float)
    load = mean(np.where(cycle.weights > 0.0, cycle.once(load_inertia, number), 0.0), cycle.weights)
    return inertia_matched_ratio(load, np.where(own == 0, np.nan, own))


MOTOR = Kind("motor", lambda scene: scene.parts[KEY])
MOTORS: Part[Motor] = Part(
    KEY, "motors of drives", MotorTable, by_drive(motor_of),
    (
        Figure("motor_torque", "motor torque", "N m", MOTOR, each(of_drives(KEY, motor_torque)), limit="peak_torque"),
        Figure("motor_rms", "rms motor torque", "N m", MOTOR,
               averages(KEY, root_mean_square, motor_torque), AVERAGE, limit="rated_torque"),
        Figure("motor_speed", "motor speed", "rad/s", MOTOR, each(of_drives(KEY, motor_speed)), limit="top_speed",
               rigid=True),
        Figure("motor_mean_speed", "mean motor speed", "rad/s", MOTOR,
               averages(KEY, lambda speed, weight: mean(np.abs(speed), weight), motor_speed), AVERAGE,
               limit="rated_speed", rigid=True),
        Figure("motor_use", "motor torque / available torque at its speed", "1", MOTOR, _largest_use,
               limit="full_use"),
        Figure("inertia_ratio", "largest load inertia / motor inertia", "1", MOTOR,
               each(of_drives(KEY, _inertia_ratio)), limit="inertia_ratio", rigid=True),
        Figure("least_ratio", "gear ratio of the smallest rms torque", drive_units(KEY, "1", "rad/m"),
               MOTOR, averaged(of_drives(KEY, _least_ratio)), AVERAGE),
        Figure("matched_ratio", "gear ratio that matches the mean load inertia", drive_units(KEY, "1", "rad/m"), MOTOR,
               averaged(of_drives(KEY, _matched_ratio)), AVERAGE, rigid=True),
    ),
    owned=named_tables(KEY, "motor"),
    drive_row="motor",
    on_axis=True,
    more_than_limits=("top_speed", "peak_torque"),
    usual={  # from watches to ships
        "rated_torque": ("rated torque", 1e-9, 1e8, "N m", "3 N m"),
        "peak_torque": ("peak torque", 1e-9, 1e8, "N m", "9 N m"),
        "stall_torque": ("stall torque", 1e-9, 1e8, "N m", "9 N m"),
        "rated_speed": ("rated speed", 1e-3, MAX_SPEED, "rad/s", "3000 rpm"),
        "top_speed": ("top speed", 1e-3, MAX_SPEED, "rad/s", "6000 rpm"),
        "rotor_inertia": ("inertia of the rotor", 0.0, 1e6, "kg m^2", "12 kg cm^2"),
    },
    stand_in={},
)  # fmt: skip
