"""A load that moves along a beam: the block of a slider, and its part in the fields beyond it."""

from __future__ import annotations

from dataclasses import dataclass

from elastic.beams.compliance import Compliance
from rigid.arrays import Columns, Complexes, Flags, Reals


@dataclass(frozen=True, eq=False)
class Block:
    """A force and a moment on a beam between its ends.

    Attributes
    ----------
    beam
        Number of the beam.
    xi
        Where the block is, shape (..., positions); nan where it is beyond the beam, and the nearest end of the beam
        where it is on a next one in the same line.
    force, moment
        On the beam, in its own axes [N], complex, and [N m].
    here
        Whether it is on this beam and not on a next one, bool, shape (..., positions) or scalar.
    """

    beam: int
    xi: Reals
    force: Complexes
    moment: Reals
    here: Flags | bool = True

    def beyond(self, compliance: Compliance) -> dict[str, tuple[Columns, ...]]:
        """Increments of the fields beyond the block over those before it, in powers of xi less the block's."""
        length = compliance.length
        k, along, across, moment = self.beam, self.force.real, self.force.imag, self.moment
        bend, shear, stretch = (length[k] * row[k] for row in (compliance.bend, compliance.shear, compliance.stretch))
        slope = (0.0, -bend * moment, bend * length[k] * across / 2)
        return {
            "N": (-along,),
            "V": (across,),
            "M": (-moment, length[k] * across),
            "u": (0.0, -stretch * along),
            "phi": slope,
            "w": (0.0, -shear * across, length[k] * slope[1] / 2, length[k] * slope[2] / 3),
        }


def at(powers: tuple[Columns, ...], way: Reals) -> Reals:
    """A polynomial of few coefficients at a distance."""
    value: Reals = sum(factor * way**power for power, factor in enumerate(powers))
    return value
