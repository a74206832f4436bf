"""What the structure of a mechanism is: graphs, counts, mobility, redundancy, groups."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid import (
    Branch,
    Contact,
    Graph,
    Link,
    Mechanism,
    MechanismError,
    PinDrive,
    Posture,
    Slider,
    SliderDrive,
    assembled,
    assur_groups,
    bar_graph,
    components,
    cyclomatic_number,
    flat_triangles,
    fundamental_loops,
    graph_from_incidence,
    incidence,
    kutzbach,
    link_graph,
    link_motions,
    loop_walk,
    mechanism_mobility,
    mobility,
    mobility_count,
    motion,
    pairs,
    planar_chain,
    posture,
    redundant_joints,
    self_stress,
    self_stress_forces,
    self_stresses,
    spanning_tree,
    static_matrix,
)


def bar(name, start, end, places):
    """A link of two points, as long as drawn."""
    return Link(name, {start: 0.0, end: abs(complex(places[end]) - complex(places[start]))})


def plate(name, points, places):
    """A link of several points, shaped as drawn, in axes of its own."""
    turn = np.exp(0.7j)
    return Link(name, {point: (complex(places[point]) - complex(places[points[0]])) * turn for point in points})


def linkage(places, ground, bars=(), plates=(), drives=(), sliders=()):
    links = [Link("ground", {point: complex(places[point]) for point in ground})]
    links += [bar(name, *ends, places) for name, *ends in bars]
    links += [plate(name, points, places) for name, points in plates]
    return Mechanism(tuple(links), tuple(drives), places, tuple(sliders))


FOUR_BAR = {"O": 0, "A": 0.06 + 0.08j, "B": 0.3 + 0.21j, "D": 0.35}


def four_bar(**changes):
    bars = (("crank", "O", "A"), ("coupler", "A", "B"), ("rocker", "D", "B"))
    return replace(linkage(FOUR_BAR, "OD", bars, drives=[PinDrive("crank", "O")]), **changes)


def slider_crank():
    places = {"O": 0, "A": 0.1j, "B": 0.3 + 0.02j}
    links = linkage(places, "O", (("crank", "O", "A"), ("rod", "A", "B"))).links
    guide = Slider("guide", "piston", "ground", "B", 0.02j, 1.0)
    return Mechanism((*links, Link("piston", {"B": 0.0})), (PinDrive("crank", "O"),), places, (guide,))


def three_cranks(a=0.13, b=0.37, extra=False):
    """A parallelogram with a third crank, and on request a dyad on its second coupler joint."""
    lean = 0.05 + 0.09j
    places = {"O": 0, "D": a, "G": b, "A": lean, "B": a + lean, "C": b + lean, "P": 0.1 + 0.3j, "E": 0.5 + 0.1j}
    bars = [("first", "O", "A"), ("second", "D", "B"), ("third", "G", "C")]
    if extra:
        bars += [("rod", "B", "P"), ("arm", "E", "P")]
    ground = "ODGE" if extra else "ODG"
    return linkage(places, ground, bars, [("coupler", "ABC")], [PinDrive("first", "O")])


# The graph after Scutaru, Vlase and Marin ------------------------------------------------------------------

BARS = [(4, 1), (1, 2), (2, 3), (3, 4), (3, 5), (5, 4), (3, 6), (9, 10), (10, 4), (5, 6), (6, 7), (7, 8), (8, 9)]
BARS += [(8, 10), (5, 9)]
FLAP_TREE = [number - 1 for number in (2, 3, 4, 5, 8, 10, 11, 12, 13)]
FLAP_LOOPS = [
    (2, 3, 4, 1),
    (-4, 5, 6),
    (-5, -10, 7),
    (-4, 5, 8, 10, 11, 12, 13, 9),
    (-8, -13, 14),
    (-10, -11, -12, -13, 15),
]


def numbered(bars, nodes):
    branches = tuple(Branch(str(n), str(start), str(end)) for n, (start, end) in enumerate(bars, 1))
    return Graph(branches, tuple(str(node) for node in range(1, nodes + 1)))


def signed(loops, branches):
    matrix = np.zeros((len(loops), branches), int)
    for row, loop in zip(matrix, loops, strict=True):
        for number in loop:
            row[abs(number) - 1] = math.copysign(1, number)
    return matrix


def flap_columns():
    """Equation (3) as printed: the entries of every column, (node, sign)."""
    columns = [[(start, 1), (end, -1)] for start, end in BARS]
    columns[8] = [(4, 1), (10, 1)]
    return columns


def as_matrix(columns, nodes):
    matrix = np.zeros((nodes, len(columns)), int)
    for number, column in enumerate(columns):
        for node, sign in column:
            matrix[node - 1, number] = sign
    return matrix


class TestFlapMechanismOfSource:
    def test_incidence_matrix_with_branch_9_from_10_to_4(self):
        columns = flap_columns()
        columns[8] = [(4, -1), (10, 1)]
        np.testing.assert_array_equal(incidence(numbered(BARS, 10)), as_matrix(columns, 10))
        assert np.linalg.matrix_rank(incidence(numbered(BARS, 10))) == 9

    def test_incidence_matrix_as_printed_is_no_graph(self):
        printed = as_matrix(flap_columns(), 10)
        assert np.linalg.matrix_rank(printed) == 10
        with pytest.raises(MechanismError, match='branch "9" leaves 2'):
            graph_from_incidence(printed)

    def test_fundamental_loops(self):
        graph = numbered(BARS, 10)
        assert cyclomatic_number(graph) == 6
        np.testing.assert_array_equal(fundamental_loops(graph, FLAP_TREE), signed(FLAP_LOOPS, 15))

    def test_printed_loops_fit_only_without_their_tenth_entry(self):
        headings = [2, 3, 4, 5, 8, 10, 11, 12, 13, 1, 6, 7, 9, 14, 15]
        ours = fundamental_loops(numbered(BARS, 10), FLAP_TREE)[:, [number - 1 for number in headings]]
        printed = np.array(
            [
                [1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0],
                [0, 0, -1, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0],
                [0, 0, 0, -1, 0, -1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0],
                [0, 0, -1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 1, 0, 0],
                [0, 0, 0, 0, -1, 0, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0],
                [0, 0, 0, 0, 0, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 1],
            ]
        )
        np.testing.assert_array_equal(np.delete(printed, 9, axis=1), ours)
        assert all((np.delete(printed, lost, axis=1) != ours).any() for lost in range(9))

    def test_graph_from_its_incidence_matrix(self):
        graph = numbered(BARS, 10)
        assert graph_from_incidence(incidence(graph)) == graph

    def test_as_plates_it_has_the_same_bars(self):
        places = dict(
            zip("1234567890", (0, 1j, 2 + 2j, 2, 4 + 1j, 4 + 2.4j, 5 + 4j, 7 + 3j, 6 + 1j, 7 + 0.2j), strict=True)
        )
        bars = (("crank", "1", "2"), ("rod", "2", "3"), ("link", "5", "9"), ("flap", "6", "7"), ("arm", "7", "8"))
        plates = (("front", "4356"), ("rear", "089"))
        mechanism = linkage(places, "140", bars, plates)
        graph = bar_graph(mechanism)
        wanted = sorted(tuple(sorted((str(start % 10), str(end % 10)))) for start, end in BARS)
        assert sorted(tuple(sorted((branch.start, branch.end))) for branch in graph.branches) == wanted
        assert cyclomatic_number(graph) == 6
        found = mechanism_mobility(mechanism)
        assert (int(found.mobility), int(found.hyperstaticity)) == (1, 0)


class TestExamplesOfSource:
    def test_four_bar(self):
        graph = numbered([(1, 2), (2, 3), (3, 4), (4, 1)], 4)
        np.testing.assert_array_equal(incidence(graph), [[1, 0, 0, -1], [-1, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1]])
        np.testing.assert_array_equal(fundamental_loops(graph), [[1, 1, 1, 1]])

    def test_three_loops(self):
        matrix = np.array(
            [
                [1, 0, 0, -1, 0, 0, 0, 0, 0],
                [-1, 1, 0, 0, 0, -1, 0, 0, 0],
                [0, -1, 1, 0, 1, 0, 0, 0, 0],
                [0, 0, -1, 1, 0, 0, 0, 0, -1],
                [0, 0, 0, 0, -1, 1, 1, 0, 0],
                [0, 0, 0, 0, 0, 0, -1, 1, 0],
                [0, 0, 0, 0, 0, 0, 0, -1, 1],
            ]
        )
        graph = graph_from_incidence(matrix)
        np.testing.assert_array_equal(incidence(graph), matrix)
        printed = np.array(
            [[1, 1, 1, 1, 0, 0, 0, 0, 0, 0], [0, 1, 0, 0, 1, 1, 0, 0, 0, 0], [0, 0, -1, 0, 1, 0, 1, 1, 1, 1]]
        )
        tree = [number - 1 for number in (2, 3, 4, 5, 8, 9)]
        np.testing.assert_array_equal(fundamental_loops(graph, tree), printed[:, :9])
        assert (printed[:, 1:] != fundamental_loops(graph, tree)).any()


@st.composite
def graphs(draw):
    nodes = draw(st.integers(2, 8))
    ends = st.tuples(st.integers(1, nodes), st.integers(1, nodes)).filter(lambda pair: pair[0] != pair[1])
    return numbered(draw(st.lists(ends, min_size=1, max_size=14)), nodes)


class TestAnyGraph:
    @given(graphs(), st.randoms(use_true_random=False))
    def test_loops_are_closed_independent_and_complete(self, graph, random):
        order = list(range(len(graph.branches)))
        random.shuffle(order)
        tree = spanning_tree(graph, order)
        loops = fundamental_loops(graph, tree)
        assert not (incidence(graph) @ loops.T).any()
        assert set(np.unique(loops)) <= {-1, 0, 1}
        chords = [number for number in range(len(graph.branches)) if number not in tree]
        np.testing.assert_array_equal(loops[:, chords], np.eye(len(chords)))
        rank = np.linalg.matrix_rank(incidence(graph)) if graph.branches else 0
        assert len(tree) == rank == len(graph.nodes) - len(components(graph))
        assert len(loops) == cyclomatic_number(graph) == len(graph.branches) - rank

    @given(graphs())
    def test_walk_round_a_loop_meets_every_branch_end_to_end(self, graph):
        for loop in fundamental_loops(graph):
            walk = loop_walk(graph, loop)
            assert sorted(number for number, _ in walk) == list(np.flatnonzero(loop))
            ways = [(branch.start, branch.end)[::sign] for branch, sign in ((graph.branches[n], s) for n, s in walk)]
            assert all(one[1] == other[0] for one, other in zip(ways, ways[1:] + ways[:1], strict=True))

    def test_what_is_no_graph_is_refused(self):
        with pytest.raises(MechanismError, match='branch "1": there is no node "B"'):
            Graph((Branch("1", "A", "B"),), ("A",))
        with pytest.raises(MechanismError, match='branch "1" begins and ends at "A"'):
            Graph((Branch("1", "A", "A"),))
        with pytest.raises(MechanismError, match="1, 2, 3 are no spanning tree"):
            fundamental_loops(numbered([(1, 2), (2, 3), (3, 1), (3, 4)], 4), [0, 1, 2])
        with pytest.raises(MechanismError, match="1, 2 are no spanning tree of 4 nodes"):
            fundamental_loops(numbered([(1, 2), (2, 3), (3, 1), (3, 4)], 4), [0, 1])


class TestGraphsOfMechanism:
    def test_slider_is_a_branch_of_both_graphs(self):
        links, bars = link_graph(slider_crank()), bar_graph(slider_crank())
        assert [(b.name, b.start, b.end) for b in links.branches] == [
            ("O", "ground", "crank"),
            ("A", "crank", "rod"),
            ("B", "rod", "piston"),
            ("guide", "ground", "piston"),
        ]
        assert [(b.name, b.start, b.end) for b in bars.branches] == [
            ("ground O-guide", "O", "guide"),
            ("crank", "O", "A"),
            ("rod", "A", "B"),
            ("guide", "guide", "B"),
        ]
        assert cyclomatic_number(links) == cyclomatic_number(bars) == 1

    def test_three_links_on_a_pin_are_two_pairs_and_keep_a_driven_one(self):
        places = {"O": 0, "A": 1, "B": 1 + 1j, "C": 2}
        bars = (("one", "O", "A"), ("two", "A", "B"), ("three", "A", "C"))
        mechanism = linkage(places, "O", bars, drives=[PinDrive("three", "A", "two")])
        found = [(pair.start, pair.end, pair.drive) for pair in pairs(mechanism) if pair.name == "A"]
        assert found == [("two", "three", 0), ("one", "two", None)]

    def test_open_chain_has_no_loop_and_all_its_bars(self):
        arm = linkage({"O": 0, "A": 1, "P": 1 + 1j}, "O", (("upper", "O", "A"), ("lower", "A", "P")))
        assert cyclomatic_number(link_graph(arm)) == 0
        assert [branch.name for branch in bar_graph(arm).branches] == ["upper", "lower"]


# Counts of the course chapter --------------------------------------------------------------------------------


class TestCounts:
    @pytest.mark.parametrize(("joints", "links", "loops"), [(8, 6, 3), (13, 11, 3), (6, 5, 2)])
    def test_cyclomatic_number(self, joints, links, loops):
        ring = [(number, number % links + 1) for number in range(1, links + 1)]
        chords = [(1, 3), (2, 4), (3, 5)][: joints - links]
        assert cyclomatic_number(numbered(ring + chords, links)) == loops

    def test_hood_has_two_independent_loops_of_its_three(self):
        hood = numbered([(1, 2), (2, 6), (6, 5), (5, 1), (2, 3), (3, 4), (4, 5)], 6)
        assert cyclomatic_number(hood) == 2
        three = signed([(1, 2, 3, 4), (1, 5, 6, 7, 4), (5, 6, 7, -3, -2)], 7)
        assert not (incidence(hood) @ three.T).any()
        assert np.linalg.matrix_rank(three) == 2

    @pytest.mark.parametrize(
        ("count", "links", "one", "two"),
        [(1, 4, 4, 0), (1, 6, 7, 0), (-1, 4, 5, 0), (0, 3, 3, 0), (1, 3, 2, 1)],
    )
    def test_kutzbach(self, count, links, one, two):
        assert kutzbach(links, one, two) == count

    def test_count_of_a_mechanism_takes_multiple_pins_sliders_and_contacts(self):
        assert mobility_count(slider_crank()) == 1
        assert mobility_count(three_cranks()) == 0
        wheels = Mechanism((Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {})
        assert mobility_count(wheels) == 2
        assert mobility_count(wheels, [Contact("mesh", "a", "b", 1.0)]) == 0
        assert mobility_count(wheels, [Contact("cam", "a", "b", 1.0, 1.0)]) == 1


# Ranks -------------------------------------------------------------------------------------------------------


def freedoms(chain):
    found = mobility(chain)
    assert found.sides_agree
    assert found.index == found.kinematic_unknowns - found.kinematic_equations
    return int(found.mobility), int(found.hyperstaticity)


class TestRanks:
    def test_four_bar_and_slider_crank(self):
        for mechanism in (four_bar(), slider_crank()):
            found = mechanism_mobility(mechanism)
            assert (int(found.mobility), int(found.hyperstaticity), found.loops) == (1, 0, 1)
            assert found.sides_agree

    def test_at_many_positions_at_once(self):
        mechanism = four_bar()
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

    def test_rolling_wheels_turn_though_they_count_zero(self):
        wheels = Mechanism(
            (Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {"O": 0, "D": 3}
        )
        here = assembled(wheels)
        assert freedoms(planar_chain(here, [Contact("mesh", "a", "b", 1.0)])) == (1, 1)
        assert freedoms(planar_chain(here, [Contact("mesh", "a", "b", 1.0 + 0.2j)])) == (0, 0)
        assert freedoms(planar_chain(here, [Contact("flanks", "a", "b", 1.0, np.exp(0.35j))])) == (1, 0)
        # Smooth discs press on each other through both centers and turn as they like.
        assert freedoms(planar_chain(here, [Contact("discs", "a", "b", 1.0, 1.0)])) == (2, 1)

    def test_rolling_wheels_turn_by_the_ratio_of_their_radii(self):
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
    def test_units_and_axes_do_not_matter(self, power, angle, away, redundant):
        mechanism = three_cranks() if redundant else four_bar()
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

    def test_links_that_nothing_holds_are_named(self):
        loose = linkage({"O": 0, "A": 1, "B": 2, "C": 3}, "O", (("arm", "O", "A"), ("two", "B", "C"), ("x", "C", "B")))
        with pytest.raises(MechanismError, match='no chain of joints holds "two", "x" to "ground"'):
            mechanism_mobility(loose)
        with pytest.raises(MechanismError, match="no joints"):
            mechanism_mobility(linkage({"O": 0, "A": 1, "B": 2}, "O", (("arm", "A", "B"),)))

    def test_positions_that_do_not_close_are_refused(self):
        reaching = motion(four_bar(), np.linspace(0, 6, 5))
        lost = Posture(reaching.mechanism, np.where(np.arange(5) == 3, np.nan, reaching.origin), reaching.direction)
        with pytest.raises(MechanismError, match="does not close"):
            mobility(planar_chain(lost))


@st.composite
def trusses(draw):
    """Pin-jointed bars grown joint by joint on two fixed ones: rigid, then bars added or one taken away.

    Growth by two bars to a new joint keeps m = h = 0; every bar beyond is one self-stress, a bar less one mobility.
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
    def test_maxwell_counts(self, truss):
        mechanism, free, surplus = truss
        here = assembled(mechanism)
        chain = planar_chain(here)
        assert freedoms(chain) == (free, surplus)
        assert mobility_count(mechanism) == free - surplus
        states = self_stress(chain)
        assert states.shape == (surplus, len(chain.graph.branches), 3)
        force = states[..., 1] + 1j * states[..., 2]
        for number, link in enumerate(mechanism.links[1:], 1):
            # A bar without load: its two end forces are opposite and along it.
            total, pulls = np.zeros(surplus, complex), np.zeros(surplus, complex)
            for joint, branch in enumerate(chain.graph.branches):
                sign = (branch.end == link.name) * 1.0 - (branch.start == link.name) * 1.0
                total = total + sign * force[:, joint]
                if branch.name == next(iter(link.points)):
                    pulls = pulls + sign * force[:, joint]
            np.testing.assert_allclose(total, 0, atol=1e-10)
            np.testing.assert_allclose((np.conj(here.direction[number]) * pulls).imag, 0, atol=1e-10)


# Redundant mechanisms ----------------------------------------------------------------------------------------


class TestThirdCrank:
    def test_one_mobility_one_redundancy(self):
        found = mechanism_mobility(three_cranks())
        assert (int(found.mobility), int(found.hyperstaticity), found.index) == (1, 1, 0)

    def test_all_joints_of_the_cranks_take_part_and_no_other(self):
        found = redundant_joints(three_cranks(extra=True))
        assert sorted(pair.name for pair in found) == sorted("ODGABC")
        assert all("rod" not in (pair.start, pair.end) for pair in found)

    @settings(max_examples=20, deadline=None)
    @given(st.floats(0.05, 0.3), st.floats(0.35, 1.0))
    def test_cranks_stress_the_coupler_as_the_lever_law_says(self, a, b):
        mechanism = three_cranks(a, b)
        forces = self_stress_forces(mechanism)
        names = [pair.name for pair in pairs(mechanism)]
        along = (0.05 + 0.09j) / abs(0.05 + 0.09j)
        ends = [pair.end for pair in pairs(mechanism)]
        held = np.array([forces[0, names.index(p)] * (1 if ends[names.index(p)] == "coupler" else -1) for p in "ABC"])
        pulls = (np.conj(along) * held).real
        np.testing.assert_allclose((np.conj(along) * held).imag, 0, atol=1e-12)
        np.testing.assert_allclose(pulls / pulls[2], [(b - a) / a, -b / a, 1], rtol=1e-11)

    def test_forces_found_group_by_group_stress_the_same_joints_alike(self):
        mechanism = three_cranks(extra=True)
        still = motion(mechanism, [np.angle(0.05 + 0.09j)])
        (held,) = self_stresses(still.closures)
        by_group = {}
        for joint, force in zip(still.structure.joints, held.force, strict=True):
            by_group[joint.name, mechanism.links[joint.child].name] = complex(np.ravel(force)[0])
        ours = {
            (pair.name, pair.end): force
            for pair, force in zip(pairs(mechanism), self_stress_forces(mechanism)[0], strict=True)
        }
        scale = by_group["G", "third"] / ours["G", "third"]
        for point, link in (("O", "first"), ("D", "second"), ("G", "third"), ("E", "arm")):
            assert by_group[point, link] == pytest.approx(scale * ours[point, link], abs=1e-12)

    def test_drawn_nearly_it_is_assembled_and_found_redundant(self):
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
            bar("third", "G", "C", places) if link.name == "third" else replace_point(link, "G", places["G"])
            for link in mechanism.links
        )
        found = mechanism_mobility(replace(mechanism, links=shorter))
        assert (int(found.mobility), int(found.hyperstaticity)) == (0, 0)

    def test_what_cannot_be_put_together_names_the_open_joint(self):
        long = replace(four_bar(), links=(*four_bar().links[:3], Link("rocker", {"D": 0.0, "B": 9.0})))
        with pytest.raises(MechanismError, match=r'does not close near its drawing: pin "\w" of "\w+" and "\w+"'):
            assembled(long)
        with pytest.raises(MechanismError, match='link "rocker": none of its points is drawn'):
            assembled(replace(four_bar(), drawing={"O": 0, "A": 0.1j}))

    def test_slider_that_is_not_on_its_line_is_put_there(self):
        drawn = {**slider_crank().drawing, "B": 0.29 - 0.01j}
        here = assembled(replace(slider_crank(), drawing=drawn))
        assert here.point("piston", "B").imag == pytest.approx(0.02, abs=1e-15)
        assert abs(here.point("rod", "B") - here.point("piston", "B")) < 1e-15
        assert here.direction[here.mechanism.index["piston"]] == pytest.approx(1, abs=1e-15)


def replace_point(link, point, place):
    return replace(link, points={**link.points, point: place}) if point in link.points else link


# Groups ------------------------------------------------------------------------------------------------------


class TestAssurGroups:
    def test_dyads_by_their_pairs(self):
        assert [g.name for g in assur_groups(four_bar())] == ["driven link", "dyad RRR, class II"]
        assert [g.name for g in assur_groups(slider_crank())] == ["driven link", "dyad RRP, class II"]
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


class TestStaticSide:
    def test_transpose_holds_the_velocities_of_a_motion(self):
        turning = motion(four_bar(), [0.4], 3.0)
        chain = planar_chain(posture(turning))
        matrix = static_matrix(chain)[0]
        spin = turning.angular_velocity[1:, 0]
        velocity = (
            turning.velocity[1:, 0] + 1j * spin * (complex(*chain.center) - turning.origin[1:, 0])
        ) / chain.length
        twists = np.stack([spin, velocity.real, velocity.imag], axis=-1).ravel()
        np.testing.assert_allclose(matrix.T @ twists, 0, atol=1e-14 * np.abs(twists).max())
