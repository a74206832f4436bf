"""Large displacement of points: lumps, springs, loads, links without beams, and sliders on them.

In the linear solution, an arm a that rotates by alpha displaces its end by i alpha a, and forces act at the end of the
undisplaced arm. The exact displacement is (exp(i alpha) - 1) a. The difference opens the joints, and the forces exert
additional moments on the links, because their points are shifted.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.elastodynamics.displacements import Displacements, Points
from elastic.elastodynamics.point_effects import lump_force, lumps_of
from elastic.elastodynamics.time_grid import Grid
from rigid import LineLoad, MechanismError, Motion, PointLoad, Spring, TorsionSpring, position_of, velocity_of
from rigid.arrays import Columns, Complexes, Reals
from rigid.plane import cross, dot

Load = tuple[int, str, Any, Any]  # link index, point name, force [N], complex, moment [N m]


@dataclass(frozen=True, eq=False)
class Turned:
    """Angles and displacements of points and of links without beams at the nodes of a grid.

    Attributes
    ----------
    motion
        Rigid motion at the nodes, of which there is one more than points.
    moved
        Displacements at the nodes according to linear theory, as a single kind.
    """

    motion: Motion
    grid: Grid
    chosen: Points
    moved: Displacements

    def angle(self, at: int) -> Reals:
        """Return the rotation of the axes of a link at the nodes [rad]."""
        return self.moved.angle[:, at, 0]

    def turns(self, at: int, point: str) -> Reals:
        """Return the rotation at a chosen point at the nodes [rad], which is 0 on the ground."""
        return self.moved.turns[:, self.chosen.index((at, point)), 0] if at else np.zeros(len(self.moved.angle))

    def bare(self, at: int) -> bool:
        """Return whether a link moves and has no beams."""
        return at > 0 and not self.motion.mechanism.links[at].beams

    def beyond(self, at: int, place: Any) -> Complexes:
        """Return (exp(i alpha) - 1 - i alpha) arm for a link without beams at the nodes [m], complex."""
        return _beyond(self.angle(at)) * self.motion.direction[at] * place

    def displacement(self, at: int, point: str) -> Complexes:
        """Return the displacement of a chosen point in ground axes at the nodes [m], complex."""
        moved = self.linear_displacement(at, point)
        return moved + self.beyond(at, self.point(at, point)) if self.bare(at) else moved

    def linear_displacement(self, at: int, point: str) -> Complexes:
        """Return the displacement as in `displacement`, but according to linear theory."""
        if not at:
            return np.zeros(len(self.moved.angle), complex)
        return self.moved.moves[:, self.chosen.index((at, point)), 0]

    def point(self, at: int, name: str) -> complex:
        """Return the position of a point in link axes [m], complex."""
        return np.ravel(self.motion.mechanism.links[at].points[name])[0]

    def arm(self, at: int, place: Any) -> Complexes:
        """Convert an arm from link axes to ground axes at the points [m], complex."""
        return self.motion.direction[at][1:] * place


def _beyond(angle: Reals) -> Complexes:
    """Return exp(i angle) - 1 - i angle, computed without cancellation."""
    half = np.sin(angle / 2)
    return -2 * half**2 + 1j * (np.sin(angle) - angle)


def require_known(motion: Motion) -> None:
    """Raise MechanismError if a joint is not supported with large displacement.

    Racks are supported if the wheels have fixed axes.

    Raises
    ------
    MechanismError
        If a wheel runs along a rack, or a slider moves on an elastic link while joints are redundant.
    """
    mechanism = motion.mechanism
    for gear in mechanism.gears:
        wheels = gear.follower, gear.driver
        for wheel in () if all(each.turns for each in wheels) else wheels:
            link = mechanism.links[max(mechanism.ends(wheel))]
            if min(mechanism.ends(wheel)):
                raise MechanismError(f'the wheel at "{wheel.joint}" runs along a rack, and its teeth with its carrier')
            if wheel.turns and not link.beams and np.any(link.points[wheel.joint]):
                raise MechanismError(f'the wheel "{link.name}" of a rack turns about another point than its first')
    surplus = any(closed.redundancy for closed in motion.closures)
    for joint in motion.structure.joints:
        if surplus and not joint.turns and mechanism.links[joint.owner].beams:
            raise MechanismError(f'the block of "{joint.name}" is on a link that bends, and other joints are redundant')


def point_loads(turned: Turned, accelerations: Complexes) -> list[Load]:
    """Compute the additional forces on displaced points: inertia, springs, and loads that rotate with their links.

    Parameters
    ----------
    accelerations
        Accelerations of lumps and of their rotations, alternating, according to linear theory, complex, shape (points,
        2 lumps).
    """
    return [*_lumps(turned, accelerations), *_springs(turned), *_turning_loads(turned)]


def _lumps(turned: Turned, accelerations: Complexes) -> Iterator[Load]:
    motion = turned.motion
    for number, (at, lump) in enumerate(lumps_of(motion.mechanism)):
        point, offset = turned.point(at, lump.point), np.ravel(lump.offset)[0]
        place, angle = (point + offset, turned.angle(at)) if turned.bare(at) else (offset, turned.turns(at, lump.point))
        more = _beyond(angle) * motion.direction[at] * place
        acceleration = accelerations[:, 2 * number] + turned.grid.rates(more)[1]
        force = -np.ravel(lump.mass)[0] * acceleration
        rigid, arm = lump_force(motion, at, lump)[1:], turned.arm(at, offset)
        moment = -np.ravel(lump.inertia)[0] * accelerations[:, 2 * number + 1].real
        levered = np.exp(1j * angle[1:]) * arm
        yield at, lump.point, force, moment + cross(levered, rigid + force) - cross(arm, rigid)


def _springs(turned: Turned) -> Iterator[Load]:
    motion = turned.motion
    index = motion.mechanism.index
    for load in motion.mechanism.loads:
        if isinstance(load, Spring):
            ends = (index[load.link], load.point), (index[load.on], load.anchor)
            apart = turned.displacement(*ends[0]) - turned.displacement(*ends[1])
            way = (position_of(motion, *ends[0]) - position_of(motion, *ends[1]))[1:]
            opening = (velocity_of(motion, *ends[0]) - velocity_of(motion, *ends[1]))[1:]
            pull = _pull(load, way + apart[1:], opening + turned.grid.rates(apart)[0]) - _pull(load, way, opening)
            yield (*ends[0], -pull, 0.0)
            yield (*ends[1], pull, 0.0)
        if isinstance(load, TorsionSpring):
            both = (index[load.link], load.at), (index[load.on], load.at)
            angle = turned.turns(*both[0]) - turned.turns(*both[1])
            moment = load.stiffness * angle[1:] + load.damping * turned.grid.rates(angle)[0]
            yield (*both[0], 0.0, -moment)
            yield (*both[1], 0.0, moment)


def _pull(spring: Spring, vector: Complexes, opening: Complexes) -> Complexes:
    """Return the force of a spring between two points at a given distance [N], complex."""
    reach = np.abs(vector)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.where(reach > 0, vector / reach, 0.0)
    tension = spring.preload + spring.stiffness * (reach - spring.length) + spring.damping * dot(unit, opening)
    return tension * unit


def _turning_loads(turned: Turned) -> Iterator[Load]:
    motion = turned.motion
    for load in motion.mechanism.loads:
        if isinstance(load, PointLoad) and load.turning:
            at = motion.mechanism.index[load.link]
            for _, _, force, _ in load.forces(motion):
                turn = np.exp(1j * turned.turns(at, load.point)[1:]) - 1
                yield at, load.point, turn * np.broadcast_to(force, motion.columns)[1:], 0.0


def bare_links(
    turned: Turned, added: list[Load], forces: Complexes, besides: Iterable[tuple[int, str, Complexes]]
) -> tuple[list[Load], list[Complexes]]:
    """Compute moments of forces on rotated arms of links without beams, and joint gaps due to the rotation.

    Parameters
    ----------
    added
        See `point_loads`.
    forces
        Joint forces in ground axes [N], complex, shape (nodes, joints).
    besides
        Further forces on points, except the given loads of the mechanism: link index, point name, force.

    Returns
    -------
    Loads on points, and for each joint the displacement of the child's point from the parent's point [m], complex, at
    the points of the grid.
    """
    motion = turned.motion
    mechanism = motion.mechanism
    loads, gaps = list(added), [np.zeros(len(forces) - 1, complex) for _ in motion.places]
    moments = {at: np.zeros(len(forces) - 1) for at in range(len(mechanism.links)) if turned.bare(at)}

    def turn(at: int, arm: Complexes, force: Columns) -> None:
        if at in moments:
            moments[at] += cross((np.exp(1j * turned.angle(at)[1:]) - 1) * arm, force)

    for number, place in enumerate(motion.places):
        joint = place.joint
        force = forces[1:, number]
        sliding = not joint.turns and turned.bare(joint.owner)
        if sliding:
            force = force * np.exp(1j * turned.angle(joint.owner)[1:])
            on_owner, gap = _slider(turned, number, forces[1:, number])
            loads += on_owner
            gaps[number] = gap
        for at, sign in ((joint.child, 1.0), (joint.parent, -1.0)):
            if sliding and at == joint.owner:
                continue
            name = joint.point(at)
            if turned.bare(at) and name:
                turn(at, turned.arm(at, turned.point(at, name)), sign * force)
                if not sliding:
                    gaps[number] = gaps[number] - sign * turned.beyond(at, turned.point(at, name))[1:]
    for at, lump in lumps_of(mechanism):
        turn(at, turned.arm(at, turned.point(at, lump.point)), lump_force(motion, at, lump)[1:])
    for load in mechanism.loads:
        for link, point, force, _ in () if isinstance(load, LineLoad) else load.forces(motion):
            at = mechanism.index[link]
            turn(at, turned.arm(at, turned.point(at, point)), np.broadcast_to(force, motion.columns)[1:])
    for at, point, force in (*((at, point, force) for at, point, force, _ in added), *besides):
        turn(at, turned.arm(at, turned.point(at, point)), force)
    loads += [(at, _first(turned, at), 0.0, moment) for at, moment in moments.items()]
    return [load for load in loads if load[0]], gaps


def _first(turned: Turned, at: int) -> str:
    return next(iter(turned.motion.mechanism.links[at].points))


def _slider(turned: Turned, number: int, force: Complexes) -> tuple[list[Load], Complexes]:
    """Return the loads and the gap of a block on a link without beams, on which the force rotates with the line."""
    motion, place = turned.motion, turned.motion.places[number]
    joint, owner, block = place.joint, place.joint.owner, place.joint.block
    point, first = joint.point(block) or "", _first(turned, owner)
    start = turned.point(owner, first)
    angle = turned.angle(owner)[1:]
    shift = (turned.displacement(owner, first) - _turn(turned.angle(owner)) * motion.direction[owner] * start)[1:]
    arm = np.broadcast_to(place.arm(owner), motion.columns)[1:]
    moved = turned.displacement(block, point)[1:]
    reach = arm + moved - shift
    linear_block = turned.moved.moves[1:, turned.chosen.index((block, point)), 0]
    missing = (np.exp(-1j * angle) * reach - arm) - (linear_block - shift - 1j * angle * arm)
    on_block = joint.sense * force
    more = on_block * _turn(angle)
    moment = -(cross(reach, on_block + more) - cross(arm, on_block)) + cross(turned.arm(owner, start), more)
    return [(block, point, more, 0.0), (owner, first, -more, moment)], -joint.sense * missing


def _turn(angle: Reals) -> Complexes:
    return np.exp(1j * angle) - 1
