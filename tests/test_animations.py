"""Pictures have the right ordinates, meshes are reused, files are complete, and missing OpenGL is reported.

References are geometry written by hand, or the pixels themselves.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from mechanisms import steel_bar
from tiers import in_tiers

from animations import DIAGRAMS, Picture, RenderingUnavailable, Style, files, movie, off_screen, probe, spread, stills
from animations.canvas import font_file
from animations.diagrams import STATIONS, diagram_named, quantity, round_below
from animations.layout import FOOT, HEAD, drawable, scales_of
from animations.legend import drive_words, legend
from animations.picture import shapes_of, view_for
from animations.shapes import FILL_OPACITY, NEGATIVE, POSITIVE, diagram_shapes
from animations.style import paints
from elastic import RIGID, Section, deflection
from rigid import Beam, Link, Lump, Mechanism, PinDrive, Slider, SliderDrive, motion

STEEL = Section(210e9 * 60e-6, 210e9 * 1.8e-10, area=60e-6, inertia=1.8e-10, fibre=0.003, peak_shear=1.5)
SMALL = Style(title="Small", size=(320, 192))
BARE = Style(title="Small", size=(320, 192), show=())
TURN = np.arange(12) * 2 * np.pi / 12


def turned(mechanism, sections, speed=100.0, angles=TURN):
    return deflection(motion(mechanism, angles, speed, time=angles / speed), sections)


def bent_four_bar():
    ground = Link("ground", {"O": 0.0, "D": 0.35})
    links = (
        ground,
        steel_bar("crank", "O", "A", 0.1),
        steel_bar("coupler", "A", "B", 0.3),
        steel_bar("rocker", "D", "B", 0.25),
    )
    drawing = {"O": 0, "A": 0.1, "B": 0.26 + 0.23j, "D": 0.35}
    return turned(Mechanism(links, (PinDrive("crank", "O"),), drawing), [STEEL] * 3)


@pytest.fixture(scope="module")
def four_bar():
    return bent_four_bar()


@pytest.fixture(scope="module")
def slider_crank():
    piston = Link("piston", {"B": 0.0}, lumps=(Lump("B", 0.3),))
    links = (Link("ground", {"O": 0.0}), steel_bar("crank", "O", "A", 0.1), steel_bar("rod", "A", "B", 0.3), piston)
    guide = Slider("guide", "piston", "ground", "B", 0.0, 1.0)
    drawing = {"O": 0, "A": 0.1, "B": 0.4}
    return turned(Mechanism(links, (PinDrive("crank", "O"),), drawing, sliders=(guide,)), [RIGID, STEEL])


@pytest.fixture(scope="module")
def inverted():
    links = (
        Link("ground", {"O": 0.0, "D": -0.25j}),
        steel_bar("crank", "O", "A", 0.1),
        steel_bar("arm", "D", "E", 0.4),
        Link("block", {"A": 0.0}),
    )
    slot = Slider("slot", "block", "arm", "A", 0.0, 1.0)
    drawing = {"O": 0, "A": 0.1j, "D": -0.25j, "E": 0.15j}
    return turned(Mechanism(links, (PinDrive("crank", "O"),), drawing, sliders=(slot,)), [STEEL] * 2, 10.0)


def cantilever(angles, speed=3.0):
    """Return a rod of 2 m and 5 kg/m that turns about O at constant speed."""
    arm = Link("arm", {"O": 0.0, "A": 2.0}, (Beam("O", "A", 5.0),))
    mechanism = Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2}, gravity=-10j)
    return turned(mechanism, [Section(EA=1e6, EI=1e3)], speed, np.asarray(angles))


def over(background, *names):
    """Return the colour of overlapping diagram fills on a background.

    Each fill covers FILL_OPACITY of the colour below.
    """
    known = paints(background)
    colour = np.array(known["paper"])
    for name in names:
        colour = (1 - FILL_OPACITY) * colour + FILL_OPACITY * np.array(known[name])
    return colour


def half_reaching():
    """Return bars of 1 m on pins 2.5 m apart: in reach at position 0, stretched at 1, out of reach at 2."""
    links = (
        Link("ground", {"O": 0.0, "D": 2.5}),
        steel_bar("crank", "O", "A", 1.0),
        steel_bar("coupler", "A", "B", 1.0),
    )
    drawing = {"O": 0, "A": 0.92 + 0.39j, "B": 1.8 + 0.72j, "D": 2.5}
    mechanism = Mechanism((*links, steel_bar("rocker", "D", "B", 1.0)), (PinDrive("crank", "O"),), drawing)
    return turned(mechanism, [STEEL] * 3, 1.0, np.array([0.4, np.arccos(0.65), 2.5]))


class TestOrdinates:
    """The distance of ordinate ends from the rigid link is the field times the scale."""

    def test_bending_moment_of_a_cantilever_under_its_weight(self):
        bent = cantilever([0.0])
        tips = diagram_shapes(bent, "M", 0.01)[-1].place(0)[len(STATIONS) :]
        x = 2.0 * STATIONS
        moment = -5.0 * 10.0 * (2.0 - x) ** 2 / 2
        assert tips == pytest.approx(x + 0.01j * moment, abs=1e-13)

    def test_axial_force_across_a_rod_turned_upright(self):
        bent = cantilever([np.pi / 2])
        tips = diagram_shapes(bent, "N", 0.02)[-1].place(0)[len(STATIONS) :]
        x = 2.0 * STATIONS
        force = 5.0 * 3.0**2 * (4.0 - x**2) / 2 - 5.0 * 10.0 * (2.0 - x)
        assert tips == pytest.approx(1j * x - 0.02 * force, abs=1e-12)

    def test_fills_are_separated_by_sign(self, four_bar):
        positive, negative, _, outline = diagram_shapes(four_bar, "w", 20.0)
        assert (positive.fill, negative.fill) == (POSITIVE, NEGATIVE)
        assert POSITIVE != NEGATIVE
        axis = 3 * len(STATIONS)
        for position in range(12):
            base = outline.place(position)[:axis]
            heights = [shape.place(position)[axis:] - base for shape in (positive, negative, outline)]
            assert heights[0] + heights[1] == pytest.approx(heights[2], abs=1e-15)
            assert np.all((abs(heights[0]) < 1e-15) | (abs(heights[1]) < 1e-15))

    def test_deformed_links_meet_at_pins(self, four_bar, slider_crank, inverted):
        for bent in (four_bar, slider_crank, inverted):
            scales = scales_of(bent, diagram_named("shape"), SMALL)
            shapes = shapes_of(bent, diagram_named("shape"), scales, SMALL)
            curve = next(shape for shape in shapes if shape.level == "curve").place(5).reshape(-1, len(STATIONS))
            pins = [shape.place(5).mean() for shape in shapes if shape.level == "pin"]
            ends = curve[:, [0, -1]].ravel()
            assert max(abs(ends - pin).min() for pin in pins) < 1e-12

    def test_curves_show_the_exaggerated_displacement(self):
        bent = cantilever([0.0])
        style = Style(size=(320, 192), exaggeration=0.25)
        shapes = shapes_of(bent, diagram_named("shape"), scales_of(bent, diagram_named("shape"), style), style)
        tip = next(shape for shape in shapes if shape.level == "curve").place(0)[-1]
        sag, stretch = -5.0 * 10.0 * 2.0**4 / (8 * 1e3), 5.0 * 3.0**2 * 2.0**3 / (3 * 1e6)
        assert tip == pytest.approx(2.0 + 0.25 * (stretch + 1j * sag), abs=1e-13)


class TestLayout:
    """One scale and one view fit the whole cycle."""

    @pytest.mark.parametrize("name", DIAGRAMS)
    def test_all_points_of_all_positions_are_inside(self, name, four_bar, slider_crank, inverted):
        for bent in (four_bar, slider_crank, inverted):
            shapes = shapes_of(bent, diagram_named(name), scales_of(bent, diagram_named(name), SMALL), SMALL)
            view = view_for(shapes, [], range(12), SMALL)
            points = np.concatenate([shape.place(position) for shape in shapes for position in range(12)])
            pixels = view.flat(points)
            assert 0 < pixels.real.min() <= pixels.real.max() < 320
            assert FOOT * 192 < pixels.imag.min() <= pixels.imag.max() < (1 - HEAD) * 192

    def test_the_largest_ordinate_is_about_a_sixth_of_the_mechanism(self):
        bent = cantilever([0.0, np.pi / 2, np.pi, 3 * np.pi / 2])
        scales = scales_of(bent, diagram_named("bending-moment"), SMALL)
        assert scales.peak == pytest.approx(100.0)
        assert 0.15 <= scales.scale * 100.0 / 4.0 <= 0.20

    def test_a_given_scale_is_kept(self, four_bar):
        assert scales_of(four_bar, diagram_named("deflection"), Style(scale=7.0)).scale == 7.0

    def test_a_zero_field_has_scale_zero(self):
        straight = cantilever([0.0], speed=0.0 + 1e-300)
        assert scales_of(straight, diagram_named("slope"), SMALL).scale > 0
        rigid = deflection(straight.motion, [RIGID])
        assert scales_of(rigid, diagram_named("slope"), SMALL).scale == 0.0

    @pytest.mark.slow
    def test_outlines_are_in_view(self, four_bar):
        wide = Style(size=(320, 192), outlines={"coupler": [-0.5j, 0.3 - 0.5j, 0.3 + 0.5j]})
        with off_screen(), Picture(four_bar, "slope", wide) as far, Picture(four_bar, "slope", SMALL) as near:
            assert far.view.pixels < near.view.pixels


class TestRendering:
    """Pixels of rendered pictures."""

    @pytest.mark.parametrize("name", in_tiers(sorted(DIAGRAMS, key=lambda name: [*DIAGRAMS].index(name) % 6), 1, 3))
    def test_frames_show_ink_and_differ(self, name, slider_crank):
        with off_screen(), Picture(slider_crank, name, SMALL) as picture:
            first, second = picture.show(1).astype(int), picture.show(4).astype(int)
        assert first.shape == (192, 320, 3)
        assert 0.005 < np.mean(first.min(axis=2) < 128) < 0.5
        assert np.mean(np.any(first != second, axis=2)) > 0.005

    def test_the_same_position_gives_the_same_picture(self, inverted):
        with off_screen(), Picture(inverted, "deflection", SMALL) as picture:
            first, _, again = picture.show(1), picture.show(7), picture.show(1)
        assert np.array_equal(first, again)

    def test_points_move_in_the_same_meshes(self, four_bar):
        def memory(mesh):
            return mesh.points.__array_interface__["data"][0]

        with off_screen(), Picture(four_bar, "deflection", SMALL) as picture:
            picture.show(0)
            meshes, arrays = list(picture.meshes), [memory(mesh) for mesh in picture.meshes]
            before = [mesh.points.copy() for mesh in meshes]
            picture.show(3)
            assert all(now is then for now, then in zip(picture.meshes, meshes, strict=True))
            assert [memory(mesh) for mesh in meshes] == arrays
            moved = sum(not np.array_equal(mesh.points, old) for mesh, old in zip(meshes, before, strict=True))
            assert moved >= 6
            for shape, mesh in zip(picture.shapes, meshes, strict=True):
                pixels = (shape.place(3) - picture.view.corner) * picture.view.pixels
                assert mesh.points[:, 0] + 1j * mesh.points[:, 1] == pytest.approx(pixels, abs=1e-3)

    @pytest.mark.slow
    def test_positive_and_negative_fills_are_visible(self, four_bar):
        def near(image, paint):
            return np.count_nonzero(np.abs(image[40:150] - 255 * over("white", paint)).max(axis=2) < 6)

        with off_screen(), Picture(four_bar, "transverse-load", SMALL) as picture:
            images = [picture.show(position) for position in range(12)]
        assert max(near(image, POSITIVE) for image in images) > 50
        assert max(near(image, NEGATIVE) for image in images) > 50

    def test_outlines_and_deformed_shape_can_be_added_to_a_diagram(self, four_bar):
        style = Style(size=(320, 192), show=("deformed",), outlines={"coupler": [-0.02j, 0.3 - 0.02j, 0.15 + 0.1j]})
        with off_screen(), Picture(four_bar, "shear-force", style) as picture:
            levels = [shape.level for shape in picture.shapes]
            picture.show(2)
        assert levels.count("outline") == 1
        assert levels.count("curve") == 1

    def test_vtk_errors_are_raised(self):
        from vtkmodules.vtkFiltersGeneral import vtkWarpScalar

        with pytest.raises(RuntimeError), off_screen():
            vtkWarpScalar().Update()

    def test_the_font_has_greek_letters(self):
        from matplotlib.ft2font import FT2Font

        assert all(FT2Font(str(font_file())).get_char_index(ord(letter)) for letter in "φ°µ·\N{MULTIPLICATION SIGN}")


class TestFiles:
    """Files of stills and films are complete or absent."""

    def test_a_film_has_all_frames(self, four_bar, tmp_path):
        from imageio_ffmpeg import get_ffmpeg_exe

        calls = []
        path = tmp_path / "film.mp4"
        assert movie(four_bar, "slope", path, 6, SMALL, lambda done, count: calls.append((done, count))) == (path,)
        decode = [get_ffmpeg_exe(), "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
        raw = subprocess.run(decode, capture_output=True, check=True).stdout
        frames = np.frombuffer(raw, np.uint8).reshape(-1, 192, 320, 3).astype(int)
        assert len(frames) == 6
        assert np.all(np.any(np.abs(np.diff(frames, axis=0)) > 100, axis=(1, 2, 3)))
        assert calls == [(k, 6) for k in range(1, 7)]
        assert list(tmp_path.iterdir()) == [path]

    def test_a_gif_has_all_frames_and_colours(self, inverted, tmp_path):
        from PIL import Image

        (path,) = movie(inverted, "bending-moment", tmp_path / "film.gif", 5, SMALL)
        with Image.open(path) as film:
            assert (film.n_frames, film.size) == (5, (320, 192))
            assert film.info["duration"] == 40
            colours = {colour for _, colour in film.convert("RGB").getcolors(320 * 192)}
        for wanted in (over("white"), over("white", POSITIVE), over("white", NEGATIVE)):
            assert min(np.abs(np.array(colour) - 255 * wanted).max() for colour in colours) <= 2

    def test_stills_are_numbered_by_position(self, slider_crank, tmp_path):
        from PIL import Image

        written = movie(slider_crank, "shape", tmp_path / "still.png", 3, SMALL)
        assert [path.name for path in written] == ["still-00.png", "still-04.png", "still-08.png"]
        images = []
        for path in written:
            with Image.open(path) as image:
                images.append(np.asarray(image))
        assert not np.array_equal(images[0], images[1])

    def test_one_still_keeps_the_given_name(self, four_bar, tmp_path):
        assert stills(four_bar, "deflection", [3], tmp_path / "one.png", SMALL) == (tmp_path / "one.png",)
        assert (tmp_path / "one.png").stat().st_size > 1000

    def test_the_default_is_up_to_120_frames(self):
        assert spread(range(12), None) == list(range(12))
        assert len(spread(range(360), None)) == 120

    @pytest.mark.slow
    def test_a_failed_film_leaves_no_file(self, four_bar, tmp_path):
        def stop(done, count):
            raise KeyboardInterrupt

        for name in ("film.mp4", "film.gif"):
            with pytest.raises(KeyboardInterrupt):
                movie(four_bar, "slope", tmp_path / name, 6, SMALL, stop)
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.slow
    def test_positions_out_of_reach_are_omitted(self, tmp_path):
        bent = half_reaching()
        possible = drawable(bent, diagram_named("deflection"))
        assert possible[0] == 0
        assert 2 not in possible
        with pytest.raises(ValueError, match="position 2 cannot be drawn"):
            stills(bent, "deflection", [2], tmp_path / "x.png", SMALL)
        with pytest.raises(ValueError, match=f"3 frames from {len(possible)} positions"):
            movie(bent, "deflection", tmp_path / "x.gif", 3, SMALL)
        for look in ("plain", "solid"):
            assert stills(bent, "deflection", [0], tmp_path / "x.png", Style(size=(320, 192), look=look))

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"frames": 13}, "13 frames from 12 positions that can be drawn: choose 1 to 12"),
            ({"frames": 0}, "0 frames"),
            ({"path": "film.avi"}, '"film.avi": the name must end in .mp4 or .gif or .png'),
            ({"diagram": "deflexion"}, 'there is no diagram "deflexion": choose from longitudinal-load'),
            ({"style": Style(outlines={"wheel": [0, 1, 1j]})}, 'no link "wheel"'),
            ({"style": Style(outlines={"crank": [0, 1]})}, '"crank" has 2 corners'),
        ],
    )
    def test_wrong_arguments_write_no_file(self, change, message, four_bar, tmp_path):
        arguments = {"diagram": "slope", "path": "film.mp4"} | change
        arguments["path"] = tmp_path / arguments["path"]
        with pytest.raises(ValueError, match=message):
            movie(four_bar, **arguments)
        assert list(tmp_path.iterdir()) == []

    def test_an_unknown_position_is_an_error(self, four_bar, tmp_path):
        with pytest.raises(ValueError, match="there is no position 12: choose from 0 to 11"):
            stills(four_bar, "slope", [12], tmp_path / "x.png")

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"size": (301, 192)}, "301 x 192"),
            ({"exaggeration": 0.0}, "exaggeration 0"),
            ({"scale": -1.0}, "scale -1"),
            ({"look": "shiny"}, 'no look "shiny": choose from plain, solid'),
            ({"show": ("names", "forces")}, '"forces" cannot be shown: choose from names'),
            ({"background": "blau"}, 'no colour "blau"'),
        ],
    )
    def test_invalid_styles_are_errors(self, change, message):
        with pytest.raises(ValueError, match=message):
            Style(**change)


class TestWords:
    """Captions and legend."""

    def test_angle_and_time_keep_their_units(self, four_bar):
        words = drive_words(four_bar)
        assert words(1) == "crank 30.0°   t = 5.2 ms"
        assert words(0) == "crank 0.0°   t = 0.0 ms"

    def test_a_driven_slider_without_times(self):
        block = Link("block", {"P": 0.0, "Q": 0.2}, (Beam("P", "Q", 1.0),))
        guide = Slider("lift", "block", "ground", "P", 0.0, 1j, -1j)
        links = (Link("ground", {"O": 0.0}), block)
        mechanism = Mechanism(links, (SliderDrive("lift"),), {"O": 0, "P": 0, "Q": 0.2}, sliders=(guide,))
        bent = deflection(motion(mechanism, np.array([-0.05, 0.0, 0.125]), 1.0), [STEEL])
        words = drive_words(bent)
        assert [words(position) for position in range(3)] == ["lift -50 mm", "lift 0 mm", "lift 125 mm"]

    def test_the_legend_shows_both_scales(self, four_bar):
        diagram = diagram_named("bending-moment")
        scales = scales_of(four_bar, diagram, Style())
        view = view_for(shapes_of(four_bar, diagram, scales, Style()), [], range(12), Style())
        found = legend(diagram, scales, view, Style())
        shapes, texts = found.shapes, [line.text for line in found.words]
        assert texts[0].endswith(" mm")
        assert texts[1].endswith("N·m")
        long, tall = (np.ptp(shape.place(0)[:2]) for shape in shapes[:2])
        assert abs(long) == pytest.approx(float(texts[0].split()[0]) / 1000 * view.pixels)
        assert abs(tall) == pytest.approx(float(texts[1].split()[0]) * scales.scale * view.pixels)


class TestMachine:
    """A child process tests OpenGL once, and a missing OpenGL is reported in words."""

    def test_missing_opengl_names_the_package(self, monkeypatch, four_bar, tmp_path):
        monkeypatch.setattr(files, "TRIAL", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
        probe.cache_clear()
        try:
            with pytest.raises(RenderingUnavailable, match="apt install libegl1"):
                stills(four_bar, "slope", [0], tmp_path / "x.png", SMALL)
        finally:
            probe.cache_clear()
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.slow
    def test_one_child_for_all_pictures(self, monkeypatch):
        probe()

        def refuse(*arguments, **options):
            raise AssertionError("a second child process")

        monkeypatch.setattr(subprocess, "run", refuse)
        probe()

    def test_the_environment_is_restored(self, monkeypatch):
        monkeypatch.delenv(files.WINDOW, raising=False)
        probe.cache_clear()
        before = dict(os.environ)
        with off_screen():
            pass
        assert dict(os.environ) == before

    @pytest.mark.slow
    def test_nothing_is_printed_and_nothing_imported_early(self, tmp_path):
        code = (
            "import sys, animations, numpy as np\n"
            "assert not {'pyvista', 'vtkmodules', 'matplotlib', 'imageio', 'PIL'} & set(sys.modules)\n"
            "from rigid import Beam, Link, Mechanism, PinDrive, motion\n"
            "from elastic import Section, deflection\n"
            "arm = Link('arm', {'O': 0.0, 'A': 2.0}, (Beam('O', 'A', 5.0),))\n"
            "links = (Link('ground', {'O': 0.0}), arm)\n"
            "m = Mechanism(links, (PinDrive('arm', 'O'),), {'O': 0, 'A': 2}, gravity=-10j)\n"
            "d = deflection(motion(m, [0.0, 1.0], 3.0), [Section(1e6, 1e3)])\n"
            "style = animations.Style(size=(320, 192))\n"
            "animations.movie(d, 'slope', sys.argv[1] + '/a.mp4', style=style)\n"
            "animations.movie(d, 'slope', sys.argv[1] + '/a.gif', style=style)\n"
        )
        ran = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False)
        assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gif", "a.mp4"]


def test_quantities_have_prefixes():
    values = [(1e-3, "m"), (9.996e-4, "m"), (999.6, "N"), (0.0, "rad"), (2e-13, "m"), (-4.2e4, "N/m")]
    assert [quantity(*value) for value in values] == ["1 mm", "1 mm", "1 kN", "0 rad", "0.2 pm", "-42 kN/m"]


def test_scales_are_round_numbers_below_a_value():
    assert [round_below(value) for value in (0.99, 1.0, 4.99, 5.0, 7e-5, 0.003)] == [0.5, 1.0, 2.0, 5.0, 5e-5, 0.002]
