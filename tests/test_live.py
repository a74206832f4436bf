"""The live editor: an edit changes only its part of a text, and the server serves and writes only its files."""

import base64
import http.client
import json
import os
import re
import struct
import subprocess
import sys
import threading
import time
import tomllib
import zlib
from contextlib import contextmanager
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from live_page import fragment
from tiers import in_tiers

import kinelast
import kinelast.tasks.task
from kinelast import deflection, read_document, scene_from_dict, scene_from_text
from kinelast.cli.command import main
from kinelast.scene.course import CourseByLaws
from kinelast.scene.tables import Curve
from kinelast.tasks.task import shipped_scenes
from kinelast.values.error import SceneError
from live.answer import Memory, quick_answer
from live.drives import MOTIONS
from live.edit import EMPTY, edited, start_of
from live.entries import keys, typed
from live.file import ChangedError, SceneFile
from live.full import whole_answer
from live.notebook import PAGE
from live.parts import EditError
from live.server import SHARED, WEB, page_file
from live.share import MARK, linked
from live.text import NEXT, as_toml, places, with_value, without

server = pytest.importorskip("live.server", reason="the extra live is not installed")

STEEL = shipped_scenes()["steel_four_bar"].read_text()
CLOSING = STEEL.replace('length = "300 mm"', 'length = "100 mm"')  # the crank stops at 82 deg


def entries(node, path=()):
    """Yield paths and values of all entries in tables."""
    yield path, node
    for key, value in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield from entries(value, (*path, key))


def changed_lines(before, after):
    return [(one, other) for one, other in zip(before.splitlines(), after.splitlines(), strict=True) if one != other]


def made(*changes):
    """Return a scene made by changes of the empty sheet."""
    text = EMPTY
    for change in changes:
        text = edited(text, change)
    return text


def points_of_picture(answer, data):
    """Return the positions of a picture's points by name, as complex numbers."""
    at, shape = answer["picture"]["arrays"]["points"]
    pairs = np.frombuffer(data, "<f4")[at : at + np.prod(shape)].reshape(shape)
    return dict(zip(answer["picture"]["points"], pairs[..., 0] + 1j * pairs[..., 1], strict=True))


def stroke(answer, data):
    """Return the stroke of the first cylinder of a picture."""
    parts = next(iter(answer["sheet"]["cylinders"].values()))
    places = points_of_picture(answer, data)
    return np.ptp(abs(places[parts["to"]] - places[parts["from"]]))


class TestText:
    """Positions of values in a text, and changes of values."""

    @pytest.mark.parametrize("name", shipped_scenes())
    def test_every_value_of_a_shipped_scene_stands_where_it_is_said_to(self, name):
        text = shipped_scenes()[name].read_text()
        spans = places(text).values
        known = [(path, value) for path, value in entries(tomllib.loads(text)) if path in spans]
        assert len(known) > 20
        for path, value in known:
            assert tomllib.loads(f"x = {text[slice(*spans[path])]}")["x"] == value, path

    @pytest.mark.parametrize(
        "text",
        ['a.b = {c = [1, {"d e" = "x # y"}]} # z\n', "[[t]]\nk = '''\n#'''\n[[t]]\n[t.u]\nk = \"\\\"\" # b\n", "a = 1"],
    )
    def test_keys_and_strings_of_every_kind(self, text):
        spans = places(text).values
        leaves = {path: value for path, value in entries(tomllib.loads(text)) if not isinstance(value, dict | list)}
        assert leaves.keys() == {path for path in spans if text[spans[path][0]] not in "[{"}
        for path, value in leaves.items():
            assert tomllib.loads(f"x = {text[slice(*spans[path])]}")["x"] == value

    def test_an_entry_more_and_taken_away_leaves_the_text(self):
        for path in (("points", "Z"), ("links", "crank", "rigid"), ("new", "key"), ("run", "gravity", 1)):
            more = with_value(STEEL, path, [1, 2.5])
            assert dict(entries(tomllib.loads(more)))[path] == [1, 2.5]
            if path[0] in ("points", "links"):
                assert without(more, path) == STEEL

    def test_values_are_written_as_they_are_read(self):
        value = {"a": [1, 2.5, "x\\\"'"], "b c": True}
        assert tomllib.loads(f"x = {as_toml(value)}")["x"] == value


class TestEdits:
    """Edits of a scene."""

    def test_a_dragged_point_takes_its_place_and_lengths_and_nothing_else(self):
        after = edited(STEEL, {"do": "move", "point": "B", "to": [0.25, 0.2]})
        assert changed_lines(STEEL, after) == [
            ("B = [0.28, 0.24]", "B = [0.25, 0.2]"),
            ('length = "300 mm"', 'length = "250 mm"'),
            ('length = "250 mm"', 'length = "223.607 mm"'),
        ]
        assert abs(start_of(after)[0]["B"] - (0.25 + 0.2j)) < 1e-6

    def test_a_point_that_stands_elsewhere_than_drawn_goes_where_it_is_dragged(self):
        turned = STEEL.replace('speed = "100', 'start = "30 deg"\nspeed = "100')
        before = start_of(turned)[0]
        assert abs(before["A"] - 0.1 * np.exp(1j * np.pi / 6)) < 1e-12
        for point, step in (("A", 0.01 + 0.02j), ("B", -0.01 + 0.005j)):
            to = before[point] + step
            after = start_of(edited(turned, {"do": "move", "point": point, "to": [to.real, to.imag]}))[0]
            assert abs(after[point] - to) < 2e-6, point

    def test_a_point_of_a_plate_drawn_in_its_own_axes_follows(self):
        text = edited(
            STEEL, {"do": "put", "path": ["links", "coupler", "points"], "value": {"A": [0, 0], "B": [0.3, 0]}}
        )
        text = without(text, ("links", "coupler", "length"))
        place = start_of(text)[0]["B"] + 0.01
        after = edited(text, {"do": "move", "point": "B", "to": [place.real, place.imag]})
        assert abs(start_of(after)[0]["B"] - place) < 1e-6

    def test_a_number_keeps_its_unit(self):
        for path, value, line in (
            ("sections.bar.depth", 0.0071, 'depth = "7.1 mm"'),
            ("drives.crank.speed", 50.0, 'speed = "50 rad/s"'),
            ("points.B.x", 0.3, "B = [0.3, 0.24]"),
            ("run.positions", 100.2, "positions = 100"),
        ):
            assert line in edited(STEEL, {"do": "set", "path": path, "value": value}).splitlines()

    @pytest.mark.parametrize(
        "change",
        [
            {"do": "link", "points": ["B", [0.4, 0.3]], "section": "flat 20x5", "material": "S235"},
            {"do": "mass", "point": "B"},
            {"do": "load", "point": "B", "force": [0, -20]},
            {"do": "spring", "from": "B", "to": "D"},
        ],
    )
    def test_a_part_more_still_moves_and_taken_away_leaves_the_scene(self, change):
        more = edited(STEEL, change)
        kind = change["do"]
        answer, _ = quick_answer(more)
        loose = [each["message"] for each in answer["mistakes"]]
        assert loose == [] if kind != "link" else "left with 1 freedom" in loose[0]
        name = {"link": "link_1", "mass": "B"}.get(kind, 0)
        back = tomllib.loads(edited(more, {"do": "remove", "kind": kind, "name": name}))
        back["points"].pop("C", None)
        assert {key: value for key, value in back.items() if value} == tomllib.loads(STEEL)

    def test_a_link_drawn_onto_the_middle_of_another_is_joined_there(self):
        """A rocker is on the middle of the rod: four-bar A B D E, whose coupler extends to C."""
        place = {"link": "link_2", "between": ["B", "C"], "share": 0.5}
        text = made({"do": "link", "points": [[0, 0], [0, 0.1]]}, {"do": "link", "points": ["B", [0.4, 0.2]]},
                    {"do": "link", "points": [[0.25, 0], place]}, {"do": "fix", "point": "A"},
                    {"do": "fix", "point": "E"}, {"do": "drive", "link": "link_1"})  # fmt: skip
        tables = tomllib.loads(text)
        assert tables["points"]["D"] == [0.2, 0.15]
        assert tables["links"]["link_2"]["points"] == ["B", "D", "C"]
        assert tables["links"]["link_3"]["points"] == ["E", "D"]
        answer, data = quick_answer(text)
        assert answer["mistakes"] == []
        at = points_of_picture(answer, data)
        assert np.allclose(2 * at["D"], at["B"] + at["C"], atol=1e-6)

    @pytest.mark.parametrize(("name", "width"), [("steel_four_bar", 0.35), ("offset_slider_crank", 0.209)])
    @pytest.mark.parametrize("mirror", [False, True])
    def test_a_copy_moves_beside_and_a_mirrored_one_as_the_image(self, name, width, mirror):
        text = shipped_scenes()[name].read_text()
        before, data = quick_answer(text)
        known = points_of_picture(before, data)
        after, data = quick_answer(edited(text, {"do": "copy", "mirror": mirror}))
        assert after["mistakes"] == []
        both = points_of_picture(after, data)
        assert len(both) == 2 * len(known) - mirror  # both share the support O on the line
        for point, course in known.items():
            image = -course.conj() if mirror else course + 1.2 * width
            assert min(abs(each - image).max() for each in both.values()) < 2e-6, point

    def test_halves_that_would_share_a_moving_point_are_not_made(self):
        text = shipped_scenes()["steel_four_bar"].read_text()
        with pytest.raises(EditError, match='goes through "B", which moves'):
            edited(text, {"do": "copy", "mirror": True, "about": "B"})
        alone = edited(text, {"do": "copy", "mirror": True, "about": "B", "link": "coupler"})
        assert tomllib.loads(alone)["links"]["link_1"]["points"][1] == "B"

    def test_a_wiper_from_the_empty_sheet(self):
        text = EMPTY
        for change in (
            {"do": "link", "points": [[0, 0], [0.04, 0]]},
            {"do": "fix", "point": "A"},
            {"do": "link", "points": ["B", [0.3, 0.05]]},
            {"do": "link", "points": [[0.3, -0.03], "C"]},
            {"do": "fix", "point": "D"},
            {"do": "drive", "link": "link_1"},
            {"do": "link", "points": ["C", [0.3, 0.5]]},
            {"do": "weld", "point": "C"},
        ):
            text = edited(text, change)
        assert 'links = ["link_3", "link_4"]' not in text
        text = edited(text, {"do": "put", "path": ["welds", "C", "links"], "value": ["link_3", "link_4"]})
        answer, _ = quick_answer(text)
        assert answer["mistakes"] == []
        assert answer["picture"]["closes"]["all"]

    def test_the_menu_has_every_law_of_the_format(self):
        laws = {*get_args(Curve)} - {"dwell", "constant-speed"}
        assert laws == {*MOTIONS[1:-1]}
        for law in laws:
            change = {"do": "law", "drive": 0, "curve": law, "by": "90 deg", "duration": "1 s", "back": True}
            assert scene_from_text(edited(STEEL, change)).laws[0].segments[0].curve == law

    def test_a_robot_turns_its_second_arm_on_the_first(self):
        text = made({"do": "link", "points": [[0, 0], [0.3, 0]]}, {"do": "link", "points": ["B", [0.5, 0]]},
                    {"do": "fix", "point": "A"}, {"do": "drive", "link": "link_1"},
                    {"do": "drive", "link": "link_2"})  # fmt: skip
        assert tomllib.loads(text)["drives"] == [
            {"link": "link_1", "speed": "60 rpm"},
            {"link": "link_2", "on": "link_1", "speed": "60 rpm"},
        ]
        reported = {"do": "law", "drive": 1, "curve": "modified-sine", "by": "-90 deg", "duration": "2 s", "back": True}
        text = edited(text, reported)
        assert tomllib.loads(text)["drives"][1]["law"] == [
            {"curve": "modified-sine", "duration": "2 s", "by": by} for by in ("-90 deg", "90 deg")
        ]
        answer, data = quick_answer(edited(text, {**reported, "drive": 0}))
        at, (_, count) = answer["picture"]["arrays"]["drive"]
        angle = np.frombuffer(data, "<f4")[at : at + 2 * count].reshape(2, count)[1]
        assert np.degrees(angle[0] - angle.min()) == pytest.approx(90, abs=0.1)
        with pytest.raises(ValueError, match="in rad"):
            edited(text, {**reported, "by": "90 mm"})
        again = edited(text, {"do": "law", "drive": 1, "curve": "constant speed", "speed": "30 rpm"})
        assert tomllib.loads(again)["drives"][1] == {"link": "link_2", "on": "link_1", "speed": "30 rpm"}

    def test_a_cylinder_is_one_part(self):
        arm = made({"do": "link", "points": [[0, 0], [0.3, 0.1]]}, {"do": "link", "points": ["B", [0.5, 0.1]]},
                   {"do": "fix", "point": "A"}, {"do": "weld", "point": "B"})  # fmt: skip
        text = edited(arm, {"do": "cylinder", "from": [0.1, -0.2], "to": "B"})
        answer, data = quick_answer(text)
        assert answer["mistakes"] == []
        assert answer["sheet"]["cylinders"]["cylinder_1"]["from"] == "D"
        assert stroke(answer, data) == pytest.approx(0.036, abs=1e-6)  # a tenth of 360.6 mm, by its law
        second = edited(text, {"do": "cylinder", "from": [0.2, -0.2], "to": "B"})
        assert tomllib.loads(second)["welds"]["B"]["links"] == ["link_1", "link_2"]
        moved = edited(text, {"do": "move", "point": "B", "to": [0.32, 0.16]})
        tables = tomllib.loads(moved)
        assert tables["points"]["cylinder_1_middle"] == [0.21, -0.02]
        assert tables["sliders"]["cylinder_1"]["direction"] == "58.5704 deg"  # atan2(0.36, 0.22)
        assert tables["cylinders"]["cylinder_1"]["length"] == "421.9 mm"
        assert quick_answer(moved)[0]["mistakes"] == []
        left = tomllib.loads(edited(text, {"do": "remove", "kind": "cylinder", "name": "cylinder_1"}))
        left["points"].pop("D")
        left["links"]["ground"]["points"].remove("D")
        left["welds"]["B"].pop("links")
        assert {key: value for key, value in left.items() if value} == tomllib.loads(arm)

    def test_wheels_turn_as_their_ratio_says(self):
        text = made({"do": "link", "points": [[0, 0], [0.05, 0]]}, {"do": "link", "points": [[0.2, 0], [0.25, 0]]},
                    {"do": "fix", "point": "A"}, {"do": "fix", "point": "C"}, {"do": "drive", "link": "link_1"},
                    {"do": "gear", "driver": "link_1", "follower": "link_2"})  # fmt: skip
        assert tomllib.loads(text)["gears"][0]["ratio"] == -1
        text = edited(text, {"do": "set", "path": "gears[1].ratio", "value": "-0.5"})
        answer, data = quick_answer(text)
        assert answer["sheet"]["gears"] == [{"joints": ["link_1", "link_2"], "pins": ["A", "C"], "ratio": -0.5}]
        places = points_of_picture(answer, data)
        first, second = (np.angle(places[end] - places[pin]) for end, pin in ("BA", "DC"))
        turned = np.unwrap(second)[-1] / np.unwrap(first)[-1]
        assert turned == pytest.approx(-0.5, abs=1e-5)
        assert "gears" not in tomllib.loads(edited(text, {"do": "remove", "kind": "link", "name": "link_2"}))
        with pytest.raises(EditError):
            edited(text, {"do": "set", "path": "gears[1].ratio", "value": "7 kg"})

    @pytest.mark.parametrize(("turns", "ratio"), [(True, 0.02), (False, 50.0)])
    def test_a_rack_goes_as_its_wheel_rolls(self, turns, ratio):
        """The wheel's lowest point, 20 mm below its pin, moves to the right if the wheel turns counter-clockwise."""
        rack, drive = {"point": "C"}, {"do": "drive", "link": "link_1"} if turns else {"do": "drive", "point": "C"}
        ends = ("link_1", rack) if turns else (rack, "link_1")
        text = made({"do": "link", "points": [[0, 0], [0.05, 0]]}, {"do": "fix", "point": "A"},
                    {"do": "link", "points": [[0, -0.02], [0.1, -0.05]]}, {"do": "link", "points": ["D", [0.2, -0.05]]},
                    {"do": "fix", "point": "E"}, {"do": "slot", "point": "C"}, drive)  # fmt: skip
        tied = {"do": "gear", "driver": ends[0], "follower": ends[1]}
        text = edited(text, tied)
        assert tomllib.loads(text)["gears"][0]["ratio"] == pytest.approx(ratio)
        text = edited(text, {"do": "law", "drive": 0, "curve": "harmonic", "duration": "1 s", "back": True,
                             "by": "30 deg" if turns else "10 mm"})  # fmt: skip
        answer, data = quick_answer(text)
        assert answer["mistakes"] == []
        places = points_of_picture(answer, data)
        turned = np.unwrap(np.angle(places["B"]))
        np.testing.assert_allclose(places["C"].real, 0.02 * (turned - turned[0]), atol=1e-7)
        assert np.ptp(turned) > 0.4
        assert "gears" not in tomllib.loads(edited(text, tied))
        with pytest.raises(EditError, match="a rack needs"):
            edited(text, {**tied, "driver": rack, "follower": rack})

    def test_a_drive_goes_through_the_points_of_a_csv_file(self):
        reported = {"do": "law", "drive": 0, "curve": "spline through points"}
        text = edited(STEEL, {**reported, "points": "t [s];angle [deg]\n0;0\n0.25;30\n0.5;0\n0.75;-30\n1;0\n"})
        assert tomllib.loads(text)["drives"][0]["motion"][1] == ["0.25 s", "30 deg"]
        answer, data = quick_answer(text)
        at, (_, count) = answer["picture"]["arrays"]["drive"]
        angle, time = (np.frombuffer(data, "<f4")[k : k + count] for k in (at, answer["picture"]["arrays"]["time"][0]))
        np.testing.assert_allclose(np.degrees(np.interp([0.25, 0.75], time, angle)), [30, -30], atol=0.1)
        for points, why in (("0, 0\n1, 1", "4 lines"), ("0\n1", "comma"), ("0, 0 kg\n1, 1\n2, 2\n3, 3", "an angle")):
            with pytest.raises(ValueError, match=why):
                edited(STEEL, {**reported, "points": points})

    @pytest.mark.parametrize(
        ("curve", "rate", "acceleration", "jerk"),
        [("cycloidal", 2.0, 2 * np.pi, 4 * np.pi**2), ("polynomial-345", 1.875, 10 / np.sqrt(3), 60.0),
         ("constant-acceleration", 2.0, 4.0, None), ("harmonic", np.pi / 2, np.pi**2 / 2, None)],
    )  # fmt: skip
    def test_peaks_of_a_law_are_those_of_its_closed_form(self, curve, rate, acceleration, jerk):
        """Norton, Cam Design and Manufacturing Handbook, table 3-2, for a rise of 1 in 1 and the return.

        The acceleration jumps for constant acceleration, and at the ends of a harmonic.
        """
        law = {"do": "law", "drive": 0, "curve": curve, "by": "1 rad", "duration": "1 s", "back": True}
        (drive,) = quick_answer(edited(STEEL, law))[0]["picture"]["drives"]
        assert drive["peaks"][:2] == pytest.approx([rate, acceleration], rel=1e-12)
        assert drive["peaks"][2] == (None if jerk is None else pytest.approx(jerk, rel=1e-12))

    def test_a_number_is_typed_with_its_unit(self):
        line = 'depth = "0.8 cm"'
        assert line in edited(STEEL, {"do": "set", "path": "sections.bar.depth", "value": " 0.8 cm"}).splitlines()
        for value in ("8", "8 kg"):
            with pytest.raises(ValueError, match=r"unit|expected a length"):
                edited(STEEL, {"do": "set", "path": "sections.bar.depth", "value": value})

    def test_a_slot_lies_as_it_is_dragged_and_its_point_is_pushed(self):
        text = made({"do": "link", "points": [[0, 0], [0.3, 0]]}, {"do": "slot", "point": "A", "direction": [0, 1]},
                    {"do": "link", "points": ["B", [0.3, 0.3]]}, {"do": "fix", "point": "C"},
                    {"do": "drive", "point": "A"})  # fmt: skip
        assert tomllib.loads(text)["slots"]["slot_1"]["direction"] == "90 deg"
        assert "45 deg" in edited(text, {"do": "slot", "point": "A", "direction": [1, 1]})
        text = edited(text, {"do": "weld", "point": "B"})
        assert "slot_1" not in edited(text, {"do": "slot", "point": "A"})  # also without its drive
        assert quick_answer(edited(text, {"do": "drive", "point": "A"}))[0]["picture"] is None

    def test_a_slot_in_a_link_turns_it_as_a_quick_return(self):
        """The rocker points from its pivot to the crank pin, for the whole turn."""
        text = made({"do": "link", "points": [[0, 0.1], [0.08, 0.1]]},
                    {"do": "link", "points": [[0, -0.1], [0.17, 0.29]]},
                    {"do": "fix", "point": "A"}, {"do": "fix", "point": "C"},
                    {"do": "slot", "point": "B", "on": "link_2"}, {"do": "drive", "link": "link_1"})  # fmt: skip
        answer, data = quick_answer(text)
        assert answer["mistakes"] == []
        places = points_of_picture(answer, data)
        rocker, pin = (places[end] - places["C"] for end in "DB")
        np.testing.assert_allclose(np.angle(rocker / pin), 0, atol=1e-6)
        assert np.ptp(abs(pin)) == pytest.approx(0.16, abs=1e-3)
        with pytest.raises(EditError, match="belongs to"):
            edited(text, {"do": "slot", "point": "D", "on": "link_2"})

    def test_a_point_more_of_a_link_keeps_its_place_in_it(self):
        plain, _ = quick_answer(STEEL)
        for change, along, across in (
            ({"at": [0.2, 0.3]}, 0.3, 0.1),  # in the coupler's axes, which are rotated by atan2(4, 3)
            ({"between": ["A", "B"], "share": 0.25}, 0.075, 0.0),
        ):
            text = edited(STEEL, {"do": "trace", "link": "coupler", **change})
            answer, data = quick_answer(text)
            assert answer["mistakes"] == []
            places = points_of_picture(answer, data)
            own = (places["C"] - places["A"]) * np.conj(places["B"] - places["A"]) / 0.3
            np.testing.assert_allclose(own, along + 1j * across, atol=1e-6)
            before, after = (
                {row["key"]: row["value"] for row in each["picture"]["figures"]} for each in (plain, answer)
            )
            assert after["mass"] == pytest.approx(before["mass"])  # the point carries no load
            assert after["stress"] == pytest.approx(before["stress"], rel=2e-3)
        ring = made({"do": "link", "points": [[0, 0], [0.1, 0], [0, 0.1]], "closed": True})
        more = edited(ring, {"do": "trace", "link": "link_1", "at": [0.1, 0.1]})
        assert tomllib.loads(more)["links"]["link_1"]["points"] == ["A", "B", "C", "D"]
        assert len(tomllib.loads(more)["links"]["link_1"]["beams"]) == 3

    def test_every_entry_of_the_format_is_set_and_taken_away_as_it_is_typed(self):
        known = keys()
        assert "`" not in str(known)  # shown as plain text
        assert {key for key, _ in known["springs"]} >= {"stiffness", "damping", "preload"}
        assert all(words for table in known.values() for key, words in table if key != "shape")
        text = edited(STEEL, {"do": "entry", "path": ["drives", 0, "unevenness"], "value": "0.02"})
        assert tomllib.loads(text)["drives"][0]["unevenness"] == 0.02
        assert edited(text, {"do": "entry", "path": ["drives", 0, "unevenness"], "value": " "}) == STEEL
        moved = '{time = ["0 s", "1 s"], coordinate = [0, 1]}'
        text = edited(STEEL, {"do": "entry", "path": ["drives", 0, "motion"], "value": moved})
        assert tomllib.loads(text)["drives"][0]["motion"]["time"] == ["0 s", "1 s"]
        for words in ("5 N/mm", "1979-05-27", "1\na = 2"):
            assert typed(words) == words

    @pytest.mark.parametrize(
        ("change", "path"),
        [
            ({"kind": "sections", "of": ["links", "rocker"]}, ("links", "rocker", "section")),
            ({"kind": "materials", "of": ["links", "rocker"]}, ("links", "rocker", "material")),
            ({"kind": "motors", "of": ["drives", 0]}, ("drives", 0, "motor")),
            ({"kind": "joints", "name": "B"}, ("joints", "B", "friction")),
            ({"kind": "bearings", "name": "B"}, ("bearings", "B", "plain")),
            ({"kind": "cams", "name": "B"}, ("cams", "cam_1", "roller")),
            ({"kind": "limits"}, ("limits", "safety")),
            ({"kind": "sweep"}, ("sweep", "vary", "sections.bar.depth")),
            ({"kind": "tolerances"}, ("tolerances", "sections.bar.depth")),
            ({"kind": "optimize"}, ("optimize", "variables", "sections.bar.depth")),
        ],
    )
    def test_a_table_that_is_not_drawn_is_added_answered_and_taken_away(self, change, path):
        number = {"number": "sections.bar.depth", "low": 0.003, "high": 0.012, "unit": "m"}
        text = edited(STEEL, {"do": "table", **number, **change})
        assert path in dict(entries(tomllib.loads(text)))
        assert quick_answer(text)[0]["mistakes"] == []
        kind, of = change["kind"], change.get("of")
        if of and kind != "motors":
            return
        table = kind in ("limits", "sweep", "tolerances", "optimize")
        name = kind if table else "cam_1" if kind == "cams" else change.get("name", "motor_1")
        left = edited(text, {"do": "remove", "kind": "table" if table else kind.removesuffix("s"), "name": name})
        assert tomllib.loads(left) == tomllib.loads(STEEL)

    def test_a_table_that_fits_nowhere_is_refused(self):
        with pytest.raises(EditError, match="first select the drive"):
            edited(f'{STEEL}\n[[drives]]\nlink = "rocker"\n', {"do": "table", "kind": "motors"})
        for change in ({"kind": "joints"}, {"kind": "cams", "name": "O"}, {"kind": "sweep"}, {"kind": "points"}):
            with pytest.raises(EditError):
                edited(STEEL, {"do": "table", **change})
        with pytest.raises(EditError, match="already exists"):
            edited(f"{STEEL}\n[limits]\nsafety = 2\n", {"do": "table", "kind": "limits"})

    @pytest.mark.parametrize(
        "text", ["links.a.points=3", "cylinders=3\ndrives=[{cylinder=[],slider={}}]", "gears=[{driver={link=[]}}]"]
    )
    def test_parts_that_cannot_be_read_are_left_out(self, text):
        answer, _ = quick_answer(text)
        assert answer["sheet"] is not None
        assert all("program failed" not in each["message"] for each in answer["mistakes"])

    def test_a_dragged_point_takes_attached_parts_along(self):
        text = edited(edited(STEEL, {"do": "load", "point": "B", "force": [1, 2]}), {"do": "mass", "point": "B"})
        left = tomllib.loads(edited(text, {"do": "remove", "kind": "point", "name": "B"}))
        assert "B" not in json.dumps({key: value for key, value in left.items() if key != "title"}).split('"')

    def test_an_edit_that_does_not_fit_is_refused(self):
        for change in ({"do": "nothing"}, {"do": "drive", "point": "B"}, {"do": "weld", "point": "Q"},
                       {"do": "gear", "driver": "crank", "follower": "crank"}):  # fmt: skip
            with pytest.raises(EditError):
                edited(STEEL, change)


class TestAnswers:
    """Quick answers of the editor."""

    def test_figures_are_those_of_the_quasi_static_answer(self):
        picture = quick_answer(STEEL)[0]["picture"]
        reported = {row["key"]: row["value"] for row in picture["figures"]}
        bent = deflection(scene_from_text(STEEL.replace('accuracy = "5 %"', 'theory = "quasi-static"')), positions=72)
        from elastic import sample

        assert reported["deflection"] == pytest.approx(np.abs(sample(bent, "w")).max(), rel=1e-3)
        assert reported["stress"] == pytest.approx(sample(bent, "mises").max(), rel=1e-3)

    def test_a_graph_is_the_figure_over_the_positions(self):
        """The path of B is a circle of 250.6 mm about D, and the drive does no net work over a turn."""
        answer, data = quick_answer(STEEL)
        picture = answer["picture"]

        def course(picture, data, name):
            names = [column["name"] for column in picture["columns"]]
            at, shape = picture["arrays"]["columns"]
            return np.frombuffer(data, "<f4")[at : at + np.prod(shape)].reshape(shape)[names.index(name)]

        radius = np.hypot(course(picture, data, "B.x") - 0.35, course(picture, data, "B.y"))
        assert np.allclose(radius, np.hypot(0.07, 0.24), atol=1e-6)
        effort = course(picture, data, "crank.effort")
        assert abs(effort.mean()) < 1e-3 * abs(effort).max()
        dragged, data = quick_answer(STEEL, dragged=True, graph="crank.effort")
        assert dragged["picture"]["columns"] == [{"name": "crank.effort", "unit": "N m"}]
        assert np.allclose(course(dragged["picture"], data, "crank.effort"), effort, rtol=1e-4)
        assert quick_answer(STEEL, dragged=True)[0]["picture"]["columns"] == []

    def test_a_mechanism_that_does_not_close_reports_its_reach(self):
        answer, data = quick_answer(CLOSING)
        closes = answer["picture"]["closes"]
        assert not closes["all"]
        assert "81.7" in closes["words"]
        assert answer["picture"]["positions"] == round(72 * closes["share"]) == 17
        at, shape = answer["picture"]["arrays"]["points"]
        assert np.isfinite(np.frombuffer(data, "<f4")[at : at + np.prod(shape)]).all()

    def test_an_emptied_sheet_has_no_numbers(self):
        assert quick_answer(STEEL, with_numbers=True)[0]["numbers"]
        assert quick_answer(EMPTY, with_numbers=True)[0]["numbers"] == []

    def test_points_move_with_the_beams_that_end_there_or_go_through_them(self):
        """Half way along the coupler, a point is displaced as the coupler's middle station."""
        text = edited(STEEL, {"do": "trace", "link": "coupler", "between": ["A", "B"], "share": 0.5})
        answer, data = quick_answer(text)
        (at, shape), (bent_at, bent_shape) = (answer["picture"]["arrays"][name] for name in ("moved", "bent"))
        numbers = np.frombuffer(data, "<f4")
        moved = numbers[at : at + np.prod(shape)].reshape(shape)
        bent = numbers[bent_at : bent_at + np.prod(bent_shape)].reshape(bent_shape)
        beams = [(each["from"], each["to"]) for each in answer["picture"]["beams"]]
        moved = dict(zip(answer["picture"]["points"], moved, strict=True))
        assert abs(moved["C"]).max() > 1e-5
        for point, number, station in (("A", 0, -1), ("A", 1, 0), ("C", 1, 4), ("B", 1, -1), ("B", 2, -1)):
            assert point in (*beams[number], "C")
            np.testing.assert_allclose(moved[point], bent[number, :, station], atol=1e-3 * abs(moved["C"]).max())
        assert not moved["O"].any()

    def test_sliders_go_over_the_ranges_of_the_scene(self):
        ranges = '[sweep.vary]\n"points.B.x" = {from = 0.2, to = 0.3, count = 3}\n'
        ranges += '[tolerances]\n"sections.bar.depth" = "0.1 mm"\n'
        numbers = {each["path"]: each for each in quick_answer(f"{STEEL}\n{ranges}", with_numbers=True)[0]["numbers"]}
        reported = [(numbers[path]["low"], numbers[path]["high"], numbers[path]["line"]) for path in
                ("points.B.x", "sections.bar.depth", "sections.bar.width")]  # fmt: skip
        assert reported == [(0.2, 0.3, 19), pytest.approx((0.0059, 0.0061, 13)), (0.005, 0.02, 14)]

    def test_dragging_reports_the_last_position_that_closes(self):
        reported = [
            quick_answer(CLOSING, dragged=dragged)[0]["picture"]["closes"]["words"] for dragged in (False, True)
        ]
        assert re.findall(r"[\d.]+ deg", " ".join(reported)) == [
            "81.7868 deg",
            "80 deg",
        ]  # 72 positions are 5 deg apart
        assert reported[0] == reported[1].replace("80 deg", "81.7868 deg")
        assert 'where the joint "B" opens' in reported[0]

    @pytest.mark.parametrize(
        ("name", "point", "places"),
        in_tiers(
            [
                ("steel_four_bar", "B", [0.28 + 0.24j, 0.275 + 0.235j, 0.27 + 0.235j, 0.27 - 0.235j, 0.275 - 0.235j]),
                (
                    "flap_bars",
                    "3",
                    [0.2 + 0.07j, 0.201 + 0.07j, 0.21 + 0.067j, 0.216 + 0.06j, 0.183 + 0.068j, 0.19 + 0.07j],
                ),
            ],
            1,
            1,
        ),
    )
    def test_a_drag_goes_on_from_the_picture_before_on_the_branch_that_is_drawn(self, monkeypatch, name, point, places):
        near, memory = CourseByLaws.near, Memory()
        taken: list[int] = []
        monkeypatch.setattr(CourseByLaws, "near", lambda *given: taken.append(1) or near(*given))
        for at in places:
            text = edited(shipped_scenes()[name].read_text(), {"do": "move", "point": point, "to": [at.real, at.imag]})
            before, taken[:] = memory.motion, []
            answer, data = quick_answer(text, dragged=True, memory=memory)
            followed, other = quick_answer(text, dragged=True)  # from the drawing, in certified steps
            assert bool(taken) == (before is not None)
            assert answer["picture"]["closes"] == followed["picture"]["closes"]
            np.testing.assert_allclose(
                np.frombuffer(data, "<f4"), np.frombuffer(other, "<f4"), rtol=1e-4, atol=1e-6 * abs(at)
            )

    @pytest.mark.parametrize(
        ("old", "new", "line"),
        [
            ('depth = "6 mm"', 'depth = "6 kg"', 13),
            ('length = "100 mm"', "length = 100 mm", 27),
            ('link = "crank"', 'link = "cranck"', 44),
            ("A = [0.1, 0.0]", "A = [0.1, true]", 18),
            ('points = ["A", "B"]', 'points = ["A", "X"]', 32),
        ],
    )
    def test_a_mistake_is_reported_with_its_line(self, old, new, line):
        answer, _ = quick_answer(STEEL.replace(old, new))
        assert [each["line"] for each in answer["mistakes"]] == [line]
        assert (answer["sheet"] is None) == (line == 27)  # invalid TOML has no drawing

    def test_all_unreadable_entries_are_reported_at_once(self):
        text = STEEL.replace('depth = "6 mm"', 'depth = "6 kg"').replace("A = [0.1, 0.0]", "A = [0.1, true]")
        text = text.replace('speed = "100 rad/s"', 'sped = "100 rad/s"').replace(
            "[run]", "[[drives]]\nlink = 3\n[runn]"
        )
        reported = quick_answer(text)[0]["mistakes"]
        assert [each["line"] for each in reported] == [13, 18, 45, 48, 49]
        assert 'did you mean "run"' in reported[-1]["message"]

    def test_a_limit_of_an_unknown_figure_is_reported_with_its_line(self):
        text = f'{STEEL}\n[limits.figures]\nshaking_force = "2 kN"\n"joint_forc.A" = 2\nmass = "3 m"\n'
        reported = quick_answer(text)[0]["mistakes"]
        first = text.splitlines().index('"joint_forc.A" = 2') + 1
        assert [each["line"] for each in reported] == [first, first + 1]
        assert 'did you mean "joint_force.A"' in reported[0]["message"]

    @pytest.mark.parametrize("text", [EMPTY, "", "[points]\n\n[links.ground]\npoints = []\n"])
    def test_an_empty_sheet_is_no_mistake(self, text):
        answer, _ = quick_answer(text, with_numbers=True)
        assert answer["sheet"]["empty"]
        assert (answer["mistakes"], answer["picture"]) == ([], None)
        drawn = quick_answer(edited(EMPTY, {"do": "link", "points": [[0, 0], [0.1, 0]]}))[0]
        assert drawn["mistakes"] == [{"line": None, "message": NEXT, "next": True}]
        assert not drawn["sheet"]["empty"]

    def test_limits_are_judged(self):
        text = f'{STEEL}\n[limits]\ndeflection = "1 mm"\nsafety = 1.2\n'
        text = edited(text, {"do": "table", "kind": "motors"})  # of the only drive
        quick, whole = (
            answer(text, "scene", folder=None)[0]["picture"]["limits"] for answer in (quick_answer, whole_answer)
        )
        broken = {"deflection", "rms motor torque", "motor torque"}
        assert {row["name"]: row["kept"] for row in quick} == {"safety": True, **dict.fromkeys(broken, False)}
        for rows in (quick, whole):  # broken ones first, then the most used
            assert [row["name"] for row in rows][-1] == "safety"
            assert sorted((row["used"] for row in rows[:3]), reverse=True) == [row["used"] for row in rows[:3]]
        assert {row["name"] for row in whole} == {row["name"] for row in quick}


class TestFile:
    """The file that the editor writes."""

    def test_a_file_that_changed_is_not_overwritten(self, tmp_path):
        path = tmp_path / "one.toml"
        path.write_text("a = 1\n")
        path.chmod(0o640)
        file = SceneFile(path)
        _, digest = file.read()
        after = file.write("a = 2\n", digest)
        assert path.read_text() == "a = 2\n"
        assert path.stat().st_mode & 0o777 == 0o640
        path.write_text("a = 3\n")
        with pytest.raises(ChangedError):
            file.write("a = 4\n", after)
        assert path.read_text() == "a = 3\n"
        path.unlink()
        file.write("a = 4\n", after)  # the file was deleted: writing loses nothing
        assert [each.name for each in tmp_path.iterdir()] == ["one.toml"]

    def test_a_link_stays_one(self, tmp_path):
        (tmp_path / "real.toml").write_text("a = 1\n")
        (tmp_path / "link.toml").symlink_to("real.toml")
        file = SceneFile(tmp_path / "link.toml")
        file.write("a = 2\n", file.read()[1])
        assert (tmp_path / "link.toml").is_symlink()
        assert (tmp_path / "real.toml").read_text() == "a = 2\n"

    def test_a_disk_that_takes_nothing_leaves_the_file(self, tmp_path, monkeypatch):
        path = tmp_path / "one.toml"
        path.write_text("a = 1\n")
        file = SceneFile(path)

        def full(number):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space"):
            file.write("a = 2\n", file.read()[1])
        assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("one.toml", "a = 1\n")]

    def test_a_shipped_scene_is_never_written(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        file, name = server.scene_file("steel_four_bar")
        assert (file.path, name) == (tmp_path / "steel_four_bar.toml", "steel_four_bar")
        assert file.read()[0] == STEEL
        # a new file was not read, so it is not overwritten
        (tmp_path / "steel_four_bar.toml").write_text("title = 'mine'\n")
        with pytest.raises(ChangedError):
            file.write(STEEL, "missing")


class TestShared:
    """Scenes in a link or a report."""

    def test_a_link_opens_as_the_text_that_it_carries(self):
        text = STEEL + '# "größer" than before\n'
        link = "http://127.0.0.1:50000/" + fragment(text)
        assert re.fullmatch(r"[\w/:.#=-]+", link)
        file, _ = server.scene_file(link)
        assert (file.path, file.read()[0]) == (None, text)

    def test_copying_part_of_a_link_is_refused(self):
        bomb = MARK + base64.urlsafe_b64encode(zlib.compress(bytes(5_000_000))).decode()
        for link in (fragment(STEEL)[:-9], MARK, MARK + "?", bomb):
            with pytest.raises(SceneError, match="no readable scene"):
                linked(link)

    def test_a_report_is_answered_and_edited_as_its_scene(self, tmp_path, capsys):
        scene, page = tmp_path / "mine.toml", tmp_path / "one" / "mine" / "report.html"
        scene.write_text(STEEL.replace("positions = 360", "positions = 36 # <b>few</b>"))
        main([str(scene), "-o", str(tmp_path / "one")])
        main([str(page), "-o", str(tmp_path / "two")])
        first, second = capsys.readouterr().out.splitlines()
        assert second.partition(" -> ")[0] == first.partition(" -> ")[0].replace("mine", "report")
        assert read_document(page).text() == scene.read_text()
        assert server.scene_file(str(page))[0].read()[0] == scene.read_text()
        empty = tmp_path / "other.html"
        empty.write_text("<!doctype html><title>Other</title>")
        with pytest.raises(SceneError, match="the page contains no scene"):
            read_document(empty)


class NoWorker:
    """Replaces the process that gives full answers."""

    def __init__(self):
        self.cancelled = 0

    def cancel(self):
        self.cancelled += 1

    def answer(self, text, name, folder):
        return None


class Client:
    """Sends requests with any headers to a server."""

    def __init__(self, port):
        self.host = f"127.0.0.1:{port}"
        self.own = {"Origin": f"http://{self.host}"}

    def ask(self, method, path, content=None, headers=None):
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            connection.request(method, path, content, headers or {})
            response = connection.getresponse()
            content = response.read()
        finally:
            connection.close()
        return SimpleNamespace(
            status=response.status, headers=response.headers, content=content, json=lambda: json.loads(content)
        )

    def get(self, path, headers=None):
        return self.ask("GET", path, None, headers)

    def post(self, path, body, headers=None):
        content = body if isinstance(body, bytes) else json.dumps(body).encode()
        return self.ask("POST", path, content, self.own if headers is None else headers)


@contextmanager
def served(tmp_path, text=STEEL):
    path = tmp_path / "one.toml"
    path.write_text(text)
    bound = server.bound_socket(str(path))
    live = server.Live(SceneFile(path), "one", "secret", bound.getsockname()[1], worker=NoWorker())
    serving = server.LiveServer(live)
    thread = threading.Thread(target=serving.run, kwargs={"sockets": [bound]})
    thread.start()
    try:
        yield Client(live.port), live
    finally:
        serving.should_exit = True
        thread.join()


def head(response):
    (length,) = struct.unpack("<I", response.content[:4])
    return json.loads(response.content[4 : 4 + length])


class TestServer:
    """Requests that the server answers."""

    def test_who_lacks_the_token_or_comes_from_elsewhere_is_refused(self, tmp_path):
        with served(tmp_path) as (client, _):
            for path in ("/", "/scene", "/state", "/web/main.js", "/report/x"):
                assert client.get(f"/wrong{path}").status == 403
                assert client.get(f"/secret{path}", headers={"Host": "evil.example"}).status == 403
            for path in ("/answer", "/save", "/full"):
                body = {"text": "a = 1\n", "digest": ""}
                for headers in ({}, {"Origin": "http://evil.example"}, {**client.own, "Host": "evil.example"}):
                    assert client.post(f"/secret{path}", body, headers).status == 403
                assert client.post(f"/wrong{path}", body).status == 403
                assert client.get(f"/secret{path}").status == 405
        assert (tmp_path / "one.toml").read_text() == STEEL

    def test_a_report_runs_its_own_scripts_alone(self, tmp_path):
        """test_live_page checks it in a browser."""
        with served(tmp_path) as (client, live):
            live.reports["one"] = b"<script>alert()</script>"
            policy = client.get("/secret/report/one").headers["content-security-policy"]
        assert "default-src 'none'" in policy
        [scripts] = [part for part in policy.split("; ") if part.startswith("script-src")]
        assert re.fullmatch(r"script-src( 'sha256-[A-Za-z0-9+/]{43}=')+", scripts)

    def test_a_link_leads_to_a_page_without_the_token(self, tmp_path):
        with served(tmp_path) as (client, live):
            response = client.get("/")
            assert response.status == 200
            assert live.token.encode() not in response.content
            assert b"Please copy the link, open the address that" in response.content
            assert client.get("/secret/scene").json()["opens"] == f"http://127.0.0.1:{live.port}/"
            assert client.get("/", headers={"Host": "evil.example"}).status == 403

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
    def test_a_pipe_in_the_place_of_the_file_is_not_read_nor_overwritten(self, tmp_path):
        """A separate process, because it would wait forever for data in the pipe."""
        os.mkfifo(tmp_path / "one.toml")
        script = (
            "import sys; from pathlib import Path; from live.file import ChangedError, SceneFile\n"
            "file = SceneFile(Path(sys.argv[1])); print(file.digest())\n"
            "try: file.write('a = 1', 'known')\nexcept ChangedError: print('kept')"
        )
        command = [sys.executable, "-c", script, str(tmp_path / "one.toml")]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=20, check=True)
        assert ran.stdout.split() == ["unreadable", "kept"]

    def test_the_page_asks_for_nothing_from_elsewhere(self, tmp_path):
        with served(tmp_path) as (client, _):
            page = client.get("/secret/")
            assert page.status == 200
            assert "default-src 'none'" in page.headers["content-security-policy"]
            whole = page.content.decode() + "".join(
                client.get(f"/secret/web/{name}").content.decode() for name in PAGE[1:]
            )
            assert "https://" not in whole
            assert [each for each in whole.split("http://")[1:] if not each.startswith("www.w3.org/2000/svg")] == []
            assert client.get("/secret/web/../server.py").status in (403, 404)

    def test_an_answer_bears_its_number_and_ends_the_whole_one(self, tmp_path):
        with served(tmp_path) as (client, live):
            body = {"text": STEEL, "number": 7, "edits": [{"do": "move", "point": "B", "to": [0.25, 0.2]}]}
            answer = head(client.post("/secret/answer", body))
            assert answer["number"] == 7
            assert answer["text"] != STEEL
            assert answer["picture"]["closes"]["all"]
            assert live.worker.cancelled == 1
            assert client.post("/secret/full", body).status == 204
            refused = head(client.post("/secret/answer", {**body, "edits": [{"do": "x"}]}))
            assert refused["refused"]
            assert refused["text"] == STEEL

    def test_saving(self, tmp_path):
        path = tmp_path / "one.toml"
        with served(tmp_path) as (client, _):
            digest = client.get("/secret/scene").json()["digest"]
            assert client.get("/secret/state").json()["digest"] == digest
            saved = client.post("/secret/save", {"text": EMPTY, "digest": digest})
            assert saved.status == 200
            assert path.read_text() == EMPTY
            path.write_text("# changed by hand\n")
            assert client.get("/secret/state").json()["digest"] != saved.json()["digest"]
            again = client.post("/secret/save", {"text": STEEL, **saved.json()})
            assert again.status == 409
            assert "nothing was overwritten" in again.json()["problem"]
            assert path.read_text() == "# changed by hand\n"

    def test_bytes_that_are_no_request_are_refused(self, tmp_path):
        with served(tmp_path) as (client, _):
            assert client.post("/secret/answer", b"{").status == 400
            assert client.post("/secret/answer", b"[]").status == 400
            assert client.post("/secret/answer", b"x" * 4_000_001).status == 413

    def test_it_listens_on_the_loopback_address_alone(self):
        with server.bound_socket("one") as first, server.bound_socket("two") as second:
            assert {first.getsockname()[0], second.getsockname()[0]} == {"127.0.0.1"}


class TestCommand:
    """The option --live of the command."""

    def test_without_its_packages_the_extra_is_named(self, capsys, monkeypatch):
        monkeypatch.setitem(__import__("sys").modules, "uvicorn", None)
        monkeypatch.delitem(__import__("sys").modules, "live.server")
        assert main(["--live"]) == 2
        reported = 'deflection-report: --live needs a server: pip install "starlette" "uvicorn"\n'
        assert capsys.readouterr().err == reported

    def test_without_an_editor_the_command_says_so(self, capsys, monkeypatch):
        monkeypatch.setattr(kinelast.tasks.task, "GROUP", "kinelast.nothing")
        assert main(["--live"]) == 2
        assert capsys.readouterr().err.startswith("deflection-report: no package provides a live editor")

    def test_a_notebook_without_the_packages_names_the_extra(self, monkeypatch):
        monkeypatch.setitem(__import__("sys").modules, "uvicorn", None)
        for name in ("live.server", "live.notebook"):
            monkeypatch.delitem(__import__("sys").modules, name, raising=False)
        with pytest.raises(ModuleNotFoundError, match=r'live needs uvicorn: pip install "starlette" "uvicorn"'):
            kinelast.live()

    def test_no_scene_and_several_are_refused(self, capsys, tmp_path):
        assert main(["--live", "one.toml", "two.toml"]) == 2
        assert main(["--live", str(tmp_path / "no" / "one.toml")]) == 2
        assert main(["--live", "steel_forbar"]) == 2
        assert main(["--live", "mine.linkage2"]) == 2
        said = capsys.readouterr().err.splitlines()
        assert len(said) == 4
        assert said[-1].endswith("mine.linkage2: of another program: --import 'mine.linkage2' writes its scene")

    def test_a_usual_port_in_use_is_reported(self, monkeypatch):
        def stop(_serving, sockets):
            raise KeyboardInterrupt

        monkeypatch.setattr(server.LiveServer, "run", stop)
        said = []
        with server.bound_socket("None"):  # the port of an empty sheet, or another if it is in use already
            assert server.serve(None, said.append, browse=False) == 0
        assert said[1].startswith(f"The usual port {server.preferred_port('None')} is in use")

    def test_a_terminated_editor_mentions_no_scenes(self, tmp_path):
        command = [sys.executable, "-m", "kinelast", "--live"]
        environment = {**os.environ, "BROWSER": "true"}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        with subprocess.Popen(command, cwd=tmp_path, env=environment, text=True, **pipes) as running:
            while "Ctrl+C" not in running.stdout.readline():
                pass
            time.sleep(0.5)
            running.terminate()
            _, said = running.communicate(timeout=30)
        assert said == "terminated by signal 15\n"
        assert running.returncode == 128 + 15


class TestNotebook:
    """The editor in a notebook."""

    def test_the_frame_saves_the_scene_of_the_view(self):
        view = kinelast.live(scene_from_text(STEEL, "mine"))
        try:
            host, token = view.address.split("/")[2:4]
            client = Client(int(host.partition(":")[2]))
            assert view.text == STEEL
            assert f'src="http://{host}/{token}/"' in view._repr_html_()
            page = client.get(f"/{token}/")
            assert "X-Frame-Options" not in page.headers
            assert "frame-ancestors http://localhost:* " in page.headers["Content-Security-Policy"]
            reported = client.post(
                f"/{token}/save", {"text": STEEL.replace("B = [0.28, 0.24]", "B = [0.27, 0.24]"), "digest": "missing"}
            )
            assert reported.status == 200
            assert "B = [0.27, 0.24]" in view.text
            assert view.scene.text == view.text
        finally:
            view.close()
        with pytest.raises(OSError, match="refused"):
            client.get(f"/{token}/")

    def test_a_script_imports_only_scripts_before_it(self):
        """Claim: the widget can give every script the addresses of those that it imports."""
        known = set()
        for name in PAGE[2:]:
            script = page_file(name).read_text(encoding="utf-8")
            assert set(re.findall(r'from "\./(\w+\.js)"', script)) <= known, name
            known.add(name)
        assert known == {each.name for each in WEB.glob("*.js")} - {"widget.js"} | {*SHARED}

    def test_the_widget_answers_its_page_by_messages(self, monkeypatch):
        """Stand-ins for the widget packages exchange the messages."""
        reported, came = [], threading.Event()

        class Widget:
            def __init__(self, **files):
                self.__dict__.update(files)

            def on_msg(self, listen):
                self.listen = listen

            def send(self, content, buffers):
                reported.append((content, buffers))
                came.set()

        trait = lambda: SimpleNamespace(tag=lambda **_: None)  # noqa: E731
        for name, module in (("anywidget", {"AnyWidget": Widget}), ("traitlets", {"Dict": trait, "Unicode": trait})):
            monkeypatch.setitem(sys.modules, name, SimpleNamespace(**module))
        view = kinelast.live(scene_from_text(STEEL, "mine"))
        view.close()  # no socket, only messages
        widget = view.widget
        assert "export default" in widget._esm
        assert "<svg" in widget.files["page.html"]

        def ask(path, **given):
            came.clear()
            widget.listen(None, {"number": "a 1", "path": path, "given": given}, [])
            assert came.wait(30)
            content, (body,) = reported[-1]
            assert content["number"] == "a 1"
            return SimpleNamespace(status=content["status"], content=body)

        edits = [{"do": "move", "point": "B", "to": [0.25, 0.2]}]
        answer = head(ask("answer", text=STEEL, edits=edits, number=3))
        assert (answer["number"], answer["text"]) == (3, edited(STEEL, edits[0]))
        assert json.loads(ask("scene").content)["name"] == "mine"
        assert ask("save", text=answer["text"], digest="missing").status == 200
        assert view.text == answer["text"]
        assert [ask(path).status for path in ("report/none", "page")] == [404, 404]

    def test_without_anywidget_its_extra_is_named(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "anywidget", None)
        view = kinelast.live(scene_from_text(STEEL, "mine"))
        view.close()
        with pytest.raises(ModuleNotFoundError, match=r'pip install "anywidget"'):
            _ = view.widget

    def test_nothing_else_is_framed(self, tmp_path):
        with served(tmp_path) as (client, _):
            page = client.get("/secret/")
            assert page.headers["X-Frame-Options"] == "DENY"
            assert "frame-ancestors 'none'" in page.headers["Content-Security-Policy"]

    def test_a_scene_without_a_text_is_refused(self):
        with pytest.raises(ValueError, match="was built from tables"):
            kinelast.live(scene_from_dict(tomllib.loads(STEEL)))


@pytest.mark.slow
def test_a_whole_answer_is_ended_by_the_next_drag():
    from live.full import Worker

    worker, reported = Worker(), []
    slow = STEEL.replace("positions = 360", "positions = 3600")
    thread = threading.Thread(target=lambda: reported.append(worker.answer(slow, "one")))
    thread.start()
    while worker._process is None:
        pass
    worker.cancel()
    thread.join()
    assert reported == [None]
    answer, data, report = worker.answer(STEEL.replace("positions = 360", "positions = 24"), "one")
    assert answer["picture"]["theory"] != "quasi-static"
    assert all(row["error"] is not None for row in answer["picture"]["figures"] if row["key"] == "deflection")
    assert data
    assert report.startswith(b"<!doctype html>")
    assert worker.answer("a = ", "one")[0]["mistakes"]


SCRIPT = """
import http.client, json, kinelast, sys
print("once", flush=True)
view = kinelast.live("steel_four_bar")
place, path = view.address[7:].split("/", 1)
asked = http.client.HTTPConnection(place)
asked.request("POST", f"/{path}full", json.dumps({"text": view.text}), {"Origin": f"http://{place}"})
print(asked.getresponse().status, flush=True)
view.close()
view.wait(browse=False)
"""


@pytest.mark.slow
def test_a_script_without_a_guard_is_run_once_and_answered(tmp_path):
    (tmp_path / "plain.py").write_text(SCRIPT)
    done = subprocess.run([sys.executable, "plain.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("once\n200\n", "")
