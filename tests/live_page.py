"""Serve the live editor in a thread, and operate its page in a browser."""

import threading
import time
import zlib
from base64 import urlsafe_b64encode
from contextlib import contextmanager

from live.file import SceneFile
from live.share import MARK


def fragment(text):
    """Return the fragment of a web link that contains the text of a scene, in the format of `web/share.js`."""
    return MARK + urlsafe_b64encode(zlib.compress(text.encode())).decode().rstrip("=")


@contextmanager
def editing(path, worker=None):
    """Serve an editor of a file, and yield the editor's state."""
    from live import server

    bound = server.bound_socket(str(path))
    more = {} if worker is None else {"worker": worker}
    live = server.Live(SceneFile(path), path.stem, "secret", bound.getsockname()[1], **more)
    serving = server.LiveServer(live)
    thread = threading.Thread(target=serving.run, kwargs={"sockets": [bound]})
    thread.start()
    try:
        yield live
    finally:
        serving.should_exit = True
        thread.join()


class Hand:
    """Mouse and keyboard on an editor's page."""

    def __init__(self, driver, address, width=1280, height=900):
        self.driver = driver
        driver.get("about:blank")  # so that a page whose server has ended sends no more requests
        driver.get_log("browser")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        driver.get(address)
        self.until("return document.body.dataset.ready")

    def run(self, script, *arguments):
        """Return the result of a script."""
        return self.driver.execute_script(script, *arguments)

    def until(self, script, seconds=90.0):
        """Wait until a script returns a true value, and return it."""
        end = time.monotonic() + seconds
        while not (found := self.run(script)):
            assert time.monotonic() < end, f"never: {script}"
            time.sleep(0.02)
        return found

    @property
    def text(self):
        """Text in the editor's text field."""
        return self.run("return live.text()")

    def figure(self, key):
        """Return the value on a figure's tile."""
        return float(self.run("return document.querySelector(`[data-figure=${arguments[0]}]`).dataset.value", key))

    def at(self, x, y):
        """Return the screen position of a point of the plane."""
        script = (
            "const { view } = live, box = document.getElementById('svg').getBoundingClientRect(), [x, y] = arguments; "
            "return [box.left + box.width / 2 + (x - view.x) * view.scale, "
            "box.top + box.height / 2 - (y - view.y) * view.scale]"
        )
        return self.run(script, x, y)

    def mouse(self, kind, place, pressed):
        """Send a mouse event."""
        button = "left" if pressed or kind == "mouseReleased" else "none"
        words = {"type": kind, "x": place[0], "y": place[1], "button": button, "buttons": int(pressed), "clickCount": 1}
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", words)

    def press(self, place):
        """Press the mouse button at a screen position."""
        self.mouse("mouseMoved", place, False)
        self.mouse("mousePressed", place, True)

    def move(self, places, pause=1 / 60):
        """Move the pressed mouse along screen positions."""
        for place in places:
            self.mouse("mouseMoved", place, True)
            time.sleep(pause)

    def release(self, place):
        """Release the mouse button."""
        self.mouse("mouseReleased", place, False)

    def drag(self, start, end, steps=10):
        """Drag from one screen position to another."""
        self.press(start)
        path = [[a + (b - a) * k / steps for a, b in zip(start, end, strict=True)] for k in range(1, steps + 1)]
        self.move(path)
        self.release(end)
