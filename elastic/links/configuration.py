"""Places and loads of the links: all that the statics of the links needs to know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastic.arrays import Coefficients, PerBeam, VectorCoefficients, VectorPerBeam
from elastic.beams.blocks import Block
from elastic.beams.compliance import Compliance
from elastic.beams.section import JointCompliance
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import BeamTrees, trees_of
from rigid import Motion
from rigid.arrays import Columns, Numbers
from rigid.constants import beam_constants
from rigid.kinetostatics import beam_directions

NodeLoads = dict[tuple[int, str], tuple[Columns, Columns]]
"""By link and node the force in the ground's axes [N], complex, and the moment [N m] on it."""

NodeDisplacements = dict[tuple[int, str], tuple[Columns, Columns]]
"""By link and node the displacement in the ground's axes [m], complex, and the rotation [rad] of it."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """Where the links are.

    Attributes
    ----------
    trees
        The beams of every link.
    rows
        The beams' links: rows in arrays over the links.
    link, beam
        Directions of links and beams in the ground's axes, complex, shape (links or beams, ..., positions).
    unit
        Directions of the beams in the axes of their links, complex, shape (beams, ..., 1).
    length
        Of the beams [m], shape (beams, ..., 1).
    columns
        Designs and positions: shape (..., positions).
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
        """From the ground's axes to the beams'."""
        return np.conj(self.beam)

    @property
    def in_link_axes(self) -> Configuration:
        """The links each in its own axes, which do not change with the position."""
        still = (*self.columns[:-1], 1)
        return replace(self, link=np.ones((len(self.link), *still)), beam=self.unit, columns=still)

    def arm(self, at: int, start: str, end: str) -> Numbers:
        """From one node of a link to another, in the ground's axes [m], complex."""
        arm: Numbers = self.link[at] * (self.trees.points[at, end] - self.trees.points[at, start])
        return arm


def configuration_of(motion: Motion) -> Configuration:
    """Configuration of the links of a motion."""
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
    """Loads on the links.

    Attributes
    ----------
    nodes
        At nodes.
    q
        Along beams: q_x + i q_y in powers of xi [N/m], shape (n, beams, ..., positions).
    blocks
        Of sliders' blocks on beams.
    strain
        That no force makes, as of `AddedLoads`.
    couple
        Moments per length along beams in powers of xi [N], shape (n, beams, ..., positions); None without.
    """

    nodes: NodeLoads
    q: VectorCoefficients
    blocks: tuple[Block, ...] = ()
    strain: VectorCoefficients | None = None
    couple: Coefficients | None = None


@dataclass(frozen=True, eq=False)
class ElasticProblem:
    """Links under loads, with joints that are to close.

    Attributes
    ----------
    compliance
        Of the beams.
    joints
        By name, the joints that give way or do not fit.
    loads
        All but the joint forces.
    added
        Loads besides the motion's: in `loads` are those of their parts that nodes and beams carry already.
    """

    motion: Motion
    configuration: Configuration
    compliance: Compliance
    joints: Mapping[str, JointCompliance]
    loads: LinkLoads
    added: AddedLoads | None = None

    @property
    def unloaded(self) -> ElasticProblem:
        """The same problem without loads, free strain and gaps of joints: that of joint forces alone."""
        fitting = {name: JointCompliance(own.translation, own.rotation) for name, own in self.joints.items()}
        nothing = np.zeros((1, len(self.configuration.length), *self.configuration.columns), complex)
        loads = LinkLoads({}, nothing)
        return replace(self, compliance=self.compliance.unstrained, joints=fitting, loads=loads, added=None)
