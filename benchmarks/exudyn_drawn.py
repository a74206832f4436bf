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

import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from exudyn_model import FIELDS, STATIONS, Course, integrated
from msgspec.structs import replace
from random_scenes import scenes, sheared

from elastic import sample, with_rotary_inertia
from kinelast.runs import computed
from kinelast.scene.data import Scene, Theory
from kinelast.scene.document import read_scene
from kinelast.tasks.request import Request
from rigid import RepeatedLaw

SEED = 20260
KINDS = (
    "constant speed", "end masses", "springs", "stops that repeat", "from rest to rest", "two cranks",
    "arm of two drives",
)  # fmt: skip
COMPARED, MAX_BEAMS, MAX_TURNS = 20, 5, 32
ACCURACY, DAMPING = 0.005, 0.04
POSITIONS = 120  # a turn, or a course
ELEMENTS = 24, 48  # to a beam
STEPS = 7200  # a turn of the fastest drive, or a course
TRANSIENT_LEFT = 1e-4  # of the initial vibration when the compared turn begins
MIN_BASE = 0.1  # least reference value of a beam or joint, relative to the maximum of all
TARGET = measuring.RESULTS / "exudyn_drawn.csv"


def cases() -> Iterator[Scene]:
    """Yield scenes endlessly, with shear, rotary inertia and damping."""
    for path in sorted(Path(__file__).with_name("data").glob("*.toml")):
        scene = read_scene(path)
        yield prepared(scene, scene.theory.damping_ratio)
    yield from chosen(SEED)


def chosen(seed: int) -> Iterator[Scene]:
    """Yield random scenes of a seed endlessly, with shear, rotary inertia and damping."""
    for scene in scenes(seed):
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


def integration(scene: Scene, results: Any) -> tuple[float, int, bool]:
    """Return the duration of a turn or course [s], the number of turns to integrate, and whether it starts at rest."""
    closed, times, vibrating = not math.isnan(results.period), results.motion.time, results.answer.vibrating
    span = results.period if closed else float(times[-1] - times[0])
    rates = [np.abs(np.asarray(law(times)[1])) for law in scene.course.laws]
    from_rest = not closed or all(rate.max() > 0 and rate[0] < 1e-6 * rate.max() for rate in rates)
    if not closed:
        return span, 1, from_rest
    fading = float(np.min(vibrating.damping.beams)) * vibrating.lowest**2 / 2 * span
    return span, min(MAX_TURNS, 2 + math.ceil(-math.log(TRANSIENT_LEFT) / fading)), from_rest


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
    beta, times = vibrating.damping.beams, results.motion.time
    span, turns, from_rest = integration(scene, results)
    courses, settled = [], math.nan
    for elements in ELEMENTS:
        sizes = beta, elements, span, turns, STEPS, POSITIONS
        model = integrated(scene, results.motion, *sizes, from_rest=from_rest)
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
