"""Couplings of two nodes: gaps of pins and sliders, coordinates of drives and gears, and lengths of springs.

A coupling is a function c of the positions and rotations of two nodes. The first node may be the ground. A constraint,
spring or damper loads the two nodes with a generalised force times the gradient of c. The generalised force is a moment
if c is an angle, and a force if c is a length.
"""

from enum import IntEnum
from typing import Any

import numpy as np
from msgspec import Struct

from rigid import Reals


class CouplingKind(IntEnum):
    """Kinds of a coupling c.

    X, Y: component of the vector between the two points, in ground axes. ALONG, ACROSS: component along or across a
    line that is fixed to the parent. TURN: angle between the nodes. DISTANCE: distance between the two points.
    """

    X = 0
    Y = 1
    TURN = 2
    ALONG = 3
    ACROSS = 4
    DISTANCE = 5


class NodeCoupling(Struct, frozen=True):
    """Function c of the coordinates of two nodes.

    Attributes
    ----------
    kind
        Kind of c.
    parent, child
        Indices of the nodes.
    at_parent, at_child
        The two points relative to the nodes, in link axes [m].
    line
        Unit vector for ALONG and ACROSS in the link axes of the parent.
    """

    kind: CouplingKind
    parent: int
    child: int
    at_parent: complex = 0.0
    at_child: complex = 0.0
    line: complex = 1.0


class CouplingState(Struct, frozen=True, eq=False):
    """Values and derivatives of all couplings.

    Attributes
    ----------
    value
        Values of c, shape (instants, couplings).
    gradient
        First derivatives with respect to x, y and rotation of the parent and then of the child, shape (instants,
        couplings, 6).
    second
        Second derivatives with respect to the same coordinates, shape (instants, couplings, 6, 6).
    """

    value: Reals
    gradient: Reals
    second: Reals


def coupling_state(couplings: tuple[NodeCoupling, ...], q: Reals) -> CouplingState:
    """Evaluate all couplings for node coordinates q of shape (instants, nodes, 3)."""
    shape = (len(q), len(couplings))
    value, gradient, second = np.zeros(shape), np.zeros((*shape, 6)), np.zeros((*shape, 6, 6))
    for number, own in enumerate(couplings):
        here = _turn(own, q) if own.kind is CouplingKind.TURN else _gap(own, q)
        value[:, number], gradient[:, number], second[:, number] = here
    return CouplingState(value, gradient, second)


def _turn(own: NodeCoupling, q: Reals) -> tuple[Reals, Reals, Any]:
    return q[:, own.child, 2] - q[:, own.parent, 2], np.array([0, 0, -1.0, 0, 0, 1.0]), 0.0


def _gap(coupling: NodeCoupling, q: Reals) -> tuple[Reals, Reals, Reals]:
    """Return a coupling that depends on the vector between its two points, and its first and second derivatives."""
    (zp, ep), (zc, ec) = (
        (q[:, node, 0] + 1j * q[:, node, 1], np.exp(1j * q[:, node, 2])) for node in (coupling.parent, coupling.child)
    )
    arm = coupling.at_child * ec
    d, dd = np.zeros((len(q), 6), complex), np.zeros((len(q), 6, 6), complex)
    if coupling.kind in (CouplingKind.ALONG, CouplingKind.ACROSS):
        back = np.conj(coupling.line * ep)
        u = back * (zc + arm - zp)
        d[:, 2], dd[:, 2, 2] = -1j * u, -u
        dd[:, 2, 0] = dd[:, 0, 2] = 1j * back
        dd[:, 2, 1] = dd[:, 1, 2] = -back
        dd[:, 2, 3] = dd[:, 3, 2] = -1j * back
        dd[:, 2, 4] = dd[:, 4, 2] = back
        dd[:, 2, 5] = dd[:, 5, 2] = arm * back
        u = u - np.conj(coupling.line) * coupling.at_parent
    else:
        back = np.ones(len(q))
        u = zc + arm - zp - coupling.at_parent * ep
        d[:, 2], dd[:, 2, 2] = -1j * coupling.at_parent * ep, coupling.at_parent * ep
    d[:, 0], d[:, 1], d[:, 3], d[:, 4], d[:, 5] = -back, -1j * back, back, 1j * back, 1j * arm * back
    dd[:, 5, 5] = -arm * back
    if coupling.kind is not CouplingKind.DISTANCE:
        part = np.real if coupling.kind in (CouplingKind.X, CouplingKind.ALONG) else np.imag
        return part(u), part(d), part(dd)
    reach = np.abs(u)
    unit = np.conj(u / reach)
    seen = unit[:, None] * d
    across = seen.imag[:, :, None] * seen.imag[:, None, :] / reach[:, None, None]
    return reach, seen.real, (unit[:, None, None] * dd).real + across
