"""Plane-stress bodies agree with the theory of elasticity, and measure the error of beam theory.

S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed., 1970: article 21, the end-loaded cantilever, and
article 22, the beam under a uniform load.
"""

import numpy as np
import pytest
from mechanisms import ALL, cantilever, four_bar, motion_of, steel_four_bar, still, supported
from msgspec.structs import replace
from scipy.interpolate import CubicSpline
from skfem import FacetBasis, LinearForm, condense, solve
from test_fem_beam import held
from tiers import in_tiers

from elastic import RIGID, Section, Taper, deflection, i_section, sample, section_of
from fem_check import compare_solid, solve_solid
from fem_check.solid.body import SolidLink
from fem_check.solid.outline import SolidOutline, Strip
from fem_check.solid.solution import responses
from rigid import Beam, Friction, LineLoad, Link, Lump, PointLoad, motion

NU = 0.3


def section(depth, EI=1.0):
    """Return a rectangular section."""
    return Section(EA=12 * EI / depth**2, EI=EI)


class TestTheoryOfElasticity:
    @staticmethod
    def cantilever_errors(across, depth=0.3, EA=7.0, force=1.0):
        """Return the L2 error of the displacement and the energy of the error, for a body loaded at its end."""
        body = SolidLink(SolidOutline((0j, 1 + 0j), (Strip(0, 1, (EA,), (EA * depth**2 / 12,)),)), NU, across)
        basis, end = body.basis, 1 + depth / 2  # the body extends beyond its points by half its depth
        EI, GI, L = EA * depth**2 / 12, EA * depth**2 / 12 / (2 * (1 + NU)), 1 + depth
        turned = force * L**2 / (2 * EI) - force * depth**2 / (8 * GI)

        def exact(x, y):
            s = end - x
            u = force * (s**2 * y / (2 * EI) + NU * y**3 / (6 * EI) - y**3 / (6 * GI)) - turned * y
            w = force * (NU * s * y**2 / (2 * EI) + s**3 / (6 * EI) - L**2 * s / (2 * EI) + L**3 / (3 * EI))
            return u, w

        (ix, iy), given = basis.split_indices(), np.zeros(basis.N)
        given[ix], given[iy] = exact(*basis.doflocs[:, ix])[0], exact(*basis.doflocs[:, iy])[1]
        loaded = basis.mesh.facets_satisfying(lambda x: np.isclose(x[0], end))
        facets = FacetBasis(basis.mesh, basis.elem, facets=loaded, intorder=6)
        shear = LinearForm(lambda v, at: 6 * force / depth**3 * (depth**2 / 4 - at.x[1] ** 2) * v[1])
        root = basis.get_dofs(lambda x: np.isclose(x[0], end - L))
        found = solve(*condense(body.stiffness(), shear.assemble(facets), x=given, D=root))
        field, (x, y) = basis.interpolate(found), np.asarray(basis.global_coordinates())
        off = np.asarray(field) - np.array(exact(x, y))
        moment, shearing = -force * (end - x) * y / EI, force * (depth**2 / 4 - y**2) / (2 * GI)
        strain = np.asarray(field.grad) - np.array([[moment, shearing / 2], [shearing / 2, -NU * moment]])
        xx, yy, xy = strain[0, 0], strain[1, 1], strain[0, 1] + strain[1, 0]
        energy = EA / depth / (1 - NU**2) * (xx**2 + yy**2 + 2 * NU * xx * yy + (1 - NU) / 2 * xy**2)
        return np.sqrt(((off**2).sum(axis=0) * basis.dx).sum()), (energy * basis.dx).sum()

    @pytest.mark.slow
    def test_end_loaded_cantilever_converges(self):
        """Biquadratic elements: order 3 for the displacement, order 4 for the energy."""
        errors = np.array([self.cantilever_errors(across) for across in (8, 16, 32)])
        orders = np.log2(errors[:-1] / errors[1:])
        np.testing.assert_allclose(orders[:, 0], 3.0, atol=0.2)
        np.testing.assert_allclose(orders[:, 1], 4.0, atol=0.2)

    @pytest.mark.parametrize("poisson", in_tiers([0.0, 0.3, 0.49], 1, 2))
    def test_uniform_load_on_two_supports(self, poisson):
        """5 q l^4/(384 EI) (1 + 12/5 (h/l)^2 (4/5 + 5 nu/6)), apart from the effect of the pins.

        Article 22 has 4/5 + nu/2 for a load on the edge. A load spread over the depth adds the stress -q y/h across
        the beam. Its strain bends the beam by nu q h^2/12, which changes nu/2 to 5 nu/6.
        """
        uniform = supported({"A": 0, "B": 1.0}, loads=(LineLoad("beam", 0, -1j, -1j),))
        left = []
        for depth in (0.1, 0.05, 0.025):
            chord = solve_solid(still(uniform), [section(depth)], poisson, 8).chord[0]
            left.append((-chord.min() * 384 / 5 - 1) / (2.4 * depth**2 * (0.8 + 5 * poisson / 6)) - 1)
        np.testing.assert_allclose(left[1:], 0.0, atol=0.021)
        np.testing.assert_allclose(np.array(left[:-1]) / left[1:], 2.0, atol=0.2)


class TestLoads:
    outline = SolidOutline(
        (0j, 1 + 0j, 0.3 + 0.6j),
        (
            Strip(0, 1, (12e3, -2e3), (1.0, -0.4), (3.0,)),
            Strip(2, 1, (9e3,), (2.0,), (1.0, 2.0)),
            Strip(0, 2, (12e3,), (3.0,), (0.5,)),
        ),
    )

    def test_pin_forces_balance_the_load(self):
        body = SolidLink(self.outline, NU, 4)
        for k, place in enumerate(self.outline.points):
            np.testing.assert_allclose(
                body.pin(k) @ body.rigid_motions.T, [[1, 0, -place.imag], [0, 1, place.real], [0, 0, 1]], atol=1e-13
            )

    def test_inertia_has_the_mass_of_the_beams(self):
        body = SolidLink(self.outline, NU, 4)
        mass = sum(
            abs(self.outline.way(strip)) * np.polynomial.Polynomial(strip.mass).integ()(1.0)
            for strip in self.outline.strips
        )
        falling = body.load_vector(
            body.spread * body.along(lambda strip, xi: np.polynomial.Polynomial(strip.mass)(xi)) * 1j
        )
        assert falling @ body.rigid_motions[1] == pytest.approx(mass, rel=3e-3)
        assert body.spread.ravel() @ body.basis.dx.ravel() == pytest.approx(
            sum(abs(self.outline.way(strip)) for strip in self.outline.strips), rel=1e-12
        )

    def test_rigid_motions_are_free(self):
        body = SolidLink(self.outline, NU, 4)
        forces = body.stiffness() @ body.rigid_motions.T
        assert np.abs(forces).max() < 1e-10 * np.abs(body.stiffness()).max()

    def test_the_support_of_a_link_does_not_matter(self):
        """Balanced loads need no support: lumps, joint forces and inertia sum to zero."""
        case = four_bar()
        slender = [section(0.01)] * 3
        mechanism = replace(case.mechanism, links=case.mechanism.links)
        found = solve_solid(motion(mechanism, case.drive, 0.0), slender)
        for at, held_at in found.bodies.items():
            loads = found.loads[at]
            others = responses(held_at.body.outline, (1,), NU, 4)
            one, other = (loads.T @ part.on_axis(0).imag for part in (held_at, others))
            xi = held_at.body.grid.xi[0]
            one, other = (w - w[:, :1] * (1 - xi) - w[:, -1:] * xi for w in (one, other))
            np.testing.assert_allclose(one, other, atol=1e-7 * np.abs(one).max())


class TestAgainstBeamTheory:
    def test_cantilever(self):
        """A massless arm under a force at its end: the chord deflection has no shear."""
        bent = deflection(still(cantilever({"A": 0, "B": 1.0}, loads=(PointLoad("beam", "B", -1j),))), [section(0.02)])
        found = compare_solid(bent)
        assert found.largest[0] == pytest.approx(1 / 3 * 3**-0.5 / 3, rel=2e-3)
        assert found.relative < 1e-3

    @pytest.mark.parametrize("name", in_tiers(ALL, 2, 7))
    def test_all_mechanisms(self, name):
        """With slender beams and every kind of load, the difference is a few per cent on links that are bodies."""
        case = ALL[name]()
        lengths = [
            abs(link.points[b.end] - link.points[b.start]) for link in case.mechanism.links[1:] for b in link.beams
        ]
        bent = deflection(motion_of(case), [section(float(np.max(size)) / 80) for size in lengths])
        found = compare_solid(bent)
        assert found.relative < 0.03 or not found.by_link
        assert bool(found.by_link) == (found.compared > 0)
        assert set(found.left_out) <= {"rocker"}

    @pytest.mark.parametrize("change", in_tiers(["depth", "taper"], 0, 1))
    def test_the_difference_scales_with_the_square_of_the_depth(self, change):
        case = steel_four_bar(36)
        taper = Taper(EA=(1.0, -0.5), EI=(1.0, -1.5, 0.75, -0.125)) if change == "taper" else None
        off = []
        for depth in (0.024, 0.012, 0.006):
            sections = [replace(section(depth), taper=taper)] * 3
            off.append(compare_solid(deflection(motion_of(case), sections), across=8).relative)
        np.testing.assert_allclose(np.log2(np.array(off[:-1]) / off[1:]), 2.0, atol=0.2)

    def test_shear_explains_most_of_the_difference(self):
        """The exception is the crank, where the pin introduces the drive moment."""
        case = steel_four_bar(36)
        bare = [section(0.02)] * 3
        shearing = [replace(part, kGA=5 / 6 * part.EA / (2 * (1 + NU))) for part in bare]
        found = [compare_solid(deflection(motion_of(case), parts), across=8).by_link for parts in (bare, shearing)]
        for link in ("coupler", "rocker"):
            assert found[0][link] > 0.01
            assert found[1][link] < 0.05 * found[0][link]
        assert found[1]["crank"] == pytest.approx(found[0]["crank"], rel=0.01)

    @pytest.mark.slow
    def test_a_hot_beam_of_a_ring(self):
        points = {"O": 0.0, "A": 1.0, "B": 0.5 + 0.8j}
        frame = Link("arm", points, (Beam("O", "A"), Beam("A", "B"), Beam("B", "O")))
        off = []
        for depth in (0.02, 0.01):
            parts = [replace(section(depth), strain=1e-3), section(depth), section(depth)]
            found = compare_solid(deflection(held(frame), parts))
            assert found.largest.max() > 1e-4
            off.append(found.relative)
        assert off[0] < 0.06
        assert off[0] / off[1] == pytest.approx(2.0, abs=0.1)  # corners as wide as the beams are deep do not bend

    def test_one_beam_and_two_collinear_beams_bend_alike(self):
        one = Link("arm", {"O": 0.0, "A": 1.0}, (Beam("O", "A", 2.0),), (Lump("A", 3.0),))
        two = Link("arm", {"O": 0.0, "C": 0.4, "A": 1.0}, (Beam("O", "C", 2.0), Beam("A", "C", 2.0)), (Lump("A", 3.0),))
        solid = [solve_solid(held(arm, gravity=-9.81j), [section(0.05)] * len(arm.beams)) for arm in (one, two)]
        whole = CubicSpline(solid[0].xi[0], solid[0].chord[0][0])
        for k, (start, end) in enumerate(((0.0, 0.4), (1.0, 0.4))):
            xi = solid[1].xi[k]
            expected = whole(start + (end - start) * xi) - whole(start) * (1 - xi) - whole(end) * xi
            expected *= np.sign(end - start)
            np.testing.assert_allclose(solid[1].chord[k][0], expected, atol=4e-3 * np.abs(expected).max())


class TestHousehold:
    def test_each_link_is_solved_once(self):
        responses.cache_clear()
        for count in (12, 24):
            case = steel_four_bar(count)
            solve_solid(motion_of(case), case.sections)
        assert responses.cache_info().misses == 3

    def test_rigid_links_and_rails_are_omitted(self):
        case = steel_four_bar(6)
        bent = deflection(motion_of(case), [RIGID, *case.sections[1:]])
        found = compare_solid(bent)
        assert set(found.by_link) == {"coupler", "rocker"}
        assert found.left_out == {"crank": "a beam is rigid"}
        assert np.isnan(found.difference).tolist() == [True, False, False]
        nothing = compare_solid(deflection(motion_of(case), [RIGID] * 3))
        assert nothing.compared == 0
        assert np.isnan(nothing.relative)

    def test_thin_walls_are_omitted(self):
        case = steel_four_bar(6)
        walls = section_of(i_section(0.02, 0.02, 0.002, 0.003), 210e9, 0.3)
        found = compare_solid(deflection(motion_of(case), [case.sections[0], walls, case.sections[2]]))
        assert set(found.left_out) == {"coupler"}
        assert found.left_out["coupler"].startswith("a beam is hollow or an I")

    def test_repr_is_one_line(self):
        case = steel_four_bar(6)
        solid = solve_solid(motion_of(case), case.sections)
        assert repr(solid) == "SolidSolution(3 links, 944 elements, 6 positions)"
        assert repr(compare_solid(deflection(motion_of(case), case.sections))).count("\n") == 0

    def test_misuse_is_an_error(self):
        case = steel_four_bar(3)
        turning = motion_of(case)
        with pytest.raises(ValueError, match="2 sections for 3 beams"):
            solve_solid(turning, case.sections[:2])
        with pytest.raises(ValueError, match="3 elements across"):
            solve_solid(turning, case.sections, across=3)
        with pytest.raises(ValueError, match="6 elements across: expected a multiple of 4"):
            compare_solid(deflection(turning, case.sections), across=6)
        with pytest.raises(ValueError, match="expected one design"):
            solve_solid(turning, [replace(case.sections[0], EA=np.ones((2, 1)))] * 3)

    def test_links_without_outline_are_omitted(self):
        case = steel_four_bar(3)
        deep = compare_solid(deflection(motion_of(case), [section(0.2)] * 3))
        assert set(deep.by_link) == {"coupler", "rocker"}
        assert deep.left_out == {"crank": "a beam of 0.1 m is as deep as it is long"}
        fork = Link("arm", {"O": 0.0, "A": 1.0, "B": 1 + 0.1j}, (Beam("O", "A"), Beam("O", "B")))
        found = solve_solid(held(fork), [section(0.1)] * 2)
        assert found.left_out["arm"].startswith("two beams meet at 5.71 degrees, 0.1 and 0.1 m deep")


def test_the_axis_deflection_agrees_with_elastic():
    """The fields agree at each station, not only their extremes."""
    case = steel_four_bar(12)
    bent, solid = deflection(motion_of(case), case.sections), solve_solid(motion_of(case), case.sections)
    for k, (xi, chord) in enumerate(zip(solid.xi, solid.chord, strict=True)):
        beam = sample(bent, "chord", xi)[k]
        np.testing.assert_allclose(chord, beam, atol=6e-3 * np.abs(beam).max())


def test_friction_equals_its_moments():
    """Viscous friction of a pin equals the same moments given as loads; Coulomb friction uses the same forces."""
    viscosity, made = 0.05, steel_four_bar().mechanism
    names = [link.name for link in made.links]
    coupler, rocker = names.index("coupler"), names.index("rocker")

    def sliding(moved):
        return moved.angular_velocity[rocker] - moved.angular_velocity[coupler]

    pair = (("rocker", -viscosity), ("coupler", viscosity))
    loads = tuple(PointLoad(link, "B", moment=moment, law=sliding) for link, moment in pair)
    rubbed = replace(made, friction={"B": Friction(viscosity=viscosity)})
    bars = [Section(EA=12.6e6, EI=37.8)] * 3
    one, other, bare = (
        solve_solid(motion(each, np.linspace(0.2, 5.0, 4), 30.0), bars, across=2)
        for each in (rubbed, replace(made, loads=loads), made)
    )
    for own, given in zip(one.chord, other.chord, strict=True):
        np.testing.assert_allclose(own, given, rtol=0, atol=1e-9 * np.abs(given).max())
    assert np.abs(one.chord[2] - bare.chord[2]).max() > 0.1 * np.abs(bare.chord[2]).max()
