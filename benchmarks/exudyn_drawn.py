"""Twenty random mechanisms compared with exudyn: deflections, section forces and joint forces at 0.5 % accuracy.

    python benchmarks/exudyn_drawn.py [NAME ...]    (continues results/exudyn_drawn.csv; computes named rows again)

`random_scenes` draws mechanisms of up to five beams: constant speed, end masses, springs, dwells, from rest to rest,
two cranks, arms of two drives. All are damped, with shear and rotary inertia. Two scenes of `data/` come first. A drawn
spring may buckle a link; such a mechanism has no steady state, and the next one replaces it.

exudyn has geometrically exact beams, 24 and 48 to a beam, extrapolated. It integrates with a fixed step until the
transient has died out; a run from rest starts in static equilibrium. Its section forces follow from the positions and
velocities of its nodes, its joint forces are its multipliers. The table lists the largest difference over the course at
five stations, in percent of the maximum of that beam or joint, or of a tenth of the overall maximum if that is more.
The worst beam or joint counts.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from exudyn_beams import add_beam
from random_scenes import scenes, sheared

from elastic import sample, with_rotary_inertia
from kinelast.runs import computed
from kinelast.scene.data import Scene, Theory
from kinelast.scene.document import read_scene
from kinelast.tasks.request import Request
from rigid import PinDrive, RepeatedLaw, Spring, TorsionSpring

SEED = 20260
KINDS = (
    "constant speed", "end masses", "springs", "stops that repeat", "from rest to rest", "two cranks",
    "arm of two drives",
)  # fmt: skip
COMPARED, MAX_BEAMS, MAX_TURNS = 20, 5, 8
ACCURACY, DAMPING = 0.005, 0.04
POSITIONS = 120  # a turn, or a course
ELEMENTS = 24, 48  # to a beam
STEPS = 7200  # a turn of the fastest drive, or a course
TRANSIENT_LEFT = 1e-4  # of the initial vibration when the compared turn begins
WRITE_EARLY = 1e-9  # of the interval between outputs; without it, round-off in summed times delays an output by a step
FORCE_TOLERANCES = 3e-13, 1e-11, 3e-10  # of Newton's method, relative to EA; the next if one is not reached
STATIONS = np.linspace(0.0, 1.0, 5)
MIN_BASE = 0.1  # least reference value of a beam or joint, relative to the maximum of all
FIELDS = "u", "w", "chord", "N", "M"
TARGET = measuring.RESULTS / "exudyn_drawn.csv"


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


def cases() -> Iterator[Scene]:
    """Yield scenes endlessly, with shear, rotary inertia and damping."""
    for path in sorted(Path(__file__).with_name("data").glob("*.toml")):
        scene = read_scene(path)
        yield prepared(scene, scene.theory.damping_ratio)
    for scene in scenes(SEED):
        if scene.title.split(":")[0] in KINDS and len(scene.sections) <= MAX_BEAMS:
            sections = tuple(map(sheared, scene.sections))
            course = replace(scene.course, mechanism=with_rotary_inertia(scene.mechanism, sections))
            yield prepared(replace(scene, sections=sections, course=course), DAMPING)


def prepared(scene: Scene, damping: float) -> Scene:
    """Return the scene with the positions and accuracy of this comparison."""
    run = scene.course.run
    run = replace(run, positions=POSITIONS if run.turn else POSITIONS + 1)
    theory = Theory(accuracy=ACCURACY, damping_ratio=damping)
    return with_guide_along_x(replace(scene, course=replace(scene.course, run=run), theory=theory))


def with_guide_along_x(scene: Scene) -> Scene:
    """Return the scene rotated until its guide is parallel to x."""
    mechanism = scene.mechanism
    if not mechanism.sliders:
        return scene
    (slider,) = mechanism.sliders
    turn = np.conj(complex(slider.direction)) / abs(complex(slider.direction))
    ground = mechanism.links[0]
    turned = replace(
        mechanism,
        links=(replace(ground, points=_turned(ground.points, turn)), *mechanism.links[1:]),
        drawing=_turned(mechanism.drawing, turn),
        sliders=(replace(slider, origin=complex(slider.origin) * turn, direction=1.0),),
        gravity=mechanism.gravity * turn,
    )
    laws = tuple(shifted(law, float(np.angle(turn))) for law in scene.course.laws)
    return replace(scene, course=replace(scene.course, mechanism=turned, laws=laws))


def _turned(points: Any, turn: complex) -> dict[str, complex]:
    return {name: complex(place) * turn for name, place in points.items()}


def shifted(law: Any, by: float) -> Any:
    """Return a law with its start shifted by an angle [rad]."""
    if isinstance(law, RepeatedLaw):
        return replace(law, law=shifted(law.law, by))
    return replace(law, start=law.start + by)


class ExudynModel:
    """A mechanism in exudyn."""

    def __init__(self, results: Any, beta: Any, elements: int, span: float, turns: int) -> None:
        import exudyn as exu
        import exudyn.itemInterface

        self.exu, self.items = exu, exudyn.itemInterface
        self.results, self.scene, self.beta, self.elements = results, results.scene, beta, elements
        self.span, self.turns, self.in_static_solution = span, turns, False
        stroke = max(np.ptp(np.asarray(law(np.array([0.0, span]))[0], float)) for law in self.scene.course.laws)
        self.steps = STEPS * max(1, round(stroke / (2 * math.pi)))
        self.mechanism, self.laws = self.scene.mechanism, self.scene.course.laws
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.ground = self.mbs.AddObject(self.items.ObjectGround())
        self.still = self.mbs.AddMarker(
            self.items.MarkerNodeCoordinate(nodeNumber=self.mbs.AddNode(self.items.NodePointGround()), coordinate=0)
        )
        self.begun = first_instant(results)
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
        """Add a marker of one coordinate of a node."""
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
        for joint in self.results.motion.structure.joints:
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
        start = float(self.results.motion.time[0])
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
        turned = float(np.angle(self.begun.direction[index[load.link], 0])) - float(load.angle)
        turned -= 2 * math.pi * round(turned / (2 * math.pi))
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
        """Integrate over all spans, with outputs at `POSITIONS` instants of each."""
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
        settings.solution.sensors.writePeriod = self.span / POSITIONS * (1 - WRITE_EARLY)
        self.mbs.SolveDynamic(settings)

    def course(self, first: int, last: int) -> Course:
        """Fields and joint forces at the outputs of `integrate` from `first` to `last`."""
        motion, fields, pick = self.results.motion, {name: [] for name in FIELDS}, slice(first, last)
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


def integrated(results: Any, beta: Any, elements: int, span: float, turns: int, from_rest: bool) -> ExudynModel:
    """Return the integrated model, with a coarser tolerance if Newton's method does not converge."""
    import exudyn as exu

    for tolerance in FORCE_TOLERANCES:
        model = ExudynModel(results, beta, elements, span, turns)
        try:
            model.integrate(from_rest, tolerance * max(float(own.EA) for own in results.scene.sections))
        except exu.SolverError as error:
            problem = error
        else:
            return model
    raise problem


def _multipliers(mbs: Any, t: float, numbers: Any, factors: Any, configuration: Any) -> list[float]:
    return list(mbs.systemData.GetAECoordinates())


def first_instant(results: Any) -> Any:
    """Motion at the first instant."""
    return results.scene.course.at(np.atleast_1d(results.motion.time)[:1])


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


def of_answer(results: Any) -> Course:
    """Return the fields and joint forces of the program's answer."""
    bent = results.deflection
    fields = {name: sample(bent, name, STATIONS) for name in FIELDS}
    forces = bent.forces.force
    shape = results.motion.time.shape
    return Course(fields, np.array([np.broadcast_to(np.asarray(force, complex), shape) for force in forces]))


def apart(one: Any, other: Any) -> float:
    """Largest difference of the worst row, in percent of its maximum."""
    flat = tuple(range(1, one.ndim))
    largest = np.abs(other).max(axis=flat)
    base = np.maximum(largest, MIN_BASE * largest.max(initial=0.0))
    return float(100 * (np.abs(one - other).max(axis=flat) / np.where(base > 0, base, 1.0)).max(initial=0.0))


def peaks_apart(one: Any, other: Any) -> float:
    """Largest difference between the maxima of two rows, in percent."""
    flat = tuple(range(1, one.ndim))
    here, there = np.abs(one).max(axis=flat), np.abs(other).max(axis=flat)
    base = np.maximum(there, MIN_BASE * there.max(initial=0.0))
    return float(100 * (np.abs(here - there) / np.where(base > 0, base, 1.0)).max(initial=0.0))


def row_of(scene: Scene) -> dict[str, Any]:
    """Return the row of a scene; differences in percent."""
    start = time.process_time()
    results = computed(scene, Request())
    taken, begin = time.process_time() - start, time.process_time()
    assert results.answer is not None
    vibrating = results.answer.vibrating
    if vibrating is None or not vibrating.stable:
        why = results.answer.unknown or "no steady state"
        return {"scene": scene.name, "kind": scene.title, "theory": results.answer.theory, "unanswered": why}
    beta = vibrating.damping.beams
    closed, times = not math.isnan(results.period), results.motion.time
    span = results.period if closed else float(times[-1] - times[0])
    rates = [np.abs(np.asarray(law(times)[1])) for law in scene.course.laws]
    from_rest = not closed or all(rate.max() > 0 and rate[0] < 1e-6 * rate.max() for rate in rates)
    turns = 1
    if closed:
        fading = float(np.min(beta)) * vibrating.lowest**2 / 2 * span
        turns = min(MAX_TURNS, 2 + math.ceil(-math.log(TRANSIENT_LEFT) / fading))
    courses, settled = [], math.nan
    for elements in ELEMENTS:
        model = integrated(results, beta, elements, span, turns, from_rest)
        count = len(times)
        courses.append(model.course((turns - 1) * POSITIONS, (turns - 1) * POSITIONS + count))
        if turns > 1 and elements == ELEMENTS[0]:
            before = model.course((turns - 2) * POSITIONS, (turns - 2) * POSITIONS + count)
            settled = apart(before.fields["chord"], courses[-1].fields["chord"])
    coarse, fine = courses
    best, mine = fine.times(4 / 3) + coarse.times(-1 / 3), of_answer(results)
    answer = results.answer
    row: dict[str, Any] = {"scene": scene.name, "kind": scene.title, "beams": len(scene.sections)}
    row |= {
        "theory": answer.theory,
        "stated error": 100 * answer.error,
        "stated error of courses": 100 * answer.worst_course[1],
    }
    row |= {name: apart(mine.fields[name], best.fields[name]) for name in FIELDS}
    row |= {"joints": apart(mine.joints, best.joints)}
    row |= {"peak of chord": peaks_apart(mine.fields["chord"], best.fields["chord"])}
    row |= {f"exudyn's {name}": apart(fine.fields[name], best.fields[name]) for name in ("chord", "N", "M")}
    row |= {"exudyn's joints": apart(fine.joints, best.joints), "last two turns": settled, "turns": turns}
    return {**row, "s": taken, "exudyn's s": time.process_time() - begin}


def main() -> None:
    rows: dict[str, dict[str, Any]] = {each["scene"]: each for each in measuring.read_rows(TARGET)}
    answered = 0
    for scene in cases():
        if answered == COMPARED:
            return
        if scene.name in sys.argv[1:] or scene.name not in rows:
            rows[scene.name] = row_of(scene)
            print(rows[scene.name], flush=True)
            measuring.write_rows(TARGET, [*rows.values()])
        answered += not rows[scene.name].get("unanswered")


if __name__ == "__main__":
    main()
