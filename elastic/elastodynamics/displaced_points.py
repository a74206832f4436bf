"""Forces and gaps that linear theory neglects at displaced points.

The points belong to lumps, springs, loads, links without beams, and sliders on links without beams.

In the linear solution, an arm a that rotates by alpha displaces its end by i alpha a, and forces act at the end of the
arm in its rigid position. The exact displacement of the end is (exp(i alpha) - 1) a. The difference between both
displacements is added to the gap of a joint at the end. Since a force acts at the displaced end, it exerts an
additional moment on the link.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.displacements import Displacements, Points
from elastic.elastodynamics.point_effects import lump_force, lumps_of
from elastic.elastodynamics.time_grid import Grid
from rigid import LineLoad, MechanismError, Motion, PointLoad, Spring, TorsionSpring, position_of, velocity_of
from rigid.arrays import Columns, Complexes, Reals
from rigid.plane import cross, dot

PointForce = tuple[int, str, Any, Any]  # link index, point name, force [N], complex, moment [N m]


class DisplacedPoints(Struct, frozen=True, eq=False):
    """Displacements and rotations of points at the nodes of a time grid.

    On links without beams, they may be large.

    Attributes
    ----------
    motion
        Rigid motion at the nodes of the grid.
    chosen
        Selected points, see `chosen_points`.
    moved
        Displacements at the nodes as a single displacement field (c = 1). On links without beams, displacements are
        linear in the rotation of the link.
    """

    motion: Motion
    grid: Grid
    chosen: Points
    moved: Displacements

    def angle(self, at: int) -> Reals:
        """Return the rotation of the axes of a link at the nodes [rad]."""
        return self.moved.angle[:, at, 0]

    def rotation(self, at: int, point: str) -> Reals:
        """Return the rotation of the link or section at a selected point, at the nodes [rad]; 0 on the ground."""
        return self.moved.turns[:, self.chosen.index((at, point)), 0] if at else np.zeros(len(self.moved.angle))

    def is_rigid_link(self, at: int) -> bool:
        """Return whether a link is a moving link without beams."""
        return at > 0 and not self.motion.mechanism.links[at].beams

    def nonlinear_displacement(self, at: int, place: Any) -> Complexes:
        """Return the displacement that linear theory neglects at the end of an arm of a link without beams.

        This is (exp(i alpha) - 1 - i alpha) a at the nodes [m], complex. Here, alpha is the rotation of the link, and a
        is the arm in ground axes. `place` is the arm in link axes.
        """
        return _exp_remainder(self.angle(at)) * self.motion.direction[at] * place

    def displacement(self, at: int, point: str) -> Complexes:
        """Return the displacement of a selected point in ground axes at the nodes [m], complex."""
        moved = self.linear_displacement(at, point)
        return moved + self.nonlinear_displacement(at, self.point(at, point)) if self.is_rigid_link(at) else moved

    def linear_displacement(self, at: int, point: str) -> Complexes:
        """Return the displacement of a selected point according to linear theory, see `displacement`."""
        if not at:
            return np.zeros(len(self.moved.angle), complex)
        return self.moved.moves[:, self.chosen.index((at, point)), 0]

    def point(self, at: int, name: str) -> complex:
        """Return the position of a point in link axes [m], complex."""
        return np.ravel(self.motion.mechanism.links[at].points[name])[0]

    def arm(self, at: int, place: Any) -> Complexes:
        """Convert an arm from link axes to ground axes at the points [m], complex."""
        return self.motion.direction[at][1:] * place


def _exp_remainder(angle: Reals) -> Complexes:
    """Return exp(i angle) - 1 - i angle. The formula avoids cancellation."""
    half = np.sin(angle / 2)
    return -2 * half**2 + 1j * (np.sin(angle) - angle)


def require_supported(motion: Motion) -> None:
    """Raise an error if the theory of large displacement does not cover a joint.

    Raises
    ------
    MechanismError
        If the axis of a wheel on a rack moves, a rigid wheel on a rack rotates about a point other than its first, or a
        block is on an elastic link of a mechanism with redundant joints.
    """
    mechanism = motion.mechanism
    for gear in mechanism.gears:
        wheels = gear.follower, gear.driver
        for wheel in () if all(each.turns for each in wheels) else wheels:
            link = mechanism.links[max(mechanism.ends(wheel))]
            if min(mechanism.ends(wheel)):
                raise MechanismError(f'the axis of the wheel at "{wheel.joint}" on a rack moves')
            if wheel.turns and not link.beams and np.any(link.points[wheel.joint]):
                raise MechanismError(f'the wheel "{link.name}" on a rack rotates about a point other than its first')
    surplus = any(closed.redundancy for closed in motion.closures)
    for joint in motion.structure.joints:
        if surplus and not joint.turns and mechanism.links[joint.owner].beams:
            raise MechanismError(
                f'the block of "{joint.name}" is on an elastic link, and the mechanism has redundant joints'
            )


def point_loads(displaced: DisplacedPoints, accelerations: Complexes) -> list[PointForce]:
    """Compute the additional forces on displaced points: inertia, springs, and loads that rotate with their links.

    Parameters
    ----------
    accelerations
        Acceleration and angular acceleration of each lump according to linear theory, complex, shape (points, 2 lumps).
        Column 2 k contains the acceleration of lump k, and column 2 k + 1 its angular acceleration.
    """
    return [*_lumps(displaced, accelerations), *_springs(displaced), *_turning_loads(displaced)]


def _lumps(displaced: DisplacedPoints, accelerations: Complexes) -> Iterator[PointForce]:
    motion = displaced.motion
    for number, (at, lump) in enumerate(lumps_of(motion.mechanism)):
        point, offset = displaced.point(at, lump.point), np.ravel(lump.offset)[0]
        place, angle = (
            (point + offset, displaced.angle(at))
            if displaced.is_rigid_link(at)
            else (offset, displaced.rotation(at, lump.point))
        )
        remainder = _exp_remainder(angle) * motion.direction[at] * place
        acceleration = accelerations[:, 2 * number] + displaced.grid.rates(remainder)[1]
        force = -np.ravel(lump.mass)[0] * acceleration
        rigid, arm = lump_force(motion, at, lump)[1:], displaced.arm(at, offset)
        moment = -np.ravel(lump.inertia)[0] * accelerations[:, 2 * number + 1].real
        rotated_arm = np.exp(1j * angle[1:]) * arm
        yield at, lump.point, force, moment + cross(rotated_arm, rigid + force) - cross(arm, rigid)


def _springs(displaced: DisplacedPoints) -> Iterator[PointForce]:
    motion = displaced.motion
    index = motion.mechanism.index
    for load in motion.mechanism.loads:
        if isinstance(load, Spring):
            ends = (index[load.link], load.point), (index[load.on], load.anchor)
            apart = displaced.displacement(*ends[0]) - displaced.displacement(*ends[1])
            vector = (position_of(motion, *ends[0]) - position_of(motion, *ends[1]))[1:]
            opening = (velocity_of(motion, *ends[0]) - velocity_of(motion, *ends[1]))[1:]
            force_change = _spring_force(
                load, vector + apart[1:], opening + displaced.grid.rates(apart)[0]
            ) - _spring_force(load, vector, opening)
            yield (*ends[0], -force_change, 0.0)
            yield (*ends[1], force_change, 0.0)
        if isinstance(load, TorsionSpring):
            both = (index[load.link], load.at), (index[load.on], load.at)
            angle = displaced.rotation(*both[0]) - displaced.rotation(*both[1])
            moment = load.stiffness * angle[1:] + load.damping * displaced.grid.rates(angle)[0]
            yield (*both[0], 0.0, -moment)
            yield (*both[1], 0.0, moment)


def _spring_force(spring: Spring, vector: Complexes, opening: Complexes) -> Complexes:
    """Return the force of a spring in ground axes [N], complex.

    `vector` is the vector between the ends of the spring, and `opening` the time derivative of this vector.
    """
    distance = np.abs(vector)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.where(distance > 0, vector / distance, 0.0)
    tension = spring.preload + spring.stiffness * (distance - spring.length) + spring.damping * dot(unit, opening)
    return tension * unit


def _turning_loads(displaced: DisplacedPoints) -> Iterator[PointForce]:
    motion = displaced.motion
    for load in motion.mechanism.loads:
        if isinstance(load, PointLoad) and load.turning:
            at = motion.mechanism.index[load.link]
            for _, _, force, _ in load.forces(motion):
                rotation_factor = np.exp(1j * displaced.rotation(at, load.point)[1:]) - 1
                yield at, load.point, rotation_factor * np.broadcast_to(force, motion.columns)[1:], 0.0


def rigid_link_loads(
    displaced: DisplacedPoints,
    added: list[PointForce],
    forces: Complexes,
    other_forces: Iterable[tuple[int, str, Complexes]],
) -> tuple[list[PointForce], list[Complexes]]:
    """Compute the additional moments on links without beams, and the joint gaps, due to rotation of these links.

    Parameters
    ----------
    added
        See `point_loads`.
    forces
        Joint forces in ground axes [N], complex, shape (nodes, joints).
    other_forces
        Further forces on points, in addition to `added` and the loads of the mechanism: link index, point name, force.

    Returns
    -------
    Loads on points, and the additional gap of each joint (see `AddedLoads.gaps`) [m], complex, both at the points of
    the grid.
    """
    motion = displaced.motion
    mechanism = motion.mechanism
    loads, gaps = list(added), [np.zeros(len(forces) - 1, complex) for _ in motion.places]
    moments = {at: np.zeros(len(forces) - 1) for at in range(len(mechanism.links)) if displaced.is_rigid_link(at)}

    def add_moment(at: int, arm: Complexes, force: Columns) -> None:
        if at in moments:
            moments[at] += cross((np.exp(1j * displaced.angle(at)[1:]) - 1) * arm, force)

    for number, place in enumerate(motion.places):
        joint = place.joint
        force = forces[1:, number]
        sliding = not joint.turns and displaced.is_rigid_link(joint.owner)
        if sliding:
            force = force * np.exp(1j * displaced.angle(joint.owner)[1:])
            on_owner, gap = _slider(displaced, number, forces[1:, number])
            loads += on_owner
            gaps[number] = gap
        for at, sign in ((joint.child, 1.0), (joint.parent, -1.0)):
            if sliding and at == joint.owner:
                continue
            name = joint.point(at)
            if displaced.is_rigid_link(at) and name:
                add_moment(at, displaced.arm(at, displaced.point(at, name)), sign * force)
                if not sliding:
                    gaps[number] = (
                        gaps[number] - sign * displaced.nonlinear_displacement(at, displaced.point(at, name))[1:]
                    )
    for at, lump in lumps_of(mechanism):
        add_moment(at, displaced.arm(at, displaced.point(at, lump.point)), lump_force(motion, at, lump)[1:])
    for load in mechanism.loads:
        for link, point, force, _ in () if isinstance(load, LineLoad) else load.forces(motion):
            at = mechanism.index[link]
            add_moment(at, displaced.arm(at, displaced.point(at, point)), np.broadcast_to(force, motion.columns)[1:])
    for at, point, force in (*((at, point, force) for at, point, force, _ in added), *other_forces):
        add_moment(at, displaced.arm(at, displaced.point(at, point)), force)
    loads += [(at, _first_point(displaced, at), 0.0, moment) for at, moment in moments.items()]
    return [load for load in loads if load[0]], gaps


def _first_point(displaced: DisplacedPoints, at: int) -> str:
    return next(iter(displaced.motion.mechanism.links[at].points))


def _slider(displaced: DisplacedPoints, number: int, force: Complexes) -> tuple[list[PointForce], Complexes]:
    """Return the additional loads and the additional gap of a slider on a link without beams.

    The force on the block rotates with this link.
    """
    motion, place = displaced.motion, displaced.motion.places[number]
    joint, owner, block = place.joint, place.joint.owner, place.joint.block
    point, first = joint.point(block) or "", _first_point(displaced, owner)
    start = displaced.point(owner, first)
    angle = displaced.angle(owner)[1:]
    shift = (
        displaced.displacement(owner, first) - _exp_minus_one(displaced.angle(owner)) * motion.direction[owner] * start
    )[1:]
    arm = np.broadcast_to(place.arm(owner), motion.columns)[1:]
    moved = displaced.displacement(block, point)[1:]
    reach = arm + moved - shift
    linear_block = displaced.moved.moves[1:, displaced.chosen.index((block, point)), 0]
    missing_displacement = (np.exp(-1j * angle) * reach - arm) - (linear_block - shift - 1j * angle * arm)
    on_block = joint.sense * force
    force_change = on_block * _exp_minus_one(angle)
    moment = -(cross(reach, on_block + force_change) - cross(arm, on_block)) + cross(
        displaced.arm(owner, start), force_change
    )
    return [
        (block, point, force_change, 0.0),
        (owner, first, -force_change, moment),
    ], -joint.sense * missing_displacement


def _exp_minus_one(angle: Reals) -> Complexes:
    return np.exp(1j * angle) - 1
