"""Displacements of the whole mechanism per unit of each elastic coordinate, at the positions of a motion.

Each link deforms as if it were clamped at one of its points, the root. In addition, it moves as a rigid body so that
the joints close with locked drives. The linear quasi-static problem is solved in the same way. Displacements are
relative to the rigid positions and in ground axes. The second time derivative of a displacement is therefore the
acceleration relative to the rigid motion, without Coriolis terms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from elastic.elastodynamics.elastic_structure import ElasticStructure, opening_direction
from elastic.elastodynamics.time_grid import interpolation
from elastic.links.beam_trees import trees_of
from elastic.links.free_body import follower_displacement
from elastic.links.sliding_blocks import OnBeam, block_places
from rigid import Motion
from rigid.arrays import Columns, Complexes, Flags, Reals
from rigid.closures import displacements, self_stresses
from rigid.kinematics import stacked
from rigid.kinetostatics import beam_directions
from rigid.plane import ZERO, dot, number

Points = Sequence[tuple[int, str]]


UNDER_BLOCK = "under joint "


def point_under_block(number: int) -> str:
    """Return the name of the point on a beam under the block of a joint."""
    return f"{UNDER_BLOCK}{number}"


class Displacements(Struct, frozen=True, eq=False):
    """Set of c displacement fields of a mechanism at every position.

    The last axis of each array runs over the fields.

    Attributes
    ----------
    beams
        Displacements of the Gauss points in ground axes [m], complex, shape (positions, beams, points, c).
    slope
        Rotation of the beam axis at the Gauss points: dw/dx plus the rotation of the link [rad], same shape.
    shear
        Rotation of the section relative to the beam axis at the Gauss points [rad], same shape.
    angle
        Rotation of the link axes [rad], shape (positions, links, c).
    moves
        Displacement of selected points in ground axes [m], complex, shape (positions, selected points, c).
    turns
        Rotation of the link or section at the selected points [rad], same shape.
    """

    beams: Complexes
    slope: Reals
    shear: Reals
    angle: Reals
    moves: Complexes
    turns: Reals

    @property
    def phi(self) -> Reals:
        """Rotation of the section at the Gauss points, including the rotation of the link [rad], same shape."""
        return self.slope + self.shear

    def __matmul__(self, amounts: Any) -> Displacements:
        """Return k linear combinations of the fields. `amounts` has the shape (c, k) or (positions, c, k)."""
        wide = np.asarray(amounts)
        if wide.ndim == 2:
            return Displacements(*(part @ wide for part in astuple(self)))
        return Displacements(
            *(part @ wide.reshape(len(wide), *(1,) * (part.ndim - 3), *wide.shape[1:]) for part in astuple(self))
        )

    def __add__(self, other: Displacements) -> Displacements:
        return Displacements(*(one + part for one, part in zip(astuple(self), astuple(other), strict=True)))

    def __sub__(self, other: Displacements) -> Displacements:
        return Displacements(*(one - part for one, part in zip(astuple(self), astuple(other), strict=True)))

    def __getitem__(self, positions: Any) -> Displacements:
        """Select positions."""
        return Displacements(*(part[positions] for part in astuple(self)))


class RigidBodyModes(Struct, frozen=True, eq=False):
    """Rigid-body displacements of the links that close the joints, per unit of each elastic coordinate.

    Attributes
    ----------
    opens_joint
        Whether a coordinate can open a joint, shape (n,). The other coordinates cause no rigid-body displacements.
    shift
        Displacement of the origins of the link axes in ground axes [m] per unit of each of the m coordinates that can
        open a joint, complex, shape (links, m, positions).
    angle
        Rotation of the link axes [rad], same shape.
    work
        A self-stress is a set of joint forces in equilibrium without loads, which exists only in mechanisms with
        redundant joints. `work` is the work that each self-stress does on the joint gaps opened by a unit of each
        coordinate, shape (positions, self-stresses, n). Rigid-body displacements can close all joints only if the total
        work of each self-stress is zero.
    """

    opens_joint: Flags
    shift: Complexes
    angle: Reals
    work: Reals


def rigid_body_modes(structure: ElasticStructure, motion: Motion) -> RigidBodyModes:
    """Compute the rigid-body displacements that close the joints, per unit of each elastic coordinate.

    The force of gear teeth is assumed to act along the common tangent of the pitch circles. This is midway between the
    lines of action of both flanks, so that displacements are smooth in time even if the loaded flank changes.
    """
    flank = {at: 0.0 for at, place in enumerate(motion.places) if place.teeth is not None}
    opens_joint = can_open_joint(structure)
    shape = (int(np.count_nonzero(opens_joint)), motion.columns[-1])
    bent = {
        (at, name): (motion.direction[at] * move[opens_joint, None], np.broadcast_to(turn[opens_joint, None], shape))
        for (at, name), (move, turn) in structure.point_shapes.items()
    }
    gaps, turns = _openings(structure, motion, bent, flank, shape)
    zero = [ZERO] * len(motion.mechanism.links)
    shifts, turning, _ = displacements(motion.closures, gaps, turns, zero, flank)
    work = [
        sum(
            number(dot(force, gap)) + number(moment * turn)
            for force, moment, gap, turn in zip(state.force, state.moment, gaps, turns, strict=True)
        )
        for state in self_stresses(motion.closures, flank)
    ]
    all_work = np.zeros((motion.columns[-1], len(work), len(opens_joint)))
    for row, each in enumerate(work):
        all_work[:, row, opens_joint] = np.broadcast_to(np.real(each), shape).T
    shift, angle = stacked(shifts, shape, complex), stacked([value.imag for value in turning], shape, float)
    return RigidBodyModes(opens_joint, shift, angle, all_work)


def can_open_joint(structure: ElasticStructure) -> Flags:
    """Return for each coordinate whether it can open a gap of a joint, shape (n,).

    Such a coordinate displaces a point or a block, or opens a compliant joint.
    """
    opens_joint = np.full(len(structure.stiffness), bool(trees_of(structure.mechanism).rails))
    for move, turn in structure.point_shapes.values():
        opens_joint |= (move != 0) | (turn != 0)
    opens_joint[len(opens_joint) - len(structure.joint_openings) :] = True
    return opens_joint


def _openings(
    structure: ElasticStructure, motion: Motion, bent: Any, flank: Mapping[int, float], shape: tuple[int, int]
) -> tuple[list[Columns], list[Columns]]:
    """Return the gap and the relative rotation that a unit of each coordinate opens in each joint.

    `shape` is the shape of each gap and rotation: (coordinates, positions). `bent` contains the displacement and
    rotation of points of clamped links, by link index and point name.
    """
    blocks = block_places(motion, trees_of(motion.mechanism))
    zero = (ZERO, ZERO)
    gaps, turns = [], []
    for place_number, (joint, place) in enumerate(zip(motion.structure.joints, motion.places, strict=True)):
        child = bent.get((joint.child, joint.child_point or ""), zero)
        parent = bent.get((joint.parent, joint.parent_point or ""), zero)
        if place_number in blocks:
            on_beam = _under_block(structure, motion, blocks[place_number], bent)
            child, parent = (child, on_beam) if joint.owner == joint.parent else (on_beam, parent)
        gap, turn = parent[0] - child[0], parent[1] - child[1]
        if joint.gear is not None:
            along, turned = follower_displacement(place, bent, flank.get(place_number))
            gap, turn = gap + along, turn + turned
        gaps.append(gap)
        turns.append(turn)
    for row, opening in enumerate(structure.joint_openings, shape[0] - len(structure.joint_openings)):
        opened = np.zeros(shape, complex)
        opened[row] = 1.0 if opening.kind == "turn" else opening_direction(opening, motion)
        if opening.kind == "turn":
            turns[opening.joint] = turns[opening.joint] + opened.real
        else:
            gaps[opening.joint] = gaps[opening.joint] + opened
    return gaps, turns


def _under_block(
    structure: ElasticStructure, motion: Motion, places: Sequence[OnBeam], bent: Any
) -> tuple[Complexes, Reals]:
    """Return the displacement and rotation of a beam under a block per unit of each coordinate, shape (n, positions).

    The link of the beam is clamped at one of its points, the root. `places` are the positions of the block on each beam
    on which it slides.
    """
    moved: Any = 0j
    turned: Any = 0.0
    for at, place in enumerate(places):
        there = interpolation(structure.xi, place.xi)
        u, w, phi = (structure.fields[name][place.beam].T @ there.T for name in ("u", "w", "phi"))
        move, here = beam_directions(motion)[place.beam] * (u + 1j * w), place.here | (not at)
        moved, turned = np.where(here, move, moved), np.where(here, phi, turned)
    return moved, turned


def compatible_basis(structure: ElasticStructure, rigid_modes: RigidBodyModes, basis: Reals) -> Reals:
    """Correct each vector of a basis at every position so that redundant joints close.

    Of all such corrections, the one with the least strain energy is chosen.

    Returns
    -------
    Array of shape (n, r), or (positions, n, r) for a mechanism with redundant joints.
    """
    work = rigid_modes.work
    if not work.shape[1]:
        return basis
    soft = np.linalg.solve(structure.stiffness, work.swapaxes(-1, -2))
    return basis - soft @ np.linalg.solve(work @ soft, work @ basis)


def unit_displacements(
    structure: ElasticStructure, motion: Motion, rigid_modes: RigidBodyModes, basis: Any, chosen: Points
) -> Displacements:
    """Compute the displacements per unit of each vector of a basis.

    `basis` has the shape (n, r) or (positions, n, r), and `chosen` are the selected points.
    """
    opening = basis[..., rigid_modes.opens_joint, :]
    shift, angle = (np.moveaxis(part, -1, 0) @ opening for part in (rigid_modes.shift, rigid_modes.angle))
    per = basis[:, None] if np.ndim(basis) == 3 else basis
    local_fields = {name: structure.fields[name] @ per for name in ("u", "w", "phi", "slope")}
    links = [at for at, _ in motion.mechanism.beams]
    starts = _starts(structure)
    directions = beam_directions(motion).T
    arms = (motion.direction[links].T * starts)[:, :, None] + directions[:, :, None] * (
        structure.length[:, None] * structure.xi
    )
    turned = angle[:, links, None]
    slope = np.add(turned, local_fields["slope"], order="C")
    shear = local_fields["phi"] - local_fields["slope"]  # the same at all positions, except with redundant joints
    beams = 1j * turned * arms[..., None]
    beams += shift[:, links, None]
    beams += directions[:, :, None, None] * (local_fields["u"] + 1j * local_fields["w"])
    moves, turns = [], []
    for at, name in chosen:
        if name.startswith(UNDER_BLOCK):
            found = motion_under_block(structure, motion, name, beams, slope)
            moves.append(found[0])
            turns.append(found[1])
            continue
        arm = motion.direction[at] * np.ravel(motion.mechanism.links[at].points[name])[0]
        move, turn = shift[:, at] + 1j * angle[:, at] * arm[:, None], angle[:, at]
        if (at, name) in structure.point_shapes:
            bent, more = (part @ basis for part in structure.point_shapes[at, name])
            move, turn = move + motion.direction[at][:, None] * bent, turn + more
        moves.append(move)
        turns.append(turn)
    shape = (len(chosen), len(angle), angle.shape[-1])
    return Displacements(
        beams,
        slope,
        np.broadcast_to(shear, slope.shape),
        angle,
        np.moveaxis(np.array(moves, complex).reshape(shape), 0, 1),
        np.moveaxis(np.array(turns, float).reshape(shape), 0, 1),
    )


def motion_under_block(
    structure: ElasticStructure, motion: Motion, name: str, beams: Complexes, slope: Reals
) -> tuple[Complexes, Reals]:
    """Return the displacement in ground axes, and the rotation, of a beam under a block, each of shape (positions, c).

    `name` identifies the block, see `point_under_block`. For `beams` and `slope` see `Displacements`.
    """
    number = int(name.removeprefix(UNDER_BLOCK))
    moved, turned = np.zeros(1, complex), np.zeros(1)
    for at, place in enumerate(block_places(motion, trees_of(motion.mechanism))[number]):
        there = interpolation(structure.xi, place.xi)[:, None]
        move, turn = (there @ beams[:, place.beam])[:, 0], (there @ slope[:, place.beam])[:, 0]
        here = np.broadcast_to(place.here | (not at), motion.columns)[:, None]
        moved, turned = np.where(here, move, moved), np.where(here, turn, turned)
    return moved, turned


def _starts(structure: ElasticStructure) -> Complexes:
    """Return the position of the start of each beam in link axes [m], complex, shape (beams,)."""
    links = structure.mechanism.links
    return np.array([np.ravel(links[at].points[beam.start])[0] for at, beam in structure.mechanism.beams], complex)
