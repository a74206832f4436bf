"""The optimizer finds known optima, and its certificate shows why they are optimal."""

import numpy as np
import pytest
from figure_table import Table
from scipy.optimize import brentq

from kinelast.designs.linearization import linearized
from kinelast.designs.optimum import optimum
from kinelast.designs.problem import DesignProblem
from kinelast.values.figure import Limit


def problem(columns, low, high, figure="cost", **more):
    return DesignProblem(lambda values: Table(columns(*values.T)), np.array(low), np.array(high), figure, **more)


def test_gradients_of_quartics_are_exact():
    case = problem(lambda x, y: {"cost": x**4 + x * y**3, "g": x * y}, [0, -1], [2, 1], limits=(Limit("g", 5.0),))
    for shares in ([0.3, 0.7], [0.0, 1.0]):  # inside, and at the bounds
        x, y = 2 * shares[0], 2 * shares[1] - 1
        found = linearized(case, [np.array(shares)])[0]
        assert found.cost_slope == pytest.approx([2 * (4 * x**3 + y**3), 2 * 3 * x * y**2], abs=1e-11)
        assert found.margin_slope == pytest.approx(np.array([[-y / 5, -x / 5]]) * 2, abs=1e-11)


def test_hock_and_schittkowski_71():
    """Test Examples for Nonlinear Programming Codes (1981), problem 71; the sum of squares is 40."""

    def columns(a, b, c, d):
        return {"cost": a * d * (a + b + c) + c, "product": a * b * c * d, "squares": a * a + b * b + c * c + d * d}

    limits = (Limit("product", 25.0, least=True), Limit("squares", 40.0))
    best = optimum(problem(columns, [1.0] * 4, [5.0] * 4, limits=limits))
    assert best.feasible
    assert best.values == pytest.approx([1.0, 4.7429994, 3.8211503, 1.3794082], abs=1e-4)
    held = best.certificate
    assert columns(*best.values)["cost"] == pytest.approx(17.0140173, rel=1e-6)
    assert held.low[0] > 0
    assert held.residual < 1e-5
    assert not sum(held.neighbours.better)


def test_a_minimum_mass_under_a_limit_has_the_right_multiplier():
    """Minimize w h with 1/(w h^3) <= 1: the section is as slender as allowed, and 1 % more deflection saves 1/3 %."""
    case = problem(
        lambda w, h: {"cost": w * h, "bend": 1 / (w * h**3)}, [0.1, 0.4], [9.0, 2.0], limits=(Limit("bend", 1.0),)
    )
    best = optimum(case)
    assert best.values == pytest.approx([1 / 8, 2.0], rel=1e-5)
    assert best.certificate.multiplier == pytest.approx([1.0], rel=1e-5)  # only w counts, since h is at its bound
    assert best.certificate.high[1] == pytest.approx(2 * 1.6 / 2, rel=1e-5)  # cost ~ h^-2, and the range is 1.6
    assert best.certificate.low == pytest.approx([0, 0], abs=1e-12)
    assert best.certificate.residual < 1e-8


def test_many_starts_find_the_lowest_of_eight_minima():
    def columns(*x):
        return {"cost": sum((each**2 - 4) ** 2 + each for each in x) + 60}

    lowest = brentq(lambda x: 4 * x * (x * x - 4) + 1, -3, -1.5)
    best = optimum(problem(columns, [-3.0] * 3, [3.0] * 3), first=np.full(3, 0.9))
    assert best.values == pytest.approx([lowest] * 3, abs=1e-5)
    assert len({tuple(np.sign(each.end - 0.5)) for each in best.searches}) > 1  # other searches end in other minima


def test_evolution_finds_the_lowest_of_hundreds_of_minima():
    """Rastrigin's function of three variables, with a shifted minimum."""
    lowest = np.array([0.37, -1.21, 2.03])

    def columns(*x):
        off = np.stack(x) - lowest[:, None]
        return {"cost": (off**2 + 4 * (1 - np.cos(2 * np.pi * off))).sum(axis=0) + 1}

    best = optimum(problem(columns, [-5.0] * 3, [5.0] * 3), evolve=True)
    assert best.values == pytest.approx(lowest, abs=1e-5)
    assert best.certificate.neighbours.tried == (64,) * 4
    assert best.certificate.neighbours.better == (0,) * 4


def test_a_figure_can_be_maximized():
    best = optimum(problem(lambda x: {"cost": x * np.exp(-x)}, [0.0], [4.0], largest=True))
    assert best.values == pytest.approx([1.0], abs=1e-5)


def test_designs_without_figures_are_avoided():
    case = problem(lambda x, y: {"cost": np.sqrt(x + y - 1) + (x - y) ** 2 - 3 * x}, [0.0, 0.0], [1.0, 1.0])
    with np.errstate(invalid="ignore"):
        best = optimum(case)
    assert np.isfinite(best.searches[0].cost)
    y = brentq(lambda y: 0.5 / np.sqrt(y) - 2 * (1 - y), 1e-3, 0.3)  # a ridge and a valley along x = 1
    valley = brentq(lambda y: 0.5 / np.sqrt(y) - 2 * (1 - y), 0.33, 0.99)
    assert y < valley
    assert best.values == pytest.approx([1.0, valley], abs=1e-5)


def test_contradictory_limits_leave_no_design():
    limits = (Limit("cost", 1.0), Limit("cost", 2.0, least=True))
    best = optimum(problem(lambda x: {"cost": x}, [0.0], [4.0], limits=limits))
    assert not best.feasible
    assert best.certificate.margin.min() < -0.1


def test_without_figures_there_is_no_optimum():
    with pytest.raises(ValueError, match="no design"):
        optimum(problem(lambda x: {"cost": x * np.nan}, [0.0], [1.0]))


def test_the_optimum_keeps_its_limit_when_recomputed():
    case = problem(lambda x: {"cost": x, "f": 1 / x}, [0.1], [9.0], limits=(Limit("f", 0.7),))
    assert 1 / optimum(case).values[0] <= 0.7


def test_shares_values_and_rates_are_consistent():
    case = problem(lambda x, y: {"cost": x}, [0.1, -3.0], [50.0, 7.0])
    shares = np.array([0.3, 0.8])
    values = case.values(shares)
    assert values == pytest.approx([0.1 * 500**0.3, 5.0], rel=1e-14)
    assert case.shares(values) == pytest.approx(shares, rel=1e-14)
    step = 1e-6
    rate = (case.values(shares + step) - case.values(shares - step)) / (2 * step)
    assert case.rate(values) == pytest.approx(rate, rel=1e-9)


def test_a_four_bar_through_five_points():
    """Path of five points at given crank angles (Kunjur and Krishnamurty 1997; Cabrera et al. 2002).

    An independent least-squares search from 1200 random starts gives a sum of squares of 7.41575e-7.
    """
    wanted = np.array([3 + 3j, 2.759 + 3.363j, 2.372 + 3.663j, 1.890 + 3.862j, 1.355 + 3.943j])
    turn = np.radians([30, 45, 60, 75, 90])
    names = [f"off {k}" for k in range(10)]

    def columns(ground, crank, coupler, rocker, x, y):
        pin = crank[:, None] * np.exp(1j * turn)
        way = ground[:, None] - pin
        cosine = (coupler[:, None] ** 2 + abs(way) ** 2 - rocker[:, None] ** 2) / (2 * coupler[:, None] * abs(way))
        along = way / abs(way) * np.exp(1j * np.arccos(cosine))
        off = pin + (x + 1j * y)[:, None] * along - wanted
        parts = np.concatenate([off.real, off.imag], axis=1).T
        return {"squares": (abs(off) ** 2).sum(axis=1), **dict(zip(names, parts, strict=True))}

    case = problem(columns, [0.1] * 4 + [-10] * 2, [50.0] * 4 + [10] * 2, "squares", parts=tuple(names))
    with np.errstate(invalid="ignore"):
        best = optimum(case)
    assert best.searches[0].cost == pytest.approx(7.415751307e-7, rel=1e-8)
    assert best.values == pytest.approx([3.6697, 1.9978, 3.9963, 2.7049, 1.6720, 1.6801], abs=1e-4)
    assert not sum(best.certificate.neighbours.better)
