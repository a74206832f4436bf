"""Fatigue life of links under varying stress: endurance limit, S-N line, rainflow counting, Miner's sum."""

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
