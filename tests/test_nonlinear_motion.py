"""Motion, forces and energy of the nonlinear check obey mechanics, and frequencies agree with publications."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mechanisms import steel_four_bar
from nonlinear import PeriodicCollocation, nonlinear_equilibrium, nonlinear_steady_state, nonlinear_transient
from scipy.integrate import solve_ivp
from scipy.linalg import eigvals
from tiers import in_tiers

from elastic import RIGID, Section, deflection, sample, with_rotary_inertia
from fem_check.nonlinear import DoesNotCloseError, refined_deflection
from fem_check.nonlinear.collocation import Collocation
from fem_check.nonlinear.equilibrium import start_of
from fem_check.nonlinear.loads import RigidLinkMotion
from fem_check.nonlinear.rigid_places import RigidPlaces
from fem_check.nonlinear.stepping import periods, slowest_vibration
from fem_check.nonlinear.system import system_of
from rigid import (
    Beam,
    ConstantSpeed,
    Gear,
    Link,
    Lump,
    Mechanism,
    PinDrive,
    PointLoad,
    Segment,
    SegmentedLaw,
    Slider,
    SliderDrive,
    Spring,
    TorsionSpring,
    motion,
)
from rigid.dynamics import law_of_time

GROUND = Link("ground", {"O": 0})
DATA = json.loads((Path(__file__).parent / "data" / "steel_four_bar_vibrating.json").read_text())


DRIVEN = (PinDrive("arm", "O"),)


def arm(*, drives=DRIVEN, mass=2.0, lumps=(), loads=(), gravity=0.0):
    link = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", mass),), lumps)
    return Mechanism((GROUND, link), drives, {"O": 0, "A": 1.0}, gravity=gravity, loads=loads)


@pytest.mark.parametrize(
    "name", ["origin", "direction", "velocity", "angular_velocity", "acceleration", "angular_acceleration", "turning"]
)
def test_loads_get_the_motion_of_the_rigid_links(name):
    mechanism = steel_four_bar().mechanism
    law = SegmentedLaw(0.0, (Segment("cycloidal", 0.2, 1.0), Segment("dwell", 0.1, 0.0)))
    time = np.array([0.03, 0.1, 0.16, 0.26])
    known = motion(mechanism, *(np.array([part]) for part in law(time)), time)
    expected = getattr(known, name)
    found = getattr(RigidLinkMotion(time, RigidPlaces(mechanism, (law,), 0.0)), name)
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def steel_four_bar_of_known_area():
    section = Section(210e9 * 6e-5, 37.8, area=6e-5, inertia=1.8e-10)
    return with_rotary_inertia(steel_four_bar().mechanism, [section] * 3), [section] * 3


def steady_four_bar(speed, elements, positions, beta=40e-6):
    mechanism, sections = steel_four_bar_of_known_area()
    law = ConstantSpeed(0.0, speed)
    period = 2 * math.pi / speed
    return nonlinear_steady_state(mechanism, sections, [law], period, positions, elements, damping=beta)


# Rigid links


def test_a_falling_bar():
    """theta'' = -3 g cos(theta)/2l by an independent integrator; also energy and pin force."""
    times = np.linspace(0.0, 1.0, 6)
    found = nonlinear_transient(arm(drives=(), gravity=-10j), [RIGID], [], times, 2e-3)
    exact = solve_ivp(lambda t, y: [y[1], -15 * np.cos(y[0])], (0, 1), [0, 0], t_eval=times, rtol=1e-11, atol=1e-12)
    angle, speed = exact.y
    assert found.phi[0, :, 0] == pytest.approx(angle, abs=2e-5)
    assert found.kinetic == pytest.approx(-10 * np.sin(angle), abs=1e-3)
    centre = 0.5 * np.exp(1j * angle) * (-15j * np.cos(angle) - speed**2)
    assert found.joints[0].force == pytest.approx(2.0 * (centre + 10j), abs=1e-2)


def test_a_bead_on_a_turning_arm():
    """Coriolis: the drives have moment m (r^2 theta'' + 2 r r' theta') and force m (r'' - r theta'^2)."""
    links = (GROUND, Link("arm", {"O": 0, "A": 1.0}), Link("bead", {"P": 0}, (), (Lump("P", 3.0),)))
    drives = PinDrive("arm", "O"), SliderDrive("way")
    slider = Slider("way", "bead", "arm", "P", 0.0, 1.0)
    mechanism = Mechanism(links, drives, {"O": 0, "A": 1.0, "P": 0.5}, (slider,))
    laws = [lambda t: (0.3 + 2 * t + 0.2 * np.sin(2 * t),), lambda t: (0.5 + 0.1 * np.sin(2 * t),)]
    found = nonlinear_steady_state(mechanism, [], laws, math.pi, 32)
    t = found.time
    r, rate, rise = 0.5 + 0.1 * np.sin(2 * t), 0.2 * np.cos(2 * t), -0.4 * np.sin(2 * t)
    speed, growth = 2 + 0.4 * np.cos(2 * t), -0.8 * np.sin(2 * t)
    assert found.efforts[0] == pytest.approx(3 * (r**2 * growth + 2 * r * rate * speed), abs=1e-6)
    assert found.efforts[1] == pytest.approx(3 * (rise - r * speed**2), abs=1e-6)
    force = next(joint for joint in found.joints if joint.name == "way").force
    across = 1j * np.exp(1j * laws[0](t)[0])
    assert np.conj(across) * force == pytest.approx(3 * (r * growth + 2 * rate * speed), abs=1e-6)


def test_a_rigid_slider_crank():
    """The triangle gives the piston's position; the crank's moment is the power of inertia and damper."""
    links = (
        GROUND,
        Link("crank", {"O": 0, "A": 0.1}, (), (Lump("A", 0.4, 0.01, -0.05),)),
        Link("rod", {"A": 0, "B": 0.3}),
        Link("piston", {"B": 0}, (), (Lump("B", 2.0),)),
    )
    slider = Slider("guide", "piston", "ground", "B", 0.02j, 1.0)
    damper = Spring("piston", "B", anchor="O", damping=7.0)
    drawing = {"O": 0, "A": 0.1, "B": 0.4 + 0.02j}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), loads=(damper,))
    speed = 20.0
    found = nonlinear_steady_state(mechanism, [], [ConstantSpeed(0.0, speed)], 2 * math.pi / speed, 64)
    theta = speed * found.time
    root = np.sqrt(0.3**2 - (0.02 - 0.1 * np.sin(theta)) ** 2)
    x = 0.1 * np.cos(theta) + root
    lever = -0.1 * np.sin(theta) + (0.02 - 0.1 * np.sin(theta)) * 0.1 * np.cos(theta) / root
    order = np.fft.fftfreq(64, 1 / 64)
    acceleration = np.fft.ifft(1j * order * np.fft.fft(lever)).real * speed**2
    reach = np.hypot(x, 0.02)
    power = (2.0 * acceleration + 7.0 * (x / reach) ** 2 * lever * speed) * lever * speed
    assert found.efforts[0] * speed == pytest.approx(power, abs=1e-6 * np.abs(power).max())
    assert found.dissipated == pytest.approx(7.0 * (x * lever * speed / reach) ** 2, abs=1e-9)


def test_geared_arms():
    """The drive has the inertia J1 + n^2 J2, for any motion."""
    links = (
        Link("ground", {"O": 0, "D": 2.0}),
        Link("first", {"O": 0, "A": 1.0}, (), (Lump("A", 1.0),)),
        Link("second", {"D": 0, "B": 0.5}, (), (Lump("B", 2.0, 0.3),)),
    )
    gear = Gear(PinDrive("first", "O"), PinDrive("second", "D"), -3.0)
    drawing = {"O": 0, "A": 1.0, "D": 2.0, "B": 2.5}
    mechanism = Mechanism(links, (PinDrive("first", "O"),), drawing, gears=(gear,))
    found = nonlinear_steady_state(mechanism, [], [lambda t: (t + 0.1 * np.sin(t),)], 2 * math.pi, 16)
    assert found.efforts[0] == pytest.approx((1.0 + 9 * 0.8) * -0.1 * np.sin(found.time), abs=1e-9)


@pytest.mark.parametrize("damping", in_tiers([0.0, 1.5], 1, 1))
def test_springs_oscillate(damping):
    """A block between spring and damper, and a wheel on a torsion spring, oscillate like e^(-dt) cos after release."""
    links = (Link("ground", {"O": 0, "W": 5.0}), Link("block", {"P": 0}, (), (Lump("P", 2.0),)),
             Link("wheel", {"W": 0}, (), (Lump("W", 1.0, 0.5),)))  # fmt: skip
    springs = (
        Spring("block", "P", anchor="O", stiffness=18.0, length=1.0, damping=damping, preload=3.6),
        TorsionSpring("wheel", "W", stiffness=8.0, angle=0.3, damping=damping, preload=0.8),
    )
    slider = Slider("guide", "block", "ground", "P", 0.0, 1.0)
    mechanism = Mechanism(links, (), {"O": 0, "P": 1.5, "W": 5.0}, (slider,), loads=springs)
    times = np.linspace(0, 0.8, 5)
    found = nonlinear_transient(mechanism, [], [], times, 1e-3, dissipation=0.0)

    def swing(mass, stiffness):
        decay = damping / (2 * mass)
        own = math.sqrt(stiffness / mass - decay**2)
        return np.exp(-decay * times) * (np.cos(own * times) + decay / own * np.sin(own * times))

    block, wheel = 0.7 * swing(2.0, 18.0), -0.2 * swing(0.5, 8.0)
    stored = 18 * (block - 0.2) ** 2 / 2 + 3.6 * (block - 0.2) + 8 * (wheel - 0.1) ** 2 / 2 + 0.8 * (wheel - 0.1)
    assert found.stored == pytest.approx(stored, abs=2e-4)
    if not damping:
        assert found.kinetic + found.stored == pytest.approx(found.stored[0], abs=1e-5)


# Elastic links


def test_slow_motion_agrees_with_linear_theory():
    """At 1 rad/s vibration and large displacements vanish, so the closed form remains."""
    mechanism = steel_four_bar().mechanism  # without rotary inertia of the sections
    sections = [Section(210e9 * 6e-5, 37.8)] * 3
    found = nonlinear_steady_state(mechanism, sections, [ConstantSpeed(0.0, 1.0)], 2 * math.pi, 48)
    linear = deflection(motion(mechanism, 2 * np.pi * np.arange(48) / 48, 1.0), sections)
    for field, near in (("w", 2e-4), ("chord", 2e-4), ("phi", 5e-4), ("N", 2e-5), ("V", 2e-5), ("M", 2e-5)):
        exact = sample(linear, field, found.xi)
        scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
        assert np.abs((getattr(found, field) - exact) / scale).max() < near, field
    assert np.abs(found.u - sample(linear, "u", found.xi)).max() < 1e-3 * np.abs(found.u).max()


def test_a_tapered_mass_pulls_as_its_integral():
    """The force is speed^2 times the integral of m x; four elements resolve the taper."""
    link = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 2.0, (1.0, -0.6)),))
    turning = Mechanism((GROUND, link), (PinDrive("arm", "O"),), {"O": 0, "A": 1.0})
    found = nonlinear_steady_state(turning, [Section(1e8, 1e4)], [ConstantSpeed(0.0, 2.0)], math.pi, 8, 4)
    assert found.N[0, :, 0] == pytest.approx(4 * 2 * (1 / 2 - 0.6 / 3), rel=2e-3)
    assert found.joints[0].force == pytest.approx(-4 * 2 * 0.3 * np.exp(2j * found.time), rel=2e-3)


def require_reference(found, near_u, near_w):
    """Require that u and w agree with an independent corotational code, relative to their maxima."""
    stride, skip = found.w.shape[1] // 24, found.elements // 6
    for name, values, near in (("u_m", found.u, near_u), ("w_m", found.w, near_w)):
        for beam, link in enumerate(("crank", "coupler", "rocker")):
            reference = np.array(DATA["links"][link][name])
            assert np.abs(values[beam, ::stride, ::skip] - reference).max() < near * np.abs(reference).max(), link


@pytest.mark.slow
def test_steel_four_bar_vibrating():
    """60 rad/s, deflection about 1 mm (nearly linear), compared with another code."""
    require_reference(steady_four_bar(60.0, 6, 144), 5e-3, 1e-3)


@pytest.mark.slow
def test_steel_four_bar_vibrating_finely():
    require_reference(steady_four_bar(60.0, 12, 144), 4e-4, 6e-5)


@pytest.mark.slow
def test_drive_work_equals_dissipation():
    """This holds over a steady turn; the energy balance also holds at each instant."""
    found = steady_four_bar(100.0, 4, 128, beta=1e-4)
    power, heat = found.efforts[0] * 100.0, found.dissipated
    assert heat.min() > 0
    assert power.mean() == pytest.approx(heat.mean(), rel=1e-4)
    order = np.fft.fftfreq(128, 1 / 128)
    growth = np.fft.ifft(1j * order * 100 * np.fft.fft(found.kinetic + found.stored)).real
    assert growth == pytest.approx(power - heat, abs=2e-3 * np.abs(power).max())


@pytest.mark.slow
def test_energy_is_conserved_without_damping():
    """A soft bar is released: kinetic, elastic and potential energy balance to second order in the step."""
    mechanism = arm(drives=(), gravity=-10j)
    section = Section(1e5, 10.0, 1e4, area=1e-2, inertia=1e-6)
    mechanism = with_rotary_inertia(mechanism, [section])
    lost = []
    for step in (2e-3, 1e-3):
        found = nonlinear_transient(mechanism, [section], [], [0.0, 0.25, 0.5], step, 4, dissipation=0.0)
        whole = found.kinetic + found.stored + found.potential
        lost.append(np.abs(whole - whole[0]).max())
        fallen = (found.w[0] @ [0.125, 0.25, 0.25, 0.25, 0.125])[-1] * 20.0
        assert found.potential[-1] - found.potential[0] == pytest.approx(fallen, rel=0.02)
    assert found.kinetic[-1] > 3.0
    assert lost[1] < 0.02
    assert lost[0] / lost[1] > 2.0


def test_a_quasi_static_start_stays_steady():
    """A rotating bar with initial stretch u = m w^2 l^3/3EA does not oscillate; a bar without it does."""
    section, law = Section(1e5, 1e3, area=1e-2, inertia=1e-6), ConstantSpeed(0.2, 10.0)
    times = np.linspace(0.0, 0.02, 11)
    ends = {
        begin: nonlinear_transient(arm(), [section], [law], times, 1e-3, 4, begin=begin).u[0, :, -1]
        for begin in ("rigid", "quasi-static")
    }
    assert ends["quasi-static"] == pytest.approx(2 * 100 / 3e5, rel=2e-2)
    assert np.ptp(ends["quasi-static"]) < 3e-3 * 2 * 100 / 3e5
    assert ends["rigid"][0] == pytest.approx(0.0, abs=1e-12)
    assert ends["rigid"].max() > 1.5 * 2 * 100 / 3e5


def started(elements, step, dissipation=0.2):
    """Return a soft arm rotated by a quarter turn in 0.5 s from rest, under an increasing load."""
    load = PointLoad("arm", "A", 3.0j, law=law_of_time(lambda t: t**4))
    law = SegmentedLaw(0.0, (Segment("polynomial-4567", 0.5, math.pi / 2),))
    section = Section(1e4, 20.0, area=1e-2, inertia=1e-5)
    times = [0.0, 0.2, 0.4]
    found = nonlinear_transient(
        arm(loads=(load,)), [section], [law], times, step, elements, None, 1e-3, "rigid", dissipation
    )
    return np.array([found.w[0, -1, -1], found.M[0, -1, 0] / 100, found.efforts[0, -1] / 100])


@pytest.mark.slow
def test_order_of_the_step():
    coarse, middle, fine = (started(4, step) for step in (4e-3, 2e-3, 1e-3))
    assert np.log2(np.abs(coarse - middle) / np.abs(middle - fine)) == pytest.approx(2.0, abs=0.2)


def test_damping_agrees_with_kelvin_and_voigt():
    """A bar under harmonic tension: the phase of u lags by atan(omega beta)."""
    pull = PointLoad("arm", "A", 5.0, law=law_of_time(lambda t: np.sin(2 * np.pi * t)))
    found = nonlinear_steady_state(arm(mass=0.0, loads=(pull,)), [Section(1e3, 10.0)], [lambda t: (0 * t,)], 1.0, 32,
                                   damping=0.05)  # fmt: skip
    lag = 2 * math.pi * 0.05
    wave = 5e-3 / math.hypot(1.0, lag) * np.sin(2 * math.pi * found.time - math.atan(lag))
    assert found.u[0, :, -1] == pytest.approx(wave, abs=1e-8)


@pytest.mark.slow
def test_time_marching_reaches_the_steady_state():
    """Marching over several turns and collocation over one turn agree."""
    mechanism, sections = steel_four_bar_of_known_area()
    speed, beta = 60.0, 2e-4
    period = 2 * math.pi / speed
    times = period * np.array([0.0, 3.0, 3.25, 3.5, 3.75, 4.0])
    moving = nonlinear_transient(mechanism, sections, [ConstantSpeed(0.0, speed)], times, period / 1440, 4, None, beta,
                                 "quasi-static")  # fmt: skip
    steady = steady_four_bar(speed, 4, 128, beta)
    again = [0, 32, 64, 96, 0]
    for field, near in (("w", 1e-3), ("M", 1e-2)):
        values = getattr(steady, field)[:, again]
        assert np.abs(getattr(moving, field)[:, 1:] - values).max() < near * np.abs(values).max()


# Published frequencies


def frequencies(mechanism, sections, speed, elements):
    """Return frequencies of small vibrations about steady rotation, in rotating axes with fixed drives [rad/s]."""
    system = system_of(mechanism, sections, [ConstantSpeed(0.0, speed)], 0.0, elements, None, 0.0)
    solver = PeriodicCollocation(system, 2 * math.pi / (speed or 1.0), 16)
    found = solver.solved()
    given = found.q, found.v, found.a, found.multipliers, solver.drives, solver.factor
    tangents = solver.frames.seen(system.residual(*given)[2])
    K, C, M = tangents.stiffness[0], tangents.damping[0], tangents.mass[0]
    none, unit = np.zeros_like(K), np.eye(len(K))
    values = eigvals(np.block([[none, unit], [-K, -C]]), np.block([[unit, none], [none, M]]))
    return np.sort(values.imag[np.isfinite(values) & (values.imag > 1e-3)])


@pytest.mark.parametrize(("speed", "published"), [(0.0, 3.5160), (2.0, 3.6195), (4.0, 3.888)])
def test_rotating_cantilever(speed, published):
    """Hamza-Cherif and Houmat, 24th ICAS Congress 2004, table 2: chordwise, slenderness 70, all else 1.

    They neglect the stretch by rotation, 1.6e-5 speed^2 here: 0.1 % of the frequency at 4.
    """
    turning = arm(mass=1.0)
    found = frequencies(turning, [Section(70.0**2, 1.0)], speed, 12)
    assert found[0] == pytest.approx(published, rel=1.2e-3)


def test_frequencies_converge_with_fourth_order():
    """Frequencies of a cantilever: squared roots of cos x cosh x = -1."""
    exact = np.array([1.8751040687, 4.6940911330, 7.8547574382]) ** 2
    section = Section(1e9, 1.0)
    missed = [np.abs(frequencies(arm(mass=1.0), [section], 0.0, elements)[:3] - exact) for elements in (16, 32)]
    assert np.log2(missed[0] / missed[1]).min() > 3.7
    assert (missed[0] / exact).max() < 5e-5


def test_frame_of_two_beams():
    """Wallrapp and Schwertassek, table 5.5: two beams at a right angle, at rest; the printed modes allow 0.2 %."""
    first, second = 9e-3, 9.5e-3
    link = Link("frame", {"O": 0, "A": 2.0, "B": 2.0 + 0.4j},
                (Beam("O", "A", 3000 * first**2), Beam("A", "B", 7895 * first * second)))  # fmt: skip
    mechanism = Mechanism((GROUND, link), (PinDrive("frame", "O"),), {"O": 0, "A": 2.0, "B": 2.0 + 0.4j})
    sections = [
        Section(E * A, E * inertia, 5 / 6 * E / 2.6 * A, area=A, inertia=inertia)
        for E, A, inertia in ((70e9, first**2, first**4 / 12), (210e9, first * second, second * first**3 / 12))
    ]
    found = frequencies(with_rotary_inertia(mechanism, sections), sections, 0.0, 12) / (2 * math.pi)
    assert found[:3] == pytest.approx([0.9614, 7.037, 16.67], rel=2.2e-3)


# Errors


def test_invalid_periods_and_options_are_errors():
    mechanism, sections = steel_four_bar_of_known_area()
    with pytest.raises(DoesNotCloseError, match="so this is not a period"):
        nonlinear_steady_state(mechanism, sections, [ConstantSpeed(0.0, 1.0)], 1.0, 16)
    with pytest.raises(ValueError, match="4 positions"):
        nonlinear_steady_state(mechanism, sections, [ConstantSpeed(0.0, 1.0)], 2 * math.pi, 4)
    with pytest.raises(ValueError, match="growing"):
        nonlinear_transient(mechanism, sections, [ConstantSpeed(0.0, 1.0)], [0.0, 0.0], 0.1)
    with pytest.raises(ValueError, match="dissipation 2"):
        nonlinear_transient(mechanism, sections, [ConstantSpeed(0.0, 1.0)], [0.0, 1.0], 0.1, dissipation=2.0)
    short = Mechanism(
        (*mechanism.links[:3], Link("rocker", {"D": 0, "B": 0.12}, (Beam("D", "B", 1.0),))),
        mechanism.drives, {"O": 0, "A": 0.1, "B": 0.36 + 0.12j, "D": 0.35},
    )  # fmt: skip
    with pytest.raises(DoesNotCloseError, match=r"do not close at \d"):
        nonlinear_equilibrium(short, sections, [ConstantSpeed(0.0, 1.0)], [0.0, 3.0])


def test_progress_is_reported():
    reports = []
    mechanism, sections = steel_four_bar_of_known_area()
    times, law = np.arange(8) * math.pi / 36, [ConstantSpeed(0.0, 9.0)]
    refined_deflection(mechanism, sections, law, times, 2 * math.pi / 9, True, 0.1,
                       progress=lambda share, words: reports.append((share, words)))  # fmt: skip
    assert all(0 < share <= 1 for share, _ in reports)
    assert any("Newton" in words for _, words in reports)


# To a tolerance


def refined_four_bar(speed, tolerance, closed=True, **more):
    mechanism, sections = steel_four_bar_of_known_area()
    turn = 2 * math.pi / speed
    times = np.arange(64) * turn / 64
    given = mechanism, sections, [ConstantSpeed(0.0, speed)], times, turn, closed, tolerance
    return refined_deflection(*given, damping=40e-6, **more)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [30.0, pytest.param(100.0, marks=pytest.mark.slow)])
def test_steps_and_elements_are_refined_to_the_tolerance(speed):
    """The error is relative to the deflection of the worst beam; reference: harmonics in time and 8 elements."""
    found, true = refined_four_bar(speed, 5e-3), steady_four_bar(speed, 8, 64)
    assert found.error <= 5e-3
    count = min(found.elements, 8)
    off = np.abs(found.chord[..., :: found.elements // count] - true.chord[..., :: 8 // count]).max(axis=(1, 2))
    assert (off <= 5e-3 * np.abs(true.chord).max(axis=(1, 2))).all()


@pytest.mark.slow
def test_a_rough_tolerance_uses_fewer_steps():
    """The stated error is not below the true error."""
    rough, fine = refined_four_bar(60.0, 0.1), refined_four_bar(60.0, 2e-3)
    assert rough.steps < fine.steps
    stride = fine.elements // rough.elements
    apart = np.abs(rough.chord - fine.chord[..., ::stride]).max(axis=(1, 2)) / np.abs(fine.chord).max(axis=(1, 2))
    assert apart.max() <= rough.error + fine.error


@pytest.mark.slow
def test_a_single_course_agrees_with_small_steps():
    """The course starts with the quasi-static deflection; the reference is another integrator with 2,000 steps."""
    found = refined_four_bar(60.0, 5e-3, closed=False)
    mechanism, sections = steel_four_bar_of_known_area()
    turn = 2 * math.pi / 60.0
    times = np.arange(0, 64, 8) * turn / 64
    law = [ConstantSpeed(0.0, 60.0)]
    marched = nonlinear_transient(mechanism, sections, law, times, turn / 2000, 8, None, 40e-6, "quasi-static")
    stride = 8 // found.elements
    off = np.abs(found.chord[:, ::8] - marched.chord[..., ::stride]).max(axis=(1, 2))
    assert (off <= 5e-3 * np.abs(marched.chord).max(axis=(1, 2))).all()


def pushed_block():
    """Return a mass on spring and damper with a harmonic force."""
    links = Link("ground", {"O": 0, "W": 1.0}), Link("block", {"P": 0}, (), (Lump("P", 2.0),))
    spring = Spring("block", "P", anchor="O", stiffness=18.0, length=1.0, damping=1.5)
    push = PointLoad("block", "P", force=1.0, law=law_of_time(np.sin))
    slider = Slider("guide", "block", "ground", "P", 0.0, 1.0)
    mechanism = Mechanism(links, (), {"O": 0, "P": 1.0}, (slider,), loads=(spring, push))
    return system_of(mechanism, [], [], 0.0, 1, None, 0.0)


def test_collocation_converges_with_fifth_order():
    """The periodic motion of the block has a closed form at the ends of the steps."""
    system = pushed_block()
    errors = []
    for steps in (8, 16):
        edges = np.linspace(0.0, 2 * np.pi, steps + 1)
        found = Collocation(system, edges, None).solved(tolerance=1e-12)
        exact = 1.0 + (np.exp(1j * edges[1:]) / (18.0 - 2.0 + 1.5j)).imag
        block = system.of_node[np.flatnonzero(system.nodes.link == 1)[0], 0]
        errors.append(np.abs(found.q[:, -1, block] - exact).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(5.0, abs=0.3)


def test_time_marching_converges_to_the_cycle():
    """The block starts at its drawn position; the transient decays by e^(-1.5 pi/2) per period."""
    system, edges = pushed_block(), np.linspace(0.0, 2 * np.pi, 18)
    assert slowest_vibration(system) == pytest.approx(3.0)
    block = system.of_node[np.flatnonzero(system.nodes.link == 1)[0], 0]
    cycle = 1.0 + (np.exp(1j * edges[1:]) / (18.0 - 2.0 + 1.5j)).imag
    begun = start_of(system, 1e-3, "rigid")
    apart = [np.abs(motion.q[:, -1, block] - cycle).max() for motion in periods(system, edges, begun, 1e-10, 6)]
    assert apart[1] / apart[0] == pytest.approx(math.exp(-1.5 * math.pi / 2), rel=0.1)
    assert apart[-1] < 1e-5


@pytest.mark.slow
def test_time_marching_replaces_newtons_method_if_it_fails():
    """A soft arm oscillates in three of its natural periods; Newton's method from the rigid positions diverges."""
    soft, section = arm(mass=1.0), [Section(1e5, 10.0)]
    own = 3.516 * math.sqrt(10.0)
    turn, beta = 6 * math.pi / own, 0.2 / own
    law, times = (lambda t: (0.8 * np.sin(2 * math.pi * np.asarray(t) / turn),)), np.arange(16) * turn / 16
    system = system_of(soft, section, [law], 0.0, 2, None, beta)
    with pytest.raises(DoesNotCloseError):
        Collocation(system, np.linspace(0.0, turn, 17), None).solved()
    found = refined_deflection(soft, section, [law], times, turn, True, 5e-3, damping=beta)
    late = np.concatenate([[0.0], 5 * turn + times])
    marched = nonlinear_transient(soft, section, [law], late, turn / 400, 4, None, beta)
    stride = found.elements // 4
    assert np.abs(found.chord[..., ::stride] - marched.chord[:, 1:]).max() < 6e-3 * np.abs(marched.chord).max()
