"""A headless Chromium, where there is one, and pages opened in it."""

from __future__ import annotations

import json
import shutil
import time
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")


def started():
    """A browser; the test is skipped, with the reason, where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no Chromium with its driver: on Debian, apt-get install chromium chromium-driver")
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))


class Page:
    """A page that is open: its script has run to the end."""

    def __init__(
        self,
        driver,
        path: Path,
        width: int = 1280,
        media: dict[str, str] | None = None,
        ready: str = "document.body.dataset.ready",
        folded: bool = False,
        height: int = 900,
    ) -> None:
        self.driver = driver
        driver.get("about:blank")  # an editor of which the server has ended asks no more
        self.logs()
        driver.get_log("performance")  # of pages before
        features = [{"name": name, "value": value} for name, value in (media or {}).items()]
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        driver.get(path.as_uri())
        deadline = time.monotonic() + 20
        while not self.run(f"return {ready}") and time.monotonic() < deadline:
            time.sleep(0.02)
        if not folded:  # what is not rendered has no text, and is not to be clicked
            self.run("document.querySelectorAll('.fold').forEach((each) => (each.open = true))")
        self.path = path

    def run(self, script: str, *arguments):
        """What a script in the page returns."""
        return self.driver.execute_script(script, *arguments)

    def logs(self) -> list[dict]:
        """What was written to the console since last asked."""
        return self.driver.get_log("browser")

    def requests(self) -> list[str]:
        """Addresses asked for since last asked, but for the page itself, data and blobs."""
        asked = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                asked.append(message["params"]["request"]["url"])
        return [
            url
            for url in asked
            if not url.startswith(("data:", "blob:", "about:", "chrome")) and Path(url).suffix != ".html"
        ]


SHARED_NAMES = """
const seen = [...document.querySelectorAll("section[aria-labelledby], [role=region]")].filter((each) => each.offsetParent);
const names = seen.map((each) => each.getAttribute("aria-label") ?? document.getElementById(each.getAttribute("aria-labelledby")).textContent);
return names.filter((name, k) => names.indexOf(name) !== k);
"""  # noqa: E501


def accessibility_faults(page: Page) -> list[tuple[str, str, list[str]]]:
    """What axe-core finds against a page: rule, how bad, and where; its script comes with axe-selenium-python."""
    axe = pytest.importorskip("axe_selenium_python", reason="axe-selenium-python is not installed")
    page.run((Path(axe.__file__).parent / "node_modules" / "axe-core" / "axe.min.js").read_text())
    script = "const done = arguments[arguments.length - 1]; axe.run().then(done)"
    found = page.driver.execute_async_script(script)["violations"]
    shared = page.run(SHARED_NAMES)  # a rule of newer axe-core
    assert not shared, shared
    return [(rule["id"], rule["impact"], [node["html"][:120] for node in rule["nodes"][:3]]) for rule in found]
