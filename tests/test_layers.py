"""Solid links do not pass through each other, and axles are short and pass only through the links they join."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from mechanisms import steel_bar
from test_animations import STEEL, turned

from animations import Style
from animations.diagrams import diagram_named
from animations.layers import layers, meet, reach, stacked
from animations.layout import drawable, scales_of
from animations.picture import stack_of
from animations.solid_mechanism import mechanism_bodies
from elastic import deflection as bend
from kinelast import deflection, load
from rigid import Link, Mechanism, PinDrive, Slider, motion, position_of

SHAPE = diagram_named("shape")
SOLID = Style(look="solid")


def stack(bent, style=SOLID):
    return stack_of(bent, scales_of(bent, SHAPE, style), style, drawable(bent, SHAPE))


def crossing(bent):
    """Return pairs of links whose straight beams cross at some position.

    The ends of each beam are then on both sides of the other.
    """
    places = [
        (at, position_of(bent.motion, at, beam.start), position_of(bent.motion, at, beam.end))
        for at, beam in bent.motion.mechanism.beams
    ]

    def separated(start, end, one, other):
        return (np.conj(end - start) * (one - start)).imag * (np.conj(end - start) * (other - start)).imag < -1e-14

    return {
        (i, j)
        for (i, *one), (j, *other) in combinations(places, 2)
        if i != j and np.any(separated(*one, *other) & separated(*other, *one))
    }


class TestOverlap:
    """Overlap of parts."""

    def test_parts_meet_if_they_overlap_at_some_position(self):
        still = reach(np.array([[0j, 1.0]] * 2), 0.1)
        passing = reach(np.array([[0.5 + 1j, 0.5 + 2j], [0.5 - 1j, 0.5 + 1j]]), 0.1)
        assert meet([still], [passing])
        assert not meet([still[:1]], [passing[:1]])
        assert not meet([still], [])

    @pytest.mark.parametrize("gap", [0.19, 0.21])
    def test_margins_are_added(self, gap):
        assert meet([reach(np.array([[0j]]), 0.1)], [reach(np.array([[gap * 1j]]), 0.1)]) == (gap < 0.2)

    def test_the_inside_of_a_corner_is_free(self):
        bent = [reach(np.array([[0j, 1.0]]), 0.05), reach(np.array([[0j, 1j]]), 0.05)]
        assert not meet(bent, [reach(np.array([[0.3 + 0.3j]]), 0.1)])  # inside the convex hull of both


class TestLayers:
    """Links that never meet can share a layer."""

    def test_an_axle_is_short(self):
        at = {place: reach(np.array([[place + 0j]]), 1.0) for place in (0, 10, 20)}
        bodies = [[], [at[0], at[10]], [at[0], at[20]], [at[10], at[20]]]  # each pair meets, in different positions
        for joined, place in (({1, 2}, 0), ({1, 3}, 10), ({2, 3}, 20)):
            found = layers(bodies, [(joined, at[place])])
            assert sorted(found) == [-1, 0, 1, 2]
            assert abs(np.diff([found[link] for link in joined])) == 1

    def test_an_axle_avoids_a_third_link(self):
        at = {place: reach(np.array([[place + 0j]]), 1.0) for place in (0, 10, 20)}
        bodies = [[], [at[0], at[10]], [at[0], at[20]], [at[0], at[10], at[20]]]
        about = [({1, 3}, at[10])] * 2 + [({2, 3}, at[20])] * 2  # shortest with link 3 in the middle
        assert sorted(layers(bodies, about)[1:3]) == [0, 2]
        assert sorted(layers(bodies, [*about, ({1, 2}, at[0])])[1:3]) != [0, 2]

    def test_a_link_on_the_ground_is_next_to_it(self):
        disc = [reach(np.array([[0j]]), 1.0)]
        assert layers([[], disc, disc], [({0, 2}, disc[0]), ({1, 2}, disc[0])]) == [-1, 1, 0]

    def test_links_that_never_meet_share_a_layer(self):
        far = [[reach(np.array([[10.0 * k + 0j]]), 1.0)] for k in range(3)]
        assert layers([[], *far], []) == [-1, 0, 0, 0]

    def test_the_thickness_of_a_layer_is_that_of_its_links(self):
        found = stacked([-1, 0, 1, 0, 2], [9.0, 1.0, 4.0, 2.0, 1.0])
        assert found.thick == [2.0, 2.0, 4.0, 2.0, 1.0]
        assert np.diff([found.middle[at] for at in (0, 1, 2, 4)]) == pytest.approx([2.4, 3.6, 3.0])
        assert found.middle[1] == found.middle[3]
        assert found.middle[1] == pytest.approx(-found.middle[4])


class TestMechanisms:
    """Layers of whole mechanisms."""

    @pytest.mark.slow
    def test_crossing_links_are_in_different_layers(self):
        bent = deflection(load("flapping_wing"))
        heights, pairs = stack(bent).middle, crossing(bent)
        assert len(pairs) == 2
        assert all(abs(heights[one] - heights[other]) > 0 for one, other in pairs)

    @pytest.mark.slow
    def test_joined_links_do_not_overlap_in_depth(self):
        bent = deflection(load("flap_bars"))
        found = stack(bent)
        for joint in bent.motion.structure.joints:
            one, other = joint.parent, joint.child
            least = (found.thick[one] + found.thick[other]) / 2
            assert abs(found.middle[one] - found.middle[other]) > least
        assert found.middle[0] == min(found.middle)

    def test_an_outline_belongs_to_its_link(self):
        links = (Link("ground", {"O": 0.0, "D": 1.0}), steel_bar("one", "O", "A", 0.1), steel_bar("two", "D", "B", 0.1))
        drives = PinDrive("one", "O"), PinDrive("two", "D")
        mechanism = Mechanism(links, drives, {"O": 0, "A": 0.1, "D": 1, "B": 1.1})
        bent = bend(motion(mechanism, np.zeros((2, 3))), [STEEL] * 2)
        apart = stack(bent).middle
        assert apart[1] == apart[2]
        wide = stack(bent, Style(look="solid", outlines={"one": [0, 1.2, 1.2 + 0.2j]})).middle
        assert wide[1] != wide[2]

    def test_joined_rigid_bodies_have_different_greys(self):
        bent = deflection(load("andrews_driven"))
        motion = diagram_named("motion")
        scales = scales_of(bent, motion, SOLID)
        found = stack_of(bent, scales, SOLID, drawable(bent, motion))
        bodies = [body for body in mechanism_bodies(bent, motion, scales, SOLID, found) if body.fill != "soft"]
        fills = {round(float(body.place(0)[0][:, 2].mean()), 9): set() for body in bodies}
        for body in bodies:
            if len(body.place(0)[0]) > 6 * 24:  # more corners than a round eye
                fills[round(float(body.place(0)[0][:, 2].mean()), 9)].add(body.fill)
        filled = [fill for _, fill in sorted(fills.items()) if fill]
        assert all(len(fill) == 1 for fill in filled)
        assert len(filled) >= 3
        assert all(one != other for one, other in pairwise(filled))

    def test_an_axle_spans_exactly_the_links_it_joins(self):
        """Crank, rod and piston: the bodies at pin A are the axle and the eyes of crank and rod."""
        links = (Link("ground", {"O": 0.0}), steel_bar("crank", "O", "A", 0.1), steel_bar("rod", "A", "B", 0.3),
                 Link("piston", {"B": 0.0}))  # fmt: skip
        guide = Slider("guide", "piston", "ground", "B", 0.0, 1.0)
        mechanism = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": 0.1, "B": 0.4}, sliders=(guide,))
        bent = turned(mechanism, [STEEL] * 2)
        scales = scales_of(bent, SHAPE, SOLID)
        found = stack(bent)
        bodies = [body.place(0)[0] for body in mechanism_bodies(bent, SHAPE, scales, SOLID, found)[1:]]
        about = [np.ptp(points[:, 2]) for points in bodies if abs(points[:, :2].mean(axis=0) - [0.1, 0]).max() < 0.01]
        between = abs(found.middle[1] - found.middle[2])
        assert len(about) == 3
        assert max(about) > between + 0.52 * (found.thick[1] + found.thick[2])
        assert max(about) < between + 0.6 * (found.thick[1] + found.thick[2])
