"""The tables and keys of a scene file: what the answer is allowed to be."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, field

from kinelast.scene.format_motion import Table
from kinelast.scene.quantities import Allowance, Size

Factor = Annotated[float, Meta(gt=0)]


class LinkLimitsTable(Table, frozen=True, kw_only=True):
    """What one link is allowed."""

    deflection: Size | None = None
    chord: Size | None = None
    safety: Factor | None = None


class LimitsTable(Table, frozen=True, kw_only=True):
    """What the mechanism is allowed: every link, single links, and its output."""

    deflection: Size | None = None
    chord: Size | None = None
    safety: Factor | None = None
    output: Allowance | None = None
    links: dict[str, LinkLimitsTable] = field(default_factory=dict)
