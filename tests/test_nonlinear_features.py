"""The nonlinear check accepts or rejects each feature as documented in docs/validity.md."""

from pathlib import Path

import pytest
from tiers import in_tiers

from kinelast.answers.checks import NotMade, nonlinear_check
from kinelast.runs import computed
from kinelast.scene.document import read_scene, scene_from_text
from kinelast.tasks.request import Request

MECHANISMS = Path(__file__).parents[1] / "kinelast" / "mechanisms"
BASE = """
materials.steel = {E = "210 GPa", density = "7850 kg/m^3", poisson = 0.3}
sections.bar = {shape = "rectangle", depth = DEPTH, width = "10 mm"}
points = {O = [0.0, 0.0], A = [0.1, 0.0], B = [0.28, 0.24], D = [0.35, 0.0], G = [-0.3, 0.0], H = [-0.3, 0.1]}
links.ground = {points = ["O", "D", "G"]}
links.crank = {points = ["O", "A"], section = "bar", material = "steel"}
links.coupler = {points = ["A", "B"], section = "bar", material = "steel"}
links.rocker = {points = ["D", "B"], section = "bar", material = "steel"}
[run]
positions = 24
duration = "0.314159265 s"
"""
TURNING = '[[drives]]\nlink = "crank"\nspeed = "20 rad/s"\n'
WHEEL = '[links.wheel]\npoints = ["G", "H"]\nsection = "bar"\nmaterial = "steel"\n'
FEATURES = {
    "taper": (TURNING, ""),
    "compliance of a pin": (TURNING + "[joints.A]\ncompliance = 1e-8\n", ""),
    "misfit of a pin (`gap`)": (TURNING + "[joints.A]\ngap = [1e-5, 0.0]\n", ""),
    "spring between points": (
        TURNING + '[[springs]]\nlink = "rocker"\npoint = "B"\nanchor = "O"\nstiffness = 100.0\n',
        "",
    ),
    "torsion spring": (TURNING + '[[springs]]\nlink = "rocker"\nat = "D"\nstiffness = 1.0\n', ""),
    "dashpot": (TURNING + '[[springs]]\nlink = "rocker"\npoint = "B"\nanchor = "O"\ndamping = 5.0\n', ""),
    "load by a table of time": (
        TURNING + '[[loads]]\nlink = "rocker"\npoint = "B"\nforce = [5.0, 0.0]\ntable = [[0, 0], [0.2, 1], [0.4, 0]]\n',
        "",
    ),
    "load that resists": (
        TURNING + '[[loads]]\nlink = "rocker"\npoint = "B"\nforce = [5.0, 0.0]\nresists = "both ways"\n',
        "",
    ),
    "gear": (TURNING + WHEEL + '[[gears]]\ndriver = {link = "crank"}\nfollower = {link = "wheel"}\nratio = -1\n', ""),
    "two drives": (TURNING + WHEEL + '[[drives]]\nlink = "wheel"\nspeed = "40 rad/s"\n', ""),
    "law from rest": (
        '[[drives]]\nlink = "crank"\nlaw = [{curve = "cycloidal", duration = 0.2, by = 1.0},'
        ' {curve = "dwell", duration = 0.2}]\n',
        "",
    ),
    "viscous friction": (TURNING + "[joints.B]\nviscosity = 0.02\n", ""),
    "Coulomb friction": (
        TURNING + "[joints.B]\nfriction = 0.1\nradius = 0.005\n",
        'Coulomb friction at "B": the nonlinear check does not support it',
    ),
    "drive by effort": ('[[drives]]\nlink = "crank"\neffort = 0.5\nspeed = "20 rad/s"\n', "drives that follow laws"),
}
SHIPPED = {
    "slider on the ground": ("offset_slider_crank", ""),
    "slider along an elastic link": ("quick_return", "moves along the elastic link"),
}


def results_of(feature):
    if feature in SHIPPED:
        scene = read_scene(MECHANISMS / f"{SHIPPED[feature][0]}.toml")
    else:
        depth = '["6 mm", "4 mm"]' if feature == "taper" else '"6 mm"'
        scene = scene_from_text(BASE.replace("DEPTH", depth) + FEATURES[feature][0])
    return computed(scene, Request(positions=24))


@pytest.mark.parametrize("feature", in_tiers([*FEATURES, *SHIPPED], 0, 5))
def test_a_feature_is_checked_or_rejected_in_a_sentence(feature):
    refusal, check = {**FEATURES, **SHIPPED}[feature][1], nonlinear_check(results_of(feature))
    if refusal:
        assert isinstance(check, NotMade)
        assert refusal in check.problem
    else:
        assert not isinstance(check, NotMade), check.problem
        assert check.passed is not False, (check.largest, check.estimate)


def test_the_documentation_lists_the_features():
    page = (Path(__file__).parents[1] / "docs" / "validity.md").read_text(encoding="utf-8")
    listed = [
        page.partition(f"nonlinear` {verb}: ")[2].partition(".\n")[0].split("; ") for verb in ("accepts", "refuses")
    ]
    cases = {**FEATURES, **SHIPPED}
    assert listed == [[name for name, (_, refusal) in cases.items() if bool(refusal) == no] for no in (False, True)]


JOINTS = {"pin": '[joints.A]\ncompliance = "2e-6 m/N"\n', "driven pin": '[joints.O]\nrotation = "1e-4 rad/(N m)"\n'}


@pytest.mark.parametrize("joint", in_tiers(sorted(JOINTS), 2, 0))
def test_compliant_joints_are_damped_like_beams(joint):
    """With a damping ratio of 0.2, undamped joints differ by several per cent."""
    text = f"""
[materials.steel]
E = "210 GPa"
density = 7850
[sections.bar]
shape = "rectangle"
depth = "8 mm"
width = "20 mm"
[points]
O = [0, 0]
A = [0.05, 0]
B = [0.25, 0]
[links.ground]
points = ["O"]
[links.crank]
points = ["O", "A"]
section = "bar"
material = "steel"
[links.rod]
points = ["A", "B"]
section = "bar"
material = "steel"
[links.piston]
points = ["B"]
mass = 2
[sliders.guide]
link = "piston"
through = "B"
direction = [1, 0]
{JOINTS[joint]}
[[drives]]
link = "crank"
speed = "100 rad/s"
[run]
positions = 90
damping_ratio = 0.2
"""
    check = nonlinear_check(computed(scene_from_text(text), Request(theory="geometrically-exact")))
    assert check.largest < 0.004
