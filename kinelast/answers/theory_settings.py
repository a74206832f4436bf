"""Settings for the choice of the theory of motion, the accuracy of its solver, and the measurement of its errors."""

from msgspec import Struct


class TheorySettings(Struct, frozen=True):
    """Settings for the choice of the theory of motion.

    Tolerances of the solver are relative to the largest displacement. All ratios and bounds are relative to the
    accuracy unless stated otherwise.
    """

    # tolerance of the solver
    tolerance_ratio: float = 0.05  # if the user requests an accuracy or a theory, or sets limits
    default_tolerance_ratio: float = 0.1  # in all other scenes without friction
    friction_tolerance_ratio: float = 0.02  # with friction; small enough to show whether vibration has settled
    exact_tolerance_ratio: float = 0.02  # of geometrically exact answers, if this theory is not requested
    # largest tolerance if a theory is requested by name, not relative to the accuracy. If no theory is requested, and
    # the tolerance would be smaller, the aim is relaxed to other errors than that of the solver.
    max_named_tolerance: float = 1e-4
    # smallest tolerance if no theory is requested, not relative to the accuracy; smaller ones may not converge
    min_tolerance: float = 1e-6

    # bounds that replace measurements of errors
    max_discretization_bound: float = 0.5  # largest bound on the discretization error
    max_theory_bound: float = 0.05  # the same for vibration and large displacement
    limits_factor: float = 0.2  # factor on both bounds if results are compared with limits, and in speed maps
    max_requested_bound: float = 1e-4  # largest bound if the user requests an accuracy, not relative to the accuracy
    # below these bounds, the discretization error is not measured, even if `max_requested_bound` is smaller
    negligible_bound: float = 0.02  # of a linear vibration
    negligible_bound_of_steps: float = 0.01  # after the first steps to the exact answer
    bound_over_error: float = 4.0  # ratio of the bound on the discretization error to the usual discretization error
    # [1/rad] ratios of the bounds on the effect of large displacement to the largest rotation of a section. The second
    # is that for forces, relative to the largest force in the same member.
    bound_per_rotation: float = 2.0
    force_bound_per_rotation: float = 20.0

    # choice of the theory
    max_neglected_change: float = 3.0  # largest change in the largest deflection by vibration that may be neglected
    max_last_change: float = 0.25  # largest last change of the first steps to the exact answer if their result is used
    max_rotation: float = 4.0  # [rad] vibration is not computed if a section rotates by more

    # errors of geometrically exact answers
    # largest value of elements * coordinates^2 for which a finer answer is computed, which then takes about a minute
    max_finer_work: float = 60_000
    # a finer answer is not computed if the error of the iteration exceeds this, which is not relative to the accuracy
    max_unconverged: float = 0.1
    # a finer answer has converged if the error of its iteration is below this fraction of that of the answer
    max_converged_ratio: float = 0.5
    max_finer_error: float = 10.0  # a finer answer is not used if it converges worse than the answer by this factor
    stalled: float = 3.0  # the iteration stalled if its convergence error exceeds the tolerance by this factor
    error_over_change: float = 2.0  # ratio of the error due to large displacement to the last change in the iteration
    forces_later: float = 3.0  # bound on force error / deflection error after the first steps to the exact answer
    # steps that measure the error after the first steps: their maximum number, and the largest estimated effect of
    # further steps, relative to the change in the first of these steps
    max_more_steps: int = 2
    max_later_ratio: float = 0.5

    # machines at rest
    max_rest_change: float = 1e-9  # largest relative change in bending moments over time, due to round-off
    max_rest_travel: float = 1e-5  # [rad or m] largest travel of a drive
    max_change_per_travel: float = 10.0  # [1/rad or 1/m] largest relative change in bending moments per travel

    # messages about progress
    stages: int = 5  # number of stages
    exact_over_first_steps: float = 40.0  # estimated computing time of an exact answer / that of the first steps
    long: float = 10.0  # [s] the user is informed if the expected computing time is longer


THEORY = TheorySettings()
