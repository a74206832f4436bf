"""Nonlinear check and elastodynamic answers compared with exudyn: four mechanisms at three speeds each.

The mechanisms are a four-bar with point masses, a slider-crank, and Stephenson and Watt six-bars with bent ternary
links. Links start undeformed at full speed. "Transient" is the first turn, "steady" the turn after free vibrations have
died out. exudyn shares no code with this project. It has geometrically exact beams of second order, 24 and 48 to a
link's beam, extrapolated, and the generalised-alpha method with a fixed step. The tables list the largest difference of
the midpoint's deflection from the chord over the turn, relative to its maximum, for the worst beam.

    python benchmarks/exudyn_mechanisms.py
    python benchmarks/exudyn_mechanisms.py record    (writes the reference of tests/test_against_exudyn.py)
"""

import json
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from exudyn_model import STATIONS, integrated
from jobs import rectangle_section
from random_mechanisms import apex
from random_scenes import scene_of

from elastic import Deflection, Section, sample, with_rotary_inertia
from elastic.elastodynamics import elastodynamic, geometrically_exact, large_displacement_error, transient
from elastic.vibration import natural_frequencies
from kinelast.scene.course import Run
from rigid import Beam, ConstantSpeed, Link, Lump, Mechanism, PinDrive, Slider, motion

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))  # its independent integrators
from nonlinear import nonlinear_steady_state, nonlinear_transient

RATIOS = 0.04, 0.08, 0.14  # speed over lowest natural frequency
DAMPING = 0.03  # ratio at that frequency
STEPS, INSTANTS = 2400, 96  # a turn
ELEMENTS = 24, 48  # of exudyn, to a beam
TRANSIENT_LEFT = 1e-5  # of the initial free vibration when the steady turn begins
RECORDED, RECORDED_TURNS = 0.08, 9  # speed ratio and turns of the test data
STEEL, ALUMINIUM = (210e9, 7850.0), (70e9, 2700.0)


@dataclass(frozen=True)
class Case:
    """A mechanism without gravity, with a turning crank and at most one slider, along x; and its sections."""

    name: str
    mechanism: Mechanism
    sections: tuple[Section, ...]


class Parts:
    """Links of one material and their sections."""

    def __init__(self, material: tuple[float, float], depth: float, width: float) -> None:
        self.young, self.density = material
        self.depth, self.width = depth, width
        self.links: list[Link] = []
        self.sections: list[Section] = []

    def add(self, name: str, points: dict[str, complex], masses: dict[str, float] | None = None, thick: float = 1.0):
        """Add a straight bar between two points, or a bar between three points, bent at the last."""
        names = list(points)
        pairs = [(names[0], names[1])] if len(names) == 2 else [(names[0], names[2]), (names[2], names[1])]
        mass = self.density * self.depth * thick * self.width
        beams = tuple(Beam(start, end, mass) for start, end in pairs)
        lumps = tuple(Lump(at, value) for at, value in (masses or {}).items())
        self.links.append(Link(name, points, beams, lumps))
        self.sections += [rectangle_section(self.depth * thick, self.width, self.young)] * len(pairs)


def cases() -> tuple[Case, ...]:
    """Return all four mechanisms, drawn with the crank along x."""
    return four_bar(), slider_crank(), stephenson(), watt()


def four_bar() -> Case:
    parts, A, D = Parts(ALUMINIUM, 0.012, 0.02), 0.15, 0.5
    B = apex(A, D, 0.45, 0.4)
    parts.add("crank", {"O": 0, "A": 0.15}, thick=1.5)
    parts.add("coupler", {"A": 0, "B": 0.45}, {"B": 0.1})
    parts.add("rocker", {"D": 0, "B": 0.4})
    ground = Link("ground", {"O": 0, "D": D})
    drawing = {"O": 0, "A": A, "B": B, "D": D}
    mechanism = Mechanism((ground, *parts.links), (PinDrive("crank", "O"),), drawing)
    return Case("four-bar with a mass", with_rotary_inertia(mechanism, parts.sections), tuple(parts.sections))


def slider_crank() -> Case:
    parts, offset = Parts(STEEL, 0.01, 0.015), 0.03
    B = 0.1 + math.sqrt(0.35**2 - offset**2) + 1j * offset
    parts.add("crank", {"O": 0, "A": 0.1}, thick=1.5)
    parts.add("rod", {"A": 0, "B": 0.35})
    links = Link("ground", {"O": 0}), *parts.links, Link("block", {"B": 0}, lumps=(Lump("B", 0.2),))
    guide = Slider("guide", "block", "ground", "B", origin=1j * offset, direction=1.0)
    drawing = {"O": 0, "A": 0.1, "B": B}
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (guide,))
    return Case("slider-crank", with_rotary_inertia(mechanism, parts.sections), tuple(parts.sections))


def stephenson() -> Case:
    parts, D, own = Parts(STEEL, 0.008, 0.02), 0.4, 0.2 + 0.1j
    A, G = 0.1, 0.55 + 0.4j
    B = apex(A, D, 0.38, 0.3)
    P = A + (B - A) / 0.38 * own
    parts.add("crank", {"O": 0, "A": 0.1}, thick=1.5)
    parts.add("coupler", {"A": 0, "B": 0.38, "P": own})
    parts.add("rocker", {"D": 0, "B": 0.3})
    parts.add("rod", {"P": 0, "Q": 0.35})
    parts.add("swing", {"G": 0, "Q": 0.3})
    drawing = {"O": 0, "A": A, "B": B, "D": D, "P": P, "G": G, "Q": apex(P, G, 0.35, 0.3)}
    ground = Link("ground", {"O": 0, "D": D, "G": G})
    mechanism = Mechanism((ground, *parts.links), (PinDrive("crank", "O"),), drawing)
    return Case("Stephenson six-bar", with_rotary_inertia(mechanism, parts.sections), tuple(parts.sections))


def watt() -> Case:
    parts, D, own = Parts(ALUMINIUM, 0.01, 0.02), 0.35, 0.15 + 0.08j
    A, G = 0.09, 0.75 + 0.1j
    B = apex(A, D, 0.34, 0.26)
    P = D + (B - D) / 0.26 * own
    parts.add("crank", {"O": 0, "A": 0.09}, thick=1.5)
    parts.add("coupler", {"A": 0, "B": 0.34})
    parts.add("rocker", {"D": 0, "B": 0.26, "P": own})
    parts.add("rod", {"P": 0, "Q": 0.35})
    parts.add("swing", {"G": 0, "Q": 0.28})
    drawing = {"O": 0, "A": A, "B": B, "D": D, "P": P, "G": G, "Q": apex(P, G, 0.35, 0.28)}
    ground = Link("ground", {"O": 0, "D": D, "G": G})
    mechanism = Mechanism((ground, *parts.links), (PinDrive("crank", "O"),), drawing)
    return Case("Watt six-bar", with_rotary_inertia(mechanism, parts.sections), tuple(parts.sections))


def of_exudyn(case: Case, speed: float, beta: float, turns: int, elements: int) -> Any:
    """Midpoint deflections from the chord by exudyn, shape (beams, turns, instants)."""
    period = 2 * math.pi / speed
    run = Run(INSTANTS, period, turn=True)
    scene = scene_of(case.mechanism, case.sections, [ConstantSpeed(0.0, speed)], run, case.name)
    beams = len(case.sections)
    sizes = np.full(beams, beta), elements, period, turns, STEPS, INSTANTS
    model = integrated(scene, scene.course.at(np.arange(INSTANTS) * (period / INSTANTS)), *sizes)
    course = [model.course(turn * INSTANTS, (turn + 1) * INSTANTS).fields["chord"] for turn in range(turns)]
    return np.stack(course, axis=1)[..., len(STATIONS) // 2]


def apart(one: Any, other: Any) -> float:
    """Largest difference of two courses, relative to the other's maximum, for the worst beam."""
    return float((np.abs(one - other).max(axis=1) / np.abs(other).max(axis=1)).max())


def middles(bent: Deflection) -> Any:
    """Midpoint deflections from the chord, shape (beams, instants)."""
    return sample(bent, "chord", [0.5])[..., 0]


def speed_of(case: Case, ratio: float) -> tuple[float, float]:
    """Crank speed [rad/s] and damping beta [s]."""
    turn = np.linspace(0, 2 * math.pi, 72, endpoint=False)
    lowest = natural_frequencies(motion(case.mechanism, turn, 1.0), case.sections, modes=1, positions=24).lowest
    return ratio * lowest, 2 * DAMPING / lowest


def row(case: Case, ratio: float) -> dict[str, Any]:
    """Row of one mechanism at one speed; differences in percent."""
    speed, beta = speed_of(case, ratio)
    period, law = 2 * math.pi / speed, ConstantSpeed(0.0, speed)
    times = np.arange(INSTANTS) * (period / INSTANTS)

    def motion_at(t: Any) -> Any:
        return motion(case.mechanism, speed * np.asarray(t), speed, 0.0, t)

    steady = elastodynamic(motion_at(times), motion_at, period, case.sections, damping=beta)
    first = transient(motion_at(times), motion_at, case.sections, damping=beta, undeformed=True)
    turns = 2 + math.ceil(math.log(TRANSIENT_LEFT) / math.log(steady.growth))
    start = time.process_time()
    coarse, fine = (of_exudyn(case, speed, beta, turns, count) for count in ELEMENTS)
    taken = time.process_time() - start
    best = fine + (fine - coarse) / 3
    given = case.mechanism, case.sections, [law]
    periodic = nonlinear_steady_state(*given, period, INSTANTS, 8, damping=beta)
    marched = nonlinear_transient(*given, times, period / STEPS, 16, None, beta)
    settled = apart(best[:, -2], best[:, -1])
    percent = {
        "steady: exudyn's meshes": apart(coarse[:, -1], fine[:, -1]),
        "steady: nonlinear": apart(periodic.chord[:, :, 4], best[:, -1]),
        "steady: elastodynamic": apart(middles(steady.deflection), best[:, -1]),
        "steady: geometrically exact": apart(middles(geometrically_exact(steady).deflection), best[:, -1]),
        "steady: estimated": large_displacement_error(steady),
        "steady: quasi-static": apart(middles(steady.quasi_static), best[:, -1]),
        "transient: nonlinear": apart(marched.chord[:, :, 8], best[:, 0]),
        "transient: elastodynamic": apart(middles(first.deflection), best[:, 0]),
        "transient: geometrically exact": apart(middles(geometrically_exact(first).deflection), best[:, 0]),
        "transient: estimated": large_displacement_error(first),
        "last two turns": settled,
    }
    head = {"mechanism": case.name, "rad/s": speed, "speed / lowest": ratio}
    return {**head, **{name: 100 * value for name, value in percent.items()}, "exudyn's turns": turns, "s": taken}


def record() -> None:
    """Write two mechanisms and their steady state by exudyn into tests/data."""
    entries = []
    for case in (slider_crank(), watt()):
        speed, beta = (float(f"{value:.5g}") for value in speed_of(case, RECORDED))
        coarse, fine = (of_exudyn(case, speed, beta, RECORDED_TURNS, count)[:, -1] for count in ELEMENTS)
        entries.append({**_as_data(case), "speed": speed, "beta": beta, "chord": (fine + (fine - coarse) / 3).tolist()})
    import exudyn

    source = (
        f"exudyn {exudyn.__version__}, by benchmarks/exudyn_mechanisms.py: {ELEMENTS} elements a beam, extrapolated"
    )
    target = measuring.RESULTS.parent.parent / "tests" / "data" / "exudyn_mechanisms.json"
    target.write_text(json.dumps({"source": source, "mechanisms": entries}) + "\n", encoding="utf-8")


def _as_data(case: Case) -> dict[str, Any]:
    """A mechanism as JSON data."""
    links = [
        {
            "name": link.name,
            "points": {name: [complex(z).real, complex(z).imag] for name, z in link.points.items()},
            "beams": [[beam.start, beam.end, beam.mass_per_length] for beam in link.beams],
            "masses": [[lump.point, lump.mass] for lump in link.lumps],
        }
        for link in case.mechanism.links
    ]
    return {
        "name": case.name,
        "links": links,
        "drawing": {name: [complex(z).real, complex(z).imag] for name, z in case.mechanism.drawing.items()},
        "sliders": [[one.link, one.point, complex(one.origin).imag] for one in case.mechanism.sliders],
        "sections": [[own.EA, own.EI, own.kGA, own.area, own.inertia] for own in case.sections],
    }


def main() -> None:
    if sys.argv[1:] == ["record"]:
        record()
        return
    rows: list[dict[str, Any]] = []
    for case in cases():
        for ratio in RATIOS:
            rows.append(row(case, ratio))
            print(measuring.as_text(rows[-1:]), flush=True)
            measuring.write_rows(measuring.RESULTS / "exudyn_mechanisms.csv", rows)


if __name__ == "__main__":
    main()
