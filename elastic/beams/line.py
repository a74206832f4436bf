"""One beam: section forces by equilibrium, then the elastic line and Hooke's law, all in powers of xi = x'/l."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, reduce
from typing import Any

import numpy as np

from elastic.beams.section import Section
from rigid.constants import per_row

SETTLED = 40.0


def section_forces(q: Any, pull: Any, twist: Any, length: Any) -> tuple[Any, Any, Any]:
    """N, V, M by equilibrium of the piece beyond a section, exact for a load of any degree.

    Parameters
    ----------
    q
        q_x + i q_y in powers of xi [N/m], shape (n, beams, ..., positions).
    pull, twist
        Force in the beam's axes [N], complex, and moment [N m] on its end, shape (beams, ..., positions).
    length
        [m], shape (beams, ..., 1).

    Returns
    -------
    Coefficients of N and V, shape (n + 1, ...), and of M, shape (n + 2, ...).
    """
    power = np.arange(1.0, len(q) + 2).reshape(-1, *[1] * pull.ndim)
    beyond = np.empty((len(q) + 1, *pull.shape), complex)
    np.multiply(q, -length / power[:-1], out=beyond[1:])
    np.subtract(pull, _sum(beyond[1:]), out=beyond[0])
    N, V = np.ascontiguousarray(beyond.real), -beyond.imag
    M = np.empty((len(q) + 2, *pull.shape))
    np.multiply(V, length / power, out=M[1:])
    np.subtract(twist, _sum(M[1:]), out=M[0])
    return N, V, M


def _sum(rows: Any) -> Any:
    """Sum over the first axis, which is short."""
    return reduce(np.add, rows)


@dataclass(frozen=True, eq=False)
class Compliance:
    """What turns section forces into the displacements of the beams; rows of shape (beams, ..., 1).

    Attributes
    ----------
    stretch, bend, shear
        1/EA, 1/EI, 1/kGA at the start.
    strain, tapered
        Free strain; whether the rigidities change along the beam.
    ends
        By how much less or more than a prismatic beam's every power contributes to u(1), phi(1), w(1) by bending and
        w(1) by shear, four arrays of shape (powers, beams, 1); None where all beams are prismatic.
    """

    stretch: Any
    bend: Any
    shear: Any
    strain: Any
    tapered: Any
    ends: tuple[Any, Any, Any, Any] | None

    @cached_property
    def sheared(self) -> bool:
        """Whether any beam gives way to shear."""
        return bool(self.shear.any())

    @cached_property
    def strained(self) -> bool:
        """Whether any beam has free strain."""
        return bool(self.strain.any())

    @property
    def unstrained(self) -> Compliance:
        """The same beams without free strain."""
        return replace(self, strain=np.zeros_like(self.strain))


@lru_cache(maxsize=64)
def compliance(sections: tuple[Section, ...], ndim: int) -> Compliance:
    """Compliances of the beams, for columns of `ndim` axes."""
    rows = [
        per_row([1.0 / np.asarray(value, float) for value in values], ndim, float)
        for values in zip(*((section.EA, section.EI, section.kGA) for section in sections), strict=True)
    ] or [np.zeros((0,) + (1,) * ndim)] * 3
    strain = per_row([section.strain for section in sections], ndim, float)
    ends = None
    if any(section.taper for section in sections):
        table = np.array([[part[:, 0] for part in tapered_powers(section, (1.0,))] for section in sections])
        ends = tuple(np.moveaxis(table, 0, -1)[k].reshape(POWERS, -1, *(1,) * ndim) for k in range(4))
    tapered = per_row([bool(section.taper) for section in sections], ndim, bool)
    return Compliance(rows[0], rows[1], rows[2], strain, tapered, ends)


@lru_cache(maxsize=64)
def designs_of(sections: tuple[Section, ...]) -> tuple[int, ...]:
    """Shape of the sections' properties: () or (designs, 1)."""
    values = [value for part in sections for value in (part.EA, part.EI, part.kGA, part.strain)]
    return np.broadcast_shapes(*(np.shape(value) for value in values))


POWERS = 8


def tapered_powers(section: Section, stations: Sequence[float] | Any) -> tuple[Any, Any, Any, Any]:
    """What stands in place of the powers of xi in the fields of a tapered beam.

    With f = 1/(rigidity relative to the start), for k = 0, 1, ...: in u `(k+1) int s^k f_EA ds`, in phi the same with
    EI, in w by bending `(k+1)(k+2) int (xi-s) s^k f_EI ds`, in w by shear `(k+1) int s^k f_kGA ds`, from 0 to xi, by
    Gauss' quadrature with as many points as bring it to round-off.

    Returns
    -------
    Four arrays of shape (POWERS, stations); xi^(k+1), xi^(k+1), xi^(k+2), xi^(k+1) for a prismatic beam.
    """
    xi = np.asarray(stations, float)
    taper = section.taper
    k = np.arange(POWERS)[:, None, None]
    results = []
    for polynomial, twice in (("EA", False), ("EI", False), ("EI", True), ("kGA", False)):
        values = getattr(taper, polynomial) if taper else (1.0,)
        nodes, weights = _gauss(values)
        t = nodes[None, None, :]
        softness = 1.0 / np.polynomial.polynomial.polyval(xi[:, None] * nodes, values)
        if twice:
            integrand = (k + 1) * (k + 2) * t**k * (1 - t)
            results.append((integrand * softness * weights).sum(-1) * xi ** (k[..., 0] + 2))
        else:
            results.append(((k + 1) * t**k * softness * weights).sum(-1) * xi ** (k[..., 0] + 1))
    return results[0], results[1], results[2], results[3]


def _gauss(polynomial: tuple[float, ...]) -> tuple[Any, Any]:
    """Gauss-Legendre points on [0, 1] that integrate 1/polynomial to round-off: more, the nearer its zeros are."""
    roots = 2 * np.polynomial.polynomial.polyroots(polynomial).astype(complex) - 1
    ellipse = np.abs(roots + np.sqrt(roots - 1) * np.sqrt(roots + 1))
    nearest = ellipse.min() if len(ellipse) else np.inf
    count = POWERS + (0 if np.isinf(nearest) else int(np.ceil(SETTLED / 2 / np.log(nearest))))
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2


@dataclass(frozen=True, eq=False)
class Line:
    """Displacements of beams clamped at their start: coefficients of u, w and phi, and their values at the end.

    `shear` holds what shear adds to w of tapered beams, whose powers differ from those of bending; None without.
    """

    u: Any
    w: Any
    phi: Any
    shear: Any
    end: tuple[Any, Any, Any]


def elastic_line(N: Any, V: Any, M: Any, length: Any, soft: Compliance) -> Line:
    """u, w, phi of beams clamped at their start: M/EI integrated twice, N/EA once, and the slide of shear.

    Utenov et al., equations (2), (3), (4) with EA, (5), all constants of integration zero. phi is the rotation of the
    section; with shear w' = phi - V/kGA.
    """
    power = np.arange(1.0, len(M) + 2).reshape(-1, *[1] * (N.ndim - 1))
    u = np.zeros((len(N) + 1, *N.shape[1:]))
    np.multiply(N, length * soft.stretch / power[: len(N)], out=u[1:])
    phi = np.zeros((len(M) + 1, *M.shape[1:]))
    np.multiply(M, length * soft.bend / power[: len(M)], out=phi[1:])
    w = np.zeros((len(M) + 2, *M.shape[1:]))
    np.multiply(phi[1:], length / power[1:], out=w[2:])
    slide = V * (-length * soft.shear / power[: len(V)]) if soft.sheared else None
    if soft.ends is None:
        if slide is not None:
            w[1 : len(V) + 1] += slide
            slide = None
        end = _sum(u[1:]), _sum(w[1 if soft.sheared else 2 :]), _sum(phi[1:])
    else:
        parts = [(u[1:], 0), (phi[1:], 1), (w[2:], 2)] + ([(slide, 3)] if slide is not None else [])
        reached = [(values * soft.ends[kind][: len(values)]).sum(0) for values, kind in parts]
        end = reached[0], reached[2] + (reached[3] if slide is not None else 0.0), reached[1]
        if slide is not None:
            w[1 : len(V) + 1] += np.where(soft.tapered, 0.0, slide)
            slide = np.where(soft.tapered, slide, 0.0)
    if soft.strained:
        free = soft.strain * length
        u[1] += free if soft.ends is None else np.where(soft.tapered, 0.0, free)
        end = end[0] + free, end[1], end[2]
    return Line(u, w, phi, slide, end)
