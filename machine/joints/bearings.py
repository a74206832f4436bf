"""Rolling and plain bearings, pins and eyes: loads, life and stresses due to the joint force."""

import numpy as np
from msgspec import Struct

from machine.joints.histories import JointHistory
from machine.ranges import Range
from rigid.arrays import Real, Reals, of_designs

MILLION = 1e6
LIFE_FACTORS = {0.90: 1.0, 0.95: 0.64, 0.96: 0.55, 0.97: 0.47, 0.98: 0.37, 0.99: 0.25}
"""Life factor a_1 by reliability (ISO 281:2007, table 12)."""
EXPONENTS = {"ball": 3.0, "roller": 10.0 / 3.0}  # life exponent p, by kind of bearing
MIN_LOADS = {"ball": 0.01, "roller": 0.02}
"""(Minimum load that prevents skidding of the rolling elements) / (dynamic load rating C), from bearing makers."""
SHEAR_FACTOR = 4.0 / 3.0  # (largest shear stress) / (mean shear stress) of a solid round section
BEARING_LIFE = "life of a rolling bearing"
LOAD_RANGE = Range(
    BEARING_LIFE, "equivalent load over C", "ISO 281:2007, least of C0 and 0.5 C", most=0.5,
    outside="a larger load deforms the raceways: choose a larger bearing",
)  # fmt: skip
"""Equivalent load / dynamic rating for which ISO 281 applies."""
SLIP_RANGE = Range(
    BEARING_LIFE, "equivalent load over the minimum load", "bearing makers: 0.01 C for balls, 0.02 C for rollers",
    least=1.0, outside="under a smaller load the elements skid: choose a smaller bearing, or preload it",
)  # fmt: skip
"""Equivalent load / minimum load (`MIN_LOADS`) above which the rolling elements do not skid."""
STATIC_RANGE = Range(
    BEARING_LIFE, "C0 over the largest load", "ISO 76:2006", least=1.0,
    outside="a larger load leaves dents in the raceways: choose a larger bearing",
)  # fmt: skip
"""(Static load rating C0) / (largest load) that ISO 76 requires."""
OVERLAP_RANGE = Range(
    BEARING_LIFE, "swing over twice the angle between elements", "Harris and Kotzalas 2007, section 11.10", least=1.0,
    outside="a smaller swing wears the raceways (false brinelling): choose a plain bearing",
)  # fmt: skip
"""Swing / (4 pi/Z) for which the life formula applies; Z is the number of rolling elements."""
PIN_RANGE = Range(
    "stress of a pin", "yield stress over stress", "Roloff/Matek 2007, section 9.2.2: elastic beam", least=1.0,
    outside="the pin yields, and the formula no longer holds",
)  # fmt: skip
"""Yield stress / stress for which a pin stays elastic."""
EYE_RANGE = Range(
    "stress of an eye", "yield stress over stress", "Roloff/Matek 2007, section 9.2.2: elastic", least=1.0,
    outside="the eye yields, and the formula no longer holds",
)  # fmt: skip
"""Yield stress / stress for which an eye stays elastic."""
HOLE_RANGE = Range(
    "notch factor of an eye", "hole over the width", "Roark's Formulas, 7th ed. 2002, table 17.1", 0.15, 0.75
)
"""Hole / width for which the eye formula applies."""
EDGE_RANGE = Range(
    "notch factor of an eye", "edge over the width", "Roark's Formulas, 7th ed. 2002, table 17.1", least=1.0
)
"""Edge distance / width for which the eye formula applies."""


class Rolling(Struct, frozen=True, eq=False):
    """A rolling bearing under a radial load.

    Attributes
    ----------
    dynamic, static
        Load ratings C and C0 [N].
    kind
        "ball" or "roller".
    reliability
        Probability that a bearing reaches its computed life: a key of `LIFE_FACTORS`.
    condition
        Life factor a_ISO for lubrication and contamination.
    elements
        Number of rolling elements; nan if unknown.
    """

    dynamic: Real
    static: Real = np.nan
    kind: str = "ball"
    reliability: float = 0.90
    condition: Real = 1.0
    elements: float = np.nan

    @property
    def exponent(self) -> float:
        """Life exponent p: 3 for balls, 10/3 for rollers."""
        return EXPONENTS[self.kind]

    def equivalent_load(self, history: JointHistory) -> Reals:
        """Return the equivalent load P [N], shape (...): the power mean with exponent p over the angle of rotation."""
        return history.mean_force(self.exponent)

    def revolutions(self, history: JointHistory) -> Reals:
        """Return the life in revolutions, shape (...). Both directions of a swinging bearing count as rotation.

        References
        ----------
        ISO 281:2007, equations (3), (9) and (27): L_nm = a_1 a_ISO (C/P)^p million revolutions. Ranges: `LOAD_RANGE`,
        `STATIC_RANGE`, `SLIP_RANGE`, and `OVERLAP_RANGE` for a swinging bearing.
        """
        with np.errstate(divide="ignore"):
            ratio = of_designs(self.dynamic) / self.equivalent_load(history)
            factor = LIFE_FACTORS[self.reliability] * of_designs(self.condition)
            return np.asarray(factor * ratio**self.exponent * MILLION)

    def life(self, history: JointHistory) -> Reals:
        """Return the life [s], shape (...); infinite if the bearing does not turn.

        For a swinging bearing, the total angle (forth plus back) is converted to revolutions. Ranges: see
        `revolutions`.

        References
        ----------
        Harris and Kotzalas, Essential Concepts of Bearing Technology, 5th ed. 2007, section 11.10.
        """
        with np.errstate(divide="ignore"):
            per_second = history.travel / (2.0 * np.pi) / (history.weight * history.known).sum(axis=-1)
            return np.asarray(np.where(per_second > 0.0, self.revolutions(history) / per_second, np.inf))

    def static_safety(self, history: JointHistory) -> Reals:
        """Return C0 / (largest load), shape (...) (ISO 76:2006). Range: any load."""
        with np.errstate(divide="ignore"):
            return np.asarray(of_designs(self.static) / history.size.max(axis=-1))

    def load_share(self, history: JointHistory) -> Reals:
        """Return (equivalent load) / C, shape (...)."""
        return np.asarray(self.equivalent_load(history) / of_designs(self.dynamic))

    def overlap(self, history: JointHistory) -> Reals:
        """Return swing / critical swing, shape (...).

        At the critical swing, each rolling element just reaches the initial position of the next element. The elements
        move half as far as the ring, so the critical swing of a bearing with Z elements is 4 pi / Z. The result is nan
        if the joint is at rest, or if the number of elements is unknown.
        """
        turning = np.where(history.travel > 0.0, self.elements, np.nan)
        return np.asarray(history.swing * turning / (4.0 * np.pi))


class Plain(Struct, frozen=True, eq=False):
    """A plain bearing, with diameter and width [m]."""

    diameter: Real
    width: Real

    def pressure(self, history: JointHistory) -> Reals:
        """Return the mean pressure, force / projected area [Pa], shape (..., positions). Range: any load."""
        return np.asarray(np.abs(history.force) / (self.diameter * self.width))

    def speed(self, history: JointHistory) -> Reals:
        """Return the sliding speed [m/s], shape (..., positions)."""
        return np.asarray(np.abs(history.rate) * self.diameter / 2.0)

    def pressure_times_speed(self, history: JointHistory) -> Reals:
        """Return the time average of pressure * speed [W/m^2], shape (...).

        Manufacturers state a limit for this average.
        """
        product = history.size / (self.diameter * self.width) * np.nan_to_num(self.speed(history))
        return history.mean(product)


class Guide(Struct, frozen=True, eq=False):
    """A guide of a sliding block that can bear on both sides: length in the sliding direction, and width [m]."""

    length: Real
    width: Real

    def _parts(self, history: JointHistory) -> tuple[Reals, Reals]:
        """Return the uniform pressure due to the force, and the pressure at the ends due to the moment [Pa]."""
        even = np.abs(history.across) / (self.length * self.width)
        return even, np.abs(history.moment) * 6.0 / (self.width * np.square(self.length))

    def pressure(self, history: JointHistory) -> Reals:
        """Return the largest pressure [Pa], which is at an end of the block: F/(l b) + 6 M/(l^2 b), (..., positions).

        The pressure varies linearly along a rigid block. In terms of the eccentricity e = M/F, the largest pressure is
        F/(l b) (1 + 6 e/l). If e exceeds l/6, one end of the block bears on the opposite side of the guide.

        References
        ----------
        Timoshenko, Strength of Materials, part I, 3rd ed. 1955, article 58, eccentric load on a rectangle. Range: any
        eccentricity, because the block can bear on both sides.
        """
        even, ends = self._parts(history)
        return np.asarray(even + ends)

    def speed(self, history: JointHistory) -> Reals:
        """Return the sliding speed [m/s], shape (..., positions)."""
        return np.abs(history.rate)

    def pressure_times_speed(self, history: JointHistory) -> Reals:
        """Return the mean of pressure * speed over time and area [W/m^2], shape (...).

        This mean governs the heating of the guide. The pressure varies linearly along the block from f - m to f + m,
        with f = F/(l b) and m = 6 M/(l^2 b). If m > f, both sides bear, and the mean magnitude of the pressure is
        (f^2 + m^2)/(2 m). Otherwise, the mean pressure is f.
        """
        even, ends = self._parts(history)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(ends > even, (even**2 + ends**2) / (2.0 * ends), even)
        product = np.nan_to_num(mean * self.speed(history)) * history.known
        return history.mean(product)


class Pin(Struct, frozen=True, eq=False):
    """A round pin through an eye, supported by two cheeks, or overhung from one cheek.

    Attributes
    ----------
    diameter, eye, cheek
        Diameter of the pin, thickness of the eye, and thickness of one cheek [m].
    gap
        Gap between eye and cheek [m].
    overhung
        True if the pin is supported on one side only.
    yield_stress
        Yield stress [Pa]; nan if unknown.
    """

    diameter: Real
    eye: Real
    cheek: Real
    gap: Real = 0.0
    overhung: bool = False
    yield_stress: Real = np.nan

    def shear(self, history: JointHistory) -> Reals:
        """Return the largest shear stress [Pa], shape (..., positions): 4/3 of the mean stress, at the neutral axis."""
        area = np.pi * np.square(self.diameter) / 4.0
        return np.asarray(SHEAR_FACTOR * np.abs(history.force) / ((1.0 if self.overhung else 2.0) * area))

    def bending(self, history: JointHistory) -> Reals:
        """Return the largest bending stress for uniform pressure in eye and cheeks [Pa], shape (..., positions).

        The moment is M = F (eye + 2 cheek + 4 gap)/8 between two cheeks. For an overhung pin, clamped at the cheek, the
        moment is M = F (gap + eye/2).

        References
        ----------
        Muhs et al., Roloff/Matek Maschinenelemente, 18th ed. 2007, section 9.2.2, case 1 (without the gap). Range:
        `PIN_RANGE`.
        """
        lever = self.gap + self.eye / 2.0 if self.overhung else (self.eye + 2.0 * self.cheek + 4.0 * self.gap) / 8.0
        return np.asarray(32.0 * np.abs(history.force) * lever / (np.pi * np.power(self.diameter, 3)))

    def safety(self, history: JointHistory) -> Reals:
        """Return (yield stress) / max(bending stress, sqrt(3) * shear stress), shape (..., positions)."""
        worst = np.maximum(self.bending(history), np.sqrt(3.0) * self.shear(history))
        with np.errstate(divide="ignore"):
            return np.asarray(self.yield_stress / worst)


class Eye(Struct, frozen=True, eq=False):
    """An eye: a plate with a hole for a pin.

    Attributes
    ----------
    diameter, width, thickness
        Diameter of the hole, and width and thickness of the plate [m].
    edge
        Distance from the centre of the hole to the end of the plate [m].
    yield_stress
        Yield stress [Pa]; nan if unknown.
    """

    diameter: Real
    width: Real
    thickness: Real
    edge: Real
    yield_stress: Real = np.nan

    @property
    def net_area(self) -> Real:
        """Area of the net section [m^2]."""
        return (self.width - self.diameter) * self.thickness

    @property
    def stress_concentration(self) -> Reals:
        """(Largest stress at the hole) / (mean stress in the net section), for a close fit and tension along the plate.

        References
        ----------
        Young and Budynas, Roark's Formulas for Stress and Strain, 7th ed. 2002, table 17.1, round pin joint with
        closely fitting pin, after Frocht and Hill 1940. Ranges: `HOLE_RANGE`, `EDGE_RANGE`; nan outside.
        """
        part = np.asarray(self.diameter / self.width)
        factor = np.polyval([-51.667, 89.762, -52.714, 12.882], part)
        return np.where(HOLE_RANGE.holds(part) & EDGE_RANGE.holds(self.edge / self.width), factor, np.nan)

    def bearing(self, history: JointHistory) -> Reals:
        """Return the bearing stress F/(d t) [Pa], shape (..., positions). Range: `EYE_RANGE`."""
        return np.asarray(np.abs(history.force) / (self.diameter * self.thickness))

    def net(self, history: JointHistory) -> Reals:
        """Return the tensile stress in the net section, F/((w - d) t) [Pa], shape (..., positions). Range: `EYE_RANGE`.

        The full force is used for every direction of the force.
        """
        return np.asarray(np.abs(history.force) / self.net_area)

    def tear_out(self, history: JointHistory) -> Reals:
        """Return the shear stress F/(2 t (e - d/2)) in two planes from hole to end [Pa], shape (..., positions).

        Each plane is e - d/2 long: from the edge of the hole to the end of the plate. Range: `EYE_RANGE`.
        """
        return np.asarray(np.abs(history.force) / (2.0 * self.thickness * (self.edge - self.diameter / 2.0)))

    def safety(self, history: JointHistory) -> Reals:
        """Return (yield stress) / max(bearing, net, sqrt(3) * tear-out stress), shape (..., positions)."""
        shear = np.sqrt(3.0) * self.tear_out(history)
        worst = np.maximum(np.maximum(self.bearing(history), self.net(history)), shear)
        with np.errstate(divide="ignore"):
            return np.asarray(self.yield_stress / worst)


class JointParts(Struct, frozen=True, eq=False):
    """Parts of a joint: bearings, pin, eye and clearance [m]. Missing parts are None."""

    rolling: Rolling | None = None
    plain: Plain | Guide | None = None
    pin: Pin | None = None
    eye: Eye | None = None
    clearance: Real | None = None
