"""Spatial joints with their static and kinematic torsors, and spatial chains for mobility analysis.

A torsor is a pair of vectors, a resultant and a moment at a point. The kinematic torsor of a joint is the motion of its
end link relative to its start link: angular velocity (resultant) and velocity at the point (moment). The static torsor
is the load that the start link transmits to the end link: force and moment at the point. In `JointType`, components
refer to the axes x, y, z of the joint.
"""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches

import numpy as np
from msgspec import Struct

from rigid.arrays import Reals
from rigid.parts import GROUND, MechanismError
from rigid.topology.graph import Branch, Graph
from rigid.topology.ranks import Chain

Vector = tuple[float, float, float]
ROTATIONS = ("Ωx", "Ωy", "Ωz")
VELOCITIES = ("Vx", "Vy", "Vz")
FORCES = ("X", "Y", "Z")
MOMENTS = ("L", "M", "N")


class JointType(Struct, frozen=True):
    """A type of spatial joint.

    Attributes
    ----------
    name
        Common name.
    meaning
        Description of the joint and its axes.
    freedoms
        Independent components of the kinematic torsor. The translation of a helical joint along its axis follows from
        its rotation, and is not included.
    axis
        Joint axis (x or z) that `SpatialJoint.axis` defines.
    normal
        Joint axis that `SpatialJoint.normal` defines, for the two types with a second direction; otherwise "".
    """

    name: str
    meaning: str
    freedoms: tuple[str, ...]
    axis: str = "z"
    normal: str = ""

    @property
    def transmits(self) -> tuple[str, ...]:
        """Components of the static torsor that the joint transmits. They do no work in the free motions."""
        blocked = zip((*FORCES, *MOMENTS), (*VELOCITIES, *ROTATIONS), strict=True)
        return tuple(carried for carried, freedom in blocked if freedom not in self.freedoms)


JOINT_TYPES: Mapping[str, JointType] = {
    joint.name: joint
    for joint in (
        JointType("point", "contact in a point of normal z", ("Ωx", "Ωy", "Ωz", "Vx", "Vy")),
        JointType("line", "contact along a line x of normal z", ("Ωx", "Ωz", "Vx", "Vy"), "x", "z"),
        JointType("annular", "sphere in a cylinder of axis x", ("Ωx", "Ωy", "Ωz", "Vx"), "x"),
        JointType("spherical", "ball", ("Ωx", "Ωy", "Ωz")),
        JointType("planar", "contact of planes of normal z", ("Ωz", "Vx", "Vy")),
        JointType("cylindrical", "turns about z and slides along it", ("Ωz", "Vz")),
        JointType("universal", "turns about x and about z", ("Ωx", "Ωz"), "x", "z"),
        JointType("helical", "screw along z, Vz = p Ωz, N = -p Z", ("Ωz",)),
        JointType("prismatic", "slides along z", ("Vz",)),
        JointType("revolute", "turns about z", ("Ωz",)),
        JointType("rigid", "no freedom", ()),
    )
}
"""Types of spatial joints, by name."""

SYNONYMS: Mapping[str, str] = {
    "punctual": "point",
    "rectilinear": "line",
    "linear rectilinear": "line",
    "annular linear": "annular",
    "ball": "spherical",
    "plane": "planar",
    "sliding pivot": "cylindrical",
    "cardan": "universal",
    "screw": "helical",
    "slide": "prismatic",
    "slider": "prismatic",
    "pivot": "revolute",
    "pin": "revolute",
    "fixed": "rigid",
}
"""Other common names of joint types, and the corresponding names in `JOINT_TYPES`."""


class SpatialJoint(Struct, frozen=True):
    """A joint between two links in space.

    Attributes
    ----------
    links
        Names of the start link and the end link.
    type
        A name in `JOINT_TYPES` or `SYNONYMS`.
    at
        Position [m].
    axis
        Direction of the axis; for a point or planar contact, direction of the normal.
    pitch
        For a helical joint: advance per radian p [m], negative for a left-handed thread.
    normal
        Normal of a line contact, or second axis of a universal joint. It must be perpendicular to `axis`.
    """

    name: str
    links: tuple[str, str]
    type: str
    at: Vector = (0.0, 0.0, 0.0)
    axis: Vector = (0.0, 0.0, 1.0)
    pitch: float = 0.0
    normal: Vector | None = None

    @property
    def kind(self) -> JointType:
        """Type of the joint.

        Raises
        ------
        MechanismError
            If the type is unknown.
        """
        name = SYNONYMS.get(self.type, self.type)
        if name not in JOINT_TYPES:
            near = get_close_matches(self.type, [*JOINT_TYPES, *SYNONYMS], 1)
            hint = f', did you mean "{near[0]}"?' if near else f", expected one of {', '.join(JOINT_TYPES)}"
            raise _fault(self.name, "type", f'there is no type "{self.type}"{hint}')
        return JOINT_TYPES[name]


def kinematic_torsor(joint: SpatialJoint, at: Vector | Reals | None = None) -> Reals:
    """Return the free motions of a joint at a point, shape (6, freedoms).

    The rows are (Ωx, Ωy, Ωz, Vx, Vy, Vz) in ground axes. The columns are unit angular velocities [rad/s] and unit
    velocities [m/s] along the axes of the joint, in the order of `joint.kind.freedoms`. `at` [m] defaults to the
    joint's position.
    """
    axes = _axes(joint)
    columns = []
    for freedom in joint.kind.freedoms:
        axis = axes[:, "xyz".index(freedom[1])]
        helix = joint.pitch if joint.kind.name == "helical" else 0.0
        columns.append((axis, helix * axis) if freedom in ROTATIONS else (np.zeros(3), axis))
    angular, velocity = np.array(columns).reshape(-1, 2, 3).transpose(1, 2, 0)
    arm = np.zeros(3) if at is None else np.asarray(at) - np.asarray(joint.at)
    return np.concatenate([angular, velocity + np.cross(angular, arm, axis=0)] if columns else [angular, velocity])


def static_torsor(joint: SpatialJoint, at: Vector | Reals | None = None) -> Reals:
    """Return the wrenches that a joint transmits to its end link, at a point, shape (6, components).

    The rows are (X, Y, Z, L, M, N) in ground axes. The columns are unit forces [N] and unit moments [N m] along the
    axes of the joint, in the order of `joint.kind.transmits`. `at` [m] defaults to the joint's position.
    """
    axes = _axes(joint)
    columns = []
    for component in joint.kind.transmits:
        force, moment = np.zeros(3), np.zeros(3)
        if component in FORCES:
            force = axes[:, FORCES.index(component)]
            # in a thread, a moment about the axis accompanies an axial force, so that both together do no work
            moment = -joint.pitch * force if joint.kind.name == "helical" and component == "Z" else moment
        else:
            moment = axes[:, MOMENTS.index(component)]
        columns.append((force, moment))
    force, moment = np.array(columns).reshape(-1, 2, 3).transpose(1, 2, 0)
    arm = np.zeros(3) if at is None else np.asarray(joint.at) - np.asarray(at)
    return np.concatenate([force, moment + np.cross(arm, force.T).T])


def spatial_chain(joints: Iterable[SpatialJoint], fixed: str | None = None) -> Chain:
    """Return the chain of joints in space.

    Parameters
    ----------
    fixed
        Name of the fixed link (default: "ground" if there is such a link, otherwise the first link).

    Raises
    ------
    MechanismError
        If there are no joints, a name occurs twice, a type or the fixed link is unknown, an axis is zero, or a normal
        is missing, zero or not perpendicular to the axis.
    """
    joints = tuple(joints)
    if not joints:
        raise MechanismError("there are no joints")
    names = [joint.name for joint in joints]
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise MechanismError(f'two joints have the name "{repeated[0]}"')
    nodes = list(dict.fromkeys(link for joint in joints for link in joint.links))
    fixed = fixed or (GROUND if GROUND in nodes else nodes[0])
    if fixed not in nodes:
        raise MechanismError(f'no joint has the fixed link "{fixed}"')
    nodes.sort(key=lambda node: node != fixed)
    places = np.array([joint.at for joint in joints], float)
    center = places.mean(axis=0)
    lengths = [*np.linalg.norm(places - center, axis=1), *(abs(joint.pitch) for joint in joints)]
    return Chain(
        Graph(tuple(Branch(joint.name, *joint.links) for joint in joints), tuple(nodes)),
        tuple(kinematic_torsor(joint, center) for joint in joints),
        tuple(joint.kind.freedoms for joint in joints),
        center,
        float(np.sqrt(np.mean(np.square(lengths)))) or 1.0,
    )


def _axes(joint: SpatialJoint) -> Reals:
    """Return the rotation matrix with the joint's x, y and z axes as columns."""
    kind = joint.kind
    axis = _unit(joint, joint.axis, "axis")
    if kind.normal:
        if joint.normal is None:
            raise _fault(joint.name, "normal", f"a {kind.name} joint needs a normal")
        other = _unit(joint, joint.normal, "normal")
        if abs(axis @ other) > 1e-9:
            angle = np.degrees(np.arccos(np.clip(axis @ other, -1, 1)))
            raise _fault(joint.name, "normal", f"the angle between axis and normal is {angle:.6g} deg, expected 90")
    else:
        other = np.eye(3)[np.abs(axis).argmin()]
        other = other - (other @ axis) * axis
        other = other / np.linalg.norm(other)
    if kind.axis == "x":
        return np.stack([axis, np.cross(other, axis), other], axis=1)
    return np.stack([other, np.cross(axis, other), axis], axis=1)


def _unit(joint: SpatialJoint, direction: Vector, what: str) -> Reals:
    axis = np.asarray(direction, float)
    length = np.linalg.norm(axis)
    if not length > 0:
        raise _fault(joint.name, what, f"its {what} has no length")
    return np.asarray(axis / length)


def _fault(joint: str, kind: str, problem: str) -> MechanismError:
    return MechanismError(f'joint "{joint}": {problem}', kind=kind, joints=(joint,))
