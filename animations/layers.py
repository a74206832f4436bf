"""Which solid link stands before which: no two that are ever seen over each other share a layer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from animations.shapes import Complexes
from rigid import Reals

APART = 1.2  # thicknesses from one layer to the next
SIDES = np.exp(2j * np.pi * np.arange(64) / 64)  # from which a body's extent is taken
PIERCED = 3.0  # layers that an axle may be longer to spare a link it would go through


@dataclass(frozen=True, eq=False)
class Stack:
    """Where links stand across the plane of motion.

    Attributes
    ----------
    layer
        The number of every link's layer; the ground's, behind all, is -1.
    middle, thick
        z of every link's middle, and the thickness of its layer [m].
    """

    layer: Sequence[int]
    middle: Sequence[float]
    thick: Sequence[float]


def stacked(layer_of: Sequence[int], thick: Sequence[float]) -> Stack:
    """Stack of layers as thick as their thickest link; the ground's, behind all, is as thick as the one before it."""
    of_layer = [0.0] * (max(layer_of) + 1)
    for layer, each in zip(layer_of[1:], thick[1:], strict=True):
        of_layer[layer] = max(of_layer[layer], each)
    of_layer = [of_layer[0], *of_layer]
    steps = APART * (np.array(of_layer[:-1]) + np.array(of_layer[1:])) / 2
    heights = np.concatenate([[0.0], np.cumsum(steps)])
    heights -= (heights[1] + heights[-1]) / 2
    middle = [float(heights[layer + 1]) for layer in layer_of]
    return Stack(list(layer_of), middle, [of_layer[layer + 1] for layer in layer_of])


def layers(bodies: Sequence[Sequence[Reals]], pins: Sequence[tuple[set[int], Reals]]) -> list[int]:
    """The layer of every link, counted from the ground's, which is -1.

    Links whose bodies meet are in different layers; of the layers that allow it, axles are short and go through few
    links that they do not join. Found by changing one link or two layers at a time, as long as that is for the better.

    Parameters
    ----------
    bodies
        How far the parts of every link reach, see `reach`; of the ground none.
    pins
        Sets of links that an axle joins, and how far it reaches.
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
            total += high - low + PIERCED * sum(low < assigned[other] < high for other in others)
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
    """Layers numbered by their order alone."""
    taken = sorted(set(assigned))
    return [taken.index(layer) - 1 for layer in assigned]


def reach(points: Complexes, radius: float) -> Reals:
    """How far points reach to each of `SIDES`, with a margin about them [m].

    Parameters
    ----------
    points
        Shape (positions, points).

    Returns
    -------
    Shape (positions, sides).
    """
    found: Reals = (np.conj(SIDES) * points[..., None]).real.max(axis=1) + radius
    return found


def meet(some: Sequence[Reals], others: Sequence[Reals]) -> bool:
    """Whether the hull of a part of one body and of a part of another have a point in common at any position."""
    if not some or not others:
        return False
    near = _over(np.max(some, axis=0), np.max(others, axis=0))  # the wholes' hulls: most pairs are told apart by these
    return bool(near.any()) and any(bool(_over(one[near], other[near]).any()) for one in some for other in others)


def _over(one: Reals, other: Reals) -> NDArray[Any]:
    """Whether two hulls lie over each other, at every position: no line to one of the sides parts them."""
    over: NDArray[Any] = np.all(one + np.roll(other, len(SIDES) // 2, axis=-1) > 0, axis=-1)
    return over
