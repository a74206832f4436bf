"""Derivatives of figures are right to 1e-8, have a bounded error, and mark kinks."""

import mpmath
import numpy as np
import pytest
from figure_table import Table

from kinelast.designs.sensitivities import limit, sensitivities


def arm(lib, depth, width, length, E, density, tip, acceleration):
    """Return tip deflection and root stress of an accelerated arm with tip mass, by formulas without shear."""
    line = density * width * depth
    EI = E * width * depth**3 / 12
    deflection = acceleration * (tip * length**4 / 3 + 11 * line * length**5 / 120) / EI
    stress = 6 * acceleration * (tip * length**2 + line * length**3 / 3) / (width * depth**2)
    coordinate = lib.sqrt(length**2 + deflection**2) - length  # cancellation loses ten digits
    return {"deflection": deflection, "stress": stress, "coordinate": coordinate}


ARM = [6e-3, 10e-3, 0.3, 210e9, 7850.0, 0.2, 4.0]


def exact_slopes(values):
    """Return derivatives of the arm's figures by differences in 50 digits, shape (figures, variables)."""
    with mpmath.workdps(50):
        return np.array([
            [
                float(mpmath.diff(lambda *x, name=name: arm(mpmath, *x)[name], tuple(map(mpmath.mpf, values)), order))
                for order in np.eye(len(values), dtype=int).tolist()
            ]
            for name in ("deflection", "stress", "coordinate")
        ])  # fmt: skip


@pytest.fixture(scope="module")
def turning():
    return sensitivities(lambda values: Table(arm(np, *values.T)), np.array(ARM)), exact_slopes(ARM)


def test_slopes_agree_with_those_in_50_digits(turning):
    found, exact = turning
    own = abs(exact[:2] * ARM)
    assert (abs(found.slope[:2] - exact[:2]) * ARM < 1e-11 * np.maximum(own, found.figure[:2, None])).all()


def test_the_estimate_bounds_the_error_despite_cancellation(turning):
    found, exact = turning
    off = abs(found.slope - exact)
    assert (off <= found.error).all()
    assert off[2, 0] > 1e-9 * abs(exact[2, 0])  # digits are indeed lost
    assert (found.error[:2] < 1e-8 * found.figure[:2, None] / ARM).all()


def test_estimates_bound_errors_for_any_noise():
    rng = np.random.default_rng(0)
    held = []
    for noise in (0.0, 1e-14, 1e-11, 1e-8):
        for _ in range(60):
            a, b = rng.uniform(0.5, 6, 2)
            found = sensitivities(
                lambda values, a=a, b=b, noise=noise: Table(
                    {"f": np.exp(a * np.sin(b * values[:, 0])) * (1 + noise * rng.uniform(-1, 1, len(values)))}
                ),
                np.array([1.3]),
            )
            exact = np.exp(a * np.sin(b * 1.3)) * a * b * np.cos(b * 1.3)
            held.append(abs(found.slope[0, 0] - exact) <= found.error[0, 0])
    assert np.mean(held) > 0.98


@pytest.mark.parametrize("order", [1, 2])
def test_few_large_steps_are_enough_for_a_polynomial(order):
    """Extrapolation of five steps removes four powers of the step; the estimate bounds the rest."""
    step = np.array([0.4, 0.2, 0.1, 0.05, 0.025] + [np.nan] * 13)[:, None]
    powers = [step ** (order * k) for k in range(6)]
    found = limit(3 + 5 * powers[1] - 2 * powers[2] + 7 * powers[3], 0 * step, order)
    assert found.value == pytest.approx([3.0], abs=1e-13)
    rest = limit(3 + 5 * powers[1] - 2 * powers[2] + 7 * powers[3] + powers[4] - powers[5], 0 * step, order)
    assert 0 < abs(rest.value[0] - 3) <= rest.error[0]


def test_logarithmic_slopes_of_powers_are_their_exponents():
    found = sensitivities(
        lambda values: Table({"f": values[:, 0] ** -2.7 * values[:, 1] ** 0.5}), np.array([6e-3, 210e9])
    )
    assert found.logarithmic[0] == pytest.approx([-2.7, 0.5], abs=1e-11)


@pytest.mark.parametrize("with_places", [True, False])
def test_a_kink_has_two_slopes(with_places):
    def figures(values):
        x, y = values.T
        place = {"largest": np.where(x**2 >= y, 0, 1)} if with_places else {}
        return Table({"largest": np.maximum(x**2, y), "smooth": x * y}, place)

    found = sensitivities(figures, np.array([2.0, 4.0]))
    assert found.kink.tolist() == [[True, True], [False, False]]
    assert found.below == pytest.approx(np.array([[0.0, 0.0], [4.0, 2.0]]), abs=1e-9)
    assert found.above == pytest.approx(np.array([[4.0, 1.0], [4.0, 2.0]]), abs=1e-9)
    assert found.slope[0] == pytest.approx([2.0, 0.5], abs=1e-9)


@pytest.mark.parametrize("with_places", [True, False])
def test_a_kink_nearby_does_not_spoil_the_slope(with_places):
    def figures(values):
        sides = np.stack([np.exp(values[:, 0]), np.e + 5 * (values[:, 0] - 1.0003)])
        return Table({"f": sides.max(axis=0)}, {"f": sides.argmax(axis=0)} if with_places else {})

    found = sensitivities(figures, np.array([1.0]))
    off = abs(found.slope[0, 0] - np.e)
    assert off <= found.error[0, 0] < 1e-8
    assert not found.kink[0, 0]
    if with_places:  # the curves intersect at 1.00066
        assert 0.00066 / 2 < found.valid_range[0, 0] < 0.00066
    else:
        assert np.isnan(found.valid_range[0, 0])


def test_a_position_chosen_by_round_off_is_not_a_kink():
    rng = np.random.default_rng(1)

    def figures(values):  # forward and return motion give equal values, and round-off selects one of them
        return Table({"f": np.exp(values[:, 0])}, {"f": rng.integers(0, 2, len(values))})

    for _ in range(20):
        found = sensitivities(figures, np.array([1.0]))
        assert not found.kink[0, 0]
        assert found.slope[0, 0] == pytest.approx(np.e, rel=1e-9)
        assert abs(found.slope[0, 0] - np.e) <= found.error[0, 0]


def test_the_end_of_a_range_has_one_slope():
    with np.errstate(invalid="ignore"):
        found = sensitivities(lambda values: Table({"f": np.sqrt(values[:, 0]) ** 4 + values[:, 0]}), np.zeros(1))
    assert np.isnan(found.below[0, 0])
    assert found.slope[0, 0] == found.above[0, 0] == pytest.approx(1.0, abs=found.error[0, 0] + 1e-12)


def test_an_unknown_figure_has_no_slope():
    found = sensitivities(lambda values: Table({"f": values[:, 0] * np.nan}), np.ones(1))
    assert np.isnan(found.slope).all()
    assert np.isnan(found.error).all()


def test_scales_must_be_positive():
    with pytest.raises(ValueError, match="greater than zero, got 0"):
        sensitivities(lambda values: Table({"f": values[:, 0]}), np.ones(1), np.zeros(1))
