"""What a beam resists with."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigid import Reals


@dataclass(frozen=True, eq=False)
class Section:
    """Rigidities of a beam: EA [N] and EI [N m^2], infinite for a rigid one; shapes () or (designs, 1)."""

    EA: float | Reals = math.inf
    EI: float | Reals = math.inf


RIGID = Section()
