"""The vibrating links agree with the nonlinear model of the reference mechanism, up to effects of large displacements.

`fem_check.nonlinear` has its own kinematics, loads and beam theory.
"""

import math

import numpy as np
import pytest
from mechanisms import ALL, at_speed, steel_four_bar
from nonlinear import nonlinear_steady_state
from tiers import in_tiers

from elastic import sample
from elastic.elastodynamics import elastodynamic, large_displacement_error
from rigid import ConstantSpeed, drive_efforts

CASES = [
    (steel_four_bar, 60.0, 42e-6, 6e-3, 0.05),
    (ALL["RRP"], 25.0, 2e-4, 2e-3, 0.02),
    (ALL["RPR"], 40.0, 2e-4, 0.04, 0.5),
    (ALL["RRR"], 20.0, 2e-4, 4e-3, 0.04),
    (ALL["RPP"], 60.0, 2e-4, 2e-3, 0.05),
    (steel_four_bar, 30.0, 42e-6, 6e-4, 0.01),
    (ALL["RPR"], 15.0, 2e-4, 4e-4, 0.02),
]
"""Mechanism, speed [rad/s], beta [s], largest chord difference, smallest quasi-static chord difference."""


@pytest.mark.parametrize(("make", "speed", "beta", "limit", "without"), in_tiers(CASES, 1, 3))
def test_chord_deflection_and_drive_effort_agree(make, speed, beta, limit, without):
    case = make()
    start, period, count = case.drive[0, 0], 2 * math.pi / speed, 96

    law, motion_at = ConstantSpeed(start, speed), at_speed(case.mechanism, speed, start)
    reference = nonlinear_steady_state(
        case.mechanism, case.sections, [law], period, positions=count, elements=6, damping=beta
    )
    found = elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, case.sections, damping=beta)
    stations = np.linspace(0, 1, reference.chord.shape[-1])
    greatest = np.abs(reference.chord).max(axis=(1, 2))
    off, plain = (
        np.abs(sample(bent, "chord", stations) - reference.chord).max(axis=(1, 2)) / greatest
        for bent in (found.deflection, found.quasi_static)
    )
    assert off.max() < limit
    estimate = large_displacement_error(found)
    # the rest is the mesh of the check and links without beams
    assert estimate == pytest.approx(off.max(), rel=0.15, abs=6e-4)
    assert plain.max() > without
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - reference.efforts).max() < limit * np.abs(reference.efforts).max()
