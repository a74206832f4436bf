"""What a user would pick instead, on the common job: steel four-bar at 12 positions of a turn.

None of them turns motion into inertia loads, so all but pylinkage are given the places of the links and the loads per
length that `rigid` finds, and solve the frame: crank clamped at its drive, three hinges. Their times are those of
building and solving that model, position by position. Errors are those of u and w against 50 digits, by the greatest
value of either over the positions. Whatever is not installed is left out: `pip install ".[peers]"`.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module, metadata
from itertools import pairwise
from typing import Any

import measuring
import numpy as np
from exact_fields import DATA
from jobs import AREA, DENSITY, INERTIA, SPEED, E, steel_four_bar

from elastic import PRIMARY, deflection, sample
from rigid import motion, position_of
from rigid.kinetostatics.loads import beam_loads

MIDDLE = 1e3  # of the figure [us]
BEAMS = (("crank", "O", "A"), ("coupler", "A", "B"), ("rocker", "D", "B"))


@dataclass(frozen=True)
class Frame:
    """One position: places of the joints, and q_x + i q_y at both ends of every beam, in its axes."""

    places: dict[str, complex]
    loads: list[tuple[complex, complex]]

    def ends(self, beam: int) -> tuple[complex, complex]:
        """Places of the ends of a beam."""
        return self.places[BEAMS[beam][1]], self.places[BEAMS[beam][2]]

    def along(self, beam: int) -> complex:
        """Unit vector of a beam's x' axis."""
        start, end = self.ends(beam)
        return (end - start) / abs(end - start)


def frames(positions: Any) -> list[Frame]:
    course = motion(steel_four_bar().mechanism, positions, SPEED)
    q = beam_loads(course)
    spots = {"O": ("crank", "O"), "A": ("crank", "A"), "B": ("rocker", "B"), "D": ("rocker", "D")}
    places = {name: position_of(course, *spot) for name, spot in spots.items()}
    return [
        Frame(
            {name: complex(place[k]) for name, place in places.items()},
            [(complex(q[0, b, k]), complex(q[0, b, k] + q[1, b, k])) for b in range(3)],
        )
        for k in range(len(positions))
    ]


def work_equivalent(q: tuple[complex, complex], h: float) -> tuple[complex, complex, float, float]:
    """Forces, in the beam's axes, and moments on the ends of an element of length h under a linear load."""
    (a, b), across = q, (q[0].imag, q[1].imag)
    along = ((a.real / 3 + b.real / 6) * h, (a.real / 6 + b.real / 3) * h)
    force = ((7 * across[0] + 3 * across[1]) * h / 20, (3 * across[0] + 7 * across[1]) * h / 20)
    moment = ((across[0] / 20 + across[1] / 30) * h**2, -(across[0] / 30 + across[1] / 20) * h**2)
    return complex(along[0], force[0]), complex(along[1], force[1]), moment[0], moment[1]


def pieces(q: tuple[complex, complex], count: int) -> list[tuple[complex, complex]]:
    """A linear load cut into equal parts."""
    values = [q[0] + (q[1] - q[0]) * k / count for k in range(count + 1)]
    return list(pairwise(values))


def opensees(frame: Frame, count: int) -> Any:
    """OpenSeesPy: elastic beam-column elements, hinges by equalDOF, work-equivalent loads on the nodes."""
    import openseespy.opensees as ops

    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.geomTransf("Linear", 1)
    ops.timeSeries("Linear", 1)
    first = [1, 1 + (count + 1), 1 + 2 * (count + 1)]
    for beam in range(3):
        start, end = frame.ends(beam)
        for k in range(count + 1):
            place = start + (end - start) * k / count
            ops.node(first[beam] + k, place.real, place.imag)
        for k in range(count):
            ops.element("elasticBeamColumn", first[beam] + k, first[beam] + k, first[beam] + k + 1, AREA, E, INERTIA, 1)
    ops.fix(first[0], 1, 1, 1)
    ops.fix(first[2], 1, 1, 0)
    ops.equalDOF(first[0] + count, first[1], 1, 2)
    ops.equalDOF(first[2] + count, first[1] + count, 1, 2)
    ops.pattern("Plain", 1, 1)
    for beam in range(3):
        start, end = frame.ends(beam)
        for k, q in enumerate(pieces(frame.loads[beam], count)):
            *forces, one, other = work_equivalent(q, abs(end - start) / count)
            for node, force, moment in ((k, forces[0], one), (k + 1, forces[1], other)):
                push = force * frame.along(beam)
                ops.load(first[beam] + node, push.real, push.imag, moment)
    ops.system("BandGeneral")
    ops.numberer("RCM")
    ops.constraints("Transformation")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static")
    ops.analyze(1)
    moved = [[complex(*ops.nodeDisp(first[beam] + k)[:2]) for k in range(count + 1)] for beam in range(3)]
    return np.array([np.conj(frame.along(beam)) * np.array(moved[beam]) for beam in range(3)])


def pynite(frame: Frame, count: int) -> Any:
    """PyNite: one member a link under trapezoidal loads, ends released at the hinges.

    Turned a little, for its axes of vertical members are others than those beside them.
    """
    from Pynite import FEModel3D

    frame = Frame({name: place * np.exp(0.1j) for name, place in frame.places.items()}, frame.loads)
    model = FEModel3D()
    model.add_material("steel", E, E / 2.6, 0.3, DENSITY)
    model.add_section("bar", AREA, INERTIA, INERTIA, 2 * INERTIA)
    for name, place in frame.places.items():
        model.add_node(name, place.real, place.imag, 0.0)
        fixed = name in "OD"
        model.def_support(name, fixed, fixed, True, True, True, name == "O")
    for beam, (name, start, end) in enumerate(BEAMS):
        model.add_member(name, start, end, "steel", "bar")
        a, b = frame.loads[beam]
        model.add_member_dist_load(name, "Fx", a.real, b.real)
        model.add_member_dist_load(name, "Fy", up(frame, beam) * a.imag, up(frame, beam) * b.imag)
    model.def_releases("coupler", Rzi=True, Rzj=True)
    model.analyze_linear()
    moved = np.empty((3, count + 1), complex)
    for beam, (name, _, _) in enumerate(BEAMS):
        member = model.members[name]
        for k in range(count + 1):
            u, w = (member.deflection(way, k / count * member.L()) for way in ("dx", "dy"))
            moved[beam, k] = complex(u, up(frame, beam) * w)
    return moved


def up(frame: Frame, beam: int) -> float:
    """-1 where PyNite's y' axis, which never points down, is on the right of a member."""
    return -1.0 if frame.along(beam).real < -1e-9 else 1.0


def anastruct(frame: Frame, count: int) -> Any:
    """anaStruct: elements under its own linear loads, hinges as springs of no stiffness."""
    from anastruct import SystemElements

    model = SystemElements(EA=E * AREA, EI=E * INERTIA, invert_y_loads=False)
    for beam in range(3):
        start, end = frame.ends(beam)
        for k, q in enumerate(pieces(frame.loads[beam], count)):
            a, b = q
            one, other = (start + (end - start) * part / count for part in (k, k + 1))
            hinges = {1: 0} if beam == 1 and k == 0 else {}
            hinges |= {2: 0} if beam == 1 and k == count - 1 else {}
            if other.real < one.real:  # elements go from left to right, whichever way they are given
                one, other, a, b = other, one, -b, -a
                hinges = {3 - end: stiffness for end, stiffness in hinges.items()}
            number = model.add_element([[one.real, one.imag], [other.real, other.imag]], spring=hinges or None)
            model.q_load(q=[a.imag, b.imag], element_id=number, direction="element", q_perp=[-a.real, -b.real])
    model.add_support_fixed(model.find_node_id([0.0, 0.0]))
    model.add_support_hinged(model.find_node_id([frame.places["D"].real, frame.places["D"].imag]))
    model.solve()
    moved = np.empty((3, count + 1), complex)
    for beam in range(3):
        start, end = frame.ends(beam)
        for k in range(count + 1):
            place = start + (end - start) * k / count
            found = model.get_node_results_system(model.find_node_id([place.real, place.imag]))
            moved[beam, k] = np.conj(frame.along(beam)) * complex(found["ux"], found["uy"])
    return moved


def exudyn(frame: Frame, count: int) -> Any:
    """exudyn: ANCF cable elements, geometrically nonlinear, hinges by coordinate constraints, static solution."""
    import exudyn as exu
    from exudyn import itemInterface as items  # noqa: N813

    container = exu.SystemContainer()
    model = container.AddSystem()
    ground = model.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=model.AddNode(items.NodePointGround()), coordinate=0)
    )
    nodes: list[list[int]] = []

    def coordinate(node: int, which: int) -> Any:
        return model.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=which))

    def tie(one: Any, other: Any) -> None:
        model.AddObject(items.CoordinateConstraint(markerNumbers=[one, other]))

    for beam in range(3):
        start, end = frame.ends(beam)
        along, h = frame.along(beam), abs(end - start) / count
        row = []
        for k in range(count + 1):
            place = start + (end - start) * k / count
            reference = [place.real, place.imag, along.real, along.imag]
            row.append(model.AddNode(items.Point2DS1(referenceCoordinates=reference)))
        for k, q in enumerate(pieces(frame.loads[beam], count)):
            model.AddObject(
                items.Cable2D(
                    physicsLength=h,
                    physicsMassPerLength=DENSITY * AREA,
                    physicsBendingStiffness=E * INERTIA,
                    physicsAxialStiffness=E * AREA,
                    nodeNumbers=[row[k], row[k + 1]],
                    useReducedOrderIntegration=0,
                )
            )
            a, b = (value * along for value in q)
            shares = (
                (row[k], (7 * a + 3 * b) * h / 20, (a / 20 + b / 30) * h**2),
                (row[k + 1], (3 * a + 7 * b) * h / 20, -(a / 30 + b / 20) * h**2),
            )
            for node, push, bend in shares:
                for which, value in enumerate((push.real, push.imag, bend.real, bend.imag)):
                    model.AddLoad(items.LoadCoordinate(markerNumber=coordinate(node, which), load=value))
        nodes.append(row)
    for which in range(4):
        tie(ground, coordinate(nodes[0][0], which))
    for which in range(2):
        tie(ground, coordinate(nodes[2][0], which))
        tie(coordinate(nodes[0][-1], which), coordinate(nodes[1][0], which))
        tie(coordinate(nodes[2][-1], which), coordinate(nodes[1][-1], which))
    model.Assemble()
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.newton.absoluteTolerance = 1e-5  # [N]; the stiff length of the cable rounds off to 1e-6
    settings.displayStatistics = False
    exu.SolveStatic(model, settings)
    moved = [[complex(*model.GetNodeOutput(n, exu.OutputVariableType.Coordinates)[:2]) for n in row] for row in nodes]
    return np.array([np.conj(frame.along(beam)) * np.array(moved[beam]) for beam in range(3)])


def pylinkage(positions: int) -> tuple[float, float]:
    """pylinkage: places, velocities and accelerations of the joints of a turn; error of accelerations, seconds."""
    from pylinkage import Crank, Ground, Linkage, RRRDyad

    pivots = Ground(0.0, 0.0), Ground(0.35, 0.0)
    crank = Crank(pivots[0], 0.1, angular_velocity=2 * math.pi / positions, initial_angle=0.0)
    tip = RRRDyad(crank.output, pivots[1], 0.3, 0.25, x=0.28, y=0.24)
    linkage = Linkage([*pivots, crank, tip])
    linkage.set_input_velocity(crank, SPEED)

    def whole() -> Any:
        linkage.set_coords([(0.0, 0.0), (0.35, 0.0), (0.1, 0.0), (0.28, 0.24)])
        return linkage.step_fast_with_kinematics(positions)

    found = [values[:, -1] @ np.array([1, 1j]) for values in whole()]
    ours = motion(steel_four_bar().mechanism, 2 * np.pi * np.arange(1, positions + 1) / positions, SPEED)
    expected = ours.acceleration[3] + ours.turning[3] * ours.direction[3] * 0.25
    error = float(np.abs(found[2] - expected).max() / np.abs(expected).max())
    return error, measuring.seconds(whole)


def version(name: str) -> str:
    return f"{name} {metadata.version(name)}"


def measured(solve: Callable[[Frame, int], Any], count: int, data: dict[str, Any]) -> tuple[float, float]:
    """Greatest error of u and w at the nodes that are stations, and seconds a position."""
    poses = frames([2 * math.pi * k / data["of"] for k in data["positions"]])
    exact = np.array(data["Euler-Bernoulli"]["u"]) + 1j * np.array(data["Euler-Bernoulli"]["w"])
    exact = exact[:, :, np.arange(0, 9, 8 // min(count, 8))]
    found = np.array([solve(pose, count)[:, :: max(count // 8, 1)] for pose in poses])
    error = np.abs(found - exact)
    worst = max(error.real.max(), np.abs((found - exact).imag).max()) / np.abs(exact).max()
    return float(worst), measuring.seconds(lambda: [solve(pose, count) for pose in poses[:4]], 0.5, 3) / 4


PEERS: tuple[tuple[str, str, str, Callable[[Frame, int], Any], tuple[int, ...]], ...] = (
    ("openseespy", "openseespy.opensees", "elements a link", opensees, (1, 8)),
    ("PyNiteFEA", "Pynite", "stations of one member", pynite, (8,)),
    ("anastruct", "anastruct", "elements a link", anastruct, (1, 8, 16)),
    ("exudyn", "exudyn", "ANCF elements a link", exudyn, (8,)),
)


def loads(name: str, module: str) -> bool:
    """Whether a peer can be imported; says so if not."""
    try:
        import_module(module)
    except (ImportError, RuntimeError) as missing:
        print(f"{name} is left out: {missing}")
        return False
    return True


def main() -> None:
    data = json.loads(DATA.read_text())
    rows: list[dict[str, Any]] = []
    warnings.simplefilter("ignore")
    for name, module, unit, solve, counts in PEERS:
        for count in counts if loads(name, module) else ():
            error, time = measured(solve, count, data)
            rows.append(
                {
                    "tool": version(name),
                    "set-up": set_up(count, unit),
                    "us a position": time * 1e6,
                    "error": error,
                }
            )
    if loads("pylinkage", "pylinkage"):
        error, time = pylinkage(360)
        row = {"tool": version("pylinkage"), "set-up": "motion alone, numba", "us a position": time / 360 * 1e6}
        rows.append(row | {"error": error})
    for positions in (360, 8000):
        job = steel_four_bar(positions)
        at = [k * positions // data["of"] for k in data["positions"]] if positions == data["of"] else None
        stations = np.array(data["stations"][:9])
        solved = deflection(job.motion(), job.sections)
        error = None
        if at is not None:
            exact = {field: np.moveaxis(np.array(data["Euler-Bernoulli"][field])[..., :9], 0, 1) for field in PRIMARY}
            greatest = max(np.abs(exact[field]).max() for field in ("u", "w"))
            error = max(
                float(np.abs(sample(solved, f, stations)[:, at] - exact[f]).max() / greatest) for f in ("u", "w")
            )
        calls = {
            "motion alone": job.motion,
            "motion, loads, all fields as polynomials": lambda job=job: deflection(job.motion(), job.sections),
        }
        for what, time in measuring.in_turn(calls).items():
            row = {
                "tool": "kinelast",
                "set-up": f"{what}, {positions} positions",
                "us a position": time / positions * 1e6,
            }
            rows.append(row | {"error": error if "fields" in what else None})
    notes = ["exudyn's difference is the geometric nonlinearity of its elements, not an error of it"]
    measuring.report("peers", "Peers: the steel four-bar elsewhere", {"tools": rows}, notes)
    draw(rows)


def set_up(count: int, unit: str) -> str:
    return f"{count} {unit.replace('elements', 'element') if count == 1 else unit}"


def draw(rows: list[dict[str, Any]]) -> None:
    """Errors over times, each told beside its mark, or below where it is on the right."""
    with measuring.figure("peers", size=(8.5, 4.5)) as axis:
        for row in rows:
            if row["error"]:
                right = row["us a position"] > MIDDLE
                place = (row["us a position"], row["error"])
                axis.loglog(*place, "*" if row["tool"] == "kinelast" else "o", ms=8)
                words = f"{row['tool']}: {row['set-up']}"
                told = {"ha": "right", "va": "top"} if right else {"ha": "left", "va": "center"}
                off = (6, -7) if right else (8, 0)
                axis.annotate(words, place, off, textcoords="offset points", fontsize=7, **told)
        axis.margins(0.06)
        axis.set(xlabel="microseconds a position", ylabel="error of u and w over the greatest")


if __name__ == "__main__":
    main()
