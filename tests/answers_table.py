"""Table of docs/answers.md: features that an analysis refuses, each pair tried by the command.

`python tests/answers_table.py` writes the table.
"""

import contextlib
import io
import re
import tempfile
from pathlib import Path

from scene_texts import FOUR_BAR, SLIDER_CRANK, TEE, edited, linked

from kinelast.cli.command import main

PAGE = Path(__file__).resolve().parents[1] / "docs" / "answers.md"
MARK = "<!-- answers -->\n"
EVERYWHERE = "Every analysis accepts: "
NUMBER = re.compile(r'\d[\d.]*(e-?\d+)?|"[^"]*"')  # numbers and names

BARS = edited(FOUR_BAR, ("100 rad/s", "20 rad/s"), ("positions = 36", "positions = 12"))
CRANK = edited(
    SLIDER_CRANK,
    ("density = 7850", "density = 7850\npoisson = 0.3"),
    ("speed = 100", "speed = 20"),
    ("positions = 36", "positions = 12"),
)
LOAD = '[[loads]]\nlink = "block"\npoint = "B"\nforce = [-20, 0]\n'
SPRING = '[[springs]]\nlink = "rocker"\npoint = "B"\nanchor = "O"\nlength = 0.3\n'
# Crank pin in a slot of a rocker.
SLOTTED = """
materials.steel = {E = 210e9, poisson = 0.3, density = 7850}
sections.bar = {shape = "rectangle", depth = "8 mm", width = "10 mm"}
points = {C = [0, 0], O = [0, 0.3], A = [0.0, 0.35], D = [0.0, 0.5]}
links.ground.points = ["C", "O"]
links.crank = {points = ["O", "A"], section = "bar", material = "steel"}
links.rocker = {points = ["C", "D"], section = "bar", material = "steel"}
slots.slot = {point = "A", link = "crank", on = "rocker", direction = [0, 1]}
[[drives]]
link = "crank"
speed = 10
[run]
positions = 12
"""
ARM = """
materials.steel = {E = 210e9, poisson = 0.3, density = 7850}
sections.bar = {shape = "rectangle", depth = "8 mm", width = "10 mm"}
points = {O = [0, 0], A = [0.2, 0], B = [0.4, 0]}
links.ground.points = ["O"]
[[drives]]
link = "upper"
speed = 10
[[drives]]
link = "fore"
on = "upper"
speed = 5
[run]
positions = 12
""" + linked('section = "bar"\nmaterial = "steel"', upper="OA", fore="AB")
WHEELS = """
materials.steel = {E = 210e9, poisson = 0.3, density = 7850}
sections.bar = {shape = "rectangle", depth = "8 mm", width = "10 mm"}
points = {O = [0, 0], D = [0.3, 0], A = [0.1, 0], B = [0.4, 0]}
links.ground.points = ["O", "D"]
[[drives]]
link = "first"
speed = 10
[[gears]]
driver = {link = "first"}
follower = {link = "second"}
ratio = -1
[run]
positions = 12
gravity = [0, -9.81]
""" + linked('section = "bar"\nmaterial = "steel"', first="OA", second="DB")
# Planet on an arm around a fixed sun.
PLANET = edited(
    WHEELS,
    ('points = ["O", "D"]', 'points = ["O"]'),
    ("D = [0.3, 0], ", ""),
    ("B = [0.4, 0]", "B = [0.2, 0]"),
    ("points = ['D', 'B']", "points = ['A', 'B']"),
    ("ratio = -1", "ratio = 2"),
    ("[0, -9.81]", "[1, -9.81]"),
    ('follower = {link = "second"}', 'follower = {link = "second", on = "first"}'),
)

FLAT = edited(
    BARS,
    ("A = [0.1, 0.0]", "A = [0.06, 0.08]"),
    ("B = [0.28, 0.24]", "B = [0.36, 0.08]"),
    ("D = [0.35, 0.0]", "D = [0.3, 0.0]"),
    ('speed = "20', 'start = 0.0\nspeed = "20'),
)

FEATURES = {
    "one beam per link": BARS,
    "several beams per link": edited(BARS, ('["A", "B"]\n', '["A", "P", "B"]\nmasses = {P = 0.1}\n')),
    "a ring of beams": edited(
        BARS, ('points = ["A", "B"]\n', 'points = ["A", "P", "B"]\nbeams = [["A", "P"], ["P", "B"], ["A", "B"]]\n')
    ),
    "a taper": edited(BARS, ('depth = "6 mm"', 'depth = ["8 mm", "6 mm"]')),
    "a compliant joint": BARS + "[joints.B]\ncompliance = 1e-7\n",
    "a misfit": BARS + "[joints.B]\ngap = [1e-4, 0]\n",
    "a spring": BARS + SPRING + "stiffness = 100\n",
    "a dashpot": BARS + SPRING + "damping = 1\n",
    "a weld": edited(BARS, ('["A", "B"]\n', '["A", "P"]\n'))
    + linked('section = "bar"\nmaterial = "steel"', arm="PB")
    + "[welds.P]\n",
    "a gear": WHEELS,
    "a gear on a moving carrier": PLANET,
    "a slider on the ground": CRANK,
    "a slot in a rigid link": edited(SLOTTED, ('["C", "D"], section', '["C", "D"], rigid = true, section')),
    "a slot in an elastic link": SLOTTED,
    "a slot over several beams": edited(TEE, ("density = 7850", "density = 7850\npoisson = 0.3")),
    "Coulomb friction at a pin": BARS + '[joints.B]\nfriction = 0.1\nradius = "5 mm"\n',
    "Coulomb friction of a slider": CRANK + "[joints.guide]\nfriction = 0.1\n",
    "viscous friction": BARS + "[joints.B]\nviscosity = 1e-3\n",
    "friction that may lock": CRANK + "[joints.guide]\nfriction = 5\n",
    "a load as a function of time": CRANK + LOAD + "table = [[0, 0], [0.1, 1], [0.35, 0]]\n",
    "a load as a function of travel": CRANK + LOAD + 'table = [[-1, 0], [1, 1]]\nagainst = {slider = "guide"}\n',
    "a load that resists": CRANK + LOAD + 'resists = "one way"\n',
    "several drives in an open chain": ARM,
    "a drive by effort": edited(CRANK, ("speed = 20", "effort = 0.1\nspeed = 20"), ("[run]", "[run]\nduration = 0.1")),
    "redundant joints": edited(
        FLAT,
        ("P = [0.2, 0.25]", "P = [0.2, 0.25]\nE = [0.15, -0.1]\nF = [0.21, -0.02]"),
        ('["O", "D"]', '["O", "D", "E"]'),
        ('["A", "B"]', '["A", "B", "F"]\nbeams = [["A", "B"], ["A", "F"]]'),
        (
            'start = 0.0\nspeed = "20 rad/s"',
            "motion = [[0, 0.6], [0.1, 0.9], [0.2, 1.2], [0.3, 0.9], [0.4, 0.6]]\nrepeat = true",
        ),
    )
    + linked('section = "bar"\nmaterial = "steel"', third="EF"),
    "singular positions": FLAT,
}

ANSWERS = {
    "quasi-static": ["--theory", "quasi-static"],
    "vibrating": ["--theory", "elastodynamic"],
    "exact": ["--theory", "geometrically-exact"],
    "transient": ["--theory", "elastodynamic"],
    "speeds": ["--theory", "elastodynamic", "--speeds", "10 rad/s : 12 rad/s : 2"],
    "check": ["--theory", "quasi-static", "--check", "4"],
    "nonlinear check": ["--theory", "elastodynamic", "--check", "nonlinear"],
    "solid check": ["--theory", "quasi-static", "--check", "solid"],
    "sweep": ["--theory", "quasi-static", "--sweep"],
    "optimum": ["--theory", "quasi-static", "--optimize"],
    "film": ["--theory", "quasi-static", "--animate", "deflection", "--frames", "1", "--format=png", "--size=160x160"],
}
MORE = {
    "sweep": '\n[sweep]\nfigures = ["deflection"]\n[sweep.vary]\n"sections.bar.{size}" = [0.008, 0.009]\n',
    "optimum": '\n[optimize]\nminimize = "deflection"\n[optimize.variables]\n"sections.bar.{size}" = [0.008, 0.009]\n',
}


def scene_of(text: str, answer: str) -> str:
    """Return the scene of a cell."""
    if answer == "transient" and "duration" not in text:
        return text.replace("[run]\n", "[run]\nduration = 0.1\n")
    return text + MORE.get(answer, "").replace("{size}", "diameter" if "diameter" in text else "width")


def cell(text: str, answer: str) -> str:
    """Return the command's reason for a missing answer, or ""."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(scene_of(text, answer))
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            status = main([str(path), *ANSWERS[answer], "-o", str(Path(folder) / "out")])
    return reason(printed.getvalue().replace(str(path), "scene"), status)


def reason(text: str, status: int) -> str:
    """Return the reason for a refusal or an impossible check, or ""."""
    found = re.search(r"CANNOT BE MADE: (.*?)(;| ->|$)", text, re.MULTILINE)
    if found:
        return found[1]
    if "check FAILED" in text:
        return "the check is made, and fails"
    if status in (2, 3):
        return text.strip().splitlines()[-1]
    return ""


def table(cells: dict[tuple[str, str], str]) -> str:
    """Return the features that every analysis accepts, and the table of refusals, in Markdown."""
    rows: dict[tuple[str, str], list[str]] = {}
    for (feature, answer), why in cells.items():
        if why:
            rows.setdefault((feature, NUMBER.sub("...", why)), []).append(answer)
    refused = {feature for feature, _ in rows}
    everywhere = [feature for feature in FEATURES if feature not in refused]
    lines = [f"{EVERYWHERE}{'; '.join(everywhere)}.", "", "| feature | refused by | reason |", "|---|---|---|"]
    merged: dict[tuple[str, str], list[str]] = {}
    for (feature, why), answers in rows.items():
        merged.setdefault((", ".join(answers), why), []).append(feature)
    lines += [f"| {'; '.join(features)} | {answers} | {why} |" for (answers, why), features in merged.items()]
    return "\n".join([*lines, ""])


def cells() -> dict[tuple[str, str], str]:
    """Return all cells of the table."""
    return {(feature, answer): cell(text, answer) for feature, text in FEATURES.items() for answer in ANSWERS}


if __name__ == "__main__":
    PAGE.write_text(PAGE.read_text().split(MARK)[0] + MARK + "\n" + table(cells()))
