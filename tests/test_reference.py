"""All fields agree with independent references to round-off.

The references are a table of exact fields of a steel four-bar, Simeon's slider-crank, and solutions of every
mechanism by another method in 50 digits (exact.py).
"""

import json
from pathlib import Path

import mpmath
import numpy as np
import pytest
from exact import exact
from mechanisms import ALL, double_rocker, motion_of, simeon_slider_crank, steel_four_bar
from tiers import in_tiers

from elastic import PRIMARY, Section, deflection, extremes, sample
from rigid import motion, position_of

TABLE = json.loads((Path(__file__).parent / "data" / "steel_four_bar.json").read_text())
BARS = ("crank", "coupler", "rocker")
STATIONS = {"start": 0.0, "mid": 0.5, "end": 1.0}


@pytest.fixture(scope="module")
def steel():
    case = steel_four_bar()
    return deflection(motion_of(case), case.sections)


class TestSteelFourBar:
    """tests/data/steel_four_bar.json: 40-digit fields at five crank angles, maxima over the turn."""

    def test_the_mechanism_is_that_of_the_table(self, steel):
        scene = TABLE["scene"]
        area, inertia = scene["width"] * scene["depth"], scene["width"] * scene["depth"] ** 3 / 12
        assert [scene[name] for name in BARS] == list(steel.length[:, 0])
        np.testing.assert_allclose(steel.sections[0].EA, scene["E"] * area, rtol=1e-15)
        np.testing.assert_allclose(steel.sections[0].EI, scene["E"] * inertia, rtol=1e-15)
        assert steel.motion.mechanism.beams[0][1].mass_per_length == pytest.approx(scene["density"] * area, rel=1e-15)

    @pytest.mark.parametrize("row", TABLE["rows"], ids=lambda row: f"{row['crank_deg']} deg")
    def test_the_motion_has_the_reference_digits(self, steel, row):
        position, course = row["crank_deg"], steel.motion
        assert position_of(course, "rocker", "B")[position] == pytest.approx(complex(*row["B"]), rel=1e-14)
        np.testing.assert_allclose(course.angular_velocity[2:, position], row["omega"], rtol=1e-13)
        np.testing.assert_allclose(course.angular_acceleration[2:, position], row["eps"], rtol=1e-12)

    @pytest.mark.parametrize("field", PRIMARY)
    @pytest.mark.parametrize("row", TABLE["rows"], ids=lambda row: f"{row['crank_deg']} deg")
    def test_every_field_has_the_reference_digits(self, steel, row, field):
        got = sample(steel, field, list(STATIONS.values()))
        for number, name in enumerate(BARS):
            expected = [row[name][station][field] for station in STATIONS]
            greatest = np.abs(got[number]).max()
            np.testing.assert_allclose(got[number, row["crank_deg"]], expected, rtol=0, atol=1e-12 * greatest)

    @pytest.mark.parametrize("field", ["w", "chord", "N", "M", "u", "phi"])
    def test_maxima_at_the_tabulated_stations(self, steel, field):
        got = np.abs(sample(steel, field, np.linspace(0, 1, 401))).max(axis=(1, 2))
        np.testing.assert_allclose(got, [TABLE["maxima"][name][field] for name in BARS], rtol=1e-12)

    @pytest.mark.parametrize("field", ["w", "chord", "N", "M", "u", "phi"])
    def test_extremes_are_at_least_the_tabulated_ones(self, steel, field):
        """401 stations miss a smooth maximum by at most (h^2/8) max

        f''

        , h = 1/400: less than 1e-5 of it here.
        """
        got = np.abs(extremes(steel, [field])[field].value).max(axis=1)
        expected = np.array([TABLE["maxima"][name][field] for name in BARS])
        assert (got >= expected * (1 - 1e-12)).all()
        assert (got <= expected * (1 + 2e-5)).all()


class TestSimeonSliderCrank:
    """Tolerances are the printed digits."""

    def solved(self):
        case = simeon_slider_crank()
        return deflection(motion_of(case), case.sections)

    def test_load_on_the_rod(self):
        assert sample(self.solved(), "q_y", [0, 1])[1, 0] == pytest.approx([625.479186, -354.877376], abs=6e-7)

    def test_deflection_from_the_chord_at_mid_span(self):
        assert sample(self.solved(), "chord", [0.5])[1, 0, 0] == pytest.approx(2.090334574e-4, abs=6e-14)

    def test_simply_supported_beam_under_a_trapezoidal_load(self):
        """5 (q1 + q2)/2 l^4/(384 EI) at mid-span: Roark's Formulas, 8th ed., Table 8.1, case 2e."""
        solved = self.solved()
        q = np.mean([625.479186, -354.877376])
        EI = 2e11 * 0.008**4 / 12
        expected = 5 * q * 0.3**4 / (384 * EI)
        middle = sample(solved, "chord", [0.5])[1, 0, 0]
        assert middle == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("name", in_tiers(ALL, 5, 5))
@pytest.mark.parametrize("part", in_tiers([0.8, 0.0, 0.3], 1, 1))
def test_everything_equals_a_solution_in_fifty_digits(name, part):
    """The tolerance is 1e-13 of each field's maximum; the drive coordinates are arbitrary."""
    case = ALL[name]()
    position = round(part * (case.drive.shape[1] - 1))
    drive, rate, rate2 = (value[:, position] for value in (case.drive, case.rate, case.rate2))
    course = motion_of(case)
    solved = deflection(course, case.sections)
    other = exact(case.mechanism, case.sections, drive, rate, rate2)

    place, speed, growth = (np.array(value, float).reshape(-1, 3) for value in (other.q, other.rate, other.rate2))
    near = {"rtol": 1e-13, "atol": 1e-13}
    np.testing.assert_allclose(course.origin[1:, position], place[:, 0] + 1j * place[:, 1], **near)
    np.testing.assert_allclose(course.direction[1:, position], np.exp(1j * place[:, 2]), **near)
    for got, turned, expected in (
        (course.velocity, course.angular_velocity, speed),
        (course.acceleration, course.angular_acceleration, growth),
    ):
        scale = np.abs(expected).max()
        xy = expected[:, 0] + 1j * expected[:, 1]
        np.testing.assert_allclose(got[1:, position], xy, rtol=0, atol=1e-13 * scale)
        np.testing.assert_allclose(turned[1:, position], expected[:, 2], rtol=0, atol=1e-13 * scale)

    stations = np.linspace(0, 1, 7)
    for field in PRIMARY:
        got, expected = sample(solved, field, stations), other.sampled(field, stations)
        np.testing.assert_allclose(
            got[:, position], expected, rtol=0, atol=1e-13 * np.abs(got).max(), err_msg=f"{field} of the {name}"
        )


@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-6, 1e-8])
def test_accuracy_near_a_dead_point_is_its_condition(short):
    """Errors of motion and fields, relative to maxima, stay below 20 eps/s^2 for any closeness to alignment."""
    start = np.arccos((0.3**2 + 0.4**2 - 0.45**2) / (2 * 0.3 * 0.4)) - short
    mechanism = double_rocker(start)
    sections = [Section(3e5, 40.0), Section(4e5, 50.0), Section(5e5, 60.0)]
    course = motion(mechanism, [start], 7.0, -3.0)
    solved, other = deflection(course, sections), exact(mechanism, sections, [start], [7.0], [-3.0])
    allowed = 20 * np.finfo(float).eps * course.condition[0]
    assert course.condition[0] > 0.1 / short
    growth = np.array(other.rate2, float).reshape(-1, 3)[:, 2]
    np.testing.assert_allclose(course.angular_acceleration[1:, 0], growth, rtol=0, atol=allowed * abs(growth).max())
    for field in PRIMARY:
        expected = other.sampled(field, [0.0, 0.4, 1.0])
        got = sample(solved, field, [0.0, 0.4, 1.0])[:, 0]
        np.testing.assert_allclose(got, expected, rtol=0, atol=allowed * abs(expected).max(), err_msg=field)


def test_the_reference_solution_closes_to_fifty_digits():
    """Two links agree on a pin's position, and the end moments of a rod are 0 and the applied 1.5 - 0.5 N m."""
    case = ALL["six-bar"]()
    other = exact(case.mechanism, case.sections, case.drive[:, 3], case.rate[:, 3], case.rate2[:, 3])
    index = case.mechanism.index
    with mpmath.workdps(60):

        def place(link, point):
            x, y, angle = other.q[3 * index[link] - 3 : 3 * index[link]]
            return mpmath.mpc(x, y) + mpmath.expj(angle) * mpmath.mpc(case.mechanism.links[index[link]].points[point])

        assert abs(place("coupler", "P") - place("rod", "P")) < mpmath.mpf(10) ** -50
        rod = [at for at, _ in case.mechanism.beams].index(index["rod"])
        assert abs(other.at("M", rod, 0)) < mpmath.mpf(10) ** -44
        assert abs(other.at("M", rod, 1) - 1) < mpmath.mpf(10) ** -44
