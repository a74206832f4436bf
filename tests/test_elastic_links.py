"""Deflections of links of any shape agree with handbooks and with independent methods.

Roark is Young, Budynas, Sadegh, Roark's Formulas for Stress and Strain, 8th edition; Gere is Gere, Mechanics of
Materials, 6th edition; Timoshenko is Timoshenko, Strength of Materials, Part I, 3rd edition.
"""

import math

import mpmath
import numpy as np
import pytest
import scipy.integrate
from mechanisms import ALL, bar, cantilever, motion_of, propped, replaced, steel_four_bar, still, supported, with_link
from msgspec.structs import replace

import fem_check
from elastic import (
    RIGID,
    JointCompliance,
    Section,
    Taper,
    circle,
    deflection,
    displacement_of,
    extremes,
    rectangle,
    sample,
    section_of,
    tapered,
)
from fem_check import compare
from rigid import (
    Beam,
    LineLoad,
    Link,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    Spring,
    TorsionSpring,
    acceleration_of,
    motion,
    position_of,
    reactions,
)

L, EA, EI = 1.3, 5e6, 70.0
SECTION = Section(EA, EI)
INEXTENSIBLE = Section(math.inf, EI)


def solved(mechanism, sections=None, tolerance=None, **more):
    """Return the deflection; finite elements must agree, within 1e-8 by default."""
    sections = sections or [SECTION] * len(mechanism.beams)
    found = deflection(still(mechanism), sections, **more)
    assert compare(found, fem_check.solve(still(mechanism), sections, 8, **more), tolerance).passed
    return found


def down(point, force):
    return PointLoad("beam", point, -1j * force)


class TestLoadsOverPartOfABeam:
    """Beams divided at the start of the load; y is up, loads act down."""

    a = 0.4

    def test_cantilever_with_a_force_inside(self):
        """delta_B = P a^2 (3 L - a)/(6 EI), theta_B = P a^2/(2 EI): Gere, Table G-1, case 5."""
        found = solved(cantilever({"A": 0, "C": self.a, "B": L}, loads=[down("C", 90.0)]))
        assert sample(found, "w", [1])[1, 0, 0] == pytest.approx(
            -90 * self.a**2 * (3 * L - self.a) / (6 * EI), rel=1e-12
        )
        assert sample(found, "phi", [1])[1, 0, 0] == pytest.approx(-90 * self.a**2 / (2 * EI), rel=1e-12)

    def test_cantilever_loaded_up_to_a_point(self):
        """delta_B = q a^3 (4 L - a)/(24 EI): Gere, Table G-1, case 2."""
        load = LineLoad("beam", 0, -90j, -90j)
        found = solved(cantilever({"A": 0, "C": self.a, "B": L}, loads=[load]))
        assert sample(found, "w", [1])[1, 0, 0] == pytest.approx(
            -90 * self.a**3 * (4 * L - self.a) / (24 * EI), rel=1e-12
        )

    def test_simple_beam_with_a_force_inside(self):
        """Under the load P a^2 b^2/(3 L EI); theta_A = P a b (L + b)/(6 L EI): Gere, Table G-2, case 5."""
        found = solved(supported({"A": 0, "C": self.a, "B": L}, loads=[down("C", 90.0)]))
        b = L - self.a
        assert sample(found, "w", [1])[0, 0, 0] == pytest.approx(-90 * self.a**2 * b**2 / (3 * L * EI), rel=1e-12)
        assert sample(found, "phi", [0])[0, 0, 0] == pytest.approx(-90 * self.a * b * (L + b) / (6 * L * EI), rel=1e-12)

    def test_simple_beam_loaded_up_to_a_point(self):
        """theta_B = q a^2 (2 L^2 - a^2)/(24 L EI): Gere, Table G-2, case 3."""
        load = LineLoad("beam", 0, -90j, -90j)
        found = solved(supported({"A": 0, "C": self.a, "B": L}, loads=[load]))
        expected = 90 * self.a**2 * (2 * L**2 - self.a**2) / (24 * L * EI)
        assert sample(found, "phi", [1])[1, 0, 0] == pytest.approx(expected, rel=1e-12)

    def test_simple_beam_with_a_couple_inside(self):
        """Counter-clockwise couple: at A -M0 (6 a L - 3 a^2 - 2 L^2)/(6 L EI): Gere, Table G-2, case 9."""
        found = solved(supported({"A": 0, "C": self.a, "B": L}, loads=[PointLoad("beam", "C", moment=12.0)]))
        expected = -12.0 * (6 * self.a * L - 3 * self.a**2 - 2 * L**2) / (6 * L * EI)
        assert sample(found, "phi", [0])[0, 0, 0] == pytest.approx(expected, rel=1e-12)

    def test_overhang(self):
        """A force at the end of an overhang c beyond a span l: P c^2 (l + c)/(3 EI): Gere, beam with an overhang."""
        span, over = 0.9, 0.4
        found = solved(supported({"A": 0, "B": span, "C": span + over}, loads=[down("C", 90.0)], rollers=["B"]))
        assert sample(found, "w", [1])[1, 0, 0] == pytest.approx(-90 * over**2 * (span + over) / (3 * EI), rel=1e-12)


class TestStaticallyIndeterminate:
    """V is minus the force that pushes the far end up."""

    def test_propped_uniform(self):
        """Force at the prop 3 q L/8, moment at the clamp q L^2/8: Gere, section 10.3."""
        found = solved(propped({"A": 0, "B": L}, loads=[LineLoad("beam", 0, -90j, -90j)]))
        assert sample(found, "M", [0])[0, 0, 0] == pytest.approx(-90 * L**2 / 8, rel=1e-11)
        assert sample(found, "V", [1])[0, 0, 0] == pytest.approx(-3 * 90 * L / 8, rel=1e-11)

    def test_propped_triangular(self):
        """From q0 at the clamp to 0 at the prop: moment q0 L^2/15, force q0 L/10 (Roark, Table 8.1, case 2c)."""
        found = solved(propped({"A": 0, "B": L}, loads=[LineLoad("beam", 0, -90j, 0j)]))
        assert sample(found, "M", [0])[0, 0, 0] == pytest.approx(-90 * L**2 / 15, rel=1e-11)
        assert sample(found, "V", [1])[0, 0, 0] == pytest.approx(-90 * L / 10, rel=1e-11)

    def test_continuous_beam_over_three_supports(self):
        """Moment over the middle support q L^2/8, outer reactions 3 q L/8: Timoshenko, three moments."""
        loads = [LineLoad("beam", number, -90j, -90j) for number in (0, 1)]
        found = solved(supported({"A": 0, "B": L, "C": 2 * L}, loads=loads, rollers=["B", "C"]))
        assert sample(found, "M", [1])[0, 0, 0] == pytest.approx(-90 * L**2 / 8, rel=1e-11)
        assert sample(found, "V", [1])[1, 0, 0] == pytest.approx(-3 * 90 * L / 8, rel=1e-11)

    def test_fixed_beam(self):
        """End moments q L^2/12, mid-span moment q L^2/24: Gere, section 10.3. The base is rigid."""
        found = solved(fixed_beam(LineLoad("frame", 1, -90j, -90j)), [RIGID, SECTION])
        assert sample(found, "M", [0, 0.5, 1])[1, 0] == pytest.approx(
            [-90 * L**2 / 12, 90 * L**2 / 24, -90 * L**2 / 12], rel=1e-11
        )
        assert sample(found, "w", [0.5])[1, 0, 0] == pytest.approx(-90 * L**4 / (384 * EI), rel=1e-11)


def fixed_beam(*loads):
    """Return a beam and a rigid beam between the same two points; a drive holds the link."""
    link = Link("frame", {"A": 0.0, "B": L}, (Beam("A", "B"), Beam("A", "B")))
    return Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("frame", "A"),), {"A": 0, "B": L}, loads=loads)


def direct_stiffness(points, bars, loads, clamped, sections):
    """Return joint displacements of a plane frame by the direct stiffness method."""
    size = 3 * len(points)
    K, f = np.zeros((size, size)), np.zeros(size)
    for (i, j), section in zip(bars, sections, strict=True):
        way = points[j] - points[i]
        span, c, s = abs(way), way.real / abs(way), way.imag / abs(way)
        a, b = section.EA / span, section.EI / span**3
        k = np.array([
            [a, 0, 0, -a, 0, 0],
            [0, 12 * b, 6 * b * span, 0, -12 * b, 6 * b * span],
            [0, 6 * b * span, 4 * b * span**2, 0, -6 * b * span, 2 * b * span**2],
            [-a, 0, 0, a, 0, 0],
            [0, -12 * b, -6 * b * span, 0, 12 * b, -6 * b * span],
            [0, 6 * b * span, 2 * b * span**2, 0, -6 * b * span, 4 * b * span**2],
        ])  # fmt: skip
        turn = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
        at = np.r_[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
        K[np.ix_(at, at)] += turn.T @ k @ turn
    for node, (force, moment) in loads.items():
        f[3 * node : 3 * node + 3] += [force.real, force.imag, moment]
    free = [k for k in range(size) if k // 3 != clamped]
    result = np.zeros(size)
    result[free] = np.linalg.solve(K[np.ix_(free, free)], f[free])
    return result.reshape(-1, 3)


class TestFrames:
    def test_portal_with_fixed_feet(self):
        """With k = (I2/I1) h/l: corners -q l^2/(6 (k + 2)), feet half: Kleinlogel, Rigid Frame Formulas."""
        span, height, stiffer, q = 1.1, 0.7, 1.7, 300.0
        points = {"A": 0.0, "D": span, "B": 1j * height, "C": span + 1j * height}
        link = Link("frame", points, (Beam("A", "D"), Beam("A", "B"), Beam("B", "C"), Beam("C", "D")))
        load = LineLoad("frame", 2, -1j * q, -1j * q)
        mechanism = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("frame", "A"),), points, loads=(load,))
        legs, beam = Section(math.inf, EI), Section(math.inf, stiffer * EI)
        # elements of inextensible bars are worse conditioned: 1e-8 to 2e-8, depending on the processor
        found = solved(mechanism, [RIGID, legs, beam, legs], tolerance=1e-7)
        k = stiffer * height / span
        corner = q * span**2 / (6 * (k + 2))
        M = sample(found, "M", [0, 0.5, 1])[:, 0]
        assert M[2] == pytest.approx([-corner, q * span**2 / 8 - corner, -corner], rel=1e-10)
        # y' of the left leg points left, so the inward push at its foot has the opposite moment
        assert np.abs(M[1, [0, 2]]) == pytest.approx([corner / 2, corner], rel=1e-10)
        assert M[1, 0] * M[1, 2] < 0

    @pytest.mark.parametrize("order", [(0, 1, 2, 3, 4), (3, 1, 4, 0, 2)])
    def test_ring_with_a_brace(self, order):
        """A square with a diagonal, mixed sections, loads on two corners, and beams in any order."""
        points = [0j, 0.8 + 0.1j, 0.9 + 0.9j, -0.1 + 0.7j]
        bars = [(0, 1), (1, 2), (3, 2), (0, 3), (1, 3)]
        sections = [Section(EA * (1 + 0.2 * k), EI * (1 + 0.3 * k)) for k in range(5)]
        names = "ABCD"
        link = Link("frame", dict(zip(names, points, strict=True)), tuple(
            Beam(names[bars[k][0]], names[bars[k][1]]) for k in order
        ))  # fmt: skip
        loads = (PointLoad("frame", "C", 300 - 200j, 15.0), PointLoad("frame", "D", -90 + 150j))
        drawing = dict(zip(names, points, strict=True))
        mechanism = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("frame", "A"),), drawing, loads=loads)
        found = solved(mechanism, [sections[k] for k in order])
        given = {2: (300 - 200j, 15.0), 3: (-90 + 150j, 0.0)}
        expected = direct_stiffness(points, bars, given, 0, sections)
        for number, name in enumerate(names):
            moved = displacement_of(found, "frame", name)[0]
            assert [moved.real, moved.imag] == pytest.approx(expected[number, :2], rel=1e-9, abs=1e-15)
        ends = sample(found, "phi", [0, 1])[:, 0]
        for row, k in zip(ends, order, strict=True):
            assert row == pytest.approx(expected[list(bars[k]), 2], rel=1e-9, abs=1e-15)

    def test_square_ring_in_tension(self):
        """Forces P at the middles of two opposite sides of a square: 3 P l/16 under them, P l/16 at the corners.

        With m at the corners, half a loaded side has the mean moment P l/8 - m, half of the next side -m. A quarter
        of the ring does not rotate at its ends, so these sum to zero.
        """
        side, P = 0.8, 100.0
        half = side / 2
        points = {
            "A": 0.0, "B": half, "C": half + 1j * side, "D": 1j * side, "E": -half + 1j * side, "F": -half + 0j,
        }  # fmt: skip
        beams = [("A", "B"), ("B", "C"), ("C", "D"), ("D", "E"), ("E", "F"), ("F", "A")]
        link = Link("frame", points, tuple(Beam(*ends) for ends in beams))
        load = PointLoad("frame", "D", 1j * P)
        mechanism = Mechanism((Link("ground", {"A": 0.0}), link), (PinDrive("frame", "A"),), points, loads=(load,))
        M = sample(solved(mechanism, [INEXTENSIBLE] * 6), "M", [0, 1])[:, 0]
        assert np.abs(M[[0, 2], [0, 1]]) == pytest.approx([3 * P * side / 16] * 2, rel=1e-10)
        assert np.abs(M[[0, 1, 1], [1, 0, 1]]) == pytest.approx([P * side / 16] * 3, rel=1e-10)


class TestOrder:
    def bent(self, beams, reverse=()):
        """Return a branched link with loads and masses; order and directions of its beams can be chosen."""
        points = {"A": 0.0, "B": 0.5 + 0.1j, "C": 0.9 - 0.1j, "D": 0.6 + 0.5j}
        ends = [("A", "B"), ("B", "C"), ("B", "D")]
        masses = [0.7, 0.5, 0.9]
        taken = [Beam(*(ends[k][::-1] if k in reverse else ends[k]), masses[k]) for k in beams]
        link = Link("frame", points, tuple(taken))
        loads = (PointLoad("frame", "C", 30 - 90j, 4.0), PointLoad("frame", "D", -20 - 10j))
        mechanism = Mechanism(
            (Link("ground", {"A": 0.0}), link), (PinDrive("frame", "A"),), points, gravity=-9.81j, loads=loads
        )
        sections = [Section(EA * (1 + k), EI * (1 + 0.3 * k), kGA=3e4) for k in beams]
        return deflection(motion(mechanism, [0.3, 1.2], 9.0, 50.0), sections)

    @pytest.mark.parametrize(("beams", "reverse"), [((2, 1, 0), ()), ((1, 2, 0), (0, 1)), ((0, 2, 1), (0, 1, 2))])
    def test_of_beams_in_a_link(self, beams, reverse):
        plain, other = self.bent((0, 1, 2)), self.bent(beams, reverse)
        for point in "ABCD":
            expected = displacement_of(plain, "frame", point)
            np.testing.assert_allclose(displacement_of(other, "frame", point), expected, rtol=1e-11, atol=1e-16)
        stations = np.linspace(0, 1, 5)
        for field in ("N", "V", "M", "phi"):
            expected, found = sample(plain, field, stations), sample(other, field, stations)
            for place, k in enumerate(beams):
                way = slice(None, None, -1) if k in reverse else slice(None)
                # a reversed beam reverses y' and the positive side of a cut
                sign = -1 if k in reverse and field == "M" else 1
                scale = np.abs(expected).max()
                np.testing.assert_allclose(
                    sign * found[place][:, way], expected[k], atol=1e-11 * scale, err_msg=f"{field} of beam {k}"
                )

    def test_of_two_beams_for_one(self):
        """A coupler divided at 0.37 of its length, without a joint, deflects like the undivided one."""
        case = ALL["RRR"](loads=())
        course = motion_of(case)
        whole = deflection(course, case.sections)
        coupler = case.mechanism.links[2]
        points = {**coupler.points, "X": 0.37 * coupler.points["B"]}
        beams = (Beam("A", "X", 0.7), Beam("X", "B", 0.7))
        divided = with_link(case.mechanism, replace(coupler, points=points, beams=beams))
        sections = [case.sections[0], case.sections[1], case.sections[1], case.sections[2]]
        halves = deflection(motion(divided, case.drive, case.rate, case.rate2), sections)
        for field in ("N", "V", "M", "u", "w", "phi"):
            expected = sample(whole, field, [0.1, 0.37, 0.9])[1]
            found = sample(halves, field, [0.1 / 0.37, 1.0])[1], sample(halves, field, [(0.9 - 0.37) / 0.63])[2]
            scale = np.abs(expected).max()
            np.testing.assert_allclose(np.concatenate(found, axis=-1), expected, atol=1e-11 * scale)


class TestTimoshenkoBeam:
    kGA = 900.0

    def test_cantilever_tip(self):
        """P L^3/(3 EI) + P L/(kGA): Timoshenko, effect of shear."""
        found = solved(cantilever({"A": 0, "B": L}, loads=[down("B", 5.0)]), [Section(EA, EI, self.kGA)])
        expected = -5 * L**3 / (3 * EI) - 5 * L / self.kGA
        assert sample(found, "w", [1])[0, 0, 0] == pytest.approx(expected, rel=1e-12)
        assert sample(found, "phi", [1])[0, 0, 0] == pytest.approx(-5 * L**2 / (2 * EI), rel=1e-12)

    def test_simple_beam_middle(self):
        """5 q L^4/(384 EI) + q L^2/(8 kGA)."""
        load = LineLoad("beam", 0, -5j, -5j)
        found = solved(supported({"A": 0, "B": L}, loads=[load]), [Section(EA, EI, self.kGA)])
        expected = -5 * 5 * L**4 / (384 * EI) - 5 * L**2 / (8 * self.kGA)
        assert sample(found, "w", [0.5])[0, 0, 0] == pytest.approx(expected, rel=1e-12)
        assert extremes(found, ["w"])["w"].value[0, 0] == pytest.approx(expected, rel=1e-12)

    def test_propped(self):
        """Shear affects the force at the prop: R (L^3/(3 EI) + L/kGA) = q L^4/(8 EI) + q L^2/(2 kGA)."""
        load = LineLoad("beam", 0, -5j, -5j)
        found = solved(propped({"A": 0, "B": L}, loads=[load]), [Section(EA, EI, self.kGA)])
        free = 5 * L**4 / (8 * EI) + 5 * L**2 / (2 * self.kGA)
        expected = free / (L**3 / (3 * EI) + L / self.kGA)
        assert sample(found, "V", [1])[0, 0, 0] == pytest.approx(-expected, rel=1e-10)


class TestTaperedBeam:
    def test_cone_with_a_force_at_the_tip(self):
        """E I w'' = -P (L - x), I ~ t^4 with t = 1 - c x/L: the double integral in closed form, in 40 digits."""
        big, small = 0.03, 0.011
        taper, _ = tapered(circle, (big,), (small,))
        cone = section_of(circle(big), 2e11, taper=taper)
        found = solved(cantilever({"A": 0, "B": L}, loads=[down("B", 80.0)]), [cone])
        with mpmath.workdps(40):
            c = 1 - mpmath.mpf(small) / mpmath.mpf(big)
            EI0 = mpmath.mpf(2e11) * mpmath.pi * mpmath.mpf(big) ** 4 / 64

            def twice(power, t):
                """Return the double integral of t^-power, with value and slope zero at t = 1."""
                return (t ** (2 - power) - 1) / ((power - 1) * (power - 2)) + (t - 1) / (power - 1)

            stations = [mpmath.mpf(k) / 5 for k in range(1, 6)]
            # 1 - s = (t - (1 - c))/c
            sags = [(twice(3, 1 - c * s) - (1 - c) * twice(4, 1 - c * s)) / c**3 for s in stations]
            expected = [float(-80 * mpmath.mpf(L) ** 3 / EI0 * sag) for sag in sags]
        np.testing.assert_allclose(sample(found, "w", [float(s) for s in stations])[0, 0], expected, rtol=1e-12)

    @pytest.mark.parametrize("c", [0.02, 0.5, 0.9])
    def test_wedge_with_logarithms(self, c):
        """I ~ 1 - c x/L: P L^3/EI (3 c^2 - 2 c - 2 (1 - c)^2 log(1 - c))/(2 c^3), in 40 digits.

        The bracket cancels to c^3; in double precision c = 0.02 would lose six of sixteen digits.
        """
        section = replace(SECTION, taper=Taper(EI=(1.0, -c)))
        found = solved(cantilever({"A": 0, "B": L}, loads=[down("B", 80.0)]), [section])
        with mpmath.workdps(40):
            r = mpmath.mpf(c)
            factor = (3 * r**2 - 2 * r - 2 * (1 - r) ** 2 * mpmath.log(1 - r)) / (2 * r**3)
            expected = float(-80 * mpmath.mpf(L) ** 3 / EI * factor)
        assert sample(found, "w", [1])[0, 0, 0] == pytest.approx(expected, rel=1e-13)

    def test_cone_in_tension(self):
        """F L/(E A) sqrt(A0/A1): Gere, example 2-4."""
        taper, _ = tapered(circle, (0.03,), (0.011,))
        pull = PointLoad("beam", "B", 4000.0)
        found = solved(cantilever({"A": 0, "B": L}, loads=[pull]), [section_of(circle(0.03), 2e11, taper=taper)])
        expected = 4 * 4000 * L / (math.pi * 2e11 * 0.03 * 0.011)
        assert sample(found, "u", [1])[0, 0, 0] == pytest.approx(expected, rel=1e-12)

    def test_reversed_taper(self):
        """A coupler tapered from A, or reversed from B, deflects alike, including its inertia load."""
        taper, mass = tapered(rectangle, (0.008, 0.01), (0.004, 0.008), 0.3)
        back, mass_back = tapered(rectangle, (0.004, 0.008), (0.008, 0.01), 0.3)
        case = steel_four_bar(6)

        def with_coupler(start, end, shape, how, masses):
            coupler = replace(case.mechanism.links[2], beams=(Beam(start, end, 7850 * shape.area, masses),))
            sections = [case.sections[0], section_of(shape, 210e9, 0.3, taper=how), case.sections[2]]
            return deflection(motion(with_link(case.mechanism, coupler), case.drive, case.rate), sections)

        one = with_coupler("A", "B", rectangle(0.008, 0.01), taper, mass)
        other = with_coupler("B", "A", rectangle(0.004, 0.008), back, mass_back)
        for field, sign in (("N", 1), ("V", 1), ("M", -1), ("u", -1), ("w", -1), ("phi", 1)):
            expected = sample(one, field, [0, 0.3, 1])
            found = sample(other, field, [1, 0.7, 0])
            np.testing.assert_allclose(sign * found[1], expected[1], atol=1e-11 * np.abs(expected).max(), err_msg=field)
            np.testing.assert_allclose(
                found[2], sample(one, field, [1, 0.7, 0])[2], atol=1e-11 * np.abs(expected).max()
            )


def rail(place):
    """Return the motion of a cantilever with a loaded block on its beam."""
    link = Link("rail", {"A": 0.0, "B": L}, (Beam("A", "B", 0.8),))
    block = Link("block", {"C": 0.0})
    slider = Slider("guide", "block", "rail", "C", origin=0.0, direction=1.0)
    mechanism = Mechanism(
        (Link("ground", {"A": 0.0}), link, block), (PinDrive("rail", "A"), SliderDrive("guide")),
        {"A": 0, "B": L, "C": place}, (slider,), gravity=-9.81j, loads=(PointLoad("block", "C", 25 - 60j, 7.0),),
    )  # fmt: skip
    return motion(mechanism, np.array([[0.4], [place]]), np.array([[3.0], [0.2]]), np.array([[-20.0], [0.5]]))


class TestBlockOnAnElasticBeam:
    place = 0.55

    def fields(self, section, xi):
        """Return N and M from the loads by hand, then u, w and phi by Runge-Kutta."""
        turn = np.exp(-0.4j)
        force, spin, gain = (25 - 60j) * turn, 3.0, -20.0

        def load(x):
            return -0.8 * ((1j * gain - spin**2) * x + 9.81j * turn)

        def forces(x):
            N_V = (
                scipy.integrate.quad(lambda s: load(s).real, x, L)[0],
                scipy.integrate.quad(lambda s: load(s).imag, x, L)[0],
            )
            M = scipy.integrate.quad(lambda s: load(s).imag * (s - x), x, L)[0]
            on = x < self.place
            return N_V[0] + on * force.real, -N_V[1] - on * force.imag, M + on * (7.0 + force.imag * (self.place - x))

        def rates(x, y):
            N, V, M = forces(x)
            return [N / section.EA, y[2] - V / section.kGA, M / section.EI]

        found, state, start = [], [0, 0, 0], 0.0
        marks = sorted({*(xi * L), self.place})
        for mark in marks:
            if mark > start:
                state = scipy.integrate.solve_ivp(rates, (start, mark - 1e-15), state, rtol=1e-11, atol=1e-15).y[:, -1]
            start = mark
            if np.isclose(xi * L, mark).any():
                found.append((*forces(mark), *state))
        return np.array(found).T

    @pytest.mark.parametrize("kGA", [math.inf, 2000.0])
    def test_against_direct_integration(self, kGA):
        section = Section(EA, EI, kGA)
        found = deflection(rail(self.place), [section])
        xi = np.array([0.1, 0.35, 0.6, 1.0])
        expected = self.fields(section, xi)
        for field, row in zip(("N", "V", "M", "u", "w", "phi"), expected, strict=True):
            np.testing.assert_allclose(
                sample(found, field, xi)[0, 0], row, atol=1e-9 * np.abs(row).max(), err_msg=field
            )

    def test_against_a_divided_beam(self):
        """The same load acts on two beams, at their common point."""
        whole = deflection(rail(self.place), [SECTION])
        link = Link("rail", {"A": 0.0, "C": self.place, "B": L}, (Beam("A", "C", 0.8), Beam("C", "B", 0.8)))
        mechanism = Mechanism(
            (Link("ground", {"A": 0.0}), link), (PinDrive("rail", "A"),), {"A": 0, "C": self.place, "B": L},
            gravity=-9.81j, loads=(PointLoad("rail", "C", 25 - 60j, 7.0),),
        )  # fmt: skip
        cut = deflection(motion(mechanism, [0.4], 3.0, -20.0), [SECTION] * 2)
        for field in ("N", "V", "M", "u", "w", "phi"):
            part = self.place / L
            found = sample(whole, field, [0.5 * part, part + 0.3 * (1 - part), 1.0])[0, 0]
            expected = [sample(cut, field, [0.5])[0, 0, 0], *sample(cut, field, [0.3, 1.0])[1, 0]]
            np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(found).max(), err_msg=field)

    def test_the_block_moves_with_the_beam(self):
        """The block has the displacement and rotation of the beam at the contact."""
        found = deflection(rail(self.place), [SECTION])
        at = self.place / L
        moved = np.exp(0.4j) * (sample(found, "u", [at]) + 1j * sample(found, "w", [at]))[0, 0, 0]
        # along the rail the drive keeps the distance of the block
        carried = displacement_of(found, "block", "C")[0]
        assert (carried * np.exp(-0.4j)).imag == pytest.approx((moved * np.exp(-0.4j)).imag, rel=1e-11)
        assert found.angle[2, 0] == pytest.approx(sample(found, "phi", [at])[0, 0, 0], rel=1e-11)

    def test_a_tapered_beam_is_an_error(self):
        tapering = replace(SECTION, taper=Taper(EI=(1.0, -0.5)))
        with pytest.raises(MechanismError, match='slider "guide": the beam of "rail" along its line is tapered'):
            deflection(rail(self.place), [tapering])


class TestMisfits:
    def four_bar(self, longer=0.0):
        case = steel_four_bar(12)
        links = [
            bar("coupler", "A", "B", 0.3 * (1 + longer), 0.0) if link.name == "coupler"
            else replace(link, beams=tuple(replace(beam, mass_per_length=0.0) for beam in link.beams))
            for link in case.mechanism.links
        ]  # fmt: skip
        return replaced(case.mechanism, links=tuple(links)), case.drive

    def test_longer_coupler(self):
        """Without loads, strain of a link acts like a rigid link of the new length, to first order."""
        mechanism, drive = self.four_bar()
        strain = 1e-4
        found = deflection(motion(mechanism, drive), [SECTION, replace(SECTION, strain=strain), SECTION])
        longer, shorter = (motion(self.four_bar(sign * strain)[0], drive) for sign in (1, -1))
        moved = (position_of(longer, "rocker", "B") - position_of(shorter, "rocker", "B")) / 2
        np.testing.assert_allclose(displacement_of(found, "rocker", "B"), moved, atol=1e-6 * np.abs(moved).max())
        turned = np.angle(longer.direction[3] / shorter.direction[3]) / 2
        np.testing.assert_allclose(found.angle[3], turned, atol=1e-6 * np.abs(turned).max())
        np.testing.assert_allclose(sample(found, "M", [0.5]), 0.0, atol=1e-12)

    def test_heated_beam_between_walls(self):
        """A beam that cannot expand has the axial force -EA alpha T; the parallel beam is rigid."""
        strain = 12e-6 * 80
        found = solved(fixed_beam(), [RIGID, replace(SECTION, strain=strain)])
        assert sample(found, "N", [0, 1])[1, 0] == pytest.approx([-EA * strain] * 2, rel=1e-10)
        np.testing.assert_allclose(sample(found, "u", [1])[1], 0.0, atol=1e-15)

    def test_a_soft_pin_acts_like_a_softer_bar(self):
        """The coupler carries only axial force, so a soft pin equals a correspondingly softer coupler."""
        mechanism, drive = self.four_bar()
        loaded = replaced(mechanism, loads=(PointLoad("rocker", "B", 300 - 500j),))
        course = motion(loaded, drive)
        soft = 3e-7
        plain, given = (
            deflection(course, [SECTION] * 3),
            deflection(course, [SECTION] * 3, joints={"B": JointCompliance(soft)}),
        )
        longer = [SECTION, replace(SECTION, EA=1 / (1 / EA + soft / 0.3)), SECTION]
        stretched = deflection(course, longer)
        scale = np.abs(displacement_of(stretched, "rocker", "B") - displacement_of(plain, "rocker", "B")).max()
        np.testing.assert_allclose(
            displacement_of(given, "rocker", "B"), displacement_of(stretched, "rocker", "B"), atol=1e-9 * scale
        )
        assert scale > 1e-5

    def test_drive_stiffness(self):
        """A rigid arm on a soft drive turns by the moment divided by the stiffness, and all its points turn with it."""
        mechanism = cantilever({"A": 0, "B": L}, loads=[down("B", 50.0)])
        found = solved(mechanism, [RIGID], joints={"A": JointCompliance(rotation=1 / 400.0)})
        assert found.angle[1, 0] == pytest.approx(-50 * L / 400, rel=1e-13)
        assert displacement_of(found, "beam", "B")[0] == pytest.approx(-1j * 50 * L**2 / 400, rel=1e-13)

    def test_gap_and_misalignment(self):
        """A misfit of a joint shifts and rotates the link without load."""
        mechanism = cantilever({"A": 0, "B": L})
        found = solved(mechanism, [SECTION], joints={"A": JointCompliance(gap=1e-4 - 2e-4j, turn=3e-4)})
        assert displacement_of(found, "beam", "B")[0] == pytest.approx(1e-4 - 2e-4j + 3e-4j * L, rel=1e-12)

    def test_reactions_of_a_held_arm(self):
        mechanism = cantilever({"A": 0, "B": L}, loads=[down("B", 50.0)])
        held = reactions(still(mechanism))
        assert held.force[0][0] == pytest.approx(50j, rel=1e-13)
        assert held.moment[0][0] == pytest.approx(50 * L, rel=1e-13)


class TestRedundantPins:
    def test_a_soft_pin_of_three_links_is_ambiguous(self):
        links = (
            Link("ground", {"O": 0.0, "D": 1.0, "F": 2.0}),
            *(Link(name, {start: 0.0, end: 1.0}, (Beam(start, end, 1.0),)) for name, start, end in (
                ("crank", "O", "A"), ("one", "A", "B"), ("rocker", "D", "B"), ("other", "A", "C"), ("last", "F", "C")
            )),
        )  # fmt: skip
        drawing = {"O": 0, "A": 1j, "B": 0.7 + 0.95j, "D": 1, "C": 0.95 + 0.7j, "F": 2}
        going = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), [np.pi / 2], 1.0)
        with pytest.raises(ValueError, match='"A" names 2 joints'):
            deflection(going, [Section(1e6, 1e3)] * 5, joints={"A": JointCompliance(1e-6)})

    def test_the_shaking_force_of_a_redundant_mechanism_includes_springs_on_the_ground(self):
        bars = [("crank", "O", "A"), ("second", "P", "B"), ("third", "Q", "C")]
        links = (
            Link("ground", {"O": 0.0, "P": 0.3, "Q": 0.6, "S": 1.0j}),
            *(Link(name, {start: 0.0, end: 0.1}, (Beam(start, end, 0.5),)) for name, start, end in bars),
            Link("coupler", {"A": 0.0, "B": 0.3, "C": 0.6}, (Beam("A", "B", 0.5), Beam("B", "C", 0.5))),
        )
        drawing = {"O": 0, "P": 0.3, "Q": 0.6, "A": 0.1j, "B": 0.3 + 0.1j, "C": 0.6 + 0.1j, "S": 1j}
        spring = Spring("coupler", "B", "ground", "S", stiffness=300.0, length=0.2)
        course = Mechanism(links, (PinDrive("crank", "O"),), drawing, loads=(spring,))
        going = motion(course, np.linspace(0.5, 2.5, 5), 20.0)
        solved = deflection(going, [Section(1e6, 1e2)] * 5)
        momentum = sum(
            mass * acceleration_of(going, link, place)
            for link, place, mass in (
                ("crank", 0.05, 0.05), ("second", 0.05, 0.05), ("third", 0.05, 0.05), ("coupler", 0.3, 0.3)
            )
        )  # fmt: skip
        np.testing.assert_allclose(solved.forces.ground_force, -momentum, rtol=1e-9, atol=1e-9)


class CustomLoad:
    """A custom load with a declared and an actual point."""

    def __init__(self, says, acts):
        self.points, self.acts = (says,), acts

    def forces(self, motion):
        return ((*self.acts, 40j, 0.0),)


class TestNoLoadIsLost:
    """A load at a point of an elastic link that no beam reaches is an error, for every kind of load."""

    LINKS = (
        Link("ground", {"O": 0.0, "G": 1 + 1j}),
        Link("arm", {"O": 0.0, "A": 1.0, "B": 2.0}, (Beam("O", "A", 1.0),)),
    )

    def bent(self, load):
        mechanism = Mechanism(self.LINKS, (PinDrive("arm", "O"),), {"O": 0, "A": 1}, loads=(load,))
        return deflection(motion(mechanism, [0.0]), [Section(1e6, 1e3)])

    @pytest.mark.parametrize(
        "load",
        [
            PointLoad("arm", "B", 40j),
            Spring("arm", "B", anchor="G", stiffness=40.0),
            Spring("ground", "G", on="arm", anchor="B", stiffness=40.0),
            TorsionSpring("arm", "B", on="arm", stiffness=40.0),
            CustomLoad(("arm", "B"), ("arm", "B")),
        ],
        ids=["force", "spring", "its other end", "torsion spring", "one's own"],
    )
    def test_a_load_at_a_point_without_a_beam_is_an_error(self, load):
        with pytest.raises(MechanismError, match='"arm": no beam reaches the point "B"'):
            self.bent(load)

    def test_a_load_at_an_undeclared_point_is_an_error(self):
        with pytest.raises(
            MechanismError, match='a load acts on the point "B" of "arm", which is not among its points'
        ):
            self.bent(CustomLoad(("arm", "A"), ("arm", "B")))

    def test_a_custom_load_on_a_beam_bends_it(self):
        found = self.bent(CustomLoad(("arm", "A"), ("arm", "A")))
        assert found.w[:, 0, 0].sum() == pytest.approx(40.0 / (3 * 1e3), rel=1e-12)

    def test_a_load_without_points_is_an_error(self):
        load = CustomLoad(("arm", "A"), ("arm", "A"))
        del load.points
        with pytest.raises(MechanismError, match="does not say where it acts"):
            self.bent(load)
