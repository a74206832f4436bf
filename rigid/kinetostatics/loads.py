"""Loads on the links: inertia and weight along beams, line loads and point loads."""

from collections.abc import Iterator

import numpy as np

from rigid.arrays import Columns, Complexes, Reals
from rigid.constants import beam_constants, mass_constants
from rigid.kinematics import Motion
from rigid.parts import LineLoad, Load, MechanismError, PointForce
from rigid.plane import ZERO, cross


def beam_loads(motion: Motion) -> Complexes:
    """Return the distributed load of each beam in beam axes, as a polynomial in xi = x'/l.

    The load is the sum of inertia and weight, `q = -m' conj(e) (a0 - g + (i eps - w^2) e x')`, and of line loads.

    Returns
    -------
    Coefficients of q_x + i q_y [N/m], complex, shape (2, beams, ..., positions), in the order of `Mechanism.beams`. If
    the mass per unit length varies along beams, there are more than two coefficients.
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
    """Return the moment per unit length due to the rotary inertia of each beam, as a polynomial in xi.

    Returns
    -------
    Coefficients of `-rho I eps` [N], positive counter-clockwise, shape (n, beams, ..., positions); None if all are
    zero.
    """
    table = beam_constants(motion.mechanism, len(motion.columns))
    if table.rotary is None:
        return None
    return -table.rotary * motion.turning[table.link].imag


def _relative_acceleration(motion: Motion, links: slice | list[int]) -> Complexes:
    """Return the acceleration of the origin of each of the given links, minus gravity (complex) [m/s^2]."""
    acceleration, gravity = motion.acceleration[links], motion.mechanism.gravity
    return acceleration - gravity if isinstance(gravity, np.ndarray) or gravity else acceleration


def beam_directions(motion: Motion) -> Complexes:
    """Return the unit vectors of the x' axes of all beams (complex), shape (beams, ..., positions)."""
    table = beam_constants(motion.mechanism, len(motion.columns))
    direction = motion.direction[table.link]
    return direction if table.aligned else direction * table.unit


def line_load_in_beam_axes(motion: Motion, load: LineLoad) -> tuple[Columns, Columns]:
    """Return the values of a line load at the start and the end of its beam, in beam axes (complex) [N/m]."""
    number = motion.mechanism.beam_number(load.link, load.beam)
    turned = 1.0 if load.turning else np.conj(beam_directions(motion)[number])
    factor = turned if load.law is None else turned * load.law(motion)
    return load.start * factor, load.end * factor


def point_loads(motion: Motion) -> Iterator[tuple[int, str, Columns, Columns]]:
    """Yield all point loads on the links: inertia and weight of lumps, and the loads of the mechanism.

    Yields
    ------
    Link index, point name, force in ground axes (complex) [N], and moment about the point [N m].
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
        If the load acts on a point that is not listed in its `points`.
    """
    known = set(load.points)
    for force in load.forces(motion):
        if force[:2] not in known:
            message = f'a load acts on the point "{force[1]}" of "{force[0]}", which is not among its points'
            raise MechanismError(message, kind="name", links=force[:1])
        yield force


def link_loads(motion: Motion) -> tuple[list[Columns], list[Columns]]:
    """Return the resultant of all loads on each link, except joint forces, at the origin of the link.

    Returns
    -------
    For each link, the force in ground axes (complex) [N], and the moment about the link's origin [N m], shape (...,
    positions) each.
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
    """Yield the resultant of each load in `Mechanism.loads`, without inertia and weight.

    Yields
    ------
    Link index, force in ground axes (complex) [N], and moment about the link's origin [N m].
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
    """Return the resultant of a line load: the force, and the moment about the link's origin."""
    mechanism = motion.mechanism
    at, number = mechanism.index[load.link], mechanism.beam_number(load.link, load.beam)
    link = mechanism.links[at]
    length = beam_constants(mechanism, len(motion.columns)).length[number]
    along = beam_directions(motion)[number]
    start, end = (value * along for value in line_load_in_beam_axes(motion, load))
    pull = length * (start + end) / 2
    arm = motion.direction[at] * link.points[link.beams[load.beam].start]
    return pull, cross(arm, pull) + length**2 * cross(along, start / 6 + end / 3)
