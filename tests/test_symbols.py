"""Claims about the display list: marks lie on their links, and their plain data say the same."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from test_cams import TAPPET
from test_page import GEARED
from test_stops import FOUR_BAR, SLIDER_CRANK, stop

from kinelast import load, scene_from_text
from kinelast.scene.data import scene_motion
from kinelast.scene.parts import symbols_of
from live.marks import scene_marks, sheet
from rigid import position_of
from symbols import PIN_RADIUS, anchor_position, extent_of, marks_of

SIZE = 0.01
GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
SCENES = {
    "geared": GEARED,
    "tappet": TAPPET,
    "stopped": FOUR_BAR + stop('most = "150 deg"'),
    "slider-crank": SLIDER_CRANK,
}


def listed(text):
    """Motion and display list of a scene."""
    scene = scene_from_text(text)
    moved = scene_motion(scene, 12)
    return moved, marks_of(moved, symbols_of(scene))


def of_plain(plain, place, x_axis, end):
    """Vertices of the lines from plain data: sizes and metres in the mark's axes, shares of the way to its end."""
    found = []
    if end is not None:
        x_axis = (end - place) / abs(end - place)
    for line in plain["lines"]:
        count = max(len(line.get(key, ())) for key in ("symbol_offset", "offset", "share"))
        for k in range(count):
            (u, v), (x, y) = (line[key][k] if key in line else (0.0, 0.0) for key in ("symbol_offset", "offset"))
            share = line["share"][k] if "share" in line else 0.0
            apart = 0.0 if end is None else share * (end - place)
            found.append(place + apart + x_axis * complex(SIZE * u + x, SIZE * v + y))
    return found


@pytest.mark.parametrize("name", SCENES)
def test_plain_data_give_the_same_vertices(name):
    moved, marks = listed(SCENES[name])
    for mark in marks:
        place = anchor_position(moved, mark.at)[3]
        end = None if mark.to is None else anchor_position(moved, mark.to)[3]
        x_axis = np.broadcast_to(mark.direction(moved), moved.columns)[3]
        placed = mark.placed(place, x_axis, SIZE, end)
        lines = placed[len(placed) - sum(len(line.vertices[0]) for line in mark.lines) :]
        assert lines == pytest.approx(of_plain(mark.plain(), place, x_axis, end), abs=1e-8), mark.kind


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("geared", {"wheel": 2, "belt": 1, "spring": 2, "drive": 1, "pin": 3, "support": 3, "dot": 1}),
        ("tappet", {"cam": 1, "roller": 1, "rail": 1, "block": 1, "drive": 1, "dot": 4}),
        ("stopped", {"stop": 1, "pin": 4, "support": 2, "drive": 1}),
        ("slider-crank", {"rail": 1, "block": 1, "pin": 3, "support": 1, "drive": 1}),
    ],
)
def test_every_joint_and_part_has_its_mark_once(name, kinds):
    _, marks = listed(SCENES[name])
    found = [mark.kind for mark in marks]
    assert {kind: found.count(kind) for kind in kinds} == kinds
    assert set(found) - {*kinds, "ground"} == set()


def test_the_block_stays_on_its_rails_and_the_wheels_within_the_extent():
    """The rails are three sizes longer than the slide, on each side."""
    moved, marks = listed(SLIDER_CRANK)
    (rail,) = (mark for mark in marks if mark.kind == "rail")
    xs = rail.placed(anchor_position(moved, rail.at)[0], rail.direction(moved)[0], SIZE).real
    slides = position_of(moved, "piston", "B").real
    start, *_, end = xs[rail.cells[0]]
    assert [start, end] == pytest.approx([slides.min() - 3 * SIZE, slides.max() + 3 * SIZE])
    moved, marks = listed(GEARED)
    low, high = extent_of(moved, marks)
    assert high.real == pytest.approx(0.3 + 0.2)  # the larger wheel turns about x = 0.3 m with a radius of 0.2 m
    assert low.imag == pytest.approx(-0.2)


def test_cylinders_replace_the_sliders_that_they_push():
    scene = load(GALLERY / "excavator_arm.toml")
    kinds = [mark.kind for mark in marks_of(scene_motion(scene, 12), symbols_of(scene))]
    assert (kinds.count("barrel"), kinds.count("rod")) == (3, 3)
    assert not {"block", "rail"} & {*kinds}


ON_ROCKER = FOUR_BAR.replace("links.rocker = {", "links.rocker = {masses = {C = 15.0}, ")


@pytest.mark.parametrize("text", [FOUR_BAR + "[masses]\nC = 15.0\n", ON_ROCKER])
def test_a_point_mass_is_drawn_at_its_point(text):
    moved, marks = listed(text)
    (disc,) = (mark for mark in marks if mark.kind == "mass")
    assert anchor_position(moved, disc.at) == pytest.approx(position_of(moved, "rocker", "C"))
    assert disc.radius[0] > PIN_RADIUS
    content = sheet(tomllib.loads(text))
    assert [mark["at"]["point"] for mark in content["discs"]] == ["C"]
    moving, _ = scene_marks(scene_from_text(text), moved)
    assert "mass" not in {mark["kind"] for mark in moving["marks"]}, "the editor draws one disc"
