"""The laws of mechanics hold for random mechanisms.

Energy, virtual work, change of frame, units and time reversal are tested with every kind of load.
"""

import balance
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanisms import (
    ALL,
    GRAVITY,
    arm,
    bar,
    four_bar,
    inverted_slider_crank,
    loads,
    moved,
    replaced,
    rigid_sections,
    scotch_yoke,
    six_bar,
    slider_crank,
    turn,
)
from mechanisms import motion_of as course  # the draws are seeded by the text of the tests
from msgspec.structs import replace

from elastic import PRIMARY, Section, deflection
from rigid import (
    Beam,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    PointLoad,
    Slider,
    drive_efforts,
    motion,
    position_of,
    reactions,
    velocity_of,
)

quick = settings(max_examples=25, derandomize=True, deadline=None)


def between(low, high):
    """Return a strategy with even steps, so that failing examples are simple."""
    return st.integers(0, 1000).map(lambda part: low + (high - low) * part / 1000)


@st.composite
def four_bars(draw):
    """Draw crank-rockers: the crank is shortest, and Grashof's condition holds with a margin."""
    crank, coupler, rocker = draw(between(0.05, 0.1)), draw(between(0.3, 0.45)), draw(between(0.3, 0.45))
    base = draw(between(abs(coupler - rocker) + 2.5 * crank, coupler + rocker - 1.5 * crank))
    around = draw(between(-3.0, 3.0))
    return four_bar(crank, coupler, rocker, base * np.exp(1j * around), draw(st.sampled_from([-1.0, 1.0])))


@st.composite
def slider_cranks(draw):
    crank, rod = draw(between(0.05, 0.12)), draw(between(0.3, 0.6))
    offset = draw(between(-0.6, 0.6)) * (rod - crank)
    return slider_crank(crank, rod, offset, draw(between(-3.0, 3.0)), draw(st.sampled_from([-1.0, 1.0])))


@st.composite
def inverted_slider_cranks(draw):
    base = draw(between(0.25, 0.5)) * np.exp(1j * draw(between(-3.0, 3.0)))
    foot = draw(between(-0.08, 0.08)) * 1j
    lean = draw(between(-3.0, 3.0))
    return inverted_slider_crank(draw(between(0.05, 0.15)), base, lean, foot, draw(st.booleans()))


mechanisms = st.one_of(
    four_bars(),
    slider_cranks(),
    inverted_slider_cranks(),
    st.builds(arm, between(0.2, 0.5), between(0.2, 0.5)),
    st.builds(scotch_yoke, between(0.05, 0.2), between(0.9, 2.2)),
    st.builds(six_bar),
)


def largest(values):
    return max(np.abs(value).max() for value in values)


class TestEnergy:
    @quick
    @given(mechanisms)
    def test_drives_and_loads_supply_the_kinetic_energy(self, case):
        """The power of drives, weight and loads is the rate of kinetic energy."""
        going = course(case)
        driven = drive_efforts(going, reactions(going)) * going.drive_rate
        rest = balance.applied_power(going) - balance.kinetic_power(going)
        scale = largest([driven, balance.applied_power(going), balance.kinetic_power(going)])
        np.testing.assert_allclose(driven.sum(0) + rest, 0, atol=1e-12 * scale)

    @quick
    @given(st.one_of(four_bars(), slider_cranks(), inverted_slider_cranks()))
    def test_kinetic_energy_over_a_turn(self, case):
        """The rate of energy is by Fourier series, so no accelerations are involved."""
        count, rate = 256, 3.0
        going = motion(case.mechanism, turn(count, case.drive[0, 0]), rate)
        energy = balance.kinetic_energy(going)
        growth = np.fft.ifft(1j * np.fft.fftfreq(count, 1 / count) * rate * np.fft.fft(energy)).real
        driven = drive_efforts(going, reactions(going))[0] * rate
        scale = largest([driven, growth])
        np.testing.assert_allclose(driven + balance.applied_power(going), growth, rtol=0, atol=1e-9 * scale)

    @quick
    @given(mechanisms)
    def test_joint_forces_do_no_work(self, case):
        """The total power of joint forces without drives is zero: joints are frictionless."""
        going = course(case)
        forces = reactions(going)
        total, scale = 0.0, 0.0
        for place, force, twist in zip(
            (place for closed in going.closures for place in closed.joints), forces.force, forces.moment, strict=True
        ):
            joint = place.joint
            if joint.drive is not None:
                continue
            ends = [
                going.velocity[at] + 1j * going.angular_velocity[at] * arm
                for at, arm in ((joint.child, place.arm_child), (joint.parent, place.arm_parent))
            ]
            turning = going.angular_velocity[joint.child] - going.angular_velocity[joint.parent]
            total = total + balance.product(force, ends[0] - ends[1]) + twist * turning
            scale = max(scale, largest([abs(force) * abs(ends[0])]))
        np.testing.assert_allclose(np.broadcast_to(total, going.columns), 0, atol=1e-12 * scale)

    @quick
    @given(mechanisms)
    def test_half_the_work_of_loads_is_the_strain_energy(self, case):
        """Clapeyron, without weight and inertia; the strain energy is N^2/2EA + M^2/2EI."""
        still = motion(replaced(case.mechanism, gravity=0.0), case.drive)
        solution = deflection(still, case.sections)
        stored = 0.0
        nodes, weights = np.polynomial.legendre.leggauss(6)
        for k, section in enumerate(case.sections):
            for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
                N, M = (np.tensordot(node ** np.arange(len(f)), f[:, k], 1) for f in (solution.N, solution.M))
                stored = stored + weight * solution.length[k] * (N**2 / section.EA + M**2 / section.EI) / 2
        work = half_work(solution)
        np.testing.assert_allclose(work, stored, rtol=1e-10, atol=1e-12 * np.abs(stored).max())

    @quick
    @given(mechanisms)
    def test_rigid_motion_causes_no_deflection(self, case):
        """Without load nothing bends, for any position and rotation."""
        bare = replaced(case.mechanism, gravity=0.0, loads=())
        solution = deflection(motion(bare, case.drive), case.sections)
        assert largest([getattr(solution, field) for field in PRIMARY]) == 0.0


def half_work(solution):
    """Return half the work of the loads on their displacements."""
    going = solution.motion
    mechanism = going.mechanism
    work = 0.0
    for load in mechanism.loads:
        at = mechanism.index[load.link]
        link = mechanism.links[at]
        if isinstance(load, LineLoad):
            k = mechanism.beam_number(load.link, load.beam)
            beam = link.beams[load.beam]
            unit = (link.points[beam.end] - link.points[beam.start]) / solution.length[k]
            for xi, weight in zip(balance.STATIONS, balance.WEIGHTS, strict=True):
                u, w = (np.tensordot(xi ** np.arange(len(f)), f[:, k], 1) for f in (solution.u, solution.w))
                force = load.start + xi * (load.end - load.start)
                own = force if load.turning else force * np.conj(going.direction[at] * unit)
                work = work + weight * solution.length[k] * balance.product(own, u + 1j * w) / 2
        else:
            force = load.force * (going.direction[at] if load.turning else 1.0)
            move, turned = moved_point(solution, at, load.point)
            work = work + (balance.product(force, move) + load.moment * turned) / 2
    return work


def moved_point(solution, at, point):
    """Return displacement and rotation of a point, from the beam that ends there or from the link's axes."""
    going = solution.motion
    link = going.mechanism.links[at]
    for k, (owner, beam) in enumerate(going.mechanism.beams):
        if owner == at and point in (beam.start, beam.end):
            u, w, phi = (
                f[0, k] if point == beam.start else f[:, k].sum(0) for f in (solution.u, solution.w, solution.phi)
            )
            unit = (link.points[beam.end] - link.points[beam.start]) / solution.length[k]
            return going.direction[at] * unit * (u + 1j * w), phi
    arm = going.direction[at] * link.points[point]
    return solution.shift[at] + 1j * solution.angle[at] * arm, solution.angle[at]


class TestFrames:
    @quick
    @given(mechanisms, between(-3.0, 3.0), between(-2.0, 2.0), between(-2.0, 2.0))
    def test_rotation_and_translation(self, case, angle, x, y):
        """Drawing, ground, gravity and fixed loads are rotated and translated together: fields stay the same."""
        turned, away = np.exp(1j * angle), complex(x, y)
        here = deflection(course(case), case.sections)
        other_case = in_another_frame(case, turned, away)
        there = deflection(course(other_case), other_case.sections)
        for field in PRIMARY:
            expected = getattr(here, field)
            np.testing.assert_allclose(getattr(there, field), expected, rtol=0, atol=1e-11 * np.abs(expected).max())
        efforts = [drive_efforts(s.motion, s.forces) for s in (here, there)]
        np.testing.assert_allclose(efforts[1], efforts[0], rtol=0, atol=1e-11 * np.abs(efforts[0]).max())
        forces = [np.broadcast_to(s.forces.ground_force, s.motion.columns) for s in (here, there)]
        np.testing.assert_allclose(forces[1], forces[0] * turned, rtol=0, atol=1e-11 * np.abs(forces[0]).max())

    @quick
    @given(mechanisms)
    def test_reflection(self, case):
        """Viewed from behind, axial quantities stay; transverse ones, slopes and moments change sign."""
        here = deflection(course(case), case.sections)
        other = mirrored(case)
        there = deflection(course(other), other.sections)
        for field, sign in (("N", 1), ("u", 1), ("V", -1), ("M", -1), ("w", -1), ("phi", -1)):
            expected = sign * getattr(here, field)
            np.testing.assert_allclose(getattr(there, field), expected, rtol=0, atol=1e-11 * np.abs(expected).max())

    @quick
    @given(mechanisms)
    def test_time_reversal(self, case):
        """In reversed motion only the velocities change sign."""
        forth = course(case)
        back = motion(case.mechanism, case.drive, -case.rate, case.rate2)
        np.testing.assert_array_equal(back.velocity, -forth.velocity)
        np.testing.assert_allclose(back.acceleration, forth.acceleration, rtol=1e-12, atol=1e-12)
        one, other = (deflection(m, case.sections) for m in (forth, back))
        np.testing.assert_allclose(other.w, one.w, rtol=0, atol=1e-12 * np.abs(one.w).max())

    @quick
    @given(mechanisms, st.sampled_from([1e-3, 25.4, 1e3]), st.sampled_from([1e-3, 7.0]), st.sampled_from([60.0, 1e-3]))
    def test_other_units(self, case, metre, kilogram, second):
        """In other units of length, mass and time each result scales with its dimension."""
        here = deflection(course(case), case.sections)
        other = in_units(case, metre, kilogram, second)
        there = deflection(course(other), other.sections)
        newton = kilogram * metre / second**2
        powers = {"N": newton, "V": newton, "M": newton * metre, "u": metre, "w": metre, "phi": 1.0}
        for field, unit in powers.items():
            expected = getattr(here, field) * unit
            np.testing.assert_allclose(getattr(there, field), expected, rtol=0, atol=1e-11 * np.abs(expected).max())
        np.testing.assert_allclose(there.motion.condition, here.motion.condition, rtol=1e-11)


def turned_load(load, turned, size=1.0, twist=1.0):
    way = 1.0 if load.turning else turned
    if isinstance(load, LineLoad):
        return LineLoad(load.link, load.beam, load.start * way * size, load.end * way * size, load.turning)
    return PointLoad(load.link, load.point, load.force * way * size, load.moment * twist, load.turning)


def in_another_frame(case, turned, away):
    old = case.mechanism
    ground = old.links[0]
    links = (Link("ground", {name: away + turned * place for name, place in ground.points.items()}), *old.links[1:])
    sliders = tuple(
        s
        if s.on != "ground"
        else Slider(s.name, s.link, s.on, s.point, away + turned * s.origin, turned * s.direction, turned * s.turn)
        for s in old.sliders
    )
    drawing = {name: away + turned * place for name, place in old.drawing.items()}
    placed = [turned_load(load, turned) for load in old.loads]
    mechanism = replaced(
        old, links=links, sliders=sliders, drawing=drawing, gravity=old.gravity * turned, loads=tuple(placed)
    )
    drive = case.drive.copy()
    for number, mover in enumerate(old.drives):
        if getattr(mover, "on", None) == "ground":
            drive[number] += np.angle(turned)
    return type(case)(mechanism, case.sections, drive, case.rate, case.rate2)


def mirrored(case):
    """Return the case with conjugated complex numbers and reversed angles and moments."""
    old = case.mechanism

    def link(body):
        points = {name: np.conj(place) for name, place in body.points.items()}
        masses = tuple(Lump(lump.point, lump.mass, lump.inertia, np.conj(lump.offset)) for lump in body.lumps)
        return Link(body.name, points, body.beams, masses)

    def load(item):
        if isinstance(item, LineLoad):
            return LineLoad(item.link, item.beam, np.conj(item.start), np.conj(item.end), item.turning)
        return PointLoad(item.link, item.point, np.conj(item.force), -item.moment, item.turning)

    sliders = tuple(
        Slider(s.name, s.link, s.on, s.point, np.conj(s.origin), np.conj(s.direction), np.conj(s.turn))
        for s in old.sliders
    )
    mechanism = replaced(
        old,
        links=tuple(map(link, old.links)),
        sliders=sliders,
        drawing={name: np.conj(place) for name, place in old.drawing.items()},
        gravity=np.conj(old.gravity),
        loads=tuple(map(load, old.loads)),
    )
    return type(case)(mechanism, case.sections, -case.drive, -case.rate, -case.rate2)


def in_units(case, metre, kilogram, second):
    old = case.mechanism
    newton = kilogram * metre / second**2

    def link(body):
        points = {name: place * metre for name, place in body.points.items()}
        beams = tuple(Beam(b.start, b.end, b.mass_per_length * kilogram / metre) for b in body.beams)
        masses = tuple(
            Lump(lump.point, lump.mass * kilogram, lump.inertia * kilogram * metre**2, lump.offset * metre)
            for lump in body.lumps
        )
        return Link(body.name, points, beams, masses)

    placed = [
        turned_load(load, 1.0, newton / metre if isinstance(load, LineLoad) else newton, newton * metre)
        for load in old.loads
    ]
    sliders = tuple(Slider(s.name, s.link, s.on, s.point, s.origin * metre, s.direction, s.turn) for s in old.sliders)
    mechanism = replaced(
        old,
        links=tuple(map(link, old.links)),
        sliders=sliders,
        drawing={name: place * metre for name, place in old.drawing.items()},
        gravity=old.gravity * metre / second**2,
        loads=tuple(placed),
    )
    sections = tuple(Section(s.EA * newton, s.EI * newton * metre**2) for s in case.sections)
    return type(case)(mechanism, sections, case.drive, case.rate / second, case.rate2 / second**2)


class TestSuperposition:
    @quick
    @given(mechanisms)
    def test_loads_add_up(self, case):
        """Statics and elasticity are linear, so the effects of two sets of loads sum to the whole."""
        old = case.mechanism
        whole = deflection(course(case), case.sections)
        parts = [
            deflection(motion(replaced(old, loads=some, gravity=g), case.drive, *rates), case.sections)
            for some, g, rates in ((old.loads, 0.0, ()), ((), old.gravity, (case.rate, case.rate2)))
        ]
        for field in PRIMARY:
            expected = getattr(whole, field)
            got = sum(getattr(part, field) for part in parts)
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12 * np.abs(expected).max())

    @quick
    @given(st.one_of(four_bars(), slider_cranks()))
    def test_maxwell_betti(self, case):
        """The work of one force on the displacement by another is symmetric."""
        old = replaced(case.mechanism, gravity=0.0)
        one, other = (PointLoad("crank", "A", 3 - 2j), PointLoad(old.links[2].name, "B", -1 + 4j, 0.3))
        solutions = [
            deflection(motion(replaced(old, loads=(load,)), case.drive), case.sections) for load in (one, other)
        ]
        there = 2 * half_work(with_loads(solutions[0], (other,)))
        here = 2 * half_work(with_loads(solutions[1], (one,)))
        np.testing.assert_allclose(there, here, rtol=1e-9, atol=1e-11 * np.abs(here).max())

    @quick
    @given(mechanisms)
    def test_doubled_rigidity_halves_displacements(self, case):
        """The section forces stay the same."""
        here = deflection(course(case), case.sections)
        stiff = deflection(course(case), [Section(2 * s.EA, 2 * s.EI) for s in case.sections])
        for field in ("u", "w", "phi"):
            expected = getattr(here, field) / 2
            np.testing.assert_allclose(getattr(stiff, field), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
        np.testing.assert_array_equal(stiff.M, here.M)


def with_loads(solution, items):
    """Return a deflection whose mechanism carries other loads, to compute their work."""
    going = replace(solution.motion, mechanism=replaced(solution.motion.mechanism, loads=items))
    return replace(solution, motion=going)


class TestConstruction:
    @quick
    @given(mechanisms, st.randoms(use_true_random=False))
    def test_order_of_links_and_loads_does_not_matter(self, case, random):
        old = case.mechanism
        links, items = list(old.links), list(old.loads)
        random.shuffle(links)
        random.shuffle(items)
        mechanism = replaced(old, links=tuple(links), loads=tuple(items))
        beams = [(old.links[at].name, beam) for at, beam in old.beams]
        order = [beams.index((mechanism.links[at].name, beam)) for at, beam in mechanism.beams]
        here = deflection(course(case), case.sections)
        there = deflection(
            motion(mechanism, case.drive, case.rate, case.rate2), [case.sections[number] for number in order]
        )
        for field in PRIMARY:
            expected = getattr(here, field)[:, order]
            np.testing.assert_allclose(getattr(there, field), expected, rtol=0, atol=1e-11 * np.abs(expected).max())

    @pytest.mark.parametrize("name", [name for name in ALL if name != "six-bar, ring"])
    def test_section_forces_do_not_depend_on_stiffness(self, name):
        """The mechanisms are statically determinate."""
        case = ALL[name]()
        soft, stiff = (deflection(course(c), c.sections) for c in (case, rigid_sections(case)))
        for field in ("N", "V", "M"):
            np.testing.assert_array_equal(getattr(stiff, field), getattr(soft, field))

    def test_positions_do_not_depend_on_each_other(self):
        """A batch equals its single positions."""
        case = six_bar(count=7)
        together = deflection(course(case), case.sections)
        for position in range(7):
            alone = deflection(
                motion(case.mechanism, *(v[:, [position]] for v in (case.drive, case.rate, case.rate2))), case.sections
            )
            for field in PRIMARY:
                expected = getattr(together, field)[..., [position]]
                scale = np.abs(getattr(together, field)).max()
                np.testing.assert_allclose(getattr(alone, field), expected, rtol=0, atol=1e-13 * scale)


class TestDesigns:
    def test_designs_equal_a_loop(self):
        """Three designs differ in lengths, masses, sections and offsets."""
        rod, mass = np.array([[0.38], [0.41], [0.45]]), np.array([[0.2], [0.5], [0.9]])
        stiff, crank = np.array([[20.0], [30.0], [50.0]]), np.array([[0.09], [0.1], [0.115]])

        def build(rod, mass, stiff, crank):
            base = slider_crank(loads=()).mechanism
            held = (Lump("B", mass, 0.01 * mass, 0.1j * mass),)
            rod_link = Link("rod", {"A": 0.0, "B": rod}, (Beam("A", "B", mass),), held)
            links = (base.links[0], bar("crank", "O", "A", crank), rod_link, base.links[3])
            mechanism = replaced(base, links=links, loads=loads("rod", "B"))
            return moved(mechanism, [Section(1e5, 30.0), Section(2e5, stiff)], turn(6))

        together = build(rod, mass, stiff, crank)
        whole = deflection(course(together), together.sections)
        efforts = drive_efforts(whole.motion, whole.forces)
        assert whole.w.shape == (6, 2, 3, 6)
        for number in range(3):
            case = build(*(float(values[number, 0]) for values in (rod, mass, stiff, crank)))
            alone = deflection(course(case), case.sections)
            for field in PRIMARY:
                expected = getattr(alone, field)
                got = getattr(whole, field)[:, :, number]
                np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
            np.testing.assert_allclose(efforts[:, number], drive_efforts(alone.motion, alone.forces), rtol=1e-10)


def test_weight_is_an_acceleration_of_the_ground():
    """Gravity g equals an acceleration -g of the frame, so a mechanism in free fall has no forces."""
    case = four_bar(loads=())
    still = [motion(replaced(case.mechanism, gravity=g), case.drive) for g in (GRAVITY, 0.0)]
    heavy = deflection(still[0], case.sections)
    assert np.abs(heavy.w).max() > 1e-6
    weight = balance.missing_force(still[0])[0]
    np.testing.assert_allclose(heavy.forces.ground_force, weight, rtol=1e-12)
    assert np.abs(position_of(still[1], "rocker", "B") - position_of(still[0], "rocker", "B")).max() == 0
    assert np.abs(velocity_of(still[1], "rocker", "B")).max() == 0


def test_the_strategies_draw_every_kind_of_mechanism():
    """Guards the strategies: each kind occurs, and all make full turns."""
    seen = set()

    @settings(max_examples=60, derandomize=True, deadline=None, database=None)
    @given(mechanisms)
    def collect(case):
        assert isinstance(case.mechanism, Mechanism)
        assert np.isfinite(course(case).condition).all()
        assert course(case).condition.max() < 50
        seen.add(tuple(sorted(link.name for link in case.mechanism.links)))

    collect()
    assert len(seen) == 6
