"""Natural modes have the shapes and damping of closed forms; in mechanisms they are compatible and orthogonal."""

import math

import mpmath
import numpy as np
import pytest
from mechanisms import ALL, bar, cantilever, motion_of, still, supported
from msgspec.structs import replace
from numpy.polynomial import Chebyshev
from tiers import in_tiers

from elastic import RIGID, JointCompliance, Section
from elastic.elastodynamics import Damping, natural_modes
from rigid import Link, Lump, Mechanism, PinDrive, motion

LENGTH, EI, MASS, BETA = 1.7, 23.0, 0.9, 2e-4
SLENDER = Section(EA=1e9, EI=EI)
X = np.linspace(0.0, 1.0, 101)


def modes_of(mechanism, sections, **more):
    return natural_modes(still(mechanism), sections, tolerance=1e-8, **more)


def test_a_simply_supported_beam():
    """Frequency (n pi)^2 sqrt(EI/m l^4), shape sin(n pi x/l), damping ratio beta omega/2."""
    found = modes_of(supported({"A": 0, "B": LENGTH}, MASS), [SLENDER], damping=Damping(np.array([BETA]), BETA))
    numbers = np.arange(1, 4)
    omega = (numbers * np.pi / LENGTH) ** 2 * math.sqrt(EI / MASS)
    np.testing.assert_allclose(found.omega[:, 0], omega, rtol=1e-9)
    np.testing.assert_allclose(found.damping[:, 0], BETA * omega / 2, rtol=1e-9)
    shapes = found.displacement[:, 0, 0]
    shapes *= np.sign(shapes.imag[:, 5:6])
    np.testing.assert_allclose(shapes, 1j * np.sin(np.pi * numbers[:, None] * X), atol=1e-6)
    assert found.shape_error < 1e-9


def test_a_cantilever():
    """Blevins, Table 8-1: cosh - cos - sigma (sinh - sin); the default damping is 1 % at the lowest frequency."""
    found = modes_of(cantilever({"A": 0, "B": LENGTH}, MASS), [SLENDER], modes=2)
    for mode, start in enumerate((1.875, 4.694)):
        root = float(mpmath.findroot(lambda x: mpmath.cos(x) * mpmath.cosh(x) + 1, start))
        sigma = (math.sinh(root) - math.sin(root)) / (math.cosh(root) + math.cos(root))
        shape = np.cosh(root * X) - np.cos(root * X) - sigma * (np.sinh(root * X) - np.sin(root * X))
        shown = found.displacement[mode, 0, 0].imag
        np.testing.assert_allclose(shown / shown[-1], shape / shape[-1], atol=1e-6)
    np.testing.assert_allclose(found.damping[:, 0], 0.01 * found.omega[:, 0] / found.omega[0, 0], rtol=1e-12)


def test_the_damping_of_a_beam_and_a_joint_counts_by_their_energy():
    """A mass on a massless cantilever on a torsion spring: energies are proportional to the flexibilities."""
    soft, m, beta = 0.02, 3.0, (1e-3, 5e-3)
    flexibility = np.array([LENGTH**3 / 3 / EI, soft * LENGTH**2])
    mechanism = cantilever({"A": 0, "B": LENGTH}, lumps=(Lump("B", m),))
    found = modes_of(mechanism, [Section(EA=math.inf, EI=EI)], modes=2, joints={"A": JointCompliance(rotation=soft)},
                     damping=Damping(np.array(beta[:1]), beta[1]))  # fmt: skip
    omega = 1 / math.sqrt(m * flexibility.sum())
    assert found.omega[0, 0] == pytest.approx(omega, rel=1e-9)
    assert found.damping[0, 0] == pytest.approx(omega / 2 * (flexibility @ beta) / flexibility.sum(), rel=1e-9)
    assert np.isinf(found.omega[1, 0])  # no other mode has mass
    assert np.isnan([found.damping[1, 0], *found.displacement[1, 0, 0]]).all()


def test_a_rigid_link_rotates_with_its_drive():
    """A rigid arm on a soft drive: the shape is a rotation about the drive."""
    found = modes_of(cantilever({"A": 0, "B": LENGTH}, MASS), [RIGID], modes=2,
                     joints={"A": JointCompliance(rotation=1 / 50.0)})  # fmt: skip
    np.testing.assert_allclose(np.abs(found.displacement[0, 0, 0]), X, atol=1e-12)
    assert np.isinf(found.omega[1, 0])
    assert np.isnan(found.damping[1, 0])
    assert np.isnan(found.displacement[1]).all()


@pytest.mark.parametrize("name", in_tiers(["RRR", "six-bar", "RRP", "triad"], 2, 2))
def test_modes_of_a_mechanism_are_compatible_and_orthogonal(name):
    """From the shapes alone: pins stay closed, modes are orthogonal by mass, energy over mass is omega^2."""
    case = ALL[name]()
    mechanism = replace(case.mechanism, links=tuple(replace(link, lumps=()) for link in case.mechanism.links))
    course = motion_of(replace(case, mechanism=mechanism))
    found = natural_modes(course, case.sections, 2)
    stops = {}
    mass, energy = np.zeros((2, 2, course.columns[0])), np.zeros((2, course.columns[0]))
    for number, ((at, beam), section) in enumerate(zip(mechanism.beams, case.sections, strict=True)):
        for end, station in ((beam.start, 0), (beam.end, -1)):
            stops.setdefault(end, []).append(found.displacement[:, number, :, station])
        link = mechanism.links[at]
        length = abs(link.points[beam.end] - link.points[beam.start])
        along = course.direction[at] * (link.points[beam.end] - link.points[beam.start]) / length
        local = found.displacement[:, number] / along[:, None]
        nodes, weights = np.polynomial.legendre.leggauss(24)
        fits = [[Chebyshev.fit(2 * X - 1, row, 16) for row in rows] for rows in local]
        there = np.array([[fit(nodes) for fit in rows] for rows in fits])
        bent = np.array([[fit.deriv(2)(nodes) * 4 / length**2 for fit in rows] for rows in fits]).imag
        pull = np.array([[fit.deriv()(nodes) * 2 / length for fit in rows] for rows in fits]).real
        scale = length / 2 * weights
        mass += np.einsum("apx,bpx,x->abp", there, there.conj(), beam.mass_per_length * scale).real
        if math.isfinite(section.EI):
            energy += np.einsum("apx,x->ap", section.EI * bent**2, scale)
        if math.isfinite(section.EA):
            energy += np.einsum("apx,x->ap", section.EA * pull**2, scale)
    for moved in stops.values():
        for other in moved[1:]:
            np.testing.assert_allclose(other, moved[0], atol=1e-9)
    assert (np.abs(mass[0, 1]) < 1e-6 * np.sqrt(mass[0, 0] * mass[1, 1])).all()
    np.testing.assert_allclose(energy / np.array([mass[0, 0], mass[1, 1]]), found.omega**2, rtol=1e-3)


def test_positions_out_of_reach_are_nan():
    reach = np.array([0.5, 3.2])  # [rad] the coupler is too short for the second
    links = (Link("ground", {"O": 0.0, "D": 1.0}), bar("crank", "O", "A", 0.3, 1.0), bar("coupler", "A", "B", 0.6, 1.0),
             bar("rocker", "D", "B", 0.5, 1.0))  # fmt: skip
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": 0.3, "B": 0.8 + 0.4j, "D": 1.0})
    found = natural_modes(motion(mechanism, reach), [SLENDER] * 3, 2)
    for values in (found.omega[0], found.damping[0], found.displacement[0, 0, :, 50]):
        assert np.isfinite(values).tolist() == [True, False]
