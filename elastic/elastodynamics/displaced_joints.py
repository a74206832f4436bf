"""Forces and gaps that linear theory neglects at joints, sliding blocks and gears with large displacement."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.elastodynamics.displaced_points import DisplacedPoints, PointForce, rigid_link_loads
from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.time_grid import interpolation, slopes
from elastic.links.beam_trees import BeamTrees, trees_of
from elastic.links.sliding_blocks import block_places
from rigid import Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.joints import JointPlace
from rigid.kinetostatics import beam_directions
from rigid.plane import cross, dot

# number of iterations for the shift of a block; each reduces the error by a factor of about the axial strain
SHIFT_ITERATIONS = 4


class DisplacedJoints(Struct, frozen=True, eq=False):
    """Additional loads and gaps of joints with large displacement, at the points of a grid.

    The fields have the same meaning as in `AddedLoads`. `points` also contains the loads `added`, see
    `displaced_joints`.
    """

    points: Sequence[PointForce]
    blocks: tuple[tuple[int, Columns, Columns], ...]
    gaps: Sequence[Columns]
    turns: Sequence[Columns]
    slides: tuple[tuple[int, Columns, Columns], ...]


def displaced_joints(
    displaced: DisplacedPoints, structure: ElasticStructure, added: list[PointForce], forces: Complexes, moments: Reals
) -> DisplacedJoints:
    """Collect the additional loads and gaps of pins and sliders on rigid links, blocks on elastic links, and gears.

    Parameters
    ----------
    displaced
        Displacements at the nodes.
    added
        Additional loads on displaced points, see `displaced_points.point_loads`.
    forces, moments
        Joint forces and moments in ground axes [N, N m], shape (nodes, joints).
    """
    joints = displaced.motion.structure.joints
    blocks = displaced_blocks(displaced, structure, forces, moments)
    forces = forces.copy()
    for block in blocks:
        forces[1:, block.joint] = joints[block.joint].sense * block.force
    gears = [
        (gear, end, sign)
        for gear in displaced_gears(displaced, moments)
        for end, sign in zip(gear.ends, (1, -1), strict=True)
        if end[0]
    ]
    points, gaps = rigid_link_loads(displaced, added, forces, [(*end, sign * gear.force) for gear, end, sign in gears])
    points += [(*end, sign * gear.force_change, 0.0) for gear, end, sign in gears]
    turns: list[Any] = [0.0] * len(joints)
    for gear, *_ in gears:
        turns[gear.joint] = gear.turn
    for block in blocks:
        joint = joints[block.joint]
        points.append((joint.block, joint.point(joint.block) or "", block.force_change, 0.0))
        gaps[block.joint] = gaps[block.joint] + block.rotation_gap
    return DisplacedJoints(
        points,
        tuple((block.joint, -block.force_change, 0.0) for block in blocks),
        gaps,
        turns,
        tuple((block.joint, block.shift, block.moment_change) for block in blocks),
    )


class DisplacedBlock(Struct, frozen=True, eq=False):
    """Block of a slider on an elastic link with large displacement, at the points of a grid.

    Attributes
    ----------
    joint
        Index of the slider.
    shift
        Position of the block along the undeformed beam, relative to its position in the rigid motion [m].
    force
        Force of the beam on the block in ground axes [N], complex.
    force_change
        `force` minus the force in linear theory [N], complex.
    moment_change
        Additional moment on the link to which the beam belongs, because the force acts at the shifted block [N m].
    rotation_gap
        Additional gap of the joint (see `AddedLoads.gaps`), because the shift rotates with the link [m], complex.
    """

    joint: int
    shift: Reals
    force: Complexes
    force_change: Complexes
    moment_change: Reals
    rotation_gap: Complexes


def displaced_blocks(
    displaced: DisplacedPoints, structure: ElasticStructure, forces: Complexes, moments: Reals
) -> list[DisplacedBlock]:
    """Compute the blocks of all sliders on elastic links.

    Parameters
    ----------
    displaced
        Displacements at the nodes.
    forces, moments
        Joint forces and moments in ground axes [N, N m], shape (nodes, joints).
    """
    trees = trees_of(structure.mechanism)
    return [_displaced_block(displaced, structure, trees, number, forces, moments) for number in trees.rails]


def _displaced_block(
    displaced: DisplacedPoints,
    structure: ElasticStructure,
    trees: BeamTrees,
    number: int,
    forces: Complexes,
    moments: Reals,
) -> DisplacedBlock:
    motion, place = displaced.motion, displaced.motion.places[number]
    joint = place.joint
    along = np.broadcast_to(place.along, motion.columns)
    moved = displaced.displacement(joint.block, joint.point(joint.block) or "")
    shift = np.zeros(motion.columns)
    for _ in range(0 if joint.drive is not None else SHIFT_ITERATIONS):
        shift = dot(
            along, moved - _values_under_block(displaced.moved.beams, structure, motion, trees, number, shift)[0]
        )
    angle, curvature = _values_under_block(displaced.moved.phi, structure, motion, trees, number, shift)
    linear = joint.sense * forces[:, number]
    follower_force = 0.0 if joint.drive is not None else -joint.sense * moments[:, number] * curvature
    force = np.exp(1j * angle) * (linear + follower_force * along)
    rotation_gap = joint.sense * 1j * displaced.angle(joint.owner) * shift * along
    return DisplacedBlock(
        number, shift[1:], force[1:], (force - linear)[1:], -cross(shift * along, force)[1:], rotation_gap[1:]
    )


def _values_under_block(
    values: Any, structure: ElasticStructure, motion: Motion, trees: BeamTrees, number: int, shift: Columns
) -> tuple[Any, Any]:
    """Return values along the beams at a shifted block, and their derivatives along the line of the slider.

    `values` has the shape (nodes, beams, Gauss points, 1).
    """
    places = block_places(motion, trees, {number: shift})[number]
    there: Any = np.zeros(len(values))
    slope: Any = np.zeros(len(values))
    for at, place in enumerate(places):
        along, here = values[:, place.beam, :, 0], place.here | (not at)
        value = (interpolation(structure.xi, place.xi) * along).sum(axis=-1)
        rate = (slopes(structure.xi, place.xi) * along).sum(axis=-1) / structure.length[place.beam]
        rate = rate * dot(beam_directions(motion)[place.beam], motion.places[number].along)
        there, slope = np.where(here, value, there), np.where(here, rate, slope)
    return there, slope


class DisplacedGear(Struct, frozen=True, eq=False):
    """Meshing teeth of two wheels with large displacement, at the points of a grid.

    Attributes
    ----------
    joint
        Index of the joint of the follower.
    turn
        Rotation of the follower (child relative to parent) that linear theory neglects [rad].
    ends
        Link index and point name of the centre of the follower, and of the centre of the driver.
    force
        Tooth force on the follower in ground axes [N], complex. The opposite force acts on the driver.
    force_change
        `force` minus the force in linear theory [N], complex.
    """

    joint: int
    turn: Reals
    ends: tuple[tuple[int, str], tuple[int, str]]
    force: Complexes
    force_change: Complexes


def displaced_gears(displaced: DisplacedPoints, moments: Reals) -> Iterator[DisplacedGear]:
    """Yield each toothed gear between two wheels (not between a wheel and a rack).

    Parameters
    ----------
    displaced
        Displacements at the nodes.
    moments
        Joint moments [N m], shape (nodes, joints).
    """
    for number, place in enumerate(displaced.motion.places):
        if place.teeth is not None and place.joint.gear is not None and place.turns and place.joint.gear.driver.turns:
            yield _displaced_gear(displaced, number, place, moments[:, number])


def _displaced_gear(displaced: DisplacedPoints, number: int, place: JointPlace, moment: Reals) -> DisplacedGear:
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    assert teeth is not None
    wheel, body = (teeth.wheel, joint.point(teeth.wheel) or ""), (teeth.body, joint.gear.driver.point(teeth.body) or "")
    between = np.broadcast_to(teeth.reach_body - teeth.reach, displaced.motion.columns)
    apart, linear = (moved(*wheel) - moved(*body) for moved in (displaced.displacement, displaced.linear_displacement))
    push = teeth.push(np.sign(moment))
    share = push * np.conj(between)
    after = 1 + apart / between
    opened = dot(share, np.log(after)) - dot(push, linear)
    effort = teeth.sense * moment
    force = effort * push / np.conj(after)
    return DisplacedGear(number, -teeth.sense * opened[1:], (wheel, body), force[1:], (force - effort * push)[1:])
