"""End stops, compared with closed forms of the extreme positions of linkages."""

import json

import numpy as np
import pytest
from browser import Page, started
from scene_texts import edited

from kinelast import scene_from_text
from kinelast.answers.results import results_in_full
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.reports.limits import acceptance
from kinelast.reports.summary import summary
from kinelast.scene.document import document_from_text
from kinelast.scene.parts import symbols_of
from kinelast.values.error import SceneError
from live.edit import EditError
from live.edit import edited as changed
from rigid import motion, position_of
from symbols import anchor_position

CRANK, COUPLER, ROCKER, FRAME = 0.1, abs(0.26 + 0.22j), abs(-0.04 + 0.22j), 0.4
FOUR_BAR = """
materials.steel = {E = 210e9, density = 7850}
sections.bar = {shape = "rectangle", depth = 0.02, width = 0.008}
points = {A = [0, 0], B = [0.1, 0], C = [0.36, 0.22], D = [0.4, 0]}
links.ground = {points = ["A", "D"]}
links.crank = {points = ["A", "B"], section = "bar", material = "steel"}
links.coupler = {points = ["B", "C"], section = "bar", material = "steel"}
links.rocker = {points = ["D", "C"], section = "bar", material = "steel"}
[[drives]]
link = "crank"
speed = "60 rpm"
[run]
positions = 90
"""
ROD, HALF = np.hypot(170.0, 40.0), 50.0  # of the slider-crank [mm]
SLIDER_CRANK = """
units = "mm"
points = {O = [0, 0], A = [30, 40], B = [200, 0]}
sliders.guide = {link = "piston", through = "B", direction = [1, 0]}
[links]
ground.points = ["O"]
crank = { points = ["O", "A"], rigid = true, mass = "1 kg", center = "O" }
rod = { points = ["A", "B"], rigid = true, mass = "1 kg", center = "B" }
piston = { points = ["B"], rigid = true, mass = "1 kg" }
[[drives]]
link = "crank"
speed = "60 rpm"
"""


def stop(keys, joint='link = "rocker"'):
    return f"[stops.end]\n{joint}\n{keys}\n"


def angle(near, far, opposite):
    """Return the angle of a triangle between two sides, opposite the third side."""
    return np.arccos((near**2 + far**2 - opposite**2) / (2 * near * far))


HIGHEST, LOWEST = (float(np.pi - angle(FRAME, ROCKER, COUPLER + side * CRANK)) for side in (-1, 1))
SHARPEST, WIDEST = (float(angle(COUPLER, ROCKER, FRAME + side * CRANK)) for side in (-1, 1))
IN, OUT = (side * HALF + ROD - 200.0 for side in (-1, 1))  # slides [mm]
ON_COUPLER = 'link = "rocker"\non = "coupler"'
GUIDE = 'slider = "guide"'


@pytest.mark.parametrize("positions", [24, 90, 361])
@pytest.mark.parametrize(
    ("scene", "text", "margins", "verdict"),
    [
        (FOUR_BAR, stop('least = "70 deg"\nmost = "150 deg"'),
         (LOWEST - np.radians(70), np.radians(150) - HIGHEST), "acceptable"),
        (FOUR_BAR, stop('most = "148 deg"'), (None, np.radians(148) - HIGHEST), "not acceptable"),
        (FOUR_BAR, stop('least = "94 deg"\nmargin = "1 deg"'), (LOWEST - np.radians(94), None), "acceptable"),
        (FOUR_BAR, stop('least = "94 deg"\nmargin = "1.2 deg"'), (LOWEST - np.radians(94), None), "not acceptable"),
        (FOUR_BAR, stop('least = "455 deg"'), (LOWEST - np.radians(95), None), "acceptable"),
        (FOUR_BAR, stop('least = "30 deg"\nmost = "2.5"'.replace('"2.5"', "2.5"), ON_COUPLER),
         (SHARPEST - np.radians(30), 2.5 - WIDEST), "acceptable"),
        (SLIDER_CRANK, stop('least = -80\nmost = "25 mm"\nmargin = 0.3', GUIDE),
         (1e-3 * (IN + 80.0), 1e-3 * (25.0 - OUT)), "acceptable"),
        (SLIDER_CRANK, stop("most = 25\nmargin = 0.4", GUIDE), (None, 1e-3 * (25.0 - OUT)), "not acceptable"),
    ],
)  # fmt: skip
def test_margins_agree_with_closed_forms_within_their_errors(scene, text, margins, verdict, positions):
    """Extreme angles of a four-bar's rocker, its transmission angles, and the travel of a slider-crank."""
    document = document_from_text(scene + text).with_positions(positions)
    results = results_in_full(document.scene)
    found = summary(results)
    for key, exact in zip(("lower_stop_margin", "upper_stop_margin"), margins, strict=True):
        figure = found["stops"]["end"]["figures"].get(key)
        if exact is None:
            assert figure is None
            continue
        assert abs(figure["value"] - exact) <= 1.02 * figure["error"] + 1e-15
        assert figure["error"] < 0.2 / positions**2
        moved = motion(results.mechanism, [[figure["drive"]["crank"]["value"]]])
        built = document.scene.parts["stops"]["end"]
        bound = built.least if key.startswith("lower") else built.most
        assert abs(built.coordinate(moved)[0] - bound) == pytest.approx(abs(figure["value"]), abs=1e-9)
    assert acceptance(results).verdict == verdict


@pytest.mark.parametrize(
    ("scene", "text", "reserve"),
    [
        (SLIDER_CRANK, stop("most = 25\nmargin = 0.3", GUIDE), (25.0 - OUT) / 0.3),
        (SLIDER_CRANK, stop("most = 25\nmargin = 0.4", GUIDE), (25.0 - OUT) / 0.4),
        (FOUR_BAR, stop('most = "148 deg"'), 0.0),
        (FOUR_BAR, stop('most = "150 deg"'), np.inf),
    ],
)
def test_the_reserve_of_a_stop_is_its_margin_over_the_required_margin(scene, text, reserve):
    """A required margin of zero has no ratio: the reserve is zero beyond the stop, otherwise there is none."""
    rows = summary(results_in_full(scene_from_text(scene + text)))["breaks_first"]
    row = rows[-1 if reserve == np.inf else 0]
    assert (row["kind"], row["item"]) == ("end stop", "end")
    value = row["reserve"]["value"]
    assert (np.inf if value is None else value) == pytest.approx(reserve, rel=1e-3)


@pytest.mark.parametrize(("speed", "least"), [(60, 90 - 360), (-60, 90 - 360)])
def test_a_rotating_link_passes_its_stop(speed, least):
    """A crank that starts at 0 passes the stop, forwards and backwards, and ends a turn minus 90 deg beyond it."""
    text = edited(FOUR_BAR, ('speed = "60 rpm"', f'speed = "{speed} rpm"'))
    scene = document_from_text(text + stop('most = "90 deg"', 'link = "crank"')).scene
    found = summary(results_in_full(scene))["acceptance"]
    assert found["verdict"] == "not acceptable"
    assert found["limits"][0]["found"]["value"] == pytest.approx(np.radians(least), rel=0.02)


@pytest.mark.parametrize(("turned", "least", "most"), [(180, "250 deg", "330 deg"), (-90, "-20 deg", "60 deg")])
def test_an_angle_counts_near_the_middle_of_its_stops(turned, least, most):
    """A rotated four-bar has the same margins, also across half a turn."""
    text = FOUR_BAR
    for name, (x, y) in {"B": ("0.1", "0"), "C": ("0.36", "0.22"), "D": ("0.4", "0")}.items():
        place = complex(float(x), float(y)) * np.exp(1j * np.radians(turned))
        text = edited(text, (f"{name} = [{x}, {y}]", f"{name} = [{place.real:.15f}, {place.imag:.15f}]"))
    own, other = (
        summary(results_in_full(scene_from_text(each)))["stops"]["end"]["figures"]
        for each in (FOUR_BAR + stop('least = "70 deg"\nmost = "150 deg"'),
                     text + stop(f'least = "{least}"\nmost = "{most}"'))
    )  # fmt: skip
    for key, figure in own.items():
        assert other[key]["value"] == pytest.approx(figure["value"], abs=1e-9)


def test_designs_have_the_margins_of_single_scenes():
    """For lengths of a link and for the stop itself."""
    text = FOUR_BAR + stop('least = "70 deg"\nmost = "150 deg"')
    document = document_from_text(text)
    for path, values in {"links.coupler.length": [0.33, 0.36], "stops.end.most": [2.5, 2.7]}.items():
        found = evaluate(document, [path], np.array(values)[:, None], ["upper_stop_margin.end"])
        for number, value in enumerate(values):
            own = evaluate(document.with_values({path: value}), [], np.zeros((1, 0)), ["upper_stop_margin.end"])
            assert found.columns["upper_stop_margin.end"][number] == pytest.approx(
                own.columns["upper_stop_margin.end"][0], rel=1e-12
            )


@pytest.mark.parametrize(
    ("keys", "joint", "message"),
    [
        ("", 'link = "rocker"', "[stops.end] least: the key is missing: give least, most or both"),
        ('least = "9 mm"', 'link = "rocker"', '[stops.end] least: expected an angle, as in "30 deg", got 0.009 m'),
        ("least = 2\nmost = 1", 'link = "rocker"', "[stops.end] most: expected a value above least"),
        ("least = 0\nmost = 7", 'link = "rocker"', "[stops.end] most: expected less than a turn above least"),
        ("least = 0\nmargin = -1", 'link = "rocker"', "[stops.end] margin: expected zero or more"),
        ("least = 0", 'link = "roker"', '[stops.end] link: there is no link "roker"; did you mean "rocker"?'),
        ("least = 0", 'link = "rocker"\non = "crank"', '[stops.end] on: the links "rocker" and "crank" share no point'),
        ("least = 0", "", "[stops.end] link: expected either link or slider"),
    ],
)
def test_mistakes(keys, joint, message):
    """The message names the table and the key."""
    with pytest.raises(SceneError) as error:
        _ = document_from_text(FOUR_BAR + stop(keys, joint)).scene
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("scene", "text", "link"),
    [(FOUR_BAR, stop(f"most = {HIGHEST!r}"), "rocker"), (FOUR_BAR, stop(f"most = {WIDEST!r}", ON_COUPLER), "rocker")],
)
def test_the_symbol_lies_along_the_link_at_its_stop(scene, text, link):
    """In the extreme position the first stroke points from the pin along the link."""
    built = scene_from_text(scene + text)
    figure = summary(results_in_full(built))["stops"]["end"]["figures"]["upper_stop_margin"]
    moved = motion(built.mechanism, [[figure["drive"]["crank"]["value"]]])
    (bar,) = symbols_of(built)
    at, on = (built.mechanism.index[name] for name in (link, bar.at.link))
    bar_points = bar.placed(anchor_position(moved, bar.at)[0], bar.direction(moved)[0], 0.01)[bar.cells[0]]
    start, end = (complex(np.ravel(position_of(moved, link, point))[0]) for point in built.mechanism.links[at].points)
    pin, far = (start, end) if "D" in built.mechanism.links[on].points else (end, start)
    ways = [(place - pin) * np.conj(far - pin) for place in bar_points]
    assert all(abs(way.imag) <= 3e-4 * way.real for way in ways)


def test_bounds_without_unit_are_in_the_unit_of_the_joint():
    """This includes variables."""
    angle = document_from_text(FOUR_BAR + stop("most = 2.6")).variable("stops.end.most")
    slide = document_from_text(SLIDER_CRANK + stop("most = 25", GUIDE)).variable("stops.end.most")
    assert (angle.unit, angle.base, slide.unit, slide.base) == ("rad", 2.6, "m", 0.025)


def test_page_editor_and_terminal_show_stops(tmp_path, capsys):
    """The page has the symbol, the editor adds and removes a stop, and the closing line has the verdict."""
    (tmp_path / "stopped.toml").write_text(SLIDER_CRANK + stop("most = 25\nmargin = 1", GUIDE), encoding="utf-8")
    assert main([str(tmp_path / "stopped.toml"), "--out", str(tmp_path / "out")]) == 1
    assert "margin of a joint below its upper stop (end) 0.3576 mm" in capsys.readouterr().out
    page = (tmp_path / "out" / "stopped" / "report.html").read_text(encoding="utf-8")
    model, _ = json.JSONDecoder().raw_decode(page[page.index('{"fields"') :])
    (bar,) = (mark for mark in model["marks"] if mark["kind"] == "stop")
    assert (bar["at"]["link"], len(bar["lines"])) == (0, 4)

    text = changed(SLIDER_CRANK, {"do": "table", "kind": "stops", "of": ["sliders", "guide"]})
    assert scene_from_text(text).parts["stops"]["stop_1"].most == pytest.approx(0.01)
    assert changed(text, {"do": "remove", "kind": "stop", "name": "stop_1"}).strip() == SLIDER_CRANK.strip()
    with pytest.raises(EditError, match="end stops of the link or slider"):
        changed(SLIDER_CRANK, {"do": "table", "kind": "stops"})


@pytest.mark.slow
def test_the_page_draws_the_bars(tmp_path):
    """In a browser: a bar and three ticks, and no errors."""
    (tmp_path / "stopped.toml").write_text(FOUR_BAR + stop('most = "150 deg"'), encoding="utf-8")
    assert main([str(tmp_path / "stopped.toml"), "--out", str(tmp_path / "out")]) == 0
    driver = started()
    try:
        page = Page(driver, tmp_path / "out" / "stopped" / "report.html")
        (drawn,) = page.run("return [...document.querySelectorAll('path.stop')].map((each) => each.getAttribute('d'))")
        assert (drawn.count("M"), drawn.count("L")) == (4, 5)
        assert not [each for each in page.logs() if each["level"] == "SEVERE"]
    finally:
        driver.quit()


SWING = """
[points]
O = [0, 0]
A = [0.1, 0]
[links.ground]
points = ["O"]
[links.arm]
points = ["O", "A"]
rigid = true
mass = 1
center = "O"
[stops.arm]
link = "arm"
{stop}
[[drives]]
link = "arm"
{drive}
[run]
positions = {positions}
"""


@pytest.mark.parametrize("positions", [12, 24, 90])
def test_a_swing_of_nearly_a_turn_does_not_pass_its_stops(positions):
    there, back = (f'{{curve = "cycloidal", duration = 1, by = "{way} deg"}}' for way in (340, -340))
    drive = f'start = "-170 deg"\nrepeat = true\nlaw = [{there}, {back}]'
    text = SWING.format(stop='least = "-175 deg"\nmost = "175 deg"', drive=drive, positions=positions)
    peaks = results_in_full(document_from_text(text).scene).figures.peaks
    for key in ("lower_stop_margin", "upper_stop_margin"):
        assert peaks[key][0].value == pytest.approx(np.radians(5), abs=1e-6), key


@pytest.mark.parametrize("speed", [60, -60])
def test_a_link_that_starts_on_its_stop_and_turns_fully(speed):
    text = SWING.format(stop='most = "0 deg"', drive=f'speed = "{speed} rpm"', positions=36)
    (margin,) = results_in_full(document_from_text(text).scene).figures.peaks["upper_stop_margin"]
    assert margin.value < np.radians(-340)
