"""Searches over speed find resonances, limits and instability for any requested speeds."""

import math
from collections import Counter

import msgspec
import numpy as np
import pytest
from msgspec.structs import astuple, replace
from scene_texts import ARM, CRANK_ROCKER, FOUR_BAR, SLIDER_CRANK, edited
from tiers import in_tiers

from elastic.elastodynamics import Resonance, SpeedSearch, SpeedSolutions, prominences
from elastic.elastodynamics.speed_scan import Scan
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.time_elements import Equations, periodic_amplitudes, propagation
from elastic.elastodynamics.time_grid import Grid
from kinelast.answers.bounds import damping_of
from kinelast.answers.refusals import STRENGTH
from kinelast.answers.results import results_in_full
from kinelast.figures.cycle import Cycle
from kinelast.figures.measures import measures_of
from kinelast.figures.registry import figures_of, limits_of
from kinelast.outputs.speeds import _words, limit_words, speed_figures
from kinelast.scene.document import read_scene, scene_from_text
from kinelast.speed_study.speed_limits import SpeedLimit
from kinelast.speed_study.speeds import FIGURE_OF_FIELD, SpeedPeak, Speeds, _SearchProgress, speeds
from kinelast.tasks.progress import Progress
from kinelast.tasks.task import shipped_scenes
from kinelast.values.error import SceneError

# A drawn four-bar with little damping; its 5th harmonic meets the first mode near 455 rad/s.
LIGHTLY_DAMPED = """
materials.mat = {E = 60e9, density = 1600.0, poisson = 0.3, yield = 400e6}
joints = {B = {compliance = 1.1870552791496915e-08}, O = {rotation = 1.858867606023162e-06}}
[sections]
s1 = {shape = "rectangle", depth = 0.042070171022850086, width = 0.07324412431296219}
s2 = {shape = "rectangle", depth = 0.030273085872834084, width = 0.03564507905024141}
s3 = {shape = "rectangle", depth = 0.024473043687584746, width = 0.03138166831887945}
[points]
O = [0.0, 0.0]
D = [0.5411526036571485, 0.1698535167814403]
A = [-0.14160596311766793, -0.0031836815122669765]
B = [0.15421149903049158, 0.3477448269778625]
[links]
ground = {points = ["O", "D"]}
crank = {points = ["O", "A"], section = "s1", material = "mat"}
coupler = {points = ["A", "B"], section = "s2", material = "mat"}
rocker = {points = ["D", "B"], section = "s3", material = "mat"}
[[drives]]
link = "crank"
speed = 501.41251043566666
[run]
damping_ratio = 0.002
"""
TWO_CRANKS = (
    shipped_scenes()["steel_four_bar"].read_text().replace('points = ["D", "B"]', 'points = ["C", "B"]')
    .replace('speed = "100 rad/s"', "speed = {}").replace("D = [0.35, 0.0]", "D = [0.35, 0.0]\nC = [0.4, 0.0]")
    + """
[links.second]
points = ["D", "C"]
section = "bar"
material = "steel"
[[drives]]
link = "second"
speed = {}
"""
)  # fmt: skip
MOTOR = 'motor = "servo"\n[motors]\nservo = {top_speed = "5000 rpm", rated_speed = "5000 rpm", gear_ratio = 15}\n'
RPM = math.pi / 30  # [rad/s]
CHORD = '[limits]\nchord = "29.1775 mm"\n'


def rpm(speed):
    """Return the words for a speed [rad/s]."""
    return f"{speed / RPM:.4g} rpm"


def answers_of(scene):
    """Return answers of a scene at several speeds, and their curves: w, chord and stress of each beam."""

    def measure(bent, _):
        cycle = Cycle(scene, bent.motion, bent, wanted=frozenset(FIGURE_OF_FIELD), period=bent.motion.time[:, -1])
        return np.concatenate([cycle.along(field).value for field in FIGURE_OF_FIELD])

    found = SpeedSolutions(
        scene.course.at, scene.run.cycle, scene.sections, measure, scene.joints, damping_of(scene)
    )  # fmt: skip
    return found, lambda known: known.values.T.reshape(len(FIGURE_OF_FIELD), len(scene.labels), -1)


class TestLimitSpeed:
    @pytest.mark.parametrize("requested", in_tiers([((430.0, 470.0, 2),), ((440.0, 480.0, 4),)], 0, 1))
    def test_the_limit_speed_does_not_depend_on_the_requested_speeds(self, requested):
        """Single answers, with their errors, keep the limit at 454.3 and break it at 454.9 rad/s, and keep it again."""
        text = (LIGHTLY_DAMPED + CHORD).replace(", yield = 400e6", "")
        found = speeds(scene_from_text(text), requested)
        assert 452.5 < found.highest < found.limit.above < 454.9
        assert found.limit.above / found.highest - 1 <= 2 * SPEEDS.limit_accuracy
        assert found.asked.sum() == requested[2]
        assert found.map.values[:, 1].max() > 0.038, "the peak beyond the limit is known too"
        _, chord, error = found.figures["chord"]
        beside = np.searchsorted(found.speed, [found.highest, found.limit.above])
        judged = chord + 2.0 * error  # an error beyond 25 % counts twice
        assert np.all(judged[beside] > 29.1775e-3 * np.array([0.7, 1.0]))
        assert [found.verdicts[at] for at in beside] == ["acceptable", "too close to decide"]
        assert found.limit.broken == math.inf, "at the peak, large displacement leaves nothing to tell"
        figures = speed_figures(found, scene_from_text(LIGHTLY_DAMPED + CHORD))
        expected = "(rocker, deflection from the chord: 5th harmonic meets the 1st mode (mostly rocker))"
        assert figures["words"][0].startswith(
            f"all limits hold up to {found.highest:.4g} rad/s {expected}; above it too close to decide"
        )

    @pytest.mark.slow
    def test_errors_of_a_speed_equal_those_of_its_report(self):
        """The errors are by time, coordinates, large displacement and beam theory."""
        text = shipped_scenes()["steel_four_bar"].read_text()
        found = speeds(scene_from_text(text), (60.0, 90.0, 2))
        scene = scene_from_text(
            text.replace('accuracy = "5 %"', 'theory = "elastodynamic"').replace("100 rad/s", "90 rad/s")
        )
        peaks = results_in_full(scene).figures.peaks
        for key in ("deflection", "stress", "output_error", "shaking_force", "V.coupler", "M.coupler", "phi.rocker"):
            figure, _, label = key.partition(".")
            of = peaks[figure][scene.labels.index(label)] if label else max(peaks[figure], key=lambda p: abs(p.value))
            _, values, errors = found.figures[key]
            assert values[-1] == pytest.approx(abs(of.value), rel=0.01), key
            assert errors[-1] == pytest.approx(of.error.size, rel=0.5), key

    def test_an_unknown_figure_does_not_make_the_error_unknown(self):
        """Sections given by rigidities have no stress."""
        found = speeds(read_scene(shipped_scenes()["utenov_four_bar"]), (0.9, 1.0, 2))
        assert np.isnan(found.figures["stress"][1]).all()
        assert np.all(found.error < 0.01)

    @pytest.mark.parametrize(("bound", "highest"), in_tiers([("1 m", 40.0), ("1 nm", 0.0)], 1, 1))
    def test_limits_can_hold_everywhere_or_nowhere(self, bound, highest):
        found = speeds(scene_from_text(FOUR_BAR + f'[limits]\nchord = "{bound}"\n'), (20.0, 40.0, 2))
        assert found.highest == highest
        assert (found.limit is None) == bool(highest)

    @pytest.mark.slow
    def test_without_vibration_figures_scale_with_the_square_of_the_speed(self):
        """Far below resonance only inertia counts: a limit of four times a value is at twice the speed."""
        slow = 2.0
        weightless = shipped_scenes()["steel_four_bar"].read_text()
        chord = speeds(scene_from_text(weightless), (slow, 1.5 * slow, 2)).map.values[0, 1].max()
        found = speeds(scene_from_text(weightless + f"[limits]\nchord = {4 * chord}\n"), (slow, 3 * slow, 2))
        assert found.highest == pytest.approx(2 * slow, rel=4e-3)
        assert found.limit.resonance is None


class TestYield:
    """The deflection of the rocker reaches its limit near 530 rpm; before, the crank yields."""

    @pytest.mark.parametrize("requested", [(100.0, 950.0, 5), (300.0, 500.0, 2)])
    def test_limits_hold_up_to_the_speed_at_which_a_link_yields(self, requested):
        """Without vibration, the crank yields at 460 rpm."""
        scene = scene_from_text(CRANK_ROCKER)
        found = speeds(scene, (requested[0] * RPM, requested[1] * RPM, requested[2]))
        assert found.highest / RPM == pytest.approx(453, rel=2e-3)
        assert found.yielding == (found.limit.broken, 0)
        beside = np.searchsorted(found.speed, [found.highest, found.limit.broken])
        safety = found.figures["safety"][1]
        assert 1.0 < safety[beside[0]] < 1.005
        assert 0.995 < safety[beside[1]] < 1.0
        assert [found.verdicts[at] for at in beside] == ["acceptable", "cannot be judged"]
        limits, yields = _words(found, scene)
        assert limits == f"all limits hold up to {rpm(found.highest)} (crank yields)"
        rows = Counter(verdict for verdict, least in zip(found.verdicts, safety, strict=True) if least < 1.0)
        assert yields == (
            f"a link yields at {rows.total()} of {len(found.speed)} speeds, from {rpm(found.limit.broken)} (crank) on: "
            f"{', '.join(f'{count} {verdict}' for verdict, count in rows.items())}"
        )

    def test_the_report_at_this_speed_has_a_safety_of_one(self):
        speed = speeds(scene_from_text(CRANK_ROCKER), (300 * RPM, 500 * RPM, 2)).yielding[0]
        edits = ("[run]", '[run]\ntheory = "elastodynamic"'), ('"200 rpm"', str(speed))
        peaks = results_in_full(scene_from_text(edited(CRANK_ROCKER, *edits))).figures.peaks["safety"]
        assert peaks[0].value == pytest.approx(1.0, rel=0.01)

    @pytest.mark.parametrize("requested", [(500.0, 900.0), (470.0, 480.0)])
    def test_a_link_that_yields_at_all_speeds(self, requested):
        """At 500 rpm, the deflection is below its limit."""
        scene = scene_from_text(CRANK_ROCKER)
        found = speeds(scene, (requested[0] * RPM, requested[1] * RPM, 2))
        assert found.highest == 0.0
        lowest, yields = _words(found, scene)
        first = rpm(found.speed[0])
        assert lowest == f"limits cannot be judged at the lowest speed, {first} (crank yields)"
        assert f"from {first} (crank) on" in yields

    def test_where_a_link_yields_is_found_without_limits_too(self):
        scene = scene_from_text(edited(CRANK_ROCKER, ("[limits]\ndeflection = 0.2e-3", "")))
        found = speeds(scene, (300 * RPM, 900 * RPM, 2))
        assert found.yielding[0] / RPM == pytest.approx(453, rel=2e-3)
        assert [*_words(found, scene)][1:] == [
            f"a link yields at 2 of {len(found.speed)} speeds, from {rpm(found.yielding[0])} (crank) on"
        ]

    def test_a_limit_below_the_speed_of_yield_sets_the_limit_speed(self):
        scene = scene_from_text(edited(CRANK_ROCKER, ("0.2e-3", "0.1e-3")))
        found = speeds(scene, (100 * RPM, 950 * RPM, 3))
        assert found.limit.limit.figure == "deflection"
        assert found.limit.above < found.limit.broken < found.yielding[0]
        assert found.yielding[0] / RPM == pytest.approx(453, rel=2e-3)


class TestRigidMotion:
    def test_limits_on_figures_of_the_rigid_motion_are_judged(self):
        """The motor turns 15 times as fast as the crank."""
        scene = scene_from_text(edited(CRANK_ROCKER, ('"200 rpm"', f'"200 rpm"\n{MOTOR}')))
        found = speeds(scene, (100 * RPM, 950 * RPM, 3))
        for name in ("motor_speed", "motor_mean_speed", "inertia_ratio", "transmission_angle", "condition"):
            _, values, errors = found.figures[name]
            assert np.all(errors[np.isfinite(values)] <= 2e-3 * values[np.isfinite(values)]), name
        assert 0.997 * 5000 / 15 < found.highest / RPM <= 5000 / 15
        assert found.limit.limit.figure in ("motor_speed", "motor_mean_speed")
        assert found.verdicts[0] == "acceptable"

    def test_the_error_is_that_of_the_positions_of_the_map(self):
        scene = scene_from_text(CRANK_ROCKER)
        found = speeds(scene, (100 * RPM, 950 * RPM, 3))
        for name in ("transmission_angle", "load_inertia", "condition"):
            (exact,), (_, values, errors) = results_in_full(scene).figures.peaks[name], found.figures[name]
            assert np.all(np.abs(values - exact.value) <= errors + exact.error_size), name
            assert np.all(errors > 0.0), name


def test_a_limit_that_cannot_be_judged_has_its_reason():
    """The error of the figure is unknown."""
    scene = scene_from_text(CRANK_ROCKER)
    [bound] = limits_of(scene)
    limit = SpeedLimit(0.0, 10.0, 10.0, bound, 2, None, "its error is unknown")
    assert limit_words(limit, scene) == "rocker, deflection cannot be judged: its error is unknown"
    strength = replace(limit, limit=STRENGTH)
    assert limit_words(strength, scene) == "rocker, safety against yield cannot be judged: its error is unknown"
    assert limit_words(replace(strength, problem=""), scene) == "rocker yields"
    assert limit_words(replace(limit, limit=None, item=-1), scene) == "no steady state exists: vibration grows"


def test_errors_of_speeds_in_words():
    """Errors above a quarter are called unreliable, with the reason."""
    scene = scene_from_text(FOUR_BAR)
    speed = np.array([100.0, 110.0, 120.0, 130.0])
    peak = SpeedPeak(121.0, "w", 0, 1.0, Resonance(5, 1, 0, True))
    fields = dict.fromkeys(field.name for field in msgspec.structs.fields(Speeds))
    given = Speeds(**{**fields, "speed": speed, "unstable": (), "peaks": (peak,), "buckles": ()})

    def reported(*error):
        rows = {"stress": (measures_of(scene, figures_of(None))["stress"], np.ones(4), np.array(error))}
        limits, sentence = _words(replace(given, figures=rows), scene)
        assert limits.startswith("no limits are set")
        return sentence

    assert reported(0.01, 0.06, 0.24, 0.2) == (
        "3 of 4 speeds, from 110 rad/s on, have errors beyond 5 %, up to 24 % at 120 rad/s "
        "(a report at this speed names the cause)"
    )
    assert reported(0.01, 0.06, 2.4, 0.7) == (
        "3 of 4 speeds, from 110 rad/s on, have errors beyond 5 %, 2 of them unreliable: "
        "damping decides at resonance, for example at 121 rad/s, where 5th harmonic meets the 1st mode (mostly crank)"
    )
    assert reported(0.01, 0.06, 0.2, 0.7).endswith("1 of them unreliable, for example 130 rad/s")


def test_the_error_of_a_figure_that_is_nearly_zero_does_not_count():
    """The arm is symmetric and turns steadily: it does not bend, except for round-off."""
    found = speeds(scene_from_text(edited(ARM, ("[run]", "[run]\ntheory = 'elastodynamic'"))), (40.0, 60.0, 3))
    _, deflection, error = found.figures["deflection"]
    assert np.all(deflection < 1e-9 * found.figures["u"][1])
    assert np.any(error > 0.05 * deflection)
    assert np.all(found.error < 0.05)


class TestScaledQuantities:
    @pytest.mark.slow
    def test_several_drives_keep_their_ratio(self):
        """Cranks at 40 and 60 rad/s: the row at 80 equals the scene at 80 and 120, with two turns per cycle."""
        found = speeds(scene_from_text(TWO_CRANKS.format(40, 60)), (60.0, 80.0, 2))
        other = speeds(scene_from_text(TWO_CRANKS.format(80, 120)), (60.0, 80.0, 2))
        np.testing.assert_allclose(found.map.values[-1], other.map.values[-1], rtol=5e-3)
        words = speed_figures(found, scene_from_text(TWO_CRANKS.format(40, 60)))["words"]
        assert words[0] == "speeds are those of crank, the other drives keep their ratio to it"

    def test_loads_by_time_are_an_error(self):
        load = '[[loads]]\nlink = "rocker"\npoint = "B"\nforce = [1, 0]\ntable = [[0, 1], [1, 2]]\nextend = "hold"\n'
        with pytest.raises(SceneError, match="cannot scale a load by time"):
            speeds(scene_from_text(FOUR_BAR + load), (1.0, 2.0, 2))

    @pytest.mark.slow
    def test_loads_by_angle_are_allowed(self):
        load = '[[loads]]\nlink = "rocker"\npoint = "B"\nforce = [1, 0]\ntable = [[0, 1], [1, 2]]\nextend = "hold"\n'
        by_angle = load.replace("[1, 2]", "[0.5, 2]") + 'against = {link = "crank"}\n'
        assert speeds(scene_from_text(FOUR_BAR + by_angle), (1.0, 2.0, 2)).map.stable.all()


class TestUnstableRanges:
    def test_growth_by_round_off_is_stable_in_a_scan_too(self):
        found, curves = answers_of(scene_from_text(FOUR_BAR))
        found.find([1.0, 1.2])
        search = SpeedSearch(found, curves)
        search.scan = replace(search.scan, growth=np.where(np.arange(len(search.scan.ratio)) % 2, 1 + 1e-9, 1 - 1e-9))
        search._refine_growth = lambda: None
        assert np.isfinite(search.plot_curves()[1]).all()
        assert search.find_stability_limits() == []

    @pytest.mark.slow
    def test_borders_of_instability_are_between_answers(self):
        scene = read_scene(shipped_scenes()["steel_four_bar"])
        found, curves = answers_of(scene)
        found.find([6.4, 6.7])
        ((low, high),) = SpeedSearch(found, curves).find_stability_limits()
        known = found.map()
        below = known.ratio[known.ratio < low].max()
        assert low / below - 1 < 2 * SPEEDS.limit_accuracy
        assert high == 6.7
        assert np.isnan(known.values[known.ratio >= low]).all()
        single, _ = answers_of(scene)
        single.find([6.4])
        assert [single.stable(ratio) for ratio in (below, low)] == [True, False]


@pytest.mark.parametrize("requested", in_tiers([((400.0, 480.0, 3),), ((100.0, 700.0, 10),)], 0, 1))
def test_all_peaks_of_a_dense_scan_are_found(requested):
    """Each peak of each link at speeds a third of its half width apart is known to 2 %."""
    scene = scene_from_text(LIGHTLY_DAMPED)
    nominal = scene.laws[0].speed
    found, curves = answers_of(scene)
    found.find(np.linspace(*requested) / nominal)
    search = SpeedSearch(found, curves)
    search.find_peaks()
    brute, _ = answers_of(scene)
    brute.find(
        np.geomspace(*requested[:2], math.ceil(math.log(requested[1] / requested[0]) / (search.width / 1.5))) / nominal
    )
    known, dense = found.map(), brute.map()
    seen = 0
    for ours, theirs in zip(curves(known).reshape(9, -1), curves(dense).reshape(9, -1), strict=True):
        for at, share in prominences(theirs):
            if share > 0.02:
                near = np.abs(np.log(known.ratio / dense.ratio[at])) < 2 * search.width
                shown = max(np.interp(dense.ratio[at], known.ratio, ours), ours[near].max(initial=0.0))
                assert shown > (0.94 if dense.ratio[at] * nominal > 650 else 0.98) * theirs[at], (
                    dense.ratio[at] * nominal
                )
                seen += 1
    assert seen > 5


class Hill:
    """Answers of one field of one beam: a hill at 1.5 with a bump on its flank at 1.2."""

    least_damping = 0.001

    def __init__(self, rise):
        self.bump, self.asked = rise, [1.0, 2.0]

    def scan(self):
        return self

    def find(self, ratios):
        self.asked += ratios

    def map(self):
        return self.at(self.asked)

    def at(self, ratios, on_speed=None):
        ratio = np.sort(ratios)
        bump = np.where(abs(ratio - 1.2) < 0.03, 1 + self.bump - 4 * abs(ratio - 1.2), 0.0)
        hill = np.maximum(1 + np.sin(np.pi * (ratio - 1)), (1 + np.sin(0.2 * np.pi)) * bump)
        return Scan(ratio, np.broadcast_to(hill, (3, 1, len(ratio))), 0 * ratio)


@pytest.mark.parametrize(("rise", "answered"), [(0.03, True), (0.01, False)])
def test_small_bumps_are_left_to_the_scan(rise, answered):
    """A bump of 3 % rises 2.1 % above the adjacent valley, a bump of 1 % rises 0.7 %."""
    hill = Hill(rise)
    SpeedSearch(hill, lambda known: known.largest).find_peaks()
    assert any(abs(ratio - 1.5) < 0.01 for ratio in hill.asked)
    assert any(abs(ratio - 1.2) < 0.01 for ratio in hill.asked) is answered


def test_several_periodic_problems_equal_single_ones():
    rng = np.random.default_rng(3)
    grid = Grid(np.array([0.0, 0.3, 1.0]))
    points = len(grid.nodes) - 1

    def problem():
        mass, damping = np.eye(2) + 0.1 * rng.random((points, 2, 2)), 0.3 * rng.random((points, 2, 2))
        return Equations(mass, damping, 4 * np.eye(2) + rng.random((points, 2, 2)), rng.random((points, 2)))

    problems = [problem(), problem()]
    both = Equations(*(np.concatenate(parts) for parts in zip(*(astuple(one) for one in problems), strict=True)))
    multipliers, x = periodic_amplitudes(grid, both)
    for row, each in enumerate(problems):
        one = propagation(grid, each)
        np.testing.assert_allclose(x[row], one.history(one.periodic_start())[0], rtol=1e-10)
        np.testing.assert_allclose(np.sort_complex(multipliers[row]), np.sort_complex(one.multipliers), rtol=1e-9)


def test_a_scan_is_close_to_the_answers():
    """Five instead of ten coordinates give the chord deflection to 2 % without correction."""
    found, curves = answers_of(read_scene(shipped_scenes()["steel_four_bar"]))
    ratios = [0.3, 0.6, 0.96, 1.3, 1.84]
    found.find(ratios)
    scan = SpeedSearch(found, curves).model.at(ratios)
    known = found.map()
    np.testing.assert_allclose(scan.largest[1] / curves(known)[1], 0.96, atol=0.05)
    # at low speed the grid of the answer is coarser
    np.testing.assert_allclose(scan.growth[1:], known.growth[1:], atol=0.01)


def test_speeds_on_a_fine_grid_are_scanned_in_batches(monkeypatch):
    """The batch size depends on memory; the result does not depend on the batch size."""
    found, curves = answers_of(read_scene(shipped_scenes()["steel_four_bar"]))
    ratios = [0.3, 0.6, 0.96]
    found.find(ratios)
    model = SpeedSearch(found, curves).model
    together, heard = model.at(ratios), []
    monkeypatch.setattr("elastic.elastodynamics.speed_scan.SPEEDS", replace(SPEEDS, max_points=1))
    one_by_one = model.at(ratios, lambda done, of: heard.append((done, of)))
    assert heard == [(0, 3), (1, 3), (2, 3)]
    np.testing.assert_allclose(one_by_one.largest, together.largest, rtol=1e-9)


def test_a_search_of_minutes_is_announced(monkeypatch):
    sentences = []

    class Recorder(Progress):
        def tell(self, sentence):
            sentences.append(sentence)

    clock = iter([0.0, 0.0, 5.0, 10.0])
    monkeypatch.setattr("kinelast.speed_study.speeds.time.monotonic", lambda: next(clock))
    looking = _SearchProgress("arm", Recorder())
    for done in (0, 10, 20):
        looking(done, 2010)
    [sentence] = sentences
    assert "the search at 2010 speeds takes about 17 minutes; give a narrower range" in sentence


def test_prominence_ends_at_a_higher_peak_or_unknown_values():
    assert [*prominences(np.array([1.0, 4.0, 2.0, 3.0, 1.0]))] == [(1, 0.75), (3, pytest.approx(1 / 3))]
    assert [*prominences(np.array([0.0, 2.0, 1.0, math.nan, 5.0]))] == [(1, 0.5)]


FIVE_BAR = """
units = "mm"
[sections.bar]
shape = "rectangle"
depth = 5
width = 15
[points]
O = [0, 0]
A = [40, 30]
C = [150, 220]
B = [330, 40]
D = [300, 0]
[links.ground]
points = ["O", "D"]
[links.left]
points = ["O", "A"]
section = "bar"
material = "S235"
[links.arm]
points = ["A", "C"]
section = "bar"
material = "S235"
[links.fore]
points = ["C", "B"]
section = "bar"
material = "S235"
[links.right]
points = ["D", "B"]
section = "bar"
material = "S235"
[[drives]]
link = "left"
speed = "{speed} rpm"
[[drives]]
link = "right"
speed = "{other} rpm"
[run]
output = "C"
positions = 400
damping_ratio = 0.02
"""


def test_values_between_the_positions_of_the_map():
    """Sharp peaks: at its 96 positions, the map would miss 3 % of a displacement."""
    found = speeds(scene_from_text(FIVE_BAR.format(speed=-300, other=600)), (300 * RPM, 450 * RPM, 2))
    text = FIVE_BAR.format(speed=-450, other=900)
    peaks = results_in_full(scene_from_text(text.replace("[run]", '[run]\ntheory = "elastodynamic"'))).figures.peaks
    for key in ("along_path", "shaking_force", "shaking_moment", "joint_force", "displacement", "angle_error"):
        exact = max(peaks[key], key=lambda peak: abs(peak.value))
        _, values, errors = found.figures[key]
        assert abs(values[-1] - abs(exact.value)) < errors[-1] + exact.error_size, key
        assert abs(values[-1] - abs(exact.value)) < 0.015 * abs(exact.value), key


THIN_ROD = """
[sections.rod]
shape = "rectangle"
depth = 0.002
width = 0.01
[materials.steel]
E = 210e9
density = 7850
[points]
O = [0, 0]
A = [0.0003, 0]
B = [0.3003, 0]
[links.ground]
points = ["O"]
[links.crank]
points = ["O", "A"]
rigid = true
mass = 0
[links.rod]
points = ["A", "B"]
section = "rod"
material = "steel"
[links.piston]
points = ["B"]
mass = 0.2
[sliders.guide]
link = "piston"
through = "B"
direction = [1, 0]
[[drives]]
link = "crank"
speed = 600
[limits]
deflection = 10
"""


def test_the_speed_at_which_a_rod_buckles_is_found_between_the_speeds():
    """(m_piston + m_rod / 2) r omega^2 = pi^2 E I / l^2 at the outer dead centre, with half the mass of the rod."""
    found = speeds(scene_from_text(THIN_ROD), (800.0, 1800.0, 2))
    mass = 0.2 + 7850 * 0.002 * 0.01 * 0.3 / 2
    critical = np.pi**2 * 210e9 * 0.01 * 0.002**3 / 12 / 0.3**2
    assert found.buckling == pytest.approx(np.sqrt(critical / (mass * 0.0003)), rel=3e-3)
    assert 0.998 * found.buckling < found.highest <= found.buckling


@pytest.mark.parametrize("start", ["2 deg", "-2 deg"])
def test_a_peak_beside_the_start_of_the_cycle(start):
    """The largest shaking force is at the dead centre, just after or just before the start."""
    text = edited(SLIDER_CRANK, ("speed = 100", f'speed = 100\nstart = "{start}"'))
    found = speeds(scene_from_text(text), (90.0, 100.0, 2))
    single = text.replace("positions = 36", 'positions = 720\ntheory = "elastodynamic"')
    (exact,) = results_in_full(scene_from_text(single)).figures.peaks["shaking_force"]
    _, values, errors = found.figures["shaking_force"]
    assert abs(values[-1] - abs(exact.value)) < errors[-1] + exact.error_size
