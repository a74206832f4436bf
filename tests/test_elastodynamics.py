"""Vibration of links agrees with independent solutions, and with the quasi-static answer in slow motion."""

import json
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
import scipy.integrate
from many_speeds import speed_map
from mechanisms import ALL, at_speed, cantilever, replaced, steel_four_bar, still, supported, with_link
from msgspec.structs import replace
from tiers import in_tiers

from elastic import RIGID, JointCompliance, Section, Taper, deflection, extremes, sample, with_rotary_inertia
from elastic.assessment import sections_with_shear
from elastic.elastodynamics import Damping, elastodynamic, including, large_displacement_error, solution, transient
from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.discretization import vibrating_model
from elastic.elastodynamics.elastic_structure import elastic_structure
from elastic.elastodynamics.equations_of_motion import kinematics, motion_terms, problem
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import vibration
from elastic.elastodynamics.reduction import reduced_basis
from elastic.elastodynamics.time_elements import Equations, propagation
from elastic.elastodynamics.time_grid import Grid, jumps, scheme
from elastic.elastodynamics.vibration_loads import of_several_speeds
from elastic.links.added_loads import AddedLoads
from elastic.vibration import natural_frequencies
from rigid import (
    Beam,
    Gear,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Spring,
    TorsionSpring,
    drive_efforts,
    motion,
)
from rigid.dynamics import law_of_time

STATIONS = np.linspace(0.0, 1.0, 7)
FOUR_BAR = steel_four_bar()


def turning(mechanism, speed, start=0.0):
    """Return the motion of a motor at constant speed, and the duration of a turn."""
    return at_speed(mechanism, speed, start), 2 * math.pi / abs(speed)


def steady(mechanism, sections, speed, count=36, turns=1, start=0.0, **more):
    motion_at, period = turning(mechanism, speed, start)
    period *= turns
    return elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, sections, **more)


def four_bar(speed, count=36, **more):
    return steady(FOUR_BAR.mechanism, FOUR_BAR.sections, speed, count, **more)


@pytest.mark.parametrize("speed", [200.0, 300.0])
def test_inertia_of_deflections_that_beam_theory_neglects(speed):
    """To first order, it changes deflections and moments as vibration does that is solved with shear deformation."""
    plain = four_bar(speed, tolerance=1e-6)
    sheared = sections_with_shear(FOUR_BAR.sections)
    exact = steady(FOUR_BAR.mechanism, sheared, speed, tolerance=1e-6, damping=plain.damping)
    more = including(lambda bent: deflection(bent.motion, sheared, bent.joints, bent.added), plain)
    for name in ("w", "M"):
        without, found, expected = (sample(each.deflection, name, STATIONS) for each in (plain, more, exact))
        assert np.abs(found - expected).max() < 0.05 * np.abs(without - expected).max()


def difference(one, other, field="w"):
    """Return the largest difference of two deflections, relative to the largest value."""
    values, reference = (sample(bent, field, STATIONS) for bent in (one, other))
    return np.abs(values - reference).max() / np.abs(reference).max()


class TestSlowMotion:
    @pytest.mark.parametrize("field", ["N", "V", "M", "u", "w", "phi"])
    def test_it_equals_the_quasi_static_answer(self, field):
        found = four_bar(1e-4, damping=1e-9)
        assert difference(found.deflection, found.quasi_static, field) < 1e-12

    def test_the_difference_scales_with_the_square_of_the_speed(self):
        answers = [four_bar(speed, damping=0.0) for speed in (1.0, 2.0)]
        errors = [difference(answer.deflection, answer.quasi_static) for answer in answers]
        assert errors[1] / errors[0] == pytest.approx(4, rel=0.02)

    def test_sections_have_rotary_inertia(self):
        """A stubby arm oscillates slowly: the drive has the inertia rho A l^3/3 + rho I l."""
        bar = Link("arm", {"O": 0, "A": 0.5}, (Beam("O", "A", 80.0),))
        bare = Mechanism((Link("ground", {"O": 0}), bar), (PinDrive("arm", "O"),), {"O": 0, "A": 0.5})
        times = np.linspace(0.0, 2 * math.pi, 12, endpoint=False)

        section = Section(2e9, 2e9 * 0.1**2, 7e8, area=0.01, inertia=0.01 * 0.1**2)
        for arm, gyration in ((with_rotary_inertia(bare, [section]), 0.1), (bare, 0.0)):

            def motion_at(t, arm=arm):
                return motion(arm, 0.3 * np.sin(t), 0.3 * np.cos(t), -0.3 * np.sin(t), t)

            found = elastodynamic(motion_at(times), motion_at, 2 * math.pi, [section], damping=0.0).deflection
            inertia = 80 * 0.5 * (0.5**2 / 3 + gyration**2)
            efforts = drive_efforts(found.motion, found.forces)[0]
            assert efforts == pytest.approx(-0.3 * inertia * np.sin(times), abs=1e-5)


@pytest.fixture(scope="module")
def found():
    return four_bar(60.0, 24, damping=40e-6)


class TestReference:
    """tests/data/steel_four_bar_vibrating.json: an independent corotational code, accurate to 0.1 %."""

    DATA = json.loads((Path(__file__).parent / "data" / "steel_four_bar_vibrating.json").read_text(encoding="utf-8"))

    def chords(self, bent):
        """Return computed and reference chord deflections of each beam, relative to the largest reference value."""
        for number, given in enumerate(self.DATA["links"].values()):
            xi, w = np.array(given["xi"]), np.array(given["w_m"])
            expected = w - w[:, :1] * (1 - xi) - w[:, -1:] * xi
            yield sample(bent, "chord", xi)[number] / np.abs(expected).max(), expected / np.abs(expected).max()

    def test_history_and_peak(self, found):
        for chord, expected in self.chords(found.deflection):
            assert np.abs(chord - expected).max() < 0.004
            assert np.abs(chord).max() == pytest.approx(1, abs=0.003)

    def test_the_quasi_static_answer_is_ten_times_less_accurate(self, found):
        assert all(np.abs(chord - expected).max() > 0.03 for chord, expected in self.chords(found.quasi_static))

    def test_the_stated_error_is_right(self, found):
        missed = max(np.abs(chord - expected).max() for chord, expected in self.chords(found.deflection))
        assert 0.5 < large_displacement_error(found) / missed < 2

    def test_it_has_converged(self, found):
        finer = four_bar(60.0, 24, damping=40e-6, tolerance=1e-6)
        assert difference(found.deflection, finer.deflection) < 2e-4
        assert difference(found.deflection, finer.deflection, "M") < 3e-4


class TestRotatingBeam:
    """A cantilever in steady rotation, in its plane; reference: power series."""

    @staticmethod
    def frequency(eta, mode=1.0):
        """Return the lowest mu = omega sqrt(m l^4/EI) of w'''' - eta^2/2 ((1 - x^2) w')' - (mu^2 + eta^2) w = 0.

        The beam is clamped at x = 0 and free at 1. Wright, Smith, Thresher and Wang, Journal of Applied Mechanics 49
        (1982) 197-202, have the flapping frequency, the root of mu^2 + eta^2.
        """

        def determinant(mu):
            rows = []
            for first in (2, 3):
                c = [mpmath.mpf(0)] * 90
                c[first] = mpmath.mpf(1)
                for k in range(86):
                    # ((1 - x^2) w')' has at x^k: (k+2)(k+1) c[k+2] - k(k+1) c[k]
                    part = (k + 2) * (k + 1) * c[k + 2] - k * (k + 1) * c[k]
                    right = eta**2 / 2 * part + (mu**2 + eta**2) * c[k]
                    c[k + 4] += right / ((k + 4) * (k + 3) * (k + 2) * (k + 1))
                rows.append([
                    sum(k * (k - 1) * value for k, value in enumerate(c)),
                    sum(k * (k - 1) * (k - 2) * value for k, value in enumerate(c)),
                ])  # fmt: skip
            return rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]

        with mpmath.workdps(30):
            return float(mpmath.findroot(determinant, mode))

    def test_the_series_gives_published_flapping_frequencies(self):
        """Wright et al., table 1: 4.1373 at eta 2, 4.7973 at eta 3."""
        for eta, expected in ((2, 4.1373), (3, 4.7973)):
            assert math.hypot(self.frequency(eta, 3.6), eta) == pytest.approx(expected, abs=5e-5)

    @pytest.mark.parametrize("eta", [0.5, 2.0, 3.0])
    def test_free_vibrations(self, eta):
        """Undamped multipliers of a turn are on the unit circle, at the angle of frequency times duration."""
        arm = cantilever({"O": 0, "A": 1.0}, 1.0)
        found = steady(arm, [Section(EA=1e8, EI=1.0)], eta, damping=0.0, tolerance=1e-8)
        angle = self.frequency(eta, 3.5) * 2 * math.pi / eta
        expected = np.exp(1j * angle)
        assert np.abs(found.multipliers - expected).min() < 1e-3

    def test_axial_forces_stiffen(self):
        """Without them the frequency would be the root of mu0^2 - eta^2: 2.89 instead of 3.62 at eta 2."""
        assert self.frequency(2.0, 3.6) - math.sqrt(3.516**2 - 4) > 0.7

    def test_stretch(self):
        """m (u'' - w^2 (x + u)) = EA u_xx: u = sin(k x)/(k cos k l) - x with k = w sqrt(m/EA)."""
        speed, EA, mass, length = 9.0, 50.0, 0.2, 1.3
        arm = cantilever({"O": 0, "A": length}, mass)
        found = steady(arm, [Section(EA=EA, EI=1e5)], speed, 3, tolerance=1e-7)
        k = speed * math.sqrt(mass / EA)
        x = STATIONS * length
        expected = np.sin(k * x) / (k * math.cos(k * length)) - x
        np.testing.assert_allclose(sample(found.deflection, "u", STATIONS)[0], [expected] * 3, rtol=0, atol=2e-6)
        assert np.abs(sample(found.quasi_static, "u", [1.0])[0] / expected[-1] - 1).min() > 0.2


def oscillator(drive=0.7, speed=3.0):
    """Return a rigid arm with an oscillating motor, and its motion."""
    arm = Link("arm", {"O": 0.0}, (), (Lump("O", 2.0, 0.05, 0.3 + 0.1j),))
    mechanism = Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {"O": 0.0})

    def motion_at(t):
        t = np.asarray(t)
        swing = drive * np.sin(speed * t)
        return motion(mechanism, swing, drive * speed * np.cos(speed * t), -(speed**2) * swing, t)

    return motion_at, 2 * math.pi / speed, 0.05 + 2.0 * abs(0.3 + 0.1j) ** 2


class TestOscillators:
    def test_rigid_link_on_a_soft_drive(self):
        """J (theta + a)'' + k (a + beta a') = 0: a = Re(J A w^2/(k (1 + i beta w) - J w^2) (-i) e^(i w t))."""
        motion_at, period, inertia = oscillator()
        times = np.arange(12) * period / 12
        soft = {"O": JointCompliance(rotation=0.05)}
        found = elastodynamic(motion_at(times), motion_at, period, [], soft, damping=0.06, tolerance=1e-10)
        factor = inertia * 0.7 * 9 / ((1 + 0.06j * 3) / 0.05 - inertia * 9)
        expected = (factor * -1j * np.exp(3j * times)).real
        np.testing.assert_allclose(found.deflection.angle[1], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        lowest = 1 / math.sqrt(0.05 * inertia)
        assert found.lowest == pytest.approx(lowest, rel=1e-12)
        decay = math.exp(-0.06 / 0.05 / inertia / 2 * period)
        assert found.growth == pytest.approx(decay, rel=1e-6)

    def test_start_from_rest(self):
        """J a'' + c a' + k a = J A w^2 sin w t from rest, integrated by scipy."""
        motion_at, period, inertia = oscillator()
        times = np.linspace(0, 2.3 * period, 50)
        soft = {"O": JointCompliance(rotation=0.05)}
        found = transient(motion_at(times), motion_at, [], soft, damping=0.01, tolerance=1e-9, undeformed=True)

        def rates(t, y):
            return y[1], 0.7 * 9 * math.sin(3 * t) - (y[0] + 0.01 * y[1]) / 0.05 / inertia

        expected = scipy.integrate.solve_ivp(rates, (0, times[-1]), [0, 0], "DOP853", times, rtol=1e-12, atol=1e-14).y[
            0
        ]
        np.testing.assert_allclose(found.deflection.angle[1], expected, rtol=0, atol=1e-8 * np.abs(expected).max())

    @pytest.mark.parametrize("kind", ["spring", "torsion spring"])
    def test_springs_and_dampers_add_to_a_soft_drive(self, kind):
        """A parallel spring and damper add k and c."""
        motion_at, period, inertia = oscillator(drive=1e-5)
        mechanism = motion_at([0.0]).mechanism
        if kind == "spring":
            # 0.2 long from below to the side of the arm: a lever of 0.5
            links = (
                Link("ground", {"O": 0.0, "S": 0.5 - 0.2j}),
                Link("arm", {"O": 0.0, "E": 0.5}, (), mechanism.links[1].lumps),
            )
            load = Spring("arm", "E", anchor="S", stiffness=40.0, length=0.2, damping=2.0)
        else:
            links, load = mechanism.links, TorsionSpring("arm", "O", stiffness=10.0, damping=0.5)
        swung = replaced(mechanism, links=links, loads=(load,))

        def driven(t):
            own = motion_at(t)
            return motion(swung, own.drive, own.drive_rate, own.drive_acceleration, t)

        times = np.arange(12) * period / 12
        soft = {"O": JointCompliance(rotation=0.05)}
        found = elastodynamic(driven(times), driven, period, [], soft, damping=0.0, tolerance=1e-9)
        moment = inertia * 1e-5 * 9 - 10 * 1e-5 - 0.5 * 3j * 1e-5
        factor = moment / (20 + 10 + 0.5 * 3j - inertia * 9)
        expected = (factor * -1j * np.exp(3j * times)).real
        np.testing.assert_allclose(found.deflection.angle[1], expected, rtol=0, atol=1e-4 * np.abs(expected).max())


class TestStability:
    """A pinned column under a pulsating force: f'' + c f' + w0^2 (1 - P(t)/Pcr) f = 0 for each mode, exactly.

    Bolotin, The Dynamic Stability of Elastic Systems, chapter 1.
    """

    LENGTH, EI, MASS = 1.0, 1.0, 1.0

    def column(self, ratio, share, beta):
        critical, lowest = math.pi**2, math.pi**2
        speed = ratio * lowest
        period = 2 * math.pi / speed
        press = PointLoad("beam", "B", -critical, law=lambda course: share * np.cos(speed * course.time))
        mechanism = supported({"A": 0, "B": self.LENGTH}, self.MASS, loads=(press,))

        def motion_at(t):
            return motion(mechanism, np.zeros((0, len(t))), time=np.asarray(t))

        found = elastodynamic(
            motion_at(np.arange(8) * period / 8), motion_at, period, [Section(EA=1e7, EI=self.EI)], damping=beta
        )
        return found, lowest, speed, period

    def mathieu(self, lowest, speed, period, share, beta):
        def rates(t, y):
            return y[1], -(lowest**2) * ((1 - share * math.cos(speed * t)) * y[0] + beta * y[1])

        ends = [
            scipy.integrate.solve_ivp(rates, (0, period), start, "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
            for start in ((1, 0), (0, 1))
        ]
        return np.abs(np.linalg.eigvals(np.array(ends).T)).max()

    @pytest.mark.parametrize(("ratio", "stable"), [(2.0, False), (1.2, True), (2.6, True)])
    def test_growth_agrees_with_mathieus_equation_near_principal_resonance(self, ratio, stable):
        found, lowest, speed, period = self.column(ratio, 0.3, 1e-3)
        expected = self.mathieu(lowest, speed, period, 0.3, 1e-3)
        assert found.growth == pytest.approx(expected, rel=1e-4)
        assert bool(found.stable) is stable
        assert (expected < 1) == stable
        assert np.isnan(found.deflection.M[:3]).all() != stable

    def test_damping_stabilizes_the_principal_resonance(self):
        assert self.column(2.0, 0.3, 0.05)[0].stable


class TestEnergy:
    def test_reversed_motion_has_reversed_displacements(self):
        forth, back = (four_bar(speed, damping=0.0) for speed in (47.0, -47.0))
        there = sample(forth.deflection, "w", STATIONS)
        again = np.roll(sample(back.deflection, "w", STATIONS)[:, ::-1], 1, axis=1)
        assert np.abs(there - again).max() < 1e-3 * np.abs(there).max()

    def test_drive_work_equals_dissipation(self):
        """The difference over a turn is proportional to the deflection: half the deflection, half the difference."""
        missing = [self.share_missing(scale) for scale in (1.0, 0.5)]
        assert missing[1] < 0.02
        assert missing[0] > 1.8 * missing[1]

    def share_missing(self, scale):
        """Scaled depths give a deflection of 1/depth^2; the speed keeps its ratio to the frequency."""
        beta, speed, count = 4e-4 / scale**0.5, 40.0, 180
        stiff = [Section(part.EA / scale, part.EI / scale) for part in FOUR_BAR.sections]
        found = steady(FOUR_BAR.mechanism, stiff, speed, count, damping=beta, tolerance=1e-6)
        work = drive_efforts(found.deflection.motion, found.deflection.forces)[0].mean() * speed
        nodes, weights = np.polynomial.legendre.leggauss(12)
        lost = 0.0
        for field, rigidity in (("N", stiff[0].EA), ("M", stiff[0].EI)):
            values = sample(found.deflection, field, (nodes + 1) / 2)
            order = np.fft.rfftfreq(count, 1 / count) * speed
            rate = np.fft.irfft(1j * order[:, None] * np.fft.rfft(values, axis=1), count, axis=1)
            lost += (rate**2 * (weights / 2)).sum(-1).mean(1) @ found.deflection.length[:, 0] * beta / rigidity
        return abs(work / lost - 1)


class TestEveryMechanism:
    """Reduced equations of motion agree with the exact solver under their loads."""

    @staticmethod
    def course(case, speed):
        """Return the motion of the case over a turn, or back and forth."""
        middle = case.drive.mean(axis=1, keepdims=True)
        size = np.ptp(case.drive, axis=1, keepdims=True) * 0.45
        whole = len(case.drive) == 1 and size[0, 0] > 2.5

        def motion_at(t):
            t = np.asarray(t)
            if whole:
                return motion(case.mechanism, case.drive[0, 0] + speed * t, speed, 0.0, t)
            swing = size * np.sin(speed * t)
            return motion(case.mechanism, middle + swing, size * speed * np.cos(speed * t), -(speed**2) * swing, t)

        return motion_at

    @pytest.mark.parametrize("name", in_tiers(ALL, 5, 5))
    def test_both_agree(self, name):
        case = ALL[name]()
        motion_at = self.course(case, 10.0)
        found = elastodynamic(motion_at(np.arange(12) * math.pi / 60), motion_at, math.pi / 5, case.sections)
        assert found.reduction_error < 1e-4
        assert difference(found.deflection, found.quasi_static) > 1e-3

    @pytest.mark.parametrize("name", in_tiers(["RRP", "PRP", "six-bar, ring"], 1, 2))
    def test_with_soft_joints(self, name):
        case = ALL[name]()
        names = {joint.name for joint in motion(case.mechanism, case.drive[:, :1]).structure.joints}
        soft = {joint: JointCompliance(translation=1e-6, rotation=1e-4) for joint in names}
        motion_at = self.course(case, 10.0)
        found = elastodynamic(motion_at(np.arange(12) * math.pi / 60), motion_at, math.pi / 5, case.sections, soft)
        assert found.reduction_error < 1e-4

    def test_frequencies_agree_with_the_structure(self):
        case = ALL["six-bar"]()
        motion_at = self.course(case, 10.0)
        times = np.arange(16) * math.pi / 80
        known = natural_frequencies(motion_at(times), case.sections, positions=16, tolerance=1e-6)
        assert elastodynamic(motion_at(times), motion_at, math.pi / 5, case.sections).lowest == pytest.approx(
            known.lowest, rel=1e-4
        )

    def test_springs_turning_loads_and_tapers(self):
        beam, lump = Beam("A", "B", 0.6, (1.0, -0.4)), Lump("B", 0.1, 1e-4, 0.02 + 0.03j)
        coupler = replace(FOUR_BAR.mechanism.links[2], beams=(beam,), lumps=(lump,))
        loads = (
            Spring("coupler", "B", anchor="O", stiffness=2e3, length=0.2, damping=3.0),
            TorsionSpring("rocker", "B", "coupler", stiffness=3.0, damping=0.01),
            PointLoad("coupler", "B", 20 - 30j, 0.4, turning=True),
            LineLoad("rocker", 0, 30 - 20j, 50j, turning=True),
        )
        mechanism = replaced(with_link(FOUR_BAR.mechanism, coupler), loads=loads, gravity=-9.81j)
        plain = FOUR_BAR.sections[0]
        sections = [plain, replace(plain, taper=Taper((1.0, -0.4), (1.0, -0.5))), replace(plain, kGA=plain.EA / 3)]
        found = steady(mechanism, sections, 50.0)
        assert found.reduction_error < 1e-4

    def test_redundant_joints(self):
        """A parallelogram with a third crank."""
        mass, lean = 0.5, 0.05 + 0.09j
        places = {"O": 0.0, "D": 0.2, "G": 0.4, "A": lean, "B": 0.2 + lean, "C": 0.4 + lean}
        bars = [
            Link(name, {start: 0.0, end: abs(lean)}, (Beam(start, end, mass),))
            for name, start, end in (("first", "O", "A"), ("second", "D", "B"), ("third", "G", "C"))
        ]
        coupler = Link("coupler", {"A": 0.0, "B": 0.2, "C": 0.4}, (Beam("A", "B", mass), Beam("B", "C", mass)))
        ground = Link("ground", {"O": 0.0, "D": 0.2, "G": 0.4})
        mechanism = Mechanism((ground, *bars, coupler), (PinDrive("first", "O"),), places)

        def motion_at(t):
            swing = 0.3 * np.sin(40 * np.asarray(t))
            return motion(mechanism, 1.2 + swing, 12 * np.cos(40 * np.asarray(t)), -1600 * swing, t)

        sections = [Section(1e5, 3.0)] * 5
        found = elastodynamic(motion_at(np.arange(12) * math.pi / 240), motion_at, math.pi / 20, sections)
        assert found.reduction_error < 1e-4
        assert difference(found.deflection, found.quasi_static) > 1e-3

    def test_gears_need_several_turns(self):
        """A wheel with a crank at two thirds of the pinion's speed: three turns of the pinion."""
        links = (
            Link("ground", {"O": 0.0, "W": 0.2}),
            Link("pinion", {"O": 0.0}, (), (Lump("O", 0.5, 1e-4),)),
            Link("wheel", {"W": 0.0, "A": 0.1}, (Beam("W", "A", 0.4),), (Lump("A", 0.2),)),
        )
        gear = Gear(PinDrive("pinion", "O"), PinDrive("wheel", "W"), -2 / 3)
        mechanism = Mechanism(
            links, (PinDrive("pinion", "O"),), {"O": 0, "W": 0.2, "A": 0.3}, gravity=-9.81j, gears=(gear,)
        )
        found = steady(mechanism, [Section(1e4, 1.0)], 30.0, 30, turns=3)
        w = sample(found.deflection, "w", [1.0])[0, :, 0]
        # only gravity varies in time, once per turn of the wheel
        np.testing.assert_allclose(w[:15], w[15:], rtol=0, atol=1e-5 * np.abs(w).max())
        assert found.reduction_error < 1e-4


class TestTransient:
    def test_it_reaches_the_steady_state(self):
        motion_at, period = turning(FOUR_BAR.mechanism, 60.0)
        times = np.linspace(0, 6 * period, 6 * 24 + 1)
        found = transient(motion_at(times), motion_at, FOUR_BAR.sections, damping=40e-6)
        reference = four_bar(60.0, 24, damping=40e-6)
        last, cycle = sample(found.deflection, "w", STATIONS)[:, 120:144], sample(reference.deflection, "w", STATIONS)
        assert np.abs(last - cycle).max() < 3e-4 * np.abs(cycle).max()
        first = sample(found.deflection, "w", STATIONS)[:, :24]
        assert np.abs(first - cycle).max() > 0.02 * np.abs(cycle).max()

    def test_it_starts_with_the_quasi_static_deflection(self):
        motion_at, period = turning(FOUR_BAR.mechanism, 20.0)
        found = transient(motion_at(np.linspace(0, 0.1 * period, 3)), motion_at, FOUR_BAR.sections, damping=40e-6)
        w, plain = (sample(bent, "w", STATIONS)[:, 0] for bent in (found.deflection, found.quasi_static))
        assert np.abs(w - plain).max() < 0.01 * np.abs(plain).max()

    def test_step_of_acceleration(self):
        """The root of a cantilever gets a step of acceleration: w(1) is the sum of modes, Blevins, Table 8-1."""
        arm = cantilever({"O": 0, "A": 1.0}, 1.0)

        def motion_at(t):
            t = np.asarray(t)
            pushed = 1e-3 * np.maximum(t - 0.1, 0)
            return motion(arm, pushed**2 / 2e-3, pushed, np.where(t > 0.1, 1e-3, 0.0), t)

        times = np.linspace(0, 1.5, 40)
        found = transient(motion_at(times), motion_at, [Section(1e6, 1.0)], damping=0.0, tolerance=1e-5)
        x, weights = np.polynomial.legendre.leggauss(60)
        x, weights = (x + 1) / 2, weights / 2
        expected = np.zeros(len(times))
        for near in (1.875, 4.694, 7.855, 10.996, 14.137):
            k = float(mpmath.findroot(lambda y: mpmath.cos(y) * mpmath.cosh(y) + 1, near))
            shape, tip = self.mode(k, x), self.mode(k, np.ones(1))[0]
            share = (shape * x * weights).sum() / (shape**2 * weights).sum()
            since = np.maximum(times - 0.1, 0)
            expected -= 1e-3 * share * tip * (1 - np.cos(k**2 * since)) / k**4
        w = sample(found.deflection, "w", [1.0])[0, :, 0]
        np.testing.assert_allclose(w, expected, rtol=0, atol=1e-3 * np.abs(expected).max())

    @staticmethod
    def mode(k, x):
        sigma = (np.sinh(k) - np.sin(k)) / (np.cosh(k) + np.cos(k))
        return np.cosh(k * x) - np.cos(k * x) - sigma * (np.sinh(k * x) - np.sin(k * x))


class TestSpeedMap:
    def test_every_speed_equals_a_steady_state(self):
        motion_at, period = turning(FOUR_BAR.mechanism, 1.0)

        def measure(bent, _):
            return np.abs(extremes(bent, ["chord"])["chord"].value).max(axis=-1)

        found = speed_map(motion_at, period, [30.0, 90.0], FOUR_BAR.sections, measure, damping=42e-6, tolerance=1e-5)
        for row, speed in enumerate((30.0, 90.0)):
            single = four_bar(speed, 360, damping=42e-6, tolerance=1e-5)
            np.testing.assert_allclose(found.values[row], measure(single.deflection, None), rtol=2e-3)
        assert found.growth[1] == pytest.approx(single.growth, rel=1e-3)
        assert found.stable.all()

    @pytest.mark.parametrize("name", in_tiers(["PRP", "six-bar, ring", "RRP", "RPR, elastic lever"], 1, 2))
    def test_speeds_in_one_batch(self, name):
        """Blocks on beams, rings, sliders and given loads: single answers agree within their stated errors."""
        case, speeds = ALL[name](), (9.0, 10.0)

        def measure(bent, _):
            """At the start of the cycle, which is also its end."""
            return sample(bent, "w", [0.5])[..., -1, 0]

        base = TestEveryMechanism.course(case, 1.0)
        found = speed_map(base, 2 * math.pi, speeds, case.sections, measure, damping=1e-4, tolerance=1e-4)
        for row, speed in enumerate(speeds):
            motion_at, times = TestEveryMechanism.course(case, speed), np.arange(1, 25) * math.pi / (12 * speed)
            one = elastodynamic(motion_at(times), motion_at, 2 * math.pi / speed, case.sections, damping=1e-4)
            largest = np.abs(sample(one.deflection, "w", STATIONS)).max()
            np.testing.assert_allclose(
                found.quasi_static[row], measure(one.quasi_static, None), rtol=1e-9, atol=1e-9 * largest
            )
            off = np.abs(found.values[row] - measure(one.deflection, None)).max() / largest
            assert off < one.discretization_error
            assert found.time_error[row] + found.reduction_error[row] < 3e-4
            assert difference(one.deflection, one.quasi_static) > 10 * off

    @pytest.mark.slow
    def test_coarse_answers_state_their_errors(self):
        """A block on a resonating beam: the first coordinates alone are off by 25 %."""
        case = ALL["RPR, elastic lever"]()
        coarse, fine = (
            speed_map(
                TestEveryMechanism.course(case, 1.0),
                2 * math.pi,
                (9.0, 12.0),
                case.sections,
                lambda bent, _: np.abs(sample(bent, "w", STATIONS)).max(axis=(-2, -1)),
                damping=1e-4,
                tolerance=tolerance,
            )
            for tolerance in (1e-2, 1e-5)
        )
        off = np.abs(coarse.values - fine.values).max(axis=1) / fine.values.max(axis=1)
        estimate = coarse.error
        assert (estimate < 2e-2).all()
        assert (off < estimate).all()


class TestCorrection:
    """Corrections replace neglected coordinates; the reference has all coordinates and no corrections."""

    @pytest.mark.parametrize(
        "name", in_tiers(["arm", "arm, motor turned about", "RRP, owner hung", "driven slider", "triad"], 2, 3)
    )
    def test_few_corrected_coordinates_equal_all(self, name):
        case, speed = ALL[name](), 10.0
        motion_at, period = TestEveryMechanism.course(case, speed), 2 * math.pi / speed
        damping = Damping(np.linspace(0.0, 2e-3, len(case.sections)), 1e-4)
        model = vibrating_model(motion_at, 0.0, period, case.sections, {}, damping)
        grid = Grid(np.linspace(0.0, period, 25))
        course = motion_at(grid.nodes)

        def vibrating(basis):
            kinds = kinematics(model.structure, course, basis, chosen_points(case.mechanism))
            return vibration(motion_terms(kinds, grid, model.damping), deflection(course, case.sections))

        whole, few = vibrating(model.cycle.unit_stiffness), vibrating(reduced_basis(model.cycle, 2, 1.0))
        found, estimate = corrected(few, 1e-8)
        before, after = (difference(each.deflection, whole.deflection) for each in (few, found))
        assert 1e-4 < before < 1.5 * corrected(few, 1.0)[1]
        assert after < 3e-5 * before
        assert estimate < 3e-8


class TestRotatingFrame:
    """Two beams at a right angle that rotate about an end: Wallrapp and Schwertassek, tables 5.5 and 5.7 [Hz]."""

    @staticmethod
    def frequencies(speed, coriolis):
        """Return frequencies in rotating axes, with or without Coriolis terms."""
        link = Link("frame", {"O": 0, "A": 2.0, "B": 2.0 + 0.4j},
                    (Beam("O", "A", 3000 * 81e-6), Beam("A", "B", 7895 * 85.5e-6)))  # fmt: skip
        frame = Mechanism((Link("ground", {"O": 0}), link), (PinDrive("frame", "O"),), {"O": 0, "A": 2, "B": 2 + 0.4j})
        sections = [
            Section(70e9 * 81e-6, 70e9 * 9e-3 * 9e-3**3 / 12),
            Section(210e9 * 85.5e-6, 210e9 * 9e-3 * 9.5e-3**3 / 12),
        ]
        grid = Grid(np.array([0.0, 0.01]))
        course = motion(frame, speed * grid.nodes, speed, 0.0, grid.nodes)
        structure = elastic_structure(frame, sections, {}, 6)
        kinds = kinematics(structure, course, np.eye(len(structure.stiffness)), chosen_points(frame))
        terms = motion_terms(kinds, grid, Damping(np.zeros(2), 0.0))
        found = problem(terms, deflection(course, sections)).equations
        M, C, K = (np.asarray(part[-1]) for part in (found.mass, found.damping, found.stiffness))
        size = len(M)
        rates = np.block(
            [[np.zeros_like(M), np.eye(size)], [-np.linalg.solve(M, K), -np.linalg.solve(M, coriolis * C)]]
        )
        omega = np.linalg.eigvals(rates).imag
        return np.sort(omega[omega > 0])[:3] / (2 * math.pi)

    def test_at_rest(self):
        """The printed third frequency 16.67 has exchanged digits: 16.76 fits the others and the effect of rotation."""
        np.testing.assert_allclose(self.frequencies(1e-6, 1), [0.9614, 7.037, 16.76], rtol=2.5e-4)

    def test_at_6_rad_per_second_without_coriolis(self):
        """The publication omits Coriolis terms; with axial forces and centrifugal terms all digits agree."""
        np.testing.assert_allclose(self.frequencies(6.0, 0), [1.044, 7.478, 17.09], rtol=5e-4)

    def test_with_coriolis_they_agree_with_cubic_finite_elements(self):
        """Eighty elements in rotating axes with axial forces from free bodies: an independent calculation."""
        np.testing.assert_allclose(self.frequencies(6.0, 1), [1.0367, 7.5106, 17.1172], rtol=5e-5)


class TestTimeElements:
    def solved(self, count, stages):
        """Solve x'' + 0.2 x' + (5.3 + 2 cos t) x = cos t from x = 1; return the end value and Mathieu's multipliers."""
        grid = Grid(np.linspace(0, 6.0, count + 1), stages)
        t = grid.nodes[1:, None, None]
        ones = np.ones_like(t)
        steps = propagation(grid, Equations(ones, 0.2 * ones, 5.3 + 2 * np.cos(t), np.cos(t)[:, 0]))
        return steps.history(np.array([1.0, 0.0]))[0][-1, 0]

    @pytest.mark.parametrize("stages", [2, 3, 4])
    def test_order(self, stages):
        """Radau IIA has order 2 s - 1."""

        def rates(t, y):
            return y[1], math.cos(t) - 0.2 * y[1] - (5.3 + 2 * math.cos(t)) * y[0]

        expected = scipy.integrate.solve_ivp(rates, (0, 6), [1, 0], "DOP853", rtol=1e-13, atol=1e-15).y[0, -1]
        counts = {2: (160, 320), 3: (60, 120), 4: (36, 72)}[stages]
        coarse, fine = (abs(self.solved(count, stages) - expected) for count in counts)
        assert math.log2(coarse / fine) == pytest.approx(2 * stages - 1, abs=0.2)

    def test_orders_within_an_element_are_spectral(self):
        """Two further stages gain at least two digits."""
        exact = self.solved(16, 8)
        errors = [abs(self.solved(6, stages) - exact) for stages in (2, 4, 6)]
        assert errors[1] < errors[0] / 100
        assert errors[2] < errors[1] / 100

    def test_derivatives_are_exact_for_polynomials(self):
        grid = Grid(np.array([0.0, 0.5, 2.0]), 4)
        values = grid.nodes[:, None] ** np.arange(5)
        one, two = grid.rates(values)
        t = grid.nodes[1:]
        np.testing.assert_allclose(one[:, 4], 4 * t**3, atol=1e-11)
        np.testing.assert_allclose(two[:, 4], 12 * t**2, atol=1e-10)
        assert scheme(4).points[-1] == 1.0

    def test_sums_of_derivatives_are_exact_for_polynomials(self):
        """Rows are real and imaginary parts of powers of time, with different amplitudes at each point."""
        grid = Grid(np.array([0.0, 0.5, 2.0]), 4)
        powers, t = np.arange(5), grid.nodes[1:, None]
        values = grid.nodes[:, None, None] ** powers * np.array([[1.0], [2.0j]])
        one, two = np.cos(t + powers), np.sin(t - powers)
        slope, bent = powers * t ** np.maximum(powers - 1, 0), powers * (powers - 1) * t ** np.maximum(powers - 2, 0)
        expected = (one * slope + two * bent).sum(axis=1)[:, None] * [1.0, 2.0j]
        np.testing.assert_allclose(grid.rates_times(values, (one, two)), expected, atol=1e-10)

    def test_a_lag_is_that_of_the_closed_form(self):
        """Periodic: a cosine with another amplitude and phase. From a start: this, and a part that decays."""
        grid = Grid(np.array([0.0, 0.1, 0.3, 0.35, 0.7, 1.0]) * 2 * np.pi)
        t = grid.nodes[1:, None]
        for lag in (0.05, 1.0, 20.0):
            expected = np.real(np.exp(1j * t) / (1 + 1j * lag))
            np.testing.assert_allclose(grid.lagged(np.cos(t), lag, True), expected, atol=1e-6)
        decaying = expected + (1.0 - np.real(1 / (1 + 1j * lag))) * np.exp(-t / lag)
        np.testing.assert_allclose(grid.lagged(np.cos(t), lag, False), decaying, atol=1e-6)
        assert grid.lagged(t, 0.0, True) is t

    def test_another_load_equals_a_new_problem(self):
        """Once, and by the inverse of the element matrices."""
        grid = Grid(np.linspace(0.0, 6.0, 7))
        t = grid.nodes[1:, None, None]
        ones = np.ones_like(t)
        posed = Equations(ones, 0.2 * ones, 5.3 + 2 * np.cos(t), np.cos(t)[:, 0])
        other, start = np.sin(3 * t)[:, 0], np.array([1.0, 0.0])
        expected = propagation(grid, replace(posed, load=other)).history(start)
        for often in (False, True):
            for found, history in zip(
                propagation(grid, posed).loaded(other, often).history(start), expected, strict=True
            ):
                np.testing.assert_allclose(found, history, atol=1e-12)


def test_a_pressed_arm_that_rests_does_not_vibrate():
    """It starts with the deflection of a beam-column: F (tan kL - kL)/(k P) at the end, k^2 = P/EI."""
    across, press, EI = 1.0, 60.0, 100.0
    arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 0.5),))
    load = PointLoad("arm", "A", -press + 1j * across)
    held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1}, loads=(load,))

    def motion_at(times):
        return motion(held, np.zeros(len(times)), 0.0, 0.0, times)

    found = transient(motion_at(np.linspace(0.0, 1.0, 41)), motion_at, [Section(EA=1e7, EI=EI)], damping=1e-4)
    w = sample(found.deflection, "w", np.ones(1))[0, :, 0]
    k = math.sqrt(press / EI)
    np.testing.assert_allclose(w, across * (math.tan(k) - k) / (k * press), rtol=2e-4)


class TestErrors:
    def test_singular_positions_are_an_error(self):
        links = (Link("ground", {"O": 0.0, "D": 0.1}), *FOUR_BAR.mechanism.links[1:])
        moved = replaced(FOUR_BAR.mechanism, links=links)
        with pytest.raises(MechanismError, match="singular or out of reach"):
            steady(moved, FOUR_BAR.sections, 10.0)

    def test_instants_that_do_not_increase(self):
        motion_at, _ = turning(FOUR_BAR.mechanism, 10.0)
        with pytest.raises(ValueError, match="in ascending order"):
            transient(motion_at(np.zeros(3)), motion_at, FOUR_BAR.sections)

    def test_speeds_of_a_map(self):
        motion_at, period = turning(FOUR_BAR.mechanism, 1.0)
        with pytest.raises(ValueError, match="above 0"):
            speed_map(motion_at, period, [0.0, 1.0], FOUR_BAR.sections, lambda bent, _: bent.w)
        with pytest.raises(ValueError, match="nothing vibrates"):
            speed_map(motion_at, period, [1.0], [RIGID] * 3, lambda bent, _: bent.w)

    def test_rigid_links_do_not_vibrate(self):
        found = steady(FOUR_BAR.mechanism, [RIGID] * 3, 10.0, 4)
        assert found.lowest == math.inf
        assert found.stable
        assert found.deflection is found.quasi_static

    def test_damping_is_reported(self):
        found = four_bar(10.0, 4)
        assert found.damping.beams[0] * found.lowest / 2 == pytest.approx(0.01)
        own = Damping(np.array([1e-5, 2e-5, 3e-5]), 0.0)
        assert four_bar(10.0, 4, damping=own).damping is own


def four_bar_with(sections):
    return steady(FOUR_BAR.mechanism, sections, 10.0, 4)


def test_a_mechanism_at_rest():
    assert still(cantilever({"O": 0, "A": 1.0}, 1.0)).columns == (1,)


def test_loads_at_several_speeds_have_one_axis():
    rng = np.random.default_rng(4)

    def loads():
        force, moment, block, gap, turn = rng.normal(size=(5, 6))
        q = rng.normal(size=(3, 2, 6))
        return AddedLoads(
            q, ((1, "A", force, moment), (2, "B", 0.0, moment)), ((3, block, 0.0),), (gap, 0.0), (0.0, turn)
        )

    one, other = loads(), loads()
    both = of_several_speeds([one, other])
    for row, each in enumerate((one, other)):
        np.testing.assert_array_equal(both.q[:, :, row], each.q)
        for found, given in ((both.points, each.points), (both.blocks, each.blocks)):
            assert [item[:-2] for item in found] == [item[:-2] for item in given]
            for item, own in zip(found, given, strict=True):
                np.testing.assert_array_equal(
                    [part[row] for part in item[-2:]], [np.broadcast_to(p, 6) for p in own[-2:]]
                )
        for found, given in ((both.gaps, each.gaps), (both.turns, each.turns)):
            np.testing.assert_array_equal([part[row] for part in found], [np.broadcast_to(p, 6) for p in given])


def test_links_without_mass_do_not_vibrate():
    """Loads on such links act quasi-statically, in a cycle and from rest."""
    case = FOUR_BAR
    light = [
        replace(link, beams=tuple(Beam(beam.start, beam.end) for beam in link.beams)) for link in case.mechanism.links
    ]
    pressed = replace(case.mechanism, links=tuple(light), loads=(PointLoad("rocker", "B", 100.0),))
    moved, period = turning(pressed, 100.0)
    motion_at = moved(np.arange(12) / 12 * period)
    for found in (elastodynamic(motion_at, moved, period, case.sections), transient(motion_at, moved, case.sections)):
        assert (found.coordinates, found.lowest) == (0, math.inf)
        assert difference(found.deflection, found.quasi_static) == 0.0


def test_jumps_are_found_despite_kinks_and_steep_slopes():
    """The instant before a jump is right to 1e-9; a small jump on a slope is left to short elements."""
    counts = []

    def values(times):
        counts.append(len(times))
        steps = np.where(times >= 0.3, 1.0, 0.0), 5.0 * (times > 0.7123) + np.sin(40 * times), np.abs(times - 0.5)
        return np.stack((*steps, np.tanh(300 * (times - 0.15)), 0.001 * (times > 0.9) + 0.5 * times), axis=-1)

    found = jumps(values, np.linspace(0.0, 1.0, 97))
    assert found == pytest.approx([0.3, 0.7123], abs=1e-8)
    assert (found < [0.3, 0.7123]).all()
    assert sum(counts) < 500
    assert not len(jumps(lambda times: np.zeros((len(times), 2)), np.linspace(0.0, 1.0, 5)))


@pytest.mark.slow
def test_elements_start_at_jumps_of_a_load():
    """A load is removed within the cycle, and the ring-down has smooth elements."""
    speed, gone = 40.0, 0.37
    period = 2 * math.pi / speed
    given = PointLoad("coupler", "B", 300.0j, law=law_of_time(lambda time: np.where(time <= gone * period, 1.0, 0.0)))
    loaded = replace(FOUR_BAR.mechanism, loads=(given,))
    found = steady(loaded, FOUR_BAR.sections, speed, tolerance=1e-3)
    assert np.abs(found.edges - gone * period).min() < 1e-8 * period
    assert found.discretization_error < 2e-3


def test_round_off_ends_the_refinement(monkeypatch):
    """Errors of 1e-6 that do not decrease end the refinement and are reported."""
    grids = []

    def of_round_off(resolved, tolerance):
        grids.append(resolved.problem.terms.grid)
        assert len(grids) < 20
        parts = np.ones(len(grids[-1].steps), int)
        parts[0] = 2
        return 3e-7, grids[-1].divided(parts)

    monkeypatch.setattr(solution, "time_error", of_round_off)
    found = steady(FOUR_BAR.mechanism, FOUR_BAR.sections, 40.0, tolerance=1e-6)
    assert found.time_error == 3e-7
