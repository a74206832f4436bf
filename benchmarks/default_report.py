"""Time of a report relative to the mechanics alone: a batch of forty random four-bars, processor time of one process.

The mechanics of a scene are its motion and the quasi-static deflection of all fields at 360 positions.

    python benchmarks/default_report.py [NAME]
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import measuring
import numpy as np

from elastic import deflection
from kinelast.cli.command import main as command
from kinelast.scene.document import read_scene
from rigid import motion

SEED, COUNT, ROUNDS = 2026, 40, 3
SCENE = """
[materials.steel]
E = "210 GPa"
density = 7850
yield = "355 MPa"
[sections.bar]
shape = "rectangle"
depth = "{depth:.2f} mm"
width = "20 mm"
[points]
O = [0.0, 0.0]
A = [{crank:.5f}, 0.0]
B = [{x:.5f}, {y:.5f}]
C = [{base:.5f}, 0.0]
[links.ground]
points = ["O", "C"]
[links.crank]
points = ["O", "A"]
section = "bar"
material = "steel"
[links.coupler]
points = ["A", "B"]
section = "bar"
material = "steel"
[links.rocker]
points = ["C", "B"]
section = "bar"
material = "steel"
[[drives]]
link = "crank"
speed = "{speed:.2f} rad/s"
"""


def four_bars(folder: Path) -> Iterator[Path]:
    """Scene files of random crank-rockers: lengths, depths and speeds."""
    draw = np.random.default_rng(SEED)
    number = 0
    while number < COUNT:
        crank, coupler, rocker, base = draw.uniform([0.05, 0.2, 0.15, 0.2], [0.12, 0.4, 0.3, 0.4])
        shortest, longest = min(coupler, rocker, base, crank), max(coupler, rocker, base)
        apart = base - crank  # from A to C at the start
        along = (coupler**2 - rocker**2 + apart**2) / (2 * apart)
        if shortest < crank or crank + 1.1 * longest > coupler + rocker + base - longest or abs(along) >= coupler:
            continue
        depth, speed = draw.uniform(4, 20), draw.uniform(10, 100)
        x, y = crank + along, np.sqrt(coupler**2 - along**2)
        path = folder / f"four_bar_{number:02}.toml"
        path.write_text(SCENE.format(**locals()), encoding="utf-8")
        number += 1
        yield path


def main() -> None:
    """Measure and write the table."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        files = list(four_bars(folder))
        scenes = [read_scene(path) for path in files]

        def mechanics() -> None:
            for scene in scenes:
                drive = scene.course.at(scene.run.cycle * np.arange(360) / 360)
                deflection(motion(scene.mechanism, drive.drive, drive.drive_rate), scene.sections, scene.joints)

        def report(*options: str) -> Callable[[], object]:
            return lambda: command([*map(str, files), "--quiet", *options, "-o", str(folder / f"{next(numbers)}")])

        def least_seconds(call: Callable[[], object]) -> float:
            call()  # warm up
            return measuring.processor_seconds(call, ROUNDS)[0]

        numbers = count()
        unit = least_seconds(mechanics)

        rows = [{"work": "mechanics", "ms a scene": 1000 * unit / COUNT, "over mechanics": 1.0}]
        for name, options in (("quasi-static report", ("--theory", "quasi-static")), ("default report", ())):
            taken = least_seconds(report(*options))
            rows.append({"work": name, "ms a scene": 1000 * taken / COUNT, "over mechanics": taken / unit})
    name = sys.argv[1] if len(sys.argv) > 1 else "default_report"
    measuring.report(name, "A report over its mechanics", {"all": rows})


if __name__ == "__main__":
    main()
