"""Motion and force in a scene: slots, gears, repeated laws, tables, efforts and springs."""

from math import pi

import numpy as np
import pytest
from scene_texts import FOUR_BAR, MESH, WHEEL, YOKE, edited

from kinelast.cli.command import main
from kinelast.reports.sections import law_figures
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.values.error import SceneError
from rigid import drive_efforts, position_of, reactions
from rigid.analysis import LinkAngle, Slide


def efforts(text):
    course = scene_motion(scene_from_text(text))
    return course, drive_efforts(course, reactions(course))[0]


def driven(*lines):
    return edited(WHEEL, ("start = 0\nspeed = 2", "\n".join(lines)))


class TestSlots:
    """A pin in a slot is a massless block."""

    def test_a_scotch_yoke_follows_the_cosine(self):
        scene = scene_from_text(YOKE)
        course = scene_motion(scene)
        angle = course.drive[0]
        place = position_of(course, "yoke", "Y")
        assert place == pytest.approx(0.2 + 0.1 * np.cos(angle), abs=1e-15)
        assert Slide("slot").value(course) == pytest.approx(0.1 * np.sin(angle), abs=1e-15)
        # Inertia of the yoke alone: m r^2 w^2 cos sin at the crank.
        effort = drive_efforts(course, reactions(course))[0]
        assert effort == pytest.approx(2 * 0.1**2 * 100 * np.cos(angle) * np.sin(angle), abs=1e-12)

    def test_a_pin_of_the_ground_in_a_moving_slot(self):
        # A bar slides through a swivel at D (Whitworth's inversion), so it points from A to D.
        text = edited(
            YOKE,
            ("Y = [0.3, 0]\nZ = [0.3, 0.2]", "D = [0.3, 0]"),
            ('points = ["O"]', 'points = ["O", "D"]'),
            ("[links.yoke]\npoints = {Y = [0, 0], Z = [0, 0.2]}", "[links.yoke]\npoints = {A = [0, 0], D1 = [0.2, 0]}"),
            ('center = "Y"', 'center = "A"'),
            ('[sliders.guide]\nlink = "yoke"\nthrough = "Y"\ndirection = [1, 0]\n', ""),
            ('point = "A"\nlink = "crank"', 'point = "D"\nlink = "ground"'),
            ("direction = [0, 1]", "direction = [1, 0]"),
            ("[links.ground]", "D1 = [0.3, 0]\n[links.ground]"),
        )
        course = scene_motion(scene_from_text(text))
        way = 0.3 - position_of(course, "crank", "A")
        assert course.direction[course.mechanism.index["yoke"]] == pytest.approx(way / np.abs(way), abs=1e-14)

    def test_a_slot_can_be_driven_and_define_a_load(self):
        text = edited(
            YOKE,
            ('link = "crank"\nspeed = 10', 'slider = "slot"\nspeed = "0.1 m/s"'),
            ("positions = 24", 'positions = 3\nduration = "0.5 s"'),
            ("[[drives]]", '[[loads]]\nlink = "yoke"\npoint = "Y"\nforce = [1, 0]\nagainst = {slider = "slot"}\n'
                           'table = [[0, 0], ["50 mm", 5]]\n[[drives]]'),
        )  # fmt: skip
        scene = scene_from_text(text)
        course = scene_motion(scene)
        assert position_of(course, "crank", "A").imag == pytest.approx([0, 0.025, 0.05])
        assert scene.mechanism.loads[0].law(course) == pytest.approx([0, 2.5, 5])


class TestGears:
    """Ratios between joints."""

    def test_wheels_and_a_rack(self):
        text = edited(
            WHEEL, ("[[drives]]", MESH + "[[drives]]"), ("speed = 2", "effort = 6"), ("R =", "Q = [0.4, 0]\nR =")
        )
        course = scene_motion(scene_from_text(text))
        angle = course.drive[0]
        # The follower's moment of inertia counts a quarter, the rack m r^2.
        assert angle == pytest.approx(6 / (0.5 + 0.25 * 0.25 + 4 * 0.05**2) * course.time**2 / 2, rel=1e-9)
        assert LinkAngle("other").value(course) % (2 * pi) == pytest.approx((-0.5 * angle) % (2 * pi), abs=1e-9)
        assert position_of(course, "rack", "R") == pytest.approx(0.1 + 0.05 * angle - 0.05j, abs=1e-12)

    @pytest.mark.parametrize(
        ("keys", "expected"),
        [("", np.radians(20)), ('pressure_angle = "14.5 deg"', np.radians(14.5)), ("teeth = false", None)],
    )
    def test_teeth_are_as_specified(self, keys, expected):
        mesh = MESH.replace("ratio = -0.5", f"ratio = -0.5\n{keys}")
        scene = scene_from_text(edited(WHEEL, ("[[drives]]", mesh + "[[drives]]"), ("R =", "Q = [0.4, 0]\nR =")))
        assert scene.mechanism.gears[0].pressure_angle == pytest.approx(expected)
        assert scene.mechanism.gears[1].pressure_angle == pytest.approx(np.radians(20))


class TestLaws:
    """Repeated motion laws, and laws through the entries of a table."""

    def test_a_law_that_returns_is_a_cycle(self):
        law = 'law = [{curve = "cycloidal", duration = 1, by = 1}, {curve = "harmonic", duration = 1, by = -1}]'
        scene = scene_from_text(edited(driven("start = 0.2", law, "repeat = true"), ("duration = 4", "")))
        assert (scene.run.duration, scene.run.turn) == (2.0, True)
        course = scene.course.at([0.5, 2.5, 5.5, -0.5])
        assert course.drive[0] == pytest.approx([0.7, 0.7, 0.7, 0.7])
        assert course.drive_rate[0] == pytest.approx([2, 2, -pi / 2, -pi / 2])

    def test_a_law_that_makes_a_whole_turn_is_a_cycle_of_a_pin(self):
        law = 'law = [{curve = "cycloidal", duration = 2, by = "1 turn"}]'
        scene = scene_from_text(edited(driven("start = 0", law, "repeat = true"), ("duration = 4", "")))
        assert (scene.run.duration, scene.run.turn) == (2.0, True)

    def test_an_indexing_law_continues_from_its_end(self):
        law = 'law = [{curve = "cycloidal", duration = 1, by = "90 deg"}, {curve = "dwell", duration = 1}]'
        scene = scene_from_text(driven("start = 0", law, "repeat = true"))
        assert np.degrees(scene_motion(scene, 5).drive[0]) == pytest.approx([0, 90, 90, 180, 180])
        assert not scene.run.turn

    def test_a_repeated_law_with_a_jump_is_an_error(self):
        law = (
            'law = [{curve = "polynomial-345", duration = 1, by = 1}, {curve = "constant-speed", duration = 1, by = 1}]'
        )
        with pytest.raises(SceneError, match="starts at a speed of 0 and ends at 1: repeated, the speed would jump"):
            scene_from_text(driven("start = 0", law, "repeat = true"))

    def test_a_cubic_through_a_table_is_the_cubic(self):
        entries = ", ".join(f'[{t}, "{t**3 - 2 * t} rad"]' for t in (0, 1, 2.5, 3, 4))
        course = scene_motion(scene_from_text(driven(f"motion = [{entries}]")))
        t = course.time
        assert course.drive[0] == pytest.approx(t**3 - 2 * t, abs=1e-12)
        assert course.drive_rate[0] == pytest.approx(3 * t**2 - 2, abs=1e-12)
        assert course.drive_acceleration[0] == pytest.approx(6 * t, abs=1e-12)

    def test_a_repeated_table_closes_smoothly(self):
        # A steady speed plus a sine in twelve entries: the periodic spline is off by at most (2 pi/12)^4/384.
        time = np.linspace(0, 1, 13)
        entries = ", ".join(f"[{t}, {2 * pi * t + 0.3 * np.sin(2 * pi * t)}]" for t in time)
        scene = scene_from_text(driven(f"motion = [{entries}]", "repeat = true"))
        assert scene.run.duration == 4
        course = scene.course.at([0.0, 0.37, 1.0, 2.37])
        expected = [2 * pi * t + 0.3 * np.sin(2 * pi * t) for t in (0, 0.37, 1, 2.37)]
        assert course.drive[0] == pytest.approx(expected, abs=2e-4)
        assert course.drive_rate[0, 2] == pytest.approx(course.drive_rate[0, 0], rel=1e-12)
        assert course.drive_rate[0, 0] == pytest.approx(2 * pi * 1.3, rel=1e-2)

    def test_the_summary_has_the_peaks_of_a_law(self):
        law = 'law = [{curve = "harmonic", duration = "2 s", by = 3}, {curve = "dwell", duration = 2}]'
        scene = scene_from_text(driven("start = 0", law))
        peaks = law_figures(scene, 0)
        assert (peaks["speed"].value, peaks["speed"].unit) == (pytest.approx(3 * pi / 4), "rad/s")
        assert (peaks["acceleration"].value, peaks["acceleration"].unit) == (pytest.approx(3 * pi**2 / 8), "rad/s^2")
        assert (peaks["jerk"].value, peaks["jerk"].unit) == (None, "rad/s^3")
        assert [each.value for each in peaks["jumps"]] == [0.0, 2.0]
        assert law_figures(scene_from_text(WHEEL), 0) is None

    def test_a_run_beyond_a_moving_end_is_an_error(self):
        with pytest.raises(SceneError, match=r"motion: ends at full speed after 3 s, but the run lasts 4 s"):
            scene_from_text(driven("motion = [[0, 0], [1, 1], [2, 3], [3, 6]]"))


class TestEfforts:
    """A drive with an effort; the motion follows."""

    def test_a_constant_moment(self):
        course = scene_motion(scene_from_text(driven("start = 0.5", "speed = 3", 'effort = "2 N m"')))
        t = course.time
        assert course.drive[0] == pytest.approx(0.5 + 3 * t + 2 * t**2, rel=1e-9)
        assert course.drive_acceleration[0] == pytest.approx(np.full(5, 4.0), rel=1e-9)

    def test_a_moment_against_time(self):
        course = scene_motion(scene_from_text(driven("start = 0", "effort = 3", "table = [[0, 0], [4, 2]]")))
        assert course.drive[0] == pytest.approx(3 * 0.5 * course.time**3 / 6 / 0.5, rel=1e-8, abs=1e-8)

    def test_a_moment_by_angle_acts_like_a_spring(self):
        table = 'table = [["-1 rad", 1], ["1 rad", -1]]\nagainst = {link = "wheel"}'
        course = scene_motion(scene_from_text(driven("start = 0.4", "effort = 2", table)))
        assert course.drive[0] == pytest.approx(0.4 * np.cos(2 * course.time), abs=1e-8)

    def test_a_table_that_ends_too_soon_is_an_error(self):
        table = 'table = [[-1, 1], [0, -1]]\nagainst = {link = "wheel"}'
        with pytest.raises(SceneError, match=r"but the table covers -57.2958° to 0°") as caught:
            scene_motion(scene_from_text(driven("start = -0.5", "speed = 9", "effort = 1", table)))
        assert caught.value.table == "drives"

    def test_an_effort_needs_a_duration(self):
        with pytest.raises(SceneError, match=r"\[run\] duration: the key is missing: an effort needs"):
            scene_from_text(edited(driven("start = 0", "effort = 2"), ("duration = 4", "")))

    def test_the_command_reports_it_and_refines_its_peaks(self, tmp_path):
        path = tmp_path / "thrown.toml"
        path.write_text(
            edited(FOUR_BAR, ('speed = "100 rad/s"', 'effort = "0.2 N m"'), ("[run]", '[run]\nduration = "40 ms"'))
        )
        assert main([str(path), "--refine", "--check", "4", "-o", str(tmp_path / "out"), "--quiet"]) == 0

    def test_a_drive_that_moves_no_mass_is_an_error(self):
        with pytest.raises(SceneError, match="moves no mass"):
            scene_motion(
                scene_from_text(edited(driven("start = 0", "effort = 2"), ("mass = 3", "mass = 0"), ("0.5", "0")))
            )


class TestSprings:
    """Springs and dampers."""

    def test_between_two_points(self):
        # From P, 0.1 m from O, to D at 0.3 m: tension 20 + 400 (l - 0.15) + 8 l'.
        spring = '[[springs]]\nlink = "wheel"\npoint = "P"\nanchor = "D"\nstiffness = "0.4 N/mm"\nlength = "15 cm"\n' \
                 'damping = "8 N s/m"\npreload = "20 N"\n'  # fmt: skip
        course, found = efforts(edited(WHEEL, ("[[drives]]", spring + "[[drives]]")))
        P = 0.1 * np.exp(1j * course.drive[0])
        way = 0.3 - P
        length = np.abs(way)
        rate = -((way.conj() * 2j * P).real) / length
        pull = (20 + 400 * (length - 0.15) + 8 * rate) * way / length
        assert found == pytest.approx(-(P.conj() * pull).imag, abs=1e-12)

    def test_about_a_pin(self):
        spring = (
            '[[springs]]\nlink = "wheel"\nat = "O"\nstiffness = "3 N m/rad"\nangle = "30 deg"\n'
            'damping = 0.5\npreload = "1 N m"\n'
        )
        course, found = efforts(edited(WHEEL, ("[[drives]]", spring + "[[drives]]")))
        assert found == pytest.approx(1 + 3 * (course.drive[0] - pi / 6) + 0.5 * 2, rel=1e-12)


class TestLoadsByAngle:
    """Tables by the angle of a link."""

    load = '[[loads]]\nlink = "wheel"\npoint = "P"\nmoment = 2\nagainst = {link = "wheel"}\ntable = '

    def test_over_a_turn_and_more(self):
        _, found = efforts(edited(WHEEL, ("[[drives]]", f'{self.load}[["-180 deg", 0], ["180 deg", 1]]\n[[drives]]')))
        # 0, 2, 4, 6 and 8 rad in turns of -180 to 180 deg.
        wrapped = np.array([0, 2, 4 - 2 * pi, 6 - 2 * pi, 8 - 2 * pi])
        assert found == pytest.approx(-2 * (wrapped + pi) / (2 * pi), abs=1e-12)

    def test_relative_to_another_link(self):
        against = self.load.replace('{link = "wheel"}', '{link = "ground", on = "wheel"}')
        _, found = efforts(
            edited(WHEEL, ("[[drives]]", f"{against}[[-3, -3], [3, 3]]\n[[drives]]"), ("speed = 2", "speed = 0.5"))
        )
        assert found == pytest.approx(2 * 0.5 * np.arange(5), abs=1e-12)

    def test_outside_of_the_table_raises_or_holds(self):
        text = edited(WHEEL, ("[[drives]]", f"{self.load}[[0, 1], [1, 3]]\n[[drives]]"), ("speed = 2", "speed = 0.5"))
        with pytest.raises(
            SceneError, match=r"\[\[loads\]\] no. 1 table: evaluated at 85.9437°, but the table covers 0° to 57.2958°"
        ):
            scene_motion(scene_from_text(text))
        _, found = efforts(edited(text, ("table =", 'extend = "hold"\ntable =')))
        assert found == pytest.approx([-2, -4, -6, -6, -6])
