"""Kinds of quantities in a scene, such as lengths and forces.

Each states its units, its bounds and its form in a file.
"""

from cmath import rect
from contextlib import suppress
from math import inf, pi
from typing import Any, ClassVar, Self

from kinelast.values.units import Quantity, shown

MAX_LENGTH = 1e4  # [m] longer than any machine; kinelast.reports.inputs warns about links of more than 90 m
MAX_SIZE_RATIO = 1e3  # largest ratio of the dimensions at the two ends of a beam
MAX_COORDINATE = 1e9  # [rad or m] largest drive coordinate; round-off makes larger angles meaningless


class Length(Quantity, expected='a length, as in "100 mm" or 0.1', units=("m",), most=MAX_LENGTH):
    """Length, or coordinate of a position [m]."""

    @classmethod
    def bound(cls, number: float) -> str:
        """Return the violated bound in words."""
        return f"shorter than {MAX_LENGTH:g} m" if abs(number) >= MAX_LENGTH else super().bound(number)


class Size(Length, above=0.0):
    """Length greater than zero [m]."""


class AngleOrLength(
    Quantity, expected='an angle, as in "30 deg", or a length, as in "20 mm"', units=("rad", "m"), most=MAX_COORDINATE
):
    """Angle [rad] or travel [m] of a drive."""


class PlaneAngle(Quantity, expected='an angle, as in "30 deg" or 0.5', units=("rad",), most=MAX_COORDINATE):
    """Angle [rad]."""


class PressureAngle(PlaneAngle, expected='an angle above 0 and below 90 deg, as in "30 deg"', above=0.0, most=pi / 2):
    """Allowed pressure angle [rad]."""


class Allowance(
    Quantity, expected='a length, as in "0.1 mm", or an angle, as in "0.1 deg"', units=("m", "rad"), above=0.0
):
    """Allowed error of an output [m or rad]."""


class Abscissa(
    Quantity,
    expected='a time, as in "50 ms", an angle, as in "30 deg", or a length, as in "20 mm"',
    units=("s", "rad", "m"),
):
    """Abscissa of a table: time [s], angle [rad] or travel [m]."""


class Share(Quantity, expected='a share, as in "2 %" or 0.02', above=0.0, most=1.0):
    """Fraction of a whole, above 0 and below 1."""

    @classmethod
    def read(cls, value: object, per_length: float = 1.0) -> Self:
        """Read a number, or a string that ends with %."""
        if isinstance(value, str) and value.endswith("%"):
            with suppress(ValueError):
                return super().read(float(value[:-1]) / 100)
        if isinstance(value, str):
            raise ValueError(f"expected {cls.expected}, got {shown(value)}")
        return super().read(value)


class Efficiency(Share, expected='an efficiency, as in "90 %" or 0.9', above=0.0, most=1.0 + 1e-12):
    """Efficiency, above 0 and at most 1."""


class Speed(
    Quantity,
    expected='a speed of rotation, as in "100 rad/s" or "3000 rpm", or of sliding, as in "0.2 m/s"',
    units=("rad/s", "m/s"),
    most=1e12,
):
    """Rate of a drive [rad/s or m/s]."""


class CamSpeed(Quantity, expected='a speed of rotation, as in "100 rad/s" or "-3000 rpm"', units=("rad/s",), most=1e12):
    """Speed of a camshaft, positive counter-clockwise [rad/s]."""


class Time(Quantity, expected='a time, as in "50 ms" or 0.05', units=("s",)):
    """Time [s]."""


class Duration(Time, above=0.0):
    """Duration [s]."""


class Expansion(Quantity, expected='an expansion, as in "12e-6 1/K" or 12e-6', units=("1/K",)):
    """Coefficient of thermal expansion [1/K]."""


class Warming(Quantity, expected='a change of temperature, as in "40 K" or 40', units=("K",)):
    """Temperature change [K]."""


class Ratio(
    Quantity,
    expected='a number (negative for external gears), or for a rack a length per angle, as in "20 mm/rad"',
    units=("rad/rad", "m/rad", "rad/m"),
):
    """Ratio of the change of one coordinate to the change of another [1, m/rad, rad/m]."""


class Mass(Quantity, expected='a mass, as in "200 g" or 0.2', units=("kg",), least=0.0):
    """Mass [kg]."""


class Inertia(Quantity, expected='a moment of inertia, as in "3e-4 kg m^2" or 3e-4', units=("kg m^2",), least=0.0):
    """Moment of inertia [kg m^2]."""


class MassPerLength(Quantity, expected='a mass per length, as in "0.5 kg/m" or 0.5', units=("kg/m",), least=0.0):
    """Mass per unit length [kg/m]."""


class Density(Quantity, expected='a density, as in "7850 kg/m^3" or 7850', units=("kg/m^3",), least=0.0):
    """Density [kg/m^3]."""


class Force(Quantity, expected='a force, as in "2 kN" or 2000', units=("N",)):
    """Component of a force [N]."""


class LoadRating(Quantity, expected='a load, as in "19.5 kN" or 19500', units=("N",), above=0.0):
    """Load rating of a bearing [N]."""


class SlidingSpeed(Quantity, expected='a speed of sliding, as in "0.2 m/s" or 0.2', units=("m/s",), above=0.0):
    """Sliding speed [m/s]."""


class PressureSpeed(
    Quantity, expected='a pressure times a speed, as in "1.8 MPa m/s" or 1.8e6', units=("W/m^2",), above=0.0
):
    """Pressure times sliding speed [W/m^2]."""


class Moment(Quantity, expected='a moment, as in "3 N m" or 3', units=("N m",)):
    """Moment, counter-clockwise [N m]."""


class ForcePerLength(Quantity, expected='a force per length, as in "40 N/m" or 40', units=("N/m",)):
    """Component of a force per unit length [N/m]."""


class ForceOrMoment(Quantity, expected='a moment, as in "3 N m", or a force, as in "2 kN"', units=("N m", "N")):
    """Moment [N m] or force [N] of a drive or a spring."""


class Torque(Quantity, expected='a torque, as in "3 N m" or 3', units=("N m",), above=0.0):
    """Torque of a motor [N m]."""


class TurningSpeed(Quantity, expected='a speed of rotation, as in "3000 rpm"', units=("rad/s",), above=0.0):
    """Speed of a motor [rad/s]."""


class GearRatio(
    Quantity,
    expected='a number, as in 25, or for a sliding drive as in "628 rad/m" or "10 mm/rad"',
    units=("rad/rad", "rad/m", "m/rad"),
    above=0.0,
):
    """Ratio of motor angle to driven coordinate [1, rad/m], or its inverse [m/rad]."""


class Pressure(Quantity, expected='a pressure, as in "160 bar" or 16e6', units=("Pa",), above=0.0):
    """Pressure [Pa]."""


class FlowRate(Quantity, expected='a flow, as in "20 l/min" or 3.3e-4', units=("m^3/s",), above=0.0):
    """Volume flow [m^3/s]."""


class Stiffness(
    Quantity, expected='a stiffness, as in "4 N/mm", or for a pin "3 N m/rad"', units=("N/m", "N m/rad"), least=0.0
):
    """Stiffness of a linear spring [N/m] or a torsion spring [N m/rad]."""


class DampingConstant(
    Quantity,
    expected='a damping, as in "5 N s/m", or for a pin "0.1 N m s/rad"',
    units=("N s/m", "N m s/rad"),
    least=0.0,
):
    """Force per speed [N s/m], or moment per angular speed [N m s/rad]."""


class Compliance(Quantity, expected='a compliance, as in "2e-8 m/N" or 2e-8', units=("m/N",), least=0.0):
    """Displacement per force [m/N]."""


class TurnCompliance(
    Quantity, expected='a compliance in rotation, as in "1e-4 rad/(N m)" or 1e-4', units=("rad/(N m)",), least=0.0
):
    """Rotation per moment [rad/(N m)]."""


class Acceleration(Quantity, expected='an acceleration, as in "-9.81 m/s^2" or -9.81', units=("m/s^2",)):
    """Component of an acceleration [m/s^2]."""


class Stress(Quantity, expected='a stress, as in "210 GPa" or 210e9', units=("Pa",), above=0.0):
    """Stress or modulus [Pa]."""


class Area(Quantity, expected='an area, as in "60 mm^2" or 6e-5', units=("m^2",), above=0.0):
    """Area [m^2]."""


class SecondMoment(
    Quantity, expected='a second moment of area, as in "180 mm^4" or 1.8e-10', units=("m^4",), above=0.0
):
    """Second moment of area [m^4]."""


class AxialRigidity(Quantity, expected='a rigidity E A, as in "12.6 MN" or 12.6e6', units=("N",), above=0.0):
    """E A [N]."""


class BendingRigidity(Quantity, expected='a rigidity E I, as in "37.8 N m^2" or 37.8', units=("N m^2",), above=0.0):
    """E I [N m^2]."""


class ShearRigidity(AxialRigidity, expected='a shear rigidity, as in "3 MN" or 3e6'):
    """kappa G A [N]."""


class Sizes(tuple[float, float]):
    """A dimension at both ends of a beam [m]: `[start, end]` for a linear taper, or a single value."""

    expected: ClassVar[str] = 'a length, as in "6 mm", or two for the ends of the beam, as in ["6 mm", "3 mm"]'

    @classmethod
    def read(cls, value: object, per_length: float = 1.0) -> Self:
        """Read a number, a string, or a list of two. ValueError describes the expected form."""
        ends = value if isinstance(value, list) else [value, value]
        if len(ends) != 2:
            raise ValueError(f"expected {cls.expected}, got {shown(value)}")
        sizes = cls(float(Size.read(end, per_length)) for end in ends)
        if max(sizes) > MAX_SIZE_RATIO * min(sizes):
            raise ValueError(f"expected {cls.expected}, with a ratio of at most {MAX_SIZE_RATIO:g}, got {shown(value)}")
        return sizes


class Direction(complex):
    """A unit vector, given by `[x, y]` of any length, or by an angle from the x axis as a string."""

    expected: ClassVar[str] = 'a direction, as in [1, 0], or an angle, as in "30 deg"'
    each: Any = None  # unit vectors of many designs, shape (designs, 1)

    @classmethod
    def read(cls, value: object) -> Self:
        """Read a list of two numbers or a string. ValueError describes the expected form."""
        if isinstance(value, str):
            with suppress(ValueError):  # the message for an angle would be incomplete
                return cls(_exact(PlaneAngle.read(value)))
        elif isinstance(value, list) and len(value) == 2 and all(type(part) in (int, float) for part in value):
            way = complex(*value)
            if 0 < abs(way) < inf:
                return cls(way / abs(way))
        raise ValueError(f"expected {cls.expected}, got {shown(value)}")


def _exact(angle: float) -> complex:
    """Return the unit vector at an angle [rad], without round-off at quarter turns."""
    unit = rect(1.0, angle)
    return complex(
        *(float(round(part)) if abs(part - round(part)) < 1e-15 else part for part in (unit.real, unit.imag))
    )
