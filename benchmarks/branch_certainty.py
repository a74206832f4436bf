"""Branch of random mechanisms 1 to 1000 turns from the drawing, compared with references that share no code.

    python benchmarks/branch_certainty.py [MECHANISMS PER KIND] [SEED]

Frameworks of bars range from dyads to Assur groups of ten links. Their reference solves the squared bar lengths in
steps of 1/20,000 of a turn. Linkages that pass change points have closed forms. A position is wrong if it differs by
more than 1e-6 and is not marked as unreliable.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid import Link, Mechanism, PinDrive, Slider, motion

CRANK = 0.1  # length of all cranks [m]
STEPS = 20000  # of the reference, per turn
MAX_ERROR = 1e-6  # of a right position [m], or of a direction
TURNS = (1, 1, 2, 5, 20, 100, 1000)


@dataclass(frozen=True)
class Framework:
    """Bars between points: `fixed` on the ground, "A" the tip of a crank about the origin, the others free."""

    places: dict[str, complex]
    fixed: tuple[str, ...]
    bars: tuple[tuple[str, str], ...]
    start: float

    @property
    def free(self) -> tuple[str, ...]:
        """Points positioned by the bars alone."""
        return tuple(name for name in self.places if name not in self.fixed and name not in ("O", "A"))

    def mechanism(self) -> Mechanism:
        """Return the mechanism with all bars as links."""
        ground = {"O": 0.0} | {name: self.places[name] for name in self.fixed}
        links = [Link("ground", ground), Link("crank", {"O": 0.0, "A": CRANK})]
        for k, (one, other) in enumerate(self.bars):
            links.append(Link(f"bar{k}", {one: 0.0, other: abs(self.places[other] - self.places[one])}))
        return Mechanism(tuple(links), (PinDrive("crank", "O"),), self.places)


def framework(rng: np.random.Generator, points: int, splits: int) -> Framework:
    """Return a random isostatic framework: dyads, then Henneberg steps that split a bar and tie the new point."""

    def anywhere() -> complex:
        return complex(rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4))

    start = rng.uniform(-np.pi, np.pi)
    places = {"O": 0j, "A": CRANK * np.exp(1j * start)}
    fixed = [f"D{k}" for k in range(3)]
    places |= {name: anywhere() for name in fixed}
    known, bars = ["A", *fixed], []
    for k in range(points):
        name = f"P{k}"
        near = "A" if k == 0 else known[-1]
        other = str(rng.choice([each for each in known if each != near]))
        places[name] = anywhere()
        bars += [(near, name), (other, name)]
        known.append(name)
    for k in range(splits):
        name = f"S{k}"
        at = int(rng.integers(len(bars)))
        one, other = bars.pop(at)
        third = str(rng.choice([each for each in known if each not in (one, other)]))
        places[name] = anywhere()
        bars += [(one, name), (other, name), (third, name)]
        known.append(name)
    used = {end for bar in bars for end in bar}
    return Framework(
        {name: place for name, place in places.items() if name in used or name in ("O", "A")},
        tuple(name for name in fixed if name in used),
        tuple(bars),
        start,
    )


def walked(frame: Framework, count: int, way: int) -> Any:
    """Positions of the free points at steps from the drawing, shape (n, points); shorter if the walk ends early."""
    index = {name: k for k, name in enumerate(frame.free)}
    ends = [[frame.places[name] for name in bar] for bar in frame.bars]
    square = np.array([abs(one - other) ** 2 for one, other in ends])
    rows = np.arange(len(frame.bars))
    columns = np.array([[index.get(name, -1) for name in bar] for bar in frame.bars])
    tips = np.array([[name == "A" for name in bar] for bar in frame.bars])
    base = np.array(ends) * ~tips * (columns < 0)

    def system(x: Any, angle: float) -> tuple[Any, Any]:
        at = base + tips * (CRANK * np.exp(1j * angle)) + np.where(columns >= 0, x[columns], 0.0)
        gap = at[:, 0] - at[:, 1]
        matrix = np.zeros((len(rows), 2 * len(index)))
        for side, sign in ((0, 1.0), (1, -1.0)):
            held = columns[:, side] >= 0
            matrix[rows[held], 2 * columns[held, side]] += sign * 2 * gap.real[held]
            matrix[rows[held], 2 * columns[held, side] + 1] += sign * 2 * gap.imag[held]
        return np.abs(gap) ** 2 - square, matrix

    x = np.array([frame.places[name] for name in frame.free], complex)
    sign = np.sign(np.linalg.det(system(x, frame.start)[1]))
    found = [x]
    before = x
    for k in range(1, count):
        angle = frame.start + way * k * 2 * np.pi / STEPS
        guess = 2 * x - before
        here = guess
        for _ in range(8):
            off, matrix = system(here, angle)
            if np.sign(np.linalg.det(matrix)) != sign:
                return np.array(found)
            step = np.linalg.solve(matrix, -off)
            here = here + step[0::2] + 1j * step[1::2]
            if np.abs(step).max() < 1e-12:
                break
        else:
            return np.array(found)
        if np.abs(here - guess).max() > 0.05 * np.abs(here - x).max() + 1e-5 and k > 3:
            return np.array(found)
        before, x = x, here
        found.append(x)
    return np.array(found)


@dataclass
class Count:
    """Counts of positions."""

    requested: int = 0
    right: int = 0
    marked: int = 0
    wrong: int = 0
    missed: int = 0  # marked although the walk reaches them
    unknown: int = 0  # beyond the end of the walk
    seconds: float = 0.0


def requested(rng: np.random.Generator, start: float) -> Any:
    """Return the start and the steps of one run: few or many a turn, evenly spaced or random."""
    turns = int(rng.choice(TURNS)) * int(rng.choice((-1, 1)))
    count = int(rng.integers(20, 160))
    if rng.random() < 0.5:
        steps = np.round(np.linspace(0, turns * STEPS, count))
    else:
        steps = np.sort(rng.integers(0, abs(turns) * STEPS, count)) * np.sign(turns)
        steps[0] = 0
    return start, steps.astype(int)


def checked(frame: Framework, rng: np.random.Generator, count: Count) -> None:
    """Check one framework at the positions of one run; add to the counts."""
    start, steps = requested(rng, frame.start)
    began = time.process_time()
    mechanism = frame.mechanism()
    found = motion(mechanism, start + steps * (2 * np.pi / STEPS), 1.0)
    count.seconds += time.process_time() - began
    way = walked(frame, STEPS + 1, -1 if steps.min() < 0 else 1)
    whole = len(way) == STEPS + 1
    if whole and np.abs(way[-1] - way[0]).max() > 1e-6:
        return  # the framework does not return to its start: that needs a walk over all turns
    mark = ~(found.condition <= 1e12)
    owners = {
        name: next(k for k, link in enumerate(mechanism.links) if k and name in link.points) for name in frame.free
    }
    seen = np.array(
        [found.origin[at] + found.direction[at] * mechanism.links[at].points[name] for name, at in owners.items()]
    ).T
    for k, step in enumerate(steps):
        count.requested += 1
        at = abs(int(step)) % STEPS if whole else abs(int(step))
        known = at < len(way)
        if mark[k]:
            count.marked += 1
            count.missed += known
        elif not known:
            count.unknown += 1
        elif np.abs(seen[k] - way[at]).max() <= MAX_ERROR:
            count.right += 1
        else:
            count.wrong += 1


def rod(name: str, one: str, other: str, length: float) -> Link:
    """Return a link of two points."""
    return Link(name, {one: 0.0, other: length})


def parallelogram(rng: np.random.Generator, start: float) -> tuple[Mechanism, Callable[[Any], Any]]:
    """Return a parallelogram and the rocker's direction: that of the crank."""
    base = rng.uniform(0.12, 0.5)
    tip = CRANK * np.exp(1j * start)
    links = (Link("ground", {"O": 0.0, "D": base}), rod("crank", "O", "A", CRANK), rod("coupler", "A", "B", base))
    drawing = {"O": 0j, "D": base, "A": tip, "B": base + tip}
    return Mechanism(
        (*links, rod("rocker", "D", "B", CRANK)), (PinDrive("crank", "O"),), drawing
    ), lambda angle: np.exp(1j * angle)


def kite(rng: np.random.Generator, start: float) -> tuple[Mechanism, Callable[[Any], Any]]:
    """Return a kite (base = crank, coupler = rocker) and the rocker's direction: the fold bisects the crank's angle."""
    side = rng.uniform(0.12, 0.5)

    def fold(angle: Any) -> Any:
        half = np.asarray(angle) / 2
        return np.exp(1j * half) * (CRANK * np.cos(half) + np.sqrt(side**2 - (CRANK * np.sin(half)) ** 2))

    links = (Link("ground", {"O": 0.0, "D": CRANK}), rod("crank", "O", "A", CRANK), rod("coupler", "A", "B", side))
    drawing = {"O": 0j, "D": CRANK, "A": CRANK * np.exp(1j * start), "B": complex(fold(start))}
    return Mechanism(
        (*links, rod("rocker", "D", "B", side)), (PinDrive("crank", "O"),), drawing
    ), lambda angle: (fold(angle) - CRANK) / side


def isosceles(rng: np.random.Generator, start: float) -> tuple[Mechanism, Callable[[Any], Any]]:
    """Return a slider-crank with a rod as long as the crank, and the rod's direction: the mirrored crank."""
    links = (
        Link("ground", {"O": 0.0}),
        rod("crank", "O", "A", CRANK),
        rod("rod", "A", "B", CRANK),
        Link("block", {"B": 0.0}),
    )
    drawing = {"O": 0j, "A": CRANK * np.exp(1j * start), "B": 2 * CRANK * np.cos(start) + 0j}
    guide = Slider("guide", "block", "ground", "B", 0.0, 1.0)
    return Mechanism(links, (PinDrive("crank", "O"),), drawing, (guide,)), lambda angle: np.exp(-1j * np.asarray(angle))


CHANGING = {"parallelogram": (parallelogram, 3), "kite": (kite, 3), "isosceles slider-crank": (isosceles, 2)}
FRAMES = {
    "dyads": (2, 0),
    "triads": (1, 1),
    "triads behind dyads": (2, 1),
    "larger groups": (1, 2),
    "larger groups behind dyads": (2, 2),
    "groups of ten links": (1, 4),
}


def passed(kind: str, rng: np.random.Generator, count: Count) -> None:
    """Check one linkage that passes change points at the positions of one run; add to the counts."""
    make, link = CHANGING[kind]
    start, steps = requested(rng, rng.uniform(0.05, 3.0))
    mechanism, expected = make(rng, start)
    angle = start + steps * (2 * np.pi / STEPS)
    began = time.process_time()
    found = motion(mechanism, angle, 1.0)
    count.seconds += time.process_time() - began
    mark = ~(found.condition <= 1e12)
    # the program reaches the first position from the drawing by the shorter way
    turns = 2 * np.pi * np.round((angle[0] - start) / (2 * np.pi))
    off = np.abs(found.direction[link] - expected(angle - turns))
    count.requested += len(angle)
    count.marked += int(mark.sum())
    count.missed += int((mark & (np.abs(np.sin(angle)) > 1e-3)).sum())
    count.wrong += int((~mark & ~(off <= MAX_ERROR * np.maximum(1, np.abs(angle)))).sum())
    count.right += int((~mark & (off <= MAX_ERROR * np.maximum(1, np.abs(angle)))).sum())


def run(mechanisms: int, seed: int, kinds: Any = None) -> dict[str, Count]:
    """Return the counts of every kind of mechanism."""
    found = {}
    for number, kind in enumerate((*FRAMES, *CHANGING)):
        if kinds is not None and kind not in kinds:
            continue
        found[kind] = Count()
        for k in range(mechanisms):
            rng = np.random.default_rng([seed, number, k])
            if kind in FRAMES:
                checked(framework(rng, *FRAMES[kind]), rng, found[kind])
            else:
                passed(kind, rng, found[kind])
    return found


def main() -> None:
    mechanisms, seed = (int(word) for word in (sys.argv[1:] + ["100", "1"][len(sys.argv) - 1 :]))
    total = Count()
    for kind, count in run(mechanisms, seed).items():
        print(f"{kind:28} {count}")
        for name in vars(total):
            setattr(total, name, getattr(total, name) + getattr(count, name))
    print(f"{'all':28} {total}")


if __name__ == "__main__":
    main()
