"""Sensitivities, tolerances and optima of scenes agree with closed forms and an independent method in 50 digits."""

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from exact import exact
from scene_texts import STRUT
from scipy.optimize import brentq

from elastic import deflection, extremes
from kinelast import read_scene, scene_motion, shipped_scenes
from kinelast.designs import evaluate
from kinelast.designs.optimum_study import optimum_study, problem_of
from kinelast.designs.problem import steps_of
from kinelast.designs.search import local_searches
from kinelast.designs.sensitivities import Sensitivities
from kinelast.designs.studies import sensitivity_study, tolerance_study
from kinelast.designs.tolerances import accuracy_figures
from kinelast.outputs.sensitivities import PrintedSensitivities
from kinelast.outputs.studies import words
from kinelast.scene.document import document_from_text, document_of, scene_from_dict
from kinelast.scene.parsing import parse_toml
from kinelast.tasks.progress import Progress
from kinelast.values.error import SceneError

L, WIDTH, E, DENSITY, TIP = 0.3, 10e-3, 70e9, 2700.0, 0.2
ARM = """
materials.aluminium = {E = "70 GPa", poisson = 0.33, density = 2700}
sections.bar = {shape = "rectangle", depth = "20 mm", width = "10 mm"}
points = {O = [0, 0], A = [0.3, 0]}
links.ground.points = ["O"]
links.arm = {points = ["O", "A"], section = "bar", material = "aluminium", masses = { A = 0.2 }}
[[drives]]
link = "arm"
law = [{ curve = "cycloidal", duration = 1, by = 1 }]
[run]
beams = "euler-bernoulli"
positions = 5
"""
PEAK_ACCELERATION = 2 * np.pi  # [rad/s^2] of the cycloidal law, after a quarter of a second
SLOW_ARM = ARM.replace('law = [{ curve = "cycloidal", duration = 1, by = 1 }]', "speed = 1e-3").replace(
    "positions = 5", "positions = 1"
)
FORCE = """
[[loads]]
link = "arm"
point = "A"
force = [0, 50]
axes = "turning"
"""


def steel_four_bar(positions, more=""):
    text = shipped_scenes()["steel_four_bar"].read_text(encoding="utf-8")
    return parse_toml(text.replace("positions = 360", f"positions = {positions}") + more)


def tip_deflection(depth):
    """Return the tip deflection of `ARM` at its peak acceleration, by cantilever formulas."""
    line = DENSITY * WIDTH * depth
    return PEAK_ACCELERATION * (TIP * L**4 / 3 + 11 * line * L**5 / 120) / (E * WIDTH * depth**3 / 12)


THINNEST_STRUT = f"""{STRUT}
[run]
positions = 24
gravity = [0.0, -9.81]
[limits]
buckling = 0.9
deflection = "2 mm"
[optimize]
minimize = "mass"
[optimize.variables]
"sections.rod.diameter" = ["8 mm", "20 mm"]
"""


class TestSensitivities:
    def test_a_turning_arm(self):
        found, variables, _ = sensitivity_study(parse_toml(ARM), ["sections.bar.depth", "links.arm.masses.A"])
        row = found.figures.index("deflection")
        with mpmath.workdps(50):

            def deflection_of(depth, mass):
                line = mpmath.mpf(DENSITY) * mpmath.mpf(WIDTH) * depth
                load = mass * mpmath.mpf(L) ** 4 / 3 + 11 * line * mpmath.mpf(L) ** 5 / 120
                return 2 * mpmath.pi * load / (mpmath.mpf(E) * mpmath.mpf(WIDTH) * depth**3 / 12)

            at = tuple(mpmath.mpf(one.base) for one in variables)
            exact_slopes = [float(mpmath.diff(deflection_of, at, order)) for order in ((1, 0), (0, 1))]
        assert found.slope[row] == pytest.approx(exact_slopes, rel=1e-9)
        assert (abs(found.slope[row] - exact_slopes) < found.error[row] + 1e-13 * np.abs(exact_slopes)).all()

    @pytest.mark.parametrize(
        ("more", "path", "step", "words"),
        [
            ("", "sections.bar.depth", 1e-4, "100 µm more"),
            ("", "links.crank.length", 1e-3, "1 mm more"),
            ("", "points.D.y", 1e-3, "1 mm more"),
            ("", "drives.crank.start", np.radians(1.0), "1° more"),
            ("", "materials.steel.E", 2.1e9, "1 % more"),
            ('units = "in"\n', "links.crank.length", 0.01 * 0.0254, "0.01 in more"),
            ('[tolerances]\n"links.crank.length" = "0.02 mm"\n', "links.crank.length", 2e-5, "20 µm more"),
        ],
    )
    def test_the_step_of_a_sensitivity_is_a_tolerance_millimetre_degree_or_per_cent(self, more, path, step, words):
        text = shipped_scenes()["steel_four_bar"].read_text().replace('"100 rad/s"', '"100 rad/s"\nstart = 0.0')
        document = document_from_text(more + text if "units" in more else text + more)
        numbers = [document.variable(path)]
        steps = steps_of(document, numbers)
        assert steps[0].size == pytest.approx(step, rel=1e-12)
        slope = np.array([[-2.5]])
        result = Sensitivities(("mass",), np.ones(1), np.array([0.5]), *[slope] * 4, slope > 0, abs(slope))
        sensitivities = PrintedSensitivities(result, numbers, {"mass": "kg"}, steps, document.scene.shown_in)
        assert sensitivities.change[0, 0] == pytest.approx(-2.5 * step, rel=1e-12)
        assert sensitivities.sentence(0, 0).startswith(f"{words} {path}")
        assert sensitivities.sentence(0, 0).endswith(" %) mass")

    @pytest.mark.slow
    @pytest.mark.parametrize("path", ["links.crank.length", "links.coupler.length"])
    def test_a_four_bar_against_50_digits(self, path):
        """At the location of the largest deflection: a shift of the place has no effect to first order."""
        tables = steel_four_bar(12)
        tables["run"]["beams"] = "euler-bernoulli"  # the reference has no rotary inertia
        tables["sensitivities"] = {"figures": ["deflection.coupler"], "numbers": [path]}
        found, (one,), _ = sensitivity_study(tables)
        scene = scene_from_dict(tables)
        course = scene_motion(scene)
        peak = extremes(deflection(course, scene.sections), ["w"])["w"]
        at = int(abs(peak.value[1]).argmax())
        xi, sign = mpmath.mpf(float(peak.xi[1, at])), np.sign(peak.value[1, at])

        def coupler_deflection(value):
            own = document_of(tables).with_values({path: value}).scene
            rates = course.drive[:, at], course.drive_rate[:, at], course.drive_acceleration[:, at]
            return exact(own.mechanism, own.sections, *rates).at("w", 1, xi) * sign

        with mpmath.workdps(50):
            steps = [one.base * 2.0**-k for k in (9, 10, 11)]
            central = [
                (coupler_deflection(one.base + step) - coupler_deflection(one.base - step))
                / (mpmath.mpf(one.base + step) - mpmath.mpf(one.base - step))
                for step in steps
            ]
            once = [(4 * b - a) / 3 for a, b in pairwise(central)]
            slope = float((16 * once[1] - once[0]) / 15)
        assert found.slope[0, 0] == pytest.approx(slope, rel=1e-8)
        assert found.error[0, 0] < 1e-8 * abs(slope)

    @pytest.mark.slow
    def test_a_kink_between_two_equally_stressed_links_is_reported(self):
        """The rockers are equal, except for a slight difference in slenderness."""
        tables = steel_four_bar(24)
        tables["sections"]["other"] = dict(tables["sections"]["bar"])
        tables["links"]["rocker"]["section"] = "other"
        both = evaluate(tables, [], np.zeros((1, 0)), ["stress.crank", "stress.rocker"]).columns
        assert both["stress.crank"][0] > both["stress.rocker"][0]
        ratio = np.array([0.25, 1.0])  # at a fifth the rocker buckles

        def apart(depth):
            found = evaluate(tables, ["sections.other.depth"], [[depth]], ["stress.crank", "stress.rocker"]).columns
            return float(found["stress.crank"][0] - found["stress.rocker"][0])

        equal = brentq(apart, *(ratio * 6e-3), xtol=1e-17)
        tables = document_of(tables).with_values({"sections.other.depth": equal}).tables
        tables["sensitivities"] = {"figures": ["stress", "mass"], "numbers": ["sections.other.depth"]}
        found, *_ = sensitivity_study(tables)
        assert found.kink.tolist() == [[True], [False]]
        assert abs(found.below[0, 0] - found.above[0, 0]) > 0.1 * abs(found.slope[0, 0])


class TestTolerances:
    @pytest.mark.slow
    def test_tolerances_of_a_four_bar_by_hand_and_by_samples(self):
        """Rocker angle at one position: the loop error projected on the coupler, which cannot rotate it."""
        more = """
[tolerances]
"links.crank.length" = { plus_minus = "0.1 mm", distribution = "normal" }
"links.coupler.length" = "0.05 mm"
"links.rocker.length" = { plus_minus = "0.2 mm", distribution = "normal" }
"points.D.x" = "0.1 mm"
"""
        tables = steel_four_bar(1, more)
        tables["run"]["output"] = "rocker.angle"
        found = tolerance_study(tables)
        course = scene_motion(scene_from_dict(tables))
        crank, coupler, rocker = (float(np.angle(course.direction[k, 0])) for k in (1, 2, 3))
        turns = np.array([np.cos(crank - coupler), 1.0, -np.cos(rocker - coupler), -np.cos(coupler)])
        slopes = turns / (-0.25 * np.sin(rocker - coupler))
        deviations = np.array([1e-4 / 3, 5e-5 / np.sqrt(3), 2e-4 / 3, 1e-4 / np.sqrt(3)])
        by_hand = float(np.sqrt(((slopes * deviations) ** 2).sum()))
        sampled = found.sampled["geometric_error"]
        assert np.hypot(sampled.mean, sampled.deviation) == pytest.approx(by_hand, rel=5e-3)
        first = found.first.deviation[found.nominal.figures.index("geometric_error")]
        assert first == pytest.approx(by_hand, rel=1e-6)  # by one-sided slopes, since the value is zero as drawn
        elastic, whole = found.sampled["output_error"], found.sampled["whole_error"]
        assert elastic.mean > 0
        assert whole.mean == pytest.approx(elastic.mean, rel=0.05)  # the geometric error has either sign

    def test_the_error_of_a_point_combines_geometry_and_deflection(self):
        """The tip of an arm that is too long: the geometric error is axial, the deflection transverse."""
        tables = parse_toml(ARM + 'output = "A"\n')
        scene = scene_from_dict(tables)
        figures = accuracy_figures(scene_motion(scene), scene.output)
        found = evaluate(tables, ["points.A.x"], [[L], [L + 1e-4]], [*figures, "output_error"]).columns
        assert found["geometric_error"] == pytest.approx([0.0, 1e-4], rel=1e-9, abs=1e-16)
        assert found["output_error"][0] == pytest.approx(tip_deflection(20e-3), rel=1e-4)  # and a small stretch
        assert found["whole_error"] == pytest.approx(
            np.hypot(found["geometric_error"], found["output_error"]), rel=1e-2
        )

    @pytest.mark.parametrize("how", ["by", "to"])
    def test_a_law_from_a_varying_drawn_start(self, how):
        """An arm with a fixed end position moves less from a later start."""
        tables = parse_toml(ARM.replace("by = 1", f"{how} = 1"))
        found = evaluate(tables, ["points.A.y"], [[0.0], [0.1]], ["deflection"]).columns["deflection"]
        start = np.arctan2(0.1, L)
        share = (1 - start if how == "to" else 1) * (np.hypot(L, 0.1) / L) ** 4  # almost only the mass of the tip
        assert found[1] / found[0] == pytest.approx(share, rel=0.05)
        raised = document_of(tables).with_values({"points.A.y": 0.1})
        alone = evaluate(raised, [], np.zeros((1, 0)), ["deflection"]).columns
        assert found[1] == pytest.approx(alone["deflection"][0], rel=1e-12)

    @pytest.mark.slow
    def test_quantiles_of_the_arm_agree_with_its_formula(self):
        more = '[tolerances]\n"sections.bar.depth" = { plus_minus = "3 %", distribution = "normal" }\n'
        found = tolerance_study(parse_toml(ARM + more))
        sampled = found.sampled["deflection"]
        quantiles = tip_deflection(20e-3 * (1 + 0.01 * np.array([1.959964, 0, -1.959964])))
        assert [sampled.low, sampled.median, sampled.high] == pytest.approx(quantiles, rel=1e-3)
        assert found.shares["deflection"][1] == pytest.approx([1.0], abs=0.05)


class TestOptimum:
    def test_the_lightest_arm_within_a_deflection_limit(self):
        more = """
[limits]
deflection = "20 um"
[optimize]
minimize = "mass"
[optimize.variables]
"sections.bar.depth" = ["5 mm", "60 mm"]
"""
        solved = optimum_study(parse_toml(ARM + more))
        (held_to,) = solved.held_to  # limit minus the allowance for vibration and errors
        assert 19e-6 < held_to < 20e-6
        depth = brentq(lambda depth: tip_deflection(depth) - held_to, 5e-3, 60e-3, xtol=1e-16)
        assert solved.optimum.values == pytest.approx([depth], rel=1e-6)
        assert solved.after["deflection.arm"] <= held_to
        mass = DENSITY * WIDTH * L * depth
        step = 1e-5  # per cent of mass per per cent of the limit, by the formula
        wider = brentq(lambda depth: tip_deflection(depth) - held_to * (1 + step), 5e-3, 60e-3, xtol=1e-16)
        price = (depth - wider) / depth / step * mass / (mass + TIP)
        assert solved.optimum.certificate.multiplier == pytest.approx([price], rel=1e-4)
        assert solved.optimum.certificate.residual < 1e-6
        assert words(solved)[0].endswith("kg; acceptable")

    @pytest.mark.slow
    def test_the_thinnest_strut_near_its_critical_load(self, monkeypatch):
        """Weight q and force P: w = q EI/P^2 (1/cos(l/2 sqrt(P/EI)) - 1) - q l^2/(8 P), which grows without bound."""
        monkeypatch.setattr("kinelast.designs.optimum.NEIGHBOURS_PER_RADIUS", 4)  # they take half of the time
        solved = optimum_study(parse_toml(THINNEST_STRUT))

        def deflection(diameter, length=0.8):
            rigidity, press = 210e9 * math.pi * diameter**4 / 64, 2000 / math.cos(math.asin(0.02 / length))
            weight = 7850 * math.pi * diameter**2 / 4 * 9.81
            turns = math.cos(math.sqrt(press / rigidity) * length / 2)
            return weight * rigidity / press**2 * (1 / turns - 1) - weight * length**2 / (8 * press)

        diameter = brentq(lambda diameter: deflection(diameter) - 2e-3, 10.7e-3, 13e-3)
        assert solved.optimum.values == pytest.approx([diameter], rel=1e-3)
        assert all(each.outcome == "kept" for each in solved.judgements)
        assert "unused" not in " ".join(words(solved))

    @pytest.mark.slow
    def test_a_search_that_ends_early_says_what_is_unused_and_keeps_the_best_design(self, monkeypatch):
        monkeypatch.setattr("kinelast.designs.optimum_study.MAX_ROUNDS", 3)
        monkeypatch.setattr("kinelast.designs.optimum.NEIGHBOURS_PER_RADIUS", 4)
        solved = optimum_study(parse_toml(THINNEST_STRUT))
        assert 11e-3 < solved.optimum.values[0] < 11.2e-3
        assert "with its error, the figure leaves 27 % unused; a better design may exist" in " ".join(words(solved))

    def test_no_link_of_an_optimum_yields(self):
        """At the root, stress is 6 M / (b h^2) plus the pull of inertia, N / (b h)."""
        study = '[optimize]\nminimize = "mass"\n[optimize.variables]\n"sections.bar.depth" = ["3 mm", "60 mm"]\n'
        solved = optimum_study(parse_toml(ARM.replace("density = 2700", 'density = 2700, yield = "5 MPa"') + study))
        (held_to,) = solved.held_to

        def stress(depth):
            line = DENSITY * WIDTH * depth
            moment = PEAK_ACCELERATION * (TIP * L**2 + line * L**3 / 3)
            return 6 * moment / (WIDTH * depth**2) + (TIP * L + line * L**2 / 2) / (WIDTH * depth)

        assert 1.0 <= held_to < 1.2
        assert stress(solved.optimum.values[0]) == pytest.approx(5e6 / held_to, rel=1e-3)
        assert words(solved)[0].endswith("kg; acceptable")

    def test_a_limit_without_influence_is_reported_before_the_search(self):
        """The rest of the mass is at the tip, and no depth changes it."""
        more = """
[limits]
deflection = "20 um"
[limits.figures]
drive_speed = "1 rad/s"
[optimize]
minimize = "mass"
[optimize.variables]
"sections.bar.depth" = ["5 mm", "60 mm"]
"""
        heard = []

        class Heard(Progress):
            def __call__(self, *stage):
                heard.append(stage)

        message = "does not depend on the variables: drive_speed.arm is .*, required at most 1 rad/s: add variables"
        with pytest.raises(SceneError, match=message):
            optimum_study(parse_toml(ARM + more), Heard())
        assert heard == []

    @pytest.mark.slow
    def test_a_stepped_arm_of_equal_stress(self):
        """Under a tip force each piece has the depth that its root requires: 6 F s / (b h^2) = sigma."""
        pieces = [f'[sections.s{k}]\nshape = "rectangle"\ndepth = "20 mm"\nwidth = "10 mm"' for k in (1, 2, 3)]
        head = SLOW_ARM.replace(", masses = { A = 0.2 }", "").replace(
            'points = ["O", "A"]', 'points = ["O", "P", "Q", "A"]'
        )
        beams = 'beams = [{from="O",to="P",section="s1"},{from="P",to="Q",section="s2"},{from="Q",to="A",section="s3"}]'
        head = head.replace('section = "bar"', beams).replace(
            "A = [0.3, 0]", "P = [0.1, 0], Q = [0.2, 0], A = [0.3, 0]"
        )
        variables = "\n".join(f'"sections.s{k}.depth" = ["2 mm", "40 mm"]' for k in (1, 2, 3))
        study = (
            f'[optimize]\nminimize = "mass"\n[optimize.limits]\nstress = "60 MPa"\n[optimize.variables]\n{variables}\n'
        )
        solved = optimum_study(parse_toml("\n".join([head, *pieces, FORCE, study])))
        assert np.array(solved.held_to) == pytest.approx(60e6, rel=0.01)  # minus an allowance for errors
        rows = zip((0.3, 0.2, 0.1), solved.held_to, strict=True)
        exact_depths = [np.sqrt(6 * 50 * arm / (WIDTH * stress)) for arm, stress in rows]
        assert solved.optimum.values == pytest.approx(exact_depths, rel=1e-5)
        # each stress frees half the mass of its piece
        assert solved.optimum.certificate.multiplier == pytest.approx(
            0.5 * np.array(exact_depths) / sum(exact_depths), rel=1e-3
        )
        assert solved.optimum.certificate.residual < 1e-5

    @pytest.mark.slow
    def test_a_tapered_arm_of_equal_stress(self):
        """Linear taper under a tip force: three times as deep at the root, with the largest stress in the middle."""
        text = SLOW_ARM.replace(", masses = { A = 0.2 }", "").replace('depth = "20 mm"', 'depth = ["24 mm", "12 mm"]')
        study = """
[optimize]
minimize = "mass"
[optimize.limits]
stress = "60 MPa"
[optimize.variables]
"sections.bar.depth[1]" = ["5 mm", "40 mm"]
"sections.bar.depth[2]" = ["2 mm", "40 mm"]
"""
        problem = problem_of(parse_toml(text + FORCE + study)).problem
        # one search, since designs of a taper are computed one by one
        (found,) = local_searches(problem, [np.array([0.5, 0.5])])
        tip = np.sqrt(6 * 50 / (4 * WIDTH * 60e6) * L / 2)
        assert found.violation == 0
        assert problem.values(found.end) == pytest.approx([3 * tip, tip], rel=2e-3)
        assert found.cost == pytest.approx(DENSITY * WIDTH * L * 2 * tip, rel=1e-5)

    @pytest.mark.slow
    def test_the_lengths_of_a_wing_solve_its_three_equations(self):
        """docs/sources.md solves them for the printed 21, 39 and 59 mm."""
        tables = parse_toml(shipped_scenes()["wing_sizing"].read_text(encoding="utf-8"))
        tables["run"]["positions"] = 90
        solved = optimum_study(tables)
        # up to the error of the angles at 90 positions
        assert solved.optimum.values == pytest.approx([21.12e-3, 38.48e-3, 58.61e-3], abs=0.02e-3)
        assert (solved.optimum.certificate.multiplier > 0.1).all()

    @pytest.mark.slow
    def test_a_four_bar_through_five_points(self):
        """The sum of squares is 7.41575e-7 in its unit of length, see test_optimum."""
        solved = optimum_study(parse_toml(shipped_scenes()["five_points"].read_text(encoding="utf-8")))
        assert solved.after["path_squares"] == pytest.approx(7.415751307e-9, rel=1e-6)
        lengths = [0.36697, 0.19978, 0.39963, 0.27049, 0.16720, 0.16801]
        assert solved.optimum.values == pytest.approx(lengths, abs=1e-5)

    @pytest.mark.slow
    def test_a_frequency_away_from_the_drive(self):
        tables = parse_toml(
            ARM
            + """
[optimize]
minimize = "mass"
[optimize.limits]
frequency = { least = "300 rad/s" }
[optimize.variables]
"sections.bar.depth" = ["5 mm", "60 mm"]
"""
        )
        solved = optimum_study(tables)
        found = solved.optimum.values[0]

        def lowest(depth):  # cantilever with tip mass: 1 + cos cosh + mu k (cos sinh - sin cosh) = 0
            line = DENSITY * WIDTH * depth
            mu = TIP / (line * L)

            def rest(k):
                return 1 + np.cos(k) * np.cosh(k) + mu * k * (np.cos(k) * np.sinh(k) - np.sin(k) * np.cosh(k))

            k = brentq(rest, 0.2, 1.9)
            return (k / L) ** 2 * np.sqrt(E * WIDTH * depth**3 / 12 / line)

        (held_to,) = solved.held_to
        assert 300.0 < held_to < 301.0, "room for what beams without shear leave out"
        assert lowest(found) == pytest.approx(held_to, rel=1e-4)
        assert words(solved)[0].endswith("kg; acceptable")


def test_the_distance_of_a_frequency_from_multiples_of_the_speed():
    tables = parse_toml(ARM.replace('law = [{ curve = "cycloidal", duration = 1, by = 1 }]', "speed = 120"))
    found = evaluate(tables, [], np.zeros((1, 0)), ["frequency", "frequency_ratio", "resonance_distance"]).columns
    ratio = found["frequency"][0] / 120
    assert found["frequency_ratio"][0] == pytest.approx(ratio, rel=1e-12)
    assert found["resonance_distance"][0] == pytest.approx(min(abs(1 - n / ratio) for n in range(1, 7)), rel=1e-12)
    assert 1 < ratio < 6


def test_documented_optima_are_shipped():
    assert {"wing_sizing", "five_points", "lightest_arm"} <= shipped_scenes().keys()
    assert read_scene(shipped_scenes()["lightest_arm"]).limits
