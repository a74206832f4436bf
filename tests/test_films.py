"""Films: solid bodies, labels, arrows, paths, colours, and the options of the command."""

import subprocess
from itertools import pairwise

import numpy as np
import pytest
from mechanisms import steel_bar
from scene_texts import ARM
from test_animations import SMALL, STEEL, bent_four_bar, cantilever, over, turned

import kinelast
from animations import Picture, Style, movie, off_screen
from animations.diagrams import diagram_named
from animations.labels import name_labels, peak_label
from animations.layout import FOOT, HEAD, MARGIN, drawable, scales_of, turn_of
from animations.picture import shapes_of, stack_of, view_for
from animations.placing import Label, ink_of, within
from animations.shapes import NEGATIVE, POSITIVE, FlatShape, moved_beams
from animations.solid import beam_bodies, cross_sections, prism
from animations.solid_mechanism import mechanism_bodies
from animations.style import paints
from animations.symbols import path_shapes, symbol_shapes
from elastic import Section, circle, deflection, displacement_of, rectangle, section_of, tapered, tube
from kinelast.cli.command import main
from rigid import Gear, Link, Mechanism, PinDrive, Spring, motion
from symbols import marks_of

STATIONS = np.linspace(0.0, 1.0, 49)
DEFLECTION = diagram_named("deflection")


@pytest.fixture(scope="module")
def four_bar():
    return bent_four_bar()


def volume(body, position=0):
    """Return the volume by Gauss's theorem, and the largest difference between corner order and face normal.

    Corners of the polygons run counter-clockwise as seen from outside.
    """
    points, normals = body.place(position)
    total, worst = 0.0, 0.0
    for face in body.faces:
        first = points[face[0]]
        for one, other in pairwise(face[1:]):
            across = np.cross(points[one] - first, points[other] - first) / 2
            total += first @ across / 3
            worst = max(worst, *(1 - normals[corner] @ across / np.linalg.norm(across) for corner in face))
    return total, worst


class TestSolid:
    """Bodies have the sections and positions of the links."""

    @pytest.mark.parametrize("way", [1, -1])
    def test_a_prism_has_its_area_times_its_height(self, way):
        corners = np.array([0.0, 2.0, 2.0 + 1.0j, 1.0j])[::way] + 3 - 1j
        found, off = volume(prism(lambda _: corners, 4, -0.5, 2.5))
        assert found == pytest.approx(2.0 * 3.0)
        assert off == pytest.approx(0.0, abs=1e-12)

    @pytest.mark.parametrize(
        ("shape", "depth", "width"),
        [(rectangle(0.02, 0.05), 0.02, 0.05), (circle(0.03), 0.03, 0.03), (tube(0.04, 0.02), 0.04, 0.04)],
    )
    def test_a_section_is_known_by_its_properties(self, shape, depth, width):
        found = cross_sections(section_of(shape, 210e9), 1.0)
        assert found.depth == pytest.approx(depth)
        assert found.width == pytest.approx(width)
        assert found.round == (depth == width)

    def test_a_taper_and_unknown_properties(self):
        taper, _ = tapered(rectangle, (0.02, 0.01), (0.01, 0.03))
        found = cross_sections(section_of(rectangle(0.02, 0.01), 210e9, taper=taper), 1.0)
        assert found.depth == pytest.approx(0.02 - 0.01 * STATIONS)
        assert found.width == pytest.approx(0.01 + 0.02 * STATIONS)
        unknown = cross_sections(Section(1e6, 1e3), 0.3)
        assert (unknown.depth[0], unknown.width[-1], unknown.round) == (0.3, 0.3, True)

    @pytest.mark.parametrize(("shape", "area"), [(rectangle(0.2, 0.1), 0.02), (circle(0.2), np.pi * 0.01)])
    def test_a_beam_has_its_area_times_its_length(self, shape, area):
        section = cross_sections(section_of(shape, 1.0), 1.0)
        body = beam_bodies(lambda _: (1j * 2.0 * STATIONS)[None], [section], [0.7], None)
        ring = body.place(0)[0].reshape(len(STATIONS), -1, 3)[0]
        ends = [ring[:, 2].min(), ring[:, 2].max(), ring[:, 0].min(), ring[:, 0].max()]
        depth, width = section.depth[0], section.width[0]
        assert ends == pytest.approx([0.7 - width / 2, 0.7 + width / 2, -depth / 2, depth / 2])
        sides, off = volume(
            body
        )  # without the end faces: at y = 0 the contribution is 0, at y = 2 it is y/3 times the area
        whole = sides + 2.0 * area / 3
        assert whole == pytest.approx(2.0 * area, rel=0.012)  # a circle with 24 corners
        assert off < 0.009  # 1 - cos of half the angle between corners

    def test_bodies_bend_as_the_deformed_shape_does_and_wear_the_field(self):
        bent = cantilever([0.0])
        style = Style(size=(320, 192), look="solid", exaggeration=0.25)
        scales = scales_of(bent, diagram_named("bending-moment"), style)
        stack = stack_of(bent, scales, style, [0])
        body = mechanism_bodies(bent, diagram_named("bending-moment"), scales, style, stack)[0]
        tip = body.place(0)[0].reshape(len(STATIONS), -1, 3)[-1].mean(axis=0)
        sag, stretch = -5.0 * 10.0 * 2.0**4 / (8 * 1e3), 5.0 * 3.0**2 * 2.0**3 / (3 * 1e6)
        assert tip[:2] == pytest.approx([2.0 + 0.25 * stretch, 0.25 * sag], abs=1e-12)
        values = body.values(0).reshape(len(STATIONS), -1)
        assert values == pytest.approx(np.tile(-25.0 * (2.0 - 2.0 * STATIONS[:, None]) ** 2, values.shape[1]))

    def test_the_view_is_a_rotation(self):
        for look in ("plain", "solid"):
            turn = turn_of(look)
            assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-15)
            assert np.linalg.det(turn) == pytest.approx(1.0)
        assert turn[1, 2] < 0 < turn[2, 2]  # nearer parts appear lower: the view is from above

    def test_frames_are_shaded_and_move(self, four_bar):
        style = Style(size=(320, 192), look="solid", show=())
        with off_screen(), Picture(four_bar, "von-mises-stress", style) as picture:
            first, second, again = (picture.show(position).astype(int) for position in (1, 5, 1))
        assert np.array_equal(first, again)
        assert np.mean(np.any(first != second, axis=2)) > 0.01
        assert len(np.unique(first.reshape(-1, 3), axis=0)) > 300


def symbols(bent, kind, size, exaggeration=0.0):
    """Shapes of the marks of a kind."""
    marks = [mark for mark in marks_of(bent.motion) if mark.kind == kind]
    return symbol_shapes(bent, marks, size, exaggeration)


class TestAround:
    """Arrows, paths, springs and wheels."""

    def test_an_arrow_goes_the_way_of_its_drive(self):
        for speed in (3.0, -3.0):
            (arrow,) = symbols(cantilever([0.0], speed), "drive", 0.1)
            shaft = arrow.place(0)[arrow.lines[0]]
            there = shaft[: len(shaft) // 2]
            assert abs(shaft) == pytest.approx(0.22)
            assert np.all(np.diff(np.unwrap(np.angle(there))) * speed > 0)
            assert shaft == pytest.approx([*there, *there[::-1]])  # encloses no area
        bent = cantilever([0.0])
        (still,) = symbols(deflection(motion(bent.motion.mechanism, [0.0]), bent.sections), "drive", 0.1)
        assert np.ptp(still.place(0)) == 0

    def test_paths_follow_the_points(self, four_bar):
        crank, coupler = path_shapes(four_bar, np.arange(12))
        assert abs(crank.place(0)) == pytest.approx(0.1)
        assert crank.place(0)[0] == crank.place(0)[-1]  # closed
        assert abs(coupler.place(0) - 0.35) == pytest.approx(0.25)
        moved = path_shapes(four_bar, np.arange(12), 20.0)[1].place(0)[:12]
        apart = moved - coupler.place(0)[:12]
        assert apart == pytest.approx(20.0 * displacement_of(four_bar, "rocker", "B"))
        assert np.all(abs(apart) > 1e-6)

    def test_springs_reach_from_end_to_end_and_wheels_touch(self):
        links = (
            Link("ground", {"O": 0.0, "P": 0.3, "Q": 1j}),
            steel_bar("one", "O", "A", 0.1),
            steel_bar("two", "P", "B", 0.1),
        )
        gear = Gear(PinDrive("one", "O"), PinDrive("two", "P"), -2.0)
        spring = Spring("one", "A", "ground", "Q", 100.0)
        drawing = {"O": 0, "A": 0.1, "P": 0.3, "B": 0.4, "Q": 1j}
        mechanism = Mechanism(links, (PinDrive("one", "O"),), drawing, gears=(gear,), loads=(spring,))
        bent = turned(mechanism, [STEEL] * 2)
        (zigzag,), (first, second) = symbols(bent, "spring", 0.01), symbols(bent, "wheel", 0.01)
        assert zigzag.place(0)[[0, -1]] == pytest.approx([0.1, 1j])
        stretched = symbols(bent, "spring", 0.01, 50.0)[0].place(0)[[0, -1]]
        assert stretched == pytest.approx([0.1 + 50.0 * displacement_of(bent, "one", "A")[0], 1j])
        assert abs(stretched[0] - 0.1) > 1e-6
        radii = [abs(wheel.place(0)[:-2] - wheel.place(0)[-2]) for wheel in (first, second)]
        assert radii[0] == pytest.approx(0.2)  # the follower has twice the speed
        assert radii[1] == pytest.approx(0.1)

    def test_pins_fit_short_links(self):
        wide = cantilever([0.0, np.pi])
        links = (Link("ground", {"O": 0.0}), steel_bar("arm", "O", "A", 2.0), steel_bar("end", "A", "B", 0.06))
        drives = PinDrive("arm", "O"), PinDrive("end", "A", "arm")
        mechanism = Mechanism(links, drives, {"O": 0, "A": 2, "B": 2.06})
        short = deflection(motion(mechanism, np.zeros((2, 1)), np.ones((2, 1))), [STEEL] * 2)
        assert scales_of(wide, DEFLECTION, SMALL).pin == pytest.approx(0.026 * 4.0)
        assert scales_of(short, DEFLECTION, SMALL).pin <= 0.5 * 0.06
        arrow = shapes_of(short, DEFLECTION, scales_of(short, DEFLECTION, SMALL), Style(show=("drives",)))[0]
        assert abs(arrow.place(0)[arrow.lines[0]]) == pytest.approx(2.2 * 0.0145 * 2.06)  # arrows stay visible


class TestWords:
    """Positions of names and values."""

    def test_the_peak_is_labelled_at_its_place(self):
        bent = cantilever([0.0, np.pi])
        diagram, style = diagram_named("bending-moment"), Style(size=(640, 384))
        scales = scales_of(bent, diagram, style)
        view = view_for(shapes_of(bent, diagram, scales, style), [], [0, 1], style)
        place, label = peak_label(bent, diagram, scales, view, style)
        assert [label.at(0), label.at(1)] == ["-100 N·m", "100 N·m"]
        assert place == pytest.approx(np.array([-1j, -1j]) * 100.0 * scales.scale)  # at the root, both times below it
        assert np.all(label.middle.imag < view.flat(place).imag)
        name = Label("root", label.middle, label.height, "ink", label.half)
        _, moved = peak_label(bent, diagram, scales, view, style, [name])
        assert np.all(abs(moved.middle - label.middle).real > 10)
        arrow = FlatShape("mark", lambda position: label.middle[[position]] / view.pixels + view.corner)
        _, beside = peak_label(bent, diagram, scales, view, style, marks=[arrow])
        way = beside.middle - label.middle
        assert np.all((abs(way.real) >= label.half.real) | (abs(way.imag) >= label.half.imag))

    def test_the_peak_value_hides_no_link(self):
        bent = kinelast.deflection(kinelast.load("quick_return"))
        style = Style(size=(1280, 720))
        scales = scales_of(bent, DEFLECTION, style)
        view = view_for(shapes_of(bent, DEFLECTION, scales, style), [], range(0, 360, 30), style)
        _, label = peak_label(bent, DEFLECTION, scales, view, style)
        axis = moved_beams(bent, 0.0)
        links = view.flat(np.array([axis(position).ravel() for position in range(360)]))
        assert not within(links - label.middle[:, None], label.half).any()

    def test_names_hide_neither_each_other_nor_the_links(self, four_bar):
        style = Style(size=(640, 384), show=("names", "links"))
        scales = scales_of(four_bar, DEFLECTION, style)
        view = view_for(shapes_of(four_bar, DEFLECTION, scales, style), [], range(12), style)
        drawn = range(0, 12, 3)
        labels = name_labels(four_bar, scales, view, style, ink_of([], [], view, drawn, 5.0), 0.0)
        assert sorted(label.text for label in labels) == ["A", "B", "D", "O", "coupler", "crank", "rocker"]
        for position in drawn:
            at = {label.text: label.middle[position] for label in labels}
            pins = view.flat(np.array([0.0, 0.35, 0.1 * np.exp(2j * np.pi * position / 12)]))
            assert min(abs(at["A"] - at["O"]), abs(at["O"] - at["D"])) > 10
            assert (
                min(abs(at[name] - pin) for name, pin in zip("ODA", pins, strict=True)) > 0.5 * scales.pin * view.pixels
            )
            assert max(abs(at[name] - pin) for name, pin in zip("ODA", pins, strict=True)) < 40

    def test_names_change_sides_as_links_approach(self, four_bar):
        style = Style(size=(640, 384), show=("names", "links"))
        scales = scales_of(four_bar, DEFLECTION, style)
        shapes = shapes_of(four_bar, DEFLECTION, scales, style)
        view = view_for(shapes, [], range(12), style)
        labels = name_labels(four_bar, scales, view, style, ink_of(shapes, [], view, range(12), 3.0), 0.0)
        axis, along = moved_beams(four_bar, 0.0), np.linspace(0.0, 1.0, 200)
        crossed = []
        for position in range(12):
            places = np.concatenate([line[0] + along * (line[-1] - line[0]) for line in axis(position)])
            offsets = [view.flat(places) - label.middle[position] for label in labels]
            crossed += [within(each, 0.8 * label.half).any() for each, label in zip(offsets, labels, strict=True)]
        assert np.mean(crossed) <= 0.03

    def test_the_mechanism_fills_the_picture(self, four_bar):
        for name in ("deflection", "shape", "motion"):
            style = Style(size=(640, 360), show=())
            diagram = diagram_named(name)
            shapes = shapes_of(four_bar, diagram, scales_of(four_bar, diagram, style), style)
            view = view_for(shapes, [], range(12), style)
            points = view.flat(np.concatenate([shape.place(p) for shape in shapes for p in range(12)]))
            room = (640 - 2 * MARGIN * 360, (1 - HEAD - FOOT) * 360)
            taken = np.ptp(points.real) / room[0], np.ptp(points.imag) / room[1]
            assert max(taken) == pytest.approx(1.0)
            assert min(taken) > 0.3


class TestColours:
    """Colours agree with the legend."""

    @pytest.mark.parametrize("background", ["white", "#101418"])
    def test_where_diagrams_lie_over_each_other_they_mix_as_in_the_legend(self, four_bar, background):
        wanted = 255 * over(background, POSITIVE, NEGATIVE)
        style = Style(size=(640, 360), show=(), background=background, scale=120.0)
        foot = int((1 - FOOT) * 360)
        with off_screen(), Picture(four_bar, "deflection", style) as picture:
            images = [picture.show(position).astype(int) for position in (6, 7)]
        parts = images[0][foot:], *(image[:foot] for image in images)
        mixed = [np.count_nonzero(np.abs(part - wanted).max(axis=2) < 3) for part in parts]
        assert mixed[0] > 20
        assert max(mixed[1:]) > 50

    @pytest.mark.parametrize("background", ["white", "#101418"])
    def test_the_front_of_a_body_has_the_colour_of_its_value(self, background):
        import matplotlib as mpl

        bent = deflection(cantilever([0.0]).motion, [section_of(rectangle(0.2, 0.1), 210e9)])
        style = Style(size=(640, 360), look="solid", show=(), background=background)
        with off_screen(), Picture(bent, "von-mises-stress", style) as picture:
            image = picture.show(0).astype(int)
            points = picture.bodies[0].place(0)[0].reshape(len(STATIONS), -1, 3)
            front = points[points[..., 2] == points[..., 2].max()].reshape(len(STATIONS), -1, 3).mean(axis=1)
            pixels = picture.view.solid(front)
            values = picture.bodies[0].values(0).reshape(len(STATIONS), -1)[:, 0] / picture.scales.peak
        for station in range(6, 43, 6):
            x, y = pixels[station, :2]
            wanted = 255 * np.array(mpl.colormaps["YlOrRd"](values[station])[:3])
            assert np.abs(image[int(360 - y), int(x)] - wanted).max() < 14

    def test_lines_are_light_on_a_dark_background(self, four_bar):
        with off_screen(), Picture(four_bar, "motion", Style(size=(320, 192), background="#101418")) as picture:
            image = picture.show(0)
        assert tuple(image[100, 2]) == (16, 20, 24)
        assert image.max() > 200
        assert sum(paints("#101418")["ink"]) > 2.5
        assert sum(paints("white")["ink"]) < 0.7


class TestAsked:
    """Films by the options of the command."""

    def test_speed_size_and_background(self, four_bar, tmp_path):
        from imageio_ffmpeg import get_ffmpeg_exe

        (path,) = movie(four_bar, "motion", tmp_path / "a.mp4", 6, Style(size=(322, 194)), rate=12.5)
        reported = subprocess.run([get_ffmpeg_exe(), "-i", path], capture_output=True, text=True, check=False).stderr
        assert "322x194" in reported
        assert "12.50 fps" in reported
        assert "00:00:00.48" in reported

    def test_a_rigid_scene_films_its_motion(self, four_bar, tmp_path):
        bare = Link("bar", {"O": 0.0, "A": 1.0})
        mechanism = Mechanism((Link("ground", {"O": 0.0}), bare), (PinDrive("bar", "O"),), {"O": 0, "A": 1})
        bent = turned(mechanism, [])
        with pytest.raises(ValueError, match='choose the diagram "motion"'):
            drawable(bent, DEFLECTION)
        for look in ("plain", "solid"):
            with off_screen(), Picture(bent, "motion", Style(size=(320, 192), look=look)) as picture:
                images = [picture.show(position).astype(int) for position in (0, 3)]
            assert np.mean(np.any(images[0] != images[1], axis=2)) > 0.01

    def test_all_options_together(self, tmp_path):
        from PIL import Image

        (tmp_path / "arm.toml").write_text(ARM)
        call = [str(tmp_path / "arm.toml"), "--animate", "axial-force", "--format", "gif", "--frames", "4", "--quiet"]
        plain = ["--fps", "10", "--size", "320x192", "--exaggeration", "50", "--background", "black", "--show", "none"]
        assert main([*call, *plain, "--style", "solid", "-o", str(tmp_path / "out")]) == 0
        with Image.open(tmp_path / "out" / "arm" / "axial-force.gif") as film:
            assert (film.size, film.n_frames, film.info["duration"]) == ((320, 192), 4, 100)
            frame = np.asarray(film.convert("RGB")).astype(int)
        assert tuple(frame[100, 2]) == (0, 0, 0)
        assert np.any(np.abs(frame[-18:] - [180, 4, 38]).max(axis=2) < 30)  # the end of the colour bar for bodies

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            (["--fps", "10"], "--fps needs --animate"),
            (["--animate", "w", "--fps", "0"], "a number above 0"),
            (["--animate", "w", "--size", "321x200"], "two even numbers"),
            (["--animate", "w", "--size", "big"], "two even numbers"),
            (["--animate", "w", "--background", "blau"], 'no colour "blau"'),
            (["--animate", "w", "--show", "names,forces"], "'forces' cannot be shown: choose from none, names"),
            (["--animate", "w", "--style", "shiny"], "invalid choice: 'shiny'"),
            (["--animate", "w", "--exaggeration", "-1"], "a number above 0"),
        ],
    )
    def test_mistakes(self, options, message, tmp_path, capsys):
        assert main(["steel_four_bar", *options, "-o", str(tmp_path / "out")]) == 2
        assert message in capsys.readouterr().err
