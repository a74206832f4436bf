"""Solution for all links as plane-stress bodies at all positions, by superposition of unit responses."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import JointCompliance, Section, Taper
from fem_check.linear.frame import Frame, FramePlace
from fem_check.linear.loads import concentrated
from fem_check.linear.solution import SolvedFrame, solved_frame
from fem_check.solid.outline import OutlineError, SolidOutline, Strip, grid
from fem_check.solid.responses import Responses, responses
from rigid import LineLoad, Link, Motion, Reals
from rigid.arrays import Columns, Complexes

POISSON = 0.3  # default of Poisson's ratio
ACROSS = 4  # default number of elements across the depth
MIN_ACROSS = 2


class SolidSolution(Struct, frozen=True, eq=False):
    """Solution of the plane-stress bodies.

    Attributes
    ----------
    motion
        Motion of the mechanism.
    across
        Number of elements across the depth of each beam.
    bodies
        Responses to unit loads, by link index.
    loads
        Factors by which the unit loads of `Responses` are multiplied, shape (loads, positions), by link index.
    left_out
        Reason why a link has no body, by link name: a beam is rigid or thin-walled, the block of a slider moves along
        the link, or its beams have no valid outline.
    xi
        x'/l of the stations on the axis of each beam; empty for beams of links without a body.
    chord
        Deflection of these stations [m], shape (positions, stations). It is measured from the line through both ends of
        the beam, i.e. through the mean positions of the disks at the pins there.
    """

    motion: Motion
    across: int
    bodies: Mapping[int, Responses]
    loads: Mapping[int, Reals]
    left_out: Mapping[str, str]
    xi: tuple[Reals, ...]
    chord: tuple[Reals, ...]

    def displacement(self, link: int, position: int) -> Complexes:
        """Return the displacements of the element corners in the axes of the link (complex) [m], shape (corners,).

        They are relative to axes that move with the pins at the ends of the first beam.
        """
        response = self.bodies[link]
        strip = response.body.outline.strips[0]
        loads, start = self.loads[link][:, position], response.body.outline.points[strip.start]
        moved, pins = loads @ response.nodes, loads @ response.points
        way = response.body.outline.way(strip)
        turn = ((pins[strip.end] - pins[strip.start]) / way).imag
        return moved - pins[strip.start] - 1j * turn * (response.body.grid.points - start)

    def __repr__(self) -> str:
        elements = sum(len(found.body.grid.cells) for found in self.bodies.values())
        return f"SolidSolution({len(self.bodies)} links, {elements} elements, {self.motion.columns[-1]} positions)"


def solve_solid(
    motion: Motion,
    sections: Sequence[Section],
    poisson: float | Sequence[float] = POISSON,
    across: int = ACROSS,
    joints: Mapping[str, JointCompliance] | None = None,
) -> SolidSolution:
    """Compute the chord deflection of the links as plane-stress bodies at all positions.

    Line loads and inertia act on the whole body. Joint forces, point loads and the inertia of point masses are the same
    as in `solve`, and are distributed over disks at the pins. Links without a plane body are skipped.

    Parameters
    ----------
    motion
        Motion of one design.
    sections
        One per beam, in the order of `Mechanism.beams`. A body has the depth of the rectangle with the same EA and EI
        along the taper.
    poisson
        Poisson's ratio, one for all beams or one per beam. A link uses the value of its first beam.
    across
        Number of elements across the depth; must be even.
    joints
        Compliance and misfit of joints, by name.

    Raises
    ------
    ValueError
        If the number of sections is wrong, there are several designs, `across` is not a positive even number, or the
        friction does not converge at some position.

    Examples
    --------
    A beam of length l under a uniform load q sags by 5 q l^4/(384 EI), and a little more due to shear:

    >>> from rigid import Beam, LineLoad, Link, Mechanism, Slider, motion
    >>> links = Link("ground", {"A": 0}), Link("beam", {"A": 0, "B": 1.0}, (Beam("A", "B"),)), Link("block", {"B": 0})
    >>> guide = Slider("guide", "block", "ground", "B", 0.0, 1.0)
    >>> load = LineLoad("beam", 0, -1j, -1j)
    >>> mechanism = Mechanism(links, (), {"A": 0, "B": 1.0}, (guide,), loads=(load,))
    >>> found = solve_solid(motion(mechanism, np.zeros((0, 1))), [Section(EA=12.0, EI=0.01)])
    >>> round(float(-found.chord[0].min() / (5 / 384 / 0.01)), 3)
    1.024
    """
    if len(sections) != len(motion.mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(motion.mechanism.beams)} beams")
    if len(motion.columns) != 1 or any(np.ndim(value) for part in sections for value in (part.EA, part.EI)):
        raise ValueError(f"columns of shape {motion.columns}: expected one design")
    if across < MIN_ACROSS or across % 2:
        raise ValueError(f"{across} elements across: expected an even number")
    solved = solved_frame(motion, sections, 1, joints or {})
    frame, pushes = solved.frame, list(_pushes(solved))
    given = np.broadcast_to(np.asarray(poisson, float), len(sections))
    if motion.mechanism.friction and not all(np.isfinite(part).all() for *_, push in pushes for part in push):
        raise ValueError("friction may lock the mechanism")
    bodies: dict[int, Responses] = {}
    loads: dict[int, Reals] = {}
    left_out: dict[str, str] = {}
    for at, first in frame.root.items():
        link = motion.mechanism.links[at]
        parts = sections[first : first + len(link.beams)]
        if not parts:
            continue
        if reason := _no_body(frame, at, parts):
            left_out[link.name] = reason
            continue
        names = _points(link)
        reached = [(names.index(point), push) for number, point, push in pushes if number == at]
        carrying = tuple(sorted({point for point, _ in reached}))
        bodies[at] = responses(_outline(link, parts), carrying, float(given[first]), across)
        loads[at] = _loads(motion, at, parts, len(names), reached)
    fields = [_chord(frame, bodies, loads, number) for number in range(len(sections))]
    return SolidSolution(
        motion, across, bodies, loads, left_out, tuple(xi for xi, _ in fields), tuple(w for _, w in fields)
    )


def _no_body(frame: Frame, at: int, sections: Sequence[Section]) -> str:
    """Return the reason why a link has no plane body; empty if it has one."""
    if not all(np.isfinite(section.EA) and np.isfinite(section.EI) for section in sections):
        return "a beam is rigid"
    if any(section.thin_walled for section in sections):
        return "a beam is hollow or an I; plane-stress elements cannot model its shear"
    blocks = frame.spots[len(frame.motion.mechanism.beams) :]
    if any(frame.bodies[k].link == at for k, _ in blocks):
        return "a slider's block moves along it"
    try:
        grid(_outline(frame.motion.mechanism.links[at], sections), MIN_ACROSS)
    except OutlineError as error:
        return str(error)
    return ""


def _points(link: Link) -> list[str]:
    """Return the names of the points at which the beams of a link start or end."""
    return list(dict.fromkeys(point for beam in link.beams for point in (beam.start, beam.end)))


def _outline(link: Link, sections: Sequence[Section]) -> SolidOutline:
    names, strips = _points(link), []
    for beam, section in zip(link.beams, sections, strict=True):
        taper = section.taper or Taper()
        EA, EI = _along(section.EA, taper.EA), _along(section.EI, taper.EI)
        mass = _along(beam.mass_per_length, beam.mass_taper)
        strips.append(Strip(names.index(beam.start), names.index(beam.end), EA, EI, mass))
    return SolidOutline(tuple(complex(link.points[name]) for name in names), tuple(strips))


def _along(at_start: Any, taper: Sequence[float]) -> tuple[float, ...]:
    return tuple(float(at_start) * float(factor) for factor in taper)


def _pushes(solved: SolvedFrame) -> Iterator[tuple[int, str, tuple[Any, Any]]]:
    """Yield the joint forces and concentrated loads at ends of beams.

    Each item contains the index of the link, the point, and (force, moment).
    """
    frame = solved.frame
    beamed, rows = frame.motion.mechanism.beams, [row for tie in solved.constraints for row in tie.rows]

    def on_end(place: FramePlace, force: Columns, moment: Columns) -> Iterator[tuple[int, str, tuple[Any, Any]]]:
        if place.body < len(beamed):
            at, beam = beamed[place.body]
            yield at, beam.start if place.spot is None else beam.end, (force, moment)

    for number, row in enumerate(rows):
        unit = solved.multipliers[..., number] * (solved.wrenches.size if row.turns else 1.0)
        reached = [(place, force, moment) for place, force, moment in row.parts if place is not None]
        if len(reached) == 2 and len({frame.bodies[place.body].link for place, _, _ in reached}) == 1:
            continue  # skip welds within a link
        for place, force, moment in reached:
            yield from on_end(place, force * unit, moment * unit)
    for where, force, moment in (*concentrated(frame), *solved.friction):
        if where is not None:
            yield from on_end(where, force, moment)


def _loads(
    motion: Motion,
    at: int,
    sections: Sequence[Section],
    points: int,
    pushes: Sequence[tuple[int, tuple[Columns, Columns]]],
) -> Reals:
    """Return the factors of the unit loads of a link, in the order of `Responses`, shape (loads, positions)."""
    mechanism, back = motion.mechanism, np.conj(motion.direction[at])
    felt = back * (motion.acceleration[at] - mechanism.gravity)
    on_points = np.zeros((points, 3, *motion.columns))
    for point, (force, moment) in pushes:
        own = back * force
        on_points[point] += np.stack([np.broadcast_to(part, motion.columns) for part in (own.real, own.imag, moment)])
    on_strips = np.zeros((len(sections), 5, *motion.columns))
    on_strips[:, 4] = np.array([section.strain for section in sections])[:, None]
    link = mechanism.links[at]
    for load in mechanism.loads:
        if isinstance(load, LineLoad) and load.link == link.name:
            beam = link.beams[load.beam]
            way = link.points[beam.end] - link.points[beam.start]
            turned = 1.0 if load.turning else np.conj(way / np.abs(way)) * back
            factor = turned * (1.0 if load.law is None else load.law(motion))
            for k, value in enumerate((load.start * factor, load.end * factor)):
                on_strips[load.beam, 2 * k] += np.real(value)
                on_strips[load.beam, 2 * k + 1] += np.imag(value)
    spin = np.array((-(motion.angular_velocity[at] ** 2), motion.angular_acceleration[at]))
    whole = np.array((felt.real, felt.imag)), spin, on_points.reshape(-1, *motion.columns)
    return np.concatenate((*whole, on_strips.reshape(-1, *motion.columns)))


def _chord(
    frame: Frame, bodies: Mapping[int, Responses], loads: Mapping[int, Reals], number: int
) -> tuple[Reals, Reals]:
    """Return xi of stations on the axis of a beam, and the chord deflection there [m], shape (positions, stations)."""
    at = frame.bodies[number].link
    if at not in bodies:
        return np.zeros(0), np.zeros((*frame.motion.columns, 0))
    strip = number - frame.root[at]
    body = bodies[at].body
    xi, way = body.grid.xi[strip], body.outline.way(body.outline.strips[strip])
    across = (bodies[at].on_axis(strip) * np.conj(way / abs(way))).imag
    bent = across - across[:, :1] * (1 - xi) - across[:, -1:] * xi
    return xi, loads[at].T @ bent
