"""Error of beam theory due to three effects: neglected shear, moments introduced at beam ends, and stiff corners."""

from collections.abc import Sequence
from math import comb
from typing import Any

import numpy as np
from msgspec.structs import replace

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

END_SHARE = 1 / 8  # an introduced moment affects about this share of the beam, next to the end
STATIONS = 33  # number of stations along a beam at which deflections are compared
PIN_SHIFT = 0.28  # lateral shift of a pin due to a moment M, relative to M/kGA; fitted to plane-stress bodies
# (rigid length of a corner) / depth = CORNER_FACTOR tan(turn / 2)^CORNER_EXPONENT, fitted to plane-stress bodies
CORNER_FACTOR, CORNER_EXPONENT = 0.275, 2.15
MAX_CORNER = 2 * np.pi / 3  # [rad] largest `turn` (change of direction from one beam to the other) in this formula


def sections_with_shear(sections: Sequence[Section], poisson: float = POISSON) -> tuple[Section, ...]:
    """Return the sections; each section that can bend and stretch gets a finite shear rigidity kGA.

    A kGA that is already finite does not change. An infinite kGA is replaced by `Section.shear_rigidity` if known, or
    else by kGA of a rectangle with the same EA, for which k = 10 (1 + nu)/(12 + 11 nu).

    Parameters
    ----------
    sections
        Sections of the beams.
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
    """Return the largest change in the chord deflection due to shear, relative to the largest chord deflection.

    Both values are the largest ones over all positions and stations of the member that contains the beam. To find the
    change, the problem is solved again with shear deformation. The result is 0 if `sections_with_shear` changes no
    section.

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
    >>> supported = motion(Mechanism(links, (), {"A": 0, "B": 1.0}, (guide,), loads=(load,)), np.zeros((0, 1)))
    >>> shear_share(deflection(supported, [Section(EA=12e2, EI=1.0)])).round(4)
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
    return _relative(deflection, _largest(more), _largest(without))


def _statically_determinate(deflection: Deflection) -> bool:
    """Return whether the section forces are statically determinate and continuous along every member."""
    mechanism, closures = deflection.motion.mechanism, deflection.motion.closures
    undivided = deflection.division.whole and members_of(mechanism).whole and not trees_of(mechanism).cuts
    return undivided and not any(closed.redundancy for closed in closures)


def _shear_chord(deflection: Deflection, sheared: Sequence[Section], xi: Reals) -> AtStations:
    """Return the chord deflection due to shear at stations `xi`, in the shape of the results of `sample`.

    This requires that shear does not change the section forces. The slope due to shear is w' = V/kGA = M'/kGA. The
    chord deflection is therefore (M - M0)/kGA, with the straight line M0 through the values of M at both ends.
    """
    moment, ndim = sample(deflection, "M", xi), len(deflection.motion.columns)
    line = moment[..., :1] * (1.0 - xi) + moment[..., -1:] * xi
    pairs = zip(sheared, deflection.sections, strict=True)
    added = [0.0 if new is old else 1.0 / np.asarray(new.kGA, float) for new, old in pairs]
    return (moment - line) * per_row(added, ndim, float)[..., None]


def introduction_share(deflection: Deflection, poisson: float = POISSON) -> PerBeam:
    """Estimate the deflection due to moments introduced at beam ends, relative to the largest chord deflection.

    Both values are the largest ones of the member that contains the beam. In beam theory, the moment of a drive or
    slider acts at a point. In a solid body, this moment enters through a pin and develops into a bending moment over a
    length of about one depth of the beam. The pin shifts laterally by about 0.28 M/kGA. The moment between two beams of
    a link counts fully if the direction changes by 90 degrees or more at the corner. It counts less if the change is
    smaller, and not at all between collinear beams.

    Returns
    -------
    Array of shape (beams, ...).
    """
    sections = sections_with_shear(deflection.sections, poisson)
    moments = _largest(_introduced(sample(deflection, "M", [0.0, 1.0]), _meetings(deflection.motion.mechanism)))
    chord = sample(deflection, "chord", np.linspace(0.0, 1.0, STATIONS))
    soft = np.array([np.broadcast_to(_shear_flexibility(section), moments.shape[1:]) for section in sections])
    return _relative(deflection, PIN_SHIFT * soft * moments, _largest(chord))


def beyond_beam_theory(deflection: Deflection, poisson: float = POISSON) -> Deflection:
    """Return the deflection with estimates of the effects of shear, introduced moments and stiff corners.

    The difference between the result and the given deflection is an estimate of the error of beam theory. The problem
    is solved again with the sections of `sections_with_shear`. Near an end with an introduced moment, the beam axis
    shifts laterally as in `introduction_share`. The shift develops over about `END_SHARE` of the beam's length. A solid
    corner of a link bends less than beam theory predicts for the two beam ends that meet there. If none of these
    effects exist, the given object is returned.

    Parameters
    ----------
    poisson
        Poisson's ratio for sections without shear rigidity.
    """
    sheared = sections_with_shear(deflection.sections, poisson)
    M, meetings = sample(deflection, "M", [0.0, 1.0]), _meetings(deflection.motion.mechanism)
    moments, columns = _introduced(M, meetings), deflection.motion.columns
    soft = np.array([np.broadcast_to(_shear_flexibility(section), moments.shape[1:-2]) for section in sheared])
    shift = -PIN_SHIFT * soft.reshape(-1, *(np.shape(soft)[1:] or (1,) * (len(columns) - 1)), 1, 1) * moments
    kink = _stiff_corners(M, meetings, deflection.sections)
    if sheared == deflection.sections and not (shift.any() or kink.any()):
        return deflection
    length = deflection.length[..., None]
    across, turned = 1j * _near_ends(shift / length * [1.0, -1.0]), _near_ends(kink / length)
    return solve(deflection.motion, sheared, deflection.joints, _strained(deflection, np.array([across, turned])))


def _near_ends(at_ends: Numbers) -> Numbers:
    """Return polynomials in xi that are large only near the ends of the beams; the first axis contains the powers.

    Each polynomial is the sum of a term that is large near the start and a term that is large near the end. The last
    axis of `at_ends` contains the integrals of these two terms over the beam, in this order.
    """
    start, end = np.moveaxis(at_ends, -1, 0)
    rise = round(1.0 / END_SHARE)
    rates: Numbers = rise * np.array([start * comb(rise - 1, k) * (-1.0) ** k for k in range(rise)], complex)
    rates[-1] += rise * end
    return rates


def _stiff_corners(M: AtStations, meetings: Meetings, sections: Sequence[Section]) -> AtStations:
    """Return the correction of the rotation of corners, which beam theory overestimates, at both ends of each beam.

    The magnitude of the correction is (M/EI) * (rigid length of the corner) / 2. The formula for the rigid length
    contains a depth, which is taken from the rectangle with the same EA and EI.
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
    """Return the smallest change of direction to a neighbouring beam of the link, for both beam ends, shape (beams, 2).

    The change is zero between collinear beams. It is also set to zero if a beam at the corner is thin-walled, because
    the formula for corners was fitted to solid sections.
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
    """Return the beams that meet at each point of each link.

    A beam is given by its index, its end at the point (0: start, 1: end), and the unit vector away from the point.
    """
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
    """Return the moments that are introduced at both ends of each beam [N m], shape (beams, ..., positions, 2).

    They have the sign of the bending moment M. A moment from outside the link counts fully. A moment from neighbouring
    beams of the link counts fully if the direction changes by 90 degrees or more, less if the change is smaller, and
    not at all if the beams are collinear. If there are moments of both types, the result is the one with the larger
    magnitude.
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


def _shear_flexibility(section: Section) -> Numbers:
    """Return the shear flexibility 1/kGA at the start or at the end of a beam, whichever is larger."""
    taper = section.taper or Taper()
    factor = min(np.polynomial.polynomial.polyval(xi, taper.kGA) for xi in (0.0, 1.0))
    return np.reshape(1.0 / (np.asarray(section.kGA, float) * factor), np.shape(section.kGA)[:-1])


def _largest(values: AtStations) -> PerBeam:
    """Return the largest finite magnitude over the last two axes (positions and stations)."""
    return np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=(-2, -1), initial=0.0)


def _relative(deflection: Deflection, change: PerBeam, largest: PerBeam) -> PerBeam:
    """Return the largest change in the member of each beam, relative to the reference deflection of the member.

    The result is 0 if the reference deflection is zero.
    """
    members = members_of(deflection.motion.mechanism)
    reference, change = reference_deflection(members.greatest(largest)), members.greatest(change)
    return np.divide(change, reference, out=np.zeros_like(change), where=reference > 0)
