"""Advice on how to reduce or measure the error in a figure (a result such as the largest deflection).

The advice names only options that work for the scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kinelast.answers.checks import POSITIONS, nonlinear_refusal
from kinelast.answers.theory_settings import THEORY
from kinelast.figures import figure_error
from kinelast.figures.figure_error import FigureError
from kinelast.scene.data import GEOMETRICALLY_EXACT
from kinelast.values.numbers import percent

if TYPE_CHECKING:
    from kinelast.answers.answer import Answer
    from kinelast.answers.results import Results

MIN_ACCURACY = 1e-4  # smallest `accuracy` that a message suggests
PRESSED = 0.2  # above this ratio of load to critical load, axial forces are named beside vibration
MEASURE = "Run with --check solid to measure the error of beam theory"
REMEDIES = {figure_error.FREQUENCIES: "no option reduces", figure_error.WEB: "a thicker web reduces"}
EXCEEDANCES = {"buckling": "Make it thicker or shorter", "yield": "Make it thicker, or of a stronger material"}
"""Advice by kind of exceeded limit of the theory."""


def nearer(results: Results, error: FigureError, value: float, share: float) -> str:
    """Return advice on how to reduce the error in a figure to the fraction `share` of `value`, or an empty string.

    The advice names the largest part of the error, and an option that reduces this part and works for the scene.
    """
    answer, largest = results.answer, error.largest
    if largest == figure_error.BEAM_THEORY:
        parts = [abs(own.parts.get(figure_error.BEAM_THEORY, 0.0)) for own in results.errors.get("chord", ())]
        measurable = not parts or _solid_would_measure(results, int(np.argmax(parts)))
        return f"mostly {largest}: --check solid would measure it" if measurable else ""
    if answer is None or largest in (figure_error.ROUND_OFF, figure_error.BODIES) or share <= 0.0:
        return ""
    if largest == figure_error.BETWEEN:
        more = max(POSITIONS, 4 * len(results.motion.time))
        return f"mostly {largest}: --positions {more} would reduce it"
    if largest in REMEDIES:
        return f"mostly {largest}, which {REMEDIES[largest]}"
    if results.scene.theory.plain:
        return f"mostly {_neglected(results, largest)}: without the quasi-static theory the error would be small"
    theory, shares = results.scene.theory, {cause: abs(part / (value or 1.0)) for cause, part in error.parts.items()}
    aim = (share - sum(shares.get(cause, 0.0) for cause in figure_error.NOT_OF_MOTION)) / 2
    if shares.get(figure_error.TIME):
        # this part is proportional to the tolerance of the solver, and so to the accuracy
        now = THEORY.max_named_tolerance / THEORY.tolerance_ratio if theory.name else answer.requested.wanted
        aim = min(aim, now * aim / shares[figure_error.TIME])
    return f"mostly {largest}{_by_a_finer_theory(results, answer, aim)}"


def _neglected(results: Results, largest: str) -> str:
    """Return the name of the largest effect that quasi-statics neglects.

    Near the critical load, axial forces increase deflections even without vibration.
    """
    pressed = float(np.nan_to_num(results.cycle.buckling_ratio.value).max(initial=0.0)) > PRESSED
    return f"{largest} and axial forces" if pressed and largest == figure_error.VIBRATION else largest


def _by_a_finer_theory(results: Results, answer: Answer, aim: float) -> str:
    """Return advice on an error due to the theory of motion.

    The advice suggests a smaller value of the option `accuracy` only if the main figures reach the present value.
    """
    reached = max((each.share_by_motion for each in results.main_figures), default=0.0)
    finer = answer.theory == GEOMETRICALLY_EXACT or answer.finer
    if finer and aim > 0.0 and max(aim, reached) <= answer.requested.wanted:
        aim = max(aim, MIN_ACCURACY)
        return f': accuracy = "{percent(aim)}" would suffice'
    if not results.nonlinear and not nonlinear_refusal(results) and not _too_long(results):
        return ": --check nonlinear would measure it"
    return ", which a finer computation cannot reduce; stiffer links or more damping would"


def exceedance_advice(results: Results, kind: str, beam: int) -> str:
    """Return advice for a beam that exceeds a limit of the theory, or an empty string."""
    if kind == "slenderness":
        return MEASURE if _solid_would_measure(results, beam) else ""
    return EXCEEDANCES.get(kind, "")


def _solid_would_measure(results: Results, beam: int) -> bool:
    """Return whether the check with plane bodies would measure the error of beam theory for a beam.

    It would not if this check has been run already, if the run is too long, or if a section of the link is hollow.
    Rarer obstacles, such as overlapping beams, are found only by the check itself.
    """
    link, beams = results.mechanism.beams[beam][0], results.mechanism.beams
    hollow = any(
        section.thin_walled for (at, _), section in zip(beams, results.scene.sections, strict=True) if at == link
    )
    return not results.solid and not _too_long(results) and not hollow


def _too_long(results: Results) -> bool:
    """Return whether the run is too long for the checks. Memory then holds the deflection at some positions only."""
    return results.figures.positions > len(results.motion.time)
