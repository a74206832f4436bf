"""Parts of a planar mechanism: links, beams, masses, sliders, drives, gears and loads.

Vectors in the plane are complex numbers. A quantity may be an array of shape (designs, 1), so that many designs of one
mechanism are computed together.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np

from rigid.arrays import Complex, Real, Reals

AnyMotion = Any  # a `Motion`, which is defined from these parts
Law = Callable[[AnyMotion], Reals]
"""Coordinate, rate or factor as a function of a motion, shape (positions,)."""
PointForce = tuple[str, str, Any, Any]
"""Link, point, force in the ground's axes [N], complex, and moment [N m], shape (..., positions) or scalar."""

GROUND = "ground"
"""Name of the fixed link."""
PRESSURE_ANGLE = float(np.radians(20.0))  # pressure angle of standard involute teeth, ISO 53


class MechanismError(ValueError):
    """Invalid mechanism; the message describes the cause in terms of the user's names.

    Attributes
    ----------
    kind
        Kind of error, if callers distinguish it: "name", "drives", "gear", "freedoms", "overconstrained", "drawing",
        "open" (a joint does not close), "reach" (at some positions), "unreachable" (at all), "singular", "section" (of
        a link's beams), or the property of a joint in space: "type", "axis", "normal"; otherwise "".
    links, joints
        Names of the links and joints involved, if known.
    drives, positions
        Numbers of the drives and of the positions.
    """

    def __init__(
        self,
        message: str,
        *,
        kind: str = "",
        links: Iterable[str] = (),
        joints: Iterable[str] = (),
        drives: Iterable[int] = (),
        positions: Iterable[int] = (),
    ) -> None:
        super().__init__(message)
        self.kind, self.links, self.joints = kind, tuple(links), tuple(joints)
        self.drives, self.positions = tuple(drives), tuple(positions)


@dataclass(frozen=True, eq=False)
class Beam:
    """Straight piece of a link, between two of the link's points.

    Its axes are x' from `start` to `end`, and y' = i x'. `mass_per_length` [kg/m] is the value at the start, multiplied
    by the polynomial `mass_taper` in xi = x'/l along the beam. `rotary_inertia` [kg m] is the sections' moment of
    inertia per length, rho I, at the start, multiplied by `rotary_taper`; 0 for a line mass.
    """

    start: str
    end: str
    mass_per_length: Real = 0.0
    mass_taper: tuple[float, ...] = (1.0,)
    rotary_inertia: Real = 0.0
    rotary_taper: tuple[float, ...] = (1.0,)


@dataclass(frozen=True, eq=False)
class Lump:
    """Mass [kg] rigidly attached to a point of a link.

    `offset` [m] from that point to its centre of mass, in the link's axes; `inertia` [kg m^2] about its centre of mass.
    """

    point: str
    mass: Real
    inertia: Real = 0.0
    offset: Complex = 0.0


@dataclass(frozen=True, eq=False)
class Link:
    """Link: points in its own axes [m], and mass as beams and lumps.

    The first point is the origin of its axes; the second, if any, usually lies on x'.
    """

    name: str
    points: Mapping[str, Complex]
    beams: tuple[Beam, ...] = ()
    lumps: tuple[Lump, ...] = ()


@dataclass(frozen=True, eq=False)
class Slider:
    """Prismatic pair: `link` slides on `on` without rotation.

    `point` of `link` stays on the line through `origin` [m] with unit vector `direction`, both in the axes of `on`.
    `turn` is the unit vector of the axes of `link` in the axes of `on`. The slide is the distance of `point` from
    `origin` along `direction`.
    """

    name: str
    link: str
    on: str
    point: str
    origin: Complex
    direction: Complex
    turn: Complex = 1.0

    @property
    def lengths(self) -> tuple[Complex, ...]:
        """Dimensions that may differ by design."""
        return self.origin, self.direction, self.turn


@dataclass(frozen=True, eq=False)
class Weld:
    """Two links joined rigidly at a common point.

    `turn` is the unit vector of the axes of `link` in the axes of `on`.
    """

    point: str
    link: str
    on: str
    turn: Complex = 1.0

    @property
    def lengths(self) -> tuple[Complex, ...]:
        """Dimensions that may differ by design."""
        return (self.turn,)

    @property
    def name(self) -> str:
        """Name of the weld: the point's name, as for a pin."""
        return self.point


@dataclass(frozen=True)
class PinDrive:
    """Motor at the pin `at` that turns `link` relative to `on`.

    Its coordinate is the angle [rad] of the axes of `link` from those of `on`, counter-clockwise. `inertia` [kg m^2]
    of its rotor and gear, reduced to that coordinate, resists its change; other inertial effects on `on` are neglected.
    """

    link: str
    at: str
    on: str = GROUND
    inertia: Real = field(default=0.0, compare=False)  # irrelevant to the structure
    turns: ClassVar[bool] = True

    @property
    def joint(self) -> str:
        """Name of the driven joint."""
        return self.at

    @property
    def name(self) -> str:
        """Name of the drive: the link's name."""
        return self.link

    @property
    def links(self) -> tuple[str, ...]:
        """Links named by the drive."""
        return self.link, self.on


@dataclass(frozen=True)
class SliderDrive:
    """Motor that moves a slider; coordinate: the slide [m]; `inertia`: reduced mass [kg]."""

    slider: str
    inertia: Real = field(default=0.0, compare=False)  # irrelevant to the structure
    turns: ClassVar[bool] = False

    @property
    def joint(self) -> str:
        """Name of the driven joint."""
        return self.slider

    @property
    def name(self) -> str:
        """Name of the drive: the slider's name."""
        return self.slider

    @property
    def links(self) -> tuple[str, ...]:
        """Links named by the drive: none."""
        return ()


class Load(Protocol):
    """Load on points of links: a `PointLoad`, a spring, or a custom object."""

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Link and point of each loaded place."""
        ...

    def forces(self, motion: AnyMotion) -> Iterable[PointForce]:
        """Forces and moments on these points at every position."""
        ...


@dataclass(frozen=True)
class Gear:
    """Gear pair: the coordinate of `follower` changes by `ratio` times that of `driver`.

    `driver` and `follower` name pins or sliders as drives do. `ratio` is negative for external gears, positive for a
    ring gear, and [m/rad] for a rack. The tooth force acts at the pitch point, inclined by the `pressure_angle` [rad]
    to the common tangent. The loaded flank follows from the transmitted effort, so that the wheels are pushed apart.
    The force is carried by the pins, sliders and the carrier of the wheels.

    There is no tooth force if `pressure_angle` is None, as for a belt or chain, or if there is no pitch point: no
    common carrier of the joints, ratio 1, coincident axes, or two sliders. In that case only the moment or force along
    the coordinates is transmitted, between the two links of each joint.
    """

    driver: PinDrive | SliderDrive
    follower: PinDrive | SliderDrive
    ratio: float
    pressure_angle: float | None = PRESSURE_ANGLE


@dataclass(frozen=True, eq=False)
class Friction:
    """Joint friction: Coulomb friction, proportional to the contact force, and viscous friction.

    A pin under the force F resists rotation by `coefficient` `radius` |F|, independent of the drive's moment. A
    slider's block resists sliding by `coefficient` max(|N|, 2 |M| / `length`): N is the force normal to the line and M
    the moment about its point, the middle of the guided length, with contact at the ends. Both also resist by
    `viscosity` times the rate. At rest friction is zero.

    Attributes
    ----------
    coefficient
        Coulomb friction coefficient.
    radius
        Pin radius [m].
    length
        Guided length of a slider's block [m]; infinite to neglect the moment.
    viscosity
        [N m s/rad] of a pin, [N s/m] of a slider.
    """

    coefficient: Real = 0.0
    radius: Real = 0.0
    length: Real = np.inf
    viscosity: Real = 0.0


@dataclass(frozen=True, eq=False)
class PointLoad:
    """Force [N] and moment [N m] on a point of a link.

    `turning`: the force turns with the link and is given in its axes. `law` multiplies both: a function of the motion
    that returns an array of shape (..., positions).
    """

    link: str
    point: str
    force: Complex = 0.0
    moment: Real = 0.0
    turning: bool = False
    law: Law | None = None

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Link and point of the load."""
        return ((self.link, self.point),)

    def forces(self, motion: AnyMotion) -> Iterable[PointForce]:
        """Force in the ground's axes and moment at every position."""
        factor = 1.0 if self.law is None else self.law(motion)
        turned = motion.direction[motion.mechanism.index[self.link]] if self.turning else 1.0
        return ((self.link, self.point, self.force * turned * factor, self.moment * factor),)


@dataclass(frozen=True, eq=False)
class LineLoad:
    """Force per length [N/m] along a beam, linear from `start` to `end`.

    `turning`: given in the beam's axes instead of the ground's. `law`: see `PointLoad`.
    """

    link: str
    beam: int
    start: Complex
    end: Complex
    turning: bool = False
    law: Law | None = None
