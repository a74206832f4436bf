"""A mechanism built in Python equals the scene file that it writes, and its parts are the tables of the format."""

import subprocess
import sys
from inspect import signature
from types import ModuleType
from typing import Annotated, get_args, get_origin

import msgspec
import numpy as np
import pytest
from tiers import in_tiers

import kinelast
from kinelast import (
    SceneError,
    answer,
    build,
    deflection,
    load,
    motion,
    picture,
    read_document,
    report,
    shipped_scenes,
    to_pandas,
)
from kinelast.scene.format import SceneTable
from kinelast.scene.tables import StrictTable


def plain(kind):
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def inside(kind):
    """Return the tables in the type of an entry."""
    kind = plain(kind)
    if isinstance(kind, type) and issubclass(kind, StrictTable):
        return [kind]
    return [table for part in get_args(kind) for table in inside(part)]


def class_name(table):
    return table.__name__.removesuffix("Table")


def test_the_stub_has_the_generated_classes(monkeypatch):
    stub = ModuleType("stub")
    monkeypatch.setitem(sys.modules, "stub", stub)
    exec(build.stub_text(), stub.__dict__)
    assert {*stub.__all__} == {*build.__all__}
    for name in build.__all__:
        written, made = (getattr(module, name) for module in (stub, build))
        assert (signature(written), written.__doc__) == (signature(made), made.__doc__)
        if isinstance(made, type):
            assert [each.__name__ for each in written.__mro__] == [each.__name__ for each in made.__mro__]
            assert (written.under, written.spelled) == (made.under, made.spelled)
            assert getattr(written, "shape", None) == getattr(made, "shape", None)


@pytest.mark.slow
def test_a_type_checker_finds_wrong_keys(tmp_path):
    (tmp_path / "stubbed.pyi").write_text(build.stub_text())
    right = tmp_path / "right.py"
    right.write_text(
        "from stubbed import Circle, Drive, Link\nLink('a', [], section=Circle('c', 3))\nDrive(link='a', speed=5)\n"
    )
    wrong = tmp_path / "wrong.py"
    wrong.write_text("from stubbed import Link\nLink('a', [], lenth=3)\nLink('a', section=5)\n")

    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", right.name, wrong.name]
    found = subprocess.run(command, check=False, cwd=tmp_path, capture_output=True, text=True).stdout
    assert 'wrong.py:2: error: Unexpected keyword argument "lenth"' in found
    assert 'wrong.py:3: error: Argument "section" to "Link" has incompatible type "int"' in found
    assert "right.py" not in found


def part_of(kind, content, name=None):
    """Return a table of a file as a part."""
    if kind in ("points", "masses"):
        return build.Point(name, *content) if kind == "points" else build.PointMass(name, content)
    table = kind
    if isinstance(kind, str):
        entry = next(each for each in msgspec.structs.fields(SceneTable) if each.encode_name == kind)
        table = next(each for each in inside(entry.type) if each.__struct_config__.tag in (None, content.get("shape")))
    keys = {each.encode_name: each for each in msgspec.structs.fields(table)}
    given = {keys[key].name: inner(keys[key].type, value) for key, value in content.items() if key != "shape"}
    return getattr(build, class_name(table))(**given, **({} if name is None else {"name": name}))


def inner(kind, value):
    """Return the value of a key with parts instead of tables."""
    tables = inside(kind)
    if not tables or isinstance(value, str | float | int):
        return value
    if isinstance(value, dict) and get_origin(plain(kind)) is dict:
        return {key: inner(get_args(plain(kind))[1], each) for key, each in value.items()}
    if isinstance(value, dict):
        return part_of(tables[0], value)
    return [part_of(tables[0], each) if isinstance(each, dict) else each for each in value]


def in_full(tables):
    """Return the tables of a file with all tolerances as tables."""
    tolerances = tables.get("tolerances", {}).items()
    full = {path: each if isinstance(each, dict) else {"plus_minus": each} for path, each in tolerances}
    return {**tables, **({"tolerances": full} if full else {})}


def rebuilt(document):
    """Return a document rebuilt from parts, in the order of its file."""
    parts, head = [], {}
    for key, value in in_full(document.tables).items():
        entry = next(each for each in msgspec.structs.fields(SceneTable) if each.encode_name == key)
        if get_origin(plain(entry.type)) is dict:
            parts += [part_of(key, each, name) for name, each in value.items()]
        elif inside(entry.type):
            parts += [part_of(key, each) for each in (value if isinstance(value, list) else [value])]
        else:
            head[key] = value
    return build.mechanism(*parts, name=document.name, **head)


@pytest.mark.parametrize("path", in_tiers(shipped_scenes().values(), 5, 11), ids=shipped_scenes())
def test_every_shipped_scene_can_be_rebuilt(path):
    document = read_document(path)
    again = rebuilt(document)
    assert again.tables == in_full(document.tables)
    assert again.scene.labels == document.scene.labels


BAR = {"depth": "6 mm", "width": "10 mm"}


def four_bar(rocker="250 mm"):
    """Return the steel four-bar as built in docs/python.md."""
    steel = build.Material("steel", E="210 GPa", poisson=0.3, density="7850 kg/m^3", yield_stress="355 MPa")
    bar = build.Rectangle("bar", depth="6 mm", width="10 mm")
    Q, A, B, D = (build.Point(*each) for each in (("O", 0, 0), ("A", 0.1, 0), ("B", 0.28, 0.24), ("D", 0.35, 0)))
    crank = build.Link("crank", [Q, A], length="100 mm", section=bar, material=steel)
    rod = build.Link("coupler", [A, B], length="300 mm", section=bar, material=steel)
    end = build.Link("rocker", [D, B], length=rocker, section=bar, material=steel)
    more = build.Drive(link=crank, speed="100 rad/s"), build.Run(accuracy="5 %")
    return build.mechanism(build.Link("ground", [Q, D]), crank, rod, end, *more, name="steel_four_bar")


@pytest.mark.parametrize(
    "theory", ["quasi-static", *(pytest.param(each, marks=pytest.mark.slow) for each in ("elastodynamic", None))]
)
def test_a_built_mechanism_and_its_file_give_the_same_bits(theory, tmp_path):
    built = four_bar()
    (tmp_path / "again.toml").write_text(built.text())
    options = {"theory": theory, "positions": 48}
    result = answer(load("steel_four_bar"), **options)
    for mine in (answer(load(tmp_path / "again.toml"), **options), answer(built, **options)):
        for name in result.beams:
            assert mine.beams[name].w.tobytes() == result.beams[name].w.tobytes()
        assert mine.drives.crank.effort.tobytes() == result.drives.crank.effort.tobytes()
        assert mine.figures["figures"] == result.figures["figures"]
    assert four_bar("260 mm").scene.mechanism.links[3].points["B"] == 0.26


class TestParts:
    """Contents of parts, and errors in one sentence."""

    def test_parts_accept_numpy_numbers_and_parts_for_names(self):
        Q, A = build.Point("O", np.float64(0), 0), build.Point("A", *np.array([0.2, 0.0]))
        arm = build.Link(
            "arm", [Q, A], section=build.Rectangle("bar", **BAR), material="S235", masses={A: np.float32(2)}
        )
        load_ = build.Load(arm, point=A, force=3 + 4j)
        friction = build.Joint(Q, friction=np.float64(0.1), radius="5 mm")
        built = build.mechanism(build.Link("ground", [Q]), arm, build.Drive(link=arm, speed=50), load_, friction)
        assert built.tables["points"] == {"O": [0.0, 0], "A": [0.2, 0.0]}
        assert built.tables["links"]["arm"]["masses"] == {"A": 2.0}
        assert built.tables["loads"] == [{"link": "arm", "point": "A", "force": [3.0, 4.0]}]
        assert built.tables["joints"] == {"O": {"friction": 0.1, "radius": "5 mm"}}
        assert built.scene.mechanism.friction

    def test_a_mistake_is_one_sentence(self):
        Q, other = build.Point("O", 0, 0), build.Point("O", 1, 0)
        with pytest.raises(TypeError, match="expected a part, such as Link"):
            build.mechanism({"points": {}})
        with pytest.raises(TypeError, match="unexpected keyword argument 'lenth'"):
            build.Link("arm", [Q], lenth=3)
        with pytest.raises(ValueError, match=r'there are two "O" under .points., with different keys'):
            build.mechanism(Q, other)
        with pytest.raises(SceneError, match=r"\[links.arm\] length: expected a length"):
            build.mechanism(build.Link("ground", [Q]), build.Link("arm", [Q], length="3 kg"))

    def test_repr_is_one_line(self):
        Q = build.Point("O", 0, 0)
        assert repr(Q) == 'Point("O")'
        assert repr(build.Link("ground", [Q])) == 'Link("ground")'
        assert repr(build.Drive(link=build.Link("arm", [Q]), speed=5)) == "Drive(link='arm', speed=5)"


class TestAnswer:
    """An answer by names, compared with the closed form of a steadily rotating arm."""

    SPEED, LENGTH, MASS = 50.0, 0.2, 7850 * 6e-5

    @pytest.fixture
    def arm(self):
        Q, A = build.Point("O", 0, 0), build.Point("A", self.LENGTH, 0)
        steel = build.Material("steel", E=210e9, density=7850)
        arm = build.Link("arm", [Q, A], section=build.Rectangle("bar", **BAR), material=steel)
        parts = build.Link("ground", [Q]), arm, build.Drive(link=arm, speed=self.SPEED), build.Run(positions=8)
        return build.mechanism(*parts, name="arm")

    @pytest.fixture
    def result(self, arm):
        return answer(arm, theory="quasi-static")

    def test_forces_of_joints_and_efforts_of_drives(self, result):
        pull = self.MASS * self.LENGTH**2 * self.SPEED**2 / 2
        inward = -pull * np.exp(1j * self.SPEED * result.motion.time)
        np.testing.assert_allclose(result.joints.O.force.arm, inward, rtol=1e-12)
        np.testing.assert_allclose(result.joints["O"].force["ground"], -inward, rtol=1e-12)
        assert abs(result.drives.arm.effort).max() < 1e-12 * pull
        np.testing.assert_allclose(result.drives.arm.rate, self.SPEED)
        assert result.drives.arm.power.shape == result.joints.O.moment.arm.shape == (8,)
        stretch = 2 * pull * self.LENGTH / (3 * 210e9 * 6e-5)
        np.testing.assert_allclose(abs(result.points.A.displacement), stretch, rtol=1e-12)
        assert result.links.arm.angular_velocity == pytest.approx(self.SPEED)

    def test_names_iterate_and_complete(self, result):
        assert [*result.joints] == ["O"]
        assert [*result.points] == ["O", "A"]
        assert [*result.motion] == result.motion.keys() == ["O", "A", "ground", "arm"]
        assert dict(result.deflection).keys() == {"arm"} == {*result.deflection}
        for named in (
            result.points,
            result.links,
            result.beams,
            result.joints,
            result.drives,
            result.motion,
            result.deflection,
        ):
            assert named._ipython_key_completions_() == [*named]
        assert {"O", "A"} <= {*dir(result.points)}
        assert "\n" not in repr(result)
        assert "arm" in result._repr_html_()
        with pytest.raises(AttributeError, match='no "B": choose from O, A'):
            _ = result.points.B
        with pytest.raises(KeyError, match="choose from arm"):
            _ = result.drives["crank"]

    def test_the_error_and_the_theory_are_those_of_the_report(self, arm):
        result, figures = answer(arm, accuracy="20 %"), report(arm, accuracy=0.2).figures
        assert (result.theory, result.error) == (figures["theory"]["name"], figures["theory"]["error"])
        assert result.figures["largest_deflection"] == figures["largest_deflection"]


def steel():
    return read_document(shipped_scenes()["steel_four_bar"])


class TestWrongArguments:
    """Wrong arguments raise Python's usual errors with one sentence."""

    @pytest.mark.parametrize("ask", [motion, deflection, report, answer])
    def test_a_name_is_not_a_scene(self, ask):
        with pytest.raises(TypeError, match=r"expected a scene, .*, got 'steel_four_bar'; load\('steel_four_bar'\)"):
            ask("steel_four_bar")

    @pytest.mark.parametrize("ask", [picture, to_pandas])
    def test_a_scene_is_not_a_result(self, ask):
        with pytest.raises(TypeError, match=r"expected a .*deflection"):
            ask(load("steel_four_bar"))

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"theory": "elastodynamics"}, 'expected one of quasi-static, .*; did you mean "elastodynamic"'),
            ({"accuracy": 5}, "accuracy: expected a share"),
            ({"accuracy": 0.1, "theory": "quasi-static"}, "give either accuracy or theory"),
            ({"positions": 0}, "positions: expected a whole number from 1"),
            ({"positions": 1.5}, "positions: expected a whole number"),
        ],
    )
    def test_no_such_option(self, options, words):
        with pytest.raises(ValueError, match=words):
            answer(four_bar(), **options)

    @pytest.mark.parametrize("name", ["nowhere.toml", "nowhere"])
    def test_a_missing_file(self, name, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        with pytest.raises(FileNotFoundError, match="nowhere"):
            load(name)
        with pytest.raises(FileNotFoundError, match="there is no such file"):
            read_document(tmp_path / "nowhere.toml")

    def test_the_editor_of_a_missing_file(self, tmp_path):
        pytest.importorskip("uvicorn", reason="the extra live is not installed")
        with pytest.raises(
            FileNotFoundError, match=r"expected a \.toml file \(which need not exist\), a report, or a shipped"
        ):
            kinelast.live(tmp_path / "nowhere" / "mine.toml")

    @pytest.mark.parametrize(
        ("ask", "error", "words"),
        [
            (lambda: kinelast.scene_from_text(5), TypeError, "expected the text of a scene file, got 5"),
            (lambda: kinelast.structure_from_text(5), TypeError, "expected the text of a scene file, got 5"),
            (lambda: kinelast.scene_from_dict("x"), TypeError, 'as a dictionary, got "x"'),
            (lambda: read_document(None), TypeError, "expected the path of a scene file, got None"),
            (lambda: kinelast.read_structure(5), TypeError, "expected the path of a scene file, got 5"),
            (lambda: kinelast.scene_motion("x"), TypeError, 'expected a scene, as of load.*, got "x"'),
            (lambda: steel().with_values(["x"]), TypeError, "expected a mapping from paths to numbers in SI units"),
            (lambda: steel().with_values({"sections.bar.depth": "5 mm"}), TypeError, "with_changes accepts other"),
            (lambda: build.mechanism(build.Point("O", None, 0)), ValueError, 'the Point "O" has no number for x'),
        ],
    )
    def test_the_error_is_one_sentence(self, ask, error, words):
        with pytest.raises(error, match=words) as caught:
            ask()
        assert "\n" not in str(caught.value)

    def test_a_single_change(self):
        assert steel().with_changes("sections.bar.depth=5 mm").values == {"sections.bar.depth": 0.005}

    def test_dir_lists_only_public_names(self):
        assert dir(build) == sorted(build.__all__)
