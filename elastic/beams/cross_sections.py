"""Cross-sections of beams: area, second moments and shear coefficients from dimensions, and tapers between two."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.beams.section import Section, Taper

POISSON = 0.3
"""Poisson's ratio of metals, where none is known."""
FITTED = 12  # degree of the polynomials that stand for what is none along a taper
EXACT = 1e-12  # share of the greatest, by which a polynomial of the degree that most shapes have may miss
ROUND_OFF = 1e-14  # share of the greatest below which a coefficient of a taper is none


@dataclass(frozen=True)
class Shape:
    """Properties of a cross-section that is bent by a moment about the axis across the plane of motion.

    Attributes
    ----------
    area, inertia
        [m^2]; second moment of area by which the moment bends it in the plane of motion [m^4]. Where the section has no
        axis of symmetry it goes sideways as well, being free to: then `inertia` is I_z - I_yz^2/I_y, below I_z.
    fibre
        Distance of the outermost fibre from the axis [m]: the largest stress is M fibre/inertia.
    peak_shear
        Largest shear stress over the mean one, V/A: at the axis, by V Q/(I b).
    cowper
        a, b, c of the shear coefficient a (1 + nu)/(b + c nu).
    width, round
        Across the plane of motion [m]; whether the outline is an ellipse of that width and the depth, not a rectangle.
    """

    area: float
    inertia: float
    fibre: float
    peak_shear: float = math.nan
    cowper: tuple[float, float, float] = (math.nan, 1.0, 0.0)
    width: float = math.nan
    round: bool = False

    @property
    def gyration(self) -> float:
        """Radius of gyration [m]."""
        return math.sqrt(self.inertia / self.area)

    def shear_coefficient(self, poisson: float) -> float:
        """k in the shear rigidity k G A of Timoshenko's beam, for Poisson's ratio.

        References
        ----------
        Cowper, The shear coefficient in Timoshenko's beam theory, Journal of Applied Mechanics 33 (1966) 335-340.
        """
        a, b, c = self.cowper
        return a * (1 + poisson) / (b + c * poisson)


def rectangle(depth: float, width: float) -> Shape:
    """A rectangle; the depth [m] lies in the plane of motion.

    Examples
    --------
    >>> rectangle(0.006, 0.01).shear_coefficient(0.0)
    0.8333333333333334
    """
    return Shape(width * depth, width * depth**3 / 12, depth / 2, 1.5, (10.0, 12.0, 11.0), width)


def circle(diameter: float) -> Shape:
    """A full circle [m]."""
    return tube(diameter, 0.0)


def tube(outer: float, inner: float) -> Shape:
    """A round tube between two diameters [m], of any thickness.

    Raises
    ------
    ValueError
        The inner diameter is not below the outer one.
    """
    if not np.all((inner >= 0.0) & (inner < outer)):
        raise ValueError(f"a tube's inner diameter of {inner} m is not between 0 and the outer one of {outer} m")
    area = math.pi * (outer**2 - inner**2) / 4
    square = (inner / outer) ** 2
    both = (1 + square) ** 2
    return Shape(
        area,
        area * (outer**2 + inner**2) / 16,
        outer / 2,
        4 / 3 * (outer**2 + outer * inner + inner**2) / (outer**2 + inner**2),
        (6 * both, 7 * both + 20 * square, 6 * both + 12 * square),
        width=outer,
        round=True,
    )


def i_section(depth: float, width: float, web: float, flange: float, fillet: float = 0.0) -> Shape:
    """An I with its web in the plane of motion [m], as rolled: `fillet` is the radius between web and flange.

    Shear coefficient of thin walls; the largest shear stress is at the axis, by V Q/(I web).

    Raises
    ------
    ValueError
        Flanges and fillets leave no web, or the web no flange.

    References
    ----------
    Cowper (see `Shape.shear_coefficient`), thin-walled I-section.
    """
    inside = depth - 2 * flange
    if not np.all((inside > 2 * fillet) & (width >= web + 2 * fillet)):
        raise ValueError("an I needs flanges and fillets below half of its depth, and a web and fillets in its width")
    round_area, round_inertia, round_place = _corner(fillet)
    place = inside / 2 - round_place
    area = 2 * width * flange + inside * web + 4 * round_area
    inertia = (width * depth**3 - (width - web) * inside**3) / 12 + 4 * (round_inertia + round_area * place**2)
    moment = width * flange * (depth - flange) / 2 + web * inside**2 / 8 + 2 * round_area * place
    height = depth - flange
    m, n = 2 * width * flange / (height * web), width / height
    return Shape(
        area,
        inertia,
        depth / 2,
        moment * area / (inertia * web),
        _thin_walled(m, 30 * n**2 * (m + m**2), 5 * n**2 * (8 * m + 9 * m**2)),
        width,
    )


def box(depth: float, width: float, wall: float, corner: float = 0.0) -> Shape:
    """A hollow rectangle [m], the depth in the plane of motion; `corner` is its outer radius, the inner a wall less.

    Shear coefficient of thin walls; the largest shear stress is at the axis, by V Q/(2 I wall).

    Raises
    ------
    ValueError
        Walls or corners take more than half of a side.

    References
    ----------
    Cowper (see `Shape.shear_coefficient`), thin-walled box section.
    """
    least = np.minimum(depth, width) / 2
    if not np.all((wall < least) & (corner <= least)):
        raise ValueError("a box needs a wall below half of its sides, and corners of no more")
    inner = np.maximum(corner - wall, 0.0)
    parts = [
        (1.0, width * depth, width * depth**3 / 12, width * depth**2 / 8),
        (-1.0, (width - 2 * wall) * (depth - 2 * wall), (width - 2 * wall) * (depth - 2 * wall) ** 3 / 12,
         (width - 2 * wall) * (depth - 2 * wall) ** 2 / 8),
    ]  # fmt: skip
    for sign, radius, half in ((-1.0, corner, depth / 2), (1.0, inner, depth / 2 - wall)):
        area, inertia, place = _corner(radius)
        parts.append((sign, 4 * area, 4 * (inertia + area * (half - place) ** 2), 2 * area * (half - place)))
    area, inertia, moment = (sum(part[0] * part[k] for part in parts) for k in (1, 2, 3))
    height, across = depth - wall, width - wall
    m, n = across / height, across / height
    return Shape(
        area,
        inertia,
        depth / 2,
        moment * area / (inertia * 2 * wall),
        _thin_walled(m, 10 * n**2 * (3 * m + 3 * m**2), 10 * n**2 * m),
        width,
    )


def channel(depth: float, width: float, web: float, flange: float, fillet: float = 0.0) -> Shape:
    """A channel with its web in the plane of motion [m], both flanges to one side; `fillet` as in an I.

    Loaded through its shear centre, or held from twisting: torsion is no part of the plane.

    Raises
    ------
    ValueError
        Flanges and fillets leave no web, or the web no flange.
    """
    inside = depth - 2 * flange
    if not np.all((inside > 2 * fillet) & (width >= web + fillet)):
        raise ValueError("a channel needs flanges and fillets below half of its depth, and a web and a fillet in width")
    round_area, round_inertia, round_place = _corner(fillet)
    place = inside / 2 - round_place
    area = 2 * width * flange + inside * web + 2 * round_area
    inertia = (width * depth**3 - (width - web) * inside**3) / 12 + 2 * (round_inertia + round_area * place**2)
    moment = width * flange * (depth - flange) / 2 + web * inside**2 / 8 + round_area * place
    half, across = (depth - flange) / 2, width - web / 2
    flow = flange * across * half
    walls = [(flange, across, half, half, 0.0)] * 2 + [(web, 2 * half, half, -half, flow)]
    return Shape(area, inertia, depth / 2, moment * area / (inertia * web), _by_energy(walls), width)


def t_section(depth: float, width: float, web: float, flange: float, fillet: float = 0.0) -> Shape:
    """A T with its web in the plane of motion [m]; `fillet` is the radius between web and flange.

    Raises
    ------
    ValueError
        Flange and fillets leave no web, or the web no flange.
    """
    if not np.all((depth > flange + fillet) & (width >= web + 2 * fillet)):
        raise ValueError("a T needs a flange and fillets below its depth, and a web and fillets in its width")
    stem = depth - flange
    round_area, round_inertia, round_place = _corner(fillet)
    parts = [  # area, its place from the outside of the flange, second moment of its own
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
    fibre = np.maximum(depth - axis, axis)
    return Shape(area, inertia, fibre, moment * area / (inertia * web), _by_energy(walls), width)


def angle(depth: float, width: float, wall: float, fillet: float = 0.0, toe: float = 0.0) -> Shape:
    """An angle with one leg of `depth` in the plane of motion, the other across it [m].

    Without an axis of symmetry in either, a moment in the plane bends it sideways too, by -I_yz/I_y as far. It is taken
    to be free to: stiffer by I_z/`inertia` at most where joints hold it in the plane. Loaded through its shear centre.

    Parameters
    ----------
    fillet, toe
        Radii between the legs, and at the inner edges of their ends.

    Raises
    ------
    ValueError
        Wall and radii leave no legs.
    """
    if not np.all((np.minimum(depth, width) > wall + fillet + toe) & (toe <= wall)):
        raise ValueError("an angle needs a wall and radii below its legs, and toes of no more than its wall")
    round_area, round_inertia, round_place = _corner(fillet)
    toe_area, toe_inertia, toe_place = _corner(toe)
    parts = [  # area and place of its centroid (y, z); of its own the integrals of y^2, z^2, y z
        (depth * wall, depth / 2, wall / 2, wall * depth**3 / 12, depth * wall**3 / 12, 0.0),
        (wall * (width - wall), wall / 2, (width + wall) / 2, (width - wall) * wall**3 / 12,
         wall * (width - wall) ** 3 / 12, 0.0),
        (round_area, wall + round_place, wall + round_place, round_inertia, round_inertia,
         _corner_product(fillet)),
        (-toe_area, depth - toe_place, wall - toe_place, -toe_inertia, -toe_inertia, -_corner_product(toe)),
        (-toe_area, wall - toe_place, width - toe_place, -toe_inertia, -toe_inertia, -_corner_product(toe)),
    ]  # fmt: skip
    area = sum(part[0] for part in parts)
    y, z = (sum(part[0] * part[k] for part in parts) / area for k in (1, 2))
    along = sum(part[3] + part[0] * (part[1] - y) ** 2 for part in parts)
    across = sum(part[4] + part[0] * (part[2] - z) ** 2 for part in parts)
    product = sum(part[5] + part[0] * (part[1] - y) * (part[2] - z) for part in parts)
    share = product / across  # below 0: the outermost fibres of the ends are where their circles face along Y
    out_y, out_z = 1.0 / np.hypot(1.0, share), -share / np.hypot(1.0, share)
    toes = [(depth - toe, wall - toe), (wall - toe, width - toe)]
    ends = [(0.0, 0.0), (depth, 0.0), (0.0, width), *((at + toe * out_y, beside + toe * out_z) for at, beside in toes)]
    fibre = np.max([np.abs(at - y - share * (beside - z)) for at, beside in ends], axis=0)
    inertia = along - product**2 / across
    walls = _walls_of_angle(depth - wall / 2, width - wall / 2, wall)
    return Shape(area, inertia, fibre, _peak_of_angle(walls), _by_energy(walls), width)


Wall = tuple[Any, Any, Any, Any, Any]
"""Of thin walls: thickness, length, distances from the axis where it begins and ends, and int Y dA before it begins."""


def _walls_of_angle(leg: Any, other: Any, wall: Any) -> list[Wall]:
    """The legs by their middle lines, from their ends to the corner; Y = y - I_yz/I_y z, as in `angle`."""
    whole = leg + other
    y, z = leg**2 / 2 / whole, other**2 / 2 / whole
    across = other**3 / 3 - whole * z**2
    share = -whole * y * z / across  # the middle lines themselves have no product about their corner
    corner = -y + share * z
    return [(wall, leg, corner + leg, corner, 0.0), (wall, other, corner - share * other, corner, 0.0)]


def _peak_of_angle(walls: Sequence[Wall]) -> Any:
    """Largest shear stress over the mean one of an angle of thin walls: where its longer way crosses the axis."""
    area, inertia = _measured(walls)
    thick, length, first, last, _ = walls[0]
    share = first / (first - last)
    return thick * length * first * share / 2 * area / (inertia * thick)


def _measured(walls: Sequence[Wall]) -> tuple[Any, Any]:
    """Area and second moment of thin walls."""
    area = sum(thick * length for thick, length, _, _, _ in walls)
    inertia = sum(thick * length * (a**2 + a * b + b**2) / 3 for thick, length, a, b, _ in walls)
    return area, inertia


def _by_energy(walls: Sequence[Wall]) -> tuple[Any, float, float]:
    """Shear coefficient of thin walls by the energy of their shear flow, as a, b, c of `Shape.cowper`.

    k = I^2/(A int Q^2/t ds), which is Cowper's without Poisson's ratio: what that changes is left out.
    """
    area, inertia = _measured(walls)
    energy = 0.0
    for thick, length, first, last, flow in walls:
        b, c = thick * length * first, thick * length * (last - first) / 2
        energy = energy + length / thick * (flow**2 + flow * b + (2 * flow * c + b**2) / 3 + b * c / 2 + c**2 / 5)
    return inertia**2 / (area * energy), 1.0, 1.0


def _corner(radius: float) -> tuple[float, float, float]:
    """Between a right angle and the circle that rounds it off: area, second moment, distance from either side."""
    area = (1 - math.pi / 4) * radius**2
    share = (1 / 6) / (1 - math.pi / 4)  # of the radius, from the circle's centre
    inertia = (1 / 3 - math.pi / 16 - (1 - math.pi / 4) * share**2) * radius**4
    return area, inertia, (1 - share) * radius


def _corner_product(radius: float) -> float:
    """Product moment, about its centroid, of the piece between a right angle and its circle."""
    area, _, place = _corner(radius)
    return (19 / 24 - math.pi / 4) * radius**4 - area * place**2


def _thin_walled(m: float, flanges: float, flanges_by_poisson: float) -> tuple[float, float, float]:
    """Cowper's a, b, c of thin walls; m: area of the flanges over that of the webs."""
    return (
        10 * (1 + 3 * m) ** 2,
        12 + 72 * m + 150 * m**2 + 90 * m**3 + flanges,
        11 + 66 * m + 135 * m**2 + 90 * m**3 + flanges_by_poisson,
    )


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
"""Shapes by their names, each a function of its dimensions."""


def section_of(
    shape: Shape,
    E: float,
    poisson: float | None = None,
    yield_stress: float = math.nan,
    taper: Taper | None = None,
    shear: bool = True,
) -> Section:
    """Section of a beam of one shape and material.

    Parameters
    ----------
    E
        Young's modulus [Pa].
    poisson
        Poisson's ratio where it is known: Timoshenko's beam with Cowper's coefficient.
    yield_stress
        [Pa], for the safety factor.
    taper
        From `tapered`.
    shear
        Whether shear counts; where it does not, what it would change can still be told.
    """
    kGA = math.nan
    if poisson is not None:
        kGA = shape.shear_coefficient(poisson) * E / (2 * (1 + poisson)) * shape.area
    return Section(
        EA=E * shape.area,
        EI=E * shape.inertia,
        kGA=kGA if shear and poisson is not None else math.inf,
        taper=taper,
        area=shape.area,
        inertia=shape.inertia,
        fibre=shape.fibre,
        peak_shear=shape.peak_shear,
        yield_stress=yield_stress,
        shear_rigidity=kGA,
        width=shape.width,
        round=shape.round,
    )


def tapered(
    shape: Callable[..., Shape], start: Sequence[float], end: Sequence[float], poisson: float = 0.0
) -> tuple[Taper, tuple[float, ...]]:
    """Taper of a beam with dimensions that change linearly from one end to the other.

    Area and second moment are polynomials of the second and fourth degree then; those of a T or an angle, whose axis
    moves, and the coefficients of shear are none, and interpolated closely.

    Parameters
    ----------
    shape
        Gives the shape of dimensions: `rectangle`, `circle`, `tube` or one's own.
    start, end
        Its dimensions at the two ends.
    poisson
        Poisson's ratio, for the shear coefficient.

    Returns
    -------
    The taper, and the polynomial for `Beam.mass_taper`.

    Examples
    --------
    A rectangle that loses half its depth:

    >>> taper, mass = tapered(rectangle, (0.02, 0.01), (0.01, 0.01))
    >>> [round(value, 12) for value in mass], [round(value, 12) for value in taper.EI]
    ([1.0, -0.5], [1.0, -1.5, 0.75, -0.125])
    """
    angles = math.pi * (np.arange(FITTED + 1) + 0.5) / (FITTED + 1)
    stations = (1 - np.cos(angles)) / 2
    first, last = np.asarray(start, float), np.asarray(end, float)
    shapes = [shape(*((1 - xi) * first + xi * last)) for xi in stations]
    whole = shape(*first)

    def along(degree: int, values: Sequence[float], at_start: float) -> tuple[float, ...]:
        if not np.isfinite(values).all():
            return (1.0,)
        wanted = np.asarray(values) / at_start
        found = np.polynomial.Chebyshev.fit(stations, wanted, degree, domain=[0.0, 1.0])
        if np.abs(found(stations) - wanted).max() > EXACT * np.abs(wanted).max():
            found = np.polynomial.Chebyshev.fit(stations, wanted, FITTED, domain=[0.0, 1.0])
        series = found.convert(kind=np.polynomial.Polynomial, domain=[-1.0, 1.0]).coef
        series = np.where(np.abs(series) > ROUND_OFF * np.abs(series).max(), series, 0.0)
        top = int(np.flatnonzero(series)[-1])
        return tuple(float(value) for value in series[: top + 1] / series[0])

    area = along(2, [each.area for each in shapes], whole.area)
    factors = [each.area * each.shear_coefficient(poisson) for each in shapes]
    taper = Taper(
        EA=area,
        EI=along(4, [each.inertia for each in shapes], whole.inertia),
        kGA=along(FITTED, factors, whole.area * whole.shear_coefficient(poisson)),
        fibre=along(1, [each.fibre for each in shapes], whole.fibre),
        peak_shear=along(FITTED, [each.peak_shear for each in shapes], whole.peak_shear),
        width=along(1, [each.width for each in shapes], whole.width),
    )
    return taper, area
