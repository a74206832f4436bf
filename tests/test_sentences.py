"""Tables and sentences of a report agree with the figures of the report."""

import pytest

import kinelast
from kinelast.figures.summary import report_of
from kinelast.runs import computed
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from tests.scene_texts import SLIDER_CRANK


def report_on(text):
    """Return the report on a scene."""
    return report_of(computed(scene_from_text(text), Request()))


@pytest.mark.parametrize(
    ("limits", "kind", "mode"),
    [
        ("safety = 1e4", "safety", "safety limit"),
        ("buckling = 1e-4", "buckling", "buckling limit"),
        ('output = "1 nm"', "output", "output"),
        ('output = "1 nm"\nsafety = 1e2', "output", "output"),
        ('deflection = "1 nm"\nlinks.rod.deflection = "0.1 nm"', "deflection", "deflection"),
    ],
)
def test_a_limit_that_is_not_kept_breaks_first(limits, kind, mode):
    steel = SLIDER_CRANK.replace("density = 7850", "density = 7850\nyield = 250e6")
    report = report_on(f"{steel}\n[limits]\n{limits}\n")
    broken = max((row for row in report.acceptance.limits if row.kind == kind), key=lambda row: row.used)
    assert broken.outcome == "not kept"
    first = report.breaks_first[0]
    assert first.governs == mode
    assert first.reserve.value == pytest.approx(1.0 / broken.used)
    assert first.reserve.error / first.reserve.value == pytest.approx(broken.found.error / broken.found.value)


def test_a_reserve_is_as_reliable_as_its_figure():
    """Load ratios of wings are far below 1 % and have large relative errors, which nobody needs to know better."""
    report = report_of(computed(kinelast.load("flapping_wing"), Request()))
    assert not report.reliability.unreliable
    reserves = [reserve for row in report.breaks_first for reserve in row.reserves.values()]
    assert any(reserve.error > 0.25 * reserve.value for reserve in reserves)
    assert not any(reserve.unreliable for reserve in reserves)
