"""Mechanisms buckle at Euler's loads, for any division of rods into beams."""

import math

import numpy as np
import pytest
from mechanisms import cantilever, propped, steel_four_bar, still, supported
from msgspec.structs import replace
from nonlinear import nonlinear_equilibrium
from scene_texts import STRUT, edited
from scipy.optimize import brentq
from scipy.special import ellipk
from tiers import in_tiers

from elastic import JointCompliance, Section, deflection
from elastic.assessment import euler_ratio
from elastic.assessment.buckling import RESOLVED, BucklingModes, buckling_ratio
from elastic.assessment.buckling_bound import buckling_bound
from kinelast import read_scene, scene_from_text, shipped_scenes
from kinelast.answers.results import results_in_full
from kinelast.reports.limits import acceptance
from kinelast.reports.summary import summary
from kinelast.runs import computed
from kinelast.scene.data import scene_deflection
from kinelast.speed_study.speeds import speeds
from kinelast.tasks.request import Request
from rigid import Beam, Link, Lump, Mechanism, PinDrive, PointLoad, Slider, Spring, Weld, motion
from rigid.dynamics import law_of_time

EI = 3.0
SLENDER = Section(EA=1e9, EI=EI)


HAMMER = """
[materials.light]
E = "70 GPa"
density = 100
damping = "100 us"

[sections]
crank = {shape = "rectangle", depth = "6 mm", width = "10 mm"}
rod = {shape = "rectangle", depth = "5 mm", width = "10 mm"}

[points]
O = [0.0, 0.0]
A = [0.05, 0.0]
B = [0.35, 0.0]

[links]
ground.points = ["O"]
crank = {points = ["O", "A"], section = "crank", material = "light"}
rod = {points = ["A", "B"], section = "rod", material = "light"}
ram = {points = ["B"], mass = "2 kg"}

[sliders]
guide = {link = "ram", through = "B", direction = "0 deg"}

[[drives]]
link = "crank"
speed = "70 rad/s"

[limits]
buckling = 0.6

[run]
positions = 180
"""  # a light rod with pinned ends moves a heavy ram, and the soft crank lets it vibrate

LOADED_STRUT = edited(STRUT, ("-2 kN", "-2.8 kN"))


def divided(parts, length=1.5):
    return {f"P{k}": length * k / parts for k in range(parts + 1)}


def buckling_factor(bent):
    """Factor on all forces at which the mechanism buckles at each position, without the search of `buckling_ratio`."""
    try:
        ratio = BucklingModes(bent).of_links(np.arange(bent.motion.columns[-1])).max(axis=1)
    except np.linalg.LinAlgError:
        return np.full(bent.motion.columns, np.nan)
    with np.errstate(divide="ignore"):
        return 1.0 / ratio


def frequencies(mechanism):
    """Return the lowest natural frequency at rest, without and with the loads."""
    bent = deflection(still(mechanism), [SLENDER] * len(mechanism.beams))
    return [each[0] for each in BucklingModes(bent).frequencies(np.zeros(1, int))]


def factor(mechanism, joints=None):
    beams = len(mechanism.beams)
    return buckling_factor(deflection(still(mechanism), [SLENDER] * beams, joints))[0]


class TestEulersColumns:
    """Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., sections 2.1 to 2.3."""

    @pytest.mark.parametrize("parts", [1, 2, 4])
    def test_pinned_at_both_ends(self, parts):
        press = PointLoad("beam", f"P{parts}", -1.0)
        found = factor(supported(divided(parts), loads=(press,)))
        assert found == pytest.approx(math.pi**2 * EI / 1.5**2, rel=1e-6)

    @pytest.mark.parametrize("parts", [1, 3])
    def test_clamped_and_free(self, parts):
        press = PointLoad("beam", f"P{parts}", -1.0)
        assert factor(cantilever(divided(parts), loads=(press,))) == pytest.approx(math.pi**2 * EI / 9, rel=1e-6)

    @pytest.mark.parametrize("parts", [1, 2])
    def test_clamped_and_pinned(self, parts):
        """tan x = x."""
        found = factor(propped(divided(parts), loads=(PointLoad("beam", "P0", 1.0),)))
        assert found == pytest.approx(4.493409457909064**2 * EI / 1.5**2, rel=2e-5)

    @pytest.mark.parametrize(("parts", "off"), [(1, 1e-3), (2, 1e-6), (3, 1e-6)])
    def test_clamped_at_both_ends(self, parts, off):
        """The column is welded to the ground and to a block that slides along it."""
        places, end = divided(parts), f"P{parts}"
        beams = tuple(Beam(f"P{k}", f"P{k + 1}", 1.0) for k in range(parts))
        links = (Link("ground", {"P0": 0.0}), Link("beam", places, beams), Link("block", {end: 1.5}))
        welds = (Weld("P0", "beam", "ground"), Weld(end, "beam", "block"))
        guide, press = Slider("guide", "block", "ground", end, 0.0, 1.0), PointLoad("beam", end, -1.0)
        found = factor(Mechanism(links, (), places, (guide,), loads=(press,), welds=welds))
        assert found == pytest.approx(4 * math.pi**2 * EI / 1.5**2, rel=off)

    def test_under_its_own_weight(self):
        """The critical weight of a clamped column is 7.8373 EI/l^2, section 2.12."""
        column = cantilever({"A": 0, "B": 1.5}, 0.2, gravity=-9.81)
        assert factor(column) * 0.2 * 9.81 * 1.5 == pytest.approx(7.83735 * EI / 1.5**2, rel=1e-5)

    def test_the_ratio_of_a_divided_rod_is_that_of_the_rod(self):
        press = PointLoad("beam", "P4", -1.0)
        bent = deflection(still(supported(divided(4), loads=(press,))), [SLENDER] * 4)
        assert 1 / euler_ratio(bent).max() == pytest.approx(buckling_factor(bent)[0], rel=1e-4)


def bar_on_spring(load):
    """Return a bar that only a soft drive or a spring keeps upright."""
    bar = Link("bar", {"O": 0.0, "A": 0.8}, (), (Lump("A", 2.0),))
    links = (Link("ground", {"O": 0.0, "S": 0.8 + 5j}), bar)
    return Mechanism(links, (PinDrive("bar", "O"),), {"O": 0.0, "A": 0.8}, gravity=-9.81, loads=load)


class TestRigidLinks:
    def test_on_a_soft_drive(self):
        """k = factor m g l."""
        bent = deflection(still(bar_on_spring(())), [], {"O": JointCompliance(rotation=1 / 40.0)})
        assert buckling_factor(bent)[0] == pytest.approx(40 / (2 * 9.81 * 0.8), rel=1e-12)

    def test_beside_a_spring(self):
        """k + s l^2 = factor m g l, for an unstressed spring across the bar."""
        spring = Spring("bar", "A", anchor="S", stiffness=30.0, length=5.0)
        bent = deflection(still(bar_on_spring((spring,))), [], {"O": JointCompliance(rotation=1 / 40.0)})
        assert buckling_factor(bent)[0] == pytest.approx((40 + 30 * 0.64) / (2 * 9.81 * 0.8), rel=1e-12)

    def test_a_hanging_bar_never_buckles(self):
        hung = replace(bar_on_spring(()).links[1])
        mechanism = Mechanism((Link("ground", {"O": 0.0}), hung), (PinDrive("bar", "O"),), {"O": 0.0}, gravity=9.81)
        bent = deflection(still(mechanism), [], {"O": JointCompliance(rotation=1.0)})
        assert buckling_factor(bent)[0] == math.inf

    def test_rigid_mechanisms_do_not_buckle(self):
        arm = Link("arm", {"O": 0.0, "A": 1.0}, (Beam("O", "A", 1.0),))
        mechanism = Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {"O": 0.0, "A": 1.0})
        assert buckling_factor(deflection(still(mechanism), [Section()]))[0] == math.inf


class TestNaturalFrequencies:
    """Forces change natural frequencies, by the same stiffness that vanishes at the critical load."""

    @pytest.mark.parametrize("share", [-2.0, 0.5, 0.9])
    def test_a_pinned_column(self, share):
        """omega = pi^2 sqrt((1 - P/Pe) EI / (m l^4)), also under tension."""
        press = PointLoad("beam", "P2", -share * math.pi**2 * EI / 1.5**2)
        free, loaded = frequencies(supported(divided(2), 0.2, loads=(press,)))
        omega = (math.pi / 1.5) ** 2 * math.sqrt(EI / 0.2)
        assert free == pytest.approx(omega, rel=1e-5)
        assert loaded == pytest.approx(omega * math.sqrt(1 - share), rel=1e-4)

    def test_beyond_the_critical_load(self):
        press = PointLoad("beam", "P1", -1.01 * math.pi**2 * EI / 1.5**2)
        assert frequencies(supported(divided(1), 0.2, loads=(press,)))[1] == 0.0

    def test_a_rigid_bar_on_a_soft_drive_beside_a_spring(self):
        """omega^2 = k / (m l^2), and (k + s l^2 - m g l) / (m l^2) with the spring and the weight."""
        spring = Spring("bar", "A", anchor="S", stiffness=30.0, length=5.0)
        bent = deflection(still(bar_on_spring((spring,))), [], {"O": JointCompliance(rotation=1 / 40.0)})
        found = [each[0] for each in BucklingModes(bent).frequencies(np.zeros(1, int))]
        stiffness = 40.0, 40.0 + 30 * 0.64 - 2 * 9.81 * 0.8
        assert found == pytest.approx([math.sqrt(each / (2 * 0.64)) for each in stiffness], rel=1e-9)

    @pytest.mark.parametrize("inward", [False, True])
    def test_a_soft_pin_on_a_rotor(self, inward):
        """omega^2 = k / (m l^2) + Omega^2 a / l: mass at the distance l from a pin at the radius a (Den Hartog)."""
        radius, length, spin, k = 0.3, -0.2 if inward else 0.2, 12.0, 40.0
        hub = Link("hub", {"O": 0.0, "R": radius})
        bar = Link("bar", {"R": 0.0, "A": length}, (), (Lump("A", 2.0),))
        drawing = {"O": 0.0, "R": radius, "A": radius + length}
        mechanism = Mechanism(
            (Link("ground", {"O": 0.0}), hub, bar), (PinDrive("hub", "O"), PinDrive("bar", "R", on="hub")), drawing
        )

        def motion_at(times):
            times = np.asarray(times, float)
            return motion(mechanism, np.stack([spin * times, 0 * times]), [[spin], [0.0]], time=times)

        bent = deflection(motion_at([0.1, 0.2, 0.3]), [], {"R": JointCompliance(rotation=1 / k)})
        free, loaded = BucklingModes(bent).frequencies(np.array([1]), motion_at)
        at_rest = k / (2 * length**2)
        assert free[0] == pytest.approx(math.sqrt(at_rest), rel=1e-9)
        assert loaded[0] == pytest.approx(math.sqrt(at_rest + spin**2 * radius / length), rel=1e-4)

    @pytest.mark.parametrize("swing", [0.01, 0.3])
    def test_a_soft_pin_on_a_rotor_that_oscillates(self, swing):
        """In the middle of its swing, the rotor turns at its largest rate and has no acceleration."""
        radius, length, k, rate = 0.3, 0.2, 40.0, 900.0
        hub = Link("hub", {"O": 0.0, "R": radius})
        bar = Link("bar", {"R": 0.0, "A": length}, (), (Lump("A", 2.0),))
        mechanism = Mechanism(
            (Link("ground", {"O": 0.0}), hub, bar),
            (PinDrive("hub", "O"), PinDrive("bar", "R", on="hub")),
            {"O": 0.0, "R": radius, "A": radius + length},
        )

        def motion_at(times):
            times = np.asarray(times, float)
            turned = swing * np.sin(rate * times)
            rates = [swing * rate * np.cos(rate * times), 0 * times]
            second = [-(rate**2) * turned, 0 * times]
            return motion(mechanism, np.stack([turned, 0 * times]), np.stack(rates), np.stack(second), time=times)

        times = np.linspace(0.0, 2 * math.pi / rate, 37)
        bent = deflection(motion_at(times), [], {"R": JointCompliance(rotation=1 / k)})
        _, loaded = BucklingModes(bent).frequencies(np.array([18]), motion_at)
        expected = k / (2 * length**2) + (swing * rate) ** 2 * radius / length
        assert loaded[0] == pytest.approx(math.sqrt(expected), rel=1e-3)

    def test_the_error_of_a_frequency_includes_the_load(self):
        """The crank is in line with the strut, so the strut is a pinned column under 0.85 times its critical load."""
        scene = scene_from_text(LOADED_STRUT + '[limits.figures]\nfrequency = {least = "200 rad/s"}\n')
        results = computed(scene, Request())
        assert results.frequencies.lowest == pytest.approx(239.2, rel=1e-3)
        lowest = summary(results)["vibration"]["natural"][0]["lowest"]
        critical = math.pi**2 * 210e9 * math.pi * 0.012**4 / 64 / 0.8**2
        expected = lowest["value"] * (1 - math.sqrt(1 - 2800 / critical))
        assert lowest["error"] == pytest.approx(expected, rel=0.02)
        assert lowest["unreliable"]
        verdict = acceptance(results)
        assert verdict.verdict == "too close to decide"
        assert "loads, springs and motion change natural frequencies by −61 %" in verdict.problem


def test_every_position_of_a_mechanism():
    """The load, and so the factor, scales with the square of the speed; the mechanism bears more than single beams."""
    case = steel_four_bar(24)
    fast, slow = (
        buckling_factor(deflection(motion(case.mechanism, case.drive, speed), case.sections)) for speed in (100.0, 50.0)
    )
    np.testing.assert_allclose(slow, 4 * fast, rtol=1e-9)
    bent = deflection(motion(case.mechanism, case.drive, 100.0), case.sections)
    assert fast.min() > 1 / euler_ratio(bent).max()


def test_the_factor_of_redundant_joints_is_unknown():
    """A pin on the ground is also in a slot on the ground."""
    arm = Link("arm", {"O": 0.0, "A": 1.0, "B": 2.0}, (Beam("O", "A", 1.0), Beam("A", "B", 1.0)))
    block = Link("block", {"O": 0.0})
    slot = Slider("slot", "block", "ground", "O", 0.0, 1.0)
    links, places = (Link("ground", {"O": 0.0}), arm, block), {"O": 0.0, "B": 2.0}
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), places, (slot,))
    assert np.isnan(buckling_factor(deflection(still(mechanism), [SLENDER] * 2))).all()


def half_portal(end, block="block"):
    """Return half a clamped frame: the middle of its beam slides along `end`, and rotates if it has a block."""
    places = {"A": 0.0, "B": 1j, "M": 0.5 + 1j}
    frame = Link("frame", places, (Beam("A", "B", 1.0), Beam("B", "M", 1.0)))
    blocks = (Link("block", {"M": places["M"]}),) if block == "block" else ()
    guide = Slider("guide", block, "ground", "M", places["M"], end)
    links, held = (Link("ground", {"A": 0.0}), frame, *blocks), (Weld("A", "frame", "ground"),)
    return Mechanism(links, (), places, (guide,), loads=(PointLoad("frame", "B", -1j),), welds=held)


class TestFrames:
    def test_a_portal_that_sways(self):
        """u cot u = -6 for a frame as wide as high, clamped below: 7.38 EI/h^2, Timoshenko and Gere, section 2.4."""
        u = brentq(lambda u: u / math.tan(u) + 6, 1.7, 3.1)
        found = buckling_factor(deflection(still(half_portal(1.0)), [SLENDER] * 2))[0]
        assert found == pytest.approx(u**2 * EI, rel=1e-5)
        assert u**2 == pytest.approx(7.38, abs=0.005)

    def test_a_portal_that_does_not_sway(self):
        """The stability function s(u) is -2 h/l: the symmetric half of the beam has the stiffness 2 EI/l."""

        def stiffness(u):
            return u * (math.sin(u) - u * math.cos(u)) / (2 - 2 * math.cos(u) - u * math.sin(u))

        u = brentq(lambda u: stiffness(u) + 2, 4.6, 6.0)
        found = buckling_factor(deflection(still(half_portal(1j, "frame")), [SLENDER] * 2))[0]
        assert found == pytest.approx(u**2 * EI, rel=1e-4)

    def test_a_column_with_lateral_support(self):
        """The beam sinks freely: tan u = u."""
        found = buckling_factor(deflection(still(half_portal(1j)), [SLENDER] * 2))[0]
        assert found == pytest.approx(4.493409457909064**2 * EI, rel=1e-4)


@pytest.mark.parametrize("soft", [0.05, 0.4, 4.0])
def test_a_rod_between_soft_joints(soft):
    """The rod rotates about its joint at k l, or bends at pi^2 EI/l^2: the modes are independent."""
    press = PointLoad("beam", "P1", -1.0)
    joints = {"P1": JointCompliance(translation=soft)}
    found = factor(supported(divided(1), loads=(press,)), joints)
    assert found == pytest.approx(min(1.5 / soft, math.pi**2 * EI / 1.5**2), rel=1e-5)


def test_a_follower_load_has_no_static_buckling():
    """Beck's column buckles dynamically at 20.05 EI/l^2, but not statically."""
    for load in (1.0, 20.0, 40.0):
        press = PointLoad("beam", "P1", -load * EI / 1.5**2, turning=True)
        bent = deflection(still(cantilever(divided(1), loads=(press,))), [SLENDER])
        assert buckling_factor(bent)[0] == math.inf
        assert buckling_ratio(bent).largest == 0.0


@pytest.mark.parametrize("tip", [40.0, 60.0])
def test_finite_elements_buckle_beyond_the_critical_load(tip):
    """After a temporary side load they follow the elastica (Timoshenko and Gere, section 2.7)."""
    k = math.sin(math.radians(tip) / 2)
    quarter = float(ellipk(k**2))
    critical = factor(cantilever(divided(1), loads=(PointLoad("beam", "P1", -1.0),)))
    press, lean = law_of_time(lambda time: time), law_of_time(lambda time: np.sin(np.pi * time))

    def bent(share):
        loads = (
            PointLoad("beam", "P1", -share * critical, law=press),
            PointLoad("beam", "P1", 0.05j * critical, law=lean),
        )
        column = cantilever(divided(1), loads=loads)
        found = nonlinear_equilibrium(column, [Section(1e5, EI)], [lambda t: (0 * t,) * 3], np.linspace(0, 1, 20), 8)
        return abs(found.w[0, -1, -1])

    assert bent(0.9) < 1e-9
    assert bent((2 * quarter / math.pi) ** 2) == pytest.approx(1.5 * 2 * k / quarter, rel=1e-3)


class TestBound:
    @pytest.mark.parametrize("end", [1.0, 1j])
    def test_the_bound_exceeds_the_ratio(self, end):
        bent = deflection(still(half_portal(end)), [SLENDER] * 2)
        share = 1 / buckling_factor(bent)[0]
        assert share <= buckling_bound(bent).max() < 3 * share

    def test_the_bound_of_a_pinned_rod_is_exact(self):
        bent = deflection(still(supported(divided(1), loads=(PointLoad("beam", "P1", -1.0),))), [SLENDER])
        assert buckling_bound(bent).max() == pytest.approx(1.5**2 / (math.pi**2 * EI), rel=1e-6)

    @pytest.mark.parametrize("name", in_tiers(["quick_return", "flapping_wing", "drs_push_up", "flap_bars"], 1, 3))
    def test_the_bound_of_each_link_exceeds_its_ratio(self, name):
        """The reference analyses each position by itself. The spans alone are no bound for the first two."""
        scene = read_scene(shipped_scenes()[name])
        time = scene.course.times(8)
        bound = buckling_bound(scene_deflection(scene, scene.course.at(time)))
        each = [buckling_ratio(scene_deflection(scene, scene.course.at(time[at : at + 1]))).ratio for at in range(8)]
        true = np.nan_to_num(np.stack(each, axis=-1))
        known = np.isfinite(bound)
        assert (bound[known] >= true[known] * (1 - 1e-9) - 1e-12 * true.max()).all()

    def test_the_bound_holds_for_several_designs(self):
        case = steel_four_bar(24)
        moved = motion(case.mechanism, case.drive, 100.0)
        bent = deflection(moved, case.sections)
        of_all = buckling_bound(bent).max(axis=0)
        assert (of_all >= 1 / buckling_factor(bent) - 1e-12).all()
        one = case.sections[0]
        wide = [Section(one.EA * np.ones((2, 1)), one.EI * np.array([[1.0], [0.5]])), *case.sections[1:]]
        many = buckling_bound(deflection(moved, wide)).max(axis=0)
        np.testing.assert_allclose(many[0], of_all, rtol=1e-9)
        assert (many[1] >= many[0]).all()

    def test_the_largest_ratio_needs_few_positions(self):
        case = steel_four_bar(72)
        bent = deflection(motion(case.mechanism, case.drive, 100.0), case.sections)
        every = 1 / buckling_factor(bent)
        for found in (buckling_ratio(bent, resolved=0.0), buckling_ratio(bent)):
            assert found.largest == pytest.approx(every.max(), rel=1e-12)
            assert found.position[found.link] == every.argmax()
        assert every.max() < RESOLVED

    @pytest.mark.parametrize("name", in_tiers(["steel_four_bar", "offset_slider_crank", "pusher"], 1, 1))
    def test_the_largest_ratio_of_each_link_needs_few_positions(self, name):
        """The reference analyses each position by itself."""
        scene = read_scene(shipped_scenes()[name])
        time = scene.course.times(120)
        found, *single = (
            buckling_ratio(scene_deflection(scene, scene.course.at(each))) for each in (time, *time[:, None])
        )
        every = np.array([each.ratio for each in single])
        np.testing.assert_allclose(found.ratio, every.max(axis=0), rtol=1e-6, atol=1e-12)


class TestVibration:
    """Forces include vibration: a limit and the axial force beside it describe the same loads."""

    EULER = math.pi**2 * 70e9 * (10e-3 * 5e-3**3 / 12) / 0.3**2

    def test_the_load_includes_vibration(self):
        results = results_in_full(scene_from_text(HAMMER))
        pressed = max(-float(results.cycle.extremes["N"].value[1].min()), 0.0)
        [limit] = summary(results)["acceptance"]["limits"]
        assert limit["found"]["value"] == pytest.approx(pressed / self.EULER, rel=0.01)
        assert limit["found"]["value"] > 1.5 * buckling_ratio(results.quasi_static).largest
        assert limit["outcome"] == "not kept"

    @pytest.mark.slow
    def test_each_speed_includes_vibration(self):
        scene = scene_from_text(HAMMER)
        found = speeds(scene, (50.0, 70.0, 3))
        _, value, error = found.figures["buckling"]
        peak = results_in_full(scene).figures.peaks["buckling"][1]
        assert value[-1] == pytest.approx(peak.value, abs=error[-1] + peak.error_size)
        assert found.verdicts[-1] == "not acceptable"
        assert 50.0 < found.highest < 70.0

    @pytest.mark.slow
    def test_a_load_beyond_the_critical_load_is_not_reliable(self):
        """It lasts for a moment, so the link need not buckle."""
        text = (
            HAMMER.replace("6 mm", "4.5 mm").replace("70 rad/s", "60 rad/s").replace("buckling = 0.6", "deflection = 1")
        )
        acceptance = summary(results_in_full(scene_from_text(text)))["acceptance"]
        assert acceptance["verdict"] == "cannot be judged"
        assert acceptance["problem"] == "not reliable: buckling"
