"""Elastic coordinates of one link clamped at its root, and the displacements of its beams and nodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from elastic.beams.section import Section
from elastic.vibration.beam_matrices import beam_shapes, polynomials_along, stiffness_of
from elastic.vibration.link_matrices import link_coordinates, null_space, of_design
from rigid import Link
from rigid.arrays import Complexes, Reals

SCALES = {"u": 0, "w": 0, "phi": 1, "stretch": 1, "slope": 1, "curvature": 2}


@dataclass(frozen=True, eq=False)
class ClampedLink:
    """Link with n elastic coordinates [m].

    Attributes
    ----------
    fields
        "u", "w", "phi" and derivatives "stretch", "slope", "curvature" in beam axes, shape (beams, points, n).
    nodes
        For each point that a beam reaches: displacement in link axes, complex, and rotation, shape (n,).
    stiffness
        Shape (n, n).
    """

    fields: Mapping[str, Reals]
    nodes: Mapping[str, tuple[Complexes, Reals]]
    stiffness: Reals


def clamped_link(link: Link, sections: Sequence[Section], root: str, inner: int, points: int) -> ClampedLink:
    """Elastic coordinates of a link of one design, with `inner` polynomials per beam, at `points` Gauss points.

    The link is clamped at `root`.
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
