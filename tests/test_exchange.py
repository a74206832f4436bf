"""Mechanisms from other programs are imported as drawn there, and have the same motion."""

import json
import re
import time
from xml.etree import ElementTree

import numpy as np
import pytest
from scene_texts import SLIDER_CRANK, edited

import kinelast
from exchange import ExchangeError, read, scene_text, written
from exchange.dxf import DrawnLink, dxf_text
from exchange.reading import of_text
from kinelast.answers.results import Results
from kinelast.cli.command import main
from kinelast.outputs.exported import changed_laws, exchanged, left_out
from kinelast.outputs.pictures import write_dxf
from kinelast.scene.data import scene_deflection
from rigid import position_of

# The number system of PMKS+: thousandths in base 64, negative numbers with a leading 0.
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"


def coded(value):
    number, text = abs(round(1000 * value)), ""
    while number:
        number, digit = divmod(number, 64)
        text = DIGITS[digit] + text
    return ("0" if value <= 0 else "") + text


def pmks():
    """Return a slider-crank of 3 and 8 cm at 45 degrees and 30 rpm, in the format of PMKS+."""
    b = 3 * np.exp(0.25j * np.pi)
    c = b.real + np.sqrt(64 - b.imag**2)
    rows = [("M", "A", 0j), ("G", "B", b), ("G", "C", c), ("L", "D", c)]  # driven and fixed, plain, plain, sliding
    joints = "".join(f"{mark}{key},{key},{coded(complex(z).real)},{coded(complex(z).imag)},0." for mark, key, z in rows)
    links = "YRab,AB,Fe,Fe,0,0,c5cae9,A,B,,.YRbc,BC,Fe,Fe,0,0,c5cae9,B,C,,.YPcd,CD,Fe,0,0,0,,C,D,,."
    return f"0O.TY.U,0.101.{joints}.{links}..JAq"


LINKAGE = """<linkage2><program units="Millimeters"/>
<connector id="0" x="0" y="0" anchor="true" input="true" rpm="-30"/><connector id="1" x="4" y="6"/>
<connector id="2" x="120" y="50" draw="true"/><connector id="3" x="100" y="-40" anchor="true"/>
<connector id="4" x="108" y="-4" slider="true"><slidelimit id="3"/><slidelimit id="2"/></connector>
<connector id="5" x="108" y="-140" anchor="true"/><connector id="6" x="150" y="-60"/>
<connector id="9" x="1" y="1" layer="1"/>
<Link id="1"><connector id="0"/><connector id="1"/></Link><Link id="2"><connector id="1"/><connector id="2"/></Link>
<Link id="3"><connector id="3"/><connector id="2"/></Link>
<Link id="4"><connector id="4"/><connector id="6"/><connector id="5"/></Link></linkage2>"""

MEC2 = {
    "nodes": [
        {"id": "A0", "base": True}, {"id": "B0", "x": 200, "base": True}, {"id": "A", "y": 50},
        {"id": "B", "x": 250, "y": 120}, {"id": "C", "x": 125, "y": 150},
    ],
    "constraints": [
        {"id": "a", "p1": "A0", "p2": "A", "len": {"type": "const"},
         "ori": {"type": "drive", "func": "linear", "Dt": 5}},
        {"id": "b", "p1": "A", "p2": "B", "len": {"type": "const"}},
        {"id": "c", "p1": "B0", "p2": "B", "len": {"type": "const"}},
        {"id": "b2", "p1": "A", "p2": "C", "len": {"type": "const"}, "ori": {"type": "const", "ref": "b"}},
    ],
    "views": [{"show": "pos", "of": "C", "as": "trace"}],
}  # fmt: skip

PYLINKAGE = {
    "name": "four-bar",
    "joints": [
        {"id": "O1", "type": "ground", "position": [0, 0]}, {"id": "O2", "type": "ground", "position": [100, 0]},
        {"id": "A", "type": "revolute", "position": [0, 25]}, {"id": "B", "type": "revolute", "position": [68, 50.6]},
        {"id": "T", "type": "tracker", "position": [34, 38], "ref_joint1_id": "A", "ref_joint2_id": "B"},
    ],
    "links": [
        {"id": "g", "type": "ground", "joints": ["O1", "O2"]},
        {"id": "crank", "type": "driver", "joints": ["O1", "A"], "motor_joint": "O1", "angular_velocity": -0.1},
        {"id": "coupler", "type": "link", "joints": ["A", "B"]},
        {"id": "rocker", "type": "link", "joints": ["B", "O2"]},
    ],
}  # fmt: skip


def linkage_sim():
    """Return a slider-crank of 1 and 3 m whose crank starts at 0.7 rad; the bodies have local axes."""

    def body(mass, **points):
        return {"attachment_points": points, "mass": mass, "cg_local": [0, 0], "izz_cg": 0.1}

    def pin(i, p, j, q):
        return {"type": "revolute", "body_i": i, "point_i": p, "body_j": j, "point_j": q}

    return {
        "schema_version": "1.0.0",
        "bodies": {
            "ground": body(0, O=[0, 0], rail=[3, 0]), "crank": body(1, A=[0, 0], B=[1, 0]),
            "rod": body(2, B=[0, 0], C=[3, 0]), "block": body(0.5, C=[0, 0]),
        },
        "joints": {
            "J1": pin("ground", "O", "crank", "A"), "J2": pin("crank", "B", "rod", "B"),
            "J3": pin("rod", "C", "block", "C"),
            "P": pin("ground", "rail", "block", "C") | {"type": "prismatic", "axis_local_i": [1, 0]},
        },
        "drivers": {
            "D": {"type": "constant_speed", "body_i": "ground", "body_j": "crank", "omega": 2.0, "theta_0": 0.7},
        },
    }  # fmt: skip


def moved(text, title="mine"):
    """Return the scene and motion of a text of another program."""
    scene = kinelast.scene_from_text(scene_text(of_text(text, title)))
    return scene, kinelast.scene_motion(scene)


def test_a_slider_crank_of_pmks_moves_as_its_lengths_say():
    scene, motion = moved(pmks())
    crank = motion.drive[0]
    assert scene.run.duration == pytest.approx(2.0)  # a turn at 30 rpm
    expected = 0.03 * np.cos(crank) + np.sqrt(0.08**2 - (0.03 * np.sin(crank)) ** 2)
    place = position_of(motion, scene.mechanism.index["BC"], "C")
    np.testing.assert_allclose(place, expected, atol=2e-5)  # drawn to a hundredth of a millimetre


def test_a_file_of_linkage_has_its_slots_its_sense_and_its_traced_point():
    drawing = of_text(LINKAGE, "mine")
    assert drawing.slots["slot_P4"].on == "link_3"
    assert drawing.traced == "P2"
    assert drawing.drives[0].speed == "30 rpm"  # clockwise is positive in Linkage
    assert "P9" not in drawing.points  # drawn apart from the mechanism
    scene, motion = moved(LINKAGE)
    names = [link.name for link in scene.mechanism.links]
    coupler, rocker = (motion.origin[names.index(name)] for name in ("link_2", "link_3"))
    assert np.abs(coupler - 0).max() == pytest.approx(np.hypot(4, 6) / 1000)
    assert np.ptp(np.abs(rocker - 0.1 + 0.04j)) < 1e-12


def test_a_point_fixed_on_another_of_mec2_is_of_its_link():
    drawing = of_text(f"<mec-2 width='3'>{json.dumps(MEC2)}</mec-2>", "mine")
    assert drawing.links["b"].points == ("A", "B", "C")
    assert drawing.traced == "C"
    scene, _ = moved(json.dumps(MEC2))
    assert scene.run.duration == pytest.approx(5.0)


def test_a_dwell_of_mec2_has_no_stroke():
    """The crank turns by 2 rad in 1 s and back in 1 s, and rests for 1 s before each turn."""
    parts = [{"func": "const", "dt": 1}, {"func": "linear", "dt": 1, "dz": 1}, {"func": "const", "dt": 1},
             {"func": "linear", "dt": 1, "dz": -1}]  # fmt: skip
    law = {"type": "drive", "Dt": 4, "Dw": 2, "func": "seq", "args": parts}
    crank, *others = MEC2["constraints"]
    (drive,) = of_text(json.dumps({**MEC2, "constraints": [{**crank, "ori": law}, *others]}), "mine").drives
    assert [segment["curve"] for segment in drive.law] == ["dwell", "constant-speed", "dwell", "constant-speed"]
    assert drive.strokes == [2.0, -2.0]
    assert drive.mean_speed == 2.0  # [rad/s]


def test_empty_slots_and_unknown_nodes_are_left_out_and_reported():
    """Published models of mec2 include unfinished ones."""
    idle = {"id": "s", "p1": "B0", "p2": "H", "ori": {"type": "const"}}
    lost = {"id": "t", "p1": "I", "p2": "A", "len": {"type": "const"}}
    nodes = [*MEC2["nodes"], {"id": "H", "x": 200, "y": 9}]
    text = json.dumps({**MEC2, "nodes": nodes, "constraints": [*MEC2["constraints"], idle, lost]})
    drawing = of_text(text, "mine")
    assert "a slot is left out: no link has its point H" in drawing.notes
    assert "constraint t is left out: there is no node I" in drawing.notes
    scene, motion = moved(text)
    _, plain = moved(json.dumps(MEC2))
    np.testing.assert_array_equal(motion.origin, plain.origin)
    assert "H" not in drawing.points or "H" not in {point for link in scene.mechanism.links for point in link.points}


def test_a_four_bar_of_pylinkage_closes_and_turns_its_way():
    _, motion = moved(json.dumps(PYLINKAGE))
    assert motion.drive[0][1] < motion.drive[0][0]
    assert np.isfinite(motion.condition).all()


def test_bodies_of_linkage_sim_are_put_together():
    scene, motion = moved(json.dumps(linkage_sim()))
    at = [link.name for link in scene.mechanism.links].index("block")
    crank = motion.drive[0]
    assert crank[0] == pytest.approx(0.7)
    sign = np.sign(motion.origin[at][0].real - np.cos(0.7))  # the sign of the assembly found
    np.testing.assert_allclose(motion.origin[at], np.cos(crank) + sign * np.sqrt(9 - np.sin(crank) ** 2), atol=1e-9)


def test_lines_of_a_dxf_drawing_are_links(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new(units=4)
    for start, end in (((0, 0), (20, 30)), ((20, 30), (120, 50)), ((120, 50), (100, -40))):
        drawing.modelspace().add_line(start, end)
    drawing.saveas(tmp_path / "four.dxf")
    scene = kinelast.scene_from_text(scene_text(read(str(tmp_path / "four.dxf"))))
    assert [len(link.points) for link in scene.mechanism.links] == [2, 2, 2, 2]
    assert np.isfinite(kinelast.scene_motion(scene).condition).all()


@pytest.mark.parametrize(
    "text",
    ["", "{", "{}", '{"joints": 1, "links": 2}', "<linkage2><connector/></linkage2>", "?j=A,1&l=", "0.1.2", "a" * 1000,
     '{"nodes": [], "constraints": [{}]}', '{"bodies": {}, "joints": {}}', "<linkage2><!ENTITY a 'b'></linkage2>"],
)  # fmt: skip
def test_files_without_a_mechanism_are_reported(text):
    with pytest.raises(ExchangeError):
        scene_text(of_text(text, "mine"))


def test_the_command_writes_a_scene_to_begin_with_and_never_over_another(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walker.json").write_text(json.dumps(MEC2))
    assert main(["--import", "walker.json"]) == 0
    assert "pixels" in capsys.readouterr().err  # the command reports its assumptions
    assert main(["--copy", "steel_four_bar"]) == main(["--new", "mine"]) == 0
    for name in ("walker", "steel_four_bar", "mine"):
        text = (tmp_path / f"{name}.toml").read_text()
        assert text.startswith("#:schema file:")
        kinelast.scene_from_text(text)
    edited = (tmp_path / "mine.toml").read_text() + "# mine\n"
    (tmp_path / "mine.toml").write_text(edited)
    assert main(["--new", "mine"]) == main(["--copy", "steel_for_bar"]) == main(["--import", "none.json"]) == 2
    said = capsys.readouterr().err
    assert "already exists" in said
    assert 'did you mean "steel_four_bar"?' in said
    assert (tmp_path / "mine.toml").read_text() == edited


def test_the_first_scene_is_that_of_the_docs():
    from pathlib import Path

    docs = (Path(__file__).parent.parent / "docs" / "scenes.md").read_text(encoding="utf-8")
    first = Path(kinelast.__file__).parent / "scene" / "first.toml"
    assert f"```toml\n{first.read_text(encoding='utf-8')}```" in docs


WELDED = """
points = {A = [0, 0], B = [0.1, 0], C = [0.3, 0.2], D = [0.4, 0], T = [0.2, 0.3]}
masses = {T = "1 kg"}
drives = [{link = "crank", speed = "-12 rpm"}]
[sections.bar]
shape = "rectangle"
depth = "5 mm"
width = "5 mm"
[links]
ground.points = ["A", "D"]
crank = {points = ["A", "B"], section = "bar", material = "S235"}
rod = {points = ["B", "C"], section = "bar", material = "S235"}
arm = {points = ["C", "T"], section = "bar", material = "S235"}
rocker = {points = ["C", "D"], section = "bar", material = "S235"}
[welds.C]
links = ["rod", "arm"]
"""


class TestWritten:
    """Scenes exported to other programs and imported again."""

    @pytest.mark.parametrize(
        ("name", "kind", "apart"),
        [("pusher", ".pmks", 4e-5), ("quick_return", ".pmks", 4e-5), ("pusher", ".linkage2", 1e-8),
         ("quick_return", ".linkage2", 1e-8),
         ("flapping_wing", ".linkage2", 1e-8), ("welded", ".linkage2", 1e-8), ("welded", ".pmks", 4e-5)],
    )  # fmt: skip
    def test_a_written_file_reads_as_the_same_mechanism(self, name, kind, apart):
        """PMKS+ keeps hundredths of a millimetre; a long coupler amplifies the rounding."""
        scene = kinelast.scene_from_text(WELDED) if name == "welded" else kinelast.load(name)
        back = kinelast.scene_from_text(scene_text(of_text(written(exchanged(scene), kind), "mine")))
        times = scene.course.times(24)
        here, there = (scene.course.at(times) for scene in (scene, back))
        seen = {point for link in back.mechanism.links for point in link.points}
        for number, link in enumerate(scene.mechanism.links):
            for point in seen.intersection(link.points):
                other = next(k for k, link in enumerate(back.mechanism.links) if point in link.points)
                assert abs(position_of(here, number, point) - position_of(there, other, point)).max() < apart, point
        assert {point for link in scene.mechanism.links[1:] for point in link.points} <= seen

    def test_a_force_on_a_block_is_kept_and_other_loads_are_named(self):
        push = '[[loads]]\nlink = "block"\npoint = "B"\nforce = [-100, 0]\n'
        twist = '[[loads]]\nlink = "rod"\npoint = "B"\nmoment = 5\n'
        text = edited(SLIDER_CRANK, ("[run]", f"{push}{twist}[run]\ngravity = [0, -1.6]"))
        scene = kinelast.scene_from_text(text)
        back = kinelast.scene_from_text(scene_text(of_text(written(exchanged(scene), ".pmks"), "mine")))
        (force,) = (load.force for load in back.mechanism.loads)
        assert force == pytest.approx(-100.0, rel=1e-3)
        assert left_out(scene) == ["the moment on rod", "the value of gravity (PMKS+ takes 9.81 m/s² downwards)"]

    def test_a_swing_whose_law_of_time_changes_is_named(self):
        law = 'law = [{{curve = "{0}", duration = {1}, by = 0.8}}, {{curve = "{0}", duration = 0.4, by = -0.8}}]'
        for curve, lasts, changes in (("harmonic", 0.4, 0), ("harmonic", 0.3, 1), ("cycloidal", 0.4, 1)):
            text = edited(SLIDER_CRANK, ("speed = 100", f"repeat = true\n{law.format(curve, lasts)}"))
            assert len(changed_laws(kinelast.scene_from_text(text))) == changes

    def test_numbers_marks_and_the_check_of_pmks_are_those_of_its_grammar(self):
        text = written(exchanged(kinelast.load("pusher")), ".pmks")
        joints = text.split(".")[4:10]
        assert joints[0] == f"6A,O,0,0,0,,,,{coded(90)}"  # driven at 90 rpm, on the ground
        assert joints[1] == f"4B,C,{coded(18)},{coded(-12)},0"  # cm
        assert [each[0] for each in joints] == ["6", "4", "0", "0", "0", "L"]  # the last one slides and is traced
        assert text.split(".")[2] == "1Q,0"  # 90 rpm
        assert DIGITS.index(text[-8]) == (len(text) - 8) % 62
        assert DIGITS.index(written(exchanged(kinelast.scene_from_text(WELDED)), ".pmks")[1]) % 2 == 1  # clockwise

    @pytest.mark.parametrize(
        ("name", "kind", "why"),
        [("flapping_wing", ".pmks", "gears"),
         ("lightest_arm", ".linkage2", '"arm" is driven otherwise'), ("pusher", ".dwg", "PMKS+ (.pmks) and Linkage")],
    )  # fmt: skip
    def test_parts_unknown_to_the_other_program_are_refused(self, name, kind, why, tmp_path, capsys):
        path = tmp_path / f"mine{kind}"
        assert main([name, "--export", str(path)]) == 2
        assert why in capsys.readouterr().err
        assert not path.exists()

    def test_the_command_writes_never_over_a_file(self, tmp_path, capsys):
        path = tmp_path / "mine.linkage2"
        assert main(["pusher", "--export", str(path)]) == 0
        assert main(["pusher", "--export", str(path)]) == main(["--export", str(path)]) == 2
        said = capsys.readouterr()
        assert "already exists" in said.err
        assert "takes one scene" in said.err
        assert "the format has no sections, springs, masses or forces" in said.out


class TestDrawn:
    """Links and paths in a DXF drawing, read by ezdxf and by the importer."""

    def test_outlines_holes_and_paths_have_the_sizes_of_the_scene(self, tmp_path):
        """This test leaves out the command, which would compute vibration to judge the limits."""
        ezdxf, scene = pytest.importorskip("ezdxf"), kinelast.load("pusher")
        motion = kinelast.scene_motion(scene, 24)
        write_dxf(tmp_path / "links.dxf", Results(scene, scene_deflection(scene, motion)))
        space = ezdxf.readfile(tmp_path / "links.dxf").modelspace()
        for name, parts in scene.bearings.items():
            known = parts.eye or parts.pin or (parts.plain if name not in scene.mechanism.slider_points else None)
            circles = [each.dxf.radius for each in space.query("CIRCLE") if each.dxf.layer != "ground"]
            assert known is None or any(radius == pytest.approx(500 * known.diameter) for radius in circles), name
        (coupler,) = [link for link in scene.mechanism.links if link.name == "coupler"]
        outline = space.query('LWPOLYLINE[layer=="coupler"]')[0]
        (ax, ay, *_), (bx, by, *_), (cx, cy, *_), _ = outline.get_points("xyb")
        beam = coupler.beams[0]
        length = abs(coupler.points[beam.end] - coupler.points[beam.start])
        assert np.hypot(bx - ax, by - ay) == pytest.approx(1e3 * length)
        number = [link for link, _ in scene.mechanism.beams].index(scene.mechanism.index["coupler"])
        assert np.hypot(cx - bx, cy - by) == pytest.approx(2e3 * scene.sections[number].fibre)
        path = space.query('LWPOLYLINE[layer=="path B"]')[0]
        places = 1e3 * position_of(motion, scene.mechanism.index["coupler"], "B")
        np.testing.assert_allclose([complex(x, y) for x, y in path.get_points("xy")], places, atol=1e-6)

    def test_the_same_links_are_the_same_bytes(self):
        """Dates and random identifiers differ, as they would between two runs."""
        pytest.importorskip("ezdxf")
        link = DrawnLink("rod", {"A": 0j, "B": 100 + 0j}, [(0j, 100 + 0j, 5.0, 5.0)], {"A": 4.0})
        first = dxf_text([link], {"A": 0j}, {"B": [100j, 100 + 0j]}, "mm")
        time.sleep(0.01)
        assert dxf_text([link], {"A": 0j}, {"B": [100j, 100 + 0j]}, "mm") == first

    def test_the_same_drawing_as_svg_has_its_true_size(self, tmp_path):
        scene = kinelast.load("pusher")
        motion = kinelast.scene_motion(scene, 24)
        write_dxf(tmp_path / "links.dxf", Results(scene, scene_deflection(scene, motion)))
        root = ElementTree.parse(tmp_path / "links.svg").getroot()
        size = [float(part) for part in root.get("viewBox").split()[2:]]
        assert [root.get("width"), root.get("height")] == [f"{part:.9g}mm" for part in size]
        layers = {layer.find("{*}title").text: layer for layer in root}
        pairs = [pair.split(",") for pair in layers["path B"].find("{*}polyline").get("points").split()]
        drawn = np.array([complex(float(x), -float(y)) for x, y in pairs])
        places = 1e3 * position_of(motion, scene.mechanism.index["coupler"], "B")
        np.testing.assert_allclose(drawn - drawn[0], places - places[0], atol=1e-5)
        outline = layers["coupler"].find("{*}path").get("d")
        numbers = [float(each) for each in re.findall(r"-?[\d.]+(?:e-?\d+)?", outline)]
        ax, ay, bx, by, radius = numbers[:5]
        coupler = scene.mechanism.links[scene.mechanism.index["coupler"]]
        beam = coupler.beams[0]
        length = abs(coupler.points[beam.end] - coupler.points[beam.start])
        assert np.hypot(bx - ax, by - ay) == pytest.approx(1e3 * length, rel=1e-6)
        number = [link for link, _ in scene.mechanism.beams].index(scene.mechanism.index["coupler"])
        assert radius == pytest.approx(1e3 * scene.sections[number].fibre)
        every = [
            float(circle.get(key)) for circle in root.iter("{http://www.w3.org/2000/svg}circle") for key in ("cx", "cy")
        ]
        assert 0 < min(every) < max(every) < max(size)

    def test_a_drawing_reads_as_the_same_mechanism(self, tmp_path):
        pytest.importorskip("ezdxf")
        options = ("--theory", "quasi-static", "--positions", "24", "--quiet", "--dxf")
        main(["steel_four_bar", "-o", str(tmp_path), *options])
        scene = kinelast.load("steel_four_bar")
        read_back = read(str(tmp_path / "steel_four_bar" / "links.dxf"))
        assert not [note for note in read_back.notes if "no layer named ground" in note]
        back = kinelast.scene_from_text(scene_text(read_back))
        motion = kinelast.scene_motion(back)
        assert [link.name for link in back.mechanism.links] == [link.name for link in scene.mechanism.links]
        for one, other in zip(back.mechanism.links, scene.mechanism.links, strict=True):
            np.testing.assert_allclose(np.ptp([*one.points.values()]), np.ptp([*other.points.values()]), rtol=1e-9)
        here = kinelast.scene_motion(scene, len(motion.time))
        np.testing.assert_allclose(motion.direction, here.direction, atol=1e-9)


def massless(data):
    """Return a file of linkage_sim without masses: the program saves weight nowhere and always opens with it."""
    return {**data, "bodies": {name: {**body, "mass": 0} for name, body in data["bodies"].items()}}


@pytest.mark.parametrize(
    ("text", "weighs"),
    [(pmks(), True), (json.dumps(massless(linkage_sim())), True), (json.dumps({**MEC2, "gravity": True}), True),
     (json.dumps(MEC2), False), (LINKAGE, False)],
    ids=["pmks", "linkage_sim", "mec2", "mec2 without gravity", "linkage"],
)  # fmt: skip
def test_links_of_assumed_masses_weigh_if_they_weigh_in_the_other_program(text, weighs):
    scene, _ = moved(text)
    assert scene.mechanism.gravity == (-9.81j if weighs else 0)
