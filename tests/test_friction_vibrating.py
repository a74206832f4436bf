"""Friction acts on vibrating links by their own joint forces and rates, in slip and stick."""

import numpy as np
import pytest
import scipy.integrate
from many_speeds import speed_map
from mechanisms import steel_four_bar
from msgspec.structs import replace
from tiers import in_tiers

from elastic import Section, displacement_of, sample
from elastic.elastodynamics import elastodynamic, geometrically_exact, transient
from rigid import (
    Beam,
    Friction,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    Slider,
    SliderDrive,
    TorsionSpring,
    drive_efforts,
    motion,
)
from rigid.kinetostatics import friction_power

MASS, STIFFNESS, GRAVITY, STROKE = 2.0, 5e4, 9.81, 1e-3
NATURAL = np.sqrt(STIFFNESS / MASS)
FOUR_BAR = steel_four_bar()


def block_on_a_rod(share):
    """Return a block on the ground that a carriage moves by an elastic rod.

    `share` is the friction relative to the rod force of the carriage's stroke.
    """
    links = (
        Link("ground", {"O": 0}),
        Link("carriage", {"A": 0}),
        Link("rod", {"A": 0, "B": 1.0}, (Beam("A", "B", 0.0),)),
        Link("block", {"B": 0}, (), (Lump("B", MASS),)),
    )
    sliders = Slider("in", "carriage", "ground", "A", 0, 1), Slider("out", "block", "ground", "B", 0, 1)
    friction = {"out": Friction(share * STIFFNESS * STROKE / (MASS * GRAVITY))}
    return Mechanism(links, (SliderDrive("in"),), {"O": 0, "A": 0, "B": 1.0}, sliders, -1j * GRAVITY, friction=friction)


def shaken(share, beta, ratio=1e-4, count=720):
    """Return the steady state for a carriage at `beta` times the natural frequency, and the block's displacement."""
    mechanism, speed = block_on_a_rod(share), beta * NATURAL

    def at(t):
        angle = speed * np.asarray(t)
        rates = -STROKE * speed * np.sin(angle), -STROKE * speed**2 * np.cos(angle)
        return motion(mechanism, STROKE * np.cos(angle), *rates, t)

    course = at(np.arange(count) / count * 2 * np.pi / speed)
    found = elastodynamic(course, at, 2 * np.pi / speed, [Section(EA=STIFFNESS, EI=1e3)], {}, 2 * ratio / NATURAL)
    return found, STROKE * np.cos(speed * course.time) + np.real(displacement_of(found.deflection, "block", "B"))


@pytest.mark.parametrize(("beta", "share"), in_tiers([(0.8, 0.4), (1.5, 0.2)], 1, 1))
def test_den_hartogs_amplitude(beta, share):
    """Forced vibrations with Coulomb's friction, Transactions of the ASME 53 (1931), motion without stops."""
    _, place = shaken(share, beta)
    friction = share * np.sin(np.pi / beta) / (beta * (1 + np.cos(np.pi / beta)))
    assert np.abs(place).max() == pytest.approx(STROKE * np.sqrt(1 / (1 - beta**2) ** 2 - friction**2), rel=6e-4)


@pytest.mark.slow
def test_a_block_that_stops_in_every_stroke():
    """The reference is integrated from rest until periodic; the stated error covers the incomplete convergence."""
    beta, share, ratio = 0.35, 0.3, 0.02
    found, place = shaken(share, beta, ratio)
    speed = beta * NATURAL
    creep = 1e-3 * STROKE * speed  # documented share of the largest rate of the rigid motion

    def rates(t, state):
        x, v = state
        pull = NATURAL**2 * (STROKE * np.cos(speed * t) - x)
        viscous = 2 * ratio * NATURAL * (-STROKE * speed * np.sin(speed * t) - v)
        return v, pull + viscous - share * NATURAL**2 * STROKE * v / np.hypot(v, creep)

    period = 2 * np.pi / speed
    times = 12 * period + np.arange(720) / 720 * period
    solved = scipy.integrate.solve_ivp(rates, (0, 13 * period), [0, 0], "LSODA", times, rtol=1e-8, atol=1e-12)
    assert 0.1 < (np.abs(solved.y[1]) < 10 * creep).mean() < 0.9
    off = np.abs(place - solved.y[0]).max() / np.abs(solved.y[0]).max()
    assert off < found.discretization_error


@pytest.mark.slow
def test_free_vibrations_lose_the_same_amplitude_per_cycle():
    """The amplitude drops by four times friction over stiffness per cycle, until the block sticks."""
    share, stop = 0.04, 0.7 * 2 * np.pi / NATURAL
    mechanism = block_on_a_rod(share)

    def at(t):
        way = np.minimum(np.asarray(t) / stop, 1.0)
        turn = 2 * np.pi * way
        place = way - np.sin(turn) / (2 * np.pi), (1 - np.cos(turn)) / stop, 2 * np.pi * np.sin(turn) / stop**2
        return motion(mechanism, *(STROKE * part for part in place), t)

    course = at(np.linspace(0.0, stop + 2.8 * 2 * np.pi / NATURAL, 2000))
    found = transient(course, at, [Section(EA=STIFFNESS, EI=1e3)], {}, 2e-5 / NATURAL)
    stretch = np.real(displacement_of(found.deflection, "block", "B"))[course.time > stop]
    turns = np.nonzero((stretch[1:-1] - stretch[:-2]) * (stretch[2:] - stretch[1:-1]) < 0)[0] + 1
    losses = -np.diff(np.abs(stretch[turns]))
    np.testing.assert_allclose(losses[:4], 2 * share * STROKE, rtol=1e-3)


def four_bar(mechanism, speed=100.0, exact=False, count=90, **more):
    def at(t):
        return motion(mechanism, speed * np.asarray(t), speed, 0.0, t)

    period = 2 * np.pi / speed
    course = at(np.arange(count) / count * period)
    found = elastodynamic(course, at, period, FOUR_BAR.sections, damping=40e-6, **more)
    return geometrically_exact(found) if exact else found


def rubbing(**friction):
    return replace(FOUR_BAR.mechanism, friction=friction)


def largest(found):
    return np.abs(sample(found.deflection, "w", np.linspace(0, 1, 11))).max()


def test_small_friction_has_a_small_effect():
    plain, rubbed = (four_bar(each) for each in (FOUR_BAR.mechanism, rubbing(B=Friction(1e-4, 0.005))))
    assert 0 < abs(largest(rubbed) / largest(plain) - 1) < 1e-4


def test_viscous_friction_is_a_dashpot():
    viscosity = 2e-3
    dashpot = TorsionSpring(link="rocker", on="coupler", at="B", stiffness=0.0, damping=viscosity)
    held = four_bar(replace(FOUR_BAR.mechanism, loads=(dashpot,)))
    rubbed = four_bar(rubbing(B=Friction(viscosity=viscosity)))
    for one, other in zip(held.deflection.forces.force, rubbed.deflection.forces.force, strict=True):
        np.testing.assert_allclose(one, other, atol=2e-3 * np.abs(one).max())
    assert rubbed.growth == pytest.approx(held.growth, rel=1e-6)


@pytest.mark.slow
def test_a_map_of_speeds_includes_friction():
    def at(t):
        return motion(mechanism, 100 * np.asarray(t), 100.0, 0.0, t)

    mechanism = rubbing(A=Friction(0.1, 0.005), D=Friction(0.05, 0.005))

    def measure(bent, _):
        return np.abs(sample(bent, "w", np.ones(1))).max(axis=(0, -2, -1))

    found = speed_map(at, 2 * np.pi / 100, [0.6], FOUR_BAR.sections, measure, damping=40e-6)
    single = four_bar(mechanism, 60.0, count=360)
    assert found.values[0] == pytest.approx(np.abs(sample(single.deflection, "w", np.ones(1))).max(), rel=3e-3)


@pytest.mark.parametrize("exact", in_tiers([False, True], 0, 1))
def test_the_drive_supplies_the_heat(exact):
    """The additional mean power is the friction loss; the damping of beams is nearly unchanged."""
    means, heat, greatest_power = [], 0.0, 0.0
    for mechanism in (FOUR_BAR.mechanism, rubbing(B=Friction(0.1, 0.005), D=Friction(0.1, 0.005))):
        found = four_bar(mechanism, exact=exact, count=720).deflection
        power = drive_efforts(found.motion, found.forces)[0] * 100
        means.append(power.mean())
        heat, greatest_power = friction_power(found.motion, found.forces).mean(), np.abs(power).max()
    assert means[1] - means[0] == pytest.approx(heat, abs=5e-5 * greatest_power)
    assert heat > 5e-4 * greatest_power


def test_friction_that_can_lock_is_an_error():
    with pytest.raises(MechanismError, match="friction may lock the mechanism at"):
        four_bar(rubbing(B=Friction(0.5, 1.0)))
