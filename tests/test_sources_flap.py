"""The flap and wing mechanism of its source, as bars and as plates."""

import numpy as np
import pytest
from msgspec.structs import replace
from scene_texts import edited, linked
from sources import number, shipped, three_ways

from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.values.error import SceneError
from rigid import acceleration_of, drive_efforts, motion, position_of, reactions
from rigid.analysis import LinkAngle
from rigid.dynamics import reduced_inertia

# Columns of the source's full incidence matrix (column 9 as in the unreduced form).
BRANCHES = {1: "4-1", 2: "1-2", 3: "2-3", 4: "3-4", 5: "3-5", 6: "5-4", 7: "3-6", 8: "9-10", 9: "10-4", 10: "5-6",
            11: "6-7", 12: "7-8", 13: "8-9", 14: "8-10", 15: "5-9"}  # fmt: skip


@pytest.fixture(scope="module")
def course():
    return scene_motion(shipped("flap_bars"), 41)


class TestFlapMechanism:
    """Scutaru, Vlase, Marin: the flap and wing mechanism, as bars and as plates."""

    # Six loops: branches and senses.
    loops = (((2, 1), (3, 1), (4, 1), (1, 1)), ((4, -1), (5, 1), (6, 1)), ((5, -1), (10, -1), (7, 1)),
             ((4, -1), (5, 1), (8, 1), (10, 1), (11, 1), (12, 1), (13, 1), (9, 1)), ((8, -1), (13, -1), (14, 1)),
             ((10, -1), (11, -1), (12, -1), (13, -1), (15, 1)))  # fmt: skip
    unknown = (3, 4, 5, 6, 7, 8, 10, 11, 12, 13, 14, 15)

    def test_bars_and_plates_have_the_same_motion_and_effort(self, course):
        other = scene_motion(shipped("flap_plates"), 41)
        for bar, plate, point in (("bar_12", "nose", "7"), ("bar_13", "flap", "8"), ("bar_7", "plate", "6")):
            assert position_of(course, bar, point) == pytest.approx(position_of(other, plate, point), abs=1e-14)
        efforts = np.array([three_ways(moving) for moving in (course, other)])
        largest = np.abs(efforts).max()
        assert np.abs(efforts - efforts[0, 0]).max() < 1e-11 * largest
        assert largest > 1

    def test_the_flap_turns_by_more_than_forty_degrees(self, course):
        turned = LinkAngle("bar_13").value(course)
        assert np.degrees(np.ptp(turned)) == pytest.approx(65.0, abs=0.05)

    def ways(self, course):
        """Return the vectors of the bars along the source's branches, each of shape (positions,)."""
        places = {node: self.place(course, node) for pair in BRANCHES.values() for node in pair.split("-")}
        ends = {branch: pair.split("-") for branch, pair in BRANCHES.items()}
        return {branch: places[end] - places[start] for branch, (start, end) in ends.items()}

    @staticmethod
    def place(course, node):
        for link in course.mechanism.links:
            if node in link.points:
                return position_of(course, link.name, node)
        raise AssertionError(node)

    def test_every_loop_closes(self, course):
        ways = self.ways(course)
        for loop in self.loops:
            assert sum(sign * ways[branch] for branch, sign in loop) == pytest.approx(np.zeros(41), abs=1e-14)

    def test_velocities_and_accelerations_by_the_loop_matrix(self, course):
        # (25) to (28): omega_n = -P_n^-1 P_c omega_c, eps_n = P_n^-1 (-P_c eps_c + Q_n omega_n^2 + Q_c omega_c^2).
        ways = self.ways(course)
        spin = {branch: course.angular_velocity[number(course, f"bar_{branch}")] for branch in (2, *self.unknown)}
        turn = {branch: course.angular_acceleration[number(course, f"bar_{branch}")] for branch in (2, *self.unknown)}

        def rows(branches, part):
            signs = [[dict(loop).get(branch, 0) for branch in branches] for loop in self.loops]
            vectors = np.array([np.broadcast_to(ways[branch], 41) for branch in branches])
            return np.einsum("lb,bp->plb", signs, part(vectors))

        P_n = np.concatenate([-rows(self.unknown, np.imag), rows(self.unknown, np.real)], axis=1)
        P_c = np.concatenate([-rows((2,), np.imag), rows((2,), np.real)], axis=1)
        Q_n = np.concatenate([rows(self.unknown, np.real), rows(self.unknown, np.imag)], axis=1)
        Q_c = np.concatenate([rows((2,), np.real), rows((2,), np.imag)], axis=1)
        w, e = (np.array([values[branch] for branch in self.unknown]).T[..., None] for values in (spin, turn))
        w2, e2 = (values[2][:, None, None] for values in (spin, turn))
        found = -np.linalg.solve(P_n, P_c @ w2)
        np.testing.assert_allclose(found, w, atol=1e-12 * np.abs(w).max())
        found = np.linalg.solve(P_n, -P_c @ e2 + Q_n @ w**2 + Q_c @ w2**2)
        np.testing.assert_allclose(found, e, atol=1e-11 * np.abs(e).max())

    def test_acceleration_of_a_centre_from_the_far_end(self, course):
        # (34) has L - b_y instead of L_y - b_y and L_x - b_x, and a wrong sign.
        link = number(course, "bar_15")
        L = self.ways(course)[15]
        b = L / 2
        w, eps = course.angular_velocity[link], course.angular_acceleration[link]
        far = acceleration_of(course, link, "9")
        center = acceleration_of(course, link, course.mechanism.links[link].points["9"] / 2)
        rest = L - b
        corrected = far + (eps * rest.imag + w**2 * rest.real) + 1j * (-eps * rest.real + w**2 * rest.imag)
        np.testing.assert_allclose(corrected, center, atol=1e-12 * np.abs(center).max())
        short = np.abs(L) - b.imag
        printed = far + (-eps * short - w**2 * short) + 1j * (eps * short - w**2 * short)
        assert np.abs(printed - center).max() > 0.1 * np.abs(center).max()

    def test_equation_of_motion(self, course):
        # (42): alpha eps + beta omega^2 = Q, where Q is the motor moment and the reduced weight and air load.
        alpha, beta = reduced_inertia(course)
        inertial = replace(course.mechanism, loads=(), gravity=0.0)
        bare = motion(inertial, course.drive, course.drive_rate, course.drive_acceleration, course.time)
        moment = drive_efforts(bare, reactions(bare))[0]
        found = alpha * course.drive_acceleration[0] + beta * course.drive_rate[0] ** 2
        np.testing.assert_allclose(found, moment, atol=1e-12 * np.abs(moment).max())

    def test_collinear_triangles_of_joints_are_an_error(self):
        # The source's Figure 3: a lever 4-5-9 as three bars.
        bars = linked(
            "rigid = true\nmass = 1\ncenter = [0, 0]", crank="OA", one="AB", two="BC", three="AC", rocker="CD"
        )
        lever = f"""
            [points]
            O = [0, 0]
            A = [0.1, 0.1]
            B = [0.3, 0.1]
            C = [0.5, 0.1]
            D = [0.5, 0]
            [links.ground]
            points = ["O", "D"]
            {bars}
            [[drives]]
            link = "crank"
            law = [{{curve = "cycloidal", duration = 1, by = 0.1}}]
            """
        with pytest.raises(SceneError, match=r"pinned to one another in a straight line.*make them one link") as caught:
            scene_from_text(lever)
        assert caught.value.table == "links.one"
        assert scene_from_text(edited(lever, ("B = [0.3, 0.1]", "B = [0.3, 0.2]"))).labels == ()
