"""Natural frequencies of a mechanism at each position, with locked drives."""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import trees_of
from elastic.links.sliding_blocks import block_places
from elastic.vibration.mechanism_matrices import VibratingStructure
from rigid import Motion, Reals
from rigid.arrays import Flags, Integers, without
from rigid.kinematics import repeated

TOLERANCE = 1e-3
"""Accepted relative error of a natural frequency."""
# assumed ratio (error after a refinement / change due to the refinement); the largest ratio of 50 mechanisms was 0.05
ERROR_PER_CHANGE = 0.1
REFINEMENTS = (1, 3, 5, 7, 9, 12)  # number of inner polynomials for each of u, w and phi, in successive refinements
ASSEMBLED = (5, 7, 12)  # matrices for these numbers contain the matrices for smaller numbers
MAX_ROUNDS = 6  # maximum number of rounds of the search for the minimum over the positions
STEP_DIVISOR = 8  # factor by which a round of this search reduces the distance between neighbouring positions


class Frequencies(Struct, frozen=True, eq=False):
    """Lowest natural frequencies at selected positions of a motion.

    Attributes
    ----------
    omega
        Natural frequencies in ascending order [rad/s], shape (modes, ..., positions). They are nan at singular
        positions, and inf if there are fewer modes.
    position
        Indices of the selected positions in the motion, shape (positions,). If minima of several designs were searched,
        the shape is (designs, positions), and rows with fewer positions end with -1; `omega` is nan there.
    change
        Largest relative change in a frequency due to the last refinement.
    inner
        Number of inner polynomials of each beam for each of u, w and phi, after the last refinement.
    """

    omega: Reals
    position: Integers
    change: float
    inner: int = REFINEMENTS[0]

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
    tolerance: float = TOLERANCE,
    designs: int | None = None,
    searched: bool = False,
) -> Frequencies:
    """Compute the lowest natural frequencies of small vibrations about the rigid motion, with locked drives.

    The number of polynomials per beam is increased until the estimated relative error of the frequencies is less than
    `tolerance`. The stiffness does not include the effects of gravity, axial forces, springs and accelerations.

    Parameters
    ----------
    sections
        Sections of the beams, in the order of `Mechanism.beams`.
    modes
        Number of frequencies to compute.
    positions
        Number of evenly spaced positions that are selected from the motion.
    joints
        Compliant joints by name.
    tolerance
        Accepted relative error of the frequencies. The error is estimated from the change due to the last refinement.
    designs
        Number of designs to compute, starting with the first; by default all.
    searched
        True to add positions until the minimum of the lowest frequency over the motion is known to a relative error of
        `tolerance`.

    Examples
    --------
    The lowest frequency of a cantilever of 1 m with EI = 1 N m^2 and 1 kg/m is 1.8751^2 rad/s:

    >>> from elastic import Section
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> supported = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1})
    >>> round(natural_frequencies(motion(supported, [0.0]), [Section(1e6, 1.0)]).lowest, 4)
    3.516
    """
    axis = designs_of(tuple(sections))
    if axis:
        motion = repeated(motion, np.broadcast_shapes(motion.columns, axis))
    count = motion.columns[-1]
    chosen = np.linspace(0, count - 1, min(positions, count)).round().astype(int)
    rows = range(motion.columns[0] if len(motion.columns) > 1 else 1)[:designs]
    solved = []
    for row in rows:
        found, structure = _design_frequencies(motion, sections, modes, chosen, joints or {}, row, tolerance)
        solved.append(_with_minimum(motion, found, structure, row, tolerance) if searched and structure else found)
    if len(motion.columns) == 1:
        return solved[0]
    size = max(len(each.position) for each in solved)
    omega, position = np.full((modes, len(solved), size), np.nan), np.full((len(solved), size), -1)
    for row, each in enumerate(solved):
        own = slice(len(each.position))
        omega[:, row, own], position[row, own] = each.omega, each.position
    return Frequencies(
        omega, position if searched else chosen, max(each.change for each in solved), max(each.inner for each in solved)
    )


def _with_minimum(
    motion: Motion, solved: Frequencies, structure: VibratingStructure, design: int, tolerance: float
) -> Frequencies:
    """Add positions around the minimum of the lowest frequency of a design until this minimum is known."""
    before = np.inf
    for _ in range(MAX_ROUNDS):
        more = _around_minimum(solved, before, tolerance)
        more = more[_regular(motion, more, design)]
        if not len(more):
            break
        before = solved.lowest
        position = np.concatenate([solved.position, more])
        added = structure.at(more).frequencies(len(solved.omega), solved.inner)
        omega = np.concatenate([solved.omega, added], axis=1)
        order = np.argsort(position)
        solved = replace(solved, omega=omega[:, order], position=position[order])
    return solved


def _around_minimum(solved: Frequencies, before: float, tolerance: float) -> Integers:
    """Return additional positions near the minimum of the lowest frequency.

    The result is empty if the minimum is known.

    Parameters
    ----------
    before
        Minimum before positions were last added; infinite in the first round.
    tolerance
        Accepted relative error of the minimum.
    """
    none, known = np.zeros(0, int), np.isfinite(solved.omega[0])
    position, omega = solved.position[known], solved.omega[0][known]
    if len(omega) < 2:
        return none
    at = int(omega.argmin())
    sides = [side for side in (at - 1, at + 1) if 0 <= side < len(omega)]
    widest = max(abs(int(position[side] - position[at])) for side in sides)
    vertex, gain = float(position[at]), 0.0
    if len(sides) == 2:
        vertex, gain = _vertex(position[at - 1 : at + 2].astype(float), omega[at - 1 : at + 2])
    rise = max(float(omega[side] - omega[at]) for side in sides)
    if widest == 1 or rise < tolerance * omega[at] or max(gain, before - omega[at]) < tolerance / 2 * omega[at]:
        return none
    step = max(1, widest // STEP_DIVISOR)
    low, high = position[max(at - 1, 0)], position[min(at + 1, len(omega) - 1)]
    nearby = np.clip(np.rint(vertex) + step * np.arange(-1, 2), low, high).astype(int)
    return without(nearby, position)


def _vertex(places: Reals, values: Reals) -> tuple[float, float]:
    """Return the vertex of the parabola through three points: its position, and its depth below the middle point."""
    slopes = np.diff(values) / np.diff(places)
    bend = (slopes[1] - slopes[0]) / (places[2] - places[0])
    if bend <= 0.0:
        return float(places[1]), 0.0
    slope = slopes[0] + bend * (places[1] - places[0])  # at the middle point
    return float(places[1] - slope / (2 * bend)), float(slope**2 / (4 * bend))


def _regular(motion: Motion, chosen: Integers, design: int) -> Flags:
    """Return for each chosen position whether it is not singular and all blocks are on their beams."""
    singular = np.atleast_2d(motion.singular)[design, chosen]
    carried = np.ones(len(chosen), bool)
    for first, *_ in block_places(motion, trees_of(motion.mechanism)).values():
        carried &= np.isfinite(np.atleast_2d(np.broadcast_to(first.xi, motion.columns))[design, chosen])
    regular: Flags = ~singular & carried
    return regular


def _design_frequencies(
    motion: Motion,
    sections: Sequence[Section],
    modes: int,
    chosen: Integers,
    joints: Mapping[str, JointCompliance],
    design: int,
    tolerance: float,
) -> tuple[Frequencies, VibratingStructure | None]:
    """Return the frequencies and the structure of one design at chosen positions.

    The structure is None if all these positions are singular.
    """
    good = np.flatnonzero(_regular(motion, chosen, design))
    omega = np.full((modes, len(chosen)), np.nan)
    if not len(good):
        return Frequencies(omega, chosen, 0.0), None
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
        if ERROR_PER_CHANGE * change < tolerance:
            break
    omega[:, good] = before
    return Frequencies(omega, chosen, change, inner), structure
