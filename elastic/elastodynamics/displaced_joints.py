"""Joints with large displacement of the links: forces and gaps beyond the linear solution."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from elastic.elastodynamics.displaced_blocks import displaced_blocks
from elastic.elastodynamics.displaced_gears import displaced_gears
from elastic.elastodynamics.displaced_points import Load, Turned, bare_links
from elastic.elastodynamics.elastic_structure import ElasticStructure
from rigid.arrays import Columns, Complexes, Reals


@dataclass(frozen=True, eq=False)
class DisplacedJoints:
    """Loads and gaps at the points of a grid, in the form of `AddedLoads`; `points` includes the given loads."""

    points: Sequence[Load]
    blocks: tuple[tuple[int, Columns, Columns], ...]
    gaps: Sequence[Columns]
    turns: Sequence[Columns]
    slides: tuple[tuple[int, Columns, Columns], ...]


def displaced_joints(
    turned: Turned, structure: ElasticStructure, added: list[Load], forces: Complexes, moments: Reals
) -> DisplacedJoints:
    """Collect pins and sliders on links without beams, blocks on elastic links, and gears.

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
