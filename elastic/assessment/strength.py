"""Stresses of the beams: where and when they are largest, how far they swing, and how far they are from yield.

The bending stress is that of a symmetric section, -M y/I; the left fibre is on the side of y', the right one opposite.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from elastic.beams.pieces import Pieces, in_pieces, interpolated, nodes_of, pieces
from elastic.beams.polynomials import turning_points
from elastic.deflection import Deflection
from elastic.extremes import Extreme, extremes, greatest, merged
from elastic.sampling import sample
from rigid import Reals
from rigid.constants import per_row

STRESSES = ("axial", "left", "right", "shear", "mises")
GREATEST = ("normal", "shear", "mises")


def stress(deflection: Deflection, kind: str, stations: Any) -> Any:
    """A stress at stations along every beam [Pa].

    Parameters
    ----------
    kind
        "axial" N/A; "left" and "right", the normal stress of the outermost fibres, N/A - M c/I and N/A + M c/I;
        "shear", the largest of the section, f V/A; "mises", the larger one of the outermost fibres and the axis,
        sqrt((N/A)^2 + 3 (f V/A)^2).
    stations
        xi = x'/l from 0 to 1, shape (stations,).

    Returns
    -------
    Shape (beams, ..., positions, stations); nan where the section does not tell its dimensions.

    Examples
    --------
    A cantilever of 1 m in a 10 mm square holds 100 N: 600 MPa at its root.

    >>> from elastic import deflection, rectangle, section_of
    >>> from rigid import Beam, Link, Mechanism, PinDrive, PointLoad, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),))
    >>> held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1},
    ...                  loads=(PointLoad("arm", "A", -100j),))
    >>> bent = deflection(motion(held, [0.0]), [section_of(rectangle(0.01, 0.01), 210e9)])
    >>> stress(bent, "left", [0.0, 0.5]).round()
    array([[[6.e+08, 3.e+08]]])
    """
    per_N, per_V, per_M = _per_force(deflection, np.asarray(stations, float))
    if kind == "shear":
        return sample(deflection, "V", stations) * per_V
    axial = sample(deflection, "N", stations) * per_N
    if kind == "axial":
        return axial
    bending = sample(deflection, "M", stations) * per_M
    if kind == "mises":
        at_axis = np.sqrt(axial**2 + 3 * (sample(deflection, "V", stations) * per_V) ** 2)
        return np.maximum(np.abs(axial) + np.abs(bending), at_axis)
    return axial + SIDES[kind] * bending


SIDES = {"left": -1.0, "right": 1.0}


def _per_force(deflection: Deflection, xi: Any) -> tuple[Any, Any, Any]:
    """1/A, f/A and c/I of every beam at stations, shape (beams, ..., 1, stations)."""
    ndim = deflection.N.ndim - 2

    def along(name: str, rigidity: str) -> Any:
        at_start = per_row([getattr(section, name) for section in deflection.sections], ndim, float)
        factors = [
            np.polynomial.polynomial.polyval(xi, getattr(section.taper, rigidity) if section.taper else (1.0,))
            for section in deflection.sections
        ]
        return at_start[..., None] * np.reshape(factors, (len(factors), *(1,) * ndim, len(xi)))

    area, inertia = along("area", "EA"), along("inertia", "EI")
    return 1.0 / area, along("peak_shear", "peak_shear") / area, along("fibre", "fibre") / inertia


def stress_extremes(deflection: Deflection, kinds: Sequence[str] = GREATEST) -> dict[str, Extreme]:
    """Stresses of largest magnitude along every beam at every position, and where they are.

    Exact where the beam is prismatic; of tapered beams from interpolation on short pieces.

    Parameters
    ----------
    kinds
        Any of those of `stress`, and "normal", the greater one of the outermost fibres with its sign.
    """
    cut = pieces(deflection)

    @cache
    def along(kind: str) -> Extreme:
        if kind == "shear" and not any(section.taper for section in deflection.sections):
            force = extremes(deflection, ["V"])["V"]
            return Extreme(force.value * _per_force(deflection, np.zeros(1))[1][..., 0], force.xi)
        values = _in_pieces(deflection, kind, cut)
        found = merged(greatest(values, turning_points(values)), cut, deflection)
        return Extreme(np.sqrt(np.maximum(found.value, 0.0)), found.xi) if kind == AXIS else found

    results = {}
    for kind in kinds:
        parts = {"normal": ("left", "right"), "mises": ("left", "right", AXIS)}.get(kind, (kind,))
        found = [along(part) for part in parts]
        if kind == "mises":
            found = [Extreme(np.abs(one.value), one.xi) for one in found]
        results[kind] = _greater(found)
    return results


AXIS = "square of mises at the axis"


def _greater(found: list[Extreme]) -> Extreme:
    best = found[0]
    for other in found[1:]:
        better = np.abs(other.value) > np.abs(best.value)
        best = Extreme(np.where(better, other.value, best.value), np.where(better, other.xi, best.xi))
    return best


def _in_pieces(deflection: Deflection, kind: str, cut: Pieces) -> Any:
    """Coefficients of a stress, or of its square, along every piece, shape (n, rows, ..., positions)."""
    per_N, per_V, per_M = (factor[cut.beam, ..., 0] for factor in _per_force(deflection, np.zeros(1)))
    axial = in_pieces(deflection, "N", cut) * per_N
    if kind in SIDES:
        values = in_pieces(deflection, "M", cut) * (SIDES[kind] * per_M)
        values[: len(axial)] += axial
    elif kind == AXIS:
        values = _square(axial) + 3 * _square(in_pieces(deflection, "V", cut) * per_V)
    else:
        values = axial if kind == "axial" else in_pieces(deflection, "V", cut) * per_V
    tapered = np.array([section.taper is not None for section in deflection.sections], bool)[cut.beam]
    if not tapered.any():
        return values
    fitted = [(row, _interpolated(deflection, kind, cut, row)) for row in np.flatnonzero(tapered)]
    result = np.zeros((max(len(values), len(fitted[0][1])), *values.shape[1:]))
    result[: len(values)] = values
    for row, coefficients in fitted:
        result[:, row] = 0.0
        result[: len(coefficients), row] = coefficients
    return result


def _interpolated(deflection: Deflection, kind: str, cut: Pieces, row: Any) -> Any:
    stations = nodes_of(cut, row)
    if kind != AXIS:
        return interpolated(stress(deflection, kind, stations)[cut.beam[row]])
    axial, shear = (stress(deflection, part, stations)[cut.beam[row]] for part in ("axial", "shear"))
    return interpolated(axial**2 + 3 * shear**2)


def _square(values: Any) -> Any:
    """Coefficients of the squares of polynomials."""
    result = np.zeros((2 * len(values) - 1, *values.shape[1:]))
    for k, value in enumerate(values):
        result[k : k + len(values)] += value * values
    return result


def stress_range(deflection: Deflection, stations: Any) -> Any:
    """How far the normal stress swings over the positions, largest minus smallest [Pa].

    Returns
    -------
    Shape (2, beams, ..., stations): of the left and the right fibre. Singular positions do not count.
    """
    return np.array([_swing(stress(deflection, side, stations)) for side in SIDES])


def _swing(values: Any) -> Any:
    known = np.isfinite(values)
    high = np.where(known, values, -np.inf).max(axis=-2)
    low = np.where(known, values, np.inf).min(axis=-2)
    return np.where(known.any(axis=-2), high - low, np.nan)


def safety_factor(deflection: Deflection, mises: Extreme | None = None) -> Reals:
    """Yield stress over the largest von Mises stress along every beam, shape (beams, ..., positions).

    Infinite without stress; nan where the yield stress or the dimensions of the section are not known.

    Parameters
    ----------
    mises
        From `stress_extremes`, where it is known already.
    """
    largest = (mises or stress_extremes(deflection, ["mises"])["mises"]).value
    limit = per_row([section.yield_stress for section in deflection.sections], largest.ndim - 1, float)
    with np.errstate(divide="ignore"):
        factor: Reals = limit / largest
    return factor
