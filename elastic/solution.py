"""Deflection of a moving mechanism: section forces, elastic lines, and compatibility at the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, reduce
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple, replace

from elastic.arrays import Coefficients, PerBeam, VectorCoefficients
from elastic.beams.blocks import Block
from elastic.beams.compliance import BeamCompliance, designs_of
from elastic.beams.division import Division, division_of, on_pieces
from elastic.beams.elastic_line import Amplitudes
from elastic.beams.section import JointCompliance, Section
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import BeamTrees
from elastic.links.clamped_links import LinkResponse, add_rigid_motion
from elastic.links.compatibility import JointGaps, bent_links, compatible_forces, problem_of
from elastic.links.configuration import ElasticProblem
from elastic.links.free_body import resultants
from elastic.links.sliding_blocks import block_places
from rigid import JointForces, Mechanism, MechanismError, Motion, Reals
from rigid.arrays import Columns, Complexes, Flags
from rigid.closures import (
    cancellation_factor,
    displacements,
    greatest_rotation,
    has_no_result,
    loaded_flanks,
    self_stresses,
)
from rigid.kinematics import repeated, stacked
from rigid.kinetostatics import MAX_FLANK_ROUNDS, balancing_forces, force_condition, forces_with_friction
from rigid.plane import ZERO


def _field_property(field: str) -> cached_property[Coefficients]:
    """Create a property that computes a field on all pieces when it is first read."""
    return cached_property(lambda self: on_pieces(field, self.amplitudes, self.division, self.compliance))


class Deflection(Struct, frozen=True, eq=False, dict=True):
    """Exact section forces and displacements of every beam.

    N, V, M, u, w and phi are components in beam axes. Each of them is a polynomial in t on each piece of a beam; t runs
    from 0 to 1 along the piece. It is stored as an array of shape (coefficients, pieces, ..., positions), with
    coefficients of ascending powers, and computed when it is first read. A beam with sliding blocks or a taper has
    several pieces, see `division`. All other beams are a single piece. Beams are in the order of `Mechanism.beams`. Use
    `sample` and `extremes` to evaluate fields.

    Attributes
    ----------
    N, V, M
        Axial force (tension positive) [N], shear force [N], and bending moment [N m], with N' = -q_x, V' = q_y and
        M' = V - `couple`.
    u, w, phi
        Longitudinal and transverse displacement [m] and rotation of the section [rad], relative to the rigid position.
    motion, sections, joints
        The input: motion, one section per beam, and compliant joints by name.
    forces
        Joint forces.
    q
        Distributed load q_x + i q_y in powers of xi [N/m], complex, shape (coefficients, beams, ..., positions).
    amplitudes
        Coefficients of the fields on whole beams, before division into pieces.
    shift, angle
        Displacement of the origin [m], complex, and rotation [rad] of the axes of every link, shape (links, ...,
        positions). This is the rigid-body part of the displacement, without the bending of the link.
    gaps
        Gaps that the bent links would have at the joints if `shift` and `angle` were zero.
    blocks
        Sliding blocks on the beams.
    compliance
        Flexibilities of the beams.
    complete
        If `without_positions` has set some positions to nan: the deflection with its values at all positions. Otherwise
        None.
    added
        Loads that act in addition to those of the rigid motion, such as inertia loads of a vibration, or None.
    couple
        Distributed moment [N] in powers of xi, shape (k, beams, ..., positions), or None.
    """

    motion: Motion
    sections: tuple[Section, ...]
    joints: Mapping[str, JointCompliance]
    forces: JointForces
    q: VectorCoefficients
    amplitudes: Amplitudes
    shift: Complexes
    angle: Reals
    gaps: JointGaps
    blocks: tuple[Block, ...]
    compliance: BeamCompliance
    complete: Deflection | None = None
    added: AddedLoads | None = None
    couple: Coefficients | None = None

    def __repr__(self) -> str:
        return f"Deflection({len(self.sections)} beams, columns {self.motion.columns})"

    @property
    def length(self) -> PerBeam:
        """Lengths of the beams [m], shape (beams, 1) or (beams, designs, 1)."""
        return self.compliance.length

    @cached_property
    def division(self) -> Division:
        """Division of the beams into pieces."""
        return division_of(self.sections, self.blocks, self.motion.columns)

    N, V, M = _field_property("N"), _field_property("V"), _field_property("M")
    u, w, phi = _field_property("u"), _field_property("w"), _field_property("phi")

    @cached_property
    def condition(self) -> Reals:
        """Condition number of the fields, shape (..., positions). Relative errors of fields are about condition * eps.

        The condition number is at least `Motion.condition`. It is larger if the joint forces, or the displacements that
        close the joints, are small differences between large numbers. If it exceeds SINGULAR, the fields are nan.
        """
        if self.complete is not None:
            return self.complete.condition
        with np.errstate(all="ignore"):
            growth = force_condition(self.motion, self.forces)
            if self.sections:
                closures = self.motion.closures
                no_rotation = [ZERO] * len(self.motion.mechanism.links)
                *_, openings = displacements(
                    closures, self.gaps.displacement, self.gaps.rotation, no_rotation, self.forces.flank
                )
                bounds = (greatest_rotation(*each) for each in zip(closures, openings, strict=True))
                turned = reduce(np.maximum, bounds, 0.0)
                moved = np.maximum(_largest_magnitude(self.u), _largest_magnitude(self.w))
                growth = (
                    growth
                    * cancellation_factor(turned, _largest_magnitude(self.phi))
                    * cancellation_factor(turned * self.length.max(0), moved)
                )
        growth = np.where(np.isnan(growth) & ~np.isnan(self.motion.sine), np.inf, growth)
        return np.broadcast_to(growth, self.motion.columns)

    @cached_property
    def lost(self) -> Flags:
        """True at positions without a result, shape (..., positions).

        At such a position, either friction locks the mechanism, or a singular position is so close that the result
        would be mere round-off.
        """
        singular: Flags = self.motion.singular | self.forces.locked
        if not self.motion.may_be_singular:
            return singular
        return singular | has_no_result(self.motion, self.condition)


def deflection(
    motion: Motion,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
    added: AddedLoads | None = None,
) -> Deflection:
    """Compute the section forces and displacements of all beams at all positions.

    Parameters
    ----------
    motion
        Motion of a mechanism. Its elastic links must consist of straight beams.
    sections
        One section per beam, in the order of `Mechanism.beams`.
    joints
        Compliance and clearance of joints, by name of the joint. Joints that are not listed are rigid.
    added
        Loads that act in addition to those of the rigid motion.

    Raises
    ------
    MechanismError
        If the beams of a link are not connected, if all beams of a link with a ring are rigid, or if a slider moves on
        a tapered beam.
    ValueError
        If the number of sections is wrong, or a name in `joints` is not the name of a joint.

    Returns
    -------
    The deflection, with nan at singular positions. Statically indeterminate joint forces are determined by the
    condition that the bent links fit together. These forces are nan if all links on which they act are rigid.

    Examples
    --------
    An arm of length L = 2 m with m = 5 kg/m rotates at w = 3 rad/s. The axial force at its pivot is m w^2 L^2/2.

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
    joints = joints or {}
    require_joints(motion, joints)
    with np.errstate(invalid="ignore"):
        problem = problem_of(motion, sections, joints, added)
        require_soft_rings(mechanism, problem.configuration.trees, problem.compliance)
        require_prismatic_rails(motion, problem.configuration.trees, sections)
        forces, response, gaps = _loaded_links(problem)
        no_rotation = [ZERO] * len(mechanism.links)
        shifts, turning, _ = displacements(motion.closures, gaps.displacement, gaps.rotation, no_rotation, forces.flank)
        shift = stacked(shifts, motion.columns, complex)
        angle = stacked([value.imag for value in turning], motion.columns, float)
        add_rigid_motion(problem.configuration, response, shift, angle)
    amplitudes = response.amplitudes
    if added is not None and added.section is not None:
        amplitudes = amplitudes.with_section(*added.section)
    solved = Deflection(
        motion=motion,
        sections=sections,
        joints=joints,
        forces=forces,
        q=problem.loads.q,
        amplitudes=amplitudes,
        shift=shift,
        angle=angle,
        gaps=gaps,
        blocks=response.blocks,
        compliance=problem.compliance,
        added=added,
        couple=problem.loads.couple,
    )
    locked = bool(forces.friction) and np.any(forces.locked)
    if not (motion.may_be_singular or locked) or not solved.lost.any():
        return solved
    lost = solved.lost
    forces.mark(lost)
    return without_positions(solved, lost)


def _loaded_links(problem: ElasticProblem) -> tuple[JointForces, LinkResponse, JointGaps]:
    """Return the joint forces, the response of the links, and the gaps at the joints between the bent links."""
    motion, added = problem.motion, problem.added
    more = [] if added is None else list(resultants(added, motion, problem.configuration))
    surplus = any(closed.redundancy for closed in motion.closures)

    def balance(friction: Mapping[int, Columns] | None, flank: Mapping[int, Columns] | None) -> JointForces:
        if surplus:
            return _indeterminate_forces(problem, more, friction, flank)
        return balancing_forces(motion, more, flank=flank, friction=friction)

    vibrating = {number: (rate, creep) for number, rate, creep in added.sliding} if added is not None else {}
    forces = forces_with_friction(motion, balance, vibrating)
    return forces, *bent_links(problem, forces)


def _indeterminate_forces(
    problem: ElasticProblem,
    more: Sequence[tuple[int, Columns, Columns]],
    friction: Mapping[int, Columns] | None,
    given: Mapping[int, Columns] | None,
) -> JointForces:
    """Return the joint forces with which the bent links of a statically indeterminate mechanism fit together.

    `given` contains the loaded tooth flank of each gear. If it is empty or None, these flanks are found by iteration,
    in at most `MAX_FLANK_ROUNDS` rounds.
    """
    motion, flank = problem.motion, given
    for _ in range(MAX_FLANK_ROUNDS):
        forces = balancing_forces(motion, more, flank=flank, friction=friction)
        states = self_stresses(motion.closures, forces.flank)
        forces = compatible_forces(problem, forces, bent_links(problem, forces)[1], states)
        flank = loaded_flanks(forces)
        if given or all(np.array_equal(flank[number], forces.flank[number]) for number in flank):
            break
    return forces


def without_positions(deflection: Deflection, lost: Flags | bool = True) -> Deflection:
    """Return the deflection with all fields set to nan at the positions at which `lost` is True.

    Parameters
    ----------
    lost
        Mask of shape (..., positions). By default, it is True at all positions.
    """

    def known(values: Any) -> Any:
        return None if values is None else np.where(lost, np.nan, values)

    amplitudes = Amplitudes(*(known(values) for values in astuple(deflection.amplitudes)))
    shift, angle = known(deflection.shift), known(deflection.angle)
    complete = deflection.complete or deflection
    return replace(deflection, amplitudes=amplitudes, shift=shift, angle=angle, complete=complete)


def _largest_magnitude(values: Coefficients) -> Reals:
    """Return the largest magnitude of a field over the ends and midpoints of all pieces."""
    halves = 0.5 ** np.arange(len(values))
    places = (values[0], values.sum(0), np.tensordot(halves, values, 1))
    return reduce(np.maximum, (np.abs(place) for place in places)).max(axis=0)


def require_joints(motion: Motion, joints: Mapping[str, JointCompliance]) -> None:
    """Raise ValueError if the name of a compliant joint is unknown or ambiguous."""
    names = [joint.name for joint in motion.structure.joints] if joints else []
    for name in joints:
        if names.count(name) == 0:
            raise ValueError(f'there is no joint "{name}"')
        if names.count(name) > 1:
            raise ValueError(f'"{name}" names {names.count(name)} joints: a compliance needs a unique name')


def require_prismatic_rails(motion: Motion, trees: BeamTrees, sections: Sequence[Section]) -> None:
    """Raise MechanismError if a slider moves on a tapered beam.

    On a tapered beam, the fields beyond the block of a slider have no closed form.
    """
    if all(section.taper is None for section in sections):
        return
    for number, places in block_places(motion, trees).items():
        for place in places:
            if sections[place.beam].taper is not None:
                owner = motion.mechanism.links[motion.mechanism.beams[place.beam][0]].name
                name = motion.structure.joints[number].name
                raise MechanismError(
                    f'slider "{name}": the beam of "{owner}" along its line is tapered, expected a prismatic one',
                    kind="section",
                    links=(owner,),
                    joints=(name,),
                )


def require_soft_rings(mechanism: Mechanism, trees: BeamTrees, compliance: BeamCompliance) -> None:
    """Raise MechanismError if all beams of a link with a ring are rigid, which makes the forces indeterminate."""
    for cut in trees.cuts:
        numbers = [branch.number for branch in trees.trees[cut.link]]
        if not any(part[numbers].any() for part in (compliance.stretch, compliance.bend, compliance.shear)):
            name = mechanism.links[cut.link].name
            raise MechanismError(
                f'link "{name}": its beams form a ring and are all rigid, so their forces are indeterminate: omit one'
            )
