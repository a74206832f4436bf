"""Twenty mechanisms of all kinds beside exudyn: deflection, section forces and joint forces of the answer at 0.5 %.

Drawn at random (`random_scenes`: constant speed, end masses, springs, stops that repeat, from rest to rest, two cranks,
arms of two drives; chains of up to five beams), all damped, with shear and the sections' own inertia; and two that were
wrong once. Drawn springs may bend links by radians and press them beyond what buckles them: such mechanisms have no
steady state, and others are drawn in their place. exudyn has geometrically exact beams, 24 and 48 to a beam,
extrapolated, and marches in steps of one length until nothing is left of the start; from rest it begins in static
balance. Its section forces are those of its nodes' places and velocities, elastic and viscous; its joint forces are its
multipliers. Differences are the greatest over the course at five stations, as shares of the beam's or joint's greatest,
or of a tenth of the greatest of all where that is more; for the worst beam or joint, in percent.

    python benchmarks/exudyn_drawn.py [NAME ...]

Rows that stand in results/exudyn_drawn.csv are kept; named ones are made again.
"""

from __future__ import annotations

import csv
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
COMPARED, MOST_BEAMS, MOST_TURNS = 20, 5, 8
ACCURACY, DAMPING = 0.005, 0.04
POSITIONS = 120  # a turn, or a course
ELEMENTS = 24, 48
STEPS = 7200  # a turn of the fastest drive, or a course
DIED_OUT = 1e-4
EARLIER = 1e-9  # share of the time between two instants, less than a step: round-off of a sum of times makes none late
ROUND_OFF = 3e-13, 1e-11, 3e-10  # of EA, of residuals of forces
STATIONS = np.linspace(0.0, 1.0, 5)
LEAST = 0.1  # of the greatest of all beams or joints, where a beam's or joint's own is less
FIELDS = "u", "w", "chord", "N", "M"
TARGET = measuring.RESULTS / "exudyn_drawn.csv"


@dataclass(frozen=True, eq=False)
class Course:
    """Fields by name, (beams, instants, stations), and joint forces, (joints, instants)."""

    fields: dict[str, Any]
    joints: Any

    def __add__(self, other: Course) -> Course:
        fields = {name: values + other.fields[name] for name, values in self.fields.items()}
        return Course(fields, self.joints + other.joints)

    def times(self, factor: float) -> Course:
        """Scaled."""
        return Course({name: factor * values for name, values in self.fields.items()}, factor * self.joints)


def cases() -> Iterator[Scene]:
    """Scenes without end, with shear, inertia of sections and damping."""
    for path in sorted(Path(__file__).with_name("data").glob("*.toml")):
        scene = read_scene(path)
        yield prepared(scene, scene.theory.damping_ratio)
    for scene in scenes(SEED):
        if scene.title.split(":")[0] in KINDS and len(scene.sections) <= MOST_BEAMS:
            sections = tuple(map(sheared, scene.sections))
            course = replace(scene.course, mechanism=with_rotary_inertia(scene.mechanism, sections))
            yield prepared(replace(scene, sections=sections, course=course), DAMPING)


def prepared(scene: Scene, damping: float) -> Scene:
    """At the positions and accuracy of this comparison."""
    run = scene.course.run
    run = replace(run, positions=POSITIONS if run.turn else POSITIONS + 1)
    theory = Theory(accuracy=ACCURACY, damping_ratio=damping)
    return lying(replace(scene, course=replace(scene.course, run=run), theory=theory))


def lying(scene: Scene) -> Scene:
    """The same, turned so that its guide lies along x."""
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
    laws = tuple(started(law, float(np.angle(turn))) for law in scene.course.laws)
    return replace(scene, course=replace(scene.course, mechanism=turned, laws=laws))


def _turned(points: Any, turn: complex) -> dict[str, complex]:
    return {name: complex(place) * turn for name, place in points.items()}


def started(law: Any, by: float) -> Any:
    """A law that starts so much farther."""
    if isinstance(law, RepeatedLaw):
        return replace(law, law=started(law.law, by))
    return replace(law, start=law.start + by)


class Copy:
    """A mechanism in exudyn."""

    def __init__(self, results: Any, beta: Any, elements: int, span: float, turns: int) -> None:
        import exudyn as exu
        import exudyn.itemInterface

        self.exu, self.items = exu, exudyn.itemInterface
        self.results, self.scene, self.beta, self.elements = results, results.scene, beta, elements
        self.span, self.turns, self.still_standing = span, turns, False
        gone = max(np.ptp(np.asarray(law(np.array([0.0, span]))[0], float)) for law in self.scene.course.laws)
        self.steps = STEPS * max(1, round(gone / (2 * math.pi)))
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
        """Nodes of a beam; its corner with another of the link held fast."""
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
                held = [turned, self.coordinate(node, 2)]
                self.mbs.AddObject(self.items.ObjectConnectorCoordinate(markerNumbers=held))
            self.at.setdefault((at, name), node)
        return nodes

    def lumps(self) -> None:
        """Masses; a link without beams is a node of its own."""
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
        """Marker of a node's place."""
        return int(self.mbs.AddMarker(self.items.MarkerNodePosition(nodeNumber=node)))

    def coordinate(self, node: int, number: int) -> int:
        """Marker of one coordinate of a node."""
        return int(self.mbs.AddMarker(self.items.MarkerNodeCoordinate(nodeNumber=node, coordinate=number)))

    def marker(self, link: int, point: str) -> int:
        """Marker of a link's point."""
        if link:
            return self.place(self.at[link, point])
        z = complex(self.mechanism.links[0].points[point])
        return int(
            self.mbs.AddMarker(
                self.items.MarkerBodyPosition(bodyNumber=self.ground, localPosition=[z.real, z.imag, 0.0])
            )
        )

    def revolute(self, marker: int, node: int) -> Any:
        """A pin."""
        return self.mbs.AddObject(self.items.ObjectJointRevolute2D(markerNumbers=[marker, self.place(node)]))

    def pins(self) -> None:
        """Those of the mechanism's tree and closures."""
        for joint in self.results.motion.structure.joints:
            if joint.turns:
                one, other = self.marker(joint.parent, joint.name), self.marker(joint.child, joint.name)
                made = self.mbs.AddObject(self.items.ObjectJointRevolute2D(markerNumbers=[one, other]))
                self.joint[joint.name, joint.parent, joint.child] = made, 1.0

    def sliders(self) -> None:
        """Blocks on lines of the ground along x: no displacement along y."""
        index = self.mechanism.index
        for slider in self.mechanism.sliders:
            up = self.coordinate(self.at[index[slider.link], slider.point], 1)
            made = self.mbs.AddObject(self.items.ObjectConnectorCoordinate(markerNumbers=[self.still, up]))
            self.joint[slider.name, index[slider.on], index[slider.link]] = made, 1j

    def drive(self, drive: Any, law: Any) -> None:
        """The angle of a link on another, by its law."""
        assert isinstance(drive, PinDrive)
        start = float(self.results.motion.time[0])
        first = float(np.asarray(law(np.array([start]))[0]).item())

        step = self.span / self.steps
        known = np.asarray(law(start + step * np.arange(self.turns * self.steps + 1))[0], float) - first

        def moved(mbs: Any, t: float, item: int, offset: float) -> float:
            if self.still_standing:
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
        """Node of a link's point."""
        return self.at[self.mechanism.index[link], point]

    def spring(self, load: Any) -> None:
        """A spring between points, or on the angle between links."""
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
        """At all nodes."""
        g = complex(self.mechanism.gravity)
        for node, mass in self.mass.items() if g else ():
            pull = [mass * g.real, mass * g.imag, 0.0]
            self.mbs.AddLoad(self.items.Force(markerNumber=self.place(node), loadVector=pull))

    def sensor(self, node: int, kind: Any) -> Any:
        """Of a node's coordinates."""
        return self.mbs.AddSensor(
            self.items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
        )

    def marched(self, from_rest: bool, lost: float) -> None:
        """The motion over all spans, known at `POSITIONS` instants of each."""
        settings = self.exu.SimulationSettings()
        settings.solution.file.write = False
        settings.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        if from_rest and (self.mechanism.loads or self.mechanism.gravity):
            settings.staticSolver.verboseMode = 0
            newton = settings.staticSolver.newton
            newton.relativeTolerance, newton.absoluteTolerance = 1e-8, lost
            self.still_standing = True  # exudyn counts load steps in time
            self.mbs.SolveStatic(settings, updateInitialValues=True)
            self.still_standing = False
        marching = settings.timeIntegration
        marching.numberOfSteps, marching.endTime = self.turns * self.steps, self.turns * self.span
        marching.verboseMode = 0
        marching.generalizedAlpha.spectralRadius = 0.8
        marching.newton.relativeTolerance, marching.newton.absoluteTolerance = 1e-7, lost
        settings.solution.sensors.writePeriod = self.span / POSITIONS * (1 - EARLIER)
        self.mbs.SolveDynamic(settings)

    def course(self, first: int, last: int) -> Course:
        """Fields and joint forces at instants of `marched`."""
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


def marched(results: Any, beta: Any, elements: int, span: float, turns: int, from_rest: bool) -> Copy:
    """A mechanism that has been marched, to a coarser tolerance where its Newton's method gets no nearer."""
    import exudyn as exu

    for lost in ROUND_OFF:
        copy = Copy(results, beta, elements, span, turns)
        try:
            copy.marched(from_rest, lost * max(float(own.EA) for own in results.scene.sections))
        except exu.SolverError as error:
            problem = error
        else:
            return copy
    raise problem


def _multipliers(mbs: Any, t: float, numbers: Any, factors: Any, configuration: Any) -> list[float]:
    return list(mbs.systemData.GetAECoordinates())


def first_instant(results: Any) -> Any:
    """The motion at its first instant."""
    return results.scene.course.at(np.atleast_1d(results.motion.time)[:1])


def forces_of(z: Any, v: Any, phi: Any, omega: Any, h: float, own: Any, beta: float) -> tuple[Any, Any]:
    """N and M of the elements, elastic and viscous, from places, velocities and rotations of the nodes."""
    axis = np.exp(1j * (phi[:-1] + phi[1:]) / 2)
    way, speed, spin = np.diff(z, axis=0) / h, np.diff(v, axis=0) / h, (omega[:-1] + omega[1:]) / 2
    strain = (np.conj(axis) * way).real - 1
    strain_rate = (np.conj(axis) * (speed - 1j * spin * way)).real
    bent, bending = np.diff(phi, axis=0) / h, np.diff(omega, axis=0) / h
    return float(own.EA) * (strain + beta * strain_rate), float(own.EI) * (bent + beta * bending)


def at_nodes(values: Any) -> Any:
    """Means of the elements beside the nodes; at the ends on the line through the two last."""
    inner = (values[:-1] + values[1:]) / 2
    return np.concatenate([[1.5 * values[0] - 0.5 * values[1]], inner, [1.5 * values[-1] - 0.5 * values[-2]]])


def of_answer(results: Any) -> Course:
    """The program's."""
    bent = results.deflection
    fields = {name: sample(bent, name, STATIONS) for name in FIELDS}
    forces = bent.forces.force
    shape = results.motion.time.shape
    return Course(fields, np.array([np.broadcast_to(np.asarray(force, complex), shape) for force in forces]))


def apart(one: Any, other: Any) -> float:
    """Greatest difference of the worst row, in percent of its greatest."""
    flat = tuple(range(1, one.ndim))
    largest = np.abs(other).max(axis=flat)
    base = np.maximum(largest, LEAST * largest.max(initial=0.0))
    return float(100 * (np.abs(one - other).max(axis=flat) / np.where(base > 0, base, 1.0)).max(initial=0.0))


def peaks_apart(one: Any, other: Any) -> float:
    """Greatest difference of two rows' greatest values, in percent of it."""
    flat = tuple(range(1, one.ndim))
    here, there = np.abs(one).max(axis=flat), np.abs(other).max(axis=flat)
    base = np.maximum(there, LEAST * there.max(initial=0.0))
    return float(100 * (np.abs(here - there) / np.where(base > 0, base, 1.0)).max(initial=0.0))


def row(scene: Scene) -> dict[str, Any]:
    """What is apart, in percent."""
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
        turns = min(MOST_TURNS, 2 + math.ceil(-math.log(DIED_OUT) / fading))
    courses, settled = [], math.nan
    for elements in ELEMENTS:
        copy = marched(results, beta, elements, span, turns, from_rest)
        count = len(times)
        courses.append(copy.course((turns - 1) * POSITIONS, (turns - 1) * POSITIONS + count))
        if turns > 1 and elements == ELEMENTS[0]:
            before = copy.course((turns - 2) * POSITIONS, (turns - 2) * POSITIONS + count)
            settled = apart(before.fields["chord"], courses[-1].fields["chord"])
    coarse, fine = courses
    best, mine = fine.times(4 / 3) + coarse.times(-1 / 3), of_answer(results)
    answer = results.answer
    told: dict[str, Any] = {"scene": scene.name, "kind": scene.title, "beams": len(scene.sections)}
    told |= {
        "theory": answer.theory,
        "told": 100 * answer.error,
        "told of courses": 100 * answer.worst_course[1],
    }
    told |= {name: apart(mine.fields[name], best.fields[name]) for name in FIELDS}
    told |= {"joints": apart(mine.joints, best.joints)}
    told |= {"peak of chord": peaks_apart(mine.fields["chord"], best.fields["chord"])}
    told |= {f"exudyn's {name}": apart(fine.fields[name], best.fields[name]) for name in ("chord", "N", "M")}
    told |= {"exudyn's joints": apart(fine.joints, best.joints), "last two turns": settled, "turns": turns}
    return {**told, "s": taken, "exudyn's s": time.process_time() - begin}


def written(rows: dict[str, dict[str, Any]]) -> None:
    """All rows."""
    head = list(dict.fromkeys(key for each in rows.values() for key in each))
    with TARGET.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, head)
        writer.writeheader()
        for each in rows.values():
            writer.writerow({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in each.items()})


def main() -> None:
    rows: dict[str, dict[str, Any]] = {}
    if TARGET.exists():
        with TARGET.open(encoding="utf-8") as stream:
            rows = {each["scene"]: dict(each) for each in csv.DictReader(stream)}
    answered = 0
    for scene in cases():
        if answered == COMPARED:
            return
        if scene.name in sys.argv[1:] or scene.name not in rows:
            rows[scene.name] = row(scene)
            print(rows[scene.name], flush=True)
            written(rows)
        answered += not rows[scene.name].get("unanswered")


if __name__ == "__main__":
    main()
