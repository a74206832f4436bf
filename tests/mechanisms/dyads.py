"""One case for each of the five dyads, and variants.

Each case has every kind of load, in generic proportions, so that no term vanishes by chance.
"""

import math

import numpy as np

from rigid import Beam, Link, Lump, Mechanism, PinDrive, PointLoad, Slider, SliderDrive

from .building import GRAVITY, apex, bar, loads, lumps, moved, replaced, sections_of, turn, with_link


def four_bar(crank=0.11, coupler=0.31, rocker=0.24, base=0.33 + 0.04j, side=1.0, count=24, **more):
    """RRR: crank-rocker with every load."""
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
    """RRP: offset slider-crank on an inclined line."""
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


def pressed(count=24, **more):
    """RRR: a driven block turns a crank through a rod."""
    case = slider_crank(**more)
    mechanism = replaced(case.mechanism, drives=(SliderDrive("guide"),))
    return moved(mechanism, case.sections, np.linspace(0.32, 0.48, count), 0.4, -0.9)


def bush(count=24, **more):
    """RRP: a rail slides through a bush on the crank, and a rocker holds its end. The rail is the slider's owner."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.5}),
        Link("crank", {"O": 0.0, "A": 0.1}, (Beam("O", "A", 0.5),), lumps("A")),
        Link("rail", {"B": 0.0}, lumps=lumps("B")),
        bar("rocker", "D", "B", 0.35, 0.6),
    )
    # the rail keeps a fixed angle to the crank, and its line passes the crank's end
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


def inverted_slider_crank(crank=0.1, base=0.3 - 0.05j, lean=0.4, foot=0.02j, sliding_rod=False, count=24, **more):
    """RPR: a block on the crank pin slides on a rigid rocker, or a rod on the pin slides through the rocker."""
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
    # the vector from D to A in the rocker's axes is foot + slide * out
    slide = math.sqrt(abs(A - base) ** 2 - (foot / out).imag ** 2) - (foot / out).real
    axes = (A - base) / (foot + slide * out)
    slider = Slider("guide", "rod", "rocker", "A", origin=foot, direction=out, turn=np.exp(-0.3j))
    drawing = {"O": 0.0, "D": base, "A": A, "E": A + axes * slider.turn * 0.15}
    known = {"gravity": GRAVITY, "loads": (PointLoad("rod", "E", 5 - 9j, 0.7), PointLoad("rocker", "D", 0, 2.0))} | more
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slider,), **known)
    return moved(mechanism, sections_of(mechanism), turn(count, start))


def elastic_guide(count=24, **more):
    """RPR: the block on the crank pin slides on an elastic lever and loads it at the contact."""
    case = inverted_slider_crank(0.1, 0.3 - 0.05j, lean=0.4, foot=0.0, count=count, **more)
    lever = Link(
        "rocker", {"D": 0.0, "F": 0.6 * np.exp(0.4j)}, (Beam("D", "F", 0.9),), (Lump("F", 0.4, 1e-3, 0.02 + 0.01j),)
    )
    mechanism = with_link(case.mechanism, lever)
    return moved(mechanism, sections_of(mechanism), case.drive)


def scotch_yoke(crank=0.1, slant=1.3, count=24, **more):
    """RPP: a block on the crank pin slides in an oblique slot of a rigid yoke, which slides on the ground."""
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
    """PRP: a pin joins a block that slides on the driven arm to a block that slides on the ground."""
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
