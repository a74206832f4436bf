"""Flexible GMRES, for a preconditioner that varies by round-off."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rigid import Reals


def flexible_gmres(
    applied: Callable[[Reals], Reals], guessed: Callable[[Reals], Reals], right: Reals, tolerance: float, most: int
) -> Reals:
    """Solve applied(x) = right, shape (n,), to a residual relative to the right-hand side.

    Parameters
    ----------
    applied
        Linear map.
    guessed
        Approximate inverse.
    most
        Largest number of search directions; then the best combination is returned.

    References
    ----------
    Saad, A flexible inner-outer preconditioned GMRES algorithm, SIAM Journal on Scientific Computing 14 (1993) 461-469.

    Examples
    --------
    >>> matrix = np.diag([1.0, 2.0, 4.0])
    >>> flexible_gmres(lambda x: matrix @ x, lambda x: x, np.array([1.0, 2.0, 4.0]), 1e-12, 3).round(9)
    array([1., 1., 1.])
    """
    size = float(np.linalg.norm(right))
    if size == 0.0:
        return np.zeros_like(right)
    basis, tried = np.empty((most + 1, len(right))), np.empty((most, len(right)))
    table, wanted = np.zeros((most + 1, most)), np.zeros(most + 1)
    basis[0], wanted[0] = right / size, size
    weights: Reals = np.zeros(0)
    for k in range(most):
        tried[k] = guessed(basis[k])
        image = applied(tried[k])
        for _ in range(2):
            parts = basis[: k + 1] @ image
            image = image - parts @ basis[: k + 1]
            table[: k + 1, k] += parts
        table[k + 1, k] = np.linalg.norm(image)
        weights = np.asarray(np.linalg.lstsq(table[: k + 2, : k + 1], wanted[: k + 2])[0], float)
        left = np.linalg.norm(table[: k + 2, : k + 1] @ weights - wanted[: k + 2])
        if left <= tolerance * size or table[k + 1, k] <= 1e-14 * size:
            break
        basis[k + 1] = image / table[k + 1, k]
    found: Reals = weights @ tried[: len(weights)]
    return found
