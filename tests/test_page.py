"""The report page in a browser: self-contained, interactive, exact, and without execution of data."""

import csv
import json
import re
import time
from pathlib import Path

import numpy as np
import pytest
from browser import Page, accessibility_faults
from scene_texts import ARM as TURNING_ARM
from scene_texts import CRANK_ROCKER, PUSHED, edited
from test_machine_drives import PUSHED as MOTORED
from tiers import in_tiers

from elastic import FIELDS, Field, FieldKind, coefficients, displacement_of, sample
from kinelast.cli.command import main
from kinelast.outputs.page import data
from kinelast.runs import computed
from kinelast.scene.document import read_scene
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes
from kinelast.values.numbers import number, quantity
from rigid import acceleration_of, position_of, velocity_of

STATIONS = np.array([0.0, 0.21, 0.5, 0.77, 1.0])
EXACT = 1e-12
TYPICAL = "steel_four_bar", "quick_return", "pusher", "andrews_driven", "flapping_wing"
SHIPPED = [*TYPICAL, *sorted(shipped_scenes().keys() - {*TYPICAL})]


class Reports(dict):
    """Folders of shipped scenes by name, with their own positions, written at first use."""

    def __init__(self, out):
        super().__init__()
        self.out = out

    def __missing__(self, name):
        assert main([name, "--quiet", "-o", str(self.out)]) == 0
        self[name] = self.out / name
        return self[name]


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    return Reports(tmp_path_factory.mktemp("pages"))


@pytest.fixture(scope="module")
def steel(driver, reports):
    return Page(driver, reports["steel_four_bar"] / "report.html")


def errors(page):
    return [entry["message"] for entry in page.logs()]


@pytest.mark.parametrize("name", in_tiers(SHIPPED, 0, 5))
def test_it_stands_alone_and_is_exact(name, driver, reports):
    """No error and no request; every field and the motion of every point agree with Python at all positions."""
    page = Page(driver, reports[name] / "report.html")
    assert page.run("return document.body.dataset.ready") == "yes"
    assert errors(page) == []
    assert page.requests() == []
    results = computed(read_scene(shipped_scenes()[name]), Request())
    times = np.array(page.run("return Array.from(kinelast.row('time'))"))
    at = np.searchsorted(results.motion.time, times)
    np.testing.assert_array_equal(results.motion.time[at], times)
    beams = len(results.scene.labels)
    for field in FIELDS if beams else ():
        close(page_field(page, field, beams, len(times)), sample(results.deflection, field, STATIONS)[:, at])
    moving = [(k, link.name, point) for k, link in enumerate(results.mechanism.links) if k for point in link.points]
    for function, python in MOTION.items():
        ours = [np.broadcast_to(python(results, link, point), results.motion.columns)[at] for _, link, point in moving]
        theirs = [page.run(OF_POINT.replace("FUNCTION", function), len(times), k, point) for k, _, point in moving]
        close(np.array(theirs, float) @ [1, 1j], np.array(ours))


MOTION = {
    "placeOf": lambda results, link, point: position_of(results.motion, link, point),
    "velocityOf": lambda results, link, point: velocity_of(results.motion, link, point),
    "accelerationOf": lambda results, link, point: acceleration_of(results.motion, link, point),
    "displacementOf": lambda results, link, point: displacement_of(results.deflection, link, point),
}
OF_POINT = """
    const [count, link, point] = arguments, place = "FUNCTION" === "displacementOf" ? point :
        kinelast.localOf(link, point);
    return Array.from({length: count}, (_, i) => kinelast.FUNCTION(link, place, i));"""


def page_field(page, field, beams, count):
    """Return values in the page, shape (beams, positions, stations)."""
    script = """
        const [field, stations, beams, count] = arguments, found = [];
        for (let beam = 0; beam < beams; beam++) for (let i = 0; i < count; i++) for (const xi of stations) {
            const value = kinelast.value(field, beam, i, xi);
            found.push(isFinite(value) ? value : null);
        }
        return found;"""
    found = page.run(script, field, STATIONS.tolist(), beams, count)
    return np.array(found, float).reshape(beams, count, len(STATIONS))


def close(found, ours):
    """Assert agreement to 1e-12 of the maximum, with nan at the same places."""
    np.testing.assert_array_equal(np.isnan(found), np.isnan(ours))
    scale = np.nanmax(np.abs(ours), initial=0.0) if np.isfinite(ours).any() else 0.0
    assert np.nanmax(np.abs(found - ours), initial=0.0) <= EXACT * scale


def test_a_field_that_the_script_has_no_formula_for_is_stored(monkeypatch):
    """A new entry of the registry needs no code in the page."""
    results = computed(read_scene(shipped_scenes()["steel_four_bar"]), Request(positions=3, theory="elastodynamic"))
    fields = {**FIELDS, "work": Field("work", "U'", "bending work", "J/m", FieldKind.FORCE)}
    monkeypatch.setattr(data, "FIELDS", fields)
    monkeypatch.setattr(
        data, "coefficients", lambda bent, field: field if field == "work" else coefficients(bent, field)
    )
    assert set(data.field_coefficients(results)) == {"N", "V", "M", "u", "w", "phi", "work"}


def test_the_figures_are_those_of_the_summary(steel, reports):
    summary = json.loads((reports["steel_four_bar"] / "summary.json").read_text())
    text = steel.run("return document.body.innerText")
    for key in ("largest_chord", "largest_deflection", "largest_stress"):
        assert quantity(abs(summary[key]["value"]), summary[key]["unit"]) in text
    for finding in summary["trust"]:
        assert finding["text"] in text
    for label, row in summary["strength"].items():
        cells = steel.run(
            "return Array.from(document.querySelectorAll('#strength tbody tr'), "
            "(row) => Array.from(row.cells, (cell) => cell.innerText))"
        )
        own = next(cells for cells in cells if cells[0].startswith(label))
        assert own[1] == number(row["safety_factor"]["value"], 3)
    for share in summary["output"]["shares"]:
        assert number(100 * share["value"] / summary["output"]["value"], 3) in text


@pytest.mark.parametrize(
    "value",
    [
        0.0,
        1.0,
        -13.126,
        0.00115849,
        2.2e-6,
        99.7,
        999.96,
        9999.7,
        9999999.7,
        12345.0,
        12.6e6,
        1e7,
        3.2e-15,
        0.0001,
        5e-324,
    ],
)
def test_numbers_are_written_as_python_writes_them(value, steel):
    assert steel.run("return [4, 3, 2].map((digits) => kinelast.number(arguments[0], digits))", value) == [
        number(value, digits) for digits in (4, 3, 2)
    ]
    assert steel.run("return ['m', 'N', '1'].map((unit) => kinelast.quantity(arguments[0], unit))", value) == [
        quantity(value, unit) for unit in ("m", "N", "1")
    ]
    raised = str.maketrans("234", "²³⁴")
    assert steel.run("return ['m^2', 'm^4', 'm^3/s'].map((u) => kinelast.quantity(arguments[0], u, 2))", value) == [
        re.sub(r"\^(\d)", lambda power: power[1].translate(raised), quantity(value, unit, 2))
        for unit in ("m^2", "m^4", "m^3/s")
    ]


def lines(page):
    return page.run(
        "return Array.from(document.querySelectorAll('.mechanism .link'), (path) => path.getAttribute('d'))"
    )


def test_the_slider_the_keys_and_play_move_the_picture(steel):
    steel.run("kinelast.showPosition(0)")
    first = lines(steel)
    steel.run(
        "const slider = document.getElementById('position'); slider.value = 90; "
        "slider.dispatchEvent(new Event('input'))"
    )
    assert lines(steel) != first
    assert "crank 90°" in steel.run("return document.getElementById('instant').innerText")
    steel.run(
        "document.querySelector('.mechanism').dispatchEvent(new KeyboardEvent('keydown', "
        "{key: 'ArrowRight', bubbles: true}))"
    )
    assert steel.run("return kinelast.instant.position") == 91
    steel.run("document.getElementById('play').click()")
    deadline = time.monotonic() + 5
    while steel.run("return kinelast.instant.position") == 91 and time.monotonic() < deadline:
        time.sleep(0.05)
    steel.run("document.getElementById('play').click()")
    assert steel.run("return kinelast.instant.position") != 91
    assert errors(steel) == []


def test_the_crank_is_dragged(steel):
    """Grab the end of the crank and rotate it by a quarter turn in steps."""
    from selenium.webdriver import ActionChains

    steel.run(
        "kinelast.showPosition(0); "
        "document.getElementById('exaggeration').parentNode.querySelectorAll('button')[1].click()"
    )
    steel.run("document.getElementById('stage').scrollIntoView({behavior: 'instant'})")
    assert steel.run("return document.querySelector('.tip').hidden")
    spot = """
        const [k] = arguments, pins = document.querySelectorAll('.mechanism .pin'),
            box = document.querySelector('.mechanism').getBoundingClientRect();
        const { e: x, f: y } = pins[k].transform.baseVal[0].matrix;
        return [Math.round(box.left + x), Math.round(box.top + y)]"""
    names = steel.run("return Array.from(document.querySelectorAll('.mechanism .pin')).length")
    places = [steel.run(spot, k) for k in range(names)]
    centre = steel.run("const [x, y] = kinelast.placeOf(0, kinelast.localOf(0, 'O'), 0); return [x, y]")
    assert centre == [0.0, 0.0]
    pivot = places[0]
    end = min(places[1:], key=lambda place: np.hypot(place[0] - pivot[0], place[1] - pivot[1]))
    reach = np.hypot(end[0] - pivot[0], end[1] - pivot[1])
    action = ActionChains(steel.driver, duration=20)
    near = 0.8
    action.w3c_actions.pointer_action.move_to_location(
        round(pivot[0] + near * (end[0] - pivot[0])), round(pivot[1] + near * (end[1] - pivot[1]))
    )
    action.w3c_actions.pointer_action.pointer_down()
    for angle in np.radians(np.linspace(10, 90, 9)):
        action.w3c_actions.pointer_action.move_to_location(
            round(pivot[0] + near * reach * np.cos(angle)), round(pivot[1] - near * reach * np.sin(angle))
        )
    action.w3c_actions.pointer_action.pointer_up()
    action.perform()
    degrees = np.degrees(steel.run("return kinelast.row('drive')[kinelast.instant.position]"))
    assert degrees == pytest.approx(90, abs=5)
    steel.run("document.getElementById('exaggeration').parentNode.querySelectorAll('button')[2].click()")


def test_hovering_tells_values_and_a_click_chooses_the_link(steel):
    from selenium.webdriver import ActionChains

    steel.run("kinelast.showPosition(100); document.getElementById('stage').scrollIntoView({behavior: 'instant'})")
    x, y = steel.run(
        "const path = document.querySelectorAll('.mechanism .link')[1], "
        "at = path.getPointAtLength(path.getTotalLength() / 2), "
        "box = document.querySelector('.mechanism').getBoundingClientRect(); "
        "return [Math.round(box.left + at.x), Math.round(box.top + at.y)]"
    )
    action = ActionChains(steel.driver, duration=20)
    action.w3c_actions.pointer_action.move_to_location(x, y)
    action.perform()
    assert not steel.run("return document.querySelector('.tip').hidden")
    reported = steel.run("return document.querySelector('.tip').innerText")
    assert reported.startswith("coupler 150 mm along it") or re.match(
        r"coupler 1(49|50|51)(\.\d)? mm along it", reported
    )
    assert "bending moment" in reported
    steel.run("document.getElementById('beam').value = 0")
    action.w3c_actions.pointer_action.click()
    action.perform()
    assert steel.run("return document.getElementById('beam').value") == "1"
    assert "coupler: bending moment along it" in steel.run("return document.getElementById('link').innerText")


def test_diagrams_overlay_and_tables_sort(steel):
    before = steel.run("return document.querySelectorAll('.mechanism .diagram').length")
    steel.run("document.querySelector('.diagrams input[value=\"N\"]').click()")
    assert steel.run("return document.querySelectorAll('.mechanism .diagram').length") == before + 3
    steel.run("document.querySelector('.diagrams input[value=\"N\"]').click()")
    names = (
        "return Array.from(document.querySelectorAll('#forces table')[0].tBodies[0].rows, "
        "(row) => Number(row.cells[2].innerText))"
    )
    steel.run("document.querySelectorAll('#forces thead button')[2].click()")
    assert steel.run(names) == sorted(steel.run(names), reverse=True)
    steel.run("document.querySelectorAll('#forces thead button')[2].click()")
    assert steel.run(names) == sorted(steel.run(names))
    assert steel.run("return document.querySelectorAll('#forces thead th')[2].getAttribute('aria-sort')") == "ascending"


def test_curves_are_handed_out(steel):
    """The CSV of a curve has all digits of Python, and PNG and SVG are not empty."""
    script = """
        const done = arguments[arguments.length - 1], kind = arguments[0], blobs = [], make = URL.createObjectURL;
        URL.createObjectURL = (blob) => { blobs.push(blob); return make.call(URL, blob); };
        document.querySelector(`button[aria-label="Drive moment as ${kind}"]`).click();
        const wait = () => blobs.length ? blobs[0].text().then((text) => { URL.createObjectURL = make;
            done([blobs[0].type, blobs[0].size, text]); }) : setTimeout(wait, 20);
        wait();"""
    kind, _, text = steel.driver.execute_async_script(script, "CSV")
    rows = text.strip().splitlines()
    assert kind == "text/csv"
    assert rows[0] == '"angle of crank [°]","crank [N m]"'
    results = computed(read_scene(shipped_scenes()["steel_four_bar"]), Request())
    np.testing.assert_array_equal([float(row.split(",")[1]) for row in rows[1:]], results.cycle.efforts[0])
    kind, size, text = steel.driver.execute_async_script(script, "SVG")
    assert kind == "image/svg+xml"
    assert text.startswith("<svg")
    assert text.count("<path") == 2
    kind, size, _ = steel.driver.execute_async_script(script, "PNG")
    assert kind == "image/png"
    assert size > 2000


ODD = edited(
    TURNING_ARM,
    (
        'title = "A turning arm"',
        "title = '</script><script>window.hit = 1</script> & <b>bold</b> {{title}}'\n"
        "source = '<img src=x onerror=\"window.hit = 1\">'",
    ),
    ("[links.arm]", "[links.arm]  # </script><script>window.hit = 1</script>"),
    ("speed = 50.0", "speed = -50.0"),
    ("positions = 8", "positions = 12"),
)


def test_words_of_a_scene_are_data(driver, tmp_path):
    (tmp_path / "odd.toml").write_text(ODD)
    assert main([str(tmp_path / "odd.toml"), "--quiet", "-o", str(tmp_path / "out")]) == 0
    page = Page(driver, tmp_path / "out" / "odd" / "report.html")
    title = "</script><script>window.hit = 1</script> & <b>bold</b> {{title}}"
    assert page.run("return document.querySelector('h1').textContent") == title
    assert page.run("return document.title") == title
    assert page.run("return document.querySelectorAll('h1 *, .source *').length") == 0
    assert page.run("return document.querySelector('pre').textContent") == ODD
    answer = page.run("return document.querySelector('.front').innerText")
    assert 'add the yield stress, yield = "… MPa", under [materials.steel]' in answer
    assert page.run("return window.hit ?? 'none'") == "none"
    assert errors(page) == []


ARM = """
points = {O = [0, 0], A = [0.2, 0]}
sections.bar = {shape = "rigidities", EA = 1e7, EI = 40.0, mass_per_length = 0.5}
links.ground.points = ["O"]
links.arm = {points = ["O", "A"], section = "bar"}
[[drives]]
link = "arm"
speed = 6.283185307179586
[[loads]]
link = "arm"
point = "A"
force = [3.0, 4.0]
"""


def page_of(driver, folder, text, *options):
    """Return the page of a scene given as text."""
    (folder / "one.toml").write_text(text)
    assert main([str(folder / "one.toml"), *options, "--quiet", "-o", str(folder / "out")]) in (0, 1)
    return Page(driver, folder / "out" / "one" / "report.html")


def test_the_page_shows_the_inputs(driver, tmp_path):
    page = page_of(driver, tmp_path, ARM + "[run]\npositions = 1\ngravity = [0, -9.81]\n")
    text = page.run("return document.body.innerText")
    for words in ("= 60 rpm", "\u22129.81 m/s² in y", "5 N towards 53.13°", "point load on arm, A", "Euler-Bernoulli",
                  "1 position from", "No stresses: the sections have no dimensions", "not made"):  # fmt: skip
        assert words in text
    assert errors(page) == []


def test_rigid_links_have_a_page_that_moves(driver, tmp_path):
    page = page_of(driver, tmp_path, PUSHED, "--check", "--refine")
    text = page.run("return document.body.innerText")
    assert "momentum of all masses to" in text
    assert "agrees" in text
    assert "are not searched between them" in text
    place = "return document.querySelector('.block').getAttribute('transform')"
    page.run("kinelast.showPosition(0)")
    before = page.run(place)
    page.run("kinelast.showPosition(3)")
    assert page.run(place) != before
    assert errors(page) == []


def test_a_point_on_a_beam_is_drawn_on_the_bent_beam(driver, tmp_path):
    text = shipped_scenes()["steel_four_bar"].read_text().replace('length = "300 mm"\n', "")
    text = text.replace("[points]\n", "[points]\nC = [0.19, 0.12]\n").replace('["A", "B"]', '["A", "C", "B"]')
    page = page_of(driver, tmp_path, text)
    page.run("kinelast.showPosition(40)")
    away = page.run(
        "const { e, f } = document.querySelector('.mark.dot').transform.baseVal[0].matrix; "
        "const beam = document.querySelector('[data-beam=\"1\"]'), length = beam.getTotalLength(); "
        "return Math.min(...Array.from({ length: 2000 }, (_, k) => beam.getPointAtLength(k * length / 2000))"
        ".map(({ x, y }) => Math.hypot(x - e, y - f)))"
    )
    assert away < 0.5
    assert errors(page) == []


def test_curves_end_where_the_drive_stops(driver, tmp_path):
    """The rod of this slider-crank is too short for a full turn, so the curves end at the stop."""
    scene = (
        shipped_scenes()["offset_slider_crank"]
        .read_text()
        .replace('length = "180 mm"', 'length = "55 mm"')
        .replace("B = [0.209, 0.02]", "B = [0.08, 0.02]")
    )
    page = page_of(driver, tmp_path, scene, "--reachable", "--positions", "72")
    out = json.loads((tmp_path / "out" / "one" / "summary.json").read_text())["run"]["left_out"]
    assert out > 0
    script = """
        const done = arguments[0], make = URL.createObjectURL;
        URL.createObjectURL = (blob) => { blob.text().then(done); return make.call(URL, blob); };
        document.querySelector('button[aria-label="Drive moment as CSV"]').click();"""
    rows = driver.execute_async_script(script).strip().splitlines()[1:]
    assert len(rows) == page.run("return kinelast.model.positions") == 72 - out
    assert not any(row.endswith(",") for row in rows)
    assert errors(page) == []


@pytest.mark.parametrize("width", in_tiers([400, 1280, 800, 2000], 1, 1))
def test_it_fits_every_width(width, driver, reports):
    page = Page(driver, reports["quick_return"] / "report.html", width)
    assert page.run("return document.documentElement.scrollWidth <= window.innerWidth")
    assert page.run(
        "return Array.from(document.querySelectorAll('.chart'), "
        "(each) => each.getBoundingClientRect().right).every((right) => right <= window.innerWidth)"
    )
    assert errors(page) == []


@pytest.mark.slow
def test_joints_and_life_are_shown(driver, reports):
    page = Page(driver, reports["pusher"] / "report.html", 400)
    assert page.run("return document.documentElement.scrollWidth <= window.innerWidth")
    first, *others = page.run(
        "return Array.from(document.querySelectorAll('#breaks-first tbody tr'), (row) => row.innerText)"
    )
    assert first.startswith("machine least\ttransmission angle\t")
    assert "at least 25°" in first
    assert next(row for row in others if row.startswith("link")).startswith("link rocker\tdeflection\t")
    assert "rocker, at D, " in "".join(others)
    ring, pin = page.run(
        "const of = (each) => each.transform.baseVal[0].matrix; "
        "const at = (each) => each.cx ? [each.cx.baseVal.value, each.cy.baseVal.value] : [of(each).e, of(each).f]; "
        "return ['.first', '.pin'].map((kind) => Array.from(document.querySelectorAll(`.mechanism ${kind}`), at))"
    )
    assert min(abs(x - ring[0][0]) + abs(y - ring[0][1]) for x, y in pin) < 0.1, "the ring is where it breaks: at D"
    page.run("document.getElementById('show-spot').click()")
    assert page.run("return document.querySelector('.mechanism .first').getAttribute('visibility')") == "hidden"
    bearings = page.run("return document.getElementById('bearings').innerText")
    assert re.search(r"\b24 positions, from crank [\d.]+° to crank [\d.]+°", bearings)
    assert "MPa·m/s" in bearings
    left_out = page.run("return kinelast.summary.not_computed")
    assert "friction in the joints" in left_out
    assert "fatigue" not in left_out
    assert (
        page.run("return document.querySelectorAll('#bearings .polar .tip').length") == 14
    )  # six pins and a rail, both sides
    tip = page.run("return document.querySelector('#bearings .polar .tip').getBBox().width")
    assert 1 < tip <= 176
    assert page.run("return document.getElementById('life').innerText").count("endless") >= 8
    assert errors(page) == []


def test_it_is_dark_where_the_reader_likes_that(driver, reports):
    path = reports["steel_four_bar"] / "report.html"
    grounds = [
        Page(driver, path, media={"prefers-color-scheme": wish}).run(
            "return getComputedStyle(document.body).backgroundColor"
        )
        for wish in ("light", "dark")
    ]
    assert grounds[0] == "rgb(255, 255, 255)"
    assert max(map(int, re.findall(r"\d+", grounds[1]))) < 60


@pytest.mark.slow
def test_paper_has_no_blank_page(driver, reports):
    pypdf = pytest.importorskip("pypdf", reason="pypdf is not installed")
    import base64
    import io

    Page(driver, reports["steel_four_bar"] / "report.html")
    printed = driver.execute_cdp_cmd("Page.printToPDF", {"paperWidth": 8.27, "paperHeight": 11.69})
    pages = pypdf.PdfReader(io.BytesIO(base64.b64decode(printed["data"]))).pages
    assert 2 <= len(pages) <= 10
    assert all(len(page.extract_text().strip()) > 40 for page in pages)


@pytest.mark.parametrize(
    ("name", "wish"),
    [
        ("steel_four_bar", "light"),
        pytest.param("steel_four_bar", "dark", marks=pytest.mark.slow),
        pytest.param("andrews_driven", "light", marks=pytest.mark.slow),
        pytest.param("pusher", "light", marks=pytest.mark.slow),
    ],
)
def test_it_is_accessible(name, wish, driver, reports):
    """By axe-core's rules, with the script from axe-selenium-python."""
    page = Page(driver, reports[name] / "report.html", media={"prefers-color-scheme": wish})
    assert accessibility_faults(page) == []


def test_the_table_of_a_batch(driver, tmp_path):
    (tmp_path / "wrong.toml").write_text('title = "no points"\n')
    arguments = ["steel_four_bar", "quick_return", str(tmp_path / "wrong.toml"), "--positions", "8", "--quiet"]
    arguments += ["--theory", "quasi-static"]
    assert main([*arguments, "-o", str(tmp_path / "out")]) == 2
    page = Page(driver, tmp_path / "out" / "index.html")
    assert errors(page) == []
    names = "return Array.from(document.querySelectorAll('tbody tr'), (row) => row.cells[0].innerText)"
    assert sorted(page.run(names)) == ["quick_return", "steel_four_bar", "wrong"]
    assert "took" in page.run("return document.querySelector('thead').innerText")
    assert accessibility_faults(page) == []
    heads = page.run("return Array.from(document.querySelectorAll('thead th'), (head) => head.innerText)")
    page.run(
        "document.querySelectorAll('thead button')[arguments[0]].click()",
        next(k for k, head in enumerate(heads) if head.startswith("largest deflection")),
    )
    sizes = {
        name: abs(json.loads((tmp_path / "out" / name / "summary.json").read_text())["largest_deflection"]["value"])
        for name in ("quick_return", "steel_four_bar")
    }
    assert page.run(names) == [*sorted(sizes, key=lambda name: -sizes[name]), "wrong"]
    page.run(
        "const box = document.getElementById('filter'); box.value = 'failed'; box.dispatchEvent(new Event('input'))"
    )
    assert page.run(names) == ["wrong"]
    assert "missing" in page.run("return document.querySelector('tbody').innerText")
    links = page.run(
        "const box = document.getElementById('filter'); box.value = ''; "
        "box.dispatchEvent(new Event('input')); "
        "return Array.from(document.querySelectorAll('tbody a'), (a) => a.getAttribute('href'))"
    )
    assert sorted(links) == ["quick_return/report.html", "steel_four_bar/report.html"]
    assert all((tmp_path / "out" / link).is_file() for link in links)


GEARED = """
points = {O = [0, 0], D = [0.3, 0], E = [0.3, 0.25], P = [0.1, 0]}
links.ground.points = ["O", "D", "E"]
links.wheel = {points = {O = [0, 0], P = [0.1, 0]}, rigid = true, mass = 1, center = "O", inertia = 0.1}
links.other = {points = {D = [0, 0]}, rigid = true, mass = 1, center = "D", inertia = 0.1}
links.pulley = {points = {E = [0, 0]}, rigid = true, mass = 1, center = "E", inertia = 0.1}
[[drives]]
link = "wheel"
speed = "60 rpm"
[[gears]]
driver = {link = "wheel"}
follower = {link = "other"}
ratio = -0.5
[[gears]]
driver = {link = "other"}
follower = {link = "pulley"}
ratio = 2
teeth = false
[[springs]]
link = "wheel"
at = "O"
stiffness = "3 N m/rad"
[[springs]]
link = "wheel"
point = "P"
anchor = "E"
stiffness = "30 N/m"
[run]
positions = 12
"""


def test_gears_and_springs_are_drawn(driver, tmp_path):
    page = page_of(driver, tmp_path, GEARED)
    parts = {"wheel": 2, "belt": 1, "spring": 2}
    count = "return document.querySelectorAll(`.mechanism .${arguments[0]}`).length"
    assert {name: page.run(count, name) for name in parts} == parts
    wheels = "return kinelast.model.marks.filter(({ kind }) => kind === 'wheel').map(({ radius }) => radius[1])"
    first, second = page.run(wheels)
    assert first + second == pytest.approx(0.3)  # the circles touch between their centres
    assert first / second == pytest.approx(0.5)
    shape = "return Array.from(document.querySelectorAll('.mechanism .spring'), (path) => path.getAttribute('d'))"
    before = page.run(shape)
    page.run("kinelast.showPosition(4)")
    after = page.run(shape)
    assert after[0] == before[0]
    assert after[1] != before[1]
    assert errors(page) == []


def saved(page, name):
    """Return the text that a button saves."""
    script = """
        const done = arguments[1], make = URL.createObjectURL;
        URL.createObjectURL = (blob) => { blob.text().then(done); return make.call(URL, blob); };
        document.querySelector(`button[aria-label="${arguments[0]}"]`).click();"""
    return page.driver.execute_async_script(script, name).strip()


@pytest.mark.slow
def test_the_answer_against_the_speed_is_shown(driver, tmp_path):
    arguments = ["--theory", "quasi-static", "--positions", "72", "--speeds", "20 rad/s : 60 rad/s : 4", "--quiet"]
    assert main(["steel_four_bar", *arguments, "-o", str(tmp_path)]) == 0
    page = Page(driver, tmp_path / "steel_four_bar" / "report.html")
    shown = list(csv.reader(saved(page, "Largest chord deflection against the speed as CSV").splitlines()))
    written = [row.split(",") for row in (tmp_path / "steel_four_bar" / "speeds.csv").read_text().splitlines()]
    ours = [written[0].index(f"{label}.chord [m]") for label in ("crank", "coupler", "rocker")]
    theirs = [shown[0].index(f"{label} [m]") for label in ("crank", "coupler", "rocker")]
    drawn = {round(float(row[0]), 6): [float(row[k]) for k in theirs] for row in shown[1:]}
    assert len(drawn) > len(written) - 1, "curves go on between the speeds of the table"
    for row in written[1:]:
        np.testing.assert_allclose(drawn[round(float(row[0]), 6)], [float(row[k]) for k in ours], rtol=1e-5)
    assert "No limits are set, so there is no limit speed." in page.run("return document.body.innerText")
    assert errors(page) == []


@pytest.fixture(scope="module")
def study_of_speeds(tmp_path_factory):
    """Return the folder of a study up to 1000 rpm, which in rad/s is below its first eight digits."""
    folder = tmp_path_factory.mktemp("speeds")
    (folder / "one.toml").write_text(CRANK_ROCKER)
    options = ["--theory", "quasi-static", "--positions", "36", "--speeds", "100 rpm : 1000 rpm : 5", "--quiet"]
    assert main([str(folder / "one.toml"), *options, "-o", str(folder)]) == 0
    return folder / "one"


def test_the_curves_against_the_speed_end_at_the_last_speed(driver, study_of_speeds):
    page = Page(driver, study_of_speeds / "report.html")
    shown = list(csv.DictReader(saved(page, "Largest deflection against the speed as CSV").splitlines()))
    written = list(csv.DictReader((study_of_speeds / "speeds.csv").read_text().splitlines()))
    for label in ("crank", "coupler", "rocker"):
        for ours, theirs in (("w [m]", f"{label} [m]"), ("w without vibration [m]", f"{label}, quasi-static [m]")):
            assert float(shown[-1][theirs]) == pytest.approx(float(written[-1][f"{label}.{ours}"]), rel=1e-5)
    rpm = [float(row["speed of the drive [rpm]"]) for row in shown]
    largest = json.loads((study_of_speeds / "summary.json").read_text())["figures"]["deflection"]["value"]
    drawn = np.interp(200, rpm, [float(row["rocker, quasi-static [m]"]) for row in shown])
    assert drawn == pytest.approx(abs(largest), rel=0.15), "between 100 and 325 rpm it grows with a power of the speed"
    assert errors(page) == []


def test_the_picture_of_speeds_has_a_line_at_the_limit(study_of_speeds):
    """A link yields before the deflection reaches its limit; the deflection is drawn too, because it has a limit."""
    words = re.findall(r"<!-- (.*) -->", (study_of_speeds / "speeds.svg").read_text())
    assert words.count("limit") == 2  # of the deflection and of yield, which decides
    assert {"largest deflection [mm]", "limits hold up to here"} < {*words}


def test_the_limit_speed_is_among_the_first_answers(driver, study_of_speeds):
    page = Page(driver, study_of_speeds / "report.html")
    speeds = json.loads((study_of_speeds / "summary.json").read_text())["speeds"]
    tiles = page.run("return [...document.querySelectorAll('.deciding .tile')].map((each) => each.innerText)")
    [tile] = [text for text in tiles if text.startswith("Limit speed")]
    words = speeds["words"][0]
    assert words.startswith("all limits hold up to ")
    assert words.endswith(" (crank yields)")
    assert words in tile
    reported = page.run("return document.getElementById('speeds').innerText")
    for each in speeds["words"]:
        assert f"{each[0].upper()}{each[1:]}." in reported


@pytest.mark.parametrize("width", [390, 1280])
def test_lines_at_limits_have_whole_words(width, driver, study_of_speeds):
    """The deflection has a line at its limit, and each chart has a line at the limit speed."""
    page = Page(driver, study_of_speeds / "report.html", width=width)
    drawn = page.driver.execute_async_script("""
        const done = arguments[0], drawn = [], draw = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (words, x, y) {
          const chart = this.canvas.closest('figure')?.getAttribute('aria-label') ?? '',
            wide = this.measureText(words).width, low = this.textAlign === 'right' ? x - wide : x;
          drawn.push([chart, words, low, low + wide, this.canvas.width]);
          return draw.call(this, words, x, y);
        };
        document.getElementById('theme').click();
        requestAnimationFrame(() => requestAnimationFrame(() => done(drawn)));""")
    charts = {chart for chart, words, *_ in drawn if "against the speed" in chart}
    assert len(charts) == 3
    for chart in charts:
        rows = [row[1:] for row in drawn if row[0] == chart]
        first = next(k for k, (words, *_) in enumerate(rows) if words.startswith("limits"))
        last = next(k for k, (words, *_) in enumerate(rows) if re.search(r"45\d(\.\d)?$", words))
        assert re.fullmatch(r"limits hold up to 45[\d.]+", " ".join(words for words, *_ in rows[first : last + 1]))
        bounds = [row for row in rows if row[0] == "limit"]
        assert bool(bounds) == chart.startswith("Largest deflection")
        for words, low, high, wide in [*rows[first : last + 1], *bounds]:
            assert 58 <= low < high <= wide - 88, words


def test_every_registered_figure_stands_on_the_page(driver, reports):
    page = Page(driver, reports["steel_four_bar"] / "report.html")
    figures = json.loads((reports["steel_four_bar"] / "summary.json").read_text())["figures"]
    rows = page.run(
        "return [...document.querySelectorAll('#register tbody tr')].map((row) => row.cells[0].textContent)"
    )
    assert sorted(rows) == sorted(each["name"] for each in figures.values() if each["value"] is not None)
    assert "error of the output" in rows


@pytest.mark.slow
def test_the_limit_of_the_output_counts_against_the_speed(driver, tmp_path):
    text = shipped_scenes()["steel_four_bar"].read_text() + '[limits]\ndeflection = "1 cm"\noutput = "1 mrad"\n'
    page = page_of(
        driver, tmp_path, text, "--theory", "quasi-static", "--positions", "8", "--speeds", "20 rad/s:40 rad/s:2"
    )
    summary = json.loads((tmp_path / "out" / "one" / "summary.json").read_text())
    errors_there = summary["speeds"]["figures"]["output_error"]["values"]
    assert errors_there[0] < 1e-3 < errors_there[-1]
    highest = summary["speeds"]["highest_within_limits"]
    own = summary["speeds"]["figures"]["output_error"]["errors"]
    whole = [one + other for one, other in zip(errors_there, own, strict=True)]
    kept = [error for speed, error in zip(summary["speeds"]["speed"], whole, strict=True) if speed <= highest]
    assert 0.99e-3 < max(kept) <= 1e-3
    assert f"all limits hold up to {highest:.4g} rad/s (error of the output" in summary["speeds"]["words"][0]
    reported = page.run("return document.getElementById('speeds').innerText")
    assert f"All limits hold up to {highest:.4g} rad/s" in reported


@pytest.mark.parametrize(
    ("system", "length", "stress", "unit"), [("mm", 1e3, 1e-6, "MPa"), ("in", 39.37008, 1.450377e-4, "psi")]
)
def test_units_of_the_report_are_chosen(system, length, stress, unit, driver, tmp_path):
    """The scene or the command selects units for page and table; the summary stays in SI units."""
    text = shipped_scenes()["steel_four_bar"].read_text().replace("[run]", f'[run]\nreport_units = "{system}"')
    page = page_of(driver, tmp_path, text, "--theory", "quasi-static", "--positions", "8")
    folder = tmp_path / "out" / "one"
    summary = json.loads((folder / "summary.json").read_text())
    head, *rows = [row.split(",") for row in (folder / "positions.csv").read_text().splitlines()]
    for field, name, factor in (
        ("w", f"crank.w_max [{system}]", length),
        ("mises", f"crank.mises_max [{unit}]", stress),
    ):
        largest = max((float(row[head.index(name)]) for row in rows), key=abs)
        assert largest == pytest.approx(summary["peaks"]["crank"][field]["value"] * factor, rel=1e-6)
    found = summary["largest_stress"]["value"] * stress
    assert f"{number(found)} {unit}" in page.run("return document.querySelector('.front').innerText")
    assert errors(page) == []


def test_the_table_of_motors_fits_a_small_screen_and_the_chart_one_sense_of_rotation(driver, tmp_path):
    folder = page_of(driver, tmp_path, MOTORED)
    page = Page(driver, tmp_path / "out" / "one" / "report.html", 1366)
    assert errors(folder) == []
    wide = "const [box] = [...document.querySelectorAll('.wide')].filter((box) => box.ariaLabel === 'Motors');"
    assert page.run(wide + "return box.scrollWidth - box.clientWidth") <= 0
    assert page.run("return window.kinelast.charts.find(({ heading }) => heading === 'crank').plot.scales.x.min") >= 0


def test_the_link_that_bends_most_has_a_rival_within_the_errors(driver, tmp_path):
    """The crank of the press is so short that beam theory does not tell whether it bends less than the rod."""
    gallery = Path(__file__).parents[1] / "docs" / "gallery"
    assert main([str(gallery / "toggle_press.toml"), "-o", str(tmp_path)]) == 0
    page = Page(driver, tmp_path / "toggle_press" / "report.html")
    tiles = page.run("return [...document.querySelectorAll('.tile')].map((each) => each.innerText)")
    [tile] = [text for text in tiles if text.startswith("Bends most")]
    assert "rod" in tile
    assert "within the errors, crank may bend as much" in tile
