"""Claim: links displaced by any amount are those of the exact equations of beams.

Closed forms of the elastica, and `fem_check.nonlinear`, which shares neither motion, nor loads, nor theory.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from mechanisms import ALL, steel_four_bar

from elastic import Section, displacement_of, extremes, reference_deflection, sample, with_rotary_inertia
from elastic.elastodynamics import elastodynamic, geometrically_exact, theory_error
from elastic.elastodynamics.exact_steps import exact_deflection, settled_links
from fem_check.nonlinear import nonlinear_steady_state
from rigid import (
    Beam,
    Gear,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Spring,
    TorsionSpring,
    drive_efforts,
    motion,
)


def loaded_cantilever(force, sections):
    """A cantilever of length 1 that holds a force across its end, without vibrating."""
    arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1e-6),))
    load = PointLoad("arm", "A", force)
    held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1}, loads=(load,))

    def motion_at(t):
        return motion(held, 0 * np.asarray(t), 0.0, 0.0, t)

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
    start, period = case.drive[0, 0], 2 * math.pi / speed

    def motion_at(t):
        return motion(case.mechanism, start + speed * np.asarray(t), speed, 0.0, t)

    times = np.arange(count) * period / count
    linear = elastodynamic(motion_at(times), motion_at, period, case.sections, damping=beta)
    return linear, geometrically_exact(linear)


CASES = [
    (ALL["RPP"], 60.0, 2e-4, 96, 1e-3),
    (ALL["RPR"], 15.0, 2e-4, 96, 1e-3),
    pytest.param(steel_four_bar, 100.0, 42e-6, 144, 1.5e-3, marks=pytest.mark.slow),
    pytest.param(steel_four_bar, 130.0, 42e-6, 192, 3e-3, marks=pytest.mark.slow),
    pytest.param(ALL["RRR"], 30.0, 2e-4, 128, 1e-3, marks=pytest.mark.slow),
    pytest.param(ALL["RPR, sliding rod"], 30.0, 2e-4, 96, 2e-3, marks=pytest.mark.slow),
    pytest.param(ALL["six-bar"], 15.0, 2e-4, 128, 2e-3, marks=pytest.mark.slow),
    pytest.param(ALL["triad"], 20.0, 2e-4, 128, 3e-3, marks=pytest.mark.slow),
]
"""Mechanism, speed [rad/s], beta [s], positions, and difference as a share of the field's maximum: the check's own."""


@pytest.mark.parametrize(("make", "speed", "beta", "count", "limit"), CASES)
def test_all_fields_of_the_whole_nonlinear_mechanism(make, speed, beta, count, limit):
    case = make()
    start, period = case.drive[0, 0], 2 * math.pi / speed

    def law(t):
        return start + speed * np.asarray(t), np.full(np.shape(t), speed), np.zeros(np.shape(t))

    whole = nonlinear_steady_state(
        case.mechanism, case.sections, [law], period, positions=count, elements=8, damping=beta
    )
    linear, found = vibrating(case, speed, count, beta)
    assert found.reduction_error < 1e-4
    assert theory_error(found).large_displacement < 1e-3

    def off(bent, field):
        reference = getattr(whole, field)
        largest = np.nanmax(np.abs(reference), axis=(1, 2))
        differences = np.abs(sample(bent, field, whole.xi) - reference).max(axis=(1, 2))
        return (differences / np.maximum(largest, 0.01 * largest.max())).max()

    for field in ("chord", "w", "phi", "u", "M"):
        assert off(found.deflection, field) < limit
    for field in ("N", "V"):  # of the check's at its nodes less is known
        assert off(found.deflection, field) < 4 * limit
    assert off(linear.deflection, "chord") > 3 * off(found.deflection, "chord")
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - whole.efforts).max() < limit * np.abs(whole.efforts).max()


def test_the_residual_that_steps_in_time_smooth_is_told():
    """Steps that feel no inertia of it settle all the same, as far off as they say."""
    linear, true = vibrating(ALL["RPP"](), 60.0, 48, 2e-4)
    poor = settled_links(linear.vibration, 1e-6, 1e-9)
    grid, plain = linear.vibration.problem.terms.grid, linear.quasi_static
    found = exact_deflection(poor.displaced, plain, grid.sampler(plain.motion.time))
    here, there = (sample(bent, "chord", np.linspace(0.0, 1.0, 21)) for bent in (found, true.deflection))
    off = np.abs(here - there).max(axis=(1, 2)) / reference_deflection(np.abs(there).max(axis=(1, 2)))
    assert 1e-5 < off.max() < 2 * poor.worst


def test_extremes_are_those_of_the_fields():
    """Where section forces are no integrals of one another, each field tells its own extremes."""
    _, found = vibrating(ALL["RPR"](), 15.0, 24, 2e-4)
    xi = np.linspace(0.0, 1.0, 2001)
    for field, peak in extremes(found.deflection, ["N", "V", "M", "u", "w", "phi", "chord"]).items():
        values = np.abs(sample(found.deflection, field, xi)).max(axis=-1)
        np.testing.assert_allclose(np.abs(peak.value), values, rtol=1e-5, atol=1e-12 * values.max())


def test_a_slider_on_a_link_that_bends_is_refused():
    with pytest.raises(MechanismError, match="on a link that bends is not known to large displacement"):
        vibrating(ALL["RPR, elastic lever"](), 5.0, 12, 2e-4)


def test_gears_about_axes_in_the_ground():
    """Two soft arms under their weight, geared 1 to -2: against the whole nonlinear mechanism."""
    bars = [
        Link(name, {o: 0, p: 0.2}, (Beam(o, p, 0.12),)) for name, o, p in (("first", "O", "A"), ("second", "D", "B"))
    ]
    ends = PinDrive("first", "O"), PinDrive("second", "D")
    links = (Link("ground", {"O": 0, "D": 0.3}), *bars)
    drawing = {"O": 0, "D": 0.3, "A": 0.2, "B": 0.5}
    mechanism = Mechanism(links, ends[:1], drawing, gravity=-9.81j, gears=(Gear(*ends, -2.0),))
    sections, speed, count = [Section(EA=3e6, EI=0.6)] * 2, 8.0, 48
    period = 2 * math.pi / speed

    def motion_at(t):
        return motion(mechanism, speed * np.asarray(t), speed, 0.0, t)

    def law(t):
        return speed * t, np.full_like(t, speed), 0 * t

    whole = nonlinear_steady_state(mechanism, sections, [law], period, positions=4 * count, elements=8, damping=2e-4)
    linear = elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, sections, damping=2e-4)
    found = geometrically_exact(linear)
    for field, limit in (("M", 1e-4), ("N", 1e-4), ("chord", 3e-4)):
        reference = getattr(whole, field)[:, ::4]
        off = [
            np.abs(sample(bent, field, whole.xi) - reference).max() for bent in (found.deflection, linear.deflection)
        ]
        assert off[0] < min(limit * np.abs(reference).max(), off[1])
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - whole.efforts[:, ::4]).max() < 1e-4 * np.abs(whole.efforts).max()


def test_a_gear_on_a_moving_carrier_is_refused():
    links = (Link("ground", {"O": 0}), *(Link(*given, (Beam(*given[1], 1.0),)) for given in (
        ("carrier", {"O": 0, "P": 0.2}), ("planet", {"P": 0, "Q": 0.1}))))  # fmt: skip
    gear = Gear(PinDrive("carrier", "O"), PinDrive("planet", "P", "carrier"), -2.0, None)
    mechanism = Mechanism(links, (PinDrive("carrier", "O"),), {"O": 0, "P": 0.2, "Q": 0.3}, gears=(gear,))

    def motion_at(t):
        return motion(mechanism, np.asarray(t), 1.0, 0.0, t)

    linear = elastodynamic(motion_at(np.arange(6.0)), motion_at, 2 * math.pi, [Section(EA=1e6, EI=10.0)] * 2)
    with pytest.raises(MechanismError, match='the gear at "P" is on a moving carrier'):
        geometrically_exact(linear)


def test_springs_lumps_beside_their_points_and_loads_that_turn():
    """On an arm, and on a rigid lever that hangs on it by its pin, against the whole nonlinear mechanism."""
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

    whole = nonlinear_steady_state(mechanism, sections, laws, period, positions=count, elements=12, damping=1e-3)
    linear = elastodynamic(motion_at(np.arange(count) * period / count), motion_at, period, sections, damping=1e-3)
    found = geometrically_exact(linear)
    assert found.reduction_error < 1e-4
    for field in ("u", "w", "phi", "M"):
        reference = getattr(whole, field)
        off = [np.abs(sample(bent.deflection, field, whole.xi) - reference).max() for bent in (found, linear)]
        assert off[0] < 3e-3 * np.abs(reference).max() < off[1]
    efforts = drive_efforts(found.deflection.motion, found.deflection.forces)
    assert np.abs(efforts - whole.efforts).max() < 1e-3 * np.abs(whole.efforts).max()
