"""Limits, dead points, transmission, time and velocity ratios, and inverse kinematics, compared with closed forms."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from mechanisms import ALL, apex, four_bar, inverted_slider_crank, scotch_yoke, six_bar, slider_crank, triad, turn
from scipy.optimize import fsolve, minimize_scalar

from rigid import Link, Mechanism, MechanismError, PinDrive, Slider, motion, position_of
from rigid.analysis import (
    Distance,
    LinkAngle,
    Offset,
    PathLength,
    PointCoordinate,
    Slide,
    dead_points,
    drive_values,
    limits,
    swing,
    time_ratio,
    transmission_angles,
    velocity_ratio,
)
from rigid.analysis.crossings import zeros
from rigid.arrays import Reals


def bare_four_bar(crank, coupler, rocker, base, count=90, start=0.0, side=1.0):
    """Return a four-bar with its ground along x."""
    A = crank * np.exp(0.3j)
    links = (
        Link("ground", {"O": 0.0, "D": base}),
        Link("crank", {"O": 0.0, "A": crank}),
        Link("coupler", {"A": 0.0, "B": coupler}),
        Link("rocker", {"D": 0.0, "B": rocker}),
    )
    drawing = {"O": 0.0, "A": A, "B": apex(A, base, coupler, rocker, side), "D": base}
    return motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), turn(count, start))


def bare_slider_crank(crank, rod, offset, count=60):
    A = crank * np.exp(0.4j)
    B = A.real + math.sqrt(rod**2 - (offset - A.imag) ** 2) + 1j * offset
    links = (
        Link("ground", {"O": 0.0}),
        Link("crank", {"O": 0.0, "A": crank}),
        Link("rod", {"A": 0.0, "B": rod}),
        Link("block", {"B": 0.0}),
    )
    guide = Slider("guide", "block", "ground", "B", origin=1j * offset, direction=1.0)
    return motion(Mechanism(links, (PinDrive("crank", "O"),), {"O": 0.0, "A": A, "B": B}, (guide,)), turn(count))


def cosine_angle(adjacent, other, opposite):
    """Return the angle between two sides of a triangle."""
    return math.acos((adjacent**2 + other**2 - opposite**2) / (2 * adjacent * other))


class TestLimitsOfSwing:
    @pytest.mark.parametrize("count", [12, 90, 361])
    def test_a_rocker_reverses_if_crank_and_coupler_align(self, count):
        a, b, c, d = 0.11, 0.31, 0.24, 0.33
        course = bare_four_bar(a, b, c, d, count)
        low, high = swing(course, LinkAngle("rocker"))
        # The rocker's angle is measured at D, from the direction away from O.
        assert low.value == pytest.approx(math.pi - cosine_angle(d, c, b + a), abs=1e-14)
        assert high.value == pytest.approx(math.pi - cosine_angle(d, c, b - a), abs=1e-14)
        assert low.drive[0] % (2 * math.pi) == pytest.approx(cosine_angle(d, b + a, c), abs=1e-13)
        assert high.drive[0] % (2 * math.pi) == pytest.approx(math.pi + cosine_angle(d, b - a, c), abs=1e-13)
        assert [low.kind, high.kind] == ["minimum", "maximum"]

    def test_an_offset_slider_reverses_if_crank_and_rod_align(self):
        r, rod, e = 0.12, 0.4, 0.05
        low, high = swing(bare_slider_crank(r, rod, e), Slide("guide"))
        assert low.value == pytest.approx(math.sqrt((rod - r) ** 2 - e**2), abs=1e-15)
        assert high.value == pytest.approx(math.sqrt((rod + r) ** 2 - e**2), abs=1e-15)
        assert high.drive[0] == pytest.approx(math.asin(e / (rod + r)), abs=1e-13)

    def test_a_limit_at_a_position_is_found_once(self):
        found = limits(bare_slider_crank(0.12, 0.4, 0.0), Slide("guide"))
        assert sorted(limit.value for limit in found) == pytest.approx([0.28, 0.52], abs=1e-15)

    def test_a_rotating_link_has_no_limits(self):
        course = bare_four_bar(0.11, 0.31, 0.24, 0.33)
        assert limits(course, LinkAngle("crank")) == []
        with pytest.raises(MechanismError, match="does not swing"):
            swing(course, LinkAngle("crank"))

    def test_the_ends_of_an_open_motion_are_not_limits(self):
        mechanism = bare_four_bar(0.11, 0.31, 0.24, 0.33).mechanism
        found = limits(motion(mechanism, np.linspace(0.0, 1.5, 30)), LinkAngle("rocker"))
        assert [limit.kind for limit in found] == ["minimum"]

    def test_the_limits_of_a_general_group_agree_with_its_loop_equations(self):
        """The reference minimizes the plate's angle over a root finder's solution of the three bars."""
        case = triad(count=48)
        links = {link.name: link for link in case.mechanism.links}
        ground, points = links["ground"].points, links["plate"].points
        lengths = [abs(links[name].points[point]) for name, point in (("left", "P"), ("right", "Q"), ("top", "R"))]

        def plate_angle(angle):
            ends = [links["crank"].points["A"] * np.exp(1j * angle), ground["D"], ground["E"]]

            def gaps(unknown):
                place = unknown[0] + 1j * unknown[1]
                corners = [place + np.exp(1j * unknown[2]) * points[name] for name in "PQR"]
                return [abs(c - end) - size for c, end, size in zip(corners, ends, lengths, strict=True)]

            return fsolve(gaps, [0.05, 0.3, 0.0], xtol=1e-12)[2]

        low, high = swing(motion(case.mechanism, case.drive), LinkAngle("plate"))
        best = minimize_scalar(plate_angle, bounds=(low.drive[0] - 0.3, low.drive[0] + 0.3), method="bounded")
        assert low.value == pytest.approx(best.fun, abs=1e-11)
        best = minimize_scalar(
            lambda angle: -plate_angle(angle), bounds=(high.drive[0] - 0.3, high.drive[0] + 0.3), method="bounded"
        )
        assert high.value == pytest.approx(-best.fun, abs=1e-11)


class TestTimeRatio:
    def test_of_an_offset_slider_crank(self):
        r, rod, e = 0.12, 0.4, 0.2
        pole = math.asin(e / (rod - r)) - math.asin(e / (rod + r))
        expected = (math.pi + pole) / (math.pi - pole)
        assert time_ratio(bare_slider_crank(r, rod, e), Slide("guide")) == pytest.approx(expected, rel=1e-13)

    def test_is_one_for_a_central_slider(self):
        assert time_ratio(bare_slider_crank(0.12, 0.4, 0.0), Slide("guide")) == pytest.approx(1.0, abs=1e-13)

    def test_of_a_whitworth_quick_return(self):
        """Whitworth's rocker about D swings by 2 asin(r/d) for a crank of radius r at distance d."""
        course = motion(inverted_slider_crank(crank=0.1, base=0.25, foot=0.0, lean=0.0).mechanism, turn(40))
        expected = (math.pi + 2 * math.asin(0.4)) / (math.pi - 2 * math.asin(0.4))
        assert time_ratio(course, LinkAngle("rocker")) == pytest.approx(expected, rel=1e-13)

    def test_needs_a_full_turn(self):
        mechanism = slider_crank().mechanism
        with pytest.raises(MechanismError, match="turns fully"):
            time_ratio(motion(mechanism, np.linspace(0, 5, 30)), Slide("guide"))


class TestTransmission:
    def test_of_two_bars_by_the_cosine_law(self):
        a, b, c, d = 0.11, 0.31, 0.24, 0.33
        course = bare_four_bar(a, b, c, d)
        square = a**2 + d**2 - 2 * a * d * np.cos(course.drive[0])
        inner = np.arccos((b**2 + c**2 - square) / (2 * b * c))
        (found,) = transmission_angles(course)
        np.testing.assert_allclose(found.angle, np.minimum(inner, math.pi - inner), atol=1e-14)
        assert found.joint == "B"
        assert set(found.links) == {"coupler", "rocker"}

    def test_of_rod_and_slider_is_relative_to_the_normal(self):
        r, rod, e = 0.12, 0.4, 0.05
        course = bare_slider_crank(r, rod, e)
        (found,) = transmission_angles(course)
        np.testing.assert_allclose(np.cos(found.angle), np.abs(r * np.sin(course.drive[0]) - e) / rod, atol=1e-14)

    def test_of_a_straight_slot_through_the_pivot_is_a_right_angle(self):
        course = motion(inverted_slider_crank(foot=0.0, lean=0.0).mechanism, turn(10))
        (found,) = transmission_angles(course)
        np.testing.assert_allclose(found.angle, math.pi / 2, atol=1e-14)

    def test_of_two_slides_is_the_angle_of_their_lines(self):
        case = scotch_yoke(slant=1.3)
        (found,) = transmission_angles(motion(case.mechanism, case.drive))
        # In the yoke's axes, which are at 0.35, the slot is oblique; the rail is at 0.1.
        np.testing.assert_allclose(found.angle, 1.3 + 0.35 - 0.1, atol=1e-14)

    def test_of_every_dyad_of_a_six_bar(self):
        case = six_bar()
        found = transmission_angles(motion(case.mechanism, case.drive))
        assert [each.joint for each in found] == ["B", "Q"]


class TestVelocityRatio:
    def test_of_slide_and_crank(self):
        r, rod = 0.12, 0.4
        course = bare_slider_crank(r, rod, 0.0)
        angle = course.drive[0]
        expected = -r * np.sin(angle) - r**2 * np.sin(angle) * np.cos(angle) / np.sqrt(
            rod**2 - (r * np.sin(angle)) ** 2
        )
        found = velocity_ratio(course, Slide("guide"), LinkAngle("crank"))
        np.testing.assert_allclose(found, expected, atol=1e-15)

    def test_of_angles_equals_the_ratio_of_the_cut_base(self):
        """Kennedy: the line of the coupler divides the base in the ratio of the angular velocities."""
        course = bare_four_bar(0.11, 0.31, 0.24, 0.33)
        A, B = position_of(course, "crank", "A"), position_of(course, "rocker", "B")
        cut = A.real - A.imag * (B - A).real / (B - A).imag
        found = velocity_ratio(course, LinkAngle("rocker"), LinkAngle("crank"))
        np.testing.assert_allclose(found, cut / (cut - 0.33), rtol=1e-10)

    def test_of_a_path_is_the_radius_of_a_crank(self):
        course = bare_four_bar(0.11, 0.31, 0.24, 0.33)
        np.testing.assert_allclose(
            velocity_ratio(course, PathLength("crank", "A"), LinkAngle("crank")), 0.11, rtol=1e-14
        )

    @pytest.mark.parametrize("name", ALL)
    def test_of_every_kind_of_coordinate_is_the_derivative_of_its_value(self, name):
        """The reference is a difference of values over a small step of all drives."""
        case = ALL[name]()
        here = motion(case.mechanism, case.drive, case.rate)
        step = 1e-5
        ends = [motion(case.mechanism, case.drive + side * step * case.rate) for side in (-1, 1)]
        links = [link for link in case.mechanism.links if link.name != "ground"]
        one, other = links[0], links[-1]
        ends_of = (one.name, next(iter(one.points)), other.name, list(other.points)[-1])
        wanted = [LinkAngle(other.name, one.name), Offset(*ends_of), Distance(*ends_of)]
        wanted += [PointCoordinate(*ends_of[2:], along=0.6 + 0.8j)]
        wanted += [Slide(slider.name) for slider in case.mechanism.sliders]
        for coordinate in wanted:
            low, high = (np.angle(np.exp(1j * coordinate.value(end))) for end in ends)
            difference = np.angle(np.exp(1j * (high - low))) / (2 * step)
            np.testing.assert_allclose(coordinate.rate(here), difference, rtol=1e-6, atol=1e-6)


class TestDeadPoints:
    def test_a_crank_stops_if_coupler_and_rocker_are_in_line(self):
        a, b, c, d = 0.3, 0.2, 0.25, 0.4
        most = cosine_angle(a, d, b + c)
        course = bare_four_bar(a, b, c, d, count=72, start=-math.pi)
        found = dead_points(course)
        assert {point.kind for point in found} == {"stop"}
        assert sorted(point.drive[0] for point in found) == pytest.approx([-most, most], abs=1e-12)
        assert {point.joint for point in found} == {"B"}

    @pytest.mark.parametrize("count", [40, 41])
    def test_a_flat_parallelogram_is_singular(self, count):
        course = bare_four_bar(0.1, 0.3, 0.1, 0.3, count=count, start=0.7)
        found = dead_points(course)
        assert [point.kind for point in found] == ["singular"] * 2
        assert sorted(point.drive[0] for point in found) == pytest.approx([math.pi, 2 * math.pi], abs=1e-6)

    def test_a_crank_rocker_has_no_dead_point(self):
        assert dead_points(bare_four_bar(0.11, 0.31, 0.24, 0.33)) == []

    def test_a_slider_driven_slider_crank_stops_at_its_dead_centres(self):
        from rigid import SliderDrive

        given = bare_slider_crank(0.12, 0.4, 0.0).mechanism
        mechanism = Mechanism(given.links, (SliderDrive("guide"),), given.drawing, given.sliders)
        found = dead_points(motion(mechanism, np.linspace(0.2, 0.6, 41)))
        assert sorted(point.drive[0] for point in found) == pytest.approx([0.28, 0.52], abs=1e-12)
        assert {point.joint for point in found} == {"A"}


class TestInverse:
    def test_a_rocker_angle_has_two_crank_angles(self):
        a, b, c, d = 0.11, 0.31, 0.24, 0.33
        rocker = 1.7
        B = d + c * np.exp(1j * rocker)
        apart = cosine_angle(abs(B), a, b)
        expected = sorted((np.angle(B) + side * apart) % (2 * math.pi) for side in (1, -1))
        found = drive_values(bare_four_bar(a, b, c, d), LinkAngle("rocker"), rocker)
        assert found.shape == (1, 2)
        assert sorted(found[0] % (2 * math.pi)) == pytest.approx(expected, abs=1e-13)

    def test_angles_are_equal_up_to_whole_turns(self):
        course = bare_four_bar(0.11, 0.31, 0.24, 0.33)
        one, other = (drive_values(course, LinkAngle("rocker"), 1.7 + turns * 2 * math.pi) for turns in (0, -3))
        np.testing.assert_allclose(one, other, atol=1e-12)

    def test_a_crank_angle_has_one_solution(self):
        course = bare_four_bar(0.11, 0.31, 0.24, 0.33, count=12)
        for angle in (0.0, 1.0, math.pi, 6.0):
            found = drive_values(course, LinkAngle("crank"), angle)
            assert found[0] == pytest.approx([angle], abs=1e-13)

    @pytest.mark.parametrize("value", [0.03, -0.119])
    def test_height_and_side_of_a_crank_pin(self, value):
        course = bare_slider_crank(0.12, 0.4, 0.05)
        x = drive_values(course, PointCoordinate("crank", "A"), value)[0]
        assert sorted(x) == pytest.approx(sorted([math.acos(value / 0.12), 2 * math.pi - math.acos(value / 0.12)]))
        y = drive_values(course, Offset("crank", "A", "ground", "O"), value)[0]
        wanted = [math.asin(value / 0.12) % (2 * math.pi), math.pi - math.asin(value / 0.12)]
        assert sorted(y) == pytest.approx(sorted(wanted), abs=1e-12)

    def test_slide_and_distance(self):
        r, rod = 0.12, 0.4
        course = bare_slider_crank(r, rod, 0.0)
        angle = cosine_angle(r, 0.35, rod)
        for coordinate in (Slide("guide"), Distance("block", "B", "ground", "O")):
            found = drive_values(course, coordinate, 0.35)[0]
            assert sorted(found) == pytest.approx([angle, 2 * math.pi - angle], abs=1e-13)

    def test_a_value_touched_at_a_limit_is_one_solution(self):
        course = bare_slider_crank(0.12, 0.4, 0.05, count=61)
        top = math.sqrt(0.52**2 - 0.05**2)
        found = drive_values(course, Slide("guide"), top)
        assert found[0] == pytest.approx([math.asin(0.05 / 0.52)], abs=1e-7)

    def test_two_solutions_between_the_same_two_positions_are_both_found(self):
        course = bare_slider_crank(0.12, 0.4, 0.05, count=7)
        near = math.sqrt(0.52**2 - 0.05**2) - 1e-6
        assert drive_values(course, Slide("guide"), near).shape == (1, 2)

    def test_a_value_out_of_reach_has_no_solution(self):
        assert drive_values(bare_slider_crank(0.12, 0.4, 0.05), Slide("guide"), 0.6).shape == (1, 0)

    def test_the_last_position_of_an_open_motion_counts(self):
        mechanism = bare_slider_crank(0.12, 0.4, 0.05).mechanism
        course = motion(mechanism, np.linspace(0.5, 1.0, 6))
        found = drive_values(course, PointCoordinate("crank", "A", 1j), 0.12 * math.sin(1.0))
        assert found[0] == pytest.approx([1.0], abs=1e-13)

    @pytest.mark.parametrize(
        ("make", "coordinate"),
        [
            (four_bar, PointCoordinate("rocker", "B", 0.8 + 0.6j)),
            (slider_crank, PointCoordinate("rod", "B", 0.8 + 0.6j)),
            (inverted_slider_crank, LinkAngle("rocker")),
            (six_bar, Distance("swing", "Q", "crank", "A")),
            (triad, PointCoordinate("plate", "R", 1j)),
        ],
    )
    def test_inverse_kinematics_recovers_the_drive(self, make, coordinate):
        case = make(count=60)
        course = motion(case.mechanism, case.drive)
        wanted = case.drive[0, 7] + 0.0123
        value = float(coordinate.value(motion(case.mechanism, [case.drive[0, 0], wanted]))[1])
        found = drive_values(course, coordinate, value)[0]
        assert found.size <= 4
        assert np.abs(found - wanted).min() < 1e-11


@pytest.mark.parametrize(
    "shape",
    [np.sin, lambda x: x**3, lambda x: np.expm1(20 * x), np.cbrt, np.sign, lambda x: x],
    ids=["sine", "cube", "exponential", "cube root", "jump", "line"],
)
def test_zeros_are_found_to_round_off_between_their_ends(shape: Callable[[Reals], Reals]) -> None:
    places = np.array([0.0, 1e-9, 0.1, 1 / 3, 0.5, 0.9, 1.0 - 1e-9, 1.0])
    found = zeros(lambda part: shape(part - places), shape(-places), shape(1.0 - places))
    np.testing.assert_allclose(found, places, atol=2e-10)
