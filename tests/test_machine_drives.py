"""Sizing of drives against closed forms and printed examples: averages, motors, flywheels, cylinders, balancing."""

import numpy as np
import pytest
from mechanisms import four_bar, replaced, slider_crank, turn

from machine import (
    Cylinder,
    Motor,
    available_torque,
    buckling_safety,
    energy_fluctuation,
    flow_rate,
    flywheel_inertia,
    inertia_matched_ratio,
    least_torque_ratio,
    mean_positive,
    motor_torque,
    root_mean_square,
    time_weights,
    working_pressure,
)
from machine.balance import (
    balanced,
    inertia_force,
    inertia_moment,
    pivoted_links,
    shaking_influences,
    spring_influences,
    weight_effort,
    weight_influences,
)
from rigid import Beam, Link, Lump, Mechanism, PinDrive, SegmentedLaw, drive_efforts, motion, reactions
from rigid.dynamics import kinetic_energy


class TestAverages:
    def test_root_mean_square_of_a_trapezoidal_profile(self):
        """Torques T1, T2, T3 for times t1, t2, t3, and a dwell: the textbook's closed form."""
        torque, duration = np.array([4.0, 0.5, -3.0, 0.2]), np.array([0.1, 0.3, 0.1, 0.5])
        expected = np.sqrt((16 * 0.1 + 0.25 * 0.3 + 9 * 0.1 + 0.04 * 0.5) / 1.0)
        assert root_mean_square(torque, duration) == pytest.approx(expected, rel=1e-15)

    def test_of_a_law_in_thirds_moving_a_disc(self):
        """Speed up, go, slow down, each a third of T: acceleration 4.5 h / T^2, its root mean square times root 2/3."""
        from rigid import Segment

        inertia, rise, duration, count = 0.3, 2.0, 0.6, 6001
        time = np.linspace(0, duration, count)
        law = SegmentedLaw(0.0, (Segment("trapezoidal-velocity", duration, rise),))
        disc = Link("disc", {"O": 0.0}, lumps=(Lump("O", 1.0, inertia),))
        mechanism = Mechanism((Link("ground", {"O": 0.0}), disc), (PinDrive("disc", "O"),), {"O": 0})
        course = motion(mechanism, *law(time), time)
        effort = drive_efforts(course, reactions(course))[0]
        peak = inertia * 4.5 * rise / duration**2
        assert np.abs(effort).max() == pytest.approx(peak, rel=1e-12)
        weight = time_weights(time)
        assert weight.sum() == pytest.approx(duration, rel=1e-12)
        assert root_mean_square(effort, weight) == pytest.approx(peak * np.sqrt(2 / 3), rel=1e-3)
        taken = duration * mean_positive(effort * course.drive_rate[0], weight)
        assert taken == pytest.approx(inertia * (1.5 * rise / duration) ** 2 / 2, rel=1e-3)

    def test_ends_of_a_run_count_half_but_not_those_of_a_cycle(self):
        time = np.linspace(0.0, 4.0, 5)
        assert time_weights(time).tolist() == time_weights(time, 4.0).tolist() == [0.5, 1.0, 1.0, 1.0, 0.5]
        assert time_weights(time, 5.0).tolist() == [1.0] * 5
        both = time_weights(np.array([time, 2 * time]), np.array([[5.0], [8.0]]))
        assert both.tolist() == [[1.0] * 5, [1.0, 2.0, 2.0, 2.0, 1.0]]


class TestMotors:
    def test_torque_through_a_gear_loses_both_ways(self):
        motor = Motor(rotor_inertia=2e-4, gear_inertia=1e-4, gear_ratio=10.0, efficiency=0.8)
        torque = motor_torque(motor, np.array([8.0, -8.0]), np.array([5.0, 5.0]), np.array([100.0, -100.0]))
        np.testing.assert_allclose(torque, [8 / 0.8 / 10 + 0.3, -8 * 0.8 / 10 - 0.3], rtol=1e-14)

    @pytest.mark.parametrize("efficiency", [1.0, 0.8])
    def test_least_ratio_is_that_of_a_search(self, efficiency):
        phase = turn(400, 0.0)
        rate, acceleration = 3 * np.sin(phase), 20 * np.cos(phase)
        effort = 6 * np.cos(phase) + 2 * np.sin(2 * phase) + 1.0

        def needed(ratio):
            motor = Motor(rotor_inertia=1e-3, gear_ratio=ratio, efficiency=efficiency)
            return root_mean_square(motor_torque(motor, effort, rate, acceleration))

        ratios = np.linspace(5, 60, 20001)
        searched = ratios[np.argmin([needed(ratio) for ratio in ratios[::10]]) * 10]
        motor = Motor(rotor_inertia=1e-3, gear_ratio=7.0, efficiency=efficiency)
        found = least_torque_ratio(motor, effort, rate, acceleration)
        assert found == pytest.approx(searched, abs=0.05)
        assert needed(float(found)) <= min(needed(float(found) * 0.99), needed(float(found) * 1.01))

    def test_least_ratio_of_inertia_alone_is_the_root_of_the_inertias(self):
        acceleration = 20 * np.cos(turn(90, 0.0))
        rate = np.full(90, 1.0)
        found = least_torque_ratio(Motor(rotor_inertia=1e-4), 0.09 * acceleration, rate, acceleration)
        assert found == pytest.approx(inertia_matched_ratio(0.09, 1e-4), rel=1e-12)
        assert found == pytest.approx(30.0, rel=1e-12)

    def test_least_ratio_is_held_by_the_top_speed(self):
        steady = Motor(rotor_inertia=1e-4, top_speed=300.0)
        found = least_torque_ratio(steady, np.full(9, 5.0), np.full(9, 20.0), np.zeros(9))
        assert found == pytest.approx(15.0)
        assert np.isnan(least_torque_ratio(Motor(rotor_inertia=1e-4), np.full(9, 5.0), np.full(9, 20.0), np.zeros(9)))

    def test_torque_that_is_there_falls_from_stall_to_the_top_speed(self):
        motor = Motor(stall_torque=4.0, peak_torque=3.0, top_speed=200.0)
        assert available_torque(motor, np.array([0.0, 100.0, -150.0, 250.0])).tolist() == [3.0, 2.0, 1.0, 0.0]
        assert available_torque(Motor(peak_torque=3.0), np.array([0.0, 100.0])).tolist() == [3.0, 3.0]
        assert np.isnan(available_torque(Motor(), np.array([1.0]))).all()


class TestFlywheels:
    def test_of_khurmis_two_stroke_engine(self):
        """Khurmi and Gupta, Theory of Machines, chapter 16: T = 1000 + 300 sin 2t - 500 cos 2t N m at 250 rpm.

        A flywheel of 400 kg with a radius of gyration of 0.4 m: 583.1 N m of fluctuation, 1.33 % of speed, 26.18 kW.
        """
        crank, speed = turn(720, 0.0), 250 * 2 * np.pi / 60
        torque = 1000 + 300 * np.sin(2 * crank) - 500 * np.cos(2 * crank)
        fluctuation = energy_fluctuation(torque, crank, 2 * np.pi)
        assert round(float(fluctuation), 1) == 583.1
        assert round(float(np.mean(torque) * speed / 1000), 2) == 26.18
        assert float(flywheel_inertia(fluctuation, 0.0133, speed)) == pytest.approx(400 * 0.4**2, rel=2e-3)

    def test_of_a_slider_crank_is_the_range_of_its_energy(self):
        """At a steady speed the crank stores what the masses lack: their kinetic energy, which is found on its own."""
        case = slider_crank()
        still = replaced(case.mechanism, gravity=0.0, loads=())
        course = motion(still, turn(720, 0.0), 20.0)
        effort = drive_efforts(course, reactions(course))[0]
        assert energy_fluctuation(effort, course.drive[0], 2 * np.pi) == pytest.approx(
            np.ptp(kinetic_energy(course)), rel=1e-4
        )

    def test_backwards_it_is_the_same(self):
        crank = turn(720, 0.0)
        torque = np.sin(crank) + 0.4 * np.cos(3 * crank)
        one, other = energy_fluctuation(torque, crank, 2 * np.pi), energy_fluctuation(torque, -crank, -2 * np.pi)
        assert one == pytest.approx(other, rel=1e-12)


class TestCylinders:
    CYLINDER = Cylinder(bore=0.05, rod=0.025, length=0.8, modulus=210e9)

    def test_pressure_and_flow_by_hand(self):
        """50 mm bore and 25 mm rod: 1963.5 and 1472.6 mm^2."""
        pressure = working_pressure(self.CYLINDER, np.array([10e3, -10e3]))
        np.testing.assert_allclose(pressure, [10e3 / 1963.495e-6, 10e3 / 1472.622e-6], rtol=1e-6)
        flow = flow_rate(self.CYLINDER, np.array([0.2, -0.2])) * 60e3
        np.testing.assert_allclose(flow, [23.562, 17.671], rtol=1e-4)  # l/min

    def test_euler_of_the_rod(self):
        """I = 19,175 mm^4: pi^2 210e9 19,175e-12 / 0.8^2 = 62.1 kN."""
        assert round(self.CYLINDER.buckling_load / 1e3, 1) == 62.1
        safety = buckling_safety(self.CYLINDER, np.array([31.05e3, -5.0, np.nan]))
        assert safety[0] == pytest.approx(2.0, rel=1e-3)
        assert np.isinf(safety[1])
        assert np.isnan(safety[2])


def any_four_bar():
    """A four-bar with masses off the lines of all its links."""
    masses = [(1.1, 0.01, 0.04 + 0.03j), (2.3, 0.05, 0.17 - 0.06j), (1.7, 0.03, 0.1 + 0.02j)]
    links = [
        Link(link.name, link.points, (), (Lump(next(iter(link.points)), *mass),))
        for link, mass in zip(four_bar().mechanism.links[1:], masses, strict=True)
    ]
    ground = four_bar().mechanism.links[0]
    return replaced(four_bar().mechanism, links=(ground, *links), loads=(), gravity=-9.81j)


def with_counterweights(mechanism, moments, pins):
    """Links with masses of 1 kg besides, which have these first moments about their pins."""
    links = list(mechanism.links)
    for number, moment in moments.items():
        link = links[number]
        lump = Lump(pins[number], 1.0, 0.0, moment)
        links[number] = Link(link.name, link.points, link.beams, (*link.lumps, lump))
    return replaced(mechanism, links=tuple(links))


class TestBalance:
    def moments(self, course, quantity, influences):
        pins = pivoted_links(course)
        found = balanced(quantity, [each for link in pins for each in influences(course, link)])
        pairs = found.amounts.reshape(-1, 2)
        return {link: complex(*pair) for link, pair in zip(pins, pairs, strict=True)}, pins, found

    def test_inertia_is_what_shakes_the_ground(self):
        course = motion(replaced(any_four_bar(), gravity=0.0), turn(40, 0.1), 12.0, 30.0)
        held = reactions(course)
        np.testing.assert_allclose(inertia_force(course), held.ground_force, atol=1e-12 * abs(held.ground_force).max())
        largest = np.abs(held.ground_moment).max()
        np.testing.assert_allclose(inertia_moment(course), held.ground_moment, atol=1e-12 * largest)

    def test_full_force_balance_of_the_four_bar(self):
        """Berkof and Lowen, J. Eng. Ind. 91 (1969): two counterweights, by their conditions, leave no shaking force."""
        mechanism = any_four_bar()
        course = motion(mechanism, turn(40, 0.1), 12.0, 30.0)
        moments, pins, found = self.moments(course, inertia_force(course), shaking_influences)
        assert found.share < 1e-12
        coupler = mechanism.links[2]
        (lump,), (at_crank, at_rocker) = coupler.lumps, [*coupler.points.values()]
        length = abs(at_rocker - at_crank)
        axis = (at_rocker - at_crank) / length
        near = lump.mass * (lump.offset / axis)  # about the crank's pin, along the coupler
        far = lump.mass * length - near  # about the rocker's, turned by half a turn
        crank, rocker = mechanism.links[1], mechanism.links[3]
        (first,), (third,) = crank.lumps, rocker.lumps
        crank_pin, rocker_pin = (link.points[pins[number]] for number, link in ((1, crank), (3, rocker)))
        (crank_end,) = (place - crank_pin for name, place in crank.points.items() if name != pins[1])
        (rocker_end,) = (place - rocker_pin for name, place in rocker.points.items() if name != pins[3])
        start = [next(iter(link.points.values())) for link in (crank, rocker)]
        own = [lump_.mass * (start_ + lump_.offset - pin)
               for lump_, start_, pin in ((first, start[0], crank_pin), (third, start[1], rocker_pin))]  # fmt: skip
        # Of either whole link: -m2 (l2 - r2 e^(i a2)) l1 / l2 and -m2 r2 e^(i a2) l3 / l2.
        assert moments[1] + own[0] == pytest.approx(-far * crank_end / length, rel=1e-9)
        assert moments[3] + own[1] == pytest.approx(-near * rocker_end / length, rel=1e-9)

    def test_the_balanced_four_bar_does_not_shake(self):
        """By the joint forces, at other speeds, with the counterweights as masses."""
        mechanism = any_four_bar()
        moments, pins, _ = self.moments(
            course := motion(mechanism, turn(40, 0.1), 12.0, 30.0), inertia_force(course), shaking_influences
        )
        heavier = motion(replaced(with_counterweights(mechanism, moments, pins), gravity=0.0), turn(31, 0.2), 7.0, -9.0)
        before = motion(replaced(mechanism, gravity=0.0), turn(31, 0.2), 7.0, -9.0)
        shaken = [np.abs(reactions(each).ground_force).max() for each in (heavier, before)]
        assert shaken[0] < 1e-12 * shaken[1]

    def test_balanced_weights_take_no_effort(self):
        """The same counterweights hold the machine's centre of mass still: its weight takes no effort."""
        mechanism = any_four_bar()
        course = motion(mechanism, turn(40, 0.1), 0.0)
        efforts = drive_efforts(course, reactions(course))
        np.testing.assert_allclose(weight_effort(course), efforts, atol=1e-12 * np.abs(efforts).max())
        moments, pins, found = self.moments(course, weight_effort(course), weight_influences)
        assert found.share < 1e-12
        still = motion(with_counterweights(mechanism, moments, pins), turn(31, 0.2), 0.0)
        assert np.abs(drive_efforts(still, reactions(still))).max() < 1e-11 * np.abs(efforts).max()

    def test_a_spring_holds_an_arm_that_was_made_for_it(self):
        """An arm whose effort falls with its angle as that of a spring does."""
        arm = Link("arm", {"O": 0.0, "A": 0.5}, (Beam("O", "A", 2.0),))
        course = motion(
            Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {}), np.linspace(0.2, 1.4, 20)
        )
        effort = 3.0 - 2.0 * (course.drive - course.drive[:, :1])
        found = balanced(effort, spring_influences(course, 1))
        np.testing.assert_allclose(found.amounts, [2.0, -3.0], rtol=1e-12)
        assert found.share < 1e-12
