"""The error in a figure (result such as the largest deflection), divided by causes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

from msgspec import Struct, field

VIBRATION, LARGE = "vibration", "large displacement"
HIGHER_ORDERS, TIME, BEAM_THEORY, ROUND_OFF = "higher orders", "time and coordinates", "beam theory", "round-off"
BETWEEN, FREQUENCIES = "between the positions", "natural frequencies by beam theory"
WEB = "stress at the ends of the web"
MEASURED, BODIES = "motion, as measured", "beam theory, as measured"  # parts measured by checks
NOT_OF_MOTION = (BEAM_THEORY, FREQUENCIES, WEB, ROUND_OFF, BETWEEN)  # errors that all theories of motion have
BY_MOTION = (VIBRATION, LARGE)  # causes of signed errors: they are added first, then the magnitude of the sum is taken


class FigureError(Struct, frozen=True, dict=True):
    """The error in a figure, in the unit of the figure.

    Attributes
    ----------
    parts
        Errors by cause. The parts `BY_MOTION` are signed corrections. The figure plus these corrections is more
        accurate than the figure.
    unknown
        Reason why the total error is unknown; empty if it is known.
    """

    parts: Mapping[str, float] = field(default_factory=dict)
    unknown: str = ""

    @cached_property
    def size(self) -> float:
        """The total error: the sum of `terms`, or nan."""
        return math.nan if self.unknown else math.fsum(self.terms.values())

    @property
    def terms(self) -> dict[str, float]:
        """The terms by cause, which add up to the total error.

        If the sum of the signed parts `BY_MOTION` is negative, these parts are negated. All other terms are magnitudes.
        """
        lacks = math.fsum(self.parts.get(name, 0.0) for name in BY_MOTION)
        sign = -1.0 if lacks < 0.0 else 1.0
        return {name: sign * part if name in BY_MOTION else abs(part) for name, part in self.parts.items()}

    @cached_property
    def largest(self) -> str:
        """The cause of the largest part."""
        return max(self.parts, key=lambda name: abs(self.parts[name]), default="")

    @property
    def measured(self) -> bool:
        """Whether the largest part was measured by a check."""
        return self.largest in (MEASURED, BODIES)

    def without(self, names: Sequence[str]) -> FigureError:
        """Return the error without the parts of the given causes."""
        return FigureError({name: part for name, part in self.parts.items() if name not in names}, self.unknown)
