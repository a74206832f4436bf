"""Settings of the solver of the exact equations of displaced links."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ExactSettings:
    """Bounds of the steps towards the exact answer; shares are of the largest displacement unless they say otherwise.

    Attributes
    ----------
    max_steps, max_steps_with_friction
        Steps about the rigid motion.
    max_mixed
        Earlier steps that are mixed into the next one.
    max_growth
        A step this many times as large as the smallest one ends the steps.
    patience, min_progress
        So many steps must reduce what is left to this share of it, or Newton's method takes over.
    max_ratio
        A step that changes more than this share of the last step's change finds hard friction.
    first_creep, creep_ratio
        Hard friction begins with this many times its creep, and each step divides it by the ratio.
    max_first_steps, first_step_share, first_resolved, first_enough
        Steps that tell what a linear answer leaves out: how many, what they may leave open as a share of the first one
        and in all, and a first step that needs no other.
    max_newton_steps
        Of Newton's method at one share of the loads.
    newton_from
        Newton's method begins with the best of the other steps if these leave less open than this share.
    max_newton_ratio, min_newton_reuse
        A step this many times as large as the one before ends the method; one below the other ratio keeps the operator.
    newton_fastest
        Share of the angular frequency up to which the other steps take inertia beside the coordinates: they mix more.
    balance, max_balances
        Share of the largest force to which section forces of turned beams are in balance; rounds to get there.
    first_load_share, min_load_step, load_step_growth
        Shares of the loads: the first step, the smallest one, and the growth after a share that is settled quickly.
    quick_steps
        So few steps settle a share quickly.
    part_tolerance
        A part of the loads is settled to this share.
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
    first_step_share: float = 0.03
    first_resolved: float = 3e-4
    first_enough: float = 0.005
    max_newton_steps: int = 20
    newton_from: float = 0.3
    max_newton_ratio: float = 1.5
    min_newton_reuse: float = 0.2
    newton_fastest: float = 0.5
    balance: float = 1e-3
    max_balances: int = 4
    first_load_share: float = 0.5
    min_load_step: float = 1 / 64
    load_step_growth: float = 1.5
    quick_steps: int = 4
    part_tolerance: float = 1e-2


SETTINGS = ExactSettings()
