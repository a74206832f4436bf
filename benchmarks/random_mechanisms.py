"""Random mechanisms with a crank at constant speed: four-bars, slider-cranks, six-bars, some with ternary links."""

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Section
from elastic.vibration import natural_frequencies
from rigid import Beam, Link, Lump, Mechanism, MechanismError, Motion, PinDrive, Slider, motion

MATERIALS = {"steel": (210e9, 7850.0), "aluminium": (70e9, 2700.0)}
KINDS = ("four-bar", "ternary four-bar", "slider-crank", "Stephenson six-bar", "Watt six-bar")
SLENDER = 10.0, 200.0  # length over radius of gyration
RATIO = 1 / 100, 1 / 3  # crank speed over lowest natural frequency
MARGIN = 0.75  # largest distance that a dyad spans, relative to its stretched length; a longer one snaps through
GRAVITY = -9.81j


@dataclass(frozen=True, eq=False)
class Drawn:
    """A mechanism, its sections and its crank speed [rad/s]; `ratio` is the speed over the lowest natural frequency."""

    kind: str
    material: str
    slenderness: float
    ratio: float
    mechanism: Mechanism
    sections: tuple[Section, ...]
    start: float
    speed: float

    @property
    def period(self) -> float:
        """Duration of a turn [s]."""
        return 2 * math.pi / self.speed

    def motion_at(self, time: Any) -> Motion:
        """Motion at any instants [s]."""
        time = np.asarray(time, float)
        return motion(self.mechanism, self.start + self.speed * time, self.speed, 0.0, time)


def apex(first: Any, second: Any, long: float, short: float) -> Any:
    """Intersection of two circles, on the left of the line from one centre to the other; nan if they do not meet."""
    way = second - first
    x = (np.abs(way) ** 2 + long**2 - short**2) / (2 * np.abs(way))
    with np.errstate(invalid="ignore"):
        return first + way / np.abs(way) * (x + 1j * np.sqrt(long**2 - x**2))


class Draw:
    """Random numbers, links and sections of one mechanism."""

    def __init__(self, random: Any) -> None:
        self.random = random
        self.size = 10 ** random.uniform(-1, 0)
        self.material = str(random.choice(list(MATERIALS)))
        self.E, self.density = MATERIALS[self.material]
        self.slenderness = 10 ** random.uniform(*np.log10(SLENDER))
        self.links: list[Link] = []
        self.sections: list[Section] = []

    def between(self, low: float, high: float) -> float:
        """Return a random number of an interval."""
        return float(self.random.uniform(low, high))

    def link(self, name: str, points: dict[str, complex]) -> None:
        """Add a link of one beam, or of two that meet in its third point; half of the links get a point mass there."""
        names = list(points)
        pairs = [(names[0], names[1])] if len(names) == 2 else [(names[0], names[2]), (names[2], names[1])]
        longest = max(abs(points[b] - points[a]) for a, b in pairs)
        own = float(np.clip(self.slenderness * 2 ** self.between(-1, 1), *SLENDER))
        depth = math.sqrt(12) * longest / own
        width = depth * self.between(0.3, 2)
        mass = self.density * depth * width
        self.sections += [Section(EA=self.E * depth * width, EI=self.E * width * depth**3 / 12)] * len(pairs)
        lumps = ()
        if self.random.random() < 0.5:
            lumps = (Lump(names[-1], mass * longest * self.between(0, 1)),)
        self.links.append(Link(name, points, tuple(Beam(a, b, mass) for a, b in pairs), lumps))

    def corner(self, length: float) -> complex:
        """Return the third point of a ternary link."""
        return length * complex(self.between(0.3, 0.7), self.between(0.1, 0.5))


def reached(low: float, high: float, draw: Draw) -> tuple[float, float]:
    """Return the bar lengths of a dyad that spans all distances from `low` to `high`."""
    total, apart = high / MARGIN * draw.between(1, 1.3), low * MARGIN * draw.between(-1, 1)
    return (total + apart) / 2, (total - apart) / 2


def drawn(random: Any) -> Drawn | None:
    """Return a random mechanism, or None if its crank cannot make a full turn."""
    draw, kind = Draw(random), str(random.choice(KINDS))
    start = draw.between(0, 2 * math.pi)
    turn = start + np.linspace(0, 2 * math.pi, 73)
    crank = draw.size * draw.between(0.1, 0.4)
    A = crank * np.exp(1j * turn)
    draw.link("crank", {"O": 0.0, "A": crank})
    build = _slider_crank if kind == "slider-crank" else _linkage
    ground, drawing, sliders = build(draw, kind, A)
    links = Link("ground", {"O": 0.0, **ground}), *draw.links
    places = {"O": 0.0, "A": A[0], **drawing}
    gravity = GRAVITY if random.random() < 0.5 else 0.0
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), places, sliders, gravity=gravity)
    ratio = float(np.exp(random.uniform(*np.log(RATIO))))
    try:
        moved = motion(mechanism, turn[:-1], 1.0)
        lowest = natural_frequencies(moved, draw.sections, modes=1, positions=24).lowest
    except MechanismError:
        return None
    if not (moved.condition < 1e8).all() or not math.isfinite(lowest):
        return None
    features = kind, draw.material, draw.slenderness, ratio
    return Drawn(*features, mechanism, tuple(draw.sections), start, ratio * lowest)


def _slider_crank(draw: Draw, _: str, A: Any) -> Any:
    """Add the rod and the block of a slider-crank; the guide has a random slope and offset."""
    way, offset = cmath.exp(1j * draw.between(0, 2 * math.pi)), abs(A[0]) * draw.between(-1, 1)
    across = (A / way).imag - offset
    rod = float(np.abs(across).max()) / draw.between(0.25, 0.8)
    foot = 1j * offset * way
    along = float((A[0] / way).real) + math.sqrt(rod**2 - float(across[0]) ** 2)
    draw.link("rod", {"A": 0.0, "B": rod})
    rod_mass = draw.links[-1].beams[0].mass_per_length * rod
    draw.links.append(Link("block", {"B": 0.0}, lumps=(Lump("B", rod_mass * draw.between(0.1, 2)),)))
    return {}, {"B": foot + way * along}, (Slider("guide", "block", "ground", "B", origin=foot, direction=way),)


def _linkage(draw: Draw, kind: str, A: Any) -> Any:
    """Add the dyad of a crank-rocker, and the second dyad of a six-bar."""
    D = complex(draw.size * draw.between(0.5, 1.2))
    coupler, rocker = reached(abs(np.abs(A - D).min()), float(np.abs(A - D).max()), draw)
    B = apex(A, D, coupler, rocker)
    ground, drawing = {"D": D}, {"D": D, "B": B[0]}
    P = None
    if kind in ("ternary four-bar", "Stephenson six-bar"):
        own = draw.corner(coupler)
        draw.link("coupler", {"A": 0.0, "B": coupler, "P": own})
        draw.link("rocker", {"D": 0.0, "B": rocker})
        P = A + (B - A) / coupler * own
    elif kind == "Watt six-bar":
        own = draw.corner(rocker)
        draw.link("coupler", {"A": 0.0, "B": coupler})
        draw.link("rocker", {"D": 0.0, "B": rocker, "P": own})
        P = D + (B - D) / rocker * own
    else:
        draw.link("coupler", {"A": 0.0, "B": coupler})
        draw.link("rocker", {"D": 0.0, "B": rocker})
    if P is not None:
        drawing["P"] = P[0]
    if P is not None and kind.endswith("six-bar"):
        G = P.mean() + draw.size * draw.between(0.6, 1.2) * cmath.exp(1j * draw.between(0, 2 * math.pi))
        apart = np.abs(P - G)
        rod, swing = reached(float(apart.min()), float(apart.max()), draw)
        draw.link("rod", {"P": 0.0, "Q": rod})
        draw.link("swing", {"G": 0.0, "Q": swing})
        ground["G"] = G
        drawing |= {"G": G, "Q": apex(P, G, rod, swing)[0]}
    return ground, drawing, ()


def mechanisms(seed: int) -> Iterator[Drawn]:
    """Yield mechanisms endlessly; each has its own seed, so one that fails does not change the others."""
    number = 0
    while True:
        found = drawn(np.random.default_rng((seed, number)))
        number += 1
        if found is not None:
            yield found
