"""Functions of one design raise an error for several."""

import numpy as np
import pytest
from mechanisms import at_speed, bar, steel_four_bar, with_link

from animations.diagrams import diagram_named
from animations.layout import drawable
from elastic import Section, deflection
from elastic.assessment import exceedances
from elastic.assessment.buckling import BucklingModes
from elastic.elastodynamics import elastodynamic, natural_modes
from rigid import motion
from rigid.analysis import LinkAngle, limits
from rigid.dynamics import Effort, forward

CASE = steel_four_bar(12)
SECTIONS = [Section(np.array([[1e6], [2e6]]), 40.0), *CASE.sections[1:]]
COURSE = motion(CASE.mechanism, CASE.drive, 100.0)
LONGER = motion(with_link(CASE.mechanism, bar("crank", "O", "A", np.array([[0.1], [0.09]]))), CASE.drive, 100.0)
BENT = deflection(LONGER, CASE.sections)
FUNCTIONS = {
    "limits": lambda: limits(LONGER, LinkAngle("rocker")),
    "forward": lambda: forward(LONGER.mechanism, [Effort()], 0.0, 0.0, 1.0),
    "picture": lambda: drawable(BENT, diagram_named("slope")),
    "cautions": lambda: exceedances(BENT),
    "buckling": lambda: BucklingModes(deflection(COURSE, SECTIONS)),
    "natural modes": lambda: natural_modes(COURSE, SECTIONS),
    "vibration": lambda: elastodynamic(COURSE, at_speed(CASE.mechanism, 100.0), 2 * np.pi / 100.0, SECTIONS),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_several_designs_are_an_error(name):
    with pytest.raises(ValueError, match=r"one design|single design|several designs|designs: expected one"):
        FUNCTIONS[name]()
