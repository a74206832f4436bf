"""Layers of solid links, chosen such that overlapping links are in different layers."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from animations.shapes import Complexes
from rigid import Reals

LAYER_PITCH = 1.2  # distance between the mid-planes of neighbouring layers, relative to the mean of both thicknesses
SIDES = np.exp(2j * np.pi * np.arange(64) / 64)  # directions in which the extents of bodies are measured
PIERCING_COST = 3.0  # [layers] axle length that costs as much as passing through a link that is not on the axle


class Stack(Struct, frozen=True, eq=False):
    """Positions of the links normal to the plane of motion.

    Attributes
    ----------
    layer
        Index of the layer of each link. The ground is behind all other links and has the index -1.
    middle, thick
        z of the mid-plane of each link, and thickness of the layer of each link [m].
    """

    layer: Sequence[int]
    middle: Sequence[float]
    thick: Sequence[float]


def stacked(layer_of: Sequence[int], thick: Sequence[float]) -> Stack:
    """Stack the layers. Each layer is as thick as its thickest link; the layer of the ground is as thick as layer 0."""
    of_layer = [0.0] * (max(layer_of) + 1)
    for layer, each in zip(layer_of[1:], thick[1:], strict=True):
        of_layer[layer] = max(of_layer[layer], each)
    of_layer = [of_layer[0], *of_layer]
    steps = LAYER_PITCH * (np.array(of_layer[:-1]) + np.array(of_layer[1:])) / 2
    heights = np.concatenate([[0.0], np.cumsum(steps)])
    heights -= (heights[1] + heights[-1]) / 2
    middle = [float(heights[layer + 1]) for layer in layer_of]
    return Stack(list(layer_of), middle, [of_layer[layer + 1] for layer in layer_of])


def layers(bodies: Sequence[Sequence[Reals]], pins: Sequence[tuple[set[int], Reals]]) -> list[int]:
    """Assign a layer to each link; the ground gets layer -1.

    Overlapping links get different layers. Axles should be short and pass through few links that they do not join. A
    local search moves a link to another layer, or swaps two layers, as long as this reduces the cost.

    Parameters
    ----------
    bodies
        Extents of the parts of each link, see `reach`; empty for the ground.
    pins
        For each axle, the set of links that it joins, and the extent of the axle (see `reach`).
    """
    links = range(len(bodies))
    meeting = [(a, b) for a, b in combinations(links, 2) if meet(bodies[a], bodies[b])]
    pierced = [
        (members, [link for link in links if link not in members and meet(bodies[link], [axle])])
        for members, axle in pins
    ]

    def cost(assigned: Sequence[int]) -> float:
        total = 1e6 * sum(assigned[a] == assigned[b] for a, b in meeting)
        for members, others in pierced:
            levels = [assigned[member] for member in members]
            low, high = min(levels), max(levels)
            total += high - low + PIERCING_COST * sum(low < assigned[other] < high for other in others)
        return total

    best = [-1, *[0] * (len(bodies) - 1)]
    while True:
        tried = [[*best[:at], layer, *best[at + 1 :]] for at in links[1:] for layer in range(max(best) + 2)]
        for a, b in combinations(range(max(best) + 1), 2):
            tried.append([{a: b, b: a}.get(layer, layer) for layer in best])
        better = min(tried, key=cost, default=best)
        if cost(better) >= cost(best):
            return _without_gaps(best)
        best = better


def _without_gaps(assigned: Sequence[int]) -> list[int]:
    """Renumber the layers such that no number is unused."""
    taken = sorted(set(assigned))
    return [taken.index(layer) - 1 for layer in assigned]


def reach(points: Complexes, radius: float) -> Reals:
    """Return the largest coordinate of points along each direction of `SIDES`, plus the margin `radius` [m].

    Parameters
    ----------
    points
        Points of a body, shape (positions, points).

    Returns
    -------
        Array of shape (positions, sides).
    """
    return (np.conj(SIDES) * points[..., None]).real.max(axis=1) + radius


def meet(some: Sequence[Reals], others: Sequence[Reals]) -> bool:
    """Return whether a part of one body overlaps a part of the other body at some position.

    Parts are represented by their convex hulls.
    """
    if not some or not others:
        return False
    near = _over(np.max(some, axis=0), np.max(others, axis=0))  # a comparison of whole bodies rules out most pairs
    return bool(near.any()) and any(bool(_over(one[near], other[near]).any()) for one in some for other in others)


def _over(one: Reals, other: Reals) -> NDArray[Any]:
    """Return for each position whether two hulls overlap, i.e. whether no direction of `SIDES` separates the hulls."""
    return np.all(one + np.roll(other, len(SIDES) // 2, axis=-1) > 0, axis=-1)
