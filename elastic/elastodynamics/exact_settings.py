"""Settings of the solver for the exact equations of displaced links."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ExactSettings:
    """Limits of the iteration; shares are relative to the largest displacement unless stated otherwise.

    Attributes
    ----------
    max_steps, max_steps_with_friction
        Maximum number of steps that are linearized about the rigid motion.
    max_mixed
        Number of earlier steps that are mixed into the next one.
    max_growth
        Growth, relative to the smallest step, that ends the iteration.
    patience, min_progress
        Newton's method takes over after `patience` steps without a reduction to the share `min_progress`.
    max_ratio
        A step larger than this share of the previous one indicates hard friction.
    first_creep, creep_ratio
        Initial smoothing rate of hard friction / friction's own (`creep_rate`), and its divisor in each step.
    max_first_steps, first_step_share, first_rest, first_resolved, first_enough
        First steps, which estimate the effect of large displacement: their number; accepted remainder relative to the
        first step; its upper and its lower limit; size of a first step that suffices.
    max_newton_steps
        Maximum number of Newton steps at one share of the loads.
    newton_from
        Newton's method starts from the best of the other steps if its remainder is below this share.
    max_newton_ratio, min_newton_reuse
        Growth of a Newton step that ends the method, and reduction below which the operator is reused.
    min_fall, filtered_change, max_in_vain
        Newton's method ends after `max_in_vain` successive steps at full load that reduce the residual to `min_fall` of
        the previous one at best, with a step below `filtered_change` of the residual: the coordinates cannot reduce the
        remainder.
    newton_fastest
        Frequency limit for inertia beyond the coordinates, relative to the limit of the other steps, which mix more.
    max_rough
        Remainder / tolerance above which Newton's method starts again, with the interpolated residual of a coarser
        answer.
    balance, max_balances
        Tolerance of the section forces of rotated beams, relative to the largest force, and maximum number of
        iterations.
    first_load_share, min_load_step, load_step_growth
        Load shares: first step, smallest step, and growth after fast convergence.
    quick_steps
        Number of steps that counts as fast convergence.
    part_tolerance
        Tolerance at a part of the loads.
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
