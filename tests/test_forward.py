"""Forward dynamics, compared with closed forms, an independent equation of motion, and published digits."""

import math

import numpy as np
import pytest
from mechanisms import ALL, bar, double_rocker, replaced, require_closed_loops, three_cranks, with_link, with_lump
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk
from tiers import in_tiers

from elastic import Section, deflection, sample
from rigid import (
    ConstantSpeed,
    Gear,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    Spring,
    TorsionSpring,
    acceleration_of,
    drive_efforts,
    motion,
    position_of,
    reactions,
)
from rigid.analysis import LinkAngle
from rigid.dynamics import CurveLaw, Effort, ForwardError, forward, motion_during, tracking
from rigid.kinetostatics import dissipated_power, kinetic_energy, potential_energy

GRAVITY = 9.81
FREE = Effort()


def flywheel(inertia=2.0, *loads):
    links = (Link("ground", {"O": 0.0}), Link("wheel", {"O": 0.0}, lumps=(Lump("O", 1.0, inertia),)))
    return Mechanism(links, (PinDrive("wheel", "O"),), {}, loads=loads)


def pendulum(length=0.7, mass=1.3):
    links = (Link("ground", {"O": 0.0}), Link("bob", {"O": 0.0, "A": length}, lumps=(Lump("A", mass),)))
    return Mechanism(links, (PinDrive("bob", "O"),), {}, gravity=-1j * GRAVITY)


def double_pendulum(m1=1.0, m2=0.6, a=0.5, b=0.4):
    links = (
        Link("ground", {"O": 0.0}),
        Link("upper", {"O": 0.0, "A": a}, lumps=(Lump("A", m1),)),
        Link("lower", {"A": 0.0, "T": b}, lumps=(Lump("T", m2),)),
    )
    drives = (PinDrive("upper", "O"), PinDrive("lower", "A", "upper"))
    return Mechanism(links, drives, {}, gravity=-1j * GRAVITY)


class TestOneFreedom:
    def test_a_constant_moment_turns_a_wheel_quadratically(self):
        course = forward(flywheel(2.0), [Effort(3.0)], 0.5, -1.0, 4.0)
        time = np.linspace(0, 4, 9)
        found = motion_during(course, time)
        np.testing.assert_allclose(found.drive[0], 0.5 - time + 0.75 * time**2, atol=1e-11)
        np.testing.assert_allclose(found.drive_rate[0], -1 + 1.5 * time, atol=1e-11)
        np.testing.assert_allclose(found.drive_acceleration[0], 1.5, rtol=1e-13)

    def test_a_pendulum_follows_jacobis_sine(self):
        """sin(theta/2) = k sn(K - w t), released at rest at an angle of 2 asin(k) from hanging."""
        length, release, time = 0.7, 2.5, np.linspace(0.0, 3.0, 31)
        k, w = math.sin(release / 2), math.sqrt(GRAVITY / length)
        sn, cn, dn, _ = ellipj(ellipk(k**2) - w * time, k**2)
        found = motion_during(forward(pendulum(length), [FREE], release - math.pi / 2, 0.0, 3.0, 1e-12), time)
        np.testing.assert_allclose(found.drive[0] + math.pi / 2, 2 * np.arcsin(k * sn), atol=1e-9)
        np.testing.assert_allclose(found.drive_rate[0], -2 * k * w * cn * dn / np.sqrt(1 - (k * sn) ** 2), atol=1e-8)

    def test_a_damped_wheel_slows_exponentially(self):
        damper = TorsionSpring("wheel", "O", damping=0.8)
        found = motion_during(forward(flywheel(2.0, damper), [FREE], 0.0, 5.0, 3.0), np.linspace(0, 3, 7))
        np.testing.assert_allclose(found.drive_rate[0], 5 * np.exp(-0.4 * found.time), rtol=1e-10)

    def test_an_effort_can_depend_on_the_rate(self):
        """The moment of a motor decreases with its speed: w = w0 (1 - exp(-c t/J))."""
        motor = Effort(CurveLaw(LinkAngle("wheel").rate, lambda w: 0.8 * (6.0 - w)))
        found = motion_during(forward(flywheel(2.0), [motor], 0.0, 0.0, 3.0), np.linspace(0, 3, 7))
        np.testing.assert_allclose(found.drive_rate[0], 6 * (1 - np.exp(-0.4 * found.time)), atol=1e-10)

    def test_a_mass_on_a_spring_oscillates_along_its_rail(self):
        links = (Link("ground", {"G": 0.0}), Link("block", {"P": 0.0}, lumps=(Lump("P", 0.5),)))
        rail = Slider("rail", "block", "ground", "P", origin=0.0, direction=np.exp(0.4j))
        spring = Spring("block", "P", anchor="G", stiffness=50.0)
        mechanism = Mechanism(links, (SliderDrive("rail"),), {"P": 0.1, "G": 0.0}, (rail,), loads=(spring,))
        found = motion_during(forward(mechanism, [FREE], 0.1, 0.0, 2.0), np.linspace(0, 2, 21))
        np.testing.assert_allclose(found.drive[0], 0.1 * np.cos(10 * found.time), atol=1e-10)

    def test_meshing_wheels_add_their_inertia(self):
        """Reduced inertia of a pinion and a wheel with ratio i: J1 + i^2 J2."""
        links = (
            Link("ground", {"O": 0.0, "W": 0.3}),
            Link("pinion", {"O": 0.0}, lumps=(Lump("O", 1.0, 0.2),)),
            Link("wheel", {"W": 0.0}, lumps=(Lump("W", 1.0, 3.0),)),
        )
        mesh = Gear(PinDrive("pinion", "O"), PinDrive("wheel", "W"), -0.25)
        mechanism = Mechanism(links, (PinDrive("pinion", "O"),), {}, gears=(mesh,))
        found = motion_during(forward(mechanism, [Effort(1.5)], 0.0, 0.0, 2.0), np.linspace(0, 2, 5))
        np.testing.assert_allclose(found.drive_acceleration[0], 1.5 / (0.2 + 3.0 / 16), rtol=1e-12)
        np.testing.assert_allclose(found.drive[0], 0.75 / (0.2 + 3.0 / 16) * found.time**2, atol=1e-11)

    def test_energy_is_constant(self):
        found = motion_during(forward(pendulum(), [FREE], 1.0, 2.0, 3.0, 1e-12), np.linspace(0, 3, 50))
        energy = kinetic_energy(found) + potential_energy(found)
        np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


class TestSliderCrank:
    """Many turns of a crank of 0.05 m; T = J(a) a'^2 / 2 of its angle a is integrated by scipy."""

    R, L, C, MOMENT = 0.05, 0.2, 0.08, 5.0

    def mechanism(self, drive, angle):
        links = (
            Link("ground", {"O": 0.0}),
            Link("crank", {"O": 0.0, "A": self.R}, (), (Lump("O", 0.3, 2e-3),)),
            Link("rod", {"A": 0.0, "B": self.L}, (), (Lump("A", 0.4, 1.5e-3, self.C),)),
            Link("piston", {"B": 0.0}, (), (Lump("B", 0.5),)),
        )
        guide = Slider("guide", "piston", "ground", "B", 0.0, 1.0)
        crank = self.R * np.exp(1j * angle)
        drawing = {"O": 0, "A": crank, "B": crank.real + np.sqrt(self.L**2 - crank.imag**2)}
        return Mechanism(links, (drive,), drawing, (guide,), gravity=-1j * GRAVITY)

    def closed_form(self, angle, effort):
        """Return inertia, half its derivative, and the crank moment by weight and a force on the piston."""
        sine, cosine = np.sin(angle), np.cos(angle)
        tilt = -self.R * sine / self.L
        upright = np.sqrt(1 - tilt**2)
        turned = -self.R * cosine / (self.L * upright)
        turned2 = (self.R * sine / self.L + tilt * turned**2) / upright
        piston = -self.R * sine - self.L * tilt * turned
        piston2 = -self.R * cosine - self.L * (upright * turned**2 + tilt * turned2)
        rod, crank = self.C * (upright + 1j * tilt), self.R * np.exp(1j * angle)
        center, center2 = 1j * crank + 1j * turned * rod, -crank + (1j * turned2 - turned**2) * rod
        inertia = 2e-3 + 0.4 * abs(center) ** 2 + 1.5e-3 * turned**2 + 0.5 * piston**2
        slope = 0.4 * (np.conj(center) * center2).real + 1.5e-3 * turned * turned2 + 0.5 * piston * piston2
        return inertia, slope, effort * piston - 0.4 * GRAVITY * center.imag

    def exact(self, moment, force, rate, duration):
        def rates(time, state):
            inertia, slope, by_piston = self.closed_form(state[0], force(time))
            return state[1], (moment + by_piston - slope * state[1] ** 2) / inertia

        return solve_ivp(rates, (0, duration), (0.3, rate), method="DOP853", rtol=2.3e-14, atol=1e-15).y[:, -1]

    def test_run_up_of_a_crank(self, monkeypatch):
        """The loops need few solutions per step, since postures repeat with each turn."""
        solved = []
        once = tracking.constraint_matrix
        monkeypatch.setattr(tracking, "constraint_matrix", lambda *args: solved.append(1) or once(*args))
        course = forward(self.mechanism(PinDrive("crank", "O"), 0.3), [Effort(self.MOMENT)], 0.3, 60.0, 0.12, 1e-11)
        end = motion_during(course, 0.12)
        expected = self.exact(self.MOMENT, lambda time: 0.0, 60.0, 0.12)
        np.testing.assert_allclose([end.drive[0, -1], end.drive_rate[0, -1]], expected, rtol=1e-9)
        require_closed_loops(end)
        assert len(solved) < 0.4 * course.evaluations

    def test_a_piston_drives_through_the_dead_points(self):
        """The crank leads near dead points, while the effort stays that of the piston."""
        begin = motion(self.mechanism(PinDrive("crank", "O"), 0.3), [0.3], 60.0)
        piston = begin.origin[3, 0].real, begin.velocity[3, 0].real
        push = Effort(lambda motion: 200 * np.sin(200 * motion.time))
        course = forward(self.mechanism(SliderDrive("guide"), 0.3), [push], *piston, 0.12, 1e-11)
        end = motion_during(course, 0.12)
        expected = self.exact(0.0, lambda time: 200 * np.sin(200 * time), 60.0, 0.12)
        assert expected[0] > 1.5 * np.pi
        turned = np.angle(end.direction[1, -1] * np.exp(-1j * expected[0]))
        assert abs(turned) < 1e-8
        assert end.angular_velocity[1, -1] == pytest.approx(expected[1], rel=1e-8)


class TestSeveralDrives:
    def test_a_double_pendulum_follows_its_equations(self):
        """Separate equations in absolute angles from hanging (Goldstein, Classical Mechanics, chapter 1)."""
        m1, m2, a, b = 1.0, 0.6, 0.5, 0.4

        def rates(_, y):
            p, q, u, v = y
            mass = np.array([[(m1 + m2) * a, m2 * b * np.cos(p - q)], [a * np.cos(p - q), b]])
            force = [
                -m2 * b * v**2 * np.sin(p - q) - (m1 + m2) * GRAVITY * np.sin(p),
                a * u**2 * np.sin(p - q) - GRAVITY * np.sin(q),
            ]
            return [u, v, *np.linalg.solve(mass, force)]

        time = np.linspace(0, 1.2, 13)
        own = solve_ivp(rates, (0, 1.2), [1.2, 0.7, 0.0, 1.0], "DOP853", t_eval=time, rtol=1e-12, atol=1e-12).y
        course = forward(double_pendulum(), [FREE, FREE], [1.2 - math.pi / 2, -0.5], [0.0, 1.0], 1.2, 1e-12)
        found = motion_during(course, time)
        np.testing.assert_allclose(found.drive[0] + math.pi / 2, own[0], atol=1e-9)
        np.testing.assert_allclose(found.drive[0] + found.drive[1] + math.pi / 2, own[1], atol=1e-9)
        energy = kinetic_energy(found) + potential_energy(found)
        np.testing.assert_allclose(energy, energy[0], atol=1e-9)

    def test_one_drive_can_follow_a_law_while_another_is_free(self):
        """A pendulum on an arm with steady rotation, without gravity: q'' = -(a/b) w^2 sin q relative to the arm."""
        w, a, b = 3.0, 0.5, 0.4
        mechanism = replaced(double_pendulum(), gravity=0.0)
        found = motion_during(
            forward(mechanism, [ConstantSpeed(0.2, w), FREE], [0.0, 0.8], [0.0, 0.0], 2.0, 1e-12), np.linspace(0, 2, 11)
        )
        own = solve_ivp(
            lambda _, y: [y[1], -(a / b) * w**2 * math.sin(y[0])], (0, 2), [0.8, 0.0], "DOP853",
            t_eval=found.time, rtol=1e-12, atol=1e-12,
        )  # fmt: skip
        np.testing.assert_allclose(found.drive[0], 0.2 + w * found.time, rtol=1e-14)
        np.testing.assert_allclose(found.drive[1], own.y[0], atol=1e-9)

    def test_an_oscillating_drive_moves_a_free_one(self):
        """Point mass on a forearm, upper arm angle p(t): b^2 (p'' + q'') + a b (p'' cos q + p'^2 sin q) = 0."""
        a, b = 0.5, 0.4
        mechanism = replaced(double_pendulum(), gravity=0.0)

        def law(time):
            return (
                0.3 * np.sin(4 * np.asarray(time)),
                1.2 * np.cos(4 * np.asarray(time)),
                -4.8 * np.sin(4 * np.asarray(time)),
            )

        def rates(time, y):
            _, rate, rate2 = law(time)
            return [y[1], -rate2 - a / b * (rate2 * math.cos(y[0]) + rate**2 * math.sin(y[0]))]

        time = np.linspace(0, 2, 11)
        found = motion_during(forward(mechanism, [law, FREE], 0.5, 0.0, 2.0, 1e-12), time)
        own = solve_ivp(rates, (0, 2), [0.5, 0.0], "DOP853", t_eval=time, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found.drive[1], own.y[0], atol=1e-9)
        expected = [rates(*each)[1] for each in zip(time, own.y.T, strict=True)]
        np.testing.assert_allclose(found.drive_acceleration[1], expected, atol=1e-8)


class TestAnyLinkage:
    @pytest.mark.parametrize("name", in_tiers(ALL, 4, 4))
    def test_forward_dynamics_inverts_inverse_dynamics(self, name):
        """Efforts by inverse dynamics of a smooth law give the law again."""
        case = ALL[name]()
        begin = case.drive[:, 3]
        phase = 0.3 * np.arange(len(begin))

        def law(time):
            swing = 30.0 * np.atleast_1d(time) + phase[:, None]
            size = 0.05 * (0.1 if name == "driven slider" else 1.0)
            return begin[:, None] + size * np.sin(swing), 30 * size * np.cos(swing), -900 * size * np.sin(swing)

        def effort(number):
            def moment(course):
                wanted = motion(case.mechanism, *law(course.time), course.time)
                return drive_efforts(wanted, reactions(wanted))[number]

            return Effort(moment)

        duration = 0.05
        start, rate, _ = law(0.0)
        drives = [effort(number) for number in range(len(begin))]
        time = np.linspace(0, duration, 5)
        found = motion_during(forward(case.mechanism, drives, start[:, 0], rate[:, 0], duration), time)
        expected = law(time)
        np.testing.assert_allclose(found.drive, expected[0], atol=1e-9)
        np.testing.assert_allclose(found.drive_acceleration, expected[2], atol=1e-5 * np.abs(expected[2]).max())

    @pytest.mark.parametrize("name", in_tiers(["RRR", "RPR", "six-bar", "triad"], 1, 3))
    def test_a_free_linkage_keeps_its_energy_and_its_loops_closed(self, name):
        case = ALL[name]()
        mechanism = replaced(case.mechanism, loads=())
        course = motion_during(forward(mechanism, [FREE], case.drive[0, 0], 40.0, 0.3), np.linspace(0, 0.3, 40))
        assert np.ptp(course.drive[0]) > 2 * math.pi
        require_closed_loops(course)
        energy = kinetic_energy(course) + potential_energy(course)
        np.testing.assert_allclose(energy, energy[0], rtol=1e-8)

    def test_a_redundant_parallelogram_moves_as_three_cranks_and_a_bar(self):
        """Massless cranks and a translating coupler: alpha eps + m g r cos = 0, with the crank length r."""
        given = three_cranks()
        lean = given.drawing["A"]
        r, start = abs(lean), float(np.angle(lean))
        links = [Link(link.name, link.points) for link in given.links]
        coupler = next(link for link in given.links if link.name == "coupler")
        links = [link for link in links if link.name != "coupler"]
        links.append(Link("coupler", coupler.points, lumps=(Lump("A", 2.0, 0.3),)))
        mechanism = replaced(given, links=tuple(links), gravity=-1j * GRAVITY)
        found = motion_during(forward(mechanism, [FREE], start, -1.0, 0.08, 1e-12), np.linspace(0, 0.08, 5))
        own = solve_ivp(
            lambda _, y: [y[1], -GRAVITY / r * math.cos(y[0])], (0, 0.08), [start, -1.0], "DOP853",
            t_eval=found.time, rtol=1e-12, atol=1e-12,
        )  # fmt: skip
        np.testing.assert_allclose(found.drive[0], own.y[0], atol=1e-10)
        require_closed_loops(found)

    def test_lost_energy_equals_dissipation(self):
        case = ALL["RRR"]()
        ground, *links = case.mechanism.links
        anchored = Link("ground", {**ground.points, "anchor": 0.5 + 0.4j})
        spring = Spring("coupler", "B", anchor="anchor", stiffness=300.0, length=0.1, damping=8.0)
        mechanism = replaced(case.mechanism, links=(anchored, *links), loads=(spring,))
        course = motion_during(forward(mechanism, [FREE], case.drive[0, 0], 20.0, 0.4), np.linspace(0, 0.4, 4001))
        energy = kinetic_energy(course) + potential_energy(course)
        heat = np.trapezoid(dissipated_power(course), course.time)
        assert heat > 0.05 * energy[0]
        assert energy[0] - energy[-1] == pytest.approx(heat, rel=1e-6)


class TestFurtherAnalysis:
    def test_a_falling_rod_bends_like_a_falling_chimney(self):
        """M = (m g cos/4) x (1 - x/l)^2 at any angle (Madsen, American Journal of Physics 45, 1977, 182)."""
        m, length = 3.0, 2.0
        links = (Link("ground", {"O": 0.0}), bar("rod", "O", "A", length, m / length))
        mechanism = Mechanism(links, (PinDrive("rod", "O"),), {}, gravity=-1j * GRAVITY)
        found = motion_during(forward(mechanism, [FREE], 1.2, 0.0, 0.5), np.linspace(0, 0.5, 6))
        xi = np.linspace(0, 1, 9)
        moment = sample(deflection(found, [Section(EA=1e7, EI=1e4)]), "M", xi)[0]
        expected = m * GRAVITY * np.cos(found.drive[0])[:, None] / 4 * length * xi * (1 - xi) ** 2
        np.testing.assert_allclose(moment, expected, atol=1e-10 * np.abs(expected).max())

    def test_accelerations_are_derivatives_of_positions(self):
        """The path of a coupler point is differentiated by Chebyshev polynomials in time."""
        case = ALL["triad"]()
        mechanism = replaced(case.mechanism, loads=())
        course = forward(mechanism, [FREE], case.drive[0, 0], 40.0, 0.02, 1e-12)
        nodes = 0.01 - 0.01 * np.cos(np.pi * np.arange(65) / 64)
        found = motion_during(course, nodes)
        path = position_of(found, "plate", "R")
        fit = [np.polynomial.Chebyshev.fit(nodes, part, 64).deriv(2)(nodes[8:-8]) for part in (path.real, path.imag)]
        direct = acceleration_of(found, "plate", "R")[8:-8]
        np.testing.assert_allclose(fit[0] + 1j * fit[1], direct, atol=1e-5 * np.abs(direct).max())


class TestToggles:
    """At the limit of a drive another joint becomes the leading coordinate."""

    LIMIT = math.acos((0.3**2 + 0.4**2 - 0.45**2) / (2 * 0.3 * 0.4))  # crank angle with coupler and rocker in line
    TIMES = np.linspace(0, 0.13, 40)

    def course(self, *more, start=0.3):
        return forward(replaced(double_rocker(0.3), loads=more), [Effort(5.0)], start, 0.0, 0.13, 1e-10)

    @pytest.mark.slow
    def test_the_drive_reverses_and_the_links_continue(self):
        course = self.course()
        found = motion_during(course, self.TIMES)
        assert len(course.stretches) > 1
        turned = found.drive[0].argmax()
        assert 5 < turned < 38
        assert found.drive[0].max() == pytest.approx(self.LIMIT, abs=3e-3)
        assert (np.diff(found.drive[0])[turned + 1 :] < 0).all()
        assert (np.diff(np.unwrap(np.angle(found.direction[2]))) < 0).all()
        require_closed_loops(found, 1e-13)
        work = 5.0 * (found.drive[0] - 0.3)
        np.testing.assert_allclose(kinetic_energy(found), work, atol=1e-7 * work.max())
        np.testing.assert_allclose(drive_efforts(found, reactions(found))[0], 5.0, rtol=1e-6)

    @pytest.mark.slow
    def test_the_motion_does_not_depend_on_the_leading_coordinate(self):
        """A wound spring and a damper at the drive's pin use the true coordinate of the drive."""
        turns = 4 * np.pi
        spring = TorsionSpring("crank", "O", stiffness=2.0, angle=turns - 6.0, damping=0.01)
        one = motion_during(self.course(spring, start=turns + 0.3), self.TIMES)
        rocker = np.angle(one.direction[3, 0])
        pushed = PointLoad("crank", "O", 0.0, 5.0 - 2.0 * 6.0)
        slack = TorsionSpring("crank", "O", stiffness=2.0, damping=0.01)
        led = replaced(double_rocker(0.3), drives=(PinDrive("rocker", "D"),), loads=(pushed, slack))
        other = motion_during(forward(led, [FREE], rocker, 0.0, 0.13, 1e-10), self.TIMES)
        np.testing.assert_allclose(np.angle(one.direction / other.direction), 0.0, atol=1e-6)

    @pytest.mark.slow
    def test_a_rotor_reverses_like_a_disc_on_the_crank(self):
        """Meanwhile another joint leads the inertia of the rotor."""
        (crank, *_), inertia = double_rocker(0.3).drives, 0.02
        geared = replaced(double_rocker(0.3), drives=(PinDrive(crank.link, crank.at, crank.on, inertia),))
        disc = with_lump(double_rocker(0.3), crank.link, Lump(crank.at, 0.0, inertia))
        time = np.linspace(0.0, 0.3, 31)
        courses = [forward(each, [Effort(5.0)], 0.3, 0.0, 0.3, 1e-10) for each in (geared, disc)]
        one, other = (motion_during(course, time) for course in courses)
        assert all(len(course.stretches) > 1 for course in courses)
        np.testing.assert_allclose(one.drive, other.drive, atol=1e-7)
        scale = np.abs(other.drive_acceleration).max()
        np.testing.assert_allclose(one.drive_acceleration, other.drive_acceleration, atol=1e-5 * scale)
        np.testing.assert_allclose(drive_efforts(one, reactions(one))[0], 5.0, rtol=1e-5)

    def test_a_later_interrupt_keeps_all_stretches(self):
        def stop(time):
            if time > 0.1:
                raise KeyboardInterrupt

        with pytest.raises(ForwardError, match="interrupted") as caught:
            forward(double_rocker(0.3), [Effort(5.0)], 0.3, 0.0, 5.0, 1e-8, on_step=stop)
        course = caught.value.motion
        assert 0.1 < course.time[-1] < 0.13
        assert len(course.stretches) > 1
        assert np.isfinite(motion_during(course, course.time[-1:]).drive).all()


class TestErrors:
    def test_too_few_efforts(self):
        with pytest.raises(ForwardError, match=r"1 efforts or motion laws were given for 2 drives"):
            forward(double_pendulum(), [FREE], 0.0, 0.0, 1.0)

    def test_a_start_that_does_not_close(self):
        short = bar("rocker", "D", "B", 0.02)
        mechanism = replaced(with_link(ALL["RRR"]().mechanism, short), loads=())
        with pytest.raises(MechanismError, match="at the start, the mechanism cannot be assembled"):
            forward(mechanism, [FREE], 3.0, 0.0, 1.0)

    def test_times_beyond_the_integration(self):
        course = forward(flywheel(), [Effort(lambda course: np.ones(course.columns))], 0.0, 0.0, 1.0)
        with pytest.raises(ForwardError, match=r"requested from 0 to 1\.5 s, but it is integrated from 0 to 1 s"):
            motion_during(course, [0.0, 1.5])
