"""Thin walls and fillets of cross-sections: area, second moment, shear flow."""

import math
from collections.abc import Sequence
from typing import Any

Wall = tuple[Any, Any, Any, Any, Any]
"""Thin wall: thickness, length, distances of its start and end from the axis, and int Y dA before its start."""


def walls_of_angle(leg: Any, other: Any, wall: Any) -> list[Wall]:
    """Centre lines of both legs, from their ends to the corner; Y = y - I_yz/I_y z, see `angle`."""
    whole = leg + other
    y, z = leg**2 / 2 / whole, other**2 / 2 / whole
    across = other**3 / 3 - whole * z**2
    share = -whole * y * z / across  # centre lines have no product moment about the corner
    corner = -y + share * z
    return [(wall, leg, corner + leg, corner, 0.0), (wall, other, corner - share * other, corner, 0.0)]


def peak_of_angle(walls: Sequence[Wall]) -> Any:
    """Largest / mean shear stress of a thin-walled angle: at the axis, on the longer side."""
    area, inertia = _wall_properties(walls)
    thick, length, first, last, _ = walls[0]
    share = first / (first - last)
    return thick * length * first * share / 2 * area / (inertia * thick)


def _wall_properties(walls: Sequence[Wall]) -> tuple[Any, Any]:
    """Area and second moment of thin walls."""
    area = sum(thick * length for thick, length, _, _, _ in walls)
    inertia = sum(thick * length * (a**2 + a * b + b**2) / 3 for thick, length, a, b, _ in walls)
    return area, inertia


def shear_coefficient_by_energy(walls: Sequence[Wall]) -> tuple[Any, float, float]:
    """Shear coefficient of thin walls from the energy of the shear flow, in the form a, b, c of `Shape.cowper`.

    k = I^2/(A int Q^2/t ds): Cowper's coefficient without the effect of Poisson's ratio.
    """
    area, inertia = _wall_properties(walls)
    energy = 0.0
    for thick, length, first, last, flow in walls:
        b, c = thick * length * first, thick * length * (last - first) / 2
        energy = energy + length / thick * (flow**2 + flow * b + (2 * flow * c + b**2) / 3 + b * c / 2 + c**2 / 5)
    return inertia**2 / (area * energy), 1.0, 1.0


def fillet_area(radius: float) -> tuple[float, float, float]:
    """Region between a right angle and its fillet: area, second moment, distance of the centroid from each side."""
    area = (1 - math.pi / 4) * radius**2
    share = (1 / 6) / (1 - math.pi / 4)  # distance of the centroid from the circle's centre, relative to the radius
    inertia = (1 / 3 - math.pi / 16 - (1 - math.pi / 4) * share**2) * radius**4
    return area, inertia, (1 - share) * radius


def fillet_product(radius: float) -> float:
    """Product moment of the area between a right angle and its fillet, about its centroid."""
    area, _, place = fillet_area(radius)
    return (19 / 24 - math.pi / 4) * radius**4 - area * place**2


def cowper_coefficients(m: float, flanges: float, flanges_by_poisson: float) -> tuple[float, float, float]:
    """Cowper's a, b, c of thin walls; m: flange area over web area."""
    return (
        10 * (1 + 3 * m) ** 2,
        12 + 72 * m + 150 * m**2 + 90 * m**3 + flanges,
        11 + 66 * m + 135 * m**2 + 90 * m**3 + flanges_by_poisson,
    )
