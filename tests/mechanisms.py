"""Mechanisms that the tests move: the five dyads, arms, six-bars, and a group that is no dyad.

All carry everything that can load a link, in proportions that a seed chooses, so that no term is zero by luck.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from elastic import RIGID, Section
from rigid import Beam, LineLoad, Link, Lump, Mechanism, PinDrive, PointLoad, Slider, SliderDrive

GRAVITY = -9.81j


@dataclass(frozen=True, eq=False)
class Case:
    """A mechanism, the sections of its beams, and coordinates of its drives that it reaches."""

    mechanism: Mechanism
    sections: tuple[Section, ...]
    drive: np.ndarray
    rate: np.ndarray
    rate2: np.ndarray

    def with_(self, **changes):
        return replace(self, mechanism=replaced(self.mechanism, **changes))


def replaced(mechanism, **changes):
    """A copy with other fields; `index` belongs to the constructor."""
    names = ("links", "drives", "drawing", "sliders", "gravity", "loads", "gears")
    return Mechanism(**{name: changes.get(name, getattr(mechanism, name)) for name in names})


def scaled(mechanism, size):
    """The same mechanism `size` times as large, without mass and loads."""
    links = tuple(
        replace(link, points={name: place * size for name, place in link.points.items()}, beams=(), lumps=())
        for link in mechanism.links
    )
    sliders = tuple(replace(slider, origin=slider.origin * size) for slider in mechanism.sliders)
    drawing = {name: place * size for name, place in mechanism.drawing.items()}
    return replaced(mechanism, links=links, sliders=sliders, drawing=drawing, loads=())


def apex(first, second, long, short, side=1.0):
    """Where circles about `first` and `second` meet, left of the way from one to the other."""
    way = second - first
    x = (abs(way) ** 2 + long**2 - short**2) / (2 * abs(way))
    return first + way / abs(way) * (x + 1j * side * math.sqrt(long**2 - x**2))


def bar(name, start, end, length, mass_per_length=0.5, **more):
    """A link of one beam."""
    return Link(name, {start: 0.0, end: length}, (Beam(start, end, mass_per_length),), **more)


def turn(count, start=0.0):
    """Angles of a full turn, the end not repeated."""
    return start + np.arange(count) * (2 * math.pi / count)


def moved(mechanism, sections, drive, rate=7.0, rate2=-3.0):
    drive = np.atleast_2d(drive)
    return Case(mechanism, tuple(sections), drive, np.full(drive.shape, rate), np.full(drive.shape, rate2))


def sections_of(mechanism, EA=3e5, EI=40.0):
    """A different section for every beam."""
    return [Section(EA * (1 + 0.3 * k), EI * (1 + 0.2 * k)) for k in range(len(mechanism.beams))]


def steel_four_bar(count=360):
    """The common job: lengths .1, .3, .25 and .35 m, 10 x 6 mm of steel, 100 rad/s."""
    mass = 7850 * 0.01 * 0.006
    links = (
        Link("ground", {"O": 0.0, "D": 0.35}),
        bar("crank", "O", "A", 0.1, mass),
        bar("coupler", "A", "B", 0.3, mass),
        bar("rocker", "D", "B", 0.25, mass),
    )
    drawing = {"O": 0.0, "A": 0.1, "B": 0.28 + 0.24j, "D": 0.35}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing)
    section = Section(EA=210e9 * 0.01 * 0.006, EI=210e9 * 0.01 * 0.006**3 / 12)
    return moved(mechanism, [section] * 3, turn(count), 100.0, 0.0)


def lumps(point, size=1.0):
    """A mass beside a point, with inertia of its own."""
    return (Lump(point, 0.3 * size, 2e-3 * size, (0.02 + 0.03j) * size),)


def loads(link, point):
    """One load of every kind on a link and its first beam."""
    return (
        PointLoad(link, point, force=30 - 20j, moment=1.5),
        PointLoad(link, point, force=-12 + 8j, moment=-0.5, turning=True),
        LineLoad(link, 0, 40 - 30j, -15 + 60j),
        LineLoad(link, 0, -25 + 10j, 35 + 20j, turning=True),
    )


def four_bar(crank=0.11, coupler=0.31, rocker=0.24, base=0.33 + 0.04j, side=1.0, count=24, **more):
    """RRR: a crank rocker with every load."""
    links = (
        Link("ground", {"O": 0.02 - 0.01j, "D": 0.02 - 0.01j + base}),
        bar("crank", "O", "A", crank),
        bar("coupler", "A", "B", coupler, 0.7, lumps=lumps("A")),
        bar("rocker", "D", "B", rocker, 0.6, lumps=lumps("B", 0.5)),
    )
    start = 0.4
    center, D = links[0].points["O"], links[0].points["D"]
    A = center + crank * np.exp(1j * start)
    drawing = {"O": center, "A": A, "B": apex(A, D, coupler, rocker, side), "D": D}
    known = {"gravity": GRAVITY, "loads": loads("coupler", "B") + loads("crank", "A")} | more
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start))


def slider_crank(crank=0.12, rod=0.4, offset=0.05, slope=0.3, side=1.0, count=24, **more):
    """RRP: an offset slider-crank along an inclined line."""
    way = np.exp(1j * slope)
    links = (
        Link("ground", {"O": 0.0}),
        bar("crank", "O", "A", crank),
        bar("rod", "A", "B", rod, 0.4, lumps=lumps("B", 0.3)),
        Link("block", {"B": 0.0}, lumps=lumps("B")),
    )
    start = 0.7
    A = crank * np.exp(1j * (start + slope))
    foot = 1j * offset * way
    across = ((A - foot) / way).imag
    B = foot + way * (((A - foot) / way).real + side * math.sqrt(rod**2 - across**2))
    slider = Slider("guide", "block", "ground", "B", origin=foot, direction=way, turn=np.exp(0.2j))
    known = {"gravity": GRAVITY, "loads": loads("rod", "B")} | more
    drawing = {"O": 0.0, "A": A, "B": B}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start + slope))


def inverted_slider_crank(crank=0.1, base=0.3 - 0.05j, lean=0.4, foot=0.02j, sliding_rod=False, count=24, **more):
    """RPR: a block on the crank pin slides along a rigid rocker; or a rod from it slides through the rocker."""
    rocker_mass = Lump("D", 2.0, 0.03, 0.1 + 0.02j)
    start = 0.3
    A = crank * np.exp(1j * start)
    out = np.exp(1j * lean)
    rod = Link("rod", {"A": 0.0, "E": 0.15}, (Beam("A", "E", 0.5),) if sliding_rod else (), lumps("A"))
    links = (
        Link("ground", {"O": 0.0, "D": base}),
        bar("crank", "O", "A", crank),
        rod,
        Link("rocker", {"D": 0.0}, lumps=(rocker_mass,)),
    )
    # the way from D to A in the rocker's axes is foot + slide * out
    slide = math.sqrt(abs(A - base) ** 2 - (foot / out).imag ** 2) - (foot / out).real
    axes = (A - base) / (foot + slide * out)
    slider = Slider("guide", "rod", "rocker", "A", origin=foot, direction=out, turn=np.exp(-0.3j))
    drawing = {"O": 0.0, "D": base, "A": A, "E": A + axes * slider.turn * 0.15}
    known = {"gravity": GRAVITY, "loads": (PointLoad("rod", "E", 5 - 9j, 0.7), PointLoad("rocker", "D", 0, 2.0))} | more
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start))


def scotch_yoke(crank=0.1, slant=1.3, count=24, **more):
    """RPP: a block on the crank pin slides in a slanted slot of a rigid yoke that slides on the ground."""
    links = (
        Link("ground", {"O": 0.0, "G": 0.5 + 0.02j}),
        bar("crank", "O", "A", crank),
        Link("block", {"A": 0.0}, lumps=lumps("A")),
        Link("yoke", {"Y": 0.0, "F": 0.1}, lumps=lumps("F")),
    )
    start = 0.5
    A = crank * np.exp(1j * start)
    guide, slot, axes = np.exp(0.1j), np.exp(1j * slant), np.exp(0.35j)
    sliders = (
        Slider("rail", "yoke", "ground", "Y", origin=0.03j, direction=guide, turn=axes),
        Slider("slot", "block", "yoke", "A", origin=0.01 + 0.02j, direction=slot, turn=np.exp(0.6j)),
    )
    foot = A - axes * (0.01 + 0.02j) - 0.03j
    Y = 0.03j + guide * (foot / (axes * slot)).imag / (guide / (axes * slot)).imag
    drawing = {"O": 0.0, "A": A, "Y": Y, "F": Y + 0.1 * axes}
    known = {"gravity": GRAVITY, "loads": (PointLoad("yoke", "F", 50 + 3j, 1.0),)} | more
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, sliders, **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start))


def tangent(count=24, **more):
    """PRP: a block that slides along the driven arm is pinned to one that slides on the ground."""
    links = (
        Link("ground", {"O": 0.0}),
        Link("arm", {"O": 0.0}, lumps=lumps("O")),
        Link("inner", {"P": 0.0}, lumps=lumps("P")),
        Link("outer", {"P": 0.05, "F": 0.15}, (Beam("P", "F", 0.8),), lumps("F")),
    )
    sliders = (
        Slider("sleeve", "inner", "arm", "P", origin=0.02j, direction=np.exp(0.1j), turn=np.exp(0.4j)),
        Slider("rail", "outer", "ground", "P", origin=0.2 + 0.1j, direction=np.exp(1.4j), turn=np.exp(0.7j)),
    )
    drawing = {"O": 0.0, "P": 0.2 + 0.1j, "F": 0.2 + 0.1j + 0.1 * np.exp(0.7j)}
    known = {"gravity": GRAVITY, "loads": (PointLoad("outer", "F", 50 + 3j, 1.0),)} | more
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), drawing, sliders, **known)
    return moved(mechanism, sections_of(mechanism), np.linspace(-0.6, 0.9, count))


def arm(upper=0.3, fore=0.25, **more):
    """Two driven links in series, the elbow's motor on the upper arm."""
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


def six_bar(count=24, **more):
    """Stephenson III: a coupler of two welded beams, one of them against the way, carries a second dyad."""
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


def triad(count=24, **more):
    """A plate held by three bars, one of them on the crank: a group of four links that is no dyad."""
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


def pressed(count=24, **more):
    """RRR: a crank turned by a driven block through a rod."""
    case = slider_crank(**more)
    mechanism = replaced(case.mechanism, drives=(SliderDrive("guide"),))
    return moved(mechanism, case.sections, np.linspace(0.32, 0.48, count), 0.4, -0.9)


def bush(count=24, **more):
    """RRP: a rail slides through a bush on the crank, a rocker holds its end; the rail owns the line."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.5}),
        Link("crank", {"O": 0.0, "A": 0.1}, (Beam("O", "A", 0.5),), lumps("A")),
        Link("rail", {"B": 0.0}, lumps=lumps("B")),
        bar("rocker", "D", "B", 0.35, 0.6),
    )
    # the rail stands at a fixed angle to the crank; its line passes the crank's end
    lean, foot, way = np.exp(0.9j), 0.015j, np.exp(0.2j)
    start = 1.2
    A = 0.1 * np.exp(1j * start)
    along = np.exp(1j * start) * lean * way
    base = A - np.exp(1j * start) * lean * foot
    across = ((0.5 - base) / along).imag
    B = base + along * (((0.5 - base) / along).real + math.sqrt(0.35**2 - across**2))
    slider = Slider("bush", "crank", "rail", "A", origin=foot, direction=way, turn=1 / lean)
    known = {"gravity": GRAVITY, "loads": loads("rocker", "B") + loads("crank", "A")} | more
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": A, "B": B, "D": 0.5}, (slider,), **known)
    return moved(mechanism, sections_of(mechanism), start + np.linspace(0, 0.5, count))


def held_arm(**more):
    """The arm with its elbow's motor on the forearm, so that it counts the angle the other way."""
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


def stiff_plate(**more):
    """The six-bar with its coupler rigid."""
    case = six_bar(**more)
    coupler = case.mechanism.index["coupler"]
    owners = [at for at, _ in case.mechanism.beams]
    sections = [RIGID if at == coupler else section for at, section in zip(owners, case.sections, strict=True)]
    return replace(case, sections=tuple(sections))


def elastic_guide(count=24, **more):
    """RPR: the block on the crank pin slides along an elastic lever, which it loads where it is."""
    case = inverted_slider_crank(0.1, 0.3 - 0.05j, lean=0.4, foot=0.0, count=count, **more)
    lever = Link(
        "rocker", {"D": 0.0, "F": 0.6 * np.exp(0.4j)}, (Beam("D", "F", 0.9),), (Lump("F", 0.4, 1e-3, 0.02 + 0.01j),)
    )
    links = tuple(lever if link.name == "rocker" else link for link in case.mechanism.links)
    mechanism = replaced(case.mechanism, links=links)
    return moved(mechanism, sections_of(mechanism), case.drive)


def ring(**more):
    """The six-bar with its coupler a closed triangle of three beams, with shear and free strain in them."""
    case = six_bar(**more)
    links = [
        replace(link, beams=(Beam("A", "P", 0.7), Beam("B", "P", 0.6), Beam("B", "A", 0.5)))
        if link.name == "coupler"
        else link
        for link in case.mechanism.links
    ]
    mechanism = replaced(case.mechanism, links=tuple(links))
    soft = [replace(s, kGA=s.EA * 0.3, strain=1e-5 * (k + 1)) for k, s in enumerate(sections_of(mechanism))]
    return replace(case, mechanism=mechanism, sections=tuple(soft))


DYADS = {
    "RRR": four_bar,
    "RRP": slider_crank,
    "RPR": inverted_slider_crank,
    "RPP": scotch_yoke,
    "PRP": tangent,
}
ALL = DYADS | {
    "RPR, sliding rod": lambda: inverted_slider_crank(sliding_rod=True),
    "RRP, owner hung": bush,
    "driven slider": pressed,
    "arm": arm,
    "arm, motor turned about": held_arm,
    "six-bar": six_bar,
    "six-bar, stiff plate": stiff_plate,
    "six-bar, ring": ring,
    "RPR, elastic lever": elastic_guide,
    "triad": triad,
}


def rigid_sections(case):
    return replace(case, sections=(RIGID,) * len(case.sections))
