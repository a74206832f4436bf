"""The whole mechanism as one frame of finite elements, at every position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Section
from fem_check.equilibrium import Beams, balanced, beams_of, wrenches_of
from fem_check.frame import Frame, Tie
from fem_check.unit_beam import STATIONS, unit_beam
from rigid import GROUND, Mechanism, MechanismError, Motion, Reals


@dataclass(frozen=True, eq=False)
class TieForce:
    """What a weld, joint or drive does to its child.

    `force` [N], complex, and `moment` about the point where they meet [N m], shape (..., positions).
    """

    name: str
    force: Any
    moment: Any


@dataclass(frozen=True, eq=False)
class Solution:
    """Answer of the finite elements.

    Attributes
    ----------
    motion, sections, elements
        What was asked; `elements` to every beam.
    xi
        Nodes of every beam, x'/l, shape (elements + 1,).
    N, V, M
        Axial force (tension positive) [N], shear force [N] and bending moment [N m] at the nodes, from the end forces
        of the elements, shape (beams, ..., positions, nodes), beams in the order of `Mechanism.beams`.
    u, w, phi
        Longitudinal and transverse displacement [m] and slope [rad] from the rigid position, in the beam's own axes.
    ties
        Forces in welds, pins, sliders and drives.
    efforts
        Moment [N m] or force [N] of every drive along its coordinate, shape (drives, ..., positions).
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


def solve(motion: Motion, sections: Sequence[Section], elements: int = 16) -> Solution:
    """Section forces and displacements of all beams at all positions by finite elements.

    Hermite elements across and quadratic ones along every beam, welds and joints as constraints, drives locked. Loads
    and statics are found anew from the motion; statically indeterminate mechanisms come out as any other.

    Parameters
    ----------
    motion
        Of a mechanism whose links are beams, or rigid where they have none.
    sections
        One per beam, in the order of `Mechanism.beams`; infinite rigidities are rigid.
    elements
        To every beam.

    Returns
    -------
    Solution, nan at singular positions.

    Raises
    ------
    ValueError
        The sections are not one per beam, or there is no element.
    MechanismError
        The beams of a link do not hang together or do not reach a point that carries something; or what there are no
        elements for: shear, taper, a mass of high degree, a slider on beams.

    Examples
    --------
    A cantilever of 2 m under 12 N at its end: F l^3/3EI = 32 mm.

    >>> from rigid import Beam, Link, Mechanism, PinDrive, PointLoad, motion
    >>> arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A"),))
    >>> ground, hung = Link("ground", {"O": 0}), PointLoad("arm", "A", 12j)
    >>> held = Mechanism((ground, arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2}, loads=(hung,))
    >>> solve(motion(held, [0.0]), [Section(EA=1e6, EI=1e3)]).w[0, 0, -1].round(12)
    np.float64(0.032)
    """
    _refuse(motion.mechanism, sections)
    unit = unit_beam(elements)
    frame = Frame(motion)
    ties = list(frame.ties())
    with np.errstate(invalid="ignore", over="ignore"):
        beams = beams_of(frame, sections, unit)
        wrenches = wrenches_of(frame, ties, beams)
        multipliers, carried = balanced(motion, beams, wrenches)
        tip = wrenches.tip[..., -1, :, :] + np.einsum("...r,...rki->...ki", multipliers, wrenches.tip[..., :-1, :, :])
        tip[..., 2] *= wrenches.size
        N, V, M, u, w, phi = _fields(beams, *(np.moveaxis(values, (-2, -1), (1, 0)) for values in (tip, carried)))
    forces, efforts = _tie_forces(motion, ties, np.moveaxis(multipliers, -1, 0), wrenches.size)
    return Solution(motion, tuple(sections), elements, unit.xi, N, V, M, u, w, phi, forces, efforts)


def _refuse(mechanism: Mechanism, sections: Sequence[Section]) -> None:
    """Raise rather than answer another question than was asked."""
    if len(sections) != len(mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(mechanism.beams)} beams")
    for (at, beam), section in zip(mechanism.beams, sections, strict=True):
        where = f'beam "{beam.start}"-"{beam.end}" of "{mechanism.links[at].name}"'
        if np.any(np.isfinite(section.kGA)):
            raise MechanismError(f"{where}: the finite element check has no elements with shear")
        if len(beam.mass_taper) > len(STATIONS) - 1:
            raise MechanismError(
                f"{where}: its mass per length is of degree {len(beam.mass_taper) - 1}, the finite element check "
                f"carries up to degree {len(STATIONS) - 2}"
            )
        if section.taper is not None:
            raise MechanismError(f"{where}: the finite element check has no tapered elements")
    for slider in mechanism.sliders:
        if slider.on != GROUND and mechanism.links[mechanism.index[slider.on]].beams:
            raise MechanismError(
                f'slider "{slider.name}": the finite element check has no contact that moves along the beams of '
                f'"{slider.on}"'
            )


def _fields(beams: Beams, tip: Any, carried: Any) -> tuple[Reals, ...]:
    """N, V, M, u, w, phi at the nodes: unit responses times their loads, and the motion of the beam's axes.

    Parameters
    ----------
    tip
        Force and moment at the beams' far ends, shape (3, beams, ..., positions).
    carried
        Displacement, in the ground's axes, and rotation of the bodies, shape (3, bodies, ..., positions).
    """
    unit, length = beams.unit, beams.length
    along = np.moveaxis(np.concatenate((length * beams.load.real, tip[:1])), 0, -1)
    across = np.moveaxis(np.concatenate((length**2 * beams.load.imag, [length * tip[1], tip[2]])), 0, -1)
    move = np.conj(beams.axis) * (carried[0, : len(length)] + 1j * carried[1, : len(length)])
    turn = carried[2, : len(length)]
    N, V, M = along @ unit.N, (across / length[..., None]) @ unit.V, across @ unit.M
    u = (along * (length * beams.stretch)[..., None]) @ unit.u
    u += move.real[..., None] + (length * beams.strain)[..., None] * unit.xi
    w = (across * (length**2 * beams.bend)[..., None]) @ unit.w
    w += move.imag[..., None] + (length * turn)[..., None] * unit.xi
    phi = (across * (length * beams.bend)[..., None]) @ unit.phi
    phi += turn[..., None]
    return N, V, M, u, w, phi


def _tie_forces(
    motion: Motion, ties: Sequence[Tie], multipliers: Any, size: float
) -> tuple[tuple[TieForce, ...], Reals]:
    """Multipliers gathered to forces and moments, and the drives' efforts."""
    forces, number = [], 0
    efforts = np.full((len(motion.mechanism.drives), *motion.columns), np.nan)
    for tie in ties:
        values = multipliers[number : number + len(tie.rows)]
        force = sum(value * row[0] for value, row in zip(values, tie.rows, strict=True))
        moment = sum(value * row[1] * size for value, row in zip(values, tie.rows, strict=True))
        forces.append(TieForce(tie.name, force, moment))
        if tie.drive is not None:
            efforts[tie.drive] = values[0] * (size if tie.rows[0][1] else 1.0)
        number += len(tie.rows)
    return tuple(forces), efforts
