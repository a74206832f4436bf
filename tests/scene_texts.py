"""Scenes as texts, for the tests to read and to spoil."""

FOUR_BAR = """
title = "A four-bar"

[materials.steel]
E = "210 GPa"
poisson = 0.3
density = 7850

[sections.bar]
shape = "rectangle"
depth = "6 mm"
width = "10 mm"

[points]
O = [0.0, 0.0]
A = [0.1, 0.0]
B = [0.28, 0.24]
D = [0.35, 0.0]
P = [0.2, 0.25]

[links.ground]
points = ["O", "D"]

[links.crank]
points = ["O", "A"]
section = "bar"
material = "steel"

[links.coupler]
points = ["A", "B"]
section = "bar"
material = "steel"

[links.rocker]
points = ["D", "B"]
section = "bar"
material = "steel"

[[drives]]
link = "crank"
speed = "100 rad/s"

[run]
positions = 36
gravity = [0.0, -9.81]
"""

SLIDER_CRANK = """
[materials.steel]
E = 210e9
density = 7850

[sections.bar]
shape = "circle"
diameter = "8 mm"

[points]
O = [0.0, 0.0]
A = [0.1, 0.0]
B = [0.4, 0.0]

[links.ground]
points = ["O"]

[links.crank]
points = ["O", "A"]
rigid = true
mass = "100 g"
center = "O"

[links.rod]
points = ["A", "B"]
section = "bar"
material = "steel"

[links.block]
points = ["B"]
mass = "200 g"

[sliders.guide]
link = "block"
through = "B"
direction = [1, 0]

[[drives]]
link = "crank"
speed = 100

[run]
positions = 36
"""

QUICK_RETURN = """
[points]
C = [0.0, 0.0]
O = [0.0, 0.3]
A = [0.0, 0.4]
D = [0.0, 0.5]

[links.ground]
points = ["C", "O"]

[links.crank]
points = ["O", "A"]
rigid = true
mass = 0.1
center = "O"

[links.block]
points = ["A"]
mass = 0.05

[links.rocker]
points = ["C", "D"]
rigid = true
mass = 0.4
center = [0.25, 0]
inertia = "8e-3 kg m^2"

[sliders.slot]
link = "block"
on = "rocker"
through = "A"
direction = "90 deg"

[[drives]]
link = "crank"
speed = "60 rpm"

[run]
positions = 36
"""


def edited(text: str, *edits: tuple[str, str]) -> str:
    """A text with the first of each old piece replaced; every old piece must be there."""
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text
