"""ZERO is a neutral element, the order of solution is computed once, and errors name the parts at fault."""

import numpy as np
import pytest
from mechanisms import four_bar, slider_crank, with_link
from msgspec.structs import replace

from rigid import Link, Mechanism, MechanismError, PinDrive, motion, structure
from rigid.analysis import ReachError, require_reach
from rigid.dynamics import Effort, ForwardError, TableError, forward, table_curve
from rigid.plane import ZERO, cross, dot, imaginary, number
from rigid.postures import joint_place


class TestZero:
    ARRAY = np.array([1 + 2j, -3j])

    def test_sum_with_zero_is_the_same_object_and_product_is_zero(self):
        for value in (self.ARRAY, 2.0, 3j, np.float64(2.0), np.complex128(1j)):
            assert value + ZERO is value
            assert ZERO + value is value
            assert value - ZERO is value
            assert np.all(ZERO - value == -value)
            assert value * ZERO is ZERO
            assert ZERO * value is ZERO
            assert dot(value, ZERO) is cross(ZERO, value) is ZERO

    def test_operations_on_zero_alone_return_zero(self):
        made = (ZERO + ZERO, ZERO - ZERO, -ZERO, ZERO.real, ZERO.imag, abs(ZERO), ZERO.conjugate(), imaginary(ZERO))
        assert all(each is ZERO for each in made)

    def test_zero_converts_to_a_number(self):
        assert number(ZERO) == 0.0
        assert float(ZERO) == 0.0
        np.testing.assert_array_equal(np.broadcast_to(ZERO, (2,)), 0.0)

    def test_numpy_functions_raise_on_zero(self):
        with pytest.raises(TypeError, match="ufunc"):
            np.abs(ZERO)


class TestJoints:
    """A joint has the same coordinate for either order of its two links."""

    @pytest.mark.parametrize("make", [four_bar, slider_crank])
    def test_swapping_the_links_of_a_joint_keeps_its_coordinate_and_reverses_its_gap(self, make):
        case = make()
        here = motion(case.mechanism, case.drive + 0.0)
        away = replace(here, origin=here.origin + 0.01 * np.arange(len(here.origin)).reshape(-1, 1))
        for joint in structure(case.mechanism).joints:
            other = replace(
                joint,
                parent=joint.child,
                child=joint.parent,
                at_parent=joint.at_child,
                at_child=joint.at_parent,
                sense=-joint.sense,
            )
            assert (other.owner, other.block) == (joint.owner, joint.block)
            assert joint.point(joint.owner) == other.point(joint.owner)
            np.testing.assert_allclose(other.coordinate(away), joint.coordinate(away), atol=1e-15)
            np.testing.assert_allclose(other.gap(away), -joint.gap(away), atol=1e-15)
            np.testing.assert_allclose(np.abs(joint.gap(here)), 0.0, atol=1e-14)
            if not joint.turns:
                np.testing.assert_allclose(joint_place(here, joint).along, other.along(here), atol=1e-15)


def test_the_order_of_solution_does_not_depend_on_the_drawing():
    mechanism = four_bar().mechanism
    drawn = {point: place + 0.01 for point, place in mechanism.drawing.items()}
    assert structure(replace(mechanism, drawing=drawn)) is structure(mechanism)


class TestErrors:
    def test_a_free_link(self):
        links = (Link("ground", {"O": 0.0}), Link("arm", {"O": 0.0, "A": 1.0}), Link("tail", {"A": 0.0, "B": 1.0}))
        with pytest.raises(MechanismError, match="1 freedom") as found:
            structure(Mechanism(links, (PinDrive("arm", "O"),), {}))
        assert (found.value.kind, found.value.links) == ("freedoms", ("tail",))

    def test_an_undrawn_point(self):
        case = four_bar()
        bare = {point: place for point, place in case.mechanism.drawing.items() if point != "B"}
        with pytest.raises(MechanismError, match='the point "B" is not drawn') as found:
            motion(replace(case.mechanism, drawing=bare), case.drive)
        assert (found.value.kind, found.value.joints) == ("drawing", ("B",))

    @pytest.mark.parametrize(("coupler", "kind"), [(2.0, "unreachable"), (0.17, "reach")])
    def test_positions_out_of_reach(self, coupler, kind):
        case = four_bar(coupler=0.31)
        links = case.mechanism.links
        course = motion(with_link(case.mechanism, replace(links[2], points={"A": 0.0, "B": coupler})), case.drive)
        with pytest.raises(ReachError) as found:
            require_reach(course)
        closes = np.isfinite(course.origin).all(axis=0) & np.isfinite(course.direction).all(axis=0)
        assert found.value.kind == kind
        assert found.value.positions == tuple(np.flatnonzero(~closes))
        assert set(found.value.joints) == {"B"}

    def test_a_motion_without_mass(self):
        links = (Link("ground", {"O": 0.0}), Link("arm", {"O": 0.0, "A": 1.0}))
        massless = Mechanism(links, (PinDrive("arm", "O"),), {"O": 0, "A": 1})
        with pytest.raises(ForwardError, match="moves no mass") as found:
            forward(massless, [Effort(1.0)], 0.0, 0.0, 1.0)
        assert (found.value.time, found.value.links, found.value.drives) == (0.0, ("arm",), (0,))

    def test_an_instant_after_the_end_of_a_table(self):
        with pytest.raises(TableError, match="evaluated at 3") as found:
            table_curve([0.0, 2.0], [1.0, 1.0])(3.0)
        assert (found.value.place, found.value.ends) == (3.0, (0.0, 2.0))
