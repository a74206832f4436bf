"""Natural frequencies of the mechanism with locked drives, by finite elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from elastic import JointCompliance, Section
from fem_check.linear.beams import over_designs
from fem_check.linear.frame import Frame, FramePlace
from fem_check.linear.solution import solve
from fem_check.linear.ties import Row, ties
from fem_check.vibration.body_matrices import one_of, vibrating_beam, vibrating_lumps
from rigid import SINGULAR, Motion, Reals
from rigid.arrays import Integers, Numbers

RANK_TOLERANCE = 1e-9  # singular value of a redundant constraint, relative to the largest
MASSLESS_SHARE = 1e-13  # mass per stiffness of a massless mode, relative to the largest


def natural_frequencies(
    motion: Motion,
    sections: Sequence[Section],
    elements: int = 8,
    count: int = 3,
    positions: Sequence[int] | None = None,
    joints: Mapping[str, JointCompliance] | None = None,
) -> Reals:
    """Lowest natural frequencies of small vibrations about the rigid links, drives locked.

    Beams have shear flexibility and, if area and second moment of the section are known, rotary inertia. Gravity, axial
    forces and accelerations of the motion are neglected.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`.
    elements
        Number of elements per beam.
    count
        Number of frequencies.
    positions
        Position numbers; default: all.
    joints
        Compliance of joints, by name.

    Returns
    -------
    [rad/s], increasing, shape (count, ..., positions); nan at singular positions and with a block beyond its beam,
    infinite without possible vibration.

    Raises
    ------
    ValueError
        The sections do not match the beams, there is no element, or a joint name is unknown.

    Examples
    --------
    A cantilever of 1 m with EI = 1 N m^2 and 1 kg/m: 1.8751^2 rad/s.

    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1})
    >>> natural_frequencies(motion(held, [0.0]), [Section(1e6, 1.0)], count=1).round(3)
    array([[3.516]])
    """
    if len(sections) != len(motion.mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(motion.mechanism.beams)} beams")
    if elements < 1:
        raise ValueError(f"{elements} elements: a beam takes one or more")
    motion = over_designs(motion, sections)
    chosen = np.arange(motion.columns[-1]) if positions is None else np.asarray(positions, int)
    frame = Frame(motion)
    flanks = solve(motion, sections, 1, joints).flanks if motion.mechanism.gears else {}
    held = [row for tie in ties(frame, joints or {}, flanks) for row in tie.rows]
    designs = motion.columns[:-1]
    omega = np.full((count, *designs, len(chosen)), np.nan)
    for design in np.ndindex(designs):
        good = motion.condition[design][chosen] <= SINGULAR
        for _, xi in frame.spots:
            good &= np.isfinite(np.broadcast_to(xi, motion.columns)[design][chosen])
        if good.any():
            structure = _Structure(frame, sections, elements, design, chosen[good])
            omega[(slice(None), *design, good)] = structure.frequencies(held, count)
    return omega


class _Structure:
    """All bodies of one design at some positions."""

    def __init__(
        self, frame: Frame, sections: Sequence[Section], elements: int, design: tuple[int, ...], positions: Integers
    ) -> None:
        self.frame, self.design, self.positions = frame, design, positions
        beams = frame.motion.mechanism.beams
        self.bodies = [
            vibrating_beam(self._length(k), beam, section, elements, self._blocks(k), design)
            for k, ((_, beam), section) in enumerate(zip(beams, sections, strict=True))
        ]
        self.bodies += [vibrating_lumps() for _ in frame.bodies[len(beams) :]]
        self.size = max((self._length(k) for k in range(len(beams))), default=1.0)
        self.first = np.cumsum([0, *(body.mass.shape[-1] for body in self.bodies)])
        self.stiffness, self.mass = np.zeros((2, len(positions), self.first[-1], self.first[-1]))
        for first, end, own in zip(self.first, self.first[1:], self.bodies, strict=False):
            self.stiffness[:, first:end, first:end] = own.stiffness
            self.mass[:, first:end, first:end] = own.mass
        self._add_lumps()

    def _length(self, beam: int) -> float:
        return abs(one_of(self.frame.bodies[beam].way, self.design))

    def _blocks(self, beam: int) -> list[Reals]:
        """xi of the blocks on a beam at the positions."""
        return [self._at(xi) for number, xi in self.frame.spots if number == beam and np.ndim(xi)]

    def _at(self, value: Any) -> Numbers:
        """Select a quantity of the motion for this design and its positions."""
        there: Numbers = np.broadcast_to(value, self.frame.motion.columns)[self.design][self.positions]
        return there

    def _axis(self, body: int) -> Any:
        """Unit vector of a body's x' axis in the axes of its link."""
        way = self.frame.bodies[body].way
        return 1.0 if way is None else one_of(way, self.design) / abs(one_of(way, self.design))

    def _add_lumps(self) -> None:
        for at, link in enumerate(self.frame.motion.mechanism.links):
            for lump in link.lumps if at else ():
                place = self.frame.place(at, lump.point)
                if place is None:
                    continue
                local = one_of(lump.offset, self.design)
                if not link.beams:
                    local += one_of(link.points[lump.point], self.design)
                local *= np.conj(self._axis(place.body))
                along, across, turned = self._moves(place)[:, 0]
                along, across = along - local.imag * turned, across + local.real * turned
                mass, inertia = one_of(lump.mass, self.design).real, one_of(lump.inertia, self.design).real
                self.mass += mass * (np.outer(along, along) + np.outer(across, across))
                self.mass += inertia * np.outer(turned, turned)

    def _moves(self, place: FramePlace) -> Reals:
        """Displacement and rotation of a place per coordinate, (3, positions or 1, coordinates)."""
        body = self.bodies[place.body]
        xi = 0.0 if place.spot is None else self.frame.spots[place.spot][1]
        x = body.nodes[:, -1] * (self._at(xi) if np.ndim(xi) else xi)
        moved = body.moves(x)
        rows = np.zeros((3, len(x), self.mass.shape[-1]))
        first = self.first[place.body]
        rows[..., first : first + moved.shape[2]] = moved
        return rows

    def _row(self, row: Row) -> Reals:
        """Constraint row per coordinate, shape (positions, coordinates)."""
        total = np.zeros(self.mass.shape[:2])
        for place, force, moment in row.parts:
            if place is None:
                continue
            along, across, turned = self._moves(place)
            axis = self._at(self.frame.motion.direction[self.frame.bodies[place.body].link]) * self._axis(place.body)
            pull = self._at(np.conj(force)) * axis
            twist = self._at(np.conj(force) * 1j * place.arm + moment).real
            total += pull.real[:, None] * along - pull.imag[:, None] * across + twist[:, None] * turned
        return total

    def frequencies(self, rows: Sequence[Row], count: int) -> Reals:
        """Lowest natural frequencies [rad/s], shape (count, positions)."""
        held = [np.zeros((len(self.positions), 0, self.mass.shape[-1]))]
        stiffness = self.stiffness.copy()
        for row in rows:
            moved = self._row(row)
            if row.soft:
                stiffness += moved[:, :, None] * moved[:, None, :] / row.soft
            else:
                held.append((moved * (self.size if row.turns else 1.0))[:, None])
        conditions = np.concatenate(held, axis=1)
        omega = np.full((count, len(self.positions)), np.inf)
        _, values, basis = np.linalg.svd(conditions)
        ranks = (values > RANK_TOLERANCE * values.max(axis=-1, initial=0.0, keepdims=True)).sum(axis=-1)
        for rank in np.unique(ranks):
            where = np.flatnonzero(ranks == rank)
            free = basis[where, rank:]
            if free.shape[1]:
                turned = free.swapaxes(-1, -2)
                omega[:, where] = _lowest(free @ stiffness[where] @ turned, free @ self.mass[where] @ turned, count)
        return omega


def _lowest(stiffness: Reals, mass: Reals, count: int) -> Reals:
    """Lowest frequencies from the largest mass per stiffness, robust to massless modes."""
    scale = 1.0 / np.sqrt(np.diagonal(stiffness, axis1=-2, axis2=-1))
    root = np.linalg.cholesky(stiffness * scale[:, :, None] * scale[:, None, :])
    left = np.linalg.solve(root, mass * scale[:, :, None] * scale[:, None, :])
    both = np.linalg.solve(root, left.swapaxes(-1, -2))
    softest = np.linalg.eigvalsh((both + both.swapaxes(-1, -2)) / 2)[:, ::-1].T[:count]
    omega = np.full((count, len(stiffness)), np.inf)
    moving = softest > MASSLESS_SHARE * np.maximum(softest[:1], 0.0)
    omega[: len(softest)] = np.where(moving, 1.0 / np.sqrt(np.where(moving, softest, 1.0)), np.inf)
    return omega
