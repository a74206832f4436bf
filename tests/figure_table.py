"""Figures of many designs by formula, with the interface that the modules on designs expect."""

from dataclasses import dataclass, field


@dataclass
class Table:
    columns: dict
    place: dict = field(default_factory=dict)
