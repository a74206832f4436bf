"""Stiffness and consistent mass of a free body in its own axes, for one design.

Assembly is vectorised over positions with element tables. scikit-fem would need a mesh per position, because nodes move
with slider blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Section, Taper
from fem_check.linear.elements import ElementKind, hermite, quadratic
from fem_check.linear.lines import ElementRow
from rigid import Beam, Reals

MIN_NODE_DISTANCE = 0.02  # smallest distance between a block's node and the next, relative to equal elements

Powers = np.polynomial.polynomial.polyval


@dataclass(frozen=True, eq=False)
class ElementField:
    """Displacement field of a body: element dofs [m, rad] per coordinate.

    `values` of shape (positions or 1, elements, dofs of an element, n).
    """

    kind: ElementKind
    values: Reals

    def at(self, functions: Reals, length: Reals) -> Reals:
        """Displacement per coordinate, (..., elements, places, n), for functions (dofs, places)."""
        scale = np.power.outer(length, self.kind.turns)
        values: Reals = np.einsum("dg,...edn->...egn", functions, self.values * scale[..., None])
        return values


@dataclass(frozen=True, eq=False)
class VibratingBody:
    """Stiffness and mass of a body with n coordinates.

    Attributes
    ----------
    stiffness, mass
        Shape (positions or 1, n, n).
    fields
        u, the bending part of w, and the shear part if any; empty for a link without beams.
    nodes
        Node positions along the beam [m], shape (positions or 1, nodes).
    """

    stiffness: Reals
    mass: Reals
    fields: tuple[ElementField, ...]
    nodes: Reals

    def moves(self, x: Reals) -> Reals:
        """Axial and transverse displacement and rotation at one place per position, (3, positions, n)."""
        moved = np.zeros((3, len(x), self.mass.shape[-1]))
        if not self.fields:
            moved[:] = np.eye(3)[:, None]
            return moved
        rows, nodes = np.arange(len(x)), np.broadcast_to(self.nodes, (len(x), self.nodes.shape[1]))
        element = np.clip((nodes <= x[:, None]).sum(axis=1) - 1, 0, nodes.shape[1] - 2)
        length = nodes[rows, element + 1] - nodes[rows, element]
        place = (x - nodes[rows, element]) / length
        for number, field in enumerate(self.fields):
            values = np.broadcast_to(field.values, (len(x), *field.values.shape[1:]))[rows, element]
            values = values * np.power.outer(length, field.kind.turns)[..., None]
            moved[min(number, 1)] += np.einsum("dp,pdn->pn", field.kind.sampled(place), values)
            if number == 1:
                slopes = field.kind.sampled(place, derivative=True) / length
                moved[2] += np.einsum("dp,pdn->pn", slopes, values)
        return moved


def one_of(value: Any, design: tuple[int, ...]) -> complex:
    """Select one design from a scalar or an array of shape (designs, 1)."""
    array = np.asarray(value)
    return complex(array[design][0] if array.ndim else array)


def vibrating_lumps() -> VibratingBody:
    """Body of a link without beams: zero matrices, to which lumps are added."""
    nothing = np.zeros((1, 3, 3))
    return VibratingBody(nothing, nothing, (), np.zeros((1, 1)))


def vibrating_beam(
    length: float, beam: Beam, section: Section, elements: int, blocks: Sequence[Reals], design: tuple[int, ...]
) -> VibratingBody:
    """Stiffness and mass of a beam; an infinite rigidity excludes that deformation.

    Parameters
    ----------
    blocks
        xi of slider blocks on the beam at each position; nodes are placed there.
    """
    taper = section.taper or Taper()
    nodes = length * nodes_at(elements, blocks)
    rigidities = {name: one_of(getattr(section, name), design).real for name in ("EA", "EI", "kGA")}
    kinds = {"EA": quadratic(), "EI": hermite()} | ({"kGA": quadratic()} if np.isfinite(rigidities["kGA"]) else {})
    fields = _fields(list(kinds.values()), [rigidities[name] for name in kinds], nodes, elements)
    part, points, weights = np.diff(nodes), quadratic().points, quadratic().weights
    xi = (nodes[:, :-1, None] + part[..., None] * points) / length
    size = fields[0].values.shape[-1]
    stiffness, mass = np.zeros((2, len(nodes), size, size))
    for name, field in zip(kinds, fields, strict=True):
        if np.isfinite(rigidities[name]):
            matrix = field.kind.stiffness(rigidities[name] * Powers(xi, getattr(taper, name)), part)
            resisted = np.einsum("...eij,...ejn->...ein", matrix, field.values)
            stiffness += np.einsum("...ein,...eim->...nm", field.values, resisted)
    there = one_of(beam.mass_per_length, design).real * Powers(xi, beam.mass_taper) * weights * part[..., None]
    along, *across = (field.at(field.kind.shape, part) for field in fields)
    beside: Reals = sum(across)  # type: ignore[assignment]
    for moved in (along, beside):
        mass += _energy(there, moved)
    rotary = one_of(beam.rotary_inertia, design).real
    if rotary:
        turned = fields[1].at(hermite().sampled(points, derivative=True), part) / part[..., None, None]
        mass += _energy(rotary * Powers(xi, beam.rotary_taper) * weights * part[..., None], turned)
    return VibratingBody(stiffness, mass, fields, nodes)


def _energy(weight: Reals, moved: Reals) -> Reals:
    """Sum of the products of two displacements over all points, shape (..., n, n)."""
    rows = moved.reshape(len(moved), -1, moved.shape[-1])
    return (rows * weight.reshape(len(weight), -1, 1)).swapaxes(-1, -2) @ rows


def nodes_at(elements: int, blocks: Sequence[Any]) -> Reals:
    """Nodes on [0, 1] with one at each block, equally spaced between, (positions or 1, nodes).

    A node is shifted off its block if it would be closer than `MIN_NODE_DISTANCE` to an end or another node.
    """
    count = max(elements, len(blocks) + 1)
    if not blocks:
        return np.linspace(0.0, 1.0, count + 1)[None]
    gap = MIN_NODE_DISTANCE / count
    places = np.sort(np.array(blocks), axis=0)
    for k in range(len(places)):
        low, high = (k + 1) * gap, 1.0 - (len(places) - k) * gap
        places[k] = np.clip(places[k], low if k == 0 else np.maximum(low, places[k - 1] + gap), high)
    numbers = np.round(places * count)
    for k in range(len(places)):
        before = numbers[k - 1] if k else 0.0
        numbers[k] = np.clip(numbers[k], before + 1, count - len(places) + k)
    nodes = np.zeros((places.shape[1], count + 1))
    none, every = np.zeros_like(places[:1]), np.ones_like(places[:1])
    stops, marks = np.concatenate((none, places, every)), np.concatenate((none, numbers, count * every))
    for k in range(len(stops) - 1):
        share = (np.arange(count + 1) - marks[k][:, None]) / (marks[k + 1] - marks[k])[:, None]
        there = (share >= 0) & (share <= 1)
        nodes = np.where(there, stops[k][:, None] + share * (stops[k + 1] - stops[k])[:, None], nodes)
    return nodes


def _fields(kinds: list[ElementKind], rigidities: list[float], nodes: Reals, elements: int) -> tuple[ElementField, ...]:
    """Dofs of each field per coordinate; only rigid motions for an infinite rigidity.

    The shear part is zero at the start, because the bending part moves the beam's start.
    """
    lines = [ElementRow(kind, nodes.shape[1] - 1) for kind in kinds]
    parts = []
    for number, (line, rigidity) in enumerate(zip(lines, rigidities, strict=True)):
        if np.isfinite(rigidity):
            parts.append(np.eye(line.size)[None, :, 1 if number == 2 else 0 :])
            continue
        m, ends = line.kind.nodal, line.kind.nodal * nodes.shape[1]
        rigid = np.ones((len(nodes), line.size, m))  # also for inner nodes, which have no rotation
        rigid[:, :ends] = line.kind.rigid(nodes).reshape(len(nodes), ends, m)
        parts.append(rigid)
    stops = np.cumsum([0, *(part.shape[-1] for part in parts)])
    return tuple(
        ElementField(
            line.kind, np.pad(part, ((0, 0), (0, 0), (first, stops[-1] - first - part.shape[-1])))[:, line.dofs]
        )
        for line, part, first in zip(lines, parts, stops, strict=False)
    )
