"""One beam: section forces by equilibrium, then the elastic line and Hooke's law, all in powers of xi = x'/l."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from elastic.arrays import Coefficients, PerBeam, VectorCoefficients, VectorPerBeam
from elastic.beams.compliance import Compliance
from elastic.beams.polynomials import added
from rigid.arrays import Numbers


def section_forces(
    q: VectorCoefficients, couple: Coefficients | None, pull: VectorPerBeam, twist: PerBeam, compliance: Compliance
) -> tuple[Coefficients, Coefficients, Coefficients]:
    """N, V, M by equilibrium of the piece beyond a section, exact for a load of any degree.

    Parameters
    ----------
    q
        q_x + i q_y in powers of xi [N/m], shape (n, beams, ..., positions).
    couple
        Moment per length in powers of xi [N], shape (k, beams, ..., positions), with which M' = V - couple; or None.
    pull, twist
        Force in the beam's axes [N], complex, and moment [N m] on its end, shape (beams, ..., positions).
    compliance
        Of the beams: tells their lengths.

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
    """Sum over the first axis, which is short."""
    return reduce(np.add, rows)


@dataclass(frozen=True, eq=False)
class Amplitudes:
    """Coefficients of the fields of all beams, rows of shape (beams, ..., positions).

    Coefficients of N, V, M and of u, w, phi in powers of xi, up to the first block on the beam. On tapered beams the
    powers of u, w, phi that section forces bring are replaced by `taper_functions`, and `slide` is what shear brings to
    w by functions of its own, None without; `free` is what strains that no force makes bring to u, w, phi in powers of
    xi, shape (3, n, ...), None without. `elastic.beams.division` makes fields of all that.
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
        """With N + i V and M by so much larger, in powers of xi, shape (n, ...); u, w, phi as they are."""
        return replace(self, N=added(self.N, force.real), V=added(self.V, force.imag), M=added(self.M, moment.real))


def elastic_line(
    N: Coefficients, V: Coefficients, M: Coefficients, compliance: Compliance
) -> tuple[Amplitudes, tuple[PerBeam, ...]]:
    """u, w, phi of beams clamped at their start: M/EI integrated twice, N/EA once, and the slide of shear.

    Utenov et al., equations (2), (3), (4) with EA, (5), all constants of integration zero. phi is the rotation of the
    section; with shear w' = phi - V/kGA.

    Returns
    -------
    The amplitudes, and u, w, phi at the beams' ends, (6) and (7).
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
        end = _reached(u[1:], stretched), _reached(w[2:], bent), _reached(phi[1:], turned)
        if slide is not None:
            end = end[0], end[1] + _reached(slide, slid), end[2]
            w[1 : len(V) + 1] += np.where(compliance.tapered, 0.0, slide)
            slide = np.where(compliance.tapered, slide, 0.0)
    if compliance.strained:
        free = compliance.strain * compliance.length
        u[1] += free if compliance.ends is None else np.where(compliance.tapered, 0.0, free)
        end = end[0] + free, end[1], end[2]
    return Amplitudes(N, V, M, u, w, phi, slide), end


def free_line(strain: VectorCoefficients, length: PerBeam) -> Coefficients:
    """u, w, phi of beams clamped at their start under strains that no force makes, as of `AddedLoads`.

    Returns
    -------
    In powers of xi, shape (3, n + 2, beams, ..., positions).
    """
    power = np.arange(1.0, strain.shape[1] + 1).reshape(-1, *[1] * (strain.ndim - 2))
    u, w, phi = free = np.zeros((3, strain.shape[1] + 2, *strain.shape[2:]))
    along = strain * (length / power)
    u[1:-1], w[1:-1], phi[1:-1] = along[0].real, along[0].imag, along[1].real
    w[2:] += phi[1:-1] * (length / (power + 1.0))
    return free


def _reached(amplitudes: Coefficients, ends: Coefficients) -> PerBeam:
    """Sum of functions at the end of the beam by their amplitudes."""
    reached: PerBeam = (amplitudes * ends[: len(amplitudes)]).sum(0)
    return reached
