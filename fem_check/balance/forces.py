"""Resultant forces and moments on the whole mechanism, and gaps of the joints."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from elastic import Deflection, displacement_of
from fem_check.balance.masses import Masses, gauss, places, size_of
from rigid import LineLoad, Motion, PointLoad, position_of
from rigid.arrays import Complex, Complexes, Reals
from rigid.plane import cross


def openings(motion: Motion) -> Reals:
    """Return the gaps of pins, welds and sliders [m], shape (gaps, positions).

    A wrong angle between the links of a weld or slider is also a gap: the angle times the size of the mechanism.
    """
    mechanism = motion.mechanism
    names = sorted({name for link in mechanism.links for name in link.points})
    rows = [np.zeros(motion.columns)]
    for name in names:
        holders = [link.name for link in mechanism.links if name in link.points]
        rows += [
            np.abs(position_of(motion, first, name) - position_of(motion, second, name))
            for first, second in combinations(holders, 2)
        ]
    for weld in mechanism.welds:
        expected = motion.direction[mechanism.index[weld.on]] * weld.turn
        turned = np.abs(motion.direction[mechanism.index[weld.link]] - expected)
        rows.append(turned * size_of(motion, np.isfinite(expected)))
    for slider in mechanism.sliders:
        link, on = mechanism.index[slider.link], mechanism.index[slider.on]
        line = motion.direction[on] * slider.direction
        foot = motion.origin[on] + motion.direction[on] * slider.origin
        way = position_of(motion, slider.link, slider.point) - foot
        turned = np.abs(motion.direction[link] - motion.direction[on] * slider.turn)
        rows += [np.abs(cross(line, way)), turned * size_of(motion, np.isfinite(way))]
    return np.array(rows)


def ground_moment(deflection: Deflection, centre: Complex) -> Reals:
    """Return the moment of the mechanism on the ground about a point [N m], shape (positions,)."""
    return deflection.forces.ground_moment - cross(centre, deflection.forces.ground_force)


def applied(motion: Motion, masses: Masses, centre: Complex) -> tuple[Complexes, Reals]:
    """Return the resultant force (complex) [N] and moment about `centre` [N m] of gravity and all loads."""
    weight = masses.mass * (motion.mechanism.gravity + 0j)
    force = np.zeros(motion.columns, complex) + weight.sum()
    moment = cross(places(motion, masses) - centre, weight).sum(axis=0)
    for load in motion.mechanism.loads:
        for at, push, couple in _line_load(motion, load) if isinstance(load, LineLoad) else _point_load(motion, load):
            force = force + push
            moment = moment + cross(at - centre, push) + couple
    return force, moment


def _point_load(motion: Motion, load: Any) -> Sequence[tuple[Any, Any, Any]]:
    return [(position_of(motion, link, point), force, moment) for link, point, force, moment in load.forces(motion)]


def _line_load(motion: Motion, load: LineLoad) -> Sequence[tuple[Any, Any, Any]]:
    """Return a line load as point forces at the Gauss points of its beam: position, force, and moment 0."""
    at = motion.mechanism.index[load.link]
    link = motion.mechanism.links[at]
    beam = link.beams[load.beam]
    start, vector = link.points[beam.start], link.points[beam.end] - link.points[beam.start]
    axis = motion.direction[at] * vector / np.abs(vector) if load.turning else 1.0
    factor = (1.0 if load.law is None else load.law(motion)) * axis * np.abs(vector)
    return [
        (
            motion.origin[at] + motion.direction[at] * (start + xi * vector),
            (load.start + xi * (load.end - load.start)) * factor * weight,
            0.0,
        )
        for xi, weight in zip(*gauss(), strict=True)
    ]


def shifted(deflection: Deflection, masses: Masses, moved: Complexes) -> Reals:
    """Return the additional moment of gravity, point loads and forces on the ground due to displacements [N m].

    `moved` are the displacements of the masses (complex), shape (masses, positions).
    """
    motion = deflection.motion
    pushed: Reals = cross(moved, masses.mass * (motion.mechanism.gravity + 0j)).sum(axis=0)
    for load in motion.mechanism.loads:
        for link, point, force, _ in load.forces(motion) if isinstance(load, PointLoad) else ():
            pushed = pushed + cross(displacement_of(deflection, link, point), force)
    for joint, force in zip(motion.structure.joints, deflection.forces.force, strict=True):
        if joint.parent == 0 and not joint.turns:  # the force of a block on the ground moves with the displaced block
            pushed = pushed + cross(
                displacement_of(deflection, joint.child, motion.mechanism.slider_points[joint.name]), force
            )
    return pushed
