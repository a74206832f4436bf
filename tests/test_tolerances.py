"""Tolerances of numbers become distributions of figures by probability theory."""

import math

import numpy as np
import pytest
from figure_table import Table
from scipy.stats import binom, norm

from kinelast.designs.full_sample import FullColumn
from kinelast.designs.sensitivities import sensitivities
from kinelast.designs.tolerances import Tolerance, first_order, kept_share, scatter, variance_shares
from kinelast.reports.limits import Judgement
from kinelast.values.figure import Limit


def test_the_deviation_of_a_sum_is_the_root_of_squares():
    factors = np.array([3.0, -4.0, 12.0])
    tolerances = [Tolerance(0.3, normal=True), Tolerance(0.1 * np.sqrt(3)), Tolerance(0.03, normal=True)]
    deviations = np.array([0.1, 0.1, 0.01])

    def figures(values):
        return Table({"sum": values @ factors})

    at = np.array([1.0, 2.0, 3.0])
    exact = np.sqrt(((factors * deviations) ** 2).sum())
    linear = first_order(sensitivities(figures, at), tolerances)
    assert linear.deviation == pytest.approx([exact], rel=1e-11)
    assert linear.share[0] == pytest.approx((factors * deviations / exact) ** 2, rel=1e-10)
    assert linear.worst == pytest.approx([3 * 0.3 + 4 * 0.1 * np.sqrt(3) + 12 * 0.03], rel=1e-11)
    sampled = scatter(figures, tolerances, at, 16_384)["sum"]
    assert sampled.mean == pytest.approx(factors @ at, abs=5 * sampled.error[0])
    assert sampled.deviation == pytest.approx(exact, abs=5 * sampled.error[1])
    assert sampled.error[1] < 1e-3 * exact
    assert sampled.known == 1


def test_a_uniform_number_has_the_quantiles_of_its_range():
    sampled = scatter(lambda values: Table({"f": values[:, 0]}), [Tolerance(0.5)], np.array([10.0]), 16_384)["f"]
    assert [sampled.low, sampled.median, sampled.high] == pytest.approx([9.525, 10.0, 10.475], abs=3e-4)
    assert 9.5 <= sampled.least < sampled.largest <= 10.5


def test_a_product_of_normals_has_its_closed_form():
    means, deviations = np.array([2.0, 3.0]), np.array([0.4, 0.5])
    tolerances = [Tolerance(3 * each, normal=True) for each in deviations]

    def figures(values):
        return Table({"product": values.prod(axis=1)})

    variance = means[0] ** 2 * 0.25 + means[1] ** 2 * 0.16 + 0.16 * 0.25
    sampled = scatter(figures, tolerances, means)["product"]
    assert sampled.mean == pytest.approx(6.0, abs=5 * sampled.error[0] + 1e-4)
    assert sampled.deviation == pytest.approx(np.sqrt(variance), abs=5 * sampled.error[1])
    alone, whole = variance_shares(figures, tolerances, means)["product"]
    exact = np.array([9 * 0.16, 4 * 0.25]) / variance
    assert alone == pytest.approx(exact, abs=0.02)
    assert whole == pytest.approx(exact + 0.16 * 0.25 / variance, abs=0.02)
    linear = first_order(sensitivities(figures, means), tolerances)
    assert linear.deviation[0] == pytest.approx(np.sqrt(variance - 0.04), rel=1e-10)  # without the product of both


def test_quantiles_of_a_normal_distribution():
    spread = [Tolerance(0.9, normal=True)]
    sampled = scatter(lambda values: Table({"f": np.exp(values[:, 0])}), spread, np.zeros(1), 16_384)
    exact = np.exp(0.3 * norm.ppf([0.025, 0.5, 0.975]))
    assert [sampled["f"].low, sampled["f"].median, sampled["f"].high] == pytest.approx(exact, rel=1e-3)


def fourbar_angle(crank, coupler, rocker, ground, turn):
    """Return the rocker's angle by the law of cosines, written for this test."""
    tip = crank * np.exp(1j * turn) - ground
    cosine = (abs(tip) ** 2 + rocker**2 - coupler**2) / (2 * abs(tip) * rocker)
    return np.angle(tip) - np.arccos(cosine)


def test_tolerances_of_lengths_agree_with_the_formula_of_a_four_bar():
    lengths, turn = np.array([0.1, 0.3, 0.25, 0.35]), 1.1
    tolerances = [Tolerance(1e-4, normal=True), Tolerance(5e-5), Tolerance(2e-4, normal=True), Tolerance(1e-4)]
    out = fourbar_angle(*lengths, turn)
    # loop closure a e^it + b e^ic = d + r e^io; its component along the coupler is independent of c
    c = np.angle(lengths[3] + lengths[2] * np.exp(1j * out) - lengths[0] * np.exp(1j * turn))
    slopes = np.array([np.cos(turn - c), 1.0, -np.cos(out - c), -np.cos(c)]) / (-lengths[2] * np.sin(out - c))
    deviations = np.array([1e-4 / 3, 5e-5 / np.sqrt(3), 2e-4 / 3, 1e-4 / np.sqrt(3)])

    def figures(values):
        return Table({"angle": fourbar_angle(*values.T, turn)})

    linear = first_order(sensitivities(figures, lengths), tolerances)
    exact = np.sqrt(((slopes * deviations) ** 2).sum())
    assert linear.deviation[0] == pytest.approx(exact, rel=1e-9)
    sampled = scatter(figures, tolerances, lengths)["angle"]
    assert sampled.deviation == pytest.approx(exact, rel=1e-3)


def test_designs_without_a_figure_are_counted_and_omitted():
    with np.errstate(invalid="ignore"):
        sampled = scatter(lambda values: Table({"f": np.sqrt(values[:, 0])}), [Tolerance(1.0)], np.zeros(1))["f"]
    assert sampled.known == pytest.approx(0.5, abs=1e-3)
    assert sampled.mean == pytest.approx(2 / 3, abs=1e-3)
    nothing = scatter(lambda values: Table({"f": np.full(len(values), np.nan)}), [Tolerance(1.0)], np.zeros(1))["f"]
    assert nothing.known == 0
    assert np.isnan(nothing.mean)


def test_the_share_of_accepted_machines_by_hand():
    """A figure from 0.9 to 1.1 whose full answer is 2 % larger, with an error of 0.5 %; exact confidence limits."""
    figures = {"deflection": np.linspace(0.9, 1.1, 2001), "safety": np.full(2001, 3.0)}
    limits = Limit("deflection", 1.05), Limit("safety", 2.0, least=True)
    judged = [Judgement(limits[0], "kept", 0, 1.02, 0.005, ""), Judgement(limits[1], "kept", 0, 2.9, 0.01, "")]
    full = {
        "deflection": FullColumn(1.02 * figures["deflection"], 0.005 / 1.02, 0.0),
        "safety": FullColumn(figures["safety"] - 0.1, 0.01 / 2.9, 0.0),
    }
    found = kept_share(figures, judged, full)
    assert found.plain == pytest.approx(0.75, abs=1e-3)
    assert found.in_full == pytest.approx((1.05 / 1.025 - 0.9) / 0.2, abs=2e-3)
    many = round(2001 * found.in_full)
    assert binom.sf(many - 1, 2001, found.low) == pytest.approx(0.025, rel=1e-6)
    assert binom.cdf(many, 2001, found.high) == pytest.approx(0.025, rel=1e-6)
    judged[1] = Judgement(limits[1], "cannot be judged", 0, 2.9, math.nan, "")
    assert math.isnan(kept_share(figures, judged, full).in_full)


def test_a_machine_of_which_a_link_yields_keeps_no_limit():
    """A quarter of them yields, and all keep the limit of the deflection by half of it."""
    safety, deflection = np.array([0.9, 1.2, 1.3, 1.4]), np.full(4, 0.5)
    full = {"safety": FullColumn(safety, 0.0, 0.0), "deflection": FullColumn(deflection, 0.0, 0.0)}
    judged = [Judgement(Limit("deflection", 1.0), "kept", 0, 0.5, 0.0, "")]
    found = kept_share({"safety": safety, "deflection": deflection}, judged, full)
    assert (found.plain, found.in_full) == (0.75, 0.75)
