"""Flexibilities of the beams (reciprocals of the rigidities), for all designs at once."""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.arrays import Coefficients, PerBeam
from elastic.beams.section import Section
from elastic.beams.taper import taper_functions
from rigid import Mechanism
from rigid.arrays import Flags
from rigid.constants import beam_constants, per_row

Ends = tuple[Coefficients, Coefficients, Coefficients, Coefficients]
"""Values of `taper_functions` at the ends of the beams."""


class BeamCompliance(Struct, frozen=True, eq=False, dict=True):
    """Flexibilities of all beams, in arrays of shape (beams, ..., 1).

    Attributes
    ----------
    length
        Lengths [m].
    stretch, bend, shear
        1/EA, 1/EI and 1/kGA at the start of the beam.
    strain, tapered
        Free strain, and a flag that is True if the rigidities vary along the beam.
    ends
        Values of the four `taper_functions` at the end of each beam (xi = 1), each of shape (powers, beams, 1). They
        are 1 for a prismatic beam. None if all beams are prismatic.
    powers
        Number of coefficients of the bending moment as a polynomial in xi.
    """

    length: PerBeam
    stretch: PerBeam
    bend: PerBeam
    shear: PerBeam
    strain: PerBeam
    tapered: Flags
    ends: Ends | None
    powers: int

    @cached_property
    def sheared(self) -> bool:
        """True if any beam deforms in shear."""
        return bool(self.shear.any())

    @cached_property
    def strained(self) -> bool:
        """True if any beam has free strain."""
        return bool(self.strain.any())

    @cached_property
    def integrals(self) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
        """Factors for integrating powers of xi along the beams, each of shape (powers + 1, beams, ..., 1).

        Multiply the coefficients of a polynomial by the first array to integrate the polynomial itself, those of N by
        the second array to integrate N/EA, those of M by the third array to integrate M/EI, and those of V by the
        fourth array to integrate -V/kGA.
        """
        power = np.arange(1.0, self.powers + 2).reshape(-1, *[1] * self.length.ndim)
        alone, stretch, bend, shear = (
            self.length * each / power for each in (1.0, self.stretch, self.bend, -self.shear)
        )
        return alone, stretch, bend, shear

    @property
    def unstrained(self) -> BeamCompliance:
        """Flexibilities of the same beams without free strain."""
        return replace(self, strain=np.zeros_like(self.strain))


@lru_cache(maxsize=64)
def compliance_of(mechanism: Mechanism, sections: tuple[Section, ...], ndim: int, powers: int) -> BeamCompliance:
    """Return the flexibilities for columns with `ndim` axes, and for bending moments with `powers` coefficients."""
    return BeamCompliance(beam_constants(mechanism, ndim).length, *_flexibilities_of(sections, ndim, powers), powers)


@lru_cache(maxsize=64)
def _flexibilities_of(
    sections: tuple[Section, ...], ndim: int, powers: int
) -> tuple[PerBeam, PerBeam, PerBeam, PerBeam, Flags, Ends | None]:
    """Return the attributes of `BeamCompliance` that depend on the sections but not on the lengths."""
    stretch, bend, shear = [
        per_row([1.0 / np.asarray(value, float) for value in values], ndim, float)
        for values in zip(*((section.EA, section.EI, section.kGA) for section in sections), strict=True)
    ] or [np.zeros((0,) + (1,) * ndim)] * 3
    strain = per_row([section.strain for section in sections], ndim, float)
    ends = None
    if any(section.taper for section in sections):
        table = np.array([[part[:, 0] for part in taper_functions(section, (1.0,), powers)] for section in sections])
        ends = tuple(np.moveaxis(table, 0, -1)[k].reshape(powers, -1, *(1,) * ndim) for k in range(4))
    return stretch, bend, shear, strain, per_row([bool(section.taper) for section in sections], ndim, bool), ends


@lru_cache(maxsize=64)
def designs_of(sections: tuple[Section, ...]) -> tuple[int, ...]:
    """Return the shape of the section properties: () or (designs, 1)."""
    values = [value for part in sections for value in (part.EA, part.EI, part.kGA, part.strain)]
    return np.broadcast_shapes(*(np.shape(value) for value in values))
