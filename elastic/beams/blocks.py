"""Force and moment of a sliding block on a beam, and their effect on the fields beyond it."""

from dataclasses import dataclass

from elastic.beams.compliance import BeamCompliance
from rigid.arrays import Columns, Complexes, Flags, Reals


@dataclass(frozen=True, eq=False)
class Block:
    """Force and moment on a beam between its ends.

    Attributes
    ----------
    beam
        Index of the beam.
    xi
        Position of the block, shape (..., positions); nan if the block is off the beam. If it is on a collinear
        neighbour, this is the nearer end of the beam.
    force, moment
        Load on the beam in beam axes [N], complex, and [N m].
    here
        True if the block is on this beam and not on a collinear neighbour, shape (..., positions) or scalar.
    """

    beam: int
    xi: Reals
    force: Complexes
    moment: Reals
    here: Flags | bool = True

    def beyond(self, compliance: BeamCompliance) -> dict[str, tuple[Columns, ...]]:
        """Return the jump of each field across the block, in powers of (xi - xi of the block)."""
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
    """Evaluate a polynomial of low degree at a distance."""
    return sum(factor * way**power for power, factor in enumerate(powers))
