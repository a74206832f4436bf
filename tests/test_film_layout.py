"""Words in pictures are inside, do not overlap, and hide little."""

from itertools import combinations

import numpy as np
import pytest
from mechanisms import steel_bar
from test_animations import STEEL, bent_four_bar
from tiers import in_tiers

from animations import Picture, Style, off_screen
from animations.canvas import font_file
from animations.diagrams import diagram_named, steady
from animations.labels import name_labels
from animations.layout import FOOT, HEAD, View, scales_of, turn_of
from animations.legend import Words, drive_words, headings, legend
from animations.picture import shapes_of, view_for
from animations.placing import Label, ink_of, without_overlaps
from animations.shapes import FlatShape
from animations.solid import prism
from elastic import deflection as bend
from kinelast import deflection, load
from rigid import Link, Mechanism, PinDrive, motion, position_of

ALL_PARTS = ("names", "links", "peak", "drives", "paths", "deformed")
SIZES = [(1280, 720), (720, 1280), (400, 1000), (1920, 480), (480, 270)]


@pytest.fixture(scope="module")
def four_bar():
    return bent_four_bar()


def box(words):
    """Return left, right, lower and upper end of a line as drawn by the font [pixels]."""
    from PIL import ImageFont

    left, top, right, bottom = ImageFont.truetype(str(font_file()), 100).getbbox(words.text)
    wide, tall = (right - left) * words.height / 100, (bottom - top) * words.height / 100
    start = words.at.real - wide * (words.side + 1) / 2
    return start, start + wide, words.at.imag - tall / 2, words.at.imag + tall / 2


def over(one, other):
    return one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]


class TestAround:
    """Head and foot of the picture."""

    @pytest.mark.parametrize("size", SIZES)
    @pytest.mark.parametrize("look", ["plain", "solid"])
    @pytest.mark.parametrize("name", ["bending-moment", "shape"])
    def test_the_legend_is_inside_without_overlap(self, four_bar, size, look, name):
        style = Style(size=size, look=look, show=ALL_PARTS, exaggeration=2e6)
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
        patches = len(set(boxes))  # the mixed colour has two overlapping patches
        assert patches >= 4
        for one, other in combinations(set(boxes), 2):
            assert not over(one, other)

    @pytest.mark.parametrize("size", SIZES)
    def test_the_head_is_at_the_top_without_overlap(self, four_bar, size):
        style = Style(size=size, title="A mechanism whose title is somewhat long for its picture")
        diagram = diagram_named("bending-moment")
        words = drive_words(four_bar)
        drive, *lines = headings(diagram, scales_of(four_bar, diagram, style), style, len(words(5)))
        placed = Words(words(5), drive.at, drive.height, drive.side)
        boxes = [box(each) for each in (placed, *lines)]
        assert min(each[0] for each in boxes) > 0
        assert max(each[1] for each in boxes) < size[0]
        assert max(each[3] for each in boxes) < size[1]
        assert not any(over(one, other) for one, other in combinations(boxes, 2))
        assert min(each.height for each in lines) > 0.011 * min(size)

    def test_the_scale_bar_has_the_length_of_the_picture(self, four_bar):
        diagram, style = diagram_named("shape"), Style(look="solid")
        view = View(0.1 + 0.2j, 900.0, turn_of("solid"))
        found = legend(diagram, scales_of(four_bar, diagram, style), view, style)
        value, unit = found.words[0].text.split()
        assert unit == "mm"
        start, end = view.solid(np.array([[0.0, 0, 0], [float(value) / 1000, 0, 0]]))
        assert np.ptp(found.shapes[0].place(0)[:2].real) == pytest.approx(np.hypot(*(end - start)[:2]))

    def test_zero_has_no_sign(self):
        written = steady(706e-6, "m")
        assert (written(-1e-9), written(-706e-6), written(-0.4e-6)) == ("0 µm", "-706 µm", "0 µm")


class TestNames:
    """Names that move with their points."""

    @pytest.mark.parametrize(("size", "look"), in_tiers([((960, 540), "plain"), ((480, 800), "solid")], 0, 1))
    def test_words_do_not_overlap_in_a_crowd_of_points(self, size, look):
        bent = deflection(load("flapping_wing"))
        style = Style(size=size, look=look, show=("names", "links", "peak"))
        with off_screen(), Picture(bent, "bending-moment", style) as picture:
            labels = picture._labels
        assert len(labels) == 1 + 16 + 10
        seen = np.zeros(len(labels))
        for position in range(0, 360, 5):
            placed = [(at, Words(label.at(position), label.middle[position], label.height, 0))
                    for at, label in enumerate(labels) if label.at(position)]  # fmt: skip
            boxes = [box(words) for _, words in placed]
            assert not any(over(one, other) for one, other in combinations(boxes, 2))
            for left, right, low, high in boxes:
                assert 0 < left < right < size[0]
                assert FOOT * style.unit < low < high < size[1] - HEAD * style.unit
            seen[[at for at, _ in placed]] += 1 / 72
        assert seen[0] == pytest.approx(1.0)  # the value
        assert np.mean(seen[1:17]) > 0.7  # names of points have priority
        assert min(seen[1:17]) > 0.3

    def test_the_first_of_overlapping_words_stays(self):
        middles = [np.array([0j, 0j]), np.array([5 + 0j, 100j]), np.array([8 + 0j, 100j])]
        kept = without_overlaps([Label(name, z, 10.0, "ink", 3 + 3j) for name, z in zip("abc", middles, strict=True)])
        assert [[label.at(position) for label in kept] for position in (0, 1)] == [["a", "", "c"], ["a", "b", ""]]

    def test_a_name_is_nearest_to_its_own_point(self, four_bar):
        style = Style(size=(640, 384), show=("names",))
        diagram = diagram_named("motion")
        scales = scales_of(four_bar, diagram, style)
        shapes = shapes_of(four_bar, diagram, scales, style)
        view = view_for(shapes, [], range(12), style)
        labels = name_labels(four_bar, scales, view, style, ink_of(shapes, [], view, range(12), 3.0), 0.0)
        turn = 2 * np.pi * np.arange(12) / 12
        pins = {"O": np.zeros(12), "D": np.full(12, 0.35), "A": 0.1 * np.exp(1j * turn)}
        for label in labels:
            if label.text in pins:
                away = {name: np.abs(label.middle - view.flat(place)) for name, place in pins.items()}
                assert all(np.all(away[label.text] <= each) for each in away.values())

    def test_a_name_is_nearer_to_its_point_than_to_others(self):
        links = (Link("ground", {"O": 0.0}), steel_bar("arm", "O", "A", 0.5), steel_bar("end", "A", "B", 0.02))
        drives = PinDrive("arm", "O"), PinDrive("end", "A", "arm")
        mechanism = Mechanism(links, drives, {"O": 0, "A": 0.5, "B": 0.52})
        bent = bend(motion(mechanism, [[np.pi / 4] * 3, [0.0] * 3]), [STEEL] * 2)
        places = self.named(bent)
        for label in places:
            away = abs(label.middle - places[label])
            assert all(np.all(away < abs(label.middle - other)) for name, other in places.items() if name is not label)

    def test_two_names_at_one_place_are_both_shown(self):
        bars = steel_bar("one", "O", "A", 0.1), steel_bar("two", "P", "B", 0.1)
        links = (Link("ground", {"O": 0.0, "P": 0.0}), *bars)
        mechanism = Mechanism(links, (PinDrive("one", "O"), PinDrive("two", "P")), {"O": 0, "A": 0.1, "P": 0, "B": 0.1})
        labels = list(self.named(bend(motion(mechanism, [[0.0, 1.0, 2.0]] * 2), [STEEL] * 2)))
        assert sorted(label.text for label in labels) == ["A", "B", "O", "P"]
        assert all(label.at(position) for label in without_overlaps(labels) for position in range(3))

    def test_the_name_of_a_link_of_one_point_leaves_its_pin_free(self):
        bent = deflection(load("offset_slider_crank"))
        (piston,) = (label for label in self.named(bent, "links") if label.text == "piston")
        pin = position_of(bent.motion, "piston", "B")
        view, scales = self.seen(bent)
        away = piston.middle - view.flat(pin)
        assert np.all((abs(away.real) > piston.half.real) | (abs(away.imag) > piston.half.imag))
        free = np.maximum(abs(away.real) - piston.half.real, abs(away.imag) - piston.half.imag)
        assert np.all(free > 0.3 * scales.pin * view.pixels)

    def named(self, bent, show="names"):
        """Return labels and locations of the points of an undrawn mechanism [pixels]."""
        style = Style(size=(640, 384), show=(show,))
        view, scales = self.seen(bent)
        labels = name_labels(bent, scales, view, style, ink_of([], [], view, range(3), 3.0), 0.0)
        if show == "links":
            return labels
        places = {name: position_of(bent.motion, at, name) for at, link in enumerate(bent.motion.mechanism.links)
                  for name in link.points}  # fmt: skip
        return {label: view.flat(places[label.text]) for label in labels}

    def seen(self, bent):
        """Return view and scales of a picture of a mechanism."""
        style = Style(size=(640, 384), show=("names",))
        scales = scales_of(bent, diagram_named("motion"), style)
        return view_for(shapes_of(bent, diagram_named("motion"), scales, style), [], range(3), style), scales

    def test_the_hidden_area_is_length_times_width(self):
        cross = FlatShape(
            "link", lambda _: np.array([0j, 100j, 0j, -100 + 0j]), lines=(np.array([0, 1]), np.array([2, 3]))
        )
        view = View(0j, 1.0, np.eye(3))
        hidden = ink_of([cross], [], view, [0], 0.1).hidden
        areas = hidden(np.array([[0 + 0j], [50j], [20 + 0j], [-50 + 0j], [9 + 3j]]), 10 + 5j)
        assert areas[0] == pytest.approx([1.5 * (5 + 10), 1.5 * 10, 0.0, 1.5 * 20, 1.5 * (1 + 8)], abs=0.4)

    def test_bodies_hide_their_visible_area(self):
        square = prism(lambda _: np.array([0, 4, 4 + 4j, 4j]) + 50, 4, 0.0, 60.0)
        turn = turn_of("solid")
        ink = ink_of([], [square], View(0j, 1.0, turn), [0], 1.0)
        front, back = (complex(*(turn @ [52, 2, z])[:2]) for z in (60, 0))  # visible apart
        areas = ink.hidden(np.array([[front], [back], [(front + back) / 2], [0j]]), 6 + 6j)[0]
        assert areas[:2] == pytest.approx(areas[0])
        assert areas[0] > 0
        assert areas[2:] == pytest.approx([0.0, 0.0])

    @pytest.mark.parametrize("look", ["plain", "solid"])
    def test_the_value_does_not_cover_its_dot_or_the_arrow(self, look):
        bent = deflection(load("offset_slider_crank"))
        style = Style(size=(960, 540), look=look)
        with off_screen(), Picture(bent, "deflection", style) as picture:
            value, dot = picture._labels[0], picture.shapes[-1]
            arrows = [shape for shape in picture.shapes[:-1] if shape.level == "mark"]
            view = picture.view
        covered = 0
        for position in range(0, 360, 5):
            left, right, low, high = box(Words(value.at(position), value.middle[position], value.height, 0))
            spots, curve = (
                view.flat(dot.place(position)),
                view.flat(np.concatenate([each.place(position) for each in arrows])),
            )
            assert not np.any((left < spots.real) & (spots.real < right) & (low < spots.imag) & (spots.imag < high))
            covered += bool(
                np.any((left < curve.real) & (curve.real < right) & (low < curve.imag) & (curve.imag < high))
            )
        assert covered == 0


@pytest.mark.parametrize("name", in_tiers(["quick_return", "flapping_wing"], 1, 1))
def test_words_cover_no_link_and_rarely_a_thin_line_or_symbol(name):
    style, positions = Style(show=("names", "links", "peak", "drives")), range(0, 360, 45)
    with off_screen(), Picture(deflection(load(name)), "shape", style) as picture:
        shapes, view = picture.shapes, picture.view
        shown = [(label, p, Words(label.at(p), 0j, label.height, 0)) for p in positions
                 for label in picture._labels if label.at(p)]  # fmt: skip
    assert len(shown) > 0.8 * len(picture._labels) * len(positions)
    for levels, most in ((("curve",), 0.0), (("link", "outline", "ground", "block", "pin"), 0.05)):
        ink = ink_of([shape for shape in shapes if shape.level in levels], [], view, positions, 2.0)
        hidden = [ink.hidden(label.middle[None], complex(*box(words)[1::2]))[p // 45, 0] for label, p, words in shown]
        covering = [words.text for (_, _, words), area in zip(shown, hidden, strict=True) if area]
        assert len(covering) <= most * len(shown), covering
