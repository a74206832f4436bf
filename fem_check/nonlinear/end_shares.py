"""Section forces at nodes: share of the distributed load on each side of a node.

Elements are loaded only at their ends. The section force at a node is the end force of an element minus the share of
the lumped load on that element's side. The first half of the nodes use the element after them, the last half the
element before them; the shares are symmetric.
"""

from __future__ import annotations

import numpy as np

from fem_check.nonlinear.node_masses import gathering_weights
from rigid import Reals

EXACT_DISTANCE = 6
"""Number of elements from which far nodes use the exact share."""


def inertia_shares(count: int) -> tuple[Reals, Reals]:
    """Shares of inertia and weight, as lumped in the masses.

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


def line_shares(count: int) -> tuple[Reals, Reals]:
    """Shares of line loads lumped by cubic shape functions, see `inertia_shares`."""
    push, lever = np.zeros((2, count + 1, count + 1))
    for node in range(count // 2 + 1 if count > 1 else 1):
        push[node, [node, node + 1]] = 7 / 20, 3 / 20
        lever[node, [node, node + 1]] = 1 / 20, 1 / 30
    return _mirrored(push, count), _mirrored(lever, count)


def _up_to(count: int) -> tuple[Reals, Reals]:
    """Load lumped up to each node, minus the exact load of a piecewise linear distribution.

    At the beam's start, the first moment of the mass multiplies the slope of the load, taken as the first difference.
    """
    weights, place = np.diag(gathering_weights(count)), np.arange(count + 1)
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


def _mirrored(table: Reals, count: int) -> Reals:
    """Mirror the first half of the nodes to the last half."""
    mirrored = table.copy()
    for node in range(count // 2 + 1 if count > 1 else 1, count + 1):
        mirrored[node] = table[count - node, ::-1]
    return mirrored
