"""Loaded cases of more than one dyad: arms, six-bars, and a group that is not a dyad."""

import numpy as np
from msgspec.structs import replace

from elastic import RIGID
from rigid import Beam, Link, Mechanism, PinDrive

from .building import GRAVITY, Case, apex, bar, loads, lumps, moved, replaced, sections_of, turn, with_link


def arm(upper=0.3, fore=0.25, **more):
    """Two driven links in series; the motor of the elbow is on the upper arm."""
    links = (
        Link("ground", {"O": 0.1j}),
        bar("upper", "O", "A", upper, lumps=lumps("A")),
        bar("fore", "A", "T", fore, 0.4, lumps=lumps("T")),
    )
    drawing = {"O": 0.1j, "A": 0.1j + upper, "T": 0.1j + upper + 1j * fore}
    known = {"gravity": GRAVITY, "loads": loads("fore", "T")} | more
    mechanism = Mechanism(links, (PinDrive("upper", "O"), PinDrive("fore", "A", "upper")), drawing, **known)
    angles = np.stack([turn(24), 1.0 + 0.8 * np.sin(turn(24))])
    return Case(
        mechanism,
        tuple(sections_of(mechanism)),
        angles,
        np.stack([np.full(24, 3.0), 2.4 * np.cos(turn(24))]),
        np.stack([np.zeros(24), -7.2 * np.sin(turn(24))]),
    )


def held_arm(**more):
    """The arm with the motor of the elbow on the forearm, which reverses the sign of its angle."""
    case = arm(**more)
    drives = (PinDrive("upper", "O"), PinDrive("upper", "A", "fore"))
    mirror = np.array([[1.0], [-1.0]])
    return replace(
        case,
        mechanism=replaced(case.mechanism, drives=drives),
        drive=case.drive * mirror,
        rate=case.rate * mirror,
        rate2=case.rate2 * mirror,
    )


def six_bar(count=24, **more):
    """Stephenson III: the coupler has two welded beams, one reversed, and carries a second dyad."""
    P = apex(0.0, 0.31, 0.22, 0.19)
    links = (
        Link("ground", {"O": 0.0, "D": 0.33 + 0.04j, "G": 0.48 + 0.22j}),
        bar("crank", "O", "A", 0.1),
        Link("coupler", {"A": 0.0, "B": 0.31, "P": P}, (Beam("A", "P", 0.7), Beam("B", "P", 0.6)), lumps("P")),
        bar("rocker", "D", "B", 0.26, 0.6),
        bar("rod", "P", "Q", 0.33, 0.5),
        bar("swing", "G", "Q", 0.28, 0.5, lumps=lumps("Q")),
    )
    start = 0.6
    D, G = (links[0].points[name] for name in "DG")
    A = 0.1 * np.exp(1j * start)
    B = apex(A, D, 0.31, 0.26)
    corner = A + (B - A) / 0.31 * P
    drawing = {"O": 0.0, "A": A, "B": B, "D": D, "P": corner, "G": G, "Q": apex(corner, G, 0.33, 0.28)}
    known = {"gravity": GRAVITY, "loads": loads("coupler", "P") + loads("rod", "Q")} | more
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start))


def stiff_plate(**more):
    """The six-bar with a rigid coupler."""
    case = six_bar(**more)
    coupler = case.mechanism.index["coupler"]
    owners = [at for at, _ in case.mechanism.beams]
    sections = [RIGID if at == coupler else section for at, section in zip(owners, case.sections, strict=True)]
    return replace(case, sections=tuple(sections))


def ring(**more):
    """The six-bar whose coupler is a closed triangle of three beams with shear and free strain."""
    case = six_bar(**more)
    (coupler,) = (link for link in case.mechanism.links if link.name == "coupler")
    beams = Beam("A", "P", 0.7), Beam("B", "P", 0.6), Beam("B", "A", 0.5)
    mechanism = with_link(case.mechanism, replace(coupler, beams=beams))
    soft = [replace(s, kGA=s.EA * 0.3, strain=1e-5 * (k + 1)) for k, s in enumerate(sections_of(mechanism))]
    return replace(case, mechanism=mechanism, sections=tuple(soft))


def triad(count=24, **more):
    """A plate held by three bars, one on the crank: a group of four links that is not a dyad."""
    Q, R = 0.2, 0.1 + 0.15j
    plate = Link("plate", {"P": 0.0, "Q": Q, "R": R}, (Beam("P", "Q", 0.7), Beam("R", "P", 0.6)), lumps("R"))
    start = 0.6
    A = 0.03 * np.exp(1j * start)
    P = 0.05 + 0.3j
    spots = {"P": P, "Q": P + Q, "R": P + R}
    D, E = 0.2 + 0.0j, 0.5 + 0.4j
    links = (
        Link("ground", {"O": 0.0, "D": D, "E": E}),
        bar("crank", "O", "A", 0.03),
        plate,
        bar("left", "A", "P", abs(P - A), 0.5),
        bar("right", "D", "Q", abs(spots["Q"] - D), 0.5),
        bar("top", "E", "R", abs(spots["R"] - E), 0.5, lumps=lumps("R")),
    )
    known = {"gravity": GRAVITY, "loads": loads("plate", "Q") + loads("left", "P")} | more
    drawing = {"O": 0.0, "A": A, "D": D, "E": E, **spots}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start))
