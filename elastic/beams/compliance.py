"""What turns section forces into displacements: the reciprocals of the beams' rigidities, for all designs at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from elastic.beams.section import Section
from elastic.beams.taper import taper_functions
from rigid.constants import per_row


@dataclass(frozen=True, eq=False)
class Compliance:
    """Compliances of all beams; rows of shape (beams, ..., 1).

    Attributes
    ----------
    stretch, bend, shear
        1/EA, 1/EI, 1/kGA at the start.
    strain, tapered
        Free strain; whether the rigidities change along the beam.
    ends
        By how much less or more than a prismatic beam's every power contributes to u(1), phi(1), w(1) by bending and
        w(1) by shear, four arrays of shape (powers, beams, 1); None where all beams are prismatic.
    """

    stretch: Any
    bend: Any
    shear: Any
    strain: Any
    tapered: Any
    ends: tuple[Any, Any, Any, Any] | None

    @cached_property
    def sheared(self) -> bool:
        """Whether any beam gives way to shear."""
        return bool(self.shear.any())

    @cached_property
    def strained(self) -> bool:
        """Whether any beam has free strain."""
        return bool(self.strain.any())

    @property
    def unstrained(self) -> Compliance:
        """The same beams without free strain."""
        return replace(self, strain=np.zeros_like(self.strain))


@lru_cache(maxsize=64)
def compliance_of(sections: tuple[Section, ...], ndim: int, powers: int) -> Compliance:
    """Compliances of beams, for columns of `ndim` axes and bending moments of so many powers of xi."""
    rows = [
        per_row([1.0 / np.asarray(value, float) for value in values], ndim, float)
        for values in zip(*((section.EA, section.EI, section.kGA) for section in sections), strict=True)
    ] or [np.zeros((0,) + (1,) * ndim)] * 3
    strain = per_row([section.strain for section in sections], ndim, float)
    ends = None
    if any(section.taper for section in sections):
        table = np.array([[part[:, 0] for part in taper_functions(section, (1.0,), powers)] for section in sections])
        ends = tuple(np.moveaxis(table, 0, -1)[k].reshape(powers, -1, *(1,) * ndim) for k in range(4))
    tapered = per_row([bool(section.taper) for section in sections], ndim, bool)
    return Compliance(rows[0], rows[1], rows[2], strain, tapered, ends)


@lru_cache(maxsize=64)
def designs_of(sections: tuple[Section, ...]) -> tuple[int, ...]:
    """Shape of the sections' properties: () or (designs, 1)."""
    values = [value for part in sections for value in (part.EA, part.EI, part.kGA, part.strain)]
    return np.broadcast_shapes(*(np.shape(value) for value in values))
