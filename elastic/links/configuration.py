"""Positions and loads of the links, which are the input to their statics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastic.arrays import Coefficients, PerBeam, VectorCoefficients, VectorPerBeam
from elastic.beams.blocks import Block
from elastic.beams.compliance import BeamCompliance
from elastic.beams.section import JointCompliance
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import BeamTrees, trees_of
from rigid import Motion
from rigid.arrays import Columns, Numbers
from rigid.constants import beam_constants
from rigid.kinetostatics import beam_directions

NodeLoads = dict[tuple[int, str], tuple[Columns, Columns]]
"""Force in ground axes [N], complex, and moment [N m], by link index and node name."""

NodeDisplacements = dict[tuple[int, str], tuple[Columns, Columns]]
"""Displacement in ground axes [m], complex, and rotation [rad], by link index and node name."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """Positions of the links and beams.

    Attributes
    ----------
    trees
        Trees of the beams.
    rows
        Link index of each beam, used to index arrays over the links.
    link, beam
        Directions of the links and beams in ground axes, complex, shape (links or beams, ..., positions).
    unit
        Directions of the beams in link axes, complex, shape (beams, ..., 1).
    length
        Lengths of the beams [m], shape (beams, ..., 1).
    columns
        Shape of the designs and positions, (..., positions).
    """

    trees: BeamTrees
    rows: slice | list[int]
    link: Numbers
    beam: VectorPerBeam
    unit: VectorPerBeam
    length: PerBeam
    columns: tuple[int, ...]

    @cached_property
    def back(self) -> VectorPerBeam:
        """Factors that rotate vectors from ground axes to beam axes."""
        return np.conj(self.beam)

    @property
    def in_link_axes(self) -> Configuration:
        """Configuration in link axes, which is the same at all positions."""
        columns = (*self.columns[:-1], 1)
        return replace(self, link=np.ones((len(self.link), *columns)), beam=self.unit, columns=columns)

    def arm(self, at: int, start: str, end: str) -> Numbers:
        """Return the vector between two nodes of a link in ground axes [m], complex."""
        return self.link[at] * (self.trees.points[at, end] - self.trees.points[at, start])


def configuration_of(motion: Motion) -> Configuration:
    """Return the configuration of a motion."""
    table = beam_constants(motion.mechanism, len(motion.columns))
    return Configuration(
        trees_of(motion.mechanism),
        table.link,
        motion.direction,
        beam_directions(motion),
        table.unit,
        table.length,
        motion.columns,
    )


@dataclass(frozen=True, eq=False)
class LinkLoads:
    """All loads on the links.

    Attributes
    ----------
    nodes
        Loads at the nodes.
    q
        Distributed load q_x + i q_y in powers of xi [N/m], shape (n, beams, ..., positions).
    blocks
        Loads of sliding blocks on beams.
    strain
        Free strains, see `AddedLoads`.
    couple
        Distributed moments in powers of xi [N], shape (n, beams, ..., positions), or None.
    """

    nodes: NodeLoads
    q: VectorCoefficients
    blocks: tuple[Block, ...] = ()
    strain: VectorCoefficients | None = None
    couple: Coefficients | None = None


@dataclass(frozen=True, eq=False)
class ElasticProblem:
    """Elastic problem: bend the links under load and close the joints.

    Attributes
    ----------
    compliance
        Flexibilities of the beams.
    joints
        Joints with compliance or clearance, by name.
    loads
        All loads except joint forces.
    added
        Additional loads. Their loads on nodes and beams are already included in `loads`.
    """

    motion: Motion
    configuration: Configuration
    compliance: BeamCompliance
    joints: Mapping[str, JointCompliance]
    loads: LinkLoads
    added: AddedLoads | None = None

    @property
    def unloaded(self) -> ElasticProblem:
        """Same problem without loads, free strains and clearances, so that only joint forces act."""
        fitting = {name: JointCompliance(own.translation, own.rotation) for name, own in self.joints.items()}
        nothing = np.zeros((1, len(self.configuration.length), *self.configuration.columns), complex)
        loads = LinkLoads({}, nothing)
        return replace(self, compliance=self.compliance.unstrained, joints=fitting, loads=loads, added=None)
