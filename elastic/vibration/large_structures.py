"""Lowest natural frequencies of structures of many links, from sparse matrices.

Dense matrices take the cube of the number of links: 2 s for thirty, a minute and a half for a hundred.
"""

from __future__ import annotations

import numpy as np

from elastic.arrays import Matrices
from rigid.arrays import Reals

SPARE = 6  # vectors more than modes asked for
SETTLED = 1e-9
MOST = 300  # rounds; each brings a vector nearer by the ratio of its eigenvalue to that of the first one left out
SOFT = 1e-12  # give of what holds, over that of the links: redundant conditions leave the matrix regular


def lowest_sparse(stiffness: Matrices, mass: Matrices, held: Matrices, modes: int) -> Reals:
    """Lowest frequencies of one structure [rad/s], rising, shape (modes,); infinite where nothing more can vibrate.

    By subspace iteration: solutions under the inertia loads of the last round's shapes, and Rayleigh's quotients of
    what they span.

    Parameters
    ----------
    stiffness, mass
        Shape (n, n), the mass semidefinite.
    held
        Combinations of the coordinates that are kept zero, shape (rows, n), also more than needed.

    References
    ----------
    Bathe, Finite Element Procedures, 2nd ed., 2014, section 11.6.
    """
    from scipy.linalg import eigh
    from scipy.sparse import bmat, csc_matrix, identity
    from scipy.sparse.linalg import splu

    size, rows = len(stiffness), len(held)
    diagonal = np.diagonal(stiffness)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, diagonal.max()))
    scaled, weight = (csc_matrix(whole * np.outer(scale, scale)) for whole in (stiffness, mass))
    ties = held * scale
    ties = csc_matrix(ties / np.linalg.norm(ties, axis=1, keepdims=True))
    solver = splu(bmat([[scaled, ties.T], [ties, -SOFT * identity(rows)]], format="csc"))
    count = min(modes + SPARE, size)
    shapes = np.random.default_rng(0).standard_normal((size, count))
    before = np.full(count, np.inf)
    for _ in range(MOST):
        inertia = weight @ shapes
        moved = solver.solve(np.concatenate([inertia, np.zeros((rows, count))]))[:size]
        given, energy = moved.T @ (weight @ moved), moved.T @ inertia
        # Mass per stiffness, the largest first; what has no mass spans nothing that counts.
        values, turn = eigh(given, energy + 1e-14 * np.trace(energy) * np.eye(count))
        values, turn = values[::-1], turn[:, ::-1]
        shapes = moved @ turn
        if np.abs(values[:modes] - before[:modes]).max() <= SETTLED * values[0]:
            break
        before = values
    per_stiffness = values[:modes]
    omega = np.full(modes, np.inf)
    moving = per_stiffness > 1e-13 * per_stiffness[0]
    omega[: len(per_stiffness)] = np.where(moving, 1.0 / np.sqrt(np.where(moving, per_stiffness, 1.0)), np.inf)
    return omega
