"""Cantilever with unit length and unit rigidities at its start, solved by scikit-fem."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from elastic import Taper
from fem_check.linear.elements import hermite, quadratic
from fem_check.linear.lines import ElementRow
from rigid import Reals

DEGREE = 3  # smallest degree of distributed loads: inertia for a mass per length of degree 2
Key = tuple[tuple[float, ...], ...]


def stations_of(degree: int) -> Reals:
    """Stations of the distributed load; unit loads are their Lagrange polynomials."""
    return (1.0 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2


@dataclass(frozen=True, eq=False)
class UnitBeam:
    """Response of a cantilever to unit loads, at its nodes.

    Shear has its own deflection; its slope is the shear strain. Timoshenko's energy is then
    `EI (w_bending'')^2 + kGA w_shear'^2`, and neither part of the elements can lock.

    Attributes
    ----------
    xi
        Nodes, shape (nodes,).
    stations
        Stations of distributed loads, shape (stations,).
    w, phi, V, M
        Without shear, shape (2 stations + 2, nodes). Loads: transverse, 1 at one of `stations` and 0 at the others; the
        same as moments per length; a force and a moment at the end.
    u, N
        Under the same axial loads, then under a force at the end, shape (stations + 1, nodes).
    slide
        Shear part of w under transverse loads, moments per length (zero), and a force at the end, shape
        (2 stations + 1, nodes).
    bending, stretching, sliding
        Rows of elements.
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
        """Unit loads at points along the beam, shape (stations, ...)."""
        return np.array([_lagrange(self.stations, k, xi) for k in range(len(self.stations))])


def unit_beam(elements: int, degree: int = DEGREE, taper: Taper | None = None) -> UnitBeam:
    """Cantilever of equal elements: Hermite for bending, quadratic for tension and shear.

    Parameters
    ----------
    elements
        Number of elements.
    degree
        Degree of the distributed loads.
    taper
        Variation of the rigidities along the beam.

    Raises
    ------
    ValueError
        Fewer than one element.

    Examples
    --------
    A force at the end bends it by 1/3.

    >>> float(unit_beam(4).w[-2, -1].round(12))
    0.333333333333
    """
    if elements < 1:
        raise ValueError(f"{elements} elements: a beam takes one or more")
    own = taper or Taper()
    return _unit_beam(elements, degree, tuple(tuple(float(c) for c in part) for part in (own.EA, own.EI, own.kGA)))


@lru_cache(maxsize=64)
def _unit_beam(elements: int, degree: int, tapers: Key) -> UnitBeam:
    n = float(elements)
    EA, EI, kGA = tapers
    stations = stations_of(degree)
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
    """Nodal displacements and forces in tension under distributed loads and an end force."""
    n = float(line.elements)
    tip = np.zeros((line.size, 1))
    tip[line.dofs[-1, 1]] = 1 / n
    (u,), (minus_N, N, _) = line.respond(line.spread(loads) / n**2, tip)
    return u, _at_nodes(-minus_N, N) * n


def _lagrange(stations: Reals, k: int, xi: Any) -> Reals:
    """Lagrange polynomial, 1 at one station and 0 at the others."""
    value = np.ones(np.shape(xi))
    for other in np.delete(stations, k):
        value = value * ((xi - other) / (stations[k] - other))
    return value


def _at_nodes(starts: Reals, ends: Reals) -> Reals:
    """Section force at the nodes: at each element's start and at the last one's end."""
    return np.concatenate((starts, ends[:, -1:]), axis=1)
