"""Lengths, compliances and loads of all beams. The responses of a beam are scaled responses of a unit beam."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import Section
from fem_check.linear.block import BlockResponse
from fem_check.linear.frame import Frame
from fem_check.linear.loads import couples, distributed
from fem_check.linear.unit_beam import DEGREE, UnitBeam, unit_beam
from rigid import Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.kinematics import repeated, stacked


class LoadedBeams(Struct, frozen=True, eq=False, dict=True):
    """Lengths, directions, compliances and loads of all beams, in arrays of shape (beams, ..., positions).

    Attributes
    ----------
    length
        Length [m].
    axis
        Unit vector of x' in ground axes (complex).
    stretch, bend, shear
        1/EA, 1/EI and 1/kGA at the start of the beam.
    strain
        Strain without load.
    along
        Axial load per length q_x at the stations of the unit beams [N/m], shape (stations, beams, ..., positions).
    across
        Transverse load per length q_y at the stations [N/m], followed by the moments per unit length divided by the
        length of the beam [N/m], shape (2 stations, beams, ..., positions).
    units
        Unit beam of each beam.
    blocks
        Responses of beams to the sliding blocks on them.
    """

    length: Reals
    axis: Complexes
    stretch: Reals
    bend: Reals
    shear: Reals
    strain: Reals
    along: Reals
    across: Reals
    units: tuple[UnitBeam, ...]
    blocks: tuple[BlockResponse, ...]

    @cached_property
    def kinds(self) -> list[tuple[UnitBeam, Any]]:
        """Distinct unit beams, each with the indices of its beams (a slice if there is only one unit beam)."""
        units = {id(unit): unit for unit in self.units}
        if len(units) == 1:
            return [(self.units[0], slice(None))]
        return [(unit, [k for k, own in enumerate(self.units) if own is unit]) for unit in units.values()]

    def per_beam(self, values: Any) -> Reals:
        """Evaluate a function of a unit beam for each beam, shape (n, beams, 1, ...).

        The function returns an array of shape (n,).
        """
        found = {id(unit): values(unit) for unit in self.units}
        table = np.array([found[id(unit)] for unit in self.units])
        return np.moveaxis(table, 0, 1).reshape(*table.shape[1:], len(table), *[1] * (self.length.ndim - 1))

    def single_beam(self, number: int) -> LoadedBeams:
        """Select one beam, with arrays of shape (..., positions)."""
        rows = ("length", "axis", "stretch", "bend", "shear", "strain")
        own = {name: getattr(self, name)[number] for name in rows}
        return replace(
            self,
            **own,
            along=self.along[:, number],
            across=self.across[:, number],
            units=(self.units[number],),
            blocks=(),
        )

    def flexibility(self, size: float, u: Reals, w: Reals, phi: Reals, slide: Reals) -> Reals:
        """Return displacements of a beam under unit loads, scaled from the unit beam.

        The point of the displacements and the point of the loads follow from the arguments `u`, `w`, `phi`, `slide`.

        Parameters
        ----------
        size
            Reference length [m]. Rotations are multiplied by it, and moments are divided by it.
        u
            Displacement of the unit beam under an axial force.
        w, phi
            Deflection and rotation of the unit beam under a transverse force and under a moment, each of shape (2,
            ...).
        slide
            Deflection of the unit beam due to shear under a transverse force.

        Returns
        -------
        Flexibility matrices [m/N], shape (3, 3, ...). The rows are axial displacement, transverse displacement and
        rotation. The columns are axial force, transverse force and moment.
        """
        matrix = np.zeros((3, 3, *self.length.shape))
        matrix[0, 0] = self.length * self.stretch * u
        reaches: tuple[Reals | float, ...] = (self.length, size)
        for k, reach in enumerate(reaches):
            matrix[1, 1 + k] = self.length**2 * reach * self.bend * w[k]
            matrix[2, 1 + k] = self.length * size * reach * self.bend * phi[k]
        matrix[1, 1] += self.length * self.shear * slide
        return matrix

    def displacement_under_loads(self, size: float, xi: Columns, u: Reals, w: Reals, phi: Reals, slide: Reals) -> Reals:
        """Return the displacement at `xi` due to the distributed loads and the free strain [m], shape (3, ...).

        The first axis is the axial displacement, the transverse displacement and the rotation times `size`. `u`, `w`,
        `phi` and `slide` are the values of the unit beam at `xi` under its distributed loads.
        """
        along, across = self.along, self.across
        displacement = np.empty((3, *self.length.shape))
        displacement[0] = self.length**2 * self.stretch * _sum(u, along) + self.length * self.strain * xi
        displacement[1] = self.length**4 * self.bend * _sum(w, across) + self.length**2 * self.shear * _sum(
            slide, across
        )
        displacement[2] = self.length**3 * size * self.bend * _sum(phi, across)
        return displacement


def _sum(unit: Reals, load: Reals) -> Reals:
    return sum(value * each for value, each in zip(unit, load, strict=True))


def over_designs(motion: Motion, sections: Sequence[Section]) -> Motion:
    """Repeat the motion for every design of the sections."""
    properties = [np.shape(value) for part in sections for value in (part.EA, part.EI, part.kGA, part.strain)]
    columns = np.broadcast_shapes(motion.columns, *properties)
    return motion if columns == motion.columns else repeated(motion, columns)


def beams_of(frame: Frame, sections: Sequence[Section], elements: int) -> LoadedBeams:
    """Compute the length, direction, compliance and loads of all beams."""
    motion, columns = frame.motion, frame.motion.columns
    bodies = frame.bodies[: len(sections)]
    tapers = (taper for _, beam in motion.mechanism.beams for taper in (beam.mass_taper, beam.rotary_taper))
    degree = max([DEGREE, *map(len, tapers)])
    units = tuple(unit_beam(elements, degree, section.taper) for section in sections)
    length = stacked([np.abs(body.way) for body in bodies], columns, float)
    vector = stacked([body.way for body in bodies], columns, complex)
    stations = unit_beam(elements, degree).stations
    load = distributed(frame, stations)
    stretch, bend, shear = (
        stacked([1.0 / np.asarray(getattr(section, name), float) for section in sections], columns, float)
        for name in ("EA", "EI", "kGA")
    )
    return LoadedBeams(
        length=length,
        axis=motion.direction[[body.link for body in bodies]] * (vector / length),
        stretch=stretch,
        bend=bend,
        shear=shear,
        strain=stacked([section.strain for section in sections], columns, float),
        along=load.real,
        across=np.concatenate((load.imag, couples(frame, stations) / length)),
        units=units,
        blocks=tuple(
            BlockResponse(k, np.broadcast_to(xi, columns), units[k]) for k, xi in frame.spots[len(sections) :]
        ),
    )
