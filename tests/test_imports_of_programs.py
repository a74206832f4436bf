"""Files of other programs: every form of PMKS+, and parts that need more than points and links."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from tiers import in_tiers

import kinelast
from exchange import ExchangeError, elastic, read, scene_text, written
from exchange.pmks_code import _digest
from exchange.reading import of_text
from kinelast.cli.command import main
from kinelast.cli.imported import imported
from kinelast.outputs.exported import exchanged
from rigid import position_of
from rigid.constants import mass_moments

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
CHECKS = DIGITS[:62]


def b64(value):
    """A number of PMKS+ by its rule: thousandths in base 64, a leading 0 if negative."""
    left, text = abs(round(1000 * value)), ""
    while left or not text:
        left, digit = divmod(left, 64)
        text = DIGITS[digit] + text
    return ("0" if value < 0 else "") + text


def joint(marks, key, place, angle=0.0, *rest):
    place = complex(place)
    return ",".join([f"{DIGITS[marks]}{key}", key, b64(place.real), b64(place.imag), b64(angle), *map(str, rest)])


def link(kind, keys, mass=0.0, inertia=0.0, center=0j):
    numbers = ",".join(map(b64, (mass, inertia, complex(center).real, complex(center).imag)))
    return f"{kind}{keys},{keys},{numbers},c5cae9,{','.join(keys)},,"


def saved(joints, links, forces=(), head="2P.Ay,1E8.U,0.1011"):
    """A file of PMKS+: 30 rpm clockwise, sliders 5 cm/s, in centimetres."""
    lists = ".".join("".join(f"{word}." for word in each) for each in (joints, links, forces))
    return f"{head}.{lists}.N_z"


B = 3 * np.exp(0.25j * np.pi)
C = B.real + np.sqrt(64 - B.imag**2)
BARS = [link("YR", "AB"), link("YR", "BC")]
FIXED, DRIVEN, SLIDES, WELDED, SEALED = 4, 2, 1, 8, 32
FORMS = {  # a slider-crank of 3 and 8 cm, and the speed of its crank [rpm]
    "version 1": (
        f"https://x/?j=A,0,0,AB,R,t,0,0.1,t,%0AB,{B.real},{B.imag},AB%7CBC,R,f,0,0.1,f,%0AC,{C},0,BC,R,f,0,0.1,f,"
        f"%0AD,{C},0,CD,P,t,0,0.1,f,&l=AB,1,1,0,0,A%7CB,,l%0ABC,1,1,0,0,B%7CC,,l%0ACD,1,1,0,0,C%7CD,,l"
        "&f=&s=12.5,true,false,cm", -12.5),
    "first version 2": ("0O.TY.U,0.101." + ".".join("".join(f"{word}." for word in each) for each in (
        [joint(6, "A", 0), joint(0, "B", B), joint(0, "C", C), joint(5, "D", C)], [*BARS, link("YP", "CD")], []))
        + "j", 30.0),
    "version 2": (saved([joint(6, "A", 0), joint(0, "B", B), joint(0, "C", C), joint(5, "D", C)],
                        [*BARS, link("YP", "CD")], head="0O.TY.U,0.101"), 30.0),
    "July 2026": (saved([joint(6, "A", 0), joint(0, "B", B), joint(0, "C", C), joint(5, "D", C)],
                        [*BARS, link("YP", "CD")]), -30.0),
    "today": (saved([joint(6, "A", 0, 0, "", "", "", b64(12.5)), joint(0, "B", B),
                     joint(5, "C", C, 0, "", "", "", "", b64(2))], BARS, head="2v.Ay,1E8.U,0.1011") + "*3gSQPQ", 12.5),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_pmks_moves_at_its_own_speed_as_its_lengths_say(form):
    text, turns = FORMS[form]
    first = imported(of_text(text, "mine"))
    assert first.reason == ""
    assert first.cycle == pytest.approx(60 / abs(turns))
    scene = kinelast.scene_from_text(first.text)
    motion = kinelast.scene_motion(scene)
    assert motion.drive_rate[0, 0] == pytest.approx(turns * np.pi / 30)
    crank = motion.drive[0]
    expected = 0.03 * np.cos(crank) + np.sqrt(0.08**2 - (0.03 * np.sin(crank)) ** 2)
    place = position_of(motion, scene.mechanism.index["BC"], "C")
    np.testing.assert_allclose(place, expected, atol=3e-5)  # saved to 0.01 mm


def test_a_slot_in_a_moving_link_turns_that_link_to_its_pin():
    """A quick return: the arm from C goes through the crank's pin B, wherever that is."""
    joints = [
        joint(6, "A", 0), joint(0, "B", 1), joint(4, "C", -3j), joint(0, "D", -3j + 5 * (1 + 3j) / abs(1 + 3j)),
        joint(1, "P", 1, 0, "CD", "C", "D"),
    ]  # fmt: skip
    text = saved(joints, [link("YR", "AB"), link("YR", "CD"), link("YP", "BP")])
    scene = kinelast.scene_from_text(scene_text(of_text(text, "mine")))
    motion = kinelast.scene_motion(scene)
    pin = 0.01 * np.exp(1j * motion.drive[0])
    arm = position_of(motion, scene.mechanism.index["CD"], "D") + 0.03j
    np.testing.assert_allclose(arm / abs(arm), (pin + 0.03j) / abs(pin + 0.03j), atol=2e-3)


def boom(mark="Z", reach=2.0):
    """A boom O-C of 4 cm that a cylinder from G lifts; its rod P-C slides in the barrel G-N of 2.6 cm."""
    foot, tip = 3, 4j
    along = (tip - foot) / abs(tip - foot)
    inner, pin = foot + 2.6 * along, foot + reach * along
    joints = [
        joint(4, "O", 0), joint(0, "C", tip), joint(4, "G", foot), joint(0, "N", inner), joint(8, "P", pin),
        f"{mark}{joint(0, 'S', pin, 0, 'GN', 'G', 'N')[1:]}",
    ]  # fmt: skip
    return saved(joints, [link("YR", "OC"), link("YR", "GN"), link("YR", "PC"), link("YP", "PS")])


def test_a_cylinder_lifts_a_boom_by_the_law_of_cosines_and_stays_in_its_barrel():
    first = imported(of_text(boom(), "mine"))
    assert first.reason == ""
    scene = kinelast.scene_from_text(first.text)
    motion = kinelast.scene_motion(scene)
    slide = motion.drive[0]
    reach = np.abs(3 - 4j) / 100 + slide  # from G to C
    angle = np.angle(position_of(motion, scene.mechanism.index["OC"], "C"))
    np.testing.assert_allclose(np.cos(angle), (0.03**2 + 0.04**2 - reach**2) / (2 * 0.03 * 0.04), atol=2e-3)
    assert -0.02 < slide.min() < -0.0195  # the pin is between G and N
    assert 0.0055 < slide.max() < 0.006
    assert first.cycle == pytest.approx(2 * np.ptp(slide) / 0.05, rel=2e-2)  # 5 cm/s on average


def test_a_cylinder_that_is_drawn_fully_extended_only_retracts():
    """In PMKS+ the pin of such a cylinder is beyond the end of its barrel."""
    first = imported(of_text(boom(reach=2.7), "mine"))
    assert first.reason == ""
    assert '"P" of PMKS+ is drawn beyond the end of its slot, so GN is rigid here' in first.notes
    slide = kinelast.scene_motion(kinelast.scene_from_text(first.text)).drive[0]
    assert slide.max() == 0.0
    assert -0.027 < slide.min() < -0.026


@pytest.mark.slow
def test_a_barrel_that_rides_in_a_slot_moves_with_its_end():
    """Both are drawn a hair off their lines: the pin is moved onto the line through the moved end."""
    joints = [
        joint(4, "A", 0), joint(0, "B", 4 + 0.4j), joint(9, "D", 2 + 0.203j, 0, "AB", "A", "B"),
        joint(0, "N", 2.5 + 3.2j), joint(43, "E", 2.25 + 1.701j, 0, "DN", "D", "N"), joint(4, "G", 0.5 + 4j),
    ]  # fmt: skip
    for order in (joints, joints[::-1]):
        first = imported(of_text(saved(order, [link("YR", pair) for pair in ("AB", "DN", "EG")]), "mine"))
        assert first.reason == ""


ROCKERS = saved(  # no link goes round
    [joint(6, "A", 0), joint(0, "B", 1 + 2j), joint(0, "C", 4 + 3j), joint(4, "D", 5)],
    [link("YR", pair) for pair in ("AB", "BC", "CD")],
)


@pytest.mark.parametrize("text", [boom(), ROCKERS], ids=["cylinder", "rocker"])
def test_a_drive_between_limits_comes_back_to_its_start(text):
    run = kinelast.scene_from_text(imported(of_text(text, "mine")).text).run
    assert (run.turn, run.no_cycle) == (True, "")


def test_masses_centres_inertias_forces_and_weight_are_those_of_the_file():
    joints = [joint(6, "A", 0), joint(0, "B", B), joint(5, "C", C, 0, "", "", "", "", b64(6))]
    links = [link("YR", "AB", 40, 0.5, B / 4), link("AR", "BC", 50)]
    text = saved(joints, links, ["2F1,BC,F1," + ",".join(map(b64, (C.real, 0, C.real, 2, 7.5)))])
    scene = kinelast.scene_from_text(scene_text(of_text(text, "mine")))
    crank, rod = (scene.mechanism.links[scene.mechanism.index[name]] for name in ("AB", "BC"))
    mass, first, second = mass_moments(crank)
    assert (mass, first / mass) == (pytest.approx(0.04), pytest.approx(0.03 / 4, abs=1e-5))
    assert second - mass * abs(first / mass) ** 2 == pytest.approx(0.5e-4)  # kg cm^2
    assert not crank.beams
    mass, first, second = mass_moments(replace(rod, lumps=()))  # automatic: a uniform bar
    length = abs(C - B) / 100
    assert (mass, first / mass) == (pytest.approx(0.05, rel=1e-5), pytest.approx(length / 2, rel=1e-3))
    assert second - mass * abs(first / mass) ** 2 == pytest.approx(0.05 * length**2 / 12, rel=3e-2)  # a bar has depth
    assert rod.beams
    assert scene.mechanism.gravity == -9.81j
    (load,) = scene.mechanism.loads
    assert (load.link, load.point, load.force) == ("BC", "C", pytest.approx(7.5j))
    assert of_text(text, "mine").masses == {"C": pytest.approx(0.006)}
    advice = imported(of_text(text, "mine")).advice("mine.toml", "mine.pmks")
    assert "AB: rigid, " in advice
    assert "deflection-report --import mine.pmks --elastic" in advice


def test_an_elastic_import_gives_every_link_a_beam_and_counts_no_mass_twice():
    """AB is too heavy for a slender bar of 3 cm; BC keeps its mass but not its centre."""
    joints = [joint(6, "A", 0), joint(0, "B", B), joint(5, "C", C, 0, "", "", "", "", b64(6))]
    drawing = of_text(saved(joints, [link("YR", "AB", 40, 0.5, B / 4), link("YR", "BC", 50, 30, C)]), "mine")
    assert imported(drawing).rigid == ("AB", "BC")
    first = imported(elastic(drawing))
    assert (first.reason, first.rigid) == ("", ())
    assert [note.split(";")[0] for note in first.notes] == [
        "AB has the mass of the assumed section", "BC is a uniform bar of the file's 0.05 kg"
    ]  # fmt: skip
    _, *links = kinelast.scene_from_text(first.text).mechanism.links
    crank, rod = (next(each for each in links if each.name == name) for name in ("AB", "BC"))
    assert crank.beams
    assert rod.beams
    assert mass_moments(replace(rod, lumps=()))[0] == pytest.approx(0.05, rel=1e-5)
    depth, width = 0.004, 0.002  # |BC| / 20, half of it
    assert mass_moments(crank)[0] == pytest.approx(7850 * depth * width * abs(B) / 100, rel=1e-3)


@pytest.mark.slow
def test_a_drive_at_a_floating_pin_turns_the_second_link_from_the_first():
    joints = [joint(4, "A", 0), joint(2, "B", 1 + 2j), joint(0, "C", 4 + 3j), joint(4, "D", 5)]
    text = saved(joints, [link("YR", "AB"), link("YR", "BC"), link("YR", "CD")])
    first = imported(of_text(text, "mine"))
    assert first.reason == ""
    scene = kinelast.scene_from_text(first.text)
    motion = kinelast.scene_motion(scene)
    one, other = (motion.direction[scene.mechanism.index[name]] for name in ("AB", "BC"))
    np.testing.assert_allclose(np.exp(1j * motion.drive[0]), other / one, atol=1e-9)


def test_a_rocker_swings_between_the_limits_of_the_closed_form():
    """The input of a double rocker stops where coupler and output are in line: cosines at the ends."""
    lengths = np.array([3.0, 2.0, 2.5])
    tip = 3 * np.exp(1.0j)
    gap = abs(5 - tip)
    turn = np.arccos((gap**2 + lengths[1] ** 2 - lengths[2] ** 2) / (2 * gap * lengths[1]))
    top = tip + 2 * (5 - tip) / gap * np.exp(1j * turn)
    joints = [joint(6, "A", 0), joint(0, "B", tip), joint(0, "C", top), joint(4, "D", 5)]
    first = imported(of_text(saved(joints, [link("YR", k) for k in ("AB", "BC", "CD")]), "mine"))
    assert first.reason == ""
    scene = kinelast.scene_from_text(first.text)
    angle = kinelast.scene_motion(scene).drive[0]
    limit = np.arccos((9 + 25 - 4.5**2) / (2 * 3 * 5))
    assert (angle.max(), angle.min()) == (pytest.approx(0.98 * limit, rel=1e-2), pytest.approx(-0.98 * limit, rel=1e-2))
    assert any("cannot make a full " in note for note in first.notes)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (FORMS["today"][0].replace("5C,C,", "5C,C,!"), 'the joint "5C,C,!'),
        (FORMS["July 2026"][0].replace("B,C,,", "B,Q,,"), 'has a joint "Q"'),
        (FORMS["July 2026"][0].replace("YRBC", "!RBC"), 'the link "!RBC'),
        (FORMS["July 2026"][0].replace(".U,0.", ".!,0."), "the settings"),
        (boom().replace("GN,G,N", "XY,G,N"), "refers to parts that are not in the file"),
        ("pmks2:00000000.AAAA", "save it as a link"),
        (FORMS["version 1"][0].replace("B,2.", "B,two"), "version 1, cannot be read"),
    ],
)
def test_a_damaged_file_of_pmks_ends_in_one_sentence(text, why):
    with pytest.raises(ExchangeError) as error:
        scene_text(of_text(text, "mine"))
    assert why in str(error.value)
    assert "Error(" not in str(error.value)


@pytest.mark.parametrize(("text", "value"), [("a", 0xE40C292C), ("foobar", 0xBF9CF968)])
def test_the_digest_of_pmks_is_fnv_1a(text, value):
    """Published values of the hash, in base 62."""
    assert sum(CHECKS.index(digit) * 62**place for place, digit in enumerate(reversed(_digest(text)))) == value


def test_masses_and_forces_go_to_pmks_and_back():
    scene = kinelast.load("pusher")
    back = kinelast.scene_from_text(scene_text(of_text(written(exchanged(scene), ".pmks"), "mine")))
    here, there = (
        {one.name: np.real(mass_moments(one)[0]) for one in each.mechanism.links[1:]} for each in (scene, back)
    )
    assert there["crank"] == pytest.approx(here["crank"], rel=1e-4)
    assert sum(there.values()) == pytest.approx(sum(here.values()), rel=1e-4)


def drive_of(path):
    motion = kinelast.scene_motion(kinelast.load(path), 360)
    return motion.drive[0] - motion.drive[0, 0]


@pytest.mark.parametrize("text", in_tiers([ROCKERS, boom()], 1, 1), ids=["rocker", "cylinder"])
def test_a_drive_that_swings_goes_to_pmks_and_back(text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.pmks").write_text(text)
    assert main(["--import", "mine.pmks"]) == 0
    assert main(["mine.toml", "--export", "back.pmks"]) == 0
    assert main(["--import", "back.pmks"]) == 0
    here, there = drive_of("mine.toml"), drive_of("back.toml")
    assert np.ptp(here) > 0
    np.testing.assert_allclose(there, here, atol=2e-3 * np.ptp(here))
    part = re.sub(
        'by = "(.*) (deg|cm)"', lambda found: f'by = "{float(found[1]) / 2} {found[2]}"', Path("mine.toml").read_text()
    )
    Path("half.toml").write_text(part)
    capsys.readouterr()
    assert main(["half.toml", "--export", "half.pmks"]) == 2
    assert "in PMKS+ a drive oscillates between the limits of the mechanism" in capsys.readouterr().err
    assert not Path("half.pmks").exists()


@pytest.mark.slow
def test_a_drive_that_swings_beside_another_is_compared_with_its_own_range(tmp_path, monkeypatch, capsys):
    """A crank turns by 360 deg, a cylinder slides by 20 mm of the 179 mm that its boom allows."""
    monkeypatch.chdir(tmp_path)
    Path("both.linkage2").write_text(cylinder(15, 15))
    assert main(["--import", "both.linkage2"]) == 0
    assert main(["both.toml", "--export", "both.pmks"]) == 2
    assert "in PMKS+ a drive oscillates between the limits of the mechanism" in capsys.readouterr().err


def test_a_mechanism_too_small_for_the_digits_of_pmks_is_refused_in_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("rockers.pmks").write_text(ROCKERS)
    assert main(["--import", "rockers.pmks"]) == 0
    text = Path("rockers.toml").read_text().replace('units = "cm"', 'units = "mm"')
    Path("small.toml").write_text(re.sub(r"= \[(-?[\d.]+), (-?[\d.]+)\]\n", shrunk, text))
    capsys.readouterr()
    assert main(["small.toml", "--export", "small.pmks"]) == 2
    assert "PMKS+ cannot move the exported mechanism: " in capsys.readouterr().err


def shrunk(found):
    return f"= [{float(found[1]) / 1000}, {float(found[2]) / 1000}]\n"


def linkage(connectors, links, ratios=""):
    return f'<linkage2><program units="Millimeters"/>{connectors}{links}{ratios}</linkage2>'


def members(number, *points, more=""):
    inside = "".join(f'<connector id="{point}"/>' for point in points)
    return f'<Link id="{number}"{more}>{inside}</Link>'


def test_an_actuator_of_linkage_with_a_negative_rate_first_retracts():
    text = linkage(
        '<connector id="0" x="0" y="0" anchor="true"/><connector id="1" x="60" y="80"/>'
        '<connector id="2" x="60" y="0" anchor="true"/>',
        members(0, 0, 1, more=' actuator="true" throw="20" cpm="-6"') + members(1, 1, 2),
    )
    first = imported(of_text(text, "mine"))
    assert (first.reason, first.cycle) == ("", pytest.approx(10.0))
    scene = kinelast.scene_from_text(first.text)
    motion = kinelast.scene_motion(scene)
    reach = abs(position_of(motion, scene.mechanism.index["link_1"], "P1"))
    assert (reach.max(), reach.min()) == (pytest.approx(0.1), pytest.approx(0.08, abs=1e-5))


def cylinder(cycles, rpm):
    """A boom of Linkage on a cylinder, and a crank beside it."""
    return linkage(
        '<connector id="0" x="0" y="0" anchor="true"/><connector id="1" x="60" y="80"/>'
        '<connector id="2" x="60" y="0" anchor="true"/>'
        f'<connector id="3" x="200" y="0" anchor="true" input="true" rpm="{rpm}"/><connector id="4" x="220" y="0"/>',
        members(0, 0, 1, more=f' actuator="true" throw="20" cpm="{cycles}"') + members(1, 1, 2) + members(2, 3, 4),
    )


@pytest.mark.parametrize(
    ("cycles", "rpm", "says"),
    in_tiers(
        [
            (45, 45, "it moves, 1.333 s a cycle"),
            (15, 15.7, "it moves, but never repeats: the drives have no common period"),
            (9, 15, "it moves, 20 s a cycle"),
        ],
        2,
        1,
    ),
)
def test_an_import_says_in_which_time_all_drives_repeat(cycles, rpm, says):
    assert says in imported(of_text(cylinder(cycles, rpm), "mine")).result


@pytest.mark.slow
def test_a_cylinder_is_written_for_pmks_with_the_end_of_its_rod_as_the_pin():
    scene = kinelast.scene_from_text(imported(of_text(cylinder(15, 15), "mine")).text)
    back = of_text(written(exchanged(scene), ".pmks"), "mine")
    assert list(back.slides) == ["slide_cylinder_0_tip"]
    assert imported(back).reason == ""


@pytest.mark.parametrize(
    ("rpm", "offset", "low", "high", "sense"),
    [(10, 0, -120, 0, -1), (-10, 0, 0, 120, 1), (10, 30, -90, 30, -1), (10, 150, -30, 90, 1), (-10, 150, -90, 30, -1)],
)
def test_an_oscillating_input_of_linkage_swings_by_its_limit(rpm, offset, low, high, sense):
    """120 deg to and fro at 60 deg/s; an offset of 150 deg is 30 deg on the way back."""
    text = linkage(
        f'<connector id="0" x="0" y="0" anchor="true" input="true" rpm="{rpm}" limitangle="120"'
        f' startoffset="{offset}"/>'
        '<connector id="1" x="40" y="0"/>',
        members(0, 0, 1),
    )
    first = imported(of_text(text, "mine"))
    assert (first.reason, first.cycle) == ("", pytest.approx(4.0))
    angle = np.rad2deg(kinelast.scene_motion(kinelast.scene_from_text(first.text), 721).drive[0])
    assert (angle.min(), angle.max()) == (pytest.approx(low, abs=0.1), pytest.approx(high, abs=0.1))
    assert np.sign(angle[9] - angle[0]) == sense
    back = imported(of_text(written(exchanged(kinelast.scene_from_text(first.text)), ".linkage2"), "mine"))
    again = np.rad2deg(kinelast.scene_motion(kinelast.scene_from_text(back.text), 721).drive[0])
    np.testing.assert_allclose(again - again[0], angle - angle[0], atol=1e-3)


def test_a_pin_in_a_curved_slot_of_linkage_keeps_its_radius():
    """The crank from (0, 0) moves a rod whose end slides on an arc of 50 mm about (100, 0); attributes may touch."""
    text = linkage(
        '<connector id="0"x="0" y="0" anchor="true" input="true" rpm="15"/><connector id="1" x="0" y="20"/>'
        '<connector id="2" x="50" y="0" anchor="true"/><connector id="3" x="100" y="50" anchor="true"/>'
        '<connector id="4" x="60" y="30" slider="true" slideradius="50"><slidelimit id="2"/><slidelimit id="3"/>'
        "</connector>",
        members(0, 0, 1) + members(1, 1, 4) + members(2, 2, 3),
    )
    scene = kinelast.scene_from_text(imported(of_text(text, "mine")).text)
    pin = position_of(kinelast.scene_motion(scene), scene.mechanism.index["link_1"], "P4")
    np.testing.assert_allclose(abs(pin - 0.1), 0.05, rtol=1e-9)
    assert np.ptp(np.angle(pin - 0.1)) > 0.5


def test_an_input_of_linkage_turns_every_link_at_its_pin_but_the_frame():
    """Its manual: a rotating anchor rotates all links there, and positive speeds are clockwise."""
    text = linkage(
        '<connector id="0" x="0" y="0" anchor="true" input="true" rpm="30"/><connector id="1" x="40" y="0"/>'
        '<connector id="2" x="0" y="-9"/><connector id="3" x="60" y="5" anchor="true"/>',
        members(9, 0, 3) + members(0, 0, 1) + members(1, 0, 2),
    )
    scene = kinelast.scene_from_text(imported(of_text(text, "mine")).text)
    motion = kinelast.scene_motion(scene)
    ends = np.array([position_of(motion, 1, point) for point in ("P1", "P2")])
    np.testing.assert_allclose(ends, np.array([[0.04], [-0.009j]]) * np.exp(-1j * np.pi * motion.time), atol=1e-9)


def test_a_pin_at_which_one_link_is_driven_and_one_is_free_is_not_written_for_linkage():
    joints = [joint(6, "A", 0), joint(0, "B", 1 + 2j), joint(0, "C", 4 + 3j), joint(4, "D", 5), joint(0, "E", 1 - 1j)]
    joints += [joint(0, "F", -2)]
    text = saved(joints, [link("YR", pair) for pair in ("AB", "BC", "CD", "AE", "EF", "FB")])
    with pytest.raises(ExchangeError, match='"AE" turns freely at "A"'):
        written(of_text(text, "mine"), ".linkage2")


def test_a_wheel_that_is_more_than_a_wheel_turns_about_its_axle_when_read_back():
    text = linkage(
        '<connector id="0" x="0" y="0" anchor="true" input="true" rpm="30"/><connector id="1" x="20" y="0"/>'
        '<connector id="2" x="60" y="0" anchor="true"/><connector id="3" x="60" y="9"/>',
        members(0, 0, more=' gear="true"') + members(1, 1, 0)
        + members(2, 2, more=' gear="true" fastenlink="3"') + members(3, 3, 2),
        '<ratios><ratio type="gears"><link id="0" size="20"/><link id="2" size="40"/></ratio></ratios>',
    )  # fmt: skip
    scene = kinelast.scene_from_text(imported(of_text(text, "mine")).text)
    back = kinelast.scene_from_text(imported(of_text(written(exchanged(scene), ".linkage2"), "mine")).text)
    ends = [kinelast.scene_motion(each).angular_velocity[each.mechanism.index["link_3"]] for each in (scene, back)]
    np.testing.assert_allclose(ends, np.pi / 2, atol=1e-9)


@pytest.mark.parametrize(("kind", "turns"), [("gears", 2.0), ("chain", 0.0)])
def test_a_wheel_of_linkage_that_rolls_on_a_fastened_one(kind, turns):
    """Willis: a planet as large as the fixed sun turns twice as fast as its carrier, on a chain not at all."""
    text = linkage(
        '<connector id="0" x="0" y="0" anchor="true" input="true" rpm="30"/><connector id="1" x="40" y="0"/>'
        '<connector id="2" x="0" y="-9" anchor="true"/><connector id="3" x="60" y="5"/>',
        members(0, 0, more=' gear="true" fastenconnector="2"') + members(1, 0, 1)
        + members(2, 1, more=' gear="true" fastenlink="3"') + members(3, 1, 3),
        f'<ratios><ratio type="{kind}"><link id="0" size="20"/><link id="2" size="20"/></ratio></ratios>',
    )  # fmt: skip
    scene = kinelast.scene_from_text(imported(of_text(text, "mine")).text)
    motion = kinelast.scene_motion(scene)
    planet = motion.angular_velocity[scene.mechanism.index["link_3"]]
    np.testing.assert_allclose(planet, -turns * np.pi, atol=1e-9)
    back = kinelast.scene_from_text(imported(of_text(written(exchanged(scene), ".linkage2"), "mine")).text)
    again = kinelast.scene_motion(back).angular_velocity[back.mechanism.index["link_3"]]
    np.testing.assert_allclose(again, planet, atol=1e-9)


def test_a_fixed_pin_in_a_moving_slot_goes_to_linkage_and_back():
    text = """
points = {A = [0, 0], B = [0.03, 0.01], P = [0.1, 0.02], E = [0.2, 0.03428571428571428]}
drives = [{link = "crank", speed = "12 rpm"}]
[sections.bar]
shape = "rectangle"
depth = "5 mm"
width = "5 mm"
[links]
ground.points = ["A", "P"]
crank = {points = ["A", "B"], section = "bar", material = "S235"}
arm = {points = ["B", "E"], section = "bar", material = "S235"}
[slots.guide]
point = "P"
link = "ground"
on = "arm"
direction = [0.07, 0.01]
"""
    scene = kinelast.scene_from_text(text)
    back = kinelast.scene_from_text(imported(of_text(written(exchanged(scene), ".linkage2"), "mine")).text)
    here, there = (kinelast.scene_motion(each, 24) for each in (scene, back))
    ends = [position_of(moved, moved.mechanism.index["arm"], "E") for moved in (here, there)]
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-8)


@pytest.mark.parametrize(
    ("angle", "place"),
    [
        (1.0, 3.3498349706989696 + 2.9287002978580774j),
        (1.5, 3.0442229629972513 + 2.843675483513941j),
        (-0.7, 3.406142646971927 - 2.9406348709512526j),
    ],
)
def test_bodies_of_linkage_sim_are_assembled_as_its_own_solver_does(angle, place):
    """A four-bar of 1, 3.5, 3 and 4 m: the solver of linkage_sim 2d5f921 puts C here, begun with all zeros."""

    def body(length, start, end):
        return {"attachment_points": {start: [0, 0], end: [length, 0]}, "mass": 0}

    def pin(i, p, j, q):
        return {"type": "revolute", "body_i": i, "point_i": p, "body_j": j, "point_j": q}

    data = {
        "bodies": {
            "ground": {"attachment_points": {"O2": [0, 0], "O4": [4, 0]}},
            "crank": body(1, "A", "B"), "coupler": body(3.5, "B", "C"), "rocker": body(3, "D", "C"),
        },
        "joints": {
            "J1": pin("ground", "O2", "crank", "A"), "J2": pin("crank", "B", "coupler", "B"),
            "J3": pin("coupler", "C", "rocker", "C"), "J4": pin("ground", "O4", "rocker", "D"),
        },
        "drivers": {"D": {"type": "constant_speed", "body_i": "ground", "body_j": "crank", "omega": 1,
                          "theta_0": angle}},
    }  # fmt: skip
    drawing = of_text(json.dumps(data), "mine")
    assert drawing.points["C"] == pytest.approx(place, abs=1e-9)


def test_blocks_of_a_dxf_drawing_are_read_and_the_rest_is_counted(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new(units=4)
    space = drawing.modelspace()
    drawing.blocks.new("BAR").add_line((0, 0), (1, 0))
    space.add_blockref("BAR", (0, 0), dxfattribs={"xscale": 30, "yscale": 30, "rotation": 90})
    space.add_line((0, 30), (120, 50))
    space.add_line((120, 50), (100, -40))
    space.add_circle((0, 30), 3)  # the symbol of a joint
    space.add_circle((500, 30), 3)
    space.add_arc((0, 0), 5, 0, 90)
    drawing.saveas(tmp_path / "blocks.dxf")
    found = read(str(tmp_path / "blocks.dxf"))
    assert sorted(
        abs(found.points[a] - found.points[b]) for a, b in (body.points for body in found.links.values())
    ) == (pytest.approx([30, np.hypot(20, 90), np.hypot(120, 20)]))
    assert "left out of the drawing: 1 arc, 1 circle" in found.notes


def test_the_driven_link_of_pylinkages_drawing_is_that_of_its_crank_layer(tmp_path):
    """Its links are outlines with round ends, each about a dashed line; a crank has its symbol at its tip."""
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    space = drawing.modelspace()
    for start, end in (((3, 0), (2.6, 1.4)), ((0, 1), (2.6, 1.4)), ((0, 0), (0, 1))):
        outline = [(*start, 0), (*end, 1), (*end, 0), (*start, 1)]
        space.add_lwpolyline(outline, "xyb", close=True, dxfattribs={"layer": "LINKS"})
        space.add_line(start, end, dxfattribs={"layer": "LINKS"})
    space.add_circle((0, 1), 0.1, dxfattribs={"layer": "CRANKS"})
    space.add_lwpolyline([(3, 0), (2.8, -0.2), (3.2, -0.2), (3, 0)], dxfattribs={"layer": "GROUND"})
    drawing.saveas(tmp_path / "linkage.dxf")
    found = read(str(tmp_path / "linkage.dxf"))
    assert len(found.links) == 3
    (drive,) = found.drives
    assert {found.points[point] for point in found.links[drive.joint["link"]].points} == {0, 1j}
    assert {found.points[point] for point in found.ground} == {0, 3}


def test_a_limit_of_rigid_links_says_how_they_bend(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    joints = [joint(6, "A", 0), joint(0, "B", B), joint(5, "C", C, 0, "", "", "", "", b64(6))]
    links = [link("YR", "AB", 40, 0.5, B / 4), link("YR", "BC", 50, 30, C)]
    (tmp_path / "heavy.pmks").write_text(saved(joints, links))
    for options, name in ((), "heavy"), (["--elastic"], "heavy_elastic"):
        assert main(["--import", "heavy.pmks", *options]) == 0
        with (tmp_path / f"{name}.toml").open("a") as file:
            file.write("[limits]\nsafety = 1.5\n")
    assert main(["heavy.toml", "--positions", "12"]) == 1
    assert "CANNOT BE JUDGED: safety: every link is rigid: to make one elastic, delete" in capsys.readouterr().out
    assert main(["heavy_elastic.toml", "--positions", "12"]) == 0
    assert ": acceptable: safety of " in capsys.readouterr().out


def test_the_command_says_how_the_first_run_ended(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "boom.pmks").write_text(boom())
    (tmp_path / "loose.pmks").write_text(saved([joint(6, "A", 0), joint(0, "B", 1), joint(0, "C", 2 + 1j)], BARS))
    assert main(["--import", "boom.pmks"]) == 0
    said = capsys.readouterr().out
    assert "it moves, " in said
    assert "deflection-report boom.toml" in said
    lines = re.search(r"such as\n((?: +\S.*\n){2})", said)[1]
    with (tmp_path / "boom.toml").open("a") as file:
        file.write(lines)
    assert len(kinelast.load(tmp_path / "boom.toml").limits) == 1
    assert main(["--import", "loose.pmks"]) == 1
    said = capsys.readouterr().out
    assert "it does not move yet: " in said
    assert "1 freedom" in said
    assert (tmp_path / "loose.toml").exists()


def ternary(mass=1.0):
    """A four-bar A, B, C, D whose coupler BCE is a triangle. PMKS+ gives a new link the mass and inertia 1."""
    joints = [joint(6, "A", 0), joint(0, "B", 2j), joint(0, "C", 6 + 4j), joint(0, "E", 3 + 6j), joint(4, "D", 6)]
    return saved(joints, [link("YR", "AB", 1, 1), link("YR", "BCE", mass, 1, 3 + 4j), link("YR", "CD", 1, 1)])


def test_a_ternary_link_is_a_closed_triangle():
    first = imported(of_text(ternary(), "mine"))
    coupler = kinelast.scene_from_text(first.text).mechanism.links[2]
    assert {frozenset((beam.start, beam.end)) for beam in coupler.beams} == {
        frozenset(pair) for pair in ("BC", "CE", "EB")
    }
    assert first.text.startswith("# the file has only default masses")
    assert "# assumed: beams along the outline of BCE\n" in first.text


def test_masses_that_are_left_out_are_named():
    assert "# left out: the default masses of AB, CD;" in scene_text(of_text(ternary(50), "mine"))
    joints = [joint(6, "A", 0), joint(0, "B", B), joint(5, "C", C, 0, "", "", "", "", b64(1))]
    text = saved(joints, [link("YR", "AB", 1, 1), link("YR", "BC", 50, 30, C)])
    assert of_text(text, "mine").masses == {}
    assert "# left out: the default masses of AB, C;" in scene_text(of_text(text, "mine"))
