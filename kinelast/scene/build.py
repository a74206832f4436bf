"""Build a `Scene` from parsed tables: mechanism, run, loads and limits."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from math import nan
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.scene.course import Course, CourseByLaws, IntegratedCourse, Run
from kinelast.scene.data import DAMPING_RATIO, Scene, Theory
from kinelast.scene.drives import DriveEffort, DriveLaw, build_drives
from kinelast.scene.format import MaterialTable, SceneTable
from kinelast.scene.joints import build_friction, build_gears, build_joints, build_sliders, build_welds
from kinelast.scene.library import materials_of
from kinelast.scene.limits import build_output, build_settled, figure_bounds, limits_in
from kinelast.scene.links import LinkModel, build_links, drawn_places, guiding, undivided
from kinelast.scene.loads import build_load, build_spring
from kinelast.scene.parsing import leaves
from kinelast.scene.part import Assembly
from kinelast.scene.parts import PARTS
from kinelast.scene.sections import Material, SectionSource, poisson_of, section_source
from kinelast.scene.tables import BoundTable
from kinelast.values.error import fault
from kinelast.values.numbers import real, require, vector
from kinelast.values.units import Quantity
from rigid import LineLoad, Link, Load, Mechanism, SegmentedLaw, TableLaw
from rigid.analysis import Repetition, drives_repeat, mechanism_repeats


class SceneMechanism(Struct, frozen=True, eq=False):
    """A mechanism without loads, the models of its links in the same order, and a law or an effort for each drive."""

    mechanism: Mechanism
    bodies: tuple[LinkModel, ...]
    laws: tuple[DriveLaw | DriveEffort, ...]

    @property
    def links(self) -> Mapping[str, Link]:
        """Links of the scene file by name."""
        return {body.link.name: body.link for body in self.bodies if not body.hidden}


def build_mechanism(table: SceneTable, files: Mapping[str, str]) -> SceneMechanism:
    """Return the mechanism of a scene. `files` contains the texts of the files that it refers to, by name."""
    places = drawn_places(table)
    bodies = build_links(table, places)
    sliders = build_sliders(table, bodies, places)
    bodies = guiding(bodies, sliders)
    links = {name: body.link for name, body in bodies.items()}
    named = {name: body.link for name, body in bodies.items() if not body.hidden}
    drives, laws = build_drives(table, named, sliders, places, files)
    gears = build_gears(table, named, sliders)
    gravity = vector(table.run.gravity or (0.0, 0.0))
    welds = build_welds(table, named, places)
    parts = tuple(links.values()), drives, places, tuple(sliders.values()), gravity
    mechanism = Mechanism(*parts, gears=gears, welds=welds)
    return SceneMechanism(mechanism, tuple(bodies[link.name] for link in mechanism.links), laws)


MAX_FINAL_SPEED = 1e-9  # [rad/s or m/s] a law whose final speed is below this ends at rest
DURATION_TOLERANCE = 1e-9  # a duration counts as one cycle if its relative difference from the period is smaller
MIN_DURATION, MAX_DURATION = 1e-12, 1e12  # [s] shortest and longest run, so that squares of rates do not overflow


def built(
    table: SceneTable, name: str, files: Mapping[str, str], path: str = "", varied: Collection[str] = ()
) -> Scene:
    """Return the scene of parsed tables.

    If numbers in the tables are arrays of several designs, the scene represents all of them, see
    `kinelast.values.numbers`.

    Parameters
    ----------
    files
        Texts of the files that the scene refers to, by name.
    varied
        Names of links with points that differ between designs. Collinear beams of these links are not merged, because
        they may not be collinear in all designs.
    """
    if table.structure_only:
        raise fault("", "structure_only", "the scene only describes a structure: use --structure")
    if table.contacts:
        raise fault("contacts", "", "belongs to a scene with structure_only = true; otherwise use [[gears]]")
    if not table.drives:
        raise fault("drives", "", "the table is missing; a scene needs [[drives]]")
    parts = build_mechanism(table, files)
    laws = [None if isinstance(law, DriveEffort) else law for law in parts.laws]
    repetition = drives_repeat(parts.mechanism, laws)
    run = _run(table, repetition, parts.laws)
    friction = build_friction(table, parts.mechanism)
    if friction and any(isinstance(law, DriveEffort) for law in parts.laws):
        problem = "a drive by effort excludes joint friction: use dampers under [[springs]], or drives by laws"
        raise fault(f"joints.{min(friction)}", "friction", problem)
    mechanism = replace(parts.mechanism, loads=_loads(table, parts, run.duration), friction=friction)
    repeats = (
        repetition if _part_of_a_cycle(table, mechanism, repetition) else mechanism_repeats(mechanism, laws, repetition)
    )
    if repeats is not repetition:
        run = _run(table, repeats, parts.laws)
        mechanism = replace(mechanism, loads=_loads(table, parts, run.duration))
    bodies = undivided(mechanism, parts.bodies, varied)
    mechanism = _with_bodies(mechanism, parts.bodies, bodies)
    beams = [(body, k) for body in bodies for k in range(len(body.sections))]
    made_of = tuple(section_source(table, body.link.name, body.numbers[k]) for body, k in beams)
    materials = materials_of(table, {made.material for made in made_of if made.material})
    assembly = Assembly(table, mechanism, beams, made_of, materials, parts.laws, run.duration,
                        partial(materials_of, table), poisson_of)  # fmt: skip
    built_parts = {part.key: part.build(assembly) for part in PARTS}
    pushes = [load for part in PARTS for load in part.loads(assembly, built_parts[part.key])]
    mechanism = replace(mechanism, loads=(*mechanism.loads, *pushes)) if pushes else mechanism
    scene = Scene(
        name=name,
        title=table.title or name.replace("_", " "),
        source=table.source,
        course=_course(mechanism, parts.laws, run, path),
        sections=tuple(body.sections[k].rigid if body.rigid else body.sections[k].section for body, k in beams),
        labels=tuple(_label(body, k) for body, k in beams),
        joints=build_joints(table, mechanism),
        materials={material: _material(stuff, material) for material, stuff in materials.items()},
        outlines={body.link.name: body.outline for body in parts.bodies if body.outline},
        bounds=figure_bounds(table, table.limits.figures, "limits.figures"),
        output=build_output(table, mechanism),
        settled=build_settled(table, mechanism),
        made_of=made_of,
        theory=_theory(table, materials, made_of),
        report_units=table.run.report_units or {"mm": "mm", "in": "in"}.get(table.units, "SI"),
        written=written_units(table),
        parts=built_parts,
    )
    return replace(scene, limits=tuple(limits_in(table, scene)))


def _part_of_a_cycle(table: SceneTable, mechanism: Mechanism, drives: Repetition) -> bool:
    """Return True if designs have different points and the run is shorter than a cycle of the mechanism.

    Such designs are solved quasi-statically, so the exact period is not needed.
    """
    places = (point for link in mechanism.links for point in link.points.values())
    if table.run.duration is None or not any(np.ndim(place) for place in places):
        return False
    return bool(np.all(real(table.run.duration) < (1.0 - DURATION_TOLERANCE) * drives.period))


FILE_UNITS = ("rad", "rad/s", "m^3/s")  # for these dimensions, the report uses the units of the file


def written_units(table: SceneTable) -> dict[str, tuple[float, str]]:
    """Return the units that a file uses most for angles, angular speeds and flows, by SI unit."""
    bounds = [*table.limits.figures.values(), *table.optimize.limits.values()]
    every = [*leaves(table, Quantity), *(each for bound in bounds for each in _in_file_units(bound))]
    names = Counter((each.unit, each.written) for each in every if each.unit in FILE_UNITS and each.written)
    most = {unit: name for (unit, name), _ in reversed(names.most_common())}
    return {unit: (1.0 / Quantity.of_unit(unit, f"1 {name}"), name) for unit, name in most.items() if name != unit}


class _FileUnit(Quantity, units=FILE_UNITS):
    """An angle, an angular speed or a flow."""


def _in_file_units(bound: Any) -> Iterator[Quantity]:
    """Yield the angles, angular speeds and flows among the bounds on a result."""
    for amount in (bound.most, bound.least) if isinstance(bound, BoundTable) else (bound,):
        with suppress(ValueError):
            yield _FileUnit.read(amount)


def _with_bodies(mechanism: Mechanism, before: Sequence[LinkModel], bodies: Sequence[LinkModel]) -> Mechanism:
    """Return the mechanism with links in which collinear beams are merged, as returned by `undivided`.

    Loads along beams get the numbers of the merged beams.
    """
    if all(new is old for new, old in zip(bodies, before, strict=True)):
        return mechanism
    numbers = {body.link.name: body.numbers for body in bodies}
    loads = tuple(
        replace(load, beam=numbers[load.link].index(load.beam)) if isinstance(load, LineLoad) else load
        for load in mechanism.loads
    )
    return replace(mechanism, links=tuple(body.link for body in bodies), loads=loads)


def _course(mechanism: Mechanism, laws: tuple[DriveLaw | DriveEffort, ...], run: Run, path: str) -> Course:
    """Return the `Course` of a mechanism, which computes the motion over time.

    The motion is integrated if the scene gives the effort of a drive.
    """
    known = tuple(law for law in laws if not isinstance(law, DriveEffort))
    if len(known) == len(laws):
        return CourseByLaws(mechanism, known, run, path)
    return IntegratedCourse(mechanism, laws, run, path)


def _theory(table: SceneTable, stuff: Mapping[str, MaterialTable], made_of: tuple[SectionSource, ...]) -> Theory:
    run = table.run
    if run.theory and run.accuracy is not None:
        raise fault("run", "accuracy", "chooses the theory: give either accuracy or theory")
    own = (stuff[made.material].damping if made.material in stuff else None for made in made_of)
    accuracy = None if run.accuracy is None else float(run.accuracy)
    beta = tuple(nan if each is None else real(each) for each in own)
    return Theory(run.theory, accuracy, run.damping_ratio or DAMPING_RATIO, beta)


def _material(stuff: MaterialTable, name: str) -> Material:
    limit = None if stuff.yield_stress is None else real(stuff.yield_stress)
    return Material(real(stuff.E), real(stuff.density), limit, poisson_of(stuff, name))


def _loads(table: SceneTable, parts: SceneMechanism, duration: float) -> tuple[Load | LineLoad, ...]:
    links, sliders = parts.links, parts.mechanism.slider_points
    loads = [build_load(number, load, links, sliders, duration) for number, load in enumerate(table.loads, 1)]
    return *loads, *(build_spring(number, spring, links) for number, spring in enumerate(table.springs, 1))


def _label(body: LinkModel, number: int) -> str:
    return body.link.name if len(body.sections) == 1 else f"{body.link.name}.{number + 1}"


def _run(table: SceneTable, repetition: Repetition, laws: tuple[DriveLaw | DriveEffort, ...]) -> Run:
    """Return the times of the run.

    If the scene gives no duration, it lasts one cycle. If there is no cycle, it lasts one turn of a steady drive or,
    without a steady drive, as long as the longest law.
    """
    lasting = [law.duration for law in laws if isinstance(law, SegmentedLaw | TableLaw)]
    no_cycle = repetition.reason if repetition.turn is not None else ""
    given = table.run.duration is not None
    more = table.run.tolerance, table.run.steps, repetition.period, no_cycle, given
    if table.run.duration is not None:
        duration = real(table.run.duration)
        turn = bool(np.all(np.abs(duration - repetition.period) <= DURATION_TOLERANCE * duration))
    elif repetition.turn is not None:
        turn = not no_cycle
        duration = repetition.period if turn else repetition.turn
    elif lasting:
        duration, turn = max(lasting), False
    else:
        problem = "the key is missing: without a drive that turns at constant speed, a run needs a duration"
        problem += ', as in "50 ms", or "1 s" for a machine at rest'
        raise fault("run", "duration", problem)
    run = Run(table.run.positions, duration, turn, *more)
    lasts = (run.duration >= MIN_DURATION) & (run.duration <= MAX_DURATION)
    expected = f"expected a run of {MIN_DURATION:g} to {MAX_DURATION:g} s"
    require(lasts, "run", "duration", lambda of: f"{expected}, got {of(run.duration):.6g} s")
    for at, law in enumerate(laws, 1):
        if isinstance(law, SegmentedLaw | TableLaw) and abs(law.final_speed) > MAX_FINAL_SPEED:
            _require_rest(f"drives[{at}]", law, run.duration)
    return run


def _require_rest(where: str, law: SegmentedLaw | TableLaw, duration: Any) -> None:
    """Raise SceneError if the run is longer than the law of a drive that does not end at rest."""
    key, piece = ("law", "segment") if isinstance(law, SegmentedLaw) else ("motion", "entry")
    ends = f"ends at full speed after {law.duration:g} s, but the run lasts"
    within = duration <= law.duration * (1 + 1e-12)
    require(within, where, key, lambda of: f"{ends} {of(duration):g} s: add a {piece}")
