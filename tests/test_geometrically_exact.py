"""Links with large displacements obey the exact equations of beams.

References are closed forms of the elastica, and `fem_check.nonlinear` with its own kinematics, loads and beam theory.
"""

import math

import numpy as np
import pytest
from mechanisms import ALL, at_speed, steel_four_bar
from nonlinear import nonlinear_steady_state
from scipy.optimize import root

from elastic import (
    JointCompliance,
    Section,
    displacement_of,
    extremes,
    reference_deflection,
    rotation_of,
    sample,
    with_rotary_inertia,
)
from elastic.elastodynamics import elastodynamic, finer_vibration, geometrically_exact, large_displacement_error
from elastic.elastodynamics.displaced_links import exact_loads
from elastic.elastodynamics.displaced_points import require_supported
from elastic.elastodynamics.exact_residual import CoordinateForces, residual_state, transferred
from elastic.elastodynamics.exact_steps import exact_deflection, solve_exact
from elastic.elastodynamics.geometrically_exact import with_large_displacement
from rigid import (
    Beam,
    ConstantSpeed,
    Gear,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    Spring,
    TorsionSpring,
    drive_efforts,
    motion,
)


def loaded_cantilever(force, sections):
    """Return the static answer of a cantilever of length 1 with a transverse force at its end."""
    arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1e-6),))
    load = PointLoad("arm", "A", force)
    held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1}, loads=(load,))

    motion_at = at_speed(held, 0.0)
    linear = elastodynamic(motion_at(np.array([0.0, 0.5])), motion_at, 1.0, sections)
    return geometrically_exact(linear, 1e-8).deflection


@pytest.mark.parametrize(
    ("force", "across", "along"),
    [(1, 0.30172, 0.05643), (2, 0.49346, 0.16064), (5, 0.71379, 0.38763), (10, 0.81061, 0.55500)],
)
def test_the_elastica(force, across, along):
    """Mattiasson, Numerical results from large deflection beam and frame problems, IJNME 17 (1981), table I."""
    tip = displacement_of(loaded_cantilever(1j * force, [Section(EA=1e9, EI=1.0)]), "arm", "A")
    np.testing.assert_allclose(tip, -along + 1j * across, rtol=0, atol=6e-6)


@pytest.mark.parametrize(
    ("kGA", "along", "across"),
    [(500.0, -0.061315658, 0.317813874), (50.0, -0.103284917, 0.465413303), (10.0, -0.252136606, 1.167095878)],
)
def test_the_sheared_elastica(kGA, along, across):
    """Batista, A closed-form solution for Reissner planar finite-strain beam, IJSS 87 (2016), EI = load = 10."""
    tip = displacement_of(loaded_cantilever(10j, [Section(EA=1e8, EI=10.0, kGA=kGA)]), "arm", "A")
    np.testing.assert_allclose(tip, along + 1j * across, rtol=2e-5)


def vibrating(case, speed, count, beta):
    period, motion_at = 2 * math.pi / speed, at_speed(case.mechanism, speed, case.drive[0, 0])
    times = np.arange(count) * period / count
    linear = elastodynamic(motion_at(times), motion_at, period, case.sections, damping=beta)
    return linear, geometrically_exact(linear)


CASES = [
    (ALL["RPP"], 60.0, 2e-4, 96, 1e-3),
    (ALL["RPR"], 15.0, 2e-4, 96, 1e-3),
    pytest.param(steel_four_bar, 100.0, 42e-6, 144, 1.5e-3, marks=pytest.mark.slow),
    pytest.param(steel_four_bar, 130.0, 42e-6, 192, 3e-3, marks=pytest.mark.exhaustive),
    pytest.param(ALL["RRR"], 30.0, 2e-4, 128, 1e-3, marks=pytest.mark.slow),
    pytest.param(ALL["RPR, sliding rod"], 30.0, 2e-4, 96, 2e-3, marks=pytest.mark.exhaustive),
    pytest.param(ALL["six-bar"], 15.0, 2e-4, 128, 2e-3, marks=pytest.mark.exhaustive),
    pytest.param(ALL["triad"], 20.0, 2e-4, 128, 3e-3, marks=pytest.mark.exhaustive),
]
"""Mechanism, speed [rad/s], beta [s], positions, and difference as a share of the field's maximum: the check's own."""


@pytest.mark.parametrize(("make", "speed", "beta", "count", "limit"), CASES)
def test_all_fields_agree_with_the_nonlinear_mechanism(make, speed, beta, count, limit):
    case = make()
    period, law = 2 * math.pi / speed, ConstantSpeed(case.drive[0, 0], speed)
    nonlinear = nonlinear_steady_state(
        case.mechanism, case.sections, [law], period, positions=count, elements=8, damping=beta
    )
    linear, found = vibrating(case, speed, count, beta)
    assert found.reduction_error < 1e-4
    assert large_displacement_error(found) < 1e-3

    def off(bent, field):
        reference = getattr(nonlinear, field)
        largest = np.nanmax(np.abs(reference), axis=(1, 2))
        differences = np.abs(sample(bent, field, nonlinear.xi) - reference).max(axis=(1, 2))
        return (differences / np.maximum(largest, 0.01 * largest.max())).max()

    for field in ("chord", "w", "phi", "u", "M"):
        assert off(found.deflection, field) < limit
    for field in ("N", "V"):  # the check's forces at its nodes are less accurate
        assert off(found.deflection, field) < 4 * limit
    assert off(linear.deflection, "chord") > 3 * off(found.deflection, "chord")
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - nonlinear.efforts).max() < limit * np.abs(nonlinear.efforts).max()


@pytest.mark.parametrize("beta", [5e-3, 2e-2])
def test_section_forces_of_strongly_damped_links_are_in_equilibrium(beta):
    """Strains give the forces that the loads require, although damping delays them."""
    _, found = vibrating(steel_four_bar(), 60.0, 72, beta)
    now = found.exact.displaced
    assert residual_state(now, exact_loads(now)).force_residual < 1e-3


@pytest.mark.slow
def test_damping_acts_on_the_strains_of_rotated_sections():
    """The displacement of a crank's end is the integral of the strains that damped section forces cause."""
    lengths, speed, beta, count = (0.058, 0.165, 0.249, 0.238), 346.0, 2.5e-4, 120
    crank, coupler, rocker, base = lengths
    drawing = {"O": 0.0, "D": base, "A": crank}
    apart = base - crank
    x = (coupler**2 - rocker**2 + apart**2) / (2 * apart)
    drawing["B"] = crank + x + 1j * math.sqrt(coupler**2 - x**2)
    sections = [Section(EA, EI, kGA) for EA, EI, kGA in ((1.9e7, 100.0, 6e6), (4e7, 2400.0, 1e7), (1.5e8, 2.2e4, 4e7))]
    names = (("crank", "O", "A", crank, 0.73), ("coupler", "A", "B", coupler, 1.5), ("rocker", "D", "B", rocker, 6.0))
    links = [Link(name, {a: 0.0, b: length}, (Beam(a, b, mass),)) for name, a, b, length, mass in names]
    mechanism = Mechanism((Link("ground", {"O": 0, "D": base}), *links), (PinDrive("crank", "O"),), drawing)
    motion_at, period = at_speed(mechanism, speed), 2 * math.pi / speed
    linear = elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, sections, damping=beta)
    bent = geometrically_exact(linear).deflection
    nodes, weights = np.polynomial.legendre.leggauss(20)
    N, V, phi = (sample(bent, name, (nodes + 1) / 2)[0] for name in ("N", "V", "phi"))
    slowed = 1 + 1j * beta * 2 * math.pi * np.fft.fftfreq(count, period / count)
    strains = np.fft.fft(N / sections[0].EA - 1j * V / sections[0].kGA, axis=0) / slowed[:, None]
    moved = crank * (np.exp(1j * phi) * (1 + np.fft.ifft(strains, axis=0)) - 1) @ weights / 2
    u, w = (sample(bent, name, [1.0])[0, :, 0] for name in ("u", "w"))
    assert np.abs(phi).max() > 0.1
    assert np.abs(moved.real - u).max() < 1.5e-3 * np.abs(u).max()
    assert np.abs(moved.imag - w).max() < 1e-3 * np.abs(w).max()


def test_an_answer_carried_to_a_finer_discretization_keeps_no_error_of_the_coarse_one():
    """Rates are derivatives of the amplitudes, and the finer coordinates take over all that they can represent."""
    case, speed = steel_four_bar(), 130.0
    period, motion_at = 2 * math.pi / speed, at_speed(case.mechanism, speed, case.drive[0, 0])
    times = np.arange(48) * period / 48
    linear = elastodynamic(motion_at(times), motion_at, period, case.sections, damping=42e-6, tolerance=1e-2)
    coarse = geometrically_exact(linear, 1e-2)
    wider, finer = coarse.discretization.wider(), finer_vibration(coarse)
    carried = transferred(coarse.exact.displaced, finer, wider.per_coordinate_of(coarse.discretization))
    grid, (x, x1, _) = finer.problem.terms.grid, carried.history
    np.testing.assert_allclose(grid.rates(grid.with_start(x))[0][8:], x1[8:], rtol=0, atol=1e-4 * np.abs(x1).max())
    strained, coordinates = carried.residual.forces, CoordinateForces(finer)
    left = coordinates.static(coordinates.load(strained))
    assert np.abs(left).max() < 1e-9 * np.abs(x).max()


def test_the_error_includes_a_residual_that_time_steps_smooth():
    """Time steps without the residual's inertia still converge; the stated error covers the difference."""
    linear, true = vibrating(ALL["RPP"](), 60.0, 48, 2e-4)
    poor = solve_exact(linear.vibration, 1e-6, 1e-9)
    grid, plain = linear.vibration.problem.terms.grid, linear.quasi_static
    found = exact_deflection(poor.displaced, plain, grid.sampler(plain.motion.time))
    here, there = (sample(bent, "chord", np.linspace(0.0, 1.0, 21)) for bent in (found, true.deflection))
    off = np.abs(here - there).max(axis=(1, 2)) / reference_deflection(np.abs(there).max(axis=(1, 2)))
    assert 1e-5 < off.max() < 2 * poor.worst


def test_round_off_of_a_bar_that_only_stretches_is_no_error():
    """A turning bar does not bend, so deflections from its chord are round-off."""
    bar = Link("bar", {"O": 0, "A": 0.06}, (Beam("O", "A", 1.6),))
    mechanism = Mechanism((Link("ground", {"O": 0}), bar), (PinDrive("bar", "O"),), {"O": 0, "A": 0.06})
    motion_at = at_speed(mechanism, 21.0)
    linear = elastodynamic(motion_at(np.arange(12) / 40), motion_at, 2 * math.pi / 21.0, [Section(4.2e7, 1400.0)])
    _, left = with_large_displacement(linear)
    assert left < 1e-6


def test_extremes_equal_those_of_the_fields():
    """Section forces are not integrals of each other here, so each field has its own extremes."""
    _, found = vibrating(ALL["RPR"](), 15.0, 24, 2e-4)
    xi = np.linspace(0.0, 1.0, 2001)
    for field, peak in extremes(found.deflection, ["N", "V", "M", "u", "w", "phi", "chord"]).items():
        values = np.abs(sample(found.deflection, field, xi)).max(axis=-1)
        np.testing.assert_allclose(np.abs(peak.value), values, rtol=1e-5, atol=1e-12 * values.max())


SOFT = Section(EA=1e4, EI=1.0, kGA=1e3)


def held_exactly(mechanism, sections, joints=None):
    """Return the deflection of a mechanism at rest with large displacements."""
    motion_at = at_speed(mechanism, 0.0)
    linear = elastodynamic(motion_at(np.array([0.0, 0.5])), motion_at, 1.0, sections, joints=joints)
    return linear.deflection, geometrically_exact(linear, 1e-9).deflection


def shot(section, length, force, moment, give=0.0, steps=60):
    """Integrate Reissner's beam by fourth-order Runge-Kutta; return position, rotation and moment at its end.

    `force` acts at the end. The start has the `moment` and rotates by `give` times the moment.
    """

    def rate(y):
        turn = np.exp(1j * y[1])
        section_force = np.conj(turn) * force
        stretched = turn * (1 + section_force.real / section.EA + 1j * section_force.imag / section.kGA)
        return np.array([stretched, y[2] / section.EI, -(np.conj(stretched) * force).imag])

    y, h = np.array([0j, give * moment, moment]), length / steps
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3))
    return complex(y[0]), float(y[1].real), float(y[2].real)


@pytest.mark.parametrize(("load", "beside"), [(-0.7j, 0.0), (-0.4j, 0.7)])
def test_a_block_on_a_bent_link(load, beside):
    """A block on a vertical guide presses down on an arm with a soft drive, and a force rotates the block.

    The contact force is normal to the bent axis, except for the moment times the curvature.
    """
    at, lever, give = 0.6, 0.1j, 0.2
    arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1e-6),))
    links = Link("ground", {"O": 0}), arm, Link("shoe", {"P": 0, "Q": lever}), Link("carriage", {"P": 0})
    sliders = (
        Slider("slot", "shoe", "arm", "P", origin=0, direction=1.0),
        Slider("guide", "carriage", "ground", "P", origin=at, direction=1j),
    )
    loads = PointLoad("carriage", "P", load), PointLoad("shoe", "Q", beside)
    drawing = {"O": 0, "A": 1.0, "P": at, "Q": at + lever}
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), drawing, sliders, loads=loads)
    linear, found = held_exactly(mechanism, [SOFT], {"O": JointCompliance(rotation=give)})
    down = (load + beside).imag

    def residual(unknown):
        length, along, moment = unknown
        force = along + 1j * down
        place, turn, held = shot(SOFT, length, force, moment, give)
        axes = np.exp(1j * turn)
        turning = (np.conj(lever * axes) * beside).imag
        section_force = np.conj(axes) * force / 2  # the mean of both sides of the block, like the curvature
        tangent = axes * (1 + section_force.real / SOFT.EA + 1j * section_force.imag / SOFT.kGA)
        pushed = (np.conj(tangent) * force).real + turning * turning / (2 * SOFT.EI)
        return [place.real - at, held - turning, pushed]

    length, along, moment = root(residual, [at, 0.0, at * down], tol=1e-11).x
    place, turn, _ = shot(SOFT, length, along + 1j * down, moment, give)
    scale = abs(displacement_of(linear, "shoe", "P")[0] - 1j * place.imag)
    assert abs(displacement_of(found, "shoe", "P")[0] - 1j * place.imag) < min(2e-4 * abs(place.imag), 0.02 * scale)
    assert found.phi.sum(0)[0, 0] == pytest.approx(turn, rel=2e-4)
    assert sample(found, "M", [0.0])[0, 0, 0] == pytest.approx(moment, rel=2e-4)
    assert found.blocks[0].xi[0] == pytest.approx(length, abs=2e-5)


@pytest.mark.parametrize(("pressure_angle", "hub"), [(0.0, 0.0), (0.35, 0.1 - 0.05j)])
def test_a_planet_on_a_bent_carrier(pressure_angle, hub):
    """A planet rolls around a fixed sun; a force beside the pin and the teeth bend the carrier by half a radian.

    The tooth force acts across the deformed line of centres, and the planet rotates relative to that line.
    """
    beside, load, ratio, slope = 0.15 + 0.05j, -1j, -2.0, math.tan(pressure_angle)
    arm = Link("arm", {"O": 0, "P": 1.0}, (Beam("O", "P", 1e-6),))
    links = Link("ground", {"O": 0}), arm, Link("planet", {"P": hub, "Q": hub + beside})
    gear = Gear(PinDrive("ground", "O", "arm"), PinDrive("planet", "P", "arm"), ratio, pressure_angle)
    drawing = {"O": 0, "P": 1.0, "Q": 1.0 + beside}
    loads = (PointLoad("planet", "Q", load),)
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), drawing, loads=loads, gears=(gear,))
    _, found = held_exactly(mechanism, [SOFT])

    def turned(centre):
        return (1 - ratio) * (np.angle(centre) - slope * np.log(abs(centre)))

    def residual(unknown):
        force = complex(*unknown[:2])
        centre, _, held = shot(SOFT, 1.0, force, unknown[2])
        moment = -(np.conj(beside * np.exp(1j * turned(centre))) * load).imag
        teeth = (1 - ratio) * moment * (slope - 1j) / np.conj(centre)
        return [(force - load - teeth).real, (force - load - teeth).imag, held]

    along, across, moment = root(residual, [0.0, -1.4, -1.4], tol=1e-11).x
    centre, _, _ = shot(SOFT, 1.0, along + 1j * across, moment)
    assert displacement_of(found, "arm", "P")[0] == pytest.approx(centre - 1.0, abs=1e-6)
    assert rotation_of(found, "planet", "P")[0] == pytest.approx(turned(centre), abs=1e-6)
    assert sample(found, "M", [0.0])[0, 0, 0] == pytest.approx(moment, rel=1e-6)


@pytest.mark.slow
def test_gears_on_the_ground():
    """Flexible arms under their own weight, geared at a ratio of -2, agree with the nonlinear mechanism."""
    bars = [
        Link(name, {o: 0, p: 0.2}, (Beam(o, p, 0.12),)) for name, o, p in (("first", "O", "A"), ("second", "D", "B"))
    ]
    ends = PinDrive("first", "O"), PinDrive("second", "D")
    links = (Link("ground", {"O": 0, "D": 0.3}), *bars)
    drawing = {"O": 0, "D": 0.3, "A": 0.2, "B": 0.5}
    mechanism = Mechanism(links, ends[:1], drawing, gravity=-9.81j, gears=(Gear(*ends, -2.0),))
    sections, speed, count = [Section(EA=3e6, EI=0.6)] * 2, 8.0, 48
    period, motion_at, law = 2 * math.pi / speed, at_speed(mechanism, speed), ConstantSpeed(0.0, speed)
    nonlinear = nonlinear_steady_state(
        mechanism, sections, [law], period, positions=4 * count, elements=8, damping=2e-4
    )
    linear = elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, sections, damping=2e-4)
    found = geometrically_exact(linear)
    for field, limit in (("M", 1e-4), ("N", 1e-4), ("chord", 3e-4)):
        reference = getattr(nonlinear, field)[:, ::4]
        off = [
            np.abs(sample(bent, field, nonlinear.xi) - reference).max()
            for bent in (found.deflection, linear.deflection)
        ]
        assert off[0] < min(limit * np.abs(reference).max(), off[1])
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - nonlinear.efforts[:, ::4]).max() < 1e-4 * np.abs(nonlinear.efforts).max()


def test_a_wheel_on_a_rack_is_an_error():
    links = Link("ground", {"O": 0}), Link("cart", {"P": 0}), Link("wheel", {"P": 0, "Q": 0.05})
    guide = Slider("guide", "cart", "ground", "P", origin=0.0, direction=1.0)
    turns = PinDrive("wheel", "P", "cart")
    drawing = {"O": 0, "P": 0.2, "Q": 0.25}
    gears = (Gear(turns, SliderDrive("guide"), 0.05),)
    mechanism = Mechanism(links, (turns,), drawing, (guide,), gears=gears)
    with pytest.raises(MechanismError, match='the axis of the wheel at "P" on a rack moves'):
        require_supported(motion(mechanism, np.zeros((1, 2))))


def test_springs_eccentric_lumps_and_turning_loads():
    """They act on an arm and on a rigid lever pinned to it; the reference is the nonlinear mechanism."""
    arm = Link("arm", {"O": 0, "A": 0.5}, (Beam("O", "A", 0.5),), (Lump("A", 0.05, 2e-4, 0.03 + 0.02j),))
    lever = Link("lever", {"A": 0, "B": 0.2 - 0.1j}, (), (Lump("B", 0.1, 1e-4, 0.02j), Lump("A", 0.02)))
    ground = Link("ground", {"O": 0, "S": 0.3 + 0.8j})
    loads = (
        Spring("arm", "A", anchor="S", stiffness=20.0, length=0.5, damping=0.4),
        Spring("lever", "B", anchor="S", stiffness=10.0, length=0.3, damping=0.2),
        TorsionSpring("lever", "A", on="arm", stiffness=3.0, damping=0.05),
        PointLoad("arm", "A", 2j, turning=True),
        PointLoad("lever", "B", 3 - 1j, turning=True),
        LineLoad("arm", 0, 3j, -2j, turning=True),
    )
    drawing = {"O": 0, "A": 0.5, "B": 0.7 - 0.1j}
    drives = (PinDrive("arm", "O"), PinDrive("lever", "A", on="arm"))
    mechanism = Mechanism((ground, arm, lever), drives, drawing, loads=loads, gravity=-9.81j)
    sections, speed, count = (Section(EA=1e6, EI=40.0, kGA=2e5, area=1e-4, inertia=4e-9),), 8.0, 64
    mechanism = with_rotary_inertia(mechanism, sections)
    period = 2 * math.pi / speed
    laws = [lambda t: (speed * t, np.full_like(t, speed), 0 * t), lambda t: (0.4 * np.sin(speed * t), 0 * t, 0 * t)]

    def motion_at(t):
        t = np.asarray(t, float)
        swing = 0.4 * np.array([np.sin(speed * t), speed * np.cos(speed * t), -(speed**2) * np.sin(speed * t)])
        return motion(
            mechanism, *(np.array(pair) for pair in zip((speed * t, speed + 0 * t, 0 * t), swing, strict=True)), t
        )

    nonlinear = nonlinear_steady_state(mechanism, sections, laws, period, positions=count, elements=12, damping=1e-3)
    linear = elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, sections, damping=1e-3)
    found = geometrically_exact(linear)
    assert found.reduction_error < 1e-4
    for field in ("u", "w", "phi", "M"):
        reference = getattr(nonlinear, field)
        off = [np.abs(sample(bent.deflection, field, nonlinear.xi) - reference).max() for bent in (found, linear)]
        assert off[0] < 3e-3 * np.abs(reference).max() < off[1]
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - nonlinear.efforts).max() < 1e-3 * np.abs(nonlinear.efforts).max()
