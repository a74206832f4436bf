"""A pin in the slot of a bent rocker, compared with exudyn's sliding joint on ANCF cable elements.

A rigid crank drives a block along an elastic Euler-Bernoulli rocker with a mass at its end. Links are damped and the
speed is constant. exudyn integrates until the transient has died out. The script prints the largest difference of the
rocker tip's displacement over a turn, relative to its maximum, for the linear and the geometrically exact answer.
The step size matters more than the mesh: at 1,200 steps a turn exudyn is 0.2 % off, and finer meshes need more steps.

    python benchmarks/exudyn_slot.py
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np

from elastic import Section, displacement_of
from elastic.elastodynamics import elastodynamic, geometrically_exact
from rigid import Beam, Link, Lump, Mechanism, Motion, PinDrive, Slider, motion

CRANK, APART, LENGTH, LINE_MASS, EA, EI, BETA, END_MASS = 0.05, 0.3, 0.5, 0.3, 8e6, 11.0, 1e-3, 0.02
SPEEDS = 20.0, 35.0
ELEMENTS, STEPS, TURNS, SEEN = 12, 9600, 4, 96


def slotted() -> Mechanism:
    """Return the mechanism."""
    crank = Link("crank", {"O": 0, "A": CRANK})
    rocker = Link("rocker", {"C": 0, "D": LENGTH}, (Beam("C", "D", LINE_MASS),), (Lump("D", END_MASS),))
    drawing = {"C": 0, "D": LENGTH * 1j, "O": APART * 1j, "A": (APART + CRANK) * 1j}
    slot = Slider("slot", "block", "rocker", "A", origin=0, direction=1.0)
    ground = Link("ground", {"C": 0, "O": APART * 1j})
    return Mechanism((ground, crank, Link("block", {"A": 0}), rocker), (PinDrive("crank", "O"),), drawing, (slot,))


def marched(begun: Motion, speed: float, elements: int) -> Any:
    """Positions of the rocker tip over the last turn by exudyn, complex, and their times from its start [s]."""
    import exudyn as exu
    import exudyn.itemInterface

    items = exudyn.itemInterface

    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    still = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    rocker, e = 3, complex(begun.direction[3, 0])
    omega = float(begun.angular_velocity[rocker, 0])
    nodes, markers, h = [], [], LENGTH / elements
    for x in np.linspace(0, LENGTH, elements + 1):
        place, moving, turning = x * e, 1j * omega * x * e, 1j * omega * e
        nodes.append(
            mbs.AddNode(
                items.NodePoint2DSlope1(
                    referenceCoordinates=[place.real, place.imag, e.real, e.imag],
                    initialVelocities=[moving.real, moving.imag, turning.real, turning.imag],
                )
            )
        )
    for pair in pairwise(nodes):
        cable = items.ObjectANCFCable2D(
            nodeNumbers=list(pair), length=h, massPerLength=LINE_MASS, bendingStiffness=EI, axialStiffness=EA,
            bendingDamping=BETA * EI, axialDamping=BETA * EA,
        )  # fmt: skip
        markers.append(mbs.AddMarker(items.MarkerBodyCable2DCoordinates(bodyNumber=mbs.AddObject(cable))))
    for k in (0, 1):
        here = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=k))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[still, here]))
    tip = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[-1]))
    mass = mbs.AddNode(
        items.NodePoint2D(
            referenceCoordinates=[(LENGTH * e).real, (LENGTH * e).imag],
            initialVelocities=[(1j * omega * LENGTH * e).real, (1j * omega * LENGTH * e).imag],
        )
    )
    body = mbs.AddObject(items.ObjectMassPoint2D(mass=END_MASS, nodeNumber=mass))
    held = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body))
    mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[tip, held]))
    turning = mbs.AddNode(
        items.NodeRigidBody2D(referenceCoordinates=[0, APART, math.pi / 2], initialVelocities=[0, 0, speed])
    )
    crank = mbs.AddObject(items.ObjectRigidBody2D(mass=1.0, inertia=1.0, nodeNumber=turning))
    shaft = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=crank))
    bearing = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[0, APART, 0]))
    mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[bearing, shaft]))
    angle = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=turning, coordinate=2))
    mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[still, angle], offset=speed, velocityLevel=True))
    pin = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=crank, localPosition=[CRANK, 0, 0]))
    first = int((APART + CRANK) / h)
    data = mbs.AddNode(items.NodeGenericData(initialCoordinates=[first, APART + CRANK], numberOfDataCoordinates=2))
    mbs.AddObject(
        items.ObjectJointSliding2D(
            markerNumbers=[pin, markers[first]], slidingMarkerNumbers=markers,
            slidingMarkerOffsets=list(np.arange(elements) * h), nodeNumber=data,
        )
    )  # fmt: skip
    turn = 2 * math.pi / speed
    kept = mbs.AddSensor(
        items.SensorNode(
            nodeNumber=nodes[-1],
            storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
            writeToFile=False,
        )
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = STEPS * TURNS, TURNS * turn
    integration.generalizedAlpha.spectralRadius = 0.8
    integration.newton.useModifiedNewton = True
    settings.solutionSettings.sensorsWritePeriod = turn / SEEN
    settings.solutionSettings.writeSolutionToFile = False
    integration.verboseMode = 0
    mbs.SolveDynamic(settings)
    rows = np.asarray(mbs.GetSensorStoredData(kept))
    last = rows[-SEEN - 1 : -1]
    return last[:, 1] + 1j * last[:, 2], last[:, 0] - (TURNS - 1) * turn


def main() -> None:
    """Print the differences."""
    mechanism, sections = slotted(), [Section(EA=EA, EI=EI)]
    for speed in SPEEDS:
        turn = 2 * math.pi / speed

        def motion_at(t: Any, speed: float = speed) -> Motion:
            return motion(mechanism, math.pi / 2 + speed * np.asarray(t), speed, 0.0, t)

        begun = motion_at(np.zeros(1))
        expected, time = marched(begun, speed, ELEMENTS)
        at = motion_at(time)
        linear = elastodynamic(at, motion_at, turn, sections, damping=BETA)
        exact = geometrically_exact(linear, 1e-6)
        rigid = at.origin[3] + at.direction[3] * LENGTH
        expected = expected - rigid
        greatest = np.abs(expected).max()
        errors = [
            100 * np.abs(displacement_of(bent, "rocker", "D") - expected).max() / greatest
            for bent in (linear.deflection, exact.deflection)
        ]
        print(
            f"{speed:g} rad/s, {speed / linear.lowest:.2f} of the lowest frequency, {1e3 * greatest:.3g} mm: "
            f"error of linear {errors[0]:.3g} %, of exact {errors[1]:.3g} % after {exact.exact.steps} steps"
        )


if __name__ == "__main__":
    main()
