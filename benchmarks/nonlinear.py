"""The nonlinear check beside exudyn's geometrically exact beams: the same mechanisms, marched from the same start.

A soft arm that is swung by a right angle from rest, and the steel four-bar over its first turn from the places and
velocities of rigid links. Both codes take steps of the same length; their beams have shear, inertia of the section and
damping. exudyn's elements are of the second order, so that it gets more of them. Figures are the deflection of the last
beam's far end (arm) or of the coupler's middle from the rigid place, and its greatest difference over the instants.
Then the periodic motion of the four-bar at three speeds, which exudyn does not ask for at once. Times are those of the
processor.

    python benchmarks/nonlinear.py
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import measuring  # noqa: F401  before numpy: one core
import numpy as np
from exudyn_beams import add_beam

from elastic import Section, with_rotary_inertia
from fem_check.nonlinear import nonlinear_steady_state, nonlinear_transient
from rigid import Beam, ConstantSpeed, Link, Mechanism, PinDrive, Segment, SegmentedLaw, motion

E, NU, RHO = 210e9, 0.3, 7850.0


@dataclass(frozen=True)
class Case:
    """A mechanism whose beams are pinned at their ends; `beams` by their end points, the first driven at its start."""

    name: str
    mechanism: Mechanism
    section: Section
    law: Any
    duration: float
    step: float
    beta: float
    watched: tuple[int, float]


def section_of(depth: float, width: float, young: float) -> Section:
    area, inertia = depth * width, width * depth**3 / 12
    return Section(young * area, young * inertia, 5 / 6 * young / (2 + 2 * NU) * area, area=area, inertia=inertia)


def cases() -> tuple[Case, Case]:
    arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.2),))
    swung = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1.0})
    law = SegmentedLaw(0.0, (Segment("polynomial-4567", 0.5, math.pi / 2),))
    m = RHO * 6e-5
    links = (
        Link("ground", {"O": 0, "D": 0.35}),
        Link("crank", {"O": 0, "A": 0.1}, (Beam("O", "A", m),)),
        Link("coupler", {"A": 0, "B": 0.3}, (Beam("A", "B", m),)),
        Link("rocker", {"D": 0, "B": 0.25}, (Beam("D", "B", m),)),
    )
    drawing = {"O": 0, "A": 0.1, "B": 0.28 + 0.24j, "D": 0.35}
    four_bar = Mechanism(links, (PinDrive("crank", "O"),), drawing)
    speed = 60.0
    soft, steel = section_of(0.02, 0.02, 2e8), section_of(0.006, 0.01, E)
    swung, four_bar = with_rotary_inertia(swung, [soft]), with_rotary_inertia(four_bar, [steel] * 3)
    return (
        Case("arm", swung, soft, law, 0.5, 5e-4, 1e-3, (0, 1.0)),
        Case(
            "four-bar", four_bar, steel, ConstantSpeed(0.0, speed), 2 * math.pi / speed,
            2 * math.pi / speed / 2880, 40e-6, (1, 0.5),
        ),
    )  # fmt: skip


def own(case: Case, elements: int, instants: int) -> tuple[Any, float]:
    """w at the watched place, and seconds."""
    start = time.process_time()
    times = np.linspace(0.0, case.duration, instants + 1)
    sections = [case.section] * len(case.mechanism.beams)
    found = nonlinear_transient(case.mechanism, sections, [case.law], times, case.step, elements, None, case.beta)
    beam, xi = case.watched
    return found.w[beam, :, round(xi * elements)], time.process_time() - start


def of_exudyn(case: Case, elements: int, instants: int) -> tuple[Any, float]:
    """The same by exudyn: rigid-body nodes along every beam, pins at shared points, the first angle prescribed."""
    import exudyn as exu

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    sensor = assemble(case, mbs, elements)
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(case.duration / case.step)
    settings.timeIntegration.endTime = case.duration
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    settings.timeIntegration.newton.relativeTolerance = 1e-7
    settings.timeIntegration.newton.absoluteTolerance = 1e-9
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = case.duration / instants
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.timeIntegration.verboseMode = 0
    start = time.process_time()
    mbs.SolveDynamic(settings)
    taken = time.process_time() - start
    table = mbs.GetSensorStoredData(sensor)
    place = table[:, 1] + 1j * table[:, 2]
    course = motion(case.mechanism, case.law(np.linspace(0.0, case.duration, instants + 1))[0])
    number, beam = case.mechanism.beams[case.watched[0]]
    first, last = (complex(case.mechanism.links[number].points[name]) for name in (beam.start, beam.end))
    rigid = course.origin[number] + course.direction[number] * (first + case.watched[1] * (last - first))
    axis = course.direction[number] * (last - first) / abs(last - first)
    return (np.conj(axis) * (place - rigid)).imag, taken


def assemble(case: Case, mbs: Any, elements: int) -> Any:
    """Nodes, beams, pins and drive of a case in exudyn; the number of the sensor of the watched place."""
    import exudyn as exu
    import exudyn.itemInterface

    items = exu.itemInterface

    ground = mbs.AddObject(items.ObjectGround())
    fixed = case.mechanism.links[0].points
    pins = {
        point: mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[z.real, z.imag, 0]))
        for point, z in ((point, complex(place)) for point, place in fixed.items())
    }
    begun = motion(case.mechanism, [0.0], [float(case.law(0.0)[1])])
    rows = [add_beam(mbs, begun, k, case.section, case.beta, elements) for k in range(len(case.mechanism.beams))]
    for (_, beam), nodes in zip(case.mechanism.beams, rows, strict=True):
        for point, node in ((beam.start, nodes[0]), (beam.end, nodes[-1])):
            marker = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=node))
            if point in pins:
                mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[pins[point], marker]))
            pins.setdefault(point, marker)
    angle = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=rows[0][0], coordinate=2))
    still = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    drive = items.ObjectConnectorCoordinate(
        markerNumbers=[still, angle], offsetUserFunction=lambda mbs, t, item, offset: float(case.law(t)[0])
    )
    mbs.AddObject(drive)
    watched = rows[case.watched[0]][round(case.watched[1] * elements)]
    kind = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(items.SensorNode(nodeNumber=watched, storeInternal=True, outputVariableType=kind))
    mbs.Assemble()
    return sensor


def main() -> None:
    """Print all figures."""
    instants = 20
    for case in cases():
        mine, taken = own(case, 8, instants)
        finer, _ = own(case, 16, instants)
        size = np.abs(finer).max()
        print(f"{case.name}: greatest |w| {size:.6g} m")
        change = np.abs(mine - finer).max() / size
        print(f"  nonlinear check, 8 elements: {taken:6.2f} s, to 16 elements {change:.1e}")
        try:
            coarse, _ = of_exudyn(case, 16, instants)
            fine, taken = of_exudyn(case, 32, instants)
        except ImportError:
            print("  exudyn is not installed")
            continue
        change, best = np.abs(fine - coarse).max() / size, fine + (fine - coarse) / 3
        print(f"  exudyn, 32 elements:         {taken:6.2f} s, from 16 elements {change:.1e}")
        print(f"  difference, exudyn extrapolated: {np.abs(finer - best).max() / size:.1e}")
    case = cases()[1]
    for speed in (30.0, 60.0, 100.0):
        for positions in (128, 256):
            start, law = time.process_time(), ConstantSpeed(0.0, speed)
            sections, period = [case.section] * 3, 2 * math.pi / speed
            found = nonlinear_steady_state(case.mechanism, sections, [law], period, positions, damping=case.beta)
            taken, peak = time.process_time() - start, np.abs(found.chord).max() * 1e3
            print(f"periodic, {speed:.0f} rad/s, {positions} positions: {taken:.2f} s, chord deflection {peak:.5f} mm")


if __name__ == "__main__":
    main()
