"""Large static displacements of beams agree with published closed forms, for any loads and joints."""

import math

import numpy as np
import pytest
from nonlinear import nonlinear_equilibrium
from tiers import in_tiers

from elastic import JointCompliance, Section, Taper, deflection, sample, with_rotary_inertia
from fem_check.nonlinear import DoesNotCloseError, NotCheckedError
from rigid import (
    Beam,
    ConstantSpeed,
    Gear,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    Spring,
    TorsionSpring,
    motion,
    position_of,
)
from rigid.analysis import LinkAngle
from rigid.dynamics import law_of, law_of_time

RAMP = law_of_time(lambda time: time)
GROUND = Link("ground", {"O": 0})


AT_REST = ConstantSpeed(0.0, 0.0)


def cantilever(length, *loads, turn=1.0, taper=(1.0,), mass=0.0, gravity=0.0):
    """Return a beam clamped at its drive; `turn` is the direction of its axes and of the ground."""
    arm = Link("arm", {"O": 0, "A": length * turn}, (Beam("O", "A", mass, taper),))
    drawing = {"O": 0, "A": length * turn}
    return Mechanism((GROUND, arm), (PinDrive("arm", "O"),), drawing, loads=loads, gravity=gravity)


def held(mechanism, section, elements, steps=8, joints=None):
    return nonlinear_equilibrium(mechanism, [section], [AT_REST], np.linspace(0, 1, steps), elements, joints)


BATISTA = {
    math.inf: (-0.056433236, 0.301720774),
    500.0: (-0.061315658, 0.317813874),
    50.0: (-0.103284917, 0.465413303),
    10.0: (-0.252136606, 1.167095878),
    5.0: (-0.376121399, 2.104087473),
}


@pytest.mark.parametrize("kGA", in_tiers(BATISTA, 2, 3))
def test_reissners_beam(kGA):
    """Batista 2016, closed form: length 1, EI 10, EA 1e8, transverse tip load 10."""
    section = Section(1e8, 10.0, kGA)
    tips = []
    for elements in (8, 16):
        found = held(cantilever(1.0, PointLoad("arm", "A", 10j, law=RAMP)), section, elements, steps=16)
        tips.append(np.array([found.u[0, -1, -1], found.w[0, -1, -1]]))
    order = 4 if math.isinf(kGA) else 2
    extrapolated = tips[1] + (tips[1] - tips[0]) / (2**order - 1)
    assert np.abs(extrapolated - BATISTA[kGA]).max() < (1e-7 if math.isinf(kGA) else 1e-6)


def test_ancf_cantilever():
    """The value is that of exudyn's own test with a fine mesh."""
    E, side = 2.07e11, 0.1
    EI = E * side**4 / 12
    load = PointLoad("arm", "A", -3j * EI / 2**2, law=RAMP)
    found = held(cantilever(2.0, load), Section(E * side**2, EI), 16)
    assert found.u[0, -1, -1] == pytest.approx(-0.508537304326, abs=1e-6)
    assert found.w[0, -1, -1] == pytest.approx(-1.207239854550, abs=1e-6)


def rolled_up(elements, turn=1.0):
    moment = PointLoad("arm", "A", moment=2 * math.pi, law=RAMP)
    return held(cantilever(1.0, moment, turn=turn), Section(1e4, 1.0), elements, steps=13)


def test_rolling_up_to_a_circle():
    found = rolled_up(16)
    assert found.u[0, -1, -1] == pytest.approx(-1.0, abs=1e-9)
    assert found.w[0, -1, [-1, 8]] == pytest.approx([0.0, 1 / math.pi], abs=1e-5)
    assert found.phi[0, -1] == pytest.approx(2 * math.pi * found.xi, abs=1e-9)
    assert found.M[0, -1] == pytest.approx(2 * math.pi, abs=1e-9)
    assert found.efforts[0, -1] == pytest.approx(-2 * math.pi, abs=1e-9)


def test_the_direction_of_the_beam_does_not_matter():
    one, other = rolled_up(5), rolled_up(5, np.exp(2j))
    for field in ("u", "w", "phi", "M"):
        assert getattr(one, field) == pytest.approx(getattr(other, field), abs=1e-9)


def test_order_of_the_elements():
    """Order four for slender beams, order two for large shear strains."""
    missed = [abs(rolled_up(elements).w[0, -1, elements // 2] - 1 / math.pi) for elements in (8, 16)]
    assert math.log2(missed[0] / missed[1]) == pytest.approx(4.0, abs=0.2)
    tips = [held(cantilever(1.0, PointLoad("arm", "A", 10j, law=RAMP)), Section(1e8, 10.0, 50.0), n).w[0, -1, -1]
            for n in (8, 16)]  # fmt: skip
    missed = np.abs(np.array(tips) - BATISTA[50.0][1])
    assert math.log2(missed[0] / missed[1]) == pytest.approx(2.0, abs=0.2)


def test_small_loads_on_a_tapered_beam():
    """w is the integral of M (l - x)/EI with polynomial rigidities; the mass has a taper too."""
    taper = Taper(EA=(1.0, -0.5), EI=(1.0, -0.8, 0.1), kGA=(1.0, 0.3))
    section = Section(2e3, 50.0, 300.0, taper=taper)
    mechanism = cantilever(1.5, PointLoad("arm", "A", 1e-4 + 2e-4j), mass=1e-5, taper=(1.0, -0.6), gravity=-10j)
    found = held(mechanism, section, 32, steps=2)
    places, weights = np.polynomial.legendre.leggauss(40)
    xi, dx = (places + 1) / 2, weights * 0.75
    EA, EI, kGA = (np.polynomial.polynomial.polyval(xi, getattr(taper, name)) for name in ("EA", "EI", "kGA"))
    x = 1.5 * xi
    beyond, lever = 1.5 * (0.7 - xi + 0.3 * xi**2), 1.5**2 * (0.3 - 0.7 * xi + 0.5 * xi**2 - 0.1 * xi**3)
    push, moment = 2e-4 - 1e-4 * beyond, 2e-4 * (1.5 - x) - 1e-4 * lever
    w = (dx * moment * (1.5 - x) / (50 * EI)).sum() + (dx * push / (300 * kGA)).sum()
    assert found.w[0, -1, -1] == pytest.approx(w, rel=1e-4)
    assert found.u[0, -1, -1] == pytest.approx((dx * 1e-4 / (2e3 * EA)).sum(), rel=1e-3)
    assert found.M[0, -1, 0] == pytest.approx(2e-4 * 1.5 - 1e-4 * 1.5**2 * 0.3, rel=1e-4)
    assert found.V[0, -1, 0] == pytest.approx(-(2e-4 - 1e-4 * 1.5 * 0.7), rel=1e-4)


def test_free_strain_and_linear_load():
    """u = strain x; a load from q to 0 bends the tip by q l^4/30 EI."""
    line = LineLoad("arm", 0, 3e-4j, 0.0)
    found = held(cantilever(2.0, line), Section(1e6, 5.0, strain=1e-5), 8, steps=2)
    assert found.u[0, -1] == pytest.approx(2e-5 * found.xi, rel=1e-4)
    assert found.w[0, -1, -1] == pytest.approx(3e-4 * 16 / 150, rel=1e-4)
    assert found.M[0, -1, 0] == pytest.approx(3e-4 * 4 / 6, rel=1e-4)
    assert found.V[0, -1, 0] == pytest.approx(-3e-4, rel=1e-4)


@pytest.mark.parametrize("turning", [False, True])
def test_large_loads_are_in_balance(turning):
    """Force and moment at the clamp equal those of the displaced loads, integrated over the deformed line."""
    loads = (
        PointLoad("arm", "A", -1.0 + 2.0j, 0.4, turning, RAMP),
        LineLoad("arm", 0, 1.0 + 1.0j, 3.0 - 1.0j, turning, RAMP),
    )
    found = held(cantilever(1.0, *loads), Section(1e3, 1.5), 32)
    place = found.xi + found.u[0, -1] + 1j * found.w[0, -1]
    turn = np.exp(1j * found.phi[0, -1]) if turning else np.ones(33)
    line = (1 + 1j + found.xi * (2 - 2j)) * turn
    share = np.tile([2.0, 4.0], 17)[:33] / 96
    share[[0, -1]] = 1 / 96
    tip = (-1 + 2j) * turn[-1]
    force = tip + (share * line).sum()
    moment = 0.4 + (np.conj(place[-1]) * tip).imag + (share * (np.conj(place) * line).imag).sum()
    assert abs(found.w[0, -1, -1]) > 0.3
    assert found.N[0, -1, 0] - 1j * found.V[0, -1, 0] == pytest.approx(force, rel=5e-4)
    assert found.M[0, -1, 0] == pytest.approx(moment, rel=5e-4)
    assert found.efforts[0, -1] == pytest.approx(-moment, rel=5e-4)
    assert found.joints[0].force[-1] == pytest.approx(-force, rel=5e-4)


def test_soft_joints():
    """A pin moves along its force, a drive rotates by its moment, and gaps open them."""
    arm = Mechanism((GROUND, Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),))), (PinDrive("arm", "O"),),
                    {"O": 0, "A": 1.0}, loads=(PointLoad("arm", "A", 3e-3j),))  # fmt: skip
    stiff = Section(EI=math.inf, EA=1e3)
    soft = nonlinear_equilibrium(arm, [stiff], [AT_REST], [0.0, 1.0], joints={"O": JointCompliance(2e-3, 4e-2)})
    assert soft.w[0, -1, 0] == pytest.approx(3e-3 * 2e-3, rel=1e-5)
    assert soft.phi[0, -1, 0] == pytest.approx(3e-3 * 4e-2, rel=1e-5)
    assert soft.efforts[0, -1] == pytest.approx(-3e-3, rel=1e-5)
    assert soft.joints[0].force[-1] == pytest.approx(-3e-3j, rel=1e-5)
    ajar = nonlinear_equilibrium(arm, [stiff], [AT_REST], [0.0, 1.0], joints={"O": JointCompliance(gap=0.1 - 0.2j)})
    assert [ajar.u[0, -1, 0], ajar.w[0, -1, 0]] == pytest.approx([0.1, -0.2])


@pytest.mark.parametrize("turning", [False, True])
def test_loads_on_a_rigid_link(turning):
    """Moments of forces and line loads at points off the node, in ground axes or local axes."""
    link = Link("arm", {"O": 0, "P": 0.5 + 0.2j, "A": 1.0 - 0.3j}, (Beam("P", "A"),))
    loads = PointLoad("arm", "A", 1.0 + 2.0j, 0.3, turning), LineLoad("arm", 0, 1.0 - 1.0j, 2.0 + 3.0j, turning)
    mechanism = Mechanism((GROUND, link), (PinDrive("arm", "O"),), {"O": 0, "A": 1.0, "P": 0.7}, loads=loads)
    found = nonlinear_equilibrium(mechanism, [Section()], [lambda t: (0.9 + 0 * t,)], [0.0, 1.0])
    place, way = np.exp(0.9j) * (1.0 - 0.3j), np.exp(0.9j) * (0.5 - 0.5j)
    force = (1 + 2j) * (np.exp(0.9j) if turning else 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(6)
    xi, share = (nodes + 1) / 2, weights / 2 * abs(way)
    line = (1 - 1j + xi * (1 + 4j)) * (way / abs(way) if turning else 1.0)
    at = np.exp(0.9j) * (0.5 + 0.2j) + xi * way
    moment = 0.3 + (np.conj(place) * force).imag + (share * (np.conj(at) * line).imag).sum()
    assert found.efforts[0, -1] == pytest.approx(-moment, rel=1e-9)
    assert found.joints[0].force[-1] == pytest.approx(-force - (share * line).sum(), rel=1e-9)
    assert np.isnan(found.M).all()


@pytest.mark.parametrize(
    "joints",
    [
        {"guide": JointCompliance(turn=1e-4)},
        {"guide": JointCompliance(rotation=1e-5)},
        {"A": JointCompliance(gap=2e-5 - 1e-5j)},
        {"A": JointCompliance(translation=1e-6)},
    ],
    ids=["turn", "soft guide", "gap", "soft pin"],
)
def test_small_misfits_agree_with_linear_theory(joints):
    """Signs and sizes of gaps, rotations and compliances agree with the closed form."""
    links = (
        GROUND,
        Link("crank", {"O": 0, "A": 1.0}, (Beam("O", "A"),)),
        Link("rod", {"A": 0, "B": 2.0}, (Beam("A", "B"),)),
        Link("ram", {"B": 0, "C": 0.5}, (Beam("B", "C"),)),
    )
    slider = Slider("guide", "ram", "ground", "B", 0.2j, 1.0)
    drawing = {"O": 0, "A": 0.6 + 0.8j, "B": 2.5 + 0.2j, "C": 3.0 + 0.2j}
    loads = PointLoad("ram", "C", -1.0 + 0.5j), PointLoad("rod", "B", 0.5)
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), loads=loads)
    sections = [Section(1e6, 1e4)] * 3
    found = nonlinear_equilibrium(mechanism, sections, [lambda t: (0.9 + 0 * t,)], [0.0, 1.0], 2, joints)
    linear = deflection(motion(mechanism, [0.9]), sections, joints)
    for field, size in (("u", 2e-8), ("w", 2e-8), ("phi", 2e-8), ("N", 1e-3), ("V", 1e-3), ("M", 1e-3)):
        assert getattr(found, field)[:, -1] == pytest.approx(sample(linear, field, found.xi)[:, 0], abs=size)


def complete_mechanism():
    """Return a mechanism with every kind of coupling, load and mass, its drive laws, and its sections."""
    links = (
        Link("ground", {"O": 0, "D": 2.0 + 0.1j, "S": 1.0 - 1.0j}),
        Link("crank", {"O": 0, "A": 1.0}, (Beam("O", "A", 2.0, (1.0, -0.3)),), (Lump("A", 0.3, 0.2, 0.1 + 0.2j),)),
        Link("rod", {"A": 0, "B": 2.0, "C": 1.0 + 0.5j}, (Beam("A", "C", 1.0), Beam("C", "B", 1.0)), (Lump("B", 1.0),)),
        Link("block", {"B": 0, "E": 0.2j}, (), (Lump("E", 0.5, 0.1, 0.1),)),
        Link("wheel", {"D": 0, "W": 0.3}, (), (Lump("W", 0.7, 0.05),)),
    )
    slider = Slider("guide", "block", "ground", "E", 0.2j, np.exp(0.1j), np.exp(0.05j))
    loads = (
        PointLoad("rod", "C", 1.0 - 2.0j, 0.5, True),
        PointLoad("block", "E", 1.0 - 2.0j, 0.5),
        PointLoad("block", "E", 1.0 + 2.0j, 0.5, True),
        LineLoad("crank", 0, 1.0 + 2j, 2.0 - 1.0j),
        LineLoad("rod", 1, 1.0 + 2j, 2.0 - 1.0j, True),
        Spring("rod", "C", "ground", "S", 20.0, 0.3, 2.0, 1.0),
        Spring("block", "E", "wheel", "W", 20.0, 0.3, 2.0, 1.0),
        TorsionSpring("rod", "A", "crank", 3.0, 0.1, 0.4, 0.2),
    )
    gears = (Gear(PinDrive("crank", "O"), PinDrive("wheel", "D"), -2.0),)
    drawing = {"O": 0, "A": 0.6 + 0.8j, "B": 2.5 + 0.2j, "D": 2.0 + 0.1j, "C": 1.6 + 1.0j, "W": 2.3 + 0.1j}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), -9.81j, loads, gears)
    sections = [Section(2e3, 5.0, 500.0, area=1.0, inertia=0.01), Section(1e3, 4.0), Section(1e3, 4.0)]
    return with_rotary_inertia(mechanism, sections), sections


def test_tangents_are_the_derivatives_of_the_residual():
    from fem_check.nonlinear.system import system_of

    mechanism, sections = complete_mechanism()
    joints = {"B": JointCompliance(1e-2), "guide": JointCompliance(0.0, 1e-2)}
    system = system_of(mechanism, sections, [lambda t: (0.9 + t, 1 + 0 * t, 0 * t)], 0.0, 2, joints, 0.05)
    random = np.random.default_rng(5)
    q = system.rigid_coordinates(system.rigid.at([0.0])) + 0.1 * random.normal(size=(1, len(system.prescribed)))
    v, a = random.normal(size=(2, *q.shape))
    multipliers = random.normal(size=(1, len(system.ties.constraints)))
    given = system.drives(np.zeros(1)), system.load_factors(np.zeros(1))

    def both(*state):
        total, found, _ = system.residual(*state, *given, tangent=False)
        return np.concatenate([total[0, system.free], found.violation[0]])

    tangents = system.residual(q, v, a, multipliers, *given)[2]
    free, step = len(system.free), 1e-6
    whole = {0: np.concatenate([tangents.stiffness[0], tangents.rows[0]]), 1: tangents.damping[0], 2: tangents.mass[0]}
    for which, matrix in whole.items():
        for column, number in enumerate(system.free):
            ahead, behind = [[q, v, a, multipliers] for _ in range(2)]
            ahead[which], behind[which] = ahead[which].copy(), behind[which].copy()
            ahead[which][0, number] += step
            behind[which][0, number] -= step
            slope = (both(*ahead) - both(*behind)) / (2 * step)
            assert np.abs(slope[: len(matrix)] - matrix[:, column]).max() < 1e-5 * np.abs(matrix).max()
    for row in range(multipliers.shape[1]):
        more = multipliers.copy()
        more[0, row] += 1.0
        slope = both(q, v, a, more) - both(q, v, a, multipliers)
        assert slope[:free] == pytest.approx(tangents.rows[0, row], abs=1e-9)


@pytest.mark.parametrize("turn", [np.exp(0.7j), np.exp(-2.5j)])
def test_equilibrium_does_not_depend_on_the_axes(turn):
    """Displacements and section forces are the same for a rotated ground."""
    found = []
    for way in (1.0, turn):
        mechanism, sections = complete_mechanism()
        ground, *moving = mechanism.links
        links = [Link("ground", {name: place * way for name, place in ground.points.items()}), *moving]
        slides = [Slider("guide", "block", "ground", "E", 0.2j * way, np.exp(0.1j) * way, np.exp(0.05j) * way)]
        loads = [
            PointLoad("block", "E", (1.0 - 2.0j) * way, 0.5) if number == 1
            else LineLoad("crank", 0, (1.0 + 2j) * way, (2.0 - 1.0j) * way) if number == 3
            else load for number, load in enumerate(mechanism.loads)
        ]  # fmt: skip
        drawing = {name: place * way for name, place in mechanism.drawing.items()}
        turned = Mechanism(links, mechanism.drives, drawing, slides, -9.81j * way, loads, mechanism.gears)
        start = np.angle(way) + 0.9
        found.append(nonlinear_equilibrium(turned, sections, [lambda t, start=start: (start + 0 * t,)], [0.0, 1.0], 4))
    for field in ("u", "w", "phi", "N", "V", "M", "efforts"):
        assert getattr(found[0], field) == pytest.approx(getattr(found[1], field), abs=1e-6)


class Rope:
    """A force from the arm's end to a point of the ground, and a moment by a rate."""

    points = (("ground", "O"), ("arm", "A"))

    def forces(self, motion):
        pull = 0.2 * (2.0 + 1j - position_of(motion, "arm", "A"))
        yield "ground", "O", 1.0, 0.0
        yield "arm", "A", pull, 0.3 * motion.angular_velocity[1]


def rigid_arm(*loads):
    links = GROUND, Link("arm", {"O": 0, "A": 1.0})
    return Mechanism(links, (PinDrive("arm", "O"),), {"O": 0, "A": 1.0}, loads=loads)


def test_a_custom_load_acts_like_on_rigid_links():
    """The drive of a rigid arm carries the moment of the force and of the rate."""
    arm = Mechanism(
        (GROUND, Link("arm", {"O": 0, "A": 1.0})), (PinDrive("arm", "O"),), {"O": 0, "A": 1.0}, loads=(Rope(),)
    )
    found = nonlinear_equilibrium(arm, [], [lambda t: (0.4 + 0.7 * t,)], np.linspace(0.0, 2.0, 5))
    tip = np.exp(1j * (0.4 + 0.7 * found.time))
    moment = (np.conj(tip) * 0.2 * (2.0 + 1j - tip)).imag + 0.3 * 0.7
    assert found.efforts[0] == pytest.approx(-moment, abs=1e-7)


def test_a_load_by_the_motion():
    """One force depends on the angle, another on the angular acceleration of the arm."""
    loads = (
        PointLoad("arm", "A", 1j, law=law_of(LinkAngle("arm"), np.sin)),
        PointLoad("arm", "A", moment=1.0, law=lambda motion: motion.turning[1].imag),
    )
    arm = rigid_arm(*loads)
    found = nonlinear_equilibrium(arm, [], [lambda t: (0.4 + 0.7 * t**2,)], np.linspace(0.0, 1.0, 5))
    angle = 0.4 + 0.7 * found.time**2
    assert found.efforts[0] == pytest.approx(-np.cos(angle) * np.sin(angle) - 1.4, abs=1e-5)


def test_unsupported_features_are_named():
    arm = cantilever(1.0, PointLoad("arm", "A", 1j, law=lambda motion: motion.closures))
    with pytest.raises(NotCheckedError, match='"closures"'):
        held(arm, Section(1.0, 1.0), 2)

    rail = Link("rail", {"O": 0, "A": 1.0}, (Beam("O", "A"),))
    block = Link("block", {"P": 0})
    slider = Slider("slot", "block", "rail", "P", 0.0, 1.0)
    sliding = Mechanism(
        (GROUND, rail, block), (PinDrive("rail", "O"), SliderDrive("slot")), {"O": 0, "A": 1}, (slider,)
    )
    with pytest.raises(NotCheckedError, match='"slot" moves along the elastic link "rail"'):
        nonlinear_equilibrium(sliding, [Section(1.0, 1.0)], [AT_REST, AT_REST], [0.0, 1.0])
    with pytest.raises(NotCheckedError, match="several designs"):
        held(cantilever(np.array([[1.0], [2.0]])), Section(1.0, 1.0), 2)
    with pytest.raises(NotCheckedError, match='"X"'):
        held(cantilever(1.0), Section(1.0, 1.0), 2, joints={"X": JointCompliance(1.0)})
    stray = Link("arm", {"O": 0, "A": 1.0, "B": 2.0}, (Beam("O", "A"),), (Lump("B", 1.0),))
    heavy = Mechanism((GROUND, stray), (PinDrive("arm", "O"),), {"O": 0, "A": 1.0})
    with pytest.raises(NotCheckedError, match='no beam reaches the point "B"'):
        held(heavy, Section(1.0, 1.0), 2)
    with pytest.raises(ValueError, match="2 sections for 1 beams"):
        nonlinear_equilibrium(cantilever(1.0), [Section(), Section()], [AT_REST], [0.0, 1.0])
    loose = Mechanism((GROUND, Link("bar", {"O": 0}, (), (Lump("O", 1.0),))), (), {"O": 0},
                      loads=(PointLoad("bar", "O", moment=1.0),))  # fmt: skip
    with pytest.raises(DoesNotCloseError, match="no equilibrium found at 0 s"):
        nonlinear_equilibrium(loose, [], [], [0.0, 1.0])
    with pytest.raises(ValueError, match="0 laws for 1 drives"):
        nonlinear_equilibrium(cantilever(1.0), [Section()], [], [0.0, 1.0])
