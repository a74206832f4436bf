"""Open pages in a headless Chromium."""

import json
import shutil
import time
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")


def started():
    """Return a browser, or skip the test if Chromium or its driver is missing."""
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
    """A page whose script has finished."""

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
        driver.get("about:blank")  # so that an editor whose server has ended sends no more requests
        self.logs()
        driver.get_log("performance")  # drop the requests of earlier pages
        features = [{"name": name, "value": value} for name, value in (media or {}).items()]
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        driver.get(path.as_uri())
        deadline = time.monotonic() + 20
        while not self.run(f"return {ready}") and time.monotonic() < deadline:
            time.sleep(0.02)
        if not folded:  # folded parts have no text and cannot be clicked
            self.run("document.querySelectorAll('.fold').forEach((each) => (each.open = true))")
        self.path = path

    def run(self, script: str, *arguments):
        """Return the result of a script."""
        return self.driver.execute_script(script, *arguments)

    def logs(self) -> list[dict]:
        """Return console messages since the last call."""
        return self.driver.get_log("browser")

    def requests(self) -> list[str]:
        """Return the addresses requested since the last call, without the page itself, data and blobs."""
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
    """Return the accessibility violations by axe-core: rule, impact and elements."""
    axe = pytest.importorskip("axe_selenium_python", reason="axe-selenium-python is not installed")
    page.run((Path(axe.__file__).parent / "node_modules" / "axe-core" / "axe.min.js").read_text())
    script = "const done = arguments[arguments.length - 1]; axe.run().then(done)"
    found = page.driver.execute_async_script(script)["violations"]
    shared = page.run(SHARED_NAMES)  # this rule is missing in older axe-core
    assert not shared, shared
    return [(rule["id"], rule["impact"], [node["html"][:120] for node in rule["nodes"][:3]]) for rule in found]
