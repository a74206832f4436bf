"""Cylinders as drives: pressure by bore, flow, and buckling of the rod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from machine.ranges import Range
from rigid.arrays import Real, Reals

UNKNOWN = float("nan")
ROD_RANGE = Range(
    "buckling safety of a rod", "slenderness", "Roloff/Matek 2007, section 8.5: Euler, steel E335", least=89.0,
    outside="a thicker rod yields before it buckles: hold its stress against the yield stress too",
)  # fmt: skip
"""Slenderness for which Euler's formula of the rod holds."""


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A hydraulic or pneumatic cylinder; nan for the data that its sheet leaves out.

    Attributes
    ----------
    bore, rod
        Diameters of piston and rod [m].
    length
        Over which the rod may buckle, both its ends taken as pinned [m].
    modulus
        Young's, of the rod [Pa].
    pressure, flow
        Greatest of the supply [Pa, m^3/s].
    buckling_safety
        Least of Euler's load over the push.
    """

    bore: Real
    rod: Real = 0.0
    length: Real = UNKNOWN
    modulus: Real = 206e9
    pressure: Real = UNKNOWN
    flow: Real = UNKNOWN
    buckling_safety: Real = UNKNOWN

    @property
    def area(self) -> Reals:
        """Of the piston [m^2]."""
        return np.asarray(np.pi * np.square(self.bore) / 4)

    @property
    def annulus(self) -> Reals:
        """Of the piston on the rod's side [m^2]."""
        return np.asarray(np.pi * (np.square(self.bore) - np.square(self.rod)) / 4)

    @property
    def buckling_load(self) -> Reals:
        """Euler's load of the rod pinned at both ends [N]: pi^2 E I / l^2. Range: `ROD_RANGE`."""
        return np.asarray(np.pi**2 * self.modulus * (np.pi * np.asarray(self.rod) ** 4 / 64) / np.square(self.length))

    @property
    def slenderness(self) -> Reals:
        """Length of the rod over the radius of gyration of its section, 4 l / d."""
        with np.errstate(divide="ignore"):
            return np.asarray(4.0 * np.asarray(self.length) / self.rod)


def working_pressure(cylinder: Cylinder, force: Any) -> Reals:
    """Return the pressure over that behind the piston [Pa]: the force over the piston, or over its ring in a pull.

    `force` [N] is along the drive's coordinate, which extends the rod. Range: any, static and without friction.
    """
    pressure: Reals = np.where(np.asarray(force) > 0, force / cylinder.area, -force / cylinder.annulus)
    return pressure


def flow_rate(cylinder: Cylinder, rate: Any) -> Reals:
    """Return the magnitude of the flow into the cylinder at a rate of its stroke [m^3/s].

    The area times the rate, of an incompressible fluid without leakage, at any rate.
    """
    flow: Reals = np.where(np.asarray(rate) > 0, rate * cylinder.area, -rate * cylinder.annulus)
    return flow


def buckling_safety(cylinder: Cylinder, force: Any) -> Reals:
    """Return Euler's load of the rod over its push; infinite if it pulls. Range: `ROD_RANGE`."""
    push = np.maximum(force, 0.0)
    with np.errstate(divide="ignore"):
        safety: Reals = np.where(push > 0, cylinder.buckling_load / np.where(push > 0, push, 1.0), np.inf)
    return np.where(np.isnan(force), np.nan, safety)
