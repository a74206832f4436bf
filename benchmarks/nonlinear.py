"""The nonlinear check beside exudyn's geometrically exact beams: the same mechanisms, marched from the same start.

A soft arm that is swung by a right angle from rest, and the steel four-bar over its first turn from the places and
velocities of rigid links. Both codes take steps of the same length; their beams have shear, inertia of the section and
damping. exudyn's elements are of the second order, so that it gets more of them. Figures are the deflection of the last
beam's far end (arm) or of the coupler's middle from the rigid place, and its greatest difference over the instants.
Then the periodic motion of the four-bar at three speeds, which exudyn does not ask for at once.

    python benchmarks/nonlinear.py
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import measuring  # noqa: F401  before numpy: one core
import numpy as np

from elastic import Section
from fem_check import nonlinear_steady_state, nonlinear_transient
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
    return (
        Case("arm", swung, section_of(0.02, 0.02, 2e8), law, 0.5, 5e-4, 1e-3, (0, 1.0)),
        Case(
            "four-bar", four_bar, section_of(0.006, 0.01, E), ConstantSpeed(0.0, speed), 2 * math.pi / speed,
            2 * math.pi / speed / 2880, 40e-6, (1, 0.5),
        ),
    )  # fmt: skip


def own(case: Case, elements: int, instants: int) -> tuple[Any, float]:
    """w at the watched place, and seconds."""
    start = time.perf_counter()
    times = np.linspace(0.0, case.duration, instants + 1)
    sections = [case.section] * len(case.mechanism.beams)
    found = nonlinear_transient(case.mechanism, sections, [case.law], times, case.step, elements, None, case.beta)
    beam, xi = case.watched
    return found.w[beam, :, round(xi * elements)], time.perf_counter() - start


def of_exudyn(case: Case, elements: int, instants: int) -> tuple[Any, float]:
    """The same by exudyn: rigid-body nodes along every beam, pins at shared points, the first angle prescribed."""
    import exudyn as exu
    from exudyn import itemInterface as ii

    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddObject(ii.ObjectGround())
    begun = motion(case.mechanism, [0.0], [float(case.law(0.0)[1])])
    pins: dict[str, Any] = {}
    rows = []
    for number, beam in case.mechanism.beams:
        link = case.mechanism.links[number]
        start, end = complex(link.points[beam.start]), complex(link.points[beam.end])
        z, e, speed = (complex(np.ravel(value[number])[0]) for value in (begun.origin, begun.direction, begun.velocity))
        omega = float(np.ravel(begun.angular_velocity[number])[0])
        way, nodes = end - start, []
        for xi in np.linspace(0, 1, elements + 1):
            arm = e * (start + xi * way)
            moving = speed + 1j * omega * arm
            place = z + arm
            nodes.append(mbs.AddNode(ii.NodeRigidBody2D(
                referenceCoordinates=[place.real, place.imag, float(np.angle(e * way))],
                initialVelocities=[moving.real, moving.imag, omega],
            )))  # fmt: skip
        own = case.section
        m, h, rotary = float(beam.mass_per_length), abs(way) / elements, float(own.inertia) / float(own.area)
        for one, other in zip(nodes, nodes[1:], strict=False):
            mbs.AddObject(ii.ObjectBeamGeometricallyExact2D(
                nodeNumbers=[one, other], length=h, massPerLength=m, crossSectionInertia=m * rotary,
                bendingStiffness=own.EI, axialStiffness=own.EA, shearStiffness=own.kGA,
                bendingDamping=case.beta * own.EI, axialDamping=case.beta * own.EA, shearDamping=case.beta * own.kGA,
                includeReferenceRotations=False,
            ))  # fmt: skip
        for point, node in ((beam.start, nodes[0]), (beam.end, nodes[-1])):
            marker = mbs.AddMarker(ii.MarkerNodePosition(nodeNumber=node))
            if point in case.mechanism.links[0].points:
                fixed = complex(case.mechanism.links[0].points[point])
                pins[point] = mbs.AddMarker(ii.MarkerBodyPosition(
                    bodyNumber=ground, localPosition=[fixed.real, fixed.imag, 0]))  # fmt: skip
            if point in pins:
                mbs.AddObject(ii.ObjectJointRevolute2D(markerNumbers=[pins[point], marker]))
            pins.setdefault(point, marker)
        rows.append(nodes)
    angle = mbs.AddMarker(ii.MarkerNodeCoordinate(nodeNumber=rows[0][0], coordinate=2))
    still = mbs.AddNode(ii.NodePointGround())
    base = mbs.AddMarker(ii.MarkerNodeCoordinate(nodeNumber=still, coordinate=0))
    mbs.AddObject(ii.ObjectConnectorCoordinate(
        markerNumbers=[base, angle],
        offsetUserFunction=lambda mbs, t, item, offset: float(case.law(t)[0]),
    ))  # fmt: skip
    beam, xi = case.watched
    sensor = mbs.AddSensor(ii.SensorNode(
        nodeNumber=rows[beam][round(xi * elements)], storeInternal=True, outputVariableType=exu.OutputVariableType.Position
    ))  # fmt: skip
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(case.duration / case.step)
    settings.timeIntegration.endTime = case.duration
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    settings.timeIntegration.newton.relativeTolerance = 1e-7
    settings.timeIntegration.newton.absoluteTolerance = 1e-9
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = case.duration / instants
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.timeIntegration.verboseMode = 0
    start = time.perf_counter()
    mbs.SolveDynamic(settings)
    taken = time.perf_counter() - start
    table = mbs.GetSensorStoredData(sensor)
    place = table[:, 1] + 1j * table[:, 2]
    course = motion(case.mechanism, case.law(np.linspace(0.0, case.duration, instants + 1))[0])
    number, own_beam = case.mechanism.beams[beam]
    link = case.mechanism.links[number]
    start_, end_ = (complex(link.points[name]) for name in (own_beam.start, own_beam.end))
    rigid = course.origin[number] + course.direction[number] * (start_ + xi * (end_ - start_))
    axis = course.direction[number] * (end_ - start_) / abs(end_ - start_)
    return (np.conj(axis) * (place - rigid)).imag, taken


def main() -> None:
    """Print all figures."""
    instants = 20
    for case in cases():
        mine, taken = own(case, 8, instants)
        finer, _ = own(case, 16, instants)
        size = np.abs(finer).max()
        print(f"{case.name}: greatest |w| {size:.6g} m")
        print(
            f"  nonlinear check, 8 elements:  {taken:6.2f} s, 16 elements differ by {np.abs(mine - finer).max() / size:.1e}"
        )
        try:
            coarse, _ = of_exudyn(case, 16, instants)
            fine, seconds = of_exudyn(case, 32, instants)
        except ImportError:
            print("  exudyn is not installed")
            continue
        best = fine + (fine - coarse) / 3
        print(
            f"  exudyn, 32 elements:          {seconds:6.2f} s, 16 and 32 differ by {np.abs(fine - coarse).max() / size:.1e}"
        )
        print(f"  difference, exudyn extrapolated from 16 and 32: {np.abs(finer - best).max() / size:.1e}")
    case = cases()[1]
    for speed in (30.0, 60.0, 100.0):
        for positions in (128, 256):
            start = time.perf_counter()
            found = nonlinear_steady_state(case.mechanism, [case.section] * 3, [ConstantSpeed(0.0, speed)],
                                           2 * math.pi / speed, positions, 8, damping=case.beta)  # fmt: skip
            taken = time.perf_counter() - start
            peak = np.abs(found.chord).max()
            print(
                f"periodic, {speed:.0f} rad/s, {positions} positions, 8 elements: {taken:.2f} s, chord {peak * 1e3:.5f} mm"
            )


if __name__ == "__main__":
    main()
