"""What the links feel: distributed inertia loads, point loads, and the joint forces that balance them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from rigid.closure import Columns
from rigid.forces import JointForces, joint_forces
from rigid.mechanism import Complex, LineLoad, Link, PointLoad, Real, Reals
from rigid.motion import SINGULAR, Motion
from rigid.plane import cross


def beam_length(link: Link, number: int) -> Real:
    """Length of a link's beam [m]."""
    beam = link.beams[number]
    return np.abs(link.points[beam.end] - link.points[beam.start])


def mass_moments(link: Link) -> tuple[Real, Complex, Real]:
    """Mass [kg], first moment [kg m] and moment of inertia [kg m^2] of a link about the origin of its axes."""
    mass: Any = 0.0
    first: Any = 0.0
    second: Any = 0.0
    for number, beam in enumerate(link.beams):
        start, end = link.points[beam.start], link.points[beam.end]
        part = beam.mass_per_length * beam_length(link, number)
        mass = mass + part
        first = first + part * (start + end) / 2
        second = second + part * (np.abs(start) ** 2 + np.abs(end) ** 2 + np.abs(start + end) ** 2) / 6
    for lump in link.lumps:
        center = link.points[lump.point] + lump.offset
        mass = mass + lump.mass
        first = first + lump.mass * center
        second = second + lump.inertia + lump.mass * np.abs(center) ** 2
    return mass, first, second


def beam_loads(motion: Motion) -> Any:
    """Distributed load of every beam in its own axes, as a polynomial in xi = x'/l.

    Inertia and weight, `q = -m' conj(e) (a0 - g + (i eps - w^2) e x')`, and the line loads.

    Returns
    -------
    q_x + i q_y [N/m], complex, shape (2, beams, ..., positions), beams in the order of `Mechanism.beams`.
    """
    mechanism = motion.mechanism
    loads = np.zeros((2, len(mechanism.beams), *motion.columns), complex)
    first = {}
    number = 0
    for at, link in enumerate(mechanism.links[1:], 1):
        first[link.name] = number
        for beam in link.beams:
            start, way = link.points[beam.start], link.points[beam.end] - link.points[beam.start]
            length = np.abs(way)
            begin = motion.acceleration[at] - mechanism.gravity
            if np.ndim(start) or start:
                begin += motion.turning[at] * motion.direction[at] * start
            own = np.conj(motion.direction[at])
            if np.ndim(way) or way.imag or way.real < 0:
                own *= np.conj(way / length)
            np.multiply(begin, own, out=begin)
            np.multiply(begin, -beam.mass_per_length, out=loads[0, number])
            np.multiply(motion.turning[at], -beam.mass_per_length * length, out=loads[1, number])
            number += 1
    for load in mechanism.loads:
        if isinstance(load, LineLoad):
            at = mechanism.index[load.link]
            ends = line_load_in_beam_axes(motion, at, load)
            loads[0, first[load.link] + load.beam] += ends[0]
            loads[1, first[load.link] + load.beam] += ends[1] - ends[0]
    return loads


def beam_direction(motion: Motion, at: int, number: int) -> Any:
    """Unit vector of a beam's x' axis, complex, shape (..., positions)."""
    link = motion.mechanism.links[at]
    beam = link.beams[number]
    way = link.points[beam.end] - link.points[beam.start]
    return motion.direction[at] * (way / np.abs(way))


def line_load_in_beam_axes(motion: Motion, at: int, load: LineLoad) -> tuple[Columns, Columns]:
    """A line load at the beam's two ends in the beam's axes [N/m], complex."""
    turned = 1.0 if load.turning else np.conj(beam_direction(motion, at, load.beam))
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
        if isinstance(load, PointLoad):
            at = mechanism.index[load.link]
            factor = 1.0 if load.law is None else load.law(motion)
            turned = motion.direction[at] if load.turning else 1.0
            yield at, load.point, load.force * turned * factor, load.moment * factor


def link_loads(motion: Motion) -> tuple[list[Columns], list[Columns]]:
    """All loads of every link but the joint forces, reduced to the origin of its axes.

    Returns
    -------
    Two lists over the links: force in the ground's axes [N], complex, and moment [N m], shape (..., positions).
    """
    mechanism = motion.mechanism
    force: list[Columns] = [0.0] * len(mechanism.links)
    moment: list[Columns] = [0.0] * len(mechanism.links)
    for at, link in enumerate(mechanism.links[1:], 1):
        mass, first, second = mass_moments(link)
        if not np.any(mass) and not np.any(second):
            continue
        felt = motion.acceleration[at] - mechanism.gravity
        arm = motion.direction[at] * first
        force[at] = -(mass * felt + motion.turning[at] * arm)
        moment[at] = -(cross(arm, felt) + second * motion.angular_acceleration[at])
    for load in mechanism.loads:
        at = mechanism.index[load.link]
        link = mechanism.links[at]
        if isinstance(load, PointLoad):
            factor = 1.0 if load.law is None else load.law(motion)
            pull = load.force * (motion.direction[at] if load.turning else 1.0) * factor
            arm, twist = motion.direction[at] * link.points[load.point], load.moment * factor
        else:
            length = beam_length(link, load.beam)
            along = beam_direction(motion, at, load.beam)
            start, end = (value * along for value in line_load_in_beam_axes(motion, at, load))
            pull = length * (start + end) / 2
            arm = motion.direction[at] * link.points[link.beams[load.beam].start]
            twist = length**2 * cross(along, start / 6 + end / 3)
        force[at] = force[at] + pull
        moment[at] = moment[at] + cross(arm, pull) + twist
    return force, moment


def reactions(motion: Motion) -> JointForces:
    """Forces in all joints and on the ground, nan at singular positions.

    In the order of `motion.structure.joints`; each acts on the joint's child link, its opposite on the parent.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        force, moment = link_loads(motion)
        singular = ~(motion.condition <= SINGULAR)
        if singular.any():
            lost = np.where(singular, np.nan, 0.0)
            force = [value + lost for value in force]
        return joint_forces(motion.closures, force, moment)


def drive_efforts(motion: Motion, forces: JointForces) -> Reals:
    """Moment [N m] or force [N] of every drive along its coordinate, shape (drives, ..., positions)."""
    efforts = np.empty((len(motion.mechanism.drives), *motion.columns))
    places = [place for closed in motion.closures for place in closed.joints]
    for number, place in enumerate(places):
        joint = place.joint
        if joint.drive is not None:
            push = forces.moment[number]
            if place.along is not None:
                push = forces.force[number].real * np.real(place.along) + forces.force[number].imag * np.imag(
                    place.along
                )
            efforts[joint.drive] = joint.sense * push
    return efforts
