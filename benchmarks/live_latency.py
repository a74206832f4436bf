"""From the pointer to the picture of the live editor, in a real browser: how long a drag waits for what it shows.

`python benchmarks/live_latency.py` drags a joint of the steel four-bar and of the flap of 13 bars in a headless
Chromium, at 60 movements a second, and writes `results/live_latency.*`. A latency is from the time stamp of a movement
of the pointer to the end of the frame that shows its answer; movements that a newer one overtook have none. `answer` is
the processor time of the server's part, without the browser and without what else the machine does. `half` is
measured while another process takes one core and a second window asks for answers all the time; `load` is the machine's
own when it was measured.
"""

from __future__ import annotations

import contextlib
import json
import math
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import measuring
import numpy as np

from kinelast.tasks.task import shipped_scenes
from live.answer import Memory, packed, quick_answer
from live.edit import edited

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from browser import started
from live_page import Hand

JOINTS = {"steel_four_bar": ("B", 0.28, 0.24), "flap_bars": ("3", 0.2, 0.07)}
MOVES, RADIUS = 240, 25.0  # of a drag, and of the circles that it follows [pixels]


def latencies(driver: Any, folder: Path, name: str, busy: bool) -> tuple[list[float], float]:
    """Milliseconds of every movement of a drag that has a picture, and the median of those that drawing takes."""
    path = folder / f"{name}.toml"
    path.write_text(shipped_scenes()[name].read_text(encoding="utf-8"), encoding="utf-8")
    _, x, y = JOINTS[name]
    with _served(path) as address:
        hand = Hand(driver, address)
        hand.until("return document.querySelector('.tile')", 60)
        start = hand.at(x, y)
        circle = [
            [start[0] + RADIUS * math.sin(k / 12), start[1] + RADIUS * (1 - math.cos(k / 12))]
            for k in range(1, MOVES + 1)
        ]
        with _others(address, path.read_text(encoding="utf-8")) if busy else contextlib.nullcontext():
            hand.press(start)
            hand.move(circle)
            hand.release(circle[-1])
            time.sleep(0.3)
        return [float(each) for each in hand.run("return live.state.latencies")][5:], np.median(
            hand.run("return live.state.drawing")
        )


def answer_time(name: str) -> float:
    """Milliseconds of processor time, the median of 40, that an edit of a drag and its quick answer take."""
    text = shipped_scenes()[name].read_text(encoding="utf-8")
    point, x, y = JOINTS[name]
    taken, memory = [], Memory()
    for k in range(45):
        began = time.process_time()
        moved = edited(text, {"do": "move", "point": point, "to": [x + 1e-4 * k, y]})
        packed(*quick_answer(moved, dragged=True, memory=memory))
        taken.append(time.process_time() - began)
    return 1e3 * float(np.median(taken[5:]))


@contextlib.contextmanager
def _served(path: Path) -> Iterator[str]:
    """The address of an editor in a process of its own, as the command starts it."""
    program = f"from live import serve; serve({str(path)!r}, lambda words: print(words, flush=True), browse=False)"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        told = re.search(r"http\S+", process.stdout.readline())
        assert told is not None
        try:
            yield told[0]
        finally:
            process.send_signal(signal.SIGINT)


@contextlib.contextmanager
def _others(address: str, text: str) -> Iterator[None]:
    """Another process that takes a core, and another window that asks all the time."""
    process = multiprocessing.get_context("spawn").Process(target=_spin, daemon=True)
    over = threading.Event()

    def ask() -> None:
        origin = address.rsplit("/", 2)[0]
        headers = {"Origin": origin, "Content-Type": "application/json"}
        while not over.wait(0.05):
            body = json.dumps({"text": text, "number": 1}).encode()
            with urllib.request.urlopen(urllib.request.Request(f"{address}answer", body, headers)) as response:
                response.read()

    thread = threading.Thread(target=ask)
    process.start()
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        process.kill()


def _spin() -> None:
    while True:
        pass


def main() -> None:
    """Measure and write down."""
    rows = []
    driver = started()
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name in JOINTS:
                for busy in (False, True):
                    load = os.getloadavg()[0]
                    taken, drawing = latencies(driver, Path(folder), name, busy)
                    row = {"scene": name, "half": busy, "pictures": len(taken), "of movements": MOVES}
                    shares = {f"{share} % ms": round(float(np.percentile(taken, share)), 1) for share in (50, 95, 100)}
                    parts = {"answer ms": round(answer_time(name), 1), "drawing ms": round(float(drawing), 1)}
                    rows.append({**row, **shares, **parts, "load": round(load, 1)})
                    print(rows[-1])
    finally:
        driver.quit()
    claim = "From the pointer to the picture: 50 ms at the 95th percentile for the four-bar, 100 for 13 bars."
    measuring.report("live_latency", claim, {"drags": rows})


if __name__ == "__main__":
    main()
