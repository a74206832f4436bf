"""Natural frequencies of mechanisms agree with finite elements; a pointed cone."""

import numpy as np
import pytest
from fem_vibrating import natural_frequencies
from mechanisms import ALL, elastic_guide, four_bar, motion_of, pressed, ring, slider_crank
from msgspec.structs import replace
from test_gears import geared_four_bar
from test_vibration import EI, LENGTH, MASS, bending, frequencies
from tiers import in_tiers

import elastic.vibration
from elastic import JointCompliance, Section, Taper
from rigid import Beam, Link, Mechanism, PinDrive, motion

ENDS = {"A": 0.0, "B": LENGTH}


def test_pointed_cone():
    """A cone clamped at its base: 8.719/l^2 sqrt(EI/m) (Blevins, Formulas for Natural Frequency, 1979, chapter 8)."""
    sharp = 0.99999
    taper = (1.0, -sharp)
    power2, power4 = np.polynomial.polynomial.polypow(taper, 2), np.polynomial.polynomial.polypow(taper, 4)
    link = Link("beam", ENDS, (Beam("A", "B", MASS, tuple(power2)),))
    held = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("beam", "A"),), ENDS)
    section = Section(1e9, EI, taper=Taper(tuple(power2), tuple(power4)))
    assert frequencies(held, [section], 1)[0] / bending(1.0) == pytest.approx(8.719, abs=6e-4)


class TestMechanisms:
    """`elastic` has polynomials along whole beams: no elements, no common matrix."""

    @pytest.mark.parametrize("name", in_tiers(sorted(set(ALL) - {"PRP", "arm, motor turned about"}), 4, 4))
    def test_agree_with_closed_polynomials(self, name):
        case = ALL[name]()
        turning = motion_of(case)
        other = elastic.vibration.natural_frequencies(turning, case.sections, 2, 3, tolerance=1e-8)
        found = natural_frequencies(turning, case.sections, 12, 2, other.position)
        known = np.isfinite(other.omega)
        np.testing.assert_array_equal(np.isfinite(found), known)
        np.testing.assert_allclose(found[known], other.omega[known], rtol=5e-5)

    @pytest.mark.parametrize(
        ("make", "joints"),
        [
            (four_bar, {"A": JointCompliance(1e-5), "O": JointCompliance(2e-6, 3e-3)}),
            (slider_crank, {"guide": JointCompliance(1e-5, 1e-3)}),
            (elastic_guide, {"guide": JointCompliance(1e-5, 1e-3)}),
            (pressed, {"guide": JointCompliance(1e-5, 1e-3)}),
        ],
    )
    def test_agree_with_soft_joints(self, make, joints):
        case = make()
        turning = motion_of(case)
        other = elastic.vibration.natural_frequencies(turning, case.sections, 2, 3, joints=joints, tolerance=1e-8)
        found = natural_frequencies(turning, case.sections, 12, 2, other.position, joints)
        np.testing.assert_allclose(found, other.omega, rtol=5e-5)
        held = natural_frequencies(turning, case.sections, 12, 2, other.position)
        assert (found[0] < 0.999 * held[0]).any()

    def test_agree_with_shear_and_taper(self):
        case = ring()
        shaped = [
            replace(
                s, area=1e-3, inertia=1e-7, taper=Taper((1.0, -0.4), (1.0, -0.9, 0.4), (1.0, 0.3)) if k % 2 else None
            )
            for k, s in enumerate(case.sections)
        ]
        turning = motion_of(case)
        other = elastic.vibration.natural_frequencies(turning, shaped, 2, 2, tolerance=1e-8)
        found = natural_frequencies(turning, shaped, 12, 2, other.position)
        np.testing.assert_allclose(found, other.omega, rtol=5e-6)

    def test_agree_with_gears(self):
        turning = motion(geared_four_bar(), -3 * np.linspace(0.0, 6.0, 5), -300.0)
        sections = [Section(EA=12.6e6, EI=37.8)] * 3
        other = elastic.vibration.natural_frequencies(turning, sections, 2, 3, tolerance=1e-8)
        found = natural_frequencies(turning, sections, 12, 2, other.position)
        np.testing.assert_allclose(found, other.omega, rtol=1e-5)
