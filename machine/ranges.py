"""Ranges in which the sizing formulas apply."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid.arrays import Flags


@dataclass(frozen=True)
class Range:
    """Range of validity of a sizing formula, in terms of one quantity.

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
        Consequence or advice if the quantity is outside the range, phrased as the end of a sentence.
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
        """Bounds in words, such as "0.15 to 0.75" or "at least 1"."""
        if np.isinf(self.most):
            return f"at least {self.least:g}"
        return f"at most {self.most:g}" if np.isinf(self.least) else f"{self.least:g} to {self.most:g}"

    @property
    def condition(self) -> str:
        """Range as a clause without its source: "the S-N line holds if the number of runs is at least 10000"."""
        return f"the {self.formula} holds if the {self.quantity} is {self.bounds}"

    @property
    def words(self) -> str:
        """Range as a clause with its source in parentheses."""
        return f"{self.condition} ({self.source})"
