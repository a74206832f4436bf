"""Newton's and Euler's laws for the whole mechanism, by differences in time of where its masses are.

What the finite elements share with the answer that they check is the motion with its accelerations. Here neither is
believed: joints have to close, velocities have to be the rate of the places, and the momentum of all masses has to
change as gravity, the given loads and the ground make it. Of `rigid` only the mechanism, the places and velocities of
its links and the forces on the ground are read. Derivation: docs/check.md, "Momentum".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from elastic import Deflection, Section, displacement_of, rotation_of, sample
from rigid import LineLoad, Mechanism, Motion, PointLoad, Posture, Reals, position_of, posture
from rigid.plane import cross

GRANTED = 1e-6
"""Imbalance granted, as a share of the largest force or moment on the ground, velocity or size."""
STEP = 0.01
"""Step of the differences, as a share of the time in which the fastest link turns by a radian."""
EIGHTH = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
SIXTH = (3 / 4, -3 / 20, 1 / 60, 0.0)
"""Central differences of the eighth and the sixth order: by what they differ the better one is known."""
SECOND_EIGHTH = (8 / 5, -1 / 5, 8 / 315, -1 / 560)
SECOND_SIXTH = (3 / 2, -3 / 20, 1 / 90, 0.0)
"""The same of second derivatives; of the middle less twice their sum."""
WITHIN = 0.025
"""Step of the differences of a vibration, as a share of the element of time in which it is a polynomial."""
GAUSS = 8  # places along a beam

MotionNear = Callable[[Reals, Posture], Motion]
Transient = tuple[Callable[[Motion], Deflection], Reals]
"""Deflection of vibrating links at any positions, and the times between which it is smooth [s], shape (edges,)."""


@dataclass(frozen=True)
class Balance:
    """Residuals of the joints and of Newton's and Euler's laws, as shares of their largest part over the positions.

    Attributes
    ----------
    opening
        Largest distance of points that a joint holds together, of the mechanism's size.
    velocity
        Largest difference of velocities of masses from the rate of their places.
    force, moment
        Largest difference of the rate of momentum from the forces that act, of the force on the ground; likewise the
        moments about the origin of coordinates.
    compared
        Number of positions that differences in time tell of: none at a kink of a law, or where friction locks.
    granted
        Share up to which the balance is kept.
    """

    opening: float
    velocity: float
    force: float
    moment: float
    compared: int
    granted: float = GRANTED

    @property
    def largest(self) -> float:
        """The largest share."""
        return max(self.opening, self.velocity, self.force, self.moment)

    @property
    def passed(self) -> bool:
        """Whether positions were compared, and all shares are granted."""
        return self.compared > 0 and self.largest <= self.granted


def balance(
    deflection: Deflection,
    motion_near: MotionNear,
    span: tuple[float, float] = (-math.inf, math.inf),
    cycle: float | None = None,
    granted: float = GRANTED,
    exact: bool = False,
    transient: Transient | None = None,
) -> Balance:
    """Balance of the rate of momentum of all masses and the forces of an answer.

    Parameters
    ----------
    deflection
        The answer, at (positions,).
    motion_near
        The rigid motion at some times [s] where the links are near a given posture: differences are made of it.
    span
        Times between which there is a motion [s].
    cycle
        Its period [s] where the links vibrate: their displacement has momentum too, whose rate is found from even
        positions of a whole cycle; where these are too few, nothing is compared. None for a quasi-static answer, which
        leaves that momentum out.
    granted
        Where the links vibrate, as much as the answer may be off in time and in its coordinates.
    exact
        Displacements of any size are in the answer, with the rotary inertia of the sections as they are carried; else
        their products are left out, as linear elastodynamics leaves them out.
    transient
        Of links that vibrate and do not come back: the rate of what their displacement adds is found by differences
        in time too, at positions far enough from where it is not smooth.
    """
    motion = deflection.motion
    masses = _masses(motion.mechanism, deflection.sections)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = _centre(motion)
        arm = _places(motion, masses) - centre
        rates = _rates(motion, masses, motion_near, span)
        inertia = masses.mass * rates.acceleration
        rotary = (masses.inertia + masses.section * exact) * rates.rotation
        force, moment = _applied(motion, masses, centre)
        out_of_force = inertia.sum(axis=0) - force + deflection.forces.ground_force
        out_of_moment = (cross(arm, inertia) + rotary).sum(axis=0) - moment + _ground_moment(deflection, centre)
        if cycle is not None:
            further = _of_displacements(deflection, masses, centre, cycle, exact)
            out_of_force, out_of_moment = out_of_force + further[0], out_of_moment + further[1]
            if _unresolved(further[0]) > granted:
                out_of_force = np.full(motion.columns, np.nan)
        elif transient is not None:
            further = _of_transient(deflection, masses, centre, rates, motion_near, transient, granted, exact)
            out_of_force, out_of_moment = out_of_force + further[0], out_of_moment + further[1]
        known = rates.known & np.isfinite(out_of_force) & np.isfinite(out_of_moment)
        forces = np.abs(inertia).sum(axis=0) + np.abs(force)
        moments = (np.abs(arm * inertia) + np.abs(rotary)).sum(axis=0) + np.abs(moment)
        return Balance(
            _share(_openings(motion), _size(motion, known), known),
            _share(rates.velocity - _velocities(motion, masses), _largest(rates.velocity, known), known),
            _share(out_of_force, _largest(forces, known), known),
            _share(out_of_moment, _largest(moments, known), known),
            int(known.sum()),
            granted,
        )


@dataclass(frozen=True, eq=False)
class _Masses:
    """All moving masses as points; every array of shape (masses, 1) but `link`.

    Attributes
    ----------
    link
        Number of the link, shape (masses,).
    place
        In the link's axes [m], complex.
    mass, inertia
        [kg], and about the point itself [kg m^2].
    section
        Rotary inertia of the section about the point [kg m^2]: of Timoshenko's beams, which feel it where they bend.
    """

    link: Any
    place: Any
    mass: Any
    inertia: Any
    section: Any


def _masses(mechanism: Mechanism, sections: Sequence[Section]) -> _Masses:
    """Gauss's points of the beams, beam by beam, then the centres of the lumps."""
    rows: list[tuple[int, Any, Any, Any, Any]] = []
    for (at, beam), section in zip(mechanism.beams, sections, strict=True):
        points = mechanism.links[at].points
        vector = points[beam.end] - points[beam.start]
        for xi, weight in zip(*_gauss(), strict=True):
            mass = (
                beam.mass_per_length * np.polynomial.polynomial.polyval(xi, beam.mass_taper) * np.abs(vector) * weight
            )
            rows.append((at, points[beam.start] + xi * vector, mass, 0.0, mass * _square_of_gyration(section, xi)))
    rows += [
        (at, link.points[lump.point] + lump.offset, lump.mass, lump.inertia, 0.0)
        for at, link in enumerate(mechanism.links)
        for lump in (link.lumps if at else ())
    ]
    columns = list(zip(*rows, strict=True)) or [()] * 5
    link, place, *amounts = (np.array(column) for column in columns)
    return _Masses(link.astype(int), place.astype(complex)[:, None], *(amount[:, None] for amount in amounts))


def _square_of_gyration(section: Section, xi: float) -> float:
    """I/A at a station [m^2]; 0 of Euler and Bernoulli's beams, and where the section does not tell."""
    second = float(np.ravel(section.inertia)[0] / np.ravel(section.area)[0])
    if not (np.isfinite(np.ravel(section.kGA)[0]) and math.isfinite(second)):
        return 0.0
    if section.taper is None:
        return second
    bending, along = (np.polynomial.polynomial.polyval(xi, taper) for taper in (section.taper.EI, section.taper.EA))
    return second * float(bending / along)


def _gauss() -> tuple[Any, Any]:
    """Gauss's points and weights from 0 to 1."""
    points, weights = np.polynomial.legendre.leggauss(GAUSS)
    return (points + 1) / 2, weights / 2


def _places(motion: Motion, masses: _Masses) -> Any:
    """Places of the masses [m], complex, shape (masses, positions)."""
    return motion.origin[masses.link] + motion.direction[masses.link] * masses.place


def _velocities(motion: Motion, masses: _Masses) -> Any:
    """Velocities of the masses as the motion tells them [m/s], complex, shape (masses, positions)."""
    turning = 1j * motion.angular_velocity[masses.link] * motion.direction[masses.link]
    return motion.velocity[masses.link] + turning * masses.place


@dataclass(frozen=True, eq=False)
class _Rates:
    """Velocities and accelerations of the masses [m/s, m/s^2], complex, and angular accelerations [1/s^2].

    Shape (masses, positions); `known` where the differences tell them.
    """

    velocity: Any
    acceleration: Any
    rotation: Any
    known: Any


def _rates(motion: Motion, masses: _Masses, motion_near: MotionNear, span: tuple[float, float]) -> _Rates:
    """Differences over a few short steps before and after every position."""
    step = STEP * _pace(motion)
    far = len(EIGHTH) * step
    inside = (motion.time - far >= span[0]) & (motion.time + far <= span[1])
    if not inside.any():  # a run shorter than the steps
        unknown = np.full((len(masses.mass), *motion.columns), np.nan)
        return _Rates(unknown + 0j, unknown + 0j, unknown, inside)
    time, here = motion.time[inside], posture(motion, inside)
    steps = np.array([
        _carried(motion_near(time + k * step, here), masses) - _carried(motion_near(time - k * step, here), masses)
        for k in range(1, len(EIGHTH) + 1)
    ])  # fmt: skip
    good, rough = (np.tensordot(weights, steps, 1) / step for weights in (EIGHTH, SIXTH))
    largest = np.abs(good).max(axis=(1, 2), initial=0.0, where=np.isfinite(good), keepdims=True)
    known = inside.copy()
    known[inside] = (np.abs(good - rough) <= GRANTED / 10 * largest).all(axis=(0, 1))
    rates = np.full((*good.shape[:2], *motion.columns), np.nan, complex)
    rates[..., inside] = good
    return _Rates(rates[0], rates[1], rates[2].real, known)


def _carried(motion: Motion, masses: _Masses) -> Any:
    """Places and velocities of the masses and the angular velocities of their links, shape (3, masses, positions)."""
    return np.array([_places(motion, masses), _velocities(motion, masses), motion.angular_velocity[masses.link]])


def _pace(motion: Motion) -> float:
    """Time in which the fastest link turns by a radian, or goes its own mechanism's length [s]."""
    known = np.isfinite(motion.velocity)
    turns = np.abs(motion.angular_velocity).max(initial=0.0, where=known)
    goes = np.abs(motion.velocity).max(initial=0.0, where=known)
    size = _size(motion, np.isfinite(motion.origin).all(axis=0))
    fastest = max(float(turns), float(goes) / size if size else 0.0)
    return 1.0 / fastest if fastest else 1.0


def _size(motion: Motion, known: Any) -> float:
    """Width or height of all that the points of the links reach [m], whichever is larger."""
    points = [motion.origin[at] + motion.direction[at] * point
              for at, link in enumerate(motion.mechanism.links) for point in link.points.values()]  # fmt: skip
    reached = np.array(points)[:, known]
    return float(max(np.ptp(reached.real), np.ptp(reached.imag))) if reached.size else 0.0


def _centre(motion: Motion) -> Any:
    """A place amid the links, about which moments are taken [m], complex."""
    return (
        complex(np.mean(motion.origin, where=np.isfinite(motion.origin))) if np.isfinite(motion.origin).any() else 0.0
    )


def _openings(motion: Motion) -> Any:
    """How far joints are open [m], shape (joints, positions): pins, and blocks off their lines or turned on them."""
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
        held = motion.direction[mechanism.index[weld.on]] * weld.turn
        turned = np.abs(motion.direction[mechanism.index[weld.link]] - held)
        rows.append(turned * _size(motion, np.isfinite(held)))
    for slider in mechanism.sliders:
        link, on = mechanism.index[slider.link], mechanism.index[slider.on]
        line = motion.direction[on] * slider.direction
        foot = motion.origin[on] + motion.direction[on] * slider.origin
        way = position_of(motion, slider.link, slider.point) - foot
        turned = np.abs(motion.direction[link] - motion.direction[on] * slider.turn)
        rows += [np.abs(cross(line, way)), turned * _size(motion, np.isfinite(way))]
    return np.array(rows)


def _ground_moment(deflection: Deflection, centre: Any) -> Any:
    """Moment of the mechanism on the ground about a place [N m], shape (positions,)."""
    return deflection.forces.ground_moment - cross(centre, deflection.forces.ground_force)


def _applied(motion: Motion, masses: _Masses, centre: Any) -> tuple[Any, Any]:
    """Gravity and all given loads, those on the ground too: force [N], complex, and moment about a place [N m]."""
    weight = masses.mass * (motion.mechanism.gravity + 0j)
    force = np.zeros(motion.columns, complex) + weight.sum()
    moment = cross(_places(motion, masses) - centre, weight).sum(axis=0)
    for load in motion.mechanism.loads:
        for at, push, couple in _line_load(motion, load) if isinstance(load, LineLoad) else _point_load(motion, load):
            force = force + push
            moment = moment + cross(at - centre, push) + couple
    return force, moment


def _point_load(motion: Motion, load: Any) -> Sequence[tuple[Any, Any, Any]]:
    return [(position_of(motion, link, point), force, moment) for link, point, force, moment in load.forces(motion)]


def _line_load(motion: Motion, load: LineLoad) -> Sequence[tuple[Any, Any, Any]]:
    """The load of short pieces of a beam."""
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
        for xi, weight in zip(*_gauss(), strict=True)
    ]


def _of_displacements(
    deflection: Deflection, masses: _Masses, centre: Any, cycle: float, exact: bool
) -> tuple[Any, Any]:
    """Rate of the momentum that vibration adds [N], and of the angular momentum less the moments that it adds [N m].

    A point displaced by s, moving with v, has m s' more momentum, and m (r x s' + s x (v + s')) more angular momentum,
    of which s x s' is of second order; a force f that goes with it has the moment s x f more.
    """
    motion = deflection.motion
    arm, velocity = _places(motion, masses) - centre, _velocities(motion, masses)
    moved, turned = _displacements(deflection)
    speed = _rate(moved, cycle)
    spin = masses.mass * (cross(arm, speed) + cross(moved, velocity + exact * speed))
    spin = spin + (masses.inertia + masses.section) * _rate(turned, cycle).real
    rate = _rate((masses.mass * speed).sum(axis=0), cycle)
    return rate, _rate(spin.sum(axis=0), cycle).real - _shifted(deflection, masses, moved)


def _of_transient(
    deflection: Deflection,
    masses: _Masses,
    centre: Any,
    rates: _Rates,
    motion_near: MotionNear,
    transient: Transient,
    granted: float,
    exact: bool,
) -> tuple[Any, Any]:
    """The same by differences in time, nan at positions that they do not tell of.

    The angular momentum's rate is m (r x s'' + s x (a + s'')), with s x s'' of second order.
    """
    motion, (near, edges) = deflection.motion, transient
    count = len(EIGHTH)
    element = np.clip(np.searchsorted(edges, motion.time, side="right") - 1, 0, len(edges) - 2)
    step = WITHIN * np.diff(edges)[element]
    inside = (motion.time - count * step >= edges[element]) & (motion.time + count * step <= edges[element + 1])
    unknown = np.full(motion.columns, np.nan)
    if not inside.any():
        return unknown, unknown
    time, step, here = motion.time[inside], step[inside], posture(motion, inside)

    def carried(k: int) -> Any:
        return np.array(_displacements(near(motion_near(time + k * step, here))), complex)

    middle = carried(0)
    sums = np.array([carried(k) + carried(-k) - 2 * middle for k in range(1, count + 1)])
    good, rough = (np.tensordot(weights, sums, 1) / step**2 for weights in (SECOND_EIGHTH, SECOND_SIXTH))
    arm, acceleration = (_places(motion, masses) - centre)[:, inside], rates.acceleration[:, inside]
    momentum, resolved = ((masses.mass * change[0]).sum(axis=0) for change in (good, rough))
    spin = cross(arm, good[0]) + cross(middle[0], acceleration + exact * good[0])
    turning = (masses.mass * spin + (masses.inertia + masses.section) * good[1].real).sum(axis=0)
    told = np.abs(momentum - resolved) <= granted / 10 * np.abs(momentum).max()
    force, moment = unknown.astype(complex), unknown.copy()
    force[inside] = np.where(told, momentum, np.nan)
    moment[inside] = turning
    return force, moment - _shifted(deflection, masses, _displacements(deflection)[0])


def _shifted(deflection: Deflection, masses: _Masses, moved: Any) -> Any:
    """Moment that gravity and the forces have more because they go with displaced points [N m]."""
    motion = deflection.motion
    pushed = cross(moved, masses.mass * (motion.mechanism.gravity + 0j)).sum(axis=0)
    for load in motion.mechanism.loads:
        for link, point, force, _ in load.forces(motion) if isinstance(load, PointLoad) else ():
            pushed = pushed + cross(displacement_of(deflection, link, point), force)
    for joint, force in zip(motion.structure.joints, deflection.forces.force, strict=True):
        if joint.parent == 0 and not joint.turns:  # what slides on the ground bears on another place of it
            pushed = pushed + cross(displacement_of(deflection, joint.child, _sliding_point(motion, joint.name)), force)
    return pushed


def _sliding_point(motion: Motion, name: str) -> str:
    return motion.mechanism.slider_points[name]


def _displacements(deflection: Deflection) -> tuple[Any, Any]:
    """Displacements [m], complex, and rotations [rad] of the masses, in their order, shape (masses, positions)."""
    motion = deflection.motion
    mechanism = motion.mechanism
    u, w, phi = (sample(deflection, field, _gauss()[0]) for field in ("u", "w", "phi"))
    moved, turned = [], []
    for number, (at, beam) in enumerate(mechanism.beams):
        way = mechanism.links[at].points[beam.end] - mechanism.links[at].points[beam.start]
        axis = motion.direction[at] * way / np.abs(way)
        moved += list(axis * (u[number] + 1j * w[number]).T)
        turned += list(phi[number].T)
    for at, link in enumerate(mechanism.links):
        for lump in link.lumps if at else ():
            angle = np.broadcast_to(rotation_of(deflection, at, lump.point), motion.columns)
            held = displacement_of(deflection, at, lump.point) + 1j * angle * motion.direction[at] * lump.offset
            moved.append(np.broadcast_to(held, motion.columns))
            turned.append(angle)
    return np.array(moved), np.array(turned)


def _rate(values: Any, cycle: float) -> Any:
    """Rate of a periodic function, complex, from even positions of its cycle; the last axis is time."""
    count = values.shape[-1]
    waves = np.fft.fftfreq(count, 1 / count)
    waves[np.abs(waves) == count / 2] = 0.0  # of the highest wave no phase is known
    return np.fft.ifft(2j * np.pi / cycle * waves * np.fft.fft(values))


def _unresolved(values: Any) -> float:
    """Share of the waves among the highest third that positions tell of: too few positions leave much there."""
    waves = np.abs(np.fft.fft(values))
    count = len(waves)
    highest = np.abs(np.fft.fftfreq(count, 1 / count)) >= count / 3
    return float(waves[highest].max(initial=0.0) / (waves.max(initial=0.0) or 1.0))


def _largest(values: Any, known: Any) -> float:
    """Largest magnitude at the known positions, the last axis."""
    return float(np.abs(values)[..., known].max(initial=0.0))


def _share(difference: Any, scale: float, known: Any) -> float:
    """Largest difference as a share of a scale; zero where there is no difference."""
    apart = _largest(difference, known)
    return apart / scale if apart else 0.0
