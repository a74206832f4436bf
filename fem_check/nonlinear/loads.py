"""Loads on nodes: forces and moments on points, and on beams gathered at their nodes; weight goes with the masses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_check.nonlinear.nodes import Nodes, NotCheckedError
from fem_check.nonlinear.ties import place_of
from rigid import Law, LineLoad, Mechanism, PointLoad, Reals, Spring, TorsionSpring
from rigid.arrays import Complexes, Flags, Integers


@dataclass(frozen=True, eq=False)
class Loads:
    """Loads, shape (loads,).

    Attributes
    ----------
    node
        Its number.
    force
        [N], complex, in the ground's axes, or in those of the link where it turns with it.
    moment
        [N m], whichever way the node turns.
    lever
        [N m], complex: times the conjugate of the node's direction, its imaginary part is a moment. A force in the
        ground's axes on an arm that turns.
    turning
        Whether the force turns with the node.
    law
        Number of the law that multiplies it, -1 without.
    laws
        As given.
    """

    node: Integers
    force: Complexes
    moment: Reals
    lever: Complexes
    turning: Flags
    law: Integers
    laws: tuple[Law, ...]


@dataclass(frozen=True, eq=False)
class Clock:
    """Argument of a law in place of a motion: the time [s], and nothing else."""

    time: Reals

    @property
    def columns(self) -> tuple[int, ...]:
        """Shape of the instants."""
        return self.time.shape

    def __getattr__(self, name: str) -> Any:
        """Refuse a law that follows the motion."""
        raise NotCheckedError(
            f'a law of a load asks for the motion\'s "{name}": the nonlinear check takes laws of time'
        )


def loads_of(mechanism: Mechanism, nodes: Nodes) -> Loads:
    """All point loads and line loads of a mechanism.

    Raises
    ------
    NotCheckedError
        A load of another kind.
    """
    if mechanism.friction:
        raise NotCheckedError("friction of joints: the nonlinear check does not know it")
    rows: list[tuple[Any, ...]] = []
    laws: list[Law] = []
    for load in mechanism.loads:
        if isinstance(load, Spring | TorsionSpring):
            continue
        if not isinstance(load, PointLoad | LineLoad):
            raise NotCheckedError(f"a load of type {type(load).__name__}: the nonlinear check does not know it")
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
    """The resultant, and its lever about the node."""
    length, change = abs(vector), last - first
    force = length * (first + change / 2)
    return [
        (node, force, length * (np.conj(start) * (first + change / 2) + np.conj(vector) * (first / 2 + change / 3)))
    ]


def _elastic_pieces(
    along: tuple[int, ...], vector: complex, first: complex, last: complex
) -> list[tuple[int, complex, complex]]:
    """Nodal loads of a linear load on every element, by cubic shape functions."""
    count = len(along) - 1
    arm = np.conj(vector) / count
    h = abs(arm)
    marks = first + (last - first) * np.arange(count + 1) / count
    pieces = []
    for start, end, p, q in zip(along, along[1:], marks, marks[1:], strict=False):
        pieces.append((start, h * (7 * p + 3 * q) / 20, arm * h * (3 * p + 2 * q) / 60))
        pieces.append((end, h * (3 * p + 7 * q) / 20, -arm * h * (2 * p + 3 * q) / 60))
    return pieces


def factors(loads: Loads, time: Reals) -> Reals:
    """Factors of all loads by their laws, shape (instants, loads)."""
    clock: Any = Clock(time)
    values = [np.broadcast_to(np.asarray(law(clock), float), time.shape) for law in loads.laws]
    table = np.stack([*values, np.ones(time.shape)], axis=-1)
    return table[:, loads.law]


def load_state(loads: Loads, q: Reals, factor: Reals) -> tuple[Reals, Reals]:
    """Forces and moments on the nodes that carry loads, (instants, loads, 3), and derivatives by place (..., 3, 3)."""
    turn = np.exp(1j * q[:, loads.node, 2])
    force = factor * loads.force * np.where(loads.turning, turn, 1.0)
    levered = factor * np.conj(turn) * loads.lever
    pushed = np.stack([force.real, force.imag, factor * loads.moment + levered.imag], axis=-1)
    change = np.zeros((*force.shape, 3, 3))
    turned = np.where(loads.turning, 1j * force, 0.0)
    change[..., 0, 2], change[..., 1, 2], change[..., 2, 2] = turned.real, turned.imag, -levered.real
    return pushed, change


def line_loads(mechanism: Mechanism, beam: int, xi: Reals, direction: Complexes, time: Reals) -> Complexes:
    """Force per length on a beam at its nodes in the ground's axes [N/m], complex, shape (instants, nodes).

    Parameters
    ----------
    beam
        Number among all.
    xi
        Of its nodes.
    direction
        Unit vector of x' at the nodes, (instants, nodes).
    """
    at = mechanism.beams[beam][0]
    number = beam - next(k for k, (link, _) in enumerate(mechanism.beams) if link == at)
    total = np.zeros(direction.shape, complex)
    for load in mechanism.loads:
        if isinstance(load, LineLoad) and mechanism.index[load.link] == at and load.beam == number:
            clock: Any = Clock(time)
            factor = np.ones(time.shape) if load.law is None else np.broadcast_to(load.law(clock), time.shape)
            given = complex(load.start) + (complex(load.end) - complex(load.start)) * xi
            total += factor[:, None] * given * (direction if load.turning else 1.0)
    return total
