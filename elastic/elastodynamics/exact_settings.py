"""Settings of the solver for the exact equations of links with large displacement."""

from msgspec import Struct


class ExactSettings(Struct, frozen=True):
    """Settings of the iteration.

    Changes, residuals, convergence errors and tolerances are relative to the largest displacement.
    """

    # all steps, also those of Newton's method
    max_mixed: int = 5  # maximum number of previous steps that are combined with the last step (Anderson mixing)
    # the iteration ends if the convergence error exceeds the smallest so far by this factor; not with stiff friction
    max_growth: float = 10.0
    # the iteration ends if `patience` steps leave more than the fraction `min_progress` of the convergence error
    patience: int = 6
    min_progress: float = 0.3

    # steps with equations that are linearized about the rigid motion
    max_steps: int = 30  # maximum number of steps
    max_steps_with_friction: int = 50  # maximum number of steps with Coulomb friction
    # friction is stiff if the change in a step exceeds this multiple of the change in the step before
    max_ratio: float = 0.5
    # initial creep rate, relative to the final one; at sliding rates below the creep rate, friction is about viscous
    first_creep: float = 100.0
    creep_ratio: float = 3.0  # each step divides the creep rate by this factor, until it has its final value

    # steps that estimate the effect of large displacement
    max_first_steps: int = 8  # maximum number of steps
    # The steps end when the convergence error is below a limit. The limit is `first_step_share` times the convergence
    # error of the first step, but at most `max_first_remainder` and at least `min_first_remainder`.
    first_step_share: float = 0.1
    max_first_remainder: float = 0.01
    min_first_remainder: float = 3e-4
    # a second step is not taken if the convergence error of the first step is below this
    negligible_first_step: float = 0.005

    # Newton's method
    max_newton_steps: int = 20  # maximum number of steps at one load level
    # largest convergence error with which the method starts at full load, or accepts the final load step
    newton_from: float = 0.3
    # Only the coordinates are corrected if two ratios are large: first, the part of the residual that the coordinates
    # represent, relative to the other part; second, the response of the coordinates to the inertia of a corrected
    # residual response, relative to the part that they represent.
    max_represented_ratio: float = 3.0
    max_disturbance: float = 0.1
    # the operator (tangent equations) is reused if a step leaves at most this fraction of the residual
    max_reuse_ratio: float = 0.2
    # A step at full load has stalled in two cases. First, the residual is more than `stall_ratio` times the residual
    # before the step, and the change in the step is below `filtered_change` times the residual; the coordinates cannot
    # represent such a residual. Second, each error above the tolerance has changed by less than the fraction
    # `stalled_change`; steps that correct only the coordinates are then not counted, because the next step may reduce
    # the errors. The method ends after `max_stalled` stalled steps in succession.
    stall_ratio: float = 0.7
    filtered_change: float = 0.3
    stalled_change: float = 0.1
    max_stalled: int = 2
    # cutoff frequency for the residual response (`ResidualResponse`), relative to that in linearized steps
    newton_cutoff_ratio: float = 0.5
    # When the method starts from a solution on a coarser grid, it first ignores the residual response of that solution.
    # If the resulting convergence error exceeds this multiple of the tolerance, it starts again with the interpolated
    # residual response.
    max_restart_ratio: float = 10.0
    # The iteration for the section forces of rotated beams ends when they change by less than a limit, relative to the
    # largest. The limit is this fraction of the tolerance. Larger changes would act as noise in the residual.
    force_tolerance_ratio: float = 0.1
    max_force_iterations: int = 10  # maximum number of iterations for the section forces

    # load steps of Newton's method, as fractions of the loads of the rigid motion
    first_load_share: float = 0.5  # first load step
    min_load_step: float = 1 / 64  # the method fails if a smaller load step is necessary
    load_step_growth: float = 1.5  # the load step is multiplied by this after fast convergence
    quick_steps: int = 4  # convergence is fast if it takes at most this number of Newton steps
    partial_load_tolerance: float = 1e-2  # largest accepted change in the last step at partial loads


EXACT = ExactSettings()
