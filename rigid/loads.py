"""What the links feel: distributed inertia loads, point loads, and the joint forces that balance them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce
from typing import Any

import numpy as np

from rigid.closure import Columns
from rigid.conditioning import amplified, asked_force, extents, hopeless
from rigid.constants import beam_table, mass_table
from rigid.forces import JointForces, joint_forces, self_stresses
from rigid.mechanism import LineLoad, Reals
from rigid.motion import Motion
from rigid.plane import cross

UNSTRESSED = 1e-9


def beam_loads(motion: Motion) -> Any:
    """Distributed load of every beam in its own axes, as a polynomial in xi = x'/l.

    Inertia and weight, `q = -m' conj(e) (a0 - g + (i eps - w^2) e x')`, and the line loads.

    Returns
    -------
    q_x + i q_y [N/m], complex, shape (2, beams, ..., positions), beams in the order of `Mechanism.beams`; more
    coefficients where the mass per length is not constant.
    """
    mechanism = motion.mechanism
    table = beam_table(mechanism, len(motion.columns))
    turning = motion.turning[table.link]
    felt = _felt(motion, table.link)
    if table.offset:
        felt = felt + turning * motion.direction[table.link] * table.start
    loads = np.empty((1 + len(table.mass_taper), *felt.shape), complex)
    felt = felt * np.conj(beam_directions(motion))
    mass, moment = table.resistance
    np.multiply(felt, mass[0], out=loads[0])
    np.multiply(turning, moment[0], out=loads[1])
    if len(loads) > 2:
        loads[2:] = 0.0
        loads[1:-1] += mass[1:] * felt
        loads[2:] += moment[1:] * turning
    for load in mechanism.loads:
        if isinstance(load, LineLoad):
            number = mechanism.beam_number(load.link, load.beam)
            start, end = line_load_in_beam_axes(motion, load)
            loads[0, number] += start
            loads[1, number] += end - start
    return loads


def _felt(motion: Motion, links: Any) -> Any:
    """What mass at the origins of some links feels: their acceleration less gravity [m/s^2], complex."""
    acceleration, gravity = motion.acceleration[links], motion.mechanism.gravity
    return acceleration - gravity if gravity else acceleration


def beam_directions(motion: Motion) -> Any:
    """Unit vectors of all beams' x' axes, complex, shape (beams, ..., positions)."""
    table = beam_table(motion.mechanism, len(motion.columns))
    direction = motion.direction[table.link]
    return direction if table.aligned else direction * table.unit


def line_load_in_beam_axes(motion: Motion, load: LineLoad) -> tuple[Columns, Columns]:
    """A line load at the beam's two ends in the beam's axes [N/m], complex."""
    number = motion.mechanism.beam_number(load.link, load.beam)
    turned = 1.0 if load.turning else np.conj(beam_directions(motion)[number])
    factor = turned if load.law is None else turned * load.law(motion)
    return load.start * factor, load.end * factor


def point_loads(motion: Motion) -> Iterator[tuple[int, str, Columns, Columns]]:
    """Concentrated loads of the links: inertia and weight of lumps, and the loads given at points.

    Yields
    ------
    Link's number, point's name, force in the ground's axes [N], complex, and moment about the point [N m].
    """
    mechanism = motion.mechanism
    for at, link in enumerate(mechanism.links):
        for lump in link.lumps if at else ():
            arm = motion.direction[at] * (link.points[lump.point] + lump.offset)
            force = -lump.mass * (motion.acceleration[at] - mechanism.gravity + motion.turning[at] * arm)
            moment = -lump.inertia * motion.angular_acceleration[at]
            if np.ndim(lump.offset) or lump.offset:
                moment = moment + cross(motion.direction[at] * lump.offset, force)
            yield at, lump.point, force, moment
    for load in mechanism.loads:
        if not isinstance(load, LineLoad):
            for name, point, force, moment in load.forces(motion):
                yield mechanism.index[name], point, force, moment


def link_loads(motion: Motion) -> tuple[list[Columns], list[Columns]]:
    """All loads of every link but the joint forces, reduced to the origin of its axes.

    Returns
    -------
    Two lists over the links: force in the ground's axes [N], complex, and moment [N m], shape (..., positions).
    """
    mechanism = motion.mechanism
    mass, first, second = mass_table(mechanism, len(motion.columns))
    moving = slice(1, None)
    felt, turning = _felt(motion, moving), motion.turning[moving]
    back = motion.direction[moving] * -first[moving]
    force = [0.0, *(turning * back - mass[moving] * felt)]
    moment = [0.0, *(cross(back, felt) - second[moving] * turning.imag)]
    for at, pull, twist in given_loads(motion):
        force[at] = force[at] + pull
        moment[at] = moment[at] + twist
    return force, moment


def given_loads(motion: Motion) -> Iterator[tuple[int, Columns, Columns]]:
    """The loads of a mechanism one by one, inertia and weight left out.

    Yields
    ------
    Link's number, force in the ground's axes [N], complex, and moment about the origin of the link's axes [N m].
    """
    mechanism = motion.mechanism
    for load in mechanism.loads:
        if isinstance(load, LineLoad):
            yield mechanism.index[load.link], *_line_load(motion, load)
            continue
        for name, point, pull, twist in load.forces(motion):
            at = mechanism.index[name]
            yield at, pull, cross(motion.direction[at] * mechanism.links[at].points[point], pull) + twist


def _line_load(motion: Motion, load: LineLoad) -> tuple[Columns, Columns]:
    """Resultant of a line load: force, and moment about the origin of the link's axes."""
    mechanism = motion.mechanism
    at, number = mechanism.index[load.link], mechanism.beam_number(load.link, load.beam)
    link = mechanism.links[at]
    length = beam_table(mechanism, len(motion.columns)).length[number]
    along = beam_directions(motion)[number]
    start, end = (value * along for value in line_load_in_beam_axes(motion, load))
    pull = length * (start + end) / 2
    arm = motion.direction[at] * link.points[link.beams[load.beam].start]
    return pull, cross(arm, pull) + length**2 * cross(along, start / 6 + end / 3)


def reactions(motion: Motion) -> JointForces:
    """Forces in all joints and on the ground; nan at singular positions, and where statics alone does not tell them.

    In the order of `motion.structure.joints`; each acts on the joint's child link, its opposite on the parent.
    """
    found = balancing_forces(motion)
    if motion.suspect:
        found.mark(hopeless(motion, force_condition(motion, found)))
    for state in self_stresses(motion.closures):
        for values, parts in ((found.force, state.force), (found.moment, state.moment)):
            for number, part in enumerate(parts):
                values[number] = _open_where(values[number], part)
    return found


def _open_where(value: Columns, part: Columns) -> Columns:
    """nan in every component that a self-stress has a part in."""
    if not np.iscomplexobj(part):
        return np.where(np.abs(part) > UNSTRESSED, np.nan, value) if np.any(np.abs(part) > UNSTRESSED) else value
    result = np.empty(np.broadcast(value, part).shape, complex)
    result.real = np.where(np.abs(part.real) > UNSTRESSED, np.nan, np.real(value))
    result.imag = np.where(np.abs(part.imag) > UNSTRESSED, np.nan, np.imag(value))
    return result


def balancing_forces(motion: Motion, more: Iterable[tuple[int, Columns, Columns]] = ()) -> JointForces:
    """Joint forces in balance with all loads: the only ones, or where there are self-stresses one set of many.

    `more` are loads besides the mechanism's: link's number, force in the ground's axes [N], complex, and moment about
    the origin of the link's axes [N m].
    """
    with np.errstate(invalid="ignore", over="ignore"):
        force, moment = link_loads(motion)
        for at, pull, twist in more:
            force[at], moment[at] = force[at] + pull, moment[at] + twist
        return joint_forces(motion.closures, force, moment)


def force_condition(motion: Motion, forces: JointForces) -> Reals:
    """By how much round-off grows in joint forces, shape (..., positions): like `Motion.condition`, and more.

    Where loads nearly balance without them, what is left of the forces is wrong by a larger share.
    """
    mechanism = motion.mechanism
    mass, first, second = (np.abs(part) for part in mass_table(mechanism, len(motion.columns)))
    with np.errstate(all="ignore"):
        felt, turning = np.abs(motion.acceleration) + abs(mechanism.gravity), np.abs(motion.turning)
        force: list[Any] = list(mass * felt + first * turning)
        moment: list[Any] = list(first * felt + second * turning)
        for at, pull, twist in given_loads(motion):
            force[at] = force[at] + np.abs(pull)
            moment[at] = moment[at] + np.abs(twist)
        pulls = iter(forces.force)
        for closed in motion.closures:
            for place, pull in zip(closed.joints, pulls, strict=False):
                if place.joint.parent not in closed.group.links:
                    force[place.joint.parent] = force[place.joint.parent] + np.abs(pull)
        whole = [turn + size * push for turn, size, push in zip(moment, extents(mechanism), force, strict=True)]
        asked = (asked_force(closed, force, whole) for closed in motion.closures)
        greatest = reduce(np.maximum, (np.abs(pull) for pull in forces.force), 0.0)
        found: Reals = motion.condition * amplified(reduce(np.maximum, asked, 0.0), greatest)
        return found


def drive_efforts(motion: Motion, forces: JointForces) -> Reals:
    """Moment [N m] or force [N] of every drive along its coordinate, shape (drives, ..., positions)."""
    efforts = np.empty((len(motion.mechanism.drives), *motion.columns))
    places = motion.places
    for number, place in enumerate(places):
        joint = place.joint
        if joint.drive is not None:
            push = forces.moment[number]
            if place.along is not None:
                push = _along(place.along, forces.force[number])
            efforts[joint.drive] = joint.sense * push
    return efforts


def _along(way: Columns, force: Columns) -> Columns:
    """Component of a force along a way; one across it may be open."""
    parts = (np.real(way), np.real(force)), (np.imag(way), np.imag(force))
    return sum(np.where(part == 0, 0.0, part * of_force) for part, of_force in parts)
