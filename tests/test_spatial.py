"""Joints in space, their chains, and input-output laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid import Link, Mechanism, MechanismError
from rigid.topology import (
    JOINT_TYPES,
    SYNONYMS,
    Action,
    Contact,
    SpatialJoint,
    assembled,
    force_law,
    joint_rates,
    kinematic_matrix,
    kinematic_torsor,
    mobility,
    planar_chain,
    self_stress,
    spatial_chain,
    static_torsor,
    stressed_joints,
    velocity_law,
)

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

# Table II.2 of the course chapter: free and transmitted components in the joint's axes.
TABLE = {
    "punctual": (5, "Ωx Ωy Ωz Vx Vy", "Z"),
    "rectilinear": (4, "Ωx Ωz Vx Vy", "Z M"),
    "annular linear": (4, "Ωx Ωy Ωz Vx", "Y Z"),
    "ball": (3, "Ωx Ωy Ωz", "X Y Z"),
    "plane": (3, "Ωz Vx Vy", "Z L M"),
    "sliding pivot": (2, "Ωz Vz", "X Y L M"),
    "slide": (1, "Vz", "X Y L M N"),
    "pivot": (1, "Ωz", "X Y Z L M"),
    "fixed": (0, "", "X Y Z L M N"),
}


def freedoms(joints, fixed=None):
    found = mobility(spatial_chain(joints, fixed))
    assert found.sides_agree
    return int(found.mobility), int(found.hyperstaticity)


def helical_nut(pitch, size=1.0):
    return spatial_chain(
        [
            SpatialJoint("P", ("support", "screw"), "pivot", (0, 0, 0), X),
            SpatialJoint("G", ("support", "nut"), "slide", (0.2 * size, 0.1 * size, 0), X),
            SpatialJoint("H", ("nut", "screw"), "helical", (0.2 * size, 0, 0), X, pitch),
        ]
    )


def gear_shaft(length=0.3):
    return spatial_chain(
        [SpatialJoint("A", ("frame", "shaft"), "ball"), SpatialJoint("B", ("frame", "shaft"), "ball", (length, 0, 0))]
    )


def teeth(c, d, R, r, beta):
    """Return the loads of the two meshes on the shaft, from the resultants in the source's equations."""
    return [
        Action("motor", "shaft", (c, R, 0), (0, -np.sin(beta), np.cos(beta))),
        Action("receiver", "shaft", (d, 0, -r), (0, -np.cos(beta), np.sin(beta))),
    ]


vectors = st.tuples(*[st.floats(-2, 2)] * 3)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 0.1)


@st.composite
def joints(draw):
    axis = draw(directions)
    side = draw(directions.filter(lambda v: np.linalg.norm(np.cross(axis, v)) > 0.05))
    normal = tuple(np.cross(axis, side))
    return SpatialJoint(
        "J", ("a", "b"), draw(st.sampled_from([*JOINT_TYPES])), draw(vectors), axis, draw(st.floats(-1, 1)), normal
    )


class TestTable:
    @pytest.mark.parametrize("name", TABLE)
    def test_freedoms_and_components(self, name):
        count, free, carried = TABLE[name]
        kind = SpatialJoint("J", ("a", "b"), name).kind
        assert len(kind.freedoms) == count
        assert kind.freedoms == tuple(free.split())
        assert kind.transmits == tuple(carried.split())

    def test_freedoms_and_transmitted_components_sum_to_six(self):
        assert all(len(kind.freedoms) + len(kind.transmits) == 6 for kind in JOINT_TYPES.values())
        assert set(SYNONYMS.values()) <= set(JOINT_TYPES)

    def test_the_moment_of_a_thread_is_minus_pitch_times_force(self):
        thread = SpatialJoint("H", ("a", "b"), "helical", (0, 0, 0), X, 0.003)
        np.testing.assert_allclose(kinematic_torsor(thread)[:, 0], [1, 0, 0, 0.003, 0, 0])
        push = static_torsor(thread)[:, thread.kind.transmits.index("Z")]
        np.testing.assert_allclose(push, [1, 0, 0, -0.003, 0, 0])

    def test_a_line_contact_lies_along_its_axis(self):
        edge = SpatialJoint("L", ("a", "b"), "line", (0, 0, 0), Y, normal=Z)
        np.testing.assert_allclose(static_torsor(edge)[:3, 0], [0, 0, 1])
        free = kinematic_torsor(edge)
        np.testing.assert_allclose(free[:, edge.kind.freedoms.index("Ωx")], [0, 1, 0, 0, 0, 0])
        moment = static_torsor(edge)[3:, 1]
        assert abs(moment @ Y) < 1e-15
        assert abs(moment @ Z) < 1e-15

    @given(joints(), vectors)
    def test_transmitted_forces_do_no_work_on_freedoms(self, joint, point):
        free, carried = kinematic_torsor(joint, point), static_torsor(joint, point)
        power = free[:3].T @ carried[3:] + free[3:].T @ carried[:3]
        np.testing.assert_allclose(power, 0, atol=1e-13)
        assert np.linalg.matrix_rank(free) == free.shape[1]
        assert np.linalg.matrix_rank(carried) == 6 - free.shape[1]

    @given(joints(), vectors)
    def test_torsors_transform_as_fields(self, joint, point):
        free, here = kinematic_torsor(joint), kinematic_torsor(joint, point)
        arm = np.subtract(point, joint.at)
        for column in range(free.shape[1]):
            np.testing.assert_allclose(here[3:, column], free[3:, column] + np.cross(free[:3, column], arm), atol=1e-12)


class TestScrewAndNut:
    @pytest.mark.parametrize("pitch", [0.002, -0.002, 1.5, 1e-5])
    @pytest.mark.parametrize("size", [1.0, 1e-3, 0.0])
    def test_the_nut_advances_by_the_pitch(self, pitch, size):
        nut = helical_nut(pitch, size)
        np.testing.assert_allclose(velocity_law(nut, ["P"], ["G"]), [[-pitch]], rtol=1e-9)
        np.testing.assert_allclose(velocity_law(nut, ["P"], ["H"]), [[1]], rtol=1e-12)
        np.testing.assert_allclose(velocity_law(nut, ["G"], ["P"]), [[-1 / pitch]], rtol=1e-9)

    def test_law_of_a_thread_with_the_pitch_as_only_length(self):
        np.testing.assert_allclose(velocity_law(helical_nut(1e-12, 0.0), ["P"], ["G"]), [[-1e-12]], rtol=1e-9)

    def test_any_link_can_be_fixed(self):
        joints = [
            SpatialJoint("G", ("nut", "support"), "slide", axis=X),
            SpatialJoint("P", ("support", "screw"), "pivot", axis=X),
            SpatialJoint("H", ("nut", "screw"), "helical", axis=X, pitch=0.002),
        ]
        for fixed in ("support", "nut", "screw"):
            chain = spatial_chain(joints, fixed)
            assert chain.graph.nodes[0] == fixed
            assert (int(mobility(chain).mobility), int(mobility(chain).hyperstaticity)) == (1, 4)
            with pytest.raises(MechanismError, match="no moving link"):
                force_law(chain, [Action("x", fixed, moment=X)], [], ["x"])
        grounded = [SpatialJoint("A", ("arm", "ground"), "pin"), SpatialJoint("B", ("arm", "hand"), "pin", X)]
        assert spatial_chain(grounded).graph.nodes[0] == "ground"

    def test_motor_moment_against_receiver_force(self):
        nut = helical_nut(0.002)
        loads = [Action("motor", "screw", moment=X), Action("receiver", "nut", (0.4, 0.2, 0), X)]
        # Virtual work: C alpha' + F lambda' = 0 with lambda' = -p alpha'.
        np.testing.assert_allclose(force_law(nut, loads, ["receiver"], ["motor"]), [[0.002]], rtol=1e-10)


class TestGearShaft:
    def test_self_stress_is_an_axial_force(self):
        state = self_stress(gear_shaft())
        assert state.shape == (1, 2, 6)
        force, moment = state[0, :, 3:], state[0, :, :3]
        np.testing.assert_allclose(force[0], -force[1], atol=1e-15)
        np.testing.assert_allclose(np.abs(force[0]), [abs(force[0, 0]), 0, 0], atol=1e-15)
        np.testing.assert_allclose(moment, 0, atol=1e-15)
        assert stressed_joints(gear_shaft()) == (0, 1)

    @given(*[st.floats(0.02, 0.5)] * 4, st.floats(0.1, 0.7))
    def test_the_torque_ratio_is_that_of_the_radii(self, c, d, R, r, beta):
        law = force_law(gear_shaft(), teeth(c, d, R, r, beta), ["receiver"], ["motor"])
        np.testing.assert_allclose(law, [[r / R]], rtol=1e-9)
        printed = r * np.sin(beta) / (R * np.cos(beta))
        assert abs(law[0, 0] - printed) > 1e-3 * r / R


class TestKnownLinkages:
    def test_four_parallel_pivots(self):
        corners = [(0, 0, 0), (0, 1, 0), (3, 2, 0), (3, 0, 0)]
        ring = [SpatialJoint(f"J{n}", (f"L{n}", f"L{(n + 1) % 4}"), "revolute", at) for n, at in enumerate(corners)]
        assert freedoms(ring) == (1, 3)

    def test_spherical_four_bar(self):
        axes = [(1, 0, 0), (0.8, 0.6, 0.1), (0.2, 0.7, 0.9), (0, 0.3, 1)]
        ring = [
            SpatialJoint(f"J{n}", (f"L{n}", f"L{(n + 1) % 4}"), "revolute", tuple(0.5 * np.array(axis)), axis)
            for n, axis in enumerate(axes)
        ]
        assert freedoms(ring) == (1, 3)

    def test_a_coupler_between_two_balls_can_spin(self):
        ring = [
            SpatialJoint("A", ("ground", "crank"), "revolute", (0, 0, 0), X),
            SpatialJoint("B", ("crank", "coupler"), "spherical", (0, 0.3, 0.1)),
            SpatialJoint("C", ("coupler", "rocker"), "spherical", (1, 0.9, 0.5)),
            SpatialJoint("D", ("ground", "rocker"), "revolute", (1.2, 0, 0), (0.2, 0.1, 1)),
        ]
        assert freedoms(ring) == (2, 0)

    def test_a_sarrus_linkage_moves_on_a_straight_line(self):
        def half(name, axis, out):
            out = np.array(out, float)
            low, mid, top = out, 1.7 * out + np.array([0, 0, 0.5]), out + np.array([0, 0, 1])
            return [
                SpatialJoint(f"{name}1", ("ground", f"{name}low"), "revolute", tuple(low), axis),
                SpatialJoint(f"{name}2", (f"{name}low", f"{name}high"), "revolute", tuple(mid), axis),
                SpatialJoint(f"{name}3", (f"{name}high", "table"), "revolute", tuple(top), axis),
            ]

        legs = half("a", Y, (1, 0, 0)) + half("b", X, (0, 1, 0))
        assert freedoms(legs) == (1, 1)
        assert freedoms(legs[:3]) == (3, 0)
        rates = joint_rates(spatial_chain(legs))[:, 0]
        # The knees turn twice as far as the hinges; one side folds down while the other rises.
        np.testing.assert_allclose(rates / rates[1], [-0.5, 1, -0.5, 0.5, -1, 0.5], rtol=1e-9)

    def test_a_planar_mechanism_has_three_more_conditions_per_loop_in_space(self):
        places = {"O": 0, "A": 0.06 + 0.08j, "B": 0.3 + 0.21j, "D": 0.35}
        links = (
            Link("ground", {"O": 0, "D": 0.35}),
            Link("crank", {"O": 0, "A": 0.1}),
            Link("coupler", {"A": 0, "B": abs(0.24 + 0.13j)}),
            Link("rocker", {"D": 0, "B": abs(-0.05 + 0.21j)}),
        )
        flat = planar_chain(assembled(Mechanism(links, (), places)))
        ends = {branch.name: (branch.start, branch.end) for branch in flat.graph.branches}
        spatial = spatial_chain(
            [SpatialJoint(n, ends[n], "pin", (complex(p).real, complex(p).imag, 0)) for n, p in places.items()]
        )
        plane, space = mobility(flat), mobility(spatial)
        assert int(space.mobility) == int(plane.mobility) == 1
        assert int(space.hyperstaticity) == int(plane.hyperstaticity) + 3 * plane.loops
        np.testing.assert_allclose(
            velocity_law(flat, ["O"], ["A", "B", "D"]), velocity_law(spatial, ["O"], ["A", "B", "D"]), rtol=1e-12
        )

    @settings(max_examples=30)
    @given(st.floats(-4, 4), st.floats(-3, 3))
    def test_laws_do_not_depend_on_units_and_axes(self, power, angle):
        size, turn = (
            10**power,
            np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]),
        )
        ring = [
            SpatialJoint("A", ("ground", "crank"), "revolute", (0, 0, 0), X),
            SpatialJoint("B", ("crank", "coupler"), "universal", (0, 0.3, 0.1), X, normal=Y),
            SpatialJoint("C", ("coupler", "rocker"), "spherical", (1, 0.9, 0.5)),
            SpatialJoint("D", ("ground", "rocker"), "cylindrical", (1.2, 0, 0), (0.2, 0.1, 1)),
        ]
        moved = [
            SpatialJoint(
                j.name,
                j.links,
                j.type,
                tuple(size * (turn @ j.at) + 3 * size),
                tuple(turn @ j.axis),
                normal=None if j.normal is None else tuple(turn @ j.normal),
            )
            for j in ring
        ]
        assert freedoms(moved) == freedoms(ring) == (2, 0)
        before = velocity_law(spatial_chain(ring), ["A", ("D", "Vz")], [("D", "Ωz")])
        after = velocity_law(spatial_chain(moved), ["A", ("D", "Vz")], [("D", "Ωz")])
        np.testing.assert_allclose(after * [1, size], before, rtol=1e-8)


class TestGears:
    def test_velocity_law_of_rolling_wheels(self):
        wheels = Mechanism(
            (Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {"O": 0, "D": 3}
        )
        chain = planar_chain(assembled(wheels), [Contact("mesh", "a", "b", 1.0)])
        np.testing.assert_allclose(velocity_law(chain, ["O"], ["D"]), [[-0.5]], rtol=1e-13)
        loads = [Action("in", "a", moment=(1.0,)), Action("out", "b", (3.0, 2.0), (1.0, 0.0))]
        # Moments are in the ratio of the radii, M_b = 2 M_a, and the force has a moment of -2 N m per newton on b.
        np.testing.assert_allclose(force_law(chain, loads, ["out"], ["in"]), [[-1.0]], rtol=1e-13)


AB = ("a", "b")
PIN = SpatialJoint("J", AB, "pin")
NUT = helical_nut(0.002)
OPEN = spatial_chain([SpatialJoint("J", AB, "cylindrical"), SpatialJoint("K", ("b", "c"), "pin", X)])
LOADS = [Action("motor", "screw", moment=X), Action("across", "nut", (0, 0, 0), Y)]
ERRORS = [
    (lambda: spatial_chain([SpatialJoint("J", AB, "revolut")]), 'no type "revolut", did you mean "revolute"'),
    (lambda: spatial_chain([SpatialJoint("J", AB, "q")]), 'no type "q", expected one of point, line'),
    (lambda: spatial_chain([SpatialJoint("J", AB, "pin", axis=(0, 0, 0))]), "axis has no length"),
    (lambda: spatial_chain([SpatialJoint("J", AB, "line", axis=X)]), "a line joint needs a normal"),
    (
        lambda: spatial_chain([SpatialJoint("J", AB, "universal", axis=X, normal=(1, 1, 0))]),
        "the angle between axis and normal is 45 deg",
    ),
    (lambda: spatial_chain([]), "there are no joints"),
    (lambda: spatial_chain([PIN, PIN]), 'two joints have the name "J"'),
    (lambda: spatial_chain([PIN], "c"), 'no joint has the fixed link "c"'),
    (
        lambda: mobility(spatial_chain([PIN, SpatialJoint("K", ("c", "d"), "pin")])),
        'no chain of joints connects "c", "d" to "a"',
    ),
    (lambda: velocity_law(NUT, ["P"], ["Q"]), 'there is no joint "Q"'),
    (lambda: velocity_law(NUT, ["P", "H"], ["G"]), "P, H do not move independently"),
    (lambda: velocity_law(OPEN, ["J"], ["K"]), "name one of its freedoms Ωz, Vz"),
    (lambda: velocity_law(OPEN, [("J", "Ωz")], ["K"]), "K does not follow from"),
    (lambda: force_law(NUT, [*LOADS, Action("none", "nut")], ["across"], ["motor"]), "neither a force nor a moment"),
    (lambda: force_law(NUT, LOADS, ["pull"], ["motor"]), 'unknown action "pull"'),
    (lambda: force_law(NUT, LOADS, ["motor"], ["across"]), "equilibrium does not determine across"),
    (
        lambda: force_law(NUT, [Action("x", "support", (0, 0, 0), X)], [], ["x"]),
        'action "x": there is no moving link "support"',
    ),
    (
        lambda: force_law(OPEN, [Action("x", "b", moment=Z), Action("y", "b", (0, 0, 0), Z)], ["y"], ["x"]),
        "x alone cannot balance y",
    ),
]


@pytest.mark.parametrize(("call", "message"), ERRORS)
def test_wrong_joints_are_errors(call, message):
    with pytest.raises(MechanismError, match=message):
        call()


def test_a_chain_without_loops_has_no_loop_equations():
    arm = spatial_chain([SpatialJoint("J", ("a", "b"), "ball"), SpatialJoint("K", ("b", "c"), "pin", X)])
    assert kinematic_matrix(arm).shape == (0, 4)
    assert freedoms([SpatialJoint("J", ("a", "b"), "ball"), SpatialJoint("K", ("b", "c"), "pin", X)]) == (4, 0)
