"""Unit beam: cantilever of length 1 with EA, EI and kGA equal to 1 at its start, solved by scikit-fem."""

from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import Taper
from fem_check.linear.elements import hermite, quadratic
from fem_check.linear.lines import ElementRow
from rigid import Reals

# distributed loads are polynomials in xi of at least this degree; the inertia of a mass per length of degree 2 has this
# degree
DEGREE = 3
Key = tuple[tuple[float, ...], ...]


class UnitBeam(Struct, frozen=True, eq=False):
    """Response of a cantilever to unit loads.

    The deflections due to bending and due to shear are computed separately. The slope of the shear deflection is the
    shear strain. The energy per length of Timoshenko's beam is then half of `EI (w_bending'')^2 + kGA w_shear'^2`, and
    the elements cannot lock.

    Attributes
    ----------
    xi
        Positions of the nodes from 0 to 1, shape (nodes,).
    stations
        Positions at which distributed loads are given, shape (stations,).
    w, phi, V, M
        Response without shear deformation at the nodes, shape (2 stations + 2, nodes). The loads on the first axis are,
        in this order: for each station, a transverse load per length that is 1 at this station and 0 at the others; for
        each station, a moment per unit length with the same distribution; a transverse force at the end; a moment at
        the end.
    u, N
        Response at the nodes, shape (stations + 1, nodes). The loads are, for each station, an axial load per length
        that is 1 at this station and 0 at the others; then an axial force at the end.
    slide
        Deflection due to shear at the nodes, shape (2 stations + 1, nodes). The loads are those of w without the moment
        at the end. The deflection is zero for moments per unit length.
    bending, stretching, sliding
        Rows of elements for bending, tension and shear.
    """

    xi: Reals
    stations: Reals
    w: Reals
    phi: Reals
    V: Reals
    M: Reals
    u: Reals
    N: Reals
    slide: Reals
    bending: ElementRow
    stretching: ElementRow
    sliding: ElementRow

    def load_at(self, xi: Reals) -> Reals:
        """Evaluate the distributed unit loads at xi, shape (stations, ...).

        The load of each station is the Lagrange polynomial that is 1 at this station and 0 at the others.
        """
        return np.array([_lagrange(self.stations, k, xi) for k in range(len(self.stations))])


def unit_beam(elements: int, degree: int = DEGREE, taper: Taper | None = None) -> UnitBeam:
    """Solve a cantilever of equal elements: Hermite elements for bending, quadratic ones for tension and shear.

    Parameters
    ----------
    elements
        Number of elements.
    degree
        Degree of the distributed loads as polynomials in xi.
    taper
        Variation of the rigidities along the beam.

    Raises
    ------
    ValueError
        If `elements` is less than 1.

    Examples
    --------
    A unit force at the end causes a deflection of 1/3.

    >>> float(unit_beam(4).w[-2, -1].round(12))
    0.333333333333
    """
    if elements < 1:
        raise ValueError(f"{elements} elements: a beam needs at least one")
    own = taper or Taper()
    return _unit_beam(elements, degree, tuple(tuple(float(c) for c in part) for part in (own.EA, own.EI, own.kGA)))


@lru_cache(maxsize=64)
def _unit_beam(elements: int, degree: int, tapers: Key) -> UnitBeam:
    n = float(elements)
    EA, EI, kGA = tapers
    stations = (1.0 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2  # the unit loads are Lagrange polynomials
    bending, stretching = ElementRow(hermite(), elements, EI), ElementRow(quadratic(), elements, EA)
    loads = np.array([_lagrange(stations, k, bending.xi) for k in range(degree + 1)])
    tip = np.zeros((bending.size, 2))
    tip[bending.dofs[-1, 2:4]] = np.diag((n**-3, n**-2))
    spread = np.concatenate((bending.spread(loads) / n**4, bending.spread(loads, couples=True) / n**3))
    (w, phi), (V, minus_M, minus_V, M) = bending.respond(spread, tip)
    u, N = _along(stretching, loads)
    sliding = stretching if kGA == EA else ElementRow(quadratic(), elements, kGA)
    slide = u if sliding is stretching else _along(sliding, loads)[0]
    slide = np.insert(slide, [degree + 1] * (degree + 1), 0.0, axis=0)
    return UnitBeam(
        np.arange(n + 1) / n,
        stations,
        w,
        phi * n,
        _at_nodes(V, -minus_V) * n**3,
        _at_nodes(-minus_M, M) * n**2,
        u,
        N,
        slide,
        bending,
        stretching,
        sliding,
    )


def _along(line: ElementRow, loads: Reals) -> tuple[Reals, Reals]:
    """Return axial nodal displacements and forces under distributed loads and a force at the end."""
    n = float(line.elements)
    tip = np.zeros((line.size, 1))
    tip[line.dofs[-1, 1]] = 1 / n
    (u,), (minus_N, N, _) = line.respond(line.spread(loads) / n**2, tip)
    return u, _at_nodes(-minus_N, N) * n


def _lagrange(stations: Reals, k: int, xi: Any) -> Reals:
    """Evaluate the Lagrange polynomial that is 1 at one station and 0 at the others."""
    value = np.ones(np.shape(xi))
    for other in np.delete(stations, k):
        value = value * ((xi - other) / (stations[k] - other))
    return value


def _at_nodes(starts: Reals, ends: Reals) -> Reals:
    """Return a section force at the nodes: at the start of each element and at the end of the last one."""
    return np.concatenate((starts, ends[:, -1:]), axis=1)
