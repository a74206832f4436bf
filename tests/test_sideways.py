"""A link that may buckle normal to the plane of motion is found by Euler's load for its width."""

import math

import pytest
from scene_texts import STRUT, edited

from kinelast import scene_from_text
from kinelast.reports.limits import acceptance
from kinelast.reports.sideways import sideways_findings
from kinelast.runs import computed
from kinelast.tasks.request import Request

LIMITED = edited(STRUT, ("-2 kN", "-2.8 kN")) + "[limits]\nbuckling = 0.9\n"


def results_of(depth, width, force):
    bar = f'sections.bar = {{shape = "rectangle", depth = {depth}, width = {width}}}\n'
    edits = ('section = "rod"', 'section = "bar"'), ('"-2.8 kN"', f"{-force}")
    return computed(scene_from_text(bar + edited(LIMITED, *edits)), Request(positions=12))


@pytest.mark.parametrize(
    ("force", "level", "verdict"), [(200.0, "caution", "acceptable"), (1500.0, "poor", "cannot be judged")]
)
def test_a_flat_strut_on_its_edge(force, level, verdict):
    """Pinned: P = pi^2 E h b^3 / 12 / l^2 = 345 N; clamped: four times as much."""
    results = results_of(0.02, 0.004, force)
    (finding,) = sideways_findings(results)
    assert finding.level == level
    ratio = force / (math.pi**2 * 210e9 * 0.02 * 0.004**3 / 12 / 0.8**2)
    assert f"{ratio:.2g} times its Euler load in that direction" in finding.text
    assert f"{ratio / 4:.2g} times the critical load" in finding.text
    assert acceptance(results).verdict == verdict


def test_links_that_are_stiffer_sideways_or_pressed_little():
    assert not [*sideways_findings(results_of(0.01, 0.0105, 2600.0))]
    assert not [*sideways_findings(results_of(0.02, 0.004, 150.0))]
    assert not [*sideways_findings(computed(scene_from_text(LIMITED), Request(positions=12)))]


@pytest.mark.parametrize(
    ("name", "weak"),  # second moment of area about the weak axis [cm^4]: EN 10365, EN 10219-2, EN 10056-1
    [("IPE 100", 15.9), ("IPE 200", 142.0), ("HEA 100", 134.0), ("RHS 60x40x3", 13.4), ("UPE 80", 25.5),
     ("L 40x40x4", 1.86), ("L 60x40x5", 3.54)],
)  # fmt: skip
def test_the_weak_axis_of_library_sections(name, weak):
    scene = scene_from_text(edited(STRUT, ('section = "rod"', f'section = "{name}"')))
    sideways = {float(section.sideways) for section in scene.sections}
    assert min(abs(each * 1e8 / weak - 1.0) for each in sideways) < 0.03
