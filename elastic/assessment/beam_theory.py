"""Error of beam theory due to shear, moments introduced at beam ends, and corners."""

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from typing import Any

import numpy as np

from elastic.arrays import AtStations, PerBeam, VectorCoefficients
from elastic.beams.cross_sections import POISSON
from elastic.beams.polynomials import added
from elastic.beams.section import Section, Taper
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import trees_of
from elastic.links.members import members_of
from elastic.sampling import reference_deflection, sample
from elastic.solution import Deflection
from elastic.solution import deflection as solve
from rigid import Mechanism, Reals
from rigid.arrays import Numbers
from rigid.constants import per_row

Meetings = dict[tuple[int, str], list[tuple[int, int, Any]]]

END_SHARE = 1 / 8  # share of the beam's length over which an introduced moment develops
STATIONS = 33  # stations along a beam at which deflections are compared
PIN_SHIFT = 0.28  # shift of a pin due to a moment M at an end, relative to M/kGA; fitted to plane-stress bodies
# rigid length of a corner / depth = CORNER_FACTOR tan(turn/2)^CORNER_EXPONENT, fitted to plane-stress bodies
CORNER_FACTOR, CORNER_EXPONENT = 0.275, 2.15
MAX_CORNER = 2 * np.pi / 3  # [rad] upper limit of the angle in this formula


def sections_with_shear(sections: Sequence[Section], poisson: float = POISSON) -> tuple[Section, ...]:
    """Return the sections with shear rigidities for all sections that can bend and stretch.

    The rigidity is `Section.shear_rigidity` if known, and otherwise that of a rectangle with the same EA, for which
    k = 10 (1 + nu)/(12 + 11 nu).

    Parameters
    ----------
    sections
        One per beam.
    poisson
        Poisson's ratio for sections without shear rigidity.
    """
    return tuple(_sheared(section, poisson) for section in sections)


def _sheared(section: Section, poisson: float) -> Section:
    if not np.isinf(section.kGA).all() or not (np.isfinite(section.EA).all() and np.isfinite(section.EI).all()):
        return section
    if np.isfinite(section.shear_rigidity).all():
        return replace(section, kGA=section.shear_rigidity)
    taper = section.taper and replace(section.taper, kGA=section.taper.EA)
    return replace(section, kGA=section.EA * (5 / (12 + 11 * poisson)), taper=taper)


def shear_share(deflection: Deflection, poisson: float = POISSON) -> PerBeam:
    """Return the largest change of the chord deflection due to shear, relative to the deflection of each member.

    The reference is the largest deflection of the member. The problem is solved again with shear deformation. The
    result is 0 for beams that already have shear deformation or cannot bend.

    Parameters
    ----------
    poisson
        Poisson's ratio for sections without shear rigidity.

    Returns
    -------
    Array of shape (beams, ...).

    Examples
    --------
    For a square bar, 1 m long and 10 cm deep, on two supports, the share is 48 EI/(5 kGA l^2) = 2.45 %.

    >>> from elastic import Section, deflection
    >>> from rigid import Beam, LineLoad, Link, Mechanism, Slider, motion
    >>> links = Link("ground", {"A": 0}), Link("bar", {"A": 0, "B": 1.0}, (Beam("A", "B"),)), Link("block", {"B": 0})
    >>> guide, load = Slider("guide", "block", "ground", "B", 0.0, 1.0), LineLoad("bar", 0, -1j, -1j)
    >>> held = motion(Mechanism(links, (), {"A": 0, "B": 1.0}, (guide,), loads=(load,)), np.zeros((0, 1)))
    >>> shear_share(deflection(held, [Section(EA=12e2, EI=1.0)])).round(4)
    array([0.0245])
    """
    sheared = sections_with_shear(deflection.sections, poisson)
    if all(new is old for new, old in zip(sheared, deflection.sections, strict=True)):
        return np.zeros((len(sheared), *deflection.motion.columns[:-1]))
    xi = np.linspace(0.0, 1.0, STATIONS)
    without = sample(deflection, "chord", xi)
    if _statically_determinate(deflection) and not any(section.taper for section in sheared):
        more = _shear_chord(deflection, sheared, xi)
    else:
        more = sample(solve(deflection.motion, sheared, deflection.joints, deflection.added), "chord", xi) - without
    return _over_largest(deflection, _greatest(more), _greatest(without))


def _statically_determinate(deflection: Deflection) -> bool:
    """Return whether the section forces are statically determinate and continuous along every member."""
    mechanism, closures = deflection.motion.mechanism, deflection.motion.closures
    undivided = deflection.division.whole and members_of(mechanism).whole and not trees_of(mechanism).cuts
    return undivided and not any(closed.redundancy for closed in closures)


def _shear_chord(deflection: Deflection, sheared: Sequence[Section], xi: Reals) -> AtStations:
    """Return the chord deflection due to shear if the forces do not change, in the shape returned by `sample`.

    Since w' = V/kGA = M'/kGA, it is (M minus the straight line through its end values)/kGA.
    """
    moment, ndim = sample(deflection, "M", xi), len(deflection.motion.columns)
    line = moment[..., :1] * (1.0 - xi) + moment[..., -1:] * xi
    pairs = zip(sheared, deflection.sections, strict=True)
    added = [0.0 if new is old else 1.0 / np.asarray(new.kGA, float) for new, old in pairs]
    return (moment - line) * per_row(added, ndim, float)[..., None]


def introduction_share(deflection: Deflection, poisson: float = POISSON) -> PerBeam:
    """Estimate the deflection due to moments introduced at beam ends, relative to the deflection of each member.

    The reference is the largest deflection of the member. In beam theory, the moment of a drive or slider acts at a
    point. In a solid body, it enters through a pin and develops into a bending moment over a length of about one depth,
    and the pin shifts sideways by about 0.28 M/kGA. The moment between two beams of a link counts fully at a corner of
    90 degrees or more, less at smaller angles, and not at all if the beams are in line.

    Returns
    -------
    Array of shape (beams, ...).
    """
    sections = sections_with_shear(deflection.sections, poisson)
    moments = _greatest(_introduced(sample(deflection, "M", [0.0, 1.0]), _meetings(deflection.motion.mechanism)))
    chord = sample(deflection, "chord", np.linspace(0.0, 1.0, STATIONS))
    soft = np.array([np.broadcast_to(_softest(section), moments.shape[1:]) for section in sections])
    return _over_largest(deflection, PIN_SHIFT * soft * moments, _greatest(chord))


def beyond_beam_theory(deflection: Deflection, poisson: float = POISSON) -> Deflection:
    """Return the deflection with estimates for shear, introduced moments and stiff corners.

    The difference from the given deflection is an estimate of the error of beam theory. The problem is solved again
    with the sections of `sections_with_shear`. Near an end with an introduced moment, over about `END_SHARE` of the
    length, the beam shifts as in `introduction_share`. A corner of a link bends less than its beams would. If nothing
    changes, the same object is returned.

    Parameters
    ----------
    poisson
        Poisson's ratio for sections without shear rigidity.
    """
    sheared = sections_with_shear(deflection.sections, poisson)
    M, meetings = sample(deflection, "M", [0.0, 1.0]), _meetings(deflection.motion.mechanism)
    moments, columns = _introduced(M, meetings), deflection.motion.columns
    soft = np.array([np.broadcast_to(_softest(section), moments.shape[1:-2]) for section in sheared])
    shift = -PIN_SHIFT * soft.reshape(-1, *(np.shape(soft)[1:] or (1,) * (len(columns) - 1)), 1, 1) * moments
    kink = _stiff_corners(M, meetings, deflection.sections)
    if sheared == deflection.sections and not (shift.any() or kink.any()):
        return deflection
    length = deflection.length[..., None]
    across, turned = 1j * _near_ends(shift / length * [1.0, -1.0]), _near_ends(kink / length)
    return solve(deflection.motion, sheared, deflection.joints, _strained(deflection, np.array([across, turned])))


def _near_ends(at_ends: Numbers) -> Numbers:
    """Return polynomials in xi, concentrated near the ends of the beams, with given integrals there (last axis)."""
    start, end = np.moveaxis(at_ends, -1, 0)
    rise = round(1.0 / END_SHARE)
    rates: Numbers = rise * np.array([start * comb(rise - 1, k) * (-1.0) ** k for k in range(rise)], complex)
    rates[-1] += rise * end
    return rates


def _stiff_corners(M: AtStations, meetings: Meetings, sections: Sequence[Section]) -> AtStations:
    """Return the excess rotation in beam theory at both ends of every beam that forms a corner.

    It is half of M/EI times the stiff length of the corner. The depth is that of the rectangle with the same EA and EI.
    """
    stiff = -CORNER_FACTOR / 2 * np.tan(np.minimum(_turns(meetings, sections), MAX_CORNER) / 2) ** CORNER_EXPONENT
    kink: AtStations = np.zeros_like(M)
    for number in np.flatnonzero(stiff.any(axis=1)).tolist():
        section = sections[number]
        soft = np.sqrt(12.0 / (np.asarray(section.EA, float) * np.asarray(section.EI, float)))
        depths = np.broadcast_to(np.reshape(soft, np.shape(soft)[:-1]), M.shape[1:-2])
        kink[number] = stiff[number] * depths[..., None, None] * M[number]
    return kink


def _turns(meetings: Meetings, sections: Sequence[Section]) -> Reals:
    """Return the smallest angle to another beam of the link at both ends of every beam, shape (beams, 2).

    The angle of collinear beams is zero. It is also set to zero if one of the beams is thin-walled, because the fit
    for corners is valid for solid sections only.
    """
    turns = np.zeros((len(sections), 2))
    for meeting in meetings.values():
        if any(sections[number].thin_walled for number, _, _ in meeting):
            continue
        for number, end, out in meeting:
            others = [abs(np.angle(-other / out)) for k, _, other in meeting if k != number]
            turns[number, end] = min(others, default=0.0)
    return turns


def _meetings(mechanism: Mechanism) -> Meetings:
    """Return the beams that end at each point of each link: index, end (0 or 1), unit vector away from the point."""
    nodes: Meetings = {}
    for number, (at, beam) in enumerate(mechanism.beams):
        points = mechanism.links[at].points
        way = np.ravel(points[beam.end] - points[beam.start])[0]
        for end, (point, out) in enumerate(((beam.start, way), (beam.end, -way))):
            nodes.setdefault((at, point), []).append((number, end, out / abs(out)))
    return nodes


def _strained(deflection: Deflection, strain: VectorCoefficients) -> AddedLoads:
    """Add free strains to the additional loads of a deflection."""
    loads = deflection.added
    if loads is None:
        none = (0.0,) * len(deflection.motion.structure.joints)
        return AddedLoads(np.zeros((1, *strain.shape[2:]), complex), (), (), none, none, strain)
    if loads.strain is None:
        return replace(loads, strain=strain)
    return replace(loads, strain=np.stack([added(*parts) for parts in zip(loads.strain, strain, strict=True)]))


def _introduced(M: AtStations, meetings: Meetings) -> AtStations:
    """Return the moments introduced at both ends of every beam, with the sign of M [N m], (beams, ..., positions, 2).

    A moment from outside the link counts fully. A moment from other beams of the link is reduced according to the angle
    between the beams, to zero for collinear beams.
    """
    moments = np.zeros_like(M)
    for meeting in meetings.values():
        outside = sum(M[number, ..., end] * (2 * end - 1) for number, end, _ in meeting)
        for number, end, out in meeting:
            others = [abs(out + other) / np.sqrt(2) for k, _, other in meeting if k != number]
            own = outside * (2 * end - 1)
            turned = M[number, ..., end] * min([1.0, *others]) if others else own
            moments[number, ..., end] = np.where(np.abs(turned) > np.abs(own), turned, own)
    return moments


def _softest(section: Section) -> Numbers:
    """Return the larger of the two values of 1/kGA at the ends of a beam."""
    taper = section.taper or Taper()
    factor = min(np.polynomial.polynomial.polyval(xi, taper.kGA) for xi in (0.0, 1.0))
    return np.reshape(1.0 / (np.asarray(section.kGA, float) * factor), np.shape(section.kGA)[:-1])


def _greatest(values: AtStations) -> PerBeam:
    """Return the largest finite magnitude over positions and stations, the last two axes."""
    return np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=(-2, -1), initial=0.0)


def _over_largest(deflection: Deflection, change: PerBeam, largest: PerBeam) -> PerBeam:
    """Return the largest change in the member of each beam, relative to its reference deflection; 0 if it is zero."""
    members = members_of(deflection.motion.mechanism)
    taken, change = reference_deflection(members.greatest(largest)), members.greatest(change)
    return np.divide(change, taken, out=np.zeros_like(change), where=taken > 0)
