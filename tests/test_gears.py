"""Gears and racks: ratios, work and consequences."""

import numpy as np
import pytest
from msgspec.structs import replace

from elastic import Section, deflection
from kinelast import read_scene, scene_motion, shipped_scenes
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
    posture,
    reactions,
)
from rigid.topology import assembled, gear_contacts, mobility, mobility_count, planar_chain

STEEL = Section(EA=12.6e6, EI=37.8)


def bar(name, start, end, length):
    return Link(name, {start: 0.0, end: length}, (Beam(start, end, 0.471),))


def geared_four_bar():
    """A pinion drives a wheel, which is the crank of a four-bar and moves a rack."""
    links = (
        Link("ground", {"O": 0.0, "W": 0.2, "D": 0.55}),
        Link("pinion", {"O": 0.0}, (), (Lump("O", 0.5, 1e-4),)),
        bar("wheel", "W", "A", 0.1),
        bar("coupler", "A", "B", 0.3),
        bar("rocker", "D", "B", 0.25),
        Link("rack", {"R": 0.0}, (), (Lump("R", 0.4),)),
    )
    return Mechanism(
        links,
        (PinDrive("pinion", "O"),),
        {"O": 0, "W": 0.2, "A": 0.3, "B": 0.46 + 0.23j, "D": 0.55, "R": 0.05},
        (Slider("guide", "rack", "ground", "R", 0.05, 1.0),),
        gears=(
            Gear(PinDrive("pinion", "O"), PinDrive("wheel", "W"), -1 / 3),
            Gear(PinDrive("wheel", "W"), SliderDrive("guide"), 0.04),
        ),
        gravity=-9.81j,
    )


def four_bar():
    """The same four-bar with a driven crank."""
    whole = geared_four_bar()
    return replace(
        whole,
        links=tuple(link for link in whole.links if link.name not in ("pinion", "rack")),
        drives=(PinDrive("wheel", "W"),),
        sliders=(),
        gears=(),
    )


ANGLES = np.linspace(0.0, 2 * np.pi, 90, endpoint=False)


def test_wheels_and_a_rack_move_by_their_ratios():
    going = motion(geared_four_bar(), -3 * ANGLES, -300.0)
    index = going.mechanism.index
    np.testing.assert_allclose(going.angular_velocity[index["wheel"]], 100.0, rtol=1e-14)
    np.testing.assert_allclose(going.direction[index["wheel"]], np.exp(1j * ANGLES), rtol=0, atol=1e-13)
    np.testing.assert_allclose(going.origin[index["rack"]], 0.05 + 0.04 * ANGLES, rtol=0, atol=1e-14)
    np.testing.assert_allclose(going.velocity[index["rack"]], 4.0, rtol=1e-14)


def test_a_geared_crank_acts_like_a_driven_one():
    geared, driven = motion(geared_four_bar(), -3 * ANGLES, -300.0), motion(four_bar(), ANGLES, 100.0)
    one, other = (deflection(going, [STEEL] * 3) for going in (geared, driven))
    for field in ("N", "V", "M", "u", "w", "phi"):
        found, expected = getattr(one, field), getattr(other, field)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max(axis=(1, 2)).max())


def test_the_drive_supplies_the_power_of_all_it_moves():
    course = geared_four_bar()
    effort = drive_efforts(going := motion(course, -3 * ANGLES, -300.0), reactions(going))[0]
    direct = drive_efforts(alone := motion(four_bar(), ANGLES, 100.0), reactions(alone))[0]
    np.testing.assert_allclose(effort * -300.0, direct * 100.0, rtol=0, atol=1e-11 * np.abs(direct).max() * 100)


def test_a_force_on_the_rack_acts_through_both_gears():
    course = replace(geared_four_bar(), loads=(PointLoad("rack", "R", force=-7.0),), gravity=0.0)
    free = replace(course, loads=())
    loaded, bare = (
        drive_efforts(going := motion(each, -3 * ANGLES, -300.0), reactions(going))[0] for each in (course, free)
    )
    np.testing.assert_allclose(loaded - bare, 7.0 * 0.04 * (-1 / 3), rtol=1e-10)


def test_planetary_train_by_willis():
    sun, planet = 24, 18
    ring = sun + 2 * planet
    links = (
        Link("ground", {"O": 0.0}),
        Link("arm", {"O": 0.0, "P": 0.1}),
        Link("planet", {"P": 0.0}),
        Link("ring", {"O": 0.0}),
    )
    course = Mechanism(
        links,
        (PinDrive("arm", "O"),),
        {"O": 0, "P": 0.1},
        gears=(
            Gear(PinDrive("ground", "O", "arm"), PinDrive("planet", "P", "arm"), -sun / planet),
            Gear(PinDrive("planet", "P", "arm"), PinDrive("ring", "O", "arm"), planet / ring),
        ),
        loads=(PointLoad("ring", "O", moment=-5.0),),
    )
    going = motion(course, ANGLES, 10.0)
    np.testing.assert_allclose(going.angular_velocity[2], 10.0 * (1 + sun / planet), rtol=1e-13)
    np.testing.assert_allclose(going.angular_velocity[3], 10.0 * (1 + sun / ring), rtol=1e-13)
    effort = drive_efforts(going, reactions(going))[0]
    np.testing.assert_allclose(effort, 5.0 * (1 + sun / ring), rtol=1e-12)


def epicyclic(drive, gears):
    """Return a sun, a planet and their carrier in a ring on the ground."""
    links = (
        Link("ground", {"O": 0.0}),
        bar("carrier", "O", "P", 0.15),
        Link("sun", {"O": 0.0}, (), (Lump("O", 1.0, 1e-3),)),
        Link("planet", {"P": 0.0}, (), (Lump("P", 0.5, 6e-4),)),
    )
    return Mechanism(links, (drive,), {"O": 0, "P": 0.15}, gravity=-9.81j, gears=gears)


ON_CARRIER = PinDrive("sun", "O", "carrier"), PinDrive("planet", "P", "carrier")


def driven_by_its_sun(ring=4.0):
    """Return two gears, each of which drives the other; `ring` is the radius of the ring over the planet's."""
    gears = Gear(*ON_CARRIER, -2.0), Gear(ON_CARRIER[1], PinDrive("carrier", "O"), -1 / ring)
    return epicyclic(PinDrive("sun", "O"), gears)


def test_a_train_driven_by_its_sun_or_its_carrier_moves_alike():
    """Willis: the carrier has a third of the sun's speed. Both drives have the same power."""
    by_carrier = epicyclic(
        PinDrive("carrier", "O"),
        (Gear(PinDrive("carrier", "O"), ON_CARRIER[1], -4.0), Gear(ON_CARRIER[1], ON_CARRIER[0], -0.5)),
    )
    angle = np.linspace(0.0, 40.0, 90)
    one, other = motion(driven_by_its_sun(), angle, 30.0, 7.0), motion(by_carrier, angle / 3, 10.0, 7 / 3)
    carrier, sun, planet = 1, 2, 3
    for name in ("origin", "velocity", "acceleration", "direction", "angular_velocity", "angular_acceleration"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(np.unwrap(np.angle(one.direction[carrier])), angle / 3, atol=1e-12)
    np.testing.assert_allclose(one.angular_velocity[[carrier, sun, planet], 0], [10.0, 30.0, -30.0], rtol=1e-12)
    power = [(drive_efforts(course, reactions(course)) * course.drive_rate).sum(0) for course in (one, other)]
    np.testing.assert_allclose(power[0], power[1], rtol=1e-11, atol=1e-9)
    held = mobility(planar_chain(assembled(one.mechanism), gear_contacts(one.mechanism)))
    assert (held.mobility, held.hyperstaticity) == (1, 0)


def test_gears_that_lock_each_other_are_an_error():
    """With this ring the carrier is free, and the sun is locked in its drawn position."""
    with pytest.raises(MechanismError, match='the gears of "carrier", "planet" lock one another or do'):
        motion(driven_by_its_sun(-2.0), [0.0], 1.0)


def test_gears_that_drive_each_other_within_a_loop_are_an_error():
    """The crank of a four-bar follows a wheel on its coupler: determinate, but not solvable joint by joint."""
    course = four_bar()
    links = (*course.links, Link("planet", {"A": 0.0}))
    gears = (Gear(PinDrive("planet", "A", "coupler"), PinDrive("wheel", "W"), -0.5),)
    geared = replace(course, links=links, drives=(PinDrive("planet", "A", "wheel"),), gears=gears)
    with pytest.raises(MechanismError, match="are driven by the links that they move: drive one of these"):
        motion(geared, [0.0], 1.0)


def test_a_rack_on_a_moving_link_is_an_error():
    course = geared_four_bar()
    moving = replace(course.sliders[0], on="pinion")
    with pytest.raises(MechanismError, match='"guide" runs on a moving link'):
        motion(replace(course, sliders=(moving,)), ANGLES, 1.0)


def test_a_joint_moved_twice_is_an_error():
    course = replace(four_bar(), gears=(Gear(PinDrive("rocker", "D"), PinDrive("wheel", "W"), 2.0),))
    with pytest.raises(MechanismError, match='"W" is moved twice'):
        motion(course, ANGLES, 1.0)


def test_a_wheel_on_a_turning_rocker_does_not_lose_turns():
    links = (
        Link("ground", {"O": 0.0, "D": 1.0, "P": 6.0}),
        Link("crank", {"O": 0.0, "A": 2.0}),
        Link("coupler", {"A": 0.0, "B": 1.8}),
        Link("rocker", {"D": 0.0, "B": 1.7}),
        Link("follower", {"P": 0.0, "U": 1.5}),
    )
    drawing = {"O": 0, "D": 1, "P": 6, "A": 2j, "B": 1.54 + 1.61j, "U": 6 + 1.5j}
    gear = Gear(PinDrive("rocker", "D"), PinDrive("follower", "P"), 0.1)
    course = Mechanism(links, (PinDrive("crank", "O"),), drawing, gears=(gear,))
    angles = np.pi / 2 + np.linspace(0.0, 2 * np.pi, 121)
    whole, late = motion(course, angles), motion(course, angles[100:])
    np.testing.assert_allclose(late.direction, whole.direction[:, 100:], rtol=0, atol=1e-12)
    near = motion(course, angles[[40, 100]], near=posture(motion(course, angles[[39, 99]])))
    np.testing.assert_allclose(near.direction[4, 1], motion(course, angles[99:101]).direction[4, 1], atol=1e-12)
    turned = np.unwrap(np.angle(whole.direction[3]))
    np.testing.assert_allclose(np.diff(np.unwrap(np.angle(whole.direction[4]))), 0.1 * np.diff(turned), atol=1e-12)


def test_each_gear_is_one_condition():
    course = geared_four_bar()
    contacts = gear_contacts(course)
    found = mobility(planar_chain(assembled(course), contacts))
    assert (int(found.mobility), int(found.hyperstaticity)) == (1, 0)
    assert mobility_count(course, contacts) == 1
    assert contacts[0].at == pytest.approx(0.05)  # wheels of 50 and 150 mm, 200 mm apart
    assert contacts[1].at == pytest.approx(0.2 - 0.04j)  # the rack passes below the wheel, which moves it forwards


@pytest.mark.parametrize(("link", "on", "ratio"), [("arm", "ground", 0.75), ("ground", "arm", -0.75)])
def test_a_gear_can_name_its_driver_in_either_order(link, on, ratio):
    """A wheel on the ground follows 0.75 of the arm in position and velocity, for both orders of the arm's pin."""
    links = (
        Link("ground", {"O": 0.0, "W": 0.2}),
        Link("arm", {"O": 0.0, "P": 0.1}),
        Link("wheel", {"W": 0.0, "Q": 0.1}),
    )
    gear = Gear(PinDrive(link, "O", on), PinDrive("wheel", "W"), ratio)
    drawing = {"O": 0, "P": 0.1, "W": 0.2, "Q": 0.3}
    going = motion(Mechanism(links, (PinDrive("arm", "O"),), drawing, gears=(gear,)), ANGLES, 10.0)
    np.testing.assert_allclose(going.angular_velocity[2], 7.5, rtol=1e-14)
    np.testing.assert_allclose(going.direction[2], np.exp(0.75j * ANGLES), rtol=0, atol=1e-13)


def test_the_condition_of_gears_without_teeth_is_known():
    scene = read_scene(shipped_scenes()["flapping_wing"])
    solved = deflection(scene_motion(scene, 8), scene.sections, joints=scene.joints)
    assert (solved.condition >= 1.0).all()
    assert (solved.condition < 1e6).all()
