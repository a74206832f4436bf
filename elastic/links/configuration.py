"""Positions of the links and loads on the links, from which their section forces are computed."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

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


class Configuration(Struct, frozen=True, eq=False, dict=True):
    """Directions and dimensions of the links and beams.

    Attributes
    ----------
    trees
        Trees of the beams.
    rows
        Link index of each beam, with which arrays over the links are indexed.
    link, beam
        Unit vectors of the links and of the beams in ground axes, complex, shape (links or beams, ..., positions).
    unit
        Unit vectors of the beams in link axes, complex, shape (beams, ..., 1).
    length
        Lengths of the beams [m], shape (beams, ..., 1).
    columns
        Shape (..., positions) over designs and positions.
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
        """Factors by which vectors are multiplied to rotate them from ground axes to beam axes."""
        return np.conj(self.beam)

    @property
    def in_link_axes(self) -> Configuration:
        """Configuration with link axes in place of ground axes. It is the same at all positions."""
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


class LinkLoads(Struct, frozen=True, eq=False):
    """Loads on the links.

    Attributes
    ----------
    nodes
        Concentrated loads at the nodes.
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


class ElasticProblem(Struct, frozen=True, eq=False):
    """Input of the elastic problem: links bend under loads, and the joints must close.

    Attributes
    ----------
    compliance
        Flexibilities of the beams.
    joints
        Joints with compliance or clearance, by name.
    loads
        All loads except joint forces.
    added
        Additional loads, or None. `loads` already includes those on nodes and beams.
    """

    motion: Motion
    configuration: Configuration
    compliance: BeamCompliance
    joints: Mapping[str, JointCompliance]
    loads: LinkLoads
    added: AddedLoads | None = None

    @property
    def unloaded(self) -> ElasticProblem:
        """The same problem without loads, free strains and clearances, in which only joint forces act."""
        fitting = {name: JointCompliance(own.translation, own.rotation) for name, own in self.joints.items()}
        nothing = np.zeros((1, len(self.configuration.length), *self.configuration.columns), complex)
        loads = LinkLoads({}, nothing)
        return replace(self, compliance=self.compliance.unstrained, joints=fitting, loads=loads, added=None)
