"""Loads on nodes: point loads, line loads as nodal loads, and the rigid motion for which load laws are evaluated."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from fem_check.nonlinear.nodes import Nodes, NotCheckedError
from fem_check.nonlinear.rigid_places import RigidPlaces, as_complex, coordinates
from fem_check.nonlinear.ties import place_of
from rigid import Law, LineLoad, Mechanism, PointLoad, Spring, TorsionSpring, structure
from rigid.arrays import Complexes, Flags, Integers, Reals
from rigid.decomposition import Structure

MAX_STRIDE = 5e-3
"""Movement of a drive in one time step of numerical differentiation [rad], or relative to the mechanism size."""
MIN_STEP = 1e-7
"""Smallest time step of numerical differentiation [s]."""
SAMPLES = 501
"""Number of instants at which the movement of drives is checked."""
POINTS = 6
"""Number of instants for numerical differentiation."""
OFFSETS = np.arange(POINTS) - (POINTS - 1) / 2
"""These instants relative to their mean, in time steps."""


class Loads(Struct, frozen=True, eq=False):
    """Loads on nodes, in arrays of shape (loads,).

    Attributes
    ----------
    node
        Index of the node.
    force
        Force [N], complex, in the rotated axes of the node if `turning`, and otherwise in ground axes.
    moment
        Moment that does not depend on the rotation of the node [N m].
    lever
        Complex constant that determines the moment of a force in ground axes about the node, if the point of the force
        is at a distance from the node [N m]. At the rotation t of the node, this moment is the imaginary part of lever
        e^(-i t).
    turning
        True if the force rotates with the node.
    law
        Index of the law that multiplies the load, or -1 for a constant load.
    laws
        Laws of the loads.
    """

    node: Integers
    force: Complexes
    moment: Reals
    lever: Complexes
    turning: Flags
    law: Integers
    laws: tuple[Law, ...]


def loads_of(mechanism: Mechanism, nodes: Nodes) -> Loads:
    """Collect all loads of a mechanism except springs.

    Forces of custom loads are computed from the motion of the rigid links, and act on the deformed links.

    Raises
    ------
    NotCheckedError
        If a load acts on a point that no beam reaches.
    """
    rows: list[tuple[Any, ...]] = []
    laws: list[Law] = []
    for load in mechanism.loads:
        if isinstance(load, Spring | TorsionSpring):
            continue
        if not isinstance(load, PointLoad | LineLoad):
            rows += _custom(mechanism, nodes, load, laws)
            continue
        law = -1
        if load.law is not None:
            law, laws = len(laws), [*laws, load.law]
        rows += (
            _point(mechanism, nodes, load, law) if isinstance(load, PointLoad) else _line(mechanism, nodes, load, law)
        )
    node, force, moment, lever, turning, number = list(zip(*rows, strict=True)) or [()] * 6
    return Loads(
        np.array(node, int),
        np.array(force, complex),
        np.array(moment, float),
        np.array(lever, complex),
        np.array(turning, bool),
        np.array(number, int),
        tuple(laws),
    )


def _point(mechanism: Mechanism, nodes: Nodes, load: PointLoad, law: int) -> list[tuple[Any, ...]]:
    at = mechanism.index[load.link]
    if at == 0:
        return []
    node, arm = place_of(mechanism, nodes, at, load.point)
    force, moment = complex(load.force), float(load.moment)
    lever = np.conj(arm) * force
    if load.turning:
        return [(node, force, moment + lever.imag, 0.0, True, law)]
    return [(node, force, moment, lever, False, law)]


def _custom(mechanism: Mechanism, nodes: Nodes, load: Any, laws: list[Law]) -> list[tuple[Any, ...]]:
    """Convert a custom load to unit forces and moments, multiplied by laws that depend on the rigid motion."""
    rows: list[tuple[Any, ...]] = []
    for number, (link, point) in enumerate(load.points):
        at = mechanism.index[link]
        if at == 0:
            continue
        node, arm = place_of(mechanism, nodes, at, point)
        for part, (force, moment) in enumerate(((1.0, 0.0), (1j, 0.0), (0.0, 1.0))):
            rows.append((node, force, moment, np.conj(arm) * force, False, len(laws)))
            laws.append(_part(load, number, (link, point), part))
    return rows


def _part(load: Any, number: int, at: tuple[str, str], part: int) -> Law:
    """Return the law of one component of a custom load: force x, force y, or moment."""

    def law(motion: Any) -> Reals:
        link, point, force, moment = list(load.forces(motion))[number]
        if (link, point) != at:
            raise NotCheckedError(
                f"a load of type {type(load).__name__} returns forces at points that differ from `points` or its order"
            )
        pushed = np.asarray(force, complex)
        return np.broadcast_to((pushed.real, pushed.imag, np.asarray(moment, float))[part], motion.columns)

    return law


def _line(mechanism: Mechanism, nodes: Nodes, load: LineLoad, law: int) -> list[tuple[Any, ...]]:
    at = mechanism.index[load.link]
    if at == 0:
        return []
    number = [k for k, (link, _) in enumerate(mechanism.beams) if link == at][load.beam]
    beam, link = mechanism.beams[number][1], mechanism.links[at]
    start, vector = complex(link.points[beam.start]), complex(link.points[beam.end]) - complex(link.points[beam.start])
    along = nodes.along[number]
    first, last = complex(load.start), complex(load.end)
    turned = vector / abs(vector) if load.turning else 1.0
    if not along:
        node = nodes.at[at, beam.start][0]
        pieces: Sequence[tuple[int, complex, complex]] = _rigid_pieces(node, start, vector, first, last)
    else:
        pieces = _elastic_pieces(along, vector, first, last)
    rows: list[tuple[Any, ...]] = []
    for node, force, lever in pieces:
        if load.turning:
            rows.append((node, force * turned, (lever * turned).imag, 0.0, True, law))
        else:
            rows.append((node, force, 0.0, lever, False, law))
    return rows


def _rigid_pieces(
    node: int, start: complex, vector: complex, first: complex, last: complex
) -> list[tuple[int, complex, complex]]:
    """Return node, resultant and `Loads.lever` of a linearly varying load on a rigid beam.

    `first` and `last` are the loads per length at the ends of the beam [N/m].
    """
    length, change = abs(vector), last - first
    force = length * (first + change / 2)
    return [
        (node, force, length * (np.conj(start) * (first + change / 2) + np.conj(vector) * (first / 2 + change / 3)))
    ]


def _elastic_pieces(
    along: tuple[int, ...], vector: complex, first: complex, last: complex
) -> list[tuple[int, complex, complex]]:
    """Return nodes, forces and `Loads.lever` of a linearly varying load on an elastic beam.

    `first` and `last` are the loads per length at the ends of the beam [N/m]. Nodal loads follow from cubic shape
    functions of each element.
    """
    count = len(along) - 1
    arm = np.conj(vector) / count
    h = abs(arm)
    marks = first + (last - first) * np.arange(count + 1) / count
    pieces = []
    for start, end, p, q in zip(along, along[1:], marks, marks[1:], strict=False):
        pieces.append((start, h * (7 * p + 3 * q) / 20, arm * h * (3 * p + 2 * q) / 60))
        pieces.append((end, h * (3 * p + 7 * q) / 20, -arm * h * (2 * p + 3 * q) / 60))
    return pieces


def factors(loads: Loads, time: Reals, rigid: RigidPlaces) -> Reals:
    """Evaluate the laws of all loads, shape (instants, loads)."""
    motion: Any = RigidLinkMotion(time, rigid)
    values = [np.broadcast_to(np.asarray(law(motion), float), time.shape) for law in loads.laws]
    table = np.stack([*values, np.ones(time.shape)], axis=-1)
    return table[:, loads.law]


def load_state(loads: Loads, q: Reals, factor: Reals) -> tuple[Reals, Reals]:
    """Return the nodal forces of the loads, and their derivatives with respect to the coordinates of their nodes.

    The shapes are (instants, loads, 3) and (instants, loads, 3, 3), for (x, y, rotation).
    """
    turn = np.exp(1j * q[:, loads.node, 2])
    force = factor * loads.force * np.where(loads.turning, turn, 1.0)
    levered = factor * np.conj(turn) * loads.lever
    pushed = np.stack([force.real, force.imag, factor * loads.moment + levered.imag], axis=-1)
    change = np.zeros((*force.shape, 3, 3))
    turned = np.where(loads.turning, 1j * force, 0.0)
    change[..., 0, 2], change[..., 1, 2], change[..., 2, 2] = turned.real, turned.imag, -levered.real
    return pushed, change


class RigidLinkMotion(Struct, frozen=True, eq=False, dict=True):
    """Positions, velocities and accelerations of the rigid links, with the attributes of `rigid.Motion`.

    Attributes
    ----------
    time
        Instants [s], shape (instants,).
    rigid
        Positions of the links at any time.
    """

    time: Reals
    rigid: RigidPlaces

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism that moves."""
        return self.rigid.mechanism

    @property
    def structure(self) -> Structure:
        """Joints of the mechanism."""
        return structure(self.mechanism)

    @property
    def columns(self) -> tuple[int, ...]:
        """Shape of the instants."""
        return self.time.shape

    @cached_property
    def drive(self) -> Reals:
        """Coordinates of the drives, shape (drives, instants)."""
        return coordinates(self.rigid.laws, self.time).T

    @cached_property
    def link_positions(self) -> Reals:
        """x, y and angle of each link, shape (links, instants, 3)."""
        return np.swapaxes(self.rigid.at(self.time), 0, 1)

    @cached_property
    def link_rates(self) -> tuple[Reals, Reals]:
        """First and second derivatives of `link_positions`."""
        step = self._step
        around = np.maximum(self.time, self.rigid.start - OFFSETS[0] * step)  # there are no positions before the start
        places = self.rigid.at((around[:, None] + step * OFFSETS).ravel())
        values = places.reshape(len(self.time), POINTS, -1)
        powers = np.arange(POINTS)
        fit = np.linalg.inv(OFFSETS[:, None] ** powers)
        share = ((self.time - around) / step)[:, None]
        once = powers * share ** np.maximum(powers - 1, 0) @ fit / step
        twice = powers * (powers - 1) * share ** np.maximum(powers - 2, 0) @ fit / step**2
        rate, acceleration = (
            np.einsum("pk,pkc->pc", weights, values).reshape(len(self.time), -1, 3) for weights in (once, twice)
        )
        return np.swapaxes(rate, 0, 1), np.swapaxes(acceleration, 0, 1)

    @property
    def _step(self) -> float:
        """Time step of numerical differentiation [s]: the time in which drives move by about `MAX_STRIDE`."""
        first, last = float(self.time.min()), float(self.time.max())
        scale = np.array([1.0 if drive.turns else self.rigid.size for drive in self.mechanism.drives])
        steps = MIN_STEP * 2.0 ** np.arange(24)
        for step in steps:
            fine = np.linspace(first, max(last, first + step), SAMPLES)
            apart = coordinates(self.rigid.laws, fine + step) - coordinates(self.rigid.laws, fine)
            if (np.abs(apart) / scale).max(initial=0.0) > MAX_STRIDE:
                return float(step)
        return float(steps[-1])

    def __getattr__(self, name: str) -> Any:
        """Return an array of `rigid.Motion`, shape (links, instants).

        Raise NotCheckedError for attributes that are not in `ARRAYS`.
        """
        if name not in ARRAYS:
            raise NotCheckedError(
                f'a load uses "{name}" of the motion: the nonlinear check provides only positions, velocities and '
                "accelerations"
            )
        return ARRAYS[name](self)


ARRAYS: dict[str, Callable[[RigidLinkMotion], Any]] = {
    "origin": lambda motion: as_complex(motion.link_positions),
    "direction": lambda motion: np.exp(1j * motion.link_positions[..., 2]),
    "velocity": lambda motion: as_complex(motion.link_rates[0]),
    "angular_velocity": lambda motion: motion.link_rates[0][..., 2],
    "acceleration": lambda motion: as_complex(motion.link_rates[1]),
    "angular_acceleration": lambda motion: motion.link_rates[1][..., 2],
    "turning": lambda motion: 1j * motion.link_rates[1][..., 2] - motion.link_rates[0][..., 2] ** 2,
}
"""Functions that compute the arrays of `rigid.Motion` that loads may use, by attribute name."""
