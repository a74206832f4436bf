"""Elastic coordinates of a mechanism: shapes of clamped links, and openings of compliant joints.

The coordinates are independent, and their stiffness is the same at all positions. The rigid-body motion that closes the
joints depends on the position, see `displacements.py`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from elastic.beams.polynomials import gauss_points
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import root_of, trees_of
from elastic.vibration.beam_matrices import beam_shapes, masses_along, polynomials_along, stiffness_of
from elastic.vibration.link_matrices import link_coordinates, null_space, of_design
from rigid import Link, Mechanism, Motion, structure
from rigid.arrays import Columns, Complexes, Reals

SCALES = {"u": 0, "w": 0, "phi": 1, "stretch": 1, "slope": 1, "curvature": 2}


@dataclass(frozen=True, eq=False)
class SoftFreedom:
    """Opening of a compliant joint; `kind` is "x" or "y" (pin), "across" or "along" (slider), or "turn"."""

    joint: int
    kind: str


@dataclass(frozen=True, eq=False)
class ElasticStructure:
    """Model of one design with n elastic coordinates. Beams are in the order of `Mechanism.beams`.

    Attributes
    ----------
    xi
        Gauss points, shape (points,).
    length
        Lengths of the beams [m], shape (beams,).
    weights
        Integration weights of the points [m], shape (beams, points).
    mass, rotary
        Mass [kg] and moment of inertia [kg m^2] of the points, shape (beams, points).
    fields
        "u", "w", "phi", "stretch", "slope" and "curvature" per unit coordinate, in beam axes and with links clamped at
        their roots, shape (beams, points, n).
    nodes
        Displacement in link axes, complex, and rotation per unit coordinate, shape (n,), by link index and point name.
    soft
        Openings of compliant joints, which are the last coordinates.
    stiffness
        Stiffness matrix of the coordinates, shape (n, n).
    """

    mechanism: Mechanism
    sections: tuple[Section, ...]
    xi: Reals
    length: Reals
    weights: Reals
    mass: Reals
    rotary: Reals
    fields: Mapping[str, Reals]
    nodes: Mapping[tuple[int, str], tuple[Complexes, Reals]]
    soft: tuple[SoftFreedom, ...]
    stiffness: Reals


def elastic_structure(
    mechanism: Mechanism, sections: Sequence[Section], joints: Mapping[str, JointCompliance], inner: int
) -> ElasticStructure:
    """Set up the elastic coordinates of a single design, with `inner` polynomials along each beam."""
    return _structure(mechanism, tuple(sections), tuple(joints.items()), inner)


@lru_cache(maxsize=4)
def _structure(
    mechanism: Mechanism, sections: tuple[Section, ...], soft: tuple[tuple[str, JointCompliance], ...], inner: int
) -> ElasticStructure:
    most = max((count for link in mechanism.links for count in polynomials_along(_lengths(link), inner)), default=0)
    points = most + 4 + (_tapers(mechanism, sections) + 1) // 2
    trees = trees_of(mechanism).trees
    links, beam = {}, 0
    for at, tree in trees.items():
        link = mechanism.links[at]
        own = sections[beam : beam + len(link.beams)]
        links[at] = clamped_link(link, own, root_of(tree), inner, points)
        beam += len(link.beams)
    freedoms, softness = _soft_freedoms(mechanism, dict(soft))
    sizes = [len(link.stiffness) for link in links.values()]
    size = sum(sizes) + len(freedoms)
    stiffness = np.zeros((size, size))
    stiffness[range(sum(sizes), size), range(sum(sizes), size)] = 1.0 / np.array(softness)
    fields = {name: np.zeros((len(sections), points, size)) for name in SCALES}
    nodes, first, beam = {}, 0, 0
    for at, clamped in links.items():
        columns = slice(first, first + len(clamped.stiffness))
        rows = slice(beam, beam + len(clamped.fields["u"]))
        first, beam = columns.stop, rows.stop
        stiffness[columns, columns] = clamped.stiffness
        for name, values in clamped.fields.items():
            fields[name][rows, :, columns] = values
        for name, (move, turn) in clamped.nodes.items():
            nodes[at, name] = np.zeros(size, complex), np.zeros(size)
            nodes[at, name][0][columns], nodes[at, name][1][columns] = move, turn
    xi, length, weights, mass, rotary = _masses(mechanism, points)
    return ElasticStructure(mechanism, sections, xi, length, weights, mass, rotary, fields, nodes, freedoms, stiffness)


def _lengths(link: Link) -> list[float]:
    """Return the lengths of the beams of one design [m]."""
    return [float(np.abs(np.ravel(link.points[beam.end] - link.points[beam.start])[0])) for beam in link.beams]


def _tapers(mechanism: Mechanism, sections: Sequence[Section]) -> int:
    """Return the highest degree of the tapers of masses and rigidities."""
    degrees = [max(len(beam.mass_taper), len(beam.rotary_taper)) - 1 for _, beam in mechanism.beams]
    degrees += [max(len(part.taper.EI), len(part.taper.EA), len(part.taper.kGA)) - 1 for part in sections if part.taper]
    return max(degrees, default=0)


def _masses(mechanism: Mechanism, points: int) -> tuple[Any, Any, Any, Any, Any]:
    """Return Gauss points, lengths, weights, masses and moments of inertia of all beams."""
    xi, weights = gauss_points(points)
    lengths, masses, rotary = (
        np.zeros(len(mechanism.beams)),
        np.zeros((len(mechanism.beams), points)),
        np.zeros((len(mechanism.beams), points)),
    )
    for number, (at, beam) in enumerate(mechanism.beams):
        ends = mechanism.links[at].points
        lengths[number] = np.ravel(np.abs(ends[beam.end] - ends[beam.start]))[0]
        masses[number], rotary[number] = masses_along(beam, xi)
    integral = lengths[:, None] * weights
    return xi, lengths, integral, masses * integral, rotary * integral


def _soft_freedoms(
    mechanism: Mechanism, joints: Mapping[str, JointCompliance]
) -> tuple[tuple[SoftFreedom, ...], list[float]]:
    """Return the openings of compliant joints, and their compliances."""
    freedoms, softness = [], []
    for number, joint in enumerate(structure(mechanism).joints):
        compliance = joints.get(joint.name)
        if compliance is None:
            continue
        kinds = ["x", "y"] if joint.turns else ["across", "along"] if joint.moved else ["across"]
        for kind in kinds if compliance.translation else ():
            freedoms.append(SoftFreedom(number, kind))
            softness.append(compliance.translation)
        if compliance.rotation and (not joint.turns or joint.moved):
            freedoms.append(SoftFreedom(number, "turn"))
            softness.append(compliance.rotation)
    return tuple(freedoms), softness


def way_of(freedom: SoftFreedom, motion: Motion) -> Columns:
    """Return the unit vector along which a compliant joint opens, complex."""
    if freedom.kind in ("x", "y"):
        return 1.0 if freedom.kind == "x" else 1j
    along = motion.places[freedom.joint].along
    return along if freedom.kind == "along" else 1j * along


@dataclass(frozen=True, eq=False)
class ClampedLink:
    """Clamped link with n elastic coordinates [m].

    Attributes
    ----------
    fields
        "u", "w", "phi" and their derivatives "stretch", "slope", "curvature" in beam axes, shape (beams, points, n).
    nodes
        Displacement in link axes, complex, and rotation of each point that a beam reaches, shape (n,).
    stiffness
        Stiffness matrix of the coordinates, shape (n, n).
    """

    fields: Mapping[str, Reals]
    nodes: Mapping[str, tuple[Complexes, Reals]]
    stiffness: Reals


def clamped_link(link: Link, sections: Sequence[Section], root: str, inner: int, points: int) -> ClampedLink:
    """Set up the elastic coordinates of a link of one design that is clamped at `root`.

    There are `inner` polynomials per beam, which are evaluated at `points` Gauss points.
    """
    scale = max(float(np.abs(np.ravel(place)[0])) for place in link.points.values()) or 1.0
    scaled, parts = of_design(link, sections, scale, 0)
    lengths = [abs(complex(scaled.points[beam.end]) - complex(scaled.points[beam.start])) for beam in scaled.beams]
    counts = polynomials_along(lengths, inner)
    shapes = [beam_shapes(*each, points) for each in zip(lengths, parts, counts, strict=True)]
    whole = link_coordinates(scaled, parts, [shape.u.shape[1] for shape in shapes])
    clamped = null_space(whole.place(root))
    rows = [coordinates @ whole.free @ clamped for coordinates in whole.beams]
    stiffness = np.zeros((clamped.shape[1],) * 2)
    for shape, length, part, row in zip(shapes, lengths, parts, rows, strict=True):
        stiffness += row.T @ stiffness_of(shape, length, part) @ row
    fields = {
        name: np.array([getattr(shape, name) @ row for shape, row in zip(shapes, rows, strict=True)]) / scale**power
        for name, power in SCALES.items()
    }
    nodes = {}
    for name in whole.names:
        x, y, turned = whole.place(name) @ clamped
        nodes[name] = (x + 1j * y, turned / scale)
    return ClampedLink(fields, nodes, stiffness)
