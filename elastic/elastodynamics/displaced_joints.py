"""Joints, sliding blocks and gears with large displacement: forces and gaps that linear theory does not include."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.elastodynamics.displaced_points import Load, Turned, bare_links
from elastic.elastodynamics.elastic_structure import ElasticStructure
from elastic.elastodynamics.time_grid import interpolation, slopes
from elastic.links.beam_trees import BeamTrees, trees_of
from elastic.links.sliding_blocks import block_places
from rigid import Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.joints import JointPlace
from rigid.kinetostatics import beam_directions
from rigid.plane import cross, dot

SHIFTS = 4  # iterations for the position of a block; each multiplies the error by about the axial strain


@dataclass(frozen=True, eq=False)
class DisplacedJoints:
    """Loads and gaps at the points of a grid, with the fields of `AddedLoads`; `points` includes the given loads."""

    points: Sequence[Load]
    blocks: tuple[tuple[int, Columns, Columns], ...]
    gaps: Sequence[Columns]
    turns: Sequence[Columns]
    slides: tuple[tuple[int, Columns, Columns], ...]


def displaced_joints(
    turned: Turned, structure: ElasticStructure, added: list[Load], forces: Complexes, moments: Reals
) -> DisplacedJoints:
    """Collect the loads and gaps of pins and sliders on links without beams, blocks on elastic links, and gears.

    Parameters
    ----------
    turned
        Displacements at the nodes.
    added
        Loads on displaced points, see `point_loads`.
    forces, moments
        Joint forces and moments in ground axes [N, N m], shape (nodes, joints).
    """
    joints = turned.motion.structure.joints
    blocks = displaced_blocks(turned, structure, forces, moments)
    forces = forces.copy()
    for block in blocks:
        forces[1:, block.joint] = joints[block.joint].sense * block.force
    gears = [
        (gear, end, sign)
        for gear in displaced_gears(turned, moments)
        for end, sign in zip(gear.ends, (1, -1), strict=True)
        if end[0]
    ]
    points, gaps = bare_links(turned, added, forces, [(*end, sign * gear.force) for gear, end, sign in gears])
    points += [(*end, sign * gear.more, 0.0) for gear, end, sign in gears]
    turns: list[Any] = [0.0] * len(joints)
    for gear, *_ in gears:
        turns[gear.joint] = gear.turn
    for block in blocks:
        joint = joints[block.joint]
        points.append((joint.block, joint.point(joint.block) or "", block.more, 0.0))
        gaps[block.joint] = gaps[block.joint] + block.gap
    return DisplacedJoints(
        points,
        tuple((block.joint, -block.more, 0.0) for block in blocks),
        gaps,
        turns,
        tuple((block.joint, block.slide, block.lever) for block in blocks),
    )


@dataclass(frozen=True, eq=False)
class DisplacedBlock:
    """Block of a slider on an elastic link with large displacement, at the points of a grid.

    Attributes
    ----------
    joint
        Index of the slider.
    slide
        Shift of the block along the line of the rigid link, onto the bent axis [m].
    force
        Force of the beam on the block in ground axes [N], complex.
    more
        Difference between `force` and the linear solution.
    lever
        Moment of the force at the block on the link of the beam, minus its moment at the position in the rigid motion
        [N m].
    gap
        Additional gap of the joint from child to parent due to the shift of the block and the rotation of the link [m],
        complex.
    """

    joint: int
    slide: Reals
    force: Complexes
    more: Complexes
    lever: Reals
    gap: Complexes


def displaced_blocks(
    turned: Turned, structure: ElasticStructure, forces: Complexes, moments: Reals
) -> list[DisplacedBlock]:
    """Compute the blocks of all sliders on elastic links.

    Parameters
    ----------
    turned
        Displacements at the nodes.
    forces, moments
        Joint forces and moments in ground axes [N, N m], shape (nodes, joints).
    """
    trees = trees_of(structure.mechanism)
    return [_displaced_block(turned, structure, trees, number, forces, moments) for number in trees.rails]


def _displaced_block(
    turned: Turned, structure: ElasticStructure, trees: BeamTrees, number: int, forces: Complexes, moments: Reals
) -> DisplacedBlock:
    motion, place = turned.motion, turned.motion.places[number]
    joint = place.joint
    along = np.broadcast_to(place.along, motion.columns)
    moved = turned.displacement(joint.block, joint.point(joint.block) or "")
    slide = np.zeros(motion.columns)
    for _ in range(0 if joint.drive is not None else SHIFTS):
        slide = dot(along, moved - _under(turned.moved.beams, structure, motion, trees, number, slide)[0])
    angle, curvature = _under(turned.moved.phi, structure, motion, trees, number, slide)
    linear = joint.sense * forces[:, number]
    pushed = 0.0 if joint.drive is not None else -joint.sense * moments[:, number] * curvature
    force = np.exp(1j * angle) * (linear + pushed * along)
    missed = joint.sense * 1j * turned.angle(joint.owner) * slide * along
    return DisplacedBlock(
        number, slide[1:], force[1:], (force - linear)[1:], -cross(slide * along, force)[1:], missed[1:]
    )


def _under(
    values: Any, structure: ElasticStructure, motion: Motion, trees: BeamTrees, number: int, slide: Columns
) -> tuple[Any, Any]:
    """Interpolate values along the beams, (nodes, beams, points, 1), and their slopes at a shifted block."""
    places = block_places(motion, trees, {number: slide})[number]
    there: Any = np.zeros(len(values))
    slope: Any = np.zeros(len(values))
    for at, place in enumerate(places):
        along, here = values[:, place.beam, :, 0], place.here | (not at)
        value = (interpolation(structure.xi, place.xi) * along).sum(axis=-1)
        rate = (slopes(structure.xi, place.xi) * along).sum(axis=-1) / structure.length[place.beam]
        rate = rate * dot(beam_directions(motion)[place.beam], motion.places[number].along)
        there, slope = np.where(here, value, there), np.where(here, rate, slope)
    return there, slope


@dataclass(frozen=True, eq=False)
class DisplacedGear:
    """Teeth of two wheels with large displacement, at the points of a grid.

    Attributes
    ----------
    joint
        Index of the joint of the follower.
    turn
        Difference between the rotation of the follower (child relative to parent) and the linear solution [rad].
    ends
        Link and point of the wheel centres of follower and driver.
    force
        Tooth force on the follower in ground axes [N], complex. The opposite force acts on the driver.
    more
        Difference between `force` and the linear solution.
    """

    joint: int
    turn: Reals
    ends: tuple[tuple[int, str], tuple[int, str]]
    force: Complexes
    more: Complexes


def displaced_gears(turned: Turned, moments: Reals) -> Iterator[DisplacedGear]:
    """Yield the toothed gears between two wheels.

    Parameters
    ----------
    turned
        Displacements at the nodes.
    moments
        Joint moments [N m], shape (nodes, joints).
    """
    for number, place in enumerate(turned.motion.places):
        if place.teeth is not None and place.joint.gear is not None and place.turns and place.joint.gear.driver.turns:
            yield _displaced_gear(turned, number, place, moments[:, number])


def _displaced_gear(turned: Turned, number: int, place: JointPlace, moment: Reals) -> DisplacedGear:
    joint, teeth = place.joint, place.teeth
    assert joint.gear is not None
    assert teeth is not None
    wheel, body = (teeth.wheel, joint.point(teeth.wheel) or ""), (teeth.body, joint.gear.driver.point(teeth.body) or "")
    between = np.broadcast_to(teeth.reach_body - teeth.reach, turned.motion.columns)
    apart, linear = (moved(*wheel) - moved(*body) for moved in (turned.displacement, turned.linear_displacement))
    push = teeth.push(np.sign(moment))
    share = push * np.conj(between)
    after = 1 + apart / between
    opened = dot(share, np.log(after)) - dot(push, linear)
    effort = teeth.sense * moment
    force = effort * push / np.conj(after)
    return DisplacedGear(number, -teeth.sense * opened[1:], (wheel, body), force[1:], (force - effort * push)[1:])
