"""Loads on the links: inertia and weight along beams, line loads, point loads."""

from collections.abc import Iterator

import numpy as np

from rigid.arrays import Columns, Complexes, Reals
from rigid.constants import beam_constants, mass_constants
from rigid.kinematics import Motion
from rigid.parts import LineLoad, Load, MechanismError, PointForce
from rigid.plane import ZERO, cross


def beam_loads(motion: Motion) -> Complexes:
    """Distributed load of each beam in its own axes, as a polynomial in xi = x'/l.

    Inertia and weight, `q = -m' conj(e) (a0 - g + (i eps - w^2) e x')`, and line loads.

    Returns
    -------
    q_x + i q_y [N/m], complex, shape (2, beams, ..., positions), beams in the order of `Mechanism.beams`; more
    coefficients for a variable mass per length.
    """
    mechanism = motion.mechanism
    table = beam_constants(mechanism, len(motion.columns))
    turning = motion.turning[table.link]
    relative = _relative_acceleration(motion, table.link)
    if table.offset:
        relative = relative + turning * motion.direction[table.link] * table.start
    loads = np.empty((1 + len(table.mass_taper), *relative.shape), complex)
    relative = relative * np.conj(beam_directions(motion))
    mass, moment = table.resistance
    np.multiply(relative, mass[0], out=loads[0])
    np.multiply(turning, moment[0], out=loads[1])
    if len(loads) > 2:
        loads[2:] = 0.0
        loads[1:-1] += mass[1:] * relative
        loads[2:] += moment[1:] * turning
    for load in mechanism.loads:
        if isinstance(load, LineLoad):
            number = mechanism.beam_number(load.link, load.beam)
            start, end = line_load_in_beam_axes(motion, load)
            loads[0, number] += start
            loads[1, number] += end - start
    return loads


def beam_couples(motion: Motion) -> Reals | None:
    """Moments per length of the beams' rotary inertia, as polynomials in xi.

    Returns
    -------
    `-rho I eps` [N], counter-clockwise on the beam, shape (n, beams, ..., positions), or None if all are zero.
    """
    table = beam_constants(motion.mechanism, len(motion.columns))
    if table.rotary is None:
        return None
    return -table.rotary * motion.turning[table.link].imag


def _relative_acceleration(motion: Motion, links: slice | list[int]) -> Complexes:
    """Acceleration of the origins of some links minus gravity [m/s^2], complex."""
    acceleration, gravity = motion.acceleration[links], motion.mechanism.gravity
    return acceleration - gravity if isinstance(gravity, np.ndarray) or gravity else acceleration


def beam_directions(motion: Motion) -> Complexes:
    """Unit vectors of all beams' x' axes, complex, shape (beams, ..., positions)."""
    table = beam_constants(motion.mechanism, len(motion.columns))
    direction = motion.direction[table.link]
    return direction if table.aligned else direction * table.unit


def line_load_in_beam_axes(motion: Motion, load: LineLoad) -> tuple[Columns, Columns]:
    """Values of a line load at the beam's ends, in the beam's axes [N/m], complex."""
    number = motion.mechanism.beam_number(load.link, load.beam)
    turned = 1.0 if load.turning else np.conj(beam_directions(motion)[number])
    factor = turned if load.law is None else turned * load.law(motion)
    return load.start * factor, load.end * factor


def point_loads(motion: Motion) -> Iterator[tuple[int, str, Columns, Columns]]:
    """Yield point loads of the links: inertia and weight of lumps, and given loads.

    Yields
    ------
    Link number, point name, force in the ground's axes [N], complex, and moment about the point [N m].
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
            for name, point, force, moment in _forces(load, motion):
                yield mechanism.index[name], point, force, moment


def _forces(load: Load, motion: Motion) -> Iterator[PointForce]:
    """Yield the point forces of a load.

    Raises
    ------
    MechanismError
        The load acts on a point that is missing from its `points`.
    """
    known = set(load.points)
    for force in load.forces(motion):
        if force[:2] not in known:
            elsewhere = f'a load acts on the point "{force[1]}" of "{force[0]}", which is not among its points'
            raise MechanismError(elsewhere, kind="name", links=force[:1])
        yield force


def link_loads(motion: Motion) -> tuple[list[Columns], list[Columns]]:
    """All loads of each link except joint forces, reduced to the origin of its axes.

    Returns
    -------
    Two lists over the links: force in the ground's axes [N], complex, and moment [N m], shape (..., positions).
    """
    mechanism = motion.mechanism
    mass, first, second = mass_constants(mechanism, len(motion.columns))
    moving = slice(1, None)
    relative, turning = _relative_acceleration(motion, moving), motion.turning[moving]
    back = motion.direction[moving] * -first[moving]
    force = [ZERO, *(turning * back - mass[moving] * relative)]
    moment = [ZERO, *(cross(back, relative) - second[moving] * turning.imag)]
    for at, pull, couple in given_loads(motion):
        force[at] = force[at] + pull
        moment[at] = moment[at] + couple
    return force, moment


def given_loads(motion: Motion) -> Iterator[tuple[int, Columns, Columns]]:
    """Yield the given loads one by one, without inertia and weight.

    Yields
    ------
    Link number, force in the ground's axes [N], complex, and moment about the origin of the link's axes [N m].
    """
    mechanism = motion.mechanism
    for load in mechanism.loads:
        if isinstance(load, LineLoad):
            yield mechanism.index[load.link], *_line_load(motion, load)
            continue
        for name, point, pull, couple in _forces(load, motion):
            at = mechanism.index[name]
            yield at, pull, cross(motion.direction[at] * mechanism.links[at].points[point], pull) + couple


def _line_load(motion: Motion, load: LineLoad) -> tuple[Columns, Columns]:
    """Resultant of a line load: force, and moment about the origin of the link's axes."""
    mechanism = motion.mechanism
    at, number = mechanism.index[load.link], mechanism.beam_number(load.link, load.beam)
    link = mechanism.links[at]
    length = beam_constants(mechanism, len(motion.columns)).length[number]
    along = beam_directions(motion)[number]
    start, end = (value * along for value in line_load_in_beam_axes(motion, load))
    pull = length * (start + end) / 2
    arm = motion.direction[at] * link.points[link.beams[load.beam].start]
    return pull, cross(arm, pull) + length**2 * cross(along, start / 6 + end / 3)
