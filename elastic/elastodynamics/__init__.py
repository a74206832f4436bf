"""Vibration of the moving links about the rigid motion: steady state, transients, and stability."""

from elastic.elastodynamics.discretization import worth_halving
from elastic.elastodynamics.exact_steps import has_dry_friction
from elastic.elastodynamics.geometrically_exact import (
    discretized_finer,
    finer_vibration,
    geometrically_exact,
    stepped_on,
    with_large_displacement,
)
from elastic.elastodynamics.natural_modes import NaturalModes, natural_modes
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.solution import Elastodynamic, deflection_at, moved_to
from elastic.elastodynamics.speed_map import SpeedAnswers, SpeedMap, critical_speeds, stable_below
from elastic.elastodynamics.speed_scan import Resonance
from elastic.elastodynamics.speed_search import Bounded, SpeedSearch, prominences
from elastic.elastodynamics.steady_state import elastodynamic
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.theory_error import TheoryError, large_displacement_error, theory_error
from elastic.elastodynamics.transient import transient
