"""Arrays as they stand in a page: what is the same all along once, large ones compressed."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

PACKED = 400_000  # bytes of numbers from which they are compressed: below, the time is worth more


class Numbers:
    """Rows one behind the other, over positions or designs, and what they belong to.

    Attributes
    ----------
    places
        By name: "d" (float64) or "f" (float32); shape without the last axis; whether they are complex, their parts rows
        of their own; per row its value where that is the same all along, None where the row is stored.
    integrals
        By name of an array of coefficients, of which field's all but the first follow by integration, how many times,
        and the factor for every piece.
    """

    def __init__(self) -> None:
        self.places: dict[str, tuple[str, tuple[int, ...], bool, list[float | None]]] = {}
        self.integrals: dict[str, tuple[str, int, list[float]]] = {}
        self._parts: dict[str, list[Any]] = {"d": [], "f": []}

    def add(self, name: str, values: Any, kind: str = "d") -> None:
        """Put an array behind the others of its kind."""
        values = np.asarray(values)
        shape, vectors = values.shape[:-1], np.iscomplexobj(values)
        rows = np.stack([values.real, values.imag], axis=-2) if vectors else values
        rows = rows.reshape(-1, values.shape[-1])
        alike = (rows == rows[:, :1]).all(axis=1) & np.isfinite(rows[:, 0])
        first = rows[:, 0].tolist()
        same = [value if one else None for value, one in zip(first, alike.tolist(), strict=True)]
        self.places[name] = (kind, shape, vectors, same)
        self._parts[kind].append(np.ascontiguousarray(rows[~alike], "<f8" if kind == "d" else "<f4"))

    def bytes(self) -> tuple[bytes, bool]:
        """All float64, then all float32, little-endian; and whether they are packed.

        Packed: the first bytes of all numbers of a kind, then the second ones and so on, deflated: they are more alike.
        """
        whole = [np.concatenate([part.ravel() for part in parts] or [np.zeros(0)]) for parts in self._parts.values()]
        if sum(part.nbytes for part in whole) <= PACKED:
            return b"".join(part.tobytes() for part in whole), False
        planes = (part.view(np.uint8).reshape(-1, part.itemsize).T.tobytes() for part in whole)
        return zlib.compress(b"".join(planes), 1), True
