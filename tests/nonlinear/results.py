"""Results of a nonlinear motion: displacements, section and joint forces, drive efforts, energies."""

from collections import namedtuple
from types import SimpleNamespace

import numpy as np

from elastic.links import members_of
from fem_check.nonlinear.couplings import CouplingKind
from fem_check.nonlinear.loads import RigidLinkMotion
from fem_check.nonlinear.node_masses import lumping_weights
from fem_check.nonlinear.refinement import displacements
from fem_check.nonlinear.rigid_places import as_complex
from rigid import LineLoad

Powers = np.polynomial.polynomial.polyval
EXACT_DISTANCE = 6  # number of elements from which far nodes use the exact share

Instants = namedtuple("Instants", "time rigid q v a multipliers state")
"""Coordinates and rates at some times [s], coordinates of the rigid links, multipliers, and the state."""

JointForce = namedtuple("JointForce", "name link on force moment")
"""Force [N], complex, in the ground's axes, and moment [N m] of a pin or slider on `link`, without drive efforts and
springs; the opposite acts on `on`."""


def solution_of(system, elements, instants):
    """Compute all results from the coordinates.

    Attributes of the result, of shape (beams, positions, nodes) if no other is given:

    time, drive
        [s], shape (positions,); coordinates of the drives [rad or m], shape (drives, positions).
    xi
        Nodes of each beam, x'/l, shape (elements + 1,).
    u, w, phi
        Displacement [m] from the rigid position in the beam's rigid axes, and rotation from these axes [rad].
    chord
        Transverse displacement from the displaced chord [m].
    N, V, M
        [N, N m] in the axes of the rotated section; nan for beams of rigid links.
    efforts
        Moment [N m] or force [N] of each drive along its coordinate, shape (drives, positions).
    kinetic, stored, potential, dissipated
        Energies of motion, strain and springs, and weight [J], and damping power [W], shape (positions,).
    """
    xi = np.linspace(0.0, 1.0, elements + 1)
    drive = system.drives(instants.time).coordinates - system.ties.winding
    beams = range(len(system.mechanism.beams))
    fields = np.stack([_fields(system, k, xi, instants) for k in beams] or [np.zeros((6, 0, 0))], axis=1)
    return SimpleNamespace(
        time=instants.time,
        drive=drive.T,
        elements=elements,
        xi=xi,
        chord=members_of(system.mechanism).from_chord(fields[1], xi),
        **dict(zip(("u", "w", "phi", "N", "V", "M"), fields, strict=True)),
        joints=tuple(_joint_force(system, source, instants) for source in system.ties.joints),
        efforts=_efforts(system, instants.state),
        kinetic=instants.state.masses.energy.sum(-1),
        stored=instants.state.elements.energy.sum(-1) + _spring_energy(system, instants),
        potential=_potential(system, instants),
        dissipated=_dissipated(system, instants),
    )


def _fields(system, k, xi, instants):
    """u, w, phi, N, V and M of a beam, shape (6, positions, nodes)."""
    moved = displacements(system, k, xi, instants.q, instants.rigid)
    if not system.nodes.along[k]:
        return np.concatenate([moved, np.full(moved.shape, np.nan)])
    at, beam = system.mechanism.beams[k]
    points = system.mechanism.links[at].points
    way = complex(points[beam.end]) - complex(points[beam.start])
    return np.concatenate([moved, _section_forces(system, k, xi, way / abs(way), instants)])


def _section_forces(system, k, xi, axis, instants):
    """N, V and M at the nodes, (3, positions, nodes), see `inertia_shares`."""
    beam, along = system.mechanism.beams[k][1], list(system.nodes.along[k])
    count = len(along) - 1
    pieces = slice(system.nodes.first[k], system.nodes.first[k] + count)
    ends = instants.state.elements.force[:, pieces]
    h = system.nodes.elements.length[pieces][0]
    direction = axis * np.exp(1j * instants.q[:, system.of_node[along, 2]])
    line = float(beam.mass_per_length) * Powers(xi, beam.mass_taper)
    felt = line * (complex(system.mechanism.gravity) - as_complex(instants.a[:, system.of_node[along]]))
    laid = line_loads(system.rigid, k, xi, direction, instants.time)
    (push, lever), (laid_push, laid_lever) = inertia_shares(count), line_shares(count)
    force, arm = h * (felt @ push.T + laid @ laid_push.T), h**2 * (felt @ lever.T + laid @ laid_lever.T)
    first = np.arange(count // 2 + 1) if count > 1 else np.arange(1)
    last = np.arange(len(first), count + 1)
    moment = (np.conj(direction) * arm).imag
    force[:, first] -= as_complex(ends[:, first, :2])
    moment[:, first] -= ends[:, first, 2]
    force[:, last] = as_complex(ends[:, last - 1, 3:5]) - force[:, last]
    moment[:, last] += ends[:, last - 1, 5]
    seen = np.conj(direction) * force
    return np.stack([seen.real, -seen.imag, moment])


def _joint_force(system, source, instants):
    names = [system.mechanism.links[number].name for number in (source.child, source.parent)]
    pull = instants.state.coupling_force
    moment = np.zeros(len(pull)) if source.turn is None else -pull[:, source.turn]
    if source.node is not None:
        needed = instants.state.node_residual[:, source.node]
        return JointForce(source.name, names[0], names[1], as_complex(needed), moment)
    first, second = source.couplings
    coupling = system.ties.couplings[first]
    if coupling.kind is CouplingKind.X:
        return JointForce(source.name, names[0], names[1], -(pull[:, first] + 1j * pull[:, second]), moment)
    across = 1j * coupling.line * np.exp(1j * instants.q[:, system.of_node[coupling.parent, 2]])
    return JointForce(source.name, names[0], names[1], -pull[:, first] * across, -pull[:, second])


def _efforts(system, state):
    rows = np.zeros((len(system.ties.drive_couplings), len(state.node_residual)))
    for drive, mover in enumerate(system.ties.drive_couplings):
        rows[drive] = (
            state.node_residual[:, system.ties.driven[drive], 2] if mover is None else -state.coupling_force[:, mover]
        )
    return rows


def _spring_energy(system, instants):
    total = np.zeros(len(instants.time))
    drives = system.drives(instants.time).coordinates
    for spring in system.ties.springs:
        stretch = spring.stretch(instants.state.couplings.value[:, spring.coupling])
        stretch = stretch - (0.0 if spring.drive is None else drives[:, spring.drive])
        total += spring.preload * stretch + spring.stiffness * stretch**2 / 2
    return total


def _potential(system, instants):
    place, masses = instants.q[:, system.of_node], system.nodes.masses
    moment = masses.mass * as_complex(place) + masses.first * np.exp(1j * place[..., 2])
    return -(np.conj(complex(system.mechanism.gravity)) * moment).real.sum(-1)


def _dissipated(system, instants):
    total = instants.state.elements.power.sum(-1)
    rate = instants.v[:, system.of_node]
    for damper in system.ties.springs:
        pair = system.ties.couplings[damper.coupling]
        seen = np.concatenate([rate[:, pair.parent], rate[:, pair.child]], axis=-1)
        total = total + damper.damping * (instants.state.couplings.gradient[:, damper.coupling] * seen).sum(-1) ** 2
    return total


def line_loads(rigid, beam, xi, direction, time):
    """Return the force per length at a beam's nodes in ground axes [N/m], complex, (instants, nodes)."""
    motion = RigidLinkMotion(time, rigid)
    mechanism = rigid.mechanism
    at = mechanism.beams[beam][0]
    number = beam - next(k for k, (link, _) in enumerate(mechanism.beams) if link == at)
    total = np.zeros(direction.shape, complex)
    for load in mechanism.loads:
        if isinstance(load, LineLoad) and mechanism.index[load.link] == at and load.beam == number:
            factor = np.ones(time.shape) if load.law is None else np.broadcast_to(load.law(motion), time.shape)
            given = complex(load.start) + (complex(load.end) - complex(load.start)) * xi
            total += factor[:, None] * given * (direction if load.turning else 1.0)
    return total


def inertia_shares(count):
    """Return the shares of inertia and weight on each side of a node, as lumped in the masses.

    Elements are loaded only at their ends. The section force at a node is the end force of an element minus the share
    of the lumped load on that element's side: the element after the node in the first half, before it in the last.

    Returns
    -------
    Force and lever at each node per load at each node, in element lengths and their squares, each of shape
    (nodes, nodes).
    """
    push, lever = _up_to(count)
    if count >= EXACT_DISTANCE:
        for node in range(3, count // 2 + 1):
            push[node], lever[node] = 0.0, 0.0
            push[node, [node, node + 1]] = 5 / 12, 1 / 12
            lever[node, node] = 1 / 12
    return _mirrored(push, count), _mirrored(lever, count)


def line_shares(count):
    """Shares of line loads lumped by cubic shape functions, see `inertia_shares`."""
    push, lever = np.zeros((2, count + 1, count + 1))
    for node in range(count // 2 + 1 if count > 1 else 1):
        push[node, [node, node + 1]] = 7 / 20, 3 / 20
        lever[node, [node, node + 1]] = 1 / 20, 1 / 30
    return _mirrored(push, count), _mirrored(lever, count)


def _up_to(count):
    """Load lumped up to each node, minus the exact load of a piecewise linear distribution.

    At the beam's start, the first moment of the mass multiplies the slope of the load, taken as the first difference.
    """
    weights, place = np.diag(lumping_weights(count)), np.arange(count + 1)
    weights[0, :2] += -1 / 12, 1 / 12
    turning = np.zeros(count + 1)
    turning[:2] = 1 / 12 - 1 / 72, 1 / 72
    push, lever = np.zeros((2, count + 1, count + 1))
    for node in range(count + 1):
        push[node] = weights[: node + 1].sum(axis=0)
        lever[node] = turning - (node - place[:node]) @ weights[:node]
        for start in range(node):
            push[node, [start, start + 1]] -= 1 / 2
            beyond = node - start - 1
            lever[node, [start, start + 1]] += beyond / 2 + 1 / 3, beyond / 2 + 1 / 6
    return push, lever


def _mirrored(table, count):
    """Mirror the first half of the nodes to the last half."""
    mirrored = table.copy()
    for node in range(count // 2 + 1 if count > 1 else 1, count + 1):
        mirrored[node] = table[count - node, ::-1]
    return mirrored
