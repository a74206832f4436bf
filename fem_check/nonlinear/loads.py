"""Loads on nodes: forces and moments at points, and lumped line loads."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_check.nonlinear.link_motion import RigidLinkMotion
from fem_check.nonlinear.nodes import Nodes, NotCheckedError
from fem_check.nonlinear.rigid_places import RigidPlaces
from fem_check.nonlinear.ties import place_of
from rigid import Law, LineLoad, Mechanism, PointLoad, Reals, Spring, TorsionSpring
from rigid.arrays import Complexes, Flags, Integers


@dataclass(frozen=True, eq=False)
class Loads:
    """Loads, shape (loads,).

    Attributes
    ----------
    node
        Node number.
    force
        [N], complex, in the ground's axes, or in the link's axes if `turning`.
    moment
        [N m], independent of the node's rotation.
    lever
        [N m], complex. The imaginary part of lever times the conjugate of the node's direction is the moment of a
        force in ground axes on a rotating arm.
    turning
        Whether the force turns with the node.
    law
        Number of the law that multiplies the load; -1 if there is none.
    laws
        The load laws.
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

    Custom load objects are evaluated on the motion of the rigid links and act on the deformed ones.

    Raises
    ------
    NotCheckedError
        A load acts on a point that no beam reaches.
    """
    rows: list[tuple[Any, ...]] = []
    laws: list[Law] = []
    for load in mechanism.loads:
        if isinstance(load, Spring | TorsionSpring):
            continue
        if not isinstance(load, PointLoad | LineLoad):
            rows += _of_its_own(mechanism, nodes, load, laws)
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


def _of_its_own(mechanism: Mechanism, nodes: Nodes, load: Any, laws: list[Law]) -> list[tuple[Any, ...]]:
    """Convert a custom load to unit loads that follow laws from the rigid motion."""
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
    """Law for one component of a custom load: force x, force y, or moment."""

    def law(motion: Any) -> Reals:
        link, point, force, moment = list(load.forces(motion))[number]
        if (link, point) != at:
            raise NotCheckedError(f"a load of type {type(load).__name__} does not act at its points in their order")
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
    """Resultant of a linear load and its lever about the node."""
    length, change = abs(vector), last - first
    force = length * (first + change / 2)
    return [
        (node, force, length * (np.conj(start) * (first + change / 2) + np.conj(vector) * (first / 2 + change / 3)))
    ]


def _elastic_pieces(
    along: tuple[int, ...], vector: complex, first: complex, last: complex
) -> list[tuple[int, complex, complex]]:
    """Nodal loads of a linear load on each element, by cubic shape functions."""
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
    """Nodal forces of loads, (instants, loads, 3), and their tangents, (..., 3, 3)."""
    turn = np.exp(1j * q[:, loads.node, 2])
    force = factor * loads.force * np.where(loads.turning, turn, 1.0)
    levered = factor * np.conj(turn) * loads.lever
    pushed = np.stack([force.real, force.imag, factor * loads.moment + levered.imag], axis=-1)
    change = np.zeros((*force.shape, 3, 3))
    turned = np.where(loads.turning, 1j * force, 0.0)
    change[..., 0, 2], change[..., 1, 2], change[..., 2, 2] = turned.real, turned.imag, -levered.real
    return pushed, change
