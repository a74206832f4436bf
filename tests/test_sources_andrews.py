"""Andrews' squeezing mechanism, driven by a moment as in the Test Set for IVP Solvers, and at constant speed."""

import numpy as np
import pytest
from mechanisms import require_closed_loops
from second_routes import multiplier_forces
from sources import number, shipped, three_ways

from kinelast.scene.data import scene_motion
from rigid import position_of
from rigid.kinetostatics import kinetic_energy, potential_energy

# andrews.f 1.2 (2006), at t = 0.03 s: beta, Theta, gamma, Phi, delta, Omega, epsilon, their rates and accelerations,
# and six multipliers: forces in E, x and y, of the links K3, K4 and K6.
ANGLES = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
          0.5347301163226948, 1.048080741042263)  # fmt: skip
RATES = (1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
         -19.29337464421385, 0.3231791658026955)  # fmt: skip
ACCELERATIONS = (-24631.76316945196, 51850.37701610329, 324102.5686413781, 566749.3645176213, 16743.62929479361,
                 -566749.3645176222, 9826.520791458422)  # fmt: skip
MULTIPLIERS = (199.1753333731910, -29.75531228015052, 23.06654119098399, 31.45271365475927, 22.64249232082739,
               11.61740700019673)  # fmt: skip
# At the start the same file gives two accelerations, of beta and Theta, and the force on K3; all others are zero.
START_ACCELERATIONS = (14222.443919954114, -10666.832939965585)
START_FORCE = (98.56687039624109, -6.122688344255662)


def relative(values):
    """Return the values of K1 to K7 in the convention of the test set: K2, K4 and K6 are relative."""
    one, two, three, four, five, six, seven = values
    return np.array([one, two - one, three, four - five, five, six - seven, seven])


def multipliers(course):
    """Return the forces in E on K3, K4 and K6, x and y: the multipliers of the three conditions with K2."""
    found = {
        course.mechanism.links[joint.child].name: force
        for joint, force in zip(course.structure.joints, multiplier_forces(course).force, strict=True)
        if joint.name == "E"
    }
    forces = [found["K3"], found["K4"], found.get("K6", found.get("K7"))]
    return np.array([part for force in forces for part in (force.real, force.imag)])


@pytest.fixture(scope="module")
def course():
    return scene_motion(shipped("andrews_squeezer"), 301)


class TestDrivenByAMoment:
    def links(self, course):
        return [number(course, f"K{k}") for k in range(1, 8)]

    def test_angles(self, course):
        found = relative(np.angle(course.direction[self.links(course), -1]))
        assert course.drive[0, -1] == pytest.approx(ANGLES[0], rel=1e-8)
        off = np.angle(np.exp(1j * (found - ANGLES)))
        assert np.abs(off / ANGLES).max() < 1e-8

    def test_velocities(self, course):
        assert relative(course.angular_velocity[self.links(course), -1]) == pytest.approx(RATES, rel=1e-6)

    def test_accelerations(self, course):
        assert relative(course.angular_acceleration[self.links(course), -1]) == pytest.approx(ACCELERATIONS, rel=1e-5)

    def test_forces_in_the_joint_of_four_links(self, course):
        assert multipliers(course)[:, -1] == pytest.approx(MULTIPLIERS, rel=1e-5)

    def test_accelerations_and_forces_at_the_start(self, course):
        accelerations = relative(course.angular_acceleration[self.links(course), 0])
        np.testing.assert_allclose(accelerations, (*START_ACCELERATIONS, *[0] * 5), rtol=1e-11, atol=1e-8)
        np.testing.assert_allclose(multipliers(course)[:, 0], (*START_FORCE, *[0] * 4), rtol=1e-10, atol=1e-10)

    def test_it_starts_at_rest_as_drawn(self, course):
        assert course.angular_velocity[:, 0] == pytest.approx(np.zeros(8), abs=1e-12)
        places = [position_of(course, link, "E")[0] for link in ("K2", "K3", "K4", "K6")]
        assert places == pytest.approx([places[0]] * 4, abs=1e-15)

    def test_the_work_of_the_moment_is_the_gained_energy(self, course):
        energy = kinetic_energy(course) + potential_energy(course)
        work = 0.033 * (course.drive[0] - course.drive[0, 0])
        assert energy - energy[0] == pytest.approx(work, abs=1e-8 * energy.max())
        require_closed_loops(course, 1e-16)


class TestAtConstantSpeed:
    def test_three_formulations_agree_and_the_turn_closes(self):
        scene = shipped("andrews_driven")
        course = scene_motion(scene)
        ways = three_ways(course)
        assert np.abs(ways[1:] - ways[0]).max() < 1e-11 * np.abs(ways[0]).max()
        again = scene.course.at([0.0, 2 * np.pi / 527])
        assert again.origin[:, 1] == pytest.approx(again.origin[:, 0], abs=1e-14)

    def test_the_effort_does_no_net_work_over_a_turn(self):
        # At constant speed without losses the energy is periodic; the mean of a smooth periodic function is exact.
        effort = three_ways(scene_motion(shipped("andrews_driven"), 720))[0]
        assert effort.mean() == pytest.approx(0.0, abs=1e-10 * np.abs(effort).max())
