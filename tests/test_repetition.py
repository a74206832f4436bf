"""Duration of the cycle of whole mechanisms, and its effect on answers."""

from math import isnan, pi

import numpy as np
import pytest
from answers_table import FEATURES
from nonlinear import nonlinear_steady_state
from scene_texts import FOUR_BAR, PARALLELOGRAM, edited

from elastic import sample
from kinelast.reports.trust import findings
from kinelast.runs import computed
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from rigid.analysis import common_period

REDUNDANT = FEATURES["redundant joints"]
TWO_CRANKS = edited(
    FOUR_BAR,
    ("D = [0.35, 0.0]", "D = [0.36, 0.0]\nC = [0.40, 0.0]"),
    ("D\", \"B", "C\", \"B"),
    ("[[drives]]", """[links.second]
points = ["D", "C"]
section = "bar"
material = "steel"

[[drives]]"""),
    ('speed = "100 rad/s"', 'speed = "40 rad/s"\n\n[[drives]]\nlink = "second"\nspeed = "60 rad/s"'),
    ("positions = 36", "positions = 480"),
)  # fmt: skip
# A massless handle at 20 rad/s drives both cranks by gears, so that one drive defines the cycle.
GEARED = edited(
    TWO_CRANKS,
    ("O = [0.0, 0.0]", "O = [0.0, 0.0]\nH = [0.0, 1.0]\nK = [0.0, 1.1]"),
    ('points = ["O", "D"]', 'points = ["O", "D", "H"]\n\n[links.handle]\npoints = ["H", "K"]\nrigid = true\nmass = 0'),
    (
        '[[drives]]\nlink = "crank"\nspeed = "40 rad/s"\n\n[[drives]]\nlink = "second"\nspeed = "60 rad/s"',
        "".join(f"""[[gears]]
driver = {{link = "handle"}}
follower = {{link = "{link}"}}
ratio = {ratio}
teeth = false
""" for link, ratio in (("crank", 2), ("second", 3))) + '[[drives]]\nlink = "handle"\nspeed = "20 rad/s"',
    ),
)  # fmt: skip


def run_of(*edits, text=TWO_CRANKS):
    return scene_from_text(edited(text, *edits)).run


def findings_of(results):
    return [finding for finding in findings(results) if finding.heading == "Cycle"]


@pytest.mark.parametrize(
    ("periods", "expected"),
    [
        ((1.0, 2 / 3), 2.0),
        ((0.7,), 0.7),
        ((6.0, 10.0, 15.0), 30.0),
        ((1.0, 1 / 32), 1.0),
        ((1.0, 1 / 33), None),
        ((1.0, 2**0.5), None),
        ((1.0, 1 / 3 * (1 + 1e-8)), None),
        ((1.0, 1 / 3 * (1 + 1e-12)), 1.0),
    ],
)
def test_a_common_period_is_the_least_common_multiple(periods, expected):
    period = common_period(periods)
    assert isnan(period) if expected is None else period == pytest.approx(expected, rel=1e-11)


def test_each_design_has_its_own_period():
    assert common_period([1.0, np.array([[2 / 3], [0.5]])]) == pytest.approx(np.array([[2.0], [1.0]]))


class TestRuns:
    """Duration of runs, and whether they are cycles."""

    def test_two_drives_close_after_two_turns_of_the_first(self):
        run = run_of()
        assert run.duration == pytest.approx(2 * 2 * pi / 40, rel=1e-12)
        assert run.turn
        times = scene_from_text(TWO_CRANKS).course.times()
        assert (len(times), times[-1]) == (480, pytest.approx(run.duration * 479 / 480))

    def test_as_rpm(self):
        run = run_of(("40 rad/s", "1000 rpm"), ("60 rad/s", "-1450 rpm"))
        assert (run.duration, run.turn) == (pytest.approx(20 * 0.06), True)

    def test_speeds_without_a_common_period(self):
        run = run_of(("60 rad/s", "60.01 rad/s"))
        assert (run.duration, run.turn) == (pytest.approx(2 * pi / 40), False)
        assert "no common period" in run.no_cycle

    def test_a_duration_of_one_cycle_is_the_cycle(self):
        steady = ('speed = "100 rad/s"', 'speed = "3000 rpm"')
        for duration, turn in (("20 ms", True), ("19.99 ms", False), ("40 ms", False)):
            run = run_of(steady, ("[run]", f'[run]\nduration = "{duration}"'), text=FOUR_BAR)
            assert run.turn is turn
            assert run.cycle == pytest.approx(0.02)

    def test_a_repeated_quarter_turn_closes_after_four_repetitions(self):
        law = 'law = [{curve = "cycloidal", duration = 1, by = "90 deg"}]\nrepeat = true'
        run = run_of(('speed = "100 rad/s"', law), text=FOUR_BAR)
        assert (run.duration, run.turn) == (4.0, True)

    def test_gears_multiply_the_turns_of_their_driver(self):
        mesh = '[[gears]]\ndriver = {link = "crank"}\nfollower = {link = "wheel"}\nratio = 0.4\n[[drives]]'
        wheel = ('[links.ground]\npoints = ["O", "D"]', '[links.ground]\npoints = ["O", "D", "H"]')
        points = ("O = [0.0, 0.0]", "O = [0.0, 0.0]\nH = [0.0, 1.0]\nK = [0.0, 1.1]")
        link = ("[links.crank]", '[links.wheel]\npoints = ["H", "K"]\nrigid = true\nmass = 0\n\n[links.crank]')
        run = run_of(wheel, points, link, ("[[drives]]", mesh), text=FOUR_BAR)
        assert (run.duration, run.turn) == (pytest.approx(5 * 2 * pi / 100), True)
        run = run_of(wheel, points, link, ("[[drives]]", mesh.replace("0.4", "0.4142")), text=FOUR_BAR)
        assert (run.duration, run.turn) == (pytest.approx(2 * pi / 100), False)
        assert "do not return to the start within 32" in run.no_cycle

    def test_a_drive_that_stops_or_slides_on_has_no_cycle(self):
        law = 'law = [{curve = "cycloidal", duration = 1, by = "90 deg"}]'
        run = run_of(('speed = "60 rad/s"', law))
        assert (run.duration, run.turn) == (pytest.approx(2 * pi / 40), False)
        assert "is not repeated" in run.no_cycle

    def test_a_parallelogram_closes_after_one_turn(self):
        run = run_of(text=PARALLELOGRAM)
        assert (run.duration, run.turn) == (pytest.approx(2 * pi / 10), True)


class TestFewPositions:
    """A cycle stays a cycle for any number of positions."""

    law = "motion = [[0, 0.6], [0.1, 0.9], [0.2, 1.2], [0.3, 0.9], [0.4, 0.6]]\nrepeat = true"

    def test_the_period_is_that_of_the_run(self):
        text = edited(FOUR_BAR, ('speed = "100 rad/s"', self.law), ("positions = 36", "positions = 12"))
        assert computed(scene_from_text(text), Request(theory="quasi-static")).period == 0.4

    @pytest.mark.slow
    def test_redundant_joints_agree_with_the_nonlinear_mechanism(self):
        """A parallelogram on three cranks: the force method agrees with constraints between elements."""
        scene = scene_from_text(REDUNDANT)
        found = computed(scene, Request(theory="elastodynamic"))
        assert any(closed.redundancy for closed in found.motion.closures)
        course, damping = scene.course, found.answer.vibrating.damping.beams
        whole = nonlinear_steady_state(
            scene.mechanism, scene.sections, course.laws, course.period, 192, 8, damping=damping
        )
        for field, limit in (("chord", 1e-3), ("M", 1e-3), ("N", 3e-3)):
            expected = getattr(whole, field)[:, ::16]
            apart = np.abs(sample(found.deflection, field, whole.xi) - expected).max(axis=(1, 2))
            assert (apart < limit * np.abs(expected).max(axis=(1, 2))).all(), field


class TestCautions:
    """Cautions of the command about unusual durations and loads."""

    def about(self, text, *edits):
        results = computed(scene_from_text(edited(text, *edits)), Request(theory="quasi-static"))
        return [(each.level, each.text) for each in findings(results) if "ycle" in each.heading]

    def test_a_duration_of_one_turn_that_is_not_the_cycle(self):
        one = ("positions = 480", "positions = 12\nduration = 0.15707963267948966")
        ((level, words),) = self.about(TWO_CRANKS, one)
        assert level == "caution"
        assert "1/2 of a cycle of 314.2 ms" in words

    def test_a_duration_of_several_cycles(self):
        ((level, words),) = self.about(FOUR_BAR, ('"100 rad/s"', '"3000 rpm"'), ("[run]", '[run]\nduration = "60 ms"'))
        assert (level, "is 3 cycles of 20 ms" in words) == ("open", True)

    @pytest.mark.parametrize(("last", "jumps"), [(1, False), (0.25, True)])
    def test_a_load_that_jumps_at_the_end_of_the_cycle(self, last, jumps):
        load = f'[[loads]]\nlink = "rocker"\npoint = "B"\nforce = [1, 0]\ntable = [[0, 1], [0.03, 2], [0.1, {last}]]\n'
        findings_of = self.about(FOUR_BAR, ("[run]", load + "[run]"), ('"100 rad/s"', '"600 rpm"'))
        assert (
            any("ends the cycle at 0.25 times its size and begins the next at 1" in words for _, words in findings_of)
            is jumps
        )


class TestAnswers:
    """Vibration over the cycle of the whole mechanism."""

    @pytest.mark.slow
    def test_the_cycle_equals_a_turn_of_a_slower_drive(self):
        request = Request(theory="elastodynamic", checks=(4,))
        both = [computed(scene_from_text(text), request) for text in (TWO_CRANKS, GEARED)]
        for name in ("deflection", "stress"):
            largest = [[peak.value for peak in results.figures.peaks[name]] for results in both]
            assert largest[0] == pytest.approx(largest[1], rel=1e-3)
        assert all(balance.passed for balance in both[0].balances.values())
        assert len(both[0].balances) == 2
        assert findings_of(both[0])[0].level == "good"
        assert both[0].motion.time == pytest.approx(both[1].motion.time)

    def test_a_missing_cycle_is_reported(self):
        scene = scene_from_text(edited(TWO_CRANKS, ("60 rad/s", "60.01 rad/s"), ("= 480", "= 20")))
        results = computed(scene, Request(theory="quasi-static"))
        assert isnan(results.period)
        finding = findings_of(results)[0]
        assert finding.level == "caution"
        assert "how large they become later is not known" in finding.text

    def test_a_duration_close_to_the_cycle_is_reported(self):
        scene = scene_from_text(edited(FOUR_BAR, ("[run]", '[run]\nduration = "62.83 ms"')))
        finding = findings_of(computed(scene, Request(theory="quasi-static")))[0]
        assert "omit the duration" in finding.text

    @pytest.mark.slow
    def test_against_the_nonlinear_check(self):
        results = computed(scene_from_text(TWO_CRANKS), Request(accuracy=0.005, checks=("nonlinear",)))
        assert results.nonlinear.largest < 0.01
