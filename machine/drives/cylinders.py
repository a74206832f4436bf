"""Cylinders as drives: working pressure, flow rate, and buckling of the rod."""

from typing import Any

import numpy as np
from msgspec import Struct

from machine.ranges import Range
from rigid.arrays import Real, Reals

UNKNOWN = float("nan")
ROD_RANGE = Range(
    "buckling safety of a rod", "slenderness", "Roloff/Matek 2007, section 8.5: Euler, steel E335", least=89.0,
    outside="a thicker rod yields before it buckles: compare its stress with the yield stress",
)  # fmt: skip
"""Slenderness of the rod for which Euler's formula applies."""


class Cylinder(Struct, frozen=True, eq=False):
    """A hydraulic or pneumatic cylinder; unknown data are nan.

    Attributes
    ----------
    bore, rod
        Diameters of piston and rod [m].
    length
        Buckling length of the rod with pinned ends [m].
    modulus
        Young's modulus of the rod [Pa].
    pressure, flow
        Available pressure [Pa] and flow [m^3/s].
    buckling_safety
        Required ratio (Euler load / push force).
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
        """Area of the piston [m^2]."""
        return np.asarray(np.pi * np.square(self.bore) / 4)

    @property
    def annulus(self) -> Reals:
        """Ring area of the piston on the rod side [m^2]."""
        return np.asarray(np.pi * (np.square(self.bore) - np.square(self.rod)) / 4)

    @property
    def buckling_load(self) -> Reals:
        """Euler load of the rod with pinned ends [N]: pi^2 E I / l^2. Range: `ROD_RANGE`."""
        return np.asarray(np.pi**2 * self.modulus * (np.pi * np.asarray(self.rod) ** 4 / 64) / np.square(self.length))

    @property
    def slenderness(self) -> Reals:
        """Slenderness of the rod, length / radius of gyration = 4 l / d."""
        with np.errstate(divide="ignore"):
            return np.asarray(4.0 * np.asarray(self.length) / self.rod)


def working_pressure(cylinder: Cylinder, force: Any) -> Reals:
    """Return the pressure across the piston [Pa]: force / piston area, or force / ring area if the rod pulls.

    `force` [N] is positive if the rod pushes. Range: any static force; friction is neglected.
    """
    return np.where(np.asarray(force) > 0, force / cylinder.area, -force / cylinder.annulus)


def flow_rate(cylinder: Cylinder, rate: Any) -> Reals:
    """Return the flow into the cylinder [m^3/s]. The piston speed `rate` [m/s] is positive if the rod extends.

    Range: incompressible fluid without leakage, any speed.
    """
    return np.where(np.asarray(rate) > 0, rate * cylinder.area, -rate * cylinder.annulus)


def buckling_safety(cylinder: Cylinder, force: Any) -> Reals:
    """Return (Euler load) / (push force); infinite if the rod pulls. Range: `ROD_RANGE`."""
    push = np.maximum(force, 0.0)
    with np.errstate(divide="ignore"):
        safety: Reals = np.where(push > 0, cylinder.buckling_load / np.where(push > 0, push, 1.0), np.inf)
    return np.where(np.isnan(force), np.nan, safety)
