"""Joint forces, drive efforts and shaking forces balance all loads on the links.

References are one dense equilibrium system of all links, Newton's laws summed over mass points, and closed forms.
"""

import cmath

import balance
import numpy as np
import pytest
from exact import Equations
from mechanisms import ALL, bar, four_bar, lumps, motion_of, replaced, slider_crank, turn
from msgspec.structs import replace
from tiers import in_tiers

from rigid import (
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    drive_efforts,
    motion,
    position_of,
    reactions,
    structure,
)


def loads_about_origins(going, position):
    """Return force and moment about the origin of each moving link by inertia, weight and given loads."""
    right = np.zeros((len(going.mechanism.links), 3))

    def add(at, place, force, twist):
        arm = going.direction[at, position] * place
        right[at] += force.real, force.imag, balance.moment(arm, force) + twist

    def here(value):
        return np.broadcast_to(value, going.columns)[position]

    for at, place, force, twist in balance.applied(going):
        add(at, place, complex(here(force)), here(twist))
    for at, place, mass in balance.mass_points(going.mechanism):
        add(at, place, -mass * balance.acceleration_of(going, at, place)[position], 0.0)
    for at, inertia in balance.inertias(going.mechanism):
        right[at, 2] -= inertia * going.angular_acceleration[at, position]
    return right[1:].ravel()


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("position", in_tiers([0, 11], 10, 10))
def test_equal_one_dense_system_of_all_links(name, position):
    """The transposed constraint matrix times multipliers balances the loads of all links."""
    case = ALL[name]()
    going = motion_of(case)
    mechanism = case.mechanism
    q = np.stack([going.origin.real, going.origin.imag, np.angle(going.direction)], 1)[1:, :, position].ravel()
    equations = Equations(mechanism, cmath)
    matrix = equations.matrix(q, list(case.drive[:, position])).astype(float)
    multipliers = np.linalg.solve(matrix.T, -loads_about_origins(going, position))

    forces = reactions(going)
    scale = max(abs(np.broadcast_to(force, going.columns)).max() for force in forces.force)
    joints = {joint.name: k for k, joint in enumerate(structure(mechanism).joints)}
    for row, (point, one, other) in enumerate(equations.pins):
        joint = structure(mechanism).joints[joints[point]]
        assert {joint.parent, joint.child} == {one, other}
        sign = 1 if joint.child == other else -1
        got = np.broadcast_to(forces.force[joints[point]], going.columns)[position]
        assert abs(got - sign * complex(*multipliers[2 * row : 2 * row + 2])) < 1e-12 * scale, point
    row = 2 * len(equations.pins)
    for slider in mechanism.sliders:
        joint = structure(mechanism).joints[joints[slider.name]]
        along, _ = equations.slid(q, slider)
        got = np.broadcast_to(forces.force[joints[slider.name]], going.columns)[position] * joint.sense
        across = (np.conj(complex(*along) * 1j) * got).real
        assert abs(across - multipliers[row + 1].real) < 1e-12 * scale, slider.name
        twist = np.broadcast_to(forces.moment[joints[slider.name]], going.columns)[position] * joint.sense
        assert abs(twist - multipliers[row]) < 1e-12 * scale, slider.name
        row += 2
    efforts = drive_efforts(going, forces)[:, position]
    np.testing.assert_allclose(efforts, multipliers[row:], rtol=0, atol=1e-12 * scale)


@pytest.mark.parametrize("name", ALL)
def test_ground_forces_agree_with_momentum(name):
    """Shaking force and moment are the applied loads minus the rate of momentum, summed over mass points."""
    going = motion_of(ALL[name]())
    forces = reactions(going)
    force, twist = balance.missing_force(going)
    np.testing.assert_allclose(forces.ground_force, force, rtol=0, atol=1e-12 * abs(force).max())
    np.testing.assert_allclose(forces.ground_moment, twist, rtol=0, atol=1e-12 * abs(force).max())


class TestClosedForms:
    def test_driven_pendulum(self):
        """A uniform bar: torque m l^2/3 eps + m g l/2 cos."""
        L, m, g, eps = 0.7, 1.3, 9.81, 4.0
        links = (Link("ground", {"O": 0.0}), bar("arm", "O", "A", L, m / L))
        mechanism = Mechanism(links, (PinDrive("arm", "O"),), {"O": 0, "A": L}, gravity=-1j * g)
        going = motion(mechanism, turn(8), 3.0, eps)
        expected = m * L**2 / 3 * eps + m * g * L / 2 * np.cos(turn(8))
        np.testing.assert_allclose(drive_efforts(going, reactions(going))[0], expected, rtol=1e-13)

    def test_driven_block(self):
        """Along an incline: m (a + g sin slope)."""
        m, g, slope, a = 2.5, 9.81, 0.4, 1.7
        links = (Link("ground", {"O": 0.0}), Link("block", {"P": 0.0}, lumps=(Lump("P", m),)))
        slider = Slider("guide", "block", "ground", "P", 0.0, np.exp(1j * slope))
        mechanism = Mechanism(links, (SliderDrive("guide"),), {"O": 0, "P": 0}, (slider,), gravity=-1j * g)
        going = motion(mechanism, [0.1, 0.2], 0.5, a)
        forces = reactions(going)
        np.testing.assert_allclose(drive_efforts(going, forces)[0], m * (a + g * np.sin(slope)), rtol=1e-14)
        np.testing.assert_allclose(abs(forces.force[0]), m * np.hypot(a + g * np.sin(slope), g * np.cos(slope)))

    def test_piston_force_on_a_massless_slider_crank(self):
        """T = F r sin(t + b)/cos(b), sin b = r sin(t)/l: virtual work, T = -F dx/dt."""
        r, L, F = 0.1, 0.35, 900.0
        links = (
            Link("ground", {"O": 0.0}),
            Link("crank", {"O": 0.0, "A": r}),
            Link("rod", {"A": 0.0, "B": L}),
            Link("piston", {"B": 0.0}),
        )
        slider = Slider("bore", "piston", "ground", "B", 0.0, 1.0)
        push = (PointLoad("piston", "B", force=-F),)
        drawing = {"O": 0, "A": r, "B": r + L}
        mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), loads=push)
        angle = turn(12)
        going = motion(mechanism, angle, 5.0)
        lean = np.arcsin(r * np.sin(angle) / L)
        forces = reactions(going)
        # the drive holds the crank against the piston force, which pushes it towards O
        expected = -F * r * np.sin(angle + lean) / np.cos(lean)
        np.testing.assert_allclose(drive_efforts(going, forces)[0], expected, rtol=1e-13, atol=1e-11)
        side = next(k for k, joint in enumerate(structure(mechanism).joints) if not joint.turns)
        np.testing.assert_allclose(abs(forces.force[side]), F * abs(np.tan(lean)), rtol=1e-12, atol=1e-11)

    def test_a_load_on_the_ground_loads_only_the_ground(self):
        """It does not appear in any joint."""
        case = four_bar(loads=())
        pushed = replaced(case.mechanism, loads=(PointLoad("ground", "D", 3 + 4j, 2.0),))
        forces = [reactions(motion(m, case.drive, 7.0)) for m in (case.mechanism, pushed)]
        np.testing.assert_allclose(forces[1].ground_force - forces[0].ground_force, 3 + 4j, rtol=1e-12)
        D = case.mechanism.links[0].points["D"]
        expected = 2.0 + balance.moment(D, 3 + 4j)
        np.testing.assert_allclose(forces[1].ground_moment - forces[0].ground_moment, expected, rtol=1e-10)
        for one, other in zip(forces[0].force, forces[1].force, strict=True):
            np.testing.assert_array_equal(one, other)

    def test_law_multiplies_a_load(self):
        case = four_bar(loads=(PointLoad("coupler", "B", 10.0, 1.0, law=lambda motion: np.cos(motion.drive[0])),))
        plain = four_bar(loads=(PointLoad("coupler", "B", 10.0, 1.0),))
        free = four_bar(loads=())
        efforts = [drive_efforts(motion_of(c), reactions(motion_of(c)))[0] for c in (case, plain, free)]
        np.testing.assert_allclose(
            efforts[0] - efforts[2], (efforts[1] - efforts[2]) * np.cos(case.drive[0]), rtol=0, atol=1e-12
        )


class TestSingularPositions:
    def test_only_singular_positions_are_nan(self):
        """Crank, coupler and rocker are in line, so no joint force can hold a transverse load."""
        case = four_bar(0.25, 0.5, 0.25, 0.5)
        going = motion(case.mechanism, [0.5, np.pi, 1.0], 1.0)
        forces = reactions(going)
        assert np.isnan(forces.force[-1][1])
        assert np.isfinite(forces.force[-1][[0, 2]]).all()


class TestDesigns:
    def test_loads(self):
        """Efforts for three loads at once, on an axis of designs."""
        case = slider_crank(loads=())
        sizes = np.array([[0.0], [10.0], [-4.0]])
        going = motion(replaced(case.mechanism, loads=(PointLoad("rod", "B", sizes, sizes),)), case.drive, 7.0)
        got = drive_efforts(going, reactions(going))[0]
        assert got.shape == (3, 24)
        for number, size in enumerate(sizes[:, 0]):
            alone = motion(replaced(case.mechanism, loads=(PointLoad("rod", "B", size, size),)), case.drive, 7.0)
            np.testing.assert_allclose(got[number], drive_efforts(alone, reactions(alone))[0], rtol=1e-11, atol=1e-12)


def test_several_links_on_one_pin():
    """Three bars on one pin: the forces of the pin on the bars sum to the load on any of them."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.4, "G": 0.2 + 0.5j}),
        bar("crank", "O", "A", 0.1, 0.5, lumps=lumps("A")),
        bar("coupler", "A", "B", 0.35),
        bar("rocker", "D", "B", 0.3),
        bar("rod", "B", "E", 0.3),
        bar("swing", "G", "E", 0.25),
    )
    drawing = {"O": 0, "A": 0.1, "D": 0.4, "B": 0.3 + 0.28j, "G": 0.2 + 0.5j, "E": 0.4 + 0.5j}
    efforts = []
    for owner in ("coupler", "rocker", "rod"):
        load = (PointLoad(owner, "B", 20 + 5j),)
        mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, gravity=-9.81j, loads=load)
        going = motion(mechanism, turn(6), 4.0)
        assert np.isfinite(going.condition).all()
        np.testing.assert_allclose(position_of(going, "rod", "B"), position_of(going, "rocker", "B"), atol=1e-14)
        efforts.append(drive_efforts(going, reactions(going))[0])
    np.testing.assert_allclose(efforts[1], efforts[0], rtol=0, atol=1e-12 * abs(efforts[0]).max())
    np.testing.assert_allclose(efforts[2], efforts[0], rtol=0, atol=1e-12 * abs(efforts[0]).max())


def test_only_the_motor_force_of_a_carriage_on_two_guides_is_known():
    links = (Link("ground", {"O": 0.0, "P": 1j}), Link("cart", {"A": 0.0, "B": 1j}, (), (Lump("A", 2.0, 0.1),)))
    guides = (Slider("low", "cart", "ground", "A", 0j, 1.0), Slider("high", "cart", "ground", "B", 1j, 1.0))
    drawing = {"O": 0, "A": 0, "B": 1j}
    course = Mechanism(links, (SliderDrive("low"),), drawing, guides, gravity=-9.81j)
    going = motion(course, np.linspace(0, 1, 4), 1.0, 3.0)
    forces = reactions(going)
    np.testing.assert_allclose(drive_efforts(going, forces), 6.0, rtol=1e-12)
    assert all(np.isnan(force.imag).all() for force in forces.force)
    crooked = Mechanism(links, (SliderDrive("low"),), drawing, (guides[0], replace(guides[1], direction=np.exp(0.1j))))
    with pytest.raises(MechanismError, match="are locked"):
        motion(crooked, [0.0, 1.0])
