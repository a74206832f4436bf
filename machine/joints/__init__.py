"""Joints of a machine: forces over a cycle, bearings, pins, eyes and clearance."""

from machine.joints.bearings import (
    EDGE_RANGE,
    EYE_RANGE,
    HOLE_RANGE,
    LIFE_FACTORS,
    LOAD_RANGE,
    MIN_LOADS,
    OVERLAP_RANGE,
    PIN_RANGE,
    SLIP_RANGE,
    STATIC_RANGE,
    Eye,
    Guide,
    JointParts,
    Pin,
    Plain,
    Rolling,
)
from machine.joints.histories import JointHistory, clearance_effects, contact_losses, joint_history, knocks
