"""Connections between nodes: common positions at pins, constraints, springs, and coordinates of drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import JointCompliance
from fem_check.nonlinear.couplings import CouplingKind, NodeCoupling, coupling_state
from fem_check.nonlinear.nodes import Nodes, NotCheckedError
from fem_check.pins import gap_sense, pins
from rigid import Friction, Gear, Mechanism, PinDrive, Reals, Slider, SliderDrive, Spring, TorsionSpring


class Constraint(Struct, frozen=True):
    """Constraint: a weighted sum of couplings equals `target`, plus the coordinate of a drive if `drive` is given.

    A coupling is a function of the coordinates of two nodes, see `NodeCoupling`.

    `parts` are the index and the weight of each coupling.
    """

    parts: tuple[tuple[int, float], ...]
    target: float = 0.0
    drive: int | None = None


class CouplingSpring(Struct, frozen=True):
    """Spring and damper that act on a coupling c, i.e. a function of the coordinates of two nodes.

    The force is preload + stiffness s + damping ds/dt with s = c - rest - coordinate of the drive. If `drive` is None,
    the coordinate of the drive is omitted. If `around` is given, c is an angle, to which full turns are added until it
    differs from `around` by at most half a turn.
    """

    coupling: int
    stiffness: float
    rest: float = 0.0
    drive: int | None = None
    damping: float = 0.0
    preload: float = 0.0
    around: float | None = None

    def stretch(self, value: Reals) -> Reals:
        """Return s for given values of the coupling, without the coordinate of the drive."""
        if self.around is None:
            return value - self.rest
        return self.around + np.remainder(value - self.around + pi, 2 * pi) - pi - self.rest


class JointSource(Struct, frozen=True):
    """Nodes and couplings (see `NodeCoupling`) from which the force of a joint on its child link is computed.

    Attributes
    ----------
    parent, child
        Link indices.
    node
        Node of the child, if it shares its position with a node of the parent or is fixed to the ground; else None.
    couplings
        Couplings that transmit the force; empty if `node` is given.
    turn
        Coupling that transmits the moment of a weld, or None.
    """

    name: str
    parent: int
    child: int
    node: int | None
    couplings: tuple[int, ...]
    turn: int | None = None


@dataclass(eq=False)
class Ties:
    """All connections between nodes of a mechanism.

    Attributes
    ----------
    shared
        Pairs of nodes with a common position.
    fixed
        Positions of nodes at pins on the ground (complex) [m], by node.
    driven
        Nodes that drives turn relative to the ground, by drive index. The rotation of such a node is prescribed.
    drive_couplings
        For each drive, the coupling that equals its coordinate, or None if the drive is in `driven`.
    winding
        Full turns of each drive [rad]: the drawn angle between the links of the drive, minus the initial coordinate of
        the drive, rounded to full turns. 0 for sliders.
    """

    couplings: list[NodeCoupling] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)
    springs: list[CouplingSpring] = field(default_factory=list)
    shared: list[tuple[int, int]] = field(default_factory=list)
    fixed: dict[int, complex] = field(default_factory=dict)
    driven: dict[int, int] = field(default_factory=dict)
    joints: list[JointSource] = field(default_factory=list)
    drive_couplings: list[int | None] = field(default_factory=list)
    winding: Any = 0.0


def ties_of(
    mechanism: Mechanism,
    nodes: Nodes,
    joints: Mapping[str, JointCompliance],
    drawn: Reals,
    first: Reals,
    joint_damping: float = 0.0,
) -> Ties:
    """Create the connections between the nodes of a mechanism.

    Parameters
    ----------
    joints
        Compliance and misfit of joints, by name.
    drawn
        Approximate x, y and angle of each link, see `drawn_places`, shape (links, 3).
    first
        Coordinates of the drives at the first instant, shape (drives,).
    joint_damping
        Kelvin-Voigt beta of the compliant joints [s].

    Raises
    ------
    NotCheckedError
        If the mechanism has a slider rail or a gear carrier on an elastic link, a joint or spring at a point of an
        elastic link at which no beam ends, a gap at a slider, a misfit at the joint of some drives, a gear at a
        compliant joint, a compliance that does not belong to exactly one joint, or Coulomb friction.
    """
    return _TieBuilder(mechanism, nodes, joints, drawn, joint_damping).built(first)


class _TieBuilder:
    """Builder of the connections."""

    def __init__(
        self,
        mechanism: Mechanism,
        nodes: Nodes,
        joints: Mapping[str, JointCompliance],
        drawn: Reals,
        joint_damping: float,
    ) -> None:
        self.mechanism, self.nodes, self.soft, self.joint_damping = mechanism, nodes, joints, joint_damping
        self.ties = Ties()
        way = nodes.rest * np.exp(1j * drawn[nodes.link, 2])
        place = drawn[nodes.link] + np.stack([way.real, way.imag, np.zeros(len(way))], axis=-1)
        self.drawn = place[None]
        _require_joints(mechanism, joints)

    def built(self, first: Reals) -> Ties:
        """Create all connections."""
        self.ties.winding = np.array([self._winding(drive, first[k]) for k, drive in enumerate(self.mechanism.drives)])
        for point, parent, child, turn in pins(self.mechanism):
            self._pin(point, parent, child, None if turn is None else complex(turn))
        for slider in self.mechanism.sliders:
            self._slider(slider)
        for number, drive in enumerate(self.mechanism.drives):
            self._drive(number, drive)
        for gear in self.mechanism.gears:
            self._gear(gear)
        for name, friction in self.mechanism.friction.items():
            self._viscous(name, friction)
        for load in self.mechanism.loads:
            if isinstance(load, Spring):
                self._spring(load)
            elif isinstance(load, TorsionSpring):
                self._torsion(load)
        return self.ties

    def place(self, link: int, point: str) -> tuple[int, complex]:
        """See `place_of`."""
        return place_of(self.mechanism, self.nodes, link, point)

    def couple(self, coupling: NodeCoupling) -> int:
        """Add a coupling and return its index."""
        self.ties.couplings.append(coupling)
        return len(self.ties.couplings) - 1

    def _drawn_value(self, coupling: NodeCoupling) -> float:
        return float(coupling_state((coupling,), self.drawn).value[0, 0])

    def _pin(self, point: str, parent: int, child: int, turned: complex | None) -> None:
        """Add a pin, or a weld if `turned`, the unit vector of the child in axes of the parent, is given."""
        (p, at_p), (c, at_c) = self.place(parent, point), self.place(child, point)
        compliance = self.soft.get(point, JointCompliance())
        turn = None if turned is None else self._turn(point, (parent, p), (child, c), turned, compliance)
        gap = gap_sense(self.mechanism, point, parent, child) * compliance.gap if compliance.gap else 0.0
        if not compliance.translation and not gap and not at_c and (parent == 0 or not at_p):
            if parent == 0:
                self.ties.fixed[c] = at_p
            else:
                self.ties.shared.append((p, c))
            self.ties.joints.append(JointSource(point, parent, child, c, (), turn))
            return
        pair = tuple(self.couple(NodeCoupling(kind, p, c, at_p, at_c)) for kind in (CouplingKind.X, CouplingKind.Y))
        for number, target in zip(pair, (complex(gap).real, complex(gap).imag), strict=True):
            self._closed(number, target, compliance.translation)
        self.ties.joints.append(JointSource(point, parent, child, None, pair, turn))

    def _closed(self, coupling: int, target: float, soft: float, drive: int | None = None) -> None:
        """Constrain a coupling to its target, or add a spring if the joint is compliant."""
        if soft:
            self.ties.springs.append(CouplingSpring(coupling, 1.0 / soft, target, drive, self.joint_damping / soft))
        else:
            self.ties.constraints.append(Constraint(((coupling, 1.0),), target, drive))

    def _rail(self, slider: Slider, kind: CouplingKind) -> NodeCoupling:
        index = self.mechanism.index
        owner = index[slider.on]
        rigid = [node for node, link in enumerate(self.nodes.link) if link == owner]
        if len(rigid) > 1:
            raise NotCheckedError(
                f'slider "{slider.name}" moves along the elastic link "{slider.on}": the nonlinear check supports only '
                "sliders on the ground and on rigid links"
            )
        child, at = self.place(index[slider.link], slider.point)
        return NodeCoupling(kind, rigid[0], child, complex(slider.origin), at, complex(slider.direction))

    def _slider(self, slider: Slider) -> None:
        index = self.mechanism.index
        compliance = self.soft.get(slider.name, JointCompliance())
        if compliance.gap:
            raise NotCheckedError(f'slider "{slider.name}" has a gap: the nonlinear check supports only gaps at pins')
        rail = self._rail(slider, CouplingKind.ACROSS)
        across = self.couple(rail)
        ends = (index[slider.on], rail.parent), (index[slider.link], rail.child)
        turn = self._turn(slider.name, *ends, complex(slider.turn), compliance)
        self._closed(across, 0.0, compliance.translation)
        self.ties.joints.append(JointSource(slider.name, index[slider.on], index[slider.link], None, (across, turn)))

    def _turn(
        self, name: str, parent: tuple[int, int], child: tuple[int, int], turned: complex, compliance: JointCompliance
    ) -> int:
        """Fix the angle between two links, including full turns as drawn, and return the index of its coupling.

        `parent` and `child` are pairs of link and node. `turned` is the unit vector of the child in axes of the parent.
        """
        coupling = NodeCoupling(CouplingKind.TURN, parent[1], child[1])
        angle = float(np.angle(turned))
        angle += 2 * pi * round((self._drawn_value(coupling) - angle) / (2 * pi))
        number = self.couple(coupling)
        sense = gap_sense(self.mechanism, name, parent[0], child[0]) if compliance.turn else 1.0
        self._closed(number, angle + sense * compliance.turn, compliance.rotation)
        return number

    def _coordinate(self, drive: PinDrive | SliderDrive) -> NodeCoupling:
        """Return the coupling for the coordinate of a drive."""
        if drive.turns:
            parent, child = (self.place(link, drive.joint)[0] for link in self.mechanism.ends(drive))
            return NodeCoupling(CouplingKind.TURN, parent, child)
        return self._rail(self.mechanism.slider(drive.joint), CouplingKind.ALONG)

    def _winding(self, drive: PinDrive | SliderDrive, first: float) -> float:
        if not drive.turns:
            return 0.0
        return 2 * pi * round((self._drawn_value(self._coordinate(drive)) - first) / (2 * pi))

    def _drive(self, number: int, drive: PinDrive | SliderDrive) -> None:
        coupling = self._coordinate(drive)
        name = drive.joint
        compliance = self.soft.get(name, JointCompliance())
        if drive.turns and coupling.parent == 0 and not compliance.rotation and not compliance.turn:
            self.ties.driven[number] = coupling.child
            self.ties.drive_couplings.append(None)
            return
        if compliance.turn or compliance.gap:
            raise NotCheckedError(
                f'the joint "{name}" of a drive has a misfit (gap or turn): the nonlinear check does not support this'
            )
        moved = self.couple(coupling)
        self._closed(moved, 0.0, compliance.rotation if drive.turns else compliance.translation, number)
        self.ties.drive_couplings.append(moved)

    def _gear(self, gear: Gear) -> None:
        """Constrain the ratio of the joint coordinates. The line of action of the tooth force is neglected."""
        both = set(self.mechanism.ends(gear.follower)) & set(self.mechanism.ends(gear.driver))
        if gear.pressure_angle is not None and any(self.mechanism.links[link].beams for link in both):
            raise NotCheckedError(
                f'the gear at "{gear.follower.joint}" is on an elastic carrier: the nonlinear check neglects the force '
                "between the teeth"
            )
        follower, driver = self._coordinate(gear.follower), self._coordinate(gear.driver)
        target = self._drawn_value(follower) - gear.ratio * self._drawn_value(driver)
        parts = (self.couple(follower), 1.0), (self.couple(driver), -gear.ratio)
        name = gear.follower.joint
        if self.soft.get(name, JointCompliance()).rotation:
            raise NotCheckedError(
                f'gear at the compliant joint "{name}": the nonlinear check supports only stiff gears'
            )
        self.ties.constraints.append(Constraint(parts, target))

    def _viscous(self, name: str, friction: Friction) -> None:
        """Add a damper for the viscous friction of a joint."""
        if np.any(friction.coefficient):
            raise NotCheckedError(
                f'Coulomb friction at "{name}": the nonlinear check does not support it, because its time steps assume '
                "smooth forces"
            )
        slider = next((slider for slider in self.mechanism.sliders if slider.name == name), None)
        if slider is None:
            parent, child = next((p, c) for point, p, c, _ in pins(self.mechanism) if point == name)
            ends = self.place(parent, name)[0], self.place(child, name)[0]
            coupling = NodeCoupling(CouplingKind.TURN, *ends)
        else:
            coupling = self._rail(slider, CouplingKind.ALONG)
        self.ties.springs.append(CouplingSpring(self.couple(coupling), 0.0, damping=float(friction.viscosity)))

    def _spring(self, spring: Spring) -> None:
        index = self.mechanism.index
        (p, at_p), (c, at_c) = self.place(index[spring.on], spring.anchor), self.place(index[spring.link], spring.point)
        number = self.couple(NodeCoupling(CouplingKind.DISTANCE, p, c, at_p, at_c))
        damping, preload = float(spring.damping), float(spring.preload)
        rest = float(spring.length)
        self.ties.springs.append(CouplingSpring(number, float(spring.stiffness), rest, None, damping, preload))

    def _torsion(self, spring: TorsionSpring) -> None:
        index = self.mechanism.index
        parent, child = (self.place(index[name], spring.at)[0] for name in (spring.on, spring.link))
        number = self.couple(NodeCoupling(CouplingKind.TURN, parent, child))
        drawn = self._drawn_value(self.ties.couplings[number])
        turns = 2 * pi * round((drawn - float(spring.drawn(self.mechanism))) / (2 * pi))
        rest: float = float(spring.angle) + turns
        around: float | None = drawn
        for k, drive in enumerate(self.mechanism.drives):
            if not isinstance(drive, PinDrive) or drive.at != spring.at:
                continue
            if {drive.link, drive.on} == {spring.link, spring.on}:
                rest = float(spring.angle) + self.ties.winding[k] * (1 if drive.link == spring.link else -1)
                around = None
        damping, preload = float(spring.damping), float(spring.preload)
        self.ties.springs.append(CouplingSpring(number, float(spring.stiffness), rest, None, damping, preload, around))


def place_of(mechanism: Mechanism, nodes: Nodes, link: int, point: str) -> tuple[int, complex]:
    """Return the node that carries a point of a link, and the vector from the node to the point in link axes [m].

    Raise NotCheckedError if the link is elastic and no beam ends at the point.
    """
    if (link, point) not in nodes.at:
        name = mechanism.links[link].name
        raise NotCheckedError(f'link "{name}": no beam reaches the point "{point}", which carries a joint or a load')
    return nodes.at[link, point]


def _require_joints(mechanism: Mechanism, joints: Mapping[str, JointCompliance]) -> None:
    names: Sequence[str] = [*(name for name, *_ in pins(mechanism)), *(slider.name for slider in mechanism.sliders)]
    for name in joints:
        if names.count(name) != 1:
            raise NotCheckedError(
                f'compliance or misfit of "{name}": expected one joint with this name, got {names.count(name)}'
            )
