"""The estimates by shear and load introduction predict the error of beam theory within a factor of two."""

import numpy as np
import pytest
from mechanisms import cantilever, still, supported
from tiers import in_tiers

from elastic import RIGID, Section, Taper, deflection, displacement_of, extremes, sample, section_of, tube
from elastic.assessment import beyond_beam_theory, introduction_share, sections_with_shear, shear_share
from fem_check import compare_solid, solve_solid
from kinelast import read_scene, scene_motion, shipped_scenes
from rigid import Beam, LineLoad, Link, Mechanism, PointLoad, Slider, motion

E = 210e9
UNIFORM = supported({"A": 0, "B": 1.0}, loads=(LineLoad("beam", 0, -1j, -1j),))
DRIVEN = cantilever({"A": 0, "B": 1.0}, loads=(PointLoad("beam", "B", -1j),))


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_shear_of_a_rectangle(poisson):
    """Unknown shape: 48 EI/(5 kGA l^2), with k by Cowper."""
    EA, EI = 1200.0, 1.0
    kGA = 10 * (1 + poisson) / (12 + 11 * poisson) * EA / (2 * (1 + poisson))
    share = shear_share(deflection(still(UNIFORM), [Section(EA, EI)]), poisson)
    np.testing.assert_allclose(share, [48 * EI / (5 * kGA)], rtol=1e-12)


def test_shear_of_a_known_shape_that_is_not_to_shear():
    """The section's own shear coefficient applies, as in Timoshenko's beam; sections with shear need none."""
    shape = tube(0.1, 0.09)
    known, sheared = (section_of(shape, E, 0.25, shear=counts) for counts in (False, True))
    assert np.isinf(known.kGA)
    found = [deflection(still(UNIFORM), [part]) for part in (known, sheared)]
    share = extremes(found[1], ["chord"])["chord"].value / extremes(found[0], ["chord"])["chord"].value - 1
    np.testing.assert_allclose(shear_share(found[0]), share[:, 0], rtol=1e-12)
    assert share[0, 0] > 1.3 * shear_share(deflection(still(UNIFORM), [Section(known.EA, known.EI)]))[0]
    assert not shear_share(found[1]).any()


def test_tapered_and_rigid_beams_and_designs():
    EA = np.array([[600.0], [1200.0]])
    tapering = Section(EA, 1.0, taper=Taper(EA=(1.0, -0.5), EI=(1.0, -0.5)))
    share = shear_share(deflection(still(UNIFORM), [tapering]))
    assert share.shape == (1, 2)
    np.testing.assert_allclose(share[0, 0], 2 * share[0, 1], rtol=1e-12)
    assert 0.0245 < share[0, 1] < 0.04
    assert not shear_share(deflection(still(UNIFORM), [RIGID])).any()
    assert not introduction_share(deflection(still(UNIFORM), [RIGID])).any()


@pytest.mark.parametrize("slender", in_tiers([5, 10, 30, 200], 2, 2))
@pytest.mark.parametrize("name", ["uniform", "driven", "hanging"])
def test_the_estimate_is_within_a_factor_of_two_of_plane_bodies(name, slender):
    hanging = cantilever({"A": 0, "B": 1.0}, loads=(LineLoad("beam", 0, -1j, -1j),))
    mechanism = {"uniform": UNIFORM, "driven": DRIVEN, "hanging": hanging}[name]
    solved = deflection(still(mechanism), [Section(EA=float(slender) ** 2, EI=1.0)])
    estimate = max(shear_share(solved)[0], introduction_share(solved)[0])
    assert 0.5 < estimate / compare_solid(solved).relative < 2.0


@pytest.mark.parametrize("name", ["uniform", "driven"])
def test_the_corrected_deflection_is_that_of_plane_bodies(name):
    """For a slenderness of ten, the change of the largest chord deflection is accurate to within a factor of two."""
    solved = deflection(still({"uniform": UNIFORM, "driven": DRIVEN}[name]), [Section(EA=100.0, EI=1.0)])
    whole = beyond_beam_theory(solved)
    chord, more = (np.abs(sample(bent, "chord", np.linspace(0.0, 1.0, 33))).max() for bent in (solved, whole))
    assert 0.5 < (more - chord) / (compare_solid(solved).relative * chord) < 2.0


def test_a_beam_on_two_supports_shears_by_the_closed_form():
    """The shear deflection in the middle is q l^2/(8 kGA), without moment; a beam with shear is returned unchanged."""
    solved = deflection(still(UNIFORM), [Section(EA=1200.0, EI=1.0)])
    whole = beyond_beam_theory(solved, poisson=0.3)
    kGA = 1200.0 * 13 / 15.3 / 2.6  # Cowper's rectangle
    change = sample(whole, "w", [0.5]) - sample(solved, "w", [0.5])
    np.testing.assert_allclose(change[0, 0, 0], -1 / (8 * kGA), rtol=1e-9)
    assert beyond_beam_theory(whole) is whole


@pytest.mark.parametrize(
    ("lean", "share"), [(0.0, 0.0), (np.pi / 6, 2 * np.sin(np.pi / 12) / np.sqrt(2)), (np.pi / 2, 1.0)]
)
def test_the_share_of_moments_grows_with_the_angle_of_a_corner(lean, share):
    """Bar with a bend in the middle, pinned at both ends: the share is 0.28 M/kGA times a factor of the angle."""
    points = {"A": 0.0, "C": 0.5, "B": 0.5 + 0.5 * np.exp(1j * lean)}
    links = Link("ground", {"A": 0.0}), Link("bar", points, (Beam("A", "C"), Beam("C", "B"))), Link("block", {"B": 0.0})
    guide = Slider("guide", "block", "ground", "B", points["B"], points["B"] / abs(points["B"]))
    load = LineLoad("bar", 0, -1j, -1j)
    held = motion(Mechanism(links, (), points, (guide,), loads=(load,)), np.zeros((0, 1)))
    solved = deflection(held, [Section(EA=1200.0, EI=1.0, kGA=400.0)] * 2)
    chord = np.abs(sample(solved, "chord", np.linspace(0.0, 1.0, 33))).max(axis=(1, 2))
    moment = np.abs(sample(solved, "M", [1.0])[0, 0, 0])
    assert moment > 0
    np.testing.assert_allclose(introduction_share(solved), 0.28 * share * moment / 400.0 / chord, atol=1e-12)


@pytest.mark.parametrize(("turn", "within"), in_tiers([(45, 0.35), (63, 0.1), (90, 0.2), (120, 0.25)], 1, 3))
def test_the_stiffness_of_a_corner_is_that_of_plane_bodies(turn, within):
    """Slenderness 20, bent by a moment: displacement of the end relative to the line through the first leg."""
    points = {"A": 0.0, "C": 1.0, "B": 1.0 + np.exp(1j * np.radians(turn))}
    mechanism = cantilever(points, loads=(PointLoad("beam", "B", moment=1.0),))
    solved = deflection(still(mechanism), [Section(EA=12 / 0.05**2, EI=1.0)] * 2)
    estimate = _bent_end(points, *(displacement_of(beyond_beam_theory(solved), "beam", name)[0] for name in points))
    plain = _bent_end(points, *(displacement_of(solved, "beam", name)[0] for name in points))
    solid = solve_solid(solved.motion, solved.sections, across=8)
    response, loads = solid.bodies[1], solid.loads[1][:, 0]
    places = np.array(response.body.outline.points)
    pins = [(loads @ response.points)[np.abs(places - place).argmin()] for place in points.values()]
    assert estimate - plain == pytest.approx(_bent_end(points, *pins) - plain, rel=within)
    assert estimate < plain


def _bent_end(points, start, corner, end):
    """Return the displacement of the end across the second leg, relative to the line through the first leg."""
    first, second = points["C"] - points["A"], points["B"] - points["C"]
    turned = ((corner - start) / first).imag
    return (np.conj(1j * second) * (end - corner - 1j * turned * second)).real


@pytest.mark.parametrize("name", ["steel_four_bar", "flapping_wing", "flap_plates", "quick_return"])
def test_the_share_of_shear_equals_that_of_a_solution_with_shear(name):
    """This holds also if statics alone gives the forces, so that no second solution is needed."""
    scene = read_scene(shipped_scenes()[name])
    bent = deflection(scene_motion(scene, 24), scene.sections, joints=scene.joints)
    xi = np.linspace(0.0, 1.0, 33)
    with_shear = deflection(bent.motion, sections_with_shear(bent.sections), bent.joints)
    change = np.abs(sample(with_shear, "chord", xi) - sample(bent, "chord", xi)).max(axis=(-2, -1))
    largest = np.abs(sample(bent, "chord", xi)).max(axis=(-2, -1))
    np.testing.assert_allclose(
        shear_share(bent), change / np.maximum(largest, 0.01 * largest.max()), rtol=1e-8, atol=1e-12
    )
