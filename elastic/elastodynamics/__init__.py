"""Vibration of elastic links about the motion of rigid links: steady state, transients, and stability."""

from elastic.elastodynamics.discretization import worth_halving
from elastic.elastodynamics.exact_steps import has_dry_friction
from elastic.elastodynamics.geometrically_exact import (
    finer_solution,
    finer_vibration,
    geometrically_exact,
    with_large_displacement,
    with_one_more_step,
)
from elastic.elastodynamics.large_displacement import large_displacement_error
from elastic.elastodynamics.natural_modes import NaturalModes, natural_modes
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.solution import Elastodynamic, deflection_at, elastodynamic, including, moved_to
from elastic.elastodynamics.speed_map import SpeedMap, SpeedSolutions, critical_speeds, stable_below
from elastic.elastodynamics.speed_scan import Resonance
from elastic.elastodynamics.speed_search import BoundUtilisation, SpeedSearch, prominences
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.transient import transient
