"""Stresses, buckling loads, output errors and exceedances agree with textbooks.

Gere is Gere, Mechanics of Materials, 6th edition.
"""

import math

import mpmath
import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
from mechanisms import ALL, cantilever, motion_of, steel_four_bar, still, supported
from msgspec.structs import replace
from scipy.integrate import quad

from elastic import (
    RIGID,
    Section,
    box,
    circle,
    deflection,
    displacement_of,
    extremes,
    i_section,
    rectangle,
    sample,
    section_of,
    tapered,
    tube,
)
from elastic.assessment import (
    VALIDITY_RANGES,
    angle_error,
    euler_loads,
    euler_ratio,
    exceedances,
    least_axial_force,
    over_cycle,
    path_deviation,
    rms,
    safety_factor,
    slenderness,
    stress_range,
    web_stress,
)
from elastic.beams.cross_sections import channel, t_section
from rigid import Beam, LineLoad, Link, Mechanism, PinDrive, PointLoad, motion, reactions
from rigid.constants import mass_moments
from rigid.kinetostatics.loads import beam_loads

E = 210e9


def rounded(y, half_depth, half_width, radius):
    """Return half the width of a rectangle with rounded corners at a height."""
    if y > half_depth:
        return 0.0
    inside = mpmath.mpf(y) - (half_depth - radius)
    return half_width - radius + mpmath.sqrt(max(0, radius**2 - max(inside, 0) ** 2))


def filleted(y):
    """Return half the width of an I with a web of 3 mm and fillets of 5 mm below its flange at 11 mm."""
    inside = max(mpmath.mpf(y) - 0.006, 0)
    return 0.0015 + 0.005 - mpmath.sqrt(0.005**2 - inside**2)


class TestShapes:
    @pytest.mark.parametrize(
        ("shape", "half_width"),
        [
            (rectangle(0.03, 0.02), lambda y: 0.01),
            (circle(0.03), lambda y: mpmath.sqrt(0.015**2 - y**2)),
            (tube(0.03, 0.022), lambda y: mpmath.sqrt(0.015**2 - y**2) - mpmath.sqrt(max(0, 0.011**2 - y**2))),
            (box(0.03, 0.02, 0.004), lambda y: 0.004 if y < 0.011 else 0.01),
            (box(0.03, 0.02, 0.004, 0.006), lambda y: rounded(y, 0.015, 0.01, 0.006) - rounded(y, 0.011, 0.006, 0.002)),
            (i_section(0.03, 0.02, 0.003, 0.004), lambda y: 0.0015 if y < 0.011 else 0.01),
            (i_section(0.03, 0.02, 0.003, 0.004, 0.005), lambda y: filleted(y) if y < 0.011 else 0.01),
        ],
    )
    def test_integrals_over_the_section(self, shape, half_width):
        """A, I and the shear stress V Q/(I b) at the axis follow from the width alone."""
        edges = [0, 0.006, 0.009, 0.011, 0.015]
        area = 4 * mpmath.quad(half_width, edges)
        first = 2 * mpmath.quad(lambda y: y * half_width(y), edges)
        inertia = 4 * mpmath.quad(lambda y: y**2 * half_width(y), edges)
        assert shape.area == pytest.approx(float(area), rel=1e-9)
        assert shape.inertia == pytest.approx(float(inertia), rel=1e-9)
        assert shape.peak_shear == pytest.approx(float(first * area / (inertia * 2 * half_width(0))), rel=1e-9)
        assert shape.fibre == 0.015

    @pytest.mark.parametrize(
        ("shape", "printed"), [(rectangle(2, 1), 0.850), (circle(1), 0.886), (tube(1, 0.99999), 0.531)]
    )
    def test_cowper(self, shape, printed):
        """Cowper (1966), nu = 0.3; a thin tube has 2 (1 + nu)/(4 + 3 nu)."""
        assert shape.shear_coefficient(0.3) == pytest.approx(printed, abs=5e-4)

    @pytest.mark.parametrize("webs", [1, 2])
    @pytest.mark.parametrize(("depth", "width", "thicker"), [(1.0, 0.5, 2), (1.0, 1.0, 1), (2.0, 0.7, 3)])
    def test_thin_walls_have_the_energy_of_their_shear_flow(self, depth, width, thicker, webs):
        """k A = I^2/integral of (Q/b)^2 b along the walls of an I or a box (two webs), without Poisson's effect."""
        web = 1e-7
        flange = web * (thicker if webs == 1 else 1)
        inertia = webs * web * depth**3 / 12 + 2 * width * flange * (depth / 2) ** 2
        area = webs * depth * web + 2 * width * flange
        at_corner = flange * depth / 2 * width / webs  # Q at the start of each web
        in_web = quad(lambda y: (at_corner + web / 2 * (depth**2 / 4 - y**2)) ** 2 / web, -depth / 2, depth / 2)[0]
        in_flange = quad(lambda way: (depth / 2 * way) ** 2 * flange, 0, width / 2)[0]
        shape = i_section(depth + flange, width, web, flange) if webs == 1 else box(depth + web, width + web, web)
        flow = webs * in_web + 4 * in_flange
        assert shape.shear_coefficient(0.0) == pytest.approx(inertia**2 / area / flow, rel=1e-5)

    @pytest.mark.parametrize("call", [lambda: box(0.03, 0.02, 0.011), lambda: box(0.03, 0.02, 0.002, 0.011),
                                      lambda: i_section(0.03, 0.02, 0.003, 0.016),
                                      lambda: i_section(0.03, 0.02, 0.003, 0.01, 0.006)])  # fmt: skip
    def test_walls_too_thick_for_the_section(self, call):
        with pytest.raises(ValueError, match="needs"):
            call()

    def test_tube_with_a_negative_wall(self):
        with pytest.raises(ValueError, match=r"0\.04 m is not between 0 and the outer one of 0\.03 m"):
            tube(0.03, 0.04)

    @pytest.mark.parametrize(
        ("shape", "start", "end"),
        [
            (rectangle, (0.02, 0.01), (0.008, 0.006)),
            (circle, (0.03,), (0.01,)),
            (tube, (0.03, 0.02), (0.02, 0.018)),
            (box, (0.03, 0.02, 0.002, 0.004), (0.02, 0.02, 0.002, 0.004)),
            (i_section, (0.03, 0.02, 0.002, 0.003), (0.02, 0.015, 0.002, 0.003)),
        ],
    )
    def test_a_taper_equals_the_section_at_each_station(self, shape, start, end):
        taper, mass = tapered(shape, start, end, 0.3)
        first = shape(*start)
        for xi in (0.0, 0.31, 0.5, 1.0):
            there = shape(*(a + xi * (b - a) for a, b in zip(start, end, strict=True)))
            for values, ratio in (
                (taper.EA, there.area / first.area),
                (mass, there.area / first.area),
                (taper.EI, there.inertia / first.inertia),
                (taper.fibre, there.fibre / first.fibre),
                (taper.peak_shear, there.peak_shear / first.peak_shear),
                (taper.kGA, there.shear_coefficient(0.3) * there.area / first.shear_coefficient(0.3) / first.area),
            ):
                assert np.polynomial.polynomial.polyval(xi, values) == pytest.approx(ratio, rel=1e-7)


class TestTaperedMass:
    link = Link("arm", {"A": 0.2 + 0.1j, "B": 0.7 - 0.3j}, (Beam("A", "B", 3.0, (1.0, -0.4, -0.3)),))

    def test_moments(self):
        """The reference is quadrature over the beam."""
        start, way = 0.2 + 0.1j, 0.5 - 0.4j
        mass, first, second = mass_moments(self.link)

        def integral(weight):
            value = mpmath.quad(lambda s: (1 - 0.4 * s - 0.3 * s**2) * weight(start + s * way), [0, 1])
            return complex(3.0 * abs(way) * value)

        assert mass == pytest.approx(integral(lambda p: 1).real, rel=1e-14)
        assert first == pytest.approx(integral(lambda p: p), rel=1e-14)
        assert second == pytest.approx(integral(lambda p: abs(p) ** 2).real, rel=1e-14)

    def test_loads_balance_with_the_reactions(self):
        """The sum of the loads along the beam is the pin force, by two paths of the program and by hand."""
        mechanism = Mechanism(
            (Link("ground", {"A": 0.0}), replace(self.link, points={"A": 0.0, "B": 0.6})), (PinDrive("arm", "A"),),
            {"A": 0, "B": 0.6}, gravity=-9.81j,
        )  # fmt: skip
        course = motion(mechanism, [0.4], 7.0, -3.0)
        load = beam_loads(course)
        assert load.shape[0] == 4
        total = 0.6 * sum(value[0, 0] / (k + 1) for k, value in enumerate(load))
        held = -reactions(course).force[0][0] * np.exp(-0.4j)
        assert total == pytest.approx(held, rel=1e-13)
        mass, first = 3.0 * 0.6 * (1 - 0.2 - 0.1), 3.0 * 0.36 * (1 / 2 - 0.4 / 3 - 0.3 / 4)
        expected = mass * -9.81j * np.exp(-0.4j) - (-3j - 49) * first
        assert total == pytest.approx(expected, rel=1e-13)

    def test_rotating_cone(self):
        """N at x: rho omega^2 times the integral of A s from x to the end."""
        taper, mass = tapered(circle, (0.03,), (0.012,))
        density, omega, length = 7850.0, 200.0, 0.5
        section = section_of(circle(0.03), E, taper=taper)
        link = Link("arm", {"A": 0.0, "B": length}, (Beam("A", "B", density * section.area, mass),))
        mechanism = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("arm", "A"),), {"A": 0, "B": length})
        solved = deflection(motion(mechanism, [0.0], omega), [section])

        def area(x):
            return mpmath.pi / 4 * (0.03 - 0.018 * x / length) ** 2

        def force(x):
            return density * omega**2 * mpmath.quad(lambda s: area(s) * s, [x, length])

        pulled = [float(force(x)) for x in (0, 0.2 * length, length / 2)]
        axial = [float(force(x) / area(x)) for x in (0, 0.2 * length, length / 2)]
        longer = float(mpmath.quad(lambda x: force(x) / (E * area(x)), [0, length]))
        assert sample(solved, "axial", [0, 0.2, 0.5])[0, 0] == pytest.approx(axial, rel=1e-12)
        assert solved.N[0, 0, 0] == pytest.approx(pulled[0], rel=1e-12)
        assert displacement_of(solved, "arm", "B")[0] == pytest.approx(longer, rel=1e-12)


def bent(section, *loads, length=0.6, **more):
    return deflection(still(cantilever({"A": 0, "B": length}, loads=loads, **more)), [section])


class TestStress:
    section = section_of(rectangle(0.02, 0.01), E, yield_stress=300e6)

    def test_the_top_of_a_loaded_cantilever_is_in_tension(self):
        """sigma = P L c/I at the root, plus H/A: Gere, sections 5.5 and 5.12; y' is up, so the left fibre is on top."""
        solved = bent(self.section, PointLoad("beam", "B", 800 - 50j))
        bending, pull = 50 * 0.6 / (0.01 * 0.02**2 / 6), 800 / 2e-4
        assert sample(solved, "left", [0.0])[0, 0, 0] == pytest.approx(pull + bending, rel=1e-13)
        assert sample(solved, "right", [0.0])[0, 0, 0] == pytest.approx(pull - bending, rel=1e-13)
        assert sample(solved, "axial", [0.5])[0, 0, 0] == pytest.approx(pull, rel=1e-13)
        # the tip has no moment, and its axis has shear
        shear = 1.5 * 50 / 2e-4
        assert sample(solved, "shear", [1.0])[0, 0, 0] == pytest.approx(shear, rel=1e-13)
        assert sample(solved, "mises", [1.0])[0, 0, 0] == pytest.approx(
            math.hypot(pull, math.sqrt(3) * shear), rel=1e-13
        )
        assert sample(solved, "mises", [0.0])[0, 0, 0] == pytest.approx(pull + bending, rel=1e-13)

    def test_the_safety_factor_is_yield_stress_by_stress(self):
        solved = bent(self.section, PointLoad("beam", "B", -50j))
        loaded, unloaded = (extremes(each, ["mises"])["mises"].value for each in (solved, bent(self.section)))
        expected = 300e6 / (50 * 0.6 / (0.01 * 0.02**2 / 6))
        assert safety_factor([self.section], loaded)[0, 0] == pytest.approx(expected, rel=1e-13)
        assert safety_factor([self.section], unloaded)[0, 0] == math.inf

    def test_largest_stress_of_a_tapered_cantilever(self):
        """A cone twice as thick at the root, load at the tip: 128 P L/(27 pi d^3) at mid-span (Gere, example 5-9)."""
        taper, _ = tapered(circle, (0.04,), (0.02,))
        solved = bent(section_of(circle(0.04), E, taper=taper), PointLoad("beam", "B", -50j))
        found = extremes(solved, ["normal"])["normal"]
        assert abs(found.value[0, 0]) == pytest.approx(128 * 50 * 0.6 / (27 * math.pi * 0.02**3), rel=1e-9)
        # the diameter there is 1.5 times that of the tip
        assert found.xi[0, 0] == pytest.approx(0.5, abs=1e-5)

    def test_interior_extreme_with_axial_force(self):
        """Tension H and load q on two supports: H/A + q l^2/8 c/I in the middle."""
        loads = (LineLoad("beam", 0, -900j, -900j), PointLoad("beam", "B", 5000.0))
        solved = deflection(still(supported({"A": 0, "B": 0.6}, loads=loads)), [self.section])
        found = extremes(solved, ["normal"])["normal"]
        assert found.value[0, 0] == pytest.approx(5000 / 2e-4 + 900 * 0.36 / 8 / (0.01 * 0.02**2 / 6), rel=1e-13)
        assert found.xi[0, 0] == pytest.approx(0.5, abs=1e-12)

    @pytest.mark.parametrize("end", [0.03, 0.02])
    def test_a_stubby_beam_has_its_largest_stress_at_the_axis(self, end):
        """A third as long as deep: sqrt(3) 1.5 P/(b h) at the thinnest section exceeds P L 6/(b h^2)."""
        taper, _ = tapered(rectangle, (0.03, 0.01), (end, 0.01))
        shape = rectangle(0.03, 0.01)
        section = section_of(shape, E, taper=taper if end < 0.03 else None)
        found = extremes(bent(section, PointLoad("beam", "B", 200 - 5000j), length=0.01), ["mises"])["mises"]
        expected = math.hypot(200, math.sqrt(3) * 1.5 * 5000) / (0.01 * end)
        assert found.value[0, 0] == pytest.approx(expected, rel=1e-9)
        assert end == 0.03 or found.xi[0, 0] == 1.0

    @pytest.mark.parametrize("name", ["RRR", "RRP", "six-bar", "RPR, elastic lever"])
    @pytest.mark.parametrize("kind", ["axial", "left", "normal", "shear", "mises"])
    def test_extremes_are_close_bounds_of_samples(self, name, kind):
        """A fine grid's maximum is never above the extreme, and below it only by the effect of its spacing."""
        case = ALL[name]()
        sections = [section_of(rectangle(0.012, 0.008), E) for _ in case.sections]
        solved = deflection(motion_of(case), sections)
        found = extremes(solved, [kind])[kind]
        grid = np.linspace(0, 1, 2001)
        parts = ("left", "right") if kind == "normal" else (kind,)
        sampled = np.max([np.abs(sample(solved, part, grid)).max(axis=-1) for part in parts], axis=0)
        largest = np.abs(found.value)
        assert (largest >= sampled * (1 - 1e-12) - 1e-6).all()
        assert (largest <= sampled * (1 + 5e-3) + 1e-6).all()
        at = [
            np.max([np.abs(sample(solved, part, [found.xi[beam, k]])[beam, k, 0]) for part in parts])
            for beam in range(len(sections)) for k in (0, 7)
        ]  # fmt: skip
        np.testing.assert_allclose(at, largest[:, [0, 7]].ravel(), rtol=1e-9)

    def test_tapered_extremes_are_close_bounds_of_samples(self):
        taper, mass = tapered(tube, (0.03, 0.02), (0.018, 0.014))
        section = section_of(tube(0.03, 0.02), E, taper=taper)
        link = Link("beam", {"A": 0.0, "B": 0.6}, (Beam("A", "B", 3.0, mass),))
        mechanism = Mechanism(
            (Link("ground", {"A": 0.0}), link), (PinDrive("beam", "A"),), {"A": 0, "B": 0.6},
            loads=(PointLoad("beam", "B", 400 - 90j),),
        )  # fmt: skip
        solved = deflection(motion(mechanism, np.linspace(0, 6, 9), 60.0, 900.0), [section])
        for kind in ("left", "shear", "mises"):
            sampled = np.abs(sample(solved, kind, np.linspace(0, 1, 4001))).max(axis=-1)
            largest = np.abs(extremes(solved, [kind])[kind].value)
            np.testing.assert_allclose(largest, sampled, rtol=1e-5)

    def test_stress_range_of_a_rotating_arm(self):
        """The weight bends to both sides: twice m g l^2/2 c/I at the root; the centrifugal part is constant."""
        mechanism = cantilever({"A": 0, "B": 0.6}, 1.5, gravity=-9.81j)
        solved = deflection(motion(mechanism, np.arange(8) * np.pi / 4, 30.0), [self.section])
        expected = 2 * 1.5 * 9.81 * 0.18 / (0.01 * 0.02**2 / 6)
        swing = stress_range(solved, [0.0, 1.0])
        # the axial part of the weight alternates too, a quarter turn later
        assert swing[:, 0, 0] == pytest.approx([expected] * 2, rel=1e-12)
        assert swing[:, 0, 1] == pytest.approx([0, 0], abs=1e-6)

    def test_unknown_dimensions_are_nan(self):
        solved = bent(Section(1e6, 1e3), PointLoad("beam", "B", -50j))
        stress = extremes(solved, ["mises"])["mises"].value
        assert np.isnan(stress).all()
        assert np.isnan(safety_factor(solved.sections, stress)).all()


class TestCycle:
    def test_a_peak_keeps_sign_place_and_instant(self):
        case = steel_four_bar(36)
        solved = deflection(motion(case.mechanism, case.drive, case.rate), case.sections)
        found = extremes(solved, ["M"])["M"]
        peak = over_cycle(found)
        for beam in range(3):
            k = int(np.argmax(np.abs(found.value[beam])))
            assert (peak.value[beam], peak.position[beam], peak.xi[beam]) == (
                found.value[beam, k], k, found.xi[beam, k]
            )  # fmt: skip

    def test_singular_positions_are_ignored(self):
        values = np.array([[1.0, np.nan, -3.0], [np.nan] * 3])
        assert over_cycle(values).value[0] == -3.0
        assert over_cycle(values).position[0] == 2
        assert np.isnan(over_cycle(values).value[1])
        assert rms(values) == pytest.approx([math.sqrt(5), np.nan], nan_ok=True)


class TestBuckling:
    section = section_of(rectangle(0.01, 0.02), E)

    def pressed(self, load, section=None, **more):
        chosen = section or self.section
        return deflection(
            still(supported({"A": 0, "B": 0.8}, loads=(PointLoad("beam", "B", -load),), **more)), [chosen]
        )

    def test_euler(self):
        """pi^2 EI/l^2: Gere, equation 11-12."""
        critical = math.pi**2 * E * 0.02 * 0.01**3 / 12 / 0.8**2
        solved = self.pressed(0.3 * critical)
        assert euler_loads(solved)[0, 0] == pytest.approx(critical, rel=1e-13)
        assert euler_ratio(solved)[0, 0] == pytest.approx(0.3, rel=1e-12)
        assert euler_ratio(self.pressed(-0.3 * critical))[0, 0] == 0.0

    def test_column_of_two_sections(self):
        """Halves of rigidity EI and 3 EI, pinned at both ends: k cot(k l/2) of the two sum to zero."""
        thick = replace(self.section, EI=3 * self.section.EI)
        points = {"A": 0, "M": 0.4, "B": 0.8}
        bent = deflection(still(supported(points, loads=(PointLoad("beam", "B", -1.0),))), [self.section, thick])

        def open_by(load):
            numbers = [math.sqrt(load / section.EI) for section in (self.section, thick)]
            return sum(k / math.tan(0.4 * k) for k in numbers)

        thin = math.pi**2 * self.section.EI / 0.64
        expected = scipy.optimize.brentq(open_by, 1.05 * thin, 2.5 * thin, rtol=1e-12)
        assert euler_loads(bent)[:, 0] == pytest.approx(expected, rel=1e-4)

    def test_rigid_beams_do_not_buckle(self):
        assert euler_ratio(self.pressed(1e9, RIGID))[0, 0] == 0.0

    def test_smallest_force_inside_a_beam(self):
        """Axial loads away from the middle on both sides put the smallest force in the middle."""
        mechanism = supported(
            {"A": 0, "B": 2.0}, loads=(LineLoad("beam", 0, 300.0, -300.0), PointLoad("beam", "B", -40.0))
        )
        solved = deflection(still(mechanism), [self.section])
        # N(x) = -40 + integral of 300 (1 - x) from x to 2; smallest where the load changes sign
        assert least_axial_force(solved)[0, 0] == pytest.approx(-40 - 300 / 2, rel=1e-13)

    def test_tapered_column(self):
        """M'' + P M/EI = 0 by Runge-Kutta, with P such that M = 0 at the far end."""
        taper, _ = tapered(rectangle, (0.02, 0.01), (0.01, 0.01))
        section = section_of(rectangle(0.02, 0.01), E, taper=taper)
        EI = E * 0.01 * 0.02**3 / 12

        def far_end(load):
            def rates(x, y):
                return [y[1], -load * y[0] / (EI * (1 - 0.5 * x / 0.8) ** 3)]

            return scipy.integrate.solve_ivp(rates, (0, 0.8), [0, 1], rtol=1e-11, atol=1e-14).y[0, -1]

        prismatic = math.pi**2 * EI / 0.64
        expected = scipy.optimize.brentq(far_end, 0.2 * prismatic, 0.7 * prismatic, rtol=1e-12)
        assert euler_loads(self.pressed(1.0, section))[0, 0] == pytest.approx(expected, rel=1e-9)

    def test_slenderness_is_length_by_least_radius_of_gyration(self):
        assert slenderness(self.pressed(1.0))[0, 0] == pytest.approx(0.8 / (0.01 / math.sqrt(12)), rel=1e-13)
        taper, _ = tapered(circle, (0.02,), (0.01,))
        cone = self.pressed(1.0, section_of(circle(0.02), E, taper=taper))
        assert slenderness(cone)[0, 0] == pytest.approx(0.8 / (0.02 / 4), rel=1e-9)
        taper, _ = tapered(circle, (0.01,), (0.02,))
        other_way = self.pressed(1.0, section_of(circle(0.01), E, taper=taper))
        assert slenderness(other_way)[0, 0] == pytest.approx(0.8 / (0.02 / 4), rel=1e-9)
        assert np.isnan(slenderness(self.pressed(1.0, RIGID))[0, 0])


class TestAccuracy:
    def test_accelerated_arm(self):
        """Counter-clockwise: the tip moves outwards by m w^2 l^3/(3 EA) and lags during acceleration."""
        EA, EI, mass, length, rate, rate2 = 2e5, 30.0, 1.5, 0.6, 40.0, 500.0
        mechanism = cantilever({"A": 0, "B": length}, mass)
        solved = deflection(motion(mechanism, np.linspace(0, 5, 7), rate, rate2), [Section(EA, EI)])
        found = path_deviation(solved, "beam", "B")
        np.testing.assert_allclose(found.normal, -mass * rate**2 * length**3 / (3 * EA), rtol=1e-12)
        # a load -m eps x causes a deflection of 11 m eps l^5/(120 EI) and a rotation of m eps l^4/(8 EI)
        np.testing.assert_allclose(found.along, -11 * mass * rate2 * length**5 / (120 * EI), rtol=1e-12)
        np.testing.assert_allclose(angle_error(solved, "beam", "B"), -mass * rate2 * length**4 / (8 * EI), rtol=1e-12)
        np.testing.assert_allclose(angle_error(solved, "beam"), 0.0, atol=1e-15)
        np.testing.assert_allclose(np.abs(found.displacement), np.hypot(found.along, found.normal), rtol=1e-12)

    def test_a_point_at_rest_has_no_path(self):
        solved = bent(Section(1e6, 1e3), PointLoad("beam", "B", -50j))
        assert np.isnan(path_deviation(solved, "beam", "B").normal).all()
        assert np.isfinite(path_deviation(solved, "beam", "B").displacement).all()

    def test_links_agree_on_the_displacement_of_a_common_point(self):
        case = ALL["six-bar"]()
        solved = deflection(motion_of(case), case.sections)
        places = [("coupler", "P"), ("rod", "P"), ("rocker", "D")]
        found = {place: displacement_of(solved, *place) for place in places}
        greatest = max(np.abs(value).max() for value in found.values())
        np.testing.assert_allclose(found["coupler", "P"], found["rod", "P"], atol=1e-12 * greatest)
        np.testing.assert_allclose(found["rocker", "D"], 0.0, atol=1e-12 * greatest)

    def test_a_link_without_beams_rotates_with_its_axes(self):
        case = ALL["RRP"]()
        solved = deflection(motion_of(case), case.sections)
        np.testing.assert_array_equal(angle_error(solved, "block"), 0.0)


class TestCautions:
    def kinds(self, solved, **more):
        return {(one.kind, one.severe) for one in exceedances(solved, **more)}

    def test_a_good_design_has_no_caution(self):
        section = section_of(rectangle(0.01, 0.01), E, yield_stress=300e6)
        assert exceedances(bent(section, PointLoad("beam", "B", -10j))) == []

    @pytest.mark.parametrize(
        ("depth", "expected"), [(0.01, set()), (0.1, {("slenderness", False)}), (0.3, {("slenderness", True)})]
    )
    def test_slenderness(self, depth, expected):
        """On two supports shear adds 48 EI/(5 kGA l^2): 0.07, 6.8 and 61 %; nothing if shear is in the model."""
        load = LineLoad("beam", 0, -1j, -1j)
        solved, sheared = (
            deflection(still(supported({"A": 0, "B": 0.6}, loads=(load,))), [section_of(rectangle(depth, 0.01), E, nu)])
            for nu in (None, 0.3)
        )
        assert self.kinds(solved) == expected
        assert self.kinds(sheared) == set()
        for caution in exceedances(solved):
            assert caution.figure == pytest.approx(9.6 * depth**2 / 12 * 2.6 / (13 / 15.3) / 0.6**2, rel=1e-3)

    @pytest.mark.parametrize(
        ("share", "expected"), [(0.009, set()), (0.011, {("deflection", False)}), (0.2, {("deflection", True)})]
    )
    def test_a_large_deflection_is_reported(self, share, expected):
        load = share * 3 * 50.0 / 0.36
        solved = bent(Section(1e7, 50.0), PointLoad("beam", "B", -1j * load))
        assert self.kinds(solved, kinds=["deflection"]) == expected
        if expected:
            assert exceedances(solved, kinds=["deflection"])[0].figure == pytest.approx(share, rel=1e-12)

    @pytest.mark.parametrize(
        ("share", "expected"), [(0.09, set()), (0.11, {("buckling", False)}), (1.1, {("buckling", True)})]
    )
    def test_a_large_axial_force_is_reported(self, share, expected):
        section = section_of(rectangle(0.01, 0.02), E)
        load = share * math.pi**2 * section.EI / 0.36
        solved = deflection(still(supported({"A": 0, "B": 0.6}, loads=(PointLoad("beam", "B", -load),))), [section])
        assert self.kinds(solved, kinds=["buckling"]) == expected

    @pytest.mark.parametrize(("share", "expected"), [(0.6, set()), (0.7, {("yield", False)}), (1.1, {("yield", True)})])
    def test_stress_above_yield_is_reported(self, share, expected):
        section = section_of(rectangle(0.02, 0.01), E, yield_stress=300e6)
        load = share * 300e6 * (0.01 * 0.02**2 / 6) / 0.6
        assert self.kinds(bent(section, PointLoad("beam", "B", -1j * load)), kinds=["yield"]) == expected

    def test_a_caution_names_the_beam_and_the_instant(self):
        """Of two arms it is the heavy one, in the position with the weight across it."""
        case = ALL["arm"]()
        sections = [Section(1e7, 1e9), Section(1e7, 2.0)]
        solved = deflection(motion_of(case), sections)
        found = exceedances(solved, kinds=["deflection"])
        greatest = np.abs(extremes(solved, ["w"])["w"].value[1])
        assert [one.beam for one in found] == [1]
        assert found[0].position == greatest.argmax()
        assert found[0].limit in (VALIDITY_RANGES["deflection"].watch, VALIDITY_RANGES["deflection"].beyond)


@pytest.mark.parametrize(("linear", "low", "high"), [(0.01, 0.5e-4, 2e-4), (0.1, 5e-3, 2e-2)])
def test_the_error_of_linear_theory_is_as_documented(linear, low, high):
    """Bisshopp and Drucker (1945): theta'' = -alpha cos theta; the tip sinks by less than P L^3/(3 EI)."""
    alpha = 3 * linear

    def at_tip(slope):
        """Return slope and sag at the tip for the slope of the angle at the root."""
        start = [0, slope, 0]
        rates = scipy.integrate.solve_ivp(
            lambda s, y: [y[1], -alpha * np.cos(y[0]), np.sin(y[0])], (0, 1), start, rtol=1e-11, atol=1e-13
        )
        return rates.y[1:, -1]

    slope = scipy.optimize.brentq(lambda slope: at_tip(slope)[0], 0.5 * alpha, 1.5 * alpha, xtol=1e-13)
    assert low < linear / at_tip(slope)[1] - 1 < high


@pytest.mark.parametrize("shape", ["I", "channel", "box", "T"])
def test_the_stress_at_the_end_of_a_web(shape):
    """Cantilever with a tip load: sigma^2 + 3 tau^2, with tau from the first moment of the flange (EN 1993-1-1)."""
    depth, width, web, flange, length, load = 0.1, 0.15, 0.002, 0.01, 1.2, 21.1e3
    if shape == "T":
        area = width * flange + web * (depth - flange)
        axis = (width * flange**2 / 2 + web * (depth - flange) * (depth + flange) / 2) / area
        inner = axis - flange
        stem = web * (depth - flange)
        inertia = width * flange**3 / 12 + width * flange * (axis - flange / 2) ** 2
        inertia += web * (depth - flange) ** 3 / 12 + stem * ((depth + flange) / 2 - axis) ** 2
        moment, walls, made = width * flange * (axis - flange / 2), web, t_section(depth, width, web, flange)
    else:
        sides = {"I": (i_section, web), "channel": (channel, web)}
        inner, wall = depth / 2 - flange, 0.004
        if shape == "box":
            made, walls, inner, flange = box(depth, width, wall), 2 * wall, depth / 2 - wall, wall
        else:
            made, walls = sides[shape][0](depth, width, web, flange), web
        inertia = (width * depth**3 - (width - walls) * (2 * inner) ** 3) / 12
        moment = width * flange * (depth - flange) / 2
    sigma, tau = load * length * inner / inertia, load * moment / (inertia * walls)
    bent = deflection(
        still(cantilever({"O": 0.0, "A": length}, loads=(PointLoad("beam", "A", -load * 1j),))), [section_of(made, E)]
    )
    assert web_stress(bent, 5) == pytest.approx(math.sqrt(sigma**2 + 3 * tau**2), rel=1e-9)


def test_a_solid_section_has_no_web():
    bent = deflection(still(cantilever({"O": 0.0, "A": 1.0})), [section_of(rectangle(0.1, 0.1), E)])
    assert web_stress(bent, 5) == 0.0
