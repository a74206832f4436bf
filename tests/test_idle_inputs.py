"""Loads and limits that cannot have an effect are named."""

import pytest
from scene_texts import ARM, edited

from kinelast import scene_from_text
from kinelast.reports.limits import acceptance
from kinelast.reports.trust import findings
from kinelast.runs import computed
from kinelast.tasks.request import Request

LOAD = '[[loads]]\nlink = "arm"\npoint = "A"\nforce = [0.0, "1 N"]\n'
RADIAL = '[[loads]]\nlink = "arm"\npoint = "A"\nforce = ["1 N", 0.0]\naxes = "turning"\nresists = "both ways"\n'
SHOE = edited(
    ARM,
    ("[[drives]]", '[sliders.shoe]\nlink = "arm"\nthrough = "O"\ndirection = "0 deg"\n[[drives]]'),
    ('link = "arm"\nspeed = 50.0', 'slider = "shoe"\nspeed = 0.1'),
    ("[run]", '[run]\nduration = "0.1 s"'),
    ('[links.ground]\npoints = ["O"]', '[links.ground]\npoints = ["R"]'),
    ("A = [0.2, 0]", "A = [0.2, 0]\nR = [0.5, 0]"),
)


@pytest.mark.parametrize(
    ("load", "why"),
    [
        (LOAD + 'table = [[0.0, 0.0], [0.2, 0.0], [0.4, 1.0]]\nextend = "hold"\n', "its table gives 0 there"),
        (RADIAL, "its point never moves against or along its force"),
    ],
)
def test_a_load_that_never_acts_is_named(load, why):
    results = computed(scene_from_text(ARM + load), Request())
    (finding,) = (each for each in findings(results) if each.heading == "Load")
    assert finding.level == "caution"
    assert finding.text == f'The load on "arm" at "A" is zero at all positions, because {why}.'


PULSE = LOAD + "table = [[0.0, 0], [0.0201, 0], [0.0201, 1], [0.0203, 1], [0.0203, 0], [0.2, 0]]\n"


@pytest.mark.parametrize("load", ["", LOAD, LOAD.replace("1 N", "0 N"), PULSE])
def test_a_load_that_acts_or_is_zero_is_not_named(load):
    results = computed(scene_from_text(ARM + load), Request())
    assert not [each for each in findings(results) if each.heading == "Load"]


def test_a_ratio_to_the_speed_of_a_drive_that_slides_cannot_be_judged():
    verdict = acceptance(
        computed(scene_from_text(SHOE + "[limits.figures]\nfrequency_ratio = {least = 1.2}\n"), Request())
    )
    assert verdict.verdict == "cannot be judged"
    assert verdict.problem == "frequency_ratio is infinite, because no drive rotates"
