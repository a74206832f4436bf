"""Errors of figures that are measured by the checks with another theory or with plane bodies."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from kinelast.figures.errors import BEAM_THEORY, BODIES, MEASURED, NOT_OF_MOTION, FigureError

SMALL = 0.1  # the ratio ignores beams with smaller estimated errors, relative to the largest


@dataclass(frozen=True)
class Measured:
    """Errors of figures measured by a check with another theory, in the units of the figures.

    Attributes
    ----------
    off, own
        Measured error of every item, and error of the check itself, by figure key; nan if unknown.
    """

    off: Mapping[str, Sequence[float]] = field(default_factory=dict)
    own: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def in_place(self, key: str, item: int, error: FigureError) -> FigureError:
        """Return an error in which the measured part replaces the estimates for the theory of motion.

        A known estimate is kept if the error of the check is at least as large as the estimate and the measured error.
        """
        if key not in self.off or math.isnan(self.off[key][item]):
            return error
        off, own, kept = self.off[key][item], self.own[key][item], NOT_OF_MOTION
        if not error.unknown and own >= max(off, error.without(kept).size):
            return error
        return FigureError({MEASURED: off + own, **{name: error.parts[name] for name in kept if name in error.parts}})


def with_bodies(
    errors: Mapping[str, Sequence[FigureError]], off: Sequence[float], whole: Sequence[float], check_error: float
) -> dict[str, list[FigureError]]:
    """Return the errors of figures in which the errors of beam theory are measured by plane bodies.

    The error of a chord deflection is the measured difference. For other figures, the estimate is multiplied by the
    largest ratio of measured to estimated error of any beam. A beam does not count in this ratio if the error of the
    check is larger than its estimate. The estimate is kept if a beam that counts has no body, or if no beam counts.

    Parameters
    ----------
    off, whole
        Difference of the largest chord deflection [m], and largest difference at any point and position [m], for each
        beam; nan for beams without a body.
    check_error
        Error of the check [m], which is included in `off` and `whole`.
    """
    stated = [abs(error.parts.get(BEAM_THEORY, 0.0)) for error in errors["chord"]]
    least = max(SMALL * max(stated, default=0.0), check_error)
    factor = max((apart / part for apart, part in zip(whole, stated, strict=True) if part > least), default=math.nan)
    if any(math.isnan(apart) for apart, part in zip(whole, stated, strict=True) if part > least):
        factor = math.nan

    def measured(key: str, item: int, error: FigureError) -> FigureError:
        size = off[item] if key == "chord" else factor * error.parts.get(BEAM_THEORY, math.nan)
        if math.isnan(size):
            return error
        others = {name: part for name, part in error.parts.items() if name != BEAM_THEORY}
        return replace(error, parts={**others, BODIES: size})

    return {key: [measured(key, item, each) for item, each in enumerate(rows)] for key, rows in errors.items()}
