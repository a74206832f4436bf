"""Rigidities of a beam, their taper, and the compliance of joints."""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid import Beam, Mechanism
from rigid.arrays import Complex, Reals

MAX_SOLID_SHEAR = 1.6  # a section is thin-walled if (peak / mean shear stress) is larger (rectangle: 1.5, circle: 4/3)


class Taper(Struct, frozen=True, eq=False):
    """Variation of the rigidities along a beam: polynomials in xi, relative to the values at the start.

    For example, `(1.0, -0.5)` reduces a rigidity linearly to one half. No polynomial may have a zero on the beam. Area
    and second moment of area vary like EA and EI, because the material is uniform. `fibre` and `peak_shear` are used
    for stresses only, and `width` for drawings only.
    """

    EA: tuple[float, ...] = (1.0,)
    EI: tuple[float, ...] = (1.0,)
    kGA: tuple[float, ...] = (1.0,)
    fibre: tuple[float, ...] = (1.0,)
    peak_shear: tuple[float, ...] = (1.0,)
    width: tuple[float, ...] = (1.0,)


class Section(Struct, frozen=True, eq=False):
    """Rigidities of a beam at its start, as scalars or arrays of shape (designs, 1).

    Attributes
    ----------
    EA, EI
        Axial and bending rigidity [N], [N m^2]; infinite for a rigid beam.
    kGA
        Shear rigidity of Timoshenko's beam [N]; infinite for a beam without shear deformation.
    strain
        Free strain due to thermal expansion or a length error: elongation per unit length without load.
    taper
        Variation of the rigidities along the beam, or None.
    area, inertia, fibre, peak_shear
        Properties for stresses, nan if unknown: area [m^2], second moment of area [m^4], distance from the axis to the
        outermost fibres [m], largest shear stress / (V/A).
    yield_stress
        Yield stress [Pa], nan if unknown.
    shear_rigidity
        Real shear rigidity [N], also if `kGA` is infinite because shear deformation is neglected; nan if unknown.
    width, round
        Properties for drawings: width normal to the plane of motion [m] (nan if unknown), and whether the outline is an
        ellipse.
    web_end
        Distance from the axis to the end of the web [m]; 0 without a web, or along a taper.
    sideways
        Second moment of area for bending normal to the plane of motion [m^4], nan if unknown.
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
    web_end: float | Reals = 0.0
    sideways: float | Reals = math.nan

    @property
    def thin_walled(self) -> bool:
        """True if the walls are thin, as in a tube or I-section, so that plane-stress elements do not apply."""
        return bool(np.ravel(self.peak_shear)[0] > MAX_SOLID_SHEAR)

    def __repr__(self) -> str:
        return f"Section(EA={_property_text(self.EA)}, EI={_property_text(self.EI)}{', tapered' if self.taper else ''})"


def with_rotary_inertia(mechanism: Mechanism, sections: Sequence[Section]) -> Mechanism:
    """Return the mechanism with the rotary inertia of the beams added: m I/A per unit length.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`. Sections with unknown area or second moment add no inertia.

    Raises
    ------
    ValueError
        If the mass per unit length of a beam has a different taper than the area of its section.
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
    """Format a property: its value, or the number of designs if there are several values."""
    return f"{float(np.ravel(value)[0]):.6g}" if np.size(value) == 1 else f"of {np.size(value)} designs"


RIGID = Section()
"""Section of a rigid beam."""


class JointCompliance(Struct, frozen=True):
    """Compliance and clearance of a joint.

    Attributes
    ----------
    translation
        Displacement of the parent's point relative to the child's point, in the direction of the force on the child,
        per unit force [m/N].
    rotation
        Rotation per unit moment of a drive or slider [rad/(N m)].
    gap, turn
        Offset of the child from the parent without load: displacement of the child's point in ground axes [m], complex,
        and rotation [rad].
    """

    translation: float = 0.0
    rotation: float = 0.0
    gap: Complex = 0.0
    turn: float = 0.0
