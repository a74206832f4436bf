"""Energy and momentum of a moving mechanism, summed over mass points without the program's mechanics."""

import numpy as np

from rigid import LineLoad, PointLoad, acceleration_of, position_of, velocity_of

STATIONS, WEIGHTS = np.polynomial.legendre.leggauss(4)
STATIONS, WEIGHTS = (STATIONS + 1) / 2, WEIGHTS / 2


def mass_points(mechanism):
    """Yield link, local point and mass: Gauss points keep a beam's mass, centre and second moment exactly."""
    for at, link in enumerate(mechanism.links):
        for beam in link.beams if at else ():
            start, way = link.points[beam.start], link.points[beam.end] - link.points[beam.start]
            for xi, weight in zip(STATIONS, WEIGHTS, strict=True):
                yield at, start + xi * way, beam.mass_per_length * abs(way) * weight
        for lump in link.lumps if at else ():
            yield at, link.points[lump.point] + lump.offset, lump.mass


def inertias(mechanism):
    """Return links and moments of inertia of their lumps about the lump centres."""
    return [(at, lump.inertia) for at, link in enumerate(mechanism.links) if at for lump in link.lumps]


def applied(motion):
    """Yield link, local point, force in ground axes and moment of weight and given loads."""
    mechanism = motion.mechanism
    for at, place, mass in mass_points(mechanism):
        yield at, place, mass * mechanism.gravity, 0.0
    for load in mechanism.loads:
        at = mechanism.index[load.link]
        link = mechanism.links[at]
        if isinstance(load, PointLoad):
            yield at, link.points[load.point], load.force * (motion.direction[at] if load.turning else 1), load.moment
        if isinstance(load, LineLoad):
            beam = link.beams[load.beam]
            start, way = link.points[beam.start], link.points[beam.end] - link.points[beam.start]
            for xi, weight in zip(STATIONS, WEIGHTS, strict=True):
                force = (load.start + xi * (load.end - load.start)) * abs(way) * weight
                turned = motion.direction[at] * way / abs(way) if load.turning else 1
                yield at, start + xi * way, force * turned, 0.0


def product(a, b):
    return (np.conj(a) * b).real


def moment(a, b):
    return (np.conj(a) * b).imag


def kinetic_energy(motion):
    points = sum(
        mass * abs(velocity_of(motion, at, place)) ** 2 / 2 for at, place, mass in mass_points(motion.mechanism)
    )
    return points + sum(inertia * motion.angular_velocity[at] ** 2 / 2 for at, inertia in inertias(motion.mechanism))


def kinetic_power(motion):
    """Return the rate of the kinetic energy, m a.v."""
    points = sum(
        mass * product(acceleration_of(motion, at, place), velocity_of(motion, at, place))
        for at, place, mass in mass_points(motion.mechanism)
    )
    return points + sum(
        inertia * motion.angular_velocity[at] * motion.angular_acceleration[at]
        for at, inertia in inertias(motion.mechanism)
    )


def applied_power(motion):
    """Return the power of weight and loads."""
    return sum(
        product(force, velocity_of(motion, at, place)) + twist * motion.angular_velocity[at]
        for at, place, force, twist in applied(motion)
    )


def missing_force(motion):
    """Return applied force minus rate of momentum, and the same moment about the origin: the reaction of the ground."""
    force = sum(pull for _, _, pull, _ in applied(motion))
    twist = sum(moment(position_of(motion, at, place), pull) + twist for at, place, pull, twist in applied(motion))
    for at, place, mass in mass_points(motion.mechanism):
        pull = -mass * acceleration_of(motion, at, place)
        force = force + pull
        twist = twist + moment(position_of(motion, at, place), pull)
    for at, inertia in inertias(motion.mechanism):
        twist = twist - inertia * motion.angular_acceleration[at]
    return force, twist
