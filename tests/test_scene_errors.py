"""Every mistake in a scene ends in one message that names the file, the table and the key."""
# ruff: noqa: E501 - a mistake a row reads best

import re
import tomllib
from contextlib import suppress
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scene_texts import FALLING, FOUR_BAR, MESH, QUICK_RETURN, SLIDER_CRANK, SWING, WHEEL, YOKE, edited

from kinelast.scene.course import IntegratedCourse
from kinelast.scene.data import scene_motion
from kinelast.scene.document import read_scene, scene_from_dict, scene_from_text
from kinelast.structure.output import structure_from_dict
from kinelast.values.error import SceneError
from kinelast.values.quantities import BendingRigidity, Force, ForcePerLength, Moment, Stiffness, TurnCompliance

CRANK = '[links.crank]\npoints = ["O", "A"]\n'
LOAD = '[[loads]]\nlink = "rocker"\n'
TABLE = 'point = "B"\nmoment = 1\ntable = [[0, 1], [9, 1]]\n'
SPRING = '[[springs]]\nlink = "rocker"\nstiffness = 1\n'
SLOT = (
    '[sliders.slot]\nlink = "block"\non = "rocker"\nthrough = "A"',
    '[slots.slot]\nlink = "crank"\non = "rocker"\npoint = "A"',
)
GEAR = '[[gears]]\ndriver = {link = "crank"}\nfollower = {link = "rocker"}\nratio = 2\n'


# An effort may make the integrator slow for extreme sizes, so gears have a constant speed here.
GEARED = edited(WHEEL, ("[[drives]]", MESH + "[[drives]]"), ("R =", "Q = [1, 0]\nR ="))


STUDIED = f"""{FOUR_BAR}
[tolerances]
"sections.bar.depth" = {{plus_minus = "0.1 mm", distribution = "normal"}}
"points.A.x" = "1 %"
[sensitivities]
figures = ["mass"]
numbers = ["sections.bar.depth"]
[sweep]
method = "sobol"
samples = 8
smallest = "mass"
[sweep.vary]
"sections.bar.depth" = {{from = "3 mm", to = "9 mm"}}
"sections.bar.width" = ["10 mm", "20 mm"]
[optimize]
minimize = "mass"
[optimize.variables]
"sections.bar.depth" = ["3 mm", "9 mm"]
[optimize.limits]
deflection = {{most = "1 mm"}}
[optimize.path]
point = "B"
places = [[0.1, 0.2]]
"""


def add(text: str) -> tuple[str, str]:
    return "[run]", f"{text}\n[run]"


def segments(*pieces: str) -> tuple[str, str]:
    return 'speed = "100 rad/s"', f"law = [{', '.join(f'{{{piece}}}' for piece in pieces)}]"


# (claim, text to damage, edits, table, key, part of the message)
MISTAKES = [
    # Structure of the file.
    ("syntax", FOUR_BAR, [("[run]", "[run")], "", "", r"not readable as TOML: .*line 43"),
    ("table twice", FOUR_BAR, [("[links.rocker]", "[links.crank]")], "", "", r"not readable as TOML: Cannot declare \[links.crank\] twice .*line 34"),
    ("quotes of a word processor", FOUR_BAR, [('"6 mm"', "“6 mm”")], "", "", "straight quotes"),
    ("a decimal comma", FOUR_BAR, [('"6 mm"', "0,006  # m")], "", "", "write 0.006$"),
    ("decimal commas of a point", FOUR_BAR, [("[0.28, 0.24]", "[0,28, 0,024]")], "", "", r"write \[0.28, 0.024\]$"),
    ("a text without quotes", FOUR_BAR, [('"rectangle"', "rectangle  # of steel")], "", "", 'as in "rectangle"$'),
    ("unknown table", FOUR_BAR, [("[[drives]]", "[[drive]]")], "", "drive", 'did you mean "drives"'),
    ("unknown key", FOUR_BAR, [("depth =", "dpeth =")], "sections.bar", "dpeth", 'did you mean "depth"'),
    ("key with a shorter part", FOUR_BAR, [("E =", 'yield_stress = "235 MPa"\nE =')], "materials.steel", "yield_stress", 'did you mean "yield"'),
    ("unknown key of a link", FOUR_BAR, [("section =", "secton =")], "links.crank", "secton", 'did you mean "section"'),
    ("unknown key, few choices", FOUR_BAR, [("positions", "count")], "run", "count", 'there is "positions", "duration"'),
    ("missing key", FOUR_BAR, [("density = 7850", "")], "materials.steel", "density", "the key is missing"),
    ("missing shape", FOUR_BAR, [('shape = "rectangle"', "")], "sections.bar", "shape", "one of rectangle, circle"),
    ("unknown shape", FOUR_BAR, [('"rectangle"', '"rectangel"')], "sections.bar", "shape", 'did you mean "rectangle"'),
    ("key of another shape", FOUR_BAR, [("depth", "diameter")], "sections.bar", "diameter", "there is no such key"),
    ("missing table", FOUR_BAR, [("[[drives]]", "[[loads]]")], "loads[1]", "speed", "no such key"),
    ("no drives", FOUR_BAR, [('[[drives]]\nlink = "crank"\nspeed = "100 rad/s"', "")], "drives", "", r"needs \[\[drives\]\]"),
    ("empty drives", "drives = []" + FOUR_BAR, [('[[drives]]\nlink = "crank"\nspeed = "100 rad/s"', "")], "drives", "",
     r"the table is missing; a scene needs \[\[drives\]\]"),
    ("single brackets", FOUR_BAR, [("[[drives]]", "[drives]")], "drives", "", "two brackets"),
    ("not a table", "links = 3", [], "links", "", r"written \[links.NAME\]"),
    ("a list of tables", FOUR_BAR, [("[materials.steel]", "[[materials]]")], "materials", "", r"\[materials.NAME\]"),
    ("bad name", FOUR_BAR, [("[links.crank]", '[links."crank 1"]')], "links", '"crank 1"', "letters A-Z"),
    ("bad point name", FOUR_BAR, [("A = [0.1", '"A.1" = [0.1')], "points", '"A.1"', "letters A-Z"),
    ("bad own point name", FOUR_BAR, [('["A", "B"]', '{A = [0, 0], B = [0.3, 0], "P 1" = [0, 0.1]}')], "links.coupler.points",
     '"P 1"', "letters A-Z"),
    ("title", FOUR_BAR, [('"A four-bar"', "4")], "", "title", "expected a text in quotes, got 4"),
    ("number without quotes", FOUR_BAR, [('"100 rad/s"', "100 rad/s")], "", "", r'line 41\b.*in quotes, as in "100 rad/s"'),
    ("space in a header", FOUR_BAR, [("[links.crank]", "[links.my crank]")], "", "", "no spaces: write my_crank"),
    ("space in a key", FOUR_BAR, [("A = [0.1", "A 1 = [0.1")], "", "", "no spaces: write A_1"),
    ("fraction of a position", FOUR_BAR, [("positions = 36", "positions = 36.5")], "run", "positions", "a whole number, got 36.5"),
    ("positions in quotes", FOUR_BAR, [("positions = 36", 'positions = "36"')], "run", "positions", 'a whole number, got "36"'),
    ("too many positions", FOUR_BAR, [("positions = 36", "positions = 1000001")], "run", "positions", "<= 1000000"),
    ("a place of one", FOUR_BAR, [("[0.1, 0.0]", "30")], "points", "A", r"a list, got 30; as in \[0.1, 0.05\]"),
    ("gravity of one", FOUR_BAR, [("[0.0, -9.81]", "9.81")], "run", "gravity", r"got 9.81; as in \[0, -9.81\]"),
    ("gravity at the top", "gravity = [0, 1]" + FOUR_BAR, [], "", "gravity", r"it belongs under \[run\]"),
    ("direction in a letter", SLIDER_CRANK, [("direction = [1, 0]", 'direction = "x"')], "sliders.guide", "direction",
     r'as in \[1, 0\], or an angle, as in "30 deg", got "x"'),
    ("no direction", SLIDER_CRANK, [("direction = [1, 0]", "")], "sliders.guide", "direction", r'missing; as in \[1, 0\] or "30 deg"'),
    ("unit of a moment", FOUR_BAR, [add(LOAD + 'point = "B"\nmoment = "3 NM"')], "loads[1]", "moment", 'did you mean "N m"'),
    ("a locked mechanism", FOUR_BAR, [add('[links.strut]\npoints = ["O", "B"]\nsection = "bar"\nmaterial = "steel"')], "links", "",
     "\"strut\" are locked: no drive can move them, remove a link or a joint"),
    # Quantities.
    ("wrong dimension", FOUR_BAR, [('"6 mm"', '"6 kg"')], "sections.bar", "depth",
     'expected a length, as in "100 mm" or 0.1, got "6 kg"'),
    ("no unit in quotes", FOUR_BAR, [('"6 mm"', '"6"')], "sections.bar", "depth", 'expected a length.*, got "6"'),
    ("unknown unit", FOUR_BAR, [('"210 GPa"', '"210 GPA"')], "materials.steel", "E", 'no unit "GPA"; did you mean "GPa"'),
    ("hertz are no speed", FOUR_BAR, [('"100 rad/s"', '"50 Hz"')], "drives[1]", "speed", '"3000 rpm".*no unit "Hz"'),
    ("unreadable unit", FOUR_BAR, [('"6 mm"', '"6 mm)"')], "sections.bar", "depth", r'got "6 mm\)"'),
    ("zero length", FOUR_BAR, [('"6 mm"', "0")], "sections.bar", "depth", "greater than zero, got 0"),
    ("negative mass", SLIDER_CRANK, [('"200 g"', "-0.2")], "links.block", "mass", "not below zero, got -0.2"),
    ("infinite", FOUR_BAR, [('"210 GPa"', "inf")], "materials.steel", "E", "of a size that occurs, got inf"),
    ("huge whole number", FOUR_BAR, [('"210 GPa"', "1" + 400 * "0")], "materials.steel", "E", "of a size that occurs, got 1000"),
    ("true", FOUR_BAR, [('"210 GPa"', "true")], "materials.steel", "E", 'as in "210 GPa".* got true'),
    ("a list", FOUR_BAR, [('"210 GPa"', "[1]")], "materials.steel", "E", r"got \[1\]"),
    ("a table", FOUR_BAR, [('"210 GPa"', "{value = 1}")], "materials.steel", "E", "got a table"),
    ("a place of three", FOUR_BAR, [("[0.1, 0.0]", "[0.1, 0.0, 0.0]")], "points", "A", "expected a list of 2 entries, got 3"),
    ("a place with a word", FOUR_BAR, [("[0.1, 0.0]", '[0.1, "x"]')], "points", "A y", 'expected a length.* got "x"'),
    ("poisson", FOUR_BAR, [("0.3", "0.7")], "materials.steel", "poisson", r"expected a number <= 0.5"),
    ("poisson and G", FOUR_BAR, [("0.3", '0.3\nG = "80 GPa"')], "materials.steel", "poisson", "not both"),
    ("a tube of no wall", FOUR_BAR, [('"rectangle"', '"tube"'), ("depth", "outer"), ('width = "10 mm"', "")], "sections.bar", "inner", "inner or wall"),
    ("a tube of two walls", FOUR_BAR, [('"rectangle"', '"tube"\nwall = "1 mm"'), ("depth", "outer"), ("width", "inner")], "sections.bar", "inner", "either inner or wall"),
    ("a thick wall", FOUR_BAR, [('"rectangle"', '"tube"'), ("depth", "outer"), ('width = "10 mm"', 'wall = "3 mm"')], "sections.bar", "wall",
     "less than half of outer, 0.003 m, got 0.003 m"),
    ("tube", FOUR_BAR, [('"rectangle"', '"tube"'), ("depth", "outer"), ("width", "inner")], "sections.bar", "inner",
     "below outer, 0.006 m, got 0.01 m"),
    ("positions", FOUR_BAR, [("= 36", "= 0")], "run", "positions", "expected a whole number >= 1"),
    # Links.
    ("no ground", FOUR_BAR, [("links.ground", "links.Ground")], "links", "ground", 'is it "Ground"'),
    ("unknown point", FOUR_BAR, [('["O", "A"]', '["O", "a"]')], "links.crank", "points", 'point "a".*did you mean "A"'),
    ("point twice", FOUR_BAR, [('["O", "A"]', '["O", "O"]')], "links.crank", "points", 'point "O" is listed 2 times'),
    ("no points", FOUR_BAR, [('["O", "A"]', "[]")], "links.crank", "points", "at least one point"),
    ("one point for a beam", FOUR_BAR, [('["O", "A"]', '["O"]')], "links.crank", "section", "at least two points, this one has 1"),
    ("coinciding points", FOUR_BAR, [("A = [0.1, 0.0]", "A = [0.0, 0.0]")], "links.crank", "points", '"O" and "A" are drawn at the same'),
    ("no material", FOUR_BAR, [('material = "steel"', "")], "links.crank", "material", 'needs a material; there is "steel"'),
    ("unknown family", FOUR_BAR, [('section = "bar"', 'section = "flatt 25x8"')], "links.crank", "section", '"flat 25x8"'),
    ("unknown material", FOUR_BAR, [('material = "steel"', 'material = "stel"')], "links.crank", "material", 'did you mean "steel"'),
    ("unknown section", FOUR_BAR, [('section = "bar"', 'section = "beam"')], "links.crank", "section", 'no section "beam"; there is "bar"'),
    ("no section", FOUR_BAR, [('section = "bar"', "")], "links.crank", "section", "a material needs a section"),
    ("neither", FOUR_BAR, [('section = "bar"\nmaterial = "steel"', "")], "links.crank", "section", "needs a section"),
    ("mass of an elastic link", FOUR_BAR, [(CRANK, CRANK + "mass = 1\n")], "links.crank", "mass", "remove mass, center and inertia"),
    ("rigid without mass", FOUR_BAR, [('section = "bar"\nmaterial = "steel"', "rigid = true")], "links.crank", "mass",
     "needs mass, or a section and a material"),
    ("mass without centre", SLIDER_CRANK, [('center = "O"', "")], "links.crank", "center", "the key is missing"),
    ("unknown centre", SLIDER_CRANK, [('center = "O"', 'center = "B"')], "links.crank", "center", 'has no point "B"; there is "O", "A"'),
    ("a second length", FOUR_BAR, [('["A", "B"]', '{A = [0, 0], B = [0.3, 0]}\nlength = 0.3')], "links.coupler", "length", "remove it"),
    ("length of three points", FOUR_BAR, [('["A", "B"]', '["A", "B", "P"]\nlength = 0.3')], "links.coupler", "length", "this link has 3"),
    ("ground with a section", FOUR_BAR, [('["O", "D"]', '["O", "D"]\nsection = "bar"')], "links.ground", "section", "only points"),
    ("rigidities with a material", FOUR_BAR,
     [('shape = "rectangle"\ndepth = "6 mm"\nwidth = "10 mm"', 'shape = "rigidities"\nEA = 1e7\nEI = 30\nmass_per_length = 0.5')],
     "links.crank", "material", "remove the material"),
    ("unknown outline point", FOUR_BAR, [(CRANK, CRANK + 'outline = ["O", "Q"]\n')], "links.crank", "outline", 'no point "Q"'),
    ("unknown masses point", FOUR_BAR, [(CRANK, CRANK + "masses = {B = 0.1}\n")], "links.crank", "masses", 'no point "B"'),
    ("unknown mass", FOUR_BAR, [add("[masses]\nC = 0.1")], "masses", "C", "no moving link has this point"),
    # Beams.
    ("unknown beam point", FOUR_BAR, [(CRANK, CRANK + 'beams = [["O", "Q"]]\n')], "links.crank", "beams[1]", 'no point "Q"'),
    ("unknown beam key", FOUR_BAR, [(CRANK, CRANK + 'beams = [{from = "O", till = "A"}]\n')], "links.crank", "beams[1].till", "there is"),
    ("beam without section", FOUR_BAR, [(CRANK + 'section = "bar"\n', CRANK + 'beams = [["O", "A"]]\n')], "links.crank", "beams[1]", "has no section"),
    ("beams apart", FOUR_BAR, [('["A", "B"]', '{A = [0, 0], B = [0.3, 0], P = [0.1, 0.1], Q = [0.2, 0.1]}\nbeams = [["A", "B"], ["P", "Q"]]')],
     "links.coupler", "beams", "are not connected"),
    ("joint off the beams", FOUR_BAR, [('["A", "B"]', '["A", "P", "B"]\nbeams = [["A", "P"]]')], "links.coupler", "beams",
     'reaches the point "B", which carries a joint'),
    ("mass off the beams", FOUR_BAR, [('["A", "B"]', '["A", "B", "P"]\nbeams = [["A", "B"]]\nmasses = {P = 1}')], "links.coupler",
     "beams", 'reaches the point "P", which carries a joint or a mass'),
    ("beam of no length", FOUR_BAR, [('["A", "B"]', '{A = [0, 0], B = [0.3, 0], P = [0.3, 0]}')], "links.coupler", "points", "has no length"),
    # Sliders.
    ("slider of no link", SLIDER_CRANK, [('link = "block"', 'link = "blok"')], "sliders.guide", "link", 'did you mean "block"'),
    ("slider on no link", SLIDER_CRANK, [("through", 'on = "grund"\nthrough')], "sliders.guide", "on", 'did you mean "ground"'),
    ("slider on itself", SLIDER_CRANK, [("through", 'on = "block"\nthrough')], "sliders.guide", "on", "cannot slide on itself"),
    ("sliding ground", SLIDER_CRANK, [('link = "block"', 'link = "ground"')], "sliders.guide", "link", "the ground cannot slide"),
    ("slider through no point", SLIDER_CRANK, [('through = "B"', 'through = "A"')], "sliders.guide", "through", 'has no point "A"; there is "B"'),
    ("slider through no place", SLIDER_CRANK, [('points = ["B"]', "points = {C = [0, 0]}"), ('through = "B"', 'through = "C"')],
     "sliders.guide", "through", "has no coordinates under"),
    ("direction zero", SLIDER_CRANK, [("[1, 0]", "[0, 0]")], "sliders.guide", "direction", r"or an angle, as in \"30 deg\", got \[0, 0\]"),
    ("direction length", SLIDER_CRANK, [("[1, 0]", '"3 mm"')], "sliders.guide", "direction", 'got "3 mm"'),
    ("guide off the beams of an elastic link", QUICK_RETURN,
     [('rigid = true\nmass = 0.4\ncenter = [0.25, 0]\ninertia = "8e-3 kg m^2"', 'section = "s"'), ("A = [0.0, 0.4]", "A = [0.01, 0.4]"),
      ("[points]", '[sections.s]\nshape = "rigidities"\nEA = 1e7\nEI = 30\nmass_per_length = 0.5\n[points]')],
     "sliders.slot", "on", 'no beam of "rocker" lies along the line .* "A": draw it on a beam'),
    ("guide without axes", QUICK_RETURN, [('points = ["C", "D"]', "points = {C = [0, 0], T = [0.5, 0]}")], "sliders.slot", "on", "draw two points"),
    # Drives.
    ("nothing driven", FOUR_BAR, [('link = "crank"\nspeed', "speed")], "drives[1]", "link", "either link or slider"),
    ("no law", FOUR_BAR, [('speed = "100 rad/s"', "")], "drives[1]", "speed", "one of speed, law, motion and effort"),
    ("drive of no link", FOUR_BAR, [('link = "crank"', 'link = "krank"')], "drives[1]", "link", 'did you mean "crank"'),
    ("drive on no link", FOUR_BAR, [('link = "crank"', 'link = "crank"\non = "rockr"')], "drives[1]", "on", 'did you mean "rocker"'),
    ("drive of the ground", FOUR_BAR, [('link = "crank"', 'link = "ground"\non = "crank"')], "drives[1]", "link", "cannot be moved"),
    ("drive on itself", FOUR_BAR, [('link = "crank"', 'link = "crank"\non = "crank"')], "drives[1]", "on", "cannot turn on itself"),
    ("drive at no pin", FOUR_BAR, [('link = "crank"', 'link = "coupler"')], "drives[1]", "on", "share no point: no pin to turn about"),
    ("drive at another pin", FOUR_BAR, [('link = "crank"', 'link = "crank"\nat = "D"')], "drives[1]", "at", 'share no point "D"'),
    ("drive at two pins", FOUR_BAR, [('["O", "A"]', '["O", "A", "D"]')], "drives[1]", "at", 'share "O", "D": name one'),
    ("drive of no slider", SLIDER_CRANK, [('link = "crank"', 'slider = "giude"')], "drives[1]", "slider", 'did you mean "guide"'),
    ("drive of a slider at", SLIDER_CRANK, [('link = "crank"', 'slider = "guide"\nat = "B"')], "drives[1]", "at", "belongs to a link"),
    ("speed of sliding", FOUR_BAR, [('"100 rad/s"', '"0.1 m/s"')], "drives[1]", "speed", 'as in "100 rad/s".*, got 0.1 m/s'),
    ("start in metres", FOUR_BAR, [("speed", 'start = "1 m"\nspeed')], "drives[1]", "start", 'expected an angle, as in "30 deg", got 1 m'),
    ("no start", FOUR_BAR, [('["O", "A"]', "{O = [0, 0], Q = [0.1, 0]}"), ('["A", "B"]', "{Q = [0, 0], B = [0.3, 0]}")],
     "drives[1]", "start", "does not give the angle"),
    ("unknown curve", FOUR_BAR, [segments('curve = "cycloid", duration = 1, by = 1')], "drives[1]", "law[1].curve", 'did you mean "cycloidal"'),
    ("unknown key of a segment", FOUR_BAR, [segments('curve = "dwell", time = 1')], "drives[1]", "law[1].time", "no such key"),
    ("no segments", FOUR_BAR, [segments()], "drives[1]", "law", "expected a list of at least 1 entries"),
    ("to and by", FOUR_BAR, [segments('curve = "cycloidal", duration = 1, by = 1, to = 1')], "drives[1]", "law[1]", "either to"),
    ("dwell by", FOUR_BAR, [segments('curve = "dwell", duration = 1, by = 1')], "drives[1]", "law[1]", "remove to and by"),
    ("segment in metres", FOUR_BAR, [segments('curve = "cycloidal", duration = 1, by = "1 m"')], "drives[1]", "law[1].by", "expected an angle"),
    ("impact", FOUR_BAR, [segments('curve = "dwell", duration = 1', 'curve = "constant-speed", duration = 1, by = 1')],
     "drives[1]", "law[2]", "the speed jumps from 0 to 1"),
    ("law too short", FOUR_BAR, [segments('curve = "constant-speed", duration = 1, by = 1'), ("[run]", "[run]\nduration = 2")],
     "drives[1]", "law", "ends at full speed after 1 s, but the run lasts 2 s"),
    # Loads.
    ("load nowhere", FOUR_BAR, [add(LOAD)], "loads[1]", "point", "either point or beam"),
    ("load on no link", FOUR_BAR, [add('[[loads]]\nlink = "roker"\npoint = "B"')], "loads[1]", "link", 'did you mean "rocker"'),
    ("load on the ground", FOUR_BAR, [add('[[loads]]\nlink = "ground"\npoint = "O"')], "loads[1]", "link", "name a moving link"),
    ("load at no point", FOUR_BAR, [add(LOAD + 'point = "A"\nmoment = 1')], "loads[1]", "point", 'no point "A"'),
    ("load of nothing", FOUR_BAR, [add(LOAD + 'point = "B"')], "loads[1]", "force", "needs force or moment"),
    ("load of a moment as force", FOUR_BAR, [add(LOAD + 'point = "B"\nforce = ["1 N m", 0]')], "loads[1]", "force[1]", "expected a force"),
    ("load off the beams", FOUR_BAR, [('["A", "B"]', '["A", "B", "P"]\nbeams = [["A", "B"]]'), add('[[loads]]\nlink = "coupler"\npoint = "P"\nmoment = 1')],
     "loads[1]", "point", 'no beam of "coupler" ends'),
    ("line load at a point", FOUR_BAR, [add(LOAD + 'point = "B"\nstart = [1, 0]')], "loads[1]", "start", "along a beam"),
    ("force along a beam", FOUR_BAR, [add(LOAD + 'beam = ["D", "B"]\nforce = [1, 0]')], "loads[1]", "force", "at a point"),
    ("line load of nothing", FOUR_BAR, [add(LOAD + 'beam = ["D", "B"]')], "loads[1]", "start", "the key is missing"),
    ("load on no beam", FOUR_BAR, [add(LOAD + 'beam = ["D", "A"]\nstart = [1, 0]')], "loads[1]", "beam", r'no beam \["D", "A"\]; there is \["D", "B"\]'),
    ("load on a rigid link", SLIDER_CRANK, [add('[[loads]]\nlink = "crank"\nbeam = ["O", "A"]\nstart = [1, 0]')], "loads[1]", "beam", "there is none"),
    ("axes", FOUR_BAR, [add(LOAD + 'axes = "truning"')], "loads[1]", "axes", 'one of fixed, turning.*did you mean "turning"'),
    ("table backwards", FOUR_BAR, [add(LOAD + 'point = "B"\nmoment = 1\ntable = [[1, 0], [0, 1]]')], "loads[1]", "table", "increasing times"),
    ("table too short", FOUR_BAR, [add(LOAD + 'point = "B"\nmoment = 1\ntable = [[0, 0], ["20 ms", 1]]')], "loads[1]", "table", 'or extend = "hold"'),
    ("against nothing", FOUR_BAR, [add(LOAD + 'point = "B"\nmoment = 1\nagainst = {link = "crank"}')], "loads[1]", "against", "needs a table"),
    ("against no link", FOUR_BAR, [add(LOAD + TABLE + 'against = {link = "krank"}')], "loads[1]", "against.link", 'did you mean "crank"'),
    ("against no slider", FOUR_BAR, [add(LOAD + TABLE + 'against = {slider = "guide"}')], "loads[1]", "against.slider", 'no slider "guide"'),
    ("against both", FOUR_BAR, [add(LOAD + TABLE + 'against = {slider = "a", link = "b"}')], "loads[1]", "against", "either link or slider"),
    ("against an unknown key", FOUR_BAR, [add(LOAD + TABLE + 'against = {lnk = "b"}')], "loads[1]", "against.lnk", 'did you mean "link"'),
    ("table in other units", FOUR_BAR, [add(LOAD + TABLE.replace("0, 1", '"0 m", 1'))], "loads[1]", "table[1]", 'a time, as in "50 ms", got 0 m'),
    ("table of over a turn", FOUR_BAR, [add(LOAD + TABLE.replace("9, 1", "9, 1") + 'against = {link = "crank"}')], "loads[1]", "table", "more than a turn"),
    ("table too short for a cubic", FOUR_BAR, [add(LOAD + TABLE + 'interpolation = "cubic"')], "loads[1]", "table", "at least 4"),
    # Springs.
    ("spring of no end", FOUR_BAR, [add(SPRING)], "springs[1]", "point", "either point, an end of the spring, or at"),
    ("spring of one end", FOUR_BAR, [add(SPRING + 'point = "B"')], "springs[1]", "anchor", 'the point of "ground"'),
    ("spring to itself", FOUR_BAR, [add(SPRING + 'on = "rocker"\nat = "B"')], "springs[1]", "on", "to itself has no effect"),
    ("spring at no point", FOUR_BAR, [add(SPRING + 'point = "B"\nanchor = "A"')], "springs[1]", "anchor", '"ground" has no point "A"'),
    ("spring of no stiffness", FOUR_BAR, [add('[[springs]]\nlink = "rocker"\nat = "D"')], "springs[1]", "stiffness", "the key is missing"),
    ("spring in other units", FOUR_BAR, [add(SPRING.replace("1", '"1 N/m"') + 'at = "D"')], "springs[1]", "stiffness", 'as in "3 N m/rad", got 1 N/m'),
    ("angle of a straight spring", FOUR_BAR, [add(SPRING + 'point = "B"\nangle = 1')], "springs[1]", "angle", "about a pin"),
    ("anchor of a spring about a pin", FOUR_BAR, [add(SPRING + 'at = "D"\nanchor = "O"')], "springs[1]", "anchor", "between points"),
    ("spring off the beams", FOUR_BAR, [('["A", "B"]', '["A", "B", "P"]\nbeams = [["A", "B"]]'), add(SPRING.replace("rocker", "coupler") + 'point = "P"\nanchor = "O"')],
     "springs[1]", "point", 'no beam of "coupler" ends'),
    # Gears, slots, joints.
    ("gear on itself", FOUR_BAR, [add('[[gears]]\ndriver = {link = "crank"}\nfollower = {link = "coupler"}\nratio = 2')], "gears[1]", "follower.on", "share no point"),
    ("gear of nothing", FOUR_BAR, [add('[[gears]]\ndriver = {}\nfollower = {link = "rocker"}\nratio = 2')], "gears[1]", "driver.link", "either link or slider"),
    ("gear without ratio", FOUR_BAR, [add('[[gears]]\ndriver = {link = "crank"}\nfollower = {link = "rocker"}\nratio = 0')], "gears[1]", "ratio", "nonzero"),
    ("ratio of a rack", FOUR_BAR, [add('[[gears]]\ndriver = {link = "crank"}\nfollower = {link = "rocker"}\nratio = "2 mm/rad"')], "gears[1]", "ratio", "expected a number, got 0.002"),
    ("pressure angle in degrees", FOUR_BAR, [add(GEAR + "pressure_angle = 20")], "gears[1]", "pressure_angle", "less than 90 deg"),
    ("pressure angle of a belt", FOUR_BAR, [add(GEAR + 'teeth = false\npressure_angle = "20 deg"')], "gears[1]", "pressure_angle", "belongs to teeth"),
    ("slot of no link", QUICK_RETURN, [SLOT, ('on = "rocker"', 'on = "roker"')], "slots.slot", "on", 'did you mean "rocker"'),
    ("slot of no point", QUICK_RETURN, [SLOT, ('point = "A"', 'point = "B"')], "slots.slot", "point", '"crank" has no point "B"'),
    ("slot in itself", QUICK_RETURN, [SLOT, ('on = "rocker"', 'on = "crank"')], "slots.slot", "on", "cannot slide on itself"),
    ("slot beside a pin", QUICK_RETURN, [SLOT, ('points = ["C", "D"]', 'points = ["C", "A", "D"]')], "slots.slot", "point", 'a pin joins both links there: remove it from the points of "rocker"'),
    ("slot as a slider", QUICK_RETURN, [add('[slots.slot]\npoint = "A"\nlink = "crank"\non = "rocker"\ndirection = [0, 1]')], "slots.slot", "", "a slider has this name"),
    ("limit of a figure", FOUR_BAR, [("[links.crank]", '[limits]\nstress = "9 MPa"\n[links.crank]')], "limits", "stress", r"^there is no such key; a limit of any other figure belongs under .limits.figures."),
    ("friction", FOUR_BAR, [("[links.crank]", "[links.crank]\nfriction = 0.1")], "links.crank", "friction", "^there is no such key; it belongs under .joints.NAME."),
    ("clearance", FOUR_BAR, [add('[joints.B]\nclearance = "10 um"')], "joints.B", "clearance", "no such key; it belongs under .bearings.NAME"),
    ("damping of a run", FOUR_BAR, [("positions = 36", "positions = 36\ndamping = 0.01")], "run", "damping", "links are damped by damping_ratio under .run"),
    ("wear", FOUR_BAR, [add('[joints.B]\nwear = 1')], "joints.B", "wear", "^wear is not modelled"),
    ("a choice of words", FOUR_BAR, [add(LOAD + TABLE + 'interpolation = "periodic"')], "loads[1]", "interpolation",
     "expected one of linear, cubic, got \"periodic\""),
    ("a choice that may be left out", FOUR_BAR, [add(LOAD + TABLE + 'extend = "periodic"')], "loads[1]", "extend",
     'expected one of hold, got "periodic"'),
    ("times that do not grow", FOUR_BAR, [add(LOAD + TABLE.replace("[9, 1]", "[-9, 1]"))], "loads[1]", "table",
     "expected increasing times; a step is two entries with the same abscissa"),
    ("three entries at one place", FOUR_BAR, [add(LOAD + TABLE.replace("[9, 1]", "[0, 1], [0, 2], [9, 1]"))], "loads[1]", "table",
     "expected increasing times"),
    ("a step in a cubic", FOUR_BAR, [add(LOAD + TABLE.replace("[9, 1]", "[1, 1], [1, 2], [9, 1]") + 'interpolation = "cubic"')],
     "loads[1]", "table", "in a linear table"),
    ("powers of powers", FOUR_BAR, [('"6 mm"', '"1 m^9^9^9"')], "sections.bar", "depth", r'got "1 m\^9\^9\^9"'),
    ("a large power", FOUR_BAR, [('"6 mm"', '"1 m**999999999"')], "sections.bar", "depth", "got"),
    ("powers in brackets", FOUR_BAR, [('"6 mm"', '"1 ((m^9)^9)^99"')], "sections.bar", "depth", "got"),
    ("many digits", FOUR_BAR, [('"6 mm"', f'"{"1" * 20_000} mm"')], "sections.bar", "depth", r'got "1+ \.\.\. 1+ mm"$'),
    ("a whole number of thousands of digits", FOUR_BAR, [('"6 mm"', "9" * 5000)], "", "", "thousands of digits"),
    ("the same in base 16", FOUR_BAR, [('"6 mm"', "0x" + "f" * 9000)], "sections.bar", "depth", "got a whole number of some 10800 digits"),
    ("lists in lists", FOUR_BAR, [('"6 mm"', "[" * 500 + "]" * 500)], "", "", "nested too deeply"),
    ("control characters", FOUR_BAR, [('"6 mm"', r'"\u0000\u001b[2J"')], "sections.bar", "depth", r'got "\\x00\\x1b\[2J"$'),
    ("a long name", FOUR_BAR, [('["O", "A"]', f'["O", "{"a" * 300_000}"]')], "links.crank", "points", r"^.{400,600}$"),
    ("a tiny duration", FOUR_BAR, [("positions = 36", "positions = 36\nduration = 5e-324")], "run", "duration", "a number of a size that occurs"),
    ("a short run", FOUR_BAR, [("positions = 36", "positions = 36\nduration = 1e-20")], "run", "duration", "a run of 1e-12 to 1e\\+12 s"),
    ("a slow drive", FOUR_BAR, [('"100 rad/s"', "1e-300")], "run", "duration", "a run of 1e-12"),
    ("a tiny length", FOUR_BAR, [('"6 mm"', "5e-324")], "sections.bar", "depth", "a number of a size that occurs"),
    ("an unknown unit of lengths", 'units = "yd"' + FOUR_BAR, [], "", "units", 'expected one of m, cm, mm, in, got "yd"'),
    ("a bare area where lengths are in mm", 'units = "mm"' + FOUR_BAR,
     [('shape = "rectangle"\ndepth = "6 mm"\nwidth = "10 mm"', 'shape = "properties"\nA = 60\nI = "180 mm^4"')], "sections.bar", "A",
     "in quotes with its unit"),
    ("a bare speed of sliding where lengths are in mm", 'units = "mm"' + SLIDER_CRANK, [('link = "crank"', 'slider = "guide"'),
     ("speed = 100", "speed = 3")], "drives[1]", "speed", "in quotes with its unit"),
    ("joint of no name", FOUR_BAR, [add('[joints.P]\ncompliance = 1')], "joints", "P", 'there is no joint "P"'),
    ("two pins of a name that give way", FOUR_BAR, [add('[links.weight]\npoints = ["B"]\nmass = 1\n[joints.B]\ncompliance = 1e-8')],
     "joints.B", "", "^2 joints have this name"),
    ("pin without moment", FOUR_BAR, [add("[joints.B]\nrotation = 1")], "joints.B", "rotation", "carries no moment"),
    ("contacts", FOUR_BAR, [add('[contacts.mesh]\nlinks = ["crank", "rocker"]\nat = [0, 0]')], "contacts", "", "structure_only = true; otherwise"),
    # Sections.
    ("three sizes", FOUR_BAR, [('"6 mm"', "[1, 2, 3]")], "sections.bar", "depth", r"two for the ends of the beam.*got \[1, 2, 3\]"),
    ("a needle", FOUR_BAR, [('"6 mm"', '["6 mm", 1e-9]')], "sections.bar", "depth", "with a ratio of at most 1000"),
    ("a size of zero", FOUR_BAR, [('"6 mm"', "[1, 0]")], "sections.bar", "depth", "greater than zero"),
    ("a G that cannot be", FOUR_BAR, [("poisson = 0.3", 'G = "50 GPa"')], "materials.steel", "G", "Poisson's ratio of 1.1"),
    ("shear of any shape", FOUR_BAR, [('"rectangle"\ndepth = "6 mm"\nwidth = "10 mm"', '"properties"\nA = 1e-4\nI = 1e-9'),
     ("[run]", '[run]\nbeams = "timoshenko"')], "sections.bar", "shear_area", "timoshenko"),
    ("shear of rigidities", FOUR_BAR, [('"rectangle"\ndepth = "6 mm"\nwidth = "10 mm"', '"rigidities"\nEA = 1e4\nEI = 1e2\nmass_per_length = 1'),
     ('material = "steel"', ""), ("[run]", '[run]\nbeams = "timoshenko"')], "sections.bar", "kGA", "timoshenko"),
    ("warm without expansion", FOUR_BAR, [(CRANK, CRANK + 'temperature = "9 K"\n')], "materials.steel", "expansion", "temperature of a beam"),
    ("mass without a section", FOUR_BAR, [('section = "bar"\nmaterial = "steel"', 'mass = 1')], "links.crank", "mass", "a link with a mass and without a section is rigid: add rigid = true"),
    ("warm rigid link", FOUR_BAR, [(CRANK, CRANK + 'rigid = true\ntemperature = "9 K"\n')], "links.crank", "temperature", "only elastic links"),
    ("strain beyond linear theory", FOUR_BAR, [(CRANK, CRANK + "strain = 0.2\n")], "links.crank", "strain", "<= 0.1"),
    # Drives in other ways.
    ("table of a speed", FOUR_BAR, [("speed", "table = [[0, 0], [1, 1]]\nspeed")], "drives[1]", "table", "belongs to an effort"),
    ("repeated speed", FOUR_BAR, [("speed", "repeat = true\nspeed")], "drives[1]", "repeat", "belongs to a law or a motion"),
    ("motion with start", FOUR_BAR, [('speed = "100 rad/s"', "start = 1\nmotion = [[0, 0], [1, 1], [2, 2], [3, 3]]")], "drives[1]", "start", "remove this key"),
    ("motion from later", FOUR_BAR, [('speed = "100 rad/s"', "motion = [[1, 0], [2, 1], [3, 2], [4, 3]]")], "drives[1]", "motion", "start at 0"),
    ("motion in metres", FOUR_BAR, [('speed = "100 rad/s"', 'motion = [[0, 0], [1, "1 m"], [2, 1], [3, 2]]')], "drives[1]", "motion[2]", "expected an angle"),
    ("effort in newtons", FOUR_BAR, [('speed = "100 rad/s"', 'effort = "3 N"'), ("[run]", "[run]\nduration = 1")], "drives[1]", "effort", 'as in "3 N m", got 3 N'),
    ("joints in space", FOUR_BAR, [add('[joints.B]\ntype = "pivot"')], "joints", "", "use --structure"),
    ("structure alone", "structure_only = true\n" + FOUR_BAR, [], "", "structure_only", "use --structure"),
    # Found only for the mechanism as a whole.
    ("no duration", SLIDER_CRANK, [('link = "crank"\nspeed = 100', 'slider = "guide"\nspeed = 0.1')], "run", "duration", "without a drive that turns at constant speed"),
    ("a link too many", FOUR_BAR, [add('[links.arm]\npoints = ["B", "P"]\nsection = "bar"\nmaterial = "steel"')], "links.arm", "",
     r'link "arm" is left with 1 freedom: add a drive or a joint for each; points of one link only: "P"$'),
    ("two drives of one pin", FOUR_BAR, [add('[[drives]]\nlink = "crank"\nspeed = 1')], "drives", "", 'two drives move the joint "O"'),
    ("times of a table closer than round-off", FOUR_BAR,
     [add(LOAD + TABLE.replace("[9, 1]]", '[1e-308, 2], [5, 2], [9, 1]]\ninterpolation = "cubic"'))], "loads[1]", "table",
     "expected increasing times"),
    ("times of a motion closer than round-off", FOUR_BAR,
     [('speed = "100 rad/s"', 'motion = [[0, 0], [1e-308, 0.1], ["0.5 s", 1], ["1 s", 2]]')], "drives[1]", "motion", "times that start at 0 and grow"),
    # Studies of the scene, checked in every run.
    ("choice in a tolerance", FOUR_BAR,
     [("[run]", '[tolerances]\n"sections.bar.depth" = {plus_minus = 1, distribution = "gauss"}\n[run]')], "tolerances",
     "sections.bar.depth.distribution", 'expected one of uniform, normal, got "gauss"'),
    ("key in a tolerance", FOUR_BAR, [("[run]", '[tolerances]\n"sections.bar.depth" = {plusminus = 1}\n[run]')], "tolerances",
     "sections.bar.depth.plusminus", "no such key; did you mean"),
    ("key in a limit of an optimum", FOUR_BAR, [("[run]", '[optimize.limits]\nmass = {mst = 1}\n[run]')], "optimize",
     "limits.mst", 'did you mean "most"'),
    ("tolerance of nothing", FOUR_BAR, [("[run]", '[tolerances]\n"sections.bar.dpth" = 1\n[run]')], "", "sections.bar.dpth",
     'did you mean "sections.bar.depth"'),
    ("tolerance in kilograms", FOUR_BAR, [("[run]", '[tolerances]\n"sections.bar.depth" = "1 kg"\n[run]')], "", "sections.bar.depth",
     "expected a length"),
    ("tolerance of zero", FOUR_BAR, [("[run]", '[tolerances]\n"points.O.x" = "2 %"\n[run]')], "tolerances", '"points.O.x"',
     "greater than zero"),
    ("variable of nothing", FOUR_BAR, [("[run]", '[optimize.variables]\n"links.a.length" = [1, 2]\n[run]')], "", "links.a.length", "no such number"),
    ("bounds the wrong way round", FOUR_BAR, [("[run]", '[optimize.variables]\n"sections.bar.depth" = [2, 1]\n[run]')], "optimize.variables",
     '"sections.bar.depth"', "the lower one first"),
    ("sensitivity to nothing", FOUR_BAR, [("[run]", '[sensitivities]\nnumbers = ["points.Z.x"]\n[run]')], "", "points.Z.x", "no such number"),
    ("sweep of nothing", FOUR_BAR, [("[run]", '[sweep.vary]\n"points.Z.x" = [1, 2]\n[run]')], "", "points.Z.x", "no such number"),
    ("sweep the wrong way round", FOUR_BAR, [("[run]", '[sweep.vary]\n"points.A.x" = {from = 2, to = 1}\n[run]')], "sweep", "vary points.A.x",
"reversed: from"),
    ("drawn in line", FOUR_BAR, [("B = [0.28, 0.24]", "B = [0.3, 0.0]"), ("A = [0.1, 0.0]", "A = [0.05, 0.0]")], "points", "", "drawn in line"),
    ("pin not drawn", FOUR_BAR, [('["A", "B"]', "{A = [0, 0], Q = [0.3, 0]}"), ('["D", "B"]', "{D = [0, 0], Q = [0.25, 0]}")],
     "points", "", '"Q" is not drawn'),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "edits", "table", "key", "message"), [row[1:] for row in MISTAKES], ids=[row[0] for row in MISTAKES]
)
def test_the_message_names_table_and_key(text, edits, table, key, message):
    with pytest.raises(SceneError) as caught:
        scene_from_text(edited(text, *edits), "mine", "mine.toml")
    error = caught.value
    assert (error.file, error.table, error.key) == ("mine.toml", table, key), str(error)
    assert re.search(message, error.problem), error.problem
    assert "\n" not in error.args[0]


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (Moment, "3 Nm", 3.0),
        (Moment, "3 Nmm", 3e-3),
        (Moment, "3 kNm", 3e3),
        (BendingRigidity, "3 Nm^2", 3.0),
        (BendingRigidity, "3 kNmm²", 3e-3),
        (Stiffness, "3 Nm/rad", 3.0),
        (TurnCompliance, "3 rad/Nm", 3.0),
    ],
)
def test_a_newton_metre_can_be_written_as_one_word(kind, text, value):
    assert kind.read(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["3 Nm^-1", "3 Nms", "3 nm"])
def test_ambiguous_units_are_errors(text):
    for kind in (Moment, ForcePerLength, Force):
        with pytest.raises(ValueError, match="expected a"):
            kind.read(text)


def test_the_message_names_file_table_key_and_problem():
    with pytest.raises(SceneError) as caught:
        scene_from_text(edited(FOUR_BAR, ('"6 mm"', '"6 kg"')), "mine", "mine.toml")
    assert str(caught.value) == 'mine.toml: [sections.bar] depth: expected a length, as in "100 mm" or 0.1, got "6 kg"'
    with pytest.raises(
        SceneError,
        match=r"^mine.toml: \[\[drives\]\] no. 1 speed: expected exactly one of speed, law, motion and effort",
    ):
        scene_from_text(edited(FOUR_BAR, ('speed = "100 rad/s"', "")), "mine", "mine.toml")


@pytest.mark.parametrize("text", [FOUR_BAR, SLIDER_CRANK, QUICK_RETURN, YOKE, SWING, GEARED, STUDIED])
def test_the_undamaged_texts_are_valid(text):
    scene_motion(scene_from_text(text))


def test_the_message_names_a_missing_table():
    with pytest.raises(SceneError, match=r"needs \[points\]") as caught:
        scene_from_dict({"links": {}, "drives": []})
    assert caught.value.table == "points"
    with pytest.raises(SceneError, match=r"needs \[links.NAME\]"):
        scene_from_dict({"points": {"O": [0, 0]}})


def test_the_message_gives_the_angles_at_which_a_crank_stops():
    # Crank 200 mm, rocker 100 mm: the mechanism can be assembled only while A is near D.
    short = edited(
        FOUR_BAR, ('["A", "B"]', '["A", "B"]\nlength = "200 mm"'), ('["D", "B"]', '["D", "B"]\nlength = "100 mm"')
    )
    with pytest.raises(SceneError) as caught:
        scene_motion(scene_from_text(short, "mine", "mine.toml"))
    # A is within 300 mm of D while 350^2 + 100^2 - 2 350 100 cos(angle) < 300^2: up to 52.617 deg.
    assert caught.value.table == "drives[1]"
    assert 'joint "B"' in str(caught.value)
    angles = [float(found) for found in re.findall(r'"crank" at (-?[\d.]+) deg', str(caught.value))]
    assert angles
    assert all(
        abs(angle) % 360 == pytest.approx(52.617, abs=1e-3) or abs(angle) % 360 == pytest.approx(307.383, abs=1e-3)
        for angle in angles
    )
    assert scene_motion(scene_from_text(short), partial=True).columns == (36,)


def test_two_drives_of_one_freedom_are_an_error():
    fighting = edited(FOUR_BAR, add('[[drives]]\nlink = "rocker"\nspeed = 1'))
    with pytest.raises(SceneError) as caught:
        scene_motion(scene_from_text(fighting, "mine", "mine.toml"))
    assert caught.value.table in ("drives", "drives[1]", "links", "links.coupler")


def test_lengths_that_cannot_be_assembled_are_an_error():
    never = edited(
        FOUR_BAR, ('["A", "B"]', '["A", "B"]\nlength = "50 mm"'), ('["D", "B"]', '["D", "B"]\nlength = "100 mm"')
    )
    with pytest.raises(SceneError, match='cannot be assembled: the joint "B"') as caught:
        scene_motion(scene_from_text(never))
    assert caught.value.table == "links"


JUNK = [0, -1, 1e300, float("inf"), float("nan"), "", "A", "ground", "rocker", "3 mm", "2 kg", [], {}, [1, 2], ["A", "B"], ["O"],
        [["A", "B"]], True, None, 10**40, {"A": [0, 0], "B": [1, 0]}, {"A": 1}, [{"a": 1}]]  # fmt: skip
BASES = [tomllib.loads(text) for text in (FOUR_BAR, SLIDER_CRANK, QUICK_RETURN, YOKE, SWING, GEARED, STUDIED)]


def branches(tree, path=()):
    """Yield the paths of all entries in a tree of tables and lists."""
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, entry in entries:
        yield (*path, key)
        yield from branches(entry, (*path, key))


@given(st.sampled_from([(base, path) for base in BASES for path in branches(base)]), st.sampled_from(JUNK))
def test_any_contents_are_a_scene_or_a_scene_error(place, junk):
    base, path = place
    damaged = deepcopy(base)
    table = damaged
    for key in path[:-1]:
        table = table[key]
    table[path[-1]] = deepcopy(junk)
    with suppress(SceneError):
        structure_from_dict(damaged)
    with suppress(SceneError):
        scene_motion(scene_from_dict(damaged), 3)


def test_unreadable_files_are_errors(tmp_path: Path):
    with pytest.raises(SceneError, match="there is no such file"):
        read_scene(tmp_path / "none.toml")
    with pytest.raises(SceneError, match="not readable"):
        read_scene(tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'title = "M\xfcller"')
    with pytest.raises(SceneError, match=r"latin.toml: not a text in UTF-8 at line 1: save it in UTF-8"):
        read_scene(latin)


def test_the_error_can_be_pickled():
    import pickle

    error = pickle.loads(pickle.dumps(SceneError("a.toml", "links", "crank", "wrong")))
    assert (str(error), error.key) == ("a.toml: [links] crank: wrong", "crank")


def test_messages_are_short_and_printable():
    error = SceneError("a\x1b.toml", "links", "k" * 10**6, "\x00" * 10**6)
    assert len(str(error)) < 5000
    assert str(error).isprintable()
    assert (error.file, len(error.key)) == ("a\x1b.toml", 10**6)


def test_lengths_without_unit_are_in_the_unit_of_the_scene():
    """The same scene in metres and millimetres, with a law for a slide and a table against it."""
    metres = edited(
        SLIDER_CRANK,
        ("A = [0.1, 0.0]", "A = [0.06, 0.08]"),
        ('link = "crank"', 'slider = "guide"'),
        ("speed = 100", 'law = [{curve = "cycloidal", duration = 1, by = -0.02}]'),
        add(
            '[[loads]]\nlink = "block"\npoint = "B"\nforce = [1, 0]\ntable = [[-0.02, 1], [0, 2]]\nagainst = {slider = "guide"}'
        ),
    )
    raw = tomllib.loads(metres)
    for place in raw["points"].values():
        place[:] = [1000 * part for part in place]
    raw["drives"][0]["law"][0]["by"] = -20
    raw["loads"][0]["table"] = [[-20, 1], [0, 2]]
    raw["units"] = "mm"
    one, other = scene_motion(scene_from_text(metres)), scene_motion(scene_from_dict(raw))
    np.testing.assert_allclose(other.origin, one.origin, rtol=0, atol=1e-15)
    for course in (one, other):
        np.testing.assert_allclose(course.mechanism.loads[0].law(course)[[0, -1]], [2, 1])


def test_two_entries_at_one_time_are_a_step():
    """The moment of 1 N m triples at half time; at the step itself the later value applies."""
    text = edited(
        FOUR_BAR,
        add(LOAD + 'point = "B"\nmoment = 1\ntable = [[0, 1], [0.5, 1], [0.5, 3], [1, 3]]'),
        ("positions = 36", "positions = 5\nduration = 1"),
    )
    course = scene_motion(scene_from_text(text))
    assert course.mechanism.loads[0].law(course).tolist() == [1, 1, 3, 3, 3]


def test_an_interrupted_course_keeps_the_steps_before_the_interrupt():
    """The interrupt comes at the third step, before any motion is requested."""

    def three(time: float) -> None:
        seen.append(time)
        if len(seen) == 3:
            raise KeyboardInterrupt

    seen: list[float] = []
    course = scene_from_text(FALLING).course.reporting(three)
    assert course.interrupted == seen[-1]
    assert course.at(course.reached(course.times())).time.max() <= seen[-1]
    assert (course.interrupted, len(seen)) == (seen[-1], 3)
    steady = scene_from_text(FOUR_BAR).course
    assert (steady.interrupted, steady.reporting(three)) == (None, steady)
    assert steady.period == pytest.approx(2 * np.pi / 100)
    assert np.isnan(course.period)


def test_an_integration_with_too_many_steps_keeps_its_results():
    scene = scene_from_text(edited(FALLING, ("positions", "steps = 3\npositions")))
    with pytest.raises(
        SceneError, match=r"taken 3 steps, 2 s would take .*; steps under \[run\] allows more; --reachable keeps"
    ):
        scene_motion(scene)
    seen: list[float] = []
    course = scene.course.reporting(seen.append)
    assert isinstance(course, IntegratedCourse)
    motion, stop = course.integrated
    assert stop is not None
    assert seen == motion.time[1:].tolist()
    whole = scene_from_text(FALLING)
    reached = scene.course.reached(whole.course.times())
    assert 0 < len(reached) < 21
    np.testing.assert_allclose(scene.course.at(reached).direction, whole.course.at(reached).direction, atol=1e-8)
