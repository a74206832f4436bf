"""Quantities, links and sliders of a scene."""

import re
import tomllib
from functools import cache
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scene_texts import FOUR_BAR, QUICK_RETURN, SLIDER_CRANK, edited
from tiers import in_tiers

from elastic import displacement_of
from kinelast.designs import evaluate
from kinelast.reports.summary import summary
from kinelast.runs import computed
from kinelast.scene.data import scene_deflection, scene_motion
from kinelast.scene.document import document_from_text, scene_from_dict, scene_from_text
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from kinelast.values.quantities import (
    AngleOrLength,
    Density,
    Direction,
    ForcePerLength,
    Inertia,
    Length,
    MassPerLength,
    Moment,
    Speed,
    Stress,
)
from rigid import position_of

BAR_AREA, BAR_I = 6e-5, 0.01 * 0.006**3 / 12


def link(scene, name):
    return scene.mechanism.links[scene.mechanism.index[name]]


class TestUnits:
    """A text with a unit is converted to SI units; a plain number is in SI units."""

    @pytest.mark.parametrize(
        ("kind", "text", "value"),
        [
            (Length, "12 mm", 0.012),
            (Length, "-3.5e1cm", -0.35),
            (Length, "5 µm", 5e-6),
            (Length, "2 in", 0.0508),
            (Stress, "210 GPa", 210e9),
            (Stress, "210e3 N/mm^2", 210e9),
            (Stress, "10 ksi", 68.94757293168e6),
            (Density, "7.85 g/cm^3", 7850.0),
            (Density, "7850 kg/m³", 7850.0),
            (Speed, "3000 rpm", 100 * pi),
            (Speed, "90 deg/s", pi / 2),
            (Speed, "30 mm/s", 0.03),
            (AngleOrLength, "30°", pi / 6),
            (AngleOrLength, "-0.25 turn", -pi / 2),
            (Inertia, "3e-4 kg m^2", 3e-4),
            (Inertia, "2 g*mm**2", 2e-9),
            (Moment, "3 N·m", 3.0),
            (ForcePerLength, "4 N/mm", 4000.0),
            (MassPerLength, "3 g/mm", 3.0),
        ],
    )
    def test_texts_with_units_are_converted(self, kind, text, value):
        assert kind.read(text) == pytest.approx(value, rel=1e-13)

    def test_numbers_are_si(self):
        assert Length.read(0.25) == 0.25
        assert Stress.read(210_000_000_000) == 210e9

    def test_right_angles_are_exact(self):
        assert [Direction.read(text) for text in ("0 deg", "90 deg", "180 deg", "-90 deg")] == [1, 1j, -1, -1j]
        assert Direction.read([3, 4]) == 0.6 + 0.8j

    def test_units_distinguish_rotation_and_sliding(self):
        assert (Speed.read("1 rad/s").unit, Speed.read("1 m/s").unit, Speed.read(1).unit) == ("rad/s", "m/s", "")


class TestLinks:
    """Links get their shape from the drawing, a length, or coordinates."""

    def test_local_axes_run_from_the_first_to_the_second_point(self):
        scene = scene_from_text(edited(FOUR_BAR, ('["A", "B"]', '["A", "B", "P"]\nbeams = [["A", "B"]]')))
        points = link(scene, "coupler").points
        assert points["A"] == 0
        assert points["B"] == pytest.approx(0.3)
        assert points["B"].imag == 0
        # A-B is (0.18, 0.24) = 0.3 (0.6, 0.8), and A-P is (0.1, 0.25): 0.26 along, 0.07 across.
        assert points["P"] == pytest.approx(0.26 + 0.07j)

    def test_a_length_overrides_the_drawn_one(self):
        scene = scene_from_text(edited(FOUR_BAR, ('["D", "B"]', '["D", "B"]\nlength = "260 mm"')))
        assert link(scene, "rocker").points == {"D": 0, "B": 0.26}

    def test_coordinates_are_kept(self):
        own = '{B = [0.01, 0], A = ["-29 cm", 0], P = [0, 0.1]}\nbeams = [["A", "B"]]'
        scene = scene_from_text(edited(FOUR_BAR, ('["A", "B"]', own)))
        assert link(scene, "coupler").points == {"B": 0.01, "A": pytest.approx(-0.29), "P": 0.1j}
        assert np.isfinite(scene_motion(scene).origin).all()

    def test_ground_points_can_have_coordinates(self):
        spelt = edited(FOUR_BAR, ("O = [0.0, 0.0]\n", ""), ('["O", "D"]', "{O = [0, 0], D = [0.35, 0]}"))
        assert link(scene_from_text(spelt), "ground").points == link(scene_from_text(FOUR_BAR), "ground").points

    def test_sections_have_the_handbook_properties(self):
        scene = scene_from_text(FOUR_BAR)
        section = scene.sections[0]
        assert (section.area, section.inertia, section.fibre) == (
            pytest.approx(BAR_AREA),
            pytest.approx(BAR_I),
            pytest.approx(0.003),
        )
        assert (pytest.approx(210e9 * BAR_AREA), pytest.approx(210e9 * BAR_I)) == (section.EA, section.EI)
        assert scene.mechanism.beams[0][1].mass_per_length == pytest.approx(7850 * BAR_AREA)

    @pytest.mark.parametrize(
        ("shape", "A", "I", "c"),
        [
            ('shape = "circle"\ndiameter = "8 mm"', pi * 16e-6, pi * 0.008**4 / 64, 0.004),
            ('shape = "tube"\nouter = 0.012\ninner = 0.008', pi * 20e-6, pi * (0.012**4 - 0.008**4) / 64, 0.006),
            ('shape = "properties"\nA = "60 mm^2"\nI = "180 mm^4"\nc = "3 mm"', 6e-5, 1.8e-10, 0.003),
        ],
    )
    def test_shapes_of_sections_have_their_area_and_inertia(self, shape, A, I, c):  # noqa: E741
        drawn = 'shape = "rectangle"\ndepth = "6 mm"\nwidth = "10 mm"'
        section = scene_from_text(edited(FOUR_BAR, (drawn, shape))).sections[0]
        assert (section.area, section.inertia, section.fibre) == (pytest.approx(A), pytest.approx(I), pytest.approx(c))

    def test_labels_of_several_beams_are_in_mechanism_order(self):
        text = edited(
            FOUR_BAR,
            ('["A", "B"]', '["A", "B", "P"]\nbeams = [["A", "B"], {from = "B", to = "P", section = "thin"}]'),
            ("[points]", '[sections.thin]\nshape = "rigidities"\nEA = 1e6\nEI = 2\nmass_per_length = 0.1\n[points]'),
        )
        with pytest.raises(ValueError, match="remove the material"):
            scene_from_text(text)
        scene = scene_from_text(
            edited(
                text,
                ('shape = "rigidities"\nEA = 1e6\nEI = 2\nmass_per_length = 0.1', 'shape = "circle"\ndiameter = 0.004'),
            )
        )
        assert scene.labels == ("crank", "coupler.1", "coupler.2", "rocker")
        assert [section.area for section in scene.sections] == pytest.approx([6e-5, 6e-5, pi * 4e-6, 6e-5])
        names = [scene.mechanism.links[number].name for number, _ in scene.mechanism.beams]
        assert names == [label.split(".")[0] for label in scene.labels]

    def test_rigid_links_keep_the_beams_of_their_section(self):
        scene = scene_from_text(edited(FOUR_BAR, ('["O", "A"]', '["O", "A"]\nrigid = true')))
        assert np.isinf([scene.sections[0].EA, scene.sections[0].EI]).all()
        assert scene.sections[0].inertia == pytest.approx(BAR_I)
        assert link(scene, "crank").lumps == ()

    def test_rigid_links_combine_a_given_mass_with_their_section(self):
        scene = scene_from_text(edited(FOUR_BAR, ('["O", "A"]', '["O", "A"]\nrigid = true\nmass = 2')))
        (lump,) = link(scene, "crank").lumps
        assert (lump.point, lump.mass, lump.offset) == ("O", 2.0, pytest.approx(0.05))
        assert lump.inertia == pytest.approx(7850 * BAR_AREA * 0.1 * (0.1**2 + 0.006**2) / 12)
        assert scene.labels == ("coupler", "rocker")

    def test_the_mass_of_a_guide_is_that_of_its_beams(self):
        # Two beams of 0.3 and 0.4 kg, 0.3 and 0.4 m long, at right angles: by hand about their common centre.
        text = edited(
            QUICK_RETURN,
            ("D = [0.0, 0.5]", "D = [0.0, 0.3]\nT = [0.4, 0.3]"),
            ('["C", "D"]\nrigid = true\nmass = 0.4\ncenter = [0.25, 0]\ninertia = "8e-3 kg m^2"',
             '["C", "D", "T"]\nrigid = true\nsection = "s"'),
            ("[points]", '[sections.s]\nshape = "rigidities"\nEA = 1e7\nEI = 30\nmass_per_length = 1\n[points]'),
        )  # fmt: skip
        (lump,) = link(scene_from_text(text), "rocker").lumps
        assert lump.mass == pytest.approx(0.7)
        center = (0.3 * 0.15 + 0.4 * (0.3 - 0.2j)) / 0.7
        assert lump.offset == pytest.approx(center)
        own = 0.3 * 0.3**2 / 12 + 0.4 * 0.4**2 / 12
        assert lump.inertia == pytest.approx(own + 0.3 * abs(0.15 - center) ** 2 + 0.4 * abs(0.3 - 0.2j - center) ** 2)

    def test_point_masses_belong_to_the_first_moving_link_with_the_point(self):
        scene = scene_from_text(
            edited(
                FOUR_BAR,
                ('["D", "B"]', '["D", "B"]\nmasses = {B = "50 g"}'),
                ("[run]", "[masses]\nO = 0.3\nA = 0.1\nB = 0.2\n[run]"),
            )
        )
        held = {
            name: [(lump.point, lump.mass) for lump in link(scene, name).lumps]
            for name in ("crank", "coupler", "rocker")
        }
        assert held == {
            "crank": [("O", 0.3), ("A", 0.1)],
            "coupler": [("B", 0.2)],
            "rocker": [("B", pytest.approx(0.05))],
        }

    def test_outlines_are_in_local_axes(self):
        scene = scene_from_text(edited(FOUR_BAR, ('["A", "B"]', '["A", "B"]\noutline = ["A", ["15 cm", 0.02], "B"]')))
        assert scene.outlines == {"coupler": (0, pytest.approx(0.15 + 0.02j), pytest.approx(0.3))}


class TestDrawnLengths:
    """The length of a link drawn without `length` can be set, swept and scattered."""

    def test_setting_a_drawn_length_writes_it(self):
        written = edited(FOUR_BAR, ('points = ["A", "B"]', 'points = ["A", "B"]\nlength = "310 mm"'))
        changed = document_from_text(FOUR_BAR).with_changes(["links.coupler.length=310 mm"])
        assert changed.tables["links"]["coupler"]["length"] == "0.31 m"
        links = [document_from_text(text).table.links for text in (changed.text(), written)]
        assert links[0] == links[1] == changed.table.links
        drawn = document_from_text(FOUR_BAR).variable("links.coupler.length").base
        assert drawn == pytest.approx(abs(complex(0.28, 0.24) - 0.1), rel=1e-15)

    def test_designs_of_a_drawn_length_equal_single_runs(self):
        lengths = [[0.29], [0.31]]
        found = evaluate(document_from_text(FOUR_BAR), ["links.coupler.length"], lengths, ["deflection", "stress"])
        for row, (length,) in enumerate(lengths):
            document = document_from_text(FOUR_BAR).with_values({"links.coupler.length": length})
            figures = summary(computed(document.scene, Request(theory="quasi-static")))
            largest = figures["largest_deflection"]["value"], figures["largest_stress"]["value"]
            assert found.columns["deflection"][row] == pytest.approx(abs(largest[0]), rel=1e-12)
            assert found.columns["stress"][row] == pytest.approx(largest[1], rel=1e-12)

    def test_the_error_for_another_shape_lists_its_numbers(self):
        plate = edited(FOUR_BAR, ('["A", "B"]', "{A = [0, 0], B = [0.3, 0]}"))
        wide = edited(FOUR_BAR, ('["A", "B"]', '["A", "P", "B"]'))
        for text, words in ((plate, "links.coupler.points.B.x"), (wide, "points.B.x")):
            with pytest.raises(SceneError, match=f'the points determine the size of this link: .*, as in "{words}"'):
                document_from_text(text).with_changes(["links.coupler.length=0.1"])


class TestSliders:
    """A slider's line passes through the drawn point and is fixed in its owner."""

    def test_on_the_ground(self):
        (slider,) = scene_from_text(SLIDER_CRANK).mechanism.sliders
        assert (slider.on, slider.origin, slider.direction, slider.turn) == ("ground", 0.4, 1, 1)

    def test_on_a_moving_link_in_its_axes(self):
        # The rocker points up from C, and A is 0.4 m along it.
        (slider,) = scene_from_text(QUICK_RETURN).mechanism.sliders
        assert slider.origin == pytest.approx(0.4)
        assert slider.direction == pytest.approx(1)

    def test_the_block_stays_on_the_rocker(self):
        course = scene_motion(scene_from_text(QUICK_RETURN))
        A, C = position_of(course, "crank", "A"), position_of(course, "rocker", "C")
        along = course.direction[course.mechanism.index["rocker"]]
        assert np.imag(np.conj(along) * (A - C)) == pytest.approx(np.zeros(36), abs=1e-15)
        # Quick return: if the crank (0.1 m) is normal to the rocker, the sine is 0.1/0.3.
        lean = np.abs(np.angle(along / 1j)).max()
        assert lean == pytest.approx(np.arcsin(1 / 3), abs=2e-3)


DIVIDED = {
    "four-bar": edited(FOUR_BAR, ("positions = 36", 'positions = 24\noutput = "rocker.angle"')),
    "slider-crank": edited(SLIDER_CRANK, ("positions = 36", 'positions = 24\noutput = "B"\ntheory = "quasi-static"')),
}
# summary entries that are maxima over the named points, are compared with such a maximum, or count figures of points
OF_POINTS = {"points", "displacement", "along_path", "off_path", "unreliable", "near_zero"}


def with_points(text, link, shares, reversed_at):
    """Return a scene's tables with points on a straight link and beams between them, one beam reversed."""
    tables = tomllib.loads(text)
    points, own = tables["points"], tables["links"][link]
    first, last = own["points"]
    start, end = (np.array(points[name]) for name in (first, last))
    on_the_way = [f"P{number}" for number in range(len(shares))]
    points |= {
        name: (start + share * (end - start)).tolist() for name, share in zip(on_the_way, sorted(shares), strict=True)
    }
    names = [first, *on_the_way, last]
    own["points"] = [first, last, *on_the_way]
    own["beams"] = [list(pair) for pair in pairwise(names)]
    if reversed_at:
        own["beams"][reversed_at % len(own["beams"])].reverse()
    if own["beams"][0][0] != first:
        own["beams"].insert(0, own["beams"].pop())
    return tables


def _without_errors(text):
    """Return a text without added points and errors, and these errors in percent."""
    text = re.sub(r"P\d+ \([^)]*\), |, P\d+ \([^)]*\)", "", text)
    error = r"(\d[\d.]*)(?= %)"
    return re.sub(error, "", text), [float(each) for each in re.findall(error, text)]


def assert_alike(found, expected, path=""):
    """Compare texts, numbers to 1e-11, and errors to 3 %: steps to large displacement also end by named points."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), path
        for key in expected.keys() - OF_POINTS:
            assert_alike(found[key], expected[key], f"{path}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), path
        for one, other in zip(found, expected, strict=True):
            assert_alike(one, other, path)
    elif isinstance(expected, float):
        close = 0.03 if re.search(r"error[^.]*$|use[^.]*$|\.errors\.", path) else 1e-11
        assert found == pytest.approx(expected, rel=close, abs=1e-300), path
    elif path == ".trust.text":
        (words, shares), (others, known) = (_without_errors(text) for text in (found, expected))
        assert words == others, path
        assert shares == pytest.approx(known, rel=0.03), path
    else:
        assert found == expected, path


@cache
def undivided(name):
    return summary(computed(scene_from_text(DIVIDED[name]), Request()))


class TestPointsOnALink:
    @settings(max_examples=8, phases=[Phase.generate])
    @given(
        case=st.sampled_from([("four-bar", "crank"), ("four-bar", "coupler"), ("slider-crank", "rod")]),
        shares=st.lists(st.floats(0.01, 0.99), min_size=1, max_size=5, unique_by=lambda share: round(share, 3)),
        reversed_at=st.integers(0, 4),
    )
    @pytest.mark.slow
    def test_named_points_do_not_change_the_report(self, case, shares, reversed_at):
        """A straight link gets random named points and one beam per segment."""
        name, link = case
        found = summary(computed(scene_from_dict(with_points(DIVIDED[name], link, shares, reversed_at)), Request()))
        assert_alike(found, undivided(name))

    def test_points_on_a_link_move_with_the_beam(self):
        """The reference is an end of two beams with almost no mass."""
        text = edited(
            FOUR_BAR, ('points = ["A", "B"]', 'points = ["A", "B", "M"]'), ("[points]", "[points]\nM = [0.19, 0.12]")
        )
        scene = scene_from_text(text)
        found = summary(computed(scene, Request()))["points"]["M"]["displacement"]["value"]
        loaded = edited(text, ("[run]", '[masses]\nM = "1e-12 kg"\n[run]'))
        parted = scene_from_text(loaded)
        assert (scene.labels, parted.labels) == (
            ("crank", "coupler", "rocker"),
            ("crank", "coupler.1", "coupler.2", "rocker"),
        )
        node = summary(computed(parted, Request()))["points"]["M"]["displacement"]["value"]
        assert found == pytest.approx(node, rel=1e-4)

    def test_points_moved_by_a_study_stay_ends_of_beams(self):
        """If a design moves the point off the line, the link has a corner there."""
        tables = with_points(DIVIDED["four-bar"], "coupler", [0.5], 0)
        drawn = tables["points"]["P0"]
        moved = {**tables, "points": {**tables["points"], "P0": [drawn[0], drawn[1] + 0.02]}}
        found = evaluate(tables, ["points.P0.y"], [[drawn[1]], [drawn[1] + 0.02]], ["deflection", "mass"])
        assert not found.reason.any()
        apart = [evaluate(each, [], [[]], ["deflection", "mass"]) for each in (tables, moved)]
        for figure, values in found.columns.items():
            np.testing.assert_allclose(values, [each.columns[figure][0] for each in apart], rtol=1e-9)


RODS = """
[materials.steel]
E = 210e9
density = 7850
[sections.bar]
shape = "rectangle"
depth = 0.008
width = 0.02
[sections.rod]
shape = "rectangle"
depth = 0.008
width = {width}
[points]
O = [0, 0]
A = [0.03, 0.04]
B = [0.2, 0]
[links.ground]
points = ["O"]
[links.crank]
points = ["O", "A"]
section = "bar"
material = "steel"
{rods}
[links.piston]
points = ["B"]
mass = 0.3
[sliders.guide]
link = "piston"
through = "B"
direction = [1, 0]
[[drives]]
link = "crank"
speed = 100
[[loads]]
link = "piston"
point = "B"
force = [-1000, 0]
[run]
positions = 12
"""


@pytest.mark.parametrize("count", in_tiers([2, 3, 5], 2, 1))
def test_parallel_rods_are_one_rod_of_their_total_width(count):
    def bent(rods, width):
        each = '[links.rod{}]\npoints = ["A", "B"]\nsection = "rod"\nmaterial = "steel"\n'
        scene = scene_from_text(RODS.format(rods="".join(map(each.format, range(rods))), width=width))
        return scene_deflection(scene, scene_motion(scene))

    for link, point in (("crank", "A"), ("piston", "B")):
        many, one = (displacement_of(each, link, point) for each in (bent(count, 0.02), bent(1, 0.02 * count)))
        np.testing.assert_allclose(many, one, rtol=0, atol=1e-10 * np.abs(one).max())
