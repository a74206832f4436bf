"""Four machines drawn from the empty sheet of the live editor in a real browser, answered, saved and reported.

`python benchmarks/live_drawn.py` draws them in a headless Chromium and writes `results/live_drawn.*`: presses of the
mouse (drags among them), letters typed, the seconds that the script took, answers and report among them, and those of
a person by the keystroke-level model (Card, Moran and Newell 1980), thinking before every press. `python
benchmarks/live_drawn.py FOLDER` keeps a picture of every page, of its report, and the files.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import measuring

from live.edit import EMPTY

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from browser import started
from live_machines import MACHINES, Maker
from live_page import Hand, editing


def main(folder: Path, keeps: bool) -> None:
    """Draw and write down."""
    rows = []
    driver = started()
    try:
        for name, draw in MACHINES.items():
            path = folder / f"{name.replace(' ', '_')}.toml"
            path.write_text(EMPTY, encoding="utf-8")
            with editing(path) as live:
                maker = Maker(Hand(driver, live.address))
                began = time.perf_counter()
                draw(maker)
                address = maker.done()
                if keeps:
                    driver.save_screenshot(str(path.with_suffix(".png")))
                driver.get(address)
                maker.hand.until("return document.body.dataset.ready")
                taken = time.perf_counter() - began
                if keeps:
                    driver.save_screenshot(str(path.with_suffix(".report.png")))
            counted = {"presses": maker.presses, "of them drags": maker.drags, "letters": maker.letters}
            told = {"script s": round(taken, 1), "a person s": round(maker.seconds)}
            rows.append({"machine": name, **counted, **told})
            print(rows[-1])
    finally:
        driver.quit()
    measuring.report("live_drawn", "Four machines from the empty sheet, answered, saved and reported.", {"drawn": rows})


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]), True)
    else:
        with tempfile.TemporaryDirectory() as place:
            main(Path(place), False)
