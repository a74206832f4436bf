"""Every scene of the gallery runs, stays within its limits, and has the figures of docs/gallery.md."""

import json
import re
from pathlib import Path

import pytest
from tiers import in_tiers

from kinelast import read_scene
from kinelast.cli.command import main
from kinelast.runs import computed
from kinelast.tasks.request import Request

DOCS = Path(__file__).parents[1] / "docs"
SCENES = sorted((DOCS / "gallery").glob("*.toml"))
SECTION = re.compile(r"^### .*?\n(.*?)(?=^### |\Z)", re.DOTALL | re.MULTILINE)
DOCUMENTED = {
    "wiper": (("1.33 mm", 1e-3, "output.value"), ("94 %", 0.01, "shares.left_arm")),
    "jansen_leg": (("69 N", 1, "joints.B.upper"), ("0.50 mm", 1e-3, "output.value")),
    "klann_leg": (
        ("57 %", 0.01, "shares.connecting"),
        ("43 %", 0.01, "shares.leg"),
        ("1 %", 0.01, "shares.lower_rocker,upper_rocker", "below"),
    ),
    "toggle_press": (("102 N m", 1, "drives.crank"), ("3.6 kN", 1e3, "joints.A.rod")),
    "scissor_lift": (("20.8 kN", 1e3, "drives.rail"),),
    "excavator_arm": (("6.04 mm", 1e-3, "output.value"), ("61 %", 0.01, "shares.boom"), ("38 %", 0.01, "shares.stick")),
    "pick_and_place_arm": (("0.07 mm", 1e-3, "limits.residual"),),
    "needle_drive": (("292 N", 1, "shaking"),),
    "pantograph": (("0.24 mm", 1e-3, "output.value"), ("99 %", 0.01, "shares.right")),
    "peaucellier": (("17 µm", 1e-6, "output.value"), ("82 %", 0.01, "shares.crank")),
    "planetary_drive": (("5 N m", 1, "drives.sun"), ("500 N", 1, "joints.P.planet"), ("266 N", 1, "joints.O.sun")),
    "valve_train": (
        ("703 N", 1, "cams.inlet.cam_force"),
        ("80 N", 1, "cams.inlet.cam_least_force"),
        ("27 µm", 1e-6, "cams.inlet.cam_lag"),
    ),
    "quick_return": (("1.55", 1, "time_ratio"),),
}
"""Of each scene what its section says, the unit of that, and where the summary has it."""


def figure(summary, path):
    """Return a figure of a summary by a short path, without sign."""
    kind, *rest = path.split(".")
    if kind == "shares":
        shares = {share["link"]: share["value"] for share in summary["output"]["shares"]}
        return sum(shares[link] for link in rest[0].split(",")) / sum(shares.values())
    if kind == "joints":
        (joint,) = (joint for joint in summary["joints"] if [joint["joint"], joint["on"]] == rest)
        return joint["force"]["value"]
    if kind == "limits":
        (limit,) = (limit for limit in summary["acceptance"]["limits"] if limit["kind"] == rest[0])
        return limit["found"]["value"]
    if kind == "drives":
        return abs(summary["drives"][rest[0]]["effort"]["value"])
    if kind == "time_ratio":
        return summary["output"]["motion"]["time_ratio"]["value"]
    if kind == "cams":
        found = summary["cams"][rest[0]]["figures"][rest[1]]
    else:
        found = {"output": summary["output"], "shaking": summary["shaking"]["force"]}[kind]
    return abs(found["value"])


def section(name):
    """Return the paragraphs of docs/gallery.md about a scene."""
    (text,) = (
        part[1] for part in SECTION.finditer((DOCS / "gallery.md").read_text(encoding="utf-8")) if name in part[1]
    )
    return text


@pytest.mark.parametrize("name", in_tiers(DOCUMENTED, 0, 6))
def test_a_scene_is_acceptable_and_has_the_documented_figures(name, tmp_path):
    scene = DOCS / "gallery" / f"{name}.toml"
    assert main([str(scene) if scene.is_file() else name, "--quiet", "-o", str(tmp_path)]) == 0
    summary = json.loads((tmp_path / name / "summary.json").read_text(encoding="utf-8"))
    assert scene not in SCENES or summary["acceptance"]["verdict"] == "acceptable"
    assert summary["reliability"]["level"] != "poor"
    for printed, unit, path, *below in DOCUMENTED[name]:
        assert printed in section(name)
        digits = printed.split()[0]
        half = 0.5 * 10.0 ** -len(digits.partition(".")[2])
        value, said = figure(summary, path) / unit, float(digits)
        assert value < said if below else abs(value - said) <= 1.001 * half, (printed, value)


def test_loads_that_resist_at_dead_points_leave_the_errors_known():
    results = computed(read_scene(DOCS / "gallery" / "needle_drive.toml"), Request())
    assert results.error_unknown == ""
    assert len(results.scene.course.breaks.before) >= 2


def test_every_scene_of_the_gallery_is_documented():
    assert {scene.stem for scene in SCENES} | {"quick_return"} == set(DOCUMENTED)
    assert all(section(name) for name in DOCUMENTED)
