"""Parts of a planar mechanism: links, beams, masses, sliders, drives, gears and loads.

Plane vectors are complex numbers. Quantities may be arrays of shape (designs, 1), to compute many designs of a
mechanism together.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar, Protocol

import numpy as np
from msgspec import Struct

from rigid.arrays import Complex, Real, Reals

AnyMotion = Any  # a `Motion`, whose module imports this one
Law = Callable[[AnyMotion], Reals]
"""Function from a motion to a coordinate, rate or factor, shape (..., positions)."""
PointForce = tuple[str, str, Any, Any]
"""Link, point, force in ground axes (complex) [N], and moment [N m]; shape (..., positions) or ()."""

GROUND = "ground"
"""Name of the fixed link."""
PRESSURE_ANGLE = float(np.radians(20.0))
"""Pressure angle of standard involute teeth [rad] (ISO 53)."""


class MechanismError(ValueError):
    """Invalid mechanism. The message states the cause in terms of the user's names.

    Attributes
    ----------
    kind
        Kind of error, if callers distinguish it, or "". Kinds are "name", "drives", "gear", "freedoms",
        "overconstrained", "drawing", "open" (a joint does not close), "reach" (some positions are out of reach),
        "unreachable" (all positions are out of reach), "singular" and "section" (of a beam). For joints in space, the
        kinds are "type", "axis" and "normal".
    links, joints
        Names of the links and joints involved, if known.
    drives, positions
        Indices of the drives and positions involved, if known.
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


class Beam(Struct, frozen=True, eq=False):
    """A straight part of a link between two of its points.

    The beam axes are x' from `start` to `end`, and y' = i x'. `mass_per_length` [kg/m] is the value at the start. Along
    the beam it is multiplied by the polynomial `mass_taper` in xi = x'/l. `rotary_inertia` [kg m] is the mass moment of
    inertia per length, rho I, at the start, and `rotary_taper` is the polynomial by which it is multiplied.
    `rotary_inertia` is 0 for a line mass.
    """

    start: str
    end: str
    mass_per_length: Real = 0.0
    mass_taper: tuple[float, ...] = (1.0,)
    rotary_inertia: Real = 0.0
    rotary_taper: tuple[float, ...] = (1.0,)


class Lump(Struct, frozen=True, eq=False):
    """A mass [kg] rigidly attached to a point of a link.

    `offset` [m] is the vector from the point to the centre of mass, in link axes. `inertia` [kg m^2] is about the
    centre of mass.
    """

    point: str
    mass: Real
    inertia: Real = 0.0
    offset: Complex = 0.0


class Link(Struct, frozen=True, eq=False):
    """A link: points in link axes [m], with mass in beams and lumps.

    The first point is the origin of the axes. The second point usually lies on the x' axis.
    """

    name: str
    points: Mapping[str, Complex]
    beams: tuple[Beam, ...] = ()
    lumps: tuple[Lump, ...] = ()


class Slider(Struct, frozen=True, eq=False):
    """A prismatic pair: `link` slides on `on` without rotation.

    The `point` of `link` moves on a line through `origin` [m] with unit vector `direction`, both in the axes of `on`.
    `turn` is the unit vector of the x' axis of `link` in the axes of `on`. The slide is the distance of `point` from
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
        """Dimensions that may differ between designs."""
        return self.origin, self.direction, self.turn


class Weld(Struct, frozen=True, eq=False):
    """A rigid joint of two links at a common point.

    `turn` is the unit vector of the x' axis of `link` in the axes of `on`.
    """

    point: str
    link: str
    on: str
    turn: Complex = 1.0

    @property
    def lengths(self) -> tuple[Complex, ...]:
        """Dimensions that may differ between designs."""
        return (self.turn,)

    @property
    def name(self) -> str:
        """Name of the weld: the name of its point, as for a pin."""
        return self.point


class PinDrive(Struct, frozen=True):
    """A motor at the pin `at` that turns `link` relative to `on`.

    The coordinate is the angle [rad] of `link` relative to `on`, positive counter-clockwise. `inertia` [kg m^2] is the
    moment of inertia of rotor and gear, reduced to this coordinate. Other inertial effects of the motor on `on` are
    neglected.
    """

    link: str
    at: str
    on: str = GROUND
    inertia: Real = 0.0
    turns: ClassVar[bool] = True

    @property
    def joint(self) -> str:
        """Name of the driven joint."""
        return self.at

    @property
    def name(self) -> str:
        """Name of the drive: the name of the moved link."""
        return self.link

    @property
    def links(self) -> tuple[str, ...]:
        """Moved link and reference link."""
        return self.link, self.on


class SliderDrive(Struct, frozen=True):
    """A motor that moves a slider. The coordinate is the slide [m], and `inertia` the reduced mass [kg]."""

    slider: str
    inertia: Real = 0.0
    turns: ClassVar[bool] = False

    @property
    def joint(self) -> str:
        """Name of the driven joint."""
        return self.slider

    @property
    def name(self) -> str:
        """Name of the drive: the name of the slider."""
        return self.slider

    @property
    def links(self) -> tuple[str, ...]:
        """Empty, because the slider defines the links."""
        return ()


class Load(Protocol):
    """A load on points of links: a `PointLoad`, a spring, or a custom object."""

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Link and point of each point of application."""
        ...

    def forces(self, motion: AnyMotion) -> Iterable[PointForce]:
        """Return the forces and moments on `points` at each position."""
        ...


class Gear(Struct, frozen=True):
    """A gear pair: change in the coordinate of `follower` = `ratio` times change in the coordinate of `driver`.

    `driver` and `follower` identify pins or sliders in the same way as drives do. `ratio` is negative for external
    gears, positive for a ring gear, and in m/rad or rad/m for a rack. The tooth force acts at the pitch point, inclined
    by the `pressure_angle` [rad] to the common tangent. The sign of the transmitted effort determines the loaded flank,
    so that the wheels are always pushed apart. The pins, sliders and the carrier of the wheels carry the force.

    Set `pressure_angle` to None for a belt or chain, which has no tooth force. There is also no tooth force without a
    pitch point: if the joints have no common carrier, the ratio is 1, the axes coincide, or both joints are sliders. In
    these cases, only the moment or force along each coordinate is transmitted, between the two links of each joint.
    """

    driver: PinDrive | SliderDrive
    follower: PinDrive | SliderDrive
    ratio: float
    pressure_angle: float | None = PRESSURE_ANGLE


class Friction(Struct, frozen=True, eq=False):
    """Friction of a joint: Coulomb friction, which is proportional to the contact force, and viscous friction.

    The friction moment of a pin under the force F is `coefficient` `radius` |F|, which does not depend on the moment of
    a drive. The friction force of a slider is `coefficient` max(|N|, 2 |M| / `length`). N is the force normal to the
    line, and M is the moment about the point of the block. This point is the middle of the guided length, and the block
    touches the line at both ends of this length. Viscous friction adds `viscosity` times the rate. At rest, friction is
    zero.

    Attributes
    ----------
    coefficient
        Coulomb friction coefficient.
    radius
        Pin radius [m].
    length
        Guided length of a slider's block [m]. If infinite, the moment is neglected.
    viscosity
        Viscous friction coefficient of a pin [N m s/rad] or slider [N s/m].
    """

    coefficient: Real = 0.0
    radius: Real = 0.0
    length: Real = np.inf
    viscosity: Real = 0.0


class PointLoad(Struct, frozen=True, eq=False):
    """A force [N] and moment [N m] on a point of a link.

    If `turning`, the force rotates with the link and is given in link axes. `law` is a function of the motion that
    returns a factor on the force and the moment, shape (..., positions).
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
        """Return the force in ground axes and the moment at each position."""
        factor = 1.0 if self.law is None else self.law(motion)
        turned = motion.direction[motion.mechanism.index[self.link]] if self.turning else 1.0
        return ((self.link, self.point, self.force * turned * factor, self.moment * factor),)


class LineLoad(Struct, frozen=True, eq=False):
    """A force per length [N/m] along a beam, which varies linearly from `start` to `end`.

    If `turning`, the values are in beam axes, otherwise in ground axes. For `law` see `PointLoad`.
    """

    link: str
    beam: int
    start: Complex
    end: Complex
    turning: bool = False
    law: Law | None = None
