"""Rate of positions on a wrong branch, for random mechanisms with general groups.

    python benchmarks/branch_rate.py [MECHANISMS] [SEED] [FIRST] [sliders]

The reference is `branch_tracker`, which shares no code with the program. An unmarked position is wrong if a link is off
by more than 1e-6, or if the drive cannot reach it. A marked position is missed if the tracker reaches it.
"""

import csv
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from branch_tracker import Body, Tie, Track, tracked
from msgspec.structs import replace

from rigid import Link, Mechanism, MechanismError, PinDrive, Slider, motion

MAX_ERROR = 1e-6  # of a unit vector, or of positions [m] of mechanisms of about 1 m
END_MARGIN = 1e-7  # [rad] about an end, in which the tracker does not decide
TURNS = (1, 1, 2, 3, 5, 10, 25)
FEW_TURNS = (1, 1, 2)  # of mechanisms with sliders, most of which end within a turn
WRITE_EVERY = 100  # mechanisms
RESULTS = Path(__file__).parent / "results" / "branch_rate.csv"
SLIDERS_RESULTS = RESULTS.with_name("branch_rate_sliders.csv")


@dataclass(frozen=True)
class Guide:
    """A block pinned to other links at `pin` that slides on the link `on` along a line through `pin`."""

    pin: str
    on: str
    direction: complex


@dataclass(frozen=True)
class Slide:
    """A link that slides on another along a line through one of its points, without relative rotation."""

    link: str
    on: str
    point: str
    direction: complex


@dataclass(frozen=True)
class Drawn:
    """Points, and links by their points: the ground, then the crank, which rotates about its first point."""

    points: dict[str, complex]
    links: dict[str, tuple[str, ...]]
    guides: tuple[Guide, ...] = ()
    slides: tuple[Slide, ...] = ()

    @property
    def start(self) -> float:
        """Drawn angle of the crank."""
        return float(np.angle(self._way(self.links["crank"])))

    def _way(self, names: tuple[str, ...]) -> complex:
        return self.points[names[1]] - self.points[names[0]]

    def local(self, name: str) -> dict[str, complex]:
        """Points of a link in its own axes, from its first point to its second."""
        names = self.links[name]
        if name == "ground":
            return {point: self.points[point] for point in names}
        unit = self._way(names) / abs(self._way(names)) if len(names) > 1 else 1.0
        return {point: (self.points[point] - self.points[names[0]]) / unit for point in names}

    def bodies(self) -> list[Body]:
        """Bodies of the tracker."""
        found = []
        for name, names in self.links.items():
            turned = name == "ground" or len(names) == 1
            origin = 0j if name == "ground" else self.points[names[0]]
            angle = 0.0 if turned else float(np.angle(self._way(names)))
            found.append(Body(self.local(name), origin, angle))
        for guide in self.guides:
            on = found[list(self.links).index(guide.on)]
            found.append(Body({guide.pin: 0j}, self.points[guide.pin], on.angle))
        return found

    def ties(self) -> list[Tie]:
        """Ties of the tracker; a pin of more than two links is a chain of ties."""
        names = list(self.links)
        meet: dict[str, list[int]] = {}
        for at, name in enumerate(names):
            for point in self.links[name]:
                meet.setdefault(point, []).append(at)
        for k, guide in enumerate(self.guides):
            meet[guide.pin].append(len(names) + k)
        bodies = self.bodies()
        hinge = self.links["crank"][0]
        found = [
            Tie(one, other, bodies[one].points[point], bodies[other].points[point])
            for point, where in meet.items()
            if point != hinge
            for one, other in pairwise(where)
        ]
        for k, guide in enumerate(self.guides):
            on = names.index(guide.on)
            foot, line = self._line(guide, bodies[on])
            found.append(Tie(on, len(names) + k, foot, 0j, line))
        for slide in self.slides:
            on, link = names.index(slide.on), names.index(slide.link)
            foot, line = self._line(slide, bodies[on])
            found.append(Tie(on, link, foot, bodies[link].points[slide.point], line))
        return found

    def _line(self, guide: Guide | Slide, on: Body) -> tuple[complex, complex]:
        unit = complex(np.exp(1j * on.angle))
        point = guide.pin if isinstance(guide, Guide) else guide.point
        return (self.points[point] - on.origin) / unit, guide.direction / unit

    def mechanism(self) -> Mechanism:
        """Mechanism of the program."""
        bodies = self.bodies()
        links = [Link(name, self.local(name)) for name in self.links]
        sliders = []
        for k, guide in enumerate(self.guides):
            links.append(Link(f"block{k}", {guide.pin: 0.0}))
            foot, line = self._line(guide, bodies[list(self.links).index(guide.on)])
            sliders.append(Slider(f"guide{k}", f"block{k}", guide.on, guide.pin, foot, line))
        for k, slide in enumerate(self.slides):
            on = bodies[list(self.links).index(slide.on)]
            angle = bodies[list(self.links).index(slide.link)].angle - on.angle
            foot, line = self._line(slide, on)
            sliders.append(Slider(f"slide{k}", slide.link, slide.on, slide.point, foot, line, np.exp(1j * angle)))
        drives = (PinDrive("crank", self.links["crank"][0]),)
        return Mechanism(tuple(links), drives, dict(self.points), tuple(sliders))

    def track(self, angles: Any) -> Track:
        """Track of the reference at crank angles."""
        return tracked(self.bodies(), self.ties(), list(self.links).index("crank"), self.start, angles)


Random = np.random.Generator


def anywhere(rng: Random, size: float = 0.5) -> complex:
    """Return a random point of a square."""
    return complex(rng.uniform(-size, size), rng.uniform(-size, size))


def with_crank(rng: Random, points: dict[str, complex]) -> dict[str, complex]:
    """Add a crank of 0.05 to 0.25 m."""
    foot = anywhere(rng)
    return points | {"O": foot, "K": foot + rng.uniform(0.05, 0.25) * np.exp(1j * rng.uniform(-np.pi, np.pi))}


def plate_on_rods(rng: Random) -> Drawn:
    """Return a triad: a plate on three rods."""
    points = with_crank(rng, {name: anywhere(rng) for name in "ABCGH"})
    links = {"ground": ("O", "G", "H"), "crank": ("O", "K"), "plate": ("A", "B", "C")}
    return Drawn(points, links | {"r1": ("G", "A"), "r2": ("H", "B"), "r3": ("K", "C")})


def plate_on_a_guide(rng: Random) -> Drawn:
    """Return a triad with a block on the ground."""
    drawn = plate_on_rods(rng)
    links = {name: names for name, names in drawn.links.items() if name != "r1"} | {"ground": ("O", "H")}
    points = {name: place for name, place in drawn.points.items() if name != "G"}
    return Drawn(points, links, (Guide("A", "ground", complex(np.exp(1j * rng.uniform(0, np.pi)))),))


def plate_on_a_swivel(rng: Random) -> Drawn:
    """Return a triad with a block that is pinned to the ground and slides in the plate."""
    drawn = plate_on_rods(rng)
    links = {name: names for name, names in drawn.links.items() if name != "r1"} | {"plate": ("B", "C")}
    points = {name: place for name, place in drawn.points.items() if name != "A"}
    return Drawn(points, links, (Guide("G", "plate", complex(np.exp(1j * rng.uniform(0, np.pi)))),))


def two_plates(rng: Random) -> Drawn:
    """Return two plates pinned to each other and four rods: two loops."""
    points = with_crank(rng, {name: anywhere(rng) for name in "ABCDEGH"} | {"J": anywhere(rng)})
    links = {"ground": ("O", "G", "H", "J"), "crank": ("O", "K"), "plate": ("A", "B", "C"), "wing": ("C", "D", "E")}
    return Drawn(points, links | {"r1": ("G", "A"), "r2": ("H", "B"), "r3": ("K", "D"), "r4": ("J", "E")})


def eight_bar(rng: Random) -> Drawn:
    """Return three plates and three rods: three loops."""
    points = with_crank(rng, {f"J{k}": anywhere(rng) for k in (0, 1, 2, 4, 5, 6, 8, 9)})
    links = {"ground": ("J5", "J6", "O"), "crank": ("O", "K"), "t1": ("J1", "J6", "J8"), "t2": ("J0", "K", "J4")}
    links |= {"t3": ("J2", "J4", "J9"), "b1": ("J0", "J1"), "b2": ("J8", "J9"), "b3": ("J2", "J5")}
    return Drawn(points, links)


def eight_bar_with_a_triangle(rng: Random) -> Drawn:
    """Return three plates and three rods; two plates and a rod form a rigid triangle."""
    points = with_crank(rng, {f"J{k}": anywhere(rng) for k in (0, 2, 4, 5, 6, 7, 8, 9)})
    links = {"ground": ("O", "J8", "J9"), "crank": ("O", "K"), "t1": ("K", "J6", "J7"), "t2": ("J4", "J5", "J6")}
    links |= {"t3": ("J0", "J2", "J8"), "b1": ("J2", "J9"), "b2": ("J0", "J4"), "b3": ("J5", "J7")}
    return Drawn(points, links)


def rods(rng: Random, splits: int) -> Drawn:
    """Return a dyad with Henneberg steps that split rods and tie the new points: groups of up to ten rods."""
    points = with_crank(rng, {"D0": anywhere(rng), "D1": anywhere(rng), "D2": anywhere(rng), "P": anywhere(rng)})
    bars, known = [("K", "P"), ("D0", "P")], ["K", "D0", "D1", "D2", "P"]
    for k in range(splits):
        name = f"S{k}"
        one, other = bars.pop(int(rng.integers(len(bars))))
        third = str(rng.choice([each for each in known if each not in (one, other)]))
        points[name] = anywhere(rng)
        bars += [(one, name), (other, name), (third, name)]
        known.append(name)
    used = {end for bar in bars for end in bar} | {"O", "K"}
    points = {name: place for name, place in points.items() if name in used}
    ground = ("O", *(name for name in ("D0", "D1", "D2") if name in used))
    return Drawn(points, {"ground": ground, "crank": ("O", "K")} | {f"b{k}": bar for k, bar in enumerate(bars)})


def near_change_point(rng: Random) -> Drawn:
    """Return a plate on three equal cranks, disturbed by 1e-9 to 1e-1 m."""
    drawn = plate_on_rods(rng)
    way = drawn.points["K"] - drawn.points["O"]
    points = drawn.points | {"A": drawn.points["G"] + way, "B": drawn.points["H"] + way}
    return shaken(rng, replace(drawn, points=points))


def shaken(rng: Random, drawn: Drawn) -> Drawn:
    """Move all points except the crank's by 1e-9 to 1e-1 m."""
    distance = 10 ** rng.uniform(-9, -1)
    points = {name: at if name in "OK" else at + distance * anywhere(rng, 0.5) for name, at in drawn.points.items()}
    return replace(drawn, points=points)


def near_a_dead_point(rng: Random) -> Drawn:
    """Return a mechanism drawn 1e-9 to 1e-1 rad before the end of its range."""
    while True:
        drawn = SIMPLE[str(rng.choice(list(SIMPLE)))](rng)
        way = int(rng.choice((-1, 1)))
        end = drawn.track([drawn.start + way * 2 * np.pi]).end
        before = 10 ** rng.uniform(-9, -1)
        if np.isfinite(end) and abs(end - drawn.start) > before:
            return redrawn(drawn, end - way * before)


def redrawn(drawn: Drawn, angle: float) -> Drawn:
    """Return the mechanism drawn at another crank angle."""
    there = drawn.track([angle])
    bodies = drawn.bodies()
    points = {}
    for at, body in enumerate(bodies):
        for name, local in body.points.items():
            points[name] = complex(there.origin[at, 0] + np.exp(1j * there.angle[at, 0]) * local)
    guides = tuple(
        replace(guide, direction=guide.direction * complex(np.exp(1j * (there.angle[k, 0] - bodies[k].angle))))
        for guide in drawn.guides
        for k in [list(drawn.links).index(guide.on)]
    )
    return replace(drawn, points=points, guides=guides)


def between_turning_and_not(rng: Random) -> Drawn:
    """Return a mechanism within 1e-9 to 1e-1 of the limit between full rotation and oscillation."""
    while True:
        drawn = SIMPLE[str(rng.choice(list(SIMPLE)[:5]))](rng)
        name = str(rng.choice([each for each in drawn.points if each not in "OK"]))
        aside = anywhere(rng)

        def at(part: float, drawn: Drawn = drawn, name: str = name, aside: complex = aside) -> Drawn:
            return replace(drawn, points=drawn.points | {name: drawn.points[name] + part * aside})

        def turns(part: float) -> bool:
            each = at(part)
            try:
                return bool(np.isinf(each.track([each.start + 2 * np.pi]).end))
            except ArithmeticError:  # too many steps
                return False

        low, high = 0.0, 1.0
        if not turns(low) or turns(high):
            continue
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if turns(middle) else (low, middle)
        return at(high + rng.choice((-1, 1)) * 10 ** rng.uniform(-9, -1))


GRAPHS = {  # joints between links, without the crank's joint with the ground
    "dyads with sliders": "crank a, a b, b ground, b c, c d, d ground",
    "triad with sliders": "crank a, a plate, b plate, c plate, b ground, c ground",
    "two loops with sliders": "crank a, a plate, b plate, plate wing, c wing, d wing, b ground, c ground, d ground",
}


def with_sliders(rng: Random, graph: str) -> Drawn:
    """Return a mechanism of a graph of links with sliders and pins, each with probability 1/2."""
    points = with_crank(rng, {})
    joints = [tuple(joint.split()) for joint in GRAPHS[graph].split(", ")]
    links: dict[str, list[str]] = {"ground": ["O"], "crank": ["O", "K"]}
    slides = []
    for k, ends in enumerate(joints):
        name = f"J{k}"
        points[name] = anywhere(rng)
        link, on = ends[:: int(rng.choice((-1, 1)))]
        links.setdefault(link, []).append(name)
        links.setdefault(on, [])
        if rng.random() < 0.5:
            slides.append(Slide(link, on, name, complex(np.exp(1j * rng.uniform(0, np.pi)))))
        else:
            links[on].append(name)
    for link, names in links.items():
        while link != "ground" and len(names) < 2:
            names.append(f"{link}{len(names)}")
            points[names[-1]] = anywhere(rng)
    return Drawn(points, {link: tuple(names) for link, names in links.items()}, slides=tuple(slides))


SLIDING: dict[str, Callable[[Random], Drawn]] = {
    graph: lambda rng, graph=graph: with_sliders(rng, graph)  # type: ignore[misc]
    for graph in GRAPHS
}
SIMPLE: dict[str, Callable[[Random], Drawn]] = {
    "plate on three rods": plate_on_rods,
    "plate on a guide": plate_on_a_guide,
    "plate on a swivel": plate_on_a_swivel,
    "two plates": two_plates,
    "eight-bar": eight_bar,
    "eight-bar with a triangle": eight_bar_with_a_triangle,
    "rods, 1 split": lambda rng: rods(rng, 1),
    "rods, 2 splits": lambda rng: rods(rng, 2),
    "rods, 4 splits": lambda rng: rods(rng, 4),
}
KINDS = SIMPLE | {
    "near a change point": near_change_point,
    "drawn near a dead point": near_a_dead_point,
    "between turning and not": between_turning_and_not,
}


@dataclass
class Count:
    """Counts of mechanisms and positions, and times."""

    mechanisms: int = 0
    undecided: int = 0  # mechanisms that the tracker cannot follow, near singular positions of higher order
    requested: int = 0
    right: int = 0
    beyond: int = 0  # rightly marked
    wrong: int = 0
    missed: int = 0
    mechanisms_wrong: int = 0
    mechanisms_missed: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    tracker_seconds: float = 0.0


def crank_angles(rng: Random, start: float, of: tuple[int, ...] = TURNS) -> Any:
    """Return crank angles over 1 to 25 turns in either sense, 5 to 90 a turn."""
    turns = int(rng.choice(of))
    count = int(rng.integers(5, 91)) * turns
    return start + rng.choice((-1, 1)) * np.linspace(0, turns * 2 * np.pi, count, endpoint=False)


def compared(drawn: Drawn, angles: Any, count: Count) -> tuple[int, int]:
    """Compare one mechanism with the tracker; return the numbers of wrong and missed positions."""
    began = time.process_time()
    reference = drawn.track(angles)
    count.tracker_seconds += time.process_time() - began
    began = time.process_time()
    found = motion(drawn.mechanism(), angles, 1.0)
    spent = time.process_time() - began
    count.seconds += spent
    count.slowest = max(count.slowest, spent)
    with np.errstate(invalid="ignore"):
        marked = ~(found.condition <= 1e12)
        turned = np.abs(found.direction - np.exp(1j * reference.angle)).max(axis=0)
        moved = np.abs(found.origin - reference.origin).max(axis=0)
        right = (turned <= MAX_ERROR) & (moved <= MAX_ERROR)
    known = np.isfinite(reference.angle).all(axis=0)
    decided = np.abs(angles - reference.end) > max(END_MARGIN, reference.unsure)
    wrong, missed = ~marked & ~right & decided, marked & known & decided
    count.mechanisms += 1
    count.requested += len(angles)
    count.right += int((right & ~marked).sum())
    count.beyond += int((marked & ~known).sum())
    count.wrong += int(wrong.sum())
    count.missed += int(missed.sum())
    count.mechanisms_wrong += bool(wrong.any())
    count.mechanisms_missed += bool(missed.any())
    return int(wrong.sum()), int(missed.sum())


def case(seed: int, number: int, kinds: dict[str, Callable[[Random], Drawn]] = KINDS) -> tuple[str, Drawn, Any]:
    """Return the kind, the mechanism and the crank angles of a case."""
    rng = np.random.default_rng([seed, number])
    kind = list(kinds)[number % len(kinds)]
    drawn = kinds[kind](rng)
    return kind, drawn, crank_angles(rng, drawn.start, TURNS if kinds is KINDS else FEW_TURNS)


def upper(wrong: int, of: int) -> float:
    """Upper end of the 95 % confidence interval of a rate (Clopper-Pearson)."""
    from scipy.stats import beta

    return float(beta.ppf(0.975, wrong + 1, of - wrong)) if wrong < of else 1.0


def together(counts: Iterable[Count]) -> Count:
    """Sum the counts of all kinds."""
    total = Count()
    for count in counts:
        for name, value in vars(count).items():
            before = getattr(total, name)
            setattr(total, name, max(before, value) if name == "slowest" else before + value)
    return total


def main() -> None:
    words = [word for word in sys.argv[1:] if word != "sliders"]
    kinds, results = (SLIDING, SLIDERS_RESULTS) if "sliders" in sys.argv else (KINDS, RESULTS)
    mechanisms, seed, first = (int(word) for word in (words + ["1200", "1", "0"][len(words) :]))
    counts = {kind: Count() for kind in kinds}
    for number in range(first, first + mechanisms):
        kind = list(kinds)[number % len(kinds)]
        try:
            _, drawn, angles = case(seed, number, kinds)
            wrong, missed = compared(drawn, angles, counts[kind])
        except (ArithmeticError, np.linalg.LinAlgError, MechanismError):  # sliders may leave a link undetermined
            counts[kind].undecided += 1
            continue
        if wrong or missed:
            print(f"{number} {kind}: {wrong} wrong, {missed} missed of {len(angles)}", flush=True)
        if number % WRITE_EVERY == 0 or number == first + mechanisms - 1:
            write_counts(counts, results)
    for kind, count in counts.items():
        print(f"{kind:26} {count}")
    total = together(counts.values())
    print(f"wrong mechanisms: at most {upper(total.mechanisms_wrong, total.mechanisms):.2g} (95 %)")


def write_counts(counts: dict[str, Count], results: Path) -> None:
    """Write the counts so far."""
    with results.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["kind", *vars(Count())])
        for kind, count in (counts | {"all": together(counts.values())}).items():
            writer.writerow([kind, *(f"{v:.4g}" if isinstance(v, float) else v for v in vars(count).values())])


if __name__ == "__main__":
    main()
