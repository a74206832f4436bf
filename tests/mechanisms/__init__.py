"""Mechanisms of the tests: loaded cases, drawn linkages and handbook beams."""

from .building import (
    GRAVITY,
    Case,
    apex,
    at_speed,
    bar,
    loads,
    lumps,
    motion_of,
    moved,
    replaced,
    require_closed_loops,
    rigid_sections,
    scaled,
    steel_bar,
    turn,
    with_link,
    with_lump,
)
from .drawn import drawn_bar, four_bar_linkage, linkage, slider_crank_linkage, three_cranks
from .dyads import bush, elastic_guide, four_bar, inverted_slider_crank, pressed, scotch_yoke, slider_crank, tangent
from .handbook_beams import cantilever, propped, still, supported
from .larger import arm, held_arm, ring, six_bar, stiff_plate, triad
from .plain import double_rocker, parallelogram, simeon_slider_crank, steel_four_bar

DYADS = {"RRR": four_bar, "RRP": slider_crank, "RPR": inverted_slider_crank, "RPP": scotch_yoke, "PRP": tangent}

ALL = DYADS | {
    "RPR, sliding rod": lambda: inverted_slider_crank(sliding_rod=True),
    "RRP, owner hung": bush,
    "driven slider": pressed,
    "arm": arm,
    "arm, motor turned about": held_arm,
    "six-bar": six_bar,
    "six-bar, stiff plate": stiff_plate,
    "six-bar, ring": ring,
    "RPR, elastic lever": elastic_guide,
    "triad": triad,
}
