"""Settings of the solver that tracks the branch of a mechanism."""

from msgspec import Struct


class TrackingSettings(Struct, frozen=True):
    """Settings of the tracking.

    Lengths "in strides" are relative to the initial distance between adjacent knots, see `Path.stride`.
    """

    # division of steps
    # uncertain steps around a change point of a dyad have at most this total length, as a number of finest steps
    dyad_change_width: int = 64
    general_change_width: int = 256  # the same for groups other than dyads, which have more round-off
    # [strides] finest step of groups other than dyads; in shorter steps, round-off hides the branch
    finest_general: float = 2.0**-24
    steps_per_block: int = (
        4096  # number of steps that are certified together, so that their arrays fit into the CPU cache
    )
    # if more steps than this would have to be halved at once, and more than there were initially, halving stops
    max_halved: int = 30_000
    limit_resolution: float = 2.0**-8  # [strides] accuracy to which a dyad's limit of motion is located
    # if the coordinate of a slider changes by more than this in a finest step, it goes to infinity there; relative to
    # the mechanism size
    max_jump: float = 1e-3

    # groups without closed-form solution, see `rigid.positions.trace`
    # [strides] distance from a change point at which the two branches through it can be distinguished
    branch_distance: float = 2.0**-16
    min_branch_distance: float = 2.0**-20  # the same if the uncertain steps around the change point are very short
    # largest deviation of a smooth branch from linear extrapolation, relative to its change in a step
    max_smooth_deviation: float = 0.1
    min_march_step: float = 2.0**-34  # [strides] shortest step of a march
    # a step of a march is certified at once if it is shorter than the last leap by at least this factor
    max_shortening: float = 8
    max_march_steps: int = 400  # maximum number of steps of a march
    max_hidden_sine: float = 2e-6  # if the sine is at most this, round-off may hide the branch
    # if the sines of earlier groups exceed this, the round-off of their positions is negligible
    min_clear_sine: float = 0.1
    min_knots: int = 8  # smallest number of grid knots with which links that turn with the drive are detected
    steps_to_double: int = 2  # a march doubles its step if more successive steps than this succeed
    max_corrections: int = 10  # maximum number of steps of Newton's method from a good guess
    # largest deviation of a leap from linear motion, relative to the change in the coordinates in the leap
    max_leap_deviation: float = 0.25
    # [strides] steps are halved down to this length in the first certification after a walk
    first_resolution: float = 2.0**-6
    min_difference: float = 1e-15  # [rad or m] two points on the path that are closer than this count as equal
    change_point_noise: float = 1e-9  # [rad or m] round-off of coordinates near a change point


TRACKING = TrackingSettings()
