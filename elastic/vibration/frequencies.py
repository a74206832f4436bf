"""Natural frequencies of a mechanism at each position, with locked drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import trees_of
from elastic.links.sliding_blocks import block_places
from elastic.vibration.mechanism_matrices import VibratingStructure
from rigid import SINGULAR, Motion, Reals
from rigid.arrays import Integers
from rigid.kinematics import repeated

TOLERANCE = 1e-3  # accepted relative error of a frequency
ERROR_PER_CHANGE = 0.1  # bound on (error after a refinement / change by it); 50 mechanisms had at most 0.05
REFINEMENTS = (1, 3, 5, 7, 9, 12)  # number of inner polynomials per beam and direction in successive refinements
ASSEMBLED = (5, 7, 12)  # numbers for which matrices are assembled; those for smaller numbers are submatrices


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Lowest natural frequencies at selected positions of a motion.

    Attributes
    ----------
    omega
        Natural frequencies in ascending order [rad/s], shape (modes, ..., positions). They are nan at singular
        positions, and inf if there are fewer modes.
    position
        Indices of the selected positions.
    change
        Largest relative change of a frequency in the last refinement.
    """

    omega: Reals
    position: Integers
    change: float

    @property
    def lowest(self) -> float:
        """Lowest frequency over all positions [rad/s]; nan if all positions are singular."""
        known = self.omega[0][~np.isnan(self.omega[0])]
        return float(known.min()) if known.size else float("nan")


def natural_frequencies(
    motion: Motion,
    sections: Sequence[Section],
    modes: int = 3,
    positions: int = 24,
    joints: Mapping[str, JointCompliance] | None = None,
    settled: float = TOLERANCE,
    designs: int | None = None,
) -> Frequencies:
    """Compute the lowest natural frequencies of small vibrations about the rigid motion, with locked drives.

    The beams are refined until the relative error of the frequencies is less than `settled`. The stiffness does not
    include the effects of gravity, axial forces, springs and accelerations.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`.
    modes
        Number of frequencies to compute.
    positions
        Number of positions, evenly selected from the motion.
    joints
        Compliant joints by name.
    settled
        Accepted relative error of the frequencies, estimated from their change in the last refinement.
    designs
        Number of designs to compute, starting with the first; by default all.

    Examples
    --------
    The lowest frequency of a cantilever of 1 m with EI = 1 N m^2 and 1 kg/m is 1.8751^2 rad/s:

    >>> from elastic import Section
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1})
    >>> round(natural_frequencies(motion(held, [0.0]), [Section(1e6, 1.0)]).lowest, 4)
    3.516
    """
    axis = designs_of(tuple(sections))
    if axis:
        motion = repeated(motion, np.broadcast_shapes(motion.columns, axis))
    count = motion.columns[-1]
    chosen = np.linspace(0, count - 1, min(positions, count)).round().astype(int)
    rows = range(motion.columns[0] if len(motion.columns) > 1 else 1)[:designs]
    found = [_design_frequencies(motion, sections, modes, chosen, joints or {}, row, settled) for row in rows]
    omega = np.stack([values for values, _ in found], axis=1)
    return Frequencies(omega if len(motion.columns) > 1 else omega[:, 0], chosen, max(change for _, change in found))


def _design_frequencies(
    motion: Motion,
    sections: Sequence[Section],
    modes: int,
    chosen: Integers,
    joints: Mapping[str, JointCompliance],
    design: int,
    settled: float,
) -> tuple[Reals, float]:
    """Return the frequencies of one design, shape (modes, positions), and their change in the last refinement."""
    condition = np.atleast_2d(motion.condition)[design, chosen]
    carried = np.ones(len(chosen), bool)
    for first, *_ in block_places(motion, trees_of(motion.mechanism)).values():
        carried &= np.isfinite(np.atleast_2d(np.broadcast_to(first.xi, motion.columns))[design, chosen])
    good = np.flatnonzero((condition <= SINGULAR) & carried)
    omega = np.full((modes, len(chosen)), np.nan)
    if not len(good):
        return omega, 0.0
    before, change = np.full((modes, len(good)), np.inf), np.inf
    built, structure = 0, None
    for inner in REFINEMENTS:
        if structure is None or inner > built:
            built = next((size for size in ASSEMBLED if size >= inner), inner)
            structure = VibratingStructure(motion, sections, joints, chosen[good], design, built)
        now = structure.frequencies(modes, inner)
        moving = np.isfinite(now)
        if np.isfinite(before[moving]).all():
            change = float(np.max(before[moving] / now[moving] - 1, initial=0.0))
        before = now
        if ERROR_PER_CHANGE * change < settled:
            break
    omega[:, good] = before
    return omega, change
