"""Lengths, compliances and loads of all beams, which are scaled unit beams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic import Section
from fem_check.linear.block import BlockResponse
from fem_check.linear.frame import Frame
from fem_check.linear.loads import couples, distributed
from fem_check.linear.unit_beam import DEGREE, UnitBeam, unit_beam
from rigid import Motion
from rigid.arrays import Columns, Complexes, Reals
from rigid.kinematics import repeated, stacked


@dataclass(frozen=True, eq=False)
class LoadedBeams:
    """Lengths, directions, compliances and loads of all beams, in arrays of shape (beams, ..., positions).

    Attributes
    ----------
    length, axis
        Length [m], and unit vector of x' in ground axes.
    stretch, bend, shear, strain
        1/EA, 1/EI and 1/kGA at the start, and free strain.
    along, across
        Distributed loads at the stations of the unit beams [N/m]. `along` is q_x, shape (stations, beams, ...,
        positions). `across` is q_y, followed by the moments per length divided by the length of the beam, shape
        (2 stations, beams, ..., positions).
    units
        Unit beam of each beam.
    blocks
        Responses to the sliding blocks on beams.
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
        """Distinct unit beams, each with the indices of its beams, or a slice if there is only one."""
        units = {id(unit): unit for unit in self.units}
        if len(units) == 1:
            return [(self.units[0], slice(None))]
        return [(unit, [k for k, own in enumerate(self.units) if own is unit]) for unit in units.values()]

    def per_beam(self, values: Any) -> Reals:
        """Evaluate a function of the unit beam of each beam, shape (n, beams, 1, ...)."""
        found = {id(unit): values(unit) for unit in self.units}
        table = np.array([found[id(unit)] for unit in self.units])
        return np.moveaxis(table, 0, 1).reshape(*table.shape[1:], len(table), *[1] * (self.length.ndim - 1))

    def numbered(self, number: int) -> LoadedBeams:
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

    def coupling(self, size: float, u: Reals, w: Reals, phi: Reals, slide: Reals) -> Reals:
        """Return the flexibility of a beam at one of its points, scaled from the unit beam.

        Parameters
        ----------
        size
            Reference length for rotations and moments [m]. Rotations are multiplied and moments divided by it.
        u, w, phi, slide
            Values of a `UnitBeam` at the point: u under an axial force, w and phi under a transverse force and a
            moment, and slide under a transverse force.

        Returns
        -------
        Axial displacement, transverse displacement and rotation per axial force, transverse force and moment [m/N],
        shape (3, 3, ...).
        """
        matrix = np.zeros((3, 3, *self.length.shape))
        matrix[0, 0] = self.length * self.stretch * u
        reaches: tuple[Reals | float, ...] = (self.length, size)
        for k, reach in enumerate(reaches):
            matrix[1, 1 + k] = self.length**2 * reach * self.bend * w[k]
            matrix[2, 1 + k] = self.length * size * reach * self.bend * phi[k]
        matrix[1, 1] += self.length * self.shear * slide
        return matrix

    def bent(self, size: float, xi: Columns, u: Reals, w: Reals, phi: Reals, slide: Reals) -> Reals:
        """Return the displacement due to the distributed loads and the free strain [m], shape (3, ...)."""
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
