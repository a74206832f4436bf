"""Finite elements alone: beams in closed form, orders of convergence, round-off; handbook: `test_elastic_line`."""

from fractions import Fraction

import numpy as np
import pytest
from fem_direct import Direct, orders
from numpy.polynomial import Polynomial

from elastic import Section
from fem_check import solve
from fem_check.linear.unit_beam import unit_beam
from rigid import Beam, LineLoad, Link, Lump, Mechanism, MechanismError, PinDrive, PointLoad, motion

EA, EI, LENGTH = 3e6, 700.0, 1.7


def held(link, **more):
    """Return a link clamped to the ground at O by its drive, horizontal and at rest."""
    drawing = {name: complex(place) for name, place in link.points.items()}
    mechanism = Mechanism((Link("ground", {"O": 0.0}), link), (PinDrive(link.name, "O"),), drawing, **more)
    return motion(mechanism, [0.0])


def cantilever(*loads, **more):
    return held(Link("arm", {"O": 0.0, "A": LENGTH}, (Beam("O", "A", more.pop("mass", 0.0)),)), loads=loads, **more)


def test_an_eccentric_lump_bends_by_its_weight_and_arm():
    mass, offset = 2.0, 0.1 + 0.2j
    arm = Link("arm", {"O": 0.0, "A": LENGTH}, (Beam("O", "A"),), (Lump("A", mass, 0.5, offset),))
    found = solve(held(arm, gravity=-9.81j), [Section(EA, EI)])
    weight = mass * 9.81
    sag = weight * LENGTH**3 / (3 * EI) + weight * 0.1 * LENGTH**2 / (2 * EI)
    assert found.w[0, 0, -1] == pytest.approx(-sag, rel=1e-13)


def test_parallel_beams_share_a_force_by_their_rigidities():
    """The closed ring is statically indeterminate."""
    arm = Link("arm", {"O": 0.0, "A": LENGTH}, (Beam("O", "A"), Beam("A", "O")))
    found = solve(held(arm, loads=(PointLoad("arm", "A", 40j),)), [Section(EA, EI), Section(EA, 3 * EI)])
    assert found.w[0, 0, -1] == pytest.approx(40 * LENGTH**3 / (3 * 4 * EI), rel=1e-12)
    assert found.M[0, 0, 0] == pytest.approx(10 * LENGTH, rel=1e-12)
    assert found.M[1, 0, -1] == pytest.approx(-30 * LENGTH, rel=1e-12)  # its y axis points down


def test_a_corner_transmits_a_force():
    """An L of two beams: the force at its foot bends the post uniformly and rotates the beam."""
    height, force = 0.6, 25.0
    arm = Link("arm", {"O": 0.0, "A": LENGTH, "B": LENGTH + 1j * height}, (Beam("O", "A"), Beam("B", "A")))
    found = solve(held(arm, loads=(PointLoad("arm", "B", force),)), [Section(EA, EI), Section(EA, EI)])
    moment = -force * height
    np.testing.assert_allclose(found.M[0, 0], moment, rtol=1e-12)
    corner = moment * LENGTH / EI
    assert found.phi[0, 0, -1] == pytest.approx(corner, rel=1e-12)
    sway = -corner * height + force * height**3 / (3 * EI) + force * LENGTH / EA
    assert found.w[1, 0, 0] == pytest.approx(sway, rel=1e-12)


def test_rigid_beam_keeps_its_section_forces():
    found = solve(cantilever(PointLoad("arm", "A", 5 + 31j)), [Section()])
    assert not np.any([found.u, found.w, found.phi])
    np.testing.assert_allclose(found.M[0, 0], 31 * LENGTH * (1 - found.xi), rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(found.N[0, 0], 5.0, rtol=1e-13)


def test_orders_of_convergence_between_the_nodes():
    """Hermite elements have order 4 for the deflection, quadratic Lagrange elements order 3 for u, in L2."""
    start, end = 900.0 - 300j, -200.0 + 500j
    q = Polynomial([start, (end - start) / LENGTH])
    beyond = q.integ()(LENGTH) - q.integ()
    N, V = Polynomial(beyond.coef.real), Polynomial(-beyond.coef.imag)
    M = V.integ() - V.integ()(LENGTH)
    u, w = N.integ() / EA, M.integ(2) / EI
    held_arm = cantilever(LineLoad("arm", 0, start, end))
    errors = np.array([Direct(held_arm, [Section(EA, EI)], 0, n).between(0, u, w) for n in (2, 4, 8, 16)])
    np.testing.assert_allclose(orders(errors[:, 0]), 3.0, atol=0.2)
    np.testing.assert_allclose(orders(errors[:, 1]), 4.0, atol=0.2)


def exact_values(coefficients, nodes):
    """Return a polynomial with rational coefficients at k/nodes."""
    return [float(sum(c * Fraction(k, nodes) ** i for i, c in enumerate(coefficients))) for k in range(nodes + 1)]


def integral(coefficients):
    return [Fraction(0)] + [c / (k + 1) for k, c in enumerate(coefficients)]


def lagrange(station):
    """Return the cubic that is 1 at one station and 0 at the others."""
    stations = [Fraction(0), Fraction(1, 4), Fraction(3, 4), Fraction(1)]
    product = [Fraction(1)]
    for other in (s for k, s in enumerate(stations) if k != station):
        factor = 1 / (stations[station] - other)
        longer = [Fraction(0), *product]
        product = [factor * (longer[k] - other * c) for k, c in enumerate([*product, Fraction(0)])]
    return product


@pytest.mark.parametrize("elements", [1, 2, 16, 63, 256])
def test_round_off_does_not_grow_with_the_elements(elements):
    """Against rational arithmetic the error is a few units in the last place, for any mesh."""
    beam = unit_beam(elements)
    np.testing.assert_allclose(beam.stations, [0, 1 / 4, 3 / 4, 1], rtol=1e-15)
    for k in range(4):
        total = integral(lagrange(k))
        shear = [total[0] - sum(total), *total[1:]]
        moment = integral(shear)
        moment[0] -= sum(moment)
        slope = integral(moment)
        fields = {"V": shear, "M": moment, "phi": slope, "w": integral(slope), "N": [-c for c in shear]}
        for field, coefficients in fields.items():
            exact = np.array(exact_values(coefficients, elements))
            np.testing.assert_allclose(getattr(beam, field)[k], exact, rtol=0, atol=1e-16 + 1e-14 * np.abs(exact).max())
        u = np.array(exact_values([-c for c in integral(shear)], elements))
        np.testing.assert_allclose(beam.u[k], u, rtol=0, atol=1e-16 + 1e-14 * np.abs(u).max())


def test_misuse_is_an_error():
    at_rest = cantilever()
    with pytest.raises(ValueError, match="2 sections for 1 beams"):
        solve(at_rest, [Section(), Section()])
    with pytest.raises(ValueError, match="0 elements"):
        solve(at_rest, [Section()], 0)
    pieces = Link("arm", {"O": 0.0, "A": 1.0, "B": 2.0, "C": 3.0}, (Beam("O", "A"), Beam("B", "C")))
    with pytest.raises(MechanismError, match='"arm": its beams are not connected'):
        solve(held(pieces), [Section(), Section()])
    beside = Link("arm", {"O": 0.0, "A": 1.0, "B": 2.0}, (Beam("O", "A"),), (Lump("B", 1.0),))
    with pytest.raises(MechanismError, match='"arm": no beam reaches the point "B"'):
        solve(held(beside), [Section()])
