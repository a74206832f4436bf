"""How far the quasi-static answer is from that of the vibrating links, and what large displacement leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.elastodynamics.solution import Elastodynamic
from elastic.extreme_values import extremes
from elastic.sampling import sample
from elastic.solution import Deflection
from rigid import Reals

STATIONS = 21
UNBENT = 0.01  # of the largest deflection of all beams, below which one of them counts as bent by so much
LARGE = 50.0  # times the square of the greatest rotation: docs/elastodynamics.md says what it was measured on


@dataclass(frozen=True, eq=False)
class TheoryError:
    """Errors as shares of the largest chord deflection of every beam, shape (beams,); nan where nothing is known.

    Attributes
    ----------
    history
        Of the quasi-static answer, greatest at any instant and place.
    peak
        Of its largest value over the positions.
    large_displacement
        About what the elastodynamic answer leaves out of the links' large displacement: an estimate.
    """

    history: Reals
    peak: Reals
    large_displacement: float


def theory_error(found: Elastodynamic) -> TheoryError:
    """What vibration changes of the quasi-static answer: the difference of the two, computed."""
    plain, vibrating = (_chord(bent) for bent in (found.quasi_static, found.deflection))
    greatest = np.abs(vibrating).max(axis=(1, 2))
    greatest = share_base(greatest)
    with np.errstate(invalid="ignore", divide="ignore"):
        history = np.abs(vibrating - plain).max(axis=(1, 2)) / greatest
        peak = np.abs(np.abs(plain).max(axis=(1, 2)) / greatest - 1)
    return TheoryError(history, peak, large_displacement_error(found.deflection))


def share_base(largest: Any) -> Any:
    """What errors of beams are shares of: the largest deflection of each, or what counts as that, shape (beams,)."""
    return np.maximum(largest, UNBENT * largest.max(initial=0.0))


def large_displacement_error(bent: Deflection) -> float:
    """About what linear theory leaves out of the links' large displacement, as a share of the largest deflection."""
    rotation = np.abs(extremes(bent, ["phi"])["phi"].value)
    return float(LARGE * rotation[np.isfinite(rotation)].max(initial=0.0) ** 2)


def _chord(bent: Deflection) -> Any:
    return sample(bent, "chord", np.linspace(0.0, 1.0, STATIONS))
