"""The structure report: text and skeleton diagram."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from mechanisms import four_bar_linkage, linkage, slider_crank_linkage, three_cranks
from msgspec.structs import replace

from kinelast.structure import spatial_text, structure_text
from kinelast.structure.output import skeleton, skeleton_svg
from rigid import Link, Mechanism, MechanismError, PinDrive, Slider, SliderDrive
from rigid.topology import Contact, SpatialJoint


def section(text, name):
    """Return the lines of one section of a report."""
    found = re.search(rf"^{re.escape(name)}.*\n((?:  .*\n|\n(?=  ))*)", text + "\n", re.MULTILINE)
    return found.group(1) if found else ""


class TestText:
    def test_the_counts_of_a_four_bar(self):
        text = structure_text(four_bar_linkage())
        assert "Kutzbach count: 3 (4 - 1) - 2 * 4 - 0 = 1" in text
        assert "mobility m = 1, hyperstaticity h = 0, mobility index m - h = 1" in text
        assert "I_c = 4 unknowns, E_c = 3 equations, rank r_c = 3" in text
        assert "I_s = 8 unknowns, E_s = 9 equations, rank r_s = 8" in text
        assert "drives: 1, as many as m" in text
        assert "every joint force follows from statics" in text
        loop = "1: ground -(D)- rocker -(B)- coupler -(A)- crank -(O)- ground"
        assert section(text, "Independent loops").strip() in (loop, _reversed(loop))
        assert "dyad RRR, class II  coupler, rocker" in section(text, "Groups")
        assert section(text, "Bars (4)").splitlines()[-1].split()[1:] in (
            ["1", "-1", "-1", "1"],
            ["-1", "1", "1", "-1"],
        )

    def test_every_line_fits_a_terminal(self):
        for mechanism in (four_bar_linkage(), slider_crank_linkage(), three_cranks(extra=True)):
            assert all(len(line) <= 120 and line == line.rstrip() for line in structure_text(mechanism).splitlines())

    def test_redundancy_names_the_joints_and_the_redundant_link(self):
        text = structure_text(three_cranks(extra=True))
        printed = " ".join(section(text, "Mobility").split())
        assert "mobility m = 1, hyperstaticity h = 1" in printed
        for joint in ("O (ground - first)", "G (ground - third)", "C (third - coupler)"):
            assert joint in printed
        assert "P (rod" not in printed
        assert re.search(r"overconstrained link, 1 redundant constraint +third", section(text, "Groups"))

    def test_a_wrong_number_of_drives_is_reported(self):
        text = structure_text(replace(four_bar_linkage(), drives=()))
        assert "drives: 0, but m = 1" in text
        assert "none: links" in section(text, "Groups")

    def test_gears_are_contacts(self):
        wheels = Mechanism(
            (Link("ground", {"O": 0, "D": 3}), Link("a", {"O": 0}), Link("b", {"D": 0})), (), {"O": 0, "D": 3}
        )
        text = structure_text(wheels, [Contact("mesh", "a", "b", 1.0)])
        assert "mesh  rolling  a - b" in text
        assert "= 0\n" in text
        assert "m = 1, hyperstaticity h = 1" in text
        assert "drives: 0, but m = 1" in text

    def test_nearly_redundant_dimensions_are_reported(self):
        exact = three_cranks()
        pivot, pin = 0.37 + 1e-5j, exact.drawing["C"]
        links = {link.name: link for link in exact.links}
        links["ground"] = replace(links["ground"], points={**links["ground"].points, "G": pivot})
        drawn = {**exact.drawing, "G": pivot}
        # A crank that fits the moved pivot: closed, but nearly singular.
        links["third"] = Link("third", {"G": 0.0, "C": abs(pin - pivot)})
        text = structure_text(replace(exact, links=tuple(links.values()), drawing=drawn))
        assert "m = 0, hyperstaticity h = 0" in text
        assert "nearly singular" in text
        assert "nearly singular" not in structure_text(exact)
        # The original crank: no position closes.
        links["third"] = next(link for link in exact.links if link.name == "third")
        text = structure_text(replace(exact, links=tuple(links.values()), drawing=drawn))
        assert "does not close near its drawing" in text
        assert "if dimensions are rounded, give more digits" in " ".join(text.split())

    def test_a_collinear_triangle_causes_advice(self):
        places = {"O": 0, "A": 0.1, "B": 0.3, "D": 0.3 + 0.2j}
        bars = (("one", "O", "A"), ("two", "A", "B"), ("three", "O", "B"), ("arm", "D", "B"))
        printed = " ".join(structure_text(linkage(places, "OD", bars)).split())
        assert "one, two, three are pinned to one another in a straight line" in printed
        assert "make them one link with three points" in printed

    def test_a_mechanism_that_does_not_close_still_has_its_graph(self):
        long = replace(four_bar_linkage(), links=(*four_bar_linkage().links[:3], Link("rocker", {"D": 0.0, "B": 9.0})))
        text = structure_text(long)
        assert "m and h are unknown: the mechanism does not close" in text
        assert "Bars (4) and nodes (4)" in text

    def test_screw_and_nut(self):
        x = (1.0, 0.0, 0.0)
        text = spatial_text(
            [
                SpatialJoint("P", ("support", "screw"), "pivot", (0, 0, 0), x),
                SpatialJoint("G", ("support", "nut"), "slide", (0.2, 0.1, 0), x),
                SpatialJoint("H", ("nut", "screw"), "screw", (0.2, 0, 0), x, 0.002),
            ],
            "Screw and nut",
        )
        assert text.startswith("Screw and nut\n=============\n")
        assert "m = 1, hyperstaticity h = 4, mobility index m - h = -3" in text
        assert "rank r_c = 2" in text
        assert "Vz of G  = -0.002 * Ωz of P" in text
        assert "N = -p Z" in text

    def test_the_law_depends_on_the_number_of_motions(self):
        ball = [SpatialJoint("B", ("a", "b"), "ball")]
        assert "3 independent motions: choose as many inputs" in spatial_text(ball)
        assert "no motion" in spatial_text([SpatialJoint("B", ("a", "b"), "fixed")])


def _reversed(loop):
    """Return the same loop in reversed order."""
    number, way = loop.split(": ")
    return f"{number}: " + " ".join(reversed(way.split()))


def words(svg):
    """Return the texts of a picture."""
    return [element.text for element in ElementTree.fromstring(svg).iter() if element.tag.endswith("}text")]


class TestSkeleton:
    @pytest.mark.parametrize("mechanism", [four_bar_linkage(), slider_crank_linkage(), three_cranks(extra=True)])
    def test_every_link_and_joint_is_named_once(self, mechanism):
        names = [link.name for link in mechanism.links[1:]]
        names += {point for link in mechanism.links for point in link.points}
        assert sorted(words(skeleton_svg(mechanism))) == sorted(names)

    def test_the_picture_is_reproducible(self):
        assert skeleton_svg(slider_crank_linkage()) == skeleton_svg(slider_crank_linkage())

    def test_links_are_drawn_in_place(self):
        axes = skeleton(four_bar_linkage()).axes[0]
        ends = {tuple(np.round(line.get_xydata()[[0, -1]], 12).ravel()) for line in axes.lines}
        assert {(0.0, 0.0, 0.06, 0.08), (0.06, 0.08, 0.3, 0.21)} <= ends

    def test_plates_and_driven_sliders(self):
        places = {"O": 0, "A": 0.1j, "B": 0.2 + 0.15j, "C": 0.1 + 0.3j}
        links = linkage(places, "O", (("crank", "O", "A"),), (("plate", "ABC"),)).links
        guide = Slider("guide", "shoe", "plate", "S", 0.05, 1j)
        drawing = {**places, "S": 0.1j + (0.05 + 0.1j) * np.exp(-0.7j)}  # on the line, in local axes of the plate
        mechanism = Mechanism((*links, Link("shoe", {"S": 0})), (SliderDrive("guide"),), drawing, (guide,))
        figure = skeleton(mechanism)
        outlines = [patch.get_xy() for patch in figure.axes[0].patches if hasattr(patch, "get_xy")]
        corners = [{complex(*np.round(corner, 9)) for corner in outline} for outline in outlines]
        assert {places[point] for point in "ABC"} in corners
        assert set(words(skeleton_svg(mechanism))) == {"crank", "plate", "shoe", *"OABCS"}

    def test_a_mechanism_that_does_not_close_is_an_error(self):
        long = replace(four_bar_linkage(), links=(*four_bar_linkage().links[:3], Link("rocker", {"D": 0.0, "B": 9.0})))
        with pytest.raises(MechanismError, match="does not close"):
            skeleton_svg(long)

    def test_a_point_on_three_links_is_one_pin(self):
        places = {"O": 0, "A": 1, "B": 1 + 1j, "C": 2}
        bars = (("one", "O", "A"), ("two", "A", "B"), ("three", "A", "C"))
        svg = skeleton_svg(linkage(places, "O", bars, drives=[PinDrive("three", "A", "two")]))
        assert words(svg).count("A") == 1
