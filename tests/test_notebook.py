"""The interface for notebooks: names, tables, pictures and the page.

`python tests/test_notebook.py` fills docs/first_steps.ipynb. The tests run its cells by exec and check the value of
the last line, without a kernel.
"""

import ast
import json
import re
import sys
from base64 import b64encode
from html import unescape
from pathlib import Path

import browser
import numpy as np
import pytest
from scene_texts import ARM

import elastic
from animations import DIAGRAMS
from elastic import FIELDS, coefficients, extremes, sample
from kinelast import (
    SceneError,
    answer,
    deflection,
    load,
    motion,
    natural_frequencies,
    picture,
    report,
    scene_from_text,
    scene_motion,
    to_pandas,
    to_xarray,
    with_loads,
)
from kinelast.notebook.inline import Value
from kinelast.outputs.sealed import json_bytes
from kinelast.reports.summary import summary
from rigid import MechanismError, PointLoad

DOCS = Path(__file__).parents[1] / "docs"
NOTEBOOK = DOCS / "first_steps.ipynb"
LONGEST = 100_000  # largest output that the notebook keeps [characters]
SPEED, LENGTH, MASS, EA = 50.0, 0.2, 7850 * 6e-5, 210e9 * 6e-5  # ARM: a bar in steady rotation about its end O


@pytest.fixture(scope="module")
def arm():
    return scene_from_text(ARM, "arm")


@pytest.fixture(scope="module")
def four_bar():
    return load("steel_four_bar")


def run_cell(source, names):
    """Return the value of a cell's last line, or None if it is not an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def outputs(value):
    """Return the outputs that a notebook keeps for a value."""
    if value is None:
        return []
    data = {"text/plain": [repr(value)]}
    if hasattr(value, "_repr_png_"):
        data["image/png"] = b64encode(value._repr_png_()).decode()
    if hasattr(value, "_repr_html_") and len(html := value._repr_html_()) < LONGEST:
        data["text/html"] = [html]
    return [{"output_type": "execute_result", "execution_count": None, "metadata": {}, "data": data}]


def code_cells():
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    return notebook, [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


class TestDocs:
    """The guide and the notebook run, and show the printed results."""

    @pytest.mark.slow
    def test_every_snippet_of_the_guide(self, capsys):
        pytest.importorskip("pandas")
        pytest.importorskip("xarray")
        names = {}
        page = (DOCS / "python.md").read_text(encoding="utf-8")
        snippets = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        for snippet in snippets:
            exec(snippet, names)
            if snippet is snippets[0]:  # later snippets reuse these names
                assert names["moved"]["B"].position.shape == (360,)
                assert names["bent"]["coupler"].w.shape == (360, 101)
        assert len(snippets) >= 7
        assert names["checked"].figures["check"]["passed"]
        printed = capsys.readouterr().out.splitlines()
        assert printed[0].startswith("0.3062 kg 309.7 MPa ± ")
        thin, thick = (float(line.split()[2]) for line in printed if line.startswith(("6 mm", "8 mm")))
        assert 6 / 8 * thin < thick < thin  # bending stress is proportional to 1/depth, tension is not
        lowest = natural_frequencies(load("steel_four_bar")).omega[0].min()
        assert names["found"].omega.min() == lowest == pytest.approx(674.7, rel=1e-2)  # summary.json, at 12 positions
        assert names["deformed"].shape == (101,)
        assert names["solved"].joints.B.force.rocker.shape == (90,)

    @pytest.mark.slow
    def test_the_notebook(self):
        names = {}
        _, cells = code_cells()
        assert len(cells) >= 5
        for cell in cells:
            kept = cell["outputs"][0]["data"]["text/plain"] if cell["outputs"] else None
            value = run_cell("".join(cell["source"]), names)
            assert kept == (None if value is None else [repr(value)])
            if cell["outputs"]:
                assert hasattr(value, "_repr_html_") or hasattr(value, "_repr_png_") or isinstance(value, tuple | float)


class TestNames:
    """Points, links and beams by their names in the scene."""

    def test_a_point_and_a_link_that_turn_steadily(self, arm):
        moved = motion(arm)
        tip, at = moved["A"], LENGTH * np.exp(1j * SPEED * moved.time)
        np.testing.assert_allclose(tip.position, at, rtol=0, atol=1e-14)
        np.testing.assert_allclose(tip.velocity, 1j * SPEED * at, rtol=0, atol=1e-11)
        np.testing.assert_allclose(tip.acceleration, -(SPEED**2) * at, rtol=0, atol=1e-9)
        np.testing.assert_allclose(moved["arm"].angle, SPEED * moved.time, rtol=0, atol=1e-13)
        assert moved["arm"].angular_velocity == pytest.approx(SPEED)

    def test_fields_over_positions_and_stations(self, arm):
        beam = deflection(arm, positions=5)["arm"]
        pull = MASS * SPEED**2 * (LENGTH**2 - beam.x**2) / 2
        np.testing.assert_allclose(beam.N, np.tile(pull, (5, 1)), rtol=1e-12, atol=1e-9)
        stretch = MASS * SPEED**2 * (LENGTH**2 * beam.x - beam.x**3 / 3) / (2 * EA)
        np.testing.assert_allclose(beam.u, np.tile(stretch, (5, 1)), rtol=1e-12, atol=1e-18)
        way = np.exp(1j * SPEED * motion(arm, 5).time)[:, None]
        np.testing.assert_allclose(beam.line, way * beam.x, rtol=0, atol=1e-15)
        np.testing.assert_allclose(beam.displacement, way * stretch, rtol=0, atol=1e-18)
        assert set(dir(beam)) == {"x", "line", "displacement", *FIELDS}

    def test_own_loads(self, arm):
        """A transverse tip force that grows with the angle bends the root by its moment, without changing the scene."""
        push = PointLoad("arm", "A", 10j, turning=True, law=lambda moved: np.unwrap(np.angle(moved.direction[1])))
        scenes = with_loads(arm, push), arm
        pushed, plain = (answer(each, "quasi-static", positions=5).beams.arm.M[:, 0] for each in scenes)
        np.testing.assert_allclose(np.abs(pushed - plain), 10 * LENGTH * SPEED * motion(arm, 5).time, atol=1e-12)
        assert not with_loads(arm, push).text
        with pytest.raises(MechanismError, match="Z"):
            with_loads(arm, PointLoad("arm", "Z", 10j))

    def test_unknown_names_are_reported_with_the_known_ones(self, arm):
        bent = deflection(arm, 3)
        for name, call in (("B", motion(arm).__getitem__), ("rod", bent.__getitem__)):
            with pytest.raises(KeyError, match=f'no \\\\?"{name}\\\\?": choose from .*'):
                call(name)
        with pytest.raises(AttributeError, match='no field "q": choose from q_x'):
            _ = bent["arm"].q

    @pytest.mark.slow
    def test_the_theory_of_the_scene_answers(self, four_bar):
        """The steel four-bar vibrates: the answer exceeds the quasi-static one by more than one per cent."""
        largest = report(four_bar).figures["largest_deflection"]
        bent = deflection(four_bar)
        assert abs(bent[largest["label"]].w).max() == pytest.approx(abs(largest["value"]), rel=1e-6)
        static = elastic.deflection(scene_motion(four_bar), four_bar.sections)
        assert abs(sample(static, "w")).max() < 0.99 * abs(largest["value"])

    def test_messages_on_wrong_names(self, tmp_path):
        with pytest.raises(ValueError, match='did you mean "steel_four_bar"'):
            load("steel_for_bar")
        (tmp_path / "bad.toml").write_text(ARM.replace("links.arm", "lniks.arm"))
        with pytest.raises(SceneError, match="lniks"):
            load(tmp_path / "bad.toml")
        for name in "ab":
            (tmp_path / f"{name}.toml").write_text(ARM)
        with pytest.raises(ValueError, match="contains 3 scenes"):
            load(tmp_path)


class TestWords:
    """Fields also have the names used by the command."""

    def test_every_word_is_its_key(self, arm):
        bent = deflection(arm, 3)
        for word, diagram in DIAGRAMS.items():
            if diagram.field is None:
                continue
            np.testing.assert_array_equal(sample(bent, word), sample(bent, diagram.field))
            by_word, by_key = extremes(bent, [word])[word], extremes(bent, [diagram.field])[diagram.field]
            np.testing.assert_array_equal(by_word.value, by_key.value)
            if not FIELDS[diagram.field].greatest_of and not FIELDS[diagram.field].root_of:
                np.testing.assert_array_equal(coefficients(bent, word), coefficients(bent, diagram.field))

    def test_stations_by_their_number(self, arm):
        bent = deflection(arm, 3)
        np.testing.assert_array_equal(sample(bent, "N", 5), sample(bent, "N", [0, 0.25, 0.5, 0.75, 1]))
        assert sample(bent, "axial-force").shape == (1, 3, 101)
        with pytest.raises(ValueError, match=r'no field "moment": choose from q_x.*bending-moment'):
            sample(bent, "moment")


class TestModes:
    """Natural frequencies of a scene."""

    BETA = 2e-5  # [s] damping of the steel

    def test_an_arm(self):
        """An arm clamped at its drive: omega = 1.8751^2 sqrt(EI/m l^4), damping ratio beta omega/2."""
        scene = scene_from_text(ARM.replace("density", f"damping = {self.BETA}\ndensity"), "arm")
        found = natural_frequencies(scene, modes=2, positions=3)
        omega = np.array([1.87510407, 4.69409113]) ** 2 * np.sqrt(EA * 0.006**2 / 12 / (MASS * LENGTH**4))
        ratio = found.omega / omega[:, None]
        assert ((ratio > 1 - 6e-3) & (ratio < 1)).all()  # shear and rotary inertia reduce the frequency
        np.testing.assert_allclose(found.frequency, found.omega / (2 * np.pi), rtol=1e-15)
        np.testing.assert_allclose(found.damping, self.BETA * found.omega / 2, rtol=1e-9)
        along = np.exp(1j * SPEED * found.motion.time)
        shapes, line = found["arm"].displacement, found["arm"].line
        np.testing.assert_allclose(line[:, -1], LENGTH * along, atol=1e-15)
        np.testing.assert_allclose(np.abs((shapes[..., -1] * np.conj(along)).imag), 1.0, rtol=1e-9)
        assert shapes.shape == (2, 3, 101)
        reported = "at least 125.2 Hz, 781.6 Hz at 3 positions; damping ratio from 0.79 %"
        assert repr(found) == f'NaturalFrequencies("arm": {reported})'

    def test_impossible_requests_are_refused(self, arm):
        with pytest.raises(ValueError, match="modes: expected 1 or more"):
            natural_frequencies(arm, modes=0)
        with pytest.raises(KeyError, match="choose from arm"):
            natural_frequencies(arm, positions=1)["rod"]
        with pytest.raises(ValueError, match="no link has a section"):
            natural_frequencies(load("andrews_driven"))


class TestFigures:
    """Figures of an answer: by name, and printed with their unit."""

    def test_by_name_without_the_table(self, arm):
        figures = answer(arm).figures
        assert float(figures["mass"]) == pytest.approx(MASS * LENGTH)
        assert figures["mass"] is figures["figures"]["mass"]
        assert figures["run"]["positions"] == len(motion(arm).time)
        with pytest.raises(KeyError, match=r'no figure .*"mas.*did you mean .*"mass'):
            figures["mas"]

    def test_a_value_prints_as_a_number_and_a_unit(self, arm):
        """7850 kg/m^3 * 60 mm^2 * 200 mm = 0.0942 kg; at 50 rad/s the axial force is m w^2 l/2 = 23.55 N."""
        for shown in (answer(arm), report(arm)):
            assert f"{shown.figures['mass']}" == repr(shown.figures["mass"]) == "0.0942 kg"
            assert repr(shown.figures["peaks"]["arm"]["N"]).startswith("23.55 N")
            assert "'value'" not in repr(shown.figures)
        assert repr(Value({"value": 0.0254, "unit": "m", "error": 0.000254}, {"m": (1 / 0.0254, "in")})) == "1 in ± 1 %"
        assert repr(Value({"value": None, "unit": "m"}, {})) == "–"

    def test_figures_are_still_the_data_of_summary_json(self, arm):
        solved = answer(arm)
        plain = summary(solved.results)
        for read in (json.loads(json.dumps(solved.figures)), json.loads(json_bytes(solved.figures))):
            assert {key: read[key] for key in plain} == json.loads(json.dumps(plain))


class TestTables:
    """pandas and xarray, if installed."""

    def test_a_motion_as_a_table(self, arm):
        pytest.importorskip("pandas")
        moved = motion(arm, 8)
        table = to_pandas(moved)
        angle = SPEED * moved.time
        np.testing.assert_allclose(table["A.vx [m/s]"], -SPEED * LENGTH * np.sin(angle), atol=1e-12)
        np.testing.assert_allclose(table["arm.angle [rad]"], angle, atol=1e-13)
        assert table.index.name == "time [s]"
        np.testing.assert_array_equal(table.index, moved.time)

    def test_a_deflection_as_the_table_that_the_command_writes(self, arm, tmp_path):
        pandas = pytest.importorskip("pandas")
        from kinelast.cli.command import main

        (tmp_path / "arm.toml").write_text(ARM)
        assert main([str(tmp_path / "arm.toml"), "-o", str(tmp_path / "out"), "--quiet"]) == 0
        written = pandas.read_csv(tmp_path / "out" / "arm" / "positions.csv", index_col=0)
        table = to_pandas(deflection(arm))
        assert list(table.columns) == list(written.columns)
        np.testing.assert_allclose(table.to_numpy(), written.to_numpy(), rtol=1e-15)  # like numbers read by pandas

    def test_data_sets_have_coordinates_and_units(self, arm):
        pytest.importorskip("xarray")
        bent = deflection(arm, 4)
        data = to_xarray(bent, stations=3)
        drive = {name: data[name] for name in ("arm.effort", "arm.rate", "arm.power")}
        np.testing.assert_allclose(drive["arm.power"], drive["arm.effort"] * drive["arm.rate"], rtol=1e-14)
        assert [column.attrs["units"] for column in drive.values()] == ["N m", "rad/s", "W"]
        assert data["ground.Fx"].dims == ("position",)
        pull = MASS * SPEED**2 * LENGTH**2 / 2 * np.array([1.0, 0.75, 0.0])
        np.testing.assert_allclose(
            data["N"].sel(beam="arm").transpose("position", "station"), np.tile(pull, (4, 1)), atol=1e-9
        )
        np.testing.assert_allclose(data["x"].sel(beam="arm"), [0.0, LENGTH / 2, LENGTH])
        assert {key: data[key].attrs["units"] for key in ("N", "M", "w", "mises", "x", "time", "arm_angle")} == {
            "N": "N", "M": "N m", "w": "m", "mises": "Pa", "x": "m", "time": "s", "arm_angle": "rad"}  # fmt: skip
        moved = to_xarray(bent.motion)
        np.testing.assert_allclose(np.hypot(moved["vx"], moved["vy"]).sel(point="A"), SPEED * LENGTH)
        assert float(moved["angular_velocity"].sel(link="arm")[0]) == pytest.approx(SPEED)
        assert moved["ax"].attrs["units"] == "m/s^2"

    @pytest.mark.parametrize(("name", "made"), [("pandas", to_pandas), ("xarray", to_xarray)])
    def test_missing_packages_are_named(self, name, made, arm, monkeypatch):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ModuleNotFoundError, match=f"{name} is not installed: pip install {name}"):
            made(motion(arm, 2))


class TestShown:
    """The display in a notebook."""

    def test_one_line_and_few_words(self, arm):
        for shown in (
            arm,
            motion(arm, 3),
            deflection(arm, 3),
            motion(arm, 3)["A"],
            deflection(arm, 3)["arm"],
            report(arm),
        ):
            assert "\n" not in repr(shown)
            assert len(repr(shown)) < 250
        for shown in (arm, motion(arm, 3), deflection(arm, 3)):
            assert "arm" in shown._repr_html_()
            assert len(shown._repr_html_()) < 500

    def test_names_are_text(self):
        scene = scene_from_text('title = "<script>alert(1)</script>"\n' + ARM.replace("title", "# "))
        for shown in (scene, motion(scene, 3), deflection(scene, 3), report(scene, 3)):
            assert "<script>" not in shown._repr_html_()

    @pytest.mark.slow
    def test_a_picture(self, arm):
        from io import BytesIO

        from PIL import Image

        shown = picture(deflection(arm, 4), "axial-force", 1, size=(320, 192), show=("peak",))
        with Image.open(BytesIO(shown._repr_png_())) as image:
            assert image.size == (320, 192)
            assert len(image.getcolors(100_000)) > 20
        with pytest.raises(ValueError, match="position 4 cannot be drawn: expected 0 to 3"):
            picture(deflection(arm, 4), "deflection", 4)

    def test_the_report_equals_that_of_the_command(self, arm, tmp_path):
        from kinelast.cli.command import main

        (tmp_path / "arm.toml").write_text(ARM)
        assert main([str(tmp_path / "arm.toml"), "-o", str(tmp_path / "out"), "--check", "--quiet"]) == 0
        written = json.loads((tmp_path / "out" / "arm" / "summary.json").read_text())
        reported = report(arm, check=16)
        assert reported.figures["largest_stress"]["value"] == written["largest_stress"]["value"]
        assert reported.figures["check"]["passed"]
        html = reported._repr_html_()
        inside = unescape(re.search(r'srcdoc="([^"]*)"', html)[1])
        assert inside.encode() == reported.page

    @pytest.mark.slow
    def test_the_page_runs_in_its_frame(self, arm, tmp_path):
        driver = browser.started()
        try:
            path = tmp_path / "cell.html"
            path.write_text(f'<html><body data-ready="1">{report(arm)._repr_html_()}</body></html>', encoding="utf-8")
            page = browser.Page(driver, path)
            driver.switch_to.frame(0)
            for _ in range(200):
                if driver.execute_script("return document.body.dataset.ready"):
                    break
            assert driver.execute_script("return kinelast.model.beams.length") == 1
            assert [entry for entry in page.logs() if entry["level"] == "SEVERE"] == []
            assert page.requests() == []
        finally:
            driver.quit()


if __name__ == "__main__":
    whole, cells = code_cells()
    known: dict = {}
    for cell in cells:
        cell["outputs"] = outputs(run_cell("".join(cell["source"]), known))
    NOTEBOOK.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
