"""Distributed and concentrated loads on the bodies, including inertia."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from fem_check.linear.frame import Frame, FramePlace
from rigid import LineLoad
from rigid.arrays import Complexes, Reals
from rigid.plane import cross


def distributed(frame: Frame, stations: Reals) -> Complexes:
    """Return the load per length of each beam at stations, in beam axes.

    It is the sum of inertia, weight and line loads. Inertia and weight are `m' (g - a)`, with the mass per length m',
    the gravity vector g and the acceleration a of the point.

    Parameters
    ----------
    stations
        Values of xi = x'/l, shape (stations,).

    Returns
    -------
    q_x + i q_y (complex) [N/m], shape (stations, beams, ..., positions).
    """
    motion, mechanism = frame.motion, frame.motion.mechanism
    beams = mechanism.beams
    q = np.zeros((len(stations), len(beams), *motion.columns), complex)
    lines = [load for load in mechanism.loads if isinstance(load, LineLoad)]
    for number, (at, beam) in enumerate(beams):
        body = frame.bodies[number]
        axis = motion.direction[at] * (body.way / np.abs(body.way))
        given = [
            load for load in lines if mechanism.links[at].name == load.link and number - frame.root[at] == load.beam
        ]
        for k, xi in enumerate(stations):
            felt = mechanism.gravity - _acceleration(frame, at, body.start + xi * body.way)
            q[k, number] = np.conj(axis) * (
                beam.mass_per_length * np.polynomial.polynomial.polyval(xi, beam.mass_taper) * felt
            )
            for load in given:
                pull = (load.start + xi * (load.end - load.start)) * (1.0 if load.law is None else load.law(motion))
                q[k, number] += pull if load.turning else np.conj(axis) * pull
    return q


def couples(frame: Frame, stations: Reals) -> Reals:
    """Return the moment per unit length of each beam at stations due to the rotary inertia of its sections.

    Returns
    -------
    Moment per unit length [N], shape (stations, beams, ..., positions).
    """
    motion, mechanism = frame.motion, frame.motion.mechanism
    moments = np.zeros((len(stations), len(mechanism.beams), *motion.columns))
    for number, (at, beam) in enumerate(mechanism.beams):
        for k, xi in enumerate(stations):
            there = beam.rotary_inertia * np.polynomial.polynomial.polyval(xi, beam.rotary_taper)
            moments[k, number] = -there * motion.angular_acceleration[at]
    return moments


def concentrated(frame: Frame) -> Iterator[tuple[FramePlace, Any, Any]]:
    """Yield the inertia and weight of point masses, and all loads except line loads.

    Each item contains the place, the force (complex) [N], and the moment [N m].
    """
    motion, mechanism = frame.motion, frame.motion.mechanism
    for at, link in enumerate(mechanism.links):
        for lump in link.lumps:
            place = frame.place(at, lump.point)
            if place is not None:
                force = lump.mass * (
                    mechanism.gravity - _acceleration(frame, at, link.points[lump.point] + lump.offset)
                )
                about_center = -lump.inertia * motion.angular_acceleration[at]
                yield place, force, about_center + cross(motion.direction[at] * lump.offset, force)
    for load in mechanism.loads:
        if not isinstance(load, LineLoad):
            for name, point, force, moment in load.forces(motion):
                place = frame.place(mechanism.index[name], point)
                if place is not None:
                    yield place, force, moment


def _acceleration(frame: Frame, at: int, local: Any) -> Complexes:
    """Return the acceleration of the point `local` (in link axes) in ground axes (complex) [m/s^2]."""
    motion = frame.motion
    turning = 1j * motion.angular_acceleration[at] - motion.angular_velocity[at] ** 2
    return motion.acceleration[at] + turning * motion.direction[at] * local
