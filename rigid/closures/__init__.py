"""The linear problem of each placed group for displacements and forces, and its condition number."""

from rigid.closures.conditioning import cancellation_factor, greatest_rotation, has_no_result
from rigid.closures.displacements import displacements
from rigid.closures.forces import MAX_UNSTRESSED, joint_forces, loaded_flanks, self_stresses
from rigid.closures.gears import gear_input, gear_loads, rack_arm
