"""Settings of the answers at many speeds."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SpeedSettings:
    """Limits of the map of speeds, of its fast scan, and of the search for special speeds."""

    # map
    first_elements: int = 12  # initial number of time elements
    many: int = 8  # maximum number of speeds at which errors are computed at each
    error_stride: int = 3  # with more speeds, errors are computed at every third
    max_errors: int = 16  # most speeds of a batch with computed errors
    loads_in_memory: int = 128  # speeds with loads in memory
    # Newton's method settles to this share of the largest displacement when errors are sharpened
    newton_tolerance: float = 0.1
    # the next speed may use the coarser grid if the error is this much below the tolerance
    coarser_margin: float = 30.0
    harmonics: int = 6  # harmonics of the cycle compared with natural frequencies
    stability_step: float = 0.01  # step of the search for stability, relative to the speed
    min_stability_speed: float = 0.3  # lower end of the search for stability, relative to the speed

    # scan
    highest_harmonic: int = 16  # highest harmonic of the highest speed; modes above it follow quasi-statically
    min_modes: int = 5  # fewest modes
    min_mode_ratio: float = 1.3  # modes with a smaller frequency ratio stay together
    speeds_at_once: int = 12  # speeds in a batch
    max_points: int = 50_000  # most grid points in a batch
    inverse_iterations: int = 2  # inverse iterations from mean modes to modes of a position
    point_stride: int = 2  # every second point of the grid is evaluated for largest values
    # largest difference of a harmonic from a mode's mean frequency, relative to the cycle's frequency
    max_resonance_distance: float = 0.3

    # search
    min_visible_height: float = 0.01  # smallest height of a peak above the line between known speeds
    min_rise: float = 0.01  # smallest rise of a peak above its neighbouring valleys, relative to the peak
    negligible: float = 1e-4  # smaller peaks are ignored, relative to the largest of all links
    close: float = 0.3  # distance within which one answer suffices, in half widths of a peak
    min_scan_step: float = 0.15  # smallest step of the scan, in half widths of a peak
    max_scanned: int = 2000  # most speeds of the scan
    max_drawn: int = 600  # most speeds of a drawn curve
    max_refinements: int = 6  # most refinements
    border_accuracy: float = 1e-3  # relative accuracy of a border or limit speed
    max_decay_ratio: float = 0.6  # free vibrations with slower decay are examined closely, relative to the median


SPEEDS = SpeedSettings()
