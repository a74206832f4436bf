"""docs/errata.md is right: each printed formula fails, and its correction passes.

Source: Utenov, Zhilkibayeva, Baygunchekov, Myrzaliyev, "Determination of displacements in cross-sections of four-bar
mechanism links from distributed dynamic loads and their animation using MAPLE". The reference is independent of the
program: quadrature of section forces from equilibrium, and closure of joints. The program must agree with the same
numbers, by closed forms and by Hermite finite elements.
"""

from cmath import phase
from math import cos, sin, tau

import numpy as np
import pytest

import fem_check
from elastic import Section, deflection, sample
from rigid import Beam, LineLoad, Link, Mechanism, PinDrive, motion

B, C, D = 0.09 + 0.12j, 0.55 + 0.32j, 0.6 - 0.05j  # O is at the origin
ENDS = ((0j, B), (B, C), (C, D))  # link 3 runs from C to D
EA = (8e7, 4e7, 6e7)
EI = (2600.0, 1200.0, 1800.0)
ACROSS = ((300.0, -120.0), (-500.0, 800.0), (250.0, 90.0))
ALONG = ((-80.0, 400.0), (600.0, -100.0), (150.0, 700.0))
LENGTH = [abs(end - start) for start, end in ENDS]
THETA = [phase(end - start) for start, end in ENDS]

PINNED = {
    "ux1l": 2.4239410377e-7,
    "uy1l": -3.5905052612e-5,
    "ux20": 1.7962884202e-5,
    "uy20": -3.1089650194e-5,
    "ux2l": 1.8534324768e-5,
    "uy2l": -5.0971194647e-6,
    "ux3l": -1.4283385744e-7,
    "uy3l": 1.9221899488e-5,
    "Phi20": 5.1923401447e-4,
    "Phi30": 1.5975626257e-4,
}
DIGITS = 1e-9
GAUSS = np.polynomial.legendre.leggauss(8)


def integral(function, start, end):
    """Gauss quadrature, exact to degree 15."""
    half = (end - start) / 2
    return half * sum(w * function(start + half * (1 + x)) for x, w in zip(*GAUSS, strict=True))


def load(pair, k, x):
    return pair[0] + (pair[1] - pair[0]) * x / LENGTH[k]


def joint_forces():
    """Return the forces on the ends of the three links, in local axes, by equilibrium of each link."""
    # moments of the coupler about B and the rocker about D give the force on the coupler at C
    rows, right = [], []
    for k, sign, pole in ((1, 1.0, 0.0), (2, -1.0, LENGTH[2])):
        arm = ((LENGTH[k] if k == 1 else 0.0) - pole) * np.exp(1j * THETA[k])
        rows.append([-sign * arm.imag, sign * arm.real])
        right.append(-integral(lambda x, k=k, pole=pole: (x - pole) * load(ACROSS[k], k, x), 0, LENGTH[k]))
    at_c = complex(*np.linalg.solve(rows, right))
    total = [
        integral(lambda x, k=k: complex(load(ALONG[k], k, x), load(ACROSS[k], k, x)), 0, LENGTH[k]) for k in range(3)
    ]
    at_b = at_c + total[1] * np.exp(1j * THETA[1])  # on the crank, from the coupler
    at_d = at_c - total[2] * np.exp(1j * THETA[2])  # on the rocker
    return [force * np.exp(-1j * angle) for force, angle in zip((at_b, at_c, at_d), THETA, strict=True)]


END_FORCE = joint_forces()


def axial(k, x):
    """Return the axial force in link k at x, by equilibrium of the part beyond."""
    return END_FORCE[k].real + integral(lambda s: load(ALONG[k], k, s), x, LENGTH[k])


def moment(k, x):
    """Return the bending moment in link k at x, by equilibrium of the part beyond."""
    beyond = integral(lambda s: (s - x) * load(ACROSS[k], k, s), x, LENGTH[k])
    return END_FORCE[k].imag * (LENGTH[k] - x) + beyond


def nodal_moments(k):
    """Return M_k1 to M_k4, at the thirds of the link."""
    return [moment(k, LENGTH[k] * part / 3) for part in range(4)]


def nodal_pulls(k):
    """Return N_k1 to N_k3, at the ends and the middle."""
    return [axial(k, LENGTH[k] * part / 2) for part in range(3)]


def slope(k, x):
    """Return the slope at x of link k clamped at its start."""
    return integral(lambda s: moment(k, s), 0, x) / EI[k]


def deflected(k, x):
    """Return the deflection at x of link k clamped at its start."""
    return integral(lambda s: slope(k, s), 0, x)


def stretched(k, x):
    """Return the axial displacement at x of link k fixed at its start."""
    return integral(lambda s: axial(k, s), 0, x) / EA[k]


def reference():
    """Return all ten numbers by quadrature and closure of the joints B, C and D."""
    at_b = complex(stretched(0, LENGTH[0]), deflected(0, LENGTH[0])) * np.exp(1j * THETA[0])
    own_b = at_b * np.exp(-1j * THETA[1])
    grown = [complex(stretched(k, LENGTH[k]), deflected(k, LENGTH[k])) for k in (1, 2)]
    e2, e3 = np.exp(1j * THETA[1]), np.exp(1j * THETA[2])
    # B + stretch and rotation of the coupler = C = -(stretch and rotation of the rocker), D at rest; unknown Phi20,
    # Phi30
    closing = -e3 * grown[1] - at_b - e2 * grown[0]
    a, b = 1j * e2 * LENGTH[1], 1j * e3 * LENGTH[2]
    Phi20, Phi30 = np.linalg.solve([[a.real, b.real], [a.imag, b.imag]], [closing.real, closing.imag])
    at_c = at_b + e2 * grown[0] + a * Phi20
    own_c, far_c = at_c / e2, at_c / e3
    first = at_b * np.exp(-1j * THETA[0])
    values = (first, own_b, own_c, far_c)
    names = (("ux1l", "uy1l"), ("ux20", "uy20"), ("ux2l", "uy2l"), ("ux3l", "uy3l"))
    result = {
        name: part
        for pair, value in zip(names, values, strict=True)
        for name, part in zip(pair, (value.real, value.imag), strict=True)
    }
    return result | {"Phi20": Phi20, "Phi30": Phi30}


REFERENCE = reference()


def passes(value, name):
    return value == pytest.approx(REFERENCE[name], rel=1e-12)


@pytest.mark.parametrize("name", PINNED)
def test_the_reference_has_the_pinned_values(name):
    assert REFERENCE[name] == pytest.approx(PINNED[name], rel=DIGITS)


@pytest.fixture(scope="module")
def at_rest():
    """The same four-bar in the program: massless beams at rest with line loads in local axes."""
    links = (
        Link("ground", {"O": 0.0, "D": D}),
        Link("crank", {"O": 0.0, "B": LENGTH[0]}, (Beam("O", "B"),)),
        Link("coupler", {"B": 0.0, "C": LENGTH[1]}, (Beam("B", "C"),)),
        Link("rocker", {"C": 0.0, "D": LENGTH[2]}, (Beam("C", "D"),)),
    )
    carried = tuple(
        LineLoad(link, 0, complex(along[0], across[0]), complex(along[1], across[1]), turning=True)
        for link, along, across in zip(("crank", "coupler", "rocker"), ALONG, ACROSS, strict=True)
    )
    drawing = {"O": 0.0, "B": B, "C": C, "D": D}
    return motion(Mechanism(links, (PinDrive("crank", "O"),), drawing, loads=carried), [THETA[0]])


SECTIONS = [Section(*pair) for pair in zip(EA, EI, strict=True)]


@pytest.fixture(scope="module")
def solved(at_rest):
    return deflection(at_rest, SECTIONS)


@pytest.fixture(scope="module")
def by_elements(at_rest):
    return fem_check.solve(at_rest, SECTIONS)


class TestProgram:
    """The program agrees with the corrected formulas."""

    def test_places_the_drawing(self, solved):
        np.testing.assert_allclose(np.angle(solved.motion.direction[1:, 0]), THETA, rtol=1e-14)

    @pytest.mark.parametrize(
        ("name", "field", "link", "xi"),
        [
            ("ux1l", "u", 0, 1.0),
            ("uy1l", "w", 0, 1.0),
            ("ux20", "u", 1, 0.0),
            ("uy20", "w", 1, 0.0),
            ("ux2l", "u", 1, 1.0),
            ("uy2l", "w", 1, 1.0),
            ("ux3l", "u", 2, 0.0),
            ("uy3l", "w", 2, 0.0),
            ("Phi20", "phi", 1, 0.0),
            ("Phi30", "phi", 2, 0.0),
        ],
    )
    def test_has_the_pinned_values(self, solved, by_elements, name, field, link, xi):
        value = sample(solved, field, [xi])[link, 0, 0]
        assert value == pytest.approx(PINNED[name], rel=DIGITS)
        assert passes(value, name)
        assert getattr(by_elements, field)[link, 0, -int(xi)] == pytest.approx(PINNED[name], rel=DIGITS)

    @pytest.mark.parametrize("k", range(3))
    def test_moments_and_pulls_at_the_nodes_of_the_paper(self, solved, k):
        np.testing.assert_allclose(
            sample(solved, "M", [0, 1 / 3, 2 / 3, 1])[k, 0], nodal_moments(k), rtol=0, atol=1e-12
        )
        np.testing.assert_allclose(sample(solved, "N", [0, 1 / 2, 1])[k, 0], nodal_pulls(k), rtol=1e-12)

    @pytest.mark.parametrize("k", range(3))
    def test_elastic_line_is_equations_2_3_5(self, solved, k):
        """The brackets are as printed, with the program's start values as integration constants."""
        x = np.linspace(0, LENGTH[k], 5)
        for field, printed in (("phi", bracket_2), ("w", bracket_3), ("u", bracket_5)):
            start = sample(solved, field, [0.0])[k, 0, 0]
            turned = sample(solved, "phi", [0.0])[k, 0, 0] * x if field == "w" else 0.0
            expected = start + turned + printed(k, x)
            got = sample(solved, field, x / LENGTH[k])[k, 0]
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def shapes(x, power=3):
    """Return the integrand of (2): cubics that are 1 at their own third; `power` ends the third one."""
    return [
        1 - 11 / 2 * x + 9 * x**2 - 9 / 2 * x**3,
        9 * x - 45 / 2 * x**2 + 27 / 2 * x**3,
        -9 / 2 * x + 18 * x**2 - 27 / 2 * x**power,
        x - 9 / 2 * x**2 + 9 / 2 * x**3,
    ]


def bracket_2(k, x):
    """Return the integrated right side of (2), without its constant."""
    L = LENGTH[k]
    M1, M2, M3, M4 = nodal_moments(k)
    return (
        (x - 11 / (4 * L) * x**2 + 9 / (3 * L**2) * x**3 - 9 / (8 * L**3) * x**4) * M1
        + (9 / (2 * L) * x**2 - 45 / (6 * L**2) * x**3 + 27 / (8 * L**3) * x**4) * M2
        + (-9 / (4 * L) * x**2 + 18 / (3 * L**2) * x**3 - 27 / (8 * L**3) * x**4) * M3
        + (1 / (2 * L) * x**2 - 9 / (6 * L**2) * x**3 + 9 / (8 * L**3) * x**4) * M4
    ) / EI[k]


def bracket_3(k, x):
    """Return the right side of (3), without its constants."""
    L = LENGTH[k]
    M1, M2, M3, M4 = nodal_moments(k)
    return (
        (x**2 / 2 - 11 / (12 * L) * x**3 + 9 / (12 * L**2) * x**4 - 9 / (40 * L**3) * x**5) * M1
        + (9 / (6 * L) * x**3 - 45 / (24 * L**2) * x**4 + 27 / (40 * L**3) * x**5) * M2
        + (-9 / (12 * L) * x**3 + 18 / (12 * L**2) * x**4 - 27 / (40 * L**3) * x**5) * M3
        + (1 / (6 * L) * x**3 - 9 / (24 * L**2) * x**4 + 9 / (40 * L**3) * x**5) * M4
    ) / EI[k]


def bracket_5(k, x, times=1):
    """Return the right side of (5), without its constant; `times` repeats the N_k1 term, as in the extracted text."""
    L = LENGTH[k]
    N1, N2, N3 = nodal_pulls(k)
    first = x - 3 / (2 * L) * x**2 + 2 / (3 * L**2) * x**3
    second = 4 / (2 * L) * x**2 - 4 / (3 * L**2) * x**3
    third = -1 / (2 * L) * x**2 + 2 / (3 * L**2) * x**3
    return (times * first * N1 + second * N2 + third * N3) / EA[k]


def errata():
    """Yield erratum, exact value, corrected formula, printed formula, and least relative error of the printed one."""
    values, (s1, c1), (s2, c2) = REFERENCE, *((sin(angle), cos(angle)) for angle in THETA[:2])
    for k in range(3):
        # the third bracket of (2) ends with the cube; a third of the link is interpolated
        exact = moment(k, 0.9 * LENGTH[k])
        corrected, printed = (
            sum(part * M for part, M in zip(shapes(0.9, power), nodal_moments(k), strict=True)) for power in (3, 1)
        )
        yield "1", exact, corrected, printed, 0.5
        x = 0.6 * LENGTH[k]
        yield "3: the N_k1 term occurs once", stretched(k, x), bracket_5(k, x), bracket_5(k, x, times=1 + 16 / 2), 0.5
    N1, N2, N3 = nodal_pulls(2)
    ends = [-LENGTH[2] / rigidity[2] * (N1 / 6 + 2 * N2 / 3 + N3 / 6) for rigidity in (EA, EI)]
    yield "2, ux3l: Hooke's law divides by EA", values["ux3l"], *ends, 1e4
    # cantilever with an end moment of 1: w = M l^2/2 EI (Gere, Goodno, 8th ed., Table H-1)
    yield "4: (7) is complete only without a moment at the end", 1 / 2, sum(TIP), sum(TIP[:3]), 0.02
    left = values["ux20"] * s2 + values["uy20"] * c2
    along, across = values["ux1l"] * c1 - values["uy1l"] * s1, values["ux1l"] * s1 + values["uy1l"] * c1
    yield "5: uy1l is multiplied by cos(theta_1)", left, across, values["ux1l"] * s1 + values["uy1l"] * c2, 0.3
    yield (
        "6: (11) subtracts the bracket of (10)",
        values["uy20"],
        across * c2 - along * s2,
        across * c2 - across * s2,
        0.6,
    )
    # theta_3' is along C to D, and ux3l is the displacement of C along this axis
    at_c = complex(values["ux2l"], values["uy2l"]) * np.exp(1j * THETA[1])
    angles = phase(D - C), phase(C - B)
    yield "7", values["ux3l"], *((at_c * np.exp(-1j * angle)).real for angle in angles), 0.5
    yield "8: the rocker is at rest at x'_3 = l_3", values["ux3l"], -stretched(2, LENGTH[2]), 0.0, 0.9
    turned, clamped = values["Phi30"] * LENGTH[2], deflected(2, LENGTH[2])
    yield "8", values["uy3l"], -turned - clamped, 0.0, 0.9
    yield "9: theta_3 means theta_3'", values["uy2l"], *(uy2l(angle) for angle in (THETA[2], THETA[2] + tau / 2)), 0.5
    M1, M2, M3, _ = nodal_moments(1)
    turned = (values["uy2l"] - values["uy20"]) / LENGTH[1]
    slopes = (turned - LENGTH[1] / EI[1] * (3 / 10 * M + 3 / 40 * M3) for M in (M2, M1))
    yield "10: 3/10 belongs to M_22", values["Phi20"], *slopes, 0.5


TIP = 13 / 120, 3 / 10, 3 / 40, 1 / 60
"""Factors of the nodal moments in the deflection of a cantilever's end, l^2/EI."""


def uy2l(theta_3):
    """Return uy2l by the printed formula."""
    t2, t3 = THETA[1], THETA[2]
    ux2l, ux3l = REFERENCE["ux2l"], REFERENCE["ux3l"]
    first = -ux2l * cos(t2) + ux3l * cos(theta_3)
    second = -ux2l * sin(t2) + ux3l * sin(theta_3)
    return (-first * cos(theta_3) - second * sin(theta_3)) / (sin(t2) * cos(theta_3) - sin(t3) * cos(t2))


@pytest.mark.parametrize(
    ("exact", "corrected", "printed", "least"), [pytest.param(*row, id=name) for name, *row in errata()]
)
def test_the_printed_formula_fails_and_the_corrected_one_passes(exact, corrected, printed, least):
    assert corrected == pytest.approx(exact, rel=1e-11)
    assert abs(printed / exact - 1) > least


def test_other_formulas_of_the_paper_are_right():
    between = THETA[1] - THETA[2]
    ux2l, ux3l = REFERENCE["ux2l"], REFERENCE["ux3l"]
    assert passes((ux2l * cos(between) - ux3l) / sin(between), "uy2l")
    assert passes((ux2l - ux3l * cos(between)) / sin(between), "uy3l")
    for k in range(3):
        x, moments = 0.7 * LENGTH[k], nodal_moments(k)
        assert bracket_2(k, x) == pytest.approx(slope(k, x), rel=1e-12)
        assert bracket_3(k, x) == pytest.approx(deflected(k, x), rel=1e-12)
        at_end = LENGTH[k] / EI[k] * np.dot((1, 3, 3, 1), moments) / 8
        assert at_end == pytest.approx(slope(k, LENGTH[k]), rel=1e-12)
    M1, M2, M3, M4 = nodal_moments(0)
    assert M4 == 0
    assert passes(LENGTH[0] ** 2 / EI[0] * np.dot(TIP, (M1, M2, M3, M4)), "uy1l")
    _, M2, M3, _ = nodal_moments(2)
    assert passes((-REFERENCE["uy3l"] - LENGTH[2] ** 2 / EI[2] * (3 / 10 * M2 + 3 / 40 * M3)) / LENGTH[2], "Phi30")
