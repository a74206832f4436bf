"""Displacements of the whole mechanism per unit of its elastic coordinates, at the positions of a motion.

Clamped links are moved as rigid bodies so that the joints close with locked drives, as in the linear quasi-static
problem. Displacements are relative to the rigid positions and in ground axes. Their second time derivatives are
therefore accelerations, without Coriolis terms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.elastodynamics.elastic_structure import ElasticStructure, way_of
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


UNDER = "under joint "


def under(number: int) -> str:
    """Return the name of the point on a beam under the block of a joint."""
    return f"{UNDER}{number}"


@dataclass(frozen=True, eq=False)
class Displacements:
    """Displacements of c kinds (last axis) at every position.

    Attributes
    ----------
    beams
        Displacements of the Gauss points in ground axes [m], complex, shape (positions, beams, points, c).
    slope, phi
        dw/dx and rotation of the section at these points [rad], same shape.
    angle
        Rotation of the axes of the links [rad], shape (positions, links, c).
    moves, turns
        Displacement in ground axes [m], complex, and rotation [rad] of chosen points, shape (positions, chosen, c).
    """

    beams: Complexes
    slope: Reals
    phi: Reals
    angle: Reals
    moves: Complexes
    turns: Reals

    def __matmul__(self, amounts: Any) -> Displacements:
        """Combine the kinds linearly, with `amounts` of shape (c, k) or (positions, c, k)."""
        wide = np.asarray(amounts)
        if wide.ndim == 2:
            return Displacements(*(part @ wide for part in vars(self).values()))
        return Displacements(
            *(part @ wide.reshape(len(wide), *(1,) * (part.ndim - 3), *wide.shape[1:]) for part in vars(self).values())
        )

    def __add__(self, other: Displacements) -> Displacements:
        return Displacements(*(one + part for one, part in zip(vars(self).values(), vars(other).values(), strict=True)))

    def __sub__(self, other: Displacements) -> Displacements:
        return Displacements(*(one - part for one, part in zip(vars(self).values(), vars(other).values(), strict=True)))

    def __getitem__(self, positions: Any) -> Displacements:
        """Select positions."""
        return Displacements(*(part[positions] for part in vars(self).values()))


@dataclass(frozen=True, eq=False)
class RigidBodyModes:
    """Rigid-body motion of the links that closes the joints, per unit of the elastic coordinates.

    Attributes
    ----------
    shift, angle
        Displacement [m], complex, and rotation [rad] of the axes of the links, shape (links, n, positions).
    work
        Work of the self-stresses on the gaps due to unit coordinates, shape (positions, self-stresses, n). For a
        mechanism with redundant joints, the work of the actual coordinates must be zero.
    """

    shift: Complexes
    angle: Reals
    work: Reals


def rigid_body_modes(structure: ElasticStructure, motion: Motion) -> RigidBodyModes:
    """Compute the rigid-body motions that close the joints for unit elastic coordinates.

    Gear teeth act along the common tangent of the pitch circles, midway between the lines of action of both flanks.
    Displacements are therefore smooth in time even if the loaded flank changes.
    """
    flank = {at: 0.0 for at, place in enumerate(motion.places) if place.teeth is not None}
    felt = at_joints(structure)
    shape = (int(np.count_nonzero(felt)), motion.columns[-1])
    bent = {
        (at, name): (motion.direction[at] * move[felt, None], np.broadcast_to(turn[felt, None], shape))
        for (at, name), (move, turn) in structure.nodes.items()
    }
    gaps, turns = _openings(structure, motion, bent, flank, shape)
    still = [ZERO] * len(motion.mechanism.links)
    shifts, turning, _ = displacements(motion.closures, gaps, turns, still, flank)
    work = [
        sum(
            number(dot(force, gap)) + number(moment * turn)
            for force, moment, gap, turn in zip(state.force, state.moment, gaps, turns, strict=True)
        )
        for state in self_stresses(motion.closures, flank)
    ]
    open_by = np.array([np.broadcast_to(np.real(part), shape) for part in work]).reshape(-1, *shape)
    moved = stacked(shifts, shape, complex), stacked([value.imag for value in turning], shape, float), open_by
    shift, angle, gap = (np.zeros((len(part), len(felt), shape[1]), part.dtype) for part in moved)
    shift[:, felt], angle[:, felt], gap[:, felt] = moved
    return RigidBodyModes(shift, angle, np.moveaxis(gap, -1, 0))


def at_joints(structure: ElasticStructure) -> Flags:
    """Return for each coordinate whether it can open a joint, shape (n,).

    Such a coordinate displaces a point or a block, or opens a compliant joint.
    """
    felt = np.full(len(structure.stiffness), bool(trees_of(structure.mechanism).rails))
    for move, turn in structure.nodes.values():
        felt |= (move != 0) | (turn != 0)
    felt[len(felt) - len(structure.soft) :] = True
    return felt


def _openings(
    structure: ElasticStructure, motion: Motion, bent: Any, flank: Mapping[int, float], shape: tuple[int, int]
) -> tuple[list[Columns], list[Columns]]:
    """Return the gaps to close per unit coordinate, of `shape`. For gaps due to loads, see `bent_links`."""
    blocks = block_places(motion, trees_of(motion.mechanism))
    still = (ZERO, ZERO)
    gaps, turns = [], []
    for place_number, (joint, place) in enumerate(zip(motion.structure.joints, motion.places, strict=True)):
        child = bent.get((joint.child, joint.child_point or ""), still)
        parent = bent.get((joint.parent, joint.parent_point or ""), still)
        if place_number in blocks:
            on_beam = _under_block(structure, motion, blocks[place_number], bent)
            child, parent = (child, on_beam) if joint.owner == joint.parent else (on_beam, parent)
        gap, turn = parent[0] - child[0], parent[1] - child[1]
        if joint.gear is not None:
            along, turned = follower_displacement(place, bent, flank.get(place_number))
            gap, turn = gap + along, turn + turned
        gaps.append(gap)
        turns.append(turn)
    for row, freedom in enumerate(structure.soft, shape[0] - len(structure.soft)):
        opened = np.zeros(shape, complex)
        opened[row] = 1.0 if freedom.kind == "turn" else way_of(freedom, motion)
        if freedom.kind == "turn":
            turns[freedom.joint] = turns[freedom.joint] + opened.real
        else:
            gaps[freedom.joint] = gaps[freedom.joint] + opened
    return gaps, turns


def _under_block(
    structure: ElasticStructure, motion: Motion, places: Sequence[OnBeam], bent: Any
) -> tuple[Complexes, Reals]:
    """Return the displacement and rotation of a beam under a block, with its link clamped, shape (n, positions).

    `places` are the positions of the block on the beams along its line.
    """
    moved: Any = 0j
    turned: Any = 0.0
    for at, place in enumerate(places):
        there = interpolation(structure.xi, place.xi)
        u, w, phi = (structure.fields[name][place.beam].T @ there.T for name in ("u", "w", "phi"))
        move, here = beam_directions(motion)[place.beam] * (u + 1j * w), place.here | (not at)
        moved, turned = np.where(here, move, moved), np.where(here, phi, turned)
    return moved, turned


def own_basis(structure: ElasticStructure, carried: RigidBodyModes, basis: Reals) -> Reals:
    """Correct a basis at every position so that redundant joints fit together, with minimum strain energy.

    Returns
    -------
    Array of shape (n, r), or (positions, n, r) for a mechanism with redundant joints.
    """
    work = carried.work
    if not work.shape[1]:
        return basis
    soft = np.linalg.solve(structure.stiffness, work.swapaxes(-1, -2))
    return basis - soft @ np.linalg.solve(work @ soft, work @ basis)


def unit_displacements(
    structure: ElasticStructure, motion: Motion, carried: RigidBodyModes, basis: Any, chosen: Points
) -> Displacements:
    """Compute the displacements per unit of each vector of a basis, shape (n, r) or (positions, n, r)."""
    shift, angle = (np.moveaxis(part, -1, 0) @ basis for part in (carried.shift, carried.angle))
    per = basis[:, None] if np.ndim(basis) == 3 else basis
    local_fields = {name: structure.fields[name] @ per for name in ("u", "w", "phi", "slope")}
    links = [at for at, _ in motion.mechanism.beams]
    starts = _starts(structure)
    directions = beam_directions(motion).T
    arms = (motion.direction[links].T * starts)[:, :, None] + directions[:, :, None] * (
        structure.length[:, None] * structure.xi
    )
    turned = angle[:, links, None]
    beams = 1j * turned * arms[..., None]
    beams += shift[:, links, None]
    beams += directions[:, :, None, None] * (local_fields["u"] + 1j * local_fields["w"])
    moves, turns = [], []
    for at, name in chosen:
        if name.startswith(UNDER):
            found = below(structure, motion, name, beams, turned + local_fields["slope"])
            moves.append(found[0])
            turns.append(found[1])
            continue
        arm = motion.direction[at] * np.ravel(motion.mechanism.links[at].points[name])[0]
        move, turn = shift[:, at] + 1j * angle[:, at] * arm[:, None], angle[:, at]
        if (at, name) in structure.nodes:
            bent, more = (part @ basis for part in structure.nodes[at, name])
            move, turn = move + motion.direction[at][:, None] * bent, turn + more
        moves.append(move)
        turns.append(turn)
    shape = (len(chosen), len(angle), angle.shape[-1])
    return Displacements(
        beams,
        turned + local_fields["slope"],
        turned + local_fields["phi"],
        angle,
        np.moveaxis(np.array(moves, complex).reshape(shape), 0, 1),
        np.moveaxis(np.array(turns, float).reshape(shape), 0, 1),
    )


def below(
    structure: ElasticStructure, motion: Motion, name: str, beams: Complexes, slope: Reals
) -> tuple[Complexes, Reals]:
    """Return the displacement in ground axes and the slope of a beam under a block, shape (positions, c)."""
    number = int(name.removeprefix(UNDER))
    moved, turned = np.zeros(1, complex), np.zeros(1)
    for at, place in enumerate(block_places(motion, trees_of(motion.mechanism))[number]):
        there = interpolation(structure.xi, place.xi)[:, None]
        move, turn = (there @ beams[:, place.beam])[:, 0], (there @ slope[:, place.beam])[:, 0]
        here = np.broadcast_to(place.here | (not at), motion.columns)[:, None]
        moved, turned = np.where(here, move, moved), np.where(here, turn, turned)
    return moved, turned


def _starts(structure: ElasticStructure) -> Complexes:
    """Return the starts of the beams in link axes [m], complex, shape (beams,)."""
    links = structure.mechanism.links
    return np.array([np.ravel(links[at].points[beam.start])[0] for at, beam in structure.mechanism.beams], complex)
