"""Settings of the solver for the exact equations of links with large displacement."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ExactSettings:
    """Limits of the iteration. Relative values refer to the largest displacement unless stated otherwise.

    Attributes
    ----------
    max_steps, max_steps_with_friction
        Maximum number of steps of the equations that are linearized about the rigid motion.
    max_mixed
        Number of previous steps that are combined with the next one (Anderson mixing).
    max_growth
        The iteration ends if a residual exceeds the smallest one by this factor.
    patience, min_progress
        Newton's method takes over if `patience` steps do not reduce the residual to the fraction `min_progress`.
    max_ratio
        If the ratio of successive steps is larger, friction is hard.
    first_creep, creep_ratio
        Initial smoothing rate of hard friction / final rate (`creep_rate`), and factor by which each step divides it.
    max_first_steps, first_step_share, first_rest, first_resolved, first_enough
        Limits of the steps that estimate the effect of large displacement: maximum number, accepted remainder relative
        to the first step, its upper and lower limit, and size of a first step that needs no further steps.
    max_newton_steps
        Maximum number of Newton steps at one load level.
    newton_from
        Newton's method starts from the best of the linearized steps if its residual is below this value.
    max_newton_ratio, min_newton_reuse
        Ratio of successive steps above which Newton's method ends, and below which the operator is reused.
    min_fall, filtered_change, max_in_vain
        Newton's method ends after `max_in_vain` successive steps at full load that do not reduce the residual to the
        fraction `min_fall`, with a change below `filtered_change` times the residual. The coordinates cannot represent
        such a residual.
    newton_fastest
        Frequency limit for the inertia of the residual response, relative to the limit in the linearized steps.
    max_rough
        Residual / tolerance above which Newton's method starts again, with the interpolated residual of a coarser
        solution.
    balance, max_balances
        Tolerance of the section forces of rotated beams, relative to the largest force, and maximum number of
        iterations.
    first_load_share, min_load_step, load_step_growth
        Load steps: first step, smallest step, and growth after fast convergence.
    quick_steps
        Number of iterations that counts as fast convergence.
    part_tolerance
        Tolerance at partial loads.
    """

    max_steps: int = 30
    max_steps_with_friction: int = 50
    max_mixed: int = 5
    max_growth: float = 10.0
    patience: int = 6
    min_progress: float = 0.3
    max_ratio: float = 0.5
    first_creep: float = 100.0
    creep_ratio: float = 3.0
    max_first_steps: int = 8
    first_step_share: float = 0.1
    first_rest: float = 0.01
    first_resolved: float = 3e-4
    first_enough: float = 0.005
    max_newton_steps: int = 20
    newton_from: float = 0.3
    max_newton_ratio: float = 1.5
    min_newton_reuse: float = 0.2
    min_fall: float = 0.7
    filtered_change: float = 0.3
    max_in_vain: int = 2
    newton_fastest: float = 0.5
    max_rough: float = 3.0
    balance: float = 1e-3
    max_balances: int = 4
    first_load_share: float = 0.5
    min_load_step: float = 1 / 64
    load_step_growth: float = 1.5
    quick_steps: int = 4
    part_tolerance: float = 1e-2


SETTINGS = ExactSettings()
