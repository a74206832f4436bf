"""Friction in joints acts against the motion, in proportion to joint forces, and drives supply the heat."""

from functools import cache

import balance
import geared
import numpy as np
import pytest
from mechanisms import ALL, four_bar, inverted_slider_crank, motion_of
from msgspec.structs import asdict, replace
from scene_texts import FOUR_BAR, SLIDER_CRANK, edited
from second_routes import multiplier_forces, virtual_work_efforts

from elastic import Section, deflection
from fem_check import compare, solve
from kinelast.designs import evaluate
from kinelast.reports.summary import summary
from kinelast.runs import computed
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.scene.parsing import parse_toml
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from rigid import (
    Beam,
    Friction,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Resistance,
    Slider,
    SliderDrive,
    drive_efforts,
    motion,
    reactions,
    structure,
)
from rigid.dynamics import Effort, forward
from rigid.kinetostatics.friction import friction_power

L, R = 0.2, 0.05


def rubbed(mechanism, size=1.0):
    """Return the mechanism with friction in each joint with a unique name."""
    names = [joint.name for joint in structure(mechanism).joints]
    slides = {slider.name for slider in mechanism.sliders}
    friction = {
        name: Friction(0.1 * size, length=0.3, viscosity=2.0 * size)
        if name in slides
        else Friction(0.2 * size, radius=0.01, viscosity=0.03 * size)
        for name in names
        if names.count(name) == 1
    }
    return replace(mechanism, friction=friction)


def slider_crank(friction, loads=(), mass=0.0, end="B"):
    links = (
        Link("ground", {"O": 0}),
        Link("crank", {"O": 0, "A": R}),
        Link("rod", {"A": 0, end: L}),
        Link("piston", {"B": 0} if end == "B" else {"B": 0, end: 0.03j}, lumps=(Lump("B", mass),)),
    )
    places = {"O": 0, "A": R, "B": 0.25} | ({} if end == "B" else {end: 0.25 + 0.03j})
    guide = Slider("guide", "piston", "ground", "B", 0.0, 1.0)
    return Mechanism(links, (PinDrive("crank", "O"),), places, (guide,), loads=loads, friction=friction)


@cache
def rubbing(name):
    """Return a case with friction everywhere, and its joint forces."""
    case = ALL[name]()
    course = motion_of(replace(case, mechanism=rubbed(case.mechanism)))
    return course, reactions(course)


class TestClosedForms:
    def test_of_a_block_on_an_incline(self):
        """Up m g (sin a + mu cos a), down m g (sin a - mu cos a), at rest m g sin a, each plus m times acceleration."""
        mass, slope, mu = 3.0, 0.3, 0.2
        line = np.exp(1j * slope)
        links = (Link("ground", {"O": 0, "P": 1}), Link("block", {"C": 0}, lumps=(Lump("C", mass),)))
        guide = Slider("guide", "block", "ground", "C", 0.0, line, line)
        made = Mechanism(
            links, (SliderDrive("guide"),), {"O": 0, "P": 1, "C": 0}, (guide,), -9.81j, friction={"guide": Friction(mu)}
        )
        course = motion(made, np.zeros((1, 3)), [[2.0, 0.0, -2.0]], [[0.5, 0.5, 0.5]])
        weight = mass * 9.81
        expected = weight * np.sin(slope) + mu * weight * np.cos(slope) * np.array([1, 0, -1]) + mass * 0.5
        np.testing.assert_allclose(drive_efforts(course, reactions(course))[0], expected, rtol=1e-14)

    def test_of_a_slider_crank(self):
        """The rod force P satisfies P cos b = F -+ mu

        P sin b

        ; the crank's moment is P r sin(a + b).
        """
        mu, force = 0.3, 700.0
        made = slider_crank({"guide": Friction(mu)}, (PointLoad("piston", "B", -force),))
        angle = np.linspace(0.05, 3.0, 40)  # the piston moves inwards
        course = motion(made, angle, 2.0)
        lean = np.arcsin(R * np.sin(angle) / L)
        pushed = force / (np.cos(lean) + mu * np.sin(lean))  # the load drives, and friction carries part of it
        found = reactions(course)
        expected = -pushed * R * np.sin(angle + lean)
        np.testing.assert_allclose(drive_efforts(course, found)[0], expected, rtol=1e-12, atol=1e-12)
        back = motion(made, angle, -2.0)
        pushed = force / (np.cos(lean) - mu * np.sin(lean))
        expected = -pushed * R * np.sin(angle + lean)
        np.testing.assert_allclose(drive_efforts(back, reactions(back))[0], expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found.feedback, mu * np.tan(lean), rtol=1e-12)

    def test_of_friction_circles(self):
        """The force in a massless rod is tangent to the friction circle mu r of each pin."""
        mu, radius = 0.25, 0.008
        own = Friction(mu, radius)
        made = slider_crank({"A": own, "B": own}, (PointLoad("piston", "B", -500.0),))
        angle = np.linspace(0.1, 6.2, 50)
        course = motion(made, angle, 3.0)
        found = reactions(course)
        number = [joint.name for joint in course.structure.joints].index("A")
        rod = course.mechanism.index["rod"]
        sign = 1.0 if course.structure.joints[number].child == rod else -1.0
        force = sign * found.force[number]
        omega = course.angular_velocity
        at_A, at_B = np.sign(omega[rod] - omega[1]), np.sign(omega[rod] - omega[3])
        lever = (np.conj(course.direction[rod]) * force).imag / np.abs(force)
        np.testing.assert_allclose(lever, -mu * radius * (at_A + at_B) / L, atol=1e-14)
        np.testing.assert_allclose(np.abs(found.moment[number]), mu * radius * np.abs(force), rtol=1e-13)

    @pytest.mark.parametrize("mu", [0.05, 0.6])
    def test_of_an_eccentrically_loaded_guide(self, mu):
        """A force P at distance e causes the friction 2 mu P e / l: P (1 - 2 mu e/l) = F; it jams at l = 2 mu e."""
        e, force = 0.03, 300.0
        length = 2 * mu * e / np.array([[0.5], [0.9999], [1.0001], [2.0]])
        own = Friction(mu, length=length)
        made = slider_crank({"guide": own}, (PointLoad("piston", "B", -force),), end="C")
        level = np.arcsin(e / R)  # the rod is along the line
        course = motion(made, [level], -2.0)  # and the piston moves outwards, against the force
        found = reactions(course)
        np.testing.assert_array_equal(found.locked[:, 0], [False, False, True, True])
        expected = force / (1 - 2 * mu * e / length[:2, 0])
        np.testing.assert_allclose(drive_efforts(course, found)[0][:2, 0], -expected * e, rtol=1e-9)

    def test_locked_positions_of_a_crank_are_unknown(self):
        mu = 6.0
        made = slider_crank({"guide": Friction(mu)}, (PointLoad("piston", "B", -700.0),))
        angle = np.linspace(0.02, np.pi - 0.02, 60)
        course = motion(made, angle, -2.0)
        found = reactions(course)
        locks = mu * R * np.sin(angle) / np.sqrt(L**2 - (R * np.sin(angle)) ** 2) >= 1
        assert 10 < locks.sum() < 50
        np.testing.assert_array_equal(found.locked, locks)
        np.testing.assert_array_equal(np.isnan(drive_efforts(course, found)[0]), locks)
        np.testing.assert_array_equal(np.isnan(found.ground_force), locks)


class TestLaws:
    @pytest.mark.parametrize("name", ALL)
    def test_power_becomes_energy_and_heat(self, name):
        course, found = rubbing(name)
        heat = friction_power(course, found)
        power = (drive_efforts(course, found) * course.drive_rate).sum(axis=0) + balance.applied_power(course)
        left = power - balance.kinetic_power(course) - heat
        assert np.abs(left).max() < 1e-12 * np.abs(power).max()
        assert heat.min() >= 0 < heat.max()

    @pytest.mark.parametrize("name", ALL)
    def test_ground_forces_agree_with_momentum(self, name):
        course, found = rubbing(name)
        force, moment = balance.missing_force(course)
        scale = max(np.abs(part).max() for part in found.force)
        np.testing.assert_allclose(found.ground_force, force, atol=1e-12 * scale)
        np.testing.assert_allclose(found.ground_moment, moment, atol=1e-12 * scale)

    @pytest.mark.parametrize("name", ALL)
    def test_virtual_work_and_multipliers_agree(self, name):
        course, found = rubbing(name)
        other = multiplier_forces(course)
        scale = max(np.abs(part).max() for part in found.force)
        for parts in zip((*found.force, *found.moment), (*other.force, *other.moment), strict=True):
            np.testing.assert_allclose(*parts, atol=1e-11 * scale)
        efforts = drive_efforts(course, found)
        np.testing.assert_allclose(virtual_work_efforts(course), efforts, atol=1e-12 * scale)
        plain = motion(
            replace(course.mechanism, friction={}), course.drive, course.drive_rate, course.drive_acceleration
        )
        assert np.abs(drive_efforts(plain, reactions(plain)) - efforts).max() > 1e-4 * np.abs(efforts).max()

    @pytest.mark.parametrize("name", ALL)
    def test_finite_elements_agree(self, name):
        course, _ = rubbing(name)
        sections = ALL[name]().sections
        compared = compare(deflection(course, sections), solve(course, sections, 4))
        assert compared.passed, compared

    @pytest.mark.parametrize("train", [geared.pair, geared.planetary, geared.rack, geared.idler_chain])
    def test_friction_in_geared_trains_agrees_with_multipliers(self, train):
        made = train(3)
        course = motion(rubbed(made.mechanism), made.drive, made.rate, made.rate2)
        found, other = reactions(course), multiplier_forces(course)
        scale = max(np.abs(part).max() for part in found.force)
        assert scale > 0 < max(np.abs(part).max() for part in found.friction.values())
        for parts in zip((*found.force, *found.moment), (*other.force, *other.moment), strict=True):
            np.testing.assert_allclose(*parts, atol=1e-10 * scale)
        np.testing.assert_allclose(found.ground_force, other.ground_force, atol=1e-10 * scale)
        np.testing.assert_allclose(found.ground_moment, other.ground_moment, atol=1e-10 * scale)

    def test_reflection_reflects_the_forces(self):
        one, other = (rubbed(four_bar(side=side, count=9).mechanism) for side in (1.0, 1.0))
        mirrored = Mechanism(
            tuple(
                replace(
                    link,
                    points={name: np.conj(place) for name, place in link.points.items()},
                    lumps=tuple(replace(lump, offset=np.conj(lump.offset)) for lump in link.lumps),
                )
                for link in other.links
            ),
            other.drives,
            {name: np.conj(complex(place)) for name, place in other.drawing.items()},
            gravity=np.conj(other.gravity),
            friction=other.friction,
        )
        drive = np.linspace(0.3, 6.0, 9)
        plain = replace(one, loads=())
        found, back = (reactions(motion(made, sign * drive, sign * 9.0, sign * 4.0))
                       for made, sign in ((plain, 1), (mirrored, -1)))  # fmt: skip
        for force, image in zip(found.force, back.force, strict=True):
            np.testing.assert_allclose(np.conj(force), image, rtol=1e-10)
        for moment, image in zip(found.moment, back.moment, strict=True):
            np.testing.assert_allclose(moment, -np.asarray(image), atol=1e-10)

    def test_designs_equal_single_ones(self):
        mu = np.array([[0.0], [0.1], [0.4]])
        made = rubbed(four_bar(count=9).mechanism)
        wide = replace(made, friction={**made.friction, "A": Friction(mu, 0.02)})
        drive = np.linspace(0.3, 6.0, 9)
        together = drive_efforts(*_reacted(motion(wide, drive, 9.0, 4.0)))[0]
        for row, own in zip(together, mu[:, 0], strict=True):
            alone = replace(made, friction={**made.friction, "A": Friction(own, 0.02)})
            np.testing.assert_allclose(row, drive_efforts(*_reacted(motion(alone, drive, 9.0, 4.0)))[0], rtol=1e-13)

    def test_elastic_links_decide_on_redundant_friction(self):
        """A bar on two collinear sliders: the sharing of its load determines their friction."""
        course, sections = _crosshead()
        assert np.isnan(drive_efforts(course, reactions(course))).all()
        bent = deflection(course, sections)
        assert compare(bent, solve(course, sections, 4)).passed
        assert np.isfinite(bent.w).all()
        assert max(np.abs(part).max() for part in bent.forces.friction.values()) > 1.0


def _reacted(course):
    return course, reactions(course)


def _crosshead():
    """Return a triangle of beams on three sliders in parallel guides."""
    links = (
        Link("ground", {"O": 0, "P": 1}),
        Link("head", {"A": 0, "B": 0.2, "C": 0.1 + 0.1j}, (Beam("A", "C", 1.0), Beam("C", "B", 1.0))),
        Link("one", {"A": 0}),
        Link("two", {"B": 0}),
    )
    sliders = (
        Slider("left", "one", "ground", "A", 0.0, 1.0),
        Slider("right", "two", "ground", "B", 0.0, 1.0),
        Slider("top", "head", "ground", "C", 0.1j, 1.0),
    )
    made = Mechanism(
        links, (SliderDrive("top"),), {"O": 0, "P": 1, "A": 0, "B": 0.2, "C": 0.1 + 0.1j}, sliders, -9.81j,
        (PointLoad("head", "A", 30 - 400j, 5.0),), friction={"left": Friction(0.1), "right": Friction(0.2)},
    )  # fmt: skip
    return motion(made, np.linspace(0.1, 0.4, 3), 1.0, 2.0), [Section(1e5, 30.0), Section(2e5, 20.0)]


class TestAtRest:
    def test_a_joint_at_rest_has_no_friction(self):
        made = rubbed(inverted_slider_crank(count=3).mechanism)
        course = motion(made, np.linspace(0.3, 1.0, 3), [[0.0, 1e-3, 0.0]])
        found = reactions(course)
        for effort in found.friction.values():
            assert effort[0] == effort[2] == 0.0 != effort[1]

    def test_round_off_is_not_motion(self):
        """The coupler of a parallelogram does not rotate, and neither does a guided link pinned to it."""
        links = (
            Link("ground", {"O": 0, "D": 0.3, "E": 0.5}),
            Link("crank", {"O": 0, "A": 0.1}),
            Link("coupler", {"A": 0, "B": 0.3, "C": 0.5}),
            Link("rocker", {"D": 0, "B": 0.1}),
            Link("block", {"C": 0}, lumps=(Lump("C", 2.0),)),
            Link("frame", {"F": 0}),
        )
        sliders = (Slider("upright", "block", "frame", "C", 0.0, 1j), Slider("level", "frame", "ground", "F", 0.0, 1.0))
        drawing = {"O": 0, "D": 0.3, "E": 0.5, "A": 0.06 + 0.08j, "B": 0.36 + 0.08j, "C": 0.56 + 0.08j, "F": 0.56}
        friction = {"A": Friction(0.1, 0.01), "C": Friction(0.1, 0.01)}
        made = Mechanism(links, (PinDrive("crank", "O"),), drawing, sliders, -9.81j, friction=friction)
        course = motion(made, np.linspace(0.4, 2.6, 50), 7.0)
        numbers = {joint.name: number for number, joint in enumerate(course.structure.joints)}
        found = reactions(course).friction
        assert np.all(found[numbers["C"]] == 0.0)
        assert np.all(found[numbers["A"]] != 0.0)


class TestResistingLoads:
    def pump(self, one_way):
        load = Resistance(PointLoad("piston", "B", 400.0), one_way)
        return motion(slider_crank({}, (load,)), np.linspace(0, 2 * np.pi, 8, endpoint=False) + 0.1, 3.0)

    @pytest.mark.parametrize("one_way", [True, False])
    def test_resist_in_one_or_both_directions(self, one_way):
        course = self.pump(one_way)
        speed = course.velocity[course.mechanism.index["piston"]].real
        against = speed < 0
        assert 0 < against.sum() < len(against)
        force = np.where(against, 400.0, 0.0 if one_way else -400.0)
        efforts = drive_efforts(course, reactions(course))[0]
        np.testing.assert_allclose(efforts * 3.0, -force * speed, atol=1e-12)
        assert (efforts >= -1e-12).all()

    def test_vanish_across_the_motion(self):
        load = Resistance(PointLoad("piston", "B", 400j))
        course = motion(slider_crank({}, (load,)), np.linspace(0.1, 6, 20), 3.0)
        ((*_, force, _),) = load.forces(course)
        assert np.all(force == 0)


def in_scene(text, *tables):
    return edited(text, ("[[drives]]", "\n".join([*tables, "[[drives]]"])))


WRONG = {
    "[joints.A]\nfriction = 0.1": ("radius", "the key is missing"),
    '[joints.A]\nfriction = 0.1\nradius = "5 mm"\nlength = "1 mm"': ("length", "belongs to a slider"),
    "[joints.A]\nradius = 0.01": ("friction", "the key is missing"),
    '[joints.A]\nviscosity = "5 N s/m"': ("viscosity", "expected a damping"),
    "[joints.Q]\nfriction = 0.1": ("Q", 'there is no joint "Q"'),
    "[joints.A]\nfriction = -0.1\nradius = 1": ("friction", ">= 0"),
}


class TestScenes:
    def test_a_scene_gives_friction_of_joints(self):
        text = in_scene(
            SLIDER_CRANK, '[joints.A]\nfriction = 0.1\nradius = "5 mm"',
            '[joints.guide]\nfriction = 0.2\nlength = 0.08',
            '[joints.O]\nviscosity = "0.2 N m s/rad"',
        )  # fmt: skip
        friction = scene_from_text(text).mechanism.friction
        assert asdict(friction["A"]) == asdict(Friction(0.1, 0.005))
        assert asdict(friction["guide"]) == asdict(Friction(0.2, length=0.08))
        assert asdict(friction["O"]) == asdict(Friction(viscosity=0.2))
        assert not scene_from_text(text).joints

    @pytest.mark.parametrize("table", WRONG)
    def test_that_are_wrong(self, table):
        key, problem = WRONG[table]
        with pytest.raises(SceneError, match=problem) as caught:
            scene_from_text(in_scene(FOUR_BAR, table))
        assert caught.value.key == key

    def test_efforts_with_friction_are_an_error(self):
        text = edited(in_scene(FOUR_BAR, '[joints.A]\nfriction = 0.1\nradius = "5 mm"'),
                      ('speed = "100 rad/s"', 'effort = "1 N m"'), ("[run]", '[run]\nduration = "1 s"'))  # fmt: skip
        with pytest.raises(SceneError, match="a drive by effort excludes joint friction"):
            scene_from_text(text)

    def test_of_a_load_that_resists(self):
        load = '[[loads]]\nlink = "rocker"\npoint = "B"\nforce = [30, 0]\nresists = "one way"'
        scene = scene_from_text(in_scene(FOUR_BAR, load))
        course = scene_motion(scene)
        ((*_, force, _),) = scene.mechanism.loads[0].forces(course)
        speed = (course.direction[3] * 1j * course.angular_velocity[3]).real
        np.testing.assert_array_equal(force.real, np.where(speed < 0, 30.0, 0.0))

    def test_a_resisting_line_load_is_an_error(self):
        load = '[[loads]]\nlink = "rocker"\nbeam = ["D", "B"]\nstart = [30, 0]\nresists = "one way"'
        with pytest.raises(SceneError, match="belongs to a load at a point"):
            scene_from_text(in_scene(FOUR_BAR, load))


class TestErrors:
    def test_an_integrated_motion(self):
        with pytest.raises(MechanismError, match="friction of joints under efforts"):
            forward(rubbed(four_bar().mechanism), [Effort(1.0)], 0.0, 0.0, 1.0)

    @pytest.mark.parametrize("wrong", [
        ({"nobody": Friction(0.1, 0.1)}, "expected one joint of this name, got 0"),
        ({"A": Friction(0.1)}, "a pin needs its radius"),
        ({"A": Friction(-0.1, 0.1)}, "expected at least 0"),
        ({"A": Friction(0.1, 0.1, length=0.1)}, "a length belongs to a slider"),
    ])  # fmt: skip
    def test_invalid_friction_is_an_error(self, wrong):
        with pytest.raises(MechanismError, match=wrong[1]):
            replace(four_bar().mechanism, friction=wrong[0])


LOCKING = """
[points]
O = [0, 0]
A = [0.05, 0]
B = [0.12, 0]
[links.ground]
points = ["O"]
[links.crank]
points = ["O", "A"]
rigid = true
mass = 1
center = "O"
[links.rod]
points = ["A", "B"]
rigid = true
mass = 0
center = "A"
[links.piston]
points = ["B"]
mass = 1
[sliders.guide]
link = "piston"
through = "B"
direction = [1, 0]
[joints.guide]
friction = 1.0
[[loads]]
link = "piston"
point = "B"
force = [-100, 0]
[[drives]]
link = "crank"
speed = 6
[run]
positions = 72
"""


@pytest.mark.parametrize("limit", ['drive_effort = "20 kN m"', 'transmission_angle = { least = "1 deg" }'])
def test_forces_of_a_machine_that_may_lock_have_an_unknown_error(limit):
    """The effort grows without bound towards tan(angle of the rod) = 1 / friction; here 9.6 kN m at a position."""
    reported = summary(computed(scene_from_text(f"{LOCKING}[limits.figures]\n{limit}"), Request()))
    assert reported["acceptance"]["verdict"] == "cannot be judged"
    errors = {name: reported["figures"][name]["error"] for name in ("drive_effort", "transmission_angle")}
    assert errors["drive_effort"] is None
    assert errors["transmission_angle"] < 1e-3


def test_a_design_that_friction_may_lock_has_no_figures():
    found = evaluate(parse_toml(LOCKING), ["joints.guide.friction"], [[0.5], [1.0]], ["drive_effort", "mass"])
    assert list(found.reason) == ["", "friction may lock 6 positions"]
    assert np.isnan(found.columns["drive_effort"]).tolist() == [False, True]
