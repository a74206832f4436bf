"""Drive efforts by three formulations, springs and dampers, force laws and energy, compared with closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanisms import ALL, Case, bar, four_bar, motion_of, replaced, slider_crank, three_cranks, turn, with_lump
from second_routes import multiplier_forces, virtual_work_efforts
from test_gears import geared_four_bar

from rigid import (
    Beam,
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
    velocity_of,
    with_rates,
)
from rigid.analysis import LinkAngle, Slide
from rigid.dynamics import CurveLaw, TableError, equation_of_motion, law_of, law_of_time, reduced_inertia, table_curve
from rigid.kinetostatics import dissipated_power, kinetic_energy, load_power, potential_energy

GRAVITY = 9.81


def relative(one, other):
    return np.abs(one - other).max() / np.abs(other).max()


def springs(case):
    """Return a spring-damper between the last link and the ground, and a torsion spring at the last pin."""
    links = case.mechanism.links
    last = links[-1]
    pins = [
        (one, other, point) for other in links for one in links[1:] for point in one.points if point in other.points
    ]
    one, other, pin = next((link, on, point) for link, on, point in reversed(pins) if link is not on)
    return (
        Spring(last.name, list(last.points)[-1], "ground", "anchor", 700.0, length=0.2, damping=9.0, preload=4.0),
        TorsionSpring(one.name, pin, other.name, stiffness=3.0, angle=0.4, damping=0.2, preload=0.5),
    )


def sprung(case, added=slice(None)):
    """Return the case with its loads and springs, one of which is anchored on the ground."""
    ground, *links = case.mechanism.links
    anchored = Link("ground", {**ground.points, "anchor": 0.7 - 0.6j}, ground.beams, ground.lumps)
    loads = (*case.mechanism.loads, *springs(case)[added])
    mechanism = replaced(case.mechanism, links=(anchored, *links), loads=loads)
    return Case(mechanism, case.sections, case.drive, case.rate, case.rate2)


class TestThreeFormulations:
    @pytest.mark.parametrize("name", ALL)
    def test_newton_virtual_work_and_multipliers_agree(self, name):
        course = motion_of(sprung(ALL[name]()))
        efforts = drive_efforts(course, reactions(course))
        assert relative(virtual_work_efforts(course), efforts) < 1e-13
        assert relative(drive_efforts(course, multiplier_forces(course)), efforts) < 1e-13

    @pytest.mark.parametrize("name", ALL)
    def test_multipliers_are_the_joint_forces(self, name):
        course = motion_of(sprung(ALL[name]()))
        one, other = multiplier_forces(course), reactions(course)
        force, moment = (
            np.array([np.broadcast_to(x, course.columns) for x in part]) for part in (one.force, one.moment)
        )
        assert relative(force, np.array([np.broadcast_to(x, course.columns) for x in other.force])) < 1e-13
        assert relative(moment, np.array([np.broadcast_to(x, course.columns) for x in other.moment])) < 1e-13
        assert relative(one.ground_force, other.ground_force) < 1e-13
        assert relative(one.ground_moment, other.ground_moment) < 1e-13

    @settings(max_examples=25, derandomize=True, deadline=None)
    @given(st.floats(0.05, 0.14), st.floats(0.28, 0.4), st.floats(0.2, 0.26), st.floats(-20, 20), st.floats(-300, 300))
    def test_of_random_four_bars(self, crank, coupler, rocker, rate, rate2):
        case = four_bar(crank, coupler, rocker, count=9)
        course = motion(case.mechanism, case.drive, rate, rate2)
        efforts = drive_efforts(course, reactions(course))
        assert relative(virtual_work_efforts(course), efforts) < 1e-11
        assert relative(drive_efforts(course, multiplier_forces(course)), efforts) < 1e-11

    def test_of_several_designs(self):
        crank = np.array([[0.09], [0.11], [0.12]])
        ground, given_crank, *links = four_bar().mechanism.links
        drawing = four_bar().mechanism.drawing
        wide = Link("crank", {"O": 0.0, "A": crank}, given_crank.beams)
        mechanism = Mechanism((ground, wide, *links), (PinDrive("crank", "O"),), drawing, gravity=-9.81j)
        course = motion(mechanism, turn(8, 0.4), 5.0, 2.0)
        assert course.columns == (3, 8)
        efforts = drive_efforts(course, reactions(course))
        assert relative(virtual_work_efforts(course), efforts) < 1e-13
        assert relative(drive_efforts(course, multiplier_forces(course)), efforts) < 1e-13

    def test_of_wheels_and_a_rack(self):
        course = motion(geared_four_bar(), np.linspace(0.3, 4.0, 9), 20.0, -7.0)
        efforts = drive_efforts(course, reactions(course))
        assert relative(virtual_work_efforts(course), efforts) < 1e-12
        assert relative(drive_efforts(course, multiplier_forces(course)), efforts) < 1e-12
        assert relative(multiplier_forces(course).ground_force, reactions(course).ground_force) < 1e-12

    def test_a_redundant_mechanism_has_one_effort_and_unknown_forces(self):
        given_links = three_cranks().links
        links = [Link(link.name, link.points, lumps=(Lump(next(iter(link.points)), 2.0, 0.1),)) for link in given_links]
        mechanism = replaced(three_cranks(), links=tuple(links), gravity=-9.81j)
        course = motion(mechanism, np.linspace(0.8, 1.8, 7), 3.0, 1.0)
        efforts = drive_efforts(course, multiplier_forces(course))
        np.testing.assert_allclose(efforts, virtual_work_efforts(course), rtol=1e-11)
        assert any(np.isnan(force).all() for force in multiplier_forces(course).force)


class TestClosedForms:
    def test_effort_of_a_driven_pendulum(self):
        m, r, J = 2.0, 0.3, 0.05
        links = (Link("ground", {"O": 0.0}), Link("arm", {"O": 0.0, "A": r}, lumps=(Lump("A", m, J),)))
        mechanism = Mechanism(links, (PinDrive("arm", "O"),), {}, gravity=-1j * GRAVITY)
        angle, rate2 = turn(12), 7.0
        course = motion(mechanism, angle, 3.0, rate2)
        expected = (J + m * r**2) * rate2 + m * GRAVITY * r * np.cos(angle)
        for efforts in (
            virtual_work_efforts(course),
            drive_efforts(course, multiplier_forces(course)),
            drive_efforts(course, reactions(course)),
        ):
            np.testing.assert_allclose(efforts[0], expected, rtol=1e-13)

    def test_reduced_inertia_of_a_yoke(self):
        """s = r cos(phi): alpha = m r^2 sin^2, beta = alpha'/2, if only the yoke has mass."""
        m, r = 3.0, 0.1
        links = (
            Link("ground", {"O": 0.0}),
            Link("crank", {"O": 0.0, "A": r}),
            Link("block", {"A": 0.0}),
            Link("yoke", {"Y": 0.0}, lumps=(Lump("Y", m),)),
        )
        sliders = (
            Slider("rail", "yoke", "ground", "Y", origin=0.0, direction=1.0),
            Slider("slot", "block", "yoke", "A", origin=0.0, direction=1j),
        )
        drawing = {"O": 0.0, "A": r * np.exp(0.5j), "Y": r * math.cos(0.5)}
        mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, sliders)
        angle = turn(10, 0.5)
        alpha, beta = reduced_inertia(motion(mechanism, angle))
        np.testing.assert_allclose(alpha, m * r**2 * np.sin(angle) ** 2, atol=1e-16)
        np.testing.assert_allclose(beta, m * r**2 * np.sin(angle) * np.cos(angle), atol=1e-16)

    @pytest.mark.parametrize("name", ["RRR", "RRP", "RPR", "RPP", "six-bar", "triad"])
    def test_beta_is_half_the_slope_of_alpha(self, name):
        """The slope is a spectral derivative over a turn."""
        mechanism = ALL[name](count=256).mechanism
        alpha, beta = reduced_inertia(motion(mechanism, ALL[name](count=256).drive))
        waves = np.fft.rfftfreq(256, 1 / 256)
        slope = np.fft.irfft(1j * waves * np.fft.rfft(alpha), 256)
        np.testing.assert_allclose(beta, slope / 2, atol=1e-10 * np.abs(slope).max())

    def test_reduced_inertia_of_two_drives_is_the_textbook_matrix(self):
        """Two-link arm, absolute elbow angle b: I1 + I2 + m2 (a^2 + 2 a c cos b), and so on."""
        m1, m2, a, c, I1, I2 = 1.5, 0.7, 0.4, 0.3, 0.02, 0.01
        links = (
            Link("ground", {"O": 0.0}),
            Link("upper", {"O": 0.0, "A": a}, lumps=(Lump("A", m1, I1),)),
            Link("fore", {"A": 0.0, "T": c}, lumps=(Lump("T", m2, I2),)),
        )
        mechanism = Mechanism(links, (PinDrive("upper", "O"), PinDrive("fore", "A", "upper")), {})
        elbow, rate = np.array([0.3, 1.9]), np.array([[2.0, -1.0], [3.0, 0.5]])
        found = equation_of_motion(motion(mechanism, [[0.1, 0.2], elbow], rate))
        mixed = I2 + m2 * (c**2 + a * c * np.cos(elbow))
        both = I1 + m1 * a**2 + I2 + m2 * (a**2 + c**2 + 2 * a * c * np.cos(elbow))
        np.testing.assert_allclose(found.inertia[0, 0], both, rtol=1e-13)
        np.testing.assert_allclose(found.inertia[0, 1], mixed, rtol=1e-13)
        np.testing.assert_allclose(found.inertia[1, 0], mixed, rtol=1e-13)
        np.testing.assert_allclose(found.inertia[1, 1], I2 + m2 * c**2, rtol=1e-13)
        shear = m2 * a * c * np.sin(elbow)
        np.testing.assert_allclose(found.bias[0], -shear * (2 * rate[0] * rate[1] + rate[1] ** 2), rtol=1e-12)
        np.testing.assert_allclose(found.bias[1], shear * rate[0] ** 2, rtol=1e-12)

    def test_a_scalar_reduced_inertia_needs_one_drive(self):
        case = ALL["arm"]()
        with pytest.raises(MechanismError, match="2 drives"):
            reduced_inertia(motion_of(case))


class TestEnergy:
    @pytest.mark.parametrize("name", ["RRR", "RRP", "RPR", "RPP", "six-bar", "triad"])
    def test_power_balances_with_springs_and_dampers(self, name):
        """Drive and given loads supply kinetic and potential energy and the dampers; energy rates are by FFT."""
        # A torsion spring between rotating links jumps after half a turn, and its spectrum does not converge.
        case = sprung(ALL[name](count=256), slice(1) if name in {"RPR", "RPP"} else slice(None))
        course = motion(case.mechanism, case.drive, 4.0)
        given_power = load_power(motion(ALL[name](count=256).mechanism, case.drive, 4.0))
        fed = 4.0 * drive_efforts(course, reactions(course))[0] + given_power - dissipated_power(course)
        energy = kinetic_energy(course) + potential_energy(course)
        waves = np.fft.rfftfreq(256, 1 / 256)
        rate = 4.0 * np.fft.irfft(1j * waves * np.fft.rfft(energy), 256)
        np.testing.assert_allclose(fed, rate, atol=1e-9 * np.abs(rate).max())

    def test_kinetic_energy_of_a_rotating_bar(self):
        """A uniform bar that rotates about its end: m l^2 w^2/6."""
        links = (Link("ground", {"O": 0.0}), bar("arm", "O", "A", 0.6, 1.5))
        course = motion(Mechanism(links, (PinDrive("arm", "O"),), {}), [0.4], 5.0)
        assert kinetic_energy(course)[0] == pytest.approx(1.5 * 0.6 * 0.6**2 * 25 / 6, rel=1e-14)

    def test_potential_energy_is_weight_times_height(self):
        links = (Link("ground", {"O": 1j}), bar("arm", "O", "A", 0.6, 1.5))
        course = motion(Mechanism(links, (PinDrive("arm", "O"),), {}, gravity=-10j), [0.5 * math.pi])
        assert potential_energy(course)[0] == pytest.approx(1.5 * 0.6 * 10 * 1.3, rel=1e-14)


def held_arm(*loads, angle=0.0, rate=0.0, drawing=None):
    links = (Link("ground", {"O": 0.0, "C": 0.5}), Link("arm", {"O": 0.0, "A": 2.0}))
    return motion(Mechanism(links, (PinDrive("arm", "O"),), drawing or {}, loads=loads), np.atleast_1d(angle), rate)


class TestSprings:
    def test_force_of_a_spring_and_damper(self):
        """Tension c + k (L - l) + d L' along the line between the ends."""
        angle = np.array([0.3, 1.1, 2.0])
        spring = Spring("arm", "A", anchor="C", stiffness=40.0, length=1.2, damping=6.0, preload=2.5)
        course = held_arm(spring, angle=angle, rate=1.5)
        way = 2.0 * np.exp(1j * angle) - 0.5
        opening = np.real(np.conj(way) * 1.5j * 2.0 * np.exp(1j * angle)) / abs(way)
        tension = 2.5 + 40.0 * (abs(way) - 1.2) + 6.0 * opening
        (_, _, pull, _), (_, _, reaction, _) = spring.forces(course)
        np.testing.assert_allclose(pull, -tension * way / abs(way), rtol=1e-13)
        np.testing.assert_allclose(reaction, -pull, rtol=1e-15)
        efforts = drive_efforts(course, reactions(course))[0]
        np.testing.assert_allclose(efforts, -np.imag(np.conj(2.0 * np.exp(1j * angle)) * pull), rtol=1e-12)

    def test_a_spring_of_length_zero_pulls_with_the_distance(self):
        course = held_arm(angle=[0.0, 1.0])
        spring = Spring("arm", "O", anchor="O", stiffness=40.0)
        np.testing.assert_array_equal(next(iter(spring.forces(course)))[2], 0.0)

    def test_a_preloaded_spring_has_no_direction_if_its_ends_meet(self):
        course = held_arm(angle=[0.0])
        assert np.isnan(next(iter(Spring("arm", "O", anchor="O", preload=1.0).forces(course)))[2]).all()

    def test_energy_is_the_work_of_the_force(self):
        spring = Spring("arm", "A", anchor="C", stiffness=40.0, length=1.2, preload=2.5)
        angle = np.linspace(0.2, 1.4, 20001)
        course = held_arm(spring, angle=angle, rate=1.0)
        work = np.trapezoid(-load_power(course), angle)
        assert np.diff(spring.energy(course)[[0, -1]])[0] == pytest.approx(work, rel=1e-8)

    def test_a_torsion_spring_at_a_driven_pin_counts_turns(self):
        spring = TorsionSpring("arm", "O", stiffness=3.0, angle=0.5, damping=0.2, preload=1.0)
        course = held_arm(spring, angle=[0.5, 20.0], rate=4.0)
        expected = 1.0 + 3.0 * np.array([0.0, 19.5]) + 0.8
        np.testing.assert_allclose(drive_efforts(course, reactions(course))[0], expected, rtol=1e-13)
        turned = TorsionSpring("ground", "O", "arm", stiffness=3.0, angle=-0.5, damping=0.2, preload=-1.0)
        course = held_arm(turned, angle=[0.5, 20.0], rate=4.0)
        np.testing.assert_allclose(drive_efforts(course, reactions(course))[0], expected, rtol=1e-13)

    def test_a_torsion_spring_at_a_free_pin_stays_within_half_a_turn(self):
        case = four_bar(loads=(TorsionSpring("rocker", "D", stiffness=2.0, angle=3.0),))
        course = motion(case.mechanism, case.drive)
        direction = position_of(course, "rocker", "B") - position_of(course, "rocker", "D")
        expected = -2.0 * np.angle(direction * np.exp(-3j))
        np.testing.assert_allclose(next(iter(case.mechanism.loads[0].forces(course)))[3], expected, rtol=1e-12)

    @pytest.mark.parametrize("name", ["RRR", "RRP", "six-bar", "triad"])
    def test_the_ground_force_is_that_of_the_accelerated_masses(self, name):
        """Springs inside cancel, springs to the ground count: the ground force is the sum of m (g - a)."""
        case = sprung(ALL[name]())
        mechanism = replaced(case.mechanism, loads=springs(case))
        course = motion(mechanism, case.drive, case.rate, case.rate2)
        felt = 0.0
        for link in mechanism.links[1:]:
            for beam in link.beams:
                ends = link.points[beam.start], link.points[beam.end]
                mass = beam.mass_per_length * abs(ends[1] - ends[0])
                felt += mass * (mechanism.gravity - acceleration_of(course, link.name, sum(ends) / 2))
            for lump in link.lumps:
                center = link.points[lump.point] + lump.offset
                felt += lump.mass * (mechanism.gravity - acceleration_of(course, link.name, center))
        assert relative(reactions(course).ground_force, felt) < 1e-12

    @pytest.mark.parametrize(
        ("spring", "message"),
        [
            (Spring("arms", "A", anchor="C"), 'there is no link "arms"'),
            (Spring("arm", "B", anchor="C"), 'link "arm" has no point "B"'),
            (Spring("arm", "A", "grounds", "C"), 'a load: there is no link "grounds"'),
            (Spring("arm", "A", anchor="G"), 'a load: link "ground" has no point "G"'),
            (TorsionSpring("arm", "C"), 'a load: link "arm" has no point "C"'),
            (TorsionSpring("arm", "A"), 'a load: link "ground" has no point "A"'),
        ],
    )
    def test_its_ends_must_exist(self, spring, message):
        with pytest.raises(MechanismError, match=message):
            held_arm(spring)

    def test_dampers_dissipate_all_their_power(self):
        spring = Spring("arm", "A", anchor="C", damping=6.0)
        torsion = TorsionSpring("arm", "O", damping=0.7)
        course = held_arm(spring, torsion, angle=turn(7), rate=-2.0)
        np.testing.assert_allclose(dissipated_power(course), -load_power(course), rtol=1e-12)
        assert (dissipated_power(course) > 0).all()


class TestForceLaws:
    def test_a_linear_table_is_straight_between_entries(self):
        curve = table_curve([0.0, 1.0, 4.0], [2.0, 6.0, 0.0])
        np.testing.assert_allclose(curve([0.0, 0.25, 1.0, 2.5, 4.0]), [2.0, 3.0, 6.0, 3.0, 0.0])

    def test_a_cubic_table_reproduces_a_cubic(self):
        at = np.array([0.0, 0.4, 1.0, 1.7, 3.0])
        curve = table_curve(at, 2 - at + 0.5 * at**3, "cubic")
        x = np.linspace(0, 3, 50)
        np.testing.assert_allclose(curve(x), 2 - x + 0.5 * x**3, atol=1e-13)

    @pytest.mark.parametrize("interpolation", ["linear", "cubic"])
    def test_a_table_raises_or_holds_beyond_its_ends(self, interpolation):
        at, value = [0.0, 1.0, 2.0, 3.0], [5.0, 6.0, 8.0, 1.0]
        with pytest.raises(TableError, match=r"evaluated at 3\.5, but the table covers 0 to 3"):
            table_curve(at, value, interpolation)([1.0, 3.5])
        held = table_curve(at, value, interpolation, extend="hold")
        np.testing.assert_allclose(held([-2.0, 3.5]), [5.0, 1.0])

    @pytest.mark.parametrize(
        ("at", "value", "interpolation", "message"),
        [
            ([0.0, 1.0], [1.0], "linear", "2 abscissas and 1 values"),
            ([0.0], [1.0], "linear", "at least 2"),
            ([0.0, 1.0, 2.0], [1.0, 2.0, 3.0], "cubic", "at least 4"),
            ([0.0, 2.0, 1.0], [1.0, 2.0, 3.0], "linear", "must increase"),
            ([0.0, 1.0], [1.0, math.inf], "linear", "finite"),
            ([0.0, 1.0], [1.0, 2.0], "nearest", "expected"),
        ],
    )
    def test_an_invalid_table_is_an_error(self, at, value, interpolation, message):
        with pytest.raises(TableError, match=message):
            table_curve(at, value, interpolation)

    def test_laws_multiply_loads(self):
        """Laws of time, crank angle, slide and its rate, and their sum."""
        mechanism = slider_crank(count=8).mechanism
        time = np.linspace(0.0, 2.0, 8)

        def moment_under(law):
            loaded = replaced(mechanism, loads=(PointLoad("crank", "O", moment=10.0, law=law),), gravity=0.0)
            empty = replaced(mechanism, loads=(), gravity=0.0)
            efforts = []
            for each in (loaded, empty):
                course = motion(each, turn(8, 1.0), 3.0, time=time)
                efforts.append(drive_efforts(course, reactions(course))[0])
            return efforts[1] - efforts[0], course

        slide, crank = Slide("guide"), LinkAngle("crank")
        laws = {
            "time": (law_of_time(lambda t: 1 + t**2), lambda course: 1 + time**2),
            "angle": (law_of(crank, table_curve([0, 7], [0, 7])), lambda course: turn(8, 1.0)),
            "slide": (law_of(slide, np.square), lambda course: slide.value(course) ** 2),
            "rate": (CurveLaw(slide.rate, lambda v: -v), lambda course: -slide.rate(course)),
        }
        for law, expected in laws.values():
            found, course = moment_under(law)
            np.testing.assert_allclose(found, 10.0 * expected(course), atol=1e-11)

    def test_a_custom_load_is_any_object_with_points_and_forces(self):
        """Air drag on a point: -c

        v

        v.
        """

        class Drag:
            points = (("arm", "A"),)

            def forces(self, course):
                v = velocity_of(course, "arm", "A")
                return (("arm", "A", -0.3 * np.abs(v) * v, 0.0),)

        course = held_arm(Drag(), angle=turn(5), rate=4.0)
        np.testing.assert_allclose(drive_efforts(course, reactions(course))[0], 0.3 * 8.0**2 * 2.0, rtol=1e-13)


class TestRates:
    @pytest.mark.parametrize("name", ALL)
    def test_changed_rates_equal_a_motion_at_those_rates(self, name):
        case = ALL[name]()
        course, other = motion_of(case), motion(case.mechanism, case.drive, 2.5, -1.5)
        changed = with_rates(course, 2.5, -1.5)
        np.testing.assert_array_equal(changed.acceleration, other.acceleration)
        np.testing.assert_array_equal(changed.angular_velocity, other.angular_velocity)

    def test_the_effort_of_a_driven_slider_accelerates_its_mass(self):
        links = (Link("ground", {"G": 0.0}), Link("block", {"P": 0.0, "E": 0.1}, (Beam("P", "E", 30.0),)))
        rail = Slider("rail", "block", "ground", "P", origin=0.0, direction=np.exp(0.3j))
        mechanism = Mechanism(links, (SliderDrive("rail"),), {"P": 0.0}, (rail,), gravity=-10j)
        course = motion(mechanism, [0.0, 1.0], 2.0, 4.0)
        for efforts in (virtual_work_efforts(course), drive_efforts(course, multiplier_forces(course))):
            np.testing.assert_allclose(efforts[0], 3.0 * (4.0 + 10 * math.sin(0.3)), rtol=1e-13)


class TestRotors:
    """The inertia of a rotor, reduced to a drive on the ground, acts like a disc on the driven link."""

    @staticmethod
    def with_rotor(mechanism, inertia):
        crank = mechanism.drives[0]
        return replaced(mechanism, drives=(PinDrive(crank.link, crank.at, crank.on, inertia),))

    @staticmethod
    def with_disc(mechanism, inertia):
        return with_lump(mechanism, mechanism.drives[0].link, Lump("O", 0.0, inertia))

    def test_its_effort_energy_and_equation_of_motion(self):
        mechanism, inertia = four_bar().mechanism, 0.7
        one, other = (
            motion(each, turn(9, 0.3), 7.0, 30.0)
            for each in (self.with_rotor(mechanism, inertia), self.with_disc(mechanism, inertia))
        )
        efforts = drive_efforts(other, reactions(other))
        np.testing.assert_allclose(drive_efforts(one, reactions(one)), efforts, rtol=1e-12)
        np.testing.assert_allclose(virtual_work_efforts(one), efforts, rtol=1e-11)
        np.testing.assert_allclose(kinetic_energy(one), kinetic_energy(other), rtol=1e-13)
        np.testing.assert_allclose(reduced_inertia(one)[0], reduced_inertia(other)[0], rtol=1e-13)

    def test_joints_do_not_transmit_its_moment(self):
        mechanism = four_bar().mechanism
        one, other = (motion(each, turn(9, 0.3), 7.0, 30.0) for each in (self.with_rotor(mechanism, 0.7), mechanism))
        for with_it, without in zip(reactions(one).moment, reactions(other).moment, strict=True):
            np.testing.assert_array_equal(with_it, without)
