"""The report is self-contained, shows the figures of the summary, and its estimates agree with handbooks."""

import base64
import csv
import json
import math
import re
import tomllib
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import imageio.v3 as iio
import numpy as np
import pytest
from scene_texts import ARM, PARALLELOGRAM, PUSHED, edited, linked
from tiers import in_tiers

from elastic import deflection
from kinelast.answers.results import Results
from kinelast.cli.command import main
from kinelast.figures.cycle import EXTREME_FIELDS
from kinelast.figures.refined_peaks import refined
from kinelast.outputs import page
from kinelast.outputs.charts import GREY, Axis, Chart, Curve, axis, cycle_charts, cycle_maps, field_maps, line_charts
from kinelast.outputs.pictures import mechanism_drawing
from kinelast.reports.summary import summary
from kinelast.reports.trust import findings
from kinelast.runs import computed
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_dict, scene_from_text
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes
from kinelast.values.numbers import number, quantity, round_down, round_up, ticks

VOID = {"meta", "img", "br", "link"}
HANGING = tomllib.loads(
    edited(
        ARM,
        ("speed = 50.0", "speed = 1e-3"),
        ("positions = 8", """positions = 1\nbeams = "euler-bernoulli"\ngravity = [0, -9.81]"""),
    )
)


def results_of(**changes):
    """Return results of a horizontal arm, so slow that only gravity bends it."""
    scene = scene_from_dict({**HANGING, **changes}, "arm")
    return Results(scene, deflection(scene_motion(scene), scene.sections))


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Return a function that returns the report folder of a shipped scene, written at the first call."""
    out = tmp_path_factory.mktemp("reports")

    @cache
    def written(name):
        long = name in {"flap_bars", "flap_plates", "pusher"}  # computing their vibration takes seconds
        theory = ("--theory", "quasi-static") if long else ()
        too_close = name == "pusher"  # without vibration the ground force is 48 % off
        assert main([name, "--positions", "72", "--quiet", *theory, "-o", str(out)]) == too_close
        return out / name

    return written


class Reader(HTMLParser):
    """Collects the open tags, addresses, names and text of a page."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.names, self.words = [], [], [], []

    def handle_starttag(self, tag, attributes):
        self.handle_startendtag(tag, attributes)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        of = ("src", "href", "xlink:href", "srcset", "data", "action")
        self.addresses += [value for name, value in attributes if name in of]
        self.names += [value for name, value in attributes if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


TYPICAL = ("steel_four_bar", "quick_return", "pusher")
SHIPPED = in_tiers([*TYPICAL, *sorted(shipped_scenes().keys() - {*TYPICAL})], 2, 6)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_page_is_whole_and_stands_alone(name, reports):
    """test_page.py tests the page in a browser."""
    page = (reports(name) / "report.html").read_text()
    reader = Reader()
    reader.feed(page)
    assert reader.open == []
    assert reader.addresses == ["data:,"]  # an empty icon, otherwise a browser requests one
    assert not re.search(
        r"(?i)https?://(?!www\.w3\.org/2000/svg\")|@import|\burl\((?!#)|<iframe|src=", page.replace("URL", "")
    )
    assert len(set(reader.names)) == len(reader.names)


def data_of(folder):
    """Return the JSON data of the page in a folder."""
    page = (folder / "report.html").read_text()
    (text,) = re.findall(r'<script type="application/json" id="scene">(.*?)</script>', page, re.S)
    return json.loads(text, parse_constant=pytest.fail)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_page_holds_the_figures_of_the_summary(name, reports):
    summary = json.loads((reports(name) / "summary.json").read_text())
    held = data_of(reports(name))["summary"]
    for written_later in ("files", "sha256", "failed"):
        summary.pop(written_later, None), held.pop(written_later, None)
    assert held == summary


def test_a_copy_of_the_source_takes_the_charts_of_the_installed_package(tmp_path, monkeypatch):
    web = Path("kinelast/outputs/page/web")
    for root, names in (("copy", ()), ("installed", ("uPlot.iife.js",))):
        (tmp_path / root / web).mkdir(parents=True)
        for name in names:
            (tmp_path / root / web / name).touch()
    installed = SimpleNamespace(locate_file=lambda path: tmp_path / "installed" / path)
    monkeypatch.setattr(page, "WEB", tmp_path / "copy" / web)
    monkeypatch.setattr(page, "_packaged", lambda: None)
    monkeypatch.setattr("importlib.metadata.distribution", lambda name: installed)
    assert page._library() == tmp_path / "installed" / web


def test_words_of_a_scene_are_not_taken_for_markup(tmp_path):
    scene = tmp_path / "odd.toml"
    text = shipped_scenes()["steel_four_bar"].read_text()
    scene.write_text(re.sub(r"(?m)^title = .*$", "title = '<script>alert(1)</script> & more'", text))
    assert main([str(scene), "--positions", "72", "--quiet", "-o", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "odd" / "report.html").read_text()
    assert "<script>alert" not in page
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt; &amp; more") == 2  # title and heading
    assert data_of(tmp_path / "out" / "odd")["summary"]["scene"]["title"] == "<script>alert(1)</script> & more"


def test_a_scene_without_a_computed_position_still_has_a_report(tmp_path, capsys):
    """A parallelogram, only in its two flat positions."""
    scene = tmp_path / "flat.toml"
    scene.write_text(edited(PARALLELOGRAM, ("positions = 36", "positions = 2")))
    assert main([str(scene), "-o", str(tmp_path / "out")]) == 0
    assert "no position could be computed" in capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "flat" / "summary.json").read_text())
    assert summary["largest_deflection"] is None
    assert summary["peaks"]["coupler"]["w"]["value"] is None
    assert summary["trust"][0]["level"] == "poor"


def test_a_scene_of_rigid_links_alone_has_a_report(tmp_path, capsys):
    """A block of 2 kg moves by 30 mm in 0.1 s by a cycloid: the largest drive force is 2 pi m h/T^2."""
    scene = tmp_path / "push.toml"
    scene.write_text(edited(PUSHED, ("positions = 5", "positions = 101")))
    assert main([str(scene), "--check", "--refine", "-o", str(tmp_path / "out")]) == 0
    assert "no link has beams" in capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "push" / "summary.json").read_text())
    effort = summary["drives"]["guide"]["effort"]
    assert abs(effort["value"]) == pytest.approx(2 * math.pi * 2.0 * 0.03 / 0.1**2)
    assert effort["unit"] == "N"
    assert data_of(tmp_path / "out" / "push")["model"]["beams"] == []


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
        (5e-6, "m^3/s", "5 cm³/s"),
        (0.2, "kg m^2", "0.2 kg·m²"),
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


def drawn(axis, *curves):
    """Return the lines of a chart in picture coordinates, y up, without the grid."""
    chart = Chart("one", "m", [Curve(str(k), values, k) for k, values in enumerate(curves)])
    svg = ElementTree.fromstring(line_charts(axis, [chart])[0])
    paths = [path for path in svg.iter("{http://www.w3.org/2000/svg}path") if "#0b5fa5" in path.get("style", "")]
    lines = [path.get("d") for path in paths if path.get("clip-path")]
    found = [np.array([pair.split() for pair in re.findall(r"[\d.]+ [\d.]+", part)], float) * (1, -1)
             for line in lines for part in line.split("M")[1:]]  # fmt: skip
    (dot,) = [use for use in svg.iter("{http://www.w3.org/2000/svg}use") if "#0b5fa5" in use.get("style", "")]
    return found, (float(dot.get("x")), -float(dot.get("y")))


def test_curves_are_drawn_to_scale_and_broken_where_there_is_no_number():
    axis = Axis(np.arange(5.0), "x", [0.0, 4.0])
    lines, dot = drawn(axis, np.array([0.0, 1.0, np.nan, 3.0, 4.0]))
    assert [len(line) for line in lines] == [2, 2]
    (x0, y0), (x1, y1) = lines[0]
    (x3, y3), (x4, y4) = lines[1]
    assert (x3 - x0, x4 - x0) == pytest.approx((3 * (x1 - x0), 4 * (x1 - x0)), rel=1e-4)
    assert (y3 - y0, y4 - y0) == pytest.approx((3 * (y1 - y0), 4 * (y1 - y0)), rel=1e-4)
    assert y4 > y3 > y1 > y0
    assert dot == pytest.approx((x4, y4))


def test_long_curves_keep_their_peaks_and_are_drawn_with_few_points():
    heights = np.sin(np.linspace(0.0, 9.0, 30000))
    heights[[777, 20001]] = 3.0, -2.0
    (line,), _ = drawn(Axis(np.arange(30000.0), "x", []), heights)
    (ends,), _ = drawn(Axis(np.arange(2.0), "x", []), np.array([3.0, -2.0]))
    assert len(line) < 2500
    assert np.ptp(line[:, 1]) == pytest.approx(np.ptp(ends[:, 1]), rel=2e-3)


def test_a_second_chart_has_no_curves_of_the_first():
    axis = Axis(np.arange(3.0), "x", [])
    both = [Chart("first", "m", [Curve("a", np.ones(3), 3)]), Chart("second", "m", [Curve("b", np.ones(3), 4)])]
    first, second = line_charts(axis, both)
    assert "#7a3b8f" in first
    assert "#7a3b8f" not in second
    assert "#8a6d00" in second


def test_maps_show_the_sign_of_every_value():
    """Positions run across and stations up; positive is blue, negative red, nan grey, as in the diagrams."""
    values = np.array([[1.0, -1.0], [0.0, 0.5], [np.nan, np.nan]])
    svg = field_maps(Axis(np.arange(3.0), "x", [0.0]), ["bar"], {"M": (values[None], ["±1"])})
    (picture,) = re.findall(r"base64,([^\"]*)", svg)
    image = iio.imread(base64.b64decode(picture), extension=".png").astype(int)
    assert np.unique(image[..., 3]).tolist() == [0, 255]
    drawn = image[:, image[0, :, 3] > 0][..., :3]
    first, middle, last = (drawn[:2, column] for column in (0, drawn.shape[1] // 2, -1))
    (top, bottom), zero, half = first, middle[1], middle[0]
    assert bottom[2] > bottom[0] + 50
    assert top[0] > top[2] + 50
    assert zero.min() > 240
    assert half[2] > half[0]
    assert bottom.sum() < half.sum() < zero.sum()
    assert last.tolist() == [[GREY] * 3] * 2


SUBJECTS = {
    "Stubby links": "beam theory neglects",
    "Large displacements": "of its length",
    "Buckling": "critical load",
    "Strength": "yield stress",
}


def limited(stress):
    return {"steel": {"E": 210e9, "density": 7850, "yield": stress}}


@pytest.mark.parametrize(
    ("changes", "heading", "level"),
    [
        ({}, "Stubby links", None),
        ({"sections": {"bar": {"shape": "rectangle", "depth": 0.03, "width": 0.01}}}, "Stubby links", "caution"),
        ({"sections": {"bar": {"shape": "rectangle", "depth": 0.08, "width": 0.01}}}, "Stubby links", "poor"),
        ({}, "Large displacements", None),
        ({"run": {"positions": 1, "gravity": [0, -2e3]}}, "Large displacements", "caution"),
        ({"run": {"positions": 1, "gravity": [0, -2e4]}}, "Large displacements", "poor"),
        ({}, "Buckling", None),
        ({"run": {"positions": 1, "gravity": [-2e4, 0]}}, "Buckling", "caution"),
        ({"run": {"positions": 1, "gravity": [-6e4, 0]}}, "Buckling", "poor"),
        ({"materials": limited(4e6)}, "Strength", None),
        ({"materials": limited(2e6)}, "Strength", "caution"),
        ({"materials": limited(1e6)}, "Strength", "poor"),
        ({}, "Not judged", "open"),
        ({}, "Finite element check", "open"),
        ({}, "Dead points", "good"),
    ],
)
def test_trust_follows_the_scene(changes, heading, level):
    """The depths are 3, 15 and 40 % of the length; 1.8 times the square appears at the root.

    Deflection m' g l^3/(8 EI) = 1e-4 to 0.2 of the length; m' g l over Euler's load = 0.2 and 0.6; stress at the root
    m' g l^2/2 over b h^2/6 = 1.54 MPa.
    """
    found = {finding.heading: finding for finding in findings(results_of(**changes))}
    fine = found["Within the limits"].text.lower()
    if level is None:
        assert heading not in found
        assert SUBJECTS.get(heading, "") in fine
    else:
        assert found[heading].level == level
        assert SUBJECTS.get(heading, "?") not in fine


def test_the_worst_figure_is_named_first_and_others_by_name():
    """Two arms of the same section on one pin, one of them shorter."""
    links = {
        "ground": {"points": ["O"]},
        "arm": {"points": ["O", "A"], "section": "bar", "material": "steel"},
        "stub": {"points": ["A", "B"], "section": "bar", "material": "steel"},
    }
    points = {"O": [0, 0], "A": [0.035, 0], "B": [0.065, 0]}
    drives = [{"link": "arm", "speed": 1e-3}, {"link": "stub", "on": "arm", "speed": 1e-3}]
    found = findings(results_of(links=links, points=points, drives=drives))
    assert found[0].heading == "Stubby links"
    assert found[0].text.startswith("stub is short and deep: beam theory neglects about 7.3 % of its own largest")
    assert found[0].text.endswith("less so arm.")


@pytest.fixture(scope="module")
def steel(tmp_path_factory):
    """Return summary, table and fields of the steel four-bar: links 10 mm by 6 mm, E = 210 GPa, yield 355 MPa."""
    out = tmp_path_factory.mktemp("steel")
    assert (
        main(["steel_four_bar", "--positions", "60", "--fields", "--stations", "801", "--quiet", "-o", str(out)]) == 0
    )
    folder = out / "steel_four_bar"
    with (folder / "positions.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
    return json.loads((folder / "summary.json").read_text()), table, np.load(folder / "fields.npz")


AREA, INERTIA, FIBRE, E = 6e-5, 0.01 * 0.006**3 / 12, 0.003, 210e9
LENGTHS = {"crank": 0.1, "coupler": 0.3, "rocker": 0.25}


@pytest.mark.parametrize("link", LENGTHS)
def test_stresses_are_those_of_the_section_forces(link, steel):
    """N/A and M c/I at the outermost fibres, 3/2 V/A on the axis of a rectangle; reference: a dense search."""
    summary, table, fields = steel
    N, V, M = (fields[f"{link}/{field}"] for field in "NVM")
    fibres = np.array([N / AREA - M * FIBRE / INERTIA, N / AREA + M * FIBRE / INERTIA])
    normal, shear = np.abs(fibres).max(axis=(0, 2)), np.abs(1.5 * V / AREA)
    mises = np.maximum(normal, np.sqrt((N / AREA) ** 2 + 3 * shear**2).max(axis=1))
    for name, expected in (("normal", normal), ("shear", shear.max(axis=1)), ("mises", mises)):
        column = np.abs(table[f"{link}.{name}_max [Pa]"])
        np.testing.assert_allclose(column, expected, rtol=2e-5)
        assert summary["peaks"][link][name]["value"] == pytest.approx(column.max(), rel=1e-12) or name != "mises"
    strength = summary["strength"][link]
    swing = (fibres.max(axis=1) - fibres.min(axis=1)).max()
    assert strength["stress_range"]["value"] == pytest.approx(swing, rel=1e-3)
    assert strength["safety_factor"]["value"] == pytest.approx(355e6 / mises.max(), rel=1e-5)
    euler = np.maximum(-N.min(axis=1), 0.0) / (math.pi**2 * E * INERTIA / LENGTHS[link] ** 2)
    np.testing.assert_allclose(table[f"{link}.euler_ratio [1]"], euler, rtol=1e-4, atol=1e-9)
    # other ends, and axial forces that vary along the link
    assert 0.0 <= strength["buckling"]["value"] <= 1.3 * euler.max()
    assert strength["slenderness"]["value"] == pytest.approx(LENGTHS[link] * math.sqrt(12) / 0.006)


def test_deviation_from_the_path(steel):
    """A moves on a circle about O, to the left of its path; the crank's stretch is a negative deviation."""
    summary, table, fields = steel
    out = np.exp(1j * table["crank.angle [rad]"])
    seen = (table["A.dx [m]"] + 1j * table["A.dy [m]"]) / out
    np.testing.assert_allclose(table["A.off_path [m]"], -seen.real, atol=1e-15)
    np.testing.assert_allclose(table["A.off_path [m]"], -fields["crank/u"][:, -1], atol=1e-15)
    point = summary["points"]["A"]
    assert point["along_path"]["value"] == pytest.approx(seen.imag[np.abs(seen.imag).argmax()])
    assert point["displacement"]["value"] == pytest.approx(np.abs(seen).max())
    turned = fields["rocker/phi"][:, [0, -1]]
    assert abs(summary["angle_errors"]["rocker"]["value"]) == pytest.approx(np.abs(turned).max())


@pytest.mark.parametrize(
    ("name", "kind", "what"),
    in_tiers(
        [
            ("steel_four_bar", "angle", "rocker"),
            ("quick_return", "slide", "E"),
            ("flapping_wing", "point", "H"),
            ("offset_slider_crank", "slide", "B"),
        ],
        2,
        2,
    ),
)
def test_the_output_is_found(name, kind, what, reports):
    found = json.loads((reports(name) / "summary.json").read_text())["output"]
    assert found["kind"] == kind
    assert found["name"].lower() == what.lower()
    assert found["value"]


def test_natural_frequencies_of_a_cantilever():
    """1.8751^2, 4.6941^2 and 7.8548^2 times sqrt(EI/(m' l^4)): Timoshenko, Vibration Problems in Engineering."""
    omega = results_of().frequencies.omega[:, 0]
    unit = math.sqrt(E * INERTIA / (7850 * AREA * 0.2**4))
    np.testing.assert_allclose(omega / unit, np.square([1.875104, 4.694091, 7.854757]), rtol=1e-3)


STEEL = 'section = "bar"\nmaterial = "steel"'
TWELVE = ("positions = 8", "positions = 12")
ODD = {
    "tapered": edited(ARM, ("depth = 0.006", "depth = [0.012, 0.006]"), TWELVE) + "gravity = [0, -9.81]\n",
    "two_arms": edited(
        ARM,
        ("A = [0.2, 0]", "A = [0.2, 0]\nB = [0.3, 0]"),
        ("[links.arm]", linked(STEEL, fore="AB") + "[links.upper]"),
        (
            'link = "arm"\nspeed = 50.0',
            'link = "upper"\nspeed = 5.0\n[[drives]]\nlink = "fore"\non = "upper"\nspeed = -9.0',
        ),
        TWELVE,
    ),
    "block_on_beam": edited(
        ARM,
        ("A = [0.2, 0]", "C = [0, -0.1]\nD = [0, 0.2]\nA = [0, 0.05]"),
        ('["O"]', '["O", "C"]'),
        ("[links.arm]", linked(STEEL, rocker="CD") + linked("mass = 0.05", block="A") + "[links.arm]"),
        ("[[drives]]", '[sliders.slot]\nlink = "block"\non = "rocker"\nthrough = "A"\ndirection = [0, 1]\n[[drives]]'),
        ("speed = 50.0", "speed = 20.0"),
        TWELVE,
    ),
    "third_crank": edited(
        ARM,
        ("A = [0.2, 0]", "P = [0.1, 0]\nQ = [0.2, 0]\nA = [0.03, 0.04]\nB = [0.13, 0.04]\nC = [0.23, 0.04]"),
        ('["O"]', '["O", "P", "Q"]'),
        ("[[drives]]", linked(STEEL, two="PB", three="QC", bar="ABC") + "[[drives]]"),
        ("speed = 50.0", "start = 0.3\nspeed = 20.0"),
        ("positions = 8", "positions = 7"),
    ),
    "rigidities": edited(
        ARM,
        ("[points]", '[sections.known]\nshape = "rigidities"\nEA = 1e7\nEI = 40.0\nmass_per_length = 0.5\n[points]'),
        (STEEL, 'section = "known"'),
        TWELVE,
    ),
}


@pytest.mark.parametrize("name", in_tiers(ODD, 2, 3))
def test_scenes_of_every_kind_have_a_whole_report(name, tmp_path):
    scene = tmp_path / f"{name}.toml"
    scene.write_text(ODD[name])
    refine = [] if name == "third_crank" else ["--refine"]
    assert main([str(scene), *refine, "--quiet", "-o", str(tmp_path / "out")]) == 0
    folder = tmp_path / "out" / name
    page = Reader()
    page.feed((folder / "report.html").read_text())
    assert page.open == []
    assert data_of(folder)["model"]["positions"] in (7, 12)
    summary = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
    assert summary["largest_deflection"]["value"] is not None
    assert (not summary["stressed"]) == (name == "rigidities")
    assert (summary["largest_stress"] is None) == (name == "rigidities")


def test_the_stress_of_a_tapered_arm(tmp_path):
    """A steady arm that tapers to half its depth: rho w^2 l^2 times the integral of s (1 - s/2), over 1 - xi/2."""
    scene = tmp_path / "arm.toml"
    scene.write_text(edited(ODD["tapered"], ("gravity = [0, -9.81]", "")))
    assert main([str(scene), "--quiet", "-o", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "arm" / "summary.json").read_text())
    xi = np.linspace(0.0, 1.0, 100001)
    pull = 7850 * 50.0**2 * 0.2**2 * (1 / 3 - xi**2 / 2 + xi**3 / 6) / (1 - xi / 2)
    stress = summary["peaks"]["arm"]["normal"]
    assert stress["value"] == pytest.approx(pull.max(), rel=1e-8)
    assert stress["xi"] == pytest.approx(xi[pull.argmax()], abs=1e-4)


def parallelogram(count, start=0.1):
    """Return a parallelogram (cranks 0.1 m, base 0.3 m) near its flat position, bent only by gravity."""
    scene = tomllib.loads(PARALLELOGRAM)
    return {
        "points": scene["points"],
        "links": scene["links"],
        "drives": [{"link": "crank", "start": start, "speed": 1e-3}],
        "run": {"positions": count, "gravity": [0, -9.81], "beams": "euler-bernoulli"},
    }


@pytest.mark.parametrize("start", [0.0, 1e-3])
def test_round_off_near_a_change_point_is_no_largest_value(start):
    """The coupler bends under its weight on two pins: 5 m' g l^4/(384 EI) for any crank angle."""
    results = results_of(**parallelogram(24, start))
    figures = summary(results)
    assert figures["run"]["singular"] + figures["run"]["ill_conditioned"] == 2
    reported = " ".join(finding["text"] for finding in figures["trust"])
    assert ("The largest values exclude 2 positions near a dead point" in reported) == (start > 0)
    beam = results.scene.labels.index("coupler")
    for chord in (one.figures.peaks["chord"][beam] for one in (results, refined(results))):
        sag = 5 * 7850 * 6e-5 * 9.81 * 0.3**4 / (384 * 210e9 * 0.01 * 0.006**3 / 12)
        assert abs(chord.value) == pytest.approx(sag, rel=1e-4)


def test_refining_keeps_away_from_singular_positions():
    results = results_of(**parallelogram(24, 0.0))
    further = refined(results).figures
    for field in EXTREME_FIELDS:
        for before, after in zip(results.figures.of_field(field), further.of_field(field), strict=True):
            assert abs(after.value) <= 2 * abs(before.value) + 1e-9
            assert min(abs(math.remainder(after.drive[0], math.pi)), 1.0) > 0.2


def test_a_check_without_beams_compares_the_momentum_alone(tmp_path, capsys):
    scene = tmp_path / "block.toml"
    scene.write_text(PUSHED)
    assert main([str(scene), "--check", "--refine", "-o", str(tmp_path / "out")]) == 0
    assert "check agrees (momentum " in capsys.readouterr().out
    assert data_of(tmp_path / "out" / "block")["summary"]["check"]["passed"] is True
    trust = json.loads((tmp_path / "out" / "block" / "summary.json").read_text())["trust"]
    assert {one["heading"]: one["level"] for one in trust}["Finite element check"] == "good"


def test_advice_for_slender_links():
    bar = {"bar": {"shape": "rectangle", "depth": 0.03, "width": 0.01}}
    (text,) = [one.text for one in findings(results_of(sections=bar)) if one.heading == "Stubby links"]
    assert text.endswith('; beams = "euler-bernoulli" neglects shear.')
    unknown = {"bar": {"shape": "properties", "A": 3e-4, "I": 0.01 * 0.03**3 / 12}}
    unknown_shear = results_of(sections=unknown, run={"positions": 1, "gravity": [0, -9.81]})
    (text,) = [one.text for one in findings(unknown_shear) if one.heading == "Stubby links"]
    assert text.endswith("; its section has neither shear_area nor kGA, so shear is neglected.")
    softer = results_of(sections=bar, run={"positions": 1, "gravity": [0, -9.81]})
    (text,) = [one.text for one in findings(softer) if one.heading == "Stubby links"]
    assert "due to local effects at its ends." in text
    assert "shear" not in text
    (said,) = [one.text for one in findings(softer) if one.heading == "Shear"]
    assert said == "Poisson's ratio of steel is not given: 0.3, as for metals, is used for shear."


def test_charts_and_maps_have_gaps_where_positions_were_left_out():
    """Eight positions of an arm at 1e-3 rad/s over 7 s; the third to fifth are missing."""
    scene = scene_from_dict({**HANGING, "run": {"positions": 8, "duration": 7.0, "gravity": [0, -9.81]}}, "arm")
    course = scene.course.at(np.array([0.0, 1.0, 5.0, 6.0, 7.0]))
    results = Results(scene, deflection(course, scene.sections), left_out=3)
    over = axis(results)
    assert over.values == pytest.approx(np.degrees(1e-3 * np.arange(8.0)))
    for chart in cycle_charts(results):
        for curve in chart.curves:
            assert np.flatnonzero(np.isnan(curve.values)).tolist() == [2, 3, 4]
    for row in cycle_maps(results, over):
        (picture,) = re.findall(r"base64,([^\"]*)", row)
        image = iio.imread(base64.b64decode(picture), extension=".png").astype(int)
        drawn = image[0][image[0, :, 3] > 0]
        grey = (drawn[:, :3] == GREY).all(axis=1)
        assert grey.mean() == pytest.approx(3 / 7, abs=0.02)


def test_the_drawing_has_room_for_the_deformed_shape():
    """The weight of an arm bends it upwards, next to a small stub: the rigid shape is the topmost line."""
    links = {
        "ground": {"points": ["O"]},
        "arm": {"points": ["O", "A"], "section": "bar", "material": "steel"},
        "stub": {"points": ["A", "B"], "section": "bar", "material": "steel"},
    }
    points = {"O": [0, 0], "A": [0.2, 0], "B": [0.203, 0]}
    drives = [{"link": "arm", "speed": 1e-3}, {"link": "stub", "on": "arm", "speed": 1e-3}]
    run = {"positions": 1, "gravity": [0, 9.81]}
    results = results_of(links=links, points=points, drives=drives, run=run)
    svg = ElementTree.fromstring(mechanism_drawing(results, 0)[0])
    wide, tall = (float(size) for size in svg.get("viewBox").split()[2:])
    bent, _ = [
        path for path in svg.iter("{http://www.w3.org/2000/svg}path") if "stroke-width: 2.4" in path.get("style", "")
    ]
    spots = np.array([pair.split() for pair in re.findall(r"[\d.-]+ [\d.-]+", bent.get("d"))], float)
    assert (spots >= 0).all()
    assert (spots <= (wide, tall)).all()


def test_round_off_is_shown_as_nothing():
    """Gravity along an upright arm does not bend it."""
    results = results_of(points={"O": [0, 0], "A": [1.2e-17, 0.2]})
    arm = summary(results)["peaks"]["arm"]
    assert arm["M"]["value"] == arm["w"]["value"] == 0.0
    assert arm["N"]["value"] == pytest.approx(-7850 * 6e-5 * 9.81 * 0.2)
    assert results.figures.rounded(np.array([1e-9, -8e-10]), "N").tolist() == [1e-9, -8e-10]
    assert results.figures.rounded(np.array([1e-14, np.nan]), "N")[0] == 0.0


def test_power_of_nothing_is_shown_as_nothing():
    """A drive that lifts and lowers a weight has no mean power."""
    text = """
        points = {G = [0, 0], P = [0.3, 0.1]}
        links.ground.points = ["G"]
        links.plate = {points = ["G", "P"], rigid = true, mass = 40, center = "P"}
        drives = [{link = "plate", speed = 1}]
        run.gravity = [0, -9.81]
    """
    drive = summary(computed(scene_from_text(text), Request()))["drives"]["plate"]
    assert drive["mean_power"]["value"] == 0.0
    assert abs(drive["power"]["value"]) == pytest.approx(40 * 9.81 * np.hypot(0.3, 0.1), rel=1e-4)
    assert drive["energy_taken"]["value"] == pytest.approx(2 * 40 * 9.81 * np.hypot(0.3, 0.1), rel=1e-3)


def test_masses_are_reported_at_their_centre():
    """By the name of the point in the scene, otherwise by the position relative to the link's first point."""
    for center, reported in (
        ('"P"', {"point": "P"}),
        ("[0.03, 0.04]", {"point": "P"}),
        ("[0.03, 0.0]", {"point": "G", "offset": [{"value": 0.03, "unit": "m"}, {"value": 0.0, "unit": "m"}]}),
    ):
        text = f"""
            points = {{G = [0.1, 0], H = [0.15, 0], P = [0.13, 0.04]}}
            links.ground.points = ["G"]
            links.plate = {{points = ["G", "H", "P"], rigid = true, mass = 40, center = {center}}}
            drives = [{{link = "plate", speed = 1}}]
        """
        (row,) = summary(computed(scene_from_text(text), Request()))["inputs"]["point_masses"]
        assert row == {"link": "plate", **reported, "mass": {"value": 40.0, "unit": "kg"}}


def test_far_is_told_in_kilometres():
    assert quantity(22936.0, "m") == "22.94 km"
    assert quantity(9000.0, "m") == "9000 m"


@pytest.mark.parametrize(
    ("steel", "reported"),
    [
        (
            {"E": 210, "density": 7850},
            "The E of steel is 210 Pa, which is unusual for a solid: a bare number is in Pa, ",
        ),
        ({"E": 210e9, "density": 7850e3}, "The density of steel is 7.85e+06 kg/m^3, which is unusual for a solid"),
        (
            {"E": 210e9, "density": 7850, "yield": 235},
            "The yield stress of steel is 235 Pa, which is unusual for a solid",
        ),
    ],
)
def test_numbers_that_miss_their_unit_are_noticed(steel, reported):
    (finding,) = [one for one in findings(results_of(materials={"steel": steel})) if one.heading == "Inputs"]
    assert finding.text.startswith(reported)
    assert finding.level == "poor"


JACKED = """
[[drives]]
slider = "guide"
law = [{curve = "cycloidal", duration = "1 s", by = "20 mm"}]
cylinder = "jack"
[cylinders.jack]
bore = "40 mm"
pressure = "1 bar"
flow = "1 l/min"
[run]
positions = 9
"""


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ([('"1 l/min"', "6")], 'flow of the cylinder of "guide" is 6 m^3/s, which is unusual for a cylinder: a bare '
         'number is in m^3/s, write other units as in "6 l/min"'),
        ([('"1 bar"', "160")], 'pressure of the cylinder of "guide" is 160 Pa, which is unusual for a cylinder'),
        ([('"40 mm"', "40")], 'bore of the cylinder of "guide" is 40 m, which is unusual'),
        ([("positions = 9", "positions = 9\ngravity = [0, -9810]")], "Gravity is 9810 m/s^2, is that meant?"),
        ([], ""),
    ],
)  # fmt: skip
def test_slips_of_units_of_drives_are_asked_about(changes, reported, tmp_path, capsys):
    scene = tmp_path / "jack.toml"
    scene.write_text(edited(PUSHED.partition("[[drives]]")[0] + JACKED, *changes))
    main([str(scene), "-o", str(tmp_path / "out"), "--theory", "quasi-static"])
    asked = capsys.readouterr().err
    assert reported in asked if reported else not asked, asked


def test_solids_that_there_are_pass_unnoticed():
    rubber, osmium = {"E": 2e6, "density": 950}, {"E": 550e9, "density": 22590}
    for stuff in (rubber, osmium):
        assert not [one for one in findings(results_of(materials={"steel": stuff})) if one.heading == "Inputs"]
