"""Andrews' squeezing mechanism: driven by a moment as in the Test Set for IVP Solvers, and with a steady crank."""

import numpy as np
import pytest
from sources import number, shipped, three_ways

from kinelast.scene.data import scene_motion
from rigid import position_of
from rigid.dynamics import multiplier_forces
from rigid.kinetostatics import kinetic_energy, potential_energy

# andrews.f 1.2 (2006), at t = 0.03 s: beta, Theta, gamma, Phi, delta, Omega, epsilon, their rates and accelerations,
# and the six multipliers: forces in E, x and y, of the links K3, K4 and K6.
ANGLES = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
          0.5347301163226948, 1.048080741042263)  # fmt: skip
RATES = (1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
         -19.29337464421385, 0.3231791658026955)  # fmt: skip
ACCELERATIONS = (-24631.76316945196, 51850.37701610329, 324102.5686413781, 566749.3645176213, 16743.62929479361,
                 -566749.3645176222, 9826.520791458422)  # fmt: skip
MULTIPLIERS = (199.1753333731910, -29.75531228015052, 23.06654119098399, 31.45271365475927, 22.64249232082739,
               11.61740700019673)  # fmt: skip


def relative(values):
    """Values of K1 to K7 as the test set counts them: K2, K4 and K6 from their neighbours."""
    one, two, three, four, five, six, seven = values
    return np.array([one, two - one, three, four - five, five, six - seven, seven])


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
        forces, joints = multiplier_forces(course).force, course.structure.joints
        found = {
            course.mechanism.links[joint.child].name: complex(force[-1])
            for joint, force in zip(joints, forces, strict=True)
            if joint.name == "E"
        }
        parts = [part for link in ("K3", "K4") for part in (found[link].real, found[link].imag)]
        assert parts == pytest.approx(MULTIPLIERS[:4], rel=1e-5)
        six = found.get("K6", found.get("K7"))
        assert (six.real, six.imag) == pytest.approx(MULTIPLIERS[4:], rel=1e-5)

    def test_it_starts_at_rest_as_drawn(self, course):
        assert course.angular_velocity[:, 0] == pytest.approx(np.zeros(8), abs=1e-12)
        places = [position_of(course, link, "E")[0] for link in ("K2", "K3", "K4", "K6")]
        assert places == pytest.approx([places[0]] * 4, abs=1e-15)

    def test_the_moment_does_the_work_that_the_energy_grows_by(self, course):
        energy = kinetic_energy(course) + potential_energy(course)
        work = 0.033 * (course.drive[0] - course.drive[0, 0])
        assert energy - energy[0] == pytest.approx(work, abs=1e-7 * work.max())


class TestAtConstantSpeed:
    def test_three_formulations_agree_and_the_turn_closes(self):
        scene = shipped("andrews_driven")
        course = scene_motion(scene)
        ways = three_ways(course)
        assert np.abs(ways[1:] - ways[0]).max() < 1e-11 * np.abs(ways[0]).max()
        again = scene.course.at([0.0, 2 * np.pi / 527])
        assert again.origin[:, 1] == pytest.approx(again.origin[:, 0], abs=1e-14)

    def test_over_a_turn_the_effort_does_no_work(self):
        # At constant speed the energy comes back, and there is no loss; the mean of a smooth turn is exact.
        effort = three_ways(scene_motion(shipped("andrews_driven"), 720))[0]
        assert effort.mean() == pytest.approx(0.0, abs=1e-10 * np.abs(effort).max())
