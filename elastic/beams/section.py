"""Rigidities of a beam, how they change along it, and the compliance of joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigid import Beam, Mechanism
from rigid.arrays import Complex, Reals

FULL = 1.6  # largest shear stress over the mean one: 1.5 of rectangles, 4/3 of circles; more has thin walls


@dataclass(frozen=True, eq=False)
class Taper:
    """How a beam's rigidities change along it: polynomials in xi by which those at its start are multiplied.

    `(1.0, -0.5)` halves a rigidity linearly. None is zero anywhere on the beam. Area and second moment change as EA and
    EI do, one material given; `fibre` and `peak_shear` count for stresses only, `width` for drawing.
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
        [N], [N m^2], infinite for a rigid beam.
    kGA
        Shear rigidity of Timoshenko's beam [N]; infinite without shear deformation.
    strain
        Free strain: elongation per length when nothing pulls, thermal or an error of the length.
    taper
        How the rigidities change along the beam; None where they do not.
    area, inertia, fibre, peak_shear
        Area [m^2], second moment of area [m^4], distance of the outermost fibres from the axis [m], and largest shear
        stress over V/A: for stresses; nan where they are not known.
    yield_stress
        [Pa]; nan where it is not known.
    shear_rigidity
        kGA of a beam that is not to shear [N], by which it is told what that leaves out; nan where it is not known.
    width, round
        Across the plane of motion [m], nan where it is not known; whether the outline is an ellipse, not a rectangle.
        For drawing.
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
        """Whether shear goes through walls, as in a tube or an I: then a link is no plane body."""
        return bool(np.ravel(self.peak_shear)[0] > FULL)

    def __repr__(self) -> str:
        return f"Section(EA={_told(self.EA)}, EI={_told(self.EI)}{', tapered' if self.taper else ''})"


def with_rotary_inertia(mechanism: Mechanism, sections: Sequence[Section]) -> Mechanism:
    """The mechanism with the rotary inertia of its beams' sections, m I/A per length.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`; those that do not tell their area and second moment have none.

    Raises
    ------
    ValueError
        A beam's mass does not change along it as the area of its section does.
    """
    of_beam = iter(sections)
    links = [
        link if not number else replace(link, beams=tuple(_turning(beam, next(of_beam)) for beam in link.beams))
        for number, link in enumerate(mechanism.links)
    ]
    return replace(mechanism, links=tuple(links))


def _turning(beam: Beam, section: Section) -> Beam:
    square = np.asarray(section.inertia) / np.asarray(section.area)
    if not np.isfinite(square).all():
        return beam
    taper = section.taper
    if taper is not None and beam.mass_taper != taper.EA:
        raise ValueError(f"mass along a beam {beam.mass_taper} times that at its start, its area {taper.EA} times")
    return replace(
        beam, rotary_inertia=beam.mass_per_length * square, rotary_taper=taper.EI if taper else beam.mass_taper
    )


def _told(value: float | Reals) -> str:
    """A property of one design, or of how many there are values."""
    return f"{float(np.ravel(value)[0]):.6g}" if np.size(value) == 1 else f"of {np.size(value)} designs"


RIGID = Section()
"""The section of a beam that does not give way."""


@dataclass(frozen=True)
class JointCompliance:
    """Compliance of a joint, and its lack of fit.

    Attributes
    ----------
    translation
        Displacement per force [m/N]: of the parent's point from the child's along the force.
    rotation
        Rotation per moment of a drive or slider [rad/(N m)].
    gap, turn
        Displacement of the child's point from the parent's [m], complex, in the ground's axes, and rotation [rad] that
        the joint has unloaded.
    """

    translation: float = 0.0
    rotation: float = 0.0
    gap: Complex = 0.0
    turn: float = 0.0
