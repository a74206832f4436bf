"""Nodes of a mechanism: one for the ground, one for each rigid link, and several along each elastic beam."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic import Section
from fem_check.nonlinear.beam_elements import Elements, element_stiffness
from fem_check.nonlinear.node_masses import NodeMasses, lumped_inertia, lumping_weights
from rigid import Beam, Link, Mechanism, MechanismError, Reals
from rigid.arrays import Integers, Numbers

RIGID_FACTOR = 1e6
"""Stiffness that replaces an infinite stiffness in an elastic link, relative to the largest finite one."""

Powers = np.polynomial.polynomial.polyval


class NotCheckedError(MechanismError):
    """Raised if the nonlinear check does not support a part of the mechanism, which the message names."""


class Nodes(Struct, frozen=True):
    """Nodes, elements and masses of a mechanism.

    Attributes
    ----------
    link
        Index of the link of each node.
    rest
        Undeformed position of each node in link axes (complex) [m], shape (nodes,).
    at
        For each link index and point name: index of the node that carries the point, and vector from the node to the
        point in link axes (complex) [m].
    along
        Indices of the nodes along each beam of `Mechanism.beams`; empty for beams of rigid links.
    first
        Index of the first element of each beam.
    elements
        Beam elements.
    masses
        Inertia of the nodes.
    """

    link: Integers
    rest: Numbers
    at: Mapping[tuple[int, str], tuple[int, complex]]
    along: tuple[tuple[int, ...], ...]
    first: tuple[int, ...]
    elements: Elements
    masses: NodeMasses


def is_rigid(section: Section) -> bool:
    """Return whether EA, EI and kGA of a section are all infinite."""
    return not (isfinite(float(section.EA)) or isfinite(float(section.EI)) or isfinite(float(section.kGA)))


def nodes_of(
    mechanism: Mechanism, sections: Sequence[Section], elements: int, damping: float | Sequence[float]
) -> Nodes:
    """Create the nodes of a mechanism. A link with only rigid beams has a single node."""
    builder = _NodeBuilder(mechanism, sections, elements, np.broadcast_to(np.asarray(damping, float), len(sections)))
    for number, link in enumerate(mechanism.links):
        beams = [k for k, (at, _) in enumerate(mechanism.beams) if at == number]
        if number and any(not is_rigid(sections[k]) for k in beams):
            builder.elastic_link(number, link, beams)
        else:
            builder.rigid_link(number, link, beams)
    return builder.built()


class _NodeBuilder:
    """Builder of the nodes."""

    def __init__(self, mechanism: Mechanism, sections: Sequence[Section], elements: int, damping: Reals) -> None:
        self.beams = [beam for _, beam in mechanism.beams]
        self.sections, self.count, self.damping = sections, elements, damping
        self.link: list[int] = []
        self.rest: list[complex] = []
        self.at: dict[tuple[int, str], tuple[int, complex]] = {}
        self.along: list[tuple[int, ...]] = [() for _ in self.beams]
        self.first: list[int] = [0 for _ in self.beams]
        self.elements: list[tuple[Any, ...]] = []
        self.mass: list[list[Any]] = []

    def node(self, link: int, rest: complex) -> int:
        """Add a node and return its index."""
        self.link.append(link)
        self.rest.append(rest)
        self.mass.append([0.0, 0.0, 0.0])
        return len(self.link) - 1

    def add(self, node: int, mass: float, arm: complex = 0.0, inertia: float = 0.0) -> None:
        """Add a mass to a node.

        `arm` is the vector from the node to the centre of the mass, and `inertia` is about this centre.
        """
        masses = self.mass[node]
        masses[0] += mass
        masses[1] += mass * arm
        masses[2] += inertia + mass * abs(arm) ** 2

    def rigid_link(self, number: int, link: Link, beams: Sequence[int]) -> None:
        """Add a rigid link, which has one node at its origin."""
        node = self.node(number, 0.0)
        points = {name: complex(place) for name, place in link.points.items()}
        self.at.update({(number, name): (node, place) for name, place in points.items()})
        for k in beams:
            beam = self.beams[k]
            self._rigid_beam(node, beam, points[beam.start], points[beam.end])
        for lump in link.lumps if number else ():
            self.add(node, float(lump.mass), points[lump.point] + complex(lump.offset), float(lump.inertia))

    def _rigid_beam(self, node: int, beam: Beam, start: complex, end: complex) -> None:
        places, weights = np.polynomial.legendre.leggauss(8)
        xi, vector = (places + 1) / 2, end - start
        line = float(beam.mass_per_length) * Powers(xi, beam.mass_taper)
        turned = float(beam.rotary_inertia) * Powers(xi, beam.rotary_taper)
        for share, mass, inertia in zip(
            xi, line * weights / 2 * abs(vector), turned * weights / 2 * abs(vector), strict=True
        ):
            self.add(node, float(mass), complex(start + share * vector), float(inertia))

    def elastic_link(self, number: int, link: Link, beams: Sequence[int]) -> None:
        """Add an elastic link, with nodes at the ends of the beams and along them."""
        for k in beams:
            self._elastic_beam(number, link, k, [self.sections[j] for j in beams])
        for lump in link.lumps:
            if (number, lump.point) not in self.at:
                raise NotCheckedError(
                    f'link "{link.name}": no beam reaches the point "{lump.point}", which carries a mass'
                )
            self.add(self.at[number, lump.point][0], float(lump.mass), complex(lump.offset), float(lump.inertia))

    def _elastic_beam(self, number: int, link: Link, k: int, of_link: Sequence[Section]) -> None:
        beam = self.beams[k]
        start, end = (complex(link.points[name]) for name in (beam.start, beam.end))
        for name, place in ((beam.start, start), (beam.end, end)):
            if (number, name) not in self.at:
                self.at[number, name] = self.node(number, place), 0.0
        marks, vector = np.linspace(0.0, 1.0, self.count + 1), end - start
        inner = [self.node(number, complex(start + xi * vector)) for xi in marks[1:-1]]
        self.along[k] = (self.at[number, beam.start][0], *inner, self.at[number, beam.end][0])
        self.first[k] = len(self.elements)
        h, axis = abs(vector) / self.count, vector / abs(vector)
        section = _finite(of_link, self.sections[k], abs(vector))
        for j, (first, last) in enumerate(pairwise(marks)):
            stiffness = element_stiffness(section, abs(vector), first, last)
            pair = self.along[k][j : j + 2]
            self.elements.append((pair, axis, h, h * float(section.strain), stiffness, self.damping[k]))
        self._spread_mass(k, beam, h, axis)

    def _spread_mass(self, k: int, beam: Beam, h: float, axis: complex) -> None:
        """Lump the mass of a beam at its nodes, see `fem_check.nonlinear.node_masses`."""
        xi = np.linspace(0.0, 1.0, self.count + 1)
        line = np.asarray(float(beam.mass_per_length) * Powers(xi, beam.mass_taper), float)
        slope = Powers(xi[[0, -1]], np.polynomial.polynomial.polyder(np.asarray(beam.mass_taper, float)))
        ends = float(beam.mass_per_length) * slope / (h * self.count)
        masses, firsts, inertias = lumped_inertia(line, (float(ends[0]), float(ends[1])), h)
        turned = np.asarray(float(beam.rotary_inertia) * Powers(xi, beam.rotary_taper), float)
        inertias += h * lumping_weights(self.count) * turned
        for node, mass, first, inertia in zip(self.along[k], masses, firsts, inertias, strict=True):
            own = self.mass[node]
            own[0], own[1], own[2] = own[0] + float(mass), own[1] + axis * float(first), own[2] + float(inertia)

    def built(self) -> Nodes:
        """Return the nodes."""
        columns = list(zip(*self.elements, strict=True)) or [(), (), (), (), (), ()]
        count = len(self.elements)
        elements = Elements(
            np.array(columns[0], int).reshape(count, 2),
            np.array(columns[1], complex),
            np.array(columns[2], float),
            np.array(columns[3], float),
            np.array(columns[4], float).reshape(count, 3, 3),
            np.array(columns[5], float),
        )
        mass, first, inertia = (np.array(values) for values in zip(*self.mass, strict=True))
        masses = NodeMasses(mass.astype(float), first.astype(complex), inertia.astype(float))
        return Nodes(
            np.array(self.link), np.array(self.rest), self.at, tuple(self.along), tuple(self.first), elements, masses
        )


def _finite(of_link: Sequence[Section], section: Section, length: float) -> Section:
    """Replace infinite EA and EI of a beam by large values.

    `of_link` are the sections of all beams of the link, of which at least one has a finite rigidity.
    """
    EA, EI = (
        max((r for own in of_link if isfinite(r := float(getattr(own, name)))), default=0.0) for name in ("EA", "EI")
    )
    EA, EI = RIGID_FACTOR * max(EA, 12 * EI / length**2), RIGID_FACTOR * max(EI, EA * length**2 / 12)
    if isfinite(float(section.EA)):
        EA = float(section.EA)
    if isfinite(float(section.EI)):
        EI = float(section.EI)
    return replace(section, EA=EA, EI=EI)
