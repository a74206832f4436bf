"""The push-up mechanism of a drag reduction system reproduces its source, with recomputed digits if necessary.

Tolerances are half a unit of the last digit; see docs/sources.md.
"""

import numpy as np
import pytest
from mechanisms import with_link
from msgspec.structs import replace
from sources import three_ways

from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.tasks.task import shipped_scenes
from rigid import motion
from rigid.analysis import PointCoordinate, dead_points, drive_values


def digits(value):
    """Return half a unit of the last digit of a decimal number."""
    return 0.5 * 10.0 ** -len(str(value).partition(".")[2]) * 1.001


class TestDragReduction:
    """DRS project: kinematics push up mechanism, a Maple worksheet. Bars are mass lines."""

    scene = scene_from_text(
        shipped_scenes()["drs_push_up"].read_text(encoding="utf-8").replace("[run]", '[run]\nbeams = "euler-bernoulli"')
    )

    def force(self, *milliseconds, scene=None):
        return three_ways((scene or self.scene).course.at(np.array(milliseconds) * 1e-3))[0]

    @pytest.mark.parametrize(
        ("time", "force"),
        [(0, 1003.314036), (1, 127450.2486), (2.1, 46871.6556), (3, 12267.7745), (5, -9751.1791), (7.5, -16224.5028),
         (42, -15612.2180), (48, 53159.4847), (20, 322.240), (0.904395, 128803.9772), (7.387, -16244.19)],
    )  # fmt: skip
    def test_the_piston_force_is_that_of_the_worksheet(self, time, force):
        assert self.force(time)[0] == pytest.approx(force, abs=digits(force) + 1e-4 * (time == 42))

    def test_peaks_of_the_cycle(self):
        time = np.linspace(0.9, 0.91, 2001)
        force = self.force(*time)
        assert (force.max(), time[force.argmax()]) == (
            pytest.approx(128803.9772, abs=1e-3),
            pytest.approx(0.904395, abs=1e-5),
        )
        whole = self.force(*np.linspace(0, 50, 5001))
        assert force.max() - 30 < whole.max() <= force.max() + 1e-3
        assert whole.min() == pytest.approx(-16244.19, abs=0.02)

    def test_three_formulations_agree(self):
        ways = three_ways(scene_motion(self.scene))
        assert np.abs(ways[1:] - ways[0]).max() < 1e-10 * np.abs(ways[0]).max()

    def test_the_printed_force_at_the_start_follows_from_rounded_angles(self):
        # Virtual work with the notebook's own constants and angles.
        psi1, psi3 = -0.1706738276, 1.087076363
        arm = complex(0.0517233963 - 0.11, 0.0015878093)
        # A unit slide rotates the flap by 1/tau; the link's remaining force has no moment about C.
        rate = np.cos(psi1) / (-0.1 * np.cos(psi3 - psi1))
        turned = 1j * arm * np.exp(1j * psi3) * rate
        loads = complex(145.51319, -819.11694 - 2 * 9.81) + complex(*self.beyond(psi3))
        link = 1 + 0.5 * (-0.1j * np.exp(1j * psi3) * rate - 1j).imag  # velocity of the link's middle
        found = -(loads.conjugate() * turned).real + 9.81 * (0.08 + 0.0375 * link)
        assert found == pytest.approx(1003.196916, abs=1e-3)
        assert self.force(0)[0] == pytest.approx(1003.314036, abs=1e-6)

    @staticmethod
    def beyond(psi3):
        share = (psi3 - 1.087075800) / (1.087075800 - 0.5487704485)
        return (145.51319 - 51.32626) * share, -(819.11694 - 745.62411) * share

    def test_the_piston_stops_at_both_singular_positions(self):
        still = self.scene.course.at([0.0]).mechanism
        course = motion(still, np.linspace(-0.01, 0.29, 301))
        stops = [float(point.drive[0]) for point in dead_points(course) if point.kind == "stop"]
        assert stops == [pytest.approx(-0.001552857370, abs=5e-12), pytest.approx(0.2775528574, abs=5e-11)]

    def test_limits_of_the_stroke(self):
        # The tip is 10 and 50 mm above a point of the main wing; the worksheet has these exact roots to 4e-7.
        course = motion(self.scene.mechanism, np.linspace(-0.0015, 0.1, 200))
        level = (0.006 + np.exp(1j * np.radians(5)) * complex(0.28, 0.0223)).imag
        height = PointCoordinate("flap", "T", 1j)
        for gap, root, printed in ((0.01, 0.000198514663, 0.000198939130), (0.05, 0.046074263219, 0.046074898005)):
            found = float(drive_values(course, height, level + gap)[0, 0])
            assert found == pytest.approx(root, abs=5e-13)
            assert found != pytest.approx(printed, abs=1e-7)

    def test_the_profile_is_a_quintic(self):
        time = np.linspace(0, 0.01, 11)
        quintic = 0.0001989391299 + 458759.5888 * time**3 - 6.881393831e7 * time**4 + 2.752557533e9 * time**5
        assert self.scene.course.at(time).drive[0] == pytest.approx(quintic, abs=1e-9)

    def test_the_centre_of_mass_is_the_mean_of_the_outline(self):
        flap = self.scene.mechanism.links[self.scene.mechanism.index["flap"]]
        outline = np.array(self.scene.outlines["flap"])
        assert len(outline) == 43
        assert outline.mean() + 0.11 == pytest.approx(0.0517233963 + 0.0015878093j, abs=1e-10)
        assert flap.points["G"] == pytest.approx(outline.mean(), abs=1e-12)

    def test_the_peak_comes_from_a_moment_of_inertia_with_wrong_dimension(self):
        mechanism = self.scene.mechanism
        flap = mechanism.links[mechanism.index["flap"]]
        (lump,) = flap.lumps
        assert lump.inertia == pytest.approx(2 * 0.12 / 3)
        light = with_link(mechanism, replace(flap, lumps=(replace(lump, inertia=2 * 0.12**2 / 3),)))
        right = replace(self.scene, course=replace(self.scene.course, mechanism=light))
        # 25408.6 N is the maximum of positions 0.1 ms apart; the peak between them is half a newton higher.
        assert self.force(*np.linspace(0, 50, 501), scene=right).max() == pytest.approx(25408.6, abs=0.05)
        assert self.force(*np.linspace(0.9, 0.91, 501), scene=right).max() == pytest.approx(25409.06, abs=5e-3)
