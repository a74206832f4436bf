"""Finite element solution of the whole mechanism at every position."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import PRIMARY, JointCompliance, Section
from fem_check.linear.beams import LoadedBeams, beams_of, over_designs
from fem_check.linear.block import BlockResponse
from fem_check.linear.equilibrium import Wrenches, balanced, wrenches_of
from fem_check.linear.frame import Frame
from fem_check.linear.friction import JointFriction, Load
from fem_check.linear.meshes import Flanks
from fem_check.linear.ties import Tie, ties
from fem_check.linear.unit_beam import UnitBeam, unit_beam
from rigid import Motion, Reals
from rigid.arrays import Numbers

MAX_ROUNDS = 100  # maximum number of friction iterations
MAX_FLANK_ROUNDS = 4  # maximum number of iterations for the loaded flanks
# a tooth flank counts as loaded if the effort of its gear exceeds this, relative to the largest force or moment
MIN_EFFORT = 1e-10


class TieForce(Struct, frozen=True, eq=False):
    """Force and moment that a weld, joint or drive exerts on its child link, shape (..., positions).

    `force` is complex [N]. `moment` is about the joint point [N m].
    """

    name: str
    force: Numbers
    moment: Reals

    def __repr__(self) -> str:
        return f"TieForce({self.name!r})"


class Solution(Struct, frozen=True, eq=False):
    """Section forces and displacements at the nodes of all beams by finite elements.

    Attributes
    ----------
    motion, sections
        Arguments of `solve`.
    elements
        Number of elements per beam.
    xi
        Nodes of each beam, x'/l, shape (elements + 1,).
    N, V, M
        Axial force (tension positive) [N], shear force [N] and bending moment [N m] at the nodes, from the end forces
        of the elements, shape (beams, ..., positions, nodes). The beams are in the order of `Mechanism.beams`.
    u, w, phi
        Longitudinal and transverse displacement [m] and rotation due to bending [rad] from the rigid position, in the
        axes of the beam, same shape.
    ties
        Forces of welds, pins, sliders and drives.
    efforts
        Moment [N m] or force [N] of each drive along its coordinate, shape (drives, ..., positions).
    """

    motion: Motion
    sections: tuple[Section, ...]
    elements: int
    xi: Reals
    N: Reals
    V: Reals
    M: Reals
    u: Reals
    w: Reals
    phi: Reals
    ties: tuple[TieForce, ...]
    efforts: Reals

    def __repr__(self) -> str:
        return f"Solution({len(self.sections)} beams of {self.elements} elements, columns {self.motion.columns})"


def solve(
    motion: Motion, sections: Sequence[Section], elements: int = 16, joints: Mapping[str, JointCompliance] | None = None
) -> Solution:
    """Compute the section forces and displacements of all beams at all positions by finite elements.

    Each beam has Hermite elements for bending and quadratic elements for tension and shear. Welds and joints are
    constraints, drives are locked, and the block of a slider divides the element under it. Friction depends on the
    constraint forces, and is computed by iteration; the solution is nan at positions that do not converge. Inertia and
    joint forces are computed here from the motion, the masses and the loads. Statically indeterminate mechanisms need
    no special treatment.

    Parameters
    ----------
    motion
        Motion of a mechanism. Links without beams are rigid.
    sections
        One per beam, in the order of `Mechanism.beams`. Rigidities may be infinite.
    elements
        Number of elements per beam.
    joints
        Compliance and misfit of joints, by name.

    Returns
    -------
    The solution, with nan at singular positions and at positions with a block beyond its beam.

    Raises
    ------
    ValueError
        If the number of sections is wrong, `elements` is less than 1, or a joint name is unknown or ambiguous.
    MechanismError
        If the beams of a link are not connected, no beam reaches a point with a joint or load, or no beam lies along
        the line of a slider.

    Examples
    --------
    The deflection of a cantilever of 2 m under 12 N at its end is F l^3/(3 EI) = 32 mm.

    >>> from rigid import Beam, Link, Mechanism, PinDrive, PointLoad, motion
    >>> arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A"),))
    >>> ground, hung = Link("ground", {"O": 0}), PointLoad("arm", "A", 12j)
    >>> mechanism = Mechanism((ground, arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2}, loads=(hung,))
    >>> solve(motion(mechanism, [0.0]), [Section(EA=1e6, EI=1e3)]).w[0, 0, -1].round(12)
    np.float64(0.032)
    """
    if len(sections) != len(motion.mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(motion.mechanism.beams)} beams")
    solved = solved_frame(over_designs(motion, sections), sections, elements, joints or {})
    wrenches, multipliers = solved.wrenches, solved.multipliers
    with np.errstate(invalid="ignore", over="ignore"):
        spots = wrenches.spots
        spots = spots[..., -1, :, :] + np.einsum("...r,...rki->...ki", multipliers, spots[..., :-1, :, :])
        spots[..., 2] *= wrenches.size
        fields = fields_of(
            solved.beams, *(np.moveaxis(part, (-2, -1), (1, 0)) for part in (spots, solved.body_displacements))
        )
    motion = solved.frame.motion
    forces, efforts = _tie_forces(motion, solved.constraints, np.moveaxis(multipliers, -1, 0), wrenches.size)
    return Solution(
        motion=motion,
        sections=tuple(sections),
        elements=elements,
        xi=unit_beam(elements).xi,
        ties=forces,
        efforts=efforts,
        **fields,
    )


class SolvedFrame(Struct, frozen=True, eq=False):
    """Solution of a frame.

    Attributes
    ----------
    constraints
        Constraints.
    wrenches
        Forces and moments of the constraints and loads on the bodies.
    multipliers, body_displacements
        Lagrange multipliers (forces) of the constraints, and displacements of the bodies, see `balanced`.
    friction
        Friction on both links of each joint: place, force (complex) [N], and moment [N m].
    """

    frame: Frame
    beams: LoadedBeams
    constraints: Sequence[Tie]
    wrenches: Wrenches
    multipliers: Reals
    body_displacements: Reals
    friction: Sequence[Load]


def solved_frame(
    motion: Motion, sections: Sequence[Section], elements: int, joints: Mapping[str, JointCompliance]
) -> SolvedFrame:
    """Solve the frame. Loaded tooth flanks and friction are found by iteration.

    The solution is nan at positions at which the friction does not converge.
    """
    frame = Frame(motion)
    with np.errstate(invalid="ignore", over="ignore"):
        beams = beams_of(frame, sections, elements)
        flanks: Flanks = {}
        friction = JointFriction(frame)
        for _ in range(MAX_ROUNDS if motion.mechanism.friction else MAX_FLANK_ROUNDS):
            constraints = list(ties(frame, joints, flanks))
            rows = [row for tie in constraints for row in tie.rows]
            wrenches = wrenches_of(frame, rows, beams, friction.loads)
            multipliers, body_displacements = balanced(motion, rows, beams, wrenches)
            before, flanks = flanks, _loaded_flanks(constraints, multipliers)
            alike = all(gear in before and np.array_equal(flanks[gear], before[gear]) for gear in flanks)
            friction = friction.after(constraints, multipliers, wrenches.size)
            if alike and friction.converged:
                break
        else:
            multipliers = np.where(friction.changing[..., None], np.nan, multipliers)
            body_displacements = np.where(friction.changing[..., None, None], np.nan, body_displacements)
            friction = friction.where_converged
        return SolvedFrame(frame, beams, constraints, wrenches, multipliers, body_displacements, friction.loads)


def _loaded_flanks(constraints: Sequence[Tie], multipliers: Reals) -> Flanks:
    """Return the tooth flank of each gear that is loaded according to the Lagrange multipliers of its constraint."""
    gears = [tie.gear for tie in constraints for _ in tie.rows]
    greatest = np.abs(multipliers).max(axis=-1, initial=0.0)
    loaded = {}
    for row, gear in enumerate(gears):
        if gear is not None:
            effort = multipliers[..., row]
            loaded[gear] = np.where(np.abs(effort) > MIN_EFFORT * greatest, np.sign(effort), 0.0)
    return loaded


def _tie_forces(
    motion: Motion, constraints: Sequence[Tie], multipliers: Reals, size: float
) -> tuple[tuple[TieForce, ...], Reals]:
    """Convert multipliers to joint forces and moments, and to the efforts of drives."""
    forces, number = [], 0
    efforts = np.full((len(motion.mechanism.drives), *motion.columns), np.nan)
    for tie in constraints:
        force: Any = 0.0
        moment: Any = 0.0
        for row, value in zip(tie.rows, multipliers[number : number + len(tie.rows)], strict=True):
            multiplier = value * size if row.turns else value
            _, way, turn = row.parts[0]
            force, moment = force + multiplier * way, moment + multiplier * turn
        forces.append(TieForce(tie.name, force, moment))
        if tie.drive is not None:
            efforts[tie.drive] = multipliers[number] * (size if tie.rows[0].turns else 1.0)
        number += len(tie.rows)
    return tuple(forces), efforts


def fields_of(beams: LoadedBeams, point_loads: Reals, carried: Reals) -> dict[str, Reals]:
    """Compute N, V, M, u, w, phi at the nodes, by superposition of unit responses and displacements of the bodies.

    Parameters
    ----------
    point_loads
        Forces in beam axes [N] and moments [N m] on the beams at the points `Frame.spots`, shape (3, spots, ...,
        positions).
    carried
        Displacement in ground axes [m] and rotation [rad] of the start of each body, shape (3, bodies, ..., positions).
    """
    length, count = beams.length, len(beams.length)
    move = np.conj(beams.axis) * (carried[0, :count] + 1j * carried[1, :count])
    turn = carried[2, :count]
    along = np.moveaxis(np.concatenate((length * beams.along, point_loads[:1, :count])), 0, -1)
    across = np.moveaxis(
        np.concatenate((length**2 * beams.across, [length * point_loads[1, :count], point_loads[2, :count]])), 0, -1
    )
    fields: dict[str, Reals] = {}
    shape = (*length.shape, len(beams.units[0].xi)) if beams.units else (0, *length.shape[1:], 1)
    for kind in beams.kinds if count else ():
        _add_kind(fields, beams, kind, along, across, shape)
    fields = fields or {field: np.zeros(shape) for field in PRIMARY}
    for spot, block in enumerate(beams.blocks, count):
        _add_block(fields, beams, block, point_loads[:, spot])
    xi = beams.units[0].xi if beams.units else np.zeros(1)
    fields["u"] += move.real[..., None] + (length * beams.strain)[..., None] * xi
    fields["w"] += move.imag[..., None] + (length * turn)[..., None] * xi
    fields["phi"] += turn[..., None]
    return fields


def _add_kind(
    fields: dict[str, Reals],
    beams: LoadedBeams,
    kind: tuple[UnitBeam, Any],
    along: Reals,
    across: Reals,
    shape: tuple[int, ...],
) -> None:
    """Add the responses of all beams that share a unit beam."""
    unit, numbers = kind
    along, across, length = along[numbers], across[numbers], beams.length[numbers][..., None]
    stretch, bend, shear = (row[numbers][..., None] for row in (beams.stretch, beams.bend, beams.shear))
    w = (across * (length**2 * bend)) @ unit.w
    if np.any(shear):
        w += (across[..., :-1] * shear) @ unit.slide
    values = {
        "N": along @ unit.N,
        "V": (across / length) @ unit.V,
        "M": across @ unit.M,
        "u": (along * (length * stretch)) @ unit.u,
        "w": w,
        "phi": (across * (length * bend)) @ unit.phi,
    }
    if isinstance(numbers, slice):
        fields.update(values)
        return
    for field, value in values.items():
        fields.setdefault(field, np.zeros(shape))[numbers] = value


def _add_block(fields: dict[str, Reals], beams: LoadedBeams, block: BlockResponse, load: Reals) -> None:
    """Add the response of a beam to the loads of a block."""
    k = block.beam
    length, stretch, bend, shear = (row[k][..., None] for row in (beams.length, beams.stretch, beams.bend, beams.shear))
    along, force, moment = (np.where(np.isnan(block.xi), np.nan, part)[..., None] for part in load)
    nodes = block.nodes
    fields["N"][k] += along * nodes["N"][0]
    fields["u"][k] += length * stretch * along * nodes["u"][0]
    fields["V"][k] += force * nodes["V"][0] + moment / length * nodes["V"][1]
    fields["M"][k] += length * force * nodes["M"][0] + moment * nodes["M"][1]
    fields["phi"][k] += length * bend * (length * force * nodes["phi"][0] + moment * nodes["phi"][1])
    bent = length**2 * bend * (length * force * nodes["w"][0] + moment * nodes["w"][1])
    fields["w"][k] += bent + length * shear * force * nodes["slide"][0]
