"""Equilibrium and compatibility of the frame: constraint forces and displacements of the bodies.

The unknowns are the multipliers (forces and moments) of the constraints and the rigid motions of the bodies. Beams are
represented by flexibilities at their ends and under blocks. All positions are then solved in one call, without the
round-off of a fine mesh. The tests compare with the solution for the full matrix, which scikit-fem assembles
(tests/fem_direct.py).
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from fem_check.linear.beams import LoadedBeams
from fem_check.linear.frame import Frame, FramePlace
from fem_check.linear.loads import concentrated
from fem_check.linear.ties import Row
from rigid import SINGULAR, Motion
from rigid.arrays import Columns, Complexes, Flags, Reals
from rigid.plane import cross


class Wrenches(Struct, frozen=True, eq=False):
    """Forces and moments (wrenches) on the bodies due to a unit multiplier of each constraint, and due to the loads.

    The loads are the last row.

    A wrench is a force (x, y) [N] and a moment divided by `size` [N].

    Attributes
    ----------
    total
        Wrench about the start of each body, in ground axes, shape (..., positions, rows + 1, bodies, 3).
    spots
        Part of the wrench that acts at each point of `Frame.spots`, in beam axes, shape (..., positions, rows + 1,
        spots, 3).
    size
        Reference length [m].
    """

    total: Reals
    spots: Reals
    size: float


def wrenches_of(
    frame: Frame,
    rows: Sequence[Row],
    beams: LoadedBeams,
    additional_loads: Sequence[tuple[FramePlace | None, Columns, Columns]] = (),
) -> Wrenches:
    """Compute the wrenches of all constraints and loads.

    `additional_loads` contains further loads: place, force [N], moment [N m].
    """
    columns = frame.motion.columns
    total = np.zeros((*columns, len(rows) + 1, len(frame.bodies), 3))
    spots = np.zeros((*columns, len(rows) + 1, len(frame.spots), 3))
    size = float(np.max(beams.length, initial=0.0)) or 1.0

    def put(row: int, place: FramePlace | None, force: Any, moment: Columns) -> None:
        if place is None:
            return
        k = place.body
        moment = moment + cross(place.arm, force)
        if place.spot is not None:
            local = np.conj(beams.axis[k]) * force
            for i, part in enumerate((local.real, local.imag, moment / size)):
                spots[..., row, place.spot, i] += part
            moment = moment + frame.spots[place.spot][1] * beams.length[k] * local.imag
        for i, part in enumerate((np.real(force), np.imag(force), moment / size)):
            total[..., row, k, i] += part

    for number, row in enumerate(rows):
        unit = size if row.turns else 1.0
        for place, force, moment in row.parts:
            put(number, place, force * unit, moment * unit)
    for place, force, moment in (*concentrated(frame), *additional_loads):
        put(len(rows), place, force, moment)
    pull, turn = _resultants(beams)
    for i, part in enumerate((pull.real, pull.imag, turn / size)):
        total[..., len(rows), : len(beams.length), i] += np.moveaxis(part, 0, -1)
    return Wrenches(total, spots, size)


def _resultants(beams: LoadedBeams) -> tuple[Complexes, Reals]:
    """Return the force and moment resultants of the distributed loads about the starts of the beams."""
    if not beams.units:
        return beams.length * beams.axis, beams.length
    along, across, turn = (
        (beams.per_beam(values) * part).sum(0)
        for values, part in (
            (lambda unit: unit.N[:-1, 0], beams.along),
            (lambda unit: -unit.V[:-2, 0], beams.across),
            (lambda unit: unit.M[:-2, 0], beams.across),
        )
    )
    return beams.axis * beams.length * (along + 1j * across), beams.length**2 * turn


def balanced(motion: Motion, rows: Sequence[Row], beams: LoadedBeams, wrenches: Wrenches) -> tuple[Reals, Reals]:
    """Solve for the multipliers of the constraints and the displacements of the bodies.

    Returns
    -------
    Multipliers [N], in which moments are divided by `Wrenches.size`, shape (..., positions, rows). Displacement
    (x, y) [m] and rotation [rad] of each body at its start, shape (..., positions, bodies, 3).
    """
    system = _System(motion.columns, rows, beams, wrenches)
    regular = motion.condition <= SINGULAR
    count, freedoms = len(rows), wrenches.total.shape[-2] * 3
    matrix = np.zeros((*motion.columns, count + freedoms, count + freedoms))
    matrix[..., :count, :count] = system.gaps(wrenches.spots[..., :-1, :, :])
    matrix[..., np.arange(count), np.arange(count)] += system.compliance
    matrix[..., :count, count:] = system.resultants[..., :-1, :]
    matrix[..., count:, :count] = np.swapaxes(system.resultants[..., :-1, :], -1, -2)
    solved = _solved(matrix, system.negative_residual(None), regular)
    if count > freedoms:
        solved += _solved(matrix, system.negative_residual(solved), regular)
    carried = solved[..., count:].reshape(*motion.columns, -1, 3) * system.unit
    carried[..., 2] /= wrenches.size
    return solved[..., :count], carried


class _System:
    """Linear system of the frame. The equations are zero gaps of the constraints, and equilibrium of the bodies.

    Gaps are divided by the largest compliance, so that they have the unit of a force.

    Attributes
    ----------
    unit
        Largest compliance [m/N].
    compliance
        Compliance of the constraints divided by `unit`, shape (rows,).
    resultants
        `Wrenches.total` with the bodies and components in one axis, shape (..., positions, rows + 1, 3 bodies).
    """

    def __init__(self, columns: tuple[int, ...], rows: Sequence[Row], beams: LoadedBeams, wrenches: Wrenches) -> None:
        size, self._spots = wrenches.size, wrenches.spots
        compliance, bent = _ends(beams, size)
        if beams.blocks:
            bent = np.concatenate((bent, _block_bent(beams, size)), axis=-2)
        joint_compliance = np.array([row.compliance * (size**2 if row.turns else 1.0) for row in rows])
        self.unit = max(float(np.max(compliance, initial=0.0)), float(np.max(joint_compliance, initial=0.0))) or 1.0
        self.compliance = joint_compliance / self.unit
        self._ends = compliance / self.unit
        self._couplings = [(loaded, moved, matrix / self.unit) for loaded, moved, matrix in _couplings(beams, size)]
        self.resultants = wrenches.total.reshape(*columns, len(rows) + 1, -1)
        self._flat = self._spots[..., :-1, :, :].reshape(*columns, len(rows), -1)
        self._given = np.einsum("...rk,...k->...r", self._flat, bent.reshape(*columns, -1) / self.unit)
        for number, row in enumerate(rows):
            self._given[..., number] -= row.misfit * ((size if row.turns else 1.0) / self.unit)

    def gaps(self, loads: Reals) -> Reals:
        """Return the gaps of the constraints due to elastic displacements under loads at the points `Frame.spots`.

        The loads have the shape (..., loads, spots, 3), the gaps (..., loads, rows).
        """
        moved = np.zeros_like(loads)
        ends = self._ends.shape[-3]
        moved[..., :ends, :] = np.einsum("...rki,...kij->...rkj", loads[..., :ends, :], self._ends)
        for loaded, at, matrix in self._couplings:
            moved[..., at, :] += np.einsum("...ri,...ji->...rj", loads[..., loaded, :], matrix)
        return moved.reshape(*loads.shape[:-2], self._flat.shape[-1]) @ np.swapaxes(self._flat, -1, -2)

    def negative_residual(self, solved: Reals | None) -> Reals:
        """Return the negative residual of the equations for a solution, shape (..., rows + 3 bodies).

        `solved` is None for the zero solution. The residual is evaluated beam by beam, because entries of the matrix
        that sum the compliances of a stiff and a soft beam lose the digits of the stiff beam.
        """
        count = len(self.compliance)
        loads = self._spots[..., -1:, :, :]
        gaps, balance = self._given, self.resultants[..., -1, :]
        if solved is not None:
            force, displacement = solved[..., :count], solved[..., count:]
            own = np.einsum("...r,...rki->...ki", force, self._spots[..., :-1, :, :])
            loads = loads + own[..., None, :, :]
            gaps = gaps + (self.resultants[..., :-1, :] @ displacement[..., None])[..., 0] + force * self.compliance
            balance = balance + (force[..., None, :] @ self.resultants[..., :-1, :])[..., 0, :]
        return -np.concatenate((gaps + self.gaps(loads)[..., 0, :], balance), axis=-1)


def _ends(beams: LoadedBeams, size: float) -> tuple[Reals, Reals]:
    """Return the flexibility of the beam ends, and the displacement of the ends due to distributed loads and strain.

    Returns
    -------
    Arrays of shape (..., positions, beams, 3, 3) [m/N] and (..., positions, beams, 3) [m]. Rotations are multiplied by
    `size`, and moments are divided by it.
    """
    if not beams.units:
        shape = (*beams.length.shape[1:], 0, 3)
        return np.zeros((*shape, 3)), np.zeros(shape)
    u, w, phi, slide = (
        beams.per_beam(values)
        for values in (
            lambda unit: unit.u[:, -1],
            lambda unit: unit.w[:, -1],
            lambda unit: unit.phi[:, -1],
            lambda unit: unit.slide[:, -1],
        )
    )
    matrix = beams.flexibility(size, u[-1], w[-2:], phi[-2:], slide[-1])
    bent = beams.displacement_under_loads(size, 1.0, u[:-1], w[:-2], phi[:-2], slide[:-1])
    return np.moveaxis(matrix, (2, 0, 1), (-3, -2, -1)), np.moveaxis(bent, (1, 0), (-2, -1))


def _couplings(beams: LoadedBeams, size: float) -> Iterator[tuple[int, int, Any]]:
    """Yield flexibilities between two points of a beam (see `Frame.spots`), of which at least one is a block.

    Each item contains the index of the loaded point, the index of the displaced point, and the flexibility matrix,
    shape (..., positions, 3, 3).
    """
    ends = len(beams.length)
    for number, block in enumerate(beams.blocks, ends):
        beam = beams.single_beam(block.beam)
        lost = np.where(np.isnan(block.xi), np.nan, 0.0)
        under_end = beam.flexibility(size, block.u[-1], block.w[-2:], block.phi[-2:], block.slide[-1]) + lost
        yield block.beam, number, np.moveaxis(under_end, (0, 1), (-2, -1))
        yield number, block.beam, np.moveaxis(under_end, (1, 0), (-2, -1))  # by Maxwell's reciprocity
        for other_number, other in enumerate(beams.blocks, ends):
            if other.beam == block.beam:
                u, w, phi, slide = block.under(other)
                matrix = beam.flexibility(size, u[0], w, phi, slide[0]) + lost
                yield other_number, number, np.moveaxis(matrix, (0, 1), (-2, -1))


def _block_bent(beams: LoadedBeams, size: float) -> Reals:
    """Return the displacements of blocks due to distributed loads and free strain, (..., positions, blocks, 3)."""
    bent = [
        beams.single_beam(block.beam).displacement_under_loads(
            size, block.xi, block.u[:-1], block.w[:-2], block.phi[:-2], block.slide[:-1]
        )
        for block in beams.blocks
    ]
    return np.moveaxis(np.array(bent), (0, 1), (-2, -1))


def _solved(matrix: Reals, right: Reals, regular: Flags) -> Reals:
    """Solve the linear system at each position. The solution is nan where `regular` is False or no solution exists."""
    good = regular & np.isfinite(matrix).all(axis=(-2, -1)) & np.isfinite(right).all(axis=-1)
    solution = np.full_like(right, np.nan)
    try:
        solution[good] = np.linalg.solve(matrix[good], right[good][..., None])[..., 0]
    except np.linalg.LinAlgError:
        good[good] = np.linalg.slogdet(matrix[good])[0] != 0
        solution[good] = np.linalg.solve(matrix[good], right[good][..., None])[..., 0]
    return solution
