"""Loads, lives and stresses of joints agree with calculations by hand; clearance acts like a change of length."""

import numpy as np
import pytest
from msgspec.structs import replace

from machine.joints import (
    Eye,
    Guide,
    JointHistory,
    Pin,
    Plain,
    Rolling,
    clearance_effects,
    contact_losses,
    joint_history,
    knocks,
)
from rigid import Link, Mechanism, PinDrive, Slider, motion, position_of, reactions

N = 720


def course(force, rate, angle=0.0, period=0.04):
    """Return a joint over a cycle, with the parent at rest."""
    shape = np.broadcast_shapes(np.shape(force), np.shape(rate), np.shape(angle), (N,))
    wide = [np.broadcast_to(np.asarray(each), shape) for each in (force + 0j, np.exp(1j * np.asarray(angle)))]
    return JointHistory(*wide, np.ones(shape) + 0j, np.broadcast_to(rate, shape), np.full(shape, period / N), True)


TURN = 2 * np.pi * np.arange(N) / N


def test_life_of_a_rotating_bearing_by_iso_281():
    """6206 (C 19.5 kN, C0 11.2 kN) under 2 kN at 1500 rpm: (19.5/2)^3 million revolutions, 10,298 h."""
    turning = course(2000.0, 50 * np.pi, TURN)
    ball = Rolling(19.5e3, 11.2e3)
    assert ball.revolutions(turning) == pytest.approx(9.75**3 * 1e6, rel=1e-12)
    assert ball.life(turning) / 3600 == pytest.approx(10298, abs=1)
    assert ball.static_safety(turning) == pytest.approx(5.6)
    assert ball.load_share(turning) == pytest.approx(2 / 19.5)
    roller = Rolling(19.5e3, kind="roller", reliability=0.95, condition=2.0)
    assert roller.revolutions(turning) == pytest.approx(0.64 * 2 * 9.75 ** (10 / 3) * 1e6, rel=1e-12)
    assert turning.sense == 1
    assert turning.net_turns == pytest.approx(1.0)


def test_the_mean_force_is_weighted_by_angle():
    """1 kN over a third of the angle, 3 kN over the rest; in time the shares are exchanged."""
    fast = np.arange(N) < N // 3
    rate = np.where(fast, 40.0, 10.0)  # a third of the time covers two thirds of the angle
    force = np.where(fast, 3000.0, 1000.0)
    assert course(force, rate).mean_force() == pytest.approx(1000 * ((2 * 27 + 1) / 3) ** (1 / 3), rel=1e-12)
    assert course(force, 0.0).mean_force() == pytest.approx(1000 * ((27 + 2) / 3) ** (1 / 3), rel=1e-12)


@pytest.mark.parametrize("part", [0.15, 0.3, 0.5, 0.7])
def test_the_notch_of_an_eye_is_that_of_the_other_polynomial_on_its_bearing_stress(part):
    """The stress is the same by net section or bearing area, from two fits of one chart."""
    other = 0.2880 + 8.820 * part - 23.196 * part**2 + 29.167 * part**3
    eye = Eye(part, 1.0, 0.2, 1.0)
    assert eye.stress_concentration == pytest.approx(other * (1 - part) / part, rel=0.03)
    assert np.isnan(Eye(part, 1.0, 0.2, 0.9).stress_concentration)
    assert np.isnan(Eye(0.1 * part, 1.0, 0.2, 1.0).stress_concentration)


@pytest.mark.parametrize("eccentricity", [0.0, 0.05, 0.1, 0.4, 2.0])
def test_an_eccentric_load_presses_a_block_at_its_end(eccentricity):
    """By hand and quadrature: 600 N at several eccentricities on a block of 60 x 20 mm."""
    length, width, force = 0.06, 0.02, 600.0
    lever = eccentricity * length
    guide = Guide(length, width)
    sliding = course(0.0, 0.5)
    sliding = replace(sliding, across=np.full(N, -force), moment=np.full(N, force * lever), turns=False)
    even = 600 / (60 * 20) * 1e6
    assert guide.pressure(sliding) == pytest.approx(even * (1 + 6 * eccentricity), rel=1e-12)
    along = (np.arange(400_000) + 0.5) / 400_000 - 0.5
    pressed = even * np.abs(1 + 12 * eccentricity * along)
    assert guide.pressure_times_speed(sliding) == pytest.approx(0.5 * pressed.mean(), rel=1e-6)
    assert guide.speed(replace(sliding, rate=-sliding.rate)) == pytest.approx(0.5)


def test_life_of_a_bearing_that_swings():
    """Harris: the equivalent load is P (beta / 90 deg)^(1/p) with the amplitude beta; one cycle per period."""
    beta, period = np.radians(30), 0.04
    rate = beta * np.cos(TURN) * 2 * np.pi / period
    swinging = course(2000.0, rate, beta * np.sin(TURN), period)
    equivalent = 2000 * (30 / 90) ** (1 / 3)
    ball = Rolling(19.5e3, elements=9)
    assert ball.life(swinging) == pytest.approx((19.5e3 / equivalent) ** 3 * 1e6 * period, rel=1e-4)
    assert swinging.swing == pytest.approx(2 * beta, rel=1e-4)
    assert swinging.sense == 0
    assert ball.overlap(swinging) == pytest.approx(np.radians(60) / np.radians(720 / 9), rel=1e-4)


def test_plain_bearing_by_hand():
    """20 mm x 15 mm under 3 kN at 10 rad/s: 10 MPa, 0.1 m/s, 1 MPa m/s."""
    bush = Plain(0.02, 0.015)
    steady = course(3000.0, 10.0)
    assert bush.pressure(steady)[0] == pytest.approx(10e6)
    assert bush.speed(steady)[0] == pytest.approx(0.1)
    assert bush.pressure_times_speed(steady) == pytest.approx(1e6)


def test_pin_and_eye_by_hand():
    """10 mm pin, eye 12 mm, cheeks 8 mm, 6 kN: M = 6 kN (12 + 16)/8 mm = 21 N m."""
    load = course(6000.0, 0.0)
    pin = Pin(0.010, 0.012, 0.008, yield_stress=600e6)
    assert pin.bending(load)[0] == pytest.approx(32 * 21.0 / (np.pi * 0.01**3))
    assert pin.shear(load)[0] == pytest.approx(4 / 3 * 6000 / (2 * np.pi * 0.005**2))
    assert pin.safety(load)[0] == pytest.approx(600e6 / pin.bending(load)[0])
    overhung = Pin(0.010, 0.012, 0.008, gap=0.001, overhung=True)
    assert overhung.bending(load)[0] == pytest.approx(32 * 6000 * 0.007 / (np.pi * 0.01**3))
    assert overhung.shear(load)[0] == pytest.approx(2 * pin.shear(load)[0])
    # 30 mm wide, 12 mm thick, 15 mm from the centre to the end: tear-out 6 kN/(2 x 12 mm x 10 mm) = 25 MPa
    eye = Eye(0.010, 0.030, 0.012, 0.015, 235e6)
    assert eye.tear_out(load)[0] == pytest.approx(25e6)
    assert eye.bearing(load)[0] == pytest.approx(50e6)
    assert eye.net(load)[0] == pytest.approx(25e6)
    assert eye.safety(load)[0] == pytest.approx(4.7)


def test_contact_is_lost_if_the_force_passes_zero():
    def lost(force, closed=True):
        return np.flatnonzero(contact_losses(course(force, 1.0), closed)).tolist()

    assert lost(100 * np.exp(1j * TURN)) == []  # it only rotates
    passing = contact_losses(course(np.cos(TURN + 0.001), 1.0), True)
    assert passing[[N // 4 - 1, 3 * N // 4 - 1]].all()
    assert knocks(passing, True) == 2
    assert knocks(np.roll(passing, N // 4), True) == 2
    assert lost(1.5 + np.exp(1j * TURN)) == []
    assert len(lost(1.001 + np.exp(1j * TURN))) >= 1
    assert lost(np.where(np.arange(N) == N - 1, -1.0, 1.0)) == [N - 2, N - 1]
    assert lost(np.where(np.arange(N) == N - 1, -1.0, 1.0), closed=False) == [N - 2]


def slider_crank(rod=0.2):
    """Return a crank of 50 mm, a rod, and a block on the x axis."""
    links = (
        Link("ground", {"O": 0}),
        Link("crank", {"O": 0, "A": 0.05}),
        Link("rod", {"A": 0, "B": rod}),
        Link("block", {"B": 0}, lumps=()),
    )
    places = {"O": 0, "A": 0.03 + 0.04j, "B": 0.03 + np.sqrt(rod**2 - 0.04**2)}
    return Mechanism(links, (PinDrive("crank", "O"),), places, (Slider("guide", "block", "ground", "B", 0, 1),))


def test_clearance_of_a_rod_displaces_as_a_rod_of_another_length():
    """Pins pressed along the rod lengthen it by half of both clearances."""
    angle = np.linspace(0.1, 6.1, 13)
    moved = motion(slider_crank(), angle, 1.0)
    joints = {joint.name: number for number, joint in enumerate(moved.structure.joints)}
    way = moved.direction[moved.mechanism.index["rod"]]
    toward = {  # each pin moves towards the block as far as possible: the child yields against its force
        number: -way if moved.mechanism.links[moved.structure.joints[number].child].name != "crank" else way
        for number in (joints["A"], joints["B"])
    }
    clearances = dict.fromkeys(toward, 2e-06)
    _, pressed = clearance_effects(moved, clearances, toward, moved.mechanism.index["block"], 0j)
    longer = motion(slider_crank(0.2 + 2e-6), angle, 1.0)
    apart = np.abs(position_of(longer, "block", "B") - position_of(moved, "block", "B"))
    assert pressed == pytest.approx(apart, rel=1e-4)


@pytest.mark.slow
def test_no_pin_directions_exceed_the_sum_of_influences():
    moved = motion(slider_crank(), np.linspace(0.1, 6.1, 13), 1.0)
    joints = [number for number, joint in enumerate(moved.structure.joints) if joint.name != "guide"]
    clearances = dict.fromkeys(joints, 1e-05)
    rod = moved.mechanism.index["rod"]
    random = np.random.default_rng(3)
    for point in (0.1 + 0.02j, None):
        greatest = 0.0
        for _ in range(300):
            ways = {number: np.exp(2j * np.pi * random.random(13)) for number in joints}
            worst, pressed = clearance_effects(moved, clearances, ways, rod, point)
            assert (pressed <= worst * (1 + 1e-3)).all()
            greatest = max(greatest, float((pressed / worst).max()))
        assert greatest > 0.9


def test_the_force_history_of_a_joint_agrees_with_statics():
    links = (Link("ground", {"O": 0}), Link("arm", {"O": 0, "A": 1.0}))
    from msgspec.structs import replace

    from rigid import Lump

    links = (links[0], replace(links[1], lumps=(Lump("A", 2.0),)))
    turning = Mechanism(links, (PinDrive("arm", "O"),), {"O": 0, "A": 1})
    moved = motion(turning, TURN, 3.0, time=TURN / 3.0)
    found = joint_history(moved, reactions(moved), 0, np.full(N, 2 * np.pi / 3 / N))
    assert np.abs(found.force) == pytest.approx(18.0)
    assert found.mean_force() == pytest.approx(18.0)
    assert found.travel == pytest.approx(2 * np.pi)
    assert found.net_turns == pytest.approx(1.0)
    assert found.force_turns(of_child=True) == pytest.approx(0.0, abs=1e-12)
    assert abs(found.force_turns(of_child=False)) == pytest.approx(1.0)
    assert found.polar(of_child=True) == pytest.approx(np.full(N, -18.0))
