"""Equilibrium and closure of the frame: what the ties carry and how the bodies are displaced, at every position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Section
from fem_check.frame import Frame, Place, Tie
from fem_check.loads import concentrated, distributed
from fem_check.unit_beam import STATIONS, UnitBeam
from rigid import SINGULAR, Motion, cross, stacked


@dataclass(frozen=True, eq=False)
class Beams:
    """Of all beams: length [m], unit vector of x', 1/EA, 1/EI and free strain, each of shape (beams, ..., positions).

    `load` q_x + i q_y [N/m] at `STATIONS`, shape (stations, beams, ..., positions); `unit` what all are multiples of.
    """

    length: Any
    axis: Any
    stretch: Any
    bend: Any
    strain: Any
    load: Any
    unit: UnitBeam


@dataclass(frozen=True, eq=False)
class Wrenches:
    """What a unit of every row, and last what the loads, do to the bodies: force [N] and moment over `size` [N].

    `total` about the start of every body in the ground's axes, shape (..., positions, rows + 1, bodies, 3); `tip` the
    part that acts at the far end of the beams, in their own axes, shape (..., positions, rows + 1, beams, 3).
    """

    total: Any
    tip: Any
    size: float


def beams_of(frame: Frame, sections: Sequence[Section], unit: UnitBeam) -> Beams:
    """Size, direction, compliance and load of all beams."""
    columns = frame.motion.columns
    bodies = frame.bodies[: len(sections)]
    length = stacked([np.abs(body.way) for body in bodies], columns, float)
    way = stacked([body.way for body in bodies], columns, complex)
    axis = frame.motion.direction[[body.link for body in bodies]] * (way / length)
    stretch = stacked([1.0 / np.asarray(section.EA, float) for section in sections], columns, float)
    bend = stacked([1.0 / np.asarray(section.EI, float) for section in sections], columns, float)
    strain = stacked([section.strain for section in sections], columns, float)
    return Beams(length, axis, stretch, bend, strain, distributed(frame, STATIONS), unit)


def wrenches_of(frame: Frame, ties: Sequence[Tie], beams: Beams) -> Wrenches:
    """Of every row of the ties, and of all loads, on the bodies."""
    rows = sum(len(tie.rows) for tie in ties)
    columns = frame.motion.columns
    total = np.zeros((*columns, rows + 1, len(frame.bodies), 3))
    tip = np.zeros((*columns, rows + 1, len(beams.length), 3))
    size = float(np.max(beams.length, initial=0.0)) or 1.0

    def put(row: int, place: Place | None, force: Any, moment: Any) -> None:
        if place is None:
            return
        k = place.body
        moment = moment + cross(place.arm, force)
        if place.tip:
            own = np.conj(beams.axis[k]) * force
            for i, part in enumerate((own.real, own.imag, moment / size)):
                tip[..., row, k, i] += part
            moment = moment + beams.length[k] * own.imag
        for i, part in enumerate((np.real(force), np.imag(force), moment / size)):
            total[..., row, k, i] += part

    number = 0
    for tie in ties:
        for force, moment in tie.rows:
            put(number, tie.child, force, moment * size)
            put(number, tie.parent, -force, -moment * size)
            number += 1
    for place, force, moment in concentrated(frame):
        put(rows, place, force, moment)
    pull, turn = _resultants(beams)
    for i, part in enumerate((pull.real, pull.imag, turn / size)):
        total[..., rows, : len(beams.length), i] += np.moveaxis(part, 0, -1)
    return Wrenches(total, tip, size)


def _resultants(beams: Beams) -> tuple[Any, Any]:
    """Of the distributed loads, about the starts of the beams: force in the ground's axes and moment."""
    unit, q = beams.unit, beams.load
    along = np.tensordot(unit.N[:-1, 0], q.real, 1)
    across = np.tensordot(-unit.V[:-2, 0], q.imag, 1)
    turn = np.tensordot(unit.M[:-2, 0], q.imag, 1)
    return beams.axis * beams.length * (along + 1j * across), beams.length**2 * turn


def balanced(motion: Motion, beams: Beams, wrenches: Wrenches) -> tuple[Any, Any]:
    """Multipliers of all rows, and displacement and rotation of all bodies, that close and balance the frame.

    Returns
    -------
    Shapes (..., positions, rows) [N, moments over the size] and (..., positions, bodies, 3) [m, rad].
    """
    total, tip, size = wrenches.total, wrenches.tip, wrenches.size
    compliance, bent = _tips(beams, size)
    unit = float(np.max(compliance, initial=0.0)) or 1.0
    rows, freedoms = total.shape[-3] - 1, total.shape[-2] * 3
    flexed = np.einsum("...rki,...kij->...rkj", tip, compliance / unit).reshape(*motion.columns, rows + 1, -1)
    flat = tip.reshape(flexed.shape)
    gaps = flexed @ np.swapaxes(flat[..., :-1, :], -1, -2)
    gaps[..., -1, :] += np.einsum("...rk,...k->...r", flat[..., :-1, :], bent.reshape(*motion.columns, -1) / unit)
    matrix = np.zeros((*motion.columns, rows + freedoms, rows + freedoms))
    known = total.reshape(*motion.columns, rows + 1, freedoms)
    matrix[..., :rows, :rows] = gaps[..., :-1, :]
    matrix[..., :rows, rows:] = known[..., :-1, :]
    matrix[..., rows:, :rows] = np.swapaxes(known[..., :-1, :], -1, -2)
    right = -np.concatenate((gaps[..., -1, :], known[..., -1, :]), axis=-1)
    found = _solved(matrix, right, motion.condition <= SINGULAR)
    carried = found[..., rows:].reshape(*motion.columns, -1, 3) * unit
    carried[..., 2] /= size
    return found[..., :rows], carried


def _tips(beams: Beams, size: float) -> tuple[Any, Any]:
    """Compliance of the beams' ends and what their distributed loads and free strain do there.

    Returns
    -------
    Shapes (..., positions, beams, 3, 3) [m/N] and (..., positions, beams, 3) [m]; rotations are times `size` and
    moments over it.
    """
    unit, length = beams.unit, beams.length
    matrix = np.zeros((3, 3, *length.shape))
    matrix[0, 0] = length * beams.stretch * unit.u[-1, -1]
    for k, reach in enumerate((length, size)):
        matrix[1, 1 + k] = length**2 * reach * beams.bend * unit.w[k - 2, -1]
        matrix[2, 1 + k] = length * size * reach * beams.bend * unit.phi[k - 2, -1]
    bent = np.empty((3, *length.shape))
    bent[0] = length**2 * beams.stretch * np.tensordot(unit.u[:-1, -1], beams.load.real, 1) + length * beams.strain
    bent[1] = length**4 * beams.bend * np.tensordot(unit.w[:-2, -1], beams.load.imag, 1)
    bent[2] = length**3 * size * beams.bend * np.tensordot(unit.phi[:-2, -1], beams.load.imag, 1)
    return np.moveaxis(matrix, (2, 0, 1), (-3, -2, -1)), np.moveaxis(bent, (1, 0), (-2, -1))


def _solved(matrix: Any, right: Any, regular: Any) -> Any:
    """Solutions, nan where a position is singular."""
    good = regular & np.isfinite(matrix).all(axis=(-2, -1)) & np.isfinite(right).all(axis=-1)
    found = np.full_like(right, np.nan)
    try:
        found[good] = np.linalg.solve(matrix[good], right[good][..., None])[..., 0]
    except np.linalg.LinAlgError:
        good[good] = np.linalg.slogdet(matrix[good])[0] != 0
        found[good] = np.linalg.solve(matrix[good], right[good][..., None])[..., 0]
    return found
