"""The finite elements cover every kind of link: shear, taper, blocks on beams, soft joints, gears.

Handbook cases are Roark's (W. C. Young, R. G. Budynas, Roark's Formulas for Stress and Strain, 7th ed., 2002).
"""

import mpmath
import numpy as np
import pytest
from fem_direct import Direct, orders
from mechanisms import (
    bar,
    bush,
    cantilever,
    elastic_guide,
    four_bar,
    held_arm,
    motion_of,
    pressed,
    ring,
    six_bar,
    slider_crank,
    still,
)
from msgspec.structs import replace

from elastic import PRIMARY, JointCompliance, Section, Taper, deflection
from fem_check import compare, solve
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
    Slider,
    SliderDrive,
    drive_efforts,
    motion,
)

EA, EI, KGA, LENGTH = 3e6, 700.0, 4e4, 1.7
ARM = {"O": 0.0, "A": LENGTH}


def sheared(case):
    """Return the case with a different shear rigidity for each beam."""
    return replace(case, sections=tuple(replace(s, kGA=s.EA * (0.1 + 0.1 * k)) for k, s in enumerate(case.sections)))


def tapering(case, *numbers):
    """Return the case with tapered beams."""
    taper = Taper(EA=(1.0, -0.5), EI=(1.0, -1.2, 0.6), kGA=(1.0, 0.4))
    changed = [replace(s, taper=taper) if k in numbers else s for k, s in enumerate(case.sections)]
    return replace(case, sections=tuple(changed))


def assert_same(found, direct, position):
    """Require the nodal displacements of one matrix over all elements."""
    whole = [np.array(values) for values in zip(*map(direct.nodes, range(len(found.sections))), strict=True)]
    for field, values in zip(("u", "w", "phi"), whole, strict=True):
        own = getattr(found, field)[:, position]
        np.testing.assert_allclose(own, values, rtol=0, atol=1e-9 * np.abs(values).max())


class TestShear:
    def test_no_shear_locking(self):
        """For any shear rigidity a single element has the exact bending part."""
        load = (PointLoad("beam", "A", 1j),)
        for kGA in (1e-3, 1e12):
            found = solve(still(cantilever(ARM, loads=load)), [Section(EA, EI, kGA)], 1)
            assert found.w[0, 0, -1] == pytest.approx(LENGTH**3 / (3 * EI) + LENGTH / kGA, rel=1e-13)

    @pytest.mark.parametrize("make", [four_bar, six_bar, slider_crank, ring])
    def test_separate_bending_and_shear_agree_with_timoshenko_elements(self, make):
        """The reference matrix has separate deflection and rotation, of degree four and three."""
        case = sheared(make())
        turning, sections = motion_of(case), [replace(section, strain=0.0) for section in case.sections]
        found, direct = solve(turning, sections, 3), Direct(turning, sections, 5, 3)
        assert_same(found, direct, 5)


class TestTaper:
    def test_wedge_to_the_fourth_order_down_to_round_off(self):
        """EI, EA and kGA decrease linearly: integrals of F (l - x)/EI and F/kGA have logarithms."""
        force, fall = 20 + 31j, 0.6
        section = Section(EA, EI, KGA, taper=Taper(*[(1.0, -fall)] * 3))
        held = still(cantilever(ARM, loads=(PointLoad("beam", "A", force),)))
        with mpmath.workdps(30):
            c, length = mpmath.mpf(fall), mpmath.mpf(LENGTH)
            log = -mpmath.log(1 - c) / c  # integral of 1/(1 - c x) from 0 to 1
            first = (log - 1) / c  # of x/(1 - c x)
            second = (first - mpmath.mpf(1) / 2) / c  # of x^2/(1 - c x)
            w = force.imag * (length**3 / EI * (log - 2 * first + second) + length / KGA * log)
            phi, u = force.imag * length**2 / EI * (log - first), force.real * length / EA * log
        exact = {"u": float(u), "w": float(w), "phi": float(phi)}
        errors = []
        for n in (4, 8, 16, 32, 64):
            found = solve(held, [section], n)
            errors.append([abs(getattr(found, field)[0, 0, -1] / value - 1) for field, value in exact.items()])
            np.testing.assert_allclose(found.M[0, 0], force.imag * LENGTH * (1 - found.xi), rtol=0, atol=1e-12)
            np.testing.assert_allclose(found.N[0, 0], force.real, rtol=1e-13)
        assert max(errors[-1]) < 1e-7
        for field in range(3):
            np.testing.assert_allclose(orders([row[field] for row in errors]), 4.0, atol=0.2)

    @pytest.mark.parametrize("shear", [False, True])
    @pytest.mark.parametrize("make", [four_bar, six_bar, ring])
    def test_tapered_mechanisms_converge_with_fourth_order(self, make, shear):
        case = sheared(make()) if shear else make()
        case = tapering(case, *range(len(case.sections)))
        turning = motion_of(case)
        exact = deflection(turning, case.sections)
        errors = [compare(exact, solve(turning, case.sections, n)).relative.max(axis=1) for n in (8, 16, 32, 64)]
        assert np.max(errors[-1]) < 1e-8
        for field in range(3, 6):
            np.testing.assert_allclose(orders([row[field] for row in errors]), 4.0, atol=0.2)

    def test_superposition_agrees_with_one_matrix_of_tapered_elements(self):
        case = tapering(six_bar(), 1, 2, 4)
        turning = motion_of(case)
        assert_same(solve(turning, case.sections, 4), Direct(turning, case.sections, 3, 4), 3)


FORCE, MOMENT = 20 - 31j, 5.0
SPOTS = np.array([0.0, 1e-7, 0.1, 0.25, 0.25 + 1e-7, 0.4, 0.5 - 1e-6, 0.5, 0.61, 0.9, 1.0]) * LENGTH


def on_an_arm(spots=SPOTS, second=None):
    """Return a loaded block that a drive moves along a fixed arm."""
    links = [
        Link("ground", {"O": 0.0}),
        Link("arm", {"O": 0.0, "A": LENGTH}, (Beam("O", "A"),)),
        Link("block", {"B": 0}),
    ]
    sliders = [Slider("guide", "block", "arm", "B", 0.0, 1.0)]
    drives = [PinDrive("arm", "O"), SliderDrive("guide")]
    loads = [PointLoad("block", "B", FORCE, MOMENT)]
    drawing = {"O": 0.0, "A": LENGTH, "B": 0.3}
    if second is not None:
        links.append(Link("other", {"C": 0.0}))
        sliders.append(Slider("second", "other", "arm", "C", 0.0, 1.0))
        drives.append(SliderDrive("second"))
        loads.append(PointLoad("other", "C", 12 + 9j, -2.0))
        drawing["C"] = 0.4
    mechanism = Mechanism(tuple(links), tuple(drives), drawing, tuple(sliders), loads=tuple(loads))
    rows = [np.zeros(len(spots)), spots] + ([] if second is None else [second])
    return motion(mechanism, np.array(rows))


def under_a_load(x, at, force, moment):
    """Return u, w, phi, N, V, M of a cantilever under a force and a moment: Roark, table 8.1, 1a and 3a."""
    before = np.minimum(x, at)
    pull, push = force.real, force.imag
    w = push * before**2 * (3 * at - before) / (6 * EI) + moment * before**2 / (2 * EI) + push * before / KGA
    phi = push * before * (2 * at - before) / (2 * EI) + moment * before / EI
    here = x < at
    return {
        "u": pull * before / EA,
        "w": w + phi * np.maximum(x - at, 0.0),
        "phi": phi,
        "N": pull * here,
        "V": -push * here,
        "M": (push * (at - x) + moment) * here,
    }


class TestBlocksOnBeams:
    @pytest.mark.parametrize("elements", [1, 4, 16])
    def test_cantilever_under_a_block(self, elements):
        found = solve(on_an_arm(), [Section(EA, EI, KGA)], elements)
        x, at = found.xi * LENGTH, SPOTS[:, None]
        exact = under_a_load(x, at, FORCE, MOMENT)
        away = np.abs(x - at) > 1e-12
        for field, values in exact.items():
            same = np.ones_like(away) if field in "uw" or field == "phi" else away
            own = getattr(found, field)[0]
            np.testing.assert_allclose(own[same], values[same], rtol=0, atol=2e-13 * np.abs(values).max())

    @pytest.mark.parametrize("elements", [1, 4, 16])
    def test_two_blocks_interact(self, elements):
        """The blocks are anywhere, on one element or two, in either order; the arm closes under both."""
        other = np.array([1.0, 0.3, 0.12, 0.2, 0.25, 0.33, 0.99, 0.5, 0.6, 0.1, 0.7]) * LENGTH
        turning = on_an_arm(second=other)
        soft = {"guide": JointCompliance(1e-5, 1e-3), "second": JointCompliance(2e-5)}
        found = solve(turning, [Section(EA, EI, KGA)], elements, soft)
        tied = compare(deflection(turning, [Section(EA, EI, KGA)], joints=soft), found)
        assert tied.relative.max() < 1e-12
        end = under_a_load(np.full(len(SPOTS), LENGTH), SPOTS, FORCE, MOMENT)["w"]
        end = end + under_a_load(np.full(len(SPOTS), LENGTH), other, 12 + 9j, -2.0)["w"]
        np.testing.assert_allclose(found.w[0, :, -1], end, rtol=1e-12)

    @pytest.mark.parametrize("change", [lambda case: case, sheared, lambda case: tapering(sheared(case), 0)])
    def test_a_mechanism_with_its_guide_on_a_lever(self, change):
        case = change(elastic_guide())
        turning = motion_of(case)
        comparison = compare(deflection(turning, case.sections), solve(turning, case.sections, 64))
        assert comparison.compared == len(turning.time)
        assert comparison.relative.max() < (1e-8 if case.sections[0].taper else 1e-13)

    def test_driven_blocks_carry_a_dyad(self):
        """Two blocks on one beam, on one or two elements; the beam is loaded over its whole length."""
        links = (
            Link("ground", {"O": 0.0}),
            Link("arm", {"O": 0.0, "A": 1.0}, (Beam("O", "A", 3.0, (1.0, -0.5)),), (Lump("A", 0.7),)),
            Link("inner", {"B": 0.0}),
            Link("outer", {"C": 0.0}),
            *(Link(f"rod {end}", {end: 0.0, "E": 0.5}, (Beam(end, "E", 0.5),), (Lump("E", 0.4),)) for end in "BC"),
        )
        sliders = tuple(Slider(name, name, "arm", at, 0.0, 1.0) for name, at in (("inner", "B"), ("outer", "C")))
        drives = (PinDrive("arm", "O"), SliderDrive("inner"), SliderDrive("outer"))
        drawing = {"O": 0.0, "A": 1.0, "B": 0.2, "C": 0.6, "E": 0.4 + 0.45j}
        pulls = (PointLoad("rod B", "E", 50 - 90j, 3.0), LineLoad("arm", 0, 30 - 80j, 10 + 90j))
        mechanism = Mechanism(links, drives, drawing, sliders, gravity=-9.81j, loads=pulls)
        at = np.array([[0.3, 1.2, 2.2, -0.8, 0.9], [0.2, 0.1, 0.26, 0.7, 0.5], [0.6, 0.3, 0.74, 0.45, 0.75]])
        turning = motion(mechanism, at, np.full_like(at, 2.0))
        sections = [Section(4e4, 200.0, 3e3, 1e-3), Section(2e4, 90.0), Section(3e4, 120.0)]
        exact = deflection(turning, sections)
        for elements in (1, 2, 16):
            assert compare(exact, solve(turning, sections, elements)).relative.max() < 1e-12

    def test_one_matrix_with_a_node_at_the_block(self):
        case = sheared(elastic_guide())
        turning = motion_of(case)
        found = solve(turning, case.sections, 3)
        for position in (0, 9):
            assert_same(found, Direct(turning, case.sections, position, 3), position)

    def test_a_tapered_beam_under_a_block_converges_with_fourth_order(self):
        """Displacement at a driven soft block: F int (a - x)^2/EI + F int 1/kGA."""
        fall, at = 0.6, 0.37 * LENGTH
        section = Section(EA, EI, KGA, taper=Taper(*[(1.0, -fall)] * 3))
        with mpmath.workdps(30):

            def rigidity(x):
                return 1 - fall * x / LENGTH

            bend = mpmath.quad(lambda x: (FORCE.imag * (at - x) + MOMENT) / (EI * rigidity(x)), [0, at])
            w = mpmath.quad(
                lambda x: (
                    (FORCE.imag * (at - x) + MOMENT) * (LENGTH - x) / (EI * rigidity(x))
                    + FORCE.imag / (KGA * rigidity(x))
                ),
                [0, at],
            )
        errors = []
        for n in (8, 16, 32, 64):
            found = solve(on_an_arm(np.array([at])), [section], n)
            errors.append([abs(found.w[0, 0, -1] / float(w) - 1), abs(found.phi[0, 0, -1] / float(bend) - 1)])
        assert max(errors[-1]) < 1e-7
        assert (orders([max(row) for row in errors[::3]]) > 3 * 3.5).all()

    def test_a_block_beyond_its_beam_is_unknown(self):
        turning = on_an_arm(np.array([0.2, 0.5, 1.01]) * LENGTH)
        found = solve(turning, [Section(EA, EI)])
        np.testing.assert_array_equal(np.isnan(found.w[0]).any(axis=1), [False, False, True])
        comparison = compare(deflection(turning, [Section(EA, EI)]), found)
        assert comparison.passed
        assert comparison.compared == 2

    def test_only_positions_beyond_a_short_lever_are_unknown(self):
        case = elastic_guide()
        *others, lever = case.mechanism.links
        short = replace(lever, points={"D": 0.0, "F": 0.3 * np.exp(0.4j)})
        case = case.with_(links=(*others, short))
        turning = motion_of(case)
        away = np.abs(
            turning.origin[turning.mechanism.index["rod"]] - turning.origin[turning.mechanism.index["rocker"]]
        )
        comparison = compare(deflection(turning, case.sections), solve(turning, case.sections, 4))
        assert 0 < (away > 0.3).sum() < len(away)
        assert comparison.compared == (away <= 0.3).sum()
        assert comparison.relative.max() < 1e-12

    def test_a_slider_without_a_beam_is_an_error(self):
        turning = on_an_arm()
        aside = replace(turning.mechanism.sliders[0], origin=0.1j)
        links = turning.mechanism.links
        mechanism = Mechanism(links, turning.mechanism.drives, turning.mechanism.drawing, (aside,))
        with pytest.raises(MechanismError, match='slider "guide": no beam of "arm" lies along its line'):
            solve(motion(mechanism, turning.drive), [Section(EA, EI)])


class TestSoftJoints:
    @pytest.mark.parametrize(
        ("make", "joints"),
        [
            (four_bar, {"A": (1e-6, 0.0, 2e-5 + 1e-5j, 0.0), "O": (2e-6, 3e-4, 0.0, 1e-3), "B": (3e-6,)}),
            (slider_crank, {"guide": (1e-6, 1e-4, 2e-5 + 1e-5j, 1e-4), "O": (2e-6, 3e-4)}),
            (pressed, {"guide": (1e-6, 1e-4, 2e-5 + 1e-5j, 1e-4), "A": (2e-6,)}),
            (elastic_guide, {"guide": (1e-6, 1e-4, 2e-5 + 1e-5j, 1e-4)}),
            (bush, {"bush": (1e-6, 1e-4, 2e-5 + 1e-5j, 1e-4), "B": (0.0, 0.0, 1e-4j)}),
            (held_arm, {"A": (1e-6, 1e-4, 2e-5 + 1e-5j, 1e-4)}),
        ],
    )
    def test_closed_forms_agree(self, make, joints):
        case, soft = make(), {name: JointCompliance(*values) for name, values in joints.items()}
        turning = motion_of(case)
        found = solve(turning, case.sections, 4, soft)
        assert compare(deflection(turning, case.sections, joints=soft), found).relative.max() < 1e-12
        stiff = solve(turning, case.sections, 4)
        assert np.abs(found.w - stiff.w).max() > 1e-3 * np.abs(found.w).max()

    def test_an_ambiguous_joint_name_is_an_error(self):
        case = four_bar()
        with pytest.raises(ValueError, match='no joint is named "X"'):
            solve(motion_of(case), case.sections, joints={"X": JointCompliance(1e-6)})
        links = (
            Link("ground", {"O": 0.0, "D": 0.4, "E": 0.2 - 0.3j}),
            Link("crank", {"O": 0.0, "A": 0.1}),
            *(Link(f"rod {end}", {"A": 0.0, end: 0.3}) for end in "BC"),
            Link("rocker", {"D": 0.0, "B": 0.25}),
            Link("swing", {"E": 0.0, "C": 0.25}),
        )
        drawing = {"O": 0.0, "A": 0.1, "B": 0.3 + 0.22j, "D": 0.4, "C": 0.36 - 0.12j, "E": 0.2 - 0.3j}
        three = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), [0.0])
        with pytest.raises(ValueError, match='2 joints are named "A"'):
            solve(three, [], joints={"A": JointCompliance(1e-6)})


PLACES = {
    "O": 0.0,
    "P": 0.05,
    "W": 0.2,
    "A": 0.3,
    "B": 0.46 + 0.23j,
    "D": 0.55,
    "R": 0.05,
    "F": 0.15 + 0.05j,
    "S": 0.08,
}
GUIDE = Slider("guide", "rack", "ground", "R", 0.05, 1.0)
STEPS = np.linspace(0.0, 6.0, 7)


def geared(links, drives, gear, sliders, steps, rate):
    """Return a four-bar with links clamped apart from their geared joints, and the gears."""
    four = (bar("wheel", "A", "W", 0.1, 0.4), bar("coupler", "A", "B", 0.3, 0.4), bar("rocker", "B", "D", 0.25, 0.4))
    ground = Link("ground", {"O": 0.0, "W": 0.2, "D": 0.55})
    drawing = {name: PLACES[name] for link in (ground, *four, *links) for name in link.points}
    mechanism = Mechanism((ground, *four, *links), drives, drawing, sliders, gears=(gear,), gravity=-9.81j)
    return motion(mechanism, steps, rate)


class TestGears:
    RACK = Link("rack", {"F": 0.0, "R": -0.1 - 0.05j}, (Beam("F", "R", 0.4),), (Lump("F", 0.4),))

    CASES = {  # noqa: RUF012
        "wheels": (
            (bar("pinion", "P", "O", 0.05, 0.4),),
            (PinDrive("pinion", "O"),),
            Gear(PinDrive("pinion", "O"), PinDrive("wheel", "W"), -0.5),
            (),
            -2 * STEPS,
            -100.0,
        ),
        "a rack is driven": (
            (RACK,),
            (PinDrive("wheel", "W"),),
            Gear(PinDrive("rocker", "D"), SliderDrive("guide"), 0.04),
            (GUIDE,),
            STEPS,
            100.0,
        ),
        "a rack drives": (
            (RACK,),
            (SliderDrive("guide"),),
            Gear(SliderDrive("guide"), PinDrive("wheel", "W"), 25.0),
            (GUIDE,),
            STEPS / 25,
            4.0,
        ),
        "a wheel on an arm drives": (
            (bar("arm", "O", "P", 0.05, 0.4), bar("planet", "P", "S", 0.03, 0.4)),
            (PinDrive("arm", "O"), PinDrive("planet", "P", "arm")),
            Gear(PinDrive("planet", "P", "arm"), PinDrive("wheel", "W"), -0.5),
            (),
            np.array([0.3 * STEPS, -2 * STEPS]),
            [[20.0], [-100.0]],
        ),
    }

    @pytest.mark.parametrize("name", CASES)
    def test_closed_forms_agree(self, name):
        turning = geared(*self.CASES[name])
        sections = [Section(12.6e6, 37.8 * (1 + k)) for k in range(len(turning.mechanism.beams))]
        for soft in ({}, {"W": JointCompliance(1e-6, 1e-4)}):
            found = solve(turning, sections, 4, soft)
            comparison = compare(deflection(turning, sections, joints=soft), found)
            assert comparison.relative.max() < 1e-12, soft
            efforts = drive_efforts(turning, deflection(turning, sections, joints=soft).forces)
            np.testing.assert_allclose(found.efforts, efforts, rtol=0, atol=1e-12 * np.abs(efforts).max())


def test_sections_of_several_designs_share_a_motion():
    case = four_bar()
    soft = [replace(s, kGA=np.array([[1e4], [1e5]]), EI=s.EI * np.array([[1.0], [2.0]])) for s in case.sections]
    found = solve(motion_of(case), soft, 4)
    assert compare(deflection(motion_of(case), soft), found).passed
    one = [replace(s, kGA=1e5, EI=2 * s.EI) for s in case.sections]
    np.testing.assert_allclose(found.w[:, 1], solve(motion_of(case), one, 4).w, rtol=0, atol=1e-15)


def test_mass_of_any_degree_is_included():
    """Mass m x^5 on a rotating rod: axial force m w^2 l^2 (1 - x^7)/7."""
    rod = Link("rod", {"O": 0.0, "A": 2.0}, (Beam("O", "A", 3.0, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),))
    turning = Mechanism((Link("ground", {"O": 0.0}), rod), (PinDrive("rod", "O"),), {"O": 0.0, "A": 2.0})
    found = solve(motion(turning, [0.3], 4.0), [Section(5e5, 1.0)])
    pull = 3.0 * 4.0**2 * 2.0**2 / 7
    np.testing.assert_allclose(found.N[0, 0], pull * (1 - found.xi**7), rtol=0, atol=1e-13 * pull)


def test_fields_of_a_ring_are_right_for_any_rigidities():
    """The rigidities differ by up to a factor of a million."""
    case, generator = ring(), np.random.default_rng(7)
    few = replace(case, drive=case.drive[:, ::8], rate=case.rate[:, ::8], rate2=case.rate2[:, ::8])
    for _ in range(40):
        factors = 10 ** generator.uniform(-3, 3, (2, len(case.sections)))
        mixed = [
            replace(s, EA=s.EA * EA_factor, EI=s.EI * EI_factor)
            for s, EA_factor, EI_factor in zip(case.sections, *factors, strict=True)
        ]
        comparison = compare(deflection(motion_of(few), mixed), solve(motion_of(few), mixed, 4))
        assert comparison.relative.max() < 1.5e-12, dict(zip(PRIMARY, comparison.relative.max(axis=1), strict=True))
