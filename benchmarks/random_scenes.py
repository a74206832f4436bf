"""Random scenes: linkages and arms, at constant speed or by laws, with springs, masses, gears and loads."""

import cmath
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from msgspec.structs import replace
from random_mechanisms import Draw, Drawn, apex, drawn, reached

from elastic import JointCompliance, Section, with_rotary_inertia
from elastic.vibration import natural_frequencies
from kinelast.scene.course import CourseByLaws, Run
from kinelast.scene.data import Scene
from rigid import (
    ConstantSpeed,
    Gear,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    RepeatedLaw,
    Segment,
    SegmentedLaw,
    Spring,
    TorsionSpring,
    motion,
)
from rigid.dynamics import law_of_time

FEATURES = (
    "constant speed", "shear", "stops that repeat", "springs", "soft joints", "loads of time", "end masses",
    "from rest to rest", "two cranks", "geared cranks", "arm of two drives",
)  # fmt: skip
CURVES = "cycloidal", "polynomial-345", "polynomial-4567"
POSITIONS = 120, 180, 240, 360


def scenes(seed: int) -> Iterator[Scene]:
    """Yield scenes endlessly; every scene has a seed, and its title names the feature."""
    number = 0
    while True:
        random = np.random.default_rng((seed, number))
        feature = FEATURES[number % len(FEATURES)]
        made = None
        while made is None:
            made = _five_bar(random, feature) if feature in FEATURES[-3:] else _linkage(random, feature)
        yield replace(made, name=f"{seed}-{number}")
        number += 1


def scene_of(mechanism: Mechanism, sections: Any, laws: Any, run: Run, title: str, joints: Any = None) -> Scene:
    """Return a scene without a file."""
    names = [mechanism.links[at].name for at, _ in mechanism.beams]
    labels = tuple(
        name if names.count(name) == 1 else f"{name}.{names[:k].count(name) + 1}" for k, name in enumerate(names)
    )
    return Scene(
        name=title,
        title=title,
        source="",
        course=CourseByLaws(with_rotary_inertia(mechanism, sections), tuple(laws), run, "drawn at random"),
        sections=tuple(sections),
        labels=labels,
        joints=joints or {},
        materials={},
        outlines={},
    )


def _linkage(random: Any, feature: str) -> Scene | None:
    case = drawn(random)
    if case is None:
        return None
    run = Run(int(random.choice(POSITIONS)), case.period, turn=True)
    law: Any = ConstantSpeed(case.start, case.speed)
    mechanism, sections, joints = case.mechanism, case.sections, {}
    if feature == "shear":
        sections = tuple(sheared(own) for own in sections)
    elif feature == "end masses":
        mechanism = replace(mechanism, links=tuple(_heavier(random, link) for link in mechanism.links))
    elif feature == "springs":
        mechanism = replace(mechanism, loads=_springs(random, case))
    elif feature == "soft joints":
        soft = random.uniform(0.01, 1.0) * _compliance(case)
        joints = {"A": JointCompliance(translation=soft)}
    elif feature == "loads of time":
        mechanism = replace(mechanism, loads=_loads(random, case))
    elif feature in ("stops that repeat", "from rest to rest"):
        law, run = _stops(random, case, run, repeat=feature == "stops that repeat")
    title = f"{feature}: {case.kind}"
    return scene_of(mechanism, sections, [law], run, title, joints)


def sheared(own: Section) -> Section:
    """Add the shear stiffness and inertia of a steel rectangle with the same EA and EI."""
    depth = math.sqrt(12 * float(own.EI) / float(own.EA))
    area = depth * depth
    return replace(own, kGA=float(own.EA) * 5 / 6 / 2.6, area=area, inertia=area * depth**2 / 12)


def _heavier(random: Any, link: Link) -> Link:
    if not link.beams:
        return link
    mass = sum(
        float(own.mass_per_length) * abs(complex(link.points[own.end]) - complex(link.points[own.start]))
        for own in link.beams
    )
    return replace(link, lumps=(Lump(list(link.points)[-1], mass * random.uniform(0.5, 3.0)),))


def _stiffness(case: Drawn) -> float:
    """Bending stiffness 3 EI/l^3 of the longest beam [N/m]."""
    number = max(range(len(case.sections)), key=lambda k: _length(case, k))
    return 3 * float(case.sections[number].EI) / _length(case, number) ** 3


def _length(case: Drawn, number: int) -> float:
    at, beam = case.mechanism.beams[number]
    points = case.mechanism.links[at].points
    return abs(complex(points[beam.end]) - complex(points[beam.start]))


def _compliance(case: Drawn) -> float:
    return 1.0 / (20 * _stiffness(case))


def _springs(random: Any, case: Drawn) -> tuple[Any, ...]:
    rate = _stiffness(case) * random.uniform(0.002, 0.05)
    last = case.mechanism.links[2]
    point = list(last.points)[-1]
    length = 2 * _length(case, 0) * random.uniform(0.5, 2.0)
    spring = Spring(last.name, point, anchor="O", stiffness=rate, length=length, damping=0.01 * rate / case.speed)
    moment = _stiffness(case) * _length(case, 0) ** 2 * random.uniform(0.002, 0.05)
    if case.kind == "slider-crank":
        return (spring,)
    return spring, TorsionSpring("rocker", "D", stiffness=moment)


def _loads(random: Any, case: Drawn) -> tuple[Any, ...]:
    order = int(random.integers(1, 5))
    size = _stiffness(case) * _length(case, 0) * random.uniform(0.0003, 0.01)
    way = cmath.exp(1j * random.uniform(0, 2 * math.pi))
    law = law_of_time(lambda time: np.sin(order * case.speed * time) + 0.3)
    last = case.mechanism.links[2]
    point = PointLoad(last.name, list(last.points)[-1], force=size * way, law=law)
    line = LineLoad(last.name, 0, 0.3 * size * way / _length(case, 1), 0.0, turning=bool(random.random() < 0.5))
    return point, line


def _stops(random: Any, case: Drawn, run: Run, repeat: bool) -> tuple[Any, Run]:
    """Return a law with dwells, there and back or only there, and its run."""
    by = math.radians(random.uniform(40, 200)) * random.choice([-1, 1])
    part = case.period * random.uniform(0.3, 1.0)
    curve = str(random.choice(CURVES))
    there = Segment(curve, part, by)
    if not repeat:
        law = SegmentedLaw(case.start, (there, Segment("dwell", part * random.uniform(0.05, 0.5))))
        return law, Run(run.positions, law.duration, turn=False)
    stop = Segment("dwell", part * random.uniform(0.3, 1.0))
    law = SegmentedLaw(case.start, (there, stop, Segment(curve, part, -by), stop))
    return RepeatedLaw(law), Run(run.positions, law.duration, turn=True)


def _five_bar(random: Any, feature: str) -> Scene | None:
    """Return a five-bar with two cranks, geared or both driven, or an arm of two links; None if it cannot move."""
    draw = Draw(random)
    if feature == "arm of two drives":
        return _arm(random, draw)
    first, second = (draw.size * draw.between(0.1, 0.3) for _ in range(2))
    far, start = complex(draw.size * draw.between(0.8, 1.4)), draw.between(0, 2 * math.pi)
    other = draw.between(0, 2 * math.pi)
    ratio = float(random.choice([1.0, -1.0, 2.0, -2.0]))
    turn = np.linspace(0, 2 * math.pi, 73)
    A, B = first * np.exp(1j * (start + turn)), far + second * np.exp(1j * (other + ratio * turn))
    apart = np.abs(B - A)
    if apart.min() < 0.1 * draw.size:
        return None
    rod, reach = reached(float(apart.min()), float(apart.max()), draw)
    P = apex(A, B, rod, reach)
    if not np.isfinite(P).all() or min(rod, reach) < 0.1 * draw.size:
        return None
    draw.link("crank", {"O": 0.0, "A": first})
    draw.link("second", {"D": 0.0, "B": second})
    draw.link("rod", {"A": 0.0, "P": rod})
    draw.link("reach", {"B": 0.0, "P": reach})
    links = Link("ground", {"O": 0.0, "D": far}), *draw.links
    drawing = {"O": 0.0, "A": A[0], "B": B[0], "P": P[0], "D": far}
    drives: tuple[Any, ...] = PinDrive("crank", "O"), PinDrive("second", "D")
    geared = feature == "geared cranks"
    gears = (Gear(drives[0], drives[1], ratio, None),) if geared else ()
    mechanism = Mechanism(links, drives[:1] if geared else drives, drawing, gears=gears)
    columns = [start + turn[:-1], other + ratio * turn[:-1]][: 1 if geared else 2]
    rates = [1.0, ratio][: 1 if geared else 2]
    lowest = _lowest(mechanism, columns, rates, draw.sections)
    if lowest is None:
        return None
    speed = lowest * float(np.exp(random.uniform(*np.log((1 / 100, 1 / 4)))))
    laws = [ConstantSpeed(start, speed), ConstantSpeed(other, ratio * speed)][: 1 if geared else 2]
    run = Run(int(random.choice(POSITIONS)), 2 * math.pi / speed, turn=True)
    return scene_of(mechanism, draw.sections, laws, run, f"{feature}: five-bar, ratio {ratio:g}")


def _arm(random: Any, draw: Draw) -> Scene | None:
    upper, fore = (draw.size * draw.between(0.3, 0.7) for _ in range(2))
    draw.link("upper", {"O": 0.0, "A": upper})
    draw.link("fore", {"A": 0.0, "B": fore})
    links = Link("ground", {"O": 0.0}), *draw.links
    first, second = draw.between(0, 6.28), draw.between(-2.0, 2.0)
    A = upper * cmath.exp(1j * first)
    drawing = {"O": 0.0, "A": A, "B": A + fore * cmath.exp(1j * (first + second))}
    drives = PinDrive("upper", "O"), PinDrive("fore", "A", "upper")
    mechanism = Mechanism(links, drives, drawing)
    lowest = _lowest(mechanism, [np.full(4, first), np.full(4, second)], [0.0, 0.0], draw.sections)
    if lowest is None:
        return None
    part = 2 * math.pi / lowest * float(np.exp(random.uniform(*np.log((1.5, 30)))))
    curve = str(random.choice(CURVES))

    def law(start: float) -> Any:
        by = math.radians(random.uniform(20, 90)) * random.choice([-1, 1])
        stop = Segment("dwell", part / 2)
        return RepeatedLaw(SegmentedLaw(start, (Segment(curve, part, by), stop, Segment(curve, part, -by), stop)))

    laws = [law(first), law(second)]
    run = Run(int(random.choice(POSITIONS)), 3 * part, turn=True)
    return scene_of(mechanism, draw.sections, laws, run, "arm of two drives")


def _lowest(mechanism: Mechanism, columns: Any, rates: Any, sections: Any) -> float | None:
    try:
        moved = motion(mechanism, np.array(columns), np.array(rates)[:, None] * np.ones(len(columns[0])))
        lowest = natural_frequencies(moved, sections, modes=1, positions=24).lowest
    except MechanismError:
        return None
    good = (moved.condition < 1e8).all() and math.isfinite(lowest)
    return float(lowest) if good else None
