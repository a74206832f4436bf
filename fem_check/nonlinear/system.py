"""Equations of motion in absolute coordinates: residual and tangents at many instants."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from elastic import JointCompliance, Section
from fem_check.nonlinear.beam_elements import ElementState, element_state, predicted
from fem_check.nonlinear.couplings import CouplingKind, CouplingState, coupling_state
from fem_check.nonlinear.loads import Loads, factors, load_state, loads_of
from fem_check.nonlinear.node_masses import MassState, mass_state
from fem_check.nonlinear.nodes import Nodes, NotCheckedError, nodes_of
from fem_check.nonlinear.rigid_places import DriveLaw, RigidPlaces, coordinates, drive_rates
from fem_check.nonlinear.ties import Ties, ties_of
from rigid import Mechanism, Reals
from rigid.arrays import Flags, Integers


class Tangents(Struct, frozen=True, eq=False):
    """Derivatives of the residual and of the constraints with respect to the free coordinates.

    Attributes
    ----------
    stiffness, damping, mass
        Derivatives of the residual with respect to the free coordinates, their rates and their accelerations, shape
        (instants, free, free) each.
    rows
        Derivatives of the constraints with respect to the free coordinates, shape (instants, constraints, free).
    """

    stiffness: Reals
    damping: Reals
    mass: Reals
    rows: Reals


class State(Struct, frozen=True, eq=False):
    """Intermediate results of the residual.

    Attributes
    ----------
    elements, masses, couplings
        Values and derivatives for the elements, the inertia and the couplings. A coupling is a function of the
        coordinates of two nodes, see `NodeCoupling`.
    coupling_force
        Force [N] or moment [N m] of each coupling, shape (instants, couplings).
    node_residual
        Inertia and internal forces minus loads for x, y and rotation of each node, shape (instants, nodes, 3). Summed
        over the nodes that share a coordinate, this is the residual of the equation of motion.
    violation
        Residuals of the constraints [m or rad], shape (instants, constraints).
    """

    elements: ElementState
    masses: MassState
    couplings: CouplingState
    coupling_force: Reals
    node_residual: Reals
    violation: Reals


class DriveStates(Struct, frozen=True, eq=False):
    """Coordinates of the drives, including full turns, and their rates, each of shape (instants, drives).

    The rates are 0 if no joint of a drive is compliant and damped, because nothing else depends on them.
    """

    coordinates: Reals
    rates: Reals


class System(Struct, frozen=True, eq=False, dict=True):
    """Equations of motion of a mechanism.

    The coordinates are x, y and rotation of all nodes. A coordinate that several nodes have in common occurs only once.
    Arrays of coordinates have the shape (instants, coordinates). Prescribed coordinates are those of the ground, of
    nodes at pins on the ground, and the rotations of links that a drive turns relative to the ground. All other
    coordinates are free.
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
        fixed[self.of_node[list(self.ties.fixed), :2]] = True
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
    def constraint_unit(self) -> Reals:
        """Unit of each constraint: the size of the mechanism [m], or 1 rad."""
        kinds = [self.ties.couplings[own.parts[0][0]].kind for own in self.ties.constraints]
        return np.array([1.0 if kind == CouplingKind.TURN else self.rigid.size for kind in kinds])

    def drives(self, time: Reals) -> DriveStates:
        """Return the states of the drives at given instants."""
        places = coordinates(self.laws, time) + self.ties.winding
        damped = any(spring.drive is not None and spring.damping for spring in self.ties.springs)
        return DriveStates(places, drive_rates(self.laws, time) if damped else np.zeros_like(places))

    def load_factors(self, time: Reals) -> Reals:
        """Evaluate the laws of all loads, shape (instants, loads)."""
        return factors(self.loads, time, self.rigid)

    def rigid_coordinates(self, places: Reals) -> Reals:
        """Return the coordinates of all nodes for undeformed links, shape (instants, coordinates).

        `places` are x, y and angle of the links, shape (instants, links, 3).
        """
        carried = places[:, self.nodes.link]
        way = self.nodes.rest * np.exp(1j * carried[..., 2])
        carried = carried + np.stack([way.real, way.imag, np.zeros(way.shape)], axis=-1)
        q = np.zeros((len(places), len(self.prescribed)))
        q[:, self.of_node.ravel()] = carried.reshape(len(places), -1)
        return q

    def prescribe(self, q: Reals, drives: DriveStates) -> None:
        """Set the prescribed coordinates in the array `q`, shape (instants, coordinates)."""
        q[:, self.of_node[0]] = 0.0
        for node, place in self.ties.fixed.items():
            q[:, self.of_node[node, 0]], q[:, self.of_node[node, 1]] = complex(place).real, complex(place).imag
        for drive, node in self.ties.driven.items():
            q[:, self.of_node[node, 2]] = drives.coordinates[:, drive]

    def residual(
        self,
        q: Reals,
        v: Reals,
        a: Reals,
        multipliers: Reals,
        drives: DriveStates,
        factor: Reals,
        tangent: bool = True,
        assumed: Reals | None = None,
    ) -> tuple[Reals, State, Tangents | None]:
        """Compute the residual of the equations of motion, shape (instants, coordinates), its state and its tangents.

        Parameters
        ----------
        q, v, a
            Coordinates, rates and accelerations, each of shape (instants, coordinates).
        multipliers
            Lagrange multipliers of the constraints, shape (instants, constraints).
        drives
            States of the drives.
        factor
            Factors of the loads, shape (instants, loads).
        tangent
            True to compute the tangents.
        assumed
            N, Q and M of the elements for the geometric stiffness, see `element_state`.
        """
        place, rate, acceleration = (values[:, self.of_node] for values in (q, v, a))
        beams = element_state(self.nodes.elements, place, rate, tangent, assumed)
        masses = mass_state(self.nodes.masses, place, rate, acceleration, complex(self.mechanism.gravity))
        pairs = coupling_state(tuple(self.ties.couplings), place)
        pushed, push_change = load_state(self.loads, place, factor)
        seen = rate[:, self._ends].reshape(*pairs.value.shape, 6)
        pull, spring_stiffness, spring_damping = self._coupling_forces(
            pairs, (pairs.gradient * seen).sum(-1), multipliers, drives
        )
        along = pull[..., None] * pairs.gradient
        node_residual = masses.force.copy()
        for nodes, forces in (
            (self.nodes.elements.nodes, beams.force),
            (self._ends, along),
            (self.loads.node, -pushed),
        ):
            everywhere: Any = (slice(None), nodes)
            np.add.at(node_residual, everywhere, forces.reshape(len(q), *nodes.shape, 3))
        total = node_residual.reshape(len(q), -1) @ self._gather
        state = State(beams, masses, pairs, pull, node_residual, self._violations(pairs.value, drives.coordinates))
        if not tangent:
            return total, state, None
        changing = np.einsum("psij,psj->psi", pairs.second, seen)
        outer = pairs.gradient[..., :, None] * pairs.gradient[..., None, :]
        spring = spring_stiffness[:, :, None, None] * outer + pull[..., None, None] * pairs.second
        spring += spring_damping[:, :, None, None] * pairs.gradient[..., :, None] * changing[..., None, :]
        stiffness = self._spread(beams.stiffness, spring, masses.stiffness, -push_change)
        damping = self._spread(beams.damping, spring_damping[:, :, None, None] * outer, masses.damping, 0 * push_change)
        none = np.zeros((len(q), 0, 1, 1))
        mass = self._spread(none, none, masses.mass, none)
        return total, state, Tangents(stiffness, damping, mass, self._rows(pairs.gradient))

    def predicted(self, state: State, change: Reals, change_of_rate: Reals) -> Reals:
        """Predict N, Q and M of the elements after a change of the coordinates and of their rates."""
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
        """Factors of the couplings in the constraints, shape (constraints, couplings).

        A constraint prescribes a weighted sum of couplings, i.e. of functions of the coordinates of two nodes.
        """
        table = np.zeros((len(self.ties.constraints), len(self.ties.couplings)))
        for row, constraint in enumerate(self.ties.constraints):
            for number, factor in constraint.parts:
                table[row, number] += factor
        return table

    def _violations(self, value: Reals, drives: Reals) -> Reals:
        wanted = np.zeros((len(value), len(self.ties.constraints)))
        for row, constraint in enumerate(self.ties.constraints):
            wanted[:, row] = constraint.target + (0.0 if constraint.drive is None else drives[:, constraint.drive])
        return value @ self.parts.T - wanted

    def _coupling_forces(
        self, pairs: CouplingState, opening: Reals, multipliers: Reals, drives: DriveStates
    ) -> tuple[Reals, Reals, Reals]:
        """Return the forces of the couplings, and the derivatives of each force.

        The derivatives are those with respect to the value and to the rate of the coupling.

        The shapes are (instants, couplings), (1, couplings) and (1, couplings). `opening` contains the rates of the
        couplings.
        """
        pull = multipliers @ self.parts
        spring_stiffness, spring_damping = np.zeros((2, 1, pull.shape[1]))
        for spring in self.ties.springs:
            k = spring.coupling
            stretch, stretch_rate = spring.stretch(pairs.value[:, k]), opening[:, k]
            if spring.drive is not None:
                stretch = stretch - drives.coordinates[:, spring.drive]
                stretch_rate = stretch_rate - drives.rates[:, spring.drive]
            pull[:, k] += spring.preload + spring.stiffness * stretch + spring.damping * stretch_rate
            spring_stiffness[0, k] += spring.stiffness
            spring_damping[0, k] += spring.damping
        return pull, spring_stiffness, spring_damping

    @cached_property
    def _spots(self) -> tuple[Integers, Any]:
        """Row and column numbers of tangent entries.

        The first array contains the index of each coordinate among the free ones, or -1 if it is prescribed. The others
        contain the coordinates of each element, coupling, node and load, shape (..., 6) or (..., 3).
        """
        number = np.full(len(self.prescribed), -1)
        number[self.free] = np.arange(len(self.free))
        beams = self.of_node[self.nodes.elements.nodes].reshape(-1, 6)
        pairs = self.of_node[self._ends].reshape(-1, 6)
        return number, (beams, pairs, self.of_node, self.of_node[self.loads.node])

    @cached_property
    def _scatter(self) -> tuple[Any, ...]:
        """Sparse matrices that sum the entries of blocks to the entries of the tangent, shape (free^2, entries).

        There is one for each kind of block: elements, couplings, nodes and loads.
        """
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
        """Assemble the blocks of elements, couplings, nodes and loads to tangents, shape (instants, free, free)."""
        size, count = len(self.free), len(blocks[0])
        total = np.zeros((size * size, count))
        for scatter, own in zip(self._scatter, blocks, strict=True):
            if own.shape[1]:
                total += scatter @ own.reshape(count, -1).T
        return np.ascontiguousarray(total.T).reshape(count, size, size)

    def _rows(self, gradient: Reals) -> Reals:
        """Return the derivatives of the constraints with respect to the free coordinates, see `Tangents.rows`."""
        number, (_, pairs, _, _) = self._spots
        table = np.zeros((len(gradient), len(self.ties.constraints), len(self.free) + 1))
        for row, constraint in enumerate(self.ties.constraints):
            for coupling, factor in constraint.parts:
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
    joint_damping: float = 0.0,
) -> System:
    """Set up the equations of motion of a mechanism.

    Parameters
    ----------
    laws
        For each drive, a function of time [s] that returns coordinate, rate and acceleration.
    start
        Time at the start of the motion [s].
    elements
        Number of elements per beam.
    rigid
        Positions of the rigid links, if already computed.
    damping, joint_damping
        Kelvin-Voigt beta of the beams and of the compliant joints [s].

    Raises
    ------
    ValueError
        If the number of sections or laws is wrong, or `elements` is less than 1.
    NotCheckedError
        If the check does not support a part of the mechanism, or the arrays contain several designs.
    """
    several = [value for own in sections for value in astuple(own) if np.ndim(value) and np.size(value) > 1]
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
    ties = ties_of(mechanism, nodes, joints or {}, rigid.drawn, first, joint_damping)
    return System(mechanism, tuple(laws), rigid, nodes, ties, loads_of(mechanism, nodes))
