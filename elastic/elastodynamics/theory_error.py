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
LARGE = 50.0  # times the square of the greatest rotation: docs/elastodynamics.md says what it was measured on


@dataclass(frozen=True, eq=False)
class TheoryError:
    """Errors as shares of the largest chord deflection of every beam, shape (beams,); nan where nothing bends.

    Attributes
    ----------
    course
        Of the quasi-static answer, greatest at any instant and place.
    peak
        Of its largest value over the positions.
    large_displacement
        About what the elastodynamic answer leaves out of the links' large displacement: an estimate.
    """

    course: Reals
    peak: Reals
    large_displacement: float


def theory_error(found: Elastodynamic) -> TheoryError:
    """What vibration changes of the quasi-static answer: the difference of the two, computed."""
    plain, vibrating = (_chord(bent) for bent in (found.quasi_static, found.deflection))
    greatest = np.abs(vibrating).max(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        course = np.abs(vibrating - plain).max(axis=(1, 2)) / greatest
        peak = np.abs(np.abs(plain).max(axis=(1, 2)) / greatest - 1)
    rotation = np.abs(extremes(found.deflection, ["phi"])["phi"].value).max(initial=0.0)
    return TheoryError(course, peak, float(LARGE * rotation**2))


def _chord(bent: Deflection) -> Any:
    return sample(bent, "chord", np.linspace(0.0, 1.0, STATIONS))
