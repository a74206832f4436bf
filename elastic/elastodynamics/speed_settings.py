"""Settings of the solutions at many speeds."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SpeedSettings:
    """Settings of the speed map, of the fast scan, and of the search for special speeds."""

    # map
    first_elements: int = 12  # initial number of time elements
    many: int = 8  # maximum number of speeds for which errors are computed at each
    error_stride: int = 3  # with more speeds, errors are computed at every third
    max_errors: int = 16  # maximum number of speeds with computed errors in a batch
    loads_in_memory: int = 128  # number of speeds with loads in memory
    # Newton's method converges to this share of the largest displacement when errors are sharpened
    newton_tolerance: float = 0.1
    # the next speed tries a coarser grid if tolerance / error exceeds this
    coarser_margin: float = 30.0
    harmonics: int = 6  # number of harmonics of the cycle that are compared with natural frequencies
    stability_step: float = 0.01  # step of the search for stability, relative to the speed
    min_stability_speed: float = 0.3  # lower end of the search for stability, relative to the speed

    # scan
    highest_harmonic: int = 16  # modes above this harmonic at the highest speed are treated quasi-statically
    min_modes: int = 5  # smallest number of modes
    min_mode_ratio: float = 1.3  # neighbouring modes with a smaller frequency ratio are not separated
    speeds_at_once: int = 12  # number of speeds in a batch
    max_points: int = 50_000  # maximum number of grid points in a batch
    inverse_iterations: int = 2  # number of inverse iterations from mean modes to modes of a position
    point_stride: int = 2  # largest values are searched at every second point of the grid
    # largest difference between a harmonic and the mean frequency of a mode in resonance, in cycle frequencies
    max_resonance_distance: float = 0.3

    # search
    min_visible_height: float = 0.01  # smallest height of a peak above the line between known speeds
    min_rise: float = 0.01  # smallest rise of a peak above its neighbouring valleys, relative to the peak
    negligible: float = 1e-4  # peaks smaller than this are ignored; relative to the largest of all links
    close: float = 0.3  # peaks closer than this share one solution, in half-widths of a peak
    min_scan_step: float = 0.15  # smallest step of the scan, in half-widths of a peak
    max_scanned: int = 2000  # maximum number of speeds in the scan
    max_drawn: int = 600  # maximum number of speeds of a plotted curve
    max_refinements: int = 6  # maximum number of refinements
    border_accuracy: float = 1e-3  # relative accuracy of a stability limit or limit speed
    max_decay_ratio: float = 0.6  # vibrations that decay more slowly, relative to the median, are examined closely


SPEEDS = SpeedSettings()
