"""Properties of cross-sections with any outline, by finite elements (package sectionproperties)."""

from functools import lru_cache

import numpy as np

from elastic.beams.cross_sections import Shape

Ring = tuple[tuple[float, float], ...]

MIN_ELEMENTS = 400  # least number of six-node triangles; with these, the shear area of a tube has an error of 1e-3
CUTS = 200  # the shear stress is evaluated on this many straight cuts
MIN_CORNER_DISTANCE = 1e-6  # corners closer than this are merged, because the mesher crashes on them
STRIP_WIDTH = 1e-4  # width of the strip used to measure the length of a cut
MESHED_SIZE = 100.0  # the section is scaled to this size, because the mesher fails for dimensions of micrometres


class CrossSectionError(ValueError):
    """Raised if an outline crosses itself, or if a hole is not inside the outline."""


@lru_cache(maxsize=64)
def outline(ring: Ring, holes: tuple[Ring, ...] = ()) -> Shape:
    """Compute the properties of a cross-section from its corners (y, z) [m], with y in the plane of motion.

    The corners may be given clockwise or counter-clockwise. Area and second moments are exact. The shear coefficient is
    computed for a Poisson's ratio of 0. A section without an axis of symmetry also bends sideways, see `Shape`. The
    largest shear stress is the largest mean stress V Q/(I b) over a straight cut normal to the plane of motion. The
    local stress at a notch is higher.

    Raises
    ------
    CrossSectionError
        If the corners do not form one connected section.
    ModuleNotFoundError
        If sectionproperties is not installed.
    """
    from shapely import Polygon, clip_by_rect, remove_repeated_points, transform

    drawn = Polygon([(z, y) for y, z in ring], [[(z, y) for y, z in hole] for hole in holes])
    if not drawn.is_valid or not drawn.area > 0.0:
        raise CrossSectionError("its sides cross each other, or a hole is not inside it")
    from sectionproperties.analysis.section import Section
    from sectionproperties.pre.geometry import Geometry

    left, low, right, high = drawn.bounds
    scale = MESHED_SIZE / max(right - left, high - low)
    polygon = transform(drawn, lambda places: scale * (places - [left, low]))
    polygon = remove_repeated_points(polygon, MIN_CORNER_DISTANCE)
    geometry = Geometry(polygon).create_mesh(mesh_sizes=[polygon.area / MIN_ELEMENTS])
    section = Section(geometry)
    section.calculate_geometric_properties()
    section.calculate_warping_properties()
    area, (along, across, product) = section.get_area(), section.get_ic()
    z, y = section.get_c()
    share = product / across
    inertia = along - share * product
    corners = np.concatenate([np.asarray(each.coords) for each in [polygon.exterior, *polygon.interiors]])
    fibre = np.abs(corners[:, 1] - y - share * (corners[:, 0] - z)).max()
    left, low, right, high = polygon.bounds
    peak = 0.0
    for cut in np.linspace(low, high, CUTS + 1)[1:-1]:
        beyond = clip_by_rect(polygon, left - 1.0, cut, right + 1.0, high + 1.0)
        strip = (
            clip_by_rect(polygon, left - 1.0, cut - STRIP_WIDTH / 2, right + 1.0, cut + STRIP_WIDTH / 2).area
            / STRIP_WIDTH
        )
        middle = beyond.centroid
        flow = beyond.area * (middle.y - y - share * (middle.x - z))
        peak = max(peak, abs(flow) / strip * area / inertia)
    shear = section.get_as()[1] / area
    return Shape(area / scale**2, inertia / scale**4, fibre / scale, peak, (shear, 1.0, 1.0), (right - left) / scale)
