"""Loads, energy and friction in a motion, and the joint forces that are in equilibrium with the loads."""

from rigid.kinetostatics.friction import (
    MAX_FLANK_ROUNDS,
    creep_rate,
    forces_with_friction,
    friction_joints,
    friction_per_rate,
    friction_power,
    sliding_directions,
    sliding_rate,
)
from rigid.kinetostatics.loads import beam_couples, beam_directions, beam_loads, link_loads, point_loads
from rigid.kinetostatics.springs import dissipated_power, kinetic_energy, load_power, potential_energy
from rigid.kinetostatics.statics import balancing_forces, force_condition
