"""Section forces and elastic line of a beam, in powers of xi = x'/l."""

from __future__ import annotations

from functools import reduce

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.arrays import Coefficients, PerBeam, VectorCoefficients, VectorPerBeam
from elastic.beams.compliance import BeamCompliance
from elastic.beams.polynomials import added
from rigid.arrays import Numbers


def section_forces(
    q: VectorCoefficients, couple: Coefficients | None, pull: VectorPerBeam, twist: PerBeam, compliance: BeamCompliance
) -> tuple[Coefficients, Coefficients, Coefficients]:
    """Return N, V, M from the equilibrium of the part between each cut and the beam's end; exact for polynomial loads.

    Parameters
    ----------
    q
        Distributed load q_x + i q_y in powers of xi [N/m], shape (n, beams, ..., positions).
    couple
        Distributed moment in powers of xi [N], shape (k, beams, ..., positions), with M' = V - couple; or None.
    pull, twist
        Force [N], complex, and moment [N m] on the end of each beam in beam axes, shape (beams, ..., positions).
    compliance
        Flexibilities and lengths of the beams; only the lengths are used.

    Returns
    -------
    Coefficients of N and V, shape (n + 1, ...), and of M, shape (max(n + 2, k + 1), ...).
    """
    along = compliance.integrals[0]
    beyond = np.empty((len(q) + 1, *pull.shape), complex)
    np.multiply(q, -along[: len(q)], out=beyond[1:])
    np.subtract(pull, _sum(beyond[1:]), out=beyond[0])
    N, V = np.ascontiguousarray(beyond.real), -beyond.imag
    M = np.zeros((max(len(q) + 2, 1 + len(couple if couple is not None else ())), *pull.shape))
    np.multiply(V, along[: len(V)], out=M[1 : len(V) + 1])
    if couple is not None:
        M[1 : len(couple) + 1] -= couple * along[: len(couple)]
    np.subtract(twist, _sum(M[1:]), out=M[0])
    return N, V, M


def _sum(rows: Numbers) -> Numbers:
    """Sum over the first axis; fast if this axis is short."""
    return reduce(np.add, rows)


class Amplitudes(Struct, frozen=True, eq=False):
    """Coefficients of the fields of all beams before the beams are divided into pieces (see `elastic.beams.division`).

    N, V, M, u, w, phi are polynomials in xi, with coefficients of shape (beams, ..., positions). They are valid from
    the start of a beam to the first sliding block on the beam. On tapered beams, `taper_functions` replace the powers
    of xi in the parts of u, w, phi that are due to section forces.

    Attributes
    ----------
    slide
        Shear deflection of tapered beams, not included in `w` (see `elastic.beams.taper`), or None if there is none.
    free
        Additional u, w, phi due to the free strains of `AddedLoads`, not included in `u`, `w` and `phi`, in powers of
        xi, shape (3, n, ...), or None.
    """

    N: Coefficients
    V: Coefficients
    M: Coefficients
    u: Coefficients
    w: Coefficients
    phi: Coefficients
    slide: Coefficients | None
    free: Coefficients | None = None

    def with_section(self, force: VectorCoefficients, moment: VectorCoefficients) -> Amplitudes:
        """Return a copy with polynomials in xi, shape (n, ...), added to N + i V and to M; u, w, phi do not change."""
        return replace(self, N=added(self.N, force.real), V=added(self.V, force.imag), M=added(self.M, moment.real))


def elastic_line(
    N: Coefficients, V: Coefficients, M: Coefficients, compliance: BeamCompliance
) -> tuple[Amplitudes, tuple[PerBeam, ...]]:
    """Integrate the elastic line of beams that are clamped at their start.

    u is the integral of (N/EA + free strain of the section), phi is the integral of M/EI, and w is the integral of (phi
    - V/kGA). These are equations (2) to (5) of Utenov et al. as corrected in docs/errata.md, with zero constants of
    integration.

    Returns
    -------
    The amplitudes, and u, w, phi at the end of each beam, which are equations (6) and (7).
    """
    along, stretch, bend, shear = compliance.integrals
    u = np.empty((len(N) + 1, *N.shape[1:]))
    np.multiply(N, stretch[: len(N)], out=u[1:])
    phi = np.empty((len(M) + 1, *M.shape[1:]))
    np.multiply(M, bend[: len(M)], out=phi[1:])
    w = np.empty((len(M) + 2, *M.shape[1:]))
    u[0] = phi[0] = w[:2] = 0.0
    np.multiply(phi[1:], along[1 : len(phi)], out=w[2:])
    slide = V * shear[: len(V)] if compliance.sheared else None
    if compliance.ends is None:
        if slide is not None:
            w[1 : len(V) + 1] += slide
            slide = None
        end = _sum(u[1:]), _sum(w[1 if compliance.sheared else 2 :]), _sum(phi[1:])
    else:
        stretched, turned, bent, slid = compliance.ends
        end = _sum_at_end(u[1:], stretched), _sum_at_end(w[2:], bent), _sum_at_end(phi[1:], turned)
        if slide is not None:
            end = end[0], end[1] + _sum_at_end(slide, slid), end[2]
            w[1 : len(V) + 1] += np.where(compliance.tapered, 0.0, slide)
            slide = np.where(compliance.tapered, slide, 0.0)
    if compliance.strained:
        free = compliance.strain * compliance.length
        u[1] += free if compliance.ends is None else np.where(compliance.tapered, 0.0, free)
        end = end[0] + free, end[1], end[2]
    return Amplitudes(N, V, M, u, w, phi, slide), end


def free_line(strain: VectorCoefficients, length: PerBeam) -> Coefficients:
    """Return u, w, phi due to free strains (see `AddedLoads`) of beams clamped at their start.

    Returns
    -------
    Coefficients in powers of xi, shape (3, n + 2, beams, ..., positions).
    """
    power = np.arange(1.0, strain.shape[1] + 1).reshape(-1, *[1] * (strain.ndim - 2))
    u, w, phi = free = np.zeros((3, strain.shape[1] + 2, *strain.shape[2:]))
    along = strain * (length / power)
    u[1:-1], w[1:-1], phi[1:-1] = along[0].real, along[0].imag, along[1].real
    w[2:] += phi[1:-1] * (length / (power + 1.0))
    return free


def _sum_at_end(amplitudes: Coefficients, ends: Coefficients) -> PerBeam:
    """Evaluate a field at the end of each beam: the sum of (amplitude * taper function)."""
    return (amplitudes * ends[: len(amplitudes)]).sum(0)
