"""Natural frequencies are those of standard beams, in any mechanism.

References are the characteristic equations of Blevins, Formulas for Natural Frequency and Mode Shape (1979), Table
8-1 (single-span beams), solved in 30 digits, and closed forms with few degrees of freedom.
"""

import math

import fem_vibrating
import mpmath
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.optimize
from mechanisms import (
    ALL,
    bar,
    cantilever,
    motion_of,
    propped,
    rigid_sections,
    steel_four_bar,
    still,
    supported,
    with_link,
)
from msgspec.structs import replace

from elastic import RIGID, JointCompliance, Section, deflection, rectangle, section_of, tapered, with_rotary_inertia
from elastic.assessment import harmonics, period_of
from elastic.vibration import natural_frequencies
from kinelast import read_scene, scene_motion, shipped_scenes
from rigid import Beam, Gear, Link, Lump, Mechanism, PinDrive, PointLoad, Slider, SliderDrive, motion

LENGTH, EI, MASS = 1.7, 23.0, 0.9
SLENDER = Section(EA=1e9, EI=EI)
SHARP = 1e-10


def frequencies(mechanism, sections, modes=3, joints=None, settled=SHARP):
    return natural_frequencies(still(mechanism), sections, modes, joints=joints, tolerance=settled).omega[:, 0]


def roots(equation, near):
    """Return zeros lambda l of a characteristic equation."""
    with mpmath.workdps(30):
        return np.array([float(mpmath.findroot(equation, start)) for start in near])


def bending(lambdas, length=LENGTH, stiffness=EI, mass=MASS):
    return (lambdas / length) ** 2 * math.sqrt(stiffness / mass)


def by_elements(mechanism, sections, modes=3, joints=None):
    return fem_vibrating.natural_frequencies(still(mechanism), sections, 32, modes, joints=joints)[:, 0]


@pytest.fixture(params=[(frequencies, 1e-7), (by_elements, 1e-5)], ids=["closed forms", "finite elements"])
def solver(request):
    """A function that computes natural frequencies, and its tolerance."""
    return request.param


class TestSingleSpan:
    """Blevins, Table 8-1."""

    def test_clamped_free(self, solver):
        solve, tolerance = solver
        expected = roots(lambda x: mpmath.cos(x) * mpmath.cosh(x) + 1, (1.875, 4.694, 7.855))
        found = solve(cantilever({"A": 0, "B": LENGTH}, MASS), [SLENDER])
        np.testing.assert_allclose(found, bending(expected), rtol=tolerance)

    def test_pinned_pinned(self, solver):
        solve, tolerance = solver
        found = solve(supported({"A": 0, "B": LENGTH}, MASS), [SLENDER])
        np.testing.assert_allclose(found, bending(np.pi * np.arange(1, 4)), rtol=tolerance)

    def test_clamped_pinned(self, solver):
        solve, tolerance = solver
        expected = roots(lambda x: mpmath.tan(x) - mpmath.tanh(x), (3.927, 7.069, 10.21))
        found = solve(propped({"A": 0, "B": LENGTH}, MASS), [SLENDER])
        np.testing.assert_allclose(found, bending(expected), rtol=tolerance)

    def test_free_free(self):
        """On a very soft drive, three slow modes precede those of the free beam."""
        loose = {"A": JointCompliance(translation=1e6, rotation=1e6)}
        expected = roots(lambda x: mpmath.cos(x) * mpmath.cosh(x) - 1, (4.73, 7.853))
        found = frequencies(cantilever({"A": 0, "B": LENGTH}, MASS), [SLENDER], 5, loose)
        assert (found[:3] < 0.01).all()
        np.testing.assert_allclose(found[3:], bending(expected), rtol=1e-5)  # round-off because of the soft drive

    def test_two_equal_spans(self, solver):
        """Modes alternate between those of a pinned span and of a span clamped at the middle support."""
        solve, tolerance = solver
        mechanism = supported({"A": 0, "B": LENGTH, "C": 2 * LENGTH}, MASS, rollers=["B", "C"])
        clamped = roots(lambda x: mpmath.tan(x) - mpmath.tanh(x), (3.927,))
        found = solve(mechanism, [SLENDER] * 2)
        np.testing.assert_allclose(found, bending(np.array([np.pi, clamped[0], 2 * np.pi])), rtol=tolerance)

    def test_axial_modes(self, solver):
        """Blevins, longitudinal vibration: fixed-free, (2 i - 1) pi/2."""
        solve, tolerance = solver
        found = solve(cantilever({"A": 0, "B": LENGTH}, MASS), [Section(EA=40.0, EI=math.inf)])
        expected = np.array([1, 3, 5]) * np.pi / 2 / LENGTH * math.sqrt(40.0 / MASS)
        np.testing.assert_allclose(found, expected, rtol=tolerance)

    def test_simeon_rod(self):
        """IVP Test Set, "crank": the rod on two supports, from its stiffness and mass matrices."""
        rod = Section(EA=2e11 * 0.008**2, EI=2e11 * 0.008**4 / 12)
        found = frequencies(supported({"A": 0, "B": 0.3}, 0.151104 / 0.3), [rod], 2)
        assert found == pytest.approx([1276.686, 5106.746], abs=6e-4)

    def test_timoshenko_pinned_pinned(self, solver):
        """With k = n pi/l: EI k^4 - (m + k^2 (m r^2 + EI m/kGA)) omega^2 + m^2 r^2/kGA omega^4 = 0."""
        solve, tolerance = solver
        length, mass, poisson, E = 0.5, 7850 * 0.05 * 0.1, 0.3, 210e9
        section = section_of(rectangle(0.1, 0.05), E, poisson)
        k = np.pi * np.arange(1, 4) / length
        rotary = mass * 0.1**2 / 12
        a, b = mass * rotary / section.kGA, mass + k**2 * (rotary + section.EI * mass / section.kGA)
        expected = np.sqrt((b - np.sqrt(b**2 - 4 * a * section.EI * k**4)) / (2 * a))
        stiff = replace(section, EA=math.inf)
        found = solve(with_rotary_inertia(supported({"A": 0, "B": length}, mass), [stiff]), [stiff])
        np.testing.assert_allclose(found, expected, rtol=tolerance)
        assert expected[2] < 0.75 * bending(3 * np.pi, length, section.EI, mass)


class TestAddedMass:
    def test_tip_mass(self, solver):
        """Blevins, Table 8-8: 1 + cos cosh + (M/ml) x (cos sinh - sin cosh) = 0."""
        (solve, tolerance), ratio = solver, 0.8
        mechanism = cantilever({"A": 0, "B": LENGTH}, MASS, lumps=(Lump("B", ratio * MASS * LENGTH),))

        def equation(x):
            c, s, ch, sh = mpmath.cos(x), mpmath.sin(x), mpmath.cosh(x), mpmath.sinh(x)
            return 1 + c * ch + ratio * x * (c * sh - s * ch)

        expected = bending(roots(equation, (1.3, 4.05, 7.15)))
        np.testing.assert_allclose(solve(mechanism, [SLENDER]), expected, rtol=tolerance)

    def test_body_on_a_massless_beam(self, solver):
        """A heavy body with inertia and eccentric centre: two modes by the flexibility of the tip."""
        m, J, offset = 3.0, 0.4, 0.2
        lump = Lump("B", m, J, offset)
        found = solver[0](cantilever({"A": 0, "B": LENGTH}, lumps=(lump,)), [Section(EA=math.inf, EI=EI)], 3)
        flexibility = np.array([[LENGTH**3 / 3, LENGTH**2 / 2], [LENGTH**2 / 2, LENGTH]]) / EI
        mass = np.array([[m, m * offset], [m * offset, J + m * offset**2]])
        expected = 1 / np.sqrt(np.sort(np.linalg.eigvals(flexibility @ mass).real)[::-1])
        np.testing.assert_allclose(found, [*expected, np.inf], rtol=1e-9)

    def test_block_on_an_elastic_rail(self):
        """A fixed block on a massless cantilever moves and rotates with the beam at the contact."""
        place, m, J = 0.6 * LENGTH, 2.0, 0.3
        rail = Link("rail", {"A": 0.0, "B": LENGTH}, (Beam("A", "B"),))
        block = Link("block", {"C": 0.0}, lumps=(Lump("C", m, J),))
        slider = Slider("guide", "block", "rail", "C", origin=0.0, direction=1.0)
        mechanism = Mechanism(
            (Link("ground", {"A": 0.0}), rail, block), (PinDrive("rail", "A"), SliderDrive("guide")),
            {"A": 0, "B": LENGTH, "C": place}, (slider,),
        )  # fmt: skip
        course = motion(mechanism, np.array([[0.0], [place]]))
        found = natural_frequencies(course, [Section(EA=math.inf, EI=EI)], 2, tolerance=1e-5).omega[:, 0]
        flexibility = np.array([[place**3 / 3, place**2 / 2], [place**2 / 2, place]]) / EI
        expected = 1 / np.sqrt(np.sort(np.linalg.eigvals(flexibility @ np.diag([m, J])).real)[::-1])
        np.testing.assert_allclose(found, expected, rtol=1e-9)

    def test_a_rigid_arm_on_a_soft_drive(self, solver):
        """sqrt(k/I); the arm is a rigid beam, or a link without beams."""
        give, inertia = {"A": JointCompliance(rotation=1 / 50.0)}, MASS * LENGTH**3 / 3 + 0.5 * LENGTH**2
        beam = cantilever({"A": 0, "B": LENGTH}, MASS, lumps=(Lump("B", 0.5),))
        rod = Lump("A", MASS * LENGTH, MASS * LENGTH**3 / 12, LENGTH / 2)
        bare = replace(beam, links=(beam.links[0], Link("beam", beam.links[1].points, (), (rod, Lump("B", 0.5)))))
        for mechanism, sections in ((beam, [RIGID]), (bare, [])):
            found = solver[0](mechanism, sections, 2, give)
            np.testing.assert_allclose(found, [math.sqrt(50.0 / inertia), np.inf], rtol=1e-12)


def test_geared_arms():
    """An arm on a soft drive carries a wheel with ratio r: c/(J1 + m l^2 + J2 (1 + r)^2)."""
    ratio, m, J = -2.5, 0.7, 0.05
    wheel = Link("wheel", {"B": 0.0}, lumps=(Lump("B", m, J),))
    links = (Link("ground", {"A": 0.0}), bar("arm", "A", "B", LENGTH, MASS), wheel)
    gear = Gear(PinDrive("arm", "A"), PinDrive("wheel", "B", "arm"), ratio)
    mechanism = Mechanism(links, (PinDrive("arm", "A"),), {"A": 0, "B": LENGTH}, gears=(gear,))
    found = frequencies(mechanism, [RIGID], 1, {"A": JointCompliance(rotation=1 / 50.0)})
    expected = math.sqrt(50.0 / (MASS * LENGTH**3 / 3 + m * LENGTH**2 + J * (1 + ratio) ** 2))
    assert found == pytest.approx(expected, rel=1e-12)


def coupled_cantilevers(EA):
    """Return two equal guided beams whose tips a massless rod connects."""
    links = (
        Link("ground", {"O": 0.0}),
        bar("low", "A", "B", LENGTH, MASS),
        bar("high", "C", "D", LENGTH, MASS),
        bar("rod", "B", "D", 0.4, 0.0),
    )
    sliders = (
        Slider("low guide", "low", "ground", "A", origin=0.0, direction=1.0),
        Slider("high guide", "high", "ground", "C", origin=0.4j, direction=1.0),
    )
    drawing = {"O": 0, "A": 0, "B": LENGTH, "C": 0.4j, "D": LENGTH + 0.4j}
    mechanism = Mechanism(links, (SliderDrive("low guide"), SliderDrive("high guide")), drawing, sliders)
    return mechanism, [SLENDER, SLENDER, Section(EA=EA, EI=math.inf)]


def test_two_cantilevers_coupled_at_their_tips():
    """In phase the rod has no force; in antiphase each tip has a spring of twice the rod's stiffness."""
    EA = 0.3
    spring = 2 * EA / 0.4 * LENGTH**3 / EI

    def equation(x):
        c, s, ch, sh = mpmath.cos(x), mpmath.sin(x), mpmath.cosh(x), mpmath.sinh(x)
        return x**3 * (1 + c * ch) + spring * (s * ch - c * sh)

    free = roots(lambda x: mpmath.cos(x) * mpmath.cosh(x) + 1, (1.875,))[0]
    against = roots(equation, (1.9,))[0]
    assert against > free * 1.005
    np.testing.assert_allclose(
        frequencies(*coupled_cantilevers(EA), modes=2), bending(np.array([free, against])), rtol=1e-7
    )


def test_tapered_cantilever():
    """(EI w'')'' = omega^2 m w by Runge-Kutta from the clamped end, with the frequency that frees the other end."""
    taper, mass = tapered(rectangle, (0.02, 0.01), (0.008, 0.006))
    E, density = 210e9, 7850
    section = section_of(rectangle(0.02, 0.01), E, taper=taper)
    m0 = density * 2e-4
    link = Link("beam", {"A": 0.0, "B": 0.8}, (Beam("A", "B", m0, mass),))
    mechanism = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("beam", "A"),), {"A": 0, "B": 0.8})

    def width(x):
        return 0.01 - 0.004 * x / 0.8, 0.02 - 0.012 * x / 0.8

    def free_end(omega):
        def rates(x, y):
            b, h = width(x)
            return [y[1], y[2] / (E * b * h**3 / 12), y[3], omega**2 * density * b * h * y[0]]

        ends = [
            scipy.integrate.solve_ivp(rates, (0, 0.8), start, rtol=1e-10, atol=1e-14).y[2:, -1]
            for start in ([0, 0, 1, 0], [0, 0, 0, 1])
        ]
        return np.linalg.det(ends)

    expected = [scipy.optimize.brentq(free_end, *ends, rtol=1e-10) for ends in ((150, 260), (600, 900))]
    found = frequencies(mechanism, [section], 2)
    np.testing.assert_allclose(found, expected, rtol=1e-7)


class TestMechanism:
    def test_converged_frequencies_are_right_to_a_tenth_of_a_per_cent(self):
        """A much finer answer is at most 0.1 % lower, and never higher."""
        for make in ALL.values():
            case = make()
            course = motion_of(case)
            usual, fine = (
                natural_frequencies(course, case.sections, 3, 6, tolerance=settled) for settled in (1e-3, 0.0)
            )
            known = np.isfinite(usual.omega)
            assert (usual.omega[known] <= fine.omega[known] * (1 + 1.5e-3)).all()
            assert (usual.omega[known] >= fine.omega[known] * (1 - 1e-6)).all()

    def test_convergence_is_spectral(self, monkeypatch):
        """The ratio of successive errors of a clamped beam's third mode grows."""
        expected = bending(roots(lambda x: mpmath.cos(x) * mpmath.cosh(x) + 1, (7.855,)))[0]
        errors = []
        for inner in (3, 5, 7):
            monkeypatch.setattr("elastic.vibration.frequencies.REFINEMENTS", (inner,))
            found = frequencies(cantilever({"A": 0, "B": LENGTH}, MASS), [SLENDER])[2]
            errors.append(found / expected - 1)
        assert errors[0] > 50 * errors[1] > 0
        assert errors[1] / errors[2] > 1.5 * errors[0] / errors[1]

    def test_rigid_beams_are_the_limit_of_stiff_beams(self):
        """A stiffness factor of 1e6 leaves a difference of about 1e-6."""
        case = ALL["six-bar"]()
        course = motion_of(case)
        stiff = [RIGID if number % 2 else section for number, section in enumerate(case.sections)]
        nearly = [
            Section(1e6 * section.EA, 1e6 * section.EI) if number % 2 else section
            for number, section in enumerate(case.sections)
        ]
        exact, near = (natural_frequencies(course, sections, 2, 4).omega for sections in (stiff, nearly))
        np.testing.assert_allclose(near, exact, rtol=1e-4)

    def test_rigid_mechanisms_do_not_vibrate(self):
        case = rigid_sections(ALL["RRR"]())
        course = motion(case.mechanism, case.drive)
        assert np.isinf(natural_frequencies(course, case.sections, 2).omega).all()

    def test_reversed_and_divided_beams(self):
        plain = cantilever({"A": 0, "B": LENGTH}, MASS)
        halves = cantilever({"A": 0, "M": 0.3 * LENGTH, "B": LENGTH}, MASS, reverse=(1,))
        np.testing.assert_allclose(frequencies(plain, [SLENDER]), frequencies(halves, [SLENDER] * 2), rtol=1e-7)

    def test_frequencies_do_not_depend_on_the_unit_of_length(self):
        """The four-bar enlarged by 1000, with E and density divided by 1000, has the same frequencies."""
        case = steel_four_bar(12)
        links = tuple(
            Link(link.name, {name: 1e3 * place for name, place in link.points.items()},
                 tuple(replace(beam, mass_per_length=1e-3 * beam.mass_per_length) for beam in link.beams))
            for link in case.mechanism.links
        )  # fmt: skip
        drawing = {name: 1e3 * place for name, place in case.mechanism.drawing.items()}
        large = Mechanism(links, case.mechanism.drives, drawing)
        sections = [Section(1e3 * section.EA, 1e9 * section.EI) for section in case.sections]
        found = natural_frequencies(motion(case.mechanism, case.drive), case.sections).omega
        other = natural_frequencies(motion(large, case.drive), sections).omega
        # k ~ EI/l^3 and m ~ m' l are unchanged
        np.testing.assert_allclose(other, found, rtol=1e-9)

    def test_designs_equal_single_mechanisms(self):
        lengths = np.array([[0.28], [0.33]])

        def with_coupler(length):
            case = steel_four_bar(6)
            mass = case.mechanism.links[2].beams[0].mass_per_length
            return with_link(case.mechanism, bar("coupler", "A", "B", length, mass)), case

        mechanism, case = with_coupler(lengths)
        both = natural_frequencies(motion(mechanism, case.drive), case.sections).omega
        assert both.shape == (3, 2, 6)
        for design, length in enumerate(lengths[:, 0]):
            one = natural_frequencies(motion(with_coupler(length)[0], case.drive), case.sections).omega
            np.testing.assert_allclose(both[:, design], one, rtol=1e-9)

    def test_sections_of_designs_equal_single_ones(self):
        case = steel_four_bar(6)
        course = motion(case.mechanism, case.drive)
        stiffness = np.array([[20.0], [45.0]])
        both = natural_frequencies(course, [Section(1e6, stiffness), *case.sections[1:]]).omega
        for design, EI in enumerate(stiffness[:, 0]):
            one = natural_frequencies(course, [Section(1e6, EI), *case.sections[1:]]).omega
            np.testing.assert_allclose(both[:, design], one, rtol=1e-9)

    def test_the_minimum_is_found_for_each_design(self):
        """The lowest frequency has a narrow minimum: 24 positions miss it by 1.7 %."""
        scene = read_scene(shipped_scenes()["quick_return"])
        course, first, others = scene_motion(scene), scene.sections[0], scene.sections[1:]
        factors = np.array([[1.0], [0.5]])
        sections = [replace(first, EI=first.EI * factors), *others]
        found = natural_frequencies(course, sections, 1, 12, scene.joints, 1e-6, searched=True)
        coarse = natural_frequencies(course, sections, 1, 24, scene.joints, 1e-6).omega[0].min(axis=-1)
        lowest = np.nanmin(found.omega[0], axis=-1)
        for design, factor in enumerate(factors[:, 0]):
            one = [replace(first, EI=first.EI * factor), *others]
            expected = natural_frequencies(course, one, 1, len(course.time), scene.joints, 1e-6).omega[0]
            assert lowest[design] == pytest.approx(expected.min(), rel=1e-6)
            assert found.position[design, np.nanargmin(found.omega[0, design])] == expected.argmin()
        assert coarse[0] > 1.01 * lowest[0]

    def test_singular_positions_are_nan(self):
        case = steel_four_bar(4)
        out_of_reach = replace(case.mechanism.links[2], points={"A": 0.0, "B": 0.05})
        course = motion(with_link(case.mechanism, out_of_reach), case.drive)
        found = natural_frequencies(course, case.sections)
        assert np.isnan(found.omega).any()
        assert np.isnan(found.omega[0]).tolist() == (~np.isfinite(course.condition)).tolist()


class TestForcing:
    def turning_arm(self, count=32, rate=5.0):
        """Gravity at constant speed bends it by one harmonic."""
        mechanism = cantilever({"A": 0, "B": 1.0}, 2.0, gravity=-9.81j)
        return motion(mechanism, np.arange(count) * 2 * np.pi / count, rate)

    def test_gravity_on_a_turning_arm_is_one_harmonic(self):
        course = self.turning_arm()
        found = harmonics(deflection(course, [SLENDER]), period_of(course))
        assert period_of(course) == pytest.approx(2 * np.pi / 5, rel=1e-12)
        assert found.omega[1] == pytest.approx(5.0, rel=1e-12)
        assert found.share[1] == pytest.approx(1.0, abs=1e-12)
        assert found.strong().tolist() == [1]

    def test_mean_and_harmonic(self):
        """A co-rotating and a fixed force give F + P cos, with energies F^2 and P^2/2."""
        loads = (PointLoad("beam", "B", 3j, turning=True), PointLoad("beam", "B", -4j))
        course = motion(cantilever({"A": 0, "B": 1.0}, loads=loads), np.arange(9) * 2 * np.pi / 9, 5.0)
        found = harmonics(deflection(course, [SLENDER]), period_of(course))
        assert found.share[:3] == pytest.approx(np.sqrt([9 / 17, 8 / 17, 0]), abs=1e-12)

    def test_axial_forces_count_by_their_strain_energy(self):
        """Along the beam: 3 + 4 sin, with energies (9 + 8)/EA; across at the end: 4 cos, with the energy 8/(3 EI)."""
        loads = (PointLoad("beam", "B", 3.0, turning=True), PointLoad("beam", "B", -4j))
        course = motion(cantilever({"A": 0, "B": 1.0}, loads=loads), np.arange(9) * 2 * np.pi / 9, 5.0)
        bent = deflection(course, [Section(EA=2.0, EI=1.0)])
        found, bending = (harmonics(bent, period_of(course), forces) for forces in ("MN", "M"))
        whole = 9 / 2 + 8 / 2 + 8 / 3
        assert found.share[:3] == pytest.approx(np.sqrt([9 / 2 / whole, (8 / 2 + 8 / 3) / whole, 0]), abs=1e-12)
        assert bending.share[:3] == pytest.approx([0, 1, 0], abs=1e-12)

    def test_shares_sum_to_the_energy(self):
        case = steel_four_bar(90)
        course = motion(case.mechanism, case.drive, case.rate)
        found = harmonics(deflection(course, case.sections), period_of(course))
        assert (found.share**2).sum() == pytest.approx(1.0, rel=1e-12)

    def test_without_a_cycle_there_is_no_period(self):
        course = motion(cantilever({"A": 0, "B": 1.0}, 2.0), np.linspace(0, 1, 9), 1.0)
        assert math.isnan(period_of(course))


class TestLargeStructures:
    """Sparse matrices and subspace iteration agree with dense matrices and all eigenvalues."""

    @pytest.mark.parametrize(
        "name", ["steel_four_bar", "quick_return", "flap_bars", "flap_plates", "simeon_slider_crank"]
    )
    def test_sparse_modes_equal_dense_modes(self, name, monkeypatch):
        import elastic.vibration.mechanism_matrices as matrices

        scene = read_scene(shipped_scenes()[name])
        course = scene_motion(scene, 12)
        found = []
        for large in (10**9, 0):
            monkeypatch.setattr(matrices, "MAX_DENSE", large)
            found.append(natural_frequencies(course, scene.sections, positions=4, joints=scene.joints).omega)
        np.testing.assert_allclose(found[1], found[0], rtol=1e-6)

    def test_redundant_conditions_and_missing_modes(self):
        """Two masses of 1 kg on springs of 1 and 4 N/m have 1 and 2 rad/s; a third coordinate is fixed twice."""
        from elastic.vibration.mechanism_matrices import lowest_sparse

        held = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]])
        found = lowest_sparse(np.diag([4.0, 1.0, 0.0]), np.diag([1.0, 1.0, 5.0]), held, 3)
        np.testing.assert_allclose(found, [1.0, 2.0, np.inf], rtol=1e-9)
