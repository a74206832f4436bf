"""Scenes that describe only structure, and --structure for any scene."""
# ruff: noqa: E501 - a mistake a row reads best

import json
import re

import pytest
from scene_texts import FOUR_BAR, edited

from kinelast.cli.command import main
from kinelast.scene.document import scene_from_text
from kinelast.structure.output import structure_from_text
from kinelast.values.error import SceneError
from rigid import assur_groups
from rigid.topology import mechanism_mobility

CHAIN = """
title = "A screw"
fixed = "frame"

[joints.turn]
links = ["frame", "screw"]
type = "pivot"
axis = [0, 0, 2]

[joints.thread]
links = ["frame", "screw"]
type = "screw"
pitch = "2 mm"
"""

BARE = """
structure_only = true
points = {O = [0, 0], A = [0.1, 0.1], B = [0.3, 0.1], D = [0.3, 0]}
links = {ground = {points = ["O", "D"]}, one = {points = ["O", "A"]}, two = {points = ["A", "B"]}, three = {points = ["D", "B"]}}
"""


class TestReading:
    def test_links_need_neither_mass_nor_section_nor_drives(self):
        mechanism = structure_from_text(BARE).mechanism
        assert int(mechanism_mobility(mechanism).mobility) == 1
        assert mechanism.drives == ()

    def test_drives_need_no_speed(self):
        mechanism = structure_from_text(BARE + 'drives = [{link = "one"}]').mechanism
        assert [group.links for group in assur_groups(mechanism)] == [("one",), ("two", "three")]

    def test_a_chain_of_joints_in_space(self):
        scene = structure_from_text(CHAIN)
        assert (scene.title, scene.fixed, scene.mechanism) == ("A screw", "frame", None)
        turn, thread = scene.joints
        assert (turn.kind.name, thread.kind.name, thread.pitch) == ("revolute", "helical", 0.002)

    def test_an_immobile_mechanism_has_a_structure(self):
        stuck = edited(
            FOUR_BAR,
            ('[[drives]]\nlink = "crank"', '[[drives]]\nlink = "rocker"\nspeed = 1\n[[drives]]\nlink = "crank"'),
        )
        with pytest.raises(SceneError):
            scene_from_text(stuck)
        assert len(structure_from_text(stuck).mechanism.drives) == 2


MISTAKES = [
    ("unknown type", CHAIN, ('"pivot"', '"pivto"'), "joints.turn", "type", 'no type "pivto", did you mean "pivot"'),
    ("no pitch", CHAIN, ('pitch = "2 mm"', ""), "joints.thread", "pitch", "advance per radian"),
    ("pitch of a pivot", CHAIN, ('type = "pivot"', 'type = "pivot"\npitch = 1'), "joints.turn", "pitch", "helical joint"),
    ("name with a space", CHAIN, ('links = ["frame", ', 'links = ["the frame", '), "joints.turn", '"the frame"', "a name may have"),
    ("no axis", CHAIN, ("[0, 0, 2]", "[0, 0, 0]"), "joints.turn", "axis", "its axis has no length"),
    ("no normal", CHAIN, ('type = "pivot"', 'type = "universal"'), "joints.turn", "normal", "needs a normal"),
    ("fixed nothing", CHAIN, ('fixed = "frame"', 'fixed = "frme"'), "", "fixed", 'fixed link "frme"'),
    ("place in the plane", CHAIN, ("axis = [0, 0, 2]", "at = [0, 0]"), "joints.turn", "at", "list of 3 entries"),
    ("key of the plane", CHAIN, ("axis = [0, 0, 2]", "gap = [0, 0]"), "joints.turn", "gap", "no such key"),
    ("contact of nothing", BARE, ("points =", 'contacts = {c = {links = ["one", "for"], at = [0, 0]}}\npoints ='), "contacts.c",
     "links[2]", 'no link "for"'),
    ("contact with itself", BARE, ("points =", 'contacts = {c = {links = ["one", "one"], at = [0, 0]}}\npoints ='), "contacts.c",
     "links", "cannot touch itself"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "edit", "table", "key", "message"), [row[1:] for row in MISTAKES], ids=[row[0] for row in MISTAKES]
)
def test_the_message_names_table_and_key(text, edit, table, key, message):
    with pytest.raises(SceneError) as caught:
        structure_from_text(edited(text, edit), "mine", "mine.toml")
    assert (caught.value.table, caught.value.key) == (table, key), str(caught.value)
    assert re.search(message, caught.value.problem), str(caught.value)


class TestCommand:
    def test_the_files_join_those_that_are_there_until_the_next_run(self, tmp_path, capsys):
        folder = tmp_path / "steel_four_bar"
        assert main(["steel_four_bar", "--positions", "12", "--theory", "quasi-static", "-o", str(tmp_path)]) == 0
        assert main(["steel_four_bar", "--structure", "-o", str(tmp_path)]) == 0
        files = {"report.html", "positions.csv", "summary.json", "structure.txt", "skeleton.svg"}
        assert {entry.name for entry in folder.iterdir()} == files
        assert set(json.loads((folder / "summary.json").read_text())["files"]) == files - {"summary.json"}
        assert main(["steel_four_bar", "--positions", "12", "--theory", "quasi-static", "-o", str(tmp_path)]) == 0
        assert {entry.name for entry in folder.iterdir()} == files - {"structure.txt", "skeleton.svg"} | {"earlier"}
        assert {entry.name for entry in (folder / "earlier").iterdir()} == {"structure.txt", "skeleton.svg"}
        assert main(["steel_four_bar", "--structure", "-o", str(tmp_path)]) == 0
        assert {entry.name for entry in folder.iterdir()} == files | {"earlier"}

    def test_a_bad_scene_does_not_stop_the_others(self, tmp_path, capsys):
        bad = tmp_path / "bad.toml"
        bad.write_text("points = 3")
        assert main([str(bad), "quick_return", "--structure", "--quiet", "-o", str(tmp_path / "out")]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert said.err.count("\n") == 1
        assert (tmp_path / "out" / "quick_return" / "skeleton.svg").read_text().startswith("<?xml")

    def test_a_mechanism_that_does_not_close_has_a_text_without_diagram(self, tmp_path, capsys):
        path = tmp_path / "open.toml"
        path.write_text(
            edited(
                FOUR_BAR, ('["A", "B"]', '["A", "B"]\nlength = "10 mm"'), ('["D", "B"]', '["D", "B"]\nlength = "1 cm"')
            )
        )
        assert main([str(path), "--structure", "-o", str(tmp_path / "out")]) == 0
        assert "no skeleton diagram (the mechanism does not close near its drawing" in capsys.readouterr().out
        assert {entry.name for entry in (tmp_path / "out" / "open").iterdir()} == {"structure.txt", "summary.json"}
