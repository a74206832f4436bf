"""The pages in use: playing, dragging, printing, long names, narrow screens and missing figures."""

import base64
import io
import json
import re

import numpy as np
import pytest
from browser import Page, accessibility_faults
from scene_texts import PARALLELOGRAM

from kinelast.cli.command import main
from kinelast.tasks.task import shipped_scenes
from kinelast.values.numbers import number

STEEL = shipped_scenes()["steel_four_bar"].read_text().replace("accuracy", "# accuracy")
SHOW = "document.getElementById('stage').scrollIntoView({behavior: 'instant', block: 'center'});"


def written(folder, text, *options):
    (folder / "one.toml").write_text(text)
    assert main([str(folder / "one.toml"), *options, "--quiet", "-o", str(folder / "out")]) in (0, 1)
    return folder / "out" / "one" / "report.html"


@pytest.fixture(scope="module")
def steel(tmp_path_factory):
    return written(tmp_path_factory.mktemp("steel"), STEEL, "--positions", "72")


def errors(page):
    return [entry["message"] for entry in page.logs()]


def place_on(page, beam, part=0.7):
    """Return the screen position of a fraction of the length of a link."""
    return page.run(
        "const path = document.querySelectorAll('.mechanism .link')[arguments[0]], "
        "at = path.getPointAtLength(path.getTotalLength() * arguments[1]), "
        "box = document.querySelector('.mechanism').getBoundingClientRect(); "
        "return [Math.round(box.left + at.x), Math.round(box.top + at.y)]",
        beam,
        part,
    )


def hover(page, x, y):
    from selenium.webdriver import ActionChains

    action = ActionChains(page.driver, duration=10)
    action.w3c_actions.pointer_action.move_to_location(x, y)
    action.perform()


def test_the_picture_is_seen_at_once_and_hears_the_keys(driver, steel):
    """The picture is next to the figures or after the verdict, and keys move it without a click."""
    from selenium.webdriver.common.keys import Keys

    for width, above in ((390, 760), (1280, 460)):
        page = Page(driver, steel, width)
        assert page.run("return document.getElementById('stage').getBoundingClientRect().top") < above
    assert re.search(
        r"displacements drawn . 10\b", page.run("return document.querySelector('.mechanism .scale').textContent")
    )
    page.run("kinelast.showPosition(10)")
    driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert page.run("return kinelast.instant.position") == 12
    driver.switch_to.active_element.send_keys(Keys.SPACE)
    assert page.run("return document.getElementById('play').getAttribute('aria-pressed')") == "true"
    assert errors(page) == []


@pytest.mark.parametrize(
    "choice", ["document.querySelector('.tile .go')", "document.querySelector('#maps .map')", "the link"]
)
def test_whoever_chooses_an_instant_stops_the_play(choice, driver, steel):
    page = Page(driver, steel)
    page.run(f"{SHOW} document.getElementById('play').click()")
    assert page.run("return document.getElementById('instant').getAttribute('aria-live')") == "off"
    if choice == "the link":
        hover(page, *place_on(page, 2))  # the rocker hardly moves at its pin
        page.run(
            "const stage = document.querySelector('.mechanism'), { left, top } = stage.getBoundingClientRect(); "
            "const [x, y] = [0.05].map((part) => document.querySelectorAll('.mechanism .link')[2].getPointAtLength(9))"
            ".map((at) => [left + at.x, top + at.y])[0]; "
            "const press = { clientX: x, clientY: y, pointerId: 1, bubbles: true }; "
            "stage.setPointerCapture = () => {}; "
            "stage.dispatchEvent(new PointerEvent('pointerdown', press)); "
            "stage.dispatchEvent(new PointerEvent('pointerup', press));"
        )
    else:
        page.run(f"{choice}.click()")
    assert page.run("return kinelast.instant.playing") is None
    button = "const { textContent, ariaPressed } = document.getElementById('play'); return [textContent, ariaPressed]"
    assert page.run(button) == ["Play", "false"]
    assert page.run("return document.getElementById('instant').getAttribute('aria-live')") == "polite"
    assert errors(page) == []


def test_the_arrow_keys_step_from_the_play_button(driver, steel):
    from selenium.webdriver.common.keys import Keys

    page = Page(driver, steel)
    page.run("kinelast.showPosition(5); document.getElementById('play').focus()")
    driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    assert page.run("return kinelast.instant.position") == 6


def test_the_hover_text_is_of_this_instant_and_not_cut_off(driver, steel):
    page = Page(driver, steel)
    page.run(
        f"{SHOW} kinelast.showPosition(0); "
        "document.querySelectorAll('.diagrams input').forEach((box) => box.checked || box.click())"
    )
    hover(page, *place_on(page, 0))
    inside = (
        "const [tip, stage] = ['.tip', '.stage'].map((name) => document.querySelector(name).getBoundingClientRect()); "
        "return !document.querySelector('.tip').hidden && tip.height > 200 && tip.bottom <= stage.bottom + 1 && "
        "tip.top >= stage.top - 1"
    )
    assert page.run(inside)
    reported = "return document.querySelector('.tip').innerText"
    hover(page, *place_on(page, 2, 0.03))  # near the ground pin, where the rocker stays under the pointer
    first = page.run(reported)
    page.run("kinelast.showPosition(1)")
    assert page.run(reported) != first
    assert page.run(reported).startswith("rocker")


def test_a_finger_drags_the_crank_and_not_the_page(driver, steel):
    page = Page(driver, steel, 400)
    page.run(f"{SHOW} kinelast.showPosition(0)")
    before = page.run("return scrollY")
    x, y = place_on(page, 0, 0.95)
    driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        for step in range(12):
            kind = "touchMove" if step else "touchStart"
            point = {"x": x, "y": y - 4 * step}
            driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
        driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    finally:
        driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
    assert page.run("return scrollY") == before
    assert page.run("return kinelast.row('drive')[kinelast.instant.position]") > 0.5


OVERLAPS = """
    const boxes = Array.from(document.querySelectorAll('.mechanism .names text'))
        .filter((text) => getComputedStyle(text).display !== 'none').map((text) => text.getBBox());
    const over = boxes.flatMap((one, k) => boxes.slice(k + 1).filter((two) => one.x < two.x + two.width &&
        two.x < one.x + one.width && one.y + 3 < two.y + two.height - 3 && two.y + 3 < one.y + one.height - 3));
    return [boxes.length, over.length];"""


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 1280])
def test_names_do_not_lie_on_one_another(width, driver, tmp_path):
    text = shipped_scenes()["flapping_wing"].read_text()
    page = Page(driver, written(tmp_path, text, "--positions", "12", "--theory", "quasi-static"), width)
    for position in range(12):
        page.run("kinelast.showPosition(arguments[0])", position)
        shown, over = page.run(OVERLAPS)
        assert shown > 5
        assert over == 0


ECCENTRIC = """
title = "a crank of 3 % of the rod"
units = "mm"
points = {O = [0, 0], A = [6, 0], B = [200, 0]}
drives = [{link = "shaft", speed = "300 rpm"}]
[sections.bar]
shape = "rectangle"
depth = "8 mm"
width = "20 mm"
[links]
ground.points = ["O"]
shaft = {points = ["O", "A"], section = "bar", material = "S235"}
rod = {points = ["A", "B"], section = "bar", material = "S235"}
ram = {points = ["B"], mass = "1 kg"}
[sliders.guide]
link = "ram"
through = "B"
direction = [1, 0]
"""
ON_LINKS = """
    const texts = [...document.querySelectorAll('.mechanism .names text')].filter((text) => text.getAttribute('display') !== 'none');
    return [texts.length, texts.filter((text) => {
        const box = text.getBoundingClientRect();
        return [...document.querySelectorAll('.mechanism .link[d]:not([d=""])')].some((path) => {
            const long = path.getTotalLength(), onScreen = path.getScreenCTM();
            return Array.from({ length: 200 }, (_, n) => path.getPointAtLength((n * long) / 199).matrixTransform(onScreen))
                .some(({ x, y }) => x > box.left - 1 && x < box.right + 1 && y > box.top + 2 && y < box.bottom - 2);
        });
    }).map((text) => text.textContent)];"""  # noqa: E501


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 1366])
def test_names_at_a_very_short_crank_touch_no_link(width, driver, tmp_path):
    page = Page(driver, written(tmp_path, ECCENTRIC, "--positions", "60", "--theory", "quasi-static"), width)
    for position in range(60):
        page.run("kinelast.showPosition(arguments[0])", position)
        count, touching = page.run(ON_LINKS)
        assert count >= 4
        assert touching == []


LINK, POINT = "a_very_long_name_" * 12, "P" * 200


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 1280])
def test_names_of_200_letters_fit(width, driver, tmp_path):
    text = STEEL.replace("[links.coupler]", f"[links.{LINK}]").replace("\nB = ", f"\n{POINT} = ")
    text = text.replace('"B"', f'"{POINT}"') + "\n[limits]\nchord = '1 um'\n"
    page = Page(driver, written(tmp_path, text, "--positions", "12"), width)
    assert LINK in page.run("return document.getElementById('acceptance').innerText.replace(/\\s/g, '')")
    assert page.run("return document.documentElement.scrollWidth <= window.innerWidth")
    wide = (
        "return Array.from(document.querySelectorAll('.tile, .chart, .shares li, .bar > *, .verdict p, .maplabel'), "
        "(each) => each.scrollWidth > each.clientWidth + 1 && getComputedStyle(each).overflowX === 'visible' "
        "&& each.clientWidth > 0 ? each.className + each.tagName : '').filter(Boolean)"
    )
    assert page.run(wide) == []
    assert errors(page) == []


def test_tables_fit_a_usual_screen(driver, steel):
    page = Page(driver, steel, 1280)
    fits = "return Array.from(document.querySelectorAll('.wide'), (each) => each.scrollWidth <= each.clientWidth)"
    assert all(page.run(fits))


@pytest.mark.slow
def test_a_run_that_is_singular_throughout_says_so(driver, tmp_path):
    page = Page(driver, written(tmp_path, PARALLELOGRAM, "--positions", "2"))
    text = page.run("return document.body.innerText")
    assert "No stresses: all positions are singular." in text
    assert "the sections have no dimensions" not in text
    assert page.run("return document.querySelectorAll('.tile .go').length") == 0
    assert errors(page) == []


def paper(driver):
    """Return the texts of the printed pages."""
    pypdf = pytest.importorskip("pypdf", reason="pypdf is not installed")
    printed = driver.execute_cdp_cmd("Page.printToPDF", {"paperWidth": 8.27, "paperHeight": 11.69})
    return [page.extract_text() for page in pypdf.PdfReader(io.BytesIO(base64.b64decode(printed["data"]))).pages]


@pytest.mark.slow
def test_a_printed_picture_states_its_content(driver, tmp_path):
    text = shipped_scenes()["flap_bars"].read_text()
    page = Page(driver, written(tmp_path, text, "--positions", "24", "--theory", "quasi-static"))
    page.run("kinelast.showPosition(0)")
    assert "displacements drawn \u00d7 " in "\n".join(paper(driver))  # deflected, with its scale
    page.run("document.getElementById('exaggeration').parentNode.querySelectorAll('button')[2].click()")
    page.run("document.querySelector('.f-M input').click()")
    pages = paper(driver)
    whole = "\n".join(pages)
    assert page.run("return document.getElementById('instant').textContent") + "; bending moment" in whole
    assert "displacements drawn \u00d7 20 " in whole
    for words in ("SVG of this instant", "Play", "Drag the slider", "Hover for values"):
        assert words not in whole
    # A table repeats its headings on every page.
    rows = [k for k, words in enumerate(pages) if "slenderness" in words.lower()]
    assert len(rows) >= 1
    for words in pages:
        lines = [line for line in words.splitlines() if line.strip()]
        assert not re.match(r"bar_\d+(\s+\S+){6}", lines[0]), words[:400]  # a legend continues without headings


def test_the_table_of_a_batch_is_dark_by_a_button_and_light_on_paper(driver, tmp_path):
    (tmp_path / "wrong.toml").write_text('title = "no points"\n')
    given = ["steel_four_bar", "lightest_arm", "utenov_four_bar", str(tmp_path / "wrong.toml"), "--positions", "12"]
    assert main([*given, "--theory", "quasi-static", "--quiet", "-o", str(tmp_path / "out")]) == 2
    page = Page(driver, tmp_path / "out" / "index.html", 1280, {"prefers-color-scheme": "dark"})
    theme = "return document.documentElement.dataset.theme"
    assert page.run(theme) == "dark"
    page.run("dispatchEvent(new Event('beforeprint'))")
    assert page.run(theme) == "light"
    page.run("dispatchEvent(new Event('afterprint'))")
    assert page.run(theme) == "dark"
    page.run("document.getElementById('theme').click()")
    assert page.run(theme) == "light"
    heads = page.run("return Array.from(document.querySelectorAll('thead th'), (head) => head.innerText.trim())")
    assert [head.split()[0] for head in heads[:4]] == ["scene", "verdict", "decides", "used"]
    assert len(set(heads)) == len(heads)
    at = next(k for k, head in enumerate(heads) if head.endswith("angle"))
    cell = "return document.querySelectorAll('tbody tr')[1].cells[arguments[0]].innerText"
    angle = json.loads((tmp_path / "out" / "steel_four_bar" / "summary.json").read_text())["output"]["value"]
    assert page.run(cell, at) == f"{number(np.degrees(angle))}°"  # like the first line of the scene's page
    failed = page.run(
        "return Array.from(document.querySelector('tbody .worst').cells, (cell) => [cell.colSpan, cell.innerText])"
    )
    assert sum(span for span, _ in failed) == len(heads)
    assert "[points]" in failed[2][1]
    assert accessibility_faults(page) == []
    assert errors(page) == []


def test_a_batch_without_any_result_is_reported(driver, tmp_path):
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text('title = "no points"\n')
    assert main([str(tmp_path / "one.toml"), str(tmp_path / "two.toml"), "-o", str(tmp_path / "out")]) == 2
    page = Page(driver, tmp_path / "out" / "index.html")
    cells = page.run("return Array.from(document.querySelectorAll('tbody tr'), (row) => row.innerText.split('\\t'))")
    for name, row in zip(("one", "two"), cells, strict=True):
        assert row[:2] == [name, "failed"]
        assert row[2].startswith(str(tmp_path / name))  # names the scene once
        assert "[points]" in row[2]
    assert errors(page) == []


@pytest.mark.slow
def test_a_rigid_link_is_taken_beside_its_line(driver, tmp_path):
    from selenium.webdriver import ActionChains

    page = Page(driver, written(tmp_path, shipped_scenes()["andrews_driven"].read_text(), "--positions", "36"))
    page.run(f"{SHOW} kinelast.showPosition(0)")
    x, y = place_on(page, 0, 0.2)
    action = ActionChains(driver, duration=5)
    action.w3c_actions.pointer_action.move_to_location(x, y + 6)
    action.w3c_actions.pointer_action.pointer_down()
    for step in (20, 40):
        action.w3c_actions.pointer_action.move_to_location(x - step, y - step)
    action.w3c_actions.pointer_action.pointer_up()
    action.perform()
    assert page.run("return kinelast.instant.position") > 5
    assert errors(page) == []


def test_a_saved_curve_states_its_content(driver, tmp_path):
    """The SVG has heading, names and ticks; angles are within a turn, from 90 degrees."""
    text = shipped_scenes()["quick_return"].read_text()
    page = Page(driver, written(tmp_path, text, "--positions", "36", "--theory", "quasi-static"))
    script = """
        const done = arguments[arguments.length - 1], kind = arguments[0], make = URL.createObjectURL;
        const drawn = document.querySelectorAll('#curves .chart')[1];
        URL.createObjectURL = (blob) => { URL.createObjectURL = make;
            if (kind === 'SVG') blob.text().then(done);
            else createImageBitmap(blob).then((picture) => done(picture.height - drawn.querySelector('canvas').height));
            return make.call(URL, blob); };
        drawn.querySelector(`button[aria-label$="as ${kind}"]`).click();"""
    heading = "Largest chord deflection along each link"
    svg = driver.execute_async_script(script, "SVG")
    for words in (heading, "rocker", ">135<", ">45<", ">0<"):
        assert words in svg
    assert ">405<" not in svg
    assert driver.execute_async_script(script, "PNG") >= 40
    assert errors(page) == []


@pytest.mark.slow
def test_the_line_of_the_instant_stays_in_a_zoomed_chart(driver, steel):
    """A third of the run is a tenth of the way into its middle half; the zoom survives a change of colours."""
    from selenium.webdriver import ActionChains

    page = Page(driver, steel)
    page.run(
        "kinelast.showPosition(Math.round(0.3 * 71)); "
        "document.querySelectorAll('#curves .chart')[1].scrollIntoView({block: 'center', behavior: 'instant'})"
    )
    left, top, width = page.run(
        "const box = document.querySelectorAll('#curves .u-over')[1].getBoundingClientRect(); "
        "return [box.left, box.top + box.height / 2, box.width]"
    )
    action = ActionChains(driver, duration=20)
    action.w3c_actions.pointer_action.move_to_location(round(left + 0.25 * width), round(top))
    action.w3c_actions.pointer_action.pointer_down()
    for part in (0.5, 0.75):
        action.w3c_actions.pointer_action.move_to_location(round(left + part * width), round(top))
    action.w3c_actions.pointer_action.pointer_up()
    action.perform()
    part = (
        "const over = document.querySelectorAll('#curves .u-over')[1].getBoundingClientRect(), "
        "line = document.querySelectorAll('#curves .u-over .now')[1].getBoundingClientRect(); "
        "return line.width || line.height ? (line.left - over.left) / over.width : null"
    )
    settle = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))"
    driver.execute_async_script(settle)
    assert page.run(part) == pytest.approx(0.1, abs=0.02)
    page.run("document.getElementById('theme').click()")
    driver.execute_async_script(settle)
    assert page.run(part) == pytest.approx(0.1, abs=0.02)
    page.run("kinelast.showPosition(Math.round(0.9 * 71))")
    assert page.run(part) is None
    assert errors(page) == []
