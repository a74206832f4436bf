"""The parts of a planar mechanism: links, beams, masses, sliders, drives, gears and loads.

Vectors in the plane are complex numbers. A quantity may be an array of shape (designs, 1), so that many designs
of one mechanism go through their positions together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np

from rigid.arrays import Complex, Real, Reals

AnyMotion = Any  # a `Motion`, which is made of these parts
Law = Callable[[AnyMotion], Reals]
"""Coordinate, rate or factor as a function of a motion, shape (positions,)."""
PointForce = tuple[str, str, Any, Any]
"""Link, point, force in the ground's axes [N], complex, and moment [N m], shape (..., positions) or scalar."""

GROUND = "ground"
"""Name of the fixed link."""
PRESSURE_ANGLE = float(np.radians(20.0))  # of standard involute teeth, ISO 53


class MechanismError(ValueError):
    """A mechanism that cannot be: the message names the cause in the user's own names.

    Attributes
    ----------
    kind
        What is wrong, where callers tell cases apart: "name", "drives", "gear", "freedoms", "overconstrained",
        "drawing", "open" (a joint does not close), "reach" (at some positions), "unreachable" (at all), "singular",
        "section" (of a link's beams), or the property of a joint in space: "type", "axis", "normal"; "" otherwise.
    links, joints
        Names of those at fault, as far as they are known.
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
    """A straight piece of a link, from one of the link's points to another.

    Its own axes: x' from `start` to `end`, y' = i x'. `mass_per_length` [kg/m] is that at its start, `mass_taper` the
    polynomial in xi = x'/l by which it is multiplied along the beam. `rotary_inertia` [kg m] is the moment of inertia
    of its sections per length, rho I, at its start and likewise multiplied; 0 of a line of mass.
    """

    start: str
    end: str
    mass_per_length: Real = 0.0
    mass_taper: tuple[float, ...] = (1.0,)
    rotary_inertia: Real = 0.0
    rotary_taper: tuple[float, ...] = (1.0,)


@dataclass(frozen=True, eq=False)
class Lump:
    """A mass [kg] rigidly held at a point of a link.

    `offset` [m] from that point to its centre, in the link's axes; `inertia` [kg m^2] about its own centre.
    """

    point: str
    mass: Real
    inertia: Real = 0.0
    offset: Complex = 0.0


@dataclass(frozen=True, eq=False)
class Link:
    """A link: its points in its own axes [m], and its mass as beams and lumps.

    The first point is the origin of its axes; the second, where there is one, usually lies on x'.
    """

    name: str
    points: Mapping[str, Complex]
    beams: tuple[Beam, ...] = ()
    lumps: tuple[Lump, ...] = ()


@dataclass(frozen=True, eq=False)
class Slider:
    """A prismatic pair: `link` slides on `on` without turning.

    `point` of `link` stays on the line through `origin` [m] with unit vector `direction`, both in the axes of `on`;
    `turn` is the unit vector of the axes of `link` seen from those of `on`.
    The slide is the way of `point` from `origin` along `direction`.
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
        """Its dimensions, which may differ by design."""
        return self.origin, self.direction, self.turn


@dataclass(frozen=True, eq=False)
class Weld:
    """Two links that share a point, joined there rigidly.

    `turn` is the unit vector of the axes of `link` seen from those of `on`.
    """

    point: str
    link: str
    on: str
    turn: Complex = 1.0

    @property
    def lengths(self) -> tuple[Complex, ...]:
        """Its dimensions, which may differ by design."""
        return (self.turn,)

    @property
    def name(self) -> str:
        """Its name: that of its point, as for a pin."""
        return self.point


@dataclass(frozen=True)
class PinDrive:
    """A motor at the pin `at` that turns `link` on the link `on`.

    Its coordinate is the angle [rad] of the axes of `link` from those of `on`, counter-clockwise. `inertia` [kg m^2] of
    its rotor and gear, reduced to that coordinate, resists its change; what it does to `on` besides is left out.
    """

    link: str
    at: str
    on: str = GROUND
    inertia: Real = field(default=0.0, compare=False)  # of which no structure depends
    turns: ClassVar[bool] = True

    @property
    def joint(self) -> str:
        """Name of the joint that it moves."""
        return self.at

    @property
    def name(self) -> str:
        """Its name: that of its link."""
        return self.link

    @property
    def links(self) -> tuple[str, ...]:
        """The links that it names."""
        return self.link, self.on


@dataclass(frozen=True)
class SliderDrive:
    """A motor that moves a slider; its coordinate is the slide [m], and `inertia` [kg] a mass reduced to that."""

    slider: str
    inertia: Real = field(default=0.0, compare=False)  # of which no structure depends
    turns: ClassVar[bool] = False

    @property
    def joint(self) -> str:
        """Name of the joint that it moves."""
        return self.slider

    @property
    def name(self) -> str:
        """Its name: that of its slider."""
        return self.slider

    @property
    def links(self) -> tuple[str, ...]:
        """The links that it names: none."""
        return ()


class Load(Protocol):
    """A load on points of links: a `PointLoad`, a spring, or an object of the user's own."""

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Link and point of every place that it acts on."""
        ...

    def forces(self, motion: AnyMotion) -> Iterable[PointForce]:
        """Forces and moments on those points at every position."""
        ...


@dataclass(frozen=True)
class Gear:
    """Wheels or a rack that tie two joints: the coordinate of `follower` changes by `ratio` times that of `driver`.

    `driver` and `follower` name pins or sliders as drives do; `ratio` is negative for wheels that mesh from outside,
    positive where one is a ring around the other, and [m/rad] for a rack. Their teeth push at the pitch point, where
    the pitch circles touch, inclined by the `pressure_angle` [rad] to the common tangent: the flank is that of the
    effort which is passed on, so that wheels are pushed apart. Pins, sliders and the carrier of the wheels bear it.

    There are no teeth where `pressure_angle` is None, as for a belt or chain, and where there is no pitch point: the
    joints have no link in common that carries them both, the ratio is 1, the axes are one, or both are sliders. Then
    only the moment or force along the coordinates is passed on, between the two links of either joint.
    """

    driver: PinDrive | SliderDrive
    follower: PinDrive | SliderDrive
    ratio: float
    pressure_angle: float | None = PRESSURE_ANGLE


@dataclass(frozen=True, eq=False)
class Friction:
    """Friction of a joint: Coulomb's, in proportion to the force between its surfaces, and viscous.

    A pin that bears the force F resists turning by `coefficient` `radius` |F|, whatever the drive's own moment. The
    block of a slider resists sliding by `coefficient` max(|N|, 2 |M| / `length`): N is the force across its line and M
    the moment about its point, the middle of the guided length, at whose ends the two press. Both resist by `viscosity`
    times the rate besides. At rest there is none.

    Attributes
    ----------
    coefficient
        Of Coulomb's friction.
    radius
        Of a pin [m].
    length
        Over which a slider's block is guided [m]; infinite where its moment is to press on nothing.
    viscosity
        [N m s/rad] of a pin, [N s/m] of a slider.
    """

    coefficient: Real = 0.0
    radius: Real = 0.0
    length: Real = np.inf
    viscosity: Real = 0.0


@dataclass(frozen=True, eq=False)
class PointLoad:
    """A force [N] and a moment [N m] on a point of a link.

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
        """Where it acts."""
        return ((self.link, self.point),)

    def forces(self, motion: AnyMotion) -> Iterable[PointForce]:
        """The force in the ground's axes and the moment at every position."""
        factor = 1.0 if self.law is None else self.law(motion)
        turned = motion.direction[motion.mechanism.index[self.link]] if self.turning else 1.0
        return ((self.link, self.point, self.force * turned * factor, self.moment * factor),)


@dataclass(frozen=True, eq=False)
class LineLoad:
    """A force per length [N/m] along the whole of a beam, linear from `start` to `end` of it.

    `turning`: given in the beam's own axes, instead of the ground's. `law` as for `PointLoad`.
    """

    link: str
    beam: int
    start: Complex
    end: Complex
    turning: bool = False
    law: Law | None = None
