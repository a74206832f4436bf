"""Tooth forces appear in pins, guides, carriers and ground, for loads and deflections.

References are free bodies by hand (tests/geared.py), Newton-Euler laws of the whole, Shigley's spur gears, closed
forms of a cantilever, finite elements, and virtual power.
"""

from itertools import pairwise

import fem_vibrating
import numpy as np
import pytest
from geared import GRAVITY, TRAINS, free_bodies
from mechanisms import motion_of
from msgspec.structs import replace
from second_routes import multiplier_forces, virtual_work_efforts
from tiers import in_tiers

from elastic import JointCompliance, Section, deflection, vibration
from fem_check import compare, solve
from rigid import (
    Beam,
    Gear,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    drive_efforts,
    motion,
    reactions,
)
from rigid.closures.gears import gear_loads
from rigid.plane import cross, dot

ROUND_OFF = 1e-11
CASES = in_tiers([(name, seed) for seed in range(8) for name in TRAINS], 2 * len(TRAINS), 2 * len(TRAINS))


def near(found, expected, size):
    """Assert agreement to round-off of a given size."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF * size)


@pytest.mark.parametrize(("name", "seed"), CASES)
class TestFreeBodies:
    def test_pins_guides_and_drives_agree_with_free_bodies(self, name, seed):
        train = TRAINS[name](seed)
        course, free = motion_of(train), free_bodies(train)
        forces = reactions(course)
        size = np.abs(free.pins).max()
        links = course.mechanism.links
        pins = {}
        for joint, force in zip(course.structure.joints, forces.force, strict=True):
            if joint.turns:
                pins[links[joint.child].name, links[joint.parent].name] = force
        for number, (child, parent, _) in enumerate(train.pins):
            near(pins[child, parent or "ground"], free.pins[:, number], size)
        near(drive_efforts(course, forces), free.efforts.T, np.abs(free.efforts).max())
        near(forces.ground_force, free.ground, size)
        near(forces.ground_moment, free.ground_moment, size)

    def test_the_shaking_force_is_that_of_the_whole(self, name, seed):
        """It follows from weights, loads and inertia of all bodies, for any joints."""
        train = TRAINS[name](seed)
        forces = reactions(motion_of(train))
        force = sum(body.load for body in train.bodies)
        moment = sum(cross(body.center, body.load) + body.couple for body in train.bodies)
        size = np.abs(free_bodies(train).pins).max()
        near(forces.ground_force, force, size)
        near(forces.ground_moment, moment, size)

    def test_multipliers_agree_with_free_bodies(self, name, seed):
        course = motion_of(TRAINS[name](seed))
        one, other = multiplier_forces(course), reactions(course)
        for found, expected in ((one.force, other.force), (one.moment, other.moment)):
            size = np.abs(np.array(other.force, complex)).max()
            for part, value in zip(found, expected, strict=True):
                near(part, value, size)
        near(one.ground_force, other.ground_force, np.abs(other.force).max())
        near(one.ground_moment, other.ground_moment, np.abs(other.force).max())

    def test_efforts_are_those_without_teeth(self, name, seed):
        """Tooth forces do no work: belts of the same ratios have the same efforts, and so does virtual work."""
        train = TRAINS[name](seed)
        belts = tuple(replace(gear, pressure_angle=None) for gear in train.mechanism.gears)
        course, other = motion_of(train), motion_of(replace(train, mechanism=replace(train.mechanism, gears=belts)))
        efforts = drive_efforts(course, reactions(course))
        near(efforts, drive_efforts(other, reactions(other)), np.abs(efforts).max())
        near(efforts, virtual_work_efforts(course), np.abs(efforts).max())
        # The ground forces are the same, although they have other paths.
        size = np.abs(free_bodies(train).pins).max()
        near(reactions(other).ground_force, reactions(course).ground_force, size)
        near(reactions(other).ground_moment, reactions(course).ground_moment, size)

    def test_inner_forces_have_the_power_of_the_drives(self, name, seed):
        train = TRAINS[name](seed)
        course = motion_of(train)
        forces = reactions(course)
        power = 0.0

        def give(link, arm, force, moment):
            velocity = course.velocity[link] + 1j * course.angular_velocity[link] * arm
            return dot(velocity, force) + course.angular_velocity[link] * moment

        for number, (place, force, moment) in enumerate(zip(course.places, forces.force, forces.moment, strict=True)):
            joint = place.joint
            power = power + give(joint.child, place.arm_child, force, moment)
            power = power + give(joint.parent, place.arm_parent, -force, -moment)
            if joint.gear is not None:
                for act in gear_loads(place, force, moment, forces.flank[number]):
                    power = power + give(act.link, act.arm, act.force, act.moment)
        paid = (drive_efforts(course, forces) * train.rate).sum(0)
        near(power, paid, np.abs(paid).max())


def wheel(name, point, mass=0.0):
    """Return a wheel, with its mass, if any, at the centre."""
    return Link(name, {point: 0.0}, (), (Lump(point, mass, 1e-4),) if mass else ())


class TestTextbook:
    def test_shafts_of_a_pair(self):
        """Ft = T/r and Fr = Ft tan(alpha), separating, for both senses of rotation and both drivers."""
        r1, r2, torque = 0.04, 0.1, 12.0
        ground = Link("ground", {"O": 0.0, "W": r1 + r2})
        gears = (Gear(PinDrive("one", "O"), PinDrive("two", "W"), -r1 / r2, np.radians(25)),)
        for sign in (1, -1):
            load = PointLoad("two", "W", moment=-sign * torque)
            links = (ground, wheel("one", "O"), wheel("two", "W"))
            course = motion(Mechanism(links, (PinDrive("one", "O"),), {}, loads=(load,), gears=gears), [0.4], 3.0)
            one, two = (force[0] for force in reactions(course).force)
            tangential, radial = torque / r2, torque / r2 * np.tan(np.radians(25))
            # The tooth at r1 pushes the second wheel down for a positive moment; its pin pushes back.
            assert two == pytest.approx(1j * sign * tangential - radial)
            assert one == pytest.approx(-1j * sign * tangential + radial)

    def test_an_idler(self):
        """Shigley's Mechanical Engineering Design, example 13-7: 2.5 kW, 1750 rpm, module 2.5 mm, 20, 50, 30 teeth."""
        radii = [2.5e-3 * teeth / 2 for teeth in (20, 50, 30)]
        torque = 2500 / (1750 * 2 * np.pi / 60)
        places = {"two": -1j * (radii[0] + radii[1]), "three": 0.0, "four": radii[1] + radii[2]}
        gears = (
            Gear(PinDrive("2", "two"), PinDrive("3", "three"), -radii[0] / radii[1]),
            Gear(PinDrive("3", "three"), PinDrive("4", "four"), -radii[1] / radii[2]),
        )
        links = (Link("ground", places), *(wheel(str(k), point) for k, point in enumerate(places, 2)))
        load = PointLoad("4", "four", moment=torque * radii[2] / radii[0])
        course = motion(Mechanism(links, (PinDrive("2", "two"),), {}, loads=(load,), gears=gears), [0.0], -183.0)
        forces = reactions(course)
        found = {
            course.mechanism.links[j.child].name: f[0]
            for j, f in zip(course.structure.joints, forces.force, strict=True)
        }
        assert abs(found["2"]) == pytest.approx(581, abs=0.5)
        assert abs(found["2"].real) == pytest.approx(546, abs=0.5)
        assert abs(found["2"].imag) == pytest.approx(199, abs=0.5)
        assert abs(found["3"].real) == pytest.approx(347, abs=0.5)
        assert abs(found["3"].imag) == pytest.approx(347, abs=0.5)


def bar(name, *points):
    """Return a link with beams along its points."""
    beams = tuple(Beam(one, other, 0.4) for (one, _), (other, _) in pairwise(points))
    return Link(name, dict(points), beams)


def epicyclic(free=-0.6, back=False):
    """Return an elastic arm with an elastic planet and a wheel; the planet rolls around a sun on the ground.

    `back` names the geared joints in the other order.
    """
    links = (
        Link("ground", {"O": 0.0}),
        bar("arm", ("Q", 0.3 + 0.05j), ("P", 0.2), ("O", 0.0)),
        bar("planet", ("P", 0.0), ("E", 0.07)),
        bar("wheel", ("S", 0.05), ("Q", 0.0)),
    )
    gears = (
        Gear(PinDrive("ground", "O", "arm"), PinDrive("planet", "P", "arm"), -1.5),
        Gear(PinDrive("planet", "P", "arm"), PinDrive("wheel", "Q", "arm"), free),
    )
    if back:
        gears = (
            Gear(PinDrive("arm", "O"), PinDrive("arm", "P", "planet"), -1.5),
            Gear(PinDrive("arm", "P", "planet"), PinDrive("arm", "Q", "wheel"), free),
        )
    loads = (PointLoad("wheel", "S", force=40.0 - 25.0j, turning=True),)
    drawing = {"O": 0, "P": 0.2, "Q": 0.3 + 0.05j, "E": 0.27, "S": 0.35 + 0.05j}
    return Mechanism(links, (PinDrive("arm", "O"),), drawing, (), GRAVITY, loads, gears)


def elastic_rack(drives):
    """Return an elastic wheel on the ground and a rack of two beams; `drives` makes the rack the driver."""
    links = (
        Link("ground", {"O": 0.0}),
        bar("wheel", ("E", 0.06), ("O", 0.0)),
        bar("rack", ("F", 0.1 + 0.05j), ("R", 0.0), ("G", -0.08 + 0.02j)),
    )
    guide = Slider("guide", "rack", "ground", "R", -0.05j, np.exp(0.1j))
    pin, slide = PinDrive("wheel", "O"), SliderDrive("guide")
    gear = Gear(slide, pin, 20.0) if drives else Gear(pin, slide, -0.05)
    loads = (PointLoad("rack", "F", force=30.0 + 12.0j), PointLoad("wheel", "E", force=20.0j))
    drawing = {"O": 0, "E": 0.06, "R": -0.05j, "F": 0.1, "G": -0.08 - 0.03j}
    return Mechanism(links, (slide if drives else pin,), drawing, (guide,), GRAVITY, loads, (gear,))


def sun_and_arm():
    """Return a sun that drives an elastic planet in a ring on the ground, and so the elastic arm of the planet."""
    links = (
        Link("ground", {"O": 0.0}),
        wheel("sun", "O", 0.5),
        bar("arm", ("Q", 0.3 + 0.05j), ("P", 0.2), ("O", 0.0)),
        bar("planet", ("P", 0.0), ("E", 0.07)),
    )
    gears = (
        Gear(PinDrive("sun", "O", "arm"), PinDrive("planet", "P", "arm"), -1.5),
        Gear(PinDrive("planet", "P", "arm"), PinDrive("arm", "O"), -0.2),
    )
    loads = (PointLoad("planet", "E", force=40.0 - 25.0j, turning=True), PointLoad("arm", "Q", force=30.0j))
    drawing = {"O": 0, "P": 0.2, "Q": 0.3 + 0.05j, "E": 0.27}
    return Mechanism(links, (PinDrive("sun", "O"),), drawing, (), GRAVITY, loads, gears)


def cart_on_wheels(motor=False):
    """Return an elastic cart with an elastic rolling wheel, optionally driven by a motor on the cart."""
    links = (
        Link("ground", {}),
        bar("cart", ("F", 0.15 + 0.05j), ("R", 0.0), ("H", -0.1)),
        bar("wheel", ("E", 0.06), ("H", 0.0)),
    )
    guide = Slider("guide", "cart", "ground", "R", 0.0, 1.0)
    sliding, turning = SliderDrive("guide"), PinDrive("wheel", "H", "cart")
    gear = Gear(turning, sliding, -0.04) if motor else Gear(sliding, turning, -25.0)
    loads = (PointLoad("cart", "F", force=30.0 - 60.0j), PointLoad("wheel", "E", force=20.0 + 5.0j))
    drawing = {"R": 0, "F": 0.15 + 0.05j, "H": -0.1, "E": -0.04}
    return Mechanism(links, (turning if motor else sliding,), drawing, (guide,), GRAVITY, loads, (gear,))


def geared_parallelogram(sun=False):
    """Return three cranks of one coupler on an elastic arm; a wheel drives the first, so one condition is redundant.

    The wheel has its own drive, or is a sun fixed to the ground.
    """
    points = {"A": 0.0, "B": 0.15, "C": 0.3}
    base = {"D": 0.1 + 0.12j, "E": 0.25 + 0.12j, "F": 0.4 + 0.12j}
    arm = Link("arm", {"O": 0.0, **base}, tuple(Beam(a, b, 0.4) for a, b in ("OD", "DE", "EF")))
    cranks = [bar(f"crank {p}", (d, 0.0), (p, 0.1)) for d, p in zip(base, points, strict=True)]
    links = (
        Link("ground", {"O": 0.0}),
        arm,
        *(() if sun else (wheel("pinion", "O", 0.5),)),
        *cranks,
        bar("coupler", *points.items()),
    )
    drives = PinDrive("arm", "O"), PinDrive("pinion", "O", "arm")
    gears = (Gear(PinDrive("ground" if sun else "pinion", "O", "arm"), PinDrive("crank A", "D", "arm"), -0.5),)
    way = 0.1 * np.exp(0.5j)
    drawing = {"O": 0, **base, **{p: d + way for p, d in zip(points, base.values(), strict=True)}}
    load = PointLoad("coupler", "C", force=15 - 30j)
    return Mechanism(links, drives[:1] if sun else drives, drawing, (), GRAVITY, (load,), gears)


ELASTIC = {
    "outside": (epicyclic(), 1.0),
    "outside, named the other way": (epicyclic(back=True), 1.0),
    "planet in a ring": (epicyclic(0.4), 1.0),
    "ring on a planet": (epicyclic(1.8), 1.0),
    "driven rack": (elastic_rack(False), 1.0),
    "driving rack": (elastic_rack(True), 0.04),
    "driven sun": (sun_and_arm(), 1.0),
    "cart": (cart_on_wheels(), 0.04),
    "motor cart": (cart_on_wheels(motor=True), 1.0),
    "redundant behind teeth": (geared_parallelogram(), 0.3),
    "redundant around a sun": (geared_parallelogram(sun=True), 0.3),
}


def held_twice(load):
    """Return a crank held by a strut, and geared to a sun on the ground through the resting arm that carries it."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.55}),
        Link("arm", {"O": 0.0, "W": 0.2}),
        bar("crank", ("W", 0.0), ("A", 0.1 + 0.1j)),
        bar("strut", ("A", 0.0), ("D", 0.25 - 0.1j)),
    )
    drawing = {"O": 0, "W": 0.2, "A": 0.3 + 0.1j, "D": 0.55}
    gears = (Gear(PinDrive("ground", "O", "arm"), PinDrive("crank", "W", "arm"), -0.5),)
    loads = (PointLoad("crank", "A", force=load),)
    return motion(Mechanism(links, (PinDrive("arm", "O"),), drawing, (), 0.0, loads, gears), [0.0])


def elastic_course(name):
    """Return the motion of a case at some positions, and its sections."""
    mechanism, size = ELASTIC[name]
    steps = size * np.linspace(0.1, 5.0, 9)
    drive = np.array([steps, -0.4 * steps])[: len(mechanism.drives)]
    rate = np.array([[11.0], [-7.0]])[: len(mechanism.drives)] * size
    course = motion(mechanism, drive, rate, 3 * rate)
    return course, [Section(2e6, 40.0 + 13 * k) for k in range(len(mechanism.beams))]


class TestDeflection:
    @pytest.mark.parametrize("name", ELASTIC)
    def test_finite_elements_agree(self, name):
        course, sections = elastic_course(name)
        for soft in ({}, {self.soft_joint(course): JointCompliance(1e-6, 2e-4, 1e-5 - 2e-5j, 1e-4)}):
            solved = deflection(course, sections, joints=soft)
            found = solve(course, sections, 4, soft)
            comparison = compare(solved, found)
            assert comparison.compared == 9
            assert comparison.relative.max() < 1e-10
            efforts = drive_efforts(course, solved.forces)
            near(found.efforts, efforts, 1e2 * np.abs(efforts).max())

    def test_the_order_of_joint_names_does_not_matter(self):
        one, other = (deflection(*elastic_course(name)) for name in ("outside", "outside, named the other way"))
        near(other.w, one.w, np.abs(one.w).max())
        near(other.forces.ground_moment, one.forces.ground_moment, np.abs(one.forces.ground_moment).max())

    @pytest.mark.parametrize("load", 300 * np.exp(2j * np.pi * np.arange(8) / 8))
    def test_a_strut_and_teeth_share_a_load(self, load):
        """A wheel on the ground is held by teeth and an elastic strut: stiffness decides on the loaded flank.

        The ground carries only the load and its moment.
        """
        course = held_twice(load)
        sections = [Section(2e5, 20.0), Section(1e5, 30.0)]
        solved, found = deflection(course, sections), solve(course, sections, 4)
        assert compare(solved, found).relative.max() < 1e-10
        ((number, flank),) = solved.forces.flank.items()
        assert flank * solved.forces.moment[number] > 0
        near(solved.forces.ground_force, load, 300)
        near(solved.forces.ground_moment, cross(0.3 + 0.1j, load), 300)

    @staticmethod
    def soft_joint(course):
        """Return the joint of the first gear's follower that shares its point with no other joint."""
        joints = course.structure.joints
        names = [joint.name for joint in joints]
        return next(joint.name for joint in joints if joint.gear and names.count(joint.name) == 1)

    @pytest.mark.parametrize("name", sorted(set(ELASTIC) - {"driven rack", "driving rack"}))
    def test_tooth_forces_bend_a_link_that_carries_the_wheels(self, name):
        """This guards the other tests. Without teeth the deflection differs; on the ground pins carry the forces."""
        course, sections = elastic_course(name)
        belts = tuple(replace(gear, pressure_angle=None) for gear in course.mechanism.gears)
        other = motion(
            replace(course.mechanism, gears=belts), course.drive, course.drive_rate, course.drive_acceleration
        )
        one, bare = deflection(course, sections), deflection(other, sections)
        assert np.abs(one.w - bare.w).max() > 1e-3 * np.abs(one.w).max()

    @pytest.mark.parametrize("name", in_tiers(ELASTIC, 3, 4))
    def test_frequencies_of_finite_elements_agree(self, name):
        course, sections = elastic_course(name)
        found = vibration.natural_frequencies(course, sections, 2, 3, tolerance=1e-8)
        other = fem_vibrating.natural_frequencies(course, sections, 12, 2, found.position)
        np.testing.assert_allclose(other, found.omega, rtol=1e-5)

    def test_a_wheel_on_a_cantilever_rotates_as_its_centre_sinks(self):
        """The arm is a cantilever of length l under the tooth force: w = F l^3/3EI, u = F l/EA; the teeth follow."""
        length, ratio, torque, EA, EI, slope = 0.4, -0.6, 9.0, 1e6, 50.0, np.tan(np.radians(20))
        links = (
            Link("ground", {"O": 0.0}),
            Link("arm", {"O": 0.0, "P": length}, (Beam("O", "P"),)),
            wheel("sun", "O"),
            wheel("planet", "P"),
        )
        drives = PinDrive("arm", "O"), PinDrive("sun", "O")
        gears = (Gear(PinDrive("sun", "O", "arm"), PinDrive("planet", "P", "arm"), ratio),)
        for sign in (1, -1):
            load = PointLoad("planet", "P", moment=-sign * torque)
            mechanism = Mechanism(links, drives, {"O": 0, "P": length}, loads=(load,), gears=gears)
            course = motion(mechanism, np.zeros((2, 1)))
            solved = deflection(course, [Section(EA, EI)])
            radius = length / (1 - ratio)
            down, out = -sign * torque / radius, torque / radius * slope
            assert solved.N[:, 0, 0].sum() == pytest.approx(out)
            assert solved.V[:, 0, 0].sum() == pytest.approx(-down)
            sinks, stretched = down * length**3 / (3 * EI), out * length / EA
            assert solved.w[:, 0, 0].sum() == pytest.approx(sinks)
            # The tooth stays on the line of action: the wheel rotates by -sinks/r and by the effect of the arm's
            # stretch.
            expected = sinks / radius - sign * stretched * slope / radius
            assert solved.angle[3, 0] == pytest.approx(expected)


class TestWithoutTeeth:
    def test_only_the_moment_is_passed_without_a_common_carrier(self):
        """A planet on an arm drives a wheel on the ground, and the ground still carries all forces."""
        links = (
            Link("ground", {"O": 0.0, "W": 0.4}),
            Link("arm", {"O": 0.0, "P": 0.1}, (), (Lump("P", 0.7),)),
            wheel("planet", "P", 0.3),
            Link("wheel", {"W": 0.0}, (), (Lump("W", 0.5, 2e-3, 0.02j),)),
        )
        drives = PinDrive("arm", "O"), PinDrive("planet", "P", "arm")
        gear = Gear(PinDrive("planet", "P", "arm"), PinDrive("wheel", "W"), -0.5)
        load = PointLoad("wheel", "W", moment=4.0)
        course = motion(
            Mechanism(links, drives, {"O": 0, "W": 0.4, "P": 0.1}, (), 0.0, (load,), (gear,)), [[0.3], [0.2]], 0.0
        )
        forces = reactions(course)
        assert not forces.flank
        assert forces.ground_moment == pytest.approx(4.0)
        assert forces.moment[-1] == pytest.approx(-4.0)

    @pytest.mark.parametrize("ratio", [1.0, -1.0])
    def test_wheels_of_ratio_one_have_no_contact(self, ratio):
        links = (Link("ground", {"O": 0.0, "W": 0.4}), wheel("one", "O"), wheel("two", "W"))
        gear = Gear(PinDrive("one", "O"), PinDrive("two", "W"), ratio)
        load = PointLoad("two", "W", moment=4.0)
        forces = reactions(motion(Mechanism(links, (PinDrive("one", "O"),), {}, (), 0.0, (load,), (gear,)), [0.3], 0.0))
        assert np.abs(forces.force).max() == pytest.approx(0.0 if ratio == 1 else 20 / np.cos(np.radians(20)))
        assert forces.ground_moment == pytest.approx(4.0)

    def test_geared_slides_pass_only_the_force(self):
        links = (Link("ground", {}), wheel("one", "R", 1.0), wheel("two", "S", 2.0))
        sliders = (Slider("first", "one", "ground", "R", 0.0, 1.0), Slider("second", "two", "ground", "S", 0.5j, 1j))
        gear = Gear(SliderDrive("first"), SliderDrive("second"), 3.0)
        loads = (PointLoad("two", "S", force=5.0 - 7.0j),)
        mechanism = Mechanism(links, (SliderDrive("first"),), {"R": 0, "S": 0.5j}, sliders, 0.0, loads, (gear,))
        course = motion(mechanism, [0.1])
        forces = reactions(course)
        assert drive_efforts(course, forces)[0] == pytest.approx(21.0)
        assert forces.ground_force == pytest.approx(5.0 - 7.0j)
        assert forces.ground_moment == pytest.approx(cross(0.8j, 5.0 - 7.0j))

    @pytest.mark.parametrize("angle", [-0.1, np.pi / 2, np.nan])
    def test_a_pressure_angle_is_acute(self, angle):
        links = (Link("ground", {"O": 0.0, "W": 0.4}), wheel("one", "O"), wheel("two", "W"))
        gear = Gear(PinDrive("one", "O"), PinDrive("two", "W"), -1.0, angle)
        with pytest.raises(MechanismError, match="pressure angle"):
            Mechanism(links, (PinDrive("one", "O"),), {}, gears=(gear,))


def test_several_designs_equal_single_ones():
    """The carriers have several lengths."""
    reach = np.array([[0.1], [0.2], [0.35]])

    def forces_of(length):
        links = (
            Link("ground", {"O": 0.0}),
            Link("arm", {"O": 0.0, "P": length}),
            wheel("sun", "O", 1.0),
            Link("planet", {"P": 0.0}, (), (Lump("P", 0.5, 1e-3, 0.01),)),
        )
        drives = PinDrive("arm", "O"), PinDrive("sun", "O")
        gears = (Gear(PinDrive("sun", "O", "arm"), PinDrive("planet", "P", "arm"), -0.8),)
        drawing = {"O": 0, "P": 0.1}
        steps = np.array([[0.1, 0.9, 2.0], [0.3, -0.2, 0.8]])
        return reactions(motion(Mechanism(links, drives, drawing, (), GRAVITY, (), gears), steps, 9.0, 4.0))

    together = forces_of(reach)
    for design, length in enumerate(reach[:, 0]):
        alone = forces_of(float(length))
        for found, expected in zip(together.force, alone.force, strict=True):
            near(np.broadcast_to(found, (3, 3))[design], expected, 10.0)
        near(together.ground_moment[design], alone.ground_moment, 10.0)


def test_the_force_in_the_guide_of_a_rack_is_normal_to_it():
    """The teeth push the rack with (F, -F tan 20 deg) against a load of -F."""
    push, angle = 100.0, np.radians(20.0)
    wheel = Link("wheel", {"O": 0, "A": 0.04}, lumps=(Lump("O", 0.0),))
    rack = Link("rack", {"R": 0.0}, lumps=(Lump("R", 0.0),))
    gear = Gear(PinDrive("wheel", "O"), SliderDrive("guide"), 0.05, pressure_angle=angle)
    mechanism = Mechanism(
        (Link("ground", {"O": 0}), wheel, rack), (PinDrive("wheel", "O"),), {"O": 0, "A": 0.04, "R": -0.05j},
        sliders=(Slider("guide", "rack", "ground", "R", -0.05j, 1.0),), gears=(gear,),
        loads=(PointLoad("rack", "R", force=-push),),
    )  # fmt: skip
    forces = reactions(motion(mechanism, [0.1], 0.0))
    at = [place.joint.name for closed in forces.closures for place in closed.joints].index("guide")
    force, _ = forces.in_joints[at]
    assert complex(np.ravel(force)[0]) == pytest.approx(1j * push * np.tan(angle), abs=1e-9)
    assert complex(np.ravel(forces.ground_force)[0]) == pytest.approx(-push, abs=1e-9)
