"""Mechanisms whose only load is the mass of their bars."""

import numpy as np

from elastic import RIGID, Section
from rigid import Link, Mechanism, PinDrive, Slider

from .building import Case, apex, bar, moved, steel_bar, turn


def steel_four_bar(count=360):
    """Standard example: lengths 0.1, 0.3, 0.25 and 0.35 m, 10 x 6 mm steel, 100 rad/s."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.35}),
        steel_bar("crank", "O", "A", 0.1),
        steel_bar("coupler", "A", "B", 0.3),
        steel_bar("rocker", "D", "B", 0.25),
    )
    drawing = {"O": 0.0, "A": 0.1, "B": 0.28 + 0.24j, "D": 0.35}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing)
    section = Section(EA=210e9 * 0.01 * 0.006, EI=210e9 * 0.01 * 0.006**3 / 12)
    return moved(mechanism, [section] * 3, turn(count), 100.0, 0.0)


def parallelogram(rocker=0.1, **drawn):
    """Two steel cranks of 0.1 m, 0.3 m apart."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.3}),
        steel_bar("crank", "O", "A", 0.1),
        steel_bar("coupler", "A", "B", 0.3),
        steel_bar("rocker", "D", "B", rocker),
    )
    drawing = {"O": 0, "A": 0.1j, "B": 0.3 + 0.1j, "D": 0.3} | drawn
    return Mechanism(links, (PinDrive("crank", "O"),), drawing)


def simeon_slider_crank():
    """Simeon's slider-crank ("crank" of the IVP Test Set) with rigid crank, at 0.1 s."""
    links = (
        Link("ground", {"O": 0.0}),
        bar("crank", "O", "A", 0.15, 0.0),
        bar("rod", "A", "B", 0.3, 0.151104 / 0.3),
        Link("block", {"B": 0.0}),
    )
    guide = Slider("guide", "block", "ground", "B", origin=0.0, direction=1.0)
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0.0, "A": 0.15, "B": 0.45}, (guide,))
    side, E = 0.008, 2e11
    return Case(
        mechanism,
        (RIGID, Section(EA=E * side**2, EI=E * side**4 / 12)),
        np.array([[150 * 0.1]]),
        np.array([[150.0]]),
        np.array([[0.0]]),
    )


def double_rocker(start):
    """Links 0.3, 0.2 and 0.25 on a base of 0.4: the crank stops with coupler and rocker in line,

    AD

    = 0.45.
    """
    links = (
        Link("ground", {"O": 0.0, "D": 0.4}),
        bar("crank", "O", "A", 0.3),
        bar("coupler", "A", "B", 0.2),
        bar("rocker", "D", "B", 0.25),
    )
    A = 0.3 * np.exp(1j * start)
    drawing = {"O": 0.0, "D": 0.4, "A": A, "B": apex(A, 0.4, 0.2, 0.25)}
    return Mechanism(links, (PinDrive("crank", "O"),), drawing)
