"""Endurance, S-N line and counted cycles agree with textbooks and the standard."""

import numpy as np
import pytest

from elastic import circle, deflection, section_of
from machine.life import (
    FatigueStrength,
    FatigueTask,
    cycles_of,
    damage,
    effective_diameter,
    endurance_safety,
    equivalent_amplitude,
    fatigue,
    reliability_factor,
    size_factor,
    surface_factor,
)
from machine.life.damage import reversals
from machine.life.stresses import _largest_damage as worst_of
from rigid import Beam, Link, Mechanism, PinDrive, motion

STEEL = FatigueStrength(400e6, 250e6, 160e6, 5.0, 1e6)


@pytest.mark.parametrize(
    ("criterion", "safety"),
    [
        ("goodman", 1 / (80 / 160 + 100 / 400)),
        ("soderberg", 1 / (80 / 160 + 100 / 250)),
        # parabola a n / S_e + (m n / S_ut)^2 = 1
        ("gerber", (-0.5 + np.sqrt(0.25 + 4 * 0.0625)) / (2 * 0.0625)),
    ],
)
def test_safety_is_where_the_growing_stress_meets_the_line(criterion, safety):
    n = endurance_safety(80e6, 100e6, STEEL, criterion)
    assert n == pytest.approx(safety, rel=1e-14)
    assert equivalent_amplitude(n * 80e6, n * 100e6, STEEL, criterion) == pytest.approx(160e6, rel=1e-13)
    assert endurance_safety(80e6, -100e6, STEEL, criterion) == pytest.approx(2.0, rel=1e-14)


def test_factors_are_those_of_the_textbook():
    """Shigley, 9th ed.: table 6-5; example 6-4, a bar of 32 mm: rotating 0.858, not rotating 0.954."""
    found = [reliability_factor(share) for share in (0.5, 0.9, 0.95, 0.99, 0.999, 0.9999)]
    assert found == pytest.approx([1.0, 0.897, 0.868, 0.814, 0.753, 0.702], abs=6e-4)
    assert size_factor(0.032) == pytest.approx(0.858, abs=6e-4)
    assert size_factor(effective_diameter(0.032, np.nan, rounded=True)) == pytest.approx(0.954, abs=6e-4)
    assert size_factor(0.1) == pytest.approx(1.51 * 100**-0.157)
    assert surface_factor("as-forged", 520e6) == pytest.approx(0.540, abs=6e-4)


def test_the_line_falls_by_its_slope_down_to_the_knee():
    assert STEEL.cycles(160e6) == np.inf
    assert STEEL.cycles(320e6) == pytest.approx(1e6 / 2**5)
    assert STEEL.cycles(80e6, below=True) == pytest.approx(1e6 * 2**9)


def test_counts_are_those_of_the_standard():
    """ASTM E1049-85, figure 6: ranges 3, 4, 6, 8 and 9 of an open history; figure 7 is periodic."""
    from rainflow import count_cycles

    history = [-2, 1, -3, 5, -1, 3, -4, 4, -2]
    assert count_cycles(history) == [(3, 0.5), (4, 1.5), (6, 0.5), (8, 1.0), (9, 0.5)]
    size, mean, count = cycles_of(history[:-1])
    table = {float(each): float(count[size == each].sum()) for each in np.unique(size)}
    assert table == {3.0: 1.0, 4.0: 1.0, 7.0: 1.0, 9.0: 1.0}
    assert size.max() == np.ptp(history)
    assert mean[size.argmax()] == 0.5


def test_the_largest_range_does_not_depend_on_the_start():
    course = np.random.default_rng(5).normal(size=60)
    for start in (0, 7, 31):
        size, _, count = cycles_of(np.roll(course, start))
        assert size.max() == pytest.approx(np.ptp(course), rel=1e-15)
        assert count.sum() * 2 == reversals(course)


def test_reversals_count_level_pieces_once():
    assert reversals(np.array([0, 1, 1, 1, 0, 0, -1, -1, 0, 2, 0.0])).tolist() == 4
    assert reversals(np.ones(5)) == 0


def test_small_cycles_on_a_large_one_count_by_the_lower_slope():
    """A cycle of +-320 MPa with a range of 80 MPa on its rise: Miner's sum by hand."""
    course = np.array([-320.0, 0.0, 80.0, 0.0, 320.0, 0.0]) * 1e6
    whole = 1 / (1e6 / 2**5)
    small = equivalent_amplitude(40e6, 40e6, STEEL)
    assert damage(course, STEEL) == pytest.approx(whole + (small / 160e6) ** 9 / 1e6, rel=1e-12)
    assert damage(course / 2.1, STEEL) == 0.0


def test_many_small_cycles_can_be_worse_than_a_large_one():
    courses = np.array([[1.0, -1.0, 0, 0], [0.99, -0.99] * 2]) * 320e6
    excess = np.ptp(courses, axis=1) / 2 / STEEL.endurance
    assert worst_of(courses, excess, STEEL, "goodman") == (pytest.approx(damage(courses[1], STEEL)), 1)
    assert damage(courses[1], STEEL) == pytest.approx(2 * (0.99 * 2) ** 5 / 1e6)


def test_a_rotating_arm_with_weight():
    """Goodman: rho omega^2 L^2 / 2 is constant at the root, m g L / 2 / W alternates."""
    length, diameter, density, omega, g = 0.5, 0.02, 7850.0, 40.0, 9.81
    shape = circle(diameter)
    arm = Link("arm", {"O": 0, "A": length}, (Beam("O", "A", density * shape.area),))
    turning = Mechanism(
        (Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": length}, gravity=-1j * g
    )
    moved = motion(turning, np.linspace(0, 2 * np.pi, 360, endpoint=False), omega)
    bent = deflection(moved, [section_of(shape, 210e9)])
    pull = density * omega**2 * length**2 / 2
    # the axial part of the weight is a quarter period from its bending at the root
    bending = density * shape.area * g * length**2 / 2 * (diameter / 2) / (np.pi * diameter**4 / 64)
    alternating = np.hypot(bending, density * g * length)
    found = fatigue(bent, FatigueTask((STEEL,)))
    assert found.amplitude[0] == pytest.approx(alternating, rel=1e-4)
    assert found.mean[0] == pytest.approx(pull, rel=1e-4)
    assert found.safety.value[0] == pytest.approx(1 / (alternating / 160e6 + pull / 400e6), rel=1e-4)
    assert found.safety.xi[0] == 0.0
    assert found.damage.value[0] == 0.0
    notched = fatigue(bent, FatigueTask((STEEL,), notches=((2.0, 1.0),)))
    assert notched.safety.value[0] == pytest.approx(found.safety.value[0] / 2, rel=1e-12)


def test_the_worst_place_decides_on_the_life():
    """Both notch factors put stations above the limit; the result is the largest sum of single counts."""
    length = 0.5
    arm = Link("arm", {"O": 0, "A": length}, (Beam("O", "A", 2.5),))
    turning = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": length}, gravity=-9.81j)
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    moved = motion(turning, angle, 40.0 + 30 * np.sin(3 * angle), 90 * np.cos(3 * angle) * 40)
    bent = deflection(moved, [section_of(circle(0.02), 210e9)])
    weak = FatigueStrength(40e9, 25e9, 5e6, 5.0, 1e6)
    found = fatigue(bent, FatigueTask((weak,)))
    from elastic import sample
    from machine.life.stresses import STATIONS

    every = [
        damage(sample(bent, side, STATIONS)[0, :, k], weak) for side in ("left", "right") for k in range(len(STATIONS))
    ]
    assert found.damage.value[0] == pytest.approx(max(every), rel=1e-12)
    assert max(every) > 0.0
