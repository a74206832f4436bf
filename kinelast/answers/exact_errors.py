"""Errors of an answer by the geometrically exact theory of motion, measured by another answer or by more steps.

Errors are mappings by cause, see `figure_error`: corrected answers, and errors relative to the largest displacement.
"""

import math

from elastic.elastodynamics import (
    Elastodynamic,
    Vibration,
    finer_solution,
    finer_vibration,
    large_displacement_error,
    moved_to,
    with_one_more_step,
)
from kinelast.answers.theory_settings import THEORY
from kinelast.figures.figure_error import HIGHER_ORDERS, LARGE, TIME

Errors = tuple[dict[str, Elastodynamic], dict[str, float]]  # corrected answers (or a coarser one), and relative errors


def estimated_errors_of_exact(exact: Elastodynamic) -> dict[str, float]:
    """Estimate the relative errors of an exact answer from its own convergence, without another answer."""
    discretized = exact.discretization_error / THEORY.bound_over_error
    return {TIME: discretized, LARGE: THEORY.error_over_change * large_displacement_error(exact)}


def errors_by_coarser(exact: Elastodynamic) -> Errors:
    """Measure the errors of an exact answer by the answer in the previous, coarser discretization.

    The difference between both answers is about the error of the coarser answer, which is usually larger than that of
    `exact`. If the coarser answer does not have both fewer time elements and fewer coordinates, the errors are at least
    the estimated ones. Without a coarser answer, they are estimated.
    """
    estimated, coarser = estimated_errors_of_exact(exact), exact.coarser
    if coarser is None:
        return {}, estimated
    if coarser.elements < exact.elements and coarser.coordinates < exact.coordinates:
        del estimated[TIME]
    return {TIME: moved_to(coarser, exact.quasi_static)}, estimated


def errors_of_exact(
    exact: Elastodynamic, tolerance: float, finer: Vibration | None, begun: Elastodynamic | None = None
) -> Errors:
    """Measure the errors of an exact answer by a finer exact answer.

    The finer answer is not used if it converges much worse than the answer itself. If the iteration of the answer
    stalled, the last change in the iteration of the finer answer is an additional error.

    Parameters
    ----------
    tolerance
        Tolerance with which `exact` was solved.
    finer, begun
        Arguments `finer` and `guess` of `finer_solution`, if known.
    """
    assert exact.exact is not None
    begun = begun if finer else None
    finer = finer or finer_vibration(exact)
    after, left = finer_solution(exact, finer, exact.exact.finer_tolerance(tolerance), begun)
    worst = exact.exact.worst
    if left > THEORY.max_finer_error * max(tolerance, worst):
        return {}, estimated_errors_of_exact(exact)
    if left > max(tolerance, THEORY.max_converged_ratio * worst):
        return {TIME: after}, {LARGE: THEORY.error_over_change * max(worst, left)}
    return {TIME: after}, {LARGE: left} if exact.exact.convergence_error > THEORY.stalled * tolerance else {}


def errors_by_more_steps(stepped: Elastodynamic, left: dict[str, float]) -> Errors:
    """Measure the error after the first steps of the iteration to the exact answer by one or two more steps.

    The effect of all further steps is estimated as (last change)^2 / previous change. A second step is taken if this
    effect is large compared with the first change. If the last change is not smaller than the one before, no corrected
    answer is returned, and the errors are those in `left`.
    """
    now, before, later, first = stepped, large_displacement_error(stepped), math.inf, 0.0
    for _ in range(THEORY.max_more_steps):
        now = with_one_more_step(now)
        change = large_displacement_error(now)
        later = THEORY.forces_later * change**2 / before if change < before else math.inf
        before, first = change, first or change
        if later <= THEORY.max_later_ratio * first:
            break
    if later == math.inf:
        return {}, left
    shares = {name: share for name, share in left.items() if name != LARGE}
    return {LARGE: now}, {**shares, HIGHER_ORDERS: later}
