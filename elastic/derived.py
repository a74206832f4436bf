"""Fields as polynomials on the pieces of beams: fields of the solution, and fields that are computed from these.

The bending stress of a symmetric section is -M y/I. The left fibre is on the +y' side of the beam and the right fibre
on the -y' side.
"""

from collections.abc import Callable, Iterable
from functools import lru_cache, partial, reduce

import numpy as np

from elastic.arrays import Coefficients, VectorCoefficients
from elastic.beams.polynomials import added, multiplied, shifted
from elastic.beams.section import Section
from elastic.beams.taper import DEGREE, lowered, piece_quotient
from elastic.fields import FIELDS, field_named
from elastic.links.members import members_of
from elastic.solution import Deflection
from rigid import Reals
from rigid.constants import per_row

_AXIAL = 1.0, "N", "", "area", "EA"
STRESSES: dict[str, tuple[tuple[float, str, str, str, str], ...]] = {
    "axial": (_AXIAL,),
    "left": ((-1.0, "M", "fibre", "inertia", "EI"), _AXIAL),
    "right": ((1.0, "M", "fibre", "inertia", "EI"), _AXIAL),
    "shear": ((1.0, "V", "peak_shear", "area", "EA"),),
}
"""Terms of each stress: sign, section force, property that multiplies it, property that divides it, and a rigidity.

Along a tapered beam, the property that divides the force is proportional to this rigidity.
"""


def coefficients(deflection: Deflection, field: str) -> Coefficients:
    """Return the coefficients of a field in powers of t, which runs from 0 to 1 on each piece.

    Parameters
    ----------
    field
        Key in `FIELDS` of a field that is a polynomial, i.e. a field without `greatest_of` and `root_of`.

    Raises
    ------
    ValueError
        If the field does not exist or is not a polynomial.

    Returns
    -------
    Array of shape (coefficients, pieces, ..., positions) in the unit of the field; the pieces are described in
    `Deflection.division`. Stresses are nan if the dimensions of the section are unknown.
    """
    entry = field_named(field)
    if entry.integral_of:
        return getattr(deflection, entry.key)
    if entry.key not in _DERIVED:
        polynomials = ", ".join(key for key, each in FIELDS.items() if each.integral_of or key in _DERIVED)
        raise ValueError(f'the field "{field}" is not a polynomial: choose from {polynomials}')
    values = _DERIVED[entry.key](deflection)
    return values


def _load(deflection: Deflection, part: Callable[[VectorCoefficients], Coefficients]) -> Coefficients:
    values, division = np.ascontiguousarray(part(deflection.q)), deflection.division
    return values if division.whole else shifted(values[:, division.beam], division.start, division.width)


def _chord(deflection: Deflection) -> Coefficients:
    """Return the deflection from the line through the displaced ends of each member."""
    division, w = deflection.division, deflection.w
    chord: Coefficients = w.copy()
    first = np.searchsorted(division.beam, np.arange(len(deflection.sections)))
    last = np.searchsorted(division.beam, np.arange(len(deflection.sections)), side="right") - 1
    for run in members_of(deflection.motion.mechanism).runs:
        head, tail = run.beams[0], run.beams[-1]
        begin = w[:, last[head]].sum(0) if run.turned[0] else w[0, first[head]]
        end = w[0, first[tail]] if run.turned[-1] else w[:, last[tail]].sum(0)
        for at, beam in enumerate(run.beams):
            here, rise = run.line(at, begin, end)
            for row in range(first[beam], last[beam] + 1):
                chord[0, row] -= here + rise * division.start[row]
                chord[1, row] -= rise * division.width[row]
    return chord


def _stress(deflection: Deflection, key: str) -> Coefficients:
    """Return a stress as the sum of section forces, each multiplied by its factor."""
    parts = (
        _lowered(deflection, multiplied(getattr(deflection, force), factor))
        for force, factor in stress_factors(deflection, key)
    )
    return reduce(added, parts)


def stress_factors(deflection: Deflection, key: str) -> list[tuple[str, Coefficients]]:
    """Return the section forces that cause a stress, each with its stress per unit force, shape (n, pieces, ..., 1)."""
    return [(force, side * _quotient(deflection, *quotient)) for side, force, *quotient in STRESSES[key]]


def sum_of_squares(deflection: Deflection, parts: Iterable[tuple[float, str]]) -> Coefficients:
    """Return the coefficients of a weighted sum of squares of fields, with the same shape as `coefficients`."""
    squares = []
    for weight, key in parts:
        values = coefficients(deflection, key)
        squares.append(multiplied(values, weight * values))
    return _lowered(deflection, reduce(added, squares))


def _lowered(deflection: Deflection, values: Coefficients) -> Coefficients:
    """Lower the degree of a product of polynomials if a beam is tapered; its highest powers contain only round-off."""
    if not any(section.taper for section in deflection.sections):
        return values
    return lowered(values, max(DEGREE, 2 * len(deflection.q)))


@lru_cache(maxsize=64)
def _at_start(sections: tuple[Section, ...], over: str, under: str, ndim: int) -> Reals:
    """Return the quotient of two section properties at the start of each beam, shape (beams, ..., 1)."""
    return per_row(
        [(getattr(each, over) if over else 1.0) / np.asarray(getattr(each, under)) for each in sections], ndim, float
    )


def _quotient(deflection: Deflection, over: str, under: str, rigidity: str) -> Coefficients:
    """Return the quotient of two section properties on each piece, shape (n, pieces, ..., 1).

    Along a tapered beam, the denominator is proportional to `rigidity`.
    """
    ndim, division = len(deflection.motion.columns), deflection.division
    at_start = _at_start(deflection.sections, over, under, ndim)
    values: Coefficients = at_start[None, division.beam]
    for number, section in enumerate(deflection.sections):
        if section.taper:
            rows = division.of_beam(number)
            quotient = piece_quotient(section, over, rigidity)
            if len(values) < len(quotient):
                values = np.concatenate([values, np.zeros((len(quotient) - 1, *values.shape[1:]))])
            values[:, rows] = quotient.reshape(len(quotient), -1, *(1,) * ndim) * at_start[number]
    return values


_DERIVED: dict[str, Callable[[Deflection], Coefficients]] = {
    "q_x": lambda deflection: _load(deflection, np.real),
    "q_y": lambda deflection: _load(deflection, np.imag),
    "chord": _chord,
    **{key: partial(_stress, key=key) for key in STRESSES},
}
