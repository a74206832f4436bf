"""A mechanism passes change points on the smooth branch, and singular positions are marked."""

import numpy as np
import pytest
from mechanisms import parallelogram, steel_bar

from elastic import Section, deflection
from rigid import Beam, Link, Lump, Mechanism, PinDrive, Slider, motion, reactions

DRAWN_BELOW = {"A": -0.1j, "B": 0.3 - 0.1j}
ANGLES = np.linspace(0.2, 4 * np.pi, 361)


class TestParallelogram:
    @pytest.mark.parametrize("drawn", [{}, DRAWN_BELOW], ids=["drawn above", "drawn below"])
    @pytest.mark.parametrize("start", [0.3, -0.5, 2.9, 3.5, 0.0], ids=str)
    def test_it_stays_a_parallelogram(self, drawn, start):
        going = motion(parallelogram(**drawn), start + ANGLES, 1.0)
        np.testing.assert_allclose(going.direction[3], going.direction[1], rtol=0, atol=1e-12)
        away = going.condition < 1e6
        np.testing.assert_allclose(going.angular_velocity[3, away], 1.0, rtol=0, atol=1e-9)

    @pytest.mark.parametrize("count", [60, 83, 361])
    def test_it_stays_a_parallelogram_when_solved_by_newton(self, count, monkeypatch):
        """Each position folds like one of the neighbours, although coarse steps could reach either branch."""
        monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
        going = motion(parallelogram(), np.linspace(0.3, 2 * np.pi + 0.4, count), 1.0)
        np.testing.assert_allclose(going.direction[3], going.direction[1], rtol=0, atol=1e-6)

    @pytest.mark.parametrize(
        ("count", "near", "few"), [(170, 0.03, 8), (170, 0.003, 8), (200, 0.03, 4), (200, 0.03, 16)]
    )
    def test_newton_keeps_the_fold_at_uneven_positions(self, count, near, few, monkeypatch):
        """Uneven positions follow even ones, so an interpolated start would be misleading."""
        links = (
            Link("ground", {"O": 0.0, "D": 0.35}),
            steel_bar("crank", "O", "A", 0.1),
            steel_bar("coupler", "A", "B", 0.35),
            steel_bar("rocker", "D", "B", 0.1),
        )
        lean = 0.1 * np.exp(0.3j)
        mechanism = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "D": 0.35, "A": lean, "B": 0.35 + lean})
        drive = np.concatenate([np.linspace(0.3, 2.9, count), np.pi + near * np.linspace(-1, 1, few)])
        monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
        going = motion(mechanism, drive)
        np.testing.assert_allclose(going.direction[3], going.direction[1], rtol=0, atol=1e-4)

    def test_an_antiparallelogram_stays_an_antiparallelogram(self):
        going = motion(parallelogram(B=0.22 - 0.06j), ANGLES, 1.0)
        assert np.abs(going.direction[3] - going.direction[1]).max() > 1.9
        assert np.abs(np.diff(going.direction[3])).max() < 2 * np.diff(ANGLES).max()

    def test_a_slightly_unequal_parallelogram_has_no_change_point(self):
        going = motion(parallelogram(0.1 + 1e-5), ANGLES[:100], 1.0)
        signs = np.sign((np.conj(going.direction[2]) * going.direction[3]).imag)
        assert (signs == signs[0]).all()

    def test_only_exact_designs_pass_the_change_point(self):
        rockers = np.array([[0.1], [0.1 + 1e-5], [0.1]])
        going = motion(parallelogram(rockers), ANGLES, 1.0)
        apart = np.abs(going.direction[3] - going.direction[1]).max(axis=-1)
        assert (apart[[0, 2]] < 1e-12).all()
        assert apart[1] > 1.0

    def test_singular_positions_are_marked_and_have_no_forces(self):
        going = motion(parallelogram(), np.array([0.3, 0.0, 0.3 + np.pi, np.pi]), 1.0)
        flat = np.array([False, True, False, True])
        np.testing.assert_array_equal(going.condition > 1e12, flat)
        bent = deflection(going, [Section(12.6e6, 37.8)] * 3)
        for values in (bent.w, bent.M, going.angular_velocity[2:], reactions(going).force[1]):
            np.testing.assert_array_equal(np.isnan(values).any(axis=tuple(range(values.ndim - 1))), flat)


def test_an_isosceles_slider_crank_goes_straight_through():
    links = (
        Link("ground", {"O": 0.0}),
        steel_bar("crank", "O", "A", 0.1),
        steel_bar("rod", "A", "B", 0.1),
        Link("block", {"B": 0.0}, (), (Lump("B", 0.2),)),
    )
    drawing = {"O": 0, "A": 0.1 * np.exp(0.5j), "B": 0.2 * np.cos(0.5)}
    slide = Slider("guide", "block", "ground", "B", 0.0, 1.0)
    course = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slide,))
    angles = 0.5 + np.linspace(0.0, 4 * np.pi, 247)
    np.testing.assert_allclose(motion(course, angles, 1.0).origin[3], 0.2 * np.cos(angles), rtol=0, atol=1e-12)


def test_two_parallelograms_in_series_pass_change_points_together():
    links = (
        Link("ground", {"O": 0.0, "D": 0.3, "F": 0.5}),
        steel_bar("crank", "O", "A", 0.1),
        steel_bar("coupler", "A", "B", 0.3),
        Link("rocker", {"D": 0.0, "B": 0.1, "C": 0.15}, (Beam("D", "C", 0.4),)),
        steel_bar("link", "C", "E", 0.2),
        steel_bar("last", "F", "E", 0.15),
    )
    drawing = {"O": 0, "D": 0.3, "F": 0.5, "A": 0.1j, "B": 0.3 + 0.1j, "C": 0.3 + 0.15j, "E": 0.5 + 0.15j}
    going = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), ANGLES, 1.0)
    np.testing.assert_allclose(going.direction[5], going.direction[1], rtol=0, atol=1e-10)


@pytest.mark.parametrize("part", [slice(150, 200), slice(200, 201), slice(0, 361, 40), slice(360, 0, -1)], ids=str)
def test_the_branch_does_not_depend_on_the_requested_positions(part):
    whole, some = motion(parallelogram(), ANGLES, 1.0), motion(parallelogram(), ANGLES[part], 1.0)
    np.testing.assert_allclose(some.direction, whole.direction[:, part], rtol=0, atol=1e-12)
