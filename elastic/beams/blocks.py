"""Loads of sliding blocks on beams, and the effect of these loads between each block and the end of its beam."""

from msgspec import Struct

from elastic.beams.compliance import BeamCompliance
from rigid.arrays import Columns, Complexes, Flags, Reals


class Block(Struct, frozen=True, eq=False):
    """Force and moment that a sliding block applies to a beam between its ends.

    Attributes
    ----------
    beam
        Index of the beam.
    xi
        Position of the block, shape (..., positions). If the block is on a collinear neighbour of the beam, `xi` is the
        nearer end of the beam (0 or 1). If the block is on neither of them, `xi` is nan.
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
        """Return the change in each field from the block to the end of the beam, in powers of xi - xi_block."""
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
    """Evaluate a polynomial of low degree, given by its coefficients, at the distance `way` from a block."""
    return sum(factor * way**power for power, factor in enumerate(powers))
