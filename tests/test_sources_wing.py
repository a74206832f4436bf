"""The two-stage flapping wing reproduces the figures of its source, with recomputed values if the source is wrong.

Tolerances are half a unit of the last digit; see docs/sources.md.
"""

import numpy as np
import pytest
from sources import number, shipped, three_ways

from kinelast.scene.data import scene_motion
from rigid import Link, Mechanism, PinDrive, motion, position_of
from rigid.analysis import LinkAngle, swing, time_ratio, transmission_angles


@pytest.fixture(scope="module")
def course():
    return scene_motion(shipped("flapping_wing"), 3600)


class TestFlappingWing:
    """Wu, Zhang: the two-stage flapping wing."""

    @staticmethod
    def limits(course, link, beyond):
        """Return lower and upper limit of a wing's angle [deg], and the crank angles at these limits."""
        low, high = swing(course, LinkAngle(link))
        turn = np.degrees([low.value, high.value]) + beyond
        return (*((turn + 180) % 360 - 180), *(np.degrees([low.drive[0], high.drive[0]]) % 360))

    def test_the_smallest_transmission_angle(self, course):
        found = {each.joint: np.degrees(each.angle.min()) for each in transmission_angles(course)}
        assert found["C"] == pytest.approx(48.6414, abs=5e-5)
        assert round(found["C"], 1) == 48.6  # as printed
        # (6): crank and frame in line.
        assert found["C"] == pytest.approx(np.degrees(np.arccos((39**2 + 50**2 - (59 - 21) ** 2) / (2 * 39 * 50))))

    def test_the_amplitude_of_the_inner_wing(self, course):
        low, high, at_low, at_high = self.limits(course, "inner_wing", 0)
        assert (high, low) == (pytest.approx(44.4988, abs=5e-5), pytest.approx(-5.1991, abs=5e-5))
        assert high - low == pytest.approx(49.6979, abs=5e-5)
        assert (at_high, at_low) == (pytest.approx(293.09, abs=5e-3), pytest.approx(110.68, abs=5e-3))
        # (3), (4)
        angles = [np.degrees(np.arccos((50**2 + 59**2 - (39 + sign * 21) ** 2) / (2 * 50 * 59))) for sign in (-1, 1)]
        assert (high, -low) == (pytest.approx(61 - angles[0]), pytest.approx(angles[1] - 61))
        # Printed: 45, -5 and 50 deg are nominal values; the crank angles of 268 and 84 deg are not reproduced.
        assert (at_high, at_low) != (pytest.approx(268, abs=10), pytest.approx(84, abs=10))

    def test_the_time_ratio_of_the_inner_wing(self, course):
        ratio = time_ratio(course, LinkAngle("inner_wing"))
        assert ratio == pytest.approx(1.0271, abs=5e-5)  # printed 1.05
        assert 180 * (ratio - 1) / (ratio + 1) == pytest.approx(2.4095, abs=5e-5)  # printed 4 deg

    def test_the_amplitude_of_the_outer_wing(self, course):
        # Its local axis is along GF; GH is 75 deg further.
        low, high, *_ = self.limits(course, "outer_wing", 75)
        assert (high, low) == (pytest.approx(46.4856, abs=5e-5), pytest.approx(-18.7120, abs=5e-5))
        assert high - low == pytest.approx(65.1976, abs=5e-5)  # printed 74, from a lower limit of -28

    @pytest.mark.parametrize(
        ("link", "speeds", "accelerations"),
        [("inner_wing", (11.101, -14.021), (510.64, -252.23)), ("outer_wing", (13.809, -17.042), (294.14, -649.60))],
    )
    def test_speeds_and_accelerations(self, course, link, speeds, accelerations):
        at = number(course, link)
        for values, (high, low), unit in (
            (course.angular_velocity[at], speeds, 1e-3), (course.angular_acceleration[at], accelerations, 1e-2)
        ):  # fmt: skip
            assert (values.max(), values.min()) == (
                pytest.approx(high, abs=0.6 * unit),
                pytest.approx(low, abs=0.6 * unit),
            )

    def test_parallelogram_keeps_the_outer_wing_parallel_to_the_coupler(self, course):
        outer, coupler = (number(course, name) for name in ("outer_wing", "coupler"))
        assert course.angular_velocity[outer] == pytest.approx(course.angular_velocity[coupler], abs=1e-11)
        # alpha_4 = alpha_2 + 255 deg
        between = course.direction[outer] * np.exp(1j * np.radians(75)) / course.direction[coupler]
        assert between == pytest.approx(np.full(3600, np.exp(1j * np.radians(255))), abs=1e-13)

    def test_the_printed_rates_of_the_outer_wing_are_wrong(self, course):
        # (27), (28) neglect the change of l_EG. gamma_1 + gamma_2 is the angle CGF, with the rate omega_4 - omega_3.
        w2, w3, w4 = (course.angular_velocity[number(course, name)] for name in ("coupler", "inner_wing", "outer_wing"))
        C, E, G, F = (
            position_of(course, *ends) for ends in (("coupler", "C"), ("rod", "E"), ("inner_wing", "G"), ("rod", "F"))
        )
        CE, CG, EG = np.abs(C - E), np.abs(C - G), np.abs(E - G)
        gamma1 = np.arccos((EG**2 + np.abs(F - G) ** 2 - np.abs(E - F) ** 2) / (2 * EG * np.abs(F - G)))
        gamma2 = np.arccos((CG**2 + EG**2 - CE**2) / (2 * CG * EG))
        between = np.angle(course.direction[number(course, "coupler")] / course.direction[number(course, "inner_wing")])
        printed = np.cos(between) / EG * (CG / np.cos(gamma1) + CE / np.cos(gamma2)) * (w2 - w3)
        assert np.abs(printed - (w4 - w3)).max() > 0.5 * np.abs(w4 - w3).max()
        # Numerical derivative of (18) over the turn.
        wave = np.fft.rfft(gamma1 + gamma2)
        order = 1j * np.arange(len(wave)) * course.drive_rate[0, 0]
        np.testing.assert_allclose(np.fft.irfft(order * wave, 3600), w4 - w3, atol=1e-8 * np.abs(w4).max())

    def test_closed_forms_of_speed_and_acceleration(self, course):
        # (25), (30), with alpha_3 along DC: the inner wing's local axis rotated by 180 deg.
        a1, a2, a3 = (np.angle(course.direction[number(course, name)]) for name in ("crank", "coupler", "inner_wing"))
        a3 = a3 + np.pi
        w1, w2, w3 = (course.angular_velocity[number(course, name)] for name in ("crank", "coupler", "inner_wing"))
        assert 21 * np.sin(a1 - a2) / (50 * np.sin(a3 - a2)) * w1 == pytest.approx(w3, abs=1e-10)
        found = -(w1**2) * 21 * np.cos(a1 - a2) + w3**2 * 50 * np.cos(a2 - a3) - w2**2 * 39
        found = found / (50 * np.sin(a2 - a3))
        assert found == pytest.approx(course.angular_acceleration[number(course, "inner_wing")], abs=1e-9)

    def test_the_left_wing_is_the_mirror_image_of_the_right(self, course):
        for link, point in (("outer_wing", "H"), ("inner_wing", "G"), ("crank", "B")):
            right = position_of(course, link, point)
            left = position_of(course, f"left_{link}", point.lower())
            assert left == pytest.approx(-right.conjugate(), abs=1e-12)

    def test_effort_three_ways(self, course):
        ways = three_ways(course)
        assert np.abs(ways[1:] - ways[0]).max() < 1e-11 * np.abs(ways[0]).max()


class TestFlappingWingSizing:
    """Lengths from limits of swing and transmission angle: (3), (4) and (6) of the source for a given frame angle."""

    @staticmethod
    def lengths(upper, lower, transmission, rocker, frame_angle):
        """Return crank, coupler and frame in the unit of the rocker; angles in rad."""
        from scipy.optimize import fsolve

        def rest(unknown):
            crank, coupler, frame = unknown
            cosines = [
                (rocker**2 + frame**2 - (coupler + sign * crank) ** 2) / (2 * rocker * frame) for sign in (-1, 1)
            ]
            least = (coupler**2 + rocker**2 - (frame - crank) ** 2) / (2 * coupler * rocker)
            wanted = np.cos([frame_angle - upper, frame_angle - lower, transmission])
            return np.array([*cosines, least]) - wanted

        found, _, success, message = fsolve(rest, np.array([0.4, 0.8, 1.2]) * rocker, full_output=True, xtol=1e-13)
        assert success == 1, message
        return found

    def test_rounded_lengths_are_the_printed_ones(self):
        found = self.lengths(*np.radians([45, -5, 48]), 50.0, np.radians(61))
        assert found == pytest.approx([21, 39, 59], abs=0.6)

    def test_a_machine_of_these_lengths_has_the_required_limits(self):
        crank, coupler, frame = self.lengths(*np.radians([45, -5, 48]), 50.0, np.radians(61))
        D = frame * np.exp(1j * np.radians(61))
        links = (
            Link("ground", {"A": 0, "D": D}),
            Link("crank", {"A": 0, "B": crank}),
            Link("coupler", {"B": 0, "C": coupler}),
            Link("rocker", {"C": 0, "D": 50.0}),
        )
        built = Mechanism(links, (PinDrive("crank", "A"),), {"A": 0, "B": 21, "C": -11.4 + 21.7j, "D": D})
        course = motion(built, np.linspace(0, 2 * np.pi, 720, endpoint=False))
        low, high = swing(course, LinkAngle("rocker"))
        assert np.degrees([high.value, low.value]) == pytest.approx([45, -5], abs=1e-9)
        at = motion(built, [np.radians(61)])
        assert np.degrees(transmission_angles(at)[0].angle[0]) == pytest.approx(48, abs=1e-9)
