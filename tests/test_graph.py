"""Graphs: examples of the source, random graphs, graphs of mechanisms, counts."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mechanisms import linkage, slider_crank_linkage, three_cranks

from rigid import Link, Mechanism, MechanismError, PinDrive, Slider, SliderDrive
from rigid.topology import (
    Branch,
    Contact,
    Graph,
    bar_graph,
    components,
    cyclomatic_number,
    fundamental_loops,
    incidence,
    kutzbach,
    link_graph,
    loop_walk,
    mechanism_mobility,
    mobility_count,
    pairs,
    spanning_tree,
)

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


class TestFlapMechanismOfSource:
    def test_incidence_matrix_with_branch_9_from_10_to_4(self):
        """The sign of branch 9 at node 4 is printed wrong: such a column leaves two nodes, and the rank is 10."""
        matrix = incidence(numbered(BARS, 10))
        for column, (start, end) in zip(matrix.T, BARS, strict=True):
            assert {number: column[number] for number in np.flatnonzero(column)} == {start - 1: 1, end - 1: -1}
        assert np.linalg.matrix_rank(matrix) == 9
        matrix[3, 8] = 1
        assert np.linalg.matrix_rank(matrix) == 10

    def test_fundamental_loops_are_those_of_the_source(self):
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

    def test_chord_15_as_printed_does_not_close_its_loop(self):
        printed = incidence(numbered(BARS, 10))[:9]
        printed[:, 14] = 0
        printed[0, 14] = -1
        loops = signed(FLAP_LOOPS, 15)
        assert (printed @ loops.T).any(axis=0).tolist() == [False] * 5 + [True]

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
    def test_a_four_bar_has_one_loop(self):
        graph = numbered([(1, 2), (2, 3), (3, 4), (4, 1)], 4)
        np.testing.assert_array_equal(incidence(graph), [[1, 0, 0, -1], [-1, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1]])
        np.testing.assert_array_equal(fundamental_loops(graph), [[1, 1, 1, 1]])

    def test_a_graph_with_three_loops(self):
        graph = numbered([(1, 2), (2, 3), (3, 4), (4, 1), (3, 5), (5, 2), (5, 6), (6, 7), (7, 4)], 7)
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
    def test_a_walk_around_a_loop_is_connected(self, graph):
        for loop in fundamental_loops(graph):
            walk = loop_walk(graph, loop)
            assert sorted(number for number, _ in walk) == list(np.flatnonzero(loop))
            ways = [(branch.start, branch.end)[::sign] for branch, sign in ((graph.branches[n], s) for n, s in walk)]
            assert all(one[1] == other[0] for one, other in zip(ways, ways[1:] + ways[:1], strict=True))

    def test_invalid_graphs_are_errors(self):
        with pytest.raises(MechanismError, match='branch "1": there is no node "B"'):
            Graph((Branch("1", "A", "B"),), ("A",))
        with pytest.raises(MechanismError, match='branch "1" begins and ends at "A"'):
            Graph((Branch("1", "A", "A"),))
        with pytest.raises(MechanismError, match="1, 2, 3 are not a spanning tree"):
            fundamental_loops(numbered([(1, 2), (2, 3), (3, 1), (3, 4)], 4), [0, 1, 2])
        with pytest.raises(MechanismError, match="1, 2 are not a spanning tree of 4 nodes"):
            fundamental_loops(numbered([(1, 2), (2, 3), (3, 1), (3, 4)], 4), [0, 1])


class TestGraphsOfMechanism:
    def test_slider_is_a_branch_of_both_graphs(self):
        links, bars = link_graph(slider_crank_linkage()), bar_graph(slider_crank_linkage())
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

    def test_a_line_through_a_joint_starts_there(self):
        links = (*slider_crank_linkage().links[:3], Link("piston", {"B": 0.0}))
        centred = Mechanism(links, (), {}, (Slider("guide", "piston", "ground", "B", 0.0, 1.0),))
        assert [(b.name, b.start, b.end) for b in bar_graph(centred).branches][-1] == ("guide", "O", "B")
        assert cyclomatic_number(bar_graph(centred)) == 1

    @pytest.mark.parametrize("names", [("x", "y"), ("A", "B")])
    def test_two_sliders_on_the_ground_have_a_node_each(self, names):
        links = (Link("ground", {"O": 0}), Link("rod", {"A": 0, "B": 0.3}), Link("bx", {"A": 0}), Link("by", {"B": 0}))
        lines = (("bx", "A", 0.18, 1.0), ("by", "B", 0.24j, 1j))
        sliders = [Slider(name, link, "ground", *line) for name, (link, *line) in zip(names, lines, strict=True)]
        trammel = Mechanism(links, (SliderDrive(names[0]),), {"O": 0, "A": 0.18, "B": 0.24j}, tuple(sliders))
        graph = bar_graph(trammel)
        assert len(graph.nodes) == len(graph.branches) == 4
        assert cyclomatic_number(graph) == 1

    def test_three_links_on_a_pin_are_two_pairs_including_the_driven_one(self):
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
    def test_each_chord_adds_a_loop(self, joints, links, loops):
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
        ("count", "links", "one", "two"), [(1, 4, 4, 0), (1, 6, 7, 0), (-1, 4, 5, 0), (0, 3, 3, 0), (1, 3, 2, 1)]
    )
    def test_kutzbachs_count_of_known_mechanisms(self, count, links, one, two):
        assert kutzbach(links, one, two) == count

    def test_count_of_a_mechanism_takes_multiple_pins_sliders_and_contacts(self):
        assert mobility_count(slider_crank_linkage()) == 1
        assert mobility_count(three_cranks()) == 0
        wheels = Mechanism((Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {})
        assert mobility_count(wheels) == 2
        assert mobility_count(wheels, [Contact("mesh", "a", "b", 1.0)]) == 0
        assert mobility_count(wheels, [Contact("cam", "a", "b", 1.0, 1.0)]) == 1
