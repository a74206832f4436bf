"""What the report promises: it stands alone, shows the summary's figures, and estimates as the handbooks do."""

import base64
import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import imageio.v3 as iio
import numpy as np
import pytest

from elastic import deflection
from kinelast.command import main
from kinelast.output_results import Results, peaks
from kinelast.report_charts import line_chart, map_image, palette
from kinelast.report_numbers import number, quantity, round_down, round_up, ticks
from kinelast.report_trust import findings, lowest_frequency
from kinelast.scene import scene_from_dict, scene_motion
from kinelast.scene_files import shipped_scenes

VOID = {"meta", "img", "br", "link"}
ARM = {
    "title": "arm",
    "sections": {"bar": {"shape": "rectangle", "depth": 0.006, "width": 0.01}},
    "materials": {"steel": {"E": 210e9, "density": 7850}},
    "points": {"O": [0, 0], "A": [0.2, 0]},
    "links": {"ground": {"points": ["O"]}, "arm": {"points": ["O", "A"], "section": "bar", "material": "steel"}},
    "drives": [{"link": "arm", "speed": 1e-3}],
    "run": {"positions": 1, "gravity": [0, -9.81]},
}


def results_of(**changes):
    """An arm that hangs out sideways, so slow that gravity alone bends it."""
    scene = scene_from_dict({**ARM, **changes}, "arm")
    return Results(scene, deflection(scene_motion(scene), scene.sections))


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Folders of all shipped scenes."""
    out = tmp_path_factory.mktemp("reports")
    assert main([*shipped_scenes(), "--positions", "36", "--quiet", "-o", str(out)]) == 0
    return {name: out / name for name in shipped_scenes()}


class Reader(HTMLParser):
    """Collects the open tags, the addresses and the text of a page."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.words = [], [], []

    def handle_starttag(self, tag, attributes):
        self.addresses += [value for name, value in attributes if name in ("src", "href", "srcset", "data", "action")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.addresses += [value for name, value in attributes if name in ("src", "href", "xlink:href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@pytest.mark.parametrize("name", sorted(shipped_scenes()))
def test_the_page_is_whole_and_stands_alone(name, reports):
    page = (reports[name] / "report.html").read_text()
    reader = Reader()
    reader.feed(page)
    assert reader.open == []
    bends = bool(json.loads((reports[name] / "summary.json").read_text())["links"])
    assert bool(reader.addresses) == bends  # maps of the bending
    assert all(address.startswith("data:image/png;base64,") for address in reader.addresses)
    assert not re.search(r"(?i)https?://[^\s]*\.(css|js|png|svg|woff)|@import|url\(|<script|<link|<iframe", page)
    assert "nan" not in re.sub(r"base64,[^\"]*", "", page).lower().replace("resonan", "").split()
    for svg in re.findall(r"<svg.*?</svg>", page, re.S):
        ElementTree.fromstring(svg)


@pytest.mark.parametrize("name", sorted(shipped_scenes()))
def test_the_page_shows_the_figures_of_the_summary(name, reports):
    reader = Reader()
    reader.feed((reports[name] / "report.html").read_text())
    text = " ".join(reader.words)
    summary = json.loads((reports[name] / "summary.json").read_text())
    for peak in [peak for fields in summary["peaks"].values() for peak in fields.values()]:
        assert quantity(peak["value"], peak["unit"]) in text
    for drive in summary["drives"].values():
        assert quantity(drive["effort"]["value"], drive["effort"]["unit"]) in text
    for finding in summary["trust"]:
        assert finding["text"] in text


def test_the_lines_of_the_documentation_run(capsys):
    """They print how far the coupler of the steel four-bar deflects."""
    page = (Path(__file__).parents[1] / "docs" / "report.md").read_text()
    for lines in re.findall(r"```python\n(.*?)```", page, re.S):
        exec(lines, {})
    maxima = json.loads((Path(__file__).parent / "data" / "steel_four_bar.json").read_text())["maxima"]
    assert float(capsys.readouterr().out.split()[0]) == pytest.approx(1000 * maxima["coupler"]["w"], abs=5e-4)


def test_words_of_a_scene_are_not_taken_for_markup(tmp_path):
    scene = tmp_path / "odd.toml"
    text = shipped_scenes()["steel_four_bar"].read_text()
    scene.write_text(re.sub(r"(?m)^title = .*$", "title = '<script>alert(1)</script> & more'", text))
    assert main([str(scene), "--positions", "8", "--quiet", "-o", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "odd" / "report.html").read_text()
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in page


def test_a_scene_without_a_computed_position_still_has_a_report(tmp_path, capsys):
    """A parallelogram looked at in its two flat positions alone."""
    scene = tmp_path / "flat.toml"
    bars = [("crank", "O", "A"), ("coupler", "A", "B"), ("rocker", "D", "B")]
    links = "".join(f'[links.{n}]\npoints = ["{a}", "{b}"]\nsection = "bar"\nmaterial = "steel"\n' for n, a, b in bars)
    scene.write_text(
        "[materials.steel]\nE = 210e9\ndensity = 7850\n"
        "[sections.bar]\nshape = 'rectangle'\ndepth = 0.006\nwidth = 0.01\n"
        "[points]\nO = [0, 0]\nA = [0.06, 0.08]\nB = [0.36, 0.08]\nD = [0.3, 0]\n[links.ground]\npoints = ['O', 'D']\n"
        + links
        + "[[drives]]\nlink = 'crank'\nstart = 0.0\nspeed = 10.0\n[run]\npositions = 2\n"
    )
    assert main([str(scene), "-o", str(tmp_path / "out")]) == 0
    assert "no position could be computed" in capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "flat" / "summary.json").read_text())
    assert summary["largest_deflection"] is None
    assert summary["peaks"]["coupler"]["w"]["value"] is None
    assert summary["trust"][0]["level"] == "poor"


def test_a_scene_of_rigid_links_alone_has_a_report(tmp_path, capsys):
    """A block of 2 kg pushed along by 30 mm in 0.1 s, cycloidally: its drive pushes with 2 pi m h/T^2 at most."""
    scene = tmp_path / "push.toml"
    scene.write_text(
        "[points]\nO = [0, -0.1]\nA = [0, 0]\n[links.ground]\npoints = ['O']\n"
        "[links.block]\npoints = ['A']\nrigid = true\nmass = 2.0\n"
        "[sliders.guide]\nlink = 'block'\nthrough = 'A'\ndirection = [1, 0]\n"
        "[[drives]]\nslider = 'guide'\nlaw = [{curve = 'cycloidal', by = 0.03, duration = 0.1}]\n"
        "[run]\npositions = 101\n"
    )
    assert main([str(scene), "--check", "--refine", "-o", str(tmp_path / "out")]) == 0
    assert "no link has beams" in capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "push" / "summary.json").read_text())
    effort = summary["drives"]["guide"]["effort"]
    assert abs(effort["value"]) == pytest.approx(2 * math.pi * 2.0 * 0.03 / 0.1**2)
    assert effort["unit"] == "N"
    assert "time [ms]" in (tmp_path / "out" / "push" / "report.html").read_text()


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (0.0011584, "m", "1.158 mm"),
        (2.2e-6, "m", "2.2 µm"),
        (12.6e6, "N", "12.6 MN"),
        (-13.13, "N m", "\u221213.13 N·m"),
        (12.0, "m", "12 m"),
        (5400.0, "m", "5400 m"),
        (0.0, "N", "0 N"),
        (3.2e-15, "1", "3.2·10⁻¹⁵"),
        (math.nan, "m", "\u2013"),
        (math.inf, "N", "∞"),
    ],
)
def test_quantities_in_words(value, unit, words):
    assert quantity(value, unit) == words


def test_round_numbers():
    assert [round_up(value) for value in (1.0, 1.1, 2.1, 3.0, 7.0)] == [1.0, 2.0, 2.5, 5.0, 10.0]
    assert [round_down(value) for value in (1.0, 1.9, 4.9, 7.0, 0.06)] == pytest.approx([1.0, 1.0, 2.0, 5.0, 0.05])
    assert ticks(-1.0, 1.0) == pytest.approx([-1.0, -0.5, 0.0, 0.5, 1.0])
    assert number(123456.0) == "123456"


def test_curves_are_drawn_to_scale_and_broken_where_there_is_no_number():
    x = np.arange(5.0)
    svg = ElementTree.fromstring(line_chart(x, {"one": np.array([0.0, 1.0, np.nan, 3.0, 4.0])}, "m", "x", [0.0, 4.0]))
    lines = [np.array([pair.split(",") for pair in line.get("points").split()], float) for line in svg.iter("polyline")]
    assert [len(line) for line in lines] == [2, 2]
    (x0, y0), (x1, y1) = lines[0]
    (x3, y3), (x4, y4) = lines[1]
    assert (x3 - x0, x4 - x0) == pytest.approx((3 * (x1 - x0), 4 * (x1 - x0)), abs=0.2)
    assert (y3 - y0, y4 - y0) == pytest.approx((3 * (y1 - y0), 4 * (y1 - y0)), abs=0.2)
    assert y4 < y3 < y1 < y0
    (dot,) = svg.iter("circle")
    assert (float(dot.get("cx")), float(dot.get("cy"))) == pytest.approx((x4, y4), abs=0.1)


def test_long_curves_keep_their_peaks():
    heights = np.sin(np.linspace(0.0, 9.0, 30000))
    heights[[777, 20001]] = 3.0, -2.0
    svg = ElementTree.fromstring(line_chart(np.arange(30000.0), {"one": heights}, "m", "x", []))
    (line,) = svg.iter("polyline")
    points = np.array([pair.split(",") for pair in line.get("points").split()], float)
    assert len(points) < 2500
    assert np.all(np.diff(points[:, 0]) >= 0)
    plain = ElementTree.fromstring(line_chart(np.arange(2.0), {"one": np.array([3.0, -2.0])}, "m", "x", []))
    (ends,) = plain.iter("polyline")
    top, bottom = (float(pair.split(",")[1]) for pair in ends.get("points").split())
    assert (points[:, 1].min(), points[:, 1].max()) == (top, bottom)


def test_maps_show_the_sign_of_every_value():
    """Positions go across, stations up; positive is red, negative blue, nan grey."""
    values = np.array([[1.0, -1.0], [0.0, 0.5], [np.nan, np.nan]])
    image = iio.imread(base64.b64decode(map_image(values).split(",")[1]), extension=".png")[..., :3].astype(int)
    assert image.shape == (2, 3, 3)
    top, bottom = image
    assert bottom[0][0] > bottom[0][2] + 50
    assert top[0][2] > top[0][0] + 50
    assert bottom[1].min() > 240
    assert 0 < top[1][0] - top[1][2] < bottom[0][0] - bottom[0][2]
    assert top[2].tolist() == bottom[2].tolist() == palette()[0].tolist()


def test_natural_frequency_of_a_cantilever_by_rayleigh():
    """With the shape under its own weight: w^2 = 24 (6/5)/(104/45) EI/(m' l^4), by integrating x^4 - 4 x^3 + 6 x^2."""
    EI, mass_per_length, length = 210e9 * 0.01 * 0.006**3 / 12, 7850 * 6e-5, 0.2
    expected = math.sqrt(24 * (6 / 5) / (104 / 45) * EI / (mass_per_length * length**4))
    assert lowest_frequency(results_of()) == pytest.approx(expected, rel=1e-5)
    exact = 1.875104069**2 * math.sqrt(EI / (mass_per_length * length**4))
    assert exact < lowest_frequency(results_of()) < 1.01 * exact


@pytest.mark.parametrize(
    ("changes", "heading", "level"),
    [
        ({}, "Slender links", "good"),
        ({"sections": {"bar": {"shape": "rectangle", "depth": 0.02, "width": 0.01}}}, "Slender links", "caution"),
        ({"sections": {"bar": {"shape": "rectangle", "depth": 0.08, "width": 0.01}}}, "Slender links", "poor"),
        ({}, "Small displacements", "good"),
        ({"run": {"positions": 1, "gravity": [0, -2e3]}}, "Small displacements", "caution"),
        ({"run": {"positions": 1, "gravity": [0, -2e4]}}, "Small displacements", "poor"),
        ({}, "Quasi-static answer", "good"),
        ({"drives": [{"link": "arm", "speed": 40.0}]}, "Quasi-static answer", "caution"),
        ({"drives": [{"link": "arm", "speed": 400.0}]}, "Quasi-static answer", "poor"),
        ({}, "Finite element check", "caution"),
        ({}, "Conditioning of the positions", "good"),
    ],
)
def test_trust_follows_the_scene(changes, heading, level):
    """Slenderness 115, 35, 9; deflection m' g l^4/(8 EI)/l = 4e-5 to 0.08; first frequency about 790 rad/s."""
    results = results_of(**changes)
    found = {finding.heading: finding.level for finding in findings(results, peaks(results), lowest_frequency(results))}
    assert found[heading] == level
