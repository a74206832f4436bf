"""Sections of a single shape and material, uniform or tapered."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from elastic.beams.cross_sections import Shape
from elastic.beams.section import Section, Taper

FIT_DEGREE = 12  # degree of the polynomial fitted to a property that no polynomial of low degree describes
MAX_FIT_ERROR = 1e-12  # largest accepted error of a polynomial of low degree, relative to its largest value
MIN_COEFFICIENT = 1e-14  # taper coefficients smaller than this are round-off; relative to the largest one


def section_of(
    shape: Shape,
    E: float,
    poisson: float | None = None,
    yield_stress: float = math.nan,
    taper: Taper | None = None,
    shear: bool = True,
) -> Section:
    """Return the section of a beam with a given shape and material.

    Parameters
    ----------
    E
        Young's modulus [Pa].
    poisson
        Poisson's ratio. If given, the beam is a Timoshenko beam with Cowper's shear coefficient.
    yield_stress
        Yield stress [Pa], used for the safety factor.
    taper
        See `tapered`.
    shear
        If False, shear deformation is neglected. The shear rigidity is still stored, to estimate the neglected
        deformation.
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
        web_end=shape.web_end if taper is None else 0.0,
        sideways=shape.sideways,
    )


def tapered(
    shape: Callable[..., Shape], start: Sequence[float], end: Sequence[float], poisson: float = 0.0
) -> tuple[Taper, tuple[float, ...]]:
    """Return the taper of a beam with linearly varying dimensions.

    The area is then a polynomial of degree 2. The second moment of area is a polynomial of degree 4, except for a
    T-section or an angle section: the position of the centroid is no polynomial in xi. If a polynomial of this degree
    has a relative error above `MAX_FIT_ERROR`, a polynomial of degree `FIT_DEGREE` is fitted instead.

    Parameters
    ----------
    shape
        Function that computes the shape, such as `rectangle`, `circle` or `tube`.
    start, end
        Arguments of `shape` at the two ends of the beam.
    poisson
        Poisson's ratio, used for the shear coefficient.

    Returns
    -------
    The taper, and the polynomial for `Beam.mass_taper`.

    Examples
    --------
    The depth of a rectangle is halved along the beam:

    >>> from elastic import rectangle
    >>> taper, mass = tapered(rectangle, (0.02, 0.01), (0.01, 0.01))
    >>> [round(value, 12) for value in mass], [round(value, 12) for value in taper.EI]
    ([1.0, -0.5], [1.0, -1.5, 0.75, -0.125])
    """
    angles = math.pi * (np.arange(FIT_DEGREE + 1) + 0.5) / (FIT_DEGREE + 1)
    stations = (1 - np.cos(angles)) / 2
    first, last = np.asarray(start, float), np.asarray(end, float)
    shapes = [shape(*((1 - xi) * first + xi * last)) for xi in stations]
    whole = shape(*first)

    def along(degree: int, values: Sequence[float], at_start: float) -> tuple[float, ...]:
        if not np.isfinite(values).all():
            return (1.0,)
        wanted = np.asarray(values) / at_start
        found = np.polynomial.Chebyshev.fit(stations, wanted, degree, domain=[0.0, 1.0])
        if np.abs(found(stations) - wanted).max() > MAX_FIT_ERROR * np.abs(wanted).max():
            found = np.polynomial.Chebyshev.fit(stations, wanted, FIT_DEGREE, domain=[0.0, 1.0])
        series = found.convert(kind=np.polynomial.Polynomial, domain=[-1.0, 1.0]).coef
        series = np.where(np.abs(series) > MIN_COEFFICIENT * np.abs(series).max(), series, 0.0)
        top = int(np.flatnonzero(series)[-1])
        return tuple(float(value) for value in series[: top + 1] / series[0])

    area = along(2, [each.area for each in shapes], whole.area)
    factors = [each.area * each.shear_coefficient(poisson) for each in shapes]
    taper = Taper(
        EA=area,
        EI=along(4, [each.inertia for each in shapes], whole.inertia),
        kGA=along(FIT_DEGREE, factors, whole.area * whole.shear_coefficient(poisson)),
        fibre=along(1, [each.fibre for each in shapes], whole.fibre),
        peak_shear=along(FIT_DEGREE, [each.peak_shear for each in shapes], whole.peak_shear),
        width=along(1, [each.width for each in shapes], whole.width),
    )
    return taper, area
