"""Blocks of sliders on beams: where they are, and what the joint forces at them load the beams with."""

from __future__ import annotations

from typing import Any

import numpy as np

from elastic.beams.blocks import Block
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import BeamTrees
from elastic.links.configuration import Configuration
from rigid import JointForces, Motion
from rigid.constants import beam_constants
from rigid.loads import beam_directions
from rigid.plane import dot

ON_BEAM = 1e-12  # of its length that a block may be beyond a beam's end and yet on it: round-off


def block_places(motion: Motion, trees: BeamTrees) -> list[Any]:
    """Where the block of every slider on a beam is, in xi, shape (..., positions); nan where it is beyond its beam."""
    table = beam_constants(motion.mechanism, len(motion.columns))
    directions = beam_directions(motion)
    found = []
    for number, beam in trees.rails.items():
        place = motion.places[number]
        at = place.joint.owner
        xi = dot(directions[beam], place.arm(at) - motion.direction[at] * table.start[beam]) / table.length[beam]
        found.append(np.where((xi >= -ON_BEAM) & (xi <= 1 + ON_BEAM), np.clip(xi, 0.0, 1.0), np.nan))
    return found


def block_loads(
    motion: Motion, configuration: Configuration, forces: JointForces, added: AddedLoads | None = None
) -> tuple[Block, ...]:
    """Loads of the sliders on the beams they move along, in the order of `BeamTrees.rails`."""
    rails = configuration.trees.rails
    found = []
    for (number, beam), xi in zip(
        rails.items(), block_places(motion, configuration.trees) if rails else (), strict=True
    ):
        sense = motion.structure.joints[number].sense
        pull = configuration.back[beam] * forces.force[number]
        load, moment = -sense * pull, -sense * forces.moment[number]
        for joint, force, more in added.blocks if added is not None else ():
            if joint == number:
                load, moment = load + configuration.back[beam] * force, moment + more
        found.append(Block(beam, xi, load, moment))
    return tuple(found)
