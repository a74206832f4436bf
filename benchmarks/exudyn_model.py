"""A scene in exudyn: geometrically exact beams, point masses, pins, guides, drives and springs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from elastic import Section
from kinelast.scene.data import Scene
from rigid import Motion, PinDrive, Spring, TorsionSpring

STATIONS = np.linspace(0.0, 1.0, 5)  # along a beam
FIELDS = "u", "w", "chord", "N", "M"
WRITE_EARLY = 1e-9  # of the interval between outputs; without it, round-off in summed times delays an output by a step
FORCE_TOLERANCES = 3e-13, 1e-11, 3e-10  # of Newton's method, relative to EA; the next if one is not reached


@dataclass(frozen=True, eq=False)
class Course:
    """Fields by name, shape (beams, instants, stations), and joint forces, shape (joints, instants)."""

    fields: dict[str, Any]
    joints: Any

    def __add__(self, other: Course) -> Course:
        fields = {name: values + other.fields[name] for name, values in self.fields.items()}
        return Course(fields, self.joints + other.joints)

    def times(self, factor: float) -> Course:
        """Multiply all values by a factor."""
        return Course({name: factor * values for name, values in self.fields.items()}, factor * self.joints)


def add_beam(mbs: Any, begun: Motion, number: int, own: Section, beta: float, elements: int) -> list[Any]:
    """Add the nodes and elements of a beam; return the nodes. They start with the motion of the rigid link."""
    import exudyn.itemInterface

    items = exudyn.itemInterface
    at, beam = begun.mechanism.beams[number]
    start, end = (complex(begun.mechanism.links[at].points[name]) for name in (beam.start, beam.end))
    z, e, speed = (complex(value[at, 0]) for value in (begun.origin, begun.direction, begun.velocity))
    omega, nodes = float(begun.angular_velocity[at, 0]), []
    for xi in np.linspace(0, 1, elements + 1):
        arm = e * (start + xi * (end - start))
        place, moving, angle = z + arm, speed + 1j * omega * arm, float(np.angle(e * (end - start)))
        node = items.NodeRigidBody2D(
            referenceCoordinates=[place.real, place.imag, angle], initialVelocities=[moving.real, moving.imag, omega]
        )
        nodes.append(mbs.AddNode(node))
    mass = float(beam.mass_per_length)
    for pair in pairwise(nodes):
        element = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=list(pair),
            length=abs(end - start) / elements,
            massPerLength=mass,
            crossSectionInertia=mass * float(own.inertia) / float(own.area),
            bendingStiffness=own.EI,
            axialStiffness=own.EA,
            shearStiffness=own.kGA,
            bendingDamping=beta * own.EI,
            axialDamping=beta * own.EA,
            shearDamping=beta * own.kGA,
            includeReferenceRotations=False,
        )
        mbs.AddObject(element)
    return nodes


class ExudynModel:
    """A scene in exudyn over several spans of its run, each with an output at every instant of `motion`.

    `beta` has the damping of each beam [s]; `steps` is the number of steps for each turn of the fastest drive. Guides
    lie on the ground along x.
    """

    def __init__(
        self, scene: Scene, motion: Motion, beta: Any, elements: int, span: float, turns: int, steps: int, outputs: int
    ) -> None:
        import exudyn as exu
        import exudyn.itemInterface

        self.exu, self.items = exu, exudyn.itemInterface
        self.scene, self.motion, self.beta, self.elements = scene, motion, beta, elements
        self.span, self.turns, self.outputs, self.in_static_solution = span, turns, outputs, False
        stroke = max(np.ptp(np.asarray(law(np.array([0.0, span]))[0], float)) for law in self.scene.course.laws)
        self.steps = steps * max(1, round(stroke / (2 * math.pi)))
        self.mechanism, self.laws = self.scene.mechanism, self.scene.course.laws
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.ground = self.mbs.AddObject(self.items.ObjectGround())
        self.still = self.mbs.AddMarker(
            self.items.MarkerNodeCoordinate(nodeNumber=self.mbs.AddNode(self.items.NodePointGround()), coordinate=0)
        )
        self.begun = scene.course.at(np.atleast_1d(motion.time)[:1])
        self.at: dict[tuple[int, str], int] = {}
        self.mass: dict[int, float] = {}
        self.joint: dict[tuple[str, int, int], Any] = {}
        self.rows = [self.beam(number) for number in range(len(self.mechanism.beams))]
        self.lumps()
        self.pins()
        self.sliders()
        for drive, law in zip(self.mechanism.drives, self.laws, strict=True):
            self.drive(drive, law)
        for load in self.mechanism.loads:
            self.spring(load)
        self.weight()
        kinds = exu.OutputVariableType
        self.sensors = [
            [[self.sensor(node, kind) for node in row] for row in self.rows]
            for kind in (kinds.Coordinates, kinds.Coordinates_t)
        ]
        self.multipliers = self.mbs.AddSensor(
            self.items.SensorUserFunction(sensorUserFunction=_multipliers, storeInternal=True, writeToFile=False)
        )
        self.mbs.Assemble()

    def beam(self, number: int) -> list[int]:
        """Add a beam; return its nodes. Beams of one link meet in rigid corners."""
        at, beam = self.mechanism.beams[number]
        section = self.scene.sections[number]
        nodes = add_beam(self.mbs, self.begun, number, section, float(self.beta[number]), self.elements)
        points = self.mechanism.links[at].points
        whole = float(beam.mass_per_length) * abs(complex(points[beam.end]) - complex(points[beam.start]))
        for place, node in enumerate(nodes):
            share = 0.5 if place in (0, self.elements) else 1.0
            self.mass[node] = share * whole / self.elements
        for name, node in ((beam.start, nodes[0]), (beam.end, nodes[-1])):
            if (at, name) in self.at:
                self.revolute(self.place(self.at[at, name]), node)
                turned = self.coordinate(self.at[at, name], 2)
                pair = [turned, self.coordinate(node, 2)]
                self.mbs.AddObject(self.items.ObjectConnectorCoordinate(markerNumbers=pair))
            self.at.setdefault((at, name), node)
        return nodes

    def lumps(self) -> None:
        """Add point masses; a link without beams becomes a point mass."""
        for at, link in enumerate(self.mechanism.links):
            if at and not link.beams:
                name = next(iter(link.points))
                z, v = complex(self.begun.origin[at, 0]), complex(self.begun.velocity[at, 0])
                node = self.mbs.AddNode(
                    self.items.NodePoint2D(referenceCoordinates=[z.real, z.imag], initialVelocities=[v.real, v.imag])
                )
                self.at[at, name], self.mass[node] = node, sum(float(lump.mass) for lump in link.lumps)
                self.mbs.AddObject(self.items.ObjectMassPoint2D(nodeNumber=node, mass=self.mass[node]))
                continue
            for lump in link.lumps:
                node = self.at[at, lump.point]
                self.mass[node] += float(lump.mass)
                self.mbs.AddObject(self.items.ObjectRigidBody2D(nodeNumber=node, mass=float(lump.mass), inertia=0.0))

    def place(self, node: int) -> int:
        """Add a marker of a node's position."""
        return int(self.mbs.AddMarker(self.items.MarkerNodePosition(nodeNumber=node)))

    def coordinate(self, node: int, number: int) -> int:
        """Add a marker for one coordinate of a node."""
        return int(self.mbs.AddMarker(self.items.MarkerNodeCoordinate(nodeNumber=node, coordinate=number)))

    def marker(self, link: int, point: str) -> int:
        """Add a marker of a link's point."""
        if link:
            return self.place(self.at[link, point])
        z = complex(self.mechanism.links[0].points[point])
        return int(
            self.mbs.AddMarker(
                self.items.MarkerBodyPosition(bodyNumber=self.ground, localPosition=[z.real, z.imag, 0.0])
            )
        )

    def revolute(self, marker: int, node: int) -> Any:
        """Add a pin joint."""
        return self.mbs.AddObject(self.items.ObjectJointRevolute2D(markerNumbers=[marker, self.place(node)]))

    def pins(self) -> None:
        """Add all pin joints of the mechanism."""
        for joint in self.motion.structure.joints:
            if joint.turns:
                one, other = self.marker(joint.parent, joint.name), self.marker(joint.child, joint.name)
                made = self.mbs.AddObject(self.items.ObjectJointRevolute2D(markerNumbers=[one, other]))
                self.joint[joint.name, joint.parent, joint.child] = made, 1.0

    def sliders(self) -> None:
        """Add sliders on the ground along x: no displacement along y."""
        index = self.mechanism.index
        for slider in self.mechanism.sliders:
            up = self.coordinate(self.at[index[slider.link], slider.point], 1)
            made = self.mbs.AddObject(self.items.ObjectConnectorCoordinate(markerNumbers=[self.still, up]))
            self.joint[slider.name, index[slider.on], index[slider.link]] = made, 1j

    def drive(self, drive: Any, law: Any) -> None:
        """Prescribe the angle between two links by a law."""
        assert isinstance(drive, PinDrive)
        start = float(self.motion.time[0])
        first = float(np.asarray(law(np.array([start]))[0]).item())

        step = self.span / self.steps
        known = np.asarray(law(start + step * np.arange(self.turns * self.steps + 1))[0], float) - first

        def moved(mbs: Any, t: float, item: int, offset: float) -> float:
            if self.in_static_solution:
                return 0.0
            number = round(t / step)
            if abs(t / step - number) < 1e-6:
                return float(known[number])
            return float(np.asarray(law(np.array([start + t]))[0]).item()) - first

        index = self.mechanism.index
        on = self.still if index[drive.on] == 0 else self.coordinate(self.end_of(drive.on, drive.at), 2)
        child = self.coordinate(self.end_of(drive.link, drive.at), 2)
        self.mbs.AddObject(self.items.ObjectConnectorCoordinate(markerNumbers=[on, child], offsetUserFunction=moved))

    def end_of(self, link: str, point: str) -> int:
        """Return the node of a link's point."""
        return self.at[self.mechanism.index[link], point]

    def spring(self, load: Any) -> None:
        """Add a spring between two points, or a torsion spring at the ground."""
        index = self.mechanism.index
        if isinstance(load, Spring):
            ends = self.marker(index[load.on], load.anchor), self.marker(index[load.link], load.point)
            self.mbs.AddObject(
                self.items.ObjectConnectorSpringDamper(
                    markerNumbers=list(ends),
                    stiffness=float(load.stiffness),
                    damping=float(load.damping),
                    referenceLength=float(load.length),
                    force=float(load.preload),
                )
            )
            return
        assert isinstance(load, TorsionSpring)
        assert index[load.on] == 0
        turned = float(load.winding(self.begun)[0])
        self.mbs.AddObject(
            self.items.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[self.still, self.coordinate(self.end_of(load.link, load.at), 2)],
                stiffness=float(load.stiffness),
                damping=float(load.damping),
                offset=-turned,
            )
        )

    def weight(self) -> None:
        """Add gravity at all nodes."""
        g = complex(self.mechanism.gravity)
        for node, mass in self.mass.items() if g else ():
            pull = [mass * g.real, mass * g.imag, 0.0]
            self.mbs.AddLoad(self.items.Force(markerNumber=self.place(node), loadVector=pull))

    def sensor(self, node: int, kind: Any) -> Any:
        """Add a sensor of a node's coordinates."""
        return self.mbs.AddSensor(
            self.items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
        )

    def integrate(self, from_rest: bool, tolerance: float) -> None:
        """Integrate over all spans, with `outputs` outputs in each."""
        settings = self.exu.SimulationSettings()
        settings.solution.file.write = False
        settings.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        if from_rest and (self.mechanism.loads or self.mechanism.gravity):
            settings.staticSolver.verboseMode = 0
            newton = settings.staticSolver.newton
            newton.relativeTolerance, newton.absoluteTolerance = 1e-8, tolerance
            self.in_static_solution = True  # exudyn counts load steps as time
            self.mbs.SolveStatic(settings, updateInitialValues=True)
            self.in_static_solution = False
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = self.turns * self.steps, self.turns * self.span
        integration.verboseMode = 0
        integration.generalizedAlpha.spectralRadius = 0.8
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-7, tolerance
        settings.solution.sensors.writePeriod = self.span / self.outputs * (1 - WRITE_EARLY)
        self.mbs.SolveDynamic(settings)

    def course(self, first: int, last: int) -> Course:
        """Fields and joint forces at the outputs of `integrate` from `first` to `last`."""
        motion, fields, pick = self.motion, {name: [] for name in FIELDS}, slice(first, last)
        nodes_at = np.rint(STATIONS * self.elements).astype(int)
        for number, (at, beam) in enumerate(self.mechanism.beams):
            moved, rate = (
                np.array([self.mbs.GetSensorStoredData(sensor)[pick, 1:4] for sensor in table[number]])
                for table in self.sensors
            )
            points = self.mechanism.links[at].points
            start, end = complex(points[beam.start]), complex(points[beam.end])
            direction = np.broadcast_to(motion.direction[at], moved.shape[1]) * (end - start) / abs(end - start)
            origin = np.broadcast_to(motion.origin[at] + motion.direction[at] * start, moved.shape[1])
            xi = np.linspace(0, 1, self.elements + 1)[:, None]
            first_way = complex(self.begun.direction[at, 0]) * (end - start)
            z0 = complex(self.begun.origin[at, 0]) + complex(self.begun.direction[at, 0]) * start + xi * first_way
            z = z0 + moved[..., 0] + 1j * moved[..., 1]
            seen = np.conj(direction) * (z - origin - direction * xi * abs(end - start))
            own = self.scene.sections[number]
            N, M = forces_of(z, rate[..., 0] + 1j * rate[..., 1], np.angle(first_way) + moved[..., 2], rate[..., 2],
                             abs(end - start) / self.elements, own, float(self.beta[number]))  # fmt: skip
            fields["u"].append(seen.real[nodes_at].T)
            fields["w"].append(seen.imag[nodes_at].T)
            fields["chord"].append((seen.imag - (1 - xi) * seen.imag[0] - xi * seen.imag[-1])[nodes_at].T)
            fields["N"].append(at_nodes(N)[nodes_at].T)
            fields["M"].append(at_nodes(M)[nodes_at].T)
        table = self.mbs.GetSensorStoredData(self.multipliers)[pick, 1:]
        joints = []
        for joint in motion.structure.joints:
            made, across = self.joint[joint.name, joint.parent, joint.child]
            rows = table[:, self.mbs.systemData.GetObjectLTGAE(made)]
            joints.append(rows[:, 0] * across if rows.shape[1] == 1 else rows[:, 0] + 1j * rows[:, 1])
        return Course({name: np.array(values) for name, values in fields.items()}, -np.array(joints))


def integrated(scene: Scene, motion: Motion, *sizes: Any, from_rest: bool = False) -> ExudynModel:
    """Return the integrated model, with a coarser tolerance if Newton's method does not converge.

    `sizes` are the further arguments of `ExudynModel`.
    """
    import exudyn as exu

    for tolerance in FORCE_TOLERANCES:
        model = ExudynModel(scene, motion, *sizes)
        try:
            model.integrate(from_rest, tolerance * max(float(own.EA) for own in scene.sections))
        except exu.SolverError as error:
            problem = error
        else:
            return model
    raise problem


def _multipliers(mbs: Any, t: float, numbers: Any, factors: Any, configuration: Any) -> list[float]:
    return list(mbs.systemData.GetAECoordinates())


def forces_of(z: Any, v: Any, phi: Any, omega: Any, h: float, own: Any, beta: float) -> tuple[Any, Any]:
    """N and M of the elements, elastic and viscous, from positions, velocities and rotations of the nodes."""
    axis = np.exp(1j * (phi[:-1] + phi[1:]) / 2)
    way, speed, spin = np.diff(z, axis=0) / h, np.diff(v, axis=0) / h, (omega[:-1] + omega[1:]) / 2
    strain = (np.conj(axis) * way).real - 1
    strain_rate = (np.conj(axis) * (speed - 1j * spin * way)).real
    bent, bending = np.diff(phi, axis=0) / h, np.diff(omega, axis=0) / h
    return float(own.EA) * (strain + beta * strain_rate), float(own.EI) * (bent + beta * bending)


def at_nodes(values: Any) -> Any:
    """Nodal values: means of the neighbouring elements, extrapolated linearly at the ends."""
    inner = (values[:-1] + values[1:]) / 2
    return np.concatenate([[1.5 * values[0] - 0.5 * values[1]], inner, [1.5 * values[-1] - 0.5 * values[-2]]])
