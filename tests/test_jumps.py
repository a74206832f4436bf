"""The report names loads, friction and accelerations that jump, with position and size from closed forms."""

import re
from pathlib import Path

import numpy as np
import pytest
from scene_texts import FOUR_BAR
from tiers import in_tiers

import kinelast
from elastic import displacement_of
from kinelast.reports.jumps import HEADING, jump_findings
from kinelast.reports.limits import acceptance
from kinelast.reports.trust import findings
from kinelast.runs import computed
from kinelast.scene.data import scene_deflection
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request
from rigid import position_of

PRESS = Path(__file__).parents[1] / "docs" / "gallery" / "toggle_press.toml"
MASS, GRAVITY, FRICTION = 3.0, 10.0, 0.4
SCENE = """
materials.steel = {{E = "210 GPa", density = 1.0, damping = 1e-4}}
sections.bar = {{shape = "rectangle", depth = "5 mm", width = "5 mm"}}
points = {{O = [0, 0], A = [0.1, 0], B = [0.4, 0]}}
links.ground.points = ["O"]
links.crank = {{points = ["O", "A"], section = "bar", material = "steel"}}
links.rod = {{points = ["A", "B"], rigid = true, mass = 0}}
links.block = {{points = ["B"], mass = {mass}}}
sliders.guide = {{link = "block", through = "B", direction = [1, 0]}}
{more}
[run]
theory = "{theory}"
gravity = [0, {gravity}]
"""
TURNING = 'drives = [{link = "crank", speed = "60 rpm"}]\n'
RUBBING = f"{TURNING}joints.guide.friction = {FRICTION}"
LOAD = """[[loads]]
link = "block"
point = "B"
force = [-90, 0]
table = %s
against = {link = "crank"}
extend = "hold"
"""
LOADED = TURNING + LOAD
PULSES = """drives = [{link = "crank", repeat = true, law = [
    {curve = "constant-acceleration", duration = "0.2 s", by = "180 deg"},
    {curve = "constant-acceleration", duration = "0.2 s", by = "180 deg"}]}]"""
STEP, RAMP = "[[0, 0], [1, 0], [1, 1], [2, 0]]", "[[0, 0], [1, 1], [2, 0]]"


def jumps(more, theory="elastodynamic", mass=MASS, gravity=-GRAVITY):
    """Return the finding on jumps, or an empty text."""
    scene = scene_from_text(SCENE.format(more=more, theory=theory, mass=mass, gravity=gravity))
    return "".join(each.text for each in findings(computed(scene, Request())) if each.heading == HEADING)


def numbers(text):
    """Return the size of the jump and the drive angles [deg] that a finding names."""
    size, unit, places = re.search(r"jumps by (?:up to )?([\d.]+) (k?)\S+ \(crank at (.*?)\)", text).groups()
    return float(size) * (1e3 if unit else 1.0), [float(each) for each in re.findall(r"([\d.]+)°", places)]


def test_a_load_with_a_step_jumps_at_the_step_and_one_with_a_ramp_does_not():
    size, angles = numbers(jumps(LOADED % STEP))
    assert size == 90.0
    assert angles == [pytest.approx(np.degrees(1.0), rel=1e-3)]
    assert not jumps(LOADED % RAMP)
    assert not jumps(LOADED % STEP, theory="quasi-static")


def test_coulomb_friction_jumps_at_both_dead_centres():
    """There the massless rod is on the line of the slider, and the block presses on the guide with its weight."""
    text = jumps(RUBBING)
    size, angles = numbers(text)
    assert text.startswith("Friction in guide jumps")
    assert size == pytest.approx(2 * FRICTION * MASS * GRAVITY, rel=1e-3)
    assert sorted(angles) == pytest.approx([0.0, 180.0], abs=1e-3)


def test_an_acceleration_jumps_between_constant_values():
    """A rise h in the time T has the acceleration 4 h / T^2 and then its opposite. Dead centres transmit no jump."""
    text = jumps(PULSES)
    size, angles = numbers(text)
    assert text.startswith("The acceleration of the drive crank jumps")
    assert size == pytest.approx(8 * np.pi / 0.2**2, rel=5e-3)
    assert sorted(angles) == pytest.approx([90.0, 270.0], abs=1e-3)


def test_a_small_friction_is_not_named():
    assert not jumps(RUBBING.replace(str(FRICTION), "0.004") + "\n" + LOAD % RAMP)


@pytest.mark.slow
def test_the_press_of_the_gallery_has_no_load_that_jumps():
    text = PRESS.read_text(encoding="utf-8").replace("[run]", '[run]\ntheory = "elastodynamic"')
    assert HEADING not in [each.heading for each in findings(computed(scene_from_text(text), Request()))]


@pytest.mark.slow
def test_a_load_that_resists_jumps_where_the_motion_reverses():
    """The force of a blade of the wiper reverses with the rotation of its arm."""
    scene = kinelast.load(PRESS.with_name("wiper.toml"))
    results = computed(scene, Request())
    (text,) = (each.text for each in findings(results) if each.heading == HEADING)
    force = abs(complex(scene.mechanism.loads[0].load.force))
    assert numbers(text)[0] == pytest.approx(2 * force, rel=5e-3)
    motion = scene.course.at(np.linspace(0.0, scene.run.duration, 20001))
    rate = motion.angular_velocity[scene.mechanism.index["left_arm"]]
    reversals = np.degrees(motion.drive[0, :-1][np.diff(np.sign(rate)) != 0]) % 360.0
    assert sorted(numbers(text)[1]) == pytest.approx(sorted(reversals), abs=0.1)


ARM = """
materials.steel = {{E = "210 GPa", density = 7850.0, damping = 1e-4}}
sections.bar = {{shape = "rectangle", depth = "5 mm", width = "5 mm"}}
points = {{O = [0, 0], A = [0.3, 0]}}
links.ground.points = ["O"]
links.arm = {{points = ["O", "A"], section = "bar", material = "steel"}}
loads = [{{link = "arm", point = "A", force = [0, 3], axes = "turning", resists = "{resists}"}}]
{drive}
"""
SWINGING = """drives = [{link = "arm", repeat = true, law = [
    {curve = "harmonic", duration = "0.5 s", by = "90 deg"},
    {curve = "harmonic", duration = "0.5 s", by = "-90 deg"}]}]
[run]
theory = "elastodynamic"
"""
PUSHED = """drives = [{link = "arm", effort = "2 N m"}]
[run]
theory = "quasi-static"
duration = "0.2 s"
"""
PANTOGRAPH = (
    PRESS.with_name("pantograph.toml").read_text(encoding="utf-8").replace("[run]", '[run]\ntheory = "elastodynamic"')
)


@pytest.mark.parametrize(
    ("text", "link", "point", "reversal"),
    in_tiers(
        [
            (ARM.format(drive=SWINGING, resists="both ways"), "arm", "A", 0.5),
            (ARM.format(drive=SWINGING, resists="one way"), "arm", "A", 0.5),
            (ARM.format(drive=SWINGING, resists="both ways"), "arm", "A", 0.0),
            (PANTOGRAPH, "right", "Q", 0.75),  # on a circle, the speed along the force is zero at 3/8 and 7/8 of a turn
            (PANTOGRAPH, "right", "Q", 1.75),
        ],
        1,
        3,
    ),
    ids=["arm", "arm, one way", "arm, at the start", "pantograph", "pantograph, later"],
)
def test_a_position_at_a_reversal_has_the_answer_of_the_side_after_it(text, link, point, reversal):
    """A displacement with vibration is continuous, and the forces of joints are those just after the reversal."""
    scene = scene_from_text(text)
    results = computed(scene, Request(positions=40))
    at = int(np.abs(results.motion.time - reversal).argmin())
    assert results.motion.time[at] == pytest.approx(reversal, abs=1e-12)
    aside = 1e-7 * scene.run.duration
    times = np.mod(reversal + np.array([-aside, aside]), scene.run.duration)
    order = np.argsort(times)
    near = results.answer.at(scene_deflection(scene, scene.course.at(times[order])))
    before, after = displacement_of(near, link, point)[np.argsort(order)]
    shown = displacement_of(results.deflection, link, point)[at]
    assert abs(before - after) < 0.01 * abs(after)
    assert abs(shown - after) < 0.01 * abs(after)
    forces = np.array(results.deflection.forces.force)[:, at], np.array(near.forces.force)[:, np.argsort(order)[1]]
    assert np.abs(forces[0] - forces[1]).max() < 0.02 * np.abs(forces[1]).max()


def test_a_load_that_resists_a_swinging_arm_jumps_at_its_ends():
    """A force of 3 N reverses with the rotation at 0 and 90 degrees."""
    results = computed(scene_from_text(ARM.format(drive=SWINGING, resists="both ways")), Request(positions=40))
    (text,) = (each.text for each in findings(results) if each.heading == HEADING)
    size, angle = re.search(r"jumps by (?:up to )?([\d.]+) N .*arm at (.*?)\)", text).groups()
    assert float(size) == pytest.approx(6.0, rel=5e-3)
    assert sorted(float(each) for each in re.findall(r"([\d.]+)°", angle)) == pytest.approx([0.0, 90.0], abs=0.1)


@pytest.mark.parametrize("resists", ["both ways", "one way"])
def test_an_arm_starts_with_the_acceleration_under_its_resistance(resists):
    """The moment at the shaft minus the moment of the force accelerates a uniform bar, J = m l^2 / 3."""
    motion = computed(scene_from_text(ARM.format(drive=PUSHED, resists=resists)), Request()).motion
    length = 0.3
    mass = 7850.0 * 0.005**2 * length
    resistance = 3.0 * length if resists == "both ways" else 0.0  # one way, the force only resists clockwise rotation
    wanted = (2.0 - resistance) / (mass * length**2 / 3)
    assert motion.angular_velocity[1, 0] == 0.0
    assert motion.angular_acceleration[1] == pytest.approx(np.full(motion.columns, wanted), rel=1e-3)


LIFT = """
points = {P = [0, 0], G = [1, 0]}
links.ground.points = ["G"]
links.cart = {points = ["P"], mass = 20}
sliders.x = {link = "cart", through = "P", direction = [0, 1]}
[[drives]]
slider = "x"
repeat = true
law = [{curve = "trapezoidal-velocity", duration = 0.3, by = 0.3}, {curve = "dwell", duration = 0.2},
       {curve = "cycloidal", duration = 0.4, by = -0.3}, {curve = "dwell", duration = 0.1}]
[run]
positions = 720
gravity = [0, -9.81]
[limits.figures]
drive_effort = 500
"""


@pytest.mark.parametrize("positions", [720, 1001])
def test_a_largest_force_beside_a_jump_is_exact(positions):
    """m (g + a) with a = 0.3 m / (0.1 s * 0.2 s) until 0.1 s; no parabola spans a jump."""
    results = computed(scene_from_text(LIFT.replace("720", str(positions))), Request())
    (effort,) = results.figures.peaks["drive_effort"]
    assert effort.value == pytest.approx(20 * (9.81 + 15), rel=1e-12)
    assert effort.error.size < 1e-4 * effort.value
    assert acceptance(results).verdict == "acceptable"


@pytest.mark.parametrize(("link", "turns"), [("coupler", True), ("rocker", False)])
def test_a_torsion_spring_at_a_pin_that_turns_fully(link, turns):
    """The coupler of a crank-rocker turns fully relative to the crank; the rocker swings relative to the coupler."""
    at, on = ("A", "crank") if turns else ("B", "coupler")
    spring = f'[[springs]]\nlink = "{link}"\nat = "{at}"\non = "{on}"\nstiffness = 5\n'
    results = computed(scene_from_text(FOUR_BAR + spring), Request(theory="quasi-static"))
    found = [each.text for each in jump_findings(results)]
    assert bool(found) == turns
    assert all("its moment jumps by 31.4 N·m" in each for each in found)


RETURN_SPRING = """
[points]
O = [0, 0]
A = [0.05, 0]
B = [0.2, 0.15]
D = [0.25, 0]
[links.ground]
points = ["O", "D"]
[links.crank]
points = ["O", "A"]
rigid = true
mass = 0
[links.coupler]
points = ["A", "B"]
rigid = true
mass = 0
[links.rocker]
points = ["D", "B"]
rigid = true
mass = 0
[[springs]]
link = "rocker"
at = "D"
stiffness = 20
angle = "{angle} deg"
[[drives]]
link = "crank"
speed = "30 rpm"
[run]
positions = 36
"""


@pytest.mark.parametrize("angle", in_tiers([-150, -60, 90, -600], 2, 2))
def test_the_effort_against_a_wound_torsion_spring(angle):
    """Virtual work: the rocker swings from 104 to 141 degrees, and a return spring may be wound by several turns."""
    results = computed(scene_from_text(RETURN_SPRING.format(angle=angle)), Request())
    motion = results.motion
    rocker = motion.mechanism.index["rocker"]
    place = position_of(motion, rocker, "B") - 0.25
    moment = 20 * (np.angle(place) - np.radians(angle))
    expected = moment * motion.angular_velocity[rocker] / np.pi  # 30 rpm
    np.testing.assert_allclose(results.cycle.efforts[0], expected, atol=1e-9 * np.abs(expected).max())
    most = np.abs(np.degrees(moment / 20)).max()
    said = [each.text for each in jump_findings(results)]
    assert any(f"is wound by up to {most:.0f}°" in each for each in said) == (most > 180)
