"""Some of the designs of whatever has parameters of several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np


def of_designs(value: Any, rows: Any, designs: tuple[int, ...]) -> Any:
    """The same mechanism, link, load or section for some of its designs: every array of their shape is cut.

    `rows` is a slice, or an array of numbers that may repeat.
    """
    if not designs or (isinstance(rows, slice) and rows == slice(0, designs[0])):
        return value
    if isinstance(value, np.ndarray):
        return value[rows] if value.shape == designs else value
    if isinstance(value, tuple):
        parts: Any = tuple(of_designs(part, rows, designs) for part in value)
        return value if all(one is other for one, other in zip(parts, value, strict=True)) else parts
    if isinstance(value, Mapping):
        parts = {key: of_designs(part, rows, designs) for key, part in value.items()}
        return value if all(parts[key] is value[key] for key in parts) else parts
    if not is_dataclass(value) or isinstance(value, type):
        return value
    owned = {each.name: getattr(value, each.name) for each in fields(value) if each.init}
    cut = {name: of_designs(part, rows, designs) for name, part in owned.items()}
    return replace(value, **cut) if any(cut[name] is not owned[name] for name in owned) else value
