"""First screen, one-sheet print and charts of the report page."""

import base64
import csv
import io
import json
import re
from itertools import combinations
from pathlib import Path

import pytest
from browser import Page
from scene_texts import PARALLELOGRAM

import kinelast
from kinelast.cli.command import main
from kinelast.outputs.pictures import draw_mechanism
from kinelast.runs import computed
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes

pytestmark = pytest.mark.slow  # seven reports, each printed

SCREENS = [(1366, 768), (390, 844)]
DECIDING_PARTS = ["#acceptance", "#trusted", "#stage", ".deciding .tile:last-child"]
BOXES = """
    return arguments[0].map((name) => document.querySelector(name).getBoundingClientRect())
        .map(({ left, top, right, bottom }) => [left, top, right, bottom]);"""
HEADS = "return Array.from(document.querySelectorAll('.deciding h3'), (head) => head.textContent)"
MANY_LIMITS = "pusher"
NAMES = ["steel_four_bar", MANY_LIMITS, "andrews_squeezer", "flap_plates", "bars", "buckled", "drs_push_up"]


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("screens")
    buckled = Path(__file__).parent / "data" / "cases" / "buckled_rod.toml"
    for name, text in {"bars": PARALLELOGRAM, "buckled": buckled.read_text().partition("[limits]")[0]}.items():
        (folder / f"{name}.toml").write_text(text)
    scenes = [name if name in shipped_scenes() else str(folder / f"{name}.toml") for name in NAMES]
    assert main([*scenes, "--print", "--quiet", "-o", str(folder)]) in (0, 1)
    return folder


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("size", SCREENS)
def test_the_verdict_is_visible_without_scrolling(name, size, driver, out):
    page = Page(driver, out / name / "report.html", size[0], folded=True, height=size[1])
    for left, top, right, bottom in page.run(BOXES, DECIDING_PARTS):
        assert 0 <= left < right <= size[0]
        assert 0 <= top < bottom <= size[1]
    if size[0] > 1000:
        assert page.run("return document.documentElement.scrollHeight") < 3000


def test_the_deciding_figures_are_in_order(driver, out):
    page = Page(driver, out / MANY_LIMITS / "report.html", folded=True)
    limits = json.loads((out / MANY_LIMITS / "summary.json").read_text())["acceptance"]["limits"]
    most = max(limits, key=lambda limit: limit["used"] or 0)
    heads = page.run(HEADS)
    assert heads == [
        f"Closest to its limit: {most['name']}",
        "Stress and safety",
        "Error of the output",
        "Drive of crank",
    ]
    assert f"{100 * most['used']:.1f} % used" in page.run("return document.querySelector('.deciding').textContent")


@pytest.mark.parametrize(
    ("name", "verdict", "trust", "first"),
    [
        ("steel_four_bar", "No limits are set.", "Use with caution: strength (crank: ", "Smallest reserve: crank"),
        ("drs_push_up", "Stress is 8.24 times", "Use with caution: buckling", "Smallest reserve: rod"),
        (
            "buckled",
            "Not acceptable: rod buckles, ",
            "Only figures of the rigid motion are shown.",
            "Smallest reserve: rod",
        ),
        (
            MANY_LIMITS,
            "Acceptable: transmission",
            "All figures are reliable except ",
            "Closest to its limit: transmission angle",
        ),
    ],
)
def test_verdict_and_reliability_do_not_contradict_each_other(name, verdict, trust, first, driver, out):
    page = Page(driver, out / name / "report.html", folded=True)
    said = page.run("return ['acceptance', 'trusted'].map((name) => document.getElementById(name).innerText)")
    assert said[0].startswith(verdict)
    assert said[1].startswith(trust)
    assert page.run(HEADS)[0] == first
    assert page.logs() == []


def test_a_buckling_mechanism_is_drawn_as_rigid_links(driver, out):
    page = Page(driver, out / "buckled" / "report.html", folded=True)
    lines = page.run(
        "return Array.from(document.querySelectorAll('.mechanism .link'), (each) => each.getAttribute('d'))"
    )
    assert len(lines) == 3
    assert lines.count("") == 1, "the piston is a point"
    with (out / "summary.csv").open() as file:
        (row,) = (row for row in csv.DictReader(file) if row["scene"] == "buckled")
    assert (row["verdict"], row["used [1]"]) == ("not acceptable", "")
    assert row["decides"].startswith("rod buckles, ")


def test_a_link_unfolds_its_section(driver, out):
    page = Page(driver, out / "steel_four_bar" / "report.html", folded=True)
    fold = "return document.querySelector('#curves > .fold').open"
    assert not page.run(fold)
    page.run("document.querySelector('nav a[href=\"#curves\"]').click()")
    assert page.run(fold)


@pytest.mark.parametrize("name", ["steel_four_bar", MANY_LIMITS, "flap_plates", "buckled"])
def test_page_and_print_file_are_one_sheet(name, driver, out):
    from pypdf import PdfReader

    page = Page(driver, out / name / "report.html", folded=True)
    printed, figures = page.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"], []
    for file in (io.BytesIO(base64.b64decode(printed)), out / name / "report.pdf"):
        pages = PdfReader(file).pages
        assert len(pages) == 1
        words = re.sub(r"\s+", " ", pages[0].extract_text())
        for heading in ("Assumptions", "Checked", "mm" if name == "buckled" else "displacements drawn"):
            assert heading in words
        assert "Why?" not in words  # a link is useless on paper
        assert re.search(r"\b(2|\d\d/\d\d/2)\d\d\d\b", words)  # the date
        if name == "steel_four_bar":
            assert "Use with caution: strength" in words
            assert "coupler" in words  # one text; a halo would be a second one
            figures.append(re.findall(r"[\d.]+(?:°| kN·m| N·m| mN·m) ± \S+ %", words)[:2])
        if name == MANY_LIMITS:
            assert "transmission angle" in words
            assert re.search(r"8[89]\.?\d* %", words)
    assert len(set(map(tuple, figures))) == (name == "steel_four_bar"), figures


def test_a_chart_draws_six_distinguishable_curves(driver, out):
    page = Page(driver, out / "flap_plates" / "report.html")
    shown = """
        return Array.from(document.querySelectorAll('#curves .chart'), (chart) => [
            Array.from(chart.querySelectorAll('.legend button[aria-pressed=true] line'),
                (line) => [line.getAttribute('stroke'), line.getAttribute('stroke-dasharray')]),
            chart.querySelectorAll('.legend button').length, chart.querySelector('.left-out')?.textContent ?? ""])"""
    charts = page.run(shown)
    assert any(count > 6 for _, count, _ in charts)
    for styles, count, left_out in charts:
        assert len(styles) == min(count, 6)
        for kind in zip(*styles, strict=True):
            assert len(set(kind)) == len(styles)
        assert (count > 6) == left_out.startswith(f"6 of {count} drawn")


CROSSED = """
    const names = [...document.querySelectorAll('.mechanism .names text')].filter((text) => text.getAttribute('display') !== 'none');
    const boxes = names.map((text) => text.getBBox());
    return [names.length, boxes.flatMap((box, k) => [...document.querySelectorAll('.mechanism .link[d]:not([d=""])')].filter((path) => {
        const long = path.getTotalLength();
        return Array.from({ length: 200 }, (_, n) => path.getPointAtLength((n * long) / 199)).some(({ x, y }) =>
            x > box.x + 2 && x < box.x + box.width - 2 && y > box.y + 4 && y < box.y + box.height - 4);
    }).map(() => names[k].textContent))]"""  # noqa: E501


HATCHED = """
    const texts = [...document.querySelectorAll('.mechanism .names text')].filter((text) => text.getAttribute('display') !== 'none');
    return texts.filter((text) => {
        const box = text.getBoundingClientRect();
        return [...document.querySelectorAll('.mechanism .paths + g path')].some((path) => {
            const long = path.getTotalLength(), onScreen = path.getScreenCTM();
            return Array.from({ length: 800 }, (_, n) => path.getPointAtLength((n * long) / 799).matrixTransform(onScreen))
                .some(({ x, y }) => x > box.left + 2 && x < box.right - 2 && y > box.top + 4 && y < box.bottom - 4);
        });
    }).map((text) => text.textContent)"""  # noqa: E501


@pytest.mark.parametrize("name", ["steel_four_bar", MANY_LIMITS])
def test_names_do_not_cover_supports_and_guides_on_a_phone(name, driver, out):
    page = Page(driver, out / name / "report.html", 390)
    assert page.run(HATCHED) == []


@pytest.mark.parametrize("name", ["steel_four_bar", MANY_LIMITS, "flap_plates"])
def test_names_do_not_cover_links(name, driver, out):
    page = Page(driver, out / name / "report.html")
    for position in range(0, 24, 5):
        page.run("kinelast.showPosition(arguments[0])", position)
        count, crossed = page.run(CROSSED)
        assert count > 3
        assert crossed == []


def test_the_index_shows_one_verdict_and_one_limit_per_scene(driver, out):
    page = Page(driver, out / "index.html")
    heads = page.run("return Array.from(document.querySelectorAll('thead th'), (head) => head.innerText.trim())")
    assert [head.split()[0] for head in heads[:4]] == ["scene", "verdict", "decides", "used"]
    row = page.run(
        "return Array.from([...document.querySelectorAll('tbody tr')]"
        f".find((row) => row.cells[0].innerText === '{MANY_LIMITS}').cells, (cell) => cell.innerText)"
    )
    assert row[1].startswith("acceptable")
    assert row[2].startswith("transmission angle")
    assert row[3].endswith(" %")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completions_list_all_options(shell, capsys):
    assert main(["--completion", shell]) == 0
    output = capsys.readouterr().out
    for word in ("theory", "geometrically-exact", "print", "kinelast", *shipped_scenes()):
        assert word in output


@pytest.mark.parametrize("width", [360, 1100, 1280])
def test_figures_do_not_overlap_the_picture(width, driver, out):
    page = Page(driver, out / "steel_four_bar" / "report.html", width, folded=True)
    wide = "return Array.from(document.querySelectorAll('.tiles'), (each) => each.scrollWidth - each.clientWidth)"
    assert page.run(wide) == [0, 0]


THIN = """
    const names = [...document.querySelectorAll('.mechanism .names text')].filter((text) => text.getAttribute('display') !== 'none');
    return names.filter((text) => {
        const box = text.getBoundingClientRect();
        return [...document.querySelectorAll('.mechanism .rigid path, .mechanism .mark')].some((path) => {
            const long = path.getTotalLength(), onScreen = path.getScreenCTM(), around = path.getBoundingClientRect();
            const apart = around.right < box.left || around.left > box.right || around.bottom < box.top || around.top > box.bottom;
            return long && !apart && Array.from({ length: 200 }, (_, n) => path.getPointAtLength((n * long) / 199).matrixTransform(onScreen))
                .some(({ x, y }) => x > box.left + 2 && x < box.right - 2 && y > box.top + 4 && y < box.bottom - 4);
        });
    }).map((text) => text.textContent)"""  # noqa: E501


@pytest.mark.parametrize("width", [390, 1366])
@pytest.mark.parametrize("name", ["steel_four_bar", "flap_plates"])
def test_names_cover_no_link_and_rarely_a_thin_line(name, width, driver, out):
    page = Page(driver, out / name / "report.html", width)
    shown, links, thin = 0, [], []
    count = page.run("return kinelast.row('drive').length")
    for position in range(0, count, count // 8):
        page.run("kinelast.showPosition(arguments[0])", position)
        names, crossed = page.run(CROSSED)
        shown, links, thin = shown + names, links + crossed, thin + page.run(THIN)
    assert shown >= 50
    assert links == []
    assert len(thin) <= 0.02 * shown


@pytest.mark.parametrize("name", ["pusher", "quick_return"])
def test_names_of_links_on_paper_lie_on_no_link(name):
    from matplotlib.figure import Figure

    scene = kinelast.load(name)
    axes = Figure(figsize=(7.0, 4.0)).add_axes((0, 0, 1, 1))
    draw_mechanism(computed(scene, Request()), axes, 7 + 4j)
    links = [line.get_path().transformed(line.get_transform()) for line in axes.lines if line.get_zorder() == 3]
    named = [text for text in axes.texts if text.get_text() in {link.name for link in scene.mechanism.links}]
    assert len(named) > 2
    for text in named:
        box = text.get_window_extent()
        assert not any(link.intersects_bbox(box, filled=False) for link in links), text.get_text()


@pytest.mark.parametrize("name", ["flapping_wing", "excavator_arm"])
def test_names_on_paper_lie_on_no_name_link_or_symbol(name):
    from matplotlib.figure import Figure

    axes = Figure(figsize=(7.0, 4.0)).add_axes((0, 0, 1, 1))
    scene = name if name in shipped_scenes() else Path(__file__).parents[1] / "docs" / "gallery" / f"{name}.toml"
    draw_mechanism(computed(kinelast.load(scene), Request()), axes, 7 + 4j)
    boxes = [text.get_window_extent() for text in axes.texts]
    drawn = [each.get_path().transformed(each.get_transform()) for each in (*axes.lines, *axes.patches)]
    assert len(boxes) > 20
    assert [(one, other) for one, other in combinations(boxes, 2) if one.overlaps(other)] == []
    assert [box for box in boxes if any(path.intersects_bbox(box, filled=False) for path in drawn)] == []
