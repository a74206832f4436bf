"""Whole mechanisms: closed forms agree with finite elements, and superposition with one matrix."""

import numpy as np
import pytest
from fem_direct import Direct
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import (
    arm,
    four_bar,
    inverted_slider_crank,
    motion_of,
    pressed,
    scotch_yoke,
    six_bar,
    slider_crank,
    stiff_plate,
    triad,
    with_link,
)
from msgspec.structs import replace

from elastic import Section, deflection, sample
from fem_check import compare, solve
from rigid import Beam, Link, Mechanism, MechanismError, PinDrive, PointLoad, drive_efforts, motion, position_of

MECHANISMS = {
    "four-bar": four_bar,
    "slider-crank": slider_crank,
    "block on a rocker": inverted_slider_crank,
    "rod through a rocker": lambda: inverted_slider_crank(sliding_rod=True),
    "yoke": scotch_yoke,
    "driven block": pressed,
    "two drives in series": arm,
    "ternary link, welded": six_bar,
    "ternary link, rigid": stiff_plate,
    "group that is no dyad": triad,
}
family = settings(max_examples=60, deadline=None)


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("elements", [4, 64])
def test_closed_forms_agree_with_finite_elements(name, elements):
    case = MECHANISMS[name]()
    turning = motion_of(case)
    exact, found = deflection(turning, case.sections), solve(turning, case.sections, elements)
    comparison = compare(exact, found)
    assert comparison.passed
    assert comparison.compared == len(turning.time)
    assert comparison.relative.max() < 1e-11
    efforts = drive_efforts(turning, exact.forces)
    np.testing.assert_allclose(found.efforts, efforts, rtol=0, atol=1e-12 * np.abs(efforts).max())


def slender(case, draw):
    """Draw solid steel sections with a slenderness of 5 to 200."""
    sections = []
    for at, beam in case.mechanism.beams:
        points = case.mechanism.links[at].points
        radius = abs(points[beam.end] - points[beam.start]) / draw(st.floats(5, 200))
        EA = 210e9 * 12 * radius**2
        sections.append(Section(EA, EA * radius**2))
    return replace(case, sections=tuple(sections))


def agree(case, draw):
    rate = draw(st.floats(-300, 300))
    case = replace(case, rate=np.full(case.drive.shape, rate))
    try:
        turning = motion_of(case)
    except MechanismError:
        assume(False)
    assume(turning.condition.max() < 1e3)
    found = solve(turning, case.sections, draw(st.integers(4, 64)))
    comparison = compare(deflection(turning, case.sections), found)
    assert comparison.passed, comparison.worst
    assert comparison.compared == len(turning.time)


@st.composite
def four_bars(draw):
    crank, side = draw(st.floats(0.05, 0.15)), draw(st.sampled_from([-1.0, 1.0]))
    coupler, rocker, base = (draw(st.floats(0.2, 0.6)) for _ in range(3))
    sides = sorted((crank, coupler, rocker, base))
    assume(sides[0] == crank and 1.03 * (sides[0] + sides[3]) < sides[1] + sides[2])
    lean = np.exp(1j * draw(st.floats(-3, 3)))
    return slender(four_bar(crank, coupler, rocker, base * lean, side, count=7), draw)


@st.composite
def slider_cranks(draw):
    crank, side = draw(st.floats(0.05, 0.2)), draw(st.sampled_from([-1.0, 1.0]))
    offset = draw(st.floats(-0.1, 0.1))
    rod = (crank + abs(offset)) * draw(st.floats(1.1, 4))
    return slender(slider_crank(crank, rod, offset, draw(st.floats(-3, 3)), side, count=7), draw)


@family
@given(four_bars(), st.data())
def test_random_four_bars_agree(case, data):
    agree(case, data.draw)


@pytest.mark.slow
@family
@given(slider_cranks(), st.data())
def test_random_slider_cranks_agree(case, data):
    agree(case, data.draw)


@pytest.mark.slow
@family
@given(st.sampled_from([lambda: inverted_slider_crank(sliding_rod=True, count=5), lambda: six_bar(count=5)]), st.data())
def test_random_sections_of_other_mechanisms_agree(make, data):
    agree(slender(make(), data.draw), data.draw)


@pytest.mark.parametrize("name", sorted(set(MECHANISMS) - {"ternary link, rigid"}))
def test_superposition_agrees_with_one_matrix(name):
    case = MECHANISMS[name]()
    turning = motion_of(case)
    found = solve(turning, case.sections, 5)
    for position in (2, 11):
        direct = Direct(turning, case.sections, position, 5)
        whole = [np.array(values) for values in zip(*map(direct.nodes, range(len(case.sections))), strict=True)]
        for field, values in zip(("u", "w", "phi"), whole, strict=True):
            superposed = getattr(found, field)[:, position]
            np.testing.assert_allclose(superposed, values, rtol=0, atol=1e-9 * np.abs(values).max())


def test_several_designs_equal_single_ones():
    """Lengths, masses and rigidities have the shape (designs, 1)."""
    lengths, rigidities = [0.28, 0.31, 0.36], [30.0, 60.0, 90.0]
    together = four_bar()
    coupler = together.mechanism.links[together.mechanism.index["coupler"]]
    many = replace(coupler, points={"A": 0.0, "B": np.array(lengths)[:, None]})
    case = replace(together, mechanism=with_link(together.mechanism, many))
    sections = (case.sections[0], Section(1e5, np.array(rigidities)[:, None]), case.sections[2])
    found = solve(motion_of(case), sections, 4)
    assert found.w.shape == (3, 3, 24, 5)
    assert compare(deflection(motion_of(case), sections), found).passed
    for k, (length, rigidity) in enumerate(zip(lengths, rigidities, strict=True)):
        alone = four_bar(coupler=length)
        one = solve(motion_of(alone), (sections[0], Section(1e5, rigidity), sections[2]), 4)
        np.testing.assert_allclose(found.w[:, k], one.w, rtol=0, atol=1e-12 * np.abs(one.w).max())


class Rope:
    """An elastic rope between the ends of crank and rocker."""

    points = (("crank", "A"), ("rocker", "B"), ("ground", "O"))

    def forces(self, motion):
        pull = 4e3 * (position_of(motion, "rocker", "B") - position_of(motion, "crank", "A"))
        return ("crank", "A", pull, 0.0), ("rocker", "B", -pull, 2.0), ("ground", "O", 1.0, 0.0)


def test_custom_loads_are_included():
    case = four_bar(loads=(Rope(),))
    turning = motion_of(case)
    found = solve(turning, case.sections)
    assert compare(deflection(turning, case.sections), found).passed
    slack = solve(motion_of(case.with_(loads=())), case.sections)
    assert np.abs(found.w - slack.w).max() > 0.01 * np.abs(slack.w).max()


def test_strain_of_a_link_moves_the_others():
    case = four_bar()
    warm = [replace(section, strain=2e-4 * k) for k, section in enumerate(case.sections)]
    turning = motion_of(case)
    found = solve(turning, warm, 4)
    assert compare(deflection(turning, warm), found).passed
    cold = solve(turning, case.sections, 4)
    np.testing.assert_allclose(found.N, cold.N, rtol=0, atol=1e-12 * np.abs(cold.N).max())
    stretch = (found.u - cold.u)[1, :, -1] - (found.u - cold.u)[1, :, 0]
    np.testing.assert_allclose(stretch, 2e-4 * 0.31, rtol=1e-9)


def test_tapered_mass_is_included():
    """Hanging rod with mass m (1 - x/l)(1 - x/2l): weight and inertia by hand."""
    rod = Link("rod", {"O": 0.0, "A": 2.0}, (Beam("O", "A", 3.0, (1.0, -1.5, 0.5)),))
    hung = Mechanism((Link("ground", {"O": 0.0}), rod), (PinDrive("rod", "O"),), {"O": 0.0, "A": 2.0}, gravity=10.0)
    found = solve(motion(hung, [0.0], 4.0), [Section(5e5, 1.0)])
    xi = found.xi
    weight = 3.0 * 2.0 * 10.0 * (5 / 12 - xi + 0.75 * xi**2 - xi**3 / 6)
    pull = 3.0 * 2.0**2 * 4.0**2 * (1 / 8 - xi**2 / 2 + xi**3 / 2 - xi**4 / 8)
    np.testing.assert_allclose(found.N[0, 0], weight + pull, rtol=0, atol=1e-13 * (weight + pull).max())


def test_a_redundant_crank_carries_a_share():
    """Parallelogram with a third crank: statics alone does not determine the joint forces."""
    lean, load = 0.05 + 0.09j, PointLoad("coupler", "B", 70 - 90j)
    crank = abs(lean)
    cranks = (("first", "O", "A"), ("second", "D", "B"), ("third", "G", "C"))
    links = (
        Link("ground", {"O": 0.0, "D": 0.13, "G": 0.37}),
        *(Link(name, {at: 0.0, to: crank}, (Beam(at, to, 0.5),)) for name, at, to in cranks),
        Link("coupler", {"A": 0.0, "B": 0.13, "C": 0.37}, (Beam("A", "B", 0.7), Beam("B", "C", 0.6))),
    )
    drawing = {"O": 0.0, "D": 0.13, "G": 0.37, "A": lean, "B": lean + 0.13, "C": lean + 0.37}
    mechanism = Mechanism(links, (PinDrive("first", "O"),), drawing, loads=(load,), gravity=-9.81j)
    turning = motion(mechanism, np.linspace(0.6, 2.5, 7), 20.0)
    sections = [Section(2e5 * (1 + k), 30.0 + 10 * k) for k in range(5)]
    comparison = compare(deflection(turning, sections), solve(turning, sections, 4))
    assert comparison.compared == 7
    assert comparison.relative.max() < 1e-10


def test_only_positions_out_of_reach_are_unknown():
    case = four_bar(crank=0.3, coupler=0.2, rocker=0.3, base=0.4, count=12)
    turning = motion_of(case)
    lost = ~np.isfinite(turning.condition)
    assert 0 < lost.sum() < 12
    found = solve(turning, case.sections)
    np.testing.assert_array_equal(np.isnan(found.w).any(axis=(0, 2)), lost)
    comparison = compare(deflection(turning, case.sections), found)
    assert comparison.passed
    assert comparison.compared == 12 - lost.sum()


def test_a_nearly_singular_position_is_unknown():
    """A parallelogram only 1e-8 rad from flat: its forces would be round-off."""
    case = four_bar(0.1, 0.3, 0.1, 0.3)
    turning = motion(case.mechanism, [0.4, 1e-8], 7.0)
    assert turning.sine[1] > 0
    found = solve(turning, case.sections)
    assert np.isfinite(found.w[:, 0]).all()
    assert np.isnan(found.w[:, 1]).all()


def test_pin_forces_equal_section_forces():
    """The pin between crank and coupler carries the section force at the coupler's first point."""
    case = slider_crank(loads=())
    bare = case.with_(links=tuple(replace(link, lumps=()) for link in case.mechanism.links))
    turning = motion_of(bare)
    found = solve(turning, bare.sections)
    pin = next(tie for tie in found.ties if tie.name == "A")
    rod = turning.mechanism.index["rod"]
    own = np.conj(turning.direction[rod]) * pin.force
    beam = [at for at, _ in turning.mechanism.beams].index(rod)
    np.testing.assert_allclose(own, -found.N[beam, :, 0] + 1j * found.V[beam, :, 0], atol=1e-12 * np.abs(own).max())
    assert sample(deflection(turning, bare.sections), "M", [0.0])[beam] == pytest.approx(0.0, abs=1e-12)
