"""Results of the nonlinear check: displacements, forces, drive efforts, energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic import Section
from elastic.links import members_of
from fem_check.nonlinear.couplings import CouplingKind
from fem_check.nonlinear.end_shares import inertia_shares, line_shares
from fem_check.nonlinear.loads import line_loads
from fem_check.nonlinear.system import State, System
from fem_check.nonlinear.ties import JointSource
from rigid import Mechanism, Reals
from rigid.arrays import Complexes

Powers = np.polynomial.polynomial.polyval


@dataclass(frozen=True, eq=False)
class JointForce:
    """Force and moment of a pin or slider on `link`; the opposite acts on `on`.

    `force` [N], complex, in the ground's axes, and `moment` of a slider [N m], shape (positions,). Drive efforts and
    springs are excluded.
    """

    name: str
    link: str
    on: str
    force: Complexes
    moment: Reals


@dataclass(frozen=True, eq=False)
class NonlinearSolution:
    """Motion of an elastic mechanism.

    Attributes
    ----------
    mechanism, sections, elements
        Input of the problem; `elements` per beam.
    time
        [s], shape (positions,).
    drive
        Coordinates of the drives [rad or m], shape (drives, positions).
    xi
        Nodes of each beam, x'/l, shape (elements + 1,).
    u, w, phi
        Axial and transverse displacement [m] from the rigid position in the beam's rigid axes, and rotation from these
        axes [rad], shape (beams, positions, nodes), beams in the order of `Mechanism.beams`.
    chord
        Transverse displacement from the displaced chord [m], same shape.
    N, V, M
        Axial force, shear force [N] and bending moment [N m] in the axes of the rotated section, same shape; nan for
        beams of rigid links.
    joints
        Forces of pins and sliders.
    efforts
        Moment [N m] or force [N] of each drive along its coordinate, shape (drives, positions).
    kinetic, stored
        Kinetic energy, and energy of strain and springs [J], shape (positions,).
    potential
        Energy of weight [J], shape (positions,).
    dissipated
        Power dissipated by damping [W], shape (positions,).
    """

    mechanism: Mechanism
    sections: tuple[Section, ...]
    elements: int
    time: Reals
    drive: Reals
    xi: Reals
    u: Reals
    w: Reals
    phi: Reals
    chord: Reals
    N: Reals
    V: Reals
    M: Reals
    joints: tuple[JointForce, ...]
    efforts: Reals
    kinetic: Reals
    stored: Reals
    potential: Reals
    dissipated: Reals

    def __repr__(self) -> str:
        """Short summary."""
        beams, positions, nodes = self.w.shape
        return f"NonlinearSolution({beams} beams, {positions} positions, {nodes} nodes)"


@dataclass(frozen=True, eq=False)
class Instants:
    """Coordinates and rates at some times, rigid coordinates, and the state."""

    time: Reals
    rigid: Reals
    q: Reals
    v: Reals
    a: Reals
    state: State


def solution_of(system: System, sections: tuple[Section, ...], elements: int, instants: Instants) -> NonlinearSolution:
    """Compute all results from the coordinates."""
    xi = np.linspace(0.0, 1.0, elements + 1)
    drive = system.drives(instants.time) - system.ties.winding
    fields = np.stack([_fields(system, k, xi, instants) for k in range(len(sections))] or [np.zeros((6, 0, 0))], axis=1)
    w = fields[1]
    chord = members_of(system.mechanism).from_chord(w, xi)
    return NonlinearSolution(
        mechanism=system.mechanism,
        sections=sections,
        elements=elements,
        time=instants.time,
        drive=drive.T,
        xi=xi,
        u=fields[0],
        w=w,
        phi=fields[2],
        chord=chord,
        N=fields[3],
        V=fields[4],
        M=fields[5],
        joints=tuple(_joint_force(system, source, instants) for source in system.ties.joints),
        efforts=_efforts(system, instants.state),
        kinetic=instants.state.masses.energy.sum(-1),
        stored=instants.state.elements.energy.sum(-1) + _spring_energy(system, instants),
        potential=_potential(system, instants),
        dissipated=_dissipated(system, instants),
    )


def _complex(values: Reals) -> Complexes:
    return values[..., 0] + 1j * values[..., 1]


def _fields(system: System, k: int, xi: Reals, instants: Instants) -> Reals:
    """u, w, phi, N, V and M of a beam, shape (6, positions, nodes)."""
    moved = displacements(system, k, xi, instants.q, instants.rigid)
    if not system.nodes.along[k]:
        return np.concatenate([moved, np.full(moved.shape, np.nan)])
    at, beam = system.mechanism.beams[k]
    points = system.mechanism.links[at].points
    way = complex(points[beam.end]) - complex(points[beam.start])
    return np.concatenate([moved, _section_forces(system, k, xi, way / abs(way), instants)])


def displacements(system: System, k: int, xi: Reals, q: Reals, rigid: Reals) -> Reals:
    """u, w and phi of a beam from its rigid position, shape (3, positions, nodes).

    `q`, `rigid`: coordinates of the system and of the rigid mechanism, (positions, coordinates).
    """
    at, beam = system.mechanism.beams[k]
    link, along = system.mechanism.links[at], list(system.nodes.along[k])
    start, end = complex(link.points[beam.start]), complex(link.points[beam.end])
    axis = (end - start) / abs(end - start)
    if along:
        now, was = (values[:, system.of_node[along]] for values in (q, rigid))
        turned, first, moved = now[..., 2], was[..., 2], _complex(now - was)
    else:
        node = system.nodes.at[at, beam.start][0]
        now, was = (values[:, system.of_node[[node]]] for values in (q, rigid))
        arm = start + xi * (end - start)
        turned, first = now[..., 2] + 0 * xi, was[..., 2]
        moved = _complex(now - was) + arm * (np.exp(1j * now[..., 2]) - np.exp(1j * first))
    seen = np.conj(axis * np.exp(1j * first)) * moved
    return np.stack([seen.real, seen.imag, turned - first])


def _section_forces(system: System, k: int, xi: Reals, axis: complex, instants: Instants) -> Reals:
    """N, V and M at the nodes, (3, positions, nodes), see `fem_check.nonlinear.end_shares`."""
    beam, along = system.mechanism.beams[k][1], list(system.nodes.along[k])
    count = len(along) - 1
    pieces = slice(system.nodes.first[k], system.nodes.first[k] + count)
    ends = instants.state.elements.force[:, pieces]
    h = system.nodes.elements.length[pieces][0]
    direction = axis * np.exp(1j * instants.q[:, system.of_node[along, 2]])
    line = float(beam.mass_per_length) * Powers(xi, beam.mass_taper)
    felt = line * (complex(system.mechanism.gravity) - _complex(instants.a[:, system.of_node[along]]))
    laid = line_loads(system.rigid, k, xi, direction, instants.time)
    (push, lever), (laid_push, laid_lever) = inertia_shares(count), line_shares(count)
    force, arm = h * (felt @ push.T + laid @ laid_push.T), h**2 * (felt @ lever.T + laid @ laid_lever.T)
    first = np.arange(count // 2 + 1) if count > 1 else np.arange(1)
    last = np.arange(len(first), count + 1)
    moment = (np.conj(direction) * arm).imag
    force[:, first] -= _complex(ends[:, first, :2])
    moment[:, first] -= ends[:, first, 2]
    force[:, last] = _complex(ends[:, last - 1, 3:5]) - force[:, last]
    moment[:, last] += ends[:, last - 1, 5]
    seen = np.conj(direction) * force
    return np.stack([seen.real, -seen.imag, moment])


def _joint_force(system: System, source: JointSource, instants: Instants) -> JointForce:
    names = [system.mechanism.links[number].name for number in (source.child, source.parent)]
    pull = instants.state.pull
    moment = np.zeros(len(pull)) if source.turn is None else -pull[:, source.turn]
    if source.node is not None:
        needed = instants.state.needed[:, source.node]
        return JointForce(source.name, names[0], names[1], _complex(needed), moment)
    first, second = source.couplings
    coupling = system.ties.couplings[first]
    if coupling.kind is CouplingKind.X:
        return JointForce(source.name, names[0], names[1], -(pull[:, first] + 1j * pull[:, second]), moment)
    across = 1j * coupling.line * np.exp(1j * instants.q[:, system.of_node[coupling.parent, 2]])
    return JointForce(source.name, names[0], names[1], -pull[:, first] * across, -pull[:, second])


def _efforts(system: System, state: State) -> Reals:
    rows = np.zeros((len(system.ties.movers), len(state.needed)))
    for drive, mover in enumerate(system.ties.movers):
        rows[drive] = state.needed[:, system.ties.driven[drive], 2] if mover is None else -state.pull[:, mover]
    return rows


def _spring_energy(system: System, instants: Instants) -> Reals:
    total = np.zeros(len(instants.time))
    drives = system.drives(instants.time)
    for spring in system.ties.gives:
        stretch = instants.state.couplings.value[:, spring.coupling] - spring.rest
        stretch = stretch - (0.0 if spring.drive is None else drives[:, spring.drive])
        if spring.wraps:
            stretch = np.remainder(stretch + np.pi, 2 * np.pi) - np.pi
        total += spring.preload * stretch + spring.stiffness * stretch**2 / 2
    return total


def _potential(system: System, instants: Instants) -> Reals:
    place, masses = instants.q[:, system.of_node], system.nodes.masses
    moment = masses.mass * _complex(place) + masses.first * np.exp(1j * place[..., 2])
    total: Reals = -(np.conj(complex(system.mechanism.gravity)) * moment).real.sum(-1)
    return total


def _dissipated(system: System, instants: Instants) -> Reals:
    total: Reals = instants.state.elements.power.sum(-1)
    rate = instants.v[:, system.of_node]
    for damper in system.ties.gives:
        pair = system.ties.couplings[damper.coupling]
        seen = np.concatenate([rate[:, pair.parent], rate[:, pair.child]], axis=-1)
        total = total + damper.damping * (instants.state.couplings.gradient[:, damper.coupling] * seen).sum(-1) ** 2
    return total
