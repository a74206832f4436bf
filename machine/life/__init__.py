"""Life of links under stresses that change over the cycle: endurance, S-N line, rainflow, Miner's sum."""

from machine.life.damage import cycles_of, damage
from machine.life.endurance import (
    CYCLES_RANGE,
    SIZE_RANGE,
    SURFACE_RANGE,
    SURFACES,
    YIELD_RANGE,
    FatigueStrength,
    effective_diameter,
    endurance_safety,
    equivalent_amplitude,
    reliability_factor,
    size_factor,
    surface_factor,
)
from machine.life.stresses import Fatigue, FatigueTask, fatigue
