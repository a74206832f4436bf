"""Sizing of drives: averages, motors, flywheels, cylinders and balancing, by closed forms and printed examples."""

import json
import re
import tomllib

import numpy as np
import pytest
from mechanisms import four_bar, replaced, slider_crank, turn, with_lump

from kinelast import scene_from_dict, shipped_scenes
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.designs.base import base_of
from kinelast.figures.peaks import run_figures
from kinelast.reports.summary import report_of
from kinelast.runs import computed
from kinelast.scene.document import document_from_dict, document_of
from kinelast.tasks.request import Request
from machine.drives import (
    Cylinder,
    Motor,
    available_torque,
    balanced,
    buckling_safety,
    energy_fluctuation,
    flow_rate,
    flywheel_inertia,
    inertia_force,
    inertia_matched_ratio,
    inertia_moment,
    least_torque_ratio,
    mean_positive,
    motor_torque,
    pivoted_links,
    root_mean_square,
    shaking_influences,
    spring_influences,
    time_weights,
    weight_effort,
    weight_influences,
    working_pressure,
)
from rigid import Beam, Link, Lump, Mechanism, PinDrive, Segment, SegmentedLaw, drive_efforts, motion, reactions
from rigid.kinetostatics import kinetic_energy


class TestAverages:
    def test_root_mean_square_of_a_trapezoidal_profile(self):
        """Torques T1, T2, T3 for times t1, t2, t3, and a dwell: textbook formula."""
        torque, duration = np.array([4.0, 0.5, -3.0, 0.2]), np.array([0.1, 0.3, 0.1, 0.5])
        expected = np.sqrt((16 * 0.1 + 0.25 * 0.3 + 9 * 0.1 + 0.04 * 0.5) / 1.0)
        assert root_mean_square(torque, duration) == pytest.approx(expected, rel=1e-15)

    def test_trapezoidal_velocity_of_a_disc(self):
        """Acceleration, constant speed and deceleration, a third each: 4.5 h / T^2, with rms factor sqrt(2/3)."""
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

    def test_end_weights_are_half_in_a_run_and_full_in_a_cycle(self):
        time = np.linspace(0.0, 4.0, 5)
        assert time_weights(time).tolist() == time_weights(time, 4.0).tolist() == [0.5, 1.0, 1.0, 1.0, 0.5]
        assert time_weights(time, 5.0).tolist() == [1.0] * 5
        both = time_weights(np.array([time, 2 * time]), np.array([[5.0], [8.0]]))
        assert both.tolist() == [[1.0] * 5, [1.0, 2.0, 2.0, 2.0, 1.0]]


class TestMotors:
    def test_gear_losses_act_in_both_directions(self):
        motor = Motor(rotor_inertia=2e-4, gear_inertia=1e-4, gear_ratio=10.0, efficiency=0.8)
        torque = motor_torque(motor, np.array([8.0, -8.0]), np.array([5.0, 5.0]), np.array([100.0, -100.0]))
        np.testing.assert_allclose(torque, [8 / 0.8 / 10 + 0.3, -8 * 0.8 / 10 - 0.3], rtol=1e-14)

    @pytest.mark.parametrize("efficiency", [1.0, 0.8])
    def test_the_best_ratio_agrees_with_a_search(self, efficiency):
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

    def test_the_best_ratio_of_pure_inertia_is_the_root_of_the_inertias(self):
        acceleration = 20 * np.cos(turn(90, 0.0))
        rate = np.full(90, 1.0)
        found = least_torque_ratio(Motor(rotor_inertia=1e-4), 0.09 * acceleration, rate, acceleration)
        assert found == pytest.approx(inertia_matched_ratio(0.09, 1e-4), rel=1e-12)
        assert found == pytest.approx(30.0, rel=1e-12)

    def test_the_top_speed_bounds_the_best_ratio(self):
        steady = Motor(rotor_inertia=1e-4, top_speed=300.0)
        found = least_torque_ratio(steady, np.full(9, 5.0), np.full(9, 20.0), np.zeros(9))
        assert found == pytest.approx(15.0)
        assert np.isnan(least_torque_ratio(Motor(rotor_inertia=1e-4), np.full(9, 5.0), np.full(9, 20.0), np.zeros(9)))

    def test_the_rated_speed_bounds_the_mean_speed_at_the_best_ratio(self):
        """Half of the time at 20 rad/s, the other half at rest: the mean is 10 rad/s."""
        rate = np.array([20.0, 0.0] * 4)
        motor = Motor(rotor_inertia=1e-9, rated_speed=300.0, top_speed=900.0)
        assert least_torque_ratio(motor, np.full(8, 5.0), rate, np.ones(8)) == pytest.approx(30.0)
        slower = Motor(rotor_inertia=1e-9, rated_speed=300.0, top_speed=500.0)
        assert least_torque_ratio(slower, np.full(8, 5.0), rate, np.ones(8)) == pytest.approx(25.0)

    def test_the_available_torque_decreases_to_the_top_speed(self):
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

    def test_of_a_slider_crank_equals_the_range_of_kinetic_energy(self):
        """At constant speed the flywheel stores the kinetic energy that the masses lose."""
        case = slider_crank()
        still = replaced(case.mechanism, gravity=0.0, loads=())
        course = motion(still, turn(720, 0.0), 20.0)
        effort = drive_efforts(course, reactions(course))[0]
        assert energy_fluctuation(effort, course.drive[0], 2 * np.pi) == pytest.approx(
            np.ptp(kinetic_energy(course)), rel=1e-4
        )

    def test_reversed_rotation_has_the_same_fluctuation(self):
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
    """Return a four-bar with eccentric masses on all links."""
    masses = [(1.1, 0.01, 0.04 + 0.03j), (2.3, 0.05, 0.17 - 0.06j), (1.7, 0.03, 0.1 + 0.02j)]
    links = [
        Link(link.name, link.points, (), (Lump(next(iter(link.points)), *mass),))
        for link, mass in zip(four_bar().mechanism.links[1:], masses, strict=True)
    ]
    ground = four_bar().mechanism.links[0]
    return replaced(four_bar().mechanism, links=(ground, *links), loads=(), gravity=-9.81j)


def with_counterweights(mechanism, moments, pins):
    """Return links with additional masses of 1 kg that have the given first moments about their pins."""
    for number, moment in moments.items():
        mechanism = with_lump(mechanism, mechanism.links[number].name, Lump(pins[number], 1.0, 0.0, moment))
    return mechanism


class TestBalance:
    def moments(self, course, quantity, influences):
        pins = pivoted_links(course)
        found = balanced(quantity, [each for link in pins for each in influences(course, link)])
        pairs = found.amounts.reshape(-1, 2)
        return {link: complex(*pair) for link, pair in zip(pins, pairs, strict=True)}, pins, found

    def test_the_shaking_force_is_the_inertia_force(self):
        course = motion(replaced(any_four_bar(), gravity=0.0), turn(40, 0.1), 12.0, 30.0)
        held = reactions(course)
        np.testing.assert_allclose(inertia_force(course), held.ground_force, atol=1e-12 * abs(held.ground_force).max())
        largest = np.abs(held.ground_moment).max()
        np.testing.assert_allclose(inertia_moment(course), held.ground_moment, atol=1e-12 * largest)

    def test_full_force_balance_of_the_four_bar(self):
        """Berkof and Lowen, J. Eng. Ind. 91 (1969): two counterweights remove the shaking force."""
        mechanism = any_four_bar()
        course = motion(mechanism, turn(40, 0.1), 12.0, 30.0)
        moments, pins, found = self.moments(course, inertia_force(course), shaking_influences)
        assert found.share < 1e-12
        coupler = mechanism.links[2]
        (lump,), (at_crank, at_rocker) = coupler.lumps, [*coupler.points.values()]
        length = abs(at_rocker - at_crank)
        axis = (at_rocker - at_crank) / length
        near = lump.mass * (lump.offset / axis)  # about the crank's pin, along the coupler
        far = lump.mass * length - near  # about the rocker's pin, in the opposite direction
        crank, rocker = mechanism.links[1], mechanism.links[3]
        (first,), (third,) = crank.lumps, rocker.lumps
        crank_pin, rocker_pin = (link.points[pins[number]] for number, link in ((1, crank), (3, rocker)))
        (crank_end,) = (place - crank_pin for name, place in crank.points.items() if name != pins[1])
        (rocker_end,) = (place - rocker_pin for name, place in rocker.points.items() if name != pins[3])
        start = [next(iter(link.points.values())) for link in (crank, rocker)]
        own = [lump_.mass * (start_ + lump_.offset - pin)
               for lump_, start_, pin in ((first, start[0], crank_pin), (third, start[1], rocker_pin))]  # fmt: skip
        # For the whole links: -m2 (l2 - r2 e^(i a2)) l1 / l2 and -m2 r2 e^(i a2) l3 / l2.
        assert moments[1] + own[0] == pytest.approx(-far * crank_end / length, rel=1e-9)
        assert moments[3] + own[1] == pytest.approx(-near * rocker_end / length, rel=1e-9)

    def test_the_balanced_four_bar_does_not_shake(self):
        """The joint forces at other speeds, with counterweights as masses, have no resultant."""
        mechanism = any_four_bar()
        moments, pins, _ = self.moments(
            course := motion(mechanism, turn(40, 0.1), 12.0, 30.0), inertia_force(course), shaking_influences
        )
        heavier = motion(replaced(with_counterweights(mechanism, moments, pins), gravity=0.0), turn(31, 0.2), 7.0, -9.0)
        before = motion(replaced(mechanism, gravity=0.0), turn(31, 0.2), 7.0, -9.0)
        shaken = [np.abs(reactions(each).ground_force).max() for each in (heavier, before)]
        assert shaken[0] < 1e-12 * shaken[1]

    def test_balanced_weights_need_no_effort(self):
        """The same counterweights fix the centre of mass, so that the weight needs no effort."""
        mechanism = any_four_bar()
        course = motion(mechanism, turn(40, 0.1), 0.0)
        efforts = drive_efforts(course, reactions(course))
        np.testing.assert_allclose(weight_effort(course), efforts, atol=1e-12 * np.abs(efforts).max())
        moments, pins, found = self.moments(course, weight_effort(course), weight_influences)
        assert found.share < 1e-12
        still = motion(with_counterweights(mechanism, moments, pins), turn(31, 0.2), 0.0)
        assert np.abs(drive_efforts(still, reactions(still))).max() < 1e-11 * np.abs(efforts).max()

    def test_a_spring_balances_a_suitable_arm(self):
        """The effort of the arm is linear in its angle, like that of a spring."""
        arm = Link("arm", {"O": 0.0, "A": 0.5}, (Beam("O", "A", 2.0),))
        course = motion(
            Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {}), np.linspace(0.2, 1.4, 20)
        )
        effort = 3.0 - 2.0 * (course.drive - course.drive[:, :1])
        found = balanced(effort, spring_influences(course, 1))
        np.testing.assert_allclose(found.amounts, [2.0, -3.0], rtol=1e-12)
        assert found.share < 1e-12


PUSHED = """
units = "mm"
points = {O = [0, 0], A = [0, 60], B = [180, 20]}
links.ground = {points = ["O"]}
links.crank = {points = ["O", "A"], rigid = true, mass = 0}
links.rod = {points = ["A", "B"], rigid = true, mass = 0}
links.ram = {points = ["B"], mass = "4 kg"}
sliders.rail = {link = "ram", through = "B", direction = "0 deg"}
[[drives]]
link = "crank"
speed = "120 rpm"
motor = "servo"
unevenness = "2 %"
[motors.servo]
rated_torque = "1 N m"
top_speed = "3000 rpm"
rotor_inertia = "2e-4 kg m^2"
gear_ratio = 20
inertia_ratio = 3
[run]
output = "B"
positions = 720
"""


def figures_of(text, tmp_path, *options):
    scene = tmp_path / "scene.toml"
    scene.write_text(text)
    status = main([str(scene), "-o", str(tmp_path / "out"), "--quiet", *options])
    return status, json.loads((tmp_path / "out" / "scene" / "summary.json").read_text())


@pytest.mark.parametrize("positions", [40, 41])
def test_a_motor_beyond_its_top_speed_has_no_torque(positions):
    """The cycloidal law reaches pi rad/s, 314 rad/s at the motor."""
    tables = {
        "points": {"O": [0, 0], "A": [0.1, 0]},
        "links": {
            "ground": {"points": ["O"]},
            "arm": {"points": ["O", "A"], "rigid": True, "mass": 1, "center": "O", "inertia": 0.01},
        },
        "drives": [{"link": "arm", "motor": "m", "repeat": True, "law": [
            {"curve": "cycloidal", "duration": 1, "by": way * np.pi / 2} for way in (1, -1)]}],
        "motors": {"m": {"gear_ratio": 100, "stall_torque": 10, "top_speed": 299, "efficiency": "100 %"}},
        "run": {"positions": positions},
    }  # fmt: skip
    results = computed(scene_from_dict(tables), Request())
    assert results.figures.peaks["motor_use"][0].value == np.inf
    rows = {row.kind: row.outcome for row in report_of(results).acceptance.limits}
    assert rows == {"motor_speed": "not kept", "motor_use": "not kept"}
    tables["motors"]["m"]["top_speed"] = 400
    assert computed(scene_from_dict(tables), Request()).figures.peaks["motor_use"][0].value < 1.0


def test_motors_of_many_designs():
    """The best gear ratio of each rated speed; a design is a row of the sweep."""
    tables = {
        "sections": {"bar": {"shape": "rectangle", "depth": 0.01, "width": 0.01}},
        "points": {"O": [0, 0], "A": [0.1, 0]},
        "links": {"ground": {"points": ["O"]}, "arm": {"points": ["O", "A"], "section": "bar", "material": "S235"}},
        "drives": [{"link": "arm", "motor": "m", "speed": 20}],
        "motors": {"m": {"gear_ratio": 2, "rated_speed": 300}},
        "run": {"positions": 12},
    }
    found = evaluate(tables, ["motors.m.rated_speed"], [[300.0], [500.0]], ["least_ratio"])
    assert found.columns["least_ratio"] == pytest.approx([15.0, 25.0])


PHASE = turn(400, 0.0)  # of a cycloidal rise of a quarter turn in 1 s, geared down 100 times
USE = (0.0101 * np.pi**2 * np.abs(np.sin(PHASE)) / (10 * (1 - 50 * np.pi * (1 - np.cos(PHASE)) / 400))).max()


@pytest.mark.parametrize(
    ("number", "values", "figure", "expected"),
    [
        ("rotor_inertia", [1e-4, 2e-4], "least_ratio", [10.0, 50**0.5]),  # the root of 0.01 kg m^2 over the inertia
        ("gear_ratio", [50.0, 100.0], "motor_speed", [50 * np.pi, 100 * np.pi]),
        ("top_speed", [299.0, 400.0], "motor_use", [np.inf, USE]),
        ("rated_speed", [5.0, 10.0], "least_ratio", [10 / np.pi, 20 / np.pi]),  # the mean speed of the arm is pi/2
    ],
)
def test_motors_of_many_designs_of_rigid_links(number, values, figure, expected):
    law = [{"curve": "cycloidal", "duration": 1, "by": way * np.pi / 2} for way in (1, -1)]
    tables = {
        "points": {"O": [0, 0], "A": [0.1, 0]},
        "links": {
            "ground": {"points": ["O"]},
            "arm": {"points": ["O", "A"], "rigid": True, "mass": 1, "center": "O", "inertia": 0.01},
        },
        "drives": [{"link": "arm", "motor": "m", "repeat": True, "law": law}],
        "motors": {
            "m": {"gear_ratio": 100, "stall_torque": 10, "top_speed": 400, "rotor_inertia": 1e-4, "rated_speed": 1e4}
        },
        "run": {"positions": 400},
    }
    found = evaluate(tables, [f"motors.m.{number}"], [[value] for value in values], [figure])
    assert found.columns[figure] == pytest.approx(expected, rel=2e-3)


class TestScene:
    """Slider-crank with massless crank and rod: the torque m s'' ds/dq has a closed form."""

    def test_figures_of_a_slider_crank(self, tmp_path):
        status, summary = figures_of(PUSHED, tmp_path)
        crank, rod, offset, mass, speed = 0.06, np.hypot(0.18, 0.04), 0.02, 4.0, 4 * np.pi
        angle = turn(1440, np.pi / 2)  # 720 positions, and the instants between them
        height = crank * np.sin(angle) - offset
        reach = np.sqrt(rod**2 - height**2)
        rate = -crank * np.sin(angle) - height * crank * np.cos(angle) / reach
        bend = -(crank**2) * np.cos(angle) ** 2 / reach + height * crank * np.sin(angle) / reach
        second = -crank * np.cos(angle) + bend - (height * crank * np.cos(angle)) ** 2 / reach**3
        torque = mass * speed**2 * second * rate
        found = {key: figure["value"] for key, figure in summary["figures"].items()}
        assert abs(found["drive_effort"]) == pytest.approx(np.abs(torque).max(), rel=1e-9)
        assert found["drive_rms"] == pytest.approx(np.sqrt(np.mean(torque**2)), rel=1e-9)
        assert found["drive_mean"] == pytest.approx(0.0, abs=1e-9)
        assert found["drive_power"] == pytest.approx((torque * speed)[np.abs(torque).argmax()], rel=1e-9)
        assert found["load_inertia"] == pytest.approx(mass * (rate**2).max(), rel=1e-9)
        stored = mass * speed**2 * (rate**2).max() / 2
        assert found["energy_fluctuation"] == pytest.approx(stored, rel=1e-4)
        assert found["flywheel"] == pytest.approx(stored / (0.02 * speed**2), rel=1e-4)
        halves = [mass * speed**2 * (rate**2)[way].max() / 2 for way in (rate > 0, rate < 0)]
        assert found["energy_taken"] == pytest.approx(sum(halves), rel=1e-4)
        assert found["energy_given"] == pytest.approx(sum(halves), rel=1e-4)
        assert found["motor_rms"] == pytest.approx(found["drive_rms"] / 20, rel=1e-12)
        assert found["inertia_ratio"] == pytest.approx(found["load_inertia"] / (400 * 2e-4), rel=1e-12)
        assert found["matched_ratio"] == pytest.approx(np.sqrt(mass * np.mean(rate**2) / 2e-4), rel=1e-4)
        named = {key: summary["figures"][key]["name"] for key in ("inertia_ratio", "matched_ratio")}
        assert named["inertia_ratio"].startswith("largest load inertia")
        assert named["matched_ratio"].endswith("the mean load inertia")
        assert found["least_ratio"] == pytest.approx(3000 / 120)
        motion_ = summary["output"]["motion"]
        stroke = np.sqrt((rod + crank) ** 2 - offset**2) - np.sqrt((rod - crank) ** 2 - offset**2)
        assert motion_["stroke"]["value"] == pytest.approx(stroke, rel=1e-7)
        assert motion_["advantage"]["value"] == pytest.approx(1 / np.abs(rate).max(), rel=1e-5)  # at the positions
        dead = [np.arcsin(offset / (rod + crank)), np.pi + np.arcsin(offset / (rod - crank))]
        turned = sorted(next(iter(each["drive"].values()))["value"] % (2 * np.pi) for each in motion_["turns"])
        np.testing.assert_allclose(turned, dead, atol=1e-9)
        part = dead[1] - dead[0]
        ratio = max(part, 2 * np.pi - part) / min(part, 2 * np.pi - part)
        assert motion_["time_ratio"]["value"] == pytest.approx(ratio, rel=1e-4)
        assert status == 0
        assert {row["kind"]: row["outcome"] for row in summary["acceptance"]["limits"]} == {
            "motor_rms": "kept",
            "motor_speed": "kept",
            "inertia_ratio": "kept",
        }

    def test_an_overloaded_motor_is_reported(self, tmp_path, capsys):
        weak = PUSHED.replace('"1 N m"', '"0.01 N m"').replace("gear_ratio = 20", "gear_ratio = 26")
        status, summary = figures_of(weak, tmp_path)
        assert status == 1
        broken = {row["kind"] for row in summary["acceptance"]["limits"] if row["outcome"] == "not kept"}
        assert broken == {"motor_rms", "motor_speed"}

    def test_rotors_are_part_of_an_integrated_motion(self, tmp_path):
        """The effort is that of motor and gear, including their inertia."""
        effort = PUSHED.replace('speed = "120 rpm"', 'effort = "0.2 N m"').replace('unevenness = "2 %"\n', "")
        effort = effort.replace('output = "B"', 'duration = "2 s"')
        _, summary = figures_of(effort, tmp_path)
        drive = summary["drives"]["crank"]
        assert drive["mean"]["value"] == pytest.approx(0.2, rel=1e-6)
        assert drive["rms"]["value"] == pytest.approx(0.2, rel=1e-6)
        assert abs(drive["effort"]["value"]) == pytest.approx(0.2, rel=1e-6)

    @pytest.mark.parametrize(
        ("old", "new", "message"),
        [
            ('motor = "servo"', 'motor = "servos"', 'there is no motor "servos"'),
            ("gear_ratio = 20", 'gear_ratio = "5 mm/rad"', 'because "crank" turns'),
            ('motor = "servo"', 'cylinder = "servo"', 'there is no cylinder "servo"'),
            ('speed = "120 rpm"', 'law = [{curve = "cycloidal", duration = "1 s", by = "90 deg"}]', "constant speed"),
        ],
    )
    def test_mistakes_of_drives_are_named(self, tmp_path, capsys, old, new, message):
        scene = tmp_path / "scene.toml"
        scene.write_text(PUSHED.replace(old, new))
        assert main([str(scene), "-o", str(tmp_path / "out")]) == 2
        assert message in capsys.readouterr().err

    @pytest.mark.parametrize(("length", "outcome"), [(0.4, "cannot be judged"), (0.5, "kept")])
    def test_figures_of_a_cylinder(self, length, outcome, tmp_path):
        """Euler's formula holds for a slenderness 4 l/d of at least 89; a shorter rod is not judged by it."""
        pushed = PUSHED.partition("[[drives]]")[0] + f"""
cylinders.jack.bore = 40
cylinders.jack.rod = 20
cylinders.jack.length = "{length} m"
cylinders.jack.pressure = "1 bar"
cylinders.jack.flow = "1 l/min"
cylinders.jack.buckling_safety = 3
[[drives]]
slider = "rail"
law = [{{curve = "cycloidal", duration = "1 s", by = "20 mm"}}]
cylinder = "jack"
[run]
positions = 721
"""  # fmt: skip
        status, summary = figures_of(pushed, tmp_path)
        found = {key: figure["value"] for key, figure in summary["figures"].items()}
        force, area, ring = 4.0 * 2 * np.pi * 0.02, np.pi * 0.02**2, np.pi * (0.02**2 - 0.01**2)
        assert found["pressure"] == pytest.approx(force / ring, rel=1e-5)  # deceleration needs tension
        assert found["flow"] == pytest.approx(area * 0.04, rel=1e-5)
        euler = np.pi**2 * 206e9 * np.pi * 0.02**4 / 64 / length**2
        assert found["rod_buckling"] == pytest.approx(euler / force, rel=1e-5)
        outcomes = {row["kind"]: row["outcome"] for row in summary["acceptance"]["limits"]}
        assert outcomes == {"pressure": "kept", "flow": "not kept", "rod_buckling": outcome}
        assert status == 1

    def test_designs_have_the_figures_of_a_single_run(self):
        """The designs share one axis of arrays."""
        keys = ["motor_rms.crank", "drive_rms", "least_ratio.crank", "flywheel.crank", "energy_taken", "motor_speed"]
        paths = ["motors.servo.gear_ratio", "motors.servo.rotor_inertia", "drives.crank.speed", "links.ram.mass"]
        tables = {**tomllib.loads(PUSHED), "run": {"positions": 36}}
        values = np.array([[20.0, 2e-4, 10.0, 4.0], [15.0, 3e-4, 12.0, 5.0], [8.0, 1e-4, -9.0, 3.0]])
        found = evaluate(tables, paths, values, keys)
        assert base_of(document_from_dict(tables), paths, keys).on_axis == (True,) * 4
        for row, design in enumerate(values):
            own = tables
            for path, value in zip(paths, design, strict=True):
                own = document_of(own).with_values({path: value}).tables
            peaks = run_figures(computed(scene_from_dict(own), Request()).cycle, None).peaks
            for key in keys:
                alone = abs(peaks[key.partition(".")[0]][0].value)
                assert found.columns[key][row] == pytest.approx(alone, rel=1e-12), key


class TestProposals:
    """A scene with the parts proposed by --balance has the predicted figures."""

    OPTIONS = ("--theory", "quasi-static", "--positions", "72")

    def four_bar(self, tmp_path, more="", *options):
        text = shipped_scenes()["steel_four_bar"].read_text() + more
        return figures_of(text, tmp_path, *self.OPTIONS, *options)[1]

    def test_a_proposed_spring_reduces_the_effort_as_predicted(self, tmp_path):
        proposed = self.four_bar(tmp_path, "", "--balance")["balance"]["drive_effort"]
        (spring,) = proposed["parts"]
        assert proposed["left"] < 0.5
        more = f"""
[[springs]]
link = "{spring["link"]}"
at = "{spring["pin"]}"
stiffness = "{spring["stiffness"]["value"]} N m/rad"
angle = {spring["angle"]["value"]}
"""
        with_it = self.four_bar(tmp_path, more)["drives"]["crank"]["effort"]["value"]
        assert abs(with_it) == pytest.approx(proposed["after"]["value"], rel=1e-9)

    def test_two_counterweights_leave_no_shaking_force(self, tmp_path, capsys):
        text = shipped_scenes()["steel_four_bar"].read_text()
        (tmp_path / "scene.toml").write_text(text)
        assert main([str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out"), *self.OPTIONS, "--balance"]) == 0
        found = json.loads((tmp_path / "out" / "scene" / "summary.json").read_text())["balance"]["shaking_force"]
        assert found["left"] < 1e-12
        assert found["after"]["value"] < 1e-11 * found["before"]["value"]
        assert {part["link"] for part in found["parts"]} == {"crank", "rocker"}
        assert "balance of the shaking force: 0.188 kg at 50 mm from O on crank" in capsys.readouterr().out

    @pytest.mark.parametrize("scene", ["steel_four_bar", "offset_slider_crank"])
    def test_proposed_counterweights_reduce_shaking_as_predicted(self, scene, tmp_path):
        """A four-bar is fully balanced, a slider-crank only in part, since no link rotates with its slider."""
        unloaded = re.sub(r"\[\[loads\]\].*?(?=\n\[)", "", shipped_scenes()[scene].read_text(), flags=re.DOTALL)
        text = re.sub(r"gravity = .*", "gravity = [0, 0]", unloaded) + "\n# kept\n"
        (tmp_path / "scene.toml").write_text(text)
        out, options = tmp_path / "out", (*self.OPTIONS, "--quiet")
        main([str(tmp_path / "scene.toml"), "-o", str(out), *options, "--balance"])
        before = json.loads((out / "scene" / "summary.json").read_text())
        written = (out / "scene" / "balance.toml").read_text()
        assert "# kept" in written
        main([str(out / "scene" / "balance.toml"), "-o", str(out), *options])
        after = json.loads((out / "balance" / "summary.json").read_text())["shaking"]["force"]["value"]
        proposed = before["balance"]["shaking_force"]
        assert proposed["before"]["value"] == pytest.approx(before["shaking"]["force"]["value"], rel=1e-9)
        assert after == pytest.approx(proposed["after"]["value"], abs=1e-9 * proposed["before"]["value"])
        study = tomllib.loads(written)["optimize"]
        assert study["minimize"] == "shaking_force"
        links = {part["link"] for part in proposed["parts"]}
        assert {*study["variables"]} == {f"links.{link}_counterweight.mass" for link in links}
        assert (scene == "steel_four_bar") == (proposed["left"] < 1e-9)
