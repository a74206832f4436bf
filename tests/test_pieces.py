"""Each piece of a beam holds complete fields, and one registry defines all derived fields."""

import mpmath
import numpy as np
import pytest
from mechanisms import ALL, cantilever, elastic_guide, motion_of, steel_four_bar, still
from msgspec.structs import replace

import elastic
import elastic.assessment
import elastic.beams
import elastic.vibration
from animations import DIAGRAMS, Style, diagram_named, movie
from elastic import FIELDS, PRIMARY, Section, Taper, coefficients, deflection, extremes, sample, without_positions
from elastic.beams.polynomials import at_marks, greatest_at, turning_points
from elastic.beams.taper import piece_ends
from rigid import Beam, Link, Mechanism, PointLoad, Slider, motion

L, EA, EI, GA = 0.8, 4e6, 900.0, 3e5
STEEP = Taper(EA=(1.0, -0.9), EI=tuple(np.polynomial.Polynomial([1.0, -0.9]).__pow__(3).coef), kGA=(1.0, -0.9))
XI = (0.0, 0.013, 0.4, 0.77, 0.96, 1.0)


def on_pieces(solved, field):
    """Return values at `XI` of the single beam, by the powers of the coordinate on each piece."""
    division, values = solved.division, coefficients(solved, field)
    ends = division.start[:, 0] + division.width[:, 0]
    rows = [int(np.argmax(ends >= xi - 1e-15)) for xi in XI]
    ways = [(xi - division.start[row, 0]) / division.width[row, 0] for xi, row in zip(XI, rows, strict=True)]
    return [np.polynomial.polynomial.polyval(way, values[:, row, 0]) for way, row in zip(ways, rows, strict=True)]


def integrals(N, V, M, fall):
    """Return u, w, phi at `XI` from N/EA, M/EI, -V/kGA by mpmath; `fall` has the powers of the taper."""

    def integral_to(function, x):
        return mpmath.quad(function, mpmath.linspace(0, x, 9)) if x else mpmath.mpf(0)

    def curvature(s):
        return M(s) / (EI * fall(s) ** 3)

    return {
        "u": [integral_to(lambda s: N(s) / (EA * fall(s)), xi * L) for xi in XI],
        "phi": [integral_to(curvature, xi * L) for xi in XI],
        "w": [integral_to(lambda s, x=xi * L: (x - s) * curvature(s) - V(s) / (GA * fall(s)), xi * L) for xi in XI],
    }


def assert_fields(solved, expected, tolerance):
    for field, values in expected.items():
        exact = np.array([float(value) for value in values])
        for found in (on_pieces(solved, field), sample(solved, field, XI)[0, 0]):
            np.testing.assert_allclose(found, exact, rtol=0, atol=tolerance * np.abs(exact).max(), err_msg=field)


class TestTapered:
    def test_pieces_agree_with_quadrature(self):
        """A beam that loses nine tenths of its depth in tension, bending and shear; reference: 15-digit quadrature."""
        force, moment = 900 - 120j, 7.0
        loads = (PointLoad("beam", "B", force, moment),)
        solved = deflection(still(cantilever({"A": 0, "B": L}, loads=loads)), [Section(EA, EI, GA, taper=STEEP)])
        assert len(solved.division.beam) > 3
        expected = integrals(
            lambda s: force.real,
            lambda s: -force.imag,
            lambda s: moment + force.imag * (L - s),
            lambda s: 1 - mpmath.mpf("0.9") * s / L,
        )
        assert_fields(solved, expected, 1e-13)
        np.testing.assert_allclose(
            on_pieces(solved, "M"), [moment + force.imag * L * (1 - xi) for xi in XI], atol=1e-12
        )

    def test_loads_of_a_high_degree(self):
        """Weight grows with the 19th power on a tapered beam: V = w L (1 - xi^20)/20, and M is its integral."""
        mass = (0.0,) * 19 + (2.0,)
        beam = cantilever({"A": 0, "B": L}, 1.0, gravity=-10j)
        link = beam.links[1]
        heavy = replace(link, beams=(replace(link.beams[0], mass_taper=mass),))
        mechanism = replace(beam, links=(beam.links[0], heavy))
        taper = Taper(EA=(1.0, -0.5), EI=(1.0, -1.5, 0.75, -0.125), kGA=(1.0, -0.5))
        solved = deflection(still(mechanism), [Section(EA, EI, GA, taper=taper)])
        expected = integrals(
            lambda s: mpmath.mpf(0),
            lambda s: L * (1 - (s / L) ** 20),
            lambda s: -L * (L - s - L / 21 * (1 - (s / L) ** 21)),
            lambda s: 1 - s / L / 2,
        )
        assert_fields(solved, expected, 1e-13)

    def test_pieces_get_shorter_near_the_pole(self):
        """A constant section has one piece; a strong taper has more and shorter pieces near its thin end."""
        assert piece_ends(Section(EA, EI, taper=Taper())) == (0.0, 1.0)
        thin = [np.diff(piece_ends(Section(EA, EI, taper=Taper(EI=(1.0, -left))))) for left in (0.5, 0.9, 0.999)]
        assert [len(widths) for widths in thin] == sorted({len(widths) for widths in thin})
        assert all((np.diff(widths) <= 0).all() for widths in thin)

    @pytest.mark.parametrize("name", ["RRR", "six-bar", "triad"])
    def test_a_constant_taper_changes_nothing(self, name):
        case = ALL[name]()
        course = motion_of(case)
        plain = deflection(course, case.sections)
        constant = Taper(EA=(1.0, 1e-17), EI=(1.0, 1e-17))
        tapered = deflection(course, [replace(section, taper=constant) for section in case.sections])
        for field in (*PRIMARY, "chord"):
            one, other = sample(plain, field, XI), sample(tapered, field, XI)
            np.testing.assert_allclose(other, one, rtol=0, atol=1e-13 * np.abs(one).max())
        np.testing.assert_allclose(tapered.condition, plain.condition, rtol=1e-9)


class TestBlocks:
    def test_at_a_block_displacements_are_smooth_and_forces_jump(self):
        case = elastic_guide()
        solved = deflection(motion_of(case), case.sections)
        (block,) = solved.blocks
        before, beyond = solved.division.of_beam(block.beam)
        np.testing.assert_array_equal(solved.division.start[beyond], block.xi)
        jumps = {
            "N": -block.force.real,
            "V": block.force.imag,
            "M": -block.moment + 0 * block.xi,
            "u": 0,
            "w": 0,
            "phi": 0,
        }
        for field, jump in jumps.items():
            values = coefficients(solved, field)
            step = values[0, beyond] - values[:, before].sum(axis=0)
            np.testing.assert_allclose(step, jump, rtol=0, atol=1e-13 * np.abs(values).max(), err_msg=field)
        assert np.abs(jumps["V"]).max() > 1.0


@pytest.fixture(scope="module")
def bent():
    """Return the steel four-bar with dimensioned sections."""
    case = steel_four_bar(24)
    known = {"area": 6e-5, "inertia": 1.8e-10, "fibre": 0.003, "peak_shear": 1.5}
    course = motion(case.mechanism, case.drive, case.rate)
    return deflection(course, [replace(section, **known) for section in case.sections])


class TestRegistry:
    @pytest.mark.parametrize("key", FIELDS)
    def test_extremes_bound_a_fine_grid(self, bent, key):
        found, grid = extremes(bent, [key])[key], sample(bent, key, np.linspace(0, 1, 501))
        largest = np.abs(grid).max(axis=-1)
        assert (np.abs(found.value) >= largest * (1 - 1e-12)).all()
        np.testing.assert_allclose(np.abs(found.value), largest, rtol=1e-3, atol=1e-6 * largest.max())
        assert FIELDS[key].signed or (grid >= 0).all()
        there = np.array([[sample(bent, key, [xi])[beam, k, 0] for k, xi in enumerate(row)]
                          for beam, row in enumerate(found.xi)])  # fmt: skip
        np.testing.assert_allclose(there, found.value, rtol=1e-9, atol=1e-12 * largest.max())

    def test_integrals_have_the_unit_and_slope_of_their_source(self, bent):
        """N' = -q_x, V' = q_y, M' = V, u' = N/EA, phi' = M/EI, w' = phi."""
        section, length = bent.sections[0], bent.length[:, 0]
        factor = {"N": -1.0, "V": 1.0, "M": 1.0, "u": 1 / section.EA, "phi": 1 / section.EI, "w": 1.0}
        for key in PRIMARY:
            values, source = coefficients(bent, key), coefficients(bent, FIELDS[key].integral_of)
            slope = values[1:] * np.arange(1, len(values))[:, None, None] / length[:, None]
            expected = factor[key] * source
            np.testing.assert_allclose(slope, expected[: len(slope)], rtol=0, atol=1e-12 * np.abs(expected).max())

    def test_stresses_of_the_section_forces(self, bent):
        N, V, M = (sample(bent, key, XI) for key in "NVM")
        left, right = N / 6e-5 - M * 0.003 / 1.8e-10, N / 6e-5 + M * 0.003 / 1.8e-10
        shear = 1.5 * V / 6e-5
        fibre = np.maximum(np.abs(left), np.abs(right))
        expected = {
            "shear": shear,
            "normal": np.where(np.abs(left) >= np.abs(right), left, right),
            "mises": np.maximum(fibre, np.sqrt((N / 6e-5) ** 2 + 3 * shear**2)),
        }
        for key, values in expected.items():
            np.testing.assert_allclose(sample(bent, key, XI), values, rtol=1e-12, atol=1e-12 * np.abs(values).max())

    def test_every_field_has_a_diagram_by_key_and_name(self):
        assert {diagram.field for diagram in DIAGRAMS.values()} == {None, *FIELDS}
        for key, field in FIELDS.items():
            assert diagram_named(key) is diagram_named(field.slug)
        with pytest.raises(ValueError, match=r'no diagram "tresca".*von-mises-stress'):
            diagram_named("tresca")

    def test_stress_diagrams_need_section_dimensions(self, tmp_path):
        case = steel_four_bar(4)
        unknown = deflection(motion(case.mechanism, case.drive, case.rate), case.sections)
        with pytest.raises(ValueError, match="von Mises stress is unknown, because the sections have no dimensions"):
            movie(unknown, "mises", tmp_path / "mises.mp4", 2, Style(size=(320, 192)))

    def test_masked_positions_are_nan_in_every_field(self, bent):
        lost = np.arange(24) == 5
        known = without_positions(bent, lost)
        for key, field in FIELDS.items():
            before, after = sample(bent, key, XI), sample(known, key, XI)
            if field.kind is not elastic.FieldKind.LOAD:
                assert np.isnan(after[:, 5]).all()
            np.testing.assert_array_equal(after[:, ~lost], before[:, ~lost])
        np.testing.assert_array_equal(known.condition, bent.condition)


def test_repr_of_results_is_one_line():
    case = elastic_guide()
    solved = deflection(motion(case.mechanism, case.drive, case.rate), case.sections)
    for result in (solved, extremes(solved)["w"], case.sections[0], Section(np.ones((5000, 1)), 1.0)):
        assert len(repr(result)) < 100
        assert "\n" not in repr(result)
    assert repr(Section(2e6, np.array([[1.0], [2.0]]), taper=STEEP)) == "Section(EA=2e+06, EI=of 2 designs, tapered)"


@pytest.mark.parametrize("count", [3, 4, 5, 8, 11])
def test_turning_points_bracket_the_maximum(count):
    """Reference: roots of the slope by companion matrices; some coefficients are zero, some roots at the ends."""
    draw = np.random.default_rng(count)
    values = draw.normal(size=(count, 400)) * (draw.uniform(size=(count, 400)) > 0.2)
    values[1, ::7] = 0.0
    marks, heights = at_marks(values, turning_points(values))
    assert (np.diff(marks, axis=0) >= 0.0).all()
    for one, found in zip(values.T, greatest_at(marks, heights)[0], strict=True):
        polynomial = np.polynomial.Polynomial(one)
        roots = polynomial.deriv().roots()
        inside = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)]
        greatest = np.abs(polynomial(np.array([0.0, 1.0, *inside]))).max()
        assert abs(found) == pytest.approx(greatest, rel=1e-9, abs=1e-12)


class TestMembers:
    """A straight run of beams of one link bends as one member, for any direction of the beams."""

    @pytest.mark.parametrize("pairs", [("AB",), ("AM", "MB"), ("AM", "BM"), ("MA", "MB"), ("NM", "MB", "AN")])
    def test_the_chord_is_that_of_the_whole_member(self, pairs):
        """Supported beam under its weight q: w = -q x (l^3 - 2 l x^2 + x^3)/24 EI (Euler-Bernoulli)."""
        points, q = {"A": 0.0, "N": 0.2, "M": 0.5, "B": 1.0}, 3.0
        beams = tuple(Beam(*pair, q / 9.81) for pair in pairs)
        bar, block = Link("bar", points, beams), Link("block", {"B": 0})
        guide = Slider("guide", "block", "ground", "B", 0.0, 1.0)
        mechanism = Mechanism((Link("ground", {"A": 0}), bar, block), (), {"A": 0, "B": 1.0}, (guide,), gravity=-9.81j)
        bent = deflection(motion(mechanism, np.zeros((0, 1))), [Section(EA, EI)] * len(beams))
        for beam, values in zip(beams, sample(bent, "chord", XI)[:, 0], strict=True):
            start, end = points[beam.start], points[beam.end]
            x = start + (end - start) * np.array(XI)
            across = np.sign(end - start) * -q * x * (1 - 2 * x**2 + x**3) / (24 * EI)
            np.testing.assert_allclose(values, across, rtol=0, atol=1e-15)
