"""Elastic coordinates of a mechanism: amplitudes of shapes of clamped links, and openings of compliant joints.

Each coordinate can be chosen independently of the others. The stiffness matrix does not depend on the position of the
mechanism. The rigid-body displacements of the links that close the joints depend on it, see `displacements.py`.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.beams.polynomials import gauss_points
from elastic.beams.section import JointCompliance, Section
from elastic.links.beam_trees import root_of, trees_of
from elastic.vibration.beam_matrices import beam_shapes, masses_along, polynomials_along, stiffness_of
from elastic.vibration.link_matrices import link_coordinates, null_space, of_design
from rigid import Link, Mechanism, Motion, structure
from rigid.arrays import Columns, Complexes, Reals

LENGTH_EXPONENTS = {"u": 0, "w": 0, "phi": 1, "stretch": 1, "slope": 1, "curvature": 2}


class JointOpening(Struct, frozen=True, eq=False):
    """Relative displacement or rotation that a compliant joint permits.

    `kind` is "x" or "y" for a pin, "across" or "along" for other joints, and "turn" for a relative rotation.
    """

    joint: int
    kind: str


class ElasticStructure(Struct, frozen=True, eq=False):
    """Beams and compliant joints of one design, with n elastic coordinates.

    Beams are in the order of `Mechanism.beams`.

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
        The fields "u", "w", "phi", "stretch", "slope" and "curvature" in beam axes, per unit of each coordinate, for
        links that are clamped at their roots; shape (beams, points, n).
    point_shapes
        For each point, by link index and point name: its displacement in link axes, complex, and the rotation there,
        per unit of each coordinate, each of shape (n,).
    joint_openings
        Openings of compliant joints. They are the last of the coordinates, in the same order.
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
    point_shapes: Mapping[tuple[int, str], tuple[Complexes, Reals]]
    joint_openings: tuple[JointOpening, ...]
    stiffness: Reals


def elastic_structure(
    mechanism: Mechanism, sections: Sequence[Section], joints: Mapping[str, JointCompliance], polynomials_per_beam: int
) -> ElasticStructure:
    """Set up the elastic coordinates of a single design, with `polynomials_per_beam` polynomials along each beam."""
    return _structure(mechanism, tuple(sections), tuple(joints.items()), polynomials_per_beam)


@lru_cache(maxsize=4)
def _structure(
    mechanism: Mechanism,
    sections: tuple[Section, ...],
    joints: tuple[tuple[str, JointCompliance], ...],
    polynomials_per_beam: int,
) -> ElasticStructure:
    most = max(
        (count for link in mechanism.links for count in polynomials_along(_lengths(link), polynomials_per_beam)),
        default=0,
    )
    points = most + 4 + (_tapers(mechanism, sections) + 1) // 2
    trees = trees_of(mechanism).trees
    links, beam = {}, 0
    for at, tree in trees.items():
        link = mechanism.links[at]
        link_sections = sections[beam : beam + len(link.beams)]
        links[at] = clamped_link(link, link_sections, root_of(tree), polynomials_per_beam, points)
        beam += len(link.beams)
    openings, compliances = _joint_openings(mechanism, dict(joints))
    sizes = [len(link.stiffness) for link in links.values()]
    size = sum(sizes) + len(openings)
    stiffness = np.zeros((size, size))
    stiffness[range(sum(sizes), size), range(sum(sizes), size)] = 1.0 / np.array(compliances)
    fields = {name: np.zeros((len(sections), points, size)) for name in LENGTH_EXPONENTS}
    point_shapes, first, beam = {}, 0, 0
    for at, clamped in links.items():
        columns = slice(first, first + len(clamped.stiffness))
        rows = slice(beam, beam + len(clamped.fields["u"]))
        first, beam = columns.stop, rows.stop
        stiffness[columns, columns] = clamped.stiffness
        for name, values in clamped.fields.items():
            fields[name][rows, :, columns] = values
        for name, (move, turn) in clamped.point_shapes.items():
            point_shapes[at, name] = np.zeros(size, complex), np.zeros(size)
            point_shapes[at, name][0][columns], point_shapes[at, name][1][columns] = move, turn
    xi, length, weights, mass, rotary = _masses(mechanism, points)
    return ElasticStructure(
        mechanism, sections, xi, length, weights, mass, rotary, fields, point_shapes, openings, stiffness
    )


def _lengths(link: Link) -> list[float]:
    """Return the lengths of the beams of a link [m]."""
    return [float(np.abs(np.ravel(link.points[beam.end] - link.points[beam.start])[0])) for beam in link.beams]


def _tapers(mechanism: Mechanism, sections: Sequence[Section]) -> int:
    """Return the highest degree of the polynomials that describe tapered masses, moments of inertia and rigidities."""
    degrees = [max(len(beam.mass_taper), len(beam.rotary_taper)) - 1 for _, beam in mechanism.beams]
    degrees += [max(len(part.taper.EI), len(part.taper.EA), len(part.taper.kGA)) - 1 for part in sections if part.taper]
    return max(degrees, default=0)


def _masses(mechanism: Mechanism, points: int) -> tuple[Any, Any, Any, Any, Any]:
    """Return `xi`, `length`, `weights`, `mass` and `rotary` of `ElasticStructure`."""
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


def _joint_openings(
    mechanism: Mechanism, joints: Mapping[str, JointCompliance]
) -> tuple[tuple[JointOpening, ...], list[float]]:
    """Return the openings that compliant joints permit, and the compliance of each opening."""
    openings, compliances = [], []
    for number, joint in enumerate(structure(mechanism).joints):
        compliance = joints.get(joint.name)
        if compliance is None:
            continue
        kinds = ["x", "y"] if joint.turns else ["across", "along"] if joint.moved else ["across"]
        for kind in kinds if compliance.translation else ():
            openings.append(JointOpening(number, kind))
            compliances.append(compliance.translation)
        if compliance.rotation and (not joint.turns or joint.moved):
            openings.append(JointOpening(number, "turn"))
            compliances.append(compliance.rotation)
    return tuple(openings), compliances


def opening_direction(opening: JointOpening, motion: Motion) -> Columns:
    """Return the unit vector in ground axes along which a compliant joint opens, complex."""
    if opening.kind in ("x", "y"):
        return 1.0 if opening.kind == "x" else 1j
    along = motion.places[opening.joint].along
    return along if opening.kind == "along" else 1j * along


class ClampedLink(Struct, frozen=True, eq=False):
    """Link that is clamped at a point, with n elastic coordinates [m].

    Attributes
    ----------
    fields
        The fields "u", "w" and "phi" in beam axes, and their derivatives "stretch", "slope" and "curvature", per unit
        of each coordinate, shape (beams, points, n).
    point_shapes
        For each point that a beam reaches: its displacement in link axes, complex, and the rotation there, per unit of
        each coordinate, each of shape (n,).
    stiffness
        Stiffness matrix of the coordinates, shape (n, n).
    """

    fields: Mapping[str, Reals]
    point_shapes: Mapping[str, tuple[Complexes, Reals]]
    stiffness: Reals


def clamped_link(
    link: Link, sections: Sequence[Section], root: str, polynomials_per_beam: int, points: int
) -> ClampedLink:
    """Set up the elastic coordinates of a link of one design that is clamped at `root`.

    Each beam has `polynomials_per_beam` polynomials, which are evaluated at `points` Gauss points.
    """
    scale = max(float(np.abs(np.ravel(place)[0])) for place in link.points.values()) or 1.0
    scaled, parts = of_design(link, sections, scale, 0)
    lengths = [abs(complex(scaled.points[beam.end]) - complex(scaled.points[beam.start])) for beam in scaled.beams]
    counts = polynomials_along(lengths, polynomials_per_beam)
    shapes = [beam_shapes(*each, points) for each in zip(lengths, parts, counts, strict=True)]
    unclamped = link_coordinates(scaled, parts, [shape.u.shape[1] for shape in shapes])
    clamped = null_space(unclamped.place(root))
    rows = [coordinates @ unclamped.free @ clamped for coordinates in unclamped.beams]
    stiffness = np.zeros((clamped.shape[1],) * 2)
    for shape, length, part, row in zip(shapes, lengths, parts, rows, strict=True):
        stiffness += row.T @ stiffness_of(shape, length, part) @ row
    fields = {
        name: np.array([getattr(shape, name) @ row for shape, row in zip(shapes, rows, strict=True)]) / scale**power
        for name, power in LENGTH_EXPONENTS.items()
    }
    point_shapes = {}
    for name in unclamped.names:
        x, y, turned = unclamped.place(name) @ clamped
        point_shapes[name] = (x + 1j * y, turned / scale)
    return ClampedLink(fields, point_shapes, stiffness)
