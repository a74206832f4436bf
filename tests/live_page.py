"""The live editor served in a thread, and its page in a browser's hand."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager

from live.file import SceneFile


@contextmanager
def editing(path, worker=None):
    """The state of an editor that serves a file meanwhile."""
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
    """The page of an editor, with a pointer."""

    def __init__(self, driver, address, width=1280, height=900):
        self.driver = driver
        driver.get("about:blank")  # so that a page whose server has ended asks no more
        driver.get_log("browser")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        driver.get(address)
        self.until("return document.body.dataset.ready")

    def run(self, script, *arguments):
        """What a script in the page returns."""
        return self.driver.execute_script(script, *arguments)

    def until(self, script, seconds=90.0):
        """Wait for what a script returns to be true."""
        end = time.monotonic() + seconds
        while not (found := self.run(script)):
            assert time.monotonic() < end, f"never: {script}"
            time.sleep(0.02)
        return found

    @property
    def text(self):
        """The text beside the drawing."""
        return self.run("return live.text()")

    def figure(self, key):
        """The value of a figure's tile."""
        return float(self.run("return document.querySelector(`[data-figure=${arguments[0]}]`).dataset.value", key))

    def at(self, x, y):
        """Where a place of the plane is on the screen."""
        script = (
            "const { view } = live, box = document.getElementById('svg').getBoundingClientRect(), [x, y] = arguments; "
            "return [box.left + box.width / 2 + (x - view.x) * view.scale, "
            "box.top + box.height / 2 - (y - view.y) * view.scale]"
        )
        return self.run(script, x, y)

    def mouse(self, kind, place, pressed):
        """A movement or a press of the mouse."""
        button = "left" if pressed or kind == "mouseReleased" else "none"
        words = {"type": kind, "x": place[0], "y": place[1], "button": button, "buttons": int(pressed), "clickCount": 1}
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", words)

    def press(self, place):
        """Press the mouse there."""
        self.mouse("mouseMoved", place, False)
        self.mouse("mousePressed", place, True)

    def move(self, places, pause=1 / 60):
        """Move the pressed mouse along some places."""
        for place in places:
            self.mouse("mouseMoved", place, True)
            time.sleep(pause)

    def release(self, place):
        """Let go."""
        self.mouse("mouseReleased", place, False)

    def drag(self, start, end, steps=10):
        """Drag from one place on the screen to another."""
        self.press(start)
        way = [[a + (b - a) * k / steps for a, b in zip(start, end, strict=True)] for k in range(1, steps + 1)]
        self.move(way)
        self.release(end)
