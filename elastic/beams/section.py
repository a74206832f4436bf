"""Rigidities of a beam, their taper, and the compliance of joints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigid import Beam, Mechanism
from rigid.arrays import Complex, Reals

MAX_SOLID_SHEAR = 1.6  # peak / mean shear stress: rectangle 1.5, circle 4/3; above this, the section is thin-walled


@dataclass(frozen=True, eq=False)
class Taper:
    """Change of a beam's rigidities along its length: polynomials in xi, relative to the start.

    `(1.0, -0.5)` halves a rigidity linearly. No polynomial may be zero on the beam. Area and second moment change like
    EA and EI, because the material is uniform. `fibre` and `peak_shear` only affect stresses, and `width` only affects
    drawings.
    """

    EA: tuple[float, ...] = (1.0,)
    EI: tuple[float, ...] = (1.0,)
    kGA: tuple[float, ...] = (1.0,)
    fibre: tuple[float, ...] = (1.0,)
    peak_shear: tuple[float, ...] = (1.0,)
    width: tuple[float, ...] = (1.0,)


@dataclass(frozen=True, eq=False, repr=False)
class Section:
    """Rigidities of a beam at its start; shapes () or (designs, 1).

    Attributes
    ----------
    EA, EI
        Rigidities [N], [N m^2]; infinite for a rigid beam.
    kGA
        Shear rigidity of Timoshenko's beam [N]; infinite means no shear deformation.
    strain
        Free strain (unloaded elongation per length): thermal expansion or a length error.
    taper
        Change of the rigidities along the beam, or None.
    area, inertia, fibre, peak_shear
        For stresses, nan if unknown: area [m^2], second moment of area [m^4], distance from the axis to the outermost
        fibres [m], largest shear stress / (V/A).
    yield_stress
        [Pa]; nan if unknown.
    shear_rigidity
        kGA of a beam without shear deformation [N], used to estimate the neglected shear; nan if unknown.
    width, round
        For drawing: width normal to the plane of motion [m], nan if unknown; True for an elliptic outline.
    """

    EA: float | Reals = math.inf
    EI: float | Reals = math.inf
    kGA: float | Reals = math.inf
    strain: float | Reals = 0.0
    taper: Taper | None = None
    area: float | Reals = math.nan
    inertia: float | Reals = math.nan
    fibre: float | Reals = math.nan
    peak_shear: float | Reals = math.nan
    yield_stress: float | Reals = math.nan
    shear_rigidity: float | Reals = math.nan
    width: float | Reals = math.nan
    round: bool = False

    @property
    def thin_walled(self) -> bool:
        """True if walls carry the shear, as in a tube or an I; plane-stress elements then do not apply."""
        return bool(np.ravel(self.peak_shear)[0] > MAX_SOLID_SHEAR)

    def __repr__(self) -> str:
        return f"Section(EA={_property_text(self.EA)}, EI={_property_text(self.EI)}{', tapered' if self.taper else ''})"


def with_rotary_inertia(mechanism: Mechanism, sections: Sequence[Section]) -> Mechanism:
    """Return the mechanism with the rotary inertia of its cross-sections, m I/A per length.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`. Sections with unknown area or second moment add no inertia.

    Raises
    ------
    ValueError
        If a beam's mass and the area of its section taper differently.
    """
    of_beam = iter(sections)
    links = [
        link
        if not number
        else replace(link, beams=tuple(_with_rotary_inertia(beam, next(of_beam)) for beam in link.beams))
        for number, link in enumerate(mechanism.links)
    ]
    return replace(mechanism, links=tuple(links))


def _with_rotary_inertia(beam: Beam, section: Section) -> Beam:
    square = np.asarray(section.inertia) / np.asarray(section.area)
    if not np.isfinite(square).all():
        return beam
    taper = section.taper
    if taper is not None and beam.mass_taper != taper.EA:
        raise ValueError(f"mass and area of a beam must have the same taper, not {beam.mass_taper} and {taper.EA}")
    return replace(
        beam, rotary_inertia=beam.mass_per_length * square, rotary_taper=taper.EI if taper else beam.mass_taper
    )


def _property_text(value: float | Reals) -> str:
    """Format a property: its value, or the number of designs."""
    return f"{float(np.ravel(value)[0]):.6g}" if np.size(value) == 1 else f"of {np.size(value)} designs"


RIGID = Section()
"""Section of a rigid beam."""


@dataclass(frozen=True)
class JointCompliance:
    """Compliance and clearance of a joint.

    Attributes
    ----------
    translation
        Displacement of the parent's point from the child's, along the force on the child and per force [m/N].
    rotation
        Rotation per moment of a drive or slider [rad/(N m)].
    gap, turn
        Unloaded offset of the child's point from the parent's, in ground axes [m], complex; unloaded rotation [rad].
    """

    translation: float = 0.0
    rotation: float = 0.0
    gap: Complex = 0.0
    turn: float = 0.0
