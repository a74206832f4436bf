"""Structure of mechanisms: mobility, redundancy, groups."""

import signal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanisms import drawn_bar, four_bar_linkage, linkage, slider_crank_linkage, three_cranks
from msgspec.structs import replace

from kinelast import SceneError, scene_from_text
from rigid import Link, Mechanism, MechanismError, PinDrive, Posture, Slider, SliderDrive, assur_groups, motion, posture
from rigid.closures.forces import self_stresses
from rigid.topology import (
    Contact,
    assembled,
    flat_triangles,
    link_motions,
    mechanism_mobility,
    mobility,
    mobility_count,
    pairs,
    planar_chain,
    self_stress,
    static_matrix,
    stressed_joints,
    velocity_law,
)

# Ranks -------------------------------------------------------------------------------------------------------


def freedoms(chain):
    found = mobility(chain)
    assert found.sides_agree
    assert found.index == found.kinematic_unknowns - found.kinematic_equations
    return int(found.mobility), int(found.hyperstaticity)


class TestRanks:
    def test_four_bar_and_slider_crank(self):
        for mechanism in (four_bar_linkage(), slider_crank_linkage()):
            found = mechanism_mobility(mechanism)
            assert (int(found.mobility), int(found.hyperstaticity), found.loops) == (1, 0, 1)
            assert found.sides_agree

    def test_at_many_positions_at_once(self):
        mechanism = four_bar_linkage()
        turning = motion(mechanism, np.linspace(0, 2 * np.pi, 9))
        found = mobility(planar_chain(posture(turning)))
        np.testing.assert_array_equal(found.mobility, np.ones(9))
        np.testing.assert_array_equal(found.hyperstaticity, np.zeros(9))
        assert found.sides_agree

    def test_flat_parallelogram_has_a_second_freedom(self):
        places = {"O": 0, "A": 0.1, "B": 0.4, "D": 0.3}
        bars = (("crank", "O", "A"), ("coupler", "A", "B"), ("rocker", "D", "B"))
        flat = Posture(linkage(places, "OD", bars), np.array([0, 0, 0.1, 0.3]), np.ones(4))
        assert freedoms(planar_chain(flat)) == (2, 1)

    def test_rolling_wheels_move_although_the_count_is_zero(self):
        wheels = Mechanism(
            (Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {"O": 0, "D": 3}
        )
        here = assembled(wheels)
        assert freedoms(planar_chain(here, [Contact("mesh", "a", "b", 1.0)])) == (1, 1)
        assert freedoms(planar_chain(here, [Contact("mesh", "a", "b", 1.0 + 0.2j)])) == (0, 0)
        assert freedoms(planar_chain(here, [Contact("flanks", "a", "b", 1.0, np.exp(0.35j))])) == (1, 0)
        # Smooth discs press on each other along the line of centres and rotate freely.
        assert freedoms(planar_chain(here, [Contact("discs", "a", "b", 1.0, 1.0)])) == (2, 1)

    def test_rolling_wheels_have_the_ratio_of_their_radii(self):
        wheels = Mechanism(
            (Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {"O": 0, "D": 3}
        )
        modes = link_motions(planar_chain(assembled(wheels), [Contact("mesh", "a", "b", 1.0)]))
        assert modes[0, 1, 0] / modes[0, 0, 0] == pytest.approx(-0.5, abs=1e-14)

    def test_collinear_triangle_of_bars_is_found(self):
        places = {"O": 0, "A": 0.1, "B": 0.3, "D": 0.3 + 0.2j}
        bars = (("one", "O", "A"), ("two", "A", "B"), ("three", "O", "B"), ("arm", "D", "B"))
        mechanism = linkage(places, "OD", bars)
        assert flat_triangles(assembled(mechanism)) == (("one", "two", "three"),)
        assert freedoms(planar_chain(assembled(mechanism))) == (1, 1)
        upright = linkage({**places, "A": 0.1 + 0.05j}, "OD", bars)
        assert flat_triangles(assembled(upright)) == ()
        assert freedoms(planar_chain(assembled(upright))) == (0, 0)

    @settings(max_examples=30)
    @given(st.floats(-5, 5), st.floats(-3.1, 3.1), st.floats(-1e3, 1e3), st.booleans())
    def test_ranks_do_not_depend_on_units_and_axes(self, power, angle, away, redundant):
        mechanism = three_cranks() if redundant else four_bar_linkage()
        size = 10**power
        turn = np.exp(1j * angle)
        links = tuple(
            Link(
                link.name,
                {
                    name: size * (turn * (point + away) if link.name == "ground" else point)
                    for name, point in link.points.items()
                },
            )
            for link in mechanism.links
        )
        drawing = {name: size * turn * (place + away) for name, place in mechanism.drawing.items()}
        found = mechanism_mobility(replace(mechanism, links=links, drawing=drawing))
        assert (int(found.mobility), int(found.hyperstaticity)) == (1, int(redundant))
        assert found.kept > 1e-3
        assert found.dropped < 1e-11

    def test_disconnected_links_are_named(self):
        loose = linkage({"O": 0, "A": 1, "B": 2, "C": 3}, "O", (("arm", "O", "A"), ("two", "B", "C"), ("x", "C", "B")))
        with pytest.raises(MechanismError, match='no chain of joints connects "two", "x" to "ground"'):
            mechanism_mobility(loose)
        with pytest.raises(MechanismError, match="no joints"):
            mechanism_mobility(linkage({"O": 0, "A": 1, "B": 2}, "O", (("arm", "A", "B"),)))

    def test_positions_that_do_not_close_are_an_error(self):
        reaching = motion(four_bar_linkage(), np.linspace(0, 6, 5))
        lost = Posture(reaching.mechanism, np.where(np.arange(5) == 3, np.nan, reaching.origin), reaching.direction)
        with pytest.raises(MechanismError, match="does not close"):
            mobility(planar_chain(lost))


@st.composite
def trusses(draw):
    """Draw rigid pin-jointed trusses, with bars added or one bar removed.

    Two bars to a new joint keep m = h = 0. Each further bar adds a self-stress; a removed bar adds a mobility.
    """
    seed = draw(st.integers(0, 2**32 - 1))
    random = np.random.default_rng(seed)
    places = {"g0": 0j, "g1": 1 + 0.1j}
    bars = []
    for number in range(draw(st.integers(2, 7))):
        while True:
            one, other = random.choice(list(places), 2, replace=False)
            place = complex(*random.uniform(-1, 2, 2))
            arms = [places[one] - place, places[other] - place]
            near = min(abs(place - old) for old in places.values())
            sine = abs((arms[0].conjugate() * arms[1]).imag) / abs(arms[0] * arms[1])
            if near > 0.2 and sine > 0.3:
                break
        bars += [(one, f"p{number}"), (other, f"p{number}")]
        places[f"p{number}"] = place
    missing = draw(st.booleans())
    core = [name for name in places if name != f"p{number}"]
    spare = [
        (one, other)
        for at, one in enumerate(core)
        for other in core[at + 1 :]
        if {one, other} != {"g0", "g1"} and (one, other) not in bars and (other, one) not in bars
    ]
    extra = [spare[at] for at in random.permutation(len(spare))[: draw(st.integers(0, 3))]]
    if missing:
        bars.pop()
    named = [(f"b{at}", *ends) for at, ends in enumerate(bars + extra)]
    return linkage(places, ("g0", "g1"), named), int(missing), len(extra)


class TestTrusses:
    @settings(max_examples=60, deadline=None)
    @given(trusses())
    def test_maxwells_count_holds(self, truss):
        mechanism, free, surplus = truss
        here = assembled(mechanism)
        chain = planar_chain(here)
        assert freedoms(chain) == (free, surplus)
        assert mobility_count(mechanism) == free - surplus
        states = self_stress(chain)
        assert states.shape == (surplus, len(chain.graph.branches), 3)
        force = states[..., 1] + 1j * states[..., 2]
        for number, link in enumerate(mechanism.links[1:], 1):
            # Without load on a bar, its end forces are opposite and axial.
            total, pulls = np.zeros(surplus, complex), np.zeros(surplus, complex)
            for joint, branch in enumerate(chain.graph.branches):
                sign = (branch.end == link.name) * 1.0 - (branch.start == link.name) * 1.0
                total = total + sign * force[:, joint]
                if branch.name == next(iter(link.points)):
                    pulls = pulls + sign * force[:, joint]
            np.testing.assert_allclose(total, 0, atol=1e-10)
            np.testing.assert_allclose((np.conj(here.direction[number]) * pulls).imag, 0, atol=1e-10)
        for joint, branch in enumerate(chain.graph.branches):
            arm = here.point(branch.start, branch.name) - complex(*chain.center)
            moment = (np.conj(arm) * force[:, joint]).imag
            np.testing.assert_allclose(states[:, joint, 0], moment, atol=1e-10)
        size = (np.abs(force) ** 2 + (states[..., 0] / chain.length) ** 2).sum(axis=1)
        np.testing.assert_allclose(size, 1, rtol=1e-10)


# Redundant mechanisms ----------------------------------------------------------------------------------------


def forces_of(mechanism):
    """Return forces on the end link of each pair in the self-stress states, complex [N], shape (h, pairs)."""
    states = self_stress(planar_chain(assembled(mechanism)))
    return states[..., 1] + 1j * states[..., 2]


class TestThirdCrank:
    def test_one_mobility_one_redundancy(self):
        found = mechanism_mobility(three_cranks())
        assert (int(found.mobility), int(found.hyperstaticity), found.index) == (1, 1, 0)

    def test_exactly_the_joints_of_the_cranks_are_stressed(self):
        mechanism = three_cranks(extra=True)
        found = [pairs(mechanism)[number] for number in stressed_joints(planar_chain(assembled(mechanism)))]
        assert sorted(pair.name for pair in found) == sorted("ODGABC")
        assert all("rod" not in (pair.start, pair.end) for pair in found)

    @settings(max_examples=20, deadline=None)
    @given(st.floats(0.05, 0.3), st.floats(0.35, 1.0))
    def test_cranks_stress_the_coupler_by_the_lever_law(self, a, b):
        mechanism = three_cranks(a, b)
        forces = forces_of(mechanism)
        names = [pair.name for pair in pairs(mechanism)]
        along = (0.05 + 0.09j) / abs(0.05 + 0.09j)
        ends = [pair.end for pair in pairs(mechanism)]
        held = np.array([forces[0, names.index(p)] * (1 if ends[names.index(p)] == "coupler" else -1) for p in "ABC"])
        pulls = (np.conj(along) * held).real
        np.testing.assert_allclose((np.conj(along) * held).imag, 0, atol=1e-12)
        np.testing.assert_allclose(pulls / pulls[2], [(b - a) / a, -b / a, 1], rtol=1e-11)

    def test_forces_by_groups_agree_with_the_self_stress(self):
        mechanism = three_cranks(extra=True)
        still = motion(mechanism, [np.angle(0.05 + 0.09j)])
        (held,) = self_stresses(still.closures)
        by_group = {}
        for joint, force in zip(still.structure.joints, held.force, strict=True):
            by_group[joint.name, mechanism.links[joint.child].name] = complex(np.ravel(force)[0])
        ours = {
            (pair.name, pair.end): force for pair, force in zip(pairs(mechanism), forces_of(mechanism)[0], strict=True)
        }
        scale = by_group["G", "third"] / ours["G", "third"]
        for point, link in (("O", "first"), ("D", "second"), ("G", "third"), ("E", "arm")):
            assert by_group[point, link] == pytest.approx(scale * ours[point, link], abs=1e-12)

    def test_an_inexact_drawing_is_assembled_and_found_redundant(self):
        exact = three_cranks()
        rough = {name: place + 0.004 * (-1) ** n * (1 + 0.5j) for n, (name, place) in enumerate(exact.drawing.items())}
        mechanism = replace(exact, drawing=rough)
        here = assembled(mechanism)
        for crank, center, end in (("first", "O", "A"), ("second", "D", "B"), ("third", "G", "C")):
            assert abs(here.point(crank, end) - here.point("coupler", end)) < 1e-14
            assert abs(here.point(crank, center) - here.point("ground", center)) < 1e-14
        assert freedoms(planar_chain(here)) == (1, 1)

    def test_a_third_crank_of_another_length_cannot_move(self):
        places = dict(three_cranks().drawing)
        places["G"] = 0.37 + 0.03j
        mechanism = replace(three_cranks(), drawing=places)
        shorter = tuple(
            drawn_bar("third", "G", "C", places) if link.name == "third" else replace_point(link, "G", places["G"])
            for link in mechanism.links
        )
        found = mechanism_mobility(replace(mechanism, links=shorter))
        assert (int(found.mobility), int(found.hyperstaticity)) == (0, 0)

    def test_the_error_names_the_open_joint(self):
        long = replace(four_bar_linkage(), links=(*four_bar_linkage().links[:3], Link("rocker", {"D": 0.0, "B": 9.0})))
        with pytest.raises(MechanismError, match=r'does not close near its drawing: pin "\w" of "\w+" and "\w+"'):
            assembled(long)
        with pytest.raises(MechanismError, match='link "rocker": none of its points is drawn'):
            assembled(replace(four_bar_linkage(), drawing={"O": 0, "A": 0.1j}))

    @pytest.mark.parametrize("off", [0.02, -0.03, 0.02j])
    def test_a_slider_on_a_moving_link_is_assembled(self, off):
        links = (
            Link("ground", {"O": 0, "D": -0.2j}),
            Link("crank", {"O": 0, "A": 0.1}),
            Link("block", {"A": 0}),
            Link("lever", {"D": 0, "T": 0.5}),
        )
        slot = Slider("slot", "block", "lever", "A", 0.05 + 0.01j, 1.0)
        drawing = {"O": 0, "A": 0.1 + off, "D": -0.2j, "T": 0.2 + 0.2j}
        here = assembled(Mechanism(links, (PinDrive("crank", "O"),), drawing, (slot,)))
        way = here.point("block", "A") - here.point("lever", "D")
        assert (np.conj(here.direction[3]) * way).imag == pytest.approx(0.01, abs=1e-15)
        assert here.direction[2] == pytest.approx(here.direction[3], abs=1e-14)

    def test_a_slider_is_moved_to_its_line(self):
        drawn = {**slider_crank_linkage().drawing, "B": 0.29 - 0.01j}
        here = assembled(replace(slider_crank_linkage(), drawing=drawn))
        assert here.point("piston", "B").imag == pytest.approx(0.02, abs=1e-15)
        assert abs(here.point("rod", "B") - here.point("piston", "B")) < 1e-15
        assert here.direction[here.mechanism.index["piston"]] == pytest.approx(1, abs=1e-15)


def replace_point(link, point, place):
    return replace(link, points={**link.points, point: place}) if point in link.points else link


# Groups ------------------------------------------------------------------------------------------------------


class TestAssurGroups:
    def test_dyads_by_their_pairs(self):
        assert [g.name for g in assur_groups(four_bar_linkage())] == ["driven link", "dyad RRR, class II"]
        assert [g.name for g in assur_groups(slider_crank_linkage())] == ["driven link", "dyad RRP, class II"]
        links = (
            Link("ground", {"O": 0, "D": -0.2j}),
            Link("crank", {"O": 0, "A": 0.1}),
            Link("block", {"A": 0}),
            Link("lever", {"D": 0, "T": 0.5}),
        )
        guide = Slider("slot", "block", "lever", "A", 0, 1.0)
        shaper = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": 0.1, "D": -0.2j}, (guide,))
        assert [g.name for g in assur_groups(shaper)] == ["driven link", "dyad RPR, class II"]

    def test_ternary_link_on_three_bars_is_of_class_three(self):
        places = {"O": 0, "A": 0.1, "D": 0.5, "G": 0.3 + 0.8j, "B": 0.2 + 0.3j, "C": 0.5 + 0.3j, "E": 0.3 + 0.5j}
        bars = (("crank", "O", "A"), ("one", "A", "B"), ("two", "D", "C"), ("three", "G", "E"))
        mechanism = linkage(places, "ODG", bars, [("plate", "BCE")], [PinDrive("crank", "O")])
        group = assur_groups(mechanism)[1]
        assert (group.name, group.order) == ("group of 4 links, class III", 3)
        assert set(group.links) == {"one", "two", "three", "plate"}

    def test_contour_of_four_links_is_of_class_four(self):
        places = {"O": 0, "A": 0.1, "D": 0.6, "B": 0.15 + 0.3j, "C": 0.2 + 0.1j, "E": 0.5 + 0.3j, "F": 0.5 + 0.15j}
        bars = (("crank", "O", "A"), ("top", "B", "E"), ("low", "C", "F"))
        mechanism = linkage(places, "OD", bars, [("left", "ABC"), ("right", "DEF")], [PinDrive("crank", "O")])
        assert mobility_count(mechanism) == 1
        group = assur_groups(mechanism)[1]
        assert (group.name, group.order) == ("group of 4 links, class IV", 2)

    def test_a_ram_counts_as_one_link(self):
        links = (
            Link("ground", {"O": 0, "D": 0.4}),
            Link("cylinder", {"O": 0, "T": 0.2}),
            Link("rod", {"A": 0, "S": -0.2}),
            Link("lever", {"D": 0, "A": 0.3}),
        )
        ram = Slider("ram", "rod", "cylinder", "A", 0, 1.0)
        drawing = {"O": 0, "D": 0.4, "A": 0.4 + 0.3j, "T": 0.14 + 0.1j}
        groups = assur_groups(Mechanism(links, (SliderDrive("ram"),), drawing, (ram,)))
        assert [(g.name, g.drives) for g in groups] == [("dyad RRR, class II", (0,))]

    def test_arm_of_two_drives_is_two_driven_links(self):
        drives = [PinDrive("upper", "O"), PinDrive("lower", "A", "upper")]
        arm = linkage({"O": 0, "A": 1, "P": 1 + 1j}, "O", (("upper", "O", "A"), ("lower", "A", "P")), drives=drives)
        assert [(g.name, g.drives) for g in assur_groups(arm)] == [("driven link", (0,)), ("driven link", (1,))]


class TestVelocityLaw:
    @given(st.floats(0.1, 3.0))
    @settings(max_examples=20, deadline=None)
    def test_of_an_offset_slider_crank(self, angle):
        r, rod, e = 0.1, abs(0.3 - 0.08j), 0.02
        mechanism = slider_crank_linkage()
        chain = planar_chain(assembled(replace(mechanism, drawing=drawn_slider_crank(r, rod, e, angle))))
        height = r * np.sin(angle) - e
        slope = -r * np.sin(angle) - height * r * np.cos(angle) / np.sqrt(rod**2 - height**2)
        np.testing.assert_allclose(velocity_law(chain, ["O"], ["guide"]), [[slope]], rtol=1e-10)
        np.testing.assert_allclose(velocity_law(chain, ["guide"], ["O"]), [[1 / slope]], rtol=1e-10)


def drawn_slider_crank(r, rod, e, angle):
    end = r * np.exp(1j * angle)
    return {"O": 0, "A": complex(end), "B": complex(end.real + np.sqrt(rod**2 - (end.imag - e) ** 2), e)}


class TestStaticSide:
    def test_transpose_holds_the_velocities_of_a_motion(self):
        turning = motion(four_bar_linkage(), [0.4], 3.0)
        chain = planar_chain(posture(turning))
        matrix = static_matrix(chain)[0]
        spin = turning.angular_velocity[1:, 0]
        velocity = (
            turning.velocity[1:, 0] + 1j * spin * (complex(*chain.center) - turning.origin[1:, 0])
        ) / chain.length
        twists = np.stack([spin, velocity.real, velocity.imag], axis=-1).ravel()
        np.testing.assert_allclose(matrix.T @ twists, 0, atol=1e-14 * np.abs(twists).max())


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no clock of the processor's time")
def test_thousands_of_loose_links_are_reported_at_once():
    """A search over all triples, five hundred million, would take minutes instead of a second."""

    def too_long(*_):
        raise AssertionError("looked at all triples")

    count = 1500
    links = "".join(f'[links.l{k}]\npoints = ["P{k}", "Q{k}"]\nrigid = true\nmass = 0\n' for k in range(count))
    points = "".join(f"P{k} = [{k}.0, 0.0]\nQ{k} = [{k}.0, 1.0]\n" for k in range(count))
    crank = '[links.ground]\npoints = ["P0"]\n'
    before = signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, 20.0)
    try:
        with pytest.raises(SceneError, match="l1499"):
            scene_from_text(f'[points]\n{points}{crank}{links}[[drives]]\nlink = "l0"\nspeed = 1\n')
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
