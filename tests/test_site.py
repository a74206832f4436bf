"""The built site has no dead link, loads nothing from the network, has an offline search and fits a telephone.

`mkdocs build` builds the site; CI runs it before these tests. Without the site the tests are skipped.
"""

import re
import time
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import pytest
from browser import Page, accessibility_faults, started

SITE = Path(__file__).parents[1] / "build" / "site"
LINK = re.compile(r'<(?:a|img|iframe|script|link)\b[^>]*?\b(?:href|src)="([^"]*)"')
NAMED = re.compile(r'\b(?:id|name)="([^"]*)"')
INSPECTED = ("index", "tutorial/first_mechanism", "scenes", "theory", "reference/tables", "gallery", "gallery/pusher")
WIDTHS = (1280, 390)
GRAVE = {"serious", "critical"}

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (SITE / "index.html").is_file(), reason="the site is not built: mkdocs build"),
]


@pytest.fixture(scope="module")
def browser():
    driver = started()
    driver.set_script_timeout(120)
    yield driver
    driver.quit()


def pages():
    """Return the pages of the site, without reports and the page for errors 404."""
    return [page for page in SITE.rglob("*.html") if page.name not in {"report.html", "404.html"}]


def test_no_link_is_dead():
    names = {page: {*map(unescape, NAMED.findall(page.read_text(encoding="utf-8")))} for page in pages()}
    dead = []
    for page in names:
        for link in {*map(unescape, LINK.findall(page.read_text(encoding="utf-8")))}:
            path, _, anchor = link.partition("#")
            if re.match(r"[a-z]+:", path):
                continue
            there = (page.parent / unquote(path.partition("?")[0])).resolve() if path else page
            if not there.is_file() or (anchor and there in names and unquote(anchor) not in names[there]):
                dead.append(f"{page.relative_to(SITE)}: {link}")
    assert len(names) > 50
    assert not dead


@pytest.mark.parametrize("name", INSPECTED)
@pytest.mark.parametrize("width", WIDTHS)
def test_a_page_fits_and_is_accessible(browser, name, width):
    page = Page(browser, SITE / f"{name}.html", width, ready="document.readyState === 'complete'")
    assert browser.execute_script("return document.documentElement.scrollWidth <= innerWidth")
    assert not [fault for fault in accessibility_faults(page) if fault[1] in GRAVE]
    assert not [entry for entry in page.logs() if entry["level"] == "SEVERE"]
    assert not [url for url in page.requests() if not url.startswith("file:")]


def test_search_works_without_a_server(browser):
    browser.get((SITE / "scenes.html").as_uri())
    browser.execute_script("document.querySelector('label[for=__search]').click()")
    browser.find_element("css selector", ".md-search__input").send_keys("flywheel")
    deadline = time.monotonic() + 30
    while not browser.find_elements("css selector", ".md-search-result__item") and time.monotonic() < deadline:
        time.sleep(0.1)
    results = [
        each.get_attribute("textContent") for each in browser.find_elements("css selector", ".md-search-result__item")
    ]
    assert any("flywheel" in each.lower() for each in results)
