"""The page of many designs in a browser: Pareto front, selection, stored designs, and texts as plain data."""

import re

import numpy as np
import pytest
from browser import Page, accessibility_faults

from kinelast.outputs.page import SHOWN, designs_page, front, kept_designs

NUMBERS, FIGURES = ("sections.bar.depth", "drives.crank.speed"), ("deflection", "mass", "safety")
UNITS = {"sections.bar.depth": "m", "drives.crank.speed": "rad/s", "deflection": "m", "mass": "kg", "safety": "1"}
REASON = "cannot be assembled: <img src=x onerror='window.hit = 1'>"
BEST = 7


def designs(count):
    """Return columns and reasons of artificial designs; each tenth has no figures."""
    random = np.random.default_rng(4)
    depth, speed = random.uniform(4e-3, 12e-3, count), random.uniform(60.0, 140.0, count)
    spread = random.uniform(1.0, 3.0, count)
    columns = {
        "sections.bar.depth": depth,
        "drives.crank.speed": speed,
        "deflection": 1e-3 * spread * (6e-3 / depth) ** 2,
        "mass": 30.0 * depth,
        "safety": 2.0 * depth / 6e-3,
    }
    reasons = np.where(np.arange(count) % 10 == 3, REASON, "")
    for name in FIGURES:
        columns[name][reasons != ""] = np.nan
    return columns, reasons


@pytest.fixture(scope="module")
def columns():
    return designs(200)[0]


@pytest.fixture
def page(driver, tmp_path, columns):
    content = designs_page(
        "Bars </script><script>window.hit = 1</script>", *with_reasons(columns), best=BEST,
        pages={BEST: "best/report.html"}, shown_in={"rad/s": (30 / np.pi, "rpm")},
        answered={BEST: {"theory": "elastodynamic", "verdict": "acceptable",
                         "figures": {"deflection": {"value": 2e-3, "unit": "m", "error": 3e-5}}}},
    )  # fmt: skip
    (tmp_path / "designs.html").write_bytes(content)
    opened = Page(driver, tmp_path / "designs.html")
    assert opened.run("return document.body.dataset.ready") == "yes"
    assert [entry["message"] for entry in opened.logs()] == []
    assert opened.requests() == []
    return opened


def with_reasons(columns):
    reasons = designs(len(columns["mass"]))[1]
    return columns, UNITS, reasons.tolist(), NUMBERS, FIGURES


def front_by_comparison(one, other):
    """Return the front by comparing each design with each other."""
    known = np.flatnonzero(np.isfinite(one) & np.isfinite(other))
    pairs = np.stack([one[known], other[known]])
    beaten = ((pairs[:, :, None] >= pairs[:, None, :]).all(0) & (pairs[:, :, None] > pairs[:, None, :]).any(0)).any(1)
    return set(known[~beaten].tolist())


def test_the_front_has_the_designs_that_no_other_dominates(page, columns):
    shown = "return kinelast.scatter.front().map((k) => kinelast.columnOf('#design')[k])"
    assert set(page.run(shown)) == front_by_comparison(columns["mass"], columns["deflection"])
    assert set(front(columns["mass"], columns["deflection"]).tolist()) == set(page.run(shown))
    page.run("const up = document.getElementById('up'); up.value = 'safety'; up.dispatchEvent(new Event('change'));")
    assert set(page.run(shown)) == front_by_comparison(columns["mass"], -columns["safety"])


def test_numbers_arrive_to_the_last_digit(page, columns):
    for name in (*NUMBERS, *FIGURES):
        found = np.array(page.run("return Array.from(kinelast.columnOf(arguments[0]))", name), float)
        np.testing.assert_array_equal(found, columns[name])


def test_a_design_is_chosen_by_its_number_or_its_dot(page, columns):
    assert "the best" in page.run("return document.getElementById('chosen').innerText")
    assert page.run("return document.querySelector('#chosen a').getAttribute('href')") == "best/report.html"
    page.run("document.querySelectorAll('#designs-table tbody button')[4].click()")
    chosen = int(page.run("return document.querySelectorAll('#designs-table tbody tr')[4].dataset.design"))
    lines = page.run("return document.getElementById('lines').textContent").splitlines()
    assert lines[0] == f'sections.bar.depth = "{columns["sections.bar.depth"][chosen]:.12g} m"'
    order = np.argsort(columns["deflection"], kind="stable")
    assert chosen == order[4]
    from selenium.webdriver import ActionChains

    page.run("document.querySelector('canvas.drawn').scrollIntoView({block: 'center', behavior: 'instant'})")
    box = page.run(
        "const box = document.querySelector('canvas.drawn').getBoundingClientRect(); "
        "return [box.left, box.top, box.width, box.height]"
    )
    corner = min(np.flatnonzero(np.isfinite(columns["mass"])), key=lambda at: columns["mass"][at])
    spans = [(np.nanmin(columns[name]), np.nanmax(columns[name])) for name in ("mass", "deflection")]
    spans = [(low - 0.03 * (high - low), high + 0.03 * (high - low)) for low, high in spans]
    part = [
        (columns[n][corner] - low) / (high - low) for n, (low, high) in zip(("mass", "deflection"), spans, strict=True)
    ]
    action = ActionChains(page.driver, duration=10)
    action.w3c_actions.pointer_action.move_to_location(
        round(box[0] + 74 + part[0] * (box[2] - 90)), round(box[1] + 394 - part[1] * 380)
    )
    action.w3c_actions.pointer_action.click()
    action.perform()
    assert page.run("return kinelast.columnOf('#design')[kinelast.state.chosen]") == corner


def test_a_full_answer_is_shown(page, columns):
    chosen = page.run("return document.getElementById('chosen').innerText")
    assert "Answered in full: elastodynamic, acceptable" in chosen
    assert re.search(r"deflection\s.*\b2 ± 1.5 %", chosen)
    assert re.search(r"mass\s.*the same", chosen)
    speed = columns["drives.crank.speed"][BEST] * 30 / np.pi
    assert f'drives.crank.speed = "{speed:.12g} rpm"' in page.run("return document.getElementById('lines').textContent")
    page.run("Array.from(document.querySelectorAll('#designs-table button')).at(-1).click()")  # more rows
    cells = "(row) => [row.dataset.design, row.children[1].innerText]"
    answers = page.run(f"return Array.from(document.querySelectorAll('#designs-table tbody tr'), {cells})")
    assert dict(answers)[str(BEST)] == "elastodynamic, acceptable"
    assert {words for number, words in answers if number != str(BEST)} == {"quasi-static", ""}


def test_a_range_filters_designs(page, columns):
    page.run(
        "const which = document.getElementById('range-of'), to = document.getElementById('range-to'); "
        "which.value = 'mass'; which.dispatchEvent(new Event('change')); "
        "to.value = '0.2'; to.dispatchEvent(new Event('change'))"
    )
    within = set(np.flatnonzero(columns["mass"] <= 0.2).tolist())
    kept = "return Array.from({length: 200}, (_, k) => k).filter((k) => kinelast.inside(k))"
    assert set(page.run(kept)) == within
    assert f"{len(within)} designs within" in page.run("return document.getElementById('designs-table').innerText")
    page.run("document.getElementById('all-again').click()")
    assert len(page.run(kept)) == 200


def test_designs_that_break_a_limit_are_grey_in_both_plots(driver, tmp_path, columns):
    kept = {**columns, "limits_kept": (columns["safety"] > 2.0).astype(float)}
    given = with_reasons(columns)[2:]
    content = designs_page("Bars", kept, {**UNITS, "limits_kept": "1"}, *given[:2], (*FIGURES, "limits_kept"))
    (tmp_path / "designs.html").write_bytes(content)
    page = Page(driver, tmp_path / "designs.html")
    assert page.run("return document.body.dataset.ready") == "yes"
    page.run("""
        window.inks = {};
        for (const [name, ink] of [["stroke", "strokeStyle"], ["fillRect", "fillStyle"]]) {
          const own = CanvasRenderingContext2D.prototype[name];
          CanvasRenderingContext2D.prototype[name] = function (...places) {
            (inks[name] ??= []).push(this[ink]);
            return own.call(this, ...places);
          };
        }
        document.getElementById("all-again").click();
    """)
    broken = int(((columns["safety"] <= 2.0) & np.isfinite(columns["safety"])).sum())
    for name in ("stroke", "fillRect"):
        assert page.run("return inks[arguments[0]].filter((ink) => ink === '#9aa3ad').length", name) >= broken
    assert "grey designs break a limit" in page.run("return document.getElementById('ranges').textContent")


def test_texts_are_not_executed_and_the_page_is_accessible(page):
    assert page.run("return window.hit ?? 'none'") == "none"
    page.run("document.querySelectorAll('#designs-table thead button')[0].click()")
    assert REASON in page.run("return document.querySelectorAll('#designs-table tbody tr')[3].innerText")
    assert accessibility_faults(page) == []
    for width in (400, 800, 2000):
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        assert page.run("return document.documentElement.scrollWidth <= window.innerWidth")


def test_selection_keeps_the_fronts_and_the_best():
    columns, _ = designs(3 * SHOWN)
    figures = [columns["deflection"], columns["mass"], columns["drives.crank.speed"]]
    kept = kept_designs(3 * SHOWN, figures, 1234)
    assert len(np.unique(kept)) == SHOWN
    assert front_by_comparison(figures[0][:500], figures[1][:500]) == set(
        front(figures[0][:500], figures[1][:500]).tolist()
    )
    assert {1234, *front(figures[0], figures[1]), *front(figures[0], figures[2])} <= set(kept.tolist())
    np.testing.assert_array_equal(kept, kept_designs(3 * SHOWN, figures, 1234))
    all_on_it = [columns["mass"], -columns["mass"]]
    crowded = kept_designs(3 * SHOWN, all_on_it, 1234)
    assert len(np.unique(crowded)) == SHOWN
    assert 1234 in crowded


def test_ten_thousand_designs_make_a_small_page(driver, tmp_path):
    columns, reasons = designs(3 * SHOWN)
    content = designs_page("Many", columns, UNITS, reasons.tolist(), NUMBERS, FIGURES, best=1234)
    (tmp_path / "designs.html").write_bytes(content)
    page = Page(driver, tmp_path / "designs.html")
    assert re.search(rf"holds {SHOWN} of them", page.run("return document.getElementById('about').innerText"))
    assert page.run("return kinelast.columnOf('#design')[kinelast.state.chosen]") == 1234
    assert len(content) < 1_500_000


def test_a_missing_column_is_an_error():
    columns, reasons = designs(20)
    with pytest.raises(ValueError, match="column 'stress': expected shape \\(20,\\), got none"):
        designs_page("Few", columns, UNITS, reasons.tolist(), NUMBERS, ("stress",))
    with pytest.raises(ValueError, match="column 'mass': expected shape \\(3,\\), got \\(20,\\)"):
        designs_page("Few", columns, UNITS, ["", "", ""], NUMBERS[:0], ("mass",))
