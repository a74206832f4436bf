"""Properties of cross-sections from their dimensions: area, second moment of area, shear coefficient."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

POISSON = 0.3
"""Default Poisson's ratio (metals)."""
Wall = tuple[Any, Any, Any, Any, Any]
"""Thin wall: thickness, length, distance Y of each end from the neutral axis, and integral of Y dA up to its start."""


class Shape(Struct, frozen=True):
    """Properties of a cross-section that is bent in the plane of motion.

    Attributes
    ----------
    area, inertia
        Area [m^2], and second moment of area for bending in the plane of motion [m^4]. A section without an axis of
        symmetry also bends sideways. `inertia` assumes that the section is free to bend sideways. It is then I_z -
        I_yz^2/I_y, which is less than I_z.
    fibre
        Distance from the axis to the outermost fibre [m]. The largest bending stress is M fibre/inertia.
    peak_shear
        (Largest shear stress V Q/(I b)) / (mean shear stress V/A). The largest shear stress usually occurs at the axis.
    cowper
        Coefficients a, b, c of the shear coefficient a (1 + nu)/(b + c nu).
    width, round
        Width normal to the plane of motion [m], and whether the outline is an ellipse instead of a rectangle.
    web_end
        Distance from the axis to the end of the web, where it meets a flange [m]; 0 without a web.
    sideways
        Second moment of area for bending normal to the plane of motion [m^4]; nan if unknown. For an angle, it is the
        smallest one of all directions. Fillets are neglected.
    """

    area: float
    inertia: float
    fibre: float
    peak_shear: float = math.nan
    cowper: tuple[float, float, float] = (math.nan, 1.0, 0.0)
    width: float = math.nan
    round: bool = False
    web_end: float = 0.0
    sideways: float = math.nan

    def shear_coefficient(self, poisson: float) -> float:
        """Return Timoshenko's shear coefficient k, by which the shear rigidity is k G A.

        References
        ----------
        Cowper, The shear coefficient in Timoshenko's beam theory, Journal of Applied Mechanics 33 (1966) 335-340.
        """
        a, b, c = self.cowper
        return a * (1 + poisson) / (b + c * poisson)


def rectangle(depth: float, width: float) -> Shape:
    """Return a rectangle with `depth` measured in the plane of motion [m].

    Examples
    --------
    >>> rectangle(0.006, 0.01).shear_coefficient(0.0)
    0.8333333333333334
    """
    sideways = depth * width**3 / 12
    return Shape(width * depth, width * depth**3 / 12, depth / 2, 1.5, (10.0, 12.0, 11.0), width, sideways=sideways)


def circle(diameter: float) -> Shape:
    """Return a solid circle [m]."""
    return tube(diameter, 0.0)


def tube(outer: float, inner: float) -> Shape:
    """Return a round tube with the given outer and inner diameters [m] and any wall thickness.

    Raises
    ------
    ValueError
        If the inner diameter is not smaller than the outer one.
    """
    if not np.all((inner >= 0.0) & (inner < outer)):
        raise ValueError(f"a tube's inner diameter of {inner} m is not between 0 and the outer one of {outer} m")
    area = math.pi * (outer**2 - inner**2) / 4
    square = (inner / outer) ** 2
    both, inertia = (1 + square) ** 2, area * (outer**2 + inner**2) / 16
    return Shape(
        area,
        inertia,
        outer / 2,
        4 / 3 * (outer**2 + outer * inner + inner**2) / (outer**2 + inner**2),
        (6 * both, 7 * both + 20 * square, 6 * both + 12 * square),
        width=outer,
        round=True,
        sideways=inertia,
    )


def i_section(depth: float, width: float, web: float, flange: float, fillet: float = 0.0) -> Shape:
    """Return an I-section from its dimensions [m], with the web in the plane of motion.

    `fillet` is the radius between web and flange. The shear coefficient is that of a thin-walled section. The largest
    shear stress is V Q/(I web), at the axis.

    Raises
    ------
    ValueError
        If the dimensions leave no web or no flange.

    References
    ----------
    Cowper (see `Shape.shear_coefficient`), thin-walled I-section.
    """
    if not np.all((depth - 2 * flange > 2 * fillet) & (width >= web + 2 * fillet)):
        raise ValueError("an I needs flange + fillet < depth/2, and web + 2 fillet <= width")
    area, inertia, moment = _two_flanges(depth, width, web, flange, fillet, 2)
    height = depth - flange
    m, n = 2 * width * flange / (height * web), width / height
    return Shape(
        area,
        inertia,
        depth / 2,
        moment * area / (inertia * web),
        cowper_coefficients(m, 30 * n**2 * (m + m**2), 5 * n**2 * (8 * m + 9 * m**2)),
        width,
        web_end=depth / 2 - flange - fillet,
        sideways=(2 * flange * width**3 + (depth - 2 * flange) * web**3) / 12,
    )


def box(depth: float, width: float, wall: float, corner: float = 0.0) -> Shape:
    """Return a hollow rectangle with `depth` measured in the plane of motion [m].

    `corner` is the outer corner radius; the inner one is `corner` - `wall`. The shear coefficient is that of a
    thin-walled section. The largest shear stress, V Q/(2 I wall), is at the axis.

    Raises
    ------
    ValueError
        If the wall is not thinner than half of each side, or the corner radius is more than half of a side.

    References
    ----------
    Cowper (see `Shape.shear_coefficient`), thin-walled box section.
    """
    least = np.minimum(depth, width) / 2
    if not np.all((wall < least) & (corner <= least)):
        raise ValueError("a box needs wall < half of each side, and corner <= half of each side")
    area, inertia, moment = _hollow(depth, width, wall, corner)
    height, across = depth - wall, width - wall
    m, n = across / height, across / height
    return Shape(
        area,
        inertia,
        depth / 2,
        moment * area / (inertia * 2 * wall),
        cowper_coefficients(m, 10 * n**2 * (3 * m + 3 * m**2), 10 * n**2 * m),
        width,
        web_end=depth / 2 - np.maximum(wall, corner),
        sideways=_hollow(width, depth, wall, corner)[1],
    )


def _hollow(depth: float, width: float, wall: float, corner: float) -> tuple[float, float, float]:
    """Return the area, the second moment of area, and the first moment of one half of a hollow rectangle."""
    inner = np.maximum(corner - wall, 0.0)
    parts = [
        (1.0, width * depth, width * depth**3 / 12, width * depth**2 / 8),
        (-1.0, (width - 2 * wall) * (depth - 2 * wall), (width - 2 * wall) * (depth - 2 * wall) ** 3 / 12,
         (width - 2 * wall) * (depth - 2 * wall) ** 2 / 8),
    ]  # fmt: skip
    for sign, radius, half in ((-1.0, corner, depth / 2), (1.0, inner, depth / 2 - wall)):
        area, inertia, place = fillet_area(radius)
        parts.append((sign, 4 * area, 4 * (inertia + area * (half - place) ** 2), 2 * area * (half - place)))
    area, inertia, moment = (sum(part[0] * part[k] for part in parts) for k in (1, 2, 3))
    return area, inertia, moment


def channel(depth: float, width: float, web: float, flange: float, fillet: float = 0.0) -> Shape:
    """Return a channel from its dimensions [m], with the web in the plane of motion and both flanges on one side.

    `fillet` is the radius between web and flange. Torsion is not modelled: the load must act through the shear centre,
    or the channel must be held against twist.

    Raises
    ------
    ValueError
        If the dimensions leave no web or no flange.
    """
    if not np.all((depth - 2 * flange > 2 * fillet) & (width >= web + fillet)):
        raise ValueError("a channel needs flange + fillet < depth/2, and web + fillet <= width")
    area, inertia, moment = _two_flanges(depth, width, web, flange, fillet, 1)
    half, across = (depth - flange) / 2, width - web / 2
    flow = flange * across * half
    walls = [(flange, across, half, half, 0.0)] * 2 + [(web, 2 * half, half, -half, flow)]
    shear, coefficient = moment * area / (inertia * web), shear_coefficient_by_energy(walls)
    flanges, stem = 2 * flange * width, (depth - 2 * flange) * web
    place = (flanges * width + stem * web) / 2 / (flanges + stem)
    sideways = (flanges * width**2 + stem * web**2) / 3 - (flanges + stem) * place**2
    web_end = half - flange / 2 - fillet
    return Shape(area, inertia, depth / 2, shear, coefficient, width, web_end=web_end, sideways=sideways)


def _two_flanges(
    depth: float, width: float, web: float, flange: float, fillet: float, sides: int
) -> tuple[float, float, float]:
    """Return the properties of a section with a web and two flanges.

    They are the area, the second moment of area, and the first moment of one half of the section. `sides` is the number
    of sides of the web with fillets.
    """
    inside = depth - 2 * flange
    round_area, round_inertia, round_place = fillet_area(fillet)
    place = inside / 2 - round_place
    area = 2 * width * flange + inside * web + 2 * sides * round_area
    fillet_inertia = round_inertia + round_area * place**2
    inertia = (width * depth**3 - (width - web) * inside**3) / 12 + 2 * sides * fillet_inertia
    moment = width * flange * (depth - flange) / 2 + web * inside**2 / 8 + sides * round_area * place
    return area, inertia, moment


def t_section(depth: float, width: float, web: float, flange: float, fillet: float = 0.0) -> Shape:
    """Return a T-section with its web in the plane of motion; `fillet` is the radius between web and flange [m].

    Raises
    ------
    ValueError
        If the dimensions leave no web or no flange.
    """
    if not np.all((depth > flange + fillet) & (width >= web + 2 * fillet)):
        raise ValueError("a T needs flange + fillet < depth, and web + 2 fillet <= width")
    stem = depth - flange
    round_area, round_inertia, round_place = fillet_area(fillet)
    parts = [  # area, distance of centroid from the flange's outer face, own second moment
        (width * flange, flange / 2, width * flange**3 / 12),
        (web * stem, flange + stem / 2, web * stem**3 / 12),
        (2 * round_area, flange + round_place, 2 * round_inertia),
    ]
    area = sum(part for part, _, _ in parts)
    axis = sum(part * place for part, place, _ in parts) / area
    inertia = sum(own + part * (place - axis) ** 2 for part, place, own in parts)
    at = np.maximum(axis, flange)
    moment = web * (depth - at) * ((depth + at) / 2 - axis)
    height = depth - flange / 2
    middle = web * height**2 / 2 / (web * height + flange * width)
    walls = [(web, height, height - middle, -middle, 0.0)] + [(flange, width / 2, -middle, -middle, 0.0)] * 2
    fibre, web_end = np.maximum(depth - axis, axis), np.maximum(axis - flange - fillet, 0.0)
    shear, coefficient = moment * area / (inertia * web), shear_coefficient_by_energy(walls)
    sideways = (flange * width**3 + stem * web**3) / 12
    return Shape(area, inertia, fibre, shear, coefficient, width, web_end=web_end, sideways=sideways)


def angle(depth: float, width: float, wall: float, fillet: float = 0.0, toe: float = 0.0) -> Shape:
    """Return an angle section with the leg `depth` in the plane of motion and the leg `width` normal to it [m].

    Neither leg is an axis of symmetry, so a moment in the plane of motion also bends the section sideways, by -I_yz/I_y
    times the deflection in the plane. The formulas assume that the section is free to bend sideways. If joints prevent
    this, the section is up to I_z/`inertia` times as stiff. The load is assumed to act through the shear centre.

    Parameters
    ----------
    fillet, toe
        Radius between the legs, and radius of the inner edges at the ends of the legs.

    Raises
    ------
    ValueError
        If the wall and the radii leave no straight part of a leg, or `toe` is larger than the wall.
    """
    if not np.all((np.minimum(depth, width) > wall + fillet + toe) & (toe <= wall)):
        raise ValueError("an angle needs wall + fillet + toe < each leg, and toe <= wall")
    round_area, round_inertia, round_place = fillet_area(fillet)
    toe_area, toe_inertia, toe_place = fillet_area(toe)
    parts = [  # area, centroid (y, z), own integrals of y^2, z^2, y z
        (depth * wall, depth / 2, wall / 2, wall * depth**3 / 12, depth * wall**3 / 12, 0.0),
        (wall * (width - wall), wall / 2, (width + wall) / 2, (width - wall) * wall**3 / 12,
         wall * (width - wall) ** 3 / 12, 0.0),
        (round_area, wall + round_place, wall + round_place, round_inertia, round_inertia,
         fillet_product(fillet)),
        (-toe_area, depth - toe_place, wall - toe_place, -toe_inertia, -toe_inertia, -fillet_product(toe)),
        (-toe_area, wall - toe_place, width - toe_place, -toe_inertia, -toe_inertia, -fillet_product(toe)),
    ]  # fmt: skip
    area = sum(part[0] for part in parts)
    y, z = (sum(part[0] * part[k] for part in parts) / area for k in (1, 2))
    along = sum(part[3] + part[0] * (part[1] - y) ** 2 for part in parts)
    across = sum(part[4] + part[0] * (part[2] - z) ** 2 for part in parts)
    product = sum(part[5] + part[0] * (part[1] - y) * (part[2] - z) for part in parts)
    share = product / across  # I_yz/I_y < 0; a toe's farthest point has its normal along the gradient of y - share z
    out_y, out_z = 1.0 / np.hypot(1.0, share), -share / np.hypot(1.0, share)
    toes = [(depth - toe, wall - toe), (wall - toe, width - toe)]
    ends = [(0.0, 0.0), (depth, 0.0), (0.0, width), *((at + toe * out_y, beside + toe * out_z) for at, beside in toes)]
    fibre = np.max([np.abs(at - y - share * (beside - z)) for at, beside in ends], axis=0)
    inertia = along - product**2 / across
    walls = walls_of_angle(depth - wall / 2, width - wall / 2, wall)
    sideways = (along + across) / 2 - np.hypot((along - across) / 2, product)
    coefficient = shear_coefficient_by_energy(walls)
    return Shape(area, inertia, fibre, peak_of_angle(walls), coefficient, width, sideways=sideways)


SHAPES: Mapping[str, Callable[..., Shape]] = {
    "rectangle": rectangle,
    "circle": circle,
    "tube": tube,
    "box": box,
    "I": i_section,
    "T": t_section,
    "channel": channel,
    "angle": angle,
}
"""Functions that compute a `Shape` from its dimensions, by name of the shape."""


def walls_of_angle(leg: Any, other: Any, wall: Any) -> list[Wall]:
    """Return the legs of an angle as thin walls, from the ends to the corner, with Y = y - I_yz/I_y z (see `angle`)."""
    whole = leg + other
    y, z = leg**2 / 2 / whole, other**2 / 2 / whole
    across = other**3 / 3 - whole * z**2
    share = -whole * y * z / across  # centre lines have no product moment about the corner
    corner = -y + share * z
    return [(wall, leg, corner + leg, corner, 0.0), (wall, other, corner - share * other, corner, 0.0)]


def peak_of_angle(walls: Sequence[Wall]) -> Any:
    """Return the largest shear stress of a thin-walled angle section, relative to the mean shear stress V/A.

    The largest shear stress occurs where the neutral axis crosses the first leg.
    """
    area, inertia = _wall_properties(walls)
    thick, length, first, last, _ = walls[0]
    share = first / (first - last)
    return thick * length * first * share / 2 * area / (inertia * thick)


def _wall_properties(walls: Sequence[Wall]) -> tuple[Any, Any]:
    """Return the area and second moment of area of thin walls."""
    area = sum(thick * length for thick, length, _, _, _ in walls)
    inertia = sum(thick * length * (a**2 + a * b + b**2) / 3 for thick, length, a, b, _ in walls)
    return area, inertia


def shear_coefficient_by_energy(walls: Sequence[Wall]) -> tuple[Any, float, float]:
    """Return the shear coefficient of thin walls from the energy of the shear flow, as a, b, c of `Shape.cowper`.

    The formula is k = I^2/(A int Q^2/t ds). It equals Cowper's formula for a Poisson's ratio of 0.
    """
    area, inertia = _wall_properties(walls)
    energy = 0.0
    for thick, length, first, last, flow in walls:
        b, c = thick * length * first, thick * length * (last - first) / 2
        energy = energy + length / thick * (flow**2 + flow * b + (2 * flow * c + b**2) / 3 + b * c / 2 + c**2 / 5)
    return inertia**2 / (area * energy), 1.0, 1.0


def fillet_area(radius: float) -> tuple[float, float, float]:
    """Return the properties of the region between two perpendicular sides and their fillet.

    They are the area, the second moment of area about the centroid, and the distance of the centroid from each side.
    """
    area = (1 - math.pi / 4) * radius**2
    share = (1 / 6) / (1 - math.pi / 4)  # distance of the centroid from the circle's centre, relative to the radius
    inertia = (1 / 3 - math.pi / 16 - (1 - math.pi / 4) * share**2) * radius**4
    return area, inertia, (1 - share) * radius


def fillet_product(radius: float) -> float:
    """Return the product moment of the region between two perpendicular sides and their fillet, about its centroid."""
    area, _, place = fillet_area(radius)
    return (19 / 24 - math.pi / 4) * radius**4 - area * place**2


def cowper_coefficients(m: float, flanges: float, flanges_by_poisson: float) -> tuple[float, float, float]:
    """Return Cowper's coefficients a, b, c of a thin-walled section; m is flange area / web area."""
    return (
        10 * (1 + 3 * m) ** 2,
        12 + 72 * m + 150 * m**2 + 90 * m**3 + flanges,
        11 + 66 * m + 135 * m**2 + 90 * m**3 + flanges_by_poisson,
    )
