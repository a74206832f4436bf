"""When many designs are evaluated together, each row equals a separate run, whichever number of the scene varies."""

import copy
import gc
import re
from pathlib import Path

import numpy as np
import pytest
from tiers import in_tiers

from elastic import FIELDS, deflection, extremes, rectangle, sample, section_of
from elastic.cycle_maxima import COARSE, FINE, _bounds, cycle_maxima
from kinelast import SceneError, scene_from_dict, scene_motion, shipped_scenes
from kinelast.designs import evaluate
from kinelast.designs.base import base_of
from kinelast.reports.summary import summary
from kinelast.runs import computed
from kinelast.scene import build
from kinelast.scene.document import document_from_dict, document_of, read_document
from kinelast.scene.parsing import parse_scene, parse_toml
from kinelast.scene.text import file_text
from kinelast.scene.variables import Variable, numbers
from kinelast.tasks.request import Request
from rigid import Beam, LineLoad, Link, Mechanism, PinDrive, PointLoad, motion
from rigid.positions.branch import TrackedBranch
from tests.scene_texts import SWING, WHEEL

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
SPREAD = 3e-3  # relative change of the numbers


def shipped(name, positions):
    tables = parse_toml(file_text(shipped_scenes()[name]))
    tables["run"] = {**tables.get("run", {}), "positions": positions}
    return tables


STEEL = shipped("steel_four_bar", 24)

# Numbers to leave unchanged: points on a common line, choices of the theory, and numbers that no figure uses.
MECHANISMS = {
    "steel": (STEEL, ("run.accuracy", "run.tolerance", "run.steps")),
    "press": (shipped("offset_slider_crank", 24), ("run.tolerance", "run.steps")),
    "shaper": (
        shipped("quick_return", 24),
        ("run.tolerance", "run.steps", "points.C", "points.A", "points.D", "points.O.x", "sliders"),
    ),
    "wing": (shipped("drs_push_up", 25), ("run.tolerance", "run.steps", "outline", "table", "links.flap.points.T")),
    "swing": (parse_toml(SWING), ("run.tolerance", "run.steps", "motion[1]")),
    "wheel": (parse_toml(WHEEL), ("run.tolerance", "run.steps")),
    "rocking": (
        {
            **STEEL,
            "drives": [
                {
                    "link": "crank",
                    "repeat": True,
                    "law": [{"curve": "harmonic", "duration": 0.1, "by": by} for by in (0.2, -0.2)],
                }
            ],
        },
        ("run.tolerance", "run.steps", "run.accuracy", "drives"),
    ),
    "rubbing": (
        {
            **shipped("offset_slider_crank", 24),
            "joints": {
                "A": {"friction": 0.1, "radius": "5 mm", "viscosity": "0.01 N m s/rad"},
                "guide": {"friction": 0.2, "length": "40 mm"},
            },
        },
        ("run.tolerance", "run.steps"),
    ),
    "andrews": (shipped("andrews_driven", 24), ("run.tolerance", "run.steps")),
}


def paths_of(name):
    tables, without = MECHANISMS[name]
    return [path for path in numbers(parse_scene(tables)) if not any(word in path for word in without)]


def single(tables):
    """Return the figures of a scene as its report computes them, without the modules on designs."""
    results = computed(scene_from_dict(tables), Request(theory="quasi-static"))
    found = summary(results)
    largest = {"deflection": "largest_deflection", "chord": "largest_chord", "stress": "largest_stress"}
    row = {name: found[key]["value"] for name, key in largest.items() if found[key]}
    safety = [each["safety_factor"]["value"] for each in found["strength"].values()]
    if safety and None not in safety:
        row["safety"] = min(safety)
    for name, drive in found["drives"].items():
        row[f"drive_effort.{name}"] = drive["effort"]["value"]
    row["joint_force"] = max(each["force"]["value"] for each in found["joints"])
    row["shaking_force"] = found["shaking"]["force"]["value"]
    row["shaking_moment"] = found["shaking"]["moment"]["value"]
    row["condition"] = found["run"]["largest_condition"]["value"]
    return row


def rows_and_singles(tables, paths, count, seed=1):
    rng = np.random.default_rng(seed)
    base = np.array([document_of(tables).variable(path).base for path in paths])
    values = np.where(base == 0, 1e-4, base) * (1 + SPREAD * rng.uniform(-1, 1, (count, len(paths))))
    changed = []
    for row in values:
        own = copy.deepcopy(tables)
        for path, value in zip(paths, row, strict=True):
            own = document_of(own).with_values({path: value}).tables
        changed.append(single(own))
    return evaluate(tables, paths, values, list(changed[0])), changed


def require_same(found, singles):
    assert list(found.reason) == [""] * len(singles)
    for name, column in found.columns.items():
        alone = np.array([row[name] for row in singles])
        assert np.abs(column - np.abs(alone)).max() <= 1e-11 * np.abs(alone).max() + 1e-13, name


def test_bending_a_straight_link_in_one_design_keeps_the_chord_of_others():
    """The members are those of the drawn scene, for any set of designs."""
    document = read_document(shipped_scenes()["pusher"]).with_positions(12)
    drawn = document.variable("points.D.x").base
    found = evaluate(document, ["points.D.x"], [[drawn], [drawn + 0.02]], ["chord"])
    alone = evaluate(document, [], np.zeros((1, 0)), ["chord"])
    assert found.columns["chord"][0] == pytest.approx(alone.columns["chord"][0], rel=1e-12)


def test_designs_of_a_partial_cycle_are_not_traced_through_the_whole_cycle(monkeypatch):
    """Their figures do not need the length of the cycle; a single scene with vibration does."""
    followed = []
    of = build.mechanism_repeats
    monkeypatch.setattr(build, "mechanism_repeats", lambda *parts: followed.append(1) or of(*parts))
    document = read_document(shipped_scenes()["five_points"])
    lengths = np.array([[0.19], [0.2], [0.21]])
    assert document.scene.run.turn is False
    before = len(followed)
    found = evaluate(document, ["links.crank.length"], lengths, ["output_error", "drive_effort", "mass"])
    assert (before, len(followed)) == (1, 1)
    for row, (length,) in enumerate(lengths):
        alone = evaluate(document.with_values({"links.crank.length": length}), [], np.zeros((1, 0)), [*found.columns])
        for name, value in found.columns.items():
            assert value[row] == pytest.approx(alone.columns[name][0], rel=1e-9), name


@pytest.mark.parametrize("name", in_tiers(MECHANISMS, 3, 6))
def test_rows_equal_single_runs_if_all_numbers_change(name):
    tables, _ = MECHANISMS[name]
    paths = paths_of(name)
    assert len(paths) > 9
    require_same(*rows_and_singles(tables, paths, 2))


@pytest.mark.parametrize("name", in_tiers([name for name in MECHANISMS if name != "rubbing"], 0, 3))
def test_vectorized_designs_equal_single_runs(name):
    tables, _ = MECHANISMS[name]
    base = base_of(document_from_dict(tables), paths_of(name), None)
    paths = [place.variable.path for place, fits in zip(base.places, base.on_axis, strict=True) if fits]
    assert len(paths) > 7
    found, singles = rows_and_singles(tables, paths, 3, seed=2)
    require_same(found, singles)


@pytest.mark.parametrize(
    "path", in_tiers(["materials.steel.E", "materials.steel.yield", "materials.steel.poisson", "points.B.x"], 2, 2)
)
def test_designs_that_share_one_motion_have_all_figures(path):
    base = document_of(STEEL).variable(path).base
    found = evaluate(STEEL, [path], [[base], [0.9 * base]])
    alone = evaluate(STEEL, ["points.D.x"], [[0.35]])
    assert list(found.reason) == ["", ""]
    for name, column in alone.columns.items():
        assert found.columns[name][0] == pytest.approx(column[0], rel=1e-12), name
    assert (found.columns["safety"][0] != found.columns["safety"][1]) == (path == "materials.steel.yield")


def test_each_design_follows_the_branch_of_its_own_drawing():
    heights = [0.24, -0.24, 0.2, -0.3]
    heavy = {**STEEL, "run": {"positions": 24, "gravity": [0.0, -9.81]}}
    found = evaluate(heavy, ["points.B.y"], [[height] for height in heights], ["deflection", "shaking_moment"])
    singles = [single(document_of(heavy).with_values({"points.B.y": height}).tables) for height in heights]
    require_same(found, [{name: row[name] for name in found.columns} for row in singles])
    assert found.columns["shaking_moment"][0] != pytest.approx(found.columns["shaking_moment"][1], rel=1e-4)


@pytest.mark.parametrize(
    ("name", "paths", "spread"),
    in_tiers(
        [
            ("steel", ["links.crank.length", "links.rocker.length"], 0.4),  # some are out of reach
            ("steel", ["drives.crank.speed", "points.A.y"], 0.3),
            ("bars", ["points.3.y", "sections.bar.depth"], 0.05),  # arrays large enough for numpy to multiply in place
            ("press", ["points.B.y", "sliders.guide.direction"], 0.1),
            ("shaper", ["links.rod.length", "sections.arm.depth"], 0.1),
            ("andrews", ["links.K3.points.E.y", "links.K5.mass"], 0.1),
        ],
        0,
        2,
    ),
)
def test_a_row_does_not_depend_on_other_rows_bit_for_bit(name, paths, spread):
    tables = shipped("flap_bars", 361) if name == "bars" else MECHANISMS[name][0]
    rng = np.random.default_rng(0)
    base = np.array([document_of(tables).variable(path).base for path in paths])
    values = np.where(base == 0, 1e-3, base) * (1 + spread * rng.uniform(-1, 1, (40, 2)))
    whole = evaluate(tables, paths, values)
    for rows in ([0], range(5, 9), range(39, 36, -1), range(0, 40, 7)):
        part = evaluate(tables, paths, values[list(rows)])
        for figure, column in whole.columns.items():
            assert column[list(rows)].tobytes() == part.columns[figure].tobytes()
        assert list(whole.reason[list(rows)]) == list(part.reason)


def test_a_sweep_keeps_no_branches_of_earlier_designs():
    """The branch of a motion grows with the designs; 64 chunks of a sweep filled the memory."""
    kept = []
    for crank in (0.10, 0.11, 0.12):
        evaluate(STEEL, ["links.crank.length"], [[crank], [crank + 0.001]], ["deflection"])
        gc.collect()
        kept.append(sum(isinstance(each, TrackedBranch) and bool(each.designs) for each in gc.get_objects()))
    assert kept[2] <= kept[1] <= kept[0]


def test_an_impossible_design_is_a_row_with_a_reason():
    press = MECHANISMS["press"][0]
    paths = ["sections.rod.inner", "links.rod.length", "links.crank.length"]
    good = [0.008, 0.18, 0.05]
    values = [good, [0.012, 0.18, 0.05], [0.008, -0.1, 0.05], [0.008, 0.045, 0.05], [0.008, 0.01, 0.001], good]
    found = evaluate(press, paths, values, ["deflection", "reach"])
    assert list(np.isfinite(found.columns["deflection"])) == [True, False, False, False, False, True]
    assert found.columns["deflection"][0] == found.columns["deflection"][5]
    alone = [None, *(wrong(press, paths, row) for row in values[1:5])]
    assert found.reason[1] == alone[1] == "[sections.rod] inner: expected a diameter below outer, 0.012 m, got 0.012 m"
    assert (
        found.reason[2] == 'links.rod.length: expected a length, as in "100 mm" or 0.1, greater than zero, got -0.1 m'
    )
    assert "greater than zero" in alone[2]
    share = found.columns["reach"][3]
    assert 0 < share < 1
    assert found.reason[3] == f'{1 - share:.0%} of the positions are out of reach: the joint "B" opens'
    assert f"{1 - share:.0%} of the positions are out of reach" in alone[3]
    assert 'the joint "B" opens' in alone[3]
    assert found.reason[4] == 'the mechanism cannot be assembled: the joint "B" is out of reach at every position'
    assert 'the joint "B" is out of reach at every position' in alone[4]


def wrong(tables, paths, values):
    """Return the error message of a single run of a design."""
    try:
        for path, value in zip(paths, values, strict=True):
            tables = document_of(tables).with_values({path: value}).tables
        single(tables)
    except SceneError as error:
        return str(error)
    raise AssertionError("nothing is wrong")


def test_paths_identify_the_numbers_of_a_scene():
    for path in ("drives.crank.speed", "drives[1].speed"):
        assert document_of(STEEL).variable(path) == Variable(path, "rad/s", 100.0)
    assert document_of(STEEL).variable("points.B.y").base == document_of(STEEL).variable("points.B[2]").base == 0.24
    swing = MECHANISMS["swing"][0]
    assert document_of(swing).variable("springs[2].stiffness").unit == "N m/rad"
    assert document_of(swing).variable("springs[1].stiffness").unit == "N/m"
    assert document_of(swing).variable("sections.bar.outer[2]").base == 0.006
    assert document_of(swing).variable("loads.block.table[1][1]").unit == "m"
    assert document_of(MECHANISMS["press"][0]).variable("sliders.guide.direction").unit == "rad"
    assert document_of(STEEL).value("drives.crank.speed", "3000 rpm") == pytest.approx(100 * np.pi)
    assert document_of(STEEL).value("sections.bar.depth", "5 mm") == 0.005


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (
            "sections.bar.dept",
            'sections.bar.dept: there is no such number in the scene; did you mean "sections.bar.depth"?',
        ),
        ("points.B", 'points.B: is two numbers: use "points.B.x" or "points.B.y"'),
        (
            "links.crank.section",
            "it is a name; write [sections.NAME] with shape, depth and width, and use paths such as",
        ),
        ("sections.RHS 60x40x3.wall", "there is no such number in the scene; write [sections.NAME] with shape, depth"),
        ("links.crank.material", 'write [materials.NAME] with E and density, and use paths such as "materials.NAME.E"'),
        (
            "drives[2].speed",
            'drives[2].speed: there is no such number in the scene; did you mean "drives.crank.speed"?',
        ),
        ("", ": there is no such number in the scene"),
    ],
)
def test_an_unknown_path_suggests_the_nearest(path, words):
    with pytest.raises(SceneError) as caught:
        document_of(STEEL).variable(path)
    assert words in f"{path}: {caught.value.problem}"


@pytest.mark.parametrize(
    ("path", "text", "words"),
    [
        ("sections.bar.depth", "5 kg", 'expected a length, as in "100 mm" or 0.1, got "5 kg"'),
        ("sections.bar.depth", "-5 mm", "greater than zero"),
        ("drives.crank.speed", "2 m/s", "in rad/s, got 2 m/s"),
        ("materials.steel.poisson", 0.7, "expected a number within its bounds, got 0.7"),
        ("materials.steel.poisson", "much", "expected a number, got much"),
    ],
)
def test_an_invalid_value_is_an_error(path, text, words):
    with pytest.raises(SceneError, match=re.escape(words)):
        document_of(STEEL).value(path, text)


def test_an_unknown_figure_suggests_the_nearest():
    with pytest.raises(SceneError, match=re.escape('there is no figure "deflexion"; did you mean "deflection"?')):
        evaluate(STEEL, ["sections.bar.depth"], [[0.005]], ["deflexion"])
    with pytest.raises(ValueError, match=re.escape("values of shape (1, 2) for 1 paths, expected (designs, 1)")):
        evaluate(STEEL, ["sections.bar.depth"], [[0.005, 0.1]])


def test_limits_and_output_are_evaluated_for_each_design():
    tables = copy.deepcopy(STEEL)
    tables["run"]["output"] = "B"
    tables["limits"] = {"deflection": "1 mm", "output": "2 mm", "links": {"crank": {"safety": 1.5}}}
    values = [[depth] for depth in (0.004, 0.006, 0.01)]
    found = evaluate(tables, ["sections.bar.depth"], values, ["limits_kept", "output_error", "mass"])
    for row, (depth,) in enumerate(values):
        scene = document_of(tables).with_values({"sections.bar.depth": depth}).scene
        results = computed(scene, Request(theory="quasi-static"))
        figures = summary(results)
        # a row has no error, so the error does not count
        kept = all(limit["kept"] for limit in figures["acceptance"]["limits"])
        assert bool(found.columns["limits_kept"][row]) == kept
        assert found.columns["output_error"][row] == pytest.approx(figures["output"]["value"], rel=1e-12)
        masses = [link["mass"]["value"] for link in figures["links"]]
        assert found.columns["mass"][row] == pytest.approx(sum(masses), rel=1e-12)
    assert set(found.columns["limits_kept"]) == {0.0, 1.0}


@pytest.mark.parametrize("name", ["steel", "press", "shaper"])
def test_the_default_output_equals_that_of_the_report(name):
    tables, _ = MECHANISMS[name]
    results = computed(scene_from_dict(tables), Request(theory="quasi-static"))
    output = summary(results)["output"]
    assert output["guessed"]
    path = paths_of(name)[0]
    found = evaluate(tables, [path], [[document_of(tables).variable(path).base]], ["output_error"])
    assert found.units["output_error"] == output["unit"]
    assert found.columns["output_error"][0] == pytest.approx(abs(output["value"]), rel=1e-12)


@pytest.mark.parametrize("name", ["steel", "shaper", "swing"])
def test_cycle_maxima_equal_the_maxima_of_all_positions(name):
    scene = scene_from_dict(MECHANISMS[name][0])
    bent = deflection(scene_motion(scene), scene.sections, joints=scene.joints)
    keys = [key for key in FIELDS if key not in ("q_x", "q_y")]
    found, whole = cycle_maxima(bent, keys), extremes(bent, keys)
    stations = np.linspace(0, 1, 401)
    for key in keys:
        greatest = np.abs(whole[key].value).max(axis=-1)
        np.testing.assert_allclose(found[key].value, greatest, rtol=1e-12, atol=0)
        at = np.take_along_axis(np.abs(whole[key].value), found[key].position[:, None], -1)[:, 0]
        np.testing.assert_allclose(at, greatest, rtol=1e-12)
        seen = np.abs(sample(bent, key, stations)).max(axis=(-2, -1))
        assert (seen <= found[key].value * (1 + 1e-12)).all()
        np.testing.assert_allclose(seen, found[key].value, rtol=1e-2)


@pytest.mark.parametrize(("field", "expected"), [("M", 0.5 * 9.81 * 4), ("left", 0.5 * 9.81 * 4 * 0.003 / 1.8e-10)])
def test_maxima_between_positions_converge_with_fourth_order(field, expected):
    """An arm of 2 m and 1 kg/m bears m g l^2/2 in its level position, which is between two positions."""
    arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A", 1.0),))
    turning = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2}, gravity=-9.81j)
    section = section_of(rectangle(0.006, 0.01), 210e9)
    errors = []
    for count in (16, 32):
        angle = (np.arange(count) + 0.7 + 0.1 * (-1.0) ** np.arange(count)) * 2 * np.pi / count  # uneven
        bent = deflection(motion(turning, angle, 0.0, 0.0, angle), [section])
        plain, found = (cycle_maxima(bent, [field], period=period)[field].value[0] for period in (None, 2 * np.pi))
        assert plain < found
        errors.append(abs(found / expected - 1))
        assert errors[-1] < 0.05 * abs(plain / expected - 1)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)


def test_the_fibre_with_the_larger_stress_is_found():
    """Uniform load and a small tension: the stresses of the two fibres differ by half a per cent."""
    section = section_of(rectangle(0.006, 0.01), 210e9)
    bending = 10.0 / 2 * 0.003 / 1.8e-10
    pull = 0.0025 * bending * 6e-5
    arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),))
    loads = LineLoad("arm", 0, -10j, -10j), PointLoad("arm", "A", pull)
    held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1}, loads=loads)
    found = cycle_maxima(deflection(motion(held, [0.0]), [section]), ["normal"])["normal"]
    np.testing.assert_allclose(found.value, [1.0025 * bending], rtol=1e-12)


def test_bounds_of_polynomials_hold():
    """Bounds decide which positions are skipped; finer stations give tighter bounds."""
    rng = np.random.default_rng(8)
    for count in range(1, 9):
        values = rng.normal(size=(count, 5, 40)) * 4.0 ** rng.integers(-2, 3, (count, 1, 1))
        xi = np.linspace(0, 1, 481)[:, None, None]
        greatest = np.abs(np.polynomial.polynomial.polyval(xi, values, tensor=False)).max(axis=0)
        for steps in (COARSE, FINE):
            low, high = _bounds(values, steps, False)
            assert (greatest <= high).all()
            assert (low <= greatest * (1 + 1e-12)).all()
            assert count < 3 or (low < greatest).any()
            curved = sum(k * (k - 1) * np.abs(value) for k, value in enumerate(values))
            assert (high - low <= curved / (8 * steps**2) + 1e-8 * high).all()


def test_designs_can_have_different_rates_and_starts():
    scene = scene_from_dict(STEEL)
    turn, rates, starts = np.linspace(0, 6, 61), np.array([[50.0], [-80.0]]), np.array([[0.0], [0.4]])
    rated = motion(scene.mechanism, turn, rates[None])
    placed = motion(scene.mechanism, (starts + turn)[None], 100.0)
    for row in range(2):
        alone = motion(scene.mechanism, turn, float(rates[row, 0]))
        np.testing.assert_allclose(rated.acceleration[:, row], alone.acceleration, rtol=1e-12, atol=1e-9)
        other = motion(scene.mechanism, starts[row] + turn, 100.0)
        np.testing.assert_allclose(placed.origin[:, row], other.origin, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(placed.velocity[:, row], other.velocity, rtol=1e-12, atol=1e-9)
    assert rated.columns == placed.columns == (2, 61)


def test_masked_positions_are_ignored():
    scene = scene_from_dict(STEEL)
    bent = deflection(scene_motion(scene), scene.sections)
    best = cycle_maxima(bent, ["w"])["w"].position
    counted = np.arange(24) != best[1]
    second = cycle_maxima(bent, ["w"], counted)["w"]
    values = np.abs(extremes(bent, ["w"])["w"].value)
    np.testing.assert_allclose(second.value, values[:, counted].max(axis=-1), rtol=1e-12)
    none = cycle_maxima(bent, ["w"], np.zeros(24, bool))["w"]
    assert np.isnan(none.value).all()
    assert (none.position == -1).all()


def test_the_unit_of_viscosity_depends_on_the_joint():
    tables = shipped("offset_slider_crank", 4)
    name = next(iter(tables["sliders"] if "sliders" in tables else tables["slots"]))
    tables["joints"] = {"A": {"viscosity": 1.0}, name: {"viscosity": 1.0}}
    document = document_from_dict(tables)
    units = [document.variable(f"joints.{joint}.viscosity").unit for joint in ("A", name)]
    assert units == ["N m s/rad", "N s/m"]


@pytest.mark.parametrize(
    ("file", "path", "size"),
    [
        (shipped_scenes()["pusher"], "sections.crank.depth", 0.03),  # with rolling bearings
        pytest.param(GALLERY / "excavator_arm.toml", "sections.boom.depth", 0.16, marks=pytest.mark.slow),
    ],
    ids=["pusher", "excavator_arm"],
)
def test_designs_with_other_sections_have_the_same_figures_together_and_alone(file, path, size):
    document = read_document(file)
    together = evaluate(document, [path], [[size], [1.1 * size]])
    alone = evaluate(document, [path], [[1.1 * size]])
    assert list(together.reason) == ["", *alone.reason] == ["", ""]
    for name, values in together.columns.items():
        assert values[1] == pytest.approx(alone.columns[name][0], rel=1e-9, nan_ok=True), name


def test_the_stroke_of_a_machine_that_cannot_be_assembled_is_unknown():
    """Warnings are errors in the tests."""
    tables = copy.deepcopy(STEEL)
    tables["run"]["output"] = "B"
    found = evaluate(tables, ["points.D.x"], [[0.35], [9.0]], ["output_stroke"])
    assert np.isnan(found.columns["output_stroke"]).tolist() == [False, True]
