"""Write data/steel_four_bar.json: the common job in 50 digits, by the second solution that the tests use."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from jobs import SHEARED, SPEED, STEEL, steel_four_bar

from elastic import PRIMARY

POSITIONS, OF = range(0, 360, 30), 360
STATIONS = [k / 8 for k in range(9)] + [1 / 3, 2 / 3]  # the last two are no nodes of 2, 4, 8 ... elements
DATA = Path(__file__).parent / "data" / "steel_four_bar.json"


def main() -> None:
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from exact import exact

    job = steel_four_bar(OF)
    content = {"source": "tests/exact.py, 50 digits, rounded to the nearest float", "of": OF}
    content |= {"positions": list(POSITIONS), "stations": STATIONS}
    for theory, section in (("Euler-Bernoulli", STEEL), ("Timoshenko", SHEARED)):
        solved = [exact(job.mechanism, [section] * 3, [job.drive[k]], [SPEED], [0.0]) for k in POSITIONS]
        content[theory] = {field: [one.sampled(field, STATIONS).tolist() for one in solved] for field in PRIMARY}
    DATA.parent.mkdir(exist_ok=True)
    DATA.write_text(json.dumps(content) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
