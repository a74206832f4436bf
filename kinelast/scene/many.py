"""Numbers of a scene that stand for many designs: an array of shape (designs, 1) goes where a number goes.

The builders of a scene do the same arithmetic on both. A condition on a number is put by `require`, which finds the
designs at fault.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from kinelast.scene.error import fault


def real(quantity: Any) -> Any:
    """A quantity as a number, or as an array where it differs by design; such an array stays."""
    each = quantity if isinstance(quantity, np.ndarray) else getattr(quantity, "each", None)
    return float(quantity) if each is None else each


def vector(place: Iterable[Any]) -> Any:
    """Two components as a complex number, or as an array where one differs by design."""
    x, y = (real(part) for part in place)
    return x + 1j * y if isinstance(x, np.ndarray) or isinstance(y, np.ndarray) else complex(x, y)


def direction_of(direction: Any) -> Any:
    """A direction as a complex number, or as an array where it differs by design."""
    each = getattr(direction, "each", None)
    return direction if each is None else each


def phase(way: Any) -> Any:
    """Angle of a complex number [rad]."""
    return np.angle(way) if isinstance(way, np.ndarray) else cmath.phase(way)


def quotient(vector: Any, size: Any) -> Any:
    """A vector over a number; 0 where both are, of designs."""
    if not isinstance(size, np.ndarray) and not isinstance(vector, np.ndarray):
        return complex(vector) / float(size)
    size = np.where(size == 0.0, 1.0, size)
    return np.real(vector) / size + 1j * (np.imag(vector) / size)


def any_nonzero(value: Any) -> bool:
    """Whether a number is not zero, or that of any design."""
    return bool(np.any(value)) if isinstance(value, np.ndarray) else bool(value)


def require(holds: Any, table: str, key: str, problem: str | Callable[[Any], str]) -> None:
    """Raise where a condition does not hold; of many designs, tell which are at fault.

    Parameters
    ----------
    holds
        Whether it does, or an array of that.
    problem
        What to say; or a function that says it, given what picks the number of a design at fault, see `pick`.

    Raises
    ------
    SceneError
        Its `designs` are the rows of those at fault, and what it says that of the first.
    """
    if isinstance(holds, np.ndarray):
        wrong = np.flatnonzero(~holds)
        if not len(wrong):
            return
    elif holds:
        return
    else:
        wrong = None
    row = None if wrong is None else int(wrong[0])
    error = fault(table, key, problem if isinstance(problem, str) else problem(lambda value: _picked(value, row)))
    error.designs = wrong
    raise error


def _picked(value: Any, row: int | None) -> Any:
    """A number, or that of one design."""
    return value.ravel()[row if value.size > 1 else 0] if isinstance(value, np.ndarray) else value
