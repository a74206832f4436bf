"""Errors of an answer by the geometrically exact theory of motion, measured by another answer or by one more step.

Errors are mappings by cause, see `figure_error`: corrected answers, and errors relative to the largest displacement.
"""

from elastic.elastodynamics import (
    Elastodynamic,
    Vibration,
    finer_solution,
    finer_vibration,
    large_displacement_error,
    moved_to,
    with_one_more_step,
)
from kinelast.figures.bounds import BOUND_OVER_ERROR
from kinelast.figures.figure_error import HIGHER_ORDERS, LARGE, TIME

FORCES_LATER = 3.0  # bound on the ratio of force error to deflection error after the first steps to the exact answer
SHARED = 0.5  # a finer exact answer counts as converged if its error is below this share of that of the answer
STALLED = 3.0  # the iteration of an exact answer stalled if its last change / tolerance is larger
MAX_FINER_ERROR = 10.0  # a finer exact answer is not used if it converges worse than the answer by this factor
ERROR_OVER_CHANGE = 2.0  # ratio of the error due to large displacement to the last change in the iteration

Errors = tuple[dict[str, Elastodynamic], dict[str, float]]  # corrected answers, and relative errors


def estimated_errors_of_exact(exact: Elastodynamic) -> dict[str, float]:
    """Estimate the relative errors of an exact answer from its own convergence, without a finer answer."""
    discretized = (exact.time_error + exact.reduction_error) / BOUND_OVER_ERROR
    return {TIME: discretized, LARGE: ERROR_OVER_CHANGE * large_displacement_error(exact)}


def errors_by_coarser(exact: Elastodynamic) -> Errors:
    """Measure the errors of an exact answer by the answer in the previous, coarser discretization.

    The difference between both answers is about the error of the coarser answer, and thus an upper bound on the error
    of the finer answer. Without a coarser answer, the errors are estimated.
    """
    estimated = estimated_errors_of_exact(exact)
    if exact.coarser is None:
        return {}, estimated
    return {TIME: moved_to(exact.coarser, exact.quasi_static)}, {LARGE: estimated[LARGE]}


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
    if left > MAX_FINER_ERROR * max(tolerance, worst):
        return {}, estimated_errors_of_exact(exact)
    if left > max(tolerance, SHARED * worst):
        return {TIME: after}, {LARGE: ERROR_OVER_CHANGE * max(worst, left)}
    return {TIME: after}, {LARGE: left} if exact.exact.convergence_error > STALLED * tolerance else {}


def errors_by_one_more_step(stepped: Elastodynamic, left: dict[str, float]) -> Errors:
    """Measure the error after the first steps of the iteration to the exact answer by one more step.

    The effect of all further steps is estimated as (last change)^2 / previous change. If the changes do not decrease,
    no corrected answer is returned, and the errors are those in `left`.
    """
    after = with_one_more_step(stepped)
    before, change = (large_displacement_error(each) for each in (stepped, after))
    if not change < before:
        return {}, left
    shares = {name: share for name, share in left.items() if name != LARGE}
    return {LARGE: after}, {**shares, HIGHER_ORDERS: FORCES_LATER * change**2 / before}
