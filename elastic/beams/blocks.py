"""Loads of sliding blocks on beams, and their effect on the fields beyond the blocks."""

from dataclasses import dataclass

from elastic.beams.compliance import BeamCompliance
from rigid.arrays import Columns, Complexes, Flags, Reals


@dataclass(frozen=True, eq=False)
class Block:
    """Force and moment that a sliding block applies to a beam between its ends.

    Attributes
    ----------
    beam
        Index of the beam.
    xi
        Position of the block, shape (..., positions). It is nan if the block is off the beam, and the nearer end of the
        beam if the block is on a collinear neighbour.
    force, moment
        Force in beam axes [N], complex, and moment [N m] on the beam.
    here
        True if the block is on this beam, and not on a collinear neighbour; shape (..., positions) or scalar.
    """

    beam: int
    xi: Reals
    force: Complexes
    moment: Reals
    here: Flags | bool = True

    def beyond(self, compliance: BeamCompliance) -> dict[str, tuple[Columns, ...]]:
        """Return the change of each field beyond the block, in powers of the distance xi - xi_block."""
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
    """Evaluate a polynomial of low degree, given by its coefficients, at a distance beyond a block."""
    return sum(factor * way**power for power, factor in enumerate(powers))
