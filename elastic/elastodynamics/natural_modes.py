"""Natural modes of a mechanism at single positions with locked drives: frequencies, damping ratios and shapes."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.elastic_structure import elastic_structure
from elastic.elastodynamics.equations_of_motion import kinematics
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduction import mass_of, unit_stiffness_basis
from elastic.elastodynamics.strains import Damping, rigidities, strain_rows
from elastic.elastodynamics.time_grid import interpolation
from elastic.vibration import natural_frequencies
from rigid import Motion
from rigid.arrays import Complexes, Reals

STATIONS = 101
REFINEMENTS = (4, 8, 12)  # number of polynomials per beam in successive refinements
# largest accepted relative change in a frequency in the last refinement, and largest accepted `shape_error`
TOLERANCE = 1e-3


class NaturalModes(Struct, frozen=True, eq=False):
    """Lowest natural modes at the positions of a motion.

    Attributes
    ----------
    omega
        Natural frequency from `natural_frequencies` [rad/s], shape (modes, positions); nan at singular positions, and
        infinite if the mechanism has fewer modes.
    damping
        Damping ratio [1], same shape.
    displacement
        Displacement of the beams from their rigid positions in ground axes, complex, shape (modes, beams, positions,
        stations). Stations are evenly spaced along each beam. Each mode is scaled so that its largest displacement is
        1.
    shape_error
        Largest relative difference between `omega` and the frequency that Rayleigh's quotient gives for the shape. It
        is about the square of the relative error of the shape. It may exceed `tolerance` if a block slides on an
        elastic beam.
    """

    omega: Reals
    damping: Reals
    displacement: Complexes
    shape_error: float


def natural_modes(
    motion: Motion,
    sections: Sequence[Section],
    modes: int = 3,
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | None = None,
    tolerance: float = TOLERANCE,
    stations: int = STATIONS,
) -> NaturalModes:
    """Compute frequencies, damping ratios and shapes of small vibrations about the rigid positions, with locked drives.

    Effects of gravity, axial forces, springs and accelerations on the stiffness are neglected. A mode with the natural
    frequency omega has the damping ratio beta omega / 2. Here, beta is the mean of the Kelvin-Voigt constants of all
    beams and joints, weighted by strain energy. This is exact if all constants are equal. Otherwise it is a first-order
    approximation for light damping.

    Parameters
    ----------
    motion
        Motion of one design at the requested positions.
    sections
        Sections of the beams, in the order of `Mechanism.beams`.
    joints
        Compliant joints by name.
    damping
        Kelvin-Voigt damping. By default, the damping ratio is 1 % at the lowest frequency.
    tolerance
        Frequencies are refined until their relative change is below this value. Shapes are refined until `shape_error`
        is below this value, or the number of polynomials reaches its maximum.

    Raises
    ------
    ValueError
        If the motion or the sections have several designs.

    Examples
    --------
    The lowest frequency of a cantilever of 1 m with EI = 1 N m^2 and 1 kg/m is 1.8751^2 rad/s:

    >>> from elastic import Section
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> supported = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1})
    >>> found = natural_modes(motion(supported, [0.0]), [Section(1e6, 1.0)])
    >>> print(found.omega[0].round(3), found.damping[0].round(3))
    [3.516] [0.01]
    """
    if len(motion.columns) != 1 or designs_of(tuple(sections)):
        raise ValueError("natural modes need a motion and sections of one design")
    shape = modes, len(sections), *motion.columns
    given = Damping(np.full(len(sections), math.nan)) if damping is None else damping
    omega = natural_frequencies(motion, sections, modes, motion.columns[-1], joints, tolerance).omega
    if not (np.isfinite(omega).any() and len(sections)):
        return NaturalModes(omega, omega * np.nan, np.full((*shape, stations), np.nan, complex), 0.0)
    for polynomials_per_beam in REFINEMENTS:
        found = _with_shapes(motion, sections, joints or {}, omega, given, polynomials_per_beam, stations)
        if found.shape_error < tolerance:
            break
    return found


def _with_shapes(
    motion: Motion,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance],
    omega: Reals,
    damping: Damping,
    polynomials_per_beam: int,
    stations: int,
) -> NaturalModes:
    """Compute damping ratios and shapes for known frequencies, with `polynomials_per_beam` polynomials per beam."""
    structure, good = elastic_structure(motion.mechanism, sections, joints, polynomials_per_beam), np.isfinite(omega[0])
    kinematics_ = kinematics(structure, motion, unit_stiffness_basis(structure), chosen_points(structure.mechanism))
    values, vectors = np.linalg.eigh(np.where(good[:, None, None], mass_of(kinematics_), 0.0))
    count = min(len(omega), vectors.shape[-1])
    values, vectors = values[:, ::-1][:, :count].T, vectors[:, :, ::-1][:, :, :count]
    moving = np.isfinite(omega[:count]) & (values > 0)
    off = 1.0 / (np.sqrt(values[moving]) * omega[:count][moving]) - 1.0
    energy = (strain_rows(structure, kinematics_.basis) @ vectors) ** 2 * rigidities(structure)[:, None]
    beta = damping.with_default_beta(float(omega[0, good].min())).per_row(structure)
    moved = np.einsum("pbxn,pnm->mbpx", kinematics_.unit.beams, vectors)
    moved = moved @ interpolation(structure.xi, np.linspace(0.0, 1.0, stations)).T
    with np.errstate(invalid="ignore"):  # singular positions
        mean = np.einsum("r,prm->mp", beta, energy) / energy.sum(axis=1).T
        moved /= np.abs(moved).max(axis=(1, 3), keepdims=True)
    ratio = np.full(omega.shape, np.nan)
    displacement = np.full((len(omega), *moved.shape[1:]), np.nan, complex)
    ratio[:count] = np.where(moving, mean * omega[:count] / 2, np.nan)
    displacement[:count] = np.where(moving[:, None, :, None], moved, np.nan)
    return NaturalModes(omega, ratio, displacement, float(np.abs(off).max(initial=0.0)))
