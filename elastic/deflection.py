"""From motion to deflection: section forces, elastic line and Hooke's law, compatibility at the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np

from elastic.beams.line import Compliance, compliance, designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import Frame, frame
from elastic.links.clamped_links import Response, beyond_contact
from elastic.links.compatibility import brought_together, opening, require_joints
from elastic.links.free_body import Contact, Stance, node_loads, root_of
from rigid import SINGULAR, JointForces, Mechanism, MechanismError, Motion, Reals, structure
from rigid.conditioning import amplified, greatest_rotation, ill_conditioned
from rigid.constants import beam_table
from rigid.displacements import displacements
from rigid.forces import self_stresses
from rigid.kinematics import repeated, stacked
from rigid.loads import beam_directions, beam_loads
from rigid.plane import ZERO
from rigid.statics import balancing_forces, force_condition

FIELDS = ("N", "V", "M", "u", "w", "phi")


@dataclass(frozen=True, eq=False)
class Deflection:
    """How much every beam bends, turns and stretches, exactly.

    All fields are polynomials in xi = x'/l in the beam's own axes: arrays of shape
    (coefficients, beams, ..., positions), beams in the order of `Mechanism.beams`, powers from 0 up. For what sliders
    and tapers add to them use `sample` and `extremes`.

    Attributes
    ----------
    motion, sections, joints
        What was asked; one section per beam, and the joints that give way.
    forces
        Joint forces.
    length
        Of the beams [m], shape (beams, 1) or (beams, designs, 1).
    q
        Distributed load q_x + i q_y [N/m], complex.
    N, V, M
        Axial force (tension positive) [N], shear force [N], bending moment [N m]: N' = -q_x, V' = q_y, M' = V.
    u, w, phi
        Longitudinal and transverse displacement [m] and rotation of the section [rad] from the rigid position.
    shear
        What shear adds to w of tapered beams; None where there is none.
    shift, angle
        Displacement of the origin [m], complex, and rotation [rad] of every link's axes, shape (links, ..., positions):
        where the link would be were it only carried, not bent.
    gaps, turns
        By how much the links, bent but not carried, leave every joint open: displacement [m], complex, and rotation.
    contacts
        Blocks that slide on beams: beyond them the fields are more by `beyond`.
    soft
        Compliances of the beams.
    """

    motion: Motion
    sections: tuple[Section, ...]
    joints: Mapping[str, JointCompliance]
    forces: JointForces
    length: Reals
    q: Any
    N: Reals
    V: Reals
    M: Reals
    u: Reals
    w: Reals
    phi: Reals
    shear: Any
    shift: Any
    angle: Reals
    gaps: Sequence[Any]
    turns: Sequence[Any]
    contacts: tuple[Contact, ...]
    soft: Compliance

    @cached_property
    def condition(self) -> Reals:
        """By how much round-off grows in the fields, shape (..., positions): errors are of this many eps.

        As `Motion.condition`, and more where joint forces, or the displacements that bring the bent links together, are
        small beside what they are the difference of. Beyond SINGULAR the fields are nan.
        """
        with np.errstate(all="ignore"):
            found = force_condition(self.motion, self.forces)
            if self.sections:
                closures = self.motion.closures
                still = [ZERO] * len(self.motion.mechanism.links)
                *_, openings = displacements(closures, self.gaps, self.turns, still)
                bounds = (greatest_rotation(*each) for each in zip(closures, openings, strict=True))
                turned = reduce(np.maximum, bounds, 0.0)
                moved = np.maximum(_greatest(self.u), _greatest(self.w))
                found = found * amplified(turned, _greatest(self.phi)) * amplified(turned * self.length.max(0), moved)
        found = np.where(np.isnan(found) & ~np.isnan(self.motion.sine), np.inf, found)
        return np.broadcast_to(found, self.motion.columns)

    @cached_property
    def lost(self) -> Any:
        """Whether a position is so near a singular one that nothing but round-off is left, bool, (..., positions)."""
        singular = np.logical_not(self.motion.condition <= SINGULAR)
        if not self.motion.suspect:
            return singular
        return singular | ill_conditioned(self.motion, self.condition)

    def beyond(self, contact: Contact, field: str) -> tuple[Any, ...]:
        """What a field beyond a contact is more than before it, in powers of xi - contact.xi."""
        return beyond_contact(contact, self.length[contact.beam], self.soft)[field]


def deflection(
    motion: Motion,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
) -> Deflection:
    """Section forces and displacements of all beams at all positions.

    Parameters
    ----------
    motion
        Of a mechanism whose elastic links are made of straight beams.
    sections
        One per beam, in the order of `Mechanism.beams`.
    joints
        By name, the joints that give way or do not fit.

    Raises
    ------
    MechanismError
        A link's beams close a ring and are all rigid, or do not hang together; a slider moves along a tapered beam.
    ValueError
        Too many or too few sections; a soft joint that is none.

    Returns
    -------
    Deflection, nan at singular positions. Where statics alone does not tell the joint forces, those that bring the bent
    links together; nan where these are all rigid.

    Examples
    --------
    A cantilever of 2 m that turns at 3 rad/s, 5 kg/m: at its root it pulls with m w^2 L^2/2.

    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A", 5.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2})
    >>> deflection(motion(turning, [0.0], 3.0), [Section(EA=1e6, EI=1e3)]).N[0, 0]
    array([90.])
    """
    mechanism = motion.mechanism
    if len(sections) != len(mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(mechanism.beams)} beams")
    sections = tuple(sections)
    designs = designs_of(sections)
    if designs:
        columns = np.broadcast_shapes(motion.columns, designs)
        motion = motion if columns == motion.columns else repeated(motion, columns)
    table = beam_table(mechanism, len(motion.columns))
    stance = Stance(
        frame(mechanism),
        table.link,
        motion.direction,
        beam_directions(motion),
        table.unit,
        table.length,
        motion.columns,
    )
    soft = compliance(sections, len(motion.columns))
    _require_soft_rings(mechanism, stance.frame, soft)
    _require_prismatic_rails(mechanism, stance.frame, sections)
    joints = joints or {}
    if joints:
        require_joints(motion, joints)
    q = beam_loads(motion)
    with np.errstate(invalid="ignore"):
        states = self_stresses(motion.closures)
        forces = balancing_forces(motion)
        nodes = node_loads(motion, stance.frame)
        opened = opening(motion, stance, soft, joints, forces, nodes, q)
        if states:
            forces = brought_together(motion, stance, soft, joints, forces, opened, states)
            opened = opening(motion, stance, soft, joints, forces, nodes, q)
        shifts, turning, _ = displacements(motion.closures, opened.gaps, opened.turns, [ZERO] * len(mechanism.links))
        shift = stacked(shifts, motion.columns, complex)
        angle = stacked([value.imag for value in turning], motion.columns, float)
        found = opened.response
        _carry(stance, found, shift, angle)
    line = found.line
    solved = Deflection(
        motion=motion,
        sections=sections,
        joints=joints,
        forces=forces,
        length=table.length,
        q=q,
        N=found.N,
        V=found.V,
        M=found.M,
        u=line.u,
        w=line.w,
        phi=line.phi,
        shear=line.shear,
        shift=shift,
        angle=angle,
        gaps=opened.gaps,
        turns=opened.turns,
        contacts=opened.contacts,
        soft=soft,
    )
    if motion.suspect:
        _mark(solved)
    return solved


def _mark(solved: Deflection) -> None:
    """Make nan what is nothing but round-off."""
    lost = solved.lost
    for values in (solved.N, solved.V, solved.M, solved.u, solved.w, solved.phi, solved.shift, solved.angle):
        values[..., lost] = np.nan
    solved.forces.mark(lost)


def _greatest(values: Any) -> Any:
    """Greatest magnitude of a field over the ends and middles of all beams."""
    halves = 0.5 ** np.arange(len(values))
    places = (values[0], values.sum(0), np.tensordot(halves, values, 1))
    return reduce(np.maximum, (np.abs(place) for place in places)).max(axis=0)


def _require_prismatic_rails(mechanism: Mechanism, links: Frame, sections: tuple[Section, ...]) -> None:
    """Raise where a slider moves along a tapered beam: what it adds beyond its block has no closed form here."""
    for place, beam in links.rails.items():
        if sections[beam].taper is not None:
            owner = mechanism.links[mechanism.beams[beam][0]].name
            name = structure(mechanism).joints[place].name
            raise MechanismError(
                f'slider "{name}": the beam of "{owner}" along its line is tapered, expected a prismatic one'
            )


def _require_soft_rings(mechanism: Mechanism, beams: Frame, soft: Compliance) -> None:
    """Raise where all beams of a link with a ring are rigid: no law tells how they share the loads."""
    for cut in beams.cuts:
        numbers = [branch.number for branch in beams.trees[cut.link]]
        if not any(part[numbers].any() for part in (soft.stretch, soft.bend, soft.shear)):
            name = mechanism.links[cut.link].name
            raise MechanismError(
                f'link "{name}": its beams close a ring and are all rigid, which leaves their forces open: omit one'
            )


def _carry(stance: Stance, found: Response, shift: Any, angle: Any) -> None:
    """Add to every beam's fields what carries its start."""
    line = found.line
    own = stance.back * shift[stance.rows]
    line.phi[0] = angle[stance.rows]
    for at, tree in stance.frame.trees.items():
        for branch in tree:
            k = branch.number
            start = branch.near if branch.forward else branch.far
            local = stance.frame.points[at, start]
            if start == root_of(tree) and not np.ndim(local) and local == 0:
                continue
            move, more = found.bent[at, start]
            own[k] += stance.back[k] * (move + 1j * angle[at] * (stance.link[at] * local))
            line.phi[0, k] += more
    line.u[0], line.w[0] = own.real, own.imag
    line.w[1] += stance.length * line.phi[0]
