"""Scenes as texts, which tests read, change and damage."""


def edited(text: str, *edits: tuple[str, str]) -> str:
    """Return the text with the first occurrence of each old piece replaced; each old piece must exist."""
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def linked(keys: str, **points: str) -> str:
    """Return tables of links through points with one-letter names, all with the same keys."""
    return "".join(f"[links.{link}]\npoints = {[*names]}\n{keys}\n" for link, names in points.items())


# Steel arm in steady rotation.
ARM = """
title = "A turning arm"
[materials.steel]
E = 210e9
density = 7850
[sections.bar]
shape = "rectangle"
depth = 0.006
width = 0.01
[points]
O = [0, 0]
A = [0.2, 0]
[links.ground]
points = ["O"]
[links.arm]
points = ["O", "A"]
section = "bar"
material = "steel"
[[drives]]
link = "arm"
speed = 50.0
[run]
positions = 8
"""

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

# The crank yields at a lower speed than that at which the rocker reaches its limit.
CRANK_ROCKER = """
materials.steel = {E = 210e9, poisson = 0.3, density = 7850.0, yield = 235e6}
sections.bar = {shape = "rectangle", depth = 0.02, width = 0.01}
[points]
O = [0.0, 0.0]
A = [0.0, 0.06]
B = [0.16, 0.12]
C = [0.2, 0.0]
[links]
ground = {points = ["O", "C"]}
crank = {points = ["O", "A"], length = 0.06, section = "bar", material = "steel"}
coupler = {points = ["A", "B"], length = 0.18, section = "bar", material = "steel"}
rocker = {points = ["C", "B"], length = 0.12, section = "bar", material = "steel", masses = {B = 15.0}}
[[drives]]
link = "crank"
speed = "200 rpm"
[run]
positions = 360
gravity = [0.0, -9.81]
[limits]
deflection = 0.2e-3
"""

# The cranks are parallel; the positions at 0 and 180 degrees are flat and singular.
PARALLELOGRAM = edited(
    FOUR_BAR,
    ("A = [0.1, 0.0]", "A = [0.06, 0.08]"),
    ("B = [0.28, 0.24]", "B = [0.36, 0.08]"),
    ("D = [0.35, 0.0]", "D = [0.3, 0.0]"),
    ('speed = "100 rad/s"', "start = 0.0\nspeed = 10.0"),
    ("gravity = [0.0, -9.81]", ""),
)

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


YOKE = """
[points]
O = [0, 0]
A = [0.1, 0]
Y = [0.3, 0]
Z = [0.3, 0.2]

[links.ground]
points = ["O"]

[links.crank]
points = ["O", "A"]
rigid = true
mass = 1
center = "O"

[links.yoke]
points = {Y = [0, 0], Z = [0, 0.2]}
rigid = true
mass = 2
center = "Y"

[sliders.guide]
link = "yoke"
through = "Y"
direction = [1, 0]

[slots.slot]
point = "A"
link = "crank"
on = "yoke"
direction = [0, 1]

[[drives]]
link = "crank"
speed = 10

[run]
positions = 24
"""
WHEEL = """
[points]
O = [0, 0]
D = [0.3, 0]
R = [0.1, -0.05]

[links.ground]
points = ["O", "D"]

[links.wheel]
points = {O = [0, 0], P = [0.1, 0]}
rigid = true
mass = 3
center = "O"
inertia = 0.5

[[drives]]
link = "wheel"
start = 0
speed = 2

[run]
positions = 5
duration = 4
"""


MESH = """
[links.other]
points = {D = [0, 0], Q = [0.1, 0]}
rigid = true
mass = 1
center = "D"
inertia = 0.25

[links.rack]
points = ["R"]
mass = 4

[sliders.bed]
link = "rack"
through = "R"
direction = [1, 0]

[[gears]]
driver = {link = "wheel"}
follower = {link = "other"}
ratio = -0.5

[[gears]]
driver = {link = "wheel"}
follower = {slider = "bed"}
ratio = "50 mm/rad"
"""

SWING = (
    edited(
        SLIDER_CRANK,
        ("density = 7850", "density = 7850\npoisson = 0.3\nexpansion = 12e-6"),
        ('shape = "circle"\ndiameter = "8 mm"', 'shape = "tube"\nouter = ["8 mm", "6 mm"]\ninner = 0.002'),
        ("B = [0.4, 0.0]", "B = [0.4, 0.0]\nD = [0.5, 0.2]"),
        ('["O"]', '["O", "D"]'),
        ('["A", "B"]\nsection = "bar"\nmaterial = "steel"',
         '["A", "B"]\nbeams = [{from = "A", to = "B", section = "bar", material = "steel", strain = 0}]'),
        ('rigid = true\nmass = "100 g"\ncenter = "O"',
         'section = "bar"\nmaterial = "steel"\ntemperature = "20 K"\nstrain = 1e-4'),
        ("speed = 100", "motion = [[0, 1], [0.1, 1.2], [0.2, 1.3], [0.3, 1]]\nrepeat = true"),
        ("positions = 36", 'positions = 5\nbeams = "timoshenko"'),
    )
    + """
[joints.A]
compliance = 1e-6
gap = [0, 1e-4]

[joints.guide]
rotation = 1e-3
turn = "0.1 deg"

[[loads]]
link = "block"
point = "B"
force = [3, 0]
table = [["-100 mm", 0], ["0.1 m", 1]]
against = {slider = "guide"}
extend = "hold"

[[springs]]
link = "block"
point = "B"
anchor = "D"
stiffness = 100
length = 0.1

[[springs]]
link = "rod"
on = "crank"
at = "A"
stiffness = 1
damping = 0.1
"""
)  # fmt: skip

# An arm that falls from rest by its weight: an integration of some steps.
FALLING = """
points = {O = [0, 0], A = [1, 0]}
links.ground.points = ["O"]
links.arm = {points = ["O", "A"], rigid = true, mass = 1, center = "A"}
drives = [{link = "arm", effort = 0}]
[run]
duration = 2
positions = 21
gravity = [0, -9.81]
"""

# A pushed block; nothing bends.
PUSHED = """
points = {O = [0, -0.1], A = [0, 0]}
links.ground.points = ["O"]
links.block = {points = ["A"], rigid = true, mass = 2.0}
sliders.guide = {link = "block", through = "A", direction = [1, 0]}
[[drives]]
slider = "guide"
law = [{curve = "cycloidal", by = 0.03, duration = 0.1}]
[run]
positions = 5
"""

# Scotch yoke with a slot over two beams, on both sides of the stem.
TEE = """
points = {O = [0, 0], A = [0.06, 0.08], U = [0.06, 0.12], M = [0.06, 0], L = [0.06, -0.12], S = [0.3, 0]}
sections.bar = {shape = "rectangle", depth = 0.008, width = 0.01}
links.ground.points = ["O"]
links.crank = {points = ["O", "A"], section = "bar", material = "steel"}
slots.slot = {point = "A", link = "crank", on = "yoke", direction = [0, 1]}
sliders.guide = {link = "yoke", through = "S", direction = [1, 0]}
drives = [{link = "crank", speed = 20}]
run.positions = 16
[links.yoke]
points = ["M", "U", "L", "S"]
beams = [["M", "U"], ["M", "L"], ["M", "S"]]
section = "bar"
material = "steel"
[materials.steel]
E = 210e9
density = 7850
"""


LAW = """repeat = true
law = [
    {curve = "cycloidal", duration = 0.12, by = 1.0}, {curve = "dwell", duration = 0.06},
    {curve = "cycloidal", duration = 0.12, by = -1.0}, {curve = "dwell", duration = 0.06},
]"""
RISE_AND_RETURN = edited(
    ARM,
    ("density = 7850", "density = 7850\npoisson = 0.3"),
    ("width = 0.01", "width = 0.02"),
    ("A = [0.2, 0]", "A = [0.5, 0]"),
    ("speed = 50.0", LAW),
    ("positions = 8", "positions = 120\ndamping_ratio = 0.04"),
)

# A strut between a slow rigid crank and a ram, which a force presses.
STRUT = """
[materials.steel]
E = "210 GPa"
density = 7850
[sections.rod]
shape = "circle"
diameter = "12 mm"
[points]
O = [0.0, 0.0]
A = [0.02, 0.0]
B = [0.82, 0.0]
[links]
ground.points = ["O"]
crank = {points = ["O", "A"], rigid = true, mass = "1 kg", center = "O"}
strut = {points = ["A", "B"], section = "rod", material = "steel"}
ram = {points = ["B"], mass = "2 kg"}
[sliders]
guide = {link = "ram", through = "B", direction = "0 deg"}
[[drives]]
link = "crank"
speed = "10 rpm"
[[loads]]
link = "ram"
point = "B"
force = ["-2 kN", 0.0]
"""
