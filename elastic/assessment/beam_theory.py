"""Error of beam theory itself: deflection by shear, by moments that come in at the ends of beams, and at corners."""

from __future__ import annotations

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

NEAR_END = 1 / 8  # of the length of a beam, within which a moment that comes in has become that of a beam
STATIONS = 33  # along a beam, at which deflections are compared
INTRODUCED = 0.28  # by M/kGA of a moment M that comes in at an end, a pin shifts: measured on plane bodies
CORNER, SHARPER = 0.275, 2.15  # depths, times tan(turn/2) to this power, for which a corner is stiff: measured likewise
SHARPEST = 2 * np.pi / 3  # turn, beyond which nothing was measured


def sections_with_shear(sections: Sequence[Section], poisson: float = POISSON) -> tuple[Section, ...]:
    """Sections of which all that bend and stretch also shear.

    By `Section.shear_rigidity` where it is known, else as a rectangle of the same EA: k = 10 (1 + nu)/(12 + 11 nu).

    Parameters
    ----------
    sections
        One per beam.
    poisson
        Poisson's ratio where nothing is known.
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
    """Greatest change that shear would bring to the deflection from the chord, over the largest of every member.

    Solved once more with shear; 0 of beams that shear already, or cannot bend.

    Parameters
    ----------
    poisson
        Poisson's ratio of beams of which no shear rigidity is known.

    Returns
    -------
    Shape (beams, ...).

    Examples
    --------
    A square bar of 1 m, 10 cm deep, between two supports: 48 EI/(5 kGA l^2) = 2.45 %.

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
    if _told_by_statics(deflection) and not any(section.taper for section in sheared):
        more = _shear_chord(deflection, sheared, xi)
    else:
        more = sample(solve(deflection.motion, sheared, deflection.joints, deflection.added), "chord", xi) - without
    return _over_largest(deflection, _greatest(more), _greatest(without))


def _told_by_statics(deflection: Deflection) -> bool:
    """Whether statics alone tells the section forces, and they go on without a jump along every member."""
    mechanism, closures = deflection.motion.mechanism, deflection.motion.closures
    undivided = deflection.division.whole and members_of(mechanism).whole and not trees_of(mechanism).cuts
    return undivided and not any(closed.redundancy for closed in closures)


def _shear_chord(deflection: Deflection, sheared: Sequence[Section], xi: Reals) -> AtStations:
    """Deflection from the chord by shear where the forces stay as they are, shape of `sample`.

    w' = V/kGA = M'/kGA, so it is M from the line through its values at the ends, over kGA.
    """
    moment, ndim = sample(deflection, "M", xi), len(deflection.motion.columns)
    line = moment[..., :1] * (1.0 - xi) + moment[..., -1:] * xi
    pairs = zip(sheared, deflection.sections, strict=True)
    added = [0.0 if new is old else 1.0 / np.asarray(new.kGA, float) for new, old in pairs]
    chord: AtStations = (moment - line) * per_row(added, ndim, float)[..., None]
    return chord


def introduction_share(deflection: Deflection, poisson: float = POISSON) -> PerBeam:
    """Estimated deflection by the introduction of moments at the ends of beams, over the largest of the member.

    Beam theory has a moment, of a drive or a slider, act at a point; in a body it comes in through a pin, and takes
    about a depth to become that of a beam. The pin's place shifts across by some 0.28 M/kGA. A moment that passes from
    one beam of a link to the next counts as far as they form a corner.

    Returns
    -------
    Shape (beams, ...).
    """
    sections = sections_with_shear(deflection.sections, poisson)
    moments = _greatest(_introduced(sample(deflection, "M", [0.0, 1.0]), _meetings(deflection.motion.mechanism)))
    chord = sample(deflection, "chord", np.linspace(0.0, 1.0, STATIONS))
    soft = np.array([np.broadcast_to(_softest(section), moments.shape[1:]) for section in sections])
    return _over_largest(deflection, INTRODUCED * soft * moments, _greatest(chord))


def beyond_beam_theory(deflection: Deflection, poisson: float = POISSON) -> Deflection:
    """Deflection with an estimate of the error of beam theory: shear, moments that come in at ends, and stiff corners.

    Solved once more: beams shear as those of `sections_with_shear`, and next to an end at which a moment comes in they
    shift across by as much as `introduction_share` says, within about `NEAR_END` of their length. A corner of a link
    bends less than its beams would there. The same object where nothing is left out.

    Parameters
    ----------
    poisson
        Poisson's ratio of beams of which no shear rigidity is known.
    """
    sheared = sections_with_shear(deflection.sections, poisson)
    M, meetings = sample(deflection, "M", [0.0, 1.0]), _meetings(deflection.motion.mechanism)
    moments, columns = _introduced(M, meetings), deflection.motion.columns
    soft = np.array([np.broadcast_to(_softest(section), moments.shape[1:-2]) for section in sheared])
    shift = -INTRODUCED * soft.reshape(-1, *(np.shape(soft)[1:] or (1,) * (len(columns) - 1)), 1, 1) * moments
    kink = _stiff_corners(M, meetings, deflection.sections)
    if sheared == deflection.sections and not (shift.any() or kink.any()):
        return deflection
    length = deflection.length[..., None]
    across, turned = 1j * _near_ends(shift / length * [1.0, -1.0]), _near_ends(kink / length)
    return solve(deflection.motion, sheared, deflection.joints, _strained(deflection, np.array([across, turned])))


def _near_ends(at_ends: Numbers) -> Numbers:
    """Polynomials along the beams that have integrals over xi near their starts and ends, the last axis."""
    start, end = np.moveaxis(at_ends, -1, 0)
    rise = round(1.0 / NEAR_END)
    rates: Numbers = rise * np.array([start * comb(rise - 1, k) * (-1.0) ** k for k in range(rise)], complex)
    rates[-1] += rise * end
    return rates


def _stiff_corners(M: AtStations, meetings: Meetings, sections: Sequence[Section]) -> AtStations:
    """Rotations that beam theory has too much at both ends of every beam, where it forms a corner with another.

    Half each of M/EI times the length for which the corner is stiff, in depths of the rectangle of the same EA and EI.
    """
    stiff = -CORNER / 2 * np.tan(np.minimum(_turns(meetings, sections), SHARPEST) / 2) ** SHARPER
    kink: AtStations = np.zeros_like(M)
    for number in np.flatnonzero(stiff.any(axis=1)).tolist():
        section = sections[number]
        soft = np.sqrt(12.0 / (np.asarray(section.EA, float) * np.asarray(section.EI, float)))
        depths = np.broadcast_to(np.reshape(soft, np.shape(soft)[:-1]), M.shape[1:-2])
        kink[number] = stiff[number] * depths[..., None, None] * M[number]
    return kink


def _turns(meetings: Meetings, sections: Sequence[Section]) -> Reals:
    """Angle by which the straightest other beam of its link turns off at both ends of every beam, shape (beams, 2).

    None where a beam that meets is hollow or an I: such corners are no plane bodies.
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
    """By link and point the beams that end there: number, which end, and unit vector away from the point."""
    nodes: Meetings = {}
    for number, (at, beam) in enumerate(mechanism.beams):
        points = mechanism.links[at].points
        way = np.ravel(points[beam.end] - points[beam.start])[0]
        for end, (point, out) in enumerate(((beam.start, way), (beam.end, -way))):
            nodes.setdefault((at, point), []).append((number, end, out / abs(out)))
    return nodes


def _strained(deflection: Deflection, strain: VectorCoefficients) -> AddedLoads:
    """The loads of a deflection besides the motion's, with more strain that no force makes."""
    loads = deflection.added
    if loads is None:
        none = (0.0,) * len(deflection.motion.structure.joints)
        return AddedLoads(np.zeros((1, *strain.shape[2:]), complex), (), (), none, none, strain)
    if loads.strain is None:
        return replace(loads, strain=strain)
    return replace(loads, strain=np.stack([added(*parts) for parts in zip(loads.strain, strain, strict=True)]))


def _introduced(M: AtStations, meetings: Meetings) -> AtStations:
    """Moments that come in at both ends of every beam [N m], with the sign of M, shape (beams, ..., positions, 2).

    From outside all of it, from other beams of the link as far as they turn off: none where one goes on straight.
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
    """1/kGA, the larger of a beam's two ends."""
    taper = section.taper or Taper()
    factor = min(np.polynomial.polynomial.polyval(xi, taper.kGA) for xi in (0.0, 1.0))
    return np.reshape(1.0 / (np.asarray(section.kGA, float) * factor), np.shape(section.kGA)[:-1])


def _greatest(values: AtStations) -> PerBeam:
    """Largest magnitude over positions and stations, the last two axes; unknown values do not count."""
    greatest: PerBeam = np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=(-2, -1), initial=0.0)
    return greatest


def _over_largest(deflection: Deflection, change: PerBeam, largest: PerBeam) -> PerBeam:
    """Greatest changes of every beam's member over the base of its relative errors; 0 where nothing bends."""
    members = members_of(deflection.motion.mechanism)
    taken, change = reference_deflection(members.greatest(largest)), members.greatest(change)
    share: PerBeam = np.divide(change, taken, out=np.zeros_like(change), where=taken > 0)
    return share
