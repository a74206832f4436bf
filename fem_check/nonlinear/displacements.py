"""Displacements of beams from their rigid positions, and their transfer to a finer mesh."""

import numpy as np

from fem_check.nonlinear.rigid_places import as_complex
from fem_check.nonlinear.system import System
from rigid import Reals


def displacements(system: System, k: int, xi: Reals, q: Reals, rigid: Reals) -> Reals:
    """u, w and phi of a beam from its rigid position, shape (3, positions, nodes).

    `q`, `rigid`: coordinates of the system and of the rigid mechanism, (positions, coordinates).
    """
    at, beam = system.mechanism.beams[k]
    link, along = system.mechanism.links[at], list(system.nodes.along[k])
    start, end = complex(link.points[beam.start]), complex(link.points[beam.end])
    axis = (end - start) / abs(end - start)
    if along:
        now, was = (values[:, system.of_node[along]] for values in (q, rigid))
        turned, first, moved = now[..., 2], was[..., 2], as_complex(now - was)
    else:
        node = system.nodes.at[at, beam.start][0]
        now, was = (values[:, system.of_node[[node]]] for values in (q, rigid))
        arm = start + xi * (end - start)
        turned, first = now[..., 2] + 0 * xi, was[..., 2]
        moved = as_complex(now - was) + arm * (np.exp(1j * now[..., 2]) - np.exp(1j * first))
    seen = np.conj(axis * np.exp(1j * first)) * moved
    return np.stack([seen.real, seen.imag, turned - first])


def on_finer_mesh(coarse: System, fine: System, moved: Reals, rigid: Reals) -> Reals:
    """Interpolate displacements to twice the elements by cubic Hermite polynomials."""
    refined = np.zeros_like(rigid)
    for link in range(len(fine.mechanism.links)):
        mine, other = (np.flatnonzero(system.nodes.link == link) for system in (fine, coarse))
        if len(mine) == len(other):
            refined[:, fine.of_node[mine]] = moved[:, coarse.of_node[other]]
    for k, (along, rough) in enumerate(zip(fine.nodes.along, coarse.nodes.along, strict=True)):
        if not along:
            continue
        at, beam = fine.mechanism.beams[k]
        points = fine.mechanism.links[at].points
        way = complex(points[beam.end]) - complex(points[beam.start])
        h = abs(way) / (len(rough) - 1)
        axis = way / abs(way) * np.exp(1j * rigid[:, fine.of_node[along[0], 2]])[:, None]
        own = moved[:, coarse.of_node[list(rough)]]
        z, phi = np.conj(axis) * (own[..., 0] + 1j * own[..., 1]), own[..., 2]
        way_of = np.diff(z, axis=1) + h
        grown = np.abs(way_of) / h * (1 + np.diff(phi, axis=1) ** 2 / 24)
        first, last = (h * (grown * np.exp(1j * turn) - 1) for turn in (phi[:, :-1], phi[:, 1:]))
        middle = (z[:, :-1] + z[:, 1:]) / 2 + (first - last) / 8
        slope = 1.5 * np.diff(z, axis=1) - (first + last) / 4
        new_z = np.empty((len(z), len(along)), complex)
        new_phi = np.empty(new_z.shape)
        new_z[:, ::2], new_z[:, 1::2] = z, middle
        new_phi[:, ::2], new_phi[:, 1::2] = phi, np.angle(h + slope)
        turned = axis * new_z
        numbers = fine.of_node[list(along)]
        refined[:, numbers] = np.stack([turned.real, turned.imag, new_phi], axis=-1)
    return refined
