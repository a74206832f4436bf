"""Selection of designs in mechanisms, links, loads or sections."""

from collections.abc import Mapping
from operator import is_
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from rigid.mechanism import Mechanism

PLAIN = (str, float, complex, int, type(None))


def select_designs(value: Any, rows: Any, designs: tuple[int, ...]) -> Any:
    """Return a mechanism, link, load or section that contains only selected designs.

    In `value`, the designs are selected from every array of the shape `designs`. `rows` is a slice or an array of
    design indices, in which an index may occur several times.
    """
    if not designs or (isinstance(rows, slice) and rows == slice(0, designs[0])):
        return value
    return _cut(value, rows, designs)


def _cut(value: Any, rows: Any, designs: tuple[int, ...]) -> Any:
    if isinstance(value, PLAIN):  # tested first, because it is the most frequent case
        return value
    if isinstance(value, np.ndarray):
        return value[rows] if value.shape == designs else value
    if isinstance(value, tuple):
        parts: Any = tuple(_cut(part, rows, designs) for part in value)
        return value if all(map(is_, parts, value)) else parts
    if isinstance(value, Mapping):
        parts = {key: _cut(part, rows, designs) for key, part in value.items()}
        return value if all(map(is_, parts.values(), value.values())) else parts
    if not isinstance(value, Struct):
        return value
    changed = {}
    for name in value.__struct_fields__:
        if (part := _cut(own := getattr(value, name), rows, designs)) is not own:
            changed[name] = part
    return replace(value, **changed) if changed else value


def designs_of_lengths(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the broadcast shape of all dimensions of a mechanism: () or (designs, 1)."""
    values = [place for link in mechanism.links for place in link.points.values()]
    values += [value for part in mechanism.fixed_angles for value in part.lengths]
    values += mechanism.drawing.values()
    return np.broadcast_shapes(*(np.shape(value) for value in values))
