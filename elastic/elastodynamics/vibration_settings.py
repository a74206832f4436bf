"""Settings of the vibration solver."""

from dataclasses import dataclass


@dataclass(frozen=True)
class VibrationSettings:
    """Settings of the vibration solver for time elements, coordinates and corrections."""

    # time elements and coordinates
    first_elements: int = 12  # initial number of time elements
    inner: int = 4  # number of polynomials per beam in the first discretization
    mode_positions: int = 16  # number of positions at which modes are computed
    # maximum number of mass displacements per coordinate at these positions; no coordinates are added beyond this
    max_mode_numbers: int = 40_000_000
    max_elements: int = 2048  # maximum number of time elements
    max_halved: int = 256  # maximum number of elements to halve to measure an error; with more, series estimate it
    order: int = 5  # lowest assumed order of convergence in time, for the length of the next elements
    refined_error: float = 0.2  # error that a refinement aims for, relative to the tolerance
    min_step: float = 1e-4  # shortest time element, relative to the duration
    min_break_distance: float = 1e-8  # a break closer to the end than this counts as the end; relative to the duration
    max_parts: int = 4  # maximum number of parts into which an element is divided at once
    max_step_ratio: float = 2.0  # largest ratio of an element's length to that of a shorter element before it
    max_refinements: int = 6  # maximum number of refinements of the coordinates
    max_refinements_with_friction: int = 2  # same with friction, for which more coordinates rarely help
    max_numbers: int = 16_000_000  # maximum size of the mass accelerations: half a GB with all derived arrays
    finer_time: float = 20.0  # divisor of the time tolerance if time limits the gain from finer coordinates
    # frequency limit for residual inertia, relative to the first omitted mode; mixing permits more than 1
    max_frequency_ratio: float = 2.0
    max_residual_ratio: float = 10.0  # largest residual / its tolerance that finer time elements can reduce
    first_friction_tolerance: float = 1e-2  # initial tolerance of friction, while time elements are coarse
    max_round_off: float = 1e-6  # time errors smaller than this may be round-off
    patience: int = 6  # number of refinements that do not halve such an error before round-off is assumed
    friction_share: float = 0.1  # tolerance of friction on a grid that will be refined, relative to the time error
    time_error_ratio: float = 4.0  # largest ratio of the true time error to the estimate from series
    max_neutral_growth: float = 1e-6  # largest growth per cycle that round-off and discretization explain

    # corrections of the coordinates
    max_corrections: int = 8  # maximum number of corrections
    # a correction must reduce the error to this share; otherwise more coordinates are cheaper
    max_correction_ratio: float = 0.5

    # large displacement
    residual_time_ratio: float = 4.0  # largest time error of the residual response, relative to that of the coordinates
    max_residual_fall: float = 0.7  # a basis is not widened again if widening left more than this share of the residual
    max_complete: int = 60  # if a subset of the coordinates does not converge, all are used if at most this many
    # a grid that was refined once is refined again if its time error exceeds this multiple of the tolerance
    min_refined_ratio: float = 10.0
    max_open_residual: float = 0.1  # larger residuals do not converge on finer grids; relative to the displacements

    # modes and shapes
    nearest_modes: int = 8  # number of mean modes that span the lowest mode of every position
    near_frequencies: float = 8.0  # modes up to this multiple of the lowest frequency get a coordinate
    min_modes: int = 3  # smallest number of modes
    load_accuracy: float = 3.0  # accuracy of the shapes of loads, relative to that of modes
    # same in finer discretizations, because axial shapes of slender beams are small compared with bending
    finer_load_accuracy: float = 90.0
    massless: float = 1e-13  # modes with less mass per stiffness count as massless; relative to the largest

    # axial forces
    axial_weight: float = 0.005  # weight of unresolved axial forces, relative to displacements
    # smallest reference for axial forces, relative to (largest moment / largest length)
    min_axial_reference: float = 0.01


VIBRATION = VibrationSettings()
