"""Equations of motion in absolute coordinates: residual and tangents at many instants."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from elastic import JointCompliance, Section
from fem_check.nonlinear.beam_elements import ElementState, element_state, predicted
from fem_check.nonlinear.couplings import CouplingKind, CouplingState, coupling_state
from fem_check.nonlinear.loads import Loads, factors, load_state, loads_of
from fem_check.nonlinear.node_masses import MassState, mass_state
from fem_check.nonlinear.nodes import Nodes, NotCheckedError, nodes_of
from fem_check.nonlinear.rigid_places import DriveLaw, RigidPlaces, coordinates
from fem_check.nonlinear.ties import Ties, ties_of
from rigid import Mechanism, Reals
from rigid.arrays import Flags, Integers


@dataclass(frozen=True, eq=False)
class Tangents:
    """Derivatives of the residual, shape (instants, free, free), and rows of the constraints."""

    stiffness: Reals
    damping: Reals
    mass: Reals
    rows: Reals


@dataclass(frozen=True, eq=False)
class State:
    """Intermediate results of the residual.

    `open` are the violations of the constraints, shape (instants, constraints). `needed` is the force that each node
    needs from the nodes that share its coordinates, shape (instants, nodes, 3). `pull` are the forces of the couplings,
    shape (instants, couplings).
    """

    elements: ElementState
    masses: MassState
    couplings: CouplingState
    pull: Reals
    needed: Reals
    open: Reals


@dataclass(frozen=True, eq=False)
class System:
    """Equations of motion of a mechanism.

    The coordinates are x, y and rotation of all nodes, in which shared ones occur once, shape (instants, coordinates).
    Those of the ground, of pins on the ground, and of drives may be prescribed. The others are free.
    """

    mechanism: Mechanism
    laws: tuple[DriveLaw, ...]
    rigid: RigidPlaces
    nodes: Nodes
    ties: Ties
    loads: Loads

    @cached_property
    def of_node(self) -> Integers:
        """Indices of the coordinates x, y and rotation of each node, shape (nodes, 3)."""
        number = np.arange(3 * len(self.nodes.link)).reshape(-1, 3)
        for one, other in self.ties.shared:
            for component in (0, 1):
                low, high = sorted((number[one, component], number[other, component]))
                number[number == high] = low
        return np.unique(number, return_inverse=True)[1].reshape(-1, 3)

    @cached_property
    def prescribed(self) -> Flags:
        """True for each prescribed coordinate."""
        fixed = np.zeros(self.of_node.max() + 1, bool)
        fixed[self.of_node[0]] = True
        fixed[self.of_node[list(self.ties.held), :2]] = True
        fixed[self.of_node[list(self.ties.driven.values()), 2]] = True
        return fixed

    @cached_property
    def free(self) -> Integers:
        """Indices of the free coordinates."""
        return np.flatnonzero(~self.prescribed)

    @cached_property
    def turns(self) -> Flags:
        """True for each coordinate that is a rotation."""
        found = np.zeros(len(self.prescribed), bool)
        found[self.of_node[:, 2]] = True
        return found

    @cached_property
    def unit(self) -> Reals:
        """Unit of each free coordinate: the size of the mechanism [m], or 1 rad."""
        return np.where(self.turns[self.free], 1.0, self.rigid.size)

    @cached_property
    def gap(self) -> Reals:
        """Unit of each constraint: the size of the mechanism [m], or 1 rad."""
        kinds = [self.ties.couplings[own.parts[0][0]].kind for own in self.ties.conditions]
        return np.array([1.0 if kind == CouplingKind.TURN else self.rigid.size for kind in kinds])

    def drives(self, time: Reals) -> Reals:
        """Return the coordinates of the drives, including full turns, shape (instants, drives)."""
        return coordinates(self.laws, time) + self.ties.winding

    def load_factors(self, time: Reals) -> Reals:
        """Evaluate the laws of all loads, shape (instants, loads)."""
        return factors(self.loads, time, self.rigid)

    def rigid_coordinates(self, places: Reals) -> Reals:
        """Return the coordinates of the nodes on rigid links at given positions, shape (instants, links, 3)."""
        carried = places[:, self.nodes.link]
        way = self.nodes.rest * np.exp(1j * carried[..., 2])
        carried = carried + np.stack([way.real, way.imag, np.zeros(way.shape)], axis=-1)
        q = np.zeros((len(places), len(self.prescribed)))
        q[:, self.of_node.ravel()] = carried.reshape(len(places), -1)
        return q

    def prescribe(self, q: Reals, drives: Reals) -> None:
        """Set the prescribed coordinates in place."""
        q[:, self.of_node[0]] = 0.0
        for node, place in self.ties.held.items():
            q[:, self.of_node[node, 0]], q[:, self.of_node[node, 1]] = complex(place).real, complex(place).imag
        for drive, node in self.ties.driven.items():
            q[:, self.of_node[node, 2]] = drives[:, drive]

    def residual(
        self,
        q: Reals,
        v: Reals,
        a: Reals,
        pulls: Reals,
        drives: Reals,
        factor: Reals,
        tangent: bool = True,
        assumed: Reals | None = None,
    ) -> tuple[Reals, State, Tangents | None]:
        """Compute the residual of the equations of motion, shape (instants, coordinates).

        Parameters
        ----------
        q, v, a
            Coordinates, rates and accelerations.
        pulls
            Multipliers of the constraints, shape (instants, constraints).
        drives, factor
            Coordinates of the drives, and factors of the loads.
        tangent
            True to compute the derivatives.
        assumed
            Element resultants to use for the geometric stiffness, see `predicted`.
        """
        place, rate, acceleration = (values[:, self.of_node] for values in (q, v, a))
        beams = element_state(self.nodes.elements, place, rate, tangent, assumed)
        masses = mass_state(self.nodes.masses, place, rate, acceleration, complex(self.mechanism.gravity))
        pairs = coupling_state(tuple(self.ties.couplings), place)
        pushed, push_change = load_state(self.loads, place, factor)
        seen = rate[:, self._ends].reshape(*pairs.value.shape, 6)
        pull, give, loss = self._pulls(pairs, (pairs.gradient * seen).sum(-1), pulls, drives)
        along = pull[..., None] * pairs.gradient
        needed = masses.force.copy()
        for nodes, forces in (
            (self.nodes.elements.nodes, beams.force),
            (self._ends, along),
            (self.loads.node, -pushed),
        ):
            everywhere: Any = (slice(None), nodes)
            np.add.at(needed, everywhere, forces.reshape(len(q), *nodes.shape, 3))
        total = needed.reshape(len(q), -1) @ self._gather
        state = State(beams, masses, pairs, pull, needed, self._open(pairs.value, drives))
        if not tangent:
            return total, state, None
        changing = np.einsum("psij,psj->psi", pairs.second, seen)
        outer = pairs.gradient[..., :, None] * pairs.gradient[..., None, :]
        spring = give[:, :, None, None] * outer + pull[..., None, None] * pairs.second
        spring += loss[:, :, None, None] * pairs.gradient[..., :, None] * changing[..., None, :]
        stiffness = self._spread(beams.stiffness, spring, masses.stiffness, -push_change)
        damping = self._spread(beams.damping, loss[:, :, None, None] * outer, masses.damping, 0 * push_change)
        none = np.zeros((len(q), 0, 1, 1))
        mass = self._spread(none, none, masses.mass, none)
        return total, state, Tangents(stiffness, damping, mass, self._rows(pairs.gradient))

    def predicted(self, state: State, change: Reals, change_of_rate: Reals) -> Reals:
        """Predict the element resultants after a change of the coordinates."""
        moved, rate = change[:, self.of_node], change_of_rate[:, self.of_node]
        return predicted(self.nodes.elements, state.elements, moved, rate)

    @cached_property
    def _ends(self) -> Integers:
        """Nodes of the couplings, shape (couplings, 2)."""
        return np.array([(own.parent, own.child) for own in self.ties.couplings], int).reshape(-1, 2)

    @cached_property
    def _gather(self) -> Any:
        """Sparse matrix that sums nodal forces to coordinate forces, shape (3 nodes, coordinates)."""
        from scipy.sparse import csr_array

        count = self.of_node.size
        where = (np.arange(count), self.of_node.ravel())
        return csr_array((np.ones(count), where), shape=(count, len(self.prescribed)))

    @cached_property
    def parts(self) -> Reals:
        """Factors of the couplings in the constraints, shape (constraints, couplings)."""
        table = np.zeros((len(self.ties.conditions), len(self.ties.couplings)))
        for row, condition in enumerate(self.ties.conditions):
            for number, factor in condition.parts:
                table[row, number] += factor
        return table

    def _open(self, value: Reals, drives: Reals) -> Reals:
        wanted = np.zeros((len(value), len(self.ties.conditions)))
        for row, condition in enumerate(self.ties.conditions):
            wanted[:, row] = condition.target + (0.0 if condition.drive is None else drives[:, condition.drive])
        return value @ self.parts.T - wanted

    def _pulls(self, pairs: CouplingState, opening: Reals, pulls: Reals, drives: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the forces of the couplings, and their derivatives by values and by rates, shape (1, couplings)."""
        pull = pulls @ self.parts
        give, loss = np.zeros((2, 1, pull.shape[1]))
        for spring in self.ties.springs:
            k = spring.coupling
            stretch = pairs.value[:, k] - spring.rest - (0.0 if spring.drive is None else drives[:, spring.drive])
            if spring.wraps:
                stretch = np.remainder(stretch + np.pi, 2 * np.pi) - np.pi
            pull[:, k] += spring.preload + spring.stiffness * stretch + spring.damping * opening[:, k]
            give[0, k] += spring.stiffness
            loss[0, k] += spring.damping
        return pull, give, loss

    @cached_property
    def _spots(self) -> tuple[Integers, Any]:
        """Index of each coordinate among the free ones (-1 if prescribed), and coordinates of the tangent blocks."""
        number = np.full(len(self.prescribed), -1)
        number[self.free] = np.arange(len(self.free))
        beams = self.of_node[self.nodes.elements.nodes].reshape(-1, 6)
        pairs = self.of_node[self._ends].reshape(-1, 6)
        return number, (beams, pairs, self.of_node, self.of_node[self.loads.node])

    @cached_property
    def _scatter(self) -> tuple[Any, ...]:
        """Sparse matrices that add each kind of block to the entries of the tangent, shape (free^2, entries)."""
        from scipy.sparse import csr_array

        number, kinds = self._spots
        size, scattering = len(self.free), []
        for blocks in kinds:
            own = number[blocks]
            rows, columns = np.broadcast_arrays(own[:, :, None], own[:, None, :])
            good = np.flatnonzero(((rows >= 0) & (columns >= 0)).ravel())
            spots = (rows * size + columns).ravel()[good]
            scattering.append(csr_array((np.ones(len(good)), (spots, good)), shape=(size * size, rows.size)))
        return tuple(scattering)

    def _spread(self, *blocks: Reals) -> Reals:
        """Assemble blocks to tangents, shape (instants, free, free)."""
        size, count = len(self.free), len(blocks[0])
        total = np.zeros((size * size, count))
        for scatter, own in zip(self._scatter, blocks, strict=True):
            if own.shape[1]:
                total += scatter @ own.reshape(count, -1).T
        return np.ascontiguousarray(total.T).reshape(count, size, size)

    def _rows(self, gradient: Reals) -> Reals:
        """Return the derivatives of the constraints by the free coordinates, shape (instants, constraints, free)."""
        number, (_, pairs, _, _) = self._spots
        table = np.zeros((len(gradient), len(self.ties.conditions), len(self.free) + 1))
        for row, condition in enumerate(self.ties.conditions):
            for coupling, factor in condition.parts:
                for place, at in enumerate(number[pairs[coupling]]):
                    table[:, row, at] += factor * gradient[:, coupling, place]
        return table[:, :, :-1]


def system_of(
    mechanism: Mechanism,
    sections: Sequence[Section],
    laws: Sequence[DriveLaw],
    start: float,
    elements: int,
    joints: Mapping[str, JointCompliance] | None,
    damping: float | Sequence[float],
    rigid: RigidPlaces | None = None,
) -> System:
    """Set up the equations of a mechanism with the laws of its drives.

    `rigid` are the positions of the rigid links, if already computed.


    Raises
    ------
    ValueError
        If the number of sections or laws is wrong, or there is no element.
    NotCheckedError
        If the check does not support a part of the mechanism, or the arrays contain several designs.
    """
    several = [value for own in sections for value in vars(own).values() if np.ndim(value) and np.size(value) > 1]
    if mechanism.designs or several:
        raise NotCheckedError("several designs in one array: the nonlinear check supports only one at a time")
    if len(sections) != len(mechanism.beams):
        raise ValueError(f"{len(sections)} sections for {len(mechanism.beams)} beams")
    if len(laws) != len(mechanism.drives):
        raise ValueError(f"{len(laws)} laws for {len(mechanism.drives)} drives")
    if elements < 1:
        raise ValueError(f"{elements} elements: a beam needs at least one")
    rigid = rigid or RigidPlaces(mechanism, laws, start)
    nodes = nodes_of(mechanism, sections, elements, damping)
    first = coordinates(laws, start)[0]
    ties = ties_of(mechanism, nodes, joints or {}, rigid.drawn, first)
    return System(mechanism, tuple(laws), rigid, nodes, ties, loads_of(mechanism, nodes))
