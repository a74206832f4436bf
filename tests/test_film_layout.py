"""Claims about words in pictures: they are inside, and none lies over another, whatever the picture's size."""

from itertools import combinations

import numpy as np
import pytest
from mechanisms import steel_bar
from test_animations import STEEL, turned

from animations import Style
from animations.canvas import font_file
from animations.diagrams import diagram_named, steady
from animations.layout import View, scales_of, turn_of
from animations.legend import drive_words, headings, legend
from rigid import Link, Mechanism, PinDrive

EVERYTHING = ("names", "links", "peak", "drives", "paths", "deformed")
SIZES = [(1280, 720), (720, 1280), (400, 1000), (1920, 480), (480, 270)]


@pytest.fixture(scope="module")
def four_bar():
    links = (Link("ground", {"O": 0.0, "D": 0.35}), steel_bar("crank", "O", "A", 0.1),
             steel_bar("coupler", "A", "B", 0.3), steel_bar("rocker", "D", "B", 0.25))  # fmt: skip
    drawing = {"O": 0, "A": 0.1, "B": 0.26 + 0.23j, "D": 0.35}
    return turned(Mechanism(links, (PinDrive("crank", "O"),), drawing), [STEEL] * 3)


def box(words):
    """Left, right, lower and upper end of a line as the font has it [pixels]."""
    from PIL import ImageFont

    left, top, right, bottom = ImageFont.truetype(str(font_file()), 100).getbbox(words.text)
    wide, tall = (right - left) * words.height / 100, (bottom - top) * words.height / 100
    start = words.at.real - wide * (words.side + 1) / 2
    return start, start + wide, words.at.imag - tall / 2, words.at.imag + tall / 2


def over(one, other):
    return one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]


class TestAround:
    """Head and foot."""

    @pytest.mark.parametrize("size", SIZES)
    @pytest.mark.parametrize("look", ["plain", "solid"])
    @pytest.mark.parametrize("name", ["bending-moment", "shape"])
    def test_the_legend_is_inside_and_nothing_lies_over_another(self, four_bar, size, look, name):
        style = Style(size=size, look=look, show=EVERYTHING, exaggeration=2e6)
        diagram = diagram_named(name)
        found = legend(diagram, scales_of(four_bar, diagram, style), View(0j, 900.0, turn_of(look)), style)
        boxes = [box(words) for words in found.words]
        drawn = [shape.place(0) for shape in found.shapes]
        boxes += [(z.real.min(), z.real.max(), z.imag.min(), z.imag.max()) for z in drawn if z is not drawn[0]]
        if found.bar:
            low, high = found.bar
            boxes.append((low.real, high.real, low.imag, high.imag))
        assert min(each[0] for each in boxes) > 0
        assert max(each[1] for each in boxes) < size[0]
        patches = len(set(boxes))  # of the mixture there are two, one over the other
        assert patches >= 4
        for one, other in combinations(set(boxes), 2):
            assert not over(one, other)

    @pytest.mark.parametrize("size", SIZES)
    def test_the_head_is_above_all_and_its_lines_do_not_meet(self, four_bar, size):
        style = Style(size=size, title="A mechanism whose title is somewhat long for its picture")
        diagram = diagram_named("bending-moment")
        words = drive_words(four_bar)
        drive, *lines = headings(diagram, scales_of(four_bar, diagram, style), style, len(words(5)))
        told = type(drive)(words(5), drive.at, drive.height, drive.side)
        boxes = [box(each) for each in (told, *lines)]
        assert min(each[0] for each in boxes) > 0
        assert max(each[1] for each in boxes) < size[0]
        assert max(each[3] for each in boxes) < size[1]
        assert not any(over(one, other) for one, other in combinations(boxes, 2))
        assert min(each.height for each in lines) > 0.011 * min(size)

    def test_a_length_is_as_long_as_it_is_seen(self, four_bar):
        diagram, style = diagram_named("shape"), Style(look="solid")
        view = View(0.1 + 0.2j, 900.0, turn_of("solid"))
        found = legend(diagram, scales_of(four_bar, diagram, style), view, style)
        value, unit = found.words[0].text.split()
        assert unit == "mm"
        start, end = view.solid(np.array([[0.0, 0, 0], [float(value) / 1000, 0, 0]]))
        assert np.ptp(found.shapes[0].place(0)[:2].real) == pytest.approx(np.hypot(*(end - start)[:2]))

    def test_nothing_is_written_with_a_sign(self):
        written = steady(706e-6, "m")
        assert (written(-1e-9), written(-706e-6), written(-0.4e-6)) == ("0 µm", "-706 µm", "0 µm")
