"""Section forces, elastic line and extremes of single beams agree with handbooks.

Gere: Gere, Goodno, Mechanics of Materials, 8th ed., appendix H. Roark: Young, Budynas, Sadegh, Roark's Formulas for
Stress and Strain, 8th ed., Table 8.1.
"""

import numpy as np
import pytest
from mechanisms import (
    ALL,
    bar,
    elastic_guide,
    four_bar,
    motion_of,
    ring,
    six_bar,
    slider_crank,
    steel_four_bar,
    with_link,
)
from tiers import in_tiers

from elastic import PRIMARY, RIGID, Section, coefficients, deflection, displacement_of, extremes, sample
from fem_check import compare, solve
from rigid import Beam, LineLoad, Link, Mechanism, MechanismError, PinDrive, PointLoad, Slider, motion

L, EA, EI = 0.8, 4e5, 75.0
STATIONS = np.linspace(0, 1, 11)
X = STATIONS * L


def solved(case):
    return deflection(motion_of(case), case.sections)


def agreed(course, sections, **more):
    """Return the deflection; finite elements must agree."""
    found = deflection(course, sections, **more)
    assert compare(found, solve(course, sections, 8, **more)).passed
    return found


def cantilever(*loads, mass_per_length=0.0, angle=0.0, rate=0.0, rate2=0.0, backward=False, gravity=0.0):
    """Return a driven arm OA, clamped at O."""
    beam = Beam("A", "O", mass_per_length) if backward else Beam("O", "A", mass_per_length)
    links = (Link("ground", {"O": 0.0}), Link("arm", {"O": 0.0, "A": L}, (beam,)))
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), {"O": 0, "A": L}, gravity=gravity, loads=loads)
    return agreed(motion(mechanism, [angle], rate, rate2), [Section(EA, EI)])


def simple_beam(*loads, mass_per_length=0.0):
    """Return a bar AB between a resting rigid crank (hinge) and a block on the ground (roller)."""
    links = (
        Link("ground", {"O": -0.2j}),
        Link("crank", {"O": 0.0, "A": 0.2}),
        bar("beam", "A", "B", L, mass_per_length),
        Link("block", {"B": 0.0}),
    )
    slider = Slider("guide", "block", "ground", "B", origin=0.0, direction=1.0)
    drawing = {"O": -0.2j, "A": 0.0, "B": L}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), loads=loads)
    return agreed(motion(mechanism, [np.pi / 2]), [Section(EA, EI)])


def across(solution, field, stations=STATIONS):
    return sample(solution, field, stations)[0, 0]


def near(got, expected):
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


class TestCantilever:
    def test_force_at_the_end(self):
        """w = P x^2 (3 L - x)/(6 EI) (Gere, Table H-1, case 4)."""
        P = 12.0
        solution = cantilever(PointLoad("arm", "A", 1j * P))
        near(across(solution, "w"), P * X**2 * (3 * L - X) / (6 * EI))
        near(across(solution, "phi"), P * X * (2 * L - X) / (2 * EI))
        near(across(solution, "M"), P * (L - X))
        near(across(solution, "V"), np.full(11, -P))

    def test_moment_at_the_end(self):
        """w = M0 x^2/(2 EI) (Gere, Table H-1, case 6)."""
        solution = cantilever(PointLoad("arm", "A", moment=3.0))
        near(across(solution, "w"), 3.0 * X**2 / (2 * EI))

    def test_pull_at_the_end(self):
        solution = cantilever(PointLoad("arm", "A", 700.0))
        near(across(solution, "u"), 700.0 * X / EA)
        near(across(solution, "N"), np.full(11, 700.0))

    def test_uniform_load(self):
        """w = q x^2 (6 L^2 - 4 L x + x^2)/(24 EI) (Gere, Table H-1, case 1)."""
        q = -35.0
        solution = cantilever(LineLoad("arm", 0, 1j * q, 1j * q))
        near(across(solution, "w"), q * X**2 * (6 * L**2 - 4 * L * X + X**2) / (24 * EI))

    def test_load_falling_to_zero_at_the_end(self):
        """w = q0 x^2 (10 L^3 - 10 L^2 x + 5 L x^2 - x^3)/(120 L EI) (Gere, Table H-1, case 8)."""
        q0 = 60.0
        solution = cantilever(LineLoad("arm", 0, 1j * q0, 0.0))
        expected = q0 * X**2 * (10 * L**3 - 10 * L**2 * X + 5 * L * X**2 - X**3) / (120 * L * EI)
        near(across(solution, "w"), expected)

    @pytest.mark.parametrize("angle", [0.0, 1.1])
    def test_rotating_rod(self, angle):
        """u = rho A w^2/(2 EA) (L^2 x - x^3/3); w = 0: N' = -m w^2 x and Hooke's law, integrated."""
        m, w = 1.7, 40.0
        solution = cantilever(mass_per_length=m, angle=angle, rate=w)
        near(across(solution, "u"), m * w**2 / (2 * EA) * (L**2 * X - X**3 / 3))
        near(across(solution, "N"), m * w**2 / 2 * (L**2 - X**2))
        assert np.abs(across(solution, "w")).max() < 1e-15

    def test_angular_acceleration(self):
        """A load -m eps x: w = -m eps (20 L^3 x^2 - 10 L^2 x^3 + x^5)/(120 EI) (integrated four times)."""
        m, eps = 1.7, 300.0
        solution = cantilever(mass_per_length=m, rate2=eps)
        near(across(solution, "w"), -m * eps * (20 * L**3 * X**2 - 10 * L**2 * X**3 + X**5) / (120 * EI))

    def test_hanging_weight(self):
        """Hanging: u = m g (2 L x - x^2)/(2 EA) (Gere, section 2.3)."""
        solution = cantilever(mass_per_length=2.0, angle=-np.pi / 2, gravity=-9.81j)
        near(across(solution, "u"), 2.0 * 9.81 * (2 * L * X - X**2) / (2 * EA))

    def test_beam_drawn_towards_the_clamp(self):
        """The same arm with x' the other way: fields mirror."""
        loads = (PointLoad("arm", "A", 30 + 12j, 0.7),)
        one = cantilever(*loads, mass_per_length=1.0, rate=9.0, rate2=50.0)
        other = cantilever(*loads, mass_per_length=1.0, rate=9.0, rate2=50.0, backward=True)
        for field, sign in (("N", 1), ("V", 1), ("M", -1), ("u", -1), ("w", -1), ("phi", 1)):
            near(across(other, field), sign * across(one, field)[::-1])


class TestSimpleBeam:
    def test_uniform_load(self):
        """w = q x (L^3 - 2 L x^2 + x^3)/(24 EI) (Gere, Table H-2, case 1)."""
        q = -50.0
        solution = simple_beam(LineLoad("beam", 0, 1j * q, 1j * q))
        near(across(solution, "chord"), q * X * (L**3 - 2 * L * X**2 + X**3) / (24 * EI))
        near(across(solution, "w"), q * X * (L**3 - 2 * L * X**2 + X**3) / (24 * EI))

    def test_triangular_load(self):
        """w = q0 x (7 L^4 - 10 L^2 x^2 + 3 x^4)/(360 L EI), load rising to B (Gere, Table H-2, case 11)."""
        q0 = 90.0
        solution = simple_beam(LineLoad("beam", 0, 0.0, 1j * q0))
        near(across(solution, "w"), q0 * X * (7 * L**4 - 10 * L**2 * X**2 + 3 * X**4) / (360 * L * EI))

    def test_trapezoidal_load(self):
        """Slope at A (8 qa + 7 qb) L^3/(360 EI), moment at mid-span (qa + qb) L^2/16 (Roark, case 2e)."""
        qa, qb = 40.0, -110.0
        solution = simple_beam(LineLoad("beam", 0, 1j * qa, 1j * qb))
        assert across(solution, "phi")[0] == pytest.approx((8 * qa + 7 * qb) * L**3 / (360 * EI), rel=1e-12)
        assert across(solution, "M")[5] == pytest.approx(-(qa + qb) * L**2 / 16, rel=1e-12)
        assert across(solution, "phi")[-1] == pytest.approx(-(7 * qa + 8 * qb) * L**3 / (360 * EI), rel=1e-12)

    def test_couple_at_an_end(self):
        """w = M0 x (2 L^2 - 3 L x + x^2)/(6 L EI) for a couple at A (Gere, Table H-2, case 7)."""
        M0 = 8.0
        solution = simple_beam(PointLoad("beam", "A", moment=M0))
        near(across(solution, "w"), M0 * X * (2 * L**2 - 3 * L * X + X**2) / (6 * L * EI))

    def test_axial_load_is_carried_by_the_hinge(self):
        """N' = -q_x: a uniform axial load towards B is carried at A."""
        q = 200.0
        solution = simple_beam(LineLoad("beam", 0, q, q))
        near(across(solution, "N"), q * (L - X))
        near(across(solution, "u"), q * (L * X - X**2 / 2) / EA)


class TestDifferentialEquations:
    """N' = -q_x, V' = q_y, M' = V, u' = N/EA + strain, w' = phi - V/kGA, phi' = M/EI: coefficient by coefficient."""

    @pytest.mark.parametrize("name", ALL)
    def test_every_field_is_the_derivative_of_the_next(self, name):
        solution = solved(ALL[name]())
        beam, width = solution.division.beam, solution.division.width
        axial, bending, shear, strain = (
            np.array([getattr(section, name) for section in solution.sections])[beam, None]
            for name in ("EA", "EI", "kGA", "strain")
        )
        load = coefficients(solution, "q_x") + 1j * coefficients(solution, "q_y")
        stretch = solution.N / axial
        stretch[0] += strain
        turned = solution.phi.copy()
        turned[: len(solution.V)] -= solution.V / shear

        def slope(values):
            return values[1:] * np.arange(1, len(values))[:, None, None] / (solution.length[beam] * width)

        pairs = (("N", -load.real), ("V", load.imag), ("M", solution.V), ("w", turned))
        pairs += (("u", stretch), ("phi", solution.M / bending))
        for field, expected in pairs:
            got = slope(getattr(solution, field))
            scale = np.abs(expected).max()
            assert got.shape[0] <= len(expected)
            np.testing.assert_allclose(got, expected[: len(got)], rtol=0, atol=1e-12 * scale, err_msg=field)
            np.testing.assert_allclose(expected[len(got) :], 0, atol=1e-12 * scale)


class TestJointsOfBentLinks:
    @pytest.mark.parametrize("name", ALL)
    def test_pins_stay_closed(self, name):
        solution = solved(ALL[name]())
        spots = {}
        for link in solution.motion.mechanism.links[1:]:
            for point in link.points:
                spots.setdefault(point, []).append(displacement_of(solution, link.name, point))
        scale = max(np.abs(place).max() for places in spots.values() for place in places)
        for point, places in spots.items():
            for place in places:
                np.testing.assert_allclose(place, places[0], rtol=0, atol=1e-13 * scale, err_msg=point)
            if point in solution.motion.mechanism.links[0].points:
                np.testing.assert_allclose(places[0], 0, atol=1e-13 * scale)

    @pytest.mark.parametrize("name", ["RRR", "RRP", "six-bar", "triad"])
    def test_hinges_carry_only_applied_moments(self, name):
        solution = solved({"RRR": four_bar, "RRP": slider_crank}.get(name, ALL[name])(loads=()))
        M = sample(solution, "M", [0.0, 1.0])
        scale = np.abs(M).max()
        for number, (at, beam) in enumerate(solution.motion.mechanism.beams):
            link = solution.motion.mechanism.links[at]
            if len(link.beams) > 1 or link.name == "crank":
                continue
            for end, point in enumerate((beam.start, beam.end)):
                if all(lump.point != point for lump in link.lumps):
                    np.testing.assert_allclose(M[number, :, end], 0, atol=1e-13 * scale)

    def test_welded_beams_keep_their_angle(self):
        """The two beams of the ternary link rotate equally at P, and balance the rod and the lump."""
        solution = solved(six_bar())
        at = solution.motion.mechanism.index["coupler"]
        one, other = (k for k, (owner, _) in enumerate(solution.motion.mechanism.beams) if owner == at)
        turned = sample(solution, "phi", [1.0])
        np.testing.assert_allclose(turned[one], turned[other], rtol=1e-12)

    def test_rigid_mechanism_does_not_move(self):
        case = four_bar()
        solution = deflection(motion(case.mechanism, case.drive, case.rate), [RIGID] * 3)
        for field in ("u", "w", "phi"):
            assert np.abs(getattr(solution, field)).max() == 0.0
        assert np.abs(solution.M).max() > 1


class TestExtremes:
    @pytest.mark.parametrize("name", in_tiers([name for name in ALL if name != "RPR, elastic lever"], 4, 4))
    @pytest.mark.parametrize("field", [*PRIMARY, "chord"])
    def test_equal_roots_of_the_derivative(self, name, field):
        """Reference: all real roots by companion matrices, and a fine grid."""
        solution = solved(ALL[name](loads=()) if name == "triad" else ALL[name]())
        found = extremes(solution, [field])[field]
        values = coefficients(solution, "w" if field == "chord" else field)
        if field == "chord":
            values = np.concatenate([0 * values[:1], -values[2:].sum(0)[None], values[2:]])
        grid = np.abs(sample(solution, field, np.linspace(0, 1, 2001)))
        scale = grid.max()
        for beam in range(values.shape[1]):
            for position in range(0, values.shape[2], 5):
                polynomial = np.polynomial.Polynomial(values[:, beam, position])
                roots = polynomial.deriv().roots()
                inside = roots[(abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)].real
                best = np.abs(polynomial(np.array([0.0, 1.0, *inside]))).max()
                assert abs(found.value[beam, position]) == pytest.approx(best, rel=1e-12, abs=1e-14 * scale)
                assert abs(found.value[beam, position]) >= grid[beam, position].max() - 1e-14 * scale
                there = polynomial(found.xi[beam, position])
                assert found.value[beam, position] == pytest.approx(there, rel=1e-13, abs=1e-15 * scale)

    @pytest.mark.parametrize("field", PRIMARY)
    def test_of_a_beam_with_a_block_on_it(self, field):
        """A fine grid misses a smooth extreme by h^2/8 of the curvature, a kink by h/2 of the slope change."""
        solution = solved(elastic_guide())
        grid = np.abs(sample(solution, field, np.linspace(0, 1, 4001))).max(axis=2)
        found = np.abs(extremes(solution, [field])[field].value)
        assert (found >= grid * (1 - 1e-12)).all()
        np.testing.assert_allclose(found, grid, rtol=2e-3)

    def test_keep_their_sign(self):
        down = cantilever(PointLoad("arm", "A", -2j))
        assert extremes(down, ["w"])["w"].value[0, 0] == pytest.approx(-2 * L**3 / (3 * EI))
        assert extremes(down, ["w"])["w"].xi[0, 0] == 1.0

    def test_of_the_triangular_load(self):
        """Largest moment q0 L^2/(9 sqrt 3) at L/sqrt 3, largest deflection at 0.51933 L (Gere, Table H-2, case 11)."""
        q0 = 90.0
        found = extremes(simple_beam(LineLoad("beam", 0, 0.0, -1j * q0)), ["M", "w", "V"])
        assert found["M"].value[0, 0] == pytest.approx(q0 * L**2 / (9 * np.sqrt(3)), rel=1e-14)
        assert found["M"].xi[0, 0] == pytest.approx(1 / np.sqrt(3), rel=1e-14)
        # 7 - 30 s^2 + 15 s^4 = 0
        assert found["w"].xi[0, 0] == pytest.approx(np.sqrt(1 - np.sqrt(8 / 15)), rel=1e-14)
        assert found["V"].value[0, 0] == pytest.approx(-q0 * L / 3, rel=1e-13)

    def test_are_nan_at_singular_positions(self):
        case = four_bar(0.25, 0.5, 0.25, 0.5)
        solution = deflection(motion(case.mechanism, [0.5, np.pi], 1.0), case.sections)
        found = extremes(solution)
        assert np.isnan(found["w"].value[1, 1])
        assert np.isfinite(found["w"].value[:, 0]).all()


class TestSampling:
    def test_unknown_stations_and_fields_are_errors(self):
        solution = solved(steel_four_bar(4))
        for stations in ([0.0, 1.5], [-1e-9], [np.nan]):
            with pytest.raises(ValueError, match="expected from 0 to 1"):
                sample(solution, "w", stations)
        with pytest.raises(ValueError, match=r'no field "W".*chord'):
            sample(solution, "W", [0.5])
        with pytest.raises(ValueError, match=r'no field "load".*q_x'):
            extremes(solution, ["w", "load"])
        with pytest.raises(ValueError, match=r'"mises" is not a polynomial: .*left'):
            coefficients(solution, "mises")

    def test_shape_and_powers(self):
        solution = solved(steel_four_bar(4))
        assert sample(solution, "w", STATIONS).shape == (3, 4, 11)
        w = solution.w[:, 1, 2]
        expected = sum(w[k] * STATIONS**k for k in range(len(w)))
        np.testing.assert_allclose(sample(solution, "w", STATIONS)[1, 2], expected, rtol=1e-12, atol=1e-18)

    def test_the_chord_passes_through_the_displaced_ends(self):
        solution = solved(four_bar())
        chord = sample(solution, "chord", [0.0, 0.3, 1.0])
        w = sample(solution, "w", [0.0, 0.3, 1.0])
        np.testing.assert_allclose(chord[..., [0, 2]], 0, atol=1e-17)
        np.testing.assert_allclose(chord[..., 1], w[..., 1] - 0.7 * w[..., 0] - 0.3 * w[..., 2], rtol=1e-11)


class TestMistakes:
    def test_a_ring_of_rigid_beams_is_an_error(self):
        case = ring()
        with pytest.raises(MechanismError, match='link "coupler": its beams form a ring and are all rigid'):
            deflection(motion(case.mechanism, case.drive), [RIGID] * len(case.sections))

    def test_sections_for_another_number_of_beams(self):
        case = four_bar()
        with pytest.raises(ValueError, match="2 sections for 3 beams"):
            deflection(motion(case.mechanism, case.drive), case.sections[:2])

    def test_disconnected_beams_of_a_link_are_an_error(self):
        case = six_bar()
        link = case.mechanism.links[case.mechanism.index["coupler"]]
        apart = Link("coupler", link.points | {"S": 0.1j, "T": 0.2j}, (*link.beams, Beam("S", "T")))
        mechanism = with_link(case.mechanism, apart)
        with pytest.raises(MechanismError, match='link "coupler": its beams are not connected'):
            deflection(motion(mechanism, case.drive), [RIGID] * len(mechanism.beams))
