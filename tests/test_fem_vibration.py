"""Natural frequencies by finite elements agree with `elastic`, and with further standard beams, to fourth order.

Characteristic equations: R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979, chapter 8.
"""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from fem_vibrating import natural_frequencies
from mechanisms import (
    ALL,
    cantilever,
    elastic_guide,
    four_bar,
    motion_of,
    pressed,
    ring,
    slider_crank,
    still,
)
from test_gears import geared_four_bar
from test_vibration import EI, LENGTH, MASS, bending, roots
from tiers import in_tiers

import elastic.vibration
from elastic import JointCompliance, Section, Taper
from rigid import Beam, Link, Lump, Mechanism, PinDrive, Slider, SliderDrive, motion

ENDS = {"A": 0.0, "B": LENGTH}
STIFF = Section(EA=1e9, EI=EI)


def lowest(mechanism, section=STIFF, count=3, elements=32, **more):
    return natural_frequencies(still(mechanism), [section] * len(mechanism.beams), elements, count, **more)[:, 0]


class TestStandardBeams:
    def test_order_is_four(self):
        exact = bending(roots(lambda x: mpmath.cos(x) * mpmath.cosh(x) + 1, (1.875, 4.694)))
        errors = [lowest(cantilever(ENDS, MASS), count=2, elements=n) / exact - 1 for n in (4, 8, 16)]
        assert np.min(errors) > 0  # finite elements are too stiff
        np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.2)

    def test_pointed_cone(self):
        """A cone clamped at its base, 8.719/l^2 sqrt(EI/m) (Blevins, tapered beams); the tip is not exactly sharp."""
        sharp = 0.99999
        taper = (1.0, -sharp)
        power2, power4 = np.polynomial.polynomial.polypow(taper, 2), np.polynomial.polynomial.polypow(taper, 4)
        link = Link("beam", ENDS, (Beam("A", "B", MASS, tuple(power2)),))
        held = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("beam", "A"),), ENDS)
        section = Section(1e9, EI, taper=Taper(tuple(power2), tuple(power4)))
        assert lowest(held, section, 1, 64)[0] / bending(1.0) == pytest.approx(8.719, abs=6e-4)


class TestMechanisms:
    """The reference is `elastic`, with polynomials along whole beams: no elements, no common matrix."""

    @pytest.mark.parametrize("name", in_tiers(sorted(set(ALL) - {"PRP", "arm, motor turned about"}), 4, 4))
    def test_agree_with_closed_polynomials(self, name):
        case = ALL[name]()
        turning = motion_of(case)
        other = elastic.vibration.natural_frequencies(turning, case.sections, 2, 3, settled=1e-8)
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
        other = elastic.vibration.natural_frequencies(turning, case.sections, 2, 3, joints=joints, settled=1e-8)
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
        other = elastic.vibration.natural_frequencies(turning, shaped, 2, 2, settled=1e-8)
        found = natural_frequencies(turning, shaped, 12, 2, other.position)
        np.testing.assert_allclose(found, other.omega, rtol=5e-6)

    def test_agree_with_gears(self):
        turning = motion(geared_four_bar(), -3 * np.linspace(0.0, 6.0, 5), -300.0)
        sections = [Section(EA=12.6e6, EI=37.8)] * 3
        other = elastic.vibration.natural_frequencies(turning, sections, 2, 3, settled=1e-8)
        found = natural_frequencies(turning, sections, 12, 2, other.position)
        np.testing.assert_allclose(found, other.omega, rtol=1e-5)

    def test_a_block_is_a_node_of_the_mesh(self):
        """Otherwise the kink at the block would spoil the order: 1e-2 instead of 1e-4 at 8 elements."""
        case = elastic_guide()
        turning = motion_of(case)
        other = elastic.vibration.natural_frequencies(turning, case.sections, 2, 24, settled=1e-9).omega
        errors = [np.abs(natural_frequencies(turning, case.sections, n, 2) / other - 1).max() for n in (4, 8, 16)]
        assert errors[1] < 1e-4
        assert errors[2] < errors[0] / 100

    def test_singular_positions_are_nan(self):
        case = four_bar(0.1, 0.3, 0.1, 0.3)
        found = natural_frequencies(motion(case.mechanism, [0.4, 1e-8], 7.0), case.sections, 2, 1)
        np.testing.assert_array_equal(np.isnan(found), [[False, True]])

    def test_positions_with_a_block_beyond_its_beam_are_nan(self):
        links = (
            Link("ground", {"O": 0.0}),
            Link("arm", {"O": 0.0, "A": LENGTH}, (Beam("O", "A", MASS),)),
            Link("block", {"B": 0.0}, lumps=(Lump("B", 0.5),)),
        )
        mechanism = Mechanism(
            links,
            (PinDrive("arm", "O"), SliderDrive("guide")),
            {"O": 0.0, "A": LENGTH, "B": 0.5},
            (Slider("guide", "block", "arm", "B", 0.0, 1.0),),
        )
        places = np.array([0.0, 0.6, 1.0, 1.1]) * LENGTH
        found = natural_frequencies(motion(mechanism, [np.zeros(4), places]), [STIFF], 8, 1)[0]
        np.testing.assert_array_equal(np.isnan(found), [False, False, False, True])
        bare = lowest(cantilever(ENDS, MASS), elements=8)[0]
        tipped = lowest(cantilever(ENDS, MASS, lumps=(Lump("B", 0.5),)), elements=8)[0]
        np.testing.assert_allclose(found[[0, 2]], [bare, tipped], rtol=1e-3)
        assert bare > found[1] > tipped
