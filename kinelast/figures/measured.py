"""Errors in figures (results such as the largest deflection), as measured by the two checks by other methods.

One check uses nonlinear finite elements, the other models links as plane bodies.
"""

import math
from collections.abc import Mapping, Sequence

from msgspec import Struct, field
from msgspec.structs import replace

from kinelast.figures.figure_error import BEAM_THEORY, BODIES, MEASURED, NOT_OF_MOTION, FigureError

SMALL = 0.1  # beams with a smaller estimated error, relative to the largest estimated error, are ignored


class Measured(Struct, frozen=True):
    """Errors in figures as measured by the nonlinear check, in the units of the figures.

    Attributes
    ----------
    off, own
        Measured error for every item, and error of the check itself for every item, by figure key; nan if unknown.
    """

    off: Mapping[str, Sequence[float]] = field(default_factory=dict)
    own: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def in_place(self, key: str, item: int, error: FigureError) -> FigureError:
        """Return an error. The measured error replaces its estimated parts due to the theory of motion.

        The estimated parts are kept if the check is too inaccurate. This is the case if its own error is at least as
        large as both the estimated and the measured error.
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
    """Return errors. Parts measured with plane bodies replace the estimated parts due to beam theory.

    For a chord deflection, the new part is the measured difference. For other figures, the estimated part is multiplied
    by the largest ratio of measured error to estimated error of any beam. Beams with a small estimated error, compared
    with that of other beams or with the error of the check, are not considered. The estimated parts are kept if a
    considered beam has no plane body, or if no beam is considered.

    Parameters
    ----------
    off, whole
        For each beam: difference in the largest chord deflection [m], and largest difference in the chord deflection at
        any point and position [m]. They are nan for beams without a plane body.
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
