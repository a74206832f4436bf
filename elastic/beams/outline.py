"""Cross-sections of any outline, by the finite elements of sectionproperties."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from elastic.beams.cross_sections import Shape

Ring = tuple[tuple[float, float], ...]

ELEMENTS = 400  # triangles of six nodes at least, of which the shear area of a tube's wall is 1e-3 right
CUTS = 200  # across the section, where shear flows
SAME = 1e-6  # distance of corners that are one
THIN = 1e-4  # strip that tells how wide a cut is, by its area
EXTENT = 100.0  # of the section where it is meshed, whose mesher knows no micrometres


class OutlineError(ValueError):
    """An outline that is none: it crosses itself, or its holes leave it."""


@lru_cache(maxsize=64)
def outline(ring: Ring, holes: tuple[Ring, ...] = ()) -> Shape:
    """A cross-section by its corners (y, z) [m], y in the plane of motion, in either sense; and those of its holes.

    Area and second moments are exact, the shear coefficient is that for Poisson's ratio 0. What has no axis of symmetry
    in the plane or across it goes sideways as well, as in `Shape`. The largest shear stress is the largest mean of one
    cut across the plane, by V Q/(I b): less than that beside a notch.

    Raises
    ------
    OutlineError
        Corners that make no section of one piece.
    ModuleNotFoundError
        sectionproperties is not installed.
    """
    from shapely import Polygon, clip_by_rect, remove_repeated_points, transform

    drawn = Polygon([(z, y) for y, z in ring], [[(z, y) for y, z in hole] for hole in holes])
    if not drawn.is_valid or not drawn.area > 0.0:
        raise OutlineError("its sides cross one another, or its holes leave it")
    from sectionproperties.analysis.section import Section
    from sectionproperties.pre.geometry import Geometry

    left, low, right, high = drawn.bounds
    scale = EXTENT / max(right - left, high - low)
    polygon = transform(drawn, lambda places: scale * (places - [left, low]))
    polygon = remove_repeated_points(polygon, SAME)  # of which the mesher dies
    geometry = Geometry(polygon).create_mesh(mesh_sizes=[polygon.area / ELEMENTS])
    section = Section(geometry)
    section.calculate_geometric_properties()
    section.calculate_warping_properties()
    area, (along, across, product) = section.get_area(), section.get_ic()
    z, y = section.get_c()
    share = product / across
    inertia = along - share * product
    corners = np.concatenate([np.asarray(each.coords) for each in _rings(polygon)])
    fibre = np.abs(corners[:, 1] - y - share * (corners[:, 0] - z)).max()
    left, low, right, high = polygon.bounds
    peak = 0.0
    for cut in np.linspace(low, high, CUTS + 1)[1:-1]:
        beyond = clip_by_rect(polygon, left - 1.0, cut, right + 1.0, high + 1.0)
        strip = clip_by_rect(polygon, left - 1.0, cut - THIN / 2, right + 1.0, cut + THIN / 2).area / THIN
        middle = beyond.centroid
        flow = beyond.area * (middle.y - y - share * (middle.x - z))
        peak = max(peak, abs(flow) / strip * area / inertia)
    shear = section.get_as()[1] / area
    return Shape(
        area / scale**2,
        inertia / scale**4,
        fibre / scale,
        peak,
        (shear, 1.0, 1.0),
        (right - left) / scale,
    )


def _rings(polygon: Any) -> list[Any]:
    """Its outer ring, and those of its holes."""
    return [polygon.exterior, *polygon.interiors]
