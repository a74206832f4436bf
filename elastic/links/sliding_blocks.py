"""Positions of sliding blocks on beams, and the loads that they apply to the beams."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.beams.blocks import Block
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import BeamTrees
from elastic.links.configuration import Configuration
from rigid import JointForces, Motion
from rigid.arrays import Columns, Complexes, Flags, Reals
from rigid.constants import beam_constants
from rigid.kinetostatics import beam_directions
from rigid.plane import dot

# a block is on a beam if it is beyond the end of the beam by at most this, relative to the length of the beam
END_TOLERANCE = 1e-12
UNMOVED: Mapping[int, Columns] = MappingProxyType({})


class OnBeam(Struct, frozen=True, eq=False):
    """Position of a block on one of the beams along its line.

    `beam` is the index of the beam. For `xi` and `here` see `Block`.
    """

    beam: int
    xi: Reals
    here: Flags


def block_places(
    motion: Motion, trees: BeamTrees, slides: Mapping[int, Columns] = UNMOVED
) -> dict[int, tuple[OnBeam, ...]]:
    """Return, by joint index, the positions of the block of each slider on the beams on which it moves.

    At each position, the block is on one of these beams. If it is not on any beam, `xi` of the first beam is nan.

    Parameters
    ----------
    slides
        Additional displacement of the block along its line [m], by joint index.
    """
    if not trees.rails:
        return {}
    table = beam_constants(motion.mechanism, len(motion.columns))
    directions = beam_directions(motion)
    all_places = {}
    for number, beams in trees.rails.items():
        place = motion.places[number]
        at = place.joint.owner
        arm = place.arm(at) + slides.get(number, 0.0) * place.along
        places: list[OnBeam] = []
        elsewhere: Any = False
        for beam in beams:
            reach = arm - motion.direction[at] * table.start[beam]
            xi = dot(directions[beam], reach) / table.length[beam]
            here = (xi >= -END_TOLERANCE) & (xi <= 1 + END_TOLERANCE) & np.logical_not(elsewhere)
            if np.any(here):
                places.append(OnBeam(beam, np.clip(xi, 0.0, 1.0), here))
            elsewhere = elsewhere | here
        first = places[0] if places else OnBeam(beams[0], xi, np.zeros(np.shape(xi), bool))
        first = OnBeam(first.beam, np.where(elsewhere, first.xi, np.nan), first.here)
        all_places[number] = (first, *places[1:])
    return all_places


def block_loads(
    motion: Motion, configuration: Configuration, forces: JointForces, added: AddedLoads | None = None
) -> list[tuple[Block, ...]]:
    """Return the loads of the sliding blocks on the beams, in the order of `BeamTrees.rails`."""
    trees, loads = configuration.trees, []
    slides = {} if added is None else {number: slide for number, slide, _ in added.slides}
    for number, places in block_places(motion, trees, slides).items():
        sense = motion.structure.joints[number].sense
        pull, load = -sense * forces.force[number], -sense * forces.moment[number]
        for joint, force, more in added.blocks if added is not None else ():
            if joint == number:
                pull, load = pull + force, load + more
        loads.append(tuple(_block(configuration, place, pull, load, len(places) > 1) for place in places))
    return loads


def _block(configuration: Configuration, place: OnBeam, pull: Complexes, load: Reals, several: bool) -> Block:
    """Return the load of a block on a beam. It is zero at positions at which the block is on another beam."""
    force = configuration.back[place.beam] * pull
    if not several:
        return Block(place.beam, place.xi, force, load)
    here = place.here | np.isnan(place.xi)
    return Block(place.beam, place.xi, np.where(here, force, 0.0), np.where(here, load, 0.0), place.here)
