"""Settings of the vibration solver."""

from typing import Any

from msgspec import Struct


class VibrationSettings(Struct, frozen=True):
    """Settings for time elements, coordinates and corrections in the vibration solver."""

    # time elements and coordinates
    first_elements: int = 12  # initial number of time elements
    polynomials_per_beam: int = 4  # initial number of polynomials per beam
    mode_positions: int = 16  # number of positions in the cycle at which modes are computed
    max_mode_entries: int = 40_000_000  # maximum value of mode_positions * elastic coordinates * masses
    max_elements: int = 2048  # a grid with more time elements is not refined further
    # errors are measured with elements of half the length if there are at most this number of elements ...
    max_halved: int = 256
    max_halved_work: float = 1e6  # ... or if elements * coordinates^3 is at most this; it then takes a few seconds
    # assumed order of convergence in time, from which the number of elements of a finer grid is predicted
    order: int = 5
    refined_error: float = 0.2  # a grid is refined so that the predicted time error is this, relative to the tolerance
    # elements shorter than this are neither divided nor created at jumps; relative to the duration
    min_step: float = 1e-4
    # a break that is closer to the end than this replaces the end; relative to the duration
    min_break_distance: float = 1e-8
    max_parts: int = 4  # maximum number of parts into which an element is divided at once
    max_step_ratio: float = 2.0  # an element may be at most this many times as long as a divided element before it
    max_refinements: int = 6  # maximum number of discretizations that are tried, without Coulomb friction
    # maximum number of discretizations with Coulomb friction, for which more coordinates rarely help
    max_refinements_with_friction: int = 2
    max_entries: int = 16_000_000  # maximum value of 3 * nodes * masses * coordinates, see `array_size`
    finer_time: float = 20.0  # a refinement in time divides the tolerance of the time elements by this factor
    # cutoff frequency for the residual response (`ResidualResponse`), relative to the lowest natural frequency of the
    # omitted modes; it may exceed 1 because steps are mixed
    max_frequency_ratio: float = 2.0
    # if the iteration for friction ends with a convergence error of more than this times its tolerance, elements are
    # not divided
    max_residual_ratio: float = 10.0
    first_friction_tolerance: float = 1e-2  # tolerance of the iteration for friction on the first grid, which is coarse
    max_round_off: float = 1e-6  # time errors smaller than this may be round-off
    patience: int = 6  # if this number of refinements in succession do not halve such an error, it is round-off
    # tolerance of the iteration for friction on a grid that will be refined, relative to the time error
    friction_share: float = 0.1
    time_error_ratio: float = 4.0  # safety factor: the time error is this factor times its estimate by `Grid.tail`
    # a smaller growth of free vibrations per cycle is due to round-off and discretization
    max_neutral_growth: float = 1e-6
    # growth of free vibrations above which a run without cycle is unstable; a smaller growth may be due to the changing
    # posture, and has a small effect
    max_run_growth: float = 1e3

    # corrections of the coordinates
    max_corrections: int = 8  # maximum number of corrections
    max_correction_ratio: float = 0.5  # corrections end if one of them leaves more than this fraction of the error

    # large displacement
    residual_time_ratio: float = 4.0  # assumed ratio of the total time error to the time error of the coordinates
    # modes are added again only if the last addition left less than this fraction of the error
    max_widening_ratio: float = 0.7
    max_complete: int = 60  # if the iteration diverges, all modes are used, provided that there are at most this many
    # a grid that has already been refined is refined again only if its time error exceeds this multiple of the
    # tolerance
    min_refined_ratio: float = 10.0
    max_convergence_error: float = 0.1  # if the convergence error exceeds this, the iteration has diverged

    # modes and shapes

    # the lowest mode at each position is computed from this number of modes of the averaged mass matrix
    mean_modes: int = 8
    # at first, modes with frequencies up to this multiple of the lowest one are used
    initial_frequency_ratio: float = 8.0
    min_modes: int = 3  # smallest number of modes
    # bending under loads is represented this many times as accurately as bending due to the inertia of modes
    load_accuracy: float = 3.0
    # the same in finer discretizations; high, because axial shapes of slender beams are small compared with bending
    finer_load_accuracy: float = 90.0
    massless: float = 1e-13  # modes with 1/omega^2 below this count as massless, relative to the largest 1/omega^2

    # axial forces

    # weight of the unresolved part of axial forces, relative to the weight of displacements
    axial_weight: float = 0.005
    # the reference for errors in axial forces is at least this, relative to the largest bending moment divided by the
    # length of the longest beam
    min_axial_reference: float = 0.01

    def stable(self, growth: Any, cyclic: bool = True) -> Any:
        """Return whether free vibrations do not grow in a cycle or, if `cyclic` is false, grow little in a run."""
        return growth <= (1 + self.max_neutral_growth if cyclic else self.max_run_growth)


VIBRATION = VibrationSettings()
