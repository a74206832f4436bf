"""Simeon's flexible slider-crank follows from the same parts, and the error of his rod model is known.

Problem "crank" of the Test Set for Initial Value Problem Solvers (Mazzia and Magherini, University of Bari, 2008),
from B. Simeon, Math. Modelling of Systems 2 (1996) 1-18. His rod has two sine modes and a parabolic stretch. In the
published code the mass of the stretch lacks the factor 1/15; its digits are those of the code. He includes the large
motion of the elastic rod; here it is linear about the rigid rod. The difference is of the order of the squared
displacement, 6e-4 of the length.
"""

import numpy as np
from mechanisms import at_speed
from msgspec.structs import replace

from elastic import Section, sample
from elastic.elastodynamics import equations_of_motion, transient
from elastic.elastodynamics.time_elements import Equations, propagation
from elastic.elastodynamics.time_grid import Grid
from rigid import Beam, Link, Lump, Mechanism, PinDrive, Slider

CRANK, ROD, SPEED, END = 0.15, 0.3, 150.0, 0.1
MASS, BLOCK = 0.151104, 0.075552
E, SIDE, DENSITY = 2e11, 0.008, 7870.0
START = [0.0, 0.0, 1.03339863e-05, 1.69327969e-05]
START_RATE = [0.444896112581599, 0.00463433931923867, -1.78591076000055e-06, -2.68938671997904e-06]
PUBLISHED = np.array([1.893192899613509e-4, 2.375751249879174e-5, -5.323896770569702e-6, -8.363313279112129e-6])
PUBLISHED_RATE = np.array([-0.03005541400289738, -0.005500431812571696])


def ritz(missing_factor, count=300):
    """Return the amplitudes of his four modes at the end, and their rates."""
    grid = Grid(np.linspace(0, END, count + 1))
    crank = SPEED * grid.nodes
    rod = np.arcsin(-CRANK * np.sin(crank) / ROD)
    e = np.exp(1j * rod)
    xi, weights = np.polynomial.legendre.leggauss(20)
    xi, weights = (xi + 1) / 2, weights / 2
    shapes = [1j * np.sin(np.pi * xi), 1j * np.sin(2 * np.pi * xi), 4 * xi * (1 - xi), xi * (2 * xi - 1)]
    # the end moves by the last amplitude, and the rod rotates to stay on the line
    turned = np.array([0.0, 0.0, 0.0, 1.0]) * (-np.tan(rod) / ROD)[:, None]
    moved = e[:, None, None] * (np.array(shapes).T + 1j * ROD * xi[:, None] * turned[:, None])
    block = (e[:, None] * (np.array([0.0, 0.0, 0.0, 1.0]) + 1j * ROD * turned)).real
    rows = np.concatenate((moved, block[:, None]), axis=1)
    places = (CRANK * np.exp(1j * crank))[:, None] + ROD * e[:, None] * np.append(xi, 1.0)
    places[:, -1] = places[:, -1].real
    heavy = (np.conj(rows[1:]) * np.append(weights * MASS, BLOCK)[:, None]).swapaxes(-1, -2)
    rate, acceleration = grid.rates(rows)
    stretch_mass = np.zeros((4, 4))
    stretch_mass[2:, 2:] = DENSITY * SIDE**2 * ROD * np.array([[8, 1], [1, 2]]) * (14 / 15 if missing_factor else 0)
    stiffness = np.zeros((4, 4))
    stiffness[[0, 1], [0, 1]] = np.array([1, 16]) * E * SIDE**4 / 12 * np.pi**4 / 2 / ROD**3
    stiffness[2:, 2:] = E * SIDE**2 / ROD / 3 * np.array([[16, -8], [-8, 7]])
    spin = grid.rates(rod)[0][:, None, None]
    equations = Equations(
        (heavy @ rows[1:]).real + stretch_mass,
        2 * (heavy @ rate).real,
        (heavy @ acceleration).real + stiffness - spin**2 * stretch_mass,
        -(heavy @ grid.rates(places)[1][..., None]).real[..., 0],
    )
    x, x1, _ = propagation(grid, equations).history(np.array([*START, *START_RATE]))
    return x[-1], x1[-1]


def test_his_model_gives_his_digits():
    amplitudes, rates = ritz(missing_factor=True)
    np.testing.assert_allclose(amplitudes[:2], PUBLISHED[:2], rtol=6e-5)
    np.testing.assert_allclose(amplitudes[2:], PUBLISHED[2:], rtol=6e-4)
    np.testing.assert_allclose(rates[:2], PUBLISHED_RATE, rtol=4e-4)


def test_the_missing_factor_changes_the_stretch():
    amplitudes, _ = ritz(missing_factor=False)
    assert abs(amplitudes[3] / PUBLISHED[3] - 1) > 4e-3


def full_rod():
    """Return the first two sine amplitudes of the chord deflection at the end, for a rod with all modes."""
    links = (
        Link("ground", {"O": 0.0}),
        Link("crank", {"O": 0.0, "A": CRANK}, (), (Lump("O", 0.36, 0.0007, 0.075),)),
        Link("rod", {"A": 0.0, "B": ROD}, (Beam("A", "B", MASS / ROD),)),
        Link("block", {"B": 0.0}, (), (Lump("B", BLOCK),)),
    )
    drawing = {"O": 0.0, "A": CRANK, "B": CRANK + ROD}
    guide = Slider("guide", "block", "ground", "B", 0.0, 1.0)
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (guide,))

    motion_at = at_speed(mechanism, SPEED)
    rod = Section(EA=E * SIDE**2, EI=E * SIDE**4 / 12)
    found = transient(motion_at(np.array([0.0, 0.05, END])), motion_at, [rod], damping=1e-9)
    xi, weights = np.polynomial.legendre.leggauss(20)
    xi, weights = (xi + 1) / 2, weights / 2
    chord = sample(found.deflection, "chord", xi)[0, -1]
    return np.array([2 * (chord * weights * np.sin(k * np.pi * xi)).sum() for k in (1, 2)])


def test_a_full_rod_without_its_axial_force(monkeypatch):
    """He neglects the effect of axial force on bending."""
    with_force = equations_of_motion.geometric_stiffness

    def without(*given):
        return replace(with_force(*given), axial=0.0 * with_force(*given).axial)

    monkeypatch.setattr(equations_of_motion, "geometric_stiffness", without)
    np.testing.assert_allclose(full_rod(), PUBLISHED[:2], rtol=0.01)


def test_the_axial_force_changes_the_answer():
    """The change is a quarter at this instant, after 20 periods of the lowest mode."""
    assert 0.2 < full_rod()[0] / PUBLISHED[0] - 1 < 0.3
