"""Figures of many designs as the modules on designs ask for them, for figures that are formulas."""

from dataclasses import dataclass, field


@dataclass
class Table:
    columns: dict
    place: dict = field(default_factory=dict)
