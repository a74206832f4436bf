"""Ranges of validity of the sizing formulas."""

from typing import Any

import numpy as np
from msgspec import Struct

from rigid.arrays import Flags


class Range(Struct, frozen=True):
    """Range of values of one quantity in which a sizing formula is valid.

    Attributes
    ----------
    formula
        Name of the formula's result, such as "life of a rolling bearing".
    quantity
        Name of the quantity that is checked.
    source
        Standard or book that states the range.
    least, most
        Bounds of the quantity, both inclusive.
    outside
        Consequence or advice if the quantity is outside the range, such as "the pin yields".
    """

    formula: str
    quantity: str
    source: str
    least: float = -np.inf
    most: float = np.inf
    outside: str = ""

    def holds(self, value: Any) -> Flags:
        """Return whether values are inside the range. Unknown values (nan) count as inside."""
        return ~np.less(value, self.least) & ~np.greater(value, self.most)

    @property
    def bounds(self) -> str:
        """Text of the bounds, such as "0.15 to 0.75" or "at least 1"."""
        if np.isinf(self.most):
            return f"at least {self.least:g}"
        return f"at most {self.most:g}" if np.isinf(self.least) else f"{self.least:g} to {self.most:g}"

    @property
    def condition(self) -> str:
        """Statement of the range without its source: "the S-N line holds if the number of runs is at least 10000"."""
        return f"the {self.formula} holds if the {self.quantity} is {self.bounds}"

    @property
    def words(self) -> str:
        """Statement of the range, followed by the source of the range in parentheses."""
        return f"{self.condition} ({self.source})"
