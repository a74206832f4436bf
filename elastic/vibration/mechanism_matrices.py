"""Matrices of all links at selected positions, and the constraints of their joints."""

from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.arrays import Matrices
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import trees_of
from elastic.vibration.link_matrices import (
    RANK_TOLERANCE,
    VibratingLink,
    divided,
    of_design,
    one_of,
    uncoupled,
    vibrating_link,
)
from rigid import Link, Motion
from rigid.arrays import Columns, Complexes, Flags, Integers, Numbers, Reals
from rigid.closures import gear_input, rack_arm
from rigid.joints import Joint, JointPlace
from rigid.kinetostatics import balancing_forces

MIN_MODAL_MASS = 1e-13  # modes with a smaller 1/omega^2 count as massless; relative to the largest 1/omega^2
MAX_DENSE = 400  # number of coordinates above which sparse matrices are faster
MIN_END_DISTANCE = 1e-3  # smallest distance of a block from the end of a beam, relative to the length of the beam
EXTRA_VECTORS = 6  # number of iterated vectors minus number of requested modes
TOLERANCE = 1e-9  # largest change in an eigenvalue in the last iteration, relative to the largest eigenvalue
MAX_ROUNDS = 300  # maximum number of subspace iterations
# compliance of constraints, relative to the links; without it, redundant constraints make the matrix singular
CONSTRAINT_FLEXIBILITY = 1e-12


class LinkMatrices(Struct, frozen=True, eq=False):
    """Matrices of a link: one pair for all positions, or one pair per position if sliding blocks divide its beams.

    Attributes
    ----------
    links
        The link, or one link with divided beams per position.
    stiffness, mass
        Matrices in Craig-Bampton coordinates (see `uncoupled`), shape (1 or positions, n, n).
    """

    links: list[VibratingLink]
    stiffness: Matrices
    mass: Matrices

    @property
    def level(self) -> Integers:
        """Level of each coordinate, shape (n,), see `VibratingBeam.level`."""
        return self.links[0].level


class VibratingStructure:
    """Matrices of one design of a mechanism at selected positions, with locked drives.

    Attributes
    ----------
    stiffness, mass
        Matrices for the coordinates of all links, shape (positions, n, n). Inner coordinates have unit stiffness and
        are not coupled in stiffness.
    constraints
        Constraints of the joints, shape (rows, positions, n). The product of a row with the coordinates must be zero.
    level
        Level of each coordinate, shape (n,), see `VibratingBeam.level`. Constraints contain only coordinates of level
        0.
    """

    def __init__(
        self,
        motion: Motion,
        sections: Sequence[Section],
        joints: Mapping[str, JointCompliance],
        positions: Integers,
        design: int,
        inner: int,
    ) -> None:
        self._motion, self._design, self._inner, self._joints = motion, design, inner, joints
        self._rails = trees_of(motion.mechanism).rails
        self._places = motion.places
        self._scale = self._unit_of_length()
        self._scaled: list[tuple[Link, list[Section]]] = []
        beam = 0
        for link in motion.mechanism.links:
            own = sections[beam : beam + len(link.beams)]
            self._scaled.append(of_design(link, own, self._scale, design))
            beam += len(link.beams)
        self._undivided: dict[int, LinkMatrices] = {}
        self._assemble(positions)

    def at(self, positions: Integers) -> "VibratingStructure":
        """Return the structure at other positions. Links without sliding blocks keep their matrices."""
        other = copy(self)
        other.__dict__.pop("_unconstrained", None)
        other._assemble(positions)
        return other

    def _assemble(self, positions: Integers) -> None:
        """Set the matrices and constraints at some positions."""
        self._positions = positions
        self._links: dict[int, LinkMatrices] = {}
        self._part: dict[int, slice] = {}
        size = beam = 0
        for at, (link, _) in enumerate(self._scaled[1:], 1):
            self._links[at] = self._link(at, beam)
            self._part[at] = slice(size, size + len(self._links[at].level))
            size, beam = self._part[at].stop, beam + len(link.beams)
        self.stiffness, self.mass = (np.zeros((len(positions), size, size)) for _ in range(2))
        for at, part in self._part.items():
            self.stiffness[:, part, part], self.mass[:, part, part] = self._links[at].stiffness, self._links[at].mass
        self.level = np.concatenate([np.zeros(0, int), *(matrices.level for matrices in self._links.values())])
        self.constraints: list[Any] = []
        for number, place in enumerate(self._places):
            self._add_joint(number, place, self._joints.get(place.joint.name, JointCompliance()))

    def frequencies(self, modes: int, inner: int) -> Reals:
        """Compute the lowest natural frequencies [rad/s], shape (modes, positions), with `inner` inner polynomials.

        The frequencies are in ascending order, and padded with inf if there are fewer than `modes` modes with mass.
        """
        omega = np.full((modes, len(self.mass)), np.inf)
        if self.mass.shape[-1] > MAX_DENSE:
            kept = self.level <= inner
            rows = np.array(self.constraints).swapaxes(0, 1)[..., kept]
            stiffness, mass = (whole[:, kept][:, :, kept] for whole in (self.stiffness, self.mass))
            return np.array([lowest_sparse(*part, modes) for part in zip(stiffness, mass, rows, strict=True)]).T
        for chosen, per_stiffness, level in self._unconstrained:
            count = np.searchsorted(level, inner, side="right")
            if count:
                omega[:, chosen] = _lowest(per_stiffness[:, :count, :count], modes)
        return omega

    @cached_property
    def _unconstrained(self) -> list[tuple[Integers, Matrices, Integers]]:
        """Mass matrices in coordinates that meet the constraints and have unit stiffness.

        Each entry contains the indices of positions with the same rank of the constraints, the matrices at these
        positions (see `_per_stiffness`), and the levels of the coordinates. Constraints contain only end coordinates,
        so inner coordinates remain unchanged.
        """
        at_ends = self.level == 0
        rows = (
            np.array(self.constraints).reshape(len(self.constraints), *self.mass.shape[:2]).swapaxes(0, 1)[..., at_ends]
        )
        within = np.flatnonzero(~at_ends)
        within, groups = within[np.argsort(self.level[within], kind="stable")], []
        _, values, basis = np.linalg.svd(rows)
        ranks = (values > RANK_TOLERANCE * values.max(axis=-1, initial=0.0, keepdims=True)).sum(axis=-1)
        for rank in sorted(set(ranks.tolist())):
            chosen = np.flatnonzero(ranks == rank)
            free = basis[chosen, rank:]
            level = np.concatenate([np.zeros(free.shape[1], int), self.level[within]])
            groups.append((chosen, self._per_stiffness(chosen, free, at_ends, within), level))
        return groups

    def _per_stiffness(self, chosen: Integers, free: Matrices, at_ends: Flags, within: Integers) -> Matrices:
        """Return mass matrices in coordinates in which the stiffness matrix is the identity.

        The eigenvalues of these matrices are 1/omega^2, which is finite also for massless coordinates. `free` is the
        basis of the end coordinates that meet the constraints, shape (positions, basis vectors, end coordinates).
        """
        stiffness = free @ self.stiffness[chosen][:, at_ends][:, :, at_ends] @ free.swapaxes(-1, -2)
        scale = 1.0 / np.sqrt(np.diagonal(stiffness, axis1=-2, axis2=-1))
        factor = np.linalg.inv(np.linalg.cholesky(stiffness * scale[:, :, None] * scale[:, None, :]))
        unit = (factor * scale[:, None, :]) @ free
        mass = self.mass[chosen]
        across = unit @ mass[:, at_ends][:, :, within]
        own = unit @ mass[:, at_ends][:, :, at_ends] @ unit.swapaxes(-1, -2)
        return np.block([[own, across], [across.swapaxes(-1, -2), mass[:, within[:, None], within]]])

    def _unit_of_length(self) -> float:
        """Return the largest distance between the first and any other point of a link [m]; 1 if this is zero."""
        ways = [
            np.abs(one_of(place, self._design) - one_of(next(iter(link.points.values())), self._design))
            for link in self._motion.mechanism.links
            for place in link.points.values()
        ]
        return float(max(ways)) or 1.0

    def _at_positions(self, value: Columns) -> Numbers:
        """Return the values of a quantity of the motion for this design at the selected positions."""
        array = np.broadcast_to(value, self._motion.columns)
        return (array[self._design] if array.ndim > 1 else array)[self._positions]

    def _link(self, at: int, first_beam: int) -> LinkMatrices:
        """Assemble a link once for all positions, or for each position if sliding blocks divide its beams."""
        if at in self._undivided:
            return self._undivided[at]
        link, sections = self._scaled[at]
        marks: list[dict[int, list[tuple[float, str]]]] = [{} for _ in self._positions]
        for number, rails in self._rails.items():
            if at == self._places[number].joint.owner:
                beams = [rail - first_beam for rail in rails]
                for mark, local in zip(marks, self._in_link_axes(at, self._arm(number, at)), strict=True):
                    beam, xi = _nearest(link, beams, local)
                    mark.setdefault(beam, []).append((xi, _block(number)))
        if any(marks):
            return _matrices([vibrating_link(*divided(link, sections, mark), self._inner) for mark in marks])
        self._undivided[at] = _matrices([vibrating_link(link, sections, self._inner)])
        return self._undivided[at]

    def _arm(self, number: int, at: int) -> Columns:
        return self._places[number].arm(at)

    @cached_property
    def _flank(self) -> Mapping[int, Reals]:
        """Loaded tooth flank of each gear in the rigid motion, by index of the joint."""
        return balancing_forces(self._motion).flank

    def _in_link_axes(self, at: int, arm: Columns) -> Complexes:
        """Convert a vector from ground axes to link axes with scaled lengths, shape (positions,)."""
        return np.asarray(
            self._at_positions(arm) / self._at_positions(self._motion.direction[at]) / self._scale, complex
        )

    def _point_displacement(self, at: int, name: str, arm: Columns) -> tuple[Complexes, Reals]:
        """Return the displacement (complex, ground axes) and the rotation of a point, per unit of each coordinate.

        `arm` is the vector from the origin of the link axes to the point, in ground axes. Only links without beams use
        it.
        """
        shape = self.mass.shape[:2]
        shift, turned = np.zeros(shape, complex), np.zeros(shape)
        if at:
            links = self._links[at].links
            local = self._in_link_axes(at, arm)
            if len(links) == 1:
                moved, turn = links[0].place(name, local[:, None])
            else:
                own = [link.place(name, spot) for link, spot in zip(links, local, strict=True)]
                moved, turn = (np.array(parts) for parts in zip(*own, strict=True))
            shift[:, self._part[at]] = self._at_positions(self._motion.direction[at])[:, None] * moved
            turned[:, self._part[at]] = turn
        return shift, turned

    def _joint_displacement(self, number: int, at: int) -> tuple[Complexes, Reals]:
        """Return the displacement and rotation of a link at a joint, see `_point_displacement`."""
        point = self._places[number].joint.point(at)
        return self._point_displacement(at, _block(number) if point is None else point, self._arm(number, at))

    def _add_joint(self, number: int, place: JointPlace, soft: JointCompliance) -> None:
        """Add the constraints of a joint, or the stiffness of springs if the joint is compliant."""
        joint = place.joint
        at_child, at_parent = (
            self._joint_displacement(number, joint.child),
            self._joint_displacement(number, joint.parent),
        )
        shift, turned = at_child[0] - at_parent[0], at_child[1] - at_parent[1]
        rows = [shift.real, shift.imag]
        if not place.turns and joint.drive is None:
            rows = [(np.conj(self._at_positions(place.along))[:, None] * shift).imag]
        self._add_constraint(rows, soft.translation)
        if joint.holds_rotation:
            self._add_constraint([turned], soft.rotation * self._scale**2)
        if joint.gear is not None:
            followed = turned / self._scale if place.turns else self._along(place.along, shift)
            compliance = soft.rotation if place.turns else soft.translation
            self._add_constraint([followed - self._gear_input(number, place)], compliance)

    def _gear_input(self, number: int, place: JointPlace) -> Reals:
        """Return the displacement that a gear imposes on its follower, per unit of each coordinate.

        The tooth flank that is loaded in the rigid motion is assumed to be in contact.
        """
        flank = None
        teeth = place.teeth
        hub: Any = rack_arm(place.joint.gear.driver) if place.joint.gear else 0.0
        if teeth is not None:
            hub = teeth.arm - teeth.reach_body
            flank = self._at_positions(self._flank[number])[:, None]
            arrays = ("arm", "reach_body", "reach", "along", "apart")
            parts: dict[str, Any] = {name: self._at_positions(getattr(teeth, name))[:, None] for name in arrays}
            along = None if place.turns else self._at_positions(place.along)[:, None]
            place = replace(place, along=along, teeth=replace(teeth, **parts))

        def moved(joint: Joint, at: int) -> tuple[Complexes, Reals]:
            if joint is place.joint:
                shift, turned = self._joint_displacement(number, at)
            else:
                shift, turned = self._point_displacement(at, joint.point(at) or "", hub)
            return shift, turned / self._scale

        return gear_input(place, moved, flank)

    def _along(self, along: Columns, shift: Complexes) -> Reals:
        """Return the component of displacements along the line of a slider."""
        return (np.conj(self._at_positions(along))[:, None] * shift).real

    def _add_constraint(self, rows: list[Matrices], compliance: float) -> None:
        for row in rows:
            if compliance:
                self.stiffness += row[:, :, None] * row[:, None, :] / compliance
            else:
                self.constraints.append(row)


def _matrices(links: list[VibratingLink]) -> LinkMatrices:
    stiffness, mass = np.array([link.stiffness for link in links]), np.array([link.mass for link in links])
    return LinkMatrices(links, *uncoupled(stiffness, mass, links[0].level))


def _nearest(link: Link, beams: list[int], local: complex) -> tuple[int, float]:
    """Return which of the given beams of a link is nearest to a point, and xi of the point on this beam.

    If xi is closer to an end than `MIN_END_DISTANCE`, it is moved to this distance from the end.
    """
    candidates: list[tuple[float, int, float]] = []
    for beam in beams:
        start, end = (
            complex(np.ravel(link.points[name])[0]) for name in (link.beams[beam].start, link.beams[beam].end)
        )
        xi = complex((local - start) / (end - start)).real
        candidates.append((max(-xi, xi - 1.0), beam, float(np.clip(xi, MIN_END_DISTANCE, 1 - MIN_END_DISTANCE))))
    _, nearest, place = min(candidates)
    return nearest, place


def _block(number: int | None) -> str:
    """Return the name of the point under the block of a joint."""
    return f"under joint {number}"


def _lowest(per_stiffness: Matrices, modes: int) -> Reals:
    """Return the lowest natural frequencies, shape (modes, structures).

    They follow from the largest eigenvalues of the matrices of `VibratingStructure._per_stiffness`, which are
    1/omega^2.
    """
    greatest = np.linalg.eigvalsh(per_stiffness)[:, ::-1].T[:modes]
    moving = greatest > MIN_MODAL_MASS * np.maximum(greatest[:1], 0.0)
    omega = np.full((modes, len(per_stiffness)), np.inf)
    omega[: len(greatest)] = np.where(moving, 1.0 / np.sqrt(np.where(moving, greatest, 1.0)), np.inf)
    return omega


def lowest_sparse(stiffness: Matrices, mass: Matrices, constraints: Matrices, modes: int) -> Reals:
    """Compute the lowest frequencies of one structure by subspace iteration [rad/s], shape (modes,).

    Each iteration solves for the displacements under the inertia loads of the last shapes, and then solves the
    eigenvalue problem reduced to these displacements. The frequencies are in ascending order, and inf for massless
    modes.

    Parameters
    ----------
    stiffness, mass
        Matrices of shape (n, n). The mass matrix may be singular.
    constraints
        Constraints, shape (rows, n). The product of a row with the coordinates must be zero. Rows may be redundant.

    References
    ----------
    Bathe, Finite Element Procedures, 2nd ed., 2014, section 11.6.
    """
    from scipy.linalg import eigh
    from scipy.sparse import bmat, csc_matrix, identity
    from scipy.sparse.linalg import splu

    size, rows = len(stiffness), len(constraints)
    diagonal = np.diagonal(stiffness)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, diagonal.max()))
    scaled, weight = (csc_matrix(whole * np.outer(scale, scale)) for whole in (stiffness, mass))
    ties = constraints * scale
    ties = csc_matrix(ties / np.linalg.norm(ties, axis=1, keepdims=True))
    solver = splu(bmat([[scaled, ties.T], [ties, -CONSTRAINT_FLEXIBILITY * identity(rows)]], format="csc"))
    count = min(modes + EXTRA_VECTORS, size)
    shapes = np.random.default_rng(0).standard_normal((size, count))
    before = np.full(count, np.inf)
    for _ in range(MAX_ROUNDS):
        inertia = weight @ shapes
        moved = solver.solve(np.concatenate([inertia, np.zeros((rows, count))]))[:size]
        given, energy = moved.T @ (weight @ moved), moved.T @ inertia
        # eigenvalues 1/omega^2, in descending order after the reversal, and zero for massless shapes
        values, turn = eigh(given, energy + 1e-14 * np.trace(energy) * np.eye(count))
        values, turn = values[::-1], turn[:, ::-1]
        shapes = moved @ turn
        if np.abs(values[:modes] - before[:modes]).max() <= TOLERANCE * values[0]:
            break
        before = values
    per_stiffness = values[:modes]
    omega = np.full(modes, np.inf)
    moving = per_stiffness > 1e-13 * per_stiffness[0]
    omega[: len(per_stiffness)] = np.where(moving, 1.0 / np.sqrt(np.where(moving, per_stiffness, 1.0)), np.inf)
    return omega
