"""Lowest natural frequencies of mechanisms with many links, from sparse matrices.

With dense matrices, the time grows with the cube of the number of links: 2 s for 30 links, 90 s for 100.
"""

import numpy as np

from elastic.arrays import Matrices
from rigid.arrays import Reals

EXTRA_VECTORS = 6  # number of vectors in addition to the requested modes
TOLERANCE = 1e-9  # largest change of an eigenvalue in the last iteration, relative to the largest
MAX_ROUNDS = 300  # maximum number of subspace iterations
CONSTRAINT_FLEXIBILITY = 1e-12  # compliance of constraints, relative to links; redundant ones leave the matrix regular


def lowest_sparse(stiffness: Matrices, mass: Matrices, constraints: Matrices, modes: int) -> Reals:
    """Compute the lowest frequencies of one structure [rad/s], ascending, shape (modes,); inf for massless modes.

    The method is subspace iteration: solve under the inertia loads of the last shapes, then solve the small eigenvalue
    problem.

    Parameters
    ----------
    stiffness, mass
        Shape (n, n); the mass matrix is semidefinite.
    constraints
        Combinations of coordinates that must be zero, shape (rows, n); rows may be redundant.

    References
    ----------
    Bathe, Finite Element Procedures, 2nd ed., 2014, section 11.6.
    """
    from scipy.linalg import eigh
    from scipy.sparse import bmat, csc_matrix, identity
    from scipy.sparse.linalg import splu

    size, rows = len(stiffness), len(constraints)
    diagonal = np.diagonal(stiffness)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, diagonal.max()))
    scaled, weight = (csc_matrix(whole * np.outer(scale, scale)) for whole in (stiffness, mass))
    ties = constraints * scale
    ties = csc_matrix(ties / np.linalg.norm(ties, axis=1, keepdims=True))
    solver = splu(bmat([[scaled, ties.T], [ties, -CONSTRAINT_FLEXIBILITY * identity(rows)]], format="csc"))
    count = min(modes + EXTRA_VECTORS, size)
    shapes = np.random.default_rng(0).standard_normal((size, count))
    before = np.full(count, np.inf)
    for _ in range(MAX_ROUNDS):
        inertia = weight @ shapes
        moved = solver.solve(np.concatenate([inertia, np.zeros((rows, count))]))[:size]
        given, energy = moved.T @ (weight @ moved), moved.T @ inertia
        # eigenvalues are mass per stiffness, largest first; massless shapes get zero
        values, turn = eigh(given, energy + 1e-14 * np.trace(energy) * np.eye(count))
        values, turn = values[::-1], turn[:, ::-1]
        shapes = moved @ turn
        if np.abs(values[:modes] - before[:modes]).max() <= TOLERANCE * values[0]:
            break
        before = values
    per_stiffness = values[:modes]
    omega = np.full(modes, np.inf)
    moving = per_stiffness > 1e-13 * per_stiffness[0]
    omega[: len(per_stiffness)] = np.where(moving, 1.0 / np.sqrt(np.where(moving, per_stiffness, 1.0)), np.inf)
    return omega
