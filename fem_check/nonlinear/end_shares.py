"""Share of the loads along a beam between a node and the end of the element that ends there.

An element is loaded at its ends only. The force and the moment in the section at a node are those on the end of an
element, and what of the load gathered at the node belongs to that element's side. The first half of the nodes take the
element that begins there, the last half the one that ends there, which is the same from the other end of the beam.
"""

from __future__ import annotations

import numpy as np

from fem_check.nonlinear.node_masses import gathering_weights
from rigid import Reals

LOCAL = 6
"""From so many elements on, what is gathered far from a node counts as exact there."""


def inertia_shares(count: int) -> tuple[Reals, Reals]:
    """Of inertia and weight, as masses gather it.

    Returns
    -------
    Force and lever at every node per load at every node, in lengths of an element and their squares, each of shape
    (nodes, nodes).
    """
    push, lever = _up_to(count)
    if count >= LOCAL:
        for node in range(3, count // 2 + 1):
            push[node], lever[node] = 0.0, 0.0
            push[node, [node, node + 1]] = 5 / 12, 1 / 12
            lever[node, node] = 1 / 12
    return _mirrored(push, count), _mirrored(lever, count)


def line_shares(count: int) -> tuple[Reals, Reals]:
    """Of line loads, gathered by cubic shape functions; as `inertia_shares`."""
    push, lever = np.zeros((2, count + 1, count + 1))
    for node in range(count // 2 + 1 if count > 1 else 1):
        push[node, [node, node + 1]] = 7 / 20, 3 / 20
        lever[node, [node, node + 1]] = 1 / 20, 1 / 30
    return _mirrored(push, count), _mirrored(lever, count)


def _up_to(count: int) -> tuple[Reals, Reals]:
    """Load gathered at the nodes up to each, less that of a load linear between nodes up to there.

    At the start of the beam the arm of its mass feels the slope of the load, taken as the first difference.
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
    """The last half of the nodes as the first, seen from the other end."""
    mirrored = table.copy()
    for node in range(count // 2 + 1 if count > 1 else 1, count + 1):
        mirrored[node] = table[count - node, ::-1]
    return mirrored
