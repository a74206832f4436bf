"""Massless linkages of rigid links with the dimensions of their drawing."""

import numpy as np
from msgspec.structs import replace

from rigid import Link, Mechanism, PinDrive, Slider


def drawn_bar(name, start, end, places):
    """Return a link of two points with the drawn length."""
    return Link(name, {start: 0.0, end: abs(complex(places[end]) - complex(places[start]))})


def drawn_plate(name, points, places):
    """Return a link of several points with the drawn shape, in rotated local axes."""
    turn = np.exp(0.7j)
    return Link(name, {point: (complex(places[point]) - complex(places[points[0]])) * turn for point in points})


def linkage(places, ground, bars=(), plates=(), drives=(), sliders=()):
    links = [Link("ground", {point: complex(places[point]) for point in ground})]
    links += [drawn_bar(name, *ends, places) for name, *ends in bars]
    links += [drawn_plate(name, points, places) for name, points in plates]
    return Mechanism(tuple(links), tuple(drives), places, tuple(sliders))


FOUR_BAR_PLACES = {"O": 0, "A": 0.06 + 0.08j, "B": 0.3 + 0.21j, "D": 0.35}


def four_bar_linkage(**changes):
    bars = (("crank", "O", "A"), ("coupler", "A", "B"), ("rocker", "D", "B"))
    return replace(linkage(FOUR_BAR_PLACES, "OD", bars, drives=[PinDrive("crank", "O")]), **changes)


def slider_crank_linkage():
    places = {"O": 0, "A": 0.1j, "B": 0.3 + 0.02j}
    links = linkage(places, "O", (("crank", "O", "A"), ("rod", "A", "B"))).links
    guide = Slider("guide", "piston", "ground", "B", 0.02j, 1.0)
    return Mechanism((*links, Link("piston", {"B": 0.0})), (PinDrive("crank", "O"),), places, (guide,))


def three_cranks(a=0.13, b=0.37, extra=False):
    """Return a parallelogram with a third crank; `extra` adds a dyad at its second coupler joint."""
    lean = 0.05 + 0.09j
    places = {"O": 0, "D": a, "G": b, "A": lean, "B": a + lean, "C": b + lean, "P": 0.1 + 0.3j, "E": 0.5 + 0.1j}
    bars = [("first", "O", "A"), ("second", "D", "B"), ("third", "G", "C")]
    if extra:
        bars += [("rod", "B", "P"), ("arm", "E", "P")]
    ground = "ODGE" if extra else "ODG"
    return linkage(places, ground, bars, [("coupler", "ABC")], [PinDrive("first", "O")])
