"""Settings of computations at many drive speeds."""

from msgspec import Struct


class SpeedSettings(Struct, frozen=True):
    """Settings of the map (full solutions), of the fast scan, and of the search for special speeds."""

    # map
    first_elements: int = 12  # initial number of time elements
    many: int = 8  # if a batch contains at most this number of speeds, errors are computed at every speed
    error_stride: int = 3  # with more speeds, errors are computed at every third speed, or even fewer
    max_errors: int = 16  # in a batch of more speeds, errors are computed at no more than this number of speeds
    loads_in_memory: int = 128  # maximum number of speeds in a batch, whose loads are in memory at the same time
    # tolerance of Newton's method in `SpeedSolutions.refine_errors`, relative to the largest displacement
    newton_tolerance: float = 0.1
    # if the tolerance exceeds the time error by this factor, the next speed starts with a coarser grid
    coarser_margin: float = 30.0
    harmonics: int = 6  # number of harmonics of the cycle that are compared with natural frequencies
    stability_step: float = 0.01  # step between speeds in `stable_below`, relative to the speed of the given motion
    min_stability_speed: float = 0.3  # lowest speed in `stable_below`, relative to the speed of the given motion

    # scan

    # modes with frequencies above this harmonic of the highest cycle frequency are quasi-static
    highest_harmonic: int = 16
    min_modes: int = 5  # smallest number of modes
    # if the frequency ratio of two neighbouring modes is smaller, both of them vibrate, or neither does
    min_mode_ratio: float = 1.3
    speeds_at_once: int = 12  # maximum number of speeds in a batch
    max_points: int = 50_000  # maximum value of the product speeds * grid points in a batch
    # number of inverse iterations that adapt the modes of the averaged mass matrix to each position
    inverse_iterations: int = 2
    point_stride: int = 2  # only every second point of the grid is used when largest values are determined
    # a harmonic coincides with a mode if their frequencies differ by less than this, relative to the cycle frequency
    max_resonance_distance: float = 0.3

    # search

    # peaks are ignored if they rise less above the line between neighbouring solutions, relative to this line
    min_visible_height: float = 0.01
    # peaks are ignored if they rise less above the higher one of their two valleys, relative to the peak
    min_rise: float = 0.01
    negligible: float = 1e-4  # values below this are ignored, relative to the largest value of all beams
    min_separation: float = 0.3  # a peak is ignored if it is closer to a higher peak, in half-widths of a peak
    # smallest distance between scanned speeds near a peak, in half-widths of the narrowest peak
    min_scan_step: float = 0.15
    max_scanned: int = 2000  # approximate maximum number of speeds in the initial scan
    max_drawn: int = 600  # maximum number of scanned speeds in a plotted curve
    max_refinements: int = 6  # maximum number of refinements in each search
    limit_accuracy: float = 1e-3  # relative accuracy of the speed at a stability limit, or at which a bound is exceeded
    # the scan is refined at minima of the decay rate that are below this, relative to its median
    max_decay_ratio: float = 0.6


SPEEDS = SpeedSettings()
