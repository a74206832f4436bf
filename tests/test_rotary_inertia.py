"""Rotary inertia of sections is part of every answer: -rho I eps is a moment along the beam."""

import numpy as np
import pytest
from mechanisms import steel_four_bar
from msgspec.structs import replace
from scene_texts import FOUR_BAR, edited

from elastic import Section, deflection, extremes, rectangle, sample, section_of, tapered, with_rotary_inertia
from fem_check import compare, solve
from kinelast import scene_from_text
from rigid import Beam, Link, Mechanism, PinDrive, Slider, drive_efforts, motion
from rigid.constants import mass_moments

LENGTH, MASS, ROTARY, EPS = 0.5, 80.0, 0.8, 7.0
SECTION = Section(2e9, 2e7, 7e8)


def arm(rotary=ROTARY):
    bar = Link("arm", {"O": 0, "A": LENGTH}, (Beam("O", "A", MASS, rotary_inertia=rotary),))
    return Mechanism((Link("ground", {"O": 0}), bar), (PinDrive("arm", "O"),), {"O": 0, "A": LENGTH})


def test_an_arm_with_angular_acceleration():
    """V = m eps (l^2 - x^2)/2 is unchanged; rho I eps changes M, phi and w by polynomials."""
    x = np.linspace(0.0, LENGTH, 9)
    bent, bare = (deflection(motion(arm(rotary), [0.3], 0.0, EPS), [SECTION]) for rotary in (ROTARY, 0.0))
    more = {
        key: (sample(bent, key, x / LENGTH) - sample(bare, key, x / LENGTH))[0, 0] for key in ("V", "M", "phi", "w")
    }
    turned = ROTARY * EPS / SECTION.EI
    assert more["V"] == pytest.approx(0.0, abs=1e-11)
    assert more["M"] == pytest.approx(-ROTARY * EPS * (LENGTH - x), abs=1e-12)
    assert more["phi"] == pytest.approx(-turned * (LENGTH * x - x**2 / 2), rel=1e-9, abs=1e-18)
    assert more["w"] == pytest.approx(-turned * (LENGTH * x**2 / 2 - x**3 / 6), rel=1e-9, abs=1e-18)
    effort = drive_efforts(bent.motion, bent.forces)[0, 0]
    assert effort == pytest.approx((MASS * LENGTH**3 / 3 + ROTARY * LENGTH) * EPS, rel=1e-12)


def test_the_largest_moment_includes_rotary_inertia():
    """The maximum of a coupler's moment is at V = -rho I eps, not at V = 0."""
    mechanism, sections = stubby(False)
    bent = deflection(motion(mechanism, [1.0], 30.0, 400.0), sections)
    fine = sample(bent, "M", np.linspace(0.0, 1.0, 20001))[:, 0]
    assert np.abs(extremes(bent, ["M"])["M"].value[:, 0]) == pytest.approx(np.abs(fine).max(axis=1), rel=1e-8)


def test_moment_of_inertia_of_a_link():
    """A rod of height b has m (l^2 + b^2)/12 about its middle."""
    depth, mass = 0.1, 3.0
    section = section_of(rectangle(depth, 0.05), 210e9, 0.3)
    made = with_rotary_inertia(arm(0.0), [section]).links[1].beams[0]
    assert made.rotary_inertia == pytest.approx(MASS * depth**2 / 12)
    rod = Beam("A", "B", mass / LENGTH, rotary_inertia=mass / LENGTH * depth**2 / 12)
    whole = mass_moments(Link("rod", {"A": -LENGTH / 2, "B": LENGTH / 2}, (rod,)))
    assert whole[2] == pytest.approx(mass * (LENGTH**2 + depth**2) / 12)


def test_only_euler_bernoulli_scenes_neglect_rotary_inertia():
    plain = edited(FOUR_BAR, ("[run]", '[run]\nbeams = "euler-bernoulli"'))
    made, line = (scene_from_text(text).mechanism.links[1].beams[0] for text in (FOUR_BAR, plain))
    assert made.rotary_inertia == pytest.approx(made.mass_per_length * 0.006**2 / 12)
    assert line.rotary_inertia == 0.0


def stubby(taper):
    """The steel four-bar with bars 5 cm deep; the rocker can have a taper."""
    bar, mechanism = rectangle(0.05, 0.01), steel_four_bar().mechanism
    sections = [section_of(bar, 210e9, 0.3)] * 3
    if taper:
        along, mass = tapered(rectangle, (0.05, 0.01), (0.03, 0.01), 0.3)
        sections[2] = section_of(bar, 210e9, 0.3, taper=along)
        *links, rocker = mechanism.links
        rocker = replace(rocker, beams=(replace(rocker.beams[0], mass_taper=mass),))
        mechanism = replace(mechanism, links=(*links, rocker))
    return with_rotary_inertia(mechanism, sections), sections


@pytest.mark.parametrize("taper", [False, True])
def test_finite_elements_agree(taper):
    mechanism, sections = stubby(taper)
    bent = deflection(motion(mechanism, np.linspace(0.2, 6.0, 7), 30.0, 400.0), sections)
    elements = solve(bent.motion, sections, 4)
    assert compare(bent, elements).passed
    lines = [
        replace(link, beams=tuple(replace(beam, rotary_inertia=0.0) for beam in link.beams)) for link in mechanism.links
    ]
    bare = deflection(motion(replace(mechanism, links=tuple(lines)), np.linspace(0.2, 6.0, 7), 30.0, 400.0), sections)
    assert not compare(bare, elements).passed


def test_under_a_block_on_a_beam():
    """A block slides along a stubby bar; the finite elements have a node at the block."""
    bar = Link("bar", {"C": 0, "D": 0.4}, (Beam("C", "D", 4.0, rotary_inertia=0.02),))
    crank = Link("crank", {"O": 0, "A": 0.08}, (Beam("O", "A", 4.0, rotary_inertia=0.02),))
    ground, block = Link("ground", {"O": 0.2j, "C": 0}), Link("block", {"A": 0})
    slot = Slider("slot", "block", "bar", "A", 0.0, 1.0)
    along = (0.08 + 0.2j) / abs(0.08 + 0.2j)
    drawing = {"O": 0.2j, "A": 0.08 + 0.2j, "C": 0, "D": 0.4 * along}
    mechanism = Mechanism((ground, crank, bar, block), (PinDrive("crank", "O"),), drawing, (slot,))
    turning = motion(mechanism, np.linspace(0.0, 5.0, 6), 20.0, 150.0)
    sections = [Section(2e8, 4e4, 6e7)] * 2
    assert compare(deflection(turning, sections), solve(turning, sections, 4)).passed
