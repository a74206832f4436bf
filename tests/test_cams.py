"""Cams, compared with textbook formulas, equivalent linkages, and the balance of power."""

import csv
import json
import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from browser import Page, started
from msgspec.structs import replace

from kinelast import scene_from_dict
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.figures.peaks import run_figures
from kinelast.reports.trust import findings
from kinelast.runs import computed
from kinelast.scene.data import scene_deflection, scene_motion
from kinelast.scene.parts.cam_courses import (
    cam_flanks,
    cam_force,
    cam_lag,
    cam_pressure,
    cam_torque,
    force_by_vibration,
)
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from machine.cams import OUTER, Cam, cam_flank, contact_modulus, cut_depth, line_pressure
from machine.drives import inertia_force, inertia_moment
from rigid import drive_efforts, reactions

TAPPET = """
units = "mm"
points = {A = [6, 40], F = [-30, 40], G = [40, 40], T = [6, 90]}
links.ground = {points = {O = [0, 0]}}
links.tappet = {points = ["A", "F", "G", "T"], rigid = true, mass = "400 g", center = "A"}
sliders.guide = {link = "tappet", through = "A", direction = [0, 1]}
cams.plate = {follower = "tappet", centre = "O", roller = "A", roller_radius = 9, width = 8, material = "S235"}
[[drives]]
slider = "guide"
repeat = true
law = [
    {curve = "polynomial-345", duration = "40 ms", by = "12 mm"},
    {curve = "dwell", duration = "10 ms"},
    {curve = "cycloidal", duration = "30 ms", by = "-12 mm"},
    {curve = "dwell", duration = "20 ms"},
]
[run]
positions = 120
gravity = [0, -9.81]
"""

EQUIVALENT = """
units = "mm"
points = {O = [0, 0], A = [10, 0], B = [30, 55], C = [100, 60]}
links.ground = {points = ["O", "C"]}
links.crank = {points = ["O", "A"], rigid = true, mass = 0}
links.rod = {points = ["A", "B"], rigid = true, mass = 0}
links.rocker = {points = ["C", "B"], rigid = true, mass = "1 kg", center = "B", inertia = 2e-3}
cams.disc = {follower = "rocker", centre = "O", roller = "B", roller_radius = 8}
[[drives]]
link = "crank"
speed = "300 rpm"
start = 0
[run]
positions = 120
gravity = [0, -9.81]
"""

SLOTTED = """
units = "mm"
points = {O = [0, 0], A = [10, 0], C = [90, 25], P = [-40, 25], Q = [60, 25]}
links.ground = {points = ["O", "C"]}
links.crank = {points = ["O", "A"], rigid = true, mass = 0}
links.lever = {points = ["C", "P", "Q"], rigid = true, mass = "1 kg", center = "P", inertia = 1e-3}
slots.track = {point = "A", link = "crank", on = "lever", direction = [1, 0]}
cams.disc = {follower = "lever", centre = "O", face = ["P", "Q"], speed = "-240 rpm"}
[[drives]]
link = "crank"
speed = "-240 rpm"
[run]
positions = 120
"""


SWUNG = """
units = "mm"
points = {C = [0, 0], B = [200, 0], D = [200, 60]}
links.ground = {points = { C = [0, 0] }}
links.lever = {points = ["C", "B"], section = "bar", material = "light"}
materials.light = {E = "200 GPa", density = 1e-3}
sections.bar = {shape = "rectangle", depth = 12, width = 8}
cams.plate = {follower = "lever", centre = [190, -50], roller = "B", roller_radius = 10}
[[drives]]
link = "lever"
repeat = true
law = [
    {curve = "cycloidal", duration = "500 ms", by = "6 deg"},
    {curve = "cycloidal", duration = "500 ms", by = "-6 deg"},
]
[[springs]]
link = "lever"
at = "C"
preload = "5 N m"
[run]
positions = 120
beams = "euler-bernoulli"
"""


def tables(text, **more):
    return {**tomllib.loads(text), **more}


def with_cam(text, **keys):
    """Return tables with other keys of the only cam; None removes a key."""
    found = tomllib.loads(text)
    ((name, cam),) = found["cams"].items()
    found["cams"][name] = {key: value for key, value in {**cam, **keys}.items() if value is not None}
    return found


def cycle_of(given):
    return computed(scene_from_dict(given), Request(theory="quasi-static")).cycle


class TestTranslatingFollower:
    """R. L. Norton, Cam Design and Manufacturing Handbook, chapter 7; the plate cam turns in either sense."""

    @pytest.mark.parametrize("speed", ["600 rpm", "-600 rpm"])
    def test_a_roller_follower_agrees_with_the_handbook(self, speed):
        cycle = cycle_of(with_cam(TAPPET, speed=speed))
        (flank,) = cam_flanks(cycle, "plate")
        w = cycle.scene.cams["plate"].speed
        s, v, a = cycle.motion.drive[0], cycle.motion.drive_rate[0] / w, cycle.motion.drive_acceleration[0] / w**2
        offset, height = 6e-3, 40e-3 + s
        # tan of the pressure angle (s' - e)/(s + sqrt(Rp^2 - e^2)), with the offset on the side of the cam's
        # rotation.
        assert np.tan(flank.pressure_angle) == pytest.approx((v - offset) / height, abs=1e-14)
        # Curvature radius of the pitch curve: Norton's formula without offset; here by polar coordinates of the
        # centre.
        r, turned = np.hypot(offset, height), np.arctan2(height, offset)
        r1 = v * height / r  # derivative by the cam angle
        p1 = offset * v / r**2 - 1.0
        r2 = (v**2 + height * a) / r - v * height * r1 / r**2
        p2 = offset * (a / r**2 - 2 * v * r1 / r**3)
        x1, y1 = r1, r * p1
        x2, y2 = r2 - r * p1**2, 2 * r1 * p1 + r * p2
        curvature = -(x1 * y2 - y1 * x2) / np.hypot(x1, y1) ** 3
        assert flank.pitch_curvature == pytest.approx(curvature, rel=1e-12)
        assert flank.pitch == pytest.approx(r * np.exp(1j * (turned - w * cycle.motion.time)), abs=1e-15)
        assert abs(flank.pitch - flank.profile) == pytest.approx(9e-3, rel=1e-13)

    def test_radius_of_curvature_without_offset(self):
        """((Rp + s)^2 + s'^2)^(3/2) / ((Rp + s)^2 + 2 s'^2 - s'' (Rp + s))."""
        given = tables(TAPPET)
        given["points"].update(A=[0, 40])
        cycle = cycle_of(given)
        (flank,) = cam_flanks(cycle, "plate")
        w = cycle.scene.cams["plate"].speed
        r = 0.04 + cycle.motion.drive[0]
        v, a = cycle.motion.drive_rate[0] / w, cycle.motion.drive_acceleration[0] / w**2
        radius = (r**2 + v**2) ** 1.5 / (r**2 + 2 * v**2 - a * r)
        assert 1 / flank.pitch_curvature == pytest.approx(radius, rel=1e-12)
        assert flank.radius == pytest.approx(radius - 9e-3, rel=1e-12)

    @pytest.mark.parametrize("speed", ["600 rpm", "-600 rpm"])
    def test_flat_face(self, speed):
        """Radius Rb + s + s'', contact at s' from the shaft, and the handbook's parametric profile."""
        cycle = cycle_of(with_cam(TAPPET, speed=speed, roller=None, roller_radius=None, face=["F", "G"]))
        (flank,) = cam_flanks(cycle, "plate")
        w = cycle.scene.cams["plate"].speed
        s, v, a = cycle.motion.drive[0], cycle.motion.drive_rate[0] / w, cycle.motion.drive_acceleration[0] / w**2
        assert flank.radius == pytest.approx(40e-3 + s + a, abs=1e-15)
        assert flank.contact == pytest.approx(v + 1j * (40e-3 + s), abs=1e-15)
        assert np.abs(flank.pressure_angle).max() < 1e-14
        assert flank.face_margin == pytest.approx(np.minimum(30e-3 + v, 40e-3 - v), abs=1e-15)

    def test_curvature_agrees_with_the_profile(self):
        """Finite differences of profile points, for a roller and a face."""
        for keys in ({}, {"roller": None, "roller_radius": None, "face": ["F", "G"]}):
            scene = scene_from_dict(with_cam(TAPPET, **keys))
            time = 0.011 + 1e-5 * np.arange(-1, 2)
            flank = cam_flank(scene.course.at(time), scene.cams["plate"])
            before, here, after = flank.profile
            one, two = after - here, here - before
            bend = 2 * (two.conjugate() * one).imag / abs(one * two * (after - before))
            assert abs(bend) == pytest.approx(1 / abs(flank.radius[1]), rel=1e-5)


class TestEquivalentLinkages:
    def test_disc_under_a_swinging_roller(self):
        """A coupler from the disc's centre to the roller gives the same motion, force and torque."""
        cycle = cycle_of(with_cam(EQUIVALENT, push=False))
        (flank,), names = cam_flanks(cycle, "disc"), [joint.name for joint in cycle.motion.structure.joints]
        length = abs(20 + 55j) * 1e-3
        assert np.abs(np.abs(flank.profile - 0.01) - (length - 0.008)).max() < 1e-16
        assert flank.radius == pytest.approx(length - 0.008, rel=1e-13)
        assert cut_depth(flank).max() < 1e-16
        force = cam_force(cycle, "disc")
        assert np.abs(force) == pytest.approx(np.abs(cycle.deflection.forces.force[names.index("B")]), rel=1e-9)
        assert cam_torque(cycle, "disc") == pytest.approx(cycle.efforts[0], abs=1e-14)

    def test_ring_about_a_swinging_roller(self):
        cycle = cycle_of(with_cam(EQUIVALENT, flank="outer"))
        (flank,) = cam_flanks(cycle, "disc")
        length = abs(20 + 55j) * 1e-3
        assert np.abs(np.abs(flank.profile - 0.01) - (length + 0.008)).max() < 1e-16
        assert flank.radius == pytest.approx(-(length + 0.008), rel=1e-13)
        assert not flank.undercut.any()
        inside = cycle_of(tables(EQUIVALENT))
        assert cam_force(cycle, "disc") == pytest.approx(-cam_force(inside, "disc"), rel=1e-12)
        assert cam_torque(cycle, "disc") == pytest.approx(cam_torque(inside, "disc"), rel=1e-9, abs=1e-12)

    def test_disc_under_a_swinging_face(self):
        """The disc's centre slides in a slot parallel to the face."""
        cycle = cycle_of(with_cam(SLOTTED, push=False))
        (flank,) = cam_flanks(cycle, "disc")
        assert np.abs(np.abs(flank.profile - 0.01) - 0.025).max() < 1e-16
        assert flank.radius == pytest.approx(0.025, rel=1e-12)
        names = [joint.name for joint in cycle.motion.structure.joints]
        pull = np.abs(cycle.deflection.forces.force[names.index("A")])
        assert np.abs(cam_force(cycle, "disc")) == pytest.approx(pull, rel=1e-9)
        assert cam_torque(cycle, "disc") == pytest.approx(cycle.efforts[0], abs=1e-14)


class TestForces:
    def test_the_shaft_has_the_power_of_the_drive(self):
        cycle = cycle_of(with_cam(TAPPET, speed="-600 rpm", push=False))
        power = cam_torque(cycle, "plate") * cycle.scene.cams["plate"].speed
        given = cycle.efforts[0] * cycle.motion.drive_rate[0]
        assert power == pytest.approx(given, abs=1e-14 * np.abs(given).max())

    def test_force_at_rest(self):
        """In a dwell the contact carries the weight divided by the cosine of the pressure angle."""
        cycle = cycle_of(tables(TAPPET))
        (flank,), still = cam_flanks(cycle, "plate"), np.isclose(cycle.motion.time, 0.045)
        assert still.any()
        expected = 0.4 * 9.81 / np.cos(flank.pressure_angle[still])
        assert cam_force(cycle, "plate")[still] == pytest.approx(expected, rel=1e-12)

    def test_the_preload_keeps_contact(self):
        """With the reported preload along the drive, the smallest force is 0."""
        given = tables(TAPPET)
        peaks = computed(scene_from_dict(given), Request()).figures.peaks
        (least,), (preload,) = peaks["cam_least_force"], peaks["cam_preload"]
        assert least.value < 0 < preload.value
        given["loads"] = [{"link": "tappet", "point": "A", "force": [0, -preload.value]}]
        (least,) = computed(scene_from_dict(given), Request()).figures.peaks["cam_least_force"]
        assert least.value == pytest.approx(0.0, abs=1e-12 * preload.value)

    def test_a_groove_presses_with_either_flank(self):
        groove = cycle_of(with_cam(TAPPET, flank="both"))
        inner, outer = cam_flanks(groove, "plate")
        assert outer.profile - inner.profile == pytest.approx(18e-3 * inner.normal * inner.turn.conjugate(), abs=1e-15)
        alone = [cycle_of(with_cam(TAPPET, flank=flank)) for flank in ("inner", "outer")]
        force, pressure = cam_force(groove, "plate"), cam_pressure(groove, "plate")
        for at, (sign, cycle) in enumerate(zip((1, -1), alone, strict=True)):
            presses = sign * force > 0
            assert presses.any(), at
            assert pressure[presses] == pytest.approx(cam_pressure(cycle, "plate")[presses], rel=1e-12)
        peaks = computed(groove.scene, Request()).figures.peaks
        assert peaks["cam_preload"] == [] == peaks["cam_least_force"]


class TestPush:
    """The contact force of the cam replaces the drive's effort."""

    @pytest.mark.parametrize(
        ("text", "pivot", "keys"), [(EQUIVALENT, "C", {}), (EQUIVALENT, "C", {"flank": "outer"}), (SLOTTED, "C", {})]
    )
    def test_the_lever_is_loaded_like_in_the_equivalent_linkage(self, text, pivot, keys):
        """The drive has no effort, the crank has no force, and the lever's pivot has the force of the linkage."""
        pushed, linked = cycle_of(with_cam(text, **keys)), cycle_of({**tables(text), "cams": {}})
        alone = cycle_of(with_cam(text, push=False, **keys))
        names = [joint.name for joint in linked.motion.structure.joints]
        before, after = (cycle.deflection.forces.force for cycle in (linked, pushed))
        greatest = max(np.abs(force).max() for force in before)
        at, crank = names.index(pivot), names.index("O")
        assert after[at] == pytest.approx(before[at], abs=1e-11 * greatest)
        assert np.abs(after[crank]).max() < 1e-11 * greatest
        assert np.abs(pushed.efforts).max() < 1e-11 * np.abs(linked.efforts).max()
        assert cam_force(pushed, "disc") == pytest.approx(cam_force(alone, "disc"), rel=1e-9)
        assert cam_torque(pushed, "disc") == pytest.approx(linked.efforts[0], rel=1e-9, abs=1e-11)

    def test_the_guide_carries_the_lateral_force(self):
        """The lateral force is the contact force times the sine of the pressure angle."""
        cycle = cycle_of(tables(TAPPET))
        (flank,), force = cam_flanks(cycle, "plate"), cam_force(cycle, "plate")
        assert np.abs(cycle.efforts).max() < 1e-12 * np.abs(force).max()
        across = np.real(cycle.deflection.forces.force[0])
        assert across == pytest.approx(-force * flank.normal.real, abs=1e-12 * np.abs(force).max())
        assert np.abs(across) == pytest.approx(np.abs(force * np.sin(flank.pressure_angle)), rel=1e-10, abs=1e-12)

    def test_the_contact_force_bends_the_follower(self):
        """A lever under a moment at its pivot is a cantilever on the cam; a drive at the pivot keeps it straight."""
        pushed, driven = (cycle_of(with_cam(SWUNG, push=push)) for push in (True, False))
        assert np.abs(pushed.along("M").value) == pytest.approx([5.0], rel=1e-6)
        assert np.abs(driven.along("M").value) < 1e-5

    def test_lag_of_a_cantilever(self):
        """A lever presses its end on the cam by a moment M about its pivot: M l/(3 E I), and the compression."""
        cycle = cycle_of(tables(SWUNG))
        (flank,) = cam_flanks(cycle, "plate")
        assert cam_force(cycle, "plate") * flank.lever == pytest.approx(np.full(120, 5.0), rel=1e-6)
        bends, shortens = 0.2 / (3 * 200e9 * 8e-3 * 12e-3**3 / 12), 1 / (0.2 * 200e9 * 8e-3 * 12e-3)
        expected = -5.0 * (bends + np.tan(flank.pressure_angle) ** 2 * shortens)
        assert cam_lag(cycle, "plate") == pytest.approx(expected, rel=1e-6)

    def test_inertia_force_of_the_lag(self):
        """A heavy lever with mass per length m lags by (1/9 - 0.55/6) m a l^4/(E I); harmonic: a'' = (pi/T)^2 a.

        1/9 is due to the force on its end, and 0.55/6 is due to its inertia forces.
        """
        given = tables(SWUNG)
        given["materials"]["light"]["density"] = 1e5
        given["drives"][0]["law"] = [{**segment, "curve": "harmonic"} for segment in given["drives"][0]["law"]]
        cycle = cycle_of(given)
        (flank,), mass, frequency = cam_flanks(cycle, "plate"), 1e5 * 8e-3 * 12e-3, np.pi / 0.5
        acceleration = np.radians(6) * frequency**2 / 2
        per_acceleration = (1 / 9 - 0.55 / 6) * mass * 0.2**4 / (200e9 * 8e-3 * 12e-3**3 / 12)
        expected = mass * 0.2**3 / 3 * per_acceleration * acceleration * frequency**2 / np.abs(flank.lever).mean()
        assert force_by_vibration(cycle, "plate") == (pytest.approx(expected, rel=0.05), True)

    def test_the_inertia_force_of_a_law_with_jerk_jumps_is_a_lower_bound(self):
        """The jerk of the cycloidal law jumps where the lever returns, and the lag has a kink there."""
        given = tables(SWUNG)
        given["materials"]["light"]["density"] = 1e5
        assert not force_by_vibration(cycle_of(given), "plate")[1]

    def test_the_force_by_vibration_is_reported(self):
        (told,) = (
            each
            for each in findings(computed(scene_from_dict(tables(VALVE_TRAIN)), Request()))
            if each.heading == "Cams"
        )
        assert told.level == "caution", "the change is 15 % of the smallest force"
        assert told.text.startswith(
            "Vibration of the links against the cam inlet changes its contact force by about 12 N"
        )

    def test_two_cams_in_series(self):
        """One follower is on another, and no drive has an effort."""
        given = tables(TAPPET)
        given["points"].update(B=[60, 120], D=[60, 150])
        given["links"]["table"] = {"points": ["B", "D"], "rigid": True, "mass": "200 g", "center": "B"}
        given["sliders"]["top"] = {"link": "table", "on": "tappet", "through": "B", "direction": [1, 1]}
        law = [{**piece, "by": -0.3 * float(piece["by"].split()[0])} if "by" in piece else piece
               for piece in given["drives"][0]["law"]]  # fmt: skip
        given["drives"].append({"slider": "top", "repeat": True, "law": law})
        given["cams"]["plate"]["drive"] = "guide"
        given["cams"]["upper"] = {"follower": "table", "centre": [30, 20], "roller": "B", "drive": "top"}
        pushed = cycle_of(given)
        for cam in given["cams"].values():
            cam["push"] = False
        alone = cycle_of(given)
        assert np.abs(pushed.efforts).max() < 1e-11 * np.abs(alone.efforts).max()
        assert np.abs(alone.efforts).min(axis=1).max() > 0

    @pytest.mark.slow
    @pytest.mark.parametrize("theory", ["elastodynamic", "geometrically-exact"])
    def test_every_theory_includes_the_cam(self, theory):
        """A stiff follower at low speed: all theories agree with the quasi-static answer."""
        given = tables(EQUIVALENT)
        given["links"]["rocker"] = {"points": ["C", "B"], "section": "bar", "material": "S235"}
        given["sections"] = {"bar": {"shape": "rectangle", "depth": 12, "width": 8}}
        given["drives"][0]["speed"] = "30 rpm"
        static = computed(scene_from_dict(given), Request(theory="quasi-static")).figures.peaks
        moving = computed(scene_from_dict(given), Request(theory=theory)).figures.peaks
        for key in ("cam_force", "joint_force", "deflection"):
            found, expected = (max(abs(peak.value) for peak in peaks[key]) for peaks in (moving, static))
            assert found == pytest.approx(expected, rel=1e-3), key


class TestPressure:
    def test_line_contact(self):
        """J. E. Shigley, Mechanical Engineering Design, equations (3-73) and (3-74): b, and p = 2 F/(pi b l)."""
        force, length, d1, d2 = 812.0, 0.02, 0.04, -0.13
        e1, n1, e2, n2 = 207e9, 0.292, 100e9, 0.211
        half = np.sqrt(2 * force / (np.pi * length) * ((1 - n1**2) / e1 + (1 - n2**2) / e2) / (1 / d1 + 1 / d2))
        found = line_pressure(force, length, 2 / d1 + 2 / d2, contact_modulus(e1, n1, e2, n2))
        assert found == pytest.approx(2 * force / (np.pi * half * length), rel=1e-14)

    def test_coefficient_of_handbooks(self):
        """0.418 sqrt(F E/(l R)) for two bodies of the same material with Poisson's ratio 0.3."""
        assert line_pressure(1.0, 1.0, 1.0, contact_modulus(1.0, 0.3, 1.0, 0.3)) == pytest.approx(0.418, abs=5e-4)

    def test_relative_curvature(self):
        """It combines those of the roller and of a convex or concave cam."""
        for keys in ({}, {"flank": "outer"}):
            (flank,) = cam_flanks(cycle_of(with_cam(TAPPET, **keys)), "plate")
            assert flank.relative_curvature == pytest.approx(1 / 9e-3 + 1 / flank.radius, rel=1e-12)

    def test_tension_has_no_pressure(self):
        cycle = cycle_of(tables(TAPPET))
        assert (np.isnan(cam_pressure(cycle, "plate")) == (cam_force(cycle, "plate") < 0)).all()


class TestUndercut:
    def test_large_roller(self):
        """A roller above the smallest radius of the pitch curve undercuts; a smaller one does not."""
        given = steep(TAPPET)
        curvature = cam_flanks(cycle_of(given), "plate")[0].pitch_curvature
        for share, cut in ((0.97, False), (1.3, True)):
            given["cams"]["plate"]["roller_radius"] = 1e3 * share / curvature.max()
            cycle = cycle_of(given)
            (flank,) = cam_flanks(cycle, "plate")
            assert flank.undercut.any() == cut
            assert (flank.convex_radius.min() < 0) == cut
            assert (cut_depth(flank).max() > 1e-5) == cut

    def test_flat_face_undercut(self):
        """The profile is undercut if -(s + s'') exceeds the base radius."""
        given = with_cam(TAPPET, roller=None, roller_radius=None, face=["F", "G"])
        for height, cut in ((40, False), (8, True)):
            given["points"].update(F=[-30, height], G=[40, height])
            (flank,) = cam_flanks(cycle_of(given), "plate")
            assert flank.undercut.any() == cut
            assert (cut_depth(flank).max() > 1e-5) == cut

    def test_roller_larger_than_the_cam(self):
        """A roller larger than the disc that it would roll on removes all of the disc."""
        time = np.linspace(0, 1, 400, endpoint=False)
        scene = scene_from_dict(tables(EQUIVALENT))
        moved = scene.course.at(0.2 * time)
        flank = cam_flank(moved, Cam(3, 0, 0j, 10 * np.pi, roller=scene.cams["disc"].roller, radius=0.07))
        assert flank.undercut.all()
        assert cut_depth(flank).max() > 0.01


class TestFigures:
    @pytest.mark.parametrize("push", [True, False])
    def test_designs_have_the_figures_of_a_single_run(self, push):
        keys = ["cam_pressure_angle", "cam_radius", "cam_force.plate", "cam_torque", "cam_pressure", "cam_preload",
                "cam_least_force", "cam_distance"]  # fmt: skip
        paths = ["cams.plate.roller_radius", "cams.plate.centre.x", "cams.plate.width", "links.tappet.mass"]
        given = with_cam(TAPPET, centre=[0, 0], push=push)
        values = np.array([[0.008, 0.001, 0.01, 0.3], [0.012, -0.002, 0.02, 0.5]])
        found = evaluate(given, paths, values, keys)
        assert not found.reason.any()
        for row, (radius, x, width, mass) in enumerate(values):
            alone = with_cam(TAPPET, centre=[1e3 * x, 0], roller_radius=1e3 * radius, width=1e3 * width, push=push)
            alone["links"]["tappet"]["mass"] = mass
            results = computed(scene_from_dict(alone), Request())
            peaks = run_figures(results.cycle, None).peaks  # at the positions, like those of designs
            for key in keys:
                value = peaks[key.partition(".")[0]][0].value
                magnitude = value if key in ("cam_radius", "cam_least_force") else abs(value)
                assert found.columns[key][row] == pytest.approx(magnitude, rel=1e-9), key

    def test_the_cam_follows_the_speed_of_the_drive(self):
        """A cam without speed makes one turn per run, for any duration."""
        found = evaluate(tables(EQUIVALENT), ["drives.crank.speed"], [[31.0], [62.0]], ["cam_radius", "cam_force"])
        assert found.columns["cam_radius"] == pytest.approx(np.full(2, abs(0.02 + 0.055j) - 0.008), rel=1e-12)
        assert found.columns["cam_force"][1] > 2 * found.columns["cam_force"][0]

    def test_limits_of_a_cam(self):
        given = with_cam(TAPPET, pressure="900 MPa", pressure_angle="10 deg", radius="5 mm", hollow_radius="5 mm")
        given["loads"] = [{"link": "tappet", "point": "A", "force": [0, -40]}]
        from kinelast.reports.summary import summary

        summarized = summary(computed(scene_from_dict(given), Request()))
        outcomes = {row["kind"]: row["outcome"] for row in summarized["acceptance"]["limits"]}
        expected = {"cam_pressure": "kept", "cam_pressure_angle": "not kept", "cam_radius": "kept"}
        assert expected.items() <= outcomes.items()


def scene_error(given):
    with pytest.raises(SceneError) as caught:
        scene_from_dict(given, "scene", "scene.toml")
    return str(caught.value)


class TestMistakes:
    @pytest.mark.parametrize(
        ("keys", "message"),
        [
            ({"follower": "tapet"}, '[cams.plate] follower: there is no moving link "tapet"; did you mean "tappet"?'),
            ({"follower": "ground"}, "there is no moving link"),
            ({"roller": None}, "[cams.plate] roller: expected either roller"),
            ({"face": ["F", "G"]}, "expected either roller (its centre) or face"),
            ({"roller": "B"}, '[cams.plate] roller: the link "tappet" has no point "B"'),
            ({"roller": None, "face": ["F", "G"]}, "roller_radius: belongs to a roller"),
            ({"roller": None, "roller_radius": None, "face": ["F", "X"]}, 'face: the link "tappet" has no point "X"'),
            ({"roller": None, "roller_radius": None, "face": ["F", "F"]}, "face: expected two different points"),
            ({"roller": None, "roller_radius": None, "face": ["F", "G"], "flank": "both"}, "flank: a flat face needs"),
            ({"centre": "A"}, '[cams.plate] centre: the link "ground" has no point "A"'),
            ({"centre": [6, 40]}, '[cams.plate] roller: "A" is drawn at the centre of the camshaft'),
            ({"roller_radius": 45}, "roller_radius: a roller of 45 mm covers the camshaft, 40.45 mm from"),
            ({"drive": "guid"}, '[cams.plate] drive: there is no drive "guid"; did you mean "guide"?'),
            ({"speed": "500 rpm"}, "speed: makes 0.833333 turns in the run of 0.1 s, expected whole turns: 600 rpm is"),
            ({"speed": 0}, "speed: makes 0 turns"),
            ({"speed": "1200 rpm"}, 'speed: the slide of the drive "guide" is up to 12 mm off after a turn of the cam'),
            ({"material": "S23"}, '[cams.plate] material: there is no material "S23"'),
            ({"material": None, "pressure": "1 GPa"}, "material: the key is missing"),
            ({"material": None, "follower_material": "S235"}, "follower_material: needs material"),
            (
                {"roller_radius": None, "pressure": "1 GPa"},
                "roller_radius: the key is missing: the pressure of a knife edge",
            ),
        ],
    )
    def test_the_message_names_the_cam(self, keys, message):
        error = scene_error(with_cam(TAPPET, **keys))
        assert message in error
        assert error.startswith("scene.toml: [cams.plate]")

    def test_a_law_that_does_not_return(self):
        given = tables(TAPPET)
        drive = given["drives"][0]
        drive["repeat"] = False
        drive["law"] = drive["law"][:2]
        given["run"]["duration"] = "50 ms"
        assert 'the slide of the drive "guide" is up to 12 mm off after a turn of the cam' in scene_error(given)
        drive["law"] = [{"curve": "constant-speed", "duration": "50 ms", "by": "-5 mm"}]
        assert "5 mm off" in scene_error(given)

    def test_a_drive_with_an_effort(self):
        given = tables(TAPPET)
        given["drives"] = [{"slider": "guide", "effort": "5 N"}]
        given["run"]["duration"] = "50 ms"
        assert 'drive: the drive "guide" is an effort: a cam needs a drive' in scene_error(given)

    def test_a_drive_with_a_cylinder(self):
        given = tables(TAPPET, cylinders={"jack": {"bore": 40}})
        given["drives"][0]["cylinder"] = "jack"
        assert 'drive: the drive "guide" has a cylinder' in scene_error(given)

    def test_a_second_cam_of_a_drive(self):
        given = tables(TAPPET)
        given["cams"]["second"] = given["cams"]["plate"]
        error = scene_error(given)
        assert '[cams.second] drive: the drive "guide" is already moved by the cam "plate"' in error

    def test_the_drive_must_be_named_if_there_are_several(self):
        given = with_cam(EQUIVALENT)
        given["points"].update(D=[-50, 0])
        given["links"]["ground"]["points"].append("Z")
        given["points"].update(Z=[0, -50], Y=[0, -80])
        given["links"]["wheel"] = {"points": ["Z", "Y"], "rigid": True, "mass": 0.1, "center": "Z", "inertia": 1e-4}
        given["drives"].append({"link": "wheel", "speed": "300 rpm"})
        assert re.search(
            'drive: the key is missing: name the drive that the cam moves, one of "crank", "wheel"', scene_error(given)
        )
        given["cams"]["disc"]["drive"] = "crank"
        assert scene_from_dict(given).cams["disc"].drive == 0
        given["cams"]["disc"]["drive"] = "wheel"
        expected = '[cams.disc] drive: the drive "wheel" does not move "B" of the link "rocker"'
        assert expected in scene_error(given)


def steep(text):
    """Return tables with a law that makes the path of the roller convex and concave."""
    given = tables(text)
    given["points"]["A"] = [6, 30]
    for segment, lasts, more in ((0, 20, {"by": 25}), (1, 1, {}), (2, 20, {"by": -25}), (3, 59, {})):
        given["drives"][0]["law"][segment] |= {"duration": f"{lasts} ms", **more}
    return given


def test_a_ring_is_undercut_if_the_roller_is_too_large():
    """The limit is the smallest concave radius of the path."""
    scene = scene_from_dict(steep(TAPPET))
    moved, cam = scene_motion(scene), scene.cams["plate"]
    bend = -cam_flank(moved, cam).pitch_curvature.min()
    assert bend > 0
    for share, cut in ((0.95, False), (1.05, True)):
        ring = cam_flank(moved, replace(cam, radius=share / bend, flank=OUTER), outer=True)
        assert ring.undercut.any() == cut


def test_knife_edge():
    """A knife edge has no undercut, the force of any roller, and no finite pressure."""
    scene = scene_from_dict(tables(TAPPET))
    moved, cam = scene_motion(scene), scene.cams["plate"]
    effort = drive_efforts(moved, scene_deflection(scene, moved).forces)[0] + 3.0
    edge = cam_flank(moved, replace(cam, radius=0.0))
    assert not edge.undercut.any()
    assert np.isnan(edge.relative_curvature).all()
    assert edge.force(effort) == pytest.approx(cam_flank(moved, cam).force(effort), rel=1e-12)
    assert edge.profile == pytest.approx(edge.pitch, abs=0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    pytest.importorskip("ezdxf")
    out = tmp_path_factory.mktemp("cams")
    scene = out / "groove.toml"
    scene.write_text(TAPPET.replace("width = 8", 'width = 8, flank = "both"'), encoding="utf-8")
    options = ("--quiet", "--dxf", "--positions", "60", "--theory", "quasi-static")
    assert main([str(scene), *options, "-o", str(out)]) == 0
    return out / "groove"


class TestOutputs:
    """Summary, tables and drawings of a groove for a roller of 18 mm diameter."""

    @pytest.mark.slow
    def test_profile_as_a_table(self, folder):
        with (folder / "cam_plate.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == 1440
        pitch, inner, outer = (
            np.array([complex(float(row[f"{name}.x [mm]"]), float(row[f"{name}.y [mm]"])) for row in rows])
            for name in ("pitch", "profile", "outer")
        )
        assert np.abs(pitch - inner) == pytest.approx(9, rel=1e-12)
        assert (inner + outer) / 2 == pytest.approx(pitch, abs=1e-12)
        angle = np.array([float(row["angle [rad]"]) for row in rows])
        turned = pitch * np.exp(1j * angle)  # relative to the ground the roller stays in its guide
        assert turned.real == pytest.approx(6, abs=1e-12)

    @pytest.mark.slow
    def test_profile_as_drawings(self, folder):
        ezdxf = pytest.importorskip("ezdxf")
        space = ezdxf.readfile(folder / "cam_plate.dxf").modelspace()
        layers = {each.dxf.layer: each for each in space.query("LWPOLYLINE")}
        assert set(layers) == {"cam plate", "cam plate outer", "pitch plate"}
        assert all(each.closed for each in layers.values())
        corners = np.array([complex(x, y) for x, y in layers["pitch plate"].get_points("xy")])
        assert corners[0] == pytest.approx(6 + 40j, abs=1e-9)
        assert space.query("CIRCLE")[0].dxf.center.isclose((0, 0, 0))
        root = ElementTree.parse(folder / "cam_plate.svg").getroot()
        drawn = {layer.find("{*}title").text: layer.find("{*}polygon") for layer in root}
        pairs = [pair.split(",") for pair in drawn["pitch plate"].get("points").split()]
        places = np.array([complex(float(x), -float(y)) for x, y in pairs])
        assert places - places[0] == pytest.approx(corners - corners[0], abs=1e-5)

    @pytest.mark.slow
    def test_summary_and_positions(self, folder):
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        cam = summary["cams"]["plate"]
        assert cam["speed"]["value"] == pytest.approx(20 * np.pi)
        assert cam["flank"] == "both"
        assert cam["undercut"] == cam["contact_lost"] == []
        assert cam["counts"] == {"undercut": 0, "contact_lost": 0}
        with (folder / "positions.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        force = np.array([float(row["plate.force [N]"]) for row in rows])
        assert np.abs(force).max() == pytest.approx(abs(cam["figures"]["cam_force"]["value"]), rel=1e-9)

    @pytest.mark.slow
    def test_the_page_draws_the_cam(self, folder):
        driver = started()
        try:
            page = Page(driver, folder / "report.html")
            assert page.run("return document.querySelectorAll('#cams svg.cam').length") == 1
            assert page.run("return document.querySelectorAll('#cams .body').length") == 1
            places = page.run(
                "kinelast.showPosition(20); const roller = document.querySelector('#cams .roller');"
                "return [roller.getAttribute('cx'), roller.getAttribute('cy'), roller.getAttribute('r')].map(Number)"
            )
            assert places == pytest.approx([0.006, -places[1] * -1, 0.009], abs=1e-9)
            assert places[1] < -0.04
            assert not [each for each in page.logs() if each["level"] == "SEVERE"]
        finally:
            driver.quit()


FLAT = {"roller": None, "roller_radius": None}


@pytest.mark.parametrize(
    ("given", "pressed", "level", "why", "words"),
    [
        ({}, 0, "caution", "the follower leaves the cam plate", "in part of the run"),
        ({}, -400, "caution", "the follower leaves the cam plate", "throughout the run"),
        ({"roller_radius": 39}, 40, "poor", "the cam plate cannot be made", "is undercut"),
        (
            {**FLAT, "face": ["A", "G"]},
            40,
            "poor",
            "the contact on the cam plate runs off the face",
            "make the face longer",
        ),
        (
            {**FLAT, "face": ["A", "T"]},
            40,
            "poor",
            "the cam plate cannot push its follower; ",
            "the pressure angle is 90",
        ),
        ({}, 40, "", "", ""),
    ],
)
def test_a_machine_with_a_failing_cam_is_not_acceptable(given, pressed, level, why, words):
    """This holds for designs in all interfaces; the other figures keep their limits."""
    from kinelast.reports.limits import outcome_indices
    from kinelast.reports.summary import summary
    from live.answer import limit_rows

    scene = with_cam(TAPPET, **given)
    scene["loads"] = [{"link": "tappet", "point": "A", "force": [0, -pressed]}]
    scene["limits"] = {"figures": {"shaking_force": "1 MN"}}
    results = computed(scene_from_dict(scene), Request())
    acceptance = summary(results)["acceptance"]
    assert acceptance["verdict"] == ("cannot be judged" if why else "acceptable")
    assert acceptance["problem"].startswith(why)
    cams = [each for each in findings(results) if each.heading == "Cams"]
    assert [each.level for each in cams][:1] == [level] * bool(level)
    assert not words or words in cams[0].text
    values = {
        key: np.array([abs(peak.value) if key in ("cam_force", "shaking_force") else peak.value for peak in peaks])
        for key, peaks in results.figures.peaks.items()
    }
    assert [int(each) for each in outcome_indices(results.scene, values)] == [1 if why else 3]
    assert [row["kept"] for row in limit_rows(results.scene, values)] == [not why]
    kept = evaluate(scene, ["links.tappet.mass"], [[0.4], [0.41]], ["limits_kept"]).columns["limits_kept"]
    assert kept.tolist() == [0.0 if why else 1.0] * 2


def test_figures_at_dead_points_raise_no_warnings():
    """A crank at constant speed moves the slider with the roller, whose line passes through the shaft."""
    given = tables(EQUIVALENT, cams={"disc": {"follower": "rod", "centre": "O", "roller": "B", "roller_radius": 5}})
    given["points"] = {"O": [0, 0], "A": [50, 0], "B": [250, 0]}
    given["links"]["ground"]["points"] = ["O"]
    del given["links"]["rocker"]
    given["links"]["crank"] |= {"mass": 0.1, "center": "A", "inertia": 1e-5}
    given["links"]["piston"] = {"points": ["B"], "rigid": True, "mass": "300 g"}
    given["sliders"] = {"guide": {"link": "piston", "through": "B", "direction": [1, 0]}}
    peaks = computed(scene_from_dict(given), Request(theory="quasi-static")).figures.peaks
    assert np.isfinite(peaks["cam_radius"][0].value)


@pytest.mark.parametrize("angle", ["0 deg", "90 deg", "-5 deg"])
def test_the_limit_of_the_pressure_angle_is_acute(angle):
    assert "pressure_angle: expected an angle above 0 and below 90 deg" in scene_error(
        with_cam(TAPPET, pressure_angle=angle)
    )


def test_findings_on_cams():
    """An undercut cam is poor, a cam that the follower leaves is a caution."""
    large = steep(TAPPET)
    large["cams"]["plate"]["roller_radius"] = 29
    (cut, _), (left,) = (
        [each for each in findings(computed(scene_from_dict(given), Request())) if each.heading == "Cams"]
        for given in (large, tables(TAPPET))
    )
    assert cut.level == "poor"
    assert re.match(r"The cam plate cannot be made: its profile is undercut \(smallest radius \S+ mm", cut.text)
    assert left.level == "caution"
    assert "leaves the cam plate in part of the run: a spring with 29.59 N along the drive holds it" in left.text


VALVE_TRAIN = (Path(__file__).parents[1] / "docs/gallery/valve_train.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("push", [True, False])
@pytest.mark.parametrize("text", [VALVE_TRAIN, SLOTTED], ids=["roller", "face"])
def test_the_force_on_the_ground_is_the_inertia_force(text, push):
    """The camshaft passes the contact force on to the ground, as the bearing of a drive does."""
    tables = tomllib.loads(text)
    [cam] = tables["cams"].values()
    cam["push"] = push
    motion = scene_motion(scene_from_dict(tables))
    held = reactions(motion)
    largest = max(np.abs(force).max() for force in held.force)
    np.testing.assert_allclose(held.ground_force, inertia_force(motion), atol=1e-10 * largest)
    np.testing.assert_allclose(held.ground_moment, inertia_moment(motion), atol=1e-10 * largest)
